// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
// Where a line through the origin enters and leaves K = {q - p : p in a, q in b}, for the given numbers
// exactly.
//
// The steps are those of line_cast.hpp, without rounding: every sign is found in Enclosed arithmetic or,
// where that leaves it open, in Exact.  What degenerates is not perturbed away but named.  Where the line, a
// point as seen along itself, lies on the border of K, there is a direction m across the line along which no
// vertex of K is lower than 0, a *wall*; all the line has in common with K is in the face of K in that wall,
// which is the difference of two faces of the bodies.  The same problem follows one dimension lower, and
// again if the line is on the border there:
//
//     2  three corners around the line     the facet through them
//     1  two corners at either side of it  the edge through them
//     0  one corner on it
#pragma once

#include <cstdint>
#include <span>
#include <type_traits>
#include <vector>

#include "geom/core.hpp"
#include "geom/enclosed.hpp"
#include "geom/exact_body.hpp"
#include "geom/exact_gjk.hpp"
#include "geom/line_cast.hpp"
#include "geom/vec.hpp"

namespace geomsrv {

/// Corners of K where the line enters or leaves: `dimension` + 1 of them.
struct RayFeature {
    int dimension = -1;
    VertexPair corner[3];
};

/// A direction across the line, from a to b: `sign` times the product of the line's direction with the first
/// corner, with the difference of two, or with a coordinate axis.
struct RayWall {
    enum class Kind : std::uint8_t { none, corner, chord, axis };
    Kind kind = Kind::none;
    int sign = 1;
    int axis = 0;
    VertexPair corner[2];
};

enum class RayEnd : std::uint8_t { enter, leave };

class ExactRay {
public:
    /// Bodies that move with the same velocity get a line along the x axis.  `ordinary`: double-double is
    /// worth trying.
    ExactRay(const ExactAndRough& a, const ExactAndRough& b, Vec3 velocity_a, Vec3 velocity_b, bool ordinary);

    /// Whether the line meets K; finds both ends if so.
    bool meets(const LineCast& guess);

    /// The line passes through the inside of K, or through that of a flat K.  Otherwise it is in the wall.
    [[nodiscard]] bool inside() const { return wall_.kind == RayWall::Kind::none; }
    [[nodiscard]] const RayWall& wall() const { return wall_; }
    [[nodiscard]] const RayFeature& feature(RayEnd end) const {
        return end == RayEnd::enter ? enter_ : leave_;
    }

    /// Sign of time - t, t finite.
    int compare(RayEnd end, double t);
    /// The time at an end, correctly rounded.
    Rounding time(RayEnd end);
    /// The numerator of the time and its denominator, which is > 0.
    template <class N>
    void time(RayEnd end, N& numerator, N& denominator) const;

    /// Perpendicular to the feature at that end, from a to b; a facet's supports K.
    template <class N>
    [[nodiscard]] VectorOf<N> direction(RayEnd end) const;
    /// No vertex of K is lower than the line along it; set unless `inside`.
    template <class N>
    [[nodiscard]] VectorOf<N> wall_direction() const {
        return direction<N>(wall_);
    }

    /// -w.
    template <class N>
    [[nodiscard]] VectorOf<N> ray() const;
    template <class N>
    [[nodiscard]] VectorOf<N> velocity(int body) const {
        return exactly<N>(body == 0 ? velocity_a_ : velocity_b_);
    }
    template <class N>
    [[nodiscard]] VectorOf<N> corner(VertexPair pair) const;

    [[nodiscard]] bool ordinary() const { return ordinary_; }
    [[nodiscard]] bool at_rest() const { return at_rest_; }
    [[nodiscard]] const ExactAndRough& a() const { return a_; }
    [[nodiscard]] const ExactAndRough& b() const { return b_; }

    /// Whether the facet at that end is the only one of K there: the line passes strictly between its
    /// corners.
    bool pierces(RayEnd end);
    /// The vertex of K lowest along a direction; `start` if none is lower.
    VertexPair lowest_along(const VectorOf<Exact>& direction, VertexPair start);

    /// What the signs have taken so far.
    [[nodiscard]] Rung rung() const { return exact_ ? Rung::exact : Rung::wide; }

    /// Sign of a number given as a function of the type of number: f.operator()<N>().
    template <class F>
    int sign(const F& f) {
        if (ordinary_) {
            const int known = sign_of(f.template operator()<Enclosed>());
            if (known != kUncertain) {
                return known;
            }
        }
        exact_ = true;
        return sign_of(f.template operator()<Exact>());
    }

    /// Faces of the bodies that have a plane in common at that end, where the line is on the border of K.
    void faces(RayEnd end, std::vector<int>& of_a, std::vector<int>& of_b);

    /// What supports K at that end: the direction of a facet, or the wall.
    template <class N>
    [[nodiscard]] VectorOf<N> support(RayEnd end) const {
        return inside() ? direction<N>(end) : wall_direction<N>();
    }

private:
    template <class F>
    void faces(const F& direction, const VertexPair* level, int count, std::vector<int>& of_a,
               std::vector<int>& of_b);
    enum class Place : std::uint8_t { outside, border, inside };
    template <class F>
    class Direction;
    struct Triangle {
        VertexPair corner[3];
    };

    /// What has been computed of either end.
    template <class N>
    struct Known {
        VectorOf<N> direction[2];
        N numerator[2];
        N denominator[2];
        bool has_direction[2] = {};
        bool has_time[2] = {};
    };
    template <class N>
    [[nodiscard]] Known<N>& known() const {
        if constexpr (std::is_same_v<N, Enclosed>) {
            return wide_;
        } else {
            return whole_;
        }
    }

    template <class N>
    [[nodiscard]] VectorOf<N> vertex(int body, int index) const;
    template <class N>
    [[nodiscard]] VectorOf<N> direction(const RayWall& wall) const;
    template <class N>
    [[nodiscard]] VectorOf<N> direction(RayEnd end, const RayFeature& feature) const;

    int turn(VertexPair x, VertexPair y);
    int nudged_turn(VertexPair x, VertexPair y);
    int height(const RayWall& wall, VertexPair x);
    VertexPair lowest(const RayWall& wall, VertexPair start);
    template <class F>
    VertexPair lowest(const F& direction, const VertexPair* level, int count);
    template <class D>
    int extreme(const ExactAndRough& body, std::span<const int> among, const D& direction, bool of_b,
                int start, const VertexPair* level, int count);
    Place enclose(VertexPair start, Triangle& around);
    RayFeature descend(const Triangle& around, RayEnd end);
    void consider_all();
    bool meets_in_wall(VertexPair level);
    RayFeature descend_in_wall(VertexPair low, VertexPair high, RayEnd end);
    bool surrounds(const Triangle& around);

    const ExactAndRough& a_;
    const ExactAndRough& b_;
    Vec3 velocity_a_;
    Vec3 velocity_b_;
    bool at_rest_;
    bool ordinary_;
    bool exact_ = false;
    int axis_[2];  ///< axes that span space together with the line
    RayWall wall_;
    RayFeature enter_;
    RayFeature leave_;
    bool pierced_[2] = {};  ///< known to pass strictly between the corners
    mutable Known<Enclosed> wide_;
    mutable Known<Exact> whole_;
    mutable VectorOf<Enclosed> box_vertex_[2][8];
    mutable int box_vertices_[2] = {};  ///< bits of those known
    std::vector<int> among_a_;
    std::vector<int> among_b_;
};

// ---- Templates ----

template <class N>
VectorOf<N> ExactRay::ray() const {
    if (at_rest_) {
        return exactly<N>({1.0, 0.0, 0.0});
    }
    return exactly<N>(velocity_a_) - exactly<N>(velocity_b_);
}

template <class N>
VectorOf<N> ExactRay::corner(VertexPair pair) const {
    return vertex<N>(1, pair.b) - vertex<N>(0, pair.a);
}

template <class N>
VectorOf<N> ExactRay::vertex(int body, int index) const {
    const ExactBody& of = body == 0 ? a_.exact : b_.exact;
    if constexpr (std::is_same_v<N, Enclosed>) {
        if (of.kind == ExactBody::Kind::zonotope) {
            if ((box_vertices_[body] >> index & 1) == 0) {
                box_vertex_[body][index] = vertex_times_denominator<N>(of, index);
                box_vertices_[body] |= 1 << index;
            }
            return box_vertex_[body][index];
        }
    }
    return vertex_times_denominator<N>(of, index);
}

template <class N>
VectorOf<N> ExactRay::direction(const RayWall& wall) const {
    VectorOf<N> arm =
        wall.kind == RayWall::Kind::axis
            ? exactly<N>({wall.axis == 0 ? 1.0 : 0.0, wall.axis == 1 ? 1.0 : 0.0, wall.axis == 2 ? 1.0 : 0.0})
            : corner<N>(wall.corner[0]);
    if (wall.kind == RayWall::Kind::chord) {
        arm = arm - corner<N>(wall.corner[1]);
    }
    return wall.sign > 0 ? cross(ray<N>(), arm) : cross(arm, ray<N>());
}

template <class N>
VectorOf<N> ExactRay::direction(RayEnd end, const RayFeature& feature) const {
    VectorOf<N> n;
    if (feature.dimension == 2) {
        const VectorOf<N> base = corner<N>(feature.corner[0]);
        n = cross(corner<N>(feature.corner[1]) - base, corner<N>(feature.corner[2]) - base);
    } else if (feature.dimension == 1) {
        n = cross(corner<N>(feature.corner[1]) - corner<N>(feature.corner[0]), wall_direction<N>());
    } else {
        n = ray<N>();
    }
    return end == RayEnd::enter ? n : -n;
}

template <class N>
VectorOf<N> ExactRay::direction(RayEnd end) const {
    Known<N>& found = known<N>();
    const int k = end == RayEnd::enter ? 0 : 1;
    if (!found.has_direction[k]) {
        found.direction[k] = direction<N>(end, feature(end));
        found.has_direction[k] = true;
    }
    return found.direction[k];
}

template <class N>
void ExactRay::time(RayEnd end, N& numerator, N& denominator) const {
    Known<N>& found = known<N>();
    const int k = end == RayEnd::enter ? 0 : 1;
    if (!found.has_time[k]) {
        const VectorOf<N> n = direction<N>(end);
        const N gap = dot(n, corner<N>(feature(end).corner[0]));
        const N rate = dot(n, ray<N>());
        found.numerator[k] = end == RayEnd::enter ? gap : -gap;
        found.denominator[k] = end == RayEnd::enter ? rate : -rate;
        found.has_time[k] = true;
    }
    numerator = found.numerator[k];
    denominator = found.denominator[k];
}

}  // namespace geomsrv
