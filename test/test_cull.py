# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""Culling: frustum against oriented boxes, judged by exact arithmetic."""

import os
from itertools import product

import numpy as np
import pytest
from conftest import from_hex, hard_cases, reproducer
from oracle import frustum_box

import geomsrv as gs
from geomsrv import CullState

ROUNDS = 20 if os.environ.get("GEOMSRV_SOAK") else 1
STATES = {frustum_box.OUTSIDE: CullState.OUTSIDE, frustum_box.INTERSECTS: CullState.INTERSECTS}
STATES[frustum_box.INSIDE] = CullState.INSIDE


def rotation(rng):
    """(3, 3) random orthonormal rows, right- or left-handed."""
    return np.linalg.qr(rng.normal(size=(3, 3)))[0]


def exact_state(frustum, boxes, i):
    """What exact arithmetic on the literal numbers says about box i."""
    given = (frustum.origin, frustum.axes, frustum.bounds, frustum.near, frustum.far)
    return STATES[frustum_box.state(given, (boxes.center[i], boxes.axes[i], boxes.half_extents[i]))]


def describe(frustum, boxes, i):
    return reproducer(
        origin=frustum.origin,
        frustum_axes=frustum.axes,
        bounds=frustum.bounds,
        near=frustum.near,
        far=frustum.far,
        center=boxes.center[i],
        box_axes=boxes.axes[i],
        half_extents=boxes.half_extents[i],
    )


def check_exactly(frustum, boxes):
    """Certain answers are right; returns exact states, and which boxes the planes could not decide."""
    answer = gs.cull(frustum, boxes)
    assert sum(answer.cost.counts.values()) == len(boxes)
    exact = np.array([exact_state(frustum, boxes, i) for i in range(len(boxes))])
    wrong = np.flatnonzero(answer.certain & (answer.state != exact))
    assert len(wrong) == 0, f"{answer.state[wrong]} for {exact[wrong]}\n{describe(frustum, boxes, wrong[0])}"
    return answer, exact


# ---------------------------------------------------------------------------------------------------------- corpus


def corpus_scene(case):
    given = from_hex(case["input"])
    f, b = given["frustum"], given["box"]
    frustum = gs.Frustum(f["E"], [f["L"], f["U"], f["D"]], f["l"], f["u"], f["n"], f["f"])
    return frustum, gs.Boxes([b["C"]], [b["A"]], [b["e"]])


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

# Window 1 x 0.5 at depth 1, cut at 4; every number below is exact.
CAMERA = {"left": 1.0, "up": 0.5, "near": 1.0, "far": 4.0}
CONSTRUCTED = [
    ("before the near face", (0, 0, 0.25), (0.25, 0.25, 0.5), CullState.OUTSIDE),
    ("touches the near face", (0, 0, 0.5), (0.25, 0.25, 0.5), CullState.INTERSECTS),
    ("across the near face", (0, 0, 1.0), (0.25, 0.25, 0.5), CullState.INTERSECTS),
    ("touches the near face from inside", (0, 0, 1.5), (0.25, 0.25, 0.5), CullState.INSIDE),
    ("well inside", (0, 0, 2.0), (0.25, 0.25, 0.5), CullState.INSIDE),
    ("touches the far face from inside", (0, 0, 3.5), (0.25, 0.25, 0.5), CullState.INSIDE),
    ("touches the far face", (0, 0, 4.5), (0.25, 0.25, 0.5), CullState.INTERSECTS),
    ("behind the far face", (0, 0, 5.0), (0.25, 0.25, 0.5), CullState.OUTSIDE),
    ("beside", (6.0, 0, 2.0), (0.5, 0.25, 0.5), CullState.OUTSIDE),
    ("above", (0, 3.0, 2.0), (0.5, 0.25, 0.5), CullState.OUTSIDE),
    ("an edge touches the left face", (3.0, 0, 2.0), (0.5, 0.25, 0.5), CullState.INTERSECTS),
    ("a corner touches the far corner", (4.5, 2.5, 4.5), (0.5, 0.5, 0.5), CullState.INTERSECTS),
    ("holds the frustum", (0, 0, 2.0), (100.0, 100.0, 100.0), CullState.INTERSECTS),
    ("holds the camera only", (0, 0, 0), (0.5, 0.5, 0.5), CullState.OUTSIDE),
    ("point at the apex", (0, 0, 0), (0, 0, 0), CullState.OUTSIDE),
    ("point on the near face", (0, 0, 1.0), (0, 0, 0), CullState.INSIDE),
    ("point on a near corner", (1.0, 0.5, 1.0), (0, 0, 0), CullState.INSIDE),
    ("point on a far corner", (-4.0, 2.0, 4.0), (0, 0, 0), CullState.INSIDE),
    ("point inside", (0.25, 0, 2.0), (0, 0, 0), CullState.INSIDE),
    ("point beside", (2.5, 0, 2.0), (0, 0, 0), CullState.OUTSIDE),
    ("segment through both side faces", (0, 0, 2.0), (5.0, 0, 0), CullState.INTERSECTS),
    ("segment along the axis", (0, 0, 2.5), (0, 0, 1.5), CullState.INSIDE),
    ("sheet across", (0, 0, 2.0), (9.0, 9.0, 0), CullState.INTERSECTS),
    ("sheet in the near plane", (0, 0, 1.0), (1.0, 0.5, 0), CullState.INSIDE),
    ("sheet before the near plane", (0, 0, 0.5), (1.0, 0.5, 0), CullState.OUTSIDE),
]
FRAMES = [
    [list(np.eye(3)[k] * s) for k, s in zip(order, signs, strict=True)]
    for order, signs in [((0, 1, 2), (1, 1, 1)), ((1, 2, 0), (1, -1, 1)), ((2, 1, 0), (-1, 1, -1))]
]


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


def ridge(rng, angle, gap, ratio):
    """A box whose edge crosses a slanted frustum edge at a small angle, `gap` away: only their cross product tells."""
    axes = rotation(rng)
    frustum = gs.Frustum(rng.normal(size=3), axes, *rng.uniform(0.3, 2.0, 2), 1.0, ratio)
    left, up = frustum.bounds[1], frustum.bounds[3]
    depth = rng.uniform(1.2, 1.8) if ratio < 10 else rng.uniform(2.0, 5.0)
    along = np.array([left, up, 1.0])
    on_edge = depth * along
    along /= np.linalg.norm(along)
    outward = np.array([1, 0, -left]) / np.hypot(1, left) + np.array([0, 1, -up]) / np.hypot(1, up)
    outward -= outward @ along * along
    outward /= np.linalg.norm(outward)
    edge = np.cos(angle) * along + np.sin(angle) * np.cross(outward, along)
    side = np.cross(edge, outward)
    box_axes = np.array([edge, (outward + side) / np.sqrt(2), (outward - side) / np.sqrt(2)])
    half = np.array([0.15, 0.05, 0.08])
    center = on_edge + gap * outward + half[1:] @ box_axes[1:]
    order = rng.permutation(3)
    return frustum, gs.Boxes([frustum.origin + center @ axes], [(box_axes @ axes)[order]], [half[order]])


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


def window(rng, kind):
    """(low, high) of one side, for near = 1."""
    a = 10.0 ** rng.uniform(-1.5, 0.5)
    if kind == "centred":
        return -a, a
    if kind == "around":
        return -a, a * 10.0 ** rng.uniform(-1.0, 1.0)
    low, high = a, a * (1.0 + 10.0 ** rng.uniform(-1.0, 1.0))
    return (low, high) if rng.random() < 0.5 else (-high, -low)


def scene(rng, count, *, windows=("centred", "centred"), ratio=100.0, defect=0.0, shape="box", far_away=0.0):
    """A frustum and boxes in and around it, of about the size of the window where they are."""
    origin = rng.normal(size=3) * far_away
    bounds = [x for kind in windows for x in window(rng, kind)]
    skew = (lambda: rng.uniform(-defect, defect, (3, 3))) if defect else (lambda: 0.0)
    frustum = gs.Frustum(origin, rotation(rng) + skew(), bounds=bounds, near=1.0, far=ratio)
    low, high = np.array(bounds[0::2]), np.array(bounds[1::2])
    center, axes, half = [], [], []
    for _ in range(count):
        depth = min(ratio, 100.0) ** rng.random()
        inside = low + (high - low) * rng.uniform(-0.3, 1.3, 2)
        middle = depth * np.append(inside, rng.uniform(0.7, 1.3))
        size = depth * (high - low).min() * 10.0 ** rng.uniform(-1.5, 0.3) * rng.uniform(0.2, 1.0, 3)
        if shape == "flat":
            size[rng.permutation(3)[: rng.integers(1, 4)]] = 0.0
        turned = rotation(rng) if rng.random() < 0.8 else frustum.axes[rng.permutation(3)]
        center.append(origin + middle @ frustum.axes)
        axes.append(turned + skew())
        half.append(size)
    return frustum, gs.Boxes(center, axes, half)


SCENES = {
    "centred": {},
    "around": {"windows": ("around", "around")},
    "beside the axis": {"windows": ("beyond", "around")},
    "beside and above the axis": {"windows": ("beyond", "beyond")},
    "f/n = 1e12": {"ratio": 1e12, "windows": ("around", "centred")},
    "thin": {"ratio": 1.001},
    "flat boxes": {"shape": "flat"},
    "axes off by 1e-3": {"defect": 1e-3, "windows": ("around", "around")},
    "axes off by 1e-8, flat": {"defect": 1e-8, "shape": "flat"},
    "far from the origin": {"far_away": 1e6},
}


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


def touching_scene(rng, count):
    """Boxes that a corner of which is near the surface, by 1e-16 to 1e-6 of the scene."""
    frustum, boxes = scene(rng, count, windows=("around", "around"))
    corners = frustum.corners(frustum.origin)
    center = []
    for axes, half in zip(boxes.axes, boxes.half_extents, strict=True):
        near_face, far_face = corners[:4], corners[4:]
        edge = rng.integers(4)
        on_surface = near_face[edge] + rng.random() * (far_face[edge] - near_face[edge]) * 0.1
        reach = (rng.choice([-1.0, 1.0], 3) * half) @ axes
        center.append(frustum.origin + on_surface + reach * (1 + 10.0 ** rng.uniform(-16, -6) * rng.choice([-1, 1])))
    return frustum, gs.Boxes(center, boxes.axes, boxes.half_extents)


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


def scaled(frustum, boxes, exponent):
    def grow(x):
        return np.ldexp(x, exponent)

    return (
        gs.Frustum(
            grow(frustum.origin),
            frustum.axes,
            bounds=grow(frustum.bounds),
            near=grow(frustum.near),
            far=grow(frustum.far),
        ),
        gs.Boxes(grow(boxes.center), boxes.axes, grow(boxes.half_extents)),
    )


def with_view(frustum, axes, bounds):
    return gs.Frustum(frustum.origin, axes, bounds=bounds, near=frustum.near, far=frustum.far)


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
