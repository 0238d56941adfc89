# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""Bodies that translate and turn, hard for first contact: in the plane, and the same as prisms or hulls in space."""

from __future__ import annotations

import math
from collections.abc import Callable
from fractions import Fraction
from random import Random
from typing import Any

from oracle import polygon
from oracle.turning import Turning, apart_until

from hard import numbers
from hard.numbers import magnitude
from hard.registry import hard

Input = dict[str, Any]
Points = list[list[float]]

#: By dimension.
KINDS = {2: "polygon2d_turning", 3: "polyhedra_turning"}


def turning(generator: Callable[[Random, int], Input]) -> Callable[[Random, int], Input]:
    """Register a generator for both dimensions."""
    for d, kind in KINDS.items():

        def of_dimension(rng: Random, d: int = d) -> Input:
            return generator(rng, d)

        of_dimension.__name__ = generator.__name__
        hard(kind)(of_dimension)
    return generator


def pair(p: Points, q: Points, t_max: float = 4.0, **motion: Any) -> Input:
    """Bodies at rest about the origin but for the `velP`, `angP`, `cenP`, `velQ`... that are given."""
    d = len(p[0])
    given: Input = {"P": {"vertices": p}, "Q": {"vertices": q}, "tmax": t_max}
    for side in "PQ":
        given |= {f"vel{side}": [0.0] * d, f"ang{side}": [0.0] * 3, f"cen{side}": [0.0] * d}
    return given | motion


def bodies(given: Input) -> tuple[Turning, Turning]:
    """As the oracle takes them."""
    a, b = (
        Turning.of(given[side]["vertices"], given[f"vel{side}"], tuple(given[f"ang{side}"]), given[f"cen{side}"])
        for side in "PQ"
    )
    return a, b


def solid(ring: Points, d: int, height: float) -> Points:
    """A ring, or the prism over it."""
    return ring if d == 2 else [[*p, z] for p in ring for z in (-height, height)]


def rectangle(x: float, y: float, half_x: float, half_y: float) -> Points:
    return [[x - half_x, y - half_y], [x + half_x, y - half_y], [x + half_x, y + half_y], [x - half_x, y + half_y]]


def cloud(rng: Random, d: int) -> Points:
    """Some points, in the plane in convex order."""
    points = [[rng.gauss(0, 1) for _ in range(d)] for _ in range(rng.randint(d + 1, 7))]
    return points if d == 3 else [[float(x) for x in p] for p in polygon.hull(points)]


def spin(rng: Random, d: int, rate: float) -> list[float]:
    """An angular velocity of about `rate`."""
    return [0.0, 0.0, rng.gauss(0, rate)] if d == 2 else [rng.gauss(0, rate) for _ in range(3)]


@turning
def turning_generally(rng: Random, d: int, size: float = 1.0, rate: float = 1.0) -> Input:
    """Random hulls on their way to each other, or past."""
    p, q = ([[size * x for x in point] for point in cloud(rng, d)] for _ in range(2))
    way = [rng.gauss(0, 1) for _ in range(d)]
    far = 4.0 * size / math.hypot(*way)
    q = [[x + far * w for x, w in zip(point, way, strict=True)] for point in q]
    velocity = [size * rng.gauss(0, 0.4) - 0.5 * far * w for w in way]
    center = [far * w for w in way]
    motion = {"angP": spin(rng, d, rate), "angQ": spin(rng, d, rate), "velQ": velocity, "cenQ": center}
    return pair(p, q, 3.0, **motion)


@turning
def turning_tiny_bodies(rng: Random, d: int) -> Input:
    """Bodies of a micrometre."""
    return turning_generally(rng, d, size=1e-6)


@turning
def turning_huge_bodies(rng: Random, d: int) -> Input:
    """Bodies of 1,000 km."""
    return turning_generally(rng, d, size=1e6)


@turning
def turning_fast(rng: Random, d: int) -> Input:
    """Up to 1e3 rad/s: some hundred turns on the way."""
    return turning_generally(rng, d, rate=magnitude(rng, 1.5, 3.0)) | {"tmax": 1.0}


@turning
def turning_slowly(rng: Random, d: int) -> Input:
    """Down to 1e-12 rad/s: nearly a translation."""
    return turning_generally(rng, d, rate=magnitude(rng, -12, -3))


#: Right triangles of whole numbers: an arm along one has an exact length.
TRIANGLES = ((3, 4, 5), (5, 12, 13), (8, 15, 17), (20, 21, 29))


@turning
def turning_graze(rng: Random, d: int) -> Input:
    """The end of a rod on a circle of exact radius; a wall at that radius, or an ulp nearer or farther."""
    x, y, radius = rng.choice(TRIANGLES)
    wall = numbers.nudged(float(radius), rng.choice((-1, 0, 0, 1)))
    rate = magnitude(rng, -2, 3)
    scale = 2.0 ** rng.randint(-20, 20)
    post = [[wall, -2.0 * radius], [wall + 1.0, -2.0 * radius], [wall + 1.0, 2.0 * radius], [wall, 2.0 * radius]]
    rod = [[-float(x), -float(y)], [float(x), float(y)]]
    p, q = (numbers.mapped(solid(ring, d, height), lambda v: scale * v) for ring, height in ((rod, 0.25), (post, 2.0)))
    return pair(p, q, 1.5 / rate, angP=[0.0, 0.0, -rate])


@turning
def turning_thin_bar(rng: Random, d: int) -> Input:
    """A bar 10 m long and down to 1e-9 m thick sweeps past a post as thin, within one turn."""
    rate, thickness = magnitude(rng, 0, 3), magnitude(rng, -9, -2)
    bar = [[0.0, -thickness], [10.0, -thickness], [10.0, thickness], [0.0, thickness]]
    angle, far = rng.uniform(0.2, 6.0), rng.uniform(1.0, 9.9)
    post = rectangle(far * math.cos(angle), far * math.sin(angle), thickness, thickness)
    return pair(solid(bar, d, 0.01), solid(post, d, 0.5), 7.0 / rate, angP=[0.0, 0.0, rate])


@turning
def turning_past_a_wall(rng: Random, d: int) -> Input:
    """A spinning square passes a wall that its corners just reach, or just do not."""
    half, rate = math.sqrt(0.5), magnitude(rng, 0, 2)
    gap = rng.choice((-1, 1)) * magnitude(rng, -12, -3)
    square = rectangle(-3.0, 0.0, half, half)
    wall = rectangle(0.0, 1.0 + gap + 0.5, 2.0, 0.5)
    motion = {"velP": [1.0] + [0.0] * (d - 1), "angP": [0.0, 0.0, rate], "cenP": [-3.0] + [0.0] * (d - 1)}
    return pair(solid(square, d, 0.3), solid(wall, d, 1.0), 6.0, **motion)


@turning
def turning_until_tmax(rng: Random, d: int) -> Input:
    """The time window ends at the double before or after the first contact."""
    given = turning_generally(rng, d)
    time = apart_until(*bodies(given), Fraction(given["tmax"]), 300)
    below = float(time) if Fraction(float(time)) <= time else math.nextafter(float(time), 0.0)
    return given | {"tmax": rng.choice((below, math.nextafter(below, math.inf)))}


@turning
def turning_from_touch(rng: Random, d: int) -> Input:
    """Face to face at the start, or an ulp apart or inside, turning about a centre anywhere."""
    side = numbers.nudged(1.0, rng.choice((-1, 0, 0, 1)))
    p, q = rectangle(0.0, 0.0, 0.5, 0.5), [[side - 0.5, -0.5], [2.0, -0.5], [2.0, 0.5], [side - 0.5, 0.5]]
    motion = {"angP": [0.0, 0.0, rng.gauss(0, 1)], "cenP": [rng.gauss(0, 1) for _ in range(d)]}
    return pair(solid(p, d, 0.5), solid(q, d, 1.0), 1.0, **motion)
