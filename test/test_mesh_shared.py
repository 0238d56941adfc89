# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""What meshes share that turn when they touch: landed where that is known, and turned back to where they start."""

from __future__ import annotations

import time
from collections import Counter
from typing import Any

import numpy as np
import pytest
from conftest import reproducer
from scene_answers import scene_of
from test_mesh_following import moving, others
from test_mesh_motion import box_mesh, joined
from test_turning_contact_set import ROUNDED, way
from test_turning_contact_set import Landing as Laid

import geomsrv as gs
from geomsrv import _validate, mesh_shared
from geomsrv.answers import ContactStatus
from geomsrv.hull import hull_triangles
from geomsrv.mesh_contact import united_in_space
from geomsrv.turning import TIME_TOLERANCE

T = 1.0
NEAR = 1e-5  # way made within the default tolerance, some times over [m]
LANDED = 10.0 * TIME_TOLERANCE  # [s] poses at the start are rounded, and margins and round bodies meet at a slant
AT_REST = 1e-12  # [m] the same pieces, placed by other sums of numbers of about 1 m
FALL = np.array([0.1, -0.05, -1.5])
SPINS = {"upright": (0.0, 0.0, 0.7), "hinged": (0.0, 0.3, 0.0), "any": (0.2, -0.15, 0.5)}


def rotation(turn: Any) -> np.ndarray:
    """Matrix of a rotation vector."""
    turn = np.asarray(turn, float)
    angle = float(np.linalg.norm(turn))
    axis = turn / angle if angle else turn
    return _validate.rotation_matrices(np.append(np.sin(angle / 2) * axis, np.cos(angle / 2))[None])[0]


def quaternion(turn: Any) -> list[float]:
    turn = np.asarray(turn, float)
    angle = float(np.linalg.norm(turn))
    return [*(np.sin(angle / 2) * turn / angle), float(np.cos(angle / 2))] if angle else [0.0, 0.0, 0.0, 1.0]


def plate(n: int, half: float = 2.0) -> gs.Mesh:
    """A square at z = 0, of n x n squares of two triangles."""
    x = np.linspace(-half, half, n + 1)
    at = np.arange((n + 1) ** 2).reshape(n + 1, n + 1)
    low, right, up, both = at[:-1, :-1].ravel(), at[1:, :-1].ravel(), at[:-1, 1:].ravel(), at[1:, 1:].ravel()
    faces = np.concatenate([np.stack([low, right, both], axis=1), np.stack([low, both, up], axis=1)])
    return gs.Mesh([(a, b, 0.0) for a in x for b in x], faces)


class Landing:
    """A mesh that is at T as given, turned about a point that is then at `center`; all in a frame of its own."""

    def __init__(
        self,
        landed: gs.Mesh,
        spin: Any,
        center: Any,
        frame: np.ndarray | None = None,
        origin: Any = (0, 0, 0),
        fall: Any = FALL,
    ) -> None:
        self.frame, self.origin = np.eye(3) if frame is None else frame, np.asarray(origin, float)
        self.spin, self.fall = self.frame @ np.asarray(spin, float), self.frame @ fall
        self.center = self.world(np.asarray(center, float)) - T * self.fall
        self.back = rotation(-T * self.spin)
        self.mesh = gs.Mesh(self.earlier(self.world(landed.vertices)), landed.triangles)

    def world(self, points: np.ndarray) -> np.ndarray:
        return points @ self.frame.T + self.origin

    def earlier(self, points: np.ndarray) -> np.ndarray:
        return (points - (self.center + T * self.fall)) @ self.back.T + self.center

    def onto(self, other: Any, **more: Any) -> gs.FirstContacts:
        return gs.first_contact(
            self.mesh,
            other,
            self.fall,
            (0, 0, 0),
            angular_velocity_a=self.spin,
            center_a=self.center,
            t_max=3.0,
            **more,
        )

    def floor(self, mesh: gs.Mesh) -> gs.Mesh:
        return gs.Mesh(self.world(mesh.vertices), mesh.triangles)

    def slab(self, half: float = 3.0) -> gs.Boxes:
        return gs.Boxes(self.world(np.array([[0, 0, -half]])), self.frame.T[None], [[half, half, half]])


def far(found: np.ndarray, expected: Any) -> float:
    """How far a point of one is from the nearest of the other, at most."""
    gaps = np.linalg.norm(np.asarray(found)[:, None] - np.asarray(expected, float)[None], axis=2)
    return float(max(gaps.min(axis=0).max(), gaps.min(axis=1).max()))


def same(parts: list[np.ndarray], expected: list[Any], near: float = NEAR) -> bool:
    """The same parts, in whatever order, with as many points."""
    if sorted(map(len, parts)) != sorted(map(len, expected)):
        return False
    left = list(expected)
    for part in parts:
        k = next((i for i, x in enumerate(left) if len(x) == len(part) and far(part, x) <= near), None)
        if k is None:
            return False
        del left[k]
    return True


CUBE = box_mesh((-0.5, -0.4, 0.0), (0.5, 0.4, 0.6))
SOLE = [(x, y, 0.0) for x in (-0.5, 0.5) for y in (-0.4, 0.4)]
EDGE = [(0.0, -0.4, 0.0), (0.0, 0.4, 0.0)]


def on_edge(mesh: gs.Mesh) -> gs.Mesh:
    """The cube on the middle of its lower left edge, leaning by 0.5 rad."""
    lean = rotation((0, 0.5, 0))
    return gs.Mesh((mesh.vertices - [0.5, 0, 0]) @ lean.T, mesh.triangles)


@pytest.mark.parametrize("spin", SPINS)
@pytest.mark.parametrize("n", [1, 4, 5, 12])
def test_a_cube_lands_flat(n: int, spin: str) -> None:
    """On floors of which seams are along its edges, or are not: one polygon, that of the box on a slab."""
    for k, (frame, origin) in enumerate([(np.eye(3), (0, 0, 0)), (rotation((0.4, 1.1, -0.7)), (3.0, -5.0, 2.0))]):
        landing = Landing(CUBE, SPINS[spin], (0.1, 0.0, 0.3), frame, origin)
        box = gs.Polytopes(landing.mesh.vertices, [0, 8])
        as_box = gs.first_contact(
            box,
            landing.slab(),
            landing.fall,
            (0, 0, 0),
            angular_velocity_a=landing.spin,
            center_a=landing.center,
            t_max=3.0,
        )
        for floor in (landing.floor(plate(n)), landing.slab()):
            answer = landing.onto(floor)
            told = f"frame {k}: {answer.parts(0)}"
            assert answer.status.tolist() == [gs.WILL_TOUCH] and abs(answer.time[0] - T) < TIME_TOLERANCE
            assert same(answer.parts(0), [landing.world(np.array(SOLE))]), told
            assert far(answer.points, as_box.points) <= NEAR, told


@pytest.mark.parametrize("n", [1, 5, 12])
def test_an_edge_lands(n: int) -> None:
    for spin in ((0.0, 0.3, 0.0), (0.0, 0.0, 0.7)):
        landing = Landing(on_edge(CUBE), spin, (0.1, 0.0, 0.3), rotation((0.4, 1.1, -0.7)), (3.0, -5.0, 2.0))
        for floor in (landing.floor(plate(n)), landing.slab()):
            parts = landing.onto(floor).parts(0)
            assert same(parts, [landing.world(np.array(EDGE))]), parts


def test_a_corner_lands() -> None:
    tip = gs.Mesh((CUBE.vertices - CUBE.vertices[0]) @ rotation((0.7, -0.6, 0.2)).T, CUBE.triangles)
    tip = gs.Mesh(tip.vertices - tip.vertices[np.argmin(tip.vertices[:, 2])], tip.triangles)
    landing = Landing(tip, SPINS["any"], (0.1, 0.0, 0.3))
    for n in (1, 4, 5):  # in a triangle, at a vertex of the floor, on a seam
        assert same(landing.onto(plate(n)).parts(0), [[(0.0, 0.0, 0.0)]])


def feet() -> tuple[gs.Mesh, list[Any]]:
    """A table on a wide and a narrow foot."""
    parts = [((-1, -0.4, 0.3), (1, 0.4, 0.5)), ((-1, -0.4, 0), (-0.5, 0.4, 0.3)), ((0.8, -0.4, 0), (1, 0.4, 0.3))]
    soles = [[(x, y, 0.0) for x in (low[0], high[0]) for y in (-0.4, 0.4)] for low, high in parts[1:]]
    return joined(*(box_mesh(np.array(low, float), np.array(high, float)) for low, high in parts)), soles


@pytest.mark.parametrize("spin", SPINS)
def test_two_feet_are_two_parts(spin: str) -> None:
    table, soles = feet()
    for n in (1, 5):
        landing = Landing(table, SPINS[spin], (0.1, 0.0, 0.3), rotation((0.4, 1.1, -0.7)), (3.0, -5.0, 2.0))
        for floor in (landing.floor(plate(n)), landing.slab()):
            answer = landing.onto(floor)
            assert same(answer.parts(0), [landing.world(np.array(sole)) for sole in soles]), answer.parts(0)
            assert len(answer.part_offsets) == 3


def test_a_frame_lands_with_its_hole() -> None:
    """Four bars that adjoin: a ring, and one around the hole."""
    bars = [
        ((-1, -1, 0), (1, -0.5, 1)),
        ((-1, 0.5, 0), (1, 1, 1)),
        ((-1, -0.5, 0), (-0.5, 0.5, 1)),
        ((0.5, -0.5, 0), (1, 0.5, 1)),
    ]
    frame = joined(*(box_mesh(np.array(low, float), np.array(high, float)) for low, high in bars))
    landing = Landing(frame, SPINS["upright"], (0, 0, 0.5))
    rings = [[(x, y, 0.0) for x in (-s, s) for y in (-s, s)] for s in (1.0, 0.5)]
    assert same(landing.onto(plate(3)).parts(0), rings)


def test_on_a_step_two_planes_touch() -> None:
    """A block comes down in an inner corner: on the floor, and along the wall."""
    step = joined(box_mesh((-2, -2, -1), (0.5, 2, 0)), box_mesh((0.5, -2, -1), (2, 2, 1)))
    wall = [(0.5, y, z) for y in (-0.4, 0.4) for z in (0.0, 0.6)]
    # Both turn as one about a common centre: seen from one another they translate.
    turned = Landing(CUBE, SPINS["any"], (0, 0, 0), fall=np.array([1.0, 0.0, -1.0]))
    back = gs.Mesh(step.vertices @ turned.back.T, step.triangles)
    answer = turned.onto(back, angular_velocity_b=SPINS["any"], center_b=(0, 0, 0))
    assert abs(answer.time[0] - T) < TIME_TOLERANCE and same(answer.parts(0), [SOLE, wall]), answer.parts(0)


def test_what_touches_at_the_start_is_what_meshes_at_rest_share() -> None:
    table, _ = feet()
    for body in (CUBE, table, on_edge(CUBE), gs.Mesh(CUBE.vertices - [0, 0, 0.2], CUBE.triangles)):
        rest = gs.first_contact(body, plate(5), (0, 0, 0), (0, 0, 0))
        spun = gs.first_contact(body, plate(5), (0, 0, 0), (0, 0, 0), angular_velocity_a=(0, 0, 1.0))
        assert spun.status[0] in (ContactStatus.TOUCHING, ContactStatus.OVERLAPPING)
        assert same(spun.parts(0), rest.parts(0), AT_REST), (spun.parts(0), rest.parts(0))


def test_too_many_are_told_as_one_point(monkeypatch: pytest.MonkeyPatch) -> None:
    landing = Landing(CUBE, SPINS["upright"], (0, 0, 0.3))
    whole = landing.onto(plate(12))
    monkeypatch.setattr(mesh_shared, "MOST_SHARED", 16)
    answer = landing.onto(plate(12))
    assert len(answer.points) < 4 + 1 and len(answer.parts(0)) == 1
    for name in ("status", "time_lower", "time_upper", "normal"):
        assert np.array_equal(getattr(answer, name), getattr(whole, name)), name
    assert abs(answer.points[:, 2]).max() <= NEAR and (np.abs(answer.points[:, :2]) <= [0.5 + NEAR, 0.4 + NEAR]).all()


def test_without_contact_set_the_rest_keeps_its_bits() -> None:
    landing = Landing(CUBE, SPINS["any"], (0, 0, 0.3))
    whole, bare = landing.onto(plate(5)), landing.onto(plate(5), contact_set=False)
    assert len(bare.points) == 0 and bare.point_offsets.tolist() == [0, 0]
    for name in ("status", "time", "time_lower", "time_upper", "normal", "closing_speed", "certain"):
        assert np.array_equal(getattr(whole, name), getattr(bare, name)), name


# Scenes.


def landed(landing: Landing, shape: Any, **more: Any) -> gs.SceneObject:
    """A shape that is at the origin at T."""
    pose = [*landing.earlier(np.zeros((1, 3)))[0], *quaternion(-T * landing.spin)]
    twist = [*landing.fall, *landing.spin]
    return gs.SceneObject("body", shape, pose, twist, **more)


def parts_of(answer: Any, k: int = 0) -> list[np.ndarray]:
    ends = answer.part_offsets
    low, high = answer.point_offsets[k : k + 2]
    return [answer.points[i:j] for i, j in zip(ends[:-1], ends[1:], strict=True) if low <= i < high]


@pytest.mark.parametrize("margin", [0.0, 0.05])
@pytest.mark.parametrize("uncertainty", [0.0, 0.01])
def test_scenes(margin: float, uncertainty: float) -> None:
    """On meshes and boxes, also not exactly known, and up to a distance: midway."""
    table, soles = feet()
    up = np.array([0.0, 0.0, margin])
    for shape, expected in ((CUBE, [SOLE]), (table, soles), (on_edge(CUBE), [EDGE])):
        landing = Landing(shape, SPINS["upright"], (0, 0, 0))
        body = landed(landing, gs.Mesh(shape.vertices + up, shape.triangles), uncertainty=uncertainty)
        slab = gs.SceneObject("slab", gs.Box([3, 3, 3]), [0, 0, -3, 0, 0, 0, 1])
        for floor in (gs.SceneObject("floor", plate(5)), slab):
            scene = scene_of([body, floor])
            answer = scene.first_contacts(3.0, margin=margin)
            assert abs(answer.time[0] - T) <= LANDED and answer.status.tolist() == [gs.WILL_TOUCH]
            midway = [np.array(part) + up / 2 for part in expected]
            room = NEAR + 4.0 * np.sqrt(margin * TIME_TOLERANCE)
            assert same(parts_of(answer), midway, room), parts_of(answer)
            bare = scene.first_contacts(3.0, margin=margin, contact_set=False)
            for name in ("status", "time", "time_lower", "time_upper", "normal"):
                assert np.array_equal(getattr(answer, name), getattr(bare, name)), name
            assert len(bare.points) == 0


def test_on_half_spaces() -> None:
    """Also on one that rises and leans, and to a margin."""
    table, soles = feet()
    for margin in (0.0, 0.05):
        for shape, expected in ((CUBE, [SOLE]), (table, soles), (on_edge(CUBE), [EDGE])):
            for spin in SPINS.values():
                landing = Landing(shape, spin, (0, 0, 0))
                body = landed(landing, gs.Mesh(shape.vertices + [0, 0, margin], shape.triangles))
                ground = gs.SceneObject(
                    "ground", gs.HalfSpace((0, 0, 1), -0.5), [0, 0, 0.3, 0, 0, 0, 1], [0, 0, 0.2, 0, 0, 0]
                )
                answer = scene_of([body, ground]).first_contacts(3.0, margin=margin)
                assert answer.status.tolist() == [gs.WILL_TOUCH] and abs(answer.time[0] - T) <= LANDED
                found = parts_of(answer)
                assert same(found, [np.array(part) + [0, 0, margin / 2] for part in expected]), found


def groove(n: int) -> gs.Mesh:
    """Two planes that rise at 45 degrees from the y axis, in strips of n x n squares."""
    flat = plate(n)
    return gs.Mesh(np.column_stack([flat.vertices[:, :2], np.abs(flat.vertices[:, 0])]), flat.triangles)


@pytest.mark.parametrize("n", [2, 6, 40])
@pytest.mark.parametrize("name", ["sphere", "ellipsoid", "cone", "cylinder", "capsule"])
def test_round_bodies_touch_in_as_many_places_as_there_are(n: int, name: str) -> None:
    """One place on a floor, however fine, and two in a groove; the ends of a capsule that lies."""
    r = 0.3
    lying = [np.sqrt(0.5), 0, 0, np.sqrt(0.5)]  # along y
    shape, pose = {
        "sphere": (gs.Sphere(r), [0, 0, 0, 1]),
        "ellipsoid": (gs.Ellipsoid((r, 0.2, r)), [0, 0, 0, 1]),
        "cone": (gs.Cone(0.2, 0.6), [1.0, 0, 0, 0]),
        "cylinder": (gs.Cylinder(r, 1.0), lying),
        "capsule": (gs.Capsule(r, 1.0), lying),
    }[name]
    deep = np.sqrt(2.0) * r
    for floor, height in ((plate(n), r), (groove(n), deep)):
        if name == "cone" and floor is not None and height == deep:
            continue
        for spin in ((0, 0, 0.01), (0, 0, 0)):
            mesh = gs.SceneObject("floor", floor, [0.03, 0.04, 0, 0, 0, 0, 1])
            start = [0.03, 0.04, height + 1.0, *pose]
            body = gs.SceneObject(
                "body", shape, start, [0, 0, -1.0, *(spin if name in ("sphere", "ellipsoid") else (0, 0, 0))]
            )
            answer = scene_of([mesh, body]).first_contacts(3.0)
            assert answer.status.tolist() == [gs.WILL_TOUCH] and abs(answer.time[0] - 1.0) < LANDED
            found = parts_of(answer)
            wanted = 1 if height == r else 2
            assert len(found) == wanted, found
            x = [0.03] if wanted == 1 else [0.03 - deep / 2, 0.03 + deep / 2]
            z = [0.0] if wanted == 1 else [deep / 2, deep / 2]
            for part, at in zip(sorted(found, key=lambda p: p[0, 0]), zip(x, z, strict=True), strict=True):
                assert len(part) == (2 if name == "capsule" else 1)
                assert np.abs(part[:, [0, 2]] - at).max() < 5e-3
                if name == "capsule":
                    assert np.abs(np.sort(part[:, 1]) - [-0.46, 0.54]).max() < 5e-3


def test_a_cylinder_on_two_posts() -> None:
    posts = joined(box_mesh((-0.5, -0.4, -1), (0.5, -0.3, 0)), box_mesh((-0.5, 0.2, -1), (0.5, 0.3, 0)))
    lying = [np.sqrt(0.5), 0, 0, np.sqrt(0.5)]
    for name, shape in (("cylinder", gs.Cylinder(0.3, 1.0)), ("capsule", gs.Capsule(0.3, 1.0))):
        items = [gs.SceneObject("posts", posts), gs.SceneObject("o", shape, [0, 0, 1.3, *lying], [0, 0, -1, 0, 0, 0])]
        found = sorted(parts_of(scene_of(items).first_contacts(3.0)), key=lambda part: part[0, 1])
        assert len(found) == 2, found
        for part, (low, high) in zip(found, ((-0.4, -0.3), (0.2, 0.3)), strict=True):
            assert np.abs(part[:, [0, 2]]).max() < 5e-3 and (part[:, 1] >= low - NEAR).all()
            assert (part[:, 1] <= high + NEAR).all() and len(part) == (2 if name == "capsule" else 1)


@pytest.mark.parametrize("lean", [0.0, 0.3, 0.9])
def test_a_capsule_lies_down_over_the_end_of_a_beam(lean: float) -> None:
    """Also where that leans: on a box, and on the same as a mesh."""
    turned = quaternion((0, lean, 0))
    frame = rotation((0, lean, 0))
    half = np.array([0.6, 0.2, 0.1])
    along = [0, np.sin((lean + np.pi / 2) / 2), 0, np.cos((lean + np.pi / 2) / 2)]  # axis along the beam's x
    at = frame @ [0.35, 0.0, 0.1 + 0.3]
    for shape in (gs.Box(half), box_mesh(-half, half)):
        beam = gs.SceneObject("beam", shape, [0, 0, 0, *turned])
        body = gs.SceneObject("body", gs.Capsule(0.3, 1.0), [*(at + [0, 0, 1.0]), *along], [0, 0, -1, 0, 0, 0])
        answer = scene_of([beam, body]).first_contacts(3.0)
        expected = np.array([(-0.15, 0, 0.1), (0.6, 0, 0.1)]) @ frame.T
        assert abs(answer.time[0] - 1.0) < LANDED and far(answer.points, expected) < 5e-3, answer.points


@pytest.mark.parametrize("pieces", ["mesh on mesh", "mesh on hull", "hull on mesh"])
@pytest.mark.parametrize("size", [2.0**-20, 1.0, 2.0**20])
def test_what_hulls_share_exactly_their_meshes_share(rng: np.random.Generator, size: float, pieces: str) -> None:
    """Laid on one another in rational numbers, and turned back by the oracle; facets are cut in parts."""

    def body(points: np.ndarray, kind: str) -> Any:
        return facets(points, 2) if kind == "mesh" else gs.Polytopes(points, [0, len(points)])

    for dimensions in ((2, 2), (1, 2), (2, 1), (1, 1), (0, 2), (2, 0)):
        for _ in range(3):
            laid = Laid(rng, dimensions, size)
            p = laid.pair
            how: dict[str, Any] = {
                f"{what}_{x}": p[key + x] for what, key in (("angular_velocity", "w"), ("center", "c")) for x in "ab"
            }
            sides = (body(p[x], kind) for x, kind in zip("ab", pieces.split(" on "), strict=True))
            answer = gs.first_contact(*sides, p["va"], p["vb"], t_max=2.0, **how)
            band = way(p, answer) + ROUNDED * size
            told = reproducer(**p) + f"\n{answer.parts(0)}\n{laid.expected}"
            assert [len(part) for part in answer.parts(0)] == [len(laid.expected)], told
            assert far(answer.points, laid.expected) <= 32 * band, told


def facets(points: np.ndarray, cuts: int) -> gs.Mesh:
    """The surface of a hull, triangles cut at their middles."""
    corners = points[hull_triangles(points)]
    for _ in range(cuts):
        middle = corners.mean(axis=1)
        corners = np.concatenate([np.stack([corners[:, i], corners[:, (i + 1) % 3], middle], axis=1) for i in range(3)])
    vertices, names = np.unique(corners.reshape(-1, 3), axis=0, return_inverse=True)
    return gs.Mesh(vertices, names.reshape(-1, 3))


def test_parts_that_are_far_apart_are_not_held_against_each_other(rng: np.random.Generator) -> None:
    """Thousands of points, segments and triangles in as many planes: all are left, in little time."""
    n = 3000
    middles = 100.0 * rng.permutation(4 * n)[: 2 * n, None] + np.zeros(3)
    segments = list(middles[:n, None] + rng.normal(size=(n, 2, 3)))
    triangles = list(middles[n:, None] + rng.normal(size=(n, 3, 3)))
    points = [part[:1] + 20.0 for part in segments]
    began = time.perf_counter()
    parts = united_in_space([*points, *segments, *triangles], 1e-9, np.full(3, np.nan))
    assert time.perf_counter() - began < 20.0  # and not minutes
    assert sorted(map(len, parts)) == [1] * n + [2] * n + [3] * n


@pytest.mark.parametrize("margin", [0.0, 0.1])
def test_a_convex_mesh_shares_what_its_hull_does(rng: np.random.Generator, margin: float) -> None:
    """In scenes, in whatever way they meet: a point, mostly; beside a round body it is known to some square root."""
    seen: Counter[str] = Counter()
    for _ in range(12):
        shapes = others(rng)
        for name in ("box", "hull", "frustum", "sphere", "capsule", "ellipsoid", "half space", "mesh"):
            shape = gs.Convex(shapes["mesh"].vertices) if name == "mesh" else shapes[name]
            points = rng.normal(size=(8, 3)) * 0.4
            mesh, other = moving(rng, "m", facets(points, 1)), moving(rng, "o", shape)
            hull = gs.SceneObject("m", gs.Convex(points), mesh.pose, mesh.twist)
            whole, wanted = (scene_of([body, other]).first_contacts(3.0, margin=margin) for body in (mesh, hull))
            if not all(len(x) and x.status[0] == gs.WILL_TOUCH for x in (whole, wanted)):
                continue
            seen[name] += 1
            assert [len(part) for part in parts_of(whole)] == [len(wanted.points)], f"{name}: {parts_of(whole)}"
            assert far(whole.points, wanted.points) < 2e-3, f"{name}: {whole.points} {wanted.points}"
    assert len(seen) == 8 and sum(seen.values()) > 40, seen
