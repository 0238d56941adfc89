# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""Distance, intersection and depth of two boxes, and of two hulls of points."""

from __future__ import annotations

import math
from fractions import Fraction
from random import Random
from typing import Any

from oracle.vectors import Vector, add, exact, scale

from hard import contact, numbers
from hard.frustum_box import box, corners, moved
from hard.numbers import eighths, magnitude, sign
from hard.registry import hard

Input = dict[str, Any]
Cloud = list[list[float]]

# ------------------------------------------------------------------------------------------------ building blocks


def pair(a: Any, b: Any, normal: Vector, gap: float, rng: Random) -> Input:
    """Boxes brought together along a normal and parted by `gap` (< 0: into each other), rounded."""
    shift = contact.into_contact(corners(a), corners(b), normal, rng)
    return {"box0": a, "box1": moved(b, add(shift, exact(contact.apart(normal, gap))))}


def random_box(rng: Random, low: float = -1, high: float = 0.3) -> Any:
    half = [magnitude(rng, low, high) for _ in range(3)]
    return box([rng.gauss(0, 2) for _ in range(3)], numbers.rotated(rng), half)


def close(a: Any, b: Any, gap: float, rng: Random) -> Input:
    return pair(a, b, contact.some_normal(corners(a), corners(b), rng), gap, rng)


def touching(rng: Random, frames: Any = numbers.exact_frame) -> Input:
    """Boxes that touch to the last bit, across faces, edges and corners."""
    while True:
        frame = frames(rng)
        other = frame if rng.random() < 0.4 else frames(rng)
        a = box([eighths(rng, -16, 16) for _ in range(3)], frame, [eighths(rng, 1, 12) for _ in range(3)])
        b = box((0, 0, 0), other, [eighths(rng, 1, 12) for _ in range(3)])
        normal = contact.some_normal(corners(a), corners(b), rng)
        shift = contact.into_contact(corners(a), corners(b), normal, rng)
        if numbers.is_exact(shift):
            return {"box0": a, "box1": moved(b, shift)}


# ---------------------------------------------------------------------------------------------------------- boxes


@hard("box_box_distance")
def touch_exact(rng: Random) -> Input:
    """Touching: distance 0, depth 0."""
    return touching(rng)


@hard("box_box_distance")
def touch_ulp(rng: Random) -> Input:
    """One or two ulps from touching: a centre or an extent moves."""
    given = touching(rng)
    body, name = given[rng.choice(("box0", "box1"))], rng.choice("Ce")
    body[name] = numbers.nudged_somewhere(body[name], rng)
    return given


@hard("box_box_distance")
def touch_nearly(rng: Random) -> Input:
    """Gaps and depths of 1e-7 to 1e-17 of the size, where searches and their second phase disagree."""
    return close(random_box(rng), random_box(rng), sign(rng) * magnitude(rng, -17, -7), rng)


@hard("box_box_distance")
def near_parallel_faces(rng: Random) -> Input:
    """Faces parallel to 1e-6 to 1e-15 rad: the nearest pair is ill-conditioned, the distance is not."""
    a, angle = random_box(rng), magnitude(rng, -15, -6)
    axes = rng.sample(numbers.tilted(a["A"], angle, rng), 3)
    b = box((0, 0, 0), axes, [magnitude(rng, -1, 0.3) for _ in range(3)])
    return pair(a, b, contact.facet_normal(corners(a), rng), sign(rng) * magnitude(rng, -10, 0), rng)


@hard("box_box_distance")
def near_parallel_ridge(rng: Random) -> Input:
    """Edges that cross at 1e-6 to 1e-10 rad: only their cross product separates."""
    angle = magnitude(rng, -10, -6)
    frame = numbers.rotated(rng)
    c, s, root = math.cos(angle), math.sin(angle), math.sqrt(0.5)

    def turned(edge: Vector, first: float, second: float) -> numbers.Frame:
        """Rows: the edge, and two at 45 degrees to the outward normal."""
        side = (-edge[1], edge[0], 0.0)
        rows = [edge, tuple(root * (x * first) for x in side), tuple(root * x * second for x in side)]
        rows[1] = (rows[1][0], rows[1][1], root)
        rows[2] = (rows[2][0], rows[2][1], root)
        return [[sum(r[k] * frame[k][j] for k in range(3)) for j in range(3)] for r in rows]

    a = box((0, 0, 0), turned((1.0, 0.0, 0.0), 1, -1), [magnitude(rng, -0.5, 0.5) for _ in range(3)])
    b = box((0, 0, 0), turned((c, s, 0.0), 1, -1), [magnitude(rng, -0.5, 0.5) for _ in range(3)])
    normal = exact(frame[2])
    return pair(a, b, normal, sign(rng) * angle * rng.uniform(0.01, 0.5), rng)


@hard("box_box_distance")
def needle_slab(rng: Random) -> Input:
    """Extents from 1e-6 to 1e6 against 1."""
    bodies = []
    for _ in range(2):
        half = [10.0 ** rng.choice((-6, -6, 0, 6)) for _ in range(3)]
        bodies.append(box((0, 0, 0), rng.choice((numbers.rotated, numbers.permuted))(rng), half))
    return close(*bodies, sign(rng) * magnitude(rng, -7, 0), rng)


@hard("box_box_distance")
def big_small(rng: Random) -> Input:
    """A box of a centimetre on one of kilometres."""
    return close(random_box(rng, 2, 4), random_box(rng, -2.5, -1.5), sign(rng) * magnitude(rng, -6, -1), rng)


@hard("box_box_distance")
def degenerate_extent(rng: Random) -> Input:
    """Boxes that are points, segments or rectangles, apart, touching or through the other."""
    given = touching(rng)
    for name in ("box0", "box1"):
        flat = rng.sample(range(3), rng.choice((0, 1, 1, 2, 3)))
        given[name]["e"] = [0.0 if k in flat else x for k, x in enumerate(given[name]["e"])]
    if rng.random() < 0.4:
        inside = contact.mixed(corners(given["box0"]), rng)
        given["box1"]["C"] = numbers.doubles(inside)
    return given


@hard("box_box_distance")
def non_unique_closest(rng: Random) -> Input:
    """Parallel faces or edges: the nearest points fill a rectangle or a segment."""
    frame = numbers.exact_frame(rng)
    a, b = (box((0, 0, 0), frame, [eighths(rng, 1, 12) for _ in range(3)]) for _ in range(2))
    normal = contact.facet_normal(corners(a), rng)
    return pair(a, b, normal, rng.choice((1.0, 0.5, 2.0**-20, -0.125)), rng)


@hard("box_box_distance")
def lattice(rng: Random) -> Input:
    """Sizes and places on a coarse lattice, turns of 45 degrees: what scenes made by hand look like."""
    root = math.sqrt(0.5)
    turns = [numbers.world(), [[root, root, 0.0], [-root, root, 0.0], [0.0, 0.0, 1.0]]]
    return {
        name: box(
            [rng.randint(-6, 6) / 2 for _ in range(3)],
            rng.choice(turns),
            [rng.choice((0.25, 0.5, 1.0)) for _ in range(3)],
        )
        for name in ("box0", "box1")
    }


@hard("box_box_distance")
def coincident_or_contained(rng: Random) -> Input:
    """One inside the other, concentric or the same: several depths tie."""
    a = box([eighths(rng, -16, 16)] * 3, numbers.exact_frame(rng), [eighths(rng, 4, 12)] * 3)
    choice = rng.randrange(3)
    if choice == 0:
        return {"box0": a, "box1": a}
    half = [x / rng.choice((1, 2, 8)) for x in a["e"]]
    axes = a["A"] if choice == 1 else numbers.rotated(rng)
    center = a["C"] if rng.random() < 0.5 else [x + rng.uniform(-1, 1) for x in a["C"]]
    return {"box0": a, "box1": box(center, axes, half)}


@hard("box_box_distance")
def far_from_origin(rng: Random) -> Input:
    """Millimetre boxes 1e3 to 1e9 from the origin."""
    a, b = random_box(rng, -4, -2.5), random_box(rng, -4, -2.5)
    a["C"] = [magnitude(rng, 3, 9) * sign(rng) for _ in range(3)]
    return close(a, b, sign(rng) * magnitude(rng, -8, -3), rng)


@hard("box_box_distance")
def skewed_axes(rng: Random) -> Input:
    """Axes off orthonormal by up to 2e-3."""
    a, b = random_box(rng), random_box(rng)
    for body in (a, b):
        body["A"] = numbers.skewed(body["A"], magnitude(rng, -16, -2.7), rng)
    return close(a, b, sign(rng) * magnitude(rng, -12, 0), rng)


@hard("box_box_distance")
def huge_scale(rng: Random) -> Input:
    """A hard case times 2^300 to 2^980."""
    return scaled_boxes(rng, numbers.HUGE)


@hard("box_box_distance")
def tiny_scale(rng: Random) -> Input:
    """A hard case times 2^-300 to 2^-1060."""
    return scaled_boxes(rng, numbers.TINY)


def scaled_boxes(rng: Random, exponents: tuple[int, int]) -> Input:
    given = rng.choice((touching, touch_ulp, touch_nearly, near_parallel_ridge, non_unique_closest))(rng)
    factor = rng.randint(*exponents)
    return {
        name: body | {key: numbers.mapped(body[key], lambda x: math.ldexp(x, factor)) for key in "Ce"}
        for name, body in given.items()
    }


# ---------------------------------------------------------------------------------------------------------- hulls


def placed(a: Cloud, b: Cloud, normal: Vector, gap: float, rng: Random) -> Input:
    """Clouds brought together along a normal and parted by `gap`, rounded point by point."""
    shift = add(contact.into_contact(a, b, normal, rng), exact(contact.apart(normal, gap)))
    return {"P": a, "Q": [numbers.doubles(add(exact(q), shift)) for q in b]}


def cloud(rng: Random, low: int = 4, high: int = 10) -> Cloud:
    return [[rng.gauss(0, 1) for _ in range(3)] for _ in range(rng.randint(low, high))]


def few_bits(rng: Random, low: int = 4, high: int = 8, dimension: int = 3) -> Cloud:
    """Points of a lattice of eighths: parallel edges and coplanar corners are frequent."""
    return [[eighths(rng, -8, 8) if k < dimension else 0.0 for k in range(3)] for _ in range(rng.randint(low, high))]


def close_clouds(a: Cloud, b: Cloud, gap: float, rng: Random) -> Input:
    return placed(a, b, contact.some_normal(a, b, rng), gap, rng)


@hard("polytope_distance")
def hull_touch_exact(rng: Random) -> Input:
    """Touching hulls of a lattice's points."""
    while True:
        a, b = few_bits(rng), few_bits(rng)
        shift = contact.into_contact(a, b, contact.some_normal(a, b, rng), rng)
        if numbers.is_exact(shift):
            return {"P": a, "Q": [numbers.doubles(add(exact(q), shift)) for q in b]}


@hard("polytope_distance")
def hull_touch_ulp(rng: Random) -> Input:
    """One coordinate of one vertex is an ulp or two off."""
    given = hull_touch_exact(rng)
    side = given[rng.choice("PQ")]
    k = rng.randrange(len(side))
    side[k] = numbers.nudged_somewhere(side[k], rng)
    return given


@hard("polytope_distance")
def hull_touch_nearly(rng: Random) -> Input:
    """Gaps and depths of 1e-7 to 1e-17."""
    return close_clouds(cloud(rng), cloud(rng), sign(rng) * magnitude(rng, -17, -7), rng)


@hard("polytope_distance")
def lattice_hulls(rng: Random) -> Input:
    """Whole numbers from -2 to 2: ties, parallel faces, degenerate simplices at every step."""
    return {name: [[float(rng.randint(-2, 2)) for _ in range(3)] for _ in range(rng.randint(1, 8))] for name in "PQ"}


@hard("polytope_distance")
def flat_bodies(rng: Random) -> Input:
    """Points, segments and polygons, coplanar with the other or not, on the plane of a face."""
    a = few_bits(rng, 1, 5, rng.choice((1, 2, 2)))
    b = few_bits(rng, 1, 5, rng.choice((1, 2, 2, 3)))
    if rng.random() < 0.5:
        return {"P": a, "Q": b}
    return placed(a, b, contact.any_normal(rng), rng.choice((0.0, 0.0, 1e-9, 1.0)), rng)


@hard("polytope_distance")
def repeated_coplanar(rng: Random) -> Input:
    """Vertices repeated, in faces, on edges and inside."""
    given = hull_touch_exact(rng)
    for name in "PQ":
        points = [exact(p) for p in given[name]]
        extra = [contact.mixed(points, rng) for _ in range(4)] + [rng.choice(points) for _ in range(2)]
        given[name] += [numbers.doubles(p) for p in extra if numbers.is_exact(p)]
        rng.shuffle(given[name])
    return given


@hard("polytope_distance")
def many_faces(rng: Random) -> Input:
    """Points of two spheres: every vertex is a corner, faces are nearly parallel to their neighbours."""
    a, b = ([numbers.rotated(rng)[0] for _ in range(rng.randint(12, 20))] for _ in range(2))
    return close_clouds(a, b, sign(rng) * magnitude(rng, -12, 0), rng)


@hard("polytope_distance")
def needle_hulls(rng: Random) -> Input:
    """Slivers and needles: 1 to 1e-8."""
    sides = []
    for _ in range(2):
        stretch, frame = [10.0 ** rng.choice((-8, -4, 0, 3)) for _ in range(3)], numbers.rotated(rng)
        sides.append([[sum(p[k] * stretch[k] * frame[k][j] for k in range(3)) for j in range(3)] for p in cloud(rng)])
    return close_clouds(*sides, sign(rng) * magnitude(rng, -9, -1), rng)


@hard("polytope_distance")
def near_parallel_hulls(rng: Random) -> Input:
    """A hull and its own copy, mirrored in a face and turned by 1e-6 to 1e-15 rad."""
    a = cloud(rng, 4, 8)
    frame = numbers.tilted(numbers.world(), magnitude(rng, -15, -6), rng)
    b = [[-sum(p[k] * frame[k][j] for k in range(3)) for j in range(3)] for p in a]
    return placed(a, b, contact.facet_normal(a, rng), sign(rng) * magnitude(rng, -12, 0), rng)


@hard("polytope_distance")
def coincident_hulls(rng: Random) -> Input:
    """The same hull twice, one inside the other, or sharing a face."""
    a = few_bits(rng)
    if rng.random() < 0.3:
        return {"P": a, "Q": a[::-1]}
    half = [[x / rng.choice((1.0, 2.0)) for x in p] for p in a]
    return {"P": a, "Q": half}


@hard("polytope_distance")
def hulls_far_from_origin(rng: Random) -> Input:
    """Millimetre hulls 1e3 to 1e9 from the origin."""
    offset = tuple(Fraction(magnitude(rng, 3, 9) * sign(rng)) for _ in range(3))
    given = close_clouds(cloud(rng), cloud(rng), sign(rng) * magnitude(rng, -7, 0), rng)
    return {
        name: [numbers.doubles(add(scale(Fraction(1, 1000), exact(p)), offset)) for p in side]
        for name, side in given.items()
    }


@hard("polytope_distance")
def huge_hulls(rng: Random) -> Input:
    """A hard case times 2^300 to 2^980."""
    return scaled_hulls(rng, numbers.HUGE)


@hard("polytope_distance")
def tiny_hulls(rng: Random) -> Input:
    """A hard case times 2^-300 to 2^-1060."""
    return scaled_hulls(rng, numbers.TINY)


def scaled_hulls(rng: Random, exponents: tuple[int, int]) -> Input:
    given = rng.choice((hull_touch_exact, hull_touch_ulp, hull_touch_nearly, lattice_hulls, flat_bodies))(rng)
    factor = rng.randint(*exponents)
    return numbers.mapped(given, lambda x: math.ldexp(x, factor))  # type: ignore[no-any-return]
