# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""Shapes that are not convex: their pieces cover them exactly, and footprints made of them meet first what is first."""

from __future__ import annotations

import math
from fractions import Fraction
from typing import Any

import numpy as np
import pytest

import geomsrv as gs

ANGLE = [(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)]
FRAME = ([(0, 0), (4, 0), (4, 4), (0, 4)], [[(1, 1), (3, 1), (3, 3), (1, 3)]])
FORK = [(-0.4, -0.3), (0.8, -0.3), (0.8, -0.2), (0.2, -0.2), (0.2, 0.2), (0.8, 0.2), (0.8, 0.3), (-0.4, 0.3)]


def area(ring: Any) -> Fraction:
    """Exactly, twice."""
    p = [(Fraction(float(x)), Fraction(float(y))) for x, y in ring]
    return sum((a[0] * b[1] - a[1] * b[0] for a, b in zip(p, [*p[1:], p[0]], strict=True)), Fraction(0))


def winding(rings: Any, point: Any) -> bool:
    """Even-odd, of a point in general position, exactly."""
    x, y = (Fraction(float(v)) for v in point)
    inside = False
    for ring in rings:
        p = [(Fraction(float(u)), Fraction(float(v))) for u, v in ring]
        for a, b in zip(p, [*p[1:], p[0]], strict=True):
            if (a[1] > y) != (b[1] > y) and a[0] + (y - a[1]) * (b[0] - a[0]) / (b[1] - a[1]) > x:
                inside = not inside
    return inside


def star(rng: np.random.Generator, n: int, center: Any = (0.0, 0.0), size: float = 1.0) -> np.ndarray:
    """Star-shaped about its centre, so it is simple."""
    angles = np.sort(rng.uniform(0, 2 * math.pi, n))
    while np.diff(angles, append=angles[0] + 2 * math.pi).max() > 3.0:
        angles = np.sort(rng.uniform(0, 2 * math.pi, n))
    return center + size * rng.uniform(0.2, 1.0, (n, 1)) * np.column_stack([np.cos(angles), np.sin(angles)])


def check_pieces(rng: np.random.Generator, region: gs.Region) -> None:
    """They add up to it and lie in it: so they cover it once."""
    rings = [region.outline, *region.holes]
    wanted = area(region.outline) - sum(abs(area(hole)) for hole in region.holes)
    assert sum(area(piece) for piece in region.pieces) == wanted
    corners = {tuple(c) for ring in rings for c in ring.tolist()}
    assert {tuple(c) for piece in region.pieces for c in piece.tolist()} <= corners
    low, high = region.outline.min(axis=0), region.outline.max(axis=0)
    for point in rng.uniform(low, high, (40, 2)):
        assert winding(rings, point) == any(winding([piece], point) for piece in region.pieces), point.tolist()


def test_pieces(rng: np.random.Generator) -> None:
    check_pieces(rng, gs.Region(ANGLE))
    check_pieces(rng, gs.Region(*FRAME))
    check_pieces(rng, gs.Region(FORK))
    # Corners on a line, and so near one that only exact signs tell.
    check_pieces(rng, gs.Region([(0, 0), (1, 0), (2, 0), (2, 1), (1, np.nextafter(1, 0)), (0, 1)]))
    check_pieces(rng, gs.Region([(0, 0), (1, 5e-324), (2, 0), (2, 1), (0, 1)]))
    for n in (4, 7, 12, 25, 60):
        for _ in range(6):
            check_pieces(rng, gs.Region(star(rng, n)))


def test_pieces_around_holes(rng: np.random.Generator) -> None:
    for _ in range(20):
        holes = [star(rng, int(rng.integers(4, 9)), (x, y), 0.4) for x in (-1, 0, 1) for y in (-1, 0, 1)]
        kept = [h[:: int(rng.choice([-1, 1]))] for h in holes if rng.random() < 0.6]
        check_pieces(rng, gs.Region([(-2, -2), (2, -2), (2, 2), (-2, 2)], kept))


def test_faults_are_named() -> None:
    square = FRAME[0]
    for outline, holes, text in [
        (square[::-1], [], "outline is clockwise"),
        ([(0, 0), (1, 1)], [], "outline must have at least 3 vertices, got 2"),
        (
            [(0, 0), (2, 2), (2, 0), (0, 2)],
            [],
            "outline: the edge at its vertex 0 meets that of outline at its vertex 2",
        ),
        ([(0, 0), (2, 0), (1, 0), (1, 1)], [], "outline turns back on itself at its vertex 1"),
        ([(0, 0), (2, 0), (0, 0), (1, 1)], [], "outline has a vertex twice"),
        (square, [[(1, 1), (5, 1), (1, 2)]], r"outline: .* meets that of holes\[0\]"),
        (square, [[(5, 5), (6, 5), (5, 6)]], r"holes\[0\] is not inside the outline"),
        (square, [FRAME[1][0], [(1.5, 1.5), (2, 1.5), (1.5, 2)]], r"holes\[1\] is inside another hole"),
    ]:
        with pytest.raises(gs.GeometryError, match=text):
            gs.Region(outline, holes)


def test_a_fork_takes_a_pole_between_its_prongs() -> None:
    """What its hull would hit at once."""
    answer = gs.time_to_collision(gs.Region(FORK), (0.5, 0, 0), [(0.7, 0.0), (1.3, 0.25), (1.3, 0.5)])
    assert answer.status.tolist() == [1, 1, 0]
    assert np.allclose(answer.time[:2], [1.0, 1.0], atol=1e-12)
    assert gs.time_to_collision(gs.Polygons.from_list([FORK[:2] + FORK[-2:]])[0], (0.5, 0, 0), [(0.7, 0)]).status == 3


def test_seams_are_inside() -> None:
    grid = np.array(
        [(x, y) for x in np.arange(-0.5, 5) / 2 for y in np.arange(-0.5, 5) / 2] + [(1, 0.5), (0.5, 1), (1, 1)]
    )
    region = gs.Region(ANGLE)
    answer = gs.time_to_collision(region, (0, 0, 1), grid, t_max=0.0)
    for point, status in zip(grid, answer.status, strict=True):
        expected = gs.TOUCHING if region.on_border(point) else gs.OVERLAPPING if winding([ANGLE], point) else gs.NEVER
        assert status == expected, point


def test_first_of_all_pieces(rng: np.random.Generator) -> None:
    for obstacles in (rng.uniform(-4, 4, (200, 2)), gs.Polygons.from_list([[p] for p in rng.uniform(-4, 4, (50, 2))])):
        region = gs.Region(star(rng, 9))
        twist = (0.8, 0.1, 0.4)
        whole = gs.time_to_collision(region, twist, obstacles)
        parts = [gs.time_to_collision(piece, twist, obstacles) for piece in region.pieces]
        first = np.fmin.reduce([part.time_lower for part in parts])
        assert np.array_equal(whole.time, first, equal_nan=True)
        assert (whole.status == gs.WILL_TOUCH).any() and (whole.status == gs.NEVER).any()


@pytest.mark.parametrize("rate", [0.0, 0.7])
def test_first_contact_of_regions(rng: np.random.Generator, rate: float) -> None:
    """A bolt that goes into a fork meets its back; what flies by, nothing."""
    fork = gs.Region(FORK)
    bolts = gs.Polygons.from_list([[(2, -0.1), (3, -0.1), (3, 0.1), (2, 0.1)], [(2, 1), (3, 1), (3, 2), (2, 2)]])
    answer = gs.first_contact(fork, bolts, (0, 0), (-1, 0), contact_set=False)
    assert answer.status.tolist() == [1, 0] and answer.certain.all()
    assert answer.time_lower[0] <= 1.8 <= answer.time_upper[0] + 1e-15 and answer.normal[0].tolist() == [1, 0]
    seen = []
    for _ in range(30):
        one, two = gs.Region(star(rng, 7)), gs.Region(star(rng, 6, rng.uniform(-2, 2, 2)))
        motion: dict[str, Any] = {"t_max": 3.0, "contact_set": False, "tolerance": 1e-9}
        if rate:
            motion |= {"angular_velocity_a": rate, "center_a": (0, 0), "center_b": (0, 0)}
        velocity = rng.normal(size=2)
        whole = gs.first_contact(one, two, velocity, (0, 0), **motion)
        parts = [
            gs.first_contact(gs.Polygons.from_list([p]), gs.Polygons.from_list([q]), velocity, (0, 0), **motion)
            for p in one.pieces
            for q in two.pieces
        ]
        upper = np.fmin.reduce([part.time_upper[0] for part in parts])
        lower = np.fmin.reduce([part.time_lower[0] for part in parts])
        assert np.array_equal([whole.time_lower[0], whole.time_upper[0]], [lower, upper], equal_nan=True)
        back = gs.first_contact(two, one, (0, 0), velocity, **_swapped(motion))
        assert back.status == whole.status
        seen.append(int(whole.status[0]))
    assert {0, 1, 3} <= set(seen)


def _swapped(motion: dict[str, Any]) -> dict[str, Any]:
    other = {"a": "b", "b": "a"}
    return {name[:-1] + other[name[-1]] if name[-2] == "_" else name: value for name, value in motion.items()}


def test_regions_turn_about_one_point() -> None:
    """By default the middle of the outline, as that of polygons."""
    square = [(0, 0), (2, 0), (2, 2), (0, 2)]
    wall = gs.Polygons.from_list([[(2.3, -5), (3, -5), (3, 5), (2.3, 5)]])
    frame = gs.Region(square, [[(0.5, 0.5), (1.5, 0.5), (1.5, 1.5), (0.5, 1.5)]])
    motion: dict[str, Any] = {"angular_velocity_a": 1.0, "contact_set": False}
    one = gs.first_contact(gs.Polygons.from_list([square]), wall, (0, 0), (0, 0), **motion)
    two = gs.first_contact(frame, wall, (0, 0), (0, 0), **motion)
    assert two.status == gs.WILL_TOUCH and abs(two.time - one.time) < 2e-6


def test_what_regions_do_not_answer() -> None:
    region, square = gs.Region(ANGLE), gs.Polygons.from_list([FRAME[0]])
    with pytest.raises(gs.NotAvailableError, match="certificates of a Region"):
        gs.first_contact(square, region, (0, 0), (0, 0), contact_set=False, certificates=True)
    with pytest.raises(gs.GeometryError, match="b must be Region or Polygons, got Boxes"):
        gs.first_contact(region, gs.Boxes([[0, 0, 0]], [np.eye(3)], [[1, 1, 1]]), (0, 0), (0, 0))


@pytest.mark.parametrize("accuracy", ["float64", "exact"])
def test_distance_of_regions(rng: np.random.Generator, accuracy: str) -> None:
    """A hole is outside; so is what the prongs of a fork hold between them."""
    frame, fork = gs.Region(*FRAME), gs.Region(FORK)
    probes = gs.Polygons.from_list([[(2, 2)], [(2, 1)], [(2, 0.5)], [(1.5, 2), (2.25, 2)], [(6, 2)]])
    answer = gs.distance(frame, probes, accuracy=accuracy)
    assert answer.distance.tolist() == [1, 0, 0, 0.5, 2] and (answer.lower <= answer.upper).all()
    meet = gs.intersects(probes, frame, accuracy=accuracy)
    assert meet.value.tolist() == [False, True, True, False, False]
    assert meet.certain[[0, 2, 3, 4]].all() and (accuracy != "exact" or meet.certain.all())
    pole = gs.Polygons.from_list([[(0.7, 0.0)]])
    assert abs(gs.distance(fork, pole, accuracy=accuracy).distance[0] - 0.2) < 1e-15
    for _ in range(10):
        one, two = gs.Region(star(rng, 7)), gs.Region(star(rng, 6, rng.uniform(-2, 2, 2)))
        answer, meet = gs.distance(one, two, accuracy=accuracy), gs.intersects(one, two, accuracy=accuracy)
        assert meet.value[0] == (answer.distance[0] == 0.0)
        if not meet.value[0]:
            assert abs(np.hypot(*(answer.point_b - answer.point_a)[0]) - answer.distance[0]) < 1e-14


def test_depth_is_refused() -> None:
    region = gs.Region(ANGLE)
    with pytest.raises(gs.NotAvailableError, match="how deep a Region is penetrated"):
        gs.distance(region, region, want=("penetration",))
    with pytest.raises(gs.GeometryError, match="poses_ab must be left out"):
        gs.distance(region, region, (0, 0, 0, 0, 0, 0, 1))
    with pytest.raises(gs.NotAvailableError, match="certificates of a Region"):
        gs.intersects(region, region, certificates=True)
