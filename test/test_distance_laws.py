# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""Distance in 3D: near-degenerate scenes judged by exact arithmetic, and the laws that any right answer obeys.

Checked by hand that these mutations of the kernels turn a test here red: the sign of a face's weight in gjk.cpp, the
doubt about a tetrahedron that holds the origin set to 0, a generator left out in facet_axes.cpp, the orientation sign
in growing_hull.cpp, kGapError and kDifferenceError set to 0, the depth's sign in convex_convex.cpp.
"""

from __future__ import annotations

import itertools
import os

import numpy as np
import pytest
from conftest import reproducer
from distance_scenes import (
    EPS,
    HULLS,
    ROUNDING,
    Tally,
    box_pair,
    check_answer,
    exact_pair,
    hull,
    hull_pair,
    random_turn,
    rotation,
    shape,
    shape_pose,
    signed_root,
    stages_of_pair,
)
from oracle import polytope

import geomsrv as gs
from geomsrv import _core

SOAK = 20 if os.environ.get("GEOMSRV_SOAK") else 1
KINDS = ("sphere", "capsule", "box", "convex", "half_space")
PAIRS = [pair for pair in itertools.product(KINDS, KINDS) if pair != ("half_space", "half_space")]
DEEP = ("penetration",)


# ------------------------------------------------------------------------------------- against exact arithmetic


def test_boxes_against_the_oracle(rng: np.random.Generator) -> None:
    tally = Tally()
    for _ in range(240 * SOAK):
        half_a, axes_a, center, half_b, axes_b = box_pair(rng)
        scale = 2.0 ** rng.choice([0, 0, 0, -900, 900, -40, 40])
        far = rng.choice([0.0, 0.0, 0.0, 1e3]) * rng.normal(size=3) * scale
        a = gs.Boxes([far], [axes_a], [half_a * scale])
        b = gs.Boxes([center * scale + far], [axes_b], [half_b * scale])
        corners = [
            polytope.box_corners(x.center[0].tolist(), x.axes[0].tolist(), x.half_extents[0].tolist()) for x in (a, b)
        ]
        square = polytope.separation(*corners).signed_square
        # The centres differ by what is left after rounding them where they are.
        reach = (np.linalg.norm((b.center - a.center) / scale) + half_a.sum() + half_b.sum()) * 1.01 * scale
        answer, unsigned = gs.distance(a, b, want=DEEP), gs.distance(a, b)
        inputs = {"half_a": half_a, "axes_a": axes_a, "center": center, "half_b": half_b, "axes_b": axes_b}
        check_answer(answer, unsigned, square, 0, reach, far=far, scale=scale, **inputs)
        sides = [(box.center, box.axes, box.half_extents) for box in (a, b)]
        tally.add(_core.distance_world_stages(*sides, True)[0][0], square)
    tally.require(gjk=60, gjk_wide=1, facet_axes=80, hull=2, apart=60, overlapping=60, touching=2)


@pytest.mark.parametrize("kind", HULLS)
def test_hulls_against_the_oracle(kind: str, rng: np.random.Generator) -> None:
    tally = Tally()
    for _ in range(60 * SOAK):
        a, b = hull_pair(rng, kind)
        scale = 2.0 ** rng.choice([0, 0, 0, -900, 900, -30, 30])
        far = rng.choice([0.0, 0.0, 1.0, 1e3]) * rng.normal(size=3)
        a, b = (a + far) * scale, (b + far) * scale
        square = polytope.separation(a.tolist(), b.tolist()).signed_square
        bodies = gs.Polytopes.from_list([a]), gs.Polytopes.from_list([b])
        reach = np.linalg.norm(np.concatenate([a, b]) / scale - a.mean(axis=0) / scale, axis=1).max() * 4 * scale
        # Coordinates were rounded where they are; two single points at one place have no reach at all.
        reach = max(reach, 1e-30 * np.abs(a).max())
        answer, unsigned = gs.distance(*bodies, want=DEEP), gs.distance(*bodies)
        check_answer(answer, unsigned, square, 0, reach, a=a, b=b)
        sides = [(body.vertices, body.offsets) for body in bodies]
        tally.add(_core.distance_world_stages(*sides, True)[0][0], square)
    tally.require(gjk=20, hull=10 if kind != "segment" else 1, apart=15, touching=3)


@pytest.mark.parametrize(("kind_a", "kind_b"), PAIRS)
def test_shapes_against_the_oracle(kind_a: str, kind_b: str, rng: np.random.Generator) -> None:
    tally = Tally()
    for _ in range(30 * SOAK):
        a, b = shape(rng, kind_a), shape(rng, kind_b)
        pose = shape_pose(rng, a, b)
        square, radii = exact_pair(a, b, pose)
        answer, unsigned = gs.distance(a, b, pose, want=DEEP), gs.distance(a, b, pose)
        reach = np.linalg.norm(pose[:3]) + 8.0
        check_answer(answer, unsigned, square, radii, reach, a=vars(a), b=vars(b), pose=pose)
        tally.add(stages_of_pair(a, b, pose)[0], square, radii)
    tally.require(apart=3, overlapping=3)
    if "half_space" in (kind_a, kind_b) or {kind_a, kind_b} <= {"sphere", "capsule"}:
        tally.require(closed_form=25)


# --------------------------------------------------------------------------------------------------------- laws


def ordinary(rng: np.random.Generator, kind: str) -> gs.Shape:
    """A shape in general position: no size is 0, no faces are parallel."""
    if kind == "sphere":
        return gs.Sphere(rng.uniform(0.2, 1.0))
    if kind == "capsule":
        return gs.Capsule(rng.uniform(0.2, 0.6), rng.uniform(0.5, 2.0))
    if kind == "box":
        return gs.Box(rng.uniform(0.3, 1.0, 3))
    if kind == "half_space":
        return gs.HalfSpace(rng.normal(size=3), rng.normal())
    return gs.Convex(rng.normal(size=(int(rng.integers(8, 24)), 3)))


def moved(pose: np.ndarray, step: np.ndarray) -> np.ndarray:
    return np.concatenate([pose[:3] + step, pose[3:]])


@pytest.mark.parametrize(("kind_a", "kind_b"), PAIRS)
def test_moving_b_along_the_normal_by_the_distance_makes_contact(
    kind_a: str, kind_b: str, rng: np.random.Generator
) -> None:
    """Moving b by -(d + eps) n makes contact, by -(d - eps) n does not; overlapping bodies part the same way."""
    nudge, apart = 1e-12, 0
    for _ in range(40 * SOAK):
        a, b = ordinary(rng, kind_a), ordinary(rng, kind_b)
        pose = np.concatenate([rng.normal(size=3) * rng.choice([0.3, 2.0]), random_turn(rng)])
        answer = gs.distance(a, b, pose, want=DEEP)
        gap, normal = float(answer.distance[0]), answer.normal[0]
        apart += gap > 0.0
        text = reproducer(a=vars(a), b=vars(b), pose=pose)
        touching = gs.intersects(a, b, moved(pose, -(gap + nudge) * normal))
        clear = gs.intersects(a, b, moved(pose, -(gap - nudge) * normal))
        assert touching.value[0] and touching.certain[0], text
        assert not clear.value[0] and clear.certain[0], text
    assert 5 <= apart <= 40 * SOAK - 3


@pytest.mark.parametrize(("kind_a", "kind_b"), PAIRS)
def test_swap(kind_a: str, kind_b: str, rng: np.random.Generator) -> None:
    """b against a: the same distance, points exchanged, the normal turned round."""
    for _ in range(20 * SOAK):
        a, b = ordinary(rng, kind_a), ordinary(rng, kind_b)
        pose = np.concatenate([rng.normal(size=3) * 1.5, random_turn(rng)])
        matrix = rotation(pose[3:])
        back = np.concatenate([-matrix.T @ pose[:3], pose[3:] * [-1, -1, -1, 1]])
        one, other = gs.distance(a, b, pose, want=DEEP), gs.distance(b, a, back, want=DEEP)
        text = reproducer(a=vars(a), b=vars(b), pose=pose)
        size = 8.0 + np.linalg.norm(pose[:3])
        assert abs(one.distance[0] - other.distance[0]) <= ROUNDING * size, text
        # Far from ties, which general position avoids, points and normal agree too.
        assert np.allclose(one.normal[0], -matrix @ other.normal[0], atol=1e-9), text
        if "half_space" not in (kind_a, kind_b):
            assert np.allclose(one.point_a[0], matrix @ other.point_b[0] + pose[:3], atol=1e-9), text


def test_common_motion(rng: np.random.Generator) -> None:
    """Moving both bodies of a batch together moves the answer, and by whole numbers to the last bit."""
    n = 200
    axes = np.stack([rotation(random_turn(rng)).T for _ in range(2 * n)])
    halves = rng.uniform(0.2, 1.0, (2 * n, 3))
    # Multiples of 2^-20, so that a shift by whole metres is exact.
    centers = np.round(rng.normal(size=(2 * n, 3)) * 2.0**20) / 2.0**20
    a, b = gs.Boxes(centers[:n], axes[:n], halves[:n]), gs.Boxes(centers[n:], axes[n:], halves[n:])
    here = gs.distance(a, b, want=DEEP)
    shift = np.array([2.0**30, -(2.0**29), 2.0**31])
    there = gs.distance(
        gs.Boxes(a.center + shift, a.axes, a.half_extents),
        gs.Boxes(b.center + shift, b.axes, b.half_extents),
        want=DEEP,
    )
    for name in ("distance", "lower", "upper", "normal"):
        assert np.array_equal(getattr(here, name), getattr(there, name)), name
    assert np.abs(there.point_a - shift - here.point_a).max() <= EPS * 2.0**31

    turn = rotation(random_turn(rng))
    turned = gs.distance(
        gs.Boxes(a.center @ turn.T, a.axes @ turn.T, a.half_extents),
        gs.Boxes(b.center @ turn.T, b.axes @ turn.T, b.half_extents),
        want=DEEP,
    )
    assert np.abs(turned.distance - here.distance).max() <= 10 * ROUNDING
    assert (here.distance > 0.0).sum() > 20 < (here.distance < 0.0).sum()


@pytest.mark.parametrize("exponent", [-1040, -960, -520, -60, 60, 520, 960, 1015])
def test_scale_by_a_power_of_two(exponent: int, rng: np.random.Generator) -> None:
    """Twice the size, twice the distance, bit for bit, wherever no bits fall off the end of the number range."""
    scale, bits = 2.0**exponent, exponent > -960
    for kind_a, kind_b in PAIRS:
        for _ in range(4 * SOAK):
            a, b = ordinary(rng, kind_a), ordinary(rng, kind_b)
            pose = np.concatenate([rng.normal(size=3), random_turn(rng)])
            large = [scaled(x, scale) for x in (a, b)]
            one = gs.distance(a, b, pose, want=DEEP)
            other = gs.distance(*large, np.concatenate([pose[:3] * scale, pose[3:]]), want=DEEP)
            text = reproducer(a=vars(a), b=vars(b), pose=pose)
            assert other.status[0] == 0 and other.lower[0] <= other.distance[0] <= other.upper[0], text
            if bits:
                assert other.distance[0] == one.distance[0] * scale, text
                assert np.array_equal(other.normal, one.normal), text
                assert np.array_equal(other.point_a, one.point_a * scale), text
            else:
                assert abs(other.distance[0] / scale - one.distance[0]) <= 2.0**-1070 / scale, text


def scaled(body: gs.Shape, scale: float) -> gs.Shape:
    if isinstance(body, gs.Sphere):
        return gs.Sphere(body.radius * scale)
    if isinstance(body, gs.Capsule):
        return gs.Capsule(body.radius * scale, body.length * scale)
    if isinstance(body, gs.Box):
        return gs.Box(body.half_extents * scale)
    if isinstance(body, gs.HalfSpace):
        larger = gs.HalfSpace(body.normal, 0.0)
        object.__setattr__(larger, "normal", body.normal)
        object.__setattr__(larger, "offset", body.offset * scale)
        return larger
    return gs.Convex(body.vertices * scale)


@pytest.mark.parametrize("kind", ["slab", "needle"])
def test_nearest_points_of_slivers(kind: str, rng: np.random.Generator) -> None:
    """p_b = p_a + d n to rounding, also where the faces are 1e-6 wide and weights are hard to come by."""
    a, b = ([hull(rng, kind) + [x, 0, 0] for _ in range(2000)] for x in (0.0, 1.5))
    bodies = gs.Polytopes.from_list(a), gs.Polytopes.from_list(b)
    answer = gs.distance(*bodies, want=DEEP)
    gap = answer.point_b - answer.point_a - answer.distance[:, None] * answer.normal
    worst = int(np.abs(gap).max(axis=1).argmax())
    assert np.abs(gap).max() <= ROUNDING * 8.0, (gap[worst], reproducer(a=a[worst], b=b[worst]))
    assert answer.cost.counts == {"ok": 2000}
    assert (answer.distance > 0.0).sum() >= 500


def test_depth_never_exceeds_what_any_direction_needs(rng: np.random.Generator) -> None:
    """The depth is the least translation that parts two hulls: no sampled direction parts them sooner."""
    found = 0
    directions = rng.normal(size=(4000, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    for _ in range(40 * SOAK):
        a, b = (rng.normal(size=(12, 3)) for _ in range(2))
        answer = gs.distance(gs.Polytopes.from_list([a]), gs.Polytopes.from_list([b]), want=DEEP)
        if answer.distance[0] >= 0.0:
            continue
        found += 1
        sampled = ((directions @ a.T).max(axis=1) - (directions @ b.T).min(axis=1)).min()
        assert -answer.distance[0] <= sampled + ROUNDING * 8.0, reproducer(a=a, b=b)
        # And the separating translation is enough: exactly, up to rounding.
        step = answer.normal[0] * -answer.distance[0]
        left = polytope.separation(a.tolist(), (b + step).tolist()).signed_square
        assert abs(signed_root(left)) <= ROUNDING * 8.0, reproducer(a=a, b=b)
    assert found >= 25 * SOAK


def test_large_hulls(rng: np.random.Generator) -> None:
    """Hundreds of vertices on spheres: apart, grazing, deep, concentric; work is bounded and the answer proven."""
    for count, limit in ((40, 80), (300, 400)):
        a, b = (rng.normal(size=(count, 3)) for _ in range(2))
        a, b = (x / np.linalg.norm(x, axis=1, keepdims=True) for x in (a, b))
        for offset in (0.0, 1e-9, 0.5, 1.95, 2.0, 3.0):
            body = [gs.Convex(a), gs.Convex(b)]
            pose = np.array([offset, 0, 0, 0, 0, 0, 1.0])
            answer = gs.distance(*body, pose, want=DEEP)
            stage, iterations = stages_of_pair(*body, pose)
            assert answer.status[0] == 0 and iterations <= limit, (count, offset, stage, iterations)
            assert answer.upper[0] - answer.lower[0] <= 80 * EPS
            # Two balls that the hulls lie in: no deeper than those, and no nearer.
            assert offset - 2.0 - ROUNDING <= answer.distance[0] <= offset
