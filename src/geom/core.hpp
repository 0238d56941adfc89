// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
// Cores: what is left of a shape when its rounding radius is taken off, placed in the common frame of a pair.
//
//   sphere  = point   + radius        box    = box  + 0
//   capsule = segment + radius        convex = hull + 0
//
// The signed distance of two shapes is that of their cores minus both radii, whether the cores are apart or
// overlap: a ball added to a convex set moves every supporting plane out by its radius.
#pragma once

#include <cstdint>

#include "geom/double_double.hpp"
#include "geom/rounding.hpp"
#include "geom/shape.hpp"
#include "geom/vec.hpp"

namespace geomsrv {

/// A convex polytope: center + all sums of +-generators (point, segment, box), or center + the hull of
/// points.
struct Core {
    static constexpr double kCoarseness = 1.0;  ///< its roundoff in terms of kUnitRoundoff

    Vec3 center;
    Vec3 generator[3];               ///< half edges of a zonotope, taken literally
    int generators = 0;              ///< 0 point or hull, 1 segment, 3 box
    const double* points = nullptr;  ///< hull: count x, count y, count z; nullptr for a zonotope
    int count = 0;
    double reach = 0.0;  ///< upper bound of |center| + the longest of what is added to it
    double error = 0.0;  ///< how far a vertex may be from the one that the caller's numbers mean
};

/// Extreme value of normal . v over the vertices, and the vertex where it is attained: an index into the
/// points of a hull; of a zonotope, bit i is set where generator i is added.
struct Extreme {
    double value = 0.0;
    int vertex = 0;
};

// A vertex, rounded: three sums, each rounding a vector no longer than the reach.
inline constexpr double kVertexError = 3 * kUnitRoundoff;

// A support: a dot product is off by 3 u of the sizes of its factors, which together are no longer than the
// reach; at most three sums follow, none larger than the reach; one more u covers the higher orders.
inline constexpr double kSupportError = 7 * kUnitRoundoff;

/// Off by at most kVertexError * reach.
inline Vec3 vertex_of(const Core& core, int vertex) {
    if (core.points != nullptr) {
        const double* p = core.points + vertex;
        return core.center + Vec3{p[0], p[core.count], p[2 * core.count]};
    }
    Vec3 v = core.center;
    for (int i = 0; i < core.generators; ++i) {
        v = (vertex >> i & 1) != 0 ? v + core.generator[i] : v - core.generator[i];
    }
    return v;
}

/// Highest vertex along a direction of length 1 +- 4 u; the value is off by at most kSupportError * reach.
inline Extreme highest(const Core& core, Vec3 n) {
    if (core.points != nullptr) {
        const double* x = core.points;
        const double* y = x + core.count;
        const double* z = y + core.count;
        Extreme top{n.x * x[0] + n.y * y[0] + n.z * z[0], 0};
        for (int i = 1; i < core.count; ++i) {
            const double value = n.x * x[i] + n.y * y[i] + n.z * z[i];
            if (value > top.value) {
                top = {value, i};
            }
        }
        top.value += dot(n, core.center);
        return top;
    }
    Extreme top{dot(n, core.center), 0};
    for (int i = 0; i < core.generators; ++i) {
        const double along = dot(n, core.generator[i]);
        top.value += std::abs(along);
        top.vertex |= (along > 0.0 ? 1 : 0) << i;
    }
    return top;
}

inline Extreme lowest(const Core& core, Vec3 n) {
    const Extreme top = highest(core, -n);
    return {-top.value, top.vertex};
}

/// The core moved along a unit vector.
inline Core moved(Core core, Vec3 along, double by) {
    core.center = core.center + by * along;
    core.reach += std::abs(by);
    return core;
}

/// As doubles; see single_core.hpp.
constexpr Vec3 widened(Vec3 v) { return v; }

/// Highest vertex along a direction known to more than double precision.
struct WideExtreme {
    DoubleDouble value;
    int vertex = 0;
};
WideExtreme highest(const Core& core, WideVec3 n);
inline WideExtreme lowest(const Core& core, WideVec3 n) {
    const WideExtreme top = highest(core, -n);
    return {-top.value, top.vertex};
}

/// The vertices must be scaled by a power of two if the larger reach leaves this range: the kernels multiply
/// up to six lengths, which then stay between 2^-1022 and 2^1023 even where some of them are 2^-60 of the
/// largest.
inline constexpr double kSmallestReach = 0x1p-100;
inline constexpr double kLargestReach = 0x1p100;

}  // namespace geomsrv
