// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
// Signed distance of solids of revolution with parallel axes: that of their profiles in the half plane that
// holds both axes.
//
// Of a unit direction n only the part along the axes and the size of the rest count for the supports of such
// bodies, and the gap is largest where the rest points from one axis to the other; so the largest gap is that
// of two plane polygons.  Cylinders one above the other or side by side are the rule in robots, and the one
// case in which a hull of points would need too many of them: all around, the boundary is equally near.
#pragma once

#include <optional>

#include "geom/curved_distance.hpp"

namespace geomsrv {

// Axes count as parallel up to this angle; it is felt at the spread of the bodies, as an error.  Rotation
// matrices of one and the same turn, or of a product that undoes itself, are off by less.
inline constexpr double kParallel = 32 * kUnitRoundoff;

/// Of cylinders, cones, and cores that are points or segments; nothing where the axes lean by more than
/// `most_lean` [rad] or a body is none of these.  The lean widens the interval, not the outcome.
std::optional<CoreSeparation> revolved_distance(const MaybeCurved& a, const MaybeCurved& b, bool penetration,
                                                double most_lean = kParallel);

}  // namespace geomsrv
