// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
// On which side of a plane through three points a fourth lies, decided exactly.
#pragma once

#include "geom/double_double.hpp"
#include "geom/vec.hpp"

namespace geomsrv {

/// Sign of det[b - a, c - a, d - a] in exact arithmetic: +1 where d lies on the side to which (b - a) x (c -
/// a) points, -1 on the other, 0 where the four points are coplanar.
///
/// Laws: swapping two arguments flips the sign; the sign is 0 if two arguments are equal.
/// REQUIRES: coordinates that are 0 or between 2^-300 and 2^300 in size, so that no product leaves the normal
/// range.
int orientation_3d(Vec3 a, Vec3 b, Vec3 c, Vec3 d);

/// (b - a) x (c - a) from exact products: every component is right to 2^-100 of itself, even where almost all
/// of it cancels, so that a needle of a triangle still has a normal.  REQUIRES: as above.
WideVec3 triangle_normal(Vec3 a, Vec3 b, Vec3 c);

}  // namespace geomsrv
