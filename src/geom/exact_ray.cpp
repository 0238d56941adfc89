// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
#include "geom/exact_ray.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <stdexcept>

#include "geom/exact_direction.hpp"

namespace geomsrv {

namespace {

// Every step opens the wedge, or brings the facet nearer to the end of the line; this many are never seen.
constexpr int kMostSteps = 10000;

[[noreturn]] void fail() {
    throw std::logic_error("exact_ray: every step gets further, yet there was no last one");
}

/// Vertices of a body that are level along a direction because the corners of K listed say so: those that
/// share a partner with the first, directly or over others, and in a box those that differ from them by edges
/// along which they are level.
class LevelCorners {
public:
    LevelCorners(const ExactBody& body, bool of_b, const VertexPair* pair, int count) {
        bool reached[3] = {count > 0};
        for (int round = 0; round < count; ++round) {
            for (int i = 0; i < count; ++i) {
                for (int k = 0; k < count; ++k) {
                    reached[i] =
                        reached[i] || (reached[k] && (pair[i].a == pair[k].a || pair[i].b == pair[k].b));
                }
            }
        }
        for (int i = 0; i < count; ++i) {
            if (reached[i]) {
                vertex_[count_++] = of_b ? pair[i].b : pair[i].a;
            }
        }
        if (body.kind != ExactBody::Kind::zonotope) {
            return;
        }
        for (int i = 0; i < count_; ++i) {
            for (int k = 0; k < i; ++k) {
                const int differs = vertex_[i] ^ vertex_[k];
                if ((differs & (differs - 1)) == 0) {
                    free_ |= differs;
                }
            }
        }
    }

    [[nodiscard]] bool holds(int vertex) const {
        for (int i = 0; i < count_; ++i) {
            if (((vertex ^ vertex_[i]) & ~free_) == 0) {
                return true;
            }
        }
        return false;
    }

private:
    int vertex_[3] = {};
    int count_ = 0;
    int free_ = 0;  ///< bits of a box
};

}  // namespace

/// A direction in every arithmetic that has been asked for.
template <class F>
class ExactRay::Direction {
public:
    Direction(const F& recipe, bool ordinary) : recipe_(recipe) {
        if (ordinary) {
            wide_ = recipe.template operator()<Enclosed>();
            known_ = round_direction(wide_, rough_);
        }
        if (!known_) {
            round_direction(in<Exact>(), rough_);
        }
        const double size = std::max({std::fabs(rough_.x), std::fabs(rough_.y), std::fabs(rough_.z)});
        const int exponent = -std::ilogb(size);
        rough_ = {std::scalbn(rough_.x, exponent), std::scalbn(rough_.y, exponent),
                  std::scalbn(rough_.z, exponent)};
        rough_ = normalized(rough_);
    }

    template <class N>
    const VectorOf<N>& in() const {
        if constexpr (std::is_same_v<N, Enclosed>) {
            return wide_;
        } else {
            if (!exact_) {
                exact_ = recipe_.template operator()<Exact>();
            }
            return *exact_;
        }
    }

    /// Unit.
    [[nodiscard]] Vec3 rough() const { return rough_; }

private:
    const F& recipe_;
    bool known_ = false;
    VectorOf<Enclosed> wide_;
    mutable std::optional<VectorOf<Exact>> exact_;
    Vec3 rough_;
};

ExactRay::ExactRay(const ExactAndRough& a, const ExactAndRough& b, Vec3 velocity_a, Vec3 velocity_b,
                   bool ordinary)
    : a_(a),
      b_(b),
      velocity_a_(velocity_a),
      velocity_b_(velocity_b),
      at_rest_(velocity_a.x == velocity_b.x && velocity_a.y == velocity_b.y && velocity_a.z == velocity_b.z),
      ordinary_(ordinary) {
    // The ray has a component along each axis that is not listed here.
    const bool x = at_rest_ || velocity_a.x != velocity_b.x;
    const bool y = !x && velocity_a.y != velocity_b.y;
    axis_[0] = x ? 1 : 0;
    axis_[1] = x || y ? 2 : 1;
}

int ExactRay::turn(VertexPair x, VertexPair y) {
    return sign([&]<class N>() { return dot(cross(ray<N>(), corner<N>(x)), corner<N>(y)); });
}

/// As seen from next to the line: it is moved along one axis a little, and along another much less.
int ExactRay::nudged_turn(VertexPair x, VertexPair y) {
    int side = turn(x, y);
    for (int k = 0; k < 2 && side == 0; ++k) {
        const int axis = axis_[k];
        side = sign([&]<class N>() {
            const VectorOf<N> r = ray<N>();
            const VectorOf<N> e = corner<N>(x) - corner<N>(y);
            // det(r, axis, e)
            return axis == 0   ? r.z * e.y - r.y * e.z
                   : axis == 1 ? r.x * e.z - r.z * e.x
                               : r.y * e.x - r.x * e.y;
        });
    }
    return side;
}

int ExactRay::height(const RayWall& wall, VertexPair x) {
    return sign([&]<class N>() { return dot(direction<N>(wall), corner<N>(x)); });
}

/// The vertex of a highest, of b lowest along a direction; `start` if none is beyond it.  Corners listed are
/// known to be level.
template <class D>
int ExactRay::extreme(const ExactAndRough& body, std::span<const int> among, const D& direction, bool of_b,
                      int start, const VertexPair* level, int count) {
    const Core& core = body.rough;
    const Vec3 n = of_b ? -direction.rough() : direction.rough();
    const double doubt = kLevelError * core.reach + 2.0 * core.error;
    const auto rough_height = [&](int i) { return dot(n, vertex_of(core, i) - core.center); };
    const double base = rough_height(start);
    double top = base;
    int best = start;
    for (const int i : among) {
        const double height = rough_height(i);
        if (height > top) {
            top = height;
            best = i;
        }
    }
    const bool moved = top > base + doubt;
    if (!moved) {
        best = start;
    }
    const LevelCorners known(body.exact, of_b, level, count);
    const double least = (moved ? top : base) - doubt;
    for (const int i : among) {
        if (i == best || rough_height(i) < least || (known.holds(i) && known.holds(best))) {
            continue;
        }
        const int above = sign([&]<class N>() {
            return dot(direction.template in<N>(), step_times_denominator<N>(body.exact, best, i));
        });
        if (above == (of_b ? -1 : 1)) {
            best = i;
        }
    }
    return best;
}

template <class F>
VertexPair ExactRay::lowest(const F& recipe, const VertexPair* level, int count) {
    const Direction<F> direction(recipe, ordinary_);
    return {extreme(a_, among_a_, direction, false, level[0].a, level, count),
            extreme(b_, among_b_, direction, true, level[0].b, level, count)};
}

VertexPair ExactRay::lowest(const RayWall& wall, VertexPair start) {
    const VertexPair level[2] = {start, wall.corner[1]};
    const bool chord = wall.kind == RayWall::Kind::chord;
    return lowest([&]<class N>() { return direction<N>(wall); }, level, chord ? 2 : 1);
}

/// Three corners around the line, seen counter-clockwise about it, or a wall.
ExactRay::Place ExactRay::enclose(VertexPair start, Triangle& around) {
    using Kind = RayWall::Kind;
    VertexPair middle = start;
    const auto on_line = [&](VertexPair x) {
        for (int k = 0; k < 3; ++k) {
            const int side = sign([&]<class N>() {
                const VectorOf<N> across = cross(ray<N>(), corner<N>(x));
                return k == 0 ? across.x : k == 1 ? across.y : across.z;
            });
            if (side != 0) {
                return false;
            }
        }
        return true;
    };
    if (on_line(middle)) {
        const RayWall wall{Kind::axis, 1, axis_[0], {}};
        const VertexPair other = lowest(wall, middle);
        if (height(wall, other) == 0) {
            wall_ = wall;
            return Place::border;
        }
        middle = other;
    }
    // Highest to either side of the first corner.
    VertexPair side[2];
    for (const int k : {0, 1}) {
        const RayWall wall{Kind::corner, k == 0 ? -1 : 1, 0, {middle, {}}};
        side[k] = lowest(wall, middle);
        if (turn(middle, side[k]) == 0) {
            wall_ = wall;
            return Place::border;
        }
    }
    auto [left, right] = side;
    for (int count = 0; count < kMostSteps; ++count) {
        const int opening = turn(left, right);
        if (opening > 0) {
            around = {{middle, left, right}};
            return Place::inside;
        }
        if (opening == 0) {
            // The line passes between the two.
            const RayWall wall{Kind::corner, -1, 0, {left, {}}};
            const VertexPair beyond = lowest(wall, left);
            if (turn(left, beyond) == 0) {
                wall_ = wall;
                return Place::border;
            }
            around = nudged_turn(left, right) < 0 ? Triangle{{left, beyond, right}}
                                                  : Triangle{{middle, left, right}};
            return Place::inside;
        }
        // The wedge of the corners seen is less than half a turn: from behind the line.
        const RayWall wall{Kind::chord, -1, 0, {left, right}};
        const VertexPair beyond = lowest(wall, left);
        const int above = height(wall, beyond);
        if (above >= 0) {
            wall_ = wall;
            return above > 0 ? Place::outside : Place::border;
        }
        const int from_left = turn(left, beyond);
        const int to_right = turn(beyond, right);
        if (from_left > 0 && to_right > 0) {
            around = {{left, beyond, right}};
            return Place::inside;
        }
        if (from_left > 0) {
            middle = left;
            left = beyond;
        } else {
            middle = right;
            right = beyond;
        }
    }
    fail();
}

/// REQUIRES: corners around the nudged line.
RayFeature ExactRay::descend(const Triangle& around, RayEnd end) {
    RayFeature facet{2, {around.corner[0], around.corner[1], around.corner[2]}};
    VertexPair* const c = facet.corner;
    for (int count = 0; count < kMostSteps; ++count) {
        const VertexPair next = lowest([&]<class N>() { return direction<N>(end, facet); }, facet.corner, 3);
        if (next.a == c[0].a && next.b == c[0].b) {
            return facet;
        }
        int side[3];
        for (int i = 0; i < 3; ++i) {
            side[i] = nudged_turn(next, c[i]);
        }
        // The line is between two corners and what is opposite to the new one.
        if (side[0] > 0 && side[1] < 0) {
            c[2] = next;
        } else if (side[1] > 0 && side[2] < 0) {
            c[0] = next;
        } else if (side[2] > 0 && side[0] < 0) {
            c[1] = next;
        } else {
            // Seen along the line, it covers one of the corners, whose place it takes.
            c[side[0] == 0 ? 0 : side[1] == 0 ? 1 : 2] = next;
        }
    }
    fail();
}

bool ExactRay::surrounds(const Triangle& around) {
    return turn(around.corner[0], around.corner[1]) > 0 && turn(around.corner[1], around.corner[2]) > 0 &&
           turn(around.corner[2], around.corner[0]) > 0;
}

template <class F>
void ExactRay::faces(const F& recipe, const VertexPair* level, int count, std::vector<int>& of_a,
                     std::vector<int>& of_b) {
    const Direction<F> direction(recipe, ordinary_);
    for (const bool b : {false, true}) {
        const ExactAndRough& body = b ? b_ : a_;
        const Core& core = body.rough;
        const int base = b ? level[0].b : level[0].a;
        const LevelCorners known(body.exact, b, level, count);
        const double doubt = kLevelError * core.reach + 2.0 * core.error;
        std::vector<int>& out = b ? of_b : of_a;
        out.clear();
        const Vec3 from = vertex_of(core, base);
        for (int i = 0; i < body.exact.count(); ++i) {
            if (!known.holds(i)) {
                if (std::fabs(dot(direction.rough(), vertex_of(core, i) - from)) > doubt) {
                    continue;
                }
                const int side = sign([&]<class N>() {
                    return dot(direction.template in<N>(), step_times_denominator<N>(body.exact, base, i));
                });
                if (side != 0) {
                    continue;
                }
            }
            out.push_back(i);
        }
    }
}

void ExactRay::faces(RayEnd end, std::vector<int>& of_a, std::vector<int>& of_b) {
    const RayFeature& at = feature(end);
    faces([&]<class N>() { return support<N>(end); }, at.corner, at.dimension + 1, of_a, of_b);
}

/// In the plane of the wall: the line is a point, K's face there a segment as seen along it.
bool ExactRay::meets_in_wall(VertexPair level) {
    {
        std::vector<int> of_a;
        std::vector<int> of_b;
        const VertexPair known[2] = {level, wall_.corner[0]};
        const int count = wall_.kind == RayWall::Kind::corner ? 2 : 1;
        faces([&]<class N>() { return wall_direction<N>(); }, known, count, of_a, of_b);
        among_a_ = std::move(of_a);
        among_b_ = std::move(of_b);
    }
    const auto along = [&]<class N>() { return cross(wall_direction<N>(), ray<N>()); };
    const auto against = [&]<class N>() { return cross(ray<N>(), wall_direction<N>()); };
    const auto side_of = [&](VertexPair x) {
        return sign([&]<class N>() { return dot(along.template operator()<N>(), corner<N>(x)); });
    };
    const VertexPair start = {among_a_.front(), among_b_.front()};
    const VertexPair low = lowest(along, &start, 1);
    const VertexPair high = lowest(against, &start, 1);
    const int low_side = side_of(low);
    const int high_side = side_of(high);
    if (low_side > 0 || high_side < 0) {
        return false;
    }
    if (low_side < 0 && high_side > 0) {
        enter_ = descend_in_wall(low, high, RayEnd::enter);
        leave_ = descend_in_wall(low, high, RayEnd::leave);
        return true;
    }
    // One end of that segment is on the line: only what lies there.
    const VertexPair base = low_side == 0 ? low : high;
    const Direction<decltype(along)> direction(along, ordinary_);
    const auto keep = [&](std::vector<int>& among, const ExactBody& body, int from) {
        std::erase_if(among, [&](int i) {
            return i != from &&
                   sign([&]<class N>() {
                       return dot(direction.template in<N>(), step_times_denominator<N>(body, from, i));
                   }) != 0;
        });
    };
    keep(among_a_, a_.exact, base.a);
    keep(among_b_, b_.exact, base.b);
    enter_ = {0, {lowest([&]<class N>() { return ray<N>(); }, &base, 1)}};
    leave_ = {0, {lowest([&]<class N>() { return -ray<N>(); }, &base, 1)}};
    return true;
}

RayFeature ExactRay::descend_in_wall(VertexPair low, VertexPair high, RayEnd end) {
    RayFeature edge{1, {low, high}};
    for (int count = 0; count < kMostSteps; ++count) {
        const VertexPair next = lowest([&]<class N>() { return direction<N>(end, edge); }, edge.corner, 2);
        if (next.a == edge.corner[0].a && next.b == edge.corner[0].b) {
            return edge;
        }
        const int side =
            sign([&]<class N>() { return dot(cross(wall_direction<N>(), ray<N>()), corner<N>(next)); });
        edge.corner[side > 0 ? 1 : 0] = next;
    }
    fail();
}

void ExactRay::consider_all() {
    among_a_.resize(static_cast<std::size_t>(a_.exact.count()));
    among_b_.resize(static_cast<std::size_t>(b_.exact.count()));
    std::iota(among_a_.begin(), among_a_.end(), 0);
    std::iota(among_b_.begin(), among_b_.end(), 0);
}

bool ExactRay::pierces(RayEnd end) {
    const RayFeature& at = feature(end);
    return pierced_[end == RayEnd::enter ? 0 : 1] ||
           (at.dimension == 2 && surrounds({{at.corner[0], at.corner[1], at.corner[2]}}));
}

VertexPair ExactRay::lowest_along(const VectorOf<Exact>& direction, VertexPair start) {
    consider_all();
    Vec3 rough;
    round_direction(direction, rough);
    return lowest(
        [&]<class N>() {
            if constexpr (std::is_same_v<N, Exact>) {
                return direction;
            } else {
                // Entries are at most 1.
                const auto near = [](double x) { return Enclosed({x, 0.0}, 2 * kUnitRoundoff); };
                return VectorOf<Enclosed>{near(rough.x), near(rough.y), near(rough.z)};
            }
        },
        &start, 1);
}

bool ExactRay::meets(const LineCast& guess) {
    consider_all();
    wall_ = {};
    wide_ = {};
    whole_ = {};
    pierced_[0] = pierced_[1] = false;
    const auto listed = [&](VertexPair pair) {
        return VertexPair{std::min(pair.a, a_.exact.count() - 1), std::min(pair.b, b_.exact.count() - 1)};
    };
    // Counter-clockwise about w is clockwise about the ray.
    const auto guessed = [&](const Portal& portal) {
        return Triangle{{listed(portal.corner[0]), listed(portal.corner[2]), listed(portal.corner[1])}};
    };
    Triangle around;
    bool known = false;
    if (guess.portals) {
        around = guessed(guess.enter);
        known = guess.enter.sure || surrounds(around);
    }
    if (!known) {
        switch (enclose(listed(guess.start), around)) {
            case Place::outside:
                return false;
            case Place::border:
                return meets_in_wall(
                    lowest(wall_, wall_.kind == RayWall::Kind::axis ? listed(guess.start) : wall_.corner[0]));
            case Place::inside:
                break;
        }
    }
    const auto same = [](const Triangle& x, const RayFeature& y) {
        const auto equal = [&](int k) {
            return x.corner[k].a == y.corner[k].a && x.corner[k].b == y.corner[k].b;
        };
        return equal(0) && equal(1) && equal(2);
    };
    const Triangle first = around;
    enter_ = descend(around, RayEnd::enter);
    pierced_[0] = guess.portals && guess.enter.sure && same(first, enter_);
    if (guess.portals) {
        const Triangle other = guessed(guess.leave);
        if (guess.leave.sure || surrounds(other)) {
            around = other;
        }
    }
    leave_ = descend(around, RayEnd::leave);
    pierced_[1] = guess.portals && guess.leave.sure && same(around, leave_);
    return true;
}

int ExactRay::compare(RayEnd end, double t) {
    return sign([&]<class N>() {
        N numerator;
        N denominator;
        time<N>(end, numerator, denominator);
        return t == 0.0 ? numerator : numerator - N(t) * denominator;
    });
}

Rounding ExactRay::time(RayEnd end) {
    Rounding out;
    if (ordinary_) {
        Enclosed numerator;
        Enclosed denominator;
        time<Enclosed>(end, numerator, denominator);
        if (round_enclosed(numerator / denominator, out)) {
            return out;
        }
    }
    exact_ = true;
    Exact numerator;
    Exact denominator;
    time<Exact>(end, numerator, denominator);
    return rounded_quotient(numerator, denominator);
}

}  // namespace geomsrv
