# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""Built-in hard cases: whether this build answers them, on this machine, as exact arithmetic does.

Takes a few milliseconds, so that a robot can ask before it moves.
"""

from __future__ import annotations

import math
import time
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from geomsrv._selfcheck_cases import CASES
from geomsrv.answers import ContactStatus, CullState, Distances
from geomsrv.queries import cull, distance, distance_to_frustum, first_contact
from geomsrv.scene import Scene, SceneObject, SceneUpdate
from geomsrv.shapes import Box, Boxes, Frustum, Mesh, Polygon, Polygons, Sphere

__all__ = ["Check", "SelfCheck", "cases", "self_check"]

FloatArray = NDArray[np.float64]
Numbers = dict[str, FloatArray]

# A distance may be off by this share of the extent of the scene, a time by this share of itself: the hard cases are
# decided by margins down to 1e-12, and 2^-40 is 9e-13.
SHARE = 2.0**-40


@dataclass(frozen=True)
class Check:
    """One case and how it went.

    Attributes
    ----------
    name : str
        The query, and what is hard about the case.
    ok : bool
    detail : str
        What was wrong; empty if nothing was.
    """

    name: str
    ok: bool
    detail: str = ""


@dataclass(frozen=True)
class SelfCheck:
    """Outcome of `self_check`; iterates over its checks.

    Attributes
    ----------
    checks : tuple of Check
    elapsed_ns : int
    """

    checks: tuple[Check, ...]
    elapsed_ns: int

    def __iter__(self) -> Iterator[Check]:
        return iter(self.checks)

    def __len__(self) -> int:
        return len(self.checks)

    @property
    def failed(self) -> tuple[Check, ...]:
        """The checks that went wrong."""
        return tuple(check for check in self.checks if not check.ok)

    @property
    def ok(self) -> bool:
        """Whether every check passed."""
        return not self.failed

    @property
    def message(self) -> str:
        """One line if all is well, otherwise one more for each failure."""
        head = f"{len(self) - len(self.failed)} of {len(self)} checks passed in {self.elapsed_ns / 1e6:.1f} ms"
        return "\n".join([head, *(f"FAILED {check.name}: {check.detail}" for check in self.failed)])


def self_check() -> SelfCheck:
    """Answer the built-in hard cases and compare with their exact answers.

    Returns
    -------
    SelfCheck
        Never raises: a check that ends in an exception has failed, and says which.

    Examples
    --------
    >>> from geomsrv.selfcheck import self_check
    >>> self_check().ok
    True
    """
    start = time.perf_counter_ns()
    checks = [_outcome(f"{query}: {name}", partial(_QUERIES[query], case)) for query, name, case in cases()]
    checks += [_outcome(f"scene: {name}", run) for name, run in _SCENES.items()]
    return SelfCheck(tuple(checks), time.perf_counter_ns() - start)


def _outcome(name: str, run: Callable[[], str]) -> Check:
    try:
        detail = run()
    except Exception as error:  # noqa: BLE001  a check must not take its caller down
        detail = f"{type(error).__name__}: {error}"
    return Check(name, not detail, detail)


def cases() -> Iterator[tuple[str, str, Numbers]]:
    """Query, name and numbers of every case; what is hard about several cases is numbered."""
    query = name = ""
    case: Numbers = {}
    seen: Counter[str] = Counter()
    for line in [*CASES.replace("\n    ", " ").split("\n"), "end: "]:
        if line.startswith("  "):
            field, *numbers = line.split()
            case[field] = np.array([float.fromhex(number) for number in numbers])
        elif line:
            if case:
                yield query, name, case
            query, _, name = line.partition(": ")
            seen[line] += 1
            name += f" ({seen[line]})" if seen[line] > 1 else ""
            case = {}


# ------------------------------------------------------------------------------------------------------- queries


def _cull(case: Numbers) -> str:
    state = int(cull(_frustum(case), _boxes(case["box"])).state[0])
    met = state != CullState.OUTSIDE
    return "" if met == bool(case["meets"][0]) else f"answers {CullState(state).name}"


def _distance_to_frustum(case: Numbers) -> str:
    return _measured(case, distance_to_frustum(_frustum(case), case["point"][None]))


def _distance_boxes(case: Numbers) -> str:
    return _measured(case, distance(_boxes(case["box_a"]), _boxes(case["box_b"])))


def _distance_polygons(case: Numbers) -> str:
    return _measured(case, distance(_polygons(case["polygon_a"]), _polygons(case["polygon_b"])))


def _measured(case: Numbers, answer: Distances) -> str:
    """Whether a distance is near the exact one and its interval holds it."""
    exact, got = float(case["distance"][0]), float(answer.distance[0])
    lower, upper = float(answer.lower[0]), float(answer.upper[0])
    text = f"distance {got!r} in [{lower!r}, {upper!r}], should be {exact!r}"
    # The exact answer was rounded once.
    if not lower <= np.nextafter(exact, np.inf) or not upper >= np.nextafter(exact, -np.inf):
        return text
    return "" if abs(got - exact) <= SHARE * float(case["size"][0]) else text


def _first_contact(case: Numbers) -> str:
    answer = first_contact(
        _polygons(case["polygon_a"]),
        _polygons(case["polygon_b"]),
        case["velocity_a"],
        case["velocity_b"],
        t_max=float(case["t_max"][0]),
    )
    status = ContactStatus(int(answer.status[0]))
    if "never" in case or status == ContactStatus.NEVER:
        return "" if "never" in case and status == ContactStatus.NEVER else f"answers {status.name}"
    exact, got = float(case["time"][0]), float(answer.time[0])
    lower, upper = float(answer.time_lower[0]), float(answer.time_upper[0])
    held = lower <= np.nextafter(exact, np.inf) and upper >= np.nextafter(exact, -np.inf)
    if not held or not abs(got - exact) <= SHARE * exact:
        return f"time {got!r} in [{lower!r}, {upper!r}], should be {exact!r}"
    return _same_points(case, answer.points) if "contact" in case else ""


def _same_points(case: Numbers, points: FloatArray) -> str:
    """Whether two contact sets have the same points, in whatever order."""
    exact, slack = case["contact"].reshape(-1, 2), SHARE * float(case["size"][0])
    near = np.abs(exact[:, None] - points[None]).max(axis=2) <= slack
    same = len(points) > 0 and near.any(axis=0).all() and near.any(axis=1).all()
    return "" if same else f"contact set {points.tolist()}, should be {exact.tolist()}"


def _frustum(case: Numbers) -> Frustum:
    origin, axes, (left, up, near, far) = np.split(case["frustum"], [3, 12])
    return Frustum(origin, axes.reshape(3, 3), left, up, near, far)


def _boxes(numbers: FloatArray) -> Boxes:
    center, axes, half = np.split(numbers, [3, 12])
    return Boxes(center[None], axes.reshape(1, 3, 3), half[None])


def _polygons(numbers: FloatArray) -> Polygons:
    vertices = numbers.reshape(-1, 2)
    return Polygons(vertices, [0, len(vertices)])


_QUERIES: dict[str, Callable[[Numbers], str]] = {
    "cull": _cull,
    "distance_to_frustum": _distance_to_frustum,
    "distance_boxes": _distance_boxes,
    "distance_polygons": _distance_polygons,
    "first_contact": _first_contact,
}


# -------------------------------------------------------------------------------------------------------- scenes


def _touching_row() -> str:
    """Sixteen unit boxes in a row, neighbours touching: 15 contacts of depth 0, out of 120 pairs."""
    boxes = [SceneObject(f"{k:02}", Box([0.5, 0.5, 0.5]), (k, 0, 0, 0, 0, 0, 1)) for k in range(16)]
    scene = Scene()
    scene.apply(SceneUpdate(add=boxes))
    found = scene.contacts()
    pairs = list(zip(found.ids_a, found.ids_b, strict=True))
    right = pairs == [(f"{k:02}", f"{k + 1:02}") for k in range(15)] and bool((found.distance == 0.0).all())
    return "" if right else f"contacts {pairs} at {found.distance.tolist()}"


def _unsupported() -> str:
    """A mesh has no kernel: that is said, and no distance is made up."""
    scene = Scene()
    mesh = Mesh([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)])
    scene.apply(SceneUpdate(add=[SceneObject("a", mesh), SceneObject("b", Sphere(1.0))]))
    answer = scene.distances(1.0)
    named = [(a, b) for a, b, _ in answer.unsupported]
    return "" if len(answer) == 0 and named == [("a", "b")] else f"{len(answer)} rows, unsupported {named}"


# The expected time is a difference of two angles some three times as large, each good to a few units of 2^-53, one of
# them 1.9 times as sensitive to the place of the wall: fewer than 100 units in all.
TURNING_ERROR = 1e-12


def _turning() -> str:
    """A polygon that turns is followed: its corner, sqrt(2) from its middle, comes to a wall 1.2 away."""
    square = Polygon([(-1, -1), (1, -1), (1, 1), (-1, 1)])
    scene = Scene()
    spin = SceneObject("a", square, twist=(0, 0, 0, 0, 0, 1))
    scene.apply(SceneUpdate(add=[spin, SceneObject("b", square, (2.2, 0, 0, 0, 0, 0, 1))]))
    found = scene.first_contacts(1.0)
    expected = math.pi / 4 - math.acos(1.2 / math.sqrt(2.0))
    right = found.status.tolist() == [ContactStatus.WILL_TOUCH] and (
        found.time_lower[0] <= expected * (1 + TURNING_ERROR) and expected * (1 - TURNING_ERROR) <= found.time_upper[0]
    )
    return "" if right else f"status {found.status.tolist()} at {found.time.tolist()}"


_SCENES: dict[str, Callable[[], str]] = {
    "touching neighbours": _touching_row,
    "a shape without a kernel": _unsupported,
    "a turning polygon": _turning,
}
