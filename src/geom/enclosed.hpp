// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
// Numbers of about 106 bits that know how wrong they may be: the middle rung of every ladder.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <type_traits>

#include "geom/double_double.hpp"
#include "geom/exact_number.hpp"
#include "geom/rounding.hpp"
#include "geom/rung.hpp"

namespace geomsrv {

/// A number and how far the exact one may be from it.
struct Enclosed {
    DoubleDouble value;
    double error = 0.0;

    Enclosed() = default;
    Enclosed(double x) : value{x, 0.0} {}  // NOLINT: a double is known exactly
    Enclosed(DoubleDouble x, double off) : value(x), error(off) {}
};

// Rounding of the error bounds themselves: fewer than 16 roundings each, all of positive numbers.
inline constexpr double kBoundRounding = 1.0 + 16 * kUnitRoundoff;

// Parts of a product that leave the normal range lose at most a few 2^-1074 each.  Above the second constant
// none does: the lowest bit of a product of doubles is 2^-106 of it.
inline constexpr double kEnclosedUnderflow = 0x1p-1060;
inline constexpr double kNoUnderflow = 0x1p-960;

/// Known to be zero.
inline bool is_zero(const Enclosed& x) { return x.value.hi == 0.0 && x.error == 0.0; }

// The same with room to spare, for products of more than two.
inline constexpr double kWholeProduct = 0x1p-900;
inline constexpr double kSurelyNormal = kWholeProduct;

inline Enclosed operator-(const Enclosed& a) { return {-a.value, a.error}; }
inline Enclosed operator+(const Enclosed& a, const Enclosed& b) {
    const DoubleDouble sum = a.value + b.value;
    // Two doubles whose sum is found without rest: nothing is rounded.
    if (a.value.lo == 0.0 && b.value.lo == 0.0) {
        return {sum, (a.error + b.error) * kBoundRounding};
    }
    if (is_zero(a)) {
        return b;
    }
    if (is_zero(b)) {
        return a;
    }
    const double larger = std::max(std::fabs(a.value.hi), std::fabs(b.value.hi));
    return {sum, ((a.error + b.error) + kWideRoundoff * larger) * kBoundRounding};
}
inline Enclosed operator-(const Enclosed& a, const Enclosed& b) { return a + (-b); }
inline Enclosed operator*(const Enclosed& a, const Enclosed& b) {
    const DoubleDouble product = a.value * b.value;
    const double size_a = std::fabs(a.value.hi);
    const double size_b = std::fabs(b.value.hi);
    // Of two doubles the product is found without rest, unless it is so small that parts of it underflow.
    const bool exact = a.value.lo == 0.0 && b.value.lo == 0.0;
    const double rounding = exact ? 0.0 : kWideRoundoff * std::fabs(product.hi);
    const bool whole = is_zero(a) || is_zero(b) || (exact && std::fabs(product.hi) > kNoUnderflow);
    return {product,
            ((size_a * b.error + size_b * a.error) + (a.error * b.error + rounding)) * kBoundRounding +
                (whole ? 0.0 : kEnclosedUnderflow)};
}

/// The product of two doubles, in the arithmetic named.
inline Enclosed product_of(double a, double b, std::type_identity<Enclosed>) {
    const DoubleDouble product = two_product(a, b);
    const bool kept = std::fabs(product.hi) > kSurelyNormal || a == 0.0 || b == 0.0;
    return {product, kept ? 0.0 : kEnclosedUnderflow};
}
inline Exact product_of(double a, double b, std::type_identity<Exact>) { return Exact(a) * Exact(b); }

/// 2 a, which rounds nothing.
inline Enclosed twice(const Enclosed& a) { return {{2.0 * a.value.hi, 2.0 * a.value.lo}, 2.0 * a.error}; }
inline Exact twice(const Exact& a) { return a + a; }

/// |a|, off by no more than a.
inline Enclosed magnitude(const Enclosed& a) { return a.value.hi < 0.0 ? -a : a; }
inline Exact magnitude(const Exact& a) { return a.magnitude(); }

/// What `sign_of` answers where the error does not let it decide.
inline constexpr int kUncertain = 2;

/// -1 or +1 if proven, 0 if the number is known to be zero, else kUncertain.  Infinities and NaN decide
/// nothing.
inline int sign_of(const Enclosed& x) {
    const double size = std::fabs(x.value.hi);
    // |value| >= |hi| (1 - u).
    if (size > x.error * kBoundRounding && size < std::numeric_limits<double>::infinity()) {
        return x.value.hi > 0.0 ? 1 : -1;
    }
    return is_zero(x) ? 0 : kUncertain;
}
inline int sign_of(const Exact& x) { return x.sign(); }

inline Enclosed operator/(const Enclosed& a, const Enclosed& b) {
    const double size = std::fabs(b.value.hi);
    const double smallest = size * (1.0 - 2 * kUnitRoundoff) - b.error;
    if (!(smallest > 0.0)) {
        return {a.value, std::numeric_limits<double>::infinity()};
    }
    const DoubleDouble quotient = a.value / b.value;
    const double size_q = std::fabs(quotient.hi);
    // |a/b - q| <= (|da| + |q| |db|) / |b|, and the rounding of the quotient.
    return {quotient, ((a.error + size_q * b.error) / smallest + kWideRoundoff * size_q) * kBoundRounding *
                              (1.0 + 4 * kUnitRoundoff) +
                          kEnclosedUnderflow};
}

/// REQUIRES: the exact number is >= 0.
inline Enclosed root_of(const Enclosed& x) {
    if (!(x.value.hi > 0.0)) {
        return {DoubleDouble{}, std::sqrt(x.error) * kBoundRounding};
    }
    const DoubleDouble root = sqrt(x.value);
    // |sqrt(x) - r| <= |dx| / r; the root itself is off by 2^-102 of it.
    return {root, (x.error / root.hi + 2 * kWideRoundoff * root.hi) * kBoundRounding + kEnclosedUnderflow};
}

/// Rounds if the error leaves no doubt about any of the three results (Ziv's test); a number that may be a
/// double is in doubt unless it is known exactly.
inline bool round_enclosed(const Enclosed& x, Rounding& out) {
    const double hi = x.value.hi;
    const double lo = x.value.lo;
    const double off = x.error * kBoundRounding;
    constexpr double kLeast = 0x1p-960;  // below, the low part is no longer all there
    if (off == 0.0 && lo == 0.0) {
        out = {hi, hi, hi};
        return true;
    }
    if (!(std::fabs(hi) > kLeast && std::fabs(hi) < std::numeric_limits<double>::max())) {
        return false;
    }
    const double least = next_down(lo - off);
    const double most = next_up(lo + off);
    if (!(least > 0.0 || most < 0.0) || hi + least != hi || hi + most != hi) {
        return false;
    }
    // hi + lo rounds to hi from either end, and is on one side of it.
    out = least > 0.0 ? Rounding{hi, hi, next_up(hi)} : Rounding{hi, next_down(hi), hi};
    return true;
}

}  // namespace geomsrv
