# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""First contact of triangle meshes: that of all pairs of triangles, or of triangles and convex bodies."""

from __future__ import annotations

import math
import time
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from geomsrv import _validate
from geomsrv.answers import ContactStatus, Cost, FirstContacts, FloatArray, IntArray, sets_end_to_end
from geomsrv.errors import GeometryError, NotAvailableError
from geomsrv.mesh_contact import common_plane, united_in_space
from geomsrv.mesh_shared import Contact, Moving, shared_parts
from geomsrv.mesh_tree import Sweep, Tree, in_order
from geomsrv.shapes import Boxes, Convex, Mesh, Polytopes
from geomsrv.turning import approach, middles, packed, turns
from geomsrv.verify import Pair, clip_of, relative_velocity, way_of

__all__ = ["first_contact_meshes"]

# A contact point found for several pairs of pieces: a vertex moved by a product and a sum, or a point of an edge, up
# to the slack within which bodies of such coordinates touch; some 60 roundings of their size, rounded up.
PLACE_ROUNDING = 256.0 * 2.0**-53

# A box from its ends: a sum, differences and halves take 3 u; and what vanishes.
NODE_ROUNDING = 8.0 * 2.0**-53
SMALLEST = 2.0**-1070

TURNING_BATCH = 32  # pairs of boxes that turn are dear: the earliest alone are looked into

Ask = Callable[..., FirstContacts]


def first_contact_meshes(
    ask: Ask, a: Any, b: Any, velocities: tuple[ArrayLike, ArrayLike], options: dict[str, Any]
) -> FirstContacts:
    """The answer of `first_contact`, which is passed in, where a or b is a mesh."""
    start = time.perf_counter_ns()
    turning = turns(options["angular_velocity_a"], options["angular_velocity_b"])
    if options["certificates"]:
        raise NotAvailableError("certificates of a Mesh are not available yet")
    bodies = [_Pieces(body, name) for body, name in ((a, "a"), (b, "b"))]
    count = _validate.common_length(*(body.items for body in bodies))
    moving = [_rows(v, f"velocity_{name}", count) for v, name in zip(velocities, "ab", strict=True)]
    end = _validate.limit(options["t_max"], "t_max")
    # What is refused is refused even where no boxes meet.
    none = Polytopes(np.zeros((0, 3)), [0])
    options = dict(options)
    about: dict[str, Any] = {}
    for body, name in zip(bodies, "ab", strict=True):
        angular, center = (options.pop(f"{what}_{name}") for what in ("angular_velocity", "center"))
        about[f"angular_velocity_{name}"] = _rows(
            (0, 0, 0) if angular is None else angular, f"angular_velocity_{name}", count
        )
        about[f"center_{name}"] = body.middles(count) if center is None else _rows(center, f"center_{name}", count)
    at_once = {name: rows[:1] for name, rows in about.items()} if turning and count else {}
    tier = ask(none, none, (0, 0, 0), (0, 0, 0), **options, **at_once).cost.accuracy
    wanted, options = bool(options["contact_set"]), {**options, "contact_set": True}
    counts: Counter[str] = Counter()
    rows = []
    for i in range(count):
        ways = moving[0][i], moving[1][i]
        if turning:
            options |= {name: values[i] for name, values in about.items()}
        rows.append(
            (_first_turning if turning else _first)(_Question(ask, bodies, i, ways, end, options, counts, wanted))
        )
    points, point_offsets, part_offsets = sets_end_to_end((row.parts if wanted else [] for row in rows), 3)
    numbers = np.array([row.numbers for row in rows]).reshape(-1, 4)
    normal = np.array([row.normal for row in rows]).reshape(-1, 3)

    middle, lower, upper, last = (np.ascontiguousarray(column) for column in numbers.T)
    return FirstContacts(
        status=np.array([row.status for row in rows], np.uint8),
        time=middle,
        time_lower=lower,
        time_upper=upper,
        last_time=last,
        normal=normal,
        points=points,
        point_offsets=point_offsets,
        certain=np.array([row.certain for row in rows], np.bool_),
        _closing_speed=(
            np.array([row.closing_speed for row in rows]) if turning else lambda: approach(moving[0], moving[1], normal)
        ),
        cost=Cost(time.perf_counter_ns() - start, tier, dict(counts)),
        _part_offsets=part_offsets,
    )


class _Pieces:
    """Convex pieces of every item of a body."""

    def __init__(self, body: Any, name: str) -> None:
        if not isinstance(body, (Mesh, Convex, Boxes, Polytopes)):
            raise GeometryError(f"{name} must be Mesh, Boxes, Polytopes or Convex, got {type(body).__name__}")
        self._body: Mesh | Boxes | Polytopes = (
            Polytopes(body.vertices, [0, len(body.vertices)]) if isinstance(body, Convex) else body
        )
        self.items = 1 if isinstance(self._body, Mesh) else len(self._body)

    def tree(self, i: int) -> Tree:
        """Boxes around the pieces of item i."""
        body, i = self._body, i if self.items > 1 else 0
        if isinstance(body, Mesh):
            return body.tree
        points = self.corners(i, 0)
        return Tree.of(points.min(axis=0)[None], points.max(axis=0)[None], np.zeros(1, np.int64))

    def batch(self, i: int, pieces: IntArray) -> Boxes | Polytopes:
        """Listed pieces of item i."""
        body, i = self._body, i if self.items > 1 else 0
        if isinstance(body, Mesh):
            corners = body.vertices[body.triangles[pieces]].reshape(-1, 3)
            return Polytopes(corners, np.arange(0, len(corners) + 1, 3))
        # One for all.
        if isinstance(body, Boxes):
            return Boxes(body.center[i : i + 1], body.axes[i : i + 1], body.half_extents[i : i + 1])
        return Polytopes(body[i], [0, len(body[i])])

    def middles(self, count: int) -> FloatArray:
        """(n, 3) what an item turns about by default."""
        body = self._body
        if isinstance(body, Mesh):
            return np.broadcast_to(0.5 * body.vertices.min(axis=0) + 0.5 * body.vertices.max(axis=0), (count, 3))
        return np.broadcast_to(middles(body), (count, 3))

    def nodes(self, i: int, tree: Tree, rows: IntArray) -> Boxes | Polytopes:
        """Boxes that hold what is in nodes of the tree of item i."""
        if not isinstance(self._body, Mesh):
            return self.batch(i, rows)
        center = 0.5 * tree.low[rows] + 0.5 * tree.high[rows]
        half = np.maximum(tree.high[rows] - center, center - tree.low[rows]) * (1.0 + NODE_ROUNDING) + SMALLEST
        return Boxes(center, np.broadcast_to(np.eye(3), (len(rows), 3, 3)), half)

    def corners(self, i: int, piece: int) -> FloatArray:
        """Vertices of one piece, relative to nothing."""
        batch = self.batch(i, np.array([piece]))
        return batch.corners()[0] if isinstance(batch, Boxes) else batch[0]


class _Row:
    """Answer for one item."""

    status: int = ContactStatus.NEVER
    numbers = (np.nan, np.nan, np.nan, np.nan)  #: time, lower, upper, last
    certain: bool = True
    closing_speed: float = np.nan

    def __init__(self) -> None:
        self.normal = np.full(3, np.nan)
        self.parts: list[FloatArray] = []


class _Found:
    """What is known so far of pairs of pieces of one item: columns that grow."""

    def __init__(self) -> None:
        self.answers: list[FirstContacts] = []
        self.pieces: list[tuple[IntArray, IntArray]] = []

    def column(self, name: str) -> Any:
        return np.concatenate([getattr(answer, name) for answer in self.answers])

    def listed(self, rows: IntArray) -> tuple[IntArray, IntArray]:
        """Pieces of the listed pairs."""
        one, two = (np.concatenate([pieces[side] for pieces in self.pieces]) for side in range(2))
        return one[rows], two[rows]

    def set_of(self, row: int) -> FloatArray:
        """Points that a pair has in common."""
        for answer in self.answers:
            if row < len(answer.status):
                return answer.points[answer.point_offsets[row] : answer.point_offsets[row + 1]]
            row -= len(answer.status)
        raise IndexError(row)


class _Question(NamedTuple):
    """What is asked about one item."""

    ask: Ask
    bodies: list[_Pieces]
    item: int
    ways: tuple[FloatArray, FloatArray]  #: velocities
    end: float  #: of the time window
    options: dict[str, Any]  #: of `ask`
    counts: Counter[str]  #: of all items
    wanted: bool  #: the contact set

    def batches(self, pieces: Iterable[IntArray]) -> Iterator[Boxes | Polytopes]:
        """Listed pieces of a, and of b."""
        return (body.batch(self.item, p) for body, p in zip(self.bodies, pieces, strict=True))

    def trees(self) -> tuple[Tree, Tree]:
        """Boxes around the pieces of a, and of b."""
        a, b = (body.tree(self.item) for body in self.bodies)
        return a, b

    def moving(self, side: int) -> Moving:
        """One of them, as it turns."""
        body, name = self.bodies[side], "ab"[side]
        tree = body.tree(self.item)
        about = (self.options[f"{what}_{name}"] for what in ("angular_velocity", "center"))
        return Moving(
            tree,
            lambda rows: packed(body.nodes(self.item, tree, rows)),
            lambda rows: packed(body.batch(self.item, rows)),
            np.concatenate([self.ways[side], *about])[None],
        )


def _first(q: _Question) -> _Row:
    found, row = _Found(), _Row()
    bound, last = q.end, -np.inf

    def look(pieces_a: IntArray, pieces_b: IntArray) -> None:
        nonlocal bound, last
        answer = q.ask(*q.batches((pieces_a, pieces_b)), *q.ways, **q.options)
        q.counts.update(answer.cost.counts)
        q.counts["pairs of pieces"] += len(pieces_a)
        found.answers.append(answer)
        found.pieces.append((pieces_a, pieces_b))
        bound = float(np.fmin.reduce(answer.time_upper, initial=bound))
        last = float(np.fmax.reduce(answer.last_time, initial=last))

    sweep = Sweep.of(*q.trees(), *q.ways)
    in_order(sweep.a, sweep.b, sweep.first, lambda: sweep.not_after(bound), look)
    if not found.answers:
        return row
    status = found.column("status")
    sure = found.column("certain")
    row.certain = bool(sure.all())
    if not (status != ContactStatus.NEVER).any():
        return row
    lower, upper, middle = (found.column(name) for name in ("time_lower", "time_upper", "time"))
    high = float(np.fmin.reduce(upper))
    tied = np.flatnonzero(lower <= high)
    answers = len(found.answers)
    if last < q.end:
        in_order(sweep.a, sweep.b, sweep.last, lambda: sweep.after(last) if last < q.end else -np.inf, look)
    del found.answers[answers:]  # none of them is earlier
    deep = status == ContactStatus.OVERLAPPING
    row.status = int(status[tied].max())
    row.numbers = (float(np.fmin.reduce(middle)), float(np.fmin.reduce(lower)), high, last)
    overlapping = row.status == ContactStatus.OVERLAPPING
    row.certain |= bool((deep & sure).any())
    if q.options["accuracy"] == "bound":
        return row
    if q.options["accuracy"] == "exact" and len(tied) > 1 and (lower[tied] < upper[tied]).any():
        tied = tied[_exactly_first(q, found.listed(tied))]
    sets = [found.set_of(k) for k in tied.tolist()]
    moved = [
        tuple(
            body.corners(q.item, p) + row.numbers[0] * way for body, p, way in zip(q.bodies, pair, q.ways, strict=True)
        )
        for pair in zip(*(pieces.tolist() for pieces in found.listed(tied)), strict=True)
    ]
    # In a power of two near the size, so that no product overflows or vanishes.
    size = max(float(np.abs(part).max()) for part in (*sets, *(piece for pair in moved for piece in pair)))
    unit = math.frexp(size)[1] if math.isfinite(size) else 0
    sets = [np.ldexp(part, -unit) for part in sets]
    spread = float(middle[tied].max() - row.numbers[0])
    slack = PLACE_ROUNDING + math.ldexp(max(float(np.abs(way).max()) for way in q.ways) * spread, -unit)
    if not overlapping:
        near = [(np.ldexp(a, -unit), np.ldexp(b, -unit)) for a, b in moved]
        velocity = 0.5 * q.ways[0] - 0.5 * q.ways[1]
        row.normal = common_plane(
            near, np.array([part[0] for part in sets]), found.column("normal")[tied], velocity, slack
        )
    if q.wanted:
        row.parts = [np.ldexp(part, unit) for part in united_in_space(sets, slack, row.normal)]
    if row.status == ContactStatus.TOUCHING and len(tied) > 1 and np.isnan(row.normal[0]):
        row.certain = False  # none may pass through the other, and both together do
    return row


def _first_turning(q: _Question) -> _Row:
    """The same for bodies that turn: boxes around pieces turn with them."""
    found, row = _Found(), _Row()
    bound = q.end
    trees = q.trees()

    def followed(sides: Iterable[Boxes | Polytopes], contact_set: bool) -> FirstContacts:
        # What meets later than a proven contact need not be followed.
        answer = q.ask(*sides, *q.ways, **{**q.options, "t_max": bound, "contact_set": contact_set})
        q.counts.update(answer.cost.counts)
        return answer

    def begin(nodes_a: IntArray, nodes_b: IntArray) -> FloatArray:
        if not len(nodes_a):
            return np.zeros(0)
        sides = zip(q.bodies, trees, (nodes_a, nodes_b), strict=True)
        answer = followed((body.nodes(q.item, tree, rows) for body, tree, rows in sides), False)
        return np.where(answer.status == ContactStatus.NEVER, np.inf, answer.time_lower)

    def look(pieces_a: IntArray, pieces_b: IntArray) -> None:
        nonlocal bound
        answer = followed(q.batches((pieces_a, pieces_b)), q.wanted)
        q.counts["pairs of pieces"] += len(pieces_a)
        found.answers.append(answer)
        bound = float(np.fmin.reduce(answer.time_upper, initial=bound))

    in_order(*trees, begin, lambda: bound, look, TURNING_BATCH)
    if not found.answers:
        return row
    status, lower = found.column("status"), found.column("time_lower")
    met = status != ContactStatus.NEVER
    if not met.any():
        return row
    first = int(np.where(met, lower, np.inf).argmin())
    low, high = float(lower[first]), float(np.fmin.reduce(found.column("time_upper")))
    row.numbers = (low, low, high, np.nan)
    row.status = int(status[first])
    if row.status == ContactStatus.GRAZING and high - low <= (q.options["tolerance"] or 0.0):
        row.status = ContactStatus.WILL_TOUCH
    for at_once in (ContactStatus.TOUCHING, ContactStatus.OVERLAPPING):
        row.status = at_once if (status == at_once).any() else row.status
    row.certain = row.status not in (ContactStatus.TOUCHING, ContactStatus.GRAZING, ContactStatus.NOT_CONVERGED)
    if row.status != ContactStatus.OVERLAPPING:
        row.normal = found.column("normal")[first]
        row.closing_speed = float(found.column("closing_speed")[first])
    if q.wanted and len(found.set_of(first)):
        exactly = np.zeros((1, 3))  # no margin, nothing in doubt
        contact = Contact(row.status, low, high, row.normal, exactly)
        row.parts = shared_parts(q.moving(0), q.moving(1), contact) or [found.set_of(first)]
    return row


def _exactly_first(q: _Question, pieces: tuple[IntArray, IntArray]) -> IntArray:
    """Of pairs whose times round to neighbours those that are first: as their proofs tell, in rational numbers."""
    answer = q.ask(*q.batches(pieces), *q.ways, **{**q.options, "certificates": True})
    times = [_time_of(record) for record in answer.certificates or ()]
    first = min(times)
    return np.flatnonzero([time == first for time in times])


def _time_of(record: dict[str, Any]) -> Fraction:
    if record["claim"]["status"] != "WILL_TOUCH":
        return Fraction(0)
    pair = Pair(record["a"], record["b"])
    speed = relative_velocity(record["a"], record["b"], pair.unit)
    begun = clip_of(pair, speed, way_of(pair, speed, record["evidence"]))[1]
    assert begun is not None, "a proof of a contact has its time"
    return begun


def _rows(value: ArrayLike, name: str, count: int) -> FloatArray:
    """(n, 3) or (3,) -> (n, 3)."""
    rows = _validate.rows(value, name, count, 3)
    return np.broadcast_to(rows, (count, 3))
