// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
// A pair is first cast in float64 (line_cast.hpp).  Where that proves its answer, and nothing is within the
// slack for the rounding of the *input*, that is it.  Everything else is solved exactly (exact_ray.hpp); then
// the slack decides.
//
// Exact contact is the one case that float64 data hardly ever represent: of two bodies that touch, rotated
// copies overlap or miss by a rounding error.  Therefore bodies that come within the slack count as touching,
// facets along which they slide within it do not set the time, and overlaps less deep are none.  Apart from
// that, times and their bounds are those of the given numbers taken literally.
#include "geom/polytope_first_contact.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "geom/convex_convex.hpp"
#include "geom/exact_direction.hpp"
#include "geom/exact_normal.hpp"
#include "geom/exact_ray.hpp"
#include "geom/line_cast.hpp"
#include "geom/rounding.hpp"

namespace geomsrv {

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kLargest = std::numeric_limits<double>::max();
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

// What float64 decides about a time is good to this relative error, or it is found exactly: some hundred
// times what rounding leaves of numbers in which nothing cancels.
constexpr double kSharp = 0x1p-44;

// What a margin adds must be seen in spite of rounding: this part of the reach is some ten times what a cast
// rounds.
constexpr double kLeastMargin = 256 * kUnitRoundoff;

// The normal of bodies that touch at the start is that of their nearest points, and no triangle's: what noise
// may turn it is counted as if it were of one so wide, as a part of the reach.
constexpr double kStartWidth = 0x1p-4;

// The margin grows by this until no facet that the line slides along is left, or until it is out of
// proportion.
constexpr double kMarginGrowth = 4.0;
constexpr int kMostMargins = 12;

// Where the line enters a body with a margin, that is no further away than the margin's farthest corner: its
// sides are at most 1.5 times as far off as the margin, so less than 3.  Otherwise rounding has led to
// another facet.
constexpr double kMarginReach = 3.0;

// Steps of conservative advancement; it is tried last, and each step but for the last few changes the facets.
constexpr int kMostAdvances = 64;

PolytopeContact never(bool certain, Rung rung) {
    return {ContactStatus::never, kNaN, kNaN, kNaN, kNaN, {kNaN, kNaN, kNaN}, kNaN, {}, certain, rung};
}

/// Certainly apart at the start, by more than the slack, and not in contact later.
bool surely_never(const MovingPair& pair, const LineCast& cast, double t_max, double slack) {
    if (cast.outcome == LineCast::Outcome::misses) {
        return cast.gap > slack;
    }
    if (cast.outcome != LineCast::Outcome::meets) {
        return false;
    }
    const Portal& enter = cast.enter;
    const double window = pair.seconds().inverse_up(t_max);
    const double most = next_up(next_up(enter.rate + enter.rate_error) * window);
    return cast.leave.lowest > slack || enter.lowest - slack > most;
}

double closing_speed(const MovingPair& pair, Vec3 normal) {
    return -dot(normal, pair.given_b().velocity - pair.given_a().velocity);
}

/// The answer for the given numbers, without normal and points.
PolytopeContact literal_contact(const MovingPair& pair, ExactRay& ray, const LineCast& cast, double t_max) {
    if (!ray.meets(cast)) {
        return never(true, ray.rung());
    }
    const int leave = ray.compare(RayEnd::leave, 0.0);
    if (leave < 0) {
        return never(true, ray.rung());
    }
    const int enter = ray.compare(RayEnd::enter, 0.0);
    if (enter > 0 && (pair.at_rest() || (t_max < kInfinity && ray.compare(RayEnd::enter, t_max) > 0))) {
        return never(true, ray.rung());
    }
    PolytopeContact out = never(true, ray.rung());
    const bool deep = enter < 0 && leave > 0 && ray.inside();
    out.status = enter > 0 ? ContactStatus::will_touch
                 : deep    ? ContactStatus::overlapping
                           : ContactStatus::touching;
    const Rounding time = enter > 0 ? ray.time(RayEnd::enter) : Rounding{};
    out.time = time.nearest;
    out.time_lower = time.lower;
    out.time_upper = time.upper;
    const double last = pair.at_rest() ? kInfinity : ray.time(RayEnd::leave).nearest;
    out.last_time = std::max(std::min(last, t_max), out.time);
    out.rung = ray.rung();
    return out;
}

/// Depth to which the origin is inside the hull of the corners where the line enters and the point where it
/// leaves.
double depth_between(const MovingPair& pair, const Portal& enter, const Portal& leave) {
    const auto vertex = [&](VertexPair c) { return vertex_of(pair.b(), c.b) - vertex_of(pair.a(), c.a); };
    const Vec3 end = -(leave.height / leave.rate) * pair.velocity();
    double depth = -enter.highest;
    for (int k = 0; k < 3; ++k) {
        const Vec3 p = vertex(enter.corner[k]);
        const Vec3 n = cross(vertex(enter.corner[(k + 1) % 3]) - p, end - p);
        depth = std::min(depth, std::fabs(dot(n, p)) / norm(n));
    }
    return depth;
}

/// What a cast proves on its own; nothing where the slack or rounding leaves a doubt.
std::optional<PolytopeContact> plain_contact(const MovingPair& pair, const LineCast& cast, double t_max) {
    if (cast.outcome != LineCast::Outcome::meets || pair.at_rest()) {
        return {};
    }
    const Portal& enter = cast.enter;
    const Portal& leave = cast.leave;
    const double slow = kLargestSlack * pair.speed();
    const double slack = pair.noise();
    const double last = leave.height / leave.rate;
    const double last_rate = -leave.rate;
    const double doubt = (leave.highest - leave.lowest) * last_rate - leave.height * leave.rate_error;
    if (!(last_rate > slow && leave.highest < 0.0 && doubt <= kSharp * -leave.height * last_rate)) {
        return {};
    }
    PolytopeContact out = never(true, Rung::filter);
    const Seconds seconds = pair.seconds();
    out.last_time = std::min(seconds.nearest(last), t_max);
    if (enter.lowest > slack && enter.rate > slow) {
        const double lower = next_down(enter.lowest / (enter.rate + enter.rate_error));
        const double upper = next_up(enter.highest / (enter.rate - enter.rate_error));
        const bool within = seconds.up(upper) <= std::min(t_max, kLargest);
        if (!(within && upper - lower <= kSharp * upper && upper * last_rate < -leave.highest)) {
            return {};
        }
        out.status = ContactStatus::will_touch;
        out.time = seconds.nearest(enter.height / enter.rate);
        out.time_lower = seconds.down(lower);
        out.time_upper = seconds.up(upper);
        out.normal = enter.normal;
        out.closing_speed = closing_speed(pair, out.normal);
        return out;
    }
    if (enter.highest < 0.0 && depth_between(pair, enter, leave) > slack + kLeastMargin * pair.reach()) {
        out.status = ContactStatus::overlapping;
        out.time = out.time_lower = out.time_upper = 0.0;
        return out;
    }
    return {};
}

/// A facet of K, or what else limits contact along the line.
struct Limit {
    double time = 0.0;  ///< of the given numbers, in the units of the pair
    Vec3 normal;
    double gap = 0.0;
    double rate = 0.0;
    double width = 0.0;    ///< least height of the triangle that the normal is of
    double doubt = 0.0;    ///< of the time: the facet may be one of K's margin, and turned by noise
    bool literal = false;  ///< it is what limits contact of the given numbers
};

/// As far as float64 can tell.
bool agree(double time, double literal) { return std::fabs(time - literal) <= 8.0 * kSharp * literal; }

/// How far noise may turn a plane that is of a triangle so narrow.
double turn_of(const MovingPair& pair, double width) {
    return width > 0.0 ? std::min(pair.noise() / width, kLargestSlack) : kLargestSlack;
}

/// Least height of the triangle of two edges of the facet; they are about perpendicular, or make it slender.
double width_of(const BoxMotion& motion) {
    const auto [e, f] = motion.half;
    return e > 0.0 && f > 0.0 ? 2.0 * e * (f / std::hypot(e, f)) * motion.sine : 0.0;
}

/// Contact within the slack.
class Nearly {
public:
    Nearly(const MovingPair& pair) : pair_(pair) {}

    /// Where the line enters or leaves K, apart from facets that it slides along within the slack: with a
    /// margin about K it is inside of those.
    std::optional<Limit> limit(RayEnd end, double distance) const {
        double margin = distance + std::max(2.0 * pair_.noise(), kLeastMargin * pair_.reach());
        for (int count = 0; count < kMostMargins; ++count, margin *= kMarginGrowth) {
            const LineCast cast = cast_line_wide(pair_.a(), pair_.b(), pair_.velocity(), margin);
            const Portal& portal = end == RayEnd::enter ? cast.enter : cast.leave;
            if (cast.portals && portal.settled) {
                const Limit found = limit_of(portal, margin);
                if (!slides(found, end) && apart_at(found.time) <= kMarginReach * margin) {
                    return found;
                }
            }
        }
        return {};
    }

    /// When the bodies come within the slack, by conservative advancement: along the shortest way between
    /// them they cannot meet sooner than it closes.
    [[nodiscard]] std::optional<Limit> advance() const {
        Limit out;
        for (int count = 0; count < kMostAdvances; ++count) {
            const CoreSeparation now = separation_at(out.time);
            if (now.value <= pair_.noise()) {
                out.doubt = 2.0 * pair_.noise() / out.rate;
                return count > 0 ? std::optional(out) : std::nullopt;
            }
            out.normal = now.normal;
            out.rate = -dot(now.normal, pair_.velocity());
            if (!(out.rate > 0.0)) {
                return {};
            }
            out.time += (now.value - 0.5 * pair_.noise()) / out.rate;
        }
        return {};
    }

    /// Within the slack the line neither enters nor leaves by this facet.
    [[nodiscard]] bool slides(const Limit& at, RayEnd end) const {
        const double reach = pair_.reach();
        const double turn = turn_of(pair_, at.width);
        const double gap_slack =
            std::min(pair_.noise() + turn * reach, kLargestSlack * reach) + 2.0 * kLowestError * reach;
        const double rate_slack =
            std::min(pair_.velocity_noise() + turn * pair_.speed(), kLargestSlack * pair_.speed()) +
            kPortalRateError * pair_.speed();
        const double rate = end == RayEnd::enter ? at.rate : -at.rate;
        return rate <= rate_slack && (end == RayEnd::enter ? at.gap <= gap_slack : true);
    }

    /// A facet of K with a margin, of the given numbers.
    [[nodiscard]] Limit limit_of(const Portal& portal, double margin) const {
        const Vec3 n = portal.normal;
        Limit out;
        out.normal = n;
        out.gap = portal.height - dot(n, lowest_margin(n, margin));
        out.rate = portal.rate;
        out.width = width_of(portal.corner);
        out.time = out.gap / out.rate;
        const double off =
            2.0 * margin + turn_of(pair_, out.width) * (pair_.reach() + pair_.speed() * out.time);
        out.doubt = off / std::fabs(out.rate);
        return out;
    }

    [[nodiscard]] double width_of(const VertexPair (&corner)[3]) const {
        const auto vertex = [&](VertexPair c) {
            return vertex_of(pair_.b(), c.b) - vertex_of(pair_.a(), c.a);
        };
        const Vec3 e = vertex(corner[1]) - vertex(corner[0]);
        const Vec3 f = vertex(corner[2]) - vertex(corner[0]);
        const double longest = std::max({norm(e), norm(f), norm(f - e)});
        return longest > 0.0 ? norm(cross(e, f)) / longest : 0.0;
    }

private:
    [[nodiscard]] CoreSeparation separation_at(double time) const {
        Core moved = pair_.b();
        const Vec3 way = time * pair_.velocity();
        moved.center = moved.center + way;
        moved.reach += norm(way);
        return convex_convex(pair_.a(), moved, false);
    }
    [[nodiscard]] double apart_at(double time) const { return separation_at(time).value; }

    const MovingPair& pair_;
};

/// b and all it passes until `end`, or until it has surely passed a.
Core swept(const MovingPair& pair, double end, std::vector<double>& rows) {
    const Core& b = pair.b();
    const double enough = 4.0 * pair.reach() / pair.speed();
    const Vec3 way = std::min(end, enough) * pair.velocity();
    const int count = b.points != nullptr ? b.count : 1 << b.generators;
    const auto rows_long = 2 * static_cast<std::size_t>(count);
    rows.resize(3 * rows_long);
    Core out;
    out.center = b.center + 0.5 * way;
    out.points = rows.data();
    out.count = 2 * count;
    for (std::size_t i = 0; i < rows_long; ++i) {
        const int vertex = static_cast<int>(i) % count;
        const Vec3 v = vertex_of(b, vertex) - b.center + (static_cast<int>(i) < count ? -0.5 : 0.5) * way;
        rows[i] = v.x;
        rows[rows_long + i] = v.y;
        rows[2 * rows_long + i] = v.z;
    }
    out.reach = b.reach + norm(way);
    return out;
}

/// Normal and closing speed, correctly rounded.
void set_normal(ExactRay& ray, RayEnd end, bool at_start, PolytopeContact& out) {
    const auto speeds = [&]<class N>() { return ray.velocity<N>(0) - ray.velocity<N>(1); };
    if (ray.ordinary() && ray.inside() && ray.pierces(end)) {
        const VectorOf<Enclosed> n = ray.direction<Enclosed>(end);
        if (round_unit(n, out.normal) &&
            round_component(n, speeds.operator()<Enclosed>(), out.closing_speed)) {
            return;
        }
    }
    const VectorOf<Exact> n = contact_normal(ray, end, at_start);
    round_unit(n, out.normal);
    round_component(n, speeds.operator()<Exact>(), out.closing_speed);
}

}  // namespace

ExactPolytopeContactSolver::ExactPolytopeContactSolver(std::size_t most_a, std::size_t most_b)
    : pair_(most_a, most_b) {}

PolytopeContact ExactPolytopeContactSolver::solve(const MovingBody& a, const MovingBody& b, double t_max,
                                                  bool contact_set) {
    pair_.load(a, b);
    const LineCast cast = cast_line(pair_.a(), pair_.b(), pair_.velocity());
    if (surely_never(pair_, cast, t_max, 0.0)) {
        return never(true, Rung::filter);
    }
    const ExactAndRough body_a{a.body, pair_.a()};
    const ExactAndRough body_b{b.body, pair_.b()};
    ExactRay ray(body_a, body_b, a.velocity, b.velocity, pair_.ordinary());
    PolytopeContact out = literal_contact(pair_, ray, cast, t_max);
    if (out.status == ContactStatus::overlapping) {
        if (contact_set) {
            out.points = points_.overlapping(ray);
        }
    } else if (out.status != ContactStatus::never) {
        const bool at_start = out.status == ContactStatus::touching;
        // Bodies that touch now do so where the line enters, or leaves, or in a wall.
        const bool enters = !at_start || ray.compare(RayEnd::enter, 0.0) == 0;
        const RayEnd end = enters || !ray.inside() ? RayEnd::enter : RayEnd::leave;
        if (contact_set) {
            out.points = points_.touching(ray, end, at_start);
        }
        set_normal(ray, end, at_start, out);
    }
    out.rung = ray.rung();
    return out;
}

PolytopeContactSolver::PolytopeContactSolver(std::size_t most_a, std::size_t most_b)
    : pair_(most_a, most_b) {}

PolytopeContact PolytopeContactSolver::solve(const MovingBody& a, const MovingBody& b, double t_max,
                                             bool contact_set) {
    pair_.load(a, b);
    const LineCast cast = cast_line(pair_.a(), pair_.b(), pair_.velocity());
    if (surely_never(pair_, cast, t_max, pair_.noise())) {
        return never(true, Rung::filter);
    }
    PolytopeContact out;
    double width = pair_.reach();
    double moment = 0.0;
    if (const auto plain = plain_contact(pair_, cast, t_max)) {
        out = *plain;
        if (out.status == ContactStatus::will_touch) {
            moment = cast.enter.height / cast.enter.rate;
            width = contact_set ? Nearly(pair_).width_of(cast.enter.corner) : width;
        }
    } else {
        out = doubtful_contact(cast, t_max, moment, width);
    }
    if (contact_set && out.status != ContactStatus::never) {
        add_points(moment, width, out);
    }
    return out;
}

PolytopeContact contact_of(const BoxMotion& motion, double t_max) {
    PolytopeContact out = never(true, motion.wide ? Rung::wide : Rung::filter);
    if (motion.verdict == BoxMotion::Verdict::never) {
        return out;
    }
    out.last_time = std::min(motion.last_time, t_max);
    if (motion.verdict == BoxMotion::Verdict::overlapping) {
        out.status = ContactStatus::overlapping;
        out.time = out.time_lower = out.time_upper = 0.0;
        return out;
    }
    out.status = ContactStatus::will_touch;
    out.time = motion.time;
    out.time_lower = motion.time_lower;
    out.time_upper = motion.time_upper;
    out.normal = motion.normal;
    out.closing_speed = motion.closing_speed;
    return out;
}

PolytopeContact PolytopeContactSolver::solve(const MovingBody& a, const MovingBody& b, double t_max,
                                             const BoxMotion& known) {
    PolytopeContact out = contact_of(known, t_max);
    const bool touches = out.status == ContactStatus::will_touch;
    if (known.lone) {
        lone_ = known.point;
        out.points = {&lone_, 1};
        return out;
    }
    const double width = touches ? width_of(known) : 0.0;
    if (touches && !(width > 0.0)) {
        return solve(a, b, t_max, true);
    }
    pair_.load(a, b);
    add_points(out.time, width, out);
    return out;
}

void PolytopeContactSolver::add_points(double moment, double width, PolytopeContact& out) {
    const double reach = pair_.reach();
    const double rounding = 2.0 * kLowestError * reach;
    if (out.status == ContactStatus::overlapping) {
        out.points = points_.overlapping(pair_, pair_.noise() + rounding);
        return;
    }
    // Noise turns the plane, and it shifts the time, hence the place.
    ContactSlack slack{};
    slack.height =
        std::min(2.0 * pair_.noise() + turn_of(pair_, width) * reach, kLargestSlack * reach) + rounding;
    const double rate = std::fabs(dot(out.normal, pair_.velocity()));
    const double shift = (pair_.noise() + rounding) * pair_.speed();
    const double limit = kLargestSlack * reach;
    const double delay = moment > 0.0 && shift < rate * limit ? shift / rate : moment > 0.0 ? limit : 0.0;
    slack.place = std::min(2.0 * pair_.noise() + delay, limit) + rounding;
    out.points = points_.touching(pair_, out.normal, moment, slack);
}

PolytopeContact PolytopeContactSolver::doubtful_contact(const LineCast& cast, double t_max, double& moment,
                                                        double& width) {
    const ExactAndRough body_a{pair_.given_a().body, pair_.a()};
    const ExactAndRough body_b{pair_.given_b().body, pair_.b()};
    ExactRay ray(body_a, body_b, pair_.given_a().velocity, pair_.given_b().velocity, pair_.ordinary());
    const PolytopeContact literal = literal_contact(pair_, ray, cast, t_max);
    const bool touches = literal.status != ContactStatus::never;
    PolytopeContact out = literal;
    const double slack = pair_.noise();
    const Seconds seconds = pair_.seconds();
    const double window = pair_.at_rest() ? 0.0 : seconds.inverse(t_max);
    const CoreSeparation start = convex_convex(pair_.a(), pair_.b(), true);
    double distance = 0.0;
    if (!touches) {
        distance = start.value;
        if (window > 0.0) {
            distance = convex_convex(pair_.a(), swept(pair_, window, scratch_), false).value;
        }
        if (distance > slack) {
            return literal;
        }
    }
    out.certain = false;
    const Nearly nearly(pair_);
    if (start.value <= slack) {
        out.status = start.value < -slack ? ContactStatus::overlapping : ContactStatus::touching;
        out.time = out.time_lower = 0.0;
        out.time_upper = touches ? literal.time_upper : 0.0;
        out.normal = out.status == ContactStatus::overlapping ? nan_vector() : start.normal;
        width = kStartWidth * pair_.reach();
    } else {
        out.status = ContactStatus::will_touch;
    }
    const auto facet = [&](RayEnd end) {
        // Of the given numbers, if they meet by way of a facet.
        Limit at;
        Vec3 n;
        const bool wide = pair_.ordinary() && round_direction(ray.direction<Enclosed>(end), n);
        if (!wide) {
            round_direction(ray.direction<Exact>(end), n);
        }
        at.normal = normalized(n);
        at.gap = lowest(pair_.b(), at.normal).value - highest(pair_.a(), at.normal).value;
        at.rate = -dot(at.normal, pair_.velocity());
        at.width = nearly.width_of(ray.feature(end).corner);
        at.time = at.gap / at.rate;
        return at;
    };
    const auto found = [&](RayEnd end) -> std::optional<Limit> {
        if (touches && ray.inside()) {
            Limit at = facet(end);
            if (!nearly.slides(at, end)) {
                at.literal = true;
                return at;
            }
        }
        const std::optional<Limit> wide = nearly.limit(end, std::max(distance, 0.0));
        return wide || end == RayEnd::leave ? wide : nearly.advance();
    };
    if (out.status == ContactStatus::will_touch) {
        std::optional<Limit> enter = found(RayEnd::enter);
        if (!enter && !touches) {
            return literal;
        }
        if (!enter) {
            // Whatever the slack would say: the given numbers meet.
            enter.emplace();
            round_unit(contact_normal(ray, RayEnd::enter, false), enter->normal);
            enter->literal = true;
        }
        out.normal = enter->normal;
        width = enter->width;
        moment = std::min(std::max(enter->time, 0.0), window);
        if (enter->literal || (touches && agree(seconds.nearest(moment), literal.time))) {
            const bool kept = literal.time >= std::numeric_limits<double>::min() && literal.time < kInfinity;
            moment = kept ? std::min(seconds.inverse(literal.time), window) : moment;
        } else {
            const double doubt = kSharp * moment + enter->doubt;
            out.time = std::min(seconds.nearest(moment), t_max);
            out.time_lower = std::min(seconds.down(std::max(moment - doubt, 0.0)), out.time);
            out.time_upper = std::max(std::min(seconds.up(moment + doubt), t_max), out.time);
            if (touches) {
                out.time = std::min(out.time, literal.time_upper);
                out.time_lower = std::min(out.time_lower, literal.time_lower);
                out.time_upper = std::max(out.time_upper, literal.time_upper);
            }
        }
    }
    if (pair_.at_rest()) {
        out.last_time = t_max;
    } else if (const std::optional<Limit> leave = found(RayEnd::leave)) {
        const double last = std::min(seconds.nearest(std::max(leave->time, 0.0)), t_max);
        const bool exact = leave->literal || (touches && agree(last, literal.last_time));
        out.last_time = std::max(exact ? literal.last_time : last, out.time);
    } else {
        out.last_time = touches ? literal.last_time : out.time;
    }
    out.closing_speed = out.status == ContactStatus::overlapping ? kNaN : closing_speed(pair_, out.normal);
    out.certain = out.status == literal.status;
    out.rung = literal.rung;
    return out;
}

}  // namespace geomsrv
