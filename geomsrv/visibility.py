# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""What a view frustum sees of every object of a world: by bounding box, and by the shape itself where that is open."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from enum import IntEnum
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from geomsrv import _core
from geomsrv.answers import BoolArray, ByteArray, CullState, DistanceStatus, FloatArray, IntArray
from geomsrv.broad_phase import AABB_ROUNDING
from geomsrv.ladder import Quality, climb
from geomsrv.narrow_phase import count_rungs
from geomsrv.queries import CULL_COUNTS, CULL_STAGES, RUNGS, SEEING, TIERS
from geomsrv.shapes import (
    CURVED,
    Box,
    Capsule,
    Cone,
    Convex,
    Cylinder,
    Ellipsoid,
    Frustum,
    HalfSpace,
    Polygon,
    Sphere,
    pack,
)
from geomsrv.world import ROUNDOFF, AnyShape, World, own_numbers, supported_kinds

__all__ = ["Sight", "Visibility", "boxed_kinds", "seen", "sight"]

Numbers = NDArray[Any]  #: float64, or fractions

# A plane's normal takes 11 u (9 for the dual basis, see frustum_box.cpp, 2 for a difference of two of its rows)
# of the rows' lengths, which together are sqrt(2) of its own: 16 u.  Normalising it takes 4 u, and a position
# along it 5 u, for a difference, products and sums; offsets take less.  That makes 25 u of sums of three
# coordinates, which are less than sqrt(3) times each of the sizes added up below: 44 u.  A support takes as much
# of its reach.  Rounded up.
DEPTH_ROUNDING = 64.0 * ROUNDOFF


class Visibility(IntEnum):
    """What a frustum sees of an object; the first three are those of `CullState`."""

    OUTSIDE = 0  #: no common point
    INTERSECTS = 1  #: a common point, and a point of the object outside the frustum
    INSIDE = 2  #: every point of the object is in the frustum
    MAY_INTERSECT = 3  #: not inside; its bounding box meets the frustum, and no kernel tells more


class Sight(NamedTuple):
    """Outcome for the listed objects."""

    state: ByteArray  #: `Visibility`
    certain: BoolArray  #: the same whatever the rounding, and wherever the object is within its uncertainty
    boxed: list[str]  #: kinds that could only be judged by their bounding box


_CONVEX = _core.shape_kinds().index(Convex.kind)  # what a frustum is for the kernels


def sight(world: World, rows: IntArray, frustum: Frustum, tier: str, counts: Counter[str]) -> Sight:
    """What the frustum sees of the listed objects."""
    state, certain = _by_box(world, rows, frustum, tier, counts)
    counts["boxes"] += len(rows)
    unbounded = world.table.unbounded[world.shape[rows]]
    exact = world.table.boxes[world.shape[rows]] & (world.uncertainty[rows] == 0.0)
    outcome = state.astype(np.uint8)
    # A bounding box that is outside or inside speaks for what it holds; one that is cut says nothing yet.
    cut = np.flatnonzero((((state == CullState.INTERSECTS) | ~certain) & ~exact & (tier != "bound")) | unbounded)
    boxed: set[str] = set()
    if len(cut):
        counts["shapes"] += len(cut)
        outcome[cut], certain[cut], boxed = _by_shape(world, rows[cut], frustum, tier, counts)
    return Sight(outcome, certain, sorted(boxed))


def seen(world: World, rows: IntArray, frustum: Frustum, quality: Quality, counts: Counter[str]) -> tuple[Sight, str]:
    """The same at the tier asked for, or at the cheapest that will do, and the highest of them."""
    if not quality.climbs:
        return sight(world, rows, frustum, quality.accuracy, counts), quality.accuracy
    rungs = quality.rungs(TIERS, SEEING)

    def solve(chosen: IntArray, tier: str) -> tuple[Sight, IntArray]:
        return sight(world, chosen, frustum, tier, counts), chosen

    found = climb(rows, rungs, solve, lambda sights, _: sights.certain, quality, tried=())
    boxed = sorted({kind for sights in found.answers for kind in sights.boxed})
    return Sight(found.column("state"), found.column("certain"), boxed), found.count_tiers(counts)


def _by_box(
    world: World, rows: IntArray, frustum: Frustum, tier: str, counts: Counter[str]
) -> tuple[ByteArray, BoolArray]:
    """State of an oriented box around every object: boxes as they are, all others rounded up."""
    table, shape = world.table, world.shape[rows]
    turn = world.rotations_of(rows)
    position = world.poses[rows, :3]
    half = table.half[shape] + table.round[shape][:, None]
    exact = table.boxes[shape]
    scale = np.abs(position).max(axis=1, initial=0.0) + table.reach[shape]
    margin = np.where(exact | np.isinf(scale), 0.0, AABB_ROUNDING * scale) + world.uncertainty[rows]
    center = position + np.einsum("nij,nj->ni", turn, table.center[shape])
    axes = np.ascontiguousarray(np.swapaxes(turn, 1, 2))
    state, certain, stages, *_ = _core.cull(frustum.packed(), center, axes, half + margin[:, None], tier, False)
    counts.update({name: n for name, n in zip(CULL_STAGES, stages, strict=True) if name in CULL_COUNTS[tier]})
    return state, certain


def boxed_kinds(world: World) -> list[str]:
    """Kinds in the world that only their bounding box speaks for."""
    shapes = [_as_solid(shape) for shape in world.table.shapes]
    answered = supported_kinds()[_CONVEX, pack(shapes).kinds]
    return sorted({shape.kind for shape, known in zip(shapes, answered.tolist(), strict=True) if not known})


def _by_shape(
    world: World, rows: IntArray, frustum: Frustum, tier: str, counts: Counter[str]
) -> tuple[ByteArray, BoolArray, set[str]]:
    """State of objects whose bounding box is cut by the frustum's surface."""
    depth, surely = _depths_inside(world, rows, frustum)
    slack = world.uncertainty[rows]
    inside = depth >= 0.0
    close = np.flatnonzero((np.abs(depth) <= surely) & (tier == "exact"))
    if len(close):
        counts["exact"] += len(close)
        inside[close] = _exactly_inside(world, rows[close], frustum)
    state = np.where(inside, Visibility.INSIDE, Visibility.MAY_INTERSECT).astype(np.uint8)
    certain = np.abs(depth) > surely + slack
    certain[close] = slack[close] == 0.0
    open_rows = np.flatnonzero(~inside)
    shapes = [_as_solid(world.table.shapes[k]) for k in world.shape[rows[open_rows]].tolist()]
    answered = supported_kinds()[_CONVEX, pack(shapes).kinds]
    boxed = {shape.kind for shape, known in zip(shapes, answered.tolist(), strict=True) if not known}
    certain[open_rows[~answered]] = False
    known = open_rows[answered]
    if len(known):
        solids = [shape for shape, one in zip(shapes, answered.tolist(), strict=True) if one]
        vague = slack[known]
        curved = np.array([isinstance(shape, CURVED) for shape in solids], dtype=bool)
        deep = bool(vague.any() or curved.any())
        gaps = _gaps(frustum, solids, world.poses[rows[known]], tier, deep, counts)
        rounding = gaps.rounding + vague
        apart = gaps.lower > rounding
        flat = np.array([not isinstance(shape, Sphere | Capsule | HalfSpace) for shape in solids], dtype=bool)
        # Correctly rounded: the upper neighbour of a distance, however short, is no zero.
        decided = flat & ~curved & (vague == 0.0) & (tier == "exact") & (gaps.status == DistanceStatus.OK)
        meets = np.where(decided, gaps.upper <= 0.0, gaps.distance <= 0.0)
        if tier == "bound":
            meets = ~apart
        # A common point for sure, and a point outside for sure.
        certain[known] = apart | ((decided | (gaps.upper <= -rounding)) & certain[known]) | (decided & ~meets)
        doubtful = (gaps.status != DistanceStatus.OK) & ~apart & (gaps.distance > 0.0)
        outcome = np.where(meets, Visibility.INTERSECTS, Visibility.OUTSIDE)
        state[known] = np.where(doubtful, Visibility.MAY_INTERSECT, outcome)
        certain[known] &= ~doubtful
    return state, certain, boxed


class _Gaps(NamedTuple):
    """Distances (n,) of bodies from a frustum."""

    distance: FloatArray
    lower: FloatArray
    upper: FloatArray
    status: ByteArray
    rounding: FloatArray  #: of how they were placed


def _gaps(
    frustum: Frustum, shapes: Sequence[AnyShape], poses: FloatArray, tier: str, deep: bool, counts: Counter[str]
) -> _Gaps:
    """Signed distances of shapes from the frustum; at tier "exact" signed only if `deep`."""
    pairs = np.column_stack([np.zeros(len(shapes), np.int64), 1 + np.arange(len(shapes))])
    if tier == "exact":
        # Literally: the frustum by its own numbers, in the frame in which the poses are given.
        bodies = [frustum, *shapes]
        answer = _core.distance_pairs(*pack(bodies), pairs, poses, deep, tier, frusta=own_numbers(bodies))
        rounding = np.zeros(len(shapes))
    else:
        # The frustum as the hull of its corners, relative to its own origin.
        corners = frustum.corners(frustum.origin)
        poses = poses.copy()
        poses[:, :3] -= frustum.origin
        answer = _core.distance_pairs(*pack([Convex(corners), *shapes]), pairs, poses, True, tier)
        scale = np.abs(frustum.origin).max() + np.abs(corners).max() + np.abs(poses[:, :3]).max(axis=1)
        rounding = AABB_ROUNDING * scale
    distance, lower, upper, _, _, _, status, rung, _ = answer
    count_rungs(tier, np.bincount(rung, minlength=len(RUNGS)).tolist(), counts)
    return _Gaps(distance, lower, upper, status, rounding)


def _as_solid(shape: AnyShape) -> AnyShape:
    """A polygon as the flat hull it is in space; anything else as it is."""
    if isinstance(shape, Polygon):
        return Convex(np.column_stack([shape.vertices, np.zeros(len(shape.vertices))]))
    return shape


def _planes(frustum: Frustum) -> tuple[FloatArray, FloatArray]:
    """(6, 3) unit outward normals n and (6,) offsets d: the frustum is where n . (x - origin) <= d for all six."""
    l0, l1, u0, u1 = frustum.bounds
    # q = x L + y U + z D for axes that need not be quite perpendicular: x = left . q, and so on.
    left, up, view = _dual(frustum.axes)
    # x <= l1 z / near reads near left . q <= l1 view . q, and so on.
    normals = np.stack(
        [
            -view,
            view,
            frustum.near * left - l1 * view,
            l0 * view - frustum.near * left,
            frustum.near * up - u1 * view,
            u0 * view - frustum.near * up,
        ]
    )
    length = np.linalg.norm(normals, axis=1)
    return normals / length[:, None], np.array([-frustum.near, frustum.far, 0.0, 0.0, 0.0, 0.0]) / length


def _dual(axes: Numbers) -> Numbers:
    """(3, 3) rows that give the coordinates of a vector along three axes."""
    a, b, c = axes
    rows = np.stack([_cross(b, c), _cross(c, a), _cross(a, b)])
    dual: Numbers = rows / (a[0] * rows[0, 0] + a[1] * rows[0, 1] + a[2] * rows[0, 2])
    return dual


def _cross(a: Numbers, b: Numbers) -> Numbers:
    """Cross product, written out so that it works on fractions, too."""
    (ax, ay, az), (bx, by, bz) = a, b
    return np.array([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx])


def _depths_inside(world: World, rows: IntArray, frustum: Frustum) -> tuple[FloatArray, FloatArray]:
    """How far every object could grow and still be in the frustum (negative: it sticks out), and the rounding in it."""
    normals, offsets = _planes(frustum)
    position = world.poses[rows, :3] - frustum.origin
    local = np.einsum("pi,kij->kpj", normals, world.rotations[rows])
    shapes = [world.table.shapes[k] for k in world.shape[rows].tolist()]
    # A support is the farthest extent along a normal; a shape is behind a plane if its support is.
    support = np.array([_supports(shape, along) for shape, along in zip(shapes, local, strict=True)]).reshape(-1, 6)
    depth = (offsets - position @ normals.T - support).min(axis=1)
    reach = world.table.reach[world.shape[rows]]
    scale = np.abs(frustum.origin).max() + np.abs(position).max(axis=1) + frustum.far
    return depth, DEPTH_ROUNDING * (scale + np.where(np.isfinite(reach), reach, 0.0))


def _exactly_inside(world: World, rows: IntArray, frustum: Frustum) -> BoolArray:
    """Whether exact arithmetic puts each object in the frustum, all numbers taken literally."""
    l0, l1, u0, u1 = map(Fraction, frustum.bounds)
    near, far, origin = Fraction(frustum.near), Fraction(frustum.far), _fractions(frustum.origin)
    left, up, view = _dual(_fractions(frustum.axes))
    # As in `_planes`, but of any length.
    planes = [
        (-view, -near),
        (view, far),
        (near * left - l1 * view, Fraction(0)),
        (l0 * view - near * left, Fraction(0)),
        (near * up - u1 * view, Fraction(0)),
        (u0 * view - near * up, Fraction(0)),
    ]

    def holds(row: int) -> bool:
        shape = world.table.shapes[world.shape[row]]
        rotation, position = _fractions(world.rotations[row]), _fractions(world.poses[row, :3]) - origin
        for normal, offset in planes:
            room = offset - normal @ position
            for along, square in _exact_supports(shape, normal @ rotation, normal @ normal):
                left_over = room - along
                if left_over < 0 or square > left_over * left_over:
                    return False
        return True

    return np.array([holds(row) for row in rows.tolist()], dtype=bool)


def _fractions(array: FloatArray) -> Numbers:
    """The same numbers as fractions, which numpy adds and multiplies without rounding."""
    return np.array([Fraction(x) for x in array.ravel().tolist()], dtype=object).reshape(array.shape)


def _exact_supports(shape: AnyShape, m: Numbers, square: Fraction) -> list[tuple[Any, Any]]:
    """Numbers x, y: the largest extent along a normal is the largest x + sqrt(y).

    The normal, of any length, is m in the shape's frame; `square` is that of its length in the fixed frame.  Spheres
    stay round at any pose; whatever else a rotation matrix, taken literally, does to a shape, it does.
    """
    none = Fraction(0)
    if isinstance(shape, Sphere):
        return [(none, Fraction(shape.radius) ** 2 * square)]
    if isinstance(shape, Ellipsoid):
        stretched = m * _fractions(shape.radii)
        return [(none, stretched @ stretched)]
    if isinstance(shape, Box):
        return [(np.abs(m) @ _fractions(shape.half_extents), none)]
    if isinstance(shape, Capsule | Cylinder | Cone):
        top, radius = m[2] * Fraction(shape.length / 2.0), Fraction(shape.radius)
        if isinstance(shape, Capsule):
            return [(abs(top), radius**2 * square)]
        rim = radius**2 * (m[0] * m[0] + m[1] * m[1])
        return [(top, none), (-top, rim)] if isinstance(shape, Cone) else [(abs(top), rim)]
    if isinstance(shape, Frustum):
        own, reach = _fractions(shape.axes), Fraction(shape.far) / Fraction(shape.near)
        l0, l1, u0, u1 = map(Fraction, shape.bounds)
        rays = [x * own[0] + y * own[1] + Fraction(shape.near) * own[2] for x in (l0, l1) for y in (u0, u1)]
        points = [_fractions(shape.origin) + k * ray for ray in rays for k in (1, reach)]
    else:
        points = list(_fractions(_as_solid(shape).vertices))  # type: ignore[union-attr]
    return [(m @ point, none) for point in points]


def _supports(shape: AnyShape, directions: FloatArray) -> FloatArray:
    """(m,) largest extent of a shape along unit directions (m, 3) of its own frame."""
    size = np.abs(directions)
    across = np.hypot(directions[:, 0], directions[:, 1])
    if isinstance(shape, Sphere):
        return np.full(len(directions), shape.radius)
    if isinstance(shape, Capsule):
        return shape.radius + size[:, 2] * (shape.length / 2.0)
    if isinstance(shape, Cylinder):
        return shape.radius * across + size[:, 2] * (shape.length / 2.0)
    if isinstance(shape, Cone):
        half = directions[:, 2] * (shape.length / 2.0)
        return np.maximum(half, shape.radius * across - half)
    if isinstance(shape, Box):
        return size @ shape.half_extents
    if isinstance(shape, Ellipsoid):
        return np.linalg.norm(directions * shape.radii, axis=1)
    if isinstance(shape, HalfSpace):
        return np.full(len(directions), np.inf)
    solid = _as_solid(shape)
    points = solid.corners() if isinstance(solid, Frustum) else solid.vertices  # type: ignore[attr-defined]
    return (directions @ points.T).max(axis=1)
