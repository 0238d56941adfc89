# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""A robot on a twist against points, polygons and obstacles that move: known answers, exact oracles, laws."""

from __future__ import annotations

import math
from collections import Counter
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from conftest import reproducer
from oracle import vectors
from oracle.arc import Arc
from oracle.turning import Turning, apart_until, meet_at

import geomsrv as gs
from geomsrv import _core
from geomsrv.answers import ContactStatus

ROBOT = np.array([(-0.3, -0.2), (0.3, -0.2), (0.3, 0.2), (-0.3, 0.2)])


def judge(ring: Any, twist: Any, point: Any, answer: gs.CollisionTimes, i: int, t_max: float, tolerance: float) -> str:
    """One point at rest against the oracle."""
    arc = Arc(np.asarray(ring).tolist(), np.asarray(twist).tolist(), np.asarray(point).tolist())
    status = ContactStatus(int(answer.status[i]))
    lower, upper = float(answer.time_lower[i]), float(answer.time_upper[i])
    text = reproducer(ring=np.asarray(ring), twist=np.asarray(twist), point=np.asarray(point), t_max=t_max)
    text += f"\n{status.name} {lower.hex()} {upper.hex()}"
    if status == ContactStatus.NEVER:
        if math.isfinite(t_max) and arc.within_a_turn(t_max):
            assert arc.first is None or arc.place_at(t_max) < arc.first, text
        else:
            assert arc.first is None, text
        assert not arc.at_start and math.isnan(lower) and math.isnan(upper), text
    elif status in (ContactStatus.OVERLAPPING, ContactStatus.TOUCHING) and upper == 0.0:
        assert arc.at_start and lower == 0.0, text
    else:
        assert status in (ContactStatus.WILL_TOUCH, ContactStatus.GRAZING, ContactStatus.TOUCHING), text
        assert arc.apart_before(lower), text
        assert upper == math.inf or (upper <= t_max and arc.met_by(upper)), text
        assert status != ContactStatus.WILL_TOUCH or upper - lower <= max(tolerance, 2.0**-47 * upper), text
    return status.name


def convex_ring(rng: np.random.Generator, size: float = 1.0) -> np.ndarray:
    """On an ellipse, so it is convex."""
    angles = np.sort(rng.uniform(0, 2 * math.pi, rng.integers(3, 9)))
    ring = size * np.column_stack([np.cos(angles), 0.6 * np.sin(angles)]) + rng.normal(0, 0.2 * size, 2)
    return gs.Polygons.from_list([ring]).vertices


# ------------------------------------------------------------------------------------------------ known answers


def test_straight_ahead() -> None:
    answer = gs.time_to_collision(ROBOT, (0.5, 0, 0), [(1.3, 0), (1.3, 0.2), (1.3, 0.21), (-1, 0), (0.1, 0)])
    assert answer.status.tolist() == [1, answer.status[1], 0, 0, 3]
    assert (
        2.0 - 1e-13 <= answer.time[0] <= 2.0 <= answer.time_upper[0]
        and answer.time_upper[0] - answer.time_lower[0] < 1e-12
    )
    assert answer.time[4] == 0.0 and answer.first == 4 and answer.earliest == answer.earliest_upper == 0.0
    # In line with a side to the last bit: contact all along it.
    assert answer.status[1] in (ContactStatus.WILL_TOUCH, ContactStatus.GRAZING) and abs(answer.time[1] - 2) < 1e-13


@pytest.mark.parametrize("rate", [-3.0, -0.5, 1e-3, 2.0])
def test_a_side_turns_onto_a_point(rate: float) -> None:
    """A square that turns in place: a side 1 away is 1.2 away acos(1 / 1.2) from its normal."""
    square = [(-1, -1), (1, -1), (1, 1), (-1, 1)]
    answer = gs.time_to_collision(square, (0, 0, rate), [(1.2, 0), (1.5, 0), (0.9, 0.2)])
    expected = math.acos(1 / 1.2) / abs(rate)
    assert answer.status.tolist() == [1, 0, 3]
    assert answer.time_lower[0] <= expected * (1 + 1e-14) and expected * (1 - 1e-14) <= answer.time_upper[0]
    assert answer.time_upper[0] - answer.time_lower[0] <= 1e-12 / abs(rate)


@pytest.mark.parametrize("rate", [0.0, 1e-300, 1e-15, -1e-9, 1e-6])
def test_hardly_turning(rate: float) -> None:
    """No centre far away spoils the answer."""
    answer = gs.time_to_collision(ROBOT, (0.5, 0, rate), [(1.3, 0.01), (5.3, -0.1)], t_max=100.0)
    assert (answer.status == gs.WILL_TOUCH).all() and answer.cost.counts["closed"] == 2
    assert np.allclose(answer.time, [2.0, 10.0], rtol=1e-4 if rate == 1e-6 else 1e-8, atol=0)
    assert (answer.time_upper - answer.time_lower < 1e-12).all()


def test_behind_half_a_turn() -> None:
    """What is met only in the second half of the circle."""
    answer = gs.time_to_collision(ROBOT, (1.0, 0, 1.0), [(-1.0, 1.0)])
    assert answer.status[0] == gs.WILL_TOUCH and math.pi < answer.time[0] < 2 * math.pi
    assert judge(ROBOT, (1.0, 0, 1.0), (-1.0, 1.0), answer, 0, math.inf, 1e-6) == "WILL_TOUCH"


def test_no_motion_and_no_points() -> None:
    answer = gs.time_to_collision(ROBOT, (0, 0, 0), [(0, 0), (0.3, 0.1), (1, 0)])
    assert answer.status.tolist() == [3, 2, 0] and answer.certain.all()
    none = gs.time_to_collision(ROBOT, (1, 0, 1), np.zeros((0, 2)))
    assert none.first == -1 and none.earliest == none.earliest_upper == math.inf


def test_faults_are_named() -> None:
    for arguments, text in [
        ((ROBOT[::-1], (1, 0, 0), [(1, 1)]), "footprint is clockwise"),
        ((np.zeros((0, 2)), (1, 0, 0), [(1, 1)]), "footprint must hold at least one point"),
        ((ROBOT, (1, 0), [(1, 1)]), "twist must have shape"),
        ((ROBOT, (1, 0, math.nan), [(1, 1)]), r"twist\[2\] is nan"),
        ((ROBOT, (1, 0, 0), [(1, 1), (1, math.inf)]), r"obstacles\[1, 1\] is inf"),
    ]:
        with pytest.raises(gs.GeometryError, match=text):
            gs.time_to_collision(*arguments)
    with pytest.raises(gs.GeometryError, match="velocities must have shape"):
        gs.time_to_collision(ROBOT, (1, 0, 0), [(1, 1)], velocities=np.zeros((3, 2)))
    with pytest.raises(gs.GeometryError, match="tolerance must be > 0"):
        gs.time_to_collision(ROBOT, (1, 0, 0), [(1, 1)], tolerance=0.0)


# ---------------------------------------------------------------------------------------- points against the oracle


@pytest.mark.parametrize("scale", [1e-9, 1.0, 1e9])
def test_points_against_the_oracle(rng: np.random.Generator, scale: float) -> None:
    seen: Counter[str] = Counter()
    closed = total = 0
    for _ in range(60):
        ring = convex_ring(rng, scale)
        twist = rng.normal(size=3) * [scale, scale, rng.choice([0.0, 1e-12, 1e-5, 1.0, 30.0])]
        if rng.random() < 0.2:
            twist[:2] = 0.0
        points = rng.normal(0, 3 * scale, (12, 2))
        points[6:] = rng.normal(0, scale, (6, 2))
        t_max = float(rng.choice([math.inf, rng.uniform(0, 5)]))
        answer = gs.time_to_collision(ring, twist, points, t_max=t_max)
        closed, total = closed + answer.cost.counts["closed"], total + len(points)
        seen.update(judge(ring, twist, p, answer, i, t_max, 1e-6) for i, p in enumerate(points))
    assert closed >= 0.99 * total, (closed, total)
    assert seen["WILL_TOUCH"] > 50 and seen["NEVER"] > 100 and seen["OVERLAPPING"] > 20, seen


def test_points_on_a_grid(rng: np.random.Generator) -> None:
    """In line with sides, on them, on circles through corners: what rounding alone cannot decide."""
    seen: Counter[str] = Counter()
    square = np.array([(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)])
    grid = np.array([(x, y) for x in range(-3, 4) for y in range(-3, 4)], dtype=float)
    for twist in [(1, 0, 0), (1, 1, 0), (0, 0, 1), (1, 0, 0.5), (0, -1, -1), (2, 1, 0)]:
        answer = gs.time_to_collision(square, twist, grid, t_max=20.0)
        seen.update(judge(square, twist, p, answer, i, 20.0, 1e-6) for i, p in enumerate(grid))
    assert seen["TOUCHING"] == 6 * 8 and seen["OVERLAPPING"] == 6 and seen["GRAZING"] > 0, seen


def test_points_that_pass_closely(rng: np.random.Generator) -> None:
    """Just in or out of reach of a corner."""
    seen: Counter[str] = Counter()
    for _ in range(100):
        ring = convex_ring(rng)
        rate = float(rng.choice([0.3, 1.0, -2.0]))
        center = rng.normal(0, 2, 2)
        twist = np.array([center[1] * rate, -center[0] * rate, rate])
        arms = ring - center
        reach = np.hypot(*arms.T).max() * (1.0 + float(rng.choice([-1, 1])) * 10 ** rng.uniform(-15, -3))
        angle = rng.uniform(0, 2 * math.pi)
        point = center + reach * np.array([math.cos(angle), math.sin(angle)])
        answer = gs.time_to_collision(ring, twist, point[None])
        seen[judge(ring, twist, point, answer, 0, math.inf, 1e-6)] += 1
    assert seen["WILL_TOUCH"] > 20 and seen["NEVER"] > 20, seen


# ---------------------------------------------------------------------------------------- polygons, moving obstacles


def bodies_of(ring: Any, twist: Any, obstacle: Any, velocity: Any) -> tuple[Turning, Turning]:
    """The oracle's: the robot turns about the exact centre of its arc."""
    vx, vy, w = (Fraction(float(x)) for x in twist)
    zero = (Fraction(0), Fraction(0), Fraction(0))
    points = [tuple((*vectors.exact(v), Fraction(0))) for v in np.asarray(ring, float).tolist()]
    if w == 0:
        robot = Turning(tuple(points), (vx, vy, Fraction(0)), zero, zero)
    else:
        robot = Turning(tuple(points), zero, (Fraction(0), Fraction(0), w), (-vy / w, vx / w, Fraction(0)))
    return robot, Turning.of(np.asarray(obstacle, float), velocity, 0.0, np.asarray(obstacle, float)[0])


@pytest.mark.parametrize("moving", [False, True])
@pytest.mark.parametrize("what", ["points", "polygons"])
def test_obstacles_against_the_oracle(rng: np.random.Generator, what: str, moving: bool) -> None:
    seen: Counter[str] = Counter()
    for _ in range(50):
        ring = convex_ring(rng)
        twist = rng.normal(size=3) * rng.choice([0.0, 1.0], size=3, p=[0.2, 0.8])
        place = rng.normal(0, 2, 2)
        rings = [place[None] if what == "points" else 0.7 * convex_ring(rng) + place]
        velocity = rng.normal(size=2) if moving else np.zeros(2)
        obstacles = rings[0] if what == "points" else gs.Polygons.from_list(rings)
        answer = gs.time_to_collision(ring, twist, obstacles, velocities=velocity, t_max=4.0)
        status = ContactStatus(int(answer.status[0]))
        text = reproducer(ring=ring, twist=twist, obstacle=rings[0], velocity=velocity) + f"\n{answer}"
        robot, other = bodies_of(ring, twist, rings[0], velocity)
        lower, upper = float(answer.time_lower[0]), float(answer.time_upper[0])
        if status == ContactStatus.OVERLAPPING:
            assert meet_at(robot, other, Fraction(0)), text
        else:
            end = Fraction(4.0 if status == ContactStatus.NEVER else lower)
            apart = apart_until(robot, other, end, 2000)
            assert apart >= end or not meet_at(robot, other, apart + Fraction(1, 1 << 60)), text
            if status == ContactStatus.WILL_TOUCH:
                assert upper - lower <= 1e-6 and meet_at(robot, other, Fraction(upper)), text
        seen[status.name] += 1
    assert seen["WILL_TOUCH"] >= 3 and seen["NEVER"] >= 3, seen


# ------------------------------------------------------------------------------------------------------------ laws


def test_a_point_is_a_small_polygon(rng: np.random.Generator) -> None:
    """Closed form and turning bodies agree."""
    twist = np.array([0.7, 0.1, 0.4])
    points = rng.normal(0, 2, (200, 2))
    by_point = gs.time_to_collision(ROBOT, twist, points, tolerance=1e-9)
    by_body = gs.time_to_collision(ROBOT, twist, gs.Polygons.from_list(list(points[:, None])), tolerance=1e-9)
    assert (by_point.status == by_body.status).all()
    hit = by_point.status == gs.WILL_TOUCH
    assert hit.sum() > 20
    assert (by_point.time_lower[hit] <= by_body.time_upper[hit]).all()
    assert (by_body.time_lower[hit] <= by_point.time_upper[hit]).all()
    assert by_point.cost.counts["closed"] == len(points) and by_body.cost.counts["closed"] == 0


def test_mirrored(rng: np.random.Generator) -> None:
    """To the bit."""
    points = rng.normal(0, 2, (100, 2))
    ring = convex_ring(rng)
    flip = np.array([1.0, -1.0])
    a = gs.time_to_collision(ring, (0.7, 0.2, 0.4), points)
    b = gs.time_to_collision((ring * flip)[::-1], (0.7, -0.2, -0.4), points * flip)
    assert (a.status == b.status).all() and np.allclose(a.time, b.time, rtol=1e-13, atol=0, equal_nan=True)


def test_earliest_is_that_of_all(rng: np.random.Generator) -> None:
    points = rng.uniform(-5, 5, (300, 2))
    answer = gs.time_to_collision(ROBOT, (1.0, 0.0, 0.3), points)
    alone = [gs.time_to_collision(ROBOT, (1.0, 0.0, 0.3), p[None]).earliest for p in points]
    assert answer.earliest == min(alone) == alone[answer.first] <= answer.earliest_upper


def test_sides_without_inside() -> None:
    """A bumper bar as footprint: no margin is left within it, so other arithmetic decides."""
    answer = gs.time_to_collision([(0.3, -0.2), (0.3, 0.2)], (0.5, 0, 0.1), [(1.0, 0.1), (1.0, 3.0)], t_max=5.0)
    assert answer.status.tolist() == [1, 0] and answer.cost.counts == {"closed": 0, "turning": 2}
    assert answer.time_upper[0] - answer.time_lower[0] <= 1e-6


def test_the_centre_of_the_arc() -> None:
    """Exact, or off by what is said."""
    x, y, drift, period = _core.turn_of_twist(np.array([1.0, 0.5, 0.25]))
    assert (x, y, drift) == (-2.0, 4.0, 0.0) and period >= 8 * math.pi
    assert _core.turn_of_twist(np.array([1.0, 0.5, 0.3]))[2] > 0.0
