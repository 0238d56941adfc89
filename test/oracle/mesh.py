# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""First contact of unions of convex pieces in space, exactly: that of all pairs of pieces, one by one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from oracle import moving_polytope as moving
from oracle.polygon import NEVER, OVERLAPPING, TOUCHING, WILL_TOUCH
from oracle.vectors import Vector, add, dot, exact, scale, sub


@dataclass(frozen=True)
class MeshContact:
    status: str
    time: Fraction | None = None
    last_time: Fraction | None = None  #: None if they never part
    sets: tuple[list[Vector], ...] = ()  #: vertices of what each pair shares that touches first
    pairs: tuple[tuple[list[Vector], list[Vector]], ...] = ()  #: the pieces of those pairs, then

    def parts(self, normal: Vector, slack: float) -> bool:
        """Whether planes along a normal, through what they share, have every pair on their own sides."""
        n = exact(normal)
        return all(
            all(dot(n, sub(x, shared[0])) <= slack for x in one)
            and all(dot(n, sub(x, shared[0])) >= -slack for x in two)
            for (one, two), shared in zip(self.pairs, self.sets, strict=True)
        )


def contact_of_meshes(p: Sequence[Any], v_p: Any, q: Sequence[Any], v_q: Any, t_max: Any) -> MeshContact:
    """First contact of the union of hulls p with that of hulls q."""
    v_p, v_q = exact(v_p), exact(v_q)
    found = [(exact(a), exact(b), moving.first_contact(a, v_p, b, v_q, t_max, contact=False)) for a in p for b in q]
    hits = [(a, b, answer) for a, b, answer in found if answer.hits]
    if not hits:
        return MeshContact(NEVER)
    time = min(answer.time for *_, answer in hits)
    last = None if any(not answer.parts for *_, answer in hits) else max(answer.last_time for *_, answer in hits)
    tied = [(a, b, answer) for a, b, answer in hits if answer.time == time]
    deep = any(answer.status == OVERLAPPING for *_, answer in tied)
    pairs = [[[add(x, scale(time, v)) for x in body] for body, v in ((a, v_p), (b, v_q))] for a, b, _ in tied]
    status = WILL_TOUCH if time > 0 else OVERLAPPING if deep else TOUCHING
    sets = tuple(moving.intersection(one, two) for one, two in pairs)
    return MeshContact(status, time, last, sets, tuple((one, two) for one, two in pairs))
