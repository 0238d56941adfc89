# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""Ways to answer queries: the engine's own, the engine on simpler shapes, and motion in fixed steps.

An input is a block of items that a query is asked about; whatever is not the query itself happens in `prepare`.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from decimal import Decimal, localcontext
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from geomsrv import _core, _validate
from geomsrv._price_measure import Call, Found, Way, WayError
from geomsrv.answers import (
    Booleans,
    ContactStatus,
    Cull,
    CullState,
    Distances,
    DistanceStatus,
    FirstContacts,
    gather,
)
from geomsrv.errors import NotAvailableError
from geomsrv.ladder import AUTO
from geomsrv.queries import cull, distance, distance_to_frustum, first_contact, intersects
from geomsrv.scene import PairContacts, PairDistances, Scene, SceneCull, SceneObject, SceneUpdate, Visibility
from geomsrv.shapes import (
    Box,
    Boxes,
    Capsule,
    Cone,
    Convex,
    Cylinder,
    Ellipsoid,
    Frustum,
    Frustum2D,
    Point,
    Polygon,
    Polygons,
    Shape,
    Sphere,
)

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]
Ask = Callable[..., Any]

SIDES = (8, 16, 32, 64, 128, 256, 512)
BUDGETS_NS = (100.0, 1e3, 1e4)
TOLERANCES = (1e-1, 1e-3, 1e-6, 1e-9, 1e-12, 1e-15)

# Families, in the order of the legend.
TIER, TOLERANCE, BUDGET = "geomsrv, by tier", "geomsrv, by tolerance", "geomsrv, by time budget"
APPROXIMATION, FEWER, VOLUME = "curved shape as a hull", "fewer vertices", "bounding volume instead"
STEPS, OTHER = "fixed steps of motion", "another method, float64"


# ------------------------------------------------------------------------------------------------------- inputs


@dataclass(frozen=True)
class Pair:
    """Two shapes at n relative poses; `signed` asks for depth, too."""

    a: Shape
    b: Shape
    poses: FloatArray
    signed: bool

    def ask(self, **how: Any) -> Distances:
        """The query."""
        return distance(self.a, self.b, self.poses, want=("penetration",) if self.signed else ("distance",), **how)


@dataclass(frozen=True)
class Batches:
    """n against n bodies in world coordinates."""

    a: Any
    b: Any
    signed: bool = False

    def ask(self, **how: Any) -> Distances:
        """How far apart they are."""
        return distance(self.a, self.b, want=("penetration",) if self.signed else ("distance",), **how)

    def meet(self, **how: Any) -> Booleans:
        """Whether they meet."""
        return intersects(self.a, self.b, **how)


@dataclass(frozen=True)
class Sight:
    """Boxes before a camera."""

    frustum: Frustum
    boxes: Boxes

    def ask(self, **how: Any) -> Cull:
        """The query."""
        return cull(self.frustum, self.boxes, **how)


@dataclass(frozen=True)
class Points:
    """Points around a frustum."""

    frustum: Frustum | Frustum2D
    points: FloatArray

    def ask(self, **how: Any) -> Distances:
        """The query."""
        return distance_to_frustum(self.frustum, self.points, **how)


@dataclass(frozen=True)
class Motion:
    """n pairs of convex bodies, the first at rest, the second with a constant twist.

    Attributes
    ----------
    a : Polygons or Polytopes
    b : Polygons or Polytopes
        About their own origins, which are at `center` (n, d) at first.
    velocity : (n, d) float
        Of the origin of b [m/s].
    spin : (n, 3) float
        Angular velocity of b [rad/s]; of polygons about z only.
    t_max : float
        [s]
    """

    a: Any
    b: Any
    center: FloatArray
    velocity: FloatArray
    spin: FloatArray
    t_max: float

    def __len__(self) -> int:
        return len(self.center)

    @property
    def planar(self) -> bool:
        """Whether this is about polygons."""
        return isinstance(self.a, Polygons)

    def ask(self, **how: Any) -> FirstContacts:
        """First contact in translation, asked of the engine's batch query."""
        at_start = type(self.b)(*self.placed(np.arange(len(self)), 0.0))
        return first_contact(self.a, at_start, np.zeros_like(self.velocity), self.velocity, t_max=self.t_max, **how)

    def ask_turning(self, **how: Any) -> FirstContacts:
        """The same of bodies that turn."""
        query: Callable[..., FirstContacts] = first_contact
        if "angular_velocity_b" not in inspect.signature(query).parameters:
            raise NotAvailableError("first contact of bodies that turn is not available yet")
        at_start = type(self.b)(*self.placed(np.arange(len(self)), 0.0))
        turning = {"angular_velocity_b": self.spin[:, 2] if self.planar else self.spin, "center_b": self.center}
        return query(
            self.a, at_start, np.zeros_like(self.velocity), self.velocity, t_max=self.t_max, **turning, **how
        )  # fmt: skip

    def placed(self, rows: IntArray, time: FloatArray | float) -> tuple[FloatArray, IntArray]:
        """Vertices of the listed b at the given time, or times, and their offsets."""
        ring, offsets = gather(self.b.vertices, self.b.offsets, rows)
        if self.spin.any():
            turns = rotations(self.spin[rows] * np.reshape(time, (-1, 1)))[:, : ring.shape[1], : ring.shape[1]]
            ring = np.einsum("kij,kj->ki", np.repeat(turns, np.diff(offsets), axis=0), ring)
        at = self.center[rows] + self.velocity[rows] * np.reshape(time, (-1, 1))
        return ring + np.repeat(at, np.diff(offsets), axis=0), offsets

    def gap(self, rows: IntArray, time: FloatArray | float) -> FloatArray:
        """How far apart the listed pairs are at the given time, or times; the engine's, at float64, not validated."""
        first, second = gather(self.a.vertices, self.a.offsets, rows), self.placed(rows, time)
        if self.planar:
            return _core.distance_polygons(*first, *second, False)[0]
        return _core.distance_world(first, second, False)[0]

    def overlap(self, rows: IntArray, time: FloatArray | float) -> BoolArray:
        """Whether the listed pairs meet at the given time, or times."""
        meet: BoolArray = self.gap(rows, time) <= 0.0
        return meet


def rotations(vectors: FloatArray) -> FloatArray:
    """(n, 3, 3): rotations by the length of rotation vectors (n, 3), by Rodrigues' formula."""
    angle = np.linalg.norm(vectors, axis=1)
    x, y, z = np.divide(vectors.T, angle, out=np.zeros_like(vectors.T), where=angle > 0.0)
    s, c = np.sin(angle), 1.0 - np.cos(angle)
    rows = (
        (1.0 - c * (y * y + z * z), c * x * y - s * z, c * x * z + s * y),
        (c * x * y + s * z, 1.0 - c * (x * x + z * z), c * y * z - s * x),
        (c * x * z - s * y, c * y * z + s * x, 1.0 - c * (x * x + y * y)),
    )
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


@dataclass(frozen=True)
class Discs:
    """Discs of radius `radius` (n, 2) that move; the first is at rest at the origin."""

    radius: FloatArray
    center: FloatArray
    velocity: FloatArray
    t_max: float

    def as_polygons(self, sides: int) -> Motion:
        """The same as regular polygons inscribed."""
        angle = 2.0 * np.pi * np.arange(sides) / sides
        ring = np.column_stack([np.cos(angle), np.sin(angle)])
        ends = sides * np.arange(len(self.radius) + 1)
        a, b = (Polygons((r[:, None, None] * ring).reshape(-1, 2), ends) for r in self.radius.T)
        return Motion(a, b, self.center, self.velocity, np.zeros((len(self.radius), 3)), self.t_max)


@dataclass(frozen=True)
class Crowd:
    """A scene of n objects named by number, new poses for all of them, and a camera."""

    shapes: Sequence[Shape]
    poses: FloatArray
    reach: float
    camera: Frustum
    twists: FloatArray | None = None
    horizon: float = 0.0

    @property
    def ids(self) -> list[str]:
        """Names, sorted."""
        return [f"{k:06d}" for k in range(len(self.shapes))]

    def scene(self) -> Scene:
        """The scene."""
        scene = Scene()
        twists = np.zeros((len(self.shapes), 6)) if self.twists is None else self.twists
        rows = zip(self.ids, self.shapes, self.poses, twists, strict=True)
        scene.apply(SceneUpdate(add=[SceneObject(name, shape, pose, twist) for name, shape, pose, twist in rows]))
        return scene


# -------------------------------------------------------------------------------------------- the engine's answers


def read_distances(answer: Distances) -> Found:
    """Distance and contact."""
    if (answer.status == DistanceStatus.UNSUPPORTED).any():
        raise NotAvailableError(answer.message)
    unsure = ~((answer.lower > 0.0) | (answer.upper <= 0.0))
    return Found(answer.distance <= 0.0, answer.distance, answer.lower, answer.upper, unsure)


def read_booleans(answer: Booleans) -> Found:
    """Contact."""
    if (answer.status == DistanceStatus.UNSUPPORTED).any():
        raise NotAvailableError(answer.message)
    return Found(answer.value, unsure=~answer.certain)


def read_cull(answer: Cull) -> Found:
    """Visible or not."""
    return Found(answer.state != CullState.OUTSIDE, unsure=~answer.certain)


def read_contacts(answer: FirstContacts) -> Found:
    """Time of first contact."""
    if (answer.status == ContactStatus.UNSUPPORTED).any():
        raise NotAvailableError(answer.message)
    hit = ~np.isin(answer.status, (ContactStatus.NEVER, ContactStatus.NOT_CONVERGED))
    return Found(hit, answer.time, answer.time_lower, answer.time_upper, ~answer.certain)


class Answers(NamedTuple):
    """How the engine itself answers a query: by tier, by tolerance, and exactly."""

    ways: tuple[Way, ...]
    exact: Way


def answers(query: Callable[..., Any], ask: Ask, read: Callable[[Any], Found], *, by_tolerance: bool = True) -> Answers:
    """Every tier that there is, of which a query refuses those that it lacks, the choice item by item, and tolerances.

    Without `by_tolerance` there is nothing that a tolerance could be about: the answer is a state.
    """

    def way(name: str, family: str, **how: Any) -> Way:
        return Way(name, family, lambda block: Call(partial(ask, block, **how), read))

    def hurried(ns: float) -> Way:
        """The anytime answer: iterations are capped by the clock."""
        name = f"{1e-3 * ns:g} us an item"
        return Way(name, BUDGET, lambda block: Call(partial(ask, block, time_budget=1e-9 * ns * _items(block)), read))

    tiers = tuple(way(tier, TIER, accuracy=tier) for tier in _validate.ACCURACIES)
    ways = (way(AUTO, TIER, accuracy=AUTO), *tiers)
    takes = by_tolerance and "tolerance" in inspect.signature(query).parameters
    by = [way(f"tolerance {t:g}", TOLERANCE, tolerance=t) for t in TOLERANCES if takes]
    if "time_budget" in inspect.signature(query).parameters:
        by += map(hurried, BUDGETS_NS)
    return Answers((*ways, *by), tiers[-1])


def _items(block: Any) -> int:
    """How many questions a block asks."""
    named = next(name for name in ("center", "points", "boxes", "poses", "a") if hasattr(block, name))
    return len(getattr(block, named))


def on_simpler(
    name: str,
    family: str,
    simpler: Callable[[Any], Any],
    ask: Ask,
    read: Callable[[Any], Found],
) -> Way:
    """The query at float64, about something simpler than what was asked about; so its interval proves nothing."""

    def told(answer: Any) -> Found:
        found = read(answer)
        return Found(found.hit, found.value)

    return Way(name, family, lambda block: Call(partial(ask, simpler(block)), told))


# -------------------------------------------------------------------------------------------- simpler than the shape


def sphere_points(count: int) -> FloatArray:
    """(count, 3) unit vectors, evenly spread: a Fibonacci lattice."""
    k = np.arange(count) + 0.5
    z, angle = 1.0 - 2.0 * k / count, np.pi * (1.0 + 5.0**0.5) * k
    r = np.sqrt(1.0 - z * z)
    return np.column_stack([r * np.cos(angle), r * np.sin(angle), z])


def _ring(radius: float, height: float, count: int) -> FloatArray:
    angle = 2.0 * np.pi * np.arange(count) / count
    return np.column_stack([radius * np.cos(angle), radius * np.sin(angle), np.full(count, height)])


def inscribed(shape: Shape, points: int) -> Shape:
    """The hull of so many points of a curved surface; any other shape as it is."""
    if isinstance(shape, Sphere):
        return Convex(shape.radius * sphere_points(points))
    if isinstance(shape, Ellipsoid):
        return Convex(shape.radii * sphere_points(points))
    if isinstance(shape, Capsule):
        around = shape.radius * sphere_points(points)
        around[:, 2] += np.where(around[:, 2] > 0.0, 0.5, -0.5) * shape.length
        return Convex(around)
    if isinstance(shape, Cylinder):
        both = [_ring(shape.radius, sign * 0.5 * shape.length, points // 2) for sign in (-1.0, 1.0)]
        return Convex(np.concatenate(both))
    if isinstance(shape, Cone):
        return Convex([*_ring(shape.radius, -0.5 * shape.length, points - 1), (0.0, 0.0, 0.5 * shape.length)])
    return shape


def spread(vertices: FloatArray, count: int) -> FloatArray:
    """So many of the vertices, each as far as can be from those before: what a simplified hull keeps."""
    if len(vertices) <= count:
        return vertices
    chosen = [int(np.argmax(np.linalg.norm(vertices - vertices.mean(axis=0), axis=1)))]
    away = np.linalg.norm(vertices - vertices[chosen[0]], axis=1)
    while len(chosen) < count:
        chosen.append(int(np.argmax(away)))
        away = np.minimum(away, np.linalg.norm(vertices - vertices[chosen[-1]], axis=1))
    return vertices[sorted(chosen)]  # sorted: a ring stays a ring


def thinned(shape: Shape, count: int) -> Shape:
    """The hull of so many of its vertices; any other shape as it is."""
    return Convex(spread(shape.vertices, count)) if isinstance(shape, Convex) else shape


def _extents(shape: Shape) -> FloatArray | None:
    """Half sizes of the box about the origin that holds a shape; None if none does."""
    if isinstance(shape, Sphere):
        return np.full(3, shape.radius)
    if isinstance(shape, Capsule):
        return np.array([shape.radius, shape.radius, shape.radius + 0.5 * shape.length])
    if isinstance(shape, (Cylinder, Cone)):
        return np.array([shape.radius, shape.radius, 0.5 * shape.length])
    if isinstance(shape, Ellipsoid):
        return np.asarray(shape.radii)
    if isinstance(shape, Convex):
        most: FloatArray = np.abs(shape.vertices).max(axis=0)
        return most
    return None


def boxed(shape: Shape) -> Shape:
    """A box about the origin that holds the shape; a half space as it is."""
    half = _extents(shape)
    return shape if half is None else Box(half)


def balled(shape: Shape) -> Shape:
    """A ball about the origin that holds the shape; a half space as it is."""
    if isinstance(shape, Sphere):
        return shape
    if isinstance(shape, Capsule):
        return Sphere(shape.radius + 0.5 * shape.length)
    if isinstance(shape, Convex):
        return Sphere(float(np.linalg.norm(shape.vertices, axis=1).max()))
    half = shape.half_extents if isinstance(shape, Box) else _extents(shape)
    return shape if half is None else Sphere(float(np.linalg.norm(half)))


def with_shapes(change: Callable[[Shape], Shape]) -> Callable[[Any], Any]:
    """Both shapes of a pair, or all of a crowd, changed; a `WayError` if that changes nothing."""

    def simpler(block: Any) -> Any:
        given = (block.a, block.b) if isinstance(block, Pair) else tuple(block.shapes)
        made = tuple(change(shape) for shape in given)
        if all(new is old or _same_points(new, old) for new, old in zip(made, given, strict=True)):
            raise WayError
        return replace(block, a=made[0], b=made[1]) if isinstance(block, Pair) else replace(block, shapes=made)

    return simpler


def _same_points(new: Shape, old: Shape) -> bool:
    return isinstance(new, Convex) and isinstance(old, Convex) and len(new.vertices) == len(old.vertices)


def with_vertices(change: Callable[[FloatArray], FloatArray]) -> Callable[[Any], Any]:
    """Every polygon or polytope of two batches changed."""

    def simpler(block: Any) -> Any:
        a, b = (type(side).from_list([change(side[i]) for i in range(len(side))]) for side in (block.a, block.b))
        return replace(block, a=a, b=b)

    return simpler


def rectangle(vertices: FloatArray) -> FloatArray:
    """The box along the axes around a polygon or a polytope."""
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    corners = [(0, 0), (1, 0), (1, 1), (0, 1)]
    if len(low) == 3:
        corners = [(*corner, z) for z in (0, 1) for corner in corners]  # type: ignore[misc]
    return low + np.array(corners) * (high - low)


def upright(boxes: Boxes) -> Boxes:
    """The boxes along the axes around boxes."""
    half = np.einsum("nk,nkd->nd", boxes.half_extents, np.abs(boxes.axes))
    return Boxes(boxes.center, np.tile(np.eye(3), (len(boxes), 1, 1)), half)


def _planes_only(block: Sight) -> BoolArray:
    """The six planes of the view, as most renderers do it: boxes beside an edge pass.

    Sums by einsum, since a matrix product would run on more threads than the one whose time is taken.
    """
    frustum, boxes = block.frustum, block.boxes
    delta = np.einsum("nk,pk->np", boxes.center - frustum.origin, frustum.axes)
    edges = (boxes.axes @ frustum.axes.T) * boxes.half_extents[:, :, None]
    (l0, l1, u0, u1), near = frustum.bounds, frustum.near
    planes = np.array([[0, 0, -1], [0, 0, 1], [near, 0, -l1], [-near, 0, l0], [0, near, -u1], [0, -near, u0]], float)
    limit = np.array([-near, frustum.far, 0, 0, 0, 0])
    middle, reach = np.einsum("nk,pk->np", delta, planes), np.abs(np.einsum("nik,pk->nip", edges, planes)).sum(axis=1)
    visible: BoolArray = (middle - reach <= limit).all(axis=1)
    return visible


PLANES_ONLY = Way("six planes, numpy", OTHER, lambda block: Call(partial(_planes_only, block), Found))


def _as_hull(block: Points) -> Call:
    """The general query: the frustum as a hull against a point."""
    frustum = block.frustum
    if not isinstance(frustum, Frustum):
        raise WayError
    poses = np.column_stack([block.points, np.zeros((len(block.points), 3)), np.ones(len(block.points))])
    return Call(partial(distance, frustum, Point([0, 0, 0]), poses), read_distances)


FRUSTUM_AS_HULL = Way("distance() of its hull", OTHER, _as_hull)


def _frustum_boxed(block: Points) -> Call:
    """The box along the frustum's axes around it."""
    frustum = block.frustum
    if not isinstance(frustum, Frustum):
        raise WayError
    l0, l1, u0, u1 = (frustum.far / frustum.near * side for side in frustum.bounds)
    low, high = np.array([l0, u0, frustum.near]), np.array([l1, u1, frustum.far])
    local = (block.points - frustum.origin) @ frustum.axes.T - 0.5 * (low + high)
    poses = np.column_stack([local, np.zeros((len(local), 3)), np.ones(len(local))])
    return Call(
        partial(distance, Box(0.5 * (high - low)), Point([0, 0, 0]), poses), lambda x: Found(*read_distances(x)[:2])
    )


FRUSTUM_BOXED = Way("bounding box", VOLUME, _frustum_boxed)


# --------------------------------------------------------------------------------------------------------- motion


def _stepped(motion: Motion, step: float) -> FloatArray:
    """Time of the first step at which bodies overlap; NaN if they never do.  Whatever happens in between is missed."""
    time = np.full(len(motion), np.nan)
    rows = np.arange(len(motion))
    for k in range(int(motion.t_max / step) + 1):
        meet = motion.overlap(rows, k * step)
        time[rows[meet]] = k * step
        rows = rows[~meet]
        if not len(rows):
            break
    return time


def fixed_step(step: float) -> Way:
    """Move by a fixed step and look whether the bodies overlap, as simulations do."""

    def prepare(motion: Motion) -> Call:
        return Call(partial(_stepped, motion, step), lambda time: Found(~np.isnan(time), time))

    return Way(f"steps of {step:g} s", STEPS, prepare)


CLOSE_LENGTH = 1e-9  #: [m] gap at which the search for the very moment begins
LONGEST_LENGTH = 1e-4  #: [s] of that search; what has not touched by then has passed by
HALVINGS = 60  #: of an interval as short as that: below the spacing of doubles


def _searched(motion: Motion) -> Found:
    """The truth of a motion: advance by what no point can cross, then halve an interval until nothing is left of it.

    Nothing is missed but a contact shorter than the last interval that followed a gap below `CLOSE_LENGTH`.
    """
    reach = np.maximum.reduceat(np.linalg.norm(motion.b.vertices, axis=1), motion.b.offsets[:-1])
    speed = np.linalg.norm(motion.velocity, axis=1) + np.linalg.norm(motion.spin, axis=1) * reach
    time, rows, close = np.zeros(len(motion)), np.arange(len(motion)), np.zeros(len(motion), bool)
    while len(rows):
        gap = motion.gap(rows, time[rows])
        close[rows] = gap <= CLOSE_LENGTH
        time[rows] += np.where(close[rows], 0.0, gap / speed[rows])
        rows = rows[~close[rows] & (time[rows] <= motion.t_max)]
    value = np.where(close & motion.overlap(np.arange(len(motion)), 0.0), 0.0, np.nan)
    rows = np.flatnonzero(close & np.isnan(value))
    length = CLOSE_LENGTH / speed[rows]
    while len(rows):
        low, high = time[rows], time[rows] + length
        meet = motion.overlap(rows, high)
        at, low, high = rows[meet], low[meet], high[meet]
        for _ in range(HALVINGS):
            middle = 0.5 * (low + high)
            over = motion.overlap(at, middle)
            low, high = np.where(over, low, middle), np.where(over, middle, high)
        value[at] = np.where(high <= motion.t_max, high, np.nan)
        rest = ~meet & (length < LONGEST_LENGTH)
        rows, length = rows[rest], 2.0 * length[rest]
    return Found(~np.isnan(value), value)


SEARCHED = Way("advancement and bisection", OTHER, lambda motion: Call(partial(_searched, motion), lambda x: x))


def as_polygons(sides: int) -> Way:
    """Discs as regular polygons."""
    return on_simpler(
        f"{sides} sides", APPROXIMATION, lambda discs: discs.as_polygons(sides), Motion.ask, read_contacts
    )


DIGITS = 60  #: enough that the root's last bit in double is right


def _closed_form(discs: Discs) -> Found:
    """The first root of |c + w t| = r + s, in decimal numbers."""
    times = np.full(len(discs.radius), np.nan)
    with localcontext() as context:
        context.prec = DIGITS
        rows = np.column_stack([discs.center, discs.velocity, discs.radius]).tolist()
        for k, row in enumerate(rows):
            x, y, u, v, r, s = map(Decimal, row)
            a, b, c = u * u + v * v, x * u + y * v, x * x + y * y - (r + s) ** 2
            root = b * b - a * c
            if c <= 0:
                times[k] = 0.0
            elif root >= 0 and b < 0:
                time = float((-b - root.sqrt()) / a)
                times[k] = time if time <= discs.t_max else np.nan
    return Found(~np.isnan(times), times)


CLOSED_FORM = Way(f"closed form, {DIGITS} digits", OTHER, lambda discs: Call(partial(_closed_form, discs), lambda x: x))


# --------------------------------------------------------------------------------------------------------- scenes


@dataclass(frozen=True)
class Asked:
    """A query to a scene: how it is asked after all objects were moved, and how its answer is read."""

    ask: Callable[[Crowd, Scene, dict[str, Any]], Any]
    read: Callable[[Crowd, Any], Found]

    def call(self, crowd: Crowd, **how: Any) -> Call:
        """One step of the scene: new poses, then the query."""
        scene, ids = crowd.scene(), crowd.ids

        def run() -> Any:
            scene.set_states(ids, crowd.poses)
            scene.forget()  # every step is one in which everything moved
            return self.ask(crowd, scene, how)

        return Call(run, partial(self.read, crowd))

    def ways(self, *, by_tolerance: bool = True) -> tuple[Way, ...]:
        """The choice item by item, every tier that there is, and tolerances."""

        def way(name: str, family: str, **how: Any) -> Way:
            return Way(name, family, lambda crowd: self.call(crowd, **how))

        tiers = (way(tier, TIER, accuracy=tier) for tier in (AUTO, *_validate.ACCURACIES))
        return *tiers, *(way(f"tolerance {t:g}", TOLERANCE, tolerance=t) for t in TOLERANCES if by_tolerance)

    def on_simpler(self, name: str, change: Callable[[Shape], Shape]) -> Way:
        """Other shapes in place of those of the scene."""

        def prepare(crowd: Crowd) -> Call:
            run, read = self.call(with_shapes(change)(crowd))
            return Call(run, lambda answer: Found(*read(answer)[:2]))

        return Way(name, VOLUME, prepare)

    @property
    def exact(self) -> Way:
        """The tier that judges the others."""
        return next(way for way in self.ways() if way.name == "exact")


def _of_pairs(crowd: Crowd, answer: PairDistances) -> Found:
    """A row for every pair of objects; no hit and NaN for those that are not listed."""
    count = len(crowd.shapes)
    values, lower, upper = (np.full((count, count), np.nan) for _ in range(3))
    at = np.array([answer.ids_a, answer.ids_b], dtype=object).astype(np.int64)
    values[at[0], at[1]], lower[at[0], at[1]], upper[at[0], at[1]] = answer.distance, answer.lower, answer.upper
    if answer.unsupported:
        raise NotAvailableError(answer.message)
    i, j = np.triu_indices(count, 1)
    return Found(~np.isnan(values[i, j]), values[i, j], lower[i, j], upper[i, j])


def _boxes_of(crowd: Crowd) -> Boxes:
    half = [shape.half_extents for shape in crowd.shapes if isinstance(shape, Box)]
    if len(half) < len(crowd.shapes):
        raise NotAvailableError("not all shapes are boxes")
    return Boxes.from_poses(crowd.poses, np.array(half))


def _all_pairs(crowd: Crowd) -> Found:
    """Every pair of boxes by the exact tier."""
    boxes = _boxes_of(crowd)
    i, j = np.triu_indices(len(boxes), 1)
    a, b = (Boxes(boxes.center[k], boxes.axes[k], boxes.half_extents[k]) for k in (i, j))
    found = read_distances(distance(a, b, accuracy="exact"))
    assert found.value is not None and found.lower is not None and found.upper is not None
    near = found.value <= crowd.reach
    value, lower, upper = (np.where(near, x, np.nan) for x in (found.value, found.lower, found.upper))
    return Found(near, value, lower, upper)


ALL_PAIRS = Way("every pair, exact", OTHER, lambda crowd: Call(partial(_all_pairs, crowd), lambda x: x))
NEAR_PAIRS = Asked(lambda crowd, scene, how: scene.distances(crowd.reach, **how), _of_pairs)


def _seen(crowd: Crowd, answer: SceneCull) -> Found:
    return Found(answer.state != Visibility.OUTSIDE, unsure=~answer.certain)


def _boxes_seen(crowd: Crowd) -> Found:
    return read_cull(cull(crowd.camera, _boxes_of(crowd), accuracy="exact"))


SEEN = Asked(lambda crowd, scene, how: scene.cull(crowd.camera, **how), _seen)
BOXES_SEEN = Way("cull(), exact", OTHER, lambda crowd: Call(partial(_boxes_seen, crowd), lambda x: x))

SPACING = 64.0  #: of the pairs of a motion that share a scene [m]; a power of two, so that shifting rounds nothing
COLUMNS = 16


def _crowd_of(motion: Motion) -> Crowd:
    """The pairs of a motion in one scene, far enough apart that no pair meets another."""
    count = len(motion)
    shapes: list[Shape] = []
    poses, twists = np.zeros((2 * count, 7)), np.zeros((2 * count, 6))
    poses[:, 6] = 1.0
    d = motion.center.shape[1]
    cell = SPACING * np.column_stack([np.arange(count) % COLUMNS, np.arange(count) // COLUMNS, np.zeros(count)])
    poses[0::2, :3] = poses[1::2, :3] = cell
    poses[1::2, :d] += motion.center
    twists[1::2, :d], twists[1::2, 3:] = motion.velocity, motion.spin
    for k in range(count):
        shapes += [(Polygon if motion.planar else Convex)(side[k]) for side in (motion.a, motion.b)]
    camera = Frustum([0, 0, 0], np.eye(3), 1.0, 1.0, 1.0, 2.0)
    return Crowd(shapes, poses, 0.0, camera, twists, motion.t_max)


def _of_motion(crowd: Crowd, answer: PairContacts) -> Found:
    """A row for every pair of a motion; those that are not listed never meet."""
    if answer.unsupported:
        raise NotAvailableError(answer.message)
    count = len(crowd.shapes) // 2
    rows = np.array(answer.ids_a, dtype=object).astype(np.int64) // 2
    hit, numbers = np.zeros(count, bool), np.full((3, count), np.nan)
    hit[rows] = ~np.isin(answer.status, (ContactStatus.NEVER, ContactStatus.NOT_CONVERGED))
    numbers[:, rows] = answer.time, answer.time_lower, answer.time_upper
    return Found(hit, numbers[0], numbers[1], numbers[2])


MOVED_PAIRS = Asked(lambda crowd, scene, how: scene.first_contacts(crowd.horizon, **how), _of_motion)


def in_scene(asked: Asked) -> tuple[Way, ...]:
    """Every tier of a scene, asked about a motion."""

    def moved(way: Way) -> Way:
        return Way(way.name, way.family, lambda motion: way.prepare(_crowd_of(motion)))

    return tuple(map(moved, asked.ways()))
