# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""Scenes: atomic changes, and queries that agree with asking about every pair by itself."""

from __future__ import annotations

import itertools
import math
import threading
import time
from fractions import Fraction

import numpy as np
import pytest
from scene_answers import rows_of, scene_of

import geomsrv as gs
from geomsrv.answers import ContactStatus, DistanceStatus
from geomsrv.broad_phase import boxes_now, boxes_swept

IDENTITY = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)
REST = np.zeros(6)
INF = np.inf
SHEET = gs.Mesh([(-1.0, -1.0, 0.0), (1.0, -1.0, 0.0), (0.0, 1.0, 0.0)], [(0, 1, 2)])  # no kernel measures it


def at(*position, yaw=0.0):
    return (*position, 0.0, 0.0, np.sin(yaw / 2.0), np.cos(yaw / 2.0))


def random_pose(rng, span=5.0):
    q = rng.normal(size=4)
    return np.concatenate([rng.uniform(-span, span, 3), q / np.linalg.norm(q)])


def random_solid(rng):
    """A shape of any kind that has kernels, but a half space."""
    match rng.integers(6):
        case 0:
            return gs.Sphere(rng.uniform(0.0, 1.0))
        case 1:
            return gs.Capsule(rng.uniform(0.0, 0.5), rng.uniform(0.0, 2.0))
        case 2:
            return gs.Box(rng.uniform(0.0, 1.0, 3))
        case 3:
            return gs.Convex(rng.normal(size=(rng.integers(1, 12), 3)) * 0.5 + rng.uniform(-2.0, 2.0, 3))
        case 4:
            return gs.Triangle(*rng.uniform(-1.0, 1.0, (3, 3)))
        case _:
            return gs.Segment(*rng.uniform(-1.0, 1.0, (2, 3)))


def convex_ring(rng, size=1.0):
    """3 to 8 points on an ellipse, counter-clockwise."""
    angle = np.sort(rng.uniform(0.0, 2.0 * np.pi, rng.integers(3, 9)))
    return np.column_stack([np.cos(angle), rng.uniform(0.2, 1.0) * np.sin(angle)]) * size


def solid_scene(n, seed, span=5.0, half_spaces=1):
    rng = np.random.default_rng(seed)
    objects = [gs.SceneObject(f"solid {k:04}", random_solid(rng), random_pose(rng, span)) for k in range(n)]
    objects += [
        gs.SceneObject(f"wall {k}", gs.HalfSpace(rng.normal(size=3), -span), random_pose(rng, 1.0))
        for k in range(half_spaces)
    ]
    return objects


def relative_pose(a, b):
    """Pose of b in a, by matrices: another way than the scene's."""
    turn_a, turn_b = (gs._validate.rotation_matrices(np.asarray(pose)[None, 3:])[0] for pose in (a, b))
    m = turn_a.T @ turn_b
    w = np.sqrt(max(0.0, 1.0 + np.trace(m))) / 2.0
    # The largest part first: no division by a small number.
    squares = np.array([1.0 + 2.0 * m[k, k] - np.trace(m) for k in range(3)] + [4.0 * w * w])
    k = int(np.argmax(squares))
    part = np.sqrt(squares[k]) / 2.0
    if k == 3:
        x, y, z = (m[2, 1] - m[1, 2]), (m[0, 2] - m[2, 0]), (m[1, 0] - m[0, 1])
        q = np.array([x, y, z, 4.0 * part * part]) / (4.0 * part)
    else:
        i, j = (k + 1) % 3, (k + 2) % 3
        q = np.zeros(4)
        q[k], q[i], q[j] = part, (m[i, k] + m[k, i]) / (4.0 * part), (m[j, k] + m[k, j]) / (4.0 * part)
        q[3] = (m[j, i] - m[i, j]) / (4.0 * part)
    return np.concatenate([turn_a.T @ (np.asarray(b)[:3] - np.asarray(a)[:3]), q / np.linalg.norm(q)])


def brute_force(objects, want=("distance",)):
    """{(id_a, id_b): one-row Distances} of all pairs, asked one by one."""
    objects = sorted(objects, key=lambda o: o.id)
    return {
        (a.id, b.id): gs.distance(a.shape, b.shape, relative_pose(a.pose, b.pose), want=want)
        for a, b in itertools.combinations(objects, 2)
    }


def same_answers(a, b):
    """Every public array of two answers is equal, bit for bit."""
    assert (a.ids_a, a.ids_b, a.unsupported) == (b.ids_a, b.ids_b, b.unsupported)
    for name in ("distance", "lower", "upper", "point_a", "point_b", "normal", "status"):
        np.testing.assert_array_equal(getattr(a, name), getattr(b, name))


# ------------------------------------------------------------------------------------------------ queries, solids


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("want", [("distance",), ("penetration",)])
def test_distances_are_those_of_every_pair_asked_by_itself(seed, want):
    objects = solid_scene(40, seed, span=3.0)
    answer = scene_of(objects).distances(1.5, want=want)
    found, alone = rows_of(answer), brute_force(objects, want)
    near = {pair for pair, one in alone.items() if one.distance[0] <= 1.5}
    assert set(found) == near
    assert 60 < len(near) < 400
    assert (answer.distance <= 0.0).sum() > 5 and (answer.distance > 0.0).sum() > 30
    objects = {o.id: o for o in objects}
    for pair, k in found.items():
        one = alone[pair]
        # The pose of the pair was rounded differently, so the values may differ, but both intervals hold.
        assert answer.lower[k] <= one.upper[0] + 1e-13 and one.lower[0] <= answer.upper[k] + 1e-13, pair
        assert answer.distance[k] == pytest.approx(one.distance[0], abs=1e-9), pair
        assert answer.lower[k] <= answer.distance[k] <= answer.upper[k], pair
        if answer.distance[k] > 1e-6:
            # Points and normal are in the fixed frame.
            step = answer.point_b[k] - answer.point_a[k]
            assert np.linalg.norm(step) == pytest.approx(answer.distance[k], abs=1e-9), pair
            np.testing.assert_allclose(answer.normal[k] * answer.distance[k], step, atol=1e-9)


def test_rows_are_sorted_and_do_not_depend_on_the_order_of_insertion():
    objects = solid_scene(60, 7)
    orders = [objects, objects[::-1], [objects[k] for k in np.random.default_rng(1).permutation(len(objects))]]
    scenes = [scene_of(order) for order in orders]
    one_by_one = gs.Scene()
    for item in orders[2]:
        one_by_one.apply(gs.SceneUpdate(add=[item]))
    answers = [scene.distances(1.0, want=("penetration",)) for scene in (*scenes, one_by_one)]
    pairs = list(zip(answers[0].ids_a, answers[0].ids_b, strict=True))
    assert pairs == sorted(pairs) and all(a < b for a, b in pairs) and len(pairs) > 50
    for other in answers[1:]:
        same_answers(answers[0], other)


def test_ids_and_others_select_pairs():
    scene = scene_of(solid_scene(50, 11))
    everything = scene.distances(2.0)
    pairs = set(rows_of(everything))
    some, more = scene.ids[3:9], scene.ids[5:30]
    by_one = scene.distances(2.0, ids=some)
    assert set(rows_of(by_one)) == {(a, b) for a, b in pairs if a in some or b in some}
    by_both = scene.distances(2.0, ids=some, others=more)
    wanted = {(a, b) for a, b in pairs if (a in some and b in more) or (b in some and a in more)}
    assert set(rows_of(by_both)) == wanted and 0 < len(wanted) < len(by_one)
    within = scene.distances(2.0, ids=some, others=some)
    assert set(rows_of(within)) == {(a, b) for a, b in pairs if a in some and b in some}
    assert within.cost.counts["pairs"] == 6 * 5 // 2
    assert by_one.cost.counts["pairs"] == 6 * (len(scene) - 6) + 15
    k, m = rows_of(everything)[next(iter(rows_of(by_one)))], 0
    assert everything.distance[k] == by_one.distance[m]
    with pytest.raises(gs.SceneError, match="nobody"):
        scene.distances(1.0, ids=["nobody"])
    with pytest.raises(gs.GeometryError, match="others"):
        scene.distances(1.0, others=some)
    with pytest.raises(gs.GeometryError, match="string"):
        scene.distances(1.0, ids="solid 0001")


@pytest.mark.parametrize("seed", range(30))
@pytest.mark.parametrize("span", [3.0, 30.0])
def test_nearest_pair_is_that_of_brute_force(seed, span):
    objects = solid_scene(25, seed, span)
    rng = np.random.default_rng(seed)
    allowed = [tuple(rng.choice([o.id for o in objects], 2, replace=False).tolist()) for _ in range(30)]
    scene = scene_of(objects, allowed_pairs=allowed)
    for want in (("distance",), ("penetration",)):
        for ids in (None, [o.id for o in objects[4:8]]):
            nearest = scene.nearest_pair(want=want, ids=ids)
            everything = scene.distances(INF, want=want, ids=ids)
            assert len(nearest) == 1
            k = int(np.argmin(everything.distance))
            assert (nearest.ids_a, nearest.ids_b) == ([everything.ids_a[k]], [everything.ids_b[k]])
            assert nearest.distance[0] == everything.distance[k]
            assert nearest.lower[0] == everything.lower[k] and nearest.upper[0] == everything.upper[k]


def test_nearest_pair_of_many_looks_at_few():
    rng = np.random.default_rng(5)
    n = 5000
    objects = [gs.SceneObject(f"{k:05}", gs.Sphere(0.1), at(*rng.uniform(-100.0, 100.0, 3))) for k in range(n)]
    scene = scene_of(objects)
    position = np.array([o.pose[:3] for o in objects])
    answer = scene.nearest_pair()
    best = min((np.linalg.norm(position[k + 1 :] - position[k], axis=1).min(), k) for k in range(n - 1))
    assert answer.distance[0] == pytest.approx(max(best[0] - 0.2, 0.0), abs=1e-12)
    assert answer.cost.counts["candidates"] < n


def test_nearest_pair_is_not_the_one_with_the_nearest_boxes():
    """A hundred pairs of balls, diagonally apart, have nearer boxes than the one pair along an axis."""
    ball = gs.Sphere(1.0)
    objects = []
    for k in range(100):
        place = 10.0 * np.array([*divmod(k, 10), 0.0])
        step = np.array([2.1, 2.1, 0.0]) if k != 37 else np.array([2.6, 0.0, 0.0])
        objects += [gs.SceneObject(f"{k:02} {n}", ball, at(*(place + n * step))) for n in range(2)]
    answer = scene_of(objects).nearest_pair()
    assert (answer.ids_a, answer.ids_b) == (["37 0"], ["37 1"])
    assert answer.distance[0] == pytest.approx(0.6, abs=1e-12)
    assert answer.cost.counts["narrow sphere-sphere"] > 64


def test_nearest_pair_without_a_pair():
    assert len(gs.Scene().nearest_pair()) == 0
    assert len(scene_of([gs.SceneObject("a", gs.Sphere(1.0))]).nearest_pair()) == 0
    two = [gs.SceneObject("a", gs.Sphere(1.0)), gs.SceneObject("b", gs.Sphere(1.0))]
    assert len(scene_of(two, allowed_pairs=[("b", "a")]).nearest_pair()) == 0
    assert len(scene_of(two).nearest_pair()) == 1
    sheets = [gs.SceneObject(name, SHEET) for name in "ab"]
    answer = scene_of(sheets).nearest_pair()
    assert len(answer) == 0
    assert answer.unsupported == [("a", "b", "distance mesh-mesh is unsupported in this version")]
    far = [gs.SceneObject("a", gs.Sphere(1.0)), gs.SceneObject("b", gs.Sphere(1.0), at(1e200, 0.0, 0.0))]
    assert scene_of(far).nearest_pair().distance[0] == pytest.approx(1e200)


def test_contacts_have_depth():
    objects = [
        gs.SceneObject("a", gs.Sphere(1.0)),
        gs.SceneObject("b", gs.Sphere(1.0), at(1.5, 0.0, 0.0)),
        gs.SceneObject("c", gs.Sphere(1.0), at(3.5, 0.0, 0.0)),
        gs.SceneObject("d", gs.Sphere(1.0), at(5.6, 0.0, 0.0)),
    ]
    answer = scene_of(objects).contacts()
    assert rows_of(answer) == {("a", "b"): 0, ("b", "c"): 1}
    np.testing.assert_allclose(answer.distance, [-0.5, 0.0], atol=1e-15)


def test_half_space_against_a_thousand_shapes():
    rng = np.random.default_rng(2)
    balls = [
        gs.SceneObject(f"{k:04}", gs.Sphere(0.2), at(*(10.0 * np.array(divmod(k, 32))), rng.uniform(-1.0, 3.0)))
        for k in range(1000)
    ]
    height = np.array([ball.pose[2] for ball in balls])
    turned = np.array([1.0, 2.0, 3.0, 0.5, 0.5, 0.5, 0.5])  # takes z to x, x to y, y to z
    for floor in (
        gs.SceneObject("floor", gs.HalfSpace((0.0, 0.0, 1.0), 0.0)),
        gs.SceneObject("floor", gs.HalfSpace((0.0, 1.0, 0.0), -3.0), turned),
        gs.SceneObject("floor", gs.HalfSpace((0.0, 1e-9, 1.0), 0.0)),
    ):
        scene = scene_of([*balls, floor])
        answer = scene.distances(0.5)
        assert set(answer.ids_b) == {"floor"}
        near = np.flatnonzero(height - 0.2 <= 0.5)
        assert answer.ids_a == [balls[k].id for k in near] and 300 < len(near) < 700
        np.testing.assert_allclose(answer.distance, np.maximum(height[near] - 0.2, 0.0), atol=1e-6)
        # A boundary perpendicular to an axis bounds the box of a half space on that side.
        tilted = floor.shape.normal[1] == 1e-9
        assert answer.cost.counts["candidates"] == (1000 if tilted else len(near))


def test_ten_thousand_shapes_are_not_fifty_million_pairs(capsys):
    rng = np.random.default_rng(0)
    n = 10_000
    span = n ** (1.0 / 3.0)
    shapes = [gs.Box(rng.uniform(0.1, 0.5, 3)) for _ in range(50)]
    objects = [
        gs.SceneObject(f"{k:05}", shapes[k % 50], random_pose(rng, span / 2.0), (1.0, 0.0, 0.0, 0.0, 0.0, 1.0))
        for k in range(n)
    ]
    scene = gs.Scene()
    marks = [time.perf_counter()]
    scene.apply(gs.SceneUpdate(add=objects))
    assert len(scene.ids) == n
    marks.append(time.perf_counter())
    contacts = scene.contacts()
    marks.append(time.perf_counter())
    poses = np.array([o.pose for o in objects])
    scene.set_states(scene.ids, poses + [0.01, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    marks.append(time.perf_counter())
    scene.contacts()
    marks.append(time.perf_counter())
    counts = contacts.cost.counts
    assert counts["pairs"] == n * (n - 1) // 2
    assert len(contacts) > 3000
    assert counts["candidates"] < 10 * n
    assert counts["narrow box-box"] == counts["candidates"]
    took = 1e3 * np.diff(marks)
    with capsys.disabled():
        print(
            f"\n{n} boxes: apply {took[0]:.0f} ms, contacts {took[1]:.0f} ms (first), set_states {took[2]:.1f} ms, "
            f"contacts {took[3]:.0f} ms; {counts['candidates']} candidates, {len(contacts)} contacts"
        )


# ---------------------------------------------------------------------------------------- what is allowed, or missing


def test_allowed_pairs_are_ignored():
    objects = solid_scene(30, 3)
    pairs = list(rows_of(scene_of(objects).distances(2.0)))
    allowed = pairs[::3]
    scene = scene_of(objects, allowed_pairs=[pair[::-1] for pair in allowed])
    answer = scene.distances(2.0)
    assert list(rows_of(answer)) == [pair for pair in pairs if pair not in allowed]
    assert answer.cost.counts["allowed"] >= len(allowed) > 10
    assert scene.allowed_pairs == frozenset(allowed)
    # Allowed and checked again; one version each.
    version = scene.version
    assert scene.apply(gs.SceneUpdate(disallow=allowed[:1])) == version + 1
    assert allowed[0] in rows_of(scene.distances(2.0))
    assert scene.apply(gs.SceneUpdate(allow=allowed[:1])) == version + 2
    assert scene.apply(gs.SceneUpdate(allow=allowed[:1])) == version + 2, "nothing changed"
    with pytest.raises(gs.SceneError, match="not allowed"):
        scene.apply(gs.SceneUpdate(disallow=[("never", "mentioned")]))
    # Links without geometry, and objects that go and come back.
    scene.apply(gs.SceneUpdate(allow=[("ghost", objects[0].id)], remove=[objects[1].id]))
    scene.apply(gs.SceneUpdate(add=[objects[1], gs.SceneObject("ghost", gs.Sphere(100.0))]))
    pairs = rows_of(scene.distances(2.0))
    assert ("ghost", objects[0].id) not in pairs and ("ghost", objects[1].id) in pairs
    # Clearing forgets what was allowed since.
    scene.apply(gs.SceneUpdate(clear=True))
    assert scene.allowed_pairs == frozenset(allowed) and len(scene) == 0


def test_pairs_without_a_kernel_are_named():
    objects = [
        gs.SceneObject("a sheet", SHEET),
        gs.SceneObject("b can", gs.Cylinder(1.0, 1.0), at(0.5, 0.0, 0.0)),
        gs.SceneObject("c floor", gs.HalfSpace((0.0, 0.0, 1.0), -9.0)),
        gs.SceneObject("d ball", gs.Sphere(1.0), at(0.0, 1.0, 0.0)),
        gs.SceneObject("e ball", gs.Sphere(1.0), at(0.0, 2.0, 0.0)),
    ]
    scene = scene_of(objects)
    answer = scene.distances(0.5)
    assert rows_of(answer) == {("b can", "d ball"): 0, ("b can", "e ball"): 1, ("d ball", "e ball"): 2}
    assert (answer.status == DistanceStatus.OK).all()
    reason = "distance {} is unsupported in this version"
    assert answer.unsupported == [
        ("a sheet", "b can", reason.format("cylinder-mesh")),
        ("a sheet", "d ball", reason.format("mesh-sphere")),
        ("a sheet", "e ball", reason.format("mesh-sphere")),
    ]
    assert answer.cost.counts["unsupported"] == 3
    assert "2 x distance mesh-sphere is unsupported" in answer.message
    assert "cylinder-mesh" in scene.plan() and "half_space-mesh" in scene.plan() and "mesh-mesh" not in scene.plan()
    # First contact looks at triangles, and needs no distances; at other tiers such pairs have a row: never dropped.
    contacts = scene.first_contacts(1.0)
    assert contacts.unsupported == []
    assert contacts.status[rows_of(contacts)["a sheet", "d ball"]] == ContactStatus.OVERLAPPING
    contacts = scene.first_contacts(1.0, accuracy="exact")
    assert [pair[:2] for pair in contacts.unsupported] == [pair[:2] for pair in answer.unsupported]
    assert contacts.status[rows_of(contacts)["a sheet", "d ball"]] == ContactStatus.UNSUPPORTED


def test_solids_and_polygons_are_not_compared_and_said_so_once():
    ring = [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)]
    objects = [gs.SceneObject(f"p{k}", gs.Polygon(ring), at(2.0 * k, 0.0, 0.0)) for k in range(3)]
    objects += [gs.SceneObject(f"s{k}", gs.Sphere(1.0), at(3.0 * k, 0.0, 0.0)) for k in range(2)]
    scene = scene_of(objects)
    answer = scene.distances(1.0)
    assert list(rows_of(answer)) == [("p0", "p1"), ("p1", "p2"), ("s0", "s1")]
    np.testing.assert_array_equal(answer.distance, [1.0, 1.0, 1.0])
    np.testing.assert_array_equal(answer.point_a[0], [1.0, 0.0, 0.0])
    np.testing.assert_array_equal(answer.normal[0], [1.0, 0.0, 0.0])
    assert answer.unsupported == []
    assert answer.message == "3 polygons are compared with each other only, never with 2 solids"
    assert scene.plan().count("never with solids") == 1
    assert answer.cost.counts["pairs"] == 3 + 1


# ----------------------------------------------------------------------------------------------------- first contact


def moving_polygons(n, seed, span=6.0):
    rng = np.random.default_rng(seed)
    return [
        gs.SceneObject(
            f"{k:03}",
            gs.Polygon(convex_ring(rng, 0.7)),
            at(*rng.uniform(-span, span, 2), 0.0, yaw=rng.uniform(-3.0, 3.0)),
            (*rng.uniform(-1.0, 1.0, 2), 0.0, 0.0, 0.0, 0.0),
        )
        for k in range(n)
    ]


def placed_ring(item):
    """Vertices in the plane."""
    pose = np.asarray(item.pose)
    turn = gs._validate.rotation_matrices(pose[None, 3:])[0, :2, :2]
    return item.shape.vertices @ turn.T + pose[:2]


@pytest.mark.parametrize("horizon", [0.0, 2.0, INF])
def test_first_contacts_of_polygons_are_those_of_every_pair_asked_by_itself(horizon):
    objects = moving_polygons(40, 5)
    answer = scene_of(objects).first_contacts(horizon)
    found = rows_of(answer)
    hits = 0
    for a, b in itertools.combinations(objects, 2):
        one = gs.first_contact(
            *(gs.Polygons.from_list([placed_ring(item)]) for item in (a, b)),
            *(np.array(item.twist[:2]) for item in (a, b)),
            t_max=horizon,
        )
        if one.status[0] == gs.NEVER:
            assert (a.id, b.id) not in found
            continue
        hits += 1
        k = found[a.id, b.id]
        assert answer.status[k] == one.status[0]
        assert answer.time[k] == pytest.approx(one.time[0], abs=1e-9)
        assert answer.last_time[k] == pytest.approx(one.last_time[0], rel=1e-9, abs=1e-9)
        np.testing.assert_allclose(answer.normal[k, :2], one.normal[0], atol=1e-9)
        points = answer.points[answer.point_offsets[k] : answer.point_offsets[k + 1]]
        assert len(points) == len(one.points) and (points[:, 2] == 0.0).all()
        np.testing.assert_allclose(points[:, :2], one.points, atol=1e-9)
    assert hits == len(answer) > 5
    assert answer.unsupported == []


def test_rotation_is_never_treated_as_translation():
    square = gs.Polygon([(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)])
    bar = gs.Polygon([(-2.0, -0.1), (2.0, -0.1), (2.0, 0.1), (-2.0, 0.1)])
    spin = (0.0, 0.0, 0.0, 0.0, 0.0, 1.0)
    objects = [
        gs.SceneObject("bar", bar, at(0.0, 0.0, 0.0), spin),
        gs.SceneObject("near", square, at(0.0, 1.5, 0.0)),  # the bar will hit it
        gs.SceneObject("touched", square, at(2.4, 0.0, 0.0)),  # and is in this one now
        gs.SceneObject("far", square, at(0.0, 9.0, 0.0)),  # out of reach, however it turns
    ]
    scene = scene_of(objects)
    answer = scene.first_contacts(10.0)
    found = rows_of(answer)
    assert set(found) == {("bar", "near"), ("bar", "touched")}
    k = found["bar", "near"]
    # The near side of the bar, which is 0.1 from its middle, comes to the corner (0.5, 1.0).
    expected = np.arctan2(1.0, 0.5) - np.arcsin(0.1 / np.hypot(0.5, 1.0))
    assert answer.status[k] == ContactStatus.WILL_TOUCH and not answer.unsupported
    assert answer.time_lower[k] <= expected <= answer.time_upper[k] <= answer.time_lower[k] + 1e-6
    np.testing.assert_allclose(answer.points[answer.point_offsets[k]], [0.5, 1.0, 0.0], atol=1e-5)
    assert np.isnan(answer.last_time[k]) and "followed while they turn, at tier float64: 1 object" in scene.plan()
    k = found["bar", "touched"]
    assert answer.status[k] == ContactStatus.OVERLAPPING and answer.time[k] == 0.0 == answer.time_upper[k]
    assert np.isnan(answer.last_time[k]), "nobody looks for the end"
    # Translating only, the same pair never touches.
    still = scene_of([gs.SceneObject(o.id, o.shape, o.pose) for o in objects])
    assert set(rows_of(still.first_contacts(10.0))) == {("bar", "touched")}
    # Without time to turn in, it is enough to look.
    assert set(rows_of(scene.first_contacts(0.0))) == {("bar", "touched")}
    # Where it is not known how an object moves, nothing is followed.
    lost = [gs.SceneObject(o.id, o.shape, o.pose, o.twist, motion_fault="who knows") for o in objects[:2]]
    assert scene_of(lost).first_contacts(10.0).status.tolist() == [ContactStatus.UNSUPPORTED]


def spinning(name, shape, pose=IDENTITY, spin=(0.0, 0.0, 1.0), velocity=(0.0, 0.0, 0.0), **fields):
    return gs.SceneObject(name, shape, pose, (*velocity, *spin), **fields)


def test_solids_that_turn():
    """A long box about its middle, against other solids that it comes to after a quarter of a turn, less a bit."""
    bar = gs.Box((2.0, 0.1, 0.1))
    reach = 1.5 - 0.5  # of the others, from the origin along y
    for shape, first in (
        (gs.Sphere(0.5), np.arccos(0.6 / 1.5)),
        (gs.Capsule(0.5, 1.0), np.arccos(0.6 / 1.5)),
        (gs.Box((0.5, 0.5, 0.5)), np.arctan2(reach, 0.5) - np.arcsin(0.1 / np.hypot(0.5, reach))),
        (gs.Convex([(-0.5, -0.5, 0), (0.5, -0.5, 0), (0, 0.5, 0.5), (0, 0.5, -0.5)]), None),
        (gs.Point((0.0, 0.0, 0.0)), np.pi / 2 - np.arcsin(0.1 / 1.5)),
    ):
        for objects in (
            [spinning("bar", bar), gs.SceneObject("other", shape, at(0.0, 1.5, 0.0))],
            [gs.SceneObject("a", shape, at(0.0, 1.5, 0.0)), spinning("bar", bar)],
        ):
            answer = scene_of(objects).first_contacts(10.0)
            assert answer.status.tolist() == [ContactStatus.WILL_TOUCH], shape
            assert answer.time_upper[0] - answer.time_lower[0] <= 1e-6
            if first is None:
                first = np.arctan2(reach, 0.5) - np.arcsin(0.1 / np.hypot(0.5, reach))
            assert answer.time_lower[0] <= first + 1e-12 and first - 1e-12 <= answer.time_upper[0], shape
            assert answer.cost.counts["rotation"] == 1
            side = 1.0 if answer.ids_a == ["bar"] else -1.0
            if shape.kind != "point":  # the face of the bar, or its normal there
                np.testing.assert_allclose(side * answer.normal[0], [-np.sin(first), np.cos(first), 0.0], atol=1e-5)
    # The point on a ball is on its surface.
    ball = scene_of([spinning("bar", bar), gs.SceneObject("ball", gs.Sphere(0.5), at(0.0, 1.5, 0.0))]).first_contacts(
        9.0
    )
    assert np.linalg.norm(ball.points[0] - [0.0, 1.5, 0.0]) == pytest.approx(0.5, abs=1e-5)
    # Out of reach for ever, and a surface.
    far = scene_of([spinning("bar", bar), gs.SceneObject("ball", gs.Sphere(0.5), at(0.0, 3.0, 0.0))])
    assert len(far.first_contacts(INF)) == 0
    sheet = scene_of([spinning("bar", bar), gs.SceneObject("sheet", SHEET, at(0.0, 1.5, 0.0))])
    assert sheet.first_contacts(10.0).status.tolist() == [ContactStatus.WILL_TOUCH]
    # Turning alike is not being at rest relative to each other: each turns about its own origin.
    for away, statuses in ((0.3, []), (1.5, [ContactStatus.WILL_TOUCH]), (5.0, [])):
        alike = scene_of([spinning("a", bar), spinning("b", bar, at(0.0, away, 0.0), spin=(0.0, 0.0, 1.0))])
        assert alike.first_contacts(INF if away > 1.0 else 0.1).status.tolist() == statuses
    crossed = scene_of([spinning("a", bar), spinning("b", bar, at(0.0, 3.0, 0.0), spin=(0.0, 0.0, -1.0))])
    assert crossed.first_contacts(INF).status.tolist() == [ContactStatus.WILL_TOUCH]


def test_solids_that_turn_and_are_uncertain():
    bar, ball = gs.Box((2.0, 0.1, 0.1)), gs.Sphere(0.5)

    def of(by=0.0, drift=0.0, away=1.5):
        pair = [spinning("bar", bar, uncertainty=by, velocity_uncertainty=drift)]
        return scene_of([*pair, gs.SceneObject("ball", ball, at(0.0, away, 0.0))]).first_contacts(1.3)

    sure, vague, drifting = of(), of(by=0.01), of(drift=0.01)
    first = np.arccos(0.6 / 1.5)
    assert sure.time[0] == vague.time[0] == drifting.time[0]
    # 0.01 nearer or farther along the normal.
    assert vague.time_lower[0] <= np.arccos(0.61 / 1.5) <= vague.time_lower[0] + 1e-6
    assert np.arccos(0.59 / 1.5) <= vague.time_upper[0] <= first + 0.05
    assert first - 0.02 <= drifting.time_lower[0] < first < drifting.time_upper[0] <= first + 0.05
    # Just out of reach of the bar's corner, and not so sure.
    away = np.hypot(2.0, 0.1) + 0.5
    assert len(of(away=away + 0.005)) == 0
    may = of(by=0.01, away=away + 0.005)
    assert len(may) == 0 or may.time_upper[0] == INF  # only if it can turn there in time
    turned = scene_of(
        [spinning("bar", bar, uncertainty=0.01), gs.SceneObject("ball", ball, at(0.0, away + 0.005, 0.0))]
    ).first_contacts(3.0)
    assert turned.status.tolist() == [ContactStatus.NEVER] and turned.time_upper[0] == INF
    assert 1.4 < turned.time_lower[0] < np.pi / 2


@pytest.mark.parametrize(("spin", "radius", "share"), [(0.05, 0.05, 0.55), (1.0, 0.01, 0.85)])
def test_intervals_of_uncertain_boxes_that_turn_hold_and_mostly_end(spin, radius, share):
    """All placements within the uncertainty meet in the interval, and most hits have an end of it."""
    rng = np.random.default_rng(11)
    objects, tried = [], 0
    for k in range(120):
        twist = np.concatenate([rng.normal(size=3), spin * rng.normal(size=3)])
        objects.append((f"o{k:03}", gs.Box(rng.uniform(0.1, 0.5, 3)), random_pose(rng, 6.0), twist))
    may = scene_of([gs.SceneObject(*o, uncertainty=radius) for o in objects]).first_contacts(5.0)
    rows = rows_of(may)
    ahead = np.isin(may.status, (ContactStatus.WILL_TOUCH, ContactStatus.GRAZING))
    hits, finite = int(ahead.sum()), int((ahead & np.isfinite(may.time_upper)).sum())
    assert hits > 25 and finite >= share * hits, (hits, finite)
    for _ in range(8):
        shifted = []
        for name, box, pose, twist in objects:
            push = rng.normal(size=3)
            push *= radius / np.linalg.norm(push)
            shifted.append(gs.SceneObject(name, box, pose + [*push, 0, 0, 0, 0], twist))
        moved = scene_of(shifted).first_contacts(5.0)
        there = rows_of(moved)
        for pair, k in there.items():
            row = rows[pair]
            assert may.time_lower[row] <= moved.time_upper[k] and moved.time_lower[k] <= may.time_upper[row], pair
            tried += may.time_upper[row] < INF
        for pair, row in rows.items():
            assert pair in there or may.time_upper[row] == INF, pair
    assert tried > 100


def test_turning_objects_as_the_queries_see_them():
    """The scene adds placing and choosing, no geometry: all pairs of boxes and hulls that fly about."""
    rng = np.random.default_rng(17)
    objects = []
    for k in range(30):
        shape = gs.Box(rng.uniform(0.1, 0.6, 3)) if k % 2 else gs.Convex(rng.normal(size=(7, 3)) * 0.4)
        objects.append(
            gs.SceneObject(f"o{k:02d}", shape, random_pose(rng, 1.8), (*rng.normal(size=3) * 0.5, *rng.normal(size=3)))
        )
    scene = scene_of(objects)
    answer = scene.first_contacts(2.0)
    found, world = rows_of(answer), scene.world
    assert len(found) > 20 and (answer.status == ContactStatus.WILL_TOUCH).sum() > 10
    for i in range(30):
        for j in range(i + 1, 30):
            rows = np.array([i, j])
            sides = []
            for row in rows:
                shape, pose = objects[row].shape, world.poses[row]
                if isinstance(shape, gs.Box):
                    sides.append(
                        gs.Boxes(pose[None, :3], world.rotations[row][None].swapaxes(1, 2), [shape.half_extents])
                    )
                else:
                    turn, (x, y, z) = world.rotations[row], shape.vertices.T
                    placed = np.column_stack([t[0] * x + t[1] * y + t[2] * z for t in turn]) + pose[:3]
                    sides.append(gs.Polytopes.from_list([placed]))
            linear, angular = world.twists[rows, :3], world.twists[rows, 3:]
            single = gs.first_contact(
                *sides, *linear, angular_velocity_a=angular[0], angular_velocity_b=angular[1],
                center_a=world.poses[i, :3], center_b=world.poses[j, :3], t_max=2.0,
            )  # fmt: skip
            k = found.get((objects[i].id, objects[j].id))
            if k is None:
                assert single.status == gs.NEVER
            else:
                assert (answer.status[k], answer.time[k]) == (single.status[0], single.time[0])
                assert answer.time_upper[k] == single.time_upper[0]


def moving_solids(n, seed, span=3.0):
    rng = np.random.default_rng(seed)

    def shape(k):
        return (
            gs.Box(rng.uniform(0.1, 0.8, 3)) if k % 2 else gs.Convex(rng.normal(size=(int(rng.integers(1, 12)), 3)) / 3)
        )

    return [
        gs.SceneObject(f"{k:03}", shape(k), random_pose(rng, span), (*rng.uniform(-1.0, 1.0, 3), 0.0, 0.0, 0.0))
        for k in range(n)
    ]


def placed_solid(item):
    pose = np.asarray(item.pose)
    turn = gs._validate.rotation_matrices(pose[None, 3:])[0]
    if isinstance(item.shape, gs.Box):
        return gs.Boxes([pose[:3]], [turn.T], [item.shape.half_extents])
    return gs.Polytopes.from_list([item.shape.vertices @ turn.T + pose[:3]])


@pytest.mark.parametrize("horizon", [2.0, INF])
def test_first_contacts_of_solids_are_those_of_every_pair_asked_by_itself(horizon):
    objects = moving_solids(56, 5)
    answer = scene_of(objects).first_contacts(horizon)
    found = rows_of(answer)
    reached = set()
    for a, b in itertools.combinations(objects, 2):
        velocities = (np.array(item.twist[:3]) for item in (a, b))
        one = gs.first_contact(placed_solid(a), placed_solid(b), *velocities, t_max=horizon)
        if one.status[0] == gs.NEVER:
            assert (a.id, b.id) not in found
            continue
        k = found[a.id, b.id]
        reached.add((a.shape.kind, b.shape.kind, int(one.status[0])))
        assert answer.status[k] == one.status[0]
        assert answer.time[k] == pytest.approx(one.time[0], abs=1e-9)
        assert answer.time_lower[k] <= answer.time[k] <= answer.time_upper[k] <= answer.time_lower[k] + 1e-9
        assert answer.last_time[k] == pytest.approx(one.last_time[0], rel=1e-9, abs=1e-9)
        np.testing.assert_allclose(answer.normal[k], one.normal[0], atol=1e-9)
        points = answer.points[answer.point_offsets[k] : answer.point_offsets[k + 1]]
        assert len(points) == len(one.points) > 0
        np.testing.assert_allclose(points, one.points, atol=1e-9)
    assert len(answer) == len(found) and answer.unsupported == []
    assert len(reached) == 8, "boxes and hulls, either first, touching later or overlapping now"


def test_prisms_meet_when_their_bases_do():
    """What a polygon is told about its motion holds for the solid on it, with and without uncertainty."""
    rng = np.random.default_rng(3)
    vague = dict(uncertainty=0.01, velocity_uncertainty=0.02)
    for options in ({}, vague):
        for _ in range(20):
            half, place = rng.uniform(0.2, 1.0, (2, 2)), rng.uniform(-1.0, 1.0, 2) + (3.0, 0.0)
            twist = (1.0, *rng.uniform(-0.2, 0.2, 1), 0.0, 0.0, 0.0, 0.0)
            corners = [np.array([(-x, -y), (x, -y), (x, y), (-x, y)]) for x, y in half]
            prisms = [np.array([(*p, z) for p in ring for z in (-1.0, 1.0)]) for ring in corners]
            families = {
                "polygon": [gs.Polygon(ring) for ring in corners],
                "box": [gs.Box((x, y, 1.0)) for x, y in half],
                "hull": [gs.Convex(prism) for prism in prisms],
            }
            answers = {
                name: scene_of(
                    [gs.SceneObject("a", a, IDENTITY, twist, **options), gs.SceneObject("b", b, at(*place, 0.0))]
                ).first_contacts(6.0)
                for name, (a, b) in families.items()
            }
            flat = answers.pop("polygon")
            for solid in answers.values():
                assert solid.status.tolist() == flat.status.tolist()
                for name in ("time", "time_lower", "time_upper", "last_time"):
                    found, expected = getattr(solid, name), getattr(flat, name)
                    # How near a corner passes is followed step by step.
                    np.testing.assert_allclose(found, expected, rtol=1e-3 if options else 1e-9, err_msg=name)
                assert (solid.time_lower <= flat.time + 1e-12).all() and (solid.time_upper >= flat.time - 1e-12).all()


def test_balls_that_roll():
    push = (1.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    ball = gs.Sphere(1.0)
    objects = [
        gs.SceneObject("a0", ball, at(0.0, 0.0, 0.0), push),
        gs.SceneObject("a1", ball, at(2.0, 0.0, 0.0), push),  # touches a0, moves along with it
        gs.SceneObject("a2", ball, at(4.5, 0.0, 0.0), push),  # apart from a1, moves along
        gs.SceneObject("b", ball, at(7.0, 0.0, 0.0)),  # will be hit
        gs.SceneObject("c", ball, at(7.25, 0.0, 0.0)),  # overlaps b
        gs.SceneObject("d", ball, at(0.0, 50.0, 0.0), push),  # alone
    ]
    answer = scene_of(objects).first_contacts(1.0)
    found = rows_of(answer)
    assert set(found) == {("a0", "a1"), ("a2", "b"), ("b", "c"), ("a2", "c")}
    k = found["a0", "a1"]
    assert answer.status[k] == ContactStatus.TOUCHING
    assert (answer.time[k], answer.time_lower[k], answer.last_time[k]) == (0.0, 0.0, 1.0)
    np.testing.assert_allclose(answer.points[answer.point_offsets[k]], [1.0, 0.0, 0.0], atol=1e-12)
    k = found["b", "c"]
    assert answer.status[k] == ContactStatus.OVERLAPPING and answer.time_upper[k] == 0.0
    for pair, touch in ((("a2", "b"), 0.5), (("a2", "c"), 0.75)):
        k = found[pair]
        assert answer.status[k] == ContactStatus.WILL_TOUCH
        assert answer.time_lower[k] <= touch <= answer.time_upper[k] <= answer.time_lower[k] + 1e-6
        np.testing.assert_allclose(answer.normal[k], [1.0, 0.0, 0.0], atol=1e-6)
    close = [gs.SceneObject("a", ball, IDENTITY, push), gs.SceneObject("b", ball, at(1.9, 1.9, 1.0))]
    assert len(scene_of(close).first_contacts(1.0)) == 0  # the boxes meet, the balls do not
    assert len(scene_of(close).first_contacts(0.0)) == 0
    answer = scene_of(objects).first_contacts(1.0, accuracy="exact")
    assert answer.status[rows_of(answer)["a2", "b"]] == ContactStatus.UNSUPPORTED
    assert ("a2", "b", "first contact of moving solids (sphere-sphere) is unsupported") in answer.unsupported
    # Half spaces go on for ever, and so does this horizon.
    floor = gs.SceneObject("floor", gs.HalfSpace((0.0, 0.0, 1.0), -5.0), IDENTITY, (0.0, 0.0, 1.0, 0.0, 0.0, 0.0))
    assert len(scene_of([objects[3], floor]).first_contacts(1.0)) == 0
    assert len(scene_of([objects[3], floor]).first_contacts(INF)) == 1


def test_balls_meet_when_the_quadratic_says(rng):
    """|p + v t| = r_a + r_b, solved in fractions as far as the root."""
    hits = 0
    for _ in range(600):
        p, v, (ra, rb) = rng.uniform(-3.0, 3.0, 3), rng.normal(size=3), rng.uniform(0.1, 1.0, 2)
        still = gs.SceneObject("b", gs.Sphere(rb))
        answer = scene_of([gs.SceneObject("a", gs.Sphere(ra), at(*p), (*v, 0.0, 0.0, 0.0)), still]).first_contacts(9.0)
        (x, y, z), (a, b, c) = ([Fraction(number) for number in vector.tolist()] for vector in (p, v))
        square, half = a * a + b * b + c * c, x * a + y * b + z * c
        rest = x * x + y * y + z * z - (Fraction(ra) + Fraction(rb)) ** 2
        if rest <= 0:
            assert answer.status.tolist() == [ContactStatus.OVERLAPPING if rest else ContactStatus.TOUCHING]
            continue
        radicand = half * half - square * rest
        time = (-float(half) - math.sqrt(radicand)) / float(square) if radicand >= 0 and half < 0 else INF
        if time > 9.0:
            assert len(answer) == 0
        else:
            hits += 1
            assert answer.status.tolist() == [ContactStatus.WILL_TOUCH]
            rounding = 1e-14 * (1.0 + time)  # of the root and the quotient above
            assert answer.time_lower[0] - rounding <= time <= answer.time_upper[0] + rounding
            assert answer.time_upper[0] - answer.time_lower[0] <= 1e-6
    assert hits >= 20


# -------------------------------------------------------------------------------------------------------- uncertainty


def test_uncertainty_widens_every_interval():
    square = gs.Polygon([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)])
    push = (2.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    plain = scene_of([gs.SceneObject("a", square, IDENTITY, push), gs.SceneObject("b", square, at(3.0, 0.5, 0.0))])
    vague = scene_of(
        [
            gs.SceneObject("a", square, IDENTITY, push, uncertainty=0.01),
            gs.SceneObject("b", square, at(3.0, 0.5, 0.0), uncertainty=0.02),
        ]
    )
    one, other = plain.distances(3.0), vague.distances(3.0)
    assert other.distance[0] == one.distance[0] == 2.0
    assert one.upper[0] - one.lower[0] < 1e-12
    assert 1.97 >= other.lower[0] >= 1.9699 and 2.03 <= other.upper[0] <= 2.0301
    one, other = plain.first_contacts(2.0), vague.first_contacts(2.0)
    assert other.time[0] == one.time[0] == 1.0
    # 0.03 m at 2 m/s.
    assert 0.985 >= other.time_lower[0] >= 0.9849 and 1.015 <= other.time_upper[0] <= 1.05
    # A pair just out of reach may be within it, and a pair that just misses may touch.
    assert len(plain.distances(1.98)) == 0 and len(vague.distances(1.98)) == 1 and len(vague.distances(1.96)) == 0
    for offset, status in ((1.02, ContactStatus.NEVER), (1.04, None), (0.98, ContactStatus.WILL_TOUCH)):
        vague.apply(gs.SceneUpdate(add=[gs.SceneObject("b", square, at(3.0, offset, 0.0), uncertainty=0.02)]))
        answer = vague.first_contacts(2.0)
        assert answer.status.tolist() == ([] if status is None else [status])
        if status is not None:
            assert answer.time_lower[0] <= 0.99 and answer.time_upper[0] == INF, "they may pass each other"
        assert len(vague.distances(0.0)) == 0
    with pytest.raises(gs.SceneError, match="uncertainty"):
        vague.apply(gs.SceneUpdate(add=[gs.SceneObject("c", square, uncertainty=-1.0)]))


def test_uncertain_and_unknown_motion():
    square = gs.Polygon([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)])
    push = (1.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    rest = gs.SceneObject("b", square, at(2.0, 0.0, 0.0))

    def of(**options):
        return scene_of([gs.SceneObject("a", square, IDENTITY, push, **options), rest]).first_contacts(2.0)

    sure, drifting, lost = of(), of(velocity_uncertainty=0.1), of(motion_fault="nobody knows")
    assert sure.time[0] == drifting.time[0] == 1.0
    # Within 2 s the drift adds up to 0.2 m; an honest bound for any velocity from 0.9 to 1.1 m/s.
    assert drifting.time_lower[0] <= 1.0 / 1.1 and drifting.time_upper[0] >= 1.0 / 0.9
    assert drifting.time_lower[0] >= 0.79 and drifting.time_upper[0] <= 1.5
    assert lost.status.tolist() == [ContactStatus.UNSUPPORTED]
    assert lost.unsupported == [("a", "b", "first contact is unsupported: nobody knows")]
    # It may go anywhere, so nothing is out of reach; but what it touches now, it touches.
    far = gs.SceneObject("c", square, at(1e6, 0.0, 0.0))
    touched = gs.SceneObject("d", square, at(0.5, 0.5, 0.0))
    for shape in (square, gs.Box((1.0, 1.0, 1.0))):
        shapes = [gs.SceneObject(o.id, shape, o.pose) for o in (far, touched)]
        scene = scene_of([gs.SceneObject("a", shape, IDENTITY, motion_fault="nobody knows"), *shapes])
        answer = scene.first_contacts(1.0)
        assert dict(zip(answer.ids_b, answer.status.tolist(), strict=True)) == {
            "c": ContactStatus.UNSUPPORTED,
            "d": ContactStatus.OVERLAPPING,
        }
        assert answer.unsupported == [("a", "c", "first contact is unsupported: nobody knows")]
        assert rows_of(scene.first_contacts(0.0)) == {("a", "d"): 0}
        # A twist that comes later tells how it moves, also after the scene has changed.
        scene.set_states(["a"], [IDENTITY])
        assert scene["a"].motion_fault == "nobody knows"
        scene.set_states(["a"], [IDENTITY], [REST])
        scene.apply(gs.SceneUpdate(add=[gs.SceneObject("e", shape, at(0.0, 1e3, 0.0))]))
        assert scene["a"].motion_fault == "" and len(scene.first_contacts(1.0)) == 1
    with pytest.raises(gs.SceneError, match="velocity_uncertainty"):
        of(velocity_uncertainty=-0.1)


@pytest.mark.parametrize("seed", range(6))
def test_answers_of_shifted_polygons_lie_within_the_uncertainty(seed):
    rng = np.random.default_rng(seed)
    radius, horizon = 0.05, 3.0
    objects = moving_polygons(24, seed + 100, 3.0)
    vague = scene_of([gs.SceneObject(o.id, o.shape, o.pose, o.twist, uncertainty=radius) for o in objects])
    answer, near = vague.first_contacts(horizon), vague.distances(2.0, want=("penetration",))
    may, apart = rows_of(answer), rows_of(near)
    assert len(may) > 20 and (answer.status == ContactStatus.NEVER).any()
    surprises = 0
    for _ in range(20):
        # Each polygon is shifted as a whole by no more than its vertices may be off.
        shifted = []
        for o in objects:
            angle = rng.uniform(0.0, 2.0 * np.pi)
            shift = radius * np.array([np.cos(angle), np.sin(angle), 0.0, 0.0, 0.0, 0.0, 0.0])
            shifted.append(gs.SceneObject(o.id, o.shape, np.asarray(o.pose) + shift, o.twist))
        scene = scene_of(shifted)
        moved = scene.first_contacts(horizon)
        there = rows_of(moved)
        for pair, k in there.items():
            assert pair in may, pair
            row = may[pair]
            surprises += answer.status[row] == ContactStatus.NEVER
            assert answer.time_lower[row] <= moved.time[k] <= answer.time_upper[row], pair
        for pair, row in may.items():
            assert pair in there or answer.time_upper[row] == INF, pair
        moved = scene.distances(1.0, want=("penetration",))
        for pair, k in rows_of(moved).items():
            assert near.lower[apart[pair]] <= moved.distance[k] <= near.upper[apart[pair]], pair
    assert surprises > 0, "some contact must exist only within the uncertainty"


# ------------------------------------------------------------------------------------------- boxes and rounding bounds


def exact_rotation(world, k):
    return [[Fraction(float(x)) for x in row] for row in world.rotations[k]]


@pytest.mark.parametrize("scale", [1e-320, 1e-3, 1.0, 1e6])
def test_boxes_hold_their_objects_exactly(scale):
    rng = np.random.default_rng(9)
    objects = [
        gs.SceneObject(f"{k:02}", gs.Convex(min(scale, 1.0) * rng.normal(size=(5, 3))), random_pose(rng, scale))
        for k in range(40)
    ]
    world = scene_of(objects).world
    boxes = boxes_now(world)
    for k in range(len(world)):
        turn, place = exact_rotation(world, k), [Fraction(float(x)) for x in world.poses[k, :3]]
        for vertex in world.table.shapes[world.shape[k]].vertices:
            exact = [Fraction(float(x)) for x in vertex]
            for axis in range(3):
                x = sum(t * v for t, v in zip(turn[axis], exact, strict=True)) + place[axis]
                assert Fraction(float(boxes.lower[k, axis])) <= x <= Fraction(float(boxes.upper[k, axis]))
        # Tight: no wider than the shape by more than rounding, for a box around the vertices in the body's frame.
        shape = world.shape[k]
        widest = 2.0 * np.abs(world.rotations[k]) @ world.table.half[shape]
        np.testing.assert_allclose(boxes.upper[k] - boxes.lower[k], widest, rtol=1e-9, atol=1e-13 * scale + 1e-321)


def test_swept_boxes_hold_everything_passed_through():
    rng = np.random.default_rng(12)
    objects = [
        gs.SceneObject(
            f"{k:02}",
            random_solid(rng) if k % 4 else gs.Convex(rng.normal(size=(4, 3)) + 2.0),
            random_pose(rng),
            np.where(rng.random(6) < 0.5, rng.normal(size=6), 0.0),
        )
        for k in range(60)
    ]
    world = scene_of(objects).world
    horizon = 2.0
    boxes, now = boxes_swept(world, horizon), boxes_now(world)
    assert (boxes.lower <= now.lower + 1e-12).all() or world.turns.any()
    checked = 0
    for k, item in enumerate(objects):
        points = getattr(item.shape, "vertices", None)
        if points is None:
            continue
        for t in np.linspace(0.0, horizon, 9):
            axis = np.asarray(item.twist[3:])
            angle = np.linalg.norm(axis) * t
            q = np.array([0.0, 0.0, 0.0, 1.0])
            if angle > 0.0:
                q = np.concatenate([np.sin(angle / 2.0) * axis / np.linalg.norm(axis), [np.cos(angle / 2.0)]])
            turn = gs._validate.rotation_matrices(q[None])[0] @ world.rotations[k]
            there = points @ turn.T + item.pose[:3] + t * np.asarray(item.twist[:3])
            assert (there >= boxes.lower[k] - 1e-12).all() and (there <= boxes.upper[k] + 1e-12).all()
            checked += 1
    assert checked > 100
    assert np.isfinite(boxes_swept(world, horizon).lower).all()
    # For ever: infinite along the ways that are taken, and only there.
    forever = boxes_swept(world, INF)
    speed = world.twists[:, :3]
    np.testing.assert_array_equal(np.isinf(forever.upper), speed > 0.0)
    np.testing.assert_array_equal(np.isinf(forever.lower), speed < 0.0)


@pytest.mark.parametrize("near", [False, True])
@pytest.mark.parametrize("scale", [1e-320, 1e-160, 1.0, 1e4])
def test_intervals_cover_the_rounding_of_poses(scale, near):
    """Points on long arms: their distance is known exactly from the two rotation matrices, taken literally."""
    rng = np.random.default_rng(21)
    widths = []
    for _ in range(60):
        a, b = rng.normal(size=(2, 3)) * (scale if near else min(scale, 1.0))
        poses = random_pose(rng, scale), random_pose(rng, scale)
        if near:
            # So placed that the points all but meet: all there is of their distance is rounding.
            turns = [gs._validate.rotation_matrices(pose[None, 3:])[0] for pose in poses]
            poses[1][:3] = poses[0][:3] + turns[0] @ a - turns[1] @ b
        objects = [gs.SceneObject(n, gs.Point(p), q) for n, p, q in zip("ab", (a, b), poses, strict=True)]
        scene = scene_of(objects)
        world, answer = scene.world, scene.distances(INF)
        places = []
        for k, point in enumerate((a, b)):
            turn = exact_rotation(world, k)
            places.append(
                [
                    sum(t * Fraction(float(v)) for t, v in zip(turn[axis], point, strict=True))
                    + Fraction(float(world.poses[k, axis]))
                    for axis in range(3)
                ]
            )
        squared = sum((x - y) ** 2 for x, y in zip(*places, strict=True))
        assert Fraction(float(answer.lower[0])) ** 2 <= squared <= Fraction(float(answer.upper[0])) ** 2
        widths.append((answer.upper[0] - answer.lower[0]) / scale)
    assert max(widths) < (1e-12 if scale > 1e-300 else 1e-1), "a subnormal has few bits"


def test_round_numbers_lose_nothing():
    """Unrotated objects at exact distances: the scene adds nothing to the interval of the query."""
    a, b = gs.Sphere(0.5), gs.Sphere(0.25)
    for x in (0.75, 1.0, 0.5):
        alone = gs.distance(a, b, at(x, 0.0, 0.0), want=("penetration",))
        objects = [gs.SceneObject("a", a, at(1e6, 0.0, 0.0)), gs.SceneObject("b", b, at(1e6 + x, 0.0, 0.0))]
        answer = scene_of(objects).distances(1.0, want=("penetration",))
        for name in ("lower", "distance", "upper"):
            assert getattr(answer, name)[0] == getattr(alone, name)[0]


# ------------------------------------------------------------------------------------------------------------- updates


def test_apply_is_all_or_nothing():
    scene = scene_of(solid_scene(10, 1), allowed_pairs=[("x", "y")])
    version, ids, allowed = scene.version, scene.ids, scene.allowed_pairs
    before = scene.distances(3.0)
    good = gs.SceneObject("new", gs.Sphere(1.0))
    with pytest.raises(gs.SceneError) as caught:
        scene.apply(
            gs.SceneUpdate(
                clear=True,
                add=[
                    good,
                    gs.SceneObject("long quaternion", gs.Sphere(1.0), (0, 0, 0, 0, 0, 0, 2)),
                    gs.SceneObject("nan", gs.Sphere(1.0), (0, np.nan, 0, 0, 0, 0, 1)),
                    gs.SceneObject("short", gs.Sphere(1.0), (0, 0, 0)),
                    gs.SceneObject("text", gs.Sphere(1.0), IDENTITY, "fast"),
                    gs.SceneObject("inf", gs.Sphere(1.0), IDENTITY, (np.inf, 0, 0, 0, 0, 0)),
                    gs.SceneObject("no shape", None),
                    gs.SceneObject("a batch", gs.Boxes.from_poses([IDENTITY], (1, 1, 1))),
                    gs.SceneObject("elsewhere", gs.Sphere(1.0), frame="camera"),
                    gs.SceneObject("vague", gs.Sphere(1.0), uncertainty=np.inf),
                    gs.SceneObject("twice", gs.Sphere(1.0)),
                    gs.SceneObject("twice", gs.Sphere(1.0)),
                    gs.SceneObject("", gs.Sphere(1.0)),
                    "not an object",
                ],
                remove=["solid 0001"],
                allow=[("self", "self"), ("only one",)],
                disallow=[("p", "q")],
            )
        )
    errors = caught.value.errors
    assert set(errors) == {
        "long quaternion", "nan", "short", "text", "inf", "no shape", "a batch", "elsewhere", "vague", "twice",
        "add[12]", "add[13]", "solid 0001", "self", "allow[1]", "p",
    }  # fmt: skip
    assert "norm 1, got 2" in errors["long quaternion"] and "pose[1] is nan" in errors["nan"]
    assert "(7,)" in errors["short"] and "twist" in errors["text"] and "twist[0] is inf" in errors["inf"]
    assert "'camera'" in errors["elsewhere"] and "'world'" in errors["elsewhere"]
    assert "no such object" in errors["solid 0001"], "cleared before"
    assert (scene.version, scene.ids, scene.allowed_pairs) == (version, ids, allowed)
    same_answers(scene.distances(3.0), before)
    assert scene.apply(gs.SceneUpdate(add=[good])) == version + 1 and "new" in scene


def test_updates_are_applied_in_order_and_counted_when_they_change_something():
    ball, box = gs.Sphere(1.0), gs.Box((1.0, 1.0, 1.0))
    scene = gs.Scene()
    assert (scene.version, scene.ids, len(scene)) == (0, (), 0)
    assert scene.apply(gs.SceneUpdate()) == 0
    assert scene.apply(gs.SceneUpdate(clear=True)) == 0
    assert scene.apply(gs.SceneUpdate(add=[gs.SceneObject("b", ball), gs.SceneObject("a", ball)])) == 1
    assert scene.ids == ("a", "b") and list(scene) == ["a", "b"] and "a" in scene and "c" not in scene
    assert scene.apply(gs.SceneUpdate(remove=["a"], add=[gs.SceneObject("a", box, at(1.0, 2.0, 3.0))])) == 2
    assert scene["a"].shape is box and scene["a"].pose.tolist() == list(at(1.0, 2.0, 3.0))
    assert scene.apply(gs.SceneUpdate(add=[gs.SceneObject("b", box)])) == 3 and scene["b"].shape is box
    with pytest.raises(gs.SceneError) as caught:
        scene.apply(gs.SceneUpdate(remove=["a", "ghost"]))
    assert set(caught.value.errors) == {"ghost"} and "a" in scene
    assert scene.apply(gs.SceneUpdate(clear=True, add=[gs.SceneObject("c", ball)])) == 4
    assert scene.ids == ("c",)
    with pytest.raises(KeyError):
        scene["a"]
    scene["c"].pose[0] = 5.0
    assert scene["c"].pose[0] == 0.0, "what the scene gives is a copy"


def test_states_by_the_fast_path_equal_those_applied():
    objects = solid_scene(50, 4)
    rng = np.random.default_rng(8)
    fast, slow = scene_of(objects), scene_of(objects)
    chosen = [objects[k] for k in rng.permutation(50)[:20]]
    ids = [o.id for o in chosen]
    poses = np.array([random_pose(rng) for _ in chosen])
    poses[:, 3:] *= 1.0 + 1e-4 * rng.uniform(-1.0, 1.0, (20, 1))
    twists = rng.normal(size=(20, 6))
    fast.set_states(ids, poses, twists, stamp="now")
    slow.apply(
        gs.SceneUpdate(add=[gs.SceneObject(o.id, o.shape, p, t) for o, p, t in zip(chosen, poses, twists, strict=True)])
    )
    assert fast.version == slow.version == 2
    for name in fast.ids:
        np.testing.assert_array_equal(fast[name].pose, slow[name].pose)
        np.testing.assert_array_equal(fast[name].twist, slow[name].twist)
    same_answers(fast.distances(2.0), slow.distances(2.0))
    assert (fast.stamp, fast.distances(2.0).stamp, slow.stamp) == ("now", "now", None)
    # Without twists they stay; a structural change keeps the states that came by the fast path.
    fast.set_states(tuple(ids), poses + [1, 0, 0, 0, 0, 0, 0])
    fast.apply(gs.SceneUpdate(add=[gs.SceneObject("more", gs.Sphere(0.1))]))
    np.testing.assert_array_equal(fast[ids[0]].twist, twists[0])
    assert fast[ids[0]].pose[0] == poses[0, 0] + 1.0
    # An object that was removed comes back as it is added, not as it was.
    fast.apply(gs.SceneUpdate(remove=[ids[0]]))
    fast.apply(gs.SceneUpdate(add=[chosen[0]]))
    np.testing.assert_allclose(fast[ids[0]].pose, chosen[0].pose, atol=1e-15)


def test_a_stream_of_states_resolves_ids_once():
    scene = scene_of([gs.SceneObject(name, gs.Sphere(1.0)) for name in "abc"])
    pose = np.tile(IDENTITY, (2, 1))
    for ids in (["a", "c"], ("c", "a")):
        for k in range(3):
            pose[:, 0] = [k, -k]
            assert scene.set_states(ids, pose) == scene.version
            assert scene[ids[0]].pose[0] == k and scene[ids[1]].pose[0] == -k
    # The same list with other ids in it is another list.
    ids = ["a", "b"]
    scene.set_states(ids, pose)
    ids[1] = "c"
    pose[:, 0] = [7.0, 8.0]
    scene.set_states(ids, pose)
    assert [scene[name].pose[0] for name in "abc"] == [7.0, -2.0, 8.0]
    # And after a change of the scene, another row.
    scene.apply(gs.SceneUpdate(remove=["a"], add=[gs.SceneObject("aa", gs.Sphere(1.0))]))
    with pytest.raises(gs.SceneError, match="'a'"):
        scene.set_states(ids, pose)


def test_bad_states_change_nothing():
    square = gs.Polygon([(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)])
    scene = scene_of([gs.SceneObject(name, gs.Sphere(1.0)) for name in "abc"] + [gs.SceneObject("p", square)])
    good = np.tile(IDENTITY, (4, 1))
    version = scene.version

    def refused(ids, poses, twists=None):
        with pytest.raises(gs.SceneError) as caught:
            scene.set_states(ids, poses, twists)
        assert scene.version == version and all((scene[name].pose == IDENTITY).all() for name in scene.ids)
        return caught.value.errors

    assert set(refused(["a", "x", "y"], good[:3])) == {"x", "y"}
    assert set(refused(["a", "b", "a"], good[:3])) == {"a"}
    bad = good.copy()
    bad[1, 0], bad[2, 6], bad[3, 2] = np.inf, 0.5, 0.1
    assert set(refused(list("abcp"), bad)) == {"b", "c", "p"}
    twists = np.zeros((4, 6))
    twists[0, 3], twists[3, 3] = np.nan, 1.0
    assert set(refused(list("abcp"), good, twists)) == {"a", "p"}
    for poses in (good[:3], good[:, :6], "poses", good.astype(str)):
        with pytest.raises(gs.GeometryError):
            scene.set_states(list("abcp"), poses)
    assert scene.set_states([], np.zeros((0, 7))) == version


def test_polygons_stay_in_the_plane():
    ring = gs.Polygon([(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)])
    half = np.sqrt(0.5)
    bad = {
        "lifted": gs.SceneObject("lifted", ring, at(0.0, 0.0, 1e-9)),
        "tilted": gs.SceneObject("tilted", ring, (0.0, 0.0, 0.0, half, 0.0, 0.0, half)),
        "rising": gs.SceneObject("rising", ring, IDENTITY, (0.0, 0.0, 1.0, 0.0, 0.0, 0.0)),
        "rolling": gs.SceneObject("rolling", ring, IDENTITY, (0.0, 0.0, 0.0, 1.0, 0.0, 0.0)),
    }
    scene = gs.Scene()
    with pytest.raises(gs.SceneError) as caught:
        scene.apply(gs.SceneUpdate(add=list(bad.values())))
    assert set(caught.value.errors) == set(bad) and all("plane" in text for text in caught.value.errors.values())
    # A rotation composed from several is off the plane by rounding, and is laid flat.
    scene.apply(gs.SceneUpdate(add=[gs.SceneObject("p", ring, (1.0, 2.0, 1e-17, 1e-17, -1e-17, half, half))]))
    assert scene["p"].pose[2:5].tolist() == [0.0, 0.0, 0.0]
    np.testing.assert_allclose(scene["p"].pose, at(1.0, 2.0, 0.0, yaw=np.pi / 2.0), atol=1e-15)


def test_other_frames_are_transformed_or_refused_by_name():
    known = {"mast": at(1.0, 2.0, 3.0, yaw=np.pi / 2.0)}
    asked = []

    def transforms(frame):
        asked.append(frame)
        return known[frame]

    scene = gs.Scene(fixed_frame="map", transforms=transforms)
    push = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0)
    ball = gs.Sphere(1.0)
    scene.apply(
        gs.SceneUpdate(
            add=[
                gs.SceneObject("a", ball, at(1.0, 0.0, 0.0), push, frame="mast"),
                gs.SceneObject("b", ball, at(0.0, 1.0, 0.0, yaw=0.3), frame="mast"),
                gs.SceneObject("c", ball, at(1.0, 0.0, 0.0), push, frame="map"),
                gs.SceneObject("d", ball, at(1.0, 0.0, 0.0), push),
            ]
        )
    )
    assert asked == ["mast"]
    np.testing.assert_allclose(scene["a"].pose, at(1.0, 3.0, 3.0, yaw=np.pi / 2.0), atol=1e-15)
    np.testing.assert_allclose(scene["a"].twist, (0.0, 1.0, 0.0, -1.0, 0.0, 0.0), atol=1e-15)
    np.testing.assert_allclose(scene["b"].pose, at(0.0, 2.0, 3.0, yaw=np.pi / 2.0 + 0.3), atol=1e-15)
    for name in "cd":
        np.testing.assert_array_equal(scene[name].pose, at(1.0, 0.0, 0.0))
        np.testing.assert_array_equal(scene[name].twist, push)
    # Any rotation, by matrices.
    rng = np.random.default_rng(4)
    known["arm"], pose, twist = random_pose(rng), random_pose(rng), rng.normal(size=6)
    scene.apply(gs.SceneUpdate(add=[gs.SceneObject("f", ball, pose, twist, frame="arm")]))
    turns = [gs._validate.rotation_matrices(p[None, 3:])[0] for p in (known["arm"], pose, scene["f"].pose)]
    np.testing.assert_allclose(turns[2], turns[0] @ turns[1], atol=1e-14)
    np.testing.assert_allclose(scene["f"].pose[:3], turns[0] @ pose[:3] + known["arm"][:3], atol=1e-14)
    np.testing.assert_allclose(scene["f"].twist[:3], turns[0] @ twist[:3], atol=1e-14)
    np.testing.assert_allclose(scene["f"].twist[3:], turns[0] @ twist[3:], atol=1e-14)
    known["bad"] = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 3.0)
    for frame in ("nowhere", "bad"):
        with pytest.raises(gs.SceneError, match=f"frame '{frame}'"):
            scene.apply(gs.SceneUpdate(add=[gs.SceneObject("e", ball, frame=frame)]))
    with pytest.raises(gs.SceneError, match="no transforms"):
        gs.Scene().apply(gs.SceneUpdate(add=[gs.SceneObject("e", ball, frame="mast")]))


def test_bad_arguments_are_named():
    scene = scene_of(solid_scene(3, 0))
    for wrong in (-1.0, np.nan, "far", [1.0]):
        with pytest.raises(gs.GeometryError, match="max_distance"):
            scene.distances(wrong)
        with pytest.raises(gs.GeometryError, match="horizon"):
            scene.first_contacts(wrong)
    with pytest.raises(gs.GeometryError, match="want"):
        scene.distances(1.0, want=("depth",))
    with pytest.raises(gs.GeometryError, match="frustum"):
        scene.cull("camera")
    with pytest.raises(gs.SceneError, match="itself"):
        gs.Scene(allowed_pairs=[("a", "a")])
    with pytest.raises(gs.GeometryError, match="update must be SceneUpdate, got list"):
        scene.apply([gs.SceneObject("a", gs.Sphere(1.0))])
    for wrong, text in (("solid 0000", "got the string"), ([["solid 0000"]], r"\[0\] must be an id")):
        with pytest.raises(gs.GeometryError, match=f"ids.*{text}"):
            scene.set_states(wrong, [IDENTITY])
        with pytest.raises(gs.GeometryError, match=f"ids.*{text}"):
            scene.cull(CAMERA, ids=wrong)
        with pytest.raises(gs.GeometryError, match=f"remove.*{text}"):
            scene.apply(gs.SceneUpdate(remove=wrong))


def test_answers_are_about_one_version_while_states_change():
    """A writer moves both balls by the same step: whoever reads between the two would see another distance."""
    scene = scene_of([gs.SceneObject("a", gs.Sphere(1.0)), gs.SceneObject("b", gs.Sphere(1.0), at(3.0, 0.0, 0.0))])
    poses = np.array([at(0.0, 0.0, 0.0), at(3.0, 0.0, 0.0)])
    stop = threading.Event()

    def write():
        for step in itertools.count(1):
            if stop.is_set():
                return
            scene.set_states(("a", "b"), poses + [float(step % 1000), 0.0, 0.0, 0.0, 0.0, 0.0, 0.0])
            if step % 7 == 0:
                scene.apply(gs.SceneUpdate(add=[gs.SceneObject("c", gs.Sphere(0.1), at(0.0, 1e6, 0.0))]))

    thread = threading.Thread(target=write)
    thread.start()
    try:
        versions = set()
        for number in range(100_000):
            answer = scene.distances(5.0)
            assert answer.ids_a == ["a"] and answer.ids_b == ["b"] and answer.distance[0] == 1.0
            versions.add(answer.version)
            if number > 200 and len(versions) > 5:
                break
    finally:
        stop.set()
        thread.join()
    assert len(versions) > 5


# ------------------------------------------------------------------------------------------------------------- culling

CAMERA = gs.Frustum((0.0, 0.0, 0.0), np.eye(3), 1.0, 1.0, 1.0, 10.0)


def test_boxes_are_culled_as_by_the_query():
    rng = np.random.default_rng(6)
    boxes = [gs.SceneObject(f"{k:03}", gs.Box(rng.uniform(0.0, 2.0, 3)), random_pose(rng, 12.0)) for k in range(300)]
    answer = scene_of(boxes).cull(CAMERA)
    poses, half = np.array([o.pose for o in boxes]), np.array([o.shape.half_extents for o in boxes])
    alone = gs.cull(CAMERA, gs.Boxes.from_poses(poses, half))
    np.testing.assert_array_equal(answer.state, alone.state)
    np.testing.assert_array_equal(answer.certain, alone.certain)
    assert answer.ids == [o.id for o in boxes]
    assert (np.bincount(answer.state, minlength=3) > 5).all()
    some = answer.ids[10:20]
    assert scene_of(boxes).cull(CAMERA, ids=some).ids == some
    assert answer.visible == [o.id for o, state in zip(boxes, answer.state, strict=True) if state != gs.OUTSIDE]


@pytest.mark.parametrize("seed", range(5))
def test_hulls_of_box_corners_are_culled_as_boxes(seed):
    """Two ways to the same states: the kernel for boxes, and supports and distance for anything else."""
    rng = np.random.default_rng(seed)
    turn = gs._validate.rotation_matrices(random_pose(rng)[None, 3:])[0]
    low, high = -rng.uniform(0.2, 1.5, 2), rng.uniform(0.2, 1.5, 2)
    bounds = (low[0], high[0], low[1], high[1])
    camera = gs.Frustum(rng.uniform(-9.0, 9.0, 3), turn, near=1.0, far=9.0, bounds=bounds)
    boxes, hulls, balls = [], [], []
    for k in range(200):
        half, pose = rng.uniform(0.0, 1.2, 3), random_pose(rng, 5.0)
        pose[:3] += camera.origin + 4.0 * turn[2]
        boxes.append(gs.SceneObject(f"{k:03}", gs.Box(half), pose))
        hulls.append(gs.SceneObject(f"{k:03}", gs.Convex(gs.shapes.CORNER_SIGNS * half), pose))
        balls += [gs.SceneObject(f"{k:03} s", gs.Sphere(half[0]), pose)]
        balls += [gs.SceneObject(f"{k:03} z", gs.Capsule(half[0], 0.0), pose)]
    wanted, got = scene_of(boxes).cull(camera), scene_of(hulls).cull(camera)
    assert wanted.certain.all() and got.certain.all()
    np.testing.assert_array_equal(got.state, wanted.state)
    assert (np.bincount(got.state, minlength=3) >= [50, 20, 5]).all()
    state = scene_of(balls).cull(camera).state
    np.testing.assert_array_equal(state[::2], state[1::2])
    # A ball is inside if no face is nearer to its centre than its radius; the distance to the faces is another way.
    for item, seen in zip(balls[::2], state[::2].tolist(), strict=True):
        gap = gs.distance_to_frustum(camera, [item.pose[:3]]).distance[0]
        assert (seen == gs.OUTSIDE) == (gap > item.shape.radius)


def test_other_shapes_are_culled_by_what_they_are():
    ring = gs.Polygon([(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)])
    side = np.array([1.0, 0.0, -1.0]) / np.sqrt(2.0)  # outward normal of the plane x = z
    expected = {
        # The corner of a ball's bounding box is in the frustum, the ball is not.
        "ball out": (gs.Sphere(1.0), np.array([5.0, 0.0, 5.0]) + 1.1 * side, gs.OUTSIDE),
        "ball cut": (gs.Sphere(1.0), np.array([5.0, 0.0, 5.0]) + 0.9 * side, gs.INTERSECTS),
        # The corner of its bounding box is outside, the ball is not.
        "ball in": (gs.Sphere(1.0), np.array([5.0, 0.0, 5.0]) - 1.1 * side, gs.INSIDE),
        "capsule in": (gs.Capsule(0.5, 3.0), (0.0, 0.0, 5.0), gs.INSIDE),
        "capsule cut": (gs.Capsule(0.5, 3.0), (0.0, 0.0, 2.5), gs.INTERSECTS),
        "hull out": (gs.Convex([(0.0, 0.0, 0.0), (1.0, 0.0, 0.0)]), (5.5, 0.0, 5.0), gs.OUTSIDE),
        "hull cut": (gs.Convex([(-1.0, 0.0, 0.0), (1.0, 0.0, 0.0)]), (5.5, 0.0, 5.0), gs.INTERSECTS),
        "floor": (gs.HalfSpace((0.0, 1.0, 0.0), -9.0), (0.0, 0.0, 0.0), gs.INTERSECTS),
        "far floor": (gs.HalfSpace((0.0, 1.0, 0.0), -11.0), (0.0, 0.0, 0.0), gs.OUTSIDE),
        "can in": (gs.Cylinder(0.5, 1.0), (0.0, 0.0, 5.0), gs.INSIDE),
        "can out": (gs.Cylinder(0.5, 1.0), (0.0, 20.0, 5.0), gs.OUTSIDE),
        "can cut": (gs.Cylinder(0.5, 1.0), (0.0, 5.0, 5.0), gs.INTERSECTS),
        "cone at the edge": (gs.Cone(0.5, 1.0), (0.0, 0.0, 1.5), gs.INSIDE),
        "ellipsoid cut": (gs.Ellipsoid((1.0, 1.0, 2.0)), (0.0, 0.0, 9.0), gs.INTERSECTS),
        "sheet cut": (SHEET, (0.0, 5.0, 5.0), gs.Visibility.MAY_INTERSECT),
        "footprint": (ring, (0.0, 0.0, 0.0), gs.OUTSIDE),
    }
    scene = scene_of([gs.SceneObject(name, shape, at(*where)) for name, (shape, where, _) in expected.items()])
    answer = scene.cull(CAMERA)
    got = dict(zip(answer.ids, answer.state.tolist(), strict=True))
    assert got == {name: int(state) for name, (_, _, state) in expected.items()}
    certain = dict(zip(answer.ids, answer.certain.tolist(), strict=True))
    assert all(certain[name] for name in expected if name != "sheet cut" and "edge" not in name)
    assert not certain["sheet cut"]
    assert answer.message == "judged by their bounding box: mesh"
    assert "mesh" in scene.plan()
    # A camera that looks along the plane sees polygons.
    flat = gs.Frustum((-5.0, 0.0, 0.5), [[0, 1, 0], [0, 0, 1], [1, 0, 0]], 0.2, 0.2, 1.0, 10.0)
    assert dict(zip(*(lambda a: (a.ids, a.state.tolist()))(scene.cull(flat)), strict=True))["footprint"] == gs.INSIDE
    vague = scene_of([gs.SceneObject("v", gs.Sphere(1.0), at(0.0, 0.0, 5.0), uncertainty=9.0)])
    assert (vague.cull(CAMERA).state[0], vague.cull(CAMERA).certain[0]) == (gs.INSIDE, False)


def test_plan_says_what_is_computed_and_what_is_not():
    assert gs.Scene().plan().splitlines()[1:] == [
        "distances: skipped, there is no pair",
        "first contacts: skipped, there is no pair",
        "cull: skipped, there is no object",
    ]
    scene = scene_of([gs.SceneObject(name, gs.Sphere(1.0)) for name in "ab"])
    assert "nothing moves, nothing is swept" in scene.plan() and "unsupported" not in scene.plan()
    scene.set_states(["a"], [IDENTITY], [(1.0, 0.0, 0.0, 0.0, 0.0, 0.0)])
    assert "boxes swept for 1 moving object" in scene.plan()
    assert "followed step by step, at tier float64: 1 round body, plane or mesh" in scene.plan()
    assert "2 solids (sphere 2)" in scene.plan()
    push = (1.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    boxes = [gs.SceneObject(name, gs.Box((1.0, 1.0, 1.0)), at(5.0 * k, 0.0, 0.0), push) for k, name in enumerate("xyz")]
    scene = scene_of(boxes)
    assert "followed in translation: 3 boxes and hulls" in scene.plan() and "unsupported" not in scene.plan()
    scene.apply(gs.SceneUpdate(add=[gs.SceneObject("floor", gs.HalfSpace((0.0, 0.0, 1.0), -9.0))]))
    assert "unsupported" not in scene.plan()
    scene.apply(gs.SceneUpdate(add=[gs.SceneObject("sheet", SHEET, at(0.0, 0.0, 50.0))]))
    assert "unsupported unless in contact now" not in scene.plan() and "no kernel: box-mesh" in scene.plan()
