# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""First contact of listed pairs of objects of which one is a mesh: placed once, and from then on taken literally."""

from __future__ import annotations

from collections import Counter
from typing import Any

import numpy as np

from geomsrv import _core
from geomsrv.answers import BoolArray, IntArray
from geomsrv.narrow_phase import ContactRows, count_kinds, placed, placed_boxes, placed_hulls
from geomsrv.queries import SOLID_MOTION_TIERS, first_contact
from geomsrv.shapes import Boxes, Mesh, Polytopes
from geomsrv.world import World

__all__ = ["mesh_contacts", "sliding_meshes"]


def sliding_meshes(world: World, pairs: IntArray, horizon: float) -> BoolArray:
    """(k,) bool: meshes, and boxes, hulls or meshes, that translate and are exactly where they are said to be."""
    meshes = world.kinds == _core.shape_kinds().index(Mesh.kind)
    if not meshes.any():
        return np.zeros(len(pairs), np.bool_)
    known = (meshes | world.polyhedra) & (world.uncertainty == 0.0) & (world.velocity_uncertainty == 0.0)
    if horizon > 0.0:
        known &= ~world.turns
    sliding: BoolArray = meshes[pairs].any(axis=1) & known[pairs].all(axis=1)
    return sliding


def mesh_contacts(
    world: World, pairs: IntArray, horizon: float, tier: str, counts: Counter[str], contact_set: bool = True
) -> ContactRows:
    """First contact of every such pair that has one; there is no kernel in single precision."""
    count_kinds(world, pairs, counts)
    tier = tier if tier in SOLID_MOTION_TIERS else "float64"
    bodies: dict[int, Mesh | Boxes | Polytopes] = {}
    for row in np.unique(pairs).tolist():
        bodies[row] = _placed(world, row)
    how: dict[str, Any] = {"t_max": horizon, "accuracy": tier, "contact_set": contact_set}
    answers = [
        first_contact(bodies[i], bodies[j], world.twists[i, :3], world.twists[j, :3], **how) for i, j in pairs.tolist()
    ]
    for answer in answers:
        counts["pairs of pieces"] += answer.cost.counts.get("pairs of pieces", 0)
    points = np.empty(len(pairs), dtype=object)
    for k, answer in enumerate(answers):
        points[k] = answer.parts(0) or None

    def column(name: str) -> Any:
        return np.concatenate([getattr(answer, name) for answer in answers])

    rows = ContactRows(
        pairs,
        status=column("status"),
        time=column("time"),
        lower=column("time_lower"),
        upper=column("time_upper"),
        last_time=column("last_time"),
        normal=column("normal"),
        points=points,
        certain=column("certain"),
    )
    return rows.take(~np.isnan(rows.time))


def _placed(world: World, row: int) -> Mesh | Boxes | Polytopes:
    shape, one = world.table.shapes[world.shape[row]], np.array([row])
    if isinstance(shape, Mesh):
        return shape.with_vertices(placed(world, np.full(len(shape.vertices), row), shape.vertices))
    return (
        Boxes(*placed_boxes(world, one))
        if world.table.boxes[world.shape[row]]
        else Polytopes(*placed_hulls(world, one))
    )
