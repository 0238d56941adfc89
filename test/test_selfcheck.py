# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""The built-in cases: their answers are exact, the engine gives them, and a wrong engine is found out."""

from __future__ import annotations

import dataclasses
import subprocess
import sys

import numpy as np
import pytest
from oracle import frustum_box, point_frustum, polygon, polytope
from oracle.vectors import nearest_double, root_double

from geomsrv import selfcheck
from geomsrv.answers import ContactStatus, CullState

CASES = [pytest.param(query, case, id=f"{query}: {name}") for query, name, case in selfcheck.cases()]


def frustum_of(numbers):
    origin, axes, (left, up, near, far) = np.split(numbers, [3, 12])
    return origin.tolist(), axes.reshape(3, 3).tolist(), (-left, left, -up, up), near, far


def box_of(numbers):
    center, axes, half = np.split(numbers, [3, 12])
    return center.tolist(), axes.reshape(3, 3).tolist(), half.tolist()


def ring_of(numbers):
    return [tuple(map(polygon.Fraction, vertex)) for vertex in numbers.reshape(-1, 2).tolist()]


@pytest.mark.parametrize(("query", "case"), CASES)
def test_answers_are_those_of_the_oracle(query, case):
    match query:
        case "cull":
            state = frustum_box.state(frustum_of(case["frustum"]), box_of(case["box"]))
            assert (state != frustum_box.OUTSIDE) == bool(case["meets"][0])
        case "distance_to_frustum":
            nearest = point_frustum.nearest(*frustum_of(case["frustum"]), case["point"].tolist())
            assert root_double(nearest.squared_distance) == case["distance"][0]
        case "distance_boxes":
            corners = [polytope.box_corners(*box_of(case[name])) for name in ("box_a", "box_b")]
            assert root_double(polytope.squared_distance(*corners)) == case["distance"][0]
        case "distance_polygons":
            apart = polygon.separation(ring_of(case["polygon_a"]), ring_of(case["polygon_b"])).signed_square
            assert root_double(max(apart, 0)) == case["distance"][0]
        case "first_contact":
            arguments = [case[name].tolist() for name in ("velocity_a", "velocity_b")]
            hit = polygon.first_contact(
                ring_of(case["polygon_a"]), arguments[0], ring_of(case["polygon_b"]), arguments[1], case["t_max"][0]
            )
            assert hit.hits == ("never" not in case)
            if hit.hits:
                assert nearest_double(hit.time) == case["time"][0]
            if "contact" in case:
                exact = sorted(tuple(map(nearest_double, point)) for point in hit.contact)
                assert exact == sorted(map(tuple, case["contact"].reshape(-1, 2).tolist()))
        case _:
            pytest.fail(f"nobody judges {query}")


def test_every_check_passes():
    report = selfcheck.self_check()
    assert report.ok, report.message
    assert len(report) >= 50 and report.failed == ()
    assert report.message.startswith(f"{len(report)} of {len(report)} checks passed in ")
    names = [check.name for check in report]
    assert len(set(names)) == len(names)
    queries = {name.partition(":")[0] for name in names}
    assert queries == {*selfcheck._QUERIES, "scene"}
    print(report.message)


def names_failed(report):
    return {check.name.partition(":")[0] for check in report.failed}


def shifted(function, **by):
    """`function`, with fields of its answer changed."""

    def wrong(*args, **options):
        answer = function(*args, **options)
        return dataclasses.replace(answer, **{name: change(getattr(answer, name)) for name, change in by.items()})

    return wrong


def test_a_wrong_state_is_found(monkeypatch):
    flip = np.vectorize(lambda state: CullState.OUTSIDE if state else CullState.INTERSECTS)
    monkeypatch.setattr(selfcheck, "cull", shifted(selfcheck.cull, state=flip))
    report = selfcheck.self_check()
    assert not report.ok and names_failed(report) == {"cull"}
    assert len(report.failed) == sum(query == "cull" for query, _, _ in selfcheck.cases())
    assert "FAILED cull: " in report.message and "answers OUTSIDE" in report.message


@pytest.mark.parametrize("field", ["distance", "lower", "upper"])
@pytest.mark.parametrize("query", ["distance", "distance_to_frustum"])
def test_a_wrong_distance_is_found(monkeypatch, query, field):
    change = {
        "distance": lambda d: d * (1.0 + 1e-6) + 1e-300,
        "lower": lambda d: d * 2.0 + 1.0,
        "upper": lambda d: -1.0 - d,
    }
    monkeypatch.setattr(selfcheck, query, shifted(getattr(selfcheck, query), **{field: change[field]}))
    report = selfcheck.self_check()
    wanted = {"distance": {"distance_boxes", "distance_polygons"}, "distance_to_frustum": {"distance_to_frustum"}}
    assert names_failed(report) == wanted[query]


@pytest.mark.parametrize(
    "by",
    [
        {"time": lambda t: t * (1.0 + 1e-9)},
        {"time_lower": lambda t: t + 1e-9},
        {"time_upper": lambda t: t - 1e-9},
        {"points": lambda p: p + 1e-3},
        {"points": lambda p: p[:1]},
        {"points": lambda p: p[:0]},
        {"status": lambda s: np.full_like(s, ContactStatus.NEVER)},
    ],
)
def test_a_wrong_contact_is_found(monkeypatch, by):
    monkeypatch.setattr(selfcheck, "first_contact", shifted(selfcheck.first_contact, **by))
    report = selfcheck.self_check()
    assert names_failed(report) == {"first_contact"}


def test_an_exception_is_a_failure(monkeypatch):
    def broken(*_, **__):
        raise RuntimeError("no kernel")

    monkeypatch.setattr(selfcheck, "distance_to_frustum", broken)
    report = selfcheck.self_check()
    assert names_failed(report) == {"distance_to_frustum"}
    assert "RuntimeError: no kernel" in report.message


def test_it_runs_from_the_command_line(tmp_path):
    # Away from the sources, which would hide the installed package.
    command = [sys.executable, "-c", "from geomsrv.cli import main; raise SystemExit(main(['self-check']))"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "checks passed" in done.stdout
