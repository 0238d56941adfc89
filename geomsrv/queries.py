# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""The query functions: validate, make one call into the engine, wrap the answer.  No geometry is computed here."""

from __future__ import annotations

import time
from dataclasses import replace
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
from geomsrv.certificates import certify_contacts, certify_cull, certify_distances
from geomsrv.errors import GeometryError
from geomsrv.ladder import (
    AUTO,
    UNKNOWN,
    Quality,
    climbed_booleans,
    climbed_contacts,
    climbed_cull,
    climbed_distances,
    nothing_known,
)
from geomsrv.mesh import first_contact_meshes
from geomsrv.region import Region, distance_regions, first_contact_regions, intersects_regions
from geomsrv.shapes import (
    CURVED,
    Boxes,
    Capsule,
    Convex,
    Frustum,
    Frustum2D,
    HalfSpace,
    Mesh,
    Polygons,
    Polytopes,
    Shape,
    Sphere,
    pack,
    part_of,
)
from geomsrv.turning import TIME_TOLERANCE, first_contact_turning, turns

__all__ = ["cull", "distance", "distance_to_frustum", "first_contact", "intersects"]

FloatArray = NDArray[np.float64]
_Convex = Boxes | Polygons | Polytopes
Batch = Boxes | Polygons | Polytopes | Frustum

TIERS = ("bound", "float32", "float64", "exact")  #: of queries that answer at all of them
CULL_STAGES = ("bound", "filter", "wide", "exact", "uncertain")  # in the order in which the engine counts
CULL_COUNTS = {
    "bound": ("bound", "uncertain"),
    "float32": ("bound", "filter", "uncertain"),
    "float64": ("bound", "filter", "uncertain"),
    "exact": ("bound", "filter", "wide", "exact"),
}
# What answers the others, in the order in which the engine counts it, and how far a tier climbs.
RUNGS = ("bound", "filter", "wide", "exact")
# Tiers that are worth a pass of their own, by what they cost and settle (`geomsrv price`): single precision is no
# faster for solids; exact arithmetic, which begins with bounds or a filter of its own, is no slower for what a camera
# sees, and in the plane.
SEEING = ("exact",)
MEASURING_POINTS = ("float64", "exact")
MEASURING = ("bound", "float64", "exact")
MEASURING_POLYGONS = ("exact",)
MEETING_POLYGONS = ("bound", "float32", "float64", "exact")
MOVING_POLYGONS = ("exact",)
MOVING = ("float64", "exact")
SOLID_MOTION_TIERS = ("bound", "float64", "exact")  #: of first contact in space
CLIMB = {"bound": RUNGS[:1], "float32": RUNGS[1:2], "float64": RUNGS[1:2], "exact": RUNGS[1:]}


def cull(
    frustum: Frustum,
    boxes: Boxes,
    *,
    accuracy: str = "float64",
    certificates: bool = False,
    tolerance: float | None = None,
    time_budget: float | None = None,
) -> Cull:
    """Which boxes a camera frustum sees.

    Parameters
    ----------
    frustum : Frustum
    boxes : Boxes
        n oriented boxes, world frame.
    accuracy : str
        Tier: "bound" looks at the sphere around a box only, and answers INTERSECTS where that is not outside or inside;
        "float32" and "float64" look at planes and axes, and say where rounding leaves a doubt; "exact" leaves none.
        "auto" takes for each box the cheapest of "float64" and "exact" that is certain.
    certificates : bool
        Whether the answer is to carry its proof, see `verify`; at the tiers "float64" and "exact".
    tolerance : float, optional
        Instead of a tier, how far [m] a box may be moved from where its state is right, > 0: each box is answered by
        the cheapest tier that is certain, which is within any tolerance.
    time_budget : float, optional
        Seconds after which nothing more is begun, > 0: bounding volumes speak for the boxes that are then left.

    Returns
    -------
    Cull
        ``state`` and ``certain``, (n,) each.  Both bodies are closed: touching is INTERSECTS.  ``cost.counts``: boxes
        decided by "bound" (spheres and planes), by "filter" (all axes), in "wide" arithmetic (double-double), in
        "exact" arithmetic; and left "uncertain".

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
    quality = Quality.of(accuracy, tolerance, time_budget)
    if quality.climbs:
        return climbed_cull(
            lambda items, tier: cull(
                frustum, part_of(boxes, items, len(boxes)), accuracy=tier, certificates=certificates
            ),
            len(boxes),
            quality.rungs(TIERS, SEEING, certified=certificates),
            quality,
        )
    tier = _validate.accuracy(accuracy, TIERS)
    certified = _validate.certificates(certificates, tier)
    given = frustum.packed(), boxes.center, boxes.axes, boxes.half_extents
    state, certain, counts = _core.cull(*given, tier, False)[:3]

    def evidence(i: int) -> tuple[Any, Any]:
        packed, center, axes, half_extents = given
        row = slice(i, i + 1)
        alone: Any = _core.cull(packed, center[row], axes[row], half_extents[row], tier, True)
        return alone[3][0], alone[4][0]

    stages = {name: n for name, n in zip(CULL_STAGES, counts, strict=True) if name in CULL_COUNTS[tier]}
    cost = Cost(time.perf_counter_ns() - start, tier, stages)
    return Cull(state, certain, cost, _record=certify_cull(frustum, boxes, evidence) if certified else None)


def distance_to_frustum(
    frustum: Frustum | Frustum2D,
    points: ArrayLike,
    *,
    accuracy: str = "float64",
    want: tuple[str, ...] = ("distance",),
    certificates: bool = False,
    tolerance: float | None = None,
    time_budget: float | None = None,
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
        Whether the answer is to carry its proof, see `verify`; at the tiers "float64" and "exact".
    tolerance : float, optional
        Instead of a tier, the widest interval [m] from ``lower`` to ``upper``, > 0: each item is answered by the
        cheapest tier that proves it; NOT_CONVERGED where none does.  A tier other than "float64" and "auto" is kept to.
    time_budget : float, optional
        Seconds after which nothing more is begun, > 0: items that are then left have the interval proven so far, if
        need be that of bounding volumes, and are NOT_CONVERGED.

    Returns
    -------
    Distances
        ``distance`` (0 in the closed frustum), ``lower``, ``upper``, ``region``, ``point_a``.  "bound" measures from
        the frustum's bounding sphere, below, and from the centre of that, above: its ``region`` is None, ``point_a``
        NaN.

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
    quality = Quality.of(accuracy, tolerance, time_budget)
    if quality.climbs:
        return climbed_distances(
            lambda items, tier: distance_to_frustum(
                frustum, part_of(array, items, len(array)), accuracy=tier, want=want, certificates=certificates
            ),
            len(array),
            quality.rungs(TIERS, MEASURING_POINTS, lengths=True, certified=certificates),
            quality,
            points=True,
        )
    tier = _validate.accuracy(accuracy, TIERS)
    certified = _validate.certificates(certificates, tier)
    effects = _validate.want(want, ("distance", "witness"))
    given = frustum.packed(), array, tier
    gap, lower, upper, region, point_a, _, rungs = kernel(*given, "witness" in effects, False)

    def nearest() -> FloatArray:
        return np.full_like(array, np.nan) if tier == "bound" else cast(FloatArray, kernel(*given, True, False)[4])

    def simplex(i: int) -> Any:
        alone: Any = kernel(given[0], array[i : i + 1], tier, False, True)
        return alone[5][0]

    return Distances(
        distance=gap,
        lower=lower,
        upper=upper,
        point_b=array,
        status=np.zeros(len(array), np.uint8),
        cost=Cost(time.perf_counter_ns() - start, tier, _stages(tier, rungs)),
        region=region,
        _point_a=nearest if point_a is None else point_a,
        _record=certify_distances(frustum, array, simplex) if certified else None,
    )


def first_contact(
    a: Boxes | Polygons | Polytopes | Region | Mesh | Convex,
    b: Boxes | Polygons | Polytopes | Region | Mesh | Convex,
    velocity_a: ArrayLike,
    velocity_b: ArrayLike,
    *,
    t_max: float = np.inf,
    accuracy: str = "float64",
    contact_set: bool = True,
    certificates: bool = False,
    angular_velocity_a: ArrayLike | None = None,
    angular_velocity_b: ArrayLike | None = None,
    center_a: ArrayLike | None = None,
    center_b: ArrayLike | None = None,
    tolerance: float | None = None,
    time_budget: float | None = None,
) -> FirstContacts:
    """When and where bodies first touch that translate, or translate and turn.

    Parameters
    ----------
    a, b : Polygons (2D), Polytopes or Boxes (3D)
        n against n, or one against n.  A Region is one body, in world coordinates here, against Polygons or another,
        at the cost of all pairs of pieces.  A Mesh, which is a surface, and a Convex are one body each, in world
        coordinates here, against each other, Boxes or Polytopes.
    velocity_a, velocity_b : (n, d) or (d,) float
        Constant linear velocities [m/s], world frame; of bodies that turn those of their centres.
    t_max : float
        End of the time window [s], >= 0; may be inf.
    accuracy : str
        Tier; see the numerics page.  "float64" takes bodies that come within the rounding of coordinates for touching;
        where exact arithmetic says otherwise, ``certain`` is False.  "exact" takes the numbers literally: no slack,
        everything correctly rounded, every ``status`` certain; a time beyond the doubles is inf, not NEVER.  "bound"
        looks at boxes, circles and spheres only: NEVER is certain; otherwise ``time`` = ``time_lower`` is when they can
        first meet (TOUCHING if at once), ``time_upper`` = ``last_time`` when they can last, without normal or points.
        "float32", of polygons, takes them literally, too: NEVER and OVERLAPPING are certain; TOUCHING is all that it
        cannot tell from touching.
    contact_set : bool
        Whether to find the contact points; without them ``points`` is empty.
    certificates : bool
        Whether the answer is to carry its proof, see `verify`; at the tiers "float64" and "exact".  Not for bodies
        that turn.
    angular_velocity_a, angular_velocity_b : (n, 3) or (3,) float; in 2D (n,) or one number; optional
        Constant angular velocities [rad/s], world frame.  If any is not zero, a point that is at x0 at the start moves
        as ``x(t) = c + v t + R(w t) (x0 - c)``, and the only tier is "float64", whose bounds are proven.
    center_a, center_b : (n, d) or (d,) float, optional
        The points c at the start [m], which the bodies turn about.  By default the centre of a box, and otherwise the
        middle of the bounding box, ``0.5 * min + 0.5 * max`` of the vertices in float64.
    tolerance : float, optional
        Widest time interval of WILL_TOUCH [s], > 0; neighbouring doubles always do.  Bodies that turn are followed
        until it is met, by default 1e-6.  Others are answered by the cheapest tier that proves it; a tier other than
        "float64" and "auto" is kept to.
    time_budget : float, optional
        Seconds after which nothing more is begun, > 0: items that are then left are NOT_CONVERGED, with what bounding
        volumes say of ``time_lower``.

    Returns
    -------
    FirstContacts
        ``cost.counts``: polygons by the tier's rungs; solids decided by the "filter" in float64, in "wide" arithmetic
        (double-double) and in "exact" arithmetic, which "float64", too, turns to where bodies pass within the slack.

        Of a Region ``parts`` lists what may be several points and segments, no seam among them; bodies that overlap at
        the start share convex polygons, one for each pair of pieces.  Of a Mesh there may also be areas: rings around
        them, counter-clockwise about the normal, and clockwise ones around their holes.  ``normal`` parts the bodies
        near all points of contact, and is NaN where no one normal does, as in a notch; ``last_time`` is the last of all
        contacts, between which they may be apart.

        If anything turns, ``time`` is ``time_lower``: the bodies are proven apart before it, and proven in contact at
        some time until ``time_upper``.  ``normal``, ``points``, and ``closing_speed``, which is that midway between the
        nearest points, are those at ``time``; ``last_time`` is NaN.  The contact set is what the bodies share to within
        the way that they come nearer until ``time_upper``: a face that lies flat within that counts as flat, so a
        smaller ``tolerance`` tells more apart; points are midway between the bodies.  At the start it is that of bodies
        at rest.  That of a Mesh is that of all of it, without seams; of the first pair of triangles only where more
        than 16,384 pairs touch at once.  TOUCHING, at the start, and GRAZING are outcomes where neither can be proven,
        with a ``time_upper`` that may be inf; NOT_CONVERGED is one where the work allowed did not get beyond
        ``time_lower``, as for two bodies that turn beside each other for ever.  ``cost.counts``: pairs decided in
        "filter" and "wide" arithmetic, and how many "looks" at them it took.

    Raises
    ------
    GeometryError
        Names the argument, the index and the fault.

    References
    ----------
    Book sections 7.7 and 11.11 for the times; the contact set is derived from support features, because the printed
    labels fail on rotated shapes.  Bodies that turn: conservative advancement (Mirtich, 1996), along a direction that
    turns, too.

    Examples
    --------
    >>> import geomsrv as gs
    >>> square = gs.Polygons.from_list([[(0, 0), (1, 0), (1, 1), (0, 1)]])
    >>> other = gs.Polygons.from_list([[(3, 0.5), (4, 0.5), (4, 1.5), (3, 1.5)]])
    >>> hit = gs.first_contact(square, other, (1.0, 0.0), (0.0, 0.0))
    >>> hit.time, hit.last_time, hit.normal, hit.points.tolist()
    (array([2.]), array([4.]), array([[1., 0.]]), [[3.0, 0.5], [3.0, 1.0]])
    >>> rod = gs.Polygons.from_list([[(-1, 0), (1, 0)]])
    >>> wall = gs.Polygons.from_list([[(-2, 0.5), (2, 0.5)]])
    >>> swing = gs.first_contact(rod, wall, (0, 0), (0, 0), angular_velocity_a=1.0)
    >>> float(swing.time[0].round(6)), swing.points.round(6).tolist()
    (0.523599, [[0.866025, 0.5]])

    In space boxes and hulls may be mixed:

    >>> cube = gs.Boxes.from_poses([[0, 0, 0, 0, 0, 0, 1]], [[1, 1, 1]])
    >>> point = gs.Polytopes.from_list([[(5, 0.5, 0)]])
    >>> hit = gs.first_contact(cube, point, (1, 0, 0), (-1, 0, 0), accuracy="exact")
    >>> hit.time, hit.normal.tolist(), hit.closing_speed, hit.points.tolist()
    (array([2.]), [[1.0, 0.0, 0.0]], array([2.]), [[3.0, 0.5, 0.0]])

    Meshes touch along whole areas, here a square of two triangles on a box:

    >>> tile = gs.Mesh([(0, 0, 3), (1, 0, 3), (1, 1, 3), (0, 1, 3)], [(0, 1, 2), (0, 2, 3)])
    >>> hit = gs.first_contact(tile, cube, (0, 0, -1), (0, 0, 0))
    >>> hit.time, [len(part) for part in hit.parts(0)]
    (array([2.]), [4])
    """
    start = time.perf_counter_ns()
    by_pieces = first_contact_regions if isinstance(a, Region) or isinstance(b, Region) else None
    if isinstance(a, Mesh | Convex) or isinstance(b, Mesh | Convex):
        by_pieces = first_contact_meshes
    turning = turns(angular_velocity_a, angular_velocity_b)
    quality = Quality.of(accuracy, tolerance, time_budget)
    if turning and quality.accuracy == AUTO:
        accuracy = "float64"  # the only tier of bodies that turn, which are followed until the tolerance is met
    options: dict[str, Any] = {
        "t_max": t_max,
        "contact_set": contact_set,
        "certificates": certificates,
        "tolerance": (quality.tolerance or TIME_TOLERANCE) if turning else None,
    }
    if time_budget is not None or (quality.climbs and not turning):
        velocities = {"velocity_a": velocity_a, "velocity_b": velocity_b}
        turn = {
            "angular_velocity_a": angular_velocity_a,
            "angular_velocity_b": angular_velocity_b,
            "center_a": center_a,
            "center_b": center_b,
        }
        return _climbed_contacts(a, b, velocities, turn, options, quality, turning)
    if by_pieces is not None:
        options |= {
            "accuracy": accuracy,
            "angular_velocity_a": angular_velocity_a,
            "angular_velocity_b": angular_velocity_b,
            "center_a": center_a,
            "center_b": center_b,
        }
        return by_pieces(first_contact, a, b, (velocity_a, velocity_b), options)
    if turning:
        return first_contact_turning(
            (a, b),
            (velocity_a, velocity_b),
            (angular_velocity_a, angular_velocity_b),
            (center_a, center_b),
            accuracy=accuracy,
            **options,
        )
    _expect(a, (Polygons, Polytopes, Boxes), "a")
    _expect(b, (Polygons,) if isinstance(a, Polygons) else (Polytopes, Boxes), "b")
    a, b = cast(tuple[_Convex, _Convex], (a, b))
    count = _validate.common_length(len(a), len(b))
    d = 2 if isinstance(a, Polygons) else 3
    moving_a, moving_b = (
        _velocities(v, name, count, d) for v, name in ((velocity_a, "velocity_a"), (velocity_b, "velocity_b"))
    )
    end = _validate.limit(t_max, "t_max")
    tier = _validate.accuracy(accuracy, TIERS if d == 2 else SOLID_MOTION_TIERS)
    certified = _validate.certificates(certificates, tier)
    proof = certify_contacts(a, b, (moving_a, moving_b), end) if certified else None
    if isinstance(a, Polygons) and isinstance(b, Polygons):
        answer = _core.first_contact_polygons(
            a.vertices, a.offsets, b.vertices, b.offsets, moving_a, moving_b, end, bool(contact_set), tier
        )

        def speed() -> FloatArray:
            with np.errstate(over="ignore", invalid="ignore"):  # velocities may differ by more than the largest double
                return -((moving_b - moving_a) * answer[5]).sum(axis=1)

        cost = Cost(time.perf_counter_ns() - start, tier, _stages(tier, answer[-1]))
        return FirstContacts(*answer[:-1], speed, cost, _record=proof)
    side_a, side_b = (_side(cast(Boxes | Polytopes, body)) for body in (a, b))
    found = _core.first_contact_world(side_a, side_b, moving_a, moving_b, end, bool(contact_set), tier)
    # Of solids float64 decides some items by exact arithmetic, too: there the slack has the last word.
    stages = _stages("exact" if tier == "float64" else tier, found[-1])
    return FirstContacts(*found[:-1], Cost(time.perf_counter_ns() - start, tier, stages), _record=proof)


def distance(
    a: Shape | Batch | Region,
    b: Shape | Batch | Region,
    poses_ab: ArrayLike | None = None,
    *,
    accuracy: str = "float64",
    want: tuple[str, ...] = ("distance",),
    certificates: bool = False,
    tolerance: float | None = None,
    time_budget: float | None = None,
) -> Distances:
    """How far apart bodies are, their nearest points, and how deep they overlap.

    Parameters
    ----------
    a, b : Shape or Frustum with `poses_ab`; otherwise batches (Boxes, Polygons, Polytopes, Frustum)
        Two shapes at n relative poses, or two batches in world coordinates, n against n or one against n.  A Region is
        one body, in world coordinates here, against Polygons or another, without penetration.
    poses_ab : (n, 7) or (7,) float, optional
        Poses of b in a: x y z [m], qx qy qz qw.
    accuracy : str
        Tier; see the numerics page.  "bound" is a lower bound, without nearest points.
    want : tuple of str
        "distance", "witness", and "penetration" to measure how deep overlapping bodies are.
    certificates : bool
        Whether the answer is to carry its proof, see `verify`; at the tiers "float64" and "exact".
    tolerance : float, optional
        Instead of a tier, the widest interval [m] from ``lower`` to ``upper``, > 0: each item is answered by the
        cheapest tier that proves it; NOT_CONVERGED where none does.  A tier other than "float64" and "auto" is kept to.
    time_budget : float, optional
        Seconds after which nothing more is begun, > 0: items that are then left have the interval proven so far, if
        need be that of bounding volumes, and are NOT_CONVERGED.

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

    A few millimetres are enough: bounding volumes prove that of spheres, of a box only arithmetic does.

    >>> for shape in (gs.Sphere(1.0), gs.Box([1, 1, 1])):
    ...     answer = gs.distance(shape, gs.Sphere(1.0), [4, 1, 0, 0, 0, 0, 1], tolerance=5e-3)
    ...     print(answer.cost.accuracy, answer.error_bound <= 5e-3)
    bound True
    float64 True
    """
    quality = Quality.of(accuracy, tolerance, time_budget)
    if quality.climbs:
        if poses_ab is not None:
            _validate.poses(poses_ab, "poses_ab")
        return climbed_distances(
            lambda items, tier: distance(
                *_parts(a, b, items), _poses_of(poses_ab, items), accuracy=tier, want=want, certificates=certificates
            ),
            _count(a, b, poses_ab),
            quality.rungs(
                TIERS, MEASURING_POLYGONS if _flat(a, poses_ab) else MEASURING, lengths=True, certified=certificates
            ),
            quality,
            points="witness" in want,
        )
    if isinstance(a, Region) or isinstance(b, Region):
        options = {"poses_ab": poses_ab, "accuracy": accuracy, "certificates": certificates}
        return distance_regions(distance, a, b, want, options)
    start = time.perf_counter_ns()
    effects = _validate.want(want, ("distance", "witness", "penetration"))
    signed, poses = "penetration" in effects, None
    if poses_ab is None and isinstance(a, Polygons):
        found = _polygon_distance(a, b, signed, accuracy, start)[0]
        proven = _validate.certificates(certificates, found.cost.accuracy)
        return replace(found, _record=certify_distances(a, b, signed=signed)) if proven else found
    tier = _validate.accuracy(accuracy, TIERS)
    certified = _validate.certificates(certificates, tier)
    if poses_ab is None:
        answer, message = _batch_distance(a, b, signed, tier, certified), ""
    else:
        shapes: list[Any] = [a, b]
        for shape, name in zip(shapes, "ab", strict=True):
            _expect(shape, (Shape, Frustum), name)
        poses = _validate.poses(poses_ab, "poses_ab")
        pairs = np.broadcast_to(np.array([0, 1]), (len(poses), 2))
        frusta = np.array([x.packed() if isinstance(x, Frustum) else np.zeros(18) for x in shapes])
        answer = _core.distance_pairs(
            *pack(shapes), np.ascontiguousarray(pairs), poses, signed, tier, evidence=certified, frusta=frusta
        )
        unsupported = (answer[6] == DistanceStatus.UNSUPPORTED).any()
        kinds = "-".join(shape.kind for shape in shapes)
        message = f"distance {kinds} is unsupported in this version" if unsupported else ""
    gap, lower, upper, point_a, point_b, normal, status, *rung = answer[:8]
    totals = np.bincount(status, minlength=len(DistanceStatus))
    counts = {outcome.name.lower(): int(totals[outcome]) for outcome in DistanceStatus if totals[outcome]}
    if tier != "float64":
        rungs = np.bincount(rung[0][status != DistanceStatus.UNSUPPORTED], minlength=len(RUNGS))
        counts |= {name: int(total) for name, total in zip(RUNGS, rungs, strict=True) if total}
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
        _record=certify_distances(a, b, answer[8], poses_ab=poses, signed=signed) if certified else None,
    )


def intersects(
    a: Shape | Batch | Region,
    b: Shape | Batch | Region,
    poses_ab: ArrayLike | None = None,
    *,
    accuracy: str = "float64",
    certificates: bool = False,
    tolerance: float | None = None,
    time_budget: float | None = None,
) -> Booleans:
    """Whether bodies touch or overlap now.

    Parameters
    ----------
    a, b, poses_ab
        Bodies, as for `distance`.
    accuracy : str
        Tier; see the numerics page.
    certificates : bool
        Whether the answer is to carry its proof, see `verify`; at the tiers "float64" and "exact".
    tolerance : float, optional
        Instead of a tier, how far [m] a body may be moved from where the answer is right, > 0: each item is answered by
        the cheapest tier that is certain, which is within any tolerance.
    time_budget : float, optional
        Seconds after which nothing more is begun, > 0: items that are then left have the answer of bounding volumes.

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
    quality = Quality.of(accuracy, tolerance, time_budget)
    if quality.climbs:
        if poses_ab is not None:
            _validate.poses(poses_ab, "poses_ab")
        return climbed_booleans(
            lambda items, tier: intersects(
                *_parts(a, b, items), _poses_of(poses_ab, items), accuracy=tier, certificates=certificates
            ),
            _count(a, b, poses_ab),
            quality.rungs(TIERS, MEETING_POLYGONS if _flat(a, poses_ab) else MEASURING, certified=certificates),
            quality,
        )
    if isinstance(a, Region) or isinstance(b, Region):
        options = {"poses_ab": poses_ab, "accuracy": accuracy, "certificates": certificates}
        return intersects_regions(intersects, a, b, options)
    if poses_ab is None and isinstance(a, Polygons):
        answer, meet, certain = _polygon_distance(a, b, True, accuracy, time.perf_counter_ns())
        proven = _validate.certificates(certificates, answer.cost.accuracy)
        record = certify_distances(a, b, signed=True) if proven else None
        return Booleans(meet, certain, answer.status, answer.cost, _record=record)
    # Without depth exact arithmetic tells touching from overlapping, too; float64 needs the margin.
    by_depth = accuracy != "exact" or any(isinstance(body, CURVED) for body in (a, b))
    want = ("penetration",) if by_depth else ()
    answer = distance(a, b, poses_ab, accuracy=accuracy, want=want, certificates=certificates)
    value, certain = answer.distance <= 0.0, (answer.lower > 0.0) | (answer.upper <= 0.0)
    if not by_depth and not any(isinstance(body, (Sphere, Capsule, HalfSpace)) for body in (a, b)):
        # Correctly rounded: the upper neighbour of a distance, however short, is no zero.
        value, certain = answer.upper <= 0.0, answer.status == DistanceStatus.OK
    return Booleans(
        value=value,
        certain=certain,
        status=answer.status,
        cost=answer.cost,
        message=answer.message,
        _record=answer._record,
    )


def _climbed_contacts(
    a: Any,
    b: Any,
    velocities: dict[str, ArrayLike],
    turn: dict[str, Any],
    options: dict[str, Any],
    quality: Quality,
    turning: bool,
) -> FirstContacts:
    """`first_contact` by several tiers, or within a time budget."""
    count, flat = _count(a, b, None), _flat(a, None)
    d = 2 if flat else 3
    for name, value in velocities.items():
        _velocities(value, name, count, d)  # while the index of a fault is that of the caller
    tiers: tuple[str, ...] = TIERS if flat else SOLID_MOTION_TIERS
    ladder: tuple[str, ...] = MOVING_POLYGONS if flat else MOVING
    if turning:
        tiers, ladder = ("float64",), ("float64",)
    rungs = quality.rungs(tiers, ladder, certified=options["certificates"])

    def ask(items: NDArray[np.int64], tier: str) -> FirstContacts:
        if tier == UNKNOWN:
            return nothing_known(len(items), d)
        moving = {name: part_of(np.asarray(value), items, count) for name, value in velocities.items()}
        given: dict[str, Any] = {
            name: part_of(np.asarray(value), items, count) for name, value in turn.items() if value is not None
        }
        side_a, side_b = _parts(a, b, items)
        return first_contact(side_a, side_b, **moving, **given, **options, accuracy=tier)

    return climbed_contacts(ask, count, rungs, quality)


def _flat(a: Any, poses_ab: Any) -> bool:
    """Whether the bodies are in the plane."""
    return poses_ab is None and isinstance(a, Polygons | Region)


def _count(a: Any, b: Any, poses_ab: Any) -> int:
    """Number of items of a query."""
    if poses_ab is not None:
        given = np.asarray(poses_ab)
        return len(given) if given.ndim == 2 else 1
    lengths = (len(x) if isinstance(x, Boxes | Polygons | Polytopes) else 1 for x in (a, b))
    return _validate.common_length(*lengths)


def _parts(a: Any, b: Any, items: NDArray[np.int64]) -> tuple[Any, Any]:
    """The listed items of both sides."""
    lengths = [len(x) if isinstance(x, Boxes | Polygons | Polytopes) else 1 for x in (a, b)]
    parts = [part_of(x, items, n) if n > 1 else x for x, n in zip((a, b), lengths, strict=True)]
    return parts[0], parts[1]


def _poses_of(poses_ab: Any, items: NDArray[np.int64]) -> Any:
    """The listed poses."""
    given = None if poses_ab is None else np.asarray(poses_ab)
    return given if given is None or given.ndim == 1 else part_of(given, items, len(given))


def _polygon_distance(
    a: Polygons, b: Any, penetration: bool, accuracy: str, start: int
) -> tuple[Distances, NDArray[np.bool_], NDArray[np.bool_]]:
    """The engine's answer for polygons; whether they meet, and whether that is certain."""
    tier = _validate.accuracy(accuracy, TIERS)
    _expect(b, Polygons, "b")
    _validate.common_length(len(a), len(b))
    gap, lower, upper, point_a, point_b, normal, status, meet, certain, rungs = _core.distance_polygons(
        a.vertices, a.offsets, b.vertices, b.offsets, penetration, tier
    )
    cost = Cost(time.perf_counter_ns() - start, tier, _stages(tier, rungs))
    return Distances(gap, lower, upper, point_b, status, cost, point_a, normal), meet, certain


def _stages(tier: str, rungs: tuple[int, ...]) -> dict[str, int]:
    """Items by what it took to answer them."""
    return {name: count for name, count in zip(RUNGS, rungs, strict=True) if name in CLIMB[tier]}


def _batch_distance(a: Any, b: Any, penetration: bool, tier: str, evidence: bool) -> tuple[Any, ...]:
    """The engine's answer for two batches in world coordinates."""
    _expect(a, (Boxes, Polygons, Polytopes, Frustum), "a")
    _expect(b, (Boxes, Polytopes, Frustum), "b")
    _validate.common_length(_length(a), _length(b))
    return _core.distance_world(_side(a), _side(b), penetration, tier, evidence)


def _side(batch: Boxes | Polytopes | Frustum) -> tuple[Any, ...]:
    """A batch as the engine reads it."""
    if isinstance(batch, Boxes):
        return batch.center, batch.axes, batch.half_extents
    if isinstance(batch, Polytopes):
        return batch.vertices, batch.offsets
    return (batch.packed(),)


def _length(side: Batch) -> int:
    return 1 if isinstance(side, Frustum) else len(side)


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
