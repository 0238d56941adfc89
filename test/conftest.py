# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""What all tests share: case files, a seeded generator that prints its seed, reproducers in hex floats."""

from __future__ import annotations

import json
import os
import sys
import zlib
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

TEST_DIR = Path(__file__).resolve().parent
if str(TEST_DIR) not in sys.path:  # so that `oracle` is importable from every test
    sys.path.insert(0, str(TEST_DIR))


@cache
def _cases(name: str) -> tuple[dict[str, Any], ...]:
    text = (TEST_DIR / "data" / name).read_text(encoding="utf-8")
    return tuple(json.loads(line) for line in text.splitlines())


def hard_cases(kind: str, *decidable: str) -> list[dict[str, Any]]:
    """Cases of one kind; with `decidable` given, only those of these margin classes."""
    return [
        case
        for case in _cases("hard_cases.jsonl")
        if case["kind"] == kind and (not decidable or case["margin"]["decidable"] in decidable)
    ]


def field_cases(kind: str) -> list[dict[str, Any]]:
    """Inputs of one kind on which other engines went wrong."""
    return [case for case in _cases("field_cases.jsonl") if case["kind"] == kind]


def from_hex(value: Any) -> Any:
    """`float.hex` strings, nested in lists and dicts, as floats; other strings stay."""
    if isinstance(value, str):
        return float.fromhex(value) if "0x" in value else value
    if isinstance(value, dict):
        return {key: from_hex(item) for key, item in value.items()}
    return [from_hex(item) for item in value] if isinstance(value, list) else value


def reproducer(**inputs: Any) -> str:
    """Inputs as text, one per line, every float in hex: a failing test prints them to be pasted back."""
    return "\n".join(f"{name} = {_hex(value)}" for name, value in inputs.items())


def _hex(value: Any) -> str:
    if isinstance(value, (np.ndarray, np.generic)):
        value = value.tolist()
    if isinstance(value, float):
        return f"float.fromhex({value.hex()!r})"
    if isinstance(value, dict):
        return "{" + ", ".join(f"{key!r}: {_hex(item)}" for key, item in value.items()) + "}"
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(_hex(item) for item in value) + "]"
    return repr(value)


@pytest.fixture
def rng(request: pytest.FixtureRequest) -> np.random.Generator:
    """Generator seeded by the test's name, or by GEOMSRV_SEED; pytest shows the seed when a test fails."""
    seed = int(os.environ.get("GEOMSRV_SEED", zlib.crc32(request.node.nodeid.rpartition("/")[2].encode())))
    print(f"GEOMSRV_SEED={seed}")
    return np.random.default_rng(seed)
