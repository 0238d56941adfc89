# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""Distance and depth of convex polygons: hard cases, constructed answers, laws, and the exact oracle."""

from __future__ import annotations

import math
from collections import Counter
from fractions import Fraction

import numpy as np
import pytest
from conftest import hard_cases, reproducer
from oracle import polygon as exact
from oracle.vectors import compare_root
from polygon_scenes import SQUARE, Turn, hull, polygons, random_ring, shifted, slender_pair

import geomsrv as gs

INF = math.inf

# Bounds are a few units in the last place apart.  Only where polygons are apart or overlap by less than rounding of
# twice the precision, 2^-100 of their size, does the number itself have fewer digits.
WIDTH = 2.0**-49
RESOLUTION = 2.0**-96
# Subnormal coordinates are rounded to whole multiples of 2^-1074; no point or product here counts more than 4 of them.
FINEST = 4 * 2.0**-1074


def below_root(x, square):
    """x <= sqrt(square), exactly, for x >= 0."""
    return Fraction(float(x)) ** 2 <= square


def above_root(x, square):
    return Fraction(float(x)) ** 2 >= square


def largest(*rings):
    return max(abs(float(c)) for ring in rings for v in ring for c in v)


def check(answer, i, a, b):
    """Everything an answer promises, against the exact signed distance.  `a`, `b` as the engine got them."""
    given = reproducer(a=a, b=b)
    truth = exact.separation(a, b).signed_square
    gap, lower, upper = (float(x[i]) for x in (answer.distance, answer.lower, answer.upper))
    size = largest(a, b) or 1.0
    assert lower <= gap <= upper, given
    if truth > 0:
        assert lower >= 0.0 and below_root(lower, truth) and above_root(upper, truth), given
        assert gap > 0.0, given
    elif truth < 0:
        assert upper <= 0.0 and below_root(-upper, -truth) and above_root(-lower, -truth), given
        assert gap < 0.0, given
    else:
        assert (lower, gap, upper) == (0.0, 0.0, 0.0), given
    assert upper - lower <= WIDTH * abs(gap) + RESOLUTION * size + 1e-322, given
    normal, point_a, point_b = answer.normal[i], answer.point_a[i], answer.point_b[i]
    assert abs(np.hypot(*normal) - 1.0) <= 2.0**-51, given
    # The witnesses lie on the polygons, `gap` apart along the normal; rounding is that of their coordinates.
    assert np.abs(point_b - point_a - gap * normal).max() <= 2.0**-47 * size, given
    for point, ring in ((point_a, a), (point_b, b)):
        off = exact.separation([tuple(map(float, point))], ring).signed_square
        assert off <= Fraction(2.0**-48 * size) ** 2, given
    if truth <= 0:  # moving b by the depth along the normal parts them
        moved = [tuple(Fraction(float(c)) - Fraction(gap) * Fraction(float(n)) for c, n in zip(v, normal, strict=True))
                 for v in b]  # fmt: skip
        left = exact.separation(a, moved).signed_square
        assert left >= -(Fraction(2.0**-47 * size) ** 2), given


# ------------------------------------------------------------------------------------------------- hard cases

CASES = hard_cases("polygon2d_distance")


@pytest.mark.parametrize("case", CASES, ids=lambda case: case["id"])
def test_hard_case(case):
    """All of them, also those that are marked as decidable in exact arithmetic only."""
    a, b = ([tuple(float.fromhex(c) for c in v) for v in case["input"][k]] for k in "PQ")
    expected = case["answer"]
    signed = gs.distance(polygons(a), polygons(b), want=("penetration",))
    check(signed, 0, a, b)
    plain = gs.distance(polygons(a), polygons(b))
    dist = float.fromhex(expected["dist"])
    assert abs(plain.distance[0] - dist) <= 2.0**-52 * dist
    assert plain.lower[0] <= dist <= plain.upper[0] or not expected["intersects"]
    assert gs.intersects(polygons(a), polygons(b)).value[0] == expected["intersects"]
    if expected["intersects"]:  # then the nearest points are one common point
        assert (plain.point_a == plain.point_b).all() or plain.distance[0] == signed.distance[0] == 0.0
        for ring in (a, b):
            off = exact.separation([tuple(map(float, plain.point_a[0]))], ring).signed_square
            assert off <= Fraction(2.0**-48 * largest(a, b)) ** 2


def test_hard_cases_are_all_there():
    assert len(CASES) >= 40
    assert {case["margin"]["decidable"] for case in CASES} == {"double", "careful_double", "exact_only"}


# ---------------------------------------------------------------------------------------- constructed answers

CONSTRUCTED = {
    # name: (a, b, signed distance, normal or None, point of a or None)
    "side to side": (SQUARE, shifted(SQUARE, 3, 0.5), 2.0, (1, 0), (1, 0.75)),
    "vertex to side": (SQUARE, [(3, 0.25), (4, 0), (4, 1)], 2.0, (1, 0), (1, 0.25)),
    "side to vertex": ([(0, 0), (-1, 0.5), (-1, -0.5)], shifted(SQUARE, 2, -0.25), 2.0, (1, 0), (0, 0)),
    "vertex to vertex": (SQUARE, shifted(SQUARE, 4, 5), 5.0, (0.6, 0.8), (1, 1)),
    "touching sides": (SQUARE, shifted(SQUARE, 1, 0.5), 0.0, (1, 0), (1, 0.75)),
    "touching corners": (SQUARE, shifted(SQUARE, 1, 1), 0.0, None, (1, 1)),
    "corner on side": (SQUARE, [(1, 0.25), (2, 0), (2, 1)], 0.0, (1, 0), (1, 0.25)),
    "overlap": (SQUARE, shifted(SQUARE, 0.75, 0.25), -0.25, (1, 0), (1, 0.625)),
    "corner in side": (SQUARE, [(0.875, 0.5), (2, 0), (2, 1)], -0.125, (1, 0), (1, 0.5)),
    "same square": (SQUARE, SQUARE, -1.0, None, None),
    "inside": (shifted(SQUARE, -0.5, -0.5), [(0.25, 0)], -0.25, (1, 0), (0.5, 0)),
    "plates crossing": (
        [(-5, -0.5), (5, -0.5), (5, 0.5), (-5, 0.5)],
        [(-0.5, -5), (0.5, -5), (0.5, 5), (-0.5, 5)],
        -5.5, None, None,
    ),
    "point to point": ([(1, 2)], [(4, 6)], 5.0, (0.6, 0.8), (1, 2)),
    "point on point": ([(1, 2)], [(1, 2)], 0.0, None, (1, 2)),
    "point to segment": ([(0, 0), (4, 0)], [(1, 3)], 3.0, (0, 1), (1, 0)),
    "point beyond a segment": ([(0, 0), (4, 0)], [(7, 4)], 5.0, (0.6, 0.8), (4, 0)),
    "point on a segment": ([(0, 0), (4, 0)], [(1, 0)], 0.0, None, (1, 0)),
    "collinear segments": ([(0, 0), (1, 0)], [(3, 0), (7, 0)], 2.0, (1, 0), (1, 0)),
    "collinear segments overlapping": ([(0, 0), (2, 0)], [(1, 0), (3, 0)], 0.0, None, (1.5, 0)),
    "parallel segments": ([(0, 0), (2, 0)], [(1, 1), (3, 1)], 1.0, (0, 1), (1.5, 0)),
    "crossing segments": ([(-4, 0), (4, 0)], [(0, -3), (0, 3)], -3.0, None, None),
    "segments touching in a T": ([(-4, 0), (4, 0)], [(1, 0), (1, 3)], 0.0, None, (1, 0)),
    "segment through a square": (SQUARE, [(0.75, -5), (0.75, 5)], -0.25, (1, 0), None),
    "needle tips": ([(0, 0), (-1e6, 1e-6), (-1e6, -1e-6)], [(2, 0), (1e6, -1e-6), (1e6, 1e-6)], 2.0, (1, 0), (0, 0)),
    "short side over the middle of a long one": (
        [(100, 0), (-100, 0), (0, -1)], [(1, 2), (2, 2), (1.5, 3)], 2.0, (0, 1), (1.5, 0),
    ),
    "repeated and collinear vertices": (
        [(0, 0), (0, 0), (1, 0), (1, 0.25), (1, 0.5), (1, 1), (0, 1), (0, 1)],
        [(3, 1.5), (3, 1.25), (3, 0.5), (4, 0.5), (4, 0.5), (4, 1.5)],
        2.0, (1, 0), None,
    ),
}  # fmt: skip


@pytest.mark.parametrize("swap", [False, True], ids=["", "swapped"])
@pytest.mark.parametrize("name", CONSTRUCTED)
def test_constructed(name, swap):
    a, b, expected, normal, point = CONSTRUCTED[name]
    first, second = (b, a) if swap else (a, b)
    answer = gs.distance(polygons(first), polygons(second), want=("penetration",))
    assert answer.distance[0] == pytest.approx(expected, rel=2.0**-52)
    check(answer, 0, [tuple(map(float, v)) for v in first], [tuple(map(float, v)) for v in second])
    if normal is not None:
        np.testing.assert_allclose(answer.normal[0], np.negative(normal) if swap else normal, rtol=2.0**-52, atol=1e-9)
    if point is not None:
        np.testing.assert_allclose((answer.point_b if swap else answer.point_a)[0], point, rtol=2.0**-50)
    plain = gs.distance(polygons(first), polygons(second))
    assert plain.distance[0] == max(answer.distance[0], 0.0)
    assert gs.intersects(polygons(first), polygons(second)).value[0] == (expected <= 0)


# ----------------------------------------------------------------------------------------------------- oracle


@pytest.mark.parametrize(("size", "count"), [(2, 300), (10, 150), (1000, 80)])
def test_against_the_oracle(rng, size, count):
    """Integer pairs, and rotated copies in which touching becomes a gap or overlap of rounding errors."""
    pairs = []
    for _ in range(count):
        a, b = random_ring(rng, size, 0.2), random_ring(rng, size, 0.2)
        pairs.append((a, shifted(b, *(int(c) for c in rng.integers(-2 * size, 2 * size + 1, 2)))))
    turns = [Turn(rng, 10.0 * size) for _ in pairs]
    copies = [tuple(turn.ring(r).tolist() for r in pair) for turn, pair in zip(turns, pairs, strict=True)]
    reached = Counter()
    for batch in (pairs, copies):
        a, b = polygons(*(a for a, _ in batch)), polygons(*(b for _, b in batch))
        signed = gs.distance(a, b, want=("penetration",))
        plain = gs.distance(a, b)
        assert not signed.status.any()
        np.testing.assert_array_equal(plain.distance, np.maximum(signed.distance, 0.0))
        for i, pair in enumerate(batch):
            check(signed, i, *pair)
            if signed.distance[i] < 0.0:
                assert (plain.point_a[i] == plain.point_b[i]).all()
                for ring in pair:
                    off = exact.separation([tuple(map(float, plain.point_a[i]))], ring).signed_square
                    assert off <= Fraction(2.0**-48 * largest(*pair)) ** 2, reproducer(a=pair[0], b=pair[1])
            reached[int(np.sign(signed.distance[i]))] += 1
            reached["tiny"] += 0.0 < abs(signed.distance[i]) < 1e-14 * size
            reached["flat"] += min(len(pair[0]), len(pair[1])) < 3
    assert min(reached[-1], reached[1], reached["flat"]) >= 0.1 * count, reached
    assert size > 2 or (reached[0] >= 5 and reached["tiny"] >= 3), reached


def test_large_polygons(rng):
    """Beyond some size supports are found by walking; nearest features stay exact."""
    for count_a, count_b in ((40, 33), (300, 200), (12, 400)):
        rings = [
            np.array([(3 * math.cos(t), 2 * math.sin(t)) for t in 2 * math.pi * (np.arange(n) + rng.random()) / n])
            for n in (count_a, count_b)
        ]
        for offset in ((9.0, 1.0), (5.0, 4.0), (6.5, -0.5)):
            a, b = rings[0], rings[1] + offset
            answer = gs.distance(polygons(a), polygons(b), want=("penetration",))
            # Nearest vertex-edge pair by trying all, in float64.
            best = min(brute_force(a, b), brute_force(b, a))
            assert answer.distance[0] == pytest.approx(best, rel=1e-12)
            assert answer.upper[0] - answer.lower[0] <= WIDTH * best
        depth = gs.distance(polygons(rings[0]), polygons(rings[1] + (4.0, 1.0)), want=("penetration",))
        assert depth.distance[0] < 0.0
        parted = rings[1] + (4.0, 1.0) - depth.distance[0] * depth.normal[0]
        assert abs(gs.distance(polygons(rings[0]), polygons(parted), want=("penetration",)).distance[0]) < 1e-13


def brute_force(ring, others):
    """Smallest distance of a vertex of `others` from an edge of `ring`."""
    start, edge = ring[:, None], (np.roll(ring, -1, axis=0) - ring)[:, None]
    way = others[None] - start
    t = np.clip((way * edge).sum(-1) / (edge * edge).sum(-1), 0.0, 1.0)
    return np.hypot(*np.moveaxis(way - t[..., None] * edge, -1, 0)).min()


def test_slender_polygons(rng):
    """Slivers, needles and nearly parallel edges, apart, touching and overlapping by a rounding error or less."""
    pairs = [slender_pair(rng)[:2] for _ in range(300)]
    answer = signed(pairs)
    for i, pair in enumerate(pairs):
        check(answer, i, *pair)
    reached = Counter(np.sign(answer.distance).astype(int).tolist())
    assert min(reached[k] for k in (-1, 0, 1)) >= 10, reached


# ------------------------------------------------------------------------------------------------------- laws


@pytest.fixture
def batch(rng):
    """400 float64 pairs, near and far, apart and overlapping."""
    pairs = []
    for _ in range(400):
        turn = Turn(rng, 0.0)
        a, b = (turn.ring(random_ring(rng, 50)).tolist() for _ in range(2))
        pairs.append((a, shifted(b, *rng.uniform(-120, 120, 2).tolist())))
    return pairs


def signed(pairs):
    return gs.distance(polygons(*(a for a, _ in pairs)), polygons(*(b for _, b in pairs)), want=("penetration",))


def nudged(rng, ring):
    """The ring with every coordinate moved by up to four ulps; zeros become subnormal."""
    for _ in range(4):
        way = np.where(rng.random((len(ring), 2)) < 0.3, rng.choice([-INF, INF], (len(ring), 2)), ring)
        ring = np.nextafter(ring, way)
    return ring


def nearly_parallel_pairs(rng, count, unit):
    """Pairs that share the directions of their edges up to a few ulps, at any offset, and how they differ."""
    for _ in range(count):
        size = int(rng.integers(1, 6))
        a = SQUARE if rng.random() < 0.3 else random_ring(rng, size)
        sign = rng.choice([-1, 1])
        stretch = rng.integers(1, 4, 2) if a is SQUARE else np.full(2, rng.integers(1, 4))
        b = sign * stretch * np.array(a) + rng.integers(-2 * size, 2 * size + 1, 2)
        yield tuple(hull(nudged(rng, unit * np.array(ring, float))) for ring in (a, b))


def repeated(rng, ring):
    return [v for v in ring for _ in range(int(rng.integers(1, 3)))]


@pytest.mark.parametrize("exponent", [-1060, -1000, -30, 0, 30, 1000])
def test_law_witnesses_of_nearly_parallel_edges_face_each_other(rng, exponent):
    pairs = [tuple(repeated(rng, ring) for ring in pair) for pair in nearly_parallel_pairs(rng, 600, 2.0**exponent)]
    answer = signed(pairs)
    reached = Counter(np.sign(answer.distance).astype(int).tolist())
    off = np.abs(answer.point_b - answer.point_a - answer.distance[:, None] * answer.normal).max(axis=1)
    for i, pair in enumerate(pairs):
        assert off[i] <= 2.0**-49 * largest(*pair) + FINEST, reproducer(a=pair[0], b=pair[1])
        for point, ring in ((answer.point_a[i], pair[0]), (answer.point_b[i], pair[1])):
            away = exact.separation([tuple(map(float, point))], ring).signed_square
            assert away <= Fraction(2.0**-49 * largest(*pair) + FINEST) ** 2, reproducer(a=pair[0], b=pair[1])
    assert min(reached[-1], reached[1]) >= 100, reached


@pytest.mark.parametrize("size", [1.0, 2.0**1000])
def test_distances_whose_squares_underflow(size):
    """Two tips so near to each other that nothing but their coordinates tells them apart."""
    a = [(0.0, 0.0), (-size, 2.0 * size), (-size, -2.0 * size)]
    b = [(3e-200, -4e-200), (size, -2.0 * size), (size, 2.0 * size)]
    answer = signed([(a, b)])
    assert answer.distance[0] == pytest.approx(5e-200, rel=2.0**-52)
    np.testing.assert_allclose(answer.normal[0], [0.6, -0.8], rtol=2.0**-52)
    assert answer.lower[0] <= answer.distance[0] <= answer.upper[0]


def _with_tiny_edges(rng):
    """A ring of few bits, some vertices doubled at a distance that has no square."""
    points = [tuple(p) for p in (rng.integers(-8, 9, (int(rng.integers(1, 6)), 2)) / 8).tolist()]
    tiny = math.ldexp(float(rng.choice([-1, 1])), -int(rng.integers(300, 1074)))
    return points + [(tiny, y) for x, y in points if x == 0.0] + [(x, tiny) for x, y in points if y == 0.0]


@pytest.mark.parametrize("tier", ["float32", "float64"])
def test_edges_whose_squares_underflow(rng, tier):
    pairs = []
    while len(pairs) < 300:
        a, b = _with_tiny_edges(rng), _with_tiny_edges(rng)
        if any(0 < abs(c) < 2.0**-300 for v in a + b for c in v):
            shift = rng.integers(-8, 9, 2) / 8 * rng.integers(0, 2)
            pairs.append((hull(a), hull(np.array(b) + shift)))
    a, b = polygons(*(a for a, _ in pairs)), polygons(*(b for _, b in pairs))
    wide = 0
    for want in ((), ("penetration",)):
        answer = gs.distance(a, b, accuracy=tier, want=want)
        for i, (p, q) in enumerate(pairs):
            given = reproducer(a=p, b=q)
            truth = exact.separation(p, q).signed_square
            truth = truth if want else max(truth, Fraction(0))
            low, high = float(answer.lower[i]), float(answer.upper[i])
            assert low <= answer.distance[i] <= high, given
            wide += tier == "float64" and high - low > 1e-13
            assert compare_root(low, truth) <= 0 <= compare_root(high, truth), given
            assert np.isfinite([*answer.point_a[i], *answer.point_b[i], *answer.normal[i]]).all(), given
    assert wide <= 6  # vertices so near to each other that neither is known to be the nearest


def test_edges_parallel_beyond_all_digits():
    """The foot of the lowest vertex is beyond the edge, and the edge it is an end of tilted by 2^-1074."""
    a = [(0, 0), (0, 0), (0.5, 0), (1, 0), (1, 0), (1, 0.5), (1, 1), (0, 1), (0, 0.25)]
    tilted = [(0.0, -1.0 + 2.0**-53), (1.0, -1.0 + 2.0**-52), (1.0, 1.0 - 2.0**-53), (2.0**-1073, 1.0 + 2.0**-51)]
    for pair in ((a, tilted), (tilted, a)):
        answer = signed([pair])
        check(answer, 0, *pair)
        assert answer.distance[0] == -1.0


def test_law_swap(batch):
    one, other = signed(batch), signed([(b, a) for a, b in batch])
    np.testing.assert_allclose(other.distance, one.distance, rtol=2.0**-50)
    np.testing.assert_allclose(other.normal, -one.normal, atol=1e-12)
    np.testing.assert_allclose(other.point_a, one.point_b, atol=1e-11)


def test_law_common_motion(batch, rng):
    turns = [Turn(rng, 100.0) for _ in batch]
    one = signed(batch)
    other = signed([(turn.ring(a), turn.ring(b)) for turn, (a, b) in zip(turns, batch, strict=True)])
    np.testing.assert_allclose(other.distance, one.distance, atol=1e-12)


@pytest.mark.parametrize("exponent", [-1000, -537, -20, 3, 511, 1000])
def test_law_power_of_two_scale_is_bitwise(batch, exponent):
    unit = 2.0**exponent
    one = signed(batch)
    other = signed([tuple([(x * unit, y * unit) for x, y in ring] for ring in pair) for pair in batch])
    np.testing.assert_array_equal(other.distance, one.distance * unit)
    np.testing.assert_array_equal(other.normal, one.normal)
    np.testing.assert_array_equal(other.point_a, one.point_a * unit)


def test_law_relabelled_rings(batch, rng):
    one = signed(batch)
    rolled = [tuple(ring[k:] + ring[:k] for ring, k in zip(pair, rng.integers(0, 3, 2), strict=True)) for pair in batch]
    np.testing.assert_allclose(signed(rolled).distance, one.distance, rtol=2.0**-50)


def test_law_growing_a_body_brings_it_nearer(batch):
    one = signed(batch)
    grown = [([*exact.hull([*a, (200.0, 0.0)])], b) for a, b in batch]
    assert (signed(grown).distance <= one.distance).all()


# ----------------------------------------------------------------------------------------------- other inputs


def test_far_from_the_origin(rng):
    for _ in range(30):
        center = rng.uniform(-1e9, 1e9, 2)
        a = [tuple(map(float, center + 1e-2 * np.array(v))) for v in random_ring(rng, 3)]
        b = [tuple(map(float, center + 1e-2 * np.array(v) + rng.uniform(-0.1, 0.1, 2))) for v in [(0, 0)]]
        answer = gs.distance(polygons(hull(a)), polygons(b), want=("penetration",))
        truth = exact.separation(a, b).signed_square
        assert np.sign(answer.distance[0]) == (truth > 0) - (truth < 0)
        if truth > 0:
            assert below_root(answer.lower[0], truth) and above_root(answer.upper[0], truth)
            assert answer.upper[0] - answer.lower[0] <= WIDTH * answer.distance[0]


def test_differences_beyond_the_doubles():
    big = 1.7e308
    a = [(-big, 0.0), (-big / 2, 0.0), (-big / 2, big / 4), (-big, big / 4)]
    b = [(0.0, 0.0), (big, 0.0), (big, big / 4), (0.0, big / 4)]
    answer = gs.distance(polygons(a), polygons(b))
    assert answer.distance[0] == pytest.approx(big / 2, rel=2.0**-52)
    assert answer.point_a[0, 0] == -big / 2 and answer.point_b[0, 0] == 0.0


def test_broadcasting_and_empty(batch):
    a, b = batch[0][0], [b for _, b in batch]
    one = gs.distance(polygons(a), polygons(*b))
    other = gs.distance(polygons(*b), polygons(a))
    np.testing.assert_allclose(one.distance, other.distance, rtol=2.0**-50)
    assert one.distance[7] == gs.distance(polygons(a), polygons(b[7])).distance[0]
    nothing = gs.Polygons(np.zeros((0, 2)), [0])
    assert gs.distance(nothing, nothing).point_a.shape == (0, 2)


def test_a_million_pairs():
    count = 1_000_000
    square = np.tile(SQUARE, (count, 1))
    offsets = np.arange(count + 1) * 4
    way = 2.0 + np.arange(count) % 7
    b = square + np.repeat(np.stack([way, np.full(count, 0.5)], axis=1), 4, axis=0)
    answer = gs.distance(gs.Polygons(square, offsets), gs.Polygons(b, offsets))
    np.testing.assert_array_equal(answer.distance, way - 1.0)
