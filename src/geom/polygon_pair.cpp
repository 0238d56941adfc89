// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
#include "geom/polygon_pair.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "geom/exact_sign.hpp"
#include "geom/wide.hpp"

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

constexpr std::size_t padded(std::size_t count) { return (count + kLanes - 1) / kLanes * kLanes; }

double largest_coordinate(Vec2 v) { return std::max(std::fabs(v.x), std::fabs(v.y)); }

struct Units {
    double before = 1.0;
    double scale = 1.0;
};

/// Local coordinates of a ring; returns the largest of them.
template <bool kScaled>
GEOMSRV_INLINE double place_vertices(const PairedPolygon& p, Vec2 origin, Units units) {
    double largest = 0.0;
    for (std::size_t i = 0; i < p.ring.size(); ++i) {
        const Vec2 v = p.ring[i];
        double x = v.x - origin.x;
        double y = v.y - origin.y;
        if constexpr (kScaled) {
            x = units.scale * (units.before * v.x - units.before * origin.x);
            y = units.scale * (units.before * v.y - units.before * origin.y);
        }
        p.x[i] = x;
        p.y[i] = y;
        const double size = std::max(std::fabs(x), std::fabs(y));
        largest = largest < size ? size : largest;
    }
    return largest;
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

/// Outward normals of the edges of a ring of at least two vertices.
template <bool kScaled>
GEOMSRV_INLINE EdgeCheck place_edges(const PairedPolygon& p, Units units) {
    const std::size_t n = p.ring.size();
    for (std::size_t i = 0; i < n; ++i) {
        const Vec2 from = p.ring[i];
        const Vec2 to = p.ring[i + 1 < n ? i + 1 : 0];
        double dx = to.y - from.y;
        double dy = from.x - to.x;
        if constexpr (kScaled) {
            dx = units.scale * (units.before * to.y - units.before * from.y);
            dy = units.scale * (units.before * from.x - units.before * to.x);
        }
        p.dx[i] = dx;
        p.dy[i] = dy;
    }
    // The ring of edges goes on into the padding, so that turns need no index arithmetic.
    for (std::size_t i = 0; i <= kLanes; ++i) {
        p.dx[n + i] = p.dx[i % n];
        p.dy[n + i] = p.dy[i % n];
    }
    Mask flat{};
    Mask sharp{};
    for (std::size_t i = 0; i < n; i += kLanes) {
        const Lanes x = load(p.dx + i);
        const Lanes y = load(p.dy + i);
        const Lanes next_x = load(p.dx + i + 1);
        const Lanes next_y = load(p.dy + i + 1);
        const Lanes left = x * next_y;
        const Lanes right = y * next_x;
        const Lanes bound = kCrossError * (magnitude(left) + magnitude(right)) + kCrossUnderflow;
        flat |= ~(left - right > bound);  // the normals turn as the edges do
        const Lanes forward = x * next_x + y * next_y;
        sharp |= (forward < 0.0) &
                 (4.0 * forward * forward > (x * x + y * y) * (next_x * next_x + next_y * next_y));
    }
    return {!any(flat), any(sharp)};
}

/// Unit vector, whatever the length of v; v is not zero.
Vec2 unit(Vec2 v) {
    const double largest = largest_coordinate(v);
    const Vec2 reduced{v.x / largest, v.y / largest};
    return (1.0 / norm(reduced)) * reduced;
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
        const Lanes dx0 = load(p.dx + k);
        const Lanes dy0 = load(p.dy + k);
        const Lanes dx1 = load(p.dx + k + kLanes);
        const Lanes dy1 = load(p.dy + k + kLanes);
        Lanes low0 = dx0 * q.x[0] + dy0 * q.y[0];
        Lanes low1 = dx1 * q.x[0] + dy1 * q.y[0];
        for (std::size_t j = 1; j < n; ++j) {
            const Lanes height0 = dx0 * q.x[j] + dy0 * q.y[j];
            const Lanes height1 = dx1 * q.x[j] + dy1 * q.y[j];
            low0 = height0 < low0 ? height0 : low0;
            low1 = height1 < low1 ? height1 : low1;
        }
        store(p.gap + k, low0 - load(p.own + k));
        store(p.gap + k + kLanes, low1 - load(p.own + k + kLanes));
    }
    for (; k < end; k += kLanes) {
        const Lanes dx = load(p.dx + k);
        const Lanes dy = load(p.dy + k);
        Lanes low = dx * q.x[0] + dy * q.y[0];
        for (std::size_t j = 1; j < n; ++j) {
            const Lanes height = dx * q.x[j] + dy * q.y[j];
            low = height < low ? height : low;
        }
        store(p.gap + k, low - load(p.own + k));
    }
}

std::size_t lowest_vertex(const PairedPolygon& q, Vec2 axis) {
    std::size_t best = 0;
    double low = std::numeric_limits<double>::infinity();
    for (std::size_t j = 0; j < q.ring.size(); ++j) {
        const double height = dot(axis, q.local(j));
        if (height < low) {
            low = height;
            best = j;
        }
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
}

GEOMSRV_WIDE_CLONES double place_vertices_of_both(const PairedPolygon& a, const PairedPolygon& b,
                                                  Vec2 origin) {
    return std::max(place_vertices<false>(a, origin, {}), place_vertices<false>(b, origin, {}));
}

GEOMSRV_WIDE_CLONES EdgeCheck place_plain_edges(const PairedPolygon& p) { return place_edges<false>(p, {}); }

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
    return {(start + n - behind) % n, (start + ahead) % n};
}

TwoFold difference_of(double to, double from, double before, double scale) {
    return scaled(scale, two_difference(before * to, before * from));
}

}  // namespace

Enclosed enclosed_dot(TwoFoldVec2 a, TwoFoldVec2 b) {
    const TwoFold x = a.x * b.x;
    const TwoFold y = a.y * b.y;
    const double size = std::fabs(x.hi) + std::fabs(y.hi);
    return {x + y, kTwoFoldDotError * kTwoFoldRoundoff * size + kPairUnderflow};
}

PolygonPair::PolygonPair(std::size_t largest_a, std::size_t largest_b) {
    // Room for the ring of edges to go on past its end, for tips, and for whole blocks of lanes.
    const std::array<std::size_t, 2> lengths = {padded(largest_a + 2 * kLanes),
                                                padded(largest_b + 2 * kLanes)};
    constexpr std::size_t kArrays = 8;
    storage_.resize(kArrays * (lengths[0] + lengths[1]));
    double* at = storage_.data();
    for (std::size_t side = 0; side < 2; ++side) {
        PairedPolygon& p = sides_[side];
        for (double** array : {&p.x, &p.y, &p.dx, &p.dy, &p.own, &p.gap, &p.work[0], &p.work[1]}) {
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
    reach_ = place_vertices_of_both(first, second, origin);
    if (!(reach_ <= kLargestReach) || (reach_ < kSmallestReach && reach_ > 0.0)) {
        const auto place_scaled = [&] {
            const Units units{before_, scale_};
            reach_ = std::max(place_vertices<true>(first, origin, units),
                              place_vertices<true>(second, origin, units));
        };
        // Coordinates of opposite signs may differ by more than the largest double.
        if (std::isinf(reach_)) {
            before_ = 0.25;
        }
        place_scaled();
        // 2^1000 at most, to stay a double; it brings the smallest reach, 2^-1074, to 2^-74.
        const int exponent = std::clamp(-std::ilogb(reach_), -1000, 1000);
        scale_ = std::scalbn(1.0, exponent);
        scale_exponent_ = exponent + std::ilogb(before_);
        place_scaled();
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
    const bool plain = scale_ == 1.0 && before_ == 1.0;
    const EdgeCheck check = plain ? place_plain_edges(p) : place_edges<true>(p, {before_, scale_});
    if (n > 2 && !check.strict && !known_strict) {
        return false;
    }
    if (n == 2 && p.dx[0] == 0.0 && p.dy[0] == 0.0) {
        return false;
    }
    if ((check.has_tips || n == 2) && !place_tips(p)) {
        return false;
    }
    for (std::size_t k = 0; k < p.axes; ++k) {
        p.own[k] = dot(p.axis(k), p.local(p.base(k)));
    }
    for (std::size_t k = p.axes; k < padded(p.axes); ++k) {
        p.dx[k] = p.dy[k] = p.own[k] = 0.0;
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

TwoFoldVec2 PolygonPair::difference(Vec2 to, Vec2 from) const {
    return {difference_of(to.x, from.x, before_, scale_), difference_of(to.y, from.y, before_, scale_)};
}

Chain PolygonPair::lowest(AxisOf axis, Slack slack) const {
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
    return level_chain(q, direction, vertex, slack);
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

TwoFoldVec2 PolygonPair::exact_axis(AxisOf axis) const {
    const PairedPolygon& p = side(axis.side);
    if (axis.index >= p.edges) {
        return {{p.dx[axis.index], 0.0}, {p.dy[axis.index], 0.0}};
    }
    const TwoFoldVec2 edge = difference(p.ring[p.next(axis.index)], p.ring[axis.index]);
    return {edge.y, -edge.x};
}

Enclosed PolygonPair::enclosed_gap(AxisOf axis) const {
    const PairedPolygon& q = other(axis.side);
    const TwoFoldVec2 direction = exact_axis(axis);
    const Vec2 base = side(axis.side).ring[side(axis.side).base(axis.index)];
    const Chain chain = lowest(axis, {});
    Enclosed least = enclosed_dot(direction, difference(q.ring[chain.first], base));
    for (std::size_t j = chain.first; j != chain.last;) {
        j = q.next(j);
        const Enclosed gap = enclosed_dot(direction, difference(q.ring[j], base));
        const double error = std::max(gap.error, least.error);
        if ((gap.value - least.value).hi < 0.0) {
            least = gap;
        }
        least.error = error;
    }
    return least;
}

int PolygonPair::sign_of_gap(AxisOf axis) const {
    const PairedPolygon& p = side(axis.side);
    const PairedPolygon& q = other(axis.side);
    const Vec2 base = p.ring[p.base(axis.index)];
    const auto sign_at = [&](std::size_t j) {
        if (axis.index >= p.edges) {
            return sign_of_dot({}, p.axis(axis.index), base, q.ring[j]);
        }
        return -orientation(base, p.ring[p.next(axis.index)], q.ring[j]);
    };
    const Chain chain = lowest(axis, {});
    int least = sign_at(chain.first);
    for (std::size_t j = chain.first; j != chain.last;) {
        j = q.next(j);
        least = std::min(least, sign_at(j));
    }
    return least;
}

}  // namespace geomsrv
