// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
// First contact of two translating boxes on the 15 axes that may separate them, four pairs at a time.
//
// It decides what is clear, and says so: whatever comes within an error bound, or within the slack for the
// rounding of the input (moving_pair.hpp), is left to the cast (polytope_first_contact.hpp).
#pragma once

#include <cstddef>
#include <cstdint>

#include "geom/vec.hpp"

namespace geomsrv {

/// Boxes of a batch as rows of doubles, and their velocities; steps are 0 where one serves every pair.
struct MovingBoxes {
    const double* center = nullptr;
    const double* axes = nullptr;
    const double* half = nullptr;
    const double* velocity = nullptr;
    std::size_t step = 1;
    std::size_t velocity_step = 1;
};

/// What the axes say about a pair.
struct BoxMotion {
    enum class Verdict : std::uint8_t {
        unclear,
        never,        ///< apart by more than the slack, within all of the window: certain
        will_touch,   ///< certain
        overlapping,  ///< at the start, deeper than the slack: certain
    };
    Verdict verdict = Verdict::unclear;
    std::uint8_t axis = 0;  ///< of first contact: 0-2 faces of a, 3-5 of b, 6 + 3 i + j edges i of a, j of b
    bool wide = false;      ///< it took double-double to tell the times
    double time = 0.0;      ///< [s]
    double time_lower = 0.0;     ///< the exact time is not earlier,
    double time_upper = 0.0;     ///< and not later
    double last_time = 0.0;      ///< [s], whatever the window
    Vec3 normal;                 ///< unit, from a to b, if they will touch
    double closing_speed = 0.0;  ///< [m/s], along the normal
    double half[2] = {};         ///< half lengths of the edges of that axis,
    double sine = 0.0;           ///< and the length of the product of their directions
    bool lone = false;           ///< they touch in one point for certain:
    Vec3 point;                  ///< [m], world frame
};

/// Pairs `first` to `first + count`; `points`: look for contact points, too.
void decide_box_motions(const MovingBoxes& a, const MovingBoxes& b, std::size_t first, std::size_t count,
                        double t_max, bool points, BoxMotion* out);

/// How many pairs are best decided at once.
inline constexpr std::size_t kBoxMotionBlock = 64;

}  // namespace geomsrv
