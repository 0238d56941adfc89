# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""Bodies that translate and turn, to 150 bits: where they are, whether they touch, until when they surely do not.

Positions come from integer arithmetic with 240 bits after the point: pi by Machin's formula, sines by Taylor's
series.  That two bodies are apart until a time is shown by many small steps, each no longer than the gap along a
direction over the greatest speed any of their points can have along it; the engine's bound is another one.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from math import isqrt, sqrt
from typing import Any

from oracle import polytope
from oracle.vectors import Vector, cross, dot, exact, scale, sub

BITS = 240
ONE = 1 << BITS
#: More than 200 operations, each rounding 2^-240 of numbers below 2^60, could ever add up to.
ERROR = Fraction(1, 1 << 150)
#: What a length or speed in float64, of fewer than 100 roundings of 2^-53, is made larger by to be an upper bound.
ROUNDED_UP = 1e-12


def _arctangent_of_inverse(x: int) -> int:
    term = total = (ONE << 40) // x
    n, sign = 1, 1
    while term:
        term //= x * x
        n, sign = n + 2, -sign
        total += sign * (term // n)
    return total


PI = (4 * (4 * _arctangent_of_inverse(5) - _arctangent_of_inverse(239))) >> 40


def sine_cosine(angle: Fraction) -> tuple[int, int]:
    """In units of 2^-BITS."""
    turns = round(angle / Fraction(2 * PI, ONE))
    x = int(angle * ONE) - 2 * PI * turns
    # PI is off by an ulp, times the turns: far below ERROR.
    sine, cosine, term = 0, 0, ONE
    k = 0
    while term:
        parts = (
            (cosine + term, sine)
            if k % 4 == 0
            else (cosine, sine + term)
            if k % 4 == 1
            else ((cosine - term, sine) if k % 4 == 2 else (cosine, sine - term))
        )
        cosine, sine = parts
        k += 1
        term = _shift(term * x) // k
    return sine, cosine


def _shift(x: int) -> int:
    return x >> BITS if x >= 0 else -(-x >> BITS)


@dataclass(frozen=True)
class Turning:
    """A body as the engine is given it: vertices at time 0, velocity, angular velocity, centre; 2D with z = 0."""

    vertices: tuple[Vector, ...]
    velocity: Vector
    angular: Vector
    center: Vector

    @classmethod
    def of(cls, vertices: Any, velocity: Any, angular: Any, center: Any) -> Turning:
        def space(v: Any) -> Vector:
            v = tuple(exact(v))
            return v if len(v) == 3 else (*v, Fraction(0))

        if isinstance(angular, (int, float)):
            angular = (0.0, 0.0, float(angular))
        points = tuple(space(v) for v in (vertices.tolist() if hasattr(vertices, "tolist") else vertices))
        return cls(points, *(space([float(x) for x in v]) for v in (velocity, angular, center)))

    @cached_property
    def speed(self) -> Fraction:
        """|w| to 2^-BITS, or to as many bits if it is small."""
        square = dot(self.angular, self.angular)
        if square == 0:
            return Fraction(0)
        shift = max(0, square.denominator.bit_length() - square.numerator.bit_length()) + 2 * BITS
        shift += shift % 2
        return Fraction(isqrt(int(square * (1 << shift))), 1 << (shift // 2))

    @cached_property
    def reach(self) -> float:
        """An upper bound of how far any vertex is from the centre."""
        return max(sqrt(dot(r, r)) for r in (sub(v, self.center) for v in self.vertices)) * (1 + ROUNDED_UP)

    @cached_property
    def _parts(self) -> list[tuple[Vector, Vector, Vector]]:
        """Of every arm: the part along the axis, the part across it, and that turned by a quarter."""
        arms = [sub(v, self.center) for v in self.vertices]
        if self.speed == 0:
            return [(r, (0, 0, 0), (0, 0, 0)) for r in arms]
        axis = scale(1 / self.speed, self.angular)
        out = []
        for r in arms:
            along = scale(dot(axis, r), axis)
            out.append(tuple(tuple(round(x * ONE) for x in v) for v in (along, sub(r, along), cross(axis, r))))
        return out

    def at(self, t: Fraction, relative_to: Vector = (0, 0, 0)) -> list[tuple[int, int, int]]:
        """Vertices at time t, in units of 2^-BITS, off by less than ERROR."""
        base = [round((c + v * t - o) * ONE) for c, v, o in zip(self.center, self.velocity, relative_to, strict=True)]
        if self.speed == 0:
            return [tuple(b + round(x * ONE) for b, x in zip(base, arm, strict=True)) for arm, _, _ in self._parts]
        sine, cosine = sine_cosine(self.speed * t)
        return [
            tuple(b + x + _shift(cosine * y + sine * z) for b, x, y, z in zip(base, *parts, strict=True))
            for parts in self._parts
        ]


def _rounded(points: Sequence[Sequence[int]], bits: int) -> list[Vector]:
    return [tuple(Fraction(x >> (BITS - bits), 1 << bits) for x in p) for p in points]


def meet_at(a: Turning, b: Turning, t: Fraction) -> bool:
    """Whether the bodies have a common point at time t, each moved by up to 2^-130."""
    return polytope.intersects(_rounded(a.at(t), 130), _rounded(b.at(t), 130))


def gap(points_a: Any, points_b: Any, n: Vector) -> Fraction:
    """A lower bound of the gap along n, times |n|."""
    length = sum(abs(x) for x in n)
    least = min(dot(n, q) for q in points_b) - max(dot(n, p) for p in points_a)
    return Fraction(least) / ONE - 2 * ERROR * length


def apart_until(a: Turning, b: Turning, end: Fraction, most_steps: int = 20000) -> Fraction:
    """A time until which the bodies certainly have no common point; at least `end` if all goes well."""
    t, n, good = Fraction(0), None, Fraction(0)
    relative = [float(x) for x in sub(b.velocity, a.velocity)]
    size = a.reach + b.reach
    for _ in range(most_steps):
        points_a, points_b = a.at(t), b.at(t)
        space = Fraction(-1) if n is None else gap(points_a, points_b, n)
        if n is None or space * 3 < good * 2 or space <= 0:
            # Coarse coordinates do until the bodies come close.
            space = Fraction(-1)
            for bits in (40, 130):
                p, q = polytope.nearest(_rounded(points_a, bits), _rounded(points_b, bits))
                n = sub(q, p)
                largest = max(abs(x) for x in n)
                if largest == 0:
                    continue
                n = tuple(Fraction(round(x / largest * (1 << 140)), 1 << 140) for x in n)
                space = gap(points_a, points_b, n)
                if space > Fraction(size) / (1 << 24):
                    break
            good = space
        if space <= 0:
            return t
        along = [float(x) for x in n]
        length = sqrt(sum(x * x for x in along))
        closing = -sum(x * v for x, v in zip(along, relative, strict=True))
        for body in (a, b):
            w = [float(x) for x in body.angular]
            across = cross(tuple(along), tuple(w))
            closing += sqrt(sum(x * x for x in across)) * body.reach
        closing += ROUNDED_UP * (length * sqrt(sum(v * v for v in relative)) + 1e-300)
        if closing <= 0:
            return end
        t += Fraction(int(space / Fraction(closing) * (1 - Fraction(1, 1 << 40)) * (1 << 160)), 1 << 160)
        if t >= end:
            return end
    return t
