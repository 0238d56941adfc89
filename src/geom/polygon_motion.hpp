// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
// First contact of two translating convex polygons on the normals of their edges, four pairs at a time.
//
// It decides what is clear, and says so: whatever comes within an error bound, or within the slack for the
// rounding of the input (polygon_window.hpp), touches in more than one point or is larger than kMostSides, is
// left to the solvers of single pairs.
#pragma once

#include <cstddef>
#include <cstdint>

#include "geom/polygon_first_contact.hpp"
#include "geom/polygon_pair.hpp"
#include "geom/vec.hpp"

namespace geomsrv {

/// An edge of one polygon and the vertex of the other that is lowest along its normal.
struct EdgeAndVertex {
    AxisOf edge;
    std::size_t vertex = 0;
};

/// What the edges say about a pair.
struct PolygonMotion {
    enum class Verdict : std::uint8_t {
        unclear,
        never,        ///< apart by more than the slack, within all of the window: certain
        will_touch,   ///< certain, and a single vertex touches the inside of an edge
        overlapping,  ///< at the start, deeper than the slack: certain
    };
    Verdict verdict = Verdict::unclear;
    EdgeAndVertex first;      ///< which touch first
    EdgeAndVertex last;       ///< and which last; its vertex only if asked for
    double time = 0.0;        ///< [s]
    double time_lower = 0.0;  ///< the exact time is not earlier,
    double time_upper = 0.0;  ///< and not later
    double last_time = 0.0;   ///< [s], whatever the window
    Vec2 normal;              ///< unit, from a to b
    Vec2 point;               ///< [m], world frame
};

/// How many pairs are best decided at once: enough to find four of about the same size.
inline constexpr std::size_t kPolygonMotionBlock = 256;

/// Polygons with more sides are left to the solvers of single pairs.
inline constexpr std::size_t kMostSides = 32;

/// Decides `count` <= kPolygonMotionBlock pairs.  `last_vertices`: find the vertex of `last`, too, or leave
/// the pair unclear.
void decide_polygon_motions(const MovingPolygon* a, const MovingPolygon* b, std::size_t count, double t_max,
                            bool last_vertices, PolygonMotion* out);

}  // namespace geomsrv
