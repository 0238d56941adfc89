// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
// Where two polygons touch, by the vertices that end their contact.  How these are found is each tier's own.
#pragma once

#include <array>
#include <cstddef>
#include <span>

#include "geom/polygon_pair.hpp"
#include "geom/polygon_window.hpp"
#include "geom/vec.hpp"

namespace geomsrv {

/// A vertex and where it lies along the contact line.
struct Mark {
    int side;
    std::size_t vertex;
    double place;
};

/// Ends of the common part of two faces, in order counter-clockwise around a; not a segment: one point
/// between them.
struct ContactMarks {
    Mark low;
    Mark high;
    bool segment;
};

/// The contact set at `moment`, in units of the pair and its motion, `time` in seconds; kept in `points`.
std::span<const Vec2> contact_points(const PolygonPair& pair, const Motion& motion, const ContactMarks& marks,
                                     const std::array<Vec2, 2>& velocities, double moment, double time,
                                     std::array<Vec2, 2>& points);

}  // namespace geomsrv
