// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
// Distance, nearest points and penetration depth of two convex polygons at rest, as exact arithmetic on the
// given numbers says.
#pragma once

#include <cstddef>
#include <vector>

#include "geom/enclosed.hpp"
#include "geom/polygon_distance.hpp"
#include "geom/polygon_exact.hpp"
#include "geom/polygon_overlap_exact.hpp"
#include "geom/polygon_pair.hpp"

namespace geomsrv {

/// As `PolygonDistanceSolver`: distance and points are correctly rounded, the bounds an ulp apart or equal.
///
/// Holds scratch memory for polygons of at most so many vertices.
class ExactPolygonDistanceSolver {
public:
    ExactPolygonDistanceSolver(std::size_t largest_a, std::size_t largest_b) : pair_(largest_a, largest_b) {}

    /// Without `penetration` no depth is found.
    PolygonDistance solve(Ring a, Ring b, bool penetration);

private:
    PolygonPair pair_;
    ExactPolygonOverlap overlap_;
    std::vector<AxisOf> touching_;
};

}  // namespace geomsrv
