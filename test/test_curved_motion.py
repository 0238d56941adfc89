# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""First contact in scenes of cylinders, cones, ellipsoids and half spaces that translate and turn."""

from __future__ import annotations

import itertools
import math
from collections import Counter
from typing import Any

import numpy as np
import pytest
from conftest import reproducer
from distance_scenes import matrix_of, random_turn
from oracle import curved
from oracle.vectors import exact
from scene_answers import scene_of
from test_curved import BOUNDED, CURVED, body, direction, mixed

import geomsrv as gs
from geomsrv.advancement import _sine_and_cosine
from geomsrv.answers import ContactStatus
from geomsrv.turning import TIME_TOLERANCE

UPRIGHT = [0.0, 0.0, 0.0, 1.0]
PAIRS = [(a, b) for a, b in itertools.combinations_with_replacement(BOUNDED, 2) if {a, b} & set(CURVED)]
CAN = gs.Cylinder(0.3, 0.8)
FLOOR = gs.HalfSpace([0, 0, 1], 0.0)
POINT_ERROR = 1e-3 * 4.0 * TIME_TOLERANCE  # [m] a thousandth of the way that bodies come, at 4 m/s, within the interval


def ask(a: Any, b: Any, horizon: float, **options: Any) -> Any:
    """One pair of objects, each (shape, pose, twist), or with an uncertainty."""
    objects = [
        gs.SceneObject(name, *given[:3], uncertainty=sum(given[3:])) for name, given in zip("ab", (a, b), strict=True)
    ]
    return scene_of(objects).first_contacts(horizon, **options)


def product(p: np.ndarray, q: np.ndarray) -> np.ndarray:
    x, y, z, w = p
    a, b, c, d = q
    return np.array(
        [w * a + x * d + y * c - z * b, w * b - x * c + y * d + z * a, w * c + x * b - y * a + z * d,
         w * d - x * a - y * b - z * c]
    )  # fmt: skip


def moved(pose: np.ndarray, twist: np.ndarray, time: float) -> np.ndarray:
    """The pose of an object at another time."""
    rate = float(np.linalg.norm(twist[3:]))
    axis = twist[3:] / (rate or 1.0)
    spin = np.append(math.sin(0.5 * rate * time) * axis, math.cos(0.5 * rate * time))
    turn = product(spin, pose[3:])
    return np.append(pose[:3] + time * twist[:3], turn / np.linalg.norm(turn))


def gap_at(a: Any, b: Any, time: float) -> tuple[float, float]:
    """Proven interval of the signed distance at a time, for poses rounded to doubles."""
    objects = [
        gs.SceneObject(n, s, moved(np.asarray(p, float), np.asarray(t, float), time))
        for n, (s, p, t) in zip("ab", (a, b), strict=True)
    ]
    answer = scene_of(objects).distances(math.inf, want=("penetration",))
    return float(answer.lower[0]), float(answer.upper[0])


def test_angles_are_turned_without_the_library() -> None:
    angles = np.concatenate([np.linspace(-7.0, 7.0, 1001), 2.0 ** np.arange(-40, 30), [0.0, math.pi, 1e8 + 0.1]])
    sine, cosine = _sine_and_cosine(angles)
    for got, function in ((sine, math.sin), (cosine, math.cos)):
        assert np.abs(got - [function(x) for x in angles]).max() <= 4 * 2.0**-53


def random_twist(rng: np.random.Generator) -> np.ndarray:
    twist = rng.normal(size=6) * [1, 1, 1, 2, 2, 2]
    kind = rng.integers(4)
    twist[:3] *= kind != 0
    twist[3:] *= kind != 1
    return twist


@pytest.mark.parametrize(("kind_a", "kind_b"), PAIRS)
def test_no_contact_is_missed_and_none_made_up(rng: np.random.Generator, kind_a: str, kind_b: str) -> None:
    """Before the lower end of the time the bodies are apart whenever they are looked at; at the upper end not."""
    seen: Counter[int] = Counter()
    for _ in range(8):
        a = (body(rng, kind_a), np.append(rng.normal(size=3) * 2.0, random_turn(rng)), random_twist(rng))
        b = (body(rng, kind_b), np.append(rng.normal(size=3) * 2.0, random_turn(rng)), random_twist(rng))
        if rng.random() < 0.7:  # aimed, so that many meet
            a[2][:3] = b[2][:3] + (b[1][:3] - a[1][:3]) * rng.uniform(0.3, 1.0) + 0.3 * rng.normal(size=3)
        horizon = 3.0
        answer = ask(a, b, horizon)
        status = int(answer.status[0]) if len(answer) else ContactStatus.NEVER
        seen[status] += 1
        info = reproducer(a=repr(a), b=repr(b))
        until = answer.time_lower[0] if len(answer) else horizon
        if status == ContactStatus.OVERLAPPING:
            assert until == 0.0 and gap_at(a, b, 0.0)[0] <= 0.0, info
            continue
        for time in np.append(rng.uniform(0.0, until, 12), until * (1.0 - 1e-9)):
            assert gap_at(a, b, time)[1] > -1e-12, (time, info)
        assert status in (
            ContactStatus.NEVER, ContactStatus.WILL_TOUCH, ContactStatus.OVERLAPPING, ContactStatus.GRAZING
        ), info  # fmt: skip
        if status == ContactStatus.WILL_TOUCH:
            lower, upper = answer.time_lower[0], answer.time_upper[0]
            assert upper - lower <= TIME_TOLERANCE and lower <= answer.time[0] <= upper, info
            assert gap_at(a, b, upper)[0] <= 1e-12, info
            assert abs(np.linalg.norm(answer.normal[0]) - 1.0) <= 1e-12 and answer.closing_speed[0] > -1e-6, info
            assert len(answer.points) == 1, info
    assert seen[ContactStatus.WILL_TOUCH] >= 1 and seen[ContactStatus.GRAZING] <= 2, seen


@pytest.mark.parametrize("spins", [False, True])
@pytest.mark.parametrize(("kind_a", "kind_b"), PAIRS)
def test_the_point_of_contact_is_on_both_bodies(
    rng: np.random.Generator, kind_a: str, kind_b: str, spins: bool
) -> None:
    """Midway between nearest points when the time begins, though one long step may have led there."""
    met = 0
    for _ in range(10):
        away = rng.normal(size=3)
        away *= 4.0 / np.linalg.norm(away)
        spin = rng.normal(size=3) * spins
        a = (body(rng, kind_a), np.append(np.zeros(3), random_turn(rng)), np.zeros(6))
        b = (body(rng, kind_b), np.append(away, random_turn(rng)), np.append(rng.normal(size=3) * 0.1 - away, spin))
        answer = ask(a, b, 2.0)
        if not len(answer) or answer.status[0] != ContactStatus.WILL_TOUCH:
            continue
        met += 1
        time, point = float(answer.time_lower[0]), (gs.Sphere(0.0), np.append(answer.points[0], UPRIGHT), np.zeros(6))
        half = 0.5 * gap_at(a, b, time)[1]
        for given in (a, b):
            there = (given[0], moved(given[1], given[2], time), np.zeros(6))
            assert gap_at(there, point, 0.0)[0] <= half + POINT_ERROR, reproducer(a=repr(a), b=repr(b))
    assert met > 2


@pytest.mark.parametrize("spins", [False, True])
@pytest.mark.parametrize(("kind_a", "kind_b"), PAIRS)
def test_time_known_by_construction(rng: np.random.Generator, kind_a: str, kind_b: str, spins: bool) -> None:
    """Placed touching, and moved back along the motion for as long as the answer shall be."""
    decided = 0
    for _ in range(6):
        a, b = body(rng, kind_a), body(rng, kind_b)
        turn_a, turn_b = random_turn(rng), random_turn(rng)
        held_a = curved.body_of(a).at(matrix_of(np.append(np.zeros(3), turn_a)), (0, 0, 0))
        held_b = curved.body_of(b).at(matrix_of(np.append(np.zeros(3), turn_b)), (0, 0, 0))
        n = held_a.world(direction(rng, a)) if rng.random() < 0.5 else exact(rng.normal(size=3))
        placed = curved.facing(held_a, held_b, n, exact(0.0), mixed(rng))
        along = np.array([float(x) for x in placed.normal])
        twists = rng.normal(size=(2, 6)) * (np.repeat([0.3, 0.2], 3) if spins else np.repeat([0.3, 0.0], 3))
        twists[0, :3] += along * rng.uniform(0.5, 2.0)
        truth = float(rng.choice([0.5, 1.0, rng.uniform(0.1, 1.5)]))
        at_contact = (np.append(np.zeros(3), turn_a), np.append([float(x) for x in placed.b.place], turn_b))
        start = [moved(pose, twist, -truth) for pose, twist in zip(at_contact, twists, strict=True)]
        one, other = (a, start[0], twists[0]), (b, start[1], twists[1])
        info = reproducer(a=repr(one), b=repr(other), truth=truth)
        answer = ask(one, other, 2.0 * truth)
        assert len(answer) == 1, info
        slack = 1e-10
        assert answer.time_lower[0] <= truth + slack, info
        if answer.status[0] == ContactStatus.WILL_TOUCH and answer.time_upper[0] >= truth - slack:
            decided += 1
            assert abs(answer.time[0] - truth) <= TIME_TOLERANCE + slack, info
    assert decided >= 2, decided


@pytest.mark.parametrize("kind", [*BOUNDED])
def test_half_spaces_that_move_and_turn(rng: np.random.Generator, kind: str) -> None:
    touched = 0
    for _ in range(12):
        height = rng.uniform(2.0, 4.0)
        a = (body(rng, kind), np.append([0.3, -0.2, height], random_turn(rng)), random_twist(rng))
        a[2][2] = -rng.uniform(0.5, 2.0)
        b = (FLOOR, np.array([0, 0, 0, *UPRIGHT]), np.zeros(6))
        if rng.random() < 0.5:
            b[2][:] = rng.normal(size=6) * np.repeat([0.3, 0.1], 3)
        answer = ask(a, b, 6.0)
        info = reproducer(a=repr(a), b=repr(b))
        until = answer.time_lower[0] if len(answer) else 6.0
        for time in rng.uniform(0.0, until, 12):
            assert gap_at(a, b, time)[1] > -1e-12, info
        if len(answer) and answer.status[0] == ContactStatus.WILL_TOUCH:
            touched += 1
            assert answer.time_upper[0] - answer.time_lower[0] <= TIME_TOLERANCE, info
            assert gap_at(a, b, answer.time_upper[0])[0] <= 1e-12, info
            assert (answer.normal[0] @ [0, 0, 1]) < 0.5, info
    assert touched >= 6, touched


REST = [0] * 6
RIGHT = [1, 0, 0, 0, 0, 0]
DOWN = [0, 0, -1, 0, 0, 0]
HERE = [0, 0, 0, *UPRIGHT]
LYING = [0, 0, 0.5, math.sqrt(0.5), 0, 0, math.sqrt(0.5)]
SHARP = gs.Cone(0.3, 0.9)
NAMED: dict[str, Any] = {
    "can meets can": ((CAN, HERE, RIGHT), (CAN, [3, 0, 0, *UPRIGHT], REST), 2.4),
    "can catches up": ((CAN, HERE, RIGHT), (CAN, [3, 0, 0, *UPRIGHT], [0.5, 0, 0, 0, 0, 0]), 4.8),
    "can lands": ((CAN, [0, 0, 2, *UPRIGHT], DOWN), (FLOOR, HERE, REST), 1.6),
    "floor comes up": ((CAN, [0, 0, 2, *UPRIGHT], REST), (FLOOR, HERE, [0, 0, 1, 0, 0, 0]), 1.6),
    "ball lands": ((gs.Sphere(0.3), [0, 0, 2, *UPRIGHT], [0, 0, -1, 9, 9, 9]), (FLOOR, HERE, REST), 1.7),
    "wheel rolls up to a box": (
        (gs.Cylinder(0.5, 0.2), LYING, [1, 0, 0, 0, 2, 0]),
        (gs.Box([0.5, 0.5, 0.5]), [4, 0, 0.5, *UPRIGHT], REST),
        3.0,
    ),
    "tip meets tip": ((SHARP, HERE, [0, 0, 1, 0, 0, 5]), (SHARP, [0, 0, 3, 1, 0, 0, 0], REST), 2.1),
    "can slides over the floor": ((CAN, [0, 0, 2, *UPRIGHT], RIGHT), (FLOOR, HERE, REST), None),
    "can flies past": ((CAN, HERE, RIGHT), (CAN, [3, 0.7, 0, *UPRIGHT], REST), None),
    "can flies away": ((CAN, HERE, [-1, 0, 0, 3, 0, 0]), (CAN, [3, 0.7, 0, *UPRIGHT], [0, 0, 0, 0, 7, 0]), None),
    "rod turns beside a cone": (
        (gs.Cylinder(0.05, 2.0), HERE, [0, 0, 0, 1, 0, 0]),
        (gs.Cone(0.3, 0.8), [0, 5, 0, *UPRIGHT], REST),
        None,
    ),
}


@pytest.mark.parametrize("name", NAMED)
def test_named(name: str) -> None:
    a, b, expected = NAMED[name]
    for first, second in ((a, b), (b, a)):
        answer = ask(first, second, math.inf)
        if expected is None:
            assert len(answer) == 0 and answer.unsupported == []
            continue
        assert answer.status.tolist() == [ContactStatus.WILL_TOUCH]
        assert answer.time_lower[0] <= expected + 1e-13 and expected - 1e-13 <= answer.time_upper[0]
        assert answer.time_upper[0] - answer.time_lower[0] <= TIME_TOLERANCE
        assert len(ask(first, second, 0.99 * expected)) == 0


def test_at_the_start_and_at_a_distance() -> None:
    rest = [0] * 6
    push = [1, 0, 0, 0, 0, 0]
    deep = ask((CAN, [0, 0, 0, *UPRIGHT], push), (CAN, [0.5, 0, 0, *UPRIGHT], rest), 5.0)
    assert deep.status.tolist() == [ContactStatus.OVERLAPPING] and deep.time_upper[0] == 0.0
    touch = ask((CAN, [0, 0, 0, *UPRIGHT], push), (CAN, [0.6, 0, 0, *UPRIGHT], rest), 5.0)
    assert touch.status.tolist() == [ContactStatus.TOUCHING] and touch.time[0] == 0.0 and touch.time_upper[0] <= 1e-6
    near = ask((CAN, [0, 0, 0, *UPRIGHT], push), (CAN, [3, 0, 0, *UPRIGHT], rest), 5.0, margin=0.4)
    assert near.time_lower[0] <= 2.0 <= near.time_upper[0] <= near.time_lower[0] + 1e-6
    vague = ask((CAN, [0, 0, 0, *UPRIGHT], push, 0.125), (CAN, [3, 0, 0, *UPRIGHT], rest), 5.0)
    assert vague.status.tolist() == [ContactStatus.WILL_TOUCH] and vague.time[0] == pytest.approx(2.4, abs=1e-6)
    assert vague.time_lower[0] <= 2.4 - 0.125 + 1e-9 and vague.time_upper[0] >= 2.4 + 0.125 - 1e-9
    graze = ask((CAN, [0, 0, 0, *UPRIGHT], push), (CAN, [3, 0.6, 0, *UPRIGHT], rest), 5.0)
    assert graze.status.tolist() == [ContactStatus.GRAZING] and graze.time_lower[0] <= 3.0 + 1e-9
    for tier in ("bound", "exact"):
        other = ask((CAN, [0, 0, 0, *UPRIGHT], push), (CAN, [3, 0, 0, *UPRIGHT], rest), 5.0, accuracy=tier)
        assert other.status.tolist() == [ContactStatus.UNSUPPORTED]


def test_two_half_spaces_that_move_are_not_followed() -> None:
    answer = ask((FLOOR, [0, 0, 0, *UPRIGHT], [0, 0, 1, 0, 0, 0]), (FLOOR, [0, 0, 3, 1, 0, 0, 0], [0] * 6), 5.0)
    assert answer.status.tolist() == [ContactStatus.UNSUPPORTED]


def test_the_work_is_bounded() -> None:
    """Turning fast and for ever beside what is never met."""
    spin = [0, 0, 0, 50.0, 31.0, 7.0]
    a = (gs.Ellipsoid([0.1, 0.2, 0.9]), [0, 0, 0, *UPRIGHT], spin)
    b = (gs.Ellipsoid([0.1, 0.2, 0.9]), [0, 0, 1.81, *UPRIGHT], [0, 0, 0, 3.0, 41.0, 5.0])
    answer = ask(a, b, math.inf)
    assert answer.status.tolist() in ([], [ContactStatus.NOT_CONVERGED])
