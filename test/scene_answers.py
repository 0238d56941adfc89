# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""Scenes of listed objects, and the rows of what they answer by pair."""

from __future__ import annotations

import geomsrv as gs


def scene_of(objects, **options):
    scene = gs.Scene(**options)
    scene.apply(gs.SceneUpdate(add=objects))
    return scene


def rows_of(answer):
    """Row of each pair of ids."""
    return {pair: k for k, pair in enumerate(zip(answer.ids_a, answer.ids_b, strict=True))}
