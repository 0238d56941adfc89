// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
// Signed distance by bounding spheres and boxes only: never more than the true one.
#pragma once

#include "geom/half_space_pairs.hpp"
#include "geom/separation.hpp"

namespace geomsrv {

/// `value` and `lower` are a proven lower bound of the signed distance, `normal` a direction with that gap;
/// `upper` is what two points of the bodies are apart.  No nearest points.
CoreSeparation bounding_distance(const Core& a, const Core& b);
CoreSeparation bounding_distance(const Core& a, const PlacedHalfSpace& b);

}  // namespace geomsrv
