# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""What the tests of first contact read out of an answer, in the plane and in space."""

from __future__ import annotations

import numpy as np

import geomsrv as gs

STATUS = {"NEVER": gs.NEVER, "WILL_TOUCH": gs.WILL_TOUCH, "TOUCHING": gs.TOUCHING, "OVERLAPPING": gs.OVERLAPPING}


def points_of(answer, i=0):
    return answer.points[answer.point_offsets[i] : answer.point_offsets[i + 1]]


def set_distance(points, others):
    """Largest distance from a point of one set to the nearest of the other, both ways."""
    apart = np.abs(np.asarray(points, float)[:, None] - np.asarray(others, float)[None]).max(axis=-1)
    return max(apart.min(axis=0).max(), apart.min(axis=1).max())
