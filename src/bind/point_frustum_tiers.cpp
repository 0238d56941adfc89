// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
// Distances from frusta at the tiers "exact", "float32" and "bound".
#include <algorithm>
#include <cstdint>

#include "bind/arrays.hpp"
#include "bind/module.hpp"
#include "bind/views.hpp"
#include "geom/point_frustum_exact.hpp"
#include "geom/point_frustum_wide.hpp"

namespace geomsrv::bind {

namespace {

/// How many points each stage answered.
struct Rungs {
    std::int64_t filter = 0, wide = 0, exact = 0;
};

/// Where answers go.
struct Distances {
    double *distance, *lower, *upper;
    std::uint8_t* region;

    void put(std::size_t i, const Rounding& found) const {
        distance[i] = found.nearest;
        lower[i] = found.lower;
        upper[i] = found.upper;
    }
    [[nodiscard]] Distances from(std::size_t i) const {
        return {distance + i, lower + i, upper + i, region + i};
    }
};

template <int Sides>
void settle(const ExactPointFrustum<Sides>& frustum, const double* point, int guess, std::size_t i,
            Distances out, Rungs& rungs) {
    const ExactPointDistance found = frustum.distance(point, guess);
    out.put(i, found.distance);
    out.region[i] = found.region;
    rungs.wide += found.rung == Rung::exact ? 0 : 1;
    rungs.exact += found.rung == Rung::exact ? 1 : 0;
}

/// Points that go through both steps together: all of the first, then all of the second, since more of
/// several short chains of operations overlap than of long ones.
constexpr int kBlock = 64;

/// What is known of a block besides the answers.
template <int Sides>
struct Block {
    Residuals<Sides, kBlock> residuals;
    std::int64_t proven[kBlock];  ///< whether the answer is: -1 or 0
    bool all_proven;
    std::int64_t inside;  ///< how many are, proven or not
};

template <class Kinds, bool Skewed, class Arithmetic, int Sides>
GEOMSRV_INLINE void measure_block(const DistanceFrame<Lanes, Sides>& frame, const WideFrame<Sides>& wide,
                                  const double* points, std::size_t count, Distances out,
                                  Block<Sides>& block) {
    constexpr std::size_t kDimension = Sides + 1;
    for (std::size_t i = 0; i < count; i += Lanes::kCount) {
        const FourRows<kDimension> point(points + kDimension * i);
        residual<Kinds, Skewed, Arithmetic>(frame, wide, point.at, i, block.residuals);
    }
    LaneMask proven(~LaneMask::Vector{});
    LaneMask::Vector minus_inside{};
    for (std::size_t i = 0; i < count; i += Lanes::kCount) {
        const WideDistance<Sides> found = length<Arithmetic>(wide, block.residuals, i);
        found.distance.store(out.distance + i);
        found.lower.store(out.lower + i);
        found.upper.store(out.upper + i);
        store(found.proven, block.proven + i);
        proven = proven & found.proven;
        minus_inside += found.inside.v;
    }
    for (std::size_t i = 0; i < count; ++i) {
        out.region[i] = static_cast<std::uint8_t>(block.residuals.region[i]);
    }
    block.all_proven = all(proven);
    block.inside = -(minus_inside[0] + minus_inside[1] + minus_inside[2] + minus_inside[3]);
}

template <class Kinds, bool Skewed, int Sides>
GEOMSRV_FUSED void measure_fused(const DistanceFrame<Lanes, Sides>& frame, const WideFrame<Sides>& wide,
                                 const double* points, std::size_t count, Distances out,
                                 Block<Sides>& block) {
    measure_block<Kinds, Skewed, OneRounding>(frame, wide, points, count, out, block);
}
template <class Kinds, bool Skewed, int Sides>
void measure_plain(const DistanceFrame<Lanes, Sides>& frame, const WideFrame<Sides>& wide,
                   const double* points, std::size_t count, Distances out, Block<Sides>& block) {
    measure_block<Kinds, Skewed, TwoRoundings>(frame, wide, points, count, out, block);
}

/// Points that the block left.
template <int Sides>
void settle_block(const ExactPointFrustum<Sides>& exact, const Block<Sides>& block, const double* points,
                  std::size_t count, Distances out, Rungs& rungs) {
    for (std::size_t i = 0; i < count; ++i) {
        if (block.proven[i] != 0) continue;
        const double* const point = points + (Sides + 1) * i;
        const int region = out.region[i];
        Rounding found;
        if (block.residuals.proven[i] != 0 &&
            (exact.along_axis(point, region, found) || exact.wide_distance(point, region, found))) {
            out.put(i, found);
            continue;
        }
        (region == 0 ? rungs.filter : rungs.wide) -= 1;
        settle(exact, point, region, i, out, rungs);
    }
}

template <class Kinds, bool Skewed, int Sides>
Rungs measure_blocks(const View<Sides>& view, const DistanceFrame<Lanes, Sides>& frame,
                     const ExactPointFrustum<Sides>& exact, const double* points, std::size_t count,
                     Distances out) {
    constexpr std::size_t kDimension = Sides + 1;
    const WideFrame<Sides> wide = wide_frame(view, frame);
    const auto measure = has_fused() ? measure_fused<Kinds, Skewed, Sides> : measure_plain<Kinds, Skewed, Sides>;
    Block<Sides> block;
    Rungs rungs;
    for (std::size_t first = 0; first < count;) {
        const double* const rows = points + kDimension * first;
        const Distances answers = out.from(first);
        std::size_t size = std::min<std::size_t>(count - first, kBlock);
        if (size >= Lanes::kCount) {
            size -= size % Lanes::kCount;
            measure(frame, wide, rows, size, answers, block);
        } else {
            // The last few points fill a group by repetition.
            double padded[Lanes::kCount * kDimension], values[3][Lanes::kCount];
            std::uint8_t region[Lanes::kCount];
            for (std::size_t k = 0; k < Lanes::kCount; ++k) {
                std::copy_n(rows + kDimension * std::min(k, size - 1), kDimension, padded + kDimension * k);
            }
            measure(frame, wide, padded, Lanes::kCount, {values[0], values[1], values[2], region}, block);
            std::copy_n(values[0], size, answers.distance);
            std::copy_n(values[1], size, answers.lower);
            std::copy_n(values[2], size, answers.upper);
            std::copy_n(region, size, answers.region);
            block.inside = std::count(region, region + size, std::uint8_t{0});
        }
        rungs.filter += block.inside;
        rungs.wide += static_cast<std::int64_t>(size) - block.inside;
        if (!block.all_proven) settle_block(exact, block, rows, size, answers, rungs);
        first += size;
    }
    return rungs;
}

template <int Sides>
Rungs measure_exactly(const View<Sides>& view, const ExactPointFrustum<Sides>& exact, const double* points,
                      std::size_t count, Distances out) {
    Rungs rungs;
    if (!is_ordinary(view)) {
        const auto frame = distance_frame<long double>(view);
        for (std::size_t i = 0; i < count; ++i) {
            const double* const point = points + (Sides + 1) * i;
            settle(exact, point, distance_in_long_double(frame, point).region, i, out, rungs);
        }
        return rungs;
    }
    const auto frame = distance_frame<Lanes>(view);
    with_windows(frame, [&](auto kinds) {
        using Kinds = decltype(kinds);
        rungs = (frame.refinements > 0 ? measure_blocks<Kinds, true, Sides>
                                       : measure_blocks<Kinds, false, Sides>)(view, frame, exact, points,
                                                                              count, out);
    });
    return rungs;
}

/// Corners of the frustum that prove a distance, as pairs with the point's only vertex.  In the plane there
/// is no bit for up.
template <int Sides>
void put_simplex(const Witness& simplex, std::int32_t* out) {
    for (int k = 0; k < 4; ++k) {
        const int corner = Sides == 2 ? simplex.a[k] : (simplex.a[k] & 1) + (simplex.a[k] >> 2) * 2;
        out[2 * k] = k < simplex.count ? corner : -1;
        out[2 * k + 1] = k < simplex.count ? 0 : -1;
    }
}

template <int Sides, class Packed, class Points>
nb::object exact_batch(const Packed& packed, const Points& points, bool witness, bool evidence) {
    constexpr std::size_t kDimension = Sides + 1;
    const std::size_t count = points.shape(0);
    auto distance = empty<double>({count}), lower = empty<double>({count}), upper = empty<double>({count});
    auto region = empty<std::uint8_t>({count});
    Output<double> nearest{nb::none()};
    Output<std::int32_t> simplex{nb::none()};
    if (witness) nearest = empty<double>({count, kDimension});
    if (evidence) simplex = empty<std::int32_t>({count, 4, 2});
    Rungs rungs;
    {
        const nb::gil_scoped_release unlocked;
        const auto view = unpack_view<Sides>(packed.data());
        const ExactPointFrustum<Sides> exact(view);
        rungs = measure_exactly(view, exact, points.data(), count,
                                {distance.data, lower.data, upper.data, region.data});
        for (std::size_t i = 0; witness && i < count; ++i) {
            exact.nearest(points.data() + kDimension * i, region.data[i], nearest.data + kDimension * i);
        }
        for (std::size_t i = 0; evidence && i < count; ++i) {
            put_simplex<Sides>(exact.simplex(points.data() + kDimension * i, region.data[i]),
                               simplex.data + 8 * i);
        }
    }
    return nb::make_tuple(distance.array, lower.array, upper.array, region.array, nearest.array, simplex.array,
                          nb::make_tuple(rungs.filter, rungs.wide, rungs.exact));
}

}  // namespace

void define_point_frustum_tiers(nb::module_& m) {
    m.def("distance_to_frustum_exact", exact_batch<2, PackedFrustum, Rows3>, nb::arg("frustum").noconvert(),
          nb::arg("points").noconvert(), nb::arg("witness"), nb::arg("evidence"));
    m.def("distance_to_frustum_exact_2d", exact_batch<1, PackedFrustum2D, Rows2>,
          nb::arg("frustum").noconvert(), nb::arg("points").noconvert(), nb::arg("witness"),
          nb::arg("evidence"));
}

}  // namespace geomsrv::bind
