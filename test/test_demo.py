# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""The demo as a new user runs it: two processes, from the source tree."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

from ros_helpers import DOMAIN

SOURCE = Path(__file__).resolve().parents[1]


def test_it_answers_and_draws(tmp_path: Path) -> None:
    picture = tmp_path / "cell.png"
    command = [sys.executable, "-P", "-c", "import sys; from geomsrv.cli import main; sys.exit(main())"]
    done = subprocess.run(
        [*command, "demo", "--picture", str(picture)],
        cwd=SOURCE,  # where the package without its native module lies in wait
        env={**os.environ, "ROS_DOMAIN_ID": str(DOMAIN)},
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert "Cross-check" in done.stdout and "checks passed" in done.stdout
    # When and where, as the demo's own check by bodies put there has found, too.
    said = " ".join(done.stdout.split())
    assert re.search(r"panda_rightfinger/2 hits carton after 0\.789\d+ s \(proven to \d\.\de-0[789] s\)", said), said
    assert re.search(r"hits the scanned wall after 4\.517\d+ s \(proven to \d\.\de-1\d s\) at \(0\.700, 2\.223\)", said)
    assert picture.read_bytes().startswith(b"\x89PNG")
