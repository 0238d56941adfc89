# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""First contact of translating convex polygons: hard cases, constructed answers, laws, and the exact oracle."""

from __future__ import annotations

import math
from collections import Counter
from fractions import Fraction

import numpy as np
import pytest
from conftest import hard_cases, reproducer
from contact_answers import STATUS, points_of, set_distance
from oracle import polygon as exact
from polygon_scenes import SQUARE, Turn, hull, polygons, random_ring, shifted, slender_pair

import geomsrv as gs

INF = math.inf

# What float64 decides about a time is good to this relative error: gap and rate to 2^-46 each, or better (kSharp).
TIME_ERROR = 2.0**-44
# Contact sets are told apart down to this part of the scene (kLargestSlack): what is shorter may be one point.
LARGEST_SLACK = 2.0**-42


def contact(a, b, velocity_a=(0.0, 0.0), velocity_b=(0.0, 0.0), **options):
    """Answer for one pair."""
    return gs.first_contact(polygons(a), polygons(b), velocity_a, velocity_b, **options)


# ------------------------------------------------------------------------------------------------- hard cases


class Case:
    """A hard case as the engine and the oracle take it."""

    def __init__(self, case):
        values = case["input"]
        self.a, self.b = ([tuple(float.fromhex(c) for c in v) for v in values[k]] for k in "PQ")
        self.velocity_a, self.velocity_b = (tuple(float.fromhex(c) for c in values[k]) for k in ("velP", "velQ"))
        self.t_max = float.fromhex(values["tmax"])
        self.answer = contact(self.a, self.b, self.velocity_a, self.velocity_b, t_max=self.t_max)
        self.truth = exact.first_contact(self.a, self.velocity_a, self.b, self.velocity_b, self.t_max)
        self.given = reproducer(
            a=self.a, b=self.b, velocity_a=self.velocity_a, velocity_b=self.velocity_b, t_max=self.t_max
        )


CASES = hard_cases("polygon2d_moving")
DECIDABLE = hard_cases("polygon2d_moving", "double", "careful_double")


@pytest.mark.parametrize("case", DECIDABLE, ids=lambda case: case["id"])
def test_decidable_hard_case(case):
    it, expected = Case(case), case["answer"]
    answer, truth = it.answer, it.truth
    assert answer.status[0] == STATUS[truth.status], it.given
    assert (answer.status[0] != gs.NEVER) == expected["hits"]
    if not expected["hits"]:
        assert np.isnan([answer.time[0], answer.last_time[0], *answer.normal[0]]).all()
        assert len(answer.points) == 0
        return
    time, last = Fraction(expected["time"]), Fraction(expected["last_time"])
    assert abs(Fraction(float(answer.time[0])) - time) <= Fraction(TIME_ERROR) * time, it.given
    assert abs(Fraction(float(answer.last_time[0])) - last) <= Fraction(TIME_ERROR) * last, it.given
    corners = [tuple(float(Fraction(c)) for c in v) for v in expected["contact"]]
    scale = float.fromhex(case["margin"]["scale_world"])
    size = np.ptp(np.array(corners), axis=0).max()
    if expected["contact_dim"] == 1 and size <= LARGEST_SLACK * float.fromhex(case["margin"]["scale_local"]):
        assert len(answer.points) in (1, 2)
    else:
        assert len(answer.points) == len(corners), it.given
    assert set_distance(answer.points, corners) <= 2.0**-45 * scale + size * (len(answer.points) == 1), it.given


@pytest.mark.parametrize("case", CASES, ids=lambda case: case["id"])
def test_bounds_hold_in_every_hard_case(case):
    it = Case(case)
    answer, truth = it.answer, it.truth
    lower, time, upper = (float(x[0]) for x in (answer.time_lower, answer.time, answer.time_upper))
    if answer.status[0] != gs.NEVER:
        assert 0.0 <= lower <= time <= upper <= it.t_max, it.given
        assert time <= answer.last_time[0] <= it.t_max, it.given
    if answer.status[0] == STATUS[truth.status] and truth.hits:
        assert Fraction(lower) <= truth.time <= Fraction(upper), it.given


def test_hard_cases_are_all_there():
    assert len(CASES) >= 70 and len(DECIDABLE) >= 40
    undecided = [it for it in map(Case, CASES) if it.answer.status[0] != STATUS[it.truth.status]]
    # Within a rounding error of contact the answer is contact: never a miss that exact arithmetic would call a hit.
    assert all(it.truth.status in ("NEVER", "WILL_TOUCH") for it in undecided)
    assert len(undecided) < 10


# ---------------------------------------------------------------------------------------- constructed answers


CONSTRUCTED = {
    # name: (a, b, velocity of b, t_max, status, time, last time, normal, contact set)
    "edge meets edge": (SQUARE, shifted(SQUARE, 3, 0.5), (-1, 0), INF, "WILL_TOUCH", 2, 4, (1, 0), [(1, 0.5), (1, 1)]),
    "vertex meets edge": (
        SQUARE, [(3, 0.5), (4, 0), (4, 1)], (-2, 0), INF, "WILL_TOUCH", 1, 2, (1, 0), [(1, 0.5)],
    ),
    "edge meets vertex": (
        [(0, 0), (-1, 0.5), (-1, -0.5)], shifted(SQUARE, 2, -0.5), (-1, 0), INF, "WILL_TOUCH", 2, 4, (1, 0), [(0, 0)],
    ),
    "vertex meets vertex": (
        [(0, 0), (-1, 1), (-1, -1)], [(2, 0), (3, -1), (3, 1)], (-1, 0), INF, "WILL_TOUCH", 2, 4, None, [(0, 0)],
    ),
    "flies past a corner": (SQUARE, shifted(SQUARE, 2, 2), (-1, 1), INF, "NEVER", None, None, None, []),
    "grazes corner on corner": (
        SQUARE, shifted(SQUARE, 3, 0), (-1, 0.5), INF, "WILL_TOUCH", 2, 2, None, [(1, 1)],
    ),
    "slides along a side, then corner to corner": (
        SQUARE, shifted(SQUARE, 3, 1), (-1, 0), INF, "WILL_TOUCH", 2, 4, None, [(1, 1)],
    ),
    "touches side by side and slides": (
        SQUARE, shifted(SQUARE, 1, 0.5), (0, 1), INF, "TOUCHING", 0, 0.5, (1, 0), [(1, 0.5), (1, 1)],
    ),
    "touches side by side for ever": (
        SQUARE, shifted(SQUARE, 1, 0.5), (0, 0), INF, "TOUCHING", 0, INF, (1, 0), [(1, 0.5), (1, 1)],
    ),
    "touches and parts": (SQUARE, shifted(SQUARE, 1, 0), (1, 0), INF, "TOUCHING", 0, 0, (1, 0), [(1, 0), (1, 1)]),
    "touches and enters": (SQUARE, shifted(SQUARE, 1, 0), (-1, 0), INF, "TOUCHING", 0, 2, (1, 0), [(1, 0), (1, 1)]),
    "overlaps": (
        SQUARE, shifted(SQUARE, 0.5, 0.25), (1, 0), INF, "OVERLAPPING", 0, 0.5, None,
        [(0.5, 0.25), (1, 0.25), (1, 1), (0.5, 1)],
    ),
    "overlaps for ever": (SQUARE, SQUARE, (0, 0), INF, "OVERLAPPING", 0, INF, None, SQUARE),
    "one inside the other": (
        shifted(SQUARE, -0.25, -0.25), [(0, 0), (0.5, 0), (0, 0.5)], (0, 0), 7.0, "OVERLAPPING", 0, 7, None,
        [(0, 0), (0.5, 0), (0, 0.5)],
    ),
    "parallel flight": (SQUARE, shifted(SQUARE, 3, 0), (0, 1), INF, "NEVER", None, None, None, []),
    "flies away": (SQUARE, shifted(SQUARE, 3, 0), (1, 0), INF, "NEVER", None, None, None, []),
    "at rest, apart": (SQUARE, shifted(SQUARE, 3, 0), (0, 0), INF, "NEVER", None, None, None, []),
    "contact exactly at t_max": (
        SQUARE, shifted(SQUARE, 3, 0), (-1, 0), 2.0, "WILL_TOUCH", 2, 2, (1, 0), [(1, 0), (1, 1)],
    ),
    "contact after t_max": (SQUARE, shifted(SQUARE, 3, 0), (-1, 0), 1.9375, "NEVER", None, None, None, []),
    "t_max of zero": (SQUARE, shifted(SQUARE, 1, 0), (-1, 0), 0.0, "TOUCHING", 0, 0, (1, 0), [(1, 0), (1, 1)]),
    "parts after t_max": (SQUARE, shifted(SQUARE, 3, 0), (-1, 0), 3.0, "WILL_TOUCH", 2, 3, (1, 0), [(1, 0), (1, 1)]),
    "point meets side": (SQUARE, [(3, 0.5)], (-1, 0), INF, "WILL_TOUCH", 2, 3, (1, 0), [(1, 0.5)]),
    "point meets point": ([(0, 0)], [(3, 4)], (-1.5, -2), INF, "WILL_TOUCH", 2, 2, None, [(0, 0)]),
    "point misses point": ([(0, 0)], [(3, 4)], (-1.5, -2.0625), INF, "NEVER", None, None, None, []),
    "point on point": ([(1, 2)], [(1, 2)], (0, 0), INF, "TOUCHING", 0, INF, None, [(1, 2)]),
    "point meets the end of a segment": (
        [(0, 0), (1, 0)], [(3, 0)], (-1, 0), INF, "WILL_TOUCH", 2, 3, (1, 0), [(1, 0)],
    ),
    "point in a segment": ([(0, 0), (2, 0)], [(1, 0)], (1, 0), INF, "TOUCHING", 0, 1, None, [(1, 0)]),
    "point in a square": (SQUARE, [(0.5, 0.5)], (0, 1), INF, "OVERLAPPING", 0, 0.5, None, [(0.5, 0.5)]),
    "collinear segments meet": (
        [(0, 0), (1, 0)], [(3, 0), (4, 0)], (-1, 0), INF, "WILL_TOUCH", 2, 4, (1, 0), [(1, 0)],
    ),
    "parallel segments meet": (
        [(0, 0), (2, 0)], [(1, 1), (3, 1)], (0, -1), INF, "WILL_TOUCH", 1, 1, (0, 1), [(1, 0), (2, 0)],
    ),
    "collinear segments overlap": (
        [(0, 0), (2, 0)], [(1, 0), (3, 0)], (0, 0), INF, "TOUCHING", 0, INF, None, [(1, 0), (2, 0)],
    ),
    "segments cross": ([(0, 0), (2, 2)], [(0, 2), (2, 0)], (0, 0), INF, "OVERLAPPING", 0, INF, None, [(1, 1)]),
    "segment crosses a square": (
        SQUARE, [(0.5, -1), (0.5, 2)], (1, 0), INF, "OVERLAPPING", 0, 0.5, None, [(0.5, 0), (0.5, 1)],
    ),
    "segment flush with a side": (
        SQUARE, [(0.5, 3), (2, 3)], (0, -1), INF, "WILL_TOUCH", 2, 3, (0, 1), [(0.5, 1), (1, 1)],
    ),
    "repeated and collinear vertices": (
        [(0, 0), (0.5, 0), (0.5, 0), (1, 0), (1, 0.25), (1, 1), (1, 1), (0, 1), (0, 1)],
        shifted([(0, 0), (0, 0), (1, 0), (1, 1), (0.5, 1), (0, 1), (0, 0.5)], 3, 0.5),
        (-1, 0), INF, "WILL_TOUCH", 2, 4, (1, 0), [(1, 0.5), (1, 1)],
    ),
    "facing side of many collinear pieces": (
        [(1, y / 8) for y in range(9)] + [(0, 0.5)],
        [(3, 1.5), (3, 1.25), (3, 0.75), (3, 0.5), (4, 1)], (-1, 0), INF, "WILL_TOUCH", 2, 3, (1, 0),
        [(1, 0.5), (1, 1)],
    ),
}  # fmt: skip


@pytest.mark.parametrize("swap", [False, True], ids=["", "swapped"])
@pytest.mark.parametrize("name", CONSTRUCTED)
def test_constructed(name, swap):
    a, b, velocity, t_max, status, time, last, normal, corners = CONSTRUCTED[name]
    answer = contact(b, a, velocity, (0.0, 0.0), t_max=t_max) if swap else contact(a, b, (0, 0), velocity, t_max=t_max)
    assert answer.status[0] == STATUS[status]
    assert len(answer.points) == len(corners)
    if status == "NEVER":
        numbers = [answer.time, answer.time_lower, answer.time_upper, answer.last_time, answer.normal]
        assert all(np.isnan(x).all() for x in numbers)
        return
    assert (answer.time[0], answer.last_time[0]) == (time, last)
    assert answer.time_lower[0] <= time <= answer.time_upper[0]
    assert set_distance(answer.points, corners) == 0.0
    if status == "OVERLAPPING":
        assert np.isnan(answer.normal).all()
        assert exact.hull([tuple(p) for p in answer.points]) != [] and is_strictly_convex(answer.points)
    else:
        assert abs(np.hypot(*answer.normal[0]) - 1.0) <= 2.0**-51
    if normal is not None:
        assert set_distance(answer.normal, [np.negative(normal) if swap else normal]) == 0.0


def is_strictly_convex(ring):
    points = [tuple(map(Fraction, map(float, p))) for p in ring]
    turns = [
        (b[0] - a[0]) * (c[1] - b[1]) - (b[1] - a[1]) * (c[0] - b[0])
        for a, b, c in zip(points, points[1:] + points[:1], points[2:] + points[:2], strict=True)
    ]
    # What a point or a segment has in common with a body is a point or a segment.
    return len(set(points)) == len(points) < 3 or all(turn > 0 for turn in turns)


def test_two_contact_points_run_counterclockwise_around_a():
    for a, b in ((SQUARE, shifted(SQUARE, 3, 0.5)), (shifted(SQUARE, 3, 0.5), SQUARE)):
        answer = contact(a, b, (1.0 if a is SQUARE else -1.0, 0.0))
        first, second = points_of(answer)
        x, y = answer.normal[0]
        assert np.dot(second - first, (-y, x)) > 0.0


@pytest.mark.parametrize("angle", [1e-3, 1e-6, 1e-8, 1e-10, 1e-12])
@pytest.mark.parametrize("height", [2.0, 50.0])
def test_nearly_parallel_edges_touch_in_one_point(angle, height):
    # The far end of b's lower edge is lower by the angle, and that decides, however far b has to come.
    tilted = [(-1.0, height), (2.0, height + 3.0 * angle), (2.0, height + 1.0), (-1.0, height + 1.0)]
    answer = contact(SQUARE, tilted, (0, 0), (0, -1))
    assert points_of(answer).shape == (1, 2)
    assert set_distance(points_of(answer), [(0.0, 1.0)]) <= 1e-14 * height
    truth = exact.first_contact(SQUARE, (0, 0), tilted, (0, -1), INF)
    assert Fraction(answer.time_lower[0]) <= truth.time <= Fraction(answer.time_upper[0])
    level = [(-1.0, height), (2.0, height), (2.0, height + 1.0), (-1.0, height + 1.0)]
    assert len(contact(SQUARE, level, (0, 0), (0, -1)).points) == 2


@pytest.mark.parametrize("slope", [2.0**-10, 2.0**-20, 2.0**-30])
def test_grazing_approach_keeps_its_digits(slope):
    # b comes down on the top of a at a grazing angle: the time has condition 1 / slope, its bounds stay sharp.
    b = shifted(SQUARE, 5.0, 1.0 + 4.5 * slope)
    answer = contact(SQUARE, b, (0, 0), (-1.0, -slope))
    truth = exact.first_contact(SQUARE, (0, 0), b, (-1.0, -slope), INF)
    assert Fraction(answer.time_lower[0]) <= truth.time <= Fraction(answer.time_upper[0])
    assert answer.time_upper[0] - answer.time_lower[0] <= TIME_ERROR * answer.time[0]
    assert len(answer.points) == 2
    assert set_distance(answer.points, [[float(c) for c in p] for p in truth.contact]) <= 1e-14


# ----------------------------------------------------------------------------------------------------- oracle


def random_pairs(rng, count, size):
    """Integer pairs, most of them aimed at each other; some touch at a vertex or along a side, now or later."""
    pairs = []
    for _ in range(count):
        a, b = random_ring(rng, size), random_ring(rng, size)
        offset = rng.integers(-3 * size, 3 * size + 1, 2)
        velocity_a, velocity_b = (tuple(int(c) for c in v) for v in rng.integers(-2, 3, (2, 2)))
        if rng.random() < 0.7:
            velocity_a = tuple(int(c) for c in np.sign(offset) * rng.integers(1, 3))
        if rng.random() < 0.15:
            # Reflected in a vertex or in the middle of a side, it touches there.
            i, later = int(rng.integers(len(a))), int(rng.integers(3))
            j = (i + int(rng.integers(2))) % len(a)
            b = [(a[i][0] + a[j][0] - x, a[i][1] + a[j][1] - y) for x, y in a]
            offset = [later * (velocity_a[k] - velocity_b[k]) for k in range(2)]
        pairs.append((a, velocity_a, shifted(b, *(int(c) for c in offset)), velocity_b))
    return pairs


def contact_kind(a, velocity_a, b, velocity_b, truth):
    """V-V, V-E or E-E, of the moved polygons."""
    if len(truth.contact) == 2:
        return "E-E"
    moved = [
        {(x + truth.time * v[0], y + truth.time * v[1]) for x, y in exact.hull(ring)}
        for ring, v in ((a, velocity_a), (b, velocity_b))
    ]
    return "V-V" if all(truth.contact[0] in ring for ring in moved) else "V-E"


def slides(a, velocity_a, b, velocity_b):
    """Whether some constraint is closed at the start and stays closed."""
    ray = (velocity_b[0] - velocity_a[0], velocity_b[1] - velocity_a[1])
    ring = exact.difference(a, b)
    return ray != (0, 0) and any(d == 0 and n[0] * ray[0] + n[1] * ray[1] == 0 for n, d in exact.constraints(ring))


@pytest.mark.parametrize(("size", "shift", "count"), [(2, 10.0, 500), (4, 10.0, 400), (12, 100.0, 200), (3, 1e3, 200)])
def test_against_the_oracle(rng, size, shift, count):
    """Integer pairs and rotated float64 copies of them: the same outcome, times and contact sets.

    Rotation turns exact contacts into gaps and overlaps of a rounding error; none may be lost or change its kind.
    """
    pairs = random_pairs(rng, count, size)
    truths = [exact.first_contact(*pair, INF) for pair in pairs]
    turns = [Turn(rng, shift) for _ in pairs]
    rotated = [
        (turn.ring(a), turn.vector(va), turn.ring(b), turn.vector(vb))
        for turn, (a, va, b, vb) in zip(turns, pairs, strict=True)
    ]
    reached = Counter()
    for copies in (pairs, rotated):
        answer = gs.first_contact(
            polygons(*(a for a, _, _, _ in copies)),
            polygons(*(b for _, _, b, _ in copies)),
            np.array([va for _, va, _, _ in copies], float),
            np.array([vb for _, _, _, vb in copies], float),
        )
        for i, (copy, truth) in enumerate(zip(copies, truths, strict=True)):
            given = reproducer(a=copy[0], velocity_a=copy[1], b=copy[2], velocity_b=copy[3])
            assert answer.status[i] == STATUS[truth.status], given
            points = points_of(answer, i)
            if truth.status == "NEVER":
                assert len(points) == 0 and np.isnan(answer.time[i])
                continue
            scale = (1.0 if copies is pairs else 1.0 + shift) * size
            # Rounding of the input moves times by its share of the closing speed, which is at least 1 / |edge|.
            slow = 100.0 * size * scale * 2.0**-52
            assert answer.time[i] == pytest.approx(float(truth.time), rel=TIME_ERROR, abs=slow), given
            last = INF if truth.last_time is None else float(truth.last_time)
            assert answer.last_time[i] == pytest.approx(last, rel=TIME_ERROR, abs=slow), given
            corners = [[float(c) for c in p] for p in truth.contact]
            if copies is rotated:
                corners = turns[i].ring(corners)
            assert len(points) == len(corners), given
            assert set_distance(points, corners) <= 10.0 * slow, given
            if truth.status == "OVERLAPPING":
                assert is_strictly_convex(points), given
            else:
                assert abs(np.hypot(*answer.normal[i]) - 1.0) < 1e-15
                reached[contact_kind(*pairs[i], truth)] += 1
            if copies is pairs:
                assert Fraction(answer.time_lower[i]) <= truth.time <= Fraction(answer.time_upper[i]), given
                reached["grazing"] += truth.time == truth.last_time and truth.time > 0
                reached["sliding"] += slides(*pairs[i])
            reached[truth.status] += 1
            reached["degenerate"] += min(len(pairs[i][0]), len(pairs[i][2])) < 3
    assert reached["WILL_TOUCH"] >= 0.5 * count and reached["OVERLAPPING"] >= 0.1 * count
    assert min(reached[k] for k in ("V-V", "V-E", "E-E", "TOUCHING", "degenerate")) >= 4, reached
    assert size > 4 or min(reached["grazing"], reached["sliding"]) >= 3, reached


def test_bounds_contain_the_exact_time_of_float_pairs(rng):
    """Random float64 data: status and bounds against the exact answer for the same doubles."""
    near = 0
    for _ in range(150):
        a, b = (Turn(rng, 0.0).ring(random_ring(rng, 10)) for _ in range(2))
        b = b + rng.uniform(-15, 15, 2)
        velocity = -b.mean(axis=0) * rng.uniform(0.1, 1.0) + rng.uniform(-3, 3, 2)
        if rng.random() < 0.3:  # stop just short of contact: most digits of the gap cancel
            hit = contact(a, b, (0, 0), velocity)
            if hit.status[0] == gs.WILL_TOUCH:
                b = b + hit.time[0] * (1.0 - 10.0 ** rng.uniform(-10, -3)) * velocity
                near += 1
        answer = contact(a, b, (0, 0), velocity)
        truth = exact.first_contact(a.tolist(), (0.0, 0.0), b.tolist(), velocity.tolist(), INF)
        given = reproducer(a=a, b=b, velocity=velocity)
        assert answer.status[0] == STATUS[truth.status], given
        if truth.hits:
            lower, upper = answer.time_lower[0], answer.time_upper[0]
            assert Fraction(lower) <= truth.time <= Fraction(upper), given
            assert upper - lower <= TIME_ERROR * upper, given
    assert near >= 12


def test_large_polygons(rng):
    """Beyond some size supports are found by walking; the answers stay the same."""
    for count_a, count_b in ((40, 33), (90, 12), (12, 90), (200, 100)):
        turns = rng.uniform(0, 2 * math.pi, 2)
        rings = [
            np.array([(3 * math.cos(t + turn), 2 * math.sin(t + turn)) for t in 2 * math.pi * np.arange(n) / n])
            for n, turn in zip((count_a, count_b), turns, strict=True)
        ]
        offset, velocity = np.array([9.0, 1.0]), np.array([-1.0, rng.uniform(-0.3, 0.1)])
        b = rings[1] + offset
        answer = contact(rings[0], b, (0, 0), velocity)
        # The ray against each constraint of the Minkowski difference, in float64.
        first, last = 0.0, INF
        for side, ring, other, sign in ((1, rings[0], b, 1.0), (-1, b, rings[0], -1.0)):
            edges = np.roll(ring, -1, axis=0) - ring
            normals = np.stack([edges[:, 1], -edges[:, 0]], axis=1)
            gaps = (normals @ other.T).min(axis=1) - (normals * ring).sum(axis=1)
            speeds = sign * normals @ velocity
            assert side * sign == 1
            first = max(first, (-gaps / speeds)[speeds < 0].max())
            last = min(last, (-gaps / speeds)[speeds > 0].min())
        assert answer.time[0] == pytest.approx(first, rel=1e-13)
        assert answer.last_time[0] == pytest.approx(last, rel=1e-13)
        moved = polygons(b + answer.time[0] * velocity)
        assert abs(gs.distance(polygons(rings[0]), moved).distance[0]) < 1e-14
        overlap = contact(rings[0], rings[1] + (0.1, 0.2))
        assert overlap.status[0] == gs.OVERLAPPING and is_strictly_convex(overlap.points)


# ------------------------------------------------------------------------------------------------------- laws


@pytest.fixture
def batch(rng):
    """500 float64 pairs on collision course, 4 to 16 vertices."""
    rings = []
    for _ in range(1000):
        turn = np.sort(rng.uniform(0, 2 * math.pi, int(rng.integers(4, 17))))
        shape, angle = rng.uniform(0.5, 1.5, 2), rng.uniform(0, math.pi)
        x, y = shape[0] * np.cos(turn), shape[1] * np.sin(turn)
        rings.append(
            np.stack([math.cos(angle) * x - math.sin(angle) * y, math.sin(angle) * x + math.cos(angle) * y], axis=1)
        )
    way = rng.uniform(0, 2 * math.pi, 500)
    direction = np.stack([np.cos(way), np.sin(way)], axis=1)
    offset = rng.uniform(2.5, 8.0, (500, 1)) * direction
    b = [ring + shift for ring, shift in zip(rings[500:], offset, strict=True)]
    velocity = -direction * rng.uniform(0.5, 2.0, (500, 1)) + rng.uniform(-0.3, 0.3, (500, 2))
    return rings[:500], b, rng.uniform(-1, 1, (500, 2)), velocity


def solve(a, b, velocity_a, velocity_b, **options):
    return gs.first_contact(polygons(*a), polygons(*b), velocity_a, velocity_b, **options)


def same_times(one, other, scale=1.0):
    hit = one.status != gs.NEVER
    assert (one.status == other.status).all() and hit.sum() > 300
    np.testing.assert_allclose(other.time[hit], scale * one.time[hit], rtol=1e-11, atol=1e-13)
    np.testing.assert_allclose(other.last_time[hit], scale * one.last_time[hit], rtol=1e-11, atol=1e-13)
    return hit


@pytest.mark.parametrize("accuracy", ["float64", "exact"])
def test_neighbours_in_a_batch_change_nothing(rng, accuracy):
    # Pairs are sorted by size and decided four at a time; some are too large for that, points or segments.
    def ring(sides):
        angles = 2.0 * math.pi * (np.arange(sides) + rng.uniform(-0.3, 0.3, sides)) / sides
        return rng.uniform(0.2, 2.0) * np.column_stack([np.cos(angles), np.sin(angles)])

    count = 700
    sides = rng.choice([1, 2, 3, 4, 5, 8, 13, 16, 31, 32, 33, 70], (count, 2))
    way = rng.normal(size=(count, 2)) * rng.uniform(0.0, 6.0, (count, 1))
    rings_a, rings_b = ([ring(n) for n in sides[:, k]] for k in (0, 1))
    a, b = gs.Polygons.from_list(rings_a), gs.Polygons.from_list([r + w for r, w in zip(rings_b, way, strict=True)])
    velocity_a, velocity_b = rng.normal(size=(count, 2)), rng.normal(size=(count, 2)) - way
    together = gs.first_contact(a, b, velocity_a, velocity_b, t_max=2.0, accuracy=accuracy)
    assert set(together.status) >= {gs.NEVER, gs.WILL_TOUCH, gs.OVERLAPPING}
    for i in range(count):
        alone = gs.first_contact(
            gs.Polygons.from_list([rings_a[i]]),
            gs.Polygons.from_list([rings_b[i] + way[i]]),
            velocity_a[i : i + 1],
            velocity_b[i : i + 1],
            t_max=2.0,
            accuracy=accuracy,
        )
        for name in ("status", "time", "time_lower", "time_upper", "last_time", "normal"):
            assert np.array_equal(getattr(alone, name)[0], getattr(together, name)[i], equal_nan=True), (i, name)
        begin, end = together.point_offsets[i : i + 2]
        assert np.array_equal(alone.points, together.points[begin:end]), i


def test_law_swap(batch):
    a, b, va, w = batch
    one, other = solve(a, b, va, va + w), solve(b, a, va + w, va)
    hit = same_times(one, other)
    np.testing.assert_allclose(other.normal[hit], -one.normal[hit], atol=1e-12)
    for i in np.flatnonzero(hit):
        assert set_distance(points_of(one, i), points_of(other, i)) < 1e-11


def test_law_common_velocity(batch, rng):
    a, b, va, w = batch
    common = rng.uniform(-5, 5, (500, 2))
    one, other = solve(a, b, va, va + w), solve(a, b, va + common, va + w + common)
    for i in np.flatnonzero(same_times(one, other)):
        assert set_distance(points_of(one, i) + one.time[i] * common[i], points_of(other, i)) < 1e-10


def test_law_common_motion(batch, rng):
    a, b, va, w = batch
    turn = Turn(rng, 100.0)
    one = solve(a, b, va, va + w)
    other = solve(
        [turn.ring(r) for r in a],
        [turn.ring(r) for r in b],
        np.array([turn.vector(v) for v in va]),
        np.array([turn.vector(v) for v in va + w]),
    )
    for i in np.flatnonzero(same_times(one, other)):
        assert set_distance(turn.ring(points_of(one, i)), points_of(other, i)) < 1e-10
        np.testing.assert_allclose(turn.vector(one.normal[i]), other.normal[i], atol=1e-10)


@pytest.mark.parametrize(
    ("length", "speed"), [(7, 0), (-3, 5), (-1000, -900), (-1000, 0), (1000, 0), (1000, 900), (0, -900), (300, -300)]
)
def test_law_power_of_two_scale_is_bitwise(batch, length, speed):
    a, b, _, w = (x[:60] for x in batch)
    va = np.zeros_like(w)
    one = solve(a, b, va, w)
    unit, rate = 2.0**length, 2.0**speed
    other = solve([r * unit for r in a], [r * unit for r in b], va, w * rate)
    assert (one.status == gs.WILL_TOUCH).sum() > 30
    for name in ("status", "normal", "point_offsets"):
        np.testing.assert_array_equal(getattr(other, name), getattr(one, name))
    for name in ("time", "time_lower", "time_upper", "last_time"):
        np.testing.assert_array_equal(getattr(other, name), np.ldexp(getattr(one, name), length - speed))
    np.testing.assert_array_equal(other.points, one.points * unit)


def test_law_time_reversal(batch):
    a, b, _, w = batch
    forward = solve(a, b, np.zeros_like(w), w)
    hit = forward.status == gs.WILL_TOUCH
    late = np.where(hit, forward.last_time + 1.0, 0.0)
    ended = [ring + t * v for ring, t, v in zip(b, late, w, strict=True)]
    back = solve(a, ended, np.zeros_like(w), -w)
    assert hit.sum() > 300 and (back.status[hit] == gs.WILL_TOUCH).all()
    np.testing.assert_allclose(back.time[hit], 1.0, atol=1e-11)
    np.testing.assert_allclose(back.last_time[hit], late[hit] - forward.time[hit], atol=1e-11)


def test_law_relabelled_rings(batch, rng):
    a, b, va, w = batch
    one = solve(a, b, va, va + w)
    other = solve(
        [np.roll(r, int(rng.integers(16)), axis=0) for r in a],
        [np.roll(r, int(rng.integers(16)), axis=0) for r in b],
        va,
        va + w,
    )
    for i in np.flatnonzero(same_times(one, other)):
        assert set_distance(points_of(one, i), points_of(other, i)) < 1e-12
        np.testing.assert_allclose(other.normal[i], one.normal[i], atol=1e-15)


def test_law_repeated_and_collinear_vertices_change_nothing(batch, rng):
    a, b, va, w = batch

    def refined(ring):
        places = np.sort(rng.uniform(0, 1, (len(ring), 2)), axis=1)
        middle = [p + t * (q - p) for p, q, t in zip(ring, np.roll(ring, -1, axis=0), places[:, 0], strict=True)]
        return np.concatenate([[p, p, m] for p, m in zip(ring, middle, strict=True)])

    one, other = solve(a, b, va, va + w), solve([refined(r) for r in a], [refined(r) for r in b], va, va + w)
    for i in np.flatnonzero(same_times(one, other)):
        assert set_distance(points_of(one, i), points_of(other, i)) < 1e-11


def test_law_monotone_t_max(batch):
    a, b, va, w = batch
    free = solve(a, b, va, va + w)
    hit = np.flatnonzero(free.status == gs.WILL_TOUCH)[:60]
    for i in hit:
        pair = polygons(a[i]), polygons(b[i]), va[i], va[i] + w[i]
        before = gs.first_contact(*pair, t_max=free.time_lower[i] * (1.0 - 1e-11))
        at = gs.first_contact(*pair, t_max=free.time[i])
        after = gs.first_contact(*pair, t_max=0.5 * (free.time[i] + free.last_time[i]))
        assert before.status[0] == gs.NEVER
        assert at.status[0] == after.status[0] == gs.WILL_TOUCH
        assert at.time[0] == after.time[0] == free.time[i] == at.last_time[0]
        assert after.last_time[0] == 0.5 * (free.time[i] + free.last_time[i])


def test_law_contact_is_where_the_polygons_are(batch):
    a, b, va, w = batch
    answer = solve(a, b, va, va + w)
    hit = np.flatnonzero(answer.status == gs.WILL_TOUCH)
    time = answer.time[hit]

    def at(times):
        return (
            polygons(*(a[i] + t * va[i] for i, t in zip(hit, times, strict=True))),
            polygons(*(b[i] + t * (va[i] + w[i]) for i, t in zip(hit, times, strict=True))),
        )

    moved = at(time)
    touching = gs.distance(*moved, want=("penetration",))
    assert np.abs(touching.distance).max() < 1e-13
    assert gs.distance(*at(time - 1e-6)).distance.min() > 0.0
    assert gs.distance(*at(time + 1e-6), want=("penetration",)).distance.max() < 0.0
    owner = np.repeat(np.arange(len(hit)), np.diff(answer.point_offsets)[hit])
    points = np.concatenate([points_of(answer, i) for i in hit])
    singles = gs.Polygons(points, np.arange(len(points) + 1))
    for side in moved:
        rings = polygons(*(side[int(k)] for k in owner))
        assert np.abs(gs.distance(rings, singles).distance).max() < 1e-13
    # The normal separates them: a lies behind it, b in front.
    for k, i in enumerate(hit):
        heights = moved[0][k] @ answer.normal[i], moved[1][k] @ answer.normal[i]
        assert heights[0].max() - heights[1].min() < 1e-12


# ----------------------------------------------------------------------------------------------- other shapes


def test_far_from_the_origin(rng):
    """Millimetre polygons a thousand kilometres out: coordinates are taken relative to one of them."""
    for _ in range(40):
        center = rng.uniform(-1e6, 1e6, 2)
        a = center + 1e-3 * Turn(rng, 1.0).ring(random_ring(rng, 3))
        b = center + 1e-2 * rng.uniform(-1, 1, 2) + 1e-3 * Turn(rng, 1.0).ring(random_ring(rng, 3))
        velocity = (a.mean(axis=0) - b.mean(axis=0)) * rng.uniform(0.1, 10.0)
        answer = contact(a, b, (0, 0), velocity)
        truth = exact.first_contact(a.tolist(), (0, 0), b.tolist(), velocity.tolist(), INF)
        given = reproducer(a=a, b=b, velocity=velocity)
        margin = 1e-12 * 1e-2
        if abs(float(truth.separation_sq)) > margin**2 and (truth.hits and truth.last_time > truth.time):
            assert answer.status[0] == STATUS[truth.status], given
            assert Fraction(answer.time_lower[0]) <= truth.time <= Fraction(answer.time_upper[0]), given


def test_slender_polygons(rng):
    """Slivers, needles and nearly parallel edges: nothing is missed, and no hit is further off than the slack."""
    reached = Counter()
    for _ in range(500):
        a, b, along = slender_pair(rng)
        apart = np.mean(a, axis=0) - np.mean(b, axis=0)
        velocity = rng.choice([1.0, -1.0]) * along
        if rng.random() < 0.7:
            velocity = apart * rng.uniform(0.1, 2.0) + rng.normal(size=2) * 10.0 ** -rng.integers(0, 16)
        if rng.random() < 0.5:
            b = hull(np.array(b) - rng.uniform(0, 3) * velocity)
        velocity = tuple(map(float, velocity))
        t_max = INF if rng.random() < 0.7 else float(rng.uniform(0, 3))
        answer = contact(a, b, (0, 0), velocity, t_max=t_max)
        truth = exact.first_contact(a, (0, 0), b, velocity, t_max)
        given = reproducer(a=a, b=b, velocity=velocity, t_max=t_max)
        status, expected = answer.status[0], STATUS[truth.status]
        reached[truth.status] += 1
        if status == gs.NEVER:
            assert expected == gs.NEVER, given
            continue
        lower, time, upper, last = (
            float(x[0]) for x in (answer.time_lower, answer.time, answer.time_upper, answer.last_time)
        )
        assert 0.0 <= lower <= time <= upper <= t_max and time <= last <= t_max, given
        assert len(answer.points) > 0 and np.isfinite(answer.points).all(), given
        reach = np.abs(np.array(a + b) - a[0]).max()
        slack = Fraction(2.0**-41 * reach) ** 2
        if expected == gs.NEVER:
            speed = np.abs(velocity).max()
            passed = Fraction(min(t_max, 6.0 * reach / speed) if speed > 0 else 0.0)
            swept = b + [(x + passed * Fraction(velocity[0]), y + passed * Fraction(velocity[1])) for x, y in
                         ((Fraction(x), Fraction(y)) for x, y in b)]  # fmt: skip
            assert exact.separation(a, swept).signed_square <= slack, given
            reached["within the slack"] += 1
        elif status != expected:
            assert abs(truth.separation_sq) <= slack, given
        else:
            assert Fraction(lower) <= truth.time <= Fraction(upper), given
            if status == gs.WILL_TOUCH and len(answer.points) == len(truth.contact):
                corners = [[float(c) for c in p] for p in truth.contact]
                assert set_distance(answer.points, corners) <= 1e-11 * reach, given
    assert min(reached[k] for k in (*STATUS, "within the slack")) >= 10, reached


@pytest.mark.parametrize("width", [1e-1, 1e-6, 1e-9, 1e-12, 0.0])
def test_needles_meet_tip_to_tip(width):
    """However thin they are: the edges around the tips see neither gap nor speed any more, the tips still do."""
    a = [(0.0, 0.0), (1e6, -width), (1e6, width)][: 3 if width else 2]
    answer = contact(a, [(-2.0 - x, -y) for x, y in a], (0, 0), (1.0, 0.0))
    assert answer.status[0] == gs.WILL_TOUCH
    assert answer.time[0] == 2.0 and answer.time_lower[0] <= 2.0 <= answer.time_upper[0]
    assert set_distance(answer.points, [(0.0, 0.0)]) == 0.0


@pytest.mark.parametrize("width", [1e-290, 1e-308, 1e-320])
def test_needles_cut_off_bluntly(width):
    """The edge across the tip is all that bounds the needle there, however short it is."""
    a = [(0.0, -width), (1e6, -1e-9), (1e6, 1e-9), (0.0, width)]
    b = [(-2.0 - x, -y) for x, y in a]
    answer = contact(a, b, (0, 0), (1.0, 0.0))
    assert answer.status[0] == gs.WILL_TOUCH and answer.time[0] == 2.0
    assert contact(a, b, (0, 0), (0.0, 1.0)).status[0] == gs.NEVER


def test_misses_beyond_the_tip_of_a_needle_are_seen():
    """Near a sharp tip every edge normal sees a gap far below rounding; the tip's own axis sees all of it."""
    needle = [(0.0, 0.0), (1e6, -1e-6), (1e6, 1e-6)]
    mirrored = [(-1e-4, 0.0), (-1e6, 1e-6), (-1e6, -1e-6)]
    assert contact(needle, mirrored, (0, 0), (0.0, 1.0)).status[0] == gs.NEVER
    assert contact(needle, shifted(mirrored, 2e-4, 0.0), (0, 0), (0.0, 1.0)).status[0] != gs.NEVER
    assert contact(needle, shifted(mirrored, 0.0, -1.0), (0, 0), (0.0, 1.0)).status[0] == gs.NEVER
    assert contact(needle, shifted(mirrored, 2e-4, -1.0), (0, 0), (0.0, 1.0)).status[0] == gs.WILL_TOUCH


def test_times_beyond_the_doubles_are_never_and_below_are_zero():
    far = contact(SQUARE, shifted(SQUARE, 3, 0), (0, 0), (-5e-324, 0.0))
    assert far.status[0] == gs.NEVER
    quick = contact(np.array(SQUARE) * 1e-200, shifted(np.array(SQUARE) * 1e-200, 3e-200, 0), (0, 0), (-1e200, 0))
    assert quick.status[0] == gs.WILL_TOUCH
    assert 0.0 == quick.time_lower[0] <= quick.time[0] <= quick.time_upper[0] <= 5e-324


def test_differences_beyond_the_doubles():
    big = 1.7e308
    a = [(-big, 0.0), (-big / 2, 0.0), (-big / 2, big / 4), (-big, big / 4)]
    b = [(big / 2, 0.0), (big, 0.0), (big, big / 4), (big / 2, big / 4)]
    answer = contact(a, b, (big / 4, 0.0), (-big / 4, 0.0))
    assert answer.status[0] == gs.WILL_TOUCH
    assert answer.time[0] == pytest.approx(2.0) and len(answer.points) == 2
    answer = contact([(x / 8, y / 8) for x, y in a], [(x / 8, y / 8) for x, y in b], (big, 0.0), (-big, 0.0))
    assert answer.time[0] == pytest.approx(0.0625)


# Powers of two from the smallest double to the largest: 2^-1063 is 1e-320, 2^996 is 7e299.
EXTREMES = [-1074, -1070, -1063, -1022, -1000, -537, -200, 0, 500, 996, 1000, 1020]


def extreme_pairs(rng, exponent, count):
    """Rings of small whole multiples of 2^exponent, most of them near each other."""
    for _ in range(count):
        a, b = random_ring(rng, 4), random_ring(rng, 4)
        offset = rng.integers(-4, 5, 2) * int(rng.random() < 0.7)
        yield tuple([(math.ldexp(x, exponent), math.ldexp(y, exponent)) for x, y in ring]
                    for ring in (a, shifted(b, *map(int, offset))))  # fmt: skip


def check_corners(answer, truth, size, given):
    """The contact set, up to roundings of the scene and whole multiples of 2^-1074."""
    corners = [[float(c) for c in p] for p in truth.contact]
    finest = 2.0 * 2.0**-1074
    assert len(answer.points) > 0 and np.isfinite(answer.points).all(), given
    off = [np.abs(np.subtract(corners, p)).max(axis=1).min() for p in answer.points]
    assert max(off) <= 2.0**-46 * size + finest, given
    if size >= 2.0**-1000:  # else corners are rounded into others, or into the line between others
        assert len(answer.points) == len(corners), given


@pytest.mark.parametrize("exponent", EXTREMES)
def test_at_relative_rest_contact_is_now_or_never(rng, exponent):
    reached = Counter()
    for a, b in extreme_pairs(rng, exponent, 120):
        velocity = rng.choice([0.0, 1.0, 0.1, 5e-324, 1e300], 2)
        t_max = float(rng.choice([0.0, 5e-324, 1e-300, 1.0, 1e300, INF]))
        answer = contact(a, b, velocity, velocity, t_max=t_max)
        truth = exact.first_contact(a, (0, 0), b, (0, 0), t_max)
        given = reproducer(a=a, b=b, velocity=velocity, t_max=t_max)
        assert answer.status[0] == STATUS[truth.status] != gs.WILL_TOUCH, given
        reached[truth.status] += 1
        if truth.hits:
            assert answer.time[0] == 0.0 and answer.last_time[0] == t_max, given
            check_corners(answer, truth, np.abs(np.array(a + b)).max(), given)
    assert min(reached[k] for k in ("NEVER", "TOUCHING", "OVERLAPPING")) >= 5, reached


@pytest.mark.parametrize("exponent", EXTREMES)
def test_moving_bodies_of_extreme_size(rng, exponent):
    """At speeds in proportion to the size, and so fast or slow that times are far from one second."""
    reached = Counter()
    for a, b in extreme_pairs(rng, exponent, 120):
        speed = int(np.clip(exponent + rng.choice([0, -500, 500, 1100]), -1074, 1018))
        way = np.mean(np.ldexp(a, -exponent), axis=0) - np.mean(np.ldexp(b, -exponent), axis=0)
        way = np.round(way / np.abs(way).max() * 8.0) if way.any() else np.ones(2)
        velocity = tuple(math.ldexp(c, speed) for c in way)
        answer = contact(a, b, (0, 0), velocity)
        truth = exact.first_contact(a, (0, 0), b, velocity, INF)
        given = reproducer(a=a, b=b, velocity=velocity)
        assert answer.status[0] == STATUS[truth.status], given
        reached[truth.status] += 1
        if truth.hits:
            assert Fraction(answer.time_lower[0]) <= truth.time <= Fraction(answer.time_upper[0]), given
            assert answer.time[0] == pytest.approx(float(truth.time), rel=TIME_ERROR, abs=5e-324), given
            check_corners(answer, truth, np.abs(np.array(a + b)).max(), given)
    assert min(reached["WILL_TOUCH"], reached["OVERLAPPING"]) >= 5, reached


def test_tiny_bodies_on_a_far_line():
    """One coordinate is the same all over the pair and overflows in units of its size."""
    a, b = [(1e10, 0.0)], [(1e10, 2e-300)]
    answer = contact(a, b, (1.0, 0.0), (1.0, -1e-300))
    assert answer.time[0] == pytest.approx(2.0) and answer.points.tolist() == [[1e10 + 2.0, 0.0]]
    answer = contact([*a, *b], [(1e10, 1e-300), (1e10, 3e-300)])
    assert answer.points[:, 0].tolist() == [1e10, 1e10]


# ------------------------------------------------------------------------------------------------------ batch


def test_broadcasting(batch):
    a, b, va, w = batch
    for one, many in ((a[:1], b), (a, b[:1])):
        answer = solve(one, many, va[0], w)
        single = [solve(one[i % len(one) :][:1], many[i % len(many) :][:1], va[0], w[i]) for i in range(0, 500, 50)]
        for k, other in zip(range(0, 500, 50), single, strict=True):
            assert answer.status[k] == other.status[0]
            np.testing.assert_array_equal(answer.time[k], other.time[0])
            np.testing.assert_array_equal(points_of(answer, k), points_of(other))


def test_without_contact_set(batch):
    a, b, va, w = batch
    full, lean = solve(a, b, va, va + w), solve(a, b, va, va + w, contact_set=False)
    np.testing.assert_array_equal(full.time, lean.time)
    np.testing.assert_array_equal(full.normal, lean.normal)
    assert lean.points.shape == (0, 2) and not lean.point_offsets.any() and len(lean.point_offsets) == 501


def test_empty_batch():
    nothing = gs.Polygons(np.zeros((0, 2)), [0])
    answer = gs.first_contact(nothing, nothing, (0, 0), (0, 0))
    assert len(answer.time) == 0 and answer.point_offsets.tolist() == [0]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"velocity_a": (0.0, np.nan)}, "velocity_a"),
        ({"velocity_b": np.zeros((3, 2))}, "velocity_b"),
        ({"velocity_b": (0.0, 0.0, 0.0)}, "velocity_b"),
        ({"t_max": -1.0}, "t_max"),
        ({"t_max": np.nan}, "t_max"),
        ({"b": polygons(SQUARE, SQUARE, SQUARE)}, "same length"),
    ],
)
def test_bad_input_is_named(change, message):
    inputs = {"a": polygons(SQUARE, SQUARE), "b": polygons(SQUARE, SQUARE), "velocity_a": (0, 0), "velocity_b": (0, 0)}
    with pytest.raises(gs.GeometryError, match=message):
        gs.first_contact(**{**inputs, **change})


def test_a_million_pairs():
    count = 1_000_000
    square = np.tile(SQUARE, (count, 1))
    offsets = np.arange(count + 1) * 4
    distance = 2.0 + np.arange(count) % 7
    a = gs.Polygons(square, offsets)
    b = gs.Polygons(square + np.repeat(np.stack([distance, np.full(count, 0.5)], axis=1), 4, axis=0), offsets)
    answer = gs.first_contact(a, b, (0.0, 0.0), (-1.0, 0.0))
    assert (answer.status == gs.WILL_TOUCH).all()
    np.testing.assert_array_equal(answer.time, distance - 1.0)
    np.testing.assert_array_equal(answer.point_offsets, 2 * np.arange(count + 1))
