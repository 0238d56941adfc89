// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
// Planes and edges of a convex polytope given by its vertices, for the given numbers exactly.
//
// A box that is not flat has them by definition.  Otherwise points are inserted into a hull one by one, each
// where it lies strictly above some facets; signs are exact (orientations in float64, Enclosed or Exact
// arithmetic), so repeated and coplanar points are harmless.  Bodies of fewer dimensions have planes too:
// both sides of the one they are in, and one through every edge.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "geom/exact_body.hpp"
#include "geom/exact_gjk.hpp"
#include "geom/vec.hpp"

namespace geomsrv {

/// A plane that bounds the body; the normal is a polynomial in the vertices.
struct FacePlane {
    enum class Kind : std::uint8_t {
        facet,   ///< (j - i) x (k - i)
        side,    ///< of a polygon, through its edge: (j - i) x ((j - i) x (k - i)), k another vertex
        end,     ///< of a segment: i - j
        across,  ///< of a segment, along it: (j - i) x coordinate axis k
        axis,    ///< of a point: coordinate axis k
    };
    Kind kind = Kind::facet;
    int i = 0;  ///< in the plane
    int j = 0;
    int k = 0;
    int sign = 1;  ///< of the outward normal
};

/// From one vertex to another; the same twice for a point.
struct FaceEdge {
    int from = 0;
    int to = 0;
    int beside[2] = {-1, -1};  ///< planes on both sides; -1 where the body is flat
};

class PolytopeFaces {
public:
    /// `ordinary`: double-double is worth trying on the given numbers.  The body must outlive this.
    void load(const ExactAndRough& body, bool ordinary);

    [[nodiscard]] std::span<const FacePlane> planes() const { return planes_; }
    [[nodiscard]] std::span<const FaceEdge> edges() const { return edges_; }
    [[nodiscard]] const ExactBody& exact() const { return *exact_; }
    [[nodiscard]] const Core& rough() const { return *rough_; }

    /// Outward normal.
    template <class N>
    [[nodiscard]] VectorOf<N> normal(const FacePlane& plane) const;
    /// Unit, or zero; off by a few u.
    [[nodiscard]] Vec3 rough_normal(const FacePlane& plane) const;

private:
    /// Counter-clockwise from outside.  What the side of a point is told by is found once.
    struct Triangle {
        int corner[3];
        int plane = -1;
        Vec3 base;             ///< its first corner
        Vec3 normal;           ///< of no particular length
        double product = 0.0;  ///< of the sizes of the two edges that the normal is made of
        double sum = 0.0;      ///< and theirs
    };

    [[nodiscard]] Triangle triangle(int i, int j, int k) const;
    [[nodiscard]] int orientation(const Triangle& t, int l) const;
    [[nodiscard]] int rough_orientation(const Triangle& t, Vec3 l) const;
    [[nodiscard]] int exact_orientation(const Triangle& t, int l) const;
    [[nodiscard]] int orientation(int i, int j, int k, int l) const {
        return orientation(triangle(i, j, k), l);
    }
    void find_neighbours();
    template <class F>
    int sign(const F& f) const;
    [[nodiscard]] Vec3 point(int i) const;
    void load_box();
    void load_point(int i);
    void load_segment(int i, int j);
    void load_polygon(int i, int j, int k);
    void load_solid(const int (&start)[4]);
    void insert(int point);
    void add(int i, int j, int k, int inside);
    void merge();
    void join(const FaceEdge& piece);

    const ExactBody* exact_ = nullptr;
    const Core* rough_ = nullptr;
    bool ordinary_ = false;
    double doubt_ = 0.0;  // of an arm between two rounded vertices
    std::vector<FacePlane> planes_;
    std::vector<FaceEdge> edges_;
    std::vector<Triangle> triangles_;
    std::vector<FaceEdge> horizon_;
    std::vector<int> first_side_;  // of a vertex: the first of the sides 3 triangle + k that start there
    std::vector<int> next_side_;   // of a side: the next that starts at the same vertex
    std::vector<int> end_;         // of a side: the vertex at its end
    std::vector<int> twin_;        // of a side: the one that runs back
    std::vector<int> open_;        // triangles whose neighbours are to be looked at
    std::vector<int> pieces_;      // of a plane: its triangles
};

template <class N>
VectorOf<N> PolytopeFaces::normal(const FacePlane& plane) const {
    using Kind = FacePlane::Kind;
    const auto step = [&](int from, int to) { return step_times_denominator<N>(*exact_, from, to); };
    const auto axis = [&](int k) {
        return exactly<N>({k == 0 ? 1.0 : 0.0, k == 1 ? 1.0 : 0.0, k == 2 ? 1.0 : 0.0});
    };
    VectorOf<N> n;
    switch (plane.kind) {
        case Kind::facet:
            n = cross(step(plane.i, plane.j), step(plane.i, plane.k));
            break;
        case Kind::side: {
            const VectorOf<N> edge = step(plane.i, plane.j);
            n = cross(edge, cross(edge, step(plane.i, plane.k)));
            break;
        }
        case Kind::end:
            n = step(plane.j, plane.i);
            break;
        case Kind::across:
            n = cross(step(plane.i, plane.j), axis(plane.k));
            break;
        case Kind::axis:
            n = axis(plane.k);
            break;
    }
    return plane.sign > 0 ? n : -n;
}

}  // namespace geomsrv
