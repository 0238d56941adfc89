# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""Messages without ROS: plain classes made from the .msg and .srv files, with the types that rclpy gives the fields."""

from __future__ import annotations

import array
import re
from functools import cache
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np

ROOT = Path(__file__).resolve().parents[1]

# The messages of other packages that ours contain, and those that the node receives.
FOREIGN = {
    "builtin_interfaces/Time": "int32 sec\nuint32 nanosec",
    "std_msgs/Header": "builtin_interfaces/Time stamp\nstring frame_id",
    "geometry_msgs/Point": "float64 x\nfloat64 y\nfloat64 z",
    "geometry_msgs/Point32": "float32 x\nfloat32 y\nfloat32 z",
    "geometry_msgs/Vector3": "float64 x\nfloat64 y\nfloat64 z",
    "geometry_msgs/Quaternion": "float64 x 0\nfloat64 y 0\nfloat64 z 0\nfloat64 w 1",
    "geometry_msgs/Pose": "geometry_msgs/Point position\ngeometry_msgs/Quaternion orientation",
    "geometry_msgs/Twist": "geometry_msgs/Vector3 linear\ngeometry_msgs/Vector3 angular",
    "geometry_msgs/Polygon": "geometry_msgs/Point32[] points",
    "geometry_msgs/PolygonInstance": "geometry_msgs/Polygon polygon\nint64 id",
    "geometry_msgs/PolygonInstanceStamped": "std_msgs/Header header\ngeometry_msgs/PolygonInstance polygon",
    "sensor_msgs/RegionOfInterest": "uint32 x_offset\nuint32 y_offset\nuint32 height\nuint32 width\nbool do_rectify",
    "sensor_msgs/CameraInfo": "std_msgs/Header header\nuint32 height\nuint32 width\nfloat64[] d\nfloat64[9] k\n"
    "float64[9] r\nfloat64[12] p\nsensor_msgs/RegionOfInterest roi",
    "std_msgs/ColorRGBA": "float32 r\nfloat32 g\nfloat32 b\nfloat32 a",
    "visualization_msgs/Marker": "std_msgs/Header header\nstring ns\nint32 id\nint32 type\nint32 action\n"
    "geometry_msgs/Pose pose\ngeometry_msgs/Vector3 scale\nstd_msgs/ColorRGBA color\ngeometry_msgs/Point[] points",
    "std_srvs/Trigger_Request": "",
    "std_srvs/Trigger_Response": "bool success\nstring message",
}
CODES = {"uint8": "B", "uint32": "I", "uint64": "Q", "float64": "d"}
LINE = re.compile(r"([\w/]+)(\[\d*\])?\s+(\w+)\s*(=)?\s*(.*)")


@cache
def message(name: str) -> type:
    """Class of "geomsrv/Shape", "geomsrv/Cull_Request", "geometry_msgs/Pose", ..."""
    text = FOREIGN.get(name)
    if text is None:
        stem, _, half = name.removeprefix("geomsrv/").partition("_")
        folder = "srv" if half else "msg"
        parts = (ROOT / folder / f"{stem}.{folder}").read_text().split("\n---\n")
        text = parts[half == "Response"]
    constants, fields = {}, []
    for line in text.splitlines():
        match = LINE.match(line.partition("#")[0].strip())
        if not match:
            continue
        kind, dimensions, field, equals, value = match.groups()
        if equals:
            constants[field] = int(value)
        else:
            fields.append((field, kind, dimensions, value))

    def create(self: Any, **given: Any) -> None:
        for field, kind, dimensions, value in fields:
            setattr(self, field, given.pop(field) if field in given else default(kind, dimensions, value))
        assert not given, f"{name} has no {sorted(given)}"

    return type(name.replace("/", "."), (SimpleNamespace,), {"__init__": create, **constants})


def default(kind: str, dimensions: str | None, value: str) -> Any:
    """What rclpy puts into a field at first."""
    if "/" in kind and not dimensions:
        return message(kind)()
    if dimensions == "[]":
        return array.array(CODES[kind]) if kind in CODES else []
    if dimensions:
        return np.zeros(int(dimensions[1:-1]), dtype=kind)
    if kind in ("string", "bool"):
        return kind == "string" and value.strip('"')
    if kind.startswith("float"):
        return float(value or 0.0)
    return int(value or 0)


def request(service: str, **fields: Any) -> Any:
    """Request of one of our services."""
    return message(f"geomsrv/{service}_Request")(**fields)


def response(service: str) -> Any:
    """Empty response of one of our services."""
    return message(f"geomsrv/{service}_Response")()


SERVICES = sorted(path.stem for path in (ROOT / "srv").glob("*.srv"))
MESSAGES = sorted(path.stem for path in (ROOT / "msg").glob("*.msg"))
