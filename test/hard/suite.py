# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""All generated cases: so many of each class, the same ones everywhere."""

from __future__ import annotations

import json
from collections.abc import Iterator
from random import Random

from geomsrv.hard_cases import Case
from hard import bodies, frustum_box, motions, point_frustum, polygons, turning  # noqa: F401  they register their classes
from hard.numbers import mapped
from hard.registry import CLASSES
from hard.truth import truth_of

# How far a box is from the frustum is another query about the same scenes.
CLASSES["frustum_box_distance"] = CLASSES["frustum_box"]


def generate(kind: str, group: str, count: int, seed: str = "") -> Iterator[Case]:
    """Cases of one class, with the truth about them."""
    for k in range(count):
        given = CLASSES[kind][group](Random(f"{kind}/{group}/{seed}/{k}"))
        yield Case(f"{group}-{k}", kind, group, given, truth_of(kind, given))


def fewer(kind: str, count: int) -> int:
    """How many of a kind stand for `count`: of bodies that turn a tenth, the truth about which takes half a second."""
    return max(1, count // 10) if kind in turning.KINDS.values() else count


def classes() -> Iterator[tuple[str, str]]:
    """(kind, class) of all of them."""
    for kind, groups in CLASSES.items():
        yield from ((kind, group) for group in groups)


def line(case: Case) -> str:
    """The case as a line of JSON that `geomsrv crosscheck --hard --cases` reads; no bit is lost."""
    given = mapped(case.given, lambda x: float(x).hex())
    return json.dumps({"id": case.name, "kind": case.kind, "class": case.group, "input": given})
