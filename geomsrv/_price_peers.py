# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""FCL and Coal as further ways to answer.  They abort, hang and crash on some input: a copy of this process asks first.

FCL is called from Python, one call an item, with objects made beforehand.  python-fcl has no tolerance for distances,
only a choice of two solvers; for motion it has a tolerance of time.
"""

from __future__ import annotations

import faulthandler
import os
import signal
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from geomsrv import fcl_worker
from geomsrv._price_measure import Call, Found, Way, WayError
from geomsrv._price_ways import Batches, Motion, Pair, Points, Sight
from geomsrv._validate import rotation_matrices
from geomsrv.hull import hull_triangles
from geomsrv.shapes import Box, Boxes, Convex, Frustum, HalfSpace, Shape, Sphere, pack

__all__ = ["COAL", "FCL", "FCL_CONTACT", "FCL_MOTION", "survives"]

FloatArray = NDArray[np.float64]

FCL_FAMILY, COAL_FAMILY = "FCL", "Coal"
SOLVERS = {"libccd": 0, "indep": 1}  # fcl.collision_data.GJKSolverType
NAIVE, ADVANCEMENT = 0, 1  # fcl.collision_data.CCDSolverType

# Ways of motion: name, solver, solver of each step, tolerance of the time as a share of the window.  The tolerance sets
# the steps of the naive one; that of conservative advancement changes nothing, whatever it is.
FCL_MOTIONS = (
    ("naive, 0.1", NAIVE, 0, 1e-1),
    ("naive, 0.01", NAIVE, 0, 1e-2),
    ("naive, 0.001", NAIVE, 0, 1e-3),
    ("advancement, libccd", ADVANCEMENT, 0, 1e-6),
    ("advancement, indep", ADVANCEMENT, 1, 1e-6),
)
MOST_ITERATIONS = 10_000  #: so that the tolerance is what ends the iteration
PATIENCE_S = 5  #: of the process that asks first, for one block


def survives(run: Callable[[], Any]) -> str:
    """What became of a copy of this process that called `run`; empty if it came back."""
    child = os.fork()
    if child == 0:  # nothing but the call happens here
        try:
            faulthandler.disable()
            signal.signal(signal.SIGALRM, signal.SIG_DFL)
            signal.alarm(PATIENCE_S)
            sink = os.open(os.devnull, os.O_WRONLY)
            os.dup2(sink, 1)
            os.dup2(sink, 2)
            run()
        except BaseException:  # whatever it was: this copy must never go on as if it were the process
            os._exit(1)
        os._exit(0)
    code = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    if code == -signal.SIGALRM:
        return f"hung for {PATIENCE_S} s"
    return f"died of {signal.Signals(-code).name}" if code < 0 else "raised" if code else ""


def _guarded(engine: str, run: Callable[[], Any], read: Callable[[Any], Found]) -> Call:
    """The call, if it does no harm."""
    if fate := survives(run):
        raise WayError(f"{engine} {fate} on this input")
    return Call(run, read)


# ------------------------------------------------------------------------------------------------------------ FCL


def fcl_geometry(shape: Shape | Frustum) -> Any:
    """FCL's counterpart of a shape; hulls with faces, so that it may walk along edges."""
    import fcl

    if isinstance(shape, HalfSpace):
        raise WayError("FCL's distance of half spaces crashes")
    kind, params = shape.kind, pack([shape]).params[0]
    makers: dict[str, Callable[[], Any]] = {
        "sphere": lambda: fcl.Sphere(params[0]),
        "capsule": lambda: fcl.Capsule(params[0], 2.0 * params[1]),
        "cylinder": lambda: fcl.Cylinder(params[0], 2.0 * params[1]),
        "cone": lambda: fcl.Cone(params[0], 2.0 * params[1]),
        "ellipsoid": lambda: fcl.Ellipsoid(*params[:3]),
        "box": lambda: fcl.Box(*(2.0 * params[:3])),
    }
    if kind in makers:
        return makers[kind]()
    vertices = pack([shape]).vertices
    faces = hull_triangles(vertices)
    listed = np.column_stack([np.full(len(faces), 3), faces])
    return fcl.Convex(vertices, len(faces), listed.ravel())


def _objects(geometries: Sequence[Any], rotations: FloatArray, positions: FloatArray) -> list[Any]:
    import fcl

    return [
        fcl.CollisionObject(geometry, fcl.Transform(rotation, position))
        for geometry, rotation, position in zip(geometries, rotations, positions, strict=True)
    ]


def _at_origin(geometry: Any, count: int) -> list[Any]:
    return _objects([geometry], np.eye(3)[None], np.zeros((1, 3))) * count


def _sides(block: Any) -> tuple[list[Any], list[Any]]:
    """Objects of a block, item by item."""
    if isinstance(block, Pair):
        turns, count = rotation_matrices(block.poses[:, 3:]), len(block.poses)
        other = _objects([fcl_geometry(block.b)] * count, turns, block.poses[:, :3])
        return _at_origin(fcl_geometry(block.a), count), other
    if isinstance(block, Points):
        if not isinstance(block.frustum, Frustum):
            raise WayError
        points = block.points
        other = _objects([fcl_geometry(Sphere(0.0))] * len(points), np.tile(np.eye(3), (len(points), 1, 1)), points)
        return _at_origin(fcl_geometry(block.frustum), len(points)), other
    if isinstance(block, Sight):
        return _at_origin(fcl_geometry(block.frustum), len(block.boxes)), _boxes(block.boxes)
    if isinstance(block, Batches) and isinstance(block.a, Boxes) and isinstance(block.b, Boxes):
        return _boxes(block.a), _boxes(block.b)
    raise WayError


def _boxes(boxes: Boxes) -> list[Any]:
    geometries = [fcl_geometry(Box(half)) for half in boxes.half_extents]
    return _objects(geometries, np.swapaxes(boxes.axes, 1, 2), boxes.center)


def _fcl_distances(first: list[Any], second: list[Any], solver: int) -> list[float]:
    import fcl

    request = fcl.DistanceRequest(gjk_solver_type=solver)
    return [fcl.distance(a, b, request, fcl.DistanceResult()) for a, b in zip(first, second, strict=True)]


def _fcl_signed(first: list[Any], second: list[Any], solver: int) -> list[float]:
    """Signed distances; these are what aborts, hangs and crashes on some input."""
    import fcl

    request = fcl.DistanceRequest(enable_nearest_points=True, enable_signed_distance=True, gjk_solver_type=solver)
    return [fcl.distance(a, b, request, fcl.DistanceResult()) for a, b in zip(first, second, strict=True)]


def _fcl_depths(first: list[Any], second: list[Any]) -> list[float]:
    """Minus the depth of the contact that collide() finds; 0 where it finds none."""
    import fcl

    found = []
    for a, b in zip(first, second, strict=True):
        result = fcl.CollisionResult()
        fcl.collide(a, b, fcl.CollisionRequest(enable_contact=True), result)
        found.append(-max((contact.penetration_depth for contact in result.contacts), default=-np.inf))
    return found


def _fcl_contacts(first: list[Any], second: list[Any], solver: int) -> list[int]:
    import fcl

    request = fcl.CollisionRequest(gjk_solver_type=solver)
    return [fcl.collide(a, b, request, fcl.CollisionResult()) for a, b in zip(first, second, strict=True)]


def _read_distances(signed: bool, found: list[float]) -> Found:
    # -1 is FCL's word for a contact where no depth is asked for.
    values = np.array(found) if signed else np.maximum(found, 0.0)
    return Found(values <= 0.0, values)


def _distance(solver: int, block: Any) -> Call:
    first, second = _sides(block)
    signed = bool(getattr(block, "signed", False))
    run = partial(_fcl_signed if signed else _fcl_distances, first, second, solver)
    return _guarded("FCL", run, partial(_read_distances, signed))


def _depth(block: Any) -> Call:
    if not getattr(block, "signed", False):
        raise WayError
    return _guarded("FCL", partial(_fcl_depths, *_sides(block)), partial(_read_distances, True))


def _contact(solver: int, block: Any) -> Call:
    first, second = _sides(block)
    return _guarded(
        "FCL", partial(_fcl_contacts, first, second, solver), lambda found: Found(np.array(found, dtype=bool))
    )


def _moving(method: int, solver: int, tolerance: float, motion: Motion) -> Call:
    import fcl

    if motion.planar or motion.spin.any():
        raise WayError("" if motion.planar else "FCL's motions turn about a point that it does not initialise")
    count = len(motion)
    still = np.tile(np.eye(3), (count, 1, 1))
    first = _objects([fcl_geometry(Convex(motion.a[k])) for k in range(count)], still, np.zeros((count, 3)))
    second = _objects([fcl_geometry(Convex(motion.b[k])) for k in range(count)], still, motion.center)
    stay = fcl.Transform()
    ends = [fcl.Transform(np.eye(3), end) for end in motion.center + motion.velocity * motion.t_max]

    def run() -> list[tuple[bool, float]]:
        found = []
        request = fcl.ContinuousCollisionRequest(
            num_max_iterations=MOST_ITERATIONS, toc_err=tolerance, gjk_solver_type=solver, ccd_solver_type=method
        )
        for a, b, end in zip(first, second, ends, strict=True):
            result = fcl.ContinuousCollisionResult()
            fcl.continuousCollide(a, stay, b, end, request, result)
            found.append((result.is_collide, result.time_of_contact))
        return found

    def read(found: list[tuple[bool, float]]) -> Found:
        hit, share = np.array(found, dtype=float).T
        return Found(hit > 0.0, np.where(hit > 0.0, share * motion.t_max, np.nan))

    return _guarded("FCL", run, read)


FCL = (
    *(Way(f"FCL, {name}", FCL_FAMILY, partial(_distance, solver)) for name, solver in SOLVERS.items()),
    Way("FCL, depth of collide()", FCL_FAMILY, _depth),
)
FCL_CONTACT = tuple(Way(f"FCL, {name}", FCL_FAMILY, partial(_contact, solver)) for name, solver in SOLVERS.items())
FCL_MOTION = tuple(
    Way(f"FCL, {name}", FCL_FAMILY, partial(_moving, method, solver, tolerance))
    for name, method, solver, tolerance in FCL_MOTIONS
)

# ------------------------------------------------------------------------------------------------------------ Coal

COAL_TOLERANCES = (1e-3, 1e-6, 1e-9, 1e-12)


def _coal_pairs(tolerance: float, block: Any) -> Call:
    """Distances, signed as asked for; Coal's signed distance is one call for both."""
    import coal

    if not isinstance(block, Pair):
        raise WayError
    maker = fcl_worker.Coal()
    geometries = []
    for shape in (block.a, block.b):
        packed = pack([shape])
        geometries.append(maker._made(shape.kind, packed.params[0].tolist(), packed.vertices))
    here = coal.Transform3s()
    turns = rotation_matrices(block.poses[:, 3:])
    request = coal.DistanceRequest()
    request.enable_signed_distance = block.signed
    request.gjk_tolerance = request.epa_tolerance = tolerance
    there = [coal.Transform3s(turn, pose[:3]) for turn, pose in zip(turns, block.poses, strict=True)]

    def run() -> list[float]:
        found = []
        for transform in there:
            result = coal.DistanceResult()
            found.append(coal.distance(geometries[0], here, geometries[1], transform, request, result))
        return found

    return _guarded("Coal", run, partial(_read_distances, block.signed))


COAL = tuple(Way(f"Coal, tolerance {t:g}", COAL_FAMILY, partial(_coal_pairs, t)) for t in COAL_TOLERANCES)
