# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""The price list: its table is complete, its columns say what they mean, and the command writes what it promises."""

from __future__ import annotations

import inspect
import json
import math
import os
import re
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import geomsrv as gs
from geomsrv import _core, _price_peers, _price_report, _validate, price
from geomsrv._price_measure import (
    Call,
    Effort,
    Found,
    Measure,
    Priced,
    Query,
    Way,
    WayError,
    cheapest,
    errors,
    front,
    measure,
)
from geomsrv._price_ways import (
    CLOSED_FORM,
    SEARCHED,
    TIER,
    Discs,
    Motion,
    answers,
    balled,
    boxed,
    fixed_step,
    inscribed,
    read_distances,
    spread,
)
from geomsrv.cli import main
from geomsrv.errors import GeometryError, NotAvailableError

ROOT = Path(__file__).resolve().parents[1]
PUBLIC = {"cull", "distance", "distance_to_frustum", "first_contact", "intersects"}
OF_SCENES = {"Scene.cull", "Scene.distances", "Scene.first_contacts"}
TINY = Effort(blocks=1, share=0.0, seconds=0.0, turns=1)


# ---------------------------------------------------------------------------------------------------------- the table


def test_every_public_query_is_in_the_table() -> None:
    functions = {name for name in gs.__all__ if inspect.isfunction(getattr(gs, name))}
    assert {name for name in functions if "accuracy" in inspect.signature(getattr(gs, name)).parameters} == PUBLIC
    assert {query.asks for query in price.QUERIES} == PUBLIC | OF_SCENES
    names = [query.name for query in price.QUERIES]
    assert len({_price_report.slug(name) for name in names}) == len(names)


def test_every_tier_is_in_every_row() -> None:
    for query in price.QUERIES:
        named = [way.name for way in query.ways if way.family == TIER]
        if named:
            assert named.pop(0) == "auto"
        # Discs are no shape of the engine: only as polygons.
        assert named == ([] if query.name == "first contact 2D, discs" else list(_validate.ACCURACIES)), query.name
        assert query.unit in _price_report.UNITS
        assert len({way.name for way in query.ways}) == len(query.ways)
        assert {way.family for way in query.ways} <= set(_price_report.LOOKS)


def test_every_pair_with_a_kernel_is_in_the_table() -> None:
    kinds, answered = _core.shape_kinds(), _core.supported_pairs()
    names = {query.name for query in price.QUERIES}
    for i, j in zip(*np.nonzero(np.triu(answered)), strict=True):
        pair = (kinds[i], kinds[j])
        for how in ("apart", "deep"):
            assert (f"distance {pair[0]}-{pair[1]}, {how}" in names) == (pair not in price.LEFT_OUT)


@pytest.mark.parametrize("query", price.QUERIES, ids=lambda query: query.name)
def test_every_row_can_be_measured(query: Query, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(_price_peers, "PATIENCE_S", 2)
    priced = measure(query, TINY)
    assert priced.truth and priced.measures
    assert {m.way for m in priced.measures} | set(priced.skipped) <= {way.name for way in (*query.ways, *query.truths)}
    for m in priced.measures:
        assert m.ns > 0.0 and m.ns_p99 >= m.ns
        assert math.isnan(m.worst) or m.worst >= 0.0
        if m.family == TIER and m.way in ("float64", "exact") and query.unit:
            assert m.wrong == 0 and m.worst <= m.proven
        if m.way == "bound":
            assert m.misses == 0
    # A tier is left out because the query refuses it by name, and for nothing else.
    for name, reason in priced.skipped.items():
        if name in _validate.ACCURACIES:
            assert "not available" in reason or "unsupported" in reason


# -------------------------------------------------------------------------------------------------------- the columns


def found(values: list[float], half: float = 0.25) -> Found:
    x = np.array(values)
    return Found(x <= 0.0, x, x - half, x + half, np.abs(x) <= half)


def test_errors_of_a_way_that_is_wrong_in_known_places() -> None:
    truth = [found([1.0, 2.0, 0.0, 3.0, -1.0]), found([0.0, 5.0])]
    #               right, off by 0.5, a miss, a false alarm, another miss; right, off by 0.125
    told = [found([1.0, 2.5, 1.0, 0.0, 0.5]), found([0.0, 4.875])]
    worst, p99, proven, false_alarms, misses, unsure = errors(told, truth, "m")
    assert (worst, false_alarms, misses, unsure, proven) == (3.0, 1, 2, 2, 0.25)
    assert p99 == np.percentile([0.0, 0.5, 1.0, 3.0, 1.5, 0.0, 0.125], 99, method="higher")
    share, none, unproven, *rest = errors(told, truth, "")
    assert share == 3 / 7 and math.isnan(none) and unproven == 2 / 7 and rest == [1, 2, 2]


def test_numbers_that_one_of_both_lacks_count_as_wrong_answers_only() -> None:
    nan, inf = np.nan, np.inf
    truth = Found(np.array([True, False, True, True]), np.array([1.0, nan, 2.0, inf]))
    told = Found(np.array([False, True, True, True]), np.array([nan, 7.0, 2.5, inf]))
    worst, _, proven, false_alarms, misses, unsure = errors([told], [truth], "s")
    assert (worst, false_alarms, misses, unsure) == (0.5, 1, 1, None) and math.isnan(proven)
    never = Found(np.zeros(4, bool), np.full(4, nan))
    assert math.isnan(errors([never], [truth], "s")[0])


def way(name: str, off: float = 0.0, spin: int = 0, fails: Exception | None = None) -> Way:
    def prepare(block: Any) -> Call:
        if fails:
            raise fails

        def run() -> Any:
            for _ in range(spin):
                pass
            return block + off

        return Call(run, lambda x: Found(x <= 0.0, x))

    return Way(name, TIER, prepare)


def test_a_fake_query_is_measured() -> None:
    ways = (
        way("right"),
        way("slow", 0.5, spin=20_000),
        way("refuses", fails=NotAvailableError("not today")),
        way("has nothing to do", fails=WayError()),
    )
    truths = (way("unknown", fails=NotAvailableError("nobody")), way("known"))
    query = Query("fake", "distance", "m", lambda n, seed: np.arange(n) + 1.0 + seed, 100, ways, truths)
    priced = measure(query, Effort(2, 1.0, 0.05, 3))
    assert priced.truth == "known" and priced.block == 100
    assert priced.skipped == {"unknown": "nobody", "refuses": "not today"}
    right, slow = priced.measures
    assert (right.worst, slow.worst, slow.p99, slow.items) == (0.0, 0.5, 0.5, 200)
    assert slow.ns > right.ns and slow.wrong == 0
    nobody = measure(replace(query, truths=truths[:1]), TINY)
    assert nobody.measures == () and nobody.truth == ""


def measured(name: str, ns: float, worst: float, *, proven: float = np.nan, misses: int = 0) -> Measure:
    return Measure(name, TIER, worst, worst, proven, 0, misses, None, 100, ns, ns)


def test_front_and_staircase() -> None:
    fast, good, beaten, same = (
        measured("fast", 1.0, 1.0),
        measured("good", 3.0, 0.1),
        measured("beaten", 4.0, 0.5),
        measured("same as good", 3.0, 0.1),
    )
    sly, mute = measured("sly", 2.0, 0.01, misses=5), measured("mute", 0.5, np.nan)
    table = (beaten, good, mute, fast, sly, same)
    assert [m.way for m in front(table)] == ["fast", "sly", "good", "same as good"]
    # What misses some is no match for what does not, however small its other errors are; no line goes through it.
    priced = Priced("q", "distance", "m", "t", np.nan, 1, table)
    assert [m.way for m in _price_report._staircase(priced)] == ["fast", "good"]
    assert [m.way for m in _price_report._staircase(replace(priced, unit=""))] == ["fast", "sly"]


def test_cheapest_way() -> None:
    table = (
        measured("loose", 1.0, 1e-3),
        measured("lucky", 2.0, 1e-9),
        measured("sure", 3.0, 1e-9, proven=1e-8),
        measured("misses", 0.1, 0.0, proven=0.0, misses=1),
        measured("exact", 9.0, 0.0, proven=0.0),
    )
    priced = Priced("q", "distance", "m", "t", np.nan, 1, table)

    def names(tolerance: float) -> list[str | None]:
        ways = (cheapest(priced, tolerance, proven=proven) for proven in (True, False))
        return [m and m.way for m in ways]

    assert names(1e-6) == ["sure", "lucky"]
    assert names(1e-12) == ["exact", "exact"]
    assert names(1.0) == ["sure", "loose"]
    assert names(-1.0) == [None, None]


# ----------------------------------------------------------------------------------------------------------- the ways


@pytest.mark.parametrize("kind", sorted(set(price.SHAPES) - {"half_space"}))
def test_approximations_are_on_the_right_side(kind: str) -> None:
    shape = price.SHAPES[kind][0]
    directions = price._directions(np.random.default_rng(5), 200, 3)
    reach = _support(shape, directions)
    inner = _support(inscribed(shape, 64), directions)
    assert (inner <= reach + 1e-15).all()
    for outer in (boxed(shape), balled(shape)):
        assert (_support(outer, directions) >= reach - 1e-15).all()


def _support(shape: gs.Shape, directions: np.ndarray) -> np.ndarray:
    """How far a shape reaches, by the definition of each."""
    if isinstance(shape, gs.Sphere):
        return np.full(len(directions), shape.radius)
    if isinstance(shape, gs.Capsule):
        return shape.radius + 0.5 * shape.length * np.abs(directions[:, 2])
    if isinstance(shape, gs.Box):
        return np.abs(directions) @ shape.half_extents
    if isinstance(shape, gs.Ellipsoid):
        return np.linalg.norm(directions * shape.radii, axis=1)
    if isinstance(shape, gs.Convex):
        return (directions @ shape.vertices.T).max(axis=1)
    ring, axis = shape.radius * np.linalg.norm(directions[:, :2], axis=1), 0.5 * shape.length * directions[:, 2]
    return np.maximum(ring - axis, ring + axis if isinstance(shape, gs.Cylinder) else axis)


def test_more_points_are_nearer_to_the_shape() -> None:
    sphere = gs.Sphere(1.0)
    directions = price._directions(np.random.default_rng(5), 200, 3)
    gaps = [float((1.0 - _support(inscribed(sphere, n), directions)).max()) for n in (8, 32, 128, 512)]
    assert gaps == sorted(gaps, reverse=True) and gaps[-1] < 0.02 < gaps[0]
    ring = np.array([(np.cos(a), np.sin(a)) for a in np.linspace(0.0, 6.0, 40)])
    assert len(gs.Polygons.from_list([spread(ring, 7)])[0]) == 7  # and still counter-clockwise


def squares(center: tuple[float, float], velocity: tuple[float, float], half: float = 0.5) -> Motion:
    ring = gs.Polygons.from_list([half * np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)])])
    return Motion(ring, ring, np.array([center]), np.array([velocity]), np.zeros((1, 3)), 4.0)


def ask(way: Way, block: Any) -> Found:
    call = way.prepare(block)
    return call.read(call.run())


def test_fixed_steps_are_late_and_tunnel() -> None:
    late = squares((3.3, 0.0), (-1.0, 0.0))  # first contact at 2.3 s
    answer = ask(fixed_step(0.5), late)
    assert answer.hit.tolist() == [True] and answer.value.tolist() == [2.5]
    through = squares((3.3, 0.0), (-100.0, 0.0))  # in contact from 0.023 to 0.043 s
    assert ask(fixed_step(0.5), through).hit.tolist() == [False]
    assert ask(SEARCHED, through).value[0] == pytest.approx(0.023, abs=1e-15)
    exact = answers(gs.first_contact, Motion.ask, lambda x: Found(x.status > 0, x.time)).exact
    assert ask(exact, through).value[0] == pytest.approx(0.023, abs=1e-15)


@pytest.mark.parametrize("d", [2, 3])
def test_a_turning_body_is_where_it_should_be(d: int) -> None:
    motion = price._motions(d, True, 5, 3)
    rows, time_s = np.arange(5), 0.7
    vertices, offsets = motion.placed(rows, time_s)
    for k in rows:
        turn = np.zeros(7)
        angle = np.linalg.norm(motion.spin[k]) * time_s
        turn[3:6] = np.sin(angle / 2) * motion.spin[k] / np.linalg.norm(motion.spin[k])
        turn[6] = np.cos(angle / 2)
        matrix = _validate.rotation_matrices(turn[None, 3:])[0][:d, :d]
        want = motion.b[k] @ matrix.T + motion.center[k] + motion.velocity[k] * time_s
        assert np.abs(vertices[offsets[k] : offsets[k + 1]] - want).max() < 1e-14


def test_closed_form_of_discs() -> None:
    discs = Discs(np.array([[1.0, 1.0]] * 3), np.array([[5.0, 0.0]] * 3), np.array([[-1.0, 0], [1, 0], [-0.5, 0]]), 4.0)
    answer = ask(CLOSED_FORM, discs)
    assert answer.hit.tolist() == [True, False, False] and answer.value[0] == 3.0
    polygons = ask(
        answers(gs.first_contact, Motion.ask, lambda x: Found(x.status > 0, x.time)).exact, discs.as_polygons(8)
    )
    assert polygons.value[0] == pytest.approx(3.0, abs=1e-15)  # vertex against vertex


def test_a_tolerance_joins_as_soon_as_a_query_takes_one() -> None:
    def query(a: Any, *, accuracy: str = "float64", tolerance: float = 0.0) -> Any:
        return np.array([tolerance])

    ways = {way.name: way for way in answers(query, query, lambda x: Found(x <= 0.0, x)).ways}
    assert ask(ways["tolerance 1e-06"], None).value.tolist() == [1e-6]
    # Every tier, the choice item by item, and three budgets; no tolerance where the answer is a state.
    names = [way.name for way in answers(gs.cull, query, read_distances, by_tolerance=False).ways]
    assert names == ["auto", *_validate.ACCURACIES, "0.1 us an item", "1 us an item", "10 us an item"]


def test_what_kills_a_process_is_told_and_kills_no_other(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(_price_peers, "PATIENCE_S", 1)
    assert _price_peers.survives(lambda: None) == ""
    assert _price_peers.survives(os.abort) == "died of SIGABRT"
    assert _price_peers.survives(lambda: time.sleep(60)) == "hung for 1 s"
    assert _price_peers.survives(lambda: 1 / 0) == "raised"
    with pytest.raises(WayError, match="FCL died of SIGABRT"):
        _price_peers._guarded("FCL", os.abort, lambda x: x)


# -------------------------------------------------------------------------------------------------------- the command

ONE = "distance sphere-box, apart"


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    pytest.importorskip("matplotlib")
    pytest.importorskip("rich")
    out = tmp_path_factory.mktemp("price")
    rest = ["--out", str(out / "figures"), "--page", str(out / "page.md"), "--json", str(out / "copy.json")]
    assert main(["price", "--quick", "--only", "box-sphere apart", *rest]) == 0
    return out


def test_the_command_writes_a_figure_a_page_and_a_record(run: Path) -> None:
    assert sorted(path.name for path in (run / "figures").iterdir()) == [
        "distance_sphere_box_apart.png",
        "price.html",
        "price.json",
    ]
    assert (run / "figures" / "distance_sphere_box_apart.png").read_bytes().startswith(b"\x89PNG")
    record = json.loads((run / "copy.json").read_text())
    assert record["quick"] and [row["query"] for row in record["queries"]] == [ONE]
    (priced,) = price.load(run / "copy.json", gs.__version__)
    assert priced.truth == "exact" and {"bound", "float64", "exact", "bounding ball"} <= {
        m.way for m in priced.measures
    }
    page = (run / "page.md").read_text()
    assert "(figures/distance_sphere_box_apart.png)" in page and f"## {ONE}" in page
    assert page.count("\n| ") == 1 + 2 * 2 + len(priced.measures)


def test_the_page_needs_no_other_file(run: Path) -> None:
    text = (run / "figures" / "price.html").read_text()
    assert "://" not in text and "<script" not in text and "<link" not in text
    assert re.findall(r"src='(data:image/png;base64,)", text) and not re.findall(r"src='(?!data:)", text)
    assert len(re.findall("<tr>", text)) == 2 + 1 + len(price.load(run / "copy.json", gs.__version__)[0].measures)


def test_explain_reads_what_was_saved(run: Path, capsys: pytest.CaptureFixture[str], monkeypatch: Any) -> None:
    monkeypatch.setattr(price, "measure", lambda *a, **k: pytest.fail("measured again"))
    assert main(["price", "--explain", "distance box-sphere apart 1e-6", "--out", str(run / "figures")]) == 0
    told = capsys.readouterr().out
    assert told.startswith(f"{ONE}, at most 1e-06 m off\n  float64: ") and "proven: at most" in told
    assert main(["price", "--explain", "distance box-sphere apart 1e-30", "--json", str(run / "copy.json")]) == 0
    assert "no way proves that" in capsys.readouterr().out


def test_figures_of_another_machine_are_not_used(run: Path, tmp_path: Path) -> None:
    record = json.loads((run / "copy.json").read_text())
    record["on"]["machine"] = "another"
    (tmp_path / "other.json").write_text(json.dumps(record))
    assert price.load(tmp_path / "other.json", gs.__version__) == []
    assert price.load(tmp_path / "none.json", gs.__version__) == price.load(run / "copy.json", "0.0.0") == []


def test_requests_that_cannot_be_met(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    assert main(["price", "--explain", "distance box-box"]) == 2
    assert "must be a tolerance" in capsys.readouterr().err
    assert main(["price", "--only", "distance torus-torus", "--out", str(tmp_path)]) == 2
    assert "they are: cull" in capsys.readouterr().out
    with pytest.raises(GeometryError, match="must be >= 0"):
        price.explain("cull -1", [])


def test_a_record_loses_nothing(tmp_path: Path) -> None:
    odd = Priced("q", "cull", "", "t", np.nan, 1, (measured("a", 1.0, np.inf, proven=np.nan),), {"b": "no"})
    price.save(tmp_path / "p.json", [odd], price.QUICK, "1")
    assert repr(price.load(tmp_path / "p.json", "1")) == repr([odd])


@pytest.mark.parametrize("errors_", [(0.0, 0.0), (1e-16, 1.0), (0.0, 1e-3), (np.nan, 1e-3), (1e100, 1e-100)])
@pytest.mark.parametrize("unit", ["m", "s", ""])
def test_any_errors_make_a_figure(errors_: tuple[float, float], unit: str) -> None:
    pytest.importorskip("matplotlib")
    ways = tuple(measured(str(k), 10.0 ** (k + 1), e, misses=k) for k, e in enumerate(errors_))
    assert _price_report.figure(Priced("q", "cull", unit, "t", np.nan, 1, ways)).startswith(b"\x89PNG")
    assert _price_report.figure(Priced("q", "cull", unit, "t", np.nan, 1, ())) == b""


# ----------------------------------------------------------------------------------------------------------- the page


def test_the_documented_run_has_every_row_and_every_figure() -> None:
    page = (ROOT / "docs" / "accuracy.md").read_text()
    headings = re.findall("^## (.*)$", page, re.MULTILINE)
    rewrite = "run geomsrv price --out docs/accuracy --page docs/accuracy.md"
    assert headings == ["What the tiers cost", *(query.name for query in price.QUERIES)], rewrite
    shown = re.findall(r"!\[[^\]]*\]\((.*?)\)", page)
    assert len(shown) == len(price.QUERIES)
    assert all((ROOT / "docs" / name).read_bytes().startswith(b"\x89PNG") for name in shown), rewrite
