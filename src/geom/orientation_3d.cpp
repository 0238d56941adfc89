// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
#include "geom/orientation_3d.hpp"

#include <array>
#include <cmath>

#include "geom/double_double.hpp"
#include "geom/rounding.hpp"

namespace geomsrv {

namespace {

/// A number as a sum of doubles, least first, whose bits do not overlap (Shewchuk, Adaptive precision
/// floating-point arithmetic and fast robust geometric predicates, 1997, section 2).  Its sign is that of the
/// last one.
template <int Capacity>
struct Expansion {
    std::array<double, Capacity> part;
    int count = 0;

    constexpr void push(double value) {
        if (value != 0.0) {
            part[static_cast<std::size_t>(count++)] = value;
        }
    }
    constexpr int sign() const {
        return count == 0 ? 0 : part[static_cast<std::size_t>(count - 1)] > 0.0 ? 1 : -1;
    }
};

constexpr Expansion<2> expansion(DoubleDouble a) {
    Expansion<2> out{};
    out.push(a.lo);
    out.push(a.hi);
    return out;
}

/// Shewchuk's Grow-Expansion, once per part of b: exact, and short enough for a path that is rarely taken.
template <int A, int B>
constexpr Expansion<A + B> operator+(const Expansion<A>& a, const Expansion<B>& b) {
    Expansion<A + B> sum{};
    for (int i = 0; i < a.count; ++i) {
        sum.push(a.part[static_cast<std::size_t>(i)]);
    }
    for (int j = 0; j < b.count; ++j) {
        double carry = b.part[static_cast<std::size_t>(j)];
        Expansion<A + B> grown{};
        for (int i = 0; i < sum.count; ++i) {
            const DoubleDouble s = two_sum(carry, sum.part[static_cast<std::size_t>(i)]);
            grown.push(s.lo);
            carry = s.hi;
        }
        grown.push(carry);
        sum = grown;
    }
    return sum;
}

template <int A>
constexpr Expansion<A> operator-(const Expansion<A>& a) {
    Expansion<A> out = a;
    for (double& part : out.part) {
        part = -part;
    }
    return out;
}

/// Shewchuk's Scale-Expansion.
template <int A>
constexpr Expansion<2 * A> scaled(const Expansion<A>& a, double b) {
    Expansion<2 * A> out{};
    if (a.count == 0) {
        return out;
    }
    DoubleDouble q = two_product(a.part[0], b);
    out.push(q.lo);
    double carry = q.hi;
    for (int i = 1; i < a.count; ++i) {
        const DoubleDouble t = two_product(a.part[static_cast<std::size_t>(i)], b);
        q = two_sum(carry, t.lo);
        out.push(q.lo);
        q = quick_two_sum(t.hi, q.hi);
        out.push(q.lo);
        carry = q.hi;
    }
    out.push(carry);
    return out;
}

/// a * (b.hi + b.lo)
template <int A>
constexpr Expansion<4 * A> times(const Expansion<A>& a, DoubleDouble b) {
    return scaled(a, b.lo) + scaled(a, b.hi);
}

/// a d - b c
constexpr Expansion<16> minor_of(DoubleDouble a, DoubleDouble b, DoubleDouble c, DoubleDouble d) {
    return times(expansion(a), d) + -times(expansion(b), c);
}

int exact_orientation(WideVec3 u, WideVec3 v, WideVec3 w) {
    const auto x = times(minor_of(u.y, u.z, v.y, v.z), w.x);
    const auto y = times(minor_of(u.z, u.x, v.z, v.x), w.y);
    const auto z = times(minor_of(u.x, u.y, v.x, v.y), w.z);
    return (x + y + z).sign();
}

/// The largest parts last: adding them up from below leaves an error of 2^-105 of the sum.
template <int A>
constexpr DoubleDouble rounded(const Expansion<A>& a) {
    DoubleDouble sum;
    for (int i = 0; i < a.count; ++i) {
        sum = sum + DoubleDouble{a.part[static_cast<std::size_t>(i)], 0.0};
    }
    return sum;
}

}  // namespace

int orientation_3d(Vec3 a, Vec3 b, Vec3 c, Vec3 d) {
    // Relative error of the determinant in terms of its permanent: Shewchuk 1997, section 4.3, (7 + 56 u) u.
    constexpr double kOrientationError = (7.0 + 56.0 * kUnitRoundoff) * kUnitRoundoff;
    const Vec3 u = b - a;
    const Vec3 v = c - a;
    const Vec3 w = d - a;
    const double yz = u.y * v.z;
    const double zy = u.z * v.y;
    const double zx = u.z * v.x;
    const double xz = u.x * v.z;
    const double xy = u.x * v.y;
    const double yx = u.y * v.x;
    const double determinant = w.x * (yz - zy) + w.y * (zx - xz) + w.z * (xy - yx);
    const double permanent = std::abs(w.x) * (std::abs(yz) + std::abs(zy)) +
                             std::abs(w.y) * (std::abs(zx) + std::abs(xz)) +
                             std::abs(w.z) * (std::abs(xy) + std::abs(yx));
    const double error = kOrientationError * permanent;
    if (std::abs(determinant) > error) {
        return determinant > 0.0 ? 1 : -1;
    }
    if (permanent == 0.0) {
        return 0;
    }
    return exact_orientation(exact_difference(b, a), exact_difference(c, a), exact_difference(d, a));
}

WideVec3 triangle_normal(Vec3 a, Vec3 b, Vec3 c) {
    const WideVec3 u = exact_difference(b, a);
    const WideVec3 v = exact_difference(c, a);
    return {rounded(minor_of(u.y, u.z, v.y, v.z)), rounded(minor_of(u.z, u.x, v.z, v.x)),
            rounded(minor_of(u.x, u.y, v.x, v.y))};
}

}  // namespace geomsrv
