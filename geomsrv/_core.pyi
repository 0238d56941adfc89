# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""The compiled engine: float64 arrays in, arrays out; input was validated by the caller; the GIL is released."""

import numpy as np
from numpy.typing import NDArray

_F = NDArray[np.float64]
_I = NDArray[np.int64]
_U = NDArray[np.uint8]
_B = NDArray[np.bool_]
# distance, lower, upper (n,), point_a, point_b, normal (n, d), status (n,)
_Distances = tuple[_F, _F, _F, _F, _F, _F, _U]
# status, time, time_lower, time_upper, last_time (n,), normal (n, 3), points (k, 3), point_offsets (n + 1,), certain,
# closing_speed (n,), items answered by the filter, in double-double, exactly
_Contacts = tuple[_U, _F, _F, _F, _F, _F, _F, _I, _B, _F, tuple[int, int, int]]
# which algorithm had the last word (Stage in separation.hpp) and its iterations, for tests
_Stages = tuple[_U, _I]

def first_nonfinite(values: _F) -> int: ...
def check_rings(vertices: _F, offsets: _I) -> tuple[int, int, str]: ...
def cull(frustum: _F, center: _F, axes: _F, half_extents: _F) -> tuple[_U, _B, tuple[int, int, int]]: ...
def distance_to_frustum(frustum: _F, points: _F, witness: bool) -> tuple[_F, _F, _F, _U, _F | None]: ...
def distance_to_frustum_2d(frustum: _F, points: _F, witness: bool) -> tuple[_F, _F, _F, _U, _F | None]: ...
def first_contact_polygons(
    vertices_a: _F,
    offsets_a: _I,
    vertices_b: _F,
    offsets_b: _I,
    velocity_a: _F,
    velocity_b: _F,
    t_max: float,
    contact_set: bool,
) -> tuple[_U, _F, _F, _F, _F, _F, _F, _I]: ...
def first_contact_boxes(
    center_a: _F,
    axes_a: _F,
    half_extents_a: _F,
    center_b: _F,
    axes_b: _F,
    half_extents_b: _F,
    velocity_a: _F,
    velocity_b: _F,
    t_max: float,
    contact_set: bool,
    accuracy: str,
) -> _Contacts: ...
def first_contact_boxes_polytopes(
    center_a: _F,
    axes_a: _F,
    half_extents_a: _F,
    vertices_b: _F,
    offsets_b: _I,
    velocity_a: _F,
    velocity_b: _F,
    t_max: float,
    contact_set: bool,
    accuracy: str,
) -> _Contacts: ...
def first_contact_polytopes_boxes(
    vertices_a: _F,
    offsets_a: _I,
    center_b: _F,
    axes_b: _F,
    half_extents_b: _F,
    velocity_a: _F,
    velocity_b: _F,
    t_max: float,
    contact_set: bool,
    accuracy: str,
) -> _Contacts: ...
def first_contact_polytopes(
    vertices_a: _F,
    offsets_a: _I,
    vertices_b: _F,
    offsets_b: _I,
    velocity_a: _F,
    velocity_b: _F,
    t_max: float,
    contact_set: bool,
    accuracy: str,
) -> _Contacts: ...
def distance_polygons(
    vertices_a: _F, offsets_a: _I, vertices_b: _F, offsets_b: _I, penetration: bool
) -> _Distances: ...
def distance_boxes(
    center_a: _F,
    axes_a: _F,
    half_extents_a: _F,
    center_b: _F,
    axes_b: _F,
    half_extents_b: _F,
    penetration: bool,
) -> _Distances: ...
def distance_boxes_stages(
    center_a: _F,
    axes_a: _F,
    half_extents_a: _F,
    center_b: _F,
    axes_b: _F,
    half_extents_b: _F,
    penetration: bool,
) -> _Stages: ...
def distance_boxes_polytopes(
    center_a: _F,
    axes_a: _F,
    half_extents_a: _F,
    vertices_b: _F,
    offsets_b: _I,
    origin_b: _F,
    error_b: _F,
    penetration: bool,
) -> _Distances: ...
def distance_polytopes(
    vertices_a: _F,
    offsets_a: _I,
    origin_a: _F,
    error_a: _F,
    vertices_b: _F,
    offsets_b: _I,
    origin_b: _F,
    error_b: _F,
    penetration: bool,
) -> _Distances: ...
def distance_boxes_polytopes_stages(
    center_a: _F,
    axes_a: _F,
    half_extents_a: _F,
    vertices_b: _F,
    offsets_b: _I,
    origin_b: _F,
    error_b: _F,
    penetration: bool,
) -> _Stages: ...
def distance_polytopes_stages(
    vertices_a: _F,
    offsets_a: _I,
    origin_a: _F,
    error_a: _F,
    vertices_b: _F,
    offsets_b: _I,
    origin_b: _F,
    error_b: _F,
    penetration: bool,
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
) -> _Distances: ...
def distance_pairs_stages(
    kinds: _U,
    params: _F,
    vertices: _F,
    offsets: _I,
    pairs: _I,
    poses_ab: _F,
    penetration: bool,
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
) -> _Distances: ...
def overlapping_pairs(lower: _F, upper: _F) -> _I: ...
def overlapping_pairs_between(lower_a: _F, upper_a: _F, lower_b: _F, upper_b: _F) -> _I: ...
