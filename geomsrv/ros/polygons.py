# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""Polygons that arrive as float32, instance by instance: which convex ring was meant, and how it moves.

Every coordinate may be off by a rounding to float32, its *floor*.  So a ring counts as convex, and a displacement as a
translation, if some exact ring or translation lies within the floor of the numbers that came.
"""

from __future__ import annotations

from collections.abc import Container
from dataclasses import dataclass
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from geomsrv.errors import GeometryError

__all__ = ["Motion", "PolygonTracks", "convex_ring", "float32_floor"]

FloatArray = NDArray[np.float64]

# Rounding to nearest moves a number x by at most half a unit in the last place: 2^-24 |x| among the normal numbers of
# float32 (24 significant bits), 2^-150 among the subnormal ones (spacing 2^-149).
FLOAT32_ROUNDING = 2.0**-24
FLOAT32_SMALLEST_ROUNDING = 2.0**-150

# A product of two differences is off by three roundings, 3 * 2^-53 of itself, and their difference by one more; where
# this does not tell the sign (underflow included: then the left side is 0 or as small), exact arithmetic does.
TURN_ROUNDING = 8.0 * 2.0**-53


def float32_floor(points: FloatArray) -> FloatArray:
    """How far each coordinate may be from the number that was rounded to float32; same shape as `points`."""
    return np.maximum(FLOAT32_ROUNDING * np.abs(points), FLOAT32_SMALLEST_ROUNDING)


def convex_ring(points: FloatArray, floor: FloatArray) -> FloatArray:
    """The convex counter-clockwise ring that (n, 2) points, each coordinate good to its floor, round off.

    Rounding bends straight chains by up to the floor, so that an honest ring may be slightly non-convex.  The hull of
    the rounded vertices is within the floor of the hull of the true ones, which is the true ring; so the hull is what
    is returned, provided the points run along its boundary in order.

    Raises
    ------
    GeometryError
        Clockwise, not convex, or winding round more than once.
    """
    if len(points) == 0:
        raise GeometryError("polygon has no points")
    hull = _hull(points)
    # A true vertex is on the boundary of the true ring, which is within the floor of the hull's, and the point that
    # came is within the floor of the true vertex.
    reach = 2.0 * float(np.hypot(*floor.max(axis=0)))
    # A segment, or a sliver whose sense of turning is left to the rounding.
    ends = points[hull[0]], points[hull[int(np.argmax(np.hypot(*(points[hull] - points[hull[0]]).T)))]]
    if len(hull) <= 2 or (_distance_to_segment(points, *ends) <= reach).all():
        return points[hull]
    # The hull's corners must come in the order of the points, up to where the ring starts.
    turns = int((np.diff(np.append(hull, hull[0])) < 0).sum())
    if turns == len(hull) - 1:
        raise GeometryError("polygon is clockwise; its points must be counter-clockwise seen from +z")
    if turns != 1:
        raise GeometryError("polygon is not convex")
    hull = np.roll(hull, -int(np.argmin(hull)))
    for start, end in zip(hull, np.append(hull[1:], hull[0] + len(points)), strict=True):
        between = points[np.arange(start + 1, end) % len(points)]
        far = _distance_to_segment(between, points[start], points[end % len(points)]) > reach
        if far.any():
            raise GeometryError(f"polygon is not convex at its point {(start + 1 + int(np.argmax(far))) % len(points)}")
    return points[hull]


def _hull(points: FloatArray) -> NDArray[np.int64]:
    """Indices of the hull's corners, counter-clockwise (Andrew's monotone chain)."""
    order = np.lexsort((points[:, 1], points[:, 0]))
    xy = points.tolist()

    def chain(indices: list[int]) -> list[int]:
        kept: list[int] = []
        for i in indices:
            while len(kept) >= 2 and _turn(xy[kept[-2]], xy[kept[-1]], xy[i]) <= 0.0:
                kept.pop()
            if not kept or xy[kept[-1]] != xy[i]:
                kept.append(i)
        return kept

    lower, upper = chain(order.tolist()), chain(order.tolist()[::-1])
    return np.array(lower[:-1] + upper[:-1] if len(lower) > 1 else lower, dtype=np.int64)


def _turn(a: list[float], b: list[float], c: list[float]) -> float:
    """> 0 if a, b, c turn left, < 0 if right, 0 if straight on: exactly, since the ring is taken literally later."""
    left, right = (b[0] - a[0]) * (c[1] - a[1]), (b[1] - a[1]) * (c[0] - a[0])
    if abs(left - right) > TURN_ROUNDING * (abs(left) + abs(right)):
        return left - right
    (ax, ay), (bx, by), (cx, cy) = ((Fraction(x), Fraction(y)) for x, y in (a, b, c))
    exact = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
    return float((exact > 0) - (exact < 0))


def _distance_to_segment(points: FloatArray, a: FloatArray, b: FloatArray) -> FloatArray:
    along = b - a
    length2 = float(along @ along)
    t = np.clip((points - a) @ along / length2, 0.0, 1.0) if length2 > 0.0 else np.zeros(len(points))
    away: FloatArray = np.hypot(*(a + t[:, None] * along - points).T)
    return away


@dataclass(frozen=True)
class Motion:
    """How a polygon moves.

    Attributes
    ----------
    velocity : (float, float)
        [m/s]; zero if it is not known.
    velocity_floor : float
        How far off that may be because of float32 [m/s].
    fault : str
        Why the motion is no translation; empty if it is one or if nothing is known yet.
    """

    velocity: tuple[float, float] = (0.0, 0.0)
    velocity_floor: float = 0.0
    fault: str = ""


class PolygonTracks:
    """Motion of every polygon from its last two instances."""

    def __init__(self) -> None:
        self._last: dict[str, tuple[int, FloatArray, FloatArray]] = {}

    def forget_all_but(self, names: Container[str]) -> None:
        """Forget the polygons that are not among `names`."""
        self._last = {name: last for name, last in self._last.items() if name in names}

    def update(self, name: str, points: FloatArray, floor: FloatArray, stamp_ns: int) -> Motion:
        """Take in an instance, (n, 2) points, each coordinate good to its floor, at a time [ns].

        A stamp that does not grow tells nothing about motion: the polygon counts as being at rest, as the first one
        does.
        """
        before = self._last.get(name)
        self._last[name] = (stamp_ns, points, floor)
        if before is None or stamp_ns <= before[0]:
            return Motion()
        if before[1].shape != points.shape:
            return Motion(fault=f"{NO_TRANSLATION}: {len(before[1])} points became {len(points)}")
        return displacement(before[1], points, before[2] + floor, (stamp_ns - before[0]) * 1e-9)


NO_TRANSLATION = "the motion is not a translation"


def displacement(before: FloatArray, after: FloatArray, slack: FloatArray, seconds: float) -> Motion:
    """The translation that takes one ring to the other, vertex by vertex, each coordinate up to its slack."""
    # Vertex i moved by a number in [lower_i, upper_i]; a translation lies in all of these intervals.
    moved = after - before
    lower, upper = (moved - slack).max(axis=0), (moved + slack).min(axis=0)
    if (lower > upper).any():
        return Motion(fault=NO_TRANSLATION)
    x, y = (0.5 * (lower + upper) / seconds).tolist()
    return Motion((x, y), float(np.hypot(*(0.5 * (upper - lower)))) / seconds)
