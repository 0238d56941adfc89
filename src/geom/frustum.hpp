// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
// View frusta in space and in the plane, and the linear map into their coordinates.
//
//   a, b, d = coordinates along L (left), U (up), D (view direction) of a point minus the apex E
//
//   near <= d <= far,   l0/near <= a/d <= l1/near,   u0/near <= b/d <= u1/near
//
// Paper 2 section 3 with l0 = -l, l1 = l, u0 = -mu, u1 = mu; off-centre windows are ours.
#pragma once

#include <cmath>

#include "geom/vec.hpp"

// One binary serves every x86-64: the loop is compiled twice and the loader picks the wider one where the processor has
// it.  Both give the same bits, because contraction is off and a fused multiply-add is only used where std::fma says so.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)
#define GEOMSRV_WIDE_CLONES __attribute__((target_clones("default", "arch=x86-64-v3")))
#else
#define GEOMSRV_WIDE_CLONES
#endif
/// A function that must melt into its caller, to be compiled for the caller's instruction set.
#define GEOMSRV_INLINE [[gnu::always_inline]] inline

namespace geomsrv {

/// Unit roundoff of double, 2^-53: |fl(x op y) - x op y| <= u |x op y|.
inline constexpr double kUnitRoundoff = 0x1p-53;

struct Frustum {
    Vec3 origin;                    ///< apex E [m], world frame
    Mat3 axes;                      ///< rows L, U, D, world frame; literal, off orthonormal by at most 1e-2
    double l0 = -1.0, l1 = 1.0;     ///< window along L on the near plane [m], l0 < l1
    double u0 = -1.0, u1 = 1.0;     ///< window along U on the near plane [m], u0 < u1
    double near = 1.0, far = 2.0;   ///< depths along D [m], 0 < near < far
};

/// a b - c d with at most 2 units of roundoff, whatever cancels (Kahan; Jeannerod, Louvet, Muller 2013, theorem 3.1).
template <class Real>
GEOMSRV_INLINE Real difference_of_products(Real a, Real b, Real c, Real d) {
    const Real cd = c * d;
    const Real error = std::fma(-c, d, cd);
    return std::fma(a, b, -cd) + error;
}

/// Dual basis of (L, U, D): row i has scalar product 1 with axis i and 0 with the others, so row i times X - E is the
/// i-th frustum coordinate even where the axes are not quite orthonormal.  For orthonormal axes it is `axes` itself.
///
/// Each entry has a relative error of at most kDualError: 2u from the minor, 5.4u from the determinant (products and
/// sums of the three minors, which have Cauchy-Schwarz sum of magnitudes <= 1.05 det), u from the division.
inline constexpr double kDualError = 9.0 * kUnitRoundoff;

inline Mat3 dual_basis(const Mat3& axes) {
    const auto minor = [](Vec3 a, Vec3 b) -> Vec3 {
        return {difference_of_products(a.y, b.z, a.z, b.y), difference_of_products(a.z, b.x, a.x, b.z),
                difference_of_products(a.x, b.y, a.y, b.x)};
    };
    const auto [left, up, view] = axes.row;
    const Vec3 rows[3] = {minor(up, view), minor(view, left), minor(left, up)};
    const double det = dot(left, rows[0]);
    Mat3 dual;
    for (int i = 0; i < 3; ++i) {
        dual.row[i] = {rows[i].x / det, rows[i].y / det, rows[i].z / det};
    }
    return dual;
}

}  // namespace geomsrv
