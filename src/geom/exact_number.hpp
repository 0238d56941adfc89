// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
// Numbers without rounding, and their correctly rounded quotients and roots.  The last rung of every ladder:
// what a filter cannot decide is decided here.
#pragma once

#include <cstdint>

// Boost's headers are the only thing of others in the core; big integers are not our trade.
#include <boost/multiprecision/cpp_int.hpp>

namespace geomsrv {

/// A number rounded three ways: to nearest (ties to even), down and up.  The last two are equal if the number
/// is a double, else neighbours; beyond the range of double, the largest double and infinity.
struct Rounding {
    double nearest = 0.0;
    double lower = 0.0;
    double upper = 0.0;
};

/// A whole number times a power of two, which is what sums, differences and products of doubles are.
///
/// Costs some 20 to 50 ns per operation while it fits in 256 bits, where nothing is allocated: enough for six
/// factors of 40 bits, as in scenes on a grid.  Any longer number is right too, only slower.
class Exact {
public:
    Exact() = default;
    /// REQUIRES: finite.
    Exact(double x);  // NOLINT: a double is an exact number

    [[nodiscard]] int sign() const { return mantissa_.sign(); }
    [[nodiscard]] Exact magnitude() const { return mantissa_.sign() < 0 ? -*this : *this; }

    friend Exact operator+(const Exact& a, const Exact& b);
    friend Exact operator-(const Exact& a, const Exact& b);
    friend Exact operator*(const Exact& a, const Exact& b);
    friend Exact operator-(const Exact& a) { return {Integer(-a.mantissa_), a.exponent_}; }

    friend Rounding rounded_quotient(const Exact& numerator, const Exact& denominator);
    friend Rounding rounded_root(const Exact& numerator, const Exact& denominator);

private:
    static constexpr unsigned kInlineBits = 256;
    using Integer = boost::multiprecision::number<
        boost::multiprecision::cpp_int_backend<kInlineBits, 0, boost::multiprecision::signed_magnitude,
                                               boost::multiprecision::unchecked>,
        boost::multiprecision::et_off>;

    Exact(Integer mantissa, std::int64_t exponent) : mantissa_(std::move(mantissa)), exponent_(exponent) {}

    Integer mantissa_;
    std::int64_t exponent_ = 0;
};

inline bool operator<(const Exact& a, const Exact& b) { return (a - b).sign() < 0; }
inline bool operator==(const Exact& a, const Exact& b) { return (a - b).sign() == 0; }

/// numerator / denominator.  REQUIRES: denominator != 0.
Rounding rounded_quotient(const Exact& numerator, const Exact& denominator);

/// sqrt(numerator / denominator).  REQUIRES: numerator >= 0, denominator > 0.
Rounding rounded_root(const Exact& numerator, const Exact& denominator);

}  // namespace geomsrv
