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
// parallel, same place - has a slack for the rounding of the *input*, see `Slacks`, and counts as contact
// where the slack cannot exclude it. The time and its bounds do not depend on it: they come from the given
// numbers taken literally, at twice the precision.
#include "geom/polygon_first_contact.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <utility>

#include "geom/double_double.hpp"
#include "geom/exact_sign.hpp"
#include "geom/lanes.hpp"
#include "geom/rounding.hpp"

namespace geomsrv {

namespace {

constexpr std::size_t kLanes = Lanes::kCount;
constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kLargest = std::numeric_limits<double>::max();
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

// Rounding of the input, as a multiple of half an ulp of the largest coordinate: rotating and shifting a
// polygon moves a vertex by less than 7 (see kRingTolerance in polygon.hpp), rounded up.
constexpr double kInputNoise = 8.0 * kUnitRoundoff;

// Likewise for velocities, which are only rotated: 3.42 * 1.42 < 5 half ulps of the larger component.
constexpr double kVelocityNoise = 5.0 * kUnitRoundoff;

// No slack exceeds this part of the reach (or of the speed).  So separations, angles and overlaps that are
// larger are always told apart, however far from the origin and however short the edges: with tips a gap is
// at least half the distance, and 2^-42 + rounding stays below half of 2^-40 of the scene.
constexpr double kLargestSlack = 0x1p-42;

// Velocities are rescaled where they leave [2^-200, 2^200], so that products with edges stay in the range of
// double.
constexpr double kSmallestSpeed = 0x1p-200;
constexpr double kLargestSpeed = 0x1p200;

// Error of a rate D.w relative to |Dx wx| + |Dy wy|: edge, velocity, product, sum; the rest covers the bound.
constexpr double kRateError = 5.0 * kUnitRoundoff;

/// Motion of b relative to a, in units of its own.
struct Motion {
    Vec2 velocity;    ///< times 2^scale_exponent
    ExactVec2 exact;  ///< the same, unrounded
    int scale_exponent = 0;
    double noise = 0.0;  ///< what rounding of the given velocities may change

    /// A given velocity in these units.
    [[nodiscard]] Vec2 scaled(Vec2 v) const {
        return {std::scalbn(v.x, scale_exponent), std::scalbn(v.y, scale_exponent)};
    }
};

Motion relative_motion(Vec2 velocity_a, Vec2 velocity_b) {
    const auto largest = [](Vec2 v) { return std::max(std::fabs(v.x), std::fabs(v.y)); };
    double before = 1.0;
    double scale = 1.0;
    int exponent = 0;
    double speed = largest(velocity_b - velocity_a);
    if (!(speed <= kLargestSpeed) || (speed < kSmallestSpeed && speed > 0.0)) {
        // Components of opposite signs may differ by more than the largest double.
        if (std::isinf(speed)) {
            before = 0.25;
        }
        speed = largest(before * velocity_b - before * velocity_a);
        exponent = std::clamp(-std::ilogb(speed), -1000, 1000);
        scale = std::scalbn(1.0, exponent);
        exponent += std::ilogb(before);
    }
    const auto apart = [=](double to, double from) -> DoubleDouble {
        const DoubleDouble difference = two_sum(before * to, -(before * from));
        return {scale * difference.hi, scale * difference.lo};
    };
    const ExactVec2 exact = {apart(velocity_b.x, velocity_a.x), apart(velocity_b.y, velocity_a.y)};
    const double noise =
        kVelocityNoise * (scale * (before * largest(velocity_a) + before * largest(velocity_b)));
    return {{exact.x.hi, exact.y.hi}, exact, exponent, noise};
}

/// How far gaps and rates of an axis D may be off.
///
/// Rounding here: see kGapError and kRateError.  Rounding of the input moves every vertex by up to `noise`,
/// so a gap by 2 noise |D|; and it turns an edge by up to 2 noise / |D|, which moves what is a reach away by
/// 2 noise reach / |D|, times |D|.  A rate changes by the velocity's noise and by the same turn.  All cut at
/// kLargestSlack.
struct Slacks {
    double gap_rounding;  ///< per |D|_1
    double gap_noise;     ///< per |D|_1 + reach
    double gap_limit;     ///< per |D|_1
    double reach;
    double rate_noise;  ///< per |D|_1
    double turn_noise;
    double rate_limit;      ///< per |D|_1
    double rate_underflow;  ///< products with a velocity of zero are exact: at rest nothing approaches

    Slacks(const PolygonPair& pair, const Motion& motion)
        : gap_rounding(pair.gap_error()),
          gap_noise(2.0 * kInputNoise * pair.magnitude()),
          gap_limit(kLargestSlack * pair.reach()),
          reach(pair.reach()),
          rate_noise(motion.noise),
          turn_noise(gap_noise * (std::fabs(motion.velocity.x) + std::fabs(motion.velocity.y))),
          rate_limit(kLargestSlack * std::max(std::fabs(motion.velocity.x), std::fabs(motion.velocity.y))),
          rate_underflow(rate_limit > 0.0 ? kPairUnderflow : 0.0) {}

    [[nodiscard]] Slack heights() const { return {gap_noise, gap_limit}; }
};

/// Gap and rate of one axis (Real = double) or of several (Lanes), and how far off they may be.
template <class Real>
struct AxisNumbers {
    Real gap, rate, gap_slack, rate_slack;
};

/// `approach` is -1 for axes of a, +1 for axes of b.
template <class Real>
GEOMSRV_INLINE AxisNumbers<Real> numbers(const Real& dx, const Real& dy, const Real& gap, double approach,
                                         const Motion& motion, const Slacks& slacks) {
    const Real along_x = dx * Real(approach * motion.velocity.x);
    const Real along_y = dy * Real(approach * motion.velocity.y);
    const Real size = magnitude(dx) + magnitude(dy);
    const Real gap_noise =
        lesser<Real>(slacks.gap_noise * (size + Real(slacks.reach)), slacks.gap_limit * size);
    const Real rate_noise =
        lesser<Real>(slacks.rate_noise * size + Real(slacks.turn_noise), slacks.rate_limit * size);
    // Axes of no length fill up blocks of lanes: subnormal rates there would slow down the whole block.
    const Real none = 0.0;
    const Real rate_underflow = select(none < size, Real(slacks.rate_underflow), none);
    return {gap, along_x + along_y, slacks.gap_rounding * size + gap_noise + Real(kPairUnderflow),
            Real(kRateError) * (magnitude(along_x) + magnitude(along_y)) + rate_noise + rate_underflow};
}

constexpr double approach_of(int side) { return side == 0 ? -1.0 : 1.0; }

AxisNumbers<double> numbers(const PolygonPair& pair, AxisOf axis, const Motion& motion,
                            const Slacks& slacks) {
    const PairedPolygon& p = pair.side(axis.side);
    const std::size_t k = axis.index;
    return numbers<double>(p.dx[k], p.dy[k], p.gap[k], approach_of(axis.side), motion, slacks);
}

/// What all axes together say, slacks included.
struct Window {
    double enter;  ///< contact cannot begin earlier
    double leave;  ///< nor last longer
    bool apart;    ///< certainly apart along some axis now
    bool never;    ///< ... and certainly not approaching along it
    bool deep;     ///< certainly overlapping along every axis now
};

/// Leaves for every axis in work[0..2]: the largest gap and the least rate, whose quotient is the latest
/// entry or the earliest exit, and the largest rate.
GEOMSRV_WIDE_CLONES Window window_of(const PolygonPair& pair, const Motion& motion, const Slacks& slacks) {
    const Lanes zero = 0.0;
    const Lanes never = kInfinity;
    const LaneMask none = never < zero;
    Lanes enter = zero;
    Lanes leave = never;
    LaneMask apart = none;
    LaneMask parting = none;
    LaneMask deep = ~none;
    for (const int i : {0, 1}) {
        const PairedPolygon& p = pair.side(i);
        for (std::size_t k = 0; k < p.axes; k += kLanes) {
            const AxisNumbers<Lanes> at = numbers(Lanes::load(p.dx + k), Lanes::load(p.dy + k),
                                                  Lanes::load(p.gap + k), approach_of(i), motion, slacks);
            const Lanes open = at.gap - at.gap_slack;       // > 0: certainly apart
            const Lanes closing = at.rate + at.rate_slack;  // <= 0: certainly not approaching
            const Lanes most = at.gap + at.gap_slack;
            const Lanes time = open / closing;
            const LaneMask is_apart = zero < open;
            const LaneMask may_close = zero < closing;
            apart = apart | is_apart;
            parting = parting | (is_apart & ~may_close);
            deep = deep & (most < zero);
            enter = greater(enter, select(is_apart & may_close, time, zero));
            leave = lesser(leave, select(closing < zero, time, never));
            most.store(p.work[0] + k);
            (at.rate - at.rate_slack).store(p.work[1] + k);
            closing.store(p.work[2] + k);
        }
    }
    return {greatest(enter), least(leave), any(apart), any(parting), all(deep)};
}

// Candidates are kept as bits, 64 axes at a time: to branch on every block costs more than all of its
// arithmetic, as nobody can predict which block holds one.
struct CandidateBits {
    std::uint64_t entries = 0;
    std::uint64_t exits = 0;
};

/// Lane i of a block of axes as bit 4 block + i.
GEOMSRV_INLINE LaneMask bits_of_block(const LaneMask& set, std::size_t block) {
    static_assert(kLanes == 4);
    const LaneMask::Vector bits{1, 2, 4, 8};
    return set & LaneMask(bits << static_cast<std::int64_t>(kLanes * block));
}

GEOMSRV_INLINE std::uint64_t joined(const LaneMask& bits) {
    return static_cast<std::uint64_t>((bits.v[0] | bits.v[1]) | (bits.v[2] | bits.v[3]));
}

GEOMSRV_WIDE_CLONES CandidateBits candidate_bits(const PairedPolygon& p, std::size_t first, std::size_t end,
                                                 const Window& window) {
    const Lanes zero = 0.0;
    LaneMask entries = zero < zero;
    LaneMask exits = entries;
    for (std::size_t k = first, block = 0; k < end; k += kLanes, ++block) {
        const Lanes most = Lanes::load(p.work[0] + k);
        const Lanes slowest = Lanes::load(p.work[1] + k);
        const Lanes closing = Lanes::load(p.work[2] + k);
        // most / slowest >= enter if it approaches for certain; else it may begin at any time.
        const LaneMask begins = (zero < most) & (Lanes(window.enter) * slowest <= most);
        // most / slowest <= leave, both negative.  Sliding within the slack does not end a contact.
        const LaneMask ends = (closing < zero) & (Lanes(window.leave) * slowest <= most);
        entries = entries | bits_of_block(begins, block);
        exits = exits | bits_of_block(ends, block);
    }
    return {joined(entries), joined(exits)};
}

/// Whether the polygons as given are certainly in contact at that time: no axis can be open then.  (Slacks for
/// rounding of the input, which are not needed here, are more than what this comparison rounds.)
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

/// How many axes `candidates_of` has listed.
struct Candidates {
    std::size_t entries = 0;
    std::size_t exits = 0;
};

/// Axes that may set the first or the last contact, found without a division per axis: those along which
/// contact may begin no earlier than `window.enter`, and those along which it may end no later than
/// `window.leave`, which are the outermost bounds.  Mostly it is one axis each.
Candidates candidates_of(const PolygonPair& pair, const Window& window, AxisOf* entries, AxisOf* exits) {
    constexpr std::size_t kRow = 64;
    Candidates found;
    const auto list = [](std::uint64_t bits, int side, std::size_t first, AxisOf* axes, std::size_t count) {
        for (; bits != 0; bits &= bits - 1) {
            axes[count++] = {side, first + static_cast<std::size_t>(std::countr_zero(bits))};
        }
        return count;
    };
    for (const int i : {0, 1}) {
        const PairedPolygon& p = pair.side(i);
        for (std::size_t first = 0; first < p.axes; first += kRow) {
            const CandidateBits bits = candidate_bits(p, first, std::min(first + kRow, p.axes), window);
            found.entries = list(bits.entries, i, first, entries, found.entries);
            found.exits = list(bits.exits, i, first, exits, found.exits);
        }
    }
    return found;
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
    // For x, y below the first (1 + x) / (1 - y) - 1 < (x + y) (1 + 2^-19); the second is for rounding of the
    // bound too.
    constexpr double kSmallRelative = 0x1p-20;
    constexpr double kSecondOrder = 1.0 + 0x1p-18;
    const bool digits_left = gap.value.hi > 0.0 && rate.value.hi > 0.0 && relative < kSmallRelative;
    if (digits_left && result.nominal.hi < kInfinity) {
        const double error = result.nominal.hi * (kSecondOrder * relative + kQuotientError);
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

// A gap and a rate known to this relative error make a time that is good enough as it is, 2^-45: about 50
// times what rounding leaves of numbers in which nothing cancels.
constexpr double kSharp = 0x1p-46;

/// The numbers of one axis taken literally, without slack for rounding of the input.
struct LiteralAxis {
    double gap, rate, gap_error, rate_error;

    [[nodiscard]] bool is_sharp() const {
        return gap_error < kSharp * std::fabs(gap) && rate_error < kSharp * std::fabs(rate);
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
    constexpr double kSameTime = 4.0 * kSharp;
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
    result.certain = window.apart
                         ? are_in_contact(pair_, std::min(0.5 * (moment + exit),
                                                          next_down(seconds.inverse(t_max))))
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
    const auto moved = [&](const Mark& mark) {
        const Vec2 from = pair_.side(mark.side).ring[mark.vertex];
        const Vec2 velocity = (mark.side == 0 ? a : b).velocity;
        if (motion.scale_exponent == 0 && pair_.scale_exponent() == 0) {
            return from + result.time * velocity;
        }
        // The time in seconds may be subnormal, its product with a velocity beyond the doubles.
        const Vec2 way = moment * motion.scaled(velocity);
        return pair_.moved(from, {way.x, 0.0}, {way.y, 0.0});
    };
    const bool one_vertex = marks.low.side == marks.high.side && marks.low.vertex == marks.high.vertex;
    const Vec2 low = moved(marks.low);
    const Vec2 high = moved(marks.high);
    points_[0] = marks.segment || one_vertex ? low : 0.5 * low + 0.5 * high;
    points_[1] = high;
    result.points = {points_.data(), marks.segment ? 2U : 1U};
    return result;
}

}  // namespace geomsrv
