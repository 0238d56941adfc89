# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""Exact numbers and vectors.  A vector is a tuple of int or Fraction."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from fractions import Fraction
from typing import Any

Vector = tuple[Any, ...]
Constraint = tuple[Vector, Fraction]  # (n, d): n . x <= d

ROOT_BITS = 128  # relative width of a square root's bracket is 2**-ROOT_BITS, far below an ulp


def exact(value: Any) -> Any:
    """Number, "p/q" or `float.hex` text -> Fraction; sequences (arrays too) -> nested tuples of Fractions."""
    if isinstance(value, Fraction):
        return value
    if isinstance(value, str):
        return Fraction(float.fromhex(value)) if "0x" in value else Fraction(value)
    if hasattr(value, "tolist"):
        value = value.tolist()
    if isinstance(value, Iterable):
        return tuple(exact(item) for item in value)
    return Fraction(value)


def add(a: Vector, b: Vector) -> Vector:
    return tuple(x + y for x, y in zip(a, b, strict=True))


def sub(a: Vector, b: Vector) -> Vector:
    return tuple(x - y for x, y in zip(a, b, strict=True))


def scale(s: Any, a: Vector) -> Vector:
    return tuple(s * x for x in a)


def dot(a: Vector, b: Vector) -> Any:
    return sum(x * y for x, y in zip(a, b, strict=True))


def squared_norm(a: Vector) -> Any:
    return sum(x * x for x in a)


def cross(a: Vector, b: Vector) -> Vector:
    """Cross product in space."""
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def cross2(a: Vector, b: Vector) -> Any:
    """Cross product in the plane: > 0 where b lies counter-clockwise of a."""
    return a[0] * b[1] - a[1] * b[0]


def primitive(n: Vector) -> Vector:
    """The shortest integer vector along integer `n`; zero stays zero."""
    divisor = math.gcd(*n)
    return tuple(x // divisor for x in n) if divisor else n


def to_integers(*groups: Sequence[Vector]) -> tuple[int, list[list[Vector]]]:
    """A common factor, and every vector of every group times that factor in ints."""
    factor = math.lcm(1, *(x.denominator for group in groups for vector in group for x in vector))
    scaled = [[tuple(x.numerator * (factor // x.denominator) for x in vector) for vector in group] for group in groups]
    return factor, scaled


def root_bracket(square: Any, bits: int = ROOT_BITS) -> tuple[Fraction, Fraction]:
    """Fractions lower <= sqrt(square) <= upper: equal if possible, else 2**-bits apart relatively."""
    square = Fraction(square)
    if square < 0:
        raise ValueError(f"no root of {square}")
    if square == 0:
        return Fraction(0), Fraction(0)
    # sqrt(p / q) = sqrt(p q) / q; widen p q by an even power of two until its root has `bits` bits.
    product, divisor = square.numerator * square.denominator, square.denominator
    shift = max(0, bits + 1 - product.bit_length() // 2)
    root = math.isqrt(product << 2 * shift)
    whole = root * root == product << 2 * shift
    return Fraction(root, divisor << shift), Fraction(root + (not whole), divisor << shift)


def compare_root(bound: float | Fraction, signed_square: Any) -> int:
    """Sign of ``bound - d``, where d has the sign of `signed_square` and its root as magnitude; no rounding.

    `bound` may be an infinity.  A distance is passed as its square, a penetration depth as minus its square.
    """
    if isinstance(bound, float) and math.isinf(bound):
        return 1 if bound > 0 else -1
    bound = Fraction(bound)
    difference = bound * abs(bound) - signed_square
    return (difference > 0) - (difference < 0)


def in_interval(signed_square: Any, lower: float, upper: float) -> bool:
    """Whether the signed root lies in the closed interval [lower, upper]; False if a bound is NaN."""
    if math.isnan(lower) or math.isnan(upper):
        return False
    return compare_root(lower, signed_square) <= 0 <= compare_root(upper, signed_square)


def nearest_double(value: Any) -> float:
    """`value` rounded to the nearest double; overflow gives an infinity."""
    try:
        return float(Fraction(value))
    except OverflowError:
        return math.inf if value > 0 else -math.inf


def root_double(square: Any) -> float:
    """The square root rounded to the nearest double."""
    lower, upper = root_bracket(square)
    low, high = nearest_double(lower), nearest_double(upper)
    if low == high:
        return low
    middle = (Fraction(low) + Fraction(high)) / 2
    return low if square < middle * middle else high


def clip_ray(bounds: Iterable[Constraint], ray: Vector) -> tuple[Fraction, Fraction | None] | None:
    """First and last t >= 0 with t * ray within the bounds; the last is None if there is none; None for a miss."""
    first, last = Fraction(0), None
    for normal, offset in bounds:
        speed = dot(normal, ray)
        if speed == 0:
            if offset < 0:
                return None
        elif speed > 0:
            last = offset / speed if last is None else min(last, offset / speed)
        else:
            first = max(first, offset / speed)
    return None if last is not None and last < first else (first, last)
