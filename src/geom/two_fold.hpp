// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
// Double-double arithmetic: a number as the unevaluated sum of two doubles, about 106 bits.
//
// Sums and products of two doubles are exact (Knuth; Dekker 1971), the operations below carry the relative
// errors of Joldes, Muller, Popescu, "Tight and rigorous error bounds for basic building blocks of
// double-word arithmetic" (2017), rounded up.  Nothing here is exact outside the normal range: callers scale
// first and add an absolute term.
#pragma once

#include <bit>
#include <cmath>
#include <cstdint>

namespace geomsrv {

struct TwoFold {
    double hi = 0.0;  ///< the nearest double
    double lo = 0.0;  ///< the rest, at most half a unit in the last place of hi
};

/// Square of the unit roundoff, in which errors of TwoFold operations are counted.
inline constexpr double kTwoFoldRoundoff = 0x1p-106;

/// a + b exactly, for |a| >= |b|.
constexpr TwoFold quick_two_sum(double a, double b) {
    const double sum = a + b;
    return {sum, b - (sum - a)};
}

/// a + b exactly.
constexpr TwoFold two_sum(double a, double b) {
    const double sum = a + b;
    const double b_part = sum - a;
    return {sum, (a - (sum - b_part)) + (b - b_part)};
}

/// a - b exactly.
constexpr TwoFold two_difference(double a, double b) { return two_sum(a, -b); }

/// a * b exactly, unless the product or its rounding error leaves the range of normal doubles.  Dekker's
/// product rather than std::fma: that is a slow library call where the processor lacks the instruction.
constexpr TwoFold two_product(double a, double b) {
    constexpr double kSplitter = 0x1p27 + 1.0;  // cuts 53 bits into 26 + 26 and a sign
    const double a_big = kSplitter * a;
    const double b_big = kSplitter * b;
    const double a_hi = a_big - (a_big - a);
    const double b_hi = b_big - (b_big - b);
    const double a_lo = a - a_hi;
    const double b_lo = b - b_hi;
    const double product = a * b;
    return {product, ((a_hi * b_hi - product) + a_hi * b_lo + a_lo * b_hi) + a_lo * b_lo};
}

/// Relative error at most 3 kTwoFoldRoundoff of |a| + |b| (of the result itself if the signs agree).
constexpr TwoFold operator+(TwoFold a, TwoFold b) {
    const TwoFold sum = two_sum(a.hi, b.hi);
    return quick_two_sum(sum.hi, sum.lo + (a.lo + b.lo));
}
constexpr TwoFold operator-(TwoFold a) { return {-a.hi, -a.lo}; }
constexpr TwoFold operator-(TwoFold a, TwoFold b) { return a + -b; }

/// Relative error at most 7 kTwoFoldRoundoff.
constexpr TwoFold operator*(TwoFold a, TwoFold b) {
    const TwoFold product = two_product(a.hi, b.hi);
    return quick_two_sum(product.hi, product.lo + (a.hi * b.lo + a.lo * b.hi));
}

/// Relative error at most 16 kTwoFoldRoundoff.  An infinite quotient has no second part.
constexpr TwoFold operator/(TwoFold a, TwoFold b) {
    const double first = a.hi / b.hi;
    if (!(first - first == 0.0)) {
        return {first, 0.0};
    }
    const TwoFold rest = a - b * TwoFold{first, 0.0};
    return quick_two_sum(first, rest.hi / b.hi);
}

/// A power of two times x: exact.
constexpr TwoFold scaled(double power, TwoFold x) { return {power * x.hi, power * x.lo}; }

/// The next double towards +infinity; x must not be NaN, +infinity stays.
inline double next_up(double x) {
    if (x == 0.0) {
        return std::bit_cast<double>(std::uint64_t{1});
    }
    const auto bits = std::bit_cast<std::uint64_t>(x);
    if (x > 0.0) {
        return std::isinf(x) ? x : std::bit_cast<double>(bits + 1);
    }
    return std::bit_cast<double>(bits - 1);
}

/// The next double towards -infinity; x must not be NaN, -infinity stays.
inline double next_down(double x) { return -next_up(-x); }

}  // namespace geomsrv
