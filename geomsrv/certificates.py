# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""Inputs and answer as records that `geomsrv.verify` proves; docs/certificates.md tells what they mean.

While a query is answered nothing happens here: a record is made when it is read.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from geomsrv import _validate
from geomsrv.answers import Booleans, ContactStatus, Cull, CullState, Distances, DistanceStatus, FirstContacts, Record
from geomsrv.evidence import evidence_of_contact, evidence_of_distance
from geomsrv.shapes import (
    Box,
    Boxes,
    Capsule,
    Convex,
    Frustum,
    Frustum2D,
    Point,
    Polygons,
    Segment,
    Shape,
    Sphere,
    Triangle,
)

__all__ = ["certify_contacts", "certify_cull", "certify_distances", "without_claim"]

FloatArray = NDArray[np.float64]
Pairs = NDArray[np.int32]
Prover = Callable[[Any, int], Record]


def certify_cull(frustum: Frustum, boxes: Boxes, found: Callable[[int], Any]) -> Prover:
    """Records of a `Cull`; `found` finds the evidence of one item, that of cull_evidence.hpp: (4, 2) and (2,)."""

    def record(answer: Cull, i: int) -> Record:
        sides, state = (_item(frustum, i), _item(boxes, i)), CullState(int(answer.state[i]))
        if not answer.certain[i]:
            return _record("cull", *sides, {}, {})
        evidence: Record = {}
        simplex, beyond = found(i)
        pairs, (corner, plane) = _used(simplex), beyond.tolist()
        if plane >= 0:
            evidence["beyond"] = [max(corner, 0), plane]
        if pairs:
            evidence["simplex"] = pairs
        elif state == CullState.INTERSECTS:
            evidence["inside"] = [k for _, k in simplex.tolist() if k >= 0]
        return _record("cull", *sides, {"state": state.name}, evidence)

    return record


def certify_distances(
    a: Any,
    b: Any,
    simplex: Pairs | Callable[[int], Pairs] | None = None,
    *,
    poses_ab: FloatArray | None = None,
    signed: bool = False,
) -> Prover:
    """Records of `Distances` or `Booleans` of batches, of a frustum and points, or of shapes at poses.

    `simplex`: (n, k, 2) pairs of vertices where the engine ended, unused rows -1; or what finds those of one item;
    None if the engine tells none.
    `signed`: negative distances are penetration depths.
    """

    def record(answer: Distances | Booleans, i: int) -> Record:
        sides = _item(a, i), _item(b, i)
        if poses_ab is not None:
            sides[1].update(_pose(poses_ab[i]))
        claim: Record = {}
        if isinstance(answer, Booleans):
            if answer.certain[i]:
                claim["meets"] = bool(answer.value[i])
        elif answer.status[i] != DistanceStatus.UNSUPPORTED:
            if answer.lower[i] > 0.0 or answer.upper[i] <= 0.0:
                claim["meets"] = bool(answer.upper[i] <= 0.0)
            claim |= {"signed": signed} | {name: float(getattr(answer, name)[i]) for name in _INTERVAL}
            if signed:
                claim["upper"] = max(claim["upper"], _least_upper(*sides))
        if not claim or not all(side["kind"] in _POLYTOPES for side in sides):
            return _record("distance", *sides, {}, {})
        normal = answer.normal[i].tolist() if isinstance(answer, Distances) and signed else None
        return _record("distance", *sides, claim, evidence_of_distance(*sides, _listed(simplex, i), normal))

    return record


_INTERVAL = ("lower", "distance", "upper")
_POLYTOPES = ("box", "frustum", "hull", "polygon", "sphere", "capsule")  #: kinds that are such, but for a radius


def _least_upper(a: Record, b: Record) -> float:
    """Least upper bound that can be proven: of overlapping cores no depth is, only that of the radii around them."""
    p, q = a.get("radius", 0.0), b.get("radius", 0.0)
    return 0.0 - (math.nextafter(p + q, 0.0) if p and q else p + q)


def certify_contacts(a: Any, b: Any, velocities: tuple[FloatArray, FloatArray], t_max: float) -> Prover:
    """Records of `FirstContacts`."""

    def record(answer: FirstContacts, i: int) -> Record:
        sides = _item(a, i), _item(b, i)
        for side, velocity in zip(sides, velocities, strict=True):
            side["velocity"] = velocity[0 if len(velocity) == 1 else i].tolist()
        if not answer.certain[i]:
            return _record("first_contact", *sides, {}, {})
        status = ContactStatus(int(answer.status[i])).name
        claim: Record = {"status": status, "t_max": t_max}
        if status != "NEVER":
            claim |= {name: float(getattr(answer, name)[i]) for name in ("time_lower", "time", "time_upper")}
        near: dict[str, Any] = {}
        if not isinstance(a, Polygons) and status != "NEVER":
            near = {"begin": claim["time_lower"], "normal": answer.normal[i].tolist()}
        return _record("first_contact", *sides, claim, evidence_of_contact(*sides, status, t_max, **near))

    return record


def without_claim(query: str, a: Any, b: Any) -> Record:
    """Record of bodies about which nothing is proven."""
    return _record(query, _item(a, 0), _item(b, 0), {}, {})


def _record(query: str, a: Record, b: Record, claim: Record, evidence: Record) -> Record:
    return {"query": query, "a": a, "b": b, "claim": claim, "evidence": evidence}


def _listed(simplex: Pairs | Callable[[int], Pairs] | None, i: int) -> list[list[int]]:
    if simplex is None:
        return []
    return _used(simplex(i) if callable(simplex) else simplex[i])


def _used(pairs: Pairs) -> list[list[int]]:
    return [pair for pair in pairs.tolist() if pair[0] >= 0]


# ------------------------------------------------------------------------------------------------------- bodies


def _item(side: Any, i: int) -> Record:
    """Item i of a batch, or the only one; or a shape, in its own frame."""
    if isinstance(side, (Frustum, Frustum2D)):
        window = {"origin": side.origin.tolist(), "axes": side.axes.tolist(), "bounds": list(side.bounds)}
        return {"kind": "frustum", **window, "near": side.near, "far": side.far}
    if isinstance(side, Shape):
        return _shape(side)
    if isinstance(side, np.ndarray):  # points
        return {"kind": "hull", "vertices": side[i : i + 1].tolist()}
    i = 0 if len(side) == 1 else i
    if isinstance(side, Boxes):
        return _box(side.center[i], side.axes[i], side.half_extents[i])
    return {"kind": "polygon" if isinstance(side, Polygons) else "hull", "vertices": side[i].tolist()}


def _box(center: FloatArray, axes: FloatArray, half_extents: FloatArray) -> Record:
    return {"kind": "box", "center": center.tolist(), "axes": axes.tolist(), "half_extents": half_extents.tolist()}


def _shape(shape: Shape) -> Record:
    if isinstance(shape, Sphere):
        return {"kind": "sphere", "radius": shape.radius}
    if isinstance(shape, Capsule):
        return {"kind": "capsule", "half_length": shape.length / 2.0, "radius": shape.radius}
    if isinstance(shape, Box):
        return _box(np.zeros(3), np.eye(3), shape.half_extents)
    if isinstance(shape, (Convex, Point, Segment, Triangle)):
        return {"kind": "hull", "vertices": shape.vertices.tolist()}
    return {"kind": shape.kind}  # nothing is claimed of it


def _pose(row: FloatArray) -> Record:
    """Where body b is in the frame of a, as the engine reads it: the nine numbers of the rotation are literal."""
    return {"rotation": _validate.rotation_matrices(row[None, 3:])[0].tolist(), "translation": row[:3].tolist()}
