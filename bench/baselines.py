# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""The same questions answered in numpy, as a careful user would write them, and by python-fcl, one call an item.

They are yardsticks for time; where they are less accurate than geomsrv the benchmark says so.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

import geomsrv as gs

# ------------------------------------------------------------------------------------------------------------- numpy


def numpy_cull(frustum: gs.Frustum, boxes: gs.Boxes) -> np.ndarray:
    """Visible or not: six planes for all, then all 26 separating axes for those still undecided."""
    axes = frustum.axes
    delta = (boxes.center - frustum.origin) @ axes.T
    edges = (boxes.axes @ axes.T) * boxes.half_extents[:, :, None]
    l0, l1, u0, u1 = frustum.bounds
    near, far = frustum.near, frustum.far
    planes = np.array([[0, 0, -1], [0, 0, 1], [near, 0, -l1], [-near, 0, l0], [0, near, -u1], [0, -near, u0]], float)
    limit = np.array([-near, far, 0, 0, 0, 0])
    visible = (delta @ planes.T - np.abs(edges @ planes.T).sum(axis=1) <= limit).all(axis=1)
    todo = np.flatnonzero(visible)
    corners = np.array([[x, y, near] for x in (l0, l1) for y in (u0, u1)])
    corners = np.vstack([corners, corners * (far / near)])
    sides = np.array([[1, 0, 0], [0, 1, 0], [l0, u0, near], [l0, u1, near], [l1, u0, near], [l1, u1, near]], float)
    e, d = edges[todo], delta[todo]
    normals = np.cross(e[:, [1, 2, 0]], e[:, [2, 0, 1]])
    m = np.concatenate([normals, np.cross(sides[None, :, None], e[:, None]).reshape(len(todo), 18, 3)], axis=1)
    center = np.einsum("nak,nk->na", m, d)
    radius = np.abs(np.einsum("nak,nik->nai", m, e)).sum(axis=2)
    view = m @ corners.T
    apart = (center + radius < view.min(axis=2)) | (center - radius > view.max(axis=2))
    visible[todo[apart.any(axis=1)]] = False
    return visible


def numpy_distance_to_frustum(frustum: gs.Frustum, points: np.ndarray) -> np.ndarray:
    """Closed form for a centred window: the depth of the nearest point minimises a convex function."""
    x, y, z = np.abs((points - frustum.origin) @ frustum.axes.T).T
    z = (points - frustum.origin) @ frustum.axes[2]
    kr, ku = frustum.bounds[1] / frustum.near, frustum.bounds[3] / frustum.near
    t = np.maximum(z, (z + kr * x) / (1 + kr * kr))
    t = np.maximum(t, np.maximum((z + ku * y) / (1 + ku * ku), (z + kr * x + ku * y) / (1 + kr * kr + ku * ku)))
    t = np.clip(t, frustum.near, frustum.far)
    return np.sqrt(np.maximum(x - kr * t, 0) ** 2 + np.maximum(y - ku * t, 0) ** 2 + (z - t) ** 2)


def _padded(polygons: gs.Polygons, width: int) -> np.ndarray:
    """(n, width, 2): rings filled up with their last vertex."""
    sizes = np.diff(polygons.offsets)
    return polygons.vertices[polygons.offsets[:-1, None] + np.minimum(np.arange(width), sizes[:, None] - 1)]


def numpy_first_contact(
    a: gs.Polygons, b: gs.Polygons, velocity_a: np.ndarray, velocity_b: np.ndarray, block: int = 4000
) -> np.ndarray:
    """First contact times (inf: never) by projecting on every edge normal of both; no contact sets, no bounds."""
    va, vb = _padded(a, 16), _padded(b, 16)
    relative = velocity_b - velocity_a
    times = np.empty(len(a))
    for begin in range(0, len(a), block):
        p, q, w = va[begin : begin + block], vb[begin : begin + block], relative[begin : begin + block]
        e = np.concatenate([np.roll(p, -1, axis=1) - p, np.roll(q, -1, axis=1) - q], axis=1)
        normal = np.stack([e[..., 1], -e[..., 0]], axis=-1)
        pa, pb = normal @ np.swapaxes(p, 1, 2), normal @ np.swapaxes(q, 1, 2)
        speed = np.einsum("nak,nk->na", normal, w)
        low, high = pa.min(axis=2) - pb.max(axis=2), pa.max(axis=2) - pb.min(axis=2)
        with np.errstate(divide="ignore", invalid="ignore"):
            t0, t1 = low / speed, high / speed
        enter, leave = np.fmin(t0, t1), np.fmax(t0, t1)
        still = speed == 0.0
        apart = still & ((low > 0.0) | (high < 0.0)) & normal.any(axis=2)
        first = np.where(still, 0.0, np.maximum(enter, 0.0)).max(axis=1)
        last = np.where(still, np.inf, leave).min(axis=1)
        times[begin : begin + block] = np.where((first <= last) & ~apart.any(axis=1), first, np.inf)
    return times


def numpy_sphere_sphere(poses: np.ndarray, radius_a: float, radius_b: float) -> np.ndarray:
    """Distance of two spheres."""
    return np.maximum(np.linalg.norm(poses[:, :3], axis=1) - radius_a - radius_b, 0.0)


def stepped_time_to_collision(
    footprint: np.ndarray, twist: np.ndarray, points: np.ndarray, t_max: float, step: float
) -> float:
    """When a robot first hits a point of a scan, by simulation, as nav2's collision monitor does it in its "approach"
    model; inf if it does not see it.

    Explicit Euler with a fixed step: the pose moves along the velocity, which then turns with it; at every step all
    points are looked up in the footprint.  The answer is the last time before the first hit that it sees.
    """
    x = y = heading = 0.0
    vx, vy, rate = (float(v) for v in twist)
    edges = np.roll(footprint, -1, axis=0) - footprint
    for k in range(int(t_max / step) + 2):  # one step beyond the end
        cosine, sine = np.cos(heading), np.sin(heading)
        dx, dy = points[:, 0] - x, points[:, 1] - y
        local_x, local_y = cosine * dx + sine * dy, cosine * dy - sine * dx
        inside = np.ones(len(points), bool)
        for (px, py), (ex, ey) in zip(footprint, edges, strict=True):
            inside &= ex * (local_y - py) - ey * (local_x - px) >= 0.0
        if inside.any():
            return max(k - 1, 0) * step
        x, y = x + (cosine * vx - sine * vy) * step, y + (sine * vx + cosine * vy) * step
        heading += rate * step
    return np.inf


# -------------------------------------------------------------------------------------------------------- python-fcl


def fcl_geometry(shape: gs.Shape | gs.Frustum) -> object:
    """FCL's counterpart of a shape."""
    import fcl
    from scipy.spatial import ConvexHull

    if isinstance(shape, gs.Sphere):
        return fcl.Sphere(shape.radius)
    if isinstance(shape, gs.Capsule):
        return fcl.Capsule(shape.radius, shape.length)
    if isinstance(shape, gs.Box):
        return fcl.Box(*(2.0 * shape.half_extents))
    vertices = shape.corners() if isinstance(shape, gs.Frustum) else shape.vertices
    triangles = ConvexHull(vertices)
    faces = [
        (
            3,
            *(
                f
                if np.dot(np.cross(vertices[f[1]] - vertices[f[0]], vertices[f[2]] - vertices[f[0]]), n) > 0
                else f[::-1]
            ),
        )
        for f, n in zip(triangles.simplices, triangles.equations[:, :3], strict=True)
    ]
    return fcl.Convex(vertices, len(faces), np.array(faces).ravel())


def fcl_pairs(a: gs.Shape | gs.Frustum, b: gs.Shape, poses: np.ndarray, query: str) -> Callable[[], None]:
    """A loop over `poses` that calls fcl.distance or fcl.collide; objects are made beforehand."""
    import fcl

    first = fcl.CollisionObject(fcl_geometry(a), fcl.Transform())
    transforms = [fcl.Transform(p[[6, 3, 4, 5]], p[:3]) for p in poses]
    second = [fcl.CollisionObject(fcl_geometry(b), t) for t in transforms]
    make, ask = {
        "distance": (lambda: (fcl.DistanceRequest(), fcl.DistanceResult()), fcl.distance),
        "collide": (lambda: (fcl.CollisionRequest(), fcl.CollisionResult()), fcl.collide),
    }[query]

    def run() -> None:
        for other in second:
            ask(first, other, *make())

    return run
