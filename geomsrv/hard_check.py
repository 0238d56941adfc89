# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""Hard cases through every tier of the engine and through its peers, and who was wrong, decided by exact arithmetic."""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from geomsrv import _validate, fcl_worker
from geomsrv._fcl_supervisor import FclSupervisor, NoReply
from geomsrv._judge import PEERS as PEER_KINDS
from geomsrv._judge import Solid, pair_kind
from geomsrv._verdict import Finding, Verdict, judge, judge_peer, truth_by_engine
from geomsrv.errors import GeometryError
from geomsrv.hard_cases import MOVING, Case, Truth, quaternion_of, read
from geomsrv.shapes import Box, Boxes, Convex, Frustum, Polygons, Polytopes, Shape

__all__ = ["PEERS", "TIERS", "Report", "Tally", "check", "unsupported"]

FloatArray = NDArray[np.float64]

TIERS = _validate.ACCURACIES
PEERS = tuple(fcl_worker.PEERS)

# Longest time a peer may take for one pair [s]; the slowest that ended took 0.1 s.
PEER_TIMEOUT_S = 2.0


# Axes further off orthonormal than their rounding, some eps, make a box that no rotation gives.
SKEWED = 8 * float(np.finfo(np.float64).eps)


class Tally(NamedTuple):
    """How one engine did on one kind of case."""

    right: int = 0
    uncertain: int = 0  #: does not vouch for its answer; for a peer, too close to ask
    wrong: int = 0
    crashed: int = 0  #: died, hung or raised


@dataclass
class Report:
    """Who did how well, and the answers that were wrong.

    Attributes
    ----------
    tallies : dict of (str, str) to Tally
        By row and engine; no entry where nothing was asked.
    wrong : list of str
        One line for each wrong answer, the engine's first.
    missing : dict of str to str
        Engines that could not be asked, and why.
    undecided : int
        Cases that nobody knows the answer of.
    """

    tallies: dict[tuple[str, str], Tally] = field(default_factory=dict)
    wrong: list[str] = field(default_factory=list)
    missing: dict[str, str] = field(default_factory=dict)
    undecided: int = 0

    def add(self, row: str, engine: str, case: Case, finding: Finding | None) -> None:
        """Count one answer; None for a crash."""
        name = "crashed" if finding is None else finding.verdict.name.lower()
        old = self.tallies.get((row, engine), Tally())
        self.tallies[row, engine] = old._replace(**{name: getattr(old, name) + 1})
        if finding is not None and finding.verdict == Verdict.WRONG:
            self.wrong.append(f"{engine}: {case.kind} {case.name} ({case.group}): {finding.detail}")

    def engines(self) -> list[str]:
        """Those that were asked, the engine's tiers first."""
        asked = {engine for _, engine in self.tallies}
        return [engine for engine in (*TIERS, *PEERS) if engine in asked]

    def rows(self) -> list[str]:
        """In the order in which they came."""
        return list(dict.fromkeys(row for row, _ in self.tallies))

    @property
    def engine_wrong(self) -> int:
        """Wrong answers of our own, at any tier."""
        return sum(tally.wrong for (_, engine), tally in self.tallies.items() if engine in TIERS)

    def text(self) -> str:
        """The table, aligned; a peer's "uncertain" is a case too close to ask it about."""
        head = ("", "engine", *Tally._fields)
        lines: list[tuple[str, ...]] = []
        for row in self.rows():
            for engine in self.engines():
                if tally := self.tallies.get((row, engine)):
                    name = f"geomsrv {engine}" if engine in TIERS else engine
                    lines.append((row, name, *map(str, tally)))
        widths = [max(len(line[k]) for line in [head, *lines]) for k in range(len(head))]
        shown = []
        last = ""
        for first, *rest in [head, *lines]:
            cells = ["" if first == last else first, *rest]
            padded = [c.ljust(w) if k < 2 else c.rjust(w) for k, (c, w) in enumerate(zip(cells, widths, strict=True))]
            shown.append("  ".join(padded).rstrip())
            last = first
        notes = [f"{engine}: not asked: {why}" for engine, why in self.missing.items()]
        if self.undecided:
            notes.append(f"{self.undecided} cases without an answer that anyone could give were left out")
        return "\n".join([*shown, *notes])


def check(
    cases: Iterable[Case],
    engines: Sequence[str] = (*TIERS, *PEERS),
    *,
    by_group: bool = False,
    timeout_s: float = PEER_TIMEOUT_S,
) -> Report:
    """Answer cases by every engine named, and compare with the truth.

    Parameters
    ----------
    cases : iterable of Case
    engines : sequence of str
        Some of `TIERS` and `PEERS`.  A tier or a peer that is not available is left out.
    by_group : bool
        One row per kind and group in place of one per kind.
    timeout_s : float
        Longest time a peer may take for one pair [s].
    """
    report = Report()
    known: list[tuple[str, Case, Truth]] = []
    for case in cases:
        truth = case.truth or truth_by_engine(case)
        if truth is None:
            report.undecided += 1
            continue
        row = f"{case.kind} {case.group}" if by_group else case.kind
        known.append((row, case, truth))
        for tier in TIERS:
            if tier in engines and (finding := judge(case, tier, truth)) is not None:
                report.add(row, tier, case, finding)
    for peer in PEERS:
        if peer in engines:
            _ask_peer(peer, known, report, timeout_s)
    return report


def unsupported(path: Path) -> dict[tuple[str, str], list[str]]:
    """Names of a file's cases that the engine has no query or no kernel for, by kind and shapes."""
    answered = {case.name for case in read(path) if case.truth and judge(case, "float64", case.truth)}
    found: dict[tuple[str, str], list[str]] = {}
    for line in path.read_text(encoding="utf-8").splitlines():
        record = json.loads(line)
        kinds = [shape["type"] for shape in record.get("shapes", ())]
        if record["id"] not in answered and record.get("complete_inputs", True):
            shapes = " – ".join(sorted(kinds))
            found.setdefault((record["kind"], shapes), []).append(record["id"])
    return dict(sorted(found.items()))


# --------------------------------------------------------------------------------------------------------- peers


def _ask_peer(name: str, known: list[tuple[str, Case, Truth]], report: Report, timeout_s: float) -> None:
    rows: list[tuple[str, Case, Truth, float]] = []
    solids, poses = [], []
    for row, case, truth in known:
        if (pair := _for_peer(case)) is not None:
            with np.errstate(over="ignore"):  # sizes decide nothing here
                a, b = (Solid.of(shape, 2 * len(rows) + k) for k, shape in enumerate(pair[:2]))
            if (peer := PEER_KINDS.get(pair_kind(a.kind, b.kind))) is not None:
                rows.append((row, case, truth, peer.overstates))
                solids.append((a, b))
                poses.append(pair[2])
    if not rows:
        return
    fcl = FclSupervisor(timeout_s, name)
    try:
        replies = fcl.ask(solids, np.array(poses))
    finally:
        fcl.close()
    if fcl.reason:
        report.missing[name] = fcl.reason
        return
    resting = int((replies["outcome"] == NoReply.BACKING_OFF).sum())
    if resting:
        report.missing[name] = f"about {resting} cases, because it had died too often"
    for (row, case, truth, overstates), outcome, gap in zip(rows, replies["outcome"], replies["distance"], strict=True):
        if outcome == NoReply.BACKING_OFF:
            continue
        crashed = outcome >= fcl_worker.Outcome.FAILED
        contact = outcome == fcl_worker.Outcome.CONTACT
        report.add(row, name, case, None if crashed else judge_peer(bool(contact), float(gap), truth, overstates))


def _for_peer(case: Case) -> tuple[Shape, Shape, FloatArray] | None:
    """Two shapes and the pose of the second in the first; None if no peer is asked."""
    if case.kind in MOVING:
        return None
    try:
        bodies = case.bodies
        if len(bodies) == 3:
            return bodies
        origin = _origin(bodies[0])
        (a, rotation, position), (b, turned, moved) = (_solid(body, origin) for body in bodies)
        step = rotation.T @ (moved - position)
        return a, b, np.concatenate([step, quaternion_of(rotation.T @ turned)])
    except GeometryError:
        return None


def _origin(body: object) -> FloatArray:
    """What positions are told relative to, before they are rounded: peers, too, are to see the scene from nearby."""
    if isinstance(body, Frustum):
        return body.origin
    assert isinstance(body, (Boxes, Polygons, Polytopes))
    first: FloatArray = body.center[0] if isinstance(body, Boxes) else body.vertices[0]
    return first


def _solid(body: object, origin: FloatArray) -> tuple[Shape, FloatArray, FloatArray]:
    """A shape, its rotation and its position relative to `origin`."""
    if isinstance(body, Boxes):
        rotation = body.axes[0].T.copy()
        if np.abs(rotation.T @ rotation - np.eye(3)).max() > SKEWED:
            return Convex(body.corners(origin[None])[0]), np.eye(3), np.zeros(3)
        if np.linalg.det(rotation) < 0.0:
            rotation[:, 0] *= -1.0  # the same box
        return Box(body.half_extents[0]), rotation, body.center[0] - origin
    if isinstance(body, Frustum):
        return Convex(body.corners(origin)), np.eye(3), np.zeros(3)
    assert isinstance(body, (Polygons, Polytopes))
    vertices = body.vertices - origin
    if isinstance(body, Polygons):
        # A prism: it meets another iff the polygons meet, and is as far from it.
        height = float(np.ptp(vertices, axis=0).max()) or 1.0
        vertices = np.vstack([np.column_stack([vertices, np.full(len(vertices), z)]) for z in (-height, height)])
    return Convex(vertices), np.eye(3), np.zeros(3)
