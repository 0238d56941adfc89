// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
#include "geom/footprint.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "geom/double_double.hpp"
#include "geom/exact_sign.hpp"
#include "geom/rounding.hpp"

namespace geomsrv {

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

// With L the size of footprint and point, V that of the velocity, e of an edge, the coefficients sum terms of
// g: e L, B: e (w L + V), a: e w (w L + 2 V); they take up to 8 roundings, and the roots are those of
// parabolas whose coefficients are off by 16 u more (the discriminant cancels: 4 u of B^2, which is B off by
// 2 u; root, sum and quotient 4 u; twice that for the slack of one end of an interval at the other). Together
// 24 u, counted 32 u.  With m = max(w, V / L), 2 r <= r^2 / m + m turns an error of B into one of g and one
// of a: g gets 32 u e (L + 2 L), a gets 32 u e (3 m^2 L + 2 m^2 L).  A third is added for the rounding of m
// and of these. Without turning a is 0 and r > 0: the error of B counts as it is, on the side on which it
// harms.
constexpr double kStartError = 128 * kUnitRoundoff;
constexpr double kTurnedError = 224 * kUnitRoundoff;

// B, where it counts as it is: 32 u e V, doubled.
constexpr double kRateError = 64 * kUnitRoundoff;

// Larger or smaller numbers are not looked at in closed form: the discriminant, of order L^4 w^2, stays
// finite.
constexpr double kLargestSize = 0x1p120;

// So that the ratio of speed and size stays finite.
constexpr double kSmallestSize = 0x1p-120;

// What underflow may have cost a coefficient: a product that underflows is off by 2^-1074, and a discriminant
// off by that is a B off by its root.
constexpr double kCoefficientFloor = 0x1p-500;

// A time: arctangent 4 u, quotient, product and the ratio it was taken of 4 u.
constexpr double kTimeError = 16 * kUnitRoundoff;

// An interval of this part of the time is as narrow as it gets: twice `kTimeError`, and as much for r.
constexpr double kTimeResolution = 64 * kUnitRoundoff;

// Rounded: an angle between pi / 4 and pi, off by less than u of it.
constexpr double kPi = 0x1.921fb54442d18p+1;
// Rounded, as its half is.
constexpr double kHalfPi = 0x1.921fb54442d18p+0;
// 2 pi, rounded up, and the quotient.
constexpr double kTwoPi = 0x1.921fb54442d19p+2;
// Two roundings, twice.
constexpr double kPeriodSlack = 1.0 + 4 * kUnitRoundoff;

/// arctan(k / 8).
constexpr std::array<double, 9> kArctangent = {0.0,
                                               0x1.fd5ba9aac2f6ep-4,
                                               0x1.f5b75f92c80ddp-3,
                                               0x1.6f61941e4def1p-2,
                                               0x1.dac670561bb4fp-2,
                                               0x1.1e00babdefeb4p-1,
                                               0x1.4978fa3269ee1p-1,
                                               0x1.700a7c5784634p-1,
                                               0x1.921fb54442d18p-1};

/// arctan(x) / x, 0 <= x <= 1, by Taylor's series about the nearest eighth: the first term left out is below
/// 2^-68.  Our own, so that the bits are the same on every processor.
double arctangent_ratio(double x) {
    const auto series = [](double square) {
        double sum = 1.0 / 15.0;
        for (const double odd : {13.0, 11.0, 9.0, 7.0, 5.0, 3.0, 1.0}) {
            sum = 1.0 / odd - square * sum;
        }
        return sum;
    };
    if (x <= 0.0625) {
        return series(x * x);
    }
    const auto eighths = static_cast<std::size_t>(std::nearbyint(8.0 * x));
    const double near = 0.125 * static_cast<double>(eighths);
    const double rest = (x - near) / (1.0 + x * near);
    return (kArctangent[eighths] + rest * series(rest * rest)) / x;
}

/// t of r = w / tan(w t / 2), w >= 0; REQUIRES: r > 0 where w is 0.
double time_of(double r, double w) {
    if (r >= w) {
        return 2.0 / r * arctangent_ratio(w / r);
    }
    const double ratio = std::fabs(r) < w ? r / w : w / r;
    const double angle = ratio * arctangent_ratio(std::fabs(ratio));
    return 2.0 * (std::fabs(r) < w ? kHalfPi - angle : kPi + angle) / w;
}

}  // namespace

TurningCenter turning_center(const Twist2& twist) {
    const double w = twist.angular;
    const Vec2 center{-twist.linear.y / w, twist.linear.x / w};
    const auto exact = [w](double quotient, double of) {
        const DoubleDouble product = two_product(quotient, w);
        return product.hi == of && product.lo == 0.0;
    };
    const bool known = exact(center.x, -twist.linear.y) && exact(center.y, twist.linear.x);
    // Each quotient is off by u of itself: so is the velocity about it, u |v|, and as much again.
    const double drift = known ? 0.0 : 2 * kUnitRoundoff * norm(twist.linear);
    return {center, drift};
}

double period_of(const Twist2& twist) { return kTwoPi / std::fabs(twist.angular) * kPeriodSlack; }

/// A point in the robot's frame.
struct Footprint::Course {
    Vec2 point;
    Vec2 velocity;  ///< of the robot against the point
    double w;
    double start_error;   ///< of g, for an edge of size 1
    double rate_error;    ///< of B where it counts by itself
    double turned_error;  ///< of a
};

Footprint::Footprint(Ring ring, const Twist2& twist) : ring_(ring), twist_(twist) {
    StrictHull hull;
    const Ring corners = hull.of(ring);
    for (const Vec2 v : corners) {
        reach_ = std::max({reach_, std::fabs(v.x), std::fabs(v.y)});
    }
    if (corners.size() < 3) {
        return;  // without inside: no margin is small enough
    }
    for (std::size_t i = 0; i < corners.size(); ++i) {
        const Vec2 along = corners[(i + 1) % corners.size()] - corners[i];
        edges_.push_back({corners[i], along, std::fabs(along.x) + std::fabs(along.y)});
    }
    gaps_.reserve(edges_.size());
}

PointContact Footprint::solve(Vec2 point, Vec2 velocity, double t_max, double tolerance) {
    PointContact out{TurningStatus::will_touch, 0.0, kInfinity, false};
    if (closed_form(point, velocity, t_max, out) &&
        (out.status != TurningStatus::will_touch ||
         out.upper - out.lower <= std::max(tolerance, kTimeResolution * out.upper))) {
        out.closed = true;
        return out;
    }
    turning(point, velocity, t_max, tolerance, out);
    return out;
}

/// False where it cannot tell; `lower` and `upper` hold all the same.
bool Footprint::closed_form(Vec2 point, Vec2 velocity, double t_max, PointContact& out) {
    const double w = twist_.angular;
    if (edges_.empty() || (w != 0.0 && (velocity.x != 0.0 || velocity.y != 0.0))) {
        return false;
    }
    const Vec2 relative = twist_.linear - velocity;
    const double size = std::max(std::fabs(point.x), std::fabs(point.y)) + reach_;
    const double speed = std::max(std::fabs(relative.x), std::fabs(relative.y));
    const double rate = std::max(std::fabs(w), speed / size);
    if (!(size <= kLargestSize && size >= kSmallestSize && speed <= kLargestSize && rate <= kLargestSize)) {
        return false;
    }
    const bool turns = w != 0.0;
    const Course course{point,
                        relative,
                        w,
                        kStartError * size,
                        turns ? 0.0 : kRateError * speed,
                        turns ? kTurnedError * size * rate * rate : 0.0};
    const double last = turns ? -kInfinity : 0.0;  // not to be reached
    const double earliest = first(course, -1.0);
    if (earliest == kInfinity) {
        // By its line no edge can tell the point from one inside: exactly, then.
        int least = 1;
        for (std::size_t i = 0; i < edges_.size(); ++i) {
            least = std::min(least, orientation(edges_[i].from, edges_[(i + 1) % edges_.size()].from, point));
        }
        if (least >= 0) {
            out = {least == 0 ? TurningStatus::touching : TurningStatus::overlapping, 0.0, 0.0, false};
            return true;
        }
    } else if (!(earliest > last) || (!turns && speed == 0.0) ||
               time_of(earliest, std::fabs(w)) * (1.0 - kTimeError) > t_max) {
        out = {TurningStatus::never, kNan, kNan, false};
        return true;
    } else {
        out.lower = time_of(earliest, std::fabs(w)) * (1.0 - kTimeError);
    }
    const double surely = first(course, 1.0);
    if (!(surely > last)) {
        return false;
    }
    const double upper = time_of(surely, std::fabs(w)) * (1.0 + kTimeError);
    if (!(upper <= t_max)) {
        return false;
    }
    out.upper = upper;
    return true;
}

/// The largest r at which the point may be in the footprint (side -1: all edges moved outwards by the error)
/// or surely is (side 1: inwards); NaN if there is none.
double Footprint::first(const Course& course, double side) {
    double most = kInfinity;
    double least = -kInfinity;
    gaps_.clear();
    for (const Edge& edge : edges_) {
        const Vec2 e = edge.along;
        const Vec2 arm = course.point - edge.from;
        const Vec2 sum = course.point + edge.from;
        const double w = course.w;
        double g = (e.y * arm.x - e.x * arm.y) + side * (course.start_error * edge.size + kCoefficientFloor);
        const double b = w * dot(e, course.point) - (e.y * course.velocity.x - e.x * course.velocity.y) +
                         side * (w != 0.0 ? 0.0 : course.rate_error * edge.size + kCoefficientFloor);
        const double a = -w * (w * (e.y * sum.x - e.x * sum.y) + 2.0 * dot(e, course.velocity)) +
                         side * (w != 0.0 ? course.turned_error * edge.size + kCoefficientFloor : 0.0);
        if (side > 0.0 && std::fabs(g) <= course.start_error * edge.size) {
            return kNan;  // the parabola may open either way
        }
        if (g == 0.0) {
            g = -kCoefficientFloor;  // only with side -1
        }
        const double discriminant = b * b - g * a;
        if (discriminant < 0.0) {
            if (g > 0.0) {
                return kNan;
            }
            continue;
        }
        // The roots without cancellation.
        const double q = std::fabs(b) + std::sqrt(discriminant);
        const double far = (b <= 0.0 ? q : -q) / g;
        const double near = q > 0.0 ? (b <= 0.0 ? a : -a) / q : 0.0;
        const double high = std::max(far, near);
        const double low = std::min(far, near);
        if (g > 0.0) {
            most = std::min(most, high);
            least = std::max(least, low);
            if (most < least) {
                return kNan;
            }
        } else {
            gaps_.push_back({low, high});
        }
    }
    for (bool moved = true; moved;) {
        moved = false;
        for (const Gap& gap : gaps_) {
            if (most < gap.begin && most > gap.end) {
                most = gap.end;
                moved = true;
            }
        }
    }
    return most >= least ? most : kNan;
}

void Footprint::turning(Vec2 point, Vec2 velocity, double t_max, double tolerance, PointContact& out) {
    TurningBody body;
    body.rows = &ring_.data()->x;
    body.count = ring_.size();
    body.dimension = 2;
    TurningBody other;
    other.rows = &point.x;
    other.count = 1;
    other.dimension = 2;
    other.velocity = {velocity.x, velocity.y, 0.0};
    other.center = {point.x, point.y, 0.0};
    TurningSlack slack;
    double end = t_max;
    if (twist_.angular == 0.0) {
        body.velocity = {twist_.linear.x, twist_.linear.y, 0.0};
    } else {
        const TurningCenter center = turning_center(twist_);
        body.center = {center.point.x, center.point.y, 0.0};
        body.angular.z = twist_.angular;
        slack.drift = center.drift;
        if (velocity.x == 0.0 && velocity.y == 0.0) {
            end = std::min(end, period_of(twist_));
        }
    }
    const PointContact bounds = out;
    const auto finite = [](Vec3 v) { return std::isfinite(v.x) && std::isfinite(v.y); };
    if (!finite(body.center)) {
        out.status = TurningStatus::not_converged;
        return;
    }
    const TurningContact found = solver_.solve(body, other, end, tolerance, slack);
    out = {found.status, found.lower, found.upper, false};
    if (found.status == TurningStatus::will_touch || found.status == TurningStatus::grazing ||
        found.status == TurningStatus::not_converged) {
        // Both brackets hold.
        out.lower = std::max(out.lower, bounds.lower);
        out.upper = std::min(out.upper, bounds.upper);
        if (out.upper - out.lower <= tolerance) {
            out.status = TurningStatus::will_touch;
        }
    }
}

}  // namespace geomsrv
