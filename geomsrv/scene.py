# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""A world of named shapes: poses, twists, allowed pairs; atomic updates, and queries over all pairs that matter.

Numpy only.  Solids are compared with solids.  Planar shapes (`Polygon`) live in the plane z = 0 of the fixed
frame and are compared with each other only.
"""

from __future__ import annotations

import operator
import threading
import time
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from geomsrv import _validate
from geomsrv.answers import BoolArray, Bounded, ByteArray, Cost, DistanceStatus, FloatArray, IntArray
from geomsrv.broad_phase import Aabbs, Selection, boxes_now, boxes_swept, candidates
from geomsrv.errors import GeometryError, SceneError
from geomsrv.ladder import AUTO, Quality
from geomsrv.memory import Found, Memory
from geomsrv.narrow_phase import (
    ContactRows,
    DistanceRows,
    Unsupported,
    climbed_distance_rows,
    distance_rows,
)
from geomsrv.nearest import nearest_rows
from geomsrv.placement import IDENTITY, in_fixed_frame, laid_flat, numbers, settled
from geomsrv.scene_plan import describe
from geomsrv.shapes import Frustum, Polygon, Shape
from geomsrv.turning_pairs import (
    Question,
    climbed_contact_rows,
    closing_speeds,
    contact_rows,
    first_contact_row,
    nearness,
)
from geomsrv.visibility import Sight, Visibility, seen
from geomsrv.world import ShapeTable, World

__all__ = ["PairContacts", "PairDistances", "Scene", "SceneCull", "SceneObject", "SceneUpdate", "Visibility"]

Pair = tuple[str, str]
Faults = dict[str, str]

EFFECTS = ("distance", "witness", "penetration")  #: what a distance query can be asked for


@dataclass(frozen=True, eq=False)
class SceneObject:
    """One named shape.  A plain record: `Scene.apply` checks it, so that one refusal can name every bad object.

    Attributes
    ----------
    id : str
        Not empty.
    shape : Shape or Frustum
    pose : (7,) float
        x y z [m], qx qy qz qw: pose of the shape in `frame`.  A `Polygon` must stay in the plane: z = 0, no
        tilt.
    twist : (6,) float
        vx vy vz [m/s], wx wy wz [rad/s] along the axes of `frame`, of the shape's origin and about it.
        `frame` itself counts as being at rest.
    frame : str
        Frame `pose` and `twist` are given in; empty is the scene's fixed frame.  Converted once, by
        `Scene.apply`: what the scene gives back is in the fixed frame.
    uncertainty : float
        Radius [m] >= 0 by which each vertex may be off, e.g. because it came as float32.  Widens the interval
        of every answer the object has part in.
    velocity_uncertainty : float
        Radius [m/s] >= 0 by which the linear velocity may be off.  Widens the intervals of first contacts.
    motion_fault : str
        Why `twist` does not tell how the object moves; empty if it does.  It may then go anywhere: first
        contacts with it answer UNSUPPORTED with this text, but for what it is in contact with now.
    """

    id: str
    shape: Shape | Frustum
    pose: ArrayLike = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)
    twist: ArrayLike = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    frame: str = ""
    uncertainty: float = 0.0
    velocity_uncertainty: float = 0.0
    motion_fault: str = ""


@dataclass(frozen=True, eq=False)
class SceneUpdate:
    """A change to a scene, applied as a whole or not at all, in this order.

    Attributes
    ----------
    clear : bool
        Remove every object, and every allowed pair but those the scene was made with.
    remove : sequence of str
        Ids to remove; an unknown id is a fault.  Their allowed pairs stay, for when the id comes back.
    add : sequence of SceneObject
        An existing id is replaced; the same id twice is a fault.
    allow : sequence of (str, str)
        Pairs whose contact is allowed, that is, pairs to ignore.  The ids need not be present (yet): an SRDF
        lists links without geometry.  An id with itself is a fault.
    disallow : sequence of (str, str)
        Allowed pairs to check again.  A pair that is not allowed is a fault: a misspelt one would stay
        ignored.
    """

    add: Sequence[SceneObject] = ()
    remove: Sequence[str] = ()
    clear: bool = False
    allow: Sequence[Pair] = ()
    disallow: Sequence[Pair] = ()


@dataclass(frozen=True, eq=False)
class _PairRows(Bounded):
    """Rows that belong to pairs of ids, and the pairs that nothing could be said about."""

    cost: Cost
    version: int  #: of the scene the answer is about
    stamp: Any  #: time of that version's newest states, as given to `Scene.set_states`
    message: str  #: names what is unsupported or never compared; empty otherwise
    _ids: tuple[str, ...] = field(repr=False)
    _pairs: IntArray = field(repr=False)
    _unsupported: tuple[IntArray, list[str]] = field(repr=False)

    def __len__(self) -> int:
        return len(self._pairs)

    @cached_property
    def ids_a(self) -> list[str]:
        """First id of every row; always the smaller of the two."""
        return [self._ids[i] for i in self._pairs[:, 0].tolist()]

    @cached_property
    def ids_b(self) -> list[str]:
        """Second id of every row."""
        return [self._ids[i] for i in self._pairs[:, 1].tolist()]

    @cached_property
    def unsupported(self) -> list[tuple[str, str, str]]:
        """Pairs near enough to matter that no kernel answers: (id_a, id_b, reason)."""
        pairs, reasons = self._unsupported
        return [(self._ids[i], self._ids[j], reason) for (i, j), reason in zip(pairs.tolist(), reasons, strict=True)]


@dataclass(frozen=True, eq=False)
class PairDistances(_PairRows):
    """Answer of `Scene.distances`, `Scene.contacts` and `Scene.nearest_pair`; rows sorted by (id_a, id_b).

    Attributes
    ----------
    ids_a, ids_b : list of str
    distance, lower, upper : (n,) float64
        Distance [m] and a proven interval around the exact value, widened by the objects' uncertainty.  0 for
        touching and overlapping bodies, or minus the penetration depth if ``want`` named "penetration".  At
        tier "bound" `distance` is `lower`.
    point_a, point_b : (n, 3) float64
        Nearest points, or the deepest ones, fixed frame.
    normal : (n, 3) float64
        Unit, from a to b, fixed frame; NaN where there is none.
    status : (n,) uint8
        `DistanceStatus` OK or NOT_CONVERGED; unsupported pairs are in `unsupported` and have no row.
    unsupported : list of (str, str, str)
        Id, id and reason of each pair near enough to matter that no kernel answers.
    cost : Cost
        ``counts``: objects, pairs, allowed, candidates, "narrow <kind>-<kind>" calls, unsupported; at other tiers than
        "float64" also how many pairs were answered by "bound", "filter", "wide", "exact".
    version : int
    stamp : object
    message : str
    """

    distance: FloatArray
    lower: FloatArray
    upper: FloatArray
    point_a: FloatArray
    point_b: FloatArray
    normal: FloatArray
    status: ByteArray


@dataclass(frozen=True, eq=False)
class PairContacts(_PairRows):
    """Answer of `Scene.first_contacts`; rows sorted by (id_a, id_b).

    A pair that never touches within the horizon has no row, unless uncertainty makes contact possible.

    Attributes
    ----------
    ids_a, ids_b : list of str
    status : (n,) uint8
        `ContactStatus`.  UNSUPPORTED: apart now, and no kernel for how the two move; also listed in
        `unsupported`. NEVER: apart throughout as given, but within their uncertainty they may touch from
        ``time_lower`` on.
    time, time_lower, time_upper : (n,) float64
        First contact [s] and a proven interval, widened by the objects' uncertainty; an upper end of inf:
        within the uncertainty they may pass each other.
    last_time : (n,) float64
        Last contact [s], at most the horizon; NaN where no kernel follows the motion.
    normal : (n, 3) float64
        Unit contact normal from a to b at ``time``, fixed frame; NaN where there is none.
    closing_speed : (n,) float64
        How fast the bodies approach along the normal at ``time`` [m/s]; < 0 if they part.  Of bodies that turn, at the
        contact point where it is fastest.  NaN without a normal.
    points : (k, 3) float64, point_offsets : (n + 1,) int64
        Contact set of row i: ``points[point_offsets[i]:point_offsets[i + 1]]``, at ``time``, fixed frame.
    part_offsets : (m + 1,) int64
        Parts of contact sets, of which meshes have several: ``points[part_offsets[k]:part_offsets[k + 1]]``, as in
        `FirstContacts`.  With a cylinder, cone or ellipsoid each place where a mesh touches is one point; so is all,
        where more than 16,384 pairs of triangles of meshes that are followed step by step touch at once.
    unsupported : list of (str, str, str)
        Id, id and reason of each UNSUPPORTED row.
    cost : Cost
    version : int
    stamp : object
    message : str
    """

    status: ByteArray
    time: FloatArray
    time_lower: FloatArray
    time_upper: FloatArray
    last_time: FloatArray
    normal: FloatArray
    closing_speed: FloatArray
    points: FloatArray
    point_offsets: IntArray
    part_offsets: IntArray


@dataclass(frozen=True, eq=False)
class SceneCull(Bounded):
    """Answer of `Scene.cull`; rows sorted by id.

    Attributes
    ----------
    ids : list of str
    state : (n,) uint8
        `Visibility`.
    certain : (n,) bool
        True where exact arithmetic and every position within the uncertainty give the same state.
    message : str
        Names the kinds that could only be judged by their bounding box; empty otherwise.
    cost : Cost
        ``counts``: objects, "boxes" around them, "shapes" that were looked at themselves, and verdicts by stage: of
        boxes as for `cull`, and, at other tiers than "float64", of shapes.
    version : int
    stamp : object
    """

    ids: list[str]
    state: ByteArray
    certain: BoolArray
    message: str
    cost: Cost
    version: int
    stamp: Any

    @property
    def visible(self) -> list[str]:
        """Ids of the objects that are, or may be, seen."""
        return [name for name, state in zip(self.ids, self.state.tolist(), strict=True) if state != Visibility.OUTSIDE]


class Scene:
    """Named shapes that move, and queries over all pairs of them that matter.

    Safe to use from several threads: every answer is about one version.

    A tier means what it means to the query functions, about literal numbers.  Of solids these are the shapes and
    the pose of b in a, which is computed once, in float64, from the poses of both; of polygons the rings, which
    are placed in the plane once, in float64; of what a camera sees the pose, as a rotation matrix computed once.
    So at tier "exact" a distance, a time or a state is the correctly rounded one for these numbers, while
    ``lower`` and ``upper`` also cover what rounding the pose of b in a may have changed, and the objects'
    uncertainty.  Points and normals of solids are turned into the fixed frame in float64.

    Parameters
    ----------
    fixed_frame : str
        Name of the frame all answers are in.
    allowed_pairs : iterable of (str, str)
        Pairs to ignore from the start; `SceneUpdate.clear` keeps them.
    transforms : callable, optional
        ``transforms(frame)`` gives the pose (7,) of `frame` in the fixed frame, or raises an exception whose
        text says why not.  Without it an object given in another frame is refused by name.

    Examples
    --------
    >>> import geomsrv as gs
    >>> scene = gs.Scene()
    >>> ball = gs.SceneObject("ball", gs.Sphere(0.5), (2, 0, 0, 0, 0, 0, 1))
    >>> scene.apply(gs.SceneUpdate(add=[ball, gs.SceneObject("cube", gs.Box([1, 1, 1]))]))
    1
    >>> near = scene.distances(max_distance=1.0)
    >>> near.ids_a, near.ids_b, near.distance
    (['ball'], ['cube'], array([0.5]))
    """

    def __init__(
        self,
        *,
        fixed_frame: str = "world",
        allowed_pairs: Iterable[Pair] = (),
        transforms: Callable[[str], ArrayLike] | None = None,
    ) -> None:
        faults: Faults = {}
        self._first_allowed = frozenset(_pairs(allowed_pairs, "allowed_pairs", faults))
        if faults:
            raise SceneError(faults)
        self.fixed_frame = fixed_frame
        self._transforms = transforms
        self._lock = threading.RLock()
        self._objects: dict[str, SceneObject] = {}
        self._allowed = self._first_allowed
        # What queries see.  Made from the above when asked for: a scene that is built object by object costs
        # n, not n^2.
        self._world = World.empty()
        self._outdated = False
        self._replaced: set[str] = set()  # objects whose state in `_world`, if any, is no longer theirs
        self._resolved: tuple[Sequence[str], Mapping[str, int], IntArray] = (
            (),
            self._world.index,
            np.zeros(0, np.int64),
        )
        self._version = 0
        self._stamp: Any = None
        self._memory = Memory()
        self._newest: tuple[Any, ...] = (None, None, None, None)  # the states set last, as they came, and the world

    @property
    def world(self) -> World:
        """The current version as arrays, a row per object; it never changes."""
        with self._lock:
            if self._outdated:
                self._world = self._rebuilt()
                self._outdated = False
                self._replaced = set()
            return self._world

    @property
    def version(self) -> int:
        """Grows by one with every change that took effect; 0 at first."""
        return self._version

    @property
    def stamp(self) -> Any:
        """The newest stamp given to `set_states`; None before."""
        return self._stamp

    @property
    def ids(self) -> tuple[str, ...]:
        """Every object's id, sorted."""
        return self.world.ids

    @property
    def allowed_pairs(self) -> frozenset[Pair]:
        """Pairs that are ignored, smaller id first."""
        return self._allowed

    def __len__(self) -> int:
        return len(self._objects)

    def __contains__(self, name: object) -> bool:
        return name in self._objects

    def __iter__(self) -> Iterator[str]:
        return iter(self.ids)

    def __getitem__(self, name: str) -> SceneObject:
        """The object as it is now, in the fixed frame; KeyError for an unknown id."""
        world = self.world
        row = world.index[name]
        return SceneObject(
            id=name,
            shape=world.table.shapes[world.shape[row]],
            pose=world.poses[row].copy(),
            twist=world.twists[row].copy(),
            uncertainty=float(world.uncertainty[row]),
            velocity_uncertainty=float(world.velocity_uncertainty[row]),
            motion_fault=world.motion_faults.get(row, ""),
        )

    # ------------------------------------------------------------------------------------------------ changes

    def apply(self, update: SceneUpdate) -> int:
        """Change the scene as a whole or not at all.

        Parameters
        ----------
        update : SceneUpdate

        Returns
        -------
        int
            The version after it; the same as before if nothing changed.

        Raises
        ------
        SceneError
            ``errors`` names every bad object; the scene is as it was.
        """
        if not isinstance(update, SceneUpdate):
            raise GeometryError(f"update must be SceneUpdate, got {type(update).__name__}")
        faults: Faults = {}
        with self._lock:
            left = {} if update.clear else dict(self._objects)
            for name in _names(update.remove, "remove"):
                if left.pop(name, None) is None:
                    _blame(faults, name, "cannot be removed: no such object")
            added = self._checked(update.add, faults)
            allowed = set(self._first_allowed if update.clear else self._allowed)
            allowed.update(_pairs(update.allow, "allow", faults))
            for pair in _pairs(update.disallow, "disallow", faults):
                if pair not in allowed:
                    _blame(faults, pair[0], f"disallow: the pair with {pair[1]!r} is not allowed")
                allowed.discard(pair)
            if faults:
                raise SceneError(faults)
            changed = bool(added) or left.keys() != self._objects.keys() or allowed != self._allowed
            if changed:
                self._objects, self._allowed = left | added, frozenset(allowed)
                self._replaced |= added.keys()
                self._outdated = True
                self._version += 1
            return self._version

    def set_states(
        self, ids: Sequence[str], poses: ArrayLike, twists: ArrayLike | None = None, stamp: Any = None
    ) -> int:
        """Move objects: the fast path for streams of states.

        Parameters
        ----------
        ids : sequence of str
            The objects, each once.  Looked up once; the same sequence again costs nothing per id.
        poses : (n, 7) float
            x y z [m], qx qy qz qw, fixed frame.
        twists : (n, 6) float, optional
            vx vy vz [m/s], wx wy wz [rad/s], fixed frame: taken as they are, without uncertainty or fault.
            Without it the twists stay as they were.
        stamp : object, optional
            Time of the states; answers carry it.

        Returns
        -------
        int
            The new version.

        Raises
        ------
        SceneError
            ``errors`` names every unknown id or every bad row; the scene is as it was.
        GeometryError
            An array has the wrong shape or dtype.
        """
        with self._lock:
            world = self.world
            rows = self._resolve(ids, world)
            poses = _array(poses, "poses", (len(rows), 7))
            twists = None if twists is None else _array(twists, "twists", (len(rows), 6))
            if len(rows) and self._repeats(rows, poses, twists, world):
                self._version += 1
                self._stamp = stamp if stamp is not None else self._stamp
                self._world = world.seen_again(self._version, self._stamp)
                self._newest = (*self._newest[:3], self._world)
                return self._version
            given = poses.copy(), None if twists is None else twists.copy()
            poses, unlike_pose = settled(poses, twists)
            poses, unlike_plane = laid_flat(poses, twists, world.planar[rows])
            if faults := unlike_plane | unlike_pose:
                raise SceneError({world.ids[rows[k]]: text for k, text in sorted(faults.items())})
            if len(rows) == 0:
                return self._version
            self._version += 1
            self._stamp = stamp if stamp is not None else self._stamp
            self._world = world.moved(rows, poses, twists, self._version, self._stamp)
            self._newest = (rows, *given, self._world)
            return self._version

    def _repeats(self, rows: IntArray, poses: FloatArray, twists: FloatArray | None, world: World) -> bool:
        """Whether these states are, bit by bit, those that were set last, which is no change."""
        last_rows, last_poses, last_twists, last_world = self._newest
        if rows is not last_rows or world is not last_world or (twists is None) != (last_twists is None):
            return False
        same = np.array_equal(poses, last_poses) and (twists is None or np.array_equal(twists, last_twists))
        return bool(same)

    def distances(
        self,
        max_distance: float,
        *,
        ids: Iterable[str] | None = None,
        others: Iterable[str] | None = None,
        want: Sequence[str] = ("distance",),
        accuracy: str = "float64",
        tolerance: float | None = None,
        time_budget: float | None = None,
    ) -> PairDistances:
        """All pairs, allowed ones aside, that are at most `max_distance` apart.

        A pair whose interval is wide (uncertain vertices, or iterations that ran out) is listed as soon as
        its lower end is that small.

        Parameters
        ----------
        max_distance : float
            [m], >= 0; may be inf.
        ids : iterable of str, optional
            Only pairs with one of these.
        others : iterable of str, optional
            Only pairs of one of `ids` and one of these; by default, of `ids` and anything.
        want : sequence of str
            "distance", "witness", and "penetration" to measure how deep overlapping bodies are.
        accuracy : str
            Tier; see the class and the numerics page.  "bound" lists every pair whose bounding volumes are that near.
            "auto" takes for each pair the cheapest tier that will do.
        tolerance : float, optional
            Instead of a tier, the widest interval [m] of a pair that is listed, > 0: each is measured by the cheapest
            tier that proves it; NOT_CONVERGED where none does, as for uncertain vertices.
        time_budget : float, optional
            Seconds after which nothing more is begun, > 0: pairs that are then left are NOT_CONVERGED, with the
            interval proven so far.

        Returns
        -------
        PairDistances

        Raises
        ------
        GeometryError
            Names the argument and the fault; a `SceneError` for unknown ids.
        """
        start = time.perf_counter_ns()
        limit = _validate.limit(max_distance, "max_distance")
        return self._distances(start, limit, ids, others, want, Quality.of(accuracy, tolerance, time_budget))

    def contacts(
        self,
        *,
        ids: Iterable[str] | None = None,
        others: Iterable[str] | None = None,
        accuracy: str = "float64",
        tolerance: float | None = None,
        time_budget: float | None = None,
    ) -> PairDistances:
        """All pairs that touch or overlap now, with penetration depth; arguments as for `distances`."""
        start = time.perf_counter_ns()
        return self._distances(start, 0.0, ids, others, ("penetration",), Quality.of(accuracy, tolerance, time_budget))

    def nearest_pair(
        self,
        *,
        ids: Iterable[str] | None = None,
        others: Iterable[str] | None = None,
        want: Sequence[str] = ("distance",),
        accuracy: str = "float64",
        tolerance: float | None = None,
    ) -> PairDistances:
        """The pair with the smallest distance, one row; no row if no pair is supported.

        Of equally near pairs the first by (id_a, id_b); with "penetration" in `want` the deepest.
        `unsupported` lists those that may be nearer.  At tier "bound" no pair is nearer than the answer's ``distance``.
        Arguments as for `distances`.  The pair is found at "float64" unless a tier is asked for, and with a
        `tolerance` then measured by one that proves it.
        """
        start = time.perf_counter_ns()
        quality = Quality.of(accuracy, tolerance)
        tier = "float64" if quality.accuracy == AUTO else accuracy
        penetration = "penetration" in _validate.want(want, EFFECTS)
        world = self.world
        selection = _selection(world, ids, others)
        counts = _considered(world, selection)
        rows, unsupported = nearest_rows(world, penetration, selection, tier, counts)
        if quality.climbs:
            rows, _, tier = climbed_distance_rows(world, rows.pairs, penetration, quality, counts, np.inf, True)
        return _pair_distances(world, rows, unsupported, start, tier, counts)

    def first_contacts(
        self,
        horizon: float,
        *,
        margin: float = 0.0,
        earliest: bool = False,
        ids: Iterable[str] | None = None,
        others: Iterable[str] | None = None,
        accuracy: str = "float64",
        tolerance: float | None = None,
        time_budget: float | None = None,
        contact_set: bool = True,
        rotation: bool = True,
    ) -> PairContacts:
        """All pairs, allowed ones aside, that touch within the next `horizon` seconds if every twist stays as it is.

        Polygons, boxes and hulls in pure translation are followed at every tier; at "float64" also spheres and
        capsules, and whatever of these turns, about the origin of its pose.  Pairs at rest relative to each other
        touch now or never; any pair that is in contact now answers time 0.  Other motions answer UNSUPPORTED by name.
        At tier "bound" a row means that the pair may touch, TOUCHING that it may already.

        Parameters
        ----------
        horizon : float
            [s], >= 0; may be inf.
        margin : float
            Bodies are in contact that are no further apart than this [m], >= 0: ``time`` is when they have come so
            near, OVERLAPPING that they are nearer at the start.  Only at tier "float64".
        earliest : bool
            Answer only the pair that is first in contact, by ``time`` and then by ids, and what is UNSUPPORTED among
            the pairs looked at for that: those whose boxes meet later are not (``cost.counts["later"]``).
        ids, others, accuracy
            As for `distances`.
        tolerance : float, optional
            Widest time interval [s] of WILL_TOUCH, > 0, by default 1e-6 of what is followed step by step: each pair is
            answered by the cheapest tier that proves it; NOT_CONVERGED where none does.
        time_budget : float, optional
            Seconds after which nothing more is begun, > 0: pairs that are then left are NOT_CONVERGED, with what
            bounding volumes say of ``time_lower``.
        contact_set : bool
            Whether to find the contact points; without them ``points`` is empty.
        rotation : bool
            Whether to follow what turns; without it that is UNSUPPORTED unless it is in contact now.

        Returns
        -------
        PairContacts

        Raises
        ------
        GeometryError
            Names the argument and the fault; a `SceneError` for unknown ids.
        """
        start = time.perf_counter_ns()
        limit = _validate.limit(horizon, "horizon")
        near = nearness(margin, accuracy)
        quality = Quality.of(accuracy, tolerance, time_budget)
        question = Question(limit, accuracy, near, contact_set=contact_set, rotation=rotation)
        world = self.world
        selection = _selection(world, ids, others)
        counts = _considered(world, selection)

        def follow(pairs: IntArray) -> tuple[ContactRows, Unsupported, str]:
            if quality.climbs:
                return climbed_contact_rows(world, pairs, question, quality, counts)
            return *contact_rows(world, pairs, question, counts), accuracy

        def find(pairs: IntArray) -> Found:
            rows, unsupported, tier = (
                first_contact_row(world, pairs, near, counts, follow) if earliest else follow(pairs)
            )
            return Found(rows, closing_speeds(world, rows), unsupported, tier)

        def swept(world: World, rows: IntArray | None) -> Aabbs:
            return boxes_swept(world, limit, rows)

        # Which pair is first depends on all others: only the same world has the same one.
        name = ("earliest", world.version) if earliest else "first contacts"
        found = self._found((name, question, quality), world, swept, near, selection, quality, counts, find)
        rows, unsupported, tier = found.rows, found.unsupported, found.tier
        counts["unsupported"] += len(unsupported.pairs)
        return PairContacts(
            Cost(time.perf_counter_ns() - start, tier, dict(counts)),
            world.version,
            world.stamp,
            _message(world, unsupported),
            world.ids,
            rows.pairs,
            (unsupported.pairs, unsupported.reason.tolist()),
            rows.status,
            rows.time,
            rows.lower,
            rows.upper,
            rows.last_time,
            rows.normal,
            found.speed,
            *found.sets,
        )

    def cull(
        self,
        frustum: Frustum,
        *,
        ids: Iterable[str] | None = None,
        accuracy: str = "float64",
        tolerance: float | None = None,
        time_budget: float | None = None,
    ) -> SceneCull:
        """What a camera frustum sees of every object.

        Boxes, spheres, capsules, hulls, half spaces and polygons are judged themselves, other kinds by their
        bounding box: MAY_INTERSECT where that is not enough.  Tier "bound" looks at bounding volumes only, and answers
        INTERSECTS where they leave it open; "exact" leaves doubt only about spheres and capsules that touch within the
        rounding of a distance, about half spaces, and where an object may be elsewhere.

        Parameters
        ----------
        frustum : Frustum
            Fixed frame.
        ids : iterable of str, optional
            Only these objects.
        accuracy : str
            Tier; see the numerics page.  "auto" takes for each object the cheapest that is certain.
        tolerance : float, optional
            As in `geomsrv.cull`.
        time_budget : float, optional
            Seconds after which nothing more is begun, > 0: bounding volumes speak for the objects that are then left.

        Returns
        -------
        SceneCull
        """
        start = time.perf_counter_ns()
        quality = Quality.of(accuracy, tolerance, time_budget)
        if not isinstance(frustum, Frustum):
            raise GeometryError(f"frustum must be Frustum, got {type(frustum).__name__}")
        world = self.world
        rows = np.arange(len(world)) if ids is None else np.flatnonzero(_members(world, ids, "ids"))
        counts: Counter[str] = Counter(objects=len(rows))

        def look(rows: IntArray) -> tuple[Sight, str]:
            return seen(world, rows, frustum, quality, counts)

        if ids is None and quality.time_budget == np.inf:
            question = ("cull", frustum.packed().tobytes(), quality)
            (state, certain, boxed), tier = self._memory.objects(question, world, counts, look)
            state, certain = state.copy(), certain.copy()
        else:
            (state, certain, boxed), tier = look(rows)
        message = f"judged by their bounding box: {', '.join(boxed)}" if boxed else ""
        return SceneCull(
            list(world.ids) if ids is None else [world.ids[k] for k in rows.tolist()],
            state,
            certain,
            message,
            Cost(time.perf_counter_ns() - start, tier, dict(counts)),
            world.version,
            world.stamp,
        )

    def forget(self) -> None:
        """Drop what is remembered of earlier answers: the next ones are found anew, and are the same."""
        self._memory = Memory()

    def plan(self) -> str:
        """In words, line by line: what each query computes for what is in the scene, and what is skipped and why."""
        world = self.world
        return describe(world, self.fixed_frame, len(self._allowed))

    # ----------------------------------------------------------------------------------------------- internals

    def _rebuilt(self) -> World:
        old, ids = self._world, tuple(sorted(self._objects))
        objects = [self._objects[name] for name in ids]
        distinct = {id(o.shape): o.shape for o in objects}
        number = {key: k for k, key in enumerate(distinct)}
        shapes = list(distinct.values())
        same = len(shapes) == len(old.table.shapes) and all(map(operator.is_, shapes, old.table.shapes))
        # States that came by `set_states` are newer than what the objects were added with.
        source = np.array([-1 if name in self._replaced else old.index.get(name, -1) for name in ids], dtype=np.int64)
        poses, twists, drift = np.empty((len(ids), 7)), np.empty((len(ids), 6)), np.empty(len(ids))
        kept = source >= 0
        for mine, theirs in ((poses, old.poses), (twists, old.twists), (drift, old.velocity_uncertainty)):
            mine[kept] = theirs[source[kept]]
        for k in np.flatnonzero(~kept).tolist():
            poses[k], twists[k], drift[k] = objects[k].pose, objects[k].twist, objects[k].velocity_uncertainty
        faults = {k: objects[k].motion_fault for k in np.flatnonzero(~kept).tolist()}
        faults |= {k: old.motion_faults.get(row, "") for k, row in enumerate(source.tolist()) if row >= 0}
        index = {name: k for k, name in enumerate(ids)}
        keys = [index[a] * len(ids) + index[b] for a, b in self._allowed if a in index and b in index]
        return World(
            ids=ids,
            index=index,
            table=old.table if same else ShapeTable.of(shapes, old.table),
            shape=np.array([number[id(o.shape)] for o in objects], dtype=np.int64),
            uncertainty=np.array([o.uncertainty for o in objects], dtype=np.float64),
            velocity_uncertainty=drift,
            motion_faults={k: fault for k, fault in faults.items() if fault},
            poses=poses,
            twists=twists,
            allowed=np.array(sorted(keys), dtype=np.int64),
            version=self._version,
            stamp=self._stamp,
        )

    def _checked(self, objects: Sequence[Any], faults: Faults) -> dict[str, SceneObject]:
        """Objects in the fixed frame, with checked numbers; what is wrong goes to `faults`."""
        good: dict[str, Any] = {}
        for k, item in enumerate(objects):
            if not isinstance(item, SceneObject):
                _blame(faults, f"add[{k}]", f"must be SceneObject, got {type(item).__name__}")
            elif not isinstance(item.id, str) or not item.id:
                _blame(faults, f"add[{k}]", f"id must be a name, got {item.id!r}")
            elif item.id in good:
                _blame(faults, item.id, "added twice")
            else:
                good[item.id] = item
        for name, item in good.items():
            if not isinstance(item.shape, Shape | Frustum):
                _blame(faults, name, f"shape must be Shape, got {type(item.shape).__name__}")
            if not isinstance(item.frame, str):
                _blame(faults, name, f"frame must be a name, got {item.frame!r}")
        items = list(good.values())
        poses, wrong_pose = numbers([item.pose for item in items], "pose", IDENTITY)
        twists, wrong_twist = numbers([item.twist for item in items], "twist", np.zeros(6))
        bounds = [[item.uncertainty, item.velocity_uncertainty] for item in items]
        radii, wrong_radius = numbers(bounds, "uncertainty and velocity_uncertainty", np.zeros(2))
        poses, unlike_pose = settled(poses, twists)
        frames = [item.frame if isinstance(item.frame, str) else "" for item in items]
        poses, twists, unknown_frame = in_fixed_frame(poses, twists, frames, self.fixed_frame, self._transforms)
        planar = np.array([isinstance(item.shape, Polygon) for item in items], dtype=bool)
        poses, unlike_plane = laid_flat(poses, twists, planar)
        negative = {
            k: f"{('uncertainty', 'velocity_uncertainty')[column]} must be finite and >= 0, got {radii[k, column]}"
            for k, column in np.argwhere(~((radii >= 0.0) & (radii < np.inf))).tolist()
        }
        # The first fault of an object in this order: later ones may only follow from it.
        found = unlike_plane | unknown_frame | unlike_pose | negative | wrong_radius | wrong_twist | wrong_pose
        for k, text in sorted(found.items()):
            _blame(faults, items[k].id, text)
        return {
            item.id: SceneObject(
                item.id, item.shape, poses[k], twists[k], "", float(radii[k, 0]), float(radii[k, 1]), item.motion_fault
            )
            for k, item in enumerate(items)
        }

    def _resolve(self, ids: Sequence[str], world: World) -> IntArray:
        """Rows of the ids, looked up once: a stream of states names the same ids again and again."""
        known, index, rows = self._resolved
        if index is world.index and (ids is known or list(ids) == known):
            return rows
        names = _names(ids, "ids")
        faults: Faults = {}
        for name, times in Counter(names).items():
            if name not in world.index:
                _blame(faults, name, "no such object")
            elif times > 1:
                _blame(faults, name, "listed twice")
        if faults:
            raise SceneError(faults)
        rows = np.array([world.index[name] for name in names], dtype=np.int64)
        # A list may change under us, so it is kept as a copy; comparing it costs no look-up.
        self._resolved = (ids if isinstance(ids, tuple) else names, world.index, rows)
        return rows

    def _found(
        self,
        question: Any,
        world: World,
        boxes: Callable[[World, IntArray | None], Aabbs],
        margin: float,
        selection: Selection | None,
        quality: Quality,
        counts: Counter[str],
        find: Callable[[IntArray], Found],
    ) -> Found:
        """What `find` says of the pairs whose boxes are near enough, with what is remembered of an earlier answer."""
        if selection is not None or quality.time_budget < np.inf:
            return find(_near(world, boxes(world, None), margin, selection, counts))
        return self._memory.pairs(question, world, boxes, margin, counts, find)

    def _distances(
        self,
        start: int,
        limit: float,
        ids: Iterable[str] | None,
        others: Iterable[str] | None,
        want: Sequence[str],
        quality: Quality,
    ) -> PairDistances:
        penetration = "penetration" in _validate.want(want, EFFECTS)
        world = self.world
        selection = _selection(world, ids, others)
        counts = _considered(world, selection)
        points = "witness" in want

        def find(pairs: IntArray) -> Found:
            if quality.climbs:
                answer = climbed_distance_rows(world, pairs, penetration, quality, counts, limit, points)
            else:
                answer = *distance_rows(world, pairs, penetration, quality.accuracy, counts), quality.accuracy
            rows, unsupported, tier = answer
            open_ended = (rows.uncertainty > 0.0) | (rows.status == DistanceStatus.NOT_CONVERGED)
            rows = rows.take((rows.distance <= limit) | (open_ended & (rows.lower <= limit)))
            return Found(rows, np.zeros(0), unsupported, tier)

        question = ("distances", limit, penetration, points, quality)
        found = self._found(question, world, boxes_now, limit, selection, quality, counts, find)
        return _pair_distances(world, found.rows, found.unsupported, start, found.tier, counts)


# ---------------------------------------------------------------------------------------------------- the edge


def _blame(faults: Faults, name: object, text: str) -> None:
    """Add a fault of one object to those it has."""
    key = name if isinstance(name, str) else repr(name)
    faults[key] = f"{faults[key]}; {text}" if key in faults else text


def _names(ids: Iterable[str], argument: str) -> list[str]:
    """A list of ids, whether or not there are such objects."""
    if isinstance(ids, str):
        raise GeometryError(f"{argument} must list ids, got the string {ids!r}")
    names: list[Any] = list(ids)
    for k, name in enumerate(names):
        if not isinstance(name, str):
            raise GeometryError(f"{argument}[{k}] must be an id, got {name!r}")
    return names


def _pairs(pairs: Iterable[Pair], argument: str, faults: Faults) -> list[Pair]:
    """Pairs of ids, smaller id first."""
    out = []
    for k, pair in enumerate(pairs):
        names = tuple(pair) if isinstance(pair, tuple | list) else ()
        if len(names) != 2 or not all(isinstance(name, str) and name for name in names):
            _blame(faults, f"{argument}[{k}]", f"must be a pair of ids, got {pair!r}")
        elif names[0] == names[1]:
            _blame(faults, names[0], f"{argument}: an object makes no pair with itself")
        else:
            out.append((min(names), max(names)))
    return out


def _array(value: ArrayLike, name: str, shape: tuple[int, int]) -> FloatArray:
    """Numbers of the given shape; whether they are finite is judged later, by object."""
    array = np.asarray(value)
    if array.dtype.kind not in "fiu" or array.shape != shape:
        return _validate.floats(array, name, shape)
    return np.ascontiguousarray(array, dtype=np.float64)


def _members(world: World, ids: Iterable[str], name: str) -> BoolArray:
    """(n,) bool: the objects listed."""
    listed = _names(ids, name)
    unknown = [name for name in listed if name not in world.index]
    if unknown:
        raise SceneError(dict.fromkeys(unknown, "no such object"))
    mask = np.zeros(len(world), dtype=bool)
    mask[[world.index[name] for name in listed]] = True
    return mask


def _selection(world: World, ids: Iterable[str] | None, others: Iterable[str] | None) -> Selection | None:
    if ids is None:
        if others is not None:
            raise GeometryError("others narrows down ids: give ids too")
        return None
    first = _members(world, ids, "ids")
    return Selection(first, np.ones_like(first) if others is None else _members(world, others, "others"))


# ---------------------------------------------------------------------------------------------------- answers


def _considered(world: World, selection: Selection | None) -> Counter[str]:
    """Fresh counters: objects, and the pairs the broad phase has to choose from."""
    if selection is None:
        pairs = sum(len(family) * (len(family) - 1) // 2 for family in world.families)
    else:
        pairs = sum(selection.pair_count(family) for family in world.families)
    return Counter({"objects": len(world), "pairs": pairs, "candidates": 0, "allowed": 0})


def _near(world: World, boxes: Aabbs, margin: float, selection: Selection | None, counts: Counter[str]) -> IntArray:
    """Pairs of either family whose boxes are near enough."""
    found = [candidates(world, family, boxes, margin, selection) for family in world.families]
    counts["candidates"] += sum(part.found for part in found)
    counts["allowed"] += sum(part.allowed for part in found)
    return np.concatenate([part.pairs for part in found])


def _pair_distances(
    world: World, rows: DistanceRows, unsupported: Unsupported, start: int, tier: str, counts: Counter[str]
) -> PairDistances:
    counts["unsupported"] += len(unsupported.pairs)
    return PairDistances(
        Cost(time.perf_counter_ns() - start, tier, dict(counts)),
        world.version,
        world.stamp,
        _message(world, unsupported),
        world.ids,
        rows.pairs,
        (unsupported.pairs, unsupported.reason.tolist()),
        rows.distance,
        rows.lower,
        rows.upper,
        rows.point_a,
        rows.point_b,
        rows.normal,
        rows.status,
    )


def _message(world: World, unsupported: Unsupported) -> str:
    """What is left out, once for each reason."""
    reasons = Counter(unsupported.reason.tolist())
    parts = [f"{count} x {reason}" for reason, count in sorted(reasons.items())]
    solids, polygons = world.families
    if len(solids) and len(polygons):
        parts.append(f"{len(polygons)} polygons are compared with each other only, never with {len(solids)} solids")
    return "; ".join(parts)
