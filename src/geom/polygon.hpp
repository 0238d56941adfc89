// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
// Rings of vertices as convex polygons: what counts as one, and its strictly convex form.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "geom/vec.hpp"

namespace geomsrv {

/// Vertices of one polygon, counter-clockwise, the last joined to the first.  The closed set meant is their
/// convex hull, so repeated and collinear vertices, segments and single points are all right.
using Ring = std::span<const Vec2>;

enum class RingFault : std::uint8_t { none, clockwise, not_convex, wound_more_than_once };

struct RingReport {
    RingFault fault = RingFault::none;
    std::int64_t vertex =
        -1;  ///< offending vertex of a ring that is not convex; -1 if the fault is the whole ring's
};

// Vertices may be off the boundary of their convex hull by this part of the largest |coordinate|: 2^-48 = 32
// half ulps.
//
// It is what rotating and shifting an exactly convex ring in float64 can do.  x' = c x - s y takes three
// roundings, at most r (|c x| + |s y|) + r |x'| <= 2.42 r |p| for half an ulp r, so a vertex moves by at
// most 3.42 r |p|; adding the shift costs 1.42 r |p'|.  With |p| <= 1.42 of the largest coordinate that is
// less than 7 r.  (Rounding of c and s is a linear map common to all vertices and keeps convexity.)  A moved
// vertex is matched with a point of the moved hull, which itself moved: 14 r; the matching is anchored at one
// vertex, off by as much again: 28 r, rounded up.
inline constexpr double kRingTolerance = 0x1p-48;

/// Convex hull with no three vertices on a line, for the exact given coordinates.
class StrictHull {
public:
    /// Counter-clockwise from the least vertex (by x, then y); one vertex for a point, two for a segment. The
    /// view is valid until the next call.
    Ring of(Ring ring);

private:
    std::vector<Vec2> sorted_;
    std::vector<Vec2> hull_;
};

/// Whether rings are convex and counter-clockwise up to `kRingTolerance`.  Holds scratch memory, so that
/// checking many rings allocates only as often as a longer one turns up.
class RingChecker {
public:
    RingReport check(Ring ring);

private:
    RingReport check_with_tolerance(Ring ring, bool turns_left_only);

    StrictHull hull_;
    std::vector<Vec2> scaled_;
};

}  // namespace geomsrv
