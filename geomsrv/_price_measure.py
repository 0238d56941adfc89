# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""Error and time of ways to answer a query: what a row of the price list is, and how it is measured.

No query, no shape and no other engine is named here.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from geomsrv.errors import GeometryError, NotAvailableError

__all__ = ["Call", "Effort", "Found", "Measure", "Priced", "Query", "Way", "WayError", "cheapest", "front", "measure"]

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]


class WayError(Exception):
    """A way that cannot answer this query here; the text says why.  Empty: there is nothing for it to do."""


class Found(NamedTuple):
    """What a way answers for n items."""

    hit: BoolArray  #: the yes or no of it: in contact, visible, will touch
    value: FloatArray | None = None  #: the number of it: distance [m], time [s]; NaN where there is none
    lower: FloatArray | None = None  #: the interval that the way vouches for, if it does
    upper: FloatArray | None = None
    unsure: BoolArray | None = None  #: where it does not vouch for `hit`, if it says


class Call(NamedTuple):
    """A way at work on one block of items: what is timed, and what makes an answer of its result, which is not."""

    run: Callable[[], Any]
    read: Callable[[Any], Found]


@dataclass(frozen=True)
class Way:
    """One way to answer a query.

    Attributes
    ----------
    name : str
    family : str
        Ways of one family share a colour: tiers, fewer sides, fixed steps, another engine.
    prepare : callable
        Makes a `Call` for a block of items; what it does is not timed.
    """

    name: str
    family: str
    prepare: Callable[[Any], Call]


@dataclass(frozen=True)
class Query:
    """One row of the price list: a question, its items, and the ways to answer it.

    Attributes
    ----------
    name : str
    asks : str
        The public function that it is about, as "distance" or "Scene.cull".
    unit : str
        Of the error: "m", "s", or "" for a question of yes or no, whose error is the share of wrong answers.
    inputs : callable
        ``inputs(n, seed)`` makes a block of n items.
    items : int
        Items in a block.
    ways : tuple of Way
    truths : tuple of Way
        The first that answers is what the others are judged by.
    """

    name: str
    asks: str
    unit: str
    inputs: Callable[[int, int], Any]
    items: int
    ways: tuple[Way, ...]
    truths: tuple[Way, ...]


@dataclass(frozen=True)
class Measure:
    """How wrong and how slow one way is.

    Attributes
    ----------
    worst, p99 : float
        Error of the number, or for a question of yes or no the share of wrong answers (then p99 is NaN).
    proven : float
        How far the end of the interval that the way vouches for is from its number, at worst, or the share of answers
        that it does not vouch for; NaN if it vouches for none.
    false_alarms, misses : int
        Items answered yes in place of no, and the reverse.
    unsure : int or None
        Items whose yes or no the way does not vouch for; None if it does not say.
    items : int
    ns, ns_p99 : float
        CPU time per item: median and 99th percentile over the blocks timed.
    """

    way: str
    family: str
    worst: float
    p99: float
    proven: float
    false_alarms: int
    misses: int
    unsure: int | None
    items: int
    ns: float
    ns_p99: float

    @property
    def wrong(self) -> int:
        """Wrong answers of yes or no."""
        return self.false_alarms + self.misses


@dataclass(frozen=True)
class Priced:
    """A row of the price list, measured."""

    query: str
    asks: str
    unit: str
    truth: str  #: name of the way that the others were judged by; empty if nobody knows the answer
    truth_width: float  #: how well it is known: widest interval, NaN if the truth is no interval
    block: int  #: items that are timed together
    measures: tuple[Measure, ...]
    skipped: dict[str, str] = field(default_factory=dict)  #: ways that did not answer, and why


class Effort(NamedTuple):
    """How much work a measurement is worth."""

    blocks: int  #: of items, with other numbers in each
    share: float  #: of the items in a block
    seconds: float  #: of timing, for all ways of a query together
    turns: int  #: at least, for each way


FULL = Effort(6, 1.0, 3.0, 12)
QUICK = Effort(3, 0.5, 0.4, 3)
LEAST_ITEMS = 8  #: of a block


def measure(query: Query, effort: Effort, seed: int = 0, step: Callable[[str], object] = str) -> Priced:
    """Error and time of every way of a query that answers.

    All ways answer the same blocks of items, and take turns at it in one process, so that a drifting machine slows
    all alike.  Each turn is one block; a slow way gets fewer turns.  `step` is told the name of the way at work.
    """
    items = max(LEAST_ITEMS, round(effort.share * query.items))
    blocks = [query.inputs(items, seed + k) for k in range(effort.blocks)]
    skipped: dict[str, str] = {}
    judge, truths = _truth(query.truths, blocks, skipped)
    if judge is None:
        reasons = "; ".join(dict.fromkeys(skipped.values()))
        return Priced(query.name, query.asks, query.unit, "", np.nan, items, (), {"": f"nobody knows: {reasons}"})
    calls: dict[Way, list[Call]] = {}
    answers: dict[Way, list[Found]] = {}
    for way in query.ways:
        step(way.name)
        try:
            made = [way.prepare(block) for block in blocks]
            answers[way] = [call.read(call.run()) for call in made]
            calls[way] = made
        except (WayError, NotAvailableError, ImportError) as reason:
            if str(reason):
                skipped[way.name] = str(reason)
    step("taking turns")
    times = _take_turns(calls, effort)
    measures = tuple(
        Measure(
            way.name,
            way.family,
            *errors(found, truths, query.unit),
            items=items * len(blocks),
            ns=float(np.percentile(times[way], 50)) / items,
            ns_p99=float(np.percentile(times[way], 99)) / items,
        )
        for way, found in answers.items()
    )
    width = _widest(truths, lambda t: None if t.lower is None or t.upper is None else t.upper - t.lower)
    return Priced(query.name, query.asks, query.unit, judge, width, items, measures, skipped)


def _truth(truths: Iterable[Way], blocks: Sequence[Any], skipped: dict[str, str]) -> tuple[str | None, list[Found]]:
    """Who knows the answers, and the answers."""
    for way in truths:
        try:
            calls = [way.prepare(block) for block in blocks]
            return way.name, [call.read(call.run()) for call in calls]
        except (WayError, NotAvailableError) as reason:
            skipped[way.name] = str(reason)
    return None, []


def _take_turns(calls: dict[Way, list[Call]], effort: Effort) -> dict[Way, list[int]]:
    """CPU time of every turn [ns]."""
    times: dict[Way, list[int]] = {way: [] for way in calls}
    allowance = 1e9 * effort.seconds / max(1, len(calls))
    turn = 0
    while True:
        waiting = [way for way, spent in times.items() if sum(spent) < allowance or len(spent) < effort.turns]
        if not waiting:
            return times
        for way in waiting:
            run = calls[way][turn % effort.blocks].run
            begin = time.thread_time_ns()
            run()
            times[way].append(time.thread_time_ns() - begin)
        turn += 1


def errors(
    answers: Sequence[Found], truths: Sequence[Found], unit: str
) -> tuple[float, float, float, int, int, int | None]:
    """Worst error, its 99th percentile, what is proven, false alarms, misses, and how many answers are unsure."""
    hit, right = np.concatenate([a.hit for a in answers]), np.concatenate([t.hit for t in truths])
    false_alarms, misses = int((hit & ~right).sum()), int((~hit & right).sum())
    unsure = None if answers[0].unsure is None else sum(int(a.unsure.sum()) for a in answers if a.unsure is not None)
    if not unit:
        proven = np.nan if unsure is None else unsure / len(hit)
        return (false_alarms + misses) / len(hit), np.nan, proven, false_alarms, misses, unsure
    off = np.concatenate([_off(a, t) for a, t in zip(answers, truths, strict=True)])
    known = off[~np.isnan(off)]
    worst, p99 = (
        (float(known.max()), float(np.percentile(known, 99, method="higher"))) if len(known) else (np.nan, np.nan)
    )
    return worst, p99, _widest(answers, _promise), false_alarms, misses, unsure


def _off(answer: Found, truth: Found) -> FloatArray:
    """Error of the number; NaN where one of both has none, which counts as a false alarm or a miss."""
    assert answer.value is not None and truth.value is not None
    equal = answer.value == truth.value  # two infinities are, and their difference is no number
    with np.errstate(invalid="ignore"):
        off: FloatArray = np.where(equal, 0.0, np.abs(answer.value - truth.value))
    return off


def _promise(answer: Found) -> FloatArray | None:
    """How far off the number may be, by its own interval."""
    if answer.lower is None or answer.upper is None or answer.value is None:
        return None
    with np.errstate(invalid="ignore"):
        promise: FloatArray = np.maximum(answer.upper - answer.value, answer.value - answer.lower)
    return promise


def _widest(answers: Iterable[Found], width: Callable[[Found], FloatArray | None]) -> float:
    """Largest number of all; NaN if there is none."""
    widths = [w[~np.isnan(w)] for w in map(width, answers) if w is not None]
    return max((float(w.max()) for w in widths if len(w)), default=np.nan)


# ------------------------------------------------------------------------------------------------------ choices


def front(measures: Sequence[Measure]) -> list[Measure]:
    """The ways worth their price, fastest first.

    Of these each is better than any other in time, in error, or in the number of wrong answers of yes or no.
    """
    known = [m for m in measures if not np.isnan(m.worst)]
    best = [m for m in known if not any(_beats(other, m) for other in known)]
    return sorted(best, key=lambda m: (m.ns, m.worst))


def _beats(one: Measure, other: Measure) -> bool:
    """No worse in anything, and better in something."""
    a, b = (one.ns, one.worst, one.wrong), (other.ns, other.worst, other.wrong)
    return a != b and all(x <= y for x, y in zip(a, b, strict=True))


def cheapest(priced: Priced, tolerance: float, *, proven: bool) -> Measure | None:
    """The fastest way without a wrong answer of yes or no that meets a tolerance.

    With `proven` its own interval must be that narrow; otherwise it is enough that no item measured was off by more.
    """
    fit = [m for m in priced.measures if m.wrong == 0 and (m.proven if proven else m.worst) <= tolerance]
    return min(fit, key=lambda m: m.ns, default=None)


def matching(queries: Iterable[Query], text: str) -> Iterator[Query]:
    """Queries whose name holds every word of `text`; pairs of shapes in either order."""
    words = text.replace(",", " ").lower().split()
    for query in queries:
        name = query.name.replace(",", " ").lower()
        pieces = {*name.split(), *("-".join(reversed(piece.split("-"))) for piece in name.split())}
        if all(word in pieces or ("-" not in word and word in name) for word in words):
            yield query


def split_request(text: str) -> tuple[str, float]:
    """Words and tolerance of "distance box-capsule 1e-6"."""
    words, _, last = text.strip().rpartition(" ")
    try:
        tolerance = float(last)
    except ValueError:
        raise GeometryError(
            f"the last word must be a tolerance, as in 'distance box-capsule 1e-6'; got {last!r}"
        ) from None
    if not tolerance >= 0.0:
        raise GeometryError(f"the tolerance must be >= 0, got {tolerance}")
    return words, tolerance
