# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""What pairs of pieces have in common in space, put together: the contact set of the whole, and its normal.

Points, ends and corners are those that were found for pairs of pieces, rounded there; which of them are the same, on
a line or in a plane is decided within a slack, in float64.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from geomsrv import _core
from geomsrv.answers import BoolArray, FloatArray, IntArray

__all__ = ["common_plane", "united_in_space"]

# Slacks that are tried, in terms of the first, until no more than so much of an area is lost.
WIDER = (1.0, 8.0, 64.0)
LOST = 2.0**-10

# Normals of a triangle, of rounded corners, and of a pair that differ by no more are the same: the latter is taken.
NORMAL_SLACK = 2.0**-40

# Planes are drawn through a polygon and followed beyond it: what its corners are off counts so many times more.
PLANE_REACH = 4.0


def common_plane(
    pairs: Sequence[tuple[FloatArray, FloatArray]],
    places: FloatArray,
    normals: FloatArray,
    velocity: FloatArray,
    slack: float,
) -> FloatArray:
    """Unit normal of planes that have, through each place, one piece of a pair below them and the other above; or NaN.

    Planes of triangles go before those of pairs, which may be along the seams between triangles; of several it is that
    along which the bodies approach fastest.
    """
    triangles = [piece for pair in pairs for piece in pair if len(piece) == 3]
    faces = [np.cross(t[1] - t[0], t[2] - t[0]) for t in triangles]
    lengths = [float(np.linalg.norm(n)) for n in faces]
    units = [n / length for n, length in zip(faces, lengths, strict=True) if length > 0.0]
    given = _distinct(normals[~np.isnan(normals[:, 0])])
    both = np.array([sign * n for n in units for sign in (1.0, -1.0)]).reshape(-1, 3)
    candidates = np.concatenate([given, _distinct(both)])
    apart = np.ones(len(candidates), np.bool_)
    for (below, above), place in zip(pairs, places, strict=True):
        apart &= ((below - place) @ candidates.T).max(axis=0) <= slack
        apart &= ((above - place) @ candidates.T).min(axis=0) >= -slack
    exact, rough = candidates[: len(given)][apart[: len(given)]], candidates[len(given) :][apart[len(given) :]]
    chosen = rough if len(rough) else exact
    if not len(chosen):
        return np.full(3, np.nan)
    best: FloatArray = chosen[int(np.argmax(chosen @ velocity))]
    # That of a pair is correctly rounded, or nearly so.
    same = exact[(np.abs(exact - best) <= NORMAL_SLACK).all(axis=1)]
    return 0.0 + (same[0] if len(same) else best)  # without -0.0


def _distinct(rows: FloatArray) -> FloatArray:
    """Each row once, where it comes first."""
    return rows[np.sort(np.unique(rows, axis=0, return_index=True)[1])]


def united_in_space(sets: Sequence[FloatArray], slack: float, normal: FloatArray) -> list[FloatArray]:
    """Points, longest segments, and rings around areas, counter-clockwise about the normal; those of holes clockwise.

    None is in another, and no seam is left of the polygons that make an area.
    """
    points: list[FloatArray] = []
    segments: list[FloatArray] = []
    polygons: list[FloatArray] = []
    for part in sets:
        ring = _ring(part, slack)
        (points if len(ring) == 1 else segments if len(ring) == 2 else polygons).append(ring)
    planes = _planes(polygons, slack)
    rings = [ring for plane in planes for ring in plane.rings(slack, normal)]
    areas = [(plane, polygon) for plane in planes for polygon in plane.polygons]
    covers = _Near([polygon for _, polygon in areas], slack)
    joined = _joined(segments, slack)
    bare = [
        piece
        for s, near in zip(joined, covers.of(joined), strict=True)
        for piece in _uncovered(s, [areas[k] for k in near], slack)
    ]
    lone: list[FloatArray] = []
    beside = _Near(bare, slack).of(points), covers.of(points), _Near(points, slack).of(points)
    kept = np.zeros(len(points), np.bool_)
    for i, (p, lines, faces, others) in enumerate(zip(points, *beside, strict=True)):
        if (
            not any(kept[k] and np.abs(p - points[k]).max() <= slack for k in others)
            and not any(_beside(bare[k], p[0], slack) for k in lines)
            and not any(plane.holds(polygon, p[0], slack) for plane, polygon in (areas[k] for k in faces))
        ):
            kept[i] = True
            lone.append(p)
    order = sorted([*lone, *bare], key=lambda part: (len(part), part.tolist()))
    return [*order, *rings]


class _Near:
    """Which of some parts may be within the slack of others: those whose boxes are."""

    def __init__(self, parts: Sequence[FloatArray], slack: float) -> None:
        self._room = PLANE_REACH * slack
        self._boxes = _boxes_of(parts)

    def of(self, parts: Sequence[FloatArray]) -> list[list[int]]:
        """For every one, in their order."""
        if not parts:
            return []
        low, high = _boxes_of(parts)
        low, high = low - self._room, high + self._room
        found = _core.overlapping_pairs_between(low, high, *self._boxes)
        found = found[np.lexsort((found[:, 1], found[:, 0]))]
        return [part.tolist() for part in np.split(found[:, 1], np.searchsorted(found[:, 0], np.arange(1, len(parts))))]


def _boxes_of(parts: Sequence[FloatArray]) -> tuple[FloatArray, FloatArray]:
    """Low and high corners (k, 3)."""
    if not parts:
        return np.zeros((0, 3)), np.zeros((0, 3))
    first = np.cumsum([0, *map(len, parts[:-1])])
    points = np.concatenate(parts)
    return np.minimum.reduceat(points, first, axis=0), np.maximum.reduceat(points, first, axis=0)


def _ring(points: FloatArray, slack: float) -> FloatArray:
    """Corners of a convex polygon in order, two ends, or a point; of points that span no more than that."""
    kept = [p for i, p in enumerate(points) if not any(np.abs(p - q).max() <= slack for q in points[:i])]
    if len(kept) < 3:
        return np.array(kept)
    corners = np.array(kept)
    arm = corners[np.argmax(np.linalg.norm(corners - corners[0], axis=1))] - corners[0]
    across = np.cross(arm, corners - corners[0])
    k = int(np.argmax(np.linalg.norm(across, axis=1)))
    length = float(np.linalg.norm(across[k]))
    if length <= slack * float(np.linalg.norm(arm)):
        along = corners @ arm
        return corners[[int(np.argmin(along)), int(np.argmax(along))]]
    middle = corners.mean(axis=0)
    u = arm / np.linalg.norm(arm)
    v = np.cross(across[k] / length, u)
    angles = np.arctan2((corners - middle) @ v, (corners - middle) @ u)
    ordered: FloatArray = corners[np.argsort(angles)]
    # As it came if it came in that order.
    turns = np.roll(angles, -1) - angles
    return corners if (turns > 0).sum() == len(turns) - 1 or (turns < 0).sum() == len(turns) - 1 else ordered


@dataclass(frozen=True)
class _Plane:
    """Convex polygons in one plane."""

    middle: FloatArray
    u: FloatArray
    v: FloatArray
    size: float
    polygons: list[FloatArray]

    @property
    def normal(self) -> FloatArray:
        return np.cross(self.u, self.v)

    def flat(self, points: FloatArray) -> FloatArray:
        return np.column_stack([(points - self.middle) @ self.u, (points - self.middle) @ self.v])

    def contains(self, points: FloatArray, slack: float) -> bool:
        """Whether all are in the plane."""
        arms = points - self.middle
        room = slack * (1.0 + PLANE_REACH * np.linalg.norm(arms, axis=1) / self.size)
        return bool((np.abs(arms @ self.normal) <= room).all())

    def heights(self, polygon: FloatArray, at: FloatArray) -> FloatArray:
        """(n, edges): how far points (n, 2) are inside of every edge."""
        ring = self.flat(polygon)
        way = np.roll(ring, -1, axis=0) - ring
        if _area(ring) < 0.0:
            way = -way
        way = way / np.linalg.norm(way, axis=1, keepdims=True)
        height: FloatArray = way[:, 0] * (at[:, None, 1] - ring[:, 1]) - way[:, 1] * (at[:, None, 0] - ring[:, 0])
        return height

    def holds(self, polygon: FloatArray, p: FloatArray, slack: float) -> bool:
        """Whether a point is in a polygon of this plane."""
        inside = self.contains(p[None], slack) and (self.heights(polygon, self.flat(p[None])) >= -slack).all()
        return bool(inside)

    def rings(self, slack: float, normal: FloatArray) -> Iterator[FloatArray]:
        """Around all that is in some polygon."""
        up = self.normal
        wanted = normal if not np.isnan(normal[0]) else up * np.sign(up[np.argmax(np.abs(up))])
        turned = float(up @ wanted) < 0.0
        for ring in self._borders(slack) if len(self.polygons) > 1 else self.polygons:
            flip = _area(self.flat(ring)) < 0.0 if len(self.polygons) == 1 else False
            yield ring[::-1] if flip != turned else ring

    def _borders(self, slack: float) -> list[FloatArray]:
        """With the least slack that loses no area: corners at small angles are off by more."""
        whole = sum(abs(_area(self.flat(polygon))) for polygon in self.polygons)
        best, most = list[FloatArray](), -1.0
        for wider in WIDER:
            found = list(_around(self, wider * slack))
            area = sum(_area(self.flat(ring)) for ring in found) / whole
            if area > most + LOST:
                best, most = found, area
            if most >= 1.0 - LOST:  # else lost, or polygons overlap
                break
        return best


def _planes(polygons: Sequence[FloatArray], slack: float) -> list[_Plane]:
    """Polygons by their planes, which are drawn through the largest."""
    planes: list[_Plane] = []
    middles, normals, sizes = np.zeros((len(polygons), 3)), np.zeros((len(polygons), 3)), np.zeros(len(polygons))
    measured = []
    for ring in polygons:
        normal = np.cross(ring - ring[0], np.roll(ring, -1, axis=0) - ring[0]).sum(axis=0)
        measured.append((float(np.linalg.norm(normal)), normal))
    for k in sorted(range(len(polygons)), key=lambda k: -measured[k][0]):
        ring, (area, normal) = polygons[k], measured[k]
        known = len(planes)
        arms = ring - middles[:known, None]  # contains(), of all planes at once
        room = slack * (1.0 + PLANE_REACH * np.linalg.norm(arms, axis=2) / sizes[:known, None])
        holding = np.flatnonzero((np.abs((arms * normals[:known, None]).sum(axis=2)) <= room).all(axis=1))
        if len(holding):
            planes[holding[0]].polygons.append(ring)
        else:
            middle = ring.mean(axis=0)
            arms = ring - middle
            arm = arms[np.argmax(np.linalg.norm(arms, axis=1))]
            size = float(np.linalg.norm(arm))
            u, n = arm / size, normal / area
            v = np.cross(n, u)
            planes.append(_Plane(middle, u, v / np.linalg.norm(v), area / size, [ring]))
            middles[known], normals[known], sizes[known] = middle, planes[known].normal, planes[known].size
    return planes


def _around(plane: _Plane, slack: float) -> Iterator[FloatArray]:
    """Borders of the union, the inside at their left as seen from the tip of the plane's normal."""
    rings = [ring if _area(plane.flat(ring)) > 0.0 else ring[::-1] for ring in plane.polygons]
    points = np.concatenate(rings)
    places = plane.flat(points)
    first = _same(places, slack)
    ends = np.cumsum([0, *map(len, rings)])
    edges = np.concatenate(
        [np.column_stack([first[i:j], np.roll(first[i:j], -1)]) for i, j in zip(ends[:-1], ends[1:], strict=True)]
    )
    edges = edges[edges[:, 0] != edges[:, 1]]
    crossings, at = _crossings(places, edges, points, slack)
    if len(crossings):  # of polygons that overlap
        points, places = np.concatenate([points, at]), np.concatenate([places, crossings])
        first = _same(places, slack)
    edges = _split(places, edges, np.unique(first), slack)
    edges = np.unique(edges, axis=0)
    known = {(u, v) for u, v in edges.tolist()}
    lines = np.unique(np.sort(edges, axis=1), axis=0)
    middles = 0.5 * (places[lines[:, 0]] + places[lines[:, 1]])
    covered = np.zeros(len(lines), np.bool_)
    corners = places[: ends[-1]]
    low, high = (extreme.reduceat(corners, ends[:-1], axis=0) for extreme in (np.minimum, np.maximum))
    inner, line = _boxes_that_meet(low, high, middles, middles)
    for ring, here in zip(rings, np.split(line, np.searchsorted(inner, np.arange(1, len(rings)))), strict=True):
        covered[here] |= (plane.heights(ring, middles[here]) > slack).all(axis=1)
    border = []
    for (u, v), inside in zip(lines.tolist(), covered.tolist(), strict=True):
        left, right = (u, v) in known, (v, u) in known
        if not inside and left != right:
            border.append((u, v) if left else (v, u))
    for chain in _chains(border, places):
        kept = _without_flat(chain, places, slack)
        if len(kept) > 2:
            yield points[kept]


def _same(places: FloatArray, slack: float) -> IntArray:
    """For every place the first one that is the same."""
    one, two = _boxes_that_meet(places - slack, places + slack, places, places)
    close = (np.abs(places[one] - places[two]) <= slack).all(axis=1)
    first: IntArray = np.full(len(places), len(places))
    np.minimum.at(first, one[close], two[close])
    return first[first]


def _crossings(places: FloatArray, edges: IntArray, points: FloatArray, slack: float) -> tuple[FloatArray, FloatArray]:
    """Where edges cross each other that end elsewhere."""
    start, way = places[edges[:, 0]], places[edges[:, 1]] - places[edges[:, 0]]
    unit = way / np.linalg.norm(way, axis=1)[:, None]
    end = start + way
    low, high = np.minimum(start, end), np.maximum(start, end)
    one, two = _boxes_that_meet(low, high, low, high)
    one, two = one[one < two], two[one < two]

    def height(line: IntArray, at: FloatArray) -> FloatArray:
        off: FloatArray = unit[line, 0] * (at[:, 1] - start[line, 1]) - unit[line, 1] * (at[:, 0] - start[line, 0])
        return off

    def ends_apart(line: IntArray, other: IntArray) -> BoolArray:
        from_start, from_end = height(line, start[other]), height(line, end[other])
        apart: BoolArray = (from_start > slack) & (from_end < -slack) | (from_start < -slack) & (from_end > slack)
        return apart

    crossing = ends_apart(one, two) & ends_apart(two, one)
    one, two = one[crossing], two[crossing]
    from_start, from_end = height(one, start[two]), height(one, end[two])
    part = from_start / (from_start - from_end)
    at = points[edges[two, 0]] + part[:, None] * (points[edges[two, 1]] - points[edges[two, 0]])
    return start[two] + part[:, None] * way[two], at


def _split(places: FloatArray, edges: IntArray, corners: IntArray, slack: float) -> IntArray:
    """Edges, cut where corners are on them."""
    start, way = places[edges[:, 0]], places[edges[:, 1]] - places[edges[:, 0]]
    length = np.linalg.norm(way, axis=1)
    unit = way / length[:, None]
    end, at = start + way, places[corners]
    room = PLANE_REACH * slack  # for a point beside an edge, and for rounding
    edge, corner = _boxes_that_meet(np.minimum(start, end) - room, np.maximum(start, end) + room, at, at)
    arms = at[corner] - start[edge]
    along = (arms * unit[edge]).sum(axis=1)
    across = unit[edge, 0] * arms[:, 1] - unit[edge, 1] * arms[:, 0]
    on = (np.abs(across) <= slack) & (along > slack) & (along < length[edge] - slack)
    edge, corner, along = edge[on], corner[on], along[on]
    order = np.lexsort((corner, along, edge))
    between = np.split(corners[corner[order]], np.searchsorted(edge[order], np.arange(1, len(edges))))
    cut = []
    for (u, v), stops in zip(edges.tolist(), between, strict=True):
        ring = [u, *stops.tolist(), v]
        cut += [(x, y) for x, y in zip(ring[:-1], ring[1:], strict=True) if x != y]
    return np.array(cut, np.int64).reshape(-1, 2)


def _boxes_that_meet(
    low_a: FloatArray, high_a: FloatArray, low_b: FloatArray, high_b: FloatArray
) -> tuple[IntArray, IntArray]:
    """Pairs of rectangles (n, 2) and (m, 2) that meet, sorted."""
    flat = [np.column_stack([corner, np.zeros(len(corner))]) for corner in (low_a, high_a, low_b, high_b)]
    found = _core.overlapping_pairs_between(*flat)
    found = found[np.lexsort((found[:, 1], found[:, 0]))]
    return found[:, 0], found[:, 1]


def _chains(border: Sequence[tuple[int, int]], places: FloatArray) -> Iterator[list[int]]:
    """Rings: where several go on from a corner, that which has nothing between it and the way come from."""
    onward: dict[int, list[int]] = {}
    for u, v in border:
        onward.setdefault(u, []).append(v)
    for begin in sorted(onward):
        while onward[begin]:
            ring, here = [begin], onward[begin].pop()
            while here != begin and onward.get(here):
                back = places[ring[-1]] - places[here]
                turn = [
                    np.arctan2(back[1], back[0]) - np.arctan2(*(places[x] - places[here])[::-1]) for x in onward[here]
                ]
                ring.append(here)
                here = onward[here].pop(int(np.argmin(np.mod(turn, 2.0 * np.pi))))
            if here == begin:
                yield ring


def _without_flat(ring: list[int], places: FloatArray, slack: float) -> list[int]:
    """Without corners on the line between their neighbours."""
    kept = list(ring)
    k = 0
    while k < len(kept) and len(kept) > 2:
        before, at, after = (places[kept[(k + step) % len(kept)]] for step in (-1, 0, 1))
        way = after - before
        height = abs(way[0] * (at - before)[1] - way[1] * (at - before)[0])
        if height <= slack * float(np.linalg.norm(way)):
            del kept[k]
            k = max(k - 1, 0)
        else:
            k += 1
    return kept


def _area(ring: FloatArray) -> float:
    """Twice it; > 0 for counter-clockwise ones."""
    after = np.roll(ring, -1, axis=0)
    return float((ring[:, 0] * after[:, 1] - ring[:, 1] * after[:, 0]).sum())


def _joined(segments: Sequence[FloatArray], slack: float) -> list[FloatArray]:
    """The longest ones: those on one line that overlap or adjoin are one."""
    left = sorted(segments, key=lambda s: float(np.linalg.norm(s[1] - s[0])))
    near = [set(others) for others in _Near(left, slack).of(left)]
    part_of = list(range(len(left)))  # where it is now
    waiting, whole = list(range(len(left))), set[int]()

    def now(k: int) -> int:
        while part_of[k] != k:
            part_of[k] = k = part_of[part_of[k]]
        return k

    while waiting:
        at = waiting.pop()
        if now(at) != at:
            continue
        s = left[at]
        near[at] = {now(k) for k in near[at]} - {at}
        others = sorted(near[at])
        mates = np.array(others, np.int64)[_mates(s, np.array([left[k] for k in others]).reshape(-1, 2, 3), slack)]
        if not len(mates):
            whole.add(at)
            continue
        ends = np.concatenate([s, *(left[k] for k in mates)])
        along = ends @ (s[1] - s[0])
        left[at] = ends[[int(np.argmin(along)), int(np.argmax(along))]]
        for k in mates.tolist():
            part_of[k] = at
            near[at] |= near[k]
            whole.discard(k)
        waiting.append(at)
    return [left[k] for k in sorted(whole)]


def _mates(s: FloatArray, others: FloatArray, slack: float) -> BoolArray:
    """Which are on the line of a segment, and meet it; or it is on theirs, if they are longer."""
    way = s[1] - s[0]
    length = float(np.linalg.norm(way))
    arms = others - s[0]
    along = arms @ (way / length)
    off = np.linalg.norm(arms - along[:, :, None] * (way / length), axis=2).max(axis=1)
    longer = np.maximum(np.linalg.norm(others[:, 1] - others[:, 0], axis=1) / length, 1.0)
    mates: BoolArray = (off <= slack * longer) & (along.min(axis=1) <= length + slack) & (along.max(axis=1) >= -slack)
    return mates


def _uncovered(s: FloatArray, areas: Sequence[tuple[_Plane, FloatArray]], slack: float) -> Iterator[FloatArray]:
    """What of a segment is in no polygon."""
    way = s[1] - s[0]
    length = float(np.linalg.norm(way))
    hidden = []
    for plane, polygon in areas:
        if not plane.contains(s, slack):
            continue
        heights = plane.heights(polygon, plane.flat(s)) + slack
        if ((heights < 0.0).all(axis=0)).any():
            continue
        drop = heights[0] - heights[1]
        with np.errstate(divide="ignore", invalid="ignore"):
            at = heights[0] / drop
        low = np.where(heights[0] < 0.0, at, 0.0).max()
        high = np.where(heights[1] < 0.0, at, 1.0).min()
        if low < high:
            hidden.append((float(low), float(high)))
    reached = 0.0
    for low, high in [*sorted(hidden), (1.0, 1.0)]:
        if (low - reached) * length > 2.0 * slack:
            yield np.array([s[0] + reached * way, s[1] if low == 1.0 else s[0] + low * way])
        reached = max(reached, high)


def _beside(s: FloatArray, p: FloatArray, slack: float) -> bool:
    way = s[1] - s[0]
    part = float(np.clip(way @ (p - s[0]) / (way @ way), 0.0, 1.0))
    return bool(np.abs(s[0] + part * way - p).max() <= slack)
