#!/usr/bin/env python3
# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""Writes docs/effects.md: the table of effects, the plans of three scenes, and what each effect costs in the third.

Times are measured here and now; ``--check`` compares all but these, so that the page cannot rot.
"""

from __future__ import annotations

import statistics
import sys
import time
from pathlib import Path

import numpy as np

import geomsrv as gs
from geomsrv.config import Config
from geomsrv.effects import CONTACTS, DISTANCES, EFFECTS, MARKERS, VISIBLE
from geomsrv.engine import Engine

ROOT = Path(__file__).resolve().parents[1]
PAGE = ROOT / "docs" / "effects.md"
sys.path.insert(0, str(ROOT / "demo"))

ROUNDS = 15

HEAD = """# Effects: only what a scene calls for

An evaluation of the node has effects, such as distances, contact points or the drawing. Each is a row of one table
(`geomsrv/effects.py`). The plan is the least set of them for what is demanded now, and each that is left out says why. `~/state` has
the plan (`plan_stages`, `plan_active`, `plan_reasons`, and `scene_plan` in words), and counters that stay at zero for what never ran.

A row runs if
1. it is **asked for**: somebody subscribes to one of its topics, a request names it in `want`, or its parameter `effects.<name>` is `on`;
2. what it **needs** runs;
3. the **scene calls for it**: nothing moves, so nothing is swept; nothing turns, so nothing is followed step by step;
4. its parameter is not `off`. The parameters are `auto` (the default), `on` and `off`; `true` and `false` will do, as YAML makes them of
   `on` and `off`. Switched off, a request that wants it is answered `NOT_AVAILABLE`, or, of `rotation`, pairs that turn `UNSUPPORTED`.

Switching effects off leaves all others as they are, bit by bit: `test/test_engine.py` goes through all pairs of them.

| effect | what it adds | asked for by | needs | parameter |
|---|---|---|---|---|
"""

METHODS = """
## What the scene decides

| in the scene | what is done |
|---|---|
| pairs of which neither object changed | what was found of them is remembered: the same bits, no look at them (`remembered` in the counts) |
| an object that moves among many that rest | its box is compared with the others', and its pairs are found anew |
| translation | closed forms, and rays against the difference of hulls |
| angular velocity, round bodies and half spaces that move | conservative advancement, for just these pairs |
| objects out of reach within the horizon, or outside the view | their boxes are looked at, nothing else |
| a margin, uncertainty | wider boxes, and intervals that cover both |
| `~/states` that repeat themselves while nobody listens | looked at about once a second (`idle_rate`), and first thing when somebody asks |

`make bench` prints the ratios: one of 10,000 boxes moves, to all; nothing moves, to all; a scene in which nothing turns, to the same
without the rotation stage; and the share of a core that the node takes while 1,000 states come in 100 times a second.

`gs.Scene.forget()` drops what is remembered; answers stay the same.
"""


def view_only() -> Engine:
    """A camera in front of shelves: culling only."""
    engine = Engine(Config())
    rows = [(x, y, 0.5, 0, 0, 0, 1) for x in range(10) for y in range(10)]
    engine.apply(
        gs.SceneUpdate(add=[gs.SceneObject(f"box/{k}", gs.Box([0.2, 0.2, 0.2]), p) for k, p in enumerate(rows)])
    )
    engine.camera = gs.Frustum.look_at([-2, 4, 1], [4, 4, 0.5], [0, 0, 1], 0.8, 4 / 3, 0.1, 10.0)
    return engine


def mobile_robot() -> Engine:
    """A footprint on an arc among posts, in the plane."""
    engine = Engine(Config())
    robot = gs.Polygon([[-0.3, -0.2], [0.4, -0.2], [0.4, 0.2], [-0.3, 0.2]])
    post = gs.Polygon([[-0.1, -0.1], [0.1, -0.1], [0.1, 0.1], [-0.1, 0.1]])
    objects = [gs.SceneObject("robot", robot, (0, 0, 0, 0, 0, 0, 1), (0.5, 0, 0, 0, 0, 0.3))]
    objects += [gs.SceneObject(f"post/{k}", post, (k, 1.0, 0, 0, 0, 0, 1)) for k in range(8)]
    engine.apply(gs.SceneUpdate(add=objects))
    return engine


def arm_in_a_cell() -> Engine:
    """The demo's Panda, with everything on."""
    import cell

    engine = Engine(Config())
    panda = cell.robot()
    links = panda.objects(cell.JOINTS, velocities=cell.SWING)
    engine.apply(gs.SceneUpdate(add=[*links, *cell.furniture(), cell.footprint()], allow=cell.allowed_pairs(panda)))
    engine.camera = cell.camera_frustum()
    return engine


SCENES = (
    ("A camera that culls, nothing else", view_only, frozenset({VISIBLE})),
    ("A mobile robot with its footprint", mobile_robot, frozenset({CONTACTS})),
    ("An arm in a cell, everything on", arm_in_a_cell, frozenset({CONTACTS, DISTANCES, VISIBLE, MARKERS})),
)


def plan_text(engine: Engine, asked: frozenset[str]) -> str:
    """The plan as lines, and that of the scene."""
    stages = engine.plan(asked)
    width = max(len(stage.name) for stage in stages)
    lines = [f"{stage.name:{width}}  {'runs' if stage.active else '-   '}  {stage.reason}" for stage in stages]
    return "\n".join([*lines, "", engine.scene.plan()])


def cost_table(engine: Engine, asked: frozenset[str]) -> str:
    """What an evaluation takes without each effect."""

    def once() -> float:
        engine.scene.forget()
        begin = time.thread_time()
        engine.evaluate(asked)
        return 1e3 * (time.thread_time() - begin)

    optional = [stage.name for stage in engine.plan(asked) if stage.active and stage.name not in ("contact", "markers")]
    whole: list[float] = []
    without: dict[str, list[float]] = {name: [] for name in optional}
    for turn in range(ROUNDS + 1):  # the first warms up
        for name in (None, *optional):
            engine.configure(Config().changed({} if name is None else {f"effects.{name}": "off"}))
            spent = once()
            if turn:
                (whole if name is None else without[name]).append(spent)
    engine.configure(Config())
    full = statistics.median(whole)
    lines = [f"| everything | {full:.1f} ms | |"]
    for name, times in without.items():
        rest = statistics.median(times)
        lines.append(f"| without {name} | {rest:.1f} ms | {round(100 * (full - rest) / full)} % |")
    return "\n".join(["| evaluation, nothing remembered | CPU time | saved |", "|---|---|---|", *lines])


def page(measured: bool) -> str:
    """All of it."""
    text = HEAD
    for effect in EFFECTS:
        topics = ", ".join(f"`~/{topic}`" for topic in effect.topics)
        needs = ", ".join(effect.needs)
        text += f"| {effect.name} | {effect.gives} | {topics} | {needs} | {'`effects.' + effect.name + '`' if effect.optional else ''} |\n"
    text += METHODS + "\n## Three scenes\n"
    for title, make, asked in SCENES:
        engine = make()
        topics = ", ".join(f"`~/{topic}`" for topic in sorted(asked))
        text += f"\n### {title}\n\nSomebody listens to {topics}.\n\n```text\n{plan_text(engine, asked)}\n```\n"
    if measured:
        text += "\n## What each effect costs\n\nIn the third scene, which `make demo` shows; medians of "
        text += (
            f"{ROUNDS} evaluations that take turns, on one core of the machine that the pages here were made on.\n\n"
        )
        text += cost_table(engine, asked)
        text += "\n"
    return text


def main() -> int:
    """Write the page, or compare what is not measured."""
    if "--check" not in sys.argv[1:]:
        PAGE.write_text(page(measured=True), encoding="utf-8")
        return 0
    old = PAGE.read_text(encoding="utf-8")
    return 0 if old.startswith(page(measured=False)) else 1


if __name__ == "__main__":
    np.seterr(all="raise", under="ignore", invalid="ignore")
    sys.exit(main())
