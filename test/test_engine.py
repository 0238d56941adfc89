# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""The plan: what is not allowed, not asked for or not there costs nothing, and changes nothing else."""

from __future__ import annotations

import numpy as np
import pytest

import geomsrv as gs
from geomsrv.config import Config
from geomsrv.engine import CONTACTS, DISTANCES, MARKERS, VISIBLE, Engine
from geomsrv.queries import TIERS

EVERYTHING = frozenset({CONTACTS, DISTANCES, VISIBLE, MARKERS})
SQUARE = gs.Polygon([[0, 0], [1, 0], [1, 1], [0, 1]])


def obj(name, shape, position, velocity=(0, 0, 0)):
    return gs.SceneObject(name, shape, (*position, 0, 0, 0, 1), (*velocity, 0, 0, 0))


def make(moving=True, **effects) -> Engine:
    engine = Engine(Config().changed({f"effects.{name}": value for name, value in effects.items()}))
    speed = (1, 0, 0) if moving else (0, 0, 0)
    engine.apply(
        gs.SceneUpdate(
            add=[
                obj("ball", gs.Sphere(0.5), (1.25, 0, 0)),
                obj("box", gs.Box([1, 1, 1]), (0, 0, 0)),
                obj("near", gs.Sphere(0.5), (-1.75, 0, 0)),
                obj("left", SQUARE, (0, 0, 0), speed),
                obj("right", SQUARE, (3, 0, 0)),
            ]
        )
    )
    engine.camera = gs.Frustum([0, 0, -5], np.eye(3), 1, 1, 1, 20)
    return engine


def active(engine, asked=EVERYTHING) -> set[str]:
    return {stage.name for stage in engine.plan(asked) if stage.active}


def test_everything_runs_when_asked_for() -> None:
    engine = make()
    stages = {stage.name: stage for stage in engine.plan(EVERYTHING)}
    assert active(engine) == stages.keys() - {"cross_check", "rotation"}
    assert stages["cross_check"].reason == "cross_check.mode is off"
    answer = engine.evaluate(EVERYTHING)
    assert answer.contacts and answer.distances and answer.visible
    assert answer.contacts.depth.tolist()[0] == pytest.approx(0.25) and answer.contacts.checked == 4
    assert np.isnan(answer.contacts.depth[1]), "left and right do not touch now"


def test_contacts_at_a_distance_and_the_earliest_alone() -> None:
    engine = make()
    engine.configure(engine.config.changed({"contacts.margin": 0.5, "horizon": 3.0}))
    contacts = engine.evaluate(frozenset({CONTACTS})).contacts
    found = dict(zip(zip(contacts.pairs.ids_a, contacts.pairs.ids_b, strict=True), contacts.pairs.time, strict=True))
    assert contacts.margin == 0.5 and found["box", "near"] == 0.0
    assert found["left", "right"] == pytest.approx(1.5, abs=1e-6)
    engine.configure(engine.config.changed({"contacts.margin": 0.0, "contacts.earliest": True}))
    alone = engine.evaluate(frozenset({CONTACTS})).contacts.pairs
    assert (alone.ids_a, alone.ids_b, alone.time.tolist()) == (["ball"], ["box"], [0.0])
    with pytest.raises(gs.GeometryError, match="contacts.margin must be 0 at accuracy exact"):
        engine.config.changed({"contacts.margin": 0.5, "accuracy": "exact"})


@pytest.mark.parametrize(
    ("asked", "runs"),
    [
        (frozenset(), set()),
        ({VISIBLE}, {"cull"}),
        ({DISTANCES}, {"distance", "witness", "penetration"}),
        ({CONTACTS}, {"contact", "first_contact", "contact_set", "penetration"}),
        ({MARKERS}, {"markers", "contact", "first_contact", "contact_set", "penetration"}),
    ],
)
def test_only_what_is_asked_for_runs(asked, runs) -> None:
    engine = make()
    assert active(engine, frozenset(asked)) == runs
    answer = engine.evaluate(frozenset(asked))
    assert (answer.visible is not None) == ("cull" in runs)
    assert (answer.distances is not None) == ("distance" in runs)
    assert (answer.contacts is not None) == ("contact" in runs)
    counted = {name for name, count in engine.counters.items() if count}
    assert counted - {"evaluations", "updates"} == runs - {"markers"}, "the counters prove it"


def test_what_does_not_move_is_not_swept() -> None:
    engine = make(moving=False)
    assert "first_contact" not in active(engine)
    answer = engine.evaluate(EVERYTHING).contacts
    assert engine.counters["first_contact"] == 0 and answer.horizon == engine.config.horizon
    assert answer.pairs.ids_a == ["ball"] and answer.pairs.last_time.tolist() == [engine.config.horizon]


def test_what_does_not_turn_is_not_followed_in_turning() -> None:
    engine = make()
    (stage,) = [stage for stage in engine.plan(EVERYTHING) if stage.name == "rotation"]
    assert (stage.active, stage.reason) == (False, "nothing turns")
    engine.evaluate(EVERYTHING)
    assert engine.counters["rotation"] == 0 < engine.counters["first_contact"]
    spin = gs.SceneObject("spin", gs.Box((2.0, 0.1, 0.1)), (0, 0, 9, 0, 0, 0, 1), (0, 0, 0, 0, 0, 1))
    engine.apply(gs.SceneUpdate(add=[spin, gs.SceneObject("post", gs.Sphere(0.5), (0, 1.5, 9, 0, 0, 0, 1))]))
    assert "rotation" in active(engine)
    answer = engine.evaluate(EVERYTHING).contacts
    assert engine.counters["rotation"] == 1 and ("post", "spin") in zip(
        answer.pairs.ids_a, answer.pairs.ids_b, strict=True
    )
    off = make(first_contact=False)
    assert "rotation" not in active(off)


def test_no_camera_no_culling() -> None:
    engine = make()
    engine.camera = None
    (stage,) = [stage for stage in engine.plan(EVERYTHING) if stage.name == "cull"]
    assert (stage.active, stage.reason) == (False, "no ~/camera_info yet")
    assert engine.evaluate(EVERYTHING).visible is None


FIELDS = ("distance", "lower", "upper", "status")


@pytest.mark.parametrize(
    "effect", ["cull", "distance", "witness", "penetration", "first_contact", "contact_set", "markers"]
)
def test_switching_one_effect_off_leaves_the_rest_bit_identical(effect) -> None:
    full, less = make(), make(**{effect: False})
    whole, rest = full.evaluate(EVERYTHING), less.evaluate(EVERYTHING)
    assert effect not in active(less) and less.counters[effect] == 0
    if effect != "cull":
        assert np.array_equal(whole.visible.state, rest.visible.state)
    if effect == "distance":
        assert rest.distances is None
    elif effect == "penetration":
        apart = whole.distances.distance > 0
        assert apart.any() and np.array_equal(whole.distances.distance[apart], rest.distances.distance[apart])
        assert np.isnan(rest.contacts.depth).all()
    else:
        for name in FIELDS:
            assert np.array_equal(getattr(whole.distances, name), getattr(rest.distances, name)), name
        same = np.array_equal(whole.distances.point_a, rest.distances.point_a)
        assert same == (effect != "witness")
    if effect == "contact_set":
        assert len(rest.contacts.pairs.points) == 0 < len(whole.contacts.pairs.points)
    if effect == "first_contact":
        assert rest.contacts.horizon == 0.0 and rest.contacts.pairs.ids_a == ["ball"]
    else:
        for name in ("status", "time", "time_lower", "time_upper", "last_time", "normal"):
            one, other = getattr(whole.contacts.pairs, name), getattr(rest.contacts.pairs, name)
            assert np.array_equal(one, other, equal_nan=True), name


def test_reconfiguring_replaces_the_cross_check_only_when_it_changes() -> None:
    engine = make()
    before = engine.cross_check
    engine.configure(Config(max_distance=2.0))
    assert engine.cross_check is before and engine.config.max_distance == 2.0
    engine.configure(Config(cross_check_mode="sample"))
    try:
        assert engine.cross_check is not before and engine.cross_check.mode == "sample"
        assert len(engine.scene) == 5, "the scene stays"
    finally:
        engine.close()


def test_failures_are_counted(monkeypatch) -> None:
    engine = make()

    def broken(*_, **__):
        raise ZeroDivisionError

    monkeypatch.setattr(engine.scene, "cull", broken)
    with pytest.raises(ZeroDivisionError):
        engine.evaluate(EVERYTHING)
    assert engine.counters["evaluations failed"] == 1 and engine.failing
    monkeypatch.undo()
    engine.evaluate(EVERYTHING)
    assert engine.counters["evaluations failed"] == 1 and not engine.failing


@pytest.mark.parametrize("tier", TIERS)
def test_every_topic_is_answered_at_the_tier_of_the_configuration(tier) -> None:
    engine = make()
    engine.configure(Config().changed({"accuracy": tier}))
    answer = engine.evaluate(EVERYTHING)
    assert answer.contacts.pairs.cost.accuracy == answer.distances.cost.accuracy == tier
    assert answer.visible.cost.accuracy == tier
    near = set(zip(answer.distances.ids_a, answer.distances.ids_b, strict=True))
    assert near >= {("ball", "box"), ("box", "near")}, "no tier misses a pair"
    if tier != "bound":
        assert answer.contacts.depth.tolist()[0] == pytest.approx(0.25)
