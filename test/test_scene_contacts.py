# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""First contacts of a scene at a distance, the earliest alone, and how fast bodies approach."""

import numpy as np
import pytest
from scene_answers import rows_of, scene_of

import geomsrv as gs
from geomsrv.answers import ContactStatus

INF = np.inf
HORIZON = 2.0

# Poses are composed in float64 here: good to some 1e-14 of the few metres of a scene; times are good to 1e-6 s at some
# metres per second.
NEAR = 1e-12
SLOPPY = 2e-5


def place(pose, twist, t):
    """Pose after `t` seconds: the twist turns the body about its origin."""
    angle = np.linalg.norm(twist[3:]) * t
    turn = np.array([0.0, 0.0, 0.0, 1.0])
    if angle > 0.0:
        turn = np.concatenate([np.sin(angle / 2.0) * twist[3:] / np.linalg.norm(twist[3:]), [np.cos(angle / 2.0)]])
    (x, y, z, w), (a, b, c, d) = turn, pose[3:]
    spun = [w * a + x * d + y * c - z * b, w * b - x * c + y * d + z * a, w * c + x * b - y * a + z * d]
    return np.concatenate([pose[:3] + t * twist[:3], spun, [w * d - x * a - y * b - z * c]])


def distance_at(a, b, t):
    """Distance of two objects after `t` seconds, by the distance query."""
    poses = [place(np.asarray(item.pose, float), np.asarray(item.twist, float), t) for item in (a, b)]
    scene = gs.Scene()
    scene.apply(
        gs.SceneUpdate(add=[gs.SceneObject(n, o.shape, p) for n, o, p in zip("ab", (a, b), poses, strict=True)])
    )
    return float(scene.distances(INF).distance[0])


def random_objects(rng, count, turning, flat=False):
    objects = []
    for k in range(count):
        pose, twist = np.zeros(7), np.zeros(6)
        if flat:
            ring = np.sort(rng.uniform(0.0, 2.0 * np.pi, rng.integers(1, 6)))
            shape = gs.Polygon(rng.uniform(0.2, 0.8) * np.column_stack([np.cos(ring), np.sin(ring)]))
            angle = rng.uniform(0.0, np.pi)
            pose[:2], pose[5:] = rng.uniform(-3.0, 3.0, 2), (np.sin(angle), np.cos(angle))
            twist[:2], twist[5] = rng.normal(size=2), rng.normal() * turning
        else:
            half = rng.uniform(0.1, 0.5, 3)
            points = rng.normal(size=(6, 3)) * 0.4
            shape = [gs.Sphere(half[0]), gs.Capsule(half[0] / 2, half[1]), gs.Box(half), gs.Convex(points)][k % 4]
            turn = rng.normal(size=4)
            pose[:3], pose[3:] = rng.uniform(-2.0, 2.0, 3), turn / np.linalg.norm(turn)
            twist[:3], twist[3:] = rng.normal(size=3), rng.normal(size=3) * turning
        objects.append(gs.SceneObject(f"{k:02}", shape, pose, twist * (rng.random() < 0.8)))
    return objects


# ----------------------------------------------------------------------------------------------------------- margins


@pytest.mark.parametrize("flat", [False, True], ids=["space", "plane"])
@pytest.mark.parametrize("turning", [0.0, 1.5], ids=["sliding", "turning"])
def test_margin_is_the_distance_at_that_time(rng, turning, flat):
    """Both sides of the interval, and everything before it, by the distance query."""
    margin, reached = 0.3, dict.fromkeys(ContactStatus, 0)
    for _ in range(6):
        objects = random_objects(rng, 10, turning, flat)
        answer = scene_of(objects).first_contacts(HORIZON, margin=margin)
        rows = rows_of(answer)
        for i, a in enumerate(objects):
            for b in objects[i + 1 :]:
                k = rows.get((a.id, b.id))
                status = ContactStatus.NEVER if k is None else ContactStatus(answer.status[k])
                reached[status] += 1
                end = HORIZON if k is None else answer.time_lower[k]
                for t in np.linspace(0.0, end, 7):
                    assert k is not None and answer.time[k] == 0.0 or distance_at(a, b, t) > margin - NEAR
                if status == ContactStatus.WILL_TOUCH:
                    assert answer.time_upper[k] - answer.time_lower[k] <= 1e-6
                    assert distance_at(a, b, answer.time_upper[k]) <= margin + SLOPPY
                    assert distance_at(a, b, answer.time_lower[k]) <= margin + SLOPPY
                elif status == ContactStatus.OVERLAPPING:
                    assert distance_at(a, b, 0.0) < margin
    assert min(reached[ContactStatus.WILL_TOUCH], reached[ContactStatus.NEVER]) >= 8, reached
    assert reached[ContactStatus.OVERLAPPING] >= 2, reached


def test_margin_is_round():
    """Corner against corner: nearer than half the margin along each axis, and yet not within it."""
    cube = gs.Box([0.5, 0.5, 0.5])
    for off, expected in ((0.6, 0), (0.57, 1)):  # sqrt(3) * 0.6 > 1 > sqrt(3) * 0.57
        there = gs.SceneObject("b", cube, [1.0 + off, 1.0 + off, 9.0, 0, 0, 0, 1], [0, 0, -1.0, 0, 0, 0])
        here = gs.SceneObject("a", cube, [0, 0, 0, 0, 0, 0, 1])
        slow = gs.SceneObject("c", cube, [0, 0, -50.0, 0, 0, 0, 1])
        answer = scene_of([here, there, slow]).first_contacts(8.0 - off, margin=1.0)
        assert len(answer) == expected
    # As for two balls of half the margin each, swept: z^2 + 2 * 0.57^2 = 1.
    assert answer.time[0] == pytest.approx(8.0 - np.sqrt(1.0 - 2 * 0.57**2), abs=1e-6)
    assert answer.closing_speed[0] == pytest.approx(np.sqrt(1.0 - 2 * 0.57**2), abs=1e-5)


def test_margin_without_motion():
    """What rests is near now or never, half spaces too; what has no kernel for its motion is said."""
    floor = gs.SceneObject("floor", gs.HalfSpace((0, 0, 1), 0.0))
    for height, status in ((0.75, ContactStatus.OVERLAPPING), (1.0, ContactStatus.TOUCHING), (1.25, None)):
        ball = gs.SceneObject("ball", gs.Sphere(0.5), [0, 0, height, 0, 0, 0, 1])
        answer = scene_of([floor, ball]).first_contacts(1.0, margin=0.5)
        assert answer.status.tolist() == ([] if status is None else [status])
        if status is not None:
            assert (answer.time_lower[0], answer.time[0], answer.last_time[0]) == (0, 0, 1.0)
            assert answer.time_upper[0] == 0.0 or status == ContactStatus.TOUCHING
            np.testing.assert_allclose(answer.points, [[0, 0, (height - 0.5) / 2]])
    falling = gs.SceneObject("ball", gs.Sphere(0.5), [0, 0, 2.0, 0, 0, 0, 1], [0, 0, -1, 0, 0, 0])
    answer = scene_of([floor, falling]).first_contacts(2.0, margin=0.5)
    assert answer.time_lower[0] <= 1.0 <= answer.time_upper[0] <= answer.time_lower[0] + 1e-6
    sheet = gs.SceneObject("sheet", gs.Mesh(np.eye(3), [(0, 1, 2)]), [0, 0, 2.0, 0, 0, 0, 1])
    assert scene_of([sheet, falling]).first_contacts(1.0, margin=0.5).status.tolist() == [ContactStatus.OVERLAPPING]
    lost = gs.SceneObject("ball", gs.Sphere(0.5), [0, 0, 2.0, 0, 0, 0, 1], motion_fault="it jumps")
    answer = scene_of([sheet, lost]).first_contacts(1.0, margin=0.5)
    assert answer.unsupported == [("ball", "sheet", "first contact at a distance (mesh-sphere) is unsupported")]


def test_margin_where_only_the_present_is_asked_about():
    """Whatever moves is where it is, and every pair is counted once."""
    floor = gs.SceneObject("floor", gs.HalfSpace((0, 0, 1), 0.0))
    falling = gs.SceneObject("ball", gs.Sphere(0.5), [0, 0, 0.75, 0, 0, 0, 1], [0, 0, -1, 0, 0, 0])
    answer = scene_of([floor, falling]).first_contacts(0.0, margin=0.5)
    assert answer.status.tolist() == [ContactStatus.OVERLAPPING] and answer.unsupported == []
    assert answer.cost.counts["narrow half_space-sphere"] == 1


@pytest.mark.parametrize(
    ("margin", "accuracy", "text"),
    [
        (-0.1, "float64", "margin must be >= 0, got -0.1"),
        (np.nan, "float64", "margin"),
        ("wide", "float64", "margin"),
        (0.1, "exact", "a margin is available at accuracy 'float64' only, not at 'exact'"),
    ],
)
def test_margin_that_cannot_be(margin, accuracy, text):
    with pytest.raises(gs.GeometryError, match=text):
        gs.Scene().first_contacts(1.0, margin=margin, accuracy=accuracy)


# ---------------------------------------------------------------------------------------------------------- earliest


@pytest.mark.parametrize("margin", [0.0, 0.25])
@pytest.mark.parametrize("turning", [0.0, 1.0], ids=["sliding", "turning"])
def test_earliest_is_the_first_of_all(rng, turning, margin):
    later = looked = 0
    for _ in range(4):
        objects = random_objects(rng, 60, turning)
        for k, item in enumerate(objects):  # further apart, so that few touch at the start
            objects[k] = gs.SceneObject(item.id, item.shape, [*(4.0 * item.pose[:3]), *item.pose[3:]], item.twist)
        scene = scene_of(objects)
        full, alone = (scene.first_contacts(3.0, margin=margin, earliest=e) for e in (False, True))
        k = int(np.nanargmin(full.time))
        assert (alone.ids_a, alone.ids_b) == ([full.ids_a[k]], [full.ids_b[k]])
        for name in ("status", "time", "time_lower", "time_upper", "last_time", "normal", "closing_speed"):
            np.testing.assert_array_equal(getattr(alone, name)[0], getattr(full, name)[k])
        later += alone.cost.counts["later"]
        looked += full.cost.counts["candidates"]
    assert 0 < later < looked, (later, looked)


def test_earliest_of_equals_is_the_first_by_id():
    cube, away = gs.Box([0.5, 0.5, 0.5]), 100.0
    objects = []
    for k in range(200):
        objects += [
            gs.SceneObject(f"{k:03} left", cube, [0, away * k, 0, 0, 0, 0, 1], [1, 0, 0, 0, 0, 0]),
            gs.SceneObject(f"{k:03} right", cube, [3.0 if k else 4.0, away * k, 0, 0, 0, 0, 1]),
        ]
    answer = scene_of(objects).first_contacts(10.0, earliest=True)
    assert (answer.ids_a, answer.ids_b, answer.time.tolist()) == (["001 left"], ["001 right"], [2.0])
    assert scene_of(objects[:2]).first_contacts(1.0, earliest=True).ids_a == []


def test_earliest_keeps_what_is_unsupported():
    sheet = gs.Mesh([(-1, -1, 0), (1, -1, 0), (0, 1, 0)], [(0, 1, 2)])
    flying = gs.SceneObject("flying", sheet, [0, 0, 3.0, 0, 0, 0, 1], motion_fault="it jumps")
    cubes = [
        gs.SceneObject(name, gs.Box([0.5, 0.5, 0.5]), [0, 0, z, 0, 0, 0, 1], [0, 0, v, 0, 0, 0])
        for name, z, v in (("low", 0.0, 0.0), ("up", 9.0, -4.0))
    ]
    answer = scene_of([flying, *cubes]).first_contacts(4.0, earliest=True)
    assert [pair[:2] for pair in answer.unsupported] == [("flying", "low"), ("flying", "up")]
    assert [ContactStatus(s) for s in answer.status] == [ContactStatus.UNSUPPORTED] * 2 + [ContactStatus.WILL_TOUCH]
    assert answer.time[2] == 2.0


def test_order_of_insertion_changes_no_bit(rng):
    objects = random_objects(rng, 20, 0.5)
    answers = []
    for _ in range(3):
        scene = gs.Scene()
        for k in rng.permutation(len(objects)).tolist():
            scene.apply(gs.SceneUpdate(add=[objects[k]]))
        answers.append([scene.first_contacts(2.0, **o) for o in ({}, {"margin": 0.2}, {"earliest": True})])
    for first, *others in zip(*answers, strict=True):
        assert len(first)
        for other in others:
            assert (first.ids_a, first.ids_b) == (other.ids_a, other.ids_b)
            for name in (
                "status",
                "time",
                "time_lower",
                "time_upper",
                "last_time",
                "normal",
                "closing_speed",
                "points",
            ):
                np.testing.assert_array_equal(getattr(first, name), getattr(other, name))


# ----------------------------------------------------------------------------------------------------- closing speed


@pytest.mark.parametrize("turning", [0.0, 1.5], ids=["sliding", "turning"])
def test_closing_speed_is_that_of_the_distance(rng, turning):
    """A body that comes nearer does so as fast as its nearest points do, just before they meet."""
    checked = 0
    for _ in range(8):
        objects = {item.id: item for item in random_objects(rng, 10, turning)}
        answer = scene_of(list(objects.values())).first_contacts(HORIZON)
        for k, pair in enumerate(zip(answer.ids_a, answer.ids_b, strict=True)):
            if answer.status[k] != ContactStatus.WILL_TOUCH or answer.time[k] < 2e-3:
                continue
            a, b = (objects[name] for name in pair)
            ahead = distance_at(a, b, answer.time[k] - 1e-3) - distance_at(a, b, answer.time[k])
            assert answer.closing_speed[k] == pytest.approx(ahead / 1e-3, abs=0.02 + 0.02 * turning)
            checked += 1
    assert checked >= 10


def test_closing_speed_of_several_parts():
    """A mesh that turns and touches now, in a point and along an edge and more: the fastest of all points counts."""
    corners = [(0, 0, 1), (0.25, 0, 1), (0.25, 0.25, 1), (0.5, 0.5, 1), (0.75, 0.5, 2), (0.75, 0.75, 2)]
    mesh = gs.Mesh(corners, [(0, 1, 2), (3, 4, 5)])
    box = gs.SceneObject("a", gs.Box([1, 1, 1]), [0, 0, 0, 0, 0, 0, 1])
    leaning = gs.SceneObject("b", mesh, [0, 0, 0, 0, 0, 0, 1], [0, 0, 0, 1.0, 0, 0])
    answer = scene_of([box, leaning]).first_contacts(0.0)
    assert sorted(np.diff(answer.part_offsets).tolist()) == [1, 3]
    # About x a point at y goes up by y: the lowest goes nowhere.
    np.testing.assert_array_equal(answer.normal, [[0, 0, 1]])
    assert answer.closing_speed.tolist() == [0.0]


def test_closing_speed_of_what_touches():
    cube = gs.Box([0.5, 0.5, 0.5])
    for x, speed in (([1, 0, 0], 2.0), ([0, 1, 0], 0.0), ([-1, 0, 0], -2.0)):
        push = [*(2.0 * np.array(x)), 0, 0, 0]
        pair = [
            gs.SceneObject("a", cube, [0, 0, 0, 0, 0, 0, 1], push),
            gs.SceneObject("b", cube, [1, 0, 0, 0, 0, 0, 1]),
        ]
        assert scene_of(pair).first_contacts(1.0).closing_speed.tolist() == [speed]
        lost = [gs.SceneObject("a", cube, [0, 0, 0, 0, 0, 0, 1], push, motion_fault="who knows"), pair[1]]
        assert np.isnan(scene_of(lost).first_contacts(1.0).closing_speed[0])
