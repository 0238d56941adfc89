# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""Plane shapes that are not convex, and have holes, as the union of convex pieces whose corners are the given ones."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from itertools import combinations, product
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from geomsrv import _validate
from geomsrv.answers import Booleans, ContactStatus, Cost, Distances, FirstContacts, sets_end_to_end
from geomsrv.errors import GeometryError, NotAvailableError
from geomsrv.region_contact import (
    Moving,
    Part,
    Vector,
    begin,
    common_normal,
    common_parts,
    convex,
    exactly,
    inside_parts,
    nearest,
    rounded,
    united,
)
from geomsrv.shapes import FloatArray, Polygons, frozen
from geomsrv.turning import turns

__all__ = ["Region", "distance_regions", "first_contact_regions", "intersects_regions"]

Corner = tuple[int, int]  # in units so small that all coordinates are whole numbers


@dataclass(frozen=True, init=False, eq=False)
class Region:
    """Simple polygon with holes, in its own frame; convex or not.

    Parameters
    ----------
    outline : (m, 2) float
        Counter-clockwise ring [m] that does not touch itself.
    holes : list of (k, 2) float
        Rings inside of it, either way round, that touch neither it nor each other.

    Raises
    ------
    GeometryError
        Names the ring, the vertices and the fault.

    References
    ----------
    Ear clipping with bridges to the holes (Eberly, *Triangulation by Ear Clipping*, 2002), then merged across diagonals
    that no corner needs (Hertel, Mehlhorn, 1983): at most four times the fewest pieces.  All signs are exact.

    Examples
    --------
    >>> import geomsrv as gs
    >>> angle = gs.Region([(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)])
    >>> len(angle.pieces)
    2
    >>> frame = gs.Region([(0, 0), (4, 0), (4, 4), (0, 4)], [[(1, 1), (3, 1), (3, 3), (1, 3)]])
    >>> len(frame.pieces)
    4
    """

    outline: FloatArray
    holes: tuple[FloatArray, ...]

    def __init__(self, outline: ArrayLike, holes: Iterable[ArrayLike] = ()) -> None:
        rings = [_validate.floats(outline, "outline", (None, 2))]
        rings += [_validate.floats(hole, f"holes[{i}]", (None, 2)) for i, hole in enumerate(holes)]
        outline, *inner = map(frozen, rings)
        object.__setattr__(self, "outline", outline)
        object.__setattr__(self, "holes", tuple(inner))
        _check(self._whole)

    @cached_property
    def _unit(self) -> int:
        """One over the unit of `_whole`, a power of two."""
        numbers = (x for ring in (self.outline, *self.holes) for x in ring.ravel().tolist())
        return max((x.as_integer_ratio()[1] for x in numbers), default=1)

    @cached_property
    def _whole(self) -> list[list[Corner]]:
        """The outline and, clockwise, the holes, in whole numbers."""

        def whole(x: float) -> int:
            up, down = x.as_integer_ratio()
            return up * (self._unit // down)

        outline, *holes = ([(whole(x), whole(y)) for x, y in ring.tolist()] for ring in (self.outline, *self.holes))
        return [outline, *(ring[::-1] if _area(ring) > 0 else ring for ring in holes)]

    @cached_property
    def pieces(self) -> Polygons:
        """Convex polygons whose union it is; found on first use."""
        rings = _merged(_triangles(_bridged(self._whole)))
        found: Polygons = Polygons.from_list([[(x / self._unit, y / self._unit) for x, y in ring] for ring in rings])
        return found

    def on_border(self, point: ArrayLike) -> bool:
        """Whether a point is on a ring, exactly."""
        x, y = (Fraction(x) * self._unit for x in _validate.floats(point, "point", (2,)).tolist())
        return any(_on(a, b, (x, y)) for ring in self._whole for a, b in _edges(ring))


def first_contact_regions(
    ask: Callable[..., FirstContacts], a: Any, b: Any, velocities: tuple[Any, Any], options: dict[str, Any]
) -> FirstContacts:
    """The answer of `first_contact`, which is passed in, where a or b is a region: the first of all pairs of pieces."""
    start = time.perf_counter_ns()
    count = _common(a, b)
    if options["certificates"]:
        raise NotAvailableError("certificates of a Region are not available yet")
    wanted, options = options["contact_set"], {**options, "contact_set": True}
    for center, body in (("center_a", a), ("center_b", b)):
        if isinstance(body, Region) and options[center] is None:
            # All pieces turn about one point.
            options[center] = 0.5 * body.outline.min(axis=0) + 0.5 * body.outline.max(axis=0)
    found = [ask(one, two, *velocities, **options) for one, two in _pairs(a, b)]
    status, lower, upper, last, certain, middle = (
        np.array([getattr(answer, name) for answer in found])
        for name in ("status", "time_lower", "time_upper", "last_time", "certain", "time")
    )
    first = np.where(status == ContactStatus.NEVER, np.inf, lower).argmin(axis=0)
    every = np.arange(count)
    outcome, low, high = status[first, every], lower[first, every], np.fmin.reduce(upper, axis=0)
    outcome[(outcome == ContactStatus.GRAZING) & (high - low <= (options["tolerance"] or 0.0))] = (
        ContactStatus.WILL_TOUCH
    )
    overlap = status == ContactStatus.OVERLAPPING
    # Even if others do so too soon to be told apart.
    for at_once in (ContactStatus.TOUCHING, ContactStatus.OVERLAPPING):
        outcome[(status == at_once).any(axis=0)] = at_once
    normal = np.array([answer.normal for answer in found])[first, every]
    sure = certain.all(axis=0) | (overlap & certain).any(axis=0)
    ways = _rows(velocities, count)
    turning = turns(options["angular_velocity_a"], options["angular_velocity_b"])
    sets: list[list[FloatArray]] = [[] for _ in every]
    for i in np.flatnonzero(outcome != ContactStatus.NEVER).tolist():
        pieces = [found[k] for k in np.flatnonzero(lower[:, i] <= high[i])]
        bodies = _moving(a, i, ways[0][i]), _moving(b, i, ways[1][i])
        if outcome[i] == ContactStatus.TOUCHING and any(body.thin for body in bodies) and _inside(bodies)[1]:
            # On a seam, which is inside.
            outcome[i], sure[i] = ContactStatus.OVERLAPPING, True
        if turning or found[0].cost.accuracy == "bound":
            sets[i] = found[first[i]].parts(i)
        elif outcome[i] == ContactStatus.OVERLAPPING:
            normal[i], sets[i] = np.nan, _shared(bodies, pieces, i)
        else:
            sets[i], normal[i] = _contact(bodies, pieces, i, (low[i], high[i]))
    points, point_offsets, part_offsets = sets_end_to_end(sets if wanted else [[] for _ in every], 2)
    speeds = np.array([answer.closing_speed for answer in found])[first, every] if turning else _approach(ways, normal)
    return FirstContacts(
        status=outcome,
        time=np.clip(np.fmin.reduce(middle, axis=0), low, high),
        time_lower=low,
        time_upper=high,
        last_time=np.fmax.reduce(last, axis=0),
        normal=normal,
        points=points,
        point_offsets=point_offsets,
        certain=sure,
        _closing_speed=speeds,
        cost=_cost(found, start),
        _part_offsets=part_offsets,
    )


# A contact point found twice, from two pieces: a vertex moved by a product and a sum, up to the slack within which
# polygons of such coordinates touch; some 20 roundings of their size, rounded up.
PLACE_ROUNDING = 64.0 * 2.0**-53
SINGLE_PLACE_ROUNDING = 64.0 * 2.0**-24  # the same in float32


def _contact(
    bodies: tuple[Moving, Moving], pieces: list[FirstContacts], i: int, span: tuple[float, float]
) -> tuple[list[FloatArray], FloatArray]:
    """Contact set and normal of bodies that touch, from the pairs of pieces that do so first."""
    a, b = bodies
    if pieces[0].cost.accuracy == "exact":
        slack = Fraction(0)
        begun = begin(a, b, *span)
        assert begun is not None, "an edge touches first"
        moment, near = begun
        shares = common_parts(near, *((moment * x, moment * y) for x, y in (a.velocity, b.velocity)))
    else:
        times = [piece.time[i] for piece in pieces]
        moment = Fraction(min(times))
        parts = [part for piece in pieces for part in piece.parts(i)]
        shares = [exactly(part) for part in parts]
        size = max(float(np.abs(part).max()) for part in parts)
        size = max(size, *(float(abs(x)) for body in bodies for v in body.rings[0] for x in v))
        speed = max(abs(x) for body in bodies for x in body.velocity)
        rounding = SINGLE_PLACE_ROUNDING if pieces[0].cost.accuracy == "float32" else PLACE_ROUNDING
        slack = Fraction(rounding * size) + speed * (Fraction(max(times)) - moment)
    shares = united(shares, slack)
    normal = common_normal(shares, a.moved(moment), b.moved(moment), slack)
    unit = np.full(2, np.nan) if normal is None else np.array(rounded(normal))
    return _arrays(shares, normal), unit


def _shared(bodies: tuple[Moving, Moving], pieces: list[FirstContacts], i: int) -> list[FloatArray]:
    """What bodies have in common that overlap at the start: convex polygons, or parts of a segment."""
    if pieces[0].cost.accuracy == "exact" and any(body.thin for body in bodies):
        return _arrays(_inside(bodies)[0], None)
    parts = [part for piece in pieces for part in piece.parts(i)]
    areas = [part for part in parts if len(part) > 2]
    if areas:
        return areas
    size = max(float(np.abs(part).max()) for part in parts)
    return _arrays(united([exactly(part) for part in parts], Fraction(PLACE_ROUNDING * size)), None)


def _inside(bodies: tuple[Moving, Moving]) -> tuple[list[Part], bool]:
    thin, body = sorted(bodies, key=lambda body: not body.thin)
    return inside_parts(body, thin)


def _arrays(parts: list[Part], normal: Vector | None) -> list[FloatArray]:
    """As numbers; the ends of a segment in the order that `first_contact` has."""
    x, y = normal or (Fraction(0), Fraction(-1))
    ordered = (sorted(part, key=lambda p: p[1] * x - p[0] * y) for part in parts)
    return [np.array([[nearest(u), nearest(v)] for u, v in part]) for part in ordered]


def _moving(body: Region | Polygons, i: int, velocity: FloatArray) -> Moving:
    """Item i, or the only one."""
    if isinstance(body, Region):
        rings = tuple(tuple((Fraction(x, body._unit), Fraction(y, body._unit)) for x, y in r) for r in body._whole)
        return Moving(rings, exactly(velocity[None])[0])
    return convex(body[i if len(body) > 1 else 0], velocity)


def _rows(velocities: tuple[Any, Any], count: int) -> tuple[FloatArray, FloatArray]:
    """Velocities that have been checked, a row for every item."""
    one, two = (np.broadcast_to(np.asarray(v, np.float64), (count, 2)) for v in velocities)
    return one, two


def _approach(ways: tuple[FloatArray, FloatArray], normal: FloatArray) -> Callable[[], FloatArray]:
    def speed() -> FloatArray:
        with np.errstate(over="ignore", invalid="ignore"):
            return -((ways[1] - ways[0]) * normal).sum(axis=1)

    return speed


def distance_regions(ask: Callable[..., Distances], a: Any, b: Any, want: Any, options: dict[str, Any]) -> Distances:
    """The answer of `distance` where a or b is a region: that of the nearest pair of pieces."""
    start = time.perf_counter_ns()
    _refuse(options)
    effects = _validate.want(want, ("distance", "witness", "penetration"))
    if "penetration" in effects:
        raise NotAvailableError("how deep a Region is penetrated is no minimum over its pieces, and not available")
    every = np.arange(_common(a, b))
    found = [ask(one, two, want=want, **options) for one, two in _pairs(a, b)]
    gap, lower, upper, status = (
        np.array([getattr(answer, name) for answer in found]) for name in ("distance", "lower", "upper", "status")
    )
    first = gap.argmin(axis=0)
    point_a, point_b, normal = (
        np.array([getattr(answer, name) for answer in found])[first, every] for name in ("point_a", "point_b", "normal")
    )
    least, most = lower.min(axis=0), upper.min(axis=0)
    return Distances(
        np.clip(gap[first, every], least, most),
        least,
        most,
        point_b,
        status.max(axis=0),
        _cost(found, start),
        point_a,
        normal,
    )


def intersects_regions(ask: Callable[..., Booleans], a: Any, b: Any, options: dict[str, Any]) -> Booleans:
    """The answer of `intersects` where a or b is a region: whether any pair of pieces meets."""
    start = time.perf_counter_ns()
    _refuse(options)
    _common(a, b)
    found = [ask(one, two, **options) for one, two in _pairs(a, b)]
    value, certain, status = (
        np.array([getattr(answer, name) for answer in found]) for name in ("value", "certain", "status")
    )
    meet = value.any(axis=0)
    sure = np.where(meet, (value & certain).any(axis=0), certain.all(axis=0))
    return Booleans(meet, sure, status.max(axis=0), _cost(found, start))


def _refuse(options: dict[str, Any]) -> None:
    if options.get("poses_ab") is not None:
        raise GeometryError("poses_ab must be left out: a Region is in world coordinates here")
    if options["certificates"]:
        raise NotAvailableError("certificates of a Region are not available yet")


def _common(a: Any, b: Any) -> int:
    """How many items; a region is one."""
    for body, name in ((a, "a"), (b, "b")):
        if not isinstance(body, (Region, Polygons)):
            raise GeometryError(f"{name} must be Region or Polygons, got {type(body).__name__}")
    return _validate.common_length(*(1 if isinstance(body, Region) else len(body) for body in (a, b)))


def _pairs(a: Any, b: Any) -> Iterator[tuple[Polygons, Polygons]]:
    """Every piece of one against every piece of the other; polygons stay together."""

    def parts(body: Any) -> list[Polygons]:
        if not isinstance(body, Region):
            return [body]
        return [Polygons.from_list([body.pieces[i]]) for i in range(len(body.pieces))]

    return product(parts(a), parts(b))


def _cost(found: Sequence[Any], start: int) -> Cost:
    counts: dict[str, int] = {}
    for answer in found:
        for stage, n in answer.cost.counts.items():
            counts[stage] = counts.get(stage, 0) + n
    return Cost(time.perf_counter_ns() - start, found[0].cost.accuracy, counts)


def _turn(a: Any, b: Any, c: Any) -> Any:
    """> 0 where c lies left of the line from a to b."""
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])


def _on(a: Any, b: Any, p: Any) -> bool:
    """Whether p is on the closed segment."""
    within = min(a[0], b[0]) <= p[0] <= max(a[0], b[0]) and min(a[1], b[1]) <= p[1] <= max(a[1], b[1])
    return bool(within and _turn(a, b, p) == 0)


def _edges(ring: list[Corner]) -> list[tuple[Corner, Corner]]:
    return list(zip(ring, [*ring[1:], *ring[:1]], strict=True))


def _area(ring: list[Corner]) -> int:
    """Twice it; > 0 for counter-clockwise ones."""
    return sum(a[0] * b[1] - a[1] * b[0] for a, b in _edges(ring))


def _meet(a: Corner, b: Corner, c: Corner, d: Corner) -> bool:
    """Whether two closed segments have a common point."""
    if max(a[0], b[0]) < min(c[0], d[0]) or max(c[0], d[0]) < min(a[0], b[0]):
        return False
    if max(a[1], b[1]) < min(c[1], d[1]) or max(c[1], d[1]) < min(a[1], b[1]):
        return False
    one, two, three, four = _turn(a, b, c), _turn(a, b, d), _turn(c, d, a), _turn(c, d, b)
    return not (one > 0 < two or one < 0 > two or three > 0 < four or three < 0 > four)


def _holds(ring: list[Corner], p: Corner) -> bool:
    """Whether a point that is not on the ring is within it."""
    inside = False
    for a, b in _edges(ring):
        if (a[1] > p[1]) != (b[1] > p[1]) and (_turn(a, b, p) > 0) == (b[1] > a[1]):
            inside = not inside
    return inside


def _check(rings: list[list[Corner]]) -> None:
    """Refuse, by name, what is no region."""
    names = ["outline", *(f"holes[{i}]" for i in range(len(rings) - 1))]
    sides = []
    for ring, name in zip(rings, names, strict=True):
        if len(ring) < 3:
            raise GeometryError(f"{name} must have at least 3 vertices, got {len(ring)}")
        if len(set(ring)) < len(ring):
            raise GeometryError(f"{name} has a vertex twice")
        sides += [(a, b, name, i) for i, (a, b) in enumerate(_edges(ring))]
    for (a, b, name, i), (c, d, other, k) in combinations(sides, 2):
        shared = {a, b} & {c, d} if name == other else set()
        if not shared:
            if _meet(a, b, c, d):
                raise GeometryError(f"{name}: the edge at its vertex {i} meets that of {other} at its vertex {k}")
        elif _on(a, b, d if c in shared else c) or _on(c, d, b if a in shared else a):
            raise GeometryError(f"{name} turns back on itself at its vertex {k}")
    if _area(rings[0]) < 0:
        raise GeometryError("outline is clockwise")
    for ring, name in zip(rings[1:], names[1:], strict=True):
        if not _holds(rings[0], ring[0]):
            raise GeometryError(f"{name} is not inside the outline")
        if any(_holds(other, ring[0]) for other in rings[1:] if other is not ring):
            raise GeometryError(f"{name} is inside another hole")


def _within(before: Corner, at: Corner, after: Corner, p: Corner) -> bool:
    """Whether the way from a corner to p starts out between its sides, to the left of both rings."""
    if _turn(before, at, after) > 0:
        return bool(_turn(before, at, p) > 0 and _turn(at, after, p) > 0)
    return not (_turn(before, at, p) <= 0 and _turn(at, after, p) <= 0)


def _bridged(rings: list[list[Corner]]) -> list[Corner]:
    """One ring: the outline, which goes to every hole and back."""
    whole = list(rings[0])
    sides = [side for ring in rings for side in _edges(ring)]
    for hole in sorted(rings[1:], key=max, reverse=True):
        # Its last corner sees one of what is to its right, where all holes are part of the ring by now.
        start = hole.index(max(hole))
        p = hole[start]
        near = sorted(range(len(whole)), key=lambda i: (whole[i][0] - p[0]) ** 2 + (whole[i][1] - p[1]) ** 2)
        for i in near:
            q = whole[i]
            if not _within(whole[i - 1], q, whole[(i + 1) % len(whole)], p):
                continue
            free = all(_clear(p, q, a, b) for a, b in sides)
            if free:
                whole[i + 1 : i + 1] = [*hole[start:], *hole[: start + 1], q]
                sides.append((p, q))
                break
    return whole


def _clear(p: Corner, q: Corner, a: Corner, b: Corner) -> bool:
    """Whether an edge does not block the view from p to q, which it may end at."""
    ends = {a, b} & {p, q}
    if not ends:
        return not _meet(p, q, a, b)
    return not any(_on(p, q, x) for x in {a, b} - ends) and not any(_on(a, b, x) for x in {p, q} - ends)


def _triangles(ring: list[Corner]) -> list[list[Corner]]:
    """Ears, one after the other; corners on a line fall away."""
    ring, out = list(ring), []
    while len(ring) > 2:
        for i, b in enumerate(ring):
            a, c = ring[i - 1], ring[(i + 1) % len(ring)]
            turn = _turn(a, b, c)
            if turn > 0 and not any(
                _turn(a, b, p) >= 0 and _turn(b, c, p) >= 0 and _turn(c, a, p) >= 0 for p in ring if p not in (a, b, c)
            ):
                out.append([a, b, c])
                break
            if turn == 0 and (a == c or not _on(a, b, c) and not _on(b, c, a)):
                break
        else:
            raise AssertionError("a simple polygon has an ear")
        del ring[i]
    return out


def _merged(pieces: list[list[Corner]]) -> list[list[Corner]]:
    """Convex unions of neighbours, as long as there are any."""
    merging = True
    while merging:
        merging = False
        owner = {side: k for k, piece in enumerate(pieces) for side in _edges(piece)}
        for (a, b), k in owner.items():
            other = owner.get((b, a))
            if other is None:
                continue
            one, two = pieces[k], pieces[other]
            i, j = one.index(b), two.index(a)
            ring = [*one[i:], *one[:i], *(two[j:] + two[:j])[1:-1]]
            if all(_turn(ring[n - 1], ring[n], ring[(n + 1) % len(ring)]) > 0 for n in range(len(ring))):
                pieces = [piece for n, piece in enumerate(pieces) if n not in (k, other)] + [ring]
                merging = True
                break
    return pieces
