# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""Lets pip run the same CMake as every other build and package what it installs.

Under build isolation that is the core. Messages and node are added where the ROS generators can be
imported, which takes `pip install --no-build-isolation .` in an environment that has them.
"""

import importlib.util
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

from setuptools import Extension, setup
from setuptools.command.build_ext import build_ext

ROOT = Path(__file__).resolve().parent


class CMakeBuild(build_ext):
    """Configure, build and install into a staging directory; hand its contents to setuptools."""

    def run(self):
        build = Path(self.build_temp).resolve() / "cmake"
        staging = Path(self.build_temp).resolve() / "staging"
        with_ros = importlib.util.find_spec("rosidl_generator_py") is not None
        shutil.rmtree(staging, ignore_errors=True)

        configure = ["cmake", "-G", "Ninja", "-S", ROOT, "-B", build, "--fresh"]
        configure += [f"-DPython3_EXECUTABLE={sys.executable}", f"-DCMAKE_INSTALL_PREFIX={sys.prefix}"]
        configure += ["-DPYTHON_INSTALL_DIR=python", f"-DGEOMSRV_ROS={'ON' if with_ros else 'OFF'}"]
        environment = dict(os.environ)
        if with_ros:
            configure += [f"-DCMAKE_PREFIX_PATH={sys.prefix}"]
            environment["AMENT_PREFIX_PATH"] = os.pathsep.join(
                filter(None, [sys.prefix, os.environ.get("AMENT_PREFIX_PATH")])
            )
        subprocess.run(configure, check=True, env=environment)
        subprocess.run(["cmake", "--build", build], check=True, env=environment)
        subprocess.run(["cmake", "--install", build, "--prefix", staging], check=True, env=environment)

        shutil.copytree(staging / "python", self.build_lib, dirs_exist_ok=True)
        for path in sorted(staging.rglob("*")):
            place = path.relative_to(staging)
            if path.is_file() and place.parts[0] not in ("python", "bin"):
                self.distribution.data_files.append((str(place.parent), [str(path)]))


setup(
    version=re.search("<version>(.+)</version>", (ROOT / "package.xml").read_text())[1],
    packages=[],
    data_files=[],
    ext_modules=[Extension("geomsrv._core", sources=[])],
    cmdclass={"build_ext": CMakeBuild},
)
