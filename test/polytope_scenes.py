# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""Polytopes that move, for tests: exact where they can be, and nearly degenerate where they cannot."""

from __future__ import annotations

import math

import numpy as np

import geomsrv as gs

CUBE = [(x, y, z) for x in (0.0, 1.0) for y in (0.0, 1.0) for z in (0.0, 1.0)]
OCTAHEDRON = [(1.0, 0.0, 0.0), (-1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, -1.0, 0.0), (0.0, 0.0, 1.0), (0.0, 0.0, -1.0)]


def polytopes(*bodies):
    return gs.Polytopes.from_list([np.asarray(body, float).reshape(-1, 3) for body in bodies])


def shifted(body, dx, dy, dz):
    return [(x + dx, y + dy, z + dz) for x, y, z in body]


def random_body(rng, size):
    """Integer points: solids, mostly, and now and then a polygon, a segment or a point; cubes and slabs too."""
    kind = rng.random()
    if kind < 0.3:
        low = rng.integers(-size, size, 3)
        high = low + rng.integers(0 if kind < 0.05 else 1, size + 1, 3)
        return [tuple(int(c) for c in p) for p in np.array(np.meshgrid(*zip(low, high, strict=True))).reshape(3, -1).T]
    count = int(rng.integers(1, 4)) if kind < 0.4 else int(rng.integers(4, 9))
    points = rng.integers(-size, size + 1, (count, 3))
    if kind > 0.9:
        points[:, int(rng.integers(3))] = int(rng.integers(-size, size + 1))
    return [tuple(int(c) for c in p) for p in points]


def random_pair(rng, size):
    """Integer bodies and velocities, mostly aimed at each other; some touch, graze or slide, now or later."""
    a, b = random_body(rng, size), random_body(rng, size)
    velocity_a, velocity_b = (tuple(int(c) for c in v) for v in rng.integers(-2, 3, (2, 3)))
    offset = rng.integers(-3 * size, 3 * size + 1, 3) // (1 if rng.random() < 0.9 else 3)
    if rng.random() < 0.7:
        velocity_a = tuple(int(c) for c in np.sign(offset) * rng.integers(0, 3, 3))
    if rng.random() < 0.25:
        # Reflected in a point of its own border, or put vertex on vertex, it touches there now or at time `later`.
        later = int(rng.integers(3))
        if rng.random() < 0.5:
            chosen = [a[int(i)] for i in rng.integers(len(a), size=2)]
            b = [tuple(s + t - c for s, t, c in zip(*chosen, p, strict=True)) for p in a]
            offset = np.zeros(3, int)
        else:
            offset = np.subtract(a[int(rng.integers(len(a)))], b[int(rng.integers(len(b)))])
        offset = offset + later * np.subtract(velocity_a, velocity_b)
    return a, velocity_a, shifted(b, *(int(c) for c in offset)), velocity_b


def rotation(rng):
    """A float64 rotation matrix."""
    q = rng.normal(size=4)
    x, y, z, w = q / np.linalg.norm(q)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )


class Turn:
    """Rotation and shift in float64, both random."""

    def __init__(self, rng, shift):
        self.matrix = rotation(rng)
        self.shift = rng.uniform(-shift, shift, 3)

    def vector(self, v):
        return np.asarray(v, float) @ self.matrix.T

    def body(self, points):
        return np.asarray(points, float).reshape(-1, 3) @ self.matrix.T + self.shift


def _slender(rng, frame):
    """Points of a body 1e-2 to 1e2 long, and down to 1e-13 of that thin in one direction or two."""
    points = rng.uniform(-1, 1, (int(rng.integers(1, 9)), 3))
    points *= 10.0 ** rng.integers(-2, 3) * 10.0 ** -(rng.integers(0, 14, 3) ** rng.integers(0, 2, 3))
    if rng.random() < 0.3:
        points = np.round(points * 8) / 8
    if rng.random() < 0.4:
        # Along the common frame, or nearly.
        turn = frame[rng.permutation(3)] + rng.choice([0, 1e-12, 1e-8]) * rng.normal(size=(3, 3))
    else:
        turn = rotation(rng)
    return points @ turn


def slender_pair(rng):
    """Two slender bodies, float64: at any distance, nearly or exactly vertex on vertex, nearly parallel; velocities."""
    frame = rotation(rng)
    a, b = _slender(rng, frame), _slender(rng, frame)
    b = b + rng.uniform(-1, 1, 3) * 10.0 ** rng.integers(-3, 3)
    velocity = frame[int(rng.integers(3))] * 10.0 ** rng.integers(-2, 3)
    if rng.random() < 0.5:
        velocity = velocity + rng.normal(size=3) * 10.0 ** -rng.integers(0, 17)
    if rng.random() < 0.6:
        b = b + (a[rng.integers(len(a))] - b[rng.integers(len(b))])
        b = b + rng.normal(size=3) * 10.0 ** -rng.integers(3, 18) * rng.integers(0, 2)
        b = b - velocity * rng.integers(0, 3)
    return a, rng.normal(size=3) * rng.integers(0, 2), b, velocity


def box_corners(boxes, i=0):
    """Literal corners of a box of a batch, as the oracle takes them."""
    from oracle.polytope import box_corners as corners

    return corners(boxes.center[i], boxes.axes[i], boxes.half_extents[i])


def spherical(rng, count):
    """A convex body with so many vertices."""
    points = rng.normal(size=(count, 3))
    points /= np.linalg.norm(points, axis=1, keepdims=True)
    return points * rng.uniform(0.5, 1.5, 3)


def angle_between(u, v):
    return math.atan2(float(np.linalg.norm(np.cross(u, v))), float(np.dot(u, v)))
