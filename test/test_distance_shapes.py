# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""Distance of two shapes at relative poses: what is supported and how accurately, named cases, outcomes."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
import pytest
from conftest import reproducer
from distance_scenes import (
    EPS,
    STAGES,
    Tally,
    any_turn,
    core,
    exact_half_space,
    exact_pair,
    in_interval,
    matrix_of,
    ordinary_hull,
    random_turn,
    rotation,
    shape,
    signed_root,
    stages_of_pair,
)
from oracle.vectors import compare_root

import geomsrv as gs
from geomsrv import _core, _validate
from geomsrv.shapes import pack

DEEP = ("penetration",)
IDENTITY = [0.0, 0.0, 0.0, 1.0]

# Worst error [m] of the signed distance for bodies of about 20 cm, 2 mm apart or (boxes and hulls: 0.2 mm) deep, in
# units of 1e-16 m; `None`: no kernel.  Upper triangle: the kernels are symmetric, and both orders are tested.
# The rounding of the poses is part of it: the closed forms are as exact as the poses let them be.
KINDS = ("sphere", "capsule", "box", "convex", "half_space", "cylinder", "cone", "ellipsoid", "mesh", "polygon")
WORST = {
    #             sphere capsule box   convex half_space
    "sphere":     (0.8,  0.8,    0.8,  0.8,   1.4),
    "capsule":    (None, 0.8,    0.8,  0.8,   1.3),
    "box":        (None, None,   0.8,  0.8,   1.4),
    "convex":     (None, None,   None, 0.8,   1.4),
    "half_space": (None, None,   None, None,  0.0),
}  # fmt: skip
SUPPORTED = KINDS[:5]  # those that the exact oracle knows; for the curved ones see test_curved.py
ANSWERED = KINDS[:8]
PAIRS = [pair for pair in itertools.combinations_with_replacement(SUPPORTED, 2) if pair != ("half_space", "half_space")]


# ------------------------------------------------------------------------------------------- what is supported


def one_of(kind: str) -> gs.Shape:
    cube = [[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)]
    return {
        "sphere": gs.Sphere(1.0),
        "capsule": gs.Capsule(0.5, 1.0),
        "box": gs.Box([1, 2, 3]),
        "convex": gs.Convex(cube),
        "half_space": gs.HalfSpace([0, 0, 1], 0.5),
        "cylinder": gs.Cylinder(0.5, 1.0),
        "cone": gs.Cone(0.5, 1.0),
        "ellipsoid": gs.Ellipsoid([1, 2, 3]),
        "mesh": gs.Mesh(cube, [[0, 1, 2]]),
        "polygon": gs.Polygon([[0, 0], [1, 0], [0, 1]]),
    }[kind]


def test_the_table_is_what_the_engine_says() -> None:
    assert _core.shape_kinds() == KINDS
    expected = np.array([[a in ANSWERED and b in ANSWERED for b in KINDS] for a in KINDS])
    assert np.array_equal(_core.supported_pairs(), expected)


@pytest.mark.parametrize(("kind_a", "kind_b"), list(itertools.product(KINDS, KINDS)))
def test_every_pair_answers_or_says_that_it_cannot(kind_a: str, kind_b: str) -> None:
    """No pair gets a plausible number from a kernel that is not there."""
    a, b = one_of(kind_a), one_of(kind_b)
    pose = [0.3, 0.2, 5.0, 0.1, 0.7, 0.1, 0.7]
    for want in ((), DEEP):
        answer = gs.distance(a, b, pose, want=want)
        meet = gs.intersects(a, b, pose)
        if kind_a in ANSWERED and kind_b in ANSWERED:
            assert answer.status[0] == gs.DistanceStatus.OK and answer.message == ""
            assert answer.lower[0] <= answer.distance[0] <= answer.upper[0]
            assert meet.value[0] == (answer.distance[0] <= 0.0) and meet.certain[0]
        else:
            assert answer.status[0] == gs.DistanceStatus.UNSUPPORTED
            assert answer.message == f"distance {kind_a}-{kind_b} is unsupported in this version"
            numbers = (answer.distance, answer.lower, answer.upper, answer.point_a, answer.point_b, answer.normal)
            assert all(np.isnan(x).all() for x in numbers)
            assert not meet.value[0] and not meet.certain[0] and meet.status[0] == gs.DistanceStatus.UNSUPPORTED
            assert answer.cost.counts == {"unsupported": 1}


def test_a_mixed_table_of_shapes(rng: np.random.Generator) -> None:
    """One call for pairs of all kinds, any order, some unsupported: row i is what pair i alone answers."""
    shapes = [one_of(kind) for kind in KINDS]
    pairs = np.array(list(itertools.product(range(len(KINDS)), repeat=2)) * 2)
    poses = np.concatenate([rng.normal(size=(len(pairs), 3)) * 2.0, [random_turn(rng) for _ in pairs]], axis=1)
    for penetration in (False, True):
        batch = _core.distance_pairs(*pack(shapes), pairs, poses, penetration)
        for i, (j, k) in enumerate(pairs):
            alone = _core.distance_pairs(
                *pack([shapes[j], shapes[k]]), np.array([[0, 1]]), poses[i : i + 1].copy(), penetration
            )
            for whole, part in zip(batch[:8], alone[:8], strict=True):
                assert np.array_equal(whole[i], part[0], equal_nan=True), (KINDS[j], KINDS[k])


def test_no_poses() -> None:
    answer = gs.distance(gs.Sphere(1.0), gs.Box([1, 1, 1]), np.zeros((0, 7)))
    assert answer.distance.shape == (0,) and answer.normal.shape == (0, 3)


# --------------------------------------------------------------------------------------------- how accurately


def body(rng: np.random.Generator, kind: str) -> gs.Shape:
    """About 20 cm across, no round numbers."""
    if kind == "sphere":
        return gs.Sphere(0.1 / 3 * rng.uniform(2, 4))
    if kind == "capsule":
        return gs.Capsule(rng.uniform(0.03, 0.06), rng.uniform(0.05, 0.2))
    if kind == "box":
        return gs.Box(rng.uniform(0.04, 0.12, 3))
    if kind == "half_space":
        return gs.HalfSpace(rng.normal(size=3), rng.uniform(-0.1, 0.1))
    return gs.Convex(0.1 * ordinary_hull(rng))


def facets(vertices: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
    """(outward unit normal, a point well inside the facet) of every triangle of a hull in general position."""
    found = []
    for i, j, k in itertools.combinations(range(len(vertices)), 3):
        p, q, r = vertices[[i, j, k]]
        normal = np.cross(q - p, r - p)
        normal /= np.linalg.norm(normal)
        heights = (vertices - p) @ normal
        flat = np.abs(heights) < 1e-9
        if heights.max() < 1e-9 or heights.min() > -1e-9:
            found.append((normal if heights.max() < 1e-9 else -normal, vertices[flat].mean(axis=0)))
    return found


def sharp_vertex(rng: np.random.Generator, vertices: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """A vertex, and a unit direction along which every edge from it falls off by more than 0.25 of its length."""
    while True:
        direction = rng.normal(size=3)
        direction /= np.linalg.norm(direction)
        top = vertices[(vertices @ direction).argmax()]
        edges = np.delete(vertices - top, (vertices @ direction).argmax(), axis=0)
        if (edges @ direction < -0.25 * np.linalg.norm(edges, axis=1)).all():
            return top, direction


def turn_onto(rng: np.random.Generator, source: np.ndarray, target: np.ndarray) -> np.ndarray:
    """A random quaternion that turns unit `source` onto unit `target`, nearly."""
    cross, cosine = np.cross(source, target), float(source @ target)
    turn = np.append(cross, 1.0 + cosine)
    spin = np.append(target * np.sin(angle := rng.uniform(0, np.pi)), np.cos(angle))
    return multiply(spin, turn / np.linalg.norm(turn))


def multiply(p: np.ndarray, q: np.ndarray) -> np.ndarray:
    product = np.append(p[3] * q[:3] + q[3] * p[:3] + np.cross(p[:3], q[:3]), p[3] * q[3] - p[:3] @ q[:3])
    return product / np.linalg.norm(product)


def touching(rng: np.random.Generator, a: gs.Shape, b: gs.Shape) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Pose of b at which the bodies touch in one point, that point, and the normal there from a to b.

    Where both are polytopes a face of a meets a vertex of b, so that the normal is the way out as well.
    """
    if isinstance(a, gs.HalfSpace):
        turn = random_turn(rng)
        return place(b, turn, a.normal, a.offset * a.normal + 0.1 * np.cross(a.normal, rng.normal(size=3)))
    if isinstance(b, gs.HalfSpace):
        turn = random_turn(rng)
        up = rotation(turn) @ b.normal
        contact = lowest(a, np.eye(3), up)
        side = 0.1 * np.cross(up, rng.normal(size=3))
        return np.concatenate([contact - up * b.offset + side, turn]), contact, -up
    (vertices_a, radius_a), (vertices_b, radius_b) = core(a), core(b)
    if radius_a + radius_b > 0.0:
        normal = rng.normal(size=3)
        normal /= np.linalg.norm(normal)
        return place(b, random_turn(rng), normal, lowest(a, np.eye(3), -normal))
    choices = facets(np.array(vertices_a))
    normal, contact = choices[rng.integers(len(choices))]
    vertex, direction = sharp_vertex(rng, np.array(vertices_b))
    turn = turn_onto(rng, direction, -normal)
    return np.concatenate([contact - rotation(turn) @ vertex, turn]), contact, normal


def lowest(shape: gs.Shape, matrix: np.ndarray, up: np.ndarray) -> np.ndarray:
    """The point of the shape, turned by `matrix`, that is lowest along `up`."""
    vertices, radius = core(shape)
    turned = np.array(vertices) @ matrix.T
    return turned[(turned @ up).argmin()] - radius * up


def place(b: gs.Shape, turn: np.ndarray, normal: np.ndarray, contact: np.ndarray) -> tuple[np.ndarray, ...]:
    return np.concatenate([contact - lowest(b, rotation(turn), normal), turn]), contact, normal


def worst_errors(kind_a: str, kind_b: str, rng: np.random.Generator) -> tuple[float, float, float]:
    """Of distance [m], normal [rad], points [m], over touching poses moved apart and together along the normal."""
    worst = np.zeros(3)
    polytopes = {kind_a, kind_b} <= {"box", "convex"}
    for _ in range(40):
        a, b = body(rng, kind_a), body(rng, kind_b)
        pose, contact, normal = touching(rng, a, b)
        for gap in (2e-3, -2e-4 if polytopes else -2e-3):
            moved = np.concatenate([pose[:3] + gap * normal, pose[3:]])
            answer = gs.distance(a, b, moved, want=DEEP)
            text = reproducer(a=vars(a), b=vars(b), pose=moved)
            assert answer.status[0] == 0, text
            points = max(
                np.abs(answer.point_a[0] - contact).max(), np.abs(answer.point_b[0] - contact - gap * normal).max()
            )
            error = (abs(answer.distance[0] - gap), np.abs(answer.normal[0] - normal).max(), points)
            assert error[0] < 1e-14, (answer.distance[0], gap, STAGES[stages_of_pair(a, b, moved)[0]], text)
            worst = np.maximum(worst, error)
    return tuple(worst)


@pytest.mark.parametrize(("kind_a", "kind_b"), PAIRS)
@pytest.mark.parametrize("order", ["ab", "ba"])
def test_accuracy_is_as_declared(kind_a: str, kind_b: str, order: str, rng: np.random.Generator) -> None:
    """Not worse than the table says, and not so much better that the table should say so."""
    declared = WORST[kind_a][SUPPORTED.index(kind_b)] * 1e-16
    kinds = (kind_a, kind_b) if order == "ab" else (kind_b, kind_a)
    distance, normal, points = worst_errors(*kinds, rng)
    print(kinds, distance, normal, points)
    assert declared / 4 <= distance <= declared
    # Directions and points are worse conditioned: the gap is 1/100 of the size, the depth 1/1000.
    assert normal <= 2e-12 and points <= 2e-13


# ------------------------------------------------------------------------------------------------ named cases

S = np.sqrt
NAMED: dict[str, tuple[gs.Shape, gs.Shape, list[float], float]] = {
    "concentric spheres": (gs.Sphere(1.0), gs.Sphere(0.5), [0, 0, 0], -1.5),
    "spheres of radius 0 at one place": (gs.Sphere(0.0), gs.Sphere(0.0), [0, 0, 0], 0.0),
    "spheres that touch": (gs.Sphere(1.0), gs.Sphere(2.0), [0, 3, 0], 0.0),
    "spheres an ulp apart": (gs.Sphere(0.5), gs.Sphere(0.5), [0, 1 + EPS, 0], EPS),
    "sphere on the axis of a capsule": (gs.Sphere(0.25), gs.Capsule(0.5, 2.0), [0, 0, 0.5], -0.75),
    "sphere beyond the end of a capsule": (gs.Sphere(0.25), gs.Capsule(0.5, 2.0), [0, 0, 3], 1.25),
    "sphere at the end of a capsule's axis": (gs.Sphere(0.25), gs.Capsule(0.5, 2.0), [0, 0, 1], -0.75),
    "capsules whose axes cross": (gs.Capsule(0.5, 2.0), gs.Capsule(0.25, 2.0), [0, 0, 0, S(0.5), 0, 0, S(0.5)], -0.75),
    "capsules whose axes cross at an end": (
        gs.Capsule(0.5, 2.0), gs.Capsule(0.25, 2.0), [0, 1, 0, S(0.5), 0, 0, S(0.5)], -0.75
    ),
    "coaxial capsules whose axes overlap": (gs.Capsule(0.5, 2.0), gs.Capsule(0.25, 2.0), [0, 0, 0.5], -0.75),
    "coaxial capsules end to end": (gs.Capsule(0.5, 2.0), gs.Capsule(0.5, 2.0), [0, 0, 3], 0.0),
    "the same capsule twice": (gs.Capsule(0.5, 2.0), gs.Capsule(0.5, 2.0), [0, 0, 0], -1.0),
    "parallel capsules side by side": (gs.Capsule(0.5, 2.0), gs.Capsule(0.5, 2.0), [1.5, 0, 0.25], 0.5),
    "antiparallel capsules": (gs.Capsule(0.5, 2.0), gs.Capsule(0.5, 2.0), [1.5, 0, 0.25, 1, 0, 0, 0], 0.5),
    "capsules without length": (gs.Capsule(0.5, 0.0), gs.Capsule(0.25, 0.0), [3, 4, 0], 4.25),
    "capsules nearly parallel": (gs.Capsule(0.5, 2.0), gs.Capsule(0.5, 2.0), [1.5, 0, 0, 5e-10, 0, 0, 1], 0.5),
    "sphere at the centre of a box": (gs.Sphere(0.25), gs.Box([1, 2, 3]), [0, 0, 0], -1.25),
    "sphere at the centre of a cube": (gs.Sphere(0.25), gs.Box([1, 1, 1]), [0, 0, 0], -1.25),
    "sphere centred on a face": (gs.Sphere(0.25), gs.Box([1, 2, 3]), [1, 0.5, 0.5], -0.25),
    "sphere centred on an edge": (gs.Sphere(0.25), gs.Box([1, 2, 3]), [1, 2, 0.5], -0.25),
    "sphere centred on a corner": (gs.Sphere(0.25), gs.Box([1, 2, 3]), [1, 2, 3], -0.25),
    "sphere off a corner": (gs.Sphere(0.25), gs.Box([1, 1, 1]), [3, 3, 2], 2.75),
    "sphere in a flat box": (gs.Sphere(0.25), gs.Box([1, 2, 0]), [0.5, 0.5, 0], -0.25),
    "sphere over a flat box": (gs.Sphere(0.25), gs.Box([1, 2, 0]), [0.5, 0.5, 2], 1.75),
    "sphere on a box that is a segment": (gs.Sphere(0.25), gs.Box([1, 0, 0]), [0.5, 0, 0], -0.25),
    "sphere on a box that is a point": (gs.Sphere(0.25), gs.Box([0, 0, 0]), [0, 0, 0], -0.25),
    "capsule through a box": (gs.Capsule(0.25, 8.0), gs.Box([1, 2, 3]), [0.5, 0, 0], -0.75),
    "capsule in a flat box": (gs.Capsule(0.25, 1.0), gs.Box([1, 0, 1]), [0, 0, 0], -0.25),
    "boxes in a cross": (gs.Box([3, 1, 1]), gs.Box([1, 3, 1]), [0, 0, 0.5], -1.5),
    "a small box deep in a large one": (gs.Box([8, 8, 8]), gs.Box([0.5, 0.5, 0.5]), [7, 0, 0], -1.5),
    "cube on an edge on a cube": (
        gs.Box([1, 1, 1]), gs.Box([1, 1, 1]), [0, 0, 1 + S(2), np.sin(np.pi / 8), 0, 0, np.cos(np.pi / 8)], 0.0
    ),
    "kilometre slab under a millimetre sphere": (gs.Sphere(1e-3), gs.Box([1e3, 1e3, 1]), [0, 0, 1.002], 1e-3),
    "needle across a needle": (gs.Box([1, 1e-6, 1e-6]), gs.Box([1e-6, 1, 1e-6]), [0.25, 0.25, 3e-6], 1e-6),
    "half space under a sphere": (gs.Sphere(1.0), gs.HalfSpace([0, 0, 2], 1.0), [0, 0, -3], 1.5),
    "half space that holds a box": (gs.Box([1, 2, 3]), gs.HalfSpace([0, 0, 1], 0.0), [0, 0, 10], -13.0),
    "half space at a box's face": (gs.Box([1, 2, 3]), gs.HalfSpace([0, 0, 1], 0.0), [0, 0, -3], 0.0),
    "half spaces back to back, apart": (gs.HalfSpace([0, 0, 1], 1.0), gs.HalfSpace([0, 0, -1], -1.5), [0, 0, 0], 0.5),
    "half spaces that touch": (gs.HalfSpace([0, 0, 1], 1.0), gs.HalfSpace([0, 0, -1], -1.0), [0, 0, 0], 0.0),
    "half spaces that share a slab": (gs.HalfSpace([0, 0, 1], 1.0), gs.HalfSpace([0, 0, -1], 2.0), [0, 0, 0], -3.0),
    "half space turned over": (gs.HalfSpace([0, 0, 1], 1), gs.HalfSpace([0, 0, 1], -1.5), [0, 0, 0, 1, 0, 0, 0], 0.5),
}  # fmt: skip


@pytest.mark.parametrize("name", NAMED)
@pytest.mark.parametrize("swap", [False, True], ids=["ab", "ba"])
def test_named(name: str, swap: bool) -> None:
    a, b, where, expected = NAMED[name]
    pose = np.array([*where, *IDENTITY][:7] if len(where) == 3 else where, dtype=float)
    pose[3:] /= np.linalg.norm(pose[3:])
    if swap:
        matrix = rotation(pose[3:])
        a, b, pose = b, a, np.concatenate([-matrix.T @ pose[:3], pose[3:] * [-1, -1, -1, 1]])
    answer, plain = gs.distance(a, b, pose, want=DEEP), gs.distance(a, b, pose)
    size = np.abs(pose[:3]).max() + 8.0
    assert answer.status[0] == plain.status[0] == gs.DistanceStatus.OK
    assert answer.lower[0] <= answer.distance[0] <= answer.upper[0]
    assert abs(answer.distance[0] - expected) <= 4 * EPS * size
    assert answer.lower[0] - 4 * EPS * size <= expected <= answer.upper[0] + 4 * EPS * size
    assert abs(plain.distance[0] - max(expected, 0.0)) <= 4 * EPS * size
    assert plain.lower[0] >= 0.0
    gap = answer.point_b[0] - answer.point_a[0] - answer.distance[0] * answer.normal[0]
    assert abs(np.linalg.norm(answer.normal[0]) - 1.0) <= 4 * EPS and np.abs(gap).max() <= 16 * EPS * size
    if expected < -1e-9:
        # Moving b by the depth along the normal parts them; a hair less does not.
        out = np.concatenate([pose[:3] - (expected - 1e-9) * answer.normal[0], pose[3:]])
        within = np.concatenate([pose[:3] - (expected + 1e-9) * answer.normal[0], pose[3:]])
        assert not gs.intersects(a, b, out).value[0] and gs.intersects(a, b, within).value[0]
        assert np.array_equal(plain.point_a, plain.point_b)
        assert plain.distance[0] == plain.lower[0] == 0.0


@pytest.mark.parametrize("kind", ["sphere", "capsule", "convex"])
def test_the_very_end_of_a_turned_capsule(kind: str, rng: np.random.Generator) -> None:
    """A gap that is all rounding points anywhere, back along the axis too; the depth must not care."""
    for _ in range(200):
        a = {
            "sphere": gs.Sphere(0.25),
            "capsule": gs.Capsule(0.25, 0.0),
            "convex": gs.Convex([[0.0, 0.0, 0.0]]),
        }[kind]
        b = gs.Capsule(0.5, 2.0 * rng.uniform(0.5, 1.0))
        turn = random_turn(rng)
        pose = np.concatenate([rotation(turn) @ [0, 0, rng.choice([-1, 1]) * b.length / 2], turn])
        answer = gs.distance(a, b, pose, want=DEEP)
        expected = -0.5 if kind == "convex" else -0.75
        text = reproducer(length=b.length, pose=pose)
        assert answer.status[0] == gs.DistanceStatus.OK, text
        assert abs(answer.distance[0] - expected) <= 4 * EPS, text


def test_half_spaces_that_lean_share_everything() -> None:
    """However little: somewhere far away the planes cross, and beyond that no translation parts the solids."""
    up, down = gs.HalfSpace([0, 0, 1], 0.0), gs.HalfSpace([0, 0, -1], -1.0)
    for angle in (0.5, 1e-3, 1e-9, 3.0):
        pose = [0, 0, 0, np.sin(angle / 2), 0, 0, np.cos(angle / 2)]
        deep, plain = gs.distance(up, down, pose, want=DEEP), gs.distance(up, down, pose)
        assert deep.distance[0] == deep.lower[0] == deep.upper[0] == -np.inf and deep.status[0] == 0
        assert np.isnan(deep.normal).all() and plain.distance[0] == plain.upper[0] == 0.0
        meet = gs.intersects(up, down, pose)
        assert meet.value[0] and meet.certain[0]
        # The common point is one.
        point = plain.point_a[0]
        slack = 1e-15 * max(1.0, np.abs(point).max())
        assert point[2] <= slack and rotation(np.array(pose[3:])) @ [0, 0, -1] @ point <= -1.0 + 2 * slack
    alike = gs.distance(up, gs.HalfSpace([0, 0, 1], 5.0), [0, 0, 0, *IDENTITY], want=DEEP)
    assert alike.distance[0] == -np.inf and alike.point_a[0, 2] <= 0.0


def test_half_spaces_parallel_up_to_rounding_of_the_pose() -> None:
    """A rotated plane is parallel only to rounding: the gap is the best guess, what is proven says so."""
    normal = np.array([1.0, 2.0, 3.0])
    turn = random_turn(np.random.default_rng(3))
    a, b = gs.HalfSpace(rotation(turn) @ normal, 1.0), gs.HalfSpace(-normal, -1.5)
    b = gs.HalfSpace(b.normal, b.offset)
    answer = gs.distance(a, b, [0, 0, 0, *turn], want=DEEP)
    plain = gs.distance(a, b, [0, 0, 0, *turn])
    if answer.status[0] == gs.DistanceStatus.NOT_CONVERGED:
        assert answer.lower[0] == -np.inf and plain.lower[0] == 0.0
        assert answer.distance[0] <= answer.upper[0] < 1.0
        assert not gs.intersects(a, b, [0, 0, 0, *turn]).certain[0]
    else:
        assert answer.distance[0] == -np.inf


# ------------------------------------------------------------------------- half spaces far away, turned, in scenes


def far_position(rng: np.random.Generator, size: float) -> np.ndarray:
    return rng.normal(size=3) * size * 10.0 ** rng.uniform(-1.0, 8.0)


def unit_pose(position: np.ndarray, turn: np.ndarray) -> np.ndarray:
    return _validate.poses(np.append(position, turn))[0]


def sized(shape: gs.Shape, size: float) -> gs.Shape:
    if isinstance(shape, gs.Sphere):
        return gs.Sphere(size * shape.radius)
    if isinstance(shape, gs.Capsule):
        return gs.Capsule(size * shape.radius, size * shape.length)
    if isinstance(shape, gs.Box):
        return gs.Box(size * shape.half_extents)
    if isinstance(shape, gs.Convex):
        return gs.Convex(size * shape.vertices)
    return gs.HalfSpace(shape.normal, size * shape.offset)


def encloses(answers: Any, square: Any, radii: Any) -> bool:
    """Whether the one interval of these answers, with depth and without, holds the exact distance."""
    deep, plain = answers
    positive = (square, radii) if compare_root(radii, square) < 0 else (0, 0)
    return in_interval(square, radii, deep.lower[0], deep.upper[0]) and in_interval(
        *positive, plain.lower[0], plain.upper[0]
    )


@pytest.mark.parametrize("order", ["first", "second"])
@pytest.mark.parametrize("kind", SUPPORTED[:4])
def test_turned_half_space_far_away(kind: str, order: str, rng: np.random.Generator) -> None:
    """At a distance it shows that the inverse of a rounded rotation is not its transpose."""
    for _ in range(60):
        size = 10.0 ** rng.uniform(-6.0, 6.0)
        pair = [sized(shape(rng, kind), size), sized(shape(rng, "half_space"), size)]
        a, b = pair if order == "second" else pair[::-1]
        pose = unit_pose(far_position(rng, size), any_turn(rng))
        if rng.random() < 0.5:  # brought to touching
            answer = gs.distance(a, b, pose, want=DEEP)
            pose[:3] -= answer.normal[0] * answer.distance[0]
        answers = gs.distance(a, b, pose, want=DEEP), gs.distance(a, b, pose)
        assert encloses(answers, *exact_pair(a, b, pose)), reproducer(a=a, b=b, pose=pose)

        ends = [unit_pose(far_position(rng, size), any_turn(rng)) for _ in range(2)]
        scene = gs.Scene()
        scene.apply(gs.SceneUpdate(add=[gs.SceneObject(*x) for x in zip("ab", (a, b), ends, strict=True)]))
        answers = scene.distances(np.inf, want=DEEP), scene.distances(np.inf)
        placed = [(s, matrix_of(p), p[:3]) for s, p in zip((a, b), scene.world.poses, strict=True)]
        assert encloses(answers, *exact_half_space(*placed)), reproducer(a=a, b=b, pose_a=ends[0], pose_b=ends[1])


def test_offset_that_cancels(rng: np.random.Generator) -> None:
    """The plane passes the body so closely that two doubles do not hold the sum of its terms."""
    for _ in range(300):
        a, b = gs.Convex([rng.normal(size=3) * 10.0]), gs.HalfSpace(rng.normal(size=3), 10.0 * rng.normal())
        pose = np.append(rng.normal(size=3) * 10.0, np.eye(4)[rng.integers(4)])  # a turn without rounding
        for _ in range(2):
            answer = gs.distance(a, b, pose, want=DEEP)
            pose[:3] -= answer.normal[0] * answer.distance[0]
        answers = gs.distance(a, b, pose, want=DEEP), gs.distance(a, b, pose)
        assert encloses(answers, *exact_pair(a, b, pose)), reproducer(a=a, b=b, pose=pose)


def floor_and_ceiling(turn_floor: Any, turn_ceiling: Any) -> gs.Scene:
    """Solid below z = 1 and above z = 3, in the frame of each."""
    objects = [
        gs.SceneObject("floor", gs.HalfSpace([0, 0, 1], 1.0), [0, 0, 0, *turn_floor]),
        gs.SceneObject("ceiling", gs.HalfSpace([0, 0, -1], -3.0), [0, 0, 0, *turn_ceiling]),
    ]
    scene = gs.Scene()
    scene.apply(gs.SceneUpdate(add=objects))
    return scene


def test_half_spaces_turned_in_a_scene() -> None:
    """Parallel as far as a rounded rotation lets one know: at most the gap apart.  Leaning for certain: they meet."""
    about_z = [0.0, 0.0, 0.6, 0.8]
    for turns in ((about_z, IDENTITY), (IDENTITY, about_z), ([0.1, 0.7, 0.1, 0.7], [0.1, 0.7, 0.1, 0.7])):
        deep, plain = (floor_and_ceiling(*turns).distances(np.inf, want=want) for want in (DEEP, ()))
        assert deep.lower[0] == -np.inf and plain.lower[0] == 0.0
        assert 2.0 <= deep.upper[0] == plain.upper[0] <= 2.0 + 1e-12
    for turn in ([0.6, 0.0, 0.0, 0.8], [1e-9, 0.0, 0.0, 1.0], [1.0, 0.0, 0.0, 0.0]):
        deep, plain = (floor_and_ceiling(turn, IDENTITY).distances(np.inf, want=want) for want in (DEEP, ()))
        assert deep.distance[0] == deep.lower[0] == deep.upper[0] == -np.inf
        assert plain.distance[0] == plain.lower[0] == plain.upper[0] == 0.0


# ------------------------------------------------------------------------------------------ without depth, tiers


@pytest.mark.parametrize(("kind_a", "kind_b"), list(itertools.product(SUPPORTED, SUPPORTED)))
def test_without_penetration_overlapping_bodies_have_a_common_point(
    kind_a: str, kind_b: str, rng: np.random.Generator
) -> None:
    tally = Tally()
    for _ in range(30):
        a, b = body(rng, kind_a), body(rng, kind_b)
        pose = np.concatenate([rng.normal(size=3) * 0.04, random_turn(rng)])
        plain, deep = gs.distance(a, b, pose), gs.distance(a, b, pose, want=DEEP)
        if deep.distance[0] > 0.0:
            for name in ("distance", "lower", "upper", "point_a", "point_b", "normal"):
                assert np.array_equal(getattr(plain, name), getattr(deep, name))
            continue
        tally.counts["overlapping"] += 1
        assert plain.distance[0] == plain.lower[0] == 0.0 <= plain.upper[0] <= 1e-14
        assert np.array_equal(plain.point_a, plain.point_b) and np.isfinite(plain.point_a).all()
        assert np.isnan(plain.normal).all() or abs(np.linalg.norm(plain.normal) - 1.0) <= 4 * EPS
        # A member of both: at no distance from either, its rounding apart.
        point = plain.point_a[0]
        local = rotation(pose[3:]).T @ (point - pose[:3])
        for solid, p in ((a, point), (b, local)):
            assert gs.distance(solid, gs.Sphere(0.0), [*p, *IDENTITY]).distance[0] <= 1e-15 * max(1.0, np.abs(p).max())
    tally.require(overlapping=5)


def test_intersects_says_when_it_is_certain(rng: np.random.Generator) -> None:
    """Certain answers are right; uncertain ones occur only within rounding of touching."""
    sure = 0
    for _ in range(30):
        a, b = gs.Box(rng.uniform(0.5, 1.0, 3)), gs.Convex(ordinary_hull(rng))
        pose, _, normal = touching(rng, a, b)
        gap = rng.choice([0.0, 1e-17, 1e-15, 1e-14, 1e-12]) * rng.choice([-1, 1])
        pose[:3] += gap * normal
        meet = gs.intersects(a, b, pose)
        square, radii = exact_pair(a, b, pose)
        text = reproducer(a=vars(a), b=vars(b), pose=pose)
        if meet.certain[0]:
            sure += 1
            assert meet.value[0] == (square <= 0), text
        else:
            assert abs(signed_root(square, radii)) <= 1e-14, text
    assert 5 <= sure <= 25


# --------------------------------------------------------------------------------------------------- extremes


@pytest.mark.parametrize("size_a", [5e-324, 1e-300, 1e-20, 1.0, 1e20, 1e300])
@pytest.mark.parametrize("size_b", [1e-320, 1e-300, 1.0, 1e300])
def test_sizes_from_one_end_of_the_number_range_to_the_other(size_a: float, size_b: float) -> None:
    """Nothing overflows, underflows into a wrong sign, or turns NaN; the interval holds the exact answer."""
    tetrahedron = np.concatenate([np.eye(3), np.zeros((1, 3))])
    pairs: list[tuple[Any, Any]] = [
        (gs.Box([size_a] * 3), gs.Box([size_b] * 3)),
        (gs.Sphere(size_a), gs.Box([size_b] * 3)),
        (gs.Capsule(size_a, size_b), gs.Capsule(size_b, size_a)),
        (gs.Convex(tetrahedron * size_a), gs.Convex(tetrahedron * size_b)),
        (gs.HalfSpace([0, 0, 1], size_a), gs.Box([size_b] * 3)),
    ]
    for a, b in pairs:
        for position in (0.0, 1e-300, 1e300):
            for turn in (IDENTITY, [0.6, 0.0, 0.8, 0.0]):
                pose = gs._validate.poses(np.array([position, 0.0, position / 3.0, *turn]))[0]
                answer = gs.distance(a, b, pose, want=DEEP)
                square, radii = exact_pair(a, b, pose)
                text = reproducer(a=vars(a), b=vars(b), pose=pose)
                assert answer.status[0] == 0 and answer.lower[0] <= answer.distance[0] <= answer.upper[0], text
                assert in_interval(square, radii, answer.lower[0], answer.upper[0]), text
                assert np.isfinite(answer.normal).all() and np.isfinite(answer.point_a).all(), text
