# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""Convex polygons in the plane, exactly: distance, depth, intersection, and first contact under translation.

A polygon is the hull of its listed points, so repeated and collinear vertices, segments and points need no
care.  Motion: P + t v_P meets Q + t v_Q iff the ray t (v_Q - v_P) is in the Minkowski difference P - Q; the
hull of that difference clips the ray.  The engine's projections on edge normals are nowhere used.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from oracle.vectors import Constraint, Vector, add, clip_ray, cross2, dot, exact, scale, squared_norm, sub, to_integers

Ring = list[Vector]

NEVER, WILL_TOUCH, TOUCHING, OVERLAPPING = "NEVER", "WILL_TOUCH", "TOUCHING", "OVERLAPPING"


def hull(points: Sequence[Vector]) -> Ring:
    """Strictly convex counter-clockwise ring (Andrew's monotone chain); one or two points if flat."""
    factor, (whole,) = to_integers([exact(p) for p in points])
    ordered = sorted(set(whole))
    if len(ordered) > 2:
        lower, upper = _chain(ordered), _chain(ordered[::-1])
        ordered = lower[:-1] + upper[:-1]
    return [tuple(Fraction(x, factor) for x in p) for p in ordered]


def _chain(points: Sequence[Vector]) -> Ring:
    chain: Ring = []
    for p in points:
        while len(chain) > 1 and cross2(sub(chain[-1], chain[-2]), sub(p, chain[-2])) <= 0:
            chain.pop()
        chain.append(p)
    return chain


def difference(p: Sequence[Vector], q: Sequence[Vector]) -> Ring:
    """Minkowski difference P - Q as a ring."""
    factor, (whole_p, whole_q) = to_integers(hull(p), hull(q))
    ring = hull([sub(x, y) for x in whole_p for y in whole_q])
    return [scale(Fraction(1, factor), x) for x in ring]


def edges(ring: Ring) -> Iterator[tuple[Vector, Vector]]:
    """(start, direction) of every edge; a segment has two, there and back, a point has none."""
    if len(ring) > 1:
        for start, end in zip(ring, ring[1:] + ring[:1], strict=True):
            yield start, sub(end, start)


def dimension(ring: Ring) -> int | None:
    """2 polygon, 1 segment, 0 point; None if empty.  `ring` is a `hull`."""
    return min(len(ring), 3) - 1 if ring else None


def contains(ring: Ring, x: Vector) -> bool:
    """Whether the closed polygon contains x.  `ring` is a `hull`."""
    if len(ring) > 2:
        return all(cross2(d, sub(x, s)) >= 0 for s, d in edges(ring))
    return _nearest_on_ring(ring, x) == tuple(x)


def _nearest_on_ring(ring: Ring, x: Vector) -> Vector:
    """Point of the boundary nearest to x."""
    candidates = list(ring)
    for start, d in edges(ring):
        t = Fraction(dot(sub(x, start), d)) / squared_norm(d)
        if 0 < t < 1:
            candidates.append(add(start, scale(t, d)))
    return min(candidates, key=lambda p: squared_norm(sub(p, x)))


def intersection(p: Sequence[Vector], q: Sequence[Vector]) -> Ring:
    """P intersected with Q as a ring, empty if they are apart.

    Its corners are corners of one inside the other, and crossings of two edges that are not parallel.
    """
    factor, (p, q) = to_integers(hull(p), hull(q))
    corners = [x for x in p if contains(q, x)] + [x for x in q if contains(p, x)]
    for s, d in edges(p):
        for r, e in edges(q):
            turn = cross2(d, e)
            if turn == 0:
                continue
            gap, sign = sub(r, s), (1 if turn > 0 else -1)
            along = cross2(gap, e)
            if 0 <= along * sign <= abs(turn) and 0 <= cross2(gap, d) * sign <= abs(turn):
                corners.append(add(s, scale(Fraction(along, turn), d)))
    return [scale(Fraction(1, factor), x) for x in hull(corners)] if corners else []


# --------------------------------------------------------------------------------------------------- at rest


@dataclass(frozen=True)
class Separation:
    """How two closed polygons lie: `signed_square` is the squared distance, or minus the squared depth."""

    signed_square: Fraction
    gap: Vector  #: nearest point on P minus nearest point on Q; zero if they intersect

    @property
    def intersects(self) -> bool:
        return self.signed_square <= 0

    @property
    def relation(self) -> str:
        return "disjoint" if self.signed_square > 0 else "overlapping" if self.signed_square < 0 else "touching"


def separation(p: Sequence[Vector], q: Sequence[Vector]) -> Separation:
    """Squared distance, or minus the squared length of the least translation that parts the polygons."""
    return _origin_separation(difference(p, q))


def _origin_separation(ring: Ring) -> Separation:
    origin = (Fraction(0), Fraction(0))
    if not contains(ring, origin):
        gap = _nearest_on_ring(ring, origin)
        return Separation(Fraction(squared_norm(gap)), gap)
    if len(ring) < 3:
        return Separation(Fraction(0), origin)
    depth = min(cross2(d, sub(origin, s)) ** 2 / squared_norm(d) for s, d in edges(ring))
    return Separation(-Fraction(depth), origin)


def nearest_set(p: Sequence[Vector], q: Sequence[Vector]) -> Ring:
    """The points of P nearest to Q, all of them: a point or a segment; the intersection if they intersect."""
    gap = separation(p, q).gap
    return intersection(p, [add(x, gap) for x in hull(q)])


# ---------------------------------------------------------------------------------------------------- moving


@dataclass(frozen=True)
class FirstContact:
    """Outcome within [0, t_max]; times are None for NEVER, `last_time` is None also if they never part."""

    status: str
    time: Fraction | None
    last_time: Fraction | None
    parts: bool  #: False if the contact lasts for ever (t_max infinite, no relative motion)
    contact: Ring  #: the intersection at `time`
    normal_speed_sq: Fraction | None  #: squared closing speed of the constraint that closes last; None at time 0
    separation_sq: Fraction  #: at t = 0

    @property
    def hits(self) -> bool:
        return self.time is not None


def first_contact(p: Any, velocity_p: Any, q: Any, velocity_q: Any, t_max: Any) -> FirstContact:
    """First and last time at which P + t v_P and Q + t v_Q have a common point; t_max may be math.inf."""
    p, q, v_p, v_q = exact(p), exact(q), exact(velocity_p), exact(velocity_q)
    end = None if t_max == float("inf") else exact(t_max)
    ring, ray = difference(p, q), sub(v_q, v_p)
    start = _origin_separation(ring)
    span = clip_ray(constraints(ring), ray)
    if span is None or (end is not None and span[0] > end):
        return FirstContact(NEVER, None, None, True, [], None, start.signed_square)
    first, last = span
    last = end if last is None else last if end is None else min(last, end)
    contact = intersection([add(x, scale(first, v_p)) for x in hull(p)], [add(x, scale(first, v_q)) for x in hull(q)])
    if first > 0:
        status = WILL_TOUCH
    else:
        status = OVERLAPPING if start.relation == "overlapping" else TOUCHING
    speed = None if first == 0 else _closing_speed_sq(ring, ray, first)
    return FirstContact(status, first, last, last is not None, contact, speed, start.signed_square)


def constraints(ring: Ring) -> Iterator[Constraint]:
    """(n, d) with n . x <= d for exactly the points of the ring; a point is bounded along both axes."""
    if len(ring) == 1:
        for n in ((1, 0), (0, 1), (-1, 0), (0, -1)):
            yield n, Fraction(dot(n, ring[0]))
        return
    for start, (x, y) in edges(ring):
        outward = (y, -x)
        yield outward, Fraction(dot(outward, start))
    if len(ring) == 2:
        for start, end in (ring, ring[::-1]):
            yield sub(end, start), Fraction(dot(sub(end, start), end))


def _closing_speed_sq(ring: Ring, ray: Vector, time: Fraction) -> Fraction:
    """Largest squared closing speed among the constraints that close at `time`."""
    return max(
        Fraction(dot(n, ray) ** 2) / squared_norm(n)
        for n, d in constraints(ring)
        if dot(n, ray) < 0 and d / dot(n, ray) == time
    )
