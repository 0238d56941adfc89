# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""Benchmarks: ns per item, ratio to numpy doing the same, ratio to python-fcl where it can; then the node's latencies.

Contenders of one scenario take turns in one process, so a drifting machine slows all alike; medians are printed, of
CPU time of the one thread that works, so that other users of the machine do not count.
Run as ``python bench/run.py [--quick] [--only TEXT] [--json FILE]``.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import statistics
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

# One core for all contenders; must be set before numpy is loaded.
for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[variable] = "1"

import baselines  # noqa: E402
import numpy as np  # noqa: E402
import ros  # noqa: E402
import scenarios  # noqa: E402
from rich.console import Console  # noqa: E402
from rich.table import Table  # noqa: E402

import geomsrv as gs  # noqa: E402

Call = Callable[[], object]

TREMBLE = 2.0**-30  # [m] so that every step is one in which everything moved

DRIVE = np.array([0.5, 0.0, 0.4])  # a robot's twist


@dataclass
class Scenario:
    """One question; every contender is a call and how many items it answers."""

    name: str
    target_ns: float | None
    ours: tuple[Call, int]
    numpy: tuple[Call, int] | None = None
    fcl: tuple[Call, int] | None = None
    median_ns: dict[str, float] = field(default_factory=dict)

    def run(self, rounds: int) -> None:
        """Time all contenders, taking turns."""
        contenders = {k: c for k, c in (("ours", self.ours), ("numpy", self.numpy), ("fcl", self.fcl)) if c}
        samples: dict[str, list[float]] = {key: [] for key in contenders}
        for turn in range(rounds + 1):  # the first turn warms up
            for key, (call, items) in contenders.items():
                begin = time.thread_time_ns()
                call()
                if turn:
                    samples[key].append((time.thread_time_ns() - begin) / items)
        self.median_ns = {key: statistics.median(values) for key, values in samples.items()}


def declare(quick: bool) -> list[Scenario]:
    """The table of scenarios."""
    cut = 10 if quick else 1
    frustum, boxes = scenarios.boxes_half_visible(100_000 // cut)
    visible = float(np.mean(gs.cull(frustum, boxes).state != gs.OUTSIDE))
    _, points = scenarios.points_around_frustum(1_000_000 // cut)
    a, b, velocity_a, velocity_b = scenarios.moving_polygons(100_000 // cut)
    hits = float(np.mean(gs.first_contact(a, b, velocity_a, velocity_b).status == gs.WILL_TOUCH))
    box_a, box_b, turning = scenarios.turning_boxes(20_000 // cut)
    turning_hits = float(np.mean(gs.first_contact(box_a, box_b, **turning, t_max=5.0).status == gs.WILL_TOUCH))
    scan = scenarios.laser_scan(20_000 // cut)
    few = 1000
    single_boxes = [gs.Box(h) for h in boxes.half_extents[:few]]
    box_poses = scenarios.relative_poses(few, 0.5, 8.0)
    table = [
        Scenario(
            f"cull, boxes, {visible:.0%} visible",
            60.0,
            (lambda: gs.cull(frustum, boxes), len(boxes)),
            (lambda: baselines.numpy_cull(frustum, boxes), len(boxes)),
            (baselines.fcl_pairs(frustum, single_boxes[0], box_poses, "collide"), few),
        ),
        Scenario(
            "point to frustum distance",
            10.0,
            (lambda: gs.distance_to_frustum(frustum, points), len(points)),
            (lambda: baselines.numpy_distance_to_frustum(frustum, points), len(points)),
            (baselines.fcl_pairs(frustum, gs.Sphere(0.0), box_poses, "distance"), few),
        ),
        Scenario(
            "point to frustum, with nearest points",
            None,
            (lambda: gs.distance_to_frustum(frustum, points, want=("distance", "witness")), len(points)),
        ),
        Scenario(
            f"first contact, polygons 4-16, {hits:.0%} hits",
            200.0,
            (lambda: gs.first_contact(a, b, velocity_a, velocity_b), len(a)),
            (lambda: baselines.numpy_first_contact(a, b, velocity_a, velocity_b), len(a)),
        ),
        Scenario(
            f"first contact, polygons 4-16, {hits:.0%} hits, no points",
            200.0,
            (lambda: gs.first_contact(a, b, velocity_a, velocity_b, contact_set=False), len(a)),
        ),
        Scenario("polygon distance 4-16", None, (lambda: gs.distance(a, b), len(a))),
        Scenario(
            f"first contact, turning boxes to 1 us, {turning_hits:.0%} hits",
            10_000.0,
            (lambda: gs.first_contact(box_a, box_b, **turning, t_max=5.0), len(box_a)),
        ),
        Scenario(
            "time to collision, points of a scan, robot on an arc",
            100.0,
            (lambda: gs.time_to_collision(scenarios.FOOTPRINT, DRIVE, scan, t_max=2.0), len(scan)),
        ),
    ]
    moving_boxes = scenarios.moving_boxes(100_000 // cut)
    for name, given in (("boxes", moving_boxes), ("boxes, most apart", scenarios.off_course(moving_boxes))):
        touch = float(np.mean(gs.first_contact(*given).status == gs.WILL_TOUCH))
        label = f"first contact, {name}, {touch:.0%} hits, no points"
        ask = partial(gs.first_contact, *given, contact_set=False)
        table.append(Scenario(label, 30.0, (ask, len(given[0]))))
    moving_hulls = scenarios.moving_hulls(100_000 // cut)
    for name, given, target in (("boxes", moving_boxes, None), ("hulls 8-32", moving_hulls, 1000.0)):
        touch = float(np.mean(gs.first_contact(*given).status == gs.WILL_TOUCH))
        label = f"first contact, {name}, {touch:.0%} hits"
        table.append(Scenario(label, target, (partial(gs.first_contact, *given), len(given[0]))))
    ask = partial(gs.first_contact, *moving_hulls, contact_set=False)
    table.append(Scenario(f"{label}, no points", 1000.0, (ask, len(moving_hulls[0]))))
    far = scenarios.relative_poses(10_000 // cut, 0.35, 1.0)
    near = scenarios.relative_poses(10_000 // cut, 0.0, 0.1)
    for name, (p, q) in scenarios.SHAPE_PAIRS.items():
        by_numpy = None
        if name == "sphere-sphere":
            by_numpy = (lambda p=p, q=q: baselines.numpy_sphere_sphere(far, p.radius, q.radius), len(far))
        table.append(
            Scenario(
                f"distance {name}, apart",
                None,
                (lambda p=p, q=q: gs.distance(p, q, far), len(far)),
                by_numpy,
                (baselines.fcl_pairs(p, q, far[:few], "distance"), few),
            )
        )
        table.append(
            Scenario(
                f"penetration {name}, overlapping",
                None,
                (lambda p=p, q=q: gs.distance(p, q, near, want=("penetration",)), len(near)),
                fcl=(baselines.fcl_pairs(p, q, near[:few], "collide"), few),
            )
        )
    table += _scene_scenarios(1_000 if quick else 10_000)
    return table


def _scene_scenarios(n: int) -> list[Scenario]:
    """A world of boxes at the density of a cluttered cell, one evaluation an item-shape."""
    rng = np.random.default_rng(scenarios.SEED)
    side = (n * 0.05) ** (1 / 3)
    scene = gs.Scene()
    poses = scenarios.relative_poses(n, 0.0, 1.0)
    poses[:, :3] = rng.uniform(0.0, side, (n, 3))
    boxes = [gs.Box(h) for h in rng.uniform(0.02, 0.1, (n, 3))]
    scene.apply(
        gs.SceneUpdate(add=[gs.SceneObject(str(i), s, p) for i, (s, p) in enumerate(zip(boxes, poses, strict=True))])
    )
    ids = scene.ids

    def step() -> object:
        scene.set_states(ids, poses)
        scene.forget()
        return scene.distances(0.02)

    return [Scenario(f"scene step, {n:,} boxes, pairs within 2 cm", None, (step, n)), _crowd()]


def _crowd() -> Scenario:
    """A thousand boxes of 10 to 50 cm on their ways through a hall; its target is 2 ms for all of them."""
    n, horizon, side = 1_000, 2.0, 20.0
    rng = np.random.default_rng(scenarios.SEED)
    poses = scenarios.relative_poses(n, 0.0, 1.0)
    poses[:, :3] = rng.uniform(0.0, side, (n, 3))
    twists = np.zeros((n, 6))
    twists[:, :3] = 0.5 * rng.normal(size=(n, 3))
    boxes = [gs.Box(h) for h in rng.uniform(0.05, 0.25, (n, 3))]
    scene = gs.Scene()
    objects = zip(boxes, poses, twists, strict=True)
    scene.apply(gs.SceneUpdate(add=[gs.SceneObject(str(i), s, p, v) for i, (s, p, v) in enumerate(objects)]))
    ids = scene.ids

    def step() -> object:
        poses[:, 0] += TREMBLE
        scene.set_states(ids, poses, twists)
        return scene.first_contacts(horizon)

    return Scenario(f"scene, {n:,} moving boxes, first contacts within 2 s", 2e6 / n, (step, n))


@dataclass
class Price:
    """What a stronger answer costs: the same call twice, as ratio of CPU times."""

    name: str
    most: float  # the ratio wanted
    items: int
    plain: Call
    stronger: Call
    ns: tuple[float, float] = (0.0, 0.0)
    most_ns: float | None = None

    def run(self, rounds: int) -> None:
        """Time both, taking turns."""
        samples: tuple[list[float], list[float]] = ([], [])
        for turn in range(rounds + 1):  # the first turn warms up
            for call, times in zip((self.plain, self.stronger), samples, strict=True):
                begin = time.thread_time_ns()
                call()
                if turn:
                    times.append((time.thread_time_ns() - begin) / self.items)
        self.ns = (statistics.median(samples[0]), statistics.median(samples[1]))

    @property
    def met(self) -> bool:
        """Whether both wishes came true."""
        return self.ns[1] <= self.most * self.ns[0] and (self.most_ns is None or self.ns[1] <= self.most_ns)


def prices(quick: bool) -> list[Price]:
    """Exact against float64, and with a certificate against without."""
    cut = 10 if quick else 1
    camera, boxes = scenarios.boxes_half_visible(100_000 // cut)
    _, points = scenarios.points_around_frustum(1_000_000 // cut)
    a, b, velocity_a, velocity_b = scenarios.moving_polygons(100_000 // cut)
    few = 10_000 // cut
    deep = ("distance", "penetration")
    calls: list[tuple[str, float, float | None, int, Callable[..., object]]] = [
        ("cull, generic", 1.3, None, len(boxes), lambda **k: gs.cull(camera, boxes, **k)),
        ("point to frustum, generic", 1.3, None, len(points), lambda **k: gs.distance_to_frustum(camera, points, **k)),
        (
            "first contact of polygons, generic",
            1.3,
            None,
            len(a),
            lambda **k: gs.first_contact(a, b, velocity_a, velocity_b, **k),
        ),
    ]
    for name, moving in (("boxes", scenarios.moving_boxes), ("hulls 8-32", scenarios.moving_hulls)):
        given = moving(few)
        calls.append(
            (f"first contact of {name}", 2.0, None, few, lambda given=given, **k: gs.first_contact(*given, **k))
        )
    far, near = scenarios.relative_poses(few, 0.35, 1.0), scenarios.relative_poses(few, 0.0, 0.1)
    for name in ("box-box", "hull16-hull16", "hull64-hull64"):
        p, q = scenarios.SHAPE_PAIRS[name]
        calls += [
            (f"distance {name}, apart", 2.0, None, few, lambda p=p, q=q, **k: gs.distance(p, q, far, **k)),
            (f"penetration {name}", 2.0, None, few, lambda p=p, q=q, **k: gs.distance(p, q, near, want=deep, **k)),
        ]
    for degrees in (0, 30):
        view, seen = scenarios.view_of_a_warehouse(few, degrees)
        left, right = scenarios.warehouse(few, degrees)
        calls += [
            (f"cull, all touch, turned {degrees}", 20.0, 5000.0, few, lambda v=view, s=seen, **k: gs.cull(v, s, **k)),
            (
                f"distance box-box, all touch, turned {degrees}",
                20.0,
                None,
                few,
                lambda p=left, q=right, **k: gs.distance(p, q, **k),
            ),
        ]
    table = []
    for name, most, most_ns, items, call in calls:
        exact = lambda call=call: call(accuracy="exact")  # noqa: E731
        table.append(Price(f"exact: {name}", most, items, call, exact, most_ns=most_ns))
        if most_ns is None and most < 20.0:
            proven = lambda call=call: call(certificates=True)  # noqa: E731
            table.append(Price(f"certificate: {name}", 2.0, items, call, proven))
    return table


def effects(quick: bool) -> list[Price]:
    """What does not happen in a scene, as a share of the cost of a scene in which it does."""
    n = 1_000 if quick else 10_000
    rng = np.random.default_rng(scenarios.SEED)
    side = (n * 0.4) ** (1 / 3)
    poses = scenarios.relative_poses(n, 0.0, 1.0)
    poses[:, :3] = rng.uniform(0.0, side, (n, 3))
    moving = np.hstack([0.2 * rng.normal(size=(n, 3)), 0.2 * rng.normal(size=(n, 3)) * (rng.random((n, 1)) < 0.1)])
    boxes = [gs.Box(h) for h in rng.uniform(0.05, 0.2, (n, 3))]
    camera = gs.Frustum([0, 0, -1], np.eye(3), 1.0, 1.0, 0.1, 10.0)

    def world(twists: np.ndarray) -> gs.Scene:
        scene = gs.Scene()
        rows = zip(boxes, poses, twists, strict=True)
        scene.apply(gs.SceneUpdate(add=[gs.SceneObject(str(i), s, p, v) for i, (s, p, v) in enumerate(rows)]))
        return scene

    def step(scene: gs.Scene, ids: tuple[str, ...], here: np.ndarray, twists: np.ndarray) -> None:
        here[:, 0] += TREMBLE
        scene.set_states(ids, here, twists)
        scene.distances(0.05)
        scene.first_contacts(1.0)
        scene.cull(camera)

    busy, calm, sliding = world(moving), world(np.zeros_like(moving)), world(moving * [1, 1, 1, 0, 0, 0])
    name, one = calm.ids[:1], poses[[int(calm.ids[0])]]
    order = np.array([int(i) for i in busy.ids])
    here = poses[order].copy()

    def slide(rotation: bool) -> None:
        sliding.forget()
        sliding.first_contacts(1.0, rotation=rotation)

    return [
        Price(
            f"one of {n:,} boxes moves, to all",
            0.02,
            n,
            lambda: step(busy, busy.ids, here, moving[order]),
            lambda: step(calm, name, one, moving[:1]),
        ),
        Price(
            "nothing moves, to all",
            0.02,
            n,
            lambda: step(busy, busy.ids, here, moving[order]),
            lambda: _rest(calm, camera),
        ),
        Price("nothing turns, to no rotation stage", 1.02, n, lambda: slide(False), lambda: slide(True)),
    ]


def _rest(scene: gs.Scene, camera: gs.Frustum) -> None:
    """A step in which nothing moved."""
    scene.distances(0.05)
    scene.first_contacts(1.0)
    scene.cull(camera)


def verifications_per_second(quick: bool) -> float:
    """How many certificates the independent checker proves in a second, of all queries together."""
    few = 100 if quick else 500
    camera, boxes = scenarios.boxes_half_visible(few)
    a, b, velocity_a, velocity_b = scenarios.moving_polygons(few)
    p, q = scenarios.SHAPE_PAIRS["box-box"]
    answers = [
        gs.cull(camera, boxes, certificates=True),
        gs.first_contact(a, b, velocity_a, velocity_b, certificates=True),
        gs.distance(p, q, scenarios.relative_poses(few, 0.35, 1.0), certificates=True),
    ]
    begin = time.thread_time()
    for answer in answers:
        gs.verify(answer)
    return len(answers) * few / (time.thread_time() - begin)


@dataclass
class Stepped:
    """A simulation with a fixed step beside the proven time of collision."""

    name: str
    misses: int
    false_alarms: int
    errors: np.ndarray  # [s], of the hits that it sees
    ns: float  # a query


def fixed_steps(quick: bool) -> tuple[int, list[Stepped]]:
    """How many drives end in a collision within 2 s, and what steps of 0.5 s to 0.01 s make of it."""
    t_max, drives = 2.0, scenarios.drives(100 if quick else 1000)
    ring = scenarios.FOOTPRINT

    def timed(ask: Callable[[np.ndarray, np.ndarray], float]) -> tuple[np.ndarray, float]:
        begin = time.thread_time_ns()
        times = np.array([ask(twist, points) for twist, points in drives])
        return times, (time.thread_time_ns() - begin) / len(drives)

    lower, ns = timed(lambda twist, points: gs.time_to_collision(ring, twist, points, t_max=t_max).earliest)
    upper, _ = timed(lambda twist, points: gs.time_to_collision(ring, twist, points, t_max=t_max).earliest_upper)
    hit = np.isfinite(upper)
    table = [Stepped("ours", 0, int((np.isfinite(lower) & ~hit).sum()), upper[hit] - lower[hit], ns)]
    for step in (0.5, 0.2, 0.1, 0.05, 0.02, 0.01):
        guess, ns = timed(lambda t, p, s=step: baselines.stepped_time_to_collision(ring, t, p, t_max, s))
        seen = np.isfinite(guess)
        off = guess[hit & seen] - lower[hit & seen]
        table.append(Stepped(f"Euler, {step:g} s", int((hit & ~seen).sum()), int((seen & ~hit).sum()), off, ns))
    return int(hit.sum()), table


def print_steps(console: Console, hits: int, table: list[Stepped]) -> None:
    """Misses, errors, times."""
    out = Table(title=f"Robot among posts, {hits} real hits within 2 s: simulation with points and fixed steps")
    for heading in ("way", "misses", "false alarms", "worst error ms", "rms ms", "us per query"):
        out.add_column(heading, justify="left" if heading == "way" else "right")
    for s in table:
        worst, rms = np.abs(s.errors).max() * 1e3, np.sqrt(np.mean(s.errors**2)) * 1e3
        out.add_row(s.name, f"{s.misses}", f"{s.false_alarms}", f"{worst:.3g}", f"{rms:.3g}", f"{s.ns / 1e3:,.1f}")
    console.print(out)


PRICES = "Price of exactness and of proof: ratio to the same query at float64, in one run", "float64", "stronger"
EFFECTS = "Only the effects a scene calls for: a step, distances and contacts and view, per object", "whole", "this"


def print_prices(console: Console, table: list[Price], words: tuple[str, str, str] = PRICES) -> None:
    """Ratios and wishes."""
    title, plain, stronger = words
    out = Table(title=title)
    for heading in ("query", "items", f"{plain} ns", f"{stronger} ns", "ratio", "wanted"):
        out.add_column(heading, justify="left" if heading == "query" else "right")
    for p in table:
        wish = f"{p.most:g}" + ("" if p.most_ns is None else f", {p.most_ns:g} ns")
        ratio = p.ns[1] / p.ns[0]
        out.add_row(
            p.name,
            f"{p.items:,}",
            f"{p.ns[0]:,.1f}",
            f"{p.ns[1]:,.1f}",
            f"{ratio:.3f}",
            f"{wish} {'met' if p.met else 'MISSED'}",
        )
    console.print(out)


def print_table(console: Console, table: list[Scenario]) -> None:
    """Medians and ratios."""
    out = Table(title="Batch calls from Python, one core, medians of CPU time")
    for heading in ("scenario", "items", "ns per item", "target", "numpy / ours", "fcl / ours"):
        out.add_column(heading, justify="left" if heading == "scenario" else "right")
    for s in table:
        ours = s.median_ns["ours"]
        ratio = {k: f"{s.median_ns[k] / ours:,.1f}" if k in s.median_ns else "" for k in ("numpy", "fcl")}
        target = "" if s.target_ns is None else f"{s.target_ns:g} {'met' if ours <= s.target_ns else 'MISSED'}"
        out.add_row(s.name, f"{s.ours[1]:,}", f"{ours:,.1f}", target, ratio["numpy"], ratio["fcl"])
    console.print(out)


def main() -> None:
    """Run, print, and write JSON if asked."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true", help="a tenth of the items, fewer rounds")
    parser.add_argument("--only", default="", help="scenarios whose name contains this text")
    parser.add_argument("--json", type=Path, help="also write the figures here")
    arguments = parser.parse_args()
    console = Console(width=120)
    table = [s for s in declare(arguments.quick) if arguments.only in s.name]
    for scenario in table:
        scenario.run(3 if arguments.quick else 9)
    if table:
        print_table(console, table)
    paid = [p for p in prices(arguments.quick) if arguments.only in p.name]
    for price in paid:
        price.run(3 if arguments.quick else 9)
    if paid:
        print_prices(console, paid)
    shares = [p for p in effects(arguments.quick) if arguments.only in p.name or arguments.only == "effects"]
    for share in shares:
        share.run(5 if arguments.quick else 15)
    if shares:
        print_prices(console, shares, EFFECTS)
    if arguments.only in "fixed steps":
        print_steps(console, *fixed_steps(arguments.quick))
    if arguments.only in "verify":
        console.print(
            f"gs.verify: {verifications_per_second(arguments.quick):,.0f} certificates a second (1,000 wanted)"
        )
    node = ros.measure(arguments.quick) if arguments.only in "node" else []
    for line in node:
        console.print(line)
    if arguments.json:
        record = {
            "machine": platform.processor() or platform.machine(),
            "python": platform.python_version(),
            "scenarios": {s.name: s.median_ns for s in table},
            "prices": {p.name: p.ns for p in paid},
            "effects": {p.name: p.ns for p in shares},
            "node": [str(line) for line in node],
        }
        arguments.json.write_text(json.dumps(record, indent=2) + "\n")


if __name__ == "__main__":
    main()
