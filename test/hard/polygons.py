# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""Polygons in the plane: distance and depth, and first contact under translation."""

from __future__ import annotations

import math
from fractions import Fraction
from random import Random
from typing import Any

from oracle import polygon
from oracle.vectors import Vector, add, exact, scale

from hard import contact, numbers
from hard.numbers import eighths, magnitude, sign
from hard.registry import hard

Input = dict[str, Any]
Ring = list[list[float]]

# ------------------------------------------------------------------------------------------------ building blocks


def ring(points: Any) -> Ring:
    """Doubles near the points, as a valid ring: their hull, counter-clockwise."""
    rounded = [tuple(Fraction(float(x)) for x in p) for p in points]
    return [numbers.doubles(p) for p in polygon.hull(rounded)]


def few_bits(rng: Random, corners: int = 7) -> Ring:
    """The hull of some points of a lattice of eighths."""
    return ring([(eighths(rng, -12, 12), eighths(rng, -12, 12)) for _ in range(rng.randint(3, corners))])


def round_ring(rng: Random, corners: int = 8, size: float = 1.0) -> Ring:
    """Random points of an ellipse."""
    a, b = size * rng.uniform(0.3, 1.0), size * rng.uniform(0.3, 1.0)
    angles = [rng.uniform(0, 2 * math.pi) for _ in range(rng.randint(3, corners))]
    turn = rng.uniform(0, math.pi)
    return turned([(a * math.cos(t), b * math.sin(t)) for t in angles], turn)


def turned(points: Any, angle: float) -> Ring:
    c, s = math.cos(angle), math.sin(angle)
    return ring([(c * x - s * y, s * x + c * y) for x, y in points])


def placed(p: Ring, q: Ring, normal: Vector, gap: float, rng: Random) -> Input:
    """Rings brought together along a normal and parted by `gap` (< 0: into each other), rounded."""
    shift = add(contact.into_contact(p, q, normal, rng), exact(contact.apart(normal, gap)))
    return {"P": p, "Q": ring([add(exact(x), shift) for x in q])}


def close(p: Ring, q: Ring, gap: float, rng: Random) -> Input:
    return placed(p, q, contact.some_normal_2d(p, q, rng), gap, rng)


def touching(rng: Random) -> Input:
    """Rings of few bits that touch to the last bit, across edges and corners, slanted or not."""
    while True:
        p, q = few_bits(rng), few_bits(rng)
        shift = contact.into_contact(p, q, contact.some_normal_2d(p, q, rng), rng)
        if numbers.is_exact(shift):
            return {"P": p, "Q": ring([add(exact(x), shift) for x in q])}


def repeated(points: Ring, rng: Random) -> Ring:
    """The ring with vertices repeated and with vertices amid its edges."""
    found: Ring = []
    for k, p in enumerate(points):
        found += [p] * rng.choice((1, 1, 2, 3))
        middle = scale(Fraction(1, 2), add(exact(p), exact(points[(k + 1) % len(points)])))
        if len(points) > 1 and rng.random() < 0.5 and numbers.is_exact(middle):
            found.append(numbers.doubles(middle))
    return found


def needle(rng: Random) -> Ring:
    """A triangle or a bar 1e6 to 1e12 times as long as wide."""
    width = magnitude(rng, -9, -6)
    bar = [(-1.0, 0.0), (1.0, -width), (1.0, width)] if rng.random() < 0.5 else BAR
    length = magnitude(rng, 0, 3)
    return turned([(x * length, y * (width if bar is BAR else 1.0)) for x, y in bar], rng.uniform(0, 2 * math.pi))


BAR = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]


def many_cornered(rng: Random) -> Ring:
    """A regular polygon of 16 to 64 corners, turned."""
    count = rng.choice((16, 32, 64))
    return turned(
        [(math.cos(2 * math.pi * k / count), math.sin(2 * math.pi * k / count)) for k in range(count)],
        rng.uniform(0, 1),
    )


def degenerate_ring(rng: Random) -> Ring:
    """A point or a segment, its vertices repeated now and then."""
    points = few_bits(rng)[: rng.choice((1, 2))]
    return points * rng.choice((1, 1, 2)) if len(points) == 1 else points


def scaled(given: Input, rng: Random, exponents: tuple[int, int]) -> Input:
    """Lengths and velocities times a power of two; times stay."""
    factor = rng.randint(*exponents)
    grown = {k: numbers.mapped(v, lambda x: math.ldexp(x, factor)) for k, v in given.items() if k != "tmax"}
    return given | grown | {k: ring(grown[k]) for k in "PQ"}


# ------------------------------------------------------------------------------------------------------- at rest


@hard("polygon2d_distance")
def touch_exact(rng: Random) -> Input:
    """Touching."""
    return touching(rng)


@hard("polygon2d_distance")
def touch_slanted(rng: Random) -> Input:
    """A corner exactly on a slanted edge, or a slanted edge on another."""
    while True:
        p, q = few_bits(rng), few_bits(rng)
        normal = contact.edge_normal(p, rng)
        if normal[0] and normal[1]:
            shift = contact.into_contact(p, q, normal, rng)
            if numbers.is_exact(shift):
                return {"P": p, "Q": ring([add(exact(x), shift) for x in q])}


@hard("polygon2d_distance")
def touch_ulp(rng: Random) -> Input:
    """One coordinate is an ulp or two off touching."""
    given = touching(rng)
    name = rng.choice("PQ")
    k = rng.randrange(len(given[name]))
    given[name][k] = numbers.nudged_somewhere(given[name][k], rng)
    return given | {name: ring(given[name])}


@hard("polygon2d_distance")
def touch_nearly(rng: Random) -> Input:
    """Gaps and depths of 1e-7 to 1e-17."""
    return close(round_ring(rng), round_ring(rng), sign(rng) * magnitude(rng, -17, -7), rng)


@hard("polygon2d_distance")
def near_parallel(rng: Random) -> Input:
    """Facing edges parallel to 1e-6 to 1e-15 rad."""
    p = round_ring(rng)
    q = turned([(-x, -y) for x, y in p], magnitude(rng, -15, -6))
    return placed(p, q, contact.edge_normal(p, rng), sign(rng) * magnitude(rng, -12, 0), rng)


@hard("polygon2d_distance")
def needle_polygons(rng: Random) -> Input:
    """Needles against needles and against round polygons."""
    return close(needle(rng), rng.choice((needle, round_ring))(rng), sign(rng) * magnitude(rng, -9, -1), rng)


@hard("polygon2d_distance")
def many_gon(rng: Random) -> Input:
    """Regular polygons of up to 64 corners, nearly tangent."""
    return close(many_cornered(rng), many_cornered(rng), sign(rng) * magnitude(rng, -12, -1), rng)


@hard("polygon2d_distance")
def repeated_collinear(rng: Random) -> Input:
    """Touching or apart, vertices repeated and collinear."""
    given = touching(rng) if rng.random() < 0.6 else close(few_bits(rng), few_bits(rng), 0.5, rng)
    return {name: repeated(side, rng) for name, side in given.items()}


@hard("polygon2d_distance")
def degenerate(rng: Random) -> Input:
    """Points and segments against each other and against polygons; on corners, on edges, within."""
    p, q = degenerate_ring(rng), rng.choice((degenerate_ring, few_bits))(rng)
    if rng.random() < 0.6:
        given = placed(p, q, contact.some_normal_2d(p, q, rng), 0.0, rng)
        p, q = given["P"], given["Q"]
    return {"P": q, "Q": p} if rng.random() < 0.5 else {"P": p, "Q": q}


@hard("polygon2d_distance")
def far_from_origin(rng: Random) -> Input:
    """Millimetre polygons 1e3 to 1e9 from the origin."""
    given = close(round_ring(rng), round_ring(rng), sign(rng) * magnitude(rng, -7, 0), rng)
    return {name: far_ring(side, given, rng) for name, side in given.items()}


def far_ring(side: Ring, given: Input, rng: Random) -> Ring:
    """The ring a thousand times smaller, at a place that depends on the pair only."""
    place = Random(str(given["P"][0]))
    offset = tuple(Fraction(sign(place) * magnitude(place, 3, 9)) for _ in range(2))
    return ring([add(scale(Fraction(1, 1000), exact(p)), offset) for p in side])


@hard("polygon2d_distance")
def huge_scale(rng: Random) -> Input:
    """A hard case times 2^300 to 2^980."""
    return scaled(rng.choice((touching, touch_ulp, touch_nearly, near_parallel))(rng), rng, numbers.HUGE)


@hard("polygon2d_distance")
def tiny_scale(rng: Random) -> Input:
    """A hard case times 2^-300 to 2^-1060."""
    return scaled(rng.choice((touching, touch_ulp, touch_nearly, near_parallel))(rng), rng, numbers.TINY)


# -------------------------------------------------------------------------------------------------------- moving


def moving(given: Input, velocity: Any, rng: Random, t_max: float = 64.0) -> Input:
    """`velocity` of Q as seen from P, with a common velocity that changes nothing added now and then."""
    common = (0.0, 0.0) if rng.random() < 0.5 else (eighths(rng, -8, 8), eighths(rng, -8, 8))
    return {
        "P": given["P"],
        "velP": [float(x) for x in common],
        "Q": given["Q"],
        "velQ": numbers.doubles(add(exact(velocity), exact(common))),
        "tmax": float(t_max),
    }


def backed_off(rng: Random, time: float, velocity: Any, given: Input | None = None) -> Input:
    """A pair that touches after `time`, exactly if the numbers allow: Q starts at the contact minus the motion."""
    while True:
        pair = given or touching(rng)
        q = [add(exact(x), scale(-Fraction(time), exact(velocity))) for x in pair["Q"]]
        if given is not None or all(map(numbers.is_exact, q)):
            return {"P": pair["P"], "Q": ring(q)}


def slow(rng: Random) -> tuple[float, float]:
    """Few bits, not zero."""
    while True:
        v = (eighths(rng, -16, 16), eighths(rng, -16, 16))
        if any(v):
            return v


@hard("polygon2d_moving")
def feature_contact(rng: Random) -> Input:
    """Contact at a time of few bits across edges and corners; or a graze, or a miss."""
    velocity = slow(rng)
    return moving(backed_off(rng, rng.choice((0.5, 1.0, 2.0)), velocity), velocity, rng)


@hard("polygon2d_moving")
def general_position(rng: Random) -> Input:
    """Random rings on their way to each other."""
    pair = close(round_ring(rng), round_ring(rng), magnitude(rng, -6, 0.5), rng)
    return moving(pair, [rng.gauss(0, 1) for _ in range(2)], rng, magnitude(rng, 0, 2))


@hard("polygon2d_moving")
def book_fig_7_17(rng: Random) -> Input:
    """Unit squares of which the second comes down the diagonal: edge on edge, corner on corner, or a miss."""
    square = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)]
    delta = rng.choice((0.0, 0.25, 0.5, 1.0, 1.5, 2.0)) * rng.choice((1.0, 1.0, 1 + 2.0**-52, 1 - 2.0**-53))
    return moving({"P": ring(square), "Q": ring([(x, y + 1.0 + delta) for x, y in square])}, (1, -1), rng)


@hard("polygon2d_moving")
def contact_at_tmax(rng: Random) -> Input:
    """The time window ends at the contact, or an ulp before or after."""
    velocity, time = slow(rng), rng.choice((0.5, 1.0, 2.0))
    given = moving(backed_off(rng, time, velocity), velocity, rng)
    return given | {"tmax": numbers.nudged(time, rng.choice((-1, 0, 0, 1)))}


@hard("polygon2d_moving")
def touching_initially(rng: Random) -> Input:
    """In touch at the start, receding, sliding or closing."""
    return moving(touching(rng), slow(rng), rng)


@hard("polygon2d_moving")
def one_ulp_apart_initially(rng: Random) -> Input:
    """An ulp or two from touching at the start, in any motion."""
    return moving(touch_ulp(rng), slow(rng), rng)


@hard("polygon2d_moving")
def overlapping_initially(rng: Random) -> Input:
    """Overlapping at the start; the contact set is the intersection."""
    pair = close(few_bits(rng), few_bits(rng), -rng.choice((0.125, 0.25, 0.5, 1e-9)), rng)
    return moving(pair, slow(rng), rng)


@hard("polygon2d_moving")
def zero_relative_velocity(rng: Random) -> Input:
    """Equal velocities: whatever holds at the start holds for ever."""
    pair = rng.choice((touching, touch_ulp, touch_nearly))(rng)
    return moving(pair, (0.0, 0.0), rng)


@hard("polygon2d_moving")
def grazing_parallel_edge(rng: Random) -> Input:
    """Slides exactly along the line of an edge, touching it with no closing speed, or an ulp beside it."""
    pair = touching(rng)
    edges = list(polygon.edges([exact(p) for p in pair["P"]]))
    velocity = rng.choice(edges)[1]
    given = moving(backed_off(rng, 2.0, velocity, pair), velocity, rng)
    if rng.random() < 0.3:
        given["Q"] = ring(numbers.mapped(given["Q"], lambda x: x * (1 + 2.0**-50)))
    return given


@hard("polygon2d_moving")
def grazing_vertex(rng: Random) -> Input:
    """A corner passes exactly through a corner."""
    while True:
        p, q = few_bits(rng), few_bits(rng)
        normal = contact.any_normal(rng, 2)
        shift = contact.into_contact(p, q, normal, rng)
        pair = {"P": p, "Q": [add(exact(x), shift) for x in q]}
        velocity = scale(Fraction(sign(rng), 8), (-normal[1], normal[0]))
        start = backed_off(rng, rng.choice((1.0, 2.0)), velocity, pair)
        return moving(start, velocity, rng)


@hard("polygon2d_moving")
def grazing_angle(rng: Random) -> Input:
    """The velocity makes 1e-3 to 1e-12 rad with the edge that it reaches: the time has condition 1 / angle."""
    p, q = round_ring(rng), round_ring(rng)
    normal = contact.edge_normal(p, rng)
    x, y = contact.apart(normal, 1.0)
    angle = magnitude(rng, -12, -3)
    pair = placed(p, q, normal, angle * rng.uniform(0.05, 1.0), rng)
    return moving(pair, (-x * angle - y, -y * angle + x), rng)


@hard("polygon2d_moving")
def huge_or_tiny_velocity(rng: Random) -> Input:
    """Speeds of 1e-15 to 1e15: through in an instant, or crawling."""
    pair = close(round_ring(rng), round_ring(rng), magnitude(rng, -3, 1), rng)
    speed = 10.0 ** rng.choice((-15, -9, 9, 15))
    return moving(pair, [speed * rng.gauss(0, 1) for _ in range(2)], rng, rng.choice((1.0, 4.0 / speed)))


@hard("polygon2d_moving")
def near_parallel_closing(rng: Random) -> Input:
    """Facing edges parallel to 1e-6 to 1e-15 rad, closing."""
    p = round_ring(rng)
    q = turned([(-x, -y) for x, y in p], magnitude(rng, -15, -6))
    normal = contact.edge_normal(p, rng)
    x, y = contact.apart(normal, 1.0)
    return moving(placed(p, q, normal, magnitude(rng, -3, 1), rng), (-x - 0.3 * y, -y + 0.3 * x), rng)


@hard("polygon2d_moving")
def moving_needles(rng: Random) -> Input:
    """Needles crossing."""
    pair = close(needle(rng), rng.choice((needle, round_ring))(rng), magnitude(rng, -6, 0), rng)
    return moving(pair, [rng.gauss(0, 1) for _ in range(2)], rng)


@hard("polygon2d_moving")
def moving_many_gon(rng: Random) -> Input:
    """Regular polygons of up to 64 corners that pass each other, nearly tangent, or meet."""
    p, q = many_cornered(rng), many_cornered(rng)
    normal = contact.edge_normal(p, rng)
    x, y = contact.apart(normal, 1.0)
    pair = placed(p, q, normal, magnitude(rng, -12, 0), rng)
    back = [(a - 3 * y, b + 3 * x) for a, b in pair["Q"]]
    return moving({"P": pair["P"], "Q": ring(back)}, (y - x * magnitude(rng, -9, 0), -x), rng)


@hard("polygon2d_moving")
def repeated_collinear_moving(rng: Random) -> Input:
    """Vertices repeated and collinear."""
    given = feature_contact(rng)
    return given | {name: repeated(given[name], rng) for name in "PQ"}


@hard("polygon2d_moving")
def degenerate_moving(rng: Random) -> Input:
    """Points and segments, moving along themselves or into others."""
    pair = degenerate(rng)
    velocity = rng.choice((slow(rng), (1.0, 0.0), (0.0, 1.0), (0.0, 0.0)))
    return moving(backed_off(rng, rng.choice((0.0, 1.0)), velocity, pair), velocity, rng)


@hard("polygon2d_moving")
def far_from_origin_moving(rng: Random) -> Input:
    """Millimetre polygons 1e3 to 1e9 from the origin."""
    pair = close(round_ring(rng), round_ring(rng), magnitude(rng, -3, 0.5), rng)
    far = {name: far_ring(side, pair, rng) for name, side in pair.items()}
    return moving(far, [1e-3 * rng.gauss(0, 1) for _ in range(2)], rng)


@hard("polygon2d_moving")
def huge_scale_moving(rng: Random) -> Input:
    """A hard case times 2^300 to 2^980, velocities too."""
    return scaled(rng.choice(SCALED)(rng), rng, numbers.HUGE)


@hard("polygon2d_moving")
def tiny_scale_moving(rng: Random) -> Input:
    """A hard case times 2^-300 to 2^-1060, velocities too."""
    return scaled(rng.choice(SCALED)(rng), rng, numbers.TINY)


SCALED = (feature_contact, touching_initially, one_ulp_apart_initially, general_position, grazing_parallel_edge)
