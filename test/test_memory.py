# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""A scene remembers what it found of pairs that did not change: it answers as a scene made anew, bit by bit."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scene_answers import scene_of

import geomsrv as gs
from geomsrv.world import HISTORY

CAMERA = gs.Frustum([0, 0, -3], np.eye(3), 0.5, 0.5, 0.5, 5.0)
QUESTIONS: dict[str, Any] = {
    "distances": lambda s: s.distances(0.5, want=("witness", "penetration")),
    "all distances": lambda s: s.distances(np.inf),
    "within a tolerance": lambda s: s.distances(0.5, tolerance=1e-3),
    "exactly": lambda s: s.distances(0.2, accuracy="exact"),
    "first contacts": lambda s: s.first_contacts(2.0),
    "now": lambda s: s.first_contacts(0.0),
    "at a margin": lambda s: s.first_contacts(1.0, margin=0.1),
    "by themselves": lambda s: s.first_contacts(2.0, accuracy="auto"),
    "first": lambda s: s.first_contacts(2.0, earliest=True),
    "cull": lambda s: s.cull(CAMERA),
    "cull at auto": lambda s: s.cull(CAMERA, accuracy="auto"),
}
NOT_COMPARED = {"cost", "version", "stamp"}


def columns(answer: Any) -> dict[str, Any]:
    """What the answer says, as bytes, but for what it cost."""
    named = {name: getattr(answer, name) for name in ("ids", "ids_a", "ids_b", "unsupported") if hasattr(answer, name)}
    values = {k: v for k, v in vars(answer).items() if k not in NOT_COMPARED and not k.startswith("_")}
    return {k: _bytes(v) if isinstance(v, np.ndarray) else v for k, v in (named | values).items()}


def _bytes(column: np.ndarray) -> bytes:
    """Bits of an array; a NaN has no sign."""
    return (np.where(np.isnan(column), np.nan, column) if column.dtype.kind == "f" else column).tobytes()


def turned(rng: np.random.Generator) -> np.ndarray:
    q = rng.normal(size=4)
    return q / np.linalg.norm(q)


def pose(rng: np.random.Generator, planar: bool, size: float = 1.5) -> np.ndarray:
    place = rng.uniform(-size, size, 3)
    if not planar:
        return np.append(place, turned(rng))
    angle = rng.uniform(0, np.pi)
    return np.array([place[0], place[1], 0, 0, 0, np.sin(angle), np.cos(angle)])


def twist(rng: np.random.Generator, planar: bool) -> np.ndarray:
    kind = rng.integers(3)  # rests, translates, turns
    velocity = rng.normal(scale=0.5, size=6) * [[0] * 6, [1, 1, 1, 0, 0, 0], [1] * 6][kind]
    return velocity * ([1, 1, 0, 0, 0, 1] if planar else 1)


def body(rng: np.random.Generator, name: str) -> gs.SceneObject:
    kind = rng.integers(6)
    shape = (
        gs.Sphere(0.2),
        gs.Box(rng.uniform(0.1, 0.4, 3)),
        gs.Convex(rng.uniform(-0.3, 0.3, (8, 3))),
        gs.Capsule(0.1, 0.5),
        gs.HalfSpace([0, 0, 1], -1.0),
        gs.Polygon([[0, 0], [0.6, 0], [0.3, 0.5]]),
    )[kind]
    moves = np.zeros(6) if kind == 4 else twist(rng, kind == 5)
    vague = rng.uniform(0, 0.01, 2) * (rng.random() < 0.2)
    return gs.SceneObject(name, shape, pose(rng, kind == 5), moves, "", *map(float, vague))


def made_anew(scene: gs.Scene) -> gs.Scene:
    """A scene with the same world, without what it has found out about it; poses stay as they were rounded."""
    other = gs.Scene()
    other._world = replace(scene.world)
    return other


@pytest.mark.parametrize("name", QUESTIONS)
def test_answers_are_those_of_a_new_scene(rng, name) -> None:
    """Few or many or no objects move, come, go, or are allowed to touch."""
    ask = QUESTIONS[name]
    scene = scene_of([body(rng, f"o{k:02}") for k in range(40)])
    ask(scene)
    remembered = 0
    for _ in range(12):
        what = rng.integers(8)
        names = list(scene.ids)
        if what == 0:
            scene.apply(
                gs.SceneUpdate(add=[body(rng, f"n{rng.integers(99)}")], remove=[names[rng.integers(len(names))]])
            )
        elif what == 1:
            a, b = rng.choice(len(names), 2, replace=False)
            scene.apply(gs.SceneUpdate(allow=[(names[a], names[b])]))
        else:
            count = (1, 1, 2, 3, 4, len(names))[rng.integers(6)]
            chosen = [names[k] for k in rng.choice(len(names), count, replace=False)]
            flat = [isinstance(scene[x].shape, gs.Polygon) for x in chosen]
            still = [isinstance(scene[x].shape, gs.HalfSpace) for x in chosen]
            twists = None
            if rng.random() < 0.5:
                twists = np.array([twist(rng, f) * (not s) for f, s in zip(flat, still, strict=True)])
            where = np.array([pose(rng, f) for f in flat])
            if rng.random() < 0.3:  # moved by so little that the pairs stay, or not at all
                where = np.array([scene[x].pose for x in chosen])
                where[:, 0] += 1e-3 * rng.integers(2)
            scene.set_states(chosen, where, twists)
        answer, anew = ask(scene), ask(made_anew(scene))
        assert columns(answer) == columns(anew)
        assert answer.cost.accuracy == anew.cost.accuracy or "auto" in name or "themselves" in name or name[0] == "w"
        assert answer.version == scene.version
        remembered += answer.cost.counts.get("remembered", 0)
        again = ask(scene)
        assert columns(again) == columns(answer)
    assert remembered > 0 or name == "first"


def test_what_did_not_change_costs_nothing(rng) -> None:
    """Counters: no pair of which neither object moved is looked at again."""
    scene = scene_of([gs.SceneObject(f"o{k:03}", gs.Box([0.1, 0.1, 0.1]), pose(rng, False)) for k in range(200)])
    first = scene.distances(0.3)
    assert first.cost.counts["narrow box-box"] == first.cost.counts["candidates"] > 100
    again = scene.distances(0.3)
    assert "narrow box-box" not in again.cost.counts and again.cost.counts["candidates"] == 0
    assert again.cost.counts["remembered"] == len(first)
    scene.set_states(["o007"], pose(rng, False)[None])
    moved = scene.distances(0.3)
    own = [pair for pair in zip(moved.ids_a, moved.ids_b, strict=True) if "o007" in pair]
    assert moved.cost.counts["remembered"] == len(moved) - len(own)
    assert moved.cost.counts["narrow box-box"] == moved.cost.counts["candidates"] < 60
    seen = scene.cull(CAMERA)
    assert "remembered" not in seen.cost.counts
    scene.set_states(["o009"], pose(rng, False)[None])
    assert scene.cull(CAMERA).cost.counts["remembered"] == 199
    assert scene.cull(CAMERA).cost.counts["remembered"] == 200


def test_many_moves_between_two_questions(rng) -> None:
    """More than a world remembers by row, and few enough for what did not move to be kept."""
    scene = scene_of([gs.SceneObject(f"o{k:03}", gs.Box([0.1, 0.1, 0.1]), pose(rng, False)) for k in range(240)])
    ask = QUESTIONS["distances"]
    for count in (1, HISTORY - 1, HISTORY, HISTORY + 1, 3 * HISTORY):
        ask(scene)
        for k in range(count):
            scene.set_states([f"o{k:03}"], pose(rng, False)[None])
        assert columns(ask(scene)) == columns(ask(made_anew(scene))), count


def test_the_very_same_states_are_no_change(rng) -> None:
    scene = scene_of([body(rng, f"o{k}") for k in range(10)])
    names, where = tuple(scene.ids), np.array([scene[x].pose for x in scene])
    version = scene.set_states(names, where, None, stamp="first")
    answer = scene.distances(1.0)
    assert scene.set_states(names, where.copy(), None, stamp="second") == version + 1
    assert scene.distances(1.0).cost.counts["candidates"] == 0
    later = scene.distances(1.0)
    assert (answer.stamp, later.stamp) == ("first", "second") and columns(answer) == columns(later)
    before = scene.world
    twists = np.array([scene[x].twist for x in scene])
    scene.set_states(names, where, twists)  # velocities without uncertainty are a statement
    sure = scene.world
    scene.set_states(names, where, twists)
    assert scene.world.poses is sure.poses is before.poses and scene.world.version == version + 3
    assert not sure.velocity_uncertainty.any()
    scene.apply(gs.SceneUpdate(remove=[names[0]]))
    assert scene.set_states(names[1:], where[1:]) == version + 5


def test_answers_cannot_be_changed(rng) -> None:
    """They are what the scene remembers."""
    scene = scene_of([gs.SceneObject(name, gs.Sphere(1.0)) for name in "ab"])
    near, contacts, seen = scene.distances(1.0), scene.first_contacts(1.0), scene.cull(CAMERA)
    for array in (near.distance, near.normal, contacts.time, contacts.points, contacts.point_offsets):
        with pytest.raises(ValueError, match="read-only"):
            array[...] = 0
    seen.state[:] = 7
    assert scene.cull(CAMERA).state.tolist() != [7, 7]
