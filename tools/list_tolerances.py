#!/usr/bin/env python3
# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""Lists every named tolerance of the sources in docs/numerics.md, with the derivation its comment gives.

The table between the two markers is written from the sources, so it cannot rot; ``--check`` only compares.
"""

from __future__ import annotations

import re
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PAGE = ROOT / "docs" / "numerics.md"
BEGIN, END = "<!-- tolerances: begin -->", "<!-- tolerances: end -->"

CPP = re.compile(r"^(?:inline |static )*constexpr (?:double|float|Real) (k[A-Z]\w*) = ([^;]+);\s*(?://+<? ?(.*))?$")
PYTHON = re.compile(r"^(_?[A-Z][A-Z_0-9]+)(?:: \w+)? = ([-\d.(][^#]*|[A-Z_.\d* ()+-]*ROUND\w*[^#]*)(?:#:? ?(.*))?$")
# Plain facts about float64, and numbers that decide nothing about an answer.
NOT_TOLERANCES = re.compile(
    r"^LOG_|kInfinity|kNaN|kNan|kLargest$|kSplitter|_TIMEOUT|_PERIOD|_PAUSE|LINE_|POINT_SIZE|SIZE$|LENGTH$|_SIDES|GRAIN$|SPACING$|PALE$|DECADES$"
)
# Whole numbers count things; texts and tuples are something else altogether.
NOT_REAL = re.compile(r"^-?[\d_]+$|^\((?!\d[^,]*\))|\"")


def tolerances(path: Path) -> list[tuple[str, str, str]]:
    """(name, value, derivation) of a file's named tolerances."""
    python = path.suffix == ".py"
    pattern, mark = (PYTHON, "#") if python else (CPP, "//")
    found, comment = [], []
    for line in path.read_text().splitlines():
        text = line.strip()
        if text.startswith(mark) and not text.startswith("#include"):
            comment.append(text.lstrip("/#:< ").strip())
            continue
        if text.startswith("template <"):  # between a comment and its constant
            continue
        match = pattern.match(line if python else text)
        if match and not NOT_TOLERANCES.search(match[1]) and not NOT_REAL.search(match[2].strip()):
            words = " ".join(comment) or (match[3] or "")
            found.append((match[1], match[2].strip(), words))
        if not match or text == "":
            comment = []
    return found


def table() -> str:
    """The table in Markdown."""
    lines = ["| where | name | value | why |", "|---|---|---|---|"]
    sources = [*sorted((ROOT / "src").rglob("*.[ch]pp")), *sorted((ROOT / "geomsrv").rglob("*.py"))]
    for path in sources:
        for name, value, why in tolerances(path):
            cells = (f"`{path.relative_to(ROOT)}`", f"`{name}`", f"`{value}`", why.replace("|", "\\|"))
            lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines)


def main() -> int:
    """Write the table, or with ``--check`` return 1 if it is not what the sources say."""
    text = PAGE.read_text()
    head, _, rest = text.partition(BEGIN)
    _, _, tail = rest.partition(END)
    wanted = f"{head}{BEGIN}\n{table()}\n{END}{tail}"
    if "--check" in sys.argv[1:]:
        return int(wanted != text)
    PAGE.write_text(wanted)
    return 0


if __name__ == "__main__":
    sys.exit(main())
