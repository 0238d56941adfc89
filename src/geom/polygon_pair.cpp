// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
#include "geom/polygon_pair.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "geom/exact_sign.hpp"
#include "geom/lanes.hpp"

namespace geomsrv {

namespace {

// Lengths are rescaled where the reach leaves [2^-200, 2^200]: then products of four lengths (squared dot
// products of edges) and of three with a roundoff stay in the range of double.
constexpr double kSmallestReach = 0x1p-200;
constexpr double kLargestReach = 0x1p200;

// All pairs of axis and vertex are projected up to this many; beyond it supports are found by walking.
// Measured: the walk costs about as much as 16 x 16 projections, and needs more than twice that to make up
// for its larger error.
constexpr std::size_t kLargestProduct = 1024;

// Gain of height along an edge that is certainly not rounding: two relatively exact edges, products, sum.
constexpr double kHeightError = 6.0 * kRoundoff;

constexpr std::size_t kLanes = Lanes::kCount;

constexpr std::size_t padded(std::size_t count) { return (count + kLanes - 1) / kLanes * kLanes; }

double largest_coordinate(Vec2 v) { return std::max(std::fabs(v.x), std::fabs(v.y)); }

/// Four points, their coordinates apart.
struct PointLanes {
    Lanes x, y;
};

GEOMSRV_INLINE PointLanes load_points(const Vec2* from) {
    const Lanes first = Lanes::load(&from->x);
    const Lanes second = Lanes::load(&from[2].x);
    return {Lanes(__builtin_shufflevector(first.v, second.v, 0, 2, 4, 6)),
            Lanes(__builtin_shufflevector(first.v, second.v, 1, 3, 5, 7))};
}

/// Local coordinates of a ring; returns the largest of them.
GEOMSRV_INLINE double place_vertices(const PairedPolygon& p, Vec2 origin) {
    const std::size_t n = p.ring.size();
    const Vec2* const ring = p.ring.data();
    if (n < kLanes) {
        double largest_part = 0.0;
        for (std::size_t i = 0; i < n; ++i) {
            p.x[i] = ring[i].x - origin.x;
            p.y[i] = ring[i].y - origin.y;
            largest_part = greater(largest_part, greater(magnitude(p.x[i]), magnitude(p.y[i])));
        }
        return largest_part;
    }
    Lanes largest_parts = 0.0;
    const auto place = [&](std::size_t i) __attribute__((always_inline)) {
        const PointLanes points = load_points(ring + i);
        const Lanes x = points.x - origin.x;
        const Lanes y = points.y - origin.y;
        x.store(p.x + i);
        y.store(p.y + i);
        largest_parts = greater(largest_parts, greater(magnitude(x), magnitude(y)));
    };
    for (std::size_t i = 0; i + kLanes < n; i += kLanes) {
        place(i);
    }
    place(n - kLanes);  // the last block may overlap the one before
    return greatest(largest_parts);
}

/// Outward normals of the edges.
GEOMSRV_INLINE void place_edges(const PairedPolygon& p) {
    const std::size_t n = p.ring.size();
    const Vec2* const ring = p.ring.data();
    const std::size_t inner = n - 1;  // edges that need not wrap round
    if (inner < kLanes) {
        for (std::size_t i = 0; i < inner; ++i) {
            p.dx[i] = ring[i + 1].y - ring[i].y;
            p.dy[i] = ring[i].x - ring[i + 1].x;
        }
    } else {
        const auto place = [&](std::size_t i) __attribute__((always_inline)) {
            const PointLanes from = load_points(ring + i);
            const PointLanes to = load_points(ring + i + 1);
            (to.y - from.y).store(p.dx + i);
            (from.x - to.x).store(p.dy + i);
        };
        for (std::size_t i = 0; i + kLanes < inner; i += kLanes) {
            place(i);
        }
        place(inner - kLanes);
    }
    p.dx[inner] = ring[0].y - ring[inner].y;
    p.dy[inner] = ring[inner].x - ring[0].x;
}

struct EdgeCheck {
    bool strict = true;     ///< every turn is certainly to the left
    bool has_tips = false;  ///< some turn exceeds 120 degrees
};

constexpr bool is_tip(Vec2 edge, Vec2 next) {
    const double forward = dot(edge, next);
    // cos(turn) < -1/2, squared.
    return forward < 0.0 && 4.0 * forward * forward > dot(edge, edge) * dot(next, next);
}

GEOMSRV_INLINE EdgeCheck check_edges(const PairedPolygon& p) {
    const std::size_t n = p.ring.size();
    // The ring of edges goes on into the padding, so that turns need no index arithmetic.
    for (std::size_t i = 0, wrapped = 0; i <= kLanes; ++i) {
        p.dx[n + i] = p.dx[wrapped];
        p.dy[n + i] = p.dy[wrapped];
        wrapped = wrapped + 1 < n ? wrapped + 1 : 0;
    }
    LaneMask strict = Lanes(0.0) <= Lanes(0.0);
    LaneMask sharp = ~strict;
    for (std::size_t i = 0; i < n; i += kLanes) {
        const Lanes x = Lanes::load(p.dx + i);
        const Lanes y = Lanes::load(p.dy + i);
        const Lanes next_x = Lanes::load(p.dx + i + 1);
        const Lanes next_y = Lanes::load(p.dy + i + 1);
        const Lanes left = x * next_y;
        const Lanes right = y * next_x;
        const Lanes bound = kCrossError * (magnitude(left) + magnitude(right)) + kCrossUnderflow;
        strict = strict & (bound < left - right);  // the normals turn as the edges do
        const Lanes forward = x * next_x + y * next_y;
        const Lanes lengths = (x * x + y * y) * (next_x * next_x + next_y * next_y);
        sharp = sharp | ((forward < 0.0) & (lengths < 4.0 * forward * forward));
    }
    return {all(strict), any(sharp)};
}

/// Own supports of all axes that start at their edge's first vertex.
GEOMSRV_INLINE void place_own(const PairedPolygon& p) {
    for (std::size_t k = 0; k < p.edges; k += kLanes) {
        (Lanes::load(p.dx + k) * Lanes::load(p.x + k) + Lanes::load(p.dy + k) * Lanes::load(p.y + k))
            .store(p.own + k);
    }
}

/// As place_vertices and place_edges, for extreme coordinates.
double place_scaled(const PairedPolygon& p, Vec2 origin, double before, double scale) {
    double largest_part = 0.0;
    const std::size_t n = p.ring.size();
    const auto apart = [=](double to, double from) { return scale * (before * to - before * from); };
    for (std::size_t i = 0; i < n; ++i) {
        const Vec2 v = p.ring[i];
        const Vec2 next = p.ring[p.next(i)];
        p.x[i] = apart(v.x, origin.x);
        p.y[i] = apart(v.y, origin.y);
        p.dx[i] = apart(next.y, v.y);
        p.dy[i] = apart(v.x, next.x);
        largest_part = std::max({largest_part, std::fabs(p.x[i]), std::fabs(p.y[i])});
    }
    return largest_part;
}

/// Writes the tip axes behind those of the edges; false if there are more than a convex ring can have.
bool place_tips(PairedPolygon& p) {
    // Two, or three by rounding if the ring is an equilateral triangle.
    constexpr std::size_t kMost = 3;
    std::array<Vec2, kMost> outward_axes;
    const std::size_t n = p.edges;
    std::size_t count = 0;
    for (std::size_t i = 0; i < n; ++i) {
        // Normals turned by 90 degrees are the edges before and behind vertex i.
        const Vec2 before{-p.dy[p.previous(i)], p.dx[p.previous(i)]};
        const Vec2 behind{-p.dy[i], p.dx[i]};
        if (n > 2 && !is_tip(before, behind)) {
            continue;
        }
        if (count == kMost) {
            return false;
        }
        outward_axes[count] = unit(before) - unit(behind);
        p.tip[count] = i;
        ++count;
    }
    for (std::size_t k = 0; k < count; ++k) {
        p.dx[n + k] = outward_axes[k].x;
        p.dy[n + k] = outward_axes[k].y;
        p.own[n + k] = dot(outward_axes[k], p.local(p.tip[k]));
    }
    p.axes = n + count;
    return true;
}

/// Axis k of p projected on all vertices of q.
GEOMSRV_INLINE void project_all(const PairedPolygon& p, const PairedPolygon& q) {
    const std::size_t n = q.ring.size();
    const std::size_t end = padded(p.axes);
    std::size_t k = 0;
    for (; k + 2 * kLanes <= end; k += 2 * kLanes) {
        // Two blocks at a time share the loads of the vertices.
        const Lanes dx0 = Lanes::load(p.dx + k);
        const Lanes dy0 = Lanes::load(p.dy + k);
        const Lanes dx1 = Lanes::load(p.dx + k + kLanes);
        const Lanes dy1 = Lanes::load(p.dy + k + kLanes);
        Lanes low0 = dx0 * q.x[0] + dy0 * q.y[0];
        Lanes low1 = dx1 * q.x[0] + dy1 * q.y[0];
        for (std::size_t j = 1; j < n; ++j) {
            const Lanes height0 = dx0 * q.x[j] + dy0 * q.y[j];
            const Lanes height1 = dx1 * q.x[j] + dy1 * q.y[j];
            low0 = lesser(height0, low0);
            low1 = lesser(height1, low1);
        }
        (low0 - Lanes::load(p.own + k)).store(p.gap + k);
        (low1 - Lanes::load(p.own + k + kLanes)).store(p.gap + k + kLanes);
    }
    for (; k < end; k += kLanes) {
        const Lanes dx = Lanes::load(p.dx + k);
        const Lanes dy = Lanes::load(p.dy + k);
        Lanes low = dx * q.x[0] + dy * q.y[0];
        for (std::size_t j = 1; j < n; ++j) {
            const Lanes height = dx * q.x[j] + dy * q.y[j];
            low = lesser(height, low);
        }
        (low - Lanes::load(p.own + k)).store(p.gap + k);
    }
}

GEOMSRV_INLINE std::size_t lowest_vertex(const PairedPolygon& q, Vec2 axis) {
    std::size_t best = 0;
    double low = std::numeric_limits<double>::infinity();
    for (std::size_t j = 0; j < q.ring.size(); ++j) {
        const double height = dot(axis, q.local(j));
        // Without a branch: which vertex is lowest cannot be predicted.
        best = height < low ? j : best;
        low = lesser(height, low);
    }
    return best;
}

/// Height gained along an axis by the edge that starts at a vertex of q.
double gain(Vec2 axis, const PairedPolygon& q, std::size_t vertex) { return -cross(axis, q.axis(vertex)); }

/// The same gaps for edges, by walking round q once while the axes go round p.
void project_by_walking(const PairedPolygon& p, const PairedPolygon& q) {
    std::size_t j = lowest_vertex(q, p.axis(0));
    for (std::size_t k = 0; k < p.edges; ++k) {
        const Vec2 axis = p.axis(k);
        for (std::size_t steps = 0; steps < q.edges && gain(axis, q, j) < 0.0; ++steps) {
            j = q.next(j);
        }
        p.gap[k] = dot(axis, q.local(j)) - p.own[k];
    }
    for (std::size_t k = p.edges; k < p.axes; ++k) {
        p.gap[k] = dot(p.axis(k), q.local(lowest_vertex(q, p.axis(k)))) - p.own[k];
    }
    std::fill(p.gap + p.axes, p.gap + padded(p.axes), -1.0);
}

GEOMSRV_WIDE_CLONES double place_both(const PairedPolygon& a, const PairedPolygon& b, Vec2 origin) {
    const double reach_a = place_vertices(a, origin);
    const double reach_b = place_vertices(b, origin);
    place_edges(a);
    place_edges(b);
    return greater(reach_a, reach_b);
}

GEOMSRV_WIDE_CLONES EdgeCheck check_and_place_own(const PairedPolygon& p) {
    const EdgeCheck check = check_edges(p);
    place_own(p);
    return check;
}

GEOMSRV_WIDE_CLONES void project_all_of_both(const PairedPolygon& a, const PairedPolygon& b) {
    project_all(a, b);
    project_all(b, a);
}

/// Counts vertices from `start` on, in one direction, that are level with it.
std::size_t count_level(const PairedPolygon& q, Vec2 axis, std::size_t start, bool forward, Slack slack) {
    const double axis_length = std::fabs(axis.x) + std::fabs(axis.y);
    double height = 0.0;
    double length = 0.0;
    double rounding = 0.0;
    std::size_t vertex = start;
    std::size_t count = 0;
    while (count + 1 < q.ring.size()) {
        const std::size_t edge = forward ? vertex : q.previous(vertex);
        const Vec2 normal = q.axis(edge);
        const double step = gain(axis, q, edge);
        height += forward ? step : -step;
        length += std::fabs(normal.x) + std::fabs(normal.y);
        rounding +=
            kHeightError * (std::fabs(axis.x * normal.y) + std::fabs(axis.y * normal.x)) + kPairUnderflow;
        const double level =
            rounding + std::min(slack.noise * (axis_length + length), slack.limit * axis_length);
        if (!(std::fabs(height) <= level)) {
            break;
        }
        vertex = forward ? q.next(vertex) : edge;
        ++count;
    }
    return count;
}

/// Vertices of q level with an extreme one.
Chain level_chain(const PairedPolygon& q, Vec2 axis, std::size_t start, Slack slack) {
    const std::size_t n = q.ring.size();
    const std::size_t ahead = count_level(q, axis, start, true, slack);
    const std::size_t behind = std::min(count_level(q, axis, start, false, slack), n - 1 - ahead);
    const std::size_t first = start >= behind ? start - behind : start + n - behind;
    const std::size_t last = start + ahead;
    return {first, last < n ? last : last - n};
}

DoubleDouble difference_of(double to, double from, double before, double scale) {
    const DoubleDouble apart = two_sum(before * to, -(before * from));
    return {scale * apart.hi, scale * apart.lo};
}

}  // namespace

PolygonPair::PolygonPair(std::size_t largest_a, std::size_t largest_b) {
    // Room for the ring of edges to go on past its end, for tips, and for whole blocks of lanes.
    const std::array<std::size_t, 2> lengths = {padded(largest_a + 2 * kLanes),
                                                padded(largest_b + 2 * kLanes)};
    constexpr std::size_t kArrays = 9;
    storage_.resize(kArrays * (lengths[0] + lengths[1]));
    double* at = storage_.data();
    for (std::size_t side = 0; side < 2; ++side) {
        PairedPolygon& p = sides_[side];
        for (double** array :
             {&p.x, &p.y, &p.dx, &p.dy, &p.own, &p.gap, &p.work[0], &p.work[1], &p.work[2]}) {
            *array = at;
            at += lengths[side];
        }
    }
}

void PolygonPair::load(Ring a, Ring b) {
    if (!place(a, b, false)) {
        place(hulls_[0].of(a), hulls_[1].of(b), true);
    }
    project();
}

bool PolygonPair::place(Ring a, Ring b, bool known_strict) {
    const Vec2 origin = a[0];
    auto& [first, second] = sides_;
    first.ring = a;
    second.ring = b;
    before_ = 1.0;
    scale_ = 1.0;
    scale_exponent_ = 0;
    reach_ = place_both(first, second, origin);
    if (!(reach_ <= kLargestReach) || (reach_ < kSmallestReach && reach_ > 0.0)) {
        const auto place_again = [&] {
            reach_ = std::max(place_scaled(first, origin, before_, scale_),
                              place_scaled(second, origin, before_, scale_));
        };
        // Coordinates of opposite signs may differ by more than the largest double.
        if (std::isinf(reach_)) {
            before_ = 0.25;
            place_again();
        }
        // 2^1000 at most, to stay a double; it brings the smallest reach, 2^-1074, to 2^-74.
        const int exponent = std::clamp(-std::ilogb(reach_), -1000, 1000);
        scale_ = std::scalbn(1.0, exponent);
        scale_exponent_ = exponent + std::ilogb(before_);
        place_again();
    }
    magnitude_ = scale_ * (before_ * largest_coordinate(origin)) + reach_;
    if (!place_axes(first, known_strict) || !place_axes(second, known_strict)) {
        return false;
    }
    if (first.edges == 0 && second.edges == 0) {
        // Two points: any two axes and their opposites.
        constexpr std::array<Vec2, 4> kAxes = {{{1.0, 0.0}, {0.0, 1.0}, {-1.0, 0.0}, {0.0, -1.0}}};
        for (std::size_t k = 0; k < kAxes.size(); ++k) {
            first.dx[k] = kAxes[k].x;
            first.dy[k] = kAxes[k].y;
            first.own[k] = 0.0;  // the point is the origin
            first.tip[k] = 0;
        }
        first.axes = kAxes.size();
    }
    return true;
}

bool PolygonPair::place_axes(PairedPolygon& p, bool known_strict) {
    const std::size_t n = p.ring.size();
    p.edges = n > 1 ? n : 0;
    p.axes = p.edges;
    if (n == 1) {
        return true;
    }
    const EdgeCheck check = check_and_place_own(p);
    if (n > 2 && !check.strict && !known_strict) {
        return false;
    }
    if (n == 2 && p.dx[0] == 0.0 && p.dy[0] == 0.0) {
        return false;
    }
    if ((check.has_tips || n == 2) && !place_tips(p)) {
        return false;
    }
    for (std::size_t k = p.axes; k < padded(p.axes); ++k) {
        p.dx[k] = p.dy[k] = 0.0;
        p.own[k] = 1.0;  // a gap of -1: overlapping whatever the motion, so padding never matters
    }
    return true;
}

void PolygonPair::project() {
    const auto& [a, b] = sides_;
    const bool walk = a.edges > 2 && b.edges > 2 && a.edges * b.edges > kLargestProduct;
    if (walk) {
        project_by_walking(a, b);
        project_by_walking(b, a);
    } else {
        project_all_of_both(a, b);
    }
    gap_error_ = (walk ? kGapError + kWalkError : kGapError) * kRoundoff * reach_;
}

ExactVec2 PolygonPair::difference(Vec2 to, Vec2 from) const {
    return {difference_of(to.x, from.x, before_, scale_), difference_of(to.y, from.y, before_, scale_)};
}

std::size_t PolygonPair::lowest(AxisOf axis) const {
    const Vec2 direction = side(axis.side).axis(axis.index);
    const PairedPolygon& q = other(axis.side);
    std::size_t vertex = lowest_vertex(q, direction);
    // Rounding of coordinates may have chosen a neighbour; edges know better.
    for (std::size_t steps = 0; steps < q.edges && gain(direction, q, vertex) < 0.0; ++steps) {
        vertex = q.next(vertex);
    }
    for (std::size_t steps = 0; steps < q.edges && gain(direction, q, q.previous(vertex)) > 0.0; ++steps) {
        vertex = q.previous(vertex);
    }
    return vertex;
}

Chain PolygonPair::lowest(AxisOf axis, std::size_t vertex, Slack slack) const {
    return level_chain(other(axis.side), side(axis.side).axis(axis.index), vertex, slack);
}

Chain PolygonPair::highest(AxisOf axis, Slack slack) const {
    const PairedPolygon& p = side(axis.side);
    return level_chain(p, p.axis(axis.index), p.base(axis.index), slack);
}

AxisOf PolygonPair::widest_gap() const {
    AxisOf best;
    double widest = -std::numeric_limits<double>::infinity();
    const auto consider = [&](int i, std::size_t begin, std::size_t end) {
        for (std::size_t k = begin; k < end; ++k) {
            const double width = side(i).gap[k] / std::hypot(side(i).dx[k], side(i).dy[k]);
            if (width > widest) {
                widest = width;
                best = {i, k};
            }
        }
    };
    for (const int i : {0, 1}) {
        consider(i, 0, side(i).edges);
    }
    for (const int i : {0, 1}) {
        consider(i, side(i).edges, side(i).axes);
    }
    return best;
}

ExactVec2 PolygonPair::exact_axis(AxisOf axis) const {
    const PairedPolygon& p = side(axis.side);
    if (axis.index >= p.edges) {
        return {{p.dx[axis.index], 0.0}, {p.dy[axis.index], 0.0}};
    }
    const ExactVec2 edge = difference(p.ring[p.next(axis.index)], p.ring[axis.index]);
    return {edge.y, -edge.x};
}

Enclosed PolygonPair::enclosed_gap(AxisOf axis, const ExactVec2& direction, std::size_t lowest_vertex) const {
    const PairedPolygon& q = other(axis.side);
    const Vec2 base = side(axis.side).ring[side(axis.side).base(axis.index)];
    const Chain chain = lowest(axis, lowest_vertex, {});
    Enclosed least = enclosed_dot(direction, difference(q.ring[chain.first], base));
    for (std::size_t j = chain.first; j != chain.last;) {
        j = q.next(j);
        const Enclosed gap = enclosed_dot(direction, difference(q.ring[j], base));
        const double error = std::max(gap.error, least.error);
        if (gap.value < least.value) {
            least = gap;
        }
        least.error = error;
    }
    return least;
}

int PolygonPair::sign_of_gap(AxisOf axis, std::size_t lowest_vertex) const {
    const PairedPolygon& p = side(axis.side);
    const PairedPolygon& q = other(axis.side);
    const Vec2 base = p.ring[p.base(axis.index)];
    const auto sign_at = [&](std::size_t j) {
        if (axis.index >= p.edges) {
            return sign_of_dot({}, p.axis(axis.index), base, q.ring[j]);
        }
        return -orientation(base, p.ring[p.next(axis.index)], q.ring[j]);
    };
    const Chain chain = lowest(axis, lowest_vertex, {});
    int least = sign_at(chain.first);
    for (std::size_t j = chain.first; j != chain.last;) {
        j = q.next(j);
        least = std::min(least, sign_at(j));
    }
    return least;
}

}  // namespace geomsrv
