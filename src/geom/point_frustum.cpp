// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
#include "geom/point_frustum.hpp"

#include <algorithm>
#include <limits>
#include <type_traits>

#include "geom/rounding.hpp"

namespace geomsrv {

namespace {

static_assert(std::numeric_limits<long double>::max_exponent >= 16 * 1024,
              "squares of ratios of doubles must be representable");

// Entries of the Gram matrix are off by at most 4 u (1 product and 3 sums of terms that add up to 1), so the
// Frobenius norm of its difference from the identity by 12 u.
constexpr double kGramError = 12.0 * kUnitRoundoff;

// After k further projections the defect of the axes has changed the answer by at most its norm to the power
// k + 1, relative to the distance.  This is below what rounding leaves, and above the norm for axes that are
// orthonormal but for rounding, which need no further projection.
constexpr double kMaxContraction = 0x1p-48;
constexpr double kMaxFloatContraction = 0x1p-20;

/// double for lanes: a frame is prepared in plain numbers.
template <class Number>
using Plain = std::conditional_t<std::is_same_v<Number, long double>, long double, double>;

/// The same number in every lane.
template <class Number>
Number spread(Plain<Number> x) {
    if constexpr (std::is_same_v<Number, FloatLanes>) {
        return static_cast<float>(x);
    } else {
        return x;
    }
}

/// Side number `index` of a frustum, lengths scaled by 2^-exponent; mirrored to x > 0 if it lies on the other
/// side.
template <class Real, int Sides>
FrustumSide<Real> side_of(const View<Sides>& given, int index, int exponent) {
    const Real view = std::scalbn(Real(given.near), -exponent);
    const bool mirrored = given.high[index] < 0.0;
    const Real low = std::scalbn(Real(mirrored ? -given.high[index] : given.low[index]), -exponent);
    const Real high = std::scalbn(Real(mirrored ? -given.low[index] : given.high[index]), -exponent);
    const Real place = index == 0 ? 1.0 : 3.0, high_code = mirrored ? 2.0 : 1.0;
    return {.low_slope = low / view,
            .high_slope = high / view,
            .low = low,
            .high = high,
            .low_room = 1 / (std::fabs(low) + view),
            .high_room = 1 / (std::fabs(high) + view),
            .low_code = place * (3 - high_code),
            .high_code = place * high_code,
            .window = low > 0.0      ? Window::beyond
                      : low == -high ? Window::centred
                                     : Window::around,
            .mirror = mirrored ? -1.0 : 1.0};
}

template <class Number>
FrustumSide<Number> spread(const FrustumSide<Plain<Number>>& side) {
    const auto each = [](Plain<Number> x) { return spread<Number>(x); };
    return {each(side.low_slope), each(side.high_slope), each(side.low),
            each(side.high),      each(side.low_room),   each(side.high_room),
            each(side.low_code),  each(side.high_code),  side.window,
            side.mirror};
}

/// Root for choice s of S and t of T.  Choices count the sides like digits, the first side fastest.
template <class Number, int Sides>
DepthRoot<Number, Sides> root_of(const FrustumSide<Plain<Number>> (&sides)[Sides], Plain<Number> view, int s,
                                 int t) {
    using Real = Plain<Number>;
    // In units of view: (view^2 z + view sum k x) / (view^2 + sum k^2).
    Real sum[Sides], squares = view * view, code = 0.0;
    for (int i = 0; i < Sides; ++i) {
        const FrustumSide<Real>& side = sides[i];
        const auto [low, high] = slope_choice(side.window, s, t);
        s /= min_choices(side.window);
        t /= max_choices(side.window);
        const Real low_part = low ? side.low : Real(0.0), high_part = high ? side.high : Real(0.0);
        sum[i] = low_part + high_part;
        squares += low_part * low_part + high_part * high_part;
        code += (low ? side.low_code : Real(0.0)) + (high ? side.high_code : Real(0.0));
    }
    DepthRoot<Number, Sides> root;
    root.depth = spread<Number>(view * view / squares);
    for (int i = 0; i < Sides; ++i) root.side[i] = spread<Number>(view * sum[i] / squares);
    root.code = spread<Number>(code);
    return root;
}

/// Gram matrix of the axes minus the identity.
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
DistanceFrame<Number, Sides> distance_frame(const View<Sides>& given) {
    using Real = Plain<Number>;
    DistanceFrame<Number, Sides> frame;
    const int exponent = std::ilogb(given.near);
    const Real view = std::scalbn(Real(given.near), -exponent);
    frame.view = spread<Number>(view);
    frame.near = spread<Number>(given.near);
    frame.far = spread<Number>(given.far);

    FrustumSide<Real> sides[Sides];
    Real mirror[Sides + 1];
    mirror[Sides] = 1.0;
    bool all_centred = true;
    for (int i = 0; i < Sides; ++i) {
        sides[i] = side_of<Real>(given, i, exponent);
        mirror[i] = sides[i].mirror;
        all_centred &= sides[i].window == Window::centred;
    }
    int s_count = 1, t_count = 1;
    for (int i = 0; i < Sides; ++i) {
        if (sides[i].window == Window::centred && !all_centred) sides[i].window = Window::around;
        s_count *= min_choices(sides[i].window);
        t_count *= max_choices(sides[i].window);
        frame.side[i] = spread<Number>(sides[i]);
    }
    for (int k = 0; k < s_count * t_count; ++k) {
        frame.roots[k] = root_of<Number>(sides, view, k / t_count, k % t_count);
    }

    const auto dual = dual_basis<Real>(given.axes);
    const auto defect = gram_defect<Real>(given.axes);
    Real squares = 0.0;
    for (int i = 0; i <= Sides; ++i) {
        frame.origin[i] = spread<Number>(given.origin[i]);
        for (int k = 0; k <= Sides; ++k) {
            frame.axes.row[i][k] = spread<Number>(mirror[i] * given.axes.row[i][k]);
            frame.dual.row[i][k] = spread<Number>(mirror[i] * dual.row[i][k]);
            frame.defect.row[i][k] = spread<Number>(mirror[i] * mirror[k] * defect.row[i][k]);
            squares += defect.row[i][k] * defect.row[i][k];
        }
    }
    const double norm = static_cast<double>(std::sqrt(squares)) + kGramError;
    double remaining = norm;
    constexpr bool kSingle = std::is_same_v<Number, FloatLanes>;
    while (remaining > (kSingle ? kMaxFloatContraction : kMaxContraction)) {
        remaining *= norm;
        ++frame.refinements;
    }
    frame.relative_error = spread<Number>(Precision<Number>::error(kDistanceError) + 2.0 * remaining);
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
    for (int i = 0; i < Sides; ++i) {
        window = std::max({window, std::fabs(view.low[i]), std::fabs(view.high[i])});
    }
    return view.near >= kSmallestDepth && view.far <= kLargestDepth && window <= kLargestWindow &&
           window <= kLargestSlope * view.near;
}

namespace {

/// Region by the root that decides the depth.  The point found may lie on a very steep side in exact
/// arithmetic only, since it is off by a part of its coordinates far below roundoff.
template <class Kinds, int Sides>
int region_of_depth(const DistanceFrame<long double, Sides>& frame,
                    const Coordinates<long double, Sides>& p) {
    const auto depth_of = [&](const DepthRoot<long double, Sides>& root) {
        long double depth = root.depth * p.at[Sides];
        for (int i = 0; i < Sides; ++i) {
            depth += root.side[i] * (Kinds::kKind[i] == Window::centred ? std::fabs(p.at[i]) : p.at[i]);
        }
        return depth;
    };
    const auto less_deep = [&](const auto& a, const auto& b) { return depth_of(a) < depth_of(b); };
    const auto* deepest = std::min_element(frame.roots, frame.roots + Kinds::kMax, less_deep);
    for (int s = 1; s < Kinds::kMin; ++s) {
        const auto* const first = frame.roots + s * Kinds::kMax;
        const auto* const least = std::min_element(first, first + Kinds::kMax, less_deep);
        if (less_deep(*deepest, *least)) deepest = least;
    }
    const int code = static_cast<int>(deepest->code);
    int region = 0;
    for (int i = 0, place = 1; i < Sides; ++i, place *= 3) {
        const int digit = code / place % 3;
        // A centred window has roots for positive x only, where the digit is 1.
        const bool other = Kinds::kKind[i] == Window::centred && digit == 1 && p.at[i] < 0.0L;
        region += place * (other ? 2 : digit);
    }
    return region;
}

/// The greatest double that is not above x.
double round_down(long double x) {
    const double rounded = static_cast<double>(x);
    return rounded > x ? next_down(rounded) : rounded;
}

template <class Kinds, int Sides>
PointDistance<Sides> nearest_point(const DistanceFrame<long double, Sides>& frame, const double* point) {
    long double position[Sides + 1];
    for (int k = 0; k <= Sides; ++k) position[k] = point[k];
    const auto found = distance_to_frustum<Kinds, true>(frame, position);
    const auto nearest = nearest_in_world(frame, position, found);
    const bool lost = found.distance > 0.0L && found.region <= 0.0L;
    const int region =
        lost ? region_of_depth<Kinds>(frame, to_frustum(frame, position)) : static_cast<int>(found.region);
    PointDistance<Sides> answer{static_cast<double>(found.distance),
                                round_down(found.lower),
                                -round_down(-found.upper),
                                static_cast<std::uint8_t>(region),
                                {}};
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
template DistanceFrame<FloatLanes, 1> distance_frame(const View<1>&);
template DistanceFrame<FloatLanes, 2> distance_frame(const View<2>&);
template DistanceFrame<long double, 1> distance_frame(const View<1>&);
template DistanceFrame<long double, 2> distance_frame(const View<2>&);
template bool is_ordinary(const View<1>&);
template bool is_ordinary(const View<2>&);
template PointDistance<1> distance_in_long_double(const DistanceFrame<long double, 1>&, const double*);
template PointDistance<2> distance_in_long_double(const DistanceFrame<long double, 2>&, const double*);

}  // namespace geomsrv
