// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
// The unit roundoff and neighbouring doubles, to turn rounded results into bounds.  No algorithm lives here.
#pragma once

#include <bit>
#include <cmath>
#include <cstdint>

namespace geomsrv {

/// Unit roundoff u of double: |fl(x op y) - x op y| <= u |x op y|, unless the result underflows.
inline constexpr double kUnitRoundoff = 0x1p-53;

/// The next double towards +infinity, in a few instructions where std::nextafter is a library call.  x must
/// not be NaN; +infinity stays.
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
