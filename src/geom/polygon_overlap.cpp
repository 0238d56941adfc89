// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
#include "geom/polygon_overlap.hpp"

#include <algorithm>
#include <cmath>

namespace geomsrv {

namespace {

/// Where an edge of one polygon crosses an edge line of the other, to about the last place: both are needed
/// in double-double, because the ends of the edges may be far from the crossing.
Vec2 crossing(const PolygonPair& pair, int side, std::size_t vertex, AxisOf axis) {
    const PairedPolygon& p = pair.side(side);
    const Vec2 from = p.ring[vertex];
    const Vec2 to = p.ring[p.next(vertex)];
    const Vec2 base = pair.side(axis.side).ring[pair.side(axis.side).base(axis.index)];
    const ExactVec2 normal = pair.exact_axis(axis);
    const ExactVec2 way = pair.difference(to, from);
    const DoubleDouble t =
        enclosed_dot(normal, pair.difference(base, from)).value / enclosed_dot(normal, way).value;
    // An edge that is level up to rounding may cross the line beyond its ends.
    return t.hi >= 1.0 ? to : t.hi <= 0.0 ? from : pair.moved(from, t * way.x, t * way.y);
}

/// Height of v over the line through p and q, or its distance from p if they are closer than `tolerance`;
/// scaled.
double height(const PolygonPair& pair, Vec2 p, Vec2 q, Vec2 v, double tolerance) {
    const Vec2 base = pair.way(p, q);
    const double length = norm(base);
    if (!(length > tolerance)) {
        return norm(pair.way(p, v));
    }
    return std::fabs(cross((1.0 / length) * base, pair.way(p, v)));
}

/// Vertices that are nearer to each other than this, scaled, are one: both may be off by as much as an axis.
double merging_distance(const PolygonPair& pair, Slack slack) {
    return 2.0 * (pair.gap_error() + std::min(2.0 * slack.noise, slack.limit));
}

}  // namespace

void PolygonOverlap::add_part_inside(const PolygonPair& pair, int side, Slack slack) {
    const PairedPolygon& p = pair.side(side);
    const PairedPolygon& q = pair.other(side);
    // A point has no axes to be inside of; the pass for the other side tells whether it is part of this one.
    if (q.axes == 0) {
        return;
    }
    // A segment is one edge, not two; a point an edge of no length.
    const std::size_t edges = std::max<std::size_t>(p.edges == 2 ? 1 : p.edges, 1);
    for (std::size_t i = 0; i < edges; ++i) {
        const std::size_t end = p.next(i);
        double enter = 0.0;
        double leave = 1.0;
        std::size_t enter_axis = 0;
        std::size_t leave_axis = 0;
        for (std::size_t k = 0; k < q.axes && leave >= 0.0; ++k) {
            const double size = std::fabs(q.dx[k]) + std::fabs(q.dy[k]);
            const double level = pair.gap_error() * size + kPairUnderflow +
                                 std::min(slack.noise * (size + pair.reach()), slack.limit * size);
            const double from = dot(q.axis(k), p.local(i)) - q.own(k);
            const double to = dot(q.axis(k), p.local(end)) - q.own(k);
            if (from > level && to > level) {
                leave = -1.0;
            } else if (from > level && from / (from - to) > enter) {
                enter = from / (from - to);
                enter_axis = k;
            } else if (to > level && from / (from - to) < leave) {
                leave = from / (from - to);
                leave_axis = k;
            }
        }
        if (enter > leave) {
            // Across a sliver, rounding may exchange the two crossings.
            const double length = std::hypot(p.x[end] - p.x[i], p.y[end] - p.y[i]);
            if (leave >= 0.0 && enter <= 1.0 && (enter - leave) * length <= merging_distance(pair, slack)) {
                found_.push_back(crossing(pair, side, i, {1 - side, enter_axis}));
            }
            continue;
        }
        // The end of a whole edge is the start of the next one.
        if (enter == 0.0) {
            found_.push_back(p.ring[i]);
        }
        if (enter > 0.0) {
            found_.push_back(crossing(pair, side, i, {1 - side, enter_axis}));
        }
        if (leave < 1.0) {
            found_.push_back(crossing(pair, side, i, {1 - side, leave_axis}));
        }
        if (leave == 1.0 && p.edges == 2) {
            found_.push_back(p.ring[end]);
        }
    }
}

std::span<const Vec2> PolygonOverlap::of(const PolygonPair& pair, Slack slack) {
    found_.clear();
    for (const int side : {0, 1}) {
        add_part_inside(pair, side, slack);
    }
    if (found_.empty()) {
        return {};
    }
    const Ring hull = hull_.of(found_);

    // Where the polygons share a line, or cross in a vertex, rounding leaves vertices that are not there in
    // truth.
    const double tolerance = merging_distance(pair, slack);
    merged_.assign(hull.begin(), hull.end());
    for (std::size_t i = 0; merged_.size() > 1 && i < merged_.size();) {
        const std::size_t n = merged_.size();
        const Vec2 before = merged_[(i + n - 1) % n];
        const Vec2 behind = merged_[(i + 1) % n];
        const bool repeated = norm(pair.way(before, merged_[i])) <= tolerance;
        if (repeated || (n > 2 && height(pair, before, behind, merged_[i], tolerance) <= tolerance)) {
            merged_.erase(merged_.begin() + static_cast<std::ptrdiff_t>(i));
        } else {
            ++i;
        }
    }
    return merged_;
}

}  // namespace geomsrv
