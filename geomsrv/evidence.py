# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""Evidence for records: exact searches in the checker's own arithmetic, made when a record is read.

They begin where the engine ended, if it tells; then there is next to nothing left to search.  Nothing here has to be
trusted: `geomsrv.verify` judges what is found.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from fractions import Fraction
from itertools import combinations
from typing import Any

from geomsrv.verify import (
    Pair,
    Vector,
    clips_of,
    dot,
    in_units,
    nearest,
    normals_to,
    relative_velocity,
    sum_of,
    unit_of,
)

__all__ = ["evidence_of_contact", "evidence_of_distance"]

Record = dict[str, Any]
Pairs = list[list[int]]

MOST = 12  #: vertices of each body that are tried for a facet; any three of a larger one will do


def evidence_of_distance(a: Record, b: Record, start: Pairs, normal: list[float] | None = None) -> Record:
    """Of a distance; of bodies that meet also along which direction, near `normal`, they overlap by so much at most."""
    pair = Pair(a, b)
    evidence: Record = {"simplex": _simplex(pair.a, pair.b, start)}
    if normal is not None and not any(nearest(pair.differences(evidence["simplex"]))[0]):
        evidence["directions"] = [normal]
        evidence["facet"] = _facet(pair, in_units(normal, unit_of(normal)))
    return evidence


def evidence_of_contact(a: Record, b: Record, status: str, t_max: float) -> Record:
    """Of when polygons first touch, or that they never do."""
    pair = Pair(a, b)
    speed = relative_velocity(a, b, pair.unit)
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
