// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
#include "geom/polygon_overlap.hpp"

#include <algorithm>
#include <cmath>

#include "geom/lanes.hpp"

namespace geomsrv {

namespace {

constexpr std::size_t kLanes = Lanes::kCount;

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
        quotient(enclosed_dot(normal, pair.difference(base, from)).value, enclosed_dot(normal, way).value);
    // An edge that is level up to rounding may cross the line beyond its ends.
    return t.hi >= 1.0 ? to : t.hi <= 0.0 ? from : pair.moved(from, t * way.x, t * way.y);
}

/// Whether v is within `tolerance` of the line through p and q, or of p if they are closer than that.
bool is_level(Vec2 p_to_q, Vec2 p_to_v, double tolerance) {
    const double squared_length = dot(p_to_q, p_to_q);
    const double square = tolerance * tolerance;
    if (!(squared_length > square)) {
        return dot(p_to_v, p_to_v) <= square;
    }
    const double area = cross(p_to_q, p_to_v);
    return area * area <= square * squared_length;
}

/// Vertices that are nearer to each other than this, scaled, are one: both may be off by as much as an axis.
double merging_distance(const PolygonPair& pair, Slack slack) {
    return 2.0 * (pair.gap_error() + std::min(2.0 * slack.noise, slack.limit));
}

/// Leaves for every axis of q the own support in work[0], and in work[1] how far beyond it still counts as
/// inside.
GEOMSRV_WIDE_CLONES void leave_levels(const PolygonPair& pair, const PairedPolygon& q, Slack slack) {
    for (std::size_t k = 0; k < q.axes; k += kLanes) {
        const Lanes dx = Lanes::load(q.dx + k);
        const Lanes dy = Lanes::load(q.dy + k);
        const Lanes size = magnitude(dx) + magnitude(dy);
        const Lanes noise = lesser<Lanes>(slack.noise * (size + Lanes(pair.reach())), slack.limit * size);
        (dx * Lanes::load(q.x + k) + dy * Lanes::load(q.y + k)).store(q.work[0] + k);
        (pair.gap_error() * size + Lanes(kPairUnderflow) + noise).store(q.work[1] + k);
    }
}

/// Leaves in work[0] and work[1] of p, for every edge, from where to where it is inside of q, 0 to 1; to -1
/// if all of it is beyond some axis; in work[2] and work[3] the first axes that say so.
///
/// Four edges at a time: they need no outcome of one another.
GEOMSRV_WIDE_CLONES void clip_edges(const PairedPolygon& p, const PairedPolygon& q) {
    const std::size_t n = p.ring.size();
    const Lanes none = 0.0;
    const Lanes whole = 1.0;
    const double* const own = q.work[0];
    const double* const level = q.work[1];
    for (std::size_t i = 0; i < n; i += kLanes) {
        const Lanes x = Lanes::load(p.x + i);
        const Lanes y = Lanes::load(p.y + i);
        const auto next_of = [&](const double* at) {
            const auto next = [&](std::size_t j) { return at[i + j + 1 < n ? i + j + 1 : 0]; };
            return Lanes(Lanes::Vector{next(0), next(1), next(2), next(3)});
        };
        const Lanes next_x = next_of(p.x);
        const Lanes next_y = next_of(p.y);
        Lanes enter = none;
        Lanes leave = whole;
        Lanes enter_axis = none;
        Lanes leave_axis = none;
        for (std::size_t k = 0; k < q.axes; ++k) {
            const Lanes from = Lanes(q.dx[k]) * x + Lanes(q.dy[k]) * y - Lanes(own[k]);
            const Lanes to = Lanes(q.dx[k]) * next_x + Lanes(q.dy[k]) * next_y - Lanes(own[k]);
            const LaneMask starts_beyond = Lanes(level[k]) < from;
            const LaneMask ends_beyond = Lanes(level[k]) < to;
            const Lanes time = from / (from - to);
            const Lanes axis = static_cast<double>(k);
            const Lanes entering = select(starts_beyond & ~ends_beyond, time, none);
            const Lanes leaving = select(ends_beyond, select(starts_beyond, Lanes(-1.0), time), whole);
            enter_axis = select(enter < entering, axis, enter_axis);
            enter = greater(enter, entering);
            leave_axis = select(leaving < leave, axis, leave_axis);
            leave = lesser(leave, leaving);
        }
        enter.store(p.work[0] + i);
        leave.store(p.work[1] + i);
        enter_axis.store(p.work[2] + i);
        leave_axis.store(p.work[3] + i);
    }
}

}  // namespace

void PolygonOverlap::add_part_inside(const PolygonPair& pair, int side, Slack slack) {
    const PairedPolygon& p = pair.side(side);
    const PairedPolygon& q = pair.other(side);
    // A point has no axes to be inside of; the pass for the other side tells whether it is part of this one.
    if (q.axes == 0) {
        return;
    }
    leave_levels(pair, q, slack);
    clip_edges(p, q);
    // A segment is one edge, not two; a point an edge of no length.
    const std::size_t edges = std::max<std::size_t>(p.edges == 2 ? 1 : p.edges, 1);
    for (std::size_t i = 0; i < edges; ++i) {
        const std::size_t end = p.next(i);
        const double enter = p.work[0][i];
        const double leave = p.work[1][i];
        // Where two edges cross is on both of them, and needs to be found once.
        const auto add_crossing = [&](bool entering) {
            const auto axis = static_cast<std::size_t>(p.work[entering ? 2 : 3][i]);
            const std::array<std::size_t, 2> edges_of_both = {side == 0 ? i : axis, side == 0 ? axis : i};
            if (axis < q.edges) {
                if (std::ranges::find(crossed_, edges_of_both) != crossed_.end()) {
                    return;
                }
                crossed_.push_back(edges_of_both);
            }
            found_.push_back(crossing(pair, side, i, {1 - side, axis}));
        };
        if (enter > leave) {
            // Across a sliver, rounding may exchange the two crossings.
            const double length = std::hypot(p.x[end] - p.x[i], p.y[end] - p.y[i]);
            if (leave >= 0.0 && enter <= 1.0 && (enter - leave) * length <= merging_distance(pair, slack)) {
                add_crossing(true);
            }
            continue;
        }
        // The end of a whole edge is the start of the next one.
        if (enter == 0.0) {
            found_.push_back(p.ring[i]);
        }
        if (enter > 0.0) {
            add_crossing(true);
        }
        if (leave < 1.0) {
            add_crossing(false);
        }
        if (leave == 1.0 && p.edges == 2) {
            found_.push_back(p.ring[end]);
        }
    }
}

std::span<const Vec2> PolygonOverlap::of(const PolygonPair& pair, Slack slack) {
    found_.clear();
    crossed_.clear();
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
        const Vec2 before = merged_[(i > 0 ? i : n) - 1];
        const Vec2 way = pair.way(before, merged_[i]);
        const bool repeated = dot(way, way) <= tolerance * tolerance;
        if (repeated ||
            (n > 2 && is_level(pair.way(before, merged_[i + 1 < n ? i + 1 : 0]), way, tolerance))) {
            merged_.erase(merged_.begin() + static_cast<std::ptrdiff_t>(i));
        } else {
            ++i;
        }
    }
    return merged_;
}

}  // namespace geomsrv
