# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""The demo as a new user runs it: two processes, from the source tree; and whether what it says is true."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from collections.abc import Callable
from itertools import product
from pathlib import Path

import numpy as np
import pytest
from oracle import polytope
from ros_helpers import DOMAIN

import geomsrv as gs
from geomsrv._validate import rotation_matrices

SOURCE = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(SOURCE / "demo"))
import cell  # noqa: E402

#: Times are printed to 1e-6 s and proven to less than as much.
PRINTED_S = 2e-6
#: They are found here to this: a thousandth of it.
FOUND_S = 1e-9


@pytest.fixture(scope="module")
def said(tmp_path_factory: pytest.TempPathFactory) -> str:
    """What it prints, without line breaks."""
    picture = tmp_path_factory.mktemp("demo") / "cell.png"
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
    assert picture.read_bytes().startswith(b"\x89PNG")
    return " ".join(done.stdout.split())


def contact(said: str, pattern: str) -> tuple[float, list[float]]:
    """Time and point of the sentence with `pattern`."""
    found = re.search(pattern + r" after (\d\.\d+) s \(proven to \d\.\de-(?:0[789]|1\d) s\) at \(([^)]*)\)", said)
    assert found, said
    return float(found[1]), [float(x) for x in found[2].split(",")]


def first(meets: Callable[[float], bool], apart: float, together: float) -> float:
    """When what is apart at one time and in contact at another comes into contact in between."""
    assert not meets(apart) and meets(together)
    while together - apart > FOUND_S:
        middle = 0.5 * (apart + together)
        apart, together = (apart, middle) if meets(middle) else (middle, together)
    return together


def test_it_answers(said: str) -> None:
    assert "Cross-check" in said and "checks passed" in said


def test_the_robot_meets_the_wall_then(said: str) -> None:
    """Its place is the integral of its velocity; seen every 0.5 ms, and then to 1e-9 s."""
    time, where = contact(said, "hits the scanned wall")
    scan, high = cell.scan(), np.abs(cell.FOOTPRINT_RING).max(axis=0)
    assert cell.FOOTPRINT_RING.min(axis=0).tolist() == (-high).tolist()

    def inside(t: float) -> np.ndarray:
        turned = cell.YAW_RATE * t
        place = cell.DRIVE / cell.YAW_RATE * np.array([np.sin(turned), 1.0 - np.cos(turned)])
        axes = np.array([[np.cos(turned), np.sin(turned)], [-np.sin(turned), np.cos(turned)]])  # ahead, left
        within: np.ndarray = (np.abs((scan - place) @ axes.T) <= high).all(axis=1)
        return within

    assert not any(inside(t).any() for t in np.arange(0.0, time - PRINTED_S, 5e-4))
    assert first(lambda t: bool(inside(t).any()), time - 1e-3, time + PRINTED_S) == pytest.approx(time, abs=PRINTED_S)
    (hit,) = scan[inside(time + PRINTED_S)]
    assert where == pytest.approx(hit, abs=1e-3)


def test_the_arm_meets_the_carton_then(said: str) -> None:
    """By moving its joint, and by exact arithmetic on the corners that this gives."""
    time, where = contact(said, "panda_rightfinger/2 hits carton")
    panda, things = cell.robot(), {item.id: item for item in cell.furniture()}

    def arm(t: float) -> dict[str, gs.SceneObject]:
        joints = {name: value + t * cell.SWING.get(name, 0.0) for name, value in cell.JOINTS.items()}
        return {item.id: item for item in panda.objects(joints)}

    def meets(t: float) -> bool:
        return bool(polytope.intersects(corners(arm(t)["panda_rightfinger/2"]), corners(things["carton"])))

    assert first(meets, time - 1e-3, time + PRINTED_S) == pytest.approx(time, abs=PRINTED_S)
    touching = polytope.separation(corners(arm(time)["panda_rightfinger/2"]), corners(things["carton"])).point_b
    assert where == pytest.approx([float(x) for x in touching], abs=1e-3)
    # Nothing on the table was in its way before.
    scene, links = gs.Scene(), set(panda.ids)
    for t in np.linspace(0.0, time - PRINTED_S, 20):
        objects = [*arm(t).values(), *(things[name] for name in ("carton", "ball", "bottle"))]
        scene.apply(gs.SceneUpdate(clear=True, add=objects))
        near = scene.distances(0.05)
        gaps = [d for a, b, d in zip(near.ids_a, near.ids_b, near.distance, strict=True) if len({a, b} & links) == 1]
        assert gaps and min(gaps) > 0.0, t


def corners(item: gs.SceneObject) -> list[list[float]]:
    """Of a box or hull, in the world."""
    shape, turn = item.shape, rotation_matrices(np.asarray(item.pose, float)[None, 3:])[0]
    signs = np.array(list(product((-1.0, 1.0), repeat=3)))
    local = signs * shape.half_extents if isinstance(shape, gs.Box) else shape.vertices
    return (local @ turn.T + np.asarray(item.pose[:3])).tolist()
