# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""The edge: everything a caller passes in is checked here, once, and leaves as C-contiguous float64.

Each fault becomes a `GeometryError` that names the argument, the item's index and what was wrong.
Nothing below this line checks its input again.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from geomsrv import _core
from geomsrv.errors import GeometryError, NotAvailableError

ACCURACIES = ("bound", "float32", "float64", "exact")  #: every tier, cheapest first
CERTIFIED_ACCURACIES = ("float64", "exact")  #: the tiers whose answers can be proven

# A rotation is refused if a row's length or the angle between two rows is off by more than this: beyond it
# the caller has passed something else (a scaled matrix, a transposed block), not a rotation that drifted.
# Up to it the numbers are taken literally: a box is the hull of center +- e_i * axes_i.
MAX_AXES_DEFECT = 1e-2

# Quaternions are normalised; a norm further from 1 than float32 drift allows is a mistake, not drift.
MAX_QUATERNION_DEFECT = 1e-3

# So few items are looked at faster one by one than by numpy, whose every call costs as much as some ten of them.
ONE_BY_ONE = 4


def shape_text(shape: tuple[int | None, ...]) -> str:
    """(None, 3) -> "(n, 3)"."""
    names = iter("nmk")
    inner = ", ".join(next(names) if size is None else str(size) for size in shape)
    return f"({inner},)" if len(shape) == 1 else f"({inner})"


def array(value: Any, name: str) -> NDArray[Any]:
    """`value` as an array of whatever it holds; numpy's own complaint would not name the argument."""
    if np.ma.isMaskedArray(value):
        raise GeometryError(f"{name} must not be a masked array")
    try:
        return np.asarray(value)
    except (TypeError, ValueError) as error:
        raise GeometryError(f"{name} is not an array: {error}") from error


def floats(
    value: Any, name: str, shape: tuple[int | None, ...], *, allow_infinite: bool = False
) -> NDArray[np.float64]:
    """`value` as finite C-contiguous float64 of the given shape (None: any size)."""
    given = value if type(value) is np.ndarray else array(value, name)
    if given.dtype.kind not in "fiu":
        raise GeometryError(f"{name} must hold real numbers, got dtype {given.dtype}")
    if given.dtype.itemsize > 8:
        raise GeometryError(f"{name} must be representable in float64, got dtype {given.dtype}")
    if not _has_shape(given, shape):
        wanted = f"have shape {shape_text(shape)}" if shape else "be a single number"
        raise GeometryError(f"{name} must {wanted}, got shape {given.shape}")
    numbers = np.asarray(given, dtype=np.float64, order="C")
    if allow_infinite:
        if np.isnan(numbers).any():
            raise GeometryError(f"{name}{_where(numbers, int(np.isnan(numbers).argmax()))} is nan")
        return numbers
    bad = _core.first_nonfinite(numbers)
    if bad >= 0:
        raise GeometryError(f"{name}{_where(numbers, bad)} is {numbers.reshape(-1)[bad]}, must be finite")
    return numbers


def _has_shape(given: NDArray[Any], shape: tuple[int | None, ...]) -> bool:
    if given.ndim != len(shape):
        return False
    for want, got in zip(shape, given.shape, strict=True):
        if want is not None and want != got:
            return False
    return True


def _where(array: NDArray[Any], flat_index: int) -> str:
    """Index text of a flat position: "[3, 1]"; empty for a scalar."""
    index = np.unravel_index(flat_index, array.shape)
    return f"[{', '.join(str(int(i)) for i in index)}]" if index else ""


def scalar(value: Any, name: str, *, positive: bool = False, minimum: float | None = None) -> float:
    """One finite number."""
    plain = type(value) is float and math.isfinite(value)
    number = value if plain else float(floats(value, name, ()))
    if positive and not number > 0.0:
        raise GeometryError(f"{name} must be > 0, got {number}")
    if minimum is not None and number < minimum:
        raise GeometryError(f"{name} must be >= {minimum:g}, got {number}")
    return number


def limit(value: Any, name: str) -> float:
    """The end of a range that begins at 0: one number >= 0 that may be inf."""
    plain = type(value) is float and not math.isnan(value)
    number = value if plain else float(floats(value, name, (), allow_infinite=True))
    if not number >= 0.0:
        raise GeometryError(f"{name} must be >= 0, got {number}")
    return number


def offsets(value: Any, name: str, total: int, minimum_count: int) -> NDArray[np.int64]:
    """Ragged row offsets: starts at 0, ends at `total`, every item has at least `minimum_count` rows."""
    given = array(value, name)
    if given.dtype.kind not in "iu":
        raise GeometryError(f"{name} must hold integers, got dtype {given.dtype}")
    if given.ndim != 1 or len(given) < 1:
        raise GeometryError(f"{name} must have shape (n + 1,), got {given.shape}")
    if len(given) <= ONE_BY_ONE and _rising(given.tolist(), total, minimum_count):
        return np.ascontiguousarray(given, dtype=np.int64)
    if given[0] != 0 or given[-1] != total:
        raise GeometryError(f"{name} must run from 0 to {total}, got {given[0]} to {given[-1]}")
    # Before any subtraction: differences of huge offsets wrap around to plausible counts.
    outside = (given < 0) | (given > total)
    if outside.any():
        i = int(np.argmax(outside))
        raise GeometryError(f"{name}[{i}] is {given[i]}, outside 0..{total}")
    ends = np.ascontiguousarray(given, dtype=np.int64)
    counts = np.diff(ends)
    if (counts < minimum_count).any():
        i = int(np.argmax(counts < minimum_count))
        raise GeometryError(f"{name}: item {i} has {counts[i]} vertices, needs at least {minimum_count}")
    return ends


def _rising(ends: list[int], total: int, minimum_count: int) -> bool:
    """What `offsets` asks."""
    steps = zip(ends, ends[1:], strict=False)
    return ends[0] == 0 and ends[-1] == total and all(0 <= a and b - a >= minimum_count for a, b in steps)


def axes(value: Any, name: str, shape: tuple[int | None, ...]) -> NDArray[np.float64]:
    """Unit, mutually perpendicular rows, taken literally up to `MAX_AXES_DEFECT`; either handedness."""
    rows = floats(value, name, shape)
    bad, defect = _core.first_skewed(rows, MAX_AXES_DEFECT)
    if bad >= 0:
        item = f"[{bad}]" if rows.ndim == 3 else ""
        raise GeometryError(
            f"{name}{item} must have orthonormal rows, off by {defect:.3g} (at most {MAX_AXES_DEFECT:g})"
        )
    return rows


def poses(value: Any, name: str = "poses") -> NDArray[np.float64]:
    """(n, 7) or (7,) rows x y z qx qy qz qw -> (n, 7) with unit quaternions."""
    given = array(value, name)
    rows = floats(given, name, (7,) if given.ndim == 1 else (None, 7)).reshape(-1, 7)
    placed, bad, norm = _core.unit_quaternions(rows, MAX_QUATERNION_DEFECT)
    if bad >= 0:
        item = f"[{bad}]" if given.ndim == 2 else ""
        raise GeometryError(f"{name}{item} quaternion x y z w must have norm 1, got {norm:.6g}")
    return placed


def rotation_matrices(quaternions: NDArray[np.float64]) -> NDArray[np.float64]:
    """(n, 4) unit x y z w -> (n, 3, 3) rotation matrices R, v_world = R v_body."""
    return _core.rotation_matrices(np.ascontiguousarray(quaternions, np.float64))


def rows(value: Any, name: str, count: int, width: int) -> NDArray[np.float64]:
    """(n, d) or (d,) -> (n, d) or (1, d), float64."""
    given = array(value, name)
    found = floats(given, name, (width,) if given.ndim == 1 else (None, width)).reshape(-1, width)
    if len(found) not in (1, count):
        raise GeometryError(f"{name} must have shape ({width},) or ({count}, {width}), got {given.shape}")
    return found


def velocities(value: Any, count: int, width: int) -> NDArray[np.float64]:
    """Of obstacles, (n, d) or (1, d); they rest by default."""
    return np.zeros((1, width)) if value is None else rows(value, "velocities", count, width)


def common_length(a: int, b: int) -> int:
    """Number of items of two batches, n against n or one against n."""
    if a != b and 1 not in (a, b):
        raise GeometryError(f"a and b must have the same length, or one of them length 1; got {a} and {b}")
    return b if a == 1 else a


def accuracy(value: Any, available: tuple[str, ...] = ("float64",)) -> str:
    """A tier that the query answers."""
    if not isinstance(value, str) or value not in ACCURACIES:
        raise GeometryError(f"accuracy must be one of {', '.join(ACCURACIES)}, got {value!r}")
    if value not in available:
        answered = ", ".join(map(repr, available))
        raise NotAvailableError(f"accuracy={value!r} is not available yet; this query answers {answered}")
    return value


def certificates(value: Any, tier: str) -> bool:
    """Whether certificates are wanted; bounding volumes and single precision leave nothing that could be proven."""
    if not isinstance(value, (bool, np.bool_)):
        raise GeometryError(f"certificates must be True or False, got {value!r}")
    if value and tier not in CERTIFIED_ACCURACIES:
        raise GeometryError(f"certificates need accuracy {' or '.join(CERTIFIED_ACCURACIES)}, got {tier!r}")
    return bool(value)


def want(value: Any, known: tuple[str, ...]) -> frozenset[str]:
    """The set of named effects asked for."""
    names = (value,) if isinstance(value, str) else tuple(value) if isinstance(value, Iterable) else (value,)
    for name in names:
        if not isinstance(name, str) or name not in known:
            raise GeometryError(f"want must name some of {', '.join(known)}, got {name!r}")
    return frozenset(names)
