// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
// Intersection of two convex polygons at rest.
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "geom/polygon.hpp"
#include "geom/polygon_pair.hpp"
#include "geom/vec.hpp"

namespace geomsrv {

class PolygonOverlap {
public:
    /// Vertices of the intersection, in given coordinates: strictly convex and counter-clockwise, or the two
    /// ends of a segment, or one point; none if the polygons are apart by more than the slack.  Vertices
    /// within the slack of each other, or of the line through their neighbours, are merged.  Valid until the
    /// next call.
    std::span<const Vec2> of(const PolygonPair& pair, Slack slack);

private:
    void add_part_inside(const PolygonPair& pair, int side, Slack slack);

    std::vector<std::array<std::size_t, 2>> crossed_;  // edges of a and of b whose crossing is known
    std::vector<Vec2> found_;
    std::vector<Vec2> merged_;
    StrictHull hull_;
};

}  // namespace geomsrv
