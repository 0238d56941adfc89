// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
#include "geom/exact_feature.hpp"

#include <cmath>

namespace geomsrv {

namespace {

bool known_exactly(const Enclosed& x) { return x.error == 0.0 && x.value.lo == 0.0; }

}  // namespace

bool round_root(const Enclosed& numerator, const Enclosed& denominator, Rounding& out) {
    const Enclosed root = root_of(numerator) / root_of(denominator);
    if (known_exactly(numerator) && known_exactly(denominator)) {
        // A double may be the root itself; of numbers with few bits the test is free of rounding.
        const Enclosed candidate(root.value.hi);
        if (sign_of(candidate * candidate * denominator - numerator) == 0) {
            out = {root.value.hi, root.value.hi, root.value.hi};
            return true;
        }
    }
    return round_enclosed(root, out);
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

bool Feature::holds_foot() {
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
    if (vertices_.count == 3) {
        return k_.sign([&](auto* out) { out[0] = in<NumberOf<decltype(out)>>().residue.x; });
    }
    if (k_.in_range()) {
        // One part that is not zero is enough.
        const VectorOf<Enclosed>& r = in<Enclosed>().residue;
        for (const Enclosed* x : {&r.x, &r.y, &r.z}) {
            const int sign = sign_of(*x);
            if (sign != 0 && sign != kUncertain) {
                return 1;
            }
        }
    }
    int sign[3];
    k_.signs<3>(
        [&](auto* out) {
            const auto& r = in<NumberOf<decltype(out)>>().residue;
            out[0] = r.x;
            out[1] = r.y;
            out[2] = r.z;
        },
        sign);
    return sign[0] != 0 || sign[1] != 0 || sign[2] != 0 ? 1 : 0;
}

Vec3 Feature::direction() {
    Vec3 out;
    if (k_.in_range() && direction_of(in<Enclosed>().along, out)) {
        k_.climb(Rung::wide);
    } else {
        k_.climb(Rung::exact);
        out = direction_of(in<Exact>().along);
    }
    return normalized(out);
}

Rounding Feature::length() {
    const double weight = k_.denominator_a() * k_.denominator_b();
    Rounding out;
    if (k_.in_range()) {
        const FeatureOf<Enclosed>& here = in<Enclosed>();
        const Enclosed square = Enclosed(k_.denominator_a()) * Enclosed(k_.denominator_b());
        const Enclosed divisor = weight == 1.0 ? here.divisor : square * square * here.divisor;
        if (round_root(here.numerator(), divisor, out)) {
            k_.climb(Rung::wide);
            return out;
        }
    }
    k_.climb(Rung::exact);
    const FeatureOf<Exact>& here = in<Exact>();
    const Exact product = Exact(k_.denominator_a()) * Exact(k_.denominator_b());
    return rounded_root(here.numerator(), here.divisor * product * product);
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
