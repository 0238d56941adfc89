# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""Answers for pairs that the caller lists: a row for each, in that order, whether they may touch or not."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from geomsrv import _validate
from geomsrv.answers import BoolArray, ByteArray, ContactStatus, Cost, DistanceStatus, FloatArray, IntArray
from geomsrv.errors import GeometryError
from geomsrv.narrow_phase import Unsupported, distance_rows, first_contact_rows
from geomsrv.placement import laid_flat
from geomsrv.shapes import Frustum, Polygon, Shape
from geomsrv.world import ShapeTable, World

__all__ = [
    "ListedContacts",
    "ListedDistances",
    "listed_distances",
    "listed_first_contacts",
    "relative_poses",
    "world_of",
]


@dataclass(frozen=True, eq=False)
class ListedDistances:
    """Distances of n listed pairs.

    Attributes
    ----------
    status : (n,) uint8
        `DistanceStatus`.
    distance, lower, upper : (n,) float64
        As in `PairDistances`; NaN where unsupported.
    point_a, point_b, normal : (n, 3) float64
        Fixed frame.
    message : str
        Names what is unsupported; empty otherwise.
    cost : Cost
    """

    status: ByteArray
    distance: FloatArray
    lower: FloatArray
    upper: FloatArray
    point_a: FloatArray
    point_b: FloatArray
    normal: FloatArray
    message: str
    cost: Cost


@dataclass(frozen=True, eq=False)
class ListedContacts:
    """First contacts of n listed pairs.

    Attributes
    ----------
    status : (n,) uint8
        `ContactStatus`.
    time, time_lower, time_upper, last_time : (n,) float64
        As in `PairContacts`; NaN for NEVER and UNSUPPORTED.
    normal : (n, 3) float64
        Fixed frame.
    points : (k, 3) float64, point_offsets : (n + 1,) int64
        Contact set of pair i: ``points[point_offsets[i]:point_offsets[i + 1]]``, fixed frame.
    message : str
        Names what is unsupported; empty otherwise.
    cost : Cost
    """

    status: ByteArray
    time: FloatArray
    time_lower: FloatArray
    time_upper: FloatArray
    last_time: FloatArray
    normal: FloatArray
    points: FloatArray
    point_offsets: IntArray
    message: str
    cost: Cost


def world_of(shapes: Sequence[Shape | Frustum], poses: FloatArray, twists: FloatArray | None = None) -> World:
    """Objects "0", "1", ... that are in no scene.

    Parameters
    ----------
    shapes : sequence of n Shape
    poses : (n, 7) float
    twists : (n, 6) float, optional
        By default at rest.

    Raises
    ------
    GeometryError
        Names the index and the fault.
    """
    placed = _validate.poses(poses)
    moving = np.zeros((len(placed), 6)) if twists is None else _validate.floats(twists, "twists", (len(placed), 6))
    planar = np.array([isinstance(shape, Polygon) for shape in shapes], dtype=bool)
    if planar.any():
        placed, faults = laid_flat(placed, moving, planar)
        for row, text in faults.items():
            raise GeometryError(f"poses[{row}]: {text}")
    count = len(shapes)
    return World(
        ids=tuple(map(str, range(count))),
        index={str(row): row for row in range(count)},
        table=ShapeTable.of(shapes),
        shape=np.arange(count),
        uncertainty=np.zeros(count),
        velocity_uncertainty=np.zeros(count),
        motion_faults={},
        poses=placed,
        twists=moving,
        allowed=np.zeros(0, np.int64),
        version=0,
        stamp=None,
    )


def relative_poses(world: World, pairs: IntArray) -> FloatArray:
    """(n, 7): pose of the second object in the first, for (n, 2) rows of `world`."""
    i, j = pairs[:, 0], pairs[:, 1]
    step = world.poses[j, :3] - world.poses[i, :3]
    ax, ay, az, aw = world.poses[i, 3:].T
    bx, by, bz, bw = world.poses[j, 3:].T
    # conj(a) b
    return np.column_stack(
        [
            np.einsum("kji,kj->ki", world.rotations[i], step),
            aw * bx - ax * bw - ay * bz + az * by,
            aw * by + ax * bz - ay * bw - az * bx,
            aw * bz - ax * by + ay * bx - az * bw,
            aw * bw + ax * bx + ay * by + az * bz,
        ]
    )


def listed_distances(
    world: World, pairs: IntArray, *, want: Sequence[str] = ("distance",), accuracy: str = "float64"
) -> ListedDistances:
    """Distances of listed pairs, (n, 2) rows of `world`."""
    start, counts = time.perf_counter_ns(), Counter[str]()
    tier = _validate.accuracy(accuracy)
    effects = _validate.want(want, ("distance", "witness", "penetration"))
    listed = _Listed(world, pairs)
    rows, unsupported = distance_rows(world, listed.comparable, "penetration" in effects, counts)
    at = listed.rows_among(rows.pairs)
    swapped = listed.swapped[:, None]
    point_a, point_b, normal = (_take(column, at, np.nan) for column in (rows.point_a, rows.point_b, rows.normal))
    return ListedDistances(
        status=_take(rows.status, at, DistanceStatus.UNSUPPORTED),
        distance=_take(rows.distance, at, np.nan),
        lower=_take(rows.lower, at, np.nan),
        upper=_take(rows.upper, at, np.nan),
        point_a=np.where(swapped, point_b, point_a),
        point_b=np.where(swapped, point_a, point_b),
        normal=np.where(swapped, -normal, normal),
        message=listed.message(unsupported),
        cost=Cost(time.perf_counter_ns() - start, tier, dict(counts)),
    )


def listed_first_contacts(
    world: World, pairs: IntArray, horizon: float, *, accuracy: str = "float64"
) -> ListedContacts:
    """First contacts within `horizon` [s] of listed pairs, (n, 2) rows of `world`."""
    start, counts = time.perf_counter_ns(), Counter[str]()
    tier = _validate.accuracy(accuracy)
    end = float(_validate.floats(horizon, "horizon", (), allow_infinite=True))
    if not end >= 0.0:
        raise GeometryError(f"horizon must be >= 0, got {end}")
    listed = _Listed(world, pairs)
    rows, unsupported = first_contact_rows(world, listed.comparable, end, counts)
    at = listed.rows_among(rows.pairs)
    # A pair without a row never touches, or could not be compared at all.
    status = _take(rows.status, at, ContactStatus.NEVER)
    status[listed.incomparable | (listed.rows_among(unsupported.pairs) < len(unsupported.pairs))] = (
        ContactStatus.UNSUPPORTED
    )
    none = np.zeros((0, 3))
    sets = [none if points is None else points for points in [*rows.points, none]]
    chosen = [sets[k] for k in at.tolist()]
    normal = _take(rows.normal, at, np.nan)
    return ListedContacts(
        status=status,
        time=_take(rows.time, at, np.nan),
        time_lower=_take(rows.lower, at, np.nan),
        time_upper=_take(rows.upper, at, np.nan),
        last_time=_take(rows.last_time, at, np.nan),
        normal=np.where(listed.swapped[:, None], -normal, normal),
        points=np.concatenate([none, *chosen]),
        point_offsets=np.cumsum([0, *map(len, chosen)], dtype=np.int64),
        message=listed.message(unsupported),
        cost=Cost(time.perf_counter_ns() - start, tier, dict(counts)),
    )


class _Listed:
    """Listed pairs, and the distinct ones among them that can be compared, smaller row first."""

    def __init__(self, world: World, pairs: IntArray) -> None:
        low, high = pairs.min(axis=1), pairs.max(axis=1)
        if (low == high).any():
            k = int(np.argmax(low == high))
            raise GeometryError(f"pair {k} is {world.ids[low[k]]!r} with itself")
        self._world = world
        self._keys = low * len(world) + high
        self.swapped: BoolArray = pairs[:, 0] > pairs[:, 1]
        self.incomparable: BoolArray = world.planar[low] != world.planar[high]
        distinct = np.unique(self._keys[~self.incomparable])
        self.comparable: IntArray = np.column_stack(np.divmod(distinct, max(len(world), 1)))

    def rows_among(self, pairs: IntArray) -> IntArray:
        """Position of each listed pair among sorted `pairs`; ``len(pairs)`` for one that is not there."""
        keys = pairs[:, 0] * len(self._world) + pairs[:, 1]
        at = np.searchsorted(keys, self._keys)
        there = at < len(keys)
        there[there] = keys[at[there]] == self._keys[there]
        return np.where(there, at, len(keys))

    def message(self, unsupported: Unsupported) -> str:
        """What is unsupported, each reason once."""
        reasons = list(dict.fromkeys(unsupported.reason.tolist()))
        if self.incomparable.any():
            reasons.append("polygons are compared with polygons only")
        return "; ".join(reasons)


def _take(column: NDArray[Any], rows: IntArray, missing: float) -> NDArray[Any]:
    """The listed rows, and `missing` for the one past the end."""
    padded = np.concatenate([column, np.full((1, *column.shape[1:]), missing, column.dtype)])
    taken: NDArray[Any] = padded[rows]
    return taken
