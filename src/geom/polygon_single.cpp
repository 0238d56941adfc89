// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
// The same half planes and the same bounds as in polygon_pair.hpp and polygon_first_contact.cpp, with the
// unit roundoff of float.  Vertices and axes are exact differences of given numbers rounded once, so the
// count of roundings is the same; supports, gaps, rates and times are computed in float.
#include "geom/polygon_single.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "geom/lanes.hpp"
#include "geom/polygon_window.hpp"
#include "geom/rounding.hpp"

namespace geomsrv {

namespace {

constexpr std::size_t kLanes = FloatLanes::kCount;
constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

constexpr float kSingleRoundoff = 0x1p-24F;

// As kGapError and kRateError, with one unit more for the rounding to double before that to float.
constexpr float kSingleGapError = 15.0F;
constexpr float kSingleRateError = 7.0F * kSingleRoundoff;

// Below 2^-126 numbers are rounded to multiples of 2^-149; reaches and speeds are below 4, and no bound here
// counts more than 2^8 such roundings.
constexpr float kSingleUnderflow = 0x1p-139F;

// Relative error of gap/|D| once the gap is known to its gap_error: see kWidthError in polygon_distance.cpp.
constexpr float kSingleWidthError = 5.0F * kSingleRoundoff;

// Squares of axes that are shorter have lost bits.
constexpr float kShortestAxis = 0x1p-40F;

// A point of an edge, start + t (end - start), is off in each coordinate by the rounding of both ends (2), of
// the product (3) and of the sum (1), each of at most twice the reach; a vector by 3/2 of that.  Two points
// and their difference: 2 * 18 + 3, rounded up.
constexpr float kSinglePlaceError = 48.0F * kSingleRoundoff;

// A quotient, and its rounding to double and back, in terms of itself.
constexpr double kTimeError = 0x1p-22;
constexpr double kTimeUnderflow = 0x1p-148;

constexpr std::size_t padded(std::size_t count) { return (count + kLanes - 1) / kLanes * kLanes; }

struct Best {
    float value;
    std::size_t index;
};

/// The largest lane, and what belongs to it.
GEOMSRV_INLINE Best greatest(const FloatLanes& value, const FloatLanes& place) {
    Best best{value[0], static_cast<std::size_t>(place[0])};
    for (int i = 1; i < FloatLanes::kCount; ++i) {
        if (value[i] > best.value) {
            best = {value[i], static_cast<std::size_t>(place[i])};
        }
    }
    return best;
}

GEOMSRV_INLINE FloatLanes places_from(std::size_t first) {
    const FloatLanes::Vector count{0.0F, 1.0F, 2.0F, 3.0F, 4.0F, 5.0F, 6.0F, 7.0F};
    return FloatLanes(count) + FloatLanes(static_cast<float>(first));
}

GEOMSRV_WIDE_CLONES void round_places(const PairedPolygon& from, double scale, const SinglePolygon& to) {
    for (std::size_t i = 0; i < from.axes || i < from.ring.size(); ++i) {
        to.x[i] = static_cast<float>(scale * from.x[i]);
        to.y[i] = static_cast<float>(scale * from.y[i]);
        to.dx[i] = static_cast<float>(scale * from.dx[i]);
        to.dy[i] = static_cast<float>(scale * from.dy[i]);
    }
}

/// The lowest height of any vertex along each of a block of axes.
GEOMSRV_INLINE FloatLanes lowest_along(const SinglePolygon& q, const FloatLanes& dx, const FloatLanes& dy) {
    FloatLanes low = kInfinity;
    for (std::size_t j = 0; j < q.vertices; ++j) {
        low = lesser<FloatLanes>(dx * FloatLanes(q.x[j]) + dy * FloatLanes(q.y[j]), low);
    }
    return low;
}

GEOMSRV_WIDE_CLONES void project(const SinglePolygon& p, const SinglePolygon& q) {
    for (std::size_t k = 0; k < p.axes; k += kLanes) {
        const FloatLanes dx = FloatLanes::load(p.dx + k);
        const FloatLanes dy = FloatLanes::load(p.dy + k);
        const FloatLanes own = dx * FloatLanes::load(p.x + k) + dy * FloatLanes::load(p.y + k);
        (lowest_along(q, dx, dy) - own).store(p.gap + k);
    }
}

std::size_t lowest_vertex(const SinglePolygon& q, float dx, float dy) {
    std::size_t best = 0;
    float low = kInfinity;
    for (std::size_t j = 0; j < q.vertices; ++j) {
        const float height = dx * q.x[j] + dy * q.y[j];
        best = height < low ? j : best;
        low = std::min(height, low);
    }
    return best;
}

/// What all axes together say about polygons in motion.
struct SingleWindow {
    double enter = 0.0;    ///< contact cannot begin earlier,
    double entered = 0.0;  ///< and if there is one, not later
    double leaving = 0.0;  ///< and cannot end earlier,
    double leave = 0.0;    ///< nor later
    AxisOf entry;          ///< the axis of `enter`
    AxisOf exit;           ///< the axis of `leave`
    bool apart = false;    ///< certainly apart along some axis now
    bool parting = false;  ///< ... and certainly not approaching along it
    bool deep = false;     ///< certainly overlapping along every axis now
};

struct HalfWindow {
    Best enter, leave;  // of the latter, minus
    float entered, leaving;
    bool apart, parting, deep;
};

GEOMSRV_WIDE_CLONES HalfWindow half_window(const SinglePolygon& p, float velocity_x, float velocity_y,
                                           float gap_error, float underflow) {
    const FloatLanes zero = 0.0F;
    const FloatLanes never = kInfinity;
    FloatLanes enter = zero;
    FloatLanes enter_place = zero;
    FloatLanes leave = never;
    FloatLanes leave_place = zero;
    FloatLanes entered = zero;
    FloatLanes leaving = never;
    FloatLanes::Mask apart = never < zero;
    FloatLanes::Mask parting = apart;
    FloatLanes::Mask deep = ~apart;
    for (std::size_t k = 0; k < p.axes; k += kLanes) {
        const FloatLanes place = places_from(k);
        const FloatLanes dx = FloatLanes::load(p.dx + k);
        const FloatLanes dy = FloatLanes::load(p.dy + k);
        const FloatLanes::Mask is_axis = place < FloatLanes(static_cast<float>(p.axes));
        const FloatLanes gap = select(is_axis, FloatLanes::load(p.gap + k), FloatLanes(-1.0F));
        const FloatLanes along_x = dx * FloatLanes(velocity_x);
        const FloatLanes along_y = dy * FloatLanes(velocity_y);
        const FloatLanes rate = along_x + along_y;
        const FloatLanes gap_off =
            FloatLanes(gap_error) * (magnitude(dx) + magnitude(dy)) + FloatLanes(kSingleUnderflow);
        const FloatLanes rate_off = select(
            is_axis,
            FloatLanes(kSingleRateError) * (magnitude(along_x) + magnitude(along_y)) + FloatLanes(underflow),
            zero);
        const FloatLanes open = gap - gap_off;
        const FloatLanes most = gap + gap_off;
        const FloatLanes closing = rate + rate_off;
        const FloatLanes slowest = rate - rate_off;
        const FloatLanes first = open / closing;
        const FloatLanes last = most / slowest;
        const FloatLanes::Mask is_apart = zero < open;
        const FloatLanes::Mask may_close = zero < closing;
        apart = apart | is_apart;
        parting = parting | (is_apart & ~may_close);
        deep = deep & (most < zero);
        // The times at which an axis lets contact begin and end, at the earliest and at the latest.
        const FloatLanes begins = select(is_apart & may_close, first, zero);
        const FloatLanes ends = select(closing < zero, first, never);
        enter_place = select(enter < begins, place, enter_place);
        enter = greater<FloatLanes>(enter, begins);
        leave_place = select(ends < leave, place, leave_place);
        leave = lesser<FloatLanes>(leave, ends);
        entered =
            greater<FloatLanes>(entered, select(zero < most, select(zero < slowest, last, never), zero));
        leaving = lesser<FloatLanes>(leaving, select(slowest < zero, select(most < zero, last, zero), never));
    }
    const Best latest = greatest(leave * FloatLanes(-1.0F), leave_place);
    return {greatest(enter, enter_place),
            latest,
            greatest(entered, zero).value,
            -greatest(leaving * FloatLanes(-1.0F), zero).value,
            any(apart),
            any(parting),
            all(deep)};
}

double before(double time) {
    return std::max(
        0.0, std::min<double>(time, std::numeric_limits<float>::max()) * (1.0 - kTimeError) - kTimeUnderflow);
}
double after(double time) { return time * (1.0 + kTimeError) + kTimeUnderflow; }

SingleWindow window_of(const SinglePair& pair, float velocity_x, float velocity_y) {
    const float underflow = velocity_x != 0.0F || velocity_y != 0.0F ? kSingleUnderflow : 0.0F;
    const HalfWindow a = half_window(pair.side(0), -velocity_x, -velocity_y, pair.gap_error(), underflow);
    const HalfWindow b = half_window(pair.side(1), velocity_x, velocity_y, pair.gap_error(), underflow);
    const auto axis = [](const Best& of_a, const Best& of_b) {
        return of_b.value > of_a.value ? AxisOf{1, of_b.index} : AxisOf{0, of_a.index};
    };
    return {before(std::max(a.enter.value, b.enter.value)),
            after(std::max(a.entered, b.entered)),
            before(std::min(a.leaving, b.leaving)),
            after(-std::max(a.leave.value, b.leave.value)),
            axis(a.enter, b.enter),
            axis(a.leave, b.leave),
            a.apart || b.apart,
            a.parting || b.parting,
            a.deep && b.deep};
}

/// What all axes together say about polygons at rest.
struct SingleWidths {
    float lower = -kInfinity;    ///< the signed distance is not less
    float upper = -kInfinity;    ///< of polygons that overlap it is not more
    AxisOf widest, widest_edge;  ///< by what was computed, of all axes and of the edges
    float width = -kInfinity, edge_width = -kInfinity;
    bool deep = true;
};

GEOMSRV_WIDE_CLONES void add_widths(const SinglePolygon& p, int side, float gap_error, SingleWidths& out) {
    const FloatLanes zero = 0.0F;
    const FloatLanes nothing = -kInfinity;
    const FloatLanes edges = static_cast<float>(p.edges);
    const FloatLanes axes = static_cast<float>(p.axes);
    FloatLanes lower = nothing;
    FloatLanes upper = nothing;
    FloatLanes widest = nothing;
    FloatLanes widest_place = zero;
    FloatLanes edge = nothing;
    FloatLanes edge_place = zero;
    FloatLanes::Mask deep = zero <= zero;
    for (std::size_t k = 0; k < p.axes; k += kLanes) {
        const FloatLanes place = places_from(k);
        const FloatLanes dx = FloatLanes::load(p.dx + k);
        const FloatLanes dy = FloatLanes::load(p.dy + k);
        const FloatLanes gap = FloatLanes::load(p.gap + k);
        const FloatLanes off =
            FloatLanes(gap_error) * (magnitude(dx) + magnitude(dy)) + FloatLanes(kSingleUnderflow);
        const FloatLanes length = square_root(dx * dx + dy * dy);
        const FloatLanes::Mask is_axis = place < axes;
        const FloatLanes::Mask is_edge = place < edges;
        const FloatLanes::Mask is_long = FloatLanes(kShortestAxis) < length;
        const FloatLanes least = (gap - off) / length;
        const FloatLanes most = (gap + off) / length;
        const FloatLanes error = FloatLanes(kSingleWidthError);
        lower =
            greater<FloatLanes>(lower, select(is_axis & is_long, least - error * magnitude(least), nothing));
        const FloatLanes bound = select(is_long, most + error * magnitude(most), FloatLanes(kInfinity));
        upper = greater<FloatLanes>(upper, select(is_edge, bound, nothing));
        deep = deep & (~is_axis | (gap + off < zero));
        const FloatLanes width = select(is_axis & is_long, gap / length, nothing);
        widest_place = select(widest < width, place, widest_place);
        widest = greater<FloatLanes>(widest, width);
        const FloatLanes edge_width = select(is_edge, width, nothing);
        edge_place = select(edge < edge_width, place, edge_place);
        edge = greater<FloatLanes>(edge, edge_width);
    }
    out.lower = std::max(out.lower, greatest(lower, zero).value);
    out.upper = std::max(out.upper, greatest(upper, zero).value);
    const Best best = greatest(widest, widest_place);
    if (best.value > out.width) {
        out.width = best.value;
        out.widest = {side, best.index};
    }
    const Best best_edge = greatest(edge, edge_place);
    if (best_edge.value > out.edge_width) {
        out.edge_width = best_edge.value;
        out.widest_edge = {side, best_edge.index};
    }
    out.deep = out.deep && all(deep);
}

SingleWidths widths_of(const SinglePair& pair) {
    SingleWidths out;
    for (const int side : {0, 1}) {
        add_widths(pair.side(side), side, pair.gap_error(), out);
    }
    return out;
}

/// Unit vector in double, for the caller.
Vec2 outward_normal(const SinglePair& pair, AxisOf axis) {
    const SinglePolygon& p = pair.side(axis.side);
    const Vec2 outward = unit({p.dx[axis.index], p.dy[axis.index]});
    return axis.side == 0 ? outward : -outward;
}

struct Place {
    float x, y;
};

Place operator-(Place a, Place b) { return {a.x - b.x, a.y - b.y}; }
float dot(Place a, Place b) { return a.x * b.x + a.y * b.y; }
Place vertex_of(const SinglePolygon& p, std::size_t i) { return {p.x[i], p.y[i]}; }

/// The point of an edge that is nearest to v.
Place nearest_on(const SinglePolygon& p, std::size_t start, std::size_t end, Place v) {
    const Place from = vertex_of(p, start);
    const Place way = vertex_of(p, end) - from;
    const float square = dot(way, way);
    const float t = square > 0.0F ? std::clamp(dot(v - from, way) / square, 0.0F, 1.0F) : 0.0F;
    return {from.x + t * way.x, from.y + t * way.y};
}

struct Facing {
    Place own, other;
    float square = kInfinity;  ///< of their distance

    void take_nearer(Place p, Place q) {
        const Place way = q - p;
        if (dot(way, way) < square) {
            *this = {p, q, dot(way, way)};
        }
    }
};

/// Points that are nearest, if the axis is next to the direction of the distance: near its edge or tip, and
/// near the vertex of the other polygon that is lowest along it.
Facing facing_points(const SinglePair& pair, AxisOf axis) {
    const SinglePolygon& p = pair.side(axis.side);
    const SinglePolygon& q = pair.side(1 - axis.side);
    const PairedPolygon& own = pair.places().side(axis.side);
    const PairedPolygon& other = pair.places().other(axis.side);
    const std::size_t start = own.base(axis.index);
    const std::size_t end = axis.index < own.edges ? own.next(start) : start;
    const std::size_t vertex = lowest_vertex(q, p.dx[axis.index], p.dy[axis.index]);
    Facing found;
    const Place v = vertex_of(q, vertex);
    found.take_nearer(nearest_on(p, start, end, v), v);
    for (const std::size_t i : {start, end}) {
        const Place u = vertex_of(p, i);
        found.take_nearer(u, nearest_on(q, vertex, other.next(vertex), u));
        found.take_nearer(u, nearest_on(q, other.previous(vertex), vertex, u));
    }
    return found;
}

}  // namespace

SinglePair::SinglePair(std::size_t largest_a, std::size_t largest_b) : places_(largest_a, largest_b) {
    // Room for tips, and for whole blocks of lanes.
    const std::array<std::size_t, 2> lengths = {padded(largest_a + kLanes + 4),
                                                padded(largest_b + kLanes + 4)};
    storage_.resize(5 * (lengths[0] + lengths[1]));
    float* at = storage_.data();
    for (std::size_t i = 0; i < 2; ++i) {
        SinglePolygon& p = sides_[i];
        for (float** array : {&p.x, &p.y, &p.dx, &p.dy, &p.gap}) {
            *array = at;
            at += lengths[i];
        }
    }
}

void SinglePair::load(Ring a, Ring b) {
    places_.load_places(a, b);
    const double reach = places_.reach();
    const int down = reach > 0.0 ? -std::ilogb(reach) : 0;
    exponent_ = places_.scale_exponent() + down;
    reach_ = static_cast<float>(std::scalbn(reach, down)) * (1.0F + 2.0F * kSingleRoundoff);
    gap_error_ = kSingleGapError * kSingleRoundoff * reach_;
    for (const int i : {0, 1}) {
        const PairedPolygon& from = places_.side(i);
        SinglePolygon& to = sides_[static_cast<std::size_t>(i)];
        to.vertices = from.ring.size();
        to.edges = from.edges;
        to.axes = from.axes;
        round_places(from, std::scalbn(1.0, down), to);
        std::fill_n(to.dx + to.axes, kLanes - 1, 0.0F);
        std::fill_n(to.dy + to.axes, kLanes - 1, 0.0F);
    }
    project(sides_[0], sides_[1]);
    project(sides_[1], sides_[0]);
}

Vec2 SinglePair::given(float x, float y) const {
    const Vec2 origin = places_.side(0).ring[0];
    return {origin.x + std::scalbn(static_cast<double>(x), -exponent_),
            origin.y + std::scalbn(static_cast<double>(y), -exponent_)};
}

namespace {

/// A vertex and where it lies along the contact line.
struct Mark {
    int side;
    std::size_t vertex;
    float place;
};

/// The common part of the two faces that meet along an axis, as in polygon_first_contact.cpp: one or two
/// vertices, counter-clockwise around a.  What may be one point, up to rounding, is one.
struct ContactMarks {
    Mark low, high;
    bool segment;
};

ContactMarks contact_marks(const SinglePair& pair, AxisOf axis, Place velocity, float moment, float doubt) {
    const SinglePolygon& p = pair.side(axis.side);
    const SinglePolygon& q = pair.side(1 - axis.side);
    const PairedPolygon& own = pair.places().side(axis.side);
    const PairedPolygon& other = pair.places().other(axis.side);
    const Place outward{p.dx[axis.index], p.dy[axis.index]};
    const Place along{-outward.y, outward.x};
    const float drift = dot(along, velocity);
    const float size = std::fabs(outward.x) + std::fabs(outward.y);
    const float level = 2.0F * (pair.gap_error() * size + kSingleUnderflow);
    const auto mark = [&](int side, std::size_t vertex) -> Mark {
        const float moved = side == 1 ? moment * drift : 0.0F;
        return {side, vertex, dot(along, vertex_of(pair.side(side), vertex)) + moved};
    };
    const auto by_place = [](const Mark& m, const Mark& n) { return m.place < n.place; };
    const std::size_t base = own.base(axis.index);
    const auto [own_low, own_high] = std::minmax(
        {mark(axis.side, base), mark(axis.side, axis.index < own.edges ? own.next(base) : base)}, by_place);
    const std::size_t vertex = lowest_vertex(q, outward.x, outward.y);
    const float low = dot(outward, vertex_of(q, vertex));
    const auto beside = [&](std::size_t j) {
        return mark(1 - axis.side, dot(outward, vertex_of(q, j)) - low <= level ? j : vertex);
    };
    const auto [other_low, other_high] = std::minmax(
        {mark(1 - axis.side, vertex), beside(other.next(vertex)), beside(other.previous(vertex))}, by_place);
    const Mark begin = own_low.place < other_low.place ? other_low : own_low;
    const Mark end = other_high.place < own_high.place ? other_high : own_high;
    const bool segment = end.place - begin.place > level + std::fabs(drift) * doubt;
    return axis.side == 0 ? ContactMarks{begin, end, segment} : ContactMarks{end, begin, segment};
}

/// Times of a pair in seconds.
struct Seconds {
    int exponent;

    [[nodiscard]] double nearest(double t) const { return std::scalbn(t, exponent); }
    [[nodiscard]] double down(double t) const { return std::max(0.0, next_down(nearest(t))); }
    [[nodiscard]] double up(double t) const { return next_up(nearest(t)); }
};

}  // namespace

FirstContact SingleFirstContactSolver::solve(const MovingPolygon& a, const MovingPolygon& b, double t_max,
                                             bool contact_set) {
    constexpr FirstContact kNever{ContactStatus::never, kNaN, kNaN, kNaN, kNaN, {kNaN, kNaN}, {}, true};
    pair_.load(a.ring, b.ring);
    const Motion motion = relative_motion(a.velocity, b.velocity);
    const double speed = std::max(std::fabs(motion.velocity.x), std::fabs(motion.velocity.y));
    const int down = speed > 0.0 ? -std::ilogb(speed) : 0;
    const Place velocity{static_cast<float>(std::scalbn(motion.velocity.x, down)),
                         static_cast<float>(std::scalbn(motion.velocity.y, down))};
    const Seconds seconds{motion.scale_exponent + down - pair_.exponent()};

    const SingleWindow window = window_of(pair_, velocity.x, velocity.y);
    const double lower = window.apart ? seconds.down(window.enter) : 0.0;
    if (window.parting || window.enter > window.leave || lower > t_max) {
        return kNever;
    }
    FirstContact result = kNever;
    const auto nominal = [&](AxisOf axis) {
        const SinglePolygon& p = pair_.side(axis.side);
        const float rate = p.dx[axis.index] * velocity.x + p.dy[axis.index] * velocity.y;
        return p.gap[axis.index] / (axis.side == 0 ? -rate : rate);
    };
    const double upper =
        window.apart ? std::min(seconds.up(std::min(window.entered, window.leave)), t_max) : 0.0;
    AxisOf axis = window.entry;
    float moment = 0.0F;
    if (window.apart) {
        const double time = nominal(axis);
        moment = static_cast<float>(
            std::clamp(std::isnan(time) ? 0.0 : time, window.enter, std::max(window.enter, window.entered)));
        result.status = ContactStatus::will_touch;
        result.certain = window.entered <= window.leaving && seconds.up(window.entered) <= t_max;
    } else {
        result.status = window.deep ? ContactStatus::overlapping : ContactStatus::touching;
        result.certain = window.deep;
    }
    result.time_lower = lower;
    result.time_upper = std::max(lower, upper);
    result.time = std::clamp(seconds.nearest(moment), result.time_lower, result.time_upper);
    const bool ends = window.leave < std::numeric_limits<double>::infinity();
    const double last = ends ? seconds.nearest(nominal(window.exit)) : t_max;
    result.last_time = std::max(std::isnan(last) ? 0.0 : std::min(last, t_max), result.time);
    if (result.status == ContactStatus::overlapping) {
        if (contact_set) {
            result.points = overlap_.of(pair_.in_double(a.ring, b.ring), {});
        }
        return result;
    }
    if (result.status == ContactStatus::touching) {
        axis = widths_of(pair_).widest;
    }
    result.normal = outward_normal(pair_, axis);
    if (contact_set) {
        const auto doubt = static_cast<float>(std::min(window.entered, window.leave) - window.enter);
        const ContactMarks marks = contact_marks(pair_, axis, velocity, moment, window.apart ? doubt : 0.0F);
        const auto moved = [&](const Mark& mark) {
            const MovingPolygon& owner = mark.side == 0 ? a : b;
            return pair_.places().side(mark.side).ring[mark.vertex] + result.time * owner.velocity;
        };
        const bool one_vertex = marks.low.side == marks.high.side && marks.low.vertex == marks.high.vertex;
        const Vec2 low = moved(marks.low);
        const Vec2 high = moved(marks.high);
        points_[0] = marks.segment || one_vertex ? low : 0.5 * low + 0.5 * high;
        points_[1] = high;
        result.points = {points_.data(), marks.segment ? 2U : 1U};
    }
    return result;
}

PolygonDistance SinglePolygonDistanceSolver::solve(Ring a, Ring b, bool penetration) {
    pair_.load(a, b);
    const SingleWidths widths = widths_of(pair_);
    const bool apart = widths.lower > 0.0F;
    const AxisOf axis = apart ? widths.widest : widths.widest_edge;
    const Facing facing = facing_points(pair_, axis);
    const bool is_a = axis.side == 0;
    const Place at_a = is_a ? facing.own : facing.other;
    const Place at_b = is_a ? facing.other : facing.own;
    const float error = kSinglePlaceError * 2.0F * pair_.reach();
    const auto given = [this](double length) { return std::scalbn(length, -pair_.exponent()); };

    PolygonDistance out;
    out.meet = !apart;
    out.certain = apart || widths.deep;
    out.point_a = pair_.given(at_a.x, at_a.y);
    out.point_b = pair_.given(at_b.x, at_b.y);
    out.normal = outward_normal(pair_, axis);
    const float length = std::sqrt(facing.square);
    // No two points are nearer than the polygons.
    const double most = static_cast<double>(length) * (1.0 + 4.0 * kSingleRoundoff) + error;
    double value = widths.edge_width;
    double lower = widths.lower;
    double upper = widths.deep ? static_cast<double>(widths.upper) : most;
    if (apart) {
        const Place way = at_b - at_a;
        value = length;
        if (length > error) {
            // Along the line between the nearest points their gap is all of the distance.
            out.normal = unit({way.x, way.y});
            const SinglePolygon& p = pair_.side(0);
            const SinglePolygon& q = pair_.side(1);
            const float high = -dot({-way.x, -way.y}, vertex_of(p, lowest_vertex(p, -way.x, -way.y)));
            const float low = dot(way, vertex_of(q, lowest_vertex(q, way.x, way.y)));
            lower = std::max(
                lower, static_cast<double>((low - high) / length) * (1.0 - 4.0 * kSingleRoundoff) - error);
        }
    } else if (!penetration) {
        value = 0.0;
        lower = 0.0;
        upper = widths.deep ? 0.0 : upper;
        out.point_b = out.point_a;
    }
    out.lower = next_down(given(lower));
    out.upper = next_up(given(upper));
    if (!apart && !penetration) {
        out.lower = 0.0;
        out.upper = widths.deep ? 0.0 : out.upper;
    }
    value = apart ? value : std::min(value, 0.0);
    out.distance = std::clamp(given(value), out.lower, out.upper);
    return out;
}

}  // namespace geomsrv
