// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
// First contact of the boxes and spheres around two translating polytopes: cheap, and never too late.
#pragma once

#include <cstddef>

#include "geom/polytope_first_contact.hpp"

namespace geomsrv {

class BoundPolytopeContactSolver {
public:
    BoundPolytopeContactSolver(std::size_t /*most_a*/, std::size_t /*most_b*/) {}

    /// `never` where the volumes never meet, which is certain.  Otherwise they may: from `time` on, which is
    /// `time_lower`, until `time_upper`, which is `last_time`, at the latest; `touching` if from the start.
    /// No normal, no points.
    PolytopeContact solve(const MovingBody& a, const MovingBody& b, double t_max, bool contact_set) const;
};

}  // namespace geomsrv
