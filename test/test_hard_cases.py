# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""Hard cases of every class, judged by exact arithmetic; and the judge itself, which must be able to say "wrong"."""

from __future__ import annotations

import importlib.util
import json
import math
import sys
from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from conftest import hard_cases as corpus
from hard import suite
from hard.truth import TRUTHS, truth_of

from geomsrv import _fcl_supervisor, _verdict, hard_check
from geomsrv._verdict import Verdict, judge, judge_peer
from geomsrv.cli import main
from geomsrv.errors import GeometryError, NotAvailableError
from geomsrv.hard_cases import Case, Truth, read, signed_square
from geomsrv.hard_check import TIERS

DATA = Path(__file__).parent / "data"

# Cases of each class here; `make hard` takes 100.
COUNT = 3

CLASSES = list(suite.classes())


def findings(case: Case) -> dict[str, _verdict.Finding]:
    """By tier; tiers that are not available are left out."""
    found = {tier: judge(case, tier) for tier in TIERS}
    return {tier: finding for tier, finding in found.items() if finding is not None}


def told(case: Case, tier: str, finding: _verdict.Finding) -> str:
    """The case as a line for `geomsrv crosscheck --hard --cases`, and what went wrong."""
    return f"{tier}: {finding.detail}\n{suite.line(case)}"


def check(case: Case) -> dict[str, _verdict.Finding]:
    """Never wrong; what is decidable is right; exact is exact."""
    found = findings(case)
    assert "float64" in found
    for tier, finding in found.items():
        assert finding.verdict != Verdict.WRONG, told(case, tier, finding)
    assert case.truth is not None
    if case.truth.decidable:
        assert found["float64"].near, told(case, "float64", found["float64"])
    if "exact" in found:
        assert found["exact"].verdict == Verdict.RIGHT and found["exact"].near, told(case, "exact", found["exact"])
    return found


@pytest.mark.parametrize(("kind", "group"), CLASSES, ids=[f"{kind}-{group}" for kind, group in CLASSES])
def test_class(kind: str, group: str) -> None:
    for case in suite.generate(kind, group, suite.fewer(kind, COUNT)):
        check(case)


KINDS = (
    "frustum_box",
    "point_frustum",
    "box_box_distance",
    "polygon2d_distance",
    "polygon2d_moving",
    "polyhedra_moving",
)
CORPUS = [case for case in read(DATA / "hard_cases.jsonl") if case.kind in KINDS]


@pytest.mark.parametrize("case", CORPUS, ids=[case.name for case in CORPUS])
def test_corpus(case: Case) -> None:
    check(case)


def test_generated_cases_are_hard() -> None:
    """Every kind has cases that doubles decide and cases that they cannot, contact and none; the turning together."""
    met: dict[bool, set[bool | None]] = {False: set(), True: set()}
    for kind in TRUTHS:
        found = [
            case.truth
            for group in suite.CLASSES[kind]
            for case in suite.generate(kind, group, suite.fewer(kind, 2), "hard")
            if case.truth
        ]
        decidable = sum(truth.decidable for truth in found)
        assert decidable >= 3 and len(found) - decidable >= 2, kind
        met[kind.endswith("turning")] |= {truth.meets for truth in found}
        assert kind.endswith("turning") or {truth.meets for truth in found} >= {True, False}, kind
    assert all(found >= {True, False} for found in met.values())


def test_every_class_of_the_corpus_is_generated() -> None:
    """By name, or by the name that tells it from the class of another kind."""
    for kind in KINDS:
        for group in {case["class"] for case in corpus(kind)}:
            names = ALIASES.get(group, (group, f"{group}_moving"))
            assert any(name in suite.CLASSES[kind] for name in names), group


ALIASES = {
    "needle": ("needle_polygons", "moving_needles"),
    "many_gon": ("many_gon", "moving_many_gon"),
    "needle_slab": ("needle_slab", "moving_needles"),
    "grazing_slanted": ("grazing_parallel_edge",),
    "grazing_face": ("grazing_edge",),
    "near_parallel_ridge_pass": ("near_parallel_ridge",),
    "near_parallel": ("near_parallel", "near_parallel_closing"),
}


def test_the_same_cases_everywhere() -> None:
    """Generators draw from seeded integers and round correctly; the text of a case is that of its numbers."""
    case = next(suite.generate("box_box_distance", "touch_exact", 1))
    assert json.loads(suite.line(case)) == json.loads(suite.line(next(suite.generate(case.kind, case.group, 1))))


# ------------------------------------------------------------------------------------------- the truth, both ways


@pytest.mark.parametrize("kind", KINDS)
def test_oracle_and_corpus_agree(kind: str) -> None:
    """What the oracle says of a case of the corpus is what its file says."""
    for case in [case for case in CORPUS if case.kind == kind][::7]:
        found, told = truth_of(kind, case.given), case.truth
        assert told is not None
        if found.motion is None:
            assert (found.low, found.high) == (told.low, told.high)
        else:
            assert told.motion is not None
            assert replace(found.motion, time_scale=Fraction(0)) == replace(told.motion, time_scale=Fraction(0))
        # The corpus does not count how far a body comes.
        assert found.scale * 5 > told.scale and (found.motion or found.scale < 5 * told.scale)


# -------------------------------------------------------------------------------------------------- the judge judged


def boxes(gap: float) -> Case:
    """Unit cubes a known distance apart."""
    frame = np.eye(3).tolist()
    body = {"C": [0.0, 0.0, 0.0], "A": frame, "e": [0.5, 0.5, 0.5]}
    given = {"box0": body, "box1": body | {"C": [1.0 + gap, 0.0, 0.0]}}
    return Case("cubes", "box_box_distance", "", given, truth_of("box_box_distance", given))


class Liar:
    """A query's answer with some fields replaced."""

    def __init__(self, answer: Any, **lies: Any) -> None:
        self._answer, self._lies = answer, lies

    def __getattr__(self, name: str) -> Any:
        value = getattr(self._answer, name)
        return self._lies[name](value) if name in self._lies else value


def lying(monkeypatch: pytest.MonkeyPatch, query: str, **lies: Any) -> None:
    truthful = getattr(_verdict, query)
    monkeypatch.setattr(_verdict, query, lambda *args, **kwargs: Liar(truthful(*args, **kwargs), **lies))


@pytest.mark.parametrize(
    ("query", "lies"),
    [
        ("distance", {"lower": lambda x: x + 1e-9, "distance": lambda x: x + 2e-9, "upper": lambda x: x + 3e-9}),
        ("distance", {"upper": lambda x: x * 0.0}),
        ("distance", {"lower": lambda x: x + np.nan}),
        ("distance", {"distance": lambda x: x + 1.0}),
        ("intersects", {"value": lambda x: ~x}),
    ],
)
def test_a_lie_is_found(query: str, lies: dict[str, Any], monkeypatch: pytest.MonkeyPatch) -> None:
    case = boxes(0.25)
    assert judge(case, "float64") == _verdict.Finding(Verdict.RIGHT, True)
    lying(monkeypatch, query, **lies)
    finding = judge(case, "float64")
    assert finding is not None and finding.verdict == Verdict.WRONG and finding.detail


def test_not_vouched_for_is_not_wrong(monkeypatch: pytest.MonkeyPatch) -> None:
    case = boxes(0.25)
    lying(monkeypatch, "intersects", value=lambda x: ~x, certain=lambda x: x & False)
    finding = judge(case, "float64")
    assert finding is not None and (finding.verdict, finding.near) == (Verdict.UNCERTAIN, False)


@pytest.mark.parametrize("value", [math.sqrt(2), math.nextafter(math.sqrt(2), 0.0), math.nextafter(math.sqrt(2), 2.0)])
def test_exact_means_correctly_rounded(value: float) -> None:
    bounds = (Fraction(2), Fraction(2))
    low, high = math.nextafter(math.sqrt(2), 0.0), math.sqrt(2)
    found = _verdict._bracketed(
        "d", value, min(low, value), max(high, value), bounds, Fraction(2), "exact", squared=True
    )
    assert found.near == (value == math.sqrt(2))
    assert (found.verdict == Verdict.RIGHT) == found.near


def test_exact_intervals_are_narrow() -> None:
    bounds = (Fraction(2), Fraction(2))
    root = math.sqrt(2)
    wide = _verdict._bracketed("d", root, root - 1e-15, root, bounds, Fraction(2), "exact", squared=True)
    assert wide.verdict == Verdict.UNCERTAIN
    off = _verdict._bracketed("d", root, root, math.nextafter(root, 2.0), bounds, Fraction(2), "exact", squared=True)
    assert off.verdict == Verdict.WRONG  # sqrt(2) rounds up


def test_a_missed_contact_is_wrong_at_bound() -> None:
    assert _verdict._boolean(False, certain=False, missed=True, said="").verdict == Verdict.WRONG
    assert _verdict._boolean(False, certain=False, missed=False, said="").verdict == Verdict.UNCERTAIN


def test_peers_are_judged_where_they_can_be() -> None:
    apart = Truth(signed_square(0.5), signed_square(0.5), Fraction(2), True)
    assert judge_peer(True, math.nan, apart).verdict == Verdict.WRONG
    assert judge_peer(False, 0.5 + 1e-7, apart).verdict == Verdict.RIGHT
    assert judge_peer(False, 0.5 + 1e-4, apart).verdict == Verdict.WRONG
    assert judge_peer(False, 0.5 + 1e-4, apart, overstates=1e-3).verdict == Verdict.RIGHT
    assert judge_peer(True, math.nan, replace(apart, decidable=False)).verdict == Verdict.UNCERTAIN


# ------------------------------------------------------------------------------------------------------ from files


def test_shipped_cases_are_those_of_the_tests() -> None:
    from geomsrv.hard_cases import shipped

    names = [path.name for path in shipped()]
    for path in shipped():
        assert path.read_bytes() == (DATA / path.name).read_bytes()
    assert names == ["field_cases.jsonl", "hard_cases.jsonl"]


def test_a_bad_line_is_named(tmp_path: Path) -> None:
    file = tmp_path / "cases.jsonl"
    file.write_text('\n{"kind": "polygon2d_distance", "input": {"P": "nonsense"}}\n')
    with pytest.raises(GeometryError, match="line 2"):
        list(read(file))


def test_a_generated_line_can_be_read_back(tmp_path: Path) -> None:
    case = next(suite.generate("polygon2d_distance", "near_parallel", 1))
    file = tmp_path / "cases.jsonl"
    file.write_text(suite.line(case) + "\n")
    (back,) = read(file)
    assert (back.given, back.kind, back.group, back.truth) == (case.given, case.kind, case.group, None)


def test_nothing_is_asked_of_a_tier_that_is_not_there(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: Any, **__: Any) -> Any:
        raise NotAvailableError("later")

    for query in ("distance", "intersects"):
        monkeypatch.setattr(_verdict, query, refuse)
    assert judge(boxes(0.25), "float64") is None
    report = hard_check.check([boxes(0.25)], engines=("float64",))
    assert report.tallies == {} and report.engine_wrong == 0


# ------------------------------------------------------------------------------------------------- the command line


@pytest.fixture
def few(tmp_path: Path) -> Path:
    """A file of some cases of every kind."""
    lines = (DATA / "hard_cases.jsonl").read_text().splitlines()[::16] + [suite.line(boxes(0.25)), ""]
    file = tmp_path / "few.jsonl"
    file.write_text("\n".join(lines))
    return file


def table_of(text: str) -> dict[tuple[str, str], list[int]]:
    """Counts by kind and engine of the printed table."""
    found, kind = {}, ""
    for line in text.splitlines()[1:]:
        words = line.split()
        if len(words) < 5 or not all(word.isdigit() for word in words[-4:]):
            break
        engine = words[-5]
        rest = [word for word in words[:-5] if word != "geomsrv"]
        kind = rest[0] if rest else kind
        found[kind, engine] = [int(word) for word in words[-4:]]
    return found


def test_command(few: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["crosscheck", "--hard", "--cases", str(few)]) == 0
    out = capsys.readouterr().out
    found = table_of(out)
    assert {kind for kind, engine in found if engine == "float64"} >= set(KINDS)
    for (_, engine), (right, uncertain, wrong, crashed) in found.items():
        assert right + uncertain + wrong + crashed > 0
        assert engine not in TIERS or wrong == crashed == 0
    if importlib.util.find_spec("fcl"):
        assert sum(found["box_box_distance", "fcl"]) >= 2
    for peer in hard_check.PEERS:
        if importlib.util.find_spec(peer) is None:
            assert f"{peer}: not asked:" in out


def test_command_says_when_the_engine_is_wrong(
    few: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    lying(monkeypatch, "cull", state=lambda x: 2 - x, certain=lambda x: x | True)
    assert main(["crosscheck", "--hard", "--cases", str(few)]) == 1
    assert "WRONG float64: frustum_box" in capsys.readouterr().out


@pytest.mark.parametrize("text", ["{", '{"kind": "collide", "shapes": []}\n', None])
def test_command_names_what_it_cannot_read(
    text: str | None, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "bad.jsonl"
    if text is not None:
        file.write_text(text)
    assert main(["crosscheck", "--hard", "--cases", str(file)]) == 2
    assert "bad.jsonl" in capsys.readouterr().err


def test_crashes_of_peers_are_counted(monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("fcl")
    script = "import os, signal, struct; os.write(1, struct.pack('<cq', b'H', 1) + b'1'); os.read(0, 1); os.abort()"
    monkeypatch.setattr(_fcl_supervisor, "RESTART_PAUSE_S", (0.001, 0.004))
    monkeypatch.setattr(_fcl_supervisor, "WORKER_COMMAND", (sys.executable, "-S", "-c", script))
    report = hard_check.check([boxes(0.25)], engines=("fcl",))
    assert report.tallies["box_box_distance", "fcl"].crashed == 1 and not report.missing
    report = hard_check.check([boxes(0.25)] * 20, engines=("fcl",))
    assert report.tallies["box_box_distance", "fcl"].crashed < 20 and "died too often" in report.missing["fcl"]


def test_without_an_answer_the_exact_tier_is_the_judge() -> None:
    case = replace(boxes(0.25), truth=None)
    report = hard_check.check([case], engines=("float64", "fcl"))
    assert report.tallies["box_box_distance", "float64"].right == 1 and not report.undecided
