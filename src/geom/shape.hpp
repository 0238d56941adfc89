// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
// Shapes as the tables of the Python layer list them, and how a pose is read.
#pragma once

#include <cstddef>
#include <cstdint>

#include "geom/frustum.hpp"
#include "geom/vec.hpp"

namespace geomsrv {

/// Order of `_core.shape_kinds()`; rows and columns of the table in distance_table.cpp.
enum class ShapeKind : std::uint8_t {
    sphere,      ///< params: radius
    capsule,     ///< params: radius, half length; axis z
    box,         ///< params: half extents
    convex,      ///< hull of `vertices`; params: how far each listed vertex may be from the one meant [m],
                 ///< usually 0
    half_space,  ///< params: unit normal (to a few ulps), offset; solid where normal . x <= offset
    cylinder,    ///< params: radius, half length; axis z
    cone,        ///< params: radius, half length; apex on +z
    ellipsoid,   ///< params: half axes
    mesh,
    polygon,
};

/// Known by supports and not by vertices, see curved.hpp.
constexpr bool is_curved(ShapeKind kind) {
    return kind == ShapeKind::cylinder || kind == ShapeKind::cone || kind == ShapeKind::ellipsoid;
}

inline constexpr const char* kShapeNames[] = {"sphere",   "capsule", "box",       "convex", "half_space",
                                              "cylinder", "cone",    "ellipsoid", "mesh",   "polygon"};
inline constexpr std::size_t kShapeKinds = sizeof(kShapeNames) / sizeof(kShapeNames[0]);

/// Where the points of a hull lie.
struct HullExtent {
    Vec3 middle;  ///< of their bounding box
    Vec3 half;    ///< half its sides, or an ulp more
};

/// One shape in its own frame; the arrays belong to the caller.
struct ShapeView {
    ShapeKind kind = ShapeKind::sphere;
    const double* params = nullptr;    ///< 4 numbers, see ShapeKind [m]
    const double* vertices = nullptr;  ///< 3 * count coordinates of a convex shape [m]
    std::ptrdiff_t count = 0;
    const HullExtent* extent = nullptr;  ///< of a convex shape, if the caller knows it; see extent_of
    const Frustum* frustum = nullptr;    ///< of which `vertices` are the eight corners, rounded
};

/// Rotation of the unit quaternion x y z w, rounded: from there on the nine numbers are taken literally.
constexpr Mat3 rotation_of(double x, double y, double z, double w) {
    return {{{1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)},
             {2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)},
             {2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)}}};
}

/// Row x y z qx qy qz qw.
constexpr Transform pose_of(const double* row) {
    return {rotation_of(row[3], row[4], row[5], row[6]), {row[0], row[1], row[2]}};
}

}  // namespace geomsrv
