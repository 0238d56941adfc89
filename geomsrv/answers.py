# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""What queries return: named outcomes (enums), answers (frozen arrays), and what they cost.

Only values live here.  Row i of every array belongs to item i of the batch; NaN marks "has no meaning here".
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from enum import IntEnum
from functools import cached_property
from os import PathLike
from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = [
    "Booleans",
    "Bounded",
    "Certificates",
    "CollisionTimes",
    "ContactStatus",
    "Cost",
    "Cull",
    "CullState",
    "DistanceStatus",
    "Distances",
    "FirstContacts",
    "FrustumRegion",
    "end_to_end",
    "gather",
    "sets_end_to_end",
]

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
ByteArray = NDArray[np.uint8]
BoolArray = NDArray[np.bool_]
Record = dict[str, Any]


class CullState(IntEnum):
    """Where a box lies with respect to a frustum; both are closed sets."""

    OUTSIDE = 0  #: no common point
    INTERSECTS = 1  #: a common point, and a point of the box outside the frustum
    INSIDE = 2  #: every point of the box is in the frustum


class ContactStatus(IntEnum):
    """Outcome of a first-contact query."""

    NEVER = 0  #: no contact within ``t_max``
    WILL_TOUCH = 1  #: apart now, first contact at ``time``
    TOUCHING = 2  #: in contact at t = 0 with depth 0: a translation however small parts them
    OVERLAPPING = 3  #: in contact at t = 0 with depth > 0; so is a point or a segment inside a body
    UNSUPPORTED = 4  #: no kernel for this pair or motion; every number is NaN
    NOT_CONVERGED = 5  #: the work budget ran out; ``time_lower`` and ``time_upper`` bracket the answer
    GRAZING = 6  #: apart until ``time``; there, neither contact nor its absence could be proven


class DistanceStatus(IntEnum):
    """Outcome of a distance query."""

    OK = 0  #: the interval is as narrow as the tier promises
    NOT_CONVERGED = 1  #: iterations ran out; the interval still holds
    UNSUPPORTED = 2  #: no kernel for this pair of shapes; every number is NaN


# Names are [NEAR|FAR]_[LEFT|RIGHT]_[UP|DOWN], the faces that meet in the feature; LEFT is the +L side, UP the +U side.
FrustumRegion = IntEnum(  # type: ignore[misc]  # mypy wants literal members
    "FrustumRegion",
    {
        "_".join(part for part in (depth, side, height) if part) or "INSIDE": 9 * k + 3 * j + i
        for k, depth in enumerate(("", "NEAR", "FAR"))
        for j, height in enumerate(("", "UP", "DOWN"))
        for i, side in enumerate(("", "LEFT", "RIGHT"))
    },
    module=__name__,
)
FrustumRegion.__doc__ = """Feature of a frustum nearest to a point: INSIDE, a face, an edge or a vertex.

The value is ``9 * depth + 3 * height + side`` with 0 for none, depth 1 NEAR, 2 FAR, height 1 UP (+U), 2 DOWN (-U),
side 1 LEFT (+L), 2 RIGHT (-L); so INSIDE is 0, ``NEAR`` 9, ``FAR_LEFT_UP`` 22.
"""


@dataclass(frozen=True)
class Cost:
    """What a batch of answers cost.

    Attributes
    ----------
    elapsed_ns : int
        Wall time inside the query, validation included.
    accuracy : str
        The tier that answered; where it was chosen item by item, the highest; "none" where a time budget allowed for
        nothing.
    counts : dict of str to int
        Items decided per stage, by the stage's name; "tier float64" and so on where the tier was chosen item by item.
    """

    elapsed_ns: int
    accuracy: str
    counts: dict[str, int] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class Certificates:
    """Records that prove an answer, one for each item, written when they are read; see the page on certificates.

    Examples
    --------
    >>> import geomsrv as gs
    >>> square = gs.Polygons.from_list([[(0, 0), (1, 0), (1, 1), (0, 1)]])
    >>> other = gs.Polygons.from_list([[(3, 0), (4, 0), (4, 1), (3, 1)]])
    >>> answer = gs.first_contact(square, other, (1, 0), (0, 0), accuracy="exact", certificates=True)
    >>> answer.certificates[0]["claim"]["status"]
    'WILL_TOUCH'
    >>> gs.verify(answer)
    """

    _answer: Any = field(repr=False)
    _record: Callable[[Any, int], Record] = field(repr=False)

    def __len__(self) -> int:
        return len(self._answer.state if isinstance(self._answer, Cull) else self._answer.status)

    def __getitem__(self, i: int) -> Record:
        return self._record(self._answer, range(len(self))[i])

    def __iter__(self) -> Iterator[Record]:
        return (self[i] for i in range(len(self)))

    def lines(self) -> Iterator[str]:
        """Records as JSON, without line ends; floats as `float.hex` text, which loses nothing."""
        return map(json_line, self)

    def save(self, path: str | PathLike[str]) -> None:
        """Write all lines to a file, for the command ``geomsrv verify``."""
        with open(path, "w", encoding="ascii") as file:
            file.writelines(f"{line}\n" for line in self.lines())


def json_line(record: Record) -> str:
    """A record as JSON without a line's end."""
    return json.dumps(_in_hex(record))


def _in_hex(value: Any) -> Any:
    if isinstance(value, float):
        return value.hex()
    if isinstance(value, dict):
        return {name: _in_hex(item) for name, item in value.items()}
    return [_in_hex(item) for item in value] if isinstance(value, list) else value


class Bounded:
    """An answer that says how far off it may be."""

    @property
    def error_bound(self) -> float:
        """Widest proven interval of all items [m, of times s]; inf where something is not proven, 0 if all is.

        Of states and booleans: 0 if all are certain, else inf.
        """
        known = vars(self)
        if "lower" not in known and "time_lower" not in known:
            certain: BoolArray = known["certain"]
            return 0.0 if bool(certain.all()) else float("inf")
        lower, upper = (known[name if name in known else f"time_{name}"] for name in ("lower", "upper"))
        with np.errstate(invalid="ignore"):  # inf - inf of a time beyond the doubles
            return float(np.fmax.reduce(np.where(lower == upper, 0.0, upper - lower), initial=0.0))


@dataclass(frozen=True, eq=False)
class _Certified(Bounded):
    """An answer that can be asked for with ``certificates=True``."""

    _record: Callable[[Any, int], Record] | None = field(default=None, repr=False, kw_only=True)

    @property
    def certificates(self) -> Certificates | None:
        """Records that prove this answer as it stands; None unless they were asked for."""
        return None if self._record is None else Certificates(self, self._record)


@dataclass(frozen=True, eq=False)
class Cull(_Certified):
    """Answer of `cull`.

    Attributes
    ----------
    state : (n,) uint8
        `CullState` of every box.
    certain : (n,) bool
        True where the margin exceeds the proven rounding error, so exact arithmetic gives the same state.
    cost : Cost
    """

    state: ByteArray
    certain: BoolArray
    cost: Cost


@dataclass(frozen=True, eq=False)
class Distances(_Certified):
    """Answer of `distance` and `distance_to_frustum`.

    Attributes
    ----------
    distance, lower, upper : (n,) float64
        Distance [m] and a proven interval around the exact value.  0 for touching and overlapping bodies, or minus the
        penetration depth if ``want`` names "penetration".
    point_b : (n, d) float64
        Nearest point on b, or its deepest point in a; for `distance_to_frustum` the query points.
    status : (n,) uint8
        `DistanceStatus`.
    region : (n,) uint8 or None
        `FrustumRegion` of the nearest feature; only from `distance_to_frustum`.
    message : str
        Names what is unsupported; empty otherwise.
    cost : Cost

    Points and normals of two shapes are in the frame of a, those of two batches in the world frame.
    """

    distance: FloatArray
    lower: FloatArray
    upper: FloatArray
    point_b: FloatArray
    status: ByteArray
    cost: Cost
    _point_a: FloatArray | Callable[[], FloatArray] = field(repr=False)
    _normal: FloatArray | None = field(default=None, repr=False)
    region: ByteArray | None = None
    message: str = ""

    @cached_property
    def point_a(self) -> FloatArray:
        """(n, d) float64: nearest point on a, or its deepest point in b.

        `distance_to_frustum` finds it on first use unless ``want`` names "witness".
        """
        return self._point_a() if callable(self._point_a) else self._point_a

    @cached_property
    def normal(self) -> FloatArray:
        """(n, d) float64: unit, from a to b; NaN where there is none.

        Moving b by ``depth * normal`` separates overlapping bodies.
        """
        if self._normal is not None:
            return self._normal
        gap = self.point_b - self.point_a
        length = np.linalg.norm(gap, axis=-1, keepdims=True)
        return np.divide(gap, length, out=np.full_like(gap, np.nan), where=length > 0.0)


@dataclass(frozen=True, eq=False)
class Booleans(_Certified):
    """Answer of `intersects`.

    Attributes
    ----------
    value : (n,) bool
        True where the closed bodies have a common point; False where ``status`` is UNSUPPORTED, never ``certain`` then.
    certain : (n,) bool
        True where exact arithmetic is proven to give the same value.
    status : (n,) uint8
        `DistanceStatus`.
    message : str
        Names what is unsupported; empty otherwise.
    cost : Cost
    """

    value: BoolArray
    certain: BoolArray
    status: ByteArray
    cost: Cost
    message: str = ""


@dataclass(frozen=True, eq=False)
class FirstContacts(_Certified):
    """Answer of `first_contact`.

    Attributes
    ----------
    status : (n,) uint8
        `ContactStatus`.
    time, time_lower, time_upper : (n,) float64
        First contact [s] and a proven interval, up to inf where contact is not proven; 0 if in contact at the start,
        NaN for NEVER and UNSUPPORTED.
    last_time : (n,) float64
        Last contact [s], at most ``t_max``; inf if they never part, NaN for NEVER, UNSUPPORTED and bodies that turn,
        which may part and meet again.
    normal : (n, d) float64
        Unit contact normal from a to b at ``time``; NaN where there is none.
    points : (k, d) float64, point_offsets : (n + 1,) int64
        Contact set of item i: ``points[point_offsets[i]:point_offsets[i + 1]]``, one point, the two ends of a segment,
        or the counter-clockwise intersection polygon of polygons that overlap at the start.  Of solids also a polygon,
        counter-clockwise about the normal, or the vertices of what they share if they overlap at the start.
    part_offsets : (m + 1,) int64
        Parts of contact sets, of which bodies that are not convex have several: part k, one of these points, segments
        or polygons, is ``points[part_offsets[k]:part_offsets[k + 1]]``.
    certain : (n,) bool
        True where exact arithmetic is proven to give the same ``status``.
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
    certain: BoolArray
    _closing_speed: FloatArray | Callable[[], FloatArray] = field(repr=False)
    cost: Cost
    message: str = ""
    _part_offsets: IntArray | None = field(default=None, repr=False, kw_only=True)

    @cached_property
    def part_offsets(self) -> IntArray:
        """See above; of convex bodies what is not empty of `point_offsets`."""
        return np.unique(self.point_offsets) if self._part_offsets is None else self._part_offsets

    def parts(self, i: int) -> list[FloatArray]:
        """Contact set of item i, part by part, (m, d) each."""
        row = range(len(self.status))[i]
        ends = self.part_offsets
        first, last = np.searchsorted(ends, self.point_offsets[[row, row + 1]])
        return [self.points[j:k] for j, k in zip(ends[first:last], ends[first + 1 : last + 1], strict=True)]

    @cached_property
    def closing_speed(self) -> FloatArray:
        """(n,) float64: speed along the normal at which the bodies approach at ``time`` [m/s].

        < 0 where they part; NaN where there is no normal.  Of polygons it is that along ``normal`` as it stands, in
        float64, on first use.
        """
        return self._closing_speed() if callable(self._closing_speed) else self._closing_speed


def end_to_end(items: Sequence[FloatArray], width: int) -> tuple[FloatArray, IntArray]:
    """Rows of all items, and where each begins and ends."""
    offsets = np.cumsum([0, *map(len, items)], dtype=np.int64)
    return np.concatenate([np.zeros((0, width)), *items]), offsets


def gather(vertices: FloatArray, offsets: IntArray, rows: IntArray) -> tuple[FloatArray, IntArray]:
    """The listed rows of a ragged array, end to end, and their offsets."""
    if len(rows) == 1:
        only = vertices[offsets[rows[0]] : offsets[rows[0] + 1]]
        return only, np.array([0, len(only)])
    counts = offsets[rows + 1] - offsets[rows]
    ends = np.concatenate([[0], np.cumsum(counts)])
    # Position k of the output belongs to the item whose stretch it falls in, and lies as far into it.
    source = np.arange(ends[-1]) + np.repeat(offsets[rows] - ends[:-1], counts)
    return vertices[source], ends


def sets_end_to_end(sets: Iterable[Sequence[FloatArray]], width: int) -> tuple[FloatArray, IntArray, IntArray]:
    """Contact sets, each a list of parts (m, d): ``points``, ``point_offsets`` and ``part_offsets`` of an answer."""
    listed = list(sets)
    points, ends = end_to_end([part for parts in listed for part in parts], width)
    return points, ends[np.cumsum([0, *map(len, listed)])], ends


@dataclass(frozen=True, eq=False)
class CollisionTimes(Bounded):
    """Answer of `time_to_collision`.

    Attributes
    ----------
    status : (n,) uint8
        `ContactStatus` of every obstacle.
    time, time_lower, time_upper : (n,) float64
        No contact before ``time`` = ``time_lower`` [s]; contact proven until ``time_upper``, which is inf where there
        is no proof.  0 if in contact at the start, NaN for NEVER.
    certain : (n,) bool
        True where exact arithmetic is proven to give the same ``status``.
    cost : Cost
    """

    status: ByteArray
    time: FloatArray
    time_lower: FloatArray
    time_upper: FloatArray
    certain: BoolArray
    cost: Cost

    @cached_property
    def first(self) -> int:
        """Index of an obstacle that is hit first, by ``time``; -1 if none is."""
        found = ~np.isnan(self.time)
        return int(np.nanargmin(self.time)) if found.any() else -1

    @property
    def earliest(self) -> float:
        """Time [s] until which there is no contact with any obstacle; inf if there never is."""
        return float(self.time[self.first]) if self.first >= 0 else float("inf")

    @property
    def earliest_upper(self) -> float:
        """Time [s] until which contact with some obstacle is proven; inf if it is not."""
        return float(np.fmin.reduce(self.time_upper, initial=np.inf))
