# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""Convex hulls of points in space, exactly: facets, distance, penetration depth, witnesses.

Distance: least-norm point of the Minkowski difference a - b (Wolfe, "Finding the nearest point in a
polytope", 1976), whose exact form ends after finitely many steps.  Depth: least offset over the facets of
that difference, found by an incremental hull.  Neither lists separating axes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import combinations
from typing import Any

from oracle import polygon
from oracle.vectors import Vector, add, cross, dot, exact, primitive, scale, squared_norm, sub, to_integers


def box_corners(center: Any, axes: Any, half_extents: Any) -> list[Vector]:
    """The eight literal points center +- e_i * axes_i."""
    corners = [exact(center)]
    for axis, half in zip(exact(axes), exact(half_extents), strict=True):
        arm = scale(half, axis)
        corners = [sub(p, arm) for p in corners] + [add(p, arm) for p in corners]
    return corners


def frustum_corners(origin: Any, axes: Any, bounds: Any, near: Any, far: Any) -> list[Vector]:
    """The literal points origin + t (x L + y U + near D), t = 1 and far / near; `bounds` is l0 l1 u0 u1."""
    origin, (left, up, view), (l0, l1, u0, u1) = exact(origin), exact(axes), exact(bounds)
    near, far = exact(near), exact(far)
    window = [add(add(scale(x, left), scale(y, up)), scale(near, view)) for y in (u0, u1) for x in (l0, l1)]
    return [add(origin, scale(t, corner)) for t in (Fraction(1), far / near) for corner in window]


# ------------------------------------------------------------------------------------------------------ hull


@dataclass(frozen=True)
class Hull:
    """Facets of a convex hull; for fewer than three dimensions `planes` is empty."""

    dimension: int
    planes: tuple[tuple[Vector, Any], ...]  #: (n, d): n . x <= d with primitive integer outward n


def hull(points: Sequence[Vector]) -> Hull:
    """Convex hull by insertion.  Exact signs make coplanar and repeated points harmless.

    A point is inserted where it lies strictly above some facets.  Those form a disk (they are what one sees
    from the point moved slightly inwards), and no new triangle has area zero: were the point on the line of
    a horizon edge, it would lie in the planes of both facets at that edge, strictly above neither.
    """
    factor, (whole,) = to_integers([exact(p) for p in points])
    whole = list(dict.fromkeys(whole))
    start = _independent(whole)
    if len(start) < 4:
        return Hull(len(start) - 1, ())
    inside = tuple(sum(p[k] for p in start) for k in range(3))  # four times an interior point
    facets: dict[tuple[int, int, int], tuple[Vector, int]] = {}

    def insert(i: int, j: int, k: int) -> None:
        """Triangle i j k, turned outwards, with its plane."""
        a, b, c = whole[i], whole[j], whole[k]
        normal = primitive(cross(sub(b, a), sub(c, a)))
        offset = dot(normal, a)
        if dot(normal, inside) > 4 * offset:
            i, j, normal, offset = j, i, scale(-1, normal), -offset
        facets[i, j, k] = normal, offset

    index = {p: i for i, p in enumerate(whole)}
    for triangle in combinations([index[p] for p in start], 3):
        insert(*triangle)
    for i, point in enumerate(whole):
        visible = [t for t, (normal, offset) in facets.items() if dot(normal, point) > offset]
        if not visible:
            continue
        edges = {edge for a, b, c in visible for edge in ((a, b), (b, c), (c, a))}
        for triangle in visible:
            del facets[triangle]
        for a, b in edges:
            if (b, a) not in edges:
                insert(a, b, i)
    return Hull(3, tuple((normal, Fraction(offset, factor)) for normal, offset in dict.fromkeys(facets.values())))


def _independent(points: Sequence[Vector]) -> list[Vector]:
    """Up to four affinely independent points; 1 + dimension of them."""
    found = [points[0]]
    normal: Vector | None = None
    for p in points[1:]:
        arm = sub(p, found[0])
        if len(found) == 1 and any(arm):
            found.append(p)
        elif len(found) == 2 and any(normal := cross(sub(found[1], found[0]), arm)):
            found.append(p)
        elif len(found) == 3 and dot(normal or (), arm) != 0:
            return [*found, p]
    return found


# --------------------------------------------------------------------------------------------------- queries


@dataclass(frozen=True)
class Separation:
    """How two closed hulls lie: `signed_square` is the squared distance, or minus the squared depth."""

    signed_square: Fraction
    point_a: Vector  #: a nearest point on a; a common point if they intersect
    point_b: Vector

    @property
    def intersects(self) -> bool:
        return self.signed_square <= 0

    @property
    def relation(self) -> str:
        return "disjoint" if self.signed_square > 0 else "overlapping" if self.signed_square < 0 else "touching"


def nearest(a: Sequence[Vector], b: Sequence[Vector]) -> tuple[Vector, Vector]:
    """A nearest pair of the hulls of `a` and `b`; equal points if they intersect.

    Repeats: v is the least-norm point of a small simplex of vertices of a - b; the vertex furthest along -v
    either proves v optimal or joins the simplex.  |v| falls strictly, so no simplex comes back and it ends.
    """
    factor, (whole_a, whole_b) = to_integers([exact(p) for p in a], [exact(p) for p in b])
    simplex = [(whole_a[0], whole_b[0])]
    while True:
        weights, total, simplex = _least_norm(simplex)
        v = _combine(weights, [sub(p, q) for p, q in simplex])  # times total > 0
        p = min(whole_a, key=lambda x: dot(x, v))
        q = max(whole_b, key=lambda x: dot(x, v))
        # v is optimal if no vertex of a - b lies further along -v than v itself.
        if dot(sub(p, q), v) * total >= squared_norm(v):
            pair = (_combine(weights, [x for x, _ in simplex]), _combine(weights, [y for _, y in simplex]))
            return tuple(tuple(Fraction(x, total * factor) for x in end) for end in pair)  # type: ignore[return-value]
        simplex = [*simplex, (p, q)]


def _combine(weights: Sequence[int], points: Sequence[Vector]) -> Vector:
    return tuple(sum(w * p[k] for w, p in zip(weights, points, strict=True)) for k in range(3))


def _least_norm(simplex: list[tuple[Vector, Vector]]) -> tuple[list[int], int, list[tuple[Vector, Vector]]]:
    """Least-norm point of up to five points p - q: integer weights > 0, their sum, and their points.

    Every subset is tried: the least-norm point of its affine hull counts if all weights are positive.
    """
    best: tuple[Fraction, list[int], int, list[tuple[Vector, Vector]]] | None = None
    for size in range(1, min(4, len(simplex)) + 1):
        for subset in combinations(simplex, size):
            solved = _affine_least_norm([sub(p, q) for p, q in subset])
            if solved is None:
                continue
            weights, total = solved
            if min(weights) <= 0:
                continue
            norm = Fraction(squared_norm(_combine(weights, [sub(p, q) for p, q in subset])), total * total)
            if best is None or norm < best[0]:
                best = norm, weights, total, list(subset)
    assert best is not None  # single points always count
    return best[1:]


def _affine_least_norm(points: Sequence[Vector]) -> tuple[list[int], int] | None:
    """Weights (w, sum) of the least-norm point of the affine hull; None if the points are affinely dependent.

    Normal equations in the arms d_i = p_i - p_0: (d_i . d_j) w_j = -d_i . p_0, by Cramer's rule in ints.
    """
    base, arms = points[0], [sub(p, points[0]) for p in points[1:]]
    gram = [[dot(x, y) for y in arms] for x in arms]
    total = _determinant(gram)
    if total == 0:
        return None
    right = [-dot(x, base) for x in arms]
    weights = [
        _determinant([[right[i] if j == column else gram[i][j] for j in range(len(arms))] for i in range(len(arms))])
        for column in range(len(arms))
    ]
    return [total - sum(weights), *weights], total


def _determinant(m: Sequence[Sequence[int]]) -> int:
    if not m:
        return 1
    if len(m) == 1:
        return m[0][0]
    if len(m) == 2:
        return m[0][0] * m[1][1] - m[0][1] * m[1][0]
    return dot(m[0], cross(tuple(m[1]), tuple(m[2])))


def squared_distance(a: Sequence[Vector], b: Sequence[Vector]) -> Fraction:
    """Squared distance of the hulls; 0 if they intersect."""
    return Fraction(squared_norm(sub(*nearest(a, b))))


def intersects(a: Sequence[Vector], b: Sequence[Vector]) -> bool:
    """Whether the closed hulls have a common point."""
    return squared_distance(a, b) == 0


def separation(a: Sequence[Vector], b: Sequence[Vector]) -> Separation:
    """Squared distance, or minus the squared length of the least translation that parts the hulls."""
    a, b = [exact(p) for p in a], [exact(p) for p in b]
    point_a, point_b = nearest(a, b)
    square = Fraction(squared_norm(sub(point_a, point_b)))
    if square == 0:
        # The difference of hulls is the hull of differences; flat, or the origin on a facet: depth 0.
        difference = hull([sub(p, q) for p in hull_points(a) for q in hull_points(b)])
        depths = [d * d / squared_norm(n) for n, d in difference.planes]
        square = -min(depths, default=Fraction(0))
    return Separation(Fraction(square), point_a, point_b)


def hull_points(points: Sequence[Vector]) -> list[Vector]:
    """The points without repeats and without those strictly inside; flat sets come back without repeats."""
    points = list(dict.fromkeys(exact(p) for p in points))
    planes = hull(points).planes
    if not planes:
        return points
    return [p for p in points if any(dot(n, p) == d for n, d in planes)]


def contains(points: Sequence[Vector], x: Vector) -> bool:
    """Whether the closed hull of `points` contains x."""
    return intersects(points, [x])


def nearest_set_dimension(a: Sequence[Vector], b: Sequence[Vector]) -> int | None:
    """Dimension of the set of points of a nearest to b, 0 if there is one; None if the hulls intersect."""
    a, b = [exact(p) for p in a], [exact(p) for p in b]
    point_a, point_b = nearest(a, b)
    v = sub(point_b, point_a)
    if not any(v):
        return None
    # Both support sets lie in planes across v; moved together, they meet in the nearest points of a.
    top, bottom = max(dot(p, v) for p in a), min(dot(q, v) for q in b)
    dropped = max(range(3), key=lambda k: abs(v[k]))  # along this axis the plane projects one to one
    faces = [
        [tuple(p[k] for k in range(3) if k != dropped) for p in side]
        for side in ([p for p in a if dot(p, v) == top], [sub(q, v) for q in b if dot(q, v) == bottom])
    ]
    return polygon.dimension(polygon.intersection(*faces))
