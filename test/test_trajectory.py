# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""First contact along planned paths and under acceleration, by another way to say where bodies are."""

from fractions import Fraction

import numpy as np
import pytest
from conftest import reproducer

import geomsrv as gs
from geomsrv.answers import ContactStatus
from geomsrv.trajectory import MOST_HALVED

SQUARE = gs.Polygon([(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)])
NEAR = 1e-11  # bodies of some metres are placed here to some ulps


def spin(axis_angle):
    """Rotation matrix of a rotation vector (Rodrigues)."""
    angle = np.linalg.norm(axis_angle)
    if angle == 0.0:
        return np.eye(3)
    x, y, z = axis_angle / angle
    k = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * k + (1 - np.cos(angle)) * (k @ k)


def matrix(q):
    x, y, z, w = q
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )


def slerp(q, r, share):
    """The shortest way, by the book."""
    q, r = np.asarray(q, float), np.asarray(r, float)
    r = -r if q @ r < 0 else r
    angle = np.arccos(min(1.0, q @ r))
    if angle < 1e-9:
        return r if share > 0.5 else q
    return (np.sin((1 - share) * angle) * q + np.sin(share * angle) * r) / np.sin(angle)


def placed(vertices, motion, t):
    """Vertices of a body at a time of its motion."""
    if isinstance(motion, gs.AcceleratedMotion):
        path = t * motion.velocity + 0.5 * t * t * motion.acceleration
        turned = spin(t * motion.angular_velocity + 0.5 * t * t * motion.angular_acceleration)
        if motion.planar:
            c, s = np.cos(motion.pose[2]), np.sin(motion.pose[2])
            turn = turned[:2, :2] @ np.array([[c, -s], [s, c]])
            return vertices @ turn.T + motion.pose[:2] + path
        return vertices @ (turned @ matrix(motion.pose[3:])).T + motion.pose[:3] + path
    k = min(int(np.searchsorted(motion.times, t, side="right")) - 1, len(motion.times) - 2)
    share = (t - motion.times[k]) / (motion.times[k + 1] - motion.times[k])
    here, there = motion.poses[k], motion.poses[k + 1]
    if motion.planar:
        x, y, yaw = (1 - share) * here + share * there
        return vertices @ np.array([[np.cos(yaw), np.sin(yaw)], [-np.sin(yaw), np.cos(yaw)]]) + [x, y]
    return vertices @ matrix(slerp(here[3:], there[3:], share)).T + (1 - share) * here[:3] + share * there[:3]


def distances(vertices, motion, obstacles, velocities, t):
    """(n,) signed distances at a time."""
    ring, shift = placed(vertices, motion, t), (t - motion.start) * velocities
    flat = motion.planar
    body = (gs.Polygons if flat else gs.Polytopes).from_list([ring])
    moved = [p + shift for p in obstacles]
    return gs.distance(body, (gs.Polygons if flat else gs.Polytopes).from_list(moved), want=("penetration",)).distance


def judge(vertices, motion, obstacles, velocities, answer, *, looks=40):
    """Free before, in contact after; statuses counted."""
    given = reproducer(
        vertices=vertices, obstacles=[p.tolist() for p in obstacles], velocities=velocities, motion=motion
    )
    until = np.where(np.isnan(answer.time_lower), motion.end, answer.time_lower)
    for t in np.linspace(motion.start, motion.end, looks):
        apart = distances(vertices, motion, obstacles, velocities, t)
        assert (apart[t < until] > -NEAR).all(), (t, apart, given)
    for k in np.flatnonzero(answer.status == ContactStatus.WILL_TOUCH):
        lower, upper = answer.time_lower[k], answer.time_upper[k]
        assert 0.0 <= upper - lower <= 1e-6, given
        assert distances(vertices, motion, obstacles, velocities, lower)[k] > -NEAR, given
        assert distances(vertices, motion, obstacles, velocities, upper)[k] < NEAR, given
    for k in np.flatnonzero(answer.status == ContactStatus.OVERLAPPING):
        assert distances(vertices, motion, obstacles, velocities, motion.start)[k] < NEAR, given
    return {status.name: int(np.count_nonzero(answer.status == status)) for status in ContactStatus}


def random_path(rng, flat, knots):
    times = np.cumsum(rng.uniform(0.2, 1.0, knots)) - 0.5
    place = np.cumsum(rng.normal(size=(knots, 2 if flat else 3)), axis=0)
    if flat:
        return gs.Trajectory(times, np.column_stack([place, np.cumsum(rng.normal(size=knots) * 2.0)]))
    turn = rng.normal(size=(knots, 4))
    return gs.Trajectory(times, np.column_stack([place, turn / np.linalg.norm(turn, axis=1, keepdims=True)]))


def random_obstacles(rng, flat, count):
    dimension = 2 if flat else 3
    found = []
    for _ in range(count):
        points = rng.normal(size=(rng.integers(3, 7), dimension)) * 0.5 + rng.uniform(-2.0, 2.0, dimension)
        if flat:
            angle = np.sort(rng.uniform(0.0, 2 * np.pi, rng.integers(3, 7)))
            points = 0.5 * np.column_stack([np.cos(angle), np.sin(angle)]) + rng.uniform(-4.0, 4.0, 2)
        found.append(points)
    return found


def bodies_of(obstacles, flat):
    return (gs.Polygons if flat else gs.Polytopes).from_list(obstacles)


@pytest.mark.parametrize("flat", [True, False], ids=["plane", "space"])
@pytest.mark.parametrize("moving", [False, True], ids=["resting", "moving"])
def test_random_paths(rng, flat, moving):
    seen = dict.fromkeys((s.name for s in ContactStatus), 0)
    for _ in range(8):
        motion, obstacles = random_path(rng, flat, 6), random_obstacles(rng, flat, 20)
        velocities = rng.normal(size=2 if flat else 3) * moving
        body = SQUARE if flat else gs.Box([1.2, 0.4, 0.6])
        vertices = body.vertices if flat else np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
        vertices = vertices if flat else vertices * body.half_extents
        answer = gs.first_contact_along(body, motion, bodies_of(obstacles, flat), velocities=velocities)
        for name, count in judge(vertices, motion, obstacles, velocities, answer).items():
            seen[name] += count
    assert min(seen["WILL_TOUCH"], seen["NEVER"]) >= 5, seen
    assert seen["GRAZING"] + seen["NOT_CONVERGED"] <= 1, seen


@pytest.mark.parametrize("flat", [True, False], ids=["plane", "space"])
def test_random_accelerations(rng, flat):
    seen = dict.fromkeys((s.name for s in ContactStatus), 0)
    for _ in range(8):
        turn = rng.normal(size=4)
        pose = rng.normal(size=3) if flat else [*rng.normal(size=3), *(turn / np.linalg.norm(turn))]
        dimension = 2 if flat else 3
        axis = 1.0 if flat else rng.normal(size=3)
        motion = gs.AcceleratedMotion(
            pose,
            rng.normal(size=dimension) * 2.0,
            acceleration=rng.normal(size=dimension) * 2.0,
            angular_velocity=axis * rng.normal(),
            angular_acceleration=axis * rng.normal(),
            duration=2.0,
        )
        obstacles, velocities = random_obstacles(rng, flat, 20), rng.normal(size=dimension)
        hull = rng.normal(size=(6, 3)) * 0.8
        body = SQUARE if flat else gs.Convex(hull)
        answer = gs.first_contact_along(body, motion, bodies_of(obstacles, flat), velocities=velocities)
        found = judge(body.vertices, motion, obstacles, velocities, answer)
        for name, count in found.items():
            seen[name] += count
    assert min(seen["WILL_TOUCH"], seen["NEVER"]) >= 5, seen
    assert seen["GRAZING"] + seen["NOT_CONVERGED"] <= 1, seen


def test_one_piece_is_the_query_for_turning_bodies(rng):
    obstacles = bodies_of(random_obstacles(rng, True, 40), True)
    start, end = np.array([-3.0, 0.5, 0.3]), np.array([3.0, -0.5, 2.3])
    path = gs.first_contact_along(SQUARE, gs.Trajectory([0.0, 2.0], [start, end]), obstacles)
    c, s = np.cos(0.3), np.sin(0.3)
    ring = gs.Polygons.from_list([SQUARE.vertices @ np.array([[c, s], [-s, c]]) + start[:2]])
    twist = gs.first_contact(
        ring, obstacles, (end - start)[:2] / 2.0, (0, 0), t_max=2.0, angular_velocity_a=1.0, center_a=start[:2]
    )
    np.testing.assert_array_equal(path.status, twist.status)
    np.testing.assert_allclose(path.time, twist.time, atol=2e-6)
    assert (path.status == ContactStatus.WILL_TOUCH).sum() >= 3


def test_more_knots_change_nothing(rng):
    obstacles = bodies_of(random_obstacles(rng, True, 20), True)
    ends = np.array([[-3.0, 0.5, 0.3], [3.0, -0.5, 7.3]])
    share = np.sort(rng.uniform(size=5))
    many = np.vstack([ends[:1], ends[0] + share[:, None] * (ends[1] - ends[0]), ends[1:]])
    few = gs.first_contact_along(SQUARE, gs.Trajectory([1.0, 4.0], ends), obstacles)
    more = gs.first_contact_along(SQUARE, gs.Trajectory([1.0, *(1.0 + 3.0 * share), 4.0], many), obstacles)
    np.testing.assert_array_equal(few.status, more.status)
    np.testing.assert_allclose(few.time, more.time, atol=2e-6)


@pytest.mark.parametrize("away", [0.0, 1e-12, -1e-12, 1e-9, -1e-9])
def test_contact_at_a_knot(away):
    """The body comes as far as the wall, give or take, and goes back: nothing is lost between two pieces."""
    path = gs.Trajectory([0.0, 1.0, 2.0], [[0, 0, 0], [1, 0, 0], [0, 0, 0]])
    wall = gs.Polygons.from_list([[(1.5 + away, -1), (1.5 + away, 1)]])
    found = gs.first_contact_along(SQUARE, path, wall)
    if away > 0.0:
        assert found.status == ContactStatus.NEVER
    else:
        assert found.status in (ContactStatus.WILL_TOUCH, ContactStatus.GRAZING)
        assert found.time_lower[0] <= 1.0 + 1e-15 and abs(found.time[0] - 1.0) < 1e-5
        assert found.status == ContactStatus.WILL_TOUCH or away > -1e-9


def test_knot_that_starts_a_contact_is_contact_to_come():
    """On the second piece the body turns into a post that it came to stand beside."""
    path = gs.Trajectory([0.0, 1.0, 2.0], [[-2, 0, 0], [0, 0, 0], [0, 0, np.pi]])
    post = gs.Polygons.from_list([[(0.6, 0.0)]])
    found = gs.first_contact_along(SQUARE, path, post)
    # A corner, sqrt(1/2) out, is 0.6 out along its edge at an angle of acos(0.5 / 0.6) from the edge's middle.
    assert found.time[0] == pytest.approx(1.0 + np.arccos(0.5 / 0.6) / np.pi, abs=1e-6)
    assert found.status == ContactStatus.WILL_TOUCH


def test_no_speed_tunnels():
    """A thin bar through thin bars, a kilometre a second."""
    bar = gs.Polygon([(-1e-3, -1), (1e-3, -1), (1e-3, 1), (-1e-3, 1)])
    path = gs.Trajectory([0.0, 1.0, 1.5], [[-1000, 0, 0], [0, 0, 50.0], [1000, 0, 300.0]])
    walls = gs.Polygons.from_list([[(x, -1e-9), (x, 1e-9)] for x in (-900.0, -0.5, 0.5, 900.0)])
    found = gs.first_contact_along(bar, path, walls)
    assert (found.status == ContactStatus.WILL_TOUCH).all() and (np.diff(found.time) > 0.0).all()


def test_acceleration_in_closed_form():
    ball = gs.Convex([[0, 0, 0]])
    floor = gs.Boxes([[0, 0, -1]], [np.eye(3)], [[5, 5, 1]])
    fall = gs.AcceleratedMotion([0, 0, 10, 0, 0, 0, 1], [1, 0, 0], acceleration=[0, 0, -9.81], duration=3.0)
    found = gs.first_contact_along(ball, fall, floor)
    assert found.time_lower[0] <= np.sqrt(20 / 9.81) <= found.time_upper[0] and found.status == ContactStatus.WILL_TOUCH
    # Brakes: 2 s and 2 m to stand still.
    wall = gs.Polygons.from_list([[(x, -1), (x, 1)] for x in (2.4999, 2.5001)])
    brake = gs.AcceleratedMotion([0, 0, 0], [2, 0], acceleration=[-1, 0], duration=4.0)
    assert gs.first_contact_along(SQUARE, brake, wall).status.tolist() == [
        ContactStatus.WILL_TOUCH,
        ContactStatus.NEVER,
    ]
    # A rod that spins up from rest reaches a right angle at sqrt(pi / b).
    rod = gs.Polygon([(0, 0), (1, 0)])
    post = gs.Polygons.from_list([[(-0.1, 0.9), (0.0, 0.9)]])
    spin_up = gs.AcceleratedMotion([0, 0, 0], [0, 0], acceleration=[0, 0], angular_acceleration=2.0, duration=3.0)
    found = gs.first_contact_along(rod, spin_up, post)
    assert found.time_lower[0] <= np.sqrt(np.pi / 2.0) <= found.time_upper[0] + 1e-12


def test_places_that_cancel(rng):
    """A point comes a hundred thousand kilometres, and turns back a hair beyond a wall: in rational numbers."""
    point, missed = gs.Polygon([(0, 0)]), 0
    for _ in range(50):
        place = -rng.uniform(1e8, 2e8)
        speed, gain = -2.0 * place, place * rng.uniform(1.998, 2.002)
        apex = Fraction(place) - Fraction(speed) ** 2 / (2 * Fraction(gain))
        wall = float(apex) - np.exp(rng.uniform(np.log(1e-9), np.log(1e-5)))
        motion = gs.AcceleratedMotion([place, 0, 0], [speed, 0], acceleration=[gain, 0], duration=2.0)
        found = gs.first_contact_along(point, motion, gs.Polygons.from_list([[(wall, -1), (wall, 1)]]), tolerance=1e-9)
        given = reproducer(place=place, speed=speed, gain=gain, wall=wall)
        missed += apex < wall  # it is rounded
        if found.status == ContactStatus.NEVER:
            assert apex < wall, given
            continue
        early, late = (
            Fraction(place) + Fraction(t) * (Fraction(speed) + Fraction(gain) * Fraction(t) / 2) - Fraction(wall)
            for t in (found.time_lower[0], min(found.time_upper[0], 1e3))
        )
        assert early <= 0, given
        assert np.isinf(found.time_upper[0]) or late >= 0, given
    assert missed < 25


@pytest.mark.parametrize("flat", [True, False], ids=["plane", "space"])
def test_span_is_around_the_way_of_the_origin(rng, flat):
    """As narrow as it can be, turning points among them, and that of a path, too."""
    dimension, turned_back = 2 if flat else 3, 0
    for _ in range(30):
        pose = np.zeros(3 if flat else 7)
        pose[:dimension], pose[-1] = rng.normal(size=dimension), 1.0
        velocity, acceleration = rng.normal(size=(2, dimension)) * rng.choice([0.0, 1.0, 1.0], size=(2, dimension))
        motion = gs.AcceleratedMotion(pose, velocity, acceleration=acceleration, duration=rng.uniform(0.5, 4.0))
        for way in (motion, random_path(rng, flat, 5)):
            when = np.linspace(way.start, way.end, 1001)
            places = np.array([placed(np.zeros((1, dimension)), way, t)[0] for t in when])
            low, high = way.span[:, :dimension]
            assert (low <= places.min(axis=0) + NEAR).all() and (places.max(axis=0) <= high + NEAR).all()
            # Between two looks a parabola, or the corner of a path, is a little farther out.
            np.testing.assert_allclose(way.span[:, :dimension], [places.min(axis=0), places.max(axis=0)], atol=0.05)
            assert dimension == 3 or not way.span[:, 2].any()
        ends = np.array([placed(np.zeros((1, dimension)), motion, t)[0] for t in (0.0, motion.end)])
        turned_back += (
            (motion.span[1][:dimension] > ends.max(axis=0) + 0.01)
            | (motion.span[0][:dimension] < ends.min(axis=0) - 0.01)
        ).any()
    assert turned_back >= 3


@pytest.mark.parametrize(("gap", "status"), [(1e-4, gs.NEVER), (1e-10, ContactStatus.NOT_CONVERGED)])
def test_hovering_and_spinning_up_comes_to_an_end(gap, status):
    """The nearer it is, the shorter are the pieces that tell it from contact."""
    floor = gs.Boxes([[0, 0, -1], [0, 0, -3]], [np.eye(3)] * 2, [[5, 5, 1]] * 2)
    spin_up = gs.AcceleratedMotion(
        [0, 0, 0.5 + gap, 0, 0, 0, 1], [0, 0, 0], acceleration=[0, 0, 0], angular_acceleration=[0, 0, 1.0], duration=5.0
    )
    found = gs.first_contact_along(gs.Box([1, 1, 0.5]), spin_up, floor)
    assert found.status.tolist() == [status, ContactStatus.NEVER]
    if status:
        assert 0.0 < found.time_lower[0] < 5.0 and found.time_upper[0] == np.inf and not found.certain[0]
        assert found.cost.counts["pieces"] < 4 * MOST_HALVED


def test_start_is_named():
    path = gs.Trajectory([5.0, 6.0], [[0, 0, 0], [1, 0, 0]])
    walls = gs.Polygons.from_list([[(x, -1), (x, 1)] for x in (0.25, 0.5, 0.75)])
    found = gs.first_contact_along(SQUARE, path, walls)
    assert found.status.tolist() == [ContactStatus.OVERLAPPING, ContactStatus.TOUCHING, ContactStatus.WILL_TOUCH]
    assert found.time[:2].tolist() == [5.0, 5.0] and found.time[2] == pytest.approx(5.25, abs=1e-6)


@pytest.mark.parametrize(
    ("make", "text"),
    [
        (lambda: gs.Trajectory([0.0], [[0, 0, 0]]), "times and poses must be as many, at least two; got 1 and 1"),
        (lambda: gs.Trajectory([0.0, 0.0], [[0, 0, 0]] * 2), r"times\[1\] must be later than times\[0\] = 0, got 0"),
        (lambda: gs.Trajectory([0.0, 1.0], [[0, 0]] * 2), r"poses must have shape \(k, 7\), or \(k, 3\) in the plane"),
        (lambda: gs.Trajectory([0.0, 1.0], [[0, 0, 0, 0, 0, 0, 1], [0, 0, 0, 0, 0, 0, 2]]), r"poses\[1\]"),
        (lambda: gs.Trajectory([0.0, np.nan], [[0, 0, 0]] * 2), r"times\[1\]"),
        (lambda: gs.AcceleratedMotion([0, 0, 0], [0, 0], acceleration=[0, 0], duration=0.0), "duration"),
        (lambda: gs.AcceleratedMotion([0, 0], [0, 0], acceleration=[0, 0], duration=1.0), "pose must have shape"),
        (
            lambda: gs.AcceleratedMotion(
                [0, 0, 0, 0, 0, 0, 1],
                [0, 0, 0],
                acceleration=[0, 0, 0],
                angular_velocity=[1, 0, 0],
                angular_acceleration=[0, 1, 0],
                duration=1.0,
            ),
            "angular_acceleration must be about the axis of angular_velocity",
        ),
        (lambda: along(body=gs.Box([1, 1, 1])), "body must be Polygon for a motion in the plane, got Box"),
        (lambda: along(obstacles=gs.Boxes([[0, 0, 0]], [np.eye(3)], [[1, 1, 1]])), "obstacles must be Polygons"),
        (lambda: along(motion=[[0, 0, 0]]), "motion must be Trajectory or AcceleratedMotion, got list"),
        (lambda: along(velocities=[[0, 0], [0, 0]]), r"velocities must have shape \(2,\) or \(1, 2\), got \(2, 2\)"),
        (lambda: along(tolerance=0.0), "tolerance"),
    ],
)
def test_bad_input_is_named(make, text):
    with pytest.raises(gs.GeometryError, match=text):
        make()


def test_given_arrays_stay_the_callers():
    """A motion keeps copies: what it was made of can be written to, and changes nothing."""
    times, poses = np.array([0.0, 1.0]), np.zeros((2, 3))
    pose, velocity, acceleration = np.zeros(3), np.zeros(2), np.zeros(2)
    path = gs.Trajectory(times, poses)
    motion = gs.AcceleratedMotion(pose, velocity, acceleration=acceleration, duration=1.0)
    for array in (times, poses, pose, velocity, acceleration):
        array += 1.0
    assert path.times.tolist() == [0.0, 1.0] and not path.poses.any()
    assert not (motion.pose.any() or motion.velocity.any() or motion.acceleration.any())
    with pytest.raises(ValueError, match="read-only"):
        path.times[0] = 1.0


def along(**changed):
    given = {
        "body": SQUARE,
        "motion": gs.Trajectory([0.0, 1.0], [[0, 0, 0], [1, 0, 0]]),
        "obstacles": gs.Polygons.from_list([[(0, 0)]]),
    }
    return gs.first_contact_along(**{**given, **changed})
