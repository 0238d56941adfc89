# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""Every named tolerance is listed in the docs with its derivation, and no bare one is left in the kernels."""

import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PAGE = (ROOT / "docs" / "numerics.md").read_text()
ROWS = [line.split(" | ") for line in PAGE.splitlines() if line.startswith(("| `src/", "| `geomsrv/"))]


def test_the_list_is_what_the_sources_say():
    run = subprocess.run([sys.executable, str(ROOT / "tools" / "list_tolerances.py"), "--check"], check=False)
    assert run.returncode == 0, "run tools/list_tolerances.py"
    assert len(ROWS) > 40


def test_every_tolerance_has_a_derivation():
    assert [row[1] for row in ROWS if len(row[3].strip(" |")) < 20] == []


def test_kernels_have_no_bare_tolerance():
    # A decimal with a negative exponent, or a power of two below 1, outside of a named constant or a comment.
    bare = re.compile(r"\d[eE]-\d|0x1p-\d")
    for path in sorted((ROOT / "src").rglob("*.[ch]pp")):
        for number, line in enumerate(path.read_text().splitlines(), 1):
            code = line.split("//")[0]
            assert not bare.search(code) or "constexpr" in code, f"{path.relative_to(ROOT)}:{number}: {line.strip()}"
