# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""When a convex footprint on a constant twist first meets a point: the point's circle cut with the edges as segments.

Rational numbers throughout; the parameter at which a circle cuts an edge comes from an integer square root of 400 bits.
Times are compared as positions on the circle, so no arctangent is needed.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from math import isqrt

from oracle.turning import ONE, PI, sine_cosine

Point = tuple[Fraction, Fraction]
BITS = 400
SLACK = Fraction(1, 1 << 150)


def _root(x: Fraction) -> Fraction:
    return Fraction(isqrt(int(x * (1 << (2 * BITS)))), 1 << BITS)


def _inside(ring: Sequence[Point], p: Point) -> bool:
    sides = [
        (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0])
        for a, b in zip(ring, [*ring[1:], ring[0]], strict=True)
    ]
    return all(s >= 0 for s in sides)


class Arc:
    """One point and one robot; `first` is None, or the first contact's place on the way."""

    def __init__(self, ring: Sequence[Sequence[float]], twist: Sequence[float], point: Sequence[float]) -> None:
        self.ring = [(Fraction(x), Fraction(y)) for x, y in ring]
        self.vx, self.vy, self.w = (Fraction(x) for x in twist)
        self.point = (Fraction(point[0]), Fraction(point[1]))
        self.at_start = _inside(self.ring, self.point)
        edges = list(zip(self.ring, [*self.ring[1:], self.ring[0]], strict=True))
        if self.w == 0:
            places = [x for a, b in edges for x in self._straight(a, b)]
            self.first = min(places, default=None)
            return
        self.center = (-self.vy / self.w, self.vx / self.w)
        self.start = (self.point[0] - self.center[0], self.point[1] - self.center[1])
        found = [self._place(hit) for a, b in edges for hit in self._cut(a, b)]
        self.first = min(found, default=None)

    def _straight(self, a: Point, b: Point) -> list[Fraction]:
        """Times at which the point, which comes with minus the velocity, is on an edge."""
        ex, ey = b[0] - a[0], b[1] - a[1]
        speed = ey * self.vx - ex * self.vy
        if speed == 0:
            return []  # along the edge: its neighbours are met first
        t = (ey * (self.point[0] - a[0]) - ex * (self.point[1] - a[1])) / speed
        x, y = self.point[0] - t * self.vx - a[0], self.point[1] - t * self.vy - a[1]
        return [t] if t >= 0 and 0 <= x * ex + y * ey <= ex * ex + ey * ey else []

    def _cut(self, a: Point, b: Point) -> list[Point]:
        ex, ey = b[0] - a[0], b[1] - a[1]
        dx, dy = a[0] - self.center[0], a[1] - self.center[1]
        square, middle = ex * ex + ey * ey, ex * dx + ey * dy
        rest = dx * dx + dy * dy - self.start[0] ** 2 - self.start[1] ** 2
        inner = middle * middle - square * rest
        if square == 0 or inner < 0:
            return []
        roots = [(-middle + sign * _root(inner)) / square for sign in (-1, 1)]
        return [(dx + s * ex, dy + s * ey) for s in roots if -SLACK <= s <= 1 + SLACK]

    def _place(self, arm: Point) -> tuple[int, Fraction]:
        """Rises with the time at which the arm points there."""
        sx, sy = self.start
        across = (sx * arm[1] - sy * arm[0]) * (-1 if self.w > 0 else 1)
        along = sx * arm[0] + sy * arm[1]
        return (0, -along) if across >= 0 else (1, along)

    def place_at(self, t: float) -> tuple[int, Fraction] | Fraction:
        """Comparable with `first`."""
        if self.w == 0:
            return Fraction(t)
        sine, cosine = (Fraction(x, ONE) for x in sine_cosine(abs(self.w) * Fraction(t)))
        if self.w > 0:
            sine = -sine
        sx, sy = self.start
        return self._place((cosine * sx - sine * sy, sine * sx + cosine * sy))

    def within_a_turn(self, t: float) -> bool:
        """Whether places up to then are in order."""
        return self.w == 0 or abs(self.w) * Fraction(t) < Fraction(2 * PI, ONE)

    def met_by(self, t: float) -> bool:
        """Whether there is contact until t, or within far less than an ulp of it."""
        if self.at_start or self.first is None:
            return self.at_start
        return not self.within_a_turn(t) or self.first <= self.place_at(t)

    def apart_before(self, t: float) -> bool:
        """Whether there is none before t."""
        if self.at_start or self.first is None:
            return not self.at_start or t == 0.0
        return self.within_a_turn(t) and self.place_at(t) <= self.first
