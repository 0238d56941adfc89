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

#include "geom/moving_pair.hpp"
#include "geom/polytope_faces.hpp"
#include "geom/vec.hpp"

namespace geomsrv {

/// How near is the same, in the units of a pair.
struct ContactSlack {
    double height;  ///< across the plane of contact
    double place;   ///< in it
};

class ContactPoints {
public:
    /// Bodies that touch along a unit normal, `moment` after the start in the units of the pair.  The points
    /// are the corners of a polygon, counter-clockwise about the normal, two ends, or one.
    std::span<const Vec3> touching(const MovingPair& pair, Vec3 normal, double moment,
                                   const ContactSlack& slack);

    /// Bodies that overlap at the start: the vertices of what they share.
    std::span<const Vec3> overlapping(const MovingPair& pair, double slack);

private:
    /// On an edge of a body, or at a vertex of it if both ends are the same.
    struct Point {
        double x, y;  ///< in the plane of contact
        int body;
        int from, to;
        double part;  ///< of the way from one to the other
    };
    struct Side {
        double nx, ny, offset;  ///< nx x + ny y <= offset, unit normal
    };

    struct Plane {
        Vec3 normal;  ///< unit, outward
        Vec3 base;
    };

    void collect(const Core& core, int listed, Vec3 normal, double slack, int body, Vec2 shift, bool lowest);
    static bool vertices_first(const Point& p, const Point& q);
    void hull(std::vector<Point>& points, double slack);
    void sides_of(const std::vector<Point>& ring);
    void clip(const std::vector<Point>& ring, double slack);
    void bounds_of(const Core& core, const PolytopeFaces& faces);
    [[nodiscard]] Vec3 world(const MovingPair& pair, const Point& point, double moment) const;

    int axis_[2] = {0, 1};
    std::vector<Point> face_[2];
    std::vector<Point> found_;
    std::vector<Point> chain_;
    std::vector<Side> sides_;
    PolytopeFaces faces_[2];
    std::vector<Plane> bounds_;
    std::vector<double> rows_;
    std::vector<Vec3> points_;
};

}  // namespace geomsrv
