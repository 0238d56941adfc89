# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""One version of a scene as arrays, a row per object.  Immutable; queries read it and nothing else.

`ShapeTable` holds what stays when things move and is made once for a set of shapes; `World` adds where they
are.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import Any, NamedTuple

import numpy as np

from geomsrv import _core, _validate
from geomsrv.answers import BoolArray, ByteArray, FloatArray, IntArray, end_to_end, gather
from geomsrv.shapes import (
    Box,
    Capsule,
    Cone,
    Cylinder,
    Ellipsoid,
    Frustum,
    HalfSpace,
    PackedShapes,
    Polygon,
    Shape,
    Sphere,
    pack,
)

__all__ = ["ROUNDOFF", "UNDERFLOW", "ShapeRow", "ShapeTable", "World", "own_numbers", "supported_kinds"]

AnyShape = Shape | Frustum

ROUNDOFF = 2.0**-53  #: largest relative error of one float64 operation

HISTORY = 8  #: versions of which a world knows what was moved

# A product below 2^-1022 is rounded to a multiple of 2^-1074, by half a unit; sums are exact down there.  The
# few products that place an object lose less than this.
UNDERFLOW = 2.0**-1070


class ShapeRow(NamedTuple):
    """What a table says of one shape."""

    kind: int  #: code the engine knows it by
    params: FloatArray  #: (4,)
    hull: FloatArray  #: (k, 3) vertices the engine sees
    ring: FloatArray  #: (k, 2) vertices of a polygon
    bounds: tuple[float, ...]  #: (8,) center, half extents, rounding radius, reach

    @classmethod
    def of(cls, shape: AnyShape) -> ShapeRow:
        """The row of a shape."""
        packed = pack([shape])
        ring = shape.vertices if isinstance(shape, Polygon) else np.zeros((0, 2))
        return cls(int(packed.kinds[0]), packed.params[0], packed.vertices, ring, _bounds(shape))


@dataclass(frozen=True, eq=False)
class ShapeTable:
    """Distinct shapes, a row each; n objects may share one.

    Attributes
    ----------
    shapes : tuple of Shape
    rows : tuple of ShapeRow
        What the arrays below were made of.
    packed : PackedShapes
        As the engine reads them.
    frusta : (m, 18) float64 or None
        View frusta by their own numbers, and 0 for every other shape; None if there is none.
    kind_names, kind : tuple of str, (m,) int64
        Kinds that occur, sorted, and which of them each shape is.
    planar, unbounded, boxes : (m,) bool
        Polygons; half spaces; boxes.
    center, half, round : (m, 3), (m, 3), (m,) float64
        The shape lies in the box center +- half, grown by `round` on all sides, in its own frame; 0 for half
        spaces.
    reach : (m,) float64
        Distance of the shape's farthest point from its origin; inf for half spaces.
    ring_vertices, ring_offsets : (k, 2) float64, (m + 1,) int64
        Vertices of the polygons; no rows for solids.
    """

    shapes: tuple[AnyShape, ...]
    rows: tuple[ShapeRow, ...]
    packed: PackedShapes
    frusta: FloatArray | None
    kind_names: tuple[str, ...]
    kind: IntArray
    planar: BoolArray
    unbounded: BoolArray
    boxes: BoolArray
    center: FloatArray
    half: FloatArray
    round: FloatArray
    reach: FloatArray
    ring_vertices: FloatArray
    ring_offsets: IntArray

    @classmethod
    def of(cls, shapes: Iterable[AnyShape], known: ShapeTable | None = None) -> ShapeTable:
        """Table of the given shapes, in this order; those of a `known` table are not looked at again."""
        listed = tuple(shapes)
        old = {id(shape): row for shape, row in zip(known.shapes, known.rows, strict=True)} if known else {}
        rows = tuple(old.get(id(shape)) or ShapeRow.of(shape) for shape in listed)
        bounds = np.array([row.bounds for row in rows], dtype=np.float64).reshape(len(rows), 8)
        names = sorted({shape.kind for shape in listed})
        codes = {name: code for code, name in enumerate(names)}
        kind = np.array([codes[shape.kind] for shape in listed], dtype=np.int64)
        hulls, hull_offsets = end_to_end([row.hull for row in rows], 3)
        rings, ring_offsets = end_to_end([row.ring for row in rows], 2)
        return cls(
            shapes=listed,
            rows=rows,
            packed=PackedShapes(
                np.array([row.kind for row in rows], dtype=np.uint8),
                np.array([row.params for row in rows], dtype=np.float64).reshape(len(rows), 4),
                hulls,
                hull_offsets,
            ),
            frusta=own_numbers(listed),
            kind_names=tuple(names),
            kind=kind,
            planar=kind == codes.get(Polygon.kind, -1),
            unbounded=kind == codes.get(HalfSpace.kind, -1),
            boxes=kind == codes.get(Box.kind, -1),
            center=np.ascontiguousarray(bounds[:, 0:3]),
            half=np.ascontiguousarray(bounds[:, 3:6]),
            round=np.ascontiguousarray(bounds[:, 6]),
            reach=np.ascontiguousarray(bounds[:, 7]),
            ring_vertices=rings,
            ring_offsets=ring_offsets,
        )


def own_numbers(shapes: Sequence[AnyShape]) -> FloatArray | None:
    """(m, 18) view frusta, of which a packed table has the rounded corners, and 0 for others; None if there is none."""
    if not any(isinstance(shape, Frustum) for shape in shapes):
        return None
    return np.array([shape.packed() if isinstance(shape, Frustum) else np.zeros(18) for shape in shapes])


def _bounds(shape: AnyShape) -> tuple[float, ...]:
    """Center, half extents, rounding radius, reach of a shape in its own frame.

    The last bit of `half` and `reach` may be lost; whoever places the shape adds a bound for all rounding.
    """
    half: Sequence[float] = (0.0, 0.0, 0.0)
    grown = 0.0
    if isinstance(shape, Sphere):
        grown = reach = shape.radius
    elif isinstance(shape, Capsule):
        half, grown = (0.0, 0.0, shape.length / 2.0), shape.radius
        reach = shape.length / 2.0 + shape.radius
    elif isinstance(shape, Cylinder | Cone):
        half = (shape.radius, shape.radius, shape.length / 2.0)
        reach = float(np.hypot(shape.radius, shape.length / 2.0))
    elif isinstance(shape, Box):
        half = shape.half_extents.tolist()
        reach = float(np.linalg.norm(shape.half_extents))
    elif isinstance(shape, Ellipsoid):
        half, reach = shape.radii.tolist(), float(shape.radii.max())
    elif isinstance(shape, HalfSpace):
        reach = np.inf
    else:
        points = shape.corners() if isinstance(shape, Frustum) else shape.vertices  # type: ignore[attr-defined]
        if len(points) == 0:  # a mesh without vertices: nothing to meet
            return (0.0,) * 8
        if isinstance(shape, Polygon):
            points = np.column_stack([points, np.zeros(len(points))])
        low, high = points.min(axis=0), points.max(axis=0)
        center = 0.5 * low + 0.5 * high
        extent = np.maximum(high - center, center - low)
        return (*center, *extent, 0.0, float(np.linalg.norm(points, axis=1).max()))
    return (0.0, 0.0, 0.0, *half, grown, reach)


@lru_cache(maxsize=1)
def supported_kinds() -> BoolArray:
    """(k, k) bool: kinds, by their code in a packed table, whose distance the engine answers."""
    return _core.supported_pairs()


def _with(values: FloatArray, rows: IntArray, new: FloatArray | float) -> FloatArray:
    """A copy with other rows, unless these are the same: queries under way keep what they have."""
    if isinstance(new, np.ndarray) and np.array_equal(values[rows].view(np.int64), new.view(np.int64)):
        return values
    out = values.copy()
    out[rows] = new
    return out


@dataclass(frozen=True, eq=False)
class World:
    """Objects in the order of their ids, all in the fixed frame.

    Attributes
    ----------
    ids : tuple of str
        Sorted, so that rows sorted by index are sorted by id, in whatever order the objects came.
    index : mapping of str to int
        Row of each id.
    table : ShapeTable
    shape : (n,) int64
        Row of the table of each object.
    uncertainty, velocity_uncertainty : (n,) float64
        [m], [m/s]
    motion_faults : mapping of int to str
        Rows of the objects whose twist does not tell how they move, and why.
    poses, twists : (n, 7), (n, 6) float64
    allowed : (p,) int64
        Sorted keys ``i * n + j``, i < j, of the present pairs that are ignored.
    version : int
    stamp : object
    history : tuple of (int, (k,) int64)
        The latest versions that `moved` made, and the rows that it was given for each.
    """

    ids: tuple[str, ...]
    index: Mapping[str, int]
    table: ShapeTable
    shape: IntArray
    uncertainty: FloatArray
    velocity_uncertainty: FloatArray
    motion_faults: Mapping[int, str]
    poses: FloatArray
    twists: FloatArray
    allowed: IntArray
    version: int
    stamp: Any
    history: tuple[tuple[int, IntArray], ...] = ()

    @classmethod
    def empty(cls) -> World:
        """Nothing yet."""
        rows = np.zeros(0, np.int64)
        nothing = np.zeros(0)
        poses, twists = np.zeros((0, 7)), np.zeros((0, 6))
        return cls((), {}, ShapeTable.of(()), rows, nothing, nothing, {}, poses, twists, rows, 0, None)

    def moved(self, rows: IntArray, poses: FloatArray, twists: FloatArray | None, version: int, stamp: Any) -> World:
        """The same objects, the listed ones in other states; without `twists` they go on as before."""
        history = (*self.history[1 - HISTORY :], (version, rows))
        world = replace(self, poses=_with(self.poses, rows, poses), version=version, stamp=stamp, history=history)
        if twists is not None:
            # What was said about how far the old velocities can be trusted is no longer true.
            world = replace(
                world,
                twists=_with(self.twists, rows, twists),
                velocity_uncertainty=_with(self.velocity_uncertainty, rows, 0.0),
                motion_faults={row: fault for row, fault in self.motion_faults.items() if row not in rows}
                if self.motion_faults
                else self.motion_faults,
            )
        # What follows from the objects alone, or from velocities that are the same, has been found out already.
        known = ["kinds", "planar", "families", "polyhedra"]
        if world.twists is self.twists and world.motion_faults is self.motion_faults:
            known += ["moves", "turns"]
        world.__dict__.update({name: self.__dict__[name] for name in known if name in self.__dict__})
        return world

    def seen_again(self, version: int, stamp: Any) -> World:
        """The same at another time."""
        world = object.__new__(World)
        history = (*self.history[1 - HISTORY :], (version, np.zeros(0, np.int64)))
        world.__dict__.update(self.__dict__, version=version, stamp=stamp, history=history)
        return world

    def changed_since(self, old: World) -> BoolArray | None:
        """(n,) bool: objects whose state differs; None if they are not the same objects, or pairs."""
        for name in ("ids", "table", "shape", "allowed", "uncertainty"):
            if getattr(self, name) is not getattr(old, name):
                return None
        changed = np.zeros(len(self), dtype=bool)
        since = [rows for version, rows in self.history if version > old.version]
        known = len(since) == self.version - old.version and sum(map(len, since)) < len(self)
        rows: Any = np.concatenate([np.zeros(0, np.int64), *since]) if known else slice(None)
        for name in ("poses", "twists", "velocity_uncertainty"):
            mine, theirs = getattr(self, name), getattr(old, name)
            if mine is not theirs:
                differs = mine[rows].view(np.int64) != theirs[rows].view(np.int64)  # 0 and -0 differ in what follows
                changed[rows] |= differs if differs.ndim == 1 else differs.any(axis=1)
        if self.motion_faults is not old.motion_faults:
            both = self.motion_faults.keys() | old.motion_faults.keys()
            changed[[row for row in both if self.motion_faults.get(row) != old.motion_faults.get(row)]] = True
        return changed

    def __len__(self) -> int:
        return len(self.ids)

    @cached_property
    def rotations(self) -> FloatArray:
        """(n, 3, 3) float64, v_fixed = R v_body: computed once and from then on taken literally."""
        return _validate.rotation_matrices(self.poses[:, 3:])

    def rotations_of(self, rows: IntArray) -> FloatArray:
        """(k, 3, 3) those of the listed objects; of a few of many they are computed alone, to the same bits."""
        if "rotations" in self.__dict__ or 4 * len(rows) > len(self):
            return self.rotations[rows]
        return _validate.rotation_matrices(self.poses[rows, 3:])

    @cached_property
    def kinds(self) -> ByteArray:
        """(n,) uint8: code of each object's kind."""
        return self.table.packed.kinds[self.shape]

    @cached_property
    def planar(self) -> BoolArray:
        """(n,) bool: polygons in the plane z = 0."""
        return self.table.planar[self.shape]

    @cached_property
    def families(self) -> tuple[IntArray, IntArray]:
        """Rows of the solids and rows of the polygons: only members of one family are compared."""
        return np.flatnonzero(~self.planar), np.flatnonzero(self.planar)

    @cached_property
    def polyhedra(self) -> BoolArray:
        """(n,) bool: boxes, and hulls whose vertices are given; a frustum is a hull, too, but of rounded corners."""
        box, hull = map(_core.shape_kinds().index, ("box", "convex"))
        given = self.table.packed.params[self.shape, 0] == 0.0
        found: BoolArray = (self.kinds == box) | ((self.kinds == hull) & given)
        return found

    @cached_property
    def moves(self) -> BoolArray:
        """(n,) bool: has a linear velocity."""
        return self.twists[:, :3].any(axis=1)

    @cached_property
    def turns(self) -> BoolArray:
        """(n,) bool: does not translate: has an angular velocity, or moves in a way that is not known."""
        turns = self.twists[:, 3:].any(axis=1)
        turns[list(self.motion_faults)] = True
        return turns

    @cached_property
    def rings(self) -> tuple[FloatArray, IntArray]:
        """Vertices (k, 2) and offsets (n + 1,) of all polygons in the plane; solids have none.

        A polygon is placed once: these numbers, rounded, are from then on taken literally.
        """
        vertices, offsets = gather(self.table.ring_vertices, self.table.ring_offsets, self.shape)
        owner = np.repeat(np.arange(len(self)), np.diff(offsets))
        place, turn = self.poses[owner, :2], self.poses[owner, 5]
        if not turn.any():
            return vertices + place, offsets
        # What `rotations` has for a turn about z, to the last bit.
        cosine, sine = 1 - 2 * (turn * turn), 2 * (turn * self.poses[owner, 6])
        x, y = vertices.T
        return np.column_stack([cosine * x - sine * y, sine * x + cosine * y]) + place, offsets

    def kind_counts(self, rows: IntArray) -> dict[str, int]:
        """How many of the given objects there are of each kind, by name."""
        counts = np.bincount(self.table.kind[self.shape[rows]], minlength=len(self.table.kind_names))
        return {name: int(k) for name, k in zip(self.table.kind_names, counts, strict=True) if k}

    def pair_kinds(self, pairs: IntArray) -> tuple[list[str], IntArray]:
        """Names of the kind pairs that occur, such as "box-sphere", and which of them each pair is."""
        names = self.table.kind_names
        kinds = self.table.kind[self.shape[pairs]]
        codes = np.minimum(kinds[:, 0], kinds[:, 1]) * len(names) + np.maximum(kinds[:, 0], kinds[:, 1])
        # There are few kinds, so counting all their pairs beats sorting the codes.
        occurs = np.bincount(codes, minlength=1) > 0
        present = np.flatnonzero(occurs)
        which = (np.cumsum(occurs) - 1)[codes]
        return [f"{names[code // len(names)]}-{names[code % len(names)]}" for code in present.tolist()], which
