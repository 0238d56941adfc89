# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""Culling at every tier: "exact" is what exact arithmetic says; where the others are certain they agree."""

import os
from fractions import Fraction
from itertools import product

import numpy as np
import pytest
from conftest import hard_cases
from cull_scenes import (
    CAMERA,
    CONSTRUCTED,
    FRAMES,
    SCENES,
    boundary_points,
    corpus_scene,
    describe,
    exact_state,
    lattice,
    leaning,
    needles,
    ridge,
    scaled,
    scene,
    touching_scene,
    warehouse,
    with_view,
)
from oracle import frustum_box, polytope
from oracle.vectors import dot, exact, sub

import geomsrv as gs
from geomsrv import CullState, _core

ROUNDS = 20 if os.environ.get("GEOMSRV_SOAK") else 1
TIERS = ("bound", "float32", "float64", "exact")


class Stages(dict):
    """How many boxes each stage decided at the exact tier."""

    def add(self, answer):
        for stage, count in answer.cost.counts.items():
            self[stage] = self.get(stage, 0) + count


def check(frustum, boxes):
    """All tiers against exact arithmetic; returns the answer of the exact tier."""
    state = np.array([exact_state(frustum, boxes, i) for i in range(len(boxes))], int)
    for tier in TIERS:
        answer = gs.cull(frustum, boxes, accuracy=tier)
        assert answer.cost.accuracy == tier and sum(answer.cost.counts.values()) == len(boxes)
        wrong = np.flatnonzero((answer.state != state) & answer.certain)
        if tier == "exact":
            wrong = np.flatnonzero((answer.state != state) | ~answer.certain)
        elif tier == "bound":
            wrong = np.flatnonzero(answer.state != np.where(answer.certain, state, CullState.INTERSECTS))
            assert not (answer.certain & (answer.state == CullState.INTERSECTS)).any()
        assert len(wrong) == 0, (
            f"{tier}: {answer.state[wrong]} for {state[wrong]}\n{describe(frustum, boxes, wrong[0])}"
        )
        check_evidence(frustum, boxes, tier)
    return answer


# ---------------------------------------------------------------------------------------------------------- evidence

# Of planes, in the order of their numbers in the evidence.
PLANES = ("near", "far", "left+", "left-", "up+", "up-")


def check_evidence(frustum, boxes, tier):
    """What comes with every certain answer proves it."""
    packed, given = frustum.packed(), (boxes.center, boxes.axes, boxes.half_extents)
    state, certain, _, simplex, beyond = _core.cull(packed, *given, tier, True)
    assert simplex.shape == (len(boxes), 4, 2) and simplex.dtype == np.int32
    assert beyond.shape == (len(boxes), 2) and beyond.dtype == np.int8
    view = (frustum.origin, frustum.axes, frustum.bounds, frustum.near, frustum.far)
    found = dict(zip(frustum_box.FACES, frustum_box.frustum_planes(*view), strict=True))
    planes = [found[name] for name in PLANES]
    ends = _ends(frustum)
    for i in range(len(boxes)):
        corners = _corners(boxes, i)
        problem = f"{tier} {state[i]} {simplex[i].tolist()} {beyond[i].tolist()}\n{describe(frustum, boxes, i)}"
        if not certain[i] or state[i] == CullState.INSIDE:
            assert (simplex[i] == -1).all() and (beyond[i] == -1).all(), problem
            continue
        corner, plane = (int(x) for x in beyond[i])
        pairs = [(int(a), int(b)) for a, b in simplex[i] if b >= 0]
        if state[i] == CullState.OUTSIDE:
            assert corner == -1
            if plane >= 0:
                assert not pairs and all(_height(planes[plane], c) > 0 for c in corners), problem
            else:
                v = _nearest(ends, corners, pairs)
                assert any(v) and min(dot(v, c) for c in corners) > max(dot(v, c) for c in ends), problem
            continue
        assert _height(planes[plane], corners[corner]) > 0, problem
        if not pairs or pairs[0][0] < 0:
            assert len(pairs) <= 1
            point = corners[pairs[0][1]] if pairs else exact(boxes.center[i])
            assert all(_height(p, point) <= 0 for p in planes), problem
        else:
            assert not any(_nearest(ends, corners, pairs)), problem


def _height(plane, point):
    return dot(plane[0], point) - plane[1]


def _corners(boxes, i):
    """By number: bit k set where axis k is added."""
    center, axes, half = exact(boxes.center[i]), exact(boxes.axes[i]), exact(boxes.half_extents[i])
    signs = [tuple(1 if number >> k & 1 else -1 for k in range(3)) for number in range(8)]
    return [tuple(center[c] + sum(s[k] * half[k] * axes[k][c] for k in range(3)) for c in range(3)) for s in signs]


def _ends(frustum):
    """Corners of the frustum, number 4 far + 2 up + left."""
    (l0, l1, u0, u1), near, far = exact(frustum.bounds), exact(frustum.near), exact(frustum.far)
    origin, (left, up, view) = exact(frustum.origin), exact(frustum.axes)
    ends = []
    for number in range(8):
        x, y = (l0, l1)[number & 1], (u0, u1)[number >> 1 & 1]
        s = far / near if number & 4 else 1
        ends.append(tuple(origin[c] + s * (x * left[c] + y * up[c] + near * view[c]) for c in range(3)))
    return ends


def _nearest(ends, corners, pairs):
    """Point of conv {b - a} nearest to the origin."""
    zero = (Fraction(0),) * 3
    point, _ = polytope.nearest([sub(corners[b], ends[a]) for a, b in pairs], [zero])
    return point


# ------------------------------------------------------------------------------------------------------------ corpus

CORPUS = hard_cases("frustum_box")


@pytest.mark.parametrize("case", CORPUS, ids=[case["id"] for case in CORPUS])
def test_hard_case(case):
    answer = check(*corpus_scene(case))
    assert (answer.state[0] != CullState.OUTSIDE) == case["answer"]["intersects"]


# ------------------------------------------------------------------------------------------------- exactly touching


@pytest.mark.parametrize("exponent", [-1040, -996, -500, -20, 0, 500, 996])
@pytest.mark.parametrize("frame", FRAMES, ids=["world", "permuted", "left-handed"])
def test_constructed_at_any_scale(frame, exponent):
    axes, origin = np.array(frame), np.array([1024.0, -512.0, 64.0])
    center = origin + np.array([c[1] for c in CONSTRUCTED]) @ axes
    frustum, boxes = scaled(
        gs.Frustum(origin, axes, **CAMERA),
        gs.Boxes(center, np.tile(axes, (len(center), 1, 1)), [c[2] for c in CONSTRUCTED]),
        exponent,
    )
    answer = check(frustum, boxes)
    assert answer.state.tolist() == [c[3] for c in CONSTRUCTED]
    assert answer.cost.counts["wide"] + answer.cost.counts["exact"] >= 8


def test_lattice(rng):
    stages = Stages()
    for _ in range(10 * ROUNDS):
        stages.add(check(*lattice(rng, 12)))
    assert stages["wide"] + stages["exact"] >= 20 * ROUNDS, stages


def test_lattice_at_any_scale(rng):
    stages = Stages()
    for _ in range(6 * ROUNDS):
        stages.add(check(*scaled(*lattice(rng, 12), int(rng.integers(-996, 996)))))
    assert stages["wide"] + stages["exact"] >= 10 * ROUNDS, stages


@pytest.mark.parametrize("angle", [0.0, np.pi / 6], ids=["straight", "turned"])
@pytest.mark.parametrize("cell", [1.0, 0.37, 1e-150, 1e200])
def test_warehouse(cell, angle, rng):
    answer = check(*warehouse(rng, 30, cell, angle))
    counts = answer.cost.counts
    assert counts["wide"] + counts["exact"] >= 15, counts
    if cell == 1.0 and angle == 0.0:  # short numbers are no trouble
        assert counts["exact"] == 0


def test_boxes_of_no_extent_on_the_boundary(rng):
    """Points, segments and sheets on faces, edges and corners."""
    for _ in range(4 * ROUNDS):
        frustum, _ = lattice(rng, 1)
        half = rng.integers(0, 3, (12, 3)) / 2 * (rng.random((12, 3)) < 0.4)
        center = boundary_points(rng, frustum, 12)
        check(frustum, gs.Boxes(center, np.tile(frustum.axes, (12, 1, 1)), half))


# --------------------------------------------------------------------------------------------------- near-degenerate


def test_random_touching(rng):
    stages = Stages()
    for _ in range(4 * ROUNDS):
        stages.add(check(*touching_scene(rng, 12)))
    assert stages["wide"] >= 3 * ROUNDS, stages


def test_random_touching_at_any_scale(rng):
    stages = Stages()
    for _ in range(4 * ROUNDS):
        stages.add(check(*scaled(*touching_scene(rng, 12), int(rng.integers(-990, 990)))))
    assert stages["exact"] >= ROUNDS, stages


@pytest.mark.parametrize("ratio", [2.0, 1e6, 1e12], ids="f/n={:g}".format)
@pytest.mark.parametrize("angle", [1e-4, 1e-8, 1e-12, 1e-16])
def test_near_parallel_edges(angle, ratio, rng):
    """Axes that are almost null: rounded ones may point anywhere."""
    stages = Stages()
    for sign, _ in product((1, -1), range(2 * ROUNDS)):
        stages.add(check(*ridge(rng, angle, sign * 10.0 ** rng.uniform(-22, -15), ratio)))
    assert stages["wide"] + stages["exact"] >= 3 * ROUNDS, stages


def test_needles_along_edges(rng):
    """Between bodies whose only separating axis is lost in rounding."""
    stages = Stages()
    for _ in range(10 * ROUNDS):
        stages.add(check(*needles(rng, 12)))
    assert stages["wide"] + stages["exact"] >= 60 * ROUNDS, stages


def test_leaning_boxes_that_share_an_axis(rng):
    """Axes that the frustum has, too, stand for others only where these are the same lines."""
    outside, stages = 0, Stages()
    for _ in range(8 * ROUNDS):
        answer = check(*leaning(rng, 12))
        outside += np.count_nonzero(answer.state == CullState.OUTSIDE)
        stages.add(answer)
    assert 20 * ROUNDS <= outside <= 76 * ROUNDS and stages["wide"] >= ROUNDS, (outside, stages)


@pytest.mark.parametrize("name", SCENES)
def test_random(name, rng):
    for _ in range(ROUNDS):
        check(*scene(rng, 12, **SCENES[name]))


def test_needles_and_fans(rng):
    for left, up, near in product([1e-300, 1.0, 1e300], repeat=3):
        axes = np.array(FRAMES[rng.integers(3)])
        frustum = gs.Frustum([0, 0, 0], axes, left, up, near, near * 1e6)
        depth = near * np.array([1.0, 3.0, 1e3])
        with np.errstate(over="ignore"):
            sides = np.minimum(np.array([left, up]) * (depth / near)[:, None], 1e307)
        middle = np.column_stack([sides * rng.choice([-1, 1], (3, 2)), depth])
        check(frustum, gs.Boxes(middle @ axes, np.tile(axes, (3, 1, 1)), np.abs(middle) * [[0.0], [0.1], [0.25]]))


# -------------------------------------------------------------------------------------------------------------- laws


@pytest.fixture
def crowd(rng):
    """A frustum and boxes of which a third touch up to rounding, and some exactly."""
    frustum, boxes = warehouse(rng, 100, 0.37, 0.3)
    l0, _, _, u1 = frustum.bounds
    more = touching_scene(rng, 100)[1]
    corner = frustum.origin + np.array([[l0, u1, frustum.near]]) @ frustum.axes
    return frustum, gs.Boxes(
        np.concatenate([boxes.center, more.center, corner]),
        np.concatenate([boxes.axes, more.axes, boxes.axes[:1]]),
        np.concatenate([boxes.half_extents, more.half_extents, [[0.5, 0.25, 0.125]]]),
    )


def check_same(one, other, tier="exact"):
    a, b = gs.cull(*one, accuracy=tier), gs.cull(*other, accuracy=tier)
    assert (a.state == b.state).all() and (a.certain == b.certain).all()


def test_swap_and_mirror_change_no_bit(crowd):
    frustum, boxes = crowd
    l0, l1, u0, u1 = frustum.bounds
    check_same(crowd, (with_view(frustum, frustum.axes[[1, 0, 2]], (u0, u1, l0, l1)), boxes))
    check_same(crowd, (with_view(frustum, frustum.axes * [[-1], [1], [1]], (-l1, -l0, u0, u1)), boxes))


def test_order_and_sign_of_box_axes_change_no_bit(crowd):
    frustum, boxes = crowd
    for order in ([2, 0, 1], [1, 0, 2]):
        turned = boxes.axes[:, order] * [[[-1], [1], [-1]]]
        check_same(crowd, (frustum, gs.Boxes(boxes.center, turned, boxes.half_extents[:, order])))


def test_order_of_coordinates_changes_no_bit(crowd):
    frustum, boxes = crowd
    order = [1, 2, 0]
    view = {"bounds": frustum.bounds, "near": frustum.near, "far": frustum.far}
    turned = gs.Frustum(frustum.origin[order], frustum.axes[:, order], **view)
    check_same(crowd, (turned, gs.Boxes(boxes.center[:, order], boxes.axes[:, :, order], boxes.half_extents)))


@pytest.mark.parametrize("tier", TIERS)
@pytest.mark.parametrize("exponent", [-990, -400, -1, 7, 400, 990])
def test_power_of_two_scale_changes_no_bit(crowd, exponent, tier):
    check_same(crowd, scaled(*crowd, exponent), tier)


def test_exact_translation_changes_no_bit(crowd):
    frustum, boxes = crowd
    grid = 2.0**-20
    view = {"bounds": frustum.bounds, "near": frustum.near, "far": frustum.far}
    center = np.round(boxes.center / grid) * grid

    def moved(by):
        return gs.Frustum(by, frustum.axes, **view), gs.Boxes(center + by, boxes.axes, boxes.half_extents)

    check_same(moved(np.zeros(3)), moved(np.array([2.0**25, -(2.0**24), 3.0 * 2.0**23])))


@pytest.mark.parametrize("tier", TIERS)
def test_batches_of_any_length_agree(crowd, tier):
    frustum, boxes = crowd
    whole = gs.cull(frustum, boxes, accuracy=tier)
    for count in (0, 1, 3, 4, 5, 7, 8, 9, 200):
        part = gs.Boxes(boxes.center[:count], boxes.axes[:count], boxes.half_extents[:count])
        answer = gs.cull(frustum, part, accuracy=tier)
        assert (answer.state == whole.state[:count]).all() and (answer.certain == whole.certain[:count]).all()


# -------------------------------------------------------------------------------------------------------- the filters


def test_tiers_are_as_sharp_as_they_can_be(rng):
    frustum, boxes = scene(rng, 5000, windows=("around", "around"))
    counts = {tier: gs.cull(frustum, boxes, accuracy=tier).cost.counts for tier in TIERS}
    assert counts["bound"].keys() == {"bound", "uncertain"}
    assert counts["float32"].keys() == counts["float64"].keys() == {"bound", "filter", "uncertain"}
    assert counts["exact"].keys() == {"bound", "filter", "wide", "exact"}
    assert counts["bound"]["bound"] > 0.3 * len(boxes)
    assert counts["float32"]["uncertain"] <= 10
    assert counts["float64"]["uncertain"] <= 1
    assert counts["exact"]["wide"] + counts["exact"]["exact"] <= 1


def test_evidence_is_cheap_to_find(crowd):
    """Of boxes that are not near the boundary by rounding, planes, centre and corners prove nearly all."""
    frustum, boxes = crowd
    _, certain, _, simplex, _ = _core.cull(
        frustum.packed(), boxes.center, boxes.axes, boxes.half_extents, "exact", True
    )
    assert certain.all() and (simplex[:, 0, 0] >= 0).mean() < 0.2
