# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""Inputs of the benchmarks, seeded, with their sizes; each says what it is like.  No timing here."""

from __future__ import annotations

import numpy as np

import geomsrv as gs

SEED = 20260


def random_rotations(rng: np.random.Generator, n: int) -> np.ndarray:
    """(n, 3, 3) uniformly distributed rotations."""
    q = rng.normal(size=(n, 4))
    poses = np.zeros((n, 7))
    poses[:, 3:] = q / np.linalg.norm(q, axis=1, keepdims=True)
    return gs.Boxes.from_poses(poses, np.ones(3)).axes


def camera() -> gs.Frustum:
    """60 by 46 degrees, 0.1 m to 20 m, looking along no axis of the world."""
    return gs.Frustum.look_at([0.3, -0.2, 1.1], [3.0, 1.0, 0.7], [0.0, 0.0, 1.0], 0.8, 4 / 3, 0.1, 20.0)


def boxes_half_visible(n: int = 100_000) -> tuple[gs.Frustum, gs.Boxes]:
    """Boxes of 5 to 50 cm, half of them placed inside the view pyramid, half of them around it."""
    rng = np.random.default_rng(SEED)
    frustum = camera()
    l0, l1, u0, u1 = frustum.bounds
    depth = rng.uniform(frustum.near, frustum.far, n)
    spread = np.where(np.arange(n) % 2 == 0, 1.0, 3.0)
    lateral = np.column_stack([rng.uniform(l0, l1, n), rng.uniform(u0, u1, n)]) * spread[:, None] / frustum.near
    outside = (spread > 1.0) & (np.abs(lateral) < [l1 / frustum.near, u1 / frustum.near]).all(axis=1)
    depth[outside] += frustum.far
    local = np.column_stack([lateral * depth[:, None], depth])
    return frustum, gs.Boxes(
        frustum.origin + local @ frustum.axes, random_rotations(rng, n), rng.uniform(0.025, 0.25, (n, 3))
    )


def points_around_frustum(n: int = 1_000_000) -> tuple[gs.Frustum, np.ndarray]:
    """Points in a cube of 60 m about the frustum: all 27 Voronoi regions occur."""
    return camera(), np.random.default_rng(SEED).uniform(-30.0, 30.0, (n, 3))


def moving_polygons(n: int = 100_000) -> tuple[gs.Polygons, gs.Polygons, np.ndarray, np.ndarray]:
    """Pairs of 4- to 16-gons of about 1 m, a few metres apart, mostly on collision course."""
    rng = np.random.default_rng(SEED)

    def batch(center: np.ndarray) -> gs.Polygons:
        sizes = rng.integers(4, 17, n)
        offsets = np.concatenate([[0], np.cumsum(sizes)])
        item = np.repeat(np.arange(n), sizes)
        k = np.arange(offsets[-1]) - offsets[item]
        # Points of an ellipse at increasing angles are in convex position.
        angle = 2.0 * np.pi * (k + rng.uniform(-0.3, 0.3, len(k))) / sizes[item]
        radii = rng.uniform(0.4, 1.2, (n, 2))[item]
        turn = rng.uniform(0.0, 2.0 * np.pi, n)[item]
        x, y = radii[:, 0] * np.cos(angle), radii[:, 1] * np.sin(angle)
        ring = np.column_stack([np.cos(turn) * x - np.sin(turn) * y, np.sin(turn) * x + np.cos(turn) * y])
        return gs.Polygons(ring + center[item], offsets)

    center_b = rng.uniform(-5.0, 5.0, (n, 2))
    toward = -center_b / np.linalg.norm(center_b, axis=1, keepdims=True)
    velocity_b = rng.uniform(0.5, 2.0, (n, 1)) * (toward + rng.normal(scale=0.25, size=(n, 2)))
    return batch(np.zeros((n, 2))), batch(center_b), rng.normal(scale=0.1, size=(n, 2)), velocity_b


def relative_poses(n: int, low: float, high: float) -> np.ndarray:
    """(n, 7) random orientations, translations of length `low` to `high`."""
    rng = np.random.default_rng(SEED)
    direction, q = rng.normal(size=(n, 3)), rng.normal(size=(n, 4))
    direction *= rng.uniform(low, high, (n, 1)) / np.linalg.norm(direction, axis=1, keepdims=True)
    return np.hstack([direction, q / np.linalg.norm(q, axis=1, keepdims=True)])


def hull(vertices: int) -> gs.Convex:
    """Points on an ellipsoid of about 10 cm, all of them hull vertices."""
    x = np.random.default_rng(SEED).normal(size=(vertices, 3))
    return gs.Convex(x / np.linalg.norm(x, axis=1, keepdims=True) * [0.1, 0.08, 0.12])


SHAPE_PAIRS = {
    "sphere-sphere": (gs.Sphere(0.1), gs.Sphere(0.08)),
    "capsule-capsule": (gs.Capsule(0.05, 0.2), gs.Capsule(0.04, 0.15)),
    "sphere-box": (gs.Sphere(0.1), gs.Box([0.1, 0.07, 0.12])),
    "box-box": (gs.Box([0.1, 0.07, 0.12]), gs.Box([0.08, 0.1, 0.05])),
    "hull16-hull16": (hull(16), hull(16)),
    "hull64-hull64": (hull(64), hull(64)),
}
