// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
#include "geom/moving_pair.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "geom/lanes.hpp"
#include "geom/place.hpp"
#include "geom/rounding.hpp"

namespace geomsrv {

namespace {

constexpr std::size_t kLanes = Lanes::kCount;

// Rounding of the input, as a multiple of u times the largest coordinate: rotating p takes three products and
// two sums per coordinate, off by 3 u |p| each, 3 sqrt(3) u |p| together, and |p| <= sqrt(3) of its largest
// coordinate: 9 u; adding a shift costs another sqrt(3) u.  Rounded up.
constexpr double kInputNoise = 12.0 * kUnitRoundoff;

// Likewise for velocities, which are only rotated.
constexpr double kVelocityNoise = 9.0 * kUnitRoundoff;

// Velocities are rescaled where they leave this range, so that their products with lengths stay in the range
// of double.
constexpr double kSmallestSpeed = 0x1p-100;
constexpr double kLargestSpeed = 0x1p100;

// Numbers between these can be multiplied six at a time, split in parts, without leaving the normal range.
constexpr double kSmallestOrdinary = 0x1p-100;
constexpr double kLargestOrdinary = 0x1p100;

// A length computed from squares is off by less than this; reaches are rounded up by it.
constexpr double kRoundedUp = 1.0 + 16 * kUnitRoundoff;

std::size_t padded(std::size_t count) { return (count + kLanes - 1) / kLanes * kLanes; }

/// Middle of the bounding box and half its diagonal; the rows are then relative to the middle.
struct Extent {
    Vec3 middle;
    double spread = 0.0;
    double largest = 0.0;
};

/// Four points x y z, one after the other, by coordinates.
GEOMSRV_INLINE void load_points(const double* p, Lanes (&row)[3]) {
    const auto v0 = Lanes::load(p).v;      // x0 y0 z0 x1
    const auto v1 = Lanes::load(p + 4).v;  // y1 z1 x2 y2
    const auto v2 = Lanes::load(p + 8).v;  // z2 x3 y3 z3
    row[0].v = __builtin_shufflevector(__builtin_shufflevector(v0, v1, 0, 3, 6, 0), v2, 0, 1, 2, 5);
    row[1].v = __builtin_shufflevector(__builtin_shufflevector(v0, v1, 1, 4, 7, 0), v2, 0, 1, 2, 6);
    row[2].v = __builtin_shufflevector(__builtin_shufflevector(v0, v1, 2, 5, 0, 0), v2, 0, 1, 4, 7);
}

GEOMSRV_WIDE_CLONES Extent load_hull(const ExactBody& body, double scale, double* rows) {
    const auto listed = static_cast<std::size_t>(body.listed);
    const std::size_t count = padded(listed);
    const double* const given = body.points;
    Lanes low[3];
    Lanes high[3];
    for (std::size_t i = 0; i < count; i += kLanes) {
        Lanes at[3];
        if (i + kLanes <= listed) {
            load_points(given + 3 * i, at);
        } else {
            double last[3 * kLanes];
            for (std::size_t lane = 0; lane < kLanes; ++lane) {
                std::copy_n(given + 3 * std::min(i + lane, listed - 1), 3, last + 3 * lane);
            }
            load_points(last, at);
        }
        for (int k = 0; k < 3; ++k) {
            at[k] = Lanes(scale) * at[k];
            at[k].store(rows + static_cast<std::size_t>(k) * count + i);
            low[k] = i == 0 ? at[k] : lesser(low[k], at[k]);
            high[k] = i == 0 ? at[k] : greater(high[k], at[k]);
        }
    }
    double middle[3];
    double half[3];
    Extent out;
    for (int k = 0; k < 3; ++k) {
        const double lowest = least(low[k]);
        const double highest = greatest(high[k]);
        // Halves first: the sum of two large coordinates must not overflow.
        middle[k] = 0.5 * lowest + 0.5 * highest;
        half[k] = std::max(highest - middle[k], middle[k] - lowest);
        out.largest = std::max({out.largest, std::fabs(lowest), std::fabs(highest)});
        const Lanes m = middle[k];
        double* const row = rows + static_cast<std::size_t>(k) * count;
        for (std::size_t i = 0; i < count; i += kLanes) {
            (Lanes::load(row + i) - m).store(row + i);
        }
    }
    out.middle = {middle[0], middle[1], middle[2]};
    out.spread = safe_norm({half[0], half[1], half[2]}) * kRoundedUp;
    return out;
}

Extent load_box(const ExactBody& body, double scale, Core& core) {
    Extent out;
    out.middle = scale * body.center;
    core.generators = body.generators;
    for (int i = 0; i < body.generators; ++i) {
        core.generator[i] = (scale * body.half[i]) * body.axis[i];
        out.spread += safe_norm(core.generator[i]);
    }
    out.spread *= kRoundedUp;
    out.largest = largest_of(out.middle) + out.spread;
    return out;
}

Extent load(const ExactBody& body, double scale, std::vector<double>& rows, Core& core) {
    core = {};
    if (body.kind == ExactBody::Kind::zonotope) {
        return load_box(body, scale, core);
    }
    core.points = rows.data();
    core.count = static_cast<int>(padded(static_cast<std::size_t>(body.listed)));
    return load_hull(body, scale, rows.data());
}

void set_center(Core& core, const Extent& extent, Vec3 origin) {
    const WideVec3 center = exact_difference(extent.middle, origin);
    core.center = narrow(center);
    core.reach = (safe_norm(core.center) + extent.spread) * kRoundedUp;
    core.error =
        (safe_norm({center.x.lo, center.y.lo, center.z.lo}) + kUnitRoundoff * extent.spread) * kRoundedUp;
}

bool is_ordinary(double x) { return x == 0.0 || (x > kSmallestOrdinary && x < kLargestOrdinary); }

}  // namespace

double Seconds::nearest(double t) const { return exponent == 0 ? t : std::scalbn(t, exponent); }
double Seconds::inverse(double t) const { return exponent == 0 ? t : std::scalbn(t, -exponent); }
double Seconds::inverse_up(double t) const { return Seconds{-exponent}.up(t); }
double Seconds::down(double t) const {
    const double time = nearest(t);
    const bool rounded = exponent != 0 && t != 0.0 && time < std::numeric_limits<double>::min();
    return rounded ? std::max(0.0, next_down(time)) : std::min(time, std::numeric_limits<double>::max());
}
double Seconds::up(double t) const {
    const double time = nearest(t);
    const bool rounded = exponent != 0 && t != 0.0 && time < std::numeric_limits<double>::min();
    return rounded ? next_up(time) : time;
}

MovingPair::MovingPair(std::size_t most_a, std::size_t most_b)
    : points_a_(3 * padded(most_a)), points_b_(3 * padded(most_b)) {}

Vec3 MovingPair::way(const MovingBody& body, double moment) const {
    if (speed_exponent_ == 0 && length_exponent_ == 0) {
        return moment * body.velocity;
    }
    // In seconds the moment may be no normal double.
    const auto part = [&](double v) {
        return std::scalbn(moment * std::scalbn(v, speed_exponent_), -length_exponent_);
    };
    return {part(body.velocity.x), part(body.velocity.y), part(body.velocity.z)};
}

void MovingPair::load(const MovingBody& a, const MovingBody& b) {
    given_a_ = &a;
    given_b_ = &b;
    place(1.0);
    // Twice at most: numbers that overflow are first brought down to 1, and what then cancels is brought up
    // again.
    for (int tries = 0; tries < 2 && !in_range(reach()); ++tries) {
        const bool finite = reach() <= std::numeric_limits<double>::max();
        place(scale_ * scale_for(finite ? reach() : largest_));
    }
    set_motion();
    noise_ = std::min(2.0 * kInputNoise * largest_, kLargestSlack * reach());
}

void MovingPair::place(double scale) {
    scale_ = scale;
    length_exponent_ = scale == 1.0 ? 0 : std::ilogb(scale);
    const Extent a = geomsrv::load(given_a_->body, scale, points_a_, a_);
    const Extent b = geomsrv::load(given_b_->body, scale, points_b_, b_);
    set_center(a_, a, a.middle);
    set_center(b_, b, a.middle);
    origin_ = a.middle;
    largest_ = std::max(a.largest, b.largest);
    ordinary_ = scale == 1.0 && largest_ < kLargestOrdinary && is_ordinary(reach());
}

void MovingPair::set_motion() {
    const Vec3 from = given_a_->velocity;
    const Vec3 to = given_b_->velocity;
    double before = 1.0;
    double scale = 1.0;
    speed_exponent_ = 0;
    double largest = largest_of(to - from);
    at_rest_ = largest == 0.0;
    if (at_rest_) {
        velocity_ = {-1.0, 0.0, 0.0};
        speed_ = 1.0;
        velocity_noise_ = 0.0;
        return;
    }
    if (!(largest < kLargestSpeed && largest > kSmallestSpeed)) {
        // Components of opposite signs may differ by more than the largest double.
        if (!(largest <= std::numeric_limits<double>::max())) {
            before = 0.25;
            largest = largest_of(before * to - before * from);
        }
        speed_exponent_ = std::clamp(-std::ilogb(largest), -1000, 1000);
        scale = std::scalbn(1.0, speed_exponent_);
        speed_exponent_ += std::ilogb(before);
        ordinary_ = false;
    }
    velocity_ = scale * (before * to - before * from);
    speed_ = norm(velocity_);
    velocity_noise_ = std::min(kVelocityNoise * scale * (largest_of(before * from) + largest_of(before * to)),
                               kLargestSlack * speed_);
    ordinary_ = ordinary_ && largest_of(from) < kLargestOrdinary && largest_of(to) < kLargestOrdinary;
}

}  // namespace geomsrv
