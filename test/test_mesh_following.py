# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""Meshes of scenes that turn, are uncertain, have a margin, or meet round bodies: judged by hulls and by distances."""

from __future__ import annotations

from collections import Counter
from typing import Any

import numpy as np
import pytest
from scene_answers import scene_of
from test_mesh_motion import QUADS, box_mesh
from test_scene_contacts import place

import geomsrv as gs
from geomsrv import _validate
from geomsrv.answers import ContactStatus
from geomsrv.mesh_following import MOST_PIECES

HORIZON = 3.0
NEAR = 1e-12  # what poses composed in float64 are off by, a few metres from the origin [m]
SLOPPY = 2e-5  # way made within the tolerance [m]
WILL_TOUCH, NEVER, UNSUPPORTED = ContactStatus.WILL_TOUCH, ContactStatus.NEVER, ContactStatus.UNSUPPORTED
AT_ONCE = (ContactStatus.TOUCHING, ContactStatus.OVERLAPPING)

BOX_MESH = box_mesh((-0.4, -0.3, -0.2), (0.4, 0.3, 0.2))
PHI = 0.5 + np.sqrt(1.25)


def icosahedron(radius: float, halvings: int) -> gs.Mesh:
    """A convex ball of triangles: midpoints of edges are pushed out."""
    corners = [p for a in (1, -1) for b in (PHI, -PHI) for p in ((0, a, b), (a, b, 0), (b, 0, a))]
    points = np.array(corners, float)
    edge = 2.0 + 1e-9  # other distances of corners are longer by more than one
    faces = [
        (i, j, k)
        for i in range(12)
        for j in range(i)
        for k in range(j)
        if max(np.linalg.norm(points[u] - points[v]) for u, v in ((i, j), (j, k), (k, i))) <= edge
    ]
    triangles = points[np.array(faces)] / np.linalg.norm(points[0])
    for _ in range(halvings):
        a, b, c = triangles.swapaxes(0, 1)
        ab, bc, ca = a + b, b + c, c + a
        cut = ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))
        triangles = np.concatenate([np.stack(part, axis=1) for part in cut])
        triangles /= np.linalg.norm(triangles, axis=2, keepdims=True)
    return gs.Mesh(radius * triangles.reshape(-1, 3), np.arange(3 * len(triangles)).reshape(-1, 3))


BALL = icosahedron(0.5, 2)  # 320 triangles


def pose_of(rng: np.random.Generator, spread: float) -> np.ndarray:
    turn = rng.normal(size=4)
    return np.concatenate([rng.uniform(-spread, spread, 3), turn / np.linalg.norm(turn)])


def others(rng: np.random.Generator) -> dict[str, Any]:
    near = rng.uniform(0.3, 0.6, 3)
    return {
        "box": gs.Box(near),
        "hull": gs.Convex(rng.normal(size=(7, 3)) * 0.4),
        "sphere": gs.Sphere(near[0]),
        "capsule": gs.Capsule(near[0] / 2, near[1]),
        "cylinder": gs.Cylinder(near[0], near[1]),
        "cone": gs.Cone(near[0], near[1]),
        "ellipsoid": gs.Ellipsoid(near),
        "half space": gs.HalfSpace((0, 0, 1), -1.5),
        "mesh": box_mesh(-near, near),
        "frustum": gs.Frustum([0, 0, 0], np.eye(3), 0.2, 0.15, 0.2, 4.0),
    }


def hull_of(shape: Any) -> Any:
    return gs.Convex(shape.vertices) if isinstance(shape, gs.Mesh) else shape


def contact(a: gs.SceneObject, b: gs.SceneObject, horizon: float = HORIZON, **how: Any) -> tuple[int, Any, Any]:
    """Status, lower, upper of a scene of two."""
    answer = scene_of([a, b]).first_contacts(horizon, **how)
    assert not answer.unsupported, answer.unsupported
    if not len(answer):
        return NEVER, np.nan, np.nan
    return int(answer.status[0]), answer.time_lower[0], answer.time_upper[0]


def moving(rng: np.random.Generator, name: str, shape: Any, **more: Any) -> gs.SceneObject:
    pose = pose_of(rng, 2.0)
    if isinstance(shape, gs.HalfSpace):
        return gs.SceneObject(
            name, shape, np.array([0, 0, -1.0, 0, 0, 0, 1]), [0, 0, rng.uniform(0, 1), 0, 0, 0], **more
        )
    twist = np.concatenate([rng.normal(size=3) * 0.3 - pose[:3] / 2.0, rng.normal(size=3) * rng.choice([0.0, 2.0])])
    return gs.SceneObject(name, shape, pose, twist, **more)


@pytest.mark.parametrize("margin", [0.0, 0.1])
def test_a_convex_mesh_meets_what_its_hull_meets(rng: np.random.Generator, margin: float) -> None:
    """The surface and the body within come to everything outside of them at the same time."""
    seen: Counter[tuple[str, int]] = Counter()
    for round_ in range(5):
        for name, shape in others(rng).items():
            mesh, other = moving(rng, "m", (BALL, BOX_MESH)[round_ % 2]), moving(rng, "o", shape)
            hulls = [gs.SceneObject(o.id, hull_of(o.shape), o.pose, o.twist) for o in (mesh, other)]
            expected, low, high = contact(*hulls, margin=margin)
            status, lower, upper = contact(mesh, other, margin=margin)
            told = f"{name} {margin}: {status} [{lower}, {upper}] but {expected} [{low}, {high}]"
            seen[name, status] += 1
            if expected in AT_ONCE:
                assert status in (*AT_ONCE, WILL_TOUCH, NEVER), told  # may be inside, beyond the surface
            else:
                assert status == expected, told
                if status != NEVER:
                    assert lower <= high and low <= upper and upper - lower <= 1e-6, told
    assert all(seen[name, WILL_TOUCH] for name in others(rng)), seen
    assert sum(n for (_, status), n in seen.items() if status == NEVER) >= 5, seen


def triangles_at(mesh: gs.SceneObject, t: float) -> gs.Polytopes:
    pose = place(np.asarray(mesh.pose, float), np.asarray(mesh.twist, float), t)
    shape: Any = mesh.shape
    points = shape.vertices @ _validate.rotation_matrices(pose[None, 3:])[0].T + pose[:3]
    corners = points[shape.triangles].reshape(-1, 3)
    return gs.Polytopes(corners, np.arange(0, len(corners) + 1, 3))


def gap_at(mesh: gs.SceneObject, other: gs.SceneObject, t: float) -> float:
    """Distance of the surface of a mesh from a box, triangle by triangle."""
    pose = place(np.asarray(other.pose, float), np.asarray(other.twist, float), t)
    turned = _validate.rotation_matrices(pose[None, 3:])[0]
    shape: Any = other.shape
    box = gs.Boxes(pose[None, :3], turned.T[None], shape.half_extents[None])
    return float(gs.distance(triangles_at(mesh, t), box).distance.min())


U_SHAPE = [((-1, -1, -0.3), (1, -0.6, 0.3)), ((-1, -0.6, -0.3), (-0.6, 1, 0.3)), ((0.6, -0.6, -0.3), (1, 1, 0.3))]


def u_mesh() -> gs.Mesh:
    """Three boxes, not convex together: two arms up along y."""
    parts = [box_mesh(np.array(low, float), np.array(high, float)) for low, high in U_SHAPE]
    return gs.Mesh(
        np.concatenate([m.vertices for m in parts]),
        np.concatenate([m.triangles + 8 * k for k, m in enumerate(parts)]),
    )


@pytest.mark.parametrize("margin", [0.0, 0.15])
def test_a_mesh_that_is_not_convex(rng: np.random.Generator, margin: float) -> None:
    """Distances say so at both ends of the interval and before it; the hull would meet earlier, often."""
    met = earlier = 0
    for _ in range(12):
        pose = np.array([*rng.uniform(-0.2, 0.2, 3), 0, 0, 0, 1]) + [0, 2.5, 0, 0, 0, 0, 0]
        twist = np.array([*rng.normal(size=3) * 0.1, *rng.normal(size=3) * 0.5]) + [0, -1.2, 0, 0, 0, 0]
        box = gs.SceneObject("o", gs.Box([0.2, 0.2, 0.2]), pose, twist)
        mesh = gs.SceneObject("m", u_mesh(), [0, 0, 0, 0, 0, 0, 1], [0, 0, 0, *rng.normal(size=3) * 0.15])
        status, lower, upper = contact(mesh, box, margin=margin)
        end = HORIZON if status == NEVER else lower
        for t in np.linspace(0.0, end, 9):
            assert gap_at(mesh, box, t) >= margin - NEAR
        if status == WILL_TOUCH:
            met += 1
            assert upper - lower <= 1e-6 and gap_at(mesh, box, upper) <= margin + SLOPPY
        hull = gs.SceneObject("m", hull_of(mesh.shape), mesh.pose, mesh.twist)
        earlier += contact(hull, box, margin=margin)[1] < end - 0.05
    assert met >= 6 and earlier >= 6, (met, earlier)


@pytest.mark.parametrize("margin", [0.0, 0.05])
@pytest.mark.parametrize("uncertainty", [0.0, 0.01])
def test_no_triangle_is_left_out(rng: np.random.Generator, margin: float, uncertainty: float) -> None:
    """A loose heap of triangles meets what the first of them meets, each being an object of its own."""
    seen: Counter[int] = Counter()
    points = rng.uniform(-0.8, 0.8, (6, 1, 3)) + rng.normal(size=(6, 3, 3)) * 0.15
    heap = gs.Mesh(points.reshape(-1, 3), np.arange(18).reshape(-1, 3))
    for name, shape in others(rng).items():
        shape = gs.Mesh(points[:2].reshape(-1, 3), np.arange(6).reshape(-1, 3)) if name == "mesh" else shape
        mesh, other = moving(rng, "m", heap, uncertainty=uncertainty), moving(rng, "o", shape)
        alone = [gs.Triangle(*p) for p in points]
        parts = [gs.Triangle(*p) for p in points[:2]] if name == "mesh" else [shape]
        found = [
            contact(
                gs.SceneObject("m", one, mesh.pose, mesh.twist, uncertainty=uncertainty),
                gs.SceneObject("o", part, other.pose, other.twist),
                margin=margin,
            )
            for one in alone
            for part in parts
        ]
        status, lower, upper = contact(mesh, other, margin=margin)
        seen[status] += 1
        told = f"{name}: {status} [{lower}, {upper}] but {sorted(found, key=str)}"
        assert (status == NEVER) == all(how == NEVER for how, *_ in found), told
        assert (status in AT_ONCE) == any(how in AT_ONCE for how, *_ in found), told
        low, high = (np.fmin.reduce([row[k] for row in found]) for k in (1, 2))
        if np.isnan(low):
            assert np.isnan(lower), told
            continue
        assert low - 1e-6 <= lower <= low + 1e-6 and lower <= high and low <= upper, told
        assert uncertainty or upper <= high + 1e-6, told
    assert seen[WILL_TOUCH] >= 2, seen


@pytest.mark.parametrize("name", ["box", "sphere", "cylinder", "mesh"])
def test_uncertain_meshes_cover_all_that_may_be(rng: np.random.Generator, name: str) -> None:
    """Whatever is tried within the uncertainty, and in velocity, comes within the interval."""
    tried = 0
    for turning in (0.0, 1.0, 1.0):
        off, drift = 0.02, 0.01
        mesh = moving(rng, "m", BOX_MESH, uncertainty=off, velocity_uncertainty=drift)
        mesh = gs.SceneObject("m", BOX_MESH, mesh.pose, [*mesh.twist[:3], *np.multiply(mesh.twist[3:], turning)])
        other = moving(rng, "o", others(rng)[name])
        vague = gs.SceneObject("m", BOX_MESH, mesh.pose, mesh.twist, uncertainty=off, velocity_uncertainty=drift)
        status, lower, upper = contact(vague, other)
        for _ in range(8):
            push, pull = (v / np.linalg.norm(v) for v in rng.normal(size=(2, 3)))
            pose, twist = np.array(mesh.pose, float), np.array(mesh.twist, float)
            pose[:3] += rng.uniform(0.5, 1.0) * off * push
            twist[:3] += rng.uniform(0.5, 1.0) * drift * pull
            how, low, high = contact(gs.SceneObject("m", BOX_MESH, pose, twist), other)
            if how == NEVER:
                assert status == NEVER or upper == np.inf
                continue
            tried += 1
            assert lower <= high and low <= upper, f"{name}: [{lower}, {upper}] without [{low}, {high}]"
    assert tried >= 8


def test_order_of_triangles_changes_little(rng: np.random.Generator) -> None:
    """The same status, and intervals that overlap."""
    other = gs.SceneObject("o", gs.Box([0.3, 0.4, 0.5]), [2.0, 0.1, 0.2, 0, 0, 0, 1], [-1.0, 0, 0, 0.5, 0, 1.0])
    spans = []
    for _ in range(4):
        order, names = rng.permutation(len(BALL.triangles)), rng.permutation(len(BALL.vertices))
        shuffled = np.zeros_like(BALL.vertices)
        shuffled[names] = BALL.vertices
        turned = np.take_along_axis(
            names[BALL.triangles[order]], rng.permuted(np.tile([0, 1, 2], (len(order), 1)), axis=1), 1
        )
        mesh = gs.SceneObject("m", gs.Mesh(shuffled, turned), [0, 0, 0, 0, 0, 0, 1], [0, 0, 0, 1.0, 0.3, 0.2])
        status, lower, upper = contact(mesh, other)
        assert status == WILL_TOUCH and upper - lower <= 1e-6
        spans.append((lower, upper))
    assert max(low for low, _ in spans) <= min(high for _, high in spans)


@pytest.mark.parametrize("shape", [gs.Box([0.05, 0.05, 0.05]), gs.Sphere(0.05), gs.Cylinder(0.05, 0.1)])
def test_what_is_enclosed_is_apart_from_the_surface(shape: Any) -> None:
    """Of translating meshes the same is true: a mesh is a surface."""
    cage = gs.SceneObject("cage", box_mesh((-1.0,) * 3, (1.0,) * 3), [0, 0, 0, 0, 0, 0, 1], [0, 0, 0, 0, 0, 1.0])
    still = gs.SceneObject("thing", shape, [0, 0, 0, 0, 0, 0, 1])
    assert contact(cage, still)[0] == NEVER
    rising = gs.SceneObject("thing", shape, [0, 0, 0, 0, 0, 0, 1], [0, 0, 0.5, 0, 0, 0])
    status, lower, upper = contact(cage, rising)
    assert status == WILL_TOUCH and lower <= (1.0 - 0.05) / 0.5 <= upper


def test_statuses_at_the_start(rng: np.random.Generator) -> None:
    """As those of meshes that translate, which are exactly judged."""
    cube = gs.Box([0.5, 0.5, 0.5])
    for height, wanted in ((0.65, ContactStatus.OVERLAPPING), (0.75, ContactStatus.TOUCHING), (1.0, WILL_TOUCH)):
        slid, spun = (
            contact(
                gs.SceneObject(
                    "m", box_mesh((-0.25,) * 3, (0.25,) * 3), [0, 0, height, 0, 0, 0, 1], [0, 0, -1, 0, 0, w]
                ),
                gs.SceneObject("o", cube),
            )
            for w in (0.0, 1.0)
        )
        assert slid[0] == spun[0] == wanted
        assert slid[1] <= spun[2] and spun[1] <= slid[2]


def test_many_touch_and_one_overlaps() -> None:
    """Wherever it is among the triangles."""
    n = 24
    x = np.linspace(-1, 1, n + 1)
    at = np.arange((n + 1) ** 2).reshape(n + 1, n + 1)
    low, right, up, both = at[:-1, :-1].ravel(), at[1:, :-1].ravel(), at[:-1, 1:].ravel(), at[1:, 1:].ravel()
    flat = np.concatenate([np.stack([low, right, both], axis=1), np.stack([low, both, up], axis=1)])
    table = gs.SceneObject("o", gs.Box([2.0, 2.0, 0.5]), [0, 0, -0.5, 0, 0, 0, 1])
    for dent, wanted in (
        (None, ContactStatus.TOUCHING),
        (0, ContactStatus.OVERLAPPING),
        (-1, ContactStatus.OVERLAPPING),
    ):
        points = np.array([(a, b, 0.0) for a in x for b in x])
        if dent is not None:
            points[dent, 2] = -0.1
        plate = gs.SceneObject("m", gs.Mesh(points, flat), [0, 0, 0, 0, 0, 0, 1], [0, 0, 0, 0, 0, 0.5])
        status, lower, upper = contact(plate, table)
        assert (status, lower) == (wanted, 0.0) and len(flat) > 4 * MOST_PIECES
        assert upper == 0.0 or wanted == ContactStatus.TOUCHING


def test_at_rest_for_as_long_as_is_asked() -> None:
    sheet = gs.Mesh([(a, b, 0) for a in (-1, 1) for b in (-1, 1)], [(0, 1, 2), (1, 2, 3)])
    pair = [gs.SceneObject("ball", gs.Sphere(0.5), [0, 0, 0.4, 0, 0, 0, 1]), gs.SceneObject("sheet", sheet)]
    answer = scene_of(pair).first_contacts(2.0)
    assert (answer.status[0], answer.time[0], answer.last_time[0]) == (ContactStatus.OVERLAPPING, 0.0, 2.0)
    assert contact(gs.SceneObject("ball", gs.Sphere(0.5), [0, 0, 0.6, 0, 0, 0, 1]), pair[1])[0] == NEVER
    assert contact(*pair, horizon=0.0)[0] == ContactStatus.OVERLAPPING


def test_what_is_not_followed_is_said() -> None:
    """In contact now, or unsupported: without rotation, where nobody knows how a mesh moves, and at other tiers."""
    cube = gs.Box([0.5, 0.5, 0.5])
    for height, wanted in ((0.6, ContactStatus.OVERLAPPING), (2.0, UNSUPPORTED)):
        pose, spin = [0, 0, height, 0, 0, 0, 1], [0, 0, -1, 0, 0, 1.0]
        spinning = gs.SceneObject("m", box_mesh((-0.25,) * 3, (0.25,) * 3), pose, spin)
        lost = gs.SceneObject("m", spinning.shape, pose, motion_fault="nobody knows")
        for mesh, how, reason in (
            (spinning, {"rotation": False}, "switched off"),
            (lost, {}, "nobody knows"),
            (lost, {"margin": 0.0, "accuracy": "auto"}, "nobody knows"),
        ):
            answer = scene_of([gs.SceneObject("o", cube), mesh]).first_contacts(HORIZON, **how)
            assert answer.status.tolist() == [wanted]
            assert all(reason in text for *_, text in answer.unsupported)
            assert len(answer.unsupported) == (wanted == UNSUPPORTED)
        answer = scene_of([gs.SceneObject("o", cube), spinning]).first_contacts(HORIZON, accuracy="exact")
        assert answer.status.tolist() == [UNSUPPORTED] and "available at 'float64' only" in answer.unsupported[0][2]
        assert "box-mesh" in answer.unsupported[0][2]


def test_many_triangles_and_many_bodies() -> None:
    """The earliest of many, and all of them, are the same pairs with the same times."""
    ball = icosahedron(1.0, 3)
    mesh = gs.SceneObject("ball", ball, [0, 0, 0, 0, 0, 0, 1], [0.5, 0, 0, 0, 0, 3.0])
    ring = [
        gs.SceneObject(f"{k:02}", gs.Box([0.1, 0.1, 0.1]), [2 + k / 4, np.sin(k), np.cos(k), 0, 0, 0, 1])
        for k in range(12)
    ]
    scene = scene_of([mesh, *ring])
    every, first = scene.first_contacts(4.0), scene.first_contacts(4.0, earliest=True)
    assert len(ball.triangles) == 1280 and len(every) >= 3 and (every.status == WILL_TOUCH).all()
    k = int(np.argmin(every.time))
    assert (first.ids_a, first.ids_b, first.time.tolist()) == ([every.ids_a[k]], [every.ids_b[k]], [every.time[k]])
    assert len(QUADS) * 2 == len(BOX_MESH.triangles)
