# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""What turning bodies share when they touch: laid flat on each other in rational numbers, and turned back by an oracle.

At time T two bodies lie on either side of a plane, each with a face, an edge or a corner in it: exactly known is what
these share.  The oracle turns them back to where they start, which is rounded.  Every point of a comes nearer to every
point of b along the normal, so they are apart until then.
"""

from __future__ import annotations

from fractions import Fraction
from itertools import product
from typing import Any

import numpy as np
import pytest
from conftest import reproducer
from oracle import polygon, polytope
from oracle.turning import ONE, Turning, _rounded
from oracle.vectors import Vector, add, cross, dot, scale, sub
from test_turning import FAMILIES, Pair, ask, bodies, corners, random_pair, still

import geomsrv as gs
from geomsrv import _core
from geomsrv.answers import ContactStatus

T = Fraction(1, 2)
SIZES = (2.0**-20, 1.0, 2.0**20)

# Coordinates as given round by 2^-53 of their size, which here is less than 8 sizes, at the start and at the time of
# contact; the faces then share what is off by as much over the least sine of an angle between two edges, 1/16.
ROUNDED = 2.0**-42


def rotation(rng: np.random.Generator) -> tuple[Vector, Vector, Vector]:
    """Three unit vectors across each other, in rational numbers, from a quaternion of whole numbers."""
    q = [0, 0, 0, 0]
    while not any(q):
        q = [int(x) for x in rng.integers(-3, 4, size=4)]
    x, y, z, w = (Fraction(c) for c in q)
    n = x * x + y * y + z * z + w * w
    rows = (
        (w * w + x * x - y * y - z * z, 2 * (x * y - w * z), 2 * (x * z + w * y)),
        (2 * (x * y + w * z), w * w - x * x + y * y - z * z, 2 * (y * z - w * x)),
        (2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z),
    )
    return tuple(tuple(c / n for c in row) for row in rows)  # type: ignore[return-value]


def ring_of(rng: np.random.Generator, dimension: int) -> list[Vector]:
    """A point, a segment or a polygon on a grid."""
    while True:
        points = [tuple(Fraction(int(c), 8) for c in rng.integers(-8, 9, size=2)) for _ in range(1 + 2 * dimension)]
        ring = polygon.hull(points[: (1, 2, 6)[dimension]])
        if polygon.dimension(ring) == dimension:
            return ring


class Landing:
    """A pair that lands flat at T, and what it shares then."""

    def __init__(
        self, rng: np.random.Generator, dimensions: tuple[int, int], size: float, flat: bool = False, thickness: Any = 1
    ) -> None:
        wanted = max(sum(dimensions) - (1 if flat else 2), 0)
        while True:
            rings = [ring_of(rng, k) for k in dimensions]
            if flat:
                rings = [polygon.hull([(x, Fraction(0)) for x, _ in ring]) for ring in rings]
                if any(polygon.dimension(r) != k for r, k in zip(rings, dimensions, strict=True)):
                    continue
            shared = polygon.intersection(*rings)
            if polygon.dimension(shared) == wanted and self._clearly(rings, shared, dimensions):
                break
        if flat:  # the direction along the plane is x, that across it y
            c, s = ((Fraction(3, 5), Fraction(4, 5)), (Fraction(1), Fraction(0)))[int(rng.integers(2))]
            axes = (c, -s, Fraction(0)), (Fraction(0), Fraction(0), Fraction(-1)), (s, c, Fraction(0))
        else:
            axes = rotation(rng)
            axes = (*axes[:2], cross(axes[0], axes[1]))
        self.normal = axes[2]
        self.size = size
        scaled = Fraction(size)

        def place(x: Fraction, y: Fraction, z: Any) -> Vector:
            at = add(add(scale(x, axes[0]), scale(y, axes[1])), scale(Fraction(z), axes[2]))
            return scale(scaled, at)

        self.expected = np.array([[float(c) for c in place(*p, 0)] for p in shared])
        self.pair: Pair = {}
        spread = 4.0 if not flat else 3.0
        closing, d = 4.0, 2 if flat else 3
        for name, ring, side in zip("ab", rings, (-1, 1), strict=True):
            # Behind the face a smaller one, so that nothing else is in the plane.
            middle = tuple(sum(c) / len(ring) for c in zip(*ring, strict=True))
            back = [tuple((p + m) / 2 for p, m in zip(q, middle, strict=True)) for q in ring]
            if len(ring) < 3 and not flat:
                back = [add(p, o) for p in back for o in ((Fraction(1, 8), Fraction(1, 8)), (0, Fraction(-1, 8)))]
            if flat and len(back) == 1:
                back = [add(back[0], (x, Fraction(0))) for x in (Fraction(-1, 4), Fraction(1, 4))]
            depth = side * Fraction(thickness)
            at_contact = [place(*p, 0) for p in ring] + [place(*p, depth) for p in back]
            center = place(*(Fraction(int(c), 8) for c in rng.integers(-8, 9, size=2)), side * Fraction(1, 4))
            if flat:
                center = place(center_x := Fraction(int(rng.integers(-8, 9)), 8), Fraction(0), side * Fraction(1, 4))
                assert center_x is not None
            spin = rng.normal(size=3)
            spin *= rng.uniform(0.1, 0.45) * closing / spread / np.linalg.norm(spin)
            if flat:
                spin = np.array([0.0, 0.0, spin[2]])
            along = rng.normal(size=3) if not flat else np.append(rng.normal(size=2), 0.0)
            n = np.array([float(c) for c in self.normal])
            along -= along.dot(n) * n
            velocity = size * (along - side * 0.5 * closing * n)
            if flat:
                velocity[2] = 0.0
            backwards = Turning(tuple(at_contact), *(tuple(Fraction(-x) for x in v) for v in (velocity, spin)), center)
            start = [[float(Fraction(c, ONE)) for c in p] for p in backwards.at(T)]
            start_center = [float(c - Fraction(v) * T) for c, v in zip(center, velocity.tolist(), strict=True)]
            vertices = np.array(start)[:, :d]
            self.pair[name] = (
                np.array(polygon.hull([tuple(map(Fraction, p)) for p in vertices.tolist()]), float)
                if flat
                else vertices
            )
            self.pair |= {f"v{name}": velocity[:d], f"w{name}": spin[2] if flat else spin}
            self.pair[f"c{name}"] = np.array(start_center)[:d]

    @staticmethod
    def _clearly(rings: list[list[Vector]], shared: list[Vector], dimensions: tuple[int, int]) -> bool:
        """Whether what is shared would be so if the bodies were moved a little: no corner that just meets another."""
        step = Fraction(1, 32)
        sizes = {len(shared)}
        for dx, dy in product((-step, step), repeat=2):
            if all(len(r) == 2 for r in rings) and polygon.dimension(shared) == 1:
                dx = dy = Fraction(0)
            if len(shared) and all(p[1] == 0 for r in rings for p in r):
                dy = Fraction(0)
            moved = polygon.intersection([add(p, (dx, dy)) for p in rings[0]], rings[1])
            sizes.add(len(moved))
        far = all(polygon_gap(p, q) >= Fraction(1, 16) ** 2 for i, p in enumerate(shared) for q in shared[:i])
        return sizes == {len(shared)} and far and all(k >= 0 for k in dimensions)


def polygon_gap(p: Vector, q: Vector) -> Fraction:
    """The square of the distance."""
    d = sub(p, q)
    return dot(d, d)


def swapped(pair: Pair) -> Pair:
    return {x[:-1] + "ba"["ab".index(x[-1])]: v for x, v in pair.items()}


def way(pair: Pair, answer: gs.FirstContacts) -> float:
    """No point of b comes further, seen from any of a, between the two ends of the time interval; slightly more."""
    speed = float(np.linalg.norm(np.subtract(pair["va"], pair["vb"])))
    for x in "ab":
        body = Turning.of(pair[x], pair[f"v{x}"], pair[f"w{x}"], pair[f"c{x}"])
        speed += float(body.speed) * body.reach
    return speed * float(answer.time_upper[0] - answer.time_lower[0]) * (1.0 + 1e-12)


def far_from(points: np.ndarray, others: np.ndarray) -> float:
    """How far the furthest of some points is from the nearest other."""
    return float(np.linalg.norm(points[:, None] - others[None], axis=2).min(axis=1).max())


def inside_both(pair: Pair, answer: gs.FirstContacts, slack: float) -> bool:
    """Whether every point is as near to both bodies, placed by the oracle at the time of contact."""
    t = Fraction(float(answer.time[0]))
    for x in "ab":
        body = Turning.of(pair[x], pair[f"v{x}"], pair[f"w{x}"], pair[f"c{x}"])
        placed = _rounded(body.at(t), 130)
        for point in answer.points.tolist():
            exactly = tuple(map(Fraction, point)) + (Fraction(0),) * (3 - len(point))
            if polytope.squared_distance(placed, [exactly]) > Fraction(slack) ** 2:
                return False
    return True


def check(landing: Landing, tolerance: float) -> None:
    pair, d = landing.pair, len(landing.pair["va"])
    answer = ask(pair, tolerance=tolerance)
    text = reproducer(**pair, tolerance=tolerance) + f"\n{answer}\n{landing.expected}"
    assert answer.status == gs.WILL_TOUCH, text
    assert answer.time_lower[0] <= 0.5 * (1 + 1e-13) and answer.time_upper[0] >= 0.5 * (1 - 1e-13), text
    band = way(pair, answer) + ROUNDED * landing.size
    assert band <= 0.01 * landing.size, text
    expected = landing.expected[:, :d]
    # Where edges cross at a small angle, that much further: here by no more than 16 times.
    assert len(answer.points) == len(expected), text
    assert max(far_from(answer.points, expected), far_from(expected, answer.points)) <= 16 * band, text
    assert inside_both(pair, answer, band), text
    n = np.array([float(c) for c in landing.normal])[:d]
    if len(expected) > 2:
        # Counter-clockwise about the normal.
        edges = np.roll(answer.points, -1, axis=0) - answer.points
        assert (np.cross(edges, np.roll(edges, -1, axis=0)) @ n > 0.0).all(), text
    if len(expected) == 2 and d == 2:
        x, y = answer.points[1] - answer.points[0]
        assert n[0] * y - n[1] * x > 0.0, text  # around a
    other = ask(swapped(pair), tolerance=tolerance)
    twice = 16 * (band + way(swapped(pair), other))
    assert len(other.points) == len(answer.points), text
    assert max(far_from(answer.points, other.points), far_from(other.points, answer.points)) <= twice, text
    without = ask(pair, tolerance=tolerance, contact_set=False)
    assert len(without.points) == 0 and without.time_upper == answer.time_upper, text
    assert np.array_equal(without.normal, answer.normal) and without.closing_speed == answer.closing_speed, text


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize(
    "dimensions",
    [(2, 2), (1, 2), (2, 1), (1, 1), (0, 2), (2, 0)],
    ids=["face on face", "edge on face", "face on edge", "edges that cross", "corner on face", "face on corner"],
)
def test_solids_that_land_flat(rng: np.random.Generator, dimensions: tuple[int, int], size: float) -> None:
    for _ in range(6):
        landing = Landing(rng, dimensions, size)
        for tolerance in (1e-6, 1e-10):
            check(landing, tolerance)


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("dimensions", [(1, 1), (0, 1), (1, 0)], ids=["side on side", "corner", "side on corner"])
def test_polygons_that_land_flat(rng: np.random.Generator, dimensions: tuple[int, int], size: float) -> None:
    for _ in range(8):
        landing = Landing(rng, dimensions, size, flat=True)
        for tolerance in (1e-6, 1e-10):
            check(landing, tolerance)


@pytest.mark.parametrize("thickness", [Fraction(1, 2**10), Fraction(1, 2**24), Fraction(1, 2**33)])
@pytest.mark.parametrize("flat", [False, True])
def test_thin_bodies(rng: np.random.Generator, flat: bool, thickness: Fraction) -> None:
    """Both sides of a body may be within the band: it is the nearer one that touches."""
    for _ in range(6):
        landing = Landing(rng, (1, 1) if flat else (2, 2), 1.0, flat=flat, thickness=thickness)
        check(landing, 1e-11)
        # Where all of a body is within the band, points are as near as they are said to be.
        answer = ask(landing.pair, tolerance=1e-4)
        assert inside_both(landing.pair, answer, way(landing.pair, answer) + ROUNDED), reproducer(**landing.pair)


@pytest.mark.parametrize("rate", [0.5, 3.0])
@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("d", [2, 3])
def test_a_bar_sweeps_flat_onto_a_wall(d: int, size: float, rate: float) -> None:
    """Hinged at the origin, its side from 1 to 4 comes to lie on a wall from 2 to 6 at time 1/2."""
    bar = [(1, -0.125), (4, -0.125), (4, 0), (1, 0)]
    wall = [(2, 0), (6, 0), (6, 1), (2, 1)]
    expected = [(4, 0), (2, 0)]
    if d == 3:
        bar = [(*p, z) for p in bar for z in (-1, 1)]
        wall = [(*p, z) for p in wall for z in (-0.5, 2)]
        expected = [(x, 0, z) for x in (2, 4) for z in (-0.5, 1)]
    spin = rate if d == 2 else (0.0, 0.0, rate)
    zero = (0.0,) * 3
    back = Turning.of(size * np.array(bar, dtype=float), zero, (0.0, 0.0, -rate), zero)
    start = np.array([[float(Fraction(c, ONE)) for c in p] for p in back.at(T)])[:, :d]
    pair = still(start, size * np.array(wall, dtype=float), wa=spin, wb=0.0 if d == 2 else zero)
    for one in (pair, swapped(pair)):
        for tolerance in (1e-3, 1e-6, 1e-9, 1e-300):
            answer = ask(one, tolerance=tolerance)
            text = f"{answer}"
            assert answer.status in (gs.WILL_TOUCH, ContactStatus.GRAZING), text
            band = way(one, answer) + ROUNDED * size
            assert len(answer.points) == len(expected), text
            assert far_from(np.array(expected) * size, answer.points) <= 4 * band, text
            assert inside_both(one, answer, band), text
            if d == 2 and one is pair:
                assert answer.points[0, 0] > answer.points[1, 0]  # counter-clockwise around a


@pytest.mark.parametrize("rate", [1e-9, 0.3, 40.0])
@pytest.mark.parametrize("size", [1e-6, 1.0, 1e6])
def test_boxes_that_turn_about_the_normal_of_the_face(rng: np.random.Generator, size: float, rate: float) -> None:
    """At time 3 a square lies on a larger one: its corners, or, turned by 1/8, an octagon on one of its size."""
    eighth = np.pi / 12
    for half, spin in ((2.0, rate), (1.0, eighth)):
        a = gs.Boxes([[0, 0, 0]], [np.eye(3)], [[size, size, size]])
        b = gs.Boxes([[0, 0, 5 * size]], [np.eye(3)], [[half * size, half * size, size]])
        angle = 3.0 * spin
        turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
        square = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)])
        expected = square @ turn.T
        if half == 1.0:
            near = np.tan(np.pi / 8)
            expected = np.array([p for x in (-near, near) for y in (-1, 1) for p in ((x, y), (y, x))])
        for tolerance in (1e-4, 1e-6, 1e-12, 1e-300):
            answer = gs.first_contact(
                a, b, (0, 0, size), (0, 0, 0), angular_velocity_a=(0, 0, spin), tolerance=tolerance
            )
            assert answer.time == pytest.approx(3.0, abs=1e-12) and np.allclose(answer.normal, [0, 0, 1], atol=1e-12)
            points = answer.points / size
            width = (1 + 1.5 * spin) * float(answer.time_upper[0] - answer.time_lower[0])
            assert len(points) == len(expected)
            assert far_from(points[:, :2], expected) <= 4 * width + 1e-11
            assert np.allclose(points[:, 2], 4.0, atol=width + 1e-11)
            area = 0.5 * np.cross(points, np.roll(points, -1, axis=0))[:, 2].sum()
            assert area == pytest.approx(4.0 if half == 2.0 else 8 * near, abs=1e-2)


def test_what_lands_on_a_corner_or_crosses_stays_one_point() -> None:
    """As before: midway between the nearest points."""
    cube = gs.Boxes([[0, 0, 0]], [np.eye(3)], [[1, 1, 1]])
    other = gs.Boxes([[3.2, 0, 0]], [np.eye(3)], [[2, 2, 2]])
    swing = gs.first_contact(cube, corners(other), (0, 0, 0), (0, 0, 0), angular_velocity_a=(0.3, 0.2, 1))
    assert swing.status == gs.WILL_TOUCH and len(swing.points) == 1
    rod = bodies([(-1.0, 0, 0), (1.0, 0, 0)])
    cross_bar = bodies([(0, -1.0, 1.0), (0, 1.0, 1.0)])
    meet = gs.first_contact(rod, cross_bar, (0, 0, 1), (0, 0, 0), angular_velocity_a=(0, 0, 0.25))
    assert meet.points == pytest.approx(np.array([[0, 0, 1]]), abs=1e-6)
    # Turned by a quarter of a turn they lie along one another.
    along = gs.first_contact(rod, cross_bar, (0, 0, 1), (0, 0, 0), angular_velocity_a=(0, 0, np.pi / 2))
    assert len(along.points) == 2 and far_from(along.points, np.array([(0, -1, 1), (0, 1, 1)])) <= 1e-5


@pytest.mark.parametrize("d", [2, 3])
@pytest.mark.parametrize("family", FAMILIES)
def test_every_point_is_on_both_bodies(rng: np.random.Generator, family: str, d: int) -> None:
    """Within the way that they come meanwhile, however much that is; the point between the nearest is among them."""
    sizes = set()
    for _ in range(12):
        pair = random_pair(rng, d, **FAMILIES[family])
        for tolerance in (1e-2, 1e-4, 1e-7):
            answer = ask(pair, t_max=3.0, tolerance=tolerance)
            if answer.status != gs.WILL_TOUCH:
                continue
            sizes.add(len(answer.points))
            size = float(np.abs(pair["a"] - pair["ca"]).max() + np.abs(pair["b"] - pair["cb"]).max())
            far = float(np.abs(pair["a"]).max() + np.abs(pair["b"]).max())
            band = way(pair, answer) + ROUNDED * size + 2.0**-50 * far
            text = reproducer(**pair, tolerance=tolerance) + f"\n{answer}"
            assert len(answer.points) and inside_both(pair, answer, band), text
    assert 1 in sizes


def test_without_turning_as_the_closed_form(rng: np.random.Generator) -> None:
    """What translates, sent through the engine for what turns."""
    seen = set()
    for _ in range(60):
        half = rng.integers(1, 5, size=(2, 3)) * 0.25
        a = gs.Boxes([rng.integers(-4, 5, size=3) * 0.25], [np.eye(3)], half[:1])
        b = gs.Boxes([rng.integers(-4, 5, size=3) * 0.25 + [0, 0, 5]], [np.eye(3)], half[1:])
        velocity = np.array([*rng.integers(-2, 3, size=2) * 0.125, 1.0])
        expected = gs.first_contact(a, b, velocity, (0, 0, 0))
        motions = [np.array([[*v, 0, 0, 0, *body.center[0]]]) for v, body in ((velocity, a), (np.zeros(3), b))]
        sides = [(body.center, body.axes, body.half_extents) for body in (a, b)]
        found = _core.first_contact_turning(*sides, *motions, np.inf, 1e-9, np.zeros((1, 3)), True)
        if expected.status != gs.WILL_TOUCH or found[0][0] != gs.WILL_TOUCH:
            continue  # edges that graze edges
        points = found[7]
        assert len(expected.points) == len(points)
        assert max(far_from(points, expected.points), far_from(expected.points, points)) <= 1e-8
        seen.add(len(points))
    assert 4 in seen


@pytest.mark.parametrize("d", [2, 3])
def test_at_the_start_as_bodies_at_rest(rng: np.random.Generator, d: int) -> None:
    """TOUCHING and OVERLAPPING: the same points, and of those that touch the same normal; one against many, too."""
    square = [(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)]
    first = square if d == 2 else [(*p, z) for p in square for z in (-0.5, 0.5)]
    shifts = np.zeros((5, d))
    shifts[:, 0] = (1.0, 0.75, 3.0, 1.0, 1.0)
    shifts[:, 1] = (0.25, 0.5, 0.0, 1.0, 0.0)
    others = bodies(*(np.array(first) + shift for shift in shifts))
    zero = np.zeros(d)
    rest = gs.first_contact(bodies(first), others, zero, zero)
    spin = {"angular_velocity_b": 1.0 if d == 2 else (0.0, 0.0, 1.0)}
    for k, moving in enumerate((bodies(first), bodies(*[first] * 5))):
        answer = gs.first_contact(moving, others, zero, zero, t_max=0.1, **spin)
        assert answer.status.tolist() == rest.status.tolist() == [2, 3, 0, 2, 2], k
        assert np.array_equal(answer.points, rest.points) and np.array_equal(answer.point_offsets, rest.point_offsets)
        assert np.array_equal(answer.normal, rest.normal, equal_nan=True)
        without = gs.first_contact(moving, others, zero, zero, t_max=0.1, contact_set=False, **spin)
        assert np.array_equal(without.normal, answer.normal, equal_nan=True) and not len(without.points)
        assert np.array_equal(without.closing_speed, answer.closing_speed, equal_nan=True)
    boxes = gs.Boxes([[0, 0, 0]] * 2, [np.eye(3)] * 2, [[1, 1, 1]] * 2)
    lids = gs.Boxes([[0.2, 0.3, 2], [0.5, 0, 1.75]], [np.eye(3)] * 2, [[1, 2, 1]] * 2)
    turning = gs.first_contact(boxes, lids, (0, 0, 1), (0, 0, 0), angular_velocity_a=(0, 0, 1))
    resting = gs.first_contact(boxes, lids, (0, 0, 0), (0, 0, 0))
    assert turning.status.tolist() == [2, 3] and np.array_equal(turning.points, resting.points)
    assert turning.normal[0].tolist() == [0, 0, 1] and turning.closing_speed[0] == 1.0


def test_an_ulp_of_tolerance_comes_to_an_end() -> None:
    """Flat bodies that no arithmetic shows to cross, at a tolerance of less than an ulp of the time."""
    a = gs.Boxes([[0, 0, 0]], [np.eye(3)], [[1, 1, 1]])
    b = gs.Boxes([[0.2, 0.3, 5]], [np.eye(3)], [[1, 2, 1]])
    answer = gs.first_contact(a, b, (0, 0, 1), (0, 0, 0), angular_velocity_a=(0, 0, 1), tolerance=1e-300)
    assert answer.time_lower[0] <= 3.0 <= answer.time_upper[0] <= answer.time_lower[0] + 1e-14
    assert len(answer.points) == 4


def test_scenes_have_the_same_sets() -> None:
    """Boxes, polygons and a capsule, whose round side lies on a face along its core."""
    lying = (0.0, np.sqrt(0.5), 0.0, np.sqrt(0.5))  # the axis z becomes x
    still_pose = (0.0, 0.0, 0.0, 1.0)
    turning = (0.0, 0.0, -1.0, 0.0, 0.0, 0.5)
    capsule_twist = (0.0, 0.0, -1.0, 0.0, 0.0, 0.25)
    scene = gs.Scene()
    scene.apply(
        gs.SceneUpdate(
            add=[
                gs.SceneObject("floor", gs.Box((20.0, 20.0, 1.0)), (0, 0, -1, *still_pose)),
                gs.SceneObject("box", gs.Box((1.0, 0.5, 0.25)), (-5, 0, 2.25, *still_pose), turning),
                gs.SceneObject("capsule", gs.Capsule(0.25, 2.0), (5, 0, 2.25, *lying), capsule_twist),
                gs.SceneObject("inside", gs.Box((1.0, 1.0, 1.0)), (0, 9, 0.5, *still_pose), turning),
            ]
        )
    )
    answer = scene.first_contacts(3.0)
    found = {frozenset((a, b)): k for k, (a, b) in enumerate(zip(answer.ids_a, answer.ids_b, strict=True))}
    sets = {
        name: answer.points[answer.point_offsets[k] : answer.point_offsets[k + 1]]
        for name in ("box", "capsule", "inside")
        for k in [found[frozenset((name, "floor"))]]
    }
    c, s = np.cos(1.0), np.sin(1.0)
    expected = [(-5 + c * x - s * y, s * x + c * y, 0) for x in (-1, 1) for y in (-0.5, 0.5)]
    assert len(sets["box"]) == 4 and far_from(sets["box"], np.array(expected)) <= 1e-5
    c, s = np.cos(0.5), np.sin(0.5)
    assert len(sets["capsule"]) == 2
    assert far_from(sets["capsule"], np.array([(5 + c * x, s * x, 0) for x in (-1, 1)])) <= 1e-5
    assert len(sets["inside"]) == 8
    none = scene.first_contacts(3.0, contact_set=False)
    assert not len(none.points) and np.array_equal(none.time, answer.time)
