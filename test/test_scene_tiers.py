# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""Every question about a scene at every tier: the answer of the query functions for the same literal numbers."""

from __future__ import annotations

import itertools
import math
from functools import partial

import numpy as np
import pytest
from conftest import reproducer
from oracle import frustum_box, polytope
from oracle.vectors import dot, exact, root_double
from scene_answers import rows_of, scene_of

import geomsrv as gs
from geomsrv.answers import ContactStatus, gather
from geomsrv.narrow_phase import relative_poses
from geomsrv.pairwise import distance_of_two, listed_distances, listed_first_contacts
from geomsrv.queries import RUNGS, TIERS

INF = np.inf
REST = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
UPRIGHT = (0.0, 0.0, 0.0, 1.0)


def turned(rng):
    quaternion = rng.normal(size=4)
    return quaternion / np.linalg.norm(quaternion)


def solids(rng, count=18, span=2.0):
    """Objects of every kind with kernels, one without, some upright, some uncertain."""
    lens = gs.Frustum(rng.normal(size=3), np.linalg.qr(rng.normal(size=(3, 3)))[0], 0.3, 0.2, 0.5, 1.5)
    makers = [
        lambda: gs.Sphere(rng.uniform(0.1, 0.6)),
        lambda: gs.Capsule(rng.uniform(0.1, 0.4), rng.uniform(0.0, 1.0)),
        lambda: gs.Box(rng.uniform(0.1, 0.7, 3)),
        lambda: gs.Convex(rng.normal(size=(7, 3)) * 0.5),
        lambda: gs.Triangle(*rng.uniform(-1.0, 1.0, (3, 3))),
        lambda: lens,
        lambda: gs.HalfSpace(rng.normal(size=3), -1.5 * span),
        lambda: gs.Mesh(rng.normal(size=(4, 3)) * 0.5, [(0, 1, 2), (0, 2, 3)]),
    ]
    out = []
    for k in range(count):
        turn = UPRIGHT if k % 5 == 4 else turned(rng)
        pose = (*rng.uniform(-span, span, 3), *turn)
        out.append(gs.SceneObject(f"{k:02}", makers[k % len(makers)](), pose, uncertainty=1e-3 * (k % 7 == 6)))
    return out


def rings(rng, count=14, span=2.5, speed=1.0, uncertainty=0.0):
    """Polygons in the plane, turned and moving."""
    out = []
    for k in range(count):
        angle = np.sort(rng.uniform(0.0, 2.0 * np.pi, rng.integers(3, 9)))
        ring = np.column_stack([np.cos(angle), rng.uniform(0.2, 1.0) * np.sin(angle)]) * 0.6
        yaw = rng.uniform(0.0, 3.0) * (k % 3 > 0)
        pose = (*rng.uniform(-span, span, 2), 0.0, 0.0, 0.0, math.sin(yaw / 2.0), math.cos(yaw / 2.0))
        twist = (*(speed * rng.normal(size=2)), 0.0, 0.0, 0.0, 0.0)
        out.append(gs.SceneObject(f"{k:02}", gs.Polygon(ring), pose, twist, uncertainty=uncertainty))
    return out


def all_pairs(world):
    return np.array(list(itertools.combinations(range(len(world)), 2)))


def ring_of(world, row):
    return gs.Polygons(*gather(*world.rings, np.array([row])))


def asked_alone(world, i, j, pose, **options):
    """What `gs.distance` says of two objects."""
    if world.planar[i]:
        return gs.distance(ring_of(world, i), ring_of(world, j), **options)
    shapes = [world.table.shapes[world.shape[row]] for row in (i, j)]
    return gs.distance(*shapes, pose, **options)


# ---------------------------------------------------------------------------------------------------- distance


@pytest.mark.parametrize("tier", TIERS)
@pytest.mark.parametrize("want", [("distance",), ("penetration",)])
@pytest.mark.parametrize("make", [solids, rings])
def test_distances_are_those_of_the_literal_pose(rng, tier, want, make) -> None:
    objects = make(rng)
    scene = scene_of(objects)
    world, pairs = scene.world, all_pairs(scene.world)
    answer = scene.distances(INF, want=want, accuracy=tier)
    found, supported, wider = rows_of(answer), 0, 0
    for (i, j), pose in zip(pairs.tolist(), relative_poses(world, pairs), strict=True):
        one = asked_alone(world, i, j, pose, want=want, accuracy=tier)
        pair, info = (world.ids[i], world.ids[j]), reproducer(a=world.poses[i], b=world.poses[j])
        if one.message:
            assert pair not in found, info
            continue
        supported += 1
        k, vague = found[pair], float(world.uncertainty[[i, j]].sum())
        low, high = one.lower[0], one.upper[0]
        if tier == "bound" and one.cost.counts.get("filter") is None:
            assert answer.distance[k] == answer.lower[k] <= one.distance[0], info
        else:
            assert answer.distance[k] == one.distance[0], info
        assert answer.status[k] == one.status[0], info
        # A wider interval, by the uncertainty at least, and by nothing where nothing is turned or moved.
        assert answer.lower[k] <= max(low - vague, -INF if "penetration" in want else 0.0), info
        assert answer.upper[k] >= high + vague, info
        wider += answer.upper[k] > high
        assert answer.lower[k] <= answer.distance[k] <= answer.upper[k], info
        if answer.distance[k] != 0.0 and make is solids:
            turn, origin = world.rotations[i], world.poses[i, :3]
            for name in ("point_a", "point_b"):
                want_point = turn @ getattr(one, name)[0] + origin
                np.testing.assert_allclose(getattr(answer, name)[k], want_point, atol=1e-9, err_msg=info)
            np.testing.assert_allclose(answer.normal[k], turn @ one.normal[0], atol=1e-9, err_msg=info)
    assert supported == len(answer) > 80 and (wider > 50 if make is solids else wider == 0)
    assert (answer.distance > 0.0).sum() > 20 and (answer.distance <= 0.0).sum() > 0
    assert answer.cost.accuracy == tier
    rungs = {name: answer.cost.counts[name] for name in RUNGS if name in answer.cost.counts}
    assert sum(rungs.values()) == (0 if tier == "float64" else len(answer))
    assert tier != "bound" or set(rungs) <= {"bound", "filter"}, "half spaces are their own volumes"


def test_nothing_is_added_where_nothing_rounds() -> None:
    boxes = [gs.SceneObject(f"{k}", gs.Box([0.5, 0.25, 1.0]), (2.0 * k, 0.5 * k, 0.0, *UPRIGHT)) for k in range(4)]
    scene = scene_of(boxes)
    for tier in TIERS:
        answer = scene.distances(INF, want=("penetration",), accuracy=tier)
        for pair, k in rows_of(answer).items():
            step = 2.0 * (int(pair[1]) - int(pair[0]))
            one = gs.distance(
                boxes[0].shape,
                boxes[0].shape,
                (step, step / 4.0, 0.0, *UPRIGHT),
                want=("penetration",),
                accuracy=tier,
            )
            got = (answer.distance[k], answer.lower[k], answer.upper[k])
            assert got == (one.distance[0], one.lower[0], one.upper[0]), (tier, pair)
    answer = scene.distances(INF, accuracy="exact")
    assert answer.distance[0] == answer.lower[0] == answer.upper[0] == 1.0


@pytest.mark.parametrize("make", [solids, rings])
def test_tiers_agree_about_the_same_scene(rng, make) -> None:
    """The interval of every tier holds the exact distance; the broad phase looks at the same pairs."""
    scene = scene_of(make(rng, 24))
    limit = 0.5
    exactly = scene.distances(limit, want=("penetration",), accuracy="exact")
    rows = rows_of(exactly)
    assert 5 < len(rows) < len(all_pairs(scene.world)) / 2
    for tier in TIERS:
        answer = scene.distances(limit, want=("penetration",), accuracy=tier)
        for name in ("objects", "pairs", "candidates", "allowed", "unsupported"):
            assert answer.cost.counts[name] == exactly.cost.counts[name], (tier, name)
        assert answer.unsupported == exactly.unsupported and answer.message == exactly.message
        found = rows_of(answer)
        assert found.keys() >= rows.keys() if tier == "bound" else found.keys() == rows.keys()
        for pair, k in rows.items():
            assert answer.lower[found[pair]] <= exactly.distance[k] <= answer.upper[found[pair]], (tier, pair)
        everything = scene.distances(INF, want=("penetration",), accuracy=tier)
        near = everything.lower <= limit
        assert found.keys() <= {pair for pair, k in rows_of(everything).items() if near[k]}
        touching = scene.contacts(accuracy=tier)
        assert (touching.lower <= 0.0).all() and touching.cost.accuracy == tier
        assert rows_of(touching).keys() >= {pair for pair, k in rows.items() if exactly.distance[k] <= 0.0}
    assert len(scene.distances(limit, accuracy="bound")) > len(exactly), "volumes are larger"


@pytest.mark.parametrize("make", [solids, partial(rings, uncertainty=1e-3)])
def test_a_bound_is_one_wherever_the_objects_may_be(rng, make) -> None:
    answer = scene_of(make(rng)).distances(INF, want=("penetration",), accuracy="bound")
    by_volumes = answer.distance == answer.lower
    assert by_volumes.sum() > 50
    kinds = [scene_kind for scene_kind in answer.cost.counts if "half_space" in scene_kind]
    assert by_volumes.all() or kinds, "half spaces are their own volumes"


@pytest.mark.parametrize("tier", TIERS)
@pytest.mark.parametrize("make", [solids, rings])
def test_the_nearest_pair(rng, tier, make) -> None:
    scene = scene_of(make(rng, 30, 6.0))
    everything = scene.distances(INF, want=("penetration",), accuracy=tier)
    exactly = scene.distances(INF, want=("penetration",), accuracy="exact")
    for name in scene.ids[:12]:
        one = scene.nearest_pair(ids=[name], want=("penetration",), accuracy=tier)
        mine = [k for pair, k in rows_of(everything).items() if name in pair]
        if not mine:
            assert len(one) == 0
            continue
        row = rows_of(everything)[one.ids_a[0], one.ids_b[0]]
        assert one.distance[0] == everything.distance[row] and one.cost.accuracy == tier
        if tier == "bound":
            nearest = min(exactly.distance[k] for pair, k in rows_of(exactly).items() if name in pair)
            assert one.distance[0] <= nearest, "no pair is nearer"
        else:
            assert one.distance[0] == everything.distance[mine].min()


def test_exact_arithmetic_decides_what_float64_leaves_open() -> None:
    """Two turned boxes, a hair apart or just touching: the literal answer, in an interval that covers the rounding."""
    half = gs.Box([0.5, 0.5, 0.5])
    flat = (0.0, 0.0, math.sin(0.3), math.cos(0.3))
    for gap in (0.0, 2.0**-52):
        objects = [gs.SceneObject("a", half, (0, 0, 0, *flat)), gs.SceneObject("b", half, (0, 0, 1.0 + gap, *flat))]
        scene = scene_of(objects)
        pose = relative_poses(scene.world, np.array([[0, 1]]))
        for ask in (scene.contacts, partial(scene.distances, 0.0)):
            assert len(ask(accuracy="exact")) == (gap == 0.0)
        nearest = scene.nearest_pair(accuracy="exact")
        assert nearest.distance[0] == gap == gs.distance(half, half, pose, accuracy="exact").distance[0]
        assert nearest.lower[0] == 0.0 and gap < nearest.upper[0] < 1e-13
        assert sum(nearest.cost.counts.get(name, 0) for name in RUNGS) == nearest.cost.counts["narrow box-box"] > 0


@pytest.mark.parametrize("tier", TIERS)
def test_listed_pairs_are_answered_as_by_the_scene(rng, tier) -> None:
    scene = scene_of([*solids(rng, 12), *(gs.SceneObject(f"f{o.id}", o.shape, o.pose) for o in rings(rng, 6))])
    world, pairs = scene.world, all_pairs(scene.world)
    answer = scene.distances(INF, want=("penetration",), accuracy=tier)
    listed = listed_distances(world, pairs, want=("penetration",), accuracy=tier)
    assert listed.cost.accuracy == tier
    found, short = rows_of(answer), 0
    for k, (i, j) in enumerate(pairs.tolist()):
        row = found.get((world.ids[i], world.ids[j]))
        assert (row is None) == (listed.status[k] == 2)
        if row is None:
            continue
        columns = ("status", "distance", "lower", "upper", "point_a", "point_b", "normal")
        for name in columns:
            assert np.array_equal(getattr(listed, name)[k], getattr(answer, name)[row], equal_nan=True), name
        if world.planar[i] or world.uncertainty[[i, j]].any():
            continue
        short += 1
        shapes = [world.table.shapes[world.shape[one]] for one in (i, j)]
        two = distance_of_two(*shapes, world.poses[[i, j]], penetration=True, accuracy=tier)
        for name in columns:
            assert np.array_equal(getattr(two, name)[0], getattr(answer, name)[row], equal_nan=True), name
        alone = listed_distances(world, pairs[k : k + 1], want=("penetration",), accuracy=tier)
        assert two.cost.counts == alone.cost.counts and two.cost.accuracy == tier
    assert short > 20


# ----------------------------------------------------------------------------------------------- first contact


@pytest.mark.parametrize("tier", TIERS)
@pytest.mark.parametrize("horizon", [0.0, 1.5, INF])
def test_first_contacts_are_those_of_the_placed_rings(rng, tier, horizon) -> None:
    scene = scene_of(rings(rng))
    world, pairs = scene.world, all_pairs(scene.world)
    answer = scene.first_contacts(horizon, accuracy=tier)
    listed = listed_first_contacts(world, pairs, horizon, accuracy=tier)
    assert answer.cost.accuracy == listed.cost.accuracy == tier
    found = rows_of(answer)
    for k, (i, j) in enumerate(pairs.tolist()):
        velocities = world.twists[[i, j], :2]
        one = gs.first_contact(ring_of(world, i), ring_of(world, j), *velocities, t_max=horizon, accuracy=tier)
        row = found.get((world.ids[i], world.ids[j]))
        assert (row is None) == (one.status[0] == ContactStatus.NEVER)
        for one_of_us, mine in ((answer, row), (listed, k)):
            if mine is None:
                continue
            for name in ("status", "time", "time_lower", "time_upper", "last_time"):
                assert np.array_equal(getattr(one_of_us, name)[mine], getattr(one, name)[0], equal_nan=True), name
            assert np.array_equal(one_of_us.normal[mine, :2], one.normal[0], equal_nan=True)
            points = one_of_us.points[one_of_us.point_offsets[mine] : one_of_us.point_offsets[mine + 1]]
            assert np.array_equal(points[:, :2], one.points)
    if horizon > 0.0:
        assert 5 < len(found) < len(pairs) and (answer.status == ContactStatus.WILL_TOUCH).any()
    rungs = {name: listed.cost.counts[name] for name in RUNGS if name in listed.cost.counts}
    assert sum(rungs.values()) == (0 if tier == "float64" else len(pairs))


@pytest.mark.parametrize("tier", TIERS)
def test_uncertain_polygons_meet_within_the_interval(rng, tier) -> None:
    radius, horizon = 0.05, 3.0
    objects = rings(rng, 24, 3.5, uncertainty=radius)
    may = scene_of(objects).first_contacts(horizon, accuracy=tier)
    rows, seen = rows_of(may), 0
    assert tier == "bound" or (may.status == ContactStatus.NEVER).any()
    for _ in range(20):
        shifted = []
        for o in objects:
            angle = rng.uniform(0.0, 2.0 * np.pi)
            step = radius * np.array([np.cos(angle), np.sin(angle), 0.0, 0.0, 0.0, 0.0, 0.0])
            shifted.append(gs.SceneObject(o.id, o.shape, np.asarray(o.pose) + step, o.twist))
        there = scene_of(shifted).first_contacts(horizon, accuracy="exact")
        for pair, k in rows_of(there).items():
            assert pair in rows, pair
            row = rows[pair]
            assert may.time_lower[row] <= there.time[k] <= may.time_upper[row], pair
            seen += 1
    assert seen > 200


def test_a_time_beyond_the_doubles_is_no_plausible_number() -> None:
    square = gs.Polygon([[0, 0], [1, 0], [1, 1], [0, 1]])
    slow = (5e-324, 0.0, 0.0, 0.0, 0.0, 0.0)
    for uncertainty in (0.0, 1e-3):
        far = gs.SceneObject("b", square, (1e6, 0, 0, *UPRIGHT), uncertainty=uncertainty)
        answer = scene_of([gs.SceneObject("a", square, twist=slow), far]).first_contacts(INF, accuracy="exact")
        assert answer.status.tolist() == [ContactStatus.WILL_TOUCH] and answer.time[0] == answer.time_upper[0] == INF
        assert 0.0 <= answer.time_lower[0] < INF


@pytest.mark.parametrize("tier", TIERS)
def test_what_is_in_contact_now_but_not_followed(tier) -> None:
    square, spin = gs.Polygon([[0, 0], [1, 0], [1, 1], [0, 1]]), (0.0, 0.0, 0.0, 0.0, 0.0, 1.0)
    box = gs.Box([0.5, 0.5, 0.5])
    scene = scene_of(
        [
            gs.SceneObject("spinning", square, twist=spin),
            gs.SceneObject("square", square, (0.5, 0.5, 0.0, *UPRIGHT)),
            gs.SceneObject("box", box, twist=spin),
            gs.SceneObject("cube", box, (0.0, 0.75, 0.0, *UPRIGHT)),
            gs.SceneObject("next", box, (0.0, 0.0, 1.0, *UPRIGHT)),
        ]
    )
    answer = scene.first_contacts(1.0, accuracy=tier)
    found = {pair: ContactStatus(answer.status[k]).name for pair, k in rows_of(answer).items()}
    deep = "TOUCHING" if tier == "bound" else "OVERLAPPING"
    assert found == {
        ("box", "cube"): deep,
        ("box", "next"): "TOUCHING",
        ("cube", "next"): "TOUCHING",
        ("spinning", "square"): deep,
    }
    assert (answer.time == 0.0).all() and (answer.time_lower == 0.0).all()
    uncertain = tier == "bound"
    assert (answer.time_upper[[0, 3]] == (INF if uncertain else 0.0)).all()
    sizes = np.diff(answer.point_offsets)
    assert (sizes == 0).all() == np.isnan(answer.normal[1]).any() == uncertain


# -------------------------------------------------------------------------------------------------------- cull

WIDE = gs.Frustum((0.0, 0.0, 0.0), np.eye(3), 8.0, 8.0, 1.0, 10.0)


def view(frustum):
    return frustum.origin, frustum.axes, frustum.bounds, frustum.near, frustum.far


def exact_state(frustum, points):
    """What exact arithmetic says about a hull, by its literal points."""
    if all(frustum_box.contains(view(frustum), point) for point in points):
        return gs.INSIDE
    return gs.INTERSECTS if polytope.intersects(polytope.frustum_corners(*view(frustum)), points) else gs.OUTSIDE


def literal_points(world, row):
    """Vertices of a hull, polygon or frustum at its pose, as fractions."""
    shape = world.table.shapes[world.shape[row]]
    if isinstance(shape, gs.Frustum):
        points = polytope.frustum_corners(*view(shape))
    else:
        points = exact([[*v, 0.0][:3] for v in shape.vertices.tolist()])
    return moved(points, world.rotations[row], world.poses[row, :3])


def moved(points, rotation, translation):
    """Points at a pose, both taken literally, as fractions."""
    rows = list(zip(exact(rotation.tolist()), exact(translation.tolist()), strict=True))
    return [tuple(dot(row, v) + step for row, step in rows) for v in points]


@pytest.mark.parametrize("tier", TIERS)
def test_boxes_are_culled_as_by_the_query(rng, tier) -> None:
    turns = [turned(rng) if k % 2 else UPRIGHT for k in range(120)]
    # Half of them on a lattice, where they touch the frustum's sides.
    places = [rng.uniform(-12, 12, 3) if k % 2 else rng.integers(-24, 24, 3) / 2.0 for k in range(120)]
    objects = [
        gs.SceneObject(f"{k:03}", gs.Box(rng.integers(0, 4, 3) / 2.0), (*place, *turn))
        for k, (place, turn) in enumerate(zip(places, turns, strict=True))
    ]
    camera = gs.Frustum((0.0, 0.0, 0.0), np.eye(3), 1.0, 1.0, 1.0, 10.0)
    scene = scene_of(objects)
    boxes = gs.Boxes(
        scene.world.poses[:, :3],
        scene.world.rotations.swapaxes(1, 2),
        np.array([o.shape.half_extents for o in objects]),
    )
    got, want = scene.cull(camera, accuracy=tier), gs.cull(camera, boxes, accuracy=tier)
    assert np.array_equal(got.state, want.state) and np.array_equal(got.certain, want.certain)
    assert {name: got.cost.counts.get(name, 0) for name in want.cost.counts} == want.cost.counts
    assert got.cost.accuracy == tier and got.message == ""
    assert tier != "exact" or (got.certain.all() and set(got.state.tolist()) == {0, 1, 2})


@pytest.mark.parametrize("skew", [0.0, 3e-3])
def test_hulls_are_culled_as_exact_arithmetic_says(rng, skew) -> None:
    """Also where the camera's axes are not quite perpendicular: they are taken literally."""
    axes = np.linalg.qr(rng.normal(size=(3, 3)))[0] if skew else np.eye(3)
    camera = gs.Frustum((0.0, 0.0, 0.0), axes + rng.uniform(-skew, skew, (3, 3)), 1.0, 1.0, 1.0, 10.0)
    objects = []
    for k in range(150):
        # On a lattice, so that many touch planes, edges and corners; some next to it by an ulp.
        depth = rng.integers(1, 22) / 2.0
        place = np.array([*rng.choice([-1.0, 0.0, 0.5, 1.0, 1.5], 2) * depth, depth])
        place = place @ axes if skew else np.where(rng.random(3) < 0.2, np.nextafter(place, 99.0), place)
        turn = turned(rng) if k % 3 == 0 else UPRIGHT
        if k % 5:
            shape = gs.Convex(rng.integers(-2, 3, (rng.integers(1, 6), 3)) / 2.0)
        else:
            shape = gs.Frustum(rng.integers(-1, 2, 3) / 2.0, np.eye(3)[[1, 2, 0]], 0.5, 0.25, 0.5, 1.5)
        objects.append(gs.SceneObject(f"{k:03}", shape, (*place, *turn)))
    check_cull(camera, objects)
    counts = scene_of(objects).cull(camera, accuracy="exact").cost.counts
    assert counts["shapes"] > 10 and (skew or counts["exact"] > 0)


def test_polygons_are_culled_as_exact_arithmetic_says(rng) -> None:
    """From a camera that looks along their plane, which touches the upper side of the view in one case."""
    ring = gs.Polygon([[0, 0], [0.5, -0.5], [1, 0], [0.5, 0.5]])
    flat = []
    for k in range(120):
        depth = rng.integers(0, 24) / 2.0
        yaw = rng.uniform(0.0, 3.0) * (k % 3 == 0)
        pose = (depth, *(rng.integers(-2, 3, 1) / 2.0 * depth), 0, 0, 0, math.sin(yaw / 2.0), math.cos(yaw / 2.0))
        flat.append(gs.SceneObject(f"{k:03}", ring, pose))
    for up in ((-1.0, 1.0), (0.0, 1.0)):
        bounds = (-1.0, 1.0, *up)
        check_cull(gs.Frustum((0.0, 0.0, 0.0), np.eye(3)[[1, 2, 0]], near=1.0, far=10.0, bounds=bounds), flat)


def check_cull(camera, objects):
    """Where a tier is certain it says what exact arithmetic says, and "exact" always is."""
    scene = scene_of(objects)
    truth = np.array([exact_state(camera, literal_points(scene.world, row)) for row in range(len(objects))])
    assert (np.bincount(truth, minlength=3) > 4).all()
    for tier in TIERS:
        got = scene.cull(camera, accuracy=tier)
        wrong = np.flatnonzero(got.certain & (got.state != truth))
        assert len(wrong) == 0, (tier, got.ids[wrong[0]], reproducer(pose=objects[wrong[0]].pose))
        if tier == "exact":
            assert got.certain.all()
        elif tier == "bound":
            assert (got.state[~got.certain] == gs.INTERSECTS).all() and not got.certain.all()


def test_round_shapes_are_culled_to_the_last_bit() -> None:
    """Each touches the far plane from within: inside.  One ulp more and it is not."""
    ring = gs.Polygon([[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]])
    more = np.nextafter(0.5, 1.0)
    touching = {
        "ball": (gs.Sphere, 0.5, gs.INTERSECTS),
        "capsule": (lambda r: gs.Capsule(r, 0.0), 0.5, gs.INTERSECTS),
        "can": (lambda h: gs.Cylinder(0.25, 2.0 * h), 0.5, gs.INTERSECTS),
        "cone": (lambda h: gs.Cone(0.25, 2.0 * h), 0.5, gs.INTERSECTS),
        "egg": (lambda h: gs.Ellipsoid([0.25, 0.125, h]), 0.5, gs.INTERSECTS),
        "hull": (lambda h: gs.Convex([[0, 0, -h], [0, 0, h]]), 0.5, gs.INTERSECTS),
        "cube": (lambda h: gs.Box([0.25, 0.25, h]), 0.5, gs.INTERSECTS),
        "lens": (lambda f: gs.Frustum((0, 0, -f), np.eye(3), 0.1, 0.1, 0.5, 2.0 * f), 0.5, gs.INTERSECTS),
    }
    for size in (0.5, more):
        scene = scene_of([gs.SceneObject(n, make(size), (0, 0, 9.5, *UPRIGHT)) for n, (make, _, _) in touching.items()])
        got = scene.cull(WIDE, accuracy="exact")
        for name, state, certain in zip(got.ids, got.state.tolist(), got.certain.tolist(), strict=True):
            expected = gs.INSIDE if size == 0.5 else touching[name][2]
            assert (state, certain) == (expected, True), (name, size)
        assert not scene.cull(WIDE, accuracy="float64").certain.all()
    # From outside: touching is contact, an ulp less is not.
    for size, state in ((0.5, gs.INTERSECTS), (np.nextafter(0.5, 0.0), gs.OUTSIDE)):
        scene = scene_of([gs.SceneObject("ball", gs.Sphere(size), (0, 0, 10.5, *UPRIGHT))])
        seen = scene.cull(WIDE, accuracy="exact")
        assert seen.state.tolist() == [state] and seen.certain.all()
        assert not scene.cull(WIDE, accuracy="float64").certain.any()
    floor = gs.SceneObject("floor", gs.HalfSpace((0.0, 0.0, -1.0), -9.0))
    away = gs.SceneObject("away", gs.HalfSpace((0.0, 0.0, -1.0), -11.0))
    flat = gs.SceneObject("flat", ring, (0.0, 0.0, 0.0, *UPRIGHT))
    for tier in TIERS:
        seen = scene_of([floor, away, flat]).cull(WIDE, accuracy=tier)
        state = dict(zip(seen.ids, zip(seen.state.tolist(), seen.certain.tolist(), strict=True), strict=True))
        if tier == "bound":
            # The ball around so wide a view reaches further than the view.
            assert state["away"] == (gs.INTERSECTS, False) and state["floor"][0] == gs.INTERSECTS
            assert state["flat"] == (gs.OUTSIDE, True)
        else:
            assert state == {"away": (gs.OUTSIDE, True), "floor": (gs.INTERSECTS, True), "flat": (gs.OUTSIDE, True)}
    much = gs.SceneObject("much", gs.HalfSpace((0.0, 0.0, -1.0), -999.0))
    assert scene_of([much]).cull(WIDE, accuracy="bound").certain.all()


def test_uncertain_objects_are_certain_only_wherever_they_may_be() -> None:
    for tier in TIERS:
        for depth, state in ((5.0, gs.INSIDE), (9.4999, gs.INSIDE), (10.0, gs.INTERSECTS), (10.5001, gs.OUTSIDE)):
            for shape in (gs.Box([0.5, 0.5, 0.5]), gs.Convex(gs.shapes.CORNER_SIGNS * 0.5), gs.Sphere(0.5)):
                vague = gs.SceneObject("v", shape, (0, 0, depth, *UPRIGHT), uncertainty=1e-2)
                got = scene_of([vague]).cull(WIDE, accuracy=tier)
                if tier == "bound":
                    assert got.state[0] == state or (got.state[0] == gs.INTERSECTS and not got.certain[0])
                else:
                    assert (got.state[0], got.certain[0]) == (state, depth in (5.0, 10.0)), (tier, depth, shape.kind)


# ------------------------------------------------------------------------------------------------------- tiers


def test_a_tier_that_a_query_does_not_answer_is_named(rng) -> None:
    scene = scene_of(solids(rng, 4))
    world, pairs = scene.world, np.array([[0, 1]])
    queries = {
        "distances": (partial(scene.distances, 1.0), TIERS),
        "contacts": (scene.contacts, TIERS),
        "nearest_pair": (scene.nearest_pair, TIERS),
        "first_contacts": (partial(scene.first_contacts, 1.0), TIERS),
        "cull": (partial(scene.cull, WIDE), TIERS),
        "listed_distances": (partial(listed_distances, world, pairs), TIERS),
        "listed_first_contacts": (partial(listed_first_contacts, world, pairs, 1.0), TIERS),
    }
    for name, (query, answered) in queries.items():
        for tier in gs._validate.ACCURACIES:
            if tier in answered:
                assert query(accuracy=tier).cost.accuracy == tier, name
                continue
            with pytest.raises(gs.NotAvailableError, match=f"accuracy='{tier}' is not available yet") as caught:
                query(accuracy=tier)
            assert all(repr(known) in str(caught.value) for known in answered), name
        with pytest.raises(gs.GeometryError, match="accuracy must be one of"):
            query(accuracy="great")


def test_exact_distance_is_the_oracle_s(rng) -> None:
    """Not by way of the engine: the relative pose as stated, its matrix literal, exact arithmetic from there on."""
    hulls = [gs.Convex(rng.normal(size=(5, 3))) for _ in range(7)]
    scene = scene_of(
        [gs.SceneObject(f"{k}", hull, (*rng.normal(size=3), *turned(rng))) for k, hull in enumerate(hulls)]
    )
    world, pairs = scene.world, all_pairs(scene.world)
    answer = scene.distances(INF, accuracy="exact")
    for k, ((i, j), pose) in enumerate(zip(pairs, gs._validate.poses(relative_poses(world, pairs)), strict=True)):
        there = moved(exact(hulls[j].vertices.tolist()), gs._validate.rotation_matrices(pose[None, 3:])[0], pose[:3])
        square = polytope.squared_distance(exact(hulls[i].vertices.tolist()), there)
        assert answer.distance[k] == root_double(square), reproducer(
            a=hulls[i].vertices, b=hulls[j].vertices, pose=pose
        )
    assert len(answer) == len(pairs) and 3 < (answer.distance > 0.0).sum()
