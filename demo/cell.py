# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""The demo's world: a Panda swinging over a table with objects, a camera, a mobile robot on the floor.  Data only."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

import geomsrv as gs
from geomsrv.robot import Robot, example_robot_directory

JOINTS = {
    "panda_joint1": 0.1,
    "panda_joint2": 0.1,
    "panda_joint3": 0.0,
    "panda_joint4": -2.2,
    "panda_joint5": 0.0,
    "panda_joint6": 2.2,
    "panda_joint7": 0.785,
    "panda_finger_joint1": 0.02,
}
#: The arm swings about its vertical axis [rad/s].
SWING = {"panda_joint1": 0.4}
UPRIGHT = (0.0, 0.0, 0.0, 1.0)
# Quarter turn about y: the capsule's axis lies along x.
LYING = (0.0, float(np.sqrt(0.5)), 0.0, float(np.sqrt(0.5)))

# Camera: 640 x 480, 57 degrees wide, on a tripod in front of the table, optical frame z forward, x right, y down.
CAMERA_FRAME = "camera_optical"
WIDTH, HEIGHT = 640, 480
INTRINSICS = ((588.0, 0.0, 320.0), (0.0, 588.0, 240.0), (0.0, 0.0, 1.0))
CAMERA_EYE, CAMERA_TARGET = (1.75, -0.95, 0.95), (0.35, 0.0, 0.15)
NEAR, FAR = 0.6, 2.4

OBSTACLE = "visitor_arm"
OBSTACLE_START, OBSTACLE_VELOCITY = (1.35, 0.05, 0.62), (-0.15, 0.0, 0.0)


@dataclass(frozen=True)
class Mover:
    """A planar body: its ring at time 0 and its velocity."""

    number: int
    name: str
    ring: np.ndarray
    velocity: tuple[float, float]

    @property
    def id(self) -> str:
        """Object id in the node's scene."""
        return f"polygon/{self.number}"


def _rectangle(x: float, y: float, half_x: float, half_y: float, yaw: float = 0.0) -> np.ndarray:
    ring = np.array([[-half_x, -half_y], [half_x, -half_y], [half_x, half_y], [-half_x, half_y]])
    c, s = np.cos(yaw), np.sin(yaw)
    return ring @ np.array([[c, s], [-s, c]]) + [x, y]


def _regular(x: float, y: float, radius: float, sides: int) -> np.ndarray:
    angle = 2.0 * np.pi * (np.arange(sides) + 0.5) / sides
    return np.column_stack([x + radius * np.cos(angle), y + radius * np.sin(angle)])


#: A cart comes towards the robot, a pallet flat against a dock, a person walks by.
MOVERS = (
    Mover(1, "dock", _rectangle(-1.6, 1.2, 0.5, 0.2), (0.0, 0.0)),
    Mover(2, "cart", _rectangle(2.4, 0.5, 0.4, 0.3), (-0.4, 0.0)),
    Mover(3, "pallet", _rectangle(-1.5, -0.6, 0.35, 0.25), (0.0, 0.7)),
    Mover(4, "person", _regular(-0.3, -1.3, 0.25, 12), (0.6, -0.05)),
)

# A mobile robot on an arc: its velocities ahead and about the vertical axis, and its footprint, x ahead.
FOOTPRINT = "footprint"
DRIVE, YAW_RATE = 0.5, 0.5  # [m/s], [rad/s]
FOOTPRINT_RING = _rectangle(0.0, 0.0, 0.5, 0.35)
TURN_CENTER = np.array([0.0, DRIVE / YAW_RATE])  # which it drives around

#: What is called otherwise here than in the scene, by its id there.
NAMES = {mover.id: mover.name for mover in MOVERS}
IN_THE_PLANE = {*NAMES, FOOTPRINT}


def driving(t: float = 0.0) -> np.ndarray:
    """The footprint after `t` seconds."""
    c, s = np.cos(YAW_RATE * t), np.sin(YAW_RATE * t)
    return (FOOTPRINT_RING - TURN_CENTER) @ np.array([[c, s], [-s, c]]) + TURN_CENTER


def footprint() -> gs.SceneObject:
    """The mobile robot: an object turns about the origin of its pose, which is put where the arc has its centre."""
    ring = gs.Polygon(FOOTPRINT_RING - TURN_CENTER)
    return gs.SceneObject(FOOTPRINT, ring, (*TURN_CENTER, 0.0, *UPRIGHT), (0.0, 0.0, 0.0, 0.0, 0.0, YAW_RATE))


def scan() -> np.ndarray:
    """(n, 2) points of a laser scan: a wall, as the robot sees it, to some millimetres."""
    x = np.linspace(-1.9, 2.3, 64)
    return np.column_stack([x, 2.15 + 0.1 * x + 0.004 * np.sin(37.0 * x)])


def robot() -> Robot:
    """The Panda, its collision meshes as convex hulls."""
    root = example_robot_directory()
    panda = root / "robots" / "panda_description"
    return Robot(panda / "urdf" / "panda.urdf", panda / "srdf" / "panda.srdf", mesh_directories=[root.parent])


def furniture() -> list[gs.SceneObject]:
    """Table, floor and what stands on the table; table top at z = 0."""
    legs = [
        gs.SceneObject(f"table_leg/{i}", gs.Box([0.03, 0.03, 0.355]), (x, y, -0.395, *UPRIGHT))
        for i, (x, y) in enumerate([(-0.25, -0.45), (-0.25, 0.45), (0.85, -0.45), (0.85, 0.45)])
    ]
    return [
        gs.SceneObject("floor", gs.HalfSpace([0.0, 0.0, 1.0], -0.75)),
        gs.SceneObject("table", gs.Box([0.6, 0.5, 0.02]), (0.3, 0.0, -0.02, *UPRIGHT)),
        *legs,
        gs.SceneObject("carton", gs.Box([0.1, 0.08, 0.12]), (0.5, 0.33, 0.12, *UPRIGHT)),
        gs.SceneObject("ball", gs.Sphere(0.06), (0.45, -0.3, 0.06, *UPRIGHT)),
        gs.SceneObject("bottle", gs.Capsule(0.035, 0.2), (0.62, 0.02, 0.135, *UPRIGHT)),
        gs.SceneObject(
            OBSTACLE,
            gs.Capsule(0.05, 0.4),
            (*OBSTACLE_START, *LYING),
            twist=(*OBSTACLE_VELOCITY, 0.0, 0.0, 0.0),
        ),
    ]


def allowed_pairs(panda: Robot) -> list[tuple[str, str]]:
    """The robot's disabled pairs, and what is bolted together."""
    legs = [f"table_leg/{i}" for i in range(4)]
    bolted = [("panda_link0", "table"), *((leg, part) for leg in legs for part in ("table", "floor"))]
    return [*panda.allowed_pairs, *bolted]


def camera_frustum() -> gs.Frustum:
    """What the node should make of the camera's message and pose."""
    return gs.Frustum.from_intrinsics(INTRINSICS, WIDTH, HEIGHT, camera_pose(), NEAR, FAR)


def camera_pose() -> np.ndarray:
    """(7,) pose of the camera's optical frame in the world."""
    forward = np.subtract(CAMERA_TARGET, CAMERA_EYE)
    forward = forward / np.linalg.norm(forward)
    right = np.cross(forward, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    down = np.cross(forward, right)
    # Half-angle formulas need only the trace here: the camera is turned by less than 180 degrees.
    m = np.column_stack([right, down, forward])
    w = np.sqrt(max(1.0 + np.trace(m), 0.0)) / 2.0
    v = np.array([m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1]]) / (4.0 * w)
    return np.array([*CAMERA_EYE, *v, w])
