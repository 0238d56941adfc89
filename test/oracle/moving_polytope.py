# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""Convex hulls of points in space that translate, exactly: first and last contact, and the set they share then.

P + t v_P meets Q + t v_Q iff the ray t (v_Q - v_P) is in the Minkowski difference P - Q; the half spaces of that
difference clip the ray.  What the bodies share is P, clipped by the half spaces of Q.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from fractions import Fraction
from typing import Any

from oracle import polygon, polytope
from oracle.polygon import NEVER, OVERLAPPING, TOUCHING, WILL_TOUCH, FirstContact
from oracle.vectors import (
    Constraint,
    Vector,
    add,
    clip_ray,
    cross,
    dot,
    exact,
    primitive,
    scale,
    squared_norm,
    sub,
    to_integers,
)


def constraints(points: Sequence[Vector]) -> list[Constraint]:
    """(n, d) with n . x <= d for exactly the points of the hull, of whatever dimension; n is primitive."""
    body = polytope.hull(points)
    if body.dimension == 3:
        return [(n, Fraction(d)) for n, d in body.planes]
    factor, (whole,) = to_integers([exact(p) for p in points])
    whole = list(dict.fromkeys(whole))
    normals = list(_flat_normals(whole))
    return [(n, Fraction(max(dot(n, p) for p in whole), factor)) for n in normals]


def _flat_normals(points: Sequence[Vector]) -> Iterator[Vector]:
    """Outward normals that bound a polygon, a segment or a point in space."""
    axes = [(1, 0, 0), (0, 1, 0), (0, 0, 1)]
    base = points[0]
    arms = [sub(p, base) for p in points[1:]]
    arm = next((a for a in arms if any(a)), None)
    if arm is None:
        across = axes
    else:
        normal = next((n for n in (cross(arm, a) for a in arms) if any(n)), None)
        if normal is None:
            across = [primitive(n) for n in (cross(arm, axis) for axis in axes) if any(n)]
            yield from (primitive(arm), primitive(scale(-1, arm)))
        else:
            across = [primitive(normal)]
            kept = [k for k in range(3) if k != max(range(3), key=lambda k: abs(normal[k]))]
            ring = polygon.hull([tuple(p[k] for k in kept) for p in points])
            lifted = {tuple(p[k] for k in kept): p for p in points}
            corners = [lifted[p] for p in ring]
            for start, end in zip(corners, corners[1:] + corners[:1], strict=True):
                side = primitive(cross(sub(end, start), normal))
                inward = any(dot(side, p) > dot(side, start) for p in points)
                yield scale(-1, side) if inward else side
    for n in across:
        yield n
        yield scale(-1, n)


def difference(p: Sequence[Vector], q: Sequence[Vector]) -> list[Vector]:
    """Points whose hull is P - Q."""
    return list(dict.fromkeys(sub(x, y) for x in polytope.hull_points(p) for y in polytope.hull_points(q)))


def intersection(p: Sequence[Vector], q: Sequence[Vector]) -> list[Vector]:
    """Vertices of P intersected with Q, sorted; empty if they are apart.

    Every clipped segment between two points of P is in P, so cutting all of them loses no vertex; what is not one
    has tight constraints of rank less than 3.
    """
    tight, clipping = constraints(p), constraints(q)
    points = [exact(x) for x in dict.fromkeys(map(tuple, p))]
    points = _extreme(points, tight)
    for normal, offset in clipping:
        heights = [dot(normal, x) - offset for x in points]
        inside = [x for x, h in zip(points, heights, strict=True) if h <= 0]
        crossings = [
            add(x, scale(Fraction(g) / (g - h), sub(y, x)))
            for x, g in zip(points, heights, strict=True)
            if g < 0
            for y, h in zip(points, heights, strict=True)
            if h > 0
        ]
        tight = [*tight, (normal, offset)]
        points = _extreme(list(dict.fromkeys([*inside, *crossings])), tight)
    return sorted(points)


def _extreme(points: Sequence[Vector], bounds: Sequence[Constraint]) -> list[Vector]:
    """Those whose tight constraints have rank 3."""
    return [x for x in points if rank([n for n, d in bounds if dot(n, x) == d]) == 3]


def rank(vectors: Sequence[Vector]) -> int:
    """Dimension of the span."""
    first = next((v for v in vectors if any(v)), None)
    if first is None:
        return 0
    normal = next((n for n in (cross(first, v) for v in vectors) if any(n)), None)
    if normal is None:
        return 1
    return 3 if any(dot(normal, v) != 0 for v in vectors) else 2


def dimension(points: Sequence[Vector]) -> int | None:
    """Dimension of the hull; None if empty."""
    return rank([sub(p, points[0]) for p in points[1:]]) if points else None


def first_contact(
    p: Any, velocity_p: Any, q: Any, velocity_q: Any, t_max: Any, *, contact: bool = True
) -> FirstContact:
    """First and last time at which P + t v_P and Q + t v_Q have a common point; t_max may be math.inf."""
    p, q, v_p, v_q = [exact(x) for x in p], [exact(x) for x in q], exact(velocity_p), exact(velocity_q)
    end = None if t_max == float("inf") else exact(t_max)
    bounds, ray = constraints(difference(p, q)), sub(v_q, v_p)
    start = _start(bounds)
    span = clip_ray(bounds, ray)
    if span is None or (end is not None and span[0] > end):
        return FirstContact(NEVER, None, None, True, [], None, start)
    first, last = span
    last = end if last is None else last if end is None else min(last, end)
    if first > 0:
        status = WILL_TOUCH
    else:
        status = OVERLAPPING if start < 0 else TOUCHING
    moved = [[add(x, scale(first, v)) for x in body] for body, v in ((p, v_p), (q, v_q))]
    shared = intersection(*moved) if contact else []
    speed = None if first == 0 else max(_speeds(bounds, ray, first))
    return FirstContact(status, first, last, last is not None, shared, speed, start)


def _start(bounds: Sequence[Constraint]) -> Fraction:
    """> 0 apart, 0 touching (or no interior), minus the squared depth if overlapping.  Apart, it is no distance."""
    return max(Fraction(-offset * abs(offset)) / squared_norm(normal) for normal, offset in bounds)


def _speeds(bounds: Sequence[Constraint], ray: Vector, time: Fraction) -> Iterator[Fraction]:
    """Squared closing speeds of the constraints that close at `time`."""
    for n, d in bounds:
        if dot(n, ray) < 0 and d / dot(n, ray) == time:
            yield Fraction(dot(n, ray) ** 2) / squared_norm(n)
