# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""Hulls that translate, hard for first contact in space."""

from __future__ import annotations

import math
from fractions import Fraction
from random import Random
from typing import Any

from oracle.vectors import Vector, add, exact, scale, sub

from hard import bodies, contact, numbers
from hard.numbers import eighths, magnitude
from hard.registry import hard

Input = dict[str, Any]


def moving(given: Input, velocity: Any, rng: Random, t_max: float = 64.0) -> Input:
    """`velocity` of Q as seen from P, with a common velocity that changes nothing added now and then."""
    common = (0.0, 0.0, 0.0) if rng.random() < 0.5 else tuple(eighths(rng, -8, 8) for _ in range(3))
    return {
        "P": {"vertices": given["P"]},
        "velP": [float(x) for x in common],
        "Q": {"vertices": given["Q"]},
        "velQ": numbers.doubles(add(exact(velocity), exact(common))),
        "tmax": float(t_max),
    }


def backed_off(given: Input, time: float, velocity: Any) -> Input:
    """A pair as it is `time` before, rounded where the numbers do not allow it exactly."""
    way = scale(-Fraction(time), exact(velocity))
    return {"P": given["P"], "Q": [numbers.doubles(add(exact(q), way)) for q in given["Q"]]}


def slow(rng: Random) -> Vector:
    """Few bits, not zero."""
    while True:
        v = tuple(eighths(rng, -16, 16) for _ in range(3))
        if any(v):
            return v


def random_velocity(rng: Random) -> Vector:
    return tuple(rng.gauss(0, 1) for _ in range(3))


def edge(cloud: Any, rng: Random) -> Vector:
    """From one vertex to another, not zero."""
    while True:
        p, q = rng.sample(cloud, 2)
        if any(v := sub(exact(q), exact(p))):
            return v


@hard("polyhedra_moving")
def feature_contact(rng: Random) -> Input:
    """Contact at a time of few bits across faces, edges and corners; or a graze, or a miss."""
    velocity = slow(rng)
    return moving(backed_off(bodies.hull_touch_exact(rng), rng.choice((0.5, 1.0, 2.0)), velocity), velocity, rng)


@hard("polyhedra_moving")
def general_position(rng: Random) -> Input:
    """Random hulls on their way to each other."""
    pair = bodies.close_clouds(bodies.cloud(rng), bodies.cloud(rng), magnitude(rng, -6, 0.5), rng)
    return moving(pair, random_velocity(rng), rng, magnitude(rng, 0, 2))


@hard("polyhedra_moving")
def contact_at_tmax(rng: Random) -> Input:
    """The time window ends at the contact, or an ulp before or after."""
    velocity, time = slow(rng), rng.choice((0.5, 1.0, 2.0))
    given = moving(backed_off(bodies.hull_touch_exact(rng), time, velocity), velocity, rng)
    return given | {"tmax": numbers.nudged(time, rng.choice((-1, 0, 0, 1)))}


@hard("polyhedra_moving")
def touching_initially(rng: Random) -> Input:
    """In touch at the start, receding, sliding or closing; or an ulp or two from it."""
    return moving(rng.choice((bodies.hull_touch_exact, bodies.hull_touch_ulp))(rng), slow(rng), rng)


@hard("polyhedra_moving")
def overlapping_initially(rng: Random) -> Input:
    """Overlapping at the start; the contact set is the intersection."""
    a, b = bodies.few_bits(rng), bodies.few_bits(rng)
    return moving(bodies.close_clouds(a, b, -rng.choice((0.125, 0.25, 0.5, 1e-9)), rng), slow(rng), rng)


@hard("polyhedra_moving")
def zero_relative_velocity(rng: Random) -> Input:
    """Equal velocities: whatever holds at the start holds for ever."""
    pair = rng.choice((bodies.hull_touch_exact, bodies.hull_touch_ulp, bodies.hull_touch_nearly))(rng)
    return moving(pair, (0.0, 0.0, 0.0), rng)


@hard("polyhedra_moving")
def grazing_edge(rng: Random) -> Input:
    """Slides exactly along an edge or a face of what it touches, with no closing speed, or an ulp beside it."""
    pair = rng.choice((bodies.hull_touch_exact, bodies.hull_touch_exact, bodies.hull_touch_ulp))(rng)
    velocity = edge(pair["P"], rng)
    return moving(backed_off(pair, 2.0, velocity), velocity, rng)


@hard("polyhedra_moving")
def grazing_vertex(rng: Random) -> Input:
    """A vertex passes exactly through a vertex."""
    p, q, velocity = bodies.few_bits(rng), bodies.few_bits(rng), slow(rng)
    shift = sub(exact(rng.choice(p)), exact(rng.choice(q)))
    pair = {"P": p, "Q": [numbers.doubles(add(exact(x), shift)) for x in q]}
    return moving(backed_off(pair, rng.choice((1.0, 2.0)), velocity), velocity, rng)


@hard("polyhedra_moving")
def grazing_angle(rng: Random) -> Input:
    """The velocity makes 1e-3 to 1e-12 rad with the plane that it reaches: the time has condition 1 / angle."""
    a, b = bodies.cloud(rng), bodies.cloud(rng)
    normal = contact.some_normal(a, b, rng)
    x, y, z = contact.apart(normal, 1.0)
    angle = magnitude(rng, -12, -3)
    pair = bodies.placed(a, b, normal, angle * rng.uniform(0.05, 1.0), rng)
    across = (y, -x, 0.0) if abs(z) < 0.8 else (z, 0.0, -x)
    return moving(pair, tuple(c - angle * n for c, n in zip(across, (x, y, z), strict=True)), rng)


@hard("polyhedra_moving")
def huge_or_tiny_velocity(rng: Random) -> Input:
    """Speeds of 1e-15 to 1e15: through in an instant, or crawling."""
    pair = bodies.close_clouds(bodies.cloud(rng), bodies.cloud(rng), magnitude(rng, -3, 1), rng)
    speed = 10.0 ** rng.choice((-15, -9, 9, 15))
    return moving(pair, scale(speed, random_velocity(rng)), rng, rng.choice((1.0, 4.0 / speed)))


@hard("polyhedra_moving")
def moving_needles(rng: Random) -> Input:
    """Needles and slabs, up to 1e9 times as long as thick."""
    return moving(bodies.needle_hulls(rng), random_velocity(rng), rng)


@hard("polyhedra_moving")
def near_parallel_ridge(rng: Random) -> Input:
    """A hull and its mirror image turned by 1e-6 to 1e-15 rad, closing, or passing along the face between them."""
    pair = bodies.near_parallel_hulls(rng)
    velocity = edge(pair["P"], rng) if rng.random() < 0.5 else random_velocity(rng)
    return moving(backed_off(pair, 1.0, velocity), velocity, rng)


@hard("polyhedra_moving")
def many_faces_moving(rng: Random) -> Input:
    """Points of two spheres: faces are nearly parallel to their neighbours."""
    pair, velocity = bodies.many_faces(rng), random_velocity(rng)
    return moving(backed_off(pair, rng.choice((0.0, 1.0)), velocity), velocity, rng)


@hard("polyhedra_moving")
def flat_bodies_moving(rng: Random) -> Input:
    """Points, segments and polygons."""
    velocity = slow(rng)
    return moving(backed_off(bodies.flat_bodies(rng), rng.choice((0.0, 1.0)), velocity), velocity, rng)


@hard("polyhedra_moving")
def repeated_coplanar_moving(rng: Random) -> Input:
    """Vertices repeated, in faces, on edges and inside."""
    velocity = slow(rng)
    return moving(backed_off(bodies.repeated_coplanar(rng), rng.choice((0.0, 1.0)), velocity), velocity, rng)


@hard("polyhedra_moving")
def far_from_origin_moving(rng: Random) -> Input:
    """Far away, where coordinates have few digits left for what happens."""
    return moving(bodies.hulls_far_from_origin(rng), random_velocity(rng), rng)


def _scaled(rng: Random, exponents: tuple[int, int]) -> Input:
    given = rng.choice((feature_contact, general_position, touching_initially, grazing_vertex))(rng)
    factor = rng.randint(*exponents)
    for name in ("P", "velP", "Q", "velQ"):
        given[name] = numbers.mapped(given[name], lambda x: math.ldexp(x, factor))
    return given


@hard("polyhedra_moving")
def huge_scale_moving(rng: Random) -> Input:
    """A hard case times a large power of two."""
    return _scaled(rng, numbers.HUGE)


@hard("polyhedra_moving")
def tiny_scale_moving(rng: Random) -> Input:
    """A hard case times a small power of two."""
    return _scaled(rng, numbers.TINY)
