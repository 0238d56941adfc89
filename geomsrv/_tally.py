# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""What the cross-check reports: verdicts counted by pair kind, and the differences themselves.  Values only."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import StrEnum

import numpy as np
from numpy.typing import ArrayLike, NDArray

from geomsrv._judge import AnyShape, Blame
from geomsrv.shapes import pack

__all__ = ["Difference", "KindTally", "Mode", "MotionDifference", "SkipReason", "Tally"]

FloatArray = NDArray[np.float64]


class Mode(StrEnum):
    """How many of the answers are re-run through FCL."""

    OFF = "off"  #: none; no process is started
    SAMPLE = "sample"  #: a seeded random sample
    ALL = "all"  #: every pair


class SkipReason(StrEnum):
    """Why a submitted pair was not judged."""

    UNAVAILABLE = "python-fcl is not available"
    UNSUPPORTED_HERE = "no kernel for this pair here"
    UNSUPPORTED_BY_FCL = "fcl is not asked about this pair"
    TOO_CLOSE = "too close to call"
    DROPPED = "queue full"
    STALE = "the scene has changed since"
    TIMED_OUT = "fcl timed out"
    WORKER_DIED = "fcl worker died"
    BACKING_OFF = "fcl worker died too often lately"
    FCL_ERROR = "fcl raised an error"
    CLOSED = "cross-check closed"


@dataclass(frozen=True, eq=False)
class Difference:
    """One pair on which FCL and the engine differ by more than the declared tolerance.

    Attributes
    ----------
    kind : str
        Pair kind, names in alphabetical order: "box-sphere".
    label : str
        The caller's name of the pair; may be empty.
    question : str
        "distance", "intersects", or "interval" if our distance is outside of our own interval.
    shape_a, shape_b : Shape
    pose_ab : (7,) float64
        Pose of b in a: x y z [m], qx qy qz qw.
    distance, lower, upper : float
        Our answer [m].
    fcl_intersects : bool
    fcl_distance : float
        [m]; NaN where FCL was not asked or sees a contact.
    blame : Blame
        Who is shown to be wrong, by `reason`.
    reason : str
        What decided that, in words.
    """

    kind: str
    label: str
    question: str
    shape_a: AnyShape
    shape_b: AnyShape
    pose_ab: FloatArray
    distance: float
    lower: float
    upper: float
    fcl_intersects: bool
    fcl_distance: float
    blame: Blame
    reason: str

    @property
    def explained(self) -> bool:
        """Whether FCL is shown to be wrong."""
        return self.blame == Blame.FCL

    def reproducer(self) -> str:
        """Python expression that repeats the query; floats in hex, so that no bit is lost.

        It needs ``import geomsrv as gs`` and ``h = float.fromhex``.
        """
        shapes = ", ".join(_expression(shape) for shape in (self.shape_a, self.shape_b))
        return f"gs.distance({shapes}, {_hex(self.pose_ab)}, want=('penetration',))"

    def __str__(self) -> str:
        """One line for logs."""
        theirs = "contact" if self.fcl_intersects else f"{self.fcl_distance:.9g} m"
        return (
            f"{self.kind}{f' ({self.label})' if self.label else ''}: {self.question} differs, here "
            f"{self.distance:.9g} m in [{self.lower:.9g}, {self.upper:.9g}], fcl {theirs}; "
            f"{_WORDS[self.blame]}: {self.reason}"
        )


@dataclass(frozen=True, eq=False)
class MotionDifference:
    """One pair in translation on whose first contact FCL and the engine differ.

    Attributes
    ----------
    pose_a, pose_b : (7,) float64
    velocity_a, velocity_b : (3,) float64
        [m/s]
    end : float
        How far FCL looked [s].
    time : float
        Our answer [s]; NaN: never.
    fcl_time : float
        [s]; NaN: never.
    """

    kind: str
    label: str
    shape_a: AnyShape
    shape_b: AnyShape
    pose_a: FloatArray
    pose_b: FloatArray
    velocity_a: FloatArray
    velocity_b: FloatArray
    end: float
    time: float
    fcl_time: float
    blame: Blame
    reason: str
    question: str = "first contact"

    @property
    def explained(self) -> bool:
        """Whether FCL is shown to be wrong."""
        return self.blame == Blame.FCL

    def reproducer(self) -> str:
        """Python expression that repeats the query, as of `Difference`.

        It needs ``from geomsrv.motion_check import first_contact_of_two``, too.
        """
        sides = (
            (self.shape_a, self.pose_a, self.velocity_a),
            (self.shape_b, self.pose_b, self.velocity_b),
        )
        listed = ", ".join(f"{_expression(shape)}, {_hex(pose)}, {_hex(velocity)}" for shape, pose, velocity in sides)
        return f"first_contact_of_two({listed}, {_hex(self.end)})"

    def __str__(self) -> str:
        """One line for logs."""
        ours, theirs = ("never" if np.isnan(t) else f"{t:.9g} s" for t in (self.time, self.fcl_time))
        return (
            f"{self.kind}{f' ({self.label})' if self.label else ''}: {self.question} differs, here {ours}, "
            f"fcl {theirs}; {_WORDS[self.blame]}: {self.reason}"
        )


_WORDS = {Blame.FCL: "explained", Blame.ENGINE: "THE ENGINE IS WRONG", Blame.NOBODY: "UNEXPLAINED"}


def _hex(value: ArrayLike) -> str:
    """``h('0x1p+0')``, lists for arrays."""
    if np.ndim(value) == 0:
        return f"h('{float(value).hex()}')"  # type: ignore[arg-type]
    return f"[{', '.join(_hex(row) for row in np.asarray(value))}]"


def _expression(shape: AnyShape) -> str:
    """Constructor call that makes `shape` again."""
    fields = {
        "sphere": ("radius",),
        "capsule": ("radius", "length"),
        "cylinder": ("radius", "length"),
        "cone": ("radius", "length"),
        "ellipsoid": ("radii",),
        "box": ("half_extents",),
        "half_space": ("normal", "offset"),
    }
    if shape.kind in fields:
        values = [_hex(getattr(shape, name)) for name in fields[shape.kind]]
        return f"gs.{type(shape).__name__}({', '.join(values)})"
    return f"gs.Convex({_hex(pack([shape]).vertices)})"


@dataclass
class KindTally:
    """Verdicts on the pairs of one kind; they add up to the pairs taken."""

    agreed: int = 0
    explained: int = 0  #: differences shown to be FCL's fault
    unexplained: int = 0  #: all others: look at these
    engine_wrong: int = 0  #: those of the unexplained that are shown to be the engine's fault
    skipped: int = 0

    @property
    def disagreed(self) -> int:
        """All differences."""
        return self.explained + self.unexplained


@dataclass(frozen=True)
class Tally:
    """Snapshot of the counters.

    Attributes
    ----------
    mode : Mode
    available : bool
        Whether python-fcl can be used.
    message : str
        Why not; empty if it can.
    offered : int
        Pairs given to `CrossCheck.submit`; equals ``not_sampled + pending`` plus all verdicts.
    not_sampled : int
        Pairs that mode "sample" left out.
    pending : int
        Pairs without a verdict yet.
    kinds : dict of str to KindTally
        Verdicts by pair kind, "box-sphere"; on first contacts, "motion box-sphere".
    reasons : dict of SkipReason to int
        Skipped pairs by reason.
    restarts : int
        How often the worker was started again after it died or hung.
    last_loss : str
        How the worker was lost last, with the end of what it wrote to stderr; empty if it never was.
    recent : tuple of Difference or MotionDifference
        The last explained and the last unexplained differences; unexplained ones come last.
    """

    mode: Mode
    available: bool
    message: str
    offered: int = 0
    not_sampled: int = 0
    pending: int = 0
    kinds: dict[str, KindTally] = field(default_factory=dict)
    reasons: dict[SkipReason, int] = field(default_factory=dict)
    restarts: int = 0
    last_loss: str = ""
    recent: tuple[Difference | MotionDifference, ...] = ()

    @property
    def agreed(self) -> int:
        """Pairs on which both agree."""
        return sum(kind.agreed for kind in self.kinds.values())

    @property
    def explained(self) -> int:
        """Differences shown to be FCL's fault."""
        return sum(kind.explained for kind in self.kinds.values())

    @property
    def unexplained(self) -> int:
        """Differences that are not shown to be FCL's fault."""
        return sum(kind.unexplained for kind in self.kinds.values())

    @property
    def engine_wrong(self) -> int:
        """Differences that are shown to be the engine's fault."""
        return sum(kind.engine_wrong for kind in self.kinds.values())

    @property
    def skipped(self) -> int:
        """Pairs taken but not judged."""
        return sum(kind.skipped for kind in self.kinds.values())

    def summary(self) -> str:
        """One line for logs and diagnostics."""
        if self.mode == Mode.OFF:
            return "cross-check off"
        if not self.available:
            return f"cross-check {self.mode}: {self.message}"
        parts = [f"{self.agreed} agreed", f"{self.explained} explained", f"{self.unexplained} unexplained"]
        if self.engine_wrong:
            parts[-1] += f" ({self.engine_wrong} wrong here)"
        if self.skipped:
            reasons = ", ".join(f"{count} {reason}" for reason, count in sorted(self.reasons.items()))
            parts.append(f"{self.skipped} skipped ({reasons})")
        if self.pending:
            parts.append(f"{self.pending} pending")
        if self.restarts:
            parts.append(f"{self.restarts} restarts")
        return f"cross-check {self.mode}: {', '.join(parts)}"
