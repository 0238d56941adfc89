# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""Listed pairs get the answers that the scene gives, in the order of the list."""

from __future__ import annotations

import numpy as np
import pytest
from conftest import reproducer

import geomsrv as gs
from geomsrv.pairwise import Bodies, distance_of_two, listed_distances, listed_first_contacts, world_of


def random_scene(rng, uncertain=False) -> gs.Scene:
    def pose(flat=False):
        if flat:
            angle = rng.choice([0.0, rng.uniform(0, 3)])
            return (*rng.uniform(-3, 3, 2), 0, 0, 0, np.sin(angle / 2), np.cos(angle / 2))
        turn = rng.normal(size=4)
        return (*rng.uniform(-3, 3, 3), *turn / np.linalg.norm(turn))

    makers = [
        lambda: gs.Sphere(0.5),
        lambda: gs.Box(rng.uniform(0.2, 1, 3)),
        lambda: gs.Capsule(0.2, 1.0),
        lambda: gs.Convex(rng.normal(size=(6, 3))),
        lambda: gs.Mesh(rng.normal(size=(4, 3)), [(0, 1, 2), (0, 2, 3)]),
    ]
    solids = [gs.SceneObject(f"s{i}", makers[i % 5](), pose(), (*rng.normal(size=3), 0, 0, 0)) for i in range(10)]
    square = gs.Polygon([[0, 0], [1, 0], [1, 1], [0, 1]])
    flats = [
        gs.SceneObject(
            f"f{i}",
            square,
            pose(flat=True),
            (*rng.normal(size=2), 0, 0, 0, 0.5 * (i == 7)),
            uncertainty=1e-3 * uncertain * (i % 2),
            motion_fault="it jumps" if i == 6 and uncertain else "",
        )
        for i in range(8)
    ]
    scene = gs.Scene()
    scene.apply(gs.SceneUpdate(add=solids + flats))
    return scene


def all_pairs(scene, rng):
    """Every ordered pair, shuffled, some twice."""
    world = scene.world
    n = len(world)
    pairs = np.array([(i, j) for i in range(n) for j in range(n) if i != j])
    return world, rng.permutation(np.concatenate([pairs, pairs[:20]]))


@pytest.mark.parametrize("uncertain", [False, True])
def test_distances_are_those_of_the_scene(rng, uncertain) -> None:
    scene = random_scene(rng, uncertain)
    world, pairs = all_pairs(scene, rng)
    want = scene.distances(np.inf, want=("penetration",))
    rows = {(a, b): i for i, (a, b) in enumerate(zip(want.ids_a, want.ids_b, strict=True))}
    got = listed_distances(world, pairs, want=("penetration",))
    known = swapped = unsupported = 0
    for k, (i, j) in enumerate(pairs.tolist()):
        a, b = world.ids[i], world.ids[j]
        row = rows.get((min(a, b), max(a, b)))
        if row is None:
            assert got.status[k] == 2 and np.isnan(got.distance[k]) and np.isnan(got.normal[k]).all()
            unsupported += 1
            continue
        known += 1
        flip = a > b
        swapped += flip
        info = reproducer(a=world.poses[i], b=world.poses[j])
        # The other order is another computation, so only the intervals have to agree.
        assert got.lower[k] <= want.upper[row] and want.lower[row] <= got.upper[k], info
        if not flip:
            for name in ("distance", "lower", "upper", "point_a", "point_b", "normal"):
                assert np.array_equal(getattr(got, name)[k], getattr(want, name)[row], equal_nan=True), name
        elif got.distance[k] > 0:
            assert np.allclose(got.normal[k], -want.normal[row], atol=1e-6), info
    assert known > 100 and swapped > 50 and unsupported > 100
    assert "mesh" in got.message and "polygons are compared with polygons only" in got.message


@pytest.mark.parametrize("uncertain", [False, True])
@pytest.mark.parametrize("flat", [False, True])
def test_first_contacts_are_those_of_the_scene(rng, uncertain, flat) -> None:
    scene = random_scene(rng, uncertain)
    world, pairs = all_pairs(scene, rng)
    if flat:  # all of the kernel's own kind, which takes a shorter way
        sliding = world.planar & ~world.turns
        pairs = pairs[sliding[pairs].all(axis=1)]
    want = scene.first_contacts(4.0)
    rows = {(a, b): i for i, (a, b) in enumerate(zip(want.ids_a, want.ids_b, strict=True))}
    got = listed_first_contacts(world, pairs, 4.0)
    seen = set()
    for k, (i, j) in enumerate(pairs.tolist()):
        a, b = world.ids[i], world.ids[j]
        row, points = rows.get((min(a, b), max(a, b))), got.points[got.point_offsets[k] : got.point_offsets[k + 1]]
        if row is None:
            assert got.status[k] in (0, 4) and (got.status[k] == 4 or world.planar[i] == world.planar[j])
            continue
        seen.add(int(got.status[k]))
        assert got.status[k] == want.status[row]
        wanted = want.points[want.point_offsets[row] : want.point_offsets[row + 1]]
        assert len(points) == len(wanted)
        if got.status[k] == 1:
            info = reproducer(a=world.poses[i], b=world.poses[j])
            assert got.time_lower[k] <= want.time_upper[row] and want.time_lower[row] <= got.time_upper[k], info
            sign = -1.0 if a > b else 1.0
            assert np.allclose(got.normal[k], sign * want.normal[row], atol=1e-6), info
    assert 1 in seen and 3 in seen
    assert flat or not uncertain or 4 in seen
    assert (got.message == "") == flat
    if uncertain and not flat:
        assert "it jumps" in got.message


def test_bodies_of_no_scene() -> None:
    rest = np.array([[0, 0, 0, 0, 0, 0, 1.0]])
    world = world_of(
        Bodies([gs.Sphere(1.0)], rest, np.zeros((0, 6)), "_a"),
        Bodies([gs.Box([1, 1, 1])], rest + [4, 0, 0, 0, 0, 0, 0], np.zeros((0, 6)), "_b"),
    )
    got = listed_distances(world, np.array([[0, 1], [1, 0]]))
    assert got.distance.tolist() == [2.0, 2.0] and got.normal.tolist() == [[1, 0, 0], [-1, 0, 0]]
    assert listed_distances(world, np.zeros((0, 2), np.int64)).distance.tolist() == []


@pytest.mark.parametrize(
    ("poses", "text"),
    [
        ([[0, 0, 0, 0, 0, 0, 1.0], [0, 0, 0, 0, 0, 0, 2.0]], r"poses_b\[1\] quaternion"),
        ([[0, 0, 0, 0, 0, 0, 1.0], [0, np.nan, 0, 0, 0, 0, 1]], r"poses_b\[1, 1\] is nan"),
        ([[0, 0, 0, 0, 0, 0, 1.0], [0, 0, 1, 0, 0, 0, 1]], r"poses_b\[1\]: a polygon lies in the plane"),
    ],
)
def test_faults_name_the_list_and_the_index(poses, text) -> None:
    square = gs.Polygon([[0, 0], [1, 0], [1, 1]])
    fine = Bodies([gs.Sphere(1.0)], np.array([[0, 0, 0, 0, 0, 0, 1.0]]), np.zeros((0, 6)), "_a")
    with pytest.raises(gs.GeometryError, match=text):
        world_of(fine, Bodies([square, square], np.array(poses), np.zeros((0, 6)), "_b"))


def test_a_pair_with_itself_is_named(rng) -> None:
    world = random_scene(rng).world
    for ask in (listed_distances, lambda w, p: listed_first_contacts(w, p, 1.0)):
        with pytest.raises(gs.GeometryError, match="pair 1 is 'f3' with itself"):
            ask(world, np.array([[0, 1], [3, 3]]))


def test_two_bodies_get_the_same_answer_the_short_way(rng) -> None:
    makers = [gs.Sphere(0.5), gs.Box([0.2, 0.4, 0.6]), gs.Capsule(0.2, 1.0), gs.Convex(rng.normal(size=(6, 3)))]
    shapes = [*makers, gs.HalfSpace([0.0, 0.6, 0.8], -1.0), gs.Mesh(np.eye(3), [[0, 1, 2]])]
    shapes += [gs.Cone(0.3, 1.0), gs.Polygon([[0, 0], [1, 0], [0, 1]])]
    answered = refused = 0
    for a in shapes:
        for b in shapes:
            turns = rng.normal(size=(2, 4))
            turns /= np.linalg.norm(turns, axis=1, keepdims=True)
            if gs.Polygon in (type(a), type(b)):
                turns = np.tile([0.0, 0, 0, 1], (2, 1))
            poses = np.column_stack([rng.normal(size=(2, 3)) * (1, 1, gs.Polygon not in (type(a), type(b))), turns])
            poses = gs._validate.poses(poses)
            rest = np.zeros((0, 6))
            world = world_of(Bodies([a], poses[:1], rest), Bodies([b], poses[1:], rest))
            for want in ((), ("penetration",)):
                long = listed_distances(world, np.array([[0, 1]]), want=want)
                short = distance_of_two(a, b, world.poses, penetration=bool(want), accuracy="float64")
                if short is None:
                    refused += 1
                    assert long.status[0] == 2 or isinstance(a, gs.Polygon)
                    continue
                answered += 1
                for name in ("status", "distance", "lower", "upper", "point_a", "point_b", "normal"):
                    one, other = getattr(short, name), getattr(long, name)
                    assert np.array_equal(one, other, equal_nan=True), (a.kind, b.kind, name)
                assert short.cost.counts == long.cost.counts and short.message == long.message == ""
    assert answered > 40 and refused > 20
