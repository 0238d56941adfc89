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
#include <cstddef>
#include <type_traits>
#include <utility>

#include "geom/lanes.hpp"
#include "geom/rounding.hpp"
#include "geom/vec.hpp"

namespace geomsrv {

struct Frustum {
    Vec3 origin;                   ///< apex E [m], world frame
    Mat3 axes;                     ///< rows L, U, D, world frame; literal, off orthonormal by at most 1e-2
    double l0 = -1.0, l1 = 1.0;    ///< window along L on the near plane [m], l0 < l1
    double u0 = -1.0, u1 = 1.0;    ///< window along U on the near plane [m], u0 < u1
    double near = 1.0, far = 2.0;  ///< depths along D [m], 0 < near < far
};

/// step(0), ..., step(Count - 1) with constant arguments: a loop around this one can become vector code.
template <std::size_t Count, class Step>
GEOMSRV_INLINE void unrolled(Step step) {
    [&]<std::size_t... Index>(std::index_sequence<Index...>) __attribute__((always_inline)) {
        (step(std::integral_constant<int, Index>{}), ...);
    }(std::make_index_sequence<Count>{});
}

/// a b - c d with at most 2 units of roundoff, whatever cancels (Kahan's algorithm; Jeannerod, Louvet and
/// Muller, "Further analysis of Kahan's algorithm for the accurate computation of 2x2 determinants", 2013).
template <class Number>
GEOMSRV_INLINE Number difference_of_products(const Number& a, const Number& b, const Number& c,
                                             const Number& d) {
    const Number cd = c * d;
    const Number error = fused_multiply_add(-c, d, cd);
    return fused_multiply_add(a, b, -cd) + error;
}

/// Rows of a small square matrix.
template <class Real, int Size>
struct Rows {
    Real row[Size][Size];
};

/// Dual basis of the axes: row i has scalar product 1 with axis i and 0 with the others, so row i times X - E
/// is the i-th frustum coordinate even where the axes are not quite orthonormal.  For orthonormal axes it is
/// the axes themselves.
///
/// Each entry has a relative error of at most 9 units of roundoff: 2 from the minor, 5.4 from the determinant
/// (2 minors, 1 product, 2 sums, of terms that sum to at most 1.05 times it in magnitude), 1 from the
/// division.

template <class Real>
Rows<Real, 3> dual_basis(const Rows<double, 3>& axes) {
    Rows<Real, 3> dual;
    for (int i = 0; i < 3; ++i) {
        const double* const a = axes.row[(i + 1) % 3];
        const double* const b = axes.row[(i + 2) % 3];
        for (int k = 0; k < 3; ++k) {
            const int y = (k + 1) % 3, z = (k + 2) % 3;
            dual.row[i][k] = difference_of_products<Real>(a[y], b[z], a[z], b[y]);
        }
    }
    const Real det =
        axes.row[0][0] * dual.row[0][0] + axes.row[0][1] * dual.row[0][1] + axes.row[0][2] * dual.row[0][2];
    for (auto& row : dual.row) {
        for (Real& entry : row) entry /= det;
    }
    return dual;
}

template <class Real>
Rows<Real, 2> dual_basis(const Rows<double, 2>& axes) {
    const auto& [left, view] = axes.row;
    const Real det = difference_of_products<Real>(left[0], view[1], left[1], view[0]);
    return {{{view[1] / det, -view[0] / det}, {-left[1] / det, left[0] / det}}};
}

}  // namespace geomsrv
