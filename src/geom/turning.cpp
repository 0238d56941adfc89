// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
// Conservative advancement (Mirtich 1996, Zhang et al. 2006) along a direction that turns with the bodies.
//
// At time t the nearest points give a direction n along which the bodies are apart.  It is let turn like the
// feature it stands on, n(s) = R(spin s) n: a face's normal stays one, and that of two crossing edges too.
// The height of a vertex along n(s), at time t + s, is bounded by its value h, its rate h', its curvature h''
// and a bound J on how fast that changes: for s <= S
//
//     gap(s) >= L(s) = min over b (h + s h' + s^2 / 2 min(h'' - J S, 0))
//                    - max over a (h + s h' + s^2 / 2 max(h'' + J S, 0))
//
// L is concave, so where it is positive at 0 and at s it is positive between: the bodies are apart until
// t + s.  No contact is stepped over, however fast or thin the bodies are.  Near contact the steps converge
// quadratically; a direction that stood still would lose the rate at which a face turns.
//
// Contact is proven by a simplex of the difference b - a that holds the origin inside by more than rounding,
// or by the intermediate value theorem: a facet of the difference has the origin on one side now and on the
// other later, and the foot of the origin inside all the time in between.
//
// Doubles decide, with bounds for all they round; where gap or step drown in those, double-double does.
#include "geom/turning.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <span>

#include "geom/growing_hull.hpp"
#include "geom/rounding.hpp"

namespace geomsrv {

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// Looks at one pair; each takes a microsecond or less.
constexpr int kMostLooks = 1 << 16;

// Balls about the centres further apart than this times the sum of their radii: no need to look at the
// bodies.
constexpr double kFar = 2.0;

// Where bodies are further apart than this share of their size, the next look starts from the feature seen;
// nearer, from the direction that is expected, which is the better one where the feature drowns in rounding.
constexpr double kFarEnough = 0x1p-20;

// Heights of vertices along a unit direction and their least and largest, in doubles: products and sums of
// three terms, no longer than the size of the pair, 8 u for each body.
constexpr double kHeightError = 16 * kUnitRoundoff;

// Rates likewise, of vectors that take up to 10 roundings themselves.
constexpr double kRateError = 32 * kUnitRoundoff;

// What heights in double-double round besides their vertices: a dot product and a difference for each body.
constexpr double kWideHeightError = 0x1p-96;

// Bounds on third derivatives: products and sums of positive numbers, less than 16 roundings, and a unit
// vector good to 4 u.
constexpr double kJoltSlack = 1.0 + 32 * kUnitRoundoff;

// A step in doubles is left to double-double where rounding takes more than this of the gap.
constexpr double kGapShare = 0x1p-5;

// How much a root of a piece of L is shortened, so that L is positive there in spite of rounding.
constexpr double kShortened[] = {0x1p-20, 0x1p-12, 0x1p-8, 0x1p-4, 0x1p-2, 0x1p-1};

// Contact is looked for where the step to come is expected to take no more than this part of the tolerance,
// and first at so many such steps ahead: after contact, but not long after.
constexpr double kStepsAhead = 4.0;
constexpr double kFurtherAhead = 8.0;
constexpr int kTries = 12;      // before the last one, at the tolerance
constexpr int kLateTries = 40;  // beyond the tolerance, each twice as far, if there is no step at all
constexpr int kCrossings = 3;   // tries at proving contact by the intermediate value theorem

// Where the bodies may be off by more than they come in a tolerance, contact is proven later: to this share
// of the time since it became possible, which doubles after so many looks, and with so many in all.
constexpr double kLateShare = 0x1p-5;
constexpr int kLooksAtShare = 16;
constexpr int kLateLooks = 128;

// 2 pi, rounded up; a period takes four more roundings.
constexpr double kTwoPi = 0x1.921fb54442d19p+2;
constexpr double kPeriodSlack = 1.0 + 8 * kUnitRoundoff;

// Where the origin lies on an edge or a face of a simplex of the difference, as it does between bodies that
// stand on one floor, no simplex holds it by a margin.  If the corners of a small simplex about it are
// inside, so is the origin.  Its size is a share of that of the pair: beyond rounding, but less than the
// bodies overlap.
constexpr double kCornerShares[] = {0x1p-36, 0x1p-26, 0x1p-16};
constexpr Vec3 kCorners[] = {{1.0, 0.3, 0.2}, {-0.7, 0.8, 0.3}, {-0.4, -0.9, 0.4}, {0.1, -0.2, -1.0}};
constexpr Vec3 kFlatCorners[] = {{1.0, 0.3, 0.0}, {-0.7, 0.8, 0.0}, {-0.4, -0.9, 0.0}};

// What two bodies share when they touch is looked for where they are just before, to within the way that any
// point of one comes as seen from the other until then, and what rounds: two vertices and two supports, each
// as far off as is known of one height.
constexpr double kBandRounding = 4.0;

// What is found may be as far beyond an edge, seen along the normal, and there as far from the body.
constexpr double kBandApart = 2.0;

// A face may lean by as much as both bodies turn meanwhile, over no more than twice its reach; and where it
// goes on beyond what touches, as far again or three times as far, it falls off by as many times the way.
constexpr double kBandTurn = 2.0;
constexpr double kBandLean = 4.0;

Vec3 unit_or(Vec3 v, Vec3 other) { return norm(v) > 0.0 ? normalized(v) : other; }

/// Whether two vectors certainly have the same length: the same coordinates but for order and sign.
bool same_length(Vec3 a, Vec3 b) {
    double x[] = {std::fabs(a.x), std::fabs(a.y), std::fabs(a.z)};
    double y[] = {std::fabs(b.x), std::fabs(b.y), std::fabs(b.z)};
    std::ranges::sort(x);
    std::ranges::sort(y);
    return std::ranges::equal(x, y);
}

/// t + step, rounded down.
double later(double t, double step) {
    const DoubleDouble sum = two_sum(t, step);
    return sum.lo < 0.0 ? next_down(sum.hi) : sum.hi;
}

WideVec3 times(WideVec3 v, double t) { return {v.x * t, v.y * t, v.z * t}; }

double triple(Vec3 x, Vec3 y, Vec3 z) { return dot(x, cross(y, z)); }

}  // namespace

struct TurningSolver::Look {
    double t = 0.0;
    WideVec3 wide_between;       ///< from the centre of a to that of b
    double between_error = 0.0;  ///< of it
    Vec3 between;
    double size = 0.0;   ///< no vertex is further from the centre of a, both bodies added
    double error = 0.0;  ///< of all vertices as stored, both bodies added
    Core a, b;
    Gjk found;
};

struct TurningSolver::Direction {
    Vec3 normal;  ///< unit
    Vec3 spin;    ///< angular velocity of the normal
    Vec3 change;  ///< of the normal: spin x normal
};

void TurningSolver::prepare(const TurningBody& a, const TurningBody& b, const TurningSlack& slack) {
    a_.body.read(a);
    b_.body.read(b);
    planar_ = a.dimension == 2;
    center_a_ = a.center;
    velocity_a_ = a.velocity;
    between_ = exact_difference(b.center, a.center);
    speed_ = exact_difference(b.velocity, a.velocity);

    // The size of the bodies becomes about 1; points take that of their distance.
    double size = a_.body.reach() + b_.body.reach();
    if (!(size > 0.0)) {
        const Vec3 d = narrow(between_);
        size = std::max({std::fabs(d.x), std::fabs(d.y), std::fabs(d.z)});
    }
    exponent_ = size > 0.0 ? -exponent_of(size) : 0;
    const PowerOfTwo by(exponent_);
    a_.body.scale(by);
    b_.body.scale(by);
    for (WideVec3* v : {&between_, &speed_}) {
        for (DoubleDouble* x : {&v->x, &v->y, &v->z}) {
            *x = {by * x->hi, by * x->lo};
        }
    }
    velocity_ = narrow(speed_);
    // The sums of what may be off round, too.
    slack_ = {by * slack.margin, by * slack.uncertainty * (1.0 + kHeightError),
              by * slack.drift * (1.0 + kHeightError)};
    for (Side* side : {&a_, &b_}) {
        side->height.resize(side->body.size());
        side->rate.resize(side->body.size());
        side->bend.resize(side->body.size());
    }
}

/// From when on everything repeats itself; infinite if that is not known.
double TurningSolver::end_of_period() const {
    const Vec3 w = a_.body.angular();
    const Vec3 v = b_.body.angular();
    const auto is_zero = [](Vec3 x) { return x.x == 0.0 && x.y == 0.0 && x.z == 0.0; };
    if (!is_zero(velocity_) || slack_.drift > 0.0) {
        return kInfinity;
    }
    double rate = 0.0;
    if (is_zero(w) || is_zero(v)) {
        rate = a_.body.speed() + b_.body.speed();
    } else if (same_length(w, v)) {
        rate = a_.body.speed();  // each of them repeats itself, whatever its axis
    } else if (is_zero(narrow(between_)) && w.x == 0.0 && w.y == 0.0 && v.x == 0.0 && v.y == 0.0) {
        rate = std::fabs(v.z - w.z);  // about one axis
    }
    return kTwoPi / rate * kPeriodSlack;
}

void TurningSolver::place(Look& at) const {
    at.wide_between = between_ + times(speed_, at.t);
    at.between = narrow(at.wide_between);
    at.between_error = 8 * kWideRoundoff * (norm(narrow(between_)) + norm(velocity_) * at.t);
}

TurningSolver::Look TurningSolver::look(double t, Vec3 start) {
    ++looks_;
    Look at;
    at.t = t;
    place(at);
    a_.body.place(t);
    b_.body.place(t);
    at.a = a_.body.core();
    at.b = b_.body.core();
    at.b.center = at.between;
    const double away = norm(at.between);
    at.b.reach += away;
    at.size = at.a.reach + at.b.reach + slack_.margin;
    at.error = at.a.error + at.b.error + kUnitRoundoff * away + at.between_error + vague(t);
    at.found = gjk(at.a, at.b, start, seen_);
    const bool far = at.found.state == GjkState::apart && at.found.gap > kFarEnough * at.size;
    seen_ = far ? at.found.witness : Witness{};
    return at;
}

/// How long the bodies certainly stay apart along a direction that stands still.  For each of them the faster
/// of two bounds counts: its vertices move no faster than w r, and never leave the ball about its centre.
double TurningSolver::coarse_step(const Look& at, Vec3 normal) const {
    const double error = at.error + kHeightError * at.size + slack_.margin;
    const double closing = kRateError * norm(velocity_) - dot(normal, velocity_) + slack_.drift;
    const double middle = dot(normal, at.between);
    const auto sweep = [&](const TurningVertices& body) {
        return (norm(cross(normal, body.angular())) + kRateError * body.speed()) * body.reach();
    };
    const double tops[] = {highest(at.a, normal).value, at.a.reach};
    const double bottoms[] = {lowest(at.b, normal).value, middle - b_.body.reach() * (1.0 + kPlaceError)};
    const double rates_a[] = {sweep(a_.body), 0.0};
    const double rates_b[] = {sweep(b_.body), 0.0};
    double step = 0.0;
    for (const int i : {0, 1}) {
        for (const int j : {0, 1}) {
            const double gap = bottoms[j] - tops[i] - error;
            const double rate = closing + rates_a[i] + rates_b[j];
            if (gap > 0.0) {
                step = std::max(step, rate > 0.0 ? gap / rate * (1.0 - kHeightError) : kInfinity);
            }
        }
    }
    return step;
}

/// A direction that turns so that all vertices of a feature of the difference keep the same height.
TurningSolver::Direction TurningSolver::direction_of(const Witness& feature, Vec3 normal) const {
    Direction out{normal, {}, {}};
    if (feature.count < 2 || feature.count > 3) {
        return out;
    }
    Vec3 edge[2];
    double wanted[2];  // change . edge
    const Vec3 a0 = a_.body.placed(static_cast<std::size_t>(feature.a[0]));
    const Vec3 b0 = b_.body.placed(static_cast<std::size_t>(feature.b[0]));
    for (int i = 1; i < feature.count; ++i) {
        const Vec3 p = a_.body.placed(static_cast<std::size_t>(feature.a[i])) - a0;
        const Vec3 q = b_.body.placed(static_cast<std::size_t>(feature.b[i])) - b0;
        edge[i - 1] = q - p;
        wanted[i - 1] = -dot(normal, cross(b_.body.angular(), q) - cross(a_.body.angular(), p));
    }
    Vec3 change;
    const double ee = dot(edge[0], edge[0]);
    if (feature.count == 2) {
        change = (wanted[0] / ee) * edge[0];
    } else {
        const double ff = dot(edge[1], edge[1]);
        const double ef = dot(edge[0], edge[1]);
        const double determinant = ee * ff - ef * ef;
        change = ((wanted[0] * ff - wanted[1] * ef) / determinant) * edge[0] +
                 ((wanted[1] * ee - wanted[0] * ef) / determinant) * edge[1];
    }
    const Vec3 spin = cross(normal, change);
    if (norm(spin) < kInfinity) {  // false for NaN, too: repeated vertices span nothing
        out.spin = spin;
        out.change = cross(spin, normal);
    }
    return out;
}

/// The longest step found at the end of which L is positive, at most `longest`; heights are known to
/// `gap_error`.
double TurningSolver::fine_step(const Look& at, const Direction& direction, double gap_error,
                                double longest) const {
    const double spin = norm(direction.spin);
    const double turning_a = spin + a_.body.speed();
    const double turning_b = spin + b_.body.speed();
    const double turning = std::max(turning_a, turning_b);
    const double speed = norm(velocity_);
    const double error = at.error + kRateError * at.size;
    const double rate_error = 2.0 * turning * error + kRateError * speed + slack_.drift;
    const double bend_error = 2.0 * turning * turning * error + kRateError * turning * speed;
    // What turns by two angles at once has a third derivative of no more than the sum of the rates, cubed.
    const double jolt_a = kJoltSlack * turning_a * turning_a * turning_a * at.a.reach;
    const double jolt_b = kJoltSlack * (turning_b * turning_b * turning_b * b_.body.reach() +
                                        spin * spin * (spin * norm(at.between) + 3.0 * speed));

    double span = 0.0;  // steps are no longer than this
    struct Piece {
        double value, gap, rate, bend;
    };
    // L, and of the vertices that make it gap, rate at which that closes, and curvature.
    const auto bound = [&](double s) -> Piece {
        const double slack_a = jolt_a * span + bend_error;
        const double slack_b = jolt_b * span + bend_error;
        std::size_t low = 0;
        std::size_t top = 0;
        double least = kInfinity;
        double most = -kInfinity;
        for (std::size_t j = 0; j < b_.height.size(); ++j) {
            const double bend = std::min(b_.bend[j] - slack_b, 0.0);
            const double value = b_.height[j] + s * (b_.rate[j] + 0.5 * s * bend);
            low = value < least ? j : low;
            least = value < least ? value : least;
        }
        for (std::size_t i = 0; i < a_.height.size(); ++i) {
            const double bend = std::max(a_.bend[i] + slack_a, 0.0);
            const double value = a_.height[i] + s * (a_.rate[i] + 0.5 * s * bend);
            top = value > most ? i : top;
            most = value > most ? value : most;
        }
        return {least - most - (gap_error + s * rate_error), b_.height[low] - a_.height[top] - gap_error,
                a_.rate[top] - b_.rate[low] + rate_error,
                std::max(a_.bend[top] + slack_a, 0.0) - std::min(b_.bend[low] - slack_b, 0.0)};
    };
    if (!(bound(0.0).value > 0.0)) {
        return 0.0;
    }
    double s = longest;
    if (turning > 0.0) {
        s = std::min(s, 1.0 / turning);  // beyond, the curvature of a circle has little to do with its arc
    }
    if (!(s < kInfinity)) {
        // Nothing turns: any pair of vertices that come nearer bounds the step.
        double fastest = 0.0;
        double gap = 0.0;
        for (std::size_t i = 0; i < a_.height.size(); ++i) {
            for (std::size_t j = 0; j < b_.height.size(); ++j) {
                const double rate = a_.rate[i] - b_.rate[j] + rate_error;
                if (rate > fastest) {
                    fastest = rate;
                    gap = b_.height[j] - a_.height[i];
                }
            }
        }
        if (!(fastest > 0.0)) {
            return kInfinity;
        }
        s = gap / fastest;
    }

    // The shorter the steps allowed, the less their curvature may change.
    double found = 0.0;
    for (int round = 0; round < 2; ++round) {
        span = s;
        double step = 0.0;
        for (const double part : kShortened) {
            const Piece piece = bound(s);
            if (piece.value > 0.0) {
                step = s;
                break;
            }
            const double root = std::sqrt(piece.rate * piece.rate + 2.0 * piece.bend * piece.gap);
            const double next =
                piece.rate > 0.0 ? 2.0 * piece.gap / (piece.rate + root) : (root - piece.rate) / piece.bend;
            s = (next < s ? next : s) * (1.0 - part);
        }
        found = std::max(found, step);
        if (!(found < 0.5 * span)) {
            break;
        }
        s = 2.0 * found;
    }
    return found;
}

/// Of all vertices height, rate and curvature, in doubles.
void TurningSolver::measure(const Look& at, const Direction& direction) {
    // (n . y)'' = n'' . y + 2 n' . y' + n . y'',  n' = spin x n,  y' = w x y,  as a product with y.
    const Vec3 n = direction.normal;
    const Vec3 bent = cross(direction.spin, direction.change);
    const auto fill = [&](Side& side, double height, double rate, double bend) {
        const Vec3 w = side.body.angular();
        const Vec3 across = cross(n, w);
        const Vec3 first = direction.change + across;
        const Vec3 second = bent + 2.0 * cross(direction.change, w) + cross(across, w);
        const std::size_t count = side.body.size();
        const double* x = side.body.coordinates();
        const double* y = x + count;
        const double* z = y + count;
        for (std::size_t i = 0; i < count; ++i) {
            side.height[i] = height + (n.x * x[i] + n.y * y[i] + n.z * z[i]);
            side.rate[i] = rate + (first.x * x[i] + first.y * y[i] + first.z * z[i]);
            side.bend[i] = bend + (second.x * x[i] + second.y * y[i] + second.z * z[i]);
        }
    };
    fill(a_, 0.0, 0.0, 0.0);
    fill(b_, dot(n, at.between), dot(direction.change, at.between) + dot(n, velocity_),
         dot(bent, at.between) + 2.0 * dot(direction.change, velocity_));
}

/// A fine step from heights in double-double, along the normal of a feature.
double TurningSolver::wide_step(const Look& at, const Witness& feature, double longest,
                                Direction& direction) {
    if (feature.count < 1 || feature.count > 3) {
        return 0.0;
    }
    a_.body.turn_wide(at.t);
    b_.body.turn_wide(at.t);
    const auto a = [&](int i) { return a_.body.placed_wide(static_cast<std::size_t>(feature.a[i])); };
    const auto b = [&](int i) { return b_.body.placed_wide(static_cast<std::size_t>(feature.b[i])); };
    const auto edge = [&](int i) { return (b(i) - b(0)) - (a(i) - a(0)); };
    WideVec3 n = widen(at.found.normal);
    if (feature.count == 2) {
        const WideVec3 e = edge(1);
        n = n - (dot(n, e) / dot(e, e)) * e;
    } else if (feature.count == 3) {
        n = cross(edge(1), edge(2));
        if (dot(narrow(n), at.found.normal) < 0.0) {
            n = -n;
        }
    }
    const double length = norm(narrow(n));
    if (!(length > 0.0)) {
        return 0.0;
    }
    n = times(n, 1.0 / length);

    direction = direction_of(feature, narrow(n));
    measure(at, direction);
    const DoubleDouble level = dot(n, a(0));
    for (std::size_t i = 0; i < a_.height.size(); ++i) {
        a_.height[i] = (dot(n, a_.body.placed_wide(i)) - level).hi;
    }
    const DoubleDouble center = dot(n, at.wide_between) - level;
    for (std::size_t j = 0; j < b_.height.size(); ++j) {
        b_.height[j] = (dot(n, b_.body.placed_wide(j)) + center).hi;
    }
    const double error =
        a_.body.wide_error(at.t) + b_.body.wide_error(at.t) + at.between_error + kWideHeightError * at.size;
    // A margin rounds like the heights that are compared with it.
    return fine_step(at, direction, error + vague(at.t) + slack_.margin * (1.0 + kHeightError), longest);
}

/// Whether a simplex of the difference, with b shifted a little, certainly holds the origin inside.
bool TurningSolver::overlap(const Look& at, Vec3 shift) const {
    const Witness& w = at.found.witness;
    if (slack_.margin > 0.0 && at.found.length + kMemberError * at.size + at.error < slack_.margin) {
        return true;
    }
    if (w.count != (planar_ ? 3 : 4)) {
        return false;
    }
    Vec3 k[4];
    double length[4];
    for (int i = 0; i < w.count; ++i) {
        k[i] = at.between + shift + b_.body.placed(static_cast<std::size_t>(w.b[i])) -
               a_.body.placed(static_cast<std::size_t>(w.a[i]));
        length[i] = norm(k[i]);
    }
    const double error = 2.0 * (at.error + kHeightError * at.size);
    // The origin is a sum of the vertices with these determinants as weights.
    int positive = 0;
    int negative = 0;
    const auto count = [&](double value, double doubt) {
        positive += value > doubt ? 1 : 0;
        negative += value < -doubt ? 1 : 0;
    };
    if (planar_) {
        for (int i = 0; i < 3; ++i) {
            const int j = (i + 1) % 3;
            count(k[i].x * k[j].y - k[i].y * k[j].x,
                  error * (length[i] + length[j]) + kHeightError * length[i] * length[j]);
        }
    } else {
        constexpr int kOthers[4][3] = {{1, 2, 3}, {0, 3, 2}, {0, 1, 3}, {0, 2, 1}};
        for (const auto& o : kOthers) {
            const double x = length[o[0]];
            const double y = length[o[1]];
            const double z = length[o[2]];
            count(triple(k[o[0]], k[o[1]], k[o[2]]),
                  error * (x * y + y * z + z * x) + kRateError * x * y * z);
        }
    }
    return positive == w.count || negative == w.count;
}

/// The bodies at time t, and whether they certainly overlap then.
bool TurningSolver::overlap_at(double t, Vec3 start, Look& at) {
    at = look(t, start);
    const bool inside = overlap(at, {});
    if (inside || at.found.length > at.error + kHeightError * at.size) {
        return inside;
    }
    Look near = at;
    const std::span<const Vec3> corners = planar_ ? std::span<const Vec3>(kFlatCorners) : kCorners;
    return std::ranges::any_of(kCornerShares, [&](double share) {
        return std::ranges::all_of(corners, [&](Vec3 corner) {
            const Vec3 shift = share * at.size * corner;
            near.b.center = at.b.center + shift;
            near.found = gjk(near.a, near.b, start);
            return overlap(near, shift);
        });
    });
}

/// No point of b comes further, as seen from any of a, within a span of time.
double TurningSolver::way(double span) const {
    const double speed =
        norm(velocity_) + a_.body.speed() * a_.body.reach() + b_.body.speed() * b_.body.reach();
    return (speed * span) * (1.0 + kRateError);
}

/// Whether the origin certainly passes through a facet of the difference between the time of the look and t.
bool TurningSolver::crossing(const Look& at, const Witness& feature, double t) {
    const int count = planar_ ? 2 : 3;
    if (feature.count != count || slack_.margin > 0.0) {
        return false;
    }
    WideVec3 k[2][3];  // now and later
    double error = kWideHeightError * at.size;
    const double times_of[] = {at.t, t};
    for (const int when : {0, 1}) {
        Look then;
        then.t = times_of[when];
        place(then);
        a_.body.turn_wide(then.t);
        b_.body.turn_wide(then.t);
        for (int i = 0; i < count; ++i) {
            k[when][i] = then.wide_between + b_.body.placed_wide(static_cast<std::size_t>(feature.b[i])) -
                         a_.body.placed_wide(static_cast<std::size_t>(feature.a[i]));
        }
        error = std::max(error, a_.body.wide_error(then.t) + b_.body.wide_error(then.t) + then.between_error +
                                    kWideHeightError * at.size + vague(then.t));
    }
    const double moved = way(t - at.t) + error;  // any vertex meanwhile
    Vec3 now[3];
    double furthest = 0.0;
    for (int i = 0; i < count; ++i) {
        now[i] = narrow(k[0][i]);
        furthest = std::max(furthest, norm(now[i]));
    }
    furthest += moved;

    // Weights of the foot of the origin, times |normal|^2, and how much they may change: products of `count`
    // factors more than the facet has, each no longer than twice the furthest.
    if (planar_) {
        const Vec3 e = now[1] - now[0];
        const double doubt = 4.0 * furthest * moved + kRateError * furthest * furthest;
        if (!(dot(e, now[1]) > doubt && -dot(e, now[0]) > doubt)) {
            return false;
        }
    } else {
        const Vec3 normal = cross(now[1] - now[0], now[2] - now[0]);
        const double cube = furthest * furthest * furthest;
        const double doubt = 16.0 * cube * moved + 8.0 * kRateError * cube * furthest;
        for (int i = 0; i < 3; ++i) {
            if (!(dot(normal, cross(now[(i + 1) % 3], now[(i + 2) % 3])) > doubt)) {
                return false;
            }
        }
    }
    const auto side = [&](const WideVec3* v) {
        const double value =
            planar_ ? (v[0].x * v[1].y - v[0].y * v[1].x).hi : dot(v[0], cross(v[1], v[2])).hi;
        const double doubt =
            planar_ ? 4.0 * furthest * error + kWideHeightError * furthest * furthest
                    : 6.0 * furthest * furthest * error + kWideHeightError * furthest * furthest * furthest;
        return value > doubt ? 1 : value < -doubt ? -1 : 0;
    };
    return side(k[0]) * side(k[1]) < 0;
}

/// A time at or before which contact is proven; not later than a tolerance after the step, unless there is
/// none.  Infinity if nothing is found.
double TurningSolver::proven_contact(const Look& at, const Witness& feature, double step, double expected,
                                     double t_max, double tolerance) {
    const double lower = later(at.t, step);
    const bool stuck = !(lower > at.t);
    const double last = std::min(std::max(later(lower, tolerance), next_up(lower)), t_max);
    const Vec3 start = at.found.normal;
    double ahead = std::max(kStepsAhead * expected, next_up(lower) - lower);
    int late = 0;
    for (int i = 0;; ++i, ahead *= kFurtherAhead) {
        double t = i < kTries ? std::min(lower + ahead, last) : last;
        if (!(t < last) && late > 0) {
            // Too late for the tolerance, but better than nothing; a tolerance may be far less than an ulp.
            t = std::min(lower + std::ldexp(std::max(tolerance, last - lower), late), t_max);
        }
        if (t > lower) {
            Look then;
            if (overlap_at(t, start, then) || ((i < kCrossings || t == last) && crossing(at, feature, t))) {
                return t;
            }
        }
        if (!(t < last) && (!stuck || !(t < t_max) || ++late > kLateTries)) {
            return kInfinity;
        }
    }
}

/// Whether the bodies may be off by more than they come in a tolerance.  What is apart by that much at first
/// and overlaps by it at last has come twice as far, so no contact is proven within the tolerance.
bool TurningSolver::unsure(double t, double tolerance) const { return 2.0 * vague(t) > tolerance * way(1.0); }

/// By how much all bodies that the slack allows certainly overlap, > 0; otherwise, negated, what is missing.
/// The difference b - a holds a ball about the origin as large as the depth, and so does every other one less
/// what its supports may be off by.
double TurningSolver::certain_depth(const Look& at) {
    const double rounding = kMemberError * at.size;
    double depth = -(at.found.length + rounding);
    // Across their plane, planar bodies are never further apart than that.
    if (at.found.state != GjkState::apart || at.found.length <= rounding) {
        Core a = at.a;
        if (planar_) {
            // With upright walls; those of the difference are as deep as its edges, its ends by the size.
            prism_.clear();
            for (const int row : {0, 0, 1, 1}) {
                const double* from = a.points + static_cast<std::ptrdiff_t>(row) * a.count;
                prism_.insert(prism_.end(), from, from + a.count);
            }
            for (const double height : {-at.size, at.size}) {
                prism_.insert(prism_.end(), static_cast<std::size_t>(a.count), height);
            }
            a.points = prism_.data();
            a.count *= 2;
            a.reach += at.size;
        }
        const bool seeded = !planar_ && at.found.state == GjkState::enclosed;
        const NearestFacet facet = nearest_facet(a, at.b, seeded ? at.found.witness : Witness{});
        if (!facet.flat && facet.upper < 0.0) {
            depth = std::max(depth, -facet.upper);
        }
    }
    return depth + slack_.margin - (at.error + kHeightError * at.size);
}

/// The first time from `lower` on at or before which contact is proven of all bodies that the slack allows,
/// to kLateShare of the time since; infinity if none is found until `end`.
double TurningSolver::certain_contact(const Look& at, const Witness& feature, double lower, double end,
                                      double tolerance) {
    // Signed distances change no faster than this: what is missing takes its time.
    const double speed = way(1.0);
    double t = lower;
    double before = lower;  // no proof is expected sooner
    double share = kLateShare;
    int tries = 0;
    const auto proven = [&](double when) {
        const double depth = certain_depth(look(when, at.found.normal));
        before = depth > 0.0 ? before : later(when, -depth / speed);
        return depth > 0.0 || (++tries <= kCrossings && crossing(at, feature, when));
    };
    for (int i = 1; !proven(t); ++i) {
        share = i % kLooksAtShare == 0 ? 2.0 * share : share;
        const double least = std::max(t + std::max(share * (t - lower), kLateShare * tolerance), next_up(t));
        const double next = std::min(std::max(before, least), end);
        if (i == kLateLooks || !(next > t) || !(next < kInfinity) || !a_.body.placeable(next) ||
            !b_.body.placeable(next) || !(norm(narrow(between_)) + way(next) < kLargestReach)) {
            return kInfinity;
        }
        t = next;
    }
    while (t - before > kLateShare * std::max(t - lower, tolerance)) {
        const double middle = before + 0.5 * (t - before);
        if (!(middle > before) || !(middle < t)) {
            break;
        }
        if (proven(middle)) {
            t = middle;
        } else {
            before = std::max(before, middle);
        }
    }
    return t;
}

Vec3 TurningSolver::in_world(Vec3 point, double t) const {
    const PowerOfTwo down(-exponent_);
    return center_a_ + (t * velocity_a_ + down * point);
}

/// Across a feature of the difference, on the side of a normal that is less certain.
Vec3 TurningSolver::normal_of(const Look& at, const Witness& feature, Vec3 normal) const {
    const auto corner = [&](int i) {
        return b_.body.placed(static_cast<std::size_t>(feature.b[i])) -
               a_.body.placed(static_cast<std::size_t>(feature.a[i])) + at.between;
    };
    Vec3 n = normal;
    if (feature.count == 2) {
        const Vec3 e = corner(1) - corner(0);
        n = normal - (dot(normal, e) / dot(e, e)) * e;
    } else if (feature.count == 3) {
        const Vec3 first = corner(0);
        n = cross(corner(1) - first, corner(2) - first);
    }
    const double length = norm(n);
    if (!(length > 0.0) || !(length < kInfinity)) {
        return normal;
    }
    return (dot(n, normal) < 0.0 ? -1.0 / length : 1.0 / length) * n;
}

/// What the bodies share that are seen just before they touch, within a span of time in which their points
/// come no further than `near`; seen along each of the normals.
void TurningSolver::find_points(const Look& at, std::span<const Vec3> normals, Vec3 middle, double near,
                                double span, TurningContact& out) {
    ContactBand band{};
    band.near = near;
    band.margin = slack_.margin;
    band.apart = slack_.margin + kBandApart * near;
    const double turned = kBandTurn * (a_.body.speed() + b_.body.speed()) * span;
    band.wide[0] = kBandLean * near + turned * a_.body.reach();
    band.wide[1] = kBandLean * near + turned * b_.body.reach();
    points_.clear();
    for (const Vec3 point : contact_.between(at.a, at.b, normals, middle, band)) {
        points_.push_back(in_world(point, at.t));
    }
    if (planar_ && points_.size() == 2) {
        // Counter-clockwise around a.
        const Vec3 along = points_[1] - points_[0];
        if (out.normal.x * along.y - out.normal.y * along.x < 0.0) {
            std::swap(points_[0], points_[1]);
        }
    }
    out.points = points_;
}

TurningContact TurningSolver::search(const TurningBody& a, const TurningBody& b, double t_max,
                                     double tolerance, const TurningSlack& slack, bool contact_set) {
    prepare(a, b, slack);
    looks_ = 0;
    seen_ = {};
    const double end = std::min(t_max, end_of_period());
    const double near = kFar * (a_.body.reach() + b_.body.reach());
    TurningContact out;
    out.normal = out.point = nan_vector();
    out.upper = kInfinity;
    const auto never = [&] {
        out.status = TurningStatus::never;
        out.lower = out.upper = std::numeric_limits<double>::quiet_NaN();
        out.normal = out.point = nan_vector();
        return out;
    };

    double t = 0.0;
    Vec3 start = unit_or(narrow(between_), {1.0, 0.0, 0.0});
    Witness feature;
    double last_step = 0.0;
    while (looks_ < kMostLooks && a_.body.placeable(t) && b_.body.placeable(t)) {
        Look at;
        at.t = t;
        place(at);
        const double away = norm(at.between);
        if (!(away < kLargestReach)) {
            break;
        }
        if (away > near) {
            // As balls.
            const Vec3 n = normalized(at.between);
            const double rate = kRateError * norm(velocity_) - dot(n, velocity_) + slack_.drift;
            const double gap = away * (1.0 - kHeightError) - at.between_error -
                               (0.5 * near + slack_.margin) * (1.0 + kPlaceError) - vague(t);
            const double step = !(gap > 0.0) ? 0.0
                                : rate > 0.0 ? gap / rate * (1.0 - kHeightError)
                                             : kInfinity;
            const double next = later(t, step);
            if (next >= end) {
                return never();
            }
            start = n;
            if (next > t) {
                ++looks_;
                t = next;
                continue;
            }
        }

        if (t > 0.0) {
            at = look(t, start);
        } else if (overlap_at(t, start, at) || (unsure(t, tolerance) && certain_depth(at) > 0.0)) {
            out.status = TurningStatus::overlapping;
            out.lower = out.upper = 0.0;
            out.point = in_world(0.5 * (at.found.point_a + at.found.point_b), 0.0);
            return out;
        }
        const double remaining = next_up(end - t);
        const double doubt = at.error + kHeightError * at.size;
        Direction direction{at.found.normal, {}, {}};
        double step = coarse_step(at, direction.normal);
        Witness used = at.found.witness;
        if (used.count <= 3) {
            direction = direction_of(used, direction.normal);
            measure(at, direction);
            step = std::max(step, fine_step(at, direction, doubt + slack_.margin, remaining));
        }
        if (!(doubt < kGapShare * (at.found.gap - slack_.margin)) || !(later(t, step) > t)) {
            // The feature seen now, or, where the search got lost in rounding, the last one.
            for (const Witness& candidate : {at.found.witness, feature}) {
                Direction other;
                const double wide = wide_step(at, candidate, remaining, other);
                if (wide > step) {
                    step = wide;
                    direction = other;
                    used = candidate;
                    out.rung = Rung::wide;
                }
            }
        }
        const double next = later(t, step);
        if (step > 0.0 && next >= end) {
            return never();
        }
        if (step > 0.0) {
            feature = used;
        }
        // Where steps converge quadratically, the one to come is this much shorter.
        const double shrinking = step < last_step ? step / last_step : 1.0;
        const double expected = step * shrinking * shrinking;
        last_step = step;
        if (kStepsAhead * expected <= tolerance || !(next > t)) {
            double upper = kInfinity;
            if (!unsure(next, tolerance)) {
                upper = proven_contact(at, feature, step, expected, t_max, tolerance);
            } else if (!(next > t)) {
                upper = certain_contact(at, feature, next, end, tolerance);
            }
            if (upper < kInfinity || !(next > t)) {
                const bool in_time = upper - next <= tolerance || upper == next_up(next);
                out.status = t == 0.0 && step == 0.0 ? TurningStatus::touching
                             : in_time               ? TurningStatus::will_touch
                                                     : TurningStatus::grazing;
                out.lower = next;
                out.upper = upper;
                const Vec3 predicted = unit_or(direction.normal + step * direction.change, direction.normal);
                const Look then = look(next, predicted);
                const bool seen = then.found.state == GjkState::apart && then.found.gap > 0.0;
                const double span = (in_time ? upper : next_up(next)) - next;
                const double moved = way(span) + kBandRounding * (then.error + kHeightError * then.size);
                // Where the bodies are too close to be told apart in doubles, the feature that was seen last;
                // and its point, too, should the nearest ones be lost.
                const Witness& feature_then = seen ? then.found.witness : used;
                const bool lost = !seen && !(then.found.length <= slack_.margin + moved);
                const Witness& w = lost ? used : then.found.witness;
                Vec3 middle;
                for (int i = 0; i < w.count; ++i) {
                    const Vec3 p = a_.body.placed(static_cast<std::size_t>(w.a[i]));
                    const Vec3 q = b_.body.placed(static_cast<std::size_t>(w.b[i])) + then.between;
                    middle = middle + (0.5 * w.weight[i]) * (p + q);
                }
                out.point = in_world(middle, next);
                out.normal = seen ? then.found.normal : predicted;
                if (contact_set && out.status != TurningStatus::touching) {
                    const Vec3 normals[] = {out.normal, normal_of(then, feature_then, out.normal)};
                    const bool same = normals[0].x == normals[1].x && normals[0].y == normals[1].y &&
                                      normals[0].z == normals[1].z;
                    find_points(then, {normals, same ? 1U : 2U}, middle, moved, span, out);
                }
                return out;
            }
        }
        t = next;
        start = unit_or(direction.normal + step * direction.change, direction.normal);
    }
    out.lower = t;
    return out;
}

/// Adds the normals of the faces of a triangle or box, where it is placed.
void TurningSolver::add_faces(const TurningBody& body, const Side& side) {
    const auto add = [&](std::size_t i, std::size_t j) {
        const Vec3 first = side.body.placed(0);
        const Vec3 n = cross(side.body.placed(i) - first, side.body.placed(j) - first);
        if (norm(n) > 0.0) {
            normals_.push_back(normalized(n));
        }
    };
    if (body.half != nullptr) {
        add(1, 2);
        add(2, 4);
        add(4, 1);
    } else if (body.count == 3) {
        add(1, 2);
    }
}

TurningContact TurningSolver::share(const TurningBody& a, const TurningBody& b, double t, double span,
                                    Vec3 normal, const TurningSlack& slack) {
    prepare(a, b, slack);
    seen_ = {};
    TurningContact out;
    out.normal = nan_vector();
    if (!a_.body.placeable(t) || !b_.body.placeable(t)) {
        return out;
    }
    const Look at = look(t, norm(normal) > 0.0 ? normal : unit_or(narrow(between_), {1.0, 0.0, 0.0}));
    const double moved = way(span) + kBandRounding * (at.error + kHeightError * at.size);
    if (!(at.found.length <= slack_.margin + moved)) {
        return out;
    }
    // The normal between nearest points is off by what rounds over their distance: faces go before it.
    normals_.assign(1, normal);
    add_faces(a, a_);
    add_faces(b, b_);
    std::erase_if(normals_, [&](Vec3& n) {
        const auto parts = [&](Vec3 along) {
            return lowest(at.b, along).value - highest(at.a, along).value >= slack_.margin - moved;
        };
        n = parts(-n) ? -n : n;
        return !parts(n);
    });
    normals_.push_back(at.found.normal);
    normals_.push_back(normal_of(at, at.found.witness, at.found.normal));
    out.normal = normals_.front();
    find_points(at, normals_, 0.5 * (at.found.point_a + at.found.point_b), moved, span, out);
    return out;
}

TurningContact TurningSolver::solve(const TurningBody& a, const TurningBody& b, double t_max,
                                    double tolerance, const TurningSlack& slack, bool contact_set) {
    TurningContact out = search(a, b, t_max, tolerance, slack, contact_set);
    out.looks = looks_;
    return out;
}

}  // namespace geomsrv
