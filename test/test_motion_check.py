# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""First contacts beside FCL's conservative advancement: who was wrong is found out, whoever it was."""

from dataclasses import replace

import numpy as np
import pytest

import geomsrv as gs
from geomsrv import motion_check
from geomsrv.cli import main
from geomsrv.motion_check import FOLLOWED, VERDICTS, cross_check_motion, random_scene


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
