// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
// The largest gap between two zonotopes (points, segments, boxes) along the facet normals of their
// difference, for the caller's numbers exactly: whether they meet, and if they do, minus their depth.
#pragma once

#include "geom/exact_feature.hpp"

namespace geomsrv {

struct ExactGap {
    bool found = false;  ///< false if the difference is flat; then nothing below has a meaning
    Rounding gap;        ///< correctly rounded; if > 0 the bodies are apart, by at least this
    Vec3 normal;         ///< unit, from a to b: the direction of that gap
    Rung rung = Rung::filter;
};

/// REQUIRES: both are zonotopes.
ExactGap largest_facet_gap(const ExactAndRough& a, const ExactAndRough& b, bool in_range);

}  // namespace geomsrv
