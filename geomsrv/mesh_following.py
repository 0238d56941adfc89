# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""First contact of listed pairs of objects of which one is a mesh that turns, is uncertain, or has a margin.

The mesh is the union of its triangles, and each of them is followed as a hull of three points.  Boxes around halves of
halves of the triangles turn with the mesh and are followed, too: what meets later than a proven contact is not looked
into.  Whatever a pair may be off by counts for every box and triangle, so the least of their bounds are those of the
whole: apart until the least `lower`, in contact by the least `upper`.  What they share then is asked of all pieces that
touch by then.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from geomsrv import _core
from geomsrv.advancement import advance, nearest_at
from geomsrv.answers import BoolArray, ByteArray, ContactStatus, FloatArray, IntArray
from geomsrv.mesh import NODE_ROUNDING, SMALLEST, TURNING_BATCH
from geomsrv.mesh_shared import (
    MOST_SHARED,
    OFF_ROUNDING,
    SAME_PLACE,
    TURNED_ROUNDING,
    Bodies,
    Contact,
    Moving,
    near_pieces,
    shared_parts,
    united,
)
from geomsrv.mesh_tree import Tree, in_order
from geomsrv.narrow_phase import RELATIVE_POSE_ROUNDING, placed
from geomsrv.shapes import Mesh, PackedShapes
from geomsrv.world import ShapeTable, World

# Pieces that meet earlier than others by no more than this share of the tolerance need not be told from them.
SAME_TIME = 0.25

# Pairs of pieces that are followed for the sake of the latest possible contact, where that is far from the earliest.
MOST_PIECES = 256

# Pairs of pieces that are looked at where some touch at the start, to see whether others overlap.
MOST_TOUCHING = 8192

# Nearest points in one plane: each is off by what is the same, and so is the plane.
FLAT = 4.0

__all__ = ["Answer", "follow_meshes", "meshes"]

Answer = tuple[ByteArray, FloatArray, FloatArray, FloatArray, FloatArray]  #: status, lower, upper, normal, point
_Row = tuple[int, float, float, FloatArray, FloatArray]  #: that of one pair

SPHERE, CAPSULE, BOX, CONVEX, HALF_SPACE, *_ = range(len(_core.shape_kinds()))


def meshes(world: World, pairs: IntArray) -> BoolArray:
    """(k,) bool: pairs of which one is a mesh."""
    if Mesh.kind not in world.table.kind_names:
        return np.zeros(len(pairs), np.bool_)
    found: BoolArray = (world.kinds == _core.shape_kinds().index(Mesh.kind))[pairs].any(axis=1)
    return found


def follow_meshes(
    world: World,
    pairs: IntArray,
    horizon: float,
    tolerance: float,
    slack: FloatArray,
    core: Callable[[int], Bodies],
    shift: FloatArray | None,
) -> tuple[ByteArray, FloatArray, FloatArray, FloatArray, NDArray[np.object_]]:
    """Status, lower, upper and normal of pairs, as of the engine's kernel for bodies that turn, and contact sets.

    These are lists of parts; or (1, 3), the point between the nearest points of the cores; or None.

    Parameters
    ----------
    slack : (k, 3) float
        Margin [m] up to which bodies are in contact, uncertainty [m], and drift [m/s]: the answer holds for all bodies
        within.
    core : callable
        The box, hull, or core of a round body in a row of the world, as the engine reads it.
    shift : (k,) float
        Of points of contact from midway between cores [m], along the normal; None where no contact sets are wanted.
    """
    rows = []
    sets = np.empty(len(pairs), dtype=object)
    sides: dict[int, _Side] = {}
    for k, (pair, room) in enumerate(zip(pairs.tolist(), slack, strict=True)):
        for row in pair:
            if row not in sides:
                sides[row] = _Side(world, row, core)
        a, b = (sides[row] for row in pair)
        question = _Question(world, a, b, horizon, tolerance, room[None])
        rows.append(_first(question))
        point = rows[-1][4]
        if not np.isnan(point[0]):
            parts = [] if shift is None else question.shared(rows[-1], float(shift[k]))
            sets[k] = parts or point[None]
    status, lower, upper = (np.array([row[k] for row in rows]) for k in range(3))
    normal = np.array([row[3] for row in rows]).reshape(-1, 3)
    return status.astype(np.uint8), lower, upper, normal, sets


class _Side:
    """An object: its boxes and its pieces, as the engine reads them, one for all where it is no mesh."""

    def __init__(self, world: World, row: int, core: Callable[[int], Bodies]) -> None:
        table, shape = world.table, int(world.shape[row])
        self.row, self.kind = row, int(world.kinds[row])
        self.motion = np.concatenate([world.twists[row], world.poses[row, :3]])[None]
        self.axes = np.ascontiguousarray(world.rotations_of(np.array([row])).swapaxes(1, 2))
        self._placed = partial(_placed, world, row)
        size = float(np.abs(world.poses[row, :3]).sum()) + float(table.reach[shape])
        self._grown = RELATIVE_POSE_ROUNDING * size + SMALLEST
        body = table.shapes[shape]
        self.mesh = body if isinstance(body, Mesh) else None
        if isinstance(body, Mesh):
            self.tree = body.tree
            self.vertices = self._placed(body.vertices)
            return
        self.tree = Tree(np.zeros((2, 3)), np.zeros((2, 3)), np.zeros(1, np.int64))
        self.curved = self.kind > HALF_SPACE
        if self.curved or self.kind == HALF_SPACE:
            half = table.half[shape][None] * (1.0 + NODE_ROUNDING) + self._grown
            self._body: Bodies = (world.poses[row, :3][None].copy(), self.axes, half)
        else:
            self._body = core(row)

    def nodes(self, rows: IntArray) -> Bodies:
        """Boxes that hold what is in nodes of the tree; they turn with it."""
        if self.mesh is None:
            return self._body
        low, high = self.tree.low[rows], self.tree.high[rows]
        center = 0.5 * low + 0.5 * high
        half = np.maximum(high - center, center - low) * (1.0 + NODE_ROUNDING) + self._grown
        axes = np.ascontiguousarray(np.broadcast_to(self.axes, (len(rows), 3, 3)))
        return self._placed(center), axes, half

    def pieces(self, rows: IntArray) -> Bodies:
        """Triangles, in the fixed frame."""
        if self.mesh is None:
            return self._body
        corners = self.vertices[self.mesh.triangles[rows]].reshape(-1, 3)
        return corners, np.arange(0, len(corners) + 1, 3)

    def corners(self, rows: IntArray) -> FloatArray:
        """(k, 3, 3) of triangles of a mesh, in its own frame."""
        assert self.mesh is not None
        return self.mesh.vertices[self.mesh.triangles[rows]]


def _placed(world: World, row: int, points: FloatArray) -> FloatArray:
    return placed(world, np.full(len(points), row), points)


class _Question(NamedTuple):
    """What is asked about one pair."""

    world: World
    a: _Side
    b: _Side
    end: float  #: of the time window
    tolerance: float
    slack: FloatArray  #: (1, 3)

    def engine(self, body_a: Bodies, body_b: Bodies, end: float) -> Answer:
        """Boxes, or hulls, against such."""
        return self._asked(body_a, body_b, end, self.slack)

    def earliest(self, nodes_a: IntArray, nodes_b: IntArray, end: float) -> FloatArray:
        """(k,) until when boxes are surely apart; inf if to the end."""
        # Nobody asks when these are surely in contact: it is as well to take what they may be off by for a margin.
        margin, doubt, drift = self.slack[0]
        near = np.array([[np.nextafter(margin + doubt, np.inf), 0.0, drift]])
        status, lower, *_ = self._asked(self.a.nodes(nodes_a), self.b.nodes(nodes_b), end, near)
        return np.where(status == ContactStatus.NEVER, np.inf, np.fmax(lower, 0.0))

    def _asked(self, body_a: Bodies, body_b: Bodies, end: float, slack: FloatArray) -> Answer:
        found: Any = _core.first_contact_turning(
            body_a, body_b, self.a.motion, self.b.motion, end, self.tolerance, slack
        )
        return found[:5]  # type: ignore[no-any-return]

    def shared(self, row: _Row, shift: float) -> list[FloatArray]:
        """Contact set, part by part, points of pairs of pieces moved by a shift; empty where a point must do."""
        status, lower, upper, normal, point = row
        contact = Contact(status, lower, upper, normal, self.slack)
        a, b = (Moving(body.tree, body.nodes, body.pieces, body.motion) for body in (self.a, self.b))
        mesh, other = (self.a, self.b) if self.a.mesh is not None else (self.b, self.a)
        if other.mesh is not None or other.kind < HALF_SPACE:
            return shared_parts(a, b, contact, shift)
        if np.isnan(normal[0]):
            return []
        if other.kind == HALF_SPACE:
            first = mesh is self.a
            return _on_plane(mesh, *((a, b) if first else (b, a)), first, row, self.slack)
        return self._on_curved(a, b, mesh, contact)

    def _on_curved(self, a: Moving, b: Moving, mesh: _Side, contact: Contact) -> list[FloatArray]:
        """Where triangles touch a curved body: of those that hang together and touch one plane the nearest point."""
        if contact.status == ContactStatus.OVERLAPPING:
            return []
        root = np.ones(1, np.int64)
        room, _ = contact.same(a, b)
        near = float(contact.slack[0, 0]) + room
        pairs = near_pieces(a, b, contact.lower, near)
        if pairs is None or not len(pairs[0]):
            return []
        moving, pieces = (a, pairs[0]) if mesh is self.a else (b, pairs[1])
        corners = mesh.corners(pieces)
        world, rows = self._hulls(corners)
        look = nearest_at(world, rows, contact.lower)
        places = 0.5 * look.point_a + 0.5 * look.point_b
        met = np.flatnonzero((look.lower <= near) & ~np.isnan(places).any(axis=1))
        met = met[np.argsort(look.lower[met], kind="stable")]
        one, two, three = moving.placed(mesh.pieces(pieces[met])[0], contact.lower).reshape(-1, 3, 3).swapaxes(0, 1)
        across = np.cross(two - one, three - one)
        length = np.linalg.norm(across, axis=1, keepdims=True)
        normals = np.divide(across, length, out=np.zeros_like(across), where=length > 0.0)
        # Beside a contact the gap is less than can be told, as far as a ball curves by no more.
        curve = float(contact.slack[0, 0]) + float(np.max((b if moving is a else a).nodes(root)[2]))
        place = SAME_PLACE * room + 2.0 * math.sqrt(curve * room)
        found: list[FloatArray] = []
        for point in _places(corners[met], places[met], normals, FLAT * room):
            if all(float(np.abs(point - other).max()) > place for other in found):
                found.append(point)
        return found

    def by_distance(self, hulls: FloatArray, end: float) -> Answer:
        """Hulls (k, m, 3) of points of the mesh, in its own frame, against the curved body or half space."""
        world, pairs = self._hulls(hulls)
        return advance(world, pairs, end, self.tolerance, np.repeat(self.slack, len(hulls), axis=0))

    def _hulls(self, hulls: FloatArray) -> tuple[World, IntArray]:
        """A world of them and the other body, and its pairs."""
        mesh_first = self.a.mesh is not None
        mesh, other = (self.a, self.b) if mesh_first else (self.b, self.a)
        count = len(hulls)
        pairs = np.column_stack([np.arange(count), np.full(count, count)])
        return _of_hulls(self.world, mesh.row, hulls, other.row), pairs if mesh_first else pairs[:, ::-1]


def _places(corners: FloatArray, points: FloatArray, normals: FloatArray, flat: float) -> list[FloatArray]:
    """The first point of triangles (k, 3, 3) that hang together: by corners, and by a plane of which both touch."""
    names = np.unique(corners.reshape(-1, 3), axis=0, return_inverse=True)[1].reshape(-1, 3).tolist()
    beside: dict[int, list[int]] = {}
    for k, row in enumerate(names):
        for name in row:
            beside.setdefault(name, []).append(k)
    free = np.ones(len(names), np.bool_)
    found = []
    while free.any():
        group = [int(np.argmax(free))]
        found.append(points[group[0]][None])
        free[group] = False
        for k in group:  # which grows
            near = np.unique(np.concatenate([beside[name] for name in names[k]]))
            near = near[free[near]]
            arms = points[near] - points[k]
            level = (np.abs(arms @ normals[k]) <= flat) | (np.abs((arms * normals[near]).sum(axis=1)) <= flat)
            free[near[level]] = False
            group += near[level].tolist()
    return found


def _on_plane(
    side: _Side, mesh: Moving, plane: Moving, mesh_first: bool, row: _Row, slack: FloatArray
) -> list[FloatArray]:
    """Corners, edges and triangles of a mesh in the plane that they touch, midway between both."""
    status, lower, upper, normal, point = row
    contact = Contact(status, lower, upper, normal, slack)
    assert side.mesh is not None
    if status == ContactStatus.OVERLAPPING:
        return []
    used, triangles = np.unique(side.mesh.triangles, return_inverse=True)
    triangles = triangles.reshape(-1, 3)
    at = mesh.placed(side.vertices[used], lower)
    down = normal if mesh_first else -normal
    velocity, turning, center = plane.motion.reshape(3, 3)
    arms = at - (center + lower * velocity)
    speed = float(np.linalg.norm(mesh.motion[0, :3] - velocity)) + mesh.sweep()
    speed += float(np.linalg.norm(turning)) * float(np.linalg.norm(arms, axis=1).max())
    size = float(max(np.abs(at).max(), np.abs(arms).max()))
    same = speed * contact.span + OFF_ROUNDING * float(slack[0, 1]) + TURNED_ROUNDING * size
    heights = at @ down
    low = heights >= heights.max() - same
    at = at + ((point - at) @ down)[:, None] * down
    count = low[triangles].sum(axis=1)
    faces, bent = triangles[count == 3], triangles[count == 2]
    edges = np.unique(np.sort(bent[low[bent]].reshape(-1, 2), axis=1), axis=0)
    corners = np.setdiff1d(np.flatnonzero(low), np.concatenate([faces.ravel(), edges.ravel()]))
    if len(faces) + len(edges) + len(corners) > MOST_SHARED:
        return []
    return united([at[part] for part in (*faces, *edges, *corners[:, None])], SAME_PLACE * same, size, normal)


def _of_hulls(world: World, row: int, hulls: FloatArray, other: int) -> World:
    """Hulls (k, m, 3) that move like one object, and after them another object that has no vertices."""
    table, count = world.table, len(hulls)
    shape = world.shape[other]
    packed = PackedShapes(
        np.append(np.full(count, CONVEX, np.uint8), table.packed.kinds[shape]),
        np.concatenate([np.zeros((count, 4)), table.packed.params[shape][None]]),
        np.ascontiguousarray(hulls.reshape(-1, 3)),
        np.append(np.arange(count + 1), count) * hulls.shape[1],
    )
    reach = np.append(np.linalg.norm(hulls, axis=2).max(axis=1), table.reach[shape])
    rows = np.append(np.full(count, row), other)
    return replace(
        World.empty(),
        table=replace(ShapeTable.of(()), packed=packed, reach=reach),
        shape=np.arange(count + 1),
        poses=world.poses[rows],
        twists=world.twists[rows],
    )


def _first(q: _Question) -> _Row:
    """Answer for one pair."""
    found: list[Answer] = []
    other = q.b if q.a.mesh is not None else q.a
    if other.mesh is None and other.kind == HALF_SPACE:
        # What is not in a half space is convex: the hull of a mesh meets it when the mesh does.
        mesh = q.a.mesh or q.b.mesh
        assert mesh is not None
        found.append(q.by_distance(mesh.vertices[np.unique(mesh.triangles)][None], q.end))
        return _whole(found, q.tolerance, np.inf)
    curved = other.mesh is None and other.curved
    low, high, deep, looked = np.inf, np.inf, False, 0

    def limit() -> float:
        if deep:
            return -np.inf
        latest = min(high - SAME_TIME * q.tolerance, q.end)
        if low == 0.0:  # and perhaps deep, elsewhere
            return max(latest, 0.0) if looked < MOST_PIECES else 0.0 if looked < MOST_TOUCHING else -np.inf
        return latest if looked < MOST_PIECES else min(low - SAME_TIME * q.tolerance, latest)

    def until() -> float:
        # What meets later than a proven contact need not be followed.
        return 0.0 if low == 0.0 and looked >= MOST_PIECES else min(high, q.end)

    def begin(nodes_a: IntArray, nodes_b: IntArray) -> FloatArray:
        if not len(nodes_a):
            return np.zeros(0)
        return q.earliest(nodes_a, nodes_b, until())

    def look(pieces_a: IntArray, pieces_b: IntArray) -> None:
        nonlocal low, high, deep, looked
        if curved:
            mesh, pieces = (q.a, pieces_a) if q.a.mesh is not None else (q.b, pieces_b)
            answer = q.by_distance(mesh.corners(pieces), until())
        else:
            answer = q.engine(q.a.pieces(pieces_a), q.b.pieces(pieces_b), until())
        found.append(answer)
        met = answer[0] != ContactStatus.NEVER
        low = float(np.fmax(answer[1], 0.0)[met].min(initial=low))
        high = float(np.fmin.reduce(answer[2], initial=high))
        deep = deep or bool((answer[0] == ContactStatus.OVERLAPPING).any())
        looked += len(pieces_a)

    left_out = in_order(q.a.tree, q.b.tree, begin, limit, look, TURNING_BATCH)
    return _whole(found, q.tolerance, left_out)


def _whole(found: list[Answer], tolerance: float, left_out: float) -> _Row:
    """What the answers for pairs of pieces say of the whole, others being left out that meet at some time or later.

    Status, normal and point are those of the first.
    """
    nowhere = np.full(3, np.nan)
    if not found:
        return ContactStatus.NEVER, np.nan, np.nan, nowhere, nowhere
    status, lower, upper, normal, point = (np.concatenate(column) for column in zip(*found, strict=True))
    met = status != ContactStatus.NEVER
    if not met.any():
        return ContactStatus.NEVER, np.nan, np.nan, nowhere, nowhere
    now = [s for s in (ContactStatus.OVERLAPPING, ContactStatus.TOUCHING) if (status == s).any()]
    if now:
        met = status == now[0]
    first = int(np.argmin(np.where(met, np.fmax(lower, 0.0), np.inf)))
    low, high = max(min(float(np.fmax(lower[first], 0.0)), left_out), 0.0), float(np.fmin.reduce(upper))
    how = int(status[first])
    vague = how in (ContactStatus.GRAZING, ContactStatus.NOT_CONVERGED)
    if vague and high - low <= tolerance:
        how = ContactStatus.WILL_TOUCH
    return how, low, high, normal[first], point[first]
