// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
// Signed distance of any two shapes: places them, picks the kernel of the pair, adds the radii.
#pragma once

#include "geom/separation.hpp"
#include "geom/shape.hpp"

namespace geomsrv {

/// Whether there is a kernel for a pair of kinds, in either order.
bool supported_pair(ShapeKind a, ShapeKind b);

/// Doubles of scratch memory that the pair needs.
constexpr std::size_t scratch_size(const ShapeView& a, const ShapeView& b) {
    return 3 * static_cast<std::size_t>(a.count + b.count);
}

/// Results in the frame of a; X_ab is the pose of b in a.  Overlapping shapes have distance 0, or minus their
/// depth where `wanted`.  Unsupported pairs answer NaN.
///
/// Tier exact rounds correctly for polytopes.  Of spheres and capsules the core is exact and the radii are
/// taken off outwards; half spaces and curved bodies are answered as at float64, to which normals and
/// supports are rounded.
Separation shape_distance(const ShapeView& a, const ShapeView& b, const Transform& X_ab, const Wanted& wanted,
                          double* scratch);

/// A box by its centre, the rows A_i of `axes` and half sizes: the hull of center +- half_extents[i] * A_i.
struct BoxView {
    Vec3 center;
    Mat3 axes;
    Vec3 half_extents;
};

/// A convex body in world coordinates.
struct WorldBody {
    bool is_box = false;
    BoxView box;
    ShapeView hull;  ///< of kind convex, unless it is a box
    Vec3 origin;     ///< what the hull's vertices are relative to, a frustum's corners to its apex
};

/// Results in world coordinates; everything is computed relative to a, so nothing is lost far from the
/// origin.
Separation world_distance(const WorldBody& a, const WorldBody& b, const Wanted& wanted, double* scratch);

}  // namespace geomsrv
