// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
// The largest gap between two zonotopes (points, segments, boxes) along the facet normals of their
// difference, for the caller's numbers exactly: whether they meet, and if they do, minus their depth.
#pragma once

#include "geom/exact_feature.hpp"

namespace geomsrv {

struct ExactGap {
    bool found = false;  ///< false if the difference is flat; then nothing below has a meaning
    bool meet = false;   ///< no facet parts them
    Rounding gap;        ///< if they meet, and it was asked for: the largest of the gaps, correctly rounded
    Vec3 normal;         ///< unit, from a to b: its direction
    Rung rung = Rung::filter;
};

/// REQUIRES: both are zonotopes.  With `depth` the gap is measured, not only its sign.
ExactGap largest_facet_gap(const ExactAndRough& a, const ExactAndRough& b, bool in_range, bool depth);

}  // namespace geomsrv
