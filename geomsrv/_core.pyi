# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""The compiled engine: float64 arrays in, arrays out; input was validated by the caller; the GIL is released."""

import numpy as np
from numpy.typing import NDArray

_F = NDArray[np.float64]
_I = NDArray[np.int64]
_U = NDArray[np.uint8]
_B = NDArray[np.bool_]
# distance, lower, upper (n,), point_a, point_b, normal (n, d), status (n,), rung (n,) (rung.hpp)
_Distances = tuple[_F, _F, _F, _F, _F, _F, _U, _U]
# the same, then as evidence the simplex (n, 4, 2) of vertices of the difference
_ProvenDistances = tuple[_F, _F, _F, _F, _F, _F, _U, _U, NDArray[np.int32] | None]
# status, time, time_lower, time_upper, last_time (n,), normal (n, 3), points (k, 3), point_offsets (n + 1,), certain,
# closing_speed (n,), items per rung
_Contacts = tuple[_U, _F, _F, _F, _F, _F, _F, _I, _B, _F, _Rungs]
# which algorithm had the last word (Stage in separation.hpp) and its iterations, for tests
_Stages = tuple[_U, _I]
# items answered by bounding volumes, by the filter, in double-double, exactly
_Rungs = tuple[int, int, int, int]
# distance, lower, upper, region (n,), point_a (n, d), and as evidence the simplex (n, 4, 2) of corners and the point
_PointDistances = tuple[_F, _F, _F, _U | None, _F | None, NDArray[np.int32] | None, _Rungs]

def first_nonfinite(values: _F) -> int: ...
def first_skewed(matrices: _F, limit: float) -> tuple[int, float]: ...
def rotation_matrices(quaternions: _F) -> _F: ...
def unit_quaternions(poses: _F, limit: float) -> tuple[_F, int, float]: ...
def check_rings(vertices: _F, offsets: _I) -> tuple[int, int, str]: ...

# state, certain, decided by bound, filter, wide, exact and left uncertain, and with `evidence` the arrays of
# CullEvidence (cull_evidence.hpp): simplex (n, 4, 2), beyond (n, 2)
def cull(
    frustum: _F, center: _F, axes: _F, half_extents: _F, accuracy: str, evidence: bool
) -> tuple[_U, _B, tuple[int, int, int, int, int], NDArray[np.int32] | None, NDArray[np.int8] | None]: ...
def distance_to_frustum(frustum: _F, points: _F, accuracy: str, witness: bool, evidence: bool) -> _PointDistances: ...
def distance_to_frustum_2d(
    frustum: _F, points: _F, accuracy: str, witness: bool, evidence: bool
) -> _PointDistances: ...
def first_contact_polygons(
    vertices_a: _F,
    offsets_a: _I,
    vertices_b: _F,
    offsets_b: _I,
    velocity_a: _F,
    velocity_b: _F,
    t_max: float,
    contact_set: bool,
    accuracy: str = "float64",
) -> tuple[_U, _F, _F, _F, _F, _F, _F, _I, _B, _Rungs]: ...
def first_contact_turning(
    a: tuple[_F | _I, ...],
    b: tuple[_F | _I, ...],
    motion_a: _F,
    motion_b: _F,
    t_max: float,
    tolerance: float,
    slack: _F,
    contact_set: bool = False,
) -> tuple[_U, _F, _F, _F, _F, _B, _I, _F, _I]: ...
def shared_turning(
    a: tuple[_F | _I, ...],
    b: tuple[_F | _I, ...],
    motion_a: _F,
    motion_b: _F,
    time: float,
    span: float,
    normal: _F,
    slack: _F,
) -> tuple[_F, _F, _I]: ...
def points_on_twist(
    ring: _F, twist: _F, points: _F, velocities: _F, t_max: float, tolerance: float
) -> tuple[_U, _F, _F, int]: ...
def turn_of_twist(twist: _F) -> tuple[float, float, float, float]: ...
def first_contact_world(
    a: tuple[_F | _I, ...],
    b: tuple[_F | _I, ...],
    velocity_a: _F,
    velocity_b: _F,
    t_max: float,
    contact_set: bool,
    accuracy: str = "float64",
) -> _Contacts: ...
def box_motion_verdicts_world(
    a: tuple[_F | _I, ...], b: tuple[_F | _I, ...], velocity_a: _F, velocity_b: _F, t_max: float
) -> _U: ...
def distance_polygons(
    vertices_a: _F, offsets_a: _I, vertices_b: _F, offsets_b: _I, penetration: bool, accuracy: str = "float64"
) -> tuple[_F, _F, _F, _F, _F, _F, _U, _B, _B, _Rungs]: ...
def distance_world(
    a: tuple[_F | _I, ...], b: tuple[_F | _I, ...], penetration: bool, accuracy: str = "float64", evidence: bool = False
) -> _ProvenDistances: ...
def distance_world_stages(
    a: tuple[_F | _I, ...], b: tuple[_F | _I, ...], penetration: bool, accuracy: str = "float64", evidence: bool = False
) -> _Stages: ...
def shape_kinds() -> tuple[str, ...]: ...
def supported_pairs() -> _B: ...
def distance_pairs(
    kinds: _U,
    params: _F,
    vertices: _F,
    offsets: _I,
    pairs: _I,
    poses_ab: _F,
    penetration: bool,
    accuracy: str = "float64",
    evidence: bool = False,
    frusta: _F | None = None,
) -> _ProvenDistances: ...
def distance_pairs_stages(
    kinds: _U,
    params: _F,
    vertices: _F,
    offsets: _I,
    pairs: _I,
    poses_ab: _F,
    penetration: bool,
    accuracy: str = "float64",
    evidence: bool = False,
    frusta: _F | None = None,
) -> _Stages: ...
def distance_placed(
    kinds: _U,
    params: _F,
    vertices: _F,
    offsets: _I,
    reach: _F,
    shape: _I,
    poses: _F,
    uncertainty: _F,
    pairs: _I,
    pose_rounding: float,
    penetration: bool,
    accuracy: str = "float64",
    frusta: _F | None = None,
) -> _Distances: ...
def bounding_boxes(
    poses: _F,
    rotations: _F,
    uncertainty: _F,
    shape: _I,
    center: _F,
    half: _F,
    round: _F,
    rounding: float,
    underflow: float,
) -> tuple[_F, _F]: ...
def swept_boxes(
    lower: _F,
    upper: _F,
    poses: _F,
    twists: _F,
    turns: _B,
    reach: _F,
    drift: _F,
    horizon: float,
    rounding: float,
) -> tuple[_F, _F]: ...
def overlapping_pairs(lower: _F, upper: _F) -> _I: ...
def overlapping_pairs_between(lower_a: _F, upper_a: _F, lower_b: _F, upper_b: _F) -> _I: ...
