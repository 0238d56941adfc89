// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
// Distance, nearest points and penetration depth of two convex polygons at rest.
#pragma once

#include <cstddef>

#include "geom/enclosed.hpp"
#include "geom/polygon.hpp"
#include "geom/polygon_overlap.hpp"
#include "geom/polygon_pair.hpp"
#include "geom/vec.hpp"

namespace geomsrv {

struct PolygonDistance {
    double distance = 0.0;  ///< [m], > 0 apart; overlapping: minus the depth, or 0 if that was not asked for
    double lower = 0.0;     ///< the exact distance is not less,
    double upper = 0.0;     ///< and not more
    Vec2 point_a;  ///< nearest point of a; its deepest point in b; or, depth not asked for, a common point
    Vec2 point_b;  ///< likewise of b; point_b = point_a + distance * normal up to rounding
    Vec2 normal;   ///< unit, from a to b: moving b by depth * normal parts them
    bool meet = false;         ///< whether they have a common point
    bool certain = true;       ///< ... as is proven for the given numbers
    Rung rung = Rung::filter;  ///< what it took
};

/// Holds scratch memory for polygons of at most so many vertices, so that a query allocates nothing.
class PolygonDistanceSolver {
public:
    PolygonDistanceSolver(std::size_t largest_a, std::size_t largest_b) : pair_(largest_a, largest_b) {}

    /// Without `penetration` no depth is found.
    PolygonDistance solve(Ring a, Ring b, bool penetration);

private:
    PolygonPair pair_;
    PolygonOverlap overlap_;
};

}  // namespace geomsrv
