# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""First contacts beside FCL's conservative advancement: who was wrong is found out, whoever it was."""

from dataclasses import replace

import numpy as np
import pytest

import geomsrv as gs
from geomsrv import motion_check
from geomsrv.cli import main
from geomsrv.crosscheck import CrossCheck, SkipReason
from geomsrv.motion_check import FOLLOWED, VERDICTS, cross_check_motion, random_scene
from geomsrv.pairwise import listed_first_contacts


def test_of_all_kinds_only_fcl_is_wrong(rng):
    """And it is: it misses some contacts in every hundred between boxes and hulls."""
    tallies = [cross_check_motion(random_scene(rng, 160), 2.0) for _ in range(3)]
    kinds = {f"{min(p)}-{max(p)}" for p in ((a, b) for a in FOLLOWED for b in FOLLOWED)}
    for tally in tallies:
        assert tally.kinds.keys() == kinds
        assert tally.total("engine_wrong") == tally.total("skipped") == 0, tally.summary()
        assert 0.0 < tally.worst < motion_check.AGREED and tally.total("agreed") > 500
    assert sum(tally.total("fcl_missed") for tally in tallies) >= 1
    assert sum(tally.total(v) for tally in tallies for v in ("too_close", "fcl_off")) <= 6


@pytest.mark.parametrize(
    ("fault", "verdict"),
    [
        (lambda answer: replace(answer, time=answer.time + 0.1), "engine_wrong"),
        (lambda answer: replace(answer, time=answer.time - 0.1), "engine_wrong"),
        (lambda answer: replace(answer, status=0 * answer.status, time=np.nan * answer.time), "engine_wrong"),
        (lambda answer: answer, "agreed"),
    ],
    ids=["late", "early", "missed", "right"],
)
def test_fault_of_ours_is_told(monkeypatch, fault, verdict):
    cube, asked = gs.Box([0.5, 0.5, 0.5]), motion_check.listed_first_contacts
    scene = gs.Scene()
    moving = gs.SceneObject("a", cube, (0, 0, 0, 0, 0, 0, 1), (1, 0, 0, 0, 0, 0))
    scene.apply(gs.SceneUpdate(add=[moving, gs.SceneObject("b", cube, (3, 0.25, 0.125, 0, 0, 0, 1))]))
    monkeypatch.setattr(motion_check, "listed_first_contacts", lambda *a, **k: fault(asked(*a, **k)))
    tally = cross_check_motion(scene, 4.0)
    assert {name: tally.total(name) for name in VERDICTS if tally.total(name)} == {verdict: 1}


def test_what_stands_turns_or_is_allowed_is_not_asked():
    cube = gs.Box([0.5, 0.5, 0.5])
    twists = {"a": (1, 0, 0, 0, 0, 0), "b": (1, 0, 0, 0, 0, 0), "c": (0, 0, 0, 0, 0, 1), "d": (0,) * 6}
    objects = [gs.SceneObject(n, cube, (1.5 * k, 0, 0, 0, 0, 0, 1), twists[n]) for k, n in enumerate(twists)]
    scene = gs.Scene()
    scene.apply(gs.SceneUpdate(add=objects, allow=[("a", "d")]))
    tally = cross_check_motion(scene, 4.0)
    # b and d, face to face, where FCL sees no contact.
    assert {kind: dict(counts) for kind, counts in tally.kinds.items()} == {"box-box": {"fcl_missed": 1}}


def test_command(capsys):
    assert main(["crosscheck", "--motion", "60"]) == 0
    *rows, last = capsys.readouterr().out.splitlines()
    assert last.startswith("motion: ") and " 0 engine_wrong" in last and any("box-convex" in row for row in rows)
    assert main(["crosscheck", "--motion", "1"]) == 2
    assert "--motion must be at least 2, got 1" in capsys.readouterr().err


@pytest.mark.parametrize("horizon", [0.0, -1.0, np.inf, "soon"])
def test_horizon_has_an_end(horizon):
    with pytest.raises(gs.GeometryError, match="horizon"):
        cross_check_motion(gs.Scene(), horizon)


# -------------------------------------------------------------------------------------- beside the engine's own answers


def listed(scene, horizon, **faults):
    """All pairs of a scene, and what is answered about them."""
    world = scene.world
    pairs = np.array([(i, j) for j in range(len(world)) for i in range(j)])
    answer = listed_first_contacts(world, pairs, horizon)
    return world, pairs, replace(answer, **{name: fault(getattr(answer, name)) for name, fault in faults.items()})


def two(a, b, way=(1.0, 0.0, 0.0, 0.0, 0.0, 0.0), at=(3.0, 0.25, 0.125)):
    scene = gs.Scene()
    moving = gs.SceneObject("a", a, (0, 0, 0, 0, 0, 0, 1), way)
    scene.apply(gs.SceneUpdate(add=[moving, gs.SceneObject("b", b, (*at, 0, 0, 0, 1))]))
    return scene


CUBE = gs.Box([0.5, 0.5, 0.5])


def test_answers_are_tallied_beside_distances(rng):
    scene = random_scene(rng, 60)
    with CrossCheck("all", queue_limit=10_000) as check:
        world, pairs, answer = listed(scene, 2.0)
        assert check.submit_motion(world, pairs, answer, 2.0) == len(pairs)
        assert check.drain()
        tally = check.tally()
    assert tally.offered == len(pairs) == tally.agreed + tally.explained + tally.skipped
    assert tally.unexplained == tally.engine_wrong == 0 and tally.agreed > 1500
    assert all(kind.startswith("motion ") for kind in tally.kinds) and "motion box-sphere" in tally.kinds


@pytest.mark.parametrize("late", [0.1, -0.1, np.nan])
def test_a_fault_of_ours_is_told_in_the_tally(late):
    world, pairs, answer = listed(two(CUBE, CUBE), 4.0, time=lambda t: t + late)
    with CrossCheck("all") as check:
        check.submit_motion(world, pairs, answer, 4.0)
        assert check.drain()
        tally, (found,) = check.tally(), check.poll()
    assert tally.kinds["motion box-box"].engine_wrong == tally.unexplained == 1 and tally.recent == (found,)
    assert "THE ENGINE IS WRONG" in str(found) and "(a / b)" in str(found) and "first contact differs" in str(found)
    names = {"gs": gs, "h": float.fromhex, "first_contact_of_two": motion_check.first_contact_of_two}
    assert eval(found.reproducer(), names).time.tolist() == [2.0]


def test_what_fcl_misses_is_explained():
    world, pairs, answer = listed(two(CUBE, CUBE, at=(3.0, 0.0, 0.0)), 4.0)
    with CrossCheck("all") as check:
        check.submit_motion(world, pairs, answer, 4.0)
        assert check.drain()
        (found,) = check.poll()
    assert found.explained and found.time == 2.0 and np.isnan(found.fcl_time) and "fcl never" in str(found)


def test_what_fcl_is_not_asked_about_is_counted():
    ball, spin = gs.Sphere(0.5), (1.0, 0, 0, 0, 0, 1.0)
    with CrossCheck("all") as check:
        for scene in (two(CUBE, gs.Cone(0.5, 1.0)), two(CUBE, ball, spin)):
            assert check.submit_motion(*listed(scene, 4.0), 4.0) == 0
        tally = check.tally()
        assert tally.reasons == {SkipReason.UNSUPPORTED_BY_FCL: 2} and tally.offered == tally.skipped == 2
        assert check.submit_motion(*listed(two(CUBE, ball, 6 * (0.0,)), 4.0), 4.0) == 0  # at rest: no motion
        # Without an end only what meets can be followed, up to twice its time.
        assert check.submit_motion(*listed(two(CUBE, ball), np.inf), np.inf) == 1
        assert check.submit_motion(*listed(two(CUBE, ball, (-1.0, 0, 0, 0, 0, 0)), np.inf), np.inf) == 0
        assert check.drain() and check.tally().agreed == 1
    with CrossCheck("off") as check:
        assert check.submit_motion(*listed(two(CUBE, ball), 4.0), 4.0) == 0


def test_what_touches_now_and_parts_is_nobodys_fault():
    for way in ((1.0, 0, 0), (-1.0, 0, 0), (0, 1.0, 0)):
        for x in (1.0, 1.0 - 1e-7, 0.5):
            with CrossCheck("all") as check:
                check.submit_motion(*listed(two(CUBE, CUBE, (*way, 0, 0, 0), (x, 0.0, 0.0)), 4.0), 4.0)
                assert check.drain()
                assert check.tally().unexplained == 0, (way, x, check.tally().recent)


def test_the_sample_and_the_queue_are_bounded(rng):
    world, pairs, answer = listed(random_scene(rng, 40), 2.0)
    with CrossCheck("sample", sample_fraction=0.25, queue_limit=50, seed=3) as check:
        assert 0 < check.submit_motion(world, pairs, answer, 2.0) <= 50
        assert check.drain()
        tally = check.tally()
    assert tally.offered == len(pairs) == tally.not_sampled + tally.agreed + tally.explained + tally.skipped
    assert tally.reasons[SkipReason.DROPPED] > 0 and 0.6 < tally.not_sampled / len(pairs) < 0.9
