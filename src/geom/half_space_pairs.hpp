// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
// Signed distance of a half space and anything.
#pragma once

#include "geom/curved.hpp"
#include "geom/separation.hpp"
#include "geom/single_core.hpp"

namespace geomsrv {

/// Points x with normal . x <= offset in the common frame; literal, so the distance of a point is what it
/// exceeds the plane by, divided by |normal|.
struct PlacedHalfSpace {
    Vec3 normal;  ///< length 1 +- 8 u
    double offset = 0.0;
    double normal_error = 0.0;  ///< how far `normal` may be from the one meant
    double offset_error = 0.0;
};

/// Exact but for rounding: the depth of a convex body in a half space is that of its lowest point.  Without
/// `penetration` that is a common point if it lies in the half space.
CoreSeparation convex_half_space(const Core& a, const PlacedHalfSpace& b, bool penetration);

/// In single precision; the plane is as it is, in double.
CoreSeparation convex_half_space(const SingleCore& a, const PlacedHalfSpace& b, bool penetration);

/// Of a curved body by its support.
CoreSeparation convex_half_space(const SupportedCore& a, const PlacedHalfSpace& b, bool penetration);

/// Half spaces that face each other: the gap between their planes, or minus the thickness of what they share.
/// All others share an unbounded part and cannot be parted: distance -infinity, no normal.
CoreSeparation half_space_half_space(const PlacedHalfSpace& a, const PlacedHalfSpace& b);

}  // namespace geomsrv
