// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
#include "geom/separation.hpp"

#include <algorithm>
#include <cmath>

#include "geom/curved.hpp"
#include "geom/single_core.hpp"

namespace geomsrv {

namespace {

struct Bounds {
    double gap = 0.0;  ///< estimate from below
    double lower = 0.0;
    double upper = 0.0;
    double size = 0.0;   ///< S
    double error = 0.0;  ///< of the vertices
};

/// What the direction proves, and what the points prove if they are members of the cores.
template <class Body>
Bounds bounds_of(const Body& a, const Body& b, Vec3 normal, double length) {
    const double gap = lowest(b, normal).value - highest(a, normal).value;
    const double size = a.reach + b.reach;
    const double error = a.error + b.error;
    const auto rounding = [size](double counted, double value) {
        return Body::kCoarseness * (counted * size + kGapScale * value);
    };
    return {gap, gap - (rounding(kGapError, std::abs(gap)) + error),
            length + (rounding(kMemberError, length) + error), size, error};
}

/// What the caller's numbers leave open is no failure to converge.
Outcome judge(double lower, double upper, const Bounds& bounds, double coarseness) {
    const double promised = coarseness * kPromisedWidth * bounds.size + 3 * bounds.error;
    return upper - lower <= promised ? Outcome::ok : Outcome::not_converged;
}

}  // namespace

template <class Body>
CoreSeparation certify_apart(const Body& a, const Body& b, Vec3 normal, Vec3 point_a, Vec3 point_b) {
    const double length = norm(point_b - point_a);
    const Bounds bounds = bounds_of(a, b, normal, length);
    CoreSeparation out;
    // Where even the sign is in doubt, the smaller estimate: touching counts as contact.
    out.value = bounds.lower > 0.0 ? std::max(length, bounds.lower) : std::min(length, bounds.gap);
    out.lower = bounds.lower;
    out.upper = bounds.upper;
    out.point_a = point_a;
    out.point_b = point_b;
    out.normal = normal;
    out.converged = length - bounds.gap <= Body::kCoarseness * kMeetingGap * bounds.size;
    out.outcome = judge(out.lower, out.upper, bounds, Body::kCoarseness);
    return out;
}

template <class Body>
CoreSeparation certify_deep(const Body& a, const Body& b, Vec3 normal, Vec3 point_a, Vec3 point_b,
                            double upper) {
    const Bounds bounds = bounds_of(a, b, normal, 0.0);
    CoreSeparation out;
    // The points found coincide to rounding: unless a gap is proven, touching counts as contact.
    out.value = bounds.lower > 0.0 ? bounds.gap : std::min(bounds.gap, 0.0);
    out.lower = bounds.lower;
    out.upper = upper + (a.error + b.error);
    // The proof from above may be the better number by an ulp or two, never by more than both are worth.
    out.upper = std::max(out.upper, out.value);
    out.point_a = point_a;
    out.point_b = point_b;
    out.normal = normal;
    out.converged = upper - bounds.gap <= Body::kCoarseness * kDeepMeetingGap * bounds.size;
    out.outcome = judge(out.lower, out.upper, bounds, Body::kCoarseness);
    return out;
}

template CoreSeparation certify_apart(const Core&, const Core&, Vec3, Vec3, Vec3);
template CoreSeparation certify_apart(const SingleCore&, const SingleCore&, Vec3, Vec3, Vec3);
template CoreSeparation certify_apart(const SupportedCore&, const SupportedCore&, Vec3, Vec3, Vec3);
template CoreSeparation certify_deep(const Core&, const Core&, Vec3, Vec3, Vec3, double);
template CoreSeparation certify_deep(const SingleCore&, const SingleCore&, Vec3, Vec3, Vec3, double);
template CoreSeparation certify_deep(const SupportedCore&, const SupportedCore&, Vec3, Vec3, Vec3, double);

void unscale(CoreSeparation& s, double scale) {
    if (scale == 1.0) {
        return;
    }
    const double unit = 1.0 / scale;
    s.value *= unit;
    s.lower = next_down(s.lower * unit);
    s.upper = next_up(s.upper * unit);
    s.point_a = unit * s.point_a;
    s.point_b = unit * s.point_b;
}

Vec3 perpendicular(Vec3 v) {
    const double x = std::abs(v.x);
    const double y = std::abs(v.y);
    const double z = std::abs(v.z);
    if (x == 0.0 && y == 0.0 && z == 0.0) {
        return {0.0, 0.0, 1.0};
    }
    // The coordinate axis furthest from v makes the longest cross product.
    const Vec3 axis = x <= y && x <= z ? Vec3{1.0, 0.0, 0.0}
                      : y <= z         ? Vec3{0.0, 1.0, 0.0}
                                       : Vec3{0.0, 0.0, 1.0};
    return normalized(cross(v, axis));
}

}  // namespace geomsrv
