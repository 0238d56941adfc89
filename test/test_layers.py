# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""Imports and includes point down only.  Sources are parsed, nothing is imported."""

from __future__ import annotations

import ast
import re
import sys
from collections.abc import Iterator
from fnmatch import fnmatch
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]

ROS = (
    "rclpy",
    "*_msgs",
    "std_srvs",
    "builtin_interfaces",
    "rcl_interfaces",
    "geomsrv.msg",
    "geomsrv.srv",
    "tf2_ros",
    "tf2_py",
)

# Top to bottom.  A file belongs to the layer that names it, and `geomsrv/*.py` takes the rest.  It may import
# from its own layer and the ones below, from the standard library, and from the packages in the last column.
PYTHON_LAYERS = {
    "entry": ("geomsrv/cli.py geomsrv/demo.py geomsrv/__main__.py", ()),
    "node": ("geomsrv/ros/node.py", ("numpy", *ROS)),
    "ros": ("geomsrv/ros/*.py", ("numpy",)),
    "package": ("geomsrv/__init__.py", ()),
    "scene": ("geomsrv/*.py", ("numpy",)),
    "query": (
        "geomsrv/queries.py geomsrv/ladder.py geomsrv/turning.py geomsrv/footprint.py "
        "geomsrv/region.py geomsrv/region_contact.py geomsrv/mesh.py geomsrv/mesh_contact.py geomsrv/mesh_tree.py "
        "geomsrv/mesh_shared.py geomsrv/shapes.py "
        "geomsrv/answers.py geomsrv/_validate.py geomsrv/errors.py "
        "geomsrv/certificates.py geomsrv/evidence.py geomsrv/verify.py geomsrv/_version.py",
        ("numpy",),
    ),
    "engine": ("geomsrv/_core.pyi", ("numpy",)),
}

# Optional peers, imported on use.  "*" marks a file that may choose the module's name at run time.
OPTIONAL = {
    "geomsrv/_price_peers.py": ("coal", "fcl"),
    "geomsrv/_price_report.py": ("PIL", "matplotlib", "rich"),
    "geomsrv/fcl_worker.py": ("coal", "fcl"),
    "geomsrv/robot.py": ("*",),
}

# The C++ includes: its own directories by their path from src, the standard library by names without a dot.
CPP_LAYERS = {
    "src/bind/*": ("bind/*", "geom/*", "nanobind/*", "sys/mman.h"),
    "src/geom/*": ("geom/*", "boost/multiprecision/cpp_int.hpp"),
}
VECTOR_INTRINSICS = ("immintrin.h",)
INPUT_OUTPUT = ("cstdio", "fstream", "filesystem", "iostream", "istream", "ostream", "print", "syncstream")


def layer_of(path: str) -> str:
    """Name of the layer a file belongs to; a name in full goes before a pattern."""
    for exact in (True, False):
        for layer, (files, _) in PYTHON_LAYERS.items():
            for pattern in files.split():
                # `*` must not cross a slash: geomsrv/*.py is not geomsrv/ros/x.py.
                same_depth = pattern.count("/") == path.count("/")
                if path == pattern if exact else same_depth and fnmatch(path, pattern):
                    return layer
    raise LookupError(f"{path} is in no layer")


def imported(tree: ast.AST, package: str) -> Iterator[tuple[int, str]]:
    """(line, absolute dotted name) of all imports, in functions too; "*" for a name made up at run time."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from ((node.lineno, alias.name) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            base = node.module or ""
            if node.level:
                parent = package.rsplit(".", node.level - 1)[0] if node.level > 1 else package
                base = f"{parent}.{base}".rstrip(".")
            yield from ((node.lineno, f"{base}.{alias.name}") for alias in node.names)
        elif isinstance(node, ast.Call):
            called = node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")
            if called in ("import_module", "__import__"):
                name = node.args[0] if node.args else None
                literal = isinstance(name, ast.Constant) and isinstance(name.value, str)
                yield node.lineno, name.value if literal else "*"  # type: ignore[union-attr,misc]


def own_file(name: str, files: frozenset[str]) -> str | None:
    """The source file behind a dotted name of ours: geomsrv.scene.Scene -> geomsrv/scene.py."""
    parts = name.split(".")
    for k in range(len(parts), 0, -1):
        stem = "/".join(parts[:k])
        for candidate in (f"{stem}.py", f"{stem}/__init__.py", f"{stem}.pyi"):
            if candidate in files:
                return candidate
    return None


def python_violations(path: str, source: str, files: frozenset[str]) -> list[str]:
    """What a Python file imports although its layer may not."""
    layer = layer_of(path)
    order = list(PYTHON_LAYERS)
    allowed = (*PYTHON_LAYERS[layer][1], *OPTIONAL.get(path, ()))
    package = path.rpartition("/")[0].replace("/", ".")
    found = []
    for line, name in imported(ast.parse(source), package):
        top = name.partition(".")[0]
        if any(name == pattern or fnmatch(top, pattern) or name.startswith(f"{pattern}.") for pattern in allowed):
            continue
        if name != "*" and top in sys.stdlib_module_names:
            continue
        target = own_file(name, files) if top == "geomsrv" else None
        is_message = name.startswith(("geomsrv.msg", "geomsrv.srv"))
        if target and not is_message and order.index(layer_of(target)) >= order.index(layer):
            continue
        found.append(f"{path}:{line}: layer {layer} may not import {name}")
    return found


def include_violations(path: str, source: str) -> list[str]:
    """What a C++ file includes although its directory may not."""
    allowed = next(names for pattern, names in CPP_LAYERS.items() if fnmatch(path, pattern))
    found = []
    for line, text in enumerate(source.splitlines(), 1):
        match = re.match(r"\s*#\s*include\s*(.*?)\s*(?://.*)?$", text)
        if not match:
            continue
        name = match[1].strip('<>"')
        standard = match[1].startswith("<") and re.fullmatch(r"[a-z_0-9]+", name) is not None
        fine = standard or any(fnmatch(name, pattern) for pattern in allowed) or name in VECTOR_INTRINSICS
        if not fine or (name in INPUT_OUTPUT and path.startswith("src/geom/")):
            found.append(f"{path}:{line}: may not include {match[1]}")
    return found


def sources(pattern: str) -> list[str]:
    return sorted(str(file.relative_to(ROOT)) for file in ROOT.glob(pattern))


PYTHON_FILES = frozenset(sources("geomsrv/**/*.py") + sources("geomsrv/*.pyi"))
CPP_FILES = sources("src/**/*.[ch]pp")


def test_python_imports_point_down() -> None:
    assert {"geomsrv/queries.py", "geomsrv/shapes.py", "geomsrv/__init__.py"} <= PYTHON_FILES
    found = [
        v for path in sorted(PYTHON_FILES) for v in python_violations(path, (ROOT / path).read_text(), PYTHON_FILES)
    ]
    assert not found, "\n".join(found)


def test_cpp_includes_point_down() -> None:
    assert {"src/geom/vec.hpp", "src/bind/module.cpp"} <= set(CPP_FILES)
    found = [v for path in CPP_FILES for v in include_violations(path, (ROOT / path).read_text())]
    assert not found, "\n".join(found)


def test_every_file_has_a_layer() -> None:
    layers = {path: layer_of(path) for path in PYTHON_FILES}
    assert layers["geomsrv/shapes.py"] == "query" and layers["geomsrv/_core.pyi"] == "engine"
    assert all(any(fnmatch(path, pattern) for pattern in CPP_LAYERS) for path in CPP_FILES)
    with pytest.raises(LookupError, match="no layer"):
        layer_of("geomsrv/extra/new.py")


# ------------------------------------------------------------------------------------ the checker can say no

TREE = frozenset(
    f"geomsrv/{name}"
    for name in (
        *("__init__.py", "_core.pyi", "cli.py", "errors.py", "queries.py", "scene.py", "shapes.py"),
        *("ros/__init__.py", "ros/convert.py", "ros/handlers.py", "ros/node.py", "robot.py", "fcl_worker.py"),
    )
)


@pytest.mark.parametrize(
    ("path", "source", "name"),
    [
        ("geomsrv/ros/convert.py", "import rclpy", "rclpy"),
        ("geomsrv/ros/convert.py", "def f():\n    from rclpy.node import Node", "rclpy.node.Node"),
        ("geomsrv/ros/handlers.py", "from geomsrv.msg import Shape", "geomsrv.msg.Shape"),
        ("geomsrv/ros/handlers.py", "from geomsrv import srv", "geomsrv.srv"),
        ("geomsrv/ros/handlers.py", "from geometry_msgs.msg import Pose", "geometry_msgs.msg.Pose"),
        ("geomsrv/ros/handlers.py", "from . import node", "geomsrv.ros.node"),
        ("geomsrv/ros/handlers.py", "from .node import Node", "geomsrv.ros.node.Node"),
        ("geomsrv/ros/handlers.py", "import importlib\nimportlib.import_module('rclpy')", "rclpy"),
        ("geomsrv/cli.py", "import rclpy", "rclpy"),
        ("geomsrv/scene.py", "from geomsrv.ros import convert", "geomsrv.ros.convert"),
        ("geomsrv/scene.py", "from geomsrv.ros.convert import f", "geomsrv.ros.convert.f"),
        ("geomsrv/scene.py", "from .ros import convert", "geomsrv.ros.convert"),
        ("geomsrv/scene.py", "import geomsrv as gs", "geomsrv"),
        ("geomsrv/scene.py", "from geomsrv import Boxes", "geomsrv.Boxes"),
        ("geomsrv/scene.py", "import scipy", "scipy"),
        ("geomsrv/scene.py", "import fcl", "fcl"),
        ("geomsrv/scene.py", "__import__(name)", "*"),
        ("geomsrv/shapes.py", "from geomsrv.scene import Scene", "geomsrv.scene.Scene"),
        ("geomsrv/shapes.py", "if TYPE_CHECKING:\n    from geomsrv import scene", "geomsrv.scene"),
        ("geomsrv/queries.py", "from geomsrv import cli", "geomsrv.cli"),
        ("geomsrv/__init__.py", "from geomsrv.ros.convert import f", "geomsrv.ros.convert.f"),
        ("geomsrv/ros/node.py", "import tf2_geometry_msgs_extra", "tf2_geometry_msgs_extra"),
    ],
)  # fmt: skip
def test_checker_finds_a_python_violation(path: str, source: str, name: str) -> None:
    found = python_violations(path, source, TREE)
    assert len(found) == 1 and found[0].endswith(f" may not import {name}"), found


@pytest.mark.parametrize(
    ("path", "source"),
    [
        (
            "geomsrv/ros/node.py",
            "import rclpy.node\nfrom geomsrv import msg\nfrom std_srvs.srv import Trigger",
        ),
        ("geomsrv/ros/node.py", "from lifecycle_msgs.msg import State\nfrom geomsrv.ros import handlers"),
        (
            "geomsrv/ros/handlers.py",
            "import geomsrv as gs\nfrom geomsrv.scene import Scene\nfrom .convert import f",
        ),
        ("geomsrv/cli.py", "def f():\n    from geomsrv.ros import node"),
        (
            "geomsrv/scene.py",
            "from geomsrv import _core\nimport numpy.linalg\nfrom geomsrv.queries import distance",
        ),
        (
            "geomsrv/shapes.py",
            "import numpy as np\nimport dataclasses, math\nfrom geomsrv.errors import GeometryError",
        ),
        ("geomsrv/robot.py", "import importlib\nimportlib.import_module(name)"),
        ("geomsrv/fcl_worker.py", "import fcl"),
    ],
)
def test_checker_accepts_what_points_down(path: str, source: str) -> None:
    assert python_violations(path, source, TREE) == []


@pytest.mark.parametrize(
    ("path", "line"),
    [
        ("src/geom/a.cpp", "#include <Python.h>"),
        ("src/geom/a.cpp", "#include <nanobind/nanobind.h>"),
        ("src/geom/a.hpp", '#  include "bind/arrays.hpp"  // shared'),
        ("src/geom/a.hpp", '#include "../bind/arrays.hpp"'),
        ("src/geom/a.hpp", '#include "vec.hpp"'),
        ("src/geom/a.cpp", "#include <iostream>"),
        ("src/geom/a.cpp", "#include <rclcpp/rclcpp.hpp>"),
        ("src/geom/a.cpp", "#include <unistd.h>"),
        ("src/bind/a.cpp", "#include <Python.h>"),
        ("src/bind/a.cpp", "#include <pybind11/pybind11.h>"),
        ("src/bind/a.cpp", "#include HEADER"),
    ],
)
def test_checker_finds_an_include_violation(path: str, line: str) -> None:
    assert include_violations(path, f"#pragma once\n{line}\n")[0].startswith(f"{path}:2: may not include ")


def test_checker_accepts_includes_that_point_down() -> None:
    assert include_violations("src/geom/a.cpp", '#include <cmath>\n#include "geom/vec.hpp"\n') == []
    assert include_violations("src/bind/a.cpp", '#include <nanobind/ndarray.h>\n#include "geom/vec.hpp"\n') == []
