// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
// Which points two translating polytopes share when they first touch, for the given numbers exactly.
//
// As contact_points.hpp, without slack: which vertices are in the plane of contact, which edges cross, and
// what ends a clipped edge are signs found in Enclosed or Exact arithmetic; coordinates are then rounded
// once.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "geom/exact_ray.hpp"
#include "geom/polytope_faces.hpp"
#include "geom/vec.hpp"

namespace geomsrv {

class ExactContactPoints {
public:
    /// Bodies that touch at that end of the line: the corners of a polygon, counter-clockwise about the
    /// normal from a to b, or two ends, or one point.  `at_start`: at time 0, otherwise at the time of that
    /// end.
    std::span<const Vec3> touching(ExactRay& ray, RayEnd end, bool at_start);

    /// Bodies that overlap at the start: the vertices of what they share, in lexicographic order.
    std::span<const Vec3> overlapping(ExactRay& ray);

private:
    /// A vertex of a face in the plane of contact, seen along a coordinate axis, at the time of contact and
    /// times its denominator; relative to a.
    template <class N>
    struct Flat {
        N x, y;
    };
    struct Corner {
        int vertex;
        Flat<Enclosed> wide;
        std::optional<Flat<Exact>> exact;
    };
    /// x / w, y / w, z / w
    template <class N>
    struct Homogeneous {
        VectorOf<N> at;
        N w;
    };
    /// A corner of a face (both ends the same), or the crossing of an edge with one of the other.
    struct Point {
        int body;
        int from, to;
        int other_from, other_to;
        Homogeneous<Enclosed> wide;
        std::optional<Homogeneous<Exact>> exact;
    };
    /// Where an edge of a body ends when clipped by the other: at a vertex, or in a plane.
    struct Cut {
        int body;
        std::size_t edge;
        int vertex;  ///< -1 if in a plane
        std::size_t plane;
        Vec3 rough;
    };

    template <class N>
    void time(N& numerator, N& denominator) const;
    template <class N>
    [[nodiscard]] Flat<N> flat_of(int body, int vertex) const;
    template <class N>
    const Flat<N>& flat(int body, int corner);
    template <class N>
    N area(int body_p, int p, int body_q, int q, int body_r, int r);
    template <class N>
    static Homogeneous<N> oriented(const Homogeneous<N>& h);
    template <class N>
    Homogeneous<N> place_of(const Point& point);
    template <class N>
    const Homogeneous<N>& place(Point& point);
    template <class N>
    [[nodiscard]] Homogeneous<N> place(const Cut& cut) const;
    int side(int body_p, int p, int body_q, int q, int body_r, int r);
    int turn(Point& p, Point& q, Point& r);
    int compare(Point& p, Point& q);
    bool contains(int body, int corner);
    void ring_of(int body);
    void add(int body, int from, int to, int other_from, int other_to);
    void order();
    template <class N>
    [[nodiscard]] N height(int body, std::size_t plane, int vertex) const;
    [[nodiscard]] double rough_height(int body, std::size_t plane, int vertex) const;
    int side_of(int body, std::size_t plane, int vertex);
    bool later(int body, const FaceEdge& edge, std::size_t plane, std::size_t other);
    bool enters_after(int body, const FaceEdge& edge, std::size_t entry_plane, std::size_t exit_plane);
    void clip(int body, std::size_t edge);
    void add(const Cut& cut);
    template <class Place>
    Vec3 rounded(const Place& place) const;

    ExactRay* ray_ = nullptr;
    RayEnd end_ = RayEnd::enter;
    bool at_start_ = true;
    int axis_[2] = {0, 1};
    std::vector<Corner> corner_[2];
    std::vector<int> face_[2];
    std::vector<int> ring_[2];
    std::vector<int> chain_;
    std::vector<Point> found_;
    PolytopeFaces faces_[2];
    std::vector<Vec3> normals_[2];
    std::vector<Cut> cuts_;
    std::vector<Vec3> points_;
};

}  // namespace geomsrv
