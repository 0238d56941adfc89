# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""Distance of polytopes at the tier "exact": correctly rounded, whatever the numbers; judged by the oracle."""

from __future__ import annotations

import itertools
import math
import os
from collections import Counter
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from conftest import from_hex, hard_cases, reproducer
from distance_scenes import (
    HULLS,
    TURNS,
    any_turn,
    box_pair,
    core,
    hull,
    hull_pair,
    random_turn,
    rotation,
)
from oracle import polytope, vectors

import geomsrv as gs
from geomsrv import _core
from geomsrv.shapes import pack

DEEP = ("penetration",)
SOAK = 20 if os.environ.get("GEOMSRV_SOAK") else 1
EXTREMES = (1.0, 1.0, 1.0, 2.0**-990, 2.0**990, 2.0**-40, 2.0**60)


# ------------------------------------------------------------------------------------------------- what is right


def rounded(signed_square: Fraction) -> tuple[float, float, float]:
    """Nearest double of the signed root, and its neighbours below and above (itself, if it is the root)."""
    root = vectors.root_double(abs(signed_square))
    nearest = -root if signed_square < 0 and root else root
    side = vectors.compare_root(nearest, signed_square)
    return (
        nearest,
        nearest if side <= 0 else math.nextafter(nearest, -math.inf),
        nearest if side >= 0 else math.nextafter(nearest, math.inf),
    )


def check(a: Any, b: Any, pose: np.ndarray | None, vertices_a: Any, vertices_b: Any) -> tuple[gs.Distances, Fraction]:
    """All that one pair's exact answers promise; the signed square, too."""
    signed = polytope.separation(vertices_a, vertices_b).signed_square
    text = reproducer(a=vars(a), b=vars(b), pose=pose)
    deep, plain, meet = (
        query(a, b, pose, accuracy="exact", **more)
        for query, more in ((gs.distance, {"want": DEEP}), (gs.distance, {}), (gs.intersects, {}))
    )
    assert deep.status[0] == plain.status[0] == gs.DistanceStatus.OK
    for answer, wanted in ((deep, rounded(signed)), (plain, rounded(max(signed, Fraction(0))))):
        got = tuple(float(x[0]) for x in (answer.distance, answer.lower, answer.upper))
        assert got == wanted, (got, wanted, answer.cost.counts, text)
    assert meet.value[0] == (signed <= 0) and meet.certain[0], (meet, signed, text)
    # Doubles are never wrong where they are sure.
    rough, rough_meet = gs.distance(a, b, pose, want=DEEP), gs.intersects(a, b, pose)
    assert vectors.in_interval(signed, float(rough.lower[0]), float(rough.upper[0])), (rough, text)
    assert not rough_meet.certain[0] or rough_meet.value[0] == (signed <= 0), text
    check_points(deep, vertices_a, vertices_b, text)
    return deep, signed


def check_points(answer: gs.Distances, vertices_a: Any, vertices_b: Any, text: str) -> None:
    """Nearest points are members, their difference is distance times normal, and the normal separates."""
    a, b = (np.array([[float(x) for x in v] for v in vertices]) for vertices in (vertices_a, vertices_b))
    # Everything in a unit in which nothing over- or underflows, relative to the extent of the scene.
    size = max(np.abs(a).max(), np.abs(b).max(), float(abs(answer.distance[0])), 5e-324)
    unit = 2.0 ** -math.frexp(size)[1] if size > 1e-300 else 2.0**1000
    reach = max(np.ptp(a * unit, axis=0).max(), np.ptp(b * unit, axis=0).max(), abs(answer.distance[0] * unit))
    slack = 8 * 2.0**-53 * (3.0 * reach + 2.0)
    normal, d = answer.normal[0], answer.distance[0] * unit
    step = (answer.point_b[0] - answer.point_a[0]) * unit
    assert abs(np.linalg.norm(normal) - 1.0) <= 2.0**-51, text
    assert np.abs(step - d * normal).max() <= slack, (step, d * normal, text)
    # Supports along the normal are exact to rounding, and the points lie in the supporting planes.
    top, bottom = (a * unit @ normal).max(), (b * unit @ normal).min()
    assert abs(bottom - top - d) <= slack, (bottom - top, d, text)
    assert abs(answer.point_a[0] * unit @ normal - top) <= slack, text
    assert abs(answer.point_b[0] * unit @ normal - bottom) <= slack, text


class Tally(Counter[str]):
    """What a random test has seen."""

    def see(self, answer: gs.Distances, signed: Fraction) -> None:
        self["apart" if signed > 0 else "overlapping" if signed < 0 else "touching"] += 1
        self.update({name: n for name, n in answer.cost.counts.items() if name != "ok"})
        self["close"] += 0 < abs(signed) < Fraction(1, 2**60)

    def require(self, **least: int) -> None:
        print(dict(self))
        assert all(self[name] >= count for name, count in least.items()), (dict(self), least)


# -------------------------------------------------------------------------------------------------------- corpus


@pytest.mark.parametrize("case", hard_cases("box_box_distance"), ids=lambda case: case["id"])
def test_hard_cases(case: dict[str, Any]) -> None:
    boxes = [from_hex(case["input"][name]) for name in ("box0", "box1")]
    a, b = (gs.Boxes([box["C"]], [box["A"]], [box["e"]]) for box in boxes)
    deep, signed = check(a, b, None, *(polytope.box_corners(box["C"], box["A"], box["e"]) for box in boxes))
    answer = case["answer"]
    assert max(deep.distance[0], 0.0) == float.fromhex(answer["dist"])
    assert (signed <= 0) == answer["intersects"] and signed == Fraction(case["margin"]["sep_sq"])


# ------------------------------------------------------------------------------------------------ random batches


def test_boxes(rng: np.random.Generator) -> None:
    tally = Tally()
    for _ in range(150 * SOAK):
        half_a, axes_a, center, half_b, axes_b = box_pair(rng)
        scale = rng.choice(EXTREMES)
        far = rng.choice([0.0, 0.0, 1.0, 500.0, 1e6]) * rng.normal(size=3) * scale
        a = gs.Boxes([far], [axes_a], [half_a * scale])
        b = gs.Boxes([center * scale + far], [axes_b], [half_b * scale])
        tally.see(*check(a, b, None, *(corners_of(x) for x in (a, b))))
    tally.require(apart=40, overlapping=40, wide=40, exact=20, close=20)


def corners_of(body: gs.Boxes | gs.Polytopes | gs.Frustum) -> list[Any]:
    """Exact vertices of a batch of one."""
    if isinstance(body, gs.Boxes):
        return polytope.box_corners(body.center[0].tolist(), body.axes[0].tolist(), body.half_extents[0].tolist())
    if isinstance(body, gs.Frustum):
        return frustum_corners(body)
    return [vectors.exact(v) for v in body.vertices.tolist()]


def frustum_corners(body: gs.Frustum) -> list[Any]:
    return polytope.frustum_corners(body.origin.tolist(), body.axes.tolist(), body.bounds, body.near, body.far)


@pytest.mark.parametrize("kind", HULLS)
def test_hulls(kind: str, rng: np.random.Generator) -> None:
    tally = Tally()
    for _ in range(25 * SOAK):
        a, b = hull_pair(rng, kind)
        scale = rng.choice(EXTREMES)
        far = rng.choice([0.0, 0.0, 1.0, 500.0]) * rng.normal(size=3)
        bodies = [gs.Polytopes.from_list([(x + far) * scale]) for x in (a, b)]
        tally.see(*check(*bodies, None, *(corners_of(x) for x in bodies)))
    tally.require(apart=4, touching=1, wide=1, exact=1)


def random_frustum(rng: np.random.Generator, scale: float = 1.0) -> gs.Frustum:
    near = float(rng.choice([0.25, 0.5, rng.uniform(0.1, 1.0)])) * scale
    far = near * float(rng.choice([2.0, 4.0, rng.uniform(1.1, 5.0), 1e3]))
    turn = TURNS[rng.integers(len(TURNS))] if rng.random() < 0.5 else random_turn(rng)
    window = np.sort(rng.uniform(-1.0, 1.0, (2, 2)), axis=1) + [[0.0, 1e-3]]
    if rng.random() < 0.5:
        window = np.array([[-0.5, 0.5], [-0.25, 0.25]])
    origin = rng.choice([0.0, 0.5, rng.normal()], 3)
    return gs.Frustum(origin * scale, rotation(turn), near=near, far=far, bounds=(window * near).ravel())


@pytest.mark.parametrize("other", ["boxes", "polytopes", "frustum"])
def test_frusta(other: str, rng: np.random.Generator) -> None:
    """By their literal numbers, far over near as a ratio, in world coordinates; also after being brought to touch."""
    tally = Tally()
    for _ in range(25 * SOAK):
        a = random_frustum(rng)
        place = (np.mean(a.corners(), axis=0) + rng.normal(size=3)) * rng.choice([1.0, 1.0, 300.0])
        move = np.zeros(3)
        for step in range(2):
            b: Any
            if other == "boxes":
                b = gs.Boxes(
                    [place + move], [rotation(any_turn(rng)).T if step == 0 else b.axes[0]], [[0.5, 0.25, 1.0]]
                )
            elif other == "polytopes":
                b = gs.Polytopes.from_list([hull(rng, "block") + place if step == 0 else b.vertices + move])
            else:
                b = (
                    random_frustum(rng)
                    if step == 0
                    else gs.Frustum(b.origin + move, b.axes, near=b.near, far=b.far, bounds=b.bounds)
                )
            pair = (a, b) if rng.random() < 0.5 else (b, a)
            answer, signed = check(*pair, None, *(corners_of(x) for x in pair))
            tally.see(answer, signed)
            # Next to touching, or as near to it as rounding lets b come.
            gap = rng.choice([0.0, 1e-15, -1e-15, 1e-9])
            move = answer.normal[0] * (gap - answer.distance[0]) * (1.0 if pair[0] is a else -1.0)
    tally.require(apart=15, overlapping=5, close=5, wide=15)


# ----------------------------------------------------------------------------------------------- shapes and poses

SHAPES = ("box", "convex", "triangle", "segment", "point", "frustum")


def body(rng: np.random.Generator, kind: str) -> Any:
    if kind == "box":
        return gs.Box(rng.choice([0.5, 1.0, rng.uniform(0.1, 2.0), 0.0], 3, p=[0.3, 0.3, 0.3, 0.1]))
    if kind == "convex":
        return gs.Convex(hull(rng, HULLS[rng.integers(len(HULLS))]))
    if kind == "frustum":
        return random_frustum(rng)
    points = rng.choice([-1.0, 0.0, 0.5, 1.0], (3, 3)) if rng.random() < 0.5 else rng.normal(size=(3, 3))
    return {"triangle": gs.Triangle, "segment": gs.Segment, "point": gs.Point}[kind](
        *points[: {"triangle": 3, "segment": 2, "point": 1}[kind]]
    )


def vertices_of(shape: Any) -> list[Any]:
    """In the shape's own frame, exactly."""
    return frustum_corners(shape) if isinstance(shape, gs.Frustum) else [vectors.exact(v) for v in core(shape)[0]]


def at_pose(vertices: list[Any], pose: np.ndarray) -> list[Any]:
    matrix = [vectors.exact(row) for row in rotation(pose[3:]).tolist()]
    shift = vectors.exact(pose[:3].tolist())
    return [vectors.add(tuple(vectors.dot(row, v) for row in matrix), shift) for v in vertices]


@pytest.mark.parametrize(("kind_a", "kind_b"), list(itertools.combinations_with_replacement(SHAPES, 2)))
def test_shapes_at_poses(kind_a: str, kind_b: str, rng: np.random.Generator) -> None:
    tally = Tally()
    for _ in range(10 * SOAK):
        a, b = body(rng, kind_a), body(rng, kind_b)
        if rng.random() < 0.5:
            a, b = b, a
        turn = any_turn(rng)
        pose = np.append(rng.choice([0.0, 0.5, -1.0, rng.normal(), 300.0], 3, p=[0.3, 0.2, 0.2, 0.2, 0.1]), turn)
        pose[3:] /= np.linalg.norm(pose[3:])
        answer, signed = check(a, b, pose, vertices_of(a), at_pose(vertices_of(b), pose))
        tally.see(answer, signed)
        pose[:3] += answer.normal[0] * (rng.choice([0.0, 1e-15, -1e-15]) - answer.distance[0])
        tally.see(*check(a, b, pose, vertices_of(a), at_pose(vertices_of(b), pose)))
    tally.require(apart=4, wide=4)
