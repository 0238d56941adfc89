# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""First contact of bodies that translate and turn: the part of `first_contact` with an angular velocity."""

from __future__ import annotations

import time
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from geomsrv import _core, _validate
from geomsrv.answers import BoolArray, ContactStatus, Cost, FirstContacts, FloatArray, IntArray, gather
from geomsrv.errors import GeometryError, NotAvailableError
from geomsrv.shapes import Boxes, Polygons, Polytopes

__all__ = [
    "TIME_TOLERANCE",
    "approach",
    "first_contact_turning",
    "middles",
    "packed",
    "settled_at_start",
    "turns",
    "velocity_at",
]

TIME_TOLERANCE = 1e-6  #: [s] widest interval of a contact, where no other is asked for

Bodies = Boxes | Polygons | Polytopes


def turns(*angular_velocities: ArrayLike | None) -> bool:
    """Whether any is given and not zero."""
    given = (_validate.array(w, "angular_velocity") for w in angular_velocities if w is not None)
    return any(w.dtype.kind not in "fiu" or bool(np.any(w != 0)) for w in given)


def first_contact_turning(
    bodies: tuple[Any, Any],
    velocities: tuple[ArrayLike, ArrayLike],
    angular_velocities: tuple[ArrayLike | None, ArrayLike | None],
    centers: tuple[ArrayLike | None, ArrayLike | None],
    *,
    t_max: float,
    tolerance: float,
    accuracy: str,
    contact_set: bool,
    certificates: bool,
) -> FirstContacts:
    """The answer of `first_contact`, whose arguments these are, each for a and b."""
    start = time.perf_counter_ns()
    flat = isinstance(bodies[0], Polygons)
    kinds = (Polygons,) if flat else (Boxes, Polytopes)
    for body, name in zip(bodies, "ab", strict=True):
        if not isinstance(body, kinds):
            names = " or ".join(kind.__name__ for kind in (kinds if name == "b" else (Boxes, Polygons, Polytopes)))
            raise GeometryError(f"{name} must be {names}, got {type(body).__name__}")
    count = _validate.common_length(len(bodies[0]), len(bodies[1]))
    d = 2 if flat else 3
    end = _validate.limit(t_max, "t_max")
    step = _validate.scalar(tolerance, "tolerance", positive=True)
    tier = _validate.accuracy(accuracy, _validate.ACCURACIES)
    if tier != "float64":
        raise NotAvailableError(
            f"accuracy={tier!r} is not available for bodies that turn, whose sines are no rational numbers; "
            "'float64' proves its bounds"
        )
    if _validate.certificates(certificates, tier):
        raise NotAvailableError("certificates are not available for bodies that turn")
    sides = []
    for body, velocity, angular, center, name in zip(
        bodies, velocities, angular_velocities, centers, "ab", strict=True
    ):
        parts = (
            _validate.rows(velocity, f"velocity_{name}", count, d),
            _angular(angular, f"angular_velocity_{name}", count, flat),
            middles(body) if center is None else _validate.rows(center, f"center_{name}", count, d),
        )
        motion = np.zeros((max(len(part) for part in parts), 9))
        for k, part in enumerate(parts):
            motion[:, 3 * k : 3 * k + part.shape[1]] = part
        sides.append((packed(body), motion))
    (body_a, motion_a), (body_b, motion_b) = sides
    found = _core.first_contact_turning(
        body_a, body_b, motion_a, motion_b, end, step, np.zeros((1, 3)), bool(contact_set)
    )
    status, lower, upper, _, point, wide, looks, *_ = found
    normal, points, offsets = settled_at_start((body_a, body_b), found, bool(contact_set))
    certain = (status != ContactStatus.TOUCHING) & (status < ContactStatus.UNSUPPORTED)
    counts = {
        "filter": int(np.count_nonzero(~wide)),
        "wide": int(np.count_nonzero(wide)),
        "looks": int(looks.sum()),
    }
    return FirstContacts(
        status=status,
        time=lower.copy(),
        time_lower=lower,
        time_upper=upper,
        last_time=np.full(count, np.nan),
        normal=np.ascontiguousarray(normal[:, :d]),
        points=np.ascontiguousarray(points[:, :d]),
        point_offsets=offsets,
        certain=certain,
        _closing_speed=_closing_speed(lower, normal, point, motion_a, motion_b),
        cost=Cost(time.perf_counter_ns() - start, tier, counts),
    )


def settled_at_start(
    sides: tuple[tuple[Any, ...], tuple[Any, ...]],
    found: tuple[Any, ...],
    contact_set: bool,
    sharp: BoolArray | None = None,
) -> tuple[FloatArray, FloatArray, IntArray]:
    """Normals (n, 3), contact sets (k, 3) and offsets as found, but those of bodies at rest where contact is at once.

    At rest bodies that come within rounding have a common plane.  Where they are found apart, and where they are not
    ``sharp`` (n,) but have a radius, the point between them is all.
    """
    status, _, _, normal, point, _, _, points, offsets = found
    at_once = (status == ContactStatus.TOUCHING) | ((status == ContactStatus.OVERLAPPING) & contact_set)
    if not at_once.any():
        return normal, points, offsets
    rows = np.flatnonzero(at_once if sharp is None else at_once & sharp)
    flat = len(sides[0]) == 2 and sides[0][0].shape[1] == 2
    side_a, side_b = (_rows_of(side, rows) for side in sides)
    shared, ends, across = np.zeros((0, 3)), np.zeros(1, np.int64), np.zeros((0, 3))
    if len(rows):
        still = np.zeros((1, 2 if flat else 3))
        kernel: Any = _core.first_contact_polygons if flat else _core.first_contact_world
        bodies = (*side_a, *side_b) if flat else (side_a, side_b)
        _, _, _, _, _, across, shared, ends, *_ = kernel(*bodies, still, still, 0.0, contact_set, "float64")
        shared, across = (np.pad(part, ((0, 0), (0, 3 - part.shape[1]))) for part in (shared, across))
    touching = (status[rows] == ContactStatus.TOUCHING) & ~np.isnan(across[:, 0])
    normal[rows[touching]] = across[touching]
    if not contact_set:
        return normal, points, offsets
    # End to end: what was found, what bodies at rest share, and the points between.
    sizes, first = np.diff(offsets), offsets[:-1].copy()
    sizes[at_once] = ~np.isnan(point[at_once, 0])
    first[at_once] = len(points) + len(shared) + np.flatnonzero(at_once)
    held = np.diff(ends)
    sizes[rows[held > 0]] = held[held > 0]
    first[rows[held > 0]] = len(points) + ends[:-1][held > 0]
    total = np.concatenate([[0], np.cumsum(sizes, dtype=np.int64)])
    source = np.repeat(first - total[:-1], sizes) + np.arange(total[-1])
    return normal, np.concatenate([points, shared, point])[source], total


def _rows_of(side: tuple[Any, ...], rows: IntArray) -> tuple[Any, ...]:
    """Some bodies of a side; one stands for all."""
    single = len(side[0]) == 1 if len(side) == 3 else len(side[1]) == 2
    if single:
        return side
    if len(side) == 3:
        return tuple(np.ascontiguousarray(part[rows]) for part in side)
    return gather(side[0], side[1], rows)


def _closing_speed(
    moment: FloatArray, normal: FloatArray, point: FloatArray, motion_a: FloatArray, motion_b: FloatArray
) -> FloatArray:
    """(n,) speed at which the bodies approach at their contact point; NaN without one."""
    velocity_a, velocity_b = (
        velocity_at(motion[:, :3], motion[:, 3:6], motion[:, 6:], moment[:, None], point)
        for motion in (motion_a, motion_b)
    )
    return approach(velocity_a, velocity_b, normal)


def velocity_at(
    linear: FloatArray, angular: FloatArray, center: FloatArray, moment: Any, points: FloatArray
) -> FloatArray:
    """(m, 3) of a body at a moment, where it holds the given points; its centre is that at the start."""
    with np.errstate(over="ignore", invalid="ignore"):
        velocity: FloatArray = linear + np.cross(angular, points - (center + moment * linear))
    return velocity


def approach(velocity_a: FloatArray, velocity_b: FloatArray, normal: FloatArray) -> FloatArray:
    """(n,) speed at which a comes nearer to b along the normal (n, 3)."""
    with np.errstate(over="ignore", invalid="ignore"):
        x, y, z = ((velocity_a - velocity_b) * normal).T
        speed: FloatArray = x + y + z  # in this order everywhere
    return speed


def packed(body: Bodies) -> tuple[Any, ...]:
    """As the engine reads it."""
    return (body.center, body.axes, body.half_extents) if isinstance(body, Boxes) else (body.vertices, body.offsets)


def middles(body: Bodies) -> FloatArray:
    """(n, d) centres of boxes, or the middles of the bounding boxes, rounded: what a body turns about by default."""
    if isinstance(body, Boxes):
        return body.center
    first = body.offsets[:-1]
    least, most = (extreme.reduceat(body.vertices, first, axis=0) for extreme in (np.minimum, np.maximum))
    middle: FloatArray = 0.5 * least + 0.5 * most
    return middle


def _angular(value: ArrayLike | None, name: str, count: int, flat: bool) -> FloatArray:
    """(n, 3), (1, 3) or zeros; in the plane a number or (n,) about the third axis."""
    if value is None:
        return np.zeros((1, 3))
    if not flat:
        return _validate.rows(value, name, count, 3)
    given = _validate.array(value, name)
    rates = _validate.floats(given, name, () if given.ndim == 0 else (None,)).reshape(-1)
    if len(rates) not in (1, count):
        raise GeometryError(f"{name} must be one number or have shape ({count},), got shape {given.shape}")
    turning = np.zeros((len(rates), 3))
    turning[:, 2] = rates
    return turning
