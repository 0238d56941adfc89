# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""Which pairs of objects are worth a closer look: axis-aligned boxes, never too small.

Every box holds its object for certain, rounding included; so a pair whose boxes are apart is apart.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from geomsrv import _core
from geomsrv.answers import BoolArray, FloatArray, IntArray
from geomsrv.world import ROUNDOFF, UNDERFLOW, World

__all__ = [
    "Aabbs",
    "Candidates",
    "Selection",
    "boxes_now",
    "boxes_swept",
    "candidates",
    "candidates_of",
    "entry_times",
    "gaps",
]

# A face of a box is computed as ((R c) + p) +- ((|R| h) + round): a sum of at most six terms, each a product
# of a rounded and a given number.  With the rounding of c and h themselves (2 u) its error stays below 8 u
# times the sum of the terms' magnitudes (Higham, Accuracy and Stability, section 3.1).  The narrow phase sees
# the pair through a relative pose that is rounded too; 24 u more keep every pair whose *computed* distance
# would have been reported.
AABB_ROUNDING = 32.0 * ROUNDOFF

# The square of a box distance is compared with the square of a limit: 3 squares, 3 differences and 2 sums,
# less than 8 roundings on either side.
GAP_ROUNDING = 16.0 * ROUNDOFF

# A gap between boxes and a closing speed are differences of two numbers each, less a margin or plus a drift: 3
# roundings relative to their magnitudes; their quotient adds one.
ENTRY_ROUNDING = 8.0 * ROUNDOFF


@dataclass(frozen=True, eq=False)
class Aabbs:
    """Axis-aligned boxes, a row per object; bounds may be infinite."""

    lower: FloatArray  #: (n, 3)
    upper: FloatArray  #: (n, 3)

    def grown(self, margin: float) -> Aabbs:
        """Boxes grown by at least `margin` on all sides."""
        return Aabbs(np.nextafter(self.lower - margin, -np.inf), np.nextafter(self.upper + margin, np.inf))

    def rows(self, rows: IntArray) -> Aabbs:
        """The listed boxes."""
        return Aabbs(self.lower[rows], self.upper[rows])

    def with_rows(self, rows: IntArray, others: Aabbs) -> Aabbs:
        """The listed boxes replaced."""
        lower, upper = self.lower.copy(), self.upper.copy()
        lower[rows], upper[rows] = others.lower, others.upper
        return Aabbs(lower, upper)


@dataclass(frozen=True, eq=False)
class Selection:
    """Pairs asked for: one object of each of two sets."""

    first: BoolArray  #: (n,)
    second: BoolArray  #: (n,)

    def pair_count(self, family: IntArray) -> int:
        """Number of pairs among the objects of a family."""
        a, b = self.first[family], self.second[family]
        one_way, both = int(a.sum()) * int(b.sum()), int((a & b).sum())
        # An object that is in both sets makes a pair with itself, and each pair of two such objects counts
        # twice.
        return one_way - both - both * (both - 1) // 2


@dataclass(frozen=True, eq=False)
class Candidates:
    """Pairs that survived the broad phase."""

    pairs: IntArray  #: (k, 2) rows of the world, i < j, sorted
    found: int  #: pairs whose boxes are near enough, allowed ones included
    allowed: int  #: of these, pairs that are ignored


def boxes_now(world: World, rows: IntArray | None = None) -> Aabbs:
    """Boxes around every object, or the listed ones, where it is now, grown by its uncertainty."""
    table, shape = world.table, _some(world.shape, rows)
    lower, upper = _core.bounding_boxes(
        _some(world.poses, rows),
        world.rotations if rows is None else world.rotations_of(rows),
        _some(world.uncertainty, rows),
        shape,
        table.center,
        table.half,
        table.round,
        AABB_ROUNDING,
        UNDERFLOW,
    )
    for i in np.flatnonzero(table.unbounded[shape]).tolist():
        lower[i], upper[i] = _half_space_box(world, i if rows is None else int(rows[i]))
    return Aabbs(lower, upper)


def _some(column: Any, rows: IntArray | None) -> Any:
    """The listed rows of a column, or all."""
    return column if rows is None else column[rows]


def _half_space_box(world: World, row: int) -> tuple[FloatArray, FloatArray]:
    """Box of a half space: finite on one side if the boundary is perpendicular to an axis, exactly."""
    lower, upper = np.full(3, -np.inf), np.full(3, np.inf)
    shape = world.table.shapes[world.shape[row]]
    axis = np.flatnonzero(shape.normal)
    if len(axis) == 1:
        # normal = +-e_k, so the normal in the fixed frame is +- column k of the rotation, without rounding.
        normal = world.rotations[row][:, axis[0]] * shape.normal[axis[0]]
        across = np.flatnonzero(normal)
        if len(across) == 1:
            k, offset = across[0], shape.offset
            place = world.poses[row, k]
            margin = AABB_ROUNDING * (abs(offset) + abs(place)) + world.uncertainty[row]
            if normal[k] > 0.0:
                upper[k] = offset / normal[k] + place + margin
            else:
                lower[k] = offset / normal[k] + place - margin
    return lower, upper


def boxes_swept(world: World, horizon: float, rows: IntArray | None = None) -> Aabbs:
    """Boxes around all that every object, or each of the listed ones, passes through within `horizon` seconds."""
    return _swept(world, horizon, rows) if horizon > 0.0 else boxes_now(world, rows)


def _swept(world: World, horizon: float, rows: IntArray | None = None) -> Aabbs:
    """The same; for no time at all boxes that hold an object however it is turned."""
    now = boxes_now(world, rows)
    # However an object turns about its origin, it stays in the ball around it.
    reach = world.table.reach[_some(world.shape, rows)] + _some(world.uncertainty, rows)
    lower, upper = _core.swept_boxes(
        now.lower,
        now.upper,
        _some(world.poses, rows),
        _some(world.twists, rows),
        _some(world.turns, rows),
        reach,
        _some(world.velocity_uncertainty, rows),
        horizon,
        AABB_ROUNDING,
    )
    lost = np.array(list(world.motion_faults), dtype=np.int64)
    lost = lost if rows is None else np.flatnonzero(np.isin(rows, lost))
    lower[lost], upper[lost] = -np.inf, np.inf
    return Aabbs(lower, upper)


def entry_times(world: World, pairs: IntArray, margin: float = 0.0) -> FloatArray:
    """(k,) [s] until which the boxes of a pair are surely apart by more than the margin along an axis; may be inf."""
    boxes, (a, b) = _swept(world, 0.0), pairs.T
    velocity = world.twists[a, :3] - world.twists[b, :3]
    drift = world.velocity_uncertainty[pairs].sum(axis=1)[:, None]
    begin = np.zeros(len(pairs))
    for gap, closing in (
        (boxes.lower[b] - boxes.upper[a], velocity + drift),
        (boxes.lower[a] - boxes.upper[b], drift - velocity),
    ):
        closing += ENTRY_ROUNDING * (np.abs(world.twists[a, :3]) + np.abs(world.twists[b, :3]) + drift)
        room = gap - margin - ENTRY_ROUNDING * (np.abs(boxes.lower[a]) + np.abs(boxes.lower[b]) + np.abs(gap) + margin)
        with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
            wait = np.where(closing > 0.0, room / closing * (1.0 - ENTRY_ROUNDING), np.inf)
        begin = np.maximum(begin, np.where(room > 0.0, wait, 0.0).max(axis=1))
    return begin


def gaps(boxes: Aabbs, pairs: IntArray) -> FloatArray:
    """(k,) float64: squared distance between the boxes of each pair, 0 where they overlap."""
    i, j = pairs[:, 0], pairs[:, 1]
    apart = np.maximum(boxes.lower[j] - boxes.upper[i], boxes.lower[i] - boxes.upper[j])
    apart = np.maximum(apart, 0.0)
    squared: FloatArray = np.einsum("ki,ki->k", apart, apart)
    return squared


def candidates(
    world: World, family: IntArray, boxes: Aabbs, margin: float = 0.0, selection: Selection | None = None
) -> Candidates:
    """Pairs within a family whose boxes are at most `margin` apart, without the allowed ones."""
    grown = boxes.grown(margin / 2.0) if margin > 0.0 else boxes
    if selection is None:
        near = grown.rows(family)
        pairs = family[_core.overlapping_pairs(near.lower, near.upper)]
    else:
        pairs = _selected(family, grown, selection)
    return _allowed_out(world, pairs, boxes, margin)


FEW = 16  # objects whose boxes are compared with all others one by one, faster than sorting them


def candidates_of(world: World, boxes: Aabbs, margin: float, chosen: IntArray) -> Candidates:
    """The same for pairs of either family with one of the chosen objects, of which there are few."""
    if len(chosen) > FEW:
        first = np.zeros(len(world), dtype=bool)
        first[chosen] = True
        selection = Selection(first, np.ones_like(first))
        parts = [candidates(world, family, boxes, margin, selection) for family in world.families]
        pairs = np.concatenate([part.pairs for part in parts])
        return Candidates(pairs, sum(part.found for part in parts), sum(part.allowed for part in parts))
    own = boxes.rows(chosen)
    own = own.grown(margin) if margin > 0.0 else own
    found = []
    for i, low, high in zip(chosen.tolist(), own.lower.tolist(), own.upper.tolist(), strict=True):
        others = np.flatnonzero((boxes.lower[:, 0] <= high[0]) & (boxes.upper[:, 0] >= low[0]))
        for k in (1, 2):
            others = others[(boxes.lower[others, k] <= high[k]) & (boxes.upper[others, k] >= low[k])]
        others = others[(world.planar[others] == world.planar[i]) & (others != i)]
        found.append(np.minimum(others, i) * len(world) + np.maximum(others, i))
    keys = np.unique(np.concatenate(found))
    return _allowed_out(world, np.column_stack(np.divmod(keys, len(world))), boxes, margin)


def _allowed_out(world: World, pairs: IntArray, boxes: Aabbs, margin: float) -> Candidates:
    """The pairs whose boxes are within the margin, not only within boxes that were grown by it, and not ignored."""
    if 0.0 < margin < np.inf:
        # Boxes grown by half the margin meet at a corner although they are up to sqrt(3) margins apart.
        pairs = pairs[gaps(boxes, pairs) <= margin * margin * (1.0 + GAP_ROUNDING)]
    keys = pairs[:, 0] * len(world) + pairs[:, 1]
    ignored = np.zeros(len(keys), dtype=bool)
    if len(world.allowed):
        place = np.minimum(np.searchsorted(world.allowed, keys), len(world.allowed) - 1)
        ignored = world.allowed[place] == keys
    return Candidates(pairs[~ignored], len(pairs), int(ignored.sum()))


def _selected(family: IntArray, boxes: Aabbs, selection: Selection) -> IntArray:
    """Overlapping pairs with one object of either set: only their boxes are looked at."""
    first, second = family[selection.first[family]], family[selection.second[family]]
    a, b = boxes.rows(first), boxes.rows(second)
    found = _core.overlapping_pairs_between(a.lower, a.upper, b.lower, b.upper)
    pairs = np.sort(np.column_stack([first[found[:, 0]], second[found[:, 1]]]), axis=1)
    pairs = pairs[pairs[:, 0] != pairs[:, 1]]
    count = len(boxes.lower)
    keys = np.unique(pairs[:, 0] * count + pairs[:, 1])
    return np.column_stack([keys // max(count, 1), keys % max(count, 1)])
