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
// Exact contact is the one case that float64 data hardly ever represent: of two polygons that touch, rotated
// copies overlap or miss by a rounding error.  Therefore every yes/no question below - apart, approaching,
// parallel, same place - has a slack for the rounding of the *input*, see `Slacks` in polygon_window.hpp, and
// counts as contact where the slack cannot exclude it. The time and its bounds do not depend on it: they come
// from the given numbers taken literally, at twice the precision.
#include "geom/polygon_first_contact.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "geom/double_double.hpp"
#include "geom/exact_sign.hpp"
#include "geom/lanes.hpp"
#include "geom/polygon_marks.hpp"
#include "geom/polygon_motion.hpp"
#include "geom/polygon_window.hpp"
#include "geom/rounding.hpp"

namespace geomsrv {

namespace {

constexpr std::size_t kLanes = Lanes::kCount;
constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kLargest = std::numeric_limits<double>::max();
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

AxisNumbers<double> numbers(const PolygonPair& pair, AxisOf axis, const Motion& motion,
                            const Slacks& slacks) {
    const PairedPolygon& p = pair.side(axis.side);
    const std::size_t k = axis.index;
    return numbers<double>(p.dx[k], p.dy[k], p.gap[k], approach_of(axis.side), motion, slacks);
}

/// Whether the polygons as given are certainly in contact at that time: no axis can be open then.  (Slacks
/// for rounding of the input, which are not needed here, are more than what this comparison rounds.)
GEOMSRV_WIDE_CLONES bool are_in_contact(const PolygonPair& pair, double time) {
    LaneMask closed = Lanes(0.0) <= Lanes(0.0);
    for (const int i : {0, 1}) {
        const PairedPolygon& p = pair.side(i);
        for (std::size_t k = 0; k < p.axes; k += kLanes) {
            closed = closed & (Lanes::load(p.work[0] + k) <= Lanes(time) * Lanes::load(p.work[1] + k));
        }
    }
    return all(closed);
}

/// A time and proven bounds.
struct Timed {
    DoubleDouble nominal;
    double lower = 0.0;
    double upper = kInfinity;
};

/// When a gap > 0 closes.
Timed closing_time(const Enclosed& gap, const Enclosed& rate) {
    const double slowest = rate.value.hi - rate.error;
    const double fastest = rate.value.hi + rate.error;
    if (!(fastest > 0.0)) {
        return {{kInfinity, 0.0}, kInfinity, kInfinity};
    }
    Timed result;
    result.nominal = rate.value.hi > 0.0 ? quotient(gap.value, rate.value) : DoubleDouble{kInfinity, 0.0};
    const double relative = gap.error / gap.value.hi + rate.error / rate.value.hi;
    const bool digits_left = gap.value.hi > 0.0 && rate.value.hi > 0.0 && relative < kSmallShare;
    if (digits_left && result.nominal.hi < kInfinity) {
        const double error = result.nominal.hi * (kSecondOrderOfTime * relative + kQuotientError);
        result.lower = next_down(result.nominal.hi + (result.nominal.lo - error));
        result.upper = next_up(result.nominal.hi + (result.nominal.lo + error));
        return result;
    }
    // The last digits of gap or rate are lost: sums and quotient rounded outwards.
    const double least = next_down(gap.value.hi - gap.error);
    const double most = next_up(gap.value.hi + gap.error);
    if (least > 0.0) {
        result.lower = next_down(next_down(least) / next_up(next_up(fastest)));
    }
    if (next_down(slowest) > 0.0) {
        result.upper = next_up(next_up(most) / next_down(next_down(slowest)));
    }
    return result;
}

/// The numbers of one axis taken literally, without slack for rounding of the input.
struct LiteralAxis {
    double gap, rate, gap_error, rate_error;

    [[nodiscard]] bool is_sharp() const {
        return gap_error < kSharpTime * std::fabs(gap) && rate_error < kSharpTime * std::fabs(rate);
    }
};

LiteralAxis literal(const PolygonPair& pair, AxisOf axis, const Motion& motion, const Slacks& slacks) {
    const PairedPolygon& p = pair.side(axis.side);
    const Vec2 direction = p.axis(axis.index);
    const double along_x = direction.x * motion.velocity.x;
    const double along_y = direction.y * motion.velocity.y;
    return {p.gap[axis.index], approach_of(axis.side) * (along_x + along_y),
            slacks.gap_rounding * (std::fabs(direction.x) + std::fabs(direction.y)) + kPairUnderflow,
            kRateError * (std::fabs(along_x) + std::fabs(along_y)) + kPairUnderflow};
}

Enclosed enclosed_rate(AxisOf axis, const ExactVec2& direction, const Motion& motion) {
    Enclosed rate = enclosed_dot(direction, motion.exact);
    if (axis.side == 0) {
        rate.value = -rate.value;
    }
    return rate;
}

struct Entry {
    DoubleDouble time{-1.0, 0.0};
    double lower = 0.0;
    double upper = 0.0;
    AxisOf axis;
};

/// When contact along one axis begins; not if the axis' gap is closed, in exact arithmetic, from the start.
struct Closing {
    Timed time;
    bool open = true;
    bool sliding = false;  ///< within the slack it is closed and stays so
};

Closing closing_of(const PolygonPair& pair, AxisOf axis, const Motion& motion, const Slacks& slacks,
                   bool alone) {
    const LiteralAxis at = literal(pair, axis, motion, slacks);
    if (alone && at.is_sharp() && at.gap > 0.0 && at.rate > 0.0) {
        return {closing_time({{at.gap, 0.0}, at.gap_error}, {{at.rate, 0.0}, at.rate_error})};
    }
    // Near contact, or grazing, most digits of the gap or of the rate cancel.  Of several axes the one that
    // closes last has to be found: two nearly parallel edges meet the other polygon at almost the same time,
    // but in different places.
    const ExactVec2 direction = pair.exact_axis(axis);
    const std::size_t vertex = pair.lowest(axis);
    const Enclosed gap = pair.enclosed_gap(axis, direction, vertex);
    const bool open =
        std::fabs(gap.value.hi) > gap.error ? gap.value.hi > 0.0 : pair.sign_of_gap(axis, vertex) > 0;
    if (!open) {
        return {{}, false};
    }
    const AxisNumbers<double> slack = numbers(pair, axis, motion, slacks);
    const bool sliding = slack.gap <= slack.gap_slack && slack.rate <= slack.rate_slack;
    return {closing_time(gap, enclosed_rate(axis, direction, motion)), true, sliding};
}

/// The axis along which contact begins last, and when, for the given numbers as they are.
///
/// Axes along which the polygons slide within the slack do not set the time, but they do widen the upper
/// bound: in exact arithmetic contact may begin only when such a tiny gap closes.  The tip of a polygon with
/// area sets it only where all edges around it slide like that.
Entry latest_entry(const PolygonPair& pair, const Motion& motion, const Slacks& slacks,
                   std::span<const AxisOf> axes) {
    Entry entry;
    for (const bool redundant : {false, true}) {
        for (const AxisOf axis : axes) {
            if (pair.side(axis.side).is_redundant(axis.index) != redundant) {
                continue;
            }
            const Closing closing = closing_of(pair, axis, motion, slacks, axes.size() == 1);
            if (!closing.open) {
                continue;
            }
            const Timed& time = closing.time;
            entry.upper = std::max(entry.upper, redundant ? 0.0 : time.upper);
            if (closing.sliding || (redundant && !(entry.time.hi < time.lower))) {
                continue;
            }
            entry.lower = std::max(entry.lower, time.lower);
            if (entry.time < time.nominal) {
                entry.time = time.nominal;
                entry.axis = axis;
            }
        }
    }
    return entry;
}

/// When they part.
double earliest_exit(const PolygonPair& pair, const Motion& motion, const Slacks& slacks,
                     std::span<const AxisOf> axes) {
    // What rounding may leave between a tip and the edges beside it: two sharp times.
    constexpr double kSameTime = 4.0 * kSharpTime;
    double exit = kInfinity;
    for (const bool redundant : {false, true}) {
        for (const AxisOf axis : axes) {
            if (pair.side(axis.side).is_redundant(axis.index) != redundant) {
                continue;
            }
            const LiteralAxis at = literal(pair, axis, motion, slacks);
            double time = at.gap / at.rate;
            if (!at.is_sharp()) {
                const ExactVec2 direction = pair.exact_axis(axis);
                const Enclosed gap = pair.enclosed_gap(axis, direction, pair.lowest(axis));
                time = quotient(gap.value, enclosed_rate(axis, direction, motion).value).hi;
            }
            if (!redundant || time < (1.0 - kSameTime) * exit) {
                exit = std::min(exit, time);
            }
        }
    }
    return std::max(exit, 0.0);
}

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
    // The outermost of a chain: its ends, unless it runs there and back as in a segment or a sliver.
    const auto ends = [&](int side, Chain chain) {
        Mark least = mark(side, chain.first);
        Mark most = least;
        for (std::size_t vertex = chain.first; vertex != chain.last;) {
            vertex = pair.side(side).next(vertex);
            const Mark next = mark(side, vertex);
            if (next.place < least.place) {
                least = next;
            }
            if (next.place > most.place) {
                most = next;
            }
        }
        return std::pair{least, most};
    };
    const auto [own_low, own_high] = ends(axis.side, pair.highest(axis, slacks.heights()));
    const auto [other_low, other_high] =
        ends(1 - axis.side, pair.lowest(axis, pair.lowest(axis), slacks.heights()));
    const Mark low = own_low.place < other_low.place ? other_low : own_low;
    const Mark high = other_high.place < own_high.place ? other_high : own_high;

    // Ends closer than the slack are one point.  What noise does to the time, it does to the place by way of
    // the drift.
    const double size = std::fabs(along.x) + std::fabs(along.y);
    const AxisNumbers<double> at = numbers(pair, axis, motion, slacks);
    const double time_noise =
        moment > 0.0 ? (at.gap_slack + moment * at.rate_slack) / std::max(at.rate, 0.0) : 0.0;
    const double noise = 2.0 * slacks.gap_noise * size + std::fabs(drift) * time_noise;
    const double level =
        2.0 * slacks.gap_rounding * size + kPairUnderflow + std::min(noise, slacks.gap_limit * size);
    const bool segment = high.place - low.place > level;
    return axis.side == 0 ? ContactMarks{low, high, segment} : ContactMarks{high, low, segment};
}

/// Scaled times in seconds: a power of two, so only subnormal results are rounded.
struct Seconds {
    int exponent;

    [[nodiscard]] double nearest(double t) const { return exponent == 0 ? t : std::scalbn(t, exponent); }
    [[nodiscard]] double inverse(double t) const { return exponent == 0 ? t : std::scalbn(t, -exponent); }
    [[nodiscard]] double down(double t) const {
        const double time = nearest(t);
        return is_rounded(time, t) ? std::max(0.0, next_down(time)) : time;
    }
    [[nodiscard]] double up(double t) const {
        const double time = nearest(t);
        return is_rounded(time, t) ? next_up(time) : time;
    }

private:
    [[nodiscard]] bool is_rounded(double time, double t) const {
        return exponent != 0 && t != 0.0 && time < std::numeric_limits<double>::min();
    }
};

}  // namespace

FirstContactSolver::FirstContactSolver(std::size_t largest_a, std::size_t largest_b)
    : pair_(largest_a, largest_b),
      entries_(PolygonPair::most_axes(largest_a, largest_b)),
      exits_(PolygonPair::most_axes(largest_a, largest_b)) {}

FirstContact FirstContactSolver::solve(const MovingPolygon& a, const MovingPolygon& b, double t_max,
                                       bool contact_set) {
    constexpr FirstContact kNever{ContactStatus::never, kNaN, kNaN, kNaN, kNaN, {kNaN, kNaN}, {}};
    pair_.load(a.ring, b.ring);
    const Motion motion = relative_motion(a.velocity, b.velocity);
    const Slacks slacks(pair_, motion);
    const Window window = window_of(pair_, motion, slacks);
    FirstContact never = kNever;
    never.certain = true;
    if (window.never || window.enter > window.leave) {
        return never;
    }
    // Times are in units of scaled length over scaled speed.  One later than the largest double counts as
    // never.
    const Seconds seconds{motion.scale_exponent - pair_.scale_exponent()};
    if (!(seconds.nearest(window.enter) <= std::min(t_max, kLargest))) {
        never.certain = seconds.nearest(window.enter) > t_max;
        return never;
    }

    const Candidates candidates = candidates_of(pair_, window, entries_.data(), exits_.data());
    const Entry entry = latest_entry(pair_, motion, slacks, {entries_.data(), candidates.entries});
    const double exit = earliest_exit(pair_, motion, slacks, {exits_.data(), candidates.exits});

    FirstContact result{};
    double moment = 0.0;
    AxisOf axis = entry.axis;
    if (window.apart) {
        // Grazing within the slack may nominally begin after it ends, or after t_max.
        moment = std::min({entry.time.hi, window.leave, seconds.inverse(t_max)});
        if (!(moment < kInfinity)) {
            return kNever;
        }
        result.status = ContactStatus::will_touch;
        result.time = std::min(seconds.nearest(moment), t_max);
        result.time_lower = std::min(seconds.down(entry.lower), result.time);
    } else {
        result.status = window.deep ? ContactStatus::overlapping : ContactStatus::touching;
    }
    result.time_upper =
        std::max(std::min(seconds.up(std::min(entry.upper, window.leave)), t_max), result.time);
    result.last_time = std::max(std::min(seconds.nearest(exit), t_max), result.time);
    result.certain =
        window.apart
            ? are_in_contact(pair_, std::min(0.5 * (moment + exit), next_down(seconds.inverse(t_max))))
            : window.deep;
    result.normal = {kNaN, kNaN};
    if (result.status != ContactStatus::overlapping) {
        if (result.status == ContactStatus::touching) {
            axis = pair_.widest_gap();
        }
        const Vec2 outward_axis = pair_.side(axis.side).axis(axis.index);
        result.normal = unit(axis.side == 0 ? outward_axis : -outward_axis);
    }
    if (!contact_set) {
        return result;
    }
    if (window.deep) {
        result.points = overlap_.of(pair_, slacks.heights());
        if (!result.points.empty()) {
            return result;
        }
        axis = pair_.widest_gap();
    }
    const ContactMarks marks = contact_marks(pair_, motion, slacks, axis, moment);
    result.points =
        contact_points(pair_, motion, marks, {a.velocity, b.velocity}, moment, result.time, points_);
    return result;
}

FirstContact FirstContactSolver::solve(const MovingPolygon& a, const MovingPolygon& b, double t_max,
                                       bool contact_set, const PolygonMotion& known) {
    switch (known.verdict) {
        case PolygonMotion::Verdict::unclear:
            break;
        case PolygonMotion::Verdict::never:
            return {ContactStatus::never, kNaN, kNaN, kNaN, kNaN, {kNaN, kNaN}, {}, true};
        case PolygonMotion::Verdict::will_touch:
            points_[0] = known.point;
            return {ContactStatus::will_touch,
                    known.time,
                    known.time_lower,
                    known.time_upper,
                    std::min(known.last_time, t_max),
                    known.normal,
                    {points_.data(), contact_set ? 1U : 0U},
                    true};
        case PolygonMotion::Verdict::overlapping: {
            FirstContact result{ContactStatus::overlapping,       0.0,          0.0, 0.0,
                                std::min(known.last_time, t_max), {kNaN, kNaN}, {},  true};
            if (contact_set) {
                pair_.place(a.ring, b.ring);
                result.points = overlap_.of(pair_, Slacks(pair_, {}).heights());
            }
            if (!contact_set || !result.points.empty()) {
                return result;
            }
            break;
        }
    }
    return solve(a, b, t_max, contact_set);
}

}  // namespace geomsrv
