// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
#include "geom/exact_sign.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "geom/double_double.hpp"

namespace geomsrv {

namespace {

/// Exact sum of products of doubles: a fixed-point number wide enough for every bit of every product.
///
/// Digits of 32 bits are kept in 64-bit signed words, so that additions never carry; carries are settled
/// once, at the end.  A sum of 8 products of 4 digits each stays far below 2^63 per word.
class ProductSum {
public:
    void add(double a, double b) {
        if (a == 0.0 || b == 0.0) {
            return;
        }
        const Parts pa = split(a);
        const Parts pb = split(b);
        const bool negative = (a < 0.0) != (b < 0.0);
        const int position = pa.exponent + pb.exponent;  // of the lowest bit, >= 0
        const unsigned __int128 product =
            static_cast<unsigned __int128>(pa.mantissa) * pb.mantissa;  // < 2^106
        const int word = position / kDigitBits;
        const int shift = position % kDigitBits;
        // The product shifted by up to 31 bits needs 137: cut off the low digit first, then shift the rest.
        const unsigned __int128 low = (product & kDigitMask) << shift;
        const unsigned __int128 high = (product >> kDigitBits) << shift;
        accumulate(word, low, negative);
        accumulate(word + 1, high, negative);
        first_ = std::min(first_, word);
        last_ = std::max(last_, word + 5);
    }

    [[nodiscard]] int sign() {
        if (first_ > last_) {
            return 0;
        }
        std::int64_t carry = 0;
        bool nonzero = false;
        for (int k = first_; k <= last_; ++k) {
            const std::int64_t value = digits_[k] + carry;
            nonzero = nonzero || (value & static_cast<std::int64_t>(kDigitMask)) != 0;
            carry = value >> kDigitBits;  // rounds down, so the digit left behind is not negative
        }
        // The number is carry * 2^(32 (last + 1)) + a non-negative rest below that unit.
        return carry < 0 ? -1 : (carry > 0 || nonzero ? 1 : 0);
    }

private:
    static constexpr int kDigitBits = 32;
    static constexpr std::uint64_t kDigitMask = 0xffff'ffff;
    static constexpr int kBias = 1074;  // a double is a whole number of 2^-1074
    // Lowest bit of a product at 0 .. 2 * (1023 - 52 + 1074), plus 106 bits and the carries of 8 products.
    static constexpr int kDigits = 2 * (1023 - 52 + kBias) / kDigitBits + 8;

    struct Parts {
        std::uint64_t mantissa;
        int exponent;  // of the mantissa's lowest bit, in units of 2^-1074
    };

    static Parts split(double x) {
        int exponent = 0;
        const double fraction = std::frexp(std::fabs(x), &exponent);  // in [1/2, 1)
        const auto mantissa = static_cast<std::uint64_t>(std::ldexp(fraction, 53));
        const int lowest = exponent - 53 + kBias;
        // A subnormal number has fewer bits: the missing ones are zeros and are shifted out.
        return lowest >= 0 ? Parts{mantissa, lowest} : Parts{mantissa >> -lowest, 0};
    }

    void accumulate(int word, unsigned __int128 value, bool negative) {
        for (; value != 0; value >>= kDigitBits, ++word) {
            const auto digit = static_cast<std::int64_t>(static_cast<std::uint64_t>(value) & kDigitMask);
            digits_[word] += negative ? -digit : digit;
        }
    }

    std::int64_t digits_[kDigits] = {};
    int first_ = kDigits;
    int last_ = -1;
};

// Differences are exact, each product and their difference are off by at most kWideRoundoff; the rest covers
// the bound.
constexpr double kWideCrossError = 2.5 * kWideRoundoff;

// Above it no part of a product that the bound counts underflows: 2^-900 * 2^-106 > 2^-1022.
constexpr double kWideSmallest = 0x1p-900;

}  // namespace

int sign_of_cross_beyond_filter(Vec2 from_u, Vec2 to_u, Vec2 from_v, Vec2 to_v) {
    const DoubleDouble left = two_sum(to_u.x, -from_u.x) * two_sum(to_v.y, -from_v.y);
    const DoubleDouble right = two_sum(to_u.y, -from_u.y) * two_sum(to_v.x, -from_v.x);
    const double magnitude = std::fabs(left.hi) + std::fabs(right.hi);
    const double value = (left - right).hi;
    // After an overflow something here is NaN, and neither comparison holds.
    if (magnitude > kWideSmallest && std::fabs(value) > kWideCrossError * magnitude) {
        return value > 0.0 ? 1 : -1;
    }

    ProductSum sum;
    // (tx - fx)(ty' - fy') - (ty - fy)(tx' - fx'), multiplied out so that no difference is rounded.
    sum.add(to_u.x, to_v.y);
    sum.add(-to_u.x, from_v.y);
    sum.add(-from_u.x, to_v.y);
    sum.add(from_u.x, from_v.y);
    sum.add(-to_u.y, to_v.x);
    sum.add(to_u.y, from_v.x);
    sum.add(from_u.y, to_v.x);
    sum.add(-from_u.y, from_v.x);
    return sum.sign();
}

}  // namespace geomsrv
