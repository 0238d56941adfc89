# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""The judge is judged: every oracle reproduces every exact answer of its kinds in data/hard_cases.jsonl."""

from __future__ import annotations

import math
import random
from fractions import Fraction
from itertools import combinations
from typing import Any

import pytest
from conftest import hard_cases
from oracle import frustum_box, moving_polytope, point_frustum, polygon, polytope
from oracle.vectors import (
    add,
    compare_root,
    cross,
    dot,
    exact,
    in_interval,
    nearest_double,
    root_bracket,
    root_double,
    scale,
    squared_norm,
    sub,
)


def by_id(kind: str) -> Any:
    """Parametrise over all cases of a kind."""
    cases = hard_cases(kind)
    return pytest.mark.parametrize("case", cases, ids=[case["id"] for case in cases])


def check_separation(case: dict[str, Any], found: Any) -> None:
    """Squared distance, depth, relation and rounded distance of a resting pair."""
    answer = case["answer"]
    assert found.signed_square == Fraction(answer["sep_sq"])
    assert found.relation == answer["separation"]
    assert found.intersects == answer["intersects"]
    if "sqdist" in answer:
        square = max(found.signed_square, Fraction(0))
        assert square == Fraction(answer["sqdist"])
        assert root_double(square) == float.fromhex(answer["dist"])


@by_id("box_box_distance")
def test_box_box_distance(case: dict[str, Any]) -> None:
    first, second = (
        polytope.box_corners(b["C"], b["A"], b["e"]) for b in (case["input"]["box0"], case["input"]["box1"])
    )
    answer = case["answer"]
    found = polytope.separation(first, second)
    check_separation(case, found)
    assert polytope.contains(first, found.point_a) and polytope.contains(second, found.point_b)
    assert sub(found.point_a, found.point_b) == exact(answer["diff"])
    assert polytope.nearest_set_dimension(first, second) == answer["closest_set_dim"]
    for body, point in ((first, answer["on0"]), (second, answer["on1"])):
        assert polytope.contains(body, exact(point))


@by_id("polygon2d_distance")
def test_polygon_distance(case: dict[str, Any]) -> None:
    p, q = exact(case["input"]["P"]), exact(case["input"]["Q"])
    answer = case["answer"]
    found = polygon.separation(p, q)
    check_separation(case, found)
    assert found.gap == exact(answer["diff"])
    near = polygon.nearest_set(p, q)
    assert polygon.contains(near, exact(answer["on0"]))
    if not found.intersects:
        assert polygon.dimension(near) == answer["closest_set_dim"]


@by_id("polygon2d_moving")
def test_polygon_first_contact(case: dict[str, Any]) -> None:
    given, answer = case["input"], case["answer"]
    found = polygon.first_contact(given["P"], given["velP"], given["Q"], given["velQ"], given["tmax"])
    assert found.hits == answer["hits"]
    assert found.separation_sq == Fraction(answer["sep_sq"])
    if not found.hits:
        assert found.status == polygon.NEVER
        return
    starts = {
        "disjoint": polygon.WILL_TOUCH,
        "touching": polygon.TOUCHING,
        "overlapping": polygon.OVERLAPPING,
    }
    assert found.status == starts[answer["separation"]]
    assert found.time == Fraction(answer["time"])
    assert nearest_double(found.time) == float.fromhex(answer["time_f"])
    assert found.last_time == Fraction(answer["last_time"])
    assert sorted(found.contact) == sorted(exact(answer["contact"]))
    assert polygon.dimension(found.contact) == answer["contact_dim"]
    speed = answer["normal_speed_sq"]
    assert found.normal_speed_sq == (None if speed is None else Fraction(speed))


@by_id("polyhedra_moving")
def test_polytope_first_contact(case: dict[str, Any]) -> None:
    given, answer = case["input"], case["answer"]
    p, q = (given[key]["vertices"] for key in "PQ")
    found = moving_polytope.first_contact(p, given["velP"], q, given["velQ"], given["tmax"])
    assert found.hits == answer["hits"]
    start = (found.separation_sq > 0) - (found.separation_sq < 0)
    assert start == {"disjoint": 1, "touching": 0, "overlapping": -1}[answer["separation"]]
    if not found.hits:
        assert found.status == polygon.NEVER
        return
    assert found.time == Fraction(answer["time"])
    assert found.last_time == Fraction(answer["last_time"])
    assert found.contact == sorted(exact(answer["contact"]))
    assert moving_polytope.dimension(found.contact) == answer["contact_dim"]
    if answer["normal_speed_sq"] is not None and answer["contact_dim"] == 2:
        # Of a smaller contact there are more normals than those of the difference's facets.
        assert found.normal_speed_sq == Fraction(answer["normal_speed_sq"])


def literal_frustum(given: dict[str, Any]) -> tuple[Any, ...]:
    """Arguments of the oracle's frusta from a case's symmetric frustum."""
    left, up = exact(given["l"]), exact(given["u"])
    return given["E"], (given["L"], given["U"], given["D"]), (-left, left, -up, up), given["n"], given["f"]


@by_id("frustum_box")
def test_frustum_box(case: dict[str, Any]) -> None:
    frustum = literal_frustum(case["input"]["frustum"])
    box = tuple(case["input"]["box"][key] for key in ("C", "A", "e"))
    corners, hull = polytope.box_corners(*box), polytope.frustum_corners(*frustum)
    state = frustum_box.state(frustum, box)
    assert (state != frustum_box.OUTSIDE) == case["answer"]["intersects"]
    assert (state == frustum_box.INSIDE) == all(polytope.contains(hull, corner) for corner in corners)
    check_separation(case, polytope.separation(hull, corners))


@by_id("point_frustum")
def test_point_frustum(case: dict[str, Any]) -> None:
    frustum, point, answer = literal_frustum(case["input"]["frustum"]), case["input"]["point"], case["answer"]
    found = point_frustum.nearest(*frustum, point)
    assert found.squared_distance == Fraction(answer["sqdist"])
    assert root_double(found.squared_distance) == float.fromhex(answer["dist"])
    assert found.point == exact(answer["closest"])
    assert found.faces == frozenset(answer["faces"])
    assert polytope.separation(polytope.frustum_corners(*frustum), [exact(point)]).signed_square == Fraction(
        answer["sep_sq"]
    )


# ------------------------------------------------------------------------- answers known without any oracle


def fractions(*values: str | int) -> tuple[Fraction, ...]:
    return tuple(Fraction(value) for value in values)


def camera(left: Any, up: Any, near: Any, far: Any, origin: Any = (0, 0, 0)) -> tuple[Any, ...]:
    """Symmetric frustum along the world's axes."""
    left, up = Fraction(left), Fraction(up)
    return origin, ((1, 0, 0), (0, 1, 0), (0, 0, 1)), (-left, left, -up, up), near, far


@pytest.mark.parametrize(
    ("frustum", "point", "nearest", "faces"),
    [
        # Counterexamples to the printed point-frustum algorithm: the threshold of the corner, ...
        (camera(1, 1, 1, 4), (3, 3, 2), fractions("8/3", "8/3", "8/3"), {"left+", "up+"}),
        # ... the edge projection that leaves the edge, below the near plane and in the slab, ...
        (camera(1, 1, 1, 2), (20, 3, 0), (2, 2, 2), {"left+", "up+", "far"}),
        (camera(1, 1, 1, 2), (20, 3, Fraction(3, 2)), (2, 2, 2), {"left+", "up+", "far"}),
        # ... and a digit 1 printed for l.
        (
            camera("1/3", "1/2", 1, 2),
            fractions("2/3", 1, 1),
            fractions("62/147", "31/49", "62/49"),
            {"left+", "up+"},
        ),
        # Inside, on a face, on an edge, on a corner.
        (camera(1, 1, 1, 4), (0, 0, 2), (0, 0, 2), set()),
        (camera(1, 1, 1, 4), (0, 0, 1), (0, 0, 1), {"near"}),
        (camera(1, 1, 1, 4), (2, -2, 2), (2, -2, 2), {"left+", "up-"}),
        (camera(1, 1, 1, 4), (-4, -4, 4), (-4, -4, 4), {"left-", "up-", "far"}),
    ],
)
def test_point_frustum_by_hand(frustum: Any, point: Any, nearest: Any, faces: set[str]) -> None:
    found = point_frustum.nearest(*frustum, point)
    assert found.point == nearest
    assert found.squared_distance == squared_norm(sub(nearest, point))
    assert found.faces == faces
    assert frustum_box.contains(frustum, point) == (found.squared_distance == 0)


@pytest.mark.parametrize(
    ("left", "point", "nearest", "faces"),
    [
        ("1/2", (1, 1), fractions("3/5", "6/5"), {"left+"}),  # printed with a digit 1 for l, it is "inside"
        (1, (0, -1), (0, 1), {"near"}),
        (1, (-5, 2), (-2, 2), {"left-", "far"}),
        (1, (0, 5), (0, 2), {"far"}),
        (1, (0, Fraction(3, 2)), fractions(0, "3/2"), set()),
    ],
)
def test_point_frustum_2d_by_hand(left: Any, point: Any, nearest: Any, faces: set[str]) -> None:
    half = Fraction(left)
    for hand in (1, -1):  # a mirrored frame is the same trapezoid with left+ and left- exchanged
        found = point_frustum.nearest_2d((0, 0), ((hand, 0), (0, 1)), (-half, half), 1, 2, point)
        swap = {"left+": "left-", "left-": "left+"} if hand < 0 else {}
        assert (found.point, found.faces) == (nearest, {swap.get(face, face) for face in faces})


def test_frustum_box_by_hand() -> None:
    third = Fraction(1, 3)
    tilted = tuple(tuple(third * x for x in row) for row in ((2, 1, -2), (1, 2, 2), (2, -2, 1)))
    upright = ((1, 0, 0), (0, 1, 0), (0, 0, 1))
    # The printed top normal, with the wrong half width in it, says that these two meet.
    apart = (fractions("-11/6", "33/5", "-26/15"), tilted, (4, 5, 1))
    assert frustum_box.state(camera(2, 4, 2, 10, (-3, -3, 1)), apart) == frustum_box.OUTSIDE
    view = camera(1, 1, 1, 10)
    for center, half, state in [
        ((0, 0, 5), 1, frustum_box.INSIDE),
        ((0, 0, 5), 0, frustum_box.INSIDE),
        ((0, 0, 0), 1, frustum_box.INTERSECTS),  # touches the near face
        ((0, 0, 11), 1, frustum_box.INTERSECTS),  # touches the far face
        ((0, 0, 20), 30, frustum_box.INTERSECTS),  # the frustum is inside the box
        ((0, 0, 2), 1, frustum_box.INSIDE),  # touches near and side faces from within
        ((0, 0, -1), 1, frustum_box.OUTSIDE),  # touches the eye, which is not in the frustum
        ((12, 12, 10), 1, frustum_box.OUTSIDE),
        ((11, 11, 10), 1, frustum_box.INTERSECTS),  # corner on the edge left+ up+
        (fractions(11, 11, "8999/1000"), 1, frustum_box.OUTSIDE),
    ]:
        assert frustum_box.state(view, (center, upright, (half,) * 3)) == state, (center, half)
    # Off centre and left handed: the view direction is -x here, the window lies at y 1 to 2, z -3 to -2.
    odd = (0, 0, 0), ((0, 1, 0), (0, 0, 1), (-1, 0, 0)), (1, 2, -3, -2), 1, 2
    assert frustum_box.state(odd, ((Fraction(-3, 2), 2, -3), upright, (0, 0, 0))) == frustum_box.INSIDE
    assert frustum_box.state(odd, ((Fraction(3, 2), 2, -3), upright, (0, 0, 0))) == frustum_box.OUTSIDE


def unit_box(center: Any, half: Any = 1) -> list[Any]:
    return polytope.box_corners(center, ((1, 0, 0), (0, 1, 0), (0, 0, 1)), (half,) * 3)


def test_polytopes_by_hand() -> None:
    cube = unit_box((0, 0, 0))
    assert polytope.hull(cube).dimension == 3 and len(polytope.hull(cube).planes) == 6
    for other, square in [
        (unit_box((5, 0, 0)), 9),
        (unit_box((2, 2, 2)), 0),  # corner on corner
        (unit_box((3, 3, 3)), 3),
        (unit_box((1, 0, 0)), -1),
        (unit_box((0, 0, 0), Fraction(1, 2)), -Fraction(9, 4)),  # contained
        ([(0, 0, 0)], -1),  # a point in the middle of a cube is one deep
        ([(0, 0, 1)], 0),
        ([(0, 0, 2), (2, 0, 0)], 0),  # a segment that grazes an edge
        ([(0, 0, 3), (6, 0, 0)], Fraction(9, 5)),
    ]:
        assert polytope.separation(cube, other).signed_square == square
        assert polytope.separation(other, cube).signed_square == square
    flat = [(0, 0, 0), (2, 0, 0), (0, 2, 0), (0, 0, 0), (1, 1, 0)]
    assert polytope.hull(flat).dimension == 2
    assert polytope.separation(flat, [(1, 0, 0), (1, 1, 0)]).signed_square == 0  # coplanar: no depth
    assert polytope.nearest_set_dimension(cube, unit_box((5, 0, 0))) == 2
    assert polytope.nearest_set_dimension(cube, unit_box((5, 5, 0))) == 1
    assert polytope.nearest_set_dimension(cube, unit_box((5, 5, 5))) == 0


SQUARE = ((0, 0), (1, 0), (1, 1), (0, 1))


def shifted(x: Any, y: Any) -> list[Any]:
    return [(a + x, b + y) for a, b in SQUARE]


@pytest.mark.parametrize(
    ("q", "velocity", "t_max", "status", "time", "last", "contact"),
    [
        (shifted(3, 0), (-1, 0), math.inf, "WILL_TOUCH", 2, 4, [(1, 0), (1, 1)]),
        (shifted(3, 0), (-1, 0), 2, "WILL_TOUCH", 2, 2, [(1, 0), (1, 1)]),
        (shifted(3, 0), (-1, 0), Fraction(199, 100), "NEVER", None, None, []),
        (shifted(3, 1), (-1, 0), math.inf, "WILL_TOUCH", 2, 4, [(1, 1)]),  # slides along
        (shifted(3, 0), (1, 0), math.inf, "NEVER", None, None, []),
        (shifted(3, 0), (0, 0), math.inf, "NEVER", None, None, []),
        (shifted(1, 0), (0, 0), math.inf, "TOUCHING", 0, None, [(1, 0), (1, 1)]),
        (shifted(1, 0), (1, 0), math.inf, "TOUCHING", 0, 0, [(1, 0), (1, 1)]),
        (shifted(Fraction(1, 2), 0), (1, 0), 5, "OVERLAPPING", 0, Fraction(1, 2), None),
        ([(-1, Fraction(1, 2)), (2, Fraction(1, 2))], (0, 1), 5, "OVERLAPPING", 0, Fraction(1, 2), None),
        ([(3, 3), (3, 3)], (-2, -2), math.inf, "WILL_TOUCH", 1, Fraction(3, 2), [(1, 1)]),
    ],
)
def test_first_contact_by_hand(
    q: Any, velocity: Any, t_max: Any, status: str, time: Any, last: Any, contact: Any
) -> None:
    found = polygon.first_contact(SQUARE, (0, 0), q, velocity, t_max)
    assert (found.status, found.time, found.last_time) == (status, time, last)
    if contact is not None:
        assert sorted(found.contact) == contact
    # A common velocity moves the contact and changes nothing else.
    moved = polygon.first_contact(SQUARE, (7, 5), q, (velocity[0] + 7, velocity[1] + 5), t_max)
    assert (moved.status, moved.time, moved.last_time) == (status, time, last)


def test_first_contact_of_the_book_example() -> None:
    """The printed contact set is the point (5, 1); the bodies share a segment."""
    found = polygon.first_contact([(3, 0), (0, 2), (2, 0)], (2, 1), [(-2, -2), (2, -1), (1, -1)], (3, 2), math.inf)
    assert (found.time, sorted(found.contact)) == (1, [(4, 1), (5, 1)])


# ------------------------------------------------------------------------------------- two routes, one answer


def random_points(rng: random.Random, count: int, dimension: int, spread: int) -> list[Any]:
    """Points of a small lattice: parallel edges, touching features and repeats are frequent."""
    return [tuple(Fraction(rng.randint(-spread, spread)) for _ in range(dimension)) for _ in range(count)]


def test_depth_agrees_with_all_candidate_normals() -> None:
    """The facets of a difference have normals among cross products of vertex differences; try every one."""
    rng, relations = random.Random(11), []
    for _ in range(60):
        a, b = random_points(rng, 5, 3, 2), random_points(rng, 4, 3, 2)
        found = polytope.separation(a, b)
        relations.append(found.relation)
        arms = [sub(p, q) for side in (a, b) for p, q in combinations(side, 2) if p != q]
        normals = {n for x, y in combinations(arms, 2) if any(n := cross(x, y))}
        # With a flat difference its arms do not span space, and one of the normals has support 0 both ways.
        depths = []
        for n in normals | {scale(-1, n) for n in normals}:
            room = max(dot(n, p) for p in a) - min(dot(n, q) for q in b)
            depths.append(room * abs(room) / squared_norm(n))
        if found.intersects:
            assert min(depths) == -found.signed_square
        else:
            gap = sub(found.point_b, found.point_a)
            assert max(dot(gap, p) for p in a) - dot(gap, found.point_a) == 0
            assert min(dot(gap, q) for q in b) - dot(gap, found.point_b) == 0
            assert polytope.contains(a, found.point_a) and polytope.contains(b, found.point_b)
    assert all(relations.count(relation) >= 5 for relation in ("disjoint", "touching", "overlapping"))


def test_plane_and_space_agree() -> None:
    """Polygons, and prisms of height 8 over them: same distance, same depth."""
    rng, relations = random.Random(12), []
    for _ in range(60):
        p, q = random_points(rng, rng.randint(1, 5), 2, 3), random_points(rng, rng.randint(1, 5), 2, 3)
        flat = polygon.separation(p, q)
        prisms = [[(*x, z) for x in side for z in (-4, 4)] for side in (p, q)]
        solid = polytope.separation(*prisms)
        assert solid.signed_square == flat.signed_square
        assert flat.intersects == bool(polygon.intersection(p, q))
        relations.append(flat.relation)
    assert all(relations.count(relation) >= 5 for relation in ("disjoint", "touching", "overlapping"))


def test_first_contact_agrees_with_the_static_oracle() -> None:
    """Just before the time the bodies are apart, at it they touch, after the last time they are apart."""
    rng, statuses = random.Random(13), []
    step = Fraction(1, 10**9)
    for _ in range(150):
        p, q = random_points(rng, rng.randint(1, 5), 2, 4), random_points(rng, rng.randint(1, 5), 2, 4)
        velocity = (rng.randint(-2, 2), rng.randint(-2, 2))
        found = polygon.first_contact(p, (0, 0), q, velocity, math.inf)
        statuses.append(found.status)

        def at(t: Any, p: Any = p, q: Any = q, velocity: Any = velocity) -> polygon.Separation:
            return polygon.separation(p, [add(x, scale(t, velocity)) for x in q])

        if found.time is None:
            assert all(not at(Fraction(k, 4)).intersects for k in range(40))
            continue
        assert at(found.time).intersects
        if found.time > 0:
            assert at(found.time).signed_square == 0 and not at(found.time - step).intersects
        if found.last_time is not None:
            assert at(found.last_time).intersects and not at(found.last_time + step).intersects
    counts = {status: statuses.count(status) for status in ("NEVER", "WILL_TOUCH", "TOUCHING", "OVERLAPPING")}
    assert min(counts.values()) >= 5, counts


def test_frustum_box_agrees_with_hulls() -> None:
    """Corner search in the cube against the least-norm point of a difference; skewed frames too."""
    rng, states = random.Random(14), []
    for _ in range(80):
        rows = [random_points(rng, 3, 3, 2) for _ in range(2)]
        if any(dot(r[0], cross(r[1], r[2])) == 0 for r in rows):
            continue
        window = (-rng.randint(0, 2), rng.randint(1, 2), -rng.randint(0, 2), rng.randint(1, 2))
        frustum = random_points(rng, 1, 3, 2)[0], rows[0], window, 1, Fraction(rng.randint(3, 9), 2)
        half = Fraction(1, rng.choice((1, 2, 4, 16)))
        hull = polytope.frustum_corners(*frustum)
        # Half of the boxes sit about the middle of the frustum's diagonal.
        middle = scale(Fraction(1, 2), add(hull[0], hull[7])) if rng.randint(0, 1) else (0, 0, 0)
        center = add(middle, random_points(rng, 1, 3, 1)[0])
        box = center, rows[1], (half, half, half * rng.randint(0, 1))
        corners = polytope.box_corners(*box)
        state = frustum_box.state(frustum, box)
        assert (state != frustum_box.OUTSIDE) == polytope.intersects(hull, corners)
        assert (state == frustum_box.INSIDE) == all(polytope.contains(hull, corner) for corner in corners)
        states.append(state)
        nearest = point_frustum.nearest(*frustum, box[0])
        assert nearest.squared_distance == polytope.squared_distance(hull, [box[0]])
        assert nearest.faces == frustum_box.touching_faces(frustum, nearest.point)
    assert min(states.count(state) for state in ("OUTSIDE", "INTERSECTS", "INSIDE")) >= 3


# --------------------------------------------------------------------------------------------- exact numbers


def test_roots_are_bracketed() -> None:
    for square in (Fraction(0), Fraction(4, 9), Fraction(2), Fraction(1, 3) ** 101, Fraction(7) ** 300):
        lower, upper = root_bracket(square)
        assert lower * lower <= square <= upper * upper
        assert (upper - lower) * 2**127 <= upper
    assert root_bracket(Fraction(4, 9)) == (Fraction(2, 3), Fraction(2, 3))
    assert root_double(2) == math.sqrt(2) and root_double(Fraction(1, 4) ** 1070) == 2.0**-1070
    assert compare_root(math.sqrt(2), 2) == 1 and compare_root(math.nextafter(math.sqrt(2), 0), 2) == -1
    assert compare_root(-1.5, Fraction(-9, 4)) == 0 and compare_root(-math.inf, -9) == -1


def test_intervals_are_closed_and_refuse_nan() -> None:
    root = math.sqrt(2)
    below = math.nextafter(root, 0.0)
    assert in_interval(2, below, root) and in_interval(4, 2.0, 2.0) and in_interval(-4, -2.0, math.inf)
    assert not in_interval(2, root, 2.0) and not in_interval(2, 0.0, below)
    assert not in_interval(2, math.nan, 2.0) and not in_interval(2, 0.0, math.nan)


def test_no_rounding_on_the_way_in() -> None:
    assert exact("0x1.8p+0") == Fraction(3, 2) and exact("2/3") == Fraction(2, 3)
    assert exact([[0.1, "0x1p-1074"], [1]]) == ((Fraction(0.1), Fraction(1, 2**1074)), (1,))
    assert nearest_double(Fraction(10) ** 400) == math.inf
