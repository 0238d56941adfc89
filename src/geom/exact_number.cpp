// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
#include "geom/exact_number.hpp"

#include <bit>
#include <cmath>
#include <limits>

namespace geomsrv {

namespace mp = boost::multiprecision;

namespace {

constexpr std::int64_t kMantissaBits = 53;
constexpr std::int64_t kLowestBit = -1074;  // of any double

// Bits of a quotient or root before rounding: those of a double, one to round by, and some to spare, because
// the leading one may come out a place lower.
constexpr std::int64_t kEnoughBits = 60;

template <class Integer>
std::int64_t bits_of(const Integer& x) {
    return x.is_zero() ? 0 : static_cast<std::int64_t>(mp::msb(x)) + 1;
}

template <class Integer>
Integer shifted(const Integer& x, std::int64_t left) {
    return left >= 0 ? Integer(x << left) : Integer(x >> -left);
}

/// (whole + something less than 1 if `more`) * 2^exponent, whole >= 0; whole has kEnoughBits unless it is
/// all there is.
template <class Integer>
Rounding round_positive(const Integer& whole, bool more, std::int64_t exponent) {
    // The last place that a double of this size has, in units of the last bit of `whole`.
    const std::int64_t last = std::max(bits_of(whole) + exponent - kMantissaBits, kLowestBit) - exponent;
    if (last <= 0) {
        const double value = std::ldexp(static_cast<double>(static_cast<std::uint64_t>(whole)),
                                        static_cast<int>(std::max<std::int64_t>(exponent, -5000)));
        return {value, value, value};
    }
    const Integer kept = whole >> last;
    const Integer rest = whole - (kept << last);
    const auto scaled = [&](std::uint64_t mantissa) {
        // Far above or below the range of double all the same: ldexp saturates.
        const std::int64_t place = std::min<std::int64_t>(last + exponent, 5000);
        return std::ldexp(static_cast<double>(mantissa), static_cast<int>(place));
    };
    const auto mantissa = static_cast<std::uint64_t>(kept);
    const bool inexact = more || !rest.is_zero();
    double lower = scaled(mantissa);
    double upper = inexact ? scaled(mantissa + 1) : lower;
    const int to_half = rest.compare(Integer(Integer(1) << (last - 1)));
    const bool up = to_half > 0 || (to_half == 0 && (more || (mantissa & 1) != 0));
    const double nearest = up ? upper : lower;
    if (std::isinf(lower)) {
        lower = std::numeric_limits<double>::max();
    }
    return {nearest, lower, upper};
}

Rounding negated(const Rounding& x) { return {-x.nearest, -x.upper, -x.lower}; }

}  // namespace

Exact::Exact(double x) {
    if (x == 0.0) {
        return;
    }
    int exponent = 0;
    const double fraction = std::frexp(std::fabs(x), &exponent);  // in [1/2, 1)
    auto whole = static_cast<std::uint64_t>(std::ldexp(fraction, static_cast<int>(kMantissaBits)));
    const int zeros = std::countr_zero(whole);
    whole >>= zeros;
    mantissa_ = whole;
    if (x < 0.0) {
        mantissa_ = -mantissa_;
    }
    exponent_ = exponent - kMantissaBits + zeros;
}

Exact operator+(const Exact& a, const Exact& b) {
    if (a.mantissa_.is_zero()) {
        return b;
    }
    if (b.mantissa_.is_zero()) {
        return a;
    }
    if (a.exponent_ == b.exponent_) {
        return {Exact::Integer(a.mantissa_ + b.mantissa_), a.exponent_};
    }
    const Exact& high = a.exponent_ > b.exponent_ ? a : b;
    const Exact& low = a.exponent_ > b.exponent_ ? b : a;
    Exact::Integer sum = high.mantissa_ << (high.exponent_ - low.exponent_);
    sum += low.mantissa_;
    return {std::move(sum), low.exponent_};
}

Exact operator-(const Exact& a, const Exact& b) { return a + (-b); }

Exact operator*(const Exact& a, const Exact& b) {
    if (a.mantissa_.is_zero() || b.mantissa_.is_zero()) {
        return {};
    }
    return {Exact::Integer(a.mantissa_ * b.mantissa_), a.exponent_ + b.exponent_};
}

Rounding rounded_quotient(const Exact& numerator, const Exact& denominator) {
    if (numerator.sign() == 0) {
        return {};
    }
    const Exact::Integer n = mp::abs(numerator.mantissa_);
    const Exact::Integer d = mp::abs(denominator.mantissa_);
    const std::int64_t shift = std::max<std::int64_t>(0, kEnoughBits + 1 + bits_of(d) - bits_of(n));
    Exact::Integer whole;
    Exact::Integer rest;
    mp::divide_qr(shifted(n, shift), d, whole, rest);
    const Rounding out =
        round_positive(whole, !rest.is_zero(), numerator.exponent_ - denominator.exponent_ - shift);
    return numerator.sign() == denominator.sign() ? out : negated(out);
}

Rounding rounded_root(const Exact& numerator, const Exact& denominator) {
    if (numerator.sign() == 0) {
        return {};
    }
    const Exact::Integer& n = numerator.mantissa_;
    const Exact::Integer& d = denominator.mantissa_;
    // floor(sqrt(floor(x))) = floor(sqrt(x)); the exponent must be even.
    std::int64_t shift = std::max<std::int64_t>(0, 2 * kEnoughBits + 2 + bits_of(d) - bits_of(n));
    const std::int64_t exponent = numerator.exponent_ - denominator.exponent_;
    shift += (exponent - shift) & 1;
    Exact::Integer whole;
    Exact::Integer rest;
    mp::divide_qr(shifted(n, shift), d, whole, rest);
    Exact::Integer left;
    const Exact::Integer root = mp::sqrt(whole, left);
    return round_positive(root, !rest.is_zero() || !left.is_zero(), (exponent - shift) / 2);
}

}  // namespace geomsrv
