# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""Cylinders, cones and ellipsoids: distances known by construction, laws, named cases, extremes of size."""

from __future__ import annotations

import itertools
import math
from collections import Counter
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from conftest import reproducer
from distance_scenes import any_turn, matrix_of, random_turn
from oracle import curved
from oracle.vectors import exact

import geomsrv as gs
from geomsrv import _core, _validate
from geomsrv.answers import DistanceStatus
from geomsrv.shapes import pack

CURVED = ("cylinder", "cone", "ellipsoid")
BOUNDED = ("sphere", "capsule", "box", "convex", *CURVED)
PAIRS = [pair for pair in itertools.product(BOUNDED, BOUNDED) if set(pair) & set(CURVED)]
DEEP = ("penetration",)
TIERS = ("float32", "float64", "exact")
UPRIGHT = [0.0, 0.0, 0.0, 1.0]

EPS = float(np.finfo(float).eps)

# No interval that is called OK may be wider than this times the reach of the scene: 8 times the 80 u of polytopes, and
# what the axes of solids of revolution may lean, some 60 u more on either side.
WIDEST = 800 * EPS / 2

# Where the boundary is flat to second order, a point beside the nearest one is as near but for the square of that.
BESIDE = 4 * math.sqrt(EPS)


def body(rng: np.random.Generator, kind: str) -> gs.Shape:
    """Of about 1 m, or thin, flat, a needle or a point."""
    size = rng.uniform(0.2, 1.0, 3)
    if rng.random() < 0.2:
        size[rng.integers(3)] *= 10.0 ** rng.uniform(-6.0, -1.0)
    if kind == "sphere":
        return gs.Sphere(size[0])
    if kind == "box":
        return gs.Box(size)
    if kind == "convex":
        return gs.Convex(rng.normal(size=(rng.integers(1, 12), 3)) * size)
    if kind == "ellipsoid":
        return gs.Ellipsoid(size if rng.random() < 0.7 else [size[0], size[0], size[2]])
    if rng.random() < 0.1 and kind != "capsule":
        size[rng.integers(2)] = 0.0
    return {"capsule": gs.Capsule, "cylinder": gs.Cylinder, "cone": gs.Cone}[kind](size[0], 2.0 * size[1])


def direction(rng: np.random.Generator, shape: gs.Shape) -> curved.Vector:
    """Along an axis, across one, on the side of a cone but for the rounding, or anywhere."""
    k = rng.integers(5)
    n = rng.normal(size=3)
    if k == 0:
        n = np.eye(3)[rng.integers(3)] * rng.choice([-1.0, 1.0])
    elif k == 1:
        n[rng.integers(3)] = 0.0
    elif k == 2 and isinstance(shape, gs.Cone) and shape.length > 0.0:
        turn = rng.uniform(0.0, 2.0 * math.pi)
        n = np.array([math.cos(turn), math.sin(turn), shape.radius / shape.length])
    return exact(n)


def mixed(rng: np.random.Generator) -> Any:
    """A point of a face, by weights that sum to 1."""

    def mix(points: list[curved.Vector]) -> curved.Vector:
        whole = rng.integers(0, 9, len(points))
        whole[rng.integers(len(points))] += 1
        total = int(whole.sum())
        weights = [Fraction(int(w), total) for w in whole]
        return tuple(sum(w * p[k] for w, p in zip(weights, points, strict=True)) for k in range(3))

    return mix


def turned(shape: gs.Shape, turn: np.ndarray) -> tuple[curved.Body, np.ndarray]:
    """The body at the origin, as the engine takes it, and its pose."""
    pose = _validate.poses(np.append(np.zeros(3), turn))[0]
    return curved.body_of(shape).at(matrix_of(pose), (0.0, 0.0, 0.0)), pose


LATTICE = np.array([UPRIGHT, [1.0, 0.0, 0.0, 0.0], [0.5, 0.5, 0.5, 0.5], [0.5, -0.5, 0.5, 0.5]])  # exact matrices


def turn_of(rng: np.random.Generator) -> np.ndarray:
    return LATTICE[rng.integers(len(LATTICE))] if rng.random() < 0.5 else any_turn(rng)


def reach_of(shape: gs.Shape) -> float:
    return float(gs.world.ShapeRow.of(shape).bounds[7])


def features(shape: gs.Shape, points: list[curved.Vector]) -> str:
    return f"{shape.kind} {'face' if len(points) > 2 else 'edge' if len(points) == 2 else 'point'}"


# ------------------------------------------------------------------------------------- known by construction


REACHED: Counter[str] = Counter()
KNOWN: Counter[tuple[str, str]] = Counter()


@pytest.mark.parametrize(("kind_a", "kind_b"), PAIRS)
def test_distance_known_by_construction(rng: np.random.Generator, kind_a: str, kind_b: str) -> None:
    """The highest point of a below the lowest of b: far, near, and touching to the last bit."""
    seen: Counter[str] = Counter()
    for _ in range(30):
        a, b = body(rng, kind_a), body(rng, kind_b)
        body_b, pose = turned(b, turn_of(rng))
        n = direction(rng, a)
        if rng.random() < 0.5:
            n = tuple(-x for x in body_b.world(direction(rng, b)))
        apart = exact(float(rng.choice([1.0, 1e-3, 1e-9, 0.0])))
        placed = curved.facing(curved.body_of(a), body_b, n, apart, mixed(rng))
        pose[:3] = [float(x) for x in placed.b.place]
        seen[features(a, curved.faces(placed.a, n))] += 1
        seen[features(b, curved.faces(placed.b, tuple(-x for x in n)))] += 1
        size = reach_of(a) + reach_of(b) + float(np.linalg.norm(pose[:3]))
        info = reproducer(a=repr(a.__dict__), b=repr(b.__dict__), pose=pose, low=float(placed.low))
        for tier in TIERS:
            # The pose is normalised already: that the engine does so again must change nothing.
            answer = _core.distance_pairs(*pack([a, b]), np.array([[0, 1]]), pose[None], True, tier)
            distance, lower, upper, point_a, point_b, normal, status = (column[0] for column in answer[:7])
            assert lower <= placed.high and upper >= placed.low, info
            assert lower <= distance <= upper, info
            assert status == DistanceStatus.OK and upper - lower <= WIDEST * size, info
            assert abs(np.linalg.norm(point_b - point_a) - abs(distance)) <= BESIDE * size, info
            assert abs((point_b - point_a) @ normal - distance) <= 2 * WIDEST * size, info
            flat = _core.distance_pairs(*pack([a, b]), np.array([[0, 1]]), pose[None], False, tier)
            assert flat[1][0] <= max(placed.high, 0) and flat[2][0] >= max(placed.low, 0), info
            if apart >= Fraction(1, 10**6):
                assert not gs.intersects(a, b, pose, accuracy=tier).value[0], info
                assert gs.intersects(a, b, pose, accuracy=tier).certain[0], info
        assert gs.distance(a, b, pose, accuracy="bound").lower[0] <= placed.high, info
    REACHED.update(seen)
    if "cylinder" in (kind_a, kind_b):
        assert seen["cylinder edge"], seen


def best_gap(rng: np.random.Generator, a: curved.Body, b: curved.Body, n: curved.Vector) -> Fraction:
    """Largest gap along directions about n, near and far."""
    along = np.array([float(x) for x in n])
    along /= np.linalg.norm(along)
    best = Fraction(-(10**9))
    for k in range(30):
        size = 10.0 ** rng.uniform(-8.0, 0.0) if k < 20 else 1e3
        best = max(best, curved.gap(a, b, exact(along + size * rng.normal(size=3))))
    return best


@pytest.mark.parametrize(("kind_a", "kind_b"), PAIRS)
def test_depth_known_by_construction(rng: np.random.Generator, kind_a: str, kind_b: str) -> None:
    """Pushed a little into each other along a common normal, where nothing parts them sooner."""
    known = deep = 0
    for _ in range(20):
        a, b = body(rng, kind_a), body(rng, kind_b)
        body_b, pose = turned(b, turn_of(rng))
        n = direction(rng, a)
        depth = exact(float(rng.choice([1e-2, 1e-6, 1e-11])))
        placed = curved.facing(curved.body_of(a), body_b, n, -depth, mixed(rng))
        pose[:3] = [float(x) for x in placed.b.place]
        size = reach_of(a) + reach_of(b) + float(np.linalg.norm(pose[:3]))
        sure = best_gap(rng, placed.a, placed.b, n) <= placed.low
        info = reproducer(a=repr(a.__dict__), b=repr(b.__dict__), pose=pose, low=float(placed.low))
        for tier in TIERS:
            answer = _core.distance_pairs(*pack([a, b]), np.array([[0, 1]]), pose[None], True, tier)
            distance, lower, upper, point_a, point_b, normal, status = (column[0] for column in answer[:7])
            assert lower <= distance <= upper and upper >= placed.low, info
            if status == DistanceStatus.OK:
                assert upper - lower <= WIDEST * size, info
            own = curved.gap(placed.a, placed.b, exact(normal))
            assert lower <= own, info
            sure = sure and own <= placed.high
            if sure:
                assert lower <= placed.high, info
            # Moved by the depth along the normal, the bodies are parted: an exact direction, an exact place.
            axis = exact(normal)
            step = exact(float(-lower))
            out = placed.b._replace(place=curved.add(placed.b.place, curved.scale(step / curved.norm(axis), axis)))
            assert curved.gap(placed.a, out, axis) >= -Fraction(WIDEST * size), info
            assert abs((point_b - point_a) @ normal - distance) <= 2 * WIDEST * size + upper - lower, info
            meet = gs.intersects(a, b, pose, accuracy=tier)
            assert meet.value[0] or not meet.certain[0] or not sure, info
            deep += bool(meet.certain[0])
        known += sure
    KNOWN[kind_a, kind_b] = known
    assert deep >= 10, (known, deep)


def test_depths_were_known() -> None:
    """After all pairs: tips that are pushed into each other are parted sideways, but most depths are as built."""
    if len(KNOWN) < len(PAIRS):
        pytest.skip("not all pairs were run")
    assert sum(KNOWN.values()) > 5 * len(PAIRS), KNOWN


def test_all_features_were_met() -> None:
    """After all pairs: faces, edges and points of each kind of which there are any."""
    if sum(REACHED.values()) < 2 * 30 * len(PAIRS):
        pytest.skip("not all pairs were run")
    for kind, parts in (("cylinder", "face edge point"), ("cone", "face point"), ("box", "face edge point")):
        assert all(REACHED[f"{kind} {part}"] >= 3 for part in parts.split()), REACHED


def test_half_spaces(rng: np.random.Generator) -> None:
    for kind, _ in itertools.product(CURVED, range(100)):
        shape, plane = body(rng, kind), gs.HalfSpace(rng.normal(size=3), rng.normal())
        held, pose = turned(shape, any_turn(rng))
        pose[:3] = rng.normal(size=3)
        held = held._replace(place=exact(pose[:3]))
        normal = exact(plane.normal)
        down = tuple(-x for x in normal)
        expected = (-curved.support(held, down) - exact(plane.offset)) / curved.norm(normal)
        for tier, (first, second, at) in itertools.product(TIERS, ((plane, shape, pose), (shape, plane, None))):
            if at is None:  # the same seen from the shape: the pose of the plane in it
                x, y, z, w = pose[3:]
                back = np.array([-x, -y, -z, w])
                at = np.append(-matrix_of(np.append(np.zeros(3), back)) @ pose[:3], back)
            answer = gs.distance(first, second, at, want=DEEP, accuracy=tier)
            slack = 0.0 if first is plane else 1e-14
            info = reproducer(shape=repr(shape.__dict__), normal=plane.normal, offset=plane.offset, pose=pose)
            assert answer.status[0] == DistanceStatus.OK, info
            assert answer.lower[0] - slack <= expected <= answer.upper[0] + slack, info
            assert answer.upper[0] - answer.lower[0] <= 1e-13, info
            bound = gs.distance(first, second, at, accuracy="bound")
            assert bound.lower[0] - slack <= max(expected, 0), info


# ------------------------------------------------------------------------------------------------------- laws


def scene(rng: np.random.Generator, kind_a: str, kind_b: str) -> tuple[gs.Shape, gs.Shape, np.ndarray]:
    a, b = body(rng, kind_a), body(rng, kind_b)
    return a, b, np.append(rng.normal(size=3) * rng.choice([0.1, 0.6, 2.0]), any_turn(rng))


@pytest.mark.parametrize(("kind_a", "kind_b"), PAIRS)
def test_laws(rng: np.random.Generator, kind_a: str, kind_b: str) -> None:
    """Swap, scale by a power of two, another scale, and growth by a radius."""
    outcomes: Counter[int] = Counter()
    for _ in range(15):
        a, b, pose = scene(rng, kind_a, kind_b)
        info = reproducer(a=repr(a.__dict__), b=repr(b.__dict__), pose=pose)
        answer = gs.distance(a, b, pose, want=DEEP)
        outcomes[int(np.sign(answer.distance[0]))] += 1
        slack = 2e-14 * (reach_of(a) + reach_of(b) + float(np.linalg.norm(pose[:3])))
        x, y, z, w = pose[3:]
        back = np.array([-x, -y, -z, w])
        swapped = gs.distance(b, a, np.append(-matrix_of(np.append(np.zeros(3), back)) @ pose[:3], back), want=DEEP)
        assert swapped.lower[0] - slack <= answer.upper[0] and answer.lower[0] <= swapped.upper[0] + slack, info
        for factor in (2.0**-20, 2.0**20, 1e-6, 1e6):
            sized = gs.distance(scaled(a, factor), scaled(b, factor), np.append(factor * pose[:3], pose[3:]), want=DEEP)
            low, high = sized.lower[0] / factor, sized.upper[0] / factor
            assert low - slack <= answer.upper[0] and answer.lower[0] <= high + slack, info
            if factor in (2.0**-20, 2.0**20):
                assert sized.distance[0] / factor == answer.distance[0], info
        # An ellipsoid that is a ball, and a cylinder without a radius, are other shapes too.
        ball = gs.distance(gs.Ellipsoid([0.3] * 3), b, pose, want=DEEP)
        other = gs.distance(gs.Sphere(0.3), b, pose, want=DEEP)
        assert ball.lower[0] <= other.upper[0] and other.lower[0] <= ball.upper[0], info
        rod = gs.distance(gs.Cylinder(0.0, 0.8), b, pose, want=DEEP)
        other = gs.distance(gs.Capsule(0.0, 0.8), b, pose, want=DEEP)
        assert rod.lower[0] <= other.upper[0] and other.lower[0] <= rod.upper[0], info
        # A ball added to b takes its radius off the distance.
        grown = gs.distance(gs.Sphere(0.125), b, pose, want=DEEP)
        point = gs.distance(gs.Sphere(0.0), b, pose, want=DEEP)
        assert grown.lower[0] <= point.upper[0] - 0.125 + slack and point.lower[0] - 0.125 - slack <= grown.upper[0], (
            info
        )
    assert outcomes[1] and outcomes[-1], outcomes


def scaled(shape: gs.Shape, factor: float) -> gs.Shape:
    if isinstance(shape, gs.Sphere):
        return gs.Sphere(factor * shape.radius)
    if isinstance(shape, gs.Box):
        return gs.Box(factor * shape.half_extents)
    if isinstance(shape, gs.Convex):
        return gs.Convex(factor * shape.vertices)
    if isinstance(shape, gs.Ellipsoid):
        return gs.Ellipsoid(factor * shape.radii)
    return type(shape)(factor * shape.radius, factor * shape.length)  # type: ignore[call-arg,attr-defined]


def test_no_direction_beats_the_answer(rng: np.random.Generator) -> None:
    """Bodies anywhere: exact gaps along many directions are lower bounds, and the answer's normal attains the best."""
    for (kind_a, kind_b), _ in itertools.product(PAIRS, range(4)):
        a, b, pose = scene(rng, kind_a, kind_b)
        pose = _validate.poses(pose)[0]
        placed = curved.body_of(b).at(matrix_of(pose), pose[:3])
        answer = gs.distance(a, b, pose, want=DEEP)
        info = reproducer(a=repr(a.__dict__), b=repr(b.__dict__), pose=pose)
        own = curved.gap(curved.body_of(a), placed, exact(answer.normal[0]))
        assert own >= Fraction(float(answer.lower[0])) - Fraction(WIDEST * 5.0), info
        assert best_gap(rng, curved.body_of(a), placed, exact(answer.normal[0])) <= answer.upper[0], info


def test_boxes_and_cylinders_inside_and_around_each_other(rng: np.random.Generator) -> None:
    """A larger body is nearer: a cylinder between its inscribed prism and the box around it."""
    for _ in range(100):
        radius, half = rng.uniform(0.2, 1.0, 2)
        angles = np.arange(64) * (2.0 * math.pi / 64)
        ring = radius * np.column_stack([np.cos(angles), np.sin(angles)])
        prism = gs.Convex(np.array([[x, y, z] for x, y in ring for z in (-half, half)]))
        other = body(rng, str(rng.choice(BOUNDED)))
        pose = np.append(rng.normal(size=3), random_turn(rng))
        inner, real, outer = (
            gs.distance(shape, other, pose, want=DEEP)
            for shape in (prism, gs.Cylinder(radius, 2.0 * half), gs.Box([radius, radius, half]))
        )
        assert outer.lower[0] <= real.upper[0] and real.lower[0] <= inner.upper[0] + 1e-15
        assert inner.distance[0] - real.distance[0] <= radius * (1.0 - math.cos(math.pi / 64)) + 1e-12


# ------------------------------------------------------------------------------------------------ named cases

CAN, CONE, EGG = gs.Cylinder(0.3, 0.8), gs.Cone(0.3, 0.9), gs.Ellipsoid([0.2, 0.3, 0.5])
FLIPPED = [1.0, 0.0, 0.0, 0.0]
LYING = [math.sqrt(0.5), 0.0, 0.0, math.sqrt(0.5)]
NAMED = {
    "cans one above the other": (CAN, CAN, [0, 0, 1.0, *UPRIGHT], 0.2),
    "cans that stand on each other": (CAN, CAN, [0, 0, 0.8, *UPRIGHT], 0.0),
    "cans side by side": (CAN, CAN, [0.7, 0, 0.2, *UPRIGHT], 0.1),
    "cans that touch along a line": (CAN, CAN, [0.6, 0, 0.2, *UPRIGHT], 0.0),
    "cans rim to rim": (CAN, CAN, [0.9, 0, 1.2, *UPRIGHT], 0.5),
    "one can": (CAN, CAN, [0, 0, 0, *UPRIGHT], -0.6),
    "can in a can": (gs.Cylinder(0.1, 0.2), CAN, [0.05, 0, 0.1, *UPRIGHT], -0.35),
    "cans that nearly are one": (CAN, CAN, [0, 0, 0, 1e-9, 0, 0, 1.0], -0.6),
    "cans across": (CAN, CAN, [0, 0, 0, *LYING], -0.6),
    "cones tip to tip": (CONE, CONE, [0, 0, 1.0, *FLIPPED], 0.1),
    "cones base to base": (CONE, CONE, [0, 0, -1.0, *FLIPPED], 0.1),
    "cones in each other": (CONE, CONE, [0, 0, 0.9, *UPRIGHT], 0.0),
    "tip in a can": (CAN, CONE, [0, 0, 0.75, *FLIPPED], -0.1),
    "ball over a tip": (gs.Sphere(0.1), CONE, [0, 0, -1.0, *UPRIGHT], 0.45),
    "ball in the middle of a can": (gs.Sphere(0.1), CAN, [0, 0, 0, *UPRIGHT], -0.4),
    "ball beside a can": (gs.Sphere(0.1), CAN, [0.6, 0.8, 0.1, *UPRIGHT], 0.6),
    "ball beyond a rim": (gs.Sphere(0.1), CAN, [0.6, 0, 0.8, *UPRIGHT], 0.4),
    "eggs along an axis": (EGG, EGG, [0, 0, 1.25, *UPRIGHT], 0.25),
    "eggs along another": (EGG, EGG, [0.5, 0, 0, *UPRIGHT], 0.1),
    "one egg": (EGG, EGG, [0, 0, 0, *UPRIGHT], -0.4),
    "egg and a wall": (gs.Box([1, 1, 1]), EGG, [0, 1.5, 0, *UPRIGHT], 0.2),
    "egg that touches a wall": (gs.Box([1, 1, 1]), EGG, [0, 0, 1.5, *UPRIGHT], 0.0),
    "can on a table": (gs.Box([1, 1, 1]), CAN, [0.2, 0.3, 1.4, *UPRIGHT], 0.0),
    "can in a table": (gs.Box([1, 1, 1]), CAN, [0.2, 0.3, 1.39, *UPRIGHT], -0.01),
    "can lying on a table": (gs.Box([1, 1, 1]), CAN, [0.2, 0.3, 1.3, *LYING], 0.0),
    "one disc": (gs.Cylinder(0.5, 0.0), gs.Cylinder(0.5, 0.0), [0.2, 0, 0, *UPRIGHT], 0.0),
    "disc over a disc": (gs.Cylinder(0.5, 0.0), gs.Cylinder(0.5, 0.0), [0.2, 0, 0.3, *UPRIGHT], 0.3),
    "disc beside a disc": (gs.Cylinder(0.5, 0.0), gs.Cylinder(0.5, 0.0), [1.25, 0, 0, *UPRIGHT], 0.25),
    "points": (gs.Cylinder(0.0, 0.0), gs.Cone(0.0, 0.0), [3, 4, 0, *UPRIGHT], 5.0),
    "one point": (gs.Cylinder(0.0, 0.0), gs.Cone(0.0, 0.0), [0, 0, 0, *UPRIGHT], 0.0),
    "triangle in a can": (gs.Triangle([0, 0, 0], [1, 0, 0], [0, 1, 0]), CAN, [0.1, 0.1, 0.4, *UPRIGHT], 0.0),
    "segment beside a can": (gs.Segment([0.5, -1, 0], [0.5, 1, 0]), CAN, [0, 0, 0, *UPRIGHT], 0.2),
}


@pytest.mark.parametrize("tier", TIERS)
@pytest.mark.parametrize("name", NAMED)
def test_named(name: str, tier: str) -> None:
    a, b, pose, expected = NAMED[name]
    for first, second, turn in ((a, b, 1.0), (b, a, -1.0)):
        at = np.array(pose, dtype=float)
        if turn < 0.0:
            at[3:6] *= -1.0
            at[:3] = -matrix_of(_validate.poses(at)[0]) @ at[:3]
        answer = gs.distance(first, second, at, want=DEEP, accuracy=tier)
        assert answer.status[0] == DistanceStatus.OK
        assert answer.lower[0] - 1e-15 <= expected <= answer.upper[0] + 1e-15
        assert answer.upper[0] - answer.lower[0] <= 2e-13 and abs(answer.distance[0] - expected) <= 1e-13
        flat = gs.distance(first, second, at, accuracy=tier)
        assert flat.status[0] == DistanceStatus.OK and abs(flat.distance[0] - max(expected, 0.0)) <= 1e-13
        assert np.isfinite(flat.lower[0]) and np.isfinite(flat.upper[0])
        meet = gs.intersects(first, second, at, accuracy=tier)
        if abs(expected) > 1e-12:
            assert meet.value[0] == (expected < 0.0) and meet.certain[0]
        else:
            assert meet.value[0] or not meet.certain[0]


def test_equally_deep_all_around() -> None:
    """Leaning just so that the boundary is nearly as near all around: the bracket holds, and says that it is wide."""
    deep, wide = gs.Cylinder(0.3, 4.0), gs.Capsule(0.1, 1.0)
    lean = np.array([0.0, 0.0, 0.0, 1e-7, 0.0, 0.0, 1.0])
    answer = gs.distance(deep, wide, lean, want=DEEP)
    assert answer.lower[0] <= -0.4 <= answer.upper[0]
    assert answer.upper[0] - answer.lower[0] <= 1e-5


@pytest.mark.parametrize("far", [1e3, 1e6, 1e12])
def test_far_away(rng: np.random.Generator, far: float) -> None:
    for kind_a, kind_b in PAIRS:
        a, b = body(rng, kind_a), body(rng, kind_b)
        body_b, pose = turned(b, any_turn(rng))
        placed = curved.facing(curved.body_of(a), body_b, direction(rng, a), exact(far), mixed(rng))
        pose[:3] = [float(x) for x in placed.b.place]
        answer = gs.distance(a, b, pose)
        assert answer.status[0] == DistanceStatus.OK
        assert answer.lower[0] <= placed.high and answer.upper[0] >= placed.low
        assert answer.upper[0] - answer.lower[0] <= WIDEST * (far + 8.0)


@pytest.mark.parametrize("size_a", [1e-300, 1e-6, 1.0, 1e6, 1e300])
@pytest.mark.parametrize("size_b", [1e-320, 1e-6, 1e6, 1e300])
def test_sizes_from_one_end_of_the_number_range_to_the_other(size_a: float, size_b: float) -> None:
    makers = (
        lambda s: gs.Cylinder(s, s),
        lambda s: gs.Cone(s, s),
        lambda s: gs.Ellipsoid([s, 0.5 * s or s, s]),
        lambda s: gs.Box([s, s, s]),
        lambda s: gs.Sphere(s),
        lambda s: gs.HalfSpace([0, 0, 1], s),
    )
    for (first, second), tier in itertools.product(itertools.product(makers, makers), ("bound", *TIERS)):
        a, b = first(size_a), second(size_b)
        if not {a.kind, b.kind} & set(CURVED):
            continue
        for far in (0.0, 4.0 * max(size_a, size_b)):
            for want in ((), DEEP):
                answer = gs.distance(a, b, [0, 0, far, 0.1, 0.7, 0.1, 0.7], accuracy=tier, want=want)
                info = (a.kind, b.kind, size_a, size_b, far, tier, want)
                assert answer.lower[0] <= answer.distance[0] <= answer.upper[0], info
                assert answer.status[0] != DistanceStatus.UNSUPPORTED, info
                if far and "half_space" not in (a.kind, b.kind) and tier != "bound":
                    assert answer.distance[0] > 0.0, info


def test_the_work_is_bounded(rng: np.random.Generator) -> None:
    """However it ends, it ends: no pair takes more rounds than are allowed, and its bracket holds."""
    for _ in range(20):
        shape = gs.Ellipsoid([0.3, 0.3, 0.3 * (1.0 + 10.0 ** rng.uniform(-12, -1))])
        pose = np.append(1e-9 * rng.normal(size=3), random_turn(rng))
        _, iterations = _core.distance_pairs_stages(*pack([shape, shape]), np.array([[0, 1]]), pose[None], True)
        answer = gs.distance(shape, shape, pose, want=DEEP)
        assert iterations[0] <= 2000
        assert answer.lower[0] <= -0.6 + 1e-8 and answer.upper[0] >= -2.0 * float(shape.radii.max())
        assert answer.upper[0] - answer.lower[0] <= 1e-2


def test_certificates_claim_nothing() -> None:
    """There is no record that exact arithmetic could check, and so none that claims."""
    answer = gs.distance(CAN, gs.Sphere(0.1), [[2, 0, 0, *UPRIGHT], [0, 0, 0, *UPRIGHT]], certificates=True)
    assert [record["claim"] for record in answer.certificates or ()] == [{}, {}]
    gs.verify(answer)
    meet = gs.intersects(CAN, CONE, [0, 0, 3, *UPRIGHT], certificates=True)
    assert not meet.value[0] and meet.certain[0] and [r["claim"] for r in meet.certificates or ()] == [{}]


def test_the_ways_to_an_answer() -> None:
    """Parallel axes, hulls from inside, the hull of the difference."""
    stages = {}
    for name, (a, b, pose) in {
        "parallel": (CAN, CAN, [0, 0, 1.0, *UPRIGHT]),
        "apart": (CAN, CAN, [0, 0, 2.0, *LYING]),
        "deep": (CAN, CONE, [0.1, 0.2, 0.1, 0.1, 0.7, 0.1, 0.7]),
    }.items():
        at = _validate.poses(np.array(pose, dtype=float))
        stages[name] = int(_core.distance_pairs_stages(*pack([a, b]), np.array([[0, 1]]), at, True)[0][0])
    assert stages == {"parallel": 1, "apart": 2, "deep": 5}
