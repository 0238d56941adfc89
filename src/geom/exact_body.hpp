// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
// Convex polytopes by the caller's numbers, taken literally: every vertex is a polynomial in them, evaluated
// in whatever arithmetic is asked for (Exact, Enclosed).
//
// Vertices are numbered as in Core: a zonotope's by the bits of the generators added, a hull's as listed.  A
// frustum's number is 4 far + 2 up + left, each bit set for the far plane, the +U side (u1), the +L side
// (l1).
#pragma once

#include <cstdint>

#include "geom/enclosed.hpp"
#include "geom/exact_number.hpp"
#include "geom/frustum.hpp"
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
N dot(const VectorOf<N>& a, const VectorOf<N>& b) {
    return a.x * b.x + a.y * b.y + a.z * b.z;
}
template <class N>
VectorOf<N> cross(const VectorOf<N>& a, const VectorOf<N>& b) {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
template <class N>
VectorOf<N> exactly(Vec3 a) {
    return {N(a.x), N(a.y), N(a.z)};
}

/// A convex polytope; pointers belong to the caller.
struct ExactBody {
    enum class Kind : std::uint8_t {
        zonotope,  ///< center + all sums of +-half[i] * axis[i]: point, segment, box
        hull,      ///< of rotation * listed point + center
        frustum,
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
};

namespace detail {

template <class N>
VectorOf<N> frustum_corner(const Frustum& f, int corner) {
    const N left((corner & 1) != 0 ? f.l1 : f.l0);
    const N up((corner & 2) != 0 ? f.u1 : f.u0);
    const N near(f.near);
    const N reach((corner & 4) != 0 ? f.far : f.near);
    // E + far / near * (l L + u U + n D), times n; on the near plane the same with near / near.
    const VectorOf<N> ray =
        left * exactly<N>(f.axes.row[0]) + up * exactly<N>(f.axes.row[1]) + near * exactly<N>(f.axes.row[2]);
    return near * exactly<N>(f.origin) + reach * ray;
}

}  // namespace detail

/// A vertex times the body's denominator.
template <class N>
VectorOf<N> vertex_times_denominator(const ExactBody& body, int vertex) {
    switch (body.kind) {
        case ExactBody::Kind::zonotope: {
            VectorOf<N> v = exactly<N>(body.center);
            for (int i = 0; i < body.generators; ++i) {
                const double half = (vertex >> i & 1) != 0 ? body.half[i] : -body.half[i];
                v = v + N(half) * exactly<N>(body.axis[i]);
            }
            return v;
        }
        case ExactBody::Kind::hull: {
            const double* p = body.points + 3 * static_cast<std::ptrdiff_t>(vertex);
            const VectorOf<N> listed = exactly<N>({p[0], p[1], p[2]});
            if (body.rotation == nullptr) {
                return listed + exactly<N>(body.center);
            }
            const Mat3& r = *body.rotation;
            return VectorOf<N>{dot(exactly<N>(r.row[0]), listed), dot(exactly<N>(r.row[1]), listed),
                               dot(exactly<N>(r.row[2]), listed)} +
                   exactly<N>(body.center);
        }
        case ExactBody::Kind::frustum:
            break;
    }
    return detail::frustum_corner<N>(*body.frustum, vertex);
}

}  // namespace geomsrv
