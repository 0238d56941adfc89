# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""Nearest point of a literal view frustum to a point, exactly, in space and in the plane.

Brute force: the point is projected on the plane of every face, the line of every edge, and every vertex; of
the projections that lie in the frustum the nearest wins.  No Voronoi region is named.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import combinations
from typing import Any

from oracle import frustum_box, polytope
from oracle.vectors import Vector, add, dot, exact, scale, squared_norm, sub


@dataclass(frozen=True)
class Nearest:
    """Nearest point of the frustum and the faces it lies on."""

    squared_distance: Fraction  #: 0 in the closed frustum
    point: Vector
    faces: frozenset[str]  #: left-, left+, up-, up+, near, far; + is the +L, +U side; empty strictly inside


def nearest(origin: Any, axes: Any, bounds: Any, near: Any, far: Any, point: Any) -> Nearest:
    """Nearest point in space; `bounds` is l0 l1 u0 u1."""
    frustum = (origin, axes, bounds, near, far)
    planes = frustum_box.frustum_planes(*frustum)
    corners = polytope.frustum_corners(*frustum)
    sides = [[c for c in corners if dot(n, c) == d] for n, d in planes]
    edges = [pair for a, b in combinations(sides, 2) if len(pair := [c for c in a if c in b]) == 2]
    return _nearest(exact(point), planes, frustum_box.FACES, corners, edges)


def nearest_2d(origin: Any, axes: Any, bounds: Any, near: Any, far: Any, point: Any) -> Nearest:
    """Nearest point in the plane: axes L, D; `bounds` is l0 l1."""
    origin, (left, view), (l0, l1), near, far = (
        exact(origin),
        exact(axes),
        exact(bounds),
        exact(near),
        exact(far),
    )
    # The trapezoid is the z = 0 cut of a frustum with U = z, whose other four planes are upright.
    origin, axes = (*origin, 0), ((*left, 0), (0, 0, 1), (*view, 0))
    upright = [0, 1, 4, 5]
    every = frustum_box.frustum_planes(origin, axes, (l0, l1, -1, 1), near, far)
    planes = [(every[k][0][:2], every[k][1]) for k in upright]
    arms = [add(scale(x, left), scale(near, view)) for x in (l0, l1)]
    corners = [add(origin[:2], scale(t, arm)) for t in (Fraction(1), far / near) for arm in arms]
    return _nearest(exact(point), planes, [frustum_box.FACES[k] for k in upright], corners, [])


def _nearest(
    x: Vector,
    planes: Sequence[tuple[Vector, Any]],
    names: Sequence[str],
    corners: Sequence[Vector],
    edges: Sequence[Sequence[Vector]],
) -> Nearest:
    candidates = [x, *corners]
    for n, d in planes:
        candidates.append(add(x, scale(Fraction(d - dot(n, x)) / squared_norm(n), n)))
    for a, b in edges:
        arm = sub(b, a)
        candidates.append(add(a, scale(Fraction(dot(sub(x, a), arm)) / squared_norm(arm), arm)))
    inside = [p for p in candidates if all(dot(n, p) <= d for n, d in planes)]
    best = min(inside, key=lambda p: squared_norm(sub(p, x)))
    faces = frozenset(name for name, (n, d) in zip(names, planes, strict=True) if dot(n, best) == d)
    return Nearest(Fraction(squared_norm(sub(best, x))), best, faces)
