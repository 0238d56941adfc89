# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""Runs the demo that is installed beside the package; the demo itself is a client and lives outside of it."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

__all__ = ["main"]


def main(argv: Sequence[str] = ()) -> int:
    """Run ``share/geomsrv/demo/robot_cell.py`` with `argv`; returns its exit status."""
    relative = Path("share", "geomsrv", "demo", "robot_cell.py")
    here = Path(__file__).resolve()
    for prefix in here.parents:
        if (prefix / relative).is_file():
            return subprocess.run([sys.executable, str(prefix / relative), *argv], check=False).returncode
    print(
        "geomsrv demo: the demo is not installed; build the package with `make build` or colcon",
        file=sys.stderr,
    )
    return 2
