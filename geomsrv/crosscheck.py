# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""Cross-check: re-run distance and intersection through FCL beside the engine, and count where the two differ.

The answers are compared off the caller's path: `CrossCheck.submit` copies a few rows and returns, a thread feeds them
to a worker process (`geomsrv.fcl_worker`) and judges what comes back.  FCL may abort, hang or segfault; that costs
the worker, never the caller.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from types import TracebackType

import numpy as np
from numpy.typing import ArrayLike, NDArray

from geomsrv.answers import Distances
from geomsrv.shapes import Frustum, Shape

__all__ = ["CrossCheck", "Difference", "KindTally", "Mode", "SkipReason", "Tally"]

FloatArray = NDArray[np.float64]
AnyShape = Shape | Frustum


class Mode(StrEnum):
    """How many of the answers are re-run through FCL."""

    OFF = "off"  #: none; no process is started
    SAMPLE = "sample"  #: a seeded random sample
    ALL = "all"  #: every pair


class SkipReason(StrEnum):
    """Why a submitted pair was not judged."""

    UNAVAILABLE = "python-fcl is not available"
    UNSUPPORTED_HERE = "no kernel for this pair here"
    UNSUPPORTED_BY_FCL = "fcl does not offer this pair"
    TOO_CLOSE = "too close to call"
    DROPPED = "queue full"
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
    explained : bool
        True if FCL is shown to be wrong, by `reason`.
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
    explained: bool
    reason: str

    def reproducer(self) -> str:
        """Python expression that repeats the query, floats in hex so that no bit is lost."""
        raise NotImplementedError


@dataclass
class KindTally:
    """Verdicts on the pairs of one kind; they add up to the pairs taken."""

    agreed: int = 0
    explained: int = 0  #: differences shown to be FCL's fault
    unexplained: int = 0  #: differences that nobody has accounted for: look at these
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
        Verdicts by pair kind, "box-sphere".
    skipped : dict of SkipReason to int
        Skipped pairs by reason.
    restarts : int
        How often the worker was started again after it died or hung.
    recent : tuple of Difference
        The last differences, newest last; unexplained ones are kept longest.
    """

    mode: Mode
    available: bool
    message: str
    offered: int = 0
    not_sampled: int = 0
    pending: int = 0
    kinds: dict[str, KindTally] = field(default_factory=dict)
    skipped: dict[SkipReason, int] = field(default_factory=dict)
    restarts: int = 0
    recent: tuple[Difference, ...] = ()

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
        """Differences that nobody has accounted for."""
        return sum(kind.unexplained for kind in self.kinds.values())

    def summary(self) -> str:
        """One line for logs and diagnostics."""
        raise NotImplementedError


class CrossCheck:
    """Compares answers with FCL in the background.

    Thread-safe.  `submit`, `poll` and `tally` never block on FCL.  Use it as a context manager, or call `close`.

    Parameters
    ----------
    mode : str
        "off", "sample" or "all".
    sample_fraction : float
        Share of the pairs that mode "sample" takes, in [0, 1].
    timeout_s : float
        Longest time FCL may take for one pair [s]; then its process is replaced and the pair skipped.
    queue_limit : int
        Most pairs that may wait; those beyond are dropped, and counted.
    seed : int
        Seed of the sample.

    Raises
    ------
    GeometryError
        Names the argument and the fault.
    """

    mode: Mode
    available: bool  #: whether python-fcl can be used
    reason: str  #: why not; empty if it can

    def __init__(
        self,
        mode: str = "off",
        *,
        sample_fraction: float = 0.1,
        timeout_s: float = 1.0,
        queue_limit: int = 1000,
        seed: int = 0,
    ) -> None:
        raise NotImplementedError

    def submit(
        self,
        shapes: Sequence[tuple[AnyShape, AnyShape]],
        poses_ab: ArrayLike,
        answers: Distances,
        labels: Sequence[str] | None = None,
    ) -> int:
        """Queue answers for comparison; returns at once.

        Parameters
        ----------
        shapes : sequence of (Shape, Shape)
            n pairs, or one pair for all.
        poses_ab : (n, 7) float
            Poses of b in a, as the query got them.
        answers : Distances
            What the engine said, points and normals in the frame of a.  With ``want=("penetration",)`` deep overlaps
            can be told from touching; without, an answer of 0 is compared as "in contact, depth unknown".
        labels : sequence of str, optional
            Names of the pairs, for the reports.

        Returns
        -------
        int
            How many pairs were queued; in mode "off" always 0.
        """
        raise NotImplementedError

    def poll(self) -> list[Difference]:
        """Differences found since the last call; never blocks."""
        raise NotImplementedError

    def drain(self, timeout_s: float = 60.0) -> bool:
        """Wait until every queued pair has its verdict; False if that took longer than `timeout_s` [s]."""
        raise NotImplementedError

    def tally(self) -> Tally:
        """Counters as of now."""
        raise NotImplementedError

    def close(self) -> None:
        """Stop the worker process; pairs still waiting are counted as skipped.  May be called twice."""
        raise NotImplementedError

    def __enter__(self) -> CrossCheck:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()
