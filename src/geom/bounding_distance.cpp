// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
#include "geom/bounding_distance.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "geom/place.hpp"

namespace geomsrv {

namespace {

// Center, half sizes, radius, a difference, a length and a sum: fewer than 16 roundings of numbers up to S.
constexpr double kBoundingError = 16 * kUnitRoundoff;

// What these lose where they end below the normal range, which sizes next to a half space may do.
constexpr double kUnderflow = 16 * std::numeric_limits<double>::denorm_min();

/// An axis-parallel box and a ball about its middle, both around the body.
struct Volumes {
    Vec3 center;
    Vec3 half;
    double radius = 0.0;
    Vec3 member;  ///< some point of the body
};

double at(Vec3 v, int k) { return k == 0 ? v.x : k == 1 ? v.y : v.z; }

Volumes volumes_of(const Core& core) {
    Volumes out;
    // Squares must neither overflow nor underflow.
    const double unit = in_range(core.reach) ? 1.0 : scale_for(core.reach);
    if (core.points == nullptr) {
        out.center = out.member = core.center;
        double square = 0.0;
        for (int i = 0; i < core.generators; ++i) {
            const Vec3 own = core.generator[i];
            const Vec3 g = unit * own;
            out.half = out.half + Vec3{std::abs(own.x), std::abs(own.y), std::abs(own.z)};
            square += dot(g, g);
            // Where they are not quite perpendicular, some corner is further away.
            for (int k = 0; k < i; ++k) {
                square += 2.0 * std::abs(dot(g, unit * core.generator[k]));
            }
        }
        out.radius = std::sqrt(square) / unit;
        return out;
    }
    const double* x = core.points;
    const double* y = x + core.count;
    const double* z = y + core.count;
    Vec3 lower{x[0], y[0], z[0]};
    Vec3 upper = lower;
    for (int i = 1; i < core.count; ++i) {
        lower = {std::min(lower.x, x[i]), std::min(lower.y, y[i]), std::min(lower.z, z[i])};
        upper = {std::max(upper.x, x[i]), std::max(upper.y, y[i]), std::max(upper.z, z[i])};
    }
    const Vec3 middle = 0.5 * (lower + upper);
    out.half = 0.5 * (upper - lower);
    double square = 0.0;
    for (int i = 0; i < core.count; ++i) {
        const Vec3 arm = unit * (Vec3{x[i], y[i], z[i]} - middle);
        square = std::max(square, dot(arm, arm));
    }
    out.center = core.center + middle;
    out.radius = std::sqrt(square) / unit;
    out.member = vertex_of(core, 0);
    return out;
}

CoreSeparation bounded(double lower, double upper, Vec3 normal, double error) {
    CoreSeparation out;
    out.lower = out.value = lower - error;
    out.upper = std::max(upper + error, out.lower);
    out.normal = normal;
    out.point_a = out.point_b = nan_vector();
    out.rung = Rung::bound;
    return out;
}

}  // namespace

CoreSeparation bounding_distance(const Core& a, const Core& b) {
    const Volumes va = volumes_of(a);
    const Volumes vb = volumes_of(b);
    const Vec3 d = vb.center - va.center;
    const double length = norm(d);
    double best = length - va.radius - vb.radius;
    Vec3 normal = length > 0.0 ? normalized(d) : Vec3{1.0, 0.0, 0.0};
    // Boxes: along each axis, and across all along which there is a gap.
    Vec3 across;
    for (int k = 0; k < 3; ++k) {
        const double gap = std::abs(at(d, k)) - at(va.half, k) - at(vb.half, k);
        const double sign = at(d, k) < 0.0 ? -1.0 : 1.0;
        const Vec3 axis = {k == 0 ? sign : 0.0, k == 1 ? sign : 0.0, k == 2 ? sign : 0.0};
        if (gap > best) {
            best = gap;
            normal = axis;
        }
        if (gap > 0.0) {
            across = across + gap * axis;
        }
    }
    const double apart = norm(across);
    if (apart > std::max(best, 0.0)) {
        best = apart;
        normal = normalized(across);
    }
    const double error = kBoundingError * (a.reach + b.reach) + a.error + b.error;
    return bounded(best, norm(vb.member - va.member), normal, error);
}

CoreSeparation bounding_distance(const Core& a, const PlacedHalfSpace& b) {
    const Volumes volumes = volumes_of(a);
    Core point;
    point.center = volumes.center;
    point.reach = a.reach;
    point.error = a.error;
    const CoreSeparation center = convex_half_space(point, b, true);
    point.center = volumes.member;
    const CoreSeparation member = convex_half_space(point, b, true);
    return bounded(center.lower - volumes.radius, member.upper, center.normal,
                   kBoundingError * a.reach + kUnderflow);
}

}  // namespace geomsrv
