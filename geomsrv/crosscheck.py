# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""Cross-check: re-run distance and intersection through FCL beside the engine, and count where they differ.

`CrossCheck.submit` copies a few rows and returns.  A thread hands them to a worker process, judges what comes
back (`geomsrv._judge`), and replaces the worker when FCL aborts, hangs or segfaults: that costs one pair,
never the caller. It is a thread, rather than pipes polled by the caller, because a worker that hangs must be
replaced on time however seldom the caller looks; it spends its time waiting.
"""

from __future__ import annotations

import importlib.util
import logging
import threading
import time
from collections import Counter, deque
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from enum import StrEnum
from types import TracebackType
from typing import TYPE_CHECKING, Self
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import ArrayLike, NDArray

from geomsrv import _validate, fcl_worker
from geomsrv._fcl_process import WORKER_COMMAND, FclProcess, FclUnavailableError, WorkerLostError
from geomsrv._judge import (
    JITTER_DIRECTIONS,
    PEERS,
    AnyShape,
    Claim,
    Rows,
    Solid,
    Verdict,
    explain,
    first_sight,
    jittered,
    pair_kind,
    scales,
)
from geomsrv._witness import Placed, bracket
from geomsrv.answers import Distances, DistanceStatus
from geomsrv.errors import GeometryError
from geomsrv.shapes import pack

if TYPE_CHECKING:
    from geomsrv.scene import PairDistances, Scene

__all__ = ["CrossCheck", "Difference", "KindTally", "Mode", "SkipReason", "Tally", "cross_check_scene"]

FloatArray = NDArray[np.float64]

# Pairs per message: 16 KiB of requests, below the 64 KiB that a pipe takes without being read.
BATCH_PAIRS = 256

# A worker that died is replaced after a pause that doubles from the first to the second of these [s]; after
# this many deaths within a minute FCL is left alone until the minute is over.
RESTART_PAUSE_S = 0.05, 2.0
MAX_DEATHS_PER_MINUTE = 10

# Differences kept for `CrossCheck.poll`, and, of either sort, for `Tally.recent`.
MAX_UNPOLLED = 1000
MAX_RECENT = 10

# Outcomes of pairs that got no reply, numbered on from the worker's own.
_TIMED_OUT, _WORKER_DIED, _BACKING_OFF, _UNAVAILABLE, _CLOSED = range(3, 8)

_log = logging.getLogger(__name__)


class Mode(StrEnum):
    """How many of the answers are re-run through FCL."""

    OFF = "off"  #: none; no process is started
    SAMPLE = "sample"  #: a seeded random sample
    ALL = "all"  #: every pair


class SkipReason(StrEnum):
    """Why a submitted pair was not judged."""

    UNAVAILABLE = "python-fcl is not available"
    UNSUPPORTED_HERE = "no kernel for this pair here"
    UNSUPPORTED_BY_FCL = "fcl is not asked about this pair"
    TOO_CLOSE = "too close to call"
    DROPPED = "queue full"
    STALE = "the scene has changed since"
    TIMED_OUT = "fcl timed out"
    WORKER_DIED = "fcl worker died"
    BACKING_OFF = "fcl worker died too often lately"
    FCL_ERROR = "fcl raised an error"
    CLOSED = "cross-check closed"


_NO_VERDICT = {
    int(fcl_worker.Outcome.FAILED): SkipReason.FCL_ERROR,
    _TIMED_OUT: SkipReason.TIMED_OUT,
    _WORKER_DIED: SkipReason.WORKER_DIED,
    _BACKING_OFF: SkipReason.BACKING_OFF,
    _UNAVAILABLE: SkipReason.UNAVAILABLE,
    _CLOSED: SkipReason.CLOSED,
}


@dataclass(frozen=True, eq=False)
class Difference:
    """One pair on which FCL and the engine differ by more than the declared tolerance.

    Attributes
    ----------
    kind : str
        Pair kind, names in alphabetical order: "box-sphere".
    label : str
        The caller's name of the pair; may be empty.
    question : str
        "distance", "intersects", or "interval" if our distance is outside of our own interval.
    shape_a, shape_b : Shape
    pose_ab : (7,) float64
        Pose of b in a: x y z [m], qx qy qz qw.
    distance, lower, upper : float
        Our answer [m].
    fcl_intersects : bool
    fcl_distance : float
        [m]; NaN where FCL was not asked or sees a contact.
    explained : bool
        True if FCL is shown to be wrong, by `reason`.
    reason : str
        What decided that, in words.
    """

    kind: str
    label: str
    question: str
    shape_a: AnyShape
    shape_b: AnyShape
    pose_ab: FloatArray
    distance: float
    lower: float
    upper: float
    fcl_intersects: bool
    fcl_distance: float
    explained: bool
    reason: str

    def reproducer(self) -> str:
        """Python expression that repeats the query; floats in hex, so that no bit is lost.

        It needs ``import geomsrv as gs`` and ``h = float.fromhex``.
        """
        shapes = ", ".join(_expression(shape) for shape in (self.shape_a, self.shape_b))
        return f"gs.distance({shapes}, {_hex(self.pose_ab)}, want=('penetration',))"

    def __str__(self) -> str:
        """One line for logs."""
        theirs = "contact" if self.fcl_intersects else f"{self.fcl_distance:.9g} m"
        return (
            f"{self.kind}{f' ({self.label})' if self.label else ''}: {self.question} differs, here "
            f"{self.distance:.9g} m in [{self.lower:.9g}, {self.upper:.9g}], fcl {theirs}; "
            f"{'explained' if self.explained else 'UNEXPLAINED'}: {self.reason}"
        )


def _hex(value: ArrayLike) -> str:
    """``h('0x1p+0')``, lists for arrays."""
    if np.ndim(value) == 0:
        return f"h('{float(value).hex()}')"  # type: ignore[arg-type]
    return f"[{', '.join(_hex(row) for row in np.asarray(value))}]"


def _expression(shape: AnyShape) -> str:
    """Constructor call that makes `shape` again."""
    fields = {
        "sphere": ("radius",),
        "capsule": ("radius", "length"),
        "box": ("half_extents",),
        "half_space": ("normal", "offset"),
    }
    if shape.kind in fields:
        values = [_hex(getattr(shape, name)) for name in fields[shape.kind]]
        return f"gs.{type(shape).__name__}({', '.join(values)})"
    return f"gs.Convex({_hex(pack([shape]).vertices)})"


@dataclass
class KindTally:
    """Verdicts on the pairs of one kind; they add up to the pairs taken."""

    agreed: int = 0
    explained: int = 0  #: differences shown to be FCL's fault
    unexplained: int = 0  #: differences that nobody has accounted for: look at these
    skipped: int = 0

    @property
    def disagreed(self) -> int:
        """All differences."""
        return self.explained + self.unexplained


@dataclass(frozen=True)
class Tally:
    """Snapshot of the counters.

    Attributes
    ----------
    mode : Mode
    available : bool
        Whether python-fcl can be used.
    message : str
        Why not; empty if it can.
    offered : int
        Pairs given to `CrossCheck.submit`; equals ``not_sampled + pending`` plus all verdicts.
    not_sampled : int
        Pairs that mode "sample" left out.
    pending : int
        Pairs without a verdict yet.
    kinds : dict of str to KindTally
        Verdicts by pair kind, "box-sphere".
    reasons : dict of SkipReason to int
        Skipped pairs by reason.
    restarts : int
        How often the worker was started again after it died or hung.
    last_loss : str
        How the worker was lost last, with the end of what it wrote to stderr; empty if it never was.
    recent : tuple of Difference
        The last explained and the last unexplained differences; unexplained ones come last.
    """

    mode: Mode
    available: bool
    message: str
    offered: int = 0
    not_sampled: int = 0
    pending: int = 0
    kinds: dict[str, KindTally] = field(default_factory=dict)
    reasons: dict[SkipReason, int] = field(default_factory=dict)
    restarts: int = 0
    last_loss: str = ""
    recent: tuple[Difference, ...] = ()

    @property
    def agreed(self) -> int:
        """Pairs on which both agree."""
        return sum(kind.agreed for kind in self.kinds.values())

    @property
    def explained(self) -> int:
        """Differences shown to be FCL's fault."""
        return sum(kind.explained for kind in self.kinds.values())

    @property
    def unexplained(self) -> int:
        """Differences that nobody has accounted for."""
        return sum(kind.unexplained for kind in self.kinds.values())

    @property
    def skipped(self) -> int:
        """Pairs taken but not judged."""
        return sum(kind.skipped for kind in self.kinds.values())

    def summary(self) -> str:
        """One line for logs and diagnostics."""
        if self.mode == Mode.OFF:
            return "cross-check off"
        if not self.available:
            return f"cross-check {self.mode}: {self.message}"
        parts = [f"{self.agreed} agreed", f"{self.explained} explained", f"{self.unexplained} unexplained"]
        if self.skipped:
            reasons = ", ".join(f"{count} {reason}" for reason, count in sorted(self.reasons.items()))
            parts.append(f"{self.skipped} skipped ({reasons})")
        if self.pending:
            parts.append(f"{self.pending} pending")
        if self.restarts:
            parts.append(f"{self.restarts} restarts")
        return f"cross-check {self.mode}: {', '.join(parts)}"


# ------------------------------------------------------------------------------------------------- the check


class CrossCheck:
    """Compares answers with FCL in the background.

    Thread-safe.  `submit`, `poll` and `tally` never wait for FCL.  Use it as a context manager, or call
    `close`.

    Parameters
    ----------
    mode : str
        "off", "sample" or "all".
    sample_fraction : float
        Share of the pairs that mode "sample" takes, in [0, 1].
    timeout_s : float
        Longest time FCL may take for one pair [s]; then its process is replaced and the pair skipped.
    queue_limit : int
        Most pairs that may wait; those beyond, chosen at random, are dropped and counted.
    seed : int
        Seed of the sample.

    Attributes
    ----------
    mode : Mode
    available : bool
        Whether python-fcl can be used; in mode "off" nobody looked.
    reason : str
        Why not; empty if it can.

    Raises
    ------
    GeometryError
        Names the argument and the fault.

    Examples
    --------
    >>> import geomsrv as gs
    >>> from geomsrv.crosscheck import CrossCheck
    >>> with CrossCheck("off") as check:
    ...     print(check.tally().summary())
    cross-check off
    """

    _command = WORKER_COMMAND

    def __init__(
        self,
        mode: str = "off",
        *,
        sample_fraction: float = 0.1,
        timeout_s: float = 1.0,
        queue_limit: int = 1000,
        seed: int = 0,
    ) -> None:
        if mode not in tuple(Mode):
            raise GeometryError(f"mode must be one of {', '.join(Mode)}, got {mode!r}")
        self.mode = Mode(mode)
        self._fraction = _validate.scalar(sample_fraction, "sample_fraction", minimum=0.0)
        if self._fraction > 1.0:
            raise GeometryError(f"sample_fraction must be <= 1, got {self._fraction}")
        self._timeout_s = _validate.scalar(timeout_s, "timeout_s", positive=True)
        self._queue_limit = int(_validate.scalar(queue_limit, "queue_limit", minimum=1.0))
        self._random = np.random.default_rng(seed)
        self.reason = "" if self.mode == Mode.OFF else _fcl_is_missing()
        self.available = not self.reason

        # Guards all that follow; notified when work arrives, when it is done, and on closing.
        self._changed = threading.Condition()
        self._queue: deque[Rows] = deque()
        self._offered = self._not_sampled = self._pending = self._starts = 0
        self._kinds: dict[str, KindTally] = {}
        self._reasons: Counter[SkipReason] = Counter()
        self._unpolled: deque[Difference] = deque(maxlen=MAX_UNPOLLED)
        self._recent = {explained: deque[Difference](maxlen=MAX_RECENT) for explained in (True, False)}
        self._last_loss = ""
        self._closing = False
        self._process: FclProcess | None = None
        self._thread: threading.Thread | None = None

        # The thread's own.
        self._solids: WeakKeyDictionary[AnyShape, Solid] = WeakKeyDictionary()
        self._next_number = 0
        self._deaths: deque[float] = deque(maxlen=MAX_DEATHS_PER_MINUTE)

    # ---------------------------------------------------------------------------------------- for the caller

    def submit(
        self,
        shapes: Sequence[tuple[AnyShape, AnyShape]],
        poses_ab: ArrayLike,
        answers: Distances,
        labels: Sequence[str] | None = None,
    ) -> int:
        """Queue answers for comparison; returns at once.

        Parameters
        ----------
        shapes : sequence of (Shape, Shape)
            n pairs, or one pair for all.
        poses_ab : (n, 7) float
            Poses of b in a, as the query got them.
        answers : Distances
            What the engine said, points and normals in the frame of a.  With ``want=("penetration",)`` a deep
            overlap can be told from a touch; without, an answer of 0 is compared as "in contact, depth
            unknown".
        labels : sequence of str, optional
            Names of the pairs, for the reports.

        Returns
        -------
        int
            How many pairs were queued; in mode "off" always 0.

        Raises
        ------
        GeometryError
            Names the argument and the fault.
        """
        if self.mode == Mode.OFF:
            return 0
        poses = _validate.poses(poses_ab, "poses_ab")
        count = len(poses)
        pairs = list(shapes) * count if len(shapes) == 1 else list(shapes)
        names = [""] * count if labels is None else list(labels)
        for name, given in (("shapes", pairs), ("answers", answers.distance), ("labels", names)):
            if len(given) != count:
                raise GeometryError(
                    f"{name} must have one item per row of poses_ab, got {len(given)} and {count}"
                )
        chosen = self._choose(count)
        rows = Rows(
            shapes=[pairs[i] for i in chosen],
            labels=[names[i] for i in chosen],
            poses=poses[chosen],
            distance=answers.distance[chosen],
            lower=answers.lower[chosen],
            upper=answers.upper[chosen],
            point_a=answers.point_a[chosen],
            point_b=answers.point_b[chosen],
            normal=answers.normal[chosen],
            unsupported=answers.status[chosen] == DistanceStatus.UNSUPPORTED,
            far=np.zeros(len(chosen)),
        )
        return self._enqueue(rows, count - len(chosen))

    def submit_scene(self, scene: Scene, pairs: PairDistances) -> int:
        """Queue what `Scene.distances` answered; returns at once.

        Call it before the scene changes: the shapes and poses are read from `scene`, and if it has moved on,
        the pairs are counted as skipped.

        Parameters
        ----------
        scene : Scene
        pairs : PairDistances
            Of this scene; ``want=("penetration",)`` tells a deep overlap from a touch.

        Returns
        -------
        int
            How many pairs were queued; in mode "off" always 0.
        """
        if self.mode == Mode.OFF:
            return 0
        chosen = self._choose(len(pairs))
        names = [(pairs.ids_a[i], pairs.ids_b[i]) for i in chosen]
        objects = {}
        for name in {name for pair in names for name in pair}:
            if name in scene:
                objects[name] = scene[name]
        if scene.version != pairs.version:
            with self._changed:
                self._offered += len(pairs)
                self._not_sampled += len(pairs) - len(chosen)
                self._of_kind("unknown").skipped += len(chosen)
                self._reasons[SkipReason.STALE] += len(chosen)
            return 0
        sides = [[objects[pair[k]] for pair in names] for k in (0, 1)]
        poses_a, poses_b = (
            np.array([side.pose for side in objects], np.float64).reshape(-1, 7) for objects in sides
        )
        rotation = _validate.rotation_matrices(poses_a[:, 3:])
        origin = poses_a[:, :3]

        def local(vectors: FloatArray) -> FloatArray:
            turned: FloatArray = np.einsum("nji,nj->ni", rotation, vectors)
            return turned

        rows = Rows(
            shapes=[(a.shape, b.shape) for a, b in zip(*sides, strict=True)],
            labels=[f"{a} / {b}" for a, b in names],
            poses=np.hstack(
                [local(poses_b[:, :3] - origin), _relative_rotation(poses_a[:, 3:], poses_b[:, 3:])]
            ),
            distance=pairs.distance[chosen],
            lower=pairs.lower[chosen],
            upper=pairs.upper[chosen],
            point_a=local(pairs.point_a[chosen] - origin),
            point_b=local(pairs.point_b[chosen] - origin),
            normal=local(pairs.normal[chosen]),
            unsupported=np.zeros(len(chosen), dtype=bool),
            far=np.linalg.norm(origin, axis=1) + np.linalg.norm(poses_b[:, :3], axis=1),
        )
        return self._enqueue(rows, len(pairs) - len(chosen))

    def poll(self) -> list[Difference]:
        """Differences found since the last call, the last `MAX_UNPOLLED` of them; never waits."""
        with self._changed:
            found = list(self._unpolled)
            self._unpolled.clear()
        return found

    def drain(self, timeout_s: float = 60.0) -> bool:
        """Wait until every queued pair has its verdict; False if that took longer than `timeout_s` [s]."""
        with self._changed:
            return self._changed.wait_for(lambda: self._pending == 0, timeout_s)

    def tally(self) -> Tally:
        """Counters as of now."""
        with self._changed:
            return Tally(
                mode=self.mode,
                available=self.available,
                message=self.reason,
                offered=self._offered,
                not_sampled=self._not_sampled,
                pending=self._pending,
                kinds={kind: replace(self._kinds[kind]) for kind in sorted(self._kinds)},
                reasons=dict(self._reasons),
                restarts=max(0, self._starts - 1),
                last_loss=self._last_loss,
                recent=(*self._recent[True], *self._recent[False]),
            )

    def close(self) -> None:
        """Stop the worker process; pairs still waiting are counted as skipped.  May be called twice."""
        with self._changed:
            self._closing = True
            self._changed.notify_all()
            # The thread may be waiting for a worker that hangs.
            if self._process is not None:
                self._process.kill()
        if self._thread is not None:
            self._thread.join()

    def __enter__(self) -> Self:
        """Nothing to do; the worker starts with the first pair."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Close."""
        self.close()

    # --------------------------------------------------------------------------------------- taking pairs in

    def _choose(self, count: int) -> list[int]:
        """Rows to take, ascending."""
        if self.mode == Mode.ALL:
            return list(range(count))
        with self._changed:
            return np.flatnonzero(self._random.random(count) < self._fraction).tolist()

    def _enqueue(self, rows: Rows, left_out: int) -> int:
        """Count all that was offered, and queue what there is room for."""
        with self._changed:
            self._offered += left_out + len(rows)
            self._not_sampled += left_out
            if self._closing or not self.available:
                self._skip(rows.shapes, SkipReason.CLOSED if self._closing else SkipReason.UNAVAILABLE)
                return 0
            room = max(0, self._queue_limit - self._pending)
            if len(rows) > room:
                # At random: otherwise the last rows of a large scene would never be looked at.
                order = self._random.permutation(len(rows)).tolist()
                self._skip([rows.shapes[i] for i in order[room:]], SkipReason.DROPPED)
                rows = rows.take(sorted(order[:room]))
            self._pending += len(rows)
            for start in range(0, len(rows), BATCH_PAIRS):
                self._queue.append(rows.take(range(start, min(start + BATCH_PAIRS, len(rows)))))
            if self._thread is None and len(rows):
                self._thread = threading.Thread(target=self._run, name="geomsrv cross-check", daemon=True)
                self._thread.start()
            self._changed.notify_all()
        return len(rows)

    def _skip(self, shapes: Sequence[tuple[AnyShape, AnyShape]], reason: SkipReason) -> None:
        """Count pairs that get no verdict; the lock is held."""
        for (kind_a, kind_b), count in Counter((a.kind, b.kind) for a, b in shapes).items():
            self._of_kind(pair_kind(kind_a, kind_b)).skipped += count
            self._reasons[reason] += count

    def _of_kind(self, kind: str) -> KindTally:
        return self._kinds.setdefault(kind, KindTally())

    # -------------------------------------------------------------------------------------------- the thread

    def _run(self) -> None:
        """Judge batch after batch until closed."""
        try:
            while batch := self._next():
                findings = self._judge(batch)
                with self._changed:
                    self._book(findings)
                    self._done(batch)
        except Exception as error:
            # A fault in here must not reach the caller, and must not pass unnoticed.
            _log.exception("the cross-check has failed")
            with self._changed:
                self.available, self.reason = False, f"the cross-check has failed: {error!r}"
        finally:
            with self._changed:
                left = SkipReason.CLOSED if self._closing else SkipReason.UNAVAILABLE
                while self._queue:
                    self._skip(self._queue[0].shapes, left)
                    self._done(self._queue[0])
                process, self._process = self._process, None
            if process is not None:
                process.close()

    def _next(self) -> Rows | None:
        """The batch at the head of the queue, where it stays until it is done; None when closing."""
        with self._changed:
            self._changed.wait_for(lambda: self._queue or self._closing)
            return None if self._closing else self._queue[0]

    def _done(self, batch: Rows) -> None:
        """Take the batch off the queue; the lock is held."""
        self._queue.popleft()
        self._pending -= len(batch)
        self._changed.notify_all()

    def _book(self, findings: _Findings) -> None:
        """Add to the counters; the lock is held."""
        for kind, count in findings.agreed.items():
            self._of_kind(kind).agreed += count
        for reason, shapes in findings.skipped.items():
            self._skip(shapes, reason)
        for difference in findings.differences:
            tally = self._of_kind(difference.kind)
            if difference.explained:
                tally.explained += 1
            else:
                tally.unexplained += 1
            self._recent[difference.explained].append(difference)
            self._unpolled.append(difference)

    def _judge(self, batch: Rows) -> _Findings:
        """Ask FCL and compare."""
        findings = _Findings()
        findings.skip(batch, batch.unsupported, SkipReason.UNSUPPORTED_HERE)
        foreign = np.array([pair_kind(a.kind, b.kind) not in PEERS for a, b in batch.shapes])
        findings.skip(batch, foreign & ~batch.unsupported, SkipReason.UNSUPPORTED_BY_FCL)
        rows = batch.take(np.flatnonzero(~batch.unsupported & ~foreign))
        solids = [(self._solid(a), self._solid(b)) for a, b in rows.shapes]

        replies = self._ask(solids, rows.poses)
        for outcome, reason in _NO_VERDICT.items():
            findings.skip(rows, replies["outcome"] == outcome, reason)
        answered = np.flatnonzero(replies["outcome"] < fcl_worker.Outcome.FAILED)
        rows, replies, solids = rows.take(answered), replies[answered], [solids[i] for i in answered]

        contact, gap = replies["outcome"] == fcl_worker.Outcome.CONTACT, replies["distance"]
        tolerance = scales(rows, solids)
        verdict = first_sight(rows, contact, gap, tolerance)
        findings.agreed.update(
            pair_kind(*(s.kind for s in solids[i])) for i in np.flatnonzero(verdict == Verdict.AGREED)
        )
        findings.skip(rows, verdict == Verdict.TOO_CLOSE, SkipReason.TOO_CLOSE)

        differs = np.flatnonzero(verdict > Verdict.TOO_CLOSE)
        self._look_closer(
            findings,
            rows.take(differs),
            [solids[i] for i in differs],
            [
                Claim(
                    verdict=Verdict(verdict[i]),
                    distance=float(rows.distance[i]),
                    lower=float(rows.lower[i]),
                    upper=float(rows.upper[i]),
                    contact=bool(contact[i]),
                    gap=float(gap[i]),
                    **{name: float(value[i]) for name, value in tolerance._asdict().items()},
                )
                for i in differs
            ],
        )
        return findings

    def _look_closer(
        self, findings: _Findings, rows: Rows, solids: list[tuple[Solid, Solid]], claims: list[Claim]
    ) -> None:
        """Ask FCL again nearby, check our witnesses, and say who is wrong."""
        again = len(JITTER_DIRECTIONS)
        poses = jittered(rows.poses, np.array([claim.jitter for claim in claims]))
        replies = self._ask([pair for pair in solids for _ in range(again)], poses).reshape(-1, again)
        for i, (claim, (a, b)) in enumerate(zip(claims, solids, strict=True)):
            moved = [
                (outcome == fcl_worker.Outcome.CONTACT, gap)
                for outcome, gap in replies[i].tolist()
                if outcome < fcl_worker.Outcome.FAILED
            ]
            placed = Placed.at(a.kind, a.packed), Placed.at(b.kind, b.packed, rows.poses[i])
            proof = bracket(*placed, rows.point_a[i], rows.point_b[i], rows.normal[i])
            explained, reason = explain(claim, proof, moved)
            if explained is None:
                findings.skip(rows, np.arange(len(rows)) == i, SkipReason.TOO_CLOSE)
                continue
            findings.differences.append(
                Difference(
                    kind=pair_kind(a.kind, b.kind),
                    label=rows.labels[i],
                    question=claim.verdict.name.lower(),
                    shape_a=rows.shapes[i][0],
                    shape_b=rows.shapes[i][1],
                    pose_ab=rows.poses[i],
                    distance=claim.distance,
                    lower=claim.lower,
                    upper=claim.upper,
                    fcl_intersects=claim.contact,
                    fcl_distance=claim.gap,
                    explained=explained,
                    reason=reason,
                )
            )

    def _solid(self, shape: AnyShape) -> Solid:
        """The shape as the worker reads it, made once."""
        found = self._solids.get(shape)
        if found is None:
            found = self._solids[shape] = Solid.of(shape, self._next_number)
            self._next_number += 1
        return found

    # -------------------------------------------------------------------------------------------- the worker

    def _ask(self, solids: list[tuple[Solid, Solid]], poses: FloatArray) -> NDArray[np.void]:
        """One reply per pair, `_NO_VERDICT` outcomes included; replaces the worker as often as it takes."""
        requests = np.zeros(len(solids), fcl_worker.REQUEST)
        requests["a"], requests["b"] = [a.number for a, _ in solids], [b.number for _, b in solids]
        requests["pose"] = poses
        replies = np.zeros(len(solids), fcl_worker.REPLY)
        replies["distance"] = np.nan
        start, suspect = 0, -1
        while start < len(solids):
            worker = self._worker()
            if isinstance(worker, int):
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
                # Whatever killed the worker need not be the pair it was at; it gets a second chance.  A pair
                # that took too long gets none.
                if lost.timed_out or start == suspect:
                    replies["outcome"][start] = _TIMED_OUT if lost.timed_out else _WORKER_DIED
                    start += 1
                else:
                    suspect = start
        return replies

    def _worker(self) -> FclProcess | int:
        """A worker that is ready, or the outcome of pairs that cannot have one."""
        while True:
            with self._changed:
                while not self._closing and 0.0 < (pause := self._pause()) <= RESTART_PAUSE_S[1]:
                    self._changed.wait(pause)
                if self._closing:
                    return _CLOSED
                if not self.available:
                    return _UNAVAILABLE
                if self._process is not None:
                    return self._process
                if self._pause() > 0.0:
                    return _BACKING_OFF
            try:
                process = FclProcess(self._timeout_s, self._command)
                self._adopt(process)
                process.wait_until_ready()
            except FclUnavailableError as error:
                with self._changed:
                    self.available, self.reason = False, str(error)
            except WorkerLostError as lost:
                self._lost(lost)

    def _adopt(self, process: FclProcess) -> None:
        """From here on `close` can end the process, if it has not come by already."""
        with self._changed:
            self._process = process
            self._starts += 1
            if self._closing:
                process.kill()

    def _pause(self) -> float:
        """How long to wait before a new worker may start [s]; the lock is held."""
        if self._process is not None or not self._deaths:
            return 0.0
        now = time.monotonic()
        recent = [moment for moment in self._deaths if now - moment < 60.0]
        if len(recent) >= MAX_DEATHS_PER_MINUTE:
            return recent[0] + 60.0 - now
        first, longest = RESTART_PAUSE_S
        return self._deaths[-1] + min(first * 2.0 ** (len(recent) - 1), longest) - now

    def _lost(self, lost: WorkerLostError) -> None:
        """Put the dead worker away."""
        with self._changed:
            process, self._process = self._process, None
            if not self._closing:
                self._deaths.append(time.monotonic())
                self._last_loss = str(lost)
        if process is not None:
            process.close()


def cross_check_scene(scene: Scene, max_distance: float = np.inf, *, timeout_s: float = 60.0) -> Tally:
    """Compare every pair of a scene that is at most `max_distance` apart with FCL, and wait for the verdicts.

    Parameters
    ----------
    scene : Scene
    max_distance : float
        [m]; inf for every pair.
    timeout_s : float
        How long to wait [s]; pairs without a verdict by then count as skipped.

    Returns
    -------
    Tally
        ``available`` is False if python-fcl is missing.

    Examples
    --------
    >>> import geomsrv as gs
    >>> from geomsrv.crosscheck import cross_check_scene
    >>> scene = gs.Scene()
    >>> ball = gs.SceneObject("ball", gs.Sphere(0.5), (2, 0, 0, 0, 0, 0, 1))
    >>> _ = scene.apply(gs.SceneUpdate(add=[ball, gs.SceneObject("cube", gs.Box([1, 1, 1]))]))
    >>> cross_check_scene(scene).summary()
    'cross-check all: 1 agreed, 0 explained, 0 unexplained'
    """
    pairs = scene.distances(max_distance, want=("penetration",))
    with CrossCheck("all", queue_limit=max(1, len(pairs))) as check:
        check.submit_scene(scene, pairs)
        check.drain(timeout_s)
    return check.tally()


@dataclass
class _Findings:
    """What became of one batch."""

    agreed: Counter[str] = field(default_factory=Counter)
    skipped: dict[SkipReason, list[tuple[AnyShape, AnyShape]]] = field(default_factory=dict)
    differences: list[Difference] = field(default_factory=list)

    def skip(self, rows: Rows, which: NDArray[np.bool_], reason: SkipReason) -> None:
        """Note that those rows get no verdict."""
        if which.any():
            self.skipped.setdefault(reason, []).extend(rows.shapes[i] for i in np.flatnonzero(which))


def _fcl_is_missing() -> str:
    """Why python-fcl cannot be used, as far as that shows without loading it; empty if it may be there."""
    try:
        found = importlib.util.find_spec("fcl") is not None
    except (ImportError, ValueError):
        found = False
    return "" if found else "python-fcl is not installed (pip install python-fcl)"


def _relative_rotation(a: FloatArray, b: FloatArray) -> FloatArray:
    """Quaternions (n, 4) x y z w of b as seen from a: conj(a) * b."""
    va, wa, vb, wb = a[:, :3], a[:, 3:], b[:, :3], b[:, 3:]
    vector = wa * vb - wb * va - np.cross(va, vb)
    scalar = wa * wb + np.sum(va * vb, axis=1, keepdims=True)
    return np.hstack([vector, scalar])
