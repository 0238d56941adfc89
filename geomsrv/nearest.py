# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""The nearest pair of a world, without a look at most of the pairs: a growing margin, and the best first."""

from __future__ import annotations

from collections import Counter

import numpy as np

from geomsrv.answers import IntArray
from geomsrv.broad_phase import Aabbs, Selection, boxes_now, candidates, gaps
from geomsrv.narrow_phase import DistanceRows, Unsupported, distance_rows
from geomsrv.world import World, supported_kinds

__all__ = ["nearest_rows"]

# The first margin is the size of the scene over the number of objects, less than what neighbours are usually
# apart.  It grows by this until a pair is found: few rounds in vain, and some 4^3 times the pairs needed at
# worst.
GROWTH = 4.0

# Pairs looked at before the first comparison with what is left; each further helping is twice as large.
FIRST_HELPING = 64

# Boxes farther apart than the best distance times this cannot hold a nearer pair.  A computed distance may
# lie below the exact one by its rounding; 2^-40 of it is far more than a kernel loses.
BEYOND = 1.0 + 2.0**-40


def nearest_rows(
    world: World, penetration: bool, selection: Selection | None, tier: str, counts: Counter[str]
) -> tuple[DistanceRows, Unsupported]:
    """The nearest pair, at most one row, and the pairs without a kernel that may be nearer.

    At tier "bound" that with the smallest lower end among those whose boxes are as near: none is nearer than that.
    """
    boxes = boxes_now(world)
    size = _size(boxes)
    margin, next_margin = 0.0, size / max(len(world), 1)
    if not _any_kernel(world):
        next_margin = 0.0
    while True:
        near = [candidates(world, family, boxes, margin, selection) for family in world.families]
        pairs = np.concatenate([part.pairs for part in near])
        best, unsupported = _best_of(world, boxes, pairs, penetration, tier, counts)
        if len(best.pairs):
            if best.distance[0] <= margin:
                break
            # An answer beyond the margin bounds the search: one more round finds whatever is nearer.
            margin = float(best.distance[0]) * BEYOND
        elif margin == np.inf or not next_margin > 0.0:
            break
        else:
            margin = next_margin
            next_margin = margin * GROWTH if margin <= size else np.inf
    counts["candidates"] += sum(part.found for part in near)
    counts["allowed"] += sum(part.allowed for part in near)
    return best, unsupported


def _size(boxes: Aabbs) -> float:
    """At least the diameter of what the finite boxes fill; inf if there is none, or nothing but one point."""
    finite = np.isfinite(boxes.lower).all(axis=1) & np.isfinite(boxes.upper).all(axis=1)
    if not finite.any():
        return np.inf
    span = boxes.upper[finite].max(axis=0) - boxes.lower[finite].min(axis=0)
    return float(span.sum()) or np.inf  # no less than the diagonal, and it does not overflow


def _any_kernel(world: World) -> bool:
    """Whether any two objects could be compared; if not, a search would go through all pairs in vain."""
    solids, polygons = world.families
    present = np.bincount(world.kinds[solids], minlength=len(supported_kinds()))
    twice = np.minimum(np.outer(present, present), np.where(np.eye(len(present), dtype=bool), present - 1, 1))
    return len(polygons) > 1 or bool(((twice > 0) & supported_kinds()).any())


def _best_of(
    world: World, boxes: Aabbs, pairs: IntArray, penetration: bool, tier: str, counts: Counter[str]
) -> tuple[DistanceRows, Unsupported]:
    """Nearest of the listed pairs; of equal ones the first by id."""
    apart = gaps(boxes, pairs)
    order = np.argsort(apart, kind="stable")
    best, unsupported = DistanceRows.none(), Unsupported.none()
    start, helping = 0, FIRST_HELPING
    while start < len(order):
        end = min(start + helping, int(np.searchsorted(apart[order], _limit(best), side="right")))
        if end <= start:
            break
        rows, missing = distance_rows(world, pairs[np.sort(order[start:end])], penetration, tier, counts)
        rows = DistanceRows.joined([best, rows])
        best = rows.take(np.flatnonzero(rows.distance == rows.distance.min(initial=np.inf))[:1])
        unsupported = Unsupported.joined([unsupported, missing])
        start, helping = end, 2 * helping
    nearer = gaps(boxes, unsupported.pairs) <= _limit(best)
    return best, unsupported.take(nearer)


def _limit(best: DistanceRows) -> float:
    """Largest squared gap at which a pair may still be nearer."""
    if not len(best.pairs):
        return np.inf
    limit = max(float(best.distance[0]) * BEYOND, 0.0)
    return limit * limit
