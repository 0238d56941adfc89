# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""What two bodies share that turn, of which one is a mesh, when they touch: that of all pairs of pieces, put together.

The time is known, and an interval that holds the contact.  At that time pieces are looked for that may touch within
the interval: each pair is asked, as bodies that turn are, for what it shares within the way made meanwhile.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from geomsrv import _core, _validate
from geomsrv.answers import ContactStatus, FloatArray, IntArray
from geomsrv.mesh_contact import united_in_space
from geomsrv.mesh_tree import Tree, in_order

__all__ = [
    "MOST_SHARED",
    "OFF_ROUNDING",
    "SAME_PLACE",
    "TURNED_ROUNDING",
    "Bodies",
    "Contact",
    "Moving",
    "near_pieces",
    "shared_parts",
    "united",
]

# Pairs of pieces that are asked for what they share; of more, which all touch at once, nothing is told but a point.
MOST_SHARED = 16384

# What the engine takes for the same, 4 times what rounds in placing two pieces, which is 73 u of their reach for each
# and 16 u of both; and a point in the fixed frame.  Of the largest coordinate, rounded up.
TURNED_ROUNDING = 1024.0 * 2.0**-53

# The same for what the caller says that bodies are off by.
OFF_ROUNDING = 4.0

# A point that a pair shares is no further than twice what is the same from both, so those of two pairs from one
# another by four times as much; and as far again, where edges cross that are off.
SAME_PLACE = 8.0

Bodies = tuple[Any, ...]  #: as the engine reads them: centres, axes, half extents; or hulls


class Moving(NamedTuple):
    """A body of pieces, or a convex one, which is its only piece, and how it moves."""

    tree: Tree
    nodes: Callable[[IntArray], Bodies]  #: what holds the pieces in nodes of the tree, at the start
    pieces: Callable[[IntArray], Bodies]  #: listed ones, at the start
    motion: FloatArray  #: (1, 9) velocity, angular velocity, centre

    def bounds(self, nodes: IntArray, time: float) -> tuple[FloatArray, FloatArray]:
        """Low and high corners (k, 3), or (1, 3), of boxes around nodes at a time."""
        first, *rest = self.nodes(nodes)
        at = self.placed(first, time)
        if len(rest) == 2:
            half = np.einsum("kij,ki->kj", np.abs(rest[0] @ _turn(self.motion[0, 3:6], time).T), rest[1])
            return at - half, at + half
        ends = rest[0][:-1]
        return np.minimum.reduceat(at, ends, axis=0), np.maximum.reduceat(at, ends, axis=0)

    def placed(self, points: FloatArray, time: float) -> FloatArray:
        """Points (k, 3) of the body at the start, at a time."""
        velocity, turning, center = self.motion.reshape(3, 3)
        moved: FloatArray = (points - center) @ _turn(turning, time).T + (center + time * velocity)
        return moved

    def sweep(self) -> float:
        """No point is faster [m/s], seen from the centre."""
        _, turning, center = self.motion.reshape(3, 3)
        first, *rest = self.nodes(np.ones(1, np.int64))
        reach = float(np.linalg.norm(first - center, axis=1).max())
        if len(rest) == 2:
            reach += float(np.linalg.norm(rest[1][0]))
        return reach * float(np.linalg.norm(turning))


def _turn(turning: FloatArray, time: float) -> FloatArray:
    """Rotation matrix of an angular velocity and a time."""
    half = 0.5 * time * turning
    angle = float(np.linalg.norm(half))
    quaternion = np.append(np.sinc(angle / np.pi) * half, np.cos(angle))
    turn: FloatArray = _validate.rotation_matrices(quaternion[None])[0]
    return turn


class Contact(NamedTuple):
    """When bodies touch, and how."""

    status: int
    lower: float
    upper: float
    normal: FloatArray  #: (3,) or NaN
    slack: FloatArray  #: (1, 3) margin [m] up to which bodies are in contact, what they are off by [m], and drift [m/s]

    @property
    def resting(self) -> bool:
        """Whether it is at the start."""
        return self.status in (ContactStatus.TOUCHING, ContactStatus.OVERLAPPING)

    @property
    def span(self) -> float:
        """How much later the contact may be than the time at which it is looked at."""
        if self.status == ContactStatus.WILL_TOUCH:
            return self.upper - self.lower
        return 0.0 if self.resting else math.nextafter(self.lower, math.inf) - self.lower

    def same(self, a: Moving, b: Moving) -> tuple[float, float]:
        """What is the same as far as can be told [m], and the largest coordinate."""
        velocity = a.motion[0, :3] - b.motion[0, :3]
        way = (float(np.linalg.norm(velocity)) + a.sweep() + b.sweep()) * self.span
        root = np.ones(1, np.int64)
        size = max(float(np.abs(end).max()) for body in (a, b) for end in body.bounds(root, self.lower))
        return way + OFF_ROUNDING * float(self.slack[0, 1]) + TURNED_ROUNDING * size, size


def shared_parts(a: Moving, b: Moving, contact: Contact, shift: float = 0.0) -> list[FloatArray]:
    """Points, segments and rings that bodies share which touch; empty if that is too much to tell.

    The points of a pair of pieces are moved by a shift [m] along its normal: pieces of round bodies are cores.
    """
    margin = float(contact.slack[0, 0])
    if contact.status == ContactStatus.OVERLAPPING and margin > 0.0:
        return []  # all that is within the margin
    same, size = contact.same(a, b)
    pairs = near_pieces(a, b, contact.lower, margin + same)
    if pairs is None or not len(pairs[0]):
        return []
    sides = a.pieces(pairs[0]), b.pieces(pairs[1])
    if contact.resting and margin == 0.0:
        still = np.zeros((1, 3))
        found: Any = _core.first_contact_world(*sides, still, still, 0.0, True, "float64")
        points, offsets = found[6:8]
    else:
        normals, points, offsets = _core.shared_turning(
            *sides, a.motion, b.motion, contact.lower, contact.span, contact.normal[None], contact.slack
        )
        points = points + shift * np.repeat(normals, np.diff(offsets), axis=0)
    sets = [points[i:j] for i, j in zip(offsets[:-1].tolist(), offsets[1:].tolist(), strict=True) if i < j]
    # Two points a margin apart, one as far to the side as makes no difference: midway between them half as far.
    return united(sets, SAME_PLACE * same + 2.0 * math.sqrt(margin * same), size, contact.normal)


def united(sets: list[FloatArray], place: float, size: float, normal: FloatArray) -> list[FloatArray]:
    """What `united_in_space` makes of sets; size is the largest coordinate."""
    # In a power of two near the size, so that no product overflows or vanishes.
    unit = math.frexp(size)[1]
    scaled = [np.ldexp(part, -unit) for part in sets]
    return [np.ldexp(part, unit) for part in united_in_space(scaled, math.ldexp(place, -unit), normal)]


def near_pieces(a: Moving, b: Moving, time: float, room: float) -> tuple[IntArray, IntArray] | None:
    """Pairs of pieces whose boxes are within some room of one another at a time; None if they are too many."""
    found: list[tuple[IntArray, IntArray]] = []
    count = 0

    def keys(nodes_a: IntArray, nodes_b: IntArray) -> FloatArray:
        if not len(nodes_a):
            return np.zeros(0)
        (low_a, high_a), (low_b, high_b) = a.bounds(nodes_a, time), b.bounds(nodes_b, time)
        near = ((low_a - high_b <= room) & (low_b - high_a <= room)).all(axis=1)
        # The smallest first, so that few wait.
        return np.where(near, -(nodes_a + nodes_b), np.inf)

    def look(pieces_a: IntArray, pieces_b: IntArray) -> None:
        nonlocal count
        found.append((pieces_a, pieces_b))
        count += len(pieces_a)

    in_order(a.tree, b.tree, keys, lambda: np.inf if count <= MOST_SHARED else -np.inf, look)
    if count > MOST_SHARED:
        return None
    if not found:
        return np.zeros(0, np.int64), np.zeros(0, np.int64)
    one, two = (np.concatenate(side) for side in zip(*found, strict=True))
    order = np.lexsort((two, one))
    return one[order], two[order]
