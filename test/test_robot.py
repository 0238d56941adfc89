# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""Real robots as scene objects: where their links are, and where they go."""

import numpy as np
import pytest

import geomsrv as gs
from geomsrv._validate import rotation_matrices
from geomsrv.robot import Robot, example_robot_directory
from geomsrv.shapes import vertices_of

JOINTS = {
    "panda_joint1": 0.1,
    "panda_joint2": 0.4,
    "panda_joint4": -2.0,
    "panda_joint6": 2.2,
    "panda_finger_joint1": 0.02,
}

#: How many geometries a joint moves: links 1 to 7, hand, and two fingers of four boxes each.
MOVED = {"panda_joint1": 16, "panda_joint4": 13, "panda_joint6": 11, "panda_finger_joint1": 8}


@pytest.fixture(scope="module")
def panda():
    root = example_robot_directory()
    folder = root / "robots" / "panda_description"
    return Robot(folder / "urdf" / "panda.urdf", folder / "srdf" / "panda.srdf", mesh_directories=[root.parent])


def points_of(item, t=0.0):
    """Vertices in the world after `t` seconds of its twist, as a scene moves it."""
    vertices = vertices_of(item.shape)
    turn = rotation_matrices(np.asarray(item.pose, float)[None, 3:])[0]
    angular = np.asarray(item.twist[3:], float)
    angle, half = np.linalg.norm(angular) * t, np.zeros(4)
    half[3] = 1.0
    if angle:
        half = np.concatenate([np.sin(angle / 2) * angular / np.linalg.norm(angular), [np.cos(angle / 2)]])
    spun = rotation_matrices(half[None])[0] @ turn
    return vertices @ spun.T + item.pose[:3] + t * np.asarray(item.twist[:3])


def base():
    """Somewhere, turned about an axis of no joint."""
    turn = rotation_matrices(np.array([[0.2, -0.4, 0.4, 0.8]]))[0]
    return np.block([[turn, np.array([[0.3], [-1.0], [2.0]])], [np.zeros((1, 3)), np.ones((1, 1))]])


@pytest.mark.parametrize("joint", ["panda_joint1", "panda_joint4", "panda_joint6", "panda_finger_joint1"])
def test_one_joint_moves_as_the_robot_does(panda, joint):
    """For good, not only to first order: the links turn about the joint's axis; mimicking joints follow."""
    rate, t = 0.7, 0.9
    now = panda.objects(JOINTS, velocities={joint: rate}, base=base())
    then = panda.objects(JOINTS | {joint: JOINTS.get(joint, 0.0) + rate * t}, base=base())
    moved = 0
    for before, after in zip(now, then, strict=True):
        np.testing.assert_allclose(points_of(before, t), points_of(after), atol=1e-12)
        moved += any(before.twist)
    assert moved == MOVED[joint]


def test_several_joints_move_to_first_order(panda):
    rates, t = {"panda_joint1": 0.5, "panda_joint4": -0.8, "panda_joint6": 1.1}, 1e-5
    now = panda.objects(JOINTS, velocities=rates)
    then = panda.objects({**JOINTS, **{name: JOINTS[name] + rate * t for name, rate in rates.items()}})
    for before, after in zip(now, then, strict=True):
        np.testing.assert_allclose(points_of(before, t), points_of(after), atol=1e-9)


def test_at_rest_nothing_changes(panda):
    for plain, resting in zip(
        panda.objects(JOINTS), panda.objects(JOINTS, velocities={"panda_joint1": 0.0}), strict=True
    ):
        assert plain.shape is resting.shape and not any(resting.twist)
        np.testing.assert_array_equal(plain.pose, resting.pose)


@pytest.mark.parametrize("argument", ["joints", "velocities"])
def test_unknown_joint_is_named(panda, argument):
    given = {"joints": JOINTS, argument: {"elbow": 1.0}}
    with pytest.raises(gs.GeometryError, match=f"{argument}: unknown joint 'elbow'; the robot has panda_joint1"):
        panda.objects(**given)
