# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""Distance of solids at the tiers "bound" and "float32": what they say holds at every size; judged by the oracle."""

from __future__ import annotations

import itertools
import math
import os
from collections import Counter
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from conftest import reproducer
from distance_scenes import (
    EPS,
    HULLS,
    any_turn,
    box_pair,
    core,
    exact_half_space,
    hull,
    hull_pair,
    in_interval,
    ordinary_hull,
    posed,
    random_turn,
    rotation,
    shape,
    shape_pose,
)
from oracle import polytope, vectors

import geomsrv as gs
from geomsrv import _validate

DEEP = ("penetration",)
SOAK = 20 if os.environ.get("GEOMSRV_SOAK") else 1
TIERS = ("bound", "float32")
KINDS = ("sphere", "capsule", "box", "convex", "half_space", "frustum")
PAIRS = [pair for pair in itertools.combinations_with_replacement(KINDS, 2) if pair != ("half_space", "half_space")]

# From 1e-300 to 1e300; powers of two, so that bodies that touch go on touching.
SCALES = (1.0, 2.0**-997, 2.0**-40, 2.0**60, 2.0**996)

# No interval of float32 that is called OK may be wider than this times the reach of the scene: kPromisedWidth, 80 units
# of 2^-24, three times the two of a vertex, and as much again as doubles take; see single_core.cpp.
WIDEST = 100 * 2.0**-24

# Points are proven to bound the distance, not where they are: on slivers of 1 : 1000 a thousandth of 2^-24 shows.
POINTS = 2.0**-12


class Tally(Counter[str]):
    def require(self, **least: int) -> None:
        print(dict(self))
        assert all(self[name] >= count for name, count in least.items()), (dict(self), least)


def check(a: Any, b: Any, pose: np.ndarray | None, square: Fraction, radii: Fraction, reach: float) -> Tally:
    """All that both tiers promise about one pair, with depth and without; what was seen."""
    seen = Tally()
    text = reproducer(a=vars(a), b=vars(b), pose=pose)
    relation = vectors.compare_root(radii, square)
    seen["apart" if relation < 0 else "overlapping" if relation > 0 else "touching"] += 1
    for tier in TIERS:
        deep, plain = (gs.distance(a, b, pose, want=want, accuracy=tier) for want in (DEEP, ()))
        meet = gs.intersects(a, b, pose, accuracy=tier)
        low, value, high = (float(x[0]) for x in (deep.lower, deep.distance, deep.upper))
        assert low <= value <= high, (tier, low, value, high, text)
        assert in_interval(square, radii, low, high), (tier, low, high, text)
        flat = (float(plain.lower[0]), float(plain.distance[0]), float(plain.upper[0]))
        assert 0.0 <= flat[0] <= flat[1] <= flat[2], (tier, flat, text)
        positive = (square, radii) if relation < 0 else (Fraction(0), Fraction(0))
        assert in_interval(*positive, flat[0], flat[2]), (tier, flat, text)
        assert not meet.certain[0] or meet.value[0] == (relation >= 0), (tier, text)
        seen[f"{tier}_certain"] += bool(meet.certain[0])
        if tier == "bound":
            # Never misses a contact, and the distance is the lower bound.
            assert meet.value[0] or relation < 0, text
            assert value == low and flat[0] == flat[1] == max(low, 0.0), (low, value, flat, text)
            seen["bound_parts"] += bool(low > 0.0)
            continue
        assert deep.cost.counts["filter"] == 1
        seen["ok"] += deep.status[0] == gs.DistanceStatus.OK
        if deep.status[0] == gs.DistanceStatus.OK:
            assert high - low <= WIDEST * reach + 8 * 5e-324, (high - low, reach, text)
            assert abs(np.linalg.norm(deep.normal[0]) - 1.0) <= 4 * EPS, text
            gap = (deep.point_b[0] - deep.point_a[0] - value * deep.normal[0]) / reach
            assert np.abs(gap).max() <= POINTS, (gap, text)
    return seen


# ------------------------------------------------------------------------------------------------- shapes at poses


def solid(rng: np.random.Generator, kind: str) -> Any:
    if kind != "frustum":
        return shape(rng, kind)
    near = float(rng.choice([0.25, rng.uniform(0.1, 1.0)]))
    window = np.sort(rng.uniform(-1.0, 1.0, (2, 2)), axis=1) + [[0.0, 1e-3]]
    axes = rotation(any_turn(rng))
    far = near * float(rng.choice([2.0, 4.0, 1e3]))
    return gs.Frustum(rng.choice([0.0, 0.5], 3), axes, near=near, far=far, bounds=window.ravel() * near)


def scaled(body: Any, scale: float) -> Any:
    if isinstance(body, gs.Sphere):
        return gs.Sphere(body.radius * scale)
    if isinstance(body, gs.Capsule):
        return gs.Capsule(body.radius * scale, body.length * scale)
    if isinstance(body, gs.Box):
        return gs.Box(body.half_extents * scale)
    if isinstance(body, gs.Boxes):
        return gs.Boxes(body.center * scale, body.axes, body.half_extents * scale)
    if isinstance(body, gs.Polytopes):
        return gs.Polytopes(body.vertices * scale, body.offsets)
    if isinstance(body, gs.HalfSpace):
        return gs.HalfSpace(body.normal, body.offset * scale)
    if isinstance(body, gs.Frustum):
        window = np.array(body.bounds) * scale
        return gs.Frustum(body.origin * scale, body.axes, near=body.near * scale, far=body.far * scale, bounds=window)
    return gs.Convex(body.vertices * scale)


def truth(a: Any, b: Any, pose: np.ndarray) -> tuple[Fraction, Fraction]:
    """Signed square of the distance of the cores, and the radii."""
    if isinstance(a, gs.HalfSpace) or isinstance(b, gs.HalfSpace):
        return exact_half_space((a, np.eye(3), np.zeros(3)), (b, rotation(pose[3:]), pose[:3]))
    (vertices_a, radius_a), (vertices_b, radius_b) = core(a), core(b)
    square = polytope.separation([vectors.exact(v) for v in vertices_a], posed(vertices_b, pose)).signed_square
    return square, Fraction(radius_a) + Fraction(radius_b)


def size_of(body: Any) -> float:
    """How far from its own origin a body goes, or the plane of a half space lies."""
    if isinstance(body, gs.HalfSpace):
        return abs(body.offset)
    vertices, radius = core(body)
    return max(math.hypot(*(float(x) for x in v)) for v in vertices) + radius


@pytest.mark.parametrize(("kind_a", "kind_b"), PAIRS)
def test_shapes_at_poses(kind_a: str, kind_b: str, rng: np.random.Generator) -> None:
    """Both orders; apart, touching, deep, degenerate; from one end of the numbers to the other."""
    tally = Tally()
    for i in range(15 * SOAK):
        a, b = solid(rng, kind_a), solid(rng, kind_b)
        if rng.random() < 0.5:
            a, b = b, a
        pose = shape_pose(rng, a, b)
        if rng.random() < 0.3:
            pose[:3] += rng.normal(size=3) * 10.0 ** rng.uniform(0.0, 3.0)
        scale = SCALES[i % len(SCALES)]
        a, b, pose = scaled(a, scale), scaled(b, scale), np.append(pose[:3] * scale, pose[3:])
        # Twice, for what is on either side of the middle of a body.
        reach = 2 * (size_of(a) + size_of(b)) + math.hypot(*(pose[:3] / scale)) * scale
        tally += check(a, b, pose, *truth(a, b, pose), max(reach, 1e-300))
    print(dict(tally))
    count = 15 * SOAK
    assert tally["ok"] >= 0.9 * count and tally["float32_certain"] >= 0.2 * count, tally
    assert tally["apart"] > 0, tally


def test_half_spaces_are_answered_as_by_doubles(rng: np.random.Generator) -> None:
    """They are their own bounding volumes, and have no size to be rounded at."""
    up = gs.HalfSpace([0, 0, 1], 1.0)
    for other in (gs.HalfSpace([0, 0, -1], -1.5), gs.HalfSpace([0, 0, -1], 2.0), gs.HalfSpace([0, 0, 1], 5.0)):
        for turn in ([0, 0, 0, 1], [1, 0, 0, 0], random_turn(rng)):
            pose = [*rng.normal(size=3), *turn]
            answers = [gs.distance(up, other, pose, want=DEEP, accuracy=tier) for tier in (*TIERS, "float64")]
            for name in ("distance", "lower", "upper", "normal", "status"):
                values = [getattr(answer, name) for answer in answers]
                if name == "distance":
                    values[0] = values[1]  # of "bound" that is the lower bound
                if name == "normal":
                    values[0] = values[1]
                assert all(np.array_equal(values[0], value, equal_nan=True) for value in values), name


@pytest.mark.parametrize("tier", TIERS)
def test_other_pairs_are_unsupported(tier: str) -> None:
    answer = gs.distance(gs.Mesh(np.eye(3), [[0, 1, 2]]), gs.Sphere(1.0), [9, 0, 0, 0, 0, 0, 1], accuracy=tier)
    assert answer.status[0] == gs.DistanceStatus.UNSUPPORTED and np.isnan(answer.distance[0])


@pytest.mark.parametrize("size_a", [5e-324, 1e-300, 1.0, 1e300])
@pytest.mark.parametrize("size_b", [1e-320, 1e-20, 1e20, 1e300])
def test_sizes_from_one_end_of_the_number_range_to_the_other(size_a: float, size_b: float) -> None:
    tetrahedron = np.concatenate([np.eye(3), np.zeros((1, 3))])
    pairs: list[tuple[Any, Any]] = [
        (gs.Sphere(size_a), gs.Sphere(size_b)),
        (gs.Sphere(size_a), gs.Capsule(size_b, size_b)),
        (gs.Capsule(size_a, size_b), gs.Capsule(size_b, size_a)),
        (gs.Sphere(size_a), gs.Box([size_b] * 3)),
        (gs.Box([size_a] * 3), gs.Box([size_b] * 3)),
        (gs.Convex(tetrahedron * size_a), gs.Convex(tetrahedron * size_b)),
        (gs.HalfSpace([0, 0, 1], size_a), gs.Box([size_b] * 3)),
        (gs.HalfSpace([0, 0, 1], size_a), gs.Capsule(size_b, size_b)),
        (gs.Convex(tetrahedron * size_a), gs.HalfSpace([0.6, 0, 0.8], size_b)),
    ]
    for (a, b), position, turn in itertools.product(pairs, (0.0, 1e-300, 1e300), ([0, 0, 0, 1.0], [0.6, 0, 0.8, 0])):
        pose = np.array([position, 0.0, position / 3.0, *turn])
        assert np.array_equal(pose, _validate.poses(pose)[0])
        reach = 4.0 * (size_a + size_b) + 2.0 * position if max(size_a, size_b, position) < 1e300 else math.inf
        check(a, b, pose, *truth(a, b, pose), reach)


# ---------------------------------------------------------------------------------------------------- batches


def corners_of(body: Any) -> list[vectors.Vector]:
    if isinstance(body, gs.Boxes):
        return polytope.box_corners(*(x[0].tolist() for x in (body.center, body.axes, body.half_extents)))
    return [vectors.exact(v) for v in (core(body)[0] if isinstance(body, gs.Frustum) else body.vertices.tolist())]


def check_batch(a: Any, b: Any, place: np.ndarray) -> Tally:
    """`place` is what the bodies are around."""
    exact_a, exact_b = corners_of(a), corners_of(b)
    middle = vectors.exact(place.tolist())
    sizes = [max(math.hypot(*map(float, vectors.sub(v, middle))) for v in corners) for corners in (exact_a, exact_b)]
    square = polytope.separation(exact_a, exact_b).signed_square
    return check(a, b, None, square, Fraction(0), max(3 * sum(sizes), 1e-300))


def test_boxes(rng: np.random.Generator) -> None:
    tally = Tally()
    for i in range(60 * SOAK):
        half_a, axes_a, center, half_b, axes_b = box_pair(rng)
        scale = SCALES[i % len(SCALES)]
        place = rng.choice([0.0, 0.0, 1.0, 500.0, 1e6]) * rng.normal(size=3) * scale
        a = gs.Boxes([place], [axes_a], [half_a * scale])
        tally += check_batch(a, gs.Boxes([center * scale + place], [axes_b], [half_b * scale]), place)
    tally.require(apart=12, overlapping=12, ok=50, float32_certain=20, bound_certain=1)


@pytest.mark.parametrize("kind", HULLS)
def test_hulls(kind: str, rng: np.random.Generator) -> None:
    tally = Tally()
    for i in range(15 * SOAK):
        a, b = hull_pair(rng, kind)
        scale, place = SCALES[i % len(SCALES)], rng.choice([0.0, 0.0, 1.0, 500.0]) * rng.normal(size=3)
        bodies = [gs.Polytopes.from_list([(x + place) * scale]) for x in (a, b)]
        tally += check_batch(*bodies, place * scale)
    tally.require(apart=2, ok=11)


@pytest.mark.parametrize("other", ["boxes", "polytopes", "frustum"])
def test_frusta(other: str, rng: np.random.Generator) -> None:
    tally = Tally()
    for i in range(15 * SOAK):
        scale = SCALES[i % len(SCALES)]
        a, b = solid(rng, "frustum"), solid(rng, "frustum")
        place = np.mean(a.corners(), axis=0) + rng.normal(size=3) * rng.choice([0.1, 1.0, 10.0])
        if other == "boxes":
            b = gs.Boxes([place], [rotation(any_turn(rng)).T], [[0.5, 0.25, 1.0]])
        elif other == "polytopes":
            b = gs.Polytopes.from_list([hull(rng, "block") + place])
        pair = [scaled(body, scale) for body in ((a, b) if rng.random() < 0.5 else (b, a))]
        tally += check_batch(*pair, np.zeros(3))
    tally.require(apart=3, ok=12)


# ------------------------------------------------------------------------------------------------------ float32


def crowd(rng: np.random.Generator, count: int) -> tuple[gs.Boxes, gs.Boxes]:
    """Pairs of boxes of about a metre, a metre or so apart."""
    axes = [np.stack([rotation(random_turn(rng)).T for _ in range(count)]) for _ in range(2)]
    half = rng.uniform(0.2, 0.8, (2, count, 3))
    center = np.round(rng.normal(size=(count, 3)) * 1.5 * 2.0**20) / 2.0**20
    return gs.Boxes(np.zeros((count, 3)), axes[0], half[0]), gs.Boxes(center, axes[1], half[1])


def test_single_precision_is_relative_to_the_pair(rng: np.random.Generator) -> None:
    """A thousand kilometres away nothing is lost, and in another unit nothing but the last bits of a double."""
    a, b = crowd(rng, 200)
    here = gs.distance(a, b, want=DEEP, accuracy="float32")
    step = np.array([2.0**20, -(2.0**18), 3.0])
    moved = [gs.Boxes(body.center + step, body.axes, body.half_extents) for body in (a, b)]
    there = gs.distance(*moved, want=DEEP, accuracy="float32")
    for name in ("distance", "lower", "upper", "normal"):
        assert np.array_equal(getattr(here, name), getattr(there, name)), name
    for scale in (2.0**-3, 2.0**90, 2.0**-900, 2.0**900):
        other = gs.distance(scaled(a, scale), scaled(b, scale), want=DEEP, accuracy="float32")
        assert np.array_equal(here.distance, other.distance / scale)
        for name in ("lower", "upper"):
            one, two = getattr(here, name), getattr(other, name) / scale
            assert np.abs(one - two).max() <= 4 * EPS * np.abs(one).max()


def test_it_is_single_precision(rng: np.random.Generator) -> None:
    """Intervals are some 2^-24 of the scene wide, not 2^-53, and doubles lie in them; almost all is decided."""
    a, b = crowd(rng, 1000)
    single, double = (gs.distance(a, b, want=DEEP, accuracy=tier) for tier in ("float32", "float64"))
    assert (single.lower <= double.upper).all() and (double.lower <= single.upper).all()
    width = single.upper - single.lower
    assert 2.0**-22 < np.median(width) < 2.0**-16 and (single.status == gs.DistanceStatus.OK).mean() > 0.99
    assert np.abs(single.distance - double.distance).max() < 2.0**-18
    meet = gs.intersects(a, b, accuracy="float32")
    assert meet.certain.mean() > 0.99 and (meet.value == gs.intersects(a, b).value).mean() > 0.99
    assert single.cost.accuracy == "float32" and single.cost.counts == {"ok": 1000, "filter": 1000}


def test_touching_is_left_open() -> None:
    """What is within rounding of touching is not decided, however simple the numbers."""
    cube = gs.Boxes([[0, 0, 0]], [np.eye(3)], [[0.5] * 3])
    for gap, certain in ((0.0, False), (1e-9, False), (-1e-9, False), (1e-3, True), (-1e-3, True)):
        other = gs.Boxes([[1.0 + gap, 0.125, 0.25]], [np.eye(3)], [[0.5] * 3])
        meet = gs.intersects(cube, other, accuracy="float32")
        assert meet.certain[0] == certain and (not certain or meet.value[0] == (gap <= 0.0)), gap


@pytest.mark.parametrize("tier", TIERS)
def test_a_batch_is_its_items(tier: str, rng: np.random.Generator) -> None:
    """Hulls of any number of points, so that blocks of four are full and not; more points than are kept in place."""
    hulls = [rng.normal(size=(n, 3)) for n in (1, 2, 3, 4, 5, 7, 8, 9, 12, 63, 64, 65, 66, 200)]
    a, b = gs.Polytopes.from_list(hulls), gs.Polytopes.from_list([ordinary_hull(rng) + [2.0, 1.0, 0.0]])
    batch = gs.distance(a, b, want=DEEP, accuracy=tier)
    exact = gs.distance(a, b, want=DEEP, accuracy="exact")
    assert (batch.lower <= exact.distance).all() and (exact.distance <= batch.upper).all()
    for i, points in enumerate(hulls):
        alone = gs.distance(gs.Polytopes.from_list([points]), b, want=DEEP, accuracy=tier)
        for name in ("distance", "lower", "upper", "point_a", "point_b", "normal", "status"):
            assert np.array_equal(getattr(batch, name)[i], getattr(alone, name)[0], equal_nan=True), (name, i)


# -------------------------------------------------------------------------------------------------------- bound


def test_a_bound_of_spheres_is_their_distance() -> None:
    """Not only low enough: of bodies that are bounding volumes themselves it is the distance but for rounding."""
    ball, box = gs.Sphere(0.5), gs.Box([1.0, 2.0, 3.0])
    for pose, other, expected in (
        ([3, 4, 0], gs.Sphere(1.0), 3.5),
        ([4, 0, 0], box, 2.5),
        ([4, 6, 0], box, 4.5),
        ([0, 0, -2], gs.HalfSpace([0, 0, 1], 0.0), 1.5),
    ):
        answer = gs.distance(ball, other, [*pose, 0, 0, 0, 1], accuracy="bound")
        assert expected - 64 * EPS * 8.0 <= answer.distance[0] <= expected, (pose, answer)
        assert not gs.intersects(ball, other, [*pose, 0, 0, 0, 1], accuracy="bound").value[0]


def test_a_tiny_body_next_to_a_half_space_has_a_size() -> None:
    """Its bounding radius is a root of squares, which are no numbers any more."""
    for size in (1e-300, 1e-170, 1.0, 1e170, 1e300):
        for body in (gs.Capsule(size / 4, 2 * size), gs.Box([size] * 3), gs.Convex(np.eye(3) * size)):
            ground, pose = gs.HalfSpace([0, 0, 1], 0.0), [0, 0, size / 2, 0, 1, 0, 0]
            answer = gs.distance(body, ground, pose, want=DEEP, accuracy="bound")
            exact = gs.distance(body, ground, pose, want=DEEP)
            assert -4.0 * size <= answer.distance[0] <= exact.distance[0]
            assert gs.intersects(body, ground, pose, accuracy="bound").value[0]
