# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""First contact of translating polytopes and boxes: hard cases, constructed answers, laws, and the exact oracle."""

from __future__ import annotations

import math
from collections import Counter
from fractions import Fraction

import numpy as np
import pytest
from conftest import hard_cases, reproducer
from contact_answers import STATUS, points_of, set_distance
from oracle import moving_polytope as exact
from oracle.vectors import nearest_double
from polytope_scenes import (
    CUBE,
    OCTAHEDRON,
    Turn,
    box_corners,
    polytopes,
    random_pair,
    rotation,
    shifted,
    slender_pair,
    spherical,
)

import geomsrv as gs
from geomsrv import _core

INF = math.inf

# What float64 decides about a time is good to this relative error, or it is found exactly (kSharp).
TIME_ERROR = 2.0**-44
# Contact sets are told apart down to this part of the scene (kLargestSlack).
LARGEST_SLACK = 2.0**-42
# Contact points of bodies of a few units, given by a few bits; an allowance, far above what float64 loses there.
POINTS_ERROR = 1e-11
# A rotated copy is off by some 1e-15 of its place; where it meets a facet at a shallow angle, time and place of contact
# are off by that over the sine of the angle.  Allowances for angles down to about 1e-5, not bounds.
TURNED_TIME_ERROR = 1e-9

# Vertices of what hulls share [m]: off by some 1e-15, and crossings by as much over the angle, which is above 1e-3.
SHARED_ERROR = 1e-12
TURNED_POINTS_ERROR = 1e-10


def contact(a, b, velocity_a=(0.0, 0.0, 0.0), velocity_b=(0.0, 0.0, 0.0), **options):
    """Answer for one pair."""
    return gs.first_contact(polytopes(a), polytopes(b), velocity_a, velocity_b, **options)


def rounded(points):
    return sorted(tuple(nearest_double(c) for c in p) for p in points)


def check_exact(answer, i, truth, given):
    """Everything the exact tier promises."""
    assert answer.status[i] == STATUS[truth.status] and answer.certain[i], given
    points = points_of(answer, i)
    if not truth.hits:
        numbers = (answer.time, answer.time_lower, answer.time_upper, answer.last_time, answer.closing_speed)
        assert all(np.isnan(x[i]) for x in numbers) and np.isnan(answer.normal[i]).all() and len(points) == 0, given
        return
    assert answer.time[i] == nearest_double(truth.time), given
    lower, upper = float(answer.time_lower[i]), float(answer.time_upper[i])
    assert upper in (lower, math.nextafter(lower, INF)), given
    if math.isfinite(upper):
        assert Fraction(lower) <= truth.time <= Fraction(upper), given
        assert (lower == upper) == (Fraction(lower) == truth.time), given
    assert answer.last_time[i] == (INF if truth.last_time is None else nearest_double(truth.last_time)), given
    assert sorted(map(tuple, points.tolist())) == rounded(truth.contact), given
    if truth.status == "OVERLAPPING":
        assert np.isnan(answer.normal[i]).all() and np.isnan(answer.closing_speed[i]), given
    else:
        assert abs(np.linalg.norm(answer.normal[i]) - 1.0) <= 2.0**-51, given


def check_float(answer, i, truth, t_max, given):
    """What float64 promises of any pair: no miss, and bounds that hold."""
    status = answer.status[i]
    if truth.hits:
        assert status != gs.NEVER, given
    if answer.certain[i]:
        assert status == STATUS[truth.status], given
    if status == gs.NEVER:
        return
    lower, time, upper = (float(x[i]) for x in (answer.time_lower, answer.time, answer.time_upper))
    assert 0.0 <= lower <= time <= upper <= t_max and time <= answer.last_time[i] <= t_max, given
    assert len(points_of(answer, i)) > 0, given
    assert status == gs.OVERLAPPING or np.isfinite(answer.normal[i]).all(), given
    if truth.hits:
        assert Fraction(lower) <= truth.time, given
        assert upper == INF or truth.time <= Fraction(upper), given


def check_bound(answer, i, truth, t_max, given):
    """What bounding volumes promise: no miss, NEVER for certain, and times around all contact there is."""
    status = answer.status[i]
    assert answer.certain[i] == (status == gs.NEVER), given
    if status == gs.NEVER:
        assert not truth.hits and np.isnan(answer.time[i]), given
        return
    assert status == (gs.WILL_TOUCH if answer.time[i] > 0.0 else gs.TOUCHING), given
    lower, upper = float(answer.time_lower[i]), float(answer.time_upper[i])
    assert lower == answer.time[i] <= upper == answer.last_time[i] <= t_max, given
    assert np.isnan(answer.normal[i]).all() and np.isnan(answer.closing_speed[i]), given
    assert len(points_of(answer, i)) == 0, given
    if truth.hits:
        assert Fraction(lower) <= truth.time, given
        assert upper == INF or (truth.last_time is not None and truth.last_time <= Fraction(upper)), given


# ------------------------------------------------------------------------------------------------- hard cases


class Case:
    """A hard case as the engine and the oracle take it."""

    def __init__(self, case, accuracy):
        values = case["input"]
        a, b = ([tuple(float.fromhex(c) for c in v) for v in values[k]["vertices"]] for k in "PQ")
        velocity_a, velocity_b = (tuple(float.fromhex(c) for c in values[k]) for k in ("velP", "velQ"))
        self.t_max = float.fromhex(values["tmax"])
        self.answer = contact(a, b, velocity_a, velocity_b, t_max=self.t_max, accuracy=accuracy)
        self.truth = exact.first_contact(a, velocity_a, b, velocity_b, self.t_max)
        self.given = reproducer(a=a, b=b, velocity_a=velocity_a, velocity_b=velocity_b, t_max=self.t_max)


CASES = hard_cases("polyhedra_moving")
DECIDABLE = hard_cases("polyhedra_moving", "double", "careful_double")


@pytest.mark.parametrize("case", DECIDABLE, ids=lambda case: case["id"])
def test_decidable_hard_case(case):
    it, expected = Case(case, "float64"), case["answer"]
    answer, truth = it.answer, it.truth
    assert answer.status[0] == STATUS[truth.status] and answer.certain[0], it.given
    assert (answer.status[0] != gs.NEVER) == expected["hits"]
    if not expected["hits"]:
        assert len(answer.points) == 0
        return
    time, last = Fraction(expected["time"]), Fraction(expected["last_time"])
    assert abs(Fraction(float(answer.time[0])) - time) <= Fraction(TIME_ERROR) * time, it.given
    assert abs(Fraction(float(answer.last_time[0])) - last) <= Fraction(TIME_ERROR) * last, it.given
    corners = [tuple(float(Fraction(c)) for c in v) for v in expected["contact"]]
    scale = float.fromhex(case["margin"]["scale_world"])
    if case["class"] == "near_parallel_ridge" and len(answer.points) != len(corners):
        # Edges that cross at less than the slack are parallel for float64: then it is the segment about the point.
        assert "1e-14 rad" in case["why"] and len(answer.points) == 2
        return
    assert len(answer.points) == len(corners), it.given
    assert set_distance(answer.points, corners) <= 2.0**-45 * scale, it.given


@pytest.mark.parametrize("case", CASES, ids=lambda case: case["id"])
def test_every_hard_case_is_right_at_exact(case):
    it, expected = Case(case, "exact"), case["answer"]
    check_exact(it.answer, 0, it.truth, it.given)
    assert (it.answer.status[0] != gs.NEVER) == expected["hits"]
    if expected["hits"]:
        assert it.answer.time[0] == float.fromhex(expected["time_f"])
        corners = [tuple(float.fromhex(c) for c in v) for v in expected["contact_f"]]
        assert sorted(map(tuple, it.answer.points.tolist())) == sorted(corners)


@pytest.mark.parametrize("case", CASES, ids=lambda case: case["id"])
def test_bounds_hold_in_every_hard_case(case):
    for tier, check in (("float64", check_float), ("bound", check_bound)):
        it = Case(case, tier)
        check(it.answer, 0, it.truth, it.t_max, it.given)


def test_hard_cases_are_all_there():
    assert len(CASES) >= 50 and len(DECIDABLE) >= 35


# ---------------------------------------------------------------------------------------- constructed answers


SIDE = [(1, 0.5, 0.25), (1, 1, 0.25), (1, 1, 1), (1, 0.5, 1)]
CONSTRUCTED = {
    # name: (a, b, velocity of b, t_max, status, time, last time, normal, closing speed, contact set)
    "face meets face": (
        CUBE, shifted(CUBE, 3, 0.5, 0.25), (-1, 0, 0), INF, "WILL_TOUCH", 2, 4, (1, 0, 0), 1, SIDE,
    ),
    "vertex meets face": (
        CUBE, shifted(OCTAHEDRON, 4, 0.5, 0.5), (-2, 0, 0), INF, "WILL_TOUCH", 1, 2.5, (1, 0, 0), 2, [(1, 0.5, 0.5)],
    ),
    "vertex meets vertex": (
        OCTAHEDRON, shifted(OCTAHEDRON, 4, 0, 0), (-1, 0, 0), INF, "WILL_TOUCH", 2, 6, None, None, [(1, 0, 0)],
    ),
    "edges cross": (
        [(0, -1, 0), (0, 1, 0), (-1, 0, 0)], [(2, 0, -1), (2, 0, 1), (3, 0, 0)], (-1, 0, 0), INF, "WILL_TOUCH", 2, 4,
        (1, 0, 0), 1, [(0, 0, 0)],
    ),
    "edge lies on face": (
        CUBE, [(2, 0.25, 0.5), (2, 3, 0.5), (3, 0.5, 0.5)], (-1, 0, 0), INF, "WILL_TOUCH", 1, 3, (1, 0, 0), 1,
        [(1, 0.25, 0.5), (1, 1, 0.5)],
    ),
    "flies past a corner": (CUBE, shifted(CUBE, 2, 2, 0), (-1, 1, 0), INF, "NEVER", *[None] * 4, []),
    "parallel flight": (CUBE, shifted(CUBE, 3, 0, 0), (0, 1, 0), INF, "NEVER", *[None] * 4, []),
    "flies away": (CUBE, shifted(CUBE, 3, 0, 0), (1, 0, 0), INF, "NEVER", *[None] * 4, []),
    "at rest, apart": (CUBE, shifted(CUBE, 3, 0, 0), (0, 0, 0), INF, "NEVER", *[None] * 4, []),
    "slides along a face, then meets": (
        CUBE, shifted(CUBE, 3, 1, 0.5), (-1, 0, 0), INF, "WILL_TOUCH", 2, 4, None, None, [(1, 1, 0.5), (1, 1, 1)],
    ),
    "corner to corner": (
        CUBE, shifted(CUBE, 2, 2, 2), (-1, -1, -1), INF, "WILL_TOUCH", 1, 3, None, None, [(1, 1, 1)],
    ),
    "slides corner to corner": (
        CUBE, shifted(CUBE, 3, 1, 1), (-1, 0, 0), INF, "WILL_TOUCH", 2, 4, None, None, [(1, 1, 1)],
    ),
    "touches and slides": (
        CUBE, shifted(CUBE, 1, 0.5, 0.25), (0, 1, 0), INF, "TOUCHING", 0, 0.5, (1, 0, 0), 0, SIDE,
    ),
    "touches and parts": (
        CUBE, shifted(CUBE, 1, 0.5, 0.25), (1, 0, 0), INF, "TOUCHING", 0, 0, (1, 0, 0), -1, SIDE,
    ),
    "touches and enters": (
        CUBE, shifted(CUBE, 1, 0.5, 0.25), (-1, 0, 0), INF, "TOUCHING", 0, 2, (1, 0, 0), 1, SIDE,
    ),
    "touches for ever": (
        CUBE, shifted(CUBE, 1, 0.5, 0.25), (0, 0, 0), INF, "TOUCHING", 0, INF, (1, 0, 0), 0, SIDE,
    ),
    "overlaps": (
        CUBE, shifted(CUBE, 0.5, 0.25, 0.75), (1, 0, 0), INF, "OVERLAPPING", 0, 0.5, None, None,
        [(x, y, z) for x in (0.5, 1) for y in (0.25, 1) for z in (0.75, 1)],
    ),
    "overlaps for ever": (CUBE, CUBE, (0, 0, 0), INF, "OVERLAPPING", 0, INF, None, None, CUBE),
    "one inside the other": (
        CUBE, [(0.25, 0.25, 0.25), (0.5, 0.25, 0.25), (0.25, 0.5, 0.25), (0.25, 0.25, 0.5)], (0, 0, 0), 7.0,
        "OVERLAPPING", 0, 7, None, None,
        [(0.25, 0.25, 0.25), (0.5, 0.25, 0.25), (0.25, 0.5, 0.25), (0.25, 0.25, 0.5)],
    ),
    "segment pierces": (
        CUBE, [(0.5, 0.25, -1), (0.5, 0.25, 2)], (1, 0, 0), INF, "OVERLAPPING", 0, 0.5, None, None,
        [(0.5, 0.25, 0), (0.5, 0.25, 1)],
    ),
    "point inside": (CUBE, [(0.5, 0.5, 0.5)], (0, 0, 1), INF, "OVERLAPPING", 0, 0.5, None, None, [(0.5, 0.5, 0.5)]),
    "point meets point": ([(0, 0, 0)], [(2, 4, 6)], (-1, -2, -3), INF, "WILL_TOUCH", 2, 2, None, None, [(0, 0, 0)]),
    "point misses point": ([(0, 0, 0)], [(2, 4, 6)], (-1, -2, -2.875), INF, "NEVER", *[None] * 4, []),
    "point on point": ([(1, 2, 3)], [(1, 2, 3)], (0, 0, 0), INF, "TOUCHING", 0, INF, None, 0, [(1, 2, 3)]),
    "collinear segments meet": (
        [(0, 0, 0), (1, 0, 0)], [(3, 0, 0), (4, 0, 0)], (-1, 0, 0), INF, "WILL_TOUCH", 2, 4, None, None, [(1, 0, 0)],
    ),
    "coplanar squares meet": (
        [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], [(3, 0.5, 0), (4, 0.5, 0), (4, 1.5, 0), (3, 1.5, 0)], (-1, 0, 0),
        INF, "WILL_TOUCH", 2, 4, None, None, [(1, 0.5, 0), (1, 1, 0)],
    ),
    "crossing squares touch": (
        [(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)], [(0, -1, -1), (0, 1, -1), (0, 1, 1), (0, -1, 1)], (0, 0, 1),
        INF, "OVERLAPPING", 0, 1, None, None, [(0, -1, 0), (0, 1, 0)],
    ),
    "contact exactly at t_max": (
        CUBE, shifted(CUBE, 3, 0.5, 0.25), (-1, 0, 0), 2.0, "WILL_TOUCH", 2, 2, (1, 0, 0), 1, SIDE,
    ),
    "contact after t_max": (CUBE, shifted(CUBE, 3, 0, 0), (-1, 0, 0), 1.9375, "NEVER", *[None] * 4, []),
    "repeated and inner points": (
        [*CUBE, *CUBE, (0.5, 0.5, 0.5), (1, 0.5, 0.5), (1, 0.5, 0)],
        [*shifted(CUBE, 3, 0.5, 0.25), (3, 1, 0.5), (3, 0.5, 0.5)], (-1, 0, 0), INF, "WILL_TOUCH", 2, 4, (1, 0, 0), 1,
        SIDE,
    ),
}  # fmt: skip


@pytest.mark.parametrize("accuracy", ["float64", "exact"])
@pytest.mark.parametrize("swap", [False, True], ids=["", "swapped"])
@pytest.mark.parametrize("name", CONSTRUCTED)
def test_constructed(name, swap, accuracy):
    a, b, velocity, t_max, status, time, last, normal, speed, corners = CONSTRUCTED[name]
    order = (b, a, velocity, (0.0,) * 3) if swap else (a, b, (0.0,) * 3, velocity)
    answer = contact(*order, t_max=t_max, accuracy=accuracy)
    assert answer.status[0] == STATUS[status] and answer.certain[0]
    assert len(answer.points) == len(corners)
    if status == "NEVER":
        return
    assert (answer.time[0], answer.last_time[0]) == (time, last)
    assert answer.time_lower[0] <= time <= answer.time_upper[0]
    assert set_distance(answer.points, corners) <= (0.0 if accuracy == "exact" else 2.0**-51)
    if status == "OVERLAPPING":
        assert np.isnan(answer.normal).all() and np.isnan(answer.closing_speed).all()
        return
    assert abs(np.linalg.norm(answer.normal[0]) - 1.0) <= 2.0**-51
    relative = np.subtract(order[3], order[2])
    assert answer.closing_speed[0] == pytest.approx(-answer.normal[0] @ relative, abs=1e-15)
    if normal is not None:
        assert set_distance(answer.normal, [np.negative(normal) if swap else normal]) == 0.0
    if speed is not None:
        assert answer.closing_speed[0] == speed


def test_contact_polygons_run_counterclockwise_about_the_normal():
    for accuracy in ("float64", "exact"):
        for order in ((CUBE, shifted(CUBE, 3, 0.5, 0.25)), (shifted(CUBE, 3, 0.5, 0.25), CUBE)):
            answer = contact(*order, (1.0 if order[0] is CUBE else -1.0, 0.0, 0.0), accuracy=accuracy)
            ring = answer.points
            turns = np.cross(np.roll(ring, -1, 0) - ring, np.roll(ring, -2, 0) - np.roll(ring, -1, 0))
            assert len(ring) == 4 and (turns @ answer.normal[0] > 0.0).all()


def test_the_exact_normal_is_that_of_the_fastest_approach():
    # Where two edges meet end to end, any direction between the two faces is a normal; b comes along (3, 1, 0).
    answer = contact(CUBE, shifted(CUBE, 4, 2, 0), (0, 0, 0), (-3, -1, 0), accuracy="exact")
    assert answer.status[0] == gs.WILL_TOUCH and answer.time[0] == 1.0
    assert answer.normal[0] == pytest.approx(np.array([3, 1, 0]) / math.sqrt(10), abs=2.0**-53)
    assert answer.closing_speed[0] == math.sqrt(10)


# ----------------------------------------------------------------------------------------------------- oracle


@pytest.mark.parametrize("size", [1, 2, 4])
def test_against_the_oracle(rng, size):
    """Integer pairs, many of them touching, grazing or sliding: everything, at both tiers."""
    pairs = [random_pair(rng, size) for _ in range(250)]
    t_max = float(rng.choice([INF, 2.0]))
    given = (
        polytopes(*(a for a, _, _, _ in pairs)),
        polytopes(*(b for _, _, b, _ in pairs)),
        np.array([va for _, va, _, _ in pairs], float),
        np.array([vb for _, _, _, vb in pairs], float),
    )
    sharp, plain, rough = (
        gs.first_contact(*given, t_max=t_max, accuracy=tier) for tier in ("exact", "float64", "bound")
    )
    reached = Counter()
    for i, (a, va, b, vb) in enumerate(pairs):
        truth = exact.first_contact(a, va, b, vb, t_max)
        text = reproducer(a=a, velocity_a=va, b=b, velocity_b=vb, t_max=t_max)
        check_exact(sharp, i, truth, text)
        check_float(plain, i, truth, t_max, text)
        check_bound(rough, i, truth, t_max, text)
        reached["surely never"] += rough.status[i] == gs.NEVER
        # Coordinates of a few bits: float64 has the same answer.
        assert plain.status[i] == STATUS[truth.status], text
        reached[truth.status] += 1
        if truth.hits:
            assert plain.time[i] == pytest.approx(sharp.time[i], rel=1e-12), text
            assert plain.last_time[i] == pytest.approx(sharp.last_time[i], rel=1e-12), text
            assert len(points_of(plain, i)) == len(truth.contact), text
            assert set_distance(points_of(plain, i), rounded(truth.contact)) <= POINTS_ERROR, text
            reached["grazing"] += truth.time == truth.last_time and truth.time > 0
            reached[len(truth.contact)] += 1
    assert min(reached[k] for k in STATUS) >= 5 and min(reached[k] for k in (1, 2, 4)) >= 3, reached
    assert reached["grazing"] >= 3 and reached["surely never"] > 0.5 * reached["NEVER"], reached


@pytest.mark.parametrize("shift", [0.0, 100.0])
def test_rotated_copies_keep_their_kind(rng, shift):
    """Rotation turns exact contacts into gaps and overlaps of a rounding error; none may be lost at float64.

    Its time is within the bounds.  The numbers are sharp, too, but for a few pairs: which facet a line slides along
    that grazes within rounding is a guess.
    """
    reached = Counter()
    off = []
    for _ in range(250):
        a, va, b, vb = random_pair(rng, 3)
        truth = exact.first_contact(a, va, b, vb, INF)
        turn = Turn(rng, shift)
        moved = (turn.body(a), turn.body(b), turn.vector(va), turn.vector(vb))
        answer = contact(*moved)
        given = reproducer(a=moved[0], b=moved[1], velocity_a=moved[2], velocity_b=moved[3])
        assert answer.status[0] == STATUS[truth.status], given
        reached[truth.status] += 1
        if truth.hits:
            slow, last = 1e-12 * (1.0 + shift), INF if truth.last_time is None else float(truth.last_time)
            time = float(truth.time)
            assert answer.time_lower[0] <= time * (1 + TURNED_TIME_ERROR) + slow, given
            assert time * (1 - TURNED_TIME_ERROR) - slow <= answer.time_upper[0], given
            corners = turn.body([[float(c) for c in p] for p in truth.contact])
            sharp = (
                answer.time[0] == pytest.approx(time, rel=TURNED_TIME_ERROR, abs=slow)
                and answer.last_time[0] == pytest.approx(last, rel=TURNED_TIME_ERROR, abs=slow)
                and set_distance(answer.points, corners) <= TURNED_POINTS_ERROR * (1.0 + shift)
            )
            off += [] if sharp else [given]
    assert len(off) <= 5, "\n".join(off)
    assert min(reached[k] for k in STATUS) >= 5, reached


def test_nearly_degenerate_pairs_are_right_at_exact(rng):
    """Slabs, needles and points, nearly parallel, grazing and sliding: nothing is uncertain, nothing is wrong."""
    reached = Counter()
    for _ in range(300):
        a, va, b, vb = slender_pair(rng)
        t_max = float(rng.choice([INF, 1.0, 2.0]))
        truth = exact.first_contact(a.tolist(), va.tolist(), b.tolist(), vb.tolist(), t_max)
        given = reproducer(a=a, velocity_a=va, b=b, velocity_b=vb, t_max=t_max)
        check_exact(contact(a, b, va, vb, t_max=t_max, accuracy="exact"), 0, truth, given)
        check_float(contact(a, b, va, vb, t_max=t_max), 0, truth, t_max, given)
        check_bound(contact(a, b, va, vb, t_max=t_max, accuracy="bound"), 0, truth, t_max, given)
        reached[truth.status] += 1
    assert min(reached[k] for k in STATUS) >= 5, reached


@pytest.mark.parametrize("scale", [1e-300, 1e-200, 1e-100, 1e100, 1e200, 1e300])
@pytest.mark.parametrize("speed", [1.0, 1e-200, 1e200])
def test_any_scale_at_exact(rng, scale, speed):
    for _ in range(6):
        a, va, b, vb = random_pair(rng, 3)
        a, b = (np.asarray(body, float) * scale for body in (a, b))
        va, vb = (np.asarray(v, float) * speed for v in (va, vb))
        truth = exact.first_contact(a.tolist(), va.tolist(), b.tolist(), vb.tolist(), INF)
        given = reproducer(a=a, velocity_a=va, b=b, velocity_b=vb)
        check_exact(contact(a, b, va, vb, accuracy="exact"), 0, truth, given)
        check_float(contact(a, b, va, vb), 0, truth, INF, given)
        check_bound(contact(a, b, va, vb, accuracy="bound"), 0, truth, INF, given)


# ------------------------------------------------------------------------------------------------------ boxes


def random_boxes(rng, count, skew=0.0):
    axes = np.array([rotation(rng) for _ in range(count)]) + skew * rng.uniform(-1, 1, (count, 3, 3))
    return rng.uniform(-4, 4, (count, 3)), axes, rng.uniform(0.1, 1.0, (count, 3))


@pytest.mark.parametrize("skew", [0.0, 1e-12, 2e-3], ids=["orthonormal", "drifted", "skew"])
def test_boxes_are_taken_literally(rng, skew):
    reached = Counter()
    center, axes, half = random_boxes(rng, 120, skew)
    half[::10, int(rng.integers(3))] = 0.0
    axes[1::4] = axes[0::4]
    half[1::8] = half[0::8]
    a, b = gs.Boxes(center[0::2], axes[0::2], half[0::2]), gs.Boxes(center[1::2], axes[1::2], half[1::2])
    velocity = (a.center - b.center) * rng.uniform(-0.5, 2.0, (60, 1)) + rng.uniform(-0.5, 0.5, (60, 3))
    velocity[::6] = b.axes[::6, 0]
    zero = np.zeros(3)
    sharp, plain, rough = (
        gs.first_contact(a, b, zero, velocity, accuracy=tier) for tier in ("exact", "float64", "bound")
    )
    for i in range(60):
        corners = box_corners(a, i), box_corners(b, i)
        truth = exact.first_contact(corners[0], zero, corners[1], velocity[i].tolist(), INF)
        given = reproducer(center=center[2 * i : 2 * i + 2], axes=axes[2 * i : 2 * i + 2], velocity=velocity[i])
        check_exact(sharp, i, truth, given)
        check_float(plain, i, truth, INF, given)
        check_bound(rough, i, truth, INF, given)
        assert plain.certain[i] and plain.status[i] == STATUS[truth.status], given
        if truth.hits:
            assert plain.time[i] == pytest.approx(float(truth.time), rel=TIME_ERROR), given
            assert plain.last_time[i] == pytest.approx(float(truth.last_time), rel=TIME_ERROR), given
        reached[truth.status] += 1
    assert reached["WILL_TOUCH"] >= 15 and reached["NEVER"] >= 5, reached


def test_boxes_and_hulls_mix(rng):
    """Half extents of a few bits and axes along the world's: corners are exact, so every way to give them agrees."""
    n = 40
    center, half = rng.integers(-6, 7, (2 * n, 3)).astype(float), rng.integers(1, 5, (2 * n, 3)) / 2.0
    axes = np.tile(np.eye(3), (n, 1, 1))
    a, b = gs.Boxes(center[:n], axes, half[:n]), gs.Boxes(center[n:], axes, half[n:])
    hull_a, hull_b = (polytopes(*boxes.corners()) for boxes in (a, b))
    velocity = rng.integers(-2, 3, (n, 3)).astype(float)
    for tier in ("float64", "exact"):
        answers = [gs.first_contact(x, y, (0, 0, 0), velocity, accuracy=tier) for x in (a, hull_a) for y in (b, hull_b)]
        assert len({tuple(x.status) for x in answers}) == 1
        for other in answers[1:]:
            np.testing.assert_allclose(other.time, answers[0].time, rtol=1e-15)
            np.testing.assert_allclose(other.last_time, answers[0].last_time, rtol=1e-15)
            assert (other.point_offsets == answers[0].point_offsets).all()


def test_one_against_many(rng):
    a, many = spherical(rng, 12), [spherical(rng, int(rng.integers(4, 20))) + rng.uniform(-6, 6, 3) for _ in range(30)]
    velocity = rng.uniform(-0.5, 0.5, (30, 3)) - [body.mean(axis=0) for body in many]
    for tier in ("float64", "exact"):
        both = gs.first_contact(polytopes(a), polytopes(*many), (0, 0, 0), velocity, accuracy=tier)
        flipped = gs.first_contact(polytopes(*many), polytopes(a), velocity, (0, 0, 0), accuracy=tier)
        for i, body in enumerate(many):
            one = contact(a, body, (0, 0, 0), velocity[i], accuracy=tier)
            np.testing.assert_array_equal(one.time[0], both.time[i])
            np.testing.assert_array_equal(points_of(one), points_of(both, i))
        assert (both.status == flipped.status).all() and (both.status != gs.NEVER).any()


def test_without_contact_set(rng):
    a, b = polytopes(CUBE), polytopes(shifted(CUBE, 3, 0, 0))
    for tier in ("float64", "exact"):
        full, bare = (
            gs.first_contact(a, b, (1, 0, 0), (0, 0, 0), accuracy=tier, contact_set=wanted) for wanted in (True, False)
        )
        assert len(full.points) == 4 and len(bare.points) == 0 and bare.point_offsets.tolist() == [0, 0]
        assert full.time == bare.time and (full.normal == bare.normal).all()


@pytest.mark.parametrize("count", [8, 40, 70, 150])
def test_what_hulls_share_has_the_exact_vertices(rng, count):
    """Edges of small hulls are clipped by the heights of all vertices, those of large ones one by one."""
    for _ in range(4):
        a, b = polytopes(spherical(rng, count)), polytopes(spherical(rng, count) + rng.uniform(-0.4, 0.4, 3))
        nearly, exactly = (gs.first_contact(a, b, (0, 0, 1), (0, 0, 0), accuracy=tier) for tier in ("float64", "exact"))
        assert nearly.status == exactly.status == gs.OVERLAPPING
        assert len(exactly.points) > count / 4
        assert set_distance(nearly.points, exactly.points) < SHARED_ERROR
        assert len(nearly.points) == len(exactly.points)


# --------------------------------------------------------------------------------------- boxes by their axes


UNCLEAR = 0  # BoxMotion::Verdict; the others are never, will touch, overlapping
VERDICTS = {1: gs.NEVER, 2: gs.WILL_TOUCH, 3: gs.OVERLAPPING}


def verdicts(a, b, velocity_a, velocity_b, t_max=INF):
    """What the axes alone say."""
    sides = ((boxes.center, boxes.axes, boxes.half_extents) for boxes in (a, b))
    velocities = (
        np.array(np.broadcast_to(v, boxes.center.shape), float) for v, boxes in ((velocity_a, a), (velocity_b, b))
    )
    return _core.box_motion_verdicts_world(*sides, *velocities, float(t_max))


def gap_along_axes(a, b):
    """Where b, moved along the line of centers, touches a: a factor."""
    edges = np.cross(a.axes[:, :, None], b.axes[:, None]).reshape(-1, 9, 3)
    faces = [np.cross(np.roll(x.axes, -1, 1), np.roll(x.axes, -2, 1)) for x in (a, b)]
    normals = np.concatenate([*faces, edges], axis=1)
    widths = sum((np.abs(np.einsum("nki,nji->nkj", normals, x.axes)) * x.half_extents[:, None]).sum(-1) for x in (a, b))
    return (widths / np.abs(np.einsum("nki,ni->nk", normals, b.center - a.center))).min(axis=1)


def moving_boxes(rng, kind, n):
    """Pairs of boxes and the velocities, of which the axes have an easy or a hard time."""
    turns = np.array([[rotation(rng), rotation(rng)] for _ in range(n)])
    axes, other = turns[:, 0], turns[:, 1]
    center, half = rng.uniform(-4, 4, (2, n, 3)), rng.uniform(0.1, 1.0, (2, n, 3))
    at, velocity = np.zeros((n, 3)), (center[0] - center[1]) * rng.uniform(-0.5, 2.0, (n, 1))
    velocity += rng.uniform(-0.5, 0.5, (n, 3))
    if kind == "parallel":
        other = axes[:, rng.permutation(3)]
    elif kind == "nearly parallel":
        other = axes + rng.uniform(-1, 1, (n, 3, 3)) * 10.0 ** rng.uniform(-17, -4, (n, 1, 1))
    elif kind == "skew":
        axes, other = (x + 1e-3 * rng.uniform(-1, 1, (n, 3, 3)) for x in (axes, other))
        other[::3] = axes[::3]
    elif kind == "grid":
        axes = other = np.tile(np.eye(3), (n, 1, 1))
        center, half = rng.integers(-3, 4, (2, n, 3)).astype(float), rng.integers(0, 4, (2, n, 3)) / 2.0
        at, velocity = rng.integers(-2, 3, (2, n, 3)).astype(float)
    elif kind == "turned grid":
        other = axes
        center = np.einsum("kni,nij->knj", rng.integers(-3, 4, (2, n, 3)).astype(float), axes) + 7.0
        half = rng.integers(1, 4, (2, n, 3)) / 2.0
        velocity = np.einsum("ni,nij->nj", rng.integers(-2, 3, (n, 3)).astype(float), axes)
    elif kind == "flat":
        half[rng.random(half.shape) < 0.4] = 0.0
    elif kind == "needles":
        half *= 10.0 ** rng.uniform(-12, 0, half.shape)
        velocity = center[0] - center[1] + 1e-3 * rng.normal(size=(n, 3))
    elif kind == "at rest":
        velocity = at
    elif kind == "any scale":
        length, speed = (10.0 ** rng.choice(x, (n, 1)) for x in ((-300.0, -29.0, 29.0, 300.0), (-200.0, -1.0, 200.0)))
        center, half, velocity = center * length, half * length, velocity * speed
    if kind == "far away":
        center = center + 10.0 ** rng.uniform(2, 8, (n, 1)) * rng.normal(size=(n, 3))
    a, b = gs.Boxes(center[0], axes, half[0]), gs.Boxes(center[1], other, half[1])
    if kind == "about to touch":
        factor = gap_along_axes(a, b) * (1.0 + rng.choice([-1, 0, 1], n) * 10.0 ** rng.uniform(-17, -6, n))
        b = gs.Boxes(a.center + factor[:, None] * (b.center - a.center), other, half[1])
    return a, b, at, velocity


BOX_KINDS = {
    # least share that the axes decide, least share that they leave, of 200 pairs
    "any": (0.99, 0.0),
    "parallel": (0.9, 0.0),
    "nearly parallel": (0.6, 0.01),
    "skew": (0.9, 0.0),
    "grid": (0.6, 0.02),
    "turned grid": (0.6, 0.02),
    "flat": (0.8, 0.0),
    "needles": (0.9, 0.0),
    "at rest": (0.5, 0.0),
    "any scale": (0.0, 0.3),
    "far away": (0.9, 0.0),
    "about to touch": (0.1, 0.3),
}


@pytest.mark.parametrize("t_max", [INF, 1.0])
@pytest.mark.parametrize("kind", BOX_KINDS)
def test_boxes_decided_on_their_axes(rng, kind, t_max):
    """What the axes decide is right and certain, what they leave is answered; against the exact tier."""
    a, b, at, velocity = moving_boxes(rng, kind, 200)
    verdict = verdicts(a, b, at, velocity, t_max)
    plain, sharp = (gs.first_contact(a, b, at, velocity, t_max=t_max, accuracy=tier) for tier in ("float64", "exact"))
    given = reproducer(kind=kind, t_max=t_max)
    decided = verdict != UNCLEAR
    assert BOX_KINDS[kind][0] <= decided.mean() <= 1.0 - BOX_KINDS[kind][1], given
    for value, status in VERDICTS.items():
        assert (plain.status[verdict == value] == status).all(), given
    assert plain.certain[decided].all(), given
    assert (plain.status == sharp.status)[plain.certain].all(), given
    hits = sharp.status != gs.NEVER
    assert (plain.status[hits] != gs.NEVER).all(), given
    assert (plain.time_lower <= sharp.time_upper)[hits].all(), given
    assert (plain.time_upper >= sharp.time_lower)[hits].all(), given
    clear = hits & decided
    np.testing.assert_allclose(plain.time[clear], sharp.time[clear], rtol=TIME_ERROR, err_msg=given)
    np.testing.assert_allclose(plain.last_time[clear], sharp.last_time[clear], rtol=TIME_ERROR, err_msg=given)
    assert (plain.time_lower <= plain.time)[clear].all() and (plain.time <= plain.time_upper)[clear].all(), given
    assert (plain.time_upper - plain.time_lower <= TIME_ERROR * plain.time_upper)[clear].all(), given
    assert (np.diff(plain.point_offsets)[clear] > 0).all(), given
    touch = verdict == 2
    np.testing.assert_allclose(np.linalg.norm(plain.normal[touch], axis=1), 1.0, rtol=2.0**-51)
    closing = -((velocity - at) * plain.normal).sum(axis=1)
    np.testing.assert_allclose(plain.closing_speed[touch], closing[touch], rtol=1e-12, err_msg=given)
    if kind in ("any", "skew", "far away"):
        np.testing.assert_allclose(plain.normal[touch], sharp.normal[touch], atol=1e-12, err_msg=given)


def test_boxes_decided_on_their_axes_against_the_oracle(rng):
    for kind in ("any", "nearly parallel", "flat", "about to touch"):
        a, b, at, velocity = moving_boxes(rng, kind, 12)
        plain, verdict = gs.first_contact(a, b, at, velocity, t_max=2.0), verdicts(a, b, at, velocity, 2.0)
        for i in range(12):
            truth = exact.first_contact(box_corners(a, i), at[i].tolist(), box_corners(b, i), velocity[i].tolist(), 2.0)
            given = reproducer(kind=kind, i=i)
            check_float(plain, i, truth, 2.0, given)
            assert verdict[i] == UNCLEAR or VERDICTS[verdict[i]] == STATUS[truth.status], given


def test_boxes_within_the_slack_are_left_to_the_cast():
    """Coordinates of 2^8 are rounded to 2^-45: boxes closer than some of that touch, as far as float64 knows."""
    far = 2.0**8
    a = gs.Boxes([(far, 0, 0)], [np.eye(3)], [(1, 1, 1)])
    for gap, status, verdict in ((2.0**-42, gs.TOUCHING, UNCLEAR), (2.0**-30, gs.NEVER, 1)):
        b = gs.Boxes([(far + 2 + gap, 0, 0)], [np.eye(3)], [(1, 1, 1)])
        for velocity in ((0, 0, 0), (0, 1, 0), (1, 0, 0)):
            answer = gs.first_contact(a, b, (0, 0, 0), velocity)
            assert answer.status == status and answer.certain == (verdict == 1)
            assert verdicts(a, b, (0, 0, 0), velocity) == verdict
    # A window that ends with contact, and a line that grazes.
    b = gs.Boxes([(far + 4, 0, 0)], [np.eye(3)], [(1, 1, 1)])
    for t_max, verdict in ((2.0, UNCLEAR), (1.0, 1), (3.0, 2)):
        assert verdicts(a, b, (0, 0, 0), (-1, 0, 0), t_max) == verdict
        answer = gs.first_contact(a, b, (0, 0, 0), (-1, 0, 0), t_max=t_max)
        assert answer.status == (gs.NEVER if verdict == 1 else gs.WILL_TOUCH)
    grazing = gs.Boxes([(far + 4, 2, 0)], [np.eye(3)], [(1, 1, 1)])
    assert verdicts(a, grazing, (0, 0, 0), (-1, 0, 0)) == UNCLEAR
    assert gs.first_contact(a, grazing, (0, 0, 0), (-1, 0, 0)).status == gs.WILL_TOUCH


def test_boxes_have_the_same_bits_alone_and_in_any_batch(rng):
    a, b, at, velocity = moving_boxes(rng, "any", 70)
    turned = b.axes.copy()
    turned[::3] = a.axes[::3]
    b = gs.Boxes(b.center, turned, b.half_extents)
    names = ("status", "certain", "time", "time_lower", "time_upper", "last_time", "normal", "closing_speed")

    def rows(boxes, which):
        return gs.Boxes(boxes.center[which], boxes.axes[which], boxes.half_extents[which])

    whole = gs.first_contact(a, b, at, velocity)
    for i in range(70):
        one = gs.first_contact(rows(a, [i]), rows(b, [i]), at[i], velocity[i])
        for name in names:
            np.testing.assert_array_equal(getattr(one, name)[0], getattr(whole, name)[i])
    many = gs.first_contact(rows(a, [0]), b, (0, 0, 0), velocity)
    again = gs.first_contact(rows(a, [0] * 70), b, (0, 0, 0), velocity)
    for name in names:
        np.testing.assert_array_equal(getattr(many, name), getattr(again, name))


# ------------------------------------------------------------------------------------------------------- laws


@pytest.fixture
def batch(rng):
    """Float64 pairs on collision course, and integer pairs that touch, graze and slide."""
    bodies, offset = [], rng.uniform(2.5, 6.0, (60, 1)) * (way := rng.normal(size=(60, 3)))
    offset /= np.linalg.norm(way, axis=1, keepdims=True)
    for i in range(60):
        a, b = (spherical(rng, int(rng.integers(4, 24))) for _ in range(2))
        bodies.append((a, b + offset[i], rng.uniform(-1, 1, 3), -offset[i] * rng.uniform(0.2, 1.0)))
    for _ in range(60):
        a, va, b, vb = random_pair(rng, 3)
        bodies.append((np.array(a, float), np.array(b, float), np.array(va, float), np.array(vb, float) - va))
    a, b, va, w = zip(*bodies, strict=True)
    # Few bits, so that sums of velocities are exact.
    return list(a), list(b), np.round(np.array(va) * 64) / 64, np.round(np.array(w) * 64) / 64


def solve(a, b, velocity_a, velocity_b, **options):
    return gs.first_contact(polytopes(*a), polytopes(*b), velocity_a, velocity_b, accuracy="exact", **options)


NUMBERS = ("status", "time", "time_lower", "time_upper", "last_time")


def same(one, other, *names):
    assert (one.status != gs.NEVER).sum() > 40
    for name in (*NUMBERS, *names):
        np.testing.assert_array_equal(getattr(other, name), getattr(one, name), err_msg=name)


def same_points(one, other):
    """As sets: where a polygon starts depends on which way is which."""
    np.testing.assert_array_equal(other.point_offsets, one.point_offsets)
    for i in range(len(one.status)):
        assert sorted(map(tuple, points_of(one, i).tolist())) == sorted(map(tuple, points_of(other, i).tolist()))


def test_law_swap(batch):
    a, b, va, w = batch
    one, other = solve(a, b, va, va + w), solve(b, a, va + w, va)
    same(one, other, "closing_speed")
    sides = two_sided(one, other, -1.0)
    np.testing.assert_array_equal(other.normal[~sides], -one.normal[~sides])
    same_points(one, other)


def two_sided(one, other, sign):
    """Flat bodies that slide along or rest on each other in one plane have two normals to choose from."""
    sides = (one.closing_speed == 0.0) & (other.normal == -sign * one.normal).all(axis=1)
    assert sides.sum() <= 0.02 * len(sides)
    return sides


def test_law_swap_of_degenerate_pairs(rng):
    """Which normal it is where there are many is no matter of order, of bodies or of vertices."""
    a, va, b, vb = zip(*(random_pair(rng, int(rng.integers(1, 4))) for _ in range(1500)), strict=True)
    va, vb = np.array(va, float), np.array(vb, float)
    one, other = solve(a, b, va, vb), solve(b, a, vb, va)
    shuffled = solve([rng.permutation(x) for x in a], [rng.permutation(x) for x in b], va, vb)
    for answer, sign in ((other, -1.0), (shuffled, 1.0)):
        same(one, answer, "closing_speed")
        sides = two_sided(one, answer, sign)
        np.testing.assert_array_equal(answer.normal[~sides], sign * one.normal[~sides])
    assert (one.status == gs.TOUCHING).sum() >= 50 and (one.closing_speed < 0.0).sum() >= 20


def test_law_common_velocity(batch, rng):
    a, b, va, w = batch
    common = np.round(rng.uniform(-5, 5, (len(a), 3)) * 64) / 64
    same(solve(a, b, va, va + w), solve(a, b, va + common, va + w + common), "normal", "closing_speed", "point_offsets")


def test_law_permuted_coordinates_and_vertices(batch, rng):
    a, b, va, w = batch
    one = solve(a, b, va, va + w)
    order = [1, 2, 0]
    other = solve(
        [rng.permutation(body)[:, order] for body in a],
        [rng.permutation(body)[:, order] for body in b],
        va[:, order],
        (va + w)[:, order],
    )
    same(one, other, "closing_speed")
    sides = (one.closing_speed == 0.0) & (other.normal == -one.normal[:, order]).all(axis=1)
    np.testing.assert_array_equal(other.normal[~sides], one.normal[~sides][:, order])
    assert sides.sum() <= 2
    for i in range(len(a)):
        points = sorted(map(tuple, points_of(one, i)[:, order].tolist()))
        assert points == sorted(map(tuple, points_of(other, i).tolist()))


def test_law_reflected_coordinates(batch):
    a, b, va, w = batch
    mirror = np.array([-1.0, 1.0, 1.0])
    one = solve(a, b, va, va + w)
    other = solve([x * mirror for x in a], [x * mirror for x in b], va * mirror, (va + w) * mirror)
    same(one, other, "closing_speed")
    sides = two_sided(one, other, mirror)
    np.testing.assert_array_equal(other.normal[~sides], one.normal[~sides] * mirror)


@pytest.mark.parametrize(("length", "speed"), [(7, 0), (-3, 5), (-400, -300), (-700, 0), (700, 0), (300, -300)])
def test_law_power_of_two_scale(batch, length, speed):
    a, b, va, w = (x[::4] for x in batch)
    one = solve(a, b, va, va + w)
    unit, rate = 2.0**length, 2.0**speed
    other = solve([x * unit for x in a], [x * unit for x in b], va * rate, (va + w) * rate)
    for name in ("status", "normal", "point_offsets"):
        np.testing.assert_array_equal(getattr(other, name), getattr(one, name))
    for name in ("time", "time_lower", "time_upper", "last_time"):
        np.testing.assert_array_equal(getattr(other, name), np.ldexp(getattr(one, name), length - speed))
    np.testing.assert_array_equal(other.closing_speed, one.closing_speed * rate)
    np.testing.assert_array_equal(other.points, one.points * unit)


def test_law_exact_translation(batch, rng):
    a, b, va, w = (x[60:] for x in batch)
    shift = rng.integers(-50, 51, 3).astype(float)
    one, other = solve(a, b, va, va + w), solve([x + shift for x in a], [x + shift for x in b], va, va + w)
    for name in (*NUMBERS, "normal", "closing_speed", "point_offsets"):
        np.testing.assert_array_equal(getattr(other, name), getattr(one, name))


def test_law_time_reversal(batch):
    a, b, _, w = (x[60:] for x in batch)
    zero = np.zeros_like(w)
    forward = solve(a, b, zero, w)
    reached = 0
    for i in np.flatnonzero((forward.status == gs.WILL_TOUCH) & np.isfinite(forward.last_time)):
        late = math.ceil(forward.last_time[i]) + 1.0
        back = contact(a[i], b[i] + late * w[i], (0, 0, 0), -w[i], accuracy="exact")
        truth = exact.first_contact(a[i].tolist(), (0, 0, 0), b[i].tolist(), w[i].tolist(), INF)
        assert back.time[0] == nearest_double(Fraction(late) - truth.last_time)
        assert back.last_time[0] == nearest_double(Fraction(late) - truth.time)
        reached += 1
    assert reached >= 8


def test_law_longer_windows_only_add(batch):
    a, b, va, w = batch
    whole = solve(a, b, va, va + w)
    for t_max in (0.0, 0.5, 1.0, 2.0, 4.0):
        part = solve(a, b, va, va + w, t_max=t_max)
        within = (whole.status != gs.NEVER) & (whole.time_lower <= t_max)
        assert (part.status[~within] == gs.NEVER).all()
        hit = part.status != gs.NEVER
        assert (hit[within] | (whole.time_upper[within] > t_max)).all()
        np.testing.assert_array_equal(part.time[hit], whole.time[hit])
        np.testing.assert_array_equal(part.last_time[hit], np.minimum(whole.last_time[hit], t_max))


def test_law_rotation_at_float64(rng):
    for _ in range(60):
        a, b = spherical(rng, 16), spherical(rng, 12) + (5.0, 0.0, 0.0)
        velocity, turn = np.array([-1.0, *rng.uniform(-0.1, 0.1, 2)]), Turn(rng, 10.0)
        one = contact(a, b, (0, 0, 0), velocity)
        other = contact(turn.body(a), turn.body(b), (0, 0, 0), turn.vector(velocity))
        assert one.status == other.status == [gs.WILL_TOUCH]
        assert other.time[0] == pytest.approx(one.time[0], rel=1e-12)
        assert other.last_time[0] == pytest.approx(one.last_time[0], rel=1e-12)
        np.testing.assert_allclose(other.normal[0], turn.vector(one.normal[0]), atol=1e-11)
        assert set_distance(other.points, turn.body(one.points)) < TURNED_POINTS_ERROR
