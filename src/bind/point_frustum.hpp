// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
// What the batch loops of distances from frusta share.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "geom/exact_number.hpp"
#include "geom/point_frustum.hpp"

namespace geomsrv::bind {

/// Where answers go; `region` and `nearest` are null if they are not found.
struct PointAnswers {
    double *distance, *lower, *upper;
    std::uint8_t* region;
    double* nearest;

    void put(std::size_t i, const Rounding& found) const {
        distance[i] = found.nearest;
        lower[i] = found.lower;
        upper[i] = found.upper;
    }
    template <int Sides>
    void put(std::size_t i, const PointDistance<Sides>& found) const {
        put(i, Rounding{found.distance, found.lower, found.upper});
        region[i] = found.region;
        if (nearest != nullptr) std::copy_n(found.nearest, Sides + 1, nearest + (Sides + 1) * i);
    }
    /// Those from point i on, in `dimension` coordinates.
    [[nodiscard]] PointAnswers from(std::size_t i, std::size_t dimension) const {
        return {distance + i, lower + i, upper + i, region == nullptr ? nullptr : region + i,
                nearest == nullptr ? nullptr : nearest + dimension * i};
    }
};

/// measure(rows, count, answers, fresh) for as many points as fill whole groups; the last few, `fresh` of
/// them, fill one by repetition.
template <std::size_t Group, int Sides, class Measure>
void in_groups(const double* points, std::size_t count, PointAnswers out, const Measure& measure) {
    constexpr std::size_t kDimension = Sides + 1;
    const std::size_t whole = count - count % Group, rest = count - whole;
    if (whole > 0) measure(points, whole, out, whole);
    if (rest == 0) return;
    double padded[Group * kDimension], values[3][Group], nearest[Group * kDimension];
    std::uint8_t region[Group];
    for (std::size_t k = 0; k < Group; ++k) {
        std::copy_n(points + kDimension * std::min(whole + k, count - 1), kDimension,
                    padded + kDimension * k);
    }
    const PointAnswers last = out.from(whole, kDimension);
    measure(padded, Group,
            PointAnswers{values[0], values[1], values[2], last.region == nullptr ? nullptr : region,
                         last.nearest == nullptr ? nullptr : nearest},
            rest);
    std::copy_n(values[0], rest, last.distance);
    std::copy_n(values[1], rest, last.lower);
    std::copy_n(values[2], rest, last.upper);
    if (last.region != nullptr) std::copy_n(region, rest, last.region);
    if (last.nearest != nullptr) std::copy_n(nearest, rest * kDimension, last.nearest);
}

/// How many points each stage answered.
struct PointRungs {
    std::int64_t bound = 0, filter = 0, wide = 0, exact = 0;
};

/// At the tier "exact".
template <int Sides>
PointRungs measure_exactly(const View<Sides>& view, const double* points, std::size_t count,
                           PointAnswers out);

/// Proofs, (n, 4, 2): pairs of a corner and the only vertex of the point; the hull of the corners holds the
/// nearest point.  Rows that are not needed are -1.  `region`: the right ones, or `guessed`, or null.
template <int Sides>
void find_simplices(const View<Sides>& view, const double* points, std::size_t count,
                    const std::uint8_t* region, bool guessed, std::int32_t* simplex);

}  // namespace geomsrv::bind
