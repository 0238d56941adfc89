// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
// Signed distance of two placed cores in single precision: moved to a local origin in double, brought to size
// 1 by a power of two, rounded, and solved by the general algorithm; the rounding is part of the bounds.
#pragma once

#include "geom/half_space_pairs.hpp"
#include "geom/separation.hpp"

namespace geomsrv {

CoreSeparation single_distance(const Core& a, const Core& b, bool penetration);
CoreSeparation single_distance(const Core& a, const PlacedHalfSpace& b, bool penetration);

}  // namespace geomsrv
