# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""Evidence for records: exact searches in the checker's own arithmetic, made when a record is read.

They begin where the engine ended, if it tells; then there is next to nothing left to search.  Nothing here has to be
trusted: `geomsrv.verify` judges what is found.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from fractions import Fraction
from itertools import combinations, product
from typing import Any, NamedTuple

from geomsrv.verify import (
    Pair,
    Vector,
    axis_of,
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
    if status == "OVERLAPPING":
        return {}
    pair = Pair(a, b)
    speed = relative_velocity(a, b, pair.unit)
    evidence: Record = {}
    for axes in (_edges(pair), _every_axis(pair)):
        clips = [_clip(pair, speed, axis) for axis in axes]
        if status == "NEVER":
            found = [clip for clip in clips if clip.gap > 0 and (clip.time is None or clip.time > t_max)]
        elif status == "TOUCHING":
            found = [clip for clip in clips if clip.gap == 0]
        else:  # they are apart until the last gap has closed
            closing = [clip for clip in clips if clip.time]
            found = [max(closing, key=lambda clip: clip.time or 0)] if closing else []
        if found:
            evidence["axis"], _, time = found[0]
            if status == "NEVER":
                return evidence
            moved = pair.moved(speed, time or Fraction(0))
            evidence["simplex"] = _simplex(moved.a, moved.b, [])
            if not any(nearest(moved.differences(evidence["simplex"]))[0]):
                return evidence
    return evidence


class _Clip(NamedTuple):
    axis: list[int]
    gap: int
    time: Fraction | None  #: when the gap has closed; None if it does not, or there is none


def _clip(pair: Pair, speed: Vector, axis: list[int]) -> _Clip:
    n = axis_of(pair, speed, axis)
    gap, closing = pair.gap(n) if any(n) else -1, -dot(n, speed)
    closes = gap > 0 and closing > 0
    return _Clip(axis, gap, Fraction(gap * pair.unit, closing * pair.scale) if closes else None)


def _edges(pair: Pair) -> Iterator[list[int]]:
    """Axes that are enough for rings that are exactly convex, in motion and not both of them points."""
    for side, points in enumerate((pair.a, pair.b)):
        yield from ([side, i, (i + 1) % len(points), 0] for i in range(len(points)))
    yield from ([side, 0, 0, 0] for side in (2, 3))


def _every_axis(pair: Pair) -> Iterator[list[int]]:
    for side, points in enumerate((pair.a, pair.b)):
        yield from ([side, i, j, 0] for i, j in combinations(range(len(points)), 2))
    yield from ([4, i, 0, k] for i, k in product(range(len(pair.a)), range(len(pair.b))))
    yield [5, 0, 0, 0]


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
