# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""Which rings are convex polygons, and how the others are refused."""

from __future__ import annotations

import math
import time
from fractions import Fraction

import numpy as np
import pytest

import geomsrv as gs
from geomsrv import _core

SQUARE = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)]


def fault(*rings):
    """Report of the engine for a batch of rings."""
    offsets = np.cumsum([0, *(len(ring) for ring in rings)])
    return _core.check_rings(np.concatenate([np.asarray(r, float).reshape(-1, 2) for r in rings]), offsets)


VALID = {
    "square": SQUARE,
    "starts anywhere": SQUARE[2:] + SQUARE[:2],
    "point": [(3.0, 4.0)],
    "point, repeated": [(3.0, 4.0)] * 5,
    "segment": [(0.0, 0.0), (2.0, 1.0)],
    "segment, repeated ends": [(0.0, 0.0), (0.0, 0.0), (2.0, 1.0), (2.0, 1.0), (2.0, 1.0)],
    "segment with inner vertices": [(0.0, 0.0), (1.0, 1.0), (3.0, 3.0), (2.0, 2.0)],
    "segment that is not exactly straight": [(0.0, 0.0), (0.1, 0.3), (0.2, 0.6), (0.3, 0.9)],
    "vertical segment": [(0.0, 0.0), (0.0, 1.0), (0.0, 5.0), (0.0, 2.0)],
    "repeated vertices": [p for p in SQUARE for _ in range(3)],
    "repeated first vertex at the end": [*SQUARE, SQUARE[0]],
    "collinear vertices": [(0, 0), (0.5, 0), (0.75, 0), (1, 0), (1, 0.5), (1, 1), (0.5, 1), (0, 1), (0, 0.5)],
    "subnormal": (np.array(SQUARE) * 5e-324).tolist(),
    "tiny": (np.array(SQUARE) * 1e-300).tolist(),
    "huge": (np.array(SQUARE) * 1e300).tolist(),
    "spans the range of doubles": ((np.array(SQUARE) * 2 - 1) * 1.7e308).tolist(),
    "needle": [(0.0, 0.0), (1e6, 0.0), (1e6, 1e-6)],
    "thinnest triangle": [(0.0, 0.0), (1.0, 0.0), (1.0, 5e-324)],
    "one ulp dent": [(0.0, 0.0), (0.5, 2.0**-53), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)],
    "one ulp spike backwards": [(0, 0), (1, 0), (1 - 2**-53, 0), (1, 0.5), (1, 1), (0, 1)],
}

INVALID = {
    "clockwise": (SQUARE[::-1], -1, "clockwise"),
    "clockwise with repeats": ([p for p in SQUARE[::-1] for _ in range(2)], -1, "clockwise"),
    "clockwise needle": ([(0.0, 0.0), (1e6, 1e-6), (1e6, 0.0)], -1, "clockwise"),
    "clockwise, tiny": ((np.array(SQUARE[::-1]) * 1e-300).tolist(), -1, "clockwise"),
    "clockwise, subnormal": ((np.array(SQUARE[::-1]) * 5e-324).tolist(), -1, "clockwise"),
    "clockwise, huge": ((np.array(SQUARE[::-1]) * 1e308).tolist(), -1, "clockwise"),
    "dent": ([(0, 0), (0.5, 0.01), (1, 0), (1, 1), (0, 1)], 1, "not convex"),
    "small dent": ([(0, 0), (0.5, 1e-12), (1, 0), (1, 1), (0, 1)], 1, "not convex"),
    "L": ([(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)], 3, "not convex"),
    "bow tie": ([(0, 0), (1, 1), (1, 0), (0, 1)], 2, "not convex"),
    "fold back along an edge": ([(0, 0), (2, 0), (1, 0), (3, 0), (3, 1), (0, 1)], 2, "not convex"),
    "spike": ([(0, 0), (1, 0), (1, 1), (1, 2), (1, 1), (0, 1)], 4, "not convex"),
    "square, twice": (SQUARE * 2, -1, "wound more than once"),
    "pentagram": (
        [(math.cos(4 * math.pi * k / 5), math.sin(4 * math.pi * k / 5)) for k in range(5)],
        -1,
        "wound more than once",
    ),
}


@pytest.mark.parametrize("ring", VALID.values(), ids=VALID)
def test_valid_rings(ring):
    assert fault(ring) == (-1, -1, "")


@pytest.mark.parametrize(("ring", "vertex", "text"), INVALID.values(), ids=INVALID)
def test_faults_are_named(ring, vertex, text):
    assert fault(SQUARE, ring, SQUARE) == (1, vertex, text)


def test_errors_name_ring_and_vertex():
    with pytest.raises(gs.GeometryError, match=r"vertices: ring 1 is not convex, at its vertex 1$"):
        gs.Polygons.from_list([SQUARE, INVALID["dent"][0]])
    with pytest.raises(gs.GeometryError, match="vertices: ring 0 is clockwise$"):
        gs.Polygon(SQUARE[::-1])


def exact_turns(ring):
    """Signs of the turns of a ring without zero edges, in exact arithmetic."""
    points = [(Fraction(x), Fraction(y)) for x, y in ring]
    edges = [(b[0] - a[0], b[1] - a[1]) for a, b in zip(points, points[1:] + points[:1], strict=True)]
    crosses = [a[0] * b[1] - a[1] * b[0] for a, b in zip(edges[-1:] + edges[:-1], edges, strict=True)]
    return [(c > 0) - (c < 0) for c in crosses]


def convex_ring(rng, count, size=1000):
    """Integer convex ring: distinct edge vectors sorted by direction."""
    edges = {tuple(int(x) for x in rng.integers(-size, size, 2)) for _ in range(count - 1)} - {(0, 0)}
    edges.add(tuple(-sum(axis) for axis in zip(*edges, strict=True)))
    ordered = sorted(edges, key=lambda e: math.atan2(e[1], e[0]))
    return np.cumsum(ordered, axis=0).astype(float)


def moved(rng, ring, shift):
    """Rotated and shifted in float64."""
    angle = rng.uniform(0, 2 * math.pi)
    c, s = math.cos(angle), math.sin(angle)
    x, y = ring.T
    return np.stack([c * x - s * y, s * x + c * y], axis=1) + rng.uniform(-shift, shift, 2)


def test_rotated_convex_rings_pass():
    rng = np.random.default_rng(1)
    dented = flat = 0
    for _ in range(1500):
        ring = convex_ring(rng, int(rng.integers(3, 12)))
        points = []
        for a, b in zip(ring, np.roll(ring, -1, axis=0), strict=True):
            points += [a] * int(rng.integers(1, 3)) + [
                a + (b - a) * t for t in sorted(rng.choice([0.25, 0.5, 0.75], 2))
            ]
        if rng.random() < 0.2:  # a segment, there and back, or more than once
            order = [[0, 0.25, 0.5, 1, 0.75, 0.25], [0, 1, 0.25, 0.75, 0.5], [0.5, 0, 1, 0, 1]]
            points = [ring[0] + t * (ring[1] - ring[0]) for t in order[int(rng.integers(3))]]
            flat += 1
        copy = moved(rng, np.array(points), rng.choice([0.0, 1e3, 1e9]))
        distinct = [p for i, p in enumerate(copy.tolist()) if p != copy[i - 1].tolist()]
        dented += min(exact_turns(distinct)) < 0
        assert fault(copy) == (-1, -1, ""), [[x.hex() for x in p] for p in copy.tolist()]
    assert dented > 1000 and flat > 200


def test_dents_above_the_tolerance_are_found():
    rng = np.random.default_rng(2)
    for _ in range(500):
        ring = moved(rng, convex_ring(rng, int(rng.integers(3, 12))), 1e3)
        k = int(rng.integers(len(ring)))
        a, b = ring[k], ring[(k + 1) % len(ring)]
        inward = np.array([-(b - a)[1], (b - a)[0]]) / np.hypot(*(b - a))
        depth = 2.0**-45 * np.abs(ring).max()
        dent = np.insert(ring, k + 1, (a + b) / 2 + depth * inward, axis=0)
        if min(np.hypot(*(b - a)) for a, b in zip(ring, np.roll(ring, -1, axis=0), strict=True)) > 4 * depth:
            assert fault(dent) == (0, k + 1, "not convex"), [[x.hex() for x in p] for p in dent.tolist()]


def test_a_million_rings_are_quick():
    count = 1_000_000
    angles = np.linspace(0, 2 * math.pi, 8, endpoint=False)
    rings = np.tile(np.stack([np.cos(angles), np.sin(angles)], axis=1), (count, 1))
    offsets = np.arange(count + 1) * 8
    start = time.perf_counter()
    assert _core.check_rings(rings, offsets) == (-1, -1, "")
    assert time.perf_counter() - start < 5.0
