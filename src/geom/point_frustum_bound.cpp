// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
#include "geom/point_frustum_bound.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace geomsrv {

namespace {

// Corners and the centre, in long double: 6 roundings of 2^-64 in each coordinate (ratio, products, sums,
// apex), of terms that are together less than 2 times the largest length involved; as vectors less than 24,
// and 8 for the length of a difference.
constexpr double kCornerError = 0x1p-64 * 32.0;

template <int Sides>
struct Place {
    long double at[Sides + 1];
};

/// Apex + ratio * (sum x_i axis_i + near * view).
template <int Sides>
Place<Sides> along(const View<Sides>& view, const long double (&x)[Sides], long double ratio) {
    Place<Sides> p;
    for (int k = 0; k <= Sides; ++k) {
        long double sum = static_cast<long double>(view.near) * view.axes.row[Sides][k];
        for (int i = 0; i < Sides; ++i) sum += x[i] * view.axes.row[i][k];
        p.at[k] = ratio * sum;
    }
    return p;
}

template <int Sides>
long double norm(const Place<Sides>& p) {
    long double square = 0.0L;
    for (const long double x : p.at) square += x * x;
    return std::sqrt(square);
}

double round_up(long double x) {
    const double rounded = static_cast<double>(x);
    return rounded < x ? next_up(rounded) : rounded;
}
double round_down(long double x) { return -round_up(-x); }

}  // namespace

template <int Sides>
BoundingSphere<Sides> bounding_sphere(const View<Sides>& view) {
    // On the ray through the middle of the window, as far from the corners of the near plane as from those of
    // the far plane; in the far plane at the most.
    long double middle[Sides], ray_square = static_cast<long double>(view.near) * view.near,
                               half_square = 0.0L;
    for (int i = 0; i < Sides; ++i) {
        middle[i] = (static_cast<long double>(view.low[i]) + view.high[i]) / 2;
        const long double half = (static_cast<long double>(view.high[i]) - view.low[i]) / 2;
        ray_square += middle[i] * middle[i];
        half_square += half * half;
    }
    const long double ratio = view.far / static_cast<long double>(view.near);
    const long double depth = std::min(ratio, (ratio + 1) / 2 * (1 + half_square / ray_square));
    const Place<Sides> center = along(view, middle, depth);

    BoundingSphere<Sides> sphere;
    sphere.radius = 0.0L;
    long double size = norm(center);
    for (int corner = 0; corner < 2 << Sides; ++corner) {
        long double x[Sides];
        for (int i = 0; i < Sides; ++i) x[i] = (corner >> i & 1) != 0 ? view.high[i] : view.low[i];
        Place<Sides> p = along(view, x, corner >> Sides != 0 ? ratio : 1.0L);
        size = std::max(size, norm(p));
        for (int k = 0; k <= Sides; ++k) p.at[k] -= center.at[k];
        sphere.radius = std::max(sphere.radius, norm(p));
    }
    for (int k = 0; k <= Sides; ++k) {
        sphere.center[k] = view.origin[k] + center.at[k];
        size = std::max(size, std::fabs(sphere.center[k]));
    }
    sphere.off = kCornerError * size;
    sphere.radius += 2 * sphere.off;
    return sphere;
}

template <int Sides>
SphereFrame<Sides>::SphereFrame(const BoundingSphere<Sides>& sphere) {
    long double moved = 0.0L;
    for (int k = 0; k <= Sides; ++k) {
        const auto rounded = static_cast<double>(sphere.center[k]);
        center[k] = rounded;
        moved += std::fabs(rounded - sphere.center[k]);
    }
    radius = round_up(sphere.radius + moved);
    off = round_up(sphere.off + moved);
}

template <int Sides>
PlainBounds distance_bounds(const BoundingSphere<Sides>& sphere, const double* point) {
    Place<Sides> p;
    for (int k = 0; k <= Sides; ++k) p.at[k] = point[k] - sphere.center[k];
    const long double distance = norm(p);
    const auto error = static_cast<long double>(kCenterError);
    return {std::max(round_down(distance * (1 - error) - sphere.radius), 0.0),
            round_up((distance + sphere.off) * (1 + error))};
}

template BoundingSphere<1> bounding_sphere(const View<1>&);
template BoundingSphere<2> bounding_sphere(const View<2>&);
template struct SphereFrame<1>;
template struct SphereFrame<2>;
template PlainBounds distance_bounds(const BoundingSphere<1>&, const double*);
template PlainBounds distance_bounds(const BoundingSphere<2>&, const double*);

}  // namespace geomsrv
