// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
// When and where two translating convex polytopes first touch (book section 11.11).
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "geom/box_motion.hpp"
#include "geom/contact_points.hpp"
#include "geom/contact_status.hpp"
#include "geom/exact_contact_points.hpp"
#include "geom/exact_gjk.hpp"
#include "geom/line_cast.hpp"
#include "geom/moving_pair.hpp"
#include "geom/vec.hpp"

namespace geomsrv {

/// As FirstContact of polygons, in space.
struct PolytopeContact {
    ContactStatus status = ContactStatus::never;
    double time;                   ///< [s]; 0 if in contact now; NaN for never, like all numbers below
    double time_lower;             ///< the exact time is not earlier,
    double time_upper;             ///< and not later
    double last_time;              ///< [s], at most t_max; infinite if they never part
    Vec3 normal;                   ///< unit, from a to b, at `time`; NaN if overlapping
    double closing_speed;          ///< [m/s], along the normal; < 0 where they part; NaN if overlapping
    std::span<const Vec3> points;  ///< contact set at `time`, world frame; valid until the next call
    bool certain = false;          ///< exact arithmetic gives the same status
    Rung rung = Rung::filter;
};

/// What is known from the axes of two boxes, unless that is unclear; without points.
PolytopeContact contact_of(const BoxMotion& motion, double t_max);

/// Holds scratch memory for polytopes of at most so many vertices.
class PolytopeContactSolver {
public:
    PolytopeContactSolver(std::size_t most_a, std::size_t most_b);

    /// Contact within [0, t_max], t_max >= 0 or infinite.  Without `contact_set` no points are found.
    PolytopeContact solve(const MovingBody& a, const MovingBody& b, double t_max, bool contact_set);

    /// The same, with a contact set, of boxes that are known to meet.
    PolytopeContact solve(const MovingBody& a, const MovingBody& b, double t_max, const BoxMotion& known);

private:
    /// Points of contact, `moment` after the start; `width` as of Limit.
    void add_points(double moment, double width, PolytopeContact& out);

    /// Solved exactly, then judged by the slack.
    PolytopeContact doubtful_contact(const LineCast& cast, double t_max, double& moment, double& width);

    MovingPair pair_;
    ContactPoints points_;
    std::vector<double> scratch_;
    Vec3 lone_;  // the only point of contact, where it is known beforehand
};

/// As PolytopeContactSolver, without slack: numbers and points are correctly rounded, the times an ulp apart
/// or equal, the status always certain.  A time beyond the doubles is infinite, not never.
class ExactPolytopeContactSolver {
public:
    ExactPolytopeContactSolver(std::size_t most_a, std::size_t most_b);

    PolytopeContact solve(const MovingBody& a, const MovingBody& b, double t_max, bool contact_set);

private:
    MovingPair pair_;
    ExactContactPoints points_;
};

}  // namespace geomsrv
