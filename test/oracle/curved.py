# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""Supports of round bodies in rational arithmetic, and pairs placed so that their signed distance is known.

Along a direction n a body reaches as far as its support h(n) = max n . x.  Two convex bodies are at least as far apart
as the gap -h_b(-n) - h_a(n) along a unit direction, and no farther than any two of their points.  Placing the highest
point of one under the lowest of the other makes both the same: the distance is then known without searching for it.
Square roots are taken to `BITS` bits, and nothing else is rounded.
"""

from __future__ import annotations

import math
from fractions import Fraction
from typing import Any, NamedTuple

from oracle.vectors import Vector, add, cross, dot, exact, scale, squared_norm, sub

BITS = 260  #: of a root, in absolute terms 2**-BITS

ZERO = (Fraction(0), Fraction(0), Fraction(0))


def root(x: Fraction) -> Fraction:
    """Square root, rounded down."""
    return Fraction(math.isqrt((x.numerator << (2 * BITS)) // x.denominator), 1 << BITS)


def norm(v: Vector) -> Fraction:
    return root(squared_norm(v))


class Body(NamedTuple):
    """A shape by `kind` and `sizes`: radius, half length; half axes; or vertices; grown by `radius` and placed."""

    kind: str
    sizes: tuple[Any, ...]
    radius: Fraction = Fraction(0)
    rotation: tuple[Vector, ...] | None = None
    place: Vector = ZERO

    def at(self, rotation: Any, place: Any) -> Body:
        """The same elsewhere; nine numbers of the rotation, taken literally."""
        return self._replace(rotation=exact(rotation), place=exact(place))

    def own(self, n: Vector) -> Vector:
        """Direction n in the own axes: R^T n."""
        if self.rotation is None:
            return n
        columns = zip(*self.rotation, strict=True)
        return tuple(dot(column, n) for column in columns)

    def world(self, x: Vector) -> Vector:
        turned = x if self.rotation is None else tuple(dot(row, x) for row in self.rotation)
        return add(turned, self.place)


def body_of(shape: Any) -> Body:
    """Of a Sphere, Capsule, Box, Convex, Cylinder, Cone or Ellipsoid."""
    name = type(shape).__name__
    if name == "Sphere":
        return Body("hull", ((ZERO),), exact(shape.radius))
    if name == "Capsule":
        half = exact(shape.length / 2)
        return Body("hull", ((Fraction(0), Fraction(0), half), (Fraction(0), Fraction(0), -half)), exact(shape.radius))
    if name == "Box":
        x, y, z = exact(shape.half_extents)
        corners = tuple((i * x, j * y, k * z) for i in (-1, 1) for j in (-1, 1) for k in (-1, 1))
        return Body("hull", corners)
    if name in ("Cylinder", "Cone"):
        return Body(name.lower(), (exact(shape.radius), exact(shape.length / 2)))
    if name == "Ellipsoid":
        return Body("ellipsoid", exact(shape.radii))
    return Body("hull", exact(shape.vertices))


def faces(body: Body, n: Vector) -> list[Vector]:
    """Points whose hull is, or of a disc holds, what the body without its radius has highest along n; own axes."""
    e = body.own(n)
    if body.kind == "hull":
        most = max(dot(e, v) for v in body.sizes)
        return [v for v in body.sizes if dot(e, v) == most]
    if body.kind == "ellipsoid":
        stretched = tuple(a * x for a, x in zip(body.sizes, e, strict=True))
        length = norm(stretched)
        return [tuple(a * x / length for a, x in zip(body.sizes, stretched, strict=True))]
    radius, half = body.sizes
    across = norm((e[0], e[1]))
    if across == 0:
        # A whole disc, of which four points of the rim; rational ones.
        rim = [(radius * c, radius * s) for c, s in ((1, 0), (0, 1), (-1, 0), (0, -1))]
    else:
        rim = [(radius * e[0] / across, radius * e[1] / across)]
    low, high = ([(x, y, z) for x, y in rim] for z in (-half, half))
    if body.kind == "cylinder":
        return high if e[2] > 0 else low if e[2] < 0 else [*low, *high]
    base, apex = radius * across - half * e[2], half * e[2]
    tip = [(Fraction(0), Fraction(0), half)]
    return tip if apex > base else low if base > apex else [*low, *tip]


def support(body: Body, n: Vector) -> Fraction:
    """Largest n . x of the body."""
    point = faces(body, n)[0]
    return dot(n, body.world(point)) + body.radius * norm(n)


def gap(a: Body, b: Body, n: Vector) -> Fraction:
    """Gap between the supports along n, of any length; at most the signed distance."""
    opposite = tuple(-x for x in n)
    return -(support(a, n) + support(b, opposite)) / norm(n)


class Placed(NamedTuple):
    """Bodies with a signed distance in [low, high]; `b` holds the pose that the engine is to be given."""

    a: Body
    b: Body
    low: Fraction
    high: Fraction
    normal: Vector
    point_a: Vector
    point_b: Vector


def facing(a: Body, b: Body, n: Vector, apart: Fraction, mix: Any) -> Placed:
    """b, turned as it is, moved so that it is `apart` of a along n: the rounding of the place in doubles is counted.

    `mix` makes a point of a list of points: which of a face is the nearest.  For `apart` < 0 `high` holds where no
    direction has a larger gap, see `best_gap`.
    """
    length = norm(n)
    opposite = tuple(-x for x in n)
    unit = scale(1 / length, n)
    top = add(a.world(mix(faces(a, n))), scale(a.radius, unit))
    free = b._replace(place=ZERO)
    bottom = sub(free.world(mix(faces(free, opposite))), scale(b.radius, unit))
    place = add(sub(top, bottom), scale(apart, unit))
    rounded = tuple(Fraction(float(x)) for x in place)
    moved = b._replace(place=rounded)
    error = sub(rounded, place)
    along = apart + dot(unit, error)
    high = norm(add(scale(apart, unit), error)) + Fraction(1, 1 << 200) if apart >= 0 else along
    return Placed(a, moved, along, max(high, along), unit, top, add(bottom, rounded))


def tangents(n: Vector) -> tuple[Vector, Vector]:
    """Two directions across n."""
    axis = min(((1, 0, 0), (0, 1, 0), (0, 0, 1)), key=lambda e: abs(dot(e, n)))
    first = cross(n, exact(axis))
    return first, cross(n, first)
