# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""Shapes: validated, immutable values.  No query lives here.

Batches in world coordinates (`Boxes`, `Polygons`, `Polytopes`), one-off shapes in their own frame (`Sphere`,
`Box`, `Convex`, ...), and the view `Frustum`, which is both.  The numbers are taken literally: a box is the
convex hull of center +- e_i * axes_i even where the axes are not perfectly orthonormal.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from geomsrv import _core, _validate
from geomsrv.answers import gather
from geomsrv.errors import GeometryError
from geomsrv.mesh_tree import Tree, ordered

__all__ = [
    "Box",
    "Boxes",
    "Capsule",
    "Cone",
    "Convex",
    "Cylinder",
    "Ellipsoid",
    "Frustum",
    "Frustum2D",
    "HalfSpace",
    "Mesh",
    "Point",
    "Polygon",
    "Polygons",
    "Polytopes",
    "Segment",
    "Shape",
    "Sphere",
    "Triangle",
    "pack",
]

FloatArray = NDArray[np.float64]

# Signs of the eight corners of a box, row i = bits of i (x fastest).
CORNER_SIGNS = np.array([[2.0 * (i >> k & 1) - 1.0 for k in range(3)] for i in range(8)])

# A rounded corner is off by less than this times its size.  A coordinate takes at most 7 roundings of numbers no larger
# than the largest coordinate of any corner, of 1/2 eps each; three coordinates make 7/2 sqrt(3) eps.
CORNER_ERROR = 8 * float(np.finfo(np.float64).eps)


def frozen(array: NDArray[Any]) -> NDArray[Any]:
    """A read-only copy: no shape changes under a query, and even the owner of a read-only array can undo that."""
    copy = array.copy()
    copy.setflags(write=False)
    return copy


def freeze(value: Any, **fields: Any) -> None:
    """Set fields of a frozen dataclass, arrays as read-only copies."""
    for name, field in fields.items():
        object.__setattr__(value, name, frozen(field) if isinstance(field, np.ndarray) else field)


# ------------------------------------------------------------------------------------------------ view frusta


def _window(left: Any, up: Any, bounds: Any, names: tuple[str, ...]) -> tuple[float, ...]:
    """Half widths, or the off-centre bounds, as (l0, l1[, u0, u1])."""
    halves = (left, up)[: len(names)]
    if bounds is None:
        for name, half in zip(names, halves, strict=True):
            if half is None:
                raise GeometryError(f"{name} is missing: give {' and '.join(names)}, or bounds")
        sizes = [_validate.scalar(h, n, positive=True) for h, n in zip(halves, names, strict=True)]
        return tuple(sign * size for size in sizes for sign in (-1.0, 1.0))
    if any(half is not None for half in halves):
        raise GeometryError(f"bounds and {' or '.join(names)} exclude each other")
    window = _validate.floats(bounds, "bounds", (2 * len(names),)).tolist()
    for k in range(len(names)):
        if not window[2 * k] < window[2 * k + 1]:
            raise GeometryError(
                f"bounds[{2 * k}] must be < bounds[{2 * k + 1}], got {window[2 * k]}, {window[2 * k + 1]}"
            )
    return tuple(window)


def _depths(near: Any, far: Any) -> tuple[float, float]:
    if near is None or far is None:
        raise GeometryError(f"{'near' if near is None else 'far'} is missing")
    near, far = _validate.scalar(near, "near", positive=True), _validate.scalar(far, "far", positive=True)
    if not near < far:
        raise GeometryError(f"far must be > near = {near}, got {far}")
    return near, far


@dataclass(frozen=True, init=False, eq=False)
class Frustum:
    """View frustum: the part of a pyramid between a near and a far plane.

    Its points are ``origin + t * (x L + y U + near D)`` with ``l0 <= x <= l1``, ``u0 <= y <= u1`` and
    ``1 <= t <= far / near``.

    Parameters
    ----------
    origin : (3,) float
        Apex E [m], world frame.
    axes : (3, 3) float
        Rows L (left), U (up), D (view direction), orthonormal; either handedness.
    left, up : float
        Half widths of the window on the near plane [m]; leave out if `bounds` is given.
    near, far : float
        Depths of the near and far planes [m], ``0 < near < far``.
    bounds : (4,) float, optional
        ``(l0, l1, u0, u1)``, an off-centre window on the near plane [m].

    Raises
    ------
    GeometryError
        Names the argument and the fault.

    References
    ----------
    Eberly, *Intersection of Orthogonal View Frustum and Oriented Bounding Box* (2000), section 3; off-centre
    windows are ours.

    Examples
    --------
    >>> import geomsrv as gs
    >>> gs.Frustum([0, 0, 0], [[1, 0, 0], [0, 1, 0], [0, 0, 1]], 1.0, 0.5, 1.0, 4.0).bounds
    (-1.0, 1.0, -0.5, 0.5)
    """

    origin: FloatArray
    axes: FloatArray
    bounds: tuple[float, float, float, float]
    near: float
    far: float
    kind: ClassVar[str] = "frustum"

    def __init__(
        self,
        origin: ArrayLike,
        axes: ArrayLike,
        left: float | None = None,
        up: float | None = None,
        near: float | None = None,
        far: float | None = None,
        *,
        bounds: ArrayLike | None = None,
    ) -> None:
        window = _window(left, up, bounds, ("left", "up"))
        near_depth, far_depth = _depths(near, far)
        freeze(
            self,
            origin=_validate.floats(origin, "origin", (3,)),
            axes=_validate.axes(axes, "axes", (3, 3)),
            bounds=window,
            near=near_depth,
            far=far_depth,
        )

    @classmethod
    def look_at(
        cls,
        eye: ArrayLike,
        target: ArrayLike,
        up: ArrayLike,
        fov_y: float,
        aspect: float,
        near: float,
        far: float,
    ) -> Frustum:
        """Frustum of a camera at `eye` that looks at `target`.

        Parameters
        ----------
        eye, target : (3,) float
            Positions [m], world frame.
        up : (3,) float
            Direction that shall appear upwards; need not be perpendicular to the view direction.
        fov_y : float
            Full vertical opening angle [rad], in (0, pi).
        aspect : float
            Width over height of the window.
        near, far : float
            Depths [m].

        Examples
        --------
        >>> import math, geomsrv as gs
        >>> gs.Frustum.look_at([0, 0, 0], [1, 0, 0], [0, 0, 1], math.pi / 2, 1.0, 0.1, 10.0).axes[2]
        array([1., 0., 0.])
        """
        start, end = _validate.floats(eye, "eye", (3,)), _validate.floats(target, "target", (3,))
        upward = _validate.floats(up, "up", (3,))
        angle = _validate.scalar(fov_y, "fov_y", positive=True)
        if not angle < np.pi:
            raise GeometryError(f"fov_y must be < pi, got {angle}")
        ratio = _validate.scalar(aspect, "aspect", positive=True)
        near_depth, far_depth = _depths(near, far)
        if (start == end).all():
            raise GeometryError("target must differ from eye")
        view = end / 2.0 - start / 2.0  # halved, so that the difference cannot overflow
        view = view / np.abs(view).max()
        view = view / math.hypot(*view)
        if not upward.any():
            raise GeometryError("up must not be zero")
        side = np.cross(upward / np.abs(upward).max(), view)
        # Below sqrt(eps) the side direction would be mostly rounding noise of the cross product.
        if math.hypot(*side) <= np.sqrt(np.finfo(float).eps):
            raise GeometryError("up must not be parallel to the view direction")
        side = side / math.hypot(*side)
        half = near_depth * math.tan(angle / 2.0)
        return cls(start, [side, np.cross(view, side), view], half * ratio, half, near_depth, far_depth)

    @classmethod
    def from_intrinsics(
        cls, K: ArrayLike, width: float, height: float, X_world_camera: ArrayLike, near: float, far: float
    ) -> Frustum:
        """Frustum of a pinhole camera.

        Parameters
        ----------
        K : (3, 3) float
            Intrinsics [pixel]: fx, fy on the diagonal, cx, cy in the last column, no skew.
        width, height : float
            Image size [pixel]; pixel (u, v) covers [u, u + 1) x [v, v + 1), so the image spans 0 to width.
        X_world_camera : (4, 4) float or (7,) float
            Pose of the optical frame (z forward, x right, y down) in the world: a homogeneous matrix, or
            x y z qx qy qz qw.
        near, far : float
            Depths along the optical axis [m].

        Examples
        --------
        >>> import numpy as np, geomsrv as gs
        >>> K = [[500, 0, 320], [0, 500, 240], [0, 0, 1]]
        >>> gs.Frustum.from_intrinsics(K, 640, 480, np.eye(4), 0.5, 10.0).bounds
        (-0.32, 0.32, -0.24, 0.24)
        """
        matrix = _validate.floats(K, "K", (3, 3))
        wide = _validate.scalar(width, "width", positive=True)
        high = _validate.scalar(height, "height", positive=True)
        near_depth, far_depth = _depths(near, far)
        (fx, skew, cx), (shear, fy, cy), last = matrix
        if not (fx > 0.0 and fy > 0.0):
            raise GeometryError(f"K must have positive focal lengths, got fx={fx}, fy={fy}")
        if skew != 0.0 or shear != 0.0 or tuple(last) != (0.0, 0.0, 1.0):
            raise GeometryError("K must be [[fx, 0, cx], [0, fy, cy], [0, 0, 1]]; skew is not supported")
        pose = _validate.array(X_world_camera, "X_world_camera")
        if pose.ndim == 1:
            pose = _validate.poses(pose, "X_world_camera")
            position, rotation = pose[0, :3], _validate.rotation_matrices(pose[:, 3:])[0]
        else:
            pose = _validate.floats(pose, "X_world_camera", (4, 4))
            if tuple(pose[3]) != (0.0, 0.0, 0.0, 1.0):
                raise GeometryError("X_world_camera must have last row 0 0 0 1")
            position, rotation = pose[:3, 3], _validate.axes(pose[:3, :3], "X_world_camera[:3, :3]", (3, 3))
        right, down, forward = rotation.T
        window = (
            near_depth * (cx - wide) / fx,
            near_depth * cx / fx,
            near_depth * (cy - high) / fy,
            near_depth * cy / fy,
        )
        return cls(position, [-right, -down, forward], near=near_depth, far=far_depth, bounds=window)

    def packed(self) -> FloatArray:
        """(18,) float64 as the engine reads it: origin, axes by rows, l0, l1, u0, u1, near, far."""
        return np.concatenate([self.origin, self.axes.ravel(), self.bounds, [self.near, self.far]])

    def corners(self, origin: ArrayLike = (0.0, 0.0, 0.0)) -> FloatArray:
        """Corners relative to `origin`, by default the world's, rounded.

        (8, 3) for one origin, (n, 8, 3) for (n, 3).  The four of the near plane come first.
        """
        l0, l1, u0, u1 = self.bounds
        near = np.array([[x, y, self.near] for y in (u0, u1) for x in (l0, l1)])
        both = np.concatenate([near, near * (self.far / self.near)])
        # Written out: what a matrix product rounds depends on the processor.
        local: FloatArray = both[:, :1] * self.axes[0] + both[:, 1:2] * self.axes[1] + both[:, 2:] * self.axes[2]
        placed: FloatArray = (self.origin - np.asarray(origin, dtype=np.float64))[..., None, :] + local
        return placed

    def corner_error(self, origin: ArrayLike = (0.0, 0.0, 0.0)) -> FloatArray:
        """How far rounding may have moved `corners` from the exact ones: scalar for one origin, (n,) for (n, 3)."""
        l0, l1, u0, u1 = self.bounds
        reach = (max(-l0, l1) + max(-u0, u1) + self.near) * (self.far / self.near)
        shift = np.abs(self.origin - np.asarray(origin, dtype=np.float64)).max(axis=-1)
        return CORNER_ERROR * (reach + shift)


@dataclass(frozen=True, init=False, eq=False)
class Frustum2D:
    """View trapezoid in the plane, the 2D counterpart of `Frustum`.

    Parameters
    ----------
    origin : (2,) float
        Apex [m], world frame.
    axes : (2, 2) float
        Rows L, D (view direction), orthonormal; either handedness.
    left : float
        Half width on the near line [m]; leave out if `bounds` is given.
    near, far : float
        Depths [m], ``0 < near < far``.
    bounds : (2,) float, optional
        ``(l0, l1)``, an off-centre window on the near line [m].

    References
    ----------
    Eberly, *Distance from Point to Orthogonal Frustum* (2000), section 2; book section 6.3.3.

    Examples
    --------
    >>> import geomsrv as gs
    >>> gs.Frustum2D([0, 0], [[1, 0], [0, 1]], 1.0, 1.0, 4.0).far
    4.0
    """

    origin: FloatArray
    axes: FloatArray
    bounds: tuple[float, float]
    near: float
    far: float

    def __init__(
        self,
        origin: ArrayLike,
        axes: ArrayLike,
        left: float | None = None,
        near: float | None = None,
        far: float | None = None,
        *,
        bounds: ArrayLike | None = None,
    ) -> None:
        window = _window(left, None, bounds, ("left",))
        near_depth, far_depth = _depths(near, far)
        freeze(
            self,
            origin=_validate.floats(origin, "origin", (2,)),
            axes=_validate.axes(axes, "axes", (2, 2)),
            bounds=window,
            near=near_depth,
            far=far_depth,
        )

    def packed(self) -> FloatArray:
        """(10,) float64 as the engine reads it: origin, axes by rows, l0, l1, near, far."""
        return np.concatenate([self.origin, self.axes.ravel(), self.bounds, [self.near, self.far]])


# --------------------------------------------------------------------------------- batches, world coordinates


@dataclass(frozen=True, init=False, eq=False)
class Boxes:
    """Batch of oriented boxes in world coordinates.

    Parameters
    ----------
    center : (n, 3) float
        Centres [m].
    axes : (n, 3, 3) float
        Rows are the unit axes A_i of each box, world frame.
    half_extents : (n, 3) float
        Half sizes along the axes [m], >= 0.

    Examples
    --------
    >>> import numpy as np, geomsrv as gs
    >>> len(gs.Boxes(np.zeros((2, 3)), np.tile(np.eye(3), (2, 1, 1)), np.ones((2, 3))))
    2
    """

    center: FloatArray
    axes: FloatArray
    half_extents: FloatArray

    def __init__(self, center: ArrayLike, axes: ArrayLike, half_extents: ArrayLike) -> None:
        middle = _validate.floats(center, "center", (None, 3))
        rows = _validate.axes(axes, "axes", (len(middle), 3, 3))
        half = _validate.floats(half_extents, "half_extents", (len(middle), 3))
        if (half < 0.0).any():
            i = int(np.argmax((half < 0.0).any(axis=1)))
            raise GeometryError(f"half_extents[{i}] must be >= 0, got {half[i].tolist()}")
        freeze(self, center=middle, axes=rows, half_extents=half)

    @classmethod
    def from_poses(cls, poses: ArrayLike, half_extents: ArrayLike) -> Boxes:
        """Boxes at `poses`, (n, 7) rows x y z qx qy qz qw; `half_extents` (n, 3), or (3,) for all.

        Examples
        --------
        >>> import geomsrv as gs
        >>> gs.Boxes.from_poses([[1, 2, 3, 0, 0, 0, 1]], [0.5, 0.5, 0.5]).center
        array([[1., 2., 3.]])
        """
        rows = _validate.poses(poses, "poses")
        half = _validate.array(half_extents, "half_extents")
        if half.ndim == 1:
            half = np.broadcast_to(_validate.floats(half, "half_extents", (3,)), (len(rows), 3))
        return cls(rows[:, :3], np.swapaxes(_validate.rotation_matrices(rows[:, 3:]), 1, 2), half)

    def __len__(self) -> int:
        return len(self.center)

    def corners(self, origin: FloatArray | None = None) -> FloatArray:
        """(n, 8, 3) float64: corners relative to `origin` (n, 3), rounded; by default the world's."""
        center = self.center if origin is None else self.center - origin
        arms: FloatArray = np.einsum("ck,nk,nkd->ncd", CORNER_SIGNS, self.half_extents, self.axes)
        return center[:, None, :] + arms


def part_of(value: Any, items: NDArray[np.int64], count: int) -> Any:
    """The listed items of a batch of `count`, which were checked already; one body, or one row for all, as it is."""
    if len(items) == count or (isinstance(value, np.ndarray) and len(value) != count):
        return value
    if isinstance(value, np.ndarray):
        return np.ascontiguousarray(value[items])
    if not isinstance(value, Boxes | _Ragged) or len(value) != count:
        return value
    part = object.__new__(type(value))
    if isinstance(value, Boxes):
        fields = {name: np.ascontiguousarray(getattr(value, name)[items]) for name in vars(value)}
    else:
        fields = dict(zip(("vertices", "offsets"), gather(value.vertices, value.offsets, items), strict=True))
    part.__dict__.update(fields)
    return part


class _Ragged:
    """Items of different vertex counts, stored end to end."""

    vertices: FloatArray
    offsets: NDArray[np.int64]
    dimension: ClassVar[int]

    def __len__(self) -> int:
        return len(self.offsets) - 1

    def __getitem__(self, i: int) -> FloatArray:
        """(k, d) float64: vertices of item i."""
        if not -len(self) <= i < len(self):
            raise IndexError(f"item {i} of {len(self)}")
        i %= len(self)
        return self.vertices[self.offsets[i] : self.offsets[i + 1]]

    @classmethod
    def from_list(cls, items: Iterable[ArrayLike]) -> Any:
        """Batch of the vertex arrays listed in `items`, one (k, d) array each."""
        if not isinstance(items, Iterable):
            raise GeometryError(f"items must be a list of vertex arrays, got {type(items).__name__}")
        arrays = [_validate.floats(item, f"items[{i}]", (None, cls.dimension)) for i, item in enumerate(items)]
        ends = np.cumsum([0, *(len(array) for array in arrays)], dtype=np.int64)
        return cls(np.concatenate([np.zeros((0, cls.dimension)), *arrays]), ends)  # type: ignore[call-arg]


@dataclass(frozen=True, init=False, eq=False)
class Polygons(_Ragged):
    """Batch of convex polygons in the plane, world coordinates.

    Parameters
    ----------
    vertices : (m, 2) float
        Counter-clockwise rings, end to end [m].  Repeated and collinear vertices, segments and single points
        are valid.
    offsets : (n + 1,) int
        Ring i is ``vertices[offsets[i]:offsets[i + 1]]``.

    Raises
    ------
    GeometryError
        Names the ring and vertex where it turns clockwise, or says that it winds round more than once.

    Examples
    --------
    >>> import geomsrv as gs
    >>> len(gs.Polygons.from_list([[(0, 0), (1, 0), (0, 1)], [(3, 3)]]))
    2
    >>> gs.Polygons.from_list([[(0, 0), (0, 1), (1, 0)]])
    Traceback (most recent call last):
        ...
    geomsrv.errors.GeometryError: vertices: ring 0 is clockwise
    """

    vertices: FloatArray
    offsets: NDArray[np.int64]
    dimension: ClassVar[int] = 2

    def __init__(self, vertices: ArrayLike, offsets: ArrayLike) -> None:
        points = _validate.floats(vertices, "vertices", (None, 2))
        ends = _validate.offsets(offsets, "offsets", len(points), 1)
        ring, vertex, fault = _core.check_rings(points, ends)
        if fault:
            place = f", at its vertex {vertex}" if vertex >= 0 else ""
            raise GeometryError(f"vertices: ring {ring} is {fault}{place}")
        freeze(self, vertices=points, offsets=ends)


@dataclass(frozen=True, init=False, eq=False)
class Polytopes(_Ragged):
    """Batch of convex polytopes in world coordinates: the convex hulls of the listed points.

    Parameters
    ----------
    vertices : (m, 3) float
        Points [m], end to end; flat sets, segments and single points are valid.
    offsets : (n + 1,) int
        Polytope i is the hull of ``vertices[offsets[i]:offsets[i + 1]]``.

    Examples
    --------
    >>> import geomsrv as gs
    >>> len(gs.Polytopes.from_list([[(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]]))
    1
    """

    vertices: FloatArray
    offsets: NDArray[np.int64]
    dimension: ClassVar[int] = 3

    def __init__(self, vertices: ArrayLike, offsets: ArrayLike) -> None:
        points = _validate.floats(vertices, "vertices", (None, 3))
        freeze(self, vertices=points, offsets=_validate.offsets(offsets, "offsets", len(points), 1))


# ----------------------------------------------------------------------------- single shapes, their own frame


@dataclass(frozen=True, eq=False)
class Shape:
    """A shape in its own frame; queries place it with a pose."""

    kind: ClassVar[str] = ""


@dataclass(frozen=True, init=False, eq=False)
class Sphere(Shape):
    """Ball of `radius` [m] >= 0 about the origin."""

    radius: float
    kind: ClassVar[str] = "sphere"

    def __init__(self, radius: float) -> None:
        freeze(self, radius=_validate.scalar(radius, "radius", minimum=0.0))


@dataclass(frozen=True, init=False, eq=False)
class _Round(Shape):
    """A solid of revolution about z, by `radius` [m] and `length` [m]."""

    radius: float
    length: float

    def __init__(self, radius: float, length: float) -> None:
        freeze(
            self,
            radius=_validate.scalar(radius, "radius", minimum=0.0),
            length=_validate.scalar(length, "length", minimum=0.0),
        )


class Capsule(_Round):
    """All points within `radius` of the segment z = -length/2 to +length/2, the cylinder part."""

    kind: ClassVar[str] = "capsule"


class Cylinder(_Round):
    """Solid cylinder of `radius` about z, from z = -`length`/2 to +`length`/2 [m]."""

    kind: ClassVar[str] = "cylinder"


class Cone(_Round):
    """Solid cone about z, base of `radius` at z = -`length`/2, apex at +`length`/2 [m]."""

    kind: ClassVar[str] = "cone"


@dataclass(frozen=True, init=False, eq=False)
class Ellipsoid(Shape):
    """Solid ellipsoid with half axes `radii` (3,) [m] > 0 along x, y, z."""

    radii: FloatArray
    kind: ClassVar[str] = "ellipsoid"

    def __init__(self, radii: ArrayLike) -> None:
        sizes = _validate.floats(radii, "radii", (3,))
        if not (sizes > 0.0).all():
            raise GeometryError(f"radii must be > 0, got {sizes.tolist()}")
        freeze(self, radii=sizes)


CURVED = (Cylinder, Cone, Ellipsoid)  #: solids that are no polytope, nor one with a ball added to it


@dataclass(frozen=True, init=False, eq=False)
class Box(Shape):
    """Solid box with `half_extents` (3,) [m] >= 0 along x, y, z."""

    half_extents: FloatArray
    kind: ClassVar[str] = "box"

    def __init__(self, half_extents: ArrayLike) -> None:
        half = _validate.floats(half_extents, "half_extents", (3,))
        if (half < 0.0).any():
            raise GeometryError(f"half_extents must be >= 0, got {half.tolist()}")
        freeze(self, half_extents=half)


@dataclass(frozen=True, init=False, eq=False)
class HalfSpace(Shape):
    """Solid where ``normal . x <= offset``; `normal` (3,) is normalised together with `offset` [m]."""

    normal: FloatArray
    offset: float
    kind: ClassVar[str] = "half_space"

    def __init__(self, normal: ArrayLike, offset: float) -> None:
        direction = _validate.floats(normal, "normal", (3,))
        level = _validate.scalar(offset, "offset")
        largest = float(np.abs(direction).max())
        if largest == 0.0:
            raise GeometryError("normal must not be zero")
        # Scaled first: the squares of a huge or tiny normal would overflow or vanish.
        scaled = direction / largest
        length = math.hypot(*scaled)
        distance = level / largest / length
        if not np.isfinite(distance):
            raise GeometryError(f"offset / |normal| must be finite, got {level} / |{direction.tolist()}|")
        freeze(self, normal=scaled / length, offset=distance)


@dataclass(frozen=True, init=False, eq=False)
class Convex(Shape):
    """Convex hull of `vertices` (m, 3) [m], m >= 1; flat sets are valid."""

    vertices: FloatArray
    kind: ClassVar[str] = "convex"

    def __init__(self, vertices: ArrayLike) -> None:
        points = _validate.floats(vertices, "vertices", (None, 3))
        if len(points) == 0:
            raise GeometryError("vertices must hold at least one point")
        freeze(self, vertices=points)


def vertices_of(shape: Box | Convex) -> FloatArray:
    """(m, 3) float64: vertices of a solid that is the hull of them, in its own frame."""
    return CORNER_SIGNS * shape.half_extents if isinstance(shape, Box) else shape.vertices


@dataclass(frozen=True, init=False, eq=False)
class Mesh(Shape):
    """Triangle mesh: `vertices` (m, 3) [m] and `triangles` (k, 3) vertex indices.

    It is a surface, the union of its triangles, in any order, closed or not: what it encloses is no part of it.
    """

    vertices: FloatArray
    triangles: NDArray[np.int64]
    kind: ClassVar[str] = "mesh"

    def with_vertices(self, vertices: ArrayLike) -> Mesh:
        """The same triangles between other vertices (m, 3), as of the mesh after a motion."""
        moved = Mesh(vertices, self.triangles)
        moved.__dict__["order"] = self.order
        return moved

    @cached_property
    def order(self) -> NDArray[np.int64]:
        """Triangles in the order of `ordered`; found on first use."""
        corners = self.vertices[self.triangles]
        return ordered(corners.min(axis=1), corners.max(axis=1))

    @cached_property
    def tree(self) -> Tree:
        """Boxes around triangles, in its own frame; found on first use."""
        corners = self.vertices[self.triangles]
        return Tree.of(corners.min(axis=1), corners.max(axis=1), self.order)

    def __init__(self, vertices: ArrayLike, triangles: ArrayLike) -> None:
        points = _validate.floats(vertices, "vertices", (None, 3))
        faces = _validate.array(triangles, "triangles")
        if faces.dtype.kind not in "iu" or faces.ndim != 2 or faces.shape[1] != 3:
            raise GeometryError(f"triangles must be (k, 3) integers, got {faces.dtype} {faces.shape}")
        if len(faces) == 0:
            raise GeometryError("triangles must hold at least one triangle")
        wrong = (faces < 0) | (faces >= len(points))
        if wrong.any():
            i = int(np.argmax(wrong.any(axis=1)))
            raise GeometryError(f"triangles[{i}] refers to a vertex outside 0..{len(points) - 1}: {faces[i].tolist()}")
        freeze(self, vertices=points, triangles=faces.astype(np.int64))


class _Points(Shape):
    """Base of shapes that are the hull of a few named points, kept as `vertices` (m, 3)."""

    vertices: FloatArray

    def _set(self, **points: ArrayLike) -> None:
        rows = [_validate.floats(point, name, (3,)) for name, point in points.items()]
        freeze(self, vertices=np.stack(rows), **dict(zip(points, rows, strict=True)))


class Triangle(_Points):
    """Flat triangle with corners `a`, `b`, `c` (3,) [m]."""

    kind: ClassVar[str] = "triangle"

    def __init__(self, a: ArrayLike, b: ArrayLike, c: ArrayLike) -> None:
        self._set(a=a, b=b, c=c)


class Segment(_Points):
    """Straight segment from `a` to `b` (3,) [m]."""

    kind: ClassVar[str] = "segment"

    def __init__(self, a: ArrayLike, b: ArrayLike) -> None:
        self._set(a=a, b=b)


class Point(_Points):
    """Single point `p` (3,) [m]."""

    kind: ClassVar[str] = "point"

    def __init__(self, p: ArrayLike) -> None:
        self._set(p=p)


@dataclass(frozen=True, init=False, eq=False)
class Polygon(Shape):
    """Convex counter-clockwise polygon `vertices` (m, 2) [m] in the xy plane of its frame."""

    vertices: FloatArray
    kind: ClassVar[str] = "polygon"

    def __init__(self, vertices: ArrayLike) -> None:
        points = _validate.floats(vertices, "vertices", (None, 2))
        if len(points) == 0:
            raise GeometryError("vertices must hold at least one point")
        Polygons(points, [0, len(points)])
        freeze(self, vertices=points)


# -------------------------------------------------------------------------------------- what the engine reads


class PackedShapes(NamedTuple):
    """Shapes as the engine reads them, one row each."""

    kinds: NDArray[np.uint8]  #: (m,) index into `_core.shape_kinds()`
    params: FloatArray  #: (m, 4): radius | radius, half length | half extents | normal, offset
    vertices: FloatArray  #: (k, 3) vertices of those that are hulls, end to end
    offsets: NDArray[np.int64]  #: (m + 1,)


def pack(shapes: Sequence[Shape | Frustum]) -> PackedShapes:
    """Shapes as the engine reads them."""
    kinds, params, vertices = [], np.zeros((len(shapes), 4)), [np.zeros((0, 3))]
    for row, shape in zip(params, shapes, strict=True):
        hull = np.zeros((0, 3))
        kind = shape.kind
        if isinstance(shape, Sphere):
            row[0] = shape.radius
        elif isinstance(shape, _Round):
            row[:2] = shape.radius, shape.length / 2.0
        elif isinstance(shape, Box):
            row[:3] = shape.half_extents
        elif isinstance(shape, Ellipsoid):
            row[:3] = shape.radii
        elif isinstance(shape, HalfSpace):
            row[:3], row[3] = shape.normal, shape.offset
        elif isinstance(shape, (Convex, _Points)):
            hull, kind = shape.vertices, Convex.kind
        elif isinstance(shape, Frustum):
            hull, kind = shape.corners(), Convex.kind
            row[0] = shape.corner_error()
        kinds.append(_KIND_CODES[kind])
        vertices.append(hull)
    offsets = np.cumsum([len(hull) for hull in vertices], dtype=np.int64)
    return PackedShapes(np.array(kinds, np.uint8), params, np.concatenate(vertices), offsets)


_KIND_CODES = {name: code for code, name in enumerate(_core.shape_kinds())}
