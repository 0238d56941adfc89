# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""Robots as scene objects: URDF collision geometry at a joint configuration, SRDF disabled pairs as allowed pairs.

Needs yourdfpy and trimesh, which are imported on use; nothing else in geomsrv does.
"""

from __future__ import annotations

import importlib
import importlib.metadata
import xml.etree.ElementTree as ElementTree
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations, product
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from geomsrv.errors import GeometryError
from geomsrv.scene import SceneObject
from geomsrv.shapes import Box, Convex, Cylinder, Mesh, Shape, Sphere, vertices_of

__all__ = ["Robot", "example_robot_directory"]

_Twist = tuple[NDArray[np.float64], NDArray[np.float64]]


@dataclass(frozen=True)
class _Collision:
    """One collision geometry of a link."""

    id: str
    link: str
    shape: Shape
    X_link_shape: NDArray[np.float64]


class Robot:
    """Collision geometry of a robot description.

    Meshes become their convex hulls, or stay what they are.  A link with several geometries gives one object each,
    ``link/0``, ``link/1``...

    Parameters
    ----------
    urdf : path
        Robot description.
    srdf : path, optional
        Semantic description; its ``disable_collisions`` entries become `allowed_pairs`.
    mesh_directories : sequence of path
        Where ``package://name/...`` is looked up, as ``directory/name/...``.
    prefix : str
        Put before every object id.
    hulls : bool
        Whether a mesh is taken as its convex hull, which every query answers, or as a `Mesh`.

    Raises
    ------
    GeometryError
        Names the file, link or mesh that cannot be read.
    """

    def __init__(
        self,
        urdf: str | Path,
        srdf: str | Path | None = None,
        *,
        mesh_directories: Sequence[str | Path] = (),
        prefix: str = "",
        hulls: bool = True,
    ) -> None:
        yourdfpy = _import("yourdfpy")
        self._hulls = hulls
        self._directories = [Path(urdf).resolve().parent, *map(Path, mesh_directories)]
        if not Path(urdf).is_file():
            raise GeometryError(f"urdf: no such file: {urdf}")
        self._model = yourdfpy.URDF.load(str(urdf), load_meshes=False, build_scene_graph=True)
        self._collisions = [
            _Collision(
                id=prefix + (name if len(link.collisions) == 1 else f"{name}/{i}"),
                link=name,
                shape=self._shape(name, collision.geometry),
                X_link_shape=np.eye(4) if collision.origin is None else np.asarray(collision.origin, np.float64),
            )
            for name, link in self._model.link_map.items()
            for i, collision in enumerate(link.collisions)
        ]
        #: Pairs of object ids whose contact the description disables, geometries of one link among them.
        self.allowed_pairs: list[tuple[str, str]] = self._allowed(srdf)

    @property
    def joint_names(self) -> list[str]:
        """Names of the actuated joints."""
        return list(self._model.actuated_joint_names)

    @property
    def ids(self) -> list[str]:
        """Ids of the objects."""
        return [c.id for c in self._collisions]

    def objects(
        self,
        joints: Mapping[str, float],
        *,
        velocities: Mapping[str, float] | None = None,
        base: NDArray[np.float64] | None = None,
        frame: str = "",
    ) -> list[SceneObject]:
        """Scene objects at a joint configuration, and on their way if the joints are.

        An object of a scene turns about the origin of its pose.  That of a hull that turns is put on its screw axis, so
        that it moves as the link does for as long as the link's spatial twist stays the same, which is for good where
        one joint moves; a box that turns becomes such a hull.  Round shapes turn about their centre: their motion is
        right to first order.

        Parameters
        ----------
        joints : mapping of str to float
            Joint positions [rad or m]; joints left out are at 0.
        velocities : mapping of str to float, optional
            Joint velocities [rad/s or m/s]; joints left out are at rest.
        base : (4, 4) float, optional
            Pose of the robot's root link in `frame`.
        frame : str
            Frame that the poses are in; empty is the scene's fixed frame.
        """
        rates = velocities or {}
        for name, given in (("joints", joints), ("velocities", rates)):
            if unknown := set(given) - set(self.joint_names):
                known = ", ".join(self.joint_names)
                raise GeometryError(f"{name}: unknown joint {min(unknown)!r}; the robot has {known}")
        self._model.update_cfg({name: float(joints.get(name, 0.0)) for name in self.joint_names})
        root = np.eye(4) if base is None else np.asarray(base, np.float64)
        twists = self._twists(root, rates)
        objects = []
        for c in self._collisions:
            shape, place = c.shape, root @ self._model.get_transform(c.link) @ c.X_link_shape
            angular, at_origin = twists[c.link]
            if isinstance(shape, Box | Convex) and angular.any():
                on_axis = _nearest_on_axis(angular, at_origin, place[:3, 3])
                shape = Convex(vertices_of(shape) + (place[:3, 3] - on_axis) @ place[:3, :3])
                place[:3, 3] = on_axis
            linear = at_origin + np.cross(angular, place[:3, 3])
            objects.append(SceneObject(c.id, shape, _pose(place), (*linear, *angular), frame))
        return objects

    def _twists(self, root: NDArray[np.float64], rates: Mapping[str, float]) -> dict[str, _Twist]:
        """Of every link the angular velocity, and the linear one of what of it is at the frame's origin."""
        model = self._model
        parents = {joint.child: joint for joint in model.joint_map.values()}
        found: dict[str, _Twist] = {model.base_link: (np.zeros(3), np.zeros(3))}

        def of(link: str) -> _Twist:
            if link not in found:
                joint = parents[link]
                angular, linear = of(joint.parent)
                rate = rates.get(joint.name, 0.0)
                if joint.mimic is not None:
                    rate = joint.mimic.multiplier * rates.get(joint.mimic.joint, 0.0)
                place = root @ model.get_transform(link)
                along = float(rate) * (place[:3, :3] @ np.asarray(joint.axis, np.float64))
                if joint.type == "prismatic":
                    linear = linear + along
                elif joint.type in ("revolute", "continuous"):
                    angular, linear = angular + along, linear - np.cross(along, place[:3, 3])
                found[link] = angular, linear
            return found[link]

        return {link: of(link) for link in model.link_map}

    def _shape(self, link: str, geometry: Any) -> Shape:
        if geometry.box is not None:
            return Box(np.asarray(geometry.box.size, np.float64) / 2.0)
        if geometry.sphere is not None:
            return Sphere(geometry.sphere.radius)
        if geometry.cylinder is not None:
            return Cylinder(geometry.cylinder.radius, geometry.cylinder.length)
        if geometry.mesh is not None:
            mesh = _import("trimesh").load(self._resolve(geometry.mesh.filename), force="mesh")
            scale = 1.0 if geometry.mesh.scale is None else np.asarray(geometry.mesh.scale, np.float64)
            if self._hulls:
                return Convex(np.asarray(mesh.convex_hull.vertices, np.float64) * scale)
            return Mesh(np.asarray(mesh.vertices, np.float64) * scale, np.asarray(mesh.faces, np.int64))
        raise GeometryError(f"link {link!r}: collision geometry of an unknown kind")

    def _resolve(self, filename: str) -> Path:
        relative = filename.removeprefix("package://").removeprefix("file://")
        for candidate in (Path(relative), *(directory / relative for directory in self._directories)):
            if candidate.is_file():
                return candidate
        raise GeometryError(f"mesh {filename!r} is in none of {', '.join(map(str, self._directories))}")

    def _allowed(self, srdf: str | Path | None) -> list[tuple[str, str]]:
        by_link: dict[str, list[str]] = {}
        for c in self._collisions:
            by_link.setdefault(c.link, []).append(c.id)
        pairs = {pair for ids in by_link.values() for pair in combinations(ids, 2)}
        if srdf is not None:
            if not Path(srdf).is_file():
                raise GeometryError(f"srdf: no such file: {srdf}")
            for entry in ElementTree.parse(srdf).getroot().iter("disable_collisions"):
                pairs.update(product(by_link.get(entry.get("link1", ""), ()), by_link.get(entry.get("link2", ""), ())))
        return sorted((min(pair), max(pair)) for pair in pairs)


def example_robot_directory() -> Path:
    """Directory that the package example-robot-data installs its ``robots`` in, for ``package://example-robot-data``."""
    try:
        distribution = importlib.metadata.distribution("example-robot-data")
    except importlib.metadata.PackageNotFoundError:
        raise GeometryError(
            "example robots need the package example-robot-data: pip install example-robot-data"
        ) from None
    return Path(str(distribution.locate_file("cmeel.prefix/share/example-robot-data")))


def _nearest_on_axis(
    angular: NDArray[np.float64], at_origin: NDArray[np.float64], point: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Point of a twist's screw axis, along which all that is on it moves, that is nearest to `point`."""
    square = angular @ angular
    foot = np.cross(angular, at_origin) / square
    nearest: NDArray[np.float64] = foot + ((point - foot) @ angular / square) * angular
    return nearest


def _import(name: str) -> Any:
    try:
        return importlib.import_module(name)
    except ImportError as error:
        raise GeometryError(f"reading robot descriptions needs {name}: pip install {name}") from error


def _pose(matrix: NDArray[np.float64]) -> NDArray[np.float64]:
    """(4, 4) homogeneous -> (7,) x y z qx qy qz qw."""
    r = matrix[:3, :3]
    # The largest of the four squared components is the divisor, so nothing cancels (Shepperd's choice).
    squares = np.array([r[0, 0], r[1, 1], r[2, 2], np.trace(r)])
    k = int(np.argmax(squares))
    if k == 3:
        q = np.array([r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1], 1.0 + squares[3]])
    else:
        i, j = (k + 1) % 3, (k + 2) % 3
        q = np.empty(4)
        q[k] = 1.0 + r[k, k] - r[i, i] - r[j, j]
        q[i], q[j] = r[i, k] + r[k, i], r[j, k] + r[k, j]
        q[3] = r[j, i] - r[i, j]
    return np.concatenate([matrix[:3, 3], q / np.linalg.norm(q)])
