// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
// Numbers of about 106 bits as unevaluated sums of two doubles, and vectors of them.
// Dekker, A floating-point technique for extending the available precision (1971); Hida, Li, Bailey, Library
// for double-double and quad-double arithmetic (2001), the accurate variants.
#pragma once

#include <cmath>
#include <limits>

#include "geom/vec.hpp"

namespace geomsrv {

/// hi + lo with |lo| <= ulp(hi) / 2.
struct DoubleDouble {
    double hi = 0.0;
    double lo = 0.0;
};

// Every operation below is off by less than 2^-102 of its result (2^-102 of the larger operand where a sum
// cancels), as long as nothing overflows or leaves the normal range.
inline constexpr double kWideRoundoff = 0x1p-102;

/// a + b exactly (Knuth).
constexpr DoubleDouble two_sum(double a, double b) {
    const double sum = a + b;
    const double part = sum - a;
    return {sum, (a - (sum - part)) + (b - part)};
}

/// a + b exactly where |a| >= |b| or a == 0 (Dekker).
constexpr DoubleDouble quick_two_sum(double a, double b) {
    const double sum = a + b;
    return {sum, b - (sum - a)};
}

/// a * b exactly, by splitting the factors (Veltkamp, Dekker); needs |a|, |b| < 2^996 and no underflow of the
/// parts.
constexpr DoubleDouble two_product(double a, double b) {
    constexpr double kSplitter = 134217729.0;  // 2^27 + 1 halves the 53 bits
    const double product = a * b;
    const double ca = kSplitter * a;
    const double a1 = ca - (ca - a);
    const double a2 = a - a1;
    const double cb = kSplitter * b;
    const double b1 = cb - (cb - b);
    const double b2 = b - b1;
    return {product, ((a1 * b1 - product) + a1 * b2 + a2 * b1) + a2 * b2};
}

constexpr DoubleDouble operator-(DoubleDouble a) { return {-a.hi, -a.lo}; }
constexpr DoubleDouble operator+(DoubleDouble a, DoubleDouble b) {
    DoubleDouble high = two_sum(a.hi, b.hi);
    const DoubleDouble low = two_sum(a.lo, b.lo);
    high = quick_two_sum(high.hi, high.lo + low.hi);
    return quick_two_sum(high.hi, high.lo + low.lo);
}
constexpr DoubleDouble operator-(DoubleDouble a, DoubleDouble b) { return a + (-b); }
constexpr DoubleDouble operator*(DoubleDouble a, DoubleDouble b) {
    const DoubleDouble product = two_product(a.hi, b.hi);
    return quick_two_sum(product.hi, product.lo + (a.hi * b.lo + a.lo * b.hi));
}
constexpr DoubleDouble operator*(DoubleDouble a, double b) {
    const DoubleDouble product = two_product(a.hi, b);
    return quick_two_sum(product.hi, product.lo + a.lo * b);
}
constexpr DoubleDouble operator/(DoubleDouble a, DoubleDouble b) {
    // Long division: three partial quotients of 53 bits each.
    const double q1 = a.hi / b.hi;
    DoubleDouble rest = a - b * q1;
    const double q2 = rest.hi / b.hi;
    rest = rest - b * q2;
    const double q3 = rest.hi / b.hi;
    return quick_two_sum(q1, q2) + DoubleDouble{q3, 0.0};
}

/// Relative error of `quotient`: Joldes, Muller, Popescu 2017, algorithm DWDivDW2, has 15; one for the bound.
inline constexpr double kQuotientError = 16.0 * 0x1p-106;

/// a / b in two divisions; infinite or NaN as in double.
inline DoubleDouble quotient(DoubleDouble a, DoubleDouble b) {
    const double first = a.hi / b.hi;
    if (!(std::fabs(first) < std::numeric_limits<double>::infinity())) {
        return {first, 0.0};
    }
    const DoubleDouble product = two_product(first, b.hi);
    const double rest = ((a.hi - product.hi) - product.lo) + (a.lo - first * b.lo);
    return quick_two_sum(first, rest / b.hi);
}

inline DoubleDouble sqrt(DoubleDouble a) {
    if (!(a.hi > 0.0)) {
        return {};
    }
    // One Newton step from the double root doubles its bits (Karp).
    const double root = std::sqrt(a.hi);
    const DoubleDouble rest = a - two_product(root, root);
    return quick_two_sum(root, rest.hi / (2.0 * root));
}

constexpr bool operator<(DoubleDouble a, DoubleDouble b) {
    return a.hi < b.hi || (a.hi == b.hi && a.lo < b.lo);
}
constexpr bool operator>(DoubleDouble a, DoubleDouble b) { return b < a; }

struct WideVec3 {
    DoubleDouble x;
    DoubleDouble y;
    DoubleDouble z;
};

constexpr WideVec3 widen(Vec3 a) { return {{a.x, 0.0}, {a.y, 0.0}, {a.z, 0.0}}; }
constexpr Vec3 narrow(WideVec3 a) { return {a.x.hi, a.y.hi, a.z.hi}; }
/// b - a without rounding.
constexpr WideVec3 exact_difference(Vec3 b, Vec3 a) {
    return {two_sum(b.x, -a.x), two_sum(b.y, -a.y), two_sum(b.z, -a.z)};
}

constexpr WideVec3 operator-(WideVec3 a) { return {-a.x, -a.y, -a.z}; }
constexpr WideVec3 operator+(WideVec3 a, WideVec3 b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
constexpr WideVec3 operator-(WideVec3 a, WideVec3 b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
constexpr WideVec3 operator*(DoubleDouble s, WideVec3 a) { return {s * a.x, s * a.y, s * a.z}; }
constexpr DoubleDouble dot(WideVec3 a, WideVec3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
constexpr DoubleDouble dot(WideVec3 a, Vec3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
constexpr WideVec3 cross(WideVec3 a, WideVec3 b) {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

}  // namespace geomsrv
