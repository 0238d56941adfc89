# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""First contact of plane bodies that are unions of convex pieces, exactly.

The pieces' own answers are those of `oracle.polygon`; what they share is put together line by line, and a normal is
judged by whole pieces, as a convex one lies on one side of a line through a point of it if it does so near the point.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from oracle.polygon import NEVER, OVERLAPPING, TOUCHING, WILL_TOUCH, Ring, contains, first_contact, hull
from oracle.vectors import Vector, add, cross2, dot, exact, primitive, scale, squared_norm, sub, to_integers


@dataclass(frozen=True)
class UnionContact:
    status: str
    time: Fraction | None = None
    last_time: Fraction | None = None
    parts: bool = True  #: False if they never part
    points: tuple[Vector, ...] = ()  #: of the contact set those that are in no segment
    segments: tuple[tuple[Vector, Vector], ...] = ()  #: as long as can be
    area: Fraction = Fraction(0)  #: twice that of what they share at the start
    normals: tuple[Vector, ...] = ()  #: directions along which they are apart near every contact; fastest approach
    speed_sq: Fraction | None = None  #: closing speed along those, squared with its sign


@dataclass(frozen=True)
class Union:
    """Convex pieces, and the rings around them, each with the inside at its left."""

    pieces: Sequence[Any]
    rings: Sequence[Any]

    def moved(self, by: Vector) -> tuple[list[Ring], list[tuple[Vector, Vector]]]:
        """Pieces and edges, shifted."""
        rings = [[add(x, by) for x in exact(ring)] for ring in self.rings]
        edges = [side for ring in rings for side in zip(ring, ring[1:] + ring[:1], strict=True)]
        return [[add(x, by) for x in hull(exact(piece))] for piece in self.pieces], edges


def contact_of_unions(p: Union, v_p: Any, q: Union, v_q: Any, t_max: Any) -> UnionContact:
    """First contact of two bodies."""
    v_p, v_q = exact(v_p), exact(v_q)
    found = [(exact(a), exact(b), first_contact(a, v_p, b, v_q, t_max)) for a in p.pieces for b in q.pieces]
    hits = [(hull(a), hull(b), answer) for a, b, answer in found if answer.hits]
    if not hits:
        return UnionContact(NEVER)
    time = min(answer.time for *_, answer in hits)
    forever = any(not answer.parts for *_, answer in hits)
    last = None if forever else max(answer.last_time for *_, answer in hits)
    sets = [answer.contact for *_, answer in hits if answer.time == time]
    points, segments = put_together(sets)
    area = sum((_area(ring) for ring in sets), Fraction(0))
    deep = time == 0 and any(answer.status == OVERLAPPING for *_, answer in hits)
    status = WILL_TOUCH if time > 0 else OVERLAPPING if deep else TOUCHING
    normals, speed = (), None
    if not deep:
        places = [*points, *(x for s in segments for x in s)]
        normals, speed = _normals(places, p.moved(scale(time, v_p)), q.moved(scale(time, v_q)), sub(v_p, v_q))
    return UnionContact(status, time, last, not forever, points, segments, area, normals, speed)


def _area(ring: Ring) -> Fraction:
    return sum((Fraction(cross2(a, b)) for a, b in zip(ring, ring[1:] + ring[:1], strict=True)), Fraction(0))


def put_together(sets: Sequence[Ring]) -> tuple[tuple[Vector, ...], tuple[tuple[Vector, Vector], ...]]:
    """Union of points and segments: intervals on every line."""
    lines: dict[Any, list[tuple[Vector, Vector]]] = {}
    for ring in sets:
        if len(ring) == 2:
            low, high = sorted(ring)
            _, ((way,),) = to_integers([sub(high, low)])
            normal = primitive((way[1], -way[0]))
            normal = max(normal, scale(-1, normal))
            lines.setdefault((normal, dot(normal, low)), []).append((low, high))
    segments = []
    for stretches in lines.values():
        stretches.sort()
        low, high = stretches[0]
        for start, end in stretches[1:]:
            if start > high:
                segments.append((low, high))
                low, high = start, end
            high = max(high, end)
        segments.append((low, high))
    lone = {ring[0] for ring in sets if len(ring) == 1}
    lone = {x for x in lone if not any(contains(hull(s), x) for s in segments)}
    return tuple(sorted(lone)), tuple(sorted(segments))


def _normals(places: Sequence[Vector], p: Any, q: Any, w: Vector) -> tuple[tuple[Vector, ...], Fraction | None]:
    near_p, near_q = ([(x, piece) for x in places for piece in pieces if contains(piece, x)] for pieces, _ in (p, q))
    along_p, along_q = (
        [sub(d, c) for c, d in edges for x in places if contains(hull([c, d]), x)] for _, edges in (p, q)
    )
    candidates = {(y, -x) for x, y in along_p} | {(-y, x) for x, y in along_q}
    kept = []
    for x, y in candidates:
        apart = all(dot((x, y), sub(c, at)) <= 0 for at, piece in near_p for c in piece)
        if apart and all(dot((x, y), sub(c, at)) >= 0 for at, piece in near_q for c in piece):
            kept.append((Fraction(dot((x, y), w) * abs(dot((x, y), w))) / squared_norm((x, y)), (x, y)))
    best = max((speed for speed, _ in kept), default=None)
    return tuple(n for speed, n in kept if speed == best), best
