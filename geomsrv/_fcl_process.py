# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""The parent's side of the FCL worker: start it, ask it, notice that it died.  It never restarts it."""

from __future__ import annotations

import os
import select
import signal
import subprocess
import sys
import time
from collections.abc import Sequence
from contextlib import suppress

import numpy as np
from numpy.typing import NDArray

from geomsrv import fcl_worker
from geomsrv._judge import Solid

__all__ = ["PACKAGES", "FclProcess", "FclUnavailableError", "WorkerLostError"]

# Python, numpy and FCL load in 0.3 s on an idle laptop core; a hundred times that is not slow but stuck.
START_TIMEOUT_S = 30.0

# The worker's own alarm ends a pair that hangs.  This much later the parent stops waiting for a worker that
# does not even die, because it is stopped or starved.
GRACE_S = 2.0

# After stdin is closed an idle worker leaves within milliseconds.
EXIT_TIMEOUT_S = 0.5

# What is kept of the worker's last words.
STDERR_BYTES = 2000

# Shapes the worker keeps; with more it starts afresh.
MAX_SHAPES = 4096

# What pip calls the peers.
PACKAGES = {"fcl": "python-fcl", "coal": "coal"}


class FclUnavailableError(Exception):
    """The peer cannot be loaded, and a new worker could not either."""


class WorkerLostError(Exception):
    """The worker died or hung.

    Attributes
    ----------
    replies : (k,) `fcl_worker.REPLY`
        Answers received before; the pair after them is the one that it was working on.
    timed_out : bool
        Whether it was stopped by the clock.
    """

    def __init__(self, message: str, replies: NDArray[np.void], timed_out: bool) -> None:
        super().__init__(message)
        self.replies = replies
        self.timed_out = timed_out


class FclProcess:
    """One worker process.  For one thread, but for `kill`, which any thread may call.

    Parameters
    ----------
    timeout_s : float
        Longest time for one pair [s].
    command : tuple of str
        What to run; the time limit and the peer's name are appended.
    peer : str
        "fcl" or "coal".

    Raises
    ------
    FclUnavailableError
        It cannot be started.
    """

    def __init__(self, timeout_s: float, command: tuple[str, ...], peer: str = "fcl") -> None:
        self._timeout_s = timeout_s
        self._peer = peer
        self._known: set[int] = set()
        self._last_words = b""
        environment = dict(os.environ)
        # The environment is inherited, LD_LIBRARY_PATH included.  The worker's own folder holds modules named
        # like everybody's ("errors", "shapes") and must not get onto its path.  One pair at a time needs one
        # thread.
        environment |= {"PYTHONSAFEPATH": "1", "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
        try:
            self._process = subprocess.Popen(
                [*command, repr(timeout_s), peer],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.PIPE,
                bufsize=0,
                env=environment,
                # Ctrl-C in the terminal is for the parent; the worker ends when its stdin does.
                start_new_session=True,
            )
        except OSError as error:
            raise FclUnavailableError(f"cannot start the {peer} worker: {error}") from error
        assert self._process.stdin and self._process.stdout and self._process.stderr
        self._stdin, self._stdout, self._stderr = (
            stream.fileno() for stream in (self._process.stdin, self._process.stdout, self._process.stderr)
        )
        for descriptor in (self._stdin, self._stdout, self._stderr):
            os.set_blocking(descriptor, False)
        self.version = ""

    @property
    def pid(self) -> int:
        """Process id."""
        return self._process.pid

    def wait_until_ready(self) -> None:
        """Wait until the peer is loaded, and note its version.

        Raises
        ------
        FclUnavailableError
            With the reason.
        WorkerLostError
        """
        data = b""
        size = header = fcl_worker.HEADER.size
        deadline = time.monotonic() + START_TIMEOUT_S
        tag = b""
        while len(data) < size:
            data += self._receive(size - len(data), deadline - time.monotonic())
            if len(data) == header:
                tag, length = fcl_worker.HEADER.unpack(data)
                size += length
        text = data[header:].decode(errors="replace")
        if tag == b"E":
            raise FclUnavailableError(f"{PACKAGES[self._peer]} cannot be loaded: {text}")
        self.version = text

    def teach(self, solids: Sequence[Solid]) -> None:
        """Give the worker the shapes it does not have."""
        new = {solid.number: solid for solid in solids if solid.number not in self._known}
        if new and len(self._known) + len(new) > MAX_SHAPES:
            self._send(b"F", b"")
            self._known.clear()
            new = {solid.number: solid for solid in solids}
        for number, solid in new.items():
            definition = fcl_worker.DEFINITION.pack(number, solid.kind.encode(), *solid.packed.params[0])
            self._send(b"D", definition + solid.packed.vertices.tobytes())
            self._known.add(number)

    def ask(self, rows: NDArray[np.void]) -> NDArray[np.void]:
        """One `fcl_worker.REPLY` per `fcl_worker.REQUEST`.

        Keep the batch below a pipe's 64 KiB: the worker reads nothing while it answers.
        """
        self._send(b"P", rows.tobytes())
        size = fcl_worker.REPLY.itemsize
        data = bytearray()
        while len(data) < size * len(rows):
            try:
                data += self._receive(size * len(rows) - len(data), self._timeout_s + GRACE_S)
            except WorkerLostError as lost:
                whole = len(data) // size
                lost.replies = np.frombuffer(bytes(data[: whole * size]), fcl_worker.REPLY)
                raise
        return np.frombuffer(bytes(data), fcl_worker.REPLY)

    def kill(self) -> None:
        """End the process now; whoever waits for it gets a `WorkerLostError`."""
        with suppress(OSError):
            self._process.kill()

    def close(self) -> None:
        """End the process and reap it; takes at most a fraction of a second."""
        streams = (self._process.stdin, self._process.stdout, self._process.stderr)
        if streams[0] is not None:
            streams[0].close()
        try:
            self._process.wait(EXIT_TIMEOUT_S)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        for stream in streams:
            if stream is not None:
                stream.close()

    def _send(self, tag: bytes, payload: bytes) -> None:
        """Write a message; a worker that does not read is lost."""
        data = memoryview(fcl_worker.HEADER.pack(tag, len(payload)) + payload)
        while data:
            self._wait(self._stdin, select.POLLOUT, self._timeout_s + GRACE_S)
            try:
                data = data[os.write(self._stdin, data) :]
            except BlockingIOError:
                continue
            except BrokenPipeError:
                raise self._lost() from None

    def _receive(self, size: int, timeout_s: float) -> bytes:
        """At least one and at most `size` bytes."""
        self._wait(self._stdout, select.POLLIN, timeout_s)
        data = os.read(self._stdout, size)
        if not data:
            raise self._lost()
        return data

    def _wait(self, descriptor: int, event: int, timeout_s: float) -> None:
        """Until `descriptor` is ready; keeps what arrives on stderr meanwhile, so that it never fills up."""
        deadline = time.monotonic() + timeout_s
        poller = select.poll()
        poller.register(descriptor, event)
        poller.register(self._stderr, select.POLLIN)
        while (left := deadline - time.monotonic()) > 0.0:
            ready = [number for number, _ in poller.poll(1000.0 * left)]
            if self._stderr in ready and not self._read_stderr():
                poller.unregister(self._stderr)
            if descriptor in ready:
                return
        raise self._lost(overdue=True)

    def _read_stderr(self) -> bool:
        """Keep the tail; False at its end."""
        try:
            words = os.read(self._stderr, 65536)
        except BlockingIOError:
            return True
        self._last_words = (self._last_words + words)[-STDERR_BYTES:]
        return bool(words)

    def _lost(self, overdue: bool = False) -> WorkerLostError:
        """What happened to the worker; makes sure that it is dead."""
        if overdue:
            self._process.kill()
        # Its pipes are closed, so it is a zombie already or about to be one.
        try:
            code = self._process.wait(EXIT_TIMEOUT_S)
        except subprocess.TimeoutExpired:
            self._process.kill()
            code = self._process.wait()
        while self._read_stderr() and select.select([self._stderr], [], [], 0)[0]:
            pass
        by_clock = overdue or code == -signal.SIGALRM
        if by_clock:
            what = f"did not answer within {self._timeout_s:g} s"
        else:
            what = f"died: {signal.Signals(-code).name if code < 0 else f'exit status {code}'}"
        words = self._last_words.decode(errors="replace").strip()
        return WorkerLostError(
            f"{self._peer} worker {what}{f'; {words}' if words else ''}", np.zeros(0, fcl_worker.REPLY), by_clock
        )


WORKER_COMMAND = (sys.executable, fcl_worker.__file__)
