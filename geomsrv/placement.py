# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""The edge of a scene: poses and twists of many objects, checked all at once, every fault named by its row."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from geomsrv import _validate
from geomsrv.answers import BoolArray, FloatArray
from geomsrv.errors import GeometryError

__all__ = ["IDENTITY", "in_fixed_frame", "laid_flat", "numbers", "product_of", "settled"]

# A polygon's frame may be tilted out of the plane by this [rad / 2], and its origin off the plane by this
# share of its distance, and is laid flat: rotations composed from several are no nearer to the plane than
# that.  It moves a vertex towards the origin by 2 * 2^-54 of its distance at most, half a unit in the last
# place.
MAX_TILT = 2.0**-27

IDENTITY = np.array([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0])

Faults = dict[int, str]


def numbers(values: Sequence[Any], name: str, default: FloatArray) -> tuple[FloatArray, Faults]:
    """One row of numbers per object; a row that is none gets the default, and a fault."""
    width = len(default)
    try:
        array = np.array(values)
        if array.dtype.kind in "fiu" and array.shape == (len(values), width):
            return array.astype(np.float64), {}
    except ValueError:
        pass  # rows of different lengths
    rows, faults = np.tile(default, (len(values), 1)), {}
    for k, value in enumerate(values):
        try:
            rows[k] = _validate.floats(value, name, (width,))
        except GeometryError as error:
            faults[k] = str(error)
    return rows, faults


def settled(poses: FloatArray, twists: FloatArray | None) -> tuple[FloatArray, Faults]:
    """Poses with unit quaternions, and what is wrong with which row of `poses` and `twists`."""
    faults: Faults = {}
    for name, rows in (("pose", poses), ("twist", twists)):
        if rows is not None and not np.isfinite(rows).all():
            for k, column in np.argwhere(~np.isfinite(rows)).tolist():
                faults.setdefault(k, f"{name}[{column}] is {rows[k, column]}, must be finite")
    with np.errstate(invalid="ignore", over="ignore"):
        norm = np.linalg.norm(poses[:, 3:], axis=1)
        wrong = ~(np.abs(norm - 1.0) <= _validate.MAX_QUATERNION_DEFECT)
    for k in np.flatnonzero(wrong).tolist():
        faults.setdefault(k, f"pose quaternion x y z w must have norm 1, got {norm[k]:.6g}")
    out = poses.copy()
    out[:, 3:] /= np.where(wrong, 1.0, norm)[:, None]
    return out, faults


def laid_flat(poses: FloatArray, twists: FloatArray | None, planar: BoolArray) -> tuple[FloatArray, Faults]:
    """Poses with polygons exactly in the plane, and which of them are not in it or leave it."""
    if not planar.any():
        return poses, {}
    out_of_plane = poses[planar, 2:5].any() or (twists is not None and twists[planar, 2:5].any())
    if not out_of_plane:
        return poses, {}
    faults: Faults = {}
    plane = "the plane z = 0 of the fixed frame"
    with np.errstate(invalid="ignore"):
        tilt = np.abs(poses[:, 3:5]).max(axis=1)
        off = ~(np.abs(poses[:, 2]) <= MAX_TILT * np.abs(poses[:, :2]).sum(axis=1))
    for k in np.flatnonzero(planar & off).tolist():
        faults.setdefault(k, f"a polygon lies in {plane}, got z = {poses[k, 2]:.6g}")
    for k in np.flatnonzero(planar & ~(tilt <= MAX_TILT)).tolist():
        faults.setdefault(k, f"a polygon lies in {plane}: its pose must turn about z only")
    if twists is not None:
        for k in np.flatnonzero(planar & twists[:, 2:5].any(axis=1)).tolist():
            faults.setdefault(k, f"a polygon stays in {plane}: vz, wx, wy must be 0")
    out = poses.copy()
    out[planar, 2] = 0.0
    flat = planar & (tilt <= MAX_TILT) & (tilt > 0.0)
    out[flat, 3:5] = 0.0
    out[flat, 5:] /= np.hypot(out[flat, 5], out[flat, 6])[:, None]
    return out, faults


def in_fixed_frame(
    poses: FloatArray,
    twists: FloatArray,
    frames: Sequence[str],
    fixed_frame: str,
    transforms: Callable[[str], ArrayLike] | None,
) -> tuple[FloatArray, FloatArray, Faults]:
    """Poses and twists of objects given in `frames`; each frame is asked for once, and counts as being at rest."""
    faults: Faults = {}
    poses, twists = poses.copy(), twists.copy()
    for frame in dict.fromkeys(frames):
        if frame in ("", fixed_frame):
            continue
        rows = [k for k, name in enumerate(frames) if name == frame]
        try:
            pose = _pose_of(frame, fixed_frame, transforms)
        except Exception as error:  # noqa: BLE001  whatever the callable raises is the reason
            faults.update(dict.fromkeys(rows, f"frame {frame!r}: {error}"))
            continue
        turn = _validate.rotation_matrices(pose[:, 3:])[0]
        poses[rows, :3] = poses[rows, :3] @ turn.T + pose[0, :3]
        poses[rows, 3:] = product_of(pose[0, 3:], poses[rows, 3:])
        twists[rows, :3] = twists[rows, :3] @ turn.T
        twists[rows, 3:] = twists[rows, 3:] @ turn.T
    return poses, twists, faults


def _pose_of(frame: str, fixed_frame: str, transforms: Callable[[str], ArrayLike] | None) -> FloatArray:
    if transforms is None:
        raise GeometryError(f"only the fixed frame {fixed_frame!r} is known here, there are no transforms")
    return _validate.poses(_validate.floats(transforms(frame), "transform", (7,)), "transform")


def product_of(a: FloatArray, b: FloatArray) -> FloatArray:
    """(n, 4) quaternion products, x y z w, of many b (n, 4) and as many a, or one (4,)."""
    ax, ay, az, aw = a.T
    bx, by, bz, bw = b.T
    return np.column_stack(
        [
            aw * bx + ax * bw + ay * bz - az * by,
            aw * by - ax * bz + ay * bw + az * bx,
            aw * bz + ax * by - ay * bx + az * bw,
            aw * bw - ax * bx - ay * by - az * bz,
        ]
    )
