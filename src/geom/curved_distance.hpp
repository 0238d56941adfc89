// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
// Signed distance of two convex bodies of which at least one is curved.
//
// Both are approached from inside, by the hulls of points of them found so far, and from outside, by their
// supports.  Nearest points of the hulls are points of the bodies: their distance is an upper bound.  The
// gap between the supports along the normal of the hulls is a lower bound, and where the two have not met,
// the points that support there make the hulls grow.  Hulls that overlap prove contact; from there on the
// hull of the difference of the bodies grows, see growing_hull.hpp.
#pragma once

#include "geom/curved.hpp"
#include "geom/half_space_pairs.hpp"
#include "geom/separation.hpp"

namespace geomsrv {

/// One of the pair: `polytope` unless it is curved.
struct MaybeCurved {
    const CurvedBody* curved = nullptr;
    const Core* polytope = nullptr;
};

/// With `penetration` overlapping bodies get their depth; without it only a common point.  Bounds that have
/// not met when the work allowed is done are the answer NOT_CONVERGED.
CoreSeparation curved_distance(const MaybeCurved& a, const MaybeCurved& b, bool penetration);

/// Exact but for rounding, see convex_half_space.
CoreSeparation curved_half_space(const CurvedBody& a, const PlacedHalfSpace& b, bool penetration);

}  // namespace geomsrv
