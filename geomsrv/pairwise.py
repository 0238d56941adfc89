# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""Answers for pairs that the caller lists: a row for each, in that order, whether they may touch or not."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from geomsrv import _core, _validate
from geomsrv.answers import BoolArray, Bounded, ByteArray, ContactStatus, Cost, DistanceStatus, FloatArray, IntArray
from geomsrv.errors import GeometryError
from geomsrv.ladder import Quality, climb, narrow
from geomsrv.narrow_phase import (
    NO_DISTANCE,
    RELATIVE_POSE_ROUNDING,
    DistanceRows,
    Unsupported,
    count_kinds,
    packed_sets,
    placed_distances,
    polygon_contacts,
    polygon_distances,
    solid_distances,
)
from geomsrv.placement import laid_flat
from geomsrv.queries import MEASURING, RUNGS, TIERS
from geomsrv.shapes import Frustum, Shape
from geomsrv.turning_pairs import Question, climbed_contact_rows, closing_speeds, contact_rows, nearness
from geomsrv.world import ShapeTable, World

__all__ = [
    "Bodies",
    "ListedContacts",
    "ListedDistances",
    "distance_of_two",
    "listed_distances",
    "listed_first_contacts",
    "world_of",
]

_NONE = np.zeros(0, dtype=bool)

NOT_COMPARED = "polygons are compared with polygons only"


@dataclass(frozen=True, eq=False)
class ListedDistances(Bounded):
    """Distances of n listed pairs.

    Attributes
    ----------
    status : (n,) uint8
        `DistanceStatus`.
    distance, lower, upper : (n,) float64
        As in `PairDistances`; NaN where unsupported.
    point_a, point_b, normal : (n, 3) float64
        Fixed frame.
    message : str
        Names what is unsupported; empty otherwise.
    cost : Cost
    """

    status: ByteArray
    distance: FloatArray
    lower: FloatArray
    upper: FloatArray
    point_a: FloatArray
    point_b: FloatArray
    normal: FloatArray
    message: str
    cost: Cost


@dataclass(frozen=True, eq=False)
class ListedContacts(Bounded):
    """First contacts of n listed pairs.

    Attributes
    ----------
    status : (n,) uint8
        `ContactStatus`.
    time, time_lower, time_upper, last_time : (n,) float64
        As in `PairContacts`; NaN for NEVER and UNSUPPORTED.
    normal : (n, 3) float64
        Fixed frame.
    closing_speed : (n,) float64
        As in `PairContacts`.
    points : (k, 3) float64, point_offsets : (n + 1,) int64
        Contact set of pair i: ``points[point_offsets[i]:point_offsets[i + 1]]``, fixed frame.
    part_offsets : (m + 1,) int64
        Its parts, as in `PairContacts`.
    message : str
        Names what is unsupported; empty otherwise.
    cost : Cost
    """

    status: ByteArray
    time: FloatArray
    time_lower: FloatArray
    time_upper: FloatArray
    last_time: FloatArray
    normal: FloatArray
    closing_speed: FloatArray
    points: FloatArray
    point_offsets: IntArray
    part_offsets: IntArray
    message: str
    cost: Cost


class Bodies(NamedTuple):
    """Shapes that are in no scene, listed under a name."""

    shapes: Sequence[Shape | Frustum]
    poses: FloatArray  #: (n, 7), not yet checked
    twists: FloatArray  #: (n, 6), not yet checked; no row at all: at rest
    suffix: str = ""  #: a fault is one of "poses" + suffix


def world_of(*sides: Bodies) -> World:
    """Bodies as the objects "0", "1", ... of a world.

    Raises
    ------
    GeometryError
        Names the list, the index and the fault.
    """
    poses = _checked(sides, "poses", [side.poses for side in sides], _validate.poses)
    model = _resting(tuple(shape for side in sides for shape in side.shapes))
    twists = model.twists
    if any(len(side.twists) for side in sides):
        whole = [side.twists if len(side.twists) else np.zeros((len(side.shapes), 6)) for side in sides]
        twists = _checked(sides, "twists", whole, lambda rows, name: _validate.floats(rows, name, (None, 6)))
    if model.planar.any():
        poses, faults = laid_flat(poses, twists, model.planar)
        for row, text in faults.items():
            for side in sides:
                if row < len(side.shapes):
                    raise GeometryError(f"poses{side.suffix}[{row}]: {text}")
                row -= len(side.shapes)
    # A copy of the model but for these; dataclasses.replace would take as long as a query.
    world = object.__new__(World)
    world.__dict__.update(model.__dict__, poses=poses, twists=twists)
    return world


@lru_cache(maxsize=128)
def _resting(shapes: tuple[Shape | Frustum, ...]) -> World:
    """Shapes at rest in the origin: what can be kept of them, as a client asks about the same again and again."""
    count = len(shapes)
    ids = tuple(map(str, range(count)))
    world = World(
        ids=ids,
        index={name: row for row, name in enumerate(ids)},
        table=ShapeTable.of(shapes),
        shape=np.arange(count),
        uncertainty=np.zeros(count),
        velocity_uncertainty=np.zeros(count),
        motion_faults={},
        poses=np.tile([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0], (count, 1)),
        twists=np.zeros((count, 6)),
        allowed=np.zeros(0, np.int64),
        version=0,
        stamp=None,
    )
    assert len(world.planar) == count  # found out once, for all copies
    return world


def distance_of_two(
    a: Shape | Frustum, b: Shape | Frustum, poses: FloatArray, *, penetration: bool, accuracy: str
) -> ListedDistances | None:
    """Distance of two solids with checked poses (2, 7) that are in no scene; None if they have to go the long way.

    The same as `listed_distances` of `world_of`, without what only longer lists need: the one pair of a small request
    is answered in the time that the rest of the call takes anyway.  `accuracy` is one of `TIERS`.
    """
    start = time.perf_counter_ns()
    model = _resting((a, b))
    if model.planar.any():
        return None
    distance, lower, upper, point_a, point_b, normal, status, rung = _core.distance_placed(
        *model.table.packed,
        model.table.reach,
        model.shape,
        poses,
        model.uncertainty,
        _ONE_PAIR,
        RELATIVE_POSE_ROUNDING,
        penetration,
        accuracy,
        model.table.frusta,
    )
    if status[0] == DistanceStatus.UNSUPPORTED:
        return None
    names = (a.kind, b.kind) if a.kind < b.kind else (b.kind, a.kind)
    counts = {"narrow {}-{}".format(*names): 1}
    if accuracy != "float64":
        counts[RUNGS[rung[0]]] = 1
    cost = Cost(time.perf_counter_ns() - start, accuracy, counts)
    return ListedDistances(status, distance, lower, upper, point_a, point_b, normal, "", cost)


_ONE_PAIR = np.array([[0, 1]])


def _checked(
    sides: Sequence[Bodies], name: str, rows: Sequence[FloatArray], check: Callable[[FloatArray, str], FloatArray]
) -> FloatArray:
    """All rows, checked at once; only a fault is looked for list by list, to be named."""
    try:
        return check(np.concatenate(rows), name)
    except GeometryError:
        for side, part in zip(sides, rows, strict=True):
            check(part, f"{name}{side.suffix}")
        raise


def listed_distances(
    world: World,
    pairs: IntArray,
    *,
    want: Sequence[str] = ("distance",),
    accuracy: str = "float64",
    tolerance: float | None = None,
    time_budget: float | None = None,
) -> ListedDistances:
    """Distances of listed pairs, (n, 2) rows of `world`; how good they are asked to be as for `Scene.distances`."""
    start, counts = time.perf_counter_ns(), Counter[str]()
    quality = Quality.of(accuracy, tolerance, time_budget)
    if quality.climbs:
        return _climbed_distances(world, pairs, want, quality)
    tier = quality.accuracy
    penetration = "penetration" in _validate.want(want, ("distance", "witness", "penetration"))
    _distinct(world, pairs)
    _count(world, pairs, counts)
    # Most lists are all of one kind, and then no row needs to be moved.
    planar = world.planar[pairs] if world.planar.any() else _NONE
    if not planar.any():
        columns = placed_distances(world, pairs, penetration, tier, counts)
    elif planar.all():
        columns = _columns(polygon_distances(world, pairs, penetration, tier, counts))
    else:
        columns = _columns(_mixed_distances(world, pairs, planar, penetration, tier, counts))
    distance, lower, upper, point_a, point_b, normal, status = columns
    unsupported = status == DistanceStatus.UNSUPPORTED
    return ListedDistances(
        status=status,
        distance=distance,
        lower=lower,
        upper=upper,
        point_a=point_a,
        point_b=point_b,
        normal=normal,
        message=_reasons(world, pairs[unsupported]) if unsupported.any() else "",
        cost=Cost(time.perf_counter_ns() - start, tier, dict(counts)),
    )


def _climbed_distances(world: World, pairs: IntArray, want: Sequence[str], quality: Quality) -> ListedDistances:
    """The same, each pair at the cheapest tier that will do."""
    start = time.perf_counter_ns()
    rungs = quality.rungs(TIERS, MEASURING, lengths=True)
    lacking = quality.tolerance is None or "witness" in want  # what bounding volumes cannot give

    def solve(items: IntArray, tier: str) -> tuple[ListedDistances, IntArray]:
        return listed_distances(world, pairs[items], want=want, accuracy=tier), items

    def settled(answer: ListedDistances, tier: str) -> BoolArray:
        hopeless: BoolArray = answer.status == DistanceStatus.UNSUPPORTED
        if tier == "bound" and len(rungs) > 1 and lacking:
            return hopeless
        good: BoolArray = (answer.status == DistanceStatus.OK) & narrow(answer.lower, answer.upper, quality.tolerance)
        return hopeless | good

    _distinct(world, pairs)
    found = climb(np.arange(len(pairs)), rungs, solve, settled, quality)
    status = found.column("status")
    status[~found.settled & (status == DistanceStatus.OK)] = DistanceStatus.NOT_CONVERGED
    return ListedDistances(
        status=status,
        distance=found.column("distance"),
        lower=found.column("lower"),
        upper=found.column("upper"),
        point_a=found.column("point_a"),
        point_b=found.column("point_b"),
        normal=found.column("normal"),
        message=found.message(),
        cost=found.cost(start),
    )


def _columns(rows: DistanceRows) -> tuple[Any, ...]:
    """The order of `placed_distances`."""
    return rows.distance, rows.lower, rows.upper, rows.point_a, rows.point_b, rows.normal, rows.status


def _mixed_distances(
    world: World, pairs: IntArray, planar: BoolArray, penetration: bool, tier: str, counts: Counter[str]
) -> DistanceRows:
    """Solids with solids, polygons with polygons, and nothing for the rest."""
    count = len(pairs)
    number, vector = np.full(count, np.nan), np.full((count, 3), np.nan)
    status = np.full(count, DistanceStatus.UNSUPPORTED, np.uint8)
    whole = DistanceRows(
        pairs, number, number.copy(), number.copy(), vector, vector.copy(), vector.copy(), status, np.zeros(count)
    )
    for chosen, kernel in ((~planar.any(axis=1), solid_distances), (planar.all(axis=1), polygon_distances)):
        part = kernel(world, pairs[chosen], penetration, tier, counts)
        for column in fields(DistanceRows)[1:]:
            getattr(whole, column.name)[chosen] = getattr(part, column.name)
    return whole


FEW = 8  # pairs are looked at faster one by one


def _count(world: World, pairs: IntArray, counts: Counter[str]) -> None:
    """What `count_kinds` counts."""
    if len(pairs) > FEW:
        count_kinds(world, pairs, counts)
        return
    shapes, shape = world.table.shapes, world.shape
    for i, j in pairs.tolist():
        a, b = shapes[shape[i]].kind, shapes[shape[j]].kind
        counts[f"narrow {a}-{b}" if a < b else f"narrow {b}-{a}"] += 1


def _distinct(world: World, pairs: IntArray) -> None:
    if len(pairs) <= FEW and all(i != j for i, j in pairs.tolist()):
        return
    same = pairs[:, 0] == pairs[:, 1]
    if same.any():
        k = int(np.argmax(same))
        raise GeometryError(f"pair {k} is {world.ids[pairs[k, 0]]!r} with itself")


def _reasons(world: World, pairs: IntArray) -> str:
    """Why distances of the listed pairs are unsupported, each reason once."""
    comparable = world.planar[pairs[:, 0]] == world.planar[pairs[:, 1]]
    reasons = [NO_DISTANCE.format(name) for name in world.pair_kinds(pairs[comparable])[0]]
    return "; ".join(reasons + [NOT_COMPARED] * (not comparable.all()))


def listed_first_contacts(
    world: World,
    pairs: IntArray,
    horizon: float,
    *,
    margin: float = 0.0,
    accuracy: str = "float64",
    tolerance: float | None = None,
    time_budget: float | None = None,
    contact_set: bool = True,
    rotation: bool = True,
) -> ListedContacts:
    """First contacts of listed pairs, (n, 2) rows of `world`; all else as for `Scene.first_contacts`."""
    start, counts = time.perf_counter_ns(), Counter[str]()
    quality = Quality.of(accuracy, tolerance, time_budget)
    near = nearness(margin, quality.accuracy)
    end = _validate.limit(horizon, "horizon")
    tier = quality.accuracy
    if near == 0.0 and not quality.climbs and _all_slide(world, pairs):
        return _sliding_polygons(world, pairs, end, tier, start, contact_set)
    listed = _Listed(world, pairs)
    question = Question(end, tier, near, contact_set=contact_set, rotation=rotation)
    if quality.climbs:
        rows, unsupported, tier = climbed_contact_rows(world, listed.comparable, question, quality, counts)
    else:
        rows, unsupported = contact_rows(world, listed.comparable, question, counts)
    at = listed.rows_among(rows.pairs)
    # A pair without a row never touches, or could not be compared at all.
    status = _take(rows.status, at, ContactStatus.NEVER)
    status[listed.incomparable | (listed.rows_among(unsupported.pairs) < len(unsupported.pairs))] = (
        ContactStatus.UNSUPPORTED
    )
    sets = [*rows.points, None]
    points, point_offsets, part_offsets = packed_sets(sets[k] for k in at.tolist())
    normal = _take(rows.normal, at, np.nan)
    return ListedContacts(
        status=status,
        time=_take(rows.time, at, np.nan),
        time_lower=_take(rows.lower, at, np.nan),
        time_upper=_take(rows.upper, at, np.nan),
        last_time=_take(rows.last_time, at, np.nan),
        normal=np.where(listed.swapped[:, None], 0.0 - normal, normal),
        closing_speed=_take(closing_speeds(world, rows), at, np.nan),
        points=points,
        point_offsets=point_offsets,
        part_offsets=part_offsets,
        message=listed.message(unsupported),
        cost=Cost(time.perf_counter_ns() - start, tier, dict(counts)),
    )


def _all_slide(world: World, pairs: IntArray) -> bool:
    """Whether all are polygons in translation, exactly where they are said to be: the kernel's own case."""
    rows = pairs.ravel()
    return not (
        (~world.planar[rows]).any()
        or world.turns[rows].any()
        or world.uncertainty[rows].any()
        or world.velocity_uncertainty[rows].any()
    )


def _sliding_polygons(
    world: World, pairs: IntArray, horizon: float, tier: str, start: int, contact_set: bool
) -> ListedContacts:
    _distinct(world, pairs)
    counts = Counter[str]()
    _count(world, pairs, counts)
    rows = polygon_contacts(world, pairs, world.twists[:, :2], horizon, tier, counts, contact_set)
    points, point_offsets, part_offsets = packed_sets(rows.points)
    return ListedContacts(
        status=rows.status,
        time=rows.time,
        time_lower=rows.lower,
        time_upper=rows.upper,
        last_time=rows.last_time,
        normal=rows.normal,
        closing_speed=closing_speeds(world, rows),
        points=points,
        point_offsets=point_offsets,
        part_offsets=part_offsets,
        message="",
        cost=Cost(time.perf_counter_ns() - start, tier, dict(counts)),
    )


class _Listed:
    """Listed pairs, and the distinct ones among them that can be compared, smaller row first."""

    def __init__(self, world: World, pairs: IntArray) -> None:
        _distinct(world, pairs)
        low, high = np.minimum(pairs[:, 0], pairs[:, 1]), np.maximum(pairs[:, 0], pairs[:, 1])
        self._world = world
        self._keys = low * len(world) + high
        self.swapped: BoolArray = pairs[:, 0] > pairs[:, 1]
        self.incomparable: BoolArray = world.planar[low] != world.planar[high]
        distinct = np.unique(self._keys[~self.incomparable])
        self.comparable: IntArray = np.column_stack(np.divmod(distinct, max(len(world), 1)))

    def rows_among(self, pairs: IntArray) -> IntArray:
        """Position of each listed pair among sorted `pairs`; ``len(pairs)`` for one that is not there."""
        keys = pairs[:, 0] * len(self._world) + pairs[:, 1]
        at = np.searchsorted(keys, self._keys)
        there = at < len(keys)
        there[there] = keys[at[there]] == self._keys[there]
        return np.where(there, at, len(keys))

    def message(self, unsupported: Unsupported) -> str:
        """What is unsupported, each reason once."""
        reasons = list(dict.fromkeys(unsupported.reason.tolist()))
        if self.incomparable.any():
            reasons.append(NOT_COMPARED)
        return "; ".join(reasons)


def _take(column: NDArray[Any], rows: IntArray, missing: float) -> NDArray[Any]:
    """The listed rows, and `missing` for the one past the end."""
    padded = np.concatenate([column, np.full((1, *column.shape[1:]), missing, column.dtype)])
    taken: NDArray[Any] = padded[rows]
    return taken
