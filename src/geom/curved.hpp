// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
// Cylinders, cones and ellipsoids, placed in the common frame of a pair: known by their supports.
//
// Each is the image of a body K about its own axes, rotation * K + center, the nine numbers of the rotation
// taken literally; so its support along d is that of K along the transposed rotation times d, plus d .
// center.
#pragma once

#include <vector>

#include "geom/core.hpp"
#include "geom/shape.hpp"
#include "geom/vec.hpp"

namespace geomsrv {

/// Axis z: a cylinder of half length half[2]; a cone with its apex at +half[2] and its base at -half[2]; an
/// ellipsoid.
struct CurvedBody {
    ShapeKind kind = ShapeKind::cylinder;
    Vec3 center;
    Mat3 rotation;
    double half[3] = {};  ///< half sizes along the own axes: radius, radius, half length; or half axes
    double spread = 0.0;  ///< upper bound of the distance of its points from `center`
    double reach = 0.0;   ///< upper bound of |center| + spread
    double error = 0.0;   ///< how far a point may be from the one that the caller's numbers mean
};

/// Highest point along a direction, and its height there.
struct SupportPoint {
    double value = 0.0;
    Vec3 point;
};

// What a point, and a support, of a curved body may be off, in terms of the same for polytopes (kVertexError,
// 3 u, and kSupportError, 7 u, times the reach).  A direction in the own axes takes 3 u of three products for
// each of three coordinates, 6 u of its length; a unit vector made from it 4 u; the products with half sizes
// 1 u; back in the common frame three products for each coordinate take 6 u more, the sum with the center 1
// u. So a point is less than 18 u off a point of the body, and 24 u are allowed; a support takes 6 u, a
// length of 4 u, and 4 u of the sum with the center, and 56 u are allowed.
inline constexpr double kCurvedCoarseness = 8.0;

/// Along a direction of length 1 +- 4 u.
SupportPoint highest_point(const CurvedBody& body, Vec3 direction);

/// A body known by its supports, curved or not: what the algorithms for polytopes ask of a core, of which the
/// vertices are the points found so far.
struct SupportedCore {
    // Its roundoff in terms of kUnitRoundoff, as of a curved body.
    static constexpr double kCoarseness = kCurvedCoarseness;

    const CurvedBody* curved = nullptr;  ///< nullptr for a polytope
    const Core* polytope = nullptr;
    std::vector<Vec3>* found = nullptr;  ///< points of the curved body; nullptr to keep none
    double reach = 0.0;
    double error = 0.0;
};

inline Vec3 vertex_of(const SupportedCore& core, int vertex) {
    return core.curved == nullptr ? vertex_of(*core.polytope, vertex)
                                  : (*core.found)[static_cast<std::size_t>(vertex)];
}

/// See highest(Core); a curved body keeps the point.
Extreme highest(const SupportedCore& core, Vec3 n);
inline Extreme lowest(const SupportedCore& core, Vec3 n) {
    const Extreme top = highest(core, -n);
    return {-top.value, top.vertex};
}

}  // namespace geomsrv
