// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
// Four doubles at a time, in whatever registers the processor has.  Same bits on every machine: contraction
// is off, and lanes never mix except in minima, maxima and logical sums, whose order does not matter.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>

// One binary serves every x86-64: such a function is compiled twice and the loader picks the wider one where
// the processor has it.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)
#define GEOMSRV_WIDE_CLONES __attribute__((target_clones("default", "arch=x86-64-v3")))
#else
#define GEOMSRV_WIDE_CLONES
#endif
/// A function that must melt into its caller, to be compiled for the caller's instruction set.
#define GEOMSRV_INLINE [[gnu::always_inline]] inline

// As arguments lanes have another ABI with AVX than without, of which GCC warns at every use.  All functions
// below melt into their callers, so none is ever passed.
#pragma GCC diagnostic ignored "-Wpsabi"

namespace geomsrv {

inline constexpr std::size_t kLanes = 4;
using Lanes = double __attribute__((vector_size(32)));
/// All bits set in the lanes where a comparison holds.
using Mask = std::int64_t __attribute__((vector_size(32)));

/// From any address.
GEOMSRV_INLINE Lanes load(const double* from) {
    Lanes value;
    std::memcpy(&value, from, sizeof value);
    return value;
}
GEOMSRV_INLINE void store(double* to, const Lanes& value) { std::memcpy(to, &value, sizeof value); }

GEOMSRV_INLINE Lanes magnitude(const Lanes& x) { return x < 0.0 ? -x : x; }
GEOMSRV_INLINE Lanes smaller(const Lanes& a, const Lanes& b) { return a < b ? a : b; }
GEOMSRV_INLINE Lanes larger(const Lanes& a, const Lanes& b) { return a > b ? a : b; }

// The same for one number, so that a formula can be written once for both.
GEOMSRV_INLINE double magnitude(double x) { return x < 0.0 ? -x : x; }
GEOMSRV_INLINE double smaller(double a, double b) { return a < b ? a : b; }
GEOMSRV_INLINE double larger(double a, double b) { return a > b ? a : b; }

GEOMSRV_INLINE bool any(const Mask& m) { return ((m[0] | m[1]) | (m[2] | m[3])) != 0; }
GEOMSRV_INLINE double smallest(const Lanes& x) {
    const double low = x[0] < x[1] ? x[0] : x[1];
    const double high = x[2] < x[3] ? x[2] : x[3];
    return low < high ? low : high;
}
GEOMSRV_INLINE double largest(const Lanes& x) { return -smallest(-x); }

}  // namespace geomsrv
