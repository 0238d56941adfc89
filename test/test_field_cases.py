# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""Inputs on which other engines went wrong (data/field_cases.jsonl): ours must give the verified values."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from conftest import field_cases
from hard.__main__ import FIELD, PAGE, missing
from oracle import polygon, polytope

import geomsrv as gs
from geomsrv import _verdict
from geomsrv._verdict import Verdict, judge
from geomsrv.hard_cases import MOVING, VERIFIED, Case, pose_of, read, scene_size, shape_of

TIERS = ("float64", "exact")
ANSWERED = {case.name: case for case in read(FIELD) if case.truth and judge(case, "float64")}
CASES = {name: case for name, case in ANSWERED.items() if case.kind not in MOVING}
MOTIONS = {name: case for name, case in ANSWERED.items() if case.kind in MOVING}
RECORDS = {
    record["id"]: record
    for kind in ("signed_distance", "distance", "segment_segment", "collide", "frustum_cull")
    for record in field_cases(kind)
}


def corners_of(shape: dict[str, Any]) -> np.ndarray | None:
    """World coordinates of the vertices of a shape that has them."""
    solid = shape_of(shape)
    rotation, position = pose_of(shape)
    if isinstance(solid, gs.Box):
        local = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * solid.half_extents
    elif hasattr(solid, "vertices"):
        local = solid.vertices
    else:
        return None
    return local @ rotation.T + position


@pytest.mark.parametrize("name", CASES)
def test_answer(name: str) -> None:
    """Numbers to the slack of the verified value, booleans wherever that slack leaves them to be seen."""
    case, record = CASES[name], RECORDS[name]
    assert case.truth is not None
    expected = record["verified_value"]
    for tier in TIERS:
        finding = judge(case, tier)
        assert finding is not None and finding.near, (tier, finding)
        assert finding.verdict == (Verdict.RIGHT if case.truth.decidable else finding.verdict) != Verdict.WRONG
        for want, value in (("penetration", expected), ("distance", max(0.0, expected))):
            answer = gs.distance(*case.bodies, accuracy=tier, want=(want,))
            assert answer.status == gs.DistanceStatus.OK
            assert abs(answer.distance[0] - value) <= slack_of(case)


def slack_of(case: Case) -> float:
    """Half the width of what is known, as a number and not as a signed square."""
    truth = case.truth
    assert truth is not None
    low, high = (float(abs(x)) ** 0.5 * (1 if x > 0 else -1) for x in (truth.low, truth.high))
    return (high - low) / 2 + 4 * np.spacing(max(abs(low), abs(high)))


CORNERED = [
    name
    for name, case in CASES.items()
    if len(case.bodies) == 3 and all(corners_of(shape) is not None for shape in RECORDS[name]["shapes"])
]


@pytest.mark.parametrize("name", CORNERED)
def test_in_world_coordinates(name: str) -> None:
    """Corners take the matrices as given and are rounded to the ulps of the far one; then the oracle is the judge."""
    shapes = RECORDS[name]["shapes"]
    corners = [corners_of(shape) for shape in shapes]
    bodies = [gs.Polytopes.from_list([c]) for c in corners]
    exact = polytope.separation(*corners).signed_square if len(corners[0]) * len(corners[1]) <= 100 else None
    reach = max(np.abs(c).max() for c in corners)
    for tier in TIERS:
        answer = gs.distance(*bodies, accuracy=tier, want=("penetration",))
        slack = VERIFIED * scene_size(shapes) + 1e-15 * reach
        assert abs(answer.distance[0] - RECORDS[name]["verified_value"]) <= slack
        if exact is not None:
            bounds = (answer.distance[0], answer.lower[0], answer.upper[0])
            truth = _verdict.Truth(exact, exact, Fraction(scene_size(shapes)), False)
            finding = _verdict._number("distance", answer, truth, tier)
            assert finding.verdict != Verdict.WRONG, (bounds, finding)
            assert tier != "exact" or finding.verdict == Verdict.RIGHT, (bounds, finding)


def test_enough_cases() -> None:
    values = [RECORDS[name]["verified_value"] for name in CASES]
    assert len(CASES) >= 169 and sum(value < 0 for value in values) >= 50
    assert len(CORNERED) >= 100
    visible = {RECORDS[name]["verified_visible"] for name, case in CASES.items() if case.kind == "frustum_cull"}
    assert visible == {True, False}
    assert sum(isinstance(case.bodies[0], gs.Frustum) for case in CASES.values()) >= 6


@pytest.mark.parametrize("name", [name for name, case in CASES.items() if case.kind == "frustum_cull"])
def test_cull(name: str) -> None:
    view, boxes = CASES[name].bodies[:2]
    if isinstance(view, gs.Frustum) and CASES[name].truth.decidable:
        for tier in TIERS:
            answer = gs.cull(view, boxes, accuracy=tier)
            assert answer.certain and (answer.state != gs.OUTSIDE) == RECORDS[name]["verified_visible"]


def test_the_page_lists_what_is_missing() -> None:
    """`make hard` writes it; it shrinks as queries and shapes arrive."""
    text = PAGE.read_text(encoding="utf-8")
    listed = text.partition("<!-- missing: begin -->\n")[2].partition("\n<!-- missing: end -->")[0]
    assert listed == missing()


# Prisms that move across their height: the axis along it, and the case.
FLAT_MOTIONS = {
    "parry-214-cuboids-2d": 2,
    "ncollide-214-2d": 2,
    "box2d-toi-halfway": 2,
    "parry-141-moving-away": 2,
    "jolt-cast-initially-intersecting": 2,
    "parry-180-cuboid-segment": 2,
    "fcl-555-mesh-boxes": 0,
}


@pytest.mark.parametrize("name", FLAT_MOTIONS)
def test_first_contact(name: str) -> None:
    (case,) = [case for case in field_cases("toi") if case["id"] == name]
    kept = [k for k in range(3) if k != FLAT_MOTIONS[name]]
    rings = []
    for shape in case["shapes"]:
        corners = corners_of(shape)
        assert corners is not None
        rings.append([tuple(float(x) for x in p) for p in polygon.hull(corners[:, kept].tolist())])
    bodies = [gs.Polygons.from_list([ring]) for ring in rings]
    velocities = [np.array(v, dtype=float)[kept] for v in case["motion"]["v"]]
    answer = gs.first_contact(*bodies, *velocities, t_max=float(case["motion"]["tmax"]))
    expected = case["verified_value"]
    if expected is None:
        assert answer.status == gs.NEVER
        return
    assert answer.status == (gs.WILL_TOUCH if expected > 0 else gs.OVERLAPPING)
    assert answer.time_lower[0] <= answer.time[0] <= answer.time_upper[0]
    assert abs(answer.time[0] - expected) <= VERIFIED * max(1.0, expected)


SOLID_MOTIONS = {
    case["id"]: case
    for case in field_cases("toi")
    if all(shape["type"] in ("box", "convex", "segment", "triangle") for shape in case["shapes"])
}


def solids_of(shape: dict[str, Any]) -> gs.Boxes | gs.Polytopes:
    """A batch of one: a box as such, what has vertices as their hull."""
    if isinstance(solid := shape_of(shape), gs.Box):
        rotation, position = pose_of(shape)
        return gs.Boxes([position], [rotation.T], [solid.half_extents])
    corners = corners_of(shape)
    assert corners is not None
    return gs.Polytopes.from_list([corners])


@pytest.mark.parametrize("tier", TIERS)
@pytest.mark.parametrize("name", SOLID_MOTIONS)
def test_first_contact_of_solids(name: str, tier: str) -> None:
    case = SOLID_MOTIONS[name]
    bodies = [solids_of(shape) for shape in case["shapes"]]
    answer = gs.first_contact(*bodies, *case["motion"]["v"], t_max=float(case["motion"]["tmax"]), accuracy=tier)
    expected = case["verified_value"]
    if expected is None:
        assert answer.status == gs.NEVER and answer.certain
        return
    assert answer.status == (gs.WILL_TOUCH if expected > 0 else gs.OVERLAPPING) and answer.certain
    assert answer.time_lower[0] <= answer.time[0] <= answer.time_upper[0] and len(answer.points) > 0
    assert abs(answer.time[0] - expected) <= VERIFIED * max(1.0, expected)


def test_enough_motions_of_solids() -> None:
    assert len(SOLID_MOTIONS) >= 8


# A point that meets a point, or a segment, in space: the slightest push parts them, so contact is not proven, nor its
# absence.
INSTANTS = {"ipc-nonlinear-point-point", "ipc-rigid2d-point-edge"}


@pytest.mark.parametrize("name", MOTIONS)
def test_time_of_impact(name: str) -> None:
    """As the scene answers, round bodies and turning ones included; at every tier that follows them."""
    case = MOTIONS[name]
    for tier in ("bound", *TIERS):
        finding = judge(case, tier)
        if tier == "float64":
            assert finding is not None
            assert finding.verdict == (Verdict.UNCERTAIN if name in INSTANTS else Verdict.RIGHT), finding
        assert finding is None or finding.verdict != Verdict.WRONG, (tier, finding)


def test_all_motions_are_answered() -> None:
    listed = [case["id"] for kind in ("toi", "toi_rotating") for case in field_cases(kind)]
    assert sorted(MOTIONS) == sorted(listed) and len(listed) >= 23
    assert sum(judge(case, "exact") is not None for case in MOTIONS.values()) >= 8
