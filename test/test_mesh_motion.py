# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""Meshes that translate: the first of all contacts of triangles, and what the whole surfaces share, exactly judged."""

from __future__ import annotations

import math
import tracemalloc
from collections import Counter
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from contact_answers import STATUS
from oracle.mesh import MeshContact, contact_of_meshes
from oracle.polytope import box_corners
from oracle.vectors import nearest_double
from polytope_scenes import Turn, random_body

import geomsrv as gs
from geomsrv.answers import ContactStatus
from geomsrv.robot import Robot, example_robot_directory

ASKED = 1e-9  # how narrow a time interval is asked for where meshes turn [s]
DEFAULT = 1e-6  # and by default; a closing speed of about 1 m/s changes by less than ten times that in that time
PLACED = 1e-12  # time that bodies of ten metres need for what they are placed wrong by, at half a metre a second [s]

QUADS = [
    (0, 2, 3, 1),
    (4, 5, 7, 6),
    (0, 1, 5, 4),
    (2, 6, 7, 3),
    (0, 4, 6, 2),
    (1, 3, 7, 5),
]  # of a box, by bits of x y z


def box_mesh(low: Any, high: Any) -> gs.Mesh:
    """Twelve triangles."""
    corners = [[(low, high)[i >> k & 1][k] for k in range(3)] for i in range(8)]
    return gs.Mesh(corners, [t for a, b, c, d in QUADS for t in ((a, b, c), (a, c, d))])


def joined(*meshes: gs.Mesh) -> gs.Mesh:
    offsets = np.cumsum([0, *(len(m.vertices) for m in meshes)])
    return gs.Mesh(
        np.concatenate([m.vertices for m in meshes]),
        np.concatenate([m.triangles + k for m, k in zip(meshes, offsets[:-1], strict=True)]),
    )


def at(mesh: gs.Mesh, by: Any) -> gs.Mesh:
    return gs.Mesh(mesh.vertices + by, mesh.triangles)


def pieces_of(body: Any) -> list[Any]:
    if isinstance(body, gs.Mesh):
        return list(body.vertices[body.triangles])
    if isinstance(body, gs.Convex):
        return [body.vertices]
    return (
        [box_corners(body.center[0], body.axes[0], body.half_extents[0])] if isinstance(body, gs.Boxes) else [body[0]]
    )


def judge(
    a: Any, b: Any, v: Any, w: Any, t_max: float = math.inf, slack: float = 0.0
) -> tuple[gs.FirstContacts, MeshContact]:
    """At the exact tier every number is the correctly rounded one."""
    answer = gs.first_contact(a, b, v, w, t_max=t_max, accuracy="exact")
    truth = contact_of_meshes(pieces_of(a), np.asarray(v, float), pieces_of(b), np.asarray(w, float), t_max)
    told = f"{truth.status} {truth.time} {truth.last_time} {truth.sets}\n{answer}"
    assert answer.status[0] == STATUS[truth.status], told
    if truth.time is None:
        assert len(answer.points) == 0 and np.isnan([answer.time[0], answer.last_time[0], *answer.normal[0]]).all()
        assert answer.certain[0]
        return answer, truth
    assert (
        answer.time[0] == nearest_double(truth.time) and answer.time_lower[0] <= truth.time <= answer.time_upper[0]
    ), told
    assert answer.last_time[0] == (math.inf if truth.last_time is None else nearest_double(truth.last_time)), told
    check_set(answer, truth, told, slack)
    return answer, truth


def check_set(answer: gs.FirstContacts, truth: MeshContact, told: str, slack: float) -> None:
    """The same points, nothing twice, and no seam."""
    parts = answer.parts(0)
    corners = {tuple(map(nearest_double, x)) for shared in truth.sets for x in shared}
    assert {tuple(x) for part in parts for x in part.tolist()} <= corners, told
    small = 1e-9 * max(1.0, *(abs(x) for c in corners for x in c))
    pools = [np.array([[float(x) for x in p] for p in shared]) for shared in truth.sets]
    for pool in pools:
        for p in (*pool, pool.mean(axis=0)):
            assert any(covers(part, p, small) for part in areas_first(parts)) or inside_rings(parts, p, small), told
    for k, part in enumerate(parts):
        if len(part) == 2:
            for t in (0.1, 0.35, 0.5, 0.75, 0.9):
                assert any(hull_covers(pool, part[0] + t * (part[1] - part[0]), small) for pool in pools), told
            assert not inside_rings(parts, part.mean(axis=0), small), told
        if len(part) < 3:
            others = [other for j, other in enumerate(parts) if j != k and len(other) == 2]
            assert not any(all(covers(other, p, small) for p in part) for other in others), told
        if len(part) == 2:
            for other in others:
                way = part[1] - part[0]
                off = np.cross(way, other - part[0]) / np.linalg.norm(way)
                assert np.abs(off).max() > small or not any(covers(other, p, small) for p in part), told
    area = sum((ring_area(part) for part in parts if len(part) > 2), np.zeros(3))
    wanted = sum(float(np.linalg.norm(ring_area(order(pool)))) for pool in pools if rank(pool) == 2)
    if (
        len(
            {
                tuple(np.round(np.abs(ring_area(order(p)) / np.linalg.norm(ring_area(order(p)))), 9))
                for p in pools
                if rank(p) == 2
            }
        )
        == 1
    ):
        assert np.linalg.norm(area) == pytest.approx(wanted, rel=1e-9), told
    normal = answer.normal[0]
    if answer.status[0] == gs.OVERLAPPING:
        assert np.isnan(normal).all(), told
    elif not np.isnan(normal[0]):
        assert truth.parts(normal.tolist(), 1e-14 + slack), told
        assert answer.certain[0]


def rank(points: np.ndarray) -> int:
    return int(np.linalg.matrix_rank(points - points[0], tol=1e-9)) if len(points) > 1 else 0


def order(points: np.ndarray) -> np.ndarray:
    """A flat convex set as a ring."""
    arms = points - points.mean(axis=0)
    u, _, v = np.linalg.svd(arms, full_matrices=False)
    return points[np.argsort(np.arctan2(arms @ v[1], arms @ v[0]))]


def ring_area(ring: np.ndarray) -> np.ndarray:
    return 0.5 * np.cross(ring - ring[0], np.roll(ring, -1, axis=0) - ring[0]).sum(axis=0)


def areas_first(parts: list[Any]) -> list[Any]:
    return [part for part in parts if len(part) < 3]


def covers(part: np.ndarray, p: np.ndarray, small: float) -> bool:
    """Whether a point or segment goes through p."""
    way = part[-1] - part[0]
    t = np.clip(way @ (p - part[0]) / max(way @ way, 1e-300), 0, 1)
    return bool(np.abs(part[0] + t * way - p).max() <= small)


def hull_covers(pool: np.ndarray, p: np.ndarray, small: float) -> bool:
    if rank(pool) < 2:
        ends = pool[[np.argmin(pool @ (pool[-1] - pool[0])), np.argmax(pool @ (pool[-1] - pool[0]))]]
        return covers(ends, p, small)
    return inside_rings([order(pool)], p, small)


def inside_rings(parts: list[Any], p: np.ndarray, small: float) -> bool:
    """Whether rings around areas, of holes too, hold p, or go through it."""
    winding = 0.0
    for part in parts:
        if len(part) > 2:
            n = ring_area(part)
            n = n / np.linalg.norm(n)
            if abs((p - part[0]) @ n) > small:
                continue
            arms = part - p
            after = np.roll(arms, -1, axis=0)
            if any(covers(np.array([x, y]), np.zeros(3), small) for x, y in zip(arms, after, strict=True)):
                return True
            n = n * np.sign(n[np.argmax(np.abs(n))])
            winding += np.arctan2(np.cross(arms, after) @ n, (arms * after).sum(axis=1)).sum()
    return abs(winding) > math.pi


def soup(rng: np.random.Generator, count: int) -> gs.Mesh:
    """Triangles on a grid, some of them flat, with corners in common."""
    return gs.Mesh(rng.integers(-2, 3, (count + 2, 3)), [(k, k + 1, k + 2) for k in range(count)])


def test_random_meshes_on_a_grid(rng: np.random.Generator) -> None:
    seen = Counter[str]()
    for k in range(60):
        a = soup(rng, int(rng.integers(2, 5))) if k % 3 else box_mesh(rng.integers(-2, 0, 3), rng.integers(0, 3, 3))
        offset = rng.integers(-4, 5, 3)
        v = np.sign(offset) * rng.integers(0, 3, 3)
        kind = k % 4
        if kind == 0:
            b: Any = at(soup(rng, 2), offset)
        elif kind == 1:
            b = gs.Boxes.from_poses([[*offset, 0, 0, 0, 1]], rng.integers(1, 3, (1, 3)))
        else:
            body = np.array(random_body(rng, 2)) + offset
            b = gs.Polytopes.from_list([body]) if kind == 2 else gs.Convex(body)
        answer, truth = judge(a, b, v, (0, 0, 0), math.inf if k % 5 else 1.0)
        seen[truth.status] += 1
        seen["normal"] += not np.isnan(answer.normal[0, 0])
        for n in (1, 2, 3):
            seen[f"rank {n - 1}"] += any(min(len(part), 3) == n for part in answer.parts(0))
        back = gs.first_contact(b, a, (0, 0, 0), v, t_max=math.inf if k % 5 else 1.0, accuracy="exact")
        for name in ("status", "time", "last_time", "certain"):
            assert np.array_equal(getattr(back, name), getattr(answer, name), equal_nan=True), name
        rough = gs.first_contact(a, b, v, (0, 0, 0), t_max=math.inf if k % 5 else 1.0)
        assert rough.status[0] == answer.status[0] or not rough.certain[0]
    floor = {
        "NEVER": 3,
        "WILL_TOUCH": 5,
        "TOUCHING": 1,
        "OVERLAPPING": 1,
        "rank 0": 3,
        "rank 1": 1,
        "rank 2": 1,
        "normal": 8,
    }
    assert all(seen[name] >= least for name, least in floor.items()), seen


def sets(answer: gs.FirstContacts, scale: float = 1.0) -> list[Any]:
    """Rings from their least corner on, and ends in order."""
    found = []
    for part in answer.parts(0):
        ring = [
            tuple(x) for x in (part / scale if answer.cost.accuracy == "exact" else np.round(part / scale, 12)).tolist()
        ]
        k = ring.index(min(ring))
        found.append(ring[k:] + ring[:k])
    return sorted(found)


@pytest.mark.parametrize("scale", [1.0, 2.0**-900, 2.0**900])
@pytest.mark.parametrize("accuracy", ["float64", "exact"])
def test_soles(scale: float, accuracy: str) -> None:
    """What stands on a table: rings around whole areas, whatever triangles they are made of."""

    def ask(mesh: gs.Mesh, table: Any, v: Any = (0, 0, -1)) -> gs.FirstContacts:
        scaled = gs.Mesh(mesh.vertices * scale, mesh.triangles)
        return gs.first_contact(scaled, table, np.array(v, float) * scale, (0, 0, 0), accuracy=accuracy)

    table = gs.Boxes(np.array([[0, 0, -3]]) * scale, np.eye(3)[None], np.array([[9, 9, 1]]) * scale)
    same = box_mesh((-9 * scale, -9 * scale, -4 * scale), (9 * scale, 9 * scale, -2 * scale))
    for below in (table, same):
        cube = ask(box_mesh((0, 0, 0), (2, 1, 1)), below)
        assert cube.status[0] == gs.WILL_TOUCH and cube.time[0] == 2 and cube.last_time[0] == 5
        assert cube.normal.tolist() == [[0, 0, -1]] and cube.closing_speed[0] == scale and cube.certain[0]
        assert sets(cube, scale) == [[(0, 0, -2), (0, 1, -2), (2, 1, -2), (2, 0, -2)]]
        # Two feet; then an angle, which is not convex; then a frame, with a hole the other way round.
        table_top = box_mesh((0, 0, 2), (4, 1, 3))
        feet = ask(joined(box_mesh((0, 0, 0), (1, 1, 2)), box_mesh((3, 0, 0), (4, 1, 2)), table_top), below)
        assert sets(feet, scale) == [[(x, 0, -2), (x, 1, -2), (x + 1, 1, -2), (x + 1, 0, -2)] for x in (0, 3)]
        angle = ask(joined(box_mesh((0, 0, 0), (3, 1, 1)), box_mesh((0, 1, 0), (1, 3, 1))), below)
        assert sets(angle, scale) == [[(0, 0, -2), (0, 3, -2), (1, 3, -2), (1, 1, -2), (3, 1, -2), (3, 0, -2)]]
        bars = [((0, 0), (4, 1)), ((0, 3), (4, 4)), ((0, 1), (1, 3)), ((3, 1), (4, 3))]
        frame = ask(joined(*(box_mesh((*low, 0), (*high, 1)) for low, high in bars)), below)
        assert sets(frame, scale) == [
            [(0, 0, -2), (0, 4, -2), (4, 4, -2), (4, 0, -2)],
            [(1, 1, -2), (3, 1, -2), (3, 3, -2), (1, 3, -2)],
        ]
        # Two boxes through each other: where they overlap there is no line either.
        plus = ask(joined(box_mesh((1, 0, 0), (2, 3, 1)), box_mesh((0, 1, 0), (3, 2, 1))), below)
        assert len(sets(plus, scale)) == 1 and len(sets(plus, scale)[0]) == 12
    # An edge of two triangles on a face of two: one segment.
    eaves = [(0, 0, 0), (2, 0, 0), (0, 1, 1), (2, 1, 1), (0, -1, 1), (2, -1, 1)]
    ridge = ask(gs.Mesh(eaves, [(0, 1, 2), (1, 3, 2), (1, 0, 4), (5, 1, 4)]), same)
    assert sets(ridge, scale) == [[(0, 0, -2), (2, 0, -2)]] and ridge.normal.tolist() == [[0, 0, -1]]
    # Corner on corner: of the faces' normals that along which they approach fastest.
    for way in ((3, 2, 1), (2, 1, 3), (1, 3, 2)):
        corner = ask(box_mesh((-1, -1, -1), (0, 0, 0)), box_mesh(np.array(way) * scale, np.add(way, 1) * scale), way)
        assert corner.time[0] == 1 and sets(corner, scale) == [[way]]
        assert corner.normal[0].tolist() == [float(x == 3) for x in way] and corner.closing_speed[0] == 3 * scale
    # A corner, obliquely, right onto the diagonal of a face: the face has the only normal.
    spike = gs.Mesh([(0, 0, 0), (1, 0, 2), (0, 1, 2), (-1, -1, 2)], [(0, 1, 2), (0, 2, 3), (0, 3, 1)])
    tip = ask(spike, same, (1, 1, -1))
    assert sets(tip, scale) == [[(2, 2, -2)]] and tip.normal.tolist() == [[0, 0, -1]] and tip.time[0] == 2


def test_inner_corners_leave_no_normal() -> None:
    """Three walls at once; and the inside of a mesh is no part of it."""
    walls = gs.Mesh(
        [(0, 0, 0), (4, 0, 0), (4, 4, 0), (0, 4, 0), (0, 0, 4), (4, 0, 4), (0, 4, 4)],
        [(0, 1, 2), (0, 2, 3), (0, 1, 5), (0, 5, 4), (0, 4, 6), (0, 6, 3)],
    )
    answer, _ = judge(box_mesh((1, 1, 1), (3, 3, 3)), walls, (-1, -1, -1), (0, 0, 0))
    assert (
        answer.time[0] == 1 and np.isnan(answer.normal).all() and [len(part) for part in answer.parts(0)] == [4, 4, 4]
    )
    room = box_mesh((0, 0, 0), (9, 9, 9))
    block = gs.Boxes.from_poses([[3, 3, 3, 0, 0, 0, 1]], [[1, 1, 1]])
    answer, _ = judge(block, room, (1, 0, 0), (0, 0, 0))
    assert answer.status[0] == gs.WILL_TOUCH and answer.time[0] == 5 and answer.last_time[0] == 7
    assert sets(answer) == [[(9, 2, 2), (9, 4, 2), (9, 4, 4), (9, 2, 4)]]
    assert gs.first_contact(block, room, (0, 0, 0), (0, 0, 0)).status[0] == gs.NEVER


def test_one_ulp_and_degenerate_triangles() -> None:
    """A flat triangle is a segment or a point; grazing is decided by one ulp."""
    needles = gs.Mesh([(0, 0, 0), (2, 0, 0), (1, 0, 0), (0, 0, 5)], [(0, 1, 2), (3, 3, 3)])
    wall = box_mesh((4, -1, -1), (5, 1, 6))
    answer, _ = judge(needles, wall, (1, 0, 0), (0, 0, 0))
    assert answer.time[0] == 2 and sets(answer) == [[(4, 0, 0)]] and answer.normal.tolist() == [[1, 0, 0]]
    assert answer.last_time[0] == 5
    high = at(box_mesh((0, -2, 0), (1, 2, 1)), (0, 0, 1))
    for top, status in ((1.0, gs.WILL_TOUCH), (math.nextafter(1.0, 0.0), gs.NEVER)):
        low = box_mesh((4, -1, -1), (5, 1, top))
        answer, _ = judge(high, low, (1, 0, 0), (0, 0, 0))
        assert answer.status[0] == status
        rough = gs.first_contact(high, low, (1, 0, 0), (0, 0, 0))
        assert rough.status[0] == gs.WILL_TOUCH and rough.certain[0] == (status == gs.WILL_TOUCH)
    # Feet of which one is an ulp shorter: in doubt at float64, told apart exactly, though both times round to one.
    feet = joined(box_mesh((0, 0, 1), (1, 1, 2)), box_mesh((3, 0, math.nextafter(1.0, 2.0)), (4, 1, 2)))
    slab = gs.Boxes.from_poses([[2, 0, -10.0, 0, 0, 0, 1]], [[9, 9, 1]])
    answer, truth = judge(feet, slab, (0, 0, -1), (0, 0, 0))
    assert len(answer.parts(0)) == 1 and truth.time == 10
    assert len(gs.first_contact(feet, slab, (0, 0, -1), (0, 0, 0)).parts(0)) == 2


def test_crossing_at_seams_is_in_doubt() -> None:
    """No pair of triangles is more than touching, and no small translation parts the meshes."""
    sheet = gs.Mesh([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)], [(0, 1, 2), (0, 2, 3)])
    blade = gs.Mesh(
        [(-1, -1, -1), (1, 1, -1), (1, 1, 0), (-1, -1, 0), (1, 1, 1), (-1, -1, 1)],
        [(0, 1, 2), (0, 2, 3), (3, 2, 4), (3, 4, 5)],
    )
    upper = gs.Mesh(blade.vertices, blade.triangles[2:])
    answer = gs.first_contact(sheet, blade, (0, 0, 0), (0, 0, 0), accuracy="exact")
    assert answer.status[0] == gs.TOUCHING and not answer.certain[0] and np.isnan(answer.normal).all()
    assert sets(answer) == [[(-1, -1, 0), (1, 1, 0)]]
    above = gs.first_contact(sheet, upper, (0, 0, 0), (0, 0, 0), accuracy="exact")
    assert above.status[0] == gs.TOUCHING and above.certain[0] and above.normal.tolist() == [[0, 0, 1]]


def terrain(rng: np.random.Generator, n: int, turn: Turn) -> gs.Mesh:
    """A height field, turned, n edges wide."""
    x, y = np.meshgrid(np.arange(n + 1.0), np.arange(n + 1.0))
    points = np.column_stack([x.ravel(), y.ravel(), rng.uniform(0, 1, (n + 1) ** 2)])
    corner = (np.arange(n)[:, None] * (n + 1) + np.arange(n)).ravel()
    lower = np.column_stack([corner, corner + 1, corner + n + 2])
    upper = np.column_stack([corner, corner + n + 2, corner + n + 1])
    return gs.Mesh(turn.body(points), np.concatenate([lower, upper]))


@pytest.mark.parametrize("accuracy", ["bound", "float64", "exact"])
def test_no_pair_is_left_out(rng: np.random.Generator, accuracy: str) -> None:
    """The boxes leave out only pairs that do not matter."""
    looked = pairs = 0
    for k in range(12):
        a, b = terrain(rng, 7, Turn(rng, 3.0)), terrain(rng, 6, Turn(rng, 3.0))
        b = at(b, a.vertices.mean(axis=0) - b.vertices.mean(axis=0) + rng.normal(size=3) * 6)
        v = (b.vertices.mean(axis=0) - a.vertices.mean(axis=0)) * 0.5 + rng.normal(size=3) * (k % 3)
        motion: dict[str, Any] = {"t_max": math.inf if k % 4 else 1.5, "accuracy": accuracy}
        whole = gs.first_contact(a, b, v, (0, 0, 0), **motion)
        one, two = (m.vertices[m.triangles] for m in (a, b))
        i, j = np.indices((len(one), len(two))).reshape(2, -1)
        ends = np.arange(0, 3 * len(i) + 1, 3)
        sides = (gs.Polytopes(side.reshape(-1, 3), ends) for side in (one[i], two[j]))
        every = gs.first_contact(*sides, v, (0, 0, 0), contact_set=False, **motion)
        for name, pick in (("time_lower", np.fmin), ("time_upper", np.fmin), ("time", np.fmin), ("last_time", np.fmax)):
            assert np.array_equal(getattr(whole, name)[0], pick.reduce(getattr(every, name)), equal_nan=True), name
        assert (whole.status[0] == gs.NEVER) == (every.status == gs.NEVER).all()
        looked, pairs = looked + whole.cost.counts.get("pairs of pieces", 0), pairs + len(i)
    assert 0 < looked < (0.5 if accuracy == "bound" else 0.3) * pairs


def test_items_and_faults() -> None:
    mesh = box_mesh((0, 0, 0), (1, 1, 1))
    boxes = gs.Boxes.from_poses([[x, 0.5, 0.5, 0, 0, 0, 1] for x in (4, -9, 6)], [1, 1, 1])
    still = (0, 0, 0)
    answer = gs.first_contact(mesh, boxes, [(1, 0, 0)] * 3, still, t_max=3.5)
    assert answer.status.tolist() == [1, 0, 0] and answer.time[0] == 2 and answer.cost.counts["pairs of pieces"] > 0
    quick = gs.first_contact(boxes, mesh, still, (1, 0, 0), contact_set=False)
    assert len(quick.points) == 0 and np.array_equal(quick.normal[:, 0], [-1, np.nan, -1], equal_nan=True)
    hulls = gs.first_contact(gs.Convex(mesh.vertices), gs.Convex(mesh.vertices + (3, 0, 0)), (1, 0, 0), still)
    assert hulls.time.tolist() == [2] and len(hulls.parts(0)[0]) == 4
    square = gs.Polygons.from_list([[(0, 0)]])
    for text, other, v, options in (
        ("b must be Mesh, Boxes, Polytopes or Convex, got Polygons", square, still, {}),
        (r"velocity_a must have shape \(3,\) or \(3, 3\), got \(2, 3\)", boxes, [(1, 0, 0)] * 2, {}),
        ("certificates of a Mesh", mesh, still, {"certificates": True}),
        ("accuracy", mesh, still, {"accuracy": "float32"}),
    ):
        with pytest.raises(gs.GeometryError, match=text):
            gs.first_contact(mesh, other, v, still, **options)


def test_a_gripper_closes_on_a_box() -> None:
    """A robot's own mesh, of which its hull is mostly air."""
    root = example_robot_directory()
    talos = root / "robots" / "talos_data" / "robots" / "talos_left_arm.urdf"
    options: dict[str, Any] = {"mesh_directories": [root.parent, root / "robots"]}
    meshes = {item.id: item.shape for item in Robot(talos, hulls=False, **options).objects({})}
    hulls = {item.id: item.shape for item in Robot(talos, **options).objects({})}
    name = "gripper_left_motor_double_link"
    mesh, hull = meshes[name], hulls[name]
    assert isinstance(mesh, gs.Mesh) and isinstance(hull, gs.Convex)
    low, high = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
    # A wall, straight ahead: the foremost vertices touch first, all at once.
    for axis in range(3):
        front = np.zeros(3)
        front[axis] = 1.0
        wall = gs.Boxes(
            [0.5 * (low + high) * (1 - front) + front], [np.eye(3)], [[2.0, 2.0, 2.0] * (1 - front) + 0.25 * front]
        )
        answer = gs.first_contact(mesh, wall, 0.3 * front, (0, 0, 0), accuracy="exact")
        assert answer.time[0] == nearest_double((Fraction(0.75) - Fraction(high[axis])) / Fraction(0.3))
        foremost = mesh.vertices[mesh.vertices[:, axis] == high[axis]]
        assert {tuple(p) for p in np.delete(answer.points, axis, 1)} <= {tuple(p) for p in np.delete(foremost, axis, 1)}
        assert answer.normal[0].tolist() == front.tolist() and (answer.points[:, axis] == 0.75).all()
    # A small box that goes into it, where the hull is full.
    later = 0
    for way in (*np.eye(3), *-np.eye(3)):
        small = gs.Boxes([0.5 * (low + high) - way], [np.eye(3)], [[1e-3, 1e-3, 1e-3]])
        answer = gs.first_contact(small, mesh, way, (0, 0, 0))
        early = gs.first_contact(small, hull, way, (0, 0, 0))
        triangles = gs.Polytopes(
            mesh.vertices[mesh.triangles].reshape(-1, 3), np.arange(0, 3 * len(mesh.triangles) + 1, 3)
        )
        every = gs.first_contact(small, triangles, way, (0, 0, 0))
        for name, pick in (("time_lower", np.fmin), ("last_time", np.fmax)):
            assert np.array_equal(getattr(answer, name)[0], pick.reduce(getattr(every, name)), equal_nan=True), name
        # It may fly right through.
        later += answer.status[0] == gs.NEVER or bool(early.time[0] < answer.time[0] - 1e-3)
        assert early.status[0] == gs.WILL_TOUCH and not answer.time[0] < early.time[0] - 1e-15
    assert later > 0


def test_turning_meshes_meet_as_their_triangles_do(rng: np.random.Generator) -> None:
    """What is left out comes later; and a box's surface meets first what the box does."""
    seen = Counter[int]()
    looked = pairs = 0
    for k in range(14):
        a, b = terrain(rng, 3, Turn(rng, 2.0)), terrain(rng, 3, Turn(rng, 2.0))
        b = at(b, a.vertices.mean(axis=0) - b.vertices.mean(axis=0) + rng.normal(size=3) * (1 if k == 0 else 6))
        v = (b.vertices.mean(axis=0) - a.vertices.mean(axis=0)) * 0.5 + rng.normal(size=3)
        centers = {"center_a": rng.normal(size=3), "center_b": b.vertices[0]}
        motion: dict[str, Any] = {"t_max": 4.0, "angular_velocity_a": rng.normal(size=3), "tolerance": ASKED, **centers}
        if k % 2:
            motion["angular_velocity_b"] = rng.normal(size=3) * 2
        whole = gs.first_contact(a, b, v, (0, 0, 0), **motion)
        one, two = (m.vertices[m.triangles] for m in (a, b))
        i, j = np.indices((len(one), len(two))).reshape(2, -1)
        ends = np.arange(0, 3 * len(i) + 1, 3)
        sides = [gs.Polytopes(side.reshape(-1, 3), ends) for side in (one[i], two[j])]
        every = gs.first_contact(*sides, v, (0, 0, 0), **motion)
        seen[int(whole.status[0])] += 1
        looked, pairs = looked + whole.cost.counts.get("pairs of pieces", 0), pairs + len(i)
        assert (whole.status[0] == gs.NEVER) == (every.status == gs.NEVER).all()
        if whole.status[0] != gs.NEVER:
            low, high = np.fmin.reduce(every.time_lower), np.fmin.reduce(every.time_upper)
            assert whole.time_lower[0] <= high and low <= whole.time_upper[0] and np.isnan(whole.last_time[0])
            assert whole.time_upper[0] - whole.time_lower[0] <= ASKED
            near = np.flatnonzero(every.time_lower <= high)
            assert any(np.allclose(whole.normal[0], every.normal[n], atol=1e-6, equal_nan=True) for n in near)
    assert seen[gs.NEVER] > 0 and seen[gs.WILL_TOUCH] > 4 and looked < 0.5 * pairs
    bar, post = (
        box_mesh((-2, -0.1, -0.1), (2, 0.1, 0.1)),
        gs.Boxes.from_poses([[1.5, 1, 0, 0, 0, 0, 1]], [[0.1, 0.1, 1]]),
    )
    solid = gs.Boxes.from_poses([[0, 0, 0, 0, 0, 0, 1]], [[2, 0.1, 0.1]])
    for other in (post, box_mesh((1.4, 0.9, -1), (1.6, 1.1, 1)), gs.Convex(post.corners()[0])):
        shell, full = (
            gs.first_contact(x, other, (0, 0, 0), (0, 0, 0), angular_velocity_a=(0, 0, 1))
            for x in (bar, solid if isinstance(other, gs.Boxes) else bar)
        )
        assert abs(shell.time[0] - full.time[0]) < DEFAULT
        assert abs(shell.closing_speed[0] - full.closing_speed[0]) < 10 * DEFAULT
        assert shell.status[0] == gs.WILL_TOUCH and shell.certain[0] and len(shell.parts(0)) == 1
        assert shell.time[0] <= math.atan2(0.9, 1.6) - math.asin(0.1 / math.hypot(0.9, 1.6)) <= shell.time_upper[0]
    with pytest.raises(gs.NotAvailableError, match="accuracy='exact' is not available for bodies that turn"):
        gs.first_contact(bar, post, (0, 0, 0), (0, 0, 0), angular_velocity_a=(0, 0, 1), accuracy="exact")


def test_a_fine_plate_lands_flat() -> None:
    """One square of 1,250 triangles, in memory that grows with them and not with their square."""
    n = 25
    x = np.linspace(-1, 1, n + 1)
    at_ = np.arange((n + 1) ** 2).reshape(n + 1, n + 1)
    low, right, up, both = at_[:-1, :-1].ravel(), at_[1:, :-1].ravel(), at_[:-1, 1:].ravel(), at_[1:, 1:].ravel()
    flat = np.concatenate([np.stack([low, right, both], axis=1), np.stack([low, both, up], axis=1)])
    plate = gs.Mesh([(a, b, 1.0) for a in x for b in x], flat)
    table = gs.Boxes.from_poses([[0, 0, -1, 0, 0, 0, 1]], [[2.0, 2.0, 1.0]])
    tracemalloc.start()
    answer = gs.first_contact(plate, table, (0, 0, -1), (0, 0, 0))
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert answer.time.tolist() == [1.0] and answer.normal.tolist() == [[0, 0, -1]]
    assert sorted(answer.points.tolist()) == [[-1, -1, 0], [-1, 1, 0], [1, -1, 0], [1, 1, 0]]
    assert peak < 100e6, f"{peak / 1e6:.0f} MB"
    bare = gs.first_contact(plate, table, (0, 0, -1), (0, 0, 0), contact_set=False)
    assert len(bare.points) == 0 and (bare.time, bare.normal.tolist()) == (answer.time, answer.normal.tolist())


UPRIGHT = (0.0, 0.0, 0.0, 1.0)


def cell(*items: Any) -> gs.Scene:
    scene = gs.Scene()
    scene.apply(gs.SceneUpdate(add=[gs.SceneObject(*item[:2], pose=item[2], twist=item[3]) for item in items]))
    return scene


@pytest.mark.parametrize("accuracy", ["bound", "float32", "float64", "exact"])
def test_scenes(rng: np.random.Generator, accuracy: str) -> None:
    """A mesh is placed once; from then on its answer is that of `first_contact` for those numbers."""
    turn = (0.0, 0.0, *(np.array([1.0, 1.0]) / math.sqrt(2)))
    frame = joined(*(box_mesh((*low, 0), (*high, 1)) for low, high in [((0, 0), (4, 1)), ((0, 3), (4, 4))]))
    down = (0, 0, -0.5, 0, 0, 0)
    scene = cell(
        ("frame", frame, (0, 0, 2, *turn), down),
        ("table", gs.Box([9, 9, 1]), (0, 0, -1, *UPRIGHT), (0,) * 6),
        ("wedge", gs.Convex([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]), (-3.5, 0, 6, *UPRIGHT), (0, 0, -1, 0, 0, 0)),
        ("other", frame, (0, 0, 9, *UPRIGHT), (0, 0, -1.5, 0, 0, 0)),
        ("spinning", frame, (30, 0, 2, *UPRIGHT), (-3, 0, 0, 0, 0, 1)),
        ("ball", gs.Sphere(0.1), (-2, 2, -3, *UPRIGHT), (0, 0, 1, 0, 0, 0)),
    )
    answer = scene.first_contacts(horizon=20.0, accuracy=accuracy)
    rows = {frozenset(pair): k for k, pair in enumerate(zip(answer.ids_a, answer.ids_b, strict=True))}
    k = rows[frozenset(("frame", "table"))]
    assert answer.status[k] == gs.WILL_TOUCH and answer.cost.counts["narrow box-mesh"] == 2 + (accuracy == "float64")
    assert answer.time_lower[k] <= 4.0 <= answer.time_upper[k] + PLACED
    ends = answer.part_offsets
    parts = [
        answer.points[i:j]
        for i, j in zip(ends[:-1], ends[1:], strict=True)
        if answer.point_offsets[k] <= i < answer.point_offsets[k + 1]
    ]
    if accuracy == "bound":
        assert parts == []
    else:
        sign = 1 if answer.ids_a[k] == "frame" else -1
        assert answer.time[k] == 4 and answer.normal[k].tolist() == [0, 0, -sign] and answer.closing_speed[k] == 0.5
        assert sorted(len(part) for part in parts) == [4, 4] and answer.last_time[k] == 10
        both = rows[frozenset(("frame", "other"))]
        assert answer.time[both] == pytest.approx(6.0, abs=PLACED) and answer.status[both] == gs.WILL_TOUCH
        assert frozenset(("frame", "wedge")) in rows
    reasons = {frozenset((a, b)): reason for a, b, reason in answer.unsupported}
    # What is followed step by step is followed at one tier.
    for pair in (frozenset(("spinning", "table")), frozenset(("ball", "frame"))):
        assert (pair in reasons) == (accuracy != "float64")
    # Together or apart, in whatever order.
    once = scene.first_contacts(horizon=20.0, accuracy=accuracy, earliest=True)
    assert len(once.status) - (once.status == ContactStatus.UNSUPPORTED).sum() == 1


def test_meshes_that_start_in_contact_or_never_meet() -> None:
    cube = box_mesh((0, 0, 0), (1, 1, 1))
    scene = cell(
        ("a", cube, (0, 0, 0, *UPRIGHT), (0,) * 6),
        ("b", cube, (1, 0, 0, *UPRIGHT), (0,) * 6),
        ("c", cube, (0.5, 0.5, 0.5, *UPRIGHT), (0,) * 6),
        ("d", cube, (5, 0, 0, *UPRIGHT), (1, 0, 0, 0, 0, 0)),
    )
    answer = scene.first_contacts(horizon=3.0)
    status = dict(zip(zip(answer.ids_a, answer.ids_b, strict=True), answer.status.tolist(), strict=True))
    assert status == {("a", "b"): gs.TOUCHING, ("a", "c"): gs.OVERLAPPING, ("b", "c"): gs.OVERLAPPING}
    now = scene.first_contacts(horizon=0.0)
    assert now.status.tolist() == answer.status.tolist()
