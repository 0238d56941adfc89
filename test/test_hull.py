# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""Facets for drawing: closed, outward, and around all points."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest
from conftest import reproducer

from geomsrv.hull import hull_triangles

CUBE = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], dtype=float)


def check(points) -> np.ndarray:
    """Every edge is run through as often one way as the other, and no point lies outside of any triangle."""
    triangles = hull_triangles(points)
    edges = Counter((int(a), int(b)) for t in triangles for a, b in zip(t, np.roll(t, -1), strict=True))
    assert all(count == edges[b, a] for (a, b), count in edges.items()), reproducer(points=points)
    corners = points[triangles]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    size = np.abs(points - points.mean(axis=0)).max()
    lengths = np.linalg.norm(normals, axis=1)
    heights = np.einsum("kd,knd->kn", normals, points[None] - corners[:, :1])
    assert (heights <= 1e-6 * size * lengths[:, None] + 1e-12 * size**3).all(), reproducer(points=points)
    return triangles


@pytest.mark.parametrize("count", [4, 5, 8, 30, 200])
@pytest.mark.parametrize("offset", [0.0, 1e4])
def test_random_points(rng, count, offset) -> None:
    for _ in range(5):
        points = rng.normal(size=(count, 3)) * rng.uniform(0.01, 10, 3) + offset
        triangles = check(points)
        corners = len(np.unique(triangles))
        assert len(triangles) == 2 * corners - 4, "Euler"


def test_a_cube_with_points_on_its_faces() -> None:
    grid = np.array([[x, y, z] for x in range(4) for y in range(4) for z in range(4)], dtype=float)
    for points in (CUBE, grid, np.concatenate([CUBE, CUBE])):
        triangles = check(points)
        corners = points[triangles]
        volume = np.einsum("ij,ij->i", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])).sum() / 6
        assert volume == pytest.approx(np.ptp(points[:, 0]) ** 3)
        assert len(triangles) == 12, "points on faces and edges are no corners"


@pytest.mark.parametrize("axis", range(3))
def test_flat_sets_have_two_sides(axis) -> None:
    points = np.insert(np.array([[0.0, 0], [1, 0], [1, 1], [0, 1], [0.5, 0.5]]), axis, 2.0, axis=1)
    triangles = check(points)
    assert len(triangles) == 4 and 4 not in triangles


@pytest.mark.parametrize(
    "points", [[], [[1, 2, 3]], [[1, 2, 3]] * 4, [[0, 0, 0], [1, 1, 1]], [[0, 0, 0], [1, 1, 1], [2, 2, 2]]]
)
def test_points_and_segments_have_no_facets(points) -> None:
    assert hull_triangles(points).shape == (0, 3)
