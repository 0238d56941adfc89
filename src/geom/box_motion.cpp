// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
// With d = b - a of the centers, w that of the velocities, edges a_i, b_j of about unit length and half
// extents e_i, f_j: along an axis m the bodies are in contact while |m . (d + t w)| <= r, where
// r = sum e_i |m . a_i| + sum f_j |m . b_j|.  The axes are the products of two of the six edges: their slabs
// make up the difference of the boxes, flat ones included (a flat box is a limit of boxes with the same
// edges).  Contact is from the latest entry on until the earliest exit.
#include "geom/box_motion.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "geom/contact_points.hpp"
#include "geom/core.hpp"
#include "geom/double_double.hpp"
#include "geom/exact_body.hpp"
#include "geom/lanes.hpp"
#include "geom/moving_pair.hpp"
#include "geom/rounding.hpp"

namespace geomsrv {

namespace {

using Four = VectorOf<Lanes>;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

// Edges are perpendicular unit vectors but for 1e-2 in each of their products: they are no longer than 1.005,
// and so is r, in terms of the half extents, than 1.02.
constexpr double kStretch = 1.02;

// Errors along an axis, in terms of u times |d| + sum e_i + sum f_j.  P is the product of two vectors with
// magnitudes for terms: |P| <= sqrt(2) times their lengths, and 1.25 if they are edges of one box, because
// then the magnitudes of the three parts of their scalar product make at most 1, half of each sign.
//
//   m = a_i x a_j    2 P
//   m . d            2 + 1 (d) + 1 (product) + 2 (sums) = 6 of 1.25 |d|                            <= 7.5
//   b_j . (d x a_i)  1 (d) + 2 (P) + 1 (product) + 2 (sums) = 6 of sqrt(2) |d|                     <= 8.7
//   m . b_j          2 + 1 + 2 = 5 of 1.25, then times f_j and three sums: 6.4 + 4, of 1.02        <= 10.7
//   |m . d| - r      1 more of each                                                                <= 12
//
// One more for higher orders and for the rounding of the bound.  All 15 widths are made of numbers m . b_j
// and m . a_i of faces, because a_k . (a_i x b_j) = b_j . (a_k x a_i).
constexpr double kGapError = 13 * kUnitRoundoff;

// Likewise for the rate m . w, in terms of |w|: 8.7, rounded up.
constexpr double kRateError = 10 * kUnitRoundoff;

// A rate is clear if it is this many times its error, which then is a share y <= 1/5 of it, and
// 1 / (1 - y) <= 1 + 1.25 y.
constexpr double kClearRate = 5.0;
constexpr double kSecondOrder = 1.25;

// A time from a gap with a margin takes four more roundings; rounded up.
constexpr double kTimeError = 8 * kUnitRoundoff;

// Edges a_i, b_j are parallel if b_j has no larger share than this of the other two edges of a, found to 7 u
// each.  Then the axis that they make is worth nothing, and b_j is taken for its share along a_i, which is
// off by y = 1.05 times both shares.  That moves the boxes by y f_j against each other, and it turns the
// axes that b_j makes by 1.01 y.  While the boxes are in contact along the axes of a, |d + t w| <= S, where
// S = sum e_i + sum f_j, up to 1.05, so turning changes m . (d + t w) and r by 1.06 y S each: 3.3 y S covers
// all three.  Contact cannot begin later, nor end sooner, than for those other boxes with their slabs
// narrower by that (if a convex body and a ball hold another body, the first holds what is left of the other
// if it is made narrower by the ball).  Where the edges are the same but for their sign nothing of this
// counts.
constexpr double kParallel = 64 * kUnitRoundoff;
constexpr double kShareError = 7 * kUnitRoundoff;
constexpr double kParallelError = 3.3 * 1.05;

// As polytope_first_contact.cpp has it for casts.  It keeps rates above 0.03 |w|, too, which is more than
// what sliding within the slack is.
constexpr double kSharp = 0x1p-44;
constexpr double kLeastMargin = 256 * kUnitRoundoff;

// In double-double a gap and a rate are off by 14 of its roundings, of terms that are at most sqrt(2) times
// as large as kGapError has them.
constexpr double kWideGapError = 32 * kWideRoundoff;

// With less than this of a relative error, a quotient rounded to double is within an ulp of the time.
constexpr double kWideSharp = 0x1p-60;

// The balls around two boxes: radii (1 + 3e-2)^(1/2) |e|, and (x + y)^2 <= 2 (x^2 + y^2); the product d x w
// is off by 6 u |d| |w|, its length and the bounds by less than 10 u, which 2.08 for 2.06 and the rest cover.
constexpr double kBallSquare = 2.08;
constexpr double kBallError = 32 * kUnitRoundoff;

// No slack for contact points (ContactSlack) is larger, in terms of the reach: kLargestSlack and what rounds.
constexpr double kMostSlack = 2.0 * kLargestSlack;

struct LaneBoxes {
    Four center, velocity;
    Four edge[3];
    Lanes half[3];
};

GEOMSRV_INLINE Lanes gathered(const double* const (&row)[4], std::size_t k) {
    return Lanes(Lanes::Vector{row[0][k], row[1][k], row[2][k], row[3][k]});
}
GEOMSRV_INLINE Four gathered_vector(const double* const (&row)[4], std::size_t k) {
    return {gathered(row, k), gathered(row, k + 1), gathered(row, k + 2)};
}

/// Without edges.
GEOMSRV_INLINE void load_centers(const MovingBoxes& boxes, const std::size_t (&pair)[4], LaneBoxes& out) {
    const double* center[4];
    const double* half[4];
    const double* velocity[4];
    for (int k = 0; k < 4; ++k) {
        center[k] = boxes.center + 3 * boxes.step * pair[k];
        half[k] = boxes.half + 3 * boxes.step * pair[k];
        velocity[k] = boxes.velocity + 3 * boxes.velocity_step * pair[k];
    }
    out.center = gathered_vector(center, 0);
    out.velocity = gathered_vector(velocity, 0);
    for (std::size_t i = 0; i < 3; ++i) out.half[i] = gathered(half, i);
}

GEOMSRV_INLINE void load_edges(const MovingBoxes& boxes, const std::size_t (&pair)[4], LaneBoxes& out) {
    const double* axes[4];
    for (int k = 0; k < 4; ++k) axes[k] = boxes.axes + 9 * boxes.step * pair[k];
    for (std::size_t i = 0; i < 3; ++i) out.edge[i] = gathered_vector(axes, 3 * i);
}

GEOMSRV_INLINE Lanes largest_part(const Four& v) {
    return greater(greater(magnitude(v.x), magnitude(v.y)), magnitude(v.z));
}
GEOMSRV_INLINE LaneMask within(const Lanes& low, const Lanes& x, const Lanes& high) {
    return (low <= x) & (x <= high);
}

/// Sizes of a pair.
struct LanePair {
    Four d, w;
    Lanes distance, speed;
    Lanes size;   ///< |d| + sum e_i + sum f_j
    Lanes slack;  ///< at least MovingPair::noise()
    Lanes end;    ///< of the window; 0 if at rest to each other, since then nothing happens later
    LaneMask ordinary;
};

GEOMSRV_INLINE LanePair pair_of(const LaneBoxes& a, const LaneBoxes& b, double t_max) {
    LanePair out;
    out.d = b.center - a.center;
    out.w = b.velocity - a.velocity;
    out.distance = square_root(dot(out.d, out.d));
    const Lanes square = dot(out.w, out.w);
    out.speed = square_root(square);
    const Lanes sum_a = a.half[0] + a.half[1] + a.half[2];
    const Lanes sum_b = b.half[0] + b.half[1] + b.half[2];
    out.size = out.distance + (sum_a + sum_b);
    const Lanes largest =
        greater(largest_part(a.center), largest_part(b.center)) + Lanes(kStretch) * greater(sum_a, sum_b);
    out.slack = lesser(Lanes(kStretch * kMostNoise) * largest, Lanes(kStretch * kLargestSlack) * out.size);
    // Compared by parts: their squares might underflow.
    const Lanes fastest = largest_part(out.w);
    const LaneMask rests = fastest <= Lanes(0.0);
    out.end = select(rests, Lanes(0.0), Lanes(t_max));
    // Lengths and speeds are multiplied.
    out.ordinary = within(kSmallestReach, out.size, kLargestReach) &
                   (rests | within(kSmallestReach, fastest, kLargestReach));
    out.speed = select(rests, Lanes(1.0), out.speed);
    return out;
}

/// The balls around the boxes never come within the slack.
GEOMSRV_INLINE LaneMask balls_miss(const LanePair& pair, const LaneBoxes& a, const LaneBoxes& b) {
    const auto square = [](const Lanes(&e)[3]) __attribute__((always_inline)) {
        return e[0] * e[0] + e[1] * e[1] + e[2] * e[2];
    };
    const Lanes radius = square_root(Lanes(kBallSquare) * (square(a.half) + square(b.half))) + pair.slack +
                         Lanes(kBallError) * pair.size;
    const Four passing = cross(pair.d, pair.w);
    const Lanes least = radius * pair.speed;
    const LaneMask passes = least * least < dot(passing, passing);
    const LaneMask recedes = (Lanes(0.0) <= dot(pair.d, pair.w)) & (radius < pair.distance);
    const LaneMask late = radius + Lanes(1.0 + kTimeError) * (pair.speed * pair.end) < pair.distance;
    return pair.ordinary & (passes | recedes | late);
}

constexpr int kAxes = 15;

/// What the axes seen so far leave of the time of contact.
class Contact {
public:
    GEOMSRV_INLINE Contact(const LanePair& pair, const Lanes& parallel)
        : rate_error_(Lanes(kRateError) * pair.speed),
          margin_(Lanes(kGapError) * pair.size),
          wide_margin_(margin_ + parallel) {}

    /// s = m . d, c = m . w.  Not `Careful`, it is worth nothing where a rate is not clear.
    template <bool Careful>
    GEOMSRV_INLINE void add(int number, const Lanes& s, const Lanes& c, const Lanes& r) {
        const Lanes none = 0.0;
        const Lanes least = Lanes(kClearRate) * rate_error_;
        const Lanes toward = with_sign_of(c, -s);
        Lanes rate = magnitude(c);
        Lanes gap = toward - r;
        Lanes rest = toward + r;
        const LaneMask clear = least < rate;
        if constexpr (Careful) {
            // It is less than that where it is not clear, and the bodies may close either way.
            rate = greater(rate, least);
            gap = select(clear, gap, magnitude(s) - r);
            rest = select(clear, rest, r - magnitude(s));
        } else {
            clear_ = clear_ & clear;
        }
        const Lanes inverse = Lanes(1.0) / rate;
        const Lanes off = Lanes(kSecondOrder) * rate_error_ * inverse;
        Lanes latest = (gap + wide_margin_) * inverse * (Lanes(1.0) + off);
        const Lanes soonest = (rest - wide_margin_) * inverse * (Lanes(1.0) - off);
        if constexpr (Careful) {
            latest = select(clear, latest, select(gap + wide_margin_ <= none, none, kInfinity));
        }
        const Lanes that = static_cast<double>(number);
        enter_axis = select(enter_high < latest, that, enter_axis);
        enter_high = greater(enter_high, latest);
        // An axis that is not clear has no exit of which it could be said to be the earliest.
        const Lanes exit = Careful ? select(clear, soonest, Lanes(kInfinity)) : soonest;
        leave_axis = select(exit < earliest_, that, leave_axis);
        earliest_ = lesser(exit, earliest_);
        leave_low = Careful ? lesser(soonest, leave_low) : earliest_;
        gap_of[number] = gap;
        rest_of[number] = rest;
        rate_of[number] = rate;
        latest_of[number] = latest;
        soonest_of[number] = soonest;
    }

    Lanes enter_high = 0.0, leave_low = kInfinity;  ///< contact starts no later, and ends no sooner
    Lanes enter_axis = 0.0, leave_axis = 0.0;       ///< which say so
    Lanes gap_of[kAxes], rest_of[kAxes], rate_of[kAxes], latest_of[kAxes], soonest_of[kAxes];

    GEOMSRV_INLINE void forget() {
        enter_high = enter_axis = leave_axis = 0.0;
        leave_low = earliest_ = kInfinity;
    }
    [[nodiscard]] GEOMSRV_INLINE LaneMask clear() const { return clear_; }

    /// That axis in each lane.
    GEOMSRV_INLINE static Lanes picked(const Lanes (&of)[kAxes], const Lanes& axis) {
        return Lanes(Lanes::Vector{of[static_cast<int>(axis[0])][0], of[static_cast<int>(axis[1])][1],
                                   of[static_cast<int>(axis[2])][2], of[static_cast<int>(axis[3])][3]});
    }
    /// Contact starts no sooner and ends no later than an axis says, if its gap is off by `margin`.
    GEOMSRV_INLINE Lanes enter_low(const Lanes& gap, const Lanes& rate, const Lanes& margin) const {
        const Lanes low = (gap - margin) / rate;
        return greater(Lanes(0.0), low - low * (Lanes(kSecondOrder) * rate_error_ / rate));
    }
    GEOMSRV_INLINE Lanes leave_high(const Lanes& rest, const Lanes& rate, const Lanes& margin) const {
        const Lanes high = (rest + margin) / rate;
        const Lanes later = high + high * (Lanes(kSecondOrder) * rate_error_ / rate);
        return select(Lanes(kClearRate) * rate_error_ < rate, later, kInfinity);
    }
    [[nodiscard]] GEOMSRV_INLINE Lanes margin() const { return margin_; }
    [[nodiscard]] GEOMSRV_INLINE Lanes wide_margin() const { return wide_margin_; }
    /// Least overlap at the start.
    [[nodiscard]] GEOMSRV_INLINE Lanes depth() const {
        Lanes out = kInfinity;
        for (int k = 0; k < kAxes; ++k) out = lesser(out, lesser(-gap_of[k], rest_of[k]));
        return out;
    }

private:
    Lanes rate_error_, margin_, wide_margin_;
    Lanes earliest_ = kInfinity;
    LaneMask clear_ = Lanes(0.0) < Lanes(1.0);
};

/// Whether a = b or a = -b.
GEOMSRV_INLINE LaneMask same_line(const Four& a, const Four& b) {
    const Lanes none = 0.0;
    const Four sum = a + b;
    const Four difference = a - b;
    return (largest_part(sum) <= none) | (largest_part(difference) <= none);
}

constexpr int kNext[3] = {1, 2, 0};
constexpr int kLast[3] = {2, 0, 1};

/// A pair of which doubles know that it meets, but not well enough when.
struct Refinement {
    const Contact& contact;
    int lane;
    double size;
    double speed;
};

/// The gap along an axis and the rate at which it closes, in double-double.
struct WideGap {
    DoubleDouble gap, rest, rate;
};

/// The edges whose product an axis is.
struct AxisEdges {
    Vec3 first, second;
    double half[2];
    int of_a[2], of_b[2];  ///< their numbers, or -1
};

GEOMSRV_INLINE AxisEdges edges_of(const MovingBoxes& a, const MovingBoxes& b, std::size_t pair, int axis) {
    const bool crossed = axis >= 6;
    const MovingBoxes& one = axis < 3 || crossed ? a : b;
    const MovingBoxes& other = crossed ? b : one;
    const auto i = static_cast<std::size_t>(crossed ? (axis - 6) / 3 : kNext[axis % 3]);
    const auto j = static_cast<std::size_t>(crossed ? (axis - 6) % 3 : kLast[axis % 3]);
    const double* const p = one.axes + 9 * one.step * pair + 3 * i;
    const double* const q = other.axes + 9 * other.step * pair + 3 * j;
    return {{p[0], p[1], p[2]},
            {q[0], q[1], q[2]},
            {one.half[3 * one.step * pair + i], other.half[3 * other.step * pair + j]},
            {axis < 3 || crossed ? static_cast<int>(i) : -1, axis < 3 ? static_cast<int>(j) : -1},
            {axis >= 3 ? static_cast<int>(j) : -1, axis >= 3 && !crossed ? static_cast<int>(i) : -1}};
}

WideGap wide_gap(const MovingBoxes& boxes_a, const MovingBoxes& boxes_b, std::size_t pair, int axis) {
    const auto vector = [](const double* row) { return Vec3{row[0], row[1], row[2]}; };
    const double* const edges_a = boxes_a.axes + 9 * boxes_a.step * pair;
    const double* const edges_b = boxes_b.axes + 9 * boxes_b.step * pair;
    const double* const half_a = boxes_a.half + 3 * boxes_a.step * pair;
    const double* const half_b = boxes_b.half + 3 * boxes_b.step * pair;
    const AxisEdges made_of = edges_of(boxes_a, boxes_b, pair, axis);
    const WideVec3 m = cross(widen(made_of.first), widen(made_of.second));
    const WideVec3 d = exact_difference(vector(boxes_b.center + 3 * boxes_b.step * pair),
                                        vector(boxes_a.center + 3 * boxes_a.step * pair));
    const WideVec3 w = exact_difference(vector(boxes_b.velocity + 3 * boxes_b.velocity_step * pair),
                                        vector(boxes_a.velocity + 3 * boxes_a.velocity_step * pair));
    DoubleDouble r;
    const auto widen_by = [&](const double* edges, const double* half, int without, int nor) {
        for (int k = 0; k < 3; ++k) {
            if (k == without || k == nor) continue;
            const DoubleDouble along = dot(m, vector(edges + 3 * k));
            r = r + (along.hi < 0.0 ? -along : along) * half[k];
        }
    };
    // Those that make the axis are across it.
    widen_by(edges_a, half_a, made_of.of_a[0], made_of.of_a[1]);
    widen_by(edges_b, half_b, made_of.of_b[0], made_of.of_b[1]);
    const DoubleDouble s = dot(m, d);
    const DoubleDouble c = dot(m, w);
    return c.hi < 0.0 ? WideGap{s - r, s + r, -c} : WideGap{-s - r, -s + r, c};
}

/// Rounded to nearest but for a hair; NaN where rounding may have done more.
double wide_time(DoubleDouble gap, DoubleDouble rate, const Refinement& axes) {
    const bool useful = gap.hi > 0.0 && rate.hi > kStretch * kLargestSlack * axes.speed &&
                        kWideGapError * (axes.size / gap.hi + axes.speed / rate.hi) <= kWideSharp;
    return useful ? quotient(gap, rate).hi : kNaN;
}

/// The start of contact from double-double; false where that is no use, or another axis comes in between.
bool refine_start(const MovingBoxes& a, const MovingBoxes& b, std::size_t pair, const Refinement& axes,
                  BoxMotion& out) {
    const WideGap wide = wide_gap(a, b, pair, out.axis);
    const double latest = out.time_upper;
    out.wide = true;
    out.time = wide_time(wide.gap, wide.rate, axes);
    if (!(out.time < kInfinity)) return false;
    out.time_lower = next_down(out.time);
    out.time_upper = next_up(out.time);
    bool sure = out.time_upper <= latest;
    for (int k = 0; k < kAxes; ++k) {
        const double other = (1.0 + kTimeError) * axes.contact.latest_of[k][axes.lane];
        sure = sure && (k == out.axis || other <= out.time_lower);
    }
    return sure;
}

/// Likewise its end.
bool refine_end(const MovingBoxes& a, const MovingBoxes& b, std::size_t pair, const Refinement& axes,
                BoxMotion& out) {
    const int axis = static_cast<int>(axes.contact.leave_axis[axes.lane]);
    const WideGap wide = wide_gap(a, b, pair, axis);
    out.wide = true;
    out.last_time = wide_time(wide.rest, wide.rate, axes);
    if (!(out.last_time < kInfinity)) return false;
    bool sure = true;
    for (int k = 0; k < kAxes; ++k) {
        const double other = (1.0 - kTimeError) * axes.contact.soonest_of[k][axes.lane];
        sure = sure && (k == axis || next_up(out.last_time) <= other);
    }
    return sure;
}

/// Four pairs that touch: a vertex on a face, or two edges that cross, are seen at once.
///
///     face of a: the vertex of b that is furthest against the normal; face of b: that of a along it
///     edges e, f: p + s e = q + u f, where p and q are the middles of the edges, so with m = e x f
///                 s = ((q - p) x f) . m / m . m,  u = ((q - p) x e) . m / m . m
///
/// Everything else, such as two faces or edges side by side, is left to ContactPoints.
GEOMSRV_INLINE void add_points(const LaneBoxes& a, const LaneBoxes& b, const LanePair& pair,
                               const Four& normal, const Four& product, BoxMotion* const (&row)[4]) {
    const Lanes none = 0.0;
    const Lanes axis(Lanes::Vector{static_cast<double>(row[0]->axis), static_cast<double>(row[1]->axis),
                                   static_cast<double>(row[2]->axis), static_cast<double>(row[3]->axis)});
    const Lanes time(Lanes::Vector{row[0]->time, row[1]->time, row[2]->time, row[3]->time});
    const LaneMask face_a = axis < Lanes(3.0);
    const LaneMask crossed = Lanes(5.0) < axis;
    const LaneMask face_b = ~(face_a | crossed);
    const Lanes level = Lanes(kStretch * kMostSlack) * pair.size;
    const Lanes long_enough = Lanes(2.0) * level;

    // What leads from the centre of a to the extreme vertex or the middle of the edge; of the others, whether
    // they are beside the vertex by more than any slack, and long enough to be more than a point.
    struct Arm {
        Four sum, edge;
        Lanes half;
        LaneMask steep, all_long;
    };
    const auto arm_of = [&](const LaneBoxes& box, const Lanes& sign,
                            const Lanes& own) __attribute__((always_inline)) {
        Arm out{{none, none, none}, {none, none, none}, none, none <= none, none <= none};
        for (int i = 0; i < 3; ++i) {
            const LaneMask is_own =
                crossed & (own <= Lanes(static_cast<double>(i))) & (Lanes(static_cast<double>(i)) <= own);
            const Lanes height = dot(normal, box.edge[i]);
            out.steep = out.steep & (is_own | (level < magnitude(height) * box.half[i]));
            out.all_long = out.all_long & (long_enough < box.half[i]);
            const Lanes part = kept(~is_own, with_sign_of(sign * height, box.half[i]));
            out.sum = out.sum + part * box.edge[i];
            out.edge = out.edge + kept(is_own, Lanes(1.0)) * box.edge[i];
            out.half = out.half + kept(is_own, box.half[i]);
        }
        return out;
    };
    // Axis 6 + 3 i + j.
    const LaneMask second = Lanes(8.0) < axis;
    const LaneMask third = Lanes(11.0) < axis;
    const Lanes of_a = select(third, Lanes(2.0), select(second, Lanes(1.0), none));
    const Lanes of_b = axis - Lanes(6.0) - Lanes(3.0) * of_a;
    const Arm arm_a = arm_of(a, Lanes(1.0), of_a);
    const Arm arm_b = arm_of(b, Lanes(-1.0), of_b);

    const Four between = pair.d + time * pair.w + (arm_b.sum - arm_a.sum);
    const Lanes square = dot(product, product);
    const Lanes s = dot(cross(between, arm_b.edge), product) / square;
    const Lanes u = dot(cross(between, arm_a.edge), product) / square;
    const LaneMask cross_inside =
        (magnitude(s) < arm_a.half) & (magnitude(u) < arm_b.half) & (Lanes(kClearAngle) < square);
    const LaneMask known =
        (face_b & arm_a.steep) | (face_a & arm_b.steep & arm_a.all_long) |
        (crossed & arm_a.steep & arm_b.steep & arm_a.all_long & arm_b.all_long & cross_inside);
    const Four on_a = a.center + (arm_a.sum + kept(crossed, s) * arm_a.edge) + time * a.velocity;
    const Four on_b = b.center + arm_b.sum + time * b.velocity;
    const Four point = {select(face_a, on_b.x, on_a.x), select(face_a, on_b.y, on_a.y),
                        select(face_a, on_b.z, on_a.z)};
    const Lanes flag = select(known, Lanes(1.0), none);
    for (int k = 0; k < 4; ++k) {
        row[k]->lone = row[k]->verdict == BoxMotion::Verdict::will_touch && flag[k] != 0.0;
        row[k]->point = {point.x[k], point.y[k], point.z[k]};
    }
}

/// Four pairs; `row[k]` is where the k-th goes.
GEOMSRV_WIDE_CLONES void decide_four(const MovingBoxes& boxes_a, const MovingBoxes& boxes_b,
                                     const std::size_t (&index)[4], double t_max, bool points,
                                     BoxMotion* const (&row)[4]) {
    LaneBoxes a;
    LaneBoxes b;
    load_centers(boxes_a, index, a);
    load_centers(boxes_b, index, b);
    load_edges(boxes_a, index, a);
    load_edges(boxes_b, index, b);
    const LanePair pair = pair_of(a, b, t_max);

    Four face_a[3];
    Four face_b[3];
    for (int i = 0; i < 3; ++i) {
        face_a[i] = cross(a.edge[kNext[i]], a.edge[kLast[i]]);
        face_b[i] = cross(b.edge[kNext[i]], b.edge[kLast[i]]);
    }
    Lanes of_a[3][3];  // |normal i of a . edge j of b|
    Lanes of_b[3][3];  // |normal j of b . edge i of a|, by i and j
    for (int i = 0; i < 3; ++i) {
        for (int j = 0; j < 3; ++j) {
            of_a[i][j] = magnitude(dot(face_a[i], b.edge[j]));
            of_b[i][j] = magnitude(dot(face_b[j], a.edge[i]));
        }
    }
    LaneMask skipped[3][3];
    LaneMask any_skipped = Lanes(1.0) < Lanes(0.0);
    for (int i = 0; i < 3; ++i) {
        for (int j = 0; j < 3; ++j) {
            skipped[i][j] = greater(of_a[kNext[i]][j], of_a[kLast[i]][j]) <= Lanes(kParallel);
            any_skipped = any_skipped | skipped[i][j];
        }
    }
    Lanes parallel = 0.0;
    if (any(any_skipped)) {
        for (int i = 0; i < 3; ++i) {
            for (int j = 0; j < 3; ++j) {
                const Lanes shares = (of_a[kNext[i]][j] + of_a[kLast[i]][j]) + Lanes(2 * kShareError);
                const LaneMask counts = skipped[i][j] & ~same_line(a.edge[i], b.edge[j]);
                parallel = parallel + kept(counts, Lanes(kParallelError) * shares * pair.size);
            }
        }
    }

    Contact contact(pair, parallel);
    const auto ask = [&]<bool Careful>() __attribute__((always_inline)) {
        const Lanes volume_a = magnitude(dot(face_a[0], a.edge[0]));
        const Lanes volume_b = magnitude(dot(face_b[0], b.edge[0]));
        for (int i = 0; i < 3; ++i) {
            const Lanes r = volume_a * a.half[i] +
                            (of_a[i][0] * b.half[0] + of_a[i][1] * b.half[1] + of_a[i][2] * b.half[2]);
            contact.add<Careful>(i, dot(face_a[i], pair.d), dot(face_a[i], pair.w), r);
        }
        for (int j = 0; j < 3; ++j) {
            const Lanes r = volume_b * b.half[j] +
                            (of_b[0][j] * a.half[0] + of_b[1][j] * a.half[1] + of_b[2][j] * a.half[2]);
            contact.add<Careful>(3 + j, dot(face_b[j], pair.d), dot(face_b[j], pair.w), r);
        }
        for (int i = 0; i < 3; ++i) {
            const int i1 = kNext[i];
            const int i2 = kLast[i];
            const Four across = cross(pair.d, a.edge[i]);
            const Four across_rate = cross(pair.w, a.edge[i]);
            for (int j = 0; j < 3; ++j) {
                const int j1 = kNext[j];
                const int j2 = kLast[j];
                Lanes r = (a.half[i1] * of_a[i2][j] + a.half[i2] * of_a[i1][j]) +
                          (b.half[j1] * of_b[i][j2] + b.half[j2] * of_b[i][j1]);
                Lanes s = dot(across, b.edge[j]);
                Lanes c = dot(across_rate, b.edge[j]);
                if constexpr (Careful) {
                    // An axis that is skipped is in contact for ever.
                    s = kept(~skipped[i][j], s);
                    c = kept(~skipped[i][j], c);
                    r = select(skipped[i][j], Lanes(kInfinity), r);
                }
                contact.add<Careful>(6 + 3 * i + j, s, c, r);
            }
        }
    };
    ask.template operator()<false>();
    if (any(any_skipped | ~contact.clear())) {
        contact.forget();
        ask.template operator()<true>();
    }

    const Lanes gap = Contact::picked(contact.gap_of, contact.enter_axis);
    const Lanes rate = Contact::picked(contact.rate_of, contact.enter_axis);
    const Lanes rest = Contact::picked(contact.rest_of, contact.leave_axis);
    const Lanes leave_rate = Contact::picked(contact.rate_of, contact.leave_axis);
    const Lanes slack_margin = contact.margin() + Lanes(kStretch) * pair.slack;
    const Lanes slack_start = Lanes(1.0 - kTimeError) * contact.enter_low(gap, rate, slack_margin);
    const Lanes slack_end = Lanes(1.0 + kTimeError) * contact.leave_high(rest, leave_rate, slack_margin);
    const LaneMask never = pair.ordinary & ((pair.end < slack_start) | (slack_end < slack_start));

    const Lanes start = Lanes(1.0 - kTimeError) * contact.enter_low(gap, rate, contact.margin());
    const Lanes late_start = Lanes(1.0 + kTimeError) * contact.enter_high;
    const Lanes end = Lanes(1.0 - kTimeError) * contact.leave_low;
    const Lanes late_end = Lanes(1.0 + kTimeError) * contact.leave_high(rest, leave_rate, contact.margin());
    const LaneMask sharp_end = late_end - end <= Lanes(kSharp) * end;
    const LaneMask sharp_start = late_start - start <= Lanes(kSharp) * late_start;
    const LaneMask meet = pair.ordinary & (late_start < end) & (late_start <= pair.end);
    const LaneMask touch = meet & (slack_margin < gap);
    LaneMask overlap = meet & (late_start <= Lanes(0.0));
    if (any(overlap)) {
        const Lanes deep =
            contact.wide_margin() + Lanes(kStretch) * (pair.slack + Lanes(kLeastMargin) * pair.size);
        overlap = overlap & (deep < contact.depth());
    }
    const auto value = [](BoxMotion::Verdict v) { return Lanes(static_cast<double>(v)); };
    const Lanes verdict = select(never, value(BoxMotion::Verdict::never),
                                 select(touch, value(BoxMotion::Verdict::will_touch),
                                        select(overlap, value(BoxMotion::Verdict::overlapping), value({}))));
    const Lanes blunt_start = select(sharp_start | overlap, Lanes(0.0), Lanes(1.0));
    const Lanes blunt_end = select(sharp_end, Lanes(0.0), Lanes(1.0));
    const Lanes time = gap / rate;
    const Lanes last = rest / leave_rate;
    double product[3][4] = {};
    for (int k = 0; k < 4; ++k) {
        BoxMotion& out = *row[k];
        out.verdict = static_cast<BoxMotion::Verdict>(static_cast<int>(verdict[k]));
        if (out.verdict == BoxMotion::Verdict::unclear || out.verdict == BoxMotion::Verdict::never) continue;
        out.last_time = last[k];
        out.time = std::clamp(time[k], start[k], late_start[k]);
        out.time_lower = start[k];
        out.time_upper = late_start[k];
        out.axis = static_cast<std::uint8_t>(contact.enter_axis[k]);
        const Refinement axes = {contact, k, parallel[k] == 0.0 ? pair.size[k] : kInfinity, pair.speed[k]};
        if ((blunt_start[k] != 0.0 && !refine_start(boxes_a, boxes_b, index[k], axes, out)) ||
            (blunt_end[k] != 0.0 && !refine_end(boxes_a, boxes_b, index[k], axes, out))) {
            out.verdict = BoxMotion::Verdict::unclear;
        }
        const AxisEdges edges = edges_of(boxes_a, boxes_b, index[k], out.axis);
        const Vec3 p = edges.first;
        const Vec3 q = edges.second;
        product[0][k] = p.y * q.z - p.z * q.y;
        product[1][k] = p.z * q.x - p.x * q.z;
        product[2][k] = p.x * q.y - p.y * q.x;
        out.half[0] = edges.half[0];
        out.half[1] = edges.half[1];
    }
    const Four raw = {Lanes::load(product[0]), Lanes::load(product[1]), Lanes::load(product[2])};
    const Lanes size = square_root(dot(raw, raw));
    // From a to b is against the motion.  The sum leaves no zero of the wrong sign.
    const Lanes none = 0.0;
    const Lanes length = with_sign_of(dot(raw, pair.w), -size);
    const Four normal = {raw.x / length + none, raw.y / length + none, raw.z / length + none};
    const Lanes closing = none - dot(normal, pair.w);
    for (int k = 0; k < 4; ++k) {
        BoxMotion& out = *row[k];
        if (out.verdict != BoxMotion::Verdict::will_touch) continue;
        out.normal = {normal.x[k], normal.y[k], normal.z[k]};
        out.closing_speed = closing[k];
        out.sine = size[k];
    }
    if (points) add_points(a, b, pair, normal, raw, row);
}

/// Verdict `never` where balls say so.
GEOMSRV_WIDE_CLONES void test_balls(const MovingBoxes& boxes_a, const MovingBoxes& boxes_b, std::size_t first,
                                    std::size_t count, double t_max, std::int64_t* misses) {
    for (std::size_t start = 0; start < count; start += 4) {
        std::size_t index[4];
        for (std::size_t k = 0; k < 4; ++k) index[k] = first + std::min(start + k, count - 1);
        LaneBoxes a;
        LaneBoxes b;
        load_centers(boxes_a, index, a);
        load_centers(boxes_b, index, b);
        store(balls_miss(pair_of(a, b, t_max), a, b), misses + start);
    }
}

}  // namespace

void decide_box_motions(const MovingBoxes& a, const MovingBoxes& b, std::size_t first, std::size_t count,
                        double t_max, bool points, BoxMotion* out) {
    for (std::size_t from = 0; from < count; from += kBoxMotionBlock) {
        const std::size_t block = std::min(kBoxMotionBlock, count - from);
        std::int64_t misses[kBoxMotionBlock];
        std::size_t left[kBoxMotionBlock];
        std::size_t many = 0;
        test_balls(a, b, first + from, block, t_max, misses);
        for (std::size_t k = 0; k < block; ++k) {
            out[from + k].verdict = BoxMotion::Verdict::never;
            out[from + k].wide = false;
            out[from + k].lone = false;
            left[many] = from + k;
            many += misses[k] == 0 ? 1 : 0;
        }
        for (std::size_t start = 0; start < many; start += 4) {
            std::size_t index[4];
            BoxMotion* row[4];
            for (std::size_t k = 0; k < 4; ++k) {
                const std::size_t which = left[std::min(start + k, many - 1)];
                index[k] = first + which;
                row[k] = out + which;
            }
            decide_four(a, b, index, t_max, points, row);
        }
    }
}

}  // namespace geomsrv
