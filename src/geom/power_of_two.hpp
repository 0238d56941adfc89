// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
// Scaling that rounds nothing.  No algorithm lives here.
#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>

#include "geom/vec.hpp"

namespace geomsrv {

/// 2^exponent as two factors that are both normal numbers; products by it are exact unless the result itself
/// leaves the range of double.  Exponents beyond +-2044 are cut there, where every product is 0 or infinite
/// anyway.
struct PowerOfTwo {
    double first = 1.0, second = 1.0;
    PowerOfTwo() = default;
    explicit PowerOfTwo(int exponent)
        : first(normal(exponent / 2)), second(normal(exponent - exponent / 2)) {}
    double operator*(double value) const { return value * first * second; }
    Vec3 operator*(Vec3 v) const { return {*this * v.x, *this * v.y, *this * v.z}; }

private:
    static double normal(int exponent) {
        constexpr int kBias = 1023, kMantissaBits = 52;
        const int biased = std::clamp(exponent, -1022, 1022) + kBias;
        return std::bit_cast<double>(static_cast<std::uint64_t>(biased) << kMantissaBits);
    }
};

/// Exponent of the leading bit; too large for subnormal numbers, which is as good here.
inline int exponent_of(double x) {
    return static_cast<int>(std::bit_cast<std::uint64_t>(x) >> 52 & 0x7ff) - 1023;
}

}  // namespace geomsrv
