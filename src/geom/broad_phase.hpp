// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
// Which axis-aligned boxes overlap: everything that can be said before a shape is looked at.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace geomsrv {

/// Axis-aligned boxes as rows of two arrays: lower <= upper, no NaN, infinite bounds welcome.
struct AabbRows {
    const double* lower = nullptr;  ///< 3 * count corners with the smallest coordinates
    const double* upper = nullptr;  ///< 3 * count corners with the largest coordinates
    std::size_t count = 0;
};

struct IndexPair {
    std::uint32_t first = 0;
    std::uint32_t second = 0;
};

/// More rows than an index can name: the binding refuses them.
constexpr std::size_t kMaxBoxes = 0x7fff'ffff;

/// All i < j whose closed boxes have a common point (touching counts), sorted by (i, j).
std::vector<IndexPair> overlapping_pairs(const AabbRows& boxes);

/// All (i, j) where closed boxes a[i] and b[j] have a common point, sorted by (i, j).
std::vector<IndexPair> overlapping_pairs_between(const AabbRows& a, const AabbRows& b);

}  // namespace geomsrv
