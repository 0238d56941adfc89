// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
// When and where two translating convex polygons first touch, as exact arithmetic on the given numbers says.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "geom/enclosed.hpp"
#include "geom/polygon_exact.hpp"
#include "geom/polygon_first_contact.hpp"
#include "geom/polygon_overlap_exact.hpp"
#include "geom/polygon_pair.hpp"
#include "geom/vec.hpp"

namespace geomsrv {

/// As `FirstContactSolver`, without slack: numbers and points are correctly rounded, the times an ulp apart
/// or equal, the status always certain.  A time beyond the doubles is infinite, not never.
///
/// Of several axes along which contact begins, or is, the normal is the one along which the polygons approach
/// fastest; if that does not tell, the most clockwise one.
///
/// Holds scratch memory for polygons of at most so many vertices.
class ExactFirstContactSolver {
public:
    ExactFirstContactSolver(std::size_t largest_a, std::size_t largest_b);

    /// Contact within [0, t_max], t_max >= 0 or infinite.  Without `contact_set` no points are found.
    FirstContact solve(const MovingPolygon& a, const MovingPolygon& b, double t_max, bool contact_set);

    /// The same of a pair about which something is known beforehand (polygon_motion.hpp).
    FirstContact solve(const MovingPolygon& a, const MovingPolygon& b, double t_max, bool contact_set,
                       const PolygonMotion& known);

private:
    PolygonPair pair_;
    ExactPolygonOverlap overlap_;
    std::vector<AxisOf> entries_;
    std::vector<AxisOf> exits_;
    std::vector<AxisOf> touching_;
    std::array<Vec2, 2> points_;
};

}  // namespace geomsrv
