# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""What accuracy costs on this machine: error and time of every way to answer every query.

`QUERIES` is the price list.  A new query is one more row of it, a new way one more entry in the column of ways; a
way that does not answer (yet) is left out by name, and joins as soon as it does.
"""

from __future__ import annotations

import json
import math
import os
import platform
from collections.abc import Callable, Iterable
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from geomsrv import _core
from geomsrv._price_measure import FULL, QUICK, Effort, Found, Measure, Priced, Query, Way, cheapest, measure
from geomsrv._price_measure import matching as _matching
from geomsrv._price_measure import split_request as _split_request
from geomsrv._price_peers import COAL, FCL, FCL_CONTACT, FCL_MOTION
from geomsrv._price_ways import (
    ALL_PAIRS,
    APPROXIMATION,
    BOXES_SEEN,
    CLOSED_FORM,
    FEWER,
    FRUSTUM_AS_HULL,
    FRUSTUM_BOXED,
    MOVED_PAIRS,
    NEAR_PAIRS,
    PLANES_ONLY,
    SEARCHED,
    SEEN,
    SIDES,
    VOLUME,
    Batches,
    Crowd,
    Discs,
    Motion,
    Pair,
    Points,
    Sight,
    answers,
    as_polygons,
    balled,
    boxed,
    fixed_step,
    in_scene,
    inscribed,
    on_simpler,
    read_booleans,
    read_contacts,
    read_cull,
    read_distances,
    rectangle,
    sphere_points,
    spread,
    thinned,
    upright,
    with_shapes,
    with_vertices,
)
from geomsrv._validate import rotation_matrices
from geomsrv.queries import cull, distance, distance_to_frustum, first_contact, intersects
from geomsrv.shapes import (
    Box,
    Boxes,
    Capsule,
    Cone,
    Convex,
    Cylinder,
    Ellipsoid,
    Frustum,
    Frustum2D,
    HalfSpace,
    Polygons,
    Polytopes,
    Shape,
    Sphere,
)

__all__ = ["FULL", "QUERIES", "QUICK", "explain", "load", "price", "run", "save", "select"]

RECORD, PAGE = "price.json", "price.html"  #: in the folder of a run

FloatArray = NDArray[np.float64]

# --------------------------------------------------------------------------------------------------------- inputs


def _rotations(rng: np.random.Generator, n: int) -> FloatArray:
    """(n, 4) uniformly distributed unit quaternions."""
    q = rng.normal(size=(n, 4))
    unit: FloatArray = q / np.linalg.norm(q, axis=1, keepdims=True)
    return unit


def _directions(rng: np.random.Generator, n: int, d: int) -> FloatArray:
    x = rng.normal(size=(n, d))
    unit: FloatArray = x / np.linalg.norm(x, axis=1, keepdims=True)
    return unit


def _camera() -> Frustum:
    """60 by 46 degrees, 0.1 m to 20 m, looking along no axis of the world."""
    return Frustum.look_at([0.3, -0.2, 1.1], [3.0, 1.0, 0.7], [0.0, 0.0, 1.0], 0.8, 4 / 3, 0.1, 20.0)


def _sights(n: int, seed: int) -> Sight:
    """Boxes of 5 to 50 cm in and around the view."""
    rng = np.random.default_rng(seed)
    camera = _camera()
    depth = rng.uniform(0.0, 1.1 * camera.far, n)
    window = np.array(camera.bounds[1::2]) / camera.near
    local = np.column_stack([rng.uniform(-1.8, 1.8, (n, 2)) * window * depth[:, None], depth])
    axes = np.swapaxes(rotation_matrices(_rotations(rng, n)), 1, 2)
    return Sight(camera, Boxes(camera.origin + local @ camera.axes, axes, rng.uniform(0.025, 0.25, (n, 3))))


TILT = np.radians(30.0)  # of what touches: rounding then leaves a gap or an overlap of an ulp or two, or nothing


def _tilt() -> FloatArray:
    c, s = np.cos(TILT), np.sin(TILT)
    turn: FloatArray = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]) @ np.array([[1, 0, 0], [0, c, -s], [0, s, c]])
    return turn


def _touching_sights(n: int, seed: int) -> Sight:
    """Boxes on a tilted grid that touch a side of a right-angled view, or nearly so."""
    rng = np.random.default_rng(seed)
    depth, half = 1.0 + 0.5 * rng.integers(1, 60, n), 0.25
    center = np.column_stack([depth + 2 * half, 2 * half * rng.integers(-2, 3, n), depth])
    turn = _tilt()
    boxes = Boxes(center @ turn.T, np.tile(turn.T, (n, 1, 1)), np.full((n, 3), half))
    return Sight(Frustum([0, 0, 0], turn.T, 1.0, 1.0, 1.0, 40.0), boxes)


def _points(n: int, seed: int) -> Points:
    """Points in a cube of 60 m about the camera."""
    return Points(_camera(), np.random.default_rng(seed).uniform(-30.0, 30.0, (n, 3)))


def _points_2d(n: int, seed: int) -> Points:
    """Points in a square of 20 m about a view in the plane."""
    c, s = np.cos(0.4), np.sin(0.4)
    frustum = Frustum2D([0.3, -0.2], [[c, s], [-s, c]], 0.5, 0.5, 8.0)
    return Points(frustum, np.random.default_rng(seed).uniform(-10.0, 10.0, (n, 2)))


#: Two shapes of every kind, of about 10 cm, no two alike.
SHAPES: dict[str, tuple[Shape, Shape]] = {
    "sphere": (Sphere(0.1), Sphere(0.08)),
    "capsule": (Capsule(0.05, 0.2), Capsule(0.04, 0.15)),
    "box": (Box([0.1, 0.07, 0.12]), Box([0.08, 0.1, 0.05])),
    "convex": (Convex(sphere_points(128) * [0.1, 0.08, 0.12]), Convex(sphere_points(100) * [0.12, 0.09, 0.07])),
    "half_space": (HalfSpace([0.0, 0.0, 1.0], 0.0), HalfSpace([0.0, 0.6, 0.8], 0.0)),
    "cylinder": (Cylinder(0.07, 0.2), Cylinder(0.05, 0.15)),
    "cone": (Cone(0.08, 0.2), Cone(0.06, 0.15)),
    "ellipsoid": (Ellipsoid([0.1, 0.08, 0.12]), Ellipsoid([0.05, 0.09, 0.07])),
}

#: Pairs that have no row, and why.
LEFT_OUT = {("half_space", "half_space"): "nearly all of them meet without end, and then there is no depth"}


def _pairs(kind_a: str, kind_b: str, deep: bool, n: int, seed: int) -> Pair:
    """Random orientations; apart: 20 cm to 1 m, deep: the origins at most 10 cm from each other, or from a plane."""
    rng = np.random.default_rng(seed)
    plane = "half_space" in (kind_a, kind_b)
    if plane and kind_b != "half_space":
        kind_a, kind_b = kind_b, kind_a
    a, b = SHAPES[kind_a][0], SHAPES[kind_b][1]
    shift = _directions(rng, n, 3) * rng.uniform(*((0.0, 0.1) if deep else (0.4, 1.0)), (n, 1))
    poses = np.hstack([shift, _rotations(rng, n)])
    if plane:  # the half space is turned about, and its plane keeps clear of the shape, or does not
        normals = np.einsum("nij,j->ni", rotation_matrices(poses[:, 3:]), np.array([0.0, 0.6, 0.8]))
        height = rng.uniform(-0.1, 0.1, n) if deep else -rng.uniform(0.3, 1.0, n)
        poses[:, :3] = normals * height[:, None]
    return Pair(a, b, poses, deep)


GRAIN = 2.0**-30  #: [m] coordinates of moving bodies are multiples of it, so that shifting them rounds nothing


def _grained(x: FloatArray) -> FloatArray:
    grained: FloatArray = np.round(x / GRAIN) * GRAIN
    return grained


def _planar(rng: np.random.Generator, n: int, low: int = 8, high: int = 33) -> Polygons:
    """Convex polygons of about 1 m about the origin."""
    sizes = rng.integers(low, high, n)
    ends = np.concatenate([[0], np.cumsum(sizes)])
    item = np.repeat(np.arange(n), sizes)
    k = np.arange(ends[-1]) - ends[item]
    # Points of an ellipse at increasing angles are in convex position.
    angle = 2.0 * np.pi * (k + rng.uniform(-0.3, 0.3, len(k))) / sizes[item]
    radii, turn = rng.uniform(0.4, 1.2, (n, 2))[item], rng.uniform(0.0, 2.0 * np.pi, n)[item]
    x, y = radii[:, 0] * np.cos(angle), radii[:, 1] * np.sin(angle)
    return Polygons(
        _grained(np.column_stack([np.cos(turn) * x - np.sin(turn) * y, np.sin(turn) * x + np.cos(turn) * y])), ends
    )


def _solid(rng: np.random.Generator, n: int) -> Polytopes:
    """Hulls of 12 to 24 points of an ellipsoid of about 1 m about the origin."""
    sizes = rng.integers(12, 25, n)
    ends = np.concatenate([[0], np.cumsum(sizes)])
    item = np.repeat(np.arange(n), sizes)
    return Polytopes(_grained(_directions(rng, int(ends[-1]), 3) * rng.uniform(0.4, 1.2, (n, 3))[item]), ends)


def _motions(d: int, turning: bool, n: int, seed: int) -> Motion:
    """Two in three on collision course, a few metres apart at first; within 4 s."""
    rng = np.random.default_rng(seed)
    a, b = ((_planar if d == 2 else _solid)(rng, n) for _ in range(2))
    way = _directions(rng, n, d)
    center = _grained(way * rng.uniform(3.0, 6.0, (n, 1)))
    velocity = rng.uniform(1.0, 3.0, (n, 1)) * (rng.normal(scale=0.25, size=(n, d)) - way)
    spin = rng.normal(scale=1.0, size=(n, 3)) * turning
    if d == 2:
        spin[:, :2] = 0.0
    return Motion(a, b, center, velocity, spin, 4.0)


def _discs(n: int, seed: int) -> Discs:
    """Discs of about 1 m, two in three on collision course."""
    rng = np.random.default_rng(seed)
    way = _directions(rng, n, 2)
    velocity = rng.uniform(1.0, 3.0, (n, 1)) * (rng.normal(scale=0.25, size=(n, 2)) - way)
    return Discs(rng.uniform(0.3, 0.7, (n, 2)), way * rng.uniform(3.0, 6.0, (n, 1)), velocity, 4.0)


def _polygon_pairs(deep: bool, n: int, seed: int) -> Batches:
    """Polygons of about 1 m, apart by a few metres, or one within the other."""
    rng = np.random.default_rng(seed)
    a, b = _planar(rng, n), _planar(rng, n)
    center = _directions(rng, n, 2) * rng.uniform(*((0.0, 0.3) if deep else (2.6, 6.0)), (n, 1))
    moved = Polygons(b.vertices + np.repeat(center, np.diff(b.offsets), axis=0), b.offsets)
    return Batches(a, moved, deep)


def _touching_boxes(n: int, seed: int) -> Batches:
    """Boxes of a tilted grid: half of them share a face, or nearly so, the others are a cell apart."""
    rng = np.random.default_rng(seed)
    cell, turn = np.array([0.75, 0.5, 0.25]), _tilt()
    at = rng.integers(-40, 40, (n, 3))
    step = np.eye(3, dtype=int)[rng.integers(0, 3, n)] * rng.integers(1, 3, (n, 1))
    axes, half = np.tile(turn.T, (n, 1, 1)), np.tile(cell / 2, (n, 1))
    a, b = (Boxes((where * cell) @ turn.T, axes, half) for where in (at, at + step))
    return Batches(a, b)


def _touching_polygons(n: int, seed: int) -> Batches:
    """Rectangles of a tilted grid: half of them share an edge, or nearly so, the others are a cell apart."""
    rng = np.random.default_rng(seed)
    cell, (c, s) = np.array([0.75, 0.5]), (np.cos(TILT), np.sin(TILT))
    turn = np.array([[c, -s], [s, c]])
    corners = np.array([(0, 0), (1, 0), (1, 1), (0, 1)]) * cell
    at = rng.integers(-40, 40, (n, 2)) * cell
    step = np.eye(2)[rng.integers(0, 2, n)] * rng.integers(1, 3, (n, 1)) * cell
    ends = 4 * np.arange(n + 1)
    around = corners @ turn.T
    a, b = (Polygons(((x @ turn.T)[:, None] + around).reshape(-1, 2), ends) for x in (at, at + step))
    return Batches(a, b)


def _crowds(n: int, seed: int) -> Crowd:
    """Boxes of 10 to 40 cm, packed so that each has some near neighbours."""
    rng = np.random.default_rng(seed)
    side = 0.5 * n ** (1 / 3)
    poses = np.hstack([rng.uniform(0.0, side, (n, 3)), _rotations(rng, n)])
    return Crowd([Box(half) for half in rng.uniform(0.05, 0.2, (n, 3))], poses, 0.1, _camera())


# ------------------------------------------------------------------------------------------------------- the table

FEWER_POINTS = (8, 16, 32, 64)
STEPS_S = (0.5, 0.1, 0.02, 0.005)

SIMPLER_SHAPES = (
    *(
        on_simpler(
            f"hull of {n} points", APPROXIMATION, with_shapes(partial(inscribed, points=n)), Pair.ask, read_distances
        )
        for n in SIDES
    ),
    *(
        on_simpler(f"{n} of the vertices", FEWER, with_shapes(partial(thinned, count=n)), Pair.ask, read_distances)
        for n in FEWER_POINTS
    ),
    on_simpler("bounding ball", VOLUME, with_shapes(balled), Pair.ask, read_distances),
    on_simpler("bounding box", VOLUME, with_shapes(boxed), Pair.ask, read_distances),
)


def _simpler_batches(ask: Callable[..., Any], read: Callable[[Any], Found]) -> tuple[Way, ...]:
    """Fewer vertices, and boxes, of polygons and polytopes."""
    return (
        *(
            on_simpler(f"{n} of the vertices", FEWER, with_vertices(partial(spread, count=n)), ask, read)
            for n in FEWER_POINTS[:2]
        ),
        on_simpler("box along the axes", VOLUME, with_vertices(rectangle), ask, read),
    )


BOXES_UPRIGHT = on_simpler(
    "boxes along the axes",
    VOLUME,
    lambda block: Batches(upright(block.a), upright(block.b)),
    Batches.meet,
    read_booleans,
)
SIGHT_UPRIGHT = on_simpler(
    "boxes along the axes", VOLUME, lambda block: Sight(block.frustum, upright(block.boxes)), Sight.ask, read_cull
)


def _answered_pairs() -> Iterable[tuple[str, str, bool]]:
    """Pairs of kinds that the engine has a kernel for, each once, apart and deep."""
    kinds, answered = _core.shape_kinds(), _core.supported_pairs()
    for i, a in enumerate(kinds):
        for j, b in enumerate(kinds[i:], i):
            if answered[i, j] and (a, b) not in LEFT_OUT:
                yield from ((a, b, False), (a, b, True))


# What the engine answers by itself.
SIGHTS = answers(cull, Sight.ask, read_cull, by_tolerance=False)
POINTS = answers(distance_to_frustum, Points.ask, read_distances)
PAIRS = answers(distance, Pair.ask, read_distances)
BATCHES = answers(distance, Batches.ask, read_distances)
MEETINGS = answers(intersects, Batches.meet, read_booleans, by_tolerance=False)
MOTIONS = answers(first_contact, Motion.ask, read_contacts)
TURNING = answers(first_contact, Motion.ask_turning, read_contacts)

FIXED_STEPS = tuple(map(fixed_step, STEPS_S))
SIMPLER_SIGHTS = (SIGHT_UPRIGHT, PLANES_ONLY)
SIMPLER_BATCHES = _simpler_batches(Batches.ask, read_distances)
SIMPLER_MEETINGS = _simpler_batches(Batches.meet, read_booleans)[-1:]
SIMPLER_MOTIONS = _simpler_batches(Motion.ask, read_contacts)
HOW = {False: "apart", True: "deep"}

# Columns: name, function, unit of the error, inputs, items in a block, ways, who judges.
QUERIES: tuple[Query, ...] = (
    Query("cull", "cull", "", _sights, 4000,
          (*SIGHTS.ways, *SIMPLER_SIGHTS, *FCL_CONTACT), (SIGHTS.exact,)),
    Query("cull, touching", "cull", "", _touching_sights, 2000,
          (*SIGHTS.ways, *SIMPLER_SIGHTS, *FCL_CONTACT), (SIGHTS.exact,)),
    Query("distance point-frustum", "distance_to_frustum", "m", _points, 10_000,
          (*POINTS.ways, FRUSTUM_AS_HULL, FRUSTUM_BOXED, *FCL), (POINTS.exact,)),
    Query("distance point-frustum 2D", "distance_to_frustum", "m", _points_2d, 10_000,
          POINTS.ways, (POINTS.exact,)),
    *(Query(f"distance {a}-{b}, {HOW[deep]}", "distance", "m", partial(_pairs, a, b, deep), 2000,
            (*PAIRS.ways, *SIMPLER_SHAPES, *FCL, *COAL), (PAIRS.exact,)) for a, b, deep in _answered_pairs()),
    *(Query(f"distance polygon-polygon, {HOW[deep]}", "distance", "m", partial(_polygon_pairs, deep), 2000,
            (*BATCHES.ways, *SIMPLER_BATCHES), (BATCHES.exact,)) for deep in (False, True)),
    Query("intersects box-box, touching", "intersects", "", _touching_boxes, 2000,
          (*MEETINGS.ways, BOXES_UPRIGHT, *FCL_CONTACT), (MEETINGS.exact,)),
    Query("intersects polygon-polygon, touching", "intersects", "", _touching_polygons, 2000,
          (*MEETINGS.ways, *SIMPLER_MEETINGS), (MEETINGS.exact,)),
    Query("first contact 2D", "first_contact", "s", partial(_motions, 2, False), 500,
          (*MOTIONS.ways, *SIMPLER_MOTIONS, *FIXED_STEPS), (MOTIONS.exact, SEARCHED)),
    Query("first contact 2D, discs", "first_contact", "s", _discs, 500,
          tuple(map(as_polygons, SIDES)), (CLOSED_FORM,)),
    Query("first contact 3D", "first_contact", "s", partial(_motions, 3, False), 200,
          (*MOTIONS.ways, *SIMPLER_MOTIONS, *FIXED_STEPS, *FCL_MOTION), (MOTIONS.exact, SEARCHED)),
    Query("first contact 2D, turning", "first_contact", "s", partial(_motions, 2, True), 200,
          (*TURNING.ways, *FIXED_STEPS), (SEARCHED,)),
    Query("first contact 3D, turning", "first_contact", "s", partial(_motions, 3, True), 100,
          (*TURNING.ways, *FIXED_STEPS, *FCL_MOTION), (SEARCHED,)),
    Query("scene step, first contact 2D", "Scene.first_contacts", "s", partial(_motions, 2, False), 200,
          (*in_scene(MOVED_PAIRS), *FIXED_STEPS), (MOTIONS.exact,)),
    Query("scene step, first contact 2D, turning", "Scene.first_contacts", "s", partial(_motions, 2, True), 200,
          (*in_scene(MOVED_PAIRS), *FIXED_STEPS), (SEARCHED,)),
    Query("scene step, distances", "Scene.distances", "m", _crowds, 300,
          (*NEAR_PAIRS.ways(), NEAR_PAIRS.on_simpler("bounding ball", balled)), (NEAR_PAIRS.exact, ALL_PAIRS)),
    Query("scene step, cull", "Scene.cull", "", _crowds, 300,
          (*SEEN.ways(by_tolerance=False), SEEN.on_simpler("bounding ball", balled)), (SEEN.exact, BOXES_SEEN)),
)  # fmt: skip


# ------------------------------------------------------------------------------------------------------ the command


def select(text: str) -> list[Query]:
    """Rows whose name holds every word of `text`."""
    return list(_matching(QUERIES, text))


def price(
    queries: Iterable[Query], effort: Effort = FULL, step: Callable[[str, str], object] = lambda query, way: None
) -> list[Priced]:
    """Measure rows one by one; `step` is told what is at work."""
    return [measure(query, effort, step=partial(step, query.name)) for query in queries]


def save(path: Path, table: list[Priced], effort: Effort, version: str) -> None:
    """Write figures as JSON, with what they were measured on."""
    record = {"on": _here(version), "quick": effort == QUICK, "queries": [asdict(priced) for priced in table]}
    path.write_text(json.dumps(_without_nan(record), indent=1) + "\n", encoding="utf-8")


def load(path: Path, version: str) -> list[Priced]:
    """Figures that were saved on this machine with this version; none if there are no such."""
    if not path.is_file():
        return []
    record = json.loads(path.read_text(encoding="utf-8"))
    if record["on"] != _here(version):
        return []
    table = []
    for row in record["queries"]:
        measures = tuple(Measure(**_with_nan(m)) for m in row.pop("measures"))
        table.append(Priced(**_with_nan(row), measures=measures))
    return table


def _here(version: str) -> dict[str, str]:
    return {"geomsrv": version, "machine": platform.node(), "processor": _processor()}


def _processor() -> str:
    """Its model, where Linux tells."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        lines = []
    models = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return models[0] if models else platform.machine()


MAY_BE_UNKNOWN = ("worst", "p99", "proven", "truth_width")  # numbers for which JSON has no NaN: null stands for it


def _without_nan(value: Any) -> Any:
    if isinstance(value, float) and not math.isfinite(value):
        return None if math.isnan(value) else str(value)
    if isinstance(value, dict):
        return {key: _without_nan(item) for key, item in value.items()}
    return [_without_nan(item) for item in value] if isinstance(value, (list, tuple)) else value


def _with_nan(row: dict[str, Any]) -> dict[str, Any]:
    unknown = {key: np.nan if row[key] is None else float(row[key]) for key in MAY_BE_UNKNOWN if key in row}
    return row | unknown


def explain(text: str, saved: list[Priced], step: Callable[[str, str], object] = lambda query, way: None) -> list[str]:
    """What would run for "distance box-capsule 1e-6", and what that costs here; measures what is not in `saved`.

    Raises
    ------
    GeometryError
        There is no tolerance.
    """
    words, tolerance = _split_request(text)
    known = {priced.query: priced for priced in saved}
    lines = []
    for query in select(words):
        priced = known.get(query.name) or price([query], QUICK, step)[0]
        unit = f" {query.unit} off" if query.unit else " of the answers wrong"
        lines.append(f"{query.name}, at most {tolerance:g}{unit}")
        if not priced.measures:
            lines.append(f"  nothing answers it: {'; '.join(priced.skipped.values())}")
            continue
        best, lucky = (cheapest(priced, tolerance, proven=proven) for proven in (True, False))
        if best is None:
            lines.append("  no way proves that")
        else:
            lines.append(f"  {_told(best)}; proven: at most {best.proven:.2g}{unit}")
        if lucky is not None and lucky != best:
            seen = f"at most {lucky.worst:.2g}{unit} in {lucky.items:,} items"
            lines.append(f"  {_told(lucky)}; not proven, but seen: {seen}")
    return lines


def _told(m: Measure) -> str:
    return f"{m.way}: {m.ns:,.0f} ns an item (p99 {m.ns_p99:,.0f} ns)"


def run(
    only: str, quick: bool, out: Path, record: Path | None, page: Path | None, request: str | None, version: str
) -> int:
    """The command; returns its exit status."""
    from geomsrv import _price_report as report

    own_record = out / RECORD
    if request is not None:
        queries = select(_split_request(request)[0])
        with report.progress(len(queries)) as step:
            lines = explain(request, load(record or own_record, version), step)
        print("\n".join(lines) or f"no query is called {request!r}; they are: {', '.join(q.name for q in QUERIES)}")
        return 0 if lines else 2
    queries, effort = select(only), QUICK if quick else FULL
    if not queries:
        print(f"no query is called {only!r}; they are: {', '.join(q.name for q in QUERIES)}")
        return 2
    with report.progress(len(queries)) as step:
        prices = price(queries, effort, step)
    report.printed(prices)
    out.mkdir(parents=True, exist_ok=True)
    for path in filter(None, (own_record, record)):
        save(path, prices, effort, version)
    figures = {priced.query: report.figure(priced) for priced in prices}
    for name, image in figures.items():
        if image:
            (out / f"{report.slug(name)}.png").write_bytes(image)
    about = report.ABOUT.format(options=" --quick" if quick else "", version=version, processor=_processor())
    (out / PAGE).write_text(report.page_html(prices, figures, about), encoding="utf-8")
    if page is not None:
        folder = Path(os.path.relpath(out, page.parent)).as_posix()
        page.write_text(report.page_markdown(prices, folder, about), encoding="utf-8")
    print(f"{len(figures)} figures and {out / PAGE}")
    return 0
