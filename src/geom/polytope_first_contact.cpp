// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
#include "geom/polytope_first_contact.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "geom/exact_ray.hpp"
#include "geom/line_cast.hpp"

namespace geomsrv {

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

PolytopeContact never(bool certain, Rung rung) {
    return {ContactStatus::never, kNaN, kNaN, kNaN, kNaN, {kNaN, kNaN, kNaN}, kNaN, {}, certain, rung};
}

/// Certainly apart at the start, by more than `margin`, and not in contact later.
bool surely_never(const MovingPair& pair, const LineCast& cast, double t_max, double margin) {
    if (cast.outcome == LineCast::Outcome::misses) {
        return cast.gap > margin;
    }
    if (cast.outcome != LineCast::Outcome::meets) {
        return false;
    }
    const Portal& enter = cast.enter;
    const Portal& leave = cast.leave;
    const double window = pair.seconds().inverse(t_max);
    return leave.lowest > margin || enter.lowest - margin > (enter.rate + enter.rate_error) * window;
}

int listed(const MovingBody& body, int vertex) { return std::min(vertex, body.body.count() - 1); }

}  // namespace

ExactPolytopeContactSolver::ExactPolytopeContactSolver(std::size_t most_a, std::size_t most_b) : pair_(most_a, most_b) {}

PolytopeContact ExactPolytopeContactSolver::solve(const MovingBody& a, const MovingBody& b, double t_max,
                                                  bool contact_set) {
    (void)contact_set;
    (void)listed;
    pair_.load(a, b);
    const LineCast cast = cast_line(pair_.a(), pair_.b(), pair_.velocity());
    if (surely_never(pair_, cast, t_max, 0.0)) {
        return never(true, Rung::filter);
    }
    const ExactAndRough body_a{a.body, pair_.a()};
    const ExactAndRough body_b{b.body, pair_.b()};
    ExactRay ray(body_a, body_b, a.velocity, b.velocity, pair_.ordinary());
    if (!ray.meets(cast)) {
        return never(true, ray.rung());
    }
    const int leave = ray.compare(RayEnd::leave, 0.0);
    const int enter = leave < 0 ? 1 : ray.compare(RayEnd::enter, 0.0);
    const bool late = enter > 0 && (pair_.at_rest() || (t_max < kInfinity && ray.compare(RayEnd::enter, t_max) > 0));
    if (leave < 0 || late) {
        return never(true, ray.rung());
    }
    PolytopeContact out = never(true, ray.rung());
    out.status = enter > 0                            ? ContactStatus::will_touch
                 : enter < 0 && leave > 0 && ray.inside() ? ContactStatus::overlapping
                                                      : ContactStatus::touching;
    const Rounding time = enter > 0 ? ray.time(RayEnd::enter) : Rounding{};
    out.time = time.nearest;
    out.time_lower = time.lower;
    out.time_upper = time.upper;
    const double last = pair_.at_rest() ? kInfinity : ray.time(RayEnd::leave).nearest;
    out.last_time = std::max(std::min(last, t_max), out.time);
    out.rung = ray.rung();
    return out;
}

PolytopeContactSolver::PolytopeContactSolver(std::size_t most_a, std::size_t most_b) : pair_(most_a, most_b) {}

PolytopeContact PolytopeContactSolver::solve(const MovingBody& a, const MovingBody& b, double t_max,
                                             bool contact_set) {
    (void)contact_set;
    pair_.load(a, b);
    const LineCast cast = cast_line(pair_.a(), pair_.b(), pair_.velocity());
    if (surely_never(pair_, cast, t_max, pair_.noise())) {
        return never(true, Rung::filter);
    }
    PolytopeContact out = never(false, Rung::filter);
    if (cast.outcome != LineCast::Outcome::meets) return out;
    if (cast.enter.lowest > 0) {
        out.status = ContactStatus::will_touch;
        out.time = pair_.seconds().nearest(cast.enter.height / cast.enter.rate);
    } else {
        out.status = ContactStatus::overlapping;
        out.time = 0.0;
    }
    out.certain = true;
    out.last_time = pair_.seconds().nearest(cast.leave.height / cast.leave.rate);
    return out;
}

}  // namespace geomsrv
