# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""Pairs of shapes that are hard to tell apart, and what exact arithmetic says about them."""

from __future__ import annotations

import math
from collections import Counter
from fractions import Fraction
from typing import Any

import numpy as np
from conftest import reproducer
from oracle import polytope, vectors

import geomsrv as gs
from geomsrv import _core, _validate
from geomsrv.shapes import pack

EPS = float(np.finfo(float).eps)
STAGES = ("none", "closed_form", "gjk", "gjk_wide", "facet_axes", "hull")  # order of Stage in separation.hpp

# No interval may be wider than this times the reach of the scene: kPromisedWidth (80 u) and the vertices' own rounding.
WIDEST = 100 * EPS / 2

# Rounding of points and laws: a dozen operations on coordinates of the size of the scene.
ROUNDING = 16 * EPS

HALF = math.sqrt(0.5)
TURNS = np.array([[0, 0, 0, 1], [0, 0, HALF, HALF], [0.5, 0.5, 0.5, 0.5], [1, 0, 0, 0], [HALF, 0, 0, HALF]])


# ------------------------------------------------------------------------------------------------------ poses


def random_turn(rng: np.random.Generator) -> np.ndarray:
    turn = rng.normal(size=4)
    return turn / np.linalg.norm(turn)


def slight_turn(rng: np.random.Generator) -> np.ndarray:
    """About a random axis, by 1e-16 to 1e-3 rad."""
    axis, angle = rng.normal(size=3), 10.0 ** rng.uniform(-16.0, -3.0)
    return np.append(axis / np.linalg.norm(axis) * math.sin(angle / 2.0), math.cos(angle / 2.0))


def any_turn(rng: np.random.Generator) -> np.ndarray:
    """In general position, on a lattice, or just off one."""
    k = rng.integers(3)
    return random_turn(rng) if k == 0 else TURNS[rng.integers(len(TURNS))] if k == 1 else slight_turn(rng)


def rotation(turn: np.ndarray) -> np.ndarray:
    """The matrix that the engine takes literally."""
    return matrix_of(_validate.poses(np.append(np.zeros(3), turn))[0])


def matrix_of(pose: np.ndarray) -> np.ndarray:
    """The same of a pose that is not normalised again."""
    return _validate.rotation_matrices(pose[None, 3:])[0]


# ----------------------------------------------------------------------------------------------- exact answers


def core(shape: Any) -> tuple[list[list[float]], float]:
    """Vertices and rounding radius."""
    if isinstance(shape, gs.Sphere):
        return [[0.0, 0.0, 0.0]], shape.radius
    if isinstance(shape, gs.Capsule):
        return [[0.0, 0.0, -shape.length / 2.0], [0.0, 0.0, shape.length / 2.0]], shape.radius
    if isinstance(shape, gs.Box):
        x, y, z = shape.half_extents.tolist()
        return [[i * x, j * y, k * z] for i in (-1, 1) for j in (-1, 1) for k in (-1, 1)], 0.0
    if isinstance(shape, gs.Frustum):
        return polytope.frustum_corners(  # type: ignore[return-value]
            shape.origin.tolist(), shape.axes.tolist(), shape.bounds, shape.near, shape.far
        ), 0.0
    return shape.vertices.tolist(), 0.0


def posed(vertices: Any, pose: np.ndarray) -> list[vectors.Vector]:
    """Vertices in the frame of a, exactly."""
    return _moved(vertices, rotation(pose[3:]), pose[:3])


def _moved(vertices: Any, matrix: np.ndarray, shift: np.ndarray) -> list[vectors.Vector]:
    rows, by = [vectors.exact(row) for row in matrix.tolist()], vectors.exact(shift.tolist())
    return [vectors.add(tuple(vectors.dot(row, vectors.exact(v)) for row in rows), by) for v in vertices]


def exact_pair(a: gs.Shape, b: gs.Shape, pose: np.ndarray) -> tuple[Fraction, Fraction]:
    """Signed square of the cores' distance (minus the squared depth), and the sum of the radii."""
    if isinstance(a, gs.HalfSpace) or isinstance(b, gs.HalfSpace):
        return exact_half_space((a, np.eye(3), np.zeros(3)), (b, rotation(pose[3:]), pose[:3]))
    (vertices_a, radius_a), (vertices_b, radius_b) = core(a), core(b)
    square = polytope.separation([vectors.exact(v) for v in vertices_a], posed(vertices_b, pose)).signed_square
    return square, Fraction(radius_a) + Fraction(radius_b)


PlacedShape = tuple[gs.Shape, np.ndarray, np.ndarray]  # with its matrix and position, both literal


def exact_half_space(a: PlacedShape, b: PlacedShape) -> tuple[Fraction, Fraction]:
    """The same of a half space and a body, whichever comes first."""
    plane, (body, *place) = (a, b) if isinstance(a[0], gs.HalfSpace) else (b, a)
    vertices, radius = core(body)
    normal, offset = exact_plane(*plane)
    excess = min(vectors.dot(normal, v) for v in _moved(vertices, *place)) - offset
    return excess * abs(excess) / vectors.squared_norm(normal), Fraction(radius)


def exact_plane(half_space: gs.HalfSpace, matrix: np.ndarray, shift: np.ndarray) -> tuple[vectors.Vector, Fraction]:
    """Normal m and offset of what the matrix makes of a half space: m . R x = n . x, so m is n times R^-1, not R^T."""
    rows = [vectors.exact(row) for row in matrix.tolist()]
    cofactors = [vectors.cross(rows[i - 2], rows[i - 1]) for i in range(3)]
    own = vectors.exact(half_space.normal.tolist())
    determinant = vectors.dot(rows[0], cofactors[0])
    normal = tuple(vectors.dot(row, own) / determinant for row in cofactors)
    return normal, Fraction(half_space.offset) + vectors.dot(normal, vectors.exact(shift.tolist()))


def signed_root(square: Fraction, radii: Fraction = Fraction(0)) -> float:
    """The signed distance, rounded."""
    root = vectors.root_bracket(abs(square))[0]
    return vectors.nearest_double((root if square > 0 else -root) - radii)


def in_interval(square: Fraction, radii: Fraction, lower: float, upper: float) -> bool:
    """Whether lower <= root - radii <= upper, without rounding."""
    return (
        vectors.compare_root(Fraction(lower) + radii, square)
        <= 0
        <= vectors.compare_root(Fraction(upper) + radii, square)
    )


# ------------------------------------------------------------------------------------------------------ scenes


def box_sizes(rng: np.random.Generator) -> np.ndarray:
    """Half extents: cube, lattice, slab, needle, anisotropic, flat."""
    k = rng.integers(6)
    thin = rng.uniform(0.5, 1.0, 3)
    return (
        np.ones(3) if k == 0
        else rng.choice([0.25, 0.5, 1.0, 2.0], 3) if k == 1
        else thin * [1.0, 1e-6, 1.0] if k == 2
        else thin * [1.0, 1e-6, 1e-6] if k == 3
        else rng.uniform(0.1, 1.0, 3) if k == 4
        else rng.choice([0.0, 0.5, 1.0], 3)
    )  # fmt: skip


def box_pair(rng: np.random.Generator) -> tuple[np.ndarray, ...]:
    """(half_a, axes_a, center_b, half_b, axes_b), a at the origin; near-parallel, near-touching, on a lattice, ..."""
    half_a, half_b = box_sizes(rng), box_sizes(rng)
    axes_a = rotation(random_turn(rng) if rng.random() < 0.5 else TURNS[rng.integers(len(TURNS))]).T
    k = rng.integers(4)
    axes_b = (
        rotation(random_turn(rng)).T if k == 0
        else rotation(slight_turn(rng)).T @ axes_a if k == 1
        else axes_a.copy() if k == 2
        else rotation(TURNS[rng.integers(len(TURNS))]).T @ axes_a
    )  # fmt: skip
    if rng.random() < 0.2:
        # Axes are literal up to a defect of 1e-2.
        axes_b = axes_b + rng.uniform(-1.0, 1.0, (3, 3)) * 10.0 ** rng.uniform(-17.0, -2.8)
    k = rng.integers(5)
    if k == 0:
        center = rng.choice([-1.0, -0.5, 0.0, 0.5, 1.0], 3) @ axes_a
    elif k == 1:
        center = rng.normal(size=3) * rng.choice([0.1, 1.0])
    elif k == 2:
        center = np.zeros(3)
    else:
        # Touching along a face normal or an edge-edge axis, up to a gap or overlap of 0 to 1e-3.
        axes = [axes_a[rng.integers(3)], axes_b[rng.integers(3)]]
        axes.append(np.cross(*axes))
        normal = axes[rng.integers(3)]
        normal = normal / np.linalg.norm(normal) if np.linalg.norm(normal) > 1e-30 else axes_a[0]
        reach = np.abs(axes_a @ normal) @ half_a + np.abs(axes_b @ normal) @ half_b
        aside = rng.normal(size=3) * rng.choice([0.0, 0.3])
        aside -= normal * (aside @ normal)
        center = normal * (reach + rng.choice([0.0, 1e-16, 1e-13, 1e-9, 1e-6, 1e-3]) * rng.choice([-1, 1])) + aside
    return half_a, axes_a, center, half_b, axes_b


HULLS = ("cloud", "lattice", "block", "slab", "needle", "flat", "segment", "octahedron", "redundant")


def hull(rng: np.random.Generator, kind: str) -> np.ndarray:
    """(k, 3) points whose hull is of the named kind; repeats, coplanar and collinear points and single points occur."""
    n = int(rng.integers(1, 11))
    points = rng.normal(size=(n, 3))
    if kind == "lattice":
        points = rng.integers(-1, 2, (n, 3)).astype(float)
    elif kind == "block":
        points = np.array([[x, y, z] for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (-1.0, 1.0)])
        points = points * rng.choice([0.5, 1.0, 2.0], 3)
    elif kind == "slab":
        points *= [1.0, 1e-6, 1.0]
    elif kind == "needle":
        points *= [1.0, 1e-6, 1e-6]
    elif kind == "flat":
        points[:, 2] = 0.0
    elif kind == "segment":
        points = points[:, :1] * rng.normal(size=3)
    elif kind == "octahedron":
        points = np.concatenate([np.eye(3), -np.eye(3)]) * rng.choice([1.0, 2.0], 3)
    elif kind == "redundant":
        points = np.concatenate([points, points[:2], (points[:1] + points[-1:]) / 2.0])
    return points @ rotation(random_turn(rng)).T if rng.random() < 0.5 else points


def ordinary_hull(rng: np.random.Generator) -> np.ndarray:
    """(12, 3) points on a sphere of radius 1: a hull in general position whose every point is a vertex."""
    points = rng.normal(size=(12, 3))
    return points / np.linalg.norm(points, axis=1, keepdims=True)


def hull_pair(rng: np.random.Generator, kind: str) -> tuple[np.ndarray, np.ndarray]:
    """Two hulls, the second now and then the first again or its mirror image, in a position where they nearly touch."""
    a, b = hull(rng, kind), hull(rng, HULLS[rng.integers(len(HULLS))])
    if rng.random() < 0.2:
        b = a[rng.permutation(len(a))] * rng.choice([1.0, -1.0])
    b = b - (b.max(axis=0) + b.min(axis=0)) / 2.0 + (a.max(axis=0) + a.min(axis=0)) / 2.0
    k = rng.integers(6)
    if k == 1:  # a common vertex
        b = b - b[rng.integers(len(b))] + a[rng.integers(len(a))]
    elif k == 2:
        b = b + rng.normal(size=3) * rng.choice([0.1, 0.5, 1.0, 3.0])
    elif k == 3:
        b = b + rng.choice([-1.0, -0.5, 0.0, 0.5, 1.0], 3)
    elif k >= 4:  # touching along a direction
        normal = rng.normal(size=3) if k == 4 else np.eye(3)[rng.integers(3)]
        normal /= np.linalg.norm(normal)
        gap = rng.choice([0.0, 1e-16, 1e-12, 1e-8, 1e-4]) * rng.choice([-1, 1])
        b = b + normal * ((a @ normal).max() - (b @ normal).min() + gap)
    return a, b


def shape(rng: np.random.Generator, kind: str) -> gs.Shape:
    """A shape of a kind with a kernel; sizes of 0 and 1e-6 occur."""
    radius = float(rng.choice([0.5, 1.0, rng.uniform(0.1, 1.0), 1e-6, 0.0]))
    if kind == "sphere":
        return gs.Sphere(radius)
    if kind == "capsule":
        return gs.Capsule(radius, float(rng.choice([0.0, 1.0, 2.0, rng.uniform(0.1, 3.0)])))
    if kind == "box":
        return gs.Box(rng.choice([0.0, 0.5, 1.0, rng.uniform(0.1, 2.0), 1e-6], 3))
    if kind == "convex":
        return gs.Convex(hull(rng, HULLS[rng.integers(len(HULLS))]))
    normal = rng.normal(size=3) if rng.random() < 0.5 else np.eye(3)[rng.integers(3)] * rng.choice([-1, 1])
    return gs.HalfSpace(normal, float(rng.choice([0.0, 0.5, -1.0, rng.normal()])))


def shape_pose(rng: np.random.Generator, a: gs.Shape, b: gs.Shape) -> np.ndarray:
    """(7,) pose of b in a: concentric, coaxial, on a lattice, near, or brought to touching within 1e-9."""
    k = rng.integers(5)
    position = (
        np.zeros(3) if k == 0
        else rng.normal(size=3) if k == 1
        else rng.choice([-1.0, -0.5, 0.0, 0.5, 1.0, 2.0], 3) if k == 2
        else rng.normal(size=3) * 1e-9 if k == 3
        else np.eye(3)[rng.integers(3)] * rng.choice([0.5, 1.0, 1.5, 2.0, rng.uniform(0.0, 3.0)])
    )  # fmt: skip
    pose = _validate.poses(np.append(position, any_turn(rng)))[0]
    if rng.random() < 0.3:
        answer = gs.distance(a, b, pose, want=("penetration",))
        if np.isfinite(answer.normal).all() and np.isfinite(answer.distance).all():
            gap = rng.choice([0.0, 1e-15, 1e-12, 1e-9]) * rng.choice([-1, 1])
            pose[:3] -= answer.normal[0] * (answer.distance[0] + gap)
    return pose


# ---------------------------------------------------------------------------------------------------- checking


class Tally:
    """Counts what a random test has seen, so that it can prove that it saw the hard branches."""

    def __init__(self) -> None:
        self.counts: Counter[str] = Counter()

    def add(self, stage: int, square: Fraction, radii: Fraction = Fraction(0)) -> None:
        self.counts[STAGES[stage]] += 1
        relation = vectors.compare_root(radii, square)
        self.counts["apart" if relation < 0 else "overlapping" if relation > 0 else "touching"] += 1

    def require(self, **least: int) -> None:
        print(dict(self.counts))
        assert all(self.counts[name] >= count for name, count in least.items()), (dict(self.counts), least)


def check_answer(
    answer: gs.Distances, unsigned: gs.Distances, square: Fraction, radii: Fraction, reach: float, **inputs: Any
) -> None:
    """One pair's answers with and without depth: intervals, widths and laws; `reach` is the size of the scene."""
    lower, upper, value = (float(x[0]) for x in (answer.lower, answer.upper, answer.distance))
    text = reproducer(**inputs)
    assert answer.status[0] == gs.DistanceStatus.OK, text
    assert lower <= value <= upper, (lower, value, upper, text)
    assert in_interval(square, radii, lower, upper), (lower, upper, signed_root(square, radii), text)
    assert upper - lower <= WIDEST * reach, (upper - lower, reach, text)
    # Without depth: the positive part of the same.
    low, high = float(unsigned.lower[0]), float(unsigned.upper[0])
    apart = vectors.compare_root(radii, square) < 0
    assert 0.0 <= low <= unsigned.distance[0] <= high, (low, high, text)
    assert in_interval(square, radii, low, high) if apart else low == 0.0, (low, high, signed_root(square, radii), text)
    # p_b = p_a + d n, n of unit length.
    normal = answer.normal[0]
    assert abs(np.linalg.norm(normal) - 1.0) <= 4 * EPS, text
    slack = ROUNDING * max(reach, float(np.abs(answer.point_a).max()), float(np.abs(answer.point_b).max()))
    assert np.abs(answer.point_b[0] - answer.point_a[0] - value * normal).max() <= slack, text


def stages_of_pair(a: gs.Shape, b: gs.Shape, pose: np.ndarray, penetration: bool = True) -> tuple[int, int]:
    stage, iterations = _core.distance_pairs_stages(*pack([a, b]), np.array([[0, 1]]), pose.reshape(1, 7), penetration)
    return int(stage[0]), int(iterations[0])
