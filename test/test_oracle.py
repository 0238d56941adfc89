# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""The judge is judged: every oracle reproduces every exact answer of its kinds in data/hard_cases.jsonl."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import pytest
from conftest import hard_cases
from oracle import frustum_box, point_frustum, polygon, polytope
from oracle.vectors import (
    exact,
    nearest_double,
    root_double,
    sub,
)


def by_id(kind: str) -> Any:
    """Parametrise over all cases of a kind."""
    cases = hard_cases(kind)
    return pytest.mark.parametrize("case", cases, ids=[case["id"] for case in cases])


def check_separation(case: dict[str, Any], found: Any) -> None:
    """Squared distance, depth, relation and rounded distance of a resting pair."""
    answer = case["answer"]
    assert found.signed_square == Fraction(answer["sep_sq"])
    assert found.relation == answer["separation"]
    assert found.intersects == answer["intersects"]
    if "sqdist" in answer:
        square = max(found.signed_square, Fraction(0))
        assert square == Fraction(answer["sqdist"])
        assert root_double(square) == float.fromhex(answer["dist"])


@by_id("box_box_distance")
def test_box_box_distance(case: dict[str, Any]) -> None:
    first, second = (
        polytope.box_corners(b["C"], b["A"], b["e"]) for b in (case["input"]["box0"], case["input"]["box1"])
    )
    answer = case["answer"]
    found = polytope.separation(first, second)
    check_separation(case, found)
    assert polytope.contains(first, found.point_a) and polytope.contains(second, found.point_b)
    assert sub(found.point_a, found.point_b) == exact(answer["diff"])
    assert polytope.nearest_set_dimension(first, second) == answer["closest_set_dim"]
    for body, point in ((first, answer["on0"]), (second, answer["on1"])):
        assert polytope.contains(body, exact(point))


@by_id("polygon2d_distance")
def test_polygon_distance(case: dict[str, Any]) -> None:
    p, q = exact(case["input"]["P"]), exact(case["input"]["Q"])
    answer = case["answer"]
    found = polygon.separation(p, q)
    check_separation(case, found)
    assert found.gap == exact(answer["diff"])
    near = polygon.nearest_set(p, q)
    assert polygon.contains(near, exact(answer["on0"]))
    if not found.intersects:
        assert polygon.dimension(near) == answer["closest_set_dim"]


@by_id("polygon2d_moving")
def test_polygon_first_contact(case: dict[str, Any]) -> None:
    given, answer = case["input"], case["answer"]
    found = polygon.first_contact(given["P"], given["velP"], given["Q"], given["velQ"], given["tmax"])
    assert found.hits == answer["hits"]
    assert found.separation_sq == Fraction(answer["sep_sq"])
    if not found.hits:
        assert found.status == polygon.NEVER
        return
    starts = {
        "disjoint": polygon.WILL_TOUCH,
        "touching": polygon.TOUCHING,
        "overlapping": polygon.OVERLAPPING,
    }
    assert found.status == starts[answer["separation"]]
    assert found.time == Fraction(answer["time"])
    assert nearest_double(found.time) == float.fromhex(answer["time_f"])
    assert found.last_time == Fraction(answer["last_time"])
    assert sorted(found.contact) == sorted(exact(answer["contact"]))
    assert polygon.dimension(found.contact) == answer["contact_dim"]
    speed = answer["normal_speed_sq"]
    assert found.normal_speed_sq == (None if speed is None else Fraction(speed))


def literal_frustum(given: dict[str, Any]) -> tuple[Any, ...]:
    """Arguments of the oracle's frusta from a case's symmetric frustum."""
    left, up = exact(given["l"]), exact(given["u"])
    return given["E"], (given["L"], given["U"], given["D"]), (-left, left, -up, up), given["n"], given["f"]


@by_id("frustum_box")
def test_frustum_box(case: dict[str, Any]) -> None:
    frustum = literal_frustum(case["input"]["frustum"])
    box = tuple(case["input"]["box"][key] for key in ("C", "A", "e"))
    corners, hull = polytope.box_corners(*box), polytope.frustum_corners(*frustum)
    state = frustum_box.state(frustum, box)
    assert (state != frustum_box.OUTSIDE) == case["answer"]["intersects"]
    assert (state == frustum_box.INSIDE) == all(polytope.contains(hull, corner) for corner in corners)
    check_separation(case, polytope.separation(hull, corners))


@by_id("point_frustum")
def test_point_frustum(case: dict[str, Any]) -> None:
    frustum, point, answer = literal_frustum(case["input"]["frustum"]), case["input"]["point"], case["answer"]
    found = point_frustum.nearest(*frustum, point)
    assert found.squared_distance == Fraction(answer["sqdist"])
    assert root_double(found.squared_distance) == float.fromhex(answer["dist"])
    assert found.point == exact(answer["closest"])
    assert found.faces == frozenset(answer["faces"])
    assert polytope.separation(polytope.frustum_corners(*frustum), [exact(point)]).signed_square == Fraction(
        answer["sep_sq"]
    )
