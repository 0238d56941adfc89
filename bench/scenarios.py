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


def turning_boxes(n: int = 20_000) -> tuple[gs.Boxes, gs.Boxes, dict[str, np.ndarray]]:
    """Boxes of 0.2 to 2 m a few metres apart, on their way towards each other at some m/s, turning by some rad/s."""
    rng = np.random.default_rng(SEED)

    def batch(center: np.ndarray) -> gs.Boxes:
        return gs.Boxes(center, random_rotations(rng, n), rng.uniform(0.1, 1.0, (n, 3)))

    center_b = rng.normal(size=(n, 3))
    center_b *= rng.uniform(2.0, 6.0, (n, 1)) / np.linalg.norm(center_b, axis=1, keepdims=True)
    motion = {
        "velocity_a": rng.normal(scale=0.2, size=(n, 3)),
        "velocity_b": -rng.uniform(0.5, 2.0, (n, 1)) * center_b + rng.normal(scale=0.5, size=(n, 3)),
        "angular_velocity_a": rng.normal(scale=2.0, size=(n, 3)),
        "angular_velocity_b": rng.normal(scale=2.0, size=(n, 3)),
    }
    return batch(np.zeros((n, 3))), batch(center_b), motion


Moving = tuple[gs.Boxes | gs.Polytopes, gs.Boxes | gs.Polytopes, np.ndarray, np.ndarray]


def moving_boxes(n: int = 100_000) -> Moving:
    """Pairs of boxes of about 1 m in any orientation, a few metres apart, mostly on collision course."""
    rng = np.random.default_rng(SEED)
    center_b, velocity_a, velocity_b = _courses(rng, n)
    batches = [
        gs.Boxes.from_poses(np.hstack([center, _unit(rng.normal(size=(n, 4)))]), rng.uniform(0.3, 0.9, (n, 3)))
        for center in (np.zeros((n, 3)), center_b)
    ]
    return *batches, velocity_a, velocity_b


def off_course(given: Moving) -> Moving:
    """The same boxes further apart, and each on the course of the next: most miss."""
    a, b, velocity_a, velocity_b = given
    return a, gs.Boxes(2.0 * np.roll(b.center, 1, axis=0), b.axes, b.half_extents), velocity_a, velocity_b


def moving_hulls(n: int = 100_000) -> Moving:
    """The same with convex hulls of 8 to 32 points on an ellipsoid."""
    rng = np.random.default_rng(SEED)
    center_b, velocity_a, velocity_b = _courses(rng, n)
    batches = []
    for center in (np.zeros((n, 3)), center_b):
        sizes = rng.integers(8, 33, n)
        item = np.repeat(np.arange(n), sizes)
        points = _unit(rng.normal(size=(len(item), 3))) * rng.uniform(0.4, 1.2, (n, 3))[item]
        batches.append(gs.Polytopes(points + center[item], np.concatenate([[0], np.cumsum(sizes)])))
    return *batches, velocity_a, velocity_b


def _courses(rng: np.random.Generator, n: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Where b starts, and both velocities."""
    center_b = rng.uniform(-5.0, 5.0, (n, 3))
    velocity_b = rng.uniform(0.5, 2.0, (n, 1)) * (_unit(-center_b) + rng.normal(scale=0.2, size=(n, 3)))
    return center_b, rng.normal(scale=0.1, size=(n, 3)), velocity_b


def _unit(rows: np.ndarray) -> np.ndarray:
    return rows / np.linalg.norm(rows, axis=1, keepdims=True)


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


def warehouse(n: int, degrees: float) -> tuple[gs.Boxes, gs.Boxes]:
    """n pairs of neighbours in a stack of boxes on a grid: every pair shares a face, exactly so before it is turned.

    Turning rounds: then a pair overlaps or is apart by an ulp or two, which float64 cannot tell.
    """
    rng = np.random.default_rng(SEED)
    cell = np.array([0.75, 0.5, 0.25])
    at = rng.integers(-40, 40, (n, 3))
    step = np.eye(3, dtype=int)[rng.integers(0, 3, n)]
    half = np.tile(cell / 2, (n, 1))
    return _turned(at * cell, half, degrees), _turned((at + step) * cell, half, degrees)


def view_of_a_warehouse(n: int, degrees: float) -> tuple[gs.Frustum, gs.Boxes]:
    """Boxes on a grid that touch a plane of the view pyramid, which looks down the aisle at 45 degrees to each side."""
    rng = np.random.default_rng(SEED)
    near, half = 1.0, 0.25
    depth = near + 2 * half * rng.integers(1, 60, n)
    across = 2 * half * rng.integers(-2, 3, n)
    # Left and right: the corner nearest to the axis lies on the side; near: the far face lies in the plane.
    center = np.column_stack([depth + 2 * half, across, depth])
    center[1::3, 0] *= -1.0
    center[2::3] = np.column_stack([0.5 * across, across, np.full(n, near - half)])[2::3]
    turn = _turn(degrees)
    return gs.Frustum([0, 0, 0], turn.T, near, near, near, 40.0), _turned(center, np.full((n, 3), half), degrees)


def drives(n: int = 1000, points: int = 24) -> list[tuple[np.ndarray, np.ndarray]]:
    """(twist, points seen): a robot at up to 1 m/s and 1.5 rad/s among a few thin posts, none of them at it yet."""
    rng = np.random.default_rng(SEED)
    out = []
    for _ in range(n):
        twist = np.array([rng.uniform(0.1, 1.0), 0.0, rng.uniform(-1.5, 1.5)])
        seen = rng.uniform(-2.5, 2.5, (points, 2))
        out.append((twist, seen[(np.abs(seen) > [0.35, 0.25]).any(axis=1)]))
    return out


def laser_scan(n: int = 20_000) -> np.ndarray:
    """Points all around, 0.5 m to 5 m away."""
    rng = np.random.default_rng(SEED)
    angle = rng.uniform(-np.pi, np.pi, n)
    return rng.uniform(0.5, 5.0, n)[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])


FOOTPRINT = np.array([(-0.3, -0.2), (0.3, -0.2), (0.3, 0.2), (-0.3, 0.2)])


def _turn(degrees: float) -> np.ndarray:
    """About z then x, so that no axis of the world stays one."""
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]) @ np.array([[1, 0, 0], [0, c, -s], [0, s, c]])


def _turned(center: np.ndarray, half: np.ndarray, degrees: float) -> gs.Boxes:
    turn = _turn(degrees)
    return gs.Boxes(center @ turn.T, np.tile(turn.T, (len(center), 1, 1)), half)
