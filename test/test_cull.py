# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""Culling: frustum against oriented boxes, judged by exact arithmetic."""

import os
from itertools import product

import numpy as np
import pytest
from conftest import hard_cases
from cull_scenes import (
    CAMERA,
    CONSTRUCTED,
    FRAMES,
    SCENES,
    corpus_scene,
    describe,
    exact_state,
    ridge,
    rotation,
    scaled,
    scene,
    touching_scene,
    with_view,
)

import geomsrv as gs
from geomsrv import CullState

ROUNDS = 20 if os.environ.get("GEOMSRV_SOAK") else 1


def check_exactly(frustum, boxes):
    """Certain answers are right; returns exact states, and which boxes the planes could not decide."""
    answer = gs.cull(frustum, boxes)
    assert sum(answer.cost.counts.values()) == len(boxes)
    exact = np.array([exact_state(frustum, boxes, i) for i in range(len(boxes))])
    wrong = np.flatnonzero(answer.certain & (answer.state != exact))
    assert len(wrong) == 0, f"{answer.state[wrong]} for {exact[wrong]}\n{describe(frustum, boxes, wrong[0])}"
    return answer, exact


# ---------------------------------------------------------------------------------------------------------- corpus


CORPUS = hard_cases("frustum_box")
DECIDABLE = hard_cases("frustum_box", "double", "careful_double")


@pytest.mark.parametrize("case", DECIDABLE, ids=[case["id"] for case in DECIDABLE])
def test_hard_case(case):
    answer = gs.cull(*corpus_scene(case))
    assert (answer.state[0] != CullState.OUTSIDE) == case["answer"]["intersects"]
    assert answer.certain[0]


@pytest.mark.parametrize("case", CORPUS, ids=[case["id"] for case in CORPUS])
def test_certain_means_right(case):
    frustum, boxes = corpus_scene(case)
    answer, exact = check_exactly(frustum, boxes)
    assert (exact[0] != CullState.OUTSIDE) == case["answer"]["intersects"]
    if not answer.certain[0]:
        assert case["margin"]["decidable"] == "exact_only"


# ----------------------------------------------------------------------------------------------------- constructed


@pytest.mark.parametrize("frame", FRAMES, ids=["world", "permuted", "left-handed"])
@pytest.mark.parametrize("center, half, state", [c[1:] for c in CONSTRUCTED], ids=[c[0] for c in CONSTRUCTED])
def test_constructed(center, half, state, frame):
    axes, origin = np.array(frame), np.array([1024.0, -512.0, 64.0])
    boxes = gs.Boxes([origin + np.array(center) @ axes], [axes], [half])
    answer = gs.cull(gs.Frustum(origin, axes, **CAMERA), boxes)
    assert answer.state[0] == state
    assert exact_state(gs.Frustum(origin, axes, **CAMERA), boxes, 0) == state


def test_no_boxes():
    answer = gs.cull(
        gs.Frustum([0, 0, 0], np.eye(3), **CAMERA), gs.Boxes(*(np.zeros(s) for s in [(0, 3), (0, 3, 3), (0, 3)]))
    )
    assert answer.state.shape == answer.certain.shape == (0,)
    assert answer.state.dtype == np.uint8 and answer.certain.dtype == np.bool_


# ---------------------------------------------------------------------------------------------------------- errata


def test_up_normal_has_the_up_bound():
    """Paper 2 section 3 and book 11.12.1 print l for mu in the normals of the top and bottom faces."""
    axes = np.array([[2, 1, -2], [1, 2, 2], [2, -2, 1]]) / 3
    frustum = gs.Frustum([-3, -3, 1], np.eye(3), 2.0, 4.0, 2.0, 10.0)
    boxes = gs.Boxes([[-11 / 6, 33 / 5, -26 / 15]], [axes], [[4, 5, 1]])
    answer, exact = check_exactly(frustum, boxes)
    assert answer.state[0] == exact[0] == CullState.OUTSIDE and answer.certain[0]


@pytest.mark.parametrize("ratio", [2.0, 1e9, 1e12], ids="f/n={:g}".format)
@pytest.mark.parametrize("angle", [1e-6, 1e-8, 1e-10])
def test_near_parallel_edges(angle, ratio, rng):
    """The printed form reports gaps of up to sqrt(eps), and of eps * far, as intersections."""
    for sign, _ in product((1, -1), range(4 * ROUNDS)):
        frustum, boxes = ridge(rng, angle, sign * angle * rng.uniform(0.01, 0.05), ratio)
        answer, exact = check_exactly(frustum, boxes)
        assert exact[0] == (CullState.OUTSIDE if sign > 0 else CullState.INTERSECTS), describe(frustum, boxes, 0)
        assert answer.state[0] == exact[0], describe(frustum, boxes, 0)
        assert answer.cost.counts["bound"] == 0  # the hard branch
        assert answer.certain[0] or angle < 1e-9


# ---------------------------------------------------------------------------------------------------- random scenes


@pytest.mark.parametrize("name", SCENES)
def test_random(name, rng):
    stages = {"bound": 0, "filter": 0, "uncertain": 0}
    reached = np.zeros(3, int)
    for _ in range(4 * ROUNDS):
        frustum, boxes = scene(rng, 20, **SCENES[name])
        answer, exact = check_exactly(frustum, boxes)
        reached += np.bincount(exact, minlength=3)
        for stage, count in answer.cost.counts.items():
            stages[stage] += count
    assert stages["uncertain"] <= 2 * ROUNDS
    assert stages["bound"] >= 10 and stages["filter"] >= 5, stages
    assert reached[0] >= 10 and reached[1] >= 10 and (reached[2] >= 3 or name == "thin"), reached


def test_random_touching(rng):
    """Where the answer hangs on the last bits, `certain` must not lie."""
    uncertain = wrong = 0
    for _ in range(6 * ROUNDS):
        frustum, boxes = touching_scene(rng, 20)
        answer, exact = check_exactly(frustum, boxes)
        uncertain += answer.cost.counts["uncertain"]
        wrong += np.count_nonzero(answer.state != exact)
    assert uncertain >= 3 * ROUNDS  # the scene is as hard as it claims
    assert wrong <= uncertain


def test_scene_of_any_scale(rng):
    for exponent in (-1060, -1000, -700, -300, 300, 700, 1000):
        frustum, boxes = scaled(*scene(rng, 8, windows=("around", "beyond")), exponent)
        answer, exact = check_exactly(frustum, boxes)
        assert exponent < -1022 or answer.certain.all()
        assert (answer.state == exact).all() or exponent < -1022


@pytest.mark.parametrize("left, up", list(product([1e-300, 1e-100, 1.0, 1e100, 1e300], repeat=2)))
def test_needles_and_fans(left, up, rng):
    """Windows of any shape: nothing overflows into a wrong answer."""
    axes = np.array(FRAMES[rng.integers(3)])
    for near in (1e-200, 1.0, 1e200):
        frustum = gs.Frustum([0, 0, 0], axes, left, up, near, near * 1e6)
        depths = near * np.array([0.5, 1.0, 3.0, 3.0, 1e3, 1e6, 2e6])
        sides = np.array([left, up]) * (depths / near)[:, None] * rng.uniform(-1.5, 1.5, (7, 2))
        middle = np.column_stack([sides, depths])
        boxes = gs.Boxes(middle @ axes, np.tile(axes, (7, 1, 1)), np.abs(middle) * rng.uniform(0, 0.3, (7, 1)))
        answer, exact = check_exactly(frustum, boxes)
        # What is below 1e-300 of the largest coordinate is lost, and said to be.
        if min(left, up, near) > 1e-290 * max(left, up, near):
            assert (answer.state == exact).all()
        if min(left, up, near) > 1e-150 * max(left, up, near):
            assert answer.certain.all()


# ------------------------------------------------------------------------------------------------------------ laws


@pytest.fixture
def crowd(rng):
    """A frustum and 400 boxes, 100 of them touching up to rounding."""
    frustum, boxes = touching_scene(rng, 100)
    more = scene(rng, 300, windows=("around", "around"))[1]
    return frustum, gs.Boxes(
        np.concatenate([boxes.center, more.center]),
        np.concatenate([boxes.axes, more.axes]),
        np.concatenate([boxes.half_extents, more.half_extents]),
    )


def check_agreement(one, other):
    """Two roundings of one scene: certain answers agree, and most are certain."""
    both = one.certain & other.certain
    assert (one.state == other.state)[both].all()
    assert both.mean() > 0.8


def test_swap_of_left_and_up(crowd):
    frustum, boxes = crowd
    l0, l1, u0, u1 = frustum.bounds
    swapped = with_view(frustum, frustum.axes[[1, 0, 2]], (u0, u1, l0, l1))
    check_agreement(gs.cull(frustum, boxes), gs.cull(swapped, boxes))


def test_mirror(crowd):
    frustum, boxes = crowd
    l0, l1, u0, u1 = frustum.bounds
    mirrored = with_view(frustum, frustum.axes * [[-1], [1], [1]], (-l1, -l0, u0, u1))
    check_agreement(gs.cull(frustum, boxes), gs.cull(mirrored, boxes))


def test_order_and_sign_of_box_axes(crowd):
    frustum, boxes = crowd
    order = [2, 0, 1]
    turned = gs.Boxes(boxes.center, boxes.axes[:, order] * [[[-1], [1], [-1]]], boxes.half_extents[:, order])
    check_agreement(gs.cull(frustum, boxes), gs.cull(frustum, turned))


def test_rotation_of_the_world(crowd, rng):
    frustum, boxes = crowd
    turn = rotation(rng)
    turned_frustum = gs.Frustum(
        frustum.origin @ turn, frustum.axes @ turn, bounds=frustum.bounds, near=frustum.near, far=frustum.far
    )
    turned = gs.Boxes(boxes.center @ turn, boxes.axes @ turn, boxes.half_extents)
    check_agreement(gs.cull(frustum, boxes), gs.cull(turned_frustum, turned))


@pytest.mark.parametrize("exponent", [-400, -1, 7, 400])
def test_power_of_two_scale_changes_no_bit(crowd, exponent):
    one, other = gs.cull(*crowd), gs.cull(*scaled(*crowd, exponent))
    assert (one.state == other.state).all() and (one.certain == other.certain).all()


def test_exact_translation_changes_no_bit(crowd):
    frustum, boxes = crowd
    grid = 2.0**-20
    origin, center = np.round(frustum.origin / grid) * grid, np.round(boxes.center / grid) * grid
    answers = [
        gs.cull(
            gs.Frustum(origin + by, frustum.axes, bounds=frustum.bounds, near=frustum.near, far=frustum.far),
            gs.Boxes(center + by, boxes.axes, boxes.half_extents),
        )
        for by in (np.zeros(3), np.array([2.0**25, -(2.0**24), 3.0 * 2.0**23]))
    ]
    assert (answers[0].state == answers[1].state).all() and (answers[0].certain == answers[1].certain).all()


@pytest.mark.parametrize("count", [1, 2, 3, 4, 5, 255, 256, 257])
def test_batches_of_any_length_agree(crowd, count):
    frustum, boxes = crowd
    whole = gs.cull(frustum, boxes)
    part = gs.cull(frustum, gs.Boxes(boxes.center[:count], boxes.axes[:count], boxes.half_extents[:count]))
    assert (part.state == whole.state[:count]).all() and (part.certain == whole.certain[:count]).all()


# ------------------------------------------------------------------------------------------------------- the filter


def test_random_boxes_are_certain(rng):
    """The error bounds are tight enough: generic boxes are decided, all but one in a thousand at the very least."""
    for windows in (("centred", "centred"), ("around", "beyond")):
        frustum, boxes = scene(rng, 5000, windows=windows)
        answer = gs.cull(frustum, boxes)
        assert answer.certain.mean() > 0.999
        assert answer.cost.counts["bound"] > 0.5 * len(boxes)  # planes decide most
        assert answer.cost.counts["filter"] > 100
