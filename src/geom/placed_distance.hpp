// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
// Signed distance of two shapes that are both placed in one frame, with an interval that covers the rounding
// of their relative pose.
#pragma once

#include "geom/distance_table.hpp"

namespace geomsrv {

/// A shape somewhere in the common frame.
struct PlacedShape {
    ShapeView shape;
    const double* pose = nullptr;  ///< row x y z qx qy qz qw, unit quaternion
    double reach = 0.0;        ///< distance of its farthest point from its origin [m]; inf for a half space
    double uncertainty = 0.0;  ///< radius by which each of its points may be off [m]
};

/// What `shape_distance` answers for the pose of b in a, rounded and then taken literally; turned into the
/// common frame. Only the interval covers more: the rounding of that pose, and the uncertainties. At tier
/// bound `distance` stays its lower end. `pose_rounding` is how far, relative to the two reaches and the
/// distance of the origins, a rounded relative pose may move one shape against the other.
Separation placed_distance(const PlacedShape& a, const PlacedShape& b, double pose_rounding,
                           const Wanted& wanted, double* scratch);

}  // namespace geomsrv
