# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""Broad phase: the pairs it reports are those of brute force, whatever the boxes."""

import numpy as np
import pytest

from geomsrv import _core

INF = np.inf


def brute_force(lower_a, upper_a, lower_b, upper_b):
    """(na, nb) bool: closed boxes with a common point."""
    return ((lower_a[:, None] <= upper_b[None]) & (lower_b[None] <= upper_a[:, None])).all(axis=2)


def boxes_of(name, n, rng):
    """Lower and upper corners of a named scenario."""
    center, half = rng.uniform(-10.0, 10.0, (n, 3)), rng.uniform(0.0, 1.5, (n, 3))
    if name == "one huge":
        half[n // 2 : n // 2 + 1] = 1e6
    elif name == "mixed sizes":
        half = 10.0 ** rng.uniform(-9.0, 1.5, (n, 1)) * rng.uniform(0.1, 1.0, (n, 3))
    elif name == "all overlap":
        center *= 1e-3
        half += 0.1
    elif name == "line":
        center[:, 1:] *= 1e-6
        center[:, 0] *= 20.0
    elif name == "plane":
        center[:, 2] = 0.0
        half[:, 2] = 0.0
    elif name == "touching grid":
        # Integer corners: whether neighbours touch is exact, and every box touches up to 26 others.
        center, half = np.floor(center / 2.0) + 0.5, np.full((n, 3), 0.5)
    elif name == "points":
        center, half = np.floor(center / 2.0), np.zeros((n, 3))
    elif name == "one place":
        center, half = np.zeros((n, 3)), np.zeros((n, 3))
    elif name == "far apart":
        center *= 10.0 ** rng.uniform(-300.0, 300.0, (n, 1))
    elif name == "exponential line":
        # Each box twice as far out as the last: splits in the middle leave a single box on one side.
        center = np.zeros((n, 3))
        center[:, 0] = 2.0 ** np.arange(n)
        half = np.full((n, 3), 0.5) * center[:, :1]
    elif name == "infinite":
        half[rng.random((n, 3)) < 0.1] = INF
    lower, upper = center - half, center + half
    if name == "infinite":
        lower[rng.random((n, 3)) < 0.05] = -INF
        upper[rng.random((n, 3)) < 0.05] = INF
    return lower, upper


SCENARIOS = (
    "uniform", "one huge", "mixed sizes", "all overlap", "line", "plane", "touching grid", "points",
    "one place", "far apart", "exponential line", "infinite",
)  # fmt: skip


@pytest.mark.parametrize("name", SCENARIOS)
@pytest.mark.parametrize("n", [0, 1, 2, 5, 9, 64, 500])
def test_pairs_are_those_of_brute_force(name, n):
    lower, upper = boxes_of(name, n, np.random.default_rng(n))
    wanted = np.argwhere(np.triu(brute_force(lower, upper, lower, upper), 1))
    pairs = _core.overlapping_pairs(lower, upper)
    assert pairs.dtype == np.int64 and pairs.shape == (len(wanted), 2)
    np.testing.assert_array_equal(pairs, wanted)
    if n == 500:
        assert len(wanted) > 10, "the scenario must hold overlapping boxes"
        assert len(wanted) < n * (n - 1) / 4 or name in ("all overlap", "one place"), "and some that are apart"


@pytest.mark.parametrize("name", SCENARIOS)
@pytest.mark.parametrize("sizes", [(0, 7), (7, 0), (1, 300), (300, 1), (40, 200)])
def test_pairs_between_two_sets_are_those_of_brute_force(name, sizes):
    rng = np.random.default_rng(sizes)
    a, b = boxes_of(name, sizes[0], rng), boxes_of(name, sizes[1], rng)
    np.testing.assert_array_equal(_core.overlapping_pairs_between(*a, *b), np.argwhere(brute_force(*a, *b)))


def test_touching_is_overlap_and_one_ulp_apart_is_not():
    one = np.nextafter(1.0, 2.0)
    for axis in range(3):
        lower, upper = np.zeros((2, 3)), np.ones((2, 3))
        lower[1, axis], upper[1, axis] = 1.0, 2.0
        assert len(_core.overlapping_pairs(lower, upper)) == 1
        lower[1, axis] = one
        assert len(_core.overlapping_pairs(lower, upper)) == 0
        assert len(_core.overlapping_pairs_between(lower[:1], upper[:1], lower[1:], upper[1:])) == 0


def test_order_of_rows_only_renames_the_pairs():
    rng = np.random.default_rng(3)
    lower, upper = boxes_of("mixed sizes", 400, rng)
    order = rng.permutation(400)
    renamed = np.sort(order[_core.overlapping_pairs(lower[order], upper[order])], axis=1)
    renamed = renamed[np.lexsort(renamed.T[::-1])]
    np.testing.assert_array_equal(renamed, _core.overlapping_pairs(lower, upper))


def test_wrong_arguments_are_refused():
    rows = np.zeros((3, 3))
    with pytest.raises(ValueError, match="same length"):
        _core.overlapping_pairs(rows, rows[:2])
    with pytest.raises(TypeError):
        _core.overlapping_pairs(rows.astype(np.float32), rows.astype(np.float32))
