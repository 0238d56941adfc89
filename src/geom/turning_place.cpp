// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
#include "geom/turning_place.hpp"

#include <algorithm>
#include <cmath>

#include "geom/rounding.hpp"

namespace geomsrv {

namespace {

// Angles beyond this are not reduced [rad]: a body that turns at 1000 rad/s takes 12 days.
constexpr double kLargestAngle = 0x1p30;

// Lengths not above this have no reciprocal.
constexpr double kSmallestLength = 0x1p-1000;

// No time beyond this is looked at [s]: products with it must not overflow.
constexpr double kLargestTime = 0x1p900;

/// 1 / k!, good to the last bits.
template <std::size_t Count>
constexpr std::array<DoubleDouble, Count> inverse_factorials() {
    std::array<DoubleDouble, Count> table{};
    table[0] = {1.0, 0.0};
    for (std::size_t k = 1; k < Count; ++k) {
        table[k] = table[k - 1] / DoubleDouble{static_cast<double>(k), 0.0};
    }
    return table;
}
constexpr auto kInverseFactorial = inverse_factorials<30>();

/// angle = quarters * pi / 2 + rest, |rest| <= pi / 4 or a little more.
struct Reduced {
    int quarter = 0;  ///< quarters mod 4
    DoubleDouble rest;
};

Reduced reduced(DoubleDouble angle) {
    // pi / 2 in three parts.
    constexpr double kFirst = 0x1.921fb54442d18p+0;
    constexpr double kSecond = 0x1.1a62633145c07p-54;
    constexpr double kThird = -0x1.f1976b7ed8fbcp-110;
    constexpr double kQuartersPerRadian = 0x1.45f306dc9c883p-1;  // 2 / pi
    const double quarters = std::nearbyint(angle.hi * kQuartersPerRadian);
    if (quarters == 0.0) {
        return {0, angle};
    }
    DoubleDouble rest = angle - two_product(quarters, kFirst);
    rest = rest - two_product(quarters, kSecond);
    rest = rest - DoubleDouble{quarters * kThird, 0.0};
    return {static_cast<int>(static_cast<long long>(quarters) & 3), rest};
}

template <class Number>
struct Turn {
    Number sine;
    Number cosine;
};

template <class Number>
Turn<Number> quarter_turned(int quarter, Turn<Number> turn) {
    switch (quarter) {
        case 0:
            return turn;
        case 1:
            return {turn.cosine, -turn.sine};
        case 2:
            return {-turn.sine, -turn.cosine};
        default:
            return {-turn.cosine, turn.sine};
    }
}

/// Taylor's series; the first term left out is below 2^-68.
Turn<double> turn_of(const Reduced& angle) {
    constexpr std::size_t kLast = 19;
    const double x = angle.rest.hi;
    const double square = x * x;
    double sine = kInverseFactorial[kLast].hi;
    double cosine = kInverseFactorial[kLast - 1].hi;
    for (std::size_t k = kLast; k > 3; k -= 2) {
        sine = kInverseFactorial[k - 2].hi - square * sine;
        cosine = kInverseFactorial[k - 3].hi - square * cosine;
    }
    sine = x - x * (square * sine);
    cosine = 1.0 - square * cosine;
    const double low = angle.rest.lo;
    return quarter_turned<double>(angle.quarter, {sine + low * cosine, cosine - low * sine});
}

/// The same; the first term left out is below 2^-107.
Turn<DoubleDouble> wide_turn_of(const Reduced& angle) {
    constexpr std::size_t kLast = 29;
    const DoubleDouble x = angle.rest;
    const DoubleDouble square = x * x;
    DoubleDouble sine = kInverseFactorial[kLast];
    DoubleDouble cosine = kInverseFactorial[kLast - 1];
    for (std::size_t k = kLast; k > 1; k -= 2) {
        sine = kInverseFactorial[k - 2] - square * sine;
        cosine = kInverseFactorial[k - 3] - square * cosine;
    }
    return quarter_turned<DoubleDouble>(angle.quarter, {x * sine, cosine});
}

template <class Number, class Vector>
std::array<Vector, 3> rotation(const Turn<Number>& turn, const Vector& k) {
    const Number rest = Number{1.0} - turn.cosine;
    const Vector s = turn.sine * k;
    const Vector m = rest * k;
    return {{{turn.cosine + m.x * k.x, m.x * k.y - s.z, m.x * k.z + s.y},
             {m.y * k.x + s.z, turn.cosine + m.y * k.y, m.y * k.z - s.x},
             {m.z * k.x - s.y, m.z * k.y + s.x, turn.cosine + m.z * k.z}}};
}

double largest(Vec3 v) { return std::max({std::fabs(v.x), std::fabs(v.y), std::fabs(v.z)}); }

}  // namespace

void TurningVertices::read(const TurningBody& body) {
    arms_.clear();
    if (body.axes != nullptr) {
        arms_.push_back(exact_difference({body.rows[0], body.rows[1], body.rows[2]}, body.center));
        for (int k = 0; k < 3; ++k) {
            const double e = body.half[k];
            const double* axis = body.axes + 3 * k;
            const WideVec3 side{two_product(e, axis[0]), two_product(e, axis[1]), two_product(e, axis[2])};
            for (std::size_t i = arms_.size(); i-- > 0;) {
                arms_.push_back(arms_[i] + side);
                arms_[i] = arms_[i] - side;
            }
        }
    } else {
        for (std::size_t i = 0; i < body.count; ++i) {
            const double* row = body.rows + static_cast<std::size_t>(body.dimension) * i;
            arms_.push_back(
                exact_difference({row[0], row[1], body.dimension == 3 ? row[2] : 0.0}, body.center));
        }
    }
    count_ = arms_.size();
    placed_.resize(3 * count_);

    double top = 0.0;
    for (const WideVec3& arm : arms_) {
        top = std::max(top, largest(narrow(arm)));
    }
    // Divided by the largest coordinate, so that no square overflows or underflows that matters.
    const double unit = top > kSmallestLength ? 1.0 / top : 0.0;
    double square = 0.0;
    for (const WideVec3& arm : arms_) {
        const Vec3 v = unit * narrow(arm);
        square = std::max(square, dot(v, v));
    }
    reach_ = top > kSmallestLength ? top * std::sqrt(square) : 2.0 * top;
    reach_ *= 1.0 + 16 * kUnitRoundoff;  // what the last lines round, arms rounded to double included

    angular_ = body.angular;
    const double rate = largest(angular_);
    turns_ = rate > 0.0;
    speed_ = {};
    axis_ = {};
    if (turns_) {
        // Scaled, lest squares of slow rates underflow.
        const PowerOfTwo up(-exponent_of(rate));
        const PowerOfTwo down(exponent_of(rate));
        const WideVec3 w = widen(up * angular_);
        const DoubleDouble length = sqrt(dot(w, w));
        axis_ = {w.x / length, w.y / length, w.z / length};
        speed_ = {down * length.hi, down * length.lo};
    }
}

void TurningVertices::scale(PowerOfTwo by) {
    for (WideVec3& arm : arms_) {
        for (DoubleDouble* x : {&arm.x, &arm.y, &arm.z}) {
            *x = {by * x->hi, by * x->lo};
        }
    }
    reach_ = by * reach_;
}

void TurningVertices::place(double t) {
    std::array<Vec3, 3> row{{{1.0, 0.0, 0.0}, {0.0, 1.0, 0.0}, {0.0, 0.0, 1.0}}};
    if (turns_) {
        row = rotation<double, Vec3>(turn_of(reduced(speed_ * t)), narrow(axis_));
    }
    double* x = placed_.data();
    double* y = x + count_;
    double* z = y + count_;
    for (std::size_t i = 0; i < count_; ++i) {
        const Vec3 arm = narrow(arms_[i]);
        x[i] = dot(row[0], arm);
        y[i] = dot(row[1], arm);
        z[i] = dot(row[2], arm);
    }
}

void TurningVertices::turn_wide(double t) {
    if (turns_) {
        wide_rotation_ = rotation<DoubleDouble, WideVec3>(wide_turn_of(reduced(speed_ * t)), axis_);
    }
}

WideVec3 TurningVertices::placed_wide(std::size_t i) const {
    const WideVec3& arm = arms_[i];
    if (!turns_) {
        return arm;
    }
    return {dot(wide_rotation_[0], arm), dot(wide_rotation_[1], arm), dot(wide_rotation_[2], arm)};
}

double TurningVertices::wide_error(double t) const {
    if (!turns_) {
        return 4 * kWideRoundoff * reach_;  // a box's corner takes three sums
    }
    return (kWidePlaceError + kWideAngleError * (speed_.hi * t)) * reach_;
}

bool TurningVertices::placeable(double t) const { return t < kLargestTime && speed_.hi * t < kLargestAngle; }

Core TurningVertices::core() const {
    Core out;
    out.points = placed_.data();
    out.count = static_cast<int>(count_);
    out.reach = reach_ * (1.0 + kPlaceError);
    out.error = error();
    return out;
}

}  // namespace geomsrv
