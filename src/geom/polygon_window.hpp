// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
// When two polygons in relative motion can be in contact, by float64 with bounds for rounding: what first
// contact finds first at every tier that computes in float64.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "geom/lanes.hpp"
#include "geom/polygon_pair.hpp"
#include "geom/rounding.hpp"
#include "geom/vec.hpp"

namespace geomsrv {

// Rounding of the input, as a multiple of half an ulp of the largest coordinate: rotating and shifting a
// polygon moves a vertex by less than 7 (see kRingTolerance in polygon.hpp), rounded up.
inline constexpr double kInputNoise = 8.0 * kUnitRoundoff;

// Likewise for velocities, which are only rotated: 3.42 * 1.42 < 5 half ulps of the larger component.
inline constexpr double kVelocityNoise = 5.0 * kUnitRoundoff;

// No slack exceeds this part of the reach (or of the speed).  So separations, angles and overlaps that are
// larger are always told apart, however far from the origin and however short the edges: with tips a gap is
// at least half the distance, and 2^-42 + rounding stays below half of 2^-40 of the scene.
inline constexpr double kLargestSlack = 0x1p-42;

// Error of a rate D.w relative to |Dx wx| + |Dy wy|: edge, velocity, product, sum; adding it to the rate; the
// rest covers the bound.
inline constexpr double kRateError = 6.0 * kUnitRoundoff;

// A gap and a rate known to this relative error make a time that is good enough as it is, 2^-45: about 50
// times what rounding leaves of numbers in which nothing cancels.
inline constexpr double kSharpTime = 0x1p-46;

// Relative errors x, y of a gap and a rate below this make one of (1 + x) / (1 - y) - 1 < (x + y) (1 + 2^-19)
// of their quotient; the second is for rounding of the bound, too.
inline constexpr double kSmallShare = 0x1p-20;
inline constexpr double kSecondOrderOfTime = 1.0 + 0x1p-18;

/// Motion of b relative to a, in units of its own.
struct Motion {
    Vec2 velocity;    ///< times 2^scale_exponent
    ExactVec2 exact;  ///< the same, unrounded
    int scale_exponent = 0;
    double noise = 0.0;  ///< what rounding of the given velocities may change

    /// A given velocity in these units.
    [[nodiscard]] Vec2 scaled(Vec2 v) const {
        return {std::scalbn(v.x, scale_exponent), std::scalbn(v.y, scale_exponent)};
    }
};

Motion relative_motion(Vec2 velocity_a, Vec2 velocity_b);

/// How far gaps and rates of an axis D may be off.
///
/// Rounding here: see kGapError and kRateError.  Rounding of the input moves every vertex by up to `noise`,
/// so a gap by 2 noise |D|; and it turns an edge by up to 2 noise / |D|, which moves what is a reach away by
/// 2 noise reach / |D|, times |D|.  A rate changes by the velocity's noise and by the same turn.  All cut at
/// kLargestSlack.  Taken literally, numbers have no slack but for rounding here.
struct Slacks {
    double gap_rounding;  ///< per |D|_1
    double gap_noise;     ///< per |D|_1 + reach
    double gap_limit;     ///< per |D|_1
    double reach;
    double rate_noise;  ///< per |D|_1
    double turn_noise;
    double rate_limit;      ///< per |D|_1
    double rate_underflow;  ///< products with a velocity of zero are exact: at rest nothing approaches
    bool is_literal = false;

    Slacks(const PolygonPair& pair, const Motion& motion)
        : gap_rounding(pair.gap_error()),
          gap_noise(2.0 * kInputNoise * pair.magnitude()),
          gap_limit(kLargestSlack * pair.reach()),
          reach(pair.reach()),
          rate_noise(motion.noise),
          turn_noise(gap_noise * (std::fabs(motion.velocity.x) + std::fabs(motion.velocity.y))),
          rate_limit(kLargestSlack * std::max(std::fabs(motion.velocity.x), std::fabs(motion.velocity.y))),
          rate_underflow(rate_limit > 0.0 ? kPairUnderflow : 0.0) {}

    [[nodiscard]] Slacks literal() const {
        Slacks out = *this;
        out.gap_noise = out.rate_noise = out.turn_noise = 0.0;
        out.is_literal = true;
        return out;
    }
    [[nodiscard]] Slack heights() const { return {gap_noise, gap_limit}; }
};

/// Gap and rate of one axis (Real = double) or of several (Lanes), and how far off they may be.
template <class Real>
struct AxisNumbers {
    Real gap, rate, gap_slack, rate_slack;
};

/// `approach` is -1 for axes of a, +1 for axes of b.
template <class Real>
GEOMSRV_INLINE AxisNumbers<Real> numbers(const Real& dx, const Real& dy, const Real& gap, double approach,
                                         const Motion& motion, const Slacks& slacks) {
    const Real along_x = dx * Real(approach * motion.velocity.x);
    const Real along_y = dy * Real(approach * motion.velocity.y);
    const Real size = magnitude(dx) + magnitude(dy);
    const Real gap_noise =
        lesser<Real>(slacks.gap_noise * (size + Real(slacks.reach)), slacks.gap_limit * size);
    const Real rate_noise =
        lesser<Real>(slacks.rate_noise * size + Real(slacks.turn_noise), slacks.rate_limit * size);
    // Axes of no length and gap -1 fill up blocks of lanes: subnormal rates there would slow down the whole
    // block.
    const Real none = 0.0;
    const Real rate_underflow = select((none < size) | (Real(-1.0) < gap), Real(slacks.rate_underflow), none);
    return {gap, along_x + along_y, slacks.gap_rounding * size + gap_noise + Real(kPairUnderflow),
            Real(kRateError) * (magnitude(along_x) + magnitude(along_y)) + rate_noise + rate_underflow};
}

constexpr double approach_of(int side) { return side == 0 ? -1.0 : 1.0; }

/// What all axes together say, slacks included.
struct Window {
    double enter;  ///< contact cannot begin earlier
    double leave;  ///< nor last longer
    bool apart;    ///< certainly apart along some axis now
    bool never;    ///< ... and certainly not approaching along it
    bool deep;     ///< certainly overlapping along every axis now
};

/// Leaves for every axis in work[0..2]: the largest gap and the least rate, whose quotient is the latest
/// entry or the earliest exit; and a number that is negative if the axis may end a contact: the largest rate,
/// or of literal numbers the least.
Window window_of(const PolygonPair& pair, const Motion& motion, const Slacks& slacks);

/// How many axes `candidates_of` has listed.
struct Candidates {
    std::size_t entries = 0;
    std::size_t exits = 0;
};

/// Axes that may set the first or the last contact, found without a division per axis: those along which
/// contact may begin no earlier than `window.enter`, and those along which it may end no later than
/// `window.leave`, which are the outermost bounds.  Mostly it is one axis each.
Candidates candidates_of(const PolygonPair& pair, const Window& window, AxisOf* entries, AxisOf* exits);

}  // namespace geomsrv
