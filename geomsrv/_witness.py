# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
r"""What an answer's witnesses prove about a distance, worked out in numpy without the engine.

Two points, one in each body, bound the distance from above by how far they are apart.  A direction bounds it
from below by the gap between the two supports along it::

        a  ____                     ____  b
          |    \ point_a   point_b /    | |     x- - - - - - - - -x     |      h_a(n) = max over a of n.x
          |____/|     gap(n)      |\____|      gap(n) = -h_b(-n) - h_a(n)  <=  distance  <=  |point_b -
          point_a|
                |-----> n ------->|

Neither bound depends on how the witnesses were found, which makes this a judge between two engines.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from geomsrv import _validate
from geomsrv.shapes import PackedShapes

__all__ = ["Bracket", "Placed", "bracket"]

FloatArray = NDArray[np.float64]


class Bracket(NamedTuple):
    """Bounds of a distance [m], before the rounding of the few operations that made them."""

    lower: float  #: -inf where no direction was given
    upper: float  #: inf where no points were given


class Placed(NamedTuple):
    """One shape as the engine reads it (see `geomsrv.shapes.pack`) and where it is."""

    kind: str
    params: FloatArray  #: (4,)
    vertices: FloatArray  #: (m, 3)
    rotation: FloatArray  #: (3, 3)
    translation: FloatArray  #: (3,)

    @classmethod
    def at(cls, kind: str, solid: PackedShapes, pose: FloatArray | None = None) -> Placed:
        """The shape at `pose` (7,), by default at the origin."""
        rotation, translation = np.eye(3), np.zeros(3)
        if pose is not None:
            rotation, translation = _validate.rotation_matrices(pose[None, 3:])[0], pose[:3]
        return cls(kind, solid.params[0], solid.vertices, rotation, translation)

    def excess(self, point: FloatArray) -> float:
        """How far `point` is from the shape [m], or slightly more; 0 inside."""
        local = self.rotation.T @ (point - self.translation)
        params: list[float] = self.params.tolist()
        if self.kind == "sphere":
            return max(0.0, float(np.linalg.norm(local)) - params[0])
        if self.kind == "capsule":
            radius, half = params[:2]
            local = local - [0.0, 0.0, np.clip(local[2], -half, half)]
            return max(0.0, float(np.linalg.norm(local)) - radius)
        if self.kind == "box":
            return float(np.linalg.norm(np.maximum(np.abs(local) - self.params[:3], 0.0)))
        if self.kind == "half_space":
            return max(0.0, float(self.params[:3] @ local) - params[3])
        if self.kind in ("cylinder", "cone"):
            across, along = float(np.hypot(local[0], local[1])), float(local[2])
            radius, half = params[:2]
            if self.kind == "cylinder":
                return float(np.hypot(max(across - radius, 0.0), max(abs(along) - half, 0.0)))
            return _beyond_profile(across, along, radius, half)
        if self.kind == "ellipsoid":
            # Scaled down to the surface, which is no nearer than the nearest point.
            stretch = float(np.linalg.norm(local / self.params[:3]))
            return float(np.linalg.norm(local)) * (1.0 - 1.0 / stretch) if stretch > 1.0 else 0.0
        return float(np.linalg.norm(hull_weights(self.vertices, local) @ self.vertices - local))

    def support(self, direction: FloatArray) -> float:
        """Largest ``direction . x`` over the shape; inf if it is unbounded."""
        local = self.rotation.T @ direction
        length = float(np.linalg.norm(local))
        params: list[float] = self.params.tolist()
        if self.kind == "sphere":
            reach = params[0] * length
        elif self.kind == "capsule":
            reach = params[0] * length + params[1] * abs(float(local[2]))
        elif self.kind == "box":
            reach = float(self.params[:3] @ np.abs(local))
        elif self.kind in ("cylinder", "cone"):
            rim, along = params[0] * float(np.hypot(local[0], local[1])), params[1] * float(local[2])
            reach = rim + abs(along) if self.kind == "cylinder" else max(rim - along, along)
        elif self.kind == "ellipsoid":
            reach = float(np.linalg.norm(self.params[:3] * local))
        elif self.kind == "half_space":
            # Bounded along its own normal only; `bracket` uses exactly that one.
            reach = params[3] if np.array_equal(direction, self.outward) else np.inf
        else:
            reach = float((self.vertices @ local).max())
        return float(direction @ self.translation) + reach

    @property
    def outward(self) -> FloatArray:
        """Normal of a half space where it is."""
        return self.rotation @ self.params[:3]


def _beyond_profile(across: float, along: float, radius: float, half: float) -> float:
    """Distance of a point from a cone, `across` from its axis and `along` it from the middle of its height."""
    side = np.array([-radius, 2.0 * half])  # from the rim up to the tip
    rim = np.array([radius, -half])
    point = np.array([across, along])
    if along >= -half and float(side[1] * (point - rim)[0] - side[0] * (point - rim)[1]) <= 0.0:
        return 0.0
    square = float(side @ side)
    share = min(max(float((point - rim) @ side) / square, 0.0), 1.0) if square > 0.0 else 0.0
    base = np.array([min(across, radius), -half])
    return float(min(np.linalg.norm(point - rim - share * side), np.linalg.norm(point - base)))


def bracket(a: Placed, b: Placed, point_a: FloatArray, point_b: FloatArray, normal: FloatArray) -> Bracket:
    """What two points and a direction from a to b prove about the distance of a and b.

    Parameters
    ----------
    a, b : Placed
    point_a, point_b, normal : (3,) float64
        In the common frame; NaN where there is none.
    """
    lower, upper = -np.inf, np.inf
    if a.kind == "half_space":
        normal = a.outward
    elif b.kind == "half_space":
        normal = -b.outward
    length = np.linalg.norm(normal)
    if length > 0.0:
        direction = normal if "half_space" in (a.kind, b.kind) else normal / length
        lower = -b.support(-direction) - a.support(direction)
    if np.isfinite(point_a).all() and np.isfinite(point_b).all():
        apart = float(np.linalg.norm(point_b - point_a)) + a.excess(point_a) + b.excess(point_b)
        # Deep in an overlap the two points are far apart, but each is in both bodies.
        common = min(a.excess(point) + b.excess(point) for point in (point_a, point_b))
        upper = min(apart, common)
    return Bracket(float(lower), upper)


def hull_weights(vertices: FloatArray, point: FloatArray) -> FloatArray:
    """Convex weights of `vertices` whose combination is nearest to `point`.

    Non-negative least squares by active sets (Lawson and Hanson, *Solving Least Squares Problems*, 1974,
    chapter 23), with a row that asks the weights to sum to one.  Wherever it stops, the weights are convex,
    so that what they combine to is a point of the hull: a poor solution can only make the caller's bound
    wider.
    """
    center = vertices.mean(axis=0)
    scale = float(np.abs(vertices - center).max()) or 1.0
    system = np.vstack([(vertices - center).T / scale, np.ones(len(vertices))])
    target = np.append((point - center) / scale, 1.0)
    weights = np.zeros(len(vertices))
    active = np.zeros(len(vertices), dtype=bool)
    # Four rows: at most four weights are needed.  Each round adds one vertex and rarely one leaves again.
    for _ in range(4 * len(target) + len(vertices)):
        gradient = system.T @ (target - system @ weights)
        gradient[active] = -np.inf
        entering = int(np.argmax(gradient))
        # The gradient is a sum of four products of numbers of order one; below their rounding it has no sign.
        if gradient[entering] <= 8.0 * np.finfo(float).eps:
            break
        active[entering] = True
        while True:
            trial = np.zeros_like(weights)
            trial[active] = np.linalg.lstsq(system[:, active], target, rcond=None)[0]
            leaving = active & (trial <= 0.0)
            if not leaving.any():
                break
            step = np.min(weights[leaving] / (weights[leaving] - trial[leaving]))
            weights += step * (trial - weights)
            active &= weights > 0.0
            weights[~active] = 0.0
        weights = trial
    return weights / weights.sum()
