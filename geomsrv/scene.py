# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""A world of named shapes: poses, twists, allowed pairs; atomic updates, and queries over all pairs that matter.

Numpy only.  Solids are compared with solids.  Planar shapes (`Polygon`) live in the plane z = 0 of the fixed frame and
are compared with each other only.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from enum import IntEnum
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from geomsrv.answers import BoolArray, ByteArray, Cost, FloatArray, IntArray
from geomsrv.shapes import Frustum, Shape

__all__ = ["PairContacts", "PairDistances", "Scene", "SceneCull", "SceneObject", "SceneUpdate", "Visibility"]

Pair = tuple[str, str]


@dataclass(frozen=True, eq=False)
class SceneObject:
    """One named shape.  A plain record: `Scene.apply` checks it, so that one refusal can name every bad object.

    Attributes
    ----------
    id : str
        Not empty.
    shape : Shape
    pose : (7,) float
        x y z [m], qx qy qz qw: pose of the shape in `frame`.  A `Polygon` must stay in the plane: z = 0, no tilt.
    twist : (6,) float
        vx vy vz [m/s], wx wy wz [rad/s] along the axes of `frame`, of the shape's origin and about it.
        `frame` itself counts as being at rest.
    frame : str
        Frame `pose` and `twist` are given in; empty is the scene's fixed frame.  Converted once, by `Scene.apply`:
        what the scene gives back is in the fixed frame.
    uncertainty : float
        Radius [m] >= 0 by which each vertex may be off, e.g. because it came as float32.  Widens the interval of every
        answer the object has part in.
    """

    id: str
    shape: Shape
    pose: ArrayLike = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)
    twist: ArrayLike = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    frame: str = ""
    uncertainty: float = 0.0


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
        Pairs whose contact is allowed, that is, pairs to ignore.  The ids need not be present (yet): an SRDF lists
        links without geometry.  An id with itself is a fault.
    disallow : sequence of (str, str)
        Allowed pairs to check again.  A pair that is not allowed is a fault: a misspelt one would stay ignored.
    """

    add: Sequence[SceneObject] = ()
    remove: Sequence[str] = ()
    clear: bool = False
    allow: Sequence[Pair] = ()
    disallow: Sequence[Pair] = ()


class Visibility(IntEnum):
    """What a frustum sees of an object; the first three are those of `CullState`."""

    OUTSIDE = 0  #: no common point
    INTERSECTS = 1  #: a common point, and a point of the object outside the frustum
    INSIDE = 2  #: every point of the object is in the frustum
    MAY_INTERSECT = 3  #: not inside; its bounding box meets the frustum, and there is no kernel to tell more


@dataclass(frozen=True, eq=False)
class _PairRows:
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
        Distance [m] and a proven interval around the exact value, widened by the objects' uncertainty.  0 for touching
        and overlapping bodies, or minus the penetration depth if ``want`` named "penetration".
    point_a, point_b : (n, 3) float64
        Nearest points, or the deepest ones, fixed frame.
    normal : (n, 3) float64
        Unit, from a to b, fixed frame; NaN where there is none.
    status : (n,) uint8
        `DistanceStatus` OK or NOT_CONVERGED; unsupported pairs are in `unsupported` and have no row.
    unsupported : list of (str, str, str)
        Id, id and reason of each pair near enough to matter that no kernel answers.
    cost : Cost
        ``counts``: objects, pairs, allowed, candidates, "narrow <kind>-<kind>" calls, unsupported.
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
        `ContactStatus`.  UNSUPPORTED: apart now, and no kernel for how the two move; also listed in `unsupported`.
        NEVER: apart throughout as given, but within their uncertainty they may touch from ``time_lower`` on.
    time, time_lower, time_upper : (n,) float64
        First contact [s] and a proven interval, widened by the objects' uncertainty; an upper end of inf: within the
        uncertainty they may pass each other.
    last_time : (n,) float64
        Last contact [s], at most the horizon; NaN where no kernel follows the motion.
    normal : (n, 3) float64
        Unit contact normal from a to b at ``time``, fixed frame; NaN where there is none.
    points : (k, 3) float64, point_offsets : (n + 1,) int64
        Contact set of row i: ``points[point_offsets[i]:point_offsets[i + 1]]``, at ``time``, fixed frame.
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
    points: FloatArray
    point_offsets: IntArray


@dataclass(frozen=True, eq=False)
class SceneCull:
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

    Parameters
    ----------
    fixed_frame : str
        Name of the frame all answers are in.
    allowed_pairs : iterable of (str, str)
        Pairs to ignore from the start; `SceneUpdate.clear` keeps them.
    transforms : callable, optional
        ``transforms(frame)`` gives the pose (7,) of `frame` in the fixed frame, or raises an exception whose text says
        why not.  Without it an object given in another frame is refused by name.

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
        raise NotImplementedError

    @property
    def version(self) -> int:
        """Grows by one with every change that took effect; 0 at first."""
        raise NotImplementedError

    @property
    def stamp(self) -> Any:
        """The newest stamp given to `set_states`; None before."""
        raise NotImplementedError

    @property
    def ids(self) -> tuple[str, ...]:
        """Every object's id, sorted."""
        raise NotImplementedError

    @property
    def allowed_pairs(self) -> frozenset[Pair]:
        """Pairs that are ignored, smaller id first."""
        raise NotImplementedError

    def __len__(self) -> int:
        raise NotImplementedError

    def __contains__(self, name: object) -> bool:
        raise NotImplementedError

    def __iter__(self) -> Iterator[str]:
        raise NotImplementedError

    def __getitem__(self, name: str) -> SceneObject:
        """The object as it is now, in the fixed frame; KeyError for an unknown id."""
        raise NotImplementedError

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
        raise NotImplementedError

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
            vx vy vz [m/s], wx wy wz [rad/s], fixed frame; without it the twists stay as they are.
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
        raise NotImplementedError

    def distances(
        self,
        max_distance: float,
        *,
        ids: Iterable[str] | None = None,
        others: Iterable[str] | None = None,
        want: Sequence[str] = ("distance",),
        accuracy: str = "float64",
    ) -> PairDistances:
        """All pairs, allowed ones aside, that are at most `max_distance` apart.

        A pair whose interval is wide (uncertain vertices, or iterations that ran out) is listed as soon as its lower
        end is that small.

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
            Tier; see the numerics page.

        Returns
        -------
        PairDistances

        Raises
        ------
        GeometryError
            Names the argument and the fault; a `SceneError` for unknown ids.
        """
        raise NotImplementedError

    def contacts(
        self, *, ids: Iterable[str] | None = None, others: Iterable[str] | None = None, accuracy: str = "float64"
    ) -> PairDistances:
        """All pairs that touch or overlap now, with penetration depth; arguments as for `distances`."""
        raise NotImplementedError

    def nearest_pair(
        self,
        *,
        ids: Iterable[str] | None = None,
        others: Iterable[str] | None = None,
        want: Sequence[str] = ("distance",),
        accuracy: str = "float64",
    ) -> PairDistances:
        """The pair with the smallest distance, one row; no row if no pair is supported.

        Of equally near pairs the first by (id_a, id_b); with "penetration" in `want` the deepest.  `unsupported` lists
        those that may be nearer.  Arguments as for `distances`.
        """
        raise NotImplementedError

    def first_contacts(
        self,
        horizon: float,
        *,
        ids: Iterable[str] | None = None,
        others: Iterable[str] | None = None,
        accuracy: str = "float64",
    ) -> PairContacts:
        """All pairs, allowed ones aside, that touch within the next `horizon` seconds if every twist stays as it is.

        Polygons in pure translation are followed; pairs at rest relative to each other touch now or never; any pair
        that is in contact now answers time 0.  Other motions answer UNSUPPORTED by name.

        Parameters
        ----------
        horizon : float
            [s], >= 0; may be inf.
        ids, others, accuracy
            As for `distances`.

        Returns
        -------
        PairContacts

        Raises
        ------
        GeometryError
            Names the argument and the fault; a `SceneError` for unknown ids.
        """
        raise NotImplementedError

    def cull(self, frustum: Frustum, *, ids: Iterable[str] | None = None, accuracy: str = "float64") -> SceneCull:
        """What a camera frustum sees of every object.

        Boxes, spheres, capsules, hulls, half spaces and polygons are judged themselves, other kinds by their bounding
        box: MAY_INTERSECT where that is not enough.

        Parameters
        ----------
        frustum : Frustum
            Fixed frame.
        ids : iterable of str, optional
            Only these objects.
        accuracy : str
            Tier; see the numerics page.

        Returns
        -------
        SceneCull
        """
        raise NotImplementedError

    def plan(self) -> str:
        """In words, line by line: what each query computes for what is in the scene, and what is skipped and why."""
        raise NotImplementedError
