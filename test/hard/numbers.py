# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""Numbers that are hard on purpose: frames that are exact, nearly equal or skewed; single ulps; extreme scales."""

from __future__ import annotations

import math
from fractions import Fraction
from random import Random
from typing import Any

from oracle.vectors import Vector, exact

Frame = list[list[float]]

# Largest |coordinate| of scaled cases is about 1e300, smallest normal one 1e-308: 2^996 and 2^-1022.
HUGE, TINY = (300, 980), (-1060, -300)


def magnitude(rng: Random, low: float, high: float) -> float:
    """10**x, x uniform."""
    return float(10.0 ** rng.uniform(low, high))


def sign(rng: Random) -> int:
    return rng.choice((-1, 1))


def eighths(rng: Random, low: int, high: int) -> float:
    """A multiple of 1/8, limits in eighths: sums and products of some of them are exact."""
    return rng.randint(low, high) / 8


# ---------------------------------------------------------------------------------------------------- frames


def world() -> Frame:
    return [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]


def permuted(rng: Random) -> Frame:
    """Axes of the world in any order, of any sign; zeros of either sign."""
    rows = rng.sample(world(), 3)
    return [[x * s for x in row] for row, s in zip(rows, (sign(rng), sign(rng), sign(rng)), strict=True)]


# A quaternion is drawn again if its square is less: of the rest none is near the zero that has no direction.
LEAST_SQUARE = 1e-3


def rotated(rng: Random) -> Frame:
    """A random rotation, rounded."""
    while True:
        w, x, y, z = (rng.gauss(0.0, 1.0) for _ in range(4))
        n = w * w + x * x + y * y + z * z
        if n > LEAST_SQUARE:
            break
    return [
        [(w * w + x * x - y * y - z * z) / n, 2 * (x * y - w * z) / n, 2 * (x * z + w * y) / n],
        [2 * (x * y + w * z) / n, (w * w - x * x + y * y - z * z) / n, 2 * (y * z - w * x) / n],
        [2 * (x * z - w * y) / n, 2 * (y * z + w * x) / n, (w * w - x * x - y * y + z * z) / n],
    ]


def dyadic(rng: Random) -> Frame:
    """A rotation in multiples of 1/256, off orthonormal by up to 7e-3: slanted, and yet sums are exact."""
    return [[round(x * 256) / 256 for x in row] for row in rotated(rng)]


def exact_frame(rng: Random) -> Frame:
    """A frame in which touching can be arranged to the last bit."""
    return rng.choice((permuted, permuted, dyadic))(rng)


def tilted(frame: Frame, angle: float, rng: Random) -> Frame:
    """`frame` turned by a small angle about some axis."""
    k = rotated(rng)[0]
    c, s = math.cos(angle), math.sin(angle)
    rows = []
    for v in frame:
        cross = [k[1] * v[2] - k[2] * v[1], k[2] * v[0] - k[0] * v[2], k[0] * v[1] - k[1] * v[0]]
        along = sum(a * b for a, b in zip(k, v, strict=True)) * (1.0 - c)
        rows.append([x * c + y * s + a * along for x, y, a in zip(v, cross, k, strict=True)])
    return rows


def skewed(frame: Frame, defect: float, rng: Random) -> Frame:
    """`frame` with every entry off by up to `defect`."""
    return [[x + rng.uniform(-defect, defect) for x in row] for row in frame]


# --------------------------------------------------------------------------------------- any nested input at once


def mapped(value: Any, change: Any) -> Any:
    """`change` of every float of a nested input."""
    if isinstance(value, dict):
        return {key: mapped(item, change) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [mapped(item, change) for item in value]
    return change(value)


def nudged(x: float, ulps: int) -> float:
    """`x` moved by some ulps."""
    for _ in range(abs(ulps)):
        x = math.nextafter(x, math.inf if ulps > 0 else -math.inf)
    return x


def nudged_somewhere(values: list[float], rng: Random) -> list[float]:
    """One of the values moved by one or two ulps, either way."""
    chosen = rng.randrange(len(values))
    step = rng.choice((-2, -1, 1, 2))
    return [nudged(x, step) if k == chosen else x for k, x in enumerate(values)]


def doubles(vector: Vector) -> list[float]:
    """The nearest doubles."""
    return [float(x) for x in vector]


def is_exact(vector: Vector) -> bool:
    """Whether doubles hold it."""
    return all(Fraction(float(x)) == x for x in exact(vector))
