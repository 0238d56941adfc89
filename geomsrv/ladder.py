# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""How good an answer is asked to be, and the climb from the cheapest tier to the one that proves it, item by item.

          open items:  n ----> few ----> fewer ----> 0
          tier:      bound   float32    float64    exact
                       |        |          |         |
          settled:     n1   +   n2    +    n3   +    n4   = n, each at the cheapest tier that proves its answer

No geometry is computed here: a query says how it answers some items at a tier, and which answers are settled.
"""

from __future__ import annotations

import math
import time
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from geomsrv import _validate
from geomsrv.answers import (
    BoolArray,
    Booleans,
    ContactStatus,
    Cost,
    Cull,
    Distances,
    DistanceStatus,
    FirstContacts,
    FloatArray,
    IntArray,
    Record,
    gather,
    sets_end_to_end,
)
from geomsrv.errors import GeometryError

__all__ = [
    "AUTO",
    "UNKNOWN",
    "Climb",
    "Quality",
    "climb",
    "climbed_booleans",
    "climbed_contacts",
    "climbed_cull",
    "climbed_distances",
    "narrow",
    "nothing_known",
]

AUTO = "auto"  #: instead of a tier: for each item the cheapest that will do
UNKNOWN = "none"  #: instead of a tier: nothing was found out yet

# So many items show whether a tier settles enough of them to be worth a pass over the others.
TRIAL = 64
TRIED = ("bound", "float32")  # the others settle most

# A tier that settles a smaller share is skipped: a pass of it costs between a twentieth (of the depth of two hulls) and
# all (of the distance of two spheres) of the next one's, mostly about this much.
WORTHWHILE = 0.4

# A chunk takes about this share of the time that is left, so that the last one ends in time.
CHUNK_SHARE = 0.25


@dataclass(frozen=True)
class Quality:
    """What is asked of an answer.

    Attributes
    ----------
    accuracy : str
        A tier, or `AUTO`.
    tolerance : float or None
        Widest proven interval [m], or [s] for times.  With the tier "float64", which is everybody's default, or `AUTO`
        the tier follows from it; another tier is kept to.
    time_budget : float
        Seconds after which nothing more is begun; inf for no limit.
    """

    accuracy: str
    tolerance: float | None = None
    time_budget: float = math.inf

    @classmethod
    def of(cls, accuracy: Any, tolerance: Any = None, time_budget: Any = None) -> Quality:
        """Checked; `GeometryError` names the argument and the fault."""
        if not isinstance(accuracy, str) or accuracy != AUTO:
            _validate.accuracy(accuracy, _validate.ACCURACIES)
        if tolerance is not None:
            tolerance = _validate.scalar(tolerance, "tolerance", positive=True)
        budget = math.inf
        if time_budget is not None:
            budget = _validate.limit(time_budget, "time_budget")
            if budget == 0.0:
                raise GeometryError("time_budget must be > 0, got 0")
        return cls(accuracy, tolerance, budget)

    @property
    def climbs(self) -> bool:
        """Whether there is more to do than to answer at one tier."""
        return self.accuracy == AUTO or self.tolerance is not None or self.time_budget < math.inf

    def rungs(
        self, available: Sequence[str], ladder: Sequence[str], *, lengths: bool = False, certified: bool = False
    ) -> tuple[str, ...]:
        """The tiers to climb, cheapest first.

        Parameters
        ----------
        available : sequence of str
            All tiers of the query.
        ladder : sequence of str
            Those of its tiers that are worth a pass of their own.
        lengths : bool
            Whether the answers are lengths, which without a tolerance have to be as good as those of "float64".
        certified : bool
            Whether the answer has to be proven to others, which not every tier can.
        """
        chosen = tuple(tier for tier in ladder if not lengths or self.tolerance is not None or tier not in TRIED)
        if self.accuracy not in (AUTO, "float64"):
            chosen = (_validate.accuracy(self.accuracy, tuple(available)),)
        elif self.accuracy != AUTO and self.tolerance is None:
            chosen = ("float64",)
        if certified:
            chosen = tuple(tier for tier in chosen if tier in _validate.CERTIFIED_ACCURACIES)
            if not chosen:
                _validate.certificates(certified, self.accuracy)
        if self.time_budget < math.inf:  # so that there is something to say of every item soon
            first = "bound" if "bound" in available and not certified else UNKNOWN
            chosen = chosen if chosen[0] == first else (first, *chosen)
        return chosen


def narrow(lower: FloatArray, upper: FloatArray, tolerance: float | None) -> BoolArray:
    """(n,) bool: intervals that are no wider than the tolerance; neighbouring doubles always are."""
    if tolerance is None:
        return np.ones(len(lower), dtype=bool)
    with np.errstate(invalid="ignore"):
        close: BoolArray = upper - lower <= tolerance
    wide = np.flatnonzero(~close)
    close[wide] = upper[wide] <= np.nextafter(lower[wide], np.inf)
    return close


class RowColumns(Protocol):
    """Arrays of one length, made from its columns in order."""

    def __init__(self, *columns: Any) -> None: ...

    @classmethod
    def columns(cls) -> list[str]:
        """Their names."""


@dataclass(frozen=True, eq=False)
class Climb:
    """Answers of parts of the items, and which of them answers which item.

    Attributes
    ----------
    answers : list
    tiers : list of str
        Tier of each answer.
    items : (n,) or (n, d)
        What was answered: all items, but for those that the answers left out.
    flat : (n,) int64
        Row of each in the answers, one after the other.
    settled : (n,) bool
        Whether its answer is as good as was asked for.
    """

    answers: list[Any]
    tiers: list[str]
    items: NDArray[Any]
    flat: IntArray
    settled: BoolArray
    _starts: IntArray

    def column(self, name: str) -> NDArray[Any]:
        """An array of the answers, a row for each of `items`."""
        whole: NDArray[Any] = np.concatenate([getattr(answer, name) for answer in self.answers])[self.flat]
        return whole

    def rows[Rows: RowColumns](self, kind: type[Rows]) -> Rows:
        """All rows as one."""
        return kind(*map(self.column, kind.columns()))

    def place(self, k: int) -> tuple[Any, int]:
        """The answer that has item k, and its row there."""
        part = int(np.searchsorted(self._starts, self.flat[k], side="right")) - 1
        return self.answers[part], int(self.flat[k] - self._starts[part])

    @property
    def single(self) -> Any:
        """The one answer that has all items in their order; None if there are more."""
        return self.answers[0] if len(self.answers) == 1 and len(self.flat) == len(self.items) else None

    def cost(self, start: int) -> Cost:
        """What all answers cost."""
        counts: Counter[str] = Counter()
        for answer in self.answers:
            counts.update(answer.cost.counts)
        top = self.count_tiers(counts)
        return Cost(time.perf_counter_ns() - start, top, dict(counts))

    def count_tiers(self, counts: Counter[str]) -> str:
        """Count how many items each tier answered, "tier float64"; returns the highest that answered any."""
        if len(self.tiers) == 1:
            counts.update({f"tier {self.tiers[0]}": len(self.flat)} if len(self.flat) else {})
            return self.tiers[0]
        part = np.searchsorted(self._starts, self.flat, side="right") - 1
        by_tier: Counter[str] = Counter()
        for tier, total in zip(self.tiers, np.bincount(part, minlength=len(self.tiers)).tolist(), strict=True):
            by_tier[tier] += total
        used = [tier for tier, total in by_tier.items() if total] or self.tiers
        counts.update({f"tier {tier}": total for tier, total in by_tier.items() if total})
        return max(used, key=(UNKNOWN, *_validate.ACCURACIES).index)

    def message(self) -> str:
        """What the answers say, each once."""
        return "; ".join(dict.fromkeys(answer.message for answer in self.answers if answer.message))

    def record(self) -> Callable[[Any, int], Record] | None:
        """The record that proves item i, if certificates were asked for."""
        if self.answers[0]._record is None:
            return None

        def of(_: Any, i: int) -> Record:
            answer, row = self.place(i)
            proof: Record = answer._record(answer, row)
            return proof

        return of


def climb(
    items: NDArray[Any],
    rungs: Sequence[str],
    solve: Callable[[NDArray[Any], str], tuple[Any, NDArray[Any]]],
    settled: Callable[[Any, str], BoolArray],
    quality: Quality,
    *,
    tried: Sequence[str] = TRIED,
) -> Climb:
    """Answer items at the first of the `rungs`, those that it does not settle at the next, and so on.

    Parameters
    ----------
    items : (n,) or (n, d) array
        Whatever `solve` knows them by.
    rungs : sequence of str
        Tiers, cheapest first.  The first answers every item, however short the time is.
    solve : callable
        ``solve(items, tier)``: an answer, and the items it has rows of, in order; those without a row are done with.
    settled : callable
        ``settled(answer, tier)``: (m,) bool, rows that need no higher tier.
    quality : Quality
    tried : sequence of str
        Tiers of which a few items are to show whether they are worth a pass: what answers an item then depends on the
        others.
    """
    deadline = time.perf_counter() + quality.time_budget
    if deadline == math.inf and (rungs[0] not in tried or len(rungs) == 1):
        answer, answered = solve(items, rungs[0])
        done = settled(answer, rungs[0])
        if done.all() or len(rungs) == 1:  # the common case, at no cost
            return Climb([answer], [rungs[0]], answered, np.arange(len(answered)), done, np.zeros(1, np.int64))
        rest = climb(answered[~done], rungs[1:], solve, settled, quality, tried=tried)
        return _followed_by(answer, rungs[0], answered, done, rest)
    answers: list[Any] = []
    tiers: list[str] = []
    starts = [0]
    kept: list[tuple[NDArray[Any], IntArray, bool]] = []  # items, rows in all answers, whether settled
    left, rows = items, np.zeros(len(items), np.int64)
    for level, tier in enumerate(rungs):
        last, first = level == len(rungs) - 1, level == 0
        still: list[tuple[NDArray[Any], IntArray]] = []
        for chunk in _chunks(len(left), deadline, whole=last or tier not in tried, all_of_it=first):
            if chunk.stop is None:  # out of time: these keep what they have
                kept.append((left[chunk], rows[chunk], False))
                break
            answer, answered = solve(left[chunk], tier)
            done = settled(answer, tier)
            here = starts[-1] + np.arange(len(answered))
            answers.append(answer)
            tiers.append(tier)
            starts.append(starts[-1] + len(answered))
            kept.append((answered[done], here[done], True))
            open_ones = answered[~done], here[~done]
            if last:
                kept.append((*open_ones, False))
            else:
                still.append(open_ones)
                trial = tier in tried and chunk.start == 0 and chunk.stop == TRIAL
                if trial and not (first and quality.time_budget < math.inf):
                    if len(answered) and done.mean() < WORTHWHILE:
                        still.append((left[chunk.stop :], rows[chunk.stop :]))
                        break
        if last or not sum(len(column) for column, _ in still):
            break
        left, rows = (np.concatenate(column) for column in zip(*still, strict=True))
    whole = [np.concatenate(column) for column in zip(*((i, r, np.full(len(r), s)) for i, r, s in kept), strict=True)]
    order = np.lexsort(whole[0].T[::-1]) if whole[0].ndim == 2 else np.argsort(whole[0], kind="stable")
    items, flat, good = (column[order] for column in whole)
    return Climb(answers, tiers, items, flat, good.astype(bool), np.array(starts[:-1]))


def _followed_by(answer: Any, tier: str, items: NDArray[Any], done: BoolArray, rest: Climb) -> Climb:
    """What one answer settled, and a climb of the other items."""
    count = len(done)
    flat, settled = np.arange(count), done.copy()
    left = np.flatnonzero(~done)
    if len(rest.flat) == len(left):
        flat[left], settled[left] = count + rest.flat, rest.settled
    else:  # some of them were done with, without a row
        kept, items = np.flatnonzero(done), np.concatenate([items[done], rest.items])
        flat, settled = np.concatenate([kept, count + rest.flat]), np.concatenate([done[kept], rest.settled])
        order = np.lexsort(items.T[::-1]) if items.ndim == 2 else np.argsort(items, kind="stable")
        items, flat, settled = items[order], flat[order], settled[order]
    starts = np.concatenate([[0], count + rest._starts])
    return Climb([answer, *rest.answers], [tier, *rest.tiers], items, flat, settled, starts)


def _chunks(count: int, deadline: float, *, whole: bool, all_of_it: bool) -> Iterator[slice]:
    """Stretches of `count` items: a trial first unless the tier is the last, then, in a hurry, as many as fit.

    A slice without an end is what there was no time for; with `all_of_it` there always is.
    """
    hurried = deadline < math.inf and not all_of_it
    start = 0
    size = TRIAL if hurried or not whole else max(count, 1)
    while True:
        begin = time.perf_counter()
        if hurried and begin >= deadline:
            yield slice(start, None)
            return
        stop = min(start + size, count)
        yield slice(start, stop)
        start = stop
        if start >= count:
            return
        if hurried:
            now = time.perf_counter()
            share = CHUNK_SHARE * (deadline - now) / max(now - begin, 1e-9)
            size = max(1, min(int(share * size), 4 * size))
        else:
            size = count - start


# ------------------------------------------------------------------------------------------- answers put together

Ask = Callable[[IntArray, str], Any]  #: the query's answer for the listed items at a tier


def climbed_cull(ask: Ask, count: int, rungs: Sequence[str], quality: Quality) -> Cull:
    """Answer of `cull`; a state needs no other tier as soon as it is certain, and then it is within any tolerance."""
    start = time.perf_counter_ns()
    found = climb(np.arange(count), rungs, _whole(ask), lambda answer, _: answer.certain, quality)
    only: Cull | None = found.single
    if only is not None:
        return _priced(only, found, start)
    return Cull(found.column("state"), found.column("certain"), found.cost(start), _record=found.record())


def climbed_booleans(ask: Ask, count: int, rungs: Sequence[str], quality: Quality) -> Booleans:
    """Answer of `intersects`, likewise."""
    start = time.perf_counter_ns()
    found = climb(
        np.arange(count), rungs, _whole(ask), lambda x, _: x.certain | (x.status == DistanceStatus.UNSUPPORTED), quality
    )
    return Booleans(
        value=found.column("value"),
        certain=found.column("certain"),
        status=found.column("status"),
        cost=found.cost(start),
        message=found.message(),
        _record=found.record(),
    )


def climbed_distances(ask: Ask, count: int, rungs: Sequence[str], quality: Quality, *, points: bool) -> Distances:
    """Answer of `distance` or `distance_to_frustum`; with `points` nearest points are wanted, which "bound" lacks."""
    start = time.perf_counter_ns()

    def settled(answer: Distances, tier: str) -> BoolArray:
        hopeless: BoolArray = answer.status == DistanceStatus.UNSUPPORTED
        if tier == "bound" and len(rungs) > 1 and (points or quality.tolerance is None):
            return hopeless
        good: BoolArray = (answer.status == DistanceStatus.OK) & narrow(answer.lower, answer.upper, quality.tolerance)
        return hopeless | good

    found = climb(np.arange(count), rungs, _whole(ask), settled, quality)
    status = found.column("status")
    status[~found.settled & (status == DistanceStatus.OK)] = DistanceStatus.NOT_CONVERGED
    only: Distances | None = found.single
    if only is not None:
        return replace(_priced(only, found, start), status=status)
    return Distances(
        distance=found.column("distance"),
        lower=found.column("lower"),
        upper=found.column("upper"),
        point_b=found.column("point_b"),
        status=status,
        cost=found.cost(start),
        _point_a=lambda: found.column("point_a"),
        _normal=None if found.answers[0]._normal is None else found.column("normal"),
        region=None if any(answer.region is None for answer in found.answers) else found.column("region"),
        message=found.message(),
        _record=found.record(),
    )


def climbed_contacts(ask: Ask, count: int, rungs: Sequence[str], quality: Quality) -> FirstContacts:
    """Answer of `first_contact`."""
    start = time.perf_counter_ns()

    def settled(answer: FirstContacts, tier: str) -> BoolArray:
        if tier == UNKNOWN:
            return np.zeros(len(answer.status), dtype=bool)
        outcome = answer.status >= ContactStatus.UNSUPPORTED  # no other tier answers these otherwise
        timed = answer.status == ContactStatus.WILL_TOUCH
        close = narrow(answer.time_lower, answer.time_upper, quality.tolerance)
        sure: BoolArray = outcome | (answer.certain & (close | ~timed))
        return sure

    found = climb(np.arange(count), rungs, _whole(ask), settled, quality)
    only: FirstContacts | None = found.single
    if only is not None and found.settled.all():
        return _priced(only, found, start)
    status, lower, upper = (found.column(name) for name in ("status", "time_lower", "time_upper"))
    certain, moment = found.column("certain"), found.column("time")
    # What is not settled is bracketed: contact is proven at the end of a certain answer's interval only.
    vague = ~found.settled & ((status != ContactStatus.TOUCHING) | ~certain)
    lower[vague], upper[vague & ~certain] = np.nan_to_num(lower[vague]), np.inf
    moment[vague], status[vague], certain[vague] = lower[vague], ContactStatus.NOT_CONVERGED, False
    offsets = np.cumsum([0, *(len(answer.points) for answer in found.answers)])
    whole = np.concatenate([answer.points for answer in found.answers])
    ends = [answer.point_offsets[1:] + first for answer, first in zip(found.answers, offsets, strict=False)]
    points, point_offsets = gather(whole, np.concatenate([[0], *ends]), found.flat)
    part_offsets = None
    if any(answer._part_offsets is not None for answer in found.answers):
        sets = (answer.parts(row) for answer, row in map(found.place, range(count)))
        points, point_offsets, part_offsets = sets_end_to_end(sets, points.shape[1])
    return FirstContacts(
        status=status,
        time=moment,
        time_lower=lower,
        time_upper=upper,
        last_time=found.column("last_time"),
        normal=found.column("normal"),
        points=points,
        point_offsets=point_offsets,
        certain=certain,
        _closing_speed=lambda: found.column("closing_speed"),
        cost=found.cost(start),
        message=found.message(),
        _part_offsets=part_offsets,
        _record=found.record(),
    )


def nothing_known(count: int, dimension: int) -> FirstContacts:
    """Bodies of which nothing is known but that they may touch at any time."""
    unknown, none = np.full(count, np.nan), np.zeros((0, dimension))
    return FirstContacts(
        status=np.full(count, ContactStatus.NOT_CONVERGED, np.uint8),
        time=np.zeros(count),
        time_lower=np.zeros(count),
        time_upper=np.full(count, np.inf),
        last_time=unknown,
        normal=np.full((count, dimension), np.nan),
        points=none,
        point_offsets=np.zeros(count + 1, np.int64),
        certain=np.zeros(count, dtype=bool),
        _closing_speed=unknown,
        cost=Cost(0, UNKNOWN),
    )


def _priced[Answer: (Cull, Distances, FirstContacts)](answer: Answer, found: Climb, start: int) -> Answer:
    return replace(answer, cost=found.cost(start))


def _whole(ask: Ask) -> Callable[[IntArray, str], tuple[Any, IntArray]]:
    """A query that has a row for every item."""
    return lambda items, tier: (ask(items, tier), items)
