// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
#include "geom/point_frustum.hpp"

#include <algorithm>
#include <limits>
#include <type_traits>

namespace geomsrv {

namespace {

static_assert(std::numeric_limits<long double>::max_exponent >= 16 * 1024,
              "squares of ratios of doubles must be representable");

// Entries of the Gram matrix are off by at most 4u (2 products' worth of roundings of numbers up to 1), the
// Frobenius norm of a 3 x 3 matrix of them by 12u.
constexpr double kGramError = 12.0 * kUnitRoundoff;

// Each projection beyond the first shrinks what the defect of the axes does to the answer by the norm of the
// defect.
constexpr double kMaxContraction = 0x1p-48;

template <class Real, int Size>
Rows<Real, Size> gram_defect(const Rows<double, Size>& axes) {
    Rows<Real, Size> defect;
    for (int i = 0; i < Size; ++i) {
        for (int j = 0; j < Size; ++j) {
            Real sum = i == j ? -1.0 : 0.0;
            for (int k = 0; k < Size; ++k) sum += Real(axes.row[i][k]) * Real(axes.row[j][k]);
            defect.row[i][j] = sum;
        }
    }
    return defect;
}

}  // namespace

template <class Number, int Sides>
DistanceFrame<Number, Sides> distance_frame(const View<Sides>& view) {
    using Real = std::conditional_t<std::is_same_v<Number, Lanes>, double, Number>;
    DistanceFrame<Number, Sides> frame;
    const int exponent = std::ilogb(view.near);
    const Real scaled_near = std::scalbn(Real(view.near), -exponent);
    const auto dual = dual_basis<Real>(view.axes);
    const auto defect = gram_defect<Real>(view.axes);
    Real low[Sides], high[Sides], mirror[Sides + 1];
    bool all_centred = true;
    for (int i = 0; i < Sides; ++i) {
        // A window beyond the axis is mirrored to the positive side, if need be.
        const bool mirrored = view.high[i] < 0.0;
        mirror[i] = mirrored ? -1.0 : 1.0;
        low[i] = std::scalbn(Real(mirrored ? -view.high[i] : view.low[i]), -exponent);
        high[i] = std::scalbn(Real(mirrored ? -view.low[i] : view.high[i]), -exponent);
        frame.window[i] = low[i] > 0.0         ? Window::beyond
                          : low[i] == -high[i] ? Window::centred
                                               : Window::around;
        all_centred &= frame.window[i] == Window::centred;
        const Real left_code = i == 0 ? 1.0 : 3.0, right_code = 2.0 * left_code;
        frame.high_code[i] = mirrored ? right_code : left_code;
        frame.low_code[i] = mirrored ? left_code : right_code;
        frame.low[i] = low[i];
        frame.high[i] = high[i];
        frame.low_slope[i] = low[i] / scaled_near;
        frame.high_slope[i] = high[i] / scaled_near;
        frame.low_room[i] = 1 / (std::fabs(low[i]) + scaled_near);
        frame.high_room[i] = 1 / (std::fabs(high[i]) + scaled_near);
    }
    mirror[Sides] = 1.0;
    frame.view = scaled_near;
    frame.near = Real(view.near);
    frame.far = Real(view.far);

    Real squares = 0.0;
    for (int i = 0; i <= Sides; ++i) {
        frame.origin[i] = Real(view.origin[i]);
        for (int k = 0; k <= Sides; ++k) {
            frame.axes.row[i][k] = mirror[i] * view.axes.row[i][k];
            frame.dual.row[i][k] = mirror[i] * dual.row[i][k];
            frame.defect.row[i][k] = mirror[i] * mirror[k] * defect.row[i][k];
            squares += defect.row[i][k] * defect.row[i][k];
        }
    }
    const double norm = static_cast<double>(std::sqrt(squares)) + kGramError;
    double remaining = norm;
    while (remaining > kMaxContraction) {
        remaining *= norm;
        ++frame.refinements;
    }
    frame.relative_error = Real(kDistanceError + 2.0 * remaining);

    // Roots in the order in which `project` counts them: S of side 0 fastest, then S of side 1; T likewise
    // within.
    int min_count[2] = {1, 1}, max_count[2] = {1, 1};
    for (int i = 0; i < Sides; ++i) {
        if (!all_centred && frame.window[i] == Window::centred)
            frame.window[i] = Window::around;  // see with_windows
        min_count[i] = min_choices(frame.window[i]);
        max_count[i] = max_choices(frame.window[i]);
    }
    const int s_count = min_count[0] * min_count[1], t_count = max_count[0] * max_count[1];
    for (int s = 0; s < s_count; ++s) {
        for (int t = 0; t < t_count; ++t) {
            const int from_s[2] = {s % min_count[0], s / min_count[0]},
                      from_t[2] = {t % max_count[0], t / max_count[0]};
            // In units of scaled_near: (near^2 z + near sum k x) / (near^2 + sum k^2).
            Real side[2] = {0.0, 0.0}, total = scaled_near * scaled_near;
            auto& root = frame.roots[s * t_count + t];
            root.code = 0.0;
            for (int i = 0; i < Sides; ++i) {
                // S holds no slope, the low one or the high one, in this order as far as the window has them;
                // T none or low.
                const bool low_in_s = from_s[i] == 1 && min_count[i] == 3,
                           high_in_s = from_s[i] > 0 && !low_in_s;
                if (low_in_s || from_t[i] > 0) {
                    side[i] += low[i];
                    total += low[i] * low[i];
                    root.code = root.code + frame.low_code[i];
                }
                if (high_in_s) {
                    side[i] += high[i];
                    total += high[i] * high[i];
                    root.code = root.code + frame.high_code[i];
                }
            }
            root.depth = scaled_near * scaled_near / total;
            for (int i = 0; i < Sides; ++i) root.side[i] = scaled_near * side[i] / total;
        }
    }
    return frame;
}

// Depths and windows in these ranges, and slopes (window over near) up to kLargestSlope, keep what is formed
// of them in the normal range of double: squares of slopes (2^400), and lengths times slopes (2^700).
constexpr double kSmallestDepth = 0x1p-400;
constexpr double kLargestDepth = 0x1p500;
constexpr double kLargestWindow = 0x1p400;
constexpr double kLargestSlope = 0x1p200;

template <int Sides>
bool is_ordinary(const View<Sides>& view) {
    double window = 0.0;
    for (int i = 0; i < Sides; ++i)
        window = std::max({window, std::fabs(view.low[i]), std::fabs(view.high[i])});
    return view.near >= kSmallestDepth && view.far <= kLargestDepth && window <= kLargestWindow &&
           window <= kLargestSlope * view.near;
}

namespace {

/// Region by the root that decides the depth.  For very steep sides the point found may be on a side in exact
/// arithmetic only, by a part of its coordinates far below roundoff.
template <class Kinds, int Sides>
long double region_of_depth(const DistanceFrame<long double, Sides>& frame,
                            const Coordinates<long double, Sides>& p) {
    const auto depth_of = [&](const auto& root) {
        long double depth = root.depth * p.at[Sides];
        for (int i = 0; i < Sides; ++i) {
            depth += root.side[i] * (Kinds::kKind[i] == Window::centred ? std::fabs(p.at[i]) : p.at[i]);
        }
        return depth;
    };
    const auto* deepest = &frame.roots[0];
    for (int s = 0; s < Kinds::kMin; ++s) {
        const auto* const first = &frame.roots[s * Kinds::kMax];
        const auto* const least =
            std::min_element(first, first + Kinds::kMax,
                             [&](const auto& a, const auto& b) { return depth_of(a) < depth_of(b); });
        if (s == 0 || depth_of(*least) > depth_of(*deepest)) deepest = least;
    }
    const int code = static_cast<int>(deepest->code);
    int region = 0;
    for (int i = 0, place = 1; i < Sides; ++i, place *= 3) {
        const int digit = code / place % 3;
        // A centred window has roots for positive x, where the code is 1.
        const bool other = Kinds::kKind[i] == Window::centred && digit > 0 && p.at[i] < 0.0L;
        region += place * (other ? 2 : digit);
    }
    return region;
}

template <class Kinds, int Sides>
PointDistance<Sides> nearest_point(const DistanceFrame<long double, Sides>& frame, const double* point) {
    long double position[Sides + 1];
    for (int k = 0; k <= Sides; ++k) position[k] = point[k];
    const auto found = distance_to_frustum<Kinds, true>(frame, position);
    const auto nearest = nearest_in_world(frame, position, found);
    // Rounded outwards: the nearest double, then one step if that went the wrong way.
    const auto below = [](long double x) {
        const double rounded = static_cast<double>(x);
        return rounded > x ? std::nextafter(rounded, -std::numeric_limits<double>::infinity()) : rounded;
    };
    PointDistance<Sides> answer{};
    answer.distance = static_cast<double>(found.distance);
    answer.lower = below(found.lower);
    answer.upper = -below(-found.upper);
    answer.region =
        static_cast<std::uint8_t>(found.region > 0.0L || found.distance <= 0.0L
                                      ? found.region
                                      : region_of_depth<Kinds>(frame, to_frustum(frame, position)));
    for (int k = 0; k <= Sides; ++k) answer.nearest[k] = static_cast<double>(nearest.at[k]);
    return answer;
}

}  // namespace

template <int Sides>
PointDistance<Sides> distance_in_long_double(const DistanceFrame<long double, Sides>& frame,
                                             const double* point) {
    return with_windows(frame, [&](auto kinds) { return nearest_point<decltype(kinds)>(frame, point); });
}

template DistanceFrame<Lanes, 1> distance_frame(const View<1>&);
template DistanceFrame<Lanes, 2> distance_frame(const View<2>&);
template DistanceFrame<long double, 1> distance_frame(const View<1>&);
template DistanceFrame<long double, 2> distance_frame(const View<2>&);
template bool is_ordinary(const View<1>&);
template bool is_ordinary(const View<2>&);
template PointDistance<1> distance_in_long_double(const DistanceFrame<long double, 1>&, const double*);
template PointDistance<2> distance_in_long_double(const DistanceFrame<long double, 2>&, const double*);

}  // namespace geomsrv
