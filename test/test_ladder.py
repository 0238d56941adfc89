# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""A tolerance instead of a tier: every answer keeps what it claims, and takes no more than it needs for that."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from typing import Any

import cull_scenes
import numpy as np
import pytest
from distance_scenes import matrix_of, shape, shape_pose
from polygon_scenes import random_ring
from polytope_scenes import random_body
from scene_answers import rows_of, scene_of

import geomsrv as gs
from geomsrv import ladder
from geomsrv.answers import ContactStatus, DistanceStatus

TOLERANCES = (10.0, 1e-1, 1e-3, 1e-6, 1e-9, 1e-12, 1e-15, 1e-300)
TIERS = ("bound", "float32", "float64", "exact")
KINDS = ("sphere", "capsule", "box", "convex")


def tier_counts(cost: gs.Cost) -> dict[str, int]:
    return {name[5:]: count for name, count in cost.counts.items() if name.startswith("tier ")}


def poses(rng: np.random.Generator, count: int, size: float) -> np.ndarray:
    turn = rng.normal(size=(count, 4))
    return np.hstack([rng.uniform(-size, size, (count, 3)), turn / np.linalg.norm(turn, axis=1)[:, None]])


def check_lengths(answer: gs.Distances, exact: gs.Distances, tolerance: float) -> Counter[str]:
    """OK means that the interval is no wider than asked for, and every interval holds the exact value."""
    width = answer.upper - answer.lower
    near = (width <= tolerance) | (answer.upper <= np.nextafter(answer.lower, np.inf))
    assert (near == (answer.status == DistanceStatus.OK)).all()
    assert (answer.lower <= exact.upper).all() and (exact.lower <= answer.upper).all()
    good = answer.status == DistanceStatus.OK
    allowed = tolerance + np.spacing(np.abs(exact.distance[good]))
    assert (np.abs(answer.distance - exact.distance)[good] <= allowed).all()
    counts = tier_counts(answer.cost)
    assert sum(counts.values()) == len(width)
    assert answer.cost.accuracy == max(counts, key=TIERS.index)
    return Counter(counts)


def test_no_distance_violates_its_tolerance(rng) -> None:
    seen: Counter[str] = Counter()
    for a, b in ((a, b) for i, a in enumerate(KINDS) for b in KINDS[i:]):
        one, two = shape(rng, a), shape(rng, b)
        where = np.array([shape_pose(rng, one, two) for _ in range(100)])
        for want in (("distance",), ("penetration",)):
            exact = gs.distance(one, two, where, accuracy="exact", want=want)
            for tolerance in TOLERANCES:
                answer = gs.distance(one, two, where, want=want, tolerance=tolerance)
                seen += check_lengths(answer, exact, tolerance)
    assert min(seen[tier] for tier in ("bound", "float64", "exact")) > 100, seen


def test_no_distance_of_polygons_violates_its_tolerance(rng) -> None:
    a, b = (gs.Polygons.from_list([random_ring(rng, 1.0) + rng.uniform(-2, 2, 2) for _ in range(300)]) for _ in "ab")
    seen: Counter[str] = Counter()
    exact = gs.distance(a, b, accuracy="exact")
    for tolerance in TOLERANCES:
        seen += check_lengths(gs.distance(a, b, tolerance=tolerance), exact, tolerance)
    assert set(seen) == {"exact"}, "it is as cheap as any other that proves something"


def test_no_distance_to_a_frustum_violates_its_tolerance(rng) -> None:
    camera = gs.Frustum.look_at([0.3, -0.2, 1.1], [3.0, 1.0, 0.7], [0.0, 0.0, 1.0], 0.8, 4 / 3, 0.1, 20.0)
    points = rng.uniform(-30, 30, (500, 3))
    exact = gs.distance_to_frustum(camera, points, accuracy="exact")
    for tolerance in TOLERANCES:
        answer = gs.distance_to_frustum(camera, points, tolerance=tolerance)
        check_lengths(answer, exact, tolerance)
        assert answer.region.tolist() == exact.region.tolist() or tolerance > 1e-12
    assert np.array_equal(answer.point_a, exact.point_a, equal_nan=True)


def _moving(rng: np.random.Generator, d: int, count: int) -> tuple[Any, Any, np.ndarray, np.ndarray]:
    batch, body = (gs.Polygons, random_ring) if d == 2 else (gs.Polytopes, random_body)
    a = batch.from_list([body(rng, 1.0) for _ in range(count)])
    way = rng.normal(size=(count, d))
    way *= rng.uniform(0.0, 6.0, (count, 1)) / np.linalg.norm(way, axis=1)[:, None]
    b = batch.from_list([body(rng, 1.0) + step for step in way])
    return a, b, rng.normal(scale=0.3, size=(count, d)) + way * rng.uniform(0.1, 1.0, (count, 1)), np.zeros(d)


@pytest.mark.parametrize("d", [2, 3])
def test_no_first_contact_violates_its_tolerance(rng, d) -> None:
    a, b, va, vb = _moving(rng, d, 250)
    exact = gs.first_contact(a, b, va, vb, t_max=3.0, accuracy="exact")
    assert np.bincount(exact.status, minlength=4)[[gs.NEVER, gs.WILL_TOUCH, gs.OVERLAPPING]].min() > 0
    for tolerance in TOLERANCES:
        answer = gs.first_contact(a, b, va, vb, t_max=3.0, tolerance=tolerance)
        assert answer.status.tolist() == exact.status.tolist() and answer.certain.all()
        hit = exact.status == gs.WILL_TOUCH
        width = (answer.time_upper - answer.time_lower)[hit]
        assert ((width <= tolerance) | (answer.time_upper <= np.nextafter(answer.time_lower, np.inf))[hit]).all()
        assert (answer.time_lower <= exact.time_upper)[hit].all() and (exact.time_lower <= answer.time_upper)[hit].all()
        assert sum(tier_counts(answer.cost).values()) == 250
    if d == 2:  # all of them by exact arithmetic
        assert np.array_equal(answer.points, exact.points)
        assert np.array_equal(answer.closing_speed, exact.closing_speed, equal_nan=True)


def test_a_few_doubtful_contacts_climb_alone(rng) -> None:
    """Of many boxes that miss or hit clearly, the few that graze go on to exact arithmetic; order and sets stay."""
    count, half = 300, np.array([1.0, 1.0, 1.0])
    turn = matrix_of(np.array([0, 0, 0, 0.1, 0.2, 0.3, np.sqrt(0.86)]))
    where = np.column_stack([rng.uniform(2.0, 6.0, count), rng.uniform(-4.0, 4.0, count), np.zeros(count)])
    graze = rng.choice(count, 12, replace=False)
    where[graze, 1] = 2.0  # sides that slide along each other, as far as rounding lets them
    axes = np.tile(turn.T, (count, 1, 1))
    a, b = (gs.Boxes(x @ turn.T, axes, np.tile(half, (count, 1))) for x in (np.zeros((count, 3)), where))
    exact = gs.first_contact(a, b, turn[:, 0], (0, 0, 0), accuracy="exact")
    answer = gs.first_contact(a, b, turn[:, 0], (0, 0, 0), accuracy="auto")
    assert answer.certain.all() and answer.status.tolist() == exact.status.tolist()
    counts = tier_counts(answer.cost)
    assert 0 < counts["exact"] <= 12 and counts["float64"] == count - counts["exact"]
    plain = gs.first_contact(a, b, turn[:, 0], (0, 0, 0))
    for k in range(count):  # each has the contact set of its own tier
        judge = plain if plain.certain[k] else exact
        assert [part.tolist() for part in answer.parts(k)] == [part.tolist() for part in judge.parts(k)]
        assert answer.closing_speed[k : k + 1].tobytes() == judge.closing_speed[k : k + 1].tobytes()


def test_auto_decides_what_float64_leaves_open(rng) -> None:
    camera, boxes = cull_scenes.touching_scene(rng, 200)
    plain, auto = (gs.cull(camera, boxes, accuracy=accuracy) for accuracy in ("float64", "auto"))
    assert auto.certain.all() and not plain.certain.all()
    assert (auto.error_bound, plain.error_bound) == (0.0, np.inf)
    assert auto.state.tolist() == gs.cull(camera, boxes, accuracy="exact").state.tolist()
    cell = gs.Boxes.from_poses(
        np.hstack([rng.integers(-3, 4, (400, 3)) * 0.2, np.tile([0, 0, 0, 1.0], (400, 1))]), [0.1] * 3
    )
    one = gs.Boxes.from_poses([[0, 0, 0, 0, 0, 0, 1]], [0.1, 0.1, 0.1])
    answer, exact = (gs.intersects(one, cell, accuracy=accuracy) for accuracy in ("auto", "exact"))
    assert answer.certain.all() and answer.value.tolist() == exact.value.tolist() and 0 < answer.value.sum() < 400
    assert tier_counts(answer.cost)["exact"] < 400


def test_an_answer_without_a_tolerance_is_that_of_float64(rng) -> None:
    a, b = shape(rng, "box"), shape(rng, "convex")
    where = poses(rng, 300, 2.0)
    plain, auto = (gs.distance(a, b, where, accuracy=accuracy) for accuracy in ("float64", "auto"))
    for name in ("distance", "lower", "upper", "point_a", "point_b", "normal", "status"):
        assert np.array_equal(getattr(plain, name), getattr(auto, name), equal_nan=True), name


def test_a_tier_other_than_the_default_is_kept_to() -> None:
    where = [[2.5, 2.5, 0, 0, 0, 0, 1]]
    answer = gs.distance(gs.Box([1, 1, 1]), gs.Box([1, 1, 1]), where, accuracy="bound", tolerance=1e-3)
    assert answer.cost.accuracy == "bound" and answer.status.tolist() == [DistanceStatus.NOT_CONVERGED]
    assert answer.upper - answer.lower > 1e-3


@pytest.mark.parametrize("budget", [1e-9, 1e-4, 60.0])
def test_anytime_answers_are_proven(rng, budget) -> None:
    """However little time there is, every interval holds; with enough of it they are as good as ever."""
    a, b, where = shape(rng, "convex"), shape(rng, "convex"), poses(rng, 2000, 2.0)
    exact = gs.distance(a, b, where, accuracy="exact")
    answer = gs.distance(a, b, where, time_budget=budget)
    assert (answer.lower <= exact.upper).all() and (exact.lower <= answer.upper).all()
    left = tier_counts(answer.cost).get("bound", 0)
    assert left == (answer.status == DistanceStatus.NOT_CONVERGED).sum()
    assert left == (2000 if budget == 1e-9 else 0) or budget == 1e-4
    camera = gs.Frustum([0, 0, 0], np.eye(3), 1.0, 1.0, 0.1, 5.0)
    points = gs.distance_to_frustum(camera, where[:, :3], time_budget=budget)
    truth = gs.distance_to_frustum(camera, where[:, :3], accuracy="exact")
    assert (points.lower <= truth.upper).all() and (truth.lower <= points.upper).all()
    boxes = gs.Boxes.from_poses(where, [0.2, 0.3, 0.4])
    seen, really = gs.cull(camera, boxes, time_budget=budget), gs.cull(camera, boxes, accuracy="exact")
    assert (seen.state == really.state)[seen.certain].all() and (seen.certain.all() or budget < 60.0)
    meet, truly = (gs.intersects(boxes, boxes, **how) for how in ({"time_budget": budget}, {"accuracy": "exact"}))
    assert (meet.value == truly.value)[meet.certain].all()


@pytest.mark.parametrize("budget", [1e-9, 60.0])
@pytest.mark.parametrize("spin", [0.0, 1.0])
def test_anytime_contacts_are_bracketed(rng, budget, spin) -> None:
    a, b, va, vb = _moving(rng, 3, 200)
    turn: dict[str, Any] = {"angular_velocity_a": (0, 0, spin)} if spin else {}
    truth = gs.first_contact(a, b, va, vb, t_max=3.0, **turn)
    answer = gs.first_contact(a, b, va, vb, t_max=3.0, time_budget=budget, **turn)
    open_ones = answer.status == ContactStatus.NOT_CONVERGED
    assert open_ones.any() == (budget < 1.0) and not answer.certain[open_ones].any()
    hit = truth.status != gs.NEVER
    bracket = (answer.time_lower <= truth.time_upper) & (truth.time_lower <= answer.time_upper)
    assert bracket[hit & (answer.status != gs.NEVER)].all()
    assert (answer.status[hit] != gs.NEVER).all()
    assert (answer.status == truth.status)[~open_ones].all()


@pytest.mark.parametrize("fault", [0.0, -1.0, np.nan, np.inf, "1"])
def test_bad_tolerances_are_named(fault) -> None:
    with pytest.raises(gs.GeometryError, match="tolerance"):
        gs.distance(gs.Sphere(1), gs.Sphere(1), [3, 0, 0, 0, 0, 0, 1], tolerance=fault)
    if fault != np.inf:
        with pytest.raises(gs.GeometryError, match="time_budget"):
            gs.distance(gs.Sphere(1), gs.Sphere(1), [3, 0, 0, 0, 0, 0, 1], time_budget=fault)


def test_faults_keep_their_index(rng) -> None:
    where = poses(rng, 300, 2.0)
    where[200, 3:] *= 1.1
    with pytest.raises(gs.GeometryError, match=r"poses_ab\[200\]"):
        gs.distance(gs.Sphere(1), gs.Box([1, 1, 1]), where, tolerance=1e-3)
    square = gs.Polygons.from_list([[(0, 0), (1, 0), (1, 1)]] * 300)
    speed = np.zeros((300, 2))
    speed[250, 1] = np.nan
    with pytest.raises(gs.GeometryError, match=r"velocity_a\[250, 1\]"):
        gs.first_contact(square, square, speed, (0, 0), tolerance=1e-3)


def test_certificates_prove_what_a_tolerance_left(rng) -> None:
    a, b, va, vb = _moving(rng, 2, 40)
    for answer in (
        gs.first_contact(a, b, va, vb, t_max=3.0, tolerance=1e-9, certificates=True),
        gs.distance(a, b, tolerance=1e-9, certificates=True),
        gs.distance(gs.Box([1, 1, 1]), gs.Box([1, 2, 3]), poses(rng, 40, 4.0), tolerance=1e-15, certificates=True),
    ):
        assert len(answer.certificates) == 40
        gs.verify(answer)


# ------------------------------------------------------------------------------------------------------------ scenes


def _crowd(rng: np.random.Generator, moving: bool) -> gs.Scene:
    objects = []
    for k, place in enumerate(poses(rng, 30, 1.0)):
        body = shape(rng, "box") if k % 2 else gs.Sphere(0.2)
        twist = rng.normal(scale=0.3, size=6) * ([1, 1, 1, 0, 0, 0] if k % 3 else 1.0) * moving
        objects.append(gs.SceneObject(f"o{k:02}", body, place, twist))
    for k in range(10):
        place = [*rng.uniform(-2, 2, 2), 0, 0, 0, 0, 1]
        twist = [*rng.normal(size=2) * moving, 0, 0, 0, 0]
        objects.append(gs.SceneObject(f"p{k}", gs.Polygon([[0, 0], [1, 0], [0.5, 1]]), place, twist))
    return scene_of(objects)


def test_scenes_keep_tolerances(rng) -> None:
    scene = _crowd(rng, moving=False)
    exact = scene.distances(2.0, accuracy="exact", want=("penetration",))
    pairs = list(zip(exact.ids_a, exact.ids_b, strict=True))
    for tolerance in TOLERANCES[:-2]:
        answer = scene.distances(2.0, tolerance=tolerance, want=("penetration",))
        assert set(zip(answer.ids_a, answer.ids_b, strict=True)) >= set(pairs) or tolerance < 1e-3
        wide = answer.upper - answer.lower > tolerance
        assert (wide == (answer.status == DistanceStatus.NOT_CONVERGED)).all() and not wide.any()
        assert answer.error_bound <= tolerance
        row = {pair: k for k, pair in enumerate(zip(answer.ids_a, answer.ids_b, strict=True))}
        both = [(row[pair], k) for k, pair in enumerate(pairs) if pair in row]
        assert all(answer.lower[i] <= exact.upper[k] and exact.lower[k] <= answer.upper[i] for i, k in both)
    assert answer.cost.accuracy == "float64" and tier_counts(answer.cost)["float64"] > 0
    # Poses are rounded before anything is measured: nothing can prove this, and exact arithmetic has tried.
    answer = scene.distances(2.0, tolerance=1e-300, want=("penetration",))
    hopeless = answer.upper > np.nextafter(answer.lower, np.inf)
    assert hopeless.any() and answer.cost.accuracy == "exact" and tier_counts(answer.cost)["exact"] > 0
    assert ((answer.status == DistanceStatus.NOT_CONVERGED) == hopeless).all()
    nearest = scene.nearest_pair(tolerance=1e-6)
    assert nearest.distance[0] == scene.nearest_pair().distance[0]


def test_scenes_keep_time_tolerances(rng) -> None:
    scene = _crowd(rng, moving=True)
    default = scene.first_contacts(3.0)
    hits = [
        pair for pair, status in zip(rows_of_pairs(default), default.status, strict=True) if status == gs.WILL_TOUCH
    ]
    assert len(hits) > 5
    for tolerance in (1e-1, 1e-3, 1e-9):
        answer = scene.first_contacts(3.0, tolerance=tolerance)
        found = dict(zip(rows_of_pairs(answer), range(len(answer)), strict=True))
        assert set(hits) <= set(found)
        timed = answer.status == gs.WILL_TOUCH
        assert ((answer.time_upper - answer.time_lower)[timed] <= tolerance).all()
        for pair, k in zip(rows_of_pairs(default), range(len(default)), strict=True):
            if pair in hits:
                assert answer.time_lower[found[pair]] <= default.time_upper[k]
                assert default.time_lower[k] <= answer.time_upper[found[pair]]
    bar = gs.SceneObject("bar", gs.Box([1.0, 0.1, 0.1]), (0, 0, 9, 0, 0, 0, 1), (0, 0, 0, 0, 0, 1))
    post = gs.SceneObject("post", gs.Box([0.1, 0.1, 0.1]), (0, 0.9, 9, 0, 0, 0, 1))
    swing = scene_of([bar, post])
    widths = [
        float((x.time_upper - x.time_lower)[0]) for x in (swing.first_contacts(4.0, tolerance=t) for t in (1e-1, 1e-9))
    ]
    assert widths[1] <= 1e-9 < 1e-6 < widths[0] <= 1e-1
    first = scene.first_contacts(3.0, earliest=True, accuracy="auto")
    assert first.time[0] == pytest.approx(np.nanmin(default.time), abs=1e-6)


def rows_of_pairs(answer: Any) -> list[tuple[str, str]]:
    return list(zip(answer.ids_a, answer.ids_b, strict=True))


@pytest.mark.parametrize("ask", [lambda s, **k: s.distances(2.0, **k), lambda s, **k: s.first_contacts(3.0, **k)])
def test_scenes_in_a_hurry(rng, ask: Callable[..., Any]) -> None:
    scene = _crowd(rng, moving=True)
    whole, hurried, patient = ask(scene), ask(scene, time_budget=1e-9), ask(scene, time_budget=60.0)
    left = hurried.status == (1 if hasattr(hurried, "distance") else ContactStatus.NOT_CONVERGED)
    assert left.any() and set(rows_of_pairs(whole)) <= set(rows_of_pairs(hurried))
    assert rows_of(patient) == rows_of(whole)
    low, high = ("lower", "upper") if hasattr(whole, "distance") else ("time_lower", "time_upper")
    at = dict(zip(rows_of_pairs(hurried), range(len(hurried)), strict=True))
    for k, pair in enumerate(rows_of_pairs(whole)):
        if not np.isnan(getattr(whole, low)[k]):
            assert getattr(hurried, low)[at[pair]] <= getattr(whole, high)[k]
            assert getattr(whole, low)[k] <= getattr(hurried, high)[at[pair]]


def test_scenes_see_at_auto(rng) -> None:
    scene = _crowd(rng, moving=False)
    camera = gs.Frustum([0, 0, -2], np.eye(3), 0.5, 0.5, 0.5, 3.0)
    auto, exact = (scene.cull(camera, accuracy=accuracy) for accuracy in ("auto", "exact"))
    assert auto.state.tolist() == exact.state.tolist() and auto.cost.accuracy == "exact"
    hurried = scene.cull(camera, time_budget=1e-9)
    assert (hurried.state == exact.state)[hurried.certain].all()


def test_a_useless_tier_is_tried_on_a_few_only() -> None:
    """The trial of a tier that settles nothing costs a few items, not all."""
    seen: list[tuple[str, int]] = []

    def solve(items: np.ndarray, tier: str) -> tuple[Any, np.ndarray]:
        seen.append((tier, len(items)))
        return gs.Cull(items.astype(np.uint8), np.full(len(items), tier == "exact"), gs.Cost(1, tier, {})), items

    quality = ladder.Quality.of("auto")
    found = ladder.climb(np.arange(1000), ("bound", "exact"), solve, lambda answer, _: answer.certain, quality)
    assert seen == [("bound", ladder.TRIAL), ("exact", 1000)]
    assert found.column("state").tolist() == [k % 256 for k in range(1000)]
