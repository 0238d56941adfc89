// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
#include "geom/polytope_bound.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "geom/rounding.hpp"
#include "geom/swept_volume.hpp"

namespace geomsrv {

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

// Lengths: the largest part, quotients by it, squares, two sums, the root and a product make at most 8 units
// of kUnitRoundoff; parts that underflow in a square are below 2^-537 of the largest.
constexpr double kSphereError = 16.0 * kUnitRoundoff;

// The cross product of two rounded differences takes 5 units of the sum of the two products, see kCrossError;
// the sum of the three magnitudes, as long as their length at least, two more.
constexpr double kPassingError = 8.0 * kUnitRoundoff;
constexpr double kPassingUnderflow = 16.0 * std::numeric_limits<double>::denorm_min();

double below(double length) { return next_down((1.0 - kSphereError) * length); }
double above(double length) { return length > 0.0 ? next_up((1.0 + kSphereError) * length) : 0.0; }

/// About |v|; infinite if a part is, or if that is beyond the doubles.
double length_of(const double (&v)[3]) {
    const bool infinite = std::isinf(v[0]) || std::isinf(v[1]) || std::isinf(v[2]);
    return infinite ? kInfinity : std::hypot(v[0], v[1], v[2]);
}

struct Volume {
    double low[3];
    double high[3];
    double center[3];
    double radius = 0.0;
};

Volume around_box(const ExactBody& body) {
    Volume v;
    const double center[3] = {body.center.x, body.center.y, body.center.z};
    double arm[3][3] = {};
    for (int i = 0; i < body.generators; ++i) {
        const double axis[3] = {body.axis[i].x, body.axis[i].y, body.axis[i].z};
        for (int k = 0; k < 3; ++k) {
            const double size = std::fabs(body.half[i] * axis[k]);
            arm[i][k] = body.half[i] == 0.0 || axis[k] == 0.0 ? 0.0 : next_up(size);
        }
    }
    double spread[3];
    for (int k = 0; k < 3; ++k) {
        spread[k] = above(arm[0][k] + arm[1][k] + arm[2][k]);
        v.center[k] = center[k];
        v.low[k] = next_down(center[k] - spread[k]);
        v.high[k] = next_up(center[k] + spread[k]);
    }
    // A corner is as far off as the axes are long, if they are perpendicular: how far they are not is bounded
    // by the sums of the products of their parts.
    double square = 0.0;
    const double unit = std::max({spread[0], spread[1], spread[2]});
    if (unit > 0.0 && unit < kInfinity) {
        double g[3][3];
        for (int i = 0; i < 3; ++i) {
            const Vec3 axis = i < body.generators ? body.axis[i] : Vec3{};
            const double half = i < body.generators ? body.half[i] / unit : 0.0;
            g[i][0] = half * axis.x;
            g[i][1] = half * axis.y;
            g[i][2] = half * axis.z;
        }
        for (int i = 0; i < 3; ++i) {
            square += g[i][0] * g[i][0] + g[i][1] * g[i][1] + g[i][2] * g[i][2];
            for (int j = 0; j < i; ++j) {
                square += 2.0 * std::fabs(g[i][0] * g[j][0] + g[i][1] * g[j][1] + g[i][2] * g[j][2]);
            }
        }
        // Where products cancel, what they round is not: 16 u of all of them, which are at most 9.
        v.radius = above(above(unit * std::sqrt(square + 9.0 * kSphereError)));
    } else {
        v.radius = unit > 0.0 ? kInfinity : 0.0;
    }
    return v;
}

Volume around_hull(const ExactBody& body) {
    Volume v;
    const auto point = [&](int i, int k) { return body.points[3 * static_cast<std::ptrdiff_t>(i) + k]; };
    for (int k = 0; k < 3; ++k) {
        v.low[k] = v.high[k] = point(0, k);
        for (int i = 1; i < body.listed; ++i) {
            v.low[k] = std::min(v.low[k], point(i, k));
            v.high[k] = std::max(v.high[k], point(i, k));
        }
        v.center[k] = 0.5 * v.low[k] + 0.5 * v.high[k];
    }
    for (int i = 0; i < body.listed; ++i) {
        const double way[3] = {point(i, 0) - v.center[0], point(i, 1) - v.center[1],
                               point(i, 2) - v.center[2]};
        v.radius = std::max(v.radius, above(length_of(way)));
    }
    return v;
}

Volume around(const ExactBody& body) {
    return body.kind == ExactBody::Kind::hull ? around_hull(body) : around_box(body);
}

}  // namespace

PolytopeContact BoundPolytopeContactSolver::solve(const MovingBody& a, const MovingBody& b, double t_max,
                                                  bool /*contact_set*/) const {
    const Volume p = around(a.body);
    const Volume q = around(b.body);
    const double from[3] = {a.velocity.x, a.velocity.y, a.velocity.z};
    const double to[3] = {b.velocity.x, b.velocity.y, b.velocity.z};
    Span span;
    double apart[3];
    double fastest[3];
    double velocity[3];
    for (int k = 0; k < 3; ++k) {
        const Rate rate = rate_of(from[k], to[k]);
        span.clip(next_down(q.low[k] - p.high[k]), -rate.least);
        span.clip(next_down(p.low[k] - q.high[k]), rate.most);
        apart[k] = q.center[k] - p.center[k];
        fastest[k] = std::max(-rate.least, rate.most);
        velocity[k] = to[k] - from[k];
    }
    const double speed = above(length_of(fastest));
    const double radii = next_up(p.radius + q.radius);
    const double gap = next_down(below(length_of(apart)) - radii);
    if (gap > 0.0) {
        span.clip(gap, speed);
    }
    // The centers pass each other at the distance |apart x velocity| / speed.
    double passing[3];
    for (int k = 0; k < 3; ++k) {
        const int i = (k + 1) % 3;
        const int j = (k + 2) % 3;
        const double left = apart[i] * velocity[j];
        const double right = apart[j] * velocity[i];
        const double off = kPassingError * (std::fabs(left) + std::fabs(right)) + kPassingUnderflow;
        passing[k] = std::max(next_down(std::fabs(left - right) - off), 0.0);
    }
    const bool misses = next_down(below(length_of(passing))) > next_up(radii * speed);
    constexpr Vec3 kNowhere{kNaN, kNaN, kNaN};
    if (span.enter > std::min(span.leave, t_max) || misses) {
        return {ContactStatus::never, kNaN, kNaN, kNaN, kNaN, kNowhere, kNaN, {}, true, Rung::bound};
    }
    const ContactStatus status = span.enter > 0.0 ? ContactStatus::will_touch : ContactStatus::touching;
    const double leave = std::min(span.leave, t_max);
    return {status, span.enter, span.enter, leave, leave, kNowhere, kNaN, {}, false, Rung::bound};
}

}  // namespace geomsrv
