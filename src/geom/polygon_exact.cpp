// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
#include "geom/polygon_exact.hpp"

#include <algorithm>
#include <cmath>

#include "geom/rounding.hpp"

namespace geomsrv {

namespace {

bool is_safe(double x) { return std::fabs(x) > kSmallestSafe && std::fabs(x) < kLargestSafe; }
bool is_safe_double(const Enclosed& x) { return x.value.lo == 0.0 && x.error == 0.0 && is_safe(x.value.hi); }

/// a / b by one division, which several may share: inverse = 1 / b.hi.
DoubleDouble quotient(DoubleDouble a, DoubleDouble b, double inverse) {
    const double first = a.hi * inverse;
    const DoubleDouble product = two_product(first, b.hi);
    const double rest = ((a.hi - product.hi) - product.lo) + (a.lo - first * b.lo);
    return quick_two_sum(first, rest * inverse);
}

/// a / b.
Enclosed ratio(const Enclosed& a, const Enclosed& b) {
    const double size = std::fabs(b.value.hi);
    if (!is_safe(a.value.hi) || !is_safe(size) || !(b.error < kSmallRelative * size)) {
        return a / b;
    }
    const double inverse = 1.0 / b.value.hi;
    const DoubleDouble value = quotient(a.value, b.value, inverse);
    // |a/b - q| <= (|da| + |q| |db|) / (|b| - |db|), and the rounding of the quotient.
    const double size_q = std::fabs(value.hi);
    const double inherited = (a.error + size_q * b.error) * std::fabs(inverse) * (1.0 + 2.0 * kSmallRelative);
    return {value, (inherited + kInverseError * size_q) * kBoundRounding};
}

/// The quotient of two doubles: division rounds it correctly, the sign of the rest tells to which side.
Rounding rounded(double n, double d) {
    const double nearest = n / d;
    const DoubleDouble product = two_product(nearest, d);
    const double rest = ((n - product.hi) - product.lo) * (d < 0.0 ? -1.0 : 1.0);
    return {nearest, rest < 0.0 ? next_down(nearest) : nearest, rest > 0.0 ? next_up(nearest) : nearest};
}

/// The root, without error where it is a double.
Enclosed root(const Enclosed& x) {
    if (is_safe_double(x)) {
        const double rough = std::sqrt(x.value.hi);
        const DoubleDouble square = two_product(rough, rough);
        if (square.hi == x.value.hi && square.lo == 0.0) {
            return rough;
        }
    }
    return root_of(x);
}

/// start + t * length rounded to nearest; false if that is in doubt.
bool round_sum(double start, const Enclosed& t, DoubleDouble length, double& out) {
    const DoubleDouble way = t.value * length;
    const DoubleDouble sum = two_sum(start, way.hi);
    const double rest = sum.lo + way.lo;
    // The product is off by 2^-102 of it, the sum of the low parts by u of itself.
    const double off =
        (std::fabs(length.hi) * t.error + kWideRoundoff * (std::fabs(way.hi) + std::fabs(sum.hi))) *
            kBoundRounding +
        kEnclosedUnderflow;
    out = sum.hi + (rest - off);
    return out == sum.hi + (rest + off);
}

Rounding negated(const Rounding& x) { return {-x.nearest, -x.upper, -x.lower}; }

}  // namespace

bool Wide::round_ratio(const Enclosed& n, const Enclosed& d, Rounding& out) {
    if (n.value.hi == 0.0 && n.error == 0.0) {
        out = {};
        return true;
    }
    if (is_safe_double(n) && is_safe_double(d)) {
        out = rounded(n.value.hi, d.value.hi);
        return true;
    }
    return round_enclosed(ratio(n, d), out);
}

bool Wide::round_over_root(const Enclosed& n, const Enclosed& d, Rounding& out) {
    return round_ratio(n, root(d), out);
}

bool Wide::round_root(const Enclosed& x, Rounding& out) { return round_enclosed(root(x), out); }

bool Wide::round_place(Vec2 from, const Enclosed& n, const Enclosed& d, const Vector& way, Vec2& out) {
    const Enclosed t = ratio(n, d);
    return round_sum(from.x, t, way.x, out.x) && round_sum(from.y, t, way.y, out.y);
}

Vec2 Wide::direction(const Vector& v) {
    const double size = std::max(std::fabs(v.x.hi), std::fabs(v.y.hi));
    if (!is_safe(size)) {
        const int down = -std::ilogb(size);
        const auto scaled = [down](DoubleDouble x) -> DoubleDouble {
            return {std::scalbn(x.hi, down), std::scalbn(x.lo, down)};
        };
        return direction({scaled(v.x), scaled(v.y)});
    }
    const DoubleDouble square = dot(v, v).value;
    const double root = std::sqrt(square.hi);
    const double inverse = 1.0 / root;
    // One Newton step (Karp), as in `sqrt`.
    const DoubleDouble rest = two_product(root, root);
    const DoubleDouble length{root, 0.5 * inverse * (((square.hi - rest.hi) - rest.lo) + square.lo)};
    return {quotient(v.x, length, inverse).hi, quotient(v.y, length, inverse).hi};
}

bool Whole::round_ratio(const Exact& n, const Exact& d, Rounding& out) {
    out = rounded_quotient(n, d);
    return true;
}

bool Whole::round_over_root(const Exact& n, const Exact& d, Rounding& out) {
    out = rounded_root(n * n, d);
    if (n.sign() < 0) {
        out = negated(out);
    }
    return true;
}

bool Whole::round_root(const Exact& x, Rounding& out) {
    out = rounded_root(x, Exact(1.0));
    return true;
}

bool Whole::round_place(Vec2 from, const Exact& n, const Exact& d, const Vector& way, Vec2& out) {
    out = {rounded_quotient(Exact(from.x) * d + n * way.x, d).nearest,
           rounded_quotient(Exact(from.y) * d + n * way.y, d).nearest};
    return true;
}

Vec2 Whole::direction(const Vector& v) {
    const Exact square = dot(v, v);
    const auto part = [&square](const Exact& x) {
        Rounding out;
        round_over_root(x, square, out);
        return out.nearest;
    };
    return {part(v.x), part(v.y)};
}

bool is_flat(const PolygonPair& pair) {
    const PairedPolygon& a = pair.side(0);
    const PairedPolygon& b = pair.side(1);
    if (a.edges > 2 || b.edges > 2) {
        return false;
    }
    return a.edges == 0 || b.edges == 0 || sign_of_cross(a.ring[0], a.ring[1], b.ring[0], b.ring[1]) == 0;
}

AxisEnds ends_of(const PolygonPair& pair, AxisOf axis) {
    const PairedPolygon& p = pair.side(axis.side);
    if (axis.index < p.edges) {
        return {p.ring[axis.index], p.ring[p.next(axis.index)]};
    }
    const auto turned = [](Vec2 v) { return Vec2{-v.y, v.x}; };
    if (p.edges != 2) {
        return {{}, turned(p.axis(axis.index))};
    }
    const std::size_t tip = p.base(axis.index);
    return {turned(p.ring[p.next(tip)]), turned(p.ring[tip])};
}

Level lowest_along(const PolygonPair& pair, AxisOf axis) {
    if (axis.index < pair.side(axis.side).edges) {
        return pair.lowest_level(axis);
    }
    const Ring q = pair.other(axis.side).ring;
    const AxisEnds ends = ends_of(pair, axis);
    const std::size_t lowest = q.size() > 1 && sign_of_cross(ends.from, ends.to, q[0], q[1]) > 0 ? 1 : 0;
    return {lowest, lowest};
}

int sign_of_gap(const PolygonPair& pair, AxisOf axis, std::size_t lowest) {
    const PairedPolygon& p = pair.side(axis.side);
    const AxisEnds ends = ends_of(pair, axis);
    return -sign_of_cross(ends.from, ends.to, p.ring[p.base(axis.index)], pair.other(axis.side).ring[lowest]);
}

Relation relation_of(const PolygonPair& pair, bool flat, std::size_t most, std::vector<AxisOf>& touching) {
    touching.clear();
    for (const int side : {0, 1}) {
        const PairedPolygon& p = pair.side(side);
        for (std::size_t k = 0; k < axes_of(p, flat); ++k) {
            if (p.work[most][k] < 0.0) {
                continue;
            }
            const AxisOf axis{side, k};
            const int sign = sign_of_gap(pair, axis, lowest_along(pair, axis).vertex);
            if (sign > 0) {
                return Relation::apart;
            }
            if (sign == 0) {
                touching.push_back(axis);
            }
        }
    }
    return touching.empty() ? Relation::overlapping : Relation::touching;
}

bool is_before(const AxisEnds& p, const AxisEnds& q) {
    // Rounding of a difference keeps its sign.
    const auto is_down = [](const AxisEnds& ends) {
        const Vec2 v = ends.to - ends.from;
        return v.y < 0.0 || (v.y == 0.0 && v.x < 0.0);
    };
    const bool down_p = is_down(p);
    const bool down_q = is_down(q);
    return down_p != down_q ? down_q : sign_of_cross(p.from, p.to, q.from, q.to) > 0;
}

bool is_before(const PolygonPair& pair, AxisOf p, AxisOf q) {
    const auto ends = [&pair](AxisOf axis) {
        const AxisEnds out = ends_of(pair, axis);
        return axis.side == 0 ? out : AxisEnds{out.to, out.from};
    };
    return is_before(ends(p), ends(q));
}

}  // namespace geomsrv
