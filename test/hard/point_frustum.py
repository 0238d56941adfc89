# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""Distance of a point to a view frustum."""

from __future__ import annotations

import math
from fractions import Fraction
from random import Random
from typing import Any

from oracle import polytope
from oracle.vectors import Vector, add, dot, exact, scale

from hard import contact, numbers
from hard.frustum_box import any_window, corners, exact_window, frustum
from hard.numbers import magnitude, sign
from hard.registry import hard

Input = dict[str, Any]


def feature_point(view: Any, rng: Random) -> tuple[Vector, list[Vector]]:
    """A point on a face, an edge or a corner of the frustum, and the outward normals of the faces that meet there."""
    points = corners(view)
    planes = list(polytope.hull(points).planes)
    size = rng.choice((1, 2, 3))
    while True:
        chosen = rng.sample(planes, size)
        shared = [p for p in points if all(dot(n, p) == d for n, d in chosen)]
        if shared:
            return contact.mixed(shared, rng), [n for n, _ in chosen]


def outward(normals: list[Vector], rng: Random) -> Vector:
    """Some direction in the cone of the normals, of length about 1."""
    units = [exact(contact.apart(n, 1.0)) for n in normals]
    while True:
        total = exact((0, 0, 0))
        for n in units:
            total = add(total, scale(Fraction(rng.choice((0.0, rng.uniform(0.01, 1.0), 1.0))), n))
        if any(total):
            return total


def beside(view: Any, distance: float, rng: Random) -> Input:
    """A point near a feature, in the region of that feature or on the border of the region."""
    on, normals = feature_point(view, rng)
    return {"frustum": view, "point": numbers.doubles(add(on, scale(Fraction(distance), outward(normals, rng))))}


@hard("point_frustum")
def region(rng: Random) -> Input:
    """In the region of every kind of feature, from next to it to far away, and inside."""
    window = any_window(rng)
    view = frustum(numbers.rotated(rng), origin=[rng.gauss(0, 3) for _ in range(3)], **window)
    distance = window["near"] * magnitude(rng, -12, 3) * rng.choice((1, 1, 1, -0.01))
    return beside(view, distance, rng)


@hard("point_frustum")
def region_border(rng: Random) -> Input:
    """Few bits: points on the borders between regions, exactly; either feature is nearest."""
    view = frustum(numbers.permuted(rng), **exact_window(rng))
    on, normals = feature_point(view, rng)
    chosen = rng.choice(normals)
    given = {"frustum": view, "point": numbers.doubles(add(on, scale(Fraction(rng.randint(1, 16), 8), chosen)))}
    if rng.random() < 0.5:
        given["point"] = numbers.nudged_somewhere(given["point"], rng)
    return given


@hard("point_frustum")
def boundary(rng: Random) -> Input:
    """On a face, an edge or a corner exactly, or an ulp off it."""
    while True:
        view = frustum(numbers.exact_frame(rng), origin=[numbers.eighths(rng, -16, 16)] * 3, **exact_window(rng))
        on, _ = feature_point(view, rng)
        if numbers.is_exact(on):
            break
    point = numbers.doubles(on)
    return {"frustum": view, "point": numbers.nudged_somewhere(point, rng) if rng.random() < 0.5 else point}


@hard("point_frustum")
def boundary_far(rng: Random) -> Input:
    """On the surface, permuted frames, 1e6 to 1e8 from the origin."""
    origin = [sign(rng) * rng.randint(10**6, 10**8) for _ in range(3)]
    view = frustum(numbers.permuted(rng), origin=origin, **exact_window(rng))
    point = numbers.doubles(feature_point(view, rng)[0])
    return {"frustum": view, "point": numbers.nudged_somewhere(point, rng) if rng.random() < 0.5 else point}


@hard("point_frustum")
def erratum(rng: Random) -> Input:
    """Between near and far beyond a side edge, where the printed threshold lacks far / near, and beyond its ends."""
    left, up, ratio = rng.uniform(0.3, 2.0), rng.uniform(0.3, 2.0), magnitude(rng, 0.1, 3)
    view = frustum(numbers.rotated(rng), left, up, 1.0, ratio)
    depth = ratio ** rng.uniform(0.0, 1.0)
    x, y = (sign(rng) * half * depth * magnitude(rng, 0, 1.5) for half in (left, up))
    rows = [view["L"], view["U"], view["D"]]
    return {
        "frustum": view,
        "point": [sum(c * row[k] for c, row in zip((x, y, depth), rows, strict=True)) for k in range(3)],
    }


@hard("point_frustum")
def extreme_parameters(rng: Random) -> Input:
    """Near, far and half widths from 1e-6 to 1e6, now and then from 1e-90 to 1e90."""
    size = rng.choice((6, 6, 90))
    near = magnitude(rng, -size, size)
    window = {
        "left": magnitude(rng, -size, size),
        "up": magnitude(rng, -size, size),
        "near": near,
        "far": near * magnitude(rng, 0.001, 12),
    }
    view = frustum(rng.choice((numbers.rotated, numbers.permuted))(rng), **window)
    return beside(view, rng.choice(list(window.values())) * magnitude(rng, -6, 1), rng)


@hard("point_frustum")
def thin(rng: Random) -> Input:
    """Far hardly beyond near: the frustum is a sheet."""
    near = magnitude(rng, -1, 1)
    view = frustum(numbers.rotated(rng), 1.0, rng.choice((1.0, 1e-9)), near, near * (1 + magnitude(rng, -15, -3)))
    return beside(view, magnitude(rng, -15, 1), rng)


@hard("point_frustum")
def far_from_origin(rng: Random) -> Input:
    """A frustum of a millimetre 1e3 to 1e9 from the origin."""
    origin = [magnitude(rng, 3, 9) * sign(rng) for _ in range(3)]
    view = frustum(numbers.rotated(rng), 1e-3, 5e-4, 1e-3, 4e-3, origin)
    return beside(view, magnitude(rng, -7, -1), rng)


@hard("point_frustum")
def skewed_axes(rng: Random) -> Input:
    """Axes off orthonormal by up to 2e-3."""
    window = any_window(rng)
    view = frustum(numbers.skewed(numbers.rotated(rng), magnitude(rng, -16, -2.7), rng), **window)
    return beside(view, window["near"] * magnitude(rng, -9, 1), rng)


@hard("point_frustum")
def huge_scale(rng: Random) -> Input:
    """A hard case times 2^300 to 2^980."""
    return scaled(rng, numbers.HUGE)


@hard("point_frustum")
def tiny_scale(rng: Random) -> Input:
    """A hard case times 2^-300 to 2^-1060."""
    return scaled(rng, numbers.TINY)


def scaled(rng: Random, exponents: tuple[int, int]) -> Input:
    given = rng.choice((region, boundary, region_border, erratum))(rng)
    factor = rng.randint(*exponents)
    view = given["frustum"]
    for name in "Enflu":
        view[name] = numbers.mapped(view[name], lambda x: math.ldexp(x, factor))
    for name in "nlu":
        view[name] = max(view[name], 5e-324)
    view["f"] = max(view["f"], math.nextafter(view["n"], math.inf))
    given["point"] = numbers.mapped(given["point"], lambda x: math.ldexp(x, factor))
    return given
