// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
#include "geom/exact_feature.hpp"

#include <cmath>
#include <limits>

#include "geom/lane_arithmetic.hpp"
#include "geom/pair.hpp"

namespace geomsrv {

namespace {

// Weights of a foot in doubles: a cross product of two vectors that are off by u each is off by 7 u of their
// lengths' product, its product with another such vector by 11 u of all three; their sum with the square of
// the last by 14 u and 9 u, rounded up.  An edge takes fewer.
constexpr double kFootError = 20 * kUnitRoundoff;

/// Whether what a vector loses in doubles is its own rounding, and next to nothing else.
bool rounded(const VectorOf<Enclosed>& v, Vec3& out) {
    constexpr double kNextToNothing = 0x1p-60;  // 2^-7 u, of the largest part
    out = {v.x.value.hi, v.y.value.hi, v.z.value.hi};
    const double size = std::max({std::fabs(out.x), std::fabs(out.y), std::fabs(out.z)});
    return std::max({v.x.error, v.y.error, v.z.error}) <= kNextToNothing * size &&
           size < std::numeric_limits<double>::infinity();
}

// Weights may move the foot by this much of the size of the feature, in terms of the bound above, which is
// some ten times what happens: more comes from slivers only, and they get weights from double-double.
constexpr double kFootDoubt = 128 * kUnitRoundoff;

/// Whether doubles prove that the foot lies within, and are good enough for its weights, which are set then.
bool surely_holds_foot(const FeatureOf<Enclosed>& here, double* weight) {
    Vec3 w;
    Vec3 e;
    Vec3 f;
    Vec3 n;
    if (here.count == 1) {
        weight[0] = 1.0;
        return true;
    }
    if (!rounded(here.w, w) || !rounded(here.e, e)) {
        return false;
    }
    if (here.count == 2) {
        const double divisor = dot(e, e);
        const double second = -dot(w, e);
        const double first = divisor - second;
        weight[0] = first / divisor;
        weight[1] = second / divisor;
        const double length = std::sqrt(divisor);
        return std::min(first, second) > kFootError * length * (length + norm(w));
    }
    if (!rounded(here.f, f) || !rounded(here.along, n)) {
        return false;
    }
    const double divisor = dot(n, n);
    const double second = dot(cross(f, w), n);
    const double third = dot(cross(w, e), n);
    const double first = divisor - second - third;
    weight[0] = first / divisor;
    weight[1] = second / divisor;
    weight[2] = third / divisor;
    const double length = std::sqrt(divisor);
    const double edges = norm(e) + norm(f);
    const double size = norm(w) + edges;
    const double doubt = kFootError * length * (length + norm(w) * edges);
    return std::min({first, second, third}) > doubt && doubt * edges <= kFootDoubt * divisor * size;
}

}  // namespace

bool round_root(const Enclosed& numerator, const Enclosed& denominator, Rounding& out) {
    // One Newton step from the root in doubles, q, which is good to 2 u: with r = numerator - q^2 denominator
    // it is q + r / (2 q denominator), up to roundings of the quotient (6 u of it) and what the step leaves
    // (2 u of it).
    constexpr double kStepError = 8 * kUnitRoundoff;
    const double q = std::sqrt(numerator.value.hi / denominator.value.hi);
    if (!(q > kSurelyNormal && q * kSurelyNormal < 1.0) ||
        denominator.error > kUnitRoundoff * denominator.value.hi) {
        return false;
    }
    const Enclosed rest = numerator - product_of(q, q, std::type_identity<Enclosed>{}) * denominator;
    if (sign_of(rest) == 0) {
        out = {q, q, q};
        return true;
    }
    const double slope = 2.0 * q * denominator.value.hi;
    const double step = rest.value.hi / slope;
    const double error = (rest.error / slope + kStepError * std::fabs(step)) * kBoundRounding;
    return round_enclosed({quick_two_sum(q, step), error}, out);
}

bool direction_of(const VectorOf<Enclosed>& v, Vec3& out) {
    // Far from both ends of the range of double, so that the length can be computed from squares.
    constexpr double kShortest = 0x1p-400;
    constexpr double kLongest = 0x1p400;
    out = {v.x.value.hi, v.y.value.hi, v.z.value.hi};
    const double size = std::max({std::fabs(out.x), std::fabs(out.y), std::fabs(out.z)});
    const double error = std::max({v.x.error, v.y.error, v.z.error});
    return error <= kUnitRoundoff * size && size > kShortest && size < kLongest;
}

Vec3 direction_of(const VectorOf<Exact>& v) {
    Exact size = v.x.magnitude();
    for (const Exact* other : {&v.y, &v.z}) {
        if (size < other->magnitude()) {
            size = other->magnitude();
        }
    }
    return {rounded_quotient(v.x, size).nearest, rounded_quotient(v.y, size).nearest,
            rounded_quotient(v.z, size).nearest};
}

namespace {

/// to += factor * axis
template <bool Fused>
GEOMSRV_INLINE void add(VectorOf<Pair<Fused>>& to, double factor, Vec3 axis) {
    constexpr std::type_identity<Pair<Fused>> kPair;
    to.x = to.x + product_of(factor, axis.x, kPair);
    to.y = to.y + product_of(factor, axis.y, kPair);
    to.z = to.z + product_of(factor, axis.z, kPair);
}

/// rotation * a, of a pair whose low part is the rest of one sum.
template <bool Fused>
GEOMSRV_INLINE VectorOf<Pair<Fused>> turned(const Mat3* rotation, const VectorOf<Pair<Fused>>& a) {
    if (rotation == nullptr) {
        return a;
    }
    const auto times = [](double factor, const Pair<Fused>& x) {
        const Pair<Fused> product = product_of(factor, x.hi, std::type_identity<Pair<Fused>>{});
        return Pair<Fused>{product.hi, product.lo + factor * x.lo};
    };
    const auto along = [&](Vec3 row) { return times(row.x, a.x) + times(row.y, a.y) + times(row.z, a.z); };
    return {along(rotation->row[0]), along(rotation->row[1]), along(rotation->row[2])};
}

double sum_of_parts(Vec3 v) { return std::fabs(v.x) + std::fabs(v.y) + std::fabs(v.z); }
double largest_part(Vec3 v) { return std::max({std::fabs(v.x), std::fabs(v.y), std::fabs(v.z)}); }

// No entry of a rotation made from unit quaternions is larger, see kRotationStretch in place.cpp.
constexpr double kLargestEntry = 1.0 + 0x1p-20;

template <bool Fused>
GEOMSRV_INLINE void evaluate_in_pairs(const Difference& k, const Witness& s, FeatureOf<Enclosed>& out) {
    const auto without_rest = [](Vec3 x, Vec3 y) {
        const WideVec3 d = exact_difference(x, y);
        return VectorOf<Pair<Fused>>{{d.x.hi, d.x.lo}, {d.y.hi, d.y.lo}, {d.z.hi, d.z.lo}};
    };
    const auto rounded_of = [](const VectorOf<Pair<Fused>>& x) { return Vec3{x.x.hi, x.y.hi, x.z.hi}; };
    VectorOf<Pair<Fused>> v[3] = {};  // a vertex, and the steps from it
    // No part of them is larger, nor what it is the sum of; never so small that a product of six underflows.
    double most[3] = {kSmallestReach, kSmallestReach, kSmallestReach};
    v[0] = without_rest(k.b().exact.base_of(s.b[0]), k.a().exact.base_of(s.a[0]));
    most[0] += largest_part(rounded_of(v[0]));
    for (const bool of_b : {false, true}) {
        const ExactAndRough& given = of_b ? k.b() : k.a();
        const ExactBody& body = given.exact;
        const int* const vertex = of_b ? s.b : s.a;
        const auto add_turned = [&](int i, const VectorOf<Pair<Fused>>& arm) {
            const VectorOf<Pair<Fused>> there = turned<Fused>(body.rotation, arm);
            v[i] = of_b ? v[i] + there : v[i] - there;
            most[i] += kLargestEntry * sum_of_parts(rounded_of(arm));
        };
        if (body.kind == ExactBody::Kind::hull) {
            if (!body.is_unmoved()) {
                add_turned(0, exactly<Pair<Fused>>(body.listed_point(vertex[0])));
            }
            for (int i = 1; i < s.count; ++i) {
                if (vertex[i] != vertex[0]) {
                    add_turned(i, without_rest(body.listed_point(vertex[i]), body.listed_point(vertex[0])));
                }
            }
            continue;
        }
        // The reach covers all half edges.
        most[0] += given.rough.reach;
        for (int i = 1; i < s.count; ++i) {
            most[i] += vertex[i] != vertex[0] ? 2.0 * given.rough.reach : 0.0;
        }
        for (int g = 0; g < body.generators; ++g) {
            const double half = of_b ? body.half[g] : -body.half[g];
            const int bit = vertex[0] >> g & 1;
            add(v[0], bit != 0 ? half : -half, body.axis[g]);
            for (int i = 1; i < s.count; ++i) {
                if ((vertex[i] >> g & 1) != bit) {
                    add(v[i], bit != 0 ? -2.0 * half : 2.0 * half, body.axis[g]);
                }
            }
        }
    }
    const FeatureOf<Pair<Fused>> quick(s.count, v[0], v[1], v[2]);
    const auto vector = [](const VectorOf<Pair<Fused>>& x, double at_most) {
        return VectorOf<Enclosed>{enclosed(x.x, at_most), enclosed(x.y, at_most), enclosed(x.z, at_most)};
    };
    // A part of a cross product is a sum of two products of parts, a dot product one of three.
    const auto [w, e, f] = most;
    out.count = quick.count;
    out.w = vector(quick.w, w);
    if (out.count == 1) {
        out.along = out.residue = out.w;
        out.square = enclosed(quick.square, 3.0 * w * w);
        out.divisor = Enclosed(1.0);
        return;
    }
    out.e = vector(quick.e, e);
    if (out.count == 2) {
        const double area = 2.0 * w * e;
        out.residue = vector(quick.residue, area);
        out.along = vector(quick.along, 2.0 * e * area);
        out.square = enclosed(quick.square, 3.0 * area * area);
        out.divisor = enclosed(quick.divisor, 3.0 * e * e);
        return;
    }
    const double area = 2.0 * e * f;
    const double volume = 3.0 * area * w;
    out.f = vector(quick.f, f);
    out.along = vector(quick.along, area);
    out.residue.x = enclosed(quick.residue.x, volume);
    out.square = enclosed(quick.square, volume * volume);
    out.divisor = enclosed(quick.divisor, 3.0 * area * area);
}

// Everything in it melts into it, to be compiled for its instruction set.
[[gnu::flatten]] GEOMSRV_FUSED void evaluate_fused(const Difference& k, const Witness& s,
                                                   FeatureOf<Enclosed>& out) {
    evaluate_in_pairs<true>(k, s, out);
}

}  // namespace

void evaluate_quickly(const Difference& k, const Witness& s, FeatureOf<Enclosed>& out) {
    if (has_fused()) {
        evaluate_fused(k, s, out);
    } else {
        evaluate_in_pairs<false>(k, s, out);
    }
}

bool Feature::holds_foot() {
    const auto surely = [&](const FeatureOf<Enclosed>& here) {
        return surely_holds_foot(here, vertices_.weight);
    };
    if (in_doubles(surely)) {
        return true;
    }
    int sign[3];
    k_.signs<3>(
        [&](auto* out) {
            using N = NumberOf<decltype(out)>;
            const FeatureOf<N>& here = in<N>();
            here.weights(out);
            for (int i = 0; i < here.count; ++i) {
                vertices_.weight[i] = ratio_of(out[i], here.divisor);
            }
        },
        sign);
    for (int i = 0; i < vertices_.count; ++i) {
        if (sign[i] != 1) {
            return false;
        }
    }
    return true;
}

int Feature::side() {
    int side = 0;
    const bool known = in_doubles([&](const FeatureOf<Enclosed>& here) {
        // One part that is not zero is enough, and of a face there is one only.
        bool zero = true;
        for (const Enclosed* x : {&here.residue.x, &here.residue.y, &here.residue.z}) {
            const int sign = sign_of(*x);
            if (sign == -1 || sign == 1) {
                side = here.count == 3 ? sign : 1;
                return true;
            }
            zero = zero && sign == 0;
        }
        return zero;
    });
    if (known) {
        k_.climb(Rung::wide);
        return side;
    }
    k_.climb(Rung::exact);
    const FeatureOf<Exact>& here = in<Exact>();
    if (here.count == 3) {
        return here.residue.x.sign();
    }
    return here.residue.x.sign() != 0 || here.residue.y.sign() != 0 || here.residue.z.sign() != 0 ? 1 : 0;
}

Vec3 Feature::direction() {
    Vec3 out;
    if (in_doubles([&](const FeatureOf<Enclosed>& here) { return direction_of(here.along, out); })) {
        k_.climb(Rung::wide);
    } else {
        k_.climb(Rung::exact);
        out = direction_of(in<Exact>().along);
    }
    return normalized(out);
}

Rounding Feature::length() {
    const double weight = k_.denominator_a() * k_.denominator_b();
    const Enclosed square = Enclosed(k_.denominator_a()) * Enclosed(k_.denominator_b());
    Rounding out;
    const bool known = in_doubles([&](const FeatureOf<Enclosed>& here) {
        return round_root(here.square, weight == 1.0 ? here.divisor : square * square * here.divisor, out);
    });
    if (known) {
        k_.climb(Rung::wide);
        return out;
    }
    k_.climb(Rung::exact);
    const FeatureOf<Exact>& here = in<Exact>();
    const Exact product = Exact(k_.denominator_a()) * Exact(k_.denominator_b());
    return rounded_root(here.square, here.divisor * product * product);
}

Level::Level(const Difference& k, const Witness& s) {
    // Pairs that share a vertex with a level one: the others of both are then level too.
    bool level[3] = {true, false, false};
    for (int round = 1; round < s.count; ++round) {
        for (int i = 0; i < s.count; ++i) {
            for (int j = 0; j < s.count; ++j) {
                level[i] = level[i] || (level[j] && (s.a[i] == s.a[j] || s.b[i] == s.b[j]));
            }
        }
    }
    for (int i = 0; i < s.count; ++i) {
        if (level[i]) {
            vertex_a_[count_] = s.a[i];
            vertex_b_[count_++] = s.b[i];
        }
        for (int j = 0; j < i; ++j) {
            add_axis_between(k, s, i, j);
        }
    }
}

/// Two vertices of K that differ by edges along one axis only: that axis is level.
void Level::add_axis_between(const Difference& k, const Witness& s, int i, int j) {
    const Vec3* found = nullptr;
    for (const bool of_b : {false, true}) {
        const ExactBody& body = of_b ? k.b().exact : k.a().exact;
        const int turned = of_b ? s.b[i] ^ s.b[j] : s.a[i] ^ s.a[j];
        if (turned != 0 && body.kind != ExactBody::Kind::zonotope) {
            return;
        }
        for (int g = 0; turned >> g != 0; ++g) {
            if ((turned >> g & 1) == 0 || body.half[g] == 0.0) {
                continue;
            }
            if (found != nullptr && !same_line(*found, body.axis[g])) {
                return;
            }
            found = &body.axis[g];
        }
    }
    if (found != nullptr) {
        axis_[axes_++] = *found;
    }
}

bool Level::has_axis(Vec3 axis) const {
    for (int i = 0; i < axes_; ++i) {
        if (same_line(axis_[i], axis)) {
            return true;
        }
    }
    return false;
}

}  // namespace geomsrv
