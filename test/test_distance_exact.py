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
    ordinary_hull,
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

# A normal's length: three parts rounded by half an eps each, and four roundings of the norm computed here.
UNIT_LENGTH = 4 * 2.0**-53
# Heights and steps of rounded points along a normal, times their size: a point takes a product and a sum for each of
# up to four vertices of a feature, a height three products and sums more, and the normal is off by two units.
HEIGHT = 8 * 2.0**-53
# Of witnesses found in doubles, whose distance is not that of the nearest points, in scenes of size 1: hundreds of
# units in the worst case of a thin triangle, and far less than what a wrong simplex is off by.
ROUGH_WITNESS = 1e-12


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
    slack = HEIGHT * (3.0 * reach + 2.0)  # three coordinates, and those of the unit, which is 1
    normal, d = answer.normal[0], answer.distance[0] * unit
    step = (answer.point_b[0] - answer.point_a[0]) * unit
    assert abs(np.linalg.norm(normal) - 1.0) <= UNIT_LENGTH, text
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
        axes, move = rotation(any_turn(rng)).T, np.zeros(3)
        b: Any = None
        for step in range(2):
            if other == "boxes":
                b = gs.Boxes([place + move], [axes], [[0.5, 0.25, 1.0]])
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
    """In the shape's own frame, exactly, in the engine's order."""
    if isinstance(shape, gs.Box):
        return polytope.box_corners([0, 0, 0], np.eye(3).tolist(), shape.half_extents.tolist())
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


# ------------------------------------------------------------------------------------------------ constructed


def test_touching_on_a_lattice() -> None:
    """Face to face, edge to edge, corner to corner, corner in face, edges across: exactly 0, and 2^-51 either side."""
    turned = [rotation(turn / np.linalg.norm(turn)) for turn in ([0, 0, 0, 1.0], [0.5, 0.5, 0.5, 0.5])]
    half = np.array([0.5, 0.25, 1.0])
    steps = [[1, 0.25, 0.5], [1, 0.5, 0.125], [1, 0.5, 2], [0.25, 0.5, 0.5], [0.125, 0.25, 2]]
    for matrix, step, kind in itertools.product(turned, steps, ("boxes", "polytopes")):
        for nudge, expected in ((0.0, 0.0), (2.0**-51, 2.0**-51), (-(2.0**-51), -(2.0**-51))):
            k = next(i for i in range(3) if step[i] == 2 * half[i])
            moved = np.array(step)
            moved[k] += nudge
            bodies = [gs.Boxes([center @ matrix], [matrix], [half]) for center in (np.zeros(3), moved)]
            corners = [corners_of(x) for x in bodies]
            if kind == "polytopes":
                bodies = [gs.Polytopes.from_list([[[float(x) for x in v] for v in body]]) for body in corners]
            answer, signed = check(*bodies, None, *corners)
            others = [i for i in range(3) if i != k and step[i] >= 2 * half[i]]
            if not others:
                assert answer.distance[0] == expected, (step, nudge)
            assert (signed > 0) == (nudge > 0)


def test_ties_of_depth() -> None:
    """Concentric cubes, equal or not, turned by a right angle: six facets are as near; the normal is one of them."""
    for size, turn in itertools.product((1.0, 0.5, 0.1, 3.0), TURNS[:3]):
        a, b = gs.Box([1.0, 1.0, 1.0]), gs.Box([size] * 3)
        pose = np.append(np.zeros(3), turn / np.linalg.norm(turn))
        answer, _ = check(a, b, pose, vertices_of(a), at_pose(vertices_of(b), pose))
        hulls = [gs.Convex([[float(x) for x in v] for v in vertices_of(x)]) for x in (a, b)]
        other, _ = check(*hulls, pose, vertices_of(a), at_pose(vertices_of(b), pose))
        assert answer.distance[0] == other.distance[0]
        if (turn == TURNS[0]).all():
            assert answer.distance[0] == -(1.0 + size)


def test_flat_bodies_have_no_depth() -> None:
    """The difference of coplanar bodies has no inside: they touch, or are apart."""
    triangle = gs.Triangle([0, 0, 0], [1, 0, 0], [0, 1, 0])
    segment = gs.Segment([0.1, 0.1, 0], [0.3, 0.7, 0])
    flat = gs.Box([1.0, 1.0, 0.0])
    for a, b in itertools.product((triangle, segment, flat, gs.Point([0.25, 0.25, 0])), repeat=2):
        for height in (0.0, 5e-324, -1e-300, 1.0):
            pose = np.array([0.0, 0.0, height, 0, 0, 0, 1])
            answer, signed = check(a, b, pose, vertices_of(a), at_pose(vertices_of(b), pose))
            assert answer.distance[0] == abs(height) or signed > 0


def test_tiny_gaps_far_away() -> None:
    """Gaps of 1e-16 hundreds of metres from the origin, and distances of hundreds of metres."""
    rng = np.random.default_rng(5)
    for _ in range(40):
        far = rng.uniform(100, 900, 3)
        axes = rotation(random_turn(rng)).T
        a = gs.Boxes([far], [axes], [[0.5, 0.25, 1.0]])
        center = far + axes[0] * rng.choice([1.0, 1.0, 300.0]) + rng.choice([0.0, 1e-13]) * rng.normal(size=3)
        b = gs.Boxes([center], [axes], [[0.5, 0.5, 0.5]])
        check(a, b, None, corners_of(a), corners_of(b))


# ------------------------------------------------------------------------------------------------------- laws


def numbers(answer: gs.Distances) -> tuple[float, ...]:
    return tuple(float(x[0]) for x in (answer.distance, answer.lower, answer.upper))


def exactly(a: Any, b: Any, pose: np.ndarray | None = None) -> tuple[float, ...]:
    return numbers(gs.distance(a, b, pose, want=DEEP, accuracy="exact"))


def permuted(body: Any, rng: np.random.Generator) -> Any:
    """The same set of points by other numbers: axes and vertices in another order, turned round."""
    if isinstance(body, gs.Boxes):
        order, sign = rng.permutation(3), rng.choice([-1.0, 1.0], (3, 1))
        return gs.Boxes(body.center, [body.axes[0][order] * sign], body.half_extents[:, order])
    if isinstance(body, gs.Frustum):
        (l0, l1, u0, u1), (left, up, view) = body.bounds, body.axes
        return gs.Frustum(body.origin, [up, -left, view], near=body.near, far=body.far, bounds=(u0, u1, -l1, -l0))
    return gs.Polytopes.from_list([rng.permutation(np.concatenate([body.vertices, body.vertices[:1]]))])


def scaled(body: Any, scale: float) -> Any:
    if isinstance(body, gs.Boxes):
        return gs.Boxes(body.center * scale, body.axes, body.half_extents * scale)
    if isinstance(body, gs.Frustum):
        window = np.array(body.bounds) * scale
        return gs.Frustum(body.origin * scale, body.axes, near=body.near * scale, far=body.far * scale, bounds=window)
    return gs.Polytopes(body.vertices * scale, body.offsets)


def shifted(body: Any, step: np.ndarray) -> Any:
    if isinstance(body, gs.Boxes):
        return gs.Boxes(body.center + step, body.axes, body.half_extents)
    if isinstance(body, gs.Frustum):
        return gs.Frustum(body.origin + step, body.axes, near=body.near, far=body.far, bounds=body.bounds)
    return gs.Polytopes(body.vertices + step, body.offsets)


def on_a_grid(x: Any) -> np.ndarray:
    """Multiples of 2^-20, so that shifts by whole numbers round nothing."""
    return np.round(np.asarray(x) * 2.0**20) / 2.0**20


def test_laws_hold_to_the_last_bit(rng: np.random.Generator) -> None:
    """Swap, permutation, scale and translation change no bit of distance, lower and upper."""
    tally: Counter[str] = Counter()
    for _ in range(300 * SOAK):
        bodies = []
        for kind in rng.integers(3, size=2):
            place = on_a_grid(rng.normal(size=3) * rng.choice([0.1, 1.0, 3.0]))
            if kind == 0:
                bodies.append(gs.Boxes([place], [rotation(any_turn(rng)).T], on_a_grid([rng.uniform(0.2, 1.0, 3)])))
            elif kind == 1:
                bodies.append(gs.Polytopes.from_list([on_a_grid(rng.normal(size=(8, 3)) + place)]))
            else:
                body = random_frustum(rng)
                bodies.append(gs.Frustum(place, body.axes, near=body.near, far=body.far, bounds=body.bounds))
        a, b = bodies
        one = exactly(a, b)
        text = reproducer(a=vars(a), b=vars(b))
        tally["apart" if one[0] > 0 else "overlapping"] += 1
        assert exactly(b, a) == one, text
        assert exactly(permuted(a, rng), permuted(b, rng)) == one, text
        for scale in (2.0**-300, 2.0**-3, 2.0**200, 2.0**600):
            assert exactly(scaled(a, scale), scaled(b, scale)) == tuple(x * scale for x in one), text
        step = np.array([2.0**9, -(2.0**7), 3.0])
        assert exactly(shifted(a, step), shifted(b, step)) == one, text
    assert min(tally.values()) > 40, tally


def test_row_by_row(rng: np.random.Generator) -> None:
    """A batch answers what its pairs answer alone, one body against many included."""
    count = 60
    boxes = gs.Boxes.from_poses(np.c_[rng.normal(size=(count, 3)), [random_turn(rng) for _ in range(count)]], [0.5] * 3)
    hull_ = gs.Polytopes.from_list([ordinary_hull(rng)])
    for a, b in ((boxes, hull_), (random_frustum(rng), boxes)):
        batch = gs.distance(a, b, want=DEEP, accuracy="exact")
        for i in range(count):
            one = gs.Boxes(boxes.center[i : i + 1], boxes.axes[i : i + 1], boxes.half_extents[i : i + 1])
            alone = gs.distance(one if a is boxes else a, one if b is boxes else b, want=DEEP, accuracy="exact")
            for name in ("distance", "lower", "upper", "normal", "point_a", "point_b"):
                assert np.array_equal(getattr(batch, name)[i], getattr(alone, name)[0]), name
        assert sum(batch.cost.counts.get(name, 0) for name in ("filter", "wide", "exact")) == batch.cost.counts["ok"]


# --------------------------------------------------------------------------------------------------- evidence


def simplex_of(a: Any, b: Any, pose: np.ndarray | None, accuracy: str, penetration: bool) -> list[tuple[int, int]]:
    if pose is None:
        side = {gs.Boxes: ("center", "axes", "half_extents"), gs.Polytopes: ("vertices", "offsets")}
        sides = [
            (x.packed(),) if isinstance(x, gs.Frustum) else tuple(getattr(x, name) for name in side[type(x)])
            for x in (a, b)
        ]
        found = _core.distance_world(*sides, penetration, accuracy, True)
    else:
        frusta = np.array([x.packed() if isinstance(x, gs.Frustum) else np.zeros(18) for x in (a, b)])
        pairs = np.array([[0, 1]])
        found = _core.distance_pairs(*pack([a, b]), pairs, pose[None], penetration, accuracy, True, frusta)
    assert found[8].dtype == np.int32 and found[8].shape == (1, 4, 2)
    rows = found[8][0].tolist()
    used = [tuple(row) for row in rows if row[0] >= 0]
    assert rows[len(used) :] == [[-1, -1]] * (4 - len(used)) and used
    return used  # type: ignore[return-value]


@pytest.mark.parametrize("penetration", [False, True])
def test_the_simplex_proves_the_answer(penetration: bool, rng: np.random.Generator) -> None:
    """Its least point is 0 where the bodies meet, else as long as the distance."""
    tally: Counter[str] = Counter()
    for _ in range(60 * SOAK):
        k = rng.integers(4)
        pose = None
        a: Any
        b: Any
        if k == 0:
            half_a, axes_a, center, half_b, axes_b = box_pair(rng)
            a, b = gs.Boxes([np.zeros(3)], [axes_a], [half_a]), gs.Boxes([center], [axes_b], [half_b])
        elif k == 1:
            a, b = (gs.Polytopes.from_list([x]) for x in hull_pair(rng, HULLS[rng.integers(len(HULLS))]))
        elif k == 2:
            a, b = random_frustum(rng), gs.Boxes([rng.normal(size=3)], [rotation(any_turn(rng)).T], [[0.5, 0.2, 0.3]])
        else:
            a, b = (body(rng, SHAPES[rng.integers(len(SHAPES))]) for _ in range(2))
            pose = np.append(rng.normal(size=3), any_turn(rng))
            pose[3:] /= np.linalg.norm(pose[3:])
        if pose is None:
            vertices_a, vertices_b = corners_of(a), corners_of(b)
        else:
            vertices_a, vertices_b = vertices_of(a), at_pose(vertices_of(b), pose)
        least = polytope.squared_distance(vertices_a, vertices_b)
        for accuracy in ("exact", "float64"):
            pairs = simplex_of(a, b, pose, accuracy, penetration)
            points = [vectors.sub(vertices_b[j], vertices_a[i]) for i, j in pairs]
            square = polytope.squared_distance([(0, 0, 0)], points)
            if accuracy == "exact":
                assert square == least, reproducer(a=vars(a), b=vars(b), pose=pose)
            else:
                assert least <= square <= (math.sqrt(least) + ROUGH_WITNESS) ** 2, reproducer(
                    a=vars(a), b=vars(b), pose=pose
                )
        tally["meet" if least == 0 else "apart"] += 1
    assert min(tally.values()) > 10, tally


# ------------------------------------------------------------------------------------------------------ curved


@pytest.mark.parametrize("kind", ["sphere", "capsule"])
@pytest.mark.parametrize("other", ["sphere", "capsule", "box", "convex", "frustum"])
def test_curved_shapes(kind: str, other: str, rng: np.random.Generator) -> None:
    """The core's distance is exact and the radii are taken off outwards: two or three doubles are left."""
    tally: Counter[str] = Counter()
    for _ in range(20 * SOAK):
        a = gs.Sphere(rng.choice([0.5, 0.1])) if kind == "sphere" else gs.Capsule(rng.choice([0.5, 0.1]), 2.0)
        b = body(rng, other) if other not in ("sphere", "capsule") else (
            gs.Sphere(0.25) if other == "sphere" else gs.Capsule(0.3, 1.0)
        )  # fmt: skip
        if rng.random() < 0.5:
            a, b = b, a
        place = rng.choice([0.0, 0.25, 0.75, rng.normal()], 3) * rng.choice([1.0, 4.0], p=[0.7, 0.3])
        middles = [np.mean([[float(x) for x in v] for v in vertices_of(body)], axis=0) for body in (a, b)]
        pose = np.append(place + middles[0] - middles[1], any_turn(rng))
        pose[3:] /= np.linalg.norm(pose[3:])
        square = polytope.separation(vertices_of(a), at_pose(vertices_of(b), pose)).signed_square
        radii = sum(Fraction(getattr(x, "radius", 0.0)) for x in (a, b))
        answer = gs.distance(a, b, pose, want=DEEP, accuracy="exact")
        text = reproducer(a=vars(a), b=vars(b), pose=pose)
        lower, upper = (Fraction(float(x[0])) for x in (answer.lower, answer.upper))
        assert vectors.compare_root(lower + radii, square) <= 0 <= vectors.compare_root(upper + radii, square), text
        size = max(float(upper), float(radii), 1.0, math.sqrt(abs(square)))
        assert upper - lower <= 2 * Fraction(math.ulp(size)) and lower <= Fraction(answer.distance[0]) <= upper, text
        meet = gs.intersects(a, b, pose, accuracy="exact")
        truth = vectors.compare_root(radii, square) >= 0
        tally["certain"] += bool(meet.certain[0])
        assert not meet.certain[0] or meet.value[0] == truth, text
        tally["meet" if truth else "apart"] += 1
    assert tally["certain"] >= 19 * SOAK and tally["meet"] >= 2 <= tally["apart"], tally


def test_spheres_that_touch_are_known_to() -> None:
    for a, b, x in ((0.5, 0.25, 0.75), (1.0, 2.0, 3.0)):
        pose = [x, 0, 0, 0, 0, 0, 1]
        answer = gs.distance(gs.Sphere(a), gs.Sphere(b), pose, accuracy="exact")
        assert numbers(answer) == (0.0, 0.0, 0.0)
        meet = gs.intersects(gs.Sphere(a), gs.Sphere(b), pose, accuracy="exact")
        assert meet.value[0] and meet.certain[0]
