# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""Polygons that come as float32: which ring was meant, and how it moves."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest
from conftest import reproducer

import geomsrv as gs
from geomsrv.ros.polygons import Motion, PolygonTracks, convex_ring, displacement, float32_floor

SQUARE = np.array([[0.0, 0], [1, 0], [1, 1], [0, 1]])


def rounded(points):
    return np.asarray(points, dtype=np.float64).astype(np.float32).astype(np.float64)


def ring_of(points):
    return convex_ring(points, float32_floor(points))


def moved_by(before, after, seconds):
    return displacement(before, after, float32_floor(before) + float32_floor(after), seconds)


def test_the_floor_bounds_the_rounding(rng) -> None:
    """Exactly, over all magnitudes, subnormal numbers included."""
    exponents = rng.integers(-160, 120, size=4000)
    exact = np.ldexp(rng.uniform(-1, 1, size=4000), exponents)
    single = rounded(exact)
    floor = float32_floor(single)
    tight = 0
    for x, y, bound in zip(exact.tolist(), single.tolist(), floor.tolist(), strict=True):
        off = abs(Fraction(x) - Fraction(y))
        assert off <= Fraction(bound), reproducer(x=x)
        tight += off > Fraction(bound) / 2
    assert tight > 200, "the bound is not a loose one"


@pytest.mark.parametrize("size", [1e-3, 1.0, 1e4])
def test_honest_rings_are_accepted(rng, size) -> None:
    """Dense rings and straight chains, turned and shifted: rounding makes many of them slightly non-convex."""
    bent = 0
    for _ in range(150):
        count = int(rng.integers(3, 40))
        angles = np.sort(rng.uniform(0, 2 * np.pi, count))
        ring = np.column_stack([np.cos(angles), np.sin(angles)]) * size
        # Straight chains: points on the edges.
        ring = np.concatenate([np.linspace(a, b, 4)[:-1] for a, b in zip(ring, np.roll(ring, -1, axis=0), strict=True)])
        points = rounded(ring + rng.uniform(-10, 10, 2) * size)
        try:
            gs.Polygon(points)
        except gs.GeometryError:
            bent += 1
        got = ring_of(points)
        polygon = gs.Polygon(got)  # convex and counter-clockwise, exactly
        assert {tuple(p) for p in polygon.vertices} <= {tuple(p) for p in points}
        # No point that came is farther from the ring than its floor allows.
        reach = 2 * np.hypot(*float32_floor(points).max(axis=0))
        away = gs.distance(gs.Polygons(got, [0, len(got)]), gs.Polygons(points, np.arange(len(points) + 1)))
        assert (away.distance <= reach).all(), reproducer(points=points)
    assert bent > 50, "rounding bent too few rings for this test to mean anything"


@pytest.mark.parametrize("start", range(4))
@pytest.mark.parametrize("repeat", [(), (1,), (0, 2, 2)])
def test_starting_points_and_repeated_vertices_do_not_matter(start, repeat) -> None:
    points = np.insert(np.roll(SQUARE, start, axis=0), repeat, np.roll(SQUARE, start, axis=0)[list(repeat)], axis=0)
    assert {tuple(p) for p in ring_of(points)} == {tuple(p) for p in SQUARE}
    assert len(ring_of(points)) == 4


@pytest.mark.parametrize(
    ("points", "count"),
    [([(3, 4)], 1), ([(3, 4)] * 3, 1), ([(0, 0), (1, 1)], 2), ([(0, 0), (1, 1), (2, 2), (1, 1)], 2)],
)
def test_points_and_segments_are_rings(points, count) -> None:
    assert len(ring_of(np.array(points, dtype=float))) == count


def test_slivers_have_no_sense_of_turning() -> None:
    flat = rounded([(0, 0), (1, 1 / 3), (2, 2 / 3), (1, 1 / 3)])
    flat[1, 1] = np.nextafter(np.float32(flat[1, 1]), np.float32(1))  # turns it clockwise by its last bit
    assert len(ring_of(flat)) >= 2
    assert len(ring_of(flat[::-1])) >= 2


STAR = np.array([[np.cos(a), np.sin(a)] for a in 4 * np.pi / 5 * np.arange(5)])


@pytest.mark.parametrize(
    ("points", "text"),
    [
        (SQUARE[::-1], "clockwise"),
        (SQUARE[[2, 1, 0]], "clockwise"),
        (SQUARE[[0, 1, 3, 2]], "not convex"),
        (STAR, "not convex"),
        (np.array([(0, 0), (2, 0), (1, 0.5), (1, 2)]), "not convex at its point 2"),
        (np.concatenate([SQUARE, SQUARE]), "not convex"),
        (np.array([(0, 0), (1, 0), (1, 1), (0, 1), (0.5, 0.5)]), "not convex at its point 4"),
        (np.zeros((0, 2)), "no points"),
    ],
)
def test_other_rings_are_refused_by_name(points, text) -> None:
    with pytest.raises(gs.GeometryError, match=text):
        ring_of(np.asarray(points, dtype=float))


def test_a_dent_deeper_than_the_floor_is_refused() -> None:
    for depth, fine in ((1e-7, True), (1e-6, False)):
        ring = rounded([(0, 0), (0.5, depth), (1, 0), (1, 1), (0, 1)])
        if fine:
            assert len(ring_of(ring)) == 4
        else:
            with pytest.raises(gs.GeometryError, match="not convex at its point 1"):
                ring_of(ring)


def test_translations_are_found_up_to_the_floor(rng) -> None:
    widths = []
    for _ in range(300):
        count, place = int(rng.integers(1, 12)), rng.uniform(-100, 100, 2)
        ring, moved = rng.uniform(-1, 1, (count, 2)) + place, rng.uniform(-3, 3, 2)
        seconds = float(rng.uniform(0.01, 2))
        got = moved_by(rounded(ring), rounded(ring + moved), seconds)
        assert not got.fault, reproducer(ring=ring, moved=moved)
        error = np.hypot(*(np.array(got.velocity) - moved / seconds))
        assert error <= got.velocity_floor * (1 + 1e-9), reproducer(ring=ring, moved=moved, seconds=seconds)
        widths.append(error / got.velocity_floor)
    assert max(widths) > 0.5, "the bound is not a loose one"


def test_rotations_and_deformations_are_not() -> None:
    turn = SQUARE @ [[0.8, 0.6], [-0.6, 0.8]]
    assert moved_by(SQUARE, turn, 1.0).fault == "the motion is not a translation"
    grown = SQUARE * 1.001
    assert moved_by(SQUARE, grown, 1.0).fault == "the motion is not a translation"
    # A turn that float32 cannot see is one that nobody can see.
    tiny, there = 1e-9, SQUARE + (5, 5)
    assert not moved_by(there, rounded(there @ [[1, tiny], [-tiny, 1]]), 1.0).fault


def test_tracks() -> None:
    tracks = PolygonTracks()

    def update(name, points, seconds):
        return tracks.update(name, points, float32_floor(points), seconds * 10**9)

    assert update("a", SQUARE, 1) == Motion(), "the first one: nothing is known"
    assert update("a", SQUARE + (1, 0), 3).velocity == pytest.approx((0.5, 0))
    assert update("b", SQUARE, 3) == Motion()
    assert update("a", SQUARE + (9, 0), 3) == Motion(), "the same time again tells nothing"
    assert update("a", SQUARE, 1) == Motion(), "and neither does an earlier one"
    assert update("a", SQUARE[:3], 2).fault == "the motion is not a translation: 4 points became 3"
    tracks.forget_all_but({"a"})
    assert update("b", SQUARE + (1, 0), 5) == Motion(), "it was forgotten"
    assert update("a", SQUARE[:3] + (1, 0), 4).velocity == pytest.approx((0.5, 0)), "and this one was not"
