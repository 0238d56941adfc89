# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""Our answer beside FCL's: within which tolerance they agree, and who is wrong if they do not.

Pure functions, no process and no thread.

FCL is a peer, not a judge.  A difference is decided by exact arithmetic where there is a kernel for it; elsewhere it is
FCL's fault only if our witnesses, checked without the engine (`geomsrv._witness`), prove FCL wrong, or if FCL
contradicts itself.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum, StrEnum
from typing import ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray

from geomsrv import _core
from geomsrv._witness import Bracket
from geomsrv.shapes import Frustum, PackedShapes, Shape, pack

__all__ = [
    "PEERS",
    "Blame",
    "Claim",
    "Peer",
    "Rows",
    "Scales",
    "Solid",
    "Verdict",
    "explain",
    "first_sight",
    "jittered",
    "pair_kind",
    "scales",
]

FloatArray = NDArray[np.float64]
AnyShape = Shape | Frustum

# "Size" is the larger diameter of the two shapes; "coordinates" is the sum of how far the vertices
# and b reach from the origins they are given about: the largest numbers that either side adds up.  Where in a
# scene the pair is does not matter: both sides see the pose of b in a.

# Rounding, in units of `coordinates`.  Neither FCL's closed forms nor the check of a witness put more than
# some thirty rounded operations between input and result, each worth half an eps, on each of the two sides.
# Against constructed answers FCL was off by at most 4 eps on 30,000 pairs.
ROUNDING = 64.0 * float(np.finfo(np.float64).eps)

# Contacts shallower, and gaps narrower than this fraction of the size are too close for a yes or no from FCL:
# libccd stops when an iteration gains less than 1e-6, an absolute length, on shapes of about one metre.
CLOSE_CALL = 1e-6

# What FCL's iteration may over-state, as a fraction of the size.  On constructed pairs of 0.1 to 1 m the median
# was 1e-7 to 2e-6, and 5 of 9,000 were beyond this, up to 4e-3.  It never under-states: where it stops early it
# still holds a pair of points of the two bodies.
ITERATIVE = 1e-3

# How far b is moved to see whether FCL contradicts itself, as a fraction of the size: far enough to leave the
# lattice on which its box distance fails, and the true distance cannot change by more than the motion.
JITTER = 1e-4

# Three directions, along no axis, no diagonal, and not in a plane.
JITTER_DIRECTIONS = np.array([(0.81, 0.47, -0.35), (-0.29, 0.62, 0.73), (0.38, -0.84, 0.39)])
JITTER_DIRECTIONS /= np.linalg.norm(JITTER_DIRECTIONS, axis=1, keepdims=True)


class Peer(NamedTuple):
    """What FCL's answers for one kind of pair are good for."""

    distance: bool  #: whether FCL can be asked for the distance
    overstates: float  #: how much more than ours it may say, as a fraction of the size; rounding aside
    why: str


_CLOSED = Peer(True, 0.0, "closed form")
_POLYTOPES = Peer(True, 0.0, "GJK ends at a pair of features; wrong on lattices")
_CURVED = Peer(True, ITERATIVE, "GJK creeps up on a curved surface and stops early")
_PLANE = Peer(False, 0.0, "collide() only: the distance of a half space segfaults")

#: What is compared, by pair kind; names in alphabetical order.  Any other kind is skipped by name.
PEERS = {
    "box-box": _POLYTOPES,
    "box-capsule": _CURVED,
    "box-cone": _CURVED,
    "box-convex": _POLYTOPES,
    "box-cylinder": _CURVED,
    "box-ellipsoid": _CURVED,
    "box-half_space": _PLANE,
    "box-sphere": _CLOSED,
    "capsule-capsule": _CLOSED,
    "capsule-cone": _CURVED,
    "capsule-convex": _CURVED,
    "capsule-cylinder": _CURVED,
    "capsule-ellipsoid": _CURVED,
    "capsule-half_space": _PLANE,
    "capsule-sphere": _CLOSED,
    "cone-cone": _CURVED,
    "cone-convex": _CURVED,
    "cone-cylinder": _CURVED,
    "cone-ellipsoid": _CURVED,
    "cone-sphere": _CURVED,
    "convex-convex": _POLYTOPES,
    "convex-cylinder": _CURVED,
    "convex-ellipsoid": _CURVED,
    "convex-half_space": _PLANE,
    "convex-sphere": _CURVED,
    "cylinder-cylinder": _CURVED,
    "cylinder-ellipsoid": _CURVED,
    "cylinder-half_space": _PLANE,
    "cylinder-sphere": _CURVED,
    "ellipsoid-ellipsoid": _CURVED,
    "ellipsoid-half_space": _PLANE,
    "ellipsoid-sphere": _CURVED,
    "half_space-sphere": _PLANE,
    "sphere-sphere": _CLOSED,
}

# Shapes that are packed as the hull of their vertices.
_HULLS = dict.fromkeys(("frustum", "point", "segment", "triangle"), "convex")


def pair_kind(kind_a: str, kind_b: str) -> str:
    """Name of the pair of two kinds of shape, "box-sphere" for either order."""
    return "-".join(sorted((_HULLS.get(kind_a, kind_a), _HULLS.get(kind_b, kind_b))))


class Solid(NamedTuple):
    """A shape as the worker and the witness check read it."""

    number: int  #: what the worker knows it by
    kind: str
    packed: PackedShapes
    diameter: float
    reach: float  #: largest distance of its numbers from its own origin

    @classmethod
    def of(cls, shape: AnyShape, number: int) -> Solid:
        """`shape`, to be known by `number`."""
        packed = pack([shape])
        kind = _core.shape_kinds()[int(packed.kinds[0])]
        params, vertices = packed.params[0], packed.vertices
        reach = 0.0
        if kind == "half_space":
            diameter, reach = 0.0, abs(params[3])
        elif kind == "box":
            diameter = 2.0 * float(np.linalg.norm(params[:3]))
        elif len(vertices):
            diameter = float(np.linalg.norm(np.ptp(vertices, axis=0)))
            reach = float(np.linalg.norm(vertices, axis=1).max())
        elif kind == "ellipsoid":
            diameter = 2.0 * float(params.max())
        else:  # sphere: radius and 0; capsule, and what lies in one, cylinder and cone: radius and half length
            diameter = 2.0 * float(params[0] + params[1])
        return cls(number, kind, packed, diameter, max(reach, diameter))


@dataclass
class Rows:
    """Pairs and what the engine said of them, points and normals in the frame of a."""

    shapes: list[tuple[AnyShape, AnyShape]]
    labels: list[str]
    poses: FloatArray
    distance: FloatArray
    lower: FloatArray
    upper: FloatArray
    point_a: FloatArray
    point_b: FloatArray
    normal: FloatArray
    unsupported: NDArray[np.bool_]
    prefix: ClassVar[str] = ""  #: of their kinds in a tally

    def __len__(self) -> int:
        return len(self.shapes)

    def take(self, index: Sequence[int] | NDArray[np.intp]) -> Rows:
        """Copy of some of the rows."""
        arrays = {
            name: value[np.asarray(index, np.intp)]
            for name, value in vars(self).items()
            if isinstance(value, np.ndarray)
        }
        chosen = index.tolist() if isinstance(index, np.ndarray) else index
        return Rows([self.shapes[i] for i in chosen], [self.labels[i] for i in chosen], **arrays)


class Scales(NamedTuple):
    """Tolerances [m] of every row."""

    rounding: FloatArray
    band: FloatArray  #: closer to contact than this is too close to call
    overstates: FloatArray  #: FCL may say this much too much
    jitter: FloatArray  #: how far b moves for the second opinion


def scales(rows: Rows, solids: list[tuple[Solid, Solid]]) -> Scales:
    """Tolerances of rows whose kinds are all in `PEERS`."""
    size = np.array([max(a.diameter, b.diameter) for a, b in solids])
    reach = np.array([a.reach + b.reach for a, b in solids])
    coordinates = reach + np.linalg.norm(rows.poses[:, :3], axis=1)
    overstates = np.array([PEERS[pair_kind(a.kind, b.kind)].overstates for a, b in solids])
    return Scales(ROUNDING * coordinates, CLOSE_CALL * size, overstates * size, JITTER * size)


class Verdict(IntEnum):
    """First sight of a row; what is named by a question is a difference and gets a closer look."""

    AGREED = 0
    TOO_CLOSE = 1
    DISTANCE = 2
    INTERSECTS = 3
    INTERVAL = 4  #: our distance is outside of our own interval


def first_sight(rows: Rows, contact: NDArray[np.bool_], gap: FloatArray, tolerance: Scales) -> NDArray[np.uint8]:
    """Compare with FCL's contacts and gaps (NaN: not asked); one `Verdict` per row."""
    ours = rows.distance <= 0.0
    asked = np.isfinite(gap)
    verdict = np.full(len(rows), Verdict.AGREED, np.uint8)

    # Both apart.  Under-stating is not forgiven: FCL's value belongs to two points of the bodies.
    too_small = rows.lower - gap > tolerance.rounding
    too_large = gap - rows.upper > tolerance.overstates + tolerance.rounding
    verdict[~ours & ~contact & asked & (too_small | too_large)] = Verdict.DISTANCE

    # Apart here, contact there.
    unseen = ~ours & contact
    verdict[unseen] = np.where(rows.distance > tolerance.band, Verdict.INTERSECTS, Verdict.TOO_CLOSE)[unseen]

    # Contact here, apart there.  An answer of exactly 0 does not say how deep: then FCL's gap tells whether
    # it was close, and where FCL has none, a closer look does.
    denied = ours & ~contact
    deep = rows.distance < -tolerance.band
    near = asked & (gap <= tolerance.band + tolerance.overstates)
    shallow = ~asked & (rows.distance < 0.0)
    verdict[denied] = np.where(~deep & (near | shallow), Verdict.TOO_CLOSE, Verdict.INTERSECTS)[denied]

    # Written so that a NaN fails.
    verdict[~((rows.lower <= rows.distance) & (rows.distance <= rows.upper))] = Verdict.INTERVAL
    return verdict


def jittered(poses: FloatArray, jitter: FloatArray) -> FloatArray:
    """Each pose (n, 7) moved by its `jitter` in each of the directions: (n * 3, 7)."""
    moved = np.repeat(poses[:, None, :], len(JITTER_DIRECTIONS), axis=1)
    moved[:, :, :3] += jitter[:, None, None] * JITTER_DIRECTIONS
    return moved.reshape(-1, 7)


class Claim(NamedTuple):
    """One difference: what either side says, and how exactly [m]."""

    verdict: Verdict
    distance: float
    lower: float
    upper: float
    contact: bool  #: FCL's
    gap: float  #: FCL's; NaN for a contact or if it was not asked
    rounding: float
    band: float
    overstates: float
    jitter: float


class Blame(StrEnum):
    """Who is shown to be wrong."""

    FCL = "fcl"
    ENGINE = "engine"
    NOBODY = "nobody"  #: the evidence does not decide it


def explain(
    claim: Claim, proof: Bracket, moved: list[tuple[bool, float]], *, exact: bool = False
) -> tuple[Blame | None, str]:
    """Who is wrong, None if that is too close to call; and why.

    Parameters
    ----------
    claim : Claim
    proof : Bracket
        What our witnesses prove, or with `exact` what exact arithmetic gives.
    moved : list of (bool, float)
        FCL's contact and gap after b moved by `claim.jitter`, one for each direction in which FCL answered.
    exact : bool
    """
    c = claim
    proven = f"{'exact arithmetic gives' if exact else 'our witnesses prove'} [{proof.lower:.9g}, {proof.upper:.9g}]"
    if c.verdict == Verdict.INTERVAL:
        return Blame.ENGINE, "our distance is outside of our own interval"
    # The gap along a direction is a lower bound of the signed distance, too, so this holds for overlaps as
    # well.
    if not proof.lower - c.rounding <= c.distance <= proof.upper + c.rounding:
        return Blame.ENGINE, proven

    if c.contact:
        refuted = proof.lower > c.band
    elif c.distance > 0.0:
        refuted = not proof.lower - c.rounding <= c.gap <= proof.upper + c.overstates + c.rounding
    elif np.isfinite(c.gap):
        refuted = c.gap > proof.upper + c.overstates + c.band + c.rounding
    elif proof.lower >= -c.band:
        # A half space: the gap along its normal is the signed distance itself.
        return None, "touching"
    else:
        refuted = True

    # FCL contradicts itself if its distance changes by more than the motion.
    values = np.array([0.0 if contact else gap for contact, gap in [(c.contact, c.gap), *moved]])
    jump = float(np.abs(values[1:] - values[0]).max(initial=0.0))
    allowed = c.jitter + c.overstates + 2.0 * c.rounding
    contradiction = ""
    if jump > allowed:
        contradiction = f"fcl's distance jumps by {jump:.3g} m where b moves by {c.jitter:.3g} m"
    if refuted:
        return Blame.FCL, "; ".join(filter(None, (proven, contradiction)))
    agrees = all(
        c.lower <= c.jitter + c.band
        if contact
        else c.lower - c.jitter - c.rounding <= gap <= max(c.upper, 0.0) + allowed
        for contact, gap in moved
    )
    if contradiction and agrees:
        return Blame.FCL, f"{contradiction}, and then agrees"
    return Blame.NOBODY, f"{proven}, which does not decide it"
