// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
// The gap of a - b over all unit directions n, f(n) = min over b of n.x - max over a of n.x, is the distance
// where its maximum is positive and minus the depth where it is not.
//
//     apart:        between two neighbouring axes f is a cosine, |v| cos(n, v) for the two vertices v = b_j -
//     a_i that
//                   support it.  The largest f over all axes is next to the maximum: either the foot of the
//                   supporting vertex lies inside the axis' edge, then it is the maximum itself, or the
//                   edge's end is one of the two nearest vertices.
//     overlapping:  the maximum is at an edge normal.
//
// (Book section 6.10 finds the same by GJK; here the axes are few and their gaps are known already.) Rounding
// may leave several axes in question.  All of them are evaluated; inside or outside an edge, apart or not, is
// decided exactly.
#include "geom/polygon_distance.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <span>

#include "geom/double_double.hpp"
#include "geom/exact_sign.hpp"
#include "geom/polygon_widths.hpp"
#include "geom/power_of_two.hpp"
#include "geom/rounding.hpp"

namespace geomsrv {

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// A pair of points, one on each polygon: a vertex of the other polygon, and its nearest on an edge or vertex
/// of `side`.
struct Candidate {
    AxisOf axis;
    std::size_t vertex = 0;      ///< of the other polygon
    std::size_t own_vertex = 0;  ///< if not inside the edge
    bool inside = false;         ///< the foot lies inside the edge of `axis`
    DoubleDouble length{kInfinity, 0.0};
    double error = 0.0;
};

/// Whether no point of p is nearer to `to` than its vertex v.
bool is_nearest_vertex(const PairedPolygon& p, std::size_t v, Vec2 to) {
    if (p.edges == 0) {
        return true;
    }
    const Vec2 at = p.ring[v];
    return sign_of_dot(at, to, at, p.ring[p.next(v)]) <= 0 &&
           sign_of_dot(at, to, at, p.ring[p.previous(v)]) <= 0;
}

/// The vector, times a power of two if it is so short that its square would be lost.
ExactVec2 resolved(const ExactVec2& v) {
    const double size = std::max(std::fabs(v.x.hi), std::fabs(v.y.hi));
    if (size >= kShortestAxis || size == 0.0) {
        return v;
    }
    const PowerOfTwo up(-std::ilogb(size));
    return {{up * v.x.hi, up * v.x.lo}, {up * v.y.hi, up * v.y.lo}};
}

/// Length of an exact vector.
DoubleDouble length_of(const ExactVec2& v) { return sqrt(enclosed_dot(v, v).value); }

/// The vertex of the other polygon and its nearest on the axis' edge or tip.
Candidate evaluate(const PolygonPair& pair, AxisOf axis, const ExactVec2& direction, DoubleDouble axis_length,
                   std::size_t vertex) {
    const PairedPolygon& p = pair.side(axis.side);
    const Vec2 to = pair.other(axis.side).ring[vertex];
    const std::size_t start = p.base(axis.index);
    Candidate found{axis, vertex, start, false, {kInfinity, 0.0}, 0.0};
    if (axis.index < p.edges) {
        const Vec2 from = p.ring[start];
        const Vec2 end = p.ring[p.next(start)];
        if (sign_of_dot(from, end, from, to) > 0) {
            if (sign_of_dot(end, from, end, to) > 0) {
                const Enclosed gap = enclosed_dot(direction, pair.difference(to, from));
                // Behind the edge there is no nearest point on it; too near to tell counts as none behind.
                if (gap.value.hi < -gap.error) {
                    return found;
                }
                found.inside = true;
                found.length = gap.value.hi > 0.0 ? gap.value / axis_length : DoubleDouble{};
                found.error = gap.error / axis_length.hi;
                return found;
            }
            found.own_vertex = p.next(start);
        }
    }
    found.length = length_of(pair.difference(to, p.ring[found.own_vertex]));
    return found;
}

/// Relative error of lengths: root and quotient of numbers that are relatively exact to about 2^-102 each.
constexpr double kLengthError = 4.0 * kWideRoundoff;

/// Bounds of a length in given units.
struct Interval {
    double nearest, lower, upper;
};

Interval enclose(DoubleDouble length, double error, int scale_exponent) {
    const double slack = kLengthError * std::fabs(length.hi) + error;
    double nearest = length.hi;
    double lower = next_down(length.hi + (length.lo - slack));
    double upper = next_up(length.hi + (length.lo + slack));
    if (scale_exponent != 0) {
        // A power of two; only subnormal results are rounded.
        nearest = std::scalbn(nearest, -scale_exponent);
        lower = next_down(std::scalbn(lower, -scale_exponent));
        upper = next_up(std::scalbn(upper, -scale_exponent));
    }
    return {nearest, lower, upper};
}

/// start + t (end - start).
Vec2 on_edge(Vec2 start, Vec2 end, double t) {
    const Vec2 way = end - start;
    if (!std::isfinite(way.x) || !std::isfinite(way.y)) {
        return (1.0 - t) * start + t * end;
    }
    return start + t * way;
}

// Error of a place along an edge, in units of its length: dot products that are right to twice the precision
// are rounded once each, their quotient once more; the fourth covers the bound.
constexpr double kPlaceError = 4.0 * kUnitRoundoff;

// Places beside an edge that is tiny count as no farther than this, so that their difference is a number.
constexpr double kFarthest = 0x1p1000;

/// Points of both polygons over each other on an axis: `own` on the axis' edge, `opposite` on the lowest
/// vertex or edge of the other polygon; of two parallel edges the middle of their common part.
struct Facing {
    Vec2 own;
    Vec2 opposite;
};

Facing facing_points(const PolygonPair& pair, AxisOf axis, std::size_t vertex) {
    const PairedPolygon& p = pair.side(axis.side);
    const PairedPolygon& q = pair.other(axis.side);
    const Vec2 start = p.ring[p.base(axis.index)];
    if (axis.index >= p.edges) {
        return {start, q.ring[vertex]};
    }
    const Vec2 end = p.ring[p.next(axis.index)];
    const ExactVec2 given = pair.difference(end, start);
    const ExactVec2 edge = resolved(given);
    const double squared_length = enclosed_dot(edge, given).value.hi;  // but for the power of two
    const auto place = [&](std::size_t j) {
        const double at = enclosed_dot(edge, pair.difference(q.ring[j], start)).value.hi / squared_length;
        return std::clamp(at, -kFarthest, kFarthest);
    };
    const auto share = [](double part, double whole) {
        return whole != 0.0 ? std::clamp(part / whole, 0.0, 1.0) : 0.0;
    };
    const auto is_beside = [](double at) { return at < -kPlaceError || at > 1.0 + kPlaceError; };
    // The other polygon runs against this edge.
    const auto towards = [&](std::size_t j, double at) { return at > 1.0 ? q.next(j) : q.previous(j); };
    double at = place(vertex);
    // The axis of the distance or depth has a vertex beside its edge only where others are as low, exactly or
    // but for a tilt below all digits of the gap: the last one that is beside it ends an edge over its end.
    for (std::size_t steps = 0; is_beside(at) && steps < q.edges; ++steps) {
        const std::size_t next = towards(vertex, at);
        const double to = place(next);
        if (at > 1.0 ? !(to > 1.0 && to < at) : !(to < 0.0 && to > at)) {
            break;
        }
        vertex = next;
        at = to;
    }
    for (const std::size_t neighbour : {q.next(vertex), q.previous(vertex)}) {
        if (neighbour == vertex || sign_of_cross(start, end, q.ring[vertex], q.ring[neighbour]) != 0) {
            continue;
        }
        // Where the edges share an end only, rounding may leave the common part a little less than empty.
        const double to = place(neighbour);
        const double middle = 0.5 * (std::max(0.0, std::min(at, to)) + std::min(1.0, std::max(at, to)));
        return {on_edge(start, end, std::clamp(middle, 0.0, 1.0)),
                on_edge(q.ring[vertex], q.ring[neighbour], share(middle - at, to - at))};
    }
    const double nearest = std::clamp(at, 0.0, 1.0);
    const Vec2 own = on_edge(start, end, nearest);
    const std::size_t next = towards(vertex, at);
    if (is_beside(at) && next != vertex) {
        return {own, on_edge(q.ring[vertex], q.ring[next], share(nearest - at, place(next) - at))};
    }
    return {own, q.ring[vertex]};
}

/// Writes points and normal of an axis along which the polygons face each other.
PolygonDistance with_points(PolygonDistance result, AxisOf axis, const Facing& points, Vec2 way) {
    const bool is_a = axis.side == 0;
    result.normal = unit(is_a ? way : -way);
    result.point_a = is_a ? points.own : points.opposite;
    result.point_b = is_a ? points.opposite : points.own;
    return result;
}

/// Nearest points of polygons that are apart.  `widest` is the largest certain width.
PolygonDistance nearest_points(const PolygonPair& pair, double widest) {
    Candidate best;
    double proven_lower = 0.0;
    const int scale_exponent = pair.scale_exponent();
    for (const int side : {0, 1}) {
        const PairedPolygon& p = pair.side(side);
        for (std::size_t k = 0; k < p.axes; ++k) {
            if (!(p.work[0][k] >= widest && p.work[1][k] > 0.0)) {
                continue;
            }
            const AxisOf axis{side, k};
            const ExactVec2 direction = resolved(pair.exact_axis(axis));
            const DoubleDouble axis_length = length_of(direction);
            const std::size_t lowest = pair.lowest(axis);
            const Chain chain = pair.lowest(axis, lowest, {});
            for (std::size_t j = chain.first;; j = pair.other(side).next(j)) {
                const Candidate candidate = evaluate(pair, axis, direction, axis_length, j);
                if (candidate.length < best.length) {
                    best = candidate;
                }
                if (j == chain.last) {
                    break;
                }
            }
            // The gap along any axis is a lower bound of the distance.
            const Enclosed gap = pair.enclosed_gap(axis, direction, lowest);
            const Interval width =
                enclose(gap.value / axis_length, gap.error / axis_length.hi, scale_exponent);
            proven_lower = std::max(proven_lower, width.lower);
        }
    }
    const Interval found = enclose(best.length, best.error, scale_exponent);
    PolygonDistance result{found.nearest, proven_lower, found.upper, {}, {}, {}};
    const PairedPolygon& own = pair.side(best.axis.side);
    if (best.inside) {
        result.lower = std::min(result.lower, result.distance);
        const Facing points = facing_points(pair, best.axis, best.vertex);
        return with_points(result, best.axis, points, own.axis(best.axis.index));
    }
    const PairedPolygon& other = pair.other(best.axis.side);
    const Facing points{own.ring[best.own_vertex], other.ring[best.vertex]};
    if (is_nearest_vertex(own, best.own_vertex, points.opposite) &&
        is_nearest_vertex(other, best.vertex, points.own)) {
        result.lower = std::max(result.lower, found.lower);
    }
    result.lower = std::min(result.lower, result.distance);
    const Vec2 given_way = points.opposite - points.own;
    const bool finite = std::isfinite(given_way.x) && std::isfinite(given_way.y);
    if (best.length.hi == 0.0) {
        // The square of a distance so far below the size of the pair underflows.
        result.distance = std::hypot(given_way.x, given_way.y);
        result.upper = std::max(result.upper, next_up(result.distance));
    }
    return with_points(result, best.axis, points, finite ? given_way : pair.way(points.own, points.opposite));
}

enum class Relation { apart, touching, overlapping };

struct Decision {
    Relation relation;
    AxisOf touching_axis;  ///< along which the gap is exactly zero
};

/// Exactly, for the given coordinates.
Decision relation_of(const PolygonPair& pair) {
    Decision decision{Relation::overlapping, {}};
    for (const bool tips : {false, true}) {
        for (const int side : {0, 1}) {
            const PairedPolygon& p = pair.side(side);
            for (std::size_t k = tips ? p.edges : 0; k < (tips ? p.axes : p.edges); ++k) {
                if (!(p.work[1][k] >= 0.0)) {
                    continue;
                }
                const AxisOf axis{side, k};
                const int sign = pair.sign_of_gap(axis, pair.lowest(axis));
                if (sign > 0) {
                    return {Relation::apart, {}};
                }
                if (sign == 0 && decision.relation == Relation::overlapping) {
                    decision = {Relation::touching, axis};
                }
            }
        }
    }
    return decision;
}

/// Depth of polygons that overlap: the largest width, which is negative.
PolygonDistance deepest_points(const PolygonPair& pair, double widest) {
    AxisOf best = pair.widest_gap();
    std::size_t vertex = pair.lowest(best);
    DoubleDouble width{-kInfinity, 0.0};
    Interval bounds{-kInfinity, -kInfinity, -kInfinity};
    for (const int side : {0, 1}) {
        const PairedPolygon& p = pair.side(side);
        for (std::size_t k = 0; k < p.edges; ++k) {
            if (!(p.work[0][k] >= widest)) {
                continue;
            }
            const AxisOf axis{side, k};
            const ExactVec2 direction = resolved(pair.exact_axis(axis));
            const DoubleDouble axis_length = length_of(direction);
            const std::size_t lowest = pair.lowest(axis);
            const Enclosed gap = pair.enclosed_gap(axis, direction, lowest);
            const DoubleDouble candidate = gap.value / axis_length;
            const Interval enclosed = enclose(candidate, gap.error / axis_length.hi, pair.scale_exponent());
            bounds.lower = std::max(bounds.lower, enclosed.lower);
            bounds.upper = std::max(bounds.upper, enclosed.upper);
            if (width < candidate) {
                width = candidate;
                bounds.nearest = enclosed.nearest;
                best = axis;
                vertex = lowest;
            }
        }
    }
    const PolygonDistance result{
        std::min(bounds.nearest, 0.0), bounds.lower, std::min(bounds.upper, 0.0), {}, {}, {}};
    const Vec2 way = pair.side(best.side).axis(best.index);
    return with_points(result, best, facing_points(pair, best, vertex), way);
}

}  // namespace

PolygonDistance PolygonDistanceSolver::solve(Ring a, Ring b, bool penetration) {
    pair_.load(a, b);
    const Widest widest = widths_of(pair_);
    const Decision decision = widest.lower > 0.0 ? Decision{Relation::apart, {}}
                              : widest.overlap   ? Decision{Relation::overlapping, {}}
                                                 : relation_of(pair_);
    if (decision.relation == Relation::apart) {
        return nearest_points(pair_, widest.lower);
    }
    if (decision.relation == Relation::overlapping) {
        PolygonDistance result = deepest_points(pair_, widest.lower);
        result.meet = true;
        if (penetration) {
            return result;
        }
        const std::span<const Vec2> corners = overlap_.of(pair_, {});
        // The mean of its corners lies inside a convex set.  Only what is too small to find has none.
        if (!corners.empty()) {
            result.point_a = {};
            const double share = 1.0 / static_cast<double>(corners.size());
            for (const Vec2 corner : corners) {
                result.point_a = result.point_a + share * corner;
            }
        }
        return {0.0, 0.0, 0.0, result.point_a, result.point_a, result.normal, true};
    }
    const AxisOf axis = decision.touching_axis;
    PolygonDistance result;
    result.meet = true;
    return with_points(result, axis, facing_points(pair_, axis, pair_.lowest(axis)),
                       pair_.side(axis.side).axis(axis.index));
}

}  // namespace geomsrv
