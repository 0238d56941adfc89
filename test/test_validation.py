# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""The edge: bad input raises and names argument, index and fault; good input is taken as it is."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import geomsrv as gs
from geomsrv.errors import GeometryError, NotAvailableError

# Overflow in a check is a fault the caller must see as a GeometryError, not as a numpy warning.
pytestmark = pytest.mark.filterwarnings("error")

EYE = np.eye(3)
EYES = np.stack([EYE, EYE])
POSE = (1.0, 2.0, 3.0, 0.0, 0.0, 0.0, 1.0)
SQUARE = ((0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0))
CAMERA = {"origin": (1.0, 2.0, 3.0), "axes": EYE, "left": 1.0, "up": 2.0, "near": 1.0, "far": 4.0}


def without(given: dict[str, Any], *names: str) -> dict[str, Any]:
    return {name: value for name, value in given.items() if name not in names}


def frustum() -> gs.Frustum:
    return gs.Frustum(**CAMERA)


def frustum_2d() -> gs.Frustum2D:
    return gs.Frustum2D([0, 0], np.eye(2), 1.0, 1.0, 4.0)


def boxes(n: int = 2) -> gs.Boxes:
    return gs.Boxes(3.0 * np.arange(3 * n).reshape(n, 3), np.tile(EYE, (n, 1, 1)), np.ones((n, 3)))


def polygons(n: int = 2) -> gs.Polygons:
    return gs.Polygons.from_list([np.array(SQUARE) + 3.0 * i for i in range(n)])


def polytopes(n: int = 2) -> gs.Polytopes:
    return gs.Polytopes.from_list([np.vstack([np.zeros(3), EYE]) + 3.0 * i for i in range(n)])


# ------------------------------------------------------- every argument of every entry, and what it can be

# name: (callable, valid arguments, the array arguments, the number arguments)
ENTRIES: dict[str, tuple[Callable[..., Any], dict[str, Any], str, str]] = {
    "Frustum": (gs.Frustum, CAMERA, "origin axes", "left up near far"),
    "Frustum.bounds": (
        gs.Frustum,
        {**without(CAMERA, "left", "up"), "bounds": (-1.0, 2.0, 1.0, 3.0)},
        "origin axes bounds",
        "near far",
    ),
    "Frustum.look_at": (
        gs.Frustum.look_at,
        {"eye": (0.0, 0.0, 1.0), "target": (5.0, 1.0, 0.0), "up": (0.0, 0.0, 1.0), "fov_y": 1.0}
        | {"aspect": 2.0, "near": 1.0, "far": 9.0},
        "eye target up",
        "fov_y aspect near far",
    ),
    "Frustum.from_intrinsics": (
        gs.Frustum.from_intrinsics,
        {"K": ((500.0, 0.0, 320.0), (0.0, 500.0, 240.0), (0.0, 0.0, 1.0)), "width": 640.0, "height": 480.0}
        | {"X_world_camera": np.eye(4), "near": 1.0, "far": 9.0},
        "K X_world_camera",
        "width height near far",
    ),
    "Frustum.from_intrinsics.pose": (
        gs.Frustum.from_intrinsics,
        {"K": ((500.0, 0.0, 320.0), (0.0, 500.0, 240.0), (0.0, 0.0, 1.0)), "width": 640.0, "height": 480.0}
        | {"X_world_camera": POSE, "near": 1.0, "far": 9.0},
        "K X_world_camera",
        "",
    ),
    "Frustum2D": (
        gs.Frustum2D,
        {"origin": (1.0, 2.0), "axes": np.eye(2), "left": 1.0, "near": 1.0, "far": 4.0},
        "origin axes",
        "left near far",
    ),
    "Frustum2D.bounds": (
        gs.Frustum2D,
        {"origin": (1.0, 2.0), "axes": np.eye(2), "near": 1.0, "far": 4.0, "bounds": (-1.0, 2.0)},
        "bounds",
        "",
    ),
    "Boxes": (
        gs.Boxes,
        {"center": ((1.0, 2.0, 3.0), (4.0, 5.0, 6.0)), "axes": EYES, "half_extents": ((1.0, 1.0, 0.0),) * 2},
        "center axes half_extents",
        "",
    ),
    "Boxes.from_poses": (
        gs.Boxes.from_poses,
        {"poses": (POSE, POSE), "half_extents": ((1.0, 1.0, 0.0),) * 2},
        "poses half_extents",
        "",
    ),
    "Boxes.from_poses.broadcast": (
        gs.Boxes.from_poses,
        {"poses": (POSE, POSE), "half_extents": (1.0, 2.0, 3.0)},
        "half_extents",
        "",
    ),
    "Polygons": (gs.Polygons, {"vertices": SQUARE, "offsets": (0, 4)}, "vertices", ""),
    "Polytopes": (gs.Polytopes, {"vertices": EYE, "offsets": (0, 3)}, "vertices", ""),
    "Sphere": (gs.Sphere, {"radius": 1.0}, "", "radius"),
    "Capsule": (gs.Capsule, {"radius": 1.0, "length": 2.0}, "", "radius length"),
    "Cylinder": (gs.Cylinder, {"radius": 1.0, "length": 2.0}, "", "radius length"),
    "Cone": (gs.Cone, {"radius": 1.0, "length": 2.0}, "", "radius length"),
    "Ellipsoid": (gs.Ellipsoid, {"radii": (1.0, 2.0, 3.0)}, "radii", ""),
    "Box": (gs.Box, {"half_extents": (1.0, 2.0, 3.0)}, "half_extents", ""),
    "HalfSpace": (gs.HalfSpace, {"normal": (0.0, 0.0, 1.0), "offset": 1.0}, "normal", "offset"),
    "Convex": (gs.Convex, {"vertices": EYE}, "vertices", ""),
    "Mesh": (gs.Mesh, {"vertices": EYE, "triangles": ((0, 1, 2),)}, "vertices", ""),
    "Triangle": (
        gs.Triangle,
        {"a": (0.0, 0.0, 0.0), "b": (1.0, 0.0, 0.0), "c": (0.0, 1.0, 0.0)},
        "a b c",
        "",
    ),
    "Segment": (gs.Segment, {"a": (0.0, 0.0, 0.0), "b": (1.0, 0.0, 0.0)}, "a b", ""),
    "Point": (gs.Point, {"p": (0.0, 0.0, 0.0)}, "p", ""),
    "Polygon": (gs.Polygon, {"vertices": SQUARE}, "vertices", ""),
    "distance_to_frustum": (
        lambda points: gs.distance_to_frustum(frustum(), points),
        {"points": ((0.0, 0.0, 0.0), (1.0, 2.0, 3.0))},
        "points",
        "",
    ),
    "distance_to_frustum.2d": (
        lambda points: gs.distance_to_frustum(frustum_2d(), points),
        {"points": SQUARE},
        "points",
        "",
    ),
    "first_contact": (
        lambda **given: gs.first_contact(polygons(), polygons(), **given),
        {"velocity_a": ((1.0, 0.0), (0.0, 1.0)), "velocity_b": (0.0, 0.0), "t_max": 5.0},
        "velocity_a velocity_b",
        "t_max",
    ),
    "distance": (
        lambda poses_ab: gs.distance(gs.Sphere(1.0), gs.Box((1.0, 1.0, 1.0)), poses_ab),
        {"poses_ab": (POSE, POSE)},
        "poses_ab",
        "",
    ),
    "distance.one": (
        lambda poses_ab: gs.distance(gs.Sphere(1.0), gs.Sphere(1.0), poses_ab),
        {"poses_ab": POSE},
        "poses_ab",
        "",
    ),
    "intersects": (
        lambda poses_ab: gs.intersects(gs.Sphere(1.0), gs.Sphere(1.0), poses_ab),
        {"poses_ab": (POSE, POSE)},
        "poses_ab",
        "",
    ),
}


def last_index(array: np.ndarray) -> str:
    """The text of the last index: "[1, 2]"."""
    return f"[{', '.join(str(size - 1) for size in array.shape)}]"


def spoilt(array: np.ndarray, value: Any) -> np.ndarray:
    """A copy with the last number replaced."""
    copy = array.copy()
    copy[(-1,) * array.ndim] = value
    return copy


ARRAY_FAULTS: dict[str, tuple[Callable[[np.ndarray], Any], Callable[[np.ndarray], str]]] = {
    "nan": (lambda a: spoilt(a, math.nan), lambda a: f"{last_index(a)} is nan, must be finite"),
    "inf": (lambda a: spoilt(a, math.inf), lambda a: f"{last_index(a)} is inf, must be finite"),
    "-inf": (lambda a: spoilt(a, -math.inf), lambda a: f"{last_index(a)} is -inf, must be finite"),
    "float32 inf": (lambda a: spoilt(a, math.inf).astype(np.float32), lambda a: "is inf, must be finite"),
    "complex": (lambda a: a + 0j, lambda a: " must hold real numbers, got dtype complex128"),
    "text": (lambda a: a.astype(str), lambda a: " must hold real numbers, got dtype <U"),
    "object": (lambda a: a.astype(object), lambda a: " must hold real numbers, got dtype object"),
    "bool": (lambda a: a.astype(bool), lambda a: " must hold real numbers, got dtype bool"),
    "longdouble": (
        lambda a: a.astype(np.longdouble),
        lambda a: " must be representable in float64, got dtype",
    ),
    "datetime": (lambda a: a.astype("M8[s]"), lambda a: " must hold real numbers, got dtype datetime64"),
    "masked": (lambda a: np.ma.masked_array(a), lambda a: " must not be a masked array"),
    "none": (lambda a: None, lambda a: "must hold real numbers, got dtype object"),
    "ragged": (lambda a: [[1.0, 2.0], [3.0]], lambda a: " is not an array: "),
    "one more column": (
        lambda a: np.concatenate([a, a[..., :1]], axis=-1),
        lambda a: " must have shape (",
    ),
    "one more axis": (lambda a: a[None, None], lambda a: " must have shape ("),
    "number": (lambda a: 1.0, lambda a: " must have shape ("),
}

NUMBER_FAULTS: dict[str, tuple[Any, str]] = {
    "nan": (math.nan, " is nan"),
    "text": ("1.0", " must hold real numbers, got dtype <U3"),
    "complex": (1j, " must hold real numbers, got dtype complex128"),
    "bool": (True, " must hold real numbers, got dtype bool"),
    "list": ([1.0], " must be a single number, got shape (1,)"),
    "array": (np.ones((2, 2)), " must be a single number, got shape (2, 2)"),
}


def rows(kind: str) -> list[Any]:
    """(entry, argument) of every array or number argument."""
    column = 2 if kind == "array" else 3
    return [
        pytest.param(name, argument, id=f"{name}-{argument}")
        for name, entry in ENTRIES.items()
        for argument in entry[column].split()
    ]


@pytest.mark.parametrize(("entry", "argument"), rows("array"))
def test_array_faults_are_named(entry: str, argument: str) -> None:
    call, valid, _, _ = ENTRIES[entry]
    array = np.array(valid[argument], dtype=float)
    for fault, (spoil, message) in ARRAY_FAULTS.items():
        if fault == "none" and argument in ("bounds", "poses_ab"):
            continue  # these may be left out
        with pytest.raises(GeometryError) as caught:
            call(**{**valid, argument: spoil(array)})
        assert str(caught.value).startswith(argument), f"{fault}: {caught.value}"
        assert message(array) in str(caught.value), f"{fault}: {caught.value}"


@pytest.mark.parametrize(("entry", "argument"), rows("number"))
def test_number_faults_are_named(entry: str, argument: str) -> None:
    call, valid, _, _ = ENTRIES[entry]
    for fault, (value, message) in NUMBER_FAULTS.items():
        with pytest.raises(GeometryError) as caught:
            call(**{**valid, argument: value})
        assert str(caught.value).startswith(argument + message), f"{fault}: {caught.value}"
    if argument != "t_max":
        for value in (math.inf, -math.inf):
            with pytest.raises(GeometryError, match=f"^{argument} is {value}, must be finite$"):
                call(**{**valid, argument: value})


# ------------------------------------------------------------------------------------ faults of meaning

CENTERS = np.zeros((3, 3))
BAD_ROWS = np.array([EYE, EYE * 1.02, EYE])
K = np.array([[500.0, 0.0, 320.0], [0.0, 500.0, 240.0], [0.0, 0.0, 1.0]])
SCALED_POSE = np.diag([2.0, 2.0, 2.0, 1.0])


def changed(entry: str, **changes: Any) -> Callable[[], Any]:
    call, valid, _, _ = ENTRIES[entry]
    return lambda: call(**{**valid, **changes})


def twice(ring: Any) -> Callable[[], Any]:
    """The bad ring as the second of two."""
    return lambda: gs.Polygons.from_list([SQUARE, ring])


FAULTS: dict[str, tuple[Callable[[], Any], str]] = {
    # Sizes
    "left = 0": (changed("Frustum", left=0.0), "left must be > 0, got 0.0"),
    "up < 0": (changed("Frustum", up=-1.0), "up must be > 0, got -1.0"),
    "near = 0": (changed("Frustum", near=0.0), "near must be > 0, got 0.0"),
    "near = far": (changed("Frustum", near=4.0), "far must be > near = 4.0, got 4.0"),
    "near > far": (changed("Frustum2D", near=5), "far must be > near = 5.0, got 4.0"),
    "left missing": (changed("Frustum", left=None), "left is missing: give left and up, or bounds"),
    "up missing": (changed("Frustum", up=None), "up is missing: give left and up, or bounds"),
    "near missing": (changed("Frustum", near=None), "near is missing"),
    "far missing": (changed("Frustum2D", far=None), "far is missing"),
    "left and bounds": (
        changed("Frustum", bounds=(-1, 1, -1, 1)),
        "bounds and left or up exclude each other",
    ),
    "bounds swapped": (
        changed("Frustum.bounds", bounds=(-1, 2, 3, 1)),
        "bounds[2] must be < bounds[3], got 3.0, 1.0",
    ),
    "bounds empty": (
        changed("Frustum2D.bounds", bounds=(2, 2)),
        "bounds[0] must be < bounds[1], got 2.0, 2.0",
    ),
    "fov 0": (changed("Frustum.look_at", fov_y=0.0), "fov_y must be > 0, got 0.0"),
    "fov pi": (changed("Frustum.look_at", fov_y=math.pi), "fov_y must be < pi, got 3.14"),
    "aspect < 0": (changed("Frustum.look_at", aspect=-1), "aspect must be > 0, got -1.0"),
    "eye at target": (changed("Frustum.look_at", target=(0, 0, 1)), "target must differ from eye"),
    "up zero": (changed("Frustum.look_at", up=(0, 0, 0)), "up must not be zero"),
    "up along view": (
        changed("Frustum.look_at", up=(10, 2, -2)),
        "up must not be parallel to the view direction",
    ),
    "width 0": (changed("Frustum.from_intrinsics", width=0), "width must be > 0, got 0.0"),
    "focal length": (
        changed("Frustum.from_intrinsics", K=-K),
        "K must have positive focal lengths, got fx=-500.0",
    ),
    "skew": (changed("Frustum.from_intrinsics", K=K + np.eye(3, k=1)), "K must be [[fx, 0, cx], [0, fy, cy]"),
    "K scaled": (changed("Frustum.from_intrinsics", K=2 * K), "K must be [[fx, 0, cx], [0, fy, cy]"),
    "X last row": (
        changed("Frustum.from_intrinsics", X_world_camera=np.ones((4, 4))),
        "X_world_camera must have last row",
    ),
    "X scaled": (
        changed("Frustum.from_intrinsics", X_world_camera=SCALED_POSE),
        "X_world_camera[:3, :3] must have orthonormal rows, off by 3 (at most 0.01)",
    ),
    "negative box": (
        lambda: gs.Boxes(CENTERS, np.tile(EYE, (3, 1, 1)), [[1, 1, 1], [1, 1, 1], [1, -2, 1]]),
        "half_extents[2] must be >= 0, got [1.0, -2.0, 1.0]",
    ),
    "negative box, posed": (
        changed("Boxes.from_poses", half_extents=(1, 1, -1)),
        "half_extents[0] must be >= 0, got",
    ),
    "negative Box": (lambda: gs.Box((1, 1, -1)), "half_extents must be >= 0, got [1.0, 1.0, -1.0]"),
    "flat ellipsoid": (lambda: gs.Ellipsoid((1, 0, 1)), "radii must be > 0, got [1.0, 0.0, 1.0]"),
    "negative radius": (lambda: gs.Sphere(-1), "radius must be >= 0, got -1.0"),
    "negative length": (lambda: gs.Capsule(1, -2), "length must be >= 0, got -2.0"),
    "negative radius, cone": (lambda: gs.Cone(-1, 2), "radius must be >= 0, got -1.0"),
    "normal zero": (lambda: gs.HalfSpace((0, 0, 0), 1), "normal must not be zero"),
    "half space at infinity": (
        lambda: gs.HalfSpace((1e-300, 0, 0), 1e300),
        "offset / |normal| must be finite, got 1e+300",
    ),
    "t_max < 0": (changed("first_contact", t_max=-0.5), "t_max must be >= 0, got -0.5"),
    "t_max -inf": (changed("first_contact", t_max=-math.inf), "t_max must be >= 0, got -inf"),
    # Frames
    "axes scaled": (
        changed("Frustum", axes=EYE * 2),
        "axes must have orthonormal rows, off by 3 (at most 0.01)",
    ),
    "axes huge": (changed("Frustum", axes=EYE * 1e200), "axes must have orthonormal rows, off by inf"),
    "axes cancel": (
        changed("Frustum", axes=[[1e200, 1e200, 0], [1e200, -1e200, 0], [0, 0, 1]]),
        "axes must have orthonormal rows",
    ),
    "axes skewed": (
        changed("Frustum2D", axes=[[1, 0], [0.02, 1]]),
        "axes must have orthonormal rows, off by 0.02",
    ),
    "second box skewed": (
        lambda: gs.Boxes(CENTERS, BAD_ROWS, np.ones((3, 3))),
        "axes[1] must have orthonormal rows, off by 0.0404",
    ),
    "quaternion zero": (
        changed("distance.one", poses_ab=(0,) * 7),
        "poses_ab quaternion x y z w must have norm 1, got 0",
    ),
    "quaternion scaled": (
        changed("distance", poses_ab=[POSE, (0, 0, 0, 0, 0, 0, 2)]),
        "poses_ab[1] quaternion x y z w must have norm 1, got 2",
    ),
    "quaternion huge": (
        changed("Boxes.from_poses", poses=[POSE, (0, 0, 0, 1e200, 0, 0, 0)]),
        "poses[1] quaternion x y z w must have norm 1, got ",
    ),
    "quaternion of camera": (
        changed("Frustum.from_intrinsics", X_world_camera=(0, 0, 0, 1, 1, 1, 1)),
        "X_world_camera quaternion x y z w must have norm 1, got 2",
    ),
    # Batches
    "axes short": (
        lambda: gs.Boxes(np.zeros((2, 3)), EYE[None], np.ones((2, 3))),
        "axes must have shape (2, 3, 3), got shape (1, 3, 3)",
    ),
    "half extents short": (
        lambda: gs.Boxes(np.zeros((2, 3)), EYES, np.ones((1, 3))),
        "half_extents must have shape (2, 3), got shape (1, 3)",
    ),
    "two against three": (
        lambda: gs.distance(boxes(2), boxes(3)),
        "a and b must have the same length, or one of them length 1; got 2 and 3",
    ),
    "two against three, moving": (
        lambda: gs.first_contact(polygons(2), polygons(3), (0, 0), (0, 0)),
        "a and b must have the same length, or one of them length 1; got 2 and 3",
    ),
    "three velocities": (
        changed("first_contact", velocity_b=np.zeros((3, 2))),
        "velocity_b must have shape (2,) or (2, 2), got (3, 2)",
    ),
    "offsets float": (
        changed("Polygons", offsets=(0.0, 4.0)),
        "offsets must hold integers, got dtype float64",
    ),
    "offsets bool": (
        changed("Polygons", offsets=[False, True]),
        "offsets must hold integers, got dtype bool",
    ),
    "offsets none": (changed("Polygons", offsets=None), "offsets must hold integers, got dtype object"),
    "offsets ragged": (changed("Polygons", offsets=[[0], 4]), "offsets is not an array: "),
    "offsets matrix": (changed("Polygons", offsets=[[0, 4]]), "offsets must have shape (n + 1,), got (1, 2)"),
    "offsets empty": (
        changed("Polygons", offsets=np.zeros(0, int)),
        "offsets must have shape (n + 1,), got (0,)",
    ),
    "offsets start": (changed("Polygons", offsets=(1, 4)), "offsets must run from 0 to 4, got 1 to 4"),
    "offsets end": (changed("Polytopes", offsets=(0, 2)), "offsets must run from 0 to 3, got 0 to 2"),
    "offsets fall": (
        changed("Polytopes", offsets=(0, 2, 1, 3)),
        "offsets: item 1 has -1 vertices, needs at least 1",
    ),
    "offsets repeat": (
        changed("Polytopes", offsets=(0, 2, 2, 3)),
        "offsets: item 1 has 0 vertices, needs at least 1",
    ),
    "offsets outside": (changed("Polytopes", offsets=(0, 5, 3)), "offsets[1] is 5, outside 0..3"),
    # All differences of these are positive in int64, because they wrap around.
    "offsets wrap": (
        changed("Polytopes", offsets=(0, 2**63 - 1, -2, 3)),
        "offsets[1] is 9223372036854775807, outside 0..3",
    ),
    "offsets unsigned": (
        changed("Polytopes", offsets=np.array([0, 2**64 - 1, 3], np.uint64)),
        "offsets[1] is 18446744073709551615, outside 0..3",
    ),
    "empty ring": (
        lambda: gs.Polygons.from_list([SQUARE, np.zeros((0, 2))]),
        "offsets: item 1 has 0 vertices",
    ),
    "not a list": (lambda: gs.Polygons.from_list(5), "items must be a list of vertex arrays, got int"),
    "ring of nan": (
        lambda: gs.Polygons.from_list([SQUARE, [(0, math.nan)]]),
        "items[1][0, 1] is nan, must be finite",
    ),
    "ring in space": (
        lambda: gs.Polygons.from_list([SQUARE, EYE]),
        "items[1] must have shape (n, 2), got shape (3, 3)",
    ),
    "hull in plane": (
        lambda: gs.Polytopes.from_list([SQUARE]),
        "items[0] must have shape (n, 3), got shape (4, 2)",
    ),
    "no vertices": (lambda: gs.Convex(np.zeros((0, 3))), "vertices must hold at least one point"),
    "no vertices, polygon": (lambda: gs.Polygon(np.zeros((0, 2))), "vertices must hold at least one point"),
    "no triangles": (
        lambda: gs.Mesh(EYE, np.zeros((0, 3), int)),
        "triangles must hold at least one triangle",
    ),
    "triangles float": (lambda: gs.Mesh(EYE, EYE), "triangles must be (k, 3) integers, got float64 (3, 3)"),
    "triangles flat": (lambda: gs.Mesh(EYE, [0, 1, 2]), "triangles must be (k, 3) integers, got int64 (3,)"),
    "triangles ragged": (lambda: gs.Mesh(EYE, [[0, 1, 2], [0]]), "triangles is not an array: "),
    "triangle high": (
        lambda: gs.Mesh(EYE, [[0, 1, 2], [0, 3, 1]]),
        "triangles[1] refers to a vertex outside 0..2: [0, 3, 1]",
    ),
    "triangle negative": (
        lambda: gs.Mesh(EYE, [[0, 1, -1]]),
        "triangles[0] refers to a vertex outside 0..2: [0, 1, -1]",
    ),
    # Rings
    "clockwise": (twice(SQUARE[::-1]), "vertices: ring 1 is clockwise"),
    "clockwise triangle": (twice([(0, 0), (0, 1), (1, 0)]), "vertices: ring 1 is clockwise"),
    "dart": (twice([(0, 0), (4, 0), (1, 1), (0, 4)]), "vertices: ring 1 is "),
    "bow tie": (twice([(0, 0), (1, 1), (1, 0), (0, 1)]), "vertices: ring 1 is "),
    "twice round": (twice([*SQUARE, *SQUARE]), "vertices: ring 1 is "),
    "pentagram": (
        twice([(math.cos(0.8 * math.pi * k), math.sin(0.8 * math.pi * k)) for k in range(5)]),
        "vertices: ring 1 is ",
    ),
    "spike": (twice([(0, 0), (1, 0), (2, 0), (1, 0), (1, 1)]), "vertices: ring 1 is "),
    "clockwise Polygon": (lambda: gs.Polygon(SQUARE[::-1]), "vertices: ring 0 is clockwise"),
    # Types
    "cull: no frustum": (lambda: gs.cull(boxes(), boxes()), "frustum must be Frustum, got Boxes"),
    "cull: in the plane": (lambda: gs.cull(frustum_2d(), boxes()), "frustum must be Frustum, got Frustum2D"),
    "cull: no boxes": (lambda: gs.cull(frustum(), polytopes()), "boxes must be Boxes, got Polytopes"),
    "points: no frustum": (
        lambda: gs.distance_to_frustum(None, CENTERS),
        "frustum must be Frustum or Frustum2D, got NoneType",
    ),
    "moving frustum": (
        lambda: gs.first_contact(frustum(), boxes(), (0, 0, 0), (0, 0, 0)),
        "a must be Polygons or Polytopes or Boxes, got Frustum",
    ),
    "plane against space": (
        lambda: gs.first_contact(polygons(), polytopes(), (0, 0), (0, 0)),
        "b must be Polygons, got Polytopes",
    ),
    "polygons against boxes": (lambda: gs.distance(polygons(), boxes()), "b must be Polygons, got Boxes"),
    "boxes against polygons": (
        lambda: gs.distance(boxes(), polygons()),
        "b must be Boxes or Polytopes or Frustum, got Polygons",
    ),
    "shape without pose": (
        lambda: gs.distance(gs.Sphere(1), gs.Sphere(1)),
        "a must be Boxes or Polygons or Polytopes or Frustum, got Sphere",
    ),
    "batch with pose": (lambda: gs.distance(boxes(), boxes(), POSE), "a must be Shape or Frustum, got Boxes"),
    "batch with pose, b": (
        lambda: gs.intersects(gs.Sphere(1), boxes(), POSE),
        "b must be Shape or Frustum, got Boxes",
    ),
    # Choices
    "tier unknown": (
        lambda: gs.cull(frustum(), boxes(), accuracy="high"),
        "accuracy must be one of bound, float32, float64, exact, got 'high'",
    ),
    "tier no text": (lambda: gs.distance(boxes(), boxes(), accuracy=64), "accuracy must be one of bound, "),
    "tier array": (
        lambda: gs.distance(boxes(), boxes(), accuracy=np.ones(2)),
        "accuracy must be one of bound, ",
    ),
    "want unknown": (
        lambda: gs.distance(boxes(), boxes(), want=("distance", "speed")),
        "want must name some of distance, witness, penetration, got 'speed'",
    ),
    "want unknown, frustum": (
        lambda: gs.distance_to_frustum(frustum(), CENTERS, want=("penetration",)),
        "want must name some of distance, witness, got 'penetration'",
    ),
    "want none": (lambda: gs.distance(boxes(), boxes(), want=None), "want must name some of "),
    "want number": (lambda: gs.distance(boxes(), boxes(), want=(1,)), "want must name some of "),
    "want array": (lambda: gs.distance(boxes(), boxes(), want=np.ones((2, 2))), "want must name some of "),
    "certificates text": (
        lambda: gs.cull(frustum(), boxes(), certificates="no"),
        "certificates must be True or False, got 'no'",
    ),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_fault_is_named(fault: str) -> None:
    call, message = FAULTS[fault]
    with pytest.raises(GeometryError, match=f"^{re.escape(message)}") as caught:
        call()
    assert not isinstance(caught.value, NotAvailableError)
    assert isinstance(caught.value, ValueError)


QUERIES: dict[str, Callable[..., Any]] = {
    "cull": lambda **given: gs.cull(frustum(), boxes(), **given),
    "distance_to_frustum": lambda **given: gs.distance_to_frustum(frustum(), CENTERS, **given),
    "distance_to_frustum.2d": lambda **given: gs.distance_to_frustum(frustum_2d(), SQUARE, **given),
    "first_contact": lambda **given: gs.first_contact(polygons(), polygons(), (0, 0), (0, 0), **given),
    "first_contact.3d": lambda **given: gs.first_contact(polytopes(), polytopes(), (0,) * 3, (0,) * 3, **given),
    "distance": lambda **given: gs.distance(gs.Sphere(1), gs.Sphere(1), POSE, **given),
    "distance.batches": lambda **given: gs.distance(boxes(), boxes(), **given),
    "intersects": lambda **given: gs.intersects(boxes(), boxes(), **given),
}


EVERY = ("bound", "float32", "exact")
TIERS_ANSWERED = {
    "cull": EVERY,
    "distance_to_frustum": EVERY,
    "distance_to_frustum.2d": EVERY,
    "first_contact": EVERY,
    "first_contact.3d": ("bound", "exact"),
    "distance": EVERY,
    "distance.batches": EVERY,
    "intersects": EVERY,
}  #: besides float64


@pytest.mark.parametrize("query", QUERIES)
def test_tiers_that_are_not_available_are_named(query: str) -> None:
    for tier in ("bound", "float32", "exact"):
        if tier in TIERS_ANSWERED.get(query, ()):
            assert QUERIES[query](accuracy=tier).cost.accuracy == tier
            continue
        with pytest.raises(NotAvailableError, match=f"^accuracy='{tier}' is not available yet") as caught:
            QUERIES[query](accuracy=tier)
        assert isinstance(caught.value, NotImplementedError) and isinstance(caught.value, GeometryError)
    assert QUERIES[query](accuracy="float64").cost.accuracy == "float64"


@pytest.mark.parametrize("query", QUERIES)
def test_certificates_need_a_tier_that_leaves_something_to_prove(query: str) -> None:
    for tier in ("bound", "float32"):
        with pytest.raises(GeometryError, match="^certificates need accuracy float64 or exact|is not available yet"):
            QUERIES[query](accuracy=tier, certificates=True)
    assert QUERIES[query](certificates=False).certificates is None
    answer = QUERIES[query](certificates=True)
    assert len(answer.certificates) == len(list(answer.certificates)) > 0
    gs.verify(answer)


# ------------------------------------------------------------------------------------------- good input


def numbers_of(value: Any) -> list[Any]:
    """Every number a shape or an answer holds, bit by bit (a nan equals itself); timings aside."""
    fields = getattr(value, "__dataclass_fields__", {})
    aside = ("cost", "_point_a", "_normal", "_closing_speed")
    kept = [getattr(value, name, None) for name in fields if name not in aside]
    found = ("vertices", "point_a", "normal", "closing_speed")
    kept += [getattr(value, name) for name in found if hasattr(value, name)]
    return [(item.shape, item.tobytes()) if isinstance(item, np.ndarray) else item for item in kept]


LAYOUTS: dict[str, Callable[[np.ndarray], Any]] = {
    "list": lambda a: a.tolist(),
    "tuple": lambda a: tuple(map(tuple, a.tolist())) if a.ndim == 2 else a.tolist(),
    "float32": lambda a: a.astype(np.float32),
    "float16": lambda a: a.astype(np.float16),
    "int64": lambda a: a.astype(np.int64),
    "int8": lambda a: a.astype(np.int8),
    "big endian": lambda a: a.astype(">f8"),
    "fortran": np.asfortranarray,
    "strided": lambda a: np.repeat(a, 2, axis=-1)[..., ::2],
    "backwards": lambda a: a[::-1].copy()[::-1],
    "transposed": lambda a: np.ascontiguousarray(a.T).T,
    "unaligned": lambda a: np.frombuffer(b"\0" + a.tobytes(), np.uint8)[1:].view(np.float64).reshape(a.shape),
}


@pytest.mark.parametrize(("entry", "argument"), rows("array"))
def test_every_layout_of_an_array_is_accepted(entry: str, argument: str) -> None:
    call, valid, _, _ = ENTRIES[entry]
    array = np.array(valid[argument], dtype=float)
    assert (array == array.astype(np.int8)).all() or argument == "K"  # so that no layout rounds
    expected = numbers_of(call(**{**valid, argument: array}))
    for layout, arrange in LAYOUTS.items():
        if argument == "K" and layout == "int8":
            continue
        assert numbers_of(call(**{**valid, argument: arrange(array)})) == expected, layout


@pytest.mark.parametrize(("entry", "argument"), rows("array"))
def test_input_is_neither_modified_nor_kept(entry: str, argument: str) -> None:
    call, valid, _, _ = ENTRIES[entry]
    for writeable in (True, False):
        array = np.array(valid[argument], dtype=float)
        array.setflags(write=writeable)
        before, made = array.tobytes(), call(**{**valid, argument: array})
        seen = numbers_of(made)
        assert array.tobytes() == before and array.flags.writeable == writeable
        if argument == "points":  # documented: not copied, because that would cost a quarter of the query
            assert made.point_b is array
            continue
        array.setflags(write=True)
        array[...] = 77.0
        assert numbers_of(made) == seen
        for name in getattr(made, "__dataclass_fields__", {}):
            field = getattr(made, name, None)
            if isinstance(field, np.ndarray) and not isinstance(made, (gs.Distances, gs.FirstContacts, gs.Booleans)):
                assert not field.flags.writeable and field.flags.c_contiguous
                with pytest.raises(ValueError, match="read-only"):
                    field[...] = 0


@pytest.mark.parametrize(("entry", "argument"), rows("number"))
def test_every_kind_of_number_is_accepted(entry: str, argument: str) -> None:
    call, valid, _, _ = ENTRIES[entry]
    number = valid[argument]
    expected = numbers_of(call(**valid))
    for value in (int(number), np.float64(number), np.float32(number), np.int32(number), np.array(number)):
        assert numbers_of(call(**{**valid, argument: value})) == expected


def test_shapes_cannot_be_reassigned() -> None:
    for shape, name in (
        (gs.Sphere(1), "radius"),
        (boxes(), "center"),
        (frustum(), "near"),
        (polygons(), "offsets"),
    ):
        with pytest.raises(AttributeError):
            setattr(shape, name, 5)


def test_axes_of_either_hand_and_a_little_off_are_taken_literally() -> None:
    tilted = EYE + 1e-3 * np.array([[0, 1, -1], [0, 0, 1], [1, 0, 0]])
    for axes in (EYE, EYE[::-1], -EYE, tilted, EYE * (1 + 4e-3)):
        assert (gs.Frustum(**{**CAMERA, "axes": axes}).axes == axes).all()
        assert (gs.Boxes(np.zeros((1, 3)), axes[None], np.ones((1, 3))).axes == axes).all()


def test_quaternions_are_normalised_once() -> None:
    drifted = np.array([[0, 0, 0, 0.6, 0, 0, 0.8005]])
    boxes = gs.Boxes.from_poses(drifted, (1, 1, 1))
    assert np.abs(boxes.axes @ np.swapaxes(boxes.axes, 1, 2) - EYE).max() < 1e-15


def test_half_space_is_normalised_at_every_scale() -> None:
    for scale in (5e-324, 1e-310, 1e-160, 1.0, 1e160, 1e308):
        half_space = gs.HalfSpace((scale, -scale, 0.0), 0.0)
        assert np.allclose(half_space.normal, [0.5**0.5, -(0.5**0.5), 0.0], rtol=1e-15)
        assert half_space.offset == 0.0
    assert gs.HalfSpace((0, 0, 4e-300), 8e-300).offset == 2.0
    assert gs.HalfSpace((0, 0, 4e300), 8e300).offset == 2.0


def test_look_at_over_the_whole_range() -> None:
    view = gs.Frustum.look_at((0, 0, -1.5e308), (0, 0, 1.5e308), (0, 1, 0), 1.0, 1.0, 1.0, 2.0)
    assert view.axes[2].tolist() == [0.0, 0.0, 1.0]


@pytest.mark.parametrize(
    "ring",
    [
        [(3, 3)],
        [(3, 3), (3, 3)],
        [(0, 0), (1, 2)],
        [(0, 0), (1, 2), (0, 0)],
        [(0, 0), (1, 2), (2, 4), (1, 2)],
        [(0, 0), (0, 0), (1, 0), (1, 0), (2, 0), (2, 1), (2, 2), (2, 2), (0, 2), (0, 1)],
        [*SQUARE, SQUARE[0]],
        [(1e300, 1e300), (2e300, 1e300), (1e300, 2e300)],
        [(0, 0), (5e-324, 0), (0, 5e-324)],
        [(0, 0), (1, 1), (2, math.nextafter(2, 3))],
        [(2, math.nextafter(2, 3)), (1, 1), (0, 0)],  # turns right, by less than the rounding of a rotation
        [(1e16, 0), (1e16 + 2, 0), (1e16 + 2, 1)],
        [(math.cos(0.1 * k), math.sin(0.1 * k)) for k in range(62)],
    ],
)
def test_degenerate_rings_are_valid(ring: Any) -> None:
    batch = gs.Polygons.from_list([SQUARE, ring, SQUARE])
    assert len(batch) == 3 and (batch[1] == np.array(ring)).all()
    assert gs.Polygon(ring).vertices.shape == (len(ring), 2)


def test_ragged_batches_index_like_lists() -> None:
    batch = gs.Polytopes.from_list([EYE, EYE[:1], np.zeros((2, 3))])
    assert [len(item) for item in batch] == [3, 1, 2]
    assert (batch[-2] == EYE[:1]).all()
    for index in (3, -4):
        with pytest.raises(IndexError, match=f"item {index} of 3"):
            batch[index]
    assert gs.Polygons(SQUARE, np.array([0, 1, 4], np.uint8)).offsets.tolist() == [0, 1, 4]


# ----------------------------------------------------------------------------------------- nothing at all

NONE: dict[str, Callable[[], Any]] = {
    "cull": lambda: gs.cull(frustum(), boxes(0)),
    "points": lambda: gs.distance_to_frustum(frustum(), np.zeros((0, 3)), want=("distance", "witness")),
    "points 2d": lambda: gs.distance_to_frustum(frustum_2d(), np.zeros((0, 2))),
    "shapes": lambda: gs.distance(gs.Sphere(1), gs.Box((1, 1, 1)), np.zeros((0, 7))),
    "unsupported shapes": lambda: gs.distance(gs.Cone(1, 1), gs.Mesh(EYE, [[0, 1, 2]]), np.zeros((0, 7))),
    "intersects": lambda: gs.intersects(gs.Sphere(1), gs.Box((1, 1, 1)), np.zeros((0, 7))),
    "moving": lambda: gs.first_contact(polygons(0), polygons(0), (1, 0), (0, 0)),
    "moving rows": lambda: gs.first_contact(polygons(0), polygons(0), np.zeros((0, 2)), np.zeros((0, 2))),
    "moving, one against none": lambda: gs.first_contact(polygons(1), polygons(0), (1, 0), (0, 0)),
    "moving, none against one": lambda: gs.first_contact(polygons(0), polygons(1), (1, 0), (0, 0), t_max=math.inf),
    "moving polytopes": lambda: gs.first_contact(polytopes(0), polytopes(1), (1, 0, 0), (0, 0, 0)),
    **{
        f"{make_a.__name__} {n} against {make_b.__name__} {m}": lambda a=make_a, b=make_b, n=n, m=m: gs.distance(
            a(n) if a is not frustum else a(),
            b(m) if b is not frustum else b(),
            want=("distance", "penetration"),
        )
        for make_a in (boxes, polytopes, frustum, polygons)
        for make_b in (boxes, polytopes, frustum, polygons)
        for n, m in ((0, 0), (0, 1), (1, 0))
        if (make_a is polygons) == (make_b is polygons)
        and not (make_a is frustum and n == 0)
        and not (make_b is frustum and m == 0)
    },
}


@pytest.mark.parametrize("query", NONE)
def test_nothing_gives_nothing(query: str) -> None:
    answer = NONE[query]()
    for name, field in vars(answer).items():
        if isinstance(field, np.ndarray) and name != "point_offsets":
            assert len(field) == 0, name
    if isinstance(answer, gs.FirstContacts):
        assert answer.point_offsets.tolist() == [0]
    if isinstance(answer, gs.Distances):
        assert answer.point_a.shape == answer.point_b.shape == answer.normal.shape
        assert len(answer.point_a) == 0
