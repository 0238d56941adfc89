// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
// Convex polytopes by the caller's numbers, taken literally: every vertex is a polynomial in them, evaluated
// in whatever arithmetic is asked for (Exact, Enclosed).
//
// Vertices are numbered as in Core: a zonotope's by the bits of the generators added, a hull's as listed.  A
// frustum's number is 4 far + 2 up + left, each bit set for the far plane, the +U side (u1), the +L side
// (l1).
#pragma once

#include <cstddef>
#include <cstdint>
#include <type_traits>

#include "geom/enclosed.hpp"
#include "geom/exact_number.hpp"
#include "geom/frustum.hpp"
#include "geom/lanes.hpp"
#include "geom/vec.hpp"

namespace geomsrv {

template <class Number>
struct VectorOf {
    Number x, y, z;
};

template <class N>
VectorOf<N> operator+(const VectorOf<N>& a, const VectorOf<N>& b) {
    return {a.x + b.x, a.y + b.y, a.z + b.z};
}
template <class N>
VectorOf<N> operator-(const VectorOf<N>& a, const VectorOf<N>& b) {
    return {a.x - b.x, a.y - b.y, a.z - b.z};
}
template <class N>
VectorOf<N> operator-(const VectorOf<N>& a) {
    return {-a.x, -a.y, -a.z};
}
template <class N>
VectorOf<N> operator*(const N& s, const VectorOf<N>& a) {
    return {s * a.x, s * a.y, s * a.z};
}
template <class N>
GEOMSRV_INLINE N dot(const VectorOf<N>& a, const VectorOf<N>& b) {
    return a.x * b.x + a.y * b.y + a.z * b.z;
}
template <class N>
GEOMSRV_INLINE VectorOf<N> cross(const VectorOf<N>& a, const VectorOf<N>& b) {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
template <class N>
VectorOf<N> exactly(Vec3 a) {
    return {N(a.x), N(a.y), N(a.z)};
}

constexpr bool is_zero(Vec3 v) { return v.x == 0.0 && v.y == 0.0 && v.z == 0.0; }

/// A convex polytope; pointers belong to the caller.
struct ExactBody {
    enum class Kind : std::uint8_t {
        zonotope,  ///< center + all sums of +-half[i] * axis[i]: point, segment, box
        hull,      ///< of rotation * listed point + center
        frustum,   ///< rotation * corner of `frustum` + center
    };
    Kind kind = Kind::zonotope;
    Vec3 center;
    int generators = 0;
    Vec3 axis[3];
    double half[3] = {};
    const double* points = nullptr;  ///< x y z of each, as given
    int listed = 0;
    const Mat3* rotation = nullptr;  ///< nullptr for none
    const Frustum* frustum = nullptr;

    [[nodiscard]] int count() const {
        return kind == Kind::hull ? listed : kind == Kind::frustum ? 8 : 1 << generators;
    }

    /// What every vertex is multiplied by, to be free of divisions: near depth of a frustum, which has far
    /// corners at far / near; 1 for the others.
    [[nodiscard]] double denominator() const { return kind == Kind::frustum ? frustum->near : 1.0; }

    /// A point near the vertices, given literally: two bodies far from the origin are compared from there.
    [[nodiscard]] Vec3 anchor() const { return starts_at_apex() ? frustum->origin : center; }

    /// A zonotope or a hull: its vertices are short sums of products.
    [[nodiscard]] bool is_plain() const { return kind != Kind::frustum; }
    /// A listed point, of a hull only.
    [[nodiscard]] Vec3 listed_point(int vertex) const {
        const double* p = points + 3 * static_cast<std::ptrdiff_t>(vertex);
        return {p[0], p[1], p[2]};
    }
    /// Whether the listed points are meant as they are.
    [[nodiscard]] bool is_unmoved() const { return rotation == nullptr && is_zero(center); }
    /// A point given literally from which few numbers lead to a vertex; of a plain body only.
    [[nodiscard]] Vec3 base_of(int vertex) const {
        return kind == Kind::hull && is_unmoved() ? listed_point(vertex) : center;
    }

    /// A frustum that is where its own numbers say.
    [[nodiscard]] bool starts_at_apex() const { return kind == Kind::frustum && is_unmoved(); }
};

/// factor * a, at no cost for the usual factor 1.
template <class N>
VectorOf<N> scaled(double factor, const VectorOf<N>& a) {
    return factor == 1.0 ? a : N(factor) * a;
}

template <class N>
VectorOf<N> rotated(const Mat3* rotation, const VectorOf<N>& a) {
    if (rotation == nullptr) {
        return a;
    }
    return {dot(exactly<N>(rotation->row[0]), a), dot(exactly<N>(rotation->row[1]), a),
            dot(exactly<N>(rotation->row[2]), a)};
}

/// Half an edge of a zonotope.
template <class N>
VectorOf<N> generator_of(const ExactBody& body, int i) {
    constexpr std::type_identity<N> kNumber;
    const double h = body.half[i];
    const Vec3 axis = body.axis[i];
    return {product_of(h, axis.x, kNumber), product_of(h, axis.y, kNumber), product_of(h, axis.z, kNumber)};
}

/// A vertex minus the body's anchor, times its denominator.
template <class N>
VectorOf<N> arm_times_denominator(const ExactBody& body, int vertex) {
    switch (body.kind) {
        case ExactBody::Kind::zonotope: {
            const auto turned = [&](int i) {
                const VectorOf<N> g = generator_of<N>(body, i);
                return (vertex >> i & 1) != 0 ? g : -g;
            };
            VectorOf<N> v = body.generators > 0 ? turned(0) : exactly<N>({});
            for (int i = 1; i < body.generators; ++i) {
                v = v + turned(i);
            }
            return v;
        }
        case ExactBody::Kind::hull: {
            return rotated(body.rotation, exactly<N>(body.listed_point(vertex)));
        }
        case ExactBody::Kind::frustum:
            break;
    }
    const Frustum& f = *body.frustum;
    const N left((vertex & 1) != 0 ? f.l1 : f.l0);
    const N up((vertex & 2) != 0 ? f.u1 : f.u0);
    // s (l L + u U + n D) from the apex, s = far / near or near / near; times n.
    const VectorOf<N> ray = N((vertex & 4) != 0 ? f.far : f.near) *
                            (left * exactly<N>(f.axes.row[0]) + up * exactly<N>(f.axes.row[1]) +
                             N(f.near) * exactly<N>(f.axes.row[2]));
    return body.starts_at_apex() ? ray : rotated(body.rotation, ray + N(f.near) * exactly<N>(f.origin));
}

/// A vertex times the body's denominator.
template <class N>
VectorOf<N> vertex_times_denominator(const ExactBody& body, int vertex) {
    return scaled(body.denominator(), exactly<N>(body.anchor())) + arm_times_denominator<N>(body, vertex);
}

/// From one vertex to another, times the body's denominator; what they have in common is left out.
template <class N>
VectorOf<N> step_times_denominator(const ExactBody& body, int from, int to) {
    if (body.kind == ExactBody::Kind::zonotope) {
        VectorOf<N> step = exactly<N>({});
        bool moved = false;
        for (int i = 0; i < body.generators; ++i) {
            if ((from >> i & 1) == (to >> i & 1)) {
                continue;
            }
            const VectorOf<N> g = generator_of<N>(body, i);
            const VectorOf<N> up = {twice(g.x), twice(g.y), twice(g.z)};
            const VectorOf<N> edge = (to >> i & 1) != 0 ? up : -up;
            step = moved ? step + edge : edge;
            moved = true;
        }
        return step;
    }
    if (body.kind == ExactBody::Kind::hull) {
        return rotated(body.rotation,
                       exactly<N>(body.listed_point(to)) - exactly<N>(body.listed_point(from)));
    }
    return arm_times_denominator<N>(body, to) - arm_times_denominator<N>(body, from);
}

}  // namespace geomsrv
