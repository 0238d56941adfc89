// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
#include "geom/line_cast.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include "geom/lanes.hpp"
#include "geom/rounding.hpp"

namespace geomsrv {

namespace {

// Steps needed are few: about as many as the facets passed on the way down.  More is stuck in rounding.
constexpr int kMostSteps = 64;

// A vertex is lower than a plane by more than rounding if it is so by more than this times the reach: both
// heights are off by less than half of it.
constexpr double kSettled = 2 * kCornerError;

// Squared sine of an angle below which the product of two edges may have lost most of its digits.
constexpr double kSliver = 0x1p-20;

// Seen along the line, a coordinate of a vertex is off by 14 u of the reach: 4 u for the part itself and for
// the one along the line, 3 u for the slope, 3 u for product and difference; both by 20 u.  Slopes are at
// most 1, so both together are no longer than twice the reach, and an area, a product of two, is off by 80 u,
// and by 12 u of its own.
constexpr double kAreaError = 128 * kUnitRoundoff;

/// Highest of a hull's points along n, the first of several.
GEOMSRV_INLINE int top_of_points(const Core& core, Vec3 n) {
    constexpr int kLanes = Lanes::kCount;
    const double* const x = core.points;
    const double* const y = x + core.count;
    const double* const z = y + core.count;
    const Lanes nx = n.x;
    const Lanes ny = n.y;
    const Lanes nz = n.z;
    const auto value = [&](int i) __attribute__((always_inline)) {
        return nx * Lanes::load(x + i) + ny * Lanes::load(y + i) + nz * Lanes::load(z + i);
    };
    // Two runs at once: each comparison waits for the one before.
    Lanes index(Lanes::Vector{0.0, 1.0, 2.0, 3.0});
    const Lanes step = 2.0 * kLanes;
    Lanes best = value(0);
    Lanes where = index;
    Lanes other_best = best;
    Lanes other_where = index;
    Lanes other_index = index + Lanes(kLanes);
    int i = kLanes;
    for (; i + kLanes < core.count; i += 2 * kLanes) {
        index = index + step;
        const Lanes first = value(i);
        const Lanes second = value(i + kLanes);
        const LaneMask better = other_best < first;
        other_best = select(better, first, other_best);
        other_where = select(better, other_index, other_where);
        const LaneMask best_yet = best < second;
        best = select(best_yet, second, best);
        where = select(best_yet, index, where);
        other_index = other_index + step;
    }
    if (i < core.count) {
        const Lanes last = value(i);
        const LaneMask better = other_best < last;
        other_best = select(better, last, other_best);
        other_where = select(better, other_index, other_where);
    }
    const LaneMask better = best < other_best;
    best = select(better, other_best, best);
    where = select(better, other_where, where);
    // Of equals, the first.
    const Lanes none = static_cast<double>(core.count);
    return static_cast<int>(least(select(best < Lanes(greatest(best)), none, where)));
}

/// The same along two directions at once: one pass, and neither waits for the other.
GEOMSRV_INLINE std::pair<int, int> tops_of_points(const Core& core, Vec3 n, Vec3 m) {
    constexpr int kLanes = Lanes::kCount;
    const double* const x = core.points;
    const double* const y = x + core.count;
    const double* const z = y + core.count;
    const auto value = [&](Vec3 along, int i) __attribute__((always_inline)) {
        return Lanes(along.x) * Lanes::load(x + i) + Lanes(along.y) * Lanes::load(y + i) +
               Lanes(along.z) * Lanes::load(z + i);
    };
    Lanes index(Lanes::Vector{0.0, 1.0, 2.0, 3.0});
    Lanes best_n = value(n, 0);
    Lanes best_m = value(m, 0);
    Lanes where_n = index;
    Lanes where_m = index;
    for (int i = kLanes; i < core.count; i += kLanes) {
        index = index + Lanes(kLanes);
        const Lanes along_n = value(n, i);
        const Lanes along_m = value(m, i);
        const LaneMask better_n = best_n < along_n;
        const LaneMask better_m = best_m < along_m;
        best_n = select(better_n, along_n, best_n);
        best_m = select(better_m, along_m, best_m);
        where_n = select(better_n, index, where_n);
        where_m = select(better_m, index, where_m);
    }
    const Lanes none = static_cast<double>(core.count);
    return {static_cast<int>(least(select(best_n < Lanes(greatest(best_n)), none, where_n))),
            static_cast<int>(least(select(best_m < Lanes(greatest(best_m)), none, where_m)))};
}

GEOMSRV_INLINE int top_of(const Core& core, Vec3 n) {
    if (core.points != nullptr) {
        return top_of_points(core, n);
    }
    int vertex = 0;
    for (int i = 0; i < core.generators; ++i) {
        vertex |= (dot(n, core.generator[i]) > 0.0 ? 1 : 0) << i;
    }
    return vertex;
}

GEOMSRV_INLINE std::pair<int, int> tops_of(const Core& core, Vec3 n, Vec3 m) {
    if (core.points != nullptr) {
        return tops_of_points(core, n, m);
    }
    return {top_of(core, n), top_of(core, m)};
}

/// Coordinates across the line: along it, onto a coordinate plane.
struct Across {
    int k, i, j;
    double slope_i, slope_j;

    GEOMSRV_INLINE explicit Across(Vec3 w) {
        const double x = std::fabs(w.x);
        const double y = std::fabs(w.y);
        const double z = std::fabs(w.z);
        k = x >= y && x >= z ? 0 : y >= z ? 1 : 2;
        i = k == 2 ? 0 : k + 1;
        j = i == 2 ? 0 : i + 1;
        // The order of i and j makes areas positive where they are counter-clockwise about w.
        if (component(w, k) < 0.0) std::swap(i, j);
        slope_i = component(w, i) / component(w, k);
        slope_j = component(w, j) / component(w, k);
    }

    GEOMSRV_INLINE Vec2 operator()(Vec3 v) const {
        const double along = component(v, k);
        return {component(v, i) - slope_i * along, component(v, j) - slope_j * along};
    }

    /// The direction whose product with a vertex is that of m with its coordinates.
    GEOMSRV_INLINE Vec3 lift(Vec2 m) const {
        double n[3];
        n[i] = m.x;
        n[j] = m.y;
        n[k] = -(slope_i * m.x + slope_j * m.y);
        return {n[0], n[1], n[2]};
    }
};

struct Corner {
    VertexPair id;
    Vec3 v;
    Vec2 flat;
};

/// Three corners around the line, counter-clockwise about w.
struct Triangle {
    Corner corner[3];
};

template <bool Wide>
class Cast {
public:
    GEOMSRV_INLINE Cast(const Core& a, const Core& b, Vec3 w, double margin)
        : a_(a), b_(b), w_(w), across_(w), reach_(a.reach + b.reach), margin_(margin) {}

    GEOMSRV_INLINE LineCast run() const {
        LineCast out;
        Triangle around;
        if (!enclose(around, out)) {
            return out;
        }
        out.portals = true;
        descend(around, out);
        if (out.enter.sure && out.leave.sure) {
            out.outcome = LineCast::Outcome::meets;
        }
        return out;
    }

private:
    /// Lowest along n.
    GEOMSRV_INLINE Corner lowest(Vec3 n) const { return corner(n, top_of(a_, n), top_of(b_, -n)); }

    GEOMSRV_INLINE std::pair<Corner, Corner> lowest(Vec3 n, Vec3 m) const {
        const auto [p, r] = tops_of(a_, n, m);
        const auto [q, s] = tops_of(b_, -n, -m);
        return {corner(n, p, q), corner(m, r, s)};
    }

    /// Vertices p of a and q of b, lowest along n.
    GEOMSRV_INLINE Corner corner(Vec3 n, int p, int q) const {
        Vec3 v = vertex_of(b_, q) - vertex_of(a_, p);
        if constexpr (Wide) {
            v = v + lowest_margin(n, margin_);
        }
        return {{p, q}, v, across_(v)};
    }

    GEOMSRV_INLINE Corner lowest_across(Vec2 m) const { return lowest(across_.lift(m)); }

    /// False with an outcome if the line misses, or if that cannot be told.
    GEOMSRV_INLINE bool enclose(Triangle& around, LineCast& out) const {
        // The wedge in which the corners found are seen from the line; it opens until it is half a turn.
        const double doubt = kAreaError * reach_;
        Vec2 m = across_(b_.center - a_.center);
        if (m.x == 0.0 && m.y == 0.0) m = {1.0, 0.0};
        const Corner first = lowest_across(m);
        out.start = first.id;
        // The centre of a hull's bounding box need not be in it, but the vertex lowest along any m says the
        // same.
        if (misses(m, first, out)) return false;
        const Vec2 f = first.flat;
        if (std::fabs(f.x) + std::fabs(f.y) <= doubt) return false;
        auto [left, right] = lowest(across_.lift({f.y, -f.x}), across_.lift({-f.y, f.x}));
        if (misses({f.y, -f.x}, left, out) || misses({-f.y, f.x}, right, out)) return false;
        Corner middle = first;
        for (int step = 0; step < kMostSteps; ++step) {
            const double turn = cross(left.flat, right.flat);
            if (turn > 0.0) {
                around = {{middle, left, right}};
                return true;
            }
            // All of the wedge is above the line along m, both ends by the same.
            const Vec2 chord = left.flat - right.flat;
            m = {-chord.y, chord.x};
            if (dot(m, middle.flat) < 0.0) m = -m;
            const Corner next = lowest_across(m);
            if (misses(m, next, out)) return false;
            const double from_left = cross(left.flat, next.flat);
            const double to_right = cross(next.flat, right.flat);
            if (from_left > 0.0 && to_right > 0.0) {
                around = {{left, next, right}};
                return true;
            }
            if (from_left > 0.0) {
                middle = left;
                left = next;
            } else if (to_right > 0.0) {
                middle = right;
                right = next;
            } else {
                return false;
            }
        }
        return false;
    }

    /// Whether the lowest corner along m is above the line.
    GEOMSRV_INLINE bool misses(Vec2 m, const Corner& corner, LineCast& out) const {
        if (!(dot(m, corner.flat) > 0.0)) {
            return false;
        }
        const Vec3 n = across_.lift(m);
        const double length = norm(n);
        if (!(length > 0.0)) return false;
        out.normal = {n.x / length, n.y / length, n.z / length};
        // The direction is perpendicular to the line but for 4 u; tilted by that much it loses 4 u of the
        // reach.
        out.gap =
            dot(out.normal, corner.v) - ((kLowestError + 4 * kUnitRoundoff) * reach_ + a_.error + b_.error);
        if (out.gap > 0.0) out.outcome = LineCast::Outcome::misses;
        return true;
    }

    /// Of two long edges of a sliver the product cancels: its two shorter ones are multiplied.
    GEOMSRV_INLINE static Vec3 normal_of(const Corner (&c)[3]) {
        const Vec3 e = c[1].v - c[0].v;
        const Vec3 f = c[2].v - c[0].v;
        const Vec3 n = cross(e, f);
        if (dot(n, n) > kSliver * (dot(e, e) * dot(f, f))) [[likely]] {
            return n;
        }
        const Vec3 g = c[2].v - c[1].v;
        const double ee = dot(e, e);
        const double ff = dot(f, f);
        const double gg = dot(g, g);
        return gg >= ee && gg >= ff ? n : ff >= ee ? cross(e, g) : cross(f, g);
    }

    /// On the way to the facet where the line enters (side 1) or leaves K (-1).
    struct Descent {
        double side;
        Corner c[3];
        Vec3 n;
        Corner low;
        bool settled = false;
        bool ended = false;

        GEOMSRV_INLINE Descent(const Triangle& start, double which)
            : side(which), c{start.corner[0], start.corner[1], start.corner[2]}, low(start.corner[0]) {}

        /// Counter-clockwise about w: the product is along w, on the side where the line leaves.
        GEOMSRV_INLINE void aim() { n = -side * normal_of(c); }

        /// `next`: the lowest along n.
        GEOMSRV_INLINE void step(const Corner& next, double reach) {
            low = next;
            const double size = std::fabs(n.x) + std::fabs(n.y) + std::fabs(n.z);
            if (!(dot(n, low.v - c[0].v) < -kSettled * reach * size)) {
                settled = size > 0.0;
                ended = true;
                return;
            }
            // The line is between two corners and what is opposite to the new one; it replaces the third.
            // Which one that is cannot be predicted, so it is not a branch.
            const bool left0 = cross(low.flat, c[0].flat) >= 0.0;
            const bool left1 = cross(low.flat, c[1].flat) >= 0.0;
            const bool left2 = cross(low.flat, c[2].flat) >= 0.0;
            if (left0 == left1 && left1 == left2) {
                ended = true;
                return;
            }
            c[(left0 & !left1) ? 2 : (left1 & !left2) ? 0 : 1] = low;
        }
    };

    /// To both facets at once: each step waits for the one before, so two ways cost little more than one.
    GEOMSRV_INLINE void descend(const Triangle& start, LineCast& out) const {
        Descent enter(start, 1.0);
        Descent leave(start, -1.0);
        int step = 0;
        for (; step < kMostSteps && !(enter.ended || leave.ended); ++step) {
            enter.aim();
            leave.aim();
            const auto [first, second] = lowest(enter.n, leave.n);
            enter.step(first, reach_);
            leave.step(second, reach_);
        }
        Descent& other = enter.ended ? leave : enter;
        for (; step < kMostSteps && !other.ended; ++step) {
            other.aim();
            other.step(lowest(other.n), reach_);
        }
        set_portal(enter, out.enter);
        set_portal(leave, out.leave);
    }

    GEOMSRV_INLINE void set_portal(const Descent& at, Portal& out) const {
        const Corner(&c)[3] = at.c;
        out.corner[0] = c[0].id;
        out.corner[1] = c[1].id;
        out.corner[2] = c[2].id;
        const Vec3 n = at.n;
        const double length = norm(n);
        if (!at.settled || !(length > 0.0)) {
            return;
        }
        out.normal = {n.x / length, n.y / length, n.z / length};
        const double h0 = dot(out.normal, c[0].v);
        const double h1 = dot(out.normal, c[1].v);
        const double h2 = dot(out.normal, c[2].v);
        const double errors = a_.error + b_.error;
        out.height = std::min({h0, h1, h2, dot(out.normal, at.low.v)});
        out.lowest = out.height - (kLowestError * reach_ + errors);
        out.highest = std::max({h0, h1, h2}) + (kCornerError * reach_ + errors);
        out.rate = -dot(out.normal, w_);
        out.rate_error = kPortalRateError * norm(w_);
        // The line passes between the corners for certain.
        const double doubt = kAreaError * reach_ * reach_ + 4.0 * errors * reach_;
        out.settled = true;
        out.sure = cross(c[0].flat, c[1].flat) > doubt && cross(c[1].flat, c[2].flat) > doubt &&
                   cross(c[2].flat, c[0].flat) > doubt && at.side * out.rate > out.rate_error;
    }

    const Core& a_;
    const Core& b_;
    Vec3 w_;
    Across across_;
    double reach_;
    double margin_;
};

}  // namespace

GEOMSRV_WIDE_CLONES LineCast cast_line(const Core& a, const Core& b, Vec3 w) {
    return Cast<false>(a, b, w, 0.0).run();
}

LineCast cast_line_wide(const Core& a, const Core& b, Vec3 w, double margin) {
    return Cast<true>(a, b, w, margin).run();
}

}  // namespace geomsrv
