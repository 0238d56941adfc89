# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""Cross-check of motion: first contacts of a scene through FCL's conservative advancement, and who was wrong.

FCL follows translations only, misses some contacts in every hundred, and is no judge.  Where it differs, the engine's
answer is put to the proof at another query: bodies placed where they are just before the time that it named must be
apart, and just after it must overlap, by proven intervals of their distance, exact ones where there are any.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import ClassVar, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from geomsrv import _validate, fcl_worker
from geomsrv._fcl_supervisor import FclSupervisor
from geomsrv._judge import AnyShape, Solid, pair_kind
from geomsrv.answers import ByteArray, ContactStatus
from geomsrv.broad_phase import boxes_swept, candidates
from geomsrv.narrow_phase import relative_poses
from geomsrv.pairwise import listed_distances, listed_first_contacts
from geomsrv.scene import PairContacts, Scene, SceneObject, SceneUpdate
from geomsrv.shapes import Box, Capsule, Convex, Sphere
from geomsrv.world import World

__all__ = [
    "FOLLOWED",
    "Found",
    "MotionRows",
    "MotionTally",
    "cross_check_motion",
    "first_contact_of_two",
    "judged",
    "random_scene",
]

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

#: Kinds whose motion FCL is asked about.
FOLLOWED = ("box", "capsule", "convex", "sphere")

# FCL's times, where it hits at all, are off by up to 1.4e-3 of the way (measured on hulls); by this much they agree.
AGREED = 2e-3

# Just before and just after a contact, as a share of the way: long enough for a distance to see it past all rounding,
# and past the width of the time interval of round bodies.
BESIDE = 1e-5

VERDICTS = ("agreed", "fcl_missed", "fcl_off", "engine_wrong", "too_close", "skipped")


@dataclass
class MotionTally:
    """What became of the pairs compared.

    Attributes
    ----------
    kinds : dict of str to Counter
        By kinds, "box-convex": `VERDICTS`.  fcl_missed: FCL saw no contact where one is proven.  fcl_off: its time is
        off by more than `AGREED` of the way, or it saw a contact where the bodies are proven to be apart.
        engine_wrong: our own answer did not stand the proof.  too_close: grazing, which the proof cannot see.
        skipped: FCL died, hung or raised.
    worst : float
        Largest difference of times that counts as agreed, as a share of the way.
    message : str
        Why nothing was compared; empty if something was.
    """

    kinds: dict[str, Counter[str]] = field(default_factory=dict)
    worst: float = 0.0
    message: str = ""

    def total(self, verdict: str) -> int:
        """Pairs of all kinds with a verdict."""
        return sum(counts[verdict] for counts in self.kinds.values())

    def summary(self) -> str:
        """One line."""
        if self.message:
            return f"motion: {self.message}"
        counts = ", ".join(f"{self.total(verdict)} {verdict}" for verdict in VERDICTS)
        return f"motion: {counts}; times agree to {self.worst:.1e} of the way"


def cross_check_motion(
    scene: Scene, horizon: float, *, accuracy: str = "float64", timeout_s: float = 1.0
) -> MotionTally:
    """Ask FCL about every pair of a scene that translates and comes near within the horizon, and wait for its answers.

    Parameters
    ----------
    scene : Scene
    horizon : float
        [s], > 0 and finite.
    accuracy : str
        Tier of the engine's answer.
    timeout_s : float
        Longest time FCL may take for one pair [s].

    Returns
    -------
    MotionTally

    Examples
    --------
    >>> import geomsrv as gs
    >>> from geomsrv.motion_check import cross_check_motion
    >>> scene = gs.Scene()
    >>> cube = gs.Box([0.5, 0.5, 0.5])
    >>> moving = gs.SceneObject("a", cube, (0, 0, 0, 0, 0, 0, 1), (1, 0, 0, 0, 0, 0))
    >>> _ = scene.apply(gs.SceneUpdate(add=[moving, gs.SceneObject("b", cube, (3, 0.25, 0, 0, 0, 0, 1))]))
    >>> cross_check_motion(scene, 4.0).kinds
    {'box-box': Counter({'agreed': 1})}
    """
    end = _validate.scalar(horizon, "horizon", positive=True)
    world = scene.world
    pairs = _moving_pairs(world, end)
    ours = listed_first_contacts(world, pairs, end, accuracy=accuracy)
    tally = MotionTally()
    rows = MotionRows(world, pairs, np.full(len(pairs), end), ours.time)
    solids = [Solid.of(shape, number) for number, shape in enumerate(world.table.shapes)]
    fcl = FclSupervisor(timeout_s)
    try:
        found = judged(fcl, rows, [(solids[world.shape[i]], solids[world.shape[j]]) for i, j in pairs.tolist()])
    finally:
        fcl.close()
    if fcl.reason:
        return MotionTally(message=fcl.reason)
    for (a, b), one in zip(rows.shapes, found, strict=True):
        tally.kinds.setdefault(pair_kind(a.kind, b.kind), Counter())[one.verdict] += 1
        if one.verdict == "agreed" and not np.isnan(one.off):
            tally.worst = max(tally.worst, one.off)
    return tally


def first_contact_of_two(
    a: AnyShape,
    pose_a: ArrayLike,
    velocity_a: ArrayLike,
    b: AnyShape,
    pose_b: ArrayLike,
    velocity_b: ArrayLike,
    end: float,
) -> PairContacts:
    """First contact within `end` seconds of two solids in translation: what a report of a difference repeats."""
    scene = Scene()
    states = (("a", a, pose_a, velocity_a), ("b", b, pose_b, velocity_b))
    add = [SceneObject(name, shape, pose, (*np.asarray(v, float), 0, 0, 0)) for name, shape, pose, v in states]
    scene.apply(SceneUpdate(add=add))
    return scene.first_contacts(end)


@dataclass(frozen=True, eq=False)
class MotionRows:
    """Pairs of a world that move, and when each of them is said to meet."""

    world: World
    pairs: IntArray  #: (k, 2)
    end: FloatArray  #: (k,) [s] until when FCL is to follow them
    time: FloatArray  #: (k,) [s], NaN: never
    prefix: ClassVar[str] = "motion "  #: of their kinds in a tally

    def __len__(self) -> int:
        return len(self.pairs)

    def take(self, index: Sequence[int] | NDArray[np.intp]) -> MotionRows:
        """Some of the rows."""
        rows = np.asarray(index, np.intp)
        return MotionRows(self.world, self.pairs[rows], self.end[rows], self.time[rows])

    @property
    def shapes(self) -> list[tuple[AnyShape, AnyShape]]:
        """Of every pair."""
        table, shape = self.world.table.shapes, self.world.shape
        return [(table[shape[i]], table[shape[j]]) for i, j in self.pairs.tolist()]

    @classmethod
    def of(cls, world: World, pairs: IntArray, status: ByteArray, time: FloatArray, horizon: float) -> MotionRows:
        """Pairs that move relative to each other, and of which it is said whether they meet.

        What never meets can be shown to FCL only up to a horizon that is finite.
        """
        a, b = pairs.T
        moving = (world.twists[a] != world.twists[b]).any(axis=1) & np.isin(status, _SAID)
        end = np.full(len(pairs), horizon)
        if np.isinf(horizon):
            end = np.where(time > 0.0, 2.0 * time, 1.0)
            moving &= np.isfinite(time)
        rows = np.flatnonzero(moving & np.isfinite(end))
        return cls(world, pairs[rows], end[rows], time[rows])

    def followed(self) -> NDArray[np.bool_]:
        """(k,) bool: pairs whose motion FCL can be asked about."""
        known = np.array([shape.kind in FOLLOWED for shape in self.world.table.shapes], dtype=bool)[self.world.shape]
        asked: NDArray[np.bool_] = known[self.pairs].all(axis=1) & ~self.world.turns[self.pairs].any(axis=1)
        return asked


_SAID = (ContactStatus.NEVER, ContactStatus.WILL_TOUCH, ContactStatus.TOUCHING, ContactStatus.OVERLAPPING)


class Found(NamedTuple):
    """What became of one pair."""

    outcome: int  #: of `fcl_worker.Outcome`, or of `NoReply`
    verdict: str  #: one of `VERDICTS`
    share: float  #: of the way, at which FCL sees contact begin
    off: float  #: difference of the times of either, as a share of the way; NaN unless both see a contact


def judged(fcl: FclSupervisor, rows: MotionRows, solids: list[tuple[Solid, Solid]]) -> list[Found]:
    """Ask FCL about pairs that are `followed`, and find out who was wrong where it differs."""
    world, (a, b) = rows.world, rows.pairs.T
    ways = rows.end[:, None] * (world.twists[b, :3] - world.twists[a, :3])
    replies = fcl.ask(solids, relative_poses(world, rows.pairs), np.einsum("nji,nj->ni", world.rotations[a], ways))
    found = []
    for k, (outcome, share) in enumerate(zip(replies["outcome"].tolist(), replies["distance"].tolist(), strict=True)):
        end, time = float(rows.end[k]), float(rows.time[k])
        hit, meets = outcome == fcl_worker.Outcome.CONTACT, not np.isnan(time)
        off = abs(share - time / end) if hit and meets else np.nan
        if outcome >= fcl_worker.Outcome.FAILED:
            verdict = "skipped"
        elif hit == meets and not off > AGREED:
            verdict = "agreed"
        else:
            proven = _stands(world, rows.pairs[k], end, time)
            blame = "fcl_off" if hit else "fcl_missed"
            verdict = blame if proven else "too_close" if proven is None else "engine_wrong"
        found.append(Found(outcome, verdict, share, off))
    return found


def random_scene(seed: int | np.random.Generator, count: int) -> Scene:
    """Bodies of some decimetres, of every kind that is `FOLLOWED`, on straight ways through a hall."""
    rng = np.random.default_rng(seed)
    side = 2.0 * count ** (1.0 / 3.0)
    objects = []
    for k in range(count):
        turn, half = rng.normal(size=4), rng.uniform(0.1, 0.6, 3)
        shapes = (Box(half), Capsule(half[0] / 2.0, half[1]), Convex(0.4 * rng.normal(size=(12, 3))), Sphere(half[0]))
        pose = (*rng.uniform(0.0, side, 3), *(turn / np.linalg.norm(turn)))
        objects.append(SceneObject(f"{k:04}", shapes[k % 4], pose, (*rng.normal(size=3), 0.0, 0.0, 0.0)))
    scene = Scene()
    scene.apply(SceneUpdate(add=objects))
    return scene


def _moving_pairs(world: World, horizon: float) -> IntArray:
    """Pairs of solids in translation relative to each other whose swept boxes meet, allowed ones aside."""
    found = candidates(world, world.families[0], boxes_swept(world, horizon)).pairs
    never = np.full(len(found), np.nan)
    rows = MotionRows.of(world, found, np.full(len(found), ContactStatus.NEVER, np.uint8), never, horizon)
    return rows.pairs[rows.followed()]


def _stands(world: World, pair: IntArray, horizon: float, time: float) -> bool | None:
    """Whether bodies are proven to be apart before a time and to overlap after it, NaN: never; None if they graze."""
    step = BESIDE * horizon
    if np.isnan(time):
        # Apart at the start, and as near as they come: the distance of what translates is a convex function of time.
        low, high = 0.0, horizon
        for _ in range(200):
            third = (high - low) / 3.0
            if third <= step:
                break
            left, right = (_bounds(world, pair, t)[0] for t in (low + third, high - third))
            low, high = (low, high - third) if left < right else (low + third, high)
        lower, upper = _bounds(world, pair, 0.5 * (low + high))
        return True if lower > 0.0 else False if upper < 0.0 else None
    if time == 0.0:  # and perhaps parted soon after
        lower, upper = _bounds(world, pair, 0.0)
        return True if upper < 0.0 else False if lower > 0.0 else None
    apart = _bounds(world, pair, max(0.0, time - step))[0] > 0.0
    lower, upper = _bounds(world, pair, time + step)
    if apart and upper < 0.0:
        return True
    return None if apart and lower <= 0.0 else False


def _bounds(world: World, pair: IntArray, t: float) -> tuple[float, float]:
    """Proven bounds of the signed distance at a time."""
    poses = world.poses[pair]
    poses[:, :3] += t * world.twists[pair, :3]
    there = world.moved(pair, poses, None, world.version, None)
    answer = listed_distances(there, pair[None], want=("penetration",))
    return float(answer.lower[0]), float(answer.upper[0])
