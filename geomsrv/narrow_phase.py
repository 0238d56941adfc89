# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""Answers for listed pairs of objects, in the fixed frame, with intervals that cover every rounding on the way.

The engine sees a pair of solids through the pose of b in a; that pose is computed once and from then on taken
literally, and what its rounding may have changed is added to the interval, together with the objects' own uncertainty.
Polygons are placed in the plane once, and those numbers are taken literally.  So at each tier the answer is that of
`distance` or `first_contact` for these numbers, but for the wider interval.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, fields, replace
from itertools import product
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from geomsrv import _core
from geomsrv.answers import (
    BoolArray,
    ByteArray,
    ContactStatus,
    DistanceStatus,
    FloatArray,
    IntArray,
    gather,
    sets_end_to_end,
)
from geomsrv.ladder import Quality, climb, narrow
from geomsrv.queries import MEASURING, RUNGS, SOLID_MOTION_TIERS, TIERS
from geomsrv.world import ROUNDOFF, World, supported_kinds

__all__ = [
    "ContactRows",
    "DistanceRows",
    "at_rest",
    "distance_rows",
    "first_contact_rows",
    "near_at_rest",
    "packed_sets",
    "placed",
    "placed_boxes",
    "placed_distances",
    "placed_hulls",
    "point_sets",
    "polygon_contacts",
    "polygon_distances",
    "relative_poses",
    "solid_distances",
    "unpredictable",
]

# How much the rounded relative pose may move one body against the other, in terms of r_a + r_b + |p_ab|, r
# the reach of a body from its origin.  With u = 2^-53 and Q the exact rotation of a unit quaternion that is
# off by s = |q| - 1, |s| <= 3 u: a rotation matrix computed from it is off by sqrt(99) u (9 entries, up to 5
# u on the diagonal and 2 u beside it) + 4 s = 22 u.  That holds for R_a, which moves points of a, for R_b,
# and once more for the matrix the engine computes from the relative quaternion.  That is a product, which
# errs by 4 u in each of four parts and so turns by 16 u; normalising it turns it by 4 u more at most.  So r_a
# counts 22 u, r_b 22 + 22 + 20 = 64 u, |p_ab| 22 u + 6 u for its own arithmetic; half as much again is added.
RELATIVE_POSE_ROUNDING = 96.0 * ROUNDOFF

# Shifting a body: velocity difference 1 u, product 1 u, sum 1 u of numbers up to twice the larger coordinate, in
# up to three coordinates.
SHIFT_ROUNDING = 16.0 * ROUNDOFF

# Speed along a normal, as a share of the velocity: its difference, three products and two sums take 6 u; a unit normal
# is good to 4 u in each part; rounded up.
SPEED_ROUNDING = 16.0 * ROUNDOFF

# A length by a speed and a sum of times: 3 u, rounded up.
TIME_ROUNDING = 8.0 * ROUNDOFF

# Bodies that pass within their uncertainty are followed feature by feature; a polygon has few.  A pair still
# open after so many steps is reported as one that may touch.
MAX_APPROACH_STEPS = 64

NO_DISTANCE = "distance {} is unsupported in this version"
NO_ROTATION = "first contact of a polygon with angular velocity is unsupported"
UNPREDICTABLE = "first contact is unsupported: {}"
NO_MOTION = "first contact of moving solids ({}) is unsupported"
NO_TURNING = "first contact of solids with angular velocity ({}) is unsupported"

_NO_PAIRS = np.zeros((0, 2), np.int64)


class _Rows:
    """Arrays of one length, a row per pair; `pairs` comes first."""

    pairs: IntArray

    @classmethod
    def columns(cls) -> list[str]:
        """Their names, in order."""
        return [field.name for field in fields(cls)]  # type: ignore[arg-type]  # every subclass is a dataclass

    def take(self, rows: IntArray | BoolArray) -> Self:
        """The listed rows."""
        return type(self)(*(getattr(self, name)[rows] for name in self.columns()))

    @classmethod
    def joined(cls, parts: list[Self]) -> Self:
        """All rows, sorted by pair; each part is sorted, and one may be empty."""
        filled = [part for part in parts if len(part.pairs)]
        if len(filled) < 2:
            return filled[0] if filled else parts[0]
        whole = cls(*(np.concatenate([getattr(part, name) for part in filled]) for name in cls.columns()))
        return whole.take(np.lexsort(whole.pairs.T[::-1]))


@dataclass(frozen=True, eq=False)
class Unsupported(_Rows):
    """Pairs no kernel answers."""

    pairs: IntArray  #: (k, 2)
    reason: NDArray[np.object_]  #: (k,) str

    @classmethod
    def none(cls) -> Unsupported:
        """No pair."""
        return cls(_NO_PAIRS, np.empty(0, dtype=object))

    @classmethod
    def of_kinds(cls, world: World, pairs: IntArray, text: str) -> Unsupported:
        """With a reason that names the kinds where `text` has a placeholder."""
        if len(pairs) == 0:
            return cls.none()
        names, which = world.pair_kinds(pairs)
        return cls(pairs, np.array([text.format(name) for name in names], dtype=object)[which])


@dataclass(frozen=True, eq=False)
class DistanceRows(_Rows):
    """Distances of pairs; points and normals (k, 3) in the fixed frame."""

    pairs: IntArray
    distance: FloatArray
    lower: FloatArray
    upper: FloatArray
    point_a: FloatArray
    point_b: FloatArray
    normal: FloatArray
    status: ByteArray
    uncertainty: FloatArray  #: sum of what the two objects may be off [m]

    @classmethod
    def none(cls) -> DistanceRows:
        """No pair."""
        number, point = np.zeros(0), np.zeros((0, 3))
        return cls(_NO_PAIRS, number, number, number, point, point, point, np.zeros(0, np.uint8), number)


@dataclass(frozen=True, eq=False)
class ContactRows(_Rows):
    """First contacts of pairs; normals (k, 3) and contact points in the fixed frame."""

    pairs: IntArray
    status: ByteArray
    time: FloatArray
    lower: FloatArray
    upper: FloatArray
    last_time: FloatArray
    normal: FloatArray
    points: NDArray[np.object_]  #: (k,) contact set (m, 3) of every row, a list of such if it may have parts, or None
    certain: BoolArray  #: exact arithmetic on the same numbers gives the same status

    @classmethod
    def silent(cls, pairs: IntArray) -> ContactRows:
        """Rows of pairs nothing is known about."""
        count = len(pairs)
        status, unknown = np.full(count, ContactStatus.UNSUPPORTED, np.uint8), np.full(count, np.nan)
        normal, points = np.full((count, 3), np.nan), np.empty(count, dtype=object)
        return cls(pairs, status, unknown, unknown, unknown, unknown, normal, points, np.ones(count, np.bool_))


def count_kinds(world: World, pairs: IntArray, counts: Counter[str]) -> None:
    """Count the engine's work by kinds: "narrow box-sphere"."""
    names, which = world.pair_kinds(pairs)
    for name, number in zip(names, np.bincount(which, minlength=len(names)).tolist(), strict=True):
        counts[f"narrow {name}"] += number


def count_rungs(tier: str, totals: Iterable[int], counts: Counter[str]) -> None:
    """Count pairs by what it took to answer them, in the order of `RUNGS`; at float64 that is the same for all."""
    if tier != "float64":
        counts.update({name: int(total) for name, total in zip(RUNGS, totals, strict=True) if total})


# --------------------------------------------------------------------------------------------------- distance


def climbed_distance_rows(
    world: World, pairs: IntArray, penetration: bool, quality: Quality, counts: Counter[str], limit: float, points: bool
) -> tuple[DistanceRows, Unsupported, str]:
    """The same at the cheapest tiers that will do, and the highest of them.

    Whether a pair is within the `limit` [m] is all that is asked of one that is not; with `points` nearest points are
    wanted, too, which bounding volumes do not have.
    """
    missing = [Unsupported.none()]
    # Pairs have come through their bounding boxes already.
    rungs = quality.rungs(TIERS, MEASURING[1:], lengths=True)

    def solve(chosen: IntArray, tier: str) -> tuple[DistanceRows, IntArray]:
        rows, unsupported = distance_rows(world, chosen, penetration, tier, counts)
        missing.append(unsupported)
        return rows, rows.pairs

    def settled(rows: DistanceRows, tier: str) -> BoolArray:
        beyond = rows.lower > limit
        if tier == "bound" and len(rungs) > 1 and (points or quality.tolerance is None):
            return beyond
        good: BoolArray = (rows.status == DistanceStatus.OK) & narrow(rows.lower, rows.upper, quality.tolerance)
        return beyond | good

    found = climb(pairs, rungs, solve, settled, quality, tried=())
    rows = found.rows(DistanceRows)
    rows.status[~found.settled & (rows.status == DistanceStatus.OK)] = DistanceStatus.NOT_CONVERGED
    return rows, Unsupported.joined(missing), found.count_tiers(counts)


def distance_rows(
    world: World, pairs: IntArray, penetration: bool, tier: str, counts: Counter[str]
) -> tuple[DistanceRows, Unsupported]:
    """Distance of every pair, and the pairs that have no kernel."""
    planar = world.planar[pairs[:, 0]]
    solids, polygons = pairs[~planar], pairs[planar]
    kinds = world.kinds[solids]
    answered = supported_kinds()[kinds[:, 0], kinds[:, 1]]
    parts = [DistanceRows.none()]
    for part, kernel in ((solids[answered], solid_distances), (polygons, polygon_distances)):
        if len(part):
            count_kinds(world, part, counts)
            parts.append(kernel(world, part, penetration, tier, counts))
    rows = DistanceRows.joined(parts)
    missing = [Unsupported.of_kinds(world, solids[~answered], NO_DISTANCE)]
    # A kernel may decline a pair for other reasons than its kinds.
    declined = rows.status == DistanceStatus.UNSUPPORTED
    if declined.any():
        missing.append(Unsupported.of_kinds(world, rows.pairs[declined], NO_DISTANCE))
        rows = rows.take(~declined)
    return rows, Unsupported.joined(missing)


def solid_distances(world: World, pairs: IntArray, penetration: bool, tier: str, counts: Counter[str]) -> DistanceRows:
    """Distances of solids, in any order; pairs without a kernel keep their rows."""
    columns = placed_distances(world, pairs, penetration, tier, counts)
    return DistanceRows(pairs, *(*columns, world.uncertainty[pairs].sum(axis=1)))


def placed_distances(
    world: World, pairs: IntArray, penetration: bool, tier: str, counts: Counter[str]
) -> tuple[Any, ...]:
    """Distance, lower, upper, point_a, point_b, normal and status of solids, in any order."""
    table = world.table
    *columns, rung = _core.distance_placed(
        *table.packed,
        table.reach,
        world.shape,
        world.poses,
        world.uncertainty,
        np.ascontiguousarray(pairs),
        RELATIVE_POSE_ROUNDING,
        penetration,
        tier,
        table.frusta,
    )
    if tier != "float64":
        count_rungs(tier, np.bincount(rung[columns[-1] != DistanceStatus.UNSUPPORTED], minlength=len(RUNGS)), counts)
    return tuple(columns)


def relative_poses(world: World, pairs: IntArray) -> FloatArray:
    """(k, 7) pose of the second object of each pair in the first: normalised, as queries do, that of the engine."""
    i, j = pairs[:, 0], pairs[:, 1]
    step = (world.poses[j, :3] - world.poses[i, :3])[:, :, None]
    turn = world.rotations[i]
    ax, ay, az, aw = world.poses[i, 3:].T
    bx, by, bz, bw = world.poses[j, 3:].T
    return np.column_stack(
        [
            step[:, 0] * turn[:, 0] + step[:, 1] * turn[:, 1] + step[:, 2] * turn[:, 2],
            # conj(a) b
            aw * bx - ax * bw - ay * bz + az * by,
            aw * by + ax * bz - ay * bw - az * bx,
            aw * bz - ax * by + ay * bx - az * bw,
            aw * bw + ax * bx + ay * by + az * bz,
        ]
    )


def polygon_distances(
    world: World, pairs: IntArray, penetration: bool, tier: str, counts: Counter[str]
) -> DistanceRows:
    """Distances of polygons, in any order."""
    rings = (*gather(*world.rings, pairs[:, 0]), *gather(*world.rings, pairs[:, 1]))
    gap, lower, upper, point_a, point_b, normal, status, *_, rungs = _core.distance_polygons(*rings, penetration, tier)
    count_rungs(tier, rungs, counts)
    uncertainty = world.uncertainty[pairs].sum(axis=1)
    lower, upper = _widened(lower, upper, uncertainty, penetration)
    return DistanceRows(
        pairs,
        lower if tier == "bound" else gap,
        lower,
        upper,
        _in_space(point_a),
        _in_space(point_b),
        _in_space(normal),
        status,
        uncertainty,
    )


def _in_space(plane: FloatArray) -> FloatArray:
    """(k, 2) -> (k, 3) with z = 0, or NaN where there is no point."""
    return np.column_stack([plane, 0.0 * plane[:, :1] + 0.0])


def _widened(lower: FloatArray, upper: FloatArray, by: FloatArray, signed: bool) -> tuple[FloatArray, FloatArray]:
    """Interval of a distance between bodies that may be off by so much in all; unchanged where that is 0."""
    low = np.where(by > 0.0, np.nextafter(lower - by, -np.inf), lower)
    high = np.where(by > 0.0, np.nextafter(upper + by, np.inf), upper)
    return low if signed else np.maximum(low, 0.0), high


# ---------------------------------------------------------------------------------------------- first contact


def first_contact_rows(
    world: World, pairs: IntArray, horizon: float, tier: str, counts: Counter[str], contact_set: bool = True
) -> tuple[ContactRows, Unsupported]:
    """First contact of every pair that has one or may have one, and the pairs whose motion has no kernel."""
    planar = world.planar[pairs[:, 0]]
    # Whatever turns, or moves in a way that nobody knows, is still where it is at the start.
    turning = np.zeros(len(pairs), dtype=bool)
    if horizon > 0.0 and world.turns.any():
        turning = world.turns[pairs].any(axis=1)
    moving = ~planar & ~turning & (horizon > 0.0) & world.polyhedra[pairs].all(axis=1)
    moving &= world.velocity_uncertainty[pairs].any(axis=1) | _relative_velocity(world, pairs, 3).any(axis=1)
    sliding, spinning, solids = pairs[planar & ~turning], pairs[planar & turning], pairs[~planar & ~moving]
    if (counted := planar | moving).any():
        count_kinds(world, pairs[counted], counts)
    rows, unsupported = [ContactRows.silent(_NO_PAIRS)], [Unsupported.none()]
    if len(sliding):
        rows.append(_sliding(world, sliding, polygon_contacts, horizon, tier, counts, contact_set))
    if moving.any():
        rows.append(_sliding(world, pairs[moving], solid_contacts, horizon, tier, counts, contact_set))
    if len(spinning):
        answered, missing = _spinning_polygons(world, spinning, tier, counts)
        rows.append(answered)
        unsupported.append(missing)
    if len(solids):
        answered, missing = _solid_contacts(world, solids, horizon, tier, counts)
        rows.append(answered)
        unsupported.append(missing)
    return ContactRows.joined(rows), Unsupported.joined(unsupported)


_Kernel = Callable[[World, IntArray, FloatArray, float, str, Counter[str], bool], ContactRows]


def _sliding(
    world: World,
    pairs: IntArray,
    kernel: _Kernel,
    horizon: float,
    tier: str,
    counts: Counter[str],
    contact_set: bool,
) -> ContactRows:
    """Bodies in translation: what the engine answers, and what their uncertainty makes of it."""
    if not (world.uncertainty.any() or world.velocity_uncertainty.any()):
        rows = kernel(world, pairs, world.twists, horizon, tier, counts, contact_set)
        return rows.take(rows.status != ContactStatus.NEVER)
    uncertainty = world.uncertainty[pairs].sum(axis=1)
    # A velocity that is off displaces by no more than this until the end of the time looked at.
    drift = world.velocity_uncertainty[pairs].sum(axis=1)
    uncertainty += np.multiply(drift, horizon, out=np.zeros_like(drift), where=drift > 0.0)
    # What follows relies on normals as good as SPEED_ROUNDING says.
    vague = uncertainty.any()
    kept = "float64" if vague and tier == "float32" else tier
    rows = kernel(world, pairs, world.twists, horizon, kept, counts, contact_set)
    if not vague:
        return rows.take(rows.status != ContactStatus.NEVER)
    never = rows.status == ContactStatus.NEVER
    hits = np.flatnonzero(~never & (uncertainty > 0.0))
    counts["uncertain"] += len(hits)
    if tier == "bound":
        # Larger volumes meet earlier; smaller bodies may miss each other.
        start = _approach(world, pairs[hits], uncertainty[hits], horizon, tier, counts)
        rows.lower[hits], rows.upper[hits] = np.fmin(rows.lower[hits], start), np.inf
    else:
        if _planar(world, pairs):
            speed, normal = _relative_velocity(world, pairs[hits], 2), rows.normal[hits, :2]
            rows.lower[hits] = _earlier(rows.lower[hits], uncertainty[hits], speed, normal)
        else:  # a normal in space, of three vertices that may be close together, is less sharp than a distance
            start = _approach(world, pairs[hits], uncertainty[hits], horizon, tier, counts)
            rows.lower[hits] = np.fmin(rows.lower[hits], start)
        rows.upper[hits] = _later(world, rows.take(hits), uncertainty[hits], horizon)
    close = np.flatnonzero(never & (uncertainty > 0.0))
    start = _approach(world, pairs[close], uncertainty[close], horizon, tier, counts)
    rows.lower[close], rows.upper[close] = start, np.where(np.isnan(start), np.nan, np.inf)
    return rows.take(~never | ~np.isnan(rows.lower))


def _planar(world: World, pairs: IntArray) -> bool:
    """Whether pairs of one family are polygons."""
    return bool(len(pairs)) and bool(world.planar[pairs[0, 0]])


def polygon_contacts(
    world: World,
    pairs: IntArray,
    velocities: FloatArray,
    horizon: float,
    tier: str,
    counts: Counter[str],
    contact_set: bool = True,
) -> ContactRows:
    """The engine's answer for polygons with the given velocities."""
    rings = (*gather(*world.rings, pairs[:, 0]), *gather(*world.rings, pairs[:, 1]))
    velocity_a, velocity_b = (np.ascontiguousarray(velocities[pairs[:, k], :2]) for k in range(2))
    status, time, lower, upper, last, normal, points, offsets, certain, rungs = _core.first_contact_polygons(
        *rings, velocity_a, velocity_b, horizon, contact_set, tier
    )
    count_rungs(tier, rungs, counts)
    sets = point_sets(_in_space(points), offsets)
    return ContactRows(pairs, status, time, lower, upper, last, _in_space(normal), sets, certain)


def solid_contacts(
    world: World,
    pairs: IntArray,
    velocities: FloatArray,
    horizon: float,
    tier: str,
    counts: Counter[str],
    contact_set: bool = True,
) -> ContactRows:
    """The engine's answer for boxes and hulls with the given velocities; there is no kernel in single precision."""
    tier = tier if tier in SOLID_MOTION_TIERS else "float64"
    answered = [ContactRows.silent(_NO_PAIRS)]
    for part, side_a, side_b in _by_kind(world, pairs):
        here = pairs[part]
        velocity_a, velocity_b = (np.ascontiguousarray(velocities[here[:, k], :3]) for k in range(2))
        status, time, lower, upper, last, normal, points, offsets, certain, _, rungs = _core.first_contact_world(
            side_a, side_b, velocity_a, velocity_b, horizon, contact_set, tier
        )
        count_rungs(tier, rungs, counts)
        sets = point_sets(points, offsets)
        answered.append(ContactRows(here, status, time, lower, upper, last, normal, sets, certain))
    return ContactRows.joined(answered)


def point_sets(points: FloatArray, offsets: IntArray) -> NDArray[np.object_]:
    """(k,) the contact set of every row, or None."""
    sets = np.empty(len(offsets) - 1, dtype=object)
    for k in np.flatnonzero(np.diff(offsets)).tolist():
        sets[k] = points[offsets[k] : offsets[k + 1]]
    return sets


def packed_sets(sets: Iterable[Any]) -> tuple[FloatArray, IntArray, IntArray]:
    """Contact sets as those of `ContactRows`: all points, where those of each row begin, and where its parts do."""
    return sets_end_to_end(([] if x is None else x if isinstance(x, list) else [x] for x in sets), 3)


_Side = tuple[Any, ...]


def _by_kind(
    world: World, pairs: IntArray, shift: FloatArray | None = None
) -> Iterator[tuple[BoolArray, _Side, _Side]]:
    """Pairs of boxes, of boxes and hulls, and so on: which they are, and both sides; the first may be shifted."""
    boxes = world.table.boxes[world.shape[pairs]]
    for is_box in product((True, False), repeat=2):
        part = (boxes == is_box).all(axis=1)
        if part.any():
            rows = pairs[part]
            moved = None if shift is None else shift[part]
            yield part, _side(world, rows[:, 0], is_box[0], moved), _side(world, rows[:, 1], is_box[1], None)


def _side(world: World, rows: IntArray, boxes: bool, shift: FloatArray | None) -> _Side:
    """A batch of boxes, literally, or of hulls, as the engine reads it."""
    if boxes:
        center, axes, half = placed_boxes(world, rows)
        return (center if shift is None else center + shift), axes, half
    vertices, offsets = placed_hulls(world, rows)
    return (vertices if shift is None else vertices + np.repeat(shift, np.diff(offsets), axis=0)), offsets


def placed_boxes(world: World, rows: IntArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Centres, axes and half extents of boxes in the fixed frame, literally."""
    axes = np.ascontiguousarray(world.rotations_of(rows).swapaxes(1, 2))
    return np.ascontiguousarray(world.poses[rows, :3]), axes, world.table.half[world.shape[rows]]


def placed_hulls(world: World, rows: IntArray) -> tuple[FloatArray, IntArray]:
    """Vertices (k, 3) and offsets of hulls in the fixed frame: these numbers, rounded, are taken literally."""
    packed = world.table.packed
    vertices, offsets = gather(packed.vertices, packed.offsets, world.shape[rows])
    return placed(world, np.repeat(rows, np.diff(offsets)), vertices), offsets


def placed(world: World, rows: IntArray, points: FloatArray) -> FloatArray:
    """Points (k, 3) of the listed objects in the fixed frame, rounded."""
    turn, (x, y, z) = world.rotations_of(rows), points.T
    # Not a matrix product: that may add up in another order for another number of vertices.
    turned = [turn[:, k, 0] * x + turn[:, k, 1] * y + turn[:, k, 2] * z for k in range(3)]
    return np.column_stack(turned) + world.poses[rows, :3]


def _relative_velocity(world: World, pairs: IntArray, dimension: int) -> FloatArray:
    """(k, d): velocity of a as seen from b."""
    velocity: FloatArray = world.twists[pairs[:, 0], :dimension] - world.twists[pairs[:, 1], :dimension]
    return velocity


def _closing_speed(velocity: FloatArray, normal: FloatArray, sign: float) -> FloatArray:
    """Speed at which a comes nearer to b along the normal; moved up or down by more than its rounding."""
    slack = SPEED_ROUNDING * np.abs(velocity).sum(axis=1)
    closing: FloatArray = np.einsum("ki,ki->k", velocity, normal)
    return closing + sign * slack


def _speed(velocity: FloatArray) -> FloatArray:
    """Length of velocities, rounded up."""
    speed: FloatArray = np.linalg.norm(velocity, axis=1) * (1.0 + SPEED_ROUNDING)
    return speed


def _earlier(time: FloatArray, by: FloatArray, velocity: FloatArray, normal: FloatArray) -> FloatArray:
    """Earliest possible contact of bodies larger by `by` in all: they meet no sooner than their contact lines."""
    closing = _closing_speed(velocity, normal, -1.0)
    with np.errstate(over="ignore"):  # so slow that it is infinite
        lead = np.divide(by, closing, out=np.full_like(by, np.inf), where=closing > 0.0)
    return np.maximum(np.nextafter(time - lead * (1.0 + TIME_ROUNDING), -np.inf), 0.0)


def _later(world: World, rows: ContactRows, by: FloatArray, horizon: float) -> FloatArray:
    """Latest possible contact of bodies that are smaller by `by` in all; inf if they may miss.

    The signed distance f of translating convex bodies is a convex function of time, 0 at first contact t.  If
    it is -depth at some later m, it lies below the chord from (t, 0) to (m, -depth), so it has come down to
    -by no later than t + (m - t) by / depth.

          f |
          0 +--- t -------------- m --->
            |      `.             .
        -by +........`.           .
            |           `.        .
     -depth +..............`......+
    """
    end = np.minimum(rows.last_time, horizon)
    # A time beyond the doubles is looked at where it can be: at the start, where they are apart.
    rows = replace(rows, time=np.where(np.isinf(rows.time), 0.0, rows.time))
    middle = np.where((rows.status == ContactStatus.OVERLAPPING) | np.isinf(end), rows.time, 0.5 * (rows.time + end))
    depth = -_distance_at(world, rows.pairs, middle, True)[2]
    deep = depth >= by
    share = np.divide(by, depth, out=np.zeros_like(by), where=deep)
    latest = rows.upper + share * (middle - rows.time) * (1.0 + TIME_ROUNDING)
    latest = np.where(middle > rows.time, np.nextafter(latest, np.inf), rows.upper)
    return np.where(deep, latest, np.inf)


def _distance_at(
    world: World, pairs: IntArray, time: FloatArray, signed: bool, tier: str = "float64"
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Distance of translating bodies at the given times: value, lower, upper, normal (k, d)."""
    if not _planar(world, pairs):
        return _solid_distance_at(world, pairs, time, signed, tier)
    ring_a, offsets_a = gather(*world.rings, pairs[:, 0])
    ring_b, offsets_b = gather(*world.rings, pairs[:, 1])
    moved = ring_a + np.repeat(_relative_velocity(world, pairs, 2) * time[:, None], np.diff(offsets_a), axis=0)
    answer = _core.distance_polygons(moved, offsets_a, ring_b, offsets_b, signed, tier)
    size = np.maximum.reduceat(np.maximum(np.abs(ring_a), np.abs(moved)).max(axis=1), offsets_a[:-1])
    lower, upper = _widened(answer[1], answer[2], SHIFT_ROUNDING * size, signed)
    return answer[0], lower, upper, answer[5]


def _solid_distance_at(
    world: World, pairs: IntArray, time: FloatArray, signed: bool, tier: str
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    shift = _relative_velocity(world, pairs, 3) * time[:, None]
    value, lower, upper, normal = (np.zeros((len(pairs), *size)) for size in ((), (), (), (3,)))
    for part, side_a, side_b in _by_kind(world, pairs, shift):
        answer = _core.distance_world(side_a, side_b, signed, tier)
        value[part], lower[part], upper[part], normal[part] = answer[0], answer[1], answer[2], answer[5]
    place = world.poses[pairs[:, 0], :3]
    size = np.maximum(np.abs(place), np.abs(place + shift)).max(axis=1, initial=0.0)
    size += world.table.reach[world.shape[pairs[:, 0]]]
    lower, upper = _widened(lower, upper, SHIFT_ROUNDING * size, signed)
    return value, lower, upper, normal


def _approach(
    world: World, pairs: IntArray, by: FloatArray, horizon: float, tier: str, counts: Counter[str]
) -> FloatArray:
    """(k,) time until which bodies in translation are surely more than `by` apart; NaN if to the end.

    Conservative advancement: the line through b's nearest point, perpendicular to the shortest way, is
    reached no sooner than gap / closing speed from now.  Bounding volumes name no line: there all speed counts.
    """
    volumes = tier == "bound"
    time = np.zeros(len(pairs))
    open_rows = np.arange(len(pairs))
    for _ in range(MAX_APPROACH_STEPS):
        if not len(open_rows):
            break
        counts["approach steps"] += len(open_rows)
        here = pairs[open_rows]
        _, lower, _, normal = _distance_at(world, here, time[open_rows], False, "bound" if volumes else "float64")
        gap = lower - by[open_rows]
        velocity = _relative_velocity(world, here, normal.shape[1])
        closing = _speed(velocity) if volumes else _closing_speed(velocity, normal, 1.0)
        step = np.divide(gap, closing, out=np.full_like(gap, np.inf), where=closing > 0.0)
        reached = gap <= 0.0
        time[open_rows] += np.where(reached, 0.0, step * (1.0 - TIME_ROUNDING))
        time[open_rows[time[open_rows] > horizon]] = np.nan
        open_rows = open_rows[~reached & np.isfinite(time[open_rows])]
    return np.where(np.isfinite(time), time, np.nan)


def _spinning_polygons(
    world: World, pairs: IntArray, tier: str, counts: Counter[str]
) -> tuple[ContactRows, Unsupported]:
    """Polygons that turn: in contact now, or unsupported."""
    rows = polygon_contacts(world, pairs, np.zeros((len(world), 2)), 0.0, tier, counts)
    apart = rows.status == ContactStatus.NEVER
    rows.status[apart] = ContactStatus.UNSUPPORTED
    rows.last_time[:] = np.nan
    certain = -_distance_at(world, pairs, np.zeros(len(pairs)), True)[2] >= world.uncertainty[pairs].sum(axis=1)
    certain &= tier != "bound"
    rows.upper[~apart & ~certain] = np.inf
    return rows, unpredictable(world, Unsupported(pairs[apart], np.full(int(apart.sum()), NO_ROTATION, dtype=object)))


def at_rest(world: World, pairs: IntArray, horizon: float) -> BoolArray:
    """(k,) bool: pairs that rest relative to each other; where only the present is asked about, all do."""
    motion = world.twists[pairs]
    resting: BoolArray = (motion[:, 0] == motion[:, 1]).all(axis=1) & ~world.turns[pairs].any(axis=1)
    resting &= ~world.velocity_uncertainty[pairs].any(axis=1)
    return resting | (horizon == 0.0)


def near_at_rest(
    world: World, pairs: IntArray, horizon: float, counts: Counter[str], margin: float
) -> tuple[ContactRows, Unsupported]:
    """Pairs that rest relative to each other and are, or may be, no further apart than the margin."""
    rows, missing = distance_rows(world, pairs, True, "float64", counts)
    rows = rows.take(rows.lower <= margin)
    near = rows.distance <= margin
    status = np.select(
        [rows.distance < margin, near], [ContactStatus.OVERLAPPING, ContactStatus.TOUCHING], ContactStatus.NEVER
    )
    points = np.empty(len(near), dtype=object)
    for k in np.flatnonzero(near).tolist():
        points[k] = 0.5 * (rows.point_a[k : k + 1] + rows.point_b[k : k + 1])
    answered = ContactRows(
        rows.pairs,
        status.astype(np.uint8),
        np.where(near, 0.0, np.nan),
        np.zeros(len(near)),
        np.where(rows.upper <= margin, 0.0, np.inf),
        np.where(near, horizon, np.nan),
        np.where(near[:, None], rows.normal, np.nan),
        points,
        (rows.lower > margin) | (rows.upper <= margin),
    )
    return answered, missing


def unpredictable(world: World, pairs: Unsupported) -> Unsupported:
    """The same pairs; where it is not known how an object moves, that is the reason."""
    if world.motion_faults:
        for k, pair in enumerate(pairs.pairs.tolist()):
            faults = [world.motion_faults[row] for row in pair if row in world.motion_faults]
            pairs.reason[k] = UNPREDICTABLE.format(faults[0]) if faults else pairs.reason[k]
    return pairs


def _solid_contacts(
    world: World, pairs: IntArray, horizon: float, tier: str, counts: Counter[str]
) -> tuple[ContactRows, Unsupported]:
    """Solids that are not followed: in contact now, at rest relative to each other and so never, or unsupported."""
    rows, missing = distance_rows(world, pairs, True, tier, counts)
    resting = at_rest(world, rows.pairs, horizon)
    touching, may_touch = rows.distance <= 0.0, rows.lower <= 0.0
    by_volumes = np.full(len(touching), tier == "bound")  # which tell neither how deep, nor where
    status = np.select(
        [(rows.distance < 0.0) & ~by_volumes, touching, ~resting, rows.status == DistanceStatus.NOT_CONVERGED],
        [
            ContactStatus.OVERLAPPING,
            ContactStatus.TOUCHING,
            ContactStatus.UNSUPPORTED,
            ContactStatus.NOT_CONVERGED,
        ],
        ContactStatus.NEVER,
    ).astype(np.uint8)
    now = np.where(touching, 0.0, np.nan)
    known = touching | (resting & may_touch)
    points = np.empty(len(status), dtype=object)
    for k in np.flatnonzero(touching & ~by_volumes).tolist():
        points[k] = rows.point_a[k : k + 1]  # the deepest point of a in b belongs to both
    answered = ContactRows(
        rows.pairs,
        status,
        now,
        np.where(known, 0.0, np.nan),
        np.where(known, np.where(rows.upper <= 0.0, 0.0, np.inf), np.nan),
        np.where(touching & resting, horizon, np.nan),
        np.where((touching & ~by_volumes)[:, None], rows.normal, np.nan),
        points,
        (rows.lower > 0.0) | (rows.upper <= 0.0) | (tier == "exact"),
    )
    moving = status == ContactStatus.UNSUPPORTED
    turning = moving & world.turns[rows.pairs].any(axis=1)
    parts = [
        Unsupported.of_kinds(world, rows.pairs[part], text)
        for part, text in ((moving & ~turning, NO_MOTION), (turning, NO_TURNING))
    ]
    unsupported = Unsupported.joined([missing, unpredictable(world, Unsupported.joined(parts))])
    return ContactRows.joined([answered.take(known | moving), ContactRows.silent(missing.pairs)]), unsupported
