// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
// The widest gap of polygon_distance.cpp, proven.  float64 with bounds for rounding finds the few axes that
// may have it.  Apart, one of them leads to the nearest points, and these prove themselves: no vertex lies
// below the line through either of them.  Overlapping, the widest is found in arithmetic that cannot be
// wrong.
#include "geom/polygon_distance_exact.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

#include "geom/exact_sign.hpp"
#include "geom/polygon_widths.hpp"

namespace geomsrv {

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Where the other polygon is over an edge: its lowest vertex, or its lowest edge in the direction of this
/// one.
struct Over {
    std::size_t low = 0;
    std::size_t high = 0;
    bool beside = false;           ///< no part of it is over the edge
    std::size_t own_vertex = 0;    ///< then: the nearest vertex of the edge
    std::size_t other_vertex = 0;  ///< and of the other polygon
};

Over over_edge(const PolygonPair& pair, AxisOf axis, Level lowest) {
    const PairedPolygon& p = pair.side(axis.side);
    const Ring q = pair.other(axis.side).ring;
    const std::size_t end = p.next(axis.index);
    const Vec2 from = p.ring[axis.index];
    const Vec2 to = p.ring[end];
    Over over{lowest.vertex, lowest.neighbour};
    if (over.low != over.high && sign_of_dot(from, to, q[over.low], q[over.high]) < 0) {
        std::swap(over.low, over.high);
    }
    if (sign_of_dot(from, to, from, q[over.high]) < 0) {
        over = {over.low, over.high, true, axis.index, over.high};
    } else if (sign_of_dot(to, from, to, q[over.low]) < 0) {
        over = {over.low, over.high, true, end, over.low};
    }
    return over;
}

/// Whether no point of p is nearer to `to` than its vertex v.
bool is_nearest_vertex(const PairedPolygon& p, std::size_t v, Vec2 to) {
    const Vec2 at = p.ring[v];
    return sign_of_dot(at, to, at, p.ring[p.next(v)]) <= 0 &&
           sign_of_dot(at, to, at, p.ring[p.previous(v)]) <= 0;
}

/// Nearest features of polygons that are apart: an edge (the axis') and what is over it, or two vertices.
struct Nearest {
    bool found = false;
    AxisOf axis;
    bool is_edge = false;
    Over over;
};

/// Proven by the features themselves; the axes that may have the widest gap lead to them.
Nearest nearest_of(const PolygonPair& pair, double least_width) {
    for (const int side : {0, 1}) {
        const PairedPolygon& p = pair.side(side);
        const PairedPolygon& q = pair.other(side);
        for (std::size_t k = 0; k < p.axes; ++k) {
            if (p.work[0][k] < least_width || p.work[1][k] < 0.0) {
                continue;
            }
            const AxisOf axis{side, k};
            const Level lowest = pair.lowest_level(axis);
            const std::size_t vertex = lowest.vertex;
            const Over over =
                k < p.edges ? over_edge(pair, axis, lowest) : Over{vertex, vertex, true, p.base(k), vertex};
            const bool proven = over.beside
                                    ? is_nearest_vertex(p, over.own_vertex, q.ring[over.other_vertex]) &&
                                          is_nearest_vertex(q, over.other_vertex, p.ring[over.own_vertex])
                                    : sign_of_gap(pair, axis, vertex) > 0;
            if (proven) {
                return {true, axis, !over.beside, over};
            }
        }
    }
    return {};
}

/// Points of both polygons over each other on an axis; of two parallel edges the middle of their common part.
/// REQUIRES: something of the other polygon is over the edge.
template <class A>
bool face(const PolygonPair& pair, AxisOf axis, const Over& over, PolygonDistance& out) {
    const PairedPolygon& p = pair.side(axis.side);
    const Ring q = pair.other(axis.side).ring;
    const bool is_a = axis.side == 0;
    const Vec2 outward = A::direction(normal_of<A>(pair, axis));
    out.normal = is_a ? outward : -outward;
    Vec2& own = is_a ? out.point_a : out.point_b;
    Vec2& opposite = is_a ? out.point_b : out.point_a;
    const Vec2 from = p.ring[p.base(axis.index)];
    opposite = q[over.low];
    if (axis.index >= p.edges) {
        own = from;
        return true;
    }
    // Places along the edge are in units of its squared length.
    const Vec2 to = p.ring[p.next(axis.index)];
    const typename A::Vector edge = A::difference(to, from);
    const typename A::Number length = dot(edge, edge);
    const auto place = [&](std::size_t j) { return dot(edge, A::difference(q[j], from)); };
    const typename A::Number low = place(over.low);
    if (over.low == over.high) {
        return A::round_place(from, low, length, edge, own);
    }
    const typename A::Number high = place(over.high);
    const bool begins = sign_of_dot(from, to, from, q[over.low]) >= 0;
    const bool ends = sign_of_dot(to, from, to, q[over.high]) >= 0;
    const typename A::Number two(2.0);
    const typename A::Number middle =
        (begins ? low : typename A::Number(0.0)) + (ends ? high : length);  // twice
    return A::round_place(from, middle, two * length, edge, own) &&
           A::round_place(q[over.low], middle - two * low, two * (high - low),
                          A::difference(q[over.high], q[over.low]), opposite);
}

template <class A>
bool measure(const PolygonPair& pair, AxisOf axis, std::size_t vertex, Rounding& width) {
    const typename A::Vector normal = normal_of<A>(pair, axis);
    return A::round_over_root(dot(normal, across<A>(pair, axis, vertex)), dot(normal, normal), width);
}

void set_distance(PolygonDistance& out, const Rounding& length) {
    out.distance = length.nearest;
    out.lower = length.lower;
    out.upper = length.upper;
}

template <class A>
bool apart(const PolygonPair& pair, const Nearest& nearest, PolygonDistance& out) {
    const AxisOf axis = nearest.axis;
    Rounding length;
    if (nearest.is_edge) {
        if (!measure<A>(pair, axis, nearest.over.low, length)) {
            return false;
        }
        set_distance(out, length);
        return face<A>(pair, axis, nearest.over, out);
    }
    const Vec2 own = pair.side(axis.side).ring[nearest.over.own_vertex];
    const Vec2 other = pair.other(axis.side).ring[nearest.over.other_vertex];
    out.point_a = axis.side == 0 ? own : other;
    out.point_b = axis.side == 0 ? other : own;
    const typename A::Vector way = A::difference(out.point_b, out.point_a);
    out.normal = A::direction(way);
    if (!A::round_root(dot(way, way), length)) {
        return false;
    }
    set_distance(out, length);
    return true;
}

/// A width along an axis, not rounded.
template <class A>
struct Width {
    AxisOf axis;
    Level lowest;
    typename A::Number gap, squared_length;
};

/// Depth of polygons that overlap: the largest width, which is negative.
template <class A>
bool deepest(const PolygonPair& pair, double least_width, PolygonDistance& out) {
    Width<A> best;
    bool found = false;
    for (const int side : {0, 1}) {
        const PairedPolygon& p = pair.side(side);
        for (std::size_t k = 0; k < p.edges; ++k) {
            if (p.work[0][k] < least_width) {
                continue;
            }
            const AxisOf axis{side, k};
            const typename A::Vector normal = normal_of<A>(pair, axis);
            Width<A> width{axis, pair.lowest_level(axis), {}, dot(normal, normal)};
            width.gap = dot(normal, across<A>(pair, axis, width.lowest.vertex));
            int wider = 1;
            if (found) {
                // Both are negative.
                wider = sign_of(best.gap * best.gap * width.squared_length -
                                width.gap * width.gap * best.squared_length);
                if (wider == kUncertain) {
                    return false;
                }
                if (wider == 0) {
                    wider = is_before(pair, axis, best.axis) ? 1 : -1;
                }
            }
            if (wider > 0) {
                best = std::move(width);
            }
            found = true;
        }
    }
    Rounding depth;
    if (!A::round_over_root(best.gap, best.squared_length, depth)) {
        return false;
    }
    set_distance(out, depth);
    return face<A>(pair, best.axis, over_edge(pair, best.axis, best.lowest), out);
}

}  // namespace

PolygonDistance ExactPolygonDistanceSolver::solve(Ring a, Ring b, bool penetration) {
    pair_.load(a, b);
    const bool in_range = pair_.scale_exponent() == 0;
    const Widest widest = widths_of(pair_);
    const Relation relation = widest.lower > 0.0 ? Relation::apart
                              : widest.overlap   ? Relation::overlapping
                                                 : relation_of(pair_, is_flat(pair_), 1, touching_);
    PolygonDistance out;
    out.meet = relation != Relation::apart;
    switch (relation) {
        case Relation::apart: {
            Nearest nearest = nearest_of(pair_, widest.lower);
            if (!nearest.found) {
                nearest = nearest_of(pair_, -kInfinity);
            }
            out.rung = climb(
                in_range, [&](auto arithmetic) { return apart<decltype(arithmetic)>(pair_, nearest, out); });
            return out;
        }
        case Relation::touching: {
            AxisOf axis = touching_[0];
            for (const AxisOf other : touching_) {
                axis = is_before(pair_, other, axis) ? other : axis;
            }
            const Level lowest = lowest_along(pair_, axis);
            const bool is_edge = axis.index < pair_.side(axis.side).edges;
            const Over over = is_edge ? over_edge(pair_, axis, lowest) : Over{lowest.vertex, lowest.vertex};
            out.rung = climb(in_range, [&](auto arithmetic) {
                return face<decltype(arithmetic)>(pair_, axis, over, out);
            });
            return out;
        }
        case Relation::overlapping:
            break;
    }
    out.rung = climb(
        in_range, [&](auto arithmetic) { return deepest<decltype(arithmetic)>(pair_, widest.lower, out); });
    if (!penetration) {
        // The mean of its corners lies inside a convex set.
        Vec2 middle;
        const std::span<const Vec2> corners = overlap_.of(pair_, in_range, out.rung);
        const double share = 1.0 / static_cast<double>(corners.size());
        for (const Vec2 corner : corners) {
            middle = middle + share * corner;
        }
        out = {0.0, 0.0, 0.0, middle, middle, out.normal, true, true, out.rung};
    }
    return out;
}

}  // namespace geomsrv
