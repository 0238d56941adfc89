// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
// Which points two polytopes share that are a hair apart, because they are seen just before they touch.
//
// Where points p of a and q of b touch a little later, they are now no further apart than they come nearer
// until then: by D.  Along any direction n in which the bodies do not overlap, n . p is within D of the
// highest of a and n . q within D of the lowest of b.  So what touches ends at vertices within D of the
// outermost ones, or where edges between such vertices cross, seen along n; and each of these ends is near
// the other body.  That is looked up: nothing that is found is further than D from either body.
#pragma once

#include <span>
#include <vector>

#include "geom/contact_plane.hpp"
#include "geom/core.hpp"
#include "geom/vec.hpp"

namespace geomsrv {

/// What is the same, as far as can be told; in the units of the bodies.
struct ContactBand {
    double apart;    ///< what is found on a body is no further from the other
    double near;     ///< D, and what rounds
    double wide[2];  ///< by how much more a face of a, of b, may lean where it goes on beyond what touches
    double margin;   ///< bodies touch where they are so far apart
};

class PlacedContactPoints {
public:
    /// The points midway between the bodies at which their contact ends, seen along the first of the normals
    /// (unit, from a to b): corners of a polygon, counter-clockwise about it, two ends, or `point` alone.
    /// `point`, between the nearest points, is within `near` of their hull.
    std::span<const Vec3> between(const Core& a, const Core& b, std::span<const Vec3> normals, Vec3 point,
                                  const ContactBand& band);

private:
    using Point = ContactPlane::Point;

    struct Candidate {
        int body;
        Vec3 place;
    };

    void look(const Core& a, const Core& b, Vec3 normal, const ContactBand& band, const double height[2]);
    void collect(const Core& core, Vec3 normal, double height, int body, Vec2 shift);
    void keep_outermost(const Core& core, Vec3 normal, double near, int body);
    bool same_faces();

    ContactPlane plane_;
    std::vector<int> known_[2];  // vertices of the faces of the last look
    std::vector<Point> rows_;
    std::vector<Point> sorted_;
    std::vector<Candidate> candidates_;
    std::vector<Vec3> middles_;
    std::vector<Vec3> points_;
};

}  // namespace geomsrv
