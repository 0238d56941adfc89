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
    struct Triangle {
        int corner[3];
        int plane = -1;
    };

    int orientation(int i, int j, int k, int l) const;
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
    std::vector<FacePlane> planes_;
    std::vector<FaceEdge> edges_;
    std::vector<Triangle> triangles_;
    std::vector<Triangle> kept_;
    std::vector<FaceEdge> horizon_;
};

template <class N>
VectorOf<N> PolytopeFaces::normal(const FacePlane& plane) const {
    using Kind = FacePlane::Kind;
    const auto at = [&](int i) { return vertex_times_denominator<N>(*exact_, i); };
    const auto axis = [&](int k) {
        return exactly<N>({k == 0 ? 1.0 : 0.0, k == 1 ? 1.0 : 0.0, k == 2 ? 1.0 : 0.0});
    };
    VectorOf<N> n;
    switch (plane.kind) {
        case Kind::facet:
            n = cross(at(plane.j) - at(plane.i), at(plane.k) - at(plane.i));
            break;
        case Kind::side: {
            const VectorOf<N> edge = at(plane.j) - at(plane.i);
            n = cross(edge, cross(edge, at(plane.k) - at(plane.i)));
            break;
        }
        case Kind::end:
            n = at(plane.i) - at(plane.j);
            break;
        case Kind::across:
            n = cross(at(plane.j) - at(plane.i), axis(plane.k));
            break;
        case Kind::axis:
            n = axis(plane.k);
            break;
    }
    return plane.sign > 0 ? n : -n;
}

}  // namespace geomsrv
