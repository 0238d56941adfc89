# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""Keeps an FCL worker running: replaces it when it is lost, finds the pair that did it, knows when to rest."""

from __future__ import annotations

import importlib.util
import threading
import time
from collections import deque
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from geomsrv import fcl_worker
from geomsrv._fcl_process import PACKAGES, WORKER_COMMAND, FclProcess, FclUnavailableError, WorkerLostError
from geomsrv._judge import Solid

__all__ = ["FclSupervisor", "NoReply"]

FloatArray = NDArray[np.float64]

# Pairs per message: 16 KiB of requests, below the 64 KiB that a pipe takes without being read.
BATCH_PAIRS = 256

# A worker that was lost is replaced after a pause that doubles from the first to the second of these [s]; after
# this many losses within a minute FCL is left alone until the minute is over.
RESTART_PAUSE_S = 0.05, 2.0
MAX_LOSSES_PER_MINUTE = 10


class NoReply(IntEnum):
    """Outcomes of pairs that got no reply; numbered on from `fcl_worker.Outcome`."""

    TIMED_OUT = 3
    WORKER_DIED = 4
    BACKING_OFF = 5
    UNAVAILABLE = 6
    STOPPED = 7


class FclSupervisor:
    """Answers pairs through FCL, whatever FCL does to its process.

    One thread asks; `stop` and the properties are for any thread.

    Parameters
    ----------
    timeout_s : float
        Longest time FCL may take for one pair [s].
    peer : str
        "coal" to ask Coal in FCL's place.
    """

    def __init__(self, timeout_s: float, peer: str = "fcl") -> None:
        self._timeout_s = timeout_s
        self._peer = peer
        self._reason = _missing(peer)
        # Guards what follows; notified on stopping.
        self._changed = threading.Condition()
        self._stopping = False
        self._process: FclProcess | None = None
        self._starts = 0
        self._last_loss = ""
        self._losses: deque[float] = deque(maxlen=MAX_LOSSES_PER_MINUTE)

    @property
    def reason(self) -> str:
        """Why FCL cannot be used; empty if it can, as far as known."""
        return self._reason

    @property
    def restarts(self) -> int:
        """How often the worker was started again."""
        return max(0, self._starts - 1)

    @property
    def last_loss(self) -> str:
        """How the worker was lost last, with its last words; empty if it never was."""
        return self._last_loss

    @property
    def pid(self) -> int | None:
        """Process id of the worker; None if there is none."""
        process = self._process
        return None if process is None else process.pid

    def ask(
        self, solids: list[tuple[Solid, Solid]], poses: FloatArray, steps: FloatArray | None = None
    ) -> NDArray[np.void]:
        """One `fcl_worker.REPLY` per pair, poses of b in a (n, 7); outcomes include those of `NoReply`.

        With `steps` (n, 3), b moves by that much as seen from a.
        """
        requests = np.zeros(len(solids), fcl_worker.REQUEST)
        requests["a"], requests["b"] = [a.number for a, _ in solids], [b.number for _, b in solids]
        requests["pose"], requests["step"] = poses, np.nan if steps is None else steps
        replies = np.zeros(len(solids), fcl_worker.REPLY)
        replies["distance"] = np.nan
        start, suspect = 0, -1
        while start < len(solids):
            worker = self._worker()
            if isinstance(worker, NoReply):
                replies["outcome"][start:] = worker
                break
            stop = start + BATCH_PAIRS
            try:
                worker.teach([solid for pair in solids[start:stop] for solid in pair])
                replies[start:stop] = worker.ask(requests[start:stop])
                start = stop
            except WorkerLostError as lost:
                self._lost(lost)
                replies[start : start + len(lost.replies)] = lost.replies
                start += len(lost.replies)
                # Whatever killed the worker need not be the pair it was at: that gets a second chance.  A pair
                # that took too long gets none.
                if lost.timed_out or start == suspect:
                    replies["outcome"][start] = NoReply.TIMED_OUT if lost.timed_out else NoReply.WORKER_DIED
                    start += 1
                else:
                    suspect = start
        return replies

    def stop(self) -> None:
        """End the worker now; whoever is asking gets `NoReply.STOPPED` for the rest."""
        with self._changed:
            self._stopping = True
            self._changed.notify_all()
            if self._process is not None:
                self._process.kill()

    def close(self) -> None:
        """Reap the worker; for the thread that asks."""
        with self._changed:
            process, self._process = self._process, None
        if process is not None:
            process.close()

    def _worker(self) -> FclProcess | NoReply:
        """A worker that is ready, or the outcome of pairs that cannot have one."""
        while True:
            with self._changed:
                while not self._stopping and 0.0 < (pause := self._pause()) <= RESTART_PAUSE_S[1]:
                    self._changed.wait(pause)
                if self._stopping:
                    return NoReply.STOPPED
                if self._reason:
                    return NoReply.UNAVAILABLE
                if self._process is not None:
                    return self._process
                if self._pause() > 0.0:
                    return NoReply.BACKING_OFF
            try:
                process = FclProcess(self._timeout_s, WORKER_COMMAND, self._peer)
                self._adopt(process)
                process.wait_until_ready()
            except FclUnavailableError as error:
                self._reason = str(error)
            except WorkerLostError as lost:
                self._lost(lost)

    def _adopt(self, process: FclProcess) -> None:
        """From here on `stop` can end the process, if it has not come by already."""
        with self._changed:
            self._process = process
            self._starts += 1
            if self._stopping:
                process.kill()

    def _pause(self) -> float:
        """How long to wait before a worker may start [s]; the lock is held."""
        if self._process is not None or not self._losses:
            return 0.0
        now = time.monotonic()
        recent = [moment for moment in self._losses if now - moment < 60.0]
        if len(recent) >= MAX_LOSSES_PER_MINUTE:
            return recent[0] + 60.0 - now
        first, longest = RESTART_PAUSE_S
        return self._losses[-1] + min(first * 2.0 ** (len(recent) - 1), longest) - now

    def _lost(self, lost: WorkerLostError) -> None:
        """Put the dead worker away."""
        with self._changed:
            if not self._stopping:
                self._losses.append(time.monotonic())
                self._last_loss = str(lost)
        self.close()


def _missing(peer: str) -> str:
    """Why a peer cannot be used, as far as that shows without loading it; empty if it may be there."""
    try:
        found = importlib.util.find_spec(peer) is not None
    except (ImportError, ValueError):
        found = False
    return "" if found else f"{PACKAGES[peer]} is not installed (pip install {PACKAGES[peer]})"
