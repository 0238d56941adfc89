# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""Proves recorded answers in exact arithmetic; docs/certificates.md tells what a record holds and what it proves.

Shares no code with the engine and needs only this file.  Vectors are lists of int: given floats times a common scale.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from copy import copy
from fractions import Fraction
from itertools import combinations
from typing import Any

__all__ = ["CertificateError", "verify", "verify_lines", "verify_record"]

Vector = Sequence[int]
Fields = dict[str, Any]

dot: Callable[[Vector, Vector], int] = math.sumprod  # type: ignore[assignment]  # of int it is int, and exact


class CertificateError(ValueError):
    """A certificate does not prove the answer it came with."""


def verify(answer: Any) -> None:
    """Prove every item of an answer that was asked for with ``certificates=True``.

    Parameters
    ----------
    answer : Cull, Distances, Booleans or FirstContacts

    Raises
    ------
    CertificateError
        Names the item and what is not proven.
    """
    if (records := getattr(answer, "certificates", None)) is None:
        raise CertificateError("the answer carries no certificates; ask with certificates=True")
    for item, record in enumerate(records):
        try:
            verify_record(record)
        except CertificateError as fault:
            raise CertificateError(f"item {item}: {fault}") from None


def verify_lines(lines: Iterable[str]) -> Iterator[tuple[int, bool, str]]:
    """Prove records of JSON, one a line: yields line numbers, from 1, whether anything was claimed, and what failed."""
    for number, line in enumerate(lines, 1):
        try:
            record = json.loads(line)
            verify_record(record)
        except (ValueError, RecursionError) as fault:
            yield number, True, str(fault)
        else:
            yield number, bool(record["claim"]), ""


def verify_record(record: Fields) -> None:
    """Prove all that one record claims, or raise `CertificateError`; floats may be given as `float.hex` text."""
    checks = {"cull": _cull, "distance": _distance, "first_contact": _first_contact}
    try:
        check, a, b = checks[record["query"]], record["a"], record["b"]
        if record["claim"]:
            _require(check is _distance or not ("radius" in a or "radius" in b), "no radius is expected here")
            check(Pair(a, b), a, b, record["claim"], record["evidence"])
    except CertificateError:
        raise
    except (ArithmeticError, AttributeError, LookupError, RecursionError, TypeError, ValueError) as fault:
        raise CertificateError(f"not a well-formed record: {type(fault).__name__}: {fault}") from fault


def _require(condition: bool, text: str) -> None:
    if not condition:
        raise CertificateError(text)


# ------------------------------------------------------------------------------------------- numbers and bodies


def _float(number: Any) -> float:
    return float.fromhex(number) if isinstance(number, str) else float(number)


def _ratio(number: Any) -> tuple[int, int]:
    return _float(number).as_integer_ratio()


def unit_of(value: Any) -> int:
    """Smallest power of two, at least 1, that makes all the (nested) floats whole."""
    if isinstance(value, dict):
        value = [value[name] for name in value if name != "kind"]
    return max(map(unit_of, value), default=1) if isinstance(value, (list, tuple)) else _ratio(value)[1]


def in_units(value: Any, unit: int) -> Any:
    """The (nested) floats times the unit."""
    if isinstance(value, (list, tuple)):
        return [in_units(item, unit) for item in value]
    above, below = _ratio(value)
    return above * (unit // below)


def sum_of(a: Vector, factor: int, b: Vector) -> list[int]:
    """Vector a + factor * b."""
    return [x + factor * y for x, y in zip(a, b, strict=True)]


def _cross(a: Vector, b: Vector) -> list[int]:
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def _vertices(body: Fields, unit: int) -> tuple[list[Any], int]:
    """Vertices of a body without its radius times a scale > 0, and the scale, a multiple of the unit."""
    given = {name: in_units(body[name], unit) for name in body if name != "kind"}
    kind, scale = body["kind"], unit
    if kind == "box":  # vertex i has bit k set where half_extents[k] * axes[k] is added
        points = [[unit * x for x in given["center"]]]
        for half, axis in zip(given["half_extents"], given["axes"], strict=True):
            points = [sum_of(v, sign * half, axis) for sign in (-1, 1) for v in points]
        scale *= unit
    elif kind == "frustum":  # vertex i has bit k set at the upper bound along axes[k], the last bit on the far plane
        near, (*sides, view) = given["near"], given["axes"]
        _require(near > 0 and len(given["bounds"]) == 2 * len(sides), "not a frustum")
        rays = [[near * x for x in view]]
        for k, axis in enumerate(sides):
            rays = [sum_of(ray, bound, axis) for bound in given["bounds"][2 * k : 2 * k + 2] for ray in rays]
        apex = [near * unit * x for x in given["origin"]]  # times near, as are all vertices apex + depth / near * ray
        points = [sum_of(apex, depth, ray) for depth in (near, given["far"]) for ray in rays]
        scale *= unit * near
    elif kind == "capsule":
        points = [[0, 0, -given["half_length"]], [0, 0, given["half_length"]]]
    else:
        _require(kind in ("hull", "polygon", "sphere"), f"unknown kind {kind!r}")
        points = [[0, 0, 0]] if kind == "sphere" else given["vertices"]
    if "rotation" in given:
        points = [[dot(row, v) for row in given["rotation"]] for v in points]
        scale *= unit
    if "translation" in given:
        points = [sum_of(v, scale // unit, given["translation"]) for v in points]
    return points, scale


class Pair:
    """The vertices of two bodies on one scale."""

    def __init__(self, a: Fields, b: Fields) -> None:
        self.unit = max(unit_of(a), unit_of(b))
        (points_a, p), (points_b, q) = _vertices(a, self.unit), _vertices(b, self.unit)
        self.scale = math.lcm(p, q)
        self.a = [[self.scale // p * x for x in v] for v in points_a]
        self.b = [[self.scale // q * x for x in v] for v in points_b]
        _require({len(v) for v in self.a + self.b} in ({2}, {3}), "vectors of different or wrong length")

    def gap(self, along: Vector) -> int:
        """Room between the bodies along a direction, < 0 where they overlap; times its length and the scale."""
        lowest = min(dot(along, v) for v in self.b)
        return lowest - max(dot(along, v) for v in self.a)

    def differences(self, pairs: Sequence[Sequence[int]]) -> list[list[int]]:
        """Vertices of b minus vertices of a, of the listed pairs."""
        _require(all(0 <= i < len(self.a) and 0 <= j < len(self.b) for i, j in pairs), "evidence: no such vertices")
        return [sum_of(self.b[j], -1, self.a[i]) for i, j in pairs]

    def moved(self, speed: Vector, time: Fraction) -> Pair:
        """The bodies at that time, on a scale of their own; `speed` is that of b as seen from a, times the unit."""
        step, shift = self.unit * time.denominator, self.scale * time.numerator
        pair = copy(self)
        pair.a = [[step * x for x in v] for v in self.a]
        pair.b = [sum_of([step * x for x in v], shift, speed) for v in self.b]
        return pair


def _determinant(m: Sequence[Vector]) -> int:
    if not m:
        return 1
    minors = ([[*row[:k], *row[k + 1 :]] for row in m[1:]] for k in range(len(m)))
    return sum((-1) ** k * m[0][k] * _determinant(minor) for k, minor in enumerate(minors))


def nearest(points: Sequence[Vector]) -> tuple[list[int], int, Sequence[int]]:
    """The point v of a simplex nearest to the origin: whole * v, whole > 0, and which corners v is a mixture of."""
    _require(1 <= len(points) <= 4, "simplex: not one to four pairs")
    found: list[tuple[list[int], int, Sequence[int]]] = []
    for size in range(len(points), 0, -1):
        for chosen in combinations(range(len(points)), size):
            corners = [points[i] for i in chosen]
            # Foot of the origin on the plane through the corners: normal equations, Cramer's rule.
            arms = [sum_of(p, -1, corners[0]) for p in corners[1:]]
            rows = [[dot(p, q) for q in (*arms, corners[0])] for p in arms]
            whole = _determinant([row[:-1] for row in rows])
            weights = [_determinant([[*row[:k], -row[-1], *row[k + 1 : -1]] for row in rows]) for k in range(len(arms))]
            weights = [whole - sum(weights), *weights]
            if whole > 0 and min(weights) >= 0:
                kept = [i for i, weight in zip(chosen, weights, strict=True) if weight]
                found.append(([dot(weights, x) for x in zip(*corners, strict=True)], whole, kept))
        if found and size == len(points):
            break  # no smaller face holds a nearer one
    return min(found, key=lambda foot: Fraction(dot(foot[0], foot[0]), foot[1] ** 2))


def normals_to(corners: Sequence[Vector]) -> list[list[int]]:
    """Both directions across a facet; of corners that span less, some of those across them."""
    size = len(corners[0])
    arms = [sum_of(p, -1, corners[0]) for p in corners[1:size]]
    if len(arms) < size - 1 or not any(arms[0] if size == 2 else _cross(*arms)):
        arms += [[int(i == k) for i in range(size)] for k in range(size)]
    normals = [[y, -x] for x, y in arms] if size == 2 else [_cross(p, q) for p, q in combinations(arms, 2)]
    return [[sign * x for x in n] for n in normals for sign in (1, -1) if any(n)]


# ------------------------------------------------------------------------------------------------------- claims


def _distance(pair: Pair, a: Fields, b: Fields, claim: Fields, evidence: Fields) -> None:
    """Signed distance s of two bodies: lower <= s <= upper; unless "signed", 0 stands for all s < 0."""
    v, whole, _ = nearest(pair.differences(evidence["simplex"]))
    radii = [_float(body.get("radius", 0.0)) for body in (a, b)]
    _require(min(radii) >= 0.0, "negative radius")
    radius = sum(map(Fraction, radii))
    # v is a difference of points of the cores: s <= |v| - radius.  Along any n: s >= gap / |n| - radius.
    directions = [v, *(in_units(n, unit_of(n)) for n in evidence.get("directions", ()))]
    if "facet" in evidence:
        directions += normals_to(pair.differences(evidence["facet"]))
    gaps = [(pair.gap(n), pair.scale**2 * dot(n, n)) for n in directions if any(n)]

    def at_least(bound: float, strict: bool = False) -> bool:
        level = Fraction(bound) + radius
        sides = [(level * abs(level) * squared, gap * abs(gap)) for gap, squared in gaps]
        return any(x < y if strict else x <= y for x, y in sides)

    def at_most(bound: float) -> bool:
        level = Fraction(bound) + radius
        return level >= 0 and dot(v, v) <= (level * whole * pair.scale) ** 2

    meets = claim.get("meets")
    if meets is not None:
        _require(at_most(0.0) if meets else at_least(0.0, strict=True), "they meet" if meets else "they do not meet")
    if "distance" in claim:
        lower, value, upper = (_float(claim[name]) for name in ("lower", "distance", "upper"))
        _require(lower <= value <= upper, "lower <= distance <= upper does not hold")
        signed = claim.get("signed", False)
        _require((lower <= 0.0 and not signed) or lower == -math.inf or at_least(lower), "lower is not proven")
        _require((upper >= 0.0 or signed) and (upper == math.inf or at_most(upper)), "upper is not proven")


# Corners of a frustum's faces near, far, left (+L), right, up (+U), down.
_SIDES = ((2, 0), (2, 1), (0, 1), (0, 0), (1, 1), (1, 0))
_FACES = [[i for i in range(8) if i >> bit & 1 == side] for bit, side in _SIDES]


def _face(corners: Sequence[Vector], plane: int) -> tuple[list[int], int]:
    """The half space n . x <= d that a face of a frustum bounds: n and d."""
    p, q, r = (corners[i] for i in _FACES[plane][:3])
    n = _cross(sum_of(q, -1, p), sum_of(r, -1, p))
    heights = [dot(n, sum_of(v, -1, p)) for i, v in enumerate(corners) if i not in _FACES[plane]]
    _require(min(heights) > 0 or max(heights) < 0, "a is not a frustum")
    outward = [-x for x in n] if heights[0] > 0 else n
    return outward, dot(outward, p)


def _cull(pair: Pair, a: Fields, b: Fields, claim: Fields, evidence: Fields) -> None:
    """Box b is OUTSIDE frustum a, INSIDE, or INTERSECTS it: has points in it and others beyond it."""
    state, (corner, plane) = claim["state"], evidence.get("beyond", (0, 0))
    _require(a["kind"] == "frustum" and len(pair.a) == 8 == len(pair.b), "not a frustum and a box")
    _require(0 <= corner < 8 and 0 <= plane < 6, "beyond: no such corner or plane")
    v = nearest(pair.differences(evidence["simplex"]))[0] if "simplex" in evidence else None

    def within(*points: Vector, times: int = 1) -> bool:
        faces = [_face(pair.a, k) for k in range(6)]
        return all(dot(n, point) <= times * d for n, d in faces for point in points)

    def beyond(*points: Vector) -> bool:
        n, d = _face(pair.a, plane)
        return all(dot(n, point) > d for point in points)

    if state == "INSIDE":
        _require(within(*pair.b), "INSIDE: a corner is beyond a plane")
    elif state == "OUTSIDE":
        _require(pair.gap(v) > 0 if v else beyond(*pair.b), "OUTSIDE: not apart along the direction")
    else:
        _require(state == "INTERSECTS" and beyond(pair.b[corner]), f"{state}: the corner is not beyond the plane")
        if v is None:  # a corner of the box, or without one its centre
            inside = evidence["inside"]
            common = within(pair.b[inside[0]]) if inside else within(sum_of(pair.b[0], 1, pair.b[7]), times=2)
        else:
            common = not any(v)
        _require(common, "INTERSECTS: no common point")


def relative_velocity(a: Fields, b: Fields, unit: int) -> list[int]:
    """Velocity of b as seen from a, times the unit."""
    return sum_of(in_units(b["velocity"], unit), -1, in_units(a["velocity"], unit))


def clip_of(pair: Pair, speed: Vector, n: Vector) -> tuple[int, Fraction | None]:
    """The gap along a direction, and the time when it has closed; None if it stays."""
    gap, closing = pair.gap(n), -dot(n, speed)
    time = Fraction(gap * pair.unit, closing * pair.scale) if closing > 0 else None
    return gap, time if gap > 0 else Fraction(0)


def clips_of(pair: Pair, speed: Vector, evidence: Fields) -> list[tuple[int, Fraction | None]]:
    """Gaps along, across the velocity and across the facet, each with the time when it has closed; None if it stays."""
    along = [n for m in (speed, [speed[1], -speed[0]]) for n in (m, [-x for x in m]) if any(n)]
    if "facet" in evidence:
        along += normals_to(pair.differences(evidence["facet"]))
    return [clip_of(pair, speed, n) for n in along]


def _first_contact(pair: Pair, a: Fields, b: Fields, claim: Fields, evidence: Fields) -> None:
    """Bodies that move at constant velocity: NEVER, WILL_TOUCH at time, TOUCHING or OVERLAPPING at 0."""
    status, t_max, time = claim["status"], _float(claim["t_max"]), Fraction(0)
    speed = relative_velocity(a, b, pair.unit)
    _require(len(speed) == len(pair.a[0]) and t_max >= 0.0, "velocities of another dimension, or t_max < 0")
    if status == "OVERLAPPING":
        room = _turns_around if len(speed) == 2 else _has_room
        _require(room(pair, evidence), "OVERLAPPING: the origin is not within the differences")
    else:
        if len(speed) == 2:
            clips = clips_of(pair, speed, evidence)
        else:
            _require(any(way := way_of(pair, speed, evidence)), f"{status}: there is no way between the bodies")
            clips = [clip_of(pair, speed, way)]
        if status == "NEVER":
            apart = any(gap > 0 and (closed is None or closed > t_max) for gap, closed in clips)
            _require(apart, "NEVER: not apart until t_max")
            return
        if status == "WILL_TOUCH":  # apart until the last gap has closed
            time = max((closed for _, closed in clips if closed), default=time)
            _require(0 < time <= t_max, "WILL_TOUCH: not apart at first, or longer than t_max")
        else:
            touching = status == "TOUCHING" and any(gap == 0 for gap, _ in clips)
            _require(touching, f"{status}: the depth is not 0")
        simplex = pair.moved(speed, time).differences(evidence["simplex"])
        _require(not any(nearest(simplex)[0]), f"{status}: no common point at that time")
    lower, value, upper = (_float(claim[name]) for name in ("time_lower", "time", "time_upper"))
    _require(lower <= value <= upper and lower <= time <= upper, "the time is not in [time_lower, time_upper]")


def _turns_around(pair: Pair, evidence: Fields) -> bool:
    """Whether each difference lies less than half a turn further round the origin than the one before."""
    around = pair.differences(evidence["around"])
    turns = [p[0] * q[1] - p[1] * q[0] for p, q in zip(around, around[1:] + around[:1], strict=True)]
    return bool(turns) and min(turns) > 0


ROOM = ((1, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1))  #: corners around the origin, which is inside


def _has_room(pair: Pair, evidence: Fields) -> bool:
    """Whether the bodies still have common points after b is moved by so much towards each of four corners."""
    size, simplices = _float(evidence["room"]), evidence["simplices"]
    moved = [aside(pair, [size * x for x in corner]) for corner in ROOM]
    meet = [not any(nearest(p.differences(s))[0]) for p, s in zip(moved, simplices, strict=True)]
    return size > 0.0 and all(meet)


def aside(pair: Pair, way: Sequence[Any]) -> Pair:
    """Body b moved by floats."""
    unit = unit_of(way)
    return pair.moved(in_units(way, unit), Fraction(pair.unit, unit))


def way_of(pair: Pair, speed: Vector, evidence: Fields) -> Vector:
    """In space: the shortest way from a to b, of the listed simplex, where `evidence` places them."""
    if "across" in evidence:  # as seen along the velocity
        square, points = dot(speed, speed), pair.differences(evidence["across"])
        return nearest([sum_of([square * x for x in p], -dot(p, speed), speed) for p in points])[0]
    moved = aside(pair, evidence["aside"]) if "aside" in evidence else pair.moved(speed, time_of(evidence))
    return nearest(moved.differences(evidence["apart"]))[0]


def time_of(evidence: Fields) -> Fraction:
    """The sum of floats, times a power of two where it is below them."""
    exponent = evidence.get("exponent", 0)
    _require(isinstance(exponent, int) and abs(exponent) < 10**4, "evidence: no such time")
    power: Fraction = Fraction(2) ** exponent
    return power * sum((Fraction(_float(part)) for part in evidence["at"]), Fraction(0))
