# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""What a scene remembers of its answers: what was found of pairs, and objects, of which none changed since.

    version 7:   a-b  a-c  b-c  c-d          rows found
                  |    .    .    .           c was moved
    version 8:   a-b  a-c  b-c  c-d          kept, and the pairs of c found anew

An answer is a function of the objects' states, so what is kept is what would be found: the same bits.
"""

from __future__ import annotations

import threading
from collections import Counter, OrderedDict
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from geomsrv.answers import BoolArray, FloatArray, IntArray, gather
from geomsrv.broad_phase import Aabbs, Candidates, candidates, candidates_of
from geomsrv.narrow_phase import ContactRows, DistanceRows, Unsupported, packed_sets
from geomsrv.world import World

__all__ = ["Found", "Memory"]

QUESTIONS = 8  #: that are remembered; an old one gives way to a new one

# If a larger share of the objects changed, everything is found anew: joining old and new rows would cost more.
MOST_CHANGED = 0.125


NO_SETS = np.zeros((0, 3)), np.zeros(1, np.int64), np.zeros(1, np.int64)


@dataclass(frozen=True, eq=False)
class Found:
    """What was found of pairs.

    Attributes
    ----------
    rows : DistanceRows or ContactRows
    speed : (k,) float64
        How fast the bodies of each row approach; no entry for distances.
    unsupported : Unsupported
    tier : str
        The highest that answered anything.
    """

    rows: Any
    speed: FloatArray
    unsupported: Unsupported
    tier: str
    _sets: tuple[FloatArray, IntArray, IntArray] | None = None

    def __post_init__(self) -> None:
        # Answers hand out what is remembered.
        for array in (*(getattr(self.rows, name) for name in self.rows.columns()), self.speed, *self.sets):
            array.setflags(write=False)

    @cached_property
    def sets(self) -> tuple[FloatArray, IntArray, IntArray]:
        """Contact sets of the rows, as answers have them."""
        if self._sets is not None:
            return self._sets
        return packed_sets(self.rows.points) if isinstance(self.rows, ContactRows) else NO_SETS


@dataclass(frozen=True, eq=False)
class _Past:
    world: World
    boxes: Aabbs | None
    found: Any


class Memory:
    """Earlier answers of a scene, by the question."""

    def __init__(self) -> None:
        self._past: OrderedDict[Any, _Past] = OrderedDict()
        self._lock = threading.Lock()  # answers are found outside of it

    def pairs(
        self,
        question: Any,
        world: World,
        boxes: Callable[[World, IntArray | None], Aabbs],
        margin: float,
        counts: Counter[str],
        find: Callable[[IntArray], Found],
    ) -> Found:
        """What there is to say of all pairs whose boxes are within `margin`.

        Parameters
        ----------
        question : hashable
            Everything but the world that the answer depends on.
        boxes : callable
            ``boxes(world, rows)``: those of the listed objects, or of all.
        find : callable
            ``find(pairs)``: the answer for pairs.
        """
        past, changed = self._recall(question, world)
        around: Aabbs | None
        if past is None or changed is None:
            around = boxes(world, None)
            near = [candidates(world, family, around, margin) for family in world.families]
            found = find(_counted(near, counts))
        elif not changed.any():
            around, found = past.boxes, past.found
            counts["remembered"] += len(found.rows.pairs)
        else:
            rows = np.flatnonzero(changed)
            assert past.boxes is not None
            around = past.boxes.with_rows(rows, boxes(world, rows))
            near = [candidates_of(world, around, margin, rows)]
            found = _joined(past.found, changed, find(_counted(near, counts)), counts)
        self._keep(question, _Past(world, around, found))
        return found

    def objects(
        self,
        question: Any,
        world: World,
        counts: Counter[str],
        find: Callable[[IntArray], tuple[Any, str]],
    ) -> tuple[Any, str]:
        """What there is to say of all objects, as named tuples of arrays; `find` answers for the listed ones."""
        past, changed = self._recall(question, world)
        if past is None or changed is None:
            found = find(np.arange(len(world)))
        else:
            found = past.found
            counts["remembered"] += len(world) - int(changed.sum())
            if changed.any():
                found = find(np.flatnonzero(changed))
                found = _updated(past.found, changed, found)
        self._keep(question, _Past(world, None, found))
        return found

    def _recall(self, question: Any, world: World) -> tuple[_Past | None, BoolArray | None]:
        """The earlier answer, and which objects changed since; None if too many did."""
        with self._lock:
            past = self._past.get(question)
        changed = None if past is None else world.changed_since(past.world)
        if changed is not None and np.count_nonzero(changed) > MOST_CHANGED * len(world):
            changed = None
        return past, changed

    def _keep(self, question: Any, past: _Past) -> None:
        with self._lock:
            self._past[question] = past
            self._past.move_to_end(question)
            while len(self._past) > QUESTIONS:
                self._past.popitem(last=False)


def _counted(near: list[Candidates], counts: Counter[str]) -> IntArray:
    counts["candidates"] += sum(part.found for part in near)
    counts["allowed"] += sum(part.allowed for part in near)
    return np.concatenate([part.pairs for part in near])


def _joined(old: Found, changed: BoolArray, new: Found, counts: Counter[str]) -> Found:
    """Old rows of pairs of which neither object changed, and new ones, in order."""
    stale = changed[old.rows.pairs[:, 0]] | changed[old.rows.pairs[:, 1]]
    counts["remembered"] += len(stale) - int(np.count_nonzero(stale))
    silent = old.unsupported
    if len(silent.pairs):
        silent = silent.take(~changed[silent.pairs].any(axis=1))
    where = np.flatnonzero(stale)
    if np.array_equal(old.rows.pairs[where], new.rows.pairs):
        rows, order = _replaced(old.rows, where, new.rows), None
        speed = _written(old.speed, where, new.speed) if len(old.speed) else old.speed
    else:
        # Rows of either are in order, and there are few new ones: where they go among the others.
        mine, theirs = (part.pairs[:, 0] * len(changed) + part.pairs[:, 1] for part in (old.rows, new.rows))
        kept = np.flatnonzero(~stale)
        order = np.insert(kept, np.searchsorted(mine[kept], theirs), len(mine) + np.arange(len(theirs)))
        kind: type[DistanceRows] | type[ContactRows] = type(old.rows)
        rows = kind(
            *(np.concatenate([getattr(x, name) for x in (old.rows, new.rows)])[order] for name in kind.columns())
        )
        speed = np.concatenate([old.speed, new.speed])[order] if len(old.speed) + len(new.speed) else old.speed
    tier = old.tier if len(stale) > len(where) and not len(new.rows.pairs) else new.tier
    sets = _joined_sets(old.sets, new.sets, where, order) if type(rows) is ContactRows else NO_SETS
    return Found(rows, speed, Unsupported.joined([silent, new.unsupported]), tier, sets)


Sets = tuple[FloatArray, IntArray, IntArray]


def _joined_sets(old: Sets, new: Sets, where: IntArray, order: IntArray | None) -> Sets:
    """Contact sets in the given order of old and new rows; without one the new ones take the place of some old ones."""
    points, ends, parts = old
    more, more_ends, more_parts = new
    if order is None:
        if len(more) == 0 and not (ends[where + 1] - ends[where]).any():
            return old
        order = _written(np.arange(len(ends) - 1), where, len(ends) - 1 + np.arange(len(where)))
    ends = np.concatenate([ends, ends[-1] + more_ends[1:]])
    parts = np.concatenate([parts, parts[-1] + more_parts[1:]])
    sizes, _ = gather(np.diff(parts), np.searchsorted(parts, ends), order)
    return *gather(np.concatenate([points, more]), ends, order), np.cumsum([0, *sizes.tolist()])


def _replaced(old: Any, where: IntArray, new: Any) -> Any:
    """The same pairs, some rows with new answers."""
    columns = (
        _written(getattr(old, name), where, getattr(new, name)) if name != "pairs" else old.pairs
        for name in old.columns()
    )
    return type(old)(*columns)


def _written(column: Any, where: IntArray, values: Any) -> Any:
    """A copy with other values."""
    out = column.copy()
    out[where] = values
    return out


def _updated(old: tuple[Any, str], changed: BoolArray, new: tuple[Any, str]) -> tuple[Any, str]:
    """Answers for all objects, those that changed replaced."""
    whole: list[Any] = []
    for before, now in zip(old[0], new[0], strict=True):
        if isinstance(before, np.ndarray):
            before = before.copy()
            before[changed] = now
        whole.append(before)
    return type(old[0])(*whole), new[1]
