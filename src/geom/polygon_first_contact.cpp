// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
// Polygon b moves with the relative velocity w along a ray, which is clipped against the half planes of a -
// b:
//
//     axis:   gap - t rate <= 0     rate = speed at which the two projections approach
//
//     rate > 0: in contact along the axis from gap/rate on;  rate < 0: until gap/rate;  rate = 0: always or
//     never
//
// First contact is the latest entry, last contact the earliest exit.  (Book 7.7.3 keeps both ends of both
// intervals per axis; with one-sided axes one end is enough.)  Gap and rate stay separate numbers with
// separate errors; nothing is normalised before the outcome is known.
//
// Exact contact is the one case float64 data hardly ever represent: of two polygons that touch, rotated
// copies overlap or miss by a rounding error.  Therefore every yes/no question below - apart, approaching,
// parallel, same place - has a slack for the rounding of the *input*, see `Slacks`, and counts as contact
// where the slack cannot exclude it.  The time itself and its bounds do not depend on it: they come from the
// given numbers taken literally, in double-double.
#include "geom/polygon_first_contact.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "geom/exact_sign.hpp"
#include "geom/two_fold.hpp"
#include "geom/wide.hpp"

namespace geomsrv {

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kLargest = std::numeric_limits<double>::max();
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

// Rounding of the input, as a multiple of half an ulp of the largest coordinate: rotating and shifting a
// polygon moves a vertex by less than 7 (see kRingTolerance in polygon.hpp), rounded up.
constexpr double kInputNoise = 8.0 * kRoundoff;

// Likewise for velocities, which are only rotated: 3.42 * 1.42 < 5 half ulps of the larger component.
constexpr double kVelocityNoise = 5.0 * kRoundoff;

// No slack exceeds this part of the reach (or of the speed).  So separations, angles and overlaps that are
// larger are always told apart, however far from the origin or however short the edges: with tips a gap is at
// least half the distance, and 2^-42 + rounding stays below half of 2^-40 of the scene.
constexpr double kLargestSlack = 0x1p-42;

// Velocities are rescaled where they leave [2^-200, 2^200], so that products with edges stay in the range of
// double.
constexpr double kSmallestSpeed = 0x1p-200;
constexpr double kLargestSpeed = 0x1p200;

/// Relative motion of b, in units of its own.
struct Motion {
    Vec2 velocity;      ///< b's minus a's, times 2^scale_exponent
    TwoFoldVec2 exact;  ///< the same
    int scale_exponent = 0;
    double noise = 0.0;  ///< what rounding the given velocities may change
};

Motion relative_motion(Vec2 velocity_a, Vec2 velocity_b) {
    const auto largest = [](Vec2 v) { return std::max(std::fabs(v.x), std::fabs(v.y)); };
    double before = 1.0;
    double scale = 1.0;
    int exponent = 0;
    double speed = largest(velocity_b - velocity_a);
    if (!(speed <= kLargestSpeed) || (speed < kSmallestSpeed && speed > 0.0)) {
        if (std::isinf(speed)) {
            before = 0.25;
        }  // components of opposite signs may differ by more than a double holds
        speed = largest(before * velocity_b - before * velocity_a);
        exponent = std::clamp(-std::ilogb(speed), -1000, 1000);
        scale = std::scalbn(1.0, exponent);
        exponent += std::ilogb(before);
    }
    const TwoFoldVec2 exact = {
        scaled(scale, two_difference(before * velocity_b.x, before * velocity_a.x)),
        scaled(scale, two_difference(before * velocity_b.y, before * velocity_a.y)),
    };
    const double noise =
        kVelocityNoise * scale * (before * largest(velocity_a) + before * largest(velocity_b));
    return {{exact.x.hi, exact.y.hi}, exact, exponent, noise};
}

/// How far gaps and rates of an axis D may be off.
///
/// Rounding here: see kGapError and kSpeedError.  Rounding of the input moves every vertex by up to `noise`,
/// so a gap by 2 noise |D|; and it turns an edge by up to 2 noise / |D|, which moves what is a reach away by
/// 2 noise reach / |D|, times |D|.  A rate changes by the velocity's noise and by the same turn.  Cut at
/// kLargestSlack.
struct Slacks {
    double gap_rounding;
    double gap_noise;  ///< per |D|_1 + reach
    double gap_limit;  ///< per |D|_1
    double reach;
    double rate_noise;  ///< per |D|_1
    double turn_noise;  ///< absolute
    double rate_limit;  ///< per |D|_1

    Slacks(const PolygonPair& pair, const Motion& motion)
        : gap_rounding(pair.gap_error()),
          gap_noise(2.0 * kInputNoise * pair.magnitude()),
          gap_limit(kLargestSlack * pair.reach()),
          reach(pair.reach()),
          rate_noise(motion.noise),
          turn_noise(gap_noise * (std::fabs(motion.velocity.x) + std::fabs(motion.velocity.y))),
          rate_limit(kLargestSlack * std::max(std::fabs(motion.velocity.x), std::fabs(motion.velocity.y))) {}

    [[nodiscard]] Slack heights() const { return {gap_noise, gap_limit}; }
};

/// Gap, rate and their errors of one axis (Real = double) or of kLanes of them; `literal` for the given
/// numbers as they are, `gap_slack` and `rate_slack` with the rounding of the input.
template <class Real>
struct AxisNumbers {
    Real gap, rate, gap_error, rate_error, gap_slack, rate_slack;
};

/// `approach` is -1 for axes of a, +1 for axes of b.
template <class Real>
GEOMSRV_INLINE AxisNumbers<Real> numbers(const Real& dx, const Real& dy, const Real& gap, double approach,
                                         const Motion& motion, const Slacks& slacks) {
    const Real along_x = dx * (approach * motion.velocity.x);
    const Real along_y = dy * (approach * motion.velocity.y);
    const Real size = magnitude(dx) + magnitude(dy);
    const Real gap_error = slacks.gap_rounding * size + kPairUnderflow;
    const Real rate_error =
        (kSpeedError * kRoundoff) * (magnitude(along_x) + magnitude(along_y)) + kPairUnderflow;
    const Real gap_noise = slacks.gap_noise * (size + slacks.reach);
    const Real rate_noise = slacks.rate_noise * size + slacks.turn_noise;
    const Real gap_limit = slacks.gap_limit * size;
    const Real rate_limit = slacks.rate_limit * size;
    return {gap,
            along_x + along_y,
            gap_error,
            rate_error,
            gap_error + smaller(gap_noise, gap_limit),
            rate_error + smaller(rate_noise, rate_limit)};
}

constexpr double approach_of(int side) { return side == 0 ? -1.0 : 1.0; }

AxisNumbers<double> numbers(const PolygonPair& pair, AxisOf axis, const Motion& motion,
                            const Slacks& slacks) {
    const PairedPolygon& p = pair.side(axis.side);
    return numbers<double>(p.dx[axis.index], p.dy[axis.index], p.gap[axis.index], approach_of(axis.side),
                           motion, slacks);
}

/// What all axes together say, slacks included.
struct Window {
    double enter = 0.0;        ///< contact cannot begin earlier
    double leave = kInfinity;  ///< nor last longer
    bool apart = false;        ///< certainly apart along some axis now
    bool never = false;        ///< ... and not approaching along it
    bool deep = true;          ///< certainly overlapping along every axis now
};

GEOMSRV_WIDE_CLONES Window window_of(const PolygonPair& pair, const Motion& motion, const Slacks& slacks) {
    Lanes enter{};
    Lanes leave = Lanes{} + kInfinity;
    Mask apart{};
    Mask never{};
    Mask shallow{};
    for (const int i : {0, 1}) {
        const PairedPolygon& p = pair.side(i);
        for (std::size_t k = 0; k < p.axes; k += kLanes) {
            const auto [gap, rate, gap_error, rate_error, gap_slack, rate_slack] = numbers<Lanes>(
                load(p.dx + k), load(p.dy + k), load(p.gap + k), approach_of(i), motion, slacks);
            const Lanes open = gap - gap_slack;       // > 0: certainly apart
            const Lanes closing = rate + rate_slack;  // <= 0: certainly not approaching
            const Lanes time = open / closing;
            const Mask is_apart = open > 0.0;
            const Mask may_close = closing > 0.0;
            apart |= is_apart;
            never |= is_apart & ~may_close;
            enter = larger(enter, (is_apart & may_close) ? time : Lanes{});
            leave = smaller(leave, closing < 0.0 ? time : Lanes{} + kInfinity);
            // Padding has no axis and must not count as shallow.
            const Mask real = (load(p.dx + k) != 0.0) | (load(p.dy + k) != 0.0);
            shallow |= real & ~(gap + gap_slack < 0.0);
        }
    }
    return {largest(enter), smallest(leave), any(apart), any(never), !any(shallow)};
}

/// For the given numbers as they are, per axis: work[0] is the latest possible entry, work[1] the nominal
/// exit. Returns the earliest possible first contact; axes along which they slide within the slack have no
/// say in it.
GEOMSRV_WIDE_CLONES double literal_times(const PolygonPair& pair, const Motion& motion,
                                         const Slacks& slacks) {
    Lanes lower{};
    const Lanes never = Lanes{} + kInfinity;
    for (const int i : {0, 1}) {
        const PairedPolygon& p = pair.side(i);
        for (std::size_t k = 0; k < p.axes; k += kLanes) {
            const auto [gap, rate, gap_error, rate_error, gap_slack, rate_slack] = numbers<Lanes>(
                load(p.dx + k), load(p.dy + k), load(p.gap + k), approach_of(i), motion, slacks);
            const Lanes least = gap - gap_error;
            const Lanes fastest = rate + rate_error;
            const Mask sliding = (gap <= gap_slack) & (rate <= rate_slack);
            lower = larger(lower, ((least > 0.0) & (fastest > 0.0) & ~sliding) ? least / fastest : Lanes{});
            const Lanes most = gap + gap_error;
            const Lanes slowest = rate - rate_error;
            const Lanes late = slowest > 0.0 ? most / slowest : never;
            store(p.work[0] + k, most > 0.0 ? late : Lanes{});
            // Sliding within the slack does not end a contact.
            store(p.work[1] + k, rate + rate_slack < 0.0 ? gap / rate : never);
        }
    }
    return largest(lower);
}

/// A time and proven bounds.
struct Timed {
    TwoFold nominal;
    double lower = 0.0;
    double upper = kInfinity;
};

/// When a gap > 0 closes.
Timed closing_time(const Enclosed& gap, const Enclosed& rate) {
    Timed result;
    if (!(rate.value.hi + rate.error > 0.0)) {
        return {{kInfinity, 0.0}, kInfinity, kInfinity};
    }
    result.nominal = rate.value.hi > 0.0 ? gap.value / rate.value : TwoFold{kInfinity, 0.0};
    const double relative = gap.error / gap.value.hi + rate.error / rate.value.hi;
    // (1 + x) / (1 - y) - 1 < (x + y) (1 + 2^-18) below this; quotient and rounding of the bound are in the
    // last unit.
    constexpr double kSmallRelative = 0x1p-20;
    if (rate.value.hi > 0.0 && relative >= 0.0 && relative < kSmallRelative &&
        result.nominal.hi < kInfinity) {
        const double error = result.nominal.hi * ((1.0 + 0x1p-18) * relative + 20.0 * kTwoFoldRoundoff);
        result.lower = next_down(result.nominal.hi + (result.nominal.lo - error));
        result.upper = next_up(result.nominal.hi + (result.nominal.lo + error));
        return result;
    }
    const auto quotient_down = [](double a, double b) { return next_down(next_down(a) / next_up(b)); };
    const auto quotient_up = [](double a, double b) { return next_up(next_up(a) / next_down(b)); };
    const double least = gap.value.hi - gap.error;
    result.lower = least > 0.0 ? quotient_down(next_down(least), next_up(rate.value.hi + rate.error)) : 0.0;
    const double slowest = rate.value.hi - rate.error;
    result.upper =
        slowest > 0.0 ? quotient_up(next_up(gap.value.hi + gap.error), next_down(slowest)) : kInfinity;
    return result;
}

Enclosed enclosed_rate(const PolygonPair& pair, AxisOf axis, const Motion& motion) {
    Enclosed rate = enclosed_dot(pair.exact_axis(axis), motion.exact);
    if (axis.side == 0) {
        rate.value = -rate.value;
    }
    return rate;
}

struct Entry {
    TwoFold time{-1.0, 0.0};
    double lower = 0.0;
    double upper = 0.0;
    AxisOf axis;
};

/// The axis along which contact begins last, and when, for the given numbers as they are.
///
/// Axes along which the polygons slide within the slack do not set the time, but they do widen the upper
/// bound: in exact arithmetic contact may begin only when such a tiny gap closes.
Entry latest_entry(const PolygonPair& pair, const Motion& motion, const Slacks& slacks) {
    Entry entry;
    const double earliest = literal_times(pair, motion, slacks);
    for (const int side : {0, 1}) {
        const PairedPolygon& p = pair.side(side);
        for (std::size_t k = 0; k < p.axes; ++k) {
            if (!(p.work[0][k] >= earliest && p.work[0][k] > 0.0)) {
                continue;
            }
            const AxisOf axis{side, k};
            const Enclosed gap = pair.enclosed_gap(axis);
            const bool open = gap.value.hi > gap.error;
            if (!open && (-gap.value.hi > gap.error || pair.sign_of_gap(axis) <= 0)) {
                continue;
            }
            const Timed close = closing_time(gap, enclosed_rate(pair, axis, motion));
            const auto [g, rate, gap_error, rate_error, gap_slack, rate_slack] =
                numbers(pair, axis, motion, slacks);
            entry.upper = std::max(entry.upper, close.upper);
            if (g <= gap_slack && rate <= rate_slack) {
                continue;
            }
            entry.lower = std::max(entry.lower, close.lower);
            if ((close.nominal - entry.time).hi > 0.0) {
                entry.time = close.nominal;
                entry.axis = axis;
            }
        }
    }
    return entry;
}

/// When they part; `literal_times` has been called.
double earliest_exit(const PolygonPair& pair, const Motion& motion) {
    double exit = kInfinity;
    AxisOf axis;
    for (const int side : {0, 1}) {
        const PairedPolygon& p = pair.side(side);
        for (std::size_t k = 0; k < p.axes; ++k) {
            if (p.work[1][k] < exit) {
                exit = p.work[1][k];
                axis = {side, k};
            }
        }
    }
    if (!(exit < kInfinity)) {
        return kInfinity;
    }
    const TwoFold time = pair.enclosed_gap(axis).value / enclosed_rate(pair, axis, motion).value;
    return std::max(time.hi, 0.0);
}

/// A vertex and where it lies along the contact line.
struct Mark {
    int side;
    std::size_t vertex;
    double place;
};

/// Ends of the common part of two faces, in order counter-clockwise around a; not a segment: one point
/// between them.
struct ContactMarks {
    Mark low;
    Mark high;
    bool segment;
};

/// Contact at `moment` along an axis: the faces that meet there are known from it.
///
///      face of the other polygon          |------------------------|
///      own face                  |---------------------|                  ---> along
///                                        low          high
///
/// A face is an edge with its collinear neighbours, or a vertex.  The ends of the common part are always
/// vertices, of one polygon or of the other.
ContactMarks contact_marks(const PolygonPair& pair, const Motion& motion, const Slacks& slacks, AxisOf axis,
                           double moment) {
    const PairedPolygon& own = pair.side(axis.side);
    const Vec2 outward_axis = own.axis(axis.index);
    const Vec2 along = {-outward_axis.y, outward_axis.x};
    const double drift = dot(along, motion.velocity);
    const auto mark = [&](int side, std::size_t vertex) -> Mark {
        return {side, vertex, dot(along, pair.side(side).local(vertex)) + (side == 1 ? moment * drift : 0.0)};
    };
    // Ends in order along the line: the two edges of a segment lie on each other, so its chain may run either
    // way.
    const auto ends = [&](int side, Chain chain) {
        const Mark first = mark(side, chain.first);
        const Mark last = mark(side, chain.last);
        return first.place <= last.place ? std::pair{first, last} : std::pair{last, first};
    };
    const auto [own_low, own_high] = ends(axis.side, pair.highest(axis, slacks.heights()));
    const auto [other_low, other_high] = ends(1 - axis.side, pair.lowest(axis, slacks.heights()));
    const Mark low = own_low.place < other_low.place ? other_low : own_low;
    const Mark high = other_high.place < own_high.place ? other_high : own_high;

    // Ends closer than the slack are one point.  What noise does to the time, it does to the place by way of
    // the drift.
    const double size = std::fabs(along.x) + std::fabs(along.y);
    const AxisNumbers<double> at = numbers(pair, axis, motion, slacks);
    const double time_noise =
        moment > 0.0 ? (at.gap_slack + moment * at.rate_slack) / std::max(at.rate, 0.0) : 0.0;
    const double level =
        2.0 * slacks.gap_rounding * size + kPairUnderflow +
        std::min(2.0 * slacks.gap_noise * size + std::fabs(drift) * time_noise, slacks.gap_limit * size);
    const bool segment = high.place - low.place > level;
    return axis.side == 0 ? ContactMarks{low, high, segment} : ContactMarks{high, low, segment};
}

/// Whether a ring has an inner point further from its border than the slack.
bool has_interior(const PolygonPair& pair, int side, const Slacks& slacks) {
    const PairedPolygon& p = pair.side(side);
    if (p.edges < 3) {
        return false;
    }
    std::size_t longest = 0;
    const auto length = [&](std::size_t k) { return std::fabs(p.dx[k]) + std::fabs(p.dy[k]); };
    for (std::size_t k = 1; k < p.edges; ++k) {
        longest = length(k) > length(longest) ? k : longest;
    }
    double lowest = 0.0;
    for (std::size_t k = 0; k < p.edges; ++k) {
        lowest = std::min(lowest, dot(p.axis(longest), p.local(k)) - p.own[longest]);
    }
    const double size = length(longest);
    return -lowest >
           slacks.gap_rounding * size + std::min(slacks.gap_noise * 2.0 * size, slacks.gap_limit * size);
}

/// Unit vector, whatever the length of v; v is not zero.
Vec2 unit(Vec2 v) {
    const double largest_part = std::max(std::fabs(v.x), std::fabs(v.y));
    const Vec2 reduced{v.x / largest_part, v.y / largest_part};
    return (1.0 / norm(reduced)) * reduced;
}

/// Scaled times in seconds: a power of two, so only subnormal results are rounded.
struct Seconds {
    int exponent;

    [[nodiscard]] double nearest(double t) const { return exponent == 0 ? t : std::scalbn(t, exponent); }
    [[nodiscard]] double down(double t) const {
        return exponent == 0 ? t : std::max(0.0, next_down(nearest(t)));
    }
    [[nodiscard]] double up(double t) const { return exponent == 0 ? t : next_up(nearest(t)); }
    [[nodiscard]] double inverse(double t) const { return exponent == 0 ? t : std::scalbn(t, -exponent); }
};

}  // namespace

FirstContact FirstContactSolver::solve(const MovingPolygon& a, const MovingPolygon& b, double t_max,
                                       bool contact_set) {
    constexpr FirstContact kNever{ContactStatus::never, kNaN, kNaN, kNaN, kNaN, {kNaN, kNaN}, {}};
    pair_.load(a.ring, b.ring);
    const Motion motion = relative_motion(a.velocity, b.velocity);
    const Slacks slacks(pair_, motion);
    const Window window = window_of(pair_, motion, slacks);
    // Times below are in units of scaled length over scaled speed.  One later than the largest double counts
    // as never.
    const Seconds seconds{motion.scale_exponent - pair_.scale_exponent()};
    if (window.never || window.enter > window.leave) {
        return kNever;
    }
    if (!(seconds.nearest(window.enter) <= std::min(t_max, kLargest))) {
        return kNever;
    }

    const Entry entry = window.deep ? Entry{{}, 0.0, 0.0, {}} : latest_entry(pair_, motion, slacks);
    FirstContact result;
    double moment = 0.0;
    AxisOf axis;
    if (window.apart) {
        // Grazing within the slack may nominally begin after it ends, or after t_max.
        moment = std::min({entry.time.hi, window.leave, seconds.inverse(t_max)});
        if (!(moment < kInfinity)) {
            return kNever;
        }
        axis = entry.axis;
        result.status = ContactStatus::will_touch;
        result.time = std::min(seconds.nearest(moment), t_max);
        result.time_lower = std::min(seconds.down(entry.lower), result.time);
    } else {
        const bool solid = has_interior(pair_, 0, slacks) && has_interior(pair_, 1, slacks);
        axis = pair_.widest_gap();
        result.status = window.deep && solid ? ContactStatus::overlapping : ContactStatus::touching;
        result.time = 0.0;
        result.time_lower = 0.0;
    }
    const double latest = std::min(seconds.up(std::min(entry.upper, window.leave)), t_max);
    result.time_upper = std::max(latest, result.time);
    if (window.deep) {
        literal_times(pair_, motion, slacks);
    }
    result.last_time = std::max(std::min(seconds.nearest(earliest_exit(pair_, motion)), t_max), result.time);
    result.normal = {kNaN, kNaN};
    if (result.status != ContactStatus::overlapping) {
        const Vec2 outward_axis = pair_.side(axis.side).axis(axis.index);
        result.normal = unit(axis.side == 0 ? outward_axis : -outward_axis);
    }
    if (!contact_set) {
        return result;
    }
    if (window.deep) {
        result.points = overlap_.of(pair_, slacks.heights());
        return result;
    }
    const ContactMarks marks = contact_marks(pair_, motion, slacks, axis, moment);
    const auto moved = [&](const Mark& mark) {
        return pair_.side(mark.side).ring[mark.vertex] + result.time * (mark.side == 0 ? a : b).velocity;
    };
    const Vec2 low = moved(marks.low);
    const Vec2 high = moved(marks.high);
    points_.clear();
    if (marks.segment) {
        points_ = {low, high};
    } else if (marks.low.side == marks.high.side && marks.low.vertex == marks.high.vertex) {
        points_ = {low};
    } else {
        points_ = {0.5 * low + 0.5 * high};
    }
    result.points = points_;
    return result;
}

}  // namespace geomsrv
