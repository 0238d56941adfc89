// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
// Distance of points from a frustum's literal hull, correctly rounded, four at a time: the region by a
// float64 filter, then the distance to 2^-72 of the scene's size.
//
// Where the nearest point Y sits on its feature matters only to second order: a point of the same feature
// that is off by e is farther from x by e^2 / 2 d.  So y, the coordinates of Y by the closed form in doubles,
// does, taken as if it were exact; an active side has the coordinate k t, with its exact slope k.  What is
// left is
//
//     d = |r|,    r = x - E - sum of y_i a_i        by the literal axes a_i,
//
// a sum of products.  Each factor is split into a coarse part, a whole multiple of a power of two, and the
// rest: products of coarse parts and their sums fit into 53 bits, so they are exact; and products with a rest
// are so small that plain arithmetic is exact enough.  d itself is one Newton step from the root of the
// rounded square, whose remainder is summed in the same way.
#pragma once

#include <cmath>

#include "geom/lane_arithmetic.hpp"
#include "geom/point_frustum.hpp"

namespace geomsrv {

/// A number as a whole multiple of a power of two, and the rest.
template <class Number>
struct Halves {
    Number coarse, rest;
};

// Units of the coarse parts: of the entries of axes; of lengths, relative to the power of two P in the reach.
// Products of both are multiples of 2^-50 P, those of two lengths of 2^-48 P^2.  Sums of them stay below
// 4.2 P, or 17 P^2 (see below), so none needs more than 53 bits.
inline constexpr double kAxisUnit = 0x1p-26;
inline constexpr double kLengthUnit = 0x1p-24;

/// What is needed besides the frame of the float64 kernel.
template <int Sides>
struct WideFrame {
    static constexpr int kDimension = Sides + 1;
    Halves<Lanes> minus_axes[kDimension][kDimension];  ///< exact
    Lanes low_rest[Sides], high_rest[Sides];           ///< slope minus its rounding
    Lanes window;                                      ///< no near corner is farther from E [m]
    Lanes margin;                                      ///< errors of the filter, in units of the reach
    Lanes error;                                       ///< of d, in units of the rounder
};

template <int Sides>
WideFrame<Sides> wide_frame(const View<Sides>& view, const DistanceFrame<Lanes, Sides>& frame);

/// What the first step hands to the second, for a block of points.
template <int Sides, int Size>
struct alignas(Lanes) Residuals {
    using Row = double[Size];
    Row coarse[Sides + 1], rest[Sides + 1];  ///< r
    Row rounder, region;
    std::int64_t proven[Size];  ///< whether the region is: -1 or 0
};

template <int Sides>
struct WideDistance {
    Lanes distance, lower, upper;
    LaneMask inside, proven;
};

/// P times this is a `rounder`: adding and subtracting it rounds numbers up to 2^27 P to a multiple of
/// kLengthUnit P.
inline constexpr double kRounder = 1.5 * 0x1p52 * kLengthUnit;
GEOMSRV_INLINE Halves<Lanes> halves(const Lanes& rounder, const Lanes& x) {
    const Lanes coarse = (rounder + x) - rounder;
    return {coarse, x - coarse};
}

// Errors of what decides the region, in units u of roundoff of the reach m = max(|c_0| + |c_1| + |c_2|,
// window); c are the coordinates of x, p = x - E.  |p| is at most 1.005 m, an axis being no longer
// than 1.005; so is |Y - E|, since E and the frustum span a convex set; hence d is at most 2.01 m.
//
// 1. Coordinates: 13 u sum |dual| |p| each (9 dual basis, 1 difference, 1 product, 2 sums): 13.3 u m, as a
//    vector 23 u m.
// 2. Axes off orthonormal: the projection is that of c + defect (c - y).  What further projections leave of
//    the defect is half the relative error times d, so relative_error m; their roundings are 32 u m (Gram
//    matrix 12 u d, sums 6 u m).
// 3. The depth, a max and min of roots: 14 u m (1 slope, 1 product, 4 sums, 7 for the factor in common, 1 for
//    its product), and 1 and 2 as vectors.
// 4. Sides x - k t: 1 and 2 for x, 3 times |k| for t, 2 u |k| t for slope and product, 1 u for the
//    difference: in all less than 1 + |k| times 3 and 5 u m.
//
// So (78 u + relative_error) m for the depth and 1 + |k| times that for a side.  If every comparison has more
// than this margin, the faces that hold Y are those found.
inline constexpr double kWideMargin = 96.0 * kUnitRoundoff;

// Error of d to first order, in units of 2^-78 P, P <= m < 2 P.
//
// 1. A component of r.  Rests are at most 2^-25 P, and sums of them 3.7 times that; a rounding is 2^-53 of
//    its result.  Rest of p 1; six products with a rest 2.7, their sums 15.9; y's rests themselves 1.8, and y
//    where it multiplies the axes' rests 0.9: 22.3, as a vector 38.7.
// 2. The square, halved by 2 d.  b, the rest of r, is at most 4.7 * 2^-25 P in each component, 8.2 as a
//    vector; its own rounding 8.2.  The sum of 2 a b + b^2: 8.2 for the products, 16.4 for sums, 8.2 for the
//    last.  If that sum is smaller than that of a^2, its sum with it, q, and what q lost are found exactly;
//    the root's remainder and its step take less than 1: 42.  If it is not, d is less than 2^-20 P, and then
//    no d passes Ziv's test.
inline constexpr double kWideError = 100.0 * 0x1p-78;

/// The region, and x - Y to 2^-73 of the reach, of four points.
template <class Kinds, bool Skewed, class Arithmetic, int Sides, int Size>
GEOMSRV_INLINE void residual(const DistanceFrame<Lanes, Sides>& frame, const WideFrame<Sides>& wide,
                             const Lanes (&point)[Sides + 1], std::size_t first,
                             Residuals<Sides, Size>& out) {
    constexpr int kDimension = Sides + 1;
    const Lanes none = 0.0;
    Lanes p[kDimension], p_error[kDimension];  // x - E exactly
    for (int k = 0; k < kDimension; ++k) {
        p[k] = point[k] - frame.origin[k];
        const Lanes part = p[k] - point[k];
        p_error[k] = (point[k] - (p[k] - part)) - (frame.origin[k] + part);
    }

    Lanes c[kDimension];
    for (int i = 0; i < kDimension; ++i) {
        c[i] = frame.dual.row[i][0] * p[0];
        for (int k = 1; k < kDimension; ++k) {
            c[i] = Arithmetic::multiply_add(frame.dual.row[i][k], p[k], c[i]);
        }
    }
    Lanes reach = magnitude(c[0]);
    for (int i = 1; i < kDimension; ++i) reach = reach + magnitude(c[i]);
    reach = greater(reach, wide.window);
    const Lanes rounder = power_of_two_in(reach) * Lanes(kRounder);
    if constexpr (Skewed) {
        Coordinates<Lanes, Sides> given, shifted;
        for (int i = 0; i < kDimension; ++i) shifted.at[i] = given.at[i] = c[i];
        for (int step = 0; step < frame.refinements; ++step) {
            const auto nearest = project<Kinds>(frame, shifted).nearest;
            for (int i = 0; i < kDimension; ++i) {
                shifted.at[i] = given.at[i];
                for (int k = 0; k < kDimension; ++k) {
                    shifted.at[i] = shifted.at[i] + frame.defect.row[i][k] * (given.at[k] - nearest.at[k]);
                }
            }
        }
        for (int i = 0; i < kDimension; ++i) c[i] = shifted.at[i];
    }

    const Lanes z = c[Sides];
    Lanes x[Sides];
    for (int i = 0; i < Sides; ++i) x[i] = Kinds::kKind[i] == Window::centred ? magnitude(c[i]) : c[i];
    Lanes root = z;
    unrolled<Kinds::kMin>([&](auto s) __attribute__((always_inline)) {
        Lanes lowest = z;
        unrolled<Kinds::kMax>([&](auto t) __attribute__((always_inline)) {
            if constexpr (s + t > 0) {
                // The roots of `project`, with the factor that they have in common taken out.
                Lanes sum = z;
                unrolled<Sides>([&](auto i) __attribute__((always_inline)) {
                    constexpr SlopeChoice kSlope = Kinds::choice(s, t, i);
                    if constexpr (kSlope.low) {
                        sum = Arithmetic::multiply_add(frame.side[i].low_slope, x[i], sum);
                    }
                    if constexpr (kSlope.high) {
                        sum = Arithmetic::multiply_add(frame.side[i].high_slope, x[i], sum);
                    }
                });
                const Lanes r = frame.roots[s * Kinds::kMax + t].depth * sum;
                lowest = t == 0 ? r : lesser(lowest, r);
            }
        });
        root = s == 0 ? lowest : greater(root, lowest);
    });
    const Lanes depth = lesser(greater(root, frame.near), frame.far);
    // Codes are for comparisons that have their margin; equality has none.
    const Lanes past_near = root - frame.near, past_far = root - frame.far;
    Lanes region = Arithmetic::by_sign(past_near, 9.0, Arithmetic::by_sign(past_far, none, 18.0));
    Lanes margin = lesser(magnitude(past_near), magnitude(past_far));

    Lanes y[kDimension];
    Halves<Lanes> split[kDimension];
    y[Sides] = depth;
    split[Sides] = halves(rounder, depth);
    for (int i = 0; i < Sides; ++i) {
        const FrustumSide<Lanes>& side = frame.side[i];
        const Lanes high = side.high_slope * depth, over = x[i] - high;
        Lanes lost = Arithmetic::multiply_add(wide.high_rest[i], depth,
                                              Arithmetic::product_error(side.high_slope, depth, high));
        lost = Arithmetic::by_sign(over, none, lost);
        margin = lesser(margin, magnitude(over));
        if (Kinds::kKind[i] == Window::centred) {
            const Lanes code = Arithmetic::by_sign(c[i], side.low_code, side.high_code);
            region = region + Arithmetic::by_sign(over, none, code);
            lost = with_sign_of(c[i], lost);
            y[i] = with_sign_of(c[i], lesser(x[i], high));
        } else {
            const Lanes low = side.low_slope * depth, under = low - x[i];
            margin = lesser(margin, magnitude(under));
            region = region + (Arithmetic::by_sign(over, none, side.high_code) +
                               Arithmetic::by_sign(under, none, side.low_code));
            const Lanes lost_low = Arithmetic::multiply_add(
                wide.low_rest[i], depth, Arithmetic::product_error(side.low_slope, depth, low));
            lost = lost + Arithmetic::by_sign(under, none, lost_low);
            y[i] = lesser(greater(x[i], low), high);
        }
        split[i] = halves(rounder, y[i]);
        split[i].rest = split[i].rest + lost;
    }
    rounder.store(out.rounder + first);
    region.store(out.region + first);
    store(reach * wide.margin < margin, out.proven + first);

    for (int k = 0; k < kDimension; ++k) {
        auto [coarse, rest] = halves(rounder, p[k]);
        rest = rest + p_error[k];
        // What is known first comes first.
        for (int i = Sides; i >= 0; --i) {
            const auto& minus_axis = wide.minus_axes[i][k];
            coarse = Arithmetic::multiply_add(minus_axis.coarse, split[i].coarse, coarse);
            rest = Arithmetic::multiply_add(minus_axis.rest, y[i], rest);
        }
        for (int i = Sides; i >= 0; --i) {
            rest = Arithmetic::multiply_add(wide.minus_axes[i][k].coarse, split[i].rest, rest);
        }
        const auto [a, b] = halves(rounder, coarse);
        a.store(out.coarse[k] + first);
        (b + rest).store(out.rest[k] + first);
    }
}

/// The lengths of four residuals, and whether their three roundings are proven.
template <class Arithmetic, int Sides, int Size>
GEOMSRV_INLINE WideDistance<Sides> length(const WideFrame<Sides>& wide, const Residuals<Sides, Size>& r,
                                          std::size_t first) {
    const Lanes none = 0.0, rounder = Lanes::load(r.rounder + first);
    Lanes coarse, mixed, fine;
    for (int k = 0; k <= Sides; ++k) {
        const Lanes a = Lanes::load(r.coarse[k] + first), b = Lanes::load(r.rest[k] + first);
        coarse = k == 0 ? a * a : Arithmetic::multiply_add(a, a, coarse);
        mixed = k == 0 ? a * b : Arithmetic::multiply_add(a, b, mixed);
        fine = k == 0 ? b * b : Arithmetic::multiply_add(b, b, fine);
    }
    const Lanes rest = Arithmetic::multiply_add(Lanes(2.0), mixed, fine);
    const Lanes square = coarse + rest, root = square_root(square);
    const Lanes remainder = Arithmetic::root_rest(square, root) + ((coarse - square) + rest);
    const Lanes step = remainder * (Lanes(0.5) / root);
    const Lanes nearest = root + step, beyond = step - (nearest - root);

    // d is within `off` of nearest + beyond (Ziv's test).  Doubles below a number are no wider apart than
    // those above it, and where d is in the middle between two, nearest is the even one.
    const Lanes off = rounder * wide.error, size = magnitude(beyond);
    const LaneMask one_side = off < size, one_rounding((nearest - (size + off)).v == nearest.v);
    const LaneMask inside = Lanes::load(r.region + first) <= none, outside = ~inside;
    const LaneMask::Vector below = beyond.v < 0.0;  // -1 if so
    const Lanes lower = neighbour(nearest, below), upper = neighbour(lower, LaneMask::Vector{1, 1, 1, 1});
    return {kept(outside, nearest), kept(outside, lower), kept(outside, upper), inside,
            load_mask(r.proven + first) & (inside | (one_rounding & one_side))};
}

}  // namespace geomsrv
