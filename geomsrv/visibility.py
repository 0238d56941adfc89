# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""What a view frustum sees of every object of a world: by bounding box, and by the shape itself where that is open."""

from __future__ import annotations

from collections import Counter
from enum import IntEnum
from typing import NamedTuple

import numpy as np

from geomsrv import _core
from geomsrv.answers import BoolArray, ByteArray, CullState, DistanceStatus, FloatArray, IntArray
from geomsrv.broad_phase import AABB_ROUNDING
from geomsrv.shapes import (
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
from geomsrv.world import AnyShape, World, supported_kinds

__all__ = ["Sight", "Visibility", "boxed_kinds", "sight"]


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


def sight(world: World, rows: IntArray, frustum: Frustum, counts: Counter[str]) -> Sight:
    """What the frustum sees of the listed objects."""
    state, certain = _by_box(world, rows, frustum)
    counts["boxes"] += len(rows)
    unbounded = world.table.unbounded[world.shape[rows]]
    exact = world.table.boxes[world.shape[rows]] & (world.uncertainty[rows] == 0.0)
    outcome = state.astype(np.uint8)
    # A bounding box that is outside or inside speaks for what it holds; one that is cut says nothing yet.
    cut = np.flatnonzero(((state == CullState.INTERSECTS) & ~exact) | unbounded)
    boxed: set[str] = set()
    if len(cut):
        counts["shapes"] += len(cut)
        outcome[cut], certain[cut], boxed = _by_shape(world, rows[cut], frustum)
    return Sight(outcome, certain, sorted(boxed))


def _by_box(world: World, rows: IntArray, frustum: Frustum) -> tuple[ByteArray, BoolArray]:
    """State of an oriented box around every object: boxes as they are, all others rounded up."""
    table, shape = world.table, world.shape[rows]
    turn = world.rotations[rows]
    position = world.poses[rows, :3]
    half = table.half[shape] + table.round[shape][:, None]
    exact = table.boxes[shape]
    scale = np.abs(position).max(axis=1, initial=0.0) + table.reach[shape]
    margin = np.where(exact | np.isinf(scale), 0.0, AABB_ROUNDING * scale) + world.uncertainty[rows]
    center = position + np.einsum("nij,nj->ni", turn, table.center[shape])
    axes = np.ascontiguousarray(np.swapaxes(turn, 1, 2))
    state, certain, *_ = _core.cull(frustum.packed(), center, axes, half + margin[:, None], "float64", False)
    return state, certain


def boxed_kinds(world: World) -> list[str]:
    """Kinds in the world that only their bounding box speaks for."""
    shapes = [_as_solid(shape) for shape in world.table.shapes]
    packed = pack([Convex(np.zeros((1, 3))), *shapes])
    answered = supported_kinds()[packed.kinds[0], packed.kinds[1:]]
    return sorted({shape.kind for shape, known in zip(shapes, answered.tolist(), strict=True) if not known})


def _by_shape(world: World, rows: IntArray, frustum: Frustum) -> tuple[ByteArray, BoolArray, set[str]]:
    """State of objects whose bounding box is cut by the frustum's surface."""
    depth, surely = _depths_inside(world, rows, frustum)
    slack = world.uncertainty[rows]
    inside = depth >= 0.0
    state = np.where(inside, Visibility.INSIDE, Visibility.MAY_INTERSECT).astype(np.uint8)
    certain = np.abs(depth) > surely + slack
    open_rows = np.flatnonzero(~inside)
    shapes = [_as_solid(world.table.shapes[k]) for k in world.shape[rows[open_rows]].tolist()]
    # The frustum as the hull of its corners, relative to its own origin.
    corners = frustum.corners(frustum.origin)
    packed = pack([Convex(corners), *shapes])
    answered = supported_kinds()[packed.kinds[0], packed.kinds[1:]]
    boxed = {shape.kind for shape, known in zip(shapes, answered.tolist(), strict=True) if not known}
    certain[open_rows[~answered]] = False
    known = open_rows[answered]
    if len(known):
        pairs = np.column_stack([np.zeros(len(known), np.int64), 1 + np.flatnonzero(answered)])
        poses = world.poses[rows[known]].copy()
        poses[:, :3] -= frustum.origin
        gap, lower, upper, _, _, _, status = _core.distance_pairs(*packed, pairs, poses, True)[:7]
        scale = np.abs(frustum.origin).max() + np.abs(corners).max() + np.abs(poses[:, :3]).max(axis=1)
        rounding = AABB_ROUNDING * scale + slack[known]
        meets = np.where(gap <= 0.0, Visibility.INTERSECTS, Visibility.OUTSIDE)
        apart = lower > rounding
        # A common point for sure, and a point outside for sure.
        certain[known] = apart | ((upper < -rounding) & certain[known])
        doubtful = (status != DistanceStatus.OK) & ~apart & (gap > 0.0)
        state[known] = np.where(doubtful, Visibility.MAY_INTERSECT, meets)
        certain[known] &= ~doubtful
    return state, certain, boxed


def _as_solid(shape: AnyShape) -> AnyShape:
    """A polygon as the flat hull it is in space; anything else as it is."""
    if isinstance(shape, Polygon):
        return Convex(np.column_stack([shape.vertices, np.zeros(len(shape.vertices))]))
    return shape


def _planes(frustum: Frustum) -> tuple[FloatArray, FloatArray]:
    """(6, 3) unit outward normals n and (6,) offsets d: the frustum is where n . (x - origin) <= d for all six."""
    left, up, view = frustum.axes
    l0, l1, u0, u1 = frustum.bounds
    # x L + y U + near D scaled: x <= l1 reads near L . q <= l1 D . q, and so on.
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
    return depth, AABB_ROUNDING * (scale + np.where(np.isfinite(reach), reach, 0.0))


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
