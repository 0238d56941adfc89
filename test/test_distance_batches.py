# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""Distance of batches of boxes, polytopes and frusta in world coordinates: hard cases, broadcasting, far places."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from conftest import from_hex, hard_cases, reproducer
from distance_scenes import EPS, ROUNDING, WIDEST, box_pair, check_answer, in_interval, random_turn, rotation
from oracle import polytope, vectors

import geomsrv as gs
from geomsrv import _core
from geomsrv.errors import GeometryError

DEEP = ("penetration",)
CASES = hard_cases("box_box_distance")
FIELDS = ("distance", "lower", "upper", "point_a", "point_b", "normal", "status")


def boxes_of(case: dict[str, Any], name: str) -> gs.Boxes:
    box = from_hex(case["input"])[name]
    return gs.Boxes([box["C"]], [box["A"]], [box["e"]])


def corners_of(boxes: gs.Boxes, i: int = 0) -> list[vectors.Vector]:
    return polytope.box_corners(*(x[i].tolist() for x in (boxes.center, boxes.axes, boxes.half_extents)))


def is_member(corners: list[vectors.Vector], point: np.ndarray, slack: float) -> bool:
    """Whether a point is within `slack` of a body."""
    return vectors.compare_root(slack, polytope.squared_distance(corners, [vectors.exact(point.tolist())])) >= 0


# --------------------------------------------------------------------------------------------------- hard cases


@pytest.mark.parametrize("case", CASES, ids=lambda case: case["id"])
@pytest.mark.parametrize("order", [("box0", "box1"), ("box1", "box0")], ids=["ab", "ba"])
def test_hard_case(case: dict[str, Any], order: tuple[str, str]) -> None:
    a, b = (boxes_of(case, name) for name in order)
    signed, plain, meet = gs.distance(a, b, want=DEEP), gs.distance(a, b), gs.intersects(a, b)
    expected, square = case["answer"], Fraction(case["answer"]["sep_sq"])
    scale = float.fromhex(case["margin"]["scale_local"])

    # Whatever doubles can decide, the interval holds the exact answer.
    assert signed.status[0] == gs.DistanceStatus.OK
    assert vectors.in_interval(square, signed.lower[0], signed.upper[0])
    assert vectors.in_interval(max(square, 0), plain.lower[0], plain.upper[0])
    assert signed.lower[0] <= signed.distance[0] <= signed.upper[0]
    least = 8 * float(np.finfo(float).smallest_subnormal)
    assert signed.upper[0] - signed.lower[0] <= WIDEST * 2 * scale + least
    assert meet.value[0] == expected["intersects"] or not meet.certain[0]

    if case["margin"]["decidable"] != "exact_only":
        assert meet.value[0] == expected["intersects"]
        if expected["separation"] != "touching":
            assert meet.certain[0] or scale < 1e-290  # where numbers end, so does certainty
        assert abs(plain.distance[0] - float.fromhex(expected["dist"])) <= ROUNDING * scale + least

    # The witness pair: members, as far apart as the distance says.
    slack = ROUNDING * max(scale, float(np.abs(a.center).max()), float(np.abs(b.center).max())) + least
    point_a, point_b = plain.point_a[0], plain.point_b[0]
    assert is_member(corners_of(a), point_a, slack) and is_member(corners_of(b), point_b, slack)
    assert np.abs(point_b - point_a - signed.distance[0] * signed.normal[0]).max() <= slack or signed.distance[0] < 0.0
    if expected["closest_set_dim"] == 0:
        on_a, on_b = (np.array([float(Fraction(x)) for x in expected[f"on{name[-1]}"]]) for name in order)
        # One nearest pair only, which is ill-conditioned where edges are nearly parallel.
        if case["class"] not in ("near_parallel_ridge", "near_parallel_faces", "needle_slab"):
            assert np.abs(point_a - on_a).max() <= 4 * slack and np.abs(point_b - on_b).max() <= 4 * slack


def test_hard_cases_are_all_there() -> None:
    decidable = [case for case in CASES if case["margin"]["decidable"] != "exact_only"]
    assert len(CASES) >= 46 and len(decidable) >= 26


# ------------------------------------------------------------------------------------------------- broadcasting


def random_boxes(rng: np.random.Generator, n: int) -> gs.Boxes:
    axes = np.stack([rotation(random_turn(rng)).T for _ in range(n)])
    return gs.Boxes(rng.normal(size=(n, 3)), axes, rng.uniform(0.1, 0.8, (n, 3)))


def random_polytopes(rng: np.random.Generator, n: int) -> gs.Polytopes:
    return gs.Polytopes.from_list([rng.normal(size=(int(rng.integers(1, 12)), 3)) for _ in range(n)])


def item(batch: Any, i: int) -> Any:
    if isinstance(batch, gs.Boxes):
        return gs.Boxes(batch.center[i : i + 1], batch.axes[i : i + 1], batch.half_extents[i : i + 1])
    return gs.Polytopes.from_list([batch.vertices[batch.offsets[i] : batch.offsets[i + 1]]])


BATCHES = {"boxes": random_boxes, "polytopes": random_polytopes}


@pytest.mark.parametrize("make_a", BATCHES)
@pytest.mark.parametrize("make_b", BATCHES)
@pytest.mark.parametrize(("m", "n"), [(7, 7), (1, 7), (7, 1), (1, 1)])
def test_a_batch_is_its_items(make_a: str, make_b: str, m: int, n: int, rng: np.random.Generator) -> None:
    a, b = BATCHES[make_a](rng, m), BATCHES[make_b](rng, n)
    answer = gs.distance(a, b, want=DEEP)
    assert len(answer.distance) == max(m, n)
    for i in range(max(m, n)):
        alone = gs.distance(item(a, i if m > 1 else 0), item(b, i if n > 1 else 0), want=DEEP)
        for name in FIELDS:
            assert np.array_equal(getattr(answer, name)[i], getattr(alone, name)[0]), (name, i)
    assert answer.cost.counts == {"ok": max(m, n)}


@pytest.mark.parametrize("penetration", [False, True])
def test_empty_batches(penetration: bool) -> None:
    none = gs.Boxes(np.zeros((0, 3)), np.zeros((0, 3, 3)), np.zeros((0, 3)))
    nothing = gs.Polytopes(np.zeros((0, 3)), [0])
    one = gs.Boxes([[0, 0, 0]], [np.eye(3)], [[1, 1, 1]])
    for a, b in ((none, none), (none, one), (one, none), (nothing, nothing)):
        answer = gs.distance(a, b, want=DEEP if penetration else ())
        assert answer.distance.shape == (0,) and answer.point_a.shape == (0, 3) and answer.status.shape == (0,)


def test_lengths_must_agree() -> None:
    with pytest.raises(GeometryError, match="same length"):
        gs.distance(random_boxes(np.random.default_rng(0), 2), random_boxes(np.random.default_rng(0), 3))


def test_engine_refuses_arrays_of_different_length() -> None:
    boxes = random_boxes(np.random.default_rng(0), 2)
    with pytest.raises(ValueError, match="different length"):
        side = boxes.center, boxes.axes, boxes.half_extents
        _core.distance_world((*side[:2], side[2][:1]), side, True)


def test_a_large_batch(rng: np.random.Generator) -> None:
    """A hundred thousand pairs at once: no failure, and every sixteenth answer agrees with a smaller batch."""
    n = 100_000
    few = random_boxes(rng, 16)
    pick, other = rng.integers(0, 16, n), rng.integers(0, 16, n)
    a = gs.Boxes(few.center[pick], few.axes[pick], few.half_extents[pick])
    b = gs.Boxes(few.center[other] + rng.normal(size=(n, 3)), few.axes[other], few.half_extents[other])
    answer = gs.distance(a, b, want=DEEP)
    assert answer.cost.counts == {"ok": n}
    assert (answer.distance > 0.0).sum() > n // 4 < (answer.distance < 0.0).sum() + n // 5
    part = gs.distance(*(gs.Boxes(x.center[::16], x.axes[::16], x.half_extents[::16]) for x in (a, b)), want=DEEP)
    assert np.array_equal(part.distance, answer.distance[::16])


# -------------------------------------------------------------------------------------------- mixed batches, far


@pytest.mark.parametrize("place", [0.0, 1.0, 1e6, 1e12])
def test_boxes_polytopes_and_frusta_against_the_oracle(place: float, rng: np.random.Generator) -> None:
    """All three kinds against each other, near the origin and far away: corners are rounded locally, and bounded."""
    for _ in range(12):
        at = np.round(rng.normal(size=3) * place)
        half, axes, center, _, _ = box_pair(rng)
        boxes = gs.Boxes([center + at], [axes], [half])
        points = rng.normal(size=(6, 3)) + at
        polytopes = gs.Polytopes.from_list([points])
        near, far = 0.25, 0.25 * 2.0 ** rng.integers(1, 5)
        window = (*sorted(rng.uniform(-1.0, 1.0, 2)), *sorted(rng.uniform(-1.0, 1.0, 2)))
        frustum = gs.Frustum(at + rng.normal(size=3), rotation(random_turn(rng)).T, bounds=window, near=near, far=far)
        bodies = {
            "boxes": (boxes, corners_of(boxes)),
            "polytopes": (polytopes, [vectors.exact(p) for p in points.tolist()]),
            "frustum": (
                frustum,
                polytope.frustum_corners(frustum.origin.tolist(), frustum.axes.tolist(), frustum.bounds, near, far),
            ),
        }
        for first, second in (
            ("boxes", "polytopes"),
            ("polytopes", "frustum"),
            ("frustum", "boxes"),
            ("frustum", "frustum"),
        ):
            (a, exact_a), (b, exact_b) = bodies[first], bodies[second]
            square = polytope.separation(exact_a, exact_b).signed_square
            check_answer(
                gs.distance(a, b, want=DEEP), gs.distance(a, b), square, Fraction(0), 40.0 * (1.0 + EPS * place),
                first=first, second=second, at=at, half=half, axes=axes, center=center, points=points,
                window=window, near=near, far=far, origin=frustum.origin, frustum_axes=frustum.axes,
            )  # fmt: skip


def test_a_frustum_is_a_shape_too(rng: np.random.Generator) -> None:
    """With a pose, a frustum is its eight exact corners; the interval covers their rounding."""
    for _ in range(10):
        frustum = gs.Frustum(
            rng.normal(size=3), rotation(random_turn(rng)).T, 0.3, 0.2, 0.1, 0.1 * 3.0 ** rng.integers(1, 5)
        )
        exact = polytope.frustum_corners(
            frustum.origin.tolist(), frustum.axes.tolist(), frustum.bounds, frustum.near, frustum.far
        )
        point = rng.normal(size=3) * 4.0
        answer = gs.distance(frustum, gs.Sphere(0.0), [*point, 0, 0, 0, 1], want=DEEP)
        square = polytope.separation(exact, [vectors.exact(point.tolist())]).signed_square
        assert in_interval(square, Fraction(0), answer.lower[0], answer.upper[0]), reproducer(frustum=frustum.packed())
        reverse = gs.distance(gs.Sphere(0.0), frustum, [*-point, 0, 0, 0, 1], want=DEEP)
        assert abs(reverse.distance[0] - answer.distance[0]) <= 64 * EPS * 10.0


# --------------------------------------------------------------------------------------------- named degeneracies

CUBE = np.array([[x, y, z] for x in (0.0, 1.0) for y in (0.0, 1.0) for z in (0.0, 1.0)])
NAMED = {
    "point on point": ([[0.25, 0.5, 1]], [[0.25, 0.5, 1]], 0.0),
    "point off point": ([[0, 0, 0]], [[3, 4, 0]], 5.0),
    "point in cube": (CUBE, [[0.5, 0.5, 0.25]], -0.25),
    "point on face": (CUBE, [[0.5, 0.5, 1]], 0.0),
    "point on edge": (CUBE, [[0.5, 1, 1]], 0.0),
    "point on corner": (CUBE, [[1, 1, 1]], 0.0),
    "cube in itself": (CUBE, CUBE, -1.0),
    "cube in larger cube": (CUBE, 3.0 * CUBE - 1.0, -2.0),
    "cube on cube": (CUBE, CUBE + [0, 0, 1], 0.0),
    "cube beside cube by an ulp": (CUBE, CUBE + [0, 0, 1 + 2.0**-52], 2.0**-52),
    "cubes at an edge": (CUBE, CUBE + [1, 0, 1], 0.0),
    "cubes at a corner": (CUBE, CUBE + [1, 1, 1], 0.0),
    "square in its own plane": (CUBE[:4], CUBE[:4] + [0, 0.5, 0.5], 0.0),
    "square across a square": (CUBE[:4], CUBE[:4][:, [1, 0, 2]] - [0.5, 0, 0], 0.0),
    "square above square": (CUBE[:4], CUBE[:4] + [2, 0.5, 0.5], 2.0),
    "collinear segments that overlap": ([[0, 0, 0], [2, 0, 0]], [[1, 0, 0], [3, 0, 0]], 0.0),
    "collinear segments end to end": ([[0, 0, 0], [1, 0, 0]], [[1, 0, 0], [3, 0, 0]], 0.0),
    "collinear segments apart": ([[0, 0, 0], [1, 0, 0]], [[3, 0, 0], [4, 0, 0]], 2.0),
    "parallel segments": ([[0, 0, 0], [1, 0, 0]], [[0.5, 2, 0], [4, 2, 0]], 2.0),
    "crossing segments": ([[-1, 0, 0], [1, 0, 0]], [[0, -1, 0], [0, 1, 0]], 0.0),
    "skew segments": ([[-1, 0, 0], [1, 0, 0]], [[0, -1, 3], [0, 1, 3]], 3.0),
    "segment through cube": (CUBE, [[0.5, 0.25, -2], [0.5, 0.25, 3]], -0.25),
    "segment of no length": ([[1, 1, 1], [1, 1, 1]], CUBE - 3.0, 3.0 * 3.0**0.5),
    "triangle without area": ([[0, 0, 0], [1, 1, 1], [2, 2, 2]], [[3, 3, 3]], 3.0**0.5),
    "cube with points inside and repeats": (np.concatenate([CUBE, CUBE, [[0.5, 0.5, 0.5]]]), CUBE + [0.5, 0, 0], -0.5),
    "octahedron tip in a square": (
        np.concatenate([np.eye(3), -np.eye(3)]), (CUBE[:4] - 0.5)[:, [1, 2, 0]] * 2 + [0, 0, 2], 0.0,
    ),
    "edge on edge, across": ([[-1, 0, 0], [1, 0, 0], [0, 0, -1]], [[0, -1, 0], [0, 1, 0], [0, 0, 1]], 0.0),
}  # fmt: skip


@pytest.mark.parametrize("name", NAMED)
@pytest.mark.parametrize("swap", [False, True], ids=["ab", "ba"])
def test_named_degeneracy(name: str, swap: bool) -> None:
    """Lattice coordinates: the answer is a number we know, and comes out to the last bit or two."""
    a, b, expected = NAMED[name]
    a, b = (np.array(x, dtype=float) for x in ((b, a) if swap else (a, b)))
    square = polytope.separation(a.tolist(), b.tolist()).signed_square
    assert abs(vectors.nearest_double(square) - expected * abs(expected)) <= 1e-15 * expected**2
    bodies = gs.Polytopes.from_list([a]), gs.Polytopes.from_list([b])
    answer, plain = gs.distance(*bodies, want=DEEP), gs.distance(*bodies)
    check_answer(answer, plain, square, Fraction(0), 8.0, a=a, b=b)
    assert abs(answer.distance[0] - expected) <= 2 * EPS * max(abs(expected), 0.25)
    assert bool(gs.intersects(*bodies).value[0]) == (expected <= 0.0)
    if expected <= 0.0:
        # Without depth the points are one common point.
        assert np.array_equal(plain.point_a, plain.point_b)
        for body in (a, b):
            assert is_member([vectors.exact(p) for p in body.tolist()], plain.point_a[0], 8 * EPS)
