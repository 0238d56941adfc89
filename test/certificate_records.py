# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""Certificates made by the oracle, slowly; whether what a record claims is true; and ways to falsify one."""

from __future__ import annotations

import copy
import math
from collections.abc import Iterator
from fractions import Fraction
from itertools import product
from typing import Any

from oracle import frustum_box, moving_polytope, polygon, polytope
from oracle.vectors import Vector, add, compare_root, dot, exact, nearest_double, root_bracket, scale, sub

from geomsrv.evidence import evidence_of_contact

Record = dict[str, Any]

# ------------------------------------------------------------------------------------------------------- bodies


def vertices(body: Record) -> list[Vector]:
    """Vertices of a body without its radius, exactly, in the order that certificates number them."""
    kind = body["kind"]
    if kind == "box":
        points = polytope.box_corners(body["center"], body["axes"], body["half_extents"])
    elif kind == "frustum":
        points = _frustum_corners(body)
    elif kind == "capsule":
        points = [(0, 0, sign * exact(body["half_length"])) for sign in (-1, 1)]
    else:
        points = [(0, 0, 0)] if kind == "sphere" else [exact(v) for v in body["vertices"]]
    if "rotation" in body:
        points = [tuple(dot(row, p) for row in exact(body["rotation"])) for p in points]
    return [add(exact(body["translation"]), p) for p in points] if "translation" in body else points


def _frustum_corners(body: Record) -> list[Vector]:
    origin, (*sides, view), bounds = exact(body["origin"]), exact(body["axes"]), exact(body["bounds"])
    near, far = exact(body["near"]), exact(body["far"])
    rays = [scale(near, view)]
    for k, axis in enumerate(sides):
        rays = [add(ray, scale(bound, axis)) for bound in bounds[2 * k : 2 * k + 2] for ray in rays]
    return [add(origin, scale(t, ray)) for t in (Fraction(1), far / near) for ray in rays]


def _in_space(points: list[Vector]) -> list[Vector]:
    return [(*p, 0) if len(p) == 2 else tuple(p) for p in points]


def radius(record: Record) -> Fraction:
    return sum((exact(record[side].get("radius", 0.0)) for side in "ab"), Fraction(0))


# ----------------------------------------------------------------------------------------------------- evidence


def simplex_of(a: list[Vector], b: list[Vector]) -> list[list[int]]:
    """Pairs of vertices (of a, of b) whose differences span a simplex that holds the nearest one."""
    a, b = _in_space(a), _in_space(b)
    simplex = [(a[0], b[0])]
    while True:  # polytope.nearest, which does not tell its simplex
        weights, total, simplex = polytope._least_norm(simplex)
        v = polytope._combine(weights, [sub(x, y) for x, y in simplex])
        x, y = min(a, key=lambda p: dot(p, v)), max(b, key=lambda p: dot(p, v))
        if dot(sub(x, y), v) * total >= dot(v, v):
            return [[a.index(p), b.index(q)] for p, q in simplex]
        simplex = [*simplex, (x, y)]


def gap(n: Vector, a: list[Vector], b: list[Vector]) -> Any:
    return min(dot(n, q) for q in b) - max(dot(n, p) for p in a)


def facets_of(a: list[Vector], b: list[Vector]) -> Iterator[list[list[int]]]:
    """Every two vertices of one body, with one of the other, as evidence names directions; first of all, none."""
    yield []
    yield from ([[i, 0], [k, 0]] for i, k in product(range(len(a)), repeat=2))
    yield from ([[0, j], [0, k]] for j, k in product(range(len(b)), repeat=2))


def directions_of(facet: list[list[int]], a: list[Vector], b: list[Vector], speed: Vector) -> list[Vector]:
    """What a facet stands for: directions across it or, if it is a point, along the axes; and always the velocity's."""
    x, y = speed
    found = [(x, y), (y, -x)]
    if facet:
        (i, j), (k, m) = facet
        x, y = sub(sub(b[m], a[k]), sub(b[j], a[i]))
        found += [(y, -x)] if x or y else [(1, 0), (0, 1)]
    return [scale(sign, n) for n in found if any(n) for sign in (1, -1)]


def around(a: list[Vector], b: list[Vector]) -> list[list[int]]:
    """The corners of b - a, counter-clockwise."""
    differences = {sub(q, p): [i, j] for i, p in enumerate(a) for j, q in enumerate(b)}
    return [differences[corner] for corner in polygon.hull(list(differences))]


# ------------------------------------------------------------------------------------------------------- records


def distance_record(a: Record, b: Record) -> Record:
    """The oracle's distance of two bodies, negative if only their radii overlap; rounded down and up."""
    points_a, points_b = vertices(a), vertices(b)
    record: Record = {"query": "distance", "a": a, "b": b, "evidence": {"simplex": simplex_of(points_a, points_b)}}
    square = polytope.squared_distance(_in_space(points_a), _in_space(points_b))
    low, high = (x - radius(record) if square else Fraction(0) for x in root_bracket(square))
    meets = compare_root(radius(record), square) >= 0
    lower, upper = _below(low), _above(high)
    record["claim"] = {"meets": meets, "signed": square > 0, "lower": lower, "distance": lower, "upper": upper}
    return record


def _below(x: Fraction) -> float:
    value = nearest_double(x)
    return math.nextafter(value, -math.inf) if value > x else value


def _above(x: Fraction) -> float:
    return -_below(-x)


def cull_record(frustum: Record, box: Record) -> Record:
    corners, points = vertices(frustum), vertices(box)
    state = true_state(frustum, box)
    evidence: Record = {}
    if state != "INSIDE":
        evidence["simplex"] = simplex_of(corners, points)
    if state == "INTERSECTS":
        # The oracle's order of planes is right, left, down, up, near, far.
        planes = [frustum_box.frustum_planes(*_numbers(frustum))[k] for k in (4, 5, 1, 0, 3, 2)]
        evidence["beyond"] = next(
            [i, k] for i, p in enumerate(points) for k, (n, d) in enumerate(planes) if dot(n, p) > d
        )
    return {"query": "cull", "a": frustum, "b": box, "claim": {"state": state}, "evidence": evidence}


def contact_record(a: Record, b: Record, t_max: float) -> Record:
    found = true_contact(a, b, t_max)
    points_a, points_b = vertices(a), vertices(b)
    speed = sub(exact(b["velocity"]), exact(a["velocity"]))
    claim: Record = {"status": found.status, "t_max": t_max}
    evidence: Record = {}
    if found.time is not None:
        low, high = _below(found.time), _above(found.time)
        claim |= {"time_lower": low, "time": low, "time_upper": high}
        moved = [add(q, scale(found.time, speed)) for q in points_b]
        evidence["simplex"] = simplex_of(points_a, moved)
    if found.status == "OVERLAPPING":
        evidence = {"around": around(points_a, points_b)}
    else:

        def proves(n: Vector) -> bool:
            room, closing = gap(n, points_a, points_b), -dot(n, speed)
            if found.status == "NEVER":
                return room > 0 and (closing <= 0 or room > exact_or_inf(t_max) * closing)
            if found.status == "TOUCHING":
                return room == 0
            return room > 0 and closing > 0 and room == found.time * closing

        ways = (
            facet
            for facet in facets_of(points_a, points_b)
            if any(map(proves, directions_of(facet, points_a, points_b, speed)))
        )
        if facet := next(ways):
            evidence["facet"] = facet
    return {"query": "first_contact", "a": a, "b": b, "claim": claim, "evidence": evidence}


def space_contact_record(a: Record, b: Record, t_max: float) -> Record:
    """The oracle's answer; what proves it in space are searches of the checker's own kind."""
    found = true_contact(a, b, t_max)
    claim: Record = {"status": found.status, "t_max": t_max}
    near: Record = {}
    if found.time is not None:
        low, high = _below(found.time), _above(found.time)
        claim |= {"time_lower": low, "time": low, "time_upper": high}
        near["begin"] = low
    evidence = evidence_of_contact(a, b, found.status, t_max, **near)
    return {"query": "first_contact", "a": a, "b": b, "claim": claim, "evidence": evidence}


def exact_or_inf(x: float) -> Any:
    return x if math.isinf(x) else Fraction(x)


# --------------------------------------------------------------------------------------------------------- truth


def _numbers(frustum: Record) -> tuple[Any, ...]:
    return tuple(frustum[name] for name in ("origin", "axes", "bounds", "near", "far"))


def true_state(frustum: Record, box: Record) -> str:
    return frustum_box.state(_numbers(frustum), tuple(box[name] for name in ("center", "axes", "half_extents")))


def true_contact(a: Record, b: Record, t_max: float) -> polygon.FirstContact:
    if len(a["velocity"]) == 2:
        return polygon.first_contact(a["vertices"], a["velocity"], b["vertices"], b["velocity"], t_max)
    sides = vertices(a), a["velocity"], vertices(b), b["velocity"]
    return moving_polytope.first_contact(*sides, t_max, contact=False)


def is_true(record: Record) -> bool:
    """Whether all that a record claims is so, whatever its evidence."""
    claim, a, b = record["claim"], record["a"], record["b"]
    if record["query"] == "cull":
        return claim.get("state") in (None, true_state(a, b))
    if record["query"] == "first_contact":
        if claim.get("status") is None:
            return True
        found = true_contact(a, b, claim["t_max"])
        times = found.time is None or (
            claim["time_lower"] <= found.time <= claim["time_upper"]
            and claim["time_lower"] <= claim["time"] <= claim["time_upper"]
        )
        return claim["status"] == found.status and times
    square = polytope.separation(_in_space(vertices(a)), _in_space(vertices(b))).signed_square
    room = radius(record)
    if claim.get("meets") not in (None, compare_root(room, square) >= 0):
        return False
    if "distance" not in claim:
        return True

    def side(bound: float) -> int:  # sign of bound - distance
        if not claim.get("signed") and compare_root(room, square) >= 0:
            return (bound > 0) - (bound < 0)
        return compare_root(bound if math.isinf(bound) else Fraction(bound) + room, square)

    return side(claim["lower"]) <= 0 <= side(claim["upper"]) and claim["lower"] <= claim["distance"] <= claim["upper"]


# ------------------------------------------------------------------------------------------------------ falsified


def falsified(record: Record, *parts: str) -> Iterator[tuple[str, Record]]:
    """Records with one thing changed in the named parts, and words about what."""
    for part in parts:
        for path, value in _leaves(record[part], (part,)):
            for other in _others(value):
                changed = copy.deepcopy(record)
                _parent(changed, path)[path[-1]] = other
                yield f"{'.'.join(map(str, path))}: {value!r} -> {other!r}", changed
    for name, rows in record["evidence"].items() if "evidence" in parts else ():
        for k, row in enumerate(rows if isinstance(rows, list) and rows and isinstance(rows[0], list) else ()):
            fewer, swapped = copy.deepcopy(record), copy.deepcopy(record)
            del fewer["evidence"][name][k]
            swapped["evidence"][name][k] = row[::-1]
            yield f"{name} without row {k}", fewer
            yield f"{name} with row {k} backwards", swapped


def _leaves(value: Any, path: tuple[Any, ...]) -> Iterator[tuple[tuple[Any, ...], Any]]:
    if isinstance(value, (dict, list)):
        for key, item in value.items() if isinstance(value, dict) else enumerate(value):
            yield from _leaves(item, (*path, key))
    else:
        yield path, value


def _parent(value: Any, path: tuple[Any, ...]) -> Any:
    for key in path[:-1]:
        value = value[key]
    return value


WORDS = ("OUTSIDE", "INTERSECTS", "INSIDE", "NEVER", "WILL_TOUCH", "TOUCHING", "OVERLAPPING")


def _others(value: Any) -> Iterator[Any]:
    if isinstance(value, bool):
        yield not value
    elif isinstance(value, str):
        yield from (word for word in WORDS if word != value)
    elif isinstance(value, int):
        yield from (k for k in (*range(-1, 9), 10**6) if k != value)
    else:
        moved = (math.nextafter(value, math.inf), math.nextafter(value, -math.inf), value * 1.25, value + 1.0)
        for other in (*moved, value - 1.0, -value, 0.0, math.inf, -math.inf, math.nan):
            if other != value:
                yield other
