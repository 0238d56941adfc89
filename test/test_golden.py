# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""The same bits on every machine, instruction set and optimisation level: 100,000 answers against kept hashes."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import golden
import pytest

import geomsrv
from geomsrv import _validate

ROOT = Path(__file__).resolve().parents[1]
SCRIPT = Path(golden.__file__)


def test_answers_are_the_kept_ones() -> None:
    expected, found = golden.kept(), golden.hashes()
    wrong = [name for name in expected if found.get(name) != expected[name]]
    assert not wrong, "if the change is wanted: python test/golden.py --write"
    assert set(found) == set(expected), "python test/golden.py --write keeps those of new tiers"
    assert {name.partition(".")[0] for name in found} == set(golden.QUERIES)
    assert {name.partition(".")[2] for name in found} == set(_validate.ACCURACIES)


def test_enough_queries_are_asked() -> None:
    asked = 0
    for name, query in golden.QUERIES.items():
        for answer in query(golden.Stream(name), "float64", 1):
            asked += len(next(values for _, values in golden.content(answer)))
    assert asked >= 100_000


def test_one_bit_changes_the_hash(monkeypatch: pytest.MonkeyPatch) -> None:
    boxes = golden.Stream.boxes

    def nudged(self: golden.Stream, count: int, spread: int = 4) -> geomsrv.Boxes:
        given = boxes(self, count, spread)
        half = given.half_extents.copy()
        half[-1, 0] += 2.0**-20
        return geomsrv.Boxes(given.center, given.axes, half)

    monkeypatch.setattr(golden.Stream, "boxes", nudged)
    assert golden.hashes(("boxes",))["boxes.float64"] != golden.kept()["boxes.float64"]


@pytest.mark.parametrize(
    "setting", ["OPENBLAS_CORETYPE=Prescott", "NPY_DISABLE_CPU_FEATURES=X86_V3 X86_V4 AVX512_ICL AVX512_SPR"]
)
def test_no_part_is_left_to_the_processor_in_python(setting: str) -> None:
    """numpy and its BLAS choose kernels by the processor; whatever an answer depends on must not be one of them."""
    name, _, value = setting.partition("=")
    run_check(dict(os.environ) | {name: value}, "mixed", "shapes", "to_frustum", "turning", "curved")


def test_nothing_is_fused_behind_the_compilers_back() -> None:
    """GCC's vectoriser makes a*b - c and a*b + c side by side one fused instruction, whatever -ffp-contract says.

    One multiply-add alone is only where the source asks for it.
    """
    (library,) = Path(geomsrv.__file__).parent.glob("_core*.so")
    listing = subprocess.run(["objdump", "-d", library], check=True, capture_output=True, text=True).stdout
    assert "ret" in listing
    assert not [line for line in listing.splitlines() if "vfmaddsub" in line or "vfmsubadd" in line]


BUILDS = {
    "-O0, one path": ["-DCMAKE_BUILD_TYPE=Debug", "-DCMAKE_CXX_FLAGS=-DGEOMSRV_ONE_PATH"],
    "-O3, the wider path": [
        "-DCMAKE_BUILD_TYPE=Release",
        "-DCMAKE_CXX_FLAGS=-DGEOMSRV_ONE_PATH -march=x86-64-v3 -Wno-psabi",
    ],
    "-O3, all for this machine": [
        "-DCMAKE_BUILD_TYPE=Release",
        "-DCMAKE_CXX_FLAGS=-DGEOMSRV_ONE_PATH -march=native -Wno-psabi",
    ],
}

EXACT_TIER = ("test_distance_to_frustum.py", "test_distance_exact.py", "test_cull_exact.py", "test_polygons_exact.py")


@pytest.mark.soak
@pytest.mark.timeout(7200)
@pytest.mark.parametrize("build", BUILDS)
def test_every_build_gives_the_same_bits(build: str, tmp_path: Path) -> None:
    """The installed module picks the wider of two paths when it is loaded, by asking the processor; these have one.

    The first has no fused multiply-add either: what is exact is judged there as well, which no hash can do.
    """
    place = tmp_path / "inst"
    for command in (
        ["cmake", "-G", "Ninja", "-S", ROOT, "-B", tmp_path / "build", "-DGEOMSRV_ROS=OFF", *BUILDS[build]]
        + [f"-DPython3_EXECUTABLE={sys.executable}", f"-DCMAKE_INSTALL_PREFIX={place}"],
        ["cmake", "--build", tmp_path / "build"],
        ["cmake", "--install", tmp_path / "build"],
    ):
        subprocess.run(command, check=True, capture_output=True)
    (package,) = place.rglob("geomsrv/__init__.py")
    environment = dict(os.environ) | {"PYTHONPATH": str(package.parents[1]), "PYTHONSAFEPATH": "1"}
    run_check(environment)
    if "-march" not in " ".join(BUILDS[build]):
        judge_exact_tier(environment)


def judge_exact_tier(environment: dict[str, str]) -> None:
    """All that the oracle has to say, short of what it says in a soak."""
    modules = [SCRIPT.with_name(name) for name in EXACT_TIER]
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", *modules],
        env={name: value for name, value in environment.items() if name != "GEOMSRV_SOAK"},
        cwd=SCRIPT.parents[1],
        capture_output=True,
        text=True,
        timeout=3000,
    )
    assert done.returncode == 0, done.stdout[-4000:] + done.stderr[-2000:]


def run_check(environment: dict[str, str], *names: str) -> None:
    done = subprocess.run(
        [sys.executable, SCRIPT, "--check", *names], env=environment, capture_output=True, text=True, timeout=1800
    )
    assert done.returncode == 0, done.stdout + done.stderr[-2000:]
