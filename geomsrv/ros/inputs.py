# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""What arrives on topics: converted, applied to the engine, and counted.  Nothing raises; what is refused is named."""

from __future__ import annotations

import functools
import traceback
from collections import OrderedDict
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from geomsrv.config import Config
from geomsrv.engine import Engine
from geomsrv.errors import GeometryError
from geomsrv.ros import convert
from geomsrv.ros.polygons import PolygonTracks, convex_ring, float32_floor
from geomsrv.scene import SceneObject, SceneUpdate
from geomsrv.shapes import Polygon

__all__ = ["POLYGON_PREFIX", "InputRecord", "Inputs"]

POLYGON_PREFIX = "polygon/"  #: polygon 7 of ~/polygons is the object "polygon/7"

# Lists of ids that ~/states has named by key.  More than a handful of publishers share one node seldom enough.
MAX_ID_LISTS = 64

# The log says at most so often [s] that a topic's messages are refused: for the same reason again, or for another one.
LOG_SAME_AFTER = 10.0
LOG_OTHER_AFTER = 1.0


@dataclass
class InputRecord:
    """What has come in on one topic."""

    topic: str
    received: int = 0
    refused: int = 0
    fault: str = ""  #: why the last refused message was
    last: float | None = None  #: when the last message came, `Inputs.clock`
    refused_last: bool = False  #: whether that one was refused
    logged: tuple[str, float] = ("", -np.inf)

    def age(self, now: float) -> float:
        """Seconds since the last message; NaN if there was none."""
        return np.nan if self.last is None else now - self.last


def _input(apply: Callable[[Inputs, Any], None]) -> Callable[[Inputs, Any], bool]:
    """Count, and turn every exception into a named refusal; True if the message was applied."""

    @functools.wraps(apply)
    def receive(self: Inputs, message: Any) -> bool:
        record = self.records[apply.__name__]
        record.received += 1
        record.last = self.clock()
        try:
            apply(self, message)
        except GeometryError as fault:
            self._refuse(record, str(fault))
        except Exception as error:  # a fault of ours must not stop the node; the log has where it was
            self._refuse(record, f"internal error: {error!r}", traceback.format_exc())
        else:
            record.refused_last = False
            return True
        return False

    return receive


class Inputs:
    """Applies messages to an engine.

    Parameters
    ----------
    engine : Engine
    transforms : callable
        ``transforms(frame, stamp)`` gives the pose (7,) of a frame in the fixed frame, or raises `GeometryError`.
    clock : callable
        Steady time [s].
    log : callable
        Takes the text of a warning.
    """

    def __init__(
        self,
        engine: Engine,
        transforms: Callable[[str, Any], ArrayLike],
        clock: Callable[[], float],
        log: Callable[[str], None],
    ) -> None:
        self.engine = engine
        self.transforms = transforms
        self.clock = clock
        self.log = log
        self.records = {name: InputRecord(f"~/{topic}") for name, topic in _TOPICS.items()}
        self.tracks = PolygonTracks()
        self._id_lists: OrderedDict[int, list[str]] = OrderedDict()
        self._camera_info: Any = None

    @_input
    def shapes(self, message: Any) -> None:
        """geomsrv/SceneUpdate."""
        self.engine.apply(convert.update_from(message), message.header.stamp)

    @_input
    def states(self, message: Any) -> None:
        """geomsrv/ShapeStates."""
        states = convert.states_from(message)
        ids = self._ids(states.key, states.ids)
        if len(ids) != len(states.poses):
            raise GeometryError(f"{len(ids)} ids of key {states.key}, but poses of {len(states.poses)} objects")
        poses, twists = states.poses, states.twists
        frame = message.header.frame_id
        if frame and frame != self.config.fixed_frame:
            poses, twists = convert.states_in(self.transforms(frame, message.header.stamp), poses, twists)
        self.engine.set_states(ids, poses, twists, message.header.stamp)

    def _ids(self, key: int, ids: list[str]) -> list[str]:
        """The list of ids of a message; the same list object as long as the ids are the same."""
        known = self._id_lists.get(key)
        if ids:
            if ids != known:
                self._id_lists[key] = known = ids
                if len(self._id_lists) > MAX_ID_LISTS:
                    self._id_lists.popitem(last=False)
        elif known is None:
            raise GeometryError(f"no ids, and none were sent before with ids_key {key}")
        self._id_lists.move_to_end(key)
        assert known is not None
        return known

    @_input
    def polygons(self, message: Any) -> None:
        """geometry_msgs/PolygonInstanceStamped."""
        name = f"{POLYGON_PREFIX}{message.polygon.id}"
        try:
            item = self._polygon(name, message)
        except GeometryError as fault:
            raise GeometryError(f"{name}: {fault}") from None
        self.engine.apply(SceneUpdate(add=[item]), message.header.stamp)

    def _polygon(self, name: str, message: Any) -> SceneObject:
        points = convert.polygon_from(message)
        if not np.isfinite(points).all():
            i = int(np.argmax(~np.isfinite(points).all(axis=1)))
            raise GeometryError(f"point {i} is {points[i].tolist()}, must be finite")
        floor = float32_floor(points)
        frame, stamp = message.header.frame_id, message.header.stamp
        if frame and frame != self.config.fixed_frame:
            points = convert.points_in(self.transforms(frame, stamp), points)
            # A rotation mixes the coordinates, and all it keeps is the length of what they are off by.
            floor = np.broadcast_to(np.linalg.norm(floor, axis=1, keepdims=True), floor.shape)
        if len(points) and (np.abs(points[:, 2] - points[0, 2]) > floor[:, 2] + floor[0, 2]).any():
            raise GeometryError("z is not the same for all points")
        if len(points) and abs(points[0, 2]) > floor[0, 2]:
            raise GeometryError(f"z is {points[0, 2]:g}; polygons must lie in the plane z = 0 of the fixed frame")
        points, floor = points[:, :2], floor[:, :2]
        ring = convex_ring(points, floor)
        if name not in self.engine.scene:
            self.tracks.forget_all_but(self.engine.scene)  # it was removed, or is new: nothing is known of its motion
        motion = self.tracks.update(name, points, floor, stamp.sec * 10**9 + stamp.nanosec)
        # The origin is a corner: whoever has to assume that the polygon turns need not sweep a circle about the
        # world's origin.  Differences of float32 numbers are exact in float64, or off by 2^-29 of the floor.
        origin = ring[0]
        return SceneObject(
            name,
            Polygon(ring - origin),
            pose=(*origin.tolist(), 0.0, 0.0, 0.0, 0.0, 1.0),
            twist=(*motion.velocity, 0.0, 0.0, 0.0, 0.0),
            uncertainty=float(np.hypot(*floor.max(axis=0))),
            velocity_uncertainty=motion.velocity_floor,
            motion_fault=motion.fault,
        )

    @_input
    def camera_info(self, message: Any) -> None:
        """sensor_msgs/CameraInfo."""
        self._place_camera(message)
        self.engine.stamp = message.header.stamp
        self._camera_info = message

    def refresh_camera(self) -> None:
        """Apply the last ~/camera_info again, after a change of parameters."""
        if self._camera_info is not None:
            try:
                self._place_camera(self._camera_info)
            except GeometryError as fault:
                self._refuse(self.records["camera_info"], str(fault))

    def _place_camera(self, message: Any) -> None:
        config, frame = self.config, message.header.frame_id
        pose: ArrayLike
        if config.camera_frame and frame == config.camera_frame:
            pose = config.camera_pose
        elif frame in ("", config.fixed_frame):
            pose = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)
        else:
            try:
                pose = self.transforms(frame, message.header.stamp)
            except GeometryError as fault:
                raise GeometryError(f"{fault}; or set camera.frame and camera.pose") from None
        self.engine.camera = convert.camera_frustum(message, pose, config.camera_near, config.camera_far)

    @property
    def config(self) -> Config:
        """The configuration as of now."""
        return self.engine.config

    def _refuse(self, record: InputRecord, fault: str, details: str = "") -> None:
        record.refused += 1
        record.fault, record.refused_last = fault, True
        now = self.clock()
        text, when = record.logged
        if now - when > (LOG_SAME_AFTER if fault == text else LOG_OTHER_AFTER):
            record.logged = (fault, now)
            self.log(f"{record.topic}: refused: {fault}" + (f"\n{details}" if details else ""))


_TOPICS = {"shapes": "shapes", "states": "states", "polygons": "polygons", "camera_info": "camera_info"}
