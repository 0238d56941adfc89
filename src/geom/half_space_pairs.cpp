// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
#include "geom/half_space_pairs.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace geomsrv {

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// A normal is normalised by the caller in doubles; dividing by its length leaves 4 u.
constexpr double kUnitError = 4 * kUnitRoundoff;

// What a handful of operations lose where they end below the normal range.
constexpr double kUnderflow = 16 * std::numeric_limits<double>::denorm_min();

/// A point of both, where they are not known to be parted: on the plane of a, moved along it until it is in
/// b.
Vec3 common_point(const PlacedHalfSpace& a, const PlacedHalfSpace& b) {
    const Vec3 on_a = (a.offset / dot(a.normal, a.normal)) * a.normal;
    const double excess = dot(b.normal, on_a) - b.offset;
    if (excess <= 0.0) {
        return on_a;
    }
    const Vec3 aside = b.normal - (dot(b.normal, a.normal) / dot(a.normal, a.normal)) * a.normal;
    const double descent = dot(aside, b.normal);
    if (descent > kUnitError * kUnitError && dot(a.normal, b.normal) < 1.0 - kUnitError) {
        return on_a - (excess / descent) * aside;
    }
    return (b.offset / dot(b.normal, b.normal)) * b.normal;  // parallel: the lower plane lies in both
}

template <class Body>
CoreSeparation body_half_space(const Body& a, const PlacedHalfSpace& b, bool penetration) {
    const double length = norm(b.normal);
    const Vec3 up = {b.normal.x / length, b.normal.y / length, b.normal.z / length};
    const Extreme bottom = lowest(a, up);
    const double level = b.offset / length;
    const double value = bottom.value - level;
    const double rounding = Body::kCoarseness * (kSupportError + kUnitError);
    const double error = (rounding + 2 * b.normal_error) * a.reach + a.error + 2 * b.offset_error +
                         (kUnitError + 2 * b.normal_error) * std::abs(level) + kUnitError * std::abs(value) +
                         kUnderflow;
    CoreSeparation out;
    out.value = value;
    out.lower = value - error;
    out.upper = value + error;
    out.point_a = vertex_of(a, bottom.vertex);
    out.point_b = value <= 0.0 && !penetration ? out.point_a : out.point_a - value * up;
    out.normal = -up;
    out.converged = true;
    out.stage = Stage::closed_form;
    out.witness.count = 1;
    out.witness.a[0] = bottom.vertex;
    out.witness.weight[0] = 1.0;
    return out;
}

}  // namespace

CoreSeparation convex_half_space(const Core& a, const PlacedHalfSpace& b, bool penetration) {
    return body_half_space(a, b, penetration);
}

CoreSeparation convex_half_space(const SingleCore& a, const PlacedHalfSpace& b, bool penetration) {
    return body_half_space(a, b, penetration);
}

CoreSeparation convex_half_space(const SupportedCore& a, const PlacedHalfSpace& b, bool penetration) {
    return body_half_space(a, b, penetration);
}

CoreSeparation half_space_half_space(const PlacedHalfSpace& a, const PlacedHalfSpace& b) {
    const double length_a = norm(a.normal);
    const double length_b = norm(b.normal);
    const double level_a = a.offset / length_a;
    const double level_b = b.offset / length_b;
    const WideVec3 across = cross(widen(a.normal), widen(b.normal));
    const double sine = norm(narrow(across));
    const double doubt = 2 * (a.normal_error + b.normal_error);
    const bool facing = dot(a.normal, b.normal) < 0.0;

    CoreSeparation out;
    out.converged = true;
    out.stage = Stage::closed_form;
    if (!facing || sine > doubt) {
        // However little the planes lean, the solids meet somewhere and beyond that share everything.
        out.value = out.lower = out.upper = -kInfinity;
        out.point_a = out.point_b = common_point(a, b);
        out.normal = nan_vector();
        return out;
    }
    const double value = -level_b - level_a;
    const double error = 2 * (a.offset_error + b.offset_error) +
                         kUnitError * (std::abs(level_a) + std::abs(level_b) + std::abs(value)) + kUnderflow;
    out.value = value;
    out.upper = value + error;
    out.lower = value - error;
    out.normal = {a.normal.x / length_a, a.normal.y / length_a, a.normal.z / length_a};
    out.point_a = level_a * out.normal;
    out.point_b = out.point_a + value * out.normal;
    if (doubt > 0.0) {
        // The rotation was rounded: the planes may just as well lean and the solids meet far away.
        out.lower = -kInfinity;
        out.converged = false;
        out.outcome = Outcome::not_converged;
    }
    return out;
}

}  // namespace geomsrv
