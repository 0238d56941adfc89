# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""Hard cases from files: inputs on which geometry engines go wrong, with answers from exact arithmetic.

Two kinds of lines are read (JSON, one object each): queries in world coordinates whose numbers are ``float.hex``
strings and whose answers are exact fractions, and shapes in poses, collected from the trackers of other engines, with
verified decimal values.  A line without an answer is valid: then the exact tier is the judge.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from geomsrv.answers import ContactStatus, CullState
from geomsrv.errors import GeometryError
from geomsrv.shapes import (
    Box,
    Boxes,
    Capsule,
    Cone,
    Convex,
    Cylinder,
    Ellipsoid,
    Frustum,
    HalfSpace,
    Point,
    Polygons,
    Polytopes,
    Segment,
    Shape,
    Sphere,
    Triangle,
)

__all__ = ["KINDS", "MOVING", "Case", "Motion", "Truth", "decides", "quaternion_of", "read", "shipped", "signed_square"]

FloatArray = NDArray[np.float64]

#: Kinds of query that are read; lines of any other kind are skipped.
KINDS = (
    "frustum_box",
    "frustum_box_distance",
    "point_frustum",
    "box_box_distance",
    "polytope_distance",
    "polygon2d_distance",
    "polygon2d_moving",
    "polyhedra_moving",
    "polygon2d_turning",
    "polyhedra_turning",
    "signed_distance",
    "distance",
    "segment_segment",
    "collide",
    "frustum_cull",
    "toi",
    "toi_rotating",
)

#: Kinds that ask when bodies first touch.
MOVING = ("polygon2d_moving", "polyhedra_moving", "polygon2d_turning", "polyhedra_turning", "toi", "toi_rotating")

# From this share of the scene on, doubles that first subtract a common origin can tell apart from touching: 53 bits,
# less 13 for the operations of a query and their conditioning.
DECIDABLE = Fraction(1, 2**40)

# A field case gives its poses by 17 digits of rotation matrices: as a quaternion, or as the corners of a hull in world
# coordinates, points move by some ulps of their coordinates, eight at the most.
POSE_ROUNDING = 2.0**-50

# The verified values of field cases hold to this share of the scene.
VERIFIED = 1e-13


def signed_square(x: float | Fraction) -> Fraction:
    """X |x|, exactly: orders signed distances without a root."""
    x = Fraction(x)
    return x * abs(x)


@dataclass(frozen=True)
class Motion:
    """The exact answer of a first-contact query; times are None where they do not exist.

    Attributes
    ----------
    status : ContactStatus
    time, last_time : Fraction or None
    contact : tuple of tuple of Fraction
        Corners of the contact set.
    time_scale : Fraction
        By how much a rounding error of the size of the whole scene would move `time`.
    time_upper : Fraction or None
        Of bodies that turn, whose times are no rational numbers: apart until `time`, in contact at `time_upper`; of
        GRAZING ones it is open whether they meet later.
    """

    status: ContactStatus
    time: Fraction | None = None
    last_time: Fraction | None = None
    contact: tuple[tuple[Fraction, ...], ...] = ()
    time_scale: Fraction = Fraction(0)
    time_upper: Fraction | None = None


@dataclass(frozen=True)
class Truth:
    """What is right.

    Attributes
    ----------
    low, high : Fraction
        Bounds of the signed square of the separation; equal where it is known exactly.
    scale : Fraction
        Extent of the scene.
    decidable : bool
        Whether doubles must get yes or no right: the margin is at least `DECIDABLE` of the scale.
    state : CullState or None
        Of a culling query; None if only contact is known.
    motion : Motion or None
        Of a moving query.
    """

    low: Fraction
    high: Fraction
    scale: Fraction
    decidable: bool
    state: CullState | None = None
    motion: Motion | None = None

    @property
    def meets(self) -> bool | None:
        """Whether the bodies have a common point; None if the bounds do not tell."""
        return False if self.low > 0 else True if self.high <= 0 else None


def decides(squared_margin: Fraction, scale: Fraction) -> bool:
    """Whether a margin, given as its (signed) square, is one that doubles can see."""
    return abs(squared_margin) >= (DECIDABLE * scale) ** 2


@dataclass(frozen=True)
class Case:
    """One query.

    Attributes
    ----------
    name, kind, group : str
        What the file calls it, one of `KINDS`, and what is hard about it.
    given : dict
        The input, numbers as floats.
    truth : Truth or None
        None if the file does not tell.
    """

    name: str
    kind: str
    group: str
    given: dict[str, Any]
    truth: Truth | None = None

    @cached_property
    def bodies(self) -> tuple[Any, ...]:
        """Arguments of `distance`: two batches of one in world coordinates, or two shapes and a pose.

        Of a moving field case two shapes, their poses (2, 7) and their twists (2, 6).

        Raises
        ------
        GeometryError
            The case has a shape that cannot be made.
        """
        given = self.given
        match self.kind:
            case "frustum_box" | "frustum_box_distance":
                return frustum_of(given["frustum"]), _boxes(given["box"])
            case "point_frustum":
                return frustum_of(given["frustum"]), Polytopes.from_list([[given["point"]]])
            case "box_box_distance":
                return _boxes(given["box0"]), _boxes(given["box1"])
            case "polytope_distance":
                return Polytopes.from_list([given["P"]]), Polytopes.from_list([given["Q"]])
            case "polyhedra_moving" | "polyhedra_turning":
                return tuple(Polytopes.from_list([given[side]["vertices"]]) for side in "PQ")
            case "polygon2d_turning":
                return tuple(Polygons.from_list([given[side]["vertices"]]) for side in "PQ")
            case "polygon2d_distance" | "polygon2d_moving":
                return Polygons.from_list([given["P"]]), Polygons.from_list([given["Q"]])
        first, second = given["shapes"]
        if self.kind in MOVING:
            return shape_of(first), shape_of(second), *_motion_of(given)
        if self.kind == "frustum_cull" and second["type"] == "box":
            if (view := _viewed(given["frustum"], first["vertices"])) is not None:
                return view, _placed_box(second)
        return shape_of(first), shape_of(second), relative_pose(first, second)


# ---------------------------------------------------------------------------------------------------- the engine's


def frustum_of(given: dict[str, Any]) -> Frustum:
    """A frustum by E, L, U, D, n, f and l, u or ``bounds``."""
    bounds = given.get("bounds") or (-given["l"], given["l"], -given["u"], given["u"])
    return Frustum(given["E"], [given["L"], given["U"], given["D"]], bounds=bounds, near=given["n"], far=given["f"])


def _boxes(given: dict[str, Any]) -> Boxes:
    return Boxes([given["C"]], [given["A"]], [given["e"]])


def _viewed(given: dict[str, Any], hull: list[list[float]]) -> Frustum | None:
    """The camera whose view is the hull, if the case says enough; by default it looks along x, z up."""
    if "aspect" not in given:
        return None
    eye, aspect, far = np.array(given["pos"], dtype=float), given["aspect"], given["far"]
    forward, up = (np.array(given.get(k, along), dtype=float) for k, along in (("fwd", [1, 0, 0]), ("up", [0, 0, 1])))
    fov_y = given["vfov"] if "vfov" in given else 2.0 * math.atan(math.tan(given["hfov"] / 2.0) / aspect)
    view = Frustum.look_at(eye, eye + forward, up, fov_y, aspect, given["near"], far)
    miss = np.abs(view.corners()[:, None] - np.array(hull)[None]).max(axis=2).min(axis=1).max()
    return view if miss <= VERIFIED * far else None


def shape_of(given: dict[str, Any]) -> Shape:
    """A shape as field cases describe it, without its pose.

    Raises
    ------
    GeometryError
        There is no such shape.
    """
    if given.get("rounding"):
        raise GeometryError(f"{given['type']} with rounded edges")
    match given["type"]:
        case "sphere":
            return Sphere(given["radius"])
        case "capsule":
            return Capsule(given["radius"], given["length"])
        case "cylinder":
            return Cylinder(given["radius"], given["length"])
        case "cone":
            return Cone(given["radius"], given["length"])
        case "ellipsoid":
            return Ellipsoid(given["radii"])
        case "box":
            return Box(np.array(given["size"], dtype=float) / 2)
        case "halfspace":
            return HalfSpace(given["normal"], given["offset"])
        case "point":
            return Point(given["point"])
        case "segment":
            return Segment(*given["vertices"])
        case "triangle":
            return Triangle(*given["vertices"])
        case "convex":
            return Convex(given["vertices"])
    raise GeometryError(f"there is no shape {given['type']!r}")


def pose_of(given: dict[str, Any]) -> tuple[FloatArray, FloatArray]:
    """Rotation matrix and position."""
    pose = given.get("pose", {"R": np.eye(3), "t": np.zeros(3)})
    return np.array(pose["R"], dtype=float), np.array(pose["t"], dtype=float)


def relative_pose(first: dict[str, Any], second: dict[str, Any]) -> FloatArray:
    """Pose (7,) of the second in the first."""
    (rotation_a, position_a), (rotation_b, position_b) = pose_of(first), pose_of(second)
    step = rotation_a.T @ (position_b - position_a)
    return np.concatenate([step, quaternion_of(rotation_a.T @ rotation_b)])


def quaternion_of(rotation: FloatArray) -> FloatArray:
    """X y z w, by the largest of the four: no cancellation (Shepperd 1978)."""
    m = rotation
    trace = m[0, 0] + m[1, 1] + m[2, 2]
    squares = np.array([2 * m[0, 0] - trace, 2 * m[1, 1] - trace, 2 * m[2, 2] - trace, trace]) + 1
    rows = (
        np.array([squares[0], m[1, 0] + m[0, 1], m[2, 0] + m[0, 2], m[2, 1] - m[1, 2]]),
        np.array([m[1, 0] + m[0, 1], squares[1], m[2, 1] + m[1, 2], m[0, 2] - m[2, 0]]),
        np.array([m[2, 0] + m[0, 2], m[2, 1] + m[1, 2], squares[2], m[1, 0] - m[0, 1]]),
        np.array([m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1], squares[3]]),
    )
    best = rows[int(np.argmax(squares))]
    unit: FloatArray = best / np.linalg.norm(best)
    return unit


def _placed_box(given: dict[str, Any]) -> Boxes:
    rotation, position = pose_of(given)
    return Boxes(position[None], rotation.T[None], np.array([given["size"]]) / 2.0)


def _motion_of(given: dict[str, Any]) -> tuple[FloatArray, FloatArray]:
    """Poses (2, 7) and twists (2, 6) of a moving case; a sweep goes from p0 to p1, turning from a0 to a1 about z."""
    poses, twists = np.zeros((2, 7)), np.zeros((2, 6))
    motion = given["motion"]
    for k, shape in enumerate(given["shapes"]):
        rotation, poses[k, :3] = pose_of(shape)
        if "v" in motion:
            twists[k, :3] = motion["v"][k]
        else:
            sweep = motion["sweeps"][k]
            start, end, angle = np.array(sweep["p0"], dtype=float), np.array(sweep["p1"], dtype=float), sweep["a0"]
            cosine, sine = math.cos(angle), math.sin(angle)
            rotation = np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]]) @ rotation
            poses[k, :3] += start
            twists[k, :3], twists[k, 5] = end - start, sweep["a1"] - angle
        poses[k, 3:] = quaternion_of(rotation)
    return poses, twists


# ------------------------------------------------------------------------------------------------------ from files


def shipped() -> list[Path]:
    """The files installed beside the package, ``share/geomsrv/cases``; empty where they are not."""
    for prefix in Path(__file__).resolve().parents:
        found = sorted((prefix / "share" / "geomsrv" / "cases").glob("*.jsonl"))
        if found:
            return found
    return []


def read(path: Path) -> Iterator[Case]:
    """The cases of a file of JSON lines.

    Raises
    ------
    GeometryError
        A line cannot be read; names it.
    """
    for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1):
        if not line.strip():
            continue
        try:
            record = json.loads(line)
            if record["kind"] in KINDS and record.get("complete_inputs", True):
                yield _posed(record) if "shapes" in record else _case(record)
        except (ArithmeticError, AttributeError, KeyError, TypeError, ValueError) as error:
            raise GeometryError(f"{path}, line {number}: {type(error).__name__}: {error}") from error


def _case(record: dict[str, Any]) -> Case:
    truth = _truth(record) if "answer" in record else None
    name = record.get("id", record["kind"])
    return Case(name, record["kind"], record.get("class", ""), _floats(record["input"]), truth)


def _floats(value: Any) -> Any:
    """`float.hex` strings, nested, as floats."""
    if isinstance(value, str):
        return float.fromhex(value)
    if isinstance(value, dict):
        return {key: _floats(item) for key, item in value.items()}
    return [_floats(item) for item in value] if isinstance(value, list) else value


def _truth(record: dict[str, Any]) -> Truth:
    answer, margin = record["answer"], record["margin"]
    square, scale = Fraction(answer["sep_sq"]), Fraction(float.fromhex(margin["scale_local"]))
    state = CullState[answer["state"]] if "state" in answer else None
    motion = _motion(answer, scale) if "hits" in answer else None
    return Truth(square, square, scale, margin["decidable"] != "exact_only", state, motion)


_AT_START = {
    "disjoint": ContactStatus.WILL_TOUCH,
    "touching": ContactStatus.TOUCHING,
    "overlapping": ContactStatus.OVERLAPPING,
}


def _motion(answer: dict[str, Any], scale: Fraction) -> Motion:
    if not answer["hits"]:
        return Motion(ContactStatus.NEVER)
    time, last, speed = (
        None if answer[name] is None else Fraction(answer[name]) for name in ("time", "last_time", "normal_speed_sq")
    )
    return Motion(
        status=_AT_START[answer["separation"]],
        time=time,
        last_time=last,
        contact=tuple(tuple(map(Fraction, point)) for point in answer["contact"]),
        time_scale=time_scale(scale, speed),
    )


def time_scale(scale: Fraction, squared_speed: Fraction | None) -> Fraction:
    """How far a time moves where a body moves by `scale`, at a closing speed given by its square."""
    if not squared_speed:
        return Fraction(0)
    # A root to a few bits: it only scales a tolerance.
    bits = squared_speed.numerator.bit_length() - squared_speed.denominator.bit_length()
    return scale / Fraction(2) ** (bits // 2 - 1)


def _posed(record: dict[str, Any]) -> Case:
    """A field case: shapes in poses, and a value that was verified in decimal."""
    given = {"shapes": record["shapes"], "frustum": record.get("frustum"), "motion": record.get("motion")}
    case = Case(record["id"], record["kind"], record["failure_class"], given)
    value = record["verified_value"]
    if case.kind in MOVING:
        return replace(case, truth=_timed(record))
    if value is None:
        return case
    scale = Fraction(scene_size(record["shapes"]))
    defects = [np.abs(r.T @ r - np.eye(3)).max() for r, _ in map(pose_of, record["shapes"])]
    slack = (Fraction(VERIFIED + 2 * max(defects)) * scale) + Fraction(POSE_ROUNDING) * scale
    value = Fraction(value)
    truth = Truth(signed_square(value - slack), signed_square(value + slack), scale, abs(value) > slack)
    return Case(case.name, case.kind, case.group, given, truth)


# Times of moving field cases are verified to this, relative to themselves or in seconds.
TIME_VERIFIED = Fraction(1, 10**9)


def _timed(record: dict[str, Any]) -> Truth:
    """Of a field case with a time of impact, or none."""
    time, scale = record["verified_value"], Fraction(scene_size(record["shapes"]))
    if time is None:
        motion = Motion(ContactStatus.NEVER)
    else:
        status = ContactStatus.WILL_TOUCH if time > 0.0 else ContactStatus.OVERLAPPING
        motion = Motion(status, Fraction(time), time_scale=max(Fraction(1), Fraction(time)))
    return Truth(Fraction(0), Fraction(0), scale, True, motion=motion)


def scene_size(shapes: Iterable[dict[str, Any]]) -> float:
    """Largest number of a scene relative to another shape's place: what the rounding of a pose scales with."""
    listed = list(shapes)
    places = [pose_of(shape)[1] for shape in listed]
    sizes = [1e-3]
    for shape in listed:
        sizes += [float(np.abs(np.ravel(v)).max()) for k, v in shape.items() if k in _LENGTHS]
        rotation, position = pose_of(shape)
        for other in places:
            sizes.append(float(np.abs(position - other).max()))
            if "vertices" in shape:
                sizes.append(float(np.abs(np.array(shape["vertices"]) @ rotation.T + position - other).max()))
    return max(sizes)


_LENGTHS = ("radius", "radii", "length", "size", "offset", "point")
