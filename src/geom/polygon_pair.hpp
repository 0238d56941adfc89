// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
// Two convex polygons and every axis that can separate them: what moving contact and distance have in common.
//
// The translations w for which b + w meets a form the convex polygon a - b.  Its edges are the edges of a and
// (turned round) of b, so it is known by one half plane per edge:
//
//     axis k of a: outward normal D of its edge     gap + D.w <= 0,  gap = min over b of D.x - max over a of
//     D.x axis k of b: likewise                         gap - D.w <= 0,  gap = min over a of D.x - max over b
//     of D.x
//
// An edge is its polygon's own support, so one projection per axis does (book section 7.7.2, one-sided form).
// Normals are not normalised: no sign and no ratio of gap and speed needs it.
//
// Where a - b is flat or has a corner sharper than 60 degrees, edge normals alone do not bound it well: two
// collinear segments have no edge normal along them, and beyond the tip of a needle all gaps are far smaller
// than the distance. So every vertex that turns by more than 120 degrees adds an axis that points outward
// along its bisector, a "tip". A convex polygon has at most two of them; the ends of a segment are tips. With
// tips the largest gap/|D| is at least half the distance: a corner of a - b below 60 degrees is made of two
// corners that are, and the normals of the edges at it and the bisector are at most 90 degrees apart; at
// other corners the normals are at most 120 degrees apart.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

#include "geom/double_double.hpp"
#include "geom/enclosed.hpp"
#include "geom/exact_sign.hpp"
#include "geom/polygon.hpp"
#include "geom/polygon_projection.hpp"
#include "geom/vec.hpp"

namespace geomsrv {

/// Error of a gap, relative to |D|_1 times the reach of the pair, in units of kUnitRoundoff: edge, local
/// coordinate, product and sum make 4 for each of the two projections, their difference 2 (it is at most 2
/// |D|_1 reach), adding the bound to it 2 more; the rest covers second-order terms and the rounding of the
/// bound.
inline constexpr double kGapError = 14.0;

/// Added for large polygons, whose supports are found by walking: an edge whose height is misjudged because
/// it is within 5 units of level is worth 5 |D|_1 of its length, and all edges together are at most 8 reaches
/// long.
inline constexpr double kWalkError = 40.0;

/// Gain of height along an edge that is certainly not rounding: two relatively exact edges, products, sum.
inline constexpr double kHeightError = 6.0 * kUnitRoundoff;

/// Below 2^-1022 results are rounded to multiples of 2^-1074; no bound here counts more than 16 of them.
inline constexpr double kPairUnderflow = 0x1p-1070;

/// One polygon of a pair: vertices relative to the origin of the pair, and edges, times its scale; gaps are
/// -1 beyond the last axis.
struct PairedPolygon : ProjectedPolygon<double> {
    Ring ring;  ///< strictly convex, as given; 1 or 2 vertices are a point or a segment
    std::array<std::size_t, 4> tip{};  ///< vertex of each tip axis
    Vec2* around = nullptr;            ///< the ring, going on past its end
    std::array<double*, 4> work{};     ///< for the query

    /// First of the vertices on which the axis rests: its edge's, or the tip.
    [[nodiscard]] std::size_t base(std::size_t axis) const { return axis < edges ? axis : tip[axis - edges]; }
    [[nodiscard]] std::size_t next(std::size_t vertex) const {
        return vertex + 1 < ring.size() ? vertex + 1 : 0;
    }
    [[nodiscard]] std::size_t previous(std::size_t vertex) const {
        return (vertex > 0 ? vertex : ring.size()) - 1;
    }
    [[nodiscard]] Vec2 axis(std::size_t k) const { return {dx[k], dy[k]}; }
    [[nodiscard]] Vec2 local(std::size_t vertex) const { return {x[vertex], y[vertex]}; }
    /// The tip of a polygon with area: it keeps slacks small, but the edges alone say the same in exact
    /// arithmetic.
    [[nodiscard]] bool is_redundant(std::size_t k) const { return edges > 2 && k >= edges; }
    /// Own support along an axis.
    [[nodiscard]] double own(std::size_t k) const { return dot(axis(k), local(k)); }
};

/// A vector of the given numbers, unrounded: the difference of two points, or an edge's normal.
struct ExactVec2 {
    DoubleDouble x, y;
};

/// Error of a dot product of exact vectors relative to the sum over its terms, in units of 2^-106: 7 for a
/// product (Joldes, Muller, Popescu, "Tight and rigorous error bounds for basic building blocks of
/// double-word arithmetic", 2017), 3 for a sum that takes no care of cancellation; the rest covers the bound.
inline constexpr double kExactDotError = 12.0 * 0x1p-106;

/// dot(a, b).
inline Enclosed enclosed_dot(const ExactVec2& a, const ExactVec2& b) {
    const DoubleDouble x = a.x * b.x;
    const DoubleDouble y = a.y * b.y;
    const DoubleDouble sum = two_sum(x.hi, y.hi);
    return {quick_two_sum(sum.hi, sum.lo + (x.lo + y.lo)),
            kExactDotError * (std::fabs(x.hi) + std::fabs(y.hi)) + kPairUnderflow};
}

/// Vertices of a ring one after another, counter-clockwise.
struct Chain {
    std::size_t first = 0;
    std::size_t last = 0;
};

/// A vertex, and the one beside it that is exactly as low; itself if there is none.
struct Level {
    std::size_t vertex = 0;
    std::size_t neighbour = 0;
};

/// An axis of one of the two polygons.
struct AxisOf {
    int side = 0;  ///< 0: of a, 1: of b
    std::size_t index = 0;
};

/// Height along an axis D up to which a vertex counts as level with the extreme one, beyond what rounding can
/// do: min(noise (|D|_1 + |e|_1), limit |D|_1) for a chain of edges of length |e|_1.
struct Slack {
    double noise = 0.0;
    double limit = 0.0;
};

/// Unit vector, whatever the length of v; zero for zero, which an edge may be that is far smaller than the
/// pair.
inline Vec2 unit(Vec2 v) {
    const double largest = std::max(std::fabs(v.x), std::fabs(v.y));
    if (largest == 0.0) {
        return {};
    }
    const Vec2 reduced{v.x / largest, v.y / largest};
    return (1.0 / norm(reduced)) * reduced;
}

class PolygonPair {
public:
    /// Scratch memory for rings of at most so many vertices.
    PolygonPair(std::size_t largest_a, std::size_t largest_b);

    /// Upper bound for the number of axes of both polygons together.
    static constexpr std::size_t most_axes(std::size_t largest_a, std::size_t largest_b) {
        return largest_a + largest_b + 8;
    }

    /// Takes up two valid rings; they must outlive their use.
    void load(Ring a, Ring b);
    /// The same without gaps.
    void place(Ring a, Ring b);
    /// Finds the gaps of what has been placed.
    void project();
    /// Whether that takes a walk round the polygons, which are too large to project every axis on every
    /// vertex.
    [[nodiscard]] bool walks() const;

    [[nodiscard]] const PairedPolygon& side(int i) const { return sides_[static_cast<std::size_t>(i)]; }
    [[nodiscard]] const PairedPolygon& other(int i) const { return sides_[static_cast<std::size_t>(1 - i)]; }

    /// Largest |local coordinate|, scaled.
    [[nodiscard]] double reach() const { return reach_; }
    /// Largest |coordinate| as given, scaled; may be infinite.
    [[nodiscard]] double magnitude() const { return magnitude_; }
    /// Lengths of the pair are the given ones times 2^scale_exponent; it is 0 unless the reach is extreme.
    [[nodiscard]] int scale_exponent() const { return scale_exponent_; }
    /// Error of `gap` relative to |D|_1; add kPairUnderflow.
    [[nodiscard]] double gap_error() const { return gap_error_; }

    /// The exact difference of two given points, times the scale.
    [[nodiscard]] ExactVec2 difference(Vec2 to, Vec2 from) const {
        const auto apart = [this](double end, double start) -> DoubleDouble {
            const DoubleDouble way = two_sum(before_ * end, -(before_ * start));
            return {scale_ * way.hi, scale_ * way.lo};
        };
        return {apart(to.x, from.x), apart(to.y, from.y)};
    }
    /// The same, rounded, from one point to the other.
    [[nodiscard]] Vec2 way(Vec2 from, Vec2 to) const {
        return {scale_ * (before_ * to.x - before_ * from.x), scale_ * (before_ * to.y - before_ * from.y)};
    }
    /// A given point moved by a scaled vector, rounded once; only an end beyond the doubles is infinite.
    [[nodiscard]] Vec2 moved(Vec2 from, DoubleDouble x, DoubleDouble y) const;

    /// The vertex of the other polygon that is lowest along an axis, exactly; one of two that are level.
    [[nodiscard]] Level lowest_level(AxisOf axis) const;
    [[nodiscard]] std::size_t lowest(AxisOf axis) const { return lowest_level(axis).vertex; }
    /// All that are as low as that one, up to rounding and `slack`.  Heights are summed over edges, which are
    /// relatively exact, so that nearly parallel edges of polygons far apart are told from parallel ones.
    [[nodiscard]] Chain lowest(AxisOf axis, std::size_t vertex, Slack slack) const;
    /// Vertices of the axis' own polygon that are highest along it, up to `slack`; among them the axis' edge.
    [[nodiscard]] Chain highest(AxisOf axis, Slack slack) const;

    /// The axis with the largest gap/|D|, edges before tips: the one to part (or keep apart) the polygons
    /// along.
    [[nodiscard]] AxisOf widest_gap() const;

    /// The axis itself: exact for edges, and for tips by definition.
    [[nodiscard]] ExactVec2 exact_axis(AxisOf axis) const {
        const PairedPolygon& p = side(axis.side);
        if (axis.index >= p.edges) {
            return {{p.dx[axis.index], 0.0}, {p.dy[axis.index], 0.0}};
        }
        const ExactVec2 edge = difference(p.ring[p.next(axis.index)], p.ring[axis.index]);
        return {edge.y, -edge.x};
    }
    /// Gap along an axis to twice the precision, and its exact sign; `vertex` is the `lowest`.
    [[nodiscard]] Enclosed enclosed_gap(AxisOf axis, const ExactVec2& direction, std::size_t vertex) const;
    [[nodiscard]] int sign_of_gap(AxisOf axis, std::size_t vertex) const;

private:
    bool try_place(Ring a, Ring b, bool known_strict);
    [[nodiscard]] int sign_of_height(AxisOf axis, Vec2 from, Vec2 to) const;

    std::array<PairedPolygon, 2> sides_;
    std::vector<Vec2> around_;
    std::vector<double> storage_;
    std::array<StrictHull, 2> hulls_;
    double reach_ = 0.0;
    double magnitude_ = 0.0;
    double gap_error_ = 0.0;
    double before_ = 1.0;     // factor of coordinates, so that their differences do not overflow
    double scale_ = 1.0;      // factor of differences
    int scale_exponent_ = 0;  // of both factors together
};

}  // namespace geomsrv
