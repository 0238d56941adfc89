// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
#include "geom/exact_feature.hpp"

#include <cmath>

#include "geom/lanes.hpp"
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
    return std::max({v.x.error, v.y.error, v.z.error}) <= kNextToNothing * size;
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

template <bool Fused>
GEOMSRV_INLINE void evaluate_in_pairs(const Difference& k, const Witness& s, FeatureOf<Enclosed>& out) {
    const ExactBody& a = k.a().exact;
    const ExactBody& b = k.b().exact;
    const auto without_rest = [](Vec3 x, Vec3 y) {
        const WideVec3 d = exact_difference(x, y);
        return VectorOf<Pair<Fused>>{{d.x.hi, d.x.lo}, {d.y.hi, d.y.lo}, {d.z.hi, d.z.lo}};
    };
    VectorOf<Pair<Fused>> v[3] = {};  // a vertex, and the steps from it
    v[0] = without_rest(b.base_of(s.b[0]), a.base_of(s.a[0]));
    for (const ExactBody* body : {&a, &b}) {
        const int* const vertex = body == &a ? s.a : s.b;
        for (int i = 1; i < s.count && body->kind == ExactBody::Kind::hull; ++i) {
            const VectorOf<Pair<Fused>> step =
                without_rest(body->base_of(vertex[i]), body->base_of(vertex[0]));
            v[i] = body == &a ? v[i] - step : v[i] + step;
        }
        for (int g = 0; g < body->generators; ++g) {
            const double half = body == &a ? -body->half[g] : body->half[g];
            const int bit = vertex[0] >> g & 1;
            add(v[0], bit != 0 ? half : -half, body->axis[g]);
            for (int i = 1; i < s.count; ++i) {
                if ((vertex[i] >> g & 1) != bit) {
                    add(v[i], bit != 0 ? -2.0 * half : 2.0 * half, body->axis[g]);
                }
            }
        }
    }
    const FeatureOf<Pair<Fused>> quick(s.count, v[0], v[1], v[2]);
    // A difference of two vertices, and all that it is the sum of, is no longer than this: the reaches cover
    // the way between the points and all half edges.
    const double longest = 2.0 * (k.a().rough.reach + k.b().rough.reach);
    const auto vector = [](const VectorOf<Pair<Fused>>& x, double most) {
        return VectorOf<Enclosed>{enclosed(x.x, most), enclosed(x.y, most), enclosed(x.z, most)};
    };
    out.count = quick.count;
    out.w = vector(quick.w, longest);
    if (out.count == 1) {
        out.along = out.residue = out.w;
        out.square = enclosed(quick.square, longest * longest);
        out.divisor = Enclosed(1.0);
        return;
    }
    // Of magnitudes, a cross product is no longer than sqrt(2) times the product of the lengths.
    const double area = 2.0 * longest * longest;
    out.e = vector(quick.e, longest);
    if (out.count == 2) {
        out.residue = vector(quick.residue, area);
        out.along = vector(quick.along, 2.0 * longest * area);
        out.square = enclosed(quick.square, area * area);
        out.divisor = enclosed(quick.divisor, longest * longest);
        return;
    }
    out.f = vector(quick.f, longest);
    out.along = vector(quick.along, area);
    out.residue.x = enclosed(quick.residue.x, area * longest);
    out.square = enclosed(quick.square, area * longest * area * longest);
    out.divisor = enclosed(quick.divisor, area * area);
}

#if defined(__x86_64__) && defined(__GNUC__)
// One binary serves every x86-64.
__attribute__((target("fma"), flatten)) void evaluate_fused(const Difference& k, const Witness& s,
                                                            FeatureOf<Enclosed>& out) {
    evaluate_in_pairs<true>(k, s, out);
}
bool is_fused() {
    static const bool known = __builtin_cpu_supports("fma") != 0;
    return known;
}
#else
void evaluate_fused(const Difference& k, const Witness& s, FeatureOf<Enclosed>& out) {
    evaluate_in_pairs<true>(k, s, out);
}
constexpr bool is_fused() { return false; }
#endif

}  // namespace

void evaluate_quickly(const Difference& k, const Witness& s, FeatureOf<Enclosed>& out) {
    if (is_fused()) {
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
