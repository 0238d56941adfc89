// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
// Sign of a 2D cross or dot product of two differences, exact for the given doubles.
#pragma once

#include <cmath>
#include <limits>

#include "geom/rounding.hpp"
#include "geom/vec.hpp"

namespace geomsrv {

// Cross product of two rounded differences: each difference carries a relative error of kUnitRoundoff, each
// product one more and their difference one more, (1 + r)^4 - 1 < 4.5 r of |ux vy| + |uy vx|.  The last half
// covers the rounding of the bound itself.
inline constexpr double kCrossError = 5.0 * kUnitRoundoff;

// A product below 2^-1022 is rounded to a multiple of 2^-1074 instead: half a unit in each of the two
// products and in each of the two terms of the bound.
inline constexpr double kCrossUnderflow = 4.0 * std::numeric_limits<double>::denorm_min();

/// What `sign_of_cross` climbs on to where its filter cannot decide.
int sign_of_cross_beyond_filter(Vec2 from_u, Vec2 to_u, Vec2 from_v, Vec2 to_v);

/// -1, 0 or +1: exact sign of cross(to_u - from_u, to_v - from_v), for any finite coordinates.
inline int sign_of_cross(Vec2 from_u, Vec2 to_u, Vec2 from_v, Vec2 to_v) {
    const Vec2 u = to_u - from_u;
    const Vec2 v = to_v - from_v;
    const double left = u.x * v.y;
    const double right = u.y * v.x;
    const double value = left - right;
    const double bound = kCrossError * (std::fabs(left) + std::fabs(right)) + kCrossUnderflow;
    // Where something overflowed the bound is infinite or NaN and neither comparison holds.
    if (value > bound) {
        return 1;
    }
    if (-value > bound) {
        return -1;
    }
    // A rounded difference is zero only if the exact one is, so vanishing factors decide by themselves.
    if ((u.x == 0.0 || v.y == 0.0) && (u.y == 0.0 || v.x == 0.0)) {
        return 0;
    }
    return sign_of_cross_beyond_filter(from_u, to_u, from_v, to_v);
}

/// -1, 0 or +1: exact sign of dot(to_u - from_u, to_v - from_v), for any finite coordinates.
inline int sign_of_dot(Vec2 from_u, Vec2 to_u, Vec2 from_v, Vec2 to_v) {
    // cross(u, v turned by +90 degrees) is dot(u, v); turning swaps and negates coordinates, which is exact.
    return sign_of_cross(from_u, to_u, {-from_v.y, from_v.x}, {-to_v.y, to_v.x});
}

/// +1 where r lies left of the line from p to q, 0 on it, -1 right of it.  Antisymmetric in p and q, cyclic
/// in p, q, r.
inline int orientation(Vec2 p, Vec2 q, Vec2 r) { return sign_of_cross(p, q, p, r); }

}  // namespace geomsrv
