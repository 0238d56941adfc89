# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""The exact answer to a generated case, and how far it is from being another one; by the oracle only."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from typing import Any

from oracle import frustum_box, moving_polytope, point_frustum, polygon, polytope
from oracle.turning import apart_until, meet_at
from oracle.vectors import Vector, add, dot, exact, scale, squared_norm, sub

from geomsrv.answers import ContactStatus, CullState
from geomsrv.hard_cases import Motion, Truth, decides, time_scale
from hard import turning
from hard.frustum_box import corners, literal_frustum


def truth_of(kind: str, given: dict[str, Any]) -> Truth:
    """What is right, and whether doubles must see it."""
    return TRUTHS[kind](given)


def extent(*bodies: Sequence[Vector]) -> Fraction:
    """Longest side of the bounding box of all points."""
    points = [exact(p) for body in bodies for p in body]
    return max(max(x) - min(x) for x in zip(*points, strict=True))


def reach(origin: Vector, points: Sequence[Vector]) -> Fraction:
    """Largest coordinate as seen from the origin."""
    return max((abs(x) for p in points for x in sub(p, origin)), default=Fraction(0))


def of_separation(found: Any, size: Fraction) -> Truth:
    square = found.signed_square
    return Truth(square, square, size, decides(square, size))


def of_frustum_box(given: dict[str, Any]) -> Truth:
    view, body = literal_frustum(given["frustum"]), given["box"]
    eye, hull, box = exact(view[0]), corners(given["frustum"]), corners(body)
    state = frustum_box.state(view, (body["C"], body["A"], body["e"]))
    found = polytope.separation(hull, box)
    # A large far counts where it matters: as far as the box and the nearest frustum point are from the eye.
    size = reach(eye, [*box, found.point_a, *hull[:4]])
    margins = [found.signed_square]
    if state != frustum_box.OUTSIDE:
        margins.append(room_square(view, box))
    square = found.signed_square
    return Truth(square, square, size, all(decides(m, size) for m in margins), CullState[state])


def of_frustum_box_distance(given: dict[str, Any]) -> Truth:
    hull, box = corners(given["frustum"]), corners(given["box"])
    return of_separation(polytope.separation(hull, box), extent(hull, box))


def room_square(view: tuple[Any, ...], box: Sequence[Vector]) -> Fraction:
    """Signed square of how far the box reaches out of the frustum (< 0), or stays within its planes."""
    rooms = []
    for n, d in frustum_box.frustum_planes(*view):
        room = d - max(dot(n, p) for p in box)
        rooms.append(Fraction(room * abs(room)) / squared_norm(n))
    return min(rooms)


def of_point_frustum(given: dict[str, Any]) -> Truth:
    view, point = literal_frustum(given["frustum"]), exact(given["point"])
    found = point_frustum.nearest(*view, point)
    square = found.squared_distance
    if square == 0:
        square = -max(room_square(view, [point]), Fraction(0))
    hull = corners(given["frustum"])
    size = reach(exact(view[0]), [point, found.point, *hull[:4]])
    return Truth(square, square, size, decides(square, size))


def of_boxes(given: dict[str, Any]) -> Truth:
    a, b = corners(given["box0"]), corners(given["box1"])
    return of_separation(polytope.separation(a, b), extent(a, b))


def of_hulls(given: dict[str, Any]) -> Truth:
    a, b = exact(given["P"]), exact(given["Q"])
    return of_separation(polytope.separation(a, b), extent(a, b))


def of_polygons(given: dict[str, Any]) -> Truth:
    p, q = exact(given["P"]), exact(given["Q"])
    return of_separation(polygon.separation(p, q), extent(p, q))


def of_moving(given: dict[str, Any]) -> Truth:
    p, q, end = exact(given["P"]), exact(given["Q"]), exact(given["tmax"])
    velocity = sub(exact(given["velQ"]), exact(given["velP"]))
    found = polygon.first_contact(p, given["velP"], q, given["velQ"], end)
    # Yes or no hangs on how far P is from all that Q passes over; TOUCHING and OVERLAPPING on the start, too.
    swept = [*q, *(add(x, scale(end, velocity)) for x in q)]
    margin = polygon.separation(p, swept).signed_square
    size = extent(p, swept)
    decidable = decides(margin, size) and decides(found.separation_sq, extent(p, q))
    return Truth(margin, margin, size, decidable, motion=motion_of(found, extent(p, q)))


def of_moving_solids(given: dict[str, Any]) -> Truth:
    p, q = (exact(given[side]["vertices"]) for side in "PQ")
    end = exact(given["tmax"])
    velocity = sub(exact(given["velQ"]), exact(given["velP"]))
    found = moving_polytope.first_contact(p, given["velP"], q, given["velQ"], end)
    swept = [*q, *(add(x, scale(end, velocity)) for x in q)]
    margin = polytope.separation(p, swept).signed_square
    size = extent(p, swept)
    decidable = decides(margin, size) and decides(polytope.separation(p, q).signed_square, extent(p, q))
    return Truth(margin, margin, size, decidable, motion=motion_of(found, extent(p, q)))


def motion_of(found: polygon.FirstContact, size: Fraction) -> Motion:
    status = ContactStatus[found.status]
    if not found.hits:
        return Motion(status)
    return Motion(status, found.time, found.last_time, tuple(found.contact), time_scale(size, found.normal_speed_sq))


#: Steps of the oracle, after which it leaves open what happens later: most of those are grazes.
MOST_STEPS = 120


def of_turning(given: dict[str, Any]) -> Truth:
    """By 240 bits: what is on both sides of first contact, or apart throughout."""
    a, b = turning.bodies(given)
    size, end = extent(a.vertices, b.vertices), Fraction(given["tmax"])
    # In the plane, polygons that overlap are no flat hulls that touch.
    rings = [[tuple(map(Fraction, v)) for v in given[side]["vertices"]] for side in "PQ"]
    start = (polygon if len(rings[0][0]) == 2 else polytope).separation(*rings).signed_square
    if start <= 0:
        # What only touches may part at once: then nobody can prove contact.
        status = ContactStatus.OVERLAPPING if start else ContactStatus.TOUCHING
        return Truth(start, start, size, decides(start, size), motion=Motion(status, Fraction(0), Fraction(0)))
    apart = apart_until(a, b, end, MOST_STEPS)
    if apart >= end:
        return Truth(Fraction(1), Fraction(1), size, False, motion=Motion(ContactStatus.NEVER))
    for k in range(110, 6, -4):
        if (met := apart + Fraction(1, 1 << k)) <= end and meet_at(a, b, met):
            # Who comes into contact at once and is in contact a thousandth later, does not graze.
            later = apart * Fraction(1001, 1000)
            deep = decides(start, size) and k > 40 and later <= end and meet_at(a, b, later)
            hit = Motion(ContactStatus.WILL_TOUCH, apart, time_upper=met)
            return Truth(Fraction(-1), Fraction(-1), size, deep, motion=hit)
    return Truth(Fraction(-1), Fraction(1), size, False, motion=Motion(ContactStatus.GRAZING, apart))


TRUTHS = {
    "frustum_box": of_frustum_box,
    "frustum_box_distance": of_frustum_box_distance,
    "point_frustum": of_point_frustum,
    "box_box_distance": of_boxes,
    "polytope_distance": of_hulls,
    "polygon2d_distance": of_polygons,
    "polygon2d_moving": of_moving,
    "polyhedra_moving": of_moving_solids,
    "polygon2d_turning": of_turning,
    "polyhedra_turning": of_turning,
}
