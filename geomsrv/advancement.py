# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""First contact of solids in motion of which one is curved or a half space: conservative advancement, many at once.

At a time t the distance kernel gives a direction n along which the bodies of a pair are apart, and by how much at
least.  How far they come nearer along n within the next s seconds has a bound that is concave in s: supports are convex
functions of the direction, and a point at r from what it turns about strays from its tangent by s² w² r / 2 at most.
So wherever that bound is not negative the bodies are apart until then, and from there they are looked at again.  Close
to contact it is looked for a little ahead: a time at which the depth proves it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from geomsrv import _core, _validate
from geomsrv.answers import BoolArray, ByteArray, ContactStatus, DistanceStatus, FloatArray, IntArray, gather
from geomsrv.narrow_phase import RELATIVE_POSE_ROUNDING
from geomsrv.world import ROUNDOFF, World

__all__ = ["Look", "advance", "nearest_at"]

# Looks at a pair; what has not come to an end then turns fast beside a body that it does not meet, or for ever.
MOST_LOOKS = 1000

# A pose at a time: a position takes a product and a sum, 2 u in each of three coordinates; half an angle, its sine and
# cosine 3 u of the angle and 2 u, the product of quaternions 8 u, normalising it 4 u, and turning takes twice that.
PLACE_ROUNDING = 8.0 * ROUNDOFF
TURN_ROUNDING = 8.0 * ROUNDOFF  #: of the angle
ORIENTATION_ROUNDING = 40.0 * ROUNDOFF

# A support of a body, along a direction turned into its axes, 6 u, from products, a root and sums, 10 u; the normal
# that the kernel gives, turned into the fixed frame, 22 u; velocities along it 8 u.  Rounded up.
ALONG_ROUNDING = 64.0 * ROUNDOFF

# Balls around bodies are larger by these shares of their radii and of their distance: the discriminant of a quadratic
# loses less than 16 u of the square of the distance.
BALL_ROUNDING = 2.0**-30
BALL_DISTANCE_ROUNDING = 2.0**-24

# The first try of a step is shorter by this share than where its bound ends, which is then not lost in its rounding.
FIRST_ROUNDING = 2.0**-30

# A step is shortened by this share: a sum, a quotient and the time itself.
STEP_ROUNDING = 16.0 * ROUNDOFF

LARGEST_ANGLE = 2.0**30  #: [rad]; beyond it the angle itself is off by too much to be worth a look

# Contact is looked for where the step is no longer than this part of the tolerance: first at so many steps ahead, then
# further, and at the end of the tolerance.
STEPS_AHEAD = 4.0
FURTHER_AHEAD = 8.0
TRIES = 4
WITHIN = 1.0 - 2.0**-20  #: of the tolerance, so that the end of it, rounded, is not beyond
LATE_TRIES = 30  #: where the bounds are stuck: at tolerances twice as long each time

DOUBLINGS, CHORDS = 6, 3  #: how a step is made longer while its bound allows it, and then by chords

ALMOST_ALONG = 0.125  #: a solid of revolution that turns about its axis, but for this share, counts as turning its axis

SPHERE, CAPSULE, BOX, CONVEX, HALF_SPACE, CYLINDER, CONE, ELLIPSOID = range(8)


# pi / 2 in three parts, of which the first two have so few bits that whole multiples of them below 2^29 are exact.
HALF_PI = tuple(map(float.fromhex, ("0x1.921fb4p+0", "0x1.4442dp-24", "0x1.8469898cc517p-48")))


def _dot(a: FloatArray, b: FloatArray) -> FloatArray:
    """Along the last axis, of length 3; written out, since what numpy sums first depends on the processor."""
    product: FloatArray = a[..., 0] * b[..., 0] + a[..., 1] * b[..., 1] + a[..., 2] * b[..., 2]
    return product


def _norm(a: FloatArray) -> FloatArray:
    """Along the last axis, of length 3 or 4."""
    square = _dot(a, a) + (a[..., 3] * a[..., 3] if a.shape[-1] == 4 else 0.0)
    length: FloatArray = np.sqrt(square)
    return length


def _sine_and_cosine(x: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Of angles up to 2^29, to 3 u, by sums and products alone: numpy's own depend on the processor."""
    quarters = np.rint(x * (2.0 / np.pi))
    r = x
    for part in HALF_PI:
        r = r - quarters * part
    square = r * r
    sine, cosine = np.zeros_like(r), np.zeros_like(r)
    for k in range(8, -1, -1):
        cosine = 1.0 / math.factorial(2 * k) - square * cosine
        sine = 1.0 / math.factorial(2 * k + 1) - square * sine
    sine = r * sine
    turns = np.where(np.isfinite(quarters), np.mod(quarters, 4.0), 0.0)
    odd = (turns == 1.0) | (turns == 3.0)
    s, c = np.where(odd, cosine, sine), np.where(odd, sine, cosine)
    return np.where(turns >= 2.0, -s, s), np.where((turns == 1.0) | (turns == 2.0), -c, c)


class Look(NamedTuple):
    """Pairs at their times."""

    lower: FloatArray
    upper: FloatArray
    point_a: FloatArray
    point_b: FloatArray
    normal: FloatArray
    sound: BoolArray  #: the normal is the direction that proves `lower`

    def take(self, rows: IntArray) -> Look:
        """The listed rows."""
        return Look(*(np.asarray(column)[rows] for column in self))  # type: ignore[arg-type]


@dataclass(frozen=True, eq=False)
class _Motion:
    """Two sides of k pairs at the start, (k, 2, ...)."""

    world: World
    shape: IntArray
    place: FloatArray
    turn: FloatArray
    velocity: FloatArray
    spin: FloatArray

    @classmethod
    def of(cls, world: World, pairs: IntArray) -> _Motion:
        poses, twists = world.poses[pairs], world.twists[pairs]
        return cls(world, world.shape[pairs], poses[..., :3], poses[..., 3:], twists[..., :3], twists[..., 3:])

    def take(self, rows: IntArray) -> _Motion:
        return _Motion(
            self.world, self.shape[rows], self.place[rows], self.turn[rows], self.velocity[rows], self.spin[rows]
        )

    @property
    def kind(self) -> ByteArray:
        return self.world.table.packed.kinds[self.shape]

    @property
    def reach(self) -> FloatArray:
        """(k, 2) of bodies; 0 for half spaces, which have none, and for balls, which turning does not change."""
        reach = self.world.table.reach[self.shape]
        reach = np.where(self.kind == CAPSULE, self.world.table.packed.params[self.shape, 1], reach)
        return np.where((self.kind == HALF_SPACE) | (self.kind == SPHERE), 0.0, reach)

    @property
    def size(self) -> FloatArray:
        """(k, 2) radius of a ball around the origin that holds the body; of a half space the offset of its plane."""
        size = self.world.table.reach[self.shape]
        return np.where(np.isinf(size), np.abs(self.world.table.packed.params[self.shape, 3]), size)

    def at(self, time: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Places (k, 2, 3), orientations (k, 2, 4), and how far rounding may have moved a point of a side (k, 2)."""
        t = time[:, None]
        place = self.place + t[..., None] * self.velocity
        rate = _norm(self.spin)
        angle = t * rate
        axis = self.spin / np.where(rate > 0.0, rate, 1.0)[..., None]
        sine, cosine = _sine_and_cosine(0.5 * angle)
        x, y, z = np.moveaxis(axis * sine[..., None], 2, 0)
        a, b, c, d = np.moveaxis(self.turn, 2, 0)
        turned = np.stack(
            [
                cosine * a + x * d + y * c - z * b,
                cosine * b - x * c + y * d + z * a,
                cosine * c + x * b - y * a + z * d,
                cosine * d - x * a - y * b - z * c,
            ],
            axis=2,
        )
        turned /= _norm(turned)[..., None]
        turns = angle > 0.0
        turn = np.where(turns[..., None], turned, self.turn)
        far = self.size
        if (planes := self.kind == HALF_SPACE).any():
            # The rounding of a plane's turn is felt where the other body is.
            apart = _norm(place[:, 1] - place[:, 0])[:, None]
            far = np.where(planes, far + far[:, ::-1] + apart, far)
        off = np.where(turns, far * (TURN_ROUNDING * angle + ORIENTATION_ROUNDING), 0.0)
        way = np.abs(self.place).sum(axis=2) + np.abs(t[..., None] * self.velocity).sum(axis=2)
        moved = (time[:, None] > 0.0) & self.velocity.any(axis=2)
        return place, turn, off + np.where(moved, PLACE_ROUNDING * way, 0.0)

    def look(self, time: FloatArray, deep: bool) -> Look:
        """All pairs, each at its time."""
        place, turn, off = self.at(time)
        count, table = len(time), self.world.table
        _, lower, upper, point_a, point_b, normal, status, _ = _core.distance_placed(
            *table.packed,
            table.reach,
            np.ascontiguousarray(self.shape.reshape(2 * count)),
            np.concatenate([place, turn], axis=2).reshape(2 * count, 7),
            np.ascontiguousarray(off.reshape(2 * count)),
            np.arange(2 * count).reshape(count, 2),
            RELATIVE_POSE_ROUNDING,
            deep,
            "float64",
            table.frusta,
        )
        return Look(lower, upper, point_a, point_b, normal, status == DistanceStatus.OK)


def nearest_at(world: World, pairs: IntArray, time: float) -> Look:
    """Nearest points of pairs at a time."""
    return _Motion.of(world, pairs).look(np.full(len(pairs), time), False)


def _supports(motion: _Motion, side: int, rotation: FloatArray, direction: FloatArray) -> FloatArray:
    """(k,) highest n . x of the bodies of one side about their origins, along directions (k, 3) of any length."""
    table, shape = motion.world.table, motion.shape[:, side]
    kind, params = table.packed.kinds[shape], table.packed.params[shape]
    e: FloatArray = np.stack([_dot(rotation[:, :, k], direction) for k in range(3)], axis=1)  # R^T n
    length, across = _norm(direction), np.sqrt(e[:, 0] * e[:, 0] + e[:, 1] * e[:, 1])
    radius, half = params[:, 0], params[:, 1]
    found = np.where(kind == SPHERE, radius * length, 0.0)
    found = np.where(kind == CAPSULE, radius * length + half * np.abs(e[:, 2]), found)
    found = np.where(kind == BOX, (np.abs(e) * params[:, :3]).sum(axis=1), found)
    found = np.where(kind == HALF_SPACE, params[:, 3], found)
    found = np.where(kind == CYLINDER, radius * across + half * np.abs(e[:, 2]), found)
    found = np.where(kind == CONE, np.maximum(half * e[:, 2], radius * across - half * e[:, 2]), found)
    found = np.where(kind == ELLIPSOID, _norm(e * params[:, :3]), found)
    if len(hulls := np.flatnonzero(kind == CONVEX)):
        vertices, ends = gather(table.packed.vertices, table.packed.offsets, shape[hulls])
        heights = (vertices * np.repeat(e[hulls], np.diff(ends), axis=0)).sum(axis=1)
        # Corners of a frustum are rounded: params say by how much.
        found[hulls] = np.maximum.reduceat(heights, ends[:-1]) + radius[hulls] * length[hulls]
    return found


class _Room:
    """How far apart pairs stay, at least, within the next s seconds."""

    def __init__(self, motion: _Motion, time: FloatArray, look: Look, gap: FloatArray, drift: FloatArray) -> None:
        place, turn, off = motion.at(time)
        count = len(time)
        kind, reach = motion.kind, motion.reach
        rotation = _validate.rotation_matrices(turn.reshape(-1, 4)).reshape(count, 2, 3, 3)
        normal = look.normal
        step, speed = place[:, 1] - place[:, 0], motion.velocity[:, 1] - motion.velocity[:, 0]
        apart = _norm(step)
        plane = kind == HALF_SPACE
        rate = _norm(motion.spin)
        # Of a solid of revolution only the turning of its axis counts.
        axis = rotation[..., 2]
        round_ = np.isin(kind, (CAPSULE, CYLINDER, CONE)) | (
            (kind == ELLIPSOID)
            & (
                motion.world.table.packed.params[motion.shape][..., 0]
                == motion.world.table.packed.params[motion.shape][..., 1]
            )
        )
        along = _dot(motion.spin, axis)
        lean = _norm(motion.spin - along[..., None] * axis) + ALONG_ROUNDING * rate
        slow = (round_ & (lean <= ALMOST_ALONG * rate)) | (kind == SPHERE)
        swept = np.where(slow, np.where(kind == SPHERE, 0.0, np.minimum(lean, rate) * reach), 0.0).sum(axis=1)
        spin = np.where((slow | plane)[..., None], 0.0, motion.spin)
        turning = plane & (rate > 0.0)
        blunt = turning.any(axis=1) | ~look.sound
        size = motion.size.sum(axis=1) + apart
        fixed = np.where(blunt, _norm(speed), 0.0)
        swing = np.where(blunt[:, None], _norm(spin) * reach, 0.0).sum(axis=1)
        # A plane that turns comes nearer to a point at the rate at which its own points there move.
        bend = np.where(turning, rate, 0.0).sum(axis=1)
        swing += bend * (apart + reach.sum(axis=1) + motion.size.min(axis=1))
        self._bend = bend * _norm(speed)
        self._motion, self._rotation, self._normal, self._blunt = motion, rotation, normal, blunt
        self._tilt = np.cross(normal[:, None, :], spin)
        self._curve = (_norm(spin) ** 2 * reach).sum(axis=1)
        self._closing = -_dot(speed, normal)
        # A normal that no rotation has rounded is the one that is meant.
        turned = (motion.turn[..., :3] != 0.0).any(axis=(1, 2)) | (rate > 0.0).any(axis=1)
        sideways = np.abs(speed * np.where((plane.any(axis=1) & ~turned)[:, None], normal, 1.0)).sum(axis=1)
        rounding = ALONG_ROUNDING * (sideways + rate.max(axis=1) * size) + 2.0 * (off * rate).sum(axis=1)
        self._rate = swept + drift + fixed + swing + rounding
        self._gap = gap - ALONG_ROUNDING * size
        self._start = self._heights(np.zeros(count))

    def _heights(self, s: FloatArray) -> FloatArray:
        """Supports of both sides along the normal, as it is seen from each after s seconds."""
        along = s[:, None] * self._tilt[:, 0]
        against = s[:, None] * self._tilt[:, 1]
        top = _supports(self._motion, 0, self._rotation[:, 0], self._normal + along)
        planes = self._motion.kind == HALF_SPACE
        bottom = _supports(self._motion, 1, self._rotation[:, 1], -self._normal - against)
        total: FloatArray = np.where(planes[:, 0], 0.0, top) + np.where(planes[:, 1], 0.0, bottom)
        return total

    def left(self, s: FloatArray) -> FloatArray:
        """(k,) bound of the gap after s seconds; concave in s."""
        raised = np.where(self._blunt, 0.0, self._heights(s) - self._start + s * self._closing)
        left: FloatArray = self._gap - raised - s * self._rate - 0.5 * s * s * (self._curve + self._bend)
        return left

    def step(self, longest: FloatArray) -> FloatArray:
        """(k,) seconds [0, longest] within which the bound stays positive."""
        begin = self._gap
        spin = _norm(self._tilt)
        reach = self._motion.reach
        # Of the first order: no support rises faster than this.
        first = self._rate + np.where(self._blunt, 0.0, (spin * reach).sum(axis=1) + np.maximum(self._closing, 0.0))
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            curved = self._curve + self._bend
            good = np.where(begin > 0.0, 2.0 * begin / (first + np.sqrt(first * first + 2.0 * curved * begin)), 0.0)
        # Less than that by what the bound itself rounds; if that is not enough, half.
        good = np.minimum(np.where(np.isnan(good), 0.0, good * (1.0 - FIRST_ROUNDING)), longest)
        value = self.left(good)
        half = 0.5 * good
        less = self.left(half)
        good = np.where(value >= 0.0, good, np.where(less >= 0.0, half, 0.0))
        value = np.where(value >= 0.0, value, np.where(less >= 0.0, less, begin))
        bad, worse = np.full_like(good, np.inf), np.full_like(good, -np.inf)
        for _ in range(DOUBLINGS):
            reached = good >= longest
            trial = np.where(np.isinf(bad) & ~reached, np.minimum(2.0 * good, longest), good)
            trial = np.where(np.isfinite(trial), trial, good)
            after = self.left(trial)
            better = after >= 0.0
            bad, worse = np.where(better, bad, trial), np.where(better, worse, after)
            good, value = np.where(better, trial, good), np.where(better, after, value)
        for _ in range(CHORDS):
            with np.errstate(invalid="ignore", divide="ignore"):
                # A chord of a concave function lies below it.
                trial = good + (bad - good) * (value / (value - worse))
            trial = np.where(np.isfinite(trial) & (trial > good) & (trial < bad), trial, good)
            after = self.left(trial)
            better = after >= 0.0
            good, value = np.where(better, trial, good), np.where(better, after, value)
        return np.where(begin > 0.0, good, 0.0)


def _by_balls(motion: _Motion, time: FloatArray, near: FloatArray, drift: FloatArray, normal: FloatArray) -> FloatArray:
    """(k,) seconds until balls around the bodies, or one and a plane that does not turn, come as near; may be inf."""
    place, _, _ = motion.at(time)
    step, speed = place[:, 1] - place[:, 0], motion.velocity[:, 1] - motion.velocity[:, 0]
    plane = motion.kind == HALF_SPACE
    bounded = ~plane.any(axis=1)
    away = _norm(step)
    sizes = motion.size
    radius = (sizes.sum(axis=1) + near) * (1.0 + BALL_ROUNDING) + BALL_DISTANCE_ROUNDING * away
    closing, square = -_dot(step, speed), _dot(speed, speed)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        room = (away - radius) * (away + radius)
        under = closing * closing - square * room
        enter = np.where((closing <= 0.0) | (under < 0.0), np.inf, room / (closing + np.sqrt(np.maximum(under, 0.0))))
    balls = np.where(bounded & (away > radius) & (drift == 0.0), enter, 0.0)
    # A plane: the normal is its own, out of it or into it.
    still = ~(plane & motion.spin.any(axis=2)).any(axis=1)
    offset = np.where(plane, motion.world.table.packed.params[motion.shape, 3], 0.0).sum(axis=1)
    body = np.where(plane, 0.0, sizes).sum(axis=1)
    height = _dot(step, normal) - offset - body - near
    height -= BALL_DISTANCE_ROUNDING * (away + np.abs(offset) + body)
    turned = (motion.turn[..., :3] != 0.0).any(axis=(1, 2))
    sideways = np.abs(speed * np.where(turned[:, None], 1.0, normal)).sum(axis=1)
    fall = drift - _dot(speed, normal) + ALONG_ROUNDING * sideways
    with np.errstate(divide="ignore", invalid="ignore"):
        land = np.where(fall > 0.0, height / fall, np.inf)
    rests = ~speed.any(axis=1) & (drift == 0.0)
    land = np.where(rests, np.inf, land)
    return np.where(~bounded & still & (height > 0.0), land, np.where(np.isnan(balls), 0.0, balls))


def _period(motion: _Motion) -> FloatArray:
    """(k,) [s] after which pairs without relative velocity are where they were; inf of others."""
    rate = _norm(motion.spin)
    rests = (motion.velocity[:, 0] == motion.velocity[:, 1]).all(axis=1)
    single = (rate == 0.0).any(axis=1) | (motion.spin[:, 0] == motion.spin[:, 1]).all(axis=1)
    with np.errstate(divide="ignore"):
        period = 2.0 * np.pi / rate.max(axis=1) * (1.0 + STEP_ROUNDING)
    return np.where(rests & single, period, np.inf)


def advance(
    world: World, pairs: IntArray, horizon: float, tolerance: float, slack: FloatArray
) -> tuple[ByteArray, FloatArray, FloatArray, FloatArray, FloatArray]:
    """Status, lower, upper, normal and point of pairs, as of the engine's kernel for bodies that turn.

    Parameters
    ----------
    slack : (k, 3) float
        Margin [m] up to which bodies are in contact, uncertainty [m], and drift [m/s]: the answer holds for all bodies
        within.
    """
    count = len(pairs)
    motion = _Motion.of(world, pairs)
    margin, doubt, drift = slack.T
    status = np.full(count, ContactStatus.NOT_CONVERGED, np.uint8)
    lower, upper = np.zeros(count), np.full(count, np.inf)
    normal, point = np.full((count, 3), np.nan), np.full((count, 3), np.nan)
    begin = motion.look(np.zeros(count), True)
    end = np.minimum(_period(motion), horizon)
    over = begin.upper + doubt <= margin
    apart = begin.lower - doubt > margin
    status[over] = ContactStatus.OVERLAPPING
    upper[over] = 0.0
    common = motion.take(np.flatnonzero(over)).look(np.zeros(int(over.sum())), False)
    point[over] = 0.5 * (common.point_a + common.point_b)
    touching = np.flatnonzero(~over & ~apart)
    status[touching] = ContactStatus.TOUCHING
    normal[touching], point[touching] = begin.normal[touching], 0.5 * (begin.point_a + begin.point_b)[touching]
    if len(touching):
        part = motion.take(touching)
        upper[touching] = _proven(
            part,
            np.zeros(len(touching)),
            np.zeros(len(touching)),
            end[touching],
            tolerance,
            slack[touching],
            np.ones(len(touching), np.bool_),
        )
    rows = np.flatnonzero(apart)
    time = np.zeros(len(rows))
    part, look = motion.take(rows), begin.take(rows)
    seen = look.normal.copy()
    for looks in range(MOST_LOOKS):
        if len(rows) == 0:
            break
        if looks:
            look = part.look(time, False)
        own, last = slack[rows], end[rows]
        gap = look.lower - own[:, 0] - own[:, 1] - own[:, 2] * time
        free = (gap > 0.0) & ~np.isnan(look.normal).any(axis=1)
        seen = np.where(free[:, None], look.normal, seen)
        with np.errstate(invalid="ignore", over="ignore"):
            here = Look(*look[:4], np.where(free[:, None], look.normal, 0.0), look.sound)
            step = _Room(part, time, here, np.where(free, gap, 0.0), own[:, 2]).step(last - time)
            near = own[:, 0] + own[:, 1] + own[:, 2] * time
            step = np.where(free, np.maximum(step, _by_balls(part, time, near, own[:, 2], here.normal)), 0.0)
            following = np.maximum(time + step * (1.0 - STEP_ROUNDING) - ROUNDOFF * time * 4.0, time)
        never = free & (step > 0.0) & (time + step >= last)
        stuck = ~(following > time)
        close = np.flatnonzero(~never & ((STEPS_AHEAD * step <= tolerance) | stuck))
        done = never.copy()
        status[rows[never]] = ContactStatus.NEVER
        lower[rows[never]] = upper[rows[never]] = np.nan
        if len(close):
            found = _proven(
                part.take(close), following[close], step[close], last[close], tolerance, own[close], stuck[close]
            )
            ended = np.isfinite(found) | stuck[close]
            k = close[ended]
            at = rows[k]
            lower[at], upper[at] = following[k], found[ended]
            in_time = (upper[at] - lower[at] <= tolerance) | (upper[at] == np.nextafter(lower[at], np.inf))
            status[at] = np.where(in_time, ContactStatus.WILL_TOUCH, ContactStatus.GRAZING)
            then = part.take(k).look(lower[at], False)
            clear = (then.lower > own[k, 0])[:, None] & ~np.isnan(then.normal)
            normal[at] = np.where(clear, then.normal, seen[k])
            # Nearest points, or a common one where the bodies are too close to be told apart.
            point[at] = 0.5 * (then.point_a + then.point_b)
            done[k] = True
        keep = np.flatnonzero(~done)
        angle = following[keep] * _norm(part.spin[keep]).max(axis=1, initial=0.0)
        lower[rows[keep]] = following[keep]
        keep = keep[angle <= LARGEST_ANGLE]
        rows, time, seen = rows[keep], following[keep], seen[keep]
        part = part.take(keep)
    return status, lower, upper, normal, point


def _proven(
    motion: _Motion,
    time: FloatArray,
    step: FloatArray,
    end: FloatArray,
    tolerance: float,
    slack: FloatArray,
    stuck: BoolArray,
) -> FloatArray:
    """(k,) a time not long after `time` at which contact is proven; inf where none is found."""
    found = np.full(len(time), np.inf)
    last = np.minimum(time + tolerance * WITHIN, end)
    ahead = np.maximum(STEPS_AHEAD * step, np.nextafter(time, np.inf) - time)
    for k in range(TRIES + LATE_TRIES):
        trial = last if k == TRIES - 1 else np.minimum(time + ahead, last)
        if k >= TRIES:
            trial = np.minimum(time + np.ldexp(tolerance, k - TRIES + 1), end)
        todo = np.flatnonzero(np.isinf(found) & np.isfinite(trial) & (trial >= time) & (stuck | (k < TRIES)))
        if len(todo) == 0:
            break
        look = motion.take(todo).look(trial[todo], True)
        margin, doubt, drift = slack[todo].T
        hit = look.upper + doubt + drift * trial[todo] <= margin
        found[todo[hit]] = trial[todo[hit]]
        ahead = ahead * FURTHER_AHEAD
        if k >= TRIES:
            stuck = stuck & (trial < end)
    return found
