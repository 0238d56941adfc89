# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""Starts the node with the parameters of config/geomsrv.yaml, or of another file.

ros2 launch geomsrv geomsrv.launch.py params_file:=mine.yaml
"""

from pathlib import Path

from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import LifecycleNode

from launch import LaunchDescription

DEFAULT_PARAMETERS = Path(__file__).resolve().parent.parent / "config" / "geomsrv.yaml"


def generate_launch_description() -> LaunchDescription:
    """The node; it activates itself unless the parameter autostart says no."""
    return LaunchDescription(
        [
            DeclareLaunchArgument("params_file", default_value=str(DEFAULT_PARAMETERS)),
            DeclareLaunchArgument("namespace", default_value=""),
            LifecycleNode(
                package="geomsrv",
                executable="node",
                name="geomsrv",
                namespace=LaunchConfiguration("namespace"),
                parameters=[LaunchConfiguration("params_file")],
                output="screen",
            ),
        ]
    )
