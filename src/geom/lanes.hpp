// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
// Four doubles or eight floats at a time, so that one kernel written for a number also serves as vector code.
#pragma once

#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <type_traits>
#include <utility>

// One binary serves every x86-64: a batch loop is compiled twice and the loader picks the wider one where the
// processor has it.  Both give the same bits, because contraction is off and a fused multiply-add is only
// where std::fma says so.  GEOMSRV_ONE_PATH compiles it once, for the target, which is how tests compare the
// two.
#if !defined(GEOMSRV_ONE_PATH) && defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)
#define GEOMSRV_WIDE_CLONES __attribute__((target_clones("default", "arch=x86-64-v3")))
#else
#define GEOMSRV_WIDE_CLONES
#endif

/// A function that must melt into its caller, to be compiled for the caller's instruction set.
#define GEOMSRV_INLINE [[gnu::always_inline]] inline

namespace geomsrv {

/// Outcome of a comparison in each lane: all bits set or none.
template <class Whole, int Count>
struct MaskOf {
    using Vector [[gnu::vector_size(Count * sizeof(Whole))]] = Whole;
    Vector v;
    MaskOf() = default;
    // Written out: GCC moves the members of a defaulted copy through general registers.
    GEOMSRV_INLINE MaskOf(const MaskOf& other) : v(other.v) {}
    GEOMSRV_INLINE MaskOf& operator=(const MaskOf& other) {
        v = other.v;
        return *this;
    }
    ~MaskOf() = default;
    GEOMSRV_INLINE explicit MaskOf(const Vector& x) : v(x) {}

    GEOMSRV_INLINE friend MaskOf operator&(const MaskOf& a, const MaskOf& b) { return MaskOf(a.v & b.v); }
    GEOMSRV_INLINE friend MaskOf operator|(const MaskOf& a, const MaskOf& b) { return MaskOf(a.v | b.v); }
    GEOMSRV_INLINE friend MaskOf operator~(const MaskOf& a) { return MaskOf(~a.v); }
    GEOMSRV_INLINE friend bool all(const MaskOf& a) {
        const auto w = reinterpret_cast<Words>(a.v);
        if constexpr (kWide) {
            return ((w[0] & w[1]) & (w[2] & w[3])) == -1;
        } else {
            return (w[0] & w[1]) == -1;
        }
    }
    GEOMSRV_INLINE friend bool any(const MaskOf& a) {
        const auto w = reinterpret_cast<Words>(a.v);
        if constexpr (kWide) {
            return ((w[0] | w[1]) | (w[2] | w[3])) != 0;
        } else {
            return (w[0] | w[1]) != 0;
        }
    }

private:
    // Lanes have one outcome each, so words of any size tell the same.
    static constexpr bool kWide = Count * sizeof(Whole) == 32;
    using FourWords [[gnu::vector_size(32)]] = std::int64_t;
    using TwoWords [[gnu::vector_size(16)]] = std::int64_t;
    using Words = std::conditional_t<kWide, FourWords, TwoWords>;
};

/// Numbers side by side; operations are lane by lane and compile to whatever vectors the target has.
template <class Number, int Count>
struct LanesOf {
    static constexpr int kCount = Count;
    using Real = Number;
    using Mask = MaskOf<std::conditional_t<sizeof(Number) == 8, std::int64_t, std::int32_t>, Count>;
    using Vector [[gnu::vector_size(Count * sizeof(Number))]] = Number;
    Vector v;

    /// As stored: a number's alignment is enough.
    using Stored [[gnu::vector_size(Count * sizeof(Number)), gnu::aligned(alignof(Number)), gnu::may_alias]] =
        Number;

    LanesOf() = default;
    GEOMSRV_INLINE LanesOf(const LanesOf& other) : v(other.v) {}
    GEOMSRV_INLINE LanesOf& operator=(const LanesOf& other) {
        v = other.v;
        return *this;
    }
    ~LanesOf() = default;
    GEOMSRV_INLINE LanesOf(Number x) : v(Vector{} + x) {}  // NOLINT: numbers are lanes
    GEOMSRV_INLINE explicit LanesOf(const Vector& x) : v(x) {}
    GEOMSRV_INLINE static LanesOf load(const Number* from) {
        return LanesOf(Vector(*reinterpret_cast<const Stored*>(from)));
    }
    GEOMSRV_INLINE Number operator[](int i) const { return v[i]; }
    GEOMSRV_INLINE void store(Number* to) const { *reinterpret_cast<Stored*>(to) = v; }

    GEOMSRV_INLINE friend LanesOf operator-(const LanesOf& a) { return LanesOf(-a.v); }
    GEOMSRV_INLINE friend LanesOf operator+(const LanesOf& a, const LanesOf& b) { return LanesOf(a.v + b.v); }
    GEOMSRV_INLINE friend LanesOf operator-(const LanesOf& a, const LanesOf& b) { return LanesOf(a.v - b.v); }
    GEOMSRV_INLINE friend LanesOf operator*(const LanesOf& a, const LanesOf& b) { return LanesOf(a.v * b.v); }
    GEOMSRV_INLINE friend LanesOf operator/(const LanesOf& a, const LanesOf& b) { return LanesOf(a.v / b.v); }
    GEOMSRV_INLINE friend Mask operator<(const LanesOf& a, const LanesOf& b) { return Mask(a.v < b.v); }
    GEOMSRV_INLINE friend Mask operator<=(const LanesOf& a, const LanesOf& b) { return Mask(a.v <= b.v); }
    GEOMSRV_INLINE friend LanesOf select(const Mask& condition, const LanesOf& a, const LanesOf& b) {
        return LanesOf(condition.v ? a.v : b.v);
    }
    GEOMSRV_INLINE friend LanesOf magnitude(const LanesOf& a) {
        return a.each([](Number x) __attribute__((always_inline)) { return std::fabs(x); });
    }
    GEOMSRV_INLINE friend LanesOf square_root(const LanesOf& a) {
        return a.each([](Number x) __attribute__((always_inline)) { return std::sqrt(x); });
    }
    GEOMSRV_INLINE friend LanesOf fused_multiply_add(const LanesOf& a, const LanesOf& b, const LanesOf& c) {
        return [&]<std::size_t... Lane>(std::index_sequence<Lane...>) __attribute__((always_inline)) {
            return LanesOf(Vector{std::fma(a.v[Lane], b.v[Lane], c.v[Lane])...});
        }(std::make_index_sequence<Count>{});
    }

private:
    template <class Step>
    GEOMSRV_INLINE LanesOf each(Step step) const {
        return [&]<std::size_t... Lane>(std::index_sequence<Lane...>) __attribute__((always_inline)) {
            return LanesOf(Vector{step(v[Lane])...});
        }(std::make_index_sequence<Count>{});
    }
};

using Lanes = LanesOf<double, 4>;
using LaneMask = Lanes::Mask;
/// As wide, of single precision.
using FloatLanes = LanesOf<float, 8>;

/// To be called in a branch of a loop that computes with lanes if one condition holds for all of them.  Where
/// there is AVX-512, GCC 12 may compute such a branch under a mask and take the condition itself for it; as 1
/// it has one bit, so all lanes but the first are left out.  It leaves loops with assembler statements alone.
GEOMSRV_INLINE void stay_a_branch() { asm(""); }

/// condition ? a : b, for a number and lane by lane.
template <class Real>
GEOMSRV_INLINE Real select(bool condition, Real a, Real b) {
    return condition ? a : b;
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

/// Lane i of a block as bit 4 block + i, in that lane: sixteen blocks fit.
GEOMSRV_INLINE LaneMask bits_of_block(const LaneMask& set, std::size_t block) {
    static_assert(Lanes::kCount == 4);
    const LaneMask::Vector bits{1, 2, 4, 8};
    return set & LaneMask(bits << static_cast<std::int64_t>(Lanes::kCount * block));
}
GEOMSRV_INLINE std::uint64_t joined(const LaneMask& bits) {
    return static_cast<std::uint64_t>((bits.v[0] | bits.v[1]) | (bits.v[2] | bits.v[3]));
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

GEOMSRV_INLINE void store_bytes(const FloatLanes& x, std::uint8_t* to) {
    for (int i = 0; i < FloatLanes::kCount; ++i) to[i] = static_cast<std::uint8_t>(x[i]);
}

/// Rounded to single precision.
GEOMSRV_INLINE FloatLanes joined(const Lanes& low, const Lanes& high) {
    return FloatLanes(__builtin_convertvector(__builtin_shufflevector(low.v, high.v, 0, 1, 2, 3, 4, 5, 6, 7),
                                              FloatLanes::Vector));
}

/// The halves of eight, to double precision.
struct LanesPair {
    Lanes low, high;
};
GEOMSRV_INLINE LanesPair parted(const FloatLanes& x) {
    return {Lanes(__builtin_convertvector(__builtin_shufflevector(x.v, x.v, 0, 1, 2, 3), Lanes::Vector)),
            Lanes(__builtin_convertvector(__builtin_shufflevector(x.v, x.v, 4, 5, 6, 7), Lanes::Vector))};
}

GEOMSRV_INLINE double magnitude(double x) { return std::fabs(x); }
GEOMSRV_INLINE long double magnitude(long double x) { return std::fabs(x); }

template <class Real>
GEOMSRV_INLINE Real fused_multiply_add(Real a, Real b, Real c) {
    return std::fma(a, b, c);
}

GEOMSRV_INLINE double square_root(double x) { return std::sqrt(x); }
GEOMSRV_INLINE long double square_root(long double x) { return std::sqrt(x); }

}  // namespace geomsrv
