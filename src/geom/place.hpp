// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
// Placing the two shapes of a pair in one local frame: subtract positions first, round once, keep the
// rounding.
#pragma once

#include <optional>

#include "geom/core.hpp"
#include "geom/curved.hpp"
#include "geom/exact_body.hpp"
#include "geom/half_space_pairs.hpp"
#include "geom/shape.hpp"

namespace geomsrv {

/// A shape in the local frame of its pair.
struct Placed {
    Core core;                         ///< unless it is a half space; of a curved body a box around it
    PlacedHalfSpace half_space;        ///< if it is one
    std::optional<CurvedBody> curved;  ///< if it is one
};

/// Axes of the first shape (or the world), another origin, another unit of length.
struct LocalFrame {
    Vec3 origin;         ///< in those axes [m]
    double scale = 1.0;  ///< power of two: local = scale * (world - origin)
};

/// REQUIRES: a convex shape with at least one vertex.
HullExtent extent_of(const ShapeView& shape);

/// A point of the shape about its middle, in its own frame: the middle of a hull's bounding box, the origin
/// of others. Not meaningful for a half space.
Vec3 middle_of(const ShapeView& shape);

/// Size of the largest number that placing the shape works with, radii apart.
double magnitude_of(const ShapeView& shape, const Transform& X_ls);

/// X_ls: pose of the shape in the frame's axes.  `scratch` takes the 3 * count coordinates of a hull.
Placed place(const ShapeView& shape, const Transform& X_ls, const LocalFrame& frame, double* scratch);

/// Box center +- half_extents[i] * axes[i]; the rows of `axes` are taken literally.
Core place_box(Vec3 center, const Mat3& axes, Vec3 half_extents, const LocalFrame& frame);

/// The shape by its own numbers; `X_ls` must outlive it.  Not for half spaces.
ExactBody exact_body(const ShapeView& shape, const Transform& X_ls);

/// The corners of a frustum in the order of ExactBody, relative to its apex or to the origin of its axes, and
/// how far each may be off.
struct RoundedCorners {
    double vertices[24];
    double error = 0.0;
};
RoundedCorners rounded_corners(const Frustum& frustum, bool from_apex);

/// Largest coordinate by size.
double largest_of(Vec3 v);

/// Norm that neither overflows nor underflows.
double safe_norm(Vec3 v);

/// True where the kernels can work in this unit; `size` is the sum of the reaches.
constexpr bool in_range(double size) {
    return size == 0.0 || (size >= kSmallestReach && size <= kLargestReach);
}

/// Power of two that brings `size` near 1.
double scale_for(double size);

}  // namespace geomsrv
