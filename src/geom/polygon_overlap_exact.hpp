// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
// Intersection of two convex polygons at rest, exactly as the given numbers have it.
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "geom/enclosed.hpp"
#include "geom/polygon_exact.hpp"
#include "geom/polygon_pair.hpp"
#include "geom/vec.hpp"

namespace geomsrv {

class ExactPolygonOverlap {
public:
    /// The corners of the intersection, each rounded to nearest: counter-clockwise, beginning where the
    /// direction of the edges is 0 degrees or next to it (the lowest corner); a segment's two ends in order
    /// of x, then y; or one point.  None if the polygons are apart.  Valid until the next call.
    ///
    /// They are the corners of the exact intersection, all of them and no other, even where rounding leaves
    /// several in one place.
    std::span<const Vec2> of(const PolygonPair& pair, bool in_range, Rung& rung);

private:
    /// A corner, and the edge along which the boundary leaves it.
    struct Corner {
        Vec2 at;
        int side;
        std::size_t edge;
    };

    struct Sides {
        std::vector<double> of;        ///< all vertices of a polygon, for each edge of the other
        std::vector<double> furthest;  ///< each vertex, of the edge that it is furthest beyond
        std::size_t stride = 0;
    };

    void find_sides(const PolygonPair& pair, int side);
    /// Whether a vertex is beyond (1) an edge of the other polygon, on its line (0) or behind (-1).
    [[nodiscard]] double side_of(int side, std::size_t vertex, std::size_t edge) const {
        return sides_[static_cast<std::size_t>(side)]
            .of[edge * sides_[static_cast<std::size_t>(side)].stride + vertex];
    }
    [[nodiscard]] double furthest(int side, std::size_t vertex) const {
        return sides_[static_cast<std::size_t>(side)].furthest[vertex];
    }
    [[nodiscard]] bool is_inside(const PolygonPair& pair, int side, std::size_t vertex) const;
    void add_vertices(const PolygonPair& pair, int side);
    void add_crossings(const PolygonPair& pair, bool in_range, Rung& rung);

    std::array<Sides, 2> sides_;
    std::vector<Corner> corners_;
    std::vector<Vec2> points_;
};

}  // namespace geomsrv
