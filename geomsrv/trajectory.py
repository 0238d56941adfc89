# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""First contact along a planned path, or under acceleration: time is cut into pieces of constant twist.

Each piece is the query for bodies that turn, whose bodies are widened by how far the motion strays from the piece; so
what is proven of the pieces is true of the motion.  Where a piece strays too far to tell, it is halved.

          x |            .-o- - -      o  listed poses, or ends of pieces
            |        .-o'      }stray
            |    o-'  .  .  .          pieces between them have a constant twist
            +-------------------- t
"""

from __future__ import annotations

import time
from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from geomsrv import _core, _validate
from geomsrv.answers import BoolArray, ByteArray, CollisionTimes, ContactStatus, Cost, FloatArray, IntArray, gather
from geomsrv.errors import GeometryError
from geomsrv.placement import product_of
from geomsrv.shapes import Box, Boxes, Convex, Polygon, Polygons, Polytopes, freeze, vertices_of
from geomsrv.world import ROUNDOFF

__all__ = ["AcceleratedMotion", "Look", "Motion", "Piece", "Search", "Trajectory", "first_contact_along", "turned"]

# Where a piece puts a point, relative to the coordinates involved.  An orientation that is composed takes the half of
# an angle, its sine and cosine, a product of quaternions that is normalised, and the matrix of it: 40 u of the reach.
# The twist of a piece is found from its ends by a quotient each, the angle by an arc tangent as well: 16 u of it;
# positions are sums of two or three numbers.  Rounded up; the same goes for obstacles that are placed anew.
PLACE_ROUNDING = 64.0 * ROUNDOFF

# Pieces are halved until they are this small a part of the time interval asked for; what cannot be told then never can.
FINEST = 2.0**-3

# What may be met, for all that the bodies may be off by, is followed on until it surely is, on pieces that stray by no
# more than this part of that.
SHARE_OF_DOUBT = 2.0**-3

# Pieces that are halved for one obstacle: what hovers just above it as it spins up would take millions.
MOST_HALVED = 4096


class Piece(NamedTuple):
    """A stretch of constant twist."""

    start: float  #: [s]
    end: float
    turn: FloatArray  #: (4,) unit quaternion x y z w of the body at the start
    place: FloatArray  #: (3,) origin of the body at the start [m]
    linear: FloatArray  #: (3,) [m/s]
    angular: FloatArray  #: (3,) [rad/s]
    straying: float  #: how far the origin may be from where the motion has it [m]
    leaning: float  #: how far the angle may be [rad]
    sizes: float  #: sum of the magnitudes of all that its places are sums of [m]
    angles: float  #: the same of its angles [rad]


@dataclass(frozen=True, eq=False)
class Trajectory:
    """A planned path: poses with times, between which the body moves at a constant twist.

    Between two poses the origin moves straight, and the body turns about it at a constant rate: by the shortest
    rotation in space, and in the plane by the difference of the yaw angles as they are given, which may be more than a
    turn.

    Attributes
    ----------
    times : (k,) float64
        Increasing [s], k >= 2.
    poses : (k, 7) or (k, 3) float64
        Position [m] and unit quaternion x y z w; or x, y [m] and yaw [rad] in the plane.

    Raises
    ------
    GeometryError
        Names the argument, the row and the fault.

    Examples
    --------
    >>> import geomsrv as gs
    >>> path = gs.Trajectory([0.0, 1.0, 3.0], [[0, 0, 0], [1, 0, 0], [1, 2, 1.57]])
    >>> path.end
    3.0
    """

    times: FloatArray
    poses: FloatArray

    def __init__(self, times: ArrayLike, poses: ArrayLike) -> None:
        when = _validate.floats(times, "times", (None,))
        rows = _validate.array(poses, "poses")
        if rows.ndim != 2 or rows.shape[1] not in (3, 7):
            raise GeometryError(f"poses must have shape (k, 7), or (k, 3) in the plane, got {rows.shape}")
        where = _validate.poses(rows, "poses") if rows.shape[1] == 7 else _validate.floats(rows, "poses", (None, 3))
        if len(when) != len(where) or len(when) < 2:
            raise GeometryError(f"times and poses must be as many, at least two; got {len(when)} and {len(where)}")
        late = np.flatnonzero(~(np.diff(when) > 0.0))
        if len(late):
            k = int(late[0]) + 1
            raise GeometryError(f"times[{k}] must be later than times[{k - 1}] = {when[k - 1]:g}, got {when[k]:g}")
        freeze(self, times=when, poses=where)

    @property
    def planar(self) -> bool:
        """Whether it is in the plane."""
        return bool(self.poses.shape[1] == 3)

    @property
    def start(self) -> float:
        """Time of the first pose [s]."""
        return float(self.times[0])

    @property
    def end(self) -> float:
        """Time of the last pose [s]."""
        return float(self.times[-1])

    @property
    def turns(self) -> bool:
        """Whether the body turns."""
        turn = self.poses[:, 2 if self.planar else 3 :]
        return bool((turn != turn[0]).any())

    @property
    def span(self) -> FloatArray:
        """(2, 3) lowest and highest coordinates of the origin on its way [m]: it moves straight from pose to pose."""
        places = self.poses[:, :3].copy()
        if self.planar:
            places[:, 2] = 0.0
        return np.array([places.min(axis=0), places.max(axis=0)])

    def pieces(self) -> list[tuple[float, float]]:
        """Times of neighbouring poses."""
        when = self.times.tolist()
        return list(zip(when, when[1:], strict=False))

    def piece(self, start: float, end: float) -> Piece:
        """From one pose to the next."""
        k = int(np.searchsorted(self.times, start))
        duration = end - start
        here, there = self.poses[k], self.poses[k + 1]
        if self.planar:
            place = np.array([here[0], here[1], 0.0])
            linear = np.array([there[0] - here[0], there[1] - here[1], 0.0]) / duration
            angular, turn = np.array([0.0, 0.0, there[2] - here[2]]) / duration, _about_z(here[2])
        else:
            place, turn = here[:3], here[3:]
            linear, angular = (there[:3] - here[:3]) / duration, _rotation_between(here[3:], there[3:]) / duration
        sizes = float(np.abs(place).sum() + duration * np.abs(linear).sum())
        angles = duration * float(np.linalg.norm(angular))
        return Piece(start, end, turn, place, linear, angular, 0.0, 0.0, sizes, angles)


@dataclass(frozen=True, eq=False)
class AcceleratedMotion:
    """A motion of second order: constant linear and angular acceleration.

    The origin is at ``p + v t + a t^2 / 2``; the body turns about it, and about a fixed axis, by the angle
    ``w t + b t^2 / 2``.

    Attributes
    ----------
    pose : (7,) or (3,) float64
        At t = 0: position [m] and unit quaternion x y z w; or x, y [m] and yaw [rad] in the plane.
    velocity, acceleration : (3,) or (2,) float64
        [m/s], [m/s^2], world frame.
    angular_velocity, angular_acceleration : (3,) float64 or float
        [rad/s], [rad/s^2], world frame; in space about the same axis, in the plane numbers.
    duration : float
        [s], > 0.

    Raises
    ------
    GeometryError
        Names the argument and the fault.

    Examples
    --------
    >>> import geomsrv as gs
    >>> braking = gs.AcceleratedMotion([0, 0, 0], [2.0, 0], acceleration=[-1.0, 0], duration=2.0)
    >>> wall = gs.Polygons.from_list([[(1.75, -1), (1.75, 1)]])
    >>> gs.first_contact_along(gs.Polygon([(-0.25, 0), (0.25, 0)]), braking, wall).time.round(6)
    array([1.])
    """

    pose: FloatArray
    velocity: FloatArray
    acceleration: FloatArray
    angular_velocity: FloatArray
    angular_acceleration: FloatArray
    duration: float

    def __init__(
        self,
        pose: ArrayLike,
        velocity: ArrayLike,
        *,
        acceleration: ArrayLike,
        angular_velocity: ArrayLike | None = None,
        angular_acceleration: ArrayLike | None = None,
        duration: float,
    ) -> None:
        place = _validate.array(pose, "pose")
        if place.shape not in ((3,), (7,)):
            raise GeometryError(f"pose must have shape (7,), or (3,) in the plane, got {place.shape}")
        flat = place.shape == (3,)
        where = _validate.floats(place, "pose", (3,)) if flat else _validate.poses(place[None], "pose")[0]
        along = [
            _validate.floats(value, name, (2 if flat else 3,))
            for name, value in (("velocity", velocity), ("acceleration", acceleration))
        ]
        about = []
        for name, value in (("angular_velocity", angular_velocity), ("angular_acceleration", angular_acceleration)):
            given = np.zeros(() if flat else 3) if value is None else _validate.array(value, name)
            rate = _validate.floats(given, name, () if flat else (3,))
            about.append(np.array([0.0, 0.0, float(rate)]) if flat else rate)
        # A multiple of a vector, rounded, is along it to an ulp.
        across, sizes = np.linalg.norm(np.cross(about[0], about[1])), np.linalg.norm(about, axis=1)
        if across > PLACE_ROUNDING * sizes[0] * sizes[1]:
            raise GeometryError("angular_acceleration must be about the axis of angular_velocity")
        end = _validate.scalar(duration, "duration", positive=True)
        freeze(self, pose=where, velocity=along[0], acceleration=along[1], duration=end)
        freeze(self, angular_velocity=about[0], angular_acceleration=about[1])

    @property
    def planar(self) -> bool:
        """Whether it is in the plane."""
        return self.pose.shape == (3,)

    @property
    def start(self) -> float:
        """0."""
        return 0.0

    @property
    def end(self) -> float:
        """The duration [s]."""
        return self.duration

    @property
    def turns(self) -> bool:
        """Whether the body turns."""
        return bool(self.angular_velocity.any() or self.angular_acceleration.any())

    @property
    def span(self) -> FloatArray:
        """(2, 3) lowest and highest coordinates of the origin on its way [m], rounded outwards."""
        # A coordinate is extreme at an end, or where it turns back: where v + a t = 0.  An error d of that time moves
        # it by a d^2 / 2, less than the rounding of the sums.
        speed, gain = self.velocity, self.acceleration
        with np.errstate(all="ignore"):
            back = np.where(gain == 0.0, 0.0, np.clip(-speed / gain, 0.0, self.duration))
        when = np.array([np.zeros_like(speed), back, np.full_like(speed, self.duration)])
        places = self.pose[: len(speed)] + when * (speed + 0.5 * when * gain)
        off = PLACE_ROUNDING * self._sizes(self.duration)
        out = np.zeros((2, 3))
        out[:, : len(speed)] = places.min(axis=0) - off, places.max(axis=0) + off
        return out

    def _sizes(self, until: float) -> float:
        """Sum of the magnitudes of all that places until a time are sums of."""
        parts = np.abs(self.pose[: len(self.velocity)]) + until * (
            np.abs(self.velocity) + 0.5 * until * np.abs(self.acceleration)
        )
        return float(parts.sum())

    def pieces(self) -> list[tuple[float, float]]:
        """All of it."""
        return [(0.0, self.duration)]

    def piece(self, start: float, end: float) -> Piece:
        """A chord: from where the body is at the start to where it is at the end."""
        length = end - start
        # The mean rate over the piece is that in its middle; a parabola is off its chord by a t^2 / 8 in between.
        middle, over = start + 0.5 * length, 0.125 * length * length
        linear = self.velocity + middle * self.acceleration
        angular = self.angular_velocity + middle * self.angular_acceleration
        angle = start * (self.angular_velocity + 0.5 * start * self.angular_acceleration)
        place = self.pose[: 2 if self.planar else 3] + start * (self.velocity + 0.5 * start * self.acceleration)
        if self.planar:
            turn, place, linear = _about_z(self.pose[2] + angle[2]), np.append(place, 0.0), np.append(linear, 0.0)
        else:
            turn = turned(self.pose[None, 3:], angle)[0]
        gain, rate, gain_about = (
            float(np.linalg.norm(x)) for x in (self.acceleration, self.angular_velocity, self.angular_acceleration)
        )
        angles = end * (rate + 0.5 * end * gain_about) + (abs(float(self.pose[2])) if self.planar else 0.0)
        return Piece(start, end, turn, place, linear, angular, gain * over, gain_about * over, self._sizes(end), angles)


Motion = Trajectory | AcceleratedMotion

Look = tuple[ByteArray, FloatArray, FloatArray, FloatArray, FloatArray]  #: status, lower, upper, normal, point


def first_contact_along(
    body: Polygon | Box | Convex,
    motion: Motion,
    obstacles: Polygons | Boxes | Polytopes,
    *,
    velocities: ArrayLike | None = None,
    tolerance: float = 1e-6,
) -> CollisionTimes:
    """When a body on its way first touches obstacles.

    Parameters
    ----------
    body : Polygon (2D), Box or Convex (3D)
        In its own frame, which the motion places.
    motion : Trajectory or AcceleratedMotion
    obstacles : Polygons (2D), Boxes or Polytopes (3D)
        Where they are at the start of the motion, world frame.
    velocities : (n, d) or (d,) float, optional
        Constant velocities of the obstacles [m/s].  By default they rest.
    tolerance : float
        Widest time interval of WILL_TOUCH [s], > 0.

    Returns
    -------
    CollisionTimes
        Times are those of the motion.  ``time`` is ``time_lower``: free of contact before it, for the motion as its
        class describes it; contact is proven until ``time_upper``, which is inf where it is not.
        At the start OVERLAPPING is proven; TOUCHING may be either.  NOT_CONVERGED: ``time_lower`` is as far as the
        work budget reached.  ``cost.counts``: "pieces" looked at.

    Raises
    ------
    GeometryError
        Names the argument, the index and the fault.

    References
    ----------
    Conservative advancement (Mirtich, 1996) on pieces of constant twist.

    Examples
    --------
    Past a corner: straight on, then a quarter turn on the spot.

    >>> import geomsrv as gs
    >>> path = gs.Trajectory([0.0, 2.0, 4.0], [[0, 0, 0], [2, 0, 0], [2, 0, 1.5707963]])
    >>> bar = gs.Polygon([(-1, -0.1), (1, -0.1), (1, 0.1), (-1, 0.1)])
    >>> posts = gs.Polygons.from_list([[(2.0, 0.8)], [(2.5, 0.05)], [(0, 2)]])
    >>> found = gs.first_contact_along(bar, path, posts)
    >>> found.status, found.time.round(4)
    (array([1, 1, 0], dtype=uint8), array([3.8404, 1.5   ,    nan]))
    """
    begin = time.perf_counter_ns()
    step = _validate.scalar(tolerance, "tolerance", positive=True)
    if not isinstance(motion, Motion):
        raise GeometryError(f"motion must be Trajectory or AcceleratedMotion, got {type(motion).__name__}")
    vertices = _vertices(body, motion.planar)
    kinds = (Polygons,) if motion.planar else (Boxes, Polytopes)
    if not isinstance(obstacles, kinds):
        names = " or ".join(kind.__name__ for kind in kinds)
        raise GeometryError(f"obstacles must be {names} for such a motion, got {type(obstacles).__name__}")
    drift = _validate.velocities(velocities, len(obstacles), 2 if motion.planar else 3)
    search = _Listed(vertices, motion, obstacles, drift, step)
    search.run()
    status, lower, upper = search.status, search.lower, search.upper
    certain = (status < ContactStatus.UNSUPPORTED) & ((status != ContactStatus.TOUCHING) | (upper == motion.start))
    return CollisionTimes(
        status=status,
        time=lower.copy(),
        time_lower=lower,
        time_upper=upper,
        certain=certain,
        cost=Cost(time.perf_counter_ns() - begin, "float64", {"pieces": search.looked_at}),
    )


class Search(ABC):
    """Obstacle by obstacle, the first piece with a contact, halved until it can be told.

    What is asked of a piece, and of which obstacles, is for those to say that have them.

    Parameters
    ----------
    motion : Trajectory or AcceleratedMotion
    reach : float
        Of the body, from its origin [m].
    far, speed : (n,) float64
        For each obstacle the sum of all that places on it are sums of at the start [m], and how fast they grow [m/s].
    step : float
        Tolerance [s].
    doubt : (n, 2) float64
        What the bodies may be off by in place [m] and velocity [m/s]: the answer holds for all bodies within.
    """

    def __init__(
        self, motion: Motion, reach: float, far: FloatArray, speed: FloatArray, step: float, doubt: FloatArray
    ) -> None:
        self._motion, self._reach, self._far, self._speed = motion, reach, far, speed
        self._step, self._doubt = step, doubt
        count = len(far)
        self.status = np.full(count, ContactStatus.NEVER, np.uint8)
        self.lower, self.upper = np.full(count, np.nan), np.full(count, np.nan)
        self.normal, self.point = np.full((count, 3), np.nan), np.full((count, 3), np.nan)
        self.looked_at = 0
        self._halved = np.zeros(count, np.int64)

    @abstractmethod
    def look(self, rows: IntArray, piece: Piece, since: float, slack: FloatArray) -> Look:
        """What a piece that begins `since` seconds after the motion has with obstacles in some rows, in its own time.

        The time is found to half the tolerance; slack (k, 3) is what the engine's kernel for bodies that turn takes.
        """

    def run(self) -> None:
        """Find the status of every obstacle, its times, and normal and point at the earlier one."""
        open_rows: IntArray = np.arange(len(self.status))
        for start, end in self._motion.pieces():
            if not len(open_rows):
                break
            open_rows = self._follow(open_rows, start, end)

    def _follow(self, rows: IntArray, start: float, end: float) -> IntArray:
        """Settle what has a contact between two times; returns the rows that have none, or that may have none."""
        piece = self._motion.piece(start, end)
        begun = np.isfinite(self.lower[rows])
        status, lower, upper, normal, point, fine = self._ask(rows, piece, begun)
        free = status == ContactStatus.NEVER
        at_start = start == self._motion.start
        proven = np.isfinite(upper) & (upper - lower <= self._step)
        settled = ~free & (fine | (proven & ~begun))
        if at_start:
            settled |= status == ContactStatus.OVERLAPPING
            settled &= (status != ContactStatus.TOUCHING) | fine
        spent = ~free & ~settled & (self._halved[rows] == MOST_HALVED)
        status[spent] = ContactStatus.NOT_CONVERGED
        settled |= spent
        vague = rows[~free & ~settled]
        if (new := settled & ~begun).any():
            done = rows[new]
            self._settle(done, status[new], lower[new], upper[new], proven[new], at_start)
            self.normal[done], self.point[done] = normal[new], point[new]
        self.upper[rows[settled & begun]] = upper[settled & begun]
        unsure = settled & ~spent & np.isinf(upper) & self._doubt[rows].any(axis=1)
        if len(vague):
            self._halved[vague] += 1
            middle = start + 0.5 * (end - start)
            vague = self._follow(self._follow(vague, start, middle), middle, end)
        return np.sort(np.concatenate([rows[free | unsure], vague]))

    def _settle(
        self,
        rows: IntArray,
        status: ByteArray,
        lower: FloatArray,
        upper: FloatArray,
        proven: BoolArray,
        at_start: bool,
    ) -> None:
        """Contact within a piece is contact to come, unless it is the first one and there from the start."""
        there = (status == ContactStatus.OVERLAPPING) | (status == ContactStatus.TOUCHING)
        named = np.where(proven, ContactStatus.WILL_TOUCH, ContactStatus.GRAZING)
        named[status == ContactStatus.NOT_CONVERGED] = ContactStatus.NOT_CONVERGED
        self.status[rows] = np.where(there, status, named) if at_start else named
        self.lower[rows], self.upper[rows] = lower, upper

    def _ask(
        self, rows: IntArray, piece: Piece, begun: BoolArray
    ) -> tuple[ByteArray, FloatArray, FloatArray, FloatArray, FloatArray, BoolArray]:
        """The engine's answer on a piece, in times of the motion, and whether it is as fine as it need be.

        Of rows that have `begun` to be in doubt, and are followed until they surely meet, that need not be much.
        """
        length, since = piece.end - piece.start, piece.start - self._motion.start
        rounding = PLACE_ROUNDING * (
            self._reach * (1.0 + piece.angles) + piece.sizes + self._far[rows] + self._speed[rows] * (since + length)
        )
        stray = piece.straying + piece.leaning * self._reach
        doubt, drift = self._doubt[rows].T
        off = doubt + since * (1.0 + PLACE_ROUNDING) * drift + rounding + stray
        slack = np.column_stack([np.zeros(len(rows)), off, drift])
        found = self.look(rows, piece, since, slack)
        shift = np.where(np.isnan(found[1]), 0.0, piece.start)
        # Rounding of the sum; the piece's own ends are exact.
        lower = np.maximum(np.nextafter(found[1] + shift, -np.inf), piece.start)
        upper = np.nextafter(found[2] + shift, np.inf)
        upper = np.where(found[2] == 0.0, piece.start, upper)
        fine = (stray <= rounding) | (length <= FINEST * self._step) | (begun & (stray <= SHARE_OF_DOUBT * off))
        return found[0], lower, upper, found[3], found[4], fine


class _Listed(Search):
    """Obstacles in a batch, and a body by its vertices."""

    def __init__(
        self,
        vertices: FloatArray,
        motion: Motion,
        obstacles: Polygons | Boxes | Polytopes,
        drift: FloatArray,
        step: float,
    ) -> None:
        self._vertices, self._obstacles = vertices, obstacles
        count = len(obstacles)
        self._drift = np.broadcast_to(drift, (count, drift.shape[1]))
        far = np.zeros(count)  # of each alone, so that no answer depends on what else is asked about
        if isinstance(obstacles, Boxes):
            far += np.abs(obstacles.center).sum(axis=1) + np.linalg.norm(obstacles.half_extents, axis=1)
        elif count:
            far += np.maximum.reduceat(np.abs(obstacles.vertices).sum(axis=1), obstacles.offsets[:-1])
        reach = float(np.linalg.norm(vertices, axis=1).max())
        super().__init__(motion, reach, far, np.abs(self._drift).max(axis=1), step, np.zeros((count, 2)))

    def look(self, rows: IntArray, piece: Piece, since: float, slack: FloatArray) -> Look:
        """The query for bodies that turn."""
        self.looked_at += len(rows)
        placed = self._vertices @ _validate.rotation_matrices(piece.turn[None])[0].T + piece.place
        body = (placed[:, :2].copy() if self._motion.planar else placed, np.array([0, len(placed)]))
        motion = np.concatenate([piece.linear, piece.angular, piece.place])[None]
        others, motions = self._others(rows, since)
        found = _core.first_contact_turning(
            body, others, motion, motions, piece.end - piece.start, 0.5 * self._step, slack
        )
        return found[:5]

    def _others(self, rows: IntArray, since: float) -> tuple[tuple[FloatArray | IntArray, ...], FloatArray]:
        """The obstacles of some rows after a while, and their motions."""
        drift = self._drift[rows]
        motions = np.zeros((len(rows), 9))
        motions[:, : drift.shape[1]] = drift
        shift = since * drift
        if isinstance(self._obstacles, Boxes):
            center = self._obstacles.center[rows] + shift
            motions[:, 6:] = center
            axes, half = self._obstacles.axes[rows], self._obstacles.half_extents[rows]
            return (center, np.ascontiguousarray(axes), np.ascontiguousarray(half)), motions
        vertices, ends = gather(self._obstacles.vertices, self._obstacles.offsets, rows)
        vertices = vertices + np.repeat(shift, np.diff(ends), axis=0)
        motions[:, 6 : 6 + vertices.shape[1]] = vertices[ends[:-1]]
        return (vertices, ends), motions


def _vertices(body: Polygon | Box | Convex, flat: bool) -> FloatArray:
    """(m, 3) vertices of a body in its own frame."""
    if flat:
        if not isinstance(body, Polygon):
            raise GeometryError(f"body must be Polygon for a motion in the plane, got {type(body).__name__}")
        return np.column_stack([body.vertices, np.zeros(len(body.vertices))])
    if not isinstance(body, Box | Convex):
        raise GeometryError(f"body must be Box or Convex for a motion in space, got {type(body).__name__}")
    return vertices_of(body)


def turned(quaternions: FloatArray, angles: FloatArray) -> FloatArray:
    """(n, 4) orientations x y z w after rotations about vectors, (n, 3) or one for all, by their lengths [rad]."""
    size = np.linalg.norm(angles, axis=-1, keepdims=True)
    axis = angles / np.where(size > 0.0, size, 1.0)
    out = product_of(np.concatenate([np.sin(0.5 * size) * axis, np.cos(0.5 * size)], axis=-1), quaternions)
    unit: FloatArray = out / np.linalg.norm(out, axis=1, keepdims=True)
    return unit


def _about_z(angle: float) -> FloatArray:
    return np.array([0.0, 0.0, np.sin(0.5 * angle), np.cos(0.5 * angle)])


def _rotation_between(here: FloatArray, there: FloatArray) -> FloatArray:
    """Rotation vector, world frame, of the shortest rotation from one orientation to another."""
    va, wa, vb, wb = -here[:3], here[3], there[:3], there[3]
    vector = wb * va + wa * vb + np.cross(vb, va)
    scalar = wb * wa - vb @ va
    size = float(np.linalg.norm(vector))
    if size == 0.0:
        return np.zeros(3)
    angle = 2.0 * np.arctan2(size, abs(scalar))
    rotation: FloatArray = vector * (np.copysign(angle, scalar) / size)
    return rotation
