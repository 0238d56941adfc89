// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
// Signed distance of any two cores: the general path, and the last resort of the closed forms.
#pragma once

#include "geom/gjk.hpp"
#include "geom/separation.hpp"

namespace geomsrv {

/// With `penetration` overlapping cores get their depth; without it only a common point.
CoreSeparation convex_convex(const Core& a, const Core& b, bool penetration);

/// The same in single precision.
CoreSeparation convex_convex(const SingleCore& a, const SingleCore& b, bool penetration);

/// Deepest points along a normal: where a and b, moved out along it until they touch, have their nearest
/// points.
Gjk points_along(const Core& a, const Core& b, Vec3 normal);

}  // namespace geomsrv
