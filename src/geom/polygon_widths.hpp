// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
// The gaps of two polygons at rest as widths, which are comparable: what distance finds first at every tier
// that computes in float64.
#pragma once

#include "geom/polygon_pair.hpp"

namespace geomsrv {

// Lengths below are not resolved by their squares; the width along an axis so short can be anything.
inline constexpr double kShortestAxis = 0x1p-500;

struct Widest {
    double lower;  ///< largest lower bound of gap/|D| over all axes
    bool overlap;  ///< certainly gap < 0 along every axis
};

/// Leaves for every axis an upper bound of gap/|D| in work[0], and of the gap in work[1].
Widest widths_of(const PolygonPair& pair);

}  // namespace geomsrv
