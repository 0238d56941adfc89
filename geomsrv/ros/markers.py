# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""Markers for a viewer: the shapes of the scene, the camera's frustum, contact points and normals."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from geomsrv.answers import ContactStatus
from geomsrv.engine import SceneContacts
from geomsrv.hull import hull_triangles
from geomsrv.ros import convert
from geomsrv.scene import Scene
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

__all__ = ["Markers", "Part", "parts"]

FloatArray = NDArray[np.float64]

# Constants of visualization_msgs/Marker.
ARROW, CUBE, SPHERE, CYLINDER = 0, 1, 2, 3
LINE_STRIP, LINE_LIST, SPHERE_LIST, TRIANGLE_LIST = 4, 5, 7, 11
ADD, DELETE = 0, 2

GREY, BLUE, RED = (0.7, 0.7, 0.7, 0.8), (0.2, 0.5, 0.9, 0.8), (0.9, 0.2, 0.1, 0.9)
YELLOW, CYAN = (1.0, 0.8, 0.1, 1.0), (0.1, 0.8, 0.8, 1.0)

LINE_WIDTH = 0.005  # [m]
POINT_SIZE = 0.02  # [m]
NORMAL_LENGTH = 0.15  # [m]
HALF_SPACE_SIZE = 10.0  # [m], edge of the square that stands for its boundary
CONE_SIDES = 24

AT_A_TIME = 200  # objects drawn before others get their turn: some 5 ms

IDENTITY = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)


class Part(NamedTuple):
    """One marker of a shape, in the shape's frame."""

    type: int
    scale: tuple[float, float, float]
    offset: tuple[float, float, float] = (0.0, 0.0, 0.0)
    points: FloatArray | None = None


def parts(shape: Shape | Frustum) -> list[Part]:
    """What draws a shape."""
    if isinstance(shape, Sphere):
        return [Part(SPHERE, (2 * shape.radius,) * 3)]
    if isinstance(shape, Ellipsoid):
        x, y, z = (2.0 * shape.radii).tolist()
        return [Part(SPHERE, (x, y, z))]
    if isinstance(shape, Box):
        x, y, z = (2.0 * shape.half_extents).tolist()
        return [Part(CUBE, (x, y, z))]
    if isinstance(shape, Cylinder):
        return [Part(CYLINDER, (2 * shape.radius, 2 * shape.radius, shape.length))]
    if isinstance(shape, Capsule):
        ball, z = (2 * shape.radius,) * 3, shape.length / 2
        ends = [Part(SPHERE, ball, (0.0, 0.0, sign * z)) for sign in (-1.0, 1.0)]
        return [Part(CYLINDER, (2 * shape.radius, 2 * shape.radius, shape.length)), *ends]
    if isinstance(shape, (Convex, Triangle)):
        return [_triangles(shape.vertices[hull_triangles(shape.vertices)])]
    if isinstance(shape, Mesh):
        return [_triangles(shape.vertices[shape.triangles])]
    if isinstance(shape, Cone):
        return [_triangles(_cone(shape))]
    if isinstance(shape, HalfSpace):
        return [_triangles(_square(shape))]
    if isinstance(shape, Polygon):
        ring = np.column_stack([shape.vertices, np.zeros(len(shape.vertices))])
        return [_lines(LINE_STRIP, np.concatenate([ring, ring[:1]]))]
    if isinstance(shape, Segment):
        return [_lines(LINE_LIST, shape.vertices)]
    if isinstance(shape, Point):
        return [Part(SPHERE_LIST, (POINT_SIZE,) * 3, points=shape.vertices)]
    return [_lines(LINE_LIST, _frustum_edges(shape))] if isinstance(shape, Frustum) else []


def _triangles(corners: FloatArray) -> Part:
    return Part(TRIANGLE_LIST, (1.0, 1.0, 1.0), points=corners.reshape(-1, 3))


def _lines(kind: int, points: FloatArray) -> Part:
    return Part(kind, (LINE_WIDTH, 0.0, 0.0), points=points)


def _cone(shape: Cone) -> FloatArray:
    angle = np.linspace(0.0, 2.0 * np.pi, CONE_SIDES + 1)
    rim = np.column_stack(
        [shape.radius * np.cos(angle), shape.radius * np.sin(angle), np.full_like(angle, -shape.length / 2)]
    )
    apex, base = np.array([0.0, 0.0, shape.length / 2]), np.array([0.0, 0.0, -shape.length / 2])
    sides = [(rim[i], rim[i + 1], apex) for i in range(CONE_SIDES)]
    return np.array(sides + [(rim[i + 1], rim[i], base) for i in range(CONE_SIDES)])


def _square(shape: HalfSpace) -> FloatArray:
    across = np.cross(shape.normal, np.eye(3)[int(np.argmin(np.abs(shape.normal)))])
    u = across / np.linalg.norm(across)
    v, half = np.cross(shape.normal, u), HALF_SPACE_SIZE / 2
    a, b, c, d = (shape.offset * shape.normal + half * (x * u + y * v) for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1)))
    return np.array([(a, b, c), (a, c, d)])


def _frustum_edges(shape: Frustum) -> FloatArray:
    # corners(): near 0 1 2 3, far 4 5 6 7, each in the order (l0 u0) (l1 u0) (l0 u1) (l1 u1)
    loop = [0, 1, 1, 3, 3, 2, 2, 0]
    return shape.corners()[[*loop, *(i + 4 for i in loop), 0, 4, 1, 5, 2, 6, 3, 7]]


class Markers:
    """Keeps what has been shown, so that what has gone is deleted.

    Parameters
    ----------
    marker_type, point_type : callable
        visualization_msgs/Marker and geometry_msgs/Point.
    """

    def __init__(self, marker_type: Callable[[], Any], point_type: Callable[[], Any]) -> None:
        self._marker_type = marker_type
        self._point_type = point_type
        self._shown: dict[str, int] = {}  # namespace -> number of markers
        self._models: dict[str, tuple[Any, list[tuple[Part, Any]]]] = {}  # object id -> shape, its markers

    def build(
        self, scene: Scene, camera: Frustum | None, contacts: SceneContacts | None, header: Any
    ) -> Iterator[list[Any]]:
        """Every marker of the scene as it is now, and a DELETE for each that has gone, some at a time."""
        touching = _touching(contacts)
        groups: dict[str, list[Any]] = {}
        world = scene.world
        moving = world.moves | world.turns
        done = 0
        for row, name in enumerate(world.ids):
            colour = RED if name in touching else BLUE if moving[row] else GREY
            shape = world.table.shapes[world.shape[row]]
            groups[f"shapes/{name}"] = self._shape(name, shape, world.poses[row], world.rotations[row], colour)
            if row - done >= AT_A_TIME:
                done = row
                yield []
        self._models = {name: model for name, model in self._models.items() if name in world.index}
        if camera is not None:
            groups["camera"] = [self._marker(part, IDENTITY, CYAN) for part in parts(camera)]
        if contacts is not None:
            groups["contacts"] = list(self._contact_markers(contacts))
        yield self._finish(groups, header)

    def _shape(
        self, name: str, shape: Shape | Frustum, pose: FloatArray, rotation: FloatArray, colour: tuple[float, ...]
    ) -> list[Any]:
        """Markers of one object; their geometry is made once per shape."""
        known = self._models.get(name)
        if known is None or known[0] is not shape:
            models = [(part, self._marker(part, IDENTITY, colour)) for part in parts(shape)]
            self._models[name] = known = (shape, models)
        for part, marker in known[1]:
            place = pose[:3] + rotation @ part.offset if any(part.offset) else pose[:3]
            convert.set_pose(marker.pose, [*place, *pose[3:]])
            _set_colour(marker, colour)
        return [marker for _, marker in known[1]]

    def _contact_markers(self, contacts: SceneContacts) -> Iterator[Any]:
        pairs = contacts.pairs
        if len(pairs.points):
            yield self._marker(Part(SPHERE_LIST, (POINT_SIZE,) * 3, points=pairs.points), IDENTITY, YELLOW)
        for normal, start in zip(pairs.normal, pairs.point_offsets.tolist(), strict=False):
            if start < len(pairs.points) and np.isfinite(normal).all():
                point = pairs.points[start]
                arrow = np.array([point, point + NORMAL_LENGTH * normal])
                yield self._marker(Part(ARROW, (0.01, 0.02, 0.0), points=arrow), IDENTITY, YELLOW)

    def _marker(self, part: Part, pose: ArrayLike, colour: tuple[float, ...]) -> Any:
        marker = self._marker_type()
        marker.type, marker.action = part.type, ADD
        convert.set_pose(marker.pose, pose)
        convert.set_vector(marker.scale, part.scale)
        _set_colour(marker, colour)
        for row in () if part.points is None else part.points.tolist():
            point = self._point_type()
            convert.set_vector(point, row)
            marker.points.append(point)
        return marker

    def _finish(self, groups: dict[str, list[Any]], header: Any) -> list[Any]:
        """Name and number the markers, and delete those shown before that are not there any more."""
        result = []
        for group, markers in groups.items():
            for number, marker in enumerate(markers):
                marker.header, marker.ns, marker.id = header, group, number
                result.append(marker)
        for group, count in self._shown.items():
            for number in range(len(groups.get(group, ())), count):
                marker = self._marker_type()
                marker.header, marker.ns, marker.id, marker.action = header, group, number, DELETE
                result.append(marker)
        self._shown = {group: len(markers) for group, markers in groups.items() if markers}
        return result


def _set_colour(marker: Any, colour: tuple[float, ...]) -> None:
    c = marker.color
    c.r, c.g, c.b, c.a = colour


def _touching(contacts: SceneContacts | None) -> set[str]:
    """Ids of the objects that are in contact now."""
    if contacts is None:
        return set()
    pairs = contacts.pairs
    now = np.isin(pairs.status, (ContactStatus.TOUCHING, ContactStatus.OVERLAPPING))
    return {ids[i] for i in np.flatnonzero(now).tolist() for ids in (pairs.ids_a, pairs.ids_b)}
