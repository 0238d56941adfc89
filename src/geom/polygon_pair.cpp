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
constexpr std::size_t kLargestProduct = 1024;

constexpr std::size_t kLanes = Lanes::kCount;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

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

struct Placed {
    double reach = 0.0;     ///< largest |local coordinate|
    bool strict = false;    ///< every turn is certainly to the left
    bool has_tips = false;  ///< some turn exceeds 120 degrees
};

/// How given coordinates become local ones.  Plain ones take no factors, which costs half the time.
template <bool Scaled>
struct Units {
    double before = 1.0;
    double scale = 1.0;

    [[nodiscard]] GEOMSRV_INLINE Lanes difference(const Lanes& to, const Lanes& from) const {
        if constexpr (Scaled) {
            return Lanes(scale) * (Lanes(before) * to - Lanes(before) * from);
        }
        return to - from;
    }
};

/// Local vertices and outward normals of a ring.  One pass without branches: loops over so few vertices cost
/// as much by their unpredictable ends as by their work.
template <bool Scaled>
GEOMSRV_INLINE Placed place_ring(const PairedPolygon& p, Vec2 origin, Units<Scaled> units) {
    const std::size_t n = p.ring.size();
    Lanes reach = 0.0;
    LaneMask strict = Lanes(0.0) <= Lanes(0.0);
    LaneMask sharp = ~strict;
    for (std::size_t i = 0; i < n; i += kLanes) {
        const PointLanes v = load_points(p.around + i);
        const PointLanes next = load_points(p.around + i + 1);
        const PointLanes after = load_points(p.around + i + 2);
        const Lanes x = units.difference(v.x, origin.x);
        const Lanes y = units.difference(v.y, origin.y);
        reach = greater(reach, greater(magnitude(x), magnitude(y)));
        // The normals of two edges turn as the edges do.
        const Lanes dx = units.difference(next.y, v.y);
        const Lanes dy = units.difference(v.x, next.x);
        const Lanes next_dx = units.difference(after.y, next.y);
        const Lanes next_dy = units.difference(next.x, after.x);
        const Lanes left = dx * next_dy;
        const Lanes right = dy * next_dx;
        const Lanes bound =
            Lanes(kCrossError) * (magnitude(left) + magnitude(right)) + Lanes(kCrossUnderflow);
        strict = strict & (bound < left - right);
        // cos(turn) < -1/2, squared.
        const Lanes forward = dx * next_dx + dy * next_dy;
        const Lanes lengths = (dx * dx + dy * dy) * (next_dx * next_dx + next_dy * next_dy);
        sharp = sharp | ((forward < Lanes(0.0)) & (lengths < Lanes(4.0) * forward * forward));
        x.store(p.x + i);
        y.store(p.y + i);
        dx.store(p.dx + i);
        dy.store(p.dy + i);
    }
    return {greatest(reach), all(strict), any(sharp)};
}

GEOMSRV_WIDE_CLONES Placed place_plain(const PairedPolygon& p, Vec2 origin) {
    return place_ring(p, origin, Units<false>{});
}

Placed place_scaled(const PairedPolygon& p, Vec2 origin, Units<true> units) {
    return place_ring(p, origin, units);
}

/// The ring, going on past its end for as long as a block of lanes and two edges reach.
void copy_around(const PairedPolygon& p) {
    constexpr std::size_t kBeyond = kLanes + 1;
    const std::size_t n = p.ring.size();
    std::copy(p.ring.begin(), p.ring.end(), p.around);
    if (n >= kBeyond) {
        std::copy_n(p.ring.begin(), kBeyond, p.around + n);
    } else {
        for (std::size_t i = n; i < n + kBeyond; ++i) {
            p.around[i] = p.around[i - n];
        }
    }
}

/// Puts an axis that rests on a vertex behind the others.
void append_axis(PairedPolygon& p, Vec2 axis, std::size_t vertex) {
    p.tip[p.axes - p.edges] = vertex;
    p.x[p.axes] = p.x[vertex];
    p.y[p.axes] = p.y[vertex];
    p.dx[p.axes] = axis.x;
    p.dy[p.axes] = axis.y;
    ++p.axes;
}

/// Adds the tips; false if there are more than a convex ring can have.
bool append_tips(PairedPolygon& p) {
    // Two, or three by rounding if the ring is an equilateral triangle.
    constexpr std::size_t kMost = 3;
    const std::size_t n = p.edges;
    for (std::size_t i = 0; i < n; ++i) {
        // Normals turned by 90 degrees are the edges before and behind vertex i.
        const Vec2 before{-p.dy[p.previous(i)], p.dx[p.previous(i)]};
        const Vec2 behind{-p.dy[i], p.dx[i]};
        const double forward = dot(before, behind);
        const bool is_tip =
            forward < 0.0 && 4.0 * forward * forward > dot(before, before) * dot(behind, behind);
        if (n > 2 && !is_tip) {
            continue;
        }
        if (p.axes == n + kMost) {
            return false;
        }
        append_axis(p, unit(before) - unit(behind), i);
    }
    return true;
}

GEOMSRV_WIDE_CLONES void project_all_of_both(const PairedPolygon& a, const PairedPolygon& b) {
    project_all<double>(a, b);
    project_all<double>(b, a);
}

/// One of the vertices that are lowest, up to rounding.  Without branches: which is lowest cannot be
/// predicted.
GEOMSRV_WIDE_CLONES std::size_t lowest_vertex(const PairedPolygon& q, Vec2 axis) {
    const Lanes step = static_cast<double>(kLanes);
    const Lanes count = static_cast<double>(q.ring.size());
    Lanes place(Lanes::Vector{0.0, 1.0, 2.0, 3.0});
    Lanes low = kInfinity;
    Lanes best = 0.0;
    for (std::size_t j = 0; j < q.ring.size(); j += kLanes) {
        const Lanes height = Lanes(axis.x) * Lanes::load(q.x + j) + Lanes(axis.y) * Lanes::load(q.y + j);
        const LaneMask lower = (place < count) & (height < low);
        low = select(lower, height, low);
        best = select(lower, place, best);
        place = place + step;
    }
    const int left = low[1] < low[0] ? 1 : 0;
    const int right = low[3] < low[2] ? 3 : 2;
    return static_cast<std::size_t>(best[low[right] < low[left] ? right : left]);
}

/// Height gained along an axis by the edge that starts at a vertex of q.
double gain(Vec2 axis, const PairedPolygon& q, std::size_t vertex) { return -cross(axis, q.axis(vertex)); }

/// The same gaps, by walking round q once while the edges go round p.
void project_by_walking(const PairedPolygon& p, const PairedPolygon& q) {
    std::size_t j = lowest_vertex(q, p.axis(0));
    for (std::size_t k = 0; k < p.edges; ++k) {
        const Vec2 axis = p.axis(k);
        for (std::size_t steps = 0; steps < q.edges && gain(axis, q, j) < 0.0; ++steps) {
            j = q.next(j);
        }
        p.gap[k] = dot(axis, q.local(j)) - p.own(k);
    }
    for (std::size_t k = p.edges; k < p.axes; ++k) {
        p.gap[k] = dot(p.axis(k), q.local(lowest_vertex(q, p.axis(k)))) - p.own(k);
    }
}

/// The chain extended at both ends by vertices that are level with it.
Chain extend_level(const PairedPolygon& q, Vec2 axis, Chain chain, std::size_t length, Slack slack) {
    const double axis_length = std::fabs(axis.x) + std::fabs(axis.y);
    for (const bool forward : {true, false}) {
        double height = 0.0;
        double way = 0.0;
        double rounding = 0.0;
        for (; length < q.ring.size(); ++length) {
            const std::size_t edge = forward ? chain.last : q.previous(chain.first);
            const Vec2 normal = q.axis(edge);
            const double left = axis.x * normal.y;
            const double right = axis.y * normal.x;
            height += forward ? right - left : left - right;
            way += std::fabs(normal.x) + std::fabs(normal.y);
            rounding += kHeightError * (std::fabs(left) + std::fabs(right)) + kPairUnderflow;
            const double noise = std::min(slack.noise * (axis_length + way), slack.limit * axis_length);
            if (!(std::fabs(height) <= rounding + noise)) {
                break;
            }
            (forward ? chain.last : chain.first) = forward ? q.next(edge) : edge;
        }
    }
    return chain;
}

}  // namespace

PolygonPair::PolygonPair(std::size_t largest_a, std::size_t largest_b) {
    // Room for the ring to go on past its end, for tips, and for whole blocks of lanes, two at a time.
    const std::array<std::size_t, 2> lengths = {padded(largest_a + 3 * kLanes),
                                                padded(largest_b + 3 * kLanes)};
    constexpr std::size_t kArrays = 9;
    around_.resize(lengths[0] + lengths[1]);
    storage_.resize(kArrays * (lengths[0] + lengths[1]));
    Vec2* around = around_.data();
    double* at = storage_.data();
    for (std::size_t i = 0; i < 2; ++i) {
        PairedPolygon& p = sides_[i];
        p.around = around;
        around += lengths[i];
        for (double** array :
             {&p.x, &p.y, &p.dx, &p.dy, &p.gap, &p.work[0], &p.work[1], &p.work[2], &p.work[3]}) {
            *array = at;
            at += lengths[i];
        }
    }
}

void PolygonPair::load(Ring a, Ring b) {
    place(a, b);
    project();
}

void PolygonPair::place(Ring a, Ring b) {
    if (!try_place(a, b, false)) {
        try_place(hulls_[0].of(a), hulls_[1].of(b), true);
    }
    gap_error_ = kGapError * kUnitRoundoff * reach_;
}

bool PolygonPair::try_place(Ring a, Ring b, bool known_strict) {
    auto& [first, second] = sides_;
    first.ring = a;
    second.ring = b;
    first.vertices = a.size();
    second.vertices = b.size();
    const Vec2 origin = a[0];
    copy_around(first);
    copy_around(second);
    before_ = 1.0;
    scale_ = 1.0;
    scale_exponent_ = 0;
    std::array<Placed, 2> placed = {place_plain(first, origin), place_plain(second, origin)};
    reach_ = std::max(placed[0].reach, placed[1].reach);
    if (!(reach_ <= kLargestReach) || (reach_ < kSmallestReach && reach_ > 0.0)) {
        const auto place_again = [&] {
            const Units<true> units{before_, scale_};
            placed = {place_scaled(first, origin, units), place_scaled(second, origin, units)};
            reach_ = std::max(placed[0].reach, placed[1].reach);
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
    for (const std::size_t i : {0U, 1U}) {
        PairedPolygon& p = sides_[i];
        const std::size_t n = p.ring.size();
        p.edges = n > 1 ? n : 0;
        p.axes = p.edges;
        if (n > 2 && !placed[i].strict && !known_strict) {
            return false;
        }
        if (n == 2 && p.dx[0] == 0.0 && p.dy[0] == 0.0 && !known_strict) {
            return false;
        }
        if ((placed[i].has_tips || n == 2) && !append_tips(p)) {
            return false;
        }
    }
    if (first.edges == 0 && second.edges == 0) {
        // Two points: any two axes and their opposites.
        for (const Vec2 axis : {Vec2{1.0, 0.0}, Vec2{0.0, 1.0}, Vec2{-1.0, 0.0}, Vec2{0.0, -1.0}}) {
            append_axis(first, axis, 0);
        }
    }
    // Axes up to the next whole block have no length and, see project(), a gap of -1.
    for (const PairedPolygon& p : sides_) {
        std::fill_n(p.dx + p.axes, kLanes - 1, 0.0);
        std::fill_n(p.dy + p.axes, kLanes - 1, 0.0);
    }
    return true;
}

bool PolygonPair::walks() const {
    const auto& [a, b] = sides_;
    return a.edges > 2 && b.edges > 2 && a.edges * b.edges > kLargestProduct;
}

void PolygonPair::project() {
    const auto& [a, b] = sides_;
    if (walks()) {
        project_by_walking(a, b);
        project_by_walking(b, a);
        gap_error_ = (kGapError + kWalkError) * kUnitRoundoff * reach_;
    } else {
        project_all_of_both(a, b);
    }
    for (const PairedPolygon& p : sides_) {
        std::fill_n(p.gap + p.axes, kLanes - 1, -1.0);
    }
}

Vec2 PolygonPair::moved(Vec2 from, DoubleDouble x, DoubleDouble y) const {
    const auto at = [this](double start, DoubleDouble way) {
        const double scaled = scale_ * (before_ * start);
        // It overflows only where this coordinate is the same all over a pair that is far smaller.
        if (!std::isfinite(scaled)) {
            return start + std::scalbn(way.hi, -scale_exponent_);
        }
        const double end = (DoubleDouble{scaled, 0.0} + way).hi;
        return scale_exponent_ == 0 ? end : std::scalbn(end, -scale_exponent_);
    };
    return {at(from.x, x), at(from.y, y)};
}

int PolygonPair::sign_of_height(AxisOf axis, Vec2 from, Vec2 to) const {
    const PairedPolygon& p = side(axis.side);
    if (axis.index >= p.edges) {
        return sign_of_dot({}, p.axis(axis.index), from, to);
    }
    return -sign_of_cross(p.ring[axis.index], p.ring[p.next(axis.index)], from, to);
}

Level PolygonPair::lowest_level(AxisOf axis) const {
    const PairedPolygon& q = other(axis.side);
    Level found{lowest_vertex(q, side(axis.side).axis(axis.index)), q.ring.size()};
    // Rounding of coordinates may have chosen a neighbour, or in a row of tiny edges one further off.
    for (const bool forward : {true, false}) {
        for (std::size_t steps = 0; steps < q.edges; ++steps) {
            const std::size_t beside = forward ? q.next(found.vertex) : q.previous(found.vertex);
            const int sign = sign_of_height(axis, q.ring[found.vertex], q.ring[beside]);
            if (sign >= 0) {
                found.neighbour = sign == 0 ? beside : found.neighbour;
                break;
            }
            found = {beside, q.ring.size()};
        }
    }
    if (found.neighbour == q.ring.size()) {
        found.neighbour = found.vertex;
    }
    return found;
}

Chain PolygonPair::lowest(AxisOf axis, std::size_t vertex, Slack slack) const {
    return extend_level(other(axis.side), side(axis.side).axis(axis.index), {vertex, vertex}, 1, slack);
}

Chain PolygonPair::highest(AxisOf axis, Slack slack) const {
    const PairedPolygon& p = side(axis.side);
    const std::size_t base = p.base(axis.index);
    const bool edge = axis.index < p.edges;
    return extend_level(p, p.axis(axis.index), {base, edge ? p.next(base) : base}, edge ? 2 : 1, slack);
}

AxisOf PolygonPair::widest_gap() const {
    AxisOf best;
    double widest = -kInfinity;
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

Enclosed PolygonPair::enclosed_gap(AxisOf axis, const ExactVec2& direction, std::size_t vertex) const {
    const PairedPolygon& p = side(axis.side);
    return enclosed_dot(direction, difference(other(axis.side).ring[vertex], p.ring[p.base(axis.index)]));
}

int PolygonPair::sign_of_gap(AxisOf axis, std::size_t vertex) const {
    const PairedPolygon& p = side(axis.side);
    return sign_of_height(axis, p.ring[p.base(axis.index)], other(axis.side).ring[vertex]);
}

}  // namespace geomsrv
