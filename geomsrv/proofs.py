# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""Certificates for objects of a world: each is asked about again, as a user would ask, in numbers taken literally.

What a scene answers covers more: the rounding of poses, and how far objects may be off.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial

import numpy as np

from geomsrv import _validate
from geomsrv.answers import Cull, Distances, FirstContacts, IntArray, gather, json_line
from geomsrv.certificates import without_claim
from geomsrv.narrow_phase import placed_hulls, relative_poses
from geomsrv.queries import cull, distance, first_contact
from geomsrv.shapes import Boxes, Frustum, Polygons, Polytopes
from geomsrv.world import AnyShape, World

__all__ = ["contact_certificates", "cull_certificates", "distance_certificates"]


def cull_certificates(world: World, rows: IntArray, frustum: Frustum, *, accuracy: str) -> Iterator[str]:
    """A line of JSON for each of the listed objects; what is no box, or may be elsewhere, claims nothing."""
    _validate.certificates(True, accuracy)
    known = world.table.boxes[world.shape[rows]] & (world.uncertainty[rows] == 0.0)
    own = rows[known]
    boxes = Boxes(world.poses[own, :3], world.rotations[own].swapaxes(1, 2), world.table.half[world.shape[own]])
    answer = cull(frustum, boxes, accuracy=accuracy, certificates=True)
    proven = _lines(answer)
    for row, is_known in zip(rows.tolist(), known.tolist(), strict=True):
        yield next(proven) if is_known else json_line(without_claim("cull", frustum, _shape(world, row)))


def distance_certificates(world: World, pairs: IntArray, *, want: Sequence[str], accuracy: str) -> Iterator[str]:
    """A line of JSON for each pair: b at its pose in the frame of a, or polygons in the plane, either rounded."""
    _validate.certificates(True, accuracy)
    ask = partial(distance, want=tuple(want), accuracy=accuracy, certificates=True)
    for (i, j), pose in zip(pairs.tolist(), relative_poses(world, pairs), strict=True):
        if world.planar[i] != world.planar[j]:
            yield json_line(without_claim("distance", _shape(world, i), _shape(world, j)))
        elif world.planar[i]:
            yield from _lines(ask(_ring(world, i), _ring(world, j)))
        else:
            yield from _lines(ask(_shape(world, i), _shape(world, j), pose))


def contact_certificates(world: World, pairs: IntArray, horizon: float, *, accuracy: str) -> Iterator[str]:
    """A line of JSON for each pair; what is not in translation, exactly known, and has a kernel, claims nothing."""
    _validate.certificates(True, accuracy)
    vague = ~(world.planar | world.polyhedra)
    vague |= (world.uncertainty > 0.0) | (world.velocity_uncertainty > 0.0)
    vague |= world.turns & (horizon > 0.0)
    for i, j in pairs.tolist():
        if vague[i] or vague[j] or world.planar[i] != world.planar[j]:
            yield json_line(without_claim("first_contact", _shape(world, i), _shape(world, j)))
        else:
            body, d = (_ring, 2) if world.planar[i] else (_solid, 3)
            sides = (body(world, i), body(world, j), world.twists[i, :d], world.twists[j, :d])
            answer = first_contact(*sides, t_max=horizon, accuracy=accuracy, contact_set=False, certificates=True)
            yield from _lines(answer)


def _lines(answer: Cull | Distances | FirstContacts) -> Iterator[str]:
    assert answer.certificates is not None  # they were asked for
    return answer.certificates.lines()


def _shape(world: World, row: int) -> AnyShape:
    return world.table.shapes[int(world.shape[row])]


def _ring(world: World, row: int) -> Polygons:
    return Polygons(*gather(*world.rings, np.array([row])))


def _solid(world: World, row: int) -> Boxes | Polytopes:
    """A box or a hull, as first contact sees it."""
    rows = np.array([row])
    if not world.table.boxes[world.shape[row]]:
        return Polytopes(*placed_hulls(world, rows))
    half = world.table.half[world.shape[rows]]
    return Boxes(world.poses[rows, :3], world.rotations[rows].swapaxes(1, 2), half)
