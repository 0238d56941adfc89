# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""Convex rings and pairs of them for tests, exact where they can be."""

from __future__ import annotations

import math

import numpy as np
from oracle import polygon as exact

import geomsrv as gs

SQUARE = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)]


def polygons(*rings):
    return gs.Polygons.from_list([np.asarray(ring, float).reshape(-1, 2) for ring in rings])


def shifted(ring, dx, dy):
    return [(x + dx, y + dy) for x, y in ring]


def random_ring(rng, size, degenerate=0.15):
    """Integer ring as a hull, now and then a point or a segment."""
    count = int(rng.integers(1, 3)) if rng.random() < degenerate else int(rng.integers(3, 9))
    points = [tuple(int(c) for c in p) for p in rng.integers(-size, size + 1, (count, 2))]
    return [tuple(int(c) for c in p) for p in exact.hull(points)]


class Turn:
    """Rotation and shift in float64, both random."""

    def __init__(self, rng, shift):
        angle = rng.uniform(0.0, 2.0 * math.pi)
        self.cos, self.sin = math.cos(angle), math.sin(angle)
        self.shift = rng.uniform(-shift, shift, 2)

    def vector(self, v):
        return np.array([self.cos * v[0] - self.sin * v[1], self.sin * v[0] + self.cos * v[1]])

    def ring(self, ring):
        return np.array([self.vector(p) for p in ring]).reshape(-1, 2) + self.shift


def _slender(rng, main):
    """Points of a body 1e-2 to 1e2 long and down to 1e-13 of that thin, often along `main`."""
    points = rng.uniform(-1, 1, (int(rng.integers(1, 7)), 2))
    points *= 10.0 ** rng.integers(-2, 3) * np.array([1.0, 10.0 ** -rng.integers(0, 14)])
    if rng.random() < 0.3:
        points = np.round(points * 8) / 8
    angle = rng.uniform(0, 2 * math.pi)
    if rng.random() < 0.4:
        angle = main + rng.choice([0, math.pi, math.pi / 2]) + rng.choice([0, 1e-12, 1e-8]) * rng.normal()
    c, s = math.cos(angle), math.sin(angle)
    return points @ np.array([[c, s], [-s, c]])


def slender_pair(rng):
    """Two slender rings, float64: at any distance, nearly or exactly vertex on vertex, nearly parallel."""
    main = rng.uniform(0, 2 * math.pi)
    a, b = _slender(rng, main), _slender(rng, main)
    b = b + rng.uniform(-1, 1, 2) * 10.0 ** rng.integers(-3, 3)
    if rng.random() < 0.4:
        b = b + (a[rng.integers(len(a))] - b[rng.integers(len(b))])
        b = b + rng.normal(size=2) * 10.0 ** -rng.integers(3, 18) * rng.integers(0, 2)
    return hull(a), hull(b), np.array([math.cos(main), math.sin(main)])


def hull(points):
    """Hull of the listed doubles, as given to the engine."""
    return [tuple(map(float, p)) for p in exact.hull([tuple(map(float, p)) for p in points])]
