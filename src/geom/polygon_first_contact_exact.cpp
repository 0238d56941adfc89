// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
// The ray of polygon_first_contact.cpp, clipped without slack.  float64 with bounds for rounding finds the
// few axes - mostly one each - that may set the first and the last contact, or proves that there is none.
// Their times are compared and rounded in arithmetic that cannot be wrong.
#include "geom/polygon_first_contact_exact.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <utility>

#include "geom/exact_sign.hpp"
#include "geom/lane_arithmetic.hpp"
#include "geom/polygon_motion.hpp"
#include "geom/polygon_window.hpp"
#include "geom/rounding.hpp"

namespace geomsrv {

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

/// What is known before exact numbers are asked for.
struct Query {
    const PolygonPair& pair;
    Vec2 velocity_a, velocity_b;
    bool flat;
    double t_max;
    bool contact_set;
    Relation relation;
    std::span<const AxisOf> touching;  ///< axes along which polygons touch at the start
    std::span<const AxisOf> entries;   ///< axes that may set the first contact
    std::span<const AxisOf> exits;     ///< and the last

    [[nodiscard]] bool bounds(AxisOf axis) const { return axis.index < axes_of(pair.side(axis.side), flat); }
    /// Velocity of the polygon with an axis towards the other one, as seen from there.
    template <class A>
    [[nodiscard]] typename A::Vector approach(int side) const {
        return side == 0 ? A::difference(velocity_a, velocity_b) : A::difference(velocity_b, velocity_a);
    }
};

/// A gap and the rate at which it closes: it is zero at their quotient.
template <class A>
struct Clip {
    AxisOf axis;
    Level lowest;  ///< of the other polygon
    typename A::Vector normal;
    typename A::Number gap, rate;
};

template <class A>
void clip_along(const Query& query, AxisOf axis, Clip<A>& clip) {
    clip.axis = axis;
    clip.lowest = lowest_along(query.pair, axis);
    clip.normal = normal_of<A>(query.pair, axis);
    clip.gap = dot(clip.normal, across<A>(query.pair, axis, clip.lowest.vertex));
    clip.rate = dot(clip.normal, query.approach<A>(axis.side));
}

/// +1 if the gap of p closes later than that of q; both rates have the same sign.
template <class A>
int compare_times(const Clip<A>& p, const Clip<A>& q) {
    return sign_of(p.gap * q.rate - q.gap * p.rate);
}

/// Whether p is the axis to call the normal rather than q: along it the polygons approach faster, or it is
/// the more clockwise one, or, of opposite ones, its angle is smaller.  kUncertain if this arithmetic cannot
/// tell.
template <class A>
int is_preferred(const PolygonPair& pair, const Clip<A>& p, const Clip<A>& q) {
    const int sign_p = sign_of(p.rate);
    const int sign_q = sign_of(q.rate);
    if (sign_p == kUncertain || sign_q == kUncertain) {
        return kUncertain;
    }
    int order = sign_p - sign_q;
    if (order == 0 && sign_p != 0) {
        order =
            sign_of(p.rate * p.rate * dot(q.normal, q.normal) - q.rate * q.rate * dot(p.normal, p.normal));
        if (order == kUncertain) {
            return kUncertain;
        }
        order *= sign_p;
    }
    if (order == 0) {
        const AxisEnds ends_p = ends_of(pair, p.axis);
        const AxisEnds ends_q = ends_of(pair, q.axis);
        order = sign_of_cross(ends_p.from, ends_p.to, ends_q.from, ends_q.to);
        // Normals point away from their own polygon.
        order = p.axis.side == q.axis.side ? order : -order;
    }
    return order > 0 || (order == 0 && is_before(pair, p.axis, q.axis)) ? 1 : 0;
}

/// Answers, except for the contact set of polygons that overlap at the start; false if the arithmetic cannot
/// tell.
template <class A>
class Resolution {
public:
    using Number = typename A::Number;

    Resolution(const Query& query, FirstContact& out, std::array<Vec2, 2>& points)
        : query_(query), out_(out), points_(points) {}

    bool run() {
        out_.status = ContactStatus::never;
        Rounding first;
        if (query_.relation == Relation::apart) {
            if (!find_entry()) {
                return false;
            }
            if (never_) {
                return true;
            }
            if (!A::round_ratio(entry_.gap, entry_.rate, first)) {
                return false;
            }
            // The least double that is not less than the exact time tells whether that is in time.
            if (first.upper > query_.t_max) {
                return true;
            }
        }
        Rounding last{kInfinity, kInfinity, kInfinity};
        if (!find_exit()) {
            return false;
        }
        if (never_) {
            return true;
        }
        if (leaves_ && !A::round_ratio(exit_.gap, exit_.rate, last)) {
            return false;
        }
        if (query_.relation == Relation::apart && !(first.upper <= last.lower)) {
            // The rates have opposite signs.
            const int order = compare_times(entry_, exit_);
            if (order == kUncertain) {
                return false;
            }
            if (order < 0) {
                return true;
            }
        }
        out_.time = first.nearest;
        out_.time_lower = first.lower;
        out_.time_upper = first.upper;
        out_.last_time = std::min(last.nearest, query_.t_max);
        if (query_.relation == Relation::overlapping) {
            out_.status = ContactStatus::overlapping;
            return true;
        }
        out_.status =
            query_.relation == Relation::apart ? ContactStatus::will_touch : ContactStatus::touching;
        if (query_.relation == Relation::touching && !find_touching()) {
            return false;
        }
        const Vec2 outward = A::direction(entry_.normal);
        out_.normal = entry_.axis.side == 0 ? outward : -outward;
        return !query_.contact_set || find_points();
    }

private:
    /// The axis that closes last.
    bool find_entry() {
        bool found = false;
        for (const AxisOf axis : query_.entries) {
            if (!query_.bounds(axis)) {
                continue;
            }
            Clip<A>& clip = found ? other_ : entry_;
            clip_along(query_, axis, clip);
            const int open = sign_of(clip.gap);
            const int closing = sign_of(clip.rate);
            if (open == kUncertain || (open > 0 && closing == kUncertain)) {
                return false;
            }
            if (open <= 0) {
                continue;
            }
            if (closing <= 0) {
                never_ = true;
                return true;
            }
            if (!found) {
                found = true;
                continue;
            }
            int later = compare_times(clip, entry_);
            if (later == 0) {
                later = is_preferred(query_.pair, clip, entry_);
            }
            if (later == kUncertain) {
                return false;
            }
            if (later > 0) {
                std::swap(clip, entry_);
            }
        }
        // Along the edges contact has begun where the tip of a needle says that it has not: they miss.
        never_ = !found;
        return true;
    }

    /// The axis that opens first.
    bool find_exit() {
        for (const AxisOf axis : query_.exits) {
            if (!query_.bounds(axis)) {
                continue;
            }
            Clip<A>& clip = leaves_ ? other_ : exit_;
            clip_along(query_, axis, clip);
            const int closing = sign_of(clip.rate);
            if (closing == kUncertain) {
                return false;
            }
            if (closing >= 0) {
                continue;
            }
            if (!leaves_) {
                leaves_ = true;
                continue;
            }
            const int earlier = compare_times(exit_, clip);
            if (earlier == kUncertain) {
                return false;
            }
            if (earlier > 0) {
                std::swap(clip, exit_);
            }
        }
        if (!leaves_) {
            // At rest, or along the edges contact lasts longer than at the tip of a needle: they miss.
            never_ = query_.relation == Relation::apart;
            return true;
        }
        const int open = sign_of(exit_.gap);
        never_ = open == 1;
        return open != kUncertain;
    }

    /// The axis to call the normal, of those along which the polygons touch at the start.
    bool find_touching() {
        bool found = false;
        for (const AxisOf axis : query_.touching) {
            Clip<A>& clip = found ? other_ : entry_;
            clip_along(query_, axis, clip);
            if (!found) {
                found = true;
                continue;
            }
            const int preferred = is_preferred(query_.pair, clip, entry_);
            if (preferred == kUncertain) {
                return false;
            }
            if (preferred > 0) {
                std::swap(clip, entry_);
            }
        }
        entry_.gap = Number(0.0);
        entry_.rate = Number(1.0);
        return true;
    }

    /// A vertex, moved.
    bool place(int side, std::size_t vertex, Vec2& out) const {
        const Vec2 from = query_.pair.side(side).ring[vertex];
        const Vec2 velocity = side == 0 ? query_.velocity_a : query_.velocity_b;
        if (query_.relation == Relation::touching || (velocity.x == 0.0 && velocity.y == 0.0)) {
            out = from;
            return true;
        }
        return A::round_place(from, entry_.gap, entry_.rate, A::vector(velocity), out);
    }

    /// Contact along the axis `entry_`: the common part of the two faces that meet there.
    ///
    ///      face of the other polygon          |------------------------|
    ///      own face                  |---------------------|                  ---> along
    ///                                        low          high
    bool find_points() {
        const PolygonPair& pair = query_.pair;
        const AxisOf axis = entry_.axis;
        const PairedPolygon& p = pair.side(axis.side);
        const int other = 1 - axis.side;
        out_.points = {points_.data(), 1};
        if (axis.index >= p.edges) {
            return place(axis.side, p.base(axis.index), points_[0]);
        }
        auto [q_low, q_high] = entry_.lowest;
        if (q_low == q_high) {
            return place(other, q_low, points_[0]);
        }
        const std::size_t p_low = axis.index;
        const std::size_t p_high = p.next(p_low);
        const Ring ring_p = p.ring;
        const Ring ring_q = pair.other(axis.side).ring;
        if (sign_of_dot(ring_p[p_low], ring_p[p_high], ring_q[q_low], ring_q[q_high]) < 0) {
            std::swap(q_low, q_high);
        }

        const typename A::Vector along{-entry_.normal.y, entry_.normal.x};
        const Number drift = dot(along, query_.approach<A>(other)) * entry_.gap;
        // Whether a vertex of the other polygon is further along than one of this, by then.
        const auto order = [&](std::size_t q, std::size_t p_vertex) {
            return sign_of(dot(along, A::difference(ring_q[q], ring_p[p_vertex])) * entry_.rate + drift);
        };
        const int from_low = order(q_low, p_low);
        const int from_high = order(q_high, p_high);
        if (from_low == kUncertain || from_high == kUncertain) {
            return false;
        }
        const bool q_begins = from_low > 0;
        const bool q_ends = from_high < 0;
        if (q_begins != q_ends) {
            const int length = q_begins ? -order(q_low, p_high) : order(q_high, p_low);
            if (length == kUncertain || length == -kUncertain) {
                return false;
            }
            if (length == 0) {
                return place(other, q_begins ? q_low : q_high, points_[0]);
            }
        }
        // Counter-clockwise around a.
        out_.points = {points_.data(), 2};
        const bool is_a = axis.side == 0;
        return place(q_begins ? other : axis.side, q_begins ? q_low : p_low, points_[is_a ? 0 : 1]) &&
               place(q_ends ? other : axis.side, q_ends ? q_high : p_high, points_[is_a ? 1 : 0]);
    }

    const Query& query_;
    FirstContact& out_;
    std::array<Vec2, 2>& points_;
    bool never_ = false;
    bool leaves_ = false;
    Clip<A> entry_;
    Clip<A> exit_;
    Clip<A> other_;  // to compare with one of them
};

// ---- The usual case: one axis for the first contact, one for the last, both of edges, and a vertex in front
// of the first one.  Both at once in the lanes of vectors; what it cannot tell is left to `Resolution`.

/// Four pairs, see DoubleDouble.
struct WideLanes {
    Lanes hi, lo;
};

GEOMSRV_INLINE WideLanes sum_of(const Lanes& a, const Lanes& b) {
    const Lanes sum = a + b, part = sum - a;
    return {sum, (a - (sum - part)) + (b - part)};
}
GEOMSRV_INLINE WideLanes in_order(const Lanes& hi, const Lanes& lo) {
    const Lanes sum = hi + lo;
    return {sum, lo - (sum - hi)};
}
template <class Arithmetic>
GEOMSRV_INLINE WideLanes product_of(const WideLanes& a, const WideLanes& b) {
    const Lanes product = a.hi * b.hi;
    const Lanes mixed = Arithmetic::multiply_add(a.hi, b.lo, a.lo * b.hi);
    return in_order(product, Arithmetic::product_error(a.hi, b.hi, product) + mixed);
}

/// An edge, the vertex of the other polygon that is lowest along its normal, and the velocities of its own
/// polygon and of the other.
struct Facing {
    Vec2 from, to, lowest, own_velocity, other_velocity;
};

/// When two gaps close, the direction of the first one's normal, and where a point is at the first time.
struct Moments {
    Rounding first, last;
    Vec2 normal, place;
};

/// `Wide::direction` of a vector in the first two lanes: the same operations, so the same bits.  REQUIRES:
/// its parts are safe, see kSmallestSafe, or zero.
template <class Arithmetic>
GEOMSRV_INLINE Vec2 direction_of(const WideLanes& v) {
    const auto other = [](const Lanes& z) __attribute__((always_inline)) {
        return Lanes(__builtin_shufflevector(z.v, z.v, 1, 0, 3, 2));
    };
    const Lanes product = v.hi * v.hi;
    const WideLanes part =
        in_order(product, Arithmetic::product_error(v.hi, v.hi, product) + (v.hi * v.lo + v.lo * v.hi));
    const WideLanes sum = sum_of(part.hi, other(part.hi));
    const WideLanes square = in_order(sum.hi, sum.lo + (part.lo + other(part.lo)));
    const Lanes root = square_root(square.hi), inverse = Lanes(1.0) / root, again = root * root;
    const Lanes root_rest =
        Lanes(0.5) * inverse *
        (((square.hi - again) - Arithmetic::product_error(root, root, again)) + square.lo);
    const Lanes rough = v.hi * inverse, back = rough * root;
    const Lanes rest =
        ((v.hi - back) - Arithmetic::product_error(rough, root, back)) + (v.lo - rough * root_rest);
    const Lanes unit = rough + rest * inverse;
    return {unit[0], unit[1]};
}

/// False if in doubt.
template <class Arithmetic>
GEOMSRV_INLINE bool find_moments(const Facing& entry, const Facing& exit, Vec2 start, Vec2 velocity,
                                 bool place, Moments& out) {
    // Lanes: gap of the entry, gap of the exit, rate of the entry, rate of the exit.
    using Vector = Lanes::Vector;
    const auto twice = [](double a, double b)
                           __attribute__((always_inline)) { return Lanes(Vector{a, b, a, b}); };
    const auto four = [](double a, double b, double c, double d)
                          __attribute__((always_inline)) { return Lanes(Vector{a, b, c, d}); };
    const WideLanes normal_x = sum_of(twice(entry.to.y, exit.to.y), -twice(entry.from.y, exit.from.y));
    const WideLanes normal_y = sum_of(twice(entry.from.x, exit.from.x), -twice(entry.to.x, exit.to.x));
    const WideLanes arm_x =
        sum_of(four(entry.lowest.x, exit.lowest.x, entry.own_velocity.x, exit.own_velocity.x),
               -four(entry.from.x, exit.from.x, entry.other_velocity.x, exit.other_velocity.x));
    const WideLanes arm_y =
        sum_of(four(entry.lowest.y, exit.lowest.y, entry.own_velocity.y, exit.own_velocity.y),
               -four(entry.from.y, exit.from.y, entry.other_velocity.y, exit.other_velocity.y));
    const WideLanes x = product_of<Arithmetic>(normal_x, arm_x), y = product_of<Arithmetic>(normal_y, arm_y);
    const WideLanes sum = sum_of(x.hi, y.hi);
    const WideLanes n = in_order(sum.hi, sum.lo + (x.lo + y.lo));
    const Lanes n_error = Lanes(kExactDotError) * (magnitude(x.hi) + magnitude(y.hi)) + Lanes(kPairUnderflow);
    const LaneMask known = Lanes(kBoundRounding) * n_error < magnitude(n.hi);
    const Vector hi = n.hi.v;
    if (!all(known) || !(hi[0] > 0.0 && hi[1] < 0.0 && hi[2] > 0.0 && hi[3] < 0.0)) return false;

    // Gaps over rates in the first two lanes: `ratio` of polygon_exact.cpp, and Ziv's test as in
    // `round_enclosed`, both for numbers above zero.
    const auto rates = [](const Lanes& z) __attribute__((always_inline)) {
        return Lanes(__builtin_shufflevector(z.v, z.v, 2, 3, 2, 3));
    };
    const Lanes d = rates(n.hi), d_rest = rates(n.lo), d_error = rates(n_error);
    const LaneMask safe = (Lanes(kSmallestSafe) < magnitude(n.hi)) & (magnitude(n.hi) < Lanes(kLargestSafe)) &
                          (d_error < Lanes(kSmallRelative) * magnitude(d));
    if (!all(safe)) return false;
    const Lanes inverse = Lanes(1.0) / d, rough = n.hi * inverse, product = rough * d;
    const Lanes rest =
        ((n.hi - product) - Arithmetic::product_error(rough, d, product)) + (n.lo - rough * d_rest);
    const WideLanes t = in_order(rough, rest * inverse);
    const Lanes inherited =
        (n_error + t.hi * d_error) * magnitude(inverse) * Lanes(1.0 + 2.0 * kSmallRelative);
    const Lanes error = (inherited + Lanes(kInverseError) * t.hi) * Lanes(kBoundRounding);
    const Lanes size = magnitude(t.lo);
    const LaneMask rounds = (error < size) & LaneMask((t.hi - (size + error)).v == t.hi.v);
    if (rounds.v[0] == 0 || rounds.v[1] == 0) return false;
    const LaneMask::Vector below = t.lo.v < 0.0;
    const Lanes lower = neighbour(t.hi, below), upper = neighbour(lower, LaneMask::Vector{1, 1, 1, 1});
    out.first = {t.hi[0], lower[0], upper[0]};
    out.last = {t.hi[1], lower[1], upper[1]};

    const auto ahead = [](const Lanes& p, const Lanes& q) __attribute__((always_inline)) {
        return Lanes(__builtin_shufflevector(p.v, q.v, 0, 4, 0, 4));
    };
    const WideLanes normal{ahead(normal_x.hi, normal_y.hi), ahead(normal_x.lo, normal_y.lo)};
    const Lanes length = magnitude(normal.hi);
    if (!all(((Lanes(kSmallestSafe) < length) & (length < Lanes(kLargestSafe))) | (length <= Lanes(0.0)))) {
        return false;
    }
    out.normal = direction_of<Arithmetic>(normal);
    if (!place) return true;

    // As `round_sum` of polygon_exact.cpp.
    const Lanes from = twice(start.x, start.y), speed = twice(velocity.x, velocity.y);
    const WideLanes way = product_of<Arithmetic>({t.hi[0], t.lo[0]}, {speed, 0.0});
    const WideLanes end = sum_of(from, way.hi);
    const Lanes end_rest = end.lo + way.lo;
    const Lanes off = (magnitude(speed) * Lanes(error[0]) +
                       Lanes(kWideRoundoff) * (magnitude(way.hi) + magnitude(end.hi))) *
                          Lanes(kBoundRounding) +
                      Lanes(kEnclosedUnderflow);
    const Lanes found = end.hi + (end_rest - off);
    out.place = {found[0], found[1]};
    return all(LaneMask(found.v == (end.hi + (end_rest + off)).v));
}

GEOMSRV_FUSED bool find_moments_fused(const Facing& entry, const Facing& exit, Vec2 start, Vec2 velocity,
                                      bool place, Moments& out) {
    return find_moments<OneRounding>(entry, exit, start, velocity, place, out);
}
bool find_moments_plain(const Facing& entry, const Facing& exit, Vec2 start, Vec2 velocity, bool place,
                        Moments& out) {
    return find_moments<TwoRoundings>(entry, exit, start, velocity, place, out);
}

/// The two polygons that an edge and a vertex are of.
struct Pair {
    const MovingPolygon& a;
    const MovingPolygon& b;

    [[nodiscard]] Facing facing(const EdgeAndVertex& at) const {
        const bool is_a = at.edge.side == 0;
        const MovingPolygon& own = is_a ? a : b;
        const MovingPolygon& other = is_a ? b : a;
        const std::size_t next = at.edge.index + 1 < own.ring.size() ? at.edge.index + 1 : 0;
        return {own.ring[at.edge.index], own.ring[next], other.ring[at.vertex], own.velocity, other.velocity};
    }
};

/// The answer where the first contact is of one edge with one vertex, and the last likewise; false in doubt.
bool resolve_quickly(const Pair& pair, const EdgeAndVertex& first, const EdgeAndVertex& last, double t_max,
                     bool contact_set, FirstContact& out, std::array<Vec2, 2>& points) {
    const Facing entry = pair.facing(first);
    const auto find = has_fused() ? find_moments_fused : find_moments_plain;
    Moments found;
    if (!find(entry, pair.facing(last), entry.lowest, entry.other_velocity, contact_set, found) ||
        !(found.first.upper <= std::min(found.last.lower, t_max))) {
        return false;
    }
    out.status = ContactStatus::will_touch;
    out.rung = Rung::wide;
    out.time = found.first.nearest;
    out.time_lower = found.first.lower;
    out.time_upper = found.first.upper;
    out.last_time = std::min(found.last.nearest, t_max);
    out.normal = first.edge.side == 0 ? found.normal : -found.normal;
    if (contact_set) {
        points[0] = found.place;
        out.points = {points.data(), 1};
    }
    return true;
}

/// The same of all that is asked; false if it is not so simple.
bool resolve_quickly(const Query& query, const Pair& bodies, FirstContact& out, std::array<Vec2, 2>& points) {
    const PolygonPair& pair = query.pair;
    if (query.relation != Relation::apart || query.entries.size() != 1 || query.exits.size() != 1) {
        return false;
    }
    const AxisOf entry = query.entries[0];
    const AxisOf exit = query.exits[0];
    if (entry.index >= pair.side(entry.side).edges || exit.index >= pair.side(exit.side).edges) {
        return false;
    }
    const Level lowest = pair.lowest_level(entry);
    if (query.contact_set && lowest.vertex != lowest.neighbour) {
        return false;
    }
    return resolve_quickly(bodies, {entry, lowest.vertex}, {exit, pair.lowest(exit)}, query.t_max,
                           query.contact_set, out, points);
}

constexpr FirstContact kNever{ContactStatus::never, kNaN, kNaN, kNaN, kNaN, {kNaN, kNaN}, {}, true};

}  // namespace

ExactFirstContactSolver::ExactFirstContactSolver(std::size_t largest_a, std::size_t largest_b)
    : pair_(largest_a, largest_b),
      entries_(PolygonPair::most_axes(largest_a, largest_b)),
      exits_(PolygonPair::most_axes(largest_a, largest_b)) {}

FirstContact ExactFirstContactSolver::solve(const MovingPolygon& a, const MovingPolygon& b, double t_max,
                                            bool contact_set) {
    pair_.load(a.ring, b.ring);
    const Motion motion = relative_motion(a.velocity, b.velocity);
    Window window = window_of(pair_, motion, Slacks(pair_, motion).literal());
    // The bounds hold, their quotients are rounded.
    window.enter = std::max(0.0, next_down(window.enter));
    window.leave = next_up(window.leave);
    if (window.never || window.enter > window.leave) {
        return kNever;
    }
    const int exponent = motion.scale_exponent - pair_.scale_exponent();
    if (next_down(std::scalbn(window.enter, exponent)) > t_max) {
        return kNever;
    }

    const bool flat = is_flat(pair_);
    Query query{pair_, a.velocity, b.velocity, flat, t_max, contact_set, Relation::apart, {}, {}, {}};
    if (!window.apart) {
        query.relation = window.deep ? Relation::overlapping : relation_of(pair_, flat, 0, touching_);
        query.touching = touching_;
    }
    const Candidates candidates = candidates_of(pair_, window, entries_.data(), exits_.data());
    query.entries = {entries_.data(), candidates.entries};
    query.exits = {exits_.data(), candidates.exits};

    FirstContact result = kNever;
    const bool in_range = pair_.scale_exponent() == 0 && motion.scale_exponent == 0;
    if (in_range &&
        resolve_quickly(query, {{pair_.side(0).ring, a.velocity}, {pair_.side(1).ring, b.velocity}}, result,
                        points_)) {
        return result;
    }
    const Rung rung = climb(in_range, [&](auto arithmetic) {
        result = kNever;
        return Resolution<decltype(arithmetic)>(query, result, points_).run();
    });
    result.rung = rung;
    if (result.status == ContactStatus::overlapping && contact_set) {
        result.points = overlap_.of(pair_, in_range, result.rung);
    }
    return result;
}

FirstContact ExactFirstContactSolver::solve(const MovingPolygon& a, const MovingPolygon& b, double t_max,
                                            bool contact_set, const PolygonMotion& known) {
    FirstContact result = kNever;
    const bool certain =
        known.verdict == PolygonMotion::Verdict::never ||
        (known.verdict == PolygonMotion::Verdict::will_touch &&
         resolve_quickly({a, b}, known.first, known.last, t_max, contact_set, result, points_));
    return certain ? result : solve(a, b, t_max, contact_set);
}

}  // namespace geomsrv
