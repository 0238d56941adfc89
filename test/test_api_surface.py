# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""The names users call: signatures, docstrings, stubs of the engine, and life without ROS."""

from __future__ import annotations

import ast
import dataclasses
import inspect
import os
import re
import subprocess
import sys
from collections.abc import Iterator
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import geomsrv as gs
from geomsrv import _core

# Every call a user can make, written as its definition; indented lines continue the one above.
SIGNATURES = """\
Frustum(origin, axes, left=None, up=None, near=None, far=None, *, bounds=None)
Frustum.look_at(eye, target, up, fov_y, aspect, near, far)
Frustum.from_intrinsics(K, width, height, X_world_camera, near, far)
Frustum2D(origin, axes, left=None, near=None, far=None, *, bounds=None)
Boxes(center, axes, half_extents)
Boxes.from_poses(poses, half_extents)
Polygons(vertices, offsets)
Polygons.from_list(items)
Polytopes(vertices, offsets)
Polytopes.from_list(items)
Sphere(radius)
Capsule(radius, length)
Cylinder(radius, length)
Cone(radius, length)
Ellipsoid(radii)
Box(half_extents)
HalfSpace(normal, offset)
Convex(vertices)
Mesh(vertices, triangles)
Triangle(a, b, c)
Segment(a, b)
Point(p)
Polygon(vertices)
Region(outline, holes=())
cull(frustum, boxes, *, accuracy='float64', certificates=False, tolerance=None, time_budget=None)
distance_to_frustum(frustum, points, *, accuracy='float64', want=('distance',), certificates=False,
    tolerance=None, time_budget=None)
first_contact(a, b, velocity_a, velocity_b, *, t_max=inf, accuracy='float64', contact_set=True,
    certificates=False, angular_velocity_a=None, angular_velocity_b=None, center_a=None, center_b=None,
    tolerance=None, time_budget=None)
distance(a, b, poses_ab=None, *, accuracy='float64', want=('distance',),
    certificates=False, tolerance=None, time_budget=None)
intersects(a, b, poses_ab=None, *, accuracy='float64', certificates=False, tolerance=None, time_budget=None)
time_to_collision(footprint, twist, obstacles, *, velocities=None, t_max=inf, tolerance=1e-06)
verify(answer)
verify_record(record)
Scene(*, fixed_frame='world', allowed_pairs=(), transforms=None)
Scene.apply(self, update)
Scene.plan(self)
Scene.forget(self)
""".replace("\n    ", " ").splitlines()

ATTRIBUTES = {
    "Cull": "state certain cost certificates",
    "Distances": "distance lower upper point_a point_b normal status region cost certificates",
    "Booleans": "value certain status cost certificates",
    "FirstContacts": "status time time_lower time_upper last_time normal points point_offsets part_offsets certain "
    "closing_speed cost certificates",
    "CollisionTimes": "status time time_lower time_upper certain first earliest earliest_upper cost",
    "Cost": "elapsed_ns accuracy counts",
    "SceneObject": "id shape pose twist frame",
    "SceneUpdate": "add remove clear",
}

CONSTANTS = {
    "OUTSIDE": 0,
    "INTERSECTS": 1,
    "INSIDE": 2,
    "NEVER": 0,
    "WILL_TOUCH": 1,
    "TOUCHING": 2,
    "OVERLAPPING": 3,
}


def public(module: Any) -> dict[str, Any]:
    """What `import geomsrv` shows: everything without an underscore that is not a module."""
    return {
        name: value for name, value in vars(module).items() if not name.startswith("_") and not inspect.ismodule(value)
    }


def callables() -> Iterator[tuple[str, Any]]:
    """Public functions, classes, and the public methods and properties that classes define themselves."""
    for name, value in public(gs).items():
        if not callable(value):
            continue
        yield name, value
        if inspect.isclass(value):
            for member in {m for base in value.__mro__ if base.__module__.startswith("geomsrv") for m in vars(base)}:
                found = inspect.getattr_static(value, member)
                if not member.startswith("_") and (
                    isinstance(found, (property, classmethod)) or inspect.isroutine(found) or hasattr(found, "func")
                ):
                    yield f"{name}.{member}", getattr(found, "func", None) or getattr(value, member)


CALLABLES = dict(callables())


def resolve(dotted: str) -> Any:
    value: Any = gs
    for part in dotted.split("."):
        value = getattr(value, part)
    return value


@pytest.mark.parametrize("definition", SIGNATURES)
def test_signature(definition: str) -> None:
    name = definition.partition("(")[0]
    signature = inspect.signature(resolve(name))
    bare = [p.replace(annotation=inspect.Parameter.empty) for p in signature.parameters.values()]
    assert f"{name}{inspect.Signature(bare)}" == definition


@pytest.mark.parametrize("answer", ATTRIBUTES)
def test_answers_have_their_fields(answer: str) -> None:
    kind = getattr(gs, answer)
    fields = {field.name for field in dataclasses.fields(kind)}
    for name in ATTRIBUTES[answer].split():
        assert name in fields or isinstance(inspect.getattr_static(kind, name), (property, cached_property)), name


def test_constants() -> None:
    assert {name: int(getattr(gs, name)) for name in CONSTANTS} == CONSTANTS
    assert len(gs.FrustumRegion) == 27 and gs.FrustumRegion.INSIDE == 0
    for region in gs.FrustumRegion:
        depth, height, side = region // 9, region // 3 % 3, region % 3
        parts = [("", "NEAR", "FAR")[depth], ("", "LEFT", "RIGHT")[side], ("", "UP", "DOWN")[height]]
        assert region.name == ("_".join(part for part in parts if part) or "INSIDE")


def test_errors_are_value_errors() -> None:
    assert issubclass(gs.GeometryError, ValueError) and issubclass(gs.SceneError, gs.GeometryError)
    assert issubclass(gs.NotAvailableError, (gs.GeometryError, NotImplementedError))
    assert issubclass(gs.CertificateError, ValueError)


def test_everything_public_is_ours_and_listed_by_its_module() -> None:
    for name, value in public(gs).items():
        module = sys.modules[getattr(value, "__module__", "geomsrv.answers")]
        assert module.__name__.startswith("geomsrv."), name
        if callable(value):
            assert name in module.__all__, f"{name} is missing in {module.__name__}.__all__"


# ------------------------------------------------------------------------------------------------ docstrings


def sections(text: str) -> dict[str, str]:
    """numpydoc sections by title."""
    parts = re.split(r"^([A-Z][A-Za-z ]+)\n-{3,}\n", text, flags=re.M)
    return dict(zip(parts[1::2], parts[2::2], strict=True))


@pytest.mark.parametrize("name", CALLABLES)
def test_docstring(name: str) -> None:
    value = CALLABLES[name]
    text = inspect.getdoc(value)
    assert text, f"{name} has no docstring"
    summary = text.split("\n")[0]
    assert summary.rstrip().endswith((".", ":")), f"{name}: {summary!r} is no sentence"
    for title, body in sections(text).items():
        assert title in {
            "Parameters",
            "Attributes",
            "Returns",
            "Raises",
            "References",
            "Examples",
            "Notes",
        }, title
        assert body.strip(), f"{name}: {title} is empty"


@pytest.mark.parametrize("definition", [line for line in SIGNATURES if not line.startswith("Scene.")])
def test_docstring_explains_every_parameter(definition: str) -> None:
    value = resolve(definition.partition("(")[0])
    text = inspect.getdoc(value) or ""
    found = sections(text)
    for parameter in inspect.signature(value).parameters:
        where = found.get("Parameters", text)
        assert re.search(rf"\b{parameter}\b", where), f"{definition}: {parameter} is not explained"


@pytest.mark.parametrize("query", ["cull", "distance", "distance_to_frustum", "first_contact", "intersects"])
def test_query_docstring_is_complete(query: str) -> None:
    found = sections(inspect.getdoc(getattr(gs, query)) or "")
    assert {"Parameters", "Returns", "Raises", "Examples"} <= set(found)
    assert ">>> " in found["Examples"]


@pytest.mark.parametrize("answer", ATTRIBUTES)
def test_answer_docstring_explains_every_field(answer: str) -> None:
    kind = getattr(gs, answer)
    body = sections(inspect.getdoc(kind) or "")["Attributes"]
    for field in dataclasses.fields(kind):
        if not field.name.startswith("_"):
            assert re.search(rf"\b{field.name}\b", body), f"{answer}.{field.name} is not explained"


# ------------------------------------------------------------------------------------------- engine and stub

DTYPES = {
    "_F": "float64",
    "_I": "int64",
    "_U": "uint8",
    "_B": "bool",
    "_F | None": "float64 | None",
    "tuple[_F | _I, ...]": "tuple",
}


def stub_functions() -> dict[str, list[tuple[str, str]]]:
    """(name, type) of the parameters of every function in the installed stub."""
    stub = Path(_core.__file__).with_name("_core.pyi")
    tree = ast.parse(stub.read_text(encoding="utf-8"))
    return {
        node.name: [(a.arg, ast.unparse(a.annotation or ast.Constant(None))) for a in node.args.args]
        for node in tree.body
        if isinstance(node, ast.FunctionDef)
    }


def compiled_functions() -> dict[str, list[tuple[str, str]]]:
    """The same from the compiled module's own signatures; arrays are given by their dtype."""
    functions = {}
    for name, function in vars(_core).items():
        if name.startswith("_") or not callable(function):
            continue
        ((signature, *_),) = function.__nb_signature__
        # "ndarray[dtype=float64, shape=(*, 3), ...]" is no Python; its dtype is all that matters here.
        readable = re.sub(r"ndarray\[dtype=(\w+)[^\]]*\]", r"\1", signature)
        readable = re.sub(r"\\\d+", "...", readable)  # defaults are numbered
        definition = ast.parse(f"{readable}: ...").body[0]
        assert isinstance(definition, ast.FunctionDef)
        functions[name] = [(a.arg, ast.unparse(a.annotation or ast.Constant(None))) for a in definition.args.args]
    return functions


def test_stub_agrees_with_the_engine() -> None:
    stub = {
        name: [(argument, DTYPES.get(kind, kind)) for argument, kind in parameters]
        for name, parameters in stub_functions().items()
    }
    assert stub == compiled_functions()
    assert len(stub) >= 10


def array_arguments(signature: str) -> list[np.ndarray]:
    """An array of the dtype and number of axes that each array parameter asks for; where it takes any, a matrix."""
    found = re.findall(r"ndarray\[dtype=(\w+)(?:, shape=\(([^)]*)\))?", signature)
    sizes = [(shape or "3, 3").replace(" ", "").split(",") for _, shape in found]
    shapes = [[4 if size == "*" else int(size) for size in shape] for shape in sizes]
    return [np.zeros(shape, dtype) for (dtype, _), shape in zip(found, shapes, strict=True)]


@pytest.mark.parametrize(
    "name", [name for name in stub_functions() if "_world" not in name and not name.endswith("_turning")]
)
def test_engine_refuses_what_it_would_have_to_copy(name: str) -> None:
    """Another dtype or layout means that the edge was bypassed: a TypeError, never a silent copy."""
    function = getattr(_core, name)
    arrays = array_arguments(function.__nb_signature__[0][0])
    plain = {"float": 0.0, "bool": True, "str": "float64"}
    rest = [plain[kind] for _, kind in stub_functions()[name] if kind in plain]
    assert len(arrays) + len(rest) == len(stub_functions()[name])
    for i, array in enumerate(arrays):
        others = [array.astype(np.float32), np.repeat(array, 2, axis=0)[::2]]
        for other in others:
            with pytest.raises(TypeError, match="incompatible function arguments"):
                function(*arrays[:i], other, *arrays[i + 1 :], *rest)


@pytest.mark.parametrize("name", ["distance_world", "distance_world_stages"])
def test_engine_refuses_sides_that_it_would_have_to_copy(name: str) -> None:
    """A batch is a tuple of arrays there."""
    sides = {
        "boxes": (np.zeros((2, 3)), np.zeros((2, 3, 3)), np.zeros((2, 3))),
        "polytopes": (np.zeros((2, 3)), np.array([0, 1, 2])),
        "frustum": (gs.Frustum([0, 0, 0], np.eye(3), 1.0, 1.0, 1.0, 2.0).packed(),),
    }
    function = getattr(_core, name)
    for side in sides.values():
        function(side, side, True)
        for i, array in enumerate(side):
            for other in (array.astype(np.float32), np.repeat(array, 2, axis=0)[::2], array[..., None], None):
                with pytest.raises(TypeError, match="distance: a side must be"):
                    function((*side[:i], other, *side[i + 1 :]), sides["boxes"], True)
    for side in ((), sides["boxes"] * 2):
        with pytest.raises(TypeError, match="distance: a side must be"):
            function(sides["boxes"], side, True)


def test_engine_refuses_moving_sides_that_it_would_have_to_copy() -> None:
    boxes = (np.zeros((2, 3)), np.zeros((2, 3, 3)), np.zeros((2, 3)))
    polytopes = (np.zeros((2, 3)), np.array([0, 1, 2]))
    rest = (np.zeros((1, 3)), np.zeros((1, 3)), 1.0, True)
    for side in (boxes, polytopes):
        _core.first_contact_world(side, boxes, *rest)
        for i, array in enumerate(side):
            for other in (array.astype(np.float32), np.repeat(array, 2, axis=0)[::2], array[..., None], None):
                with pytest.raises(TypeError, match="first_contact: a side must be"):
                    _core.first_contact_world((*side[:i], other, *side[i + 1 :]), boxes, *rest)
    for side in ((), boxes * 2):
        with pytest.raises(TypeError, match="first_contact: a side must be"):
            _core.first_contact_world(boxes, side, *rest)
    with pytest.raises(ValueError, match="first_contact: no such accuracy"):
        _core.first_contact_world(boxes, boxes, *rest, "float32")
    with pytest.raises(TypeError, match="incompatible function arguments"):
        _core.first_contact_world(boxes, boxes, rest[0].astype(np.float32), *rest[1:])


# --------------------------------------------------------------------------------------------- without ROS

WITHOUT_ROS = """
import sys

class Wall:
    def find_spec(self, name, path=None, target=None):
        if name.endswith("_msgs") or name in ("rclpy", "fcl", "geomsrv.msg", "geomsrv.srv"):
            raise ImportError(name)

sys.meta_path.insert(0, Wall())
import geomsrv as gs
import geomsrv.scene
view = gs.Frustum([0, 0, 0], [[1, 0, 0], [0, 1, 0], [0, 0, 1]], 1, 1, 1, 9)
assert gs.cull(view, gs.Boxes.from_poses([[0, 0, 5, 0, 0, 0, 1]], [1, 1, 1])).state == gs.INSIDE
try:
    import rclpy
except ImportError:
    print("alone")
"""


def test_import_needs_no_ros(tmp_path: Path) -> None:
    result = subprocess.run(
        [sys.executable, "-c", WITHOUT_ROS],
        cwd=tmp_path,
        env=os.environ,
        capture_output=True,
        text=True,
        timeout=60,
    )
    assert result.stdout == "alone\n", result.stderr


def test_import_pulls_in_numpy_only(tmp_path: Path) -> None:
    """`import geomsrv` is what every user pays for; peers and plotting are imported on use."""
    program = "import sys, geomsrv; print(*{name.partition('.')[0] for name in sys.modules})"
    result = subprocess.run(
        [sys.executable, "-c", program],
        cwd=tmp_path,
        env=os.environ,
        capture_output=True,
        text=True,
        timeout=60,
    )
    loaded = set(result.stdout.split())
    assert {"geomsrv", "numpy"} <= loaded, result.stderr
    assert not loaded & {"rclpy", "fcl", "coal", "scipy", "trimesh", "yourdfpy", "matplotlib", "rich"}
