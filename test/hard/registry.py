# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""Which classes there are.  Importing a module of generators registers its classes."""

from __future__ import annotations

from collections.abc import Callable
from random import Random
from typing import Any

Generator = Callable[[Random], dict[str, Any]]

CLASSES: dict[str, dict[str, Generator]] = {}  #: by kind and class


def hard(kind: str) -> Callable[[Generator], Generator]:
    """Register a generator of `kind` as the class it is named for."""

    def register(generator: Generator) -> Generator:
        CLASSES.setdefault(kind, {})[generator.__name__] = generator
        return generator

    return register
