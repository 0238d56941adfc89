// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
#include "geom/polygon_bound.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "geom/exact_sign.hpp"
#include "geom/rounding.hpp"
#include "geom/swept_volume.hpp"

namespace geomsrv {

namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr Vec2 kNowhere{kNaN, kNaN};

// Lengths: differences, squares, their sum and the root, or hypot (1 ulp), make at most 4 units of
// kUnitRoundoff, the bound one more.
constexpr double kLengthError = 8.0 * kUnitRoundoff;

double below(double length) { return next_down((1.0 - kLengthError) * length); }
double above(double length) { return length > 0.0 ? next_up((1.0 + kLengthError) * length) : 0.0; }

struct Volume {
    Vec2 low, high;
    Vec2 center;
    double radius = 0.0;
};

Volume around(Ring ring) {
    Volume v{ring[0], ring[0], {}, 0.0};
    for (const Vec2 p : ring) {
        v.low = {std::min(v.low.x, p.x), std::min(v.low.y, p.y)};
        v.high = {std::max(v.high.x, p.x), std::max(v.high.y, p.y)};
    }
    v.center = 0.5 * v.low + 0.5 * v.high;
    // In units of about the radius no square leaves the range of double.
    const Vec2 half = v.high - v.center;
    const double size = std::max({half.x, half.y, v.center.x - v.low.x, v.center.y - v.low.y});
    if (size > 0.0) {
        const int exponent = std::clamp(std::ilogb(size), -1000, 1000);
        const double unit = std::scalbn(1.0, -exponent);
        double square = 0.0;
        for (const Vec2 p : ring) {
            const Vec2 way = unit * (p - v.center);
            square = std::max(square, dot(way, way));
        }
        v.radius = above(std::scalbn(std::sqrt(square), exponent));
    }
    return v;
}

/// Lower bound of the signed distance.
double least_distance(const Volume& a, const Volume& b) {
    const double x = std::max(next_down(b.low.x - a.high.x), next_down(a.low.x - b.high.x));
    const double y = std::max(next_down(b.low.y - a.high.y), next_down(a.low.y - b.high.y));
    const double boxes =
        x > 0.0 || y > 0.0 ? below(std::hypot(std::max(x, 0.0), std::max(y, 0.0))) : std::max(x, y);
    const Vec2 apart = b.center - a.center;
    const double circles = next_down(below(std::hypot(apart.x, apart.y)) - next_up(a.radius + b.radius));
    return std::max(boxes, circles);
}

}  // namespace

FirstContact BoundFirstContactSolver::solve(const MovingPolygon& a, const MovingPolygon& b, double t_max,
                                            bool /*contact_set*/) const {
    constexpr FirstContact kNever{ContactStatus::never, kNaN, kNaN, kNaN, kNaN, kNowhere, {}, true,
                                  Rung::bound};
    const Volume p = around(a.ring);
    const Volume q = around(b.ring);
    const Rate x = rate_of(a.velocity.x, b.velocity.x);
    const Rate y = rate_of(a.velocity.y, b.velocity.y);
    Span span;
    span.clip(next_down(q.low.x - p.high.x), -x.least);
    span.clip(next_down(p.low.x - q.high.x), x.most);
    span.clip(next_down(q.low.y - p.high.y), -y.least);
    span.clip(next_down(p.low.y - q.high.y), y.most);

    const Vec2 apart = q.center - p.center;
    const Vec2 fastest{std::max(-x.least, x.most), std::max(-y.least, y.most)};
    const double speed = above(std::hypot(fastest.x, fastest.y));
    const double radii = next_up(p.radius + q.radius);
    const double gap = next_down(below(std::hypot(apart.x, apart.y)) - radii);
    if (gap > 0.0) {
        span.clip(gap, speed);
    }
    // The centers pass each other at the distance |apart x velocity| / speed.
    const Vec2 velocity = b.velocity - a.velocity;
    const double left = apart.x * velocity.y;
    const double right = apart.y * velocity.x;
    const double off = kCrossError * (std::fabs(left) + std::fabs(right)) + kCrossUnderflow;
    const double passing = next_down(std::fabs(left - right) - off);
    if (span.enter > std::min(span.leave, t_max) || passing > next_up(radii * speed)) {
        return kNever;
    }
    const ContactStatus status = span.enter > 0.0 ? ContactStatus::will_touch : ContactStatus::touching;
    const double leave = std::min(span.leave, t_max);
    return {status, span.enter, span.enter, leave, leave, kNowhere, {}, false, Rung::bound};
}

PolygonDistance BoundPolygonDistanceSolver::solve(Ring a, Ring b, bool penetration) const {
    const double least = least_distance(around(a), around(b));
    const double lower = penetration ? least : std::max(least, 0.0);
    const Vec2 way = b[0] - a[0];
    const double upper = above(std::hypot(way.x, way.y));
    const bool certain = least > 0.0 || upper == 0.0;
    return {lower, lower, upper, kNowhere, kNowhere, kNowhere, !(least > 0.0), certain, Rung::bound};
}

}  // namespace geomsrv
