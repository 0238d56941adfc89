// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
// Two faces in one plane, and the points at which what they share ends: vertices of two bodies, projected
// along a normal, and their edges cut by one another's.
#pragma once

#include <algorithm>
#include <vector>

#include "geom/vec.hpp"

namespace geomsrv {

/// The part of an edge within a bound, by its ends' heights above it; false if nothing is left.
inline bool clip_part(double from, double to, double slack, double& first, double& last) {
    if (from <= slack && to <= slack) {
        return true;
    }
    if (from > slack && to > slack) {
        return false;
    }
    // One end is outside by more than the slack, the other is inside or near the bound.
    const double crossing = std::clamp(from / (from - to), 0.0, 1.0);
    if (from > to) {
        first = std::max(first, crossing);
    } else {
        last = std::min(last, crossing);
    }
    return true;
}

/// The two coordinates that are left when looking along the largest component of a normal, in the order that
/// makes counter-clockwise about the normal.
void choose_axes(Vec3 normal, int (&axis)[2]);

class ContactPlane {
public:
    /// On an edge of a body, or at a vertex of it if both ends are the same.
    struct Point {
        double x, y;  ///< in the plane of contact
        int body;
        int from, to;
        double part;  ///< of the way from one to the other
    };

    /// See choose_axes().
    void face(Vec3 normal);
    [[nodiscard]] Vec2 flat(Vec3 v) const;

    /// Finds the ends of what is left of the edges of each face within the other.
    void cross(double slack);

    /// Of points within the slack of one another leaves one: a vertex, of a before b.
    void merge(std::vector<Point>& points, double slack);
    /// Leaves the corners of the hull, counter-clockwise; of points within the slack of one another, one.
    void hull(std::vector<Point>& points, double slack);

    /// What was collected of a body.
    [[nodiscard]] std::vector<Point>& face_of(int body) { return face_[body]; }
    [[nodiscard]] std::vector<Point>& found() { return found_; }

    static bool vertices_first(const Point& p, const Point& q);

private:
    struct Side {
        double nx, ny, offset;  ///< nx x + ny y <= offset, unit normal
    };

    void sides_of(const std::vector<Point>& ring);
    void clip(const std::vector<Point>& ring, double slack);

    int axis_[2] = {0, 1};
    std::vector<Point> face_[2];
    std::vector<Point> found_;
    std::vector<Point> chain_;
    std::vector<Side> sides_;
};

}  // namespace geomsrv
