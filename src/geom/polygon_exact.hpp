// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
// Two polygons by the given numbers, in either of two arithmetics: what first contact, distance and overlap
// at the exact tier have in common.
//
// Every number asked for is made of sums of products of differences of given numbers.  `Wide` finds it to
// about 106 bits with an error bound, and cannot always tell its sign or how it rounds; `Whole` always can,
// some thirty times as slowly.  A question is a template over the arithmetic that answers false where it
// cannot tell; `climb` asks it in Wide first.
#pragma once

#include <cmath>
#include <cstddef>
#include <vector>

#include "geom/double_double.hpp"
#include "geom/enclosed.hpp"
#include "geom/exact_number.hpp"
#include "geom/exact_sign.hpp"
#include "geom/polygon_pair.hpp"
#include "geom/rounding.hpp"
#include "geom/vec.hpp"

namespace geomsrv {

/// Numbers between these, and products of two of them, have all their bits in the range of double.
inline constexpr double kSmallestSafe = 0x1p-400;
inline constexpr double kLargestSafe = 0x1p400;

// What the quotient in `Wide::round_ratio` rounds, in units of u^2 of it, u = 2^-53: its first part is off by
// 2 u, so the rest is no larger than 5 u.  That is found by three sums and a product (4 + 2 + 4 + 1) and
// multiplied by a number that is off by u (10).  Rounded up.
inline constexpr double kInverseError = 32.0 * kUnitRoundoff * kUnitRoundoff;

// For errors of b below this part of it 1 / (|b| - |db|) < (1 + 2 of it) / |b|.
inline constexpr double kSmallRelative = 0x1p-20;

/// dot(a, b), without error where it is found without rest, as on a grid.
inline Enclosed dot(const ExactVec2& a, const ExactVec2& b) {
    const DoubleDouble x = a.x * b.x;
    const DoubleDouble y = a.y * b.y;
    const DoubleDouble sum = two_sum(x.hi, y.hi);
    const DoubleDouble value = quick_two_sum(sum.hi, sum.lo + (x.lo + y.lo));
    const bool zero_x = a.x.hi == 0.0 || b.x.hi == 0.0;
    const bool zero_y = a.y.hi == 0.0 || b.y.hi == 0.0;
    // Both products fit in a double, and so large a double that nothing was lost below it.
    const auto is_whole = [](DoubleDouble p, DoubleDouble q, DoubleDouble product) {
        return p.lo == 0.0 && q.lo == 0.0 && product.lo == 0.0 && std::fabs(product.hi) > kNoUnderflow;
    };
    if ((zero_x || is_whole(a.x, b.x, x)) && (zero_y || is_whole(a.y, b.y, y))) {
        return {value, 0.0};
    }
    return {value, kExactDotError * (std::fabs(x.hi) + std::fabs(y.hi)) + kPairUnderflow};
}

/// Double-double arithmetic.  REQUIRES: neither lengths nor speeds had to be scaled.
struct Wide {
    using Number = Enclosed;
    using Vector = ExactVec2;

    static Vector vector(Vec2 v) { return {{v.x, 0.0}, {v.y, 0.0}}; }
    static Vector difference(Vec2 to, Vec2 from) { return {two_sum(to.x, -from.x), two_sum(to.y, -from.y)}; }

    /// n / d.
    static bool round_ratio(const Enclosed& n, const Enclosed& d, Rounding& out);
    /// n / sqrt(d), d > 0.
    static bool round_over_root(const Enclosed& n, const Enclosed& d, Rounding& out);
    /// sqrt(x), x >= 0.
    static bool round_root(const Enclosed& x, Rounding& out);
    /// from + n / d * way, each coordinate rounded to nearest.
    static bool round_place(Vec2 from, const Enclosed& n, const Enclosed& d, const Vector& way, Vec2& out);
    /// v / |v|, to within a unit in the last place.
    static Vec2 direction(const Vector& v);
};

/// Arithmetic without rounding.
struct Whole {
    using Number = Exact;
    struct Vector {
        Exact x, y;
    };

    static Vector vector(Vec2 v) { return {Exact(v.x), Exact(v.y)}; }
    static Vector difference(Vec2 to, Vec2 from) {
        return {Exact(to.x) - Exact(from.x), Exact(to.y) - Exact(from.y)};
    }

    static bool round_ratio(const Exact& n, const Exact& d, Rounding& out);
    static bool round_over_root(const Exact& n, const Exact& d, Rounding& out);
    static bool round_root(const Exact& x, Rounding& out);
    static bool round_place(Vec2 from, const Exact& n, const Exact& d, const Vector& way, Vec2& out);
    static Vec2 direction(const Vector& v);
};

inline Exact dot(const Whole::Vector& a, const Whole::Vector& b) { return a.x * b.x + a.y * b.y; }

/// Asks in Wide, where numbers are of ordinary size, and in Whole if that could not tell; `question` takes
/// the arithmetic as an argument.  Returns the rung that answered.
template <class Question>
Rung climb(bool in_range, const Question& question) {
    if (in_range && question(Wide{})) {
        return Rung::wide;
    }
    question(Whole{});
    return Rung::exact;
}

/// Two points whose difference, turned by -90 degrees, is an axis: an edge's ends; for the tip of a segment
/// such that the axis points along it; else the tip's axis as it is.
struct AxisEnds {
    Vec2 from, to;
};
AxisEnds ends_of(const PolygonPair& pair, AxisOf axis);

template <class A>
typename A::Vector normal_of(const PolygonPair& pair, AxisOf axis) {
    const AxisEnds ends = ends_of(pair, axis);
    const typename A::Vector edge = A::difference(ends.to, ends.from);
    return {edge.y, -edge.x};
}

/// From the base of an axis to a vertex of the other polygon.
template <class A>
typename A::Vector across(const PolygonPair& pair, AxisOf axis, std::size_t vertex) {
    const PairedPolygon& p = pair.side(axis.side);
    return A::difference(pair.other(axis.side).ring[vertex], p.ring[p.base(axis.index)]);
}

/// Whether the difference of the polygons has no area.  Then tips bound it too, otherwise edges are enough.
bool is_flat(const PolygonPair& pair);

/// Axes of a polygon that bound the difference.
inline std::size_t axes_of(const PairedPolygon& p, bool flat) { return flat ? p.axes : p.edges; }

/// The vertex of the other polygon that is lowest along one of those axes, and the sign of the gap: exactly.
Level lowest_along(const PolygonPair& pair, AxisOf axis);
int sign_of_gap(const PolygonPair& pair, AxisOf axis, std::size_t lowest);

/// How two polygons lie.
enum class Relation { apart, touching, overlapping };

/// Exactly; `touching` gets the axes along which the gap is zero.  `most` tells which work array holds upper
/// bounds of the gaps.
Relation relation_of(const PolygonPair& pair, bool flat, std::size_t most, std::vector<AxisOf>& touching);

/// Whether direction p comes before q in the order of angles in [0, 360) degrees, each given by two points.
bool is_before(const AxisEnds& p, const AxisEnds& q);

/// The same for two axes, as directions from a to b: to choose between equals, however vertices are numbered.
bool is_before(const PolygonPair& pair, AxisOf p, AxisOf q);

}  // namespace geomsrv
