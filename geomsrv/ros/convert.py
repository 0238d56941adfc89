# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""Messages to values and back.  No ROS: anything with the fields of a message will do, and types are handed in.

Primitive arrays travel as `array.array`, which rclpy moves with one copy; the fields of a message are read through the
buffer protocol and never item by item.
"""

from __future__ import annotations

import array
import math
from collections.abc import Callable, Iterable
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from geomsrv import _validate
from geomsrv.answers import Cost, DistanceStatus
from geomsrv.engine import SceneContacts
from geomsrv.errors import GeometryError, SceneError
from geomsrv.scene import PairDistances, SceneCull, SceneObject, SceneUpdate, Visibility
from geomsrv.shapes import (
    Box,
    Capsule,
    Cone,
    Convex,
    Cylinder,
    Ellipsoid,
    Frustum,
    HalfSpace,
    Mesh,
    Point,
    Polygon,
    Segment,
    Shape,
    Sphere,
    Triangle,
)

FloatArray = NDArray[np.float64]
AnyShape = Shape | Frustum


# ---------------------------------------------------------------------------------------------------------- arrays


def floats(values: Any) -> FloatArray:
    """Field ``float64[]`` as a (n,) view, without a copy."""
    return np.asarray(values, dtype=np.float64)


def doubles(values: ArrayLike) -> array.array[float]:
    """Numbers as a field ``float64[]``."""
    return _field("d", values, np.float64)


def bytes_(values: ArrayLike) -> array.array[int]:
    """Numbers as a field ``uint8[]``."""
    return _field("B", values, np.uint8)


def uint32s(values: ArrayLike) -> array.array[int]:
    """Numbers as a field ``uint32[]``."""
    return _field("I", values, np.uint32)


def uint64s(values: ArrayLike) -> array.array[int]:
    """Numbers as a field ``uint64[]``."""
    return _field("Q", values, np.uint64)


FEW = 16  # numbers are copied faster one by one


def _field(code: str, values: ArrayLike, dtype: Any) -> array.array[Any]:
    if isinstance(values, np.ndarray) and values.size <= FEW:
        return array.array(code, values.ravel().tolist())
    field = array.array(code)
    field.frombytes(np.ascontiguousarray(values, dtype=dtype).reshape(-1).view(np.uint8))
    return field


def rows(values: Any, name: str, width: int) -> FloatArray:
    """Field ``float64[]`` as (n, width)."""
    flat = floats(values)
    if len(flat) % width:
        raise GeometryError(f"{name} must hold {width} numbers per item, got {len(flat)} numbers")
    return flat.reshape(-1, width)


# ----------------------------------------------------------------------------------------------------------- poses


def pose_row(pose: Any) -> tuple[float, ...]:
    """geometry_msgs/Pose -> x y z qx qy qz qw."""
    p, q = pose.position, pose.orientation
    return p.x, p.y, p.z, q.x, q.y, q.z, q.w


def twist_row(twist: Any) -> tuple[float, ...]:
    """geometry_msgs/Twist -> vx vy vz wx wy wz."""
    v, w = twist.linear, twist.angular
    return v.x, v.y, v.z, w.x, w.y, w.z


def set_vector(target: Any, values: Iterable[float]) -> None:
    """Fill x, y, z of a geometry_msgs/Point or Vector3."""
    target.x, target.y, target.z = values


def set_pose(pose: Any, row: ArrayLike) -> None:
    """Fill a geometry_msgs/Pose from x y z qx qy qz qw."""
    q = pose.orientation
    pose.position.x, pose.position.y, pose.position.z, q.x, q.y, q.z, q.w = np.asarray(row, dtype=np.float64).tolist()


def set_twist(twist: Any, row: ArrayLike) -> None:
    """Fill a geometry_msgs/Twist from vx vy vz wx wy wz."""
    v, w = twist.linear, twist.angular
    v.x, v.y, v.z, w.x, w.y, w.z = np.asarray(row, dtype=np.float64).tolist()


def points_in(frame_pose: ArrayLike, points: FloatArray) -> FloatArray:
    """Points (n, 3) given in a frame, expressed in the frame that `frame_pose` (7,) is given in."""
    frame = _validate.poses(frame_pose, "transform")
    return np.asarray(points @ _validate.rotation_matrices(frame[:, 3:])[0].T + frame[0, :3])


def states_in(
    frame_pose: ArrayLike, poses: FloatArray, twists: FloatArray | None
) -> tuple[FloatArray, FloatArray | None]:
    """Poses (n, 7) and twists (n, 6) given in a frame, expressed in the frame that `frame_pose` (7,) is given in."""
    frame = _validate.poses(frame_pose, "transform")
    rotation = _validate.rotation_matrices(frame[:, 3:])[0]
    moved = np.empty_like(poses)
    moved[:, :3] = points_in(frame_pose, poses[:, :3])
    # Hamilton product frame * q, quaternions as x y z w.
    (x, y, z, w), (a, b, c, d) = frame[0, 3:], poses[:, 3:].T
    moved[:, 3] = w * a + x * d + y * c - z * b
    moved[:, 4] = w * b - x * c + y * d + z * a
    moved[:, 5] = w * c + x * b - y * a + z * d
    moved[:, 6] = w * d - x * a - y * b - z * c
    if twists is None:
        return moved, None
    return moved, (twists.reshape(-1, 3) @ rotation.T).reshape(-1, 6)


# ---------------------------------------------------------------------------------------------------------- shapes


class _Codec(NamedTuple):
    """How one type of Shape.msg is written."""

    kind: type[AnyShape]
    dimensions: int  #: how many; 0 for a type that has vertices
    width: int  #: coordinates per vertex; 0 for a type that has dimensions
    points: int  #: exact number of vertices; 0 for any
    build: Callable[[FloatArray], AnyShape]
    values: Callable[[Any], ArrayLike]


def _camera_at_origin(values: FloatArray) -> Frustum:
    return Frustum(np.zeros(3), np.eye(3), bounds=values[:4], near=values[4], far=values[5])


def _frustum_values(shape: Frustum) -> list[float]:
    if shape.origin.any() or (shape.axes != np.eye(3)).any():
        raise GeometryError(
            "a frustum in a scene must have its apex in the origin and axes x, y, z; its pose places it"
        )
    return [*shape.bounds, shape.near, shape.far]


# The keys are the constants of Shape.msg.
_CODECS = {
    1: _Codec(Sphere, 1, 0, 0, lambda v: Sphere(v[0]), lambda s: [s.radius]),
    2: _Codec(Capsule, 2, 0, 0, lambda v: Capsule(v[0], v[1]), lambda s: [s.radius, s.length]),
    3: _Codec(Cylinder, 2, 0, 0, lambda v: Cylinder(v[0], v[1]), lambda s: [s.radius, s.length]),
    4: _Codec(Cone, 2, 0, 0, lambda v: Cone(v[0], v[1]), lambda s: [s.radius, s.length]),
    5: _Codec(Ellipsoid, 3, 0, 0, lambda v: Ellipsoid(v), lambda s: s.radii),
    6: _Codec(Box, 3, 0, 0, lambda v: Box(v), lambda s: s.half_extents),
    7: _Codec(HalfSpace, 4, 0, 0, lambda v: HalfSpace(v[:3], v[3]), lambda s: [*s.normal, s.offset]),
    8: _Codec(Convex, 0, 3, 0, Convex, lambda s: s.vertices),
    9: _Codec(Mesh, 0, 3, 0, Convex, lambda s: s.vertices),  # built by `shape_of`, which has the triangles
    10: _Codec(Triangle, 0, 3, 3, lambda v: Triangle(*v), lambda s: s.vertices),
    11: _Codec(Segment, 0, 3, 2, lambda v: Segment(*v), lambda s: s.vertices),
    12: _Codec(Point, 0, 3, 1, lambda v: Point(*v), lambda s: s.vertices),
    13: _Codec(Frustum, 6, 0, 0, _camera_at_origin, _frustum_values),
    14: _Codec(Polygon, 0, 2, 0, Polygon, lambda s: s.vertices),
}
_CODES = {codec.kind: code for code, codec in _CODECS.items()}
_MESH = _CODES[Mesh]


def shape_codec(code: int) -> _Codec:
    """How a type of Shape.msg is written."""
    codec = _CODECS.get(code)
    if codec is None:
        raise GeometryError(f"type {code} is {'not set' if code == 0 else 'not a constant of Shape.msg'}")
    return codec


def shape_of(code: int, dimensions: Any, vertices: Any, triangles: Any = ()) -> AnyShape:
    """The shape that the fields of a Shape.msg describe."""
    codec = shape_codec(code)
    name, numbers = codec.kind.kind, floats(dimensions)
    if len(numbers) != codec.dimensions:
        raise GeometryError(f"{name}: dimensions must hold {codec.dimensions or 'no'} numbers, got {len(numbers)}")
    if not codec.width and len(vertices):
        raise GeometryError(f"{name}: vertices must be empty, got {len(vertices)} numbers")
    if code != _MESH and len(triangles):
        raise GeometryError(f"{name}: triangles must be empty, got {len(triangles)} numbers")
    if codec.width:
        numbers = rows(vertices, f"{name}: vertices", codec.width)
        if codec.points and len(numbers) != codec.points:
            raise GeometryError(f"{name}: vertices must be {codec.points} points, got {len(numbers)}")
    try:
        if code == _MESH:
            corners = np.asarray(triangles, dtype=np.int64)
            if len(corners) % 3:
                raise GeometryError(f"triangles must hold 3 indices each, got {len(corners)} numbers")
            return Mesh(numbers, corners.reshape(-1, 3))
        return codec.build(numbers)
    except GeometryError as fault:
        raise GeometryError(f"{name}: {fault}") from None


def shape_from(message: Any) -> AnyShape:
    """geomsrv/Shape -> shape; the same object for the same small shape, so that what is made from it can be kept."""
    fields = (message.dimensions, message.vertices, message.triangles)
    if sum(map(len, fields)) > LARGEST_KEPT_SHAPE:
        return shape_of(message.type, *fields)
    return _kept_shape(message.type, *map(tuple, fields))


LARGEST_KEPT_SHAPE = 64  # numbers


@lru_cache(maxsize=256)
def _kept_shape(code: int, *fields: tuple[float, ...]) -> AnyShape:
    return shape_of(code, *fields)


def set_shape(message: Any, shape: AnyShape) -> None:
    """Fill a geomsrv/Shape."""
    message.type = _CODES[type(shape)]
    codec = _CODECS[message.type]
    values = doubles(np.ravel(codec.values(shape)))
    if codec.width:
        message.vertices = values
    else:
        message.dimensions = values
    if isinstance(shape, Mesh):
        message.triangles = uint32s(shape.triangles.ravel())


def frustum_of(values: Any, name: str = "frustum") -> Frustum:
    """18 numbers (apex, L, U, D, window, near, far) -> frustum."""
    numbers = floats(values)
    if len(numbers) != 18:
        raise GeometryError(f"{name} must hold 18 numbers, got {len(numbers)}")
    return Frustum(
        numbers[:3], numbers[3:12].reshape(3, 3), bounds=numbers[12:16], near=float(numbers[16]), far=float(numbers[17])
    )


def frustum_from(message: Any) -> Frustum:
    """geomsrv/Frustum -> frustum."""
    return Frustum(
        floats(message.origin),
        floats(message.axes).reshape(3, 3),
        bounds=floats(message.bounds),
        near=message.near,
        far=message.far,
    )


def set_frustum(message: Any, frustum: Frustum) -> None:
    """Fill a geomsrv/Frustum."""
    message.origin, message.axes = frustum.origin, frustum.axes.ravel()
    message.bounds = np.array(frustum.bounds)
    message.near, message.far = frustum.near, frustum.far


def camera_frustum(info: Any, pose: ArrayLike, near: float, far: float) -> Frustum:
    """sensor_msgs/CameraInfo -> what its rectified image shows.

    Parameters
    ----------
    info : CameraInfo-like
        ``p`` and ``r`` describe the rectified image; ``k`` stands in for an empty ``p``.  Binning does not change the
        field of view, a region of interest does.
    pose : (7,) float
        Pose of the optical frame in the fixed frame.
    near, far : float
        Depths [m].
    """
    projection, matrix = floats(info.p).reshape(3, 4), floats(info.k).reshape(3, 3)
    row = _validate.poses(pose, "camera pose")
    rotation, position = _validate.rotation_matrices(row[:, 3:])[0], row[0, :3]
    if projection[0, 0] != 0.0:
        # P = K' [I | t] acts on R x, so the image is that of a camera turned by R^T and centred at -t (stereo).
        matrix = projection[:, :3]
        turn = floats(info.r).reshape(3, 3)
        if turn.any():
            rotation = rotation @ turn.T
        shift = np.array([-projection[0, 3] / matrix[0, 0], -projection[1, 3] / (matrix[1, 1] or np.nan), 0.0])
        position = position + rotation @ shift
    elif matrix[0, 0] == 0.0:
        raise GeometryError("the camera is not calibrated: k[0] and p[0] are 0")
    width, height, matrix = info.width, info.height, matrix.copy()
    roi = info.roi
    if roi.width and roi.height:
        width, height = roi.width, roi.height
        matrix[:2, 2] -= roi.x_offset, roi.y_offset
    placed = np.eye(4)
    placed[:3, :3], placed[:3, 3] = rotation, position
    return Frustum.from_intrinsics(matrix, width, height, placed, near, far)


# ----------------------------------------------------------------------------------------------------------- scene


def update_from(message: Any) -> SceneUpdate:
    """geomsrv/SceneUpdate -> scene update.

    Raises
    ------
    GeometryError
        The lists do not fit together; a `SceneError` that names every object whose shape is faulty.
    """
    pairs = {}
    for word in ("allow", "disallow"):
        a, b = getattr(message, f"{word}_a"), getattr(message, f"{word}_b")
        if len(a) != len(b):
            raise GeometryError(f"{word}_a and {word}_b must have the same length, got {len(a)} and {len(b)}")
        pairs[word] = list(zip(a, b, strict=True))
    objects, faults = [], {}
    for item in message.add:
        try:
            objects.append(_object_from(item, message.header.frame_id))
        except GeometryError as fault:
            faults[item.id] = f"shape: {fault}"
    if faults:
        raise SceneError(faults)
    return SceneUpdate(clear=bool(message.clear), remove=list(message.remove), add=objects, **pairs)


def _object_from(item: Any, default_frame: str) -> SceneObject:
    return SceneObject(
        item.id,
        shape_from(item.shape),
        pose_row(item.pose),
        twist_row(item.twist),
        item.frame or default_frame,
        item.uncertainty,
        item.velocity_uncertainty,
        item.motion_fault,
    )


def set_object(message: Any, item: SceneObject) -> None:
    """Fill a geomsrv/SceneObject."""
    message.id, message.frame, message.motion_fault = item.id, item.frame, item.motion_fault
    message.uncertainty, message.velocity_uncertainty = float(item.uncertainty), float(item.velocity_uncertainty)
    set_shape(message.shape, item.shape)
    set_pose(message.pose, item.pose)
    set_twist(message.twist, item.twist)


class States(NamedTuple):
    """Content of a geomsrv/ShapeStates."""

    ids: list[str]  #: empty: those last sent with the same key
    key: int
    poses: FloatArray  #: (n, 7)
    twists: FloatArray | None  #: (n, 6)


def states_from(message: Any) -> States:
    """geomsrv/ShapeStates -> arrays."""
    poses = rows(message.poses, "poses", 7)
    twists = rows(message.twists, "twists", 6) if len(message.twists) else None
    if twists is not None and len(twists) != len(poses):
        raise GeometryError(f"poses are of {len(poses)} objects, twists of {len(twists)}")
    if message.ids and len(message.ids) != len(poses):
        raise GeometryError(f"{len(message.ids)} ids, but poses of {len(poses)} objects")
    return States(message.ids, message.ids_key, poses, twists)


def polygon_from(message: Any) -> FloatArray:
    """geometry_msgs/PolygonInstanceStamped -> (n, 3) float64, each number a float32."""
    points = message.polygon.polygon.points
    return np.array([(p.x, p.y, p.z) for p in points], dtype=np.float64).reshape(-1, 3)


# --------------------------------------------------------------------------------------------------------- answers


def set_cost(message: Any, cost: Cost, error_bound: float) -> None:
    """Fill a geomsrv/Cost."""
    message.error_bound = error_bound
    message.elapsed_ns, message.accuracy = cost.elapsed_ns, cost.accuracy
    message.stages = list(cost.counts)
    message.counts = array.array("Q", cost.counts.values())


def set_distances(message: Any, answer: PairDistances, pair_type: Callable[[], Any]) -> None:
    """Fill a geomsrv/DistanceArray, nearest pair first, then those that are unsupported."""
    order = np.argsort(answer.distance, kind="stable").tolist()
    columns = (answer.distance, answer.lower, answer.upper, answer.point_a, answer.point_b, answer.normal)
    distance, lower, upper, point_a, point_b, normal = (column.tolist() for column in columns)
    ids_a, ids_b, status = answer.ids_a, answer.ids_b, answer.status.tolist()
    pairs = []
    for i in order:
        pair = pair_type()
        pair.id_a, pair.id_b, pair.status = ids_a[i], ids_b[i], status[i]
        pair.distance, pair.lower, pair.upper = distance[i], lower[i], upper[i]
        set_vector(pair.point_a, point_a[i])
        set_vector(pair.point_b, point_b[i])
        set_vector(pair.normal, normal[i])
        pairs.append(pair)
    for id_a, id_b, reason in answer.unsupported:
        pair = pair_type()
        pair.id_a, pair.id_b, pair.status, pair.note = id_a, id_b, int(DistanceStatus.UNSUPPORTED), reason
        pair.distance = pair.lower = pair.upper = math.nan
        for vector in (pair.point_a, pair.point_b, pair.normal):
            set_vector(vector, _NOWHERE)
        pairs.append(pair)
    message.distances = pairs
    message.scene_version = answer.version
    set_cost(message.cost, answer.cost, answer.error_bound)


def set_contacts(
    message: Any, answer: SceneContacts, contact_type: Callable[[], Any], point_type: Callable[[], Any]
) -> None:
    """Fill a geomsrv/ContactArray, first contact first, then those that are unsupported."""
    pairs = answer.pairs
    notes = {(a, b): reason for a, b, reason in pairs.unsupported}
    columns = (
        pairs.status,
        pairs.time,
        pairs.time_lower,
        pairs.time_upper,
        pairs.last_time,
        answer.depth,
        pairs.closing_speed,
        pairs.normal,
    )
    status, time, lower, upper, last, depth, speed, normal = (column.tolist() for column in columns)
    points, offsets = pairs.points.tolist(), pairs.point_offsets.tolist()
    ends = pairs.part_offsets
    parts = np.searchsorted(ends, offsets).tolist()
    contacts = []
    for i in np.argsort(pairs.time, kind="stable").tolist():
        contact = contact_type()
        contact.id_a, contact.id_b, contact.status = pairs.ids_a[i], pairs.ids_b[i], status[i]
        contact.time, contact.time_lower, contact.time_upper = time[i], lower[i], upper[i]
        contact.last_time, contact.depth, contact.closing_speed = last[i], depth[i], speed[i]
        set_vector(contact.normal, normal[i])
        for row in points[offsets[i] : offsets[i + 1]]:
            point = point_type()
            set_vector(point, row)
            contact.points.append(point)
        if offsets[i] < offsets[i + 1]:
            contact.part_offsets = uint32s(ends[parts[i] : parts[i + 1] + 1] - offsets[i])
        contact.note = notes.get((contact.id_a, contact.id_b), "")
        contacts.append(contact)
    message.contacts = contacts
    message.scene_version, message.checked = pairs.version, answer.checked
    message.horizon, message.margin = answer.horizon, answer.margin
    set_cost(message.cost, pairs.cost, pairs.error_bound)


def set_visible(message: Any, answer: SceneCull, frustum: Frustum) -> None:
    """Fill a geomsrv/VisibleArray."""
    seen = np.flatnonzero(answer.state != Visibility.OUTSIDE)
    message.ids = [answer.ids[i] for i in seen.tolist()]
    message.states, message.certain = bytes_(answer.state[seen]), bytes_(answer.certain[seen])
    message.checked, message.scene_version = len(answer.ids), answer.version
    set_frustum(message.frustum, frustum)
    set_cost(message.cost, answer.cost, answer.error_bound)


_NOWHERE = (math.nan, math.nan, math.nan)
