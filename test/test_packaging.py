# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""What the build installs, and where: these tests run on the installed package."""

import ast
import importlib
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

import geomsrv
from geomsrv import _core

SOURCE = Path(__file__).resolve().parents[1]
PACKAGE = Path(geomsrv.__file__).parent
# lib/python3.12/site-packages/geomsrv is four levels below the prefix.
PREFIX = PACKAGE.parents[3]


def test_tests_see_the_installed_package():
    assert SOURCE / "geomsrv" != PACKAGE
    assert "site-packages" in PACKAGE.parts


def test_version_is_written_in_package_xml_only():
    version = re.search("<version>(.+)</version>", (SOURCE / "package.xml").read_text())[1]
    assert geomsrv.__version__ == version
    for name in ("CMakeLists.txt", "pyproject.toml", "setup.py", "geomsrv/__init__.py"):
        assert version not in re.findall(r"\d+\.\d+\.\d+", (SOURCE / name).read_text()), name


def test_every_python_file_is_installed():
    def tree(root):
        return {path.relative_to(root) for path in root.rglob("*.py*") if path.suffix != ".pyc"}

    written = tree(SOURCE / "geomsrv")
    installed = tree(PACKAGE)
    assert written
    assert written <= installed
    generated = {path for path in installed - written if path.parts[0] not in ("msg", "srv")}
    assert generated == {Path("_version.py")}
    assert (PACKAGE / "py.typed").exists()


@pytest.mark.parametrize("kind", ["msg", "srv"])
def test_every_interface_is_importable(kind):
    names = sorted(path.stem for path in (SOURCE / kind).glob(f"*.{kind}"))
    assert names
    module = importlib.import_module(f"geomsrv.{kind}")
    assert [name for name in names if not hasattr(module, name)] == []


def test_files_beside_the_package_are_installed():
    share = PREFIX / "share" / "geomsrv"
    for folder in ("config", "demo", "launch"):
        names = sorted(path.name for path in (SOURCE / folder).iterdir() if path.is_file())
        assert names
        assert sorted(path.name for path in (share / folder).iterdir() if path.is_file()) == names
    assert (share / "package.xml").exists()


@pytest.mark.parametrize("place", ["bin/geomsrv", "lib/geomsrv/geomsrv"])
def test_command_runs(place):
    done = subprocess.run([PREFIX / place, "--help"], capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stderr
    assert "usage" in done.stdout.lower()


def test_node_is_an_executable_of_the_package():
    node = PREFIX / "lib" / "geomsrv" / "node"
    assert os.access(node, os.X_OK)
    interpreter = Path(node.read_text().splitlines()[0].removeprefix("#!"))
    assert interpreter.parent == Path(sys.executable).parent


def test_stub_names_what_the_module_has():
    tree = ast.parse((PACKAGE / "_core.pyi").read_text())
    stub = {node.name for node in tree.body if isinstance(node, ast.FunctionDef | ast.ClassDef)}
    module = {name for name in dir(_core) if not name.startswith("_")}
    assert stub == module


@pytest.mark.parametrize("target", ["hard", "bench", "price", "demo"])
def test_commands_of_the_makefile_run_on_the_installed_package(target):
    """Started in the source root, whose package has no engine, they must not import it from there."""
    if not (SOURCE / ".venv/bin/python").exists():
        pytest.skip("these commands are for what make has built; this source tree has no .venv")
    command = f"make --no-print-directory --dry-run --assume-old build {target} ARGS=--help | tail -n 1 | sh"
    ran = subprocess.run(command, shell=True, cwd=SOURCE, capture_output=True, text=True, timeout=60)
    assert "usage:" in ran.stdout and not ran.stderr, ran.stderr
