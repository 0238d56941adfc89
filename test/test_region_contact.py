# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""Where regions touch: the contact set of the whole, whatever pieces they are cut into, judged in exact arithmetic."""

from __future__ import annotations

import math
from collections import Counter
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from contact_answers import STATUS, set_distance
from oracle.polygon import NEVER, OVERLAPPING
from oracle.region import Union, UnionContact, contact_of_unions
from oracle.vectors import nearest_double, root_double, squared_norm
from polygon_scenes import random_ring
from test_region import ANGLE, FORK, FRAME, area, star

import geomsrv as gs

COMB = [(0, 0), (9, 0), (9, 3), (8, 3), (8, 1), (6, 1), (6, 3), (5, 3), (5, 1), (3, 1), (3, 3), (1, 3), (1, 1), (0, 1)]
NOTCH = [(-4, -4), (4, -4), (4, 4), (0, 0), (-4, 4)]
WEDGE = [(0, 5), (4, 9), (-4, 9)]


def union(body: Any) -> Union:
    if isinstance(body, gs.Polygons):
        return Union([body[0]], [body[0]])
    return Union(list(body.pieces), [body.outline, *(hole[::-1] if area(hole) > 0 else hole for hole in body.holes)])


def judge(a: Any, b: Any, v: Any, w: Any, t_max: float = math.inf) -> tuple[gs.FirstContacts, UnionContact]:
    """At the exact tier every number is the correctly rounded one."""
    answer = gs.first_contact(a, b, v, w, t_max=t_max, accuracy="exact")
    truth = contact_of_unions(union(a), np.asarray(v, float), union(b), np.asarray(w, float), t_max)
    told = describe(answer, truth)
    assert answer.status[0] == STATUS[truth.status] and answer.certain[0], told
    if truth.status == NEVER:
        assert len(answer.points) == 0 and np.isnan([answer.time[0], answer.last_time[0], *answer.normal[0]]).all()
        return answer, truth
    assert answer.time[0] == nearest_double(truth.time), told
    assert answer.time_lower[0] <= truth.time <= answer.time_upper[0], told
    last = truth.last_time if truth.parts else None
    assert answer.last_time[0] == (math.inf if last is None else nearest_double(last)), told
    check_set(answer, truth)
    return answer, truth


def describe(answer: gs.FirstContacts, truth: UnionContact) -> str:
    return f"{truth}\n{answer.status} {answer.time} {answer.normal} {answer.points.tolist()}"


def check_set(answer: gs.FirstContacts, truth: UnionContact) -> None:
    parts = answer.parts(0)
    assert answer.part_offsets[-1] == len(answer.points) and sum(map(len, parts)) == len(answer.points)
    if truth.area > 0:
        assert all(len(part) > 2 for part in parts) and np.isnan(answer.normal).all()
        shared = sum(map(area, parts))
        assert abs(shared - truth.area) <= truth.area * Fraction(1e-12)
        return
    # Another representation of the same set would be a fault, too.
    rounded = [[nearest_double(x) for x in p] for p in truth.points]
    assert sorted(part[0].tolist() for part in parts if len(part) == 1) == sorted(rounded)
    ends = sorted(sorted(part.tolist()) for part in parts if len(part) == 2)
    assert ends == sorted(sorted([nearest_double(x) for x in p] for p in s) for s in truth.segments), describe(
        answer, truth
    )
    if truth.status == OVERLAPPING or not truth.normals:
        assert np.isnan([*answer.normal[0], answer.closing_speed[0]]).all(), describe(answer, truth)
        return
    units = [[math.copysign(root_double(Fraction(x * x) / squared_norm(n)), x) for x in n] for n in truth.normals]
    assert any((answer.normal[0] == n).all() for n in units), describe(answer, truth)
    speed = math.copysign(
        root_double(abs(truth.speed_sq) * Fraction(2) ** -1800) * 2.0**900, 1 if truth.speed_sq > 0 else -1
    )
    assert answer.closing_speed[0] == pytest.approx(speed, rel=1e-12, abs=1e-12)


def on_grid(rng: np.random.Generator, at: Any) -> gs.Region:
    """A region of which corners and edges often meet those of another."""
    if rng.random() < 0.7:
        outline, holes = [(COMB, []), (NOTCH, []), (ANGLE, []), FRAME][int(rng.integers(4))]
        turn = np.linalg.matrix_power(np.array([[0, 1], [-1, 0]]), int(rng.integers(4)))
        middle = np.mean(outline, axis=0).round()
        return gs.Region((outline - middle) @ turn + at, [(hole - middle) @ turn + at for hole in holes])
    while True:
        try:
            return gs.Region(np.round(star(rng, int(rng.integers(4, 10)), at, 6.0)))
        except gs.GeometryError:  # rounding made it cross itself
            continue


def aimed(rng: np.random.Generator) -> tuple[Any, Any]:
    """A velocity and where something lies that a body in the origin flies at, or so."""
    v = rng.integers(-2, 3, 2) if rng.random() < 0.5 else np.array([(1, 0), (0, 1), (0, -2)][int(rng.integers(3))])
    return v, np.sign(v) * rng.integers(4, 14) + rng.integers(-4, 5, 2)


def test_random_regions_on_a_grid(rng: np.random.Generator) -> None:
    seen = Counter[str]()
    for k in range(90):
        v, at = aimed(rng)
        a, w = on_grid(rng, (0, 0)), rng.integers(-1, 2, 2)
        v = v + w
        ring = np.array(random_ring(rng, 4, 0.0)) + at
        b = gs.Polygons.from_list([ring]) if k % 4 == 1 and len(ring) > 2 else on_grid(rng, at)
        answer, truth = judge(a, b, v, w, math.inf if k % 5 else 3.0)
        seen[truth.status] += 1
        seen["parts"] += len(answer.parts(0)) > 1 and truth.area == 0
        seen["segment"] += len(truth.segments) > 0
        if k % 4 == 0:
            judge(b, a, w, v, math.inf if k % 5 else 3.0)
    floor = {"NEVER": 2, "WILL_TOUCH": 20, "TOUCHING": 1, "OVERLAPPING": 4, "parts": 1, "segment": 10}
    assert all(seen[name] >= least for name, least in floor.items()), seen


def test_turned_regions(rng: np.random.Generator) -> None:
    """Coordinates that are no round numbers, at float64 too."""
    hits = 0
    for k in range(18):
        angle = rng.uniform(0, 2 * math.pi)
        turn = np.array([[math.cos(angle), math.sin(angle)], [-math.sin(angle), math.cos(angle)]])
        a, b = (
            gs.Region(ring) for ring in (np.array(COMB) @ turn, (np.array(COMB)[:, ::-1] * 0.8 + (0, 9))[::-1] @ turn)
        )
        v, w = np.array([(k % 3 - 1) * 0.2, 1]) @ turn, (0.0, 0.0)
        _, truth = judge(a, b, v, w)
        rough = gs.first_contact(a, b, v, w)
        if truth.status == "WILL_TOUCH" and rough.certain[0]:
            hits += 1
            assert rough.time_lower[0] <= truth.time <= rough.time_upper[0]
            assert abs(rough.last_time[0] - truth.last_time) < 1e-12
            places = [[float(x) for x in p] for p in (*truth.points, *(x for s in truth.segments for x in s))]
            # Rounding may part edges that are nearly parallel, not more.
            apart = np.abs(rough.points[:, None] - np.array(places)[None]).max(axis=2)
            assert apart.min(axis=0).max() < 1e-12
    assert hits > 8


def test_float64_agrees_where_there_is_no_doubt(rng: np.random.Generator) -> None:
    """On a grid all slack is far smaller than what tells sets apart."""
    seen = 0
    for _ in range(120):
        v, at = aimed(rng)
        a, b = on_grid(rng, (0, 0)), on_grid(rng, at)
        exactly, rough = (gs.first_contact(a, b, v, (0, 0), accuracy=tier) for tier in ("exact", "float64"))
        if rough.status[0] != exactly.status[0] or rough.status[0] not in (gs.WILL_TOUCH, gs.TOUCHING):
            assert rough.status[0] == exactly.status[0] or not rough.certain[0]
            continue
        seen += 1
        assert [len(part) for part in rough.parts(0)] == [len(part) for part in exactly.parts(0)]
        assert set_distance(rough.points, exactly.points) < 1e-13
        assert np.allclose(rough.normal, exactly.normal, atol=1e-14, equal_nan=True)
        single = gs.first_contact(a, b, v, (0, 0), accuracy="float32")
        assert single.status[0] != gs.NEVER
    assert seen > 25


def test_a_convex_region_is_the_polygon(rng: np.random.Generator) -> None:
    diamond = np.array([(2, 0), (0, 1), (-2, 0), (0, -1)])
    for k in range(150):
        one, two = np.array(random_ring(rng, 5, 0.0)), np.array(random_ring(rng, 5)) + rng.integers(-8, 9, 2)
        v = rng.integers(-2, 3, 2)
        if k < 2:  # corner on corner head on: of two normals the rule takes one
            one, two, v = diamond, diamond + (9, 0), (1, 0)
            if k:
                one, two, v = one[:, ::-1][::-1], two[:, ::-1][::-1], (0, 1)
        if len(one) < 3:
            continue
        other = gs.Polygons.from_list([two])
        answers = [
            gs.first_contact(body, other, v, (0, 0), accuracy="exact")
            for body in (gs.Region(one), gs.Polygons.from_list([one]))
        ]
        for name in ("status", "time", "time_lower", "time_upper", "last_time", "normal", "certain", "closing_speed"):
            assert np.array_equal(*(getattr(x, name) for x in answers), equal_nan=True), (k, name, one, two, v)
        if answers[0].status[0] in (gs.WILL_TOUCH, gs.TOUCHING):
            assert np.array_equal(answers[0].points, answers[1].points), (one, two, v)


@pytest.mark.parametrize("scale", [1.0, 2.0**-900, 2.0**900])
def test_named_contacts(scale: float) -> None:
    """What a contact set of wholes is, at any scale."""

    def region(outline: Any, *holes: Any) -> gs.Region:
        return gs.Region(np.array(outline, float) * scale, [np.array(hole, float) * scale for hole in holes])

    def ask(a: Any, b: Any, v: Any) -> gs.FirstContacts:
        answer = judge(a, b, np.array(v, float) * scale, (0, 0))[0]
        return answer

    def sets(answer: gs.FirstContacts) -> list[Any]:
        return [sorted((part / scale).tolist()) for part in answer.parts(0)]

    wall = region([(-5, 10), (15, 10), (15, 12), (-5, 12)])
    up = ask(region(COMB), wall, (0, 1))  # three prongs
    assert sets(up) == [[[1, 10], [3, 10]], [[5, 10], [6, 10]], [[8, 10], [9, 10]]]
    assert up.normal.tolist() == [[0, 1]] and up.time[0] == 7 and up.closing_speed[0] == scale
    # A wedge in a notch touches both flanks, which leave no one normal.
    wedge = ask(region(WEDGE), region(NOTCH), (0, -1))
    assert wedge.time[0] == 5 and np.isnan(wedge.normal).all()
    assert sets(wedge) == [[[-4, 4], [0, 0]], [[0, 0], [4, 4]]]
    # One that is sharper touches the corner alone.
    needle = ask(region([(0, 5), (1, 9), (-1, 9)]), region(NOTCH), (0, -1))
    assert sets(needle) == [[[0, 0]]] and np.isnan(needle.normal).all()
    # In a hole, up against its right side, across what the frame was cut by.
    block = region([(1, 1), (2, 1), (2, 3), (1, 3)])
    inner = ask(block, region(*FRAME[:1], *FRAME[1]), (1, 0))
    assert inner.status[0] == gs.TOUCHING and sets(inner) == [[[1, 1], [1, 3]], [[1, 1], [2, 1]], [[1, 3], [2, 3]]]
    free = region([(1.25, 1.25), (2, 1.25), (2, 2.75), (1.25, 2.75)])
    inner = ask(free, region(*FRAME[:1], *FRAME[1]), (1, 0))
    assert inner.time[0] == 1 and inner.last_time[0] == 2.75 and sets(inner) == [[[3, 1.25], [3, 2.75]]]
    # Along an outline with a collinear corner, which a seam may end at: one segment.
    shelf = region([(0, 0), (2, 0), (4, 0), (4, 3), (2, 1), (0, 3)])
    under = ask(region([(0.5, -4), (3.5, -4), (3.5, -2), (2, -3), (0.5, -2)]), shelf, (0, 1))
    assert sets(under) == [[[0.5, 0]], [[3.5, 0]]]
    under = ask(region([(0.5, -4), (3.5, -4), (3.5, -2), (0.5, -2)]), shelf, (0, 1))
    assert sets(under) == [[[0.5, 0], [3.5, 0]]]


def test_sliding_and_grazing() -> None:
    """Decided by one ulp."""
    tray = gs.Region([(0, 0), (9, 0), (9, 3), (8, 3), (8, 1), (1, 1), (1, 3), (0, 3)])
    block = gs.Region([(2, 1), (4, 1), (4, 2), (2, 2)])
    slide, _ = judge(block, tray, (1, 0), (0, 0))
    assert slide.status[0] == gs.TOUCHING and slide.last_time[0] == 7
    assert slide.normal[0].tolist() == [0, -1] and slide.closing_speed[0] == 0
    for edge, status in ((3.0, gs.WILL_TOUCH), (math.nextafter(3.0, 4.0), gs.NEVER)):
        pole = gs.Polygons.from_list([[(20, edge), (21, edge), (21, edge + 1), (20, edge + 1)]])
        answer, _ = judge(tray, pole, (1, 0), (0, 0))
        assert answer.status[0] == status
        rough = gs.first_contact(tray, pole, (1, 0), (0, 0))
        assert not rough.certain[0]
    # Two prongs of which one is an ulp longer: it alone touches, exactly; within the rounding both do.
    high = math.nextafter(3.0, 4.0)
    fork = gs.Region([(0, 0), (9, 0), (9, high), (8, high), (8, 1), (1, 1), (1, 3), (0, 3)])
    wall = gs.Polygons.from_list([[(-5, 10), (15, 10), (15, 12), (-5, 12)]])
    answer, truth = judge(fork, wall, (0, 1), (0, 0))
    assert truth.segments == (((8, 10), (9, 10)),)
    assert len(gs.first_contact(fork, wall, (0, 1), (0, 0)).parts(0)) == 2


@pytest.mark.parametrize("accuracy", ["float64", "exact"])
def test_thin_bodies_on_seams_are_inside(accuracy: str) -> None:
    seams = 0
    for region in (gs.Region(ANGLE), gs.Region(*FRAME), gs.Region(FORK), gs.Region(COMB)):
        for piece in region.pieces:
            for p, q in zip(piece, [*piece[1:], piece[0]], strict=True):
                middle = 0.5 * (p + q)
                seam = not region.on_border(middle)
                seams += seam
                thin = gs.Polygons.from_list([[middle], [p], [p, q]])
                for answer in (
                    gs.first_contact(region, thin, (1, 0), (0, 0), accuracy=accuracy),
                    gs.first_contact(thin, region, (1, 0), (0, 0), accuracy=accuracy),
                ):
                    expected = gs.OVERLAPPING if seam else gs.TOUCHING
                    if accuracy == "exact" or seam:
                        assert answer.status.tolist() == [expected, gs.TOUCHING, expected]
                    assert set_distance(answer.parts(2)[0], [p, q]) < 1e-15 and len(answer.parts(2)) == 1
                    assert np.isnan(answer.normal[[0, 2]]).all() == seam
                    if accuracy == "exact":
                        assert answer.certain.all() and answer.parts(0)[0].tolist() == [middle.tolist()]
    assert seams > 10
    # Through and through, past a notch: what is inside, and no more.
    bar = gs.Polygons.from_list([[(-1, 1.5), (3, 1.5)], [(-1, 2), (3, 2)], [(1, -1), (1, 3)]])
    across = gs.first_contact(gs.Region(ANGLE), bar, (0, 0), (0, 0), accuracy=accuracy)
    assert across.status.tolist() == [gs.OVERLAPPING, gs.TOUCHING, gs.OVERLAPPING]
    assert [[sorted(p.tolist()) for p in across.parts(i)] for i in range(3)] == [
        [[[0, 1.5], [1, 1.5]]],
        [[[0, 2], [1, 2]]],
        [[[1, 0], [1, 2]]],
    ]


def test_items_keep_their_own_sets() -> None:
    """One region against many, some of which it never meets."""
    comb = gs.Region(COMB)
    boxes = gs.Polygons.from_list(
        [[(x, y), (x + 5, y), (x + 5, y + 1), (x, y + 1)] for x, y in ((0, 5), (50, 5), (4, 9))]
    )
    answer = gs.first_contact(comb, boxes, (0, 1), [(0, 0)] * 3)
    assert answer.status.tolist() == [1, 0, 1] and [len(answer.parts(i)) for i in range(3)] == [2, 0, 2]
    assert answer.parts(-3)[0].tolist() == answer.points[:2].tolist() and answer.parts(1) == []
    quick = gs.first_contact(comb, boxes, (0, 1), (0, 0), contact_set=False)
    assert len(quick.points) == 0 and np.array_equal(quick.normal, answer.normal, equal_nan=True)
    convex = gs.first_contact(boxes, boxes, (0, 1), (0, 0))
    assert [len(convex.parts(i)) for i in range(3)] == [1, 1, 1]
    spun = gs.first_contact(comb, boxes, (0, 1), (0, 0), angular_velocity_a=0.1)
    assert [len(spun.parts(i)) for i in range(3)] == [1, 0, 1]
