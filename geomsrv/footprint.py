# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""When a robot on a twist first hits something: a scan's points, polygons, and obstacles that move."""

from __future__ import annotations

import time
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from geomsrv import _core, _validate
from geomsrv.answers import CollisionTimes, ContactStatus, Cost, FloatArray
from geomsrv.errors import GeometryError
from geomsrv.region import Region
from geomsrv.shapes import Polygon, Polygons

__all__ = ["time_to_collision"]


def time_to_collision(
    footprint: ArrayLike | Polygon | Region,
    twist: ArrayLike,
    obstacles: ArrayLike | Polygons,
    *,
    velocities: ArrayLike | None = None,
    t_max: float = np.inf,
    tolerance: float = 1e-6,
) -> CollisionTimes:
    """When a robot that keeps its twist first hits obstacles.

    Parameters
    ----------
    footprint : (m, 2) float, Polygon or Region
        Convex counter-clockwise ring [m], robot frame; or a region, convex or not.
    twist : (3,) float
        Velocity of the frame's origin, x and y [m/s], and yaw rate [rad/s], all in the robot's frame, which turns: with
        a yaw rate the robot drives along an arc.
    obstacles : (n, 2) float, or Polygons
        Points, as of a laser scan, or convex polygons [m]; in the robot's frame at the start.
    velocities : (n, 2) or (2,) float, optional
        Constant velocities of the obstacles [m/s], in that frame, which stays where it is.  By default they rest.
    t_max : float
        End of the time window [s], >= 0; may be inf.
    tolerance : float
        Widest time interval of WILL_TOUCH [s], > 0, or 2^-47 of the time if that is more; of polygons without a yaw
        rate, and of points mostly, it is some roundings wide.

    Returns
    -------
    CollisionTimes
        ``time`` is ``time_lower``: free of contact before it.  Contact is proven until ``time_upper``, which is inf for
        outcomes other than WILL_TOUCH where none is.  ``cost.counts``: obstacles decided in "closed" form, and as
        bodies that "turning" describes.

    Raises
    ------
    GeometryError
        Names the argument, the index and the fault.

    Examples
    --------
    >>> import geomsrv as gs
    >>> robot = [(-0.3, -0.2), (0.3, -0.2), (0.3, 0.2), (-0.3, 0.2)]
    >>> scan = [(1.3, 0.0), (0.0, 0.7), (1.0, 1.2)]
    >>> ahead = gs.time_to_collision(robot, (0.5, 0.0, 0.0), scan)
    >>> ahead.status, ahead.first, round(ahead.earliest, 6)
    (array([1, 0, 0], dtype=uint8), 0, 2.0)
    >>> gs.time_to_collision(robot, (0.5, 0.0, 0.5), scan).time.round(6)
    array([     nan,      nan, 2.939201])
    """
    start = time.perf_counter_ns()
    region = footprint if isinstance(footprint, Region) else None
    rings = [_ring(footprint)] if not isinstance(footprint, Region) else _rings(footprint)
    motion = _validate.floats(twist, "twist", (3,))
    end = _validate.limit(t_max, "t_max")
    step = _validate.scalar(tolerance, "tolerance", positive=True)
    points = None
    if isinstance(obstacles, Polygons):
        rest = _validate.velocities(velocities, len(obstacles), 2)
        found = [_polygons(ring, motion, obstacles, rest, end, step) for ring in rings]
    else:
        points = _validate.floats(obstacles, "obstacles", (None, 2))
        rest = _validate.velocities(velocities, len(points), 2)
        found = [_core.points_on_twist(ring, motion, points, rest, end, step) for ring in rings]
    status, lower, upper = found[0][:3]
    closed = min(piece[3] for piece in found)
    if region is not None:
        status, lower, upper = _union(region, found, points, step)
    certain = (status < ContactStatus.UNSUPPORTED) & ((status != ContactStatus.TOUCHING) | (upper == 0.0))
    return CollisionTimes(
        status=status,
        time=lower.copy(),
        time_lower=lower,
        time_upper=upper,
        certain=certain,
        cost=Cost(time.perf_counter_ns() - start, "float64", {"closed": closed, "turning": len(status) - closed}),
    )


def _polygons(
    ring: FloatArray, twist: FloatArray, obstacles: Polygons, velocities: FloatArray, end: float, step: float
) -> tuple[Any, FloatArray, FloatArray, int]:
    """Status, lower, upper, and how many are in closed form."""
    alone = np.array([0, len(ring)])
    if twist[2] == 0.0:
        answer = _core.first_contact_polygons(
            ring, alone, obstacles.vertices, obstacles.offsets, twist[None, :2].copy(), velocities, end, False
        )
        return answer[0], answer[2], answer[3], len(obstacles)
    x, y, drift, period = _core.turn_of_twist(twist)
    if not (np.isfinite(x) and np.isfinite(y)):
        raise GeometryError(f"twist[2] is {twist[2]}, too small for the centre of the arc to be a number")
    if not velocities.any():
        end = min(end, period)
    robot = np.array([[0.0, 0.0, 0.0, 0.0, 0.0, twist[2], x, y, 0.0]])
    others = np.zeros((len(obstacles), 9))
    others[:, :2] = velocities
    others[:, 6:8] = obstacles.vertices[obstacles.offsets[:-1]]
    bodies = (ring, alone), (obstacles.vertices, obstacles.offsets)
    found = _core.first_contact_turning(*bodies, robot, others, end, step, np.array([[0.0, 0.0, drift]]))
    return found[0], found[1], found[2], 0


def _union(
    region: Region, found: list[Any], points: FloatArray | None, step: float
) -> tuple[Any, FloatArray, FloatArray]:
    """Of all pieces the first contact."""
    status, lower, upper = (np.array([piece[k] for piece in found]) for k in range(3))
    first = np.where(status == ContactStatus.NEVER, np.inf, lower).argmin(axis=0)
    every = np.arange(status.shape[1])
    outcome = status[first, every]
    low, high = lower[first, every], np.fmin.reduce(upper, axis=0)
    apart = (outcome == ContactStatus.WILL_TOUCH) | (outcome == ContactStatus.GRAZING)
    outcome[apart] = np.where((high - low)[apart] <= step, ContactStatus.WILL_TOUCH, ContactStatus.GRAZING)
    outcome[(status == ContactStatus.OVERLAPPING).any(axis=0)] = ContactStatus.OVERLAPPING
    if points is not None:
        # On the seam of two pieces it is inside.
        for i in np.flatnonzero((outcome == ContactStatus.TOUCHING) & (high == 0.0)):
            if not region.on_border(points[i]):
                outcome[i] = ContactStatus.OVERLAPPING
    return outcome, low, high


def _rings(region: Region) -> list[FloatArray]:
    pieces = region.pieces
    return [pieces[i] for i in range(len(pieces))]


def _ring(footprint: ArrayLike | Polygon) -> FloatArray:
    if isinstance(footprint, Polygon):
        return footprint.vertices
    points = _validate.floats(footprint, "footprint", (None, 2))
    if len(points) == 0:
        raise GeometryError("footprint must hold at least one point")
    try:
        return Polygons(points, [0, len(points)]).vertices
    except GeometryError as error:
        raise GeometryError(str(error).replace("vertices: ring 0", "footprint")) from None
