// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
// What a pair of convex bodies is proven to be: apart, touching or overlapping, and by how much.
//
// The signed distance s of two convex bodies is the largest gap between their supports over all unit
// directions n,
//
//     gap(n) = min over b of n . b  -  max over a of n . a,        s = max gap(n),
//
// which is the distance where they are apart and minus the penetration depth where they overlap.  So every
// direction proves a lower bound, and a pair of nearest points (or, deep inside, a closed surface about the
// origin) an upper one.
#pragma once

#include <cstdint>
#include <limits>

#include "geom/core.hpp"
#include "geom/rung.hpp"
#include "geom/vec.hpp"

namespace geomsrv {

enum class Outcome : std::uint8_t {
    ok,             ///< the interval is as wide as rounding makes it, see kPromisedWidth
    not_converged,  ///< it is wider, but holds
    unsupported,    ///< no kernel for this pair; all numbers are NaN
};

/// Which algorithm had the last word; for tests and statistics.
enum class Stage : std::uint8_t {
    none,  ///< unsupported
    closed_form,
    gjk,
    gjk_wide,    ///< GJK in double-double arithmetic
    facet_axes,  ///< all facet normals of a difference of zonotopes
    hull,        ///< growing the hull of the difference
    exact,       ///< by the caller's numbers, see Rung
};

/// What the caller pays for; geomsrv._validate.ACCURACIES in the same order.
enum class Tier : std::uint8_t { bound, float32, float64, exact };

struct Wanted {
    bool penetration = false;  ///< how deep overlapping bodies are, not only that they meet
    Tier tier = Tier::float64;
    bool simplex = false;  ///< the proof of the answer, even where another one is cheaper
};

/// Faces whose points the nearest points are combined from: point_a = sum of weight[i] * vertex a[i].
struct Witness {
    int count = 0;  ///< 0 where a closed form needs no vertices
    int a[4] = {};  ///< vertex of core a, see Extreme
    int b[4] = {};
    double weight[4] = {};  ///< >= 0, sum 1
};

/// Signed distance of two cores, all in their common frame.
struct CoreSeparation {
    double value = std::numeric_limits<double>::quiet_NaN();  ///< best estimate, in [lower, upper] [m]
    double lower = std::numeric_limits<double>::quiet_NaN();  ///< proven [m]
    double upper = std::numeric_limits<double>::quiet_NaN();  ///< proven [m]
    Vec3 point_a;  ///< nearest point of a, or its deepest point in b
    Vec3 point_b;
    Vec3 normal;  ///< unit, from a to b; NaN if only "they overlap" was asked for
    Outcome outcome = Outcome::ok;
    Stage stage = Stage::none;
    bool converged = false;  ///< lower and upper estimate have met; if not, a stronger method may do better
    int iterations = 0;
    Witness witness;
    Witness
        simplex;  ///< of vertices of the difference, its point nearest to the origin; all the proof there is
    Rung rung = Rung::filter;
};

/// Signed distance of two shapes in the frame of the first (or of the world).
struct Separation {
    double distance = std::numeric_limits<double>::quiet_NaN();
    double lower = std::numeric_limits<double>::quiet_NaN();
    double upper = std::numeric_limits<double>::quiet_NaN();
    Vec3 point_a;
    Vec3 point_b;
    Vec3 normal;
    Outcome outcome = Outcome::unsupported;
    Stage stage = Stage::none;
    int iterations = 0;
    Witness witness;
    Witness simplex;  ///< of the cores, see CoreSeparation
    Rung rung = Rung::filter;
};

// ---- Proofs.  Sizes below are S = reach of a + reach of b. ----

// Error of gap(n): both supports (kSupportError S); a unit vector normalised in doubles has length 1 +- 4 u,
// which with the subtraction makes kGapScale u of the gap itself.
inline constexpr double kGapError = kSupportError;
inline constexpr double kGapScale = 6 * kUnitRoundoff;

// Error of a witness point: its vertices (kVertexError), the products and sums of up to four of them (5 u)
// and weights that sum to 1 only to 4 u; the difference of two points and its length add kGapScale of the
// length.
inline constexpr double kMemberError = kVertexError + 9 * kUnitRoundoff;

// The two estimates have met when they differ by less than this times S: about as much as both of them round,
// so that waiting for less could wait for ever.
inline constexpr double kMeetingGap = 16 * kUnitRoundoff;

// The proof that no facet is nearer costs more roundings: of a cross product, its length and the plane's
// offset.
inline constexpr double kDeepMeetingGap = 3 * kMeetingGap;

// Widest interval called ok, times S: the wider of the meeting gaps and the errors of both bounds (7 + 12 + 6
// u).  The errors of the vertices themselves come on top.
inline constexpr double kPromisedWidth = 80 * kUnitRoundoff;

/// Bounds from a direction and a pair of points of the cores.  `Body`: Core, or SingleCore, of which all
/// errors count kCoarseness times.
template <class Body>
CoreSeparation certify_apart(const Body& a, const Body& b, Vec3 normal, Vec3 point_a, Vec3 point_b);

/// Bounds of overlapping cores from a direction and a proof that no other does better: `upper` >= s for the
/// vertices as stored.  The points are deepest points.
template <class Body>
CoreSeparation certify_deep(const Body& a, const Body& b, Vec3 normal, Vec3 point_a, Vec3 point_b,
                            double upper);

/// Back to the caller's unit, from one in which lengths are `scale` times as long.  Only a result below the
/// normal range rounds: then away from the value.
void unscale(CoreSeparation& s, double scale);

/// A unit vector perpendicular to v; any unit vector if v is 0.
Vec3 perpendicular(Vec3 v);

/// a / |a|, of length 1 +- 4 u; a must not be 0.
inline Vec3 normalized(Vec3 a) {
    constexpr double kSafeLength = 0x1p-400;  // its square keeps all its bits
    double length = norm(a);
    if (length < kSafeLength) {
        a = 0x1p600 * a;
        length = norm(a);
    }
    return {a.x / length, a.y / length, a.z / length};
}

inline Vec3 nan_vector() {
    constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
    return {kNan, kNan, kNan};
}

}  // namespace geomsrv
