// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
// Where a line through the origin enters and leaves the difference K = {q - p : p in a, q in b}, in float64.
//
// Seen along the line, K is a convex polygon, and the line is a point:
//
//   1. Three corners of K are sought around the point.  Directions m across the line take the vertex of K
//   lowest
//      along m; if that lies above 0, the line misses K.
//   2. The plane through the three corners, its normal n pointing from a to b, takes the vertex of K lowest
//   along
//      n; that replaces one of the three such that they stay around the point.  Where nothing is lower, the
//      plane supports K, and the line passes through the facet in the middle of the corners.  Once for each
//      end.
//
// (2) is the simplex method on min { t : t (-w) in K }: every step proves a bound of the time from both
// sides.
#pragma once

#include <cstdint>

#include "geom/core.hpp"
#include "geom/vec.hpp"

namespace geomsrv {

/// A vertex of K: vertex of b minus vertex of a.
struct VertexPair {
    int a = 0;
    int b = 0;
};

/// Three corners of K around the line, in a plane that supports K up to rounding.
struct Portal {
    VertexPair corner[3];
    Vec3 normal;           ///< unit, from a to b
    double lowest = 0.0;   ///< no vertex of K is lower along the normal,
    double highest = 0.0;  ///< and no corner higher: both proven
    double height = 0.0;   ///< about the lowest
    double rate = 0.0;     ///< -w . normal: > 0 where the line enters, < 0 where it leaves
    double rate_error = 0.0;
    bool settled = false;  ///< the plane supports K up to rounding
    bool sure = false;     ///< and the line passes between the corners, for certain
};

struct LineCast {
    enum class Outcome : std::uint8_t {
        meets,    ///< the line passes through K, between both portals
        misses,   ///< proven: K lies above `gap` along `normal`, which is perpendicular to the line
        unclear,  ///< too close to tell, or stuck; the corners may still serve as a start
    };
    Outcome outcome = Outcome::unclear;
    Vec3 normal;
    double gap = 0.0;
    Portal enter;
    Portal leave;
    VertexPair start;  ///< some vertex of K
    bool portals = false;
};

/// The line of all t (-w); rows of hulls are padded to whole lanes.
LineCast cast_line(const Core& a, const Core& b, Vec3 w);

/// The same for K with a margin: a box about each of its points that reaches at least so far in every
/// direction.
LineCast cast_line_wide(const Core& a, const Core& b, Vec3 w, double margin);

/// The corner of that box that is lowest along n.  The box is skew on purpose: bodies are often symmetric,
/// and then a line through a corner or an edge of K would stay one of the wider K.
inline Vec3 lowest_margin(Vec3 n, double margin) {
    const auto side = [=](double x, double below, double above) {
        return margin * (x > 0.0 ? -below : above);
    };
    return {side(n.x, 1.0, 1.3719), side(n.y, 1.2391, 1.0843), side(n.z, 1.1137, 1.4287)};
}

// Error of the height n . v of a vertex v of K along a unit vector, in terms of the reach of the pair: each
// end is rounded (kVertexError, and the core's own u), their difference by 2 u, the product by 3 u.
inline constexpr double kCornerError = 10 * kUnitRoundoff;

// The lowest vertex found may be higher than another by the rounding of both supports, 3 u of the spread
// each, and by that of the unit normal, 2 u for each of the two; products with a common centre are not
// formed.
inline constexpr double kLowestError = kCornerError + 12 * kUnitRoundoff;

// Error of the rate, in terms of |w|: w 1 u, product 3 u, one to spare.
inline constexpr double kPortalRateError = 5 * kUnitRoundoff;

}  // namespace geomsrv
