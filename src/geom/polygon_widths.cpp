// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
#include "geom/polygon_widths.hpp"

#include <limits>

#include "geom/lanes.hpp"
#include "geom/rounding.hpp"

namespace geomsrv {

namespace {

constexpr std::size_t kLanes = Lanes::kCount;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

// Relative error of gap/|D| once the gap is known to its gap_error: squares and their sum 3 units of
// kUnitRoundoff, halved by the root, root, quotient; the rest covers the bound.
constexpr double kWidthError = 5.0 * kUnitRoundoff;

}  // namespace

GEOMSRV_WIDE_CLONES Widest widths_of(const PolygonPair& pair) {
    const Lanes zero = 0.0;
    Lanes widest = -kInfinity;
    LaneMask overlap = zero <= zero;
    for (const int i : {0, 1}) {
        const PairedPolygon& p = pair.side(i);
        for (std::size_t k = 0; k < p.axes; k += kLanes) {
            const Lanes dx = Lanes::load(p.dx + k);
            const Lanes dy = Lanes::load(p.dy + k);
            const Lanes gap = Lanes::load(p.gap + k);
            const Lanes error =
                Lanes(pair.gap_error()) * (magnitude(dx) + magnitude(dy)) + Lanes(kPairUnderflow);
            const Lanes length = square_root(dx * dx + dy * dy);
            const LaneMask is_long = Lanes(kShortestAxis) < length;
            const Lanes least = (gap - error) / length;
            const Lanes most = (gap + error) / length;
            widest = greater(widest, select(is_long, least - kWidthError * magnitude(least), -kInfinity));
            select(is_long, most + kWidthError * magnitude(most), kInfinity).store(p.work[0] + k);
            (gap + error).store(p.work[1] + k);
            overlap = overlap & (gap + error < zero);
        }
    }
    return {greatest(widest), all(overlap)};
}

}  // namespace geomsrv
