// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
#include "geom/point_frustum_wide.hpp"

#include <algorithm>

#include "geom/double_double.hpp"

namespace geomsrv {

namespace {

Halves<Lanes> halved_entry(double x) {
    // A sum with it has no bits below kAxisUnit: what is added is rounded to whole units.
    constexpr double kRounder = 1.5 * 0x1p52 * kAxisUnit;
    const double coarse = (kRounder + x) - kRounder;
    return {coarse, x - coarse};
}

/// window / near minus its rounding.  The product is split, which no ordinary view overflows; if a part of it
/// underflows, it counts for nothing.
double slope_rest(double window, double near) {
    const DoubleDouble missing = DoubleDouble{window, 0.0} - two_product(window / near, near);
    return missing.hi / near;
}

}  // namespace

template <int Sides>
WideFrame<Sides> wide_frame(const View<Sides>& view, const DistanceFrame<Lanes, Sides>& frame) {
    WideFrame<Sides> wide;
    for (int i = 0; i <= Sides; ++i) {
        for (int k = 0; k <= Sides; ++k) wide.minus_axes[i][k] = halved_entry(-frame.axes.row[i][k][0]);
    }
    double window = view.near, steep = 1.0;
    for (int i = 0; i < Sides; ++i) {
        const bool mirrored = frame.side[i].mirror < 0.0;
        const double low = mirrored ? -view.high[i] : view.low[i];
        const double high = mirrored ? -view.low[i] : view.high[i];
        const double most = std::max(std::fabs(low), std::fabs(high));
        wide.low_rest[i] = slope_rest(low, view.near);
        wide.high_rest[i] = slope_rest(high, view.near);
        window += most;
        steep += std::max(1.0, most / view.near);
    }
    constexpr double kAxesLength = 1.01;  // an axis is no longer, see MAX_AXES_DEFECT
    wide.window = kAxesLength * window;
    const double margin = kWideMargin + frame.relative_error[0];
    wide.margin = margin * steep;
    // Y is off by less than m times the margin in the depth and in the coordinates of inactive sides, and by
    // |slope| times that in the others: q P with P the power of two in the reach m < 2 P.  Where the error e
    // P passes Ziv's test, d > 2^53 e P, so what is lost to second order, (q P)^2 / 2 d, is at most 2^-54 q^2
    // P / e.  That and the first order together are e P for this e:
    // The 2^-54 of this derivation.
    constexpr double kSecondOrder = 0x1p-54;
    const double q = 2.0 * margin * steep;
    const double half = 0.5 * kWideError;
    wide.error = (half + std::sqrt(half * half + kSecondOrder * (q * q))) / kRounder;
    return wide;
}

template WideFrame<1> wide_frame(const View<1>&, const DistanceFrame<Lanes, 1>&);
template WideFrame<2> wide_frame(const View<2>&, const DistanceFrame<Lanes, 2>&);

}  // namespace geomsrv
