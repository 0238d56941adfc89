# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""Inputs, answer and evidence as records that `geomsrv.verify` proves; docs/certificates.md tells what they mean.

While a query is answered nothing happens here: a record is written from the arrays when it is read.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from geomsrv import _validate
from geomsrv.answers import Booleans, ContactStatus, Cull, CullState, Distances, Evidence, FirstContacts, Record
from geomsrv.shapes import Box, Boxes, Capsule, Convex, Frustum, Frustum2D, Polygons, Shape, Sphere

__all__ = ["evidence_of_contacts", "evidence_of_cull", "evidence_of_distances", "without_claim"]

FloatArray = NDArray[np.float64]
Rows = NDArray[Any]


def evidence_of_cull(frustum: Frustum, boxes: Boxes, simplex: Rows, beyond: Rows) -> Evidence:
    """Records of a `Cull`: `simplex` (n, k, 2) pairs of corners, `beyond` (n, 2) corner and plane."""

    def record(answer: Cull, i: int) -> Record:
        state = CullState(int(answer.state[i]))
        claim, evidence = {"state": state.name} if answer.certain[i] else {}, {}
        if state != CullState.INSIDE:
            evidence["simplex"] = _pairs(simplex[i])
        if state == CullState.INTERSECTS:
            evidence["beyond"] = beyond[i].tolist()
        return _record("cull", _item(frustum, i), _item(boxes, i), claim, evidence)

    return Evidence(len(simplex), record)


def evidence_of_distances(
    a: Any, b: Any, simplex: Rows, *, poses_ab: FloatArray | None = None, signed: bool = False, normals: bool = True
) -> Evidence:
    """Records of `Distances` or `Booleans` of batches, or of shapes with poses: `simplex` (n, k, 2) pairs of vertices.

    `signed`: negative distances are penetration depths.  `normals`: the answer's normals are evidence too.
    """

    def record(answer: Distances | Booleans, i: int) -> Record:
        sides = _item(a, i), _item(b, i)
        if poses_ab is not None:
            sides[1].update(_pose(poses_ab[0 if len(poses_ab) == 1 else i]))
        evidence: Record = {"simplex": _pairs(simplex[i])}
        if isinstance(answer, Booleans):
            claim: Record = {"meets": bool(answer.value[i])} if answer.certain[i] else {}
            return _record("distance", *sides, claim, evidence)
        lower, value, upper = (float(column[i]) for column in (answer.lower, answer.distance, answer.upper))
        if normals and np.isfinite(answer.normal[i]).all():
            evidence["directions"] = [answer.normal[i].tolist()]
        if not lower <= upper:  # unsupported
            return _record("distance", *sides, {}, {})
        claim = {"meets": lower <= 0.0} if lower > 0.0 or upper <= 0.0 else {}
        claim |= {"signed": signed, "lower": lower, "distance": value, "upper": max(upper, _least_upper(*sides))}
        return _record("distance", *sides, claim, evidence)

    return Evidence(len(simplex), record)


def _least_upper(a: Record, b: Record) -> float:
    """Least upper bound that can be proven: of overlapping cores no depth is, only that of the radii around them."""
    p, q = a.get("radius", 0.0), b.get("radius", 0.0)
    return -math.nextafter(p + q, 0.0) if p and q else -(p + q)


def evidence_of_contacts(
    a: Polygons, b: Polygons, velocities: tuple[FloatArray, FloatArray], t_max: float, axis: Rows, simplex: Rows
) -> Evidence:
    """Records of `FirstContacts` of polygons: `axis` (n, 4) side, i, j, k and `simplex` (n, k, 2) pairs of vertices."""

    def record(answer: FirstContacts, i: int) -> Record:
        sides = _item(a, i), _item(b, i)
        for side, velocity in zip(sides, velocities, strict=True):
            side["velocity"] = velocity[0 if len(velocity) == 1 else i].tolist()
        status = ContactStatus(int(answer.status[i]))
        claim: Record = {"status": status.name, "t_max": t_max}
        evidence: Record = {"axis": axis[i].tolist()}
        if status != ContactStatus.NEVER:
            claim |= {name: float(getattr(answer, name)[i]) for name in ("time_lower", "time", "time_upper")}
            evidence["simplex"] = _pairs(simplex[i])
        return _record("first_contact", *sides, claim, evidence)

    return Evidence(len(simplex), record)


def without_claim(query: str, a: Any, b: Any) -> Record:
    """Record of bodies about which nothing is proven."""
    return _record(query, _item(a, 0), _item(b, 0), {}, {})


def _record(query: str, a: Record, b: Record, claim: Record, evidence: Record) -> Record:
    return {"query": query, "a": a, "b": b, "claim": claim, "evidence": evidence}


def _pairs(rows: Rows) -> list[list[int]]:
    """Pairs of vertices; rows that are not needed hold -1."""
    return [pair for pair in rows.tolist() if pair[0] >= 0]


# ------------------------------------------------------------------------------------------------------- bodies


def _item(side: Any, i: int) -> Record:
    """Item i of a batch, or the only one; or a shape, in its own frame."""
    if isinstance(side, (Frustum, Frustum2D)):
        flat = {"origin": side.origin.tolist(), "axes": side.axes.tolist(), "bounds": list(side.bounds)}
        return {"kind": "frustum", **flat, "near": side.near, "far": side.far}
    if isinstance(side, Shape):
        return _shape(side)
    if isinstance(side, np.ndarray):  # points
        return {"kind": "hull", "vertices": side[i : i + 1].tolist()}
    i = 0 if len(side) == 1 else i
    if isinstance(side, Boxes):
        return _box(side.center[i], side.axes[i], side.half_extents[i])
    return {"kind": "polygon" if isinstance(side, Polygons) else "hull", "vertices": side[i].tolist()}


def _box(center: FloatArray, axes: FloatArray, half_extents: FloatArray) -> Record:
    return {
        "kind": "box",
        "center": center.tolist(),
        "axes": axes.tolist(),
        "half_extents": half_extents.tolist(),
    }


def _shape(shape: Shape) -> Record:
    if isinstance(shape, Sphere):
        return {"kind": "sphere", "radius": shape.radius}
    if isinstance(shape, Capsule):
        return {"kind": "capsule", "half_length": shape.length / 2.0, "radius": shape.radius}
    if isinstance(shape, Box):
        return _box(np.zeros(3), np.eye(3), shape.half_extents)
    if isinstance(shape, Convex) or shape.kind in ("point", "segment", "triangle"):
        return {"kind": "hull", "vertices": shape.vertices.tolist()}  # type: ignore[attr-defined]
    return {"kind": shape.kind}  # nothing is claimed of it


def _pose(row: FloatArray) -> Record:
    """Where body b is in the frame of a, as the engine reads it: the nine numbers of the rotation are literal."""
    return {"rotation": _validate.rotation_matrices(row[None, 3:])[0].tolist(), "translation": row[:3].tolist()}
