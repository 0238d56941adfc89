# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""`python -m hard`: every class through every tier and every peer; writes the tables of docs/hard_cases.md.

The text around the markers is kept.  Exits with 1 if the engine was wrong.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Iterator
from pathlib import Path

from geomsrv import hard_check
from geomsrv.hard_cases import Case, read
from geomsrv.hard_check import PEERS, TIERS, Report, check, unsupported
from hard import suite

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs" / "hard_cases.md"
CORPUS, FIELD = (ROOT / "test" / "data" / f"{name}.jsonl" for name in ("hard_cases", "field_cases"))
TITLES = {"fcl": "FCL", "coal": "Coal"}


def main() -> int:
    """Run, and write the page."""
    parser = argparse.ArgumentParser(prog="python -m hard", description=__doc__)
    parser.add_argument("--count", type=int, default=100, help="generated cases per class")
    parser.add_argument("--kind", action="append", help="only this kind; may be repeated; the page is left alone")
    arguments = parser.parse_args()
    start = time.perf_counter()
    generated = check(cases(arguments.count, arguments.kind), by_group=True)
    corpus, field = (check(read(path)) for path in (CORPUS, FIELD))
    reports = (generated, corpus, field)
    for line in [line for report in reports for line in report.wrong if line.split(":")[0] in TIERS]:
        print(line)
    fewer = suite.fewer("polyhedra_turning", arguments.count)
    size = f"{arguments.count} cases of each class, {fewer} of bodies that turn."
    parts = {
        "generated": f"{size}\n\n{table(generated, ('kind', 'class'))}",
        "corpus": table(corpus, ("kind",)),
        "field": table(field, ("kind",)),
        "missing": missing(),
    }
    if arguments.kind:
        print(generated.text())
    else:
        write(parts)
    print(f"{time.perf_counter() - start:.0f} s, {sum(r.engine_wrong for r in reports)} wrong answers of the engine")
    return int(any(report.engine_wrong for report in reports))


def cases(count: int, kinds: list[str] | None) -> Iterator[Case]:
    """The generated ones."""
    for kind, group in suite.classes():
        if not kinds or kind in kinds:
            yield from suite.generate(kind, group, suite.fewer(kind, count))


def table(report: Report, heads: tuple[str, ...]) -> str:
    """Markdown: a cell is wrong / uncertain / right, and crashed if anything did."""
    engines = [*TIERS, *PEERS]
    lines = [[*heads, *(TITLES.get(engine, f"`{engine}`") for engine in engines)]]
    lines.append(["---"] * len(heads) + ["---:"] * len(engines))
    for row in report.rows():
        lines.append([*row.split(" "), *(cell(report.tallies.get((row, engine))) for engine in engines)])
    totals = [total(report, engine) for engine in engines]
    lines.append(["**all**", *[""] * (len(heads) - 1), *(cell(tally) for tally in totals)])
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def total(report: Report, engine: str) -> hard_check.Tally | None:
    found = [tally for (_, name), tally in report.tallies.items() if name == engine]
    return hard_check.Tally(*map(sum, zip(*found, strict=True))) if found else None


def cell(tally: hard_check.Tally | None) -> str:
    if tally is None:
        return "–"
    wrong = f"**{tally.wrong}**" if tally.wrong else "0"
    crashed = f", {tally.crashed} crashed" if tally.crashed else ""
    return f"{wrong} / {tally.uncertain} / {tally.right}{crashed}"


def missing() -> str:
    """Field cases that the engine has no kernel for, by what they need."""
    lines = ["| kind | shapes | cases |", "|---|---|---|"]
    for (kind, shapes), names in unsupported(FIELD).items():
        lines.append(f"| {kind} | {shapes} | {', '.join(f'`{name}`' for name in names)} |")
    return "\n".join(lines)


def write(parts: dict[str, str]) -> None:
    """Put every part between its markers."""
    text = PAGE.read_text(encoding="utf-8")
    for name, part in parts.items():
        begin, end = f"<!-- {name}: begin -->", f"<!-- {name}: end -->"
        head, _, rest = text.partition(begin)
        _, _, tail = rest.partition(end)
        text = f"{head}{begin}\n{part}\n{end}{tail}"
    PAGE.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    sys.exit(main())
