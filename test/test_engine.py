# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""The plan: what is not allowed, not asked for or not there costs nothing, and changes nothing else."""

from __future__ import annotations

import itertools
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import geomsrv as gs
from geomsrv.config import Config
from geomsrv.effects import CONTACTS, DISTANCES, EFFECTS, MARKERS, VISIBLE
from geomsrv.engine import Engine
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
    assert active(engine) == stages.keys() - {"cross_check", "motion_check", "rotation"}
    assert stages["cross_check"].reason == stages["motion_check"].reason == "cross_check.mode is off"
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
    assert (stage.active, stage.reason) == (False, "no shape has angular velocity")
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


# ---------------------------------------------------------------------------------------------- all pairs of effects

OPTIONAL = tuple(effect.name for effect in EFFECTS if effect.optional)
DEPENDS = {"witness": {"distance"}, "rotation": {"first_contact"}, "cross_check": {"distance"}}


def crowded(**modes: str) -> Engine:
    """Everything that an effect could be about: pairs apart, deep, moving, turning, seen."""
    engine = make(**modes)
    spin = gs.SceneObject("spin", gs.Box((2.0, 0.1, 0.1)), (0, 0, 9, 0, 0, 0, 1), (0, 0, 0, 0, 0, 1))
    engine.apply(gs.SceneUpdate(add=[spin, gs.SceneObject("post", gs.Sphere(0.5), (0, 1.5, 9, 0, 0, 0, 1))]))
    return engine


def outputs(engine: Engine) -> dict[str, bytes]:
    """What each effect adds to an evaluation, in bytes; empty if nothing."""
    got = engine.evaluate(EVERYTHING)
    out = dict.fromkeys(OPTIONAL, b"")
    if got.visible is not None:
        out["cull"] = got.visible.state.tobytes() + got.visible.certain.tobytes()
    if (near := got.distances) is not None:
        apart = near.distance > 0
        out["distance"] = b"".join(x[apart].tobytes() for x in (near.distance, near.lower, near.upper, near.status))
        if not np.isnan(near.point_a[apart]).all():
            out["witness"] = b"".join(x[apart].tobytes() for x in (near.point_a, near.point_b, near.normal))
    if (contacts := got.contacts) is not None:
        out["penetration"] = contacts.depth[~np.isnan(contacts.depth)].tobytes()
        rows = contacts.pairs
        turning = np.array(["spin" in pair for pair in zip(rows.ids_a, rows.ids_b, strict=True)], dtype=bool)
        later = (rows.time > 0) & ~turning
        out["first_contact"] = rows.time[later].tobytes() + rows.normal[later].tobytes()
        out["rotation"] = rows.time[turning & (rows.time > 0)].tobytes()
        out["contact_set"] = b"".join(
            rows.points[rows.point_offsets[k] : rows.point_offsets[k + 1]].tobytes() for k in np.flatnonzero(~turning)
        )
    return out


WHOLE = outputs(crowded())


def test_every_effect_has_something_to_say() -> None:
    assert {name for name, value in WHOLE.items() if value} == set(OPTIONAL) - {"cross_check", "markers"}


@pytest.mark.parametrize(("one", "other"), list(itertools.combinations(OPTIONAL, 2)))
def test_two_effects_off_leave_the_others_bit_identical(one, other) -> None:
    off = {one, other}
    gone = off | {name for name, needs in DEPENDS.items() if needs & off}
    engine = crowded(**dict.fromkeys(off, "off"))
    left = outputs(engine)
    for name in OPTIONAL:
        if name in gone:
            assert left[name] == b"" and engine.counters[name] == 0, f"{name} ran"
        elif name == "contact_set" and "first_contact" in off:
            assert WHOLE[name].startswith(left[name]) and left[name], "what touches later has no points now"
        else:
            assert left[name] == WHOLE[name], name
    stages = {stage.name: stage for stage in engine.plan(EVERYTHING)}
    assert all(f"switched off by effects.{name}" == stages[name].reason for name in off)


def test_switched_on_is_asked_for_by_nobody() -> None:
    engine = crowded(rotation="on", cull="on")
    stages = {stage.name: stage for stage in engine.plan(frozenset())}
    assert {name for name, stage in stages.items() if stage.active} == {"cull", "contact", "first_contact", "rotation"}
    assert {stages[name].reason for name in ("contact", "first_contact", "rotation")} == {
        "switched on by effects.rotation"
    }
    answer = engine.evaluate(frozenset())
    assert answer.contacts is not None and answer.visible is not None and answer.distances is None
    assert len(answer.contacts.pairs.points) == 0 and engine.counters["contact_set"] == 0


def test_what_turns_is_not_followed_when_that_is_off() -> None:
    rows = crowded(rotation="off").evaluate(EVERYTHING).contacts.pairs
    assert [x for x in rows.unsupported if "spin" in x] == [
        ("post", "spin", "first contact of what turns is switched off")
    ]


def test_words_that_yaml_reads_as_booleans() -> None:
    config = Config().changed({"effects.cull": False, "effects.witness": True, "cross_check.mode": False})
    assert (config.effects_cull, config.effects_witness, config.cross_check_mode) == ("off", "on", "off")
    with pytest.raises(gs.GeometryError, match="effects.cull must be one of auto, on, off, got 'maybe'"):
        Config().changed({"effects.cull": "maybe"})


def test_first_contacts_are_handed_to_the_cross_check(monkeypatch) -> None:
    """Those of what moves, unless they are at a margin, or off."""
    for changes, count in (({}, 1), ({"contacts_margin": 0.1}, 0), ({"effects_cross_check": "off"}, 0)):
        engine = make()
        engine.configure(Config(cross_check_mode="all", accuracy="float64", **changes))
        taken: list[tuple] = []
        monkeypatch.setattr(engine.cross_check, "submit_motion", lambda *given, taken=taken: taken.append(given))
        engine.evaluate(frozenset({CONTACTS}))
        assert len(taken) == count == engine.counters["motion_check"], changes
        for world, pairs, answer, horizon in taken:
            names = [(world.ids[i], world.ids[j]) for i, j in pairs.tolist()]
            assert names == list(zip(answer.ids_a, answer.ids_b, strict=True)) and horizon == engine.config.horizon
        engine.close()


def test_the_cross_check_can_be_switched_alone() -> None:
    config = Config(cross_check_mode="all", effects_cross_check="off")
    engine = Engine(config)
    assert engine.cross_check.mode == "off"
    (stage,) = [stage for stage in engine.plan(EVERYTHING) if stage.name == "cross_check"]
    assert (stage.active, stage.reason) == (False, "switched off by effects.cross_check")
    engine.configure(Config(effects_cross_check="on"))
    try:
        assert engine.cross_check.mode == "all"
    finally:
        engine.close()


def test_the_page_shows_what_runs() -> None:
    """docs/effects.md: its table and its plans are those of the sources."""
    root = Path(__file__).resolve().parents[1]
    run = subprocess.run([sys.executable, "-P", str(root / "tools" / "write_effects.py"), "--check"], check=False)
    assert run.returncode == 0, "run tools/write_effects.py"
