// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
#include "geom/point_frustum_exact.hpp"

#include "bind/point_frustum.hpp"
#include "bind/views.hpp"
#include "geom/point_frustum_wide.hpp"

namespace geomsrv::bind {

namespace {

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
                                  const double* points, std::size_t count, PointAnswers out,
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
                                 const double* points, std::size_t count, PointAnswers out,
                                 Block<Sides>& block) {
    measure_block<Kinds, Skewed, OneRounding>(frame, wide, points, count, out, block);
}
template <class Kinds, bool Skewed, int Sides>
void measure_plain(const DistanceFrame<Lanes, Sides>& frame, const WideFrame<Sides>& wide,
                   const double* points, std::size_t count, PointAnswers out, Block<Sides>& block) {
    measure_block<Kinds, Skewed, TwoRoundings>(frame, wide, points, count, out, block);
}

/// A frustum at all rungs.
template <int Sides>
struct Ladder {
    DistanceFrame<Lanes, Sides> frame;
    WideFrame<Sides> wide;
    ExactPointFrustum<Sides> exact;

    explicit Ladder(const View<Sides>& view)
        : frame(distance_frame<Lanes>(view)), wide(wide_frame(view, frame)), exact(view) {}
};

template <int Sides>
void settle(const ExactPointFrustum<Sides>& frustum, const double* point, int guess, std::size_t i,
            PointAnswers out, PointRungs& rungs) {
    const ExactPointDistance found = frustum.distance(point, guess);
    out.put(i, found.distance);
    out.region[i] = found.region;
    (found.rung == Rung::exact ? rungs.exact : rungs.wide) += 1;
}

/// Points that the block left.
template <int Sides>
void settle_block(const ExactPointFrustum<Sides>& exact, const Block<Sides>& block, const double* points,
                  std::size_t count, PointAnswers out, PointRungs& rungs) {
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
PointRungs measure_blocks(const Ladder<Sides>& ladder, const double* points, std::size_t count,
                          PointAnswers out) {
    constexpr std::size_t kDimension = Sides + 1;
    const auto measure =
        has_fused() ? measure_fused<Kinds, Skewed, Sides> : measure_plain<Kinds, Skewed, Sides>;
    Block<Sides> block;
    PointRungs rungs;
    in_groups<Lanes::kCount, Sides>(
        points, count, out,
        [&](const double* rows, std::size_t size, PointAnswers answers, std::size_t fresh) {
            for (std::size_t first = 0; first < size; first += kBlock) {
                const double* const part = rows + kDimension * first;
                const PointAnswers found = answers.from(first, kDimension);
                const std::size_t length = std::min<std::size_t>(size - first, kBlock);
                const std::size_t counted = std::min(fresh - first, length);
                measure(ladder.frame, ladder.wide, part, length, found, block);
                if (counted < length) {
                    block.inside = std::count(found.region, found.region + counted, std::uint8_t{0});
                }
                rungs.filter += block.inside;
                rungs.wide += static_cast<std::int64_t>(counted) - block.inside;
                if (!block.all_proven) settle_block(ladder.exact, block, part, counted, found, rungs);
            }
        });
    return rungs;
}

}  // namespace

template <int Sides>
PointRungs measure_exactly(const View<Sides>& view, const double* points, std::size_t count,
                           PointAnswers out) {
    constexpr std::size_t kDimension = Sides + 1;
    const Ladder<Sides> ladder(view);
    PointRungs rungs;
    if (is_ordinary(view)) {
        with_windows(ladder.frame, [&](auto kinds) {
            using Kinds = decltype(kinds);
            const auto measure = ladder.frame.refinements > 0 ? measure_blocks<Kinds, true, Sides>
                                                              : measure_blocks<Kinds, false, Sides>;
            rungs = measure(ladder, points, count, out);
        });
    } else {
        const auto frame = distance_frame<long double>(view);
        for (std::size_t i = 0; i < count; ++i) {
            const double* const point = points + kDimension * i;
            settle(ladder.exact, point, distance_in_long_double(frame, point).region, i, out, rungs);
        }
    }
    for (std::size_t i = 0; out.nearest != nullptr && i < count; ++i) {
        ladder.exact.nearest(points + kDimension * i, out.region[i], out.nearest + kDimension * i);
    }
    return rungs;
}

template <int Sides>
void find_simplices(const View<Sides>& view, const double* points, std::size_t count,
                    const std::uint8_t* region, bool guessed, std::int32_t* simplex) {
    const ExactPointFrustum<Sides> exact(view);
    for (std::size_t i = 0; i < count; ++i, simplex += 8) {
        const double* const point = points + (Sides + 1) * i;
        const int likely = region == nullptr ? 0 : region[i];
        const Witness found = guessed ? exact.distance(point, likely).simplex : exact.simplex(point, likely);
        for (int k = 0; k < 4; ++k) {
            // A corner in the plane has no bit for up.
            const int corner = Sides == 2 ? found.a[k] : (found.a[k] & 1) + (found.a[k] >> 2) * 2;
            simplex[2 * k] = k < found.count ? corner : -1;
            simplex[2 * k + 1] = k < found.count ? 0 : -1;
        }
    }
}

template PointRungs measure_exactly(const View<1>&, const double*, std::size_t, PointAnswers);
template PointRungs measure_exactly(const View<2>&, const double*, std::size_t, PointAnswers);
template void find_simplices(const View<1>&, const double*, std::size_t, const std::uint8_t*, bool,
                             std::int32_t*);
template void find_simplices(const View<2>&, const double*, std::size_t, const std::uint8_t*, bool,
                             std::int32_t*);

}  // namespace geomsrv::bind
