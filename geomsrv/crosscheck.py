# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""Cross-check: re-run distance, intersection and first contact through FCL beside the engine, count where they differ.

`CrossCheck.submit` copies a few rows and returns.  A thread hands them to a worker process and judges what comes
back (`geomsrv._judge`).  When FCL aborts, hangs or segfaults, the worker is replaced: that costs one pair,
never the caller.  It is a thread, rather than pipes polled by the caller, because a worker that hangs must be
replaced on time however seldom the caller looks, and because all it does is to wait.
"""

from __future__ import annotations

import logging
import threading
from collections import Counter, deque
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from types import TracebackType
from typing import TYPE_CHECKING, Self
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import ArrayLike, NDArray

from geomsrv import _validate, fcl_worker
from geomsrv._fcl_supervisor import FclSupervisor, NoReply
from geomsrv._judge import (
    JITTER_DIRECTIONS,
    PEERS,
    AnyShape,
    Blame,
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
from geomsrv._tally import Difference, KindTally, Mode, MotionDifference, SkipReason, Tally
from geomsrv._witness import Bracket, Placed, bracket
from geomsrv.answers import Distances, DistanceStatus
from geomsrv.errors import GeometryError, NotAvailableError
from geomsrv.motion_check import MotionRows, judged
from geomsrv.queries import distance
from geomsrv.shapes import CURVED

if TYPE_CHECKING:
    from geomsrv.pairwise import ListedContacts, ListedDistances
    from geomsrv.scene import PairContacts, PairDistances, Scene
    from geomsrv.world import World

__all__ = ["Blame", "CrossCheck", "Difference", "KindTally", "Mode", "SkipReason", "Tally", "cross_check_scene"]

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

# Pairs judged at a time; FCL takes some 10 ms for them, and the counters are that fresh.
BATCH_PAIRS = 256

# Tiers that FCL can be wrong about: bounding volumes claim too little, and single precision has points of its own.
COMPARED = _validate.CERTIFIED_ACCURACIES

# Differences kept for `CrossCheck.poll`, and, of either sort, for `Tally.recent`.
MAX_UNPOLLED = 1000
MAX_RECENT = 10

_NO_VERDICT = {
    int(fcl_worker.Outcome.FAILED): SkipReason.FCL_ERROR,
    int(NoReply.TIMED_OUT): SkipReason.TIMED_OUT,
    int(NoReply.WORKER_DIED): SkipReason.WORKER_DIED,
    int(NoReply.BACKING_OFF): SkipReason.BACKING_OFF,
    int(NoReply.UNAVAILABLE): SkipReason.UNAVAILABLE,
    int(NoReply.STOPPED): SkipReason.CLOSED,
}

#: Who is wrong about a first contact, and what shows it.
_WHY_MOTION = {
    "fcl_missed": (Blame.FCL, "bodies are proven to be apart just before our time, and to overlap just after it"),
    "fcl_off": (Blame.FCL, "bodies are proven to be where we say, and not where FCL says"),
    "engine_wrong": (Blame.ENGINE, "bodies are proven not to meet when we say"),
}

_log = logging.getLogger(__name__)


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
        self._fcl = None if self.mode == Mode.OFF else FclSupervisor(self._timeout_s)
        self._fault = ""

        # Guards all that follow; notified when work arrives, when it is done, and on closing.
        self._changed = threading.Condition()
        self._queue: deque[Rows | MotionRows] = deque()
        self._offered = self._not_sampled = self._pending = 0
        self._kinds: dict[str, KindTally] = {}
        self._reasons: Counter[SkipReason] = Counter()
        self._unpolled: deque[Difference | MotionDifference] = deque(maxlen=MAX_UNPOLLED)
        self._recent = {
            explained: deque[Difference | MotionDifference](maxlen=MAX_RECENT) for explained in (True, False)
        }
        self._closing = False
        self._thread: threading.Thread | None = None
        self._retired = False  # the thread has ended, or is past looking at the queue

        # The thread's own.
        self._solids: WeakKeyDictionary[AnyShape, Solid] = WeakKeyDictionary()
        self._next_number = 0

    # ---------------------------------------------------------------------------------------- for the caller

    @property
    def reason(self) -> str:
        """Why nothing can be compared; empty if it can, as far as known, and in mode "off"."""
        return self._fault or ("" if self._fcl is None else self._fcl.reason)

    @property
    def available(self) -> bool:
        """Whether pairs can be compared; that python-fcl does not load shows with the first pair."""
        return not self.reason

    @property
    def worker_pid(self) -> int | None:
        """Process id of the worker; None if none is running."""
        return None if self._fcl is None else self._fcl.pid

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
            How many pairs were queued; in mode "off", and at tiers that are not `COMPARED`, always 0.

        Raises
        ------
        GeometryError
            Names the argument and the fault.
        """
        if self.mode == Mode.OFF or answers.cost.accuracy not in COMPARED:
            return 0
        poses = _validate.poses(poses_ab, "poses_ab")
        count = len(poses)
        pairs = list(shapes) * count if len(shapes) == 1 else list(shapes)
        names = [""] * count if labels is None else list(labels)
        for name, given in (("shapes", pairs), ("answers", answers.distance), ("labels", names)):
            if len(given) != count:
                raise GeometryError(f"{name} must have one item per row of poses_ab, got {len(given)} and {count}")
        chosen = self._admit(pairs)
        self._enqueue(
            Rows(
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
            )
        )
        return len(chosen)

    def submit_pairs(self, world: World, pairs: IntArray, answer: PairDistances | ListedDistances) -> int:
        """Queue what was answered about pairs of a scene's version; returns at once.

        Parameters
        ----------
        world : World
        pairs : (n, 2) int64
            Rows of `world`.
        answer : PairDistances or ListedDistances
            n rows, in the fixed frame; ``want=("penetration",)`` tells a deep overlap from a touch.

        Returns
        -------
        int
            How many pairs were queued; in mode "off", and at tiers that are not `COMPARED`, always 0.
        """
        if self.mode == Mode.OFF or answer.cost.accuracy not in COMPARED:
            return 0
        table = [world.table.shapes[k] for k in world.shape.tolist()]
        shapes = [(table[i], table[j]) for i, j in pairs.tolist()]
        chosen = self._admit(shapes)
        if not chosen:
            return 0
        a, b = pairs[chosen, 0], pairs[chosen, 1]
        rotation, origin = world.rotations[a], world.poses[a, :3]

        def local(vectors: FloatArray) -> FloatArray:
            turned: FloatArray = np.einsum("nji,nj->ni", rotation, vectors)
            return turned

        step = local(world.poses[b, :3] - origin)
        self._enqueue(
            Rows(
                shapes=[shapes[i] for i in chosen],
                labels=[f"{world.ids[i]} / {world.ids[j]}" for i, j in pairs[chosen].tolist()],
                poses=np.hstack([step, _relative_rotations(world.poses[a, 3:], world.poses[b, 3:])]),
                distance=answer.distance[chosen],
                lower=answer.lower[chosen],
                upper=answer.upper[chosen],
                point_a=local(answer.point_a[chosen] - origin),
                point_b=local(answer.point_b[chosen] - origin),
                normal=local(answer.normal[chosen]),
                unsupported=answer.status[chosen] == DistanceStatus.UNSUPPORTED,
            )
        )
        return len(chosen)

    def submit_scene(self, scene: Scene, answer: PairDistances) -> int:
        """Queue what `Scene.distances` answered; returns at once.

        Call it before the scene changes: if it has, its poses are not those of the answer any more, and the pairs are
        counted as skipped.

        Parameters
        ----------
        scene : Scene
        answer : PairDistances
            Of this scene; ``want=("penetration",)`` tells a deep overlap from a touch.

        Returns
        -------
        int
            How many pairs were queued; in mode "off", and at tiers that are not `COMPARED`, always 0.
        """
        if self.mode == Mode.OFF:
            return 0
        world = scene.world
        if world.version != answer.version:
            with self._changed:
                self._offered += len(answer)
                self._of_kind("unknown").skipped += len(answer)
                self._reasons[SkipReason.STALE] += len(answer)
            return 0
        rows = [(world.index[a], world.index[b]) for a, b in zip(answer.ids_a, answer.ids_b, strict=True)]
        return self.submit_pairs(world, np.array(rows, np.int64).reshape(-1, 2), answer)

    def submit_motion(
        self, world: World, pairs: IntArray, answer: PairContacts | ListedContacts, horizon: float
    ) -> int:
        """Queue first contacts of pairs of a scene's version that move relative to each other; returns at once.

        Pairs that turn, or of kinds whose motion FCL is not asked about, count as skipped.  Kinds in the tally begin
        with "motion ".

        Parameters
        ----------
        world : World
        pairs : (n, 2) int64
            Rows of `world`.
        answer : PairContacts or ListedContacts
            n rows, of contacts without a margin.
        horizon : float
            [s]

        Returns
        -------
        int
            How many pairs were queued; in mode "off", and at tiers that are not `COMPARED`, always 0.
        """
        if self.mode == Mode.OFF or answer.cost.accuracy not in COMPARED or not len(pairs):
            return 0
        rows = MotionRows.of(world, pairs, answer.status, answer.time, horizon)
        followed = rows.followed()
        if len(foreign := rows.take(np.flatnonzero(~followed))):
            with self._changed:
                self._offered += len(foreign)
                self._skip(foreign.shapes, SkipReason.UNSUPPORTED_BY_FCL, rows.prefix)
        rows = rows.take(np.flatnonzero(followed))
        rows = rows.take(self._admit(rows.shapes, rows.prefix))
        if len(rows):
            self._enqueue(rows)
        return len(rows)

    def poll(self) -> list[Difference | MotionDifference]:
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
                restarts=0 if self._fcl is None else self._fcl.restarts,
                last_loss="" if self._fcl is None else self._fcl.last_loss,
                recent=(*self._recent[True], *self._recent[False]),
            )

    def close(self) -> None:
        """Stop the worker process; pairs still waiting are counted as skipped.  May be called twice."""
        with self._changed:
            self._closing = True
            self._changed.notify_all()
        if self._fcl is not None:
            # The thread may be waiting for a worker that hangs.
            self._fcl.stop()
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

    def _admit(self, shapes: list[tuple[AnyShape, AnyShape]], prefix: str = "") -> list[int]:
        """Count what is offered and pick, in ascending order, what is to be queued."""
        with self._changed:
            self._offered += len(shapes)
            chosen = np.arange(len(shapes))
            if self.mode == Mode.SAMPLE:
                chosen = np.flatnonzero(self._random.random(len(shapes)) < self._fraction)
                self._not_sampled += len(shapes) - len(chosen)
            left = chosen[:0]
            if self._closing:
                chosen, left, reason = left, chosen, SkipReason.CLOSED
            elif not self.available:
                chosen, left, reason = left, chosen, SkipReason.UNAVAILABLE
            elif len(chosen) > (room := max(0, self._queue_limit - self._pending)):
                # At random: otherwise the last pairs of a large scene would never be looked at.
                order = self._random.permutation(chosen)
                chosen, left, reason = np.sort(order[:room]), order[room:], SkipReason.DROPPED
            if len(left):
                self._skip([shapes[i] for i in left.tolist()], reason, prefix)
            self._pending += len(chosen)
            taken: list[int] = chosen.tolist()
        return taken

    def _enqueue(self, rows: Rows | MotionRows) -> None:
        """Queue rows that have been admitted."""
        with self._changed:
            for start in range(0, len(rows), BATCH_PAIRS):
                self._queue.append(rows.take(range(start, min(start + BATCH_PAIRS, len(rows)))))
            if self._retired or (self._closing and self._thread is None):
                # `close`, or a fault, came between admitting them and now.
                self._give_up()
            elif self._thread is None and self._queue:
                self._thread = threading.Thread(
                    target=self._run, args=(self._fcl,), name="geomsrv cross-check", daemon=True
                )
                self._thread.start()
            self._changed.notify_all()

    def _give_up(self) -> None:
        """Skip all that is queued, since nobody will judge it; the lock is held."""
        while self._queue:
            batch, reason = self._queue[0], SkipReason.CLOSED if self._closing else SkipReason.UNAVAILABLE
            self._skip(batch.shapes, reason, batch.prefix)
            self._done(batch)

    def _skip(self, shapes: Sequence[tuple[AnyShape, AnyShape]], reason: SkipReason, prefix: str = "") -> None:
        """Count pairs that get no verdict; the lock is held."""
        for (kind_a, kind_b), count in Counter((a.kind, b.kind) for a, b in shapes).items():
            self._of_kind(prefix + pair_kind(kind_a, kind_b)).skipped += count
            self._reasons[reason] += count

    def _of_kind(self, kind: str) -> KindTally:
        return self._kinds.setdefault(kind, KindTally())

    # -------------------------------------------------------------------------------------------- the thread

    def _run(self, fcl: FclSupervisor) -> None:
        """Judge batch after batch until closed."""
        try:
            while batch := self._next():
                if isinstance(batch, MotionRows):
                    findings = self._judge_motion(batch, fcl)
                else:
                    findings = self._judge(batch, fcl)
                with self._changed:
                    self._book(findings, batch.prefix)
                    self._done(batch)
        except Exception as error:
            # A fault in here must not reach the caller, and must not pass unnoticed.
            _log.exception("the cross-check has failed")
            self._fault = f"the cross-check has failed: {error!r}"
        finally:
            fcl.close()
            with self._changed:
                self._retired = True
                self._give_up()

    def _next(self) -> Rows | MotionRows | None:
        """The batch at the head of the queue, where it stays until it is done; None when closing."""
        with self._changed:
            self._changed.wait_for(lambda: self._queue or self._closing)
            return None if self._closing else self._queue[0]

    def _done(self, batch: Rows | MotionRows) -> None:
        """Take the batch off the queue; the lock is held."""
        self._queue.popleft()
        self._pending -= len(batch)
        self._changed.notify_all()

    def _book(self, findings: _Findings, prefix: str) -> None:
        """Add to the counters; the lock is held."""
        for kind, count in findings.agreed.items():
            self._of_kind(prefix + kind).agreed += count
        for reason, shapes in findings.skipped.items():
            self._skip(shapes, reason, prefix)
        for difference in findings.differences:
            tally = self._of_kind(prefix + difference.kind)
            if difference.explained:
                tally.explained += 1
            else:
                tally.unexplained += 1
                tally.engine_wrong += difference.blame == Blame.ENGINE
            self._recent[difference.explained].append(difference)
            self._unpolled.append(difference)

    def _judge(self, batch: Rows, fcl: FclSupervisor) -> _Findings:
        """Ask FCL and compare."""
        findings = _Findings()
        findings.skip(batch, batch.unsupported, SkipReason.UNSUPPORTED_HERE)
        foreign = np.array([pair_kind(a.kind, b.kind) not in PEERS for a, b in batch.shapes])
        findings.skip(batch, foreign & ~batch.unsupported, SkipReason.UNSUPPORTED_BY_FCL)
        rows = batch.take(np.flatnonzero(~batch.unsupported & ~foreign))
        solids = [(self._solid(a), self._solid(b)) for a, b in rows.shapes]

        replies = fcl.ask(solids, rows.poses)
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
            fcl,
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

    def _judge_motion(self, batch: MotionRows, fcl: FclSupervisor) -> _Findings:
        """Ask FCL when bodies meet, and put our answer to the proof where it differs."""
        findings = _Findings()
        solids = [(self._solid(a), self._solid(b)) for a, b in batch.shapes]
        found = judged(fcl, batch, solids)
        outcomes = np.array([one.outcome for one in found])
        for outcome, reason in _NO_VERDICT.items():
            findings.skip(batch, outcomes == outcome, reason)
        findings.skip(batch, np.array([one.verdict == "too_close" for one in found]), SkipReason.TOO_CLOSE)
        world = batch.world
        for one, (i, j), (a, b), end, time in zip(
            found, batch.pairs.tolist(), batch.shapes, batch.end.tolist(), batch.time.tolist(), strict=True
        ):
            kind = pair_kind(a.kind, b.kind)
            if one.verdict == "agreed":
                findings.agreed[kind] += 1
            elif one.verdict in _WHY_MOTION:
                blame, why = _WHY_MOTION[one.verdict]
                hit = one.outcome == fcl_worker.Outcome.CONTACT
                findings.differences.append(
                    MotionDifference(
                        kind=kind,
                        label=f"{world.ids[i]} / {world.ids[j]}",
                        shape_a=a,
                        shape_b=b,
                        pose_a=world.poses[i],
                        pose_b=world.poses[j],
                        velocity_a=world.twists[i, :3],
                        velocity_b=world.twists[j, :3],
                        end=end,
                        time=time,
                        fcl_time=one.share * end if hit else np.nan,
                        blame=blame,
                        reason=why,
                    )
                )
        return findings

    def _look_closer(
        self,
        fcl: FclSupervisor,
        findings: _Findings,
        rows: Rows,
        solids: list[tuple[Solid, Solid]],
        claims: list[Claim],
    ) -> None:
        """Ask FCL again nearby and exact arithmetic, or check our witnesses, and say who is wrong."""
        again = len(JITTER_DIRECTIONS)
        poses = jittered(rows.poses, np.array([claim.jitter for claim in claims]))
        replies = fcl.ask([pair for pair in solids for _ in range(again)], poses).reshape(-1, again)
        for i, (claim, (a, b)) in enumerate(zip(claims, solids, strict=True)):
            moved = [
                (outcome == fcl_worker.Outcome.CONTACT, gap)
                for outcome, gap in replies[i].tolist()
                if outcome < fcl_worker.Outcome.FAILED
            ]
            exact = _exactly(*rows.shapes[i], rows.poses[i])
            placed = Placed.at(a.kind, a.packed), Placed.at(b.kind, b.packed, rows.poses[i])
            proof = exact or bracket(*placed, rows.point_a[i], rows.point_b[i], rows.normal[i])
            blame, reason = explain(claim, proof, moved, exact=exact is not None)
            if blame is None:
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
                    blame=blame,
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


def _exactly(a: AnyShape, b: AnyShape, pose: FloatArray) -> Bracket | None:
    """What exact arithmetic gives for a pair; None where there is no kernel for that."""
    if isinstance(a, CURVED) or isinstance(b, CURVED):
        return None  # answered as at float64
    try:
        answer = distance(a, b, pose, accuracy="exact", want=("penetration",))
    except NotAvailableError:
        return None
    decided = answer.status[0] == DistanceStatus.OK
    return Bracket(float(answer.lower[0]), float(answer.upper[0])) if decided else None


@dataclass
class _Findings:
    """What became of one batch."""

    agreed: Counter[str] = field(default_factory=Counter)
    skipped: dict[SkipReason, list[tuple[AnyShape, AnyShape]]] = field(default_factory=dict)
    differences: list[Difference | MotionDifference] = field(default_factory=list)

    def skip(self, rows: Rows | MotionRows, which: NDArray[np.bool_], reason: SkipReason) -> None:
        """Note that those rows get no verdict."""
        if which.any():
            shapes = rows.shapes
            self.skipped.setdefault(reason, []).extend(shapes[i] for i in np.flatnonzero(which))


def _relative_rotations(a: FloatArray, b: FloatArray) -> FloatArray:
    """Quaternions (n, 4) x y z w of b as seen from a: conj(a) * b."""
    va, wa, vb, wb = a[:, :3], a[:, 3:], b[:, :3], b[:, 3:]
    vector = wa * vb - wb * va - np.cross(va, vb)
    scalar = wa * wb + np.sum(va * vb, axis=1, keepdims=True)
    return np.hstack([vector, scalar])
