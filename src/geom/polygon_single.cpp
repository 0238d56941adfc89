// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
// The half planes of polygon_pair.hpp in float, eight axes at a time: their gaps, and from gaps the widths or
// the times of contact, each as an interval.  Whether polygons meet, when, and how far apart they are is read
// off these intervals.  Only what follows from the one axis that was found, the points of an answer, is in
// double.
//
// Vertices and axes are differences of given numbers, rounded to double and then to float; powers of two
// round nothing.  So roundings count as in polygon_pair.hpp, with u = 2^-24.
#include "geom/polygon_single.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <span>

#include "geom/lanes.hpp"
#include "geom/polygon_marks.hpp"
#include "geom/polygon_window.hpp"
#include "geom/power_of_two.hpp"
#include "geom/rounding.hpp"

namespace geomsrv {

namespace {

constexpr std::size_t kLanes = FloatLanes::kCount;

// All pairs of axis and vertex are projected up to this many: about where a walk takes as long.
constexpr std::size_t kLargestProduct = 8192;

constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

// Unit roundoff of float.
constexpr float kSingleRoundoff = 0x1p-24F;

// Error of a gap, relative to |D|_1 times the reach, in units of kSingleRoundoff: as kGapError, and one for
// the rounding to double before that to float.
constexpr float kSingleGapError = 15.0F;

// Added to it: what underflows in a gap of axes and lengths of about 1, and in a rate, is 2^-146 at most.  It
// is no subnormal number, which would be slow, nor does it make one of a quotient with a gap.
constexpr float kSingleUnderflow = 0x1p-120F;

// Error of a rate D.w relative to |Dx wx| + |Dy wy|: as kRateError, with one unit more likewise.
constexpr float kSingleRateError = 7.0F * kSingleRoundoff;

// Relative error of gap/|D| once the gap is known: axis 1, squares and their sum 2, halved by the root, root
// 1, quotient 1, the bound subtracted 1; the rest covers the bound.
constexpr float kSingleWidthError = 6.0F * kSingleRoundoff;

// A time is a quotient (1 unit of kSingleRoundoff), rounded again in double when it is moved outwards; below
// 2^-126 it is rounded to a multiple of 2^-149.
constexpr double kTimeError = 0x1p-22;
constexpr double kTimeUnderflow = 0x1p-148;
constexpr float kSmallestTime = 0x1p-126F;

// Error of the way from a point amid an edge, start + t edge, to another vertex: three differences, a product
// and a sum of numbers up to two reaches, in two coordinates; rounded up.  From vertex to vertex it is
// relative to its length: differences 1, squares and sum 2, halved by the root, root 1; the rest covers the
// bound.
constexpr double kFootError = 32.0 * kUnitRoundoff;
constexpr double kWayError = 8.0 * kUnitRoundoff;

// The axes of edges that are shorter count as unknown: below 2^-1022 they are not even known in double.
constexpr double kShortestKnown = 0x1p-960;

// An interval of a distance that is wider has not been found at the right places: rounding makes two gap
// errors and two width errors of numbers up to 2 sqrt(8), 2 (15 sqrt(8) + 6 * 2 sqrt(8)) units of
// kSingleRoundoff.
constexpr float kWideInterval = 256.0F * kSingleRoundoff;

// A place is beside an edge if it is farther from it than this, in units of its length: some ulps of float.
constexpr double kBeside = 0x1p-20;

// Shorter lengths are lost when squared.
constexpr double kShortestWay = 0x1p-400;

constexpr std::size_t padded(std::size_t count) { return (count + kLanes - 1) / kLanes * kLanes; }

/// The largest, in every lane.
GEOMSRV_INLINE FloatLanes spread_greatest(const FloatLanes& a) {
    const FloatLanes four = greater(a, FloatLanes(__builtin_shufflevector(a.v, a.v, 4, 5, 6, 7, 0, 1, 2, 3)));
    const FloatLanes two =
        greater(four, FloatLanes(__builtin_shufflevector(four.v, four.v, 2, 3, 0, 1, 6, 7, 4, 5)));
    return greater(two, FloatLanes(__builtin_shufflevector(two.v, two.v, 1, 0, 3, 2, 5, 4, 7, 6)));
}

GEOMSRV_INLINE float greatest(const FloatLanes& a) { return spread_greatest(a)[0]; }
GEOMSRV_INLINE float least(const FloatLanes& a) { return -greatest(-a); }

/// A number of the largest found so far, and of which axis it is.
struct Largest {
    FloatLanes value, place;

    GEOMSRV_INLINE explicit Largest(float start) : value(start), place(0.0F) {}
    GEOMSRV_INLINE void take(const FloatLanes& candidate, const FloatLanes& at) {
        place = select(value < candidate, at, place);
        value = greater(value, candidate);
    }
    /// The place of the greatest of all lanes.
    [[nodiscard]] GEOMSRV_INLINE float where() const {
        return greatest(select(value < spread_greatest(value), FloatLanes(0.0F), place));
    }
};

/// The axes of a block are counted from `first` on.
GEOMSRV_INLINE FloatLanes places_from(std::size_t first) {
    const FloatLanes::Vector count{0.0F, 1.0F, 2.0F, 3.0F, 4.0F, 5.0F, 6.0F, 7.0F};
    return FloatLanes(count) + FloatLanes(static_cast<float>(first));
}

/// The power of two that brings the length of (dx, dy) to between 1 and 3; 0 if it is not known.
GEOMSRV_INLINE Lanes inverse_size(const Lanes& dx, const Lanes& dy) {
    // Of exponent bits: 2^-e has those of 2^1023 twice, less those of 2^e.
    constexpr std::int64_t kExponent = 0x7ff0000000000000;
    constexpr std::int64_t kTwice = 0x7fe0000000000000;
    const Lanes size = greater(magnitude(dx), magnitude(dy));
    const Lanes inverse((Lanes::Vector)(kTwice - ((LaneMask::Vector)size.v & kExponent)));
    return select(Lanes(kShortestKnown) < size, inverse, Lanes(0.0));
}

/// Vertices times the scale, and axes, to float; and the gaps, if they are known.
GEOMSRV_INLINE void round_polygon(const PairedPolygon& from, double scale, bool with_gaps,
                                  const ProjectedPolygon<float>& to) {
    constexpr std::size_t kHalf = Lanes::kCount;
    const auto scaled = [&](const double* row, std::size_t i) __attribute__((always_inline)) {
        return joined(Lanes(scale) * Lanes::load(row + i), Lanes(scale) * Lanes::load(row + i + kHalf));
    };
    const FloatLanes axes = static_cast<float>(from.axes);
    const std::size_t end = std::max(from.vertices, from.axes);
    for (std::size_t i = 0; i < end; i += kLanes) {
        scaled(from.x, i).store(to.x + i);
        scaled(from.y, i).store(to.y + i);
        const Lanes dx = Lanes::load(from.dx + i), next_dx = Lanes::load(from.dx + i + kHalf);
        const Lanes dy = Lanes::load(from.dy + i), next_dy = Lanes::load(from.dy + i + kHalf);
        const Lanes unit = inverse_size(dx, dy), next_unit = inverse_size(next_dx, next_dy);
        const FloatLanes::Mask is_axis = places_from(i) < axes;
        select(is_axis, joined(unit * dx, next_unit * next_dx), FloatLanes(0.0F)).store(to.dx + i);
        select(is_axis, joined(unit * dy, next_unit * next_dy), FloatLanes(0.0F)).store(to.dy + i);
        if (with_gaps) {
            joined(unit * (Lanes(scale) * Lanes::load(from.gap + i)),
                   next_unit * (Lanes(scale) * Lanes::load(from.gap + i + kHalf)))
                .store(to.gap + i);
        }
    }
}

GEOMSRV_WIDE_CLONES void round_and_project(const PolygonPair& places, double scale, bool with_gaps,
                                           const std::array<ProjectedPolygon<float>, 2>& to) {
    for (const int i : {0, 1}) {
        round_polygon(places.side(i), scale, with_gaps, to[static_cast<std::size_t>(i)]);
    }
    if (!with_gaps) {
        project_all<float>(to[0], to[1]);
        project_all<float>(to[1], to[0]);
    }
}

/// Height of the lowest vertex along an axis, and which it is.
struct Lowest {
    float height;
    std::size_t vertex;
};

GEOMSRV_WIDE_CLONES Lowest lowest_vertex(const ProjectedPolygon<float>& q, float dx, float dy) {
    Largest depth(-kInfinity);
    const FloatLanes count = static_cast<float>(q.vertices);
    for (std::size_t j = 0; j < q.vertices; j += kLanes) {
        const FloatLanes place = places_from(j);
        const FloatLanes height =
            FloatLanes(dx) * FloatLanes::load(q.x + j) + FloatLanes(dy) * FloatLanes::load(q.y + j);
        depth.take(select(place < count, -height, FloatLanes(-kInfinity)), place);
    }
    return {-greatest(depth.value), std::min(static_cast<std::size_t>(depth.where()), q.vertices - 1)};
}

Lowest lowest_vertex(const SinglePair& pair, AxisOf axis) {
    const ProjectedPolygon<float>& p = pair.side(axis.side);
    return lowest_vertex(pair.side(1 - axis.side), p.dx[axis.index], p.dy[axis.index]);
}

// -------------------------------------------------------------------------------------------------- motion

/// What all axes together say about polygons in motion, in units of the float lengths and speeds.
///
/// Every axis has an interval of its gap and one of its rate; so it has bounds of when contact along it
/// begins, and of when it ends.
struct SingleWindow {
    float enter;    ///< contact cannot begin earlier,
    float entered;  ///< and if there is one at all, not later;
    float leave;    ///< it cannot end later,
    float leaving;  ///< and if it has begun along every axis, not earlier
    float entry;    ///< place of the axis of `enter`
    float exit;     ///< place of the axis of `leave`
    bool apart;     ///< certainly apart along some axis now
    bool parting;   ///< ... and certainly not approaching along it
    bool deep;      ///< certainly overlapping along every axis now
};

GEOMSRV_WIDE_CLONES SingleWindow window_of(const SinglePair& pair, float velocity_x, float velocity_y,
                                           float underflow) {
    const FloatLanes zero = 0.0F;
    const FloatLanes never = kInfinity;
    const FloatLanes soonest = kSmallestTime;
    Largest enter(0.0F);
    Largest leave_back(-kInfinity);  // minus the time
    FloatLanes entered = zero;
    FloatLanes leaving = never;
    FloatLanes::Mask apart = never < zero;
    FloatLanes::Mask parting = apart;
    FloatLanes::Mask deep = ~apart;
    std::size_t first = 0;
    for (const int i : {0, 1}) {
        const ProjectedPolygon<float>& p = pair.side(i);
        const float approach = i == 0 ? -1.0F : 1.0F;
        // Beyond the last axis D is 0; with a gap of -1 that is overlapping for ever.
        const FloatLanes axes = static_cast<float>(p.axes);
        for (std::size_t k = 0; k < p.axes; k += kLanes) {
            const FloatLanes dx = FloatLanes::load(p.dx + k);
            const FloatLanes dy = FloatLanes::load(p.dy + k);
            const FloatLanes gap =
                select(places_from(k) < axes, FloatLanes::load(p.gap + k), FloatLanes(-1.0F));
            const FloatLanes along_x = dx * FloatLanes(approach * velocity_x);
            const FloatLanes along_y = dy * FloatLanes(approach * velocity_y);
            const FloatLanes rate = along_x + along_y;
            const FloatLanes gap_off =
                FloatLanes(pair.gap_error()) * (magnitude(dx) + magnitude(dy)) + FloatLanes(pair.underflow());
            const FloatLanes rate_off =
                FloatLanes(kSingleRateError) * (magnitude(along_x) + magnitude(along_y)) +
                FloatLanes(underflow);
            const FloatLanes open = gap - gap_off;
            const FloatLanes most = gap + gap_off;
            const FloatLanes closing = rate + rate_off;
            const FloatLanes slowest = rate - rate_off;
            const FloatLanes least_time = open / closing;
            const FloatLanes most_time = most / slowest;
            const FloatLanes::Mask is_apart = zero < open;
            const FloatLanes::Mask may_be_apart = zero < most;
            const FloatLanes::Mask may_close = zero < closing;
            const FloatLanes::Mask closes = zero < slowest;
            const FloatLanes place = places_from(first + k);
            apart = apart | is_apart;
            parting = parting | (is_apart & ~may_close);
            deep = deep & (most < zero);
            enter.take(select(is_apart & may_close, least_time, zero), place);
            // An axis that never closes is closed already, if there is contact.
            const FloatLanes latest =
                select(closes, greater(most_time, soonest), select(may_close, never, zero));
            entered = greater(entered, select(may_be_apart, latest, zero));
            leave_back.take(select(closing < zero, -greater(least_time, soonest), -never), place);
            leaving = lesser(leaving, select(slowest < zero, select(most < zero, most_time, zero), never));
        }
        first += padded(p.axes);
    }
    return {greatest(enter.value),
            greatest(entered),
            -greatest(leave_back.value),
            least(leaving),
            enter.where(),
            leave_back.where(),
            any(apart),
            any(parting),
            all(deep)};
}

/// Moved outwards over the rounding of a quotient.
double before(double time) {
    constexpr double kLargest = std::numeric_limits<float>::max();
    return std::max(0.0, (1.0 - kTimeError) * std::min(time, kLargest) - kTimeUnderflow);
}
double after(double time) { return (1.0 + kTimeError) * time; }

/// Times of a pair in seconds, rounded outwards.
struct Seconds {
    PowerOfTwo unit;

    [[nodiscard]] double nearest(double t) const { return unit * t; }
    [[nodiscard]] double down(double t) const { return std::max(0.0, next_down(unit * t)); }
    [[nodiscard]] double up(double t) const { return t > 0.0 ? next_up(unit * t) : 0.0; }
};

/// Unit vector from a to b.
Vec2 outward_normal(const PolygonPair& pair, AxisOf axis) {
    const Vec2 outward = unit(pair.side(axis.side).axis(axis.index));
    return axis.side == 0 ? outward : -outward;
}

/// Heights along an axis, or places along its edge, that differ by less are the same to float.
double level_of(const PolygonPair& pair, Vec2 axis) {
    const double size = std::fabs(axis.x) + std::fabs(axis.y);
    return 2.0 * (kSingleGapError * kSingleRoundoff) * pair.reach() * size + kPairUnderflow;
}

/// Contact at `moment`, known to `doubt`, along an axis: see `contact_marks` in polygon_first_contact.cpp.
/// What is level, or one point, up to the rounding of float counts as such.
ContactMarks contact_marks(const SinglePair& single, AxisOf axis, Vec2 velocity, double moment,
                           double doubt) {
    const PolygonPair& pair = single.places();
    const PairedPolygon& own = pair.side(axis.side);
    const PairedPolygon& other = pair.other(axis.side);
    const Vec2 outward = own.axis(axis.index);
    const Vec2 along{-outward.y, outward.x};
    const double drift = dot(along, velocity);
    const double level = level_of(pair, outward);
    const auto mark = [&](int side, std::size_t vertex) -> Mark {
        return {side, vertex, dot(along, pair.side(side).local(vertex)) + (side == 1 ? moment * drift : 0.0)};
    };
    const auto by_place = [](const Mark& m, const Mark& n) { return m.place < n.place; };
    const std::size_t base = own.base(axis.index);
    const std::size_t end = axis.index < own.edges ? own.next(base) : base;
    const auto [own_low, own_high] = std::minmax({mark(axis.side, base), mark(axis.side, end)}, by_place);
    const std::size_t lowest = lowest_vertex(single, axis).vertex;
    const double low = dot(outward, other.local(lowest));
    const auto beside = [&](std::size_t j) {
        return mark(1 - axis.side, dot(outward, other.local(j)) - low <= level ? j : lowest);
    };
    const auto [other_low, other_high] = std::minmax(
        {mark(1 - axis.side, lowest), beside(other.next(lowest)), beside(other.previous(lowest))}, by_place);
    const Mark begin = own_low.place < other_low.place ? other_low : own_low;
    const Mark finish = other_high.place < own_high.place ? other_high : own_high;
    const double noise = drift == 0.0 ? 0.0 : std::fabs(drift) * doubt;
    const bool segment = finish.place - begin.place > level + noise;
    return axis.side == 0 ? ContactMarks{begin, finish, segment} : ContactMarks{finish, begin, segment};
}

// ------------------------------------------------------------------------------------------------- at rest

/// What all axes together say about polygons at rest.
struct SingleWidths {
    float lower;        ///< the signed distance is not less,
    float upper;        ///< and if the polygons certainly overlap, not more
    float edge_width;   ///< about the same, -infinity if there are no edges
    float widest;       ///< place of the axis with the largest width, up to rounding
    float widest_edge;  ///< likewise, of the edges only
    bool deep;          ///< certainly overlapping along every axis
};

GEOMSRV_WIDE_CLONES SingleWidths widths_of(const SinglePair& pair) {
    const FloatLanes zero = 0.0F;
    const FloatLanes nothing = -kInfinity;
    const FloatLanes width_error = kSingleWidthError;
    FloatLanes lower = nothing;
    FloatLanes upper = nothing;
    Largest widest(-kInfinity);
    Largest edge(-kInfinity);
    FloatLanes::Mask deep = zero <= zero;
    std::size_t first = 0;
    for (const int i : {0, 1}) {
        const ProjectedPolygon<float>& p = pair.side(i);
        const FloatLanes axes = static_cast<float>(p.axes);
        const FloatLanes edges = static_cast<float>(p.edges);
        for (std::size_t k = 0; k < p.axes; k += kLanes) {
            const FloatLanes dx = FloatLanes::load(p.dx + k);
            const FloatLanes dy = FloatLanes::load(p.dy + k);
            const FloatLanes gap = FloatLanes::load(p.gap + k);
            const FloatLanes off =
                FloatLanes(pair.gap_error()) * (magnitude(dx) + magnitude(dy)) + FloatLanes(pair.underflow());
            const FloatLanes length = square_root(dx * dx + dy * dy);
            const FloatLanes local = places_from(k);
            const FloatLanes place = places_from(first + k);
            // An unknown axis has no length: its width is anything.
            const FloatLanes::Mask is_axis = (local < axes) & (zero < length);
            const FloatLanes::Mask is_edge = local < edges;
            const FloatLanes least_width = (gap - off) / length;
            const FloatLanes most_width = (gap + off) / length;
            const FloatLanes below = least_width - width_error * magnitude(least_width);
            const FloatLanes above = most_width + width_error * magnitude(most_width);
            const FloatLanes width = gap / length;
            lower = greater(lower, select(is_axis, below, nothing));
            upper = greater(upper, select(is_edge, select(is_axis, above, -nothing), nothing));
            widest.take(select(is_axis, width, nothing), place);
            edge.take(select(is_axis & is_edge, width, nothing), place);
            deep = deep & (~(local < axes) | (gap + off < zero));
        }
        first += padded(p.axes);
    }
    return {greatest(lower), greatest(upper), greatest(edge.value), widest.where(), edge.where(), all(deep)};
}

/// The point of an edge that is nearest to a vertex.
struct Foot {
    double place;       ///< 0 to 1 along the edge
    Vec2 edge;          ///< all of it
    Vec2 way;           ///< from the point to the vertex
    bool amid = false;  ///< whether it is a point between the ends
};

Foot foot_of(const PolygonPair& pair, Vec2 start, Vec2 end, Vec2 vertex) {
    const Vec2 edge = pair.way(start, end);
    const Vec2 way = pair.way(start, vertex);
    const double square = dot(edge, edge);
    const double place = square > 0.0 ? dot(way, edge) / square : 0.0;
    if (!(place > 0.0)) {
        return {0.0, edge, way};
    }
    if (!(place < 1.0)) {
        return {1.0, edge, pair.way(end, vertex)};
    }
    return {place, edge, way - place * edge, true};
}

/// start + place * edge, in given coordinates.
Vec2 on_edge(const PolygonPair& pair, Vec2 start, Vec2 edge, double place) {
    return pair.moved(start, {place * edge.x, 0.0}, {place * edge.y, 0.0});
}

/// A point of either polygon, and the way from that of a to that of b.
struct Facing {
    std::array<Vec2, 2> points;
    Vec2 way;
    double square = std::numeric_limits<double>::infinity();
    bool amid = false;  ///< whether one of them is amid an edge

    [[nodiscard]] bool coincide() const {
        return !amid && points[0].x == points[1].x && points[0].y == points[1].y;
    }
    /// Length of the way.
    [[nodiscard]] double length() const {
        return std::max(std::fabs(way.x), std::fabs(way.y)) > kShortestWay ? std::sqrt(square)
                                                                           : std::hypot(way.x, way.y);
    }
    /// Takes the nearest points of an edge, of the polygon of that side, and a vertex of the other polygon,
    /// if they are nearer to each other.
    void consider(const PolygonPair& pair, int side, std::size_t start, std::size_t end, std::size_t vertex) {
        const Ring ring = pair.side(side).ring;
        const Vec2 v = pair.side(1 - side).ring[vertex];
        const Foot foot = foot_of(pair, ring[start], ring[end], v);
        const double candidate = dot(foot.way, foot.way);
        if (candidate < square) {
            const Vec2 at = foot.amid ? on_edge(pair, ring[start], foot.edge, foot.place)
                                      : ring[foot.place > 0.0 ? end : start];
            *this = side == 0 ? Facing{{at, v}, foot.way, candidate, foot.amid}
                              : Facing{{v, at}, -foot.way, candidate, foot.amid};
        }
    }
};

/// Points that are nearest, if the axis is next to the direction of the distance: near its edge or tip, and
/// near the vertex of the other polygon that is lowest along it.
Facing nearest_by_axis(const SinglePair& single, AxisOf axis) {
    const PolygonPair& pair = single.places();
    const PairedPolygon& own = pair.side(axis.side);
    const PairedPolygon& other = pair.other(axis.side);
    Facing found;
    const std::size_t start = own.base(axis.index);
    const std::size_t end = axis.index < own.edges ? own.next(start) : start;
    const std::size_t vertex = lowest_vertex(single, axis).vertex;
    found.consider(pair, axis.side, start, end, vertex);
    for (const std::size_t i : {start, end}) {
        found.consider(pair, 1 - axis.side, vertex, other.next(vertex), i);
        found.consider(pair, 1 - axis.side, other.previous(vertex), vertex, i);
    }
    return found;
}

/// Points that are nearest of all.
Facing nearest_of_all(const PolygonPair& pair) {
    Facing found;
    for (const int side : {0, 1}) {
        const PairedPolygon& p = pair.side(side);
        for (std::size_t i = 0; i < p.vertices; ++i) {
            for (std::size_t j = 0; j < pair.other(side).vertices; ++j) {
                found.consider(pair, side, i, p.next(i), j);
            }
        }
    }
    return found;
}

/// Points over each other of polygons that overlap, on the edge of the axis and on the other polygon near its
/// lowest vertex; false if there are none.
bool deepest_by_axis(const PolygonPair& pair, AxisOf axis, std::size_t lowest, std::array<Vec2, 2>& points) {
    const PairedPolygon& own = pair.side(axis.side);
    const PairedPolygon& other = pair.other(axis.side);
    const Vec2 start = own.ring[axis.index];
    const Vec2 edge = pair.way(start, own.ring[own.next(axis.index)]);
    const double square = dot(edge, edge);
    const auto place_of = [&](std::size_t j) { return dot(pair.way(start, other.ring[j]), edge) / square; };
    std::size_t vertex = lowest;
    double at = place_of(vertex);
    const double place = std::clamp(at, 0.0, 1.0);
    // A vertex beside the edge is the lowest only where, up to rounding, those on the way to the edge are,
    // too.
    std::size_t next = vertex;
    double share = 0.0;
    for (std::size_t steps = 0; std::fabs(at - place) > kBeside && steps < other.edges; ++steps) {
        next = at > place ? other.next(vertex) : other.previous(vertex);
        const double to = place_of(next);
        if ((to - place) * (at - place) <= 0.0) {
            share = (place - at) / (to - at);
            at = place;
        } else if (std::fabs(to - place) < std::fabs(at - place)) {
            vertex = next;
            at = to;
        } else {
            break;
        }
    }
    const Vec2 outward = own.axis(axis.index);
    const auto height = [&](std::size_t j) { return dot(outward, other.local(j)); };
    const double rise = height(vertex) + share * (height(next) - height(vertex)) - height(lowest);
    const Vec2 from = other.ring[vertex];
    const Vec2 foot = on_edge(pair, start, edge, place);
    const Vec2 opposite = share > 0.0 ? on_edge(pair, from, pair.way(from, other.ring[next]), share) : from;
    points = axis.side == 0 ? std::array{foot, opposite} : std::array{opposite, foot};
    return std::fabs(at - place) <= kBeside && rise <= level_of(pair, outward);
}

/// Likewise; if need be on another edge whose width is the largest up to the rounding of float.
std::array<Vec2, 2> deepest_points(const SinglePair& single, AxisOf& axis) {
    const PolygonPair& pair = single.places();
    std::array<Vec2, 2> points;
    const std::size_t lowest = lowest_vertex(single, axis).vertex;
    if (deepest_by_axis(pair, axis, lowest, points) || pair.walks()) {
        return points;
    }
    const auto width_of = [&](AxisOf at, std::size_t vertex) {
        const Vec2 outward = pair.side(at.side).axis(at.index);
        const double low = dot(outward, pair.other(at.side).local(vertex));
        return (low - pair.side(at.side).own(at.index)) / norm(outward);
    };
    const double widest = width_of(axis, lowest);
    const double level = level_of(pair, {1.0, 1.0});
    for (const int side : {0, 1}) {
        for (std::size_t k = 0; k < pair.side(side).edges; ++k) {
            const AxisOf other{side, k};
            const std::size_t vertex = lowest_vertex(single, other).vertex;
            std::array<Vec2, 2> found;
            if (width_of(other, vertex) >= widest - level && deepest_by_axis(pair, other, vertex, found)) {
                axis = other;
                return found;
            }
        }
    }
    return points;
}

/// Lower bound of the distance by the gap along a direction from a to b.
float gap_along(const SinglePair& pair, Vec2 direction) {
    const auto dx = static_cast<float>(direction.x);
    const auto dy = static_cast<float>(direction.y);
    const float high = -lowest_vertex(pair.side(0), -dx, -dy).height;
    const float low = lowest_vertex(pair.side(1), dx, dy).height;
    const float off = pair.gap_error() * (std::fabs(dx) + std::fabs(dy)) + pair.underflow();
    const float width = (low - high - off) / std::sqrt(dx * dx + dy * dy);
    return width - kSingleWidthError * std::fabs(width);
}

}  // namespace

SinglePair::SinglePair(std::size_t largest_a, std::size_t largest_b) : places_(largest_a, largest_b) {
    // Room for tips, and for a whole block beyond the last axis.
    const std::array<std::size_t, 2> lengths = {padded(largest_a + 2 * kLanes),
                                                padded(largest_b + 2 * kLanes)};
    constexpr std::size_t kArrays = 5;
    storage_.resize(kArrays * (lengths[0] + lengths[1]));
    float* at = storage_.data();
    for (std::size_t i = 0; i < 2; ++i) {
        ProjectedPolygon<float>& p = sides_[i];
        for (float** array : {&p.x, &p.y, &p.dx, &p.dy, &p.gap}) {
            *array = at;
            at += lengths[i];
        }
    }
}

void SinglePair::load(Ring a, Ring b) {
    places_.place(a, b);
    // Those of large polygons are found by walking, in double; rounded, they are as good as those of float.
    const bool walks = places_.walks() && places_.side(0).edges * places_.side(1).edges > kLargestProduct;
    if (walks) {
        places_.project();
    }
    const double reach = places_.reach();
    down_ = reach > 0.0 ? -exponent_of(reach) : 0;
    const double scale = PowerOfTwo(down_) * 1.0;
    // One unit more than the reach of what has been rounded.
    const float rounded_reach = static_cast<float>(scale * reach) * (1.0F + 4.0F * kSingleRoundoff);
    gap_error_ = kSingleGapError * kSingleRoundoff * rounded_reach;
    // Where all vertices are one point, every gap is exactly 0.
    underflow_ = reach > 0.0 ? kSingleUnderflow : 0.0F;
    for (const int i : {0, 1}) {
        const PairedPolygon& from = places_.side(i);
        ProjectedPolygon<float>& to = sides_[static_cast<std::size_t>(i)];
        to.vertices = from.vertices;
        to.edges = from.edges;
        to.axes = from.axes;
    }
    round_and_project(places_, scale, walks, sides_);
}

AxisOf SinglePair::axis(float place) const {
    // Of so many axes that float cannot count them it may be one beside it, which proves nothing wrong.
    const auto index = static_cast<std::size_t>(place);
    const std::size_t first = padded(sides_[0].axes);
    if (index < first || sides_[1].axes == 0) {
        return {0, std::min(index, sides_[0].axes - 1)};
    }
    return {1, std::min(index - first, sides_[1].axes - 1)};
}

FirstContact SingleFirstContactSolver::solve(const MovingPolygon& a, const MovingPolygon& b, double t_max,
                                             bool contact_set) {
    constexpr FirstContact kNever{ContactStatus::never, kNaN, kNaN, kNaN, kNaN, {kNaN, kNaN}, {}, true};
    pair_.load(a.ring, b.ring);
    const PolygonPair& places = pair_.places();
    const Motion motion = relative_motion(a.velocity, b.velocity);
    const double speed = std::max(std::fabs(motion.velocity.x), std::fabs(motion.velocity.y));
    const int down = speed > 0.0 ? -exponent_of(speed) : 0;
    const PowerOfTwo slower(down);
    const auto velocity_x = static_cast<float>(slower * motion.velocity.x);
    const auto velocity_y = static_cast<float>(slower * motion.velocity.y);
    const Seconds seconds{PowerOfTwo(motion.scale_exponent + down - pair_.exponent())};

    // At rest nothing approaches, not by an underflow either.
    const float underflow = speed > 0.0 ? kSingleUnderflow : 0.0F;
    const SingleWindow window = window_of(pair_, velocity_x, velocity_y, underflow);
    const double enter = window.apart ? before(window.enter) : 0.0;
    const double leave = after(window.leave);
    const double lower = seconds.down(enter);
    if (window.parting || enter > leave || lower > t_max) {
        return kNever;
    }
    const double entered = window.deep ? 0.0 : after(window.entered);
    const auto nominal = [&](AxisOf axis) {
        const ProjectedPolygon<float>& p = pair_.side(axis.side);
        const float rate = p.dx[axis.index] * velocity_x + p.dy[axis.index] * velocity_y;
        return static_cast<double>(p.gap[axis.index]) / static_cast<double>(axis.side == 0 ? -rate : rate);
    };
    FirstContact result = kNever;
    result.time_lower = lower;
    result.time_upper = std::max(lower, std::min(seconds.up(std::min(entered, leave)), t_max));
    AxisOf axis;
    double moment = 0.0;
    if (window.apart) {
        axis = pair_.axis(window.entry);
        // Where it is not certain that the axis closes, it may have no time.
        const double time = nominal(axis);
        moment = time > enter && time < std::numeric_limits<double>::infinity()
                     ? std::min({time, entered, leave})
                     : enter;
        result.status = ContactStatus::will_touch;
        // An axis that may be apart and may not approach has either no latest time, or `leaving` is 0.
        result.certain = entered <= before(window.leaving) && seconds.up(entered) <= t_max;
    } else {
        result.status = window.deep ? ContactStatus::overlapping : ContactStatus::touching;
        result.certain = window.deep;
    }
    result.time = std::clamp(seconds.nearest(moment), result.time_lower, result.time_upper);
    const bool ends = window.leave < kInfinity;
    const double last = ends ? seconds.nearest(nominal(pair_.axis(window.exit))) : t_max;
    result.last_time = std::max(std::isnan(last) ? 0.0 : std::min(last, t_max), result.time);
    if (result.status == ContactStatus::overlapping) {
        if (!contact_set) {
            return result;
        }
        result.points = overlap_.of(places, {});
        if (!result.points.empty()) {
            return result;
        }
    }
    if (!window.apart) {
        axis = pair_.axis(widths_of(pair_).widest);
    }
    if (!window.deep) {
        result.normal = outward_normal(places, axis);
    }
    if (!contact_set) {
        return result;
    }
    // From here on in the units of `places`.
    const PowerOfTwo back(down - pair_.down());
    const double doubt = window.apart ? back * (std::min(entered, leave) - enter) : 0.0;
    moment = back * moment;
    const ContactMarks marks = contact_marks(pair_, axis, motion.velocity, moment, doubt);
    result.points =
        contact_points(places, motion, marks, {a.velocity, b.velocity}, moment, result.time, points_);
    return result;
}

PolygonDistance SinglePolygonDistanceSolver::solve(Ring a, Ring b, bool penetration) {
    pair_.load(a, b);
    const PolygonPair& places = pair_.places();
    const SingleWidths widths = widths_of(pair_);
    // Lengths of float and of double in given units; a power of two rounds subnormal results only.
    const PowerOfTwo single_unit(-pair_.exponent());
    const PowerOfTwo unit_length(-places.scale_exponent());
    PolygonDistance out;
    if (widths.deep) {
        AxisOf axis = pair_.axis(widths.widest_edge);
        out.meet = true;
        out.normal = outward_normal(places, axis);
        if (penetration) {
            out.lower = next_down(single_unit * widths.lower);
            out.upper = std::min(next_up(single_unit * widths.upper), 0.0);
            out.distance = std::clamp(single_unit * widths.edge_width, out.lower, out.upper);
            const std::array<Vec2, 2> deepest = deepest_points(pair_, axis);
            out.point_a = deepest[0];
            out.point_b = deepest[1];
            out.normal = outward_normal(places, axis);
            return out;
        }
        const std::span<const Vec2> corners = overlap_.of(places, {});
        // The mean of its corners lies inside a convex set.  Only what is too small to find has none.
        Vec2 middle = corners.empty() ? deepest_points(pair_, axis)[0] : Vec2{};
        for (const Vec2 corner : corners) {
            middle = middle + (1.0 / static_cast<double>(corners.size())) * corner;
        }
        out.point_a = middle;
        out.point_b = middle;
        return out;
    }

    Facing nearest = nearest_by_axis(pair_, pair_.axis(widths.widest));
    // Between two vertices no axis has all of the distance.
    const auto lower_by = [&](const Facing& facing) {
        return facing.amid || facing.square == 0.0
                   ? widths.lower
                   : std::max(widths.lower, gap_along(pair_, unit(facing.way)));
    };
    float lower = lower_by(nearest);
    if (PowerOfTwo(pair_.down()) * nearest.length() > lower + kWideInterval && !places.walks()) {
        // Of axes that are nearly parallel float finds one, not always that of the distance.
        nearest = nearest_of_all(places);
        lower = std::max(lower, lower_by(nearest));
    }
    // No two points of the polygons are nearer to each other than these.
    const double length = nearest.length();
    const double error = nearest.amid ? kFootError * places.reach() : 0.0;
    const double most = nearest.coincide() ? 0.0 : (1.0 + kWayError) * length + (error + kPairUnderflow);
    out.point_a = nearest.points[0];
    out.point_b = nearest.points[1];
    out.upper = most > 0.0 ? next_up(unit_length * most) : 0.0;
    if (lower > 0.0F) {
        out.normal = unit(nearest.way);
        out.lower = std::max(0.0, next_down(single_unit * lower));
        out.distance = std::clamp(unit_length * length, out.lower, out.upper);
        return out;
    }
    const bool has_edges = widths.edge_width > -kInfinity;
    out.meet = true;
    out.certain = most == 0.0;
    out.normal = outward_normal(places, pair_.axis(has_edges ? widths.widest_edge : widths.widest));
    if (penetration) {
        out.lower = widths.lower < 0.0F ? next_down(single_unit * widths.lower) : 0.0;
        out.distance = has_edges ? std::clamp(single_unit * widths.edge_width, out.lower, 0.0) : 0.0;
    }
    return out;
}

}  // namespace geomsrv
