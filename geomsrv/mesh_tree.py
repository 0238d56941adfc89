# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""Which pieces of two bodies meet first, or last: boxes around halves of halves, looked at in the order of time.

Nothing is decided here: a pair of pieces is left out only where the boxes around them, a little larger than need be,
say that it comes too late to matter.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from geomsrv.answers import BoolArray, FloatArray, IntArray

__all__ = ["Sweep", "Tree", "in_order", "ordered"]

# Boxes are larger by so much, in terms of the largest coordinate, and times earlier or later, in terms of themselves:
# more than pieces that are within the rounding of their coordinates, and so touch, can be apart, and far more than
# the few roundings of the time at which two boxes meet.
BOX_SLACK = 2.0**-40

BATCH = 512  # pairs of boxes that are looked into at once: the earliest ones


def ordered(low: FloatArray, high: FloatArray) -> IntArray:
    """Pieces so that each half, and each half of that, lies together: boxes are halved across their longest side.

    -1 fills up the number to a power of two.
    """
    count = len(low)
    size = 1 << max(count - 1, 0).bit_length()
    middle = 0.5 * low + 0.5 * high
    order = np.concatenate([np.arange(count), np.full(size - count, -1)])
    width = size
    while width > 1:
        blocks = order.reshape(-1, width)
        there = (blocks >= 0)[:, :, None]
        places = middle[blocks]
        spread = np.where(there, places, -np.inf).max(axis=1) - np.where(there, places, np.inf).min(axis=1)
        key = np.take_along_axis(places, np.argmax(spread, axis=1)[:, None, None], axis=2)[:, :, 0]
        # Those that fill up are last, so that whole halves are empty.
        key = np.where(there[:, :, 0], key, np.inf)
        order = np.take_along_axis(blocks, np.argsort(key, axis=1, kind="stable"), axis=1).ravel()
        width //= 2
    return order


class Tree(NamedTuple):
    """Boxes in a heap: those of node i are in the nodes 2 i and 2 i + 1, and the last half are those of pieces."""

    low: FloatArray  #: (2 m, 3); row 0 is unused, and a box without pieces is empty
    high: FloatArray
    piece: IntArray  #: (m,)

    @classmethod
    def of(cls, low: FloatArray, high: FloatArray, order: IntArray) -> Tree:
        """Of the boxes of pieces."""
        size = len(order)
        there = (order >= 0)[:, None]
        lows, highs = np.full((2 * size, 3), np.inf), np.full((2 * size, 3), -np.inf)
        lows[size:], highs[size:] = np.where(there, low[order], np.inf), np.where(there, high[order], -np.inf)
        while size > 1:
            size //= 2
            inner = slice(size, 2 * size)
            lows[inner] = lows[2 * size : 4 * size].reshape(size, 2, 3).min(axis=1)
            highs[inner] = highs[2 * size : 4 * size].reshape(size, 2, 3).max(axis=1)
        return cls(lows, highs, order)


@dataclass(frozen=True)
class Sweep:
    """Two bodies of which one moves as seen from the other.

    Lengths and speeds are in powers of two, so that nothing overflows.
    """

    a: Tree
    b: Tree
    velocity: FloatArray  #: (3,) of a as seen from b, the largest part about 1
    exponent: int  #: of the unit of time

    @classmethod
    def of(cls, a: Tree, b: Tree, velocity_a: FloatArray, velocity_b: FloatArray) -> Sweep:
        """Bodies with these velocities."""
        scale = _exponent(np.array([tree.low[1] for tree in (a, b)] + [tree.high[1] for tree in (a, b)]))
        half = 0.5 * velocity_a - 0.5 * velocity_b
        speed = _exponent(half)
        a, b = (tree._replace(low=np.ldexp(tree.low, -scale), high=np.ldexp(tree.high, -scale)) for tree in (a, b))
        return cls(a, b, np.ldexp(half, -speed), scale - speed - 1)

    def first(self, i: IntArray, k: IntArray) -> FloatArray:
        """When boxes may meet first, in its own unit; inf if they never do."""
        enter, _, meet = self._spans(i, k)
        return np.where(meet, enter, np.inf)

    def last(self, i: IntArray, k: IntArray) -> FloatArray:
        """When boxes may meet last, in its own unit and backwards; inf if they never do."""
        _, leave, meet = self._spans(i, k)
        return np.where(meet, -leave, np.inf)

    def not_after(self, time: float) -> float:
        """Limit of `first`, for a time in seconds."""
        with np.errstate(over="ignore"):
            return float(np.nextafter(np.ldexp(time, -self.exponent), np.inf))

    def after(self, time: float) -> float:
        """Limit of `last`, for a time in seconds."""
        with np.errstate(over="ignore"):
            return float(np.nextafter(-np.ldexp(time, -self.exponent), -np.inf))

    def _spans(self, i: IntArray, k: IntArray) -> tuple[FloatArray, FloatArray, BoolArray]:
        """From when to when boxes may meet, from 0 on; and whether they may at all."""
        near = self.b.low[k] - self.a.high[i] - BOX_SLACK
        far = self.b.high[k] - self.a.low[i] + BOX_SLACK
        w = self.velocity
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            first, last = np.where(w > 0.0, near / w, far / w), np.where(w > 0.0, far / w, near / w)
        at_rest = w == 0.0
        first, last = np.where(at_rest, -np.inf, first), np.where(at_rest, np.inf, last)
        enter = np.maximum(first.max(axis=1), 0.0) * (1.0 - BOX_SLACK)
        leave = last.min(axis=1) * (1.0 + BOX_SLACK)
        meet = (
            (leave >= 0.0)
            & (enter <= leave)
            & ~((near > 0.0) & at_rest).any(axis=1)
            & ~((far < 0.0) & at_rest).any(axis=1)
        )
        return enter, leave, meet


def _exponent(values: FloatArray) -> int:
    finite = np.abs(values[np.isfinite(values)])
    return math.frexp(float(finite.max(initial=0.0)))[1]


def in_order(
    a: Tree,
    b: Tree,
    keys: Callable[[IntArray, IntArray], FloatArray],
    limit: Callable[[], float],
    look: Callable[[IntArray, IntArray], None],
    batch: int = BATCH,
) -> float:
    """Look at pairs of pieces in the order of their keys, as long as these are not above the limit, which may fall.

    `keys` tells a number for nodes of both trees that is not above those of what is in them; `look` is told pieces.
    Returns the least key of what was left out, inf if that is nothing.
    """
    leaves_a, leaves_b = len(a.piece), len(b.piece)
    i, k = np.ones(1, np.int64), np.ones(1, np.int64)
    key = np.full(1, -np.inf)
    left_out = np.inf
    while True:
        alive = key <= limit()
        left_out = float(key[~alive].min(initial=left_out))
        i, k, key = i[alive], k[alive], key[alive]
        if not len(i):
            return left_out
        chosen = np.zeros(len(i), np.bool_)
        chosen[np.argpartition(key, batch)[:batch] if len(i) > batch else slice(None)] = True
        here, there = i[chosen], k[chosen]
        i, k, key = i[~chosen], k[~chosen], key[~chosen]
        end_a, end_b = here >= leaves_a, there >= leaves_b
        pieces = end_a & end_b
        if pieces.any():
            look(a.piece[here[pieces] - leaves_a], b.piece[there[pieces] - leaves_b])
        extent = [(tree.high[n] - tree.low[n]).max(axis=1) for tree, n in ((a, here), (b, there))]
        halve_a = ~end_a & (end_b | (extent[0] >= extent[1]))
        halve_b = ~end_b & ~halve_a
        new_i = np.concatenate([2 * here[halve_a], 2 * here[halve_a] + 1, here[halve_b], here[halve_b]])
        new_k = np.concatenate([there[halve_a], there[halve_a], 2 * there[halve_b], 2 * there[halve_b] + 1])
        filled = (a.low[new_i, 0] < np.inf) & (b.low[new_k, 0] < np.inf)
        new_i, new_k = new_i[filled], new_k[filled]
        new_key = keys(new_i, new_k)
        there_is = new_key < np.inf
        i, k = np.concatenate([i, new_i[there_is]]), np.concatenate([k, new_k[there_is]])
        key = np.concatenate([key, new_key[there_is]])
