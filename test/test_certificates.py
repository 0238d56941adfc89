# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""Certificates: what the checker accepts is true, what is true can be proven, and a change is noticed."""

from __future__ import annotations

import ast
import dataclasses
import doctest
import math
from collections import Counter
from fractions import Fraction
from itertools import combinations_with_replacement
from pathlib import Path

import numpy as np
import pytest
from certificate_records import (
    contact_record,
    cull_record,
    distance_record,
    falsified,
    is_true,
    space_contact_record,
)
from conftest import from_hex, hard_cases, reproducer
from oracle.vectors import cross, dot
from polygon_scenes import polygons, random_ring

import geomsrv as gs
from geomsrv import evidence
from geomsrv.answers import json_line
from geomsrv.cli import main
from geomsrv.verify import CertificateError, verify_lines, verify_record

TIERS = ["float64", "exact"]
CHECKER = Path(__file__).resolve().parents[1] / "geomsrv" / "verify.py"


def proves(record) -> bool:
    try:
        verify_record(record)
    except CertificateError:
        return False
    return True


def test_checker_imports_the_standard_library_only() -> None:
    tree = ast.parse(CHECKER.read_text())
    names = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0
            names.add(node.module)
    assert names == {"__future__", "collections.abc", "copy", "fractions", "itertools", "json", "math", "typing"}
    assert "import" not in {node.id for node in ast.walk(tree) if isinstance(node, ast.Name)}


# ------------------------------------------------------------------------------------------------------ scenes


def lattice(rng, *shape, size=3):
    return rng.integers(-size, size + 1, shape).astype(float).tolist()


SIGNED = [np.eye(3)[list(order)] * np.array(signs)[:, None] for order, signs in [
    ((0, 1, 2), (1, 1, 1)), ((1, 2, 0), (1, -1, 1)), ((2, 1, 0), (-1, 1, -1)), ((0, 2, 1), (1, 1, -1)),
]]  # fmt: skip


def frame(rng):
    """Rows: exact, or rounded."""
    if rng.random() < 0.6:
        return SIGNED[rng.integers(len(SIGNED))].tolist()
    return np.linalg.qr(rng.normal(size=(3, 3)))[0].tolist()


def box(rng):
    half = rng.integers(0, 4, 3) / 2.0
    center = lattice(rng, 3, size=5) if rng.random() < 0.7 else rng.normal(size=3).tolist()
    return {"kind": "box", "center": center, "axes": frame(rng), "half_extents": half.tolist()}


def frustum(rng, planar=False):
    near = float(rng.integers(1, 3))
    bounds = []
    for _ in range(2 - planar):
        low = rng.integers(-4, 3) / 2.0
        bounds += [low, low + rng.integers(1, 5) / 2.0]
    axes = [[0.0, -1.0], [1.0, 0.0]] if planar else frame(rng)
    origin = lattice(rng, 3 - planar)
    far = near + float(rng.choice([0.5, 1.0, 3.0, 1e6]))
    return {"kind": "frustum", "origin": origin, "axes": axes, "bounds": bounds, "near": near, "far": far}


def hull(rng):
    points = lattice(rng, int(rng.integers(1, 9)), 3) if rng.random() < 0.7 else rng.normal(size=(6, 3)).tolist()
    return {"kind": "hull", "vertices": points}


def sphere(rng):
    return {"kind": "sphere", "radius": float(rng.integers(0, 5)) / 2.0}


def capsule(rng):
    return {"kind": "capsule", "half_length": float(rng.integers(0, 4)), "radius": float(rng.integers(0, 5)) / 2.0}


def posed(rng, body):
    """Somewhere else, on a lattice or not."""
    return body | {"rotation": frame(rng), "translation": lattice(rng, 3, size=6)}


def solid(rng):
    body = [box, frustum, hull, sphere, capsule][rng.integers(5)](rng)
    return posed(rng, body) if rng.random() < 0.5 else body


def polygon(rng):
    ring = random_ring(rng, 3)
    shift = lattice(rng, 2, size=6)
    points = [[x + shift[0], y + shift[1]] for x, y in ring]
    if rng.random() < 0.3:
        points = (np.array(points) @ np.linalg.qr(rng.normal(size=(2, 2)))[0]).tolist()
    return {"kind": "polygon", "vertices": points, "velocity": lattice(rng, 2, size=2)}


def distance_scene(rng):
    return distance_record(solid(rng), solid(rng))


def flat_distance_scene(rng):
    a = polygon(rng) if rng.random() < 0.7 else frustum(rng, planar=True)
    return distance_record(a, polygon(rng))


def cull_scene(rng):
    camera = frustum(rng)
    body = box(rng)
    if rng.random() < 0.6:  # in view, more often than by chance
        (l0, l1, u0, u1), near = camera["bounds"], camera["near"]
        t = 1.0 + rng.integers(0, 5) / 4.0 * min(camera["far"] / near - 1.0, 2.0)
        ray = np.array([(l0 + l1) / 2.0, (u0 + u1) / 2.0, near]) @ np.array(camera["axes"])
        body["center"] = (np.array(camera["origin"]) + t * ray).tolist()
        body["half_extents"] = [x / 4.0 for x in body["half_extents"]]
    return cull_record(camera, body)


def contact_scene(rng):
    a, b = polygon(rng), polygon(rng)
    if rng.random() < 0.3:  # vertex on vertex
        b["vertices"] = (np.array(b["vertices"]) - b["vertices"][0] + a["vertices"][0]).tolist()
    if rng.random() < 0.3:  # head on
        b["velocity"] = (np.array(a["vertices"][0]) - b["vertices"][0] + a["velocity"]).tolist()
    return contact_record(a, b, float(rng.choice([0.0, 1.0, 4.0, math.inf])))


def space_contact_scene(rng):
    a, b = (hull(rng) if rng.random() < 0.7 else box(rng) for _ in range(2))
    a["velocity"], b["velocity"] = lattice(rng, 3, size=2), lattice(rng, 3, size=2)
    if b["kind"] == "hull":
        where = np.array(b["vertices"]) + lattice(rng, 3, size=4)
        if a["kind"] == "hull" and rng.random() < 0.4:  # vertex on vertex, now or later
            later = rng.integers(0, 3) * (np.array(a["velocity"]) - b["velocity"])
            where = where - where[0] + a["vertices"][0] + later
        b["vertices"] = where.tolist()
    return space_contact_record(a, b, float(rng.choice([0.0, 1.0, 4.0, math.inf])))


SCENES = {
    "distance": distance_scene,
    "distance, plane": flat_distance_scene,
    "cull": cull_scene,
    "first contact": contact_scene,
    "first contact, space": space_contact_scene,
}
#: how many `kind_of` can tell apart
KINDS = {"distance": 4, "distance, plane": 3, "cull": 3, "first contact": 4, "first contact, space": 4}


def kind_of(record):
    """What is to be proven."""
    claim = record["claim"]
    return str(claim.get("state") or claim.get("status") or (claim["meets"], claim["lower"] == claim["upper"]))


@pytest.mark.parametrize("scene", SCENES)
def test_oracle_evidence_proves_the_answer(scene, rng) -> None:
    reached: Counter[str] = Counter()
    for _ in range(150):
        record = SCENES[scene](rng)
        try:
            verify_record(record)
        except CertificateError as fault:
            raise AssertionError(f"{fault}\n{reproducer(**record)}") from fault
        assert is_true(record)
        reached[kind_of(record)] += 1
    assert len(reached) == KINDS[scene] and min(reached.values()) >= 3, reached


@pytest.mark.parametrize("scene", SCENES)
def test_change_is_rejected_or_still_true(scene, rng) -> None:
    rejected = accepted = 0
    for _ in range(12):
        record = SCENES[scene](rng)
        for change, other in falsified(record, "claim", "evidence"):
            if not proves(other):
                rejected += 1
                continue
            accepted += 1
            assert is_true(other), f"{change}\n{reproducer(**record)}"
    assert rejected > accepted > 0


def is_valid(body) -> bool:
    """Whether the oracle can tell the planes of a body, if it is a frustum."""
    if body["kind"] != "frustum" or len(body["axes"]) < 3:
        return True
    l0, l1, u0, u1 = body["bounds"]
    near, far = body["near"], body["far"]
    a, b, c = (tuple(map(Fraction, axis)) for axis in body["axes"])
    return dot(a, cross(b, c)) != 0 and l0 < l1 and u0 < u1 and 0 < near < far < math.inf


@pytest.mark.parametrize("scene", SCENES)
def test_what_is_proven_of_other_bodies_is_true_of_them(scene, rng) -> None:
    accepted = 0
    for _ in range(4):
        record = SCENES[scene](rng)
        for change, other in falsified(record, "a", "b"):
            if proves(other) and is_valid(other["a"]):
                accepted += 1
                assert is_true(other), f"{change}\n{reproducer(**record)}"
    assert accepted > 0


# ----------------------------------------------------------------------------------------------------- malformed


BROKEN = {
    "no query": lambda r: r.pop("query"),
    "unknown query": lambda r: r.update(query="volume"),
    "no body": lambda r: r.pop("b"),
    "unknown kind": lambda r: r["a"].update(kind="cone"),
    "no vertices": lambda r: r["b"].update(vertices=[]),
    "vertex of another length": lambda r: r["b"]["vertices"].append([0.0, 0.0]),
    "not finite": lambda r: r["b"]["vertices"].append([0.0, math.inf, 0.0]),
    "not a number": lambda r: r["b"]["vertices"].append([0.0, "x", 0.0]),
    "not an object": lambda r: r.update(claim=[1]),
    "no evidence": lambda r: r.pop("evidence"),
    "no simplex": lambda r: r["evidence"].clear(),
    "empty simplex": lambda r: r["evidence"].update(simplex=[]),
    "simplex of too many": lambda r: r["evidence"].update(simplex=[[0, 0]] * 5),
    "index below": lambda r: r["evidence"].update(simplex=[[-1, 0]]),
    "index above": lambda r: r["evidence"].update(simplex=[[0, 2]]),
    "index no whole number": lambda r: r["evidence"].update(simplex=[[0.5, 0]]),
    "negative radius": lambda r: r["a"].update(radius=-1.0),
    "no lower": lambda r: r["claim"].pop("lower"),
    "nan": lambda r: r["claim"].update(lower=math.nan),
}


@pytest.mark.parametrize("change", BROKEN)
def test_broken_record_is_refused(change) -> None:
    a = {"kind": "sphere", "radius": 1.0}
    b = {"kind": "hull", "vertices": [[3.0, 0.0, 0.0], [4.0, 0.0, 0.0]]}
    record = distance_record(a, b)
    verify_record(record)
    BROKEN[change](record)
    with pytest.raises(CertificateError):
        verify_record(record)


def test_touching_is_meeting() -> None:
    record = distance_record({"kind": "sphere", "radius": 5.0}, {"kind": "hull", "vertices": [[3.0, 4.0, 0.0]]})
    assert record["claim"]["meets"] and proves(record)
    record["claim"]["meets"] = False
    assert not proves(record)


@pytest.mark.parametrize("scene", ["cull", "first contact", "first contact, space"])
def test_radius_is_for_distances_only(scene, rng) -> None:
    record = SCENES[scene](rng)
    record["b"]["radius"] = 0.5
    with pytest.raises(CertificateError, match="^no radius is expected here$"):
        verify_record(record)


def test_nesting_without_end_is_refused() -> None:
    nested: list = []
    for _ in range(100_000):
        nested = [nested]
    body = {"kind": "hull", "vertices": nested}
    with pytest.raises(CertificateError, match="RecursionError"):
        verify_record({"query": "distance", "a": body, "b": body, "claim": {"meets": True}, "evidence": {}})
    assert [fault for _, _, fault in verify_lines(["[" * 100_000])] != [""]


def test_nothing_is_proven_of_what_claims_nothing() -> None:
    verify_record({"query": "distance", "a": {"kind": "cone"}, "b": {"kind": "mesh"}, "claim": {}, "evidence": {}})


@pytest.mark.parametrize("exponent", [-1000, -300, 300, 900])
@pytest.mark.parametrize("scene", ["distance", "distance, plane", "first contact", "first contact, space"])
def test_huge_and_tiny_numbers(scene, exponent, rng) -> None:
    """Scaled by a power of two, so the proof stays the same."""

    def scaled(value, name=""):
        if isinstance(value, dict):
            keep = {"rotation", "axes", "time", "time_lower", "time_upper", "t_max", "at"}
            return {key: item if key in keep else scaled(item) for key, item in value.items()}
        if isinstance(value, list):
            return [scaled(item) for item in value]
        return math.ldexp(value, exponent) if isinstance(value, float) else value

    for _ in range(10):
        record = SCENES[scene](rng)
        verify_record(scaled(record))


# --------------------------------------------------------------------------------------------------------- files


def write(path, records) -> str:
    path.write_text("".join(f"{json_line(record)}\n" for record in records))
    return str(path)


def test_command_proves_files(tmp_path, capsys, rng) -> None:
    records = [scene(rng) for scene in SCENES.values() for _ in range(3)]
    empty = {**records[0], "claim": {}}
    good = write(tmp_path / "good.jsonl", records)
    capsys.readouterr()
    assert main(["verify", good]) == 0
    assert capsys.readouterr().out == "15 records: 15 proven, 0 failed\n"
    assert main(["verify", good, write(tmp_path / "more.jsonl", [empty])]) == 0
    assert capsys.readouterr().out == "16 records: 15 proven, 1 claim nothing, 0 failed\n"


def test_command_names_what_fails(tmp_path, capsys, rng) -> None:
    records = [distance_record(box(rng), posed(rng, hull(rng))) for _ in range(6)]
    for k in (1, 2, 3, 4):
        records[k]["claim"]["upper"] = records[k]["claim"]["lower"] - 1.0
    path = write(tmp_path / "bad.jsonl", records)
    capsys.readouterr()
    assert main(["verify", path]) == 1
    out = capsys.readouterr().out
    assert out.startswith(
        f"6 records: 2 proven, 4 failed: {path}:2: lower <= distance <= upper does not hold; {path}:3: "
    )
    assert out.endswith("; ...\n") and out.count("\n") == 1


def test_command_finds_a_tampered_digit(tmp_path, capsys, rng) -> None:
    record = distance_record({"kind": "sphere", "radius": 1.0}, {"kind": "hull", "vertices": [[3.0, 4.0, 12.0]]})
    path = tmp_path / "answer.jsonl"
    text = write(path, [record]) and path.read_text()
    twelve, other = (12.0).hex(), math.nextafter(12.0, 13.0).hex()
    parts = text.split(twelve)
    status = []
    for k in range(1, len(parts)):
        path.write_text(twelve.join(parts[:k]) + other + twelve.join(parts[k:]))
        status.append(main(["verify", str(path)]))
    assert status == [1, 1, 1, 0]  # a coordinate, lower, distance; a larger upper is true as well
    path.write_text(text[:-40])
    assert main(["verify", str(path)]) == 1


def test_command_cannot_read(tmp_path, capsys) -> None:
    assert main(["verify", str(tmp_path / "none.jsonl")]) == 2
    assert "cannot read" in capsys.readouterr().err
    (tmp_path / "image").write_bytes(b"\xff\xd8\xff")
    assert main(["verify", str(tmp_path / "image")]) == 2
    with pytest.raises(SystemExit) as stopped:
        main(["verify"])
    assert stopped.value.code == 2


# ------------------------------------------------------------------------------------------- what queries answer


def corpus_batches():
    """The hard cases as queries: an answer with certificates each."""
    for case in hard_cases("frustum_box"):
        f, b = (from_hex(case["input"])[name] for name in ("frustum", "box"))
        view = gs.Frustum(f["E"], [f["L"], f["U"], f["D"]], f["l"], f["u"], f["n"], f["f"])
        yield case["id"], lambda t, v=view, b=b: gs.cull(v, gs.Boxes([b["C"]], [b["A"]], [b["e"]]), **t)
    for case in hard_cases("point_frustum"):
        given = from_hex(case["input"])
        f = given["frustum"]
        view = gs.Frustum(f["E"], [f["L"], f["U"], f["D"]], f["l"], f["u"], f["n"], f["f"])
        yield case["id"], lambda t, v=view, p=given["point"]: gs.distance_to_frustum(v, [p], **t)
    for case in hard_cases("box_box_distance"):
        a, b = (gs.Boxes([x["C"]], [x["A"]], [x["e"]]) for x in (from_hex(case["input"])[k] for k in ("box0", "box1")))
        yield case["id"], lambda t, a=a, b=b: gs.distance(a, b, want=("penetration",), **t)
        yield case["id"], lambda t, a=a, b=b: gs.intersects(a, b, **t)
    for case in hard_cases("polygon2d_distance"):
        a, b = (polygons(from_hex(case["input"])[k]) for k in "PQ")
        yield case["id"], lambda t, a=a, b=b: gs.distance(a, b, want=("penetration",), **t)
        yield case["id"], lambda t, a=a, b=b: gs.intersects(a, b, **t)
    for case in hard_cases("polygon2d_moving"):
        given = from_hex(case["input"])
        a, b = (polygons(given[k]) for k in "PQ")
        yield (
            case["id"],
            lambda t, a=a, b=b, g=given: gs.first_contact(a, b, g["velP"], g["velQ"], t_max=g["tmax"], **t),
        )
    for case in hard_cases("polyhedra_moving"):
        given = from_hex(case["input"])
        a, b = (gs.Polytopes.from_list([given[k]["vertices"]]) for k in "PQ")
        yield (
            case["id"],
            lambda t, a=a, b=b, g=given: gs.first_contact(a, b, g["velP"], g["velQ"], t_max=g["tmax"], **t),
        )


@pytest.mark.parametrize("tier", TIERS)
def test_hard_cases_are_proven(tier) -> None:
    claims: Counter[tuple[str, bool]] = Counter()
    for name, ask in corpus_batches():
        try:
            answer = ask({"accuracy": tier, "certificates": True})
        except gs.NotAvailableError:
            continue
        try:
            gs.verify(answer)
        except CertificateError as fault:
            raise AssertionError(f"{name}: {fault}\n{next(answer.certificates.lines())}") from fault
        (record,) = answer.certificates
        assert is_true(record)
        claims[record["query"], bool(record["claim"])] += 1
    for query in ("cull", "distance", "first_contact"):
        assert claims[query, True] > (40 if tier == "float64" else 70), claims
        assert tier == "float64" or not claims[query, False], claims


def some_answers(tier):
    """An answer of several items from every query, that can be given at a tier."""
    view = gs.Frustum([0, 0, 0], np.eye(3), 1.0, 0.5, 1.0, 4.0)
    flat_view = gs.Frustum2D([0, 0], np.eye(2), 1.0, 1.0, 4.0)
    boxes = gs.Boxes([[0, 0, 2], [4, 0, 2], [0.5, 0.5, 2]], np.tile(np.eye(3), (3, 1, 1)), np.full((3, 3), 0.25))
    rings = polygons([(0, 0), (1, 0), (1, 1), (0, 1)], [(3, 0), (4, 0), (4, 1)], [(0.5, 0.5)])
    hulls = gs.Polytopes.from_list([np.eye(3), [[0.0, 0.0, 2.0]], [[1, 1, 1], [2, 3, 4]]])
    poses = [[3, 0, 0, 0, 0, 0, 1], [0.5, 0.25, 0, 0, 0, 0.6, 0.8], [0, 2, 1, 0.5, 0.5, 0.5, 0.5]]
    corner = gs.Convex([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    asks = {
        "cull": lambda t: gs.cull(view, boxes, **t),
        "to frustum": lambda t: gs.distance_to_frustum(view, [[0, 0, 0], [0, 0, 2], [9, 9, 9]], **t),
        "to frustum, plane": lambda t: gs.distance_to_frustum(flat_view, [[0, 0], [0, 2], [9, 9]], **t),
        "first contact": lambda t: gs.first_contact(rings, polygons([(5, 0), (6, 0), (6, 9)]), (1, 0), (0, 0.5), **t),
        "first contact, space": lambda t: gs.first_contact(
            hulls, gs.Boxes([[3, 0, 0]], [np.eye(3)], [[1, 1, 2]]), [[1, 0, 0], [1, 0.25, 0], [1, 0, 1]], (0, 0, 0), **t
        ),
        "polygons": lambda t: gs.distance(polygons([(2, 0), (3, 3)]), rings, **t),
        "boxes": lambda t: gs.distance(boxes, boxes, **t),
        "boxes, hulls": lambda t: gs.distance(boxes, hulls, want=("penetration",), **t),
        "hulls, frustum": lambda t: gs.distance(hulls, view, want=("penetration",), **t),
    }
    solids = [
        gs.Sphere(1.0),
        gs.Capsule(0.5, 2.0),
        gs.Box([1.0, 0.5, 0.25]),
        corner,
        view,
        gs.Segment((0, 0, 0), (1, 2, 3)),
    ]
    for a, b in combinations_with_replacement(solids, 2):
        name = f"{a.kind}-{b.kind}"
        asks[name] = lambda t, a=a, b=b: gs.distance(a, b, poses, want=("penetration",), **t)
        asks[f"{name} meet"] = lambda t, a=a, b=b: gs.intersects(a, b, poses, **t)
    for name, ask in asks.items():
        try:
            yield name, ask({"accuracy": tier, "certificates": True})
        except gs.NotAvailableError:
            continue


@pytest.mark.parametrize("tier", TIERS)
def test_answers_are_proven_and_their_records_true(tier, tmp_path, capsys) -> None:
    claimed: Counter[bool] = Counter()
    for name, answer in some_answers(tier):
        try:
            gs.verify(answer)
        except CertificateError as fault:
            raise AssertionError(f"{name}: {fault}") from fault
        assert len(answer.certificates) == 3
        for record in answer.certificates:
            assert is_true(record), f"{name}\n{reproducer(**record)}"
            claimed[bool(record["claim"])] += 1
        answer.certificates.save(tmp_path / "answer.jsonl")
        assert main(["verify", str(tmp_path / "answer.jsonl")]) == 0
        lines = list(map(json_line, answer.certificates))
        assert (tmp_path / "answer.jsonl").read_text().splitlines() == lines == list(answer.certificates.lines())
    assert claimed[True] > 5 * claimed[False]
    capsys.readouterr()


def test_exact_answer_ends_at_its_proof(monkeypatch, rng) -> None:
    """The corners that the engine hands over already hold the nearest point: nothing is left to be searched for."""
    sizes: Counter[int] = Counter()
    search = evidence._simplex

    def watched(a, b, start):
        found = search(a, b, start)
        assert start and all(pair in start for pair in found), reproducer(a=a, b=b, start=start, found=found)
        sizes[len(found)] += 1
        return found

    monkeypatch.setattr(evidence, "_simplex", watched)
    for _ in range(12):
        axes = np.array([[0.0, 0, 1], [1, 0, 0], [0, 1, 0]])
        low, high = sorted(rng.uniform(-2.0, 2.0, 2)), sorted(rng.uniform(-2.0, 2.0, 2))
        view = gs.Frustum(rng.normal(size=3), axes, bounds=(*low, *high), near=1.0, far=rng.uniform(1.5, 4.0))
        for record in gs.distance_to_frustum(
            view, rng.uniform(-8.0, 8.0, (40, 3)), accuracy="exact", certificates=True
        ).certificates:
            assert proves(record)
    assert min(sizes[1], sizes[2], sizes[3]) >= 15, sizes


TAMPERED = [
    ("cull", "state", lambda x: 2 - x),
    ("to frustum", "distance", lambda x: x + 10.0),
    ("to frustum", "lower", lambda x: x + 10.0),
    ("to frustum", "upper", lambda x: x - 10.0),
    ("boxes", "upper", lambda x: x - 10.0),
    ("capsule-box", "lower", lambda x: x + 0.125),
    ("capsule-box", "distance", lambda x: x - 0.125),
    ("capsule-box meet", "value", lambda x: ~x),
    ("first contact, space", "status", lambda x: (x + 1) % 4),
    ("first contact, space", "time", lambda x: x + 0.125),
    ("first contact", "status", lambda x: (x + 1) % 4),
    ("first contact", "time", lambda x: x + 0.125),
]


@pytest.mark.parametrize(("name", "field", "change"), TAMPERED, ids=[f"{n}, {f}" for n, f, _ in TAMPERED])
def test_changed_answer_is_noticed(name, field, change) -> None:
    answer = dict(some_answers("exact" if name.startswith("first contact") else "float64"))[name]
    gs.verify(answer)
    with pytest.raises(CertificateError, match=r"^item \d: "):
        gs.verify(dataclasses.replace(answer, **{field: change(getattr(answer, field))}))
    column = getattr(answer, field)
    column[:] = change(column)
    with pytest.raises(CertificateError, match=r"^item \d: "):
        gs.verify(answer)


@pytest.mark.parametrize(
    "name", ["boxes, hulls", "capsule-convex", "box-box", "cull", "to frustum, plane", "first contact, space"]
)
def test_change_in_a_record_is_rejected_or_still_true(name) -> None:
    rejected = 0
    for record in dict(some_answers("float64"))[name].certificates:
        for change, other in falsified(record, "claim", "evidence"):
            if proves(other):
                assert is_true(other), f"{change}\n{reproducer(**record)}"
            else:
                rejected += 1
    assert rejected > 20


def test_certificates_have_to_be_asked_for() -> None:
    ask = dict(a=gs.Sphere(1.0), b=gs.Sphere(1.0), poses_ab=[3, 0, 0, 0, 0, 0, 1])
    answer = gs.distance(**ask)
    assert answer.certificates is None
    with pytest.raises(CertificateError, match="^the answer carries no certificates; ask with certificates=True$"):
        gs.verify(answer)
    proven = gs.distance(**ask, certificates=True)
    assert (proven.distance, proven.lower, proven.upper) == (answer.distance, answer.lower, answer.upper)
    with pytest.raises(IndexError):
        proven.certificates[1]
    assert proven.certificates[-1] == proven.certificates[0] and "_record" not in repr(proven)


def test_page_on_certificates(tmp_path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    page = Path(__file__).resolve().parents[1] / "docs" / "certificates.md"
    result = doctest.testfile(str(page), module_relative=False)
    assert result.attempted > 5 and not result.failed
    assert main(["verify", "answer.jsonl"]) == 0
