# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""Frusta and boxes: the corpus, constructed, random and near-degenerate ones; and what exact arithmetic says."""

import numpy as np
from conftest import from_hex, reproducer
from oracle import frustum_box

import geomsrv as gs
from geomsrv import CullState

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


def corpus_scene(case):
    given = from_hex(case["input"])
    f, b = given["frustum"], given["box"]
    frustum = gs.Frustum(f["E"], [f["L"], f["U"], f["D"]], f["l"], f["u"], f["n"], f["f"])
    return frustum, gs.Boxes([b["C"]], [b["A"]], [b["e"]])


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
    order, signs = rng.permutation(3), rng.choice([-1, 1], (3, 1))
    return frustum, gs.Boxes([frustum.origin + center @ axes], [signs * (box_axes @ axes)[order]], [half[order]])


def leaning(rng, count):
    """Boxes with one axis of the frustum; the others lean, so the face that meets a far corner is not across it."""
    axes = np.array(FRAMES[rng.integers(3)])
    left, up = rng.integers(1, 17, 2) / 8
    frustum = gs.Frustum([0, 0, 0], axes, left, up, 1.0, 4.0)
    shared = rng.integers(2)
    rows = np.tile(np.roll(np.eye(3), -shared, axis=0), (count, 1, 1))
    rows[:, 1:] += rng.uniform(-0.004, 0.004, (count, 2, 3))
    rows[:, 1:] /= np.linalg.norm(rows[:, 1:], axis=2, keepdims=True)
    half = rng.uniform(0.5, 2.0, (count, 3))
    normal = np.cross(rows[:, 1], rows[:, 2])
    on_face = np.einsum("nk,nkc->nc", half[:, 1:] * rng.uniform(-0.9, 0.9, (count, 2)), rows[:, 1:])
    gap = rng.choice([-1, 1], (count, 1)) * 10.0 ** rng.uniform(-16, -3, (count, 1))
    corner = 4.0 * np.array([left, up, 1.0])
    center = corner + gap * normal + half[:, :1] * rows[:, 0] + on_face
    return frustum, gs.Boxes(center @ axes, rows @ axes, half)


def needles(rng, count):
    """Boxes of rounding width along a slanted edge, tilted and displaced by rounding: a rounded axis means nothing."""
    axes = np.array(FRAMES[rng.integers(3)])
    left, up = rng.integers(1, 17, 2) / 8
    frustum = gs.Frustum([0, 0, 0], axes, left, up, 1.0, 4.0)
    along = np.array([left, up, 1.0]) * [*rng.choice([-1, 1], 2), 1]
    edge = along / np.linalg.norm(along)
    side = np.cross(edge, rng.normal(size=3))
    side /= np.linalg.norm(side)
    rows = np.array([edge, side, np.cross(edge, side)])
    ulp = 2.0**-53
    turned = rows + ulp * rng.integers(-3, 4, (count, 3, 3)) * [[[1], [0], [0]]]
    center = rng.uniform(1.5, 3.0, (count, 1)).round(3) * along + ulp * rng.integers(-8, 9, (count, 3))
    half = rng.uniform(0.1, 0.4, (count, 3)) * [1.0, 4.0 * ulp, 4.0 * ulp]
    order = rng.permutation(3)
    return frustum, gs.Boxes(center @ axes, (turned @ axes)[:, order], half[:, order])


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


# Frames that are orthonormal up to rounding, or exactly, and that have many edges in common.
LATTICE_FRAMES = [
    np.eye(3),
    np.array([[2, 1, -2], [1, 2, 2], [2, -2, 1]]) / 3,
    np.array([[3, 4, 0], [-4, 3, 0], [0, 0, 5]]) / 5,
    np.array([[5, 0, 0], [0, 3, 4], [0, -4, 3]]) / 5,
]


def lattice(rng, count):
    """Small numbers: faces, edges and corners that touch, also of sheets, segments and points; off-centre windows."""
    axes = LATTICE_FRAMES[rng.integers(4)][rng.permutation(3)] * rng.choice([-1, 1], (3, 1))
    bounds = np.sort(rng.integers(-4, 5, (2, 2)) / 2, axis=1)
    bounds[:, 1] += bounds[:, 0] == bounds[:, 1]
    near = rng.integers(1, 4) / 2
    frustum = gs.Frustum(
        rng.integers(-3, 4, 3) / 1, axes, bounds=bounds.ravel(), near=near, far=near + rng.integers(1, 16) / 2
    )
    frames = [np.eye(3), axes, axes[[1, 2, 0]], LATTICE_FRAMES[rng.integers(4)]]
    turned = np.array([frames[k] for k in rng.integers(4, size=count)])
    half = rng.integers(0, 6, (count, 3)) / 2
    # A corner, or the middle of an edge or a face, goes to a corner, an edge or the middle of a face of the frustum.
    arms = np.einsum("ni,nij->nj", rng.choice([-1, -1, 0, 1, 1], (count, 3)) * half, turned)
    return frustum, gs.Boxes(boundary_points(rng, frustum, count) + arms, turned, half)


def boundary_points(rng, frustum, count):
    """Corners, middles of edges and faces, and the middle."""
    windows = np.reshape(frustum.bounds, (2, 2)) / frustum.near
    slopes = np.column_stack([rng.choice([low, (low + high) / 2, high], count) for low, high in windows])
    depth = rng.choice([frustum.near, (frustum.near + frustum.far) / 2, frustum.far], count)
    return frustum.origin + np.column_stack([slopes * depth[:, None], depth]) @ frustum.axes


def warehouse(rng, count, cell, angle):
    """Equal boxes side by side, all of which touch or cross the boundary of a view of 90 degrees of the same frame."""
    far = 64
    cosine, sine = np.cos(angle), np.sin(angle)
    axes = np.array([[cosine, sine, 0.0], [-sine, cosine, 0.0], [0.0, 0.0, 1.0]])
    depth = rng.integers(1, far - 4, count)
    along = np.floor(rng.uniform(-1.0, 1.0, count) * depth)
    # Just outside, across or just inside the planes at the sides; before, behind the near and the far one.
    kind = rng.integers(0, 5, count)
    across = np.choose(kind, [depth + 1, depth, depth - 1, along, along])
    place = np.column_stack([across, along, np.choose(kind, [depth, depth, depth, np.zeros(count), far])])
    place[::2] = place[::2, [1, 0, 2]] * [1, -1, 1]
    frustum = gs.Frustum(np.zeros(3), axes, cell, cell, cell, far * cell)
    center = (place + np.where(place < 0, -0.5, 0.5)) * cell @ axes
    return frustum, gs.Boxes(center, np.tile(axes, (count, 1, 1)), np.full((count, 3), cell / 2))
