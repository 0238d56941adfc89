# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""Where plane bodies touch that are not convex, and along which normal, by their true edges and exact arithmetic.

When a contact begins is known before, to a proven interval; seams between convex pieces are not seen here, only rings.
With a slack of 0 everything is exact; otherwise points within it are the same, and edges that it cannot tell from
parallel ones are parallel.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import pairwise

import numpy as np

from geomsrv.answers import FloatArray

__all__ = [
    "Moving",
    "Part",
    "Vector",
    "begin",
    "common_normal",
    "common_parts",
    "convex",
    "exactly",
    "inside_parts",
    "nearest",
    "rounded",
    "united",
]

Vector = tuple[Fraction, Fraction]
Part = tuple[Vector, ...]  # a point, or the two ends of a segment
Edge = tuple[Vector, Vector]

# Where an edge is during an interval of time, in float64: a difference of velocities, a product and a sum take
# 3 u of numbers no larger than the size that is meant, twice over; rounded up.
SWEEP_ROUNDING = 16.0 * 2.0**-53
SMALLEST = 2.0**-1070  # more than all that may vanish


@dataclass(frozen=True)
class Moving:
    """Rings, each with the inside at its left, or a segment there and back, or a point; and a velocity."""

    rings: tuple[tuple[Vector, ...], ...]
    velocity: Vector

    @property
    def thin(self) -> bool:
        """Whether it has no inside: it is a segment or a point."""
        return len(self.rings[0]) < 3

    def edges(self) -> list[Edge]:
        """All of them; a point is one that ends where it begins."""
        return [side for ring in self.rings for side in zip(ring, [*ring[1:], *ring[:1]], strict=True)]

    def moved(self, time: Fraction) -> Moving:
        """As it is at a time."""
        dx, dy = (time * v for v in self.velocity)
        return Moving(tuple(tuple((x + dx, y + dy) for x, y in ring) for ring in self.rings), self.velocity)


def exactly(rows: FloatArray) -> tuple[Vector, ...]:
    """Rows (n, 2) as fractions."""
    return tuple((Fraction(x), Fraction(y)) for x, y in rows.tolist())


def convex(rows: FloatArray, velocity: FloatArray) -> Moving:
    """A convex polygon, without vertices that are none (Andrew's monotone chain)."""
    points = sorted(set(exactly(rows)))
    ring: list[Vector] = []
    for way in (points, points[::-1]):
        base = len(ring)
        for p in way:
            while len(ring) >= base + 2 and _turn(ring[-2], ring[-1], p) <= 0:
                ring.pop()
            ring.append(p)
        if len(points) > 1:
            ring.pop()
    return Moving((tuple(ring[: len(points)]),), exactly(velocity[None])[0])


def begin(a: Moving, b: Moving, low: float, high: float) -> tuple[Fraction, list[tuple[Edge, Edge]]] | None:
    """When bodies touch first that are apart before `low` and touch no later than `high`, and the edges that may do so.

    None if they do not; edges are those at the start.
    """
    velocity = _less(a.velocity, b.velocity)
    near = list(_near(a, b, low, high))
    if low == high == 0.0:
        return Fraction(0), near
    opposite = (-velocity[0], -velocity[1])
    times = {
        time
        for e, f in near
        for time in (
            *_hits(e[0], velocity, f),
            *_hits(e[1], velocity, f),
            *_hits(f[0], opposite, e),
            *_hits(f[1], opposite, e),
        )
        if low <= time
    }
    return (min(times), near) if times else None


def _near(a: Moving, b: Moving, low: float, high: float) -> Iterator[tuple[Edge, Edge]]:
    """Pairs of edges that are not surely apart from `low` to `high`."""
    ours, theirs = a.edges(), b.edges()
    with np.errstate(all="ignore"):
        ends = np.array([_floats(e) for e in ours]), np.array([_floats(f) for f in theirs])
        speed = np.array(_floats((a.velocity, b.velocity)))
        way = np.stack([low * (speed[0] - speed[1]), high * (speed[0] - speed[1])])
        size = max(np.abs(ends[0]).max(), np.abs(ends[1]).max()) + np.abs(speed).max() * (high if high else 0.0)
        slack = SWEEP_ROUNDING * size + SMALLEST
        places = np.concatenate([ends[0] + way[0], ends[0] + way[1]], axis=1)
        least, most = places.min(axis=1) - slack, places.max(axis=1) + slack
        # What is no number is not surely apart.
        apart = (most[:, None] < ends[1].min(axis=1)) | (ends[1].max(axis=1) < least[:, None])
    for i, k in np.argwhere(~apart.any(axis=2)).tolist():
        yield ours[i], theirs[k]


def _hits(p: Vector, velocity: Vector, edge: Edge) -> Iterator[Fraction]:
    """When a moving point comes to a closed edge."""
    c, d = edge
    along = _less(d, c)
    rate, gap = _cross(along, velocity), _cross(along, _less(p, c))
    if rate != 0:
        time = -gap / rate
        if _on(c, d, (p[0] + time * velocity[0], p[1] + time * velocity[1])):
            yield time
    elif gap == 0:
        speed = _dot(velocity, velocity)
        for end in edge:
            way = _less(end, p)
            if speed != 0 and _cross(velocity, way) == 0:
                yield _dot(velocity, way) / speed


def common_parts(pairs: Iterable[tuple[Edge, Edge]], way_a: Vector, way_b: Vector) -> list[Part]:
    """What listed edges have in common once they have moved."""
    return [
        part
        for e, f in pairs
        for part in _meeting((_plus(e[0], way_a), _plus(e[1], way_a)), (_plus(f[0], way_b), _plus(f[1], way_b)))
    ]


def _meeting(e: Edge, f: Edge) -> Iterator[Part]:
    (a, b), (c, d) = e, f
    turn = _cross(_less(b, a), _less(d, c))
    if turn != 0:
        part = _cross(_less(c, a), _less(d, c)) / turn
        other = _cross(_less(c, a), _less(b, a)) / turn
        if 0 <= part <= 1 and 0 <= other <= 1:
            yield ((a[0] + part * (b[0] - a[0]), a[1] + part * (b[1] - a[1])),)
        return
    shared = sorted({p for p in e if _on(c, d, p)} | {p for p in f if _on(a, b, p)})
    if shared:
        yield (shared[0],) if len(shared) == 1 else (shared[0], shared[-1])


def inside_parts(body: Moving, thin: Moving) -> tuple[list[Part], bool]:
    """What a segment or point has in common with a body, and whether some of that is inside."""
    p, q = thin.rings[0][0], thin.rings[0][-1]
    way = _less(q, p)
    edges = body.edges()
    marks = {Fraction(0), Fraction(1)} if p != q else {Fraction(0)}
    for edge in edges:
        for part in _meeting((p, q), edge) if p != q else ():
            marks |= {_dot(_less(x, p), way) / _dot(way, way) for x in part}
    at = [(t, (p[0] + t * way[0], p[1] + t * way[1])) for t in sorted(marks)]
    parts: list[Part] = [(x,) for _, x in at if _border(edges, x) or _holds(edges, x)]
    within = p == q and bool(parts) and not _border(edges, p)
    for (_, x), (_, y) in pairwise(at):
        middle = ((x[0] + y[0]) / 2, (x[1] + y[1]) / 2)
        border = _border(edges, middle)
        if border or _holds(edges, middle):
            parts.append((x, y))
            within |= not border
    return united(parts, Fraction(0)), within


def united(parts: Sequence[Part], slack: Fraction) -> list[Part]:
    """Points and longest segments, none in another, sorted."""
    segments: list[Edge] = []
    points: list[Vector] = []
    for part in parts:
        if _reach(part[0], part[-1]) > slack:
            segments.append((part[0], part[-1]))
        else:
            points.append(part[0])
    k = 0
    while k < len(segments):
        for j in range(k):
            whole = _joined(segments[j], segments[k], slack)
            if whole is not None:
                del segments[k]
                segments[j] = whole
                k = 0
                break
        k += 1
    lone: list[Vector] = []
    for p in points:
        if not any(_reach(p, x) <= slack for x in lone) and not any(_beside(s, p, slack) for s in segments):
            lone.append(p)
    return sorted([*((p,) for p in lone), *((min(s), max(s)) for s in segments)])


def _joined(s: Edge, t: Edge, slack: Fraction) -> Edge | None:
    """One segment for two on one line that overlap or adjoin."""
    if _reach(*s) < _reach(*t):
        s, t = t, s
    way = _less(s[1], s[0])
    size = _size(way)
    if any(abs(_cross(way, _less(x, s[0]))) > slack * size for x in t):
        return None
    along = sorted((_dot(way, _less(x, s[0])), x) for x in t)
    if along[0][0] > _dot(way, way) + slack * size or along[1][0] < -slack * size:
        return None
    ends = sorted([*along, (Fraction(0), s[0]), (_dot(way, way), s[1])])
    return ends[0][1], ends[-1][1]


def _beside(s: Edge, p: Vector, slack: Fraction) -> bool:
    """Whether a point is on a segment."""
    way, arm = _less(s[1], s[0]), _less(p, s[0])
    room = slack * _size(way)
    return abs(_cross(way, arm)) <= room and -room <= _dot(way, arm) <= _dot(way, way) + room


def common_normal(parts: Sequence[Part], a: Moving, b: Moving, slack: Fraction) -> Vector | None:
    """Direction from a to b of a line that has, near every point of contact, each body on its own side; None if none.

    Of several it is that along which the bodies approach fastest; if that does not tell, the most clockwise one.  Lines
    along edges are the ones that are looked at.
    """
    places = [p for part in parts for p in part]
    found: Vector | None = None
    corners = [[(body, _around(body, p, slack)) for p in places] for body in (a, b)]
    candidates = {_outward(e) for _, edges in corners[0] for _, e in edges} | {
        _outward((d, c)) for _, edges in corners[1] for _, (c, d) in edges
    }
    velocity = _less(a.velocity, b.velocity)
    for n in candidates - {(Fraction(0), Fraction(0))}:
        opposite = (-n[0], -n[1])
        sides = zip((n, opposite), corners, strict=True)
        if all(
            _below(body, m, edges, p, slack) for m, side in sides for (body, edges), p in zip(side, places, strict=True)
        ) and (found is None or _prefer(n, found, velocity)):
            found = n
    return found


def _prefer(n: Vector, other: Vector, velocity: Vector) -> bool:
    mine, theirs = (_dot(m, velocity) * abs(_dot(m, velocity)) / _dot(m, m) for m in (n, other))
    return mine > theirs or (mine == theirs and _cross(n, other) > 0)


def _around(body: Moving, p: Vector, slack: Fraction) -> list[tuple[bool, Edge]]:
    """Edges through a point, and whether the body is wider than a half plane where the edge begins, at that point."""
    found = []
    for ring in body.rings:
        for k, here in enumerate(ring):
            after = ring[(k + 1) % len(ring)]
            if (
                _reach(here, p) <= slack
                or _reach(after, p) <= slack
                or (here != after and _beside((here, after), p, slack))
            ):
                before = ring[k - 1]
                room = slack * max(_size(_less(here, before)), _size(_less(after, here)))
                found.append((_reach(here, p) <= slack and _turn(before, here, after) < -room, (here, after)))
    return found


def _below(body: Moving, n: Vector, edges: Sequence[tuple[bool, Edge]], p: Vector, slack: Fraction) -> bool:
    """Whether a body lies, near a point of its border, at the lower side of the line through it."""
    room = slack * _size(n)
    for wide, (c, d) in edges:
        heights = [_dot(n, _less(x, p)) for x in (c, d)]
        if wide or max(heights) > room:
            return False
        if min(heights) >= -room and not body.thin and _dot(n, _outward((c, d))) <= 0:
            return False
    return True


def nearest(value: Fraction) -> float:
    """The nearest double, or an infinity beyond them."""
    try:
        return value.numerator / value.denominator
    except OverflowError:
        return math.inf if value > 0 else -math.inf


def rounded(direction: Vector) -> tuple[float, float]:
    """The unit vector along a direction, its parts correctly rounded."""
    square = _dot(direction, direction)
    x, y = (_root(v * v / square) * (1 if v >= 0 else -1) for v in direction)
    return x, y


# Bits of a root beyond those of a double, so that a rest below them tells which way to round.
ROOT_BITS = 64


def _root(square: Fraction) -> float:
    """The square root, correctly rounded."""
    if square == 0:
        return 0.0
    shift = max(0, ROOT_BITS + (square.denominator.bit_length() - square.numerator.bit_length()) // 2 + 1)
    whole, rest = divmod(square.numerator << 2 * shift, square.denominator)
    root = math.isqrt(whole)
    return nearest(Fraction(2 * root + bool(rest or root * root != whole), 2 << shift))


def _floats(vectors: Sequence[Vector]) -> list[tuple[float, float]]:
    return [(nearest(x), nearest(y)) for x, y in vectors]


def _less(p: Vector, q: Vector) -> Vector:
    return p[0] - q[0], p[1] - q[1]


def _plus(p: Vector, q: Vector) -> Vector:
    return p[0] + q[0], p[1] + q[1]


def _dot(p: Vector, q: Vector) -> Fraction:
    return p[0] * q[0] + p[1] * q[1]


def _cross(p: Vector, q: Vector) -> Fraction:
    return p[0] * q[1] - p[1] * q[0]


def _turn(a: Vector, b: Vector, c: Vector) -> Fraction:
    return _cross(_less(b, a), _less(c, b))


def _size(v: Vector) -> Fraction:
    """Not less than its length, nor than that times the root of 2 more."""
    return abs(v[0]) + abs(v[1])


def _reach(p: Vector, q: Vector) -> Fraction:
    return max(abs(p[0] - q[0]), abs(p[1] - q[1]))


def _outward(edge: Edge) -> Vector:
    way = _less(edge[1], edge[0])
    return way[1], -way[0]


def _on(c: Vector, d: Vector, p: Vector) -> bool:
    within = min(c[0], d[0]) <= p[0] <= max(c[0], d[0]) and min(c[1], d[1]) <= p[1] <= max(c[1], d[1])
    return within and _cross(_less(d, c), _less(p, c)) == 0


def _border(edges: Sequence[Edge], p: Vector) -> bool:
    return any(_on(c, d, p) for c, d in edges)


def _holds(edges: Sequence[Edge], p: Vector) -> bool:
    """Whether a point that is not on the border is inside."""
    crossings = [
        (_cross(_less(d, c), _less(p, c)) > 0) == (d[1] > c[1]) for c, d in edges if (c[1] > p[1]) != (d[1] > p[1])
    ]
    return sum(crossings) % 2 == 1
