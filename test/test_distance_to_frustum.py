# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""Distance of points from a frustum, in space and in the plane, judged by exact arithmetic."""

import math
import os
from itertools import product

import numpy as np
import pytest
from conftest import from_hex, hard_cases, reproducer
from oracle import point_frustum
from oracle.vectors import compare_root, in_interval, nearest_double, root_double

import geomsrv as gs
from geomsrv import FrustumRegion

ROUNDS = 20 if os.environ.get("GEOMSRV_SOAK") else 1

# What a face adds to the region; the names are those of the oracle.
CODES = {"near": 9, "far": 18, "left+": 1, "left-": 2, "up+": 3, "up-": 6}

# Widest proven interval, as a part of |P - E| + distance with |.| the sum of magnitudes: 104 units of roundoff, and
# sqrt(3) since the engine sums in another frame.
MAX_WIDTH = 200 * 2.0**-53
MAX_ERROR = 16 * 2.0**-53
SUBNORMAL = 4 * 2.0**-1074  # rounding where doubles have no more bits


def rotation(rng, dimension=3):
    return np.linalg.qr(rng.normal(size=(dimension, dimension)))[0]


def exact_nearest(frustum, point):
    nearest = point_frustum.nearest if isinstance(frustum, gs.Frustum) else point_frustum.nearest_2d
    return nearest(frustum.origin, frustum.axes, frustum.bounds, frustum.near, frustum.far, point)


def region_of(nearest):
    """The smallest feature that holds the nearest point; INSIDE for points of the frustum."""
    return 0 if nearest.squared_distance == 0 else sum(CODES[face] for face in nearest.faces)


def describe(frustum, point):
    return reproducer(
        origin=frustum.origin, axes=frustum.axes, bounds=frustum.bounds, near=frustum.near, far=frustum.far, point=point
    )


def check_exactly(frustum, points):
    """Distances, intervals and nearest points against exact arithmetic; returns the answer and exact regions."""
    answer = gs.distance_to_frustum(frustum, points, want=("witness",))
    regions = []
    for i, point in enumerate(np.asarray(points)):
        exact = exact_nearest(frustum, point)
        distance, lower, upper = answer.distance[i], answer.lower[i], answer.upper[i]
        true = root_double(exact.squared_distance)
        scale = np.abs(point - frustum.origin).sum() + true
        text = f"{lower!r} <= {distance!r} <= {upper!r}, exactly {true!r}\n{describe(frustum, point)}"
        assert lower <= distance <= upper, text
        assert in_interval(exact.squared_distance, lower, upper), text
        assert upper - lower <= MAX_WIDTH * scale + SUBNORMAL, text
        assert distance == true or abs(distance - true) <= MAX_ERROR * scale + SUBNORMAL, text
        witness = np.array([float(x) for x in exact.point])
        assert np.abs(answer.point_a[i] - witness).max() <= 4 * MAX_ERROR * (scale + np.abs(point).max()) + SUBNORMAL, (
            text
        )
        assert (answer.region[i] == FrustumRegion.INSIDE) == (distance == 0.0), text
        regions.append(region_of(exact))
    return answer, np.array(regions)


# ---------------------------------------------------------------------------------------------------------- corpus

CORPUS = hard_cases("point_frustum")


def corpus_scene(case):
    given = from_hex(case["input"])
    f = given["frustum"]
    return gs.Frustum(f["E"], [f["L"], f["U"], f["D"]], f["l"], f["u"], f["n"], f["f"]), [given["point"]]


@pytest.mark.parametrize("case", CORPUS, ids=[case["id"] for case in CORPUS])
def test_hard_case(case):
    frustum, points = corpus_scene(case)
    answer, regions = check_exactly(frustum, points)
    expected = case["answer"]
    assert abs(answer.distance[0] - float.fromhex(expected["dist"])) <= 2e-15 * float.fromhex(
        case["margin"]["scale_local"]
    )
    if case["margin"]["decidable"] != "exact_only":
        assert (answer.distance[0] == 0.0) == expected["intersects"]
        assert (answer.lower[0] > 0.0) == (not expected["intersects"]) or answer.distance[0] < SUBNORMAL
        assert (answer.upper[0] == 0.0) == expected["intersects"]
        assert answer.region[0] == regions[0]


# ---------------------------------------------------------------------------------------------------------- errata


def test_far_threshold_of_the_slanted_edge():
    """Paper 1 and book 10.4.3 lack f/n in the slab between near and far, so LEFT_UP is never found there."""
    answer = gs.distance_to_frustum(
        gs.Frustum([0, 0, 0], np.eye(3), 1.0, 1.0, 1.0, 4.0), [[3, 3, 2]], want=("witness",)
    )
    assert FrustumRegion(answer.region[0]).name == "LEFT_UP"
    assert answer.distance[0] == pytest.approx((2 / 3) ** 0.5, rel=1e-15)
    assert answer.point_a[0] == pytest.approx([8 / 3] * 3, rel=1e-15)


@pytest.mark.parametrize("depth", [0.0, 1.5])
def test_far_edge_ends_at_the_far_corner(depth):
    """Paper 1 and book 10.4.3 project on the line of the far edge; (2, 3, 2) is not a point of the frustum."""
    frustum = gs.Frustum([0, 0, 0], np.eye(3), 1.0, 1.0, 1.0, 2.0)
    for mirror in ([20, 3], [3, 20]):
        answer = gs.distance_to_frustum(frustum, [[*mirror, depth]], want=("witness",))
        assert FrustumRegion(answer.region[0]).name == "FAR_LEFT_UP"
        assert answer.point_a[0].tolist() == [2.0, 2.0, 2.0]


def test_first_test_below_near_is_against_the_window():
    """Paper 1 prints x0 <= 1 for x0 <= l; the literal reading finds the U face and a squared distance of 1/5."""
    frustum = gs.Frustum([0, 0, 0], np.eye(3), 1 / 3, 1 / 2, 1.0, 2.0)
    answer = gs.distance_to_frustum(frustum, [[2 / 3, 1, 1]])
    assert FrustumRegion(answer.region[0]).name == "LEFT_UP"
    assert answer.distance[0] ** 2 == pytest.approx(13 / 49, rel=1e-15)


def test_plane_slanted_edge_has_the_window_bound():
    """Paper 1 section 2 prints the digit 1 for l; the literal reading finds the point inside."""
    answer = gs.distance_to_frustum(gs.Frustum2D([0, 0], np.eye(2), 0.5, 1.0, 2.0), [[1, 1]])
    assert FrustumRegion(answer.region[0]).name == "LEFT"
    assert answer.distance[0] ** 2 == pytest.approx(1 / 5, rel=1e-15)


# ----------------------------------------------------------------------------------------------------- constructed

WINDOWS = {
    "centred": (-1.0, 1.0, -0.5, 0.5),
    "around the axis": (-1.0, 0.75, -0.5, 2.0),
    "edge on the axis": (0.0, 1.0, -0.5, 0.0),
    "beside the axis": (0.5, 1.0, -0.5, 0.25),
    "above the axis": (-1.0, 0.25, 0.5, 1.25),
    "beside and below the axis": (-1.0, -0.25, -1.5, -0.5),
}


def faces_2d(bounds):
    """{face: outward normal} in the coordinates of the frustum, near = 1."""
    low, high = bounds
    return {"left-": (-1, low), "left+": (1, -high), "near": (0, -1), "far": (0, 1)}


def faces_3d(bounds):
    l0, l1, u0, u1 = bounds
    sides = {"left-": (-1, 0, l0), "left+": (1, 0, -l1), "up-": (0, -1, u0), "up+": (0, 1, -u1)}
    return {**sides, "near": (0, 0, -1), "far": (0, 0, 1)}


def features(faces, corners):
    """Sets of faces that meet in a face, an edge or a corner, with the corners on all of them."""
    for size in (1, 2, 3):
        names = list(faces)
        for chosen in product(names, repeat=size):
            if list(chosen) != sorted(set(chosen), key=names.index):
                continue
            on_all = [c for c in corners if all(abs(np.dot(faces[n], c) - offset(n, c)) < 1e-12 for n in chosen)]
            if len(on_all) >= 1 and (len(corners) == 8 or size < 3) and len(on_all) == len(corners) >> size:
                yield chosen, np.array(on_all)


FAR = 4.0


def offset(face, corner):
    """Right-hand side of a face's plane: sides pass through the apex."""
    return {"near": -1.0, "far": FAR}.get(face, 0.0)


@pytest.mark.parametrize("name", WINDOWS)
@pytest.mark.parametrize("dimension", [2, 3])
def test_constructed_regions(name, dimension, rng):
    """A point of a feature plus a step into its normal cone: region, distance and nearest point are known."""
    bounds = WINDOWS[name][: 2 * (dimension - 1)]
    faces = faces_2d(bounds) if dimension == 2 else faces_3d(bounds)
    near = [np.append(side, 1.0) for side in product(*np.reshape(bounds, (-1, 2)))]
    corners = [*near, *(FAR * corner for corner in near)]
    axes, origin = rotation(rng, dimension), rng.normal(size=dimension)
    frustum = (gs.Frustum if dimension == 3 else gs.Frustum2D)(origin, axes, bounds=bounds, near=1.0, far=FAR)
    reached = set()
    for chosen, on_all in features(faces, corners):
        for _ in range(4):
            nearest = rng.dirichlet(np.full(len(on_all), 3.0)) @ on_all
            step = sum(rng.uniform(0.2, 3.0) * np.array(faces[n], float) for n in chosen)
            point = origin + (nearest + step) @ axes
            answer = gs.distance_to_frustum(frustum, [point])
            assert answer.region[0] == sum(CODES[n] for n in chosen), describe(frustum, point)
            assert answer.distance[0] == pytest.approx(np.linalg.norm(step), rel=1e-12)
            assert answer.point_a[0] == pytest.approx(origin + nearest @ axes, abs=1e-12)
            reached.add(int(answer.region[0]))
    inside = origin + (rng.dirichlet(np.ones(len(corners)), 10) @ corners) @ axes
    answer = gs.distance_to_frustum(frustum, inside)
    assert not answer.region.any() and not answer.distance.any() and not answer.upper.any()
    assert (answer.point_a == inside).all() and np.isnan(answer.normal).all()
    assert len(reached) == (26 if dimension == 3 else 8)


@pytest.mark.parametrize("signs", list(product((1, -1), repeat=3)))
def test_points_of_the_surface_are_inside(signs):
    """Closed sets: no point of the boundary is at a distance, where the numbers are exact."""
    order = [1, 2, 0]
    axes = np.eye(3)[order] * np.array(signs)[:, None]
    frustum = gs.Frustum([8.0, -4.0, 2.0], axes, 1.0, 0.5, 1.0, 4.0)
    corners = frustum.corners()
    weights = np.array([[(i >> k & 1) + (j >> k & 1) for k in range(8)] for i in range(256) for j in (i, 255) if i])
    weights = weights / weights.sum(axis=1, keepdims=True)
    exact = np.log2(1 / weights.max(axis=1)) % 1 == 0  # halves, quarters, eighths
    points = weights[exact] @ corners
    assert len(points) > 100
    answer = gs.distance_to_frustum(frustum, points)
    assert not answer.distance.any() and not answer.region.any()


# ---------------------------------------------------------------------------------------------------- random scenes


def random_window(rng, kind, near):
    a = near * 10.0 ** rng.uniform(-2.0, 1.0)
    if kind == "centred":
        return -a, a
    if kind == "around":
        return -a, a * 10.0 ** rng.uniform(-1.0, 1.0)
    low, high = a, a * (1.0 + 10.0 ** rng.uniform(-2.0, 1.0))
    return (low, high) if rng.random() < 0.5 else (-high, -low)


def scene(rng, count, *, dimension=3, windows=("centred", "centred"), ratio=30.0, defect=0.0, far_away=0.0, steep=1.0):
    """A frustum and points in it, near its surface, around it, and beyond its far corners."""
    near = 2.0 ** rng.uniform(-3, 3)
    sides = dimension - 1
    bounds = steep * np.array([x for kind in windows[:sides] for x in random_window(rng, kind, near)])
    axes = rotation(rng, dimension) + rng.uniform(-defect, defect, (dimension, dimension))
    kind = gs.Frustum if dimension == 3 else gs.Frustum2D
    frustum = kind(rng.normal(size=dimension) * far_away, axes, bounds=bounds, near=near, far=near * ratio)
    low, high = bounds[0::2], bounds[1::2]
    points = []
    for i in range(count):
        t = min(ratio, 1e3) ** rng.random()
        corner = np.append(np.where(rng.random(sides) < 0.5, low, high), near)
        match i % 5:
            case 0:  # about the frustum
                local = t * np.append(low + (high - low) * rng.uniform(-0.5, 1.5, sides), near)
            case 1:  # about a slanted edge
                local = t * corner + rng.normal(size=dimension) * near * 10.0 ** rng.uniform(-9, 2)
            case 2:  # anywhere, behind the apex too
                local = rng.normal(size=dimension) * near * 10.0 ** rng.uniform(-1, 3)
            case 3:  # about a far corner
                local = ratio * corner * rng.uniform(0.9, 1.3, dimension)
            case _:  # about a near corner
                local = corner * rng.uniform(0.3, 1.5, dimension)
        points.append(frustum.origin + local @ axes)
    return frustum, points


SCENES = {
    "centred": {},
    "around the axis": {"windows": ("around", "around")},
    "beside the axis": {"windows": ("beyond", "around")},
    "above the axis": {"windows": ("around", "beyond")},
    "beside and above the axis": {"windows": ("beyond", "beyond")},
    "f/n = 1e12": {"ratio": 1e12, "windows": ("around", "centred")},
    "thin": {"ratio": 1.0 + 1e-9},
    "steep sides": {"steep": 1e6, "windows": ("beyond", "around")},
    "needle": {"steep": 1e-9},
    "axes off by 1e-15": {"defect": 1e-15},
    "axes off by 1e-8": {"defect": 1e-8, "windows": ("around", "around")},
    "axes off by 1e-3": {"defect": 1e-3, "windows": ("around", "beyond")},
    # Products of rows are off by at most 2 sqrt(3) times as much: what is accepted at the most.
    "axes off by 2.8e-3": {"defect": 2.8e-3, "windows": ("beyond", "centred")},
    "far from the origin": {"far_away": 1e6},
}


def feature_distance(frustum, region, point):
    """Distance of a point from the closed feature that a region names, by plain floating point."""
    depth, height, side = region // 9, region // 3 % 3, region % 3
    corners = frustum.corners(frustum.origin) if isinstance(frustum, gs.Frustum) else corners_2d(frustum)
    on = [
        c
        for i, c in enumerate(corners)
        if (side == 0 or (i & 1) == (side == 1))
        and (height == 0 or (i >> 1 & 1) == (height == 1))
        and (depth == 0 or i // (len(corners) // 2) == depth - 1)
    ]
    on = np.array(on) - (point - frustum.origin)
    if len(on) == 1:
        return np.linalg.norm(on[0])
    if len(on) == 2:
        return segment_distance(*on)
    # A flat quadrilateral, its corners in the order 0 1 3 2.
    a, b, c, d = on[0], on[1], on[3], on[2]
    normal = np.cross(c - a, d - b)
    inside = {np.sign(np.cross(q - p, -p) @ normal) for p, q in ((a, b), (b, c), (c, d), (d, a))}
    edges = [segment_distance(p, q) for p, q in ((a, b), (b, c), (c, d), (d, a))]
    return min(edges + ([abs(normal @ a) / np.linalg.norm(normal)] if len(inside - {0.0}) == 1 else []))


def segment_distance(a, b):
    """Distance of the origin from a segment."""
    t = np.clip(-a @ (b - a) / ((b - a) @ (b - a)), 0.0, 1.0)
    return np.linalg.norm(a + t * (b - a))


def corners_2d(frustum):
    near = np.array([[x, frustum.near] for x in frustum.bounds])
    return np.concatenate([near, near * (frustum.far / frustum.near)]) @ frustum.axes


@pytest.mark.parametrize("name", SCENES)
@pytest.mark.parametrize("dimension", [2, 3])
def test_random(name, dimension, rng):
    kinds, matched, total = set(), 0, 0
    for _ in range(ROUNDS * (6 if dimension == 3 else 8)):
        frustum, points = scene(rng, 10, dimension=dimension, **SCENES[name])
        answer, regions = check_exactly(frustum, points)
        kinds |= set(regions.tolist())
        matched, total = matched + np.count_nonzero(regions == answer.region), total + len(points)
        if "off by" in name or "steep" in name or "needle" in name:
            continue  # the plain arithmetic below is not up to these
        for i in np.flatnonzero((regions != answer.region) & (answer.region > 0)):
            # Only on the border of two regions may the other be named.
            gap = feature_distance(frustum, int(answer.region[i]), points[i]) - answer.distance[i]
            assert abs(gap) <= 1e-10 * np.linalg.norm(points[i] - frustum.origin), describe(frustum, points[i])
    assert matched >= 0.9 * total
    assert len(kinds) >= (5 if dimension == 2 else 12), sorted(kinds)


def test_random_points_reach_all_regions(rng):
    for bounds in WINDOWS.values():
        frustum = gs.Frustum([0, 0, 0], np.eye(3), bounds=bounds, near=1.0, far=FAR)
        points = rng.uniform(-1, 1, (20000, 3)) * [12, 12, 8]
        found = np.bincount(gs.distance_to_frustum(frustum, points).region, minlength=27)
        assert len(found) == 27 and found.min() >= 3, (bounds, found)


@pytest.mark.parametrize("exponent", [-1060, -1000, -600, -450, 450, 600, 1000])
@pytest.mark.parametrize("dimension", [2, 3])
def test_scene_of_any_scale(exponent, dimension, rng):
    frustum, points = scene(rng, 15, dimension=dimension, windows=("around", "beyond"))
    kind = type(frustum)
    grown = [np.ldexp(x, exponent) for x in (frustum.origin, frustum.bounds, frustum.near, frustum.far)]
    grown_frustum = kind(grown[0], frustum.axes, bounds=grown[1], near=grown[2], far=grown[3])
    check_exactly(grown_frustum, np.ldexp(points, exponent))


@pytest.mark.parametrize("left, up", list(product([1e-300, 1e-150, 1.0, 1e150, 1e300], repeat=2)))
def test_needles_and_fans(left, up, rng):
    """Parameters from 1e-300 to 1e300 neither overflow nor vanish."""
    for near in (1e-300, 1e-150, 1.0, 1e150):
        axes = np.eye(3)[rng.permutation(3)] * rng.choice([-1, 1], 3)[:, None]
        frustum = gs.Frustum([0, 0, 0], axes, left, up, near, 1e300 if rng.random() < 0.5 else near * 10)
        scales = 10.0 ** rng.uniform(-300, 300, (6, 3))
        scales[0] = left, up, near
        check_exactly(frustum, (scales * rng.uniform(-2, 2, (6, 3))) @ axes)


def test_answer_beyond_the_range_of_doubles():
    answer = gs.distance_to_frustum(gs.Frustum([1.5e308, 0, 0], np.eye(3), 1, 1, 1, 2), [[-1.5e308, 0, 0]])
    assert answer.distance[0] == answer.upper[0] == np.inf
    assert answer.lower[0] == np.finfo(float).max


# ------------------------------------------------------------------------------------------------------------ laws


def with_view(frustum, axes, bounds):
    return gs.Frustum(frustum.origin, axes, bounds=bounds, near=frustum.near, far=frustum.far)


def check_agreement(one, other, points, origin):
    """Two roundings of one scene."""
    size = np.linalg.norm(points - origin, axis=1) + one.distance
    assert (np.abs(one.distance - other.distance) <= 2 * MAX_ERROR * size).all()
    assert (np.maximum(one.lower, other.lower) <= np.minimum(one.upper, other.upper)).all()


@pytest.fixture
def crowd(rng):
    return scene(rng, 1001, windows=("around", "beyond"))


SWAP_SIDES = np.array([0, 2, 1])  # left and right, or up and down


def test_mirror(crowd):
    frustum, points = crowd
    l0, l1, u0, u1 = frustum.bounds
    mirrored = with_view(frustum, frustum.axes * [[-1], [1], [1]], (-l1, -l0, u0, u1))
    one, other = gs.distance_to_frustum(frustum, points), gs.distance_to_frustum(mirrored, points)
    check_agreement(one, other, points, frustum.origin)
    assert (one.region // 3 * 3 + SWAP_SIDES[one.region % 3] == other.region).mean() > 0.99


def test_swap_of_left_and_up(crowd):
    frustum, points = crowd
    l0, l1, u0, u1 = frustum.bounds
    swapped = with_view(frustum, frustum.axes[[1, 0, 2]], (u0, u1, l0, l1))
    one, other = gs.distance_to_frustum(frustum, points), gs.distance_to_frustum(swapped, points)
    check_agreement(one, other, points, frustum.origin)
    assert (one.region // 9 * 9 + one.region % 3 * 3 + one.region // 3 % 3 == other.region).mean() > 0.99


def test_rotation_of_the_world(crowd, rng):
    frustum, points = crowd
    turn = rotation(rng)
    turned = gs.Frustum(
        frustum.origin @ turn, frustum.axes @ turn, bounds=frustum.bounds, near=frustum.near, far=frustum.far
    )
    one, other = gs.distance_to_frustum(frustum, points), gs.distance_to_frustum(turned, points @ turn)
    check_agreement(one, other, points, frustum.origin)


@pytest.mark.parametrize("exponent", [-300, -1, 5, 300])
def test_power_of_two_scale_changes_no_bit(crowd, exponent):
    frustum, points = crowd
    grown = [np.ldexp(x, exponent) for x in (frustum.origin, frustum.bounds, frustum.near, frustum.far)]
    other_frustum = gs.Frustum(grown[0], frustum.axes, bounds=grown[1], near=grown[2], far=grown[3])
    one, other = (
        gs.distance_to_frustum(frustum, points),
        gs.distance_to_frustum(other_frustum, np.ldexp(points, exponent)),
    )
    for name in ("distance", "lower", "upper", "point_a"):
        assert (np.ldexp(getattr(one, name), exponent) == getattr(other, name)).all(), name
    assert (one.region == other.region).all()


def test_exact_translation_changes_no_bit(crowd):
    frustum, points = crowd
    grid = 2.0**-20
    origin, points = np.round(frustum.origin / grid) * grid, np.round(np.array(points) / grid) * grid
    answers = [
        gs.distance_to_frustum(
            gs.Frustum(origin + by, frustum.axes, bounds=frustum.bounds, near=frustum.near, far=frustum.far),
            points + by,
        )
        for by in (np.zeros(3), np.array([2.0**25, -(2.0**24), 3.0 * 2.0**23]))
    ]
    for name in ("distance", "lower", "upper", "region"):
        assert (getattr(answers[0], name) == getattr(answers[1], name)).all(), name


def test_distance_to_a_part_is_not_less(crowd):
    """A shorter frustum, and one with a narrower window, are parts of the frustum."""
    frustum, points = crowd
    whole = gs.distance_to_frustum(frustum, points)
    l0, l1, u0, u1 = frustum.bounds
    parts = [
        gs.Frustum(
            frustum.origin,
            frustum.axes,
            bounds=2 * np.array(frustum.bounds),
            near=2 * frustum.near,
            far=frustum.far / 2,
        ),
        with_view(frustum, frustum.axes, (l0, (l0 + l1) / 2, (u0 + u1) / 2, u1)),
    ]
    for part in parts:
        assert (gs.distance_to_frustum(part, points).upper >= whole.lower).all()


def test_off_centre_frustum_in_the_plane_is_a_slice_of_one_in_space(rng):
    """With a point in the plane of symmetry the second side does not matter."""
    flat, points = scene(rng, 500, dimension=2, windows=("beyond",))
    upright = np.array([[*flat.axes[0], 0], [0, 0, 1], [*flat.axes[1], 0]])
    solid = gs.Frustum([*flat.origin, 0], upright, bounds=[*flat.bounds, -1, 1], near=flat.near, far=flat.far)
    one = gs.distance_to_frustum(flat, points)
    other = gs.distance_to_frustum(solid, np.column_stack([points, np.zeros(len(points))]))
    check_agreement(one, other, points, flat.origin)
    assert (one.region == other.region).mean() > 0.99


# --------------------------------------------------------------------------------------------------------- batches


@pytest.mark.parametrize("count", [0, 1, 2, 3, 4, 5, 8, 1001])
@pytest.mark.parametrize("scale", [1.0, 1e-200], ids=["ordinary", "extreme"])
def test_batches_of_any_length_agree(crowd, count, scale):
    frustum, points = crowd
    points = np.array(points)
    points[::7] *= scale  # near the apex of a frustum at the origin: other arithmetic, same answers
    frustum = gs.Frustum([0, 0, 0], frustum.axes, bounds=frustum.bounds, near=frustum.near, far=frustum.far)
    whole = gs.distance_to_frustum(frustum, points, want=("witness",))
    part = gs.distance_to_frustum(frustum, points[:count], want=("witness",))
    for name in ("distance", "lower", "upper", "region", "point_a"):
        assert (getattr(part, name) == getattr(whole, name)[:count]).all(), name


def test_large_batches_answer_alike(crowd):
    """Results of some MB are allocated in another way, by themselves and for whoever holds them."""
    frustum, points = crowd
    copies = 600
    answer = gs.distance_to_frustum(frustum, np.tile(points, (copies, 1)), want=("witness",))
    once = gs.distance_to_frustum(frustum, points, want=("witness",))
    large = {name: getattr(answer, name) for name in ("distance", "lower", "upper", "region", "point_a")}
    assert large["distance"].nbytes > 4 << 20
    del answer
    for name, values in large.items():
        expected = getattr(once, name)
        assert values.dtype == expected.dtype and values.flags.c_contiguous and values.flags.writeable
        assert (values.reshape(copies, *expected.shape) == expected).all(), name


def test_both_arithmetics_agree(rng):
    """Points whose squares leave the range of double are measured in long double, in the same batch."""
    frustum = gs.Frustum([0, 0, 0], np.eye(3), bounds=(0.0, 1.0, -1.0, 1.0), near=1.0, far=4.0)
    beside = 10.0 ** rng.uniform(-300, -3, 400)
    points = np.column_stack([-beside, rng.uniform(-0.5, 0.5, 400), rng.uniform(1.5, 3.5, 400)])
    answer = gs.distance_to_frustum(frustum, points)
    assert (answer.distance == beside).all()  # the face x = 0
    assert (answer.region == FrustumRegion.RIGHT).all()


def test_neighbours_in_a_batch_change_no_bit(crowd, rng):
    frustum, points = crowd
    points = np.array(points[:200])
    points[rng.random(200) < 0.3] *= 1e200  # out of range: measured one by one
    batch = gs.distance_to_frustum(frustum, points, want=("witness",))
    for i, point in enumerate(points):
        single = gs.distance_to_frustum(frustum, [point], want=("witness",))
        for name in ("distance", "lower", "upper", "region", "point_a"):
            assert np.array_equal(getattr(single, name)[0], getattr(batch, name)[i]), name


def test_witness_on_demand_is_the_same(crowd):
    at_once, later = (gs.distance_to_frustum(*crowd, want=want) for want in (("distance", "witness"), ("distance",)))
    assert (at_once.point_a == later.point_a).all()
    outside = at_once.distance > 0
    gap = np.linalg.norm(at_once.point_b - at_once.point_a, axis=1)
    assert gap[outside] == pytest.approx(at_once.distance[outside], rel=1e-9)


# ---------------------------------------------------------------------------------------------------- other tiers

# The same width in single precision, near and far included.
MAX_FLOAT_WIDTH = 200 * 2.0**-24
# What `feature_distance`, plain floating point, may be off by, as a part of the way from the apex.
PLAIN_ERROR = 1e-10


def rounded(square):
    """The root, rounded to nearest, down and up."""
    nearest = root_double(square)
    side = compare_root(nearest, square)
    return (
        nearest,
        nearest if side <= 0 else math.nextafter(nearest, -math.inf),
        nearest if side >= 0 else math.nextafter(nearest, math.inf),
    )


def check_rounded(frustum, points):
    """The tier "exact": every number correctly rounded, every region the right one; returns the regions."""
    answer = gs.distance_to_frustum(frustum, points, accuracy="exact", want=("witness",))
    counts = answer.cost.counts
    assert set(counts) <= {"filter", "wide", "exact"} and sum(counts.values()) == len(points), counts
    regions = []
    for i, point in enumerate(np.asarray(points)):
        exact = exact_nearest(frustum, point)
        text = f"{counts}\n{describe(frustum, point)}"
        found = answer.distance[i], answer.lower[i], answer.upper[i]
        assert found == rounded(exact.squared_distance), text
        assert answer.region[i] == region_of(exact), text
        assert answer.point_a[i].tolist() == [nearest_double(x) for x in exact.point], text
        regions.append(region_of(exact))
    return np.array(regions)


@pytest.mark.parametrize("case", CORPUS, ids=[case["id"] for case in CORPUS])
def test_hard_case_exactly(case):
    check_rounded(*corpus_scene(case))


@pytest.mark.parametrize("name", SCENES)
@pytest.mark.parametrize("dimension", [2, 3])
def test_exact_is_correctly_rounded(name, dimension, rng):
    kinds = set()
    for _ in range(ROUNDS * (4 if dimension == 3 else 6)):
        kinds |= set(check_rounded(*scene(rng, 10, dimension=dimension, **SCENES[name])).tolist())
    assert len(kinds) >= (4 if dimension == 2 else 10), sorted(kinds)


@pytest.mark.parametrize("name", WINDOWS)
@pytest.mark.parametrize("dimension", [2, 3])
def test_exact_region_on_borders(name, dimension, rng):
    """A point of a feature plus steps along some of its normals only: on the border of regions, without rounding."""
    bounds = WINDOWS[name][: 2 * (dimension - 1)]
    faces = faces_2d(bounds) if dimension == 2 else faces_3d(bounds)
    near = [np.append(side, 1.0) for side in product(*np.reshape(bounds, (-1, 2)))]
    corners = [*near, *(FAR * corner for corner in near)]
    # Axes, windows and steps of few bits, so that points are what they are meant to be.
    axes = np.eye(dimension)[rng.permutation(dimension)] * rng.choice([-1, 1], dimension)[:, None]
    origin = rng.integers(-8, 8, dimension) / 4
    frustum = (gs.Frustum if dimension == 3 else gs.Frustum2D)(origin, axes, bounds=bounds, near=1.0, far=FAR)
    points = []
    for chosen, on_all in features(faces, corners):
        weights = rng.multinomial(8, np.full(len(on_all), 1 / len(on_all)), 3) / 8
        for weight, kept in zip(weights, rng.integers(0, 2, (3, len(chosen))), strict=True):
            step = sum(
                k * rng.integers(1, 9) / 4 * np.array(faces[n], float) for k, n in zip(kept, chosen, strict=True)
            )
            points.append(origin + (weight @ on_all + step) @ axes)
    regions = check_rounded(frustum, points)
    assert (regions == 0).sum() >= 5 and len(set(regions.tolist())) >= (6 if dimension == 2 else 20)


@pytest.mark.parametrize("exponent", [-1060, -1000, -996, -450, 450, 600, 996])
@pytest.mark.parametrize("dimension", [2, 3])
def test_exact_at_any_scale(exponent, dimension, rng):
    """From 1e-300 to 1e300, and where doubles have no more bits."""
    frustum, points = scene(rng, 15, dimension=dimension, windows=("around", "beyond"))
    grown = [np.ldexp(x, exponent) for x in (frustum.origin, frustum.bounds, frustum.near, frustum.far)]
    check_rounded(
        type(frustum)(grown[0], frustum.axes, bounds=grown[1], near=grown[2], far=grown[3]), np.ldexp(points, exponent)
    )


@pytest.mark.parametrize("left, up", list(product([1e-300, 1.0, 1e300], repeat=2)))
def test_exact_needles_and_fans(left, up, rng):
    for near in (1e-300, 1.0, 1e150):
        frustum = gs.Frustum([0, 0, 0], rotation(rng), left, up, near, 1e300 if rng.random() < 0.5 else near * 10)
        scales = 10.0 ** rng.uniform(-300, 300, (4, 3))
        scales[0] = left, up, near
        check_rounded(frustum, (scales * rng.uniform(-2, 2, (4, 3))) @ frustum.axes)


@pytest.mark.parametrize("count", [1, 3, 4, 5, 63, 64, 65, 130])
def test_exact_batches_of_any_length_agree(count, crowd):
    frustum, points = crowd
    whole = gs.distance_to_frustum(frustum, points, accuracy="exact")
    part = gs.distance_to_frustum(frustum, points[:count], accuracy="exact")
    for name in ("distance", "lower", "upper", "region"):
        assert (getattr(part, name) == getattr(whole, name)[:count]).all(), name
    assert sum(part.cost.counts.values()) == count


def test_exact_lies_in_the_interval_of_float64(crowd):
    one, other = (gs.distance_to_frustum(*crowd, accuracy=tier) for tier in ("float64", "exact"))
    assert (one.lower <= other.upper).all() and (other.lower <= one.upper).all()
    assert (one.region == other.region).mean() > 0.99
    assert other.cost.counts["exact"] == 0


def check_bounds(frustum, points, tier):
    """The interval holds the truth, and a region is the right one but for rounding; returns the widest interval."""
    answer = gs.distance_to_frustum(frustum, points, accuracy=tier, want=("witness",))
    assert answer.cost.accuracy == tier
    widest = 0.0
    for i, point in enumerate(np.asarray(points)):
        exact = exact_nearest(frustum, point)
        distance, lower, upper = answer.distance[i], answer.lower[i], answer.upper[i]
        text = f"{lower!r} <= {distance!r} <= {upper!r}\n{describe(frustum, point)}"
        assert 0.0 <= lower <= distance <= upper, text
        assert in_interval(exact.squared_distance, lower, upper), text
        if tier == "bound":
            assert distance == lower, text
            continue
        inside = answer.region[i] == FrustumRegion.INSIDE
        assert inside == (distance == 0.0) or (distance == 0.0 and upper <= SUBNORMAL), text
        scale = np.abs(point - frustum.origin).sum() + root_double(exact.squared_distance)
        assert upper - lower <= MAX_FLOAT_WIDTH * scale + SUBNORMAL, text
        widest = max(widest, (upper - lower) / scale)
        if answer.region[i] > 0 and answer.region[i] != region_of(exact):
            feature = feature_distance(frustum, int(answer.region[i]), point)
            assert feature <= upper + PLAIN_ERROR * scale, (FrustumRegion(int(answer.region[i])).name, text)
    if tier == "bound":
        assert answer.region is None and np.isnan(answer.point_a).all()
    return widest


@pytest.mark.parametrize("tier", ["bound", "float32"])
@pytest.mark.parametrize("name", SCENES)
@pytest.mark.parametrize("dimension", [2, 3])
def test_bounds_hold(tier, name, dimension, rng):
    for _ in range(ROUNDS * 4):
        check_bounds(*scene(rng, 10, dimension=dimension, **SCENES[name]), tier)


@pytest.mark.parametrize("tier", ["bound", "float32"])
@pytest.mark.parametrize("case", CORPUS, ids=[case["id"] for case in CORPUS])
def test_bounds_hold_on_hard_cases(tier, case):
    check_bounds(*corpus_scene(case), tier)


@pytest.mark.parametrize("tier", ["bound", "float32"])
@pytest.mark.parametrize("exponent", [-1060, -1000, -996, -450, -130, 130, 450, 996])
@pytest.mark.parametrize("dimension", [2, 3])
def test_bounds_hold_at_any_scale(tier, exponent, dimension, rng):
    frustum, points = scene(rng, 15, dimension=dimension, windows=("around", "beyond"))
    grown = [np.ldexp(x, exponent) for x in (frustum.origin, frustum.bounds, frustum.near, frustum.far)]
    check_bounds(
        type(frustum)(grown[0], frustum.axes, bounds=grown[1], near=grown[2], far=grown[3]),
        np.ldexp(points, exponent),
        tier,
    )


def test_float32_answers_in_float32(rng):
    """In an ordinary scene the intervals are as wide as single precision makes them: it is really used."""
    frustum, points = scene(rng, 40)
    assert check_bounds(frustum, points, "float32") > 2.0**-24


def test_bound_never_misses(rng):
    """Where the lower bound is above zero, no point is in the frustum; near the frustum it is zero."""
    frustum = gs.Frustum([0, 0, 0], np.eye(3), 1.0, 0.5, 1.0, FAR)
    points = rng.uniform(-1, 1, (20000, 3)) * [12, 12, 8]
    bound, exact = (gs.distance_to_frustum(frustum, points, accuracy=tier) for tier in ("bound", "exact"))
    assert (bound.lower <= exact.lower).all() and (bound.upper >= exact.upper).all()
    assert (bound.lower[exact.region == FrustumRegion.INSIDE] == 0.0).all() and (bound.lower > 0.0).mean() > 0.5
