// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
// Four doubles at a time, so that one kernel written for a number also serves as vector code.
#pragma once

#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>

// One binary serves every x86-64: a batch loop is compiled twice and the loader picks the wider one where the
// processor has it.  Both give the same bits, because contraction is off and a fused multiply-add is only
// where std::fma says so.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)
#include <immintrin.h>
#define GEOMSRV_WIDE_CLONES __attribute__((target_clones("default", "arch=x86-64-v3")))
#else
#define GEOMSRV_WIDE_CLONES
#endif

/// A function that must melt into its caller, to be compiled for the caller's instruction set.
#define GEOMSRV_INLINE [[gnu::always_inline]] inline

namespace geomsrv {

/// Four doubles; operations are lane by lane and compile to whatever vectors the target has.
struct Lanes {
    static constexpr int kCount = 4;
    using Vector = double __attribute__((vector_size(kCount * sizeof(double))));
    Vector v;

    /// As stored: a double's alignment is enough.
    using Stored __attribute__((vector_size(kCount * sizeof(double)), aligned(alignof(double)), may_alias)) =
        double;

    Lanes() = default;
    // Written out: GCC moves the members of a defaulted copy through general registers.
    GEOMSRV_INLINE Lanes(const Lanes& other) : v(other.v) {}
    GEOMSRV_INLINE Lanes& operator=(const Lanes& other) {
        v = other.v;
        return *this;
    }
    ~Lanes() = default;
    GEOMSRV_INLINE Lanes(double x) : v{x, x, x, x} {}  // NOLINT: numbers are lanes
    GEOMSRV_INLINE explicit Lanes(const Vector& x) : v(x) {}
    GEOMSRV_INLINE static Lanes load(const double* from) {
        return Lanes(Vector(*reinterpret_cast<const Stored*>(from)));
    }
    GEOMSRV_INLINE double operator[](int i) const { return v[i]; }
    GEOMSRV_INLINE void store(double* to) const { *reinterpret_cast<Stored*>(to) = v; }
};

/// Outcome of a comparison in each lane: all bits set or none.
struct LaneMask {
    using Vector = std::int64_t __attribute__((vector_size(Lanes::kCount * sizeof(std::int64_t))));
    Vector v;
    LaneMask() = default;
    GEOMSRV_INLINE LaneMask(const LaneMask& other) : v(other.v) {}
    GEOMSRV_INLINE LaneMask& operator=(const LaneMask& other) {
        v = other.v;
        return *this;
    }
    ~LaneMask() = default;
    GEOMSRV_INLINE explicit LaneMask(const Vector& x) : v(x) {}
};

GEOMSRV_INLINE Lanes operator-(const Lanes& a) { return Lanes(-a.v); }
GEOMSRV_INLINE Lanes operator+(const Lanes& a, const Lanes& b) { return Lanes(a.v + b.v); }
GEOMSRV_INLINE Lanes operator-(const Lanes& a, const Lanes& b) { return Lanes(a.v - b.v); }
GEOMSRV_INLINE Lanes operator*(const Lanes& a, const Lanes& b) { return Lanes(a.v * b.v); }
GEOMSRV_INLINE Lanes operator/(const Lanes& a, const Lanes& b) { return Lanes(a.v / b.v); }
GEOMSRV_INLINE LaneMask operator<(const Lanes& a, const Lanes& b) { return LaneMask(a.v < b.v); }
GEOMSRV_INLINE LaneMask operator<=(const Lanes& a, const Lanes& b) { return LaneMask(a.v <= b.v); }
GEOMSRV_INLINE LaneMask operator&(const LaneMask& a, const LaneMask& b) { return LaneMask(a.v & b.v); }
GEOMSRV_INLINE LaneMask operator~(const LaneMask& a) { return LaneMask(~a.v); }
GEOMSRV_INLINE LaneMask operator|(const LaneMask& a, const LaneMask& b) { return LaneMask(a.v | b.v); }
GEOMSRV_INLINE bool all(const LaneMask& a) { return ((a.v[0] & a.v[1]) & (a.v[2] & a.v[3])) != 0; }
GEOMSRV_INLINE bool any(const LaneMask& a) { return ((a.v[0] | a.v[1]) | (a.v[2] | a.v[3])) != 0; }

/// condition ? a : b, for a number and lane by lane.
template <class Real>
GEOMSRV_INLINE Real select(bool condition, Real a, Real b) {
    return condition ? a : b;
}
GEOMSRV_INLINE Lanes select(const LaneMask& condition, const Lanes& a, const Lanes& b) {
    return Lanes(condition.v ? a.v : b.v);
}

template <class Real>
GEOMSRV_INLINE Real lesser(const Real& a, const Real& b) {
    return select(a < b, a, b);
}
template <class Real>
GEOMSRV_INLINE Real greater(const Real& a, const Real& b) {
    return select(b < a, a, b);
}

GEOMSRV_INLINE void store(const LaneMask& mask, std::int64_t* to) {
    Lanes((Lanes::Vector)mask.v).store(reinterpret_cast<double*>(to));
}
GEOMSRV_INLINE LaneMask load_mask(const std::int64_t* from) {
    return LaneMask((LaneMask::Vector)Lanes::load(reinterpret_cast<const double*>(from)).v);
}

/// x where the condition holds, else 0.
GEOMSRV_INLINE Lanes kept(const LaneMask& condition, const Lanes& x) {
    return Lanes((Lanes::Vector)(condition.v & (LaneMask::Vector)x.v));
}
/// x with its sign changed where s is negative.
GEOMSRV_INLINE Lanes with_sign_of(const Lanes& s, const Lanes& x) {
    constexpr std::int64_t kSign = std::numeric_limits<std::int64_t>::min();
    return Lanes((Lanes::Vector)(((LaneMask::Vector)s.v & kSign) ^ (LaneMask::Vector)x.v));
}
/// The greatest power of two that is not above x, for normal x > 0.
GEOMSRV_INLINE Lanes power_of_two_in(const Lanes& x) {
    constexpr std::int64_t kExponent = 0x7ff0000000000000;
    return Lanes((Lanes::Vector)((LaneMask::Vector)x.v & kExponent));
}
/// The `steps`-th next double, for normal x > 0.
GEOMSRV_INLINE Lanes neighbour(const Lanes& x, const LaneMask::Vector& steps) {
    return Lanes((Lanes::Vector)((LaneMask::Vector)x.v + steps));
}

GEOMSRV_INLINE double least(const Lanes& a) { return lesser(lesser(a[0], a[1]), lesser(a[2], a[3])); }
GEOMSRV_INLINE double greatest(const Lanes& a) { return greater(greater(a[0], a[1]), greater(a[2], a[3])); }

/// Whole numbers 0 to 255, one byte each: as digits to base 256 of one number they need one conversion, not
/// four.
GEOMSRV_INLINE void store_bytes(const Lanes& x, std::uint8_t* to) {
    static_assert(Lanes::kCount == 4 && std::endian::native == std::endian::little);
    const Lanes digits = x * Lanes(Lanes::Vector{0x1p0, 0x1p8, 0x1p16, 0x1p24});
    const auto packed = static_cast<std::uint32_t>(
        static_cast<std::int64_t>((digits[0] + digits[1]) + (digits[2] + digits[3])));
    std::memcpy(to, &packed, sizeof packed);
}

GEOMSRV_INLINE double magnitude(double x) { return std::fabs(x); }
GEOMSRV_INLINE long double magnitude(long double x) { return std::fabs(x); }
GEOMSRV_INLINE Lanes magnitude(const Lanes& x) {
    return Lanes(Lanes::Vector{std::fabs(x[0]), std::fabs(x[1]), std::fabs(x[2]), std::fabs(x[3])});
}

template <class Real>
GEOMSRV_INLINE Real fused_multiply_add(Real a, Real b, Real c) {
    return std::fma(a, b, c);
}
GEOMSRV_INLINE Lanes fused_multiply_add(const Lanes& a, const Lanes& b, const Lanes& c) {
    return Lanes(Lanes::Vector{std::fma(a[0], b[0], c[0]), std::fma(a[1], b[1], c[1]),
                               std::fma(a[2], b[2], c[2]), std::fma(a[3], b[3], c[3])});
}

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
};

#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wpsabi"  // the value never leaves the function it melts into
/// The same with one rounding, for kernels whose error bounds hold for both.  Only inside of a function marked
/// GEOMSRV_FUSED; where the processor `has_fused`.
struct OneRounding {
    GEOMSRV_INLINE static Lanes multiply_add(const Lanes& a, const Lanes& b, const Lanes& c) {
        return Lanes(Lanes::Vector(__builtin_ia32_vfmaddpd256(a.v, b.v, c.v)));
    }
    GEOMSRV_INLINE static Lanes product_error(const Lanes& a, const Lanes& b, const Lanes& product) {
        return multiply_add(a, b, -product);
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

GEOMSRV_INLINE double square_root(double x) { return std::sqrt(x); }
GEOMSRV_INLINE long double square_root(long double x) { return std::sqrt(x); }
GEOMSRV_INLINE Lanes square_root(const Lanes& x) {
    return Lanes(Lanes::Vector{std::sqrt(x[0]), std::sqrt(x[1]), std::sqrt(x[2]), std::sqrt(x[3])});
}

}  // namespace geomsrv
