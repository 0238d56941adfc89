// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
// First contact and distance of the boxes and circles around two polygons: cheap, and never too late or too
// far.
#pragma once

#include <cstddef>

#include "geom/polygon_distance.hpp"
#include "geom/polygon_first_contact.hpp"

namespace geomsrv {

class BoundFirstContactSolver {
public:
    BoundFirstContactSolver(std::size_t /*largest_a*/, std::size_t /*largest_b*/) {}

    /// `never` where the volumes never meet, which is certain.  Otherwise they may: from `time` on, which is
    /// `time_lower`, until `time_upper`, which is `last_time`, at the latest; `touching` if from the start.
    /// No normal, no points.
    FirstContact solve(const MovingPolygon& a, const MovingPolygon& b, double t_max, bool contact_set) const;
};

class BoundPolygonDistanceSolver {
public:
    BoundPolygonDistanceSolver(std::size_t /*largest_a*/, std::size_t /*largest_b*/) {}

    /// The distance of the volumes, or with `penetration` minus their depth, is `distance` and `lower`;
    /// `upper` is that of two vertices.  No normal, no points.
    PolygonDistance solve(Ring a, Ring b, bool penetration) const;
};

}  // namespace geomsrv
