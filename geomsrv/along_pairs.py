# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""First contact of a body on its way with objects of a scene: `first_contact_along`, of objects where they are.

Of spheres and capsules the cores are followed, which are in contact when they are as near as the radii.  What the body
and an object may be off by widens the interval, as it does for all pairs of a scene.
"""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from geomsrv import _validate
from geomsrv.answers import BoolArray, Bounded, ByteArray, ContactStatus, Cost, FloatArray, IntArray, gather
from geomsrv.broad_phase import AABB_ROUNDING, boxes_swept
from geomsrv.errors import GeometryError
from geomsrv.narrow_phase import placed_boxes
from geomsrv.placement import laid_flat
from geomsrv.shapes import Box, Boxes, Polygon, Polygons, Polytopes, Shape, vertices_of
from geomsrv.trajectory import AcceleratedMotion, Motion, Search, Trajectory
from geomsrv.turning_pairs import CAPSULE_ROUNDING, core_of_solids, radii
from geomsrv.world import ShapeTable, World

__all__ = ["AlongContacts", "contacts_along", "motion_of"]

KINDS = (
    "box",
    "capsule",
    "convex",
    "sphere",
)  #: of solids that are followed, points, segments and triangles being hulls

NO_KIND = "first contact along a path ({}) is unsupported"
NO_TURN = "first contact along a path with what turns ({}) is unsupported"


@dataclass(frozen=True, eq=False)
class AlongContacts(Bounded):
    """First contacts of a body on its way with n objects.

    Attributes
    ----------
    status : (n,) uint8
        `ContactStatus`.
    time, time_lower, time_upper : (n,) float64
        [s], of the path; NaN for NEVER.  The interval holds for all that the bodies may be off by: an upper end of
        inf says that they may miss, and one of NEVER that they may meet.
    normal, point : (n, 3) float64
        From the body to the object, and where, at `time`; NaN where there is none.
    message : str
        Why some are unsupported.
    cost : Cost
        ``counts``: "pieces" of the path looked at, and "boxes" that keep clear of it.
    """

    status: ByteArray
    time: FloatArray
    time_lower: FloatArray
    time_upper: FloatArray
    normal: FloatArray
    point: FloatArray
    message: str
    cost: Cost


def motion_of(times: FloatArray, poses: FloatArray, twist: FloatArray, acceleration: FloatArray, flat: bool) -> Motion:
    """A motion from now on: along `poses` (k, 7), or, where the other two are given, of second order from one pose.

    A polygon's is one in the plane, with yaw angles, rounded, that turn by less than half a turn from pose to pose.

    Raises
    ------
    GeometryError
        Names the argument, the row and the fault.
    """
    begin = "times[0] must be 0, where the motion begins: now; got {:g}"
    if not (len(twist) or len(acceleration)):
        path = Trajectory(times, poses)
        if path.start != 0.0:
            raise GeometryError(begin.format(path.start))
        return Trajectory(path.times, _in_plane(path.poses)) if flat else path
    rates = {"twist": twist, "acceleration": acceleration}
    for name, numbers in rates.items():
        if len(numbers) != 6:
            raise GeometryError(f"twist and acceleration must hold 6 numbers each, or none; {name} has {len(numbers)}")
        _validate.floats(numbers, name, (6,))
        if flat and numbers[2:5].any():
            raise GeometryError(f"{name}[2:5] must be 0: a polygon stays in the plane z = 0 of the fixed frame")
    for name, items, count in (("times", times, 2), ("poses", poses, 1)):
        if len(items) != count:
            what = "0 and the duration" if name == "times" else "the one at the start"
            raise GeometryError(f"{name} must be {what}, where a twist is given; got {len(items)}")
    start, end = _validate.floats(times, "times", (2,)).tolist()
    if start != 0.0:
        raise GeometryError(begin.format(start))
    if not end > 0.0:
        raise GeometryError(f"times[1] must be > 0, the duration; got {end:g}")
    pose = _validate.poses(poses, "poses")
    place = (_in_plane(pose) if flat else pose)[0]
    along, about = (slice(2), 5) if flat else (slice(3), slice(3, 6))
    try:
        return AcceleratedMotion(
            place,
            twist[along],
            acceleration=acceleration[along],
            angular_velocity=twist[about],
            angular_acceleration=acceleration[about],
            duration=end,
        )
    except GeometryError as fault:  # what is left to be wrong: the axes
        raise GeometryError(f"twist[3:], acceleration[3:]: {fault}") from None


def _in_plane(poses: FloatArray) -> FloatArray:
    """(k, 3) x, y and yaw of poses of a polygon."""
    laid, faults = laid_flat(poses, None, np.ones(len(poses), np.bool_))
    if faults:
        row = min(faults)
        raise GeometryError(f"poses[{row}]: {faults[row]}")
    yaw = np.unwrap(2.0 * np.arctan2(laid[:, 5], laid[:, 6]))
    return np.column_stack([laid[:, :2], yaw])


def contacts_along(
    world: World, body: Shape, off: float, path: Motion, rows: IntArray, tolerance: float
) -> AlongContacts:
    """When a body on a path first touches the objects in some rows of a world, which keep their velocities.

    Parameters
    ----------
    body : Shape
        In its own frame, which the path places.
    off : float
        How far it may be off the path [m].
    path : Trajectory or AcceleratedMotion
        In the plane for a Polygon; its times are those of the world from now.
    rows : (n,) int64
    tolerance : float
        Widest interval of WILL_TOUCH [s].
    """
    begin = time.perf_counter_ns()
    step = _validate.scalar(tolerance, "tolerance", positive=True)
    count = len(rows)
    status = np.full(count, ContactStatus.NEVER, np.uint8)
    nothing = np.full(count, np.nan)
    lower, upper, now = nothing.copy(), nothing.copy(), nothing.copy()
    normal, point = np.full((count, 3), np.nan), np.full((count, 3), np.nan)
    known, message = _followed(world, body, rows)
    status[~known] = ContactStatus.UNSUPPORTED
    table = ShapeTable.of([body])
    clear = _clear(world, table, off, path, rows)
    counts = {"pieces": 0, "boxes": int((known & clear).sum())}
    boxes = world.table.boxes[world.shape[rows]]
    for part in (known & ~clear & boxes, known & ~clear & ~boxes):
        chosen = np.flatnonzero(part)
        if not len(chosen):
            continue
        mine = rows[chosen]
        doubt = np.column_stack([world.uncertainty[mine] + off, world.velocity_uncertainty[mine]])
        found = may = _search(world, table, path, mine, step, 0.0 * doubt)
        if doubt.any():
            may = _search(world, table, path, mine, step, doubt)
            counts["pieces"] += may.looked_at
        counts["pieces"] += found.looked_at
        never, vague = found.status == ContactStatus.NEVER, may.status == ContactStatus.NEVER
        status[chosen], now[chosen] = found.status, found.lower
        lower[chosen] = np.where(never, may.lower, np.fmin(may.lower, found.lower))
        upper[chosen] = np.where(vague, np.nan, np.where(never, np.inf, may.upper))
        # Points are those of the cores.
        shift = 0.5 * (table.round[0] * _is_round(table)[0] - radii(world)[mine])
        normal[chosen] = found.normal
        point[chosen] = found.point + shift[:, None] * np.nan_to_num(found.normal)
    return AlongContacts(
        status=status,
        time=now,
        time_lower=lower,
        time_upper=upper,
        normal=normal,
        point=point,
        message=message,
        cost=Cost(time.perf_counter_ns() - begin, "float64", counts),
    )


def _followed(world: World, body: Shape, rows: IntArray) -> tuple[BoolArray, str]:
    """(n,) bool: objects that are followed, and why others are not."""
    flat = isinstance(body, Polygon)
    kinds = np.array([_kind(shape) for shape in world.table.shapes], dtype=object)[world.shape[rows]]
    fitting = world.planar[rows] if flat else np.isin(kinds, KINDS)
    fitting &= flat or _kind(body) in KINDS
    turning = world.turns[rows]
    reasons = []
    for part, text in ((~fitting, NO_KIND), (fitting & turning, NO_TURN)):
        pairs = sorted({"-".join(sorted((_kind(body), kind))) for kind in kinds[part].tolist()})
        reasons += [text.format(pair) for pair in pairs]
    return fitting & ~turning, "; ".join(reasons)


def _kind(shape: object) -> str:
    """Points, segments and triangles are hulls; a frustum, whose corners are rounded, is none here."""
    kind: str = shape.kind  # type: ignore[attr-defined]
    return "convex" if kind in ("point", "segment", "triangle") else kind


def _is_round(table: ShapeTable) -> NDArray[np.bool_]:
    return np.array([shape.kind in ("sphere", "capsule") for shape in table.shapes])


def _clear(world: World, table: ShapeTable, off: float, path: Motion, rows: IntArray) -> BoolArray:
    """(n,) bool: objects whose swept boxes keep clear of a box around the path, and so never meet the body."""
    if not len(rows):
        return np.zeros(0, np.bool_)
    swept = boxes_swept(world, path.end, rows)
    span = path.span
    # However it turns, the body is in the ball around its origin.
    reach = float(table.reach[0]) + off
    reach += AABB_ROUNDING * (reach + float(np.abs(span).max(axis=0).sum()))
    clear: BoolArray = ((swept.upper < span[0] - reach) | (swept.lower > span[1] + reach)).any(axis=1)
    return clear


def _search(
    world: World, table: ShapeTable, path: Motion, rows: IntArray, tolerance: float, doubt: FloatArray
) -> Search:
    body = table.shapes[0]
    obstacles: Polygons | Boxes | Polytopes
    if path.planar:
        obstacles = Polygons(*gather(*world.rings, rows))
    elif world.table.boxes[world.shape[rows[0]]]:
        obstacles = Boxes(*placed_boxes(world, rows))
    else:
        obstacles = Polytopes(*core_of_solids(world, rows))
    margin = np.zeros(len(rows)) if path.planar else radii(world)[rows] + table.round[0] * _is_round(table)[0]
    size = np.abs(world.poses[rows, :3]).sum(axis=1) + world.table.reach[world.shape[rows]]
    # Ends of capsules are placed, and radii added.
    rounding = CAPSULE_ROUNDING * (margin + np.where(margin > 0.0, size, 0.0))
    room = np.column_stack([margin, doubt[:, 0] + rounding, doubt[:, 1]])
    drift = np.ascontiguousarray(world.twists[rows, : 2 if path.planar else 3])
    search = Search(_core_vertices(body, table), path, obstacles, drift, tolerance, room)
    search.run()
    return search


def _core_vertices(body: object, table: ShapeTable) -> FloatArray:
    """(m, 3) vertices of a body, or of the core of a round one, in its own frame."""
    if isinstance(body, Polygon):
        return np.column_stack([body.vertices, np.zeros(len(body.vertices))])
    if isinstance(body, Box):
        return vertices_of(body)
    if _is_round(table)[0]:
        half = float(table.packed.params[0, 1])
        return np.array([[0.0, 0.0, -half], [0.0, 0.0, half]][: 2 if half else 1])
    return table.packed.vertices
