# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""Bring two convex bodies into contact, exactly, across features of one's choice.

Bodies are lists of points (2D or 3D).  For any direction n there is a translation of b after which the furthest
points of a along n and those of b along -n share a point and nothing else overlaps: bodies touch.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from fractions import Fraction
from itertools import combinations
from random import Random
from typing import Any

from oracle import polygon, polytope
from oracle.vectors import Vector, add, cross, dot, exact, scale, squared_norm, sub

Points = Sequence[Any]


def furthest(points: Points, normal: Vector) -> list[Vector]:
    """All points of largest n . x."""
    points = [exact(p) for p in points]
    top = max(dot(normal, p) for p in points)
    return [p for p in points if dot(normal, p) == top]


def mixed(points: Sequence[Vector], rng: Random) -> Vector:
    """A convex combination with weights in quarters; one of the points now and then."""
    chosen = [rng.choice(points) for _ in range(rng.choice((1, 2, 4)))]
    total = chosen[0]
    for p in chosen[1:]:
        total = add(total, p)
    return scale(Fraction(1, len(chosen)), total)


def into_contact(a: Points, b: Points, normal: Vector, rng: Random) -> Vector:
    """Translation of b after which a and b touch, b on the side of a to which `normal` points."""
    normal = exact(normal)
    return sub(mixed(furthest(a, normal), rng), mixed(furthest(b, scale(-1, normal)), rng))


def apart(normal: Vector, gap: float) -> list[float]:
    """Along `normal` by `gap`, nearly."""
    largest = max(abs(x) for x in normal)
    floats = [float(x / largest) for x in normal]
    return [gap * x / math.hypot(*floats) for x in floats]


# --------------------------------------------------------------------------------------------------- normals


def facet_normal(points: Points, rng: Random) -> Vector:
    """Outward normal of some facet; any direction if the points are flat."""
    planes = polytope.hull(points).planes
    return rng.choice(planes)[0] if planes else any_normal(rng)


def edge_directions(points: Points) -> list[Vector]:
    """Direction of every edge of a hull with facets."""
    points = [exact(p) for p in points]
    faces = [[p for p in points if dot(n, p) == d] for n, d in polytope.hull(points).planes]
    found = []
    for f, g in combinations(faces, 2):
        shared = [p for p in f if p in g]
        if len(set(shared)) > 1:
            found.append(max((sub(p, shared[0]) for p in shared), key=squared_norm))
    return found


def crossing_normal(a: Points, b: Points, rng: Random, tries: int = 200) -> Vector:
    """A normal across which an edge of a touches an edge of b, if one is found; else across some edge of a."""
    of_a, of_b = edge_directions(a), edge_directions(b)
    normal = facet_normal(a, rng)
    for _ in range(tries if of_a and of_b else 0):
        n = scale(rng.choice((-1, 1)), cross(rng.choice(of_a), rng.choice(of_b)))
        if any(n) and len(furthest(a, n)) == 2:
            normal = n
            if len(furthest(b, scale(-1, n))) == 2:
                return n
    return normal


def any_normal(rng: Random, dimension: int = 3) -> Vector:
    """Small whole numbers, not all zero: vertices touch across most of them."""
    while True:
        n = tuple(Fraction(rng.randint(-9, 9)) for _ in range(dimension))
        if any(n):
            return n


def some_normal(a: Points, b: Points, rng: Random) -> Vector:
    """Normal of a facet of a, of a facet of b, across two edges, or of no feature at all."""
    choice = rng.randrange(4)
    if choice == 0:
        return facet_normal(a, rng)
    if choice == 1:
        return scale(-1, facet_normal(b, rng))
    return crossing_normal(a, b, rng) if choice == 2 else any_normal(rng)


def edge_normal(ring: Points, rng: Random) -> Vector:
    """Outward normal of some edge in the plane; any direction for a point."""
    edges = list(polygon.edges(polygon.hull([exact(p) for p in ring])))
    if not edges:
        return any_normal(rng, 2)
    _, (x, y) = rng.choice(edges)
    return (y, -x)


def some_normal_2d(a: Points, b: Points, rng: Random) -> Vector:
    """Normal of an edge of a, of an edge of b, or of no edge."""
    choice = rng.randrange(3)
    if choice == 0:
        return edge_normal(a, rng)
    return scale(-1, edge_normal(b, rng)) if choice == 1 else any_normal(rng, 2)
