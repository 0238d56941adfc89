# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""The query functions: validate, make one call into the engine, wrap the answer.  No geometry is computed here."""

from __future__ import annotations

import time
from typing import Any, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from geomsrv import _core, _validate
from geomsrv.answers import (
    Booleans,
    Cost,
    Cull,
    Distances,
    DistanceStatus,
    FirstContacts,
)
from geomsrv.errors import GeometryError
from geomsrv.shapes import Boxes, Frustum, Frustum2D, Polygons, Polytopes, Shape, pack

__all__ = ["cull", "distance", "distance_to_frustum", "first_contact", "intersects"]

FloatArray = NDArray[np.float64]
Batch = Boxes | Polygons | Polytopes | Frustum


def cull(frustum: Frustum, boxes: Boxes, *, accuracy: str = "float64", certificates: bool = False) -> Cull:
    """Which boxes a camera frustum sees.

    Parameters
    ----------
    frustum : Frustum
    boxes : Boxes
        n oriented boxes, world frame.
    accuracy : str
        Tier; see the numerics page.
    certificates : bool
        Not available yet.

    Returns
    -------
    Cull
        ``state`` and ``certain``, (n,) each.  Both bodies are closed: touching is INTERSECTS.

    Raises
    ------
    GeometryError
        Names the argument and the fault.

    References
    ----------
    Eberly, *Intersection of Orthogonal View Frustum and Oriented Bounding Box Using Separation Axis Testing* (2000);
    book section 11.12.1.  Near-parallel edges and large far / near are decided without the printed form's loss of
    accuracy; off-centre windows and axes that are not quite orthonormal are ours.

    Examples
    --------
    >>> import numpy as np, geomsrv as gs
    >>> camera = gs.Frustum([0, 0, 0], np.eye(3), 1.0, 1.0, 1.0, 10.0)
    >>> centers = [[0, 0, 5], [0, 0, -5], [0, 0, 10.5]]
    >>> boxes = gs.Boxes(centers, np.tile(np.eye(3), (3, 1, 1)), np.full((3, 3), 0.5))
    >>> gs.cull(camera, boxes).state
    array([2, 0, 1], dtype=uint8)
    """
    start = time.perf_counter_ns()
    _expect(frustum, Frustum, "frustum")
    _expect(boxes, Boxes, "boxes")
    tier = _validate.accuracy(accuracy)
    _validate.certificates(certificates)
    state, certain, counts = _core.cull(frustum.packed(), boxes.center, boxes.axes, boxes.half_extents)
    stages = dict(zip(("bound", "filter", "uncertain"), counts, strict=True))
    return Cull(state, certain, Cost(time.perf_counter_ns() - start, tier, stages))


def distance_to_frustum(
    frustum: Frustum | Frustum2D,
    points: ArrayLike,
    *,
    accuracy: str = "float64",
    want: tuple[str, ...] = ("distance",),
    certificates: bool = False,
) -> Distances:
    """How far points are from a view frustum, and from which of its features.

    Parameters
    ----------
    frustum : Frustum or Frustum2D
    points : (n, 3) float, or (n, 2) float for a Frustum2D
        World frame [m].  C-contiguous float64 is not copied, which would cost a quarter of the query: it becomes the
        answer's ``point_b``, and ``point_a`` is found from it on first use.
    accuracy : str
        Tier; see the numerics page.
    want : tuple of str
        "distance", and "witness" to find the nearest points right away instead of on first use.
    certificates : bool
        Not available yet.

    Returns
    -------
    Distances
        ``distance`` (0 in the closed frustum), ``lower``, ``upper``, ``region``, ``point_a``.

    Raises
    ------
    GeometryError
        Names the argument, the index and the fault.

    References
    ----------
    Eberly, *Distance from Point to Orthogonal Frustum* (2000); book sections 6.3.3 (2D) and 10.4.3 (3D), with the far
    corner and the clamping of edge projections mended.

    Examples
    --------
    >>> import numpy as np, geomsrv as gs
    >>> camera = gs.Frustum([0, 0, 0], np.eye(3), 1.0, 1.0, 1.0, 4.0)
    >>> answer = gs.distance_to_frustum(camera, [[3.0, 3.0, 2.0], [0.0, 0.0, 0.5]])
    >>> answer.distance.round(12)
    array([0.81649658, 0.5       ])
    >>> [gs.FrustumRegion(r).name for r in answer.region]
    ['LEFT_UP', 'NEAR']
    """
    start = time.perf_counter_ns()
    _expect(frustum, (Frustum, Frustum2D), "frustum")
    kernel, dimension = (
        (_core.distance_to_frustum, 3) if isinstance(frustum, Frustum) else (_core.distance_to_frustum_2d, 2)
    )
    array = _validate.floats(points, "points", (None, dimension))
    tier = _validate.accuracy(accuracy)
    _validate.certificates(certificates)
    effects = _validate.want(want, ("distance", "witness"))
    packed = frustum.packed()
    gap, lower, upper, region, point_a = kernel(packed, array, "witness" in effects)
    return Distances(
        distance=gap,
        lower=lower,
        upper=upper,
        point_b=array,
        status=np.zeros(len(array), np.uint8),
        cost=Cost(time.perf_counter_ns() - start, tier, {"filter": len(array)}),
        region=region,
        _point_a=point_a if point_a is not None else lambda: cast(FloatArray, kernel(packed, array, True)[4]),
    )


def first_contact(
    a: Polygons | Polytopes | Boxes,
    b: Polygons | Polytopes | Boxes,
    velocity_a: ArrayLike,
    velocity_b: ArrayLike,
    *,
    t_max: float = np.inf,
    accuracy: str = "float64",
    contact_set: bool = True,
    certificates: bool = False,
) -> FirstContacts:
    """When and where translating convex bodies first touch.

    Parameters
    ----------
    a, b : Polygons (2D), Polytopes or Boxes (3D)
        n against n, or one against n.
    velocity_a, velocity_b : (n, d) or (d,) float
        Constant linear velocities [m/s], world frame.
    t_max : float
        End of the time window [s], >= 0; may be inf.
    accuracy : str
        Tier; see the numerics page.
    contact_set : bool
        Whether to find the contact points; without them ``points`` is empty.
    certificates : bool
        Not available yet.

    Returns
    -------
    FirstContacts

    Raises
    ------
    GeometryError
        Names the argument, the index and the fault.

    References
    ----------
    Book sections 7.7 and 11.11 for the times; the contact set is derived from support features, because the printed
    labels fail on rotated shapes.

    Examples
    --------
    >>> import geomsrv as gs
    >>> square = gs.Polygons.from_list([[(0, 0), (1, 0), (1, 1), (0, 1)]])
    >>> other = gs.Polygons.from_list([[(3, 0.5), (4, 0.5), (4, 1.5), (3, 1.5)]])
    >>> hit = gs.first_contact(square, other, (1.0, 0.0), (0.0, 0.0))
    >>> hit.time, hit.last_time, hit.normal, hit.points.tolist()
    (array([2.]), array([4.]), array([[1., 0.]]), [[3.0, 0.5], [3.0, 1.0]])
    """
    start = time.perf_counter_ns()
    _expect(a, (Polygons, Polytopes, Boxes), "a")
    _expect(b, (Polygons,) if isinstance(a, Polygons) else (Polytopes, Boxes), "b")
    count = _common_length(len(a), len(b))
    d = 2 if isinstance(a, Polygons) else 3
    moving_a, moving_b = (
        _velocities(v, name, count, d) for v, name in ((velocity_a, "velocity_a"), (velocity_b, "velocity_b"))
    )
    end = float(_validate.floats(t_max, "t_max", (), allow_infinite=True))
    if not end >= 0.0:
        raise GeometryError(f"t_max must be >= 0, got {end}")
    tier = _validate.accuracy(accuracy, ("float64",) if isinstance(a, Polygons) else ("float64", "exact"))
    _validate.certificates(certificates)
    if isinstance(a, Polygons) and isinstance(b, Polygons):
        answer = _core.first_contact_polygons(
            a.vertices, a.offsets, b.vertices, b.offsets, moving_a, moving_b, end, bool(contact_set)
        )
        with np.errstate(over="ignore", invalid="ignore"):  # velocities may differ by more than the largest double
            speed = -((moving_b - moving_a) * answer[5]).sum(axis=1)
        cost = Cost(time.perf_counter_ns() - start, tier, {"filter": count})
        return FirstContacts(*answer, np.zeros(count, np.bool_), speed, cost)
    kernel = {
        (True, True): _core.first_contact_boxes,
        (True, False): _core.first_contact_boxes_polytopes,
        (False, True): _core.first_contact_polytopes_boxes,
        (False, False): _core.first_contact_polytopes,
    }[isinstance(a, Boxes), isinstance(b, Boxes)]
    *answer3, rungs = kernel(*_vertices(a), *_vertices(b), moving_a, moving_b, end, bool(contact_set), tier)
    stages = dict(zip(("filter", "wide", "exact"), rungs, strict=True))
    return FirstContacts(*answer3, Cost(time.perf_counter_ns() - start, tier, stages))


def _vertices(side: Any) -> tuple[NDArray[Any], ...]:
    """What the engine takes as boxes or polytopes."""
    if isinstance(side, Boxes):
        return side.center, side.axes, side.half_extents
    return side.vertices, side.offsets


def distance(
    a: Shape | Batch,
    b: Shape | Batch,
    poses_ab: ArrayLike | None = None,
    *,
    accuracy: str = "float64",
    want: tuple[str, ...] = ("distance",),
) -> Distances:
    """How far apart bodies are, their nearest points, and how deep they overlap.

    Parameters
    ----------
    a, b : Shape or Frustum with `poses_ab`; otherwise batches (Boxes, Polygons, Polytopes, Frustum)
        Two shapes at n relative poses, or two batches in world coordinates, n against n or one against n.
    poses_ab : (n, 7) or (7,) float, optional
        Poses of b in a: x y z [m], qx qy qz qw.
    accuracy : str
        Tier; see the numerics page.
    want : tuple of str
        "distance", "witness", and "penetration" to measure how deep overlapping bodies are.

    Returns
    -------
    Distances
        Points and normals in the frame of a with `poses_ab`, in the world frame without.

    Raises
    ------
    GeometryError
        Names the argument, the index and the fault.

    References
    ----------
    Book section 6.10 and 10.12 (convex distance), 10.8 (segments), 10.4.2 (box); depth and proven bounds are ours.

    Examples
    --------
    >>> import geomsrv as gs
    >>> gs.distance(gs.Sphere(1.0), gs.Box([1, 1, 1]), [4, 0, 0, 0, 0, 0, 1]).distance
    array([2.])
    >>> gs.distance(gs.Sphere(1.0), gs.Sphere(1.0), [1.5, 0, 0, 0, 0, 0, 1], want=("penetration",)).distance
    array([-0.5])
    """
    start = time.perf_counter_ns()
    tier = _validate.accuracy(accuracy)
    effects = _validate.want(want, ("distance", "witness", "penetration"))
    if poses_ab is None:
        answer, message = _batch_distance(a, b, "penetration" in effects), ""
    else:
        shapes: list[Any] = [a, b]
        for shape, name in zip(shapes, "ab", strict=True):
            _expect(shape, (Shape, Frustum), name)
        poses = _validate.poses(poses_ab, "poses_ab")
        pairs = np.broadcast_to(np.array([0, 1]), (len(poses), 2))
        answer = _core.distance_pairs(*pack(shapes), np.ascontiguousarray(pairs), poses, "penetration" in effects)
        unsupported = (answer[6] == DistanceStatus.UNSUPPORTED).any()
        kinds = "-".join(shape.kind for shape in shapes)
        message = f"distance {kinds} is unsupported in this version" if unsupported else ""
    gap, lower, upper, point_a, point_b, normal, status = answer
    totals = np.bincount(status, minlength=len(DistanceStatus))
    counts = {outcome.name.lower(): int(totals[outcome]) for outcome in DistanceStatus if totals[outcome]}
    return Distances(
        distance=gap,
        lower=lower,
        upper=upper,
        point_b=point_b,
        status=status,
        cost=Cost(time.perf_counter_ns() - start, tier, counts),
        _point_a=point_a,
        _normal=normal,
        message=message,
    )


def intersects(
    a: Shape | Batch, b: Shape | Batch, poses_ab: ArrayLike | None = None, *, accuracy: str = "float64"
) -> Booleans:
    """Whether bodies touch or overlap now.

    Parameters
    ----------
    a, b, poses_ab
        Bodies, as for `distance`.
    accuracy : str
        Tier; see the numerics page.

    Returns
    -------
    Booleans
        Closed bodies: touching is True.

    Raises
    ------
    GeometryError
        Names the argument, the index and the fault.

    Examples
    --------
    >>> import geomsrv as gs
    >>> answer = gs.intersects(gs.Sphere(1.0), gs.Sphere(1.0), [[1, 0, 0, 0, 0, 0, 1], [3, 0, 0, 0, 0, 0, 1]])
    >>> answer.value, answer.certain
    (array([ True, False]), array([ True,  True]))
    """
    answer = distance(a, b, poses_ab, accuracy=accuracy, want=("penetration",))
    return Booleans(
        value=answer.distance <= 0.0,
        certain=(answer.lower > 0.0) | (answer.upper < 0.0),
        status=answer.status,
        cost=answer.cost,
        message=answer.message,
    )


def _batch_distance(a: Any, b: Any, penetration: bool) -> tuple[Any, ...]:
    """The engine's answer for two batches in world coordinates."""
    _expect(a, (Boxes, Polygons, Polytopes, Frustum), "a")
    _expect(b, (Polygons,) if isinstance(a, Polygons) else (Boxes, Polytopes, Frustum), "b")
    _common_length(_length(a), _length(b))
    if isinstance(a, Polygons):
        return _core.distance_polygons(a.vertices, a.offsets, b.vertices, b.offsets, penetration)
    if isinstance(a, Boxes) and isinstance(b, Boxes):
        return _core.distance_boxes(a.center, a.axes, a.half_extents, b.center, b.axes, b.half_extents, penetration)
    if isinstance(a, Boxes):
        return _core.distance_boxes_polytopes(a.center, a.axes, a.half_extents, *_hulls(b), penetration)
    if isinstance(b, Boxes):
        answer = _core.distance_boxes_polytopes(b.center, b.axes, b.half_extents, *_hulls(a), penetration)
        gap, lower, upper, point_b, point_a, normal, status = answer
        return gap, lower, upper, point_a, point_b, -normal, status
    return _core.distance_polytopes(*_hulls(a), *_hulls(b), penetration)


def _hulls(side: Polytopes | Frustum) -> tuple[FloatArray, NDArray[np.int64], FloatArray, FloatArray]:
    """Vertices, offsets, what the vertices are relative to, and how far each may be from the one meant."""
    if isinstance(side, Frustum):
        corners = side.corners(side.origin)
        return corners, np.array([0, len(corners)]), side.origin[None], np.array([side.corner_error(side.origin)])
    return side.vertices, side.offsets, np.zeros((len(side), 3)), np.zeros(len(side))


def _length(side: Batch) -> int:
    return 1 if isinstance(side, Frustum) else len(side)


def _common_length(a: int, b: int) -> int:
    if a != b and 1 not in (a, b):
        raise GeometryError(f"a and b must have the same length, or one of them length 1; got {a} and {b}")
    return b if a == 1 else a


def _velocities(value: ArrayLike, name: str, count: int, dimension: int) -> FloatArray:
    """(n, d) or (d,) -> (n, d) or (1, d)."""
    given = _validate.array(value, name)
    rows = _validate.floats(given, name, (dimension,) if given.ndim == 1 else (None, dimension)).reshape(-1, dimension)
    if len(rows) not in (1, count):
        raise GeometryError(f"{name} must have shape ({dimension},) or ({count}, {dimension}), got {given.shape}")
    return rows


def _expect(value: Any, kinds: type | tuple[type, ...], name: str) -> None:
    """Refuse an argument of the wrong type, by name."""
    if not isinstance(value, kinds):
        names = [kind.__name__ for kind in (kinds if isinstance(kinds, tuple) else (kinds,))]
        raise GeometryError(f"{name} must be {' or '.join(names)}, got {type(value).__name__}")
