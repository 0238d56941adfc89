// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
// When and where two translating convex polygons first touch (book section 7.7).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "geom/contact_status.hpp"
#include "geom/enclosed.hpp"
#include "geom/polygon.hpp"
#include "geom/polygon_overlap.hpp"
#include "geom/polygon_pair.hpp"
#include "geom/vec.hpp"

namespace geomsrv {

struct PolygonMotion;

struct FirstContact {
    ContactStatus status;
    double time;                   ///< [s]; 0 if in contact now; NaN for never, like all numbers below
    double time_lower;             ///< the exact time is not earlier,
    double time_upper;             ///< and not later
    double last_time;              ///< [s], at most t_max; infinite if they never part
    Vec2 normal;                   ///< unit, from a to b, at `time`; NaN if overlapping
    std::span<const Vec2> points;  ///< contact set at `time`, world frame; valid until the next call
    bool certain = false;          ///< the status is proven for the given numbers
    Rung rung = Rung::filter;      ///< what it took
};

/// Ring and constant velocity [m/s] in the world frame.
struct MovingPolygon {
    Ring ring;
    Vec2 velocity;
};

/// Holds scratch memory for polygons of at most so many vertices, so that a query allocates nothing.
class FirstContactSolver {
public:
    FirstContactSolver(std::size_t largest_a, std::size_t largest_b);

    /// Contact within [0, t_max], t_max >= 0 or infinite.  Without `contact_set` no points are found.
    FirstContact solve(const MovingPolygon& a, const MovingPolygon& b, double t_max, bool contact_set);

    /// The same of a pair about which something is known beforehand (polygon_motion.hpp).
    FirstContact solve(const MovingPolygon& a, const MovingPolygon& b, double t_max, bool contact_set,
                       const PolygonMotion& known);

private:
    PolygonPair pair_;
    PolygonOverlap overlap_;
    std::vector<AxisOf> entries_;
    std::vector<AxisOf> exits_;
    std::array<Vec2, 2> points_;
};

}  // namespace geomsrv
