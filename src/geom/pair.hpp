// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
// Numbers as unevaluated sums of two doubles that are never brought back to order, at a fraction of the price
// of Enclosed: their errors are not carried along but bounded beforehand.
// Lange, Rump, Faithfully rounded floating-point computations (2020), call this pair arithmetic.
#pragma once

#include <cmath>
#include <type_traits>

#include "geom/double_double.hpp"
#include "geom/enclosed.hpp"
#include "geom/lanes.hpp"

namespace geomsrv {

/// `Fused`: the processor has fused multiply-add.  Without it products cost eight times as much; the bits are
/// the same.
template <bool Fused>
struct Pair {
    double hi = 0.0;
    double lo = 0.0;

    Pair() = default;
    Pair(double x) : hi(x) {}  // NOLINT: a double is a number
    Pair(double high, double low) : hi(high), lo(low) {}

    GEOMSRV_INLINE friend Pair operator-(const Pair& a) { return {-a.hi, -a.lo}; }
    GEOMSRV_INLINE friend Pair operator+(const Pair& a, const Pair& b) {
        const DoubleDouble sum = two_sum(a.hi, b.hi);
        return {sum.hi, sum.lo + (a.lo + b.lo)};
    }
    GEOMSRV_INLINE friend Pair operator-(const Pair& a, const Pair& b) { return a + (-b); }
    GEOMSRV_INLINE friend Pair operator*(const Pair& a, const Pair& b) {
        const Pair product = product_of(a.hi, b.hi, std::type_identity<Pair>{});
        return {product.hi, product.lo + (a.hi * b.lo + a.lo * b.hi)};
    }
    GEOMSRV_INLINE friend Pair product_of(double a, double b, std::type_identity<Pair>) {
        if constexpr (Fused) {
            const double product = a * b;
            return {product, std::fma(a, b, -product)};
        } else {
            const DoubleDouble product = two_product(a, b);
            return {product.hi, product.lo};
        }
    }
};

// Error of an expression in pairs, as a share of M, the same expression of the magnitudes of all numbers in
// it. Let it have n operations, of which the low part collects at most n u M.  A sum adds 2 n u^2 M for the
// two roundings of its low part; a product 3 n u^2 M, and n_a n_b u^2 M for the product of the low parts that
// it leaves out.  For the longest one here, the square of the cross product of two vectors that are sums of
// up to eight products each, that makes less than 2^13 u^2.
inline constexpr double kPairError = 0x1p-93;

/// In order again, with its error: kPairError * most, where M <= most.
template <bool Fused>
GEOMSRV_INLINE Enclosed enclosed(const Pair<Fused>& a, double most) {
    return {two_sum(a.hi, a.lo), kPairError * most + kEnclosedUnderflow};
}

}  // namespace geomsrv
