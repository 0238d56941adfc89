# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""Inputs on which other engines went wrong (data/field_cases.jsonl): ours must give the verified values."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from conftest import field_cases
from oracle import polygon

import geomsrv as gs

# The cases state poses by 17 digits of a rotation matrix; rewriting one as a quaternion moves points by a few ulps of
# their coordinates.  The verified values are good to far less.
TOLERANCE = 1e-13

KERNELS = {"sphere", "capsule", "box", "convex", "triangle", "segment", "point", "halfspace"}


def shape_of(case: dict[str, Any]) -> gs.Shape:
    match case["type"]:
        case "sphere":
            return gs.Sphere(case["radius"])
        case "capsule":
            return gs.Capsule(case["radius"], case["length"])
        case "box":
            return gs.Box(np.array(case["size"], dtype=float) / 2)
        case "halfspace":
            return gs.HalfSpace(case["normal"], case["offset"])
        case "point":
            return gs.Point(case["point"])
        case _:
            return gs.Convex(case["vertices"])


def pose_of(case: dict[str, Any]) -> tuple[np.ndarray, np.ndarray]:
    pose = case.get("pose", {"R": np.eye(3), "t": np.zeros(3)})
    return np.array(pose["R"], dtype=float), np.array(pose["t"], dtype=float)


def quaternion_of(rotation: np.ndarray) -> np.ndarray:
    """x y z w, by the largest of the four: no cancellation (Shepperd 1978)."""
    m = rotation
    trace = m[0, 0] + m[1, 1] + m[2, 2]
    squares = np.array([2 * m[0, 0] - trace, 2 * m[1, 1] - trace, 2 * m[2, 2] - trace, trace]) + 1
    x, y, z, w = (
        np.array([squares[0], m[1, 0] + m[0, 1], m[2, 0] + m[0, 2], m[2, 1] - m[1, 2]]),
        np.array([m[1, 0] + m[0, 1], squares[1], m[2, 1] + m[1, 2], m[0, 2] - m[2, 0]]),
        np.array([m[2, 0] + m[0, 2], m[2, 1] + m[1, 2], squares[2], m[1, 0] - m[0, 1]]),
        np.array([m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1], squares[3]]),
    )
    best = (x, y, z, w)[int(np.argmax(squares))]
    return best / np.linalg.norm(best)


def corners_of(case: dict[str, Any]) -> np.ndarray | None:
    """World coordinates of the vertices of a shape that has them."""
    shape = shape_of(case)
    rotation, position = pose_of(case)
    if isinstance(shape, gs.Box):
        local = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * shape.half_extents
    elif hasattr(shape, "vertices"):
        local = shape.vertices
    else:
        return None
    return local @ rotation.T + position


def size_of(case: dict[str, Any], other: dict[str, Any]) -> float:
    """Largest number of the scene relative to the other shape's position: what rounding of the pose scales with."""
    corners = corners_of(case)
    reach = np.abs(corners - pose_of(other)[1]).max() if corners is not None else 0.0
    numbers = [np.abs(np.ravel(v)).max() for k, v in case.items() if k in ("radius", "length", "size", "offset")]
    return max([1e-3, float(reach), float(np.abs(pose_of(case)[1] - pose_of(other)[1]).max()), *numbers])


DISTANCES = [
    case
    for kind in ("signed_distance", "distance")
    for case in field_cases(kind)
    if all(shape["type"] in KERNELS and "rounding" not in shape for shape in case["shapes"])
    and case["verified_value"] is not None
]


@pytest.mark.parametrize("case", DISTANCES, ids=[case["id"] for case in DISTANCES])
def test_distance(case: dict[str, Any]) -> None:
    first, second = case["shapes"]
    (rotation_a, position_a), (rotation_b, position_b) = pose_of(first), pose_of(second)
    pose = np.concatenate([rotation_a.T @ (position_b - position_a), quaternion_of(rotation_a.T @ rotation_b)])
    size = max(size_of(first, second), size_of(second, first))
    # A quaternion cannot say how far a matrix is off orthonormal; the verified values take the matrices as given.
    defect = max(np.abs(r.T @ r - np.eye(3)).max() for r in (rotation_a, rotation_b))
    tolerance = (TOLERANCE + 2 * defect) * size
    expected = case["verified_value"]
    signed = gs.distance(shape_of(first), shape_of(second), pose, want=("distance", "penetration"))
    assert signed.status == gs.DistanceStatus.OK
    if case["kind"] == "signed_distance":
        assert abs(signed.distance[0] - expected) <= tolerance
        assert signed.lower[0] - tolerance <= expected <= signed.upper[0] + tolerance
    plain = gs.distance(shape_of(first), shape_of(second), pose)
    assert abs(plain.distance[0] - max(0.0, case.get("verified_distance", expected))) <= tolerance
    if abs(expected) > tolerance:
        assert gs.intersects(shape_of(first), shape_of(second), pose).value == (expected < 0.0)
    corners = corners_of(first), corners_of(second)
    if case["kind"] == "signed_distance" and corners[0] is not None and corners[1] is not None:
        # World coordinates take the matrices as given, and are rounded to the ulps of the far corner.
        world = gs.distance(*(gs.Polytopes.from_list([c]) for c in corners), want=("penetration",))
        assert abs(world.distance[0] - expected) <= TOLERANCE * size + 1e-15 * max(np.abs(c).max() for c in corners)


def test_enough_distance_cases() -> None:
    assert len(DISTANCES) >= 120
    assert sum(case["verified_value"] < 0 for case in DISTANCES) >= 40


CULLS = [case for case in field_cases("frustum_cull") if "aspect" in case["frustum"] and "hfov" in case["frustum"]]


@pytest.mark.parametrize("case", CULLS, ids=[case["id"] for case in CULLS])
def test_cull(case: dict[str, Any]) -> None:
    given, (hull, box) = case["frustum"], case["shapes"]
    eye = np.array(given["pos"], dtype=float)
    fov_y = 2.0 * math.atan(math.tan(given["hfov"] / 2.0) / given["aspect"])
    camera = gs.Frustum.look_at(eye, eye + [1, 0, 0], [0, 0, 1], fov_y, given["aspect"], given["near"], given["far"])
    nearest = np.abs(camera.corners()[:, None] - np.array(hull["vertices"])[None]).max(axis=2).min(axis=1)
    assert nearest.max() < 1e-12  # it is the frustum of the case
    rotation, position = pose_of(box)
    boxes = gs.Boxes(position[None], rotation.T[None], np.array([box["size"]]) / 2.0)
    answer = gs.cull(camera, boxes)
    assert answer.certain and (answer.state != gs.OUTSIDE) == case["verified_visible"]
    gap = gs.distance(camera, boxes, want=("penetration",))
    assert abs(gap.distance[0] - case["verified_value"]) <= TOLERANCE * given["far"]


# Prisms that move across their height: the axis along it, and the case.
FLAT_MOTIONS = {
    "parry-214-cuboids-2d": 2,
    "ncollide-214-2d": 2,
    "box2d-toi-halfway": 2,
    "parry-141-moving-away": 2,
    "jolt-cast-initially-intersecting": 2,
    "parry-180-cuboid-segment": 2,
    "fcl-555-mesh-boxes": 0,
}


@pytest.mark.parametrize("name", FLAT_MOTIONS)
def test_first_contact(name: str) -> None:
    (case,) = [case for case in field_cases("toi") if case["id"] == name]
    kept = [k for k in range(3) if k != FLAT_MOTIONS[name]]
    rings = []
    for shape in case["shapes"]:
        corners = corners_of(shape)
        assert corners is not None
        rings.append([tuple(float(x) for x in p) for p in polygon.hull(corners[:, kept].tolist())])
    bodies = [gs.Polygons.from_list([ring]) for ring in rings]
    velocities = [np.array(v, dtype=float)[kept] for v in case["motion"]["v"]]
    answer = gs.first_contact(*bodies, *velocities, t_max=float(case["motion"]["tmax"]))
    expected = case["verified_value"]
    if expected is None:
        assert answer.status == gs.NEVER
        return
    assert answer.status == (gs.WILL_TOUCH if expected > 0 else gs.OVERLAPPING)
    assert answer.time_lower[0] <= answer.time[0] <= answer.time_upper[0]
    assert abs(answer.time[0] - expected) <= TOLERANCE * max(1.0, expected)


def test_enough_cull_cases() -> None:
    assert {case["verified_visible"] for case in CULLS} == {True, False}
