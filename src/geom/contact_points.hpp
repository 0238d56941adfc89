// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
// Which points two translating polytopes share, in float64 and within the rounding of the input.
//
// Where they touch along a normal, those of two faces in one plane: the vertices within the slack of the
// highest of a and the lowest of b.  Where they overlap, those of a polytope, whose vertices end the edges of
// each body when clipped by the planes of the other.
#pragma once

#include <span>
#include <vector>

#include "geom/contact_plane.hpp"
#include "geom/moving_pair.hpp"
#include "geom/polytope_faces.hpp"
#include "geom/vec.hpp"

namespace geomsrv {

/// How near is the same, in the units of a pair.
struct ContactSlack {
    double height;  ///< across the plane of contact
    double place;   ///< in it
};

// Squared sine of the angle above which two edges share one point: what a slack moves across one of them then
// moves no further than eight times that along the other.
inline constexpr double kClearAngle = 0x1p-6;

class ContactPoints {
public:
    /// Bodies that touch along a unit normal, `moment` after the start in the units of the pair.  The points
    /// are the corners of a polygon, counter-clockwise about the normal, two ends, or one.
    std::span<const Vec3> touching(const MovingPair& pair, Vec3 normal, double moment,
                                   const ContactSlack& slack);

    /// Bodies that overlap at the start: the vertices of what they share.
    std::span<const Vec3> overlapping(const MovingPair& pair, double slack);

private:
    using Point = ContactPlane::Point;

    /// Planes that bound a body: unit outward normals and a point of each, by coordinates; padded to whole
    /// lanes by planes that nothing is outside of.
    struct Planes {
        std::vector<Vec3> normal;
        std::vector<double> row[6];
    };

    /// A point of two overlapping bodies, and a direction in which it is likely to be the furthest.
    struct Corner {
        Point point;
        Vec3 place;
        Vec3 outward;
    };

    void collect(const Core& core, int listed, Vec3 normal, double slack, int body, Vec2 shift, bool lowest);
    bool cross_edges();
    static void bounds_of(const Core& core, const PolytopeFaces& faces, Planes& out);
    void add_corners(const MovingPair& pair, int body, double slack);
    [[nodiscard]] bool stands_out(std::size_t corner, double slack) const;
    [[nodiscard]] bool is_in_hull_of_others(std::size_t corner, double reach, double slack);
    [[nodiscard]] Vec3 world(const MovingPair& pair, const Point& point, double moment) const;

    ContactPlane plane_;
    std::vector<double> heights_;  // of vertices, along the normal or above the planes of the other body
    PolytopeFaces faces_[2];
    Planes bounds_[2];
    std::vector<Vec3> outward_;  // of each vertex of a body
    std::vector<char> taken_;    // of each, whether it is a corner already: it ends several edges
    std::vector<Corner> corners_;
    std::vector<double> rows_;
    std::vector<Vec3> points_;
};

}  // namespace geomsrv
