// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
// A corner of the intersection is a vertex of one polygon in the other, or a point where two edges cross that
// have both ends of each other strictly on different sides.  So the exact sides of all vertices tell which
// corners there are; arithmetic is needed for crossings only, to say where they are.  The direction of the
// edge along which the boundary goes on from a corner tells their order.
#include "geom/polygon_overlap_exact.hpp"

#include <algorithm>
#include <cmath>

#include "geom/exact_sign.hpp"
#include "geom/lanes.hpp"

namespace geomsrv {

namespace {

constexpr std::size_t kLanes = Lanes::kCount;

constexpr bool same(Vec2 a, Vec2 b) { return a.x == b.x && a.y == b.y; }

/// A segment has one edge here, not two.
std::size_t lines_of(const PairedPolygon& p) { return p.edges == 2 ? 1 : p.edges; }

/// For every edge of q, whether the vertices of p are beyond it (1) or behind (-1); 0 where that is not
/// certain, which is reported.
GEOMSRV_WIDE_CLONES bool certain_sides(const PairedPolygon& p, const PairedPolygon& q, double gap_error,
                                       std::size_t stride, double* to) {
    const Lanes zero = 0.0;
    LaneMask certain = zero <= zero;
    for (std::size_t k = 0; k < q.edges; ++k, to += stride) {
        const Lanes dx = q.dx[k];
        const Lanes dy = q.dy[k];
        const Lanes own = q.own(k);
        const Lanes error = gap_error * (std::fabs(q.dx[k]) + std::fabs(q.dy[k])) + kPairUnderflow;
        for (std::size_t i = 0; i < p.ring.size(); i += kLanes) {
            const Lanes height = (dx * Lanes::load(p.x + i) + dy * Lanes::load(p.y + i)) - own;
            const LaneMask beyond = error < height;
            const LaneMask behind = height < -error;
            certain = certain & (beyond | behind);
            select(beyond, Lanes(1.0), select(behind, Lanes(-1.0), zero)).store(to + i);
        }
    }
    return all(certain);
}

/// The greatest of each column.
GEOMSRV_WIDE_CLONES void greatest_of_columns(const double* rows, std::size_t count, std::size_t stride,
                                             double* to) {
    for (std::size_t i = 0; i < stride; i += kLanes) {
        Lanes most = -1.0;
        for (std::size_t k = 0; k < count; ++k) most = greater(most, Lanes::load(rows + k * stride + i));
        most.store(to + i);
    }
}

}  // namespace

/// On which side of every edge of the other polygon the vertices of a polygon are.
void ExactPolygonOverlap::find_sides(const PolygonPair& pair, int side) {
    const PairedPolygon& p = pair.side(side);
    const PairedPolygon& q = pair.other(side);
    Sides& sides = sides_[static_cast<std::size_t>(side)];
    sides.stride = (p.ring.size() + kLanes - 1) / kLanes * kLanes;
    sides.of.resize(sides.stride * q.edges);
    sides.furthest.resize(sides.stride);
    const bool certain = certain_sides(p, q, pair.gap_error(), sides.stride, sides.of.data());
    for (std::size_t k = 0; !certain && k < q.edges; ++k) {
        for (std::size_t i = 0; i < p.ring.size(); ++i) {
            double& sign = sides.of[k * sides.stride + i];
            if (sign == 0.0) {
                sign = -orientation(q.ring[k], q.ring[q.next(k)], p.ring[i]);
            }
        }
    }
    greatest_of_columns(sides.of.data(), q.edges, sides.stride, sides.furthest.data());
}

bool ExactPolygonOverlap::is_inside(const PolygonPair& pair, int side, std::size_t vertex) const {
    const PairedPolygon& q = pair.other(side);
    const Vec2 v = pair.side(side).ring[vertex];
    if (q.edges == 0) {
        return same(v, q.ring[0]);
    }
    if (furthest(side, vertex) > 0) {
        return false;
    }
    return q.edges > 2 || (sign_of_dot(q.ring[0], q.ring[1], q.ring[0], v) >= 0 &&
                           sign_of_dot(q.ring[1], q.ring[0], q.ring[1], v) >= 0);
}

void ExactPolygonOverlap::add_vertices(const PolygonPair& pair, int side) {
    const PairedPolygon& p = pair.side(side);
    const PairedPolygon& q = pair.other(side);
    for (std::size_t i = 0; i < p.ring.size(); ++i) {
        if (!is_inside(pair, side, i)) {
            continue;
        }
        const Vec2 v = p.ring[i];
        // A vertex that the polygons share is one corner.
        if (side == 1 && std::any_of(q.ring.begin(), q.ring.end(), [v](Vec2 w) { return same(v, w); })) {
            continue;
        }
        Corner corner{v, side, i};
        for (std::size_t k = 0; k < q.edges && furthest(side, i) == 0; ++k) {
            // On the boundary of both, the one that turns further to the left is the boundary of the
            // intersection.
            const Vec2 end = q.ring[q.next(k)];
            if (side_of(side, i, k) == 0 && !same(v, end) &&
                (p.edges == 0 || sign_of_cross(v, p.ring[p.next(i)], q.ring[k], end) > 0)) {
                corner.side = 1 - side;
                corner.edge = k;
            }
        }
        corners_.push_back(corner);
    }
}

void ExactPolygonOverlap::add_crossings(const PolygonPair& pair, bool in_range, Rung& rung) {
    const PairedPolygon& a = pair.side(0);
    const PairedPolygon& b = pair.side(1);
    for (std::size_t i = 0; i < lines_of(a); ++i) {
        const std::size_t i_end = a.next(i);
        for (std::size_t k = 0; k < lines_of(b); ++k) {
            const double start_side = side_of(0, i, k);
            const bool crosses =
                start_side * side_of(0, i_end, k) < 0 && side_of(1, k, i) * side_of(1, b.next(k), i) < 0;
            if (!crosses) {
                continue;
            }
            // Coming from outside, the edge of a is the boundary from here on.
            Corner corner = start_side > 0 ? Corner{{}, 0, i} : Corner{{}, 1, k};
            const auto question = [&](auto arithmetic) {
                using A = decltype(arithmetic);
                const auto normal = normal_of<A>(pair, {1, k});
                const auto way = A::difference(a.ring[i_end], a.ring[i]);
                return A::round_place(a.ring[i], dot(normal, A::difference(b.ring[k], a.ring[i])),
                                      dot(normal, way), way, corner.at);
            };
            rung = std::max(rung, climb(in_range, question));
            corners_.push_back(corner);
        }
    }
}

std::span<const Vec2> ExactPolygonOverlap::of(const PolygonPair& pair, bool in_range, Rung& rung) {
    corners_.clear();
    for (const int side : {0, 1}) {
        find_sides(pair, side);
    }
    for (const int side : {0, 1}) {
        add_vertices(pair, side);
    }
    add_crossings(pair, in_range, rung);
    if (corners_.size() > 2) {
        std::sort(corners_.begin(), corners_.end(), [&pair](const Corner& c, const Corner& d) {
            const PairedPolygon& p = pair.side(c.side);
            const PairedPolygon& q = pair.side(d.side);
            return is_before({p.ring[c.edge], p.ring[p.next(c.edge)]},
                             {q.ring[d.edge], q.ring[q.next(d.edge)]});
        });
    } else {
        std::sort(corners_.begin(), corners_.end(), [](const Corner& c, const Corner& d) {
            return c.at.x < d.at.x || (c.at.x == d.at.x && c.at.y < d.at.y);
        });
    }
    points_.clear();
    for (const Corner& corner : corners_) {
        points_.push_back(corner.at);
    }
    return points_;
}

}  // namespace geomsrv
