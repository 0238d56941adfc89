# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""First contact of a body on its way with objects of a scene: `first_contact_along`, of objects where they are.

Each piece of the way is the query for objects that turn, of the body and of the objects where they are by then.  What
they may be off by widens the interval, as it does for all pairs of a scene.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, replace

import numpy as np

from geomsrv import _validate
from geomsrv.answers import BoolArray, Bounded, ByteArray, ContactStatus, Cost, FloatArray, IntArray
from geomsrv.broad_phase import AABB_ROUNDING, boxes_swept
from geomsrv.errors import GeometryError
from geomsrv.narrow_phase import Unsupported, unpredictable
from geomsrv.placement import IDENTITY, laid_flat
from geomsrv.shapes import Shape
from geomsrv.trajectory import AcceleratedMotion, Look, Motion, Piece, Search, Trajectory, turned
from geomsrv.turning_pairs import SWITCHED_OFF, Question, ask_followed, followed_in_pairs, slack_of
from geomsrv.world import ShapeTable, World

__all__ = ["AlongContacts", "contacts_along", "motion_of"]

NO_KIND = "first contact along a path ({}) is unsupported"


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
    world: World, body: Shape, off: float, path: Motion, rows: IntArray, tolerance: float, rotation: bool = True
) -> AlongContacts:
    """When a body on a path first touches the objects in some rows of a world, which keep their twists.

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
    rotation : bool
        Whether to follow objects that turn.
    """
    begin = time.perf_counter_ns()
    step = _validate.scalar(tolerance, "tolerance", positive=True)
    both = _beside(world, body, rows)
    known, message = _followed(both, rotation)
    clear = _clear(world, both, off, path, rows)
    counts = {"pieces": 0, "boxes": int((known & clear).sum())}
    status = np.where(known, ContactStatus.NEVER, ContactStatus.UNSUPPORTED).astype(np.uint8)
    lower, upper, now = np.full((3, len(rows)), np.nan)
    normal, point = np.full((2, len(rows), 3), np.nan)
    chosen = np.flatnonzero(known & ~clear)
    if len(chosen):
        near = _beside(world, body, rows[chosen])
        doubt = np.column_stack([near.uncertainty[1:] + off, near.velocity_uncertainty[1:]])
        found = may = _InScene(near, path, step, 0.0 * doubt)
        found.run()
        if doubt.any():
            may = _InScene(near, path, step, doubt)
            may.run()
            counts["pieces"] += may.looked_at
        counts["pieces"] += found.looked_at
        never, vague = found.status == ContactStatus.NEVER, may.status == ContactStatus.NEVER
        status[chosen], now[chosen] = found.status, found.lower
        lower[chosen] = np.where(never, may.lower, np.fmin(may.lower, found.lower))
        upper[chosen] = np.where(vague, np.nan, np.where(never, np.inf, may.upper))
        normal[chosen], point[chosen] = found.normal, found.point
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


def _beside(world: World, body: Shape, rows: IntArray) -> World:
    """The body, and after it the objects in some rows; where the body is, and what it is off by, is said elsewhere."""
    shapes, which = np.unique(world.shape[rows], return_inverse=True)
    mine: IntArray = np.concatenate([[-1], rows])
    first = mine < 0

    def column(values: FloatArray, of_body: FloatArray | float) -> FloatArray:
        out = values[mine] if len(world) else np.zeros((len(mine), *values.shape[1:]))
        out[first] = of_body
        return out

    return replace(
        World.empty(),
        ids=("", *(world.ids[row] for row in rows.tolist())),
        table=ShapeTable.of([body, *(world.table.shapes[k] for k in shapes.tolist())], world.table),
        shape=np.concatenate([[0], which + 1]),
        uncertainty=column(world.uncertainty, 0.0),
        velocity_uncertainty=column(world.velocity_uncertainty, 0.0),
        motion_faults={
            k: world.motion_faults[row] for k, row in enumerate(mine.tolist()) if row in world.motion_faults
        },
        poses=column(world.poses, IDENTITY),
        twists=column(world.twists, 0.0),
    )


def _pairs(count: int) -> IntArray:
    """(count, 2) the body with every other object."""
    return np.column_stack([np.zeros(count, np.int64), np.arange(1, count + 1)])


def _followed(both: World, rotation: bool) -> tuple[BoolArray, str]:
    """(n,) bool: objects that are followed, and why others are not."""
    pairs = _pairs(len(both) - 1)
    unbounded = both.table.unbounded[both.shape[0]]
    fitting = followed_in_pairs(both, pairs) & (both.planar[1:] == both.planar[0]) & ~unbounded
    turning = fitting & both.turns[1:] & (not rotation)
    reasons = unpredictable(both, Unsupported.of_kinds(both, pairs[~fitting], NO_KIND)).reason.tolist()
    reasons += [SWITCHED_OFF] * bool(turning.any())
    return fitting & ~turning, "; ".join(dict.fromkeys(reasons))


def _clear(world: World, both: World, off: float, path: Motion, rows: IntArray) -> BoolArray:
    """(n,) bool: objects whose swept boxes keep clear of a box around the path, and so never meet the body."""
    if not len(rows):
        return np.zeros(0, np.bool_)
    swept = boxes_swept(world, path.end, rows)
    span = path.span
    # However it turns, the body is in the ball around its origin.
    reach = float(both.table.reach[0]) + off
    reach += AABB_ROUNDING * (reach + float(np.abs(span).max(axis=0).sum()))
    clear: BoolArray = ((swept.upper < span[0] - reach) | (swept.lower > span[1] + reach)).any(axis=1)
    return clear


class _InScene(Search):
    """A body, the first object of a world, and the others, placed anew for every piece."""

    def __init__(self, world: World, path: Motion, step: float, doubt: FloatArray) -> None:
        self._world = world
        place, reach = np.abs(world.poses[1:, :3]).sum(axis=1), world.table.reach[world.shape]
        speed, spin = (np.linalg.norm(part, axis=1) for part in np.split(world.twists[1:], 2, axis=1))
        # Of a half space that turns no more counts than where the body may be.
        around = float(np.abs(path.span).max(axis=0).sum()) + reach[0] + place + path.end * speed
        lever = np.where(np.isfinite(reach[1:]), reach[1:], around)
        super().__init__(path, float(reach[0]), place + lever, speed + spin * lever, step, doubt)

    def look(self, rows: IntArray, piece: Piece, since: float, slack: FloatArray) -> Look:
        """The query for objects that turn, of those that come near."""
        length, mine = piece.end - piece.start, np.concatenate([[0], rows + 1])
        poses, twists, shape = self._world.poses[mine], self._world.twists[mine], self._world.shape[mine]
        poses[:, :3] += since * twists[:, :3]
        if len(spins := np.flatnonzero(twists[:, 3:].any(axis=1))):
            poses[spins, 3:] = turned(poses[spins, 3:], since * twists[spins, 3:])
        poses[0], twists[0] = [*piece.place, *piece.turn], [*piece.linear, *piece.angular]
        ids, pairs = ("",) * len(mine), _pairs(len(rows))
        now = replace(World.empty(), ids=ids, table=self._world.table, shape=shape, poses=poses, twists=twists)
        room = slack + slack_of(now, pairs, 0.0)
        near = _come_near(now, length, room)
        self.looked_at += int(near.sum())
        status = np.full(len(rows), ContactStatus.NEVER, np.uint8)
        lower, upper = np.full((2, len(rows)), np.nan)
        normal, point = np.full((2, len(rows), 3), np.nan)
        if near.any():
            question = Question(length, tolerance=0.5 * self._step, contact_set=False)
            found = ask_followed(now, pairs[near], question, room[near])
            status[near], lower[near], upper[near], normal[near], sets = found
            for k, points in zip(np.flatnonzero(near).tolist(), sets, strict=True):
                point[k] = np.nan if points is None else points[0]
        return status, lower, upper, normal, point


def _come_near(world: World, length: float, room: FloatArray) -> BoolArray:
    """(n,) bool: objects whose balls, in which they are however they turn, may meet that of the first within a time."""
    reach = world.table.reach[world.shape]
    way, speed = world.poses[1:, :3] - world.poses[0, :3], world.twists[1:, :3] - world.twists[0, :3]
    with np.errstate(all="ignore"):
        # Where they are nearest, or a little later or earlier: that makes no more than 4 u of the way.
        nearest = np.clip(-(way * speed).sum(axis=1) / (speed * speed).sum(axis=1), 0.0, length)
        nearest = np.where(speed.any(axis=1), nearest, 0.0)
        apart = np.linalg.norm(way + nearest[:, None] * speed, axis=1)
        # The room is also for what places are rounded by, and so are these.
        near: BoolArray = ~(apart > reach[0] + reach[1:] + room[:, 1] + length * room[:, 2])
    return near
