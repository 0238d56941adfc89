# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""Culling: a view frustum and an oriented box."""

from __future__ import annotations

import math
from fractions import Fraction
from random import Random
from typing import Any

from oracle import polytope
from oracle.vectors import Vector, add, cross, dot, exact, scale, sub

from hard import contact, numbers
from hard.numbers import eighths, magnitude, sign
from hard.registry import hard

Input = dict[str, Any]

# ------------------------------------------------------------------------------------------------ building blocks


def frustum(frame: numbers.Frame, left: float, up: float, near: float, far: float, origin: Any = (0, 0, 0)) -> Any:
    """A symmetric frustum in the layout of the corpus."""
    return {
        "E": [float(x) for x in origin],
        **{name: list(row) for name, row in zip("LUD", frame, strict=True)},
        "n": near,
        "f": far,
        "l": left,
        "u": up,
    }


def box(center: Any, axes: numbers.Frame, half: Any) -> Any:
    return {"C": [float(x) for x in center], "A": [list(row) for row in axes], "e": [float(x) for x in half]}


def literal_frustum(given: Any) -> tuple[Any, ...]:
    """Arguments of the oracle's frusta; `bounds` l0 l1 u0 u1 stands for l and u where the window is off centre."""
    bounds = given.get("bounds") or (-given["l"], given["l"], -given["u"], given["u"])
    return given["E"], (given["L"], given["U"], given["D"]), bounds, given["n"], given["f"]


def corners(body: Any) -> list[Vector]:
    """Exact corners of a frustum or a box."""
    if "A" in body:
        return polytope.box_corners(body["C"], body["A"], body["e"])
    return polytope.frustum_corners(*literal_frustum(body))


def moved(body: Any, shift: Any) -> Any:
    """A box, moved; the sum is exact and then rounded."""
    return body | {"C": numbers.doubles(add(exact(body["C"]), exact(shift)))}


def exact_window(rng: Random) -> dict[str, float]:
    """Half widths, near and far of few bits; far / near is whole."""
    return {"left": eighths(rng, 2, 16), "up": eighths(rng, 2, 16), "near": 1.0, "far": float(rng.randint(2, 6))}


def any_window(rng: Random) -> dict[str, float]:
    near = magnitude(rng, -1, 1)
    return {
        "left": near * magnitude(rng, -1, 0.5),
        "up": near * magnitude(rng, -1, 0.5),
        "near": near,
        "far": near * magnitude(rng, 0.2, 2),
    }


def touching(rng: Random, frames: Any = numbers.exact_frame) -> Input:
    """Frustum and box that touch to the last bit, across faces, edges and corners."""
    while True:
        frame = frames(rng)
        axes = frame if rng.random() < 0.4 else frames(rng)
        origin = [eighths(rng, -16, 16) for _ in range(3)]
        view = frustum(frame, origin=origin, **exact_window(rng))
        body = box((0, 0, 0), axes, [eighths(rng, 1, 12) for _ in range(3)])
        a, b = corners(view), corners(body)
        normal = contact.some_normal(a, b, rng)
        shift = contact.into_contact(a, b, normal, rng)
        if numbers.is_exact(shift):
            return {"frustum": view, "box": moved(body, shift)}


def across(view: Any, body: Any, normal: Vector, gap: float, rng: Random) -> Input:
    """The pair brought together along a normal, and parted by `gap` (< 0: into each other), rounded."""
    shift = contact.into_contact(corners(view), corners(body), normal, rng)
    return {"frustum": view, "box": moved(body, add(shift, exact(contact.apart(normal, gap))))}


def near_frustum_edge(rng: Random, angle: float, ratio: float, depth: float, gap: float) -> Input:
    """A box edge that crosses a side edge of the frustum at a small angle, `gap` outside of it.

    Only the cross product of the two edges separates them.
    """
    frame, near = numbers.rotated(rng), magnitude(rng, -2, 2)
    left, up = rng.uniform(0.3, 2.0), rng.uniform(0.3, 2.0)
    x, y = sign(rng) * left, sign(rng) * up
    along = _unit([x, y, 1.0])
    face_x, face_y = _unit([math.copysign(1, x), 0.0, -left]), _unit([0.0, math.copysign(1, y), -up])
    outward = [a + b for a, b in zip(face_x, face_y, strict=True)]
    lean = sum(a * b for a, b in zip(outward, along, strict=True))
    outward = _unit([o - lean * a for o, a in zip(outward, along, strict=True)])
    sideways = cross(tuple(outward), tuple(along))
    edge = [math.cos(angle) * a + math.sin(angle) * s for a, s in zip(along, sideways, strict=True)]
    side = cross(tuple(edge), tuple(outward))
    root = math.sqrt(0.5)
    axes = [edge, [root * (o + s) for o, s in zip(outward, side, strict=True)]]
    axes.append([root * (o - s) for o, s in zip(outward, side, strict=True)])
    half = [depth * rng.uniform(0.05, 0.2), depth * rng.uniform(0.02, 0.2), depth * rng.uniform(0.02, 0.2)]
    half[0] = min(half[0], 0.9 * (depth - 1.0)) if depth < 2 else half[0]
    middle = [depth * d for d in (x, y, 1.0)]
    for k in range(3):
        middle[k] += gap * depth * outward[k] + half[1] * axes[1][k] + half[2] * axes[2][k]
    origin = [near * rng.gauss(0, 1) for _ in range(3)]
    to_world = _product(axes, frame)
    center = [o + near * c for o, c in zip(origin, _product([middle], frame)[0], strict=True)]
    view = frustum(frame, left * near, up * near, near, near * ratio, origin)
    order = rng.sample(range(3), 3)
    return {"frustum": view, "box": box(center, [to_world[k] for k in order], [near * half[k] for k in order])}


def _unit(v: list[float]) -> list[float]:
    return [x / math.hypot(*v) for x in v]


def _product(rows: Any, frame: numbers.Frame) -> numbers.Frame:
    return [[sum(row[k] * frame[k][j] for k in range(3)) for j in range(3)] for row in rows]


def separating_axes(given: Input) -> int:
    """How many of the 26 directions of the separating axis test part the two, exactly."""
    view, body = given["frustum"], given["box"]
    _, (left, up, depth), (l0, l1, u0, u1), near, _ = exact(literal_frustum(view))
    sides = [add(add(scale(x, left), scale(y, up)), scale(near, depth)) for x in (l0, l1) for y in (u0, u1)]
    planes = [cross(left, up), *(cross(up, sides[k]) for k in (0, 2)), *(cross(left, sides[k]) for k in (0, 1))]
    axes = exact(body["A"])
    a, b = corners(view), corners(body)
    count = 0
    for n in [*planes, *axes, *(cross(e, axis) for e in (left, up, *sides) for axis in axes)]:
        on_a, on_b = [dot(n, p) for p in a], [dot(n, p) for p in b]
        count += min(on_a) > max(on_b) or max(on_a) < min(on_b)
    return count


# ------------------------------------------------------------------------------------------------------ touching


@hard("frustum_box")
def touch_exact(rng: Random) -> Input:
    """Touching is contact."""
    return touching(rng)


@hard("frustum_box")
def touch_permuted_frame(rng: Random) -> Input:
    """Touching, axes of the world permuted and reversed, with zeros of either sign."""
    return touching(rng, numbers.permuted)


@hard("frustum_box")
def touch_ulp(rng: Random) -> Input:
    """One or two ulps from touching: the box, the eye, an extent or the window moves."""
    given = touching(rng)
    part, name = rng.choice((("box", "C"), ("box", "C"), ("box", "e"), ("frustum", "E"), ("frustum", "window")))
    body = given[part]
    if name == "window":
        name = rng.choice("nflu")
        body[name] = numbers.nudged(body[name], sign(rng))
    else:
        body[name] = numbers.nudged_somewhere(body[name], rng)
    return given


@hard("frustum_box")
def touch_far_from_origin(rng: Random) -> Input:
    """Touching, features of a millimetre at 1e8 from the origin, all coordinates exact."""
    while True:
        given = numbers.mapped(touching(rng, numbers.permuted), lambda x: x)
        for body, lengths in ((given["frustum"], "nflu"), (given["box"], ("e",))):
            for name in lengths:
                body[name] = numbers.mapped(body[name], lambda x: x / 1024)
        offset = tuple(sign(rng) * rng.randint(2**27, 2**30) for _ in range(3))
        places = [add(scale(Fraction(1, 1024), exact(p)), offset) for p in (given["frustum"]["E"], given["box"]["C"])]
        if all(map(numbers.is_exact, places)):
            given["frustum"]["E"], given["box"]["C"] = map(numbers.doubles, places)
            return given


@hard("frustum_box")
def huge_scale(rng: Random) -> Input:
    """A hard case times 2^300 to 2^980: products of lengths overflow."""
    return scaled(rng, numbers.HUGE)


@hard("frustum_box")
def tiny_scale(rng: Random) -> Input:
    """A hard case times 2^-300 to 2^-1060: products of lengths vanish, lengths are subnormal."""
    return scaled(rng, numbers.TINY)


def scaled(rng: Random, exponents: tuple[int, int]) -> Input:
    given = rng.choice((touching, touch_ulp, single_axis, corner_cut, near_parallel_ridge))(rng)
    factor = rng.randint(*exponents)
    for body, lengths in ((given["frustum"], "Enflu"), (given["box"], "Ce")):
        for name in lengths:
            body[name] = numbers.mapped(body[name], lambda x: math.ldexp(x, factor))
    view = given["frustum"]
    # Rounding to subnormals must leave a frustum.
    for name in "nlu":
        view[name] = max(view[name], 5e-324)
    view["f"] = max(view["f"], math.nextafter(view["n"], math.inf))
    return given


# ------------------------------------------------------------------------------------------- few directions separate


@hard("frustum_box")
def single_axis(rng: Random) -> Input:
    """Apart, and only one of the 26 directions shows it."""
    for _ in range(50):
        given = close_pair(rng, magnitude(rng, -5, -2))
        if separating_axes(given) == 1:
            break
    return given


@hard("frustum_box")
def single_axis_overlap(rng: Random) -> Input:
    """Overlapping by little across features of any kind."""
    return close_pair(rng, -magnitude(rng, -8, -2))


def close_pair(rng: Random, gap: float) -> Input:
    """Rotated, sizes alike, parted by `gap` of the near depth across some features."""
    window = any_window(rng)
    view = frustum(numbers.rotated(rng), origin=[rng.gauss(0, 3) for _ in range(3)], **window)
    half = [window["near"] * magnitude(rng, -1, 0.7) for _ in range(3)]
    body = box((0, 0, 0), numbers.rotated(rng), half)
    return across(view, body, contact.some_normal(corners(view), corners(body), rng), gap * window["near"], rng)


@hard("frustum_box")
def corner_cut(rng: Random) -> Input:
    """Beyond an edge or a corner of the frustum: none of its six planes tells, as tests by planes alone find out."""
    window = any_window(rng)
    view = frustum(numbers.rotated(rng), origin=[rng.gauss(0, 3) for _ in range(3)], **window)
    planes = [n for n, _ in polytope.hull(corners(view)).planes]
    chosen = rng.sample(planes, rng.choice((2, 3)))
    normal = exact((0, 0, 0))
    for n in chosen:
        normal = add(normal, scale(Fraction(rng.uniform(0.3, 1.0)), exact(contact.apart(n, 1.0))))
    half = [window["near"] * magnitude(rng, 0, 1.5) for _ in range(3)]
    gap = magnitude(rng, -9, -1) * window["near"] * sign(rng)
    return across(view, box((0, 0, 0), numbers.rotated(rng), half), normal, gap, rng)


@hard("frustum_box")
def near_parallel_ridge(rng: Random) -> Input:
    """A box edge crosses a side edge of the frustum at 1e-6 to 1e-10 rad."""
    angle = magnitude(rng, -10, -6)
    return near_frustum_edge(
        rng, angle, magnitude(rng, 0.4, 1), rng.uniform(1.2, 2.0), sign(rng) * angle * rng.uniform(0.01, 0.04)
    )


@hard("frustum_box")
def ratio_lu_edge_gap(rng: Random) -> Input:
    """The same at any angle near the near end, far / near up to 1e12, the gap down to 1e-5 near."""
    angle = rng.uniform(0.05, 1.0) if rng.random() < 0.5 else magnitude(rng, -8, -2)
    gap = magnitude(rng, -5, -2) if angle > 0.05 else angle * rng.uniform(0.01, 0.04)
    return near_frustum_edge(rng, angle, magnitude(rng, 9, 13), rng.uniform(1.2, 5.0), sign(rng) * gap)


@hard("frustum_box")
def near_parallel_frames(rng: Random) -> Input:
    """The box frame is the frustum frame to within 1e-6 to 1e-15 rad: nine cross products are noise."""
    return aligned(rng, magnitude(rng, -15, -6))


@hard("frustum_box")
def parallel_frames(rng: Random) -> Input:
    """The same rounded frame twice: cross products vanish, or nearly."""
    return aligned(rng, 0.0)


def aligned(rng: Random, angle: float) -> Input:
    window, frame = any_window(rng), numbers.rotated(rng)
    view = frustum(frame, origin=[rng.gauss(0, 3) for _ in range(3)], **window)
    axes = rng.sample(numbers.tilted(frame, angle, rng) if angle else frame, 3)
    body = box((0, 0, 0), axes, [window["near"] * magnitude(rng, -1, 0.5) for _ in range(3)])
    gap = sign(rng) * magnitude(rng, -12, -2) * window["near"]
    return across(view, body, contact.some_normal(corners(view), corners(body), rng), gap, rng)


# ------------------------------------------------------------------------------------------------ odd proportions


@hard("frustum_box")
def needle_slab_box(rng: Random) -> Input:
    """Extents 1e-6 and 1e6 of the frustum's."""
    window = any_window(rng)
    view = frustum(numbers.rotated(rng), origin=[rng.gauss(0, 3) for _ in range(3)], **window)
    half = [window["near"] * 10.0 ** rng.choice((-6, -6, 0, 6)) for _ in range(3)]
    body = box((0, 0, 0), rng.choice((numbers.rotated, numbers.permuted))(rng), half)
    gap = sign(rng) * magnitude(rng, -7, -2) * window["near"]
    return across(view, body, contact.some_normal(corners(view), corners(body), rng), gap, rng)


@hard("frustum_box")
def tiny_l_u(rng: Random) -> Input:
    """Half widths of 1e-12: the frustum is a needle or a sheet."""
    view = frustum(numbers.rotated(rng), magnitude(rng, -13, -11), rng.choice((1e-12, 1.0)), 1.0, 4.0)
    body = box((0, 0, 0), numbers.rotated(rng), [magnitude(rng, -2, 0) for _ in range(3)])
    gap = sign(rng) * magnitude(rng, -11, -2)
    return across(view, body, contact.some_normal(corners(view), corners(body), rng), gap, rng)


@hard("frustum_box")
def extreme_f_over_n(rng: Random) -> Input:
    """far / near from 1e6 to 1e14, the box near the eye or at the far end."""
    window = any_window(rng)
    window["far"] = window["near"] * magnitude(rng, 6, 14)
    view = frustum(numbers.rotated(rng), **window)
    a = corners(view)
    size = rng.choice((window["near"], window["far"]))
    body = box((0, 0, 0), numbers.rotated(rng), [size * magnitude(rng, -1, 0) for _ in range(3)])
    normal = contact.some_normal(a, corners(body), rng)
    if size == window["near"]:
        # Beside the near half: the side walls of a frustum that ends early are the same.
        short = view | {"f": 4 * window["near"]}
        given = across(short, body, contact.some_normal(corners(short), corners(body), rng), 0.0, rng)
        shift = contact.apart(normal, sign(rng) * size * magnitude(rng, -5, -1))
        return {"frustum": view, "box": moved(given["box"], shift)}
    return across(view, body, normal, sign(rng) * size * magnitude(rng, -8, -1), rng)


@hard("frustum_box")
def containment_and_zero_extent(rng: Random) -> Input:
    """One inside the other, touching from within, or a box that is a point, a segment or a sheet."""
    given = touching(rng)
    view, body = given["frustum"], given["box"]
    choice = rng.randrange(4)
    if choice == 0:  # holds the frustum
        body["e"] = [64.0] * 3
    elif choice == 1:  # flat, on the surface or within
        flat = rng.sample(range(3), rng.choice((1, 2, 3)))
        body["e"] = [0.0 if k in flat else x for k, x in enumerate(body["e"])]
        inside = contact.mixed(corners(view), rng)
        if numbers.is_exact(inside) and rng.random() < 0.7:
            body["C"] = numbers.doubles(inside)
    elif choice == 2:  # from within: mirrored at the point of contact, small
        body["e"] = [x / 64 for x in body["e"]]
        a = corners(view)
        n, d = rng.choice(polytope.hull(a).planes)
        on_face = contact.mixed([p for p in a if dot(n, p) == d], rng)
        inner = scale(Fraction(1, 8), sub(contact.mixed(a, rng), on_face))
        reach = max(dot(n, p) for p in corners(body)) - dot(n, exact(body["C"]))
        drop = -dot(n, inner)
        place = add(on_face, scale(reach / drop, inner)) if drop > 0 else on_face
        body["C"] = numbers.doubles(place)
    else:  # a box around the eye, which is outside
        body["C"] = list(view["E"])
        body["e"] = [rng.choice((0.125, 0.5, 1.0, 2.0))] * 3
    return given


@hard("frustum_box")
def far_from_origin(rng: Random) -> Input:
    """Features of a millimetre 1e3 to 1e9 from the origin: coordinates are coarse."""
    view = frustum(numbers.rotated(rng), 1e-3, 5e-4, 1e-3, 4e-3, [magnitude(rng, 3, 9) * sign(rng) for _ in range(3)])
    body = box((0, 0, 0), numbers.rotated(rng), [magnitude(rng, -4, -2.5) for _ in range(3)])
    gap = sign(rng) * magnitude(rng, -8, -3)
    return across(view, body, contact.some_normal(corners(view), corners(body), rng), gap, rng)


@hard("frustum_box")
def skewed_axes(rng: Random) -> Input:
    """Axes that are off orthonormal by 1e-3, as numbers that drifted are: they are taken literally."""
    window, defect = any_window(rng), magnitude(rng, -16, -2.6)
    view = frustum(numbers.skewed(numbers.rotated(rng), defect, rng), **window)
    half = [window["near"] * magnitude(rng, -1, 0.5) for _ in range(3)]
    body = box((0, 0, 0), numbers.skewed(numbers.rotated(rng), defect, rng), half)
    gap = sign(rng) * magnitude(rng, -10, -2) * window["near"]
    return across(view, body, contact.some_normal(corners(view), corners(body), rng), gap, rng)


@hard("frustum_box")
def off_centre_window(rng: Random) -> Input:
    """Windows around the axis, beside it, and on it to the last bit."""
    given = touching(rng, numbers.permuted)
    view, body = given["frustum"], given["box"]
    bounds = []
    for _ in range(2):
        low = eighths(rng, -12, 12)
        bounds += [low, low + eighths(rng, 1, 16)]
    view["bounds"] = bounds
    gap = rng.choice((0.0, 0.0, sign(rng) * magnitude(rng, -12, -1)))
    return across(view, body, contact.some_normal(corners(view), corners(body), rng), gap, rng)
