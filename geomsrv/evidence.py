# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""Evidence for records: exact searches in the checker's own arithmetic, made when a record is read.

They begin where the engine ended, if it tells; then there is next to nothing left to search.  Nothing here has to be
trusted: `geomsrv.verify` judges what is found.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from fractions import Fraction
from itertools import combinations
from typing import Any

from geomsrv.verify import (
    ROOM,
    Pair,
    Vector,
    aside,
    clip_of,
    clips_of,
    dot,
    in_units,
    nearest,
    normals_to,
    relative_velocity,
    sum_of,
    time_of,
    unit_of,
    way_of,
)

__all__ = ["evidence_of_contact", "evidence_of_distance"]

Record = dict[str, Any]
Pairs = list[list[int]]

MOST = 12  #: vertices of each body that are tried for a facet; any three of a larger one will do

# How near to a contact its surroundings are looked at, as powers of two of the size: where no feature is smaller, all
# that is nearest from there has part in it.  Any of them may do; the first nearly always does.
NEARBY = (-60, -200, -30, -8)
MOST_STEPS = 40  #: towards a contact, each as far as the bodies can surely move
LONGEST = math.ldexp(1.0, 1000)  #: size of what is larger
TINY = math.ldexp(1.0, -900)  #: a time of which doubles do not hold all digits


def evidence_of_distance(a: Record, b: Record, start: Pairs, normal: list[float] | None = None) -> Record:
    """Of a distance; of bodies that meet also along which direction, near `normal`, they overlap by so much at most."""
    pair = Pair(a, b)
    evidence: Record = {"simplex": _simplex(pair.a, pair.b, start)}
    if normal is not None and not any(nearest(pair.differences(evidence["simplex"]))[0]):
        evidence["directions"] = [normal]
        evidence["facet"] = _facet(pair, in_units(normal, unit_of(normal)))
    return evidence


def evidence_of_contact(
    a: Record, b: Record, status: str, t_max: float, *, begin: float = 0.0, normal: list[float] | None = None
) -> Record:
    """Of when bodies first touch, or that they never do; nothing if that is not so.

    In space it is sought from the time `begin`, a little before they touch, or beside a contact with that normal.
    """
    pair = Pair(a, b)
    speed = relative_velocity(a, b, pair.unit)
    if len(speed) == 3:
        return _in_space(pair, speed, status, t_max, begin, normal)
    if status == "OVERLAPPING":
        return {"around": _around(pair)}
    latest, named = Fraction(0), Record()
    for ways in (_edges(pair), _chords(pair)):
        for way in ways:
            clips = clips_of(pair, speed, way)
            if status == "NEVER" and any(gap > 0 and (time is None or time > t_max) for gap, time in clips):
                return way
            time = max((time for _, time in clips if time is not None), default=latest)
            if time > latest if status == "WILL_TOUCH" else any(gap == 0 for gap, _ in clips):
                latest, named = time, way
        moved = pair.moved(speed, latest if status == "WILL_TOUCH" else Fraction(0))
        simplex = _simplex(moved.a, moved.b, [])
        if not any(nearest(moved.differences(simplex))[0]):
            break
    return named | {"simplex": simplex}


def _edges(pair: Pair) -> Iterator[Record]:
    """No facet, then those of both rings; of points, a point."""
    yield {}
    yield from ({"facet": [[i, 0], [(i + 1) % len(pair.a), 0]]} for i in range(len(pair.a)))
    yield from ({"facet": [[0, j], [0, (j + 1) % len(pair.b)]]} for j in range(len(pair.b)))


def _chords(pair: Pair) -> Iterator[Record]:
    """Between any two vertices: rings may be dented by rounding, and then an edge of the hull is none of the ring."""
    yield from ({"facet": [[i, 0], [k, 0]]} for i, k in combinations(range(len(pair.a)), 2))
    yield from ({"facet": [[0, j], [0, k]]} for j, k in combinations(range(len(pair.b)), 2))


def _around(pair: Pair) -> Pairs:
    """Differences around the origin, each the one that lies farthest to the left as seen from the one before."""
    pairs: Pairs = []
    n, turned = [1, 0], [0, 0]
    while len(pairs) <= len(pair.a) + len(pair.b):  # so many edges has b - a
        i = min(range(len(pair.a)), key=lambda k: dot(n, pair.a[k]))
        j = max(range(len(pair.b)), key=lambda k: dot(n, pair.b[k]))
        x, y = sum_of(pair.b[j], -1, pair.a[i])
        n = [-y, x]
        pairs.append([i, j])
        if len(pairs) == 1:
            turned = n
        elif dot(turned, [x, y]) < 0:  # the first one is to the left of this one
            break
    return pairs


def _in_space(pair: Pair, speed: Vector, status: str, t_max: float, begin: float, normal: list[float] | None) -> Record:
    """Evidence for solids: every direction is the shortest way between the bodies where they have no common point."""
    if status == "OVERLAPPING":
        return _room(pair)
    if status == "NEVER":
        ends = [0.0] if math.isinf(t_max) else [0.0, t_max]
        ways: list[Record] = [{"at": [time], "apart": _simplex_at(pair, speed, Fraction(time))} for time in ends]
        for way in (*ways, {"across": _across(pair, speed)}):
            gap, closed = clip_of(pair, speed, way_of(pair, speed, way))
            if gap > 0 and (closed is None or closed > t_max):
                return way
        return {}
    found = _beside(pair, normal) if status == "TOUCHING" else _before(pair, speed, begin)
    if found is None:
        return {}
    way, time = found
    return way | {"simplex": _simplex_at(pair, speed, time)}


def _simplex_at(pair: Pair, speed: Vector, time: Fraction) -> Pairs:
    moved = pair.moved(speed, time)
    return _simplex(moved.a, moved.b, [])


def _across(pair: Pair, speed: Vector) -> Pairs:
    """As seen along the velocity."""
    square = dot(speed, speed)
    flat_a, flat_b = (
        [sum_of([square * x for x in v], -dot(v, speed), speed) for v in side] for side in (pair.a, pair.b)
    )
    return _simplex(flat_a, flat_b, [])


def _before(pair: Pair, speed: Vector, begin: float) -> tuple[Record, Fraction] | None:
    """When they touch, and a way that closes just then: shortly before, the shortest one is such a way."""
    start = {"at": [0.0]}
    when: Record = {"at": [begin, -math.ldexp(begin, NEARBY[0])]} if begin > TINY else start
    for _ in range(MOST_STEPS):
        way = when | {"apart": _simplex_at(pair, speed, time_of(when))}
        gap, time = clip_of(pair, speed, way_of(pair, speed, way))
        if gap > 0 and time is not None:
            if not any(nearest(pair.moved(speed, time).differences(_simplex_at(pair, speed, time)))[0]):
                return way, time
            when = _below(time)  # the bodies cannot meet sooner: nearer to contact than the last time
        elif when is start:
            return None
        else:
            when = start
    return None


def _below(time: Fraction) -> Record:
    """Two floats whose sum, times a power of two if it is tiny, is a little less."""
    exponent = 0 if time > TINY else time.numerator.bit_length() - time.denominator.bit_length()
    time *= Fraction(2) ** -exponent
    first = float(time)
    at = [first, math.nextafter(float(time - Fraction(first)), -math.inf)]
    return {"at": at, "exponent": exponent} if exponent else {"at": at}


def _beside(pair: Pair, normal: list[float] | None) -> tuple[Record, Fraction] | None:
    """A way along which there is no room: the shortest one where b is moved off a little, along the normal."""
    ways = [[float(sign * x) for x in corner] for corner in ROOM for sign in (1, -1)]
    for power in NEARBY:
        step = math.ldexp(_size(pair), power)
        for n in ways if normal is None else [normal, *ways]:
            off = [step * x for x in n]
            moved = aside(pair, off)
            way: Record = {"aside": off, "apart": _simplex(moved.a, moved.b, [])}
            direction = way_of(pair, speed=[0, 0, 0], evidence=way)
            if any(direction) and pair.gap(direction) == 0:
                return way, Fraction(0)
    return None


def _size(pair: Pair) -> float:
    """How far apart vertices are, at the most, in any coordinate; 1 if all are in one place."""
    spread = max(abs(x - y) for v in (*pair.a, *pair.b) for x, y in zip(v, pair.a[0], strict=True))
    return float(min(Fraction(spread, pair.scale), Fraction(LONGEST))) if spread else 1.0


def _room(pair: Pair) -> Record:
    """How far b may move towards either of four corners around it and still have points in common with a."""
    for power in sorted(NEARBY, reverse=True):
        room = math.ldexp(_size(pair), power)
        moved = [aside(pair, [room * x for x in corner]) for corner in ROOM]
        simplices = [_simplex(p.a, p.b, []) for p in moved]
        if room > 0.0 and not any(any(nearest(p.differences(s))[0]) for p, s in zip(moved, simplices, strict=True)):
            return {"room": room, "simplices": simplices}
    return {}


def _simplex(a: Sequence[Vector], b: Sequence[Vector], start: Pairs) -> Pairs:
    """Pairs of vertices (of a, of b) whose differences hold, of all b - a, the one nearest to the origin."""
    pairs = [*start] or [[0, 0]]
    while True:
        v, whole, kept = nearest([sum_of(b[j], -1, a[i]) for i, j in pairs])
        pairs = [pairs[k] for k in kept]
        i = max(range(len(a)), key=lambda k: dot(v, a[k]))
        j = min(range(len(b)), key=lambda k: dot(v, b[k]))
        # v is the nearest if no difference is lower along it; otherwise the lowest one brings it nearer.
        if dot(v, sum_of(b[j], -1, a[i])) * whole >= dot(v, v):
            return pairs
        pairs.append([i, j])


def _facet(pair: Pair, normal: Vector) -> Pairs:
    """Pairs whose differences span a facet of b - a: from the normal on, each time the one with the largest gap."""

    def measured(facet: Pairs) -> tuple[Fraction, Vector]:
        gaps = ((pair.gap(n), n) for n in normals_to(pair.differences(facet)))
        return max(((Fraction(gap * abs(gap), dot(n, n)), n) for gap, n in gaps), key=lambda found: found[0])

    best, found = None, [[0, 0]]
    while True:
        highest = sorted(range(len(pair.a)), key=lambda k: -dot(normal, pair.a[k]))
        lowest = sorted(range(len(pair.b)), key=lambda k: dot(normal, pair.b[k]))
        (i, *others_a), (j, *others_b) = highest[:MOST], lowest[:MOST]
        others = [[k, j] for k in others_a] + [[i, k] for k in others_b]
        facets = [[[i, j], *some] for some in combinations(others, min(len(normal) - 1, len(others)))]
        (size, normal), facet = max(((measured(facet), facet) for facet in facets), key=lambda found: found[0][0])
        if best is not None and size <= best:
            return found
        best, found = size, facet
