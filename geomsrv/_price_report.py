# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""Price lists to look at: tables on the console, a figure for each query, one page of HTML, one of Markdown."""

from __future__ import annotations

import base64
import html
import io
import math
import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from itertools import pairwise
from typing import Any

from geomsrv._price_measure import Measure, Priced, front
from geomsrv._price_peers import COAL_FAMILY, FCL_FAMILY
from geomsrv._price_ways import APPROXIMATION, BUDGET, FEWER, OTHER, STEPS, TIER, TOLERANCE, VOLUME
from geomsrv._validate import ACCURACIES

__all__ = ["ABOUT", "figure", "page_html", "page_markdown", "printed", "progress", "slug", "summary", "table"]

HEAD = ("way", "worst error", "99 %", "proven", "false alarms", "misses", "unsure", "ns an item", "99 %", "worth it")
SUMMARY_HEAD = ("query", *(f"{tier} ns" for tier in ACCURACIES), "exact / float64", "worst error of float64")

LEAST_WIDTH = 120  #: of a table on the console, in characters

# Colours that the colour-blind tell apart (Okabe and Ito), and marks that everybody does.
LOOKS = {
    TIER: ("#0072B2", "o"),
    TOLERANCE: ("#56B4E9", "h"),
    BUDGET: ("#0B7A75", "d"),
    APPROXIMATION: ("#009E73", "s"),
    FEWER: ("#E69F00", "^"),
    VOLUME: ("#CC79A7", "D"),
    STEPS: ("#D55E00", "v"),
    OTHER: ("#6B4C9A", "P"),
    FCL_FAMILY: ("#222222", "X"),
    COAL_FAMILY: ("#8A8A00", "*"),
}
# Errors that a figure has room for [m or s]: what is further off, such as the largest double in place of a depth, is in
# the table only.
MOST_DRAWN = 1e6
FEW_DECADES = 100.0  #: of times, below which 2 and 5 are named, too
MISSED = "#C00000"
PALE = 0.3

UNITS = {"m": "worst error of the distance [m]", "s": "worst error of the time [s]", "": "share of wrong answers [1]"}


def slug(name: str) -> str:
    """File name of a query's figure, without its ending."""
    return re.sub("[^a-z0-9]+", "_", name.lower()).strip("_")


# ---------------------------------------------------------------------------------------------------------- tables


def _number(x: float) -> str:
    return "" if math.isnan(x) else "0" if x == 0.0 else f"{x:.1e}"


def _time(ns: float) -> str:
    return f"{ns:,.0f}" if ns >= 100.0 else f"{ns:.1f}"


def table(priced: Priced) -> list[tuple[str, ...]]:
    """A row of text for every way, under `HEAD`."""
    best = front(priced.measures)
    return [
        (
            m.way,
            _number(m.worst),
            _number(m.p99),
            _number(m.proven),
            f"{m.false_alarms:,}",
            f"{m.misses:,}",
            "" if m.unsure is None else f"{m.unsure:,}",
            _time(m.ns),
            _time(m.ns_p99),
            "yes" if m in best else "",
        )
        for m in priced.measures
    ]


def summary(prices: Sequence[Priced]) -> list[tuple[str, ...]]:
    """A row of text for every query, under `SUMMARY_HEAD`: what the tiers cost."""
    rows = []
    for priced in prices:
        tiers = {m.way: m for m in priced.measures if m.family == TIER}
        if not tiers:
            continue
        double, exact = tiers.get("float64"), tiers.get("exact")
        times = [_time(tiers[tier].ns) if tier in tiers else "" for tier in ACCURACIES]
        ratio = f"{exact.ns / double.ns:.1f}" if double and exact else ""
        error = f"{_number(double.worst)} {priced.unit}".rstrip() if double else ""
        rows.append((priced.query, *times, ratio, error))
    return rows


def _judged(priced: Priced) -> str:
    if not priced.truth:
        return priced.skipped.get("", "nobody knows the answers")
    items = max((m.items for m in priced.measures), default=0)
    known = "" if math.isnan(priced.truth_width) else f", known to {priced.truth_width:.1e} {priced.unit}"
    return f"{items:,} items, timed {priced.block:,} at a time; judged by: {priced.truth}{known}"


def _skipped(priced: Priced) -> list[str]:
    """Who did not answer, once for each reason."""
    reasons: dict[str, list[str]] = {}
    for way, reason in priced.skipped.items():
        if way:
            reasons.setdefault(reason, []).append(way.partition(", tolerance")[0])
    return [f"not answered by {', '.join(dict.fromkeys(ways))}: {reason}" for reason, ways in reasons.items()]


def printed(prices: Sequence[Priced]) -> None:
    """All tables on the console."""
    from rich import box
    from rich.console import Console
    from rich.table import Table

    console = Console()
    console = Console(width=max(console.width, LEAST_WIDTH))

    def show(title: str, head: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
        out = Table(title=title, title_justify="left", box=box.SIMPLE_HEAD, title_style="bold")
        for k, name in enumerate(head):
            out.add_column(name.replace(" ", "\n"), justify="right" if k else "left", no_wrap=True)
        for row in rows:
            out.add_row(*row)
        console.print(out)

    for priced in prices:
        if priced.measures:
            show(f"{priced.query} [{priced.unit or 'share'}]".replace("[", r"\["), HEAD, table(priced))
        else:
            console.print(f"{priced.query}", style="bold", highlight=False)
        for line in (_judged(priced), *_skipped(priced)):
            console.print(line, style="dim", highlight=False, markup=False)
        console.print()
    if rows := summary(prices):
        show("What the tiers cost", SUMMARY_HEAD, rows)


@contextmanager
def progress(total: int) -> Iterator[Any]:
    """A bar on the console; gives a function that is told which query and which way is at work.

    It is drawn when told so and not by a thread of its own, which would take time from what is measured.
    """
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

    columns = TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn()
    with Progress(*columns, console=Console(stderr=True), auto_refresh=False, transient=True) as bar:
        task = bar.add_task("", total=total)
        done: list[str] = []

        def step(query: str, way: str) -> None:
            if query not in done:
                done.append(query)
            bar.update(task, completed=len(done) - 1, description=f"{query}: {way}", refresh=True)

        yield step


# --------------------------------------------------------------------------------------------------------- figures


def _label(m: Measure) -> str:
    """Name of a way beside its mark, whose colour tells the family."""
    number = re.search(r"\d[\d.e-]*", m.way)
    if m.family in (APPROXIMATION, FEWER) and number:
        return number[0]
    if m.family == STEPS and number:
        return f"{number[0]} s"
    return m.way.removeprefix("FCL, ").removeprefix("Coal, ").replace("tolerance ", "tol. ")


def _staircase(priced: Priced) -> list[Measure]:
    """The ways that the line joins: of those with the fewest wrong answers of yes or no, the best for their time."""
    known = [m for m in priced.measures if m.worst <= MOST_DRAWN]
    if priced.unit:
        fewest = min((m.wrong for m in known), default=0)
        known = [m for m in known if m.wrong == fewest]
    steps: list[Measure] = []
    for m in sorted(known, key=lambda m: (m.ns, m.worst)):
        if not steps or m.worst < steps[-1].worst:
            steps.append(m)
    return steps


def figure(priced: Priced) -> bytes:
    """Error against time as PNG; empty if there is nothing to draw."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    drawn = [m for m in priced.measures if m.worst <= MOST_DRAWN]
    if not drawn:
        return b""
    positive = [m.worst for m in drawn if m.worst > 0.0]
    top = max(positive, default=1e-15)
    floor = _floor(min(positive, default=1e-16))
    heights = {m.way: m.worst or floor for m in drawn}
    best = front(drawn)

    picture = Figure(figsize=(9.2, 5.0), dpi=100, layout="constrained")
    canvas = FigureCanvasAgg(picture)
    axes = picture.add_subplot()
    axes.set_xscale("log")
    axes.set_yscale("log")
    times = [m.ns for m in drawn]
    axes.set_xlim(min(times) / 2.0, max(times) * 2.5)
    low = floor / 4.0 if len(positive) < len(drawn) else min(positive) / 8.0
    axes.set_ylim(low, top * (top / low) ** 0.08)
    if len(positive) < len(drawn):
        axes.axhspan(low, floor * math.sqrt(10.0), color="0.94", zorder=0)
        axes.axhline(floor * math.sqrt(10.0), color="0.6", lw=0.8, ls=":", zorder=1)
    if max(times) / min(times) < FEW_DECADES:
        axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axes.xaxis.set_major_formatter(FuncFormatter(lambda ns, _: _with_unit(ns)))
    axes.xaxis.set_minor_formatter(NullFormatter())
    _ticks(axes, floor if len(positive) < len(drawn) else None, low, top)

    steps = _staircase(priced)
    line = [(m.ns, heights[m.way]) for m in steps]
    axes.step(*zip(*line, strict=True), where="post", color="0.45", lw=1.2, zorder=2)
    for m in drawn:
        color, mark = LOOKS[m.family]
        axes.plot(
            m.ns, heights[m.way], mark, color=color, ms=8, alpha=1.0 if m in best else PALE, mec="none", zorder=4
        )  # fmt: skip
        if m.misses:
            axes.plot(m.ns, heights[m.way], "o", ms=13, mfc="none", mec=MISSED, mew=1.3, zorder=3)

    axes.set_xlabel("CPU time per item, median [ns, µs, ms]")
    axes.set_ylabel(UNITS[priced.unit])
    axes.set_title(priced.query, fontsize=12, fontweight="bold", loc="left")
    axes.grid(True, which="major", color="0.9", lw=0.6)
    axes.set_axisbelow(True)

    families = [family for family in LOOKS if any(m.family == family for m in drawn)]
    handles = [
        Line2D([], [], ls="", marker=LOOKS[f][1], color=LOOKS[f][0], mec="none", ms=8, label=f) for f in families
    ]
    if len(line) > 1:
        handles.append(Line2D([], [], color="0.45", lw=1.2, label="best for its time"))
    if any(m not in best for m in drawn):
        handles.append(
            Line2D([], [], ls="", marker="o", color="0.3", alpha=PALE, mec="none", ms=8, label="pale: another beats it")
        )
    if any(m.misses for m in drawn):
        handles.append(Line2D([], [], ls="", marker="o", mfc="none", mec=MISSED, ms=11, label="misses some"))
    picture.legend(handles=handles, loc="outside right upper", frameon=False, fontsize=9)
    canvas.draw()
    corners = [place for (x0, y0), (x1, _) in pairwise(line) for place in ((x0, y0), (x1, y0))] + line[-1:]
    _name_marks(axes, canvas, [(m, heights[m.way], m in best) for m in drawn], corners)
    out = io.BytesIO()
    canvas.print_png(out, pil_kwargs={"optimize": True})
    return _fewer_colours(out.getvalue())


def _with_unit(ns: float) -> str:
    """A time in the unit that makes it short."""
    power = min(2, max(0, int(math.log10(max(ns, 1.0))) // 3))
    return f"{ns / 1000.0**power:.4g} {('ns', 'µs', 'ms')[power]}"


def _floor(least: float) -> float:
    """Where an error of 0 is drawn: a decade or more below the least one that is not."""
    return float(10.0 ** (math.floor(math.log10(least)) - 1))


def _ticks(axes: Any, zero: float | None, low: float, top: float) -> None:
    """Decades, thinned out, and 0 at its place."""
    first = math.ceil(math.log10(low if zero is None else zero)) + (zero is not None)
    last = math.floor(math.log10(top) + 0.5)
    stride = max(1, math.ceil((last - first + 1) / 9))
    decades = list(range(first, last + 1, stride)) or [first]
    places = [10.0**k for k in decades]
    names = [f"$10^{{{k}}}$" for k in decades]
    if zero is not None:
        places, names = [zero, *places], ["0", *names]
    axes.set_yticks(places, names)
    axes.tick_params(axis="y", which="minor", left=False)


# Where a name may stand beside its mark [points], the first that is free.
PLACES = [(8, 4), (8, -10), (-8, 4), (-8, -10), (0, 9), (0, -15), (12, 14), (12, -22), (-12, 14), (-12, -22), (0, 20)]


def _name_marks(
    axes: Any, canvas: Any, marks: list[tuple[Measure, float, bool]], line: list[tuple[float, float]]
) -> None:
    """Names beside marks where there is room, clear of `line`; those on the front first."""
    renderer = canvas.get_renderer()
    frame = axes.get_window_extent(renderer)
    points = [axes.transData.transform((m.ns, height)) for m, height, _ in marks]
    taken: list[tuple[float, float, float, float]] = [(x - 5, y - 5, x + 5, y + 5) for x, y in points]
    joints = [axes.transData.transform(place) for place in line]
    for (x0, y0), (x1, y1) in pairwise(joints):
        taken.append((min(x0, x1), min(y0, y1), max(x0, x1), max(y0, y1)))
    for m, height, is_best in sorted(marks, key=lambda mark: not mark[2]):
        own = axes.transData.transform((m.ns, height))
        for dx, dy in PLACES:
            side = "left" if dx > 0 else "right" if dx < 0 else "center"
            text = axes.annotate(
                _label(m),
                (m.ns, height),
                xytext=(dx, dy),
                textcoords="offset points",
                ha=side,
                fontsize=8,
                color=LOOKS[m.family][0],
                alpha=1.0 if is_best else 0.7,
                zorder=5,
            )
            place = text.get_window_extent(renderer).padded(1.0)
            inside = frame.x0 <= place.x0 and place.x1 <= frame.x1 and frame.y0 <= place.y0 and place.y1 <= frame.y1
            others = [box for box in taken if box[0] != own[0] - 5 or box[1] != own[1] - 5]
            if inside and not any(_meet((place.x0, place.y0, place.x1, place.y1), box) for box in others):
                taken.append((place.x0, place.y0, place.x1, place.y1))
                break
            text.remove()


def _meet(a: tuple[float, float, float, float], b: tuple[float, float, float, float]) -> bool:
    return a[0] < b[2] and b[0] < a[2] and a[1] < b[3] and b[1] < a[3]


def _fewer_colours(png: bytes) -> bytes:
    """The same picture with a palette, a third of the size; matplotlib brings what it takes."""
    from PIL import Image

    out = io.BytesIO()
    Image.open(io.BytesIO(png)).convert("RGB").quantize(256).save(out, "PNG", optimize=True)
    return out.getvalue()


# ----------------------------------------------------------------------------------------------------------- pages

ABOUT = """\
Written by `geomsrv price{options}`, version {version}, on one core of {processor}; run it on your own machine,
whose times are others. Each query is answered by every tier of geomsrv and by the other ways in which people answer it,
all on the same items, taking turns in one process. Errors are against the way named below each table."""

READING = {
    "worst error, 99 %": """\
Largest error of the number [m or s], and the error that 99 % of the items stay below; where the question is one of yes
or no, the share of wrong answers. 0 is drawn at the foot of a figure, below the dotted line.""",
    "proven": """\
How far the number may be off by the interval that the answer itself carries, at worst; of yes and no, the share of
answers that are not certain. Empty: the way vouches for nothing.""",
    "false alarms, misses": """\
A contact or a sight reported that is not there, and one that is there and is not reported. In the figures a red ring
marks ways that miss some.""",
    "unsure": "Answers of yes or no that the way itself does not vouch for.",
    "ns an item, 99 %": "CPU time: median over blocks of items, and what 99 % of the blocks stay below.",
    "worth it": """\
No other way is at least as good in time, error and wrong answers, and better in one of them. The others are pale in the
figures. The line joins the best for their time among the ways with the fewest wrong answers of yes or no.""",
}


def page_markdown(prices: Sequence[Priced], images: str, about: str) -> str:
    """A page with all tables, and the figures in the folder `images`."""
    lines = ["# What accuracy costs", "", about, ""]
    lines += [f"- **{name}**: {' '.join(text.splitlines())}" for name, text in READING.items()]
    lines += ["", "## What the tiers cost", "", *_markdown(SUMMARY_HEAD, summary(prices))]
    for priced in prices:
        lines += ["", f"## {priced.query}", ""]
        if priced.measures:
            lines += [f"![{priced.query}: error against CPU time per item]({images}/{slug(priced.query)}.png)", ""]
            lines += [*_markdown(HEAD, table(priced)), ""]
        lines += ["  \n".join(f"{line[0].upper()}{line[1:]}." for line in (_judged(priced), *_skipped(priced)))]
    return "\n".join(lines) + "\n"


def _markdown(head: Sequence[str], rows: Sequence[Sequence[str]]) -> list[str]:
    rule = ["---", *["---:"] * (len(head) - 1)]
    return [f"| {' | '.join(cells)} |" for cells in (head, rule, *rows)]


STYLE = """\
body { font: 15px/1.5 system-ui, sans-serif; max-width: 60rem; margin: 2rem auto; padding: 0 1rem; color: #222 }
table { border-collapse: collapse; margin: 1rem 0; font-variant-numeric: tabular-nums; font-size: 13px }
th, td { padding: .2rem .6rem; text-align: right; border-bottom: 1px solid #ddd }
th:first-child, td:first-child { text-align: left }
img { max-width: 100% } .note { color: #666; font-size: 13px } nav a { margin-right: 1rem; white-space: nowrap }"""


def page_html(prices: Sequence[Priced], figures: dict[str, bytes], about: str) -> str:
    """One page that holds everything: figures are part of it, and nothing is fetched."""
    opening = re.sub("`(.*?)`", r"<code>\1</code>", html.escape(about))
    parts = ["<!doctype html><html lang='en'><head><meta charset='utf-8'><title>What accuracy costs</title>"]
    parts += [f"<style>{STYLE}</style></head><body><h1>What accuracy costs</h1><p>{opening}</p><ul>"]
    parts += [f"<li><b>{html.escape(name)}</b>: {html.escape(text)}</li>" for name, text in READING.items()]
    parts += ["</ul><nav>"]
    parts += [f"<a href='#{slug(p.query)}'>{html.escape(p.query)}</a> " for p in prices]
    parts += ["</nav><h2>What the tiers cost</h2>", _html(SUMMARY_HEAD, summary(prices))]
    for priced in prices:
        parts += [f"<h2 id='{slug(priced.query)}'>{html.escape(priced.query)}</h2>"]
        if image := figures.get(priced.query):
            data = base64.b64encode(image).decode()
            parts += [f"<img alt='{html.escape(UNITS[priced.unit])}' src='data:image/png;base64,{data}'>"]
        if priced.measures:
            parts += [_html(HEAD, table(priced))]
        notes = "<br>".join(html.escape(line) for line in (_judged(priced), *_skipped(priced)))
        parts += [f"<p class='note'>{notes}</p>"]
    return "\n".join([*parts, "</body></html>"]) + "\n"


def _html(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    lines = ["".join(f"<th>{html.escape(cell)}</th>" for cell in head)]
    lines += ["".join(f"<td>{html.escape(cell)}</td>" for cell in row) for row in rows]
    return "<table>" + "".join(f"<tr>{line}</tr>" for line in lines) + "</table>"
