// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
// Products and sums of lanes, with a fused multiply-add where there is one: for kernels whose error bounds
// hold either way, and whose answers are so proven that they are the same bits.
#pragma once

#include "geom/lanes.hpp"

#if !defined(GEOMSRV_ONE_PATH) && defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)
#include <immintrin.h>  // declares the builtin below
#endif

namespace geomsrv {

/// a b + c with two roundings, and what a b loses by its own.
struct TwoRoundings {
    GEOMSRV_INLINE static Lanes multiply_add(const Lanes& a, const Lanes& b, const Lanes& c) {
        return a * b + c;
    }
    /// a b - product; by splitting the factors (Veltkamp, Dekker).
    GEOMSRV_INLINE static Lanes product_error(const Lanes& a, const Lanes& b, const Lanes& product) {
        const Lanes splitter = 134217729.0;  // 2^27 + 1 halves the 53 bits
        const Lanes ca = splitter * a, cb = splitter * b;
        const Lanes a1 = ca - (ca - a), b1 = cb - (cb - b);
        const Lanes a2 = a - a1, b2 = b - b1;
        return ((a1 * b1 - product) + a1 * b2 + a2 * b1) + a2 * b2;
    }
    /// square - root^2, where root is the rounded root of square.
    GEOMSRV_INLINE static Lanes root_rest(const Lanes& square, const Lanes& root) {
        const Lanes product = root * root;
        return (square - product) - product_error(root, root, product);
    }
    /// One number where x is negative, another where it is positive; any of both where it is 0.
    GEOMSRV_INLINE static Lanes by_sign(const Lanes& x, const Lanes& negative, const Lanes& positive) {
        return select(x < Lanes(0.0), negative, positive);
    }
};

#if !defined(GEOMSRV_ONE_PATH) && defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wpsabi"  // the value never leaves the function it melts into
/// The same with one rounding, for kernels whose error bounds hold for both.  Only inside of a function
/// marked GEOMSRV_FUSED; where the processor `has_fused`.
struct OneRounding {
    GEOMSRV_INLINE static Lanes multiply_add(const Lanes& a, const Lanes& b, const Lanes& c) {
        return Lanes(Lanes::Vector(__builtin_ia32_vfmaddpd256(a.v, b.v, c.v)));
    }
    GEOMSRV_INLINE static Lanes product_error(const Lanes& a, const Lanes& b, const Lanes& product) {
        return multiply_add(a, b, -product);
    }
    GEOMSRV_INLINE static Lanes root_rest(const Lanes& square, const Lanes& root) {
        return multiply_add(-root, root, square);
    }
    GEOMSRV_INLINE static Lanes by_sign(const Lanes& x, const Lanes& negative, const Lanes& positive) {
        return Lanes(Lanes::Vector(__builtin_ia32_blendvpd256(positive.v, negative.v, x.v)));
    }
};
#pragma GCC diagnostic pop
#define GEOMSRV_FUSED __attribute__((target("avx2,fma")))
inline bool has_fused() { return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma"); }
#else
using OneRounding = TwoRoundings;
#define GEOMSRV_FUSED
inline bool has_fused() { return false; }
#endif

}  // namespace geomsrv
