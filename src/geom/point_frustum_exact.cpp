// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
#include "geom/point_frustum_exact.hpp"

#include <algorithm>
#include <cmath>

namespace geomsrv {

namespace {

constexpr int kLeft = 1, kUp = 2, kFar = 4;  // bits of a corner's number

Frustum in_space(const View<2>& view) {
    const auto& a = view.axes.row;
    return {.origin = {view.origin[0], view.origin[1], view.origin[2]},
            .axes = {{{a[0][0], a[0][1], a[0][2]}, {a[1][0], a[1][1], a[1][2]}, {a[2][0], a[2][1], a[2][2]}}},
            .l0 = view.low[0],
            .l1 = view.high[0],
            .u0 = view.low[1],
            .u1 = view.high[1],
            .near = view.near,
            .far = view.far};
}
/// Flat: its corners up are those down.
Frustum in_space(const View<1>& view) {
    const auto& a = view.axes.row;
    return {.origin = {view.origin[0], view.origin[1], 0.0},
            .axes = {{{a[0][0], a[0][1], 0.0}, {0.0, 0.0, 1.0}, {a[1][0], a[1][1], 0.0}}},
            .l0 = view.low[0],
            .l1 = view.high[0],
            .u0 = 0.0,
            .u1 = 0.0,
            .near = view.near,
            .far = view.far};
}

/// What all of the corners have in common, as digit of a region: 0 nothing, 1 the bit, 2 that they lack it.
int digit_of(const Witness& simplex, int bit) {
    int set = 0;
    for (int i = 0; i < simplex.count; ++i) set += (simplex.a[i] & bit) != 0 ? 1 : 0;
    return set == simplex.count ? 1 : set == 0 ? 2 : 0;
}

/// Coordinates of a corner relative to the apex.
struct LongVec3 {
    long double x, y, z;
};
LongVec3 corner_from_apex(const Frustum& f, int corner) {
    const long double left = (corner & kLeft) != 0 ? f.l1 : f.l0;
    const long double up = (corner & kUp) != 0 ? f.u1 : f.u0;
    const long double near = f.near;
    const long double ratio = (corner & kFar) != 0 ? f.far / near : 1.0L;
    const auto& [l, u, d] = f.axes.row;
    return {ratio * (left * l.x + up * u.x + near * d.x), ratio * (left * l.y + up * u.y + near * d.y),
            ratio * (left * l.z + up * u.z + near * d.z)};
}
long double size_of(const LongVec3& v) { return std::max({std::fabs(v.x), std::fabs(v.y), std::fabs(v.z)}); }
Vec3 scaled(const LongVec3& v, int exponent) {
    const auto part = [&](long double x) { return static_cast<double>(std::scalbn(x, -exponent)); };
    return {part(v.x), part(v.y), part(v.z)};
}

// A rough vertex is off by at most 5 roundings in long double and one to double, of parts no longer than the
// reach: far less than 2 u of it in each coordinate.
constexpr double kRoughError = 4 * kUnitRoundoff;

// exact_separation multiplies up to eight lengths and near depths.
constexpr double kWideSmallest = 0x1p-100;
constexpr double kWideLargest = 0x1p100;

bool is_ordinary(long double x) { return x > kWideSmallest && x < kWideLargest; }

ExactBody body_of(const Frustum& frustum) {
    ExactBody body;
    body.kind = ExactBody::Kind::frustum;
    body.frustum = &frustum;
    return body;
}

template <int Sides>
Vec3 in_space(const double* point) {
    return {point[0], point[1], Sides == 2 ? point[2] : 0.0};
}

double rounded(const Exact& numerator, const Exact& denominator, bool&) {
    return rounded_quotient(numerator, denominator).nearest;
}
double rounded(const Enclosed& numerator, const Enclosed& denominator, bool& certain) {
    Rounding out;
    certain = certain && round_enclosed(numerator / denominator, out);
    return out.nearest;
}

/// A point and up to three corners minus it, all times near.
template <class N>
struct Corners {
    N near;
    VectorOf<N> x, w[3];

    Corners(const Frustum& frustum, Vec3 point, const int* corner, int count)
        : near(frustum.near), x(near * exactly<N>(point)) {
        const ExactBody body = body_of(frustum);
        const VectorOf<N> from_apex = near * (exactly<N>(point) - exactly<N>(frustum.origin));
        for (int i = 0; i < std::min(count, 3); ++i) {
            w[i] = arm_times_denominator<N>(body, corner[i]) - from_apex;
        }
    }
    [[nodiscard]] VectorOf<N> edge() const { return w[1] - w[0]; }
    [[nodiscard]] VectorOf<N> normal() const { return cross(edge(), w[2] - w[0]); }
};

/// Distance of the point from the corner, or the line or plane through two or three.
Enclosed distance_from(const Corners<Enclosed>& c, int count) {
    if (count == 1) return root_of(dot(c.w[0], c.w[0])) / c.near;
    if (count == 2) {
        const auto e = c.edge(), area = cross(c.w[0], e);
        return root_of(dot(area, area) / dot(e, e)) / c.near;
    }
    const auto n = c.normal();
    const Enclosed height = dot(n, c.w[0]);
    return (height.value.hi < 0.0 ? -height : height) / (root_of(dot(n, n)) * c.near);
}

/// The point of it nearest to the point, each coordinate correctly rounded; false if this arithmetic cannot
/// tell.
template <class N>
bool foot(const Corners<N>& c, int count, double* out) {
    VectorOf<N> numerator = c.x + c.w[0];
    N denominator = c.near;
    if (count == 2) {
        const VectorOf<N> e = c.edge();
        const N square = dot(e, e);
        numerator = square * numerator - dot(c.w[0], e) * e;
        denominator = square * c.near;
    } else if (count >= 3) {
        const VectorOf<N> n = c.normal();
        const N square = dot(n, n);
        numerator = square * c.x + dot(c.w[0], n) * n;
        denominator = square * c.near;
    }
    bool certain = true;
    out[0] = rounded(numerator.x, denominator, certain);
    out[1] = rounded(numerator.y, denominator, certain);
    out[2] = rounded(numerator.z, denominator, certain);
    return certain;
}

/// Whether the point is on the second corner's side of the line from the first to the third; kUncertain.
template <class N>
int side_of_diagonal(const Corners<N>& c) {
    const VectorOf<N> diagonal = c.w[2] - c.w[0];
    return sign_of(dot(cross(c.w[0], diagonal), cross(diagonal, c.edge())));
}

}  // namespace

template <int Sides>
ExactPointFrustum<Sides>::ExactPointFrustum(const View<Sides>& view) : frustum_(geomsrv::in_space(view)) {
    LongVec3 corners[8];
    long double least = view.near, most = view.near;
    for (int i = 0; i < 8; ++i) {
        corners[i] = corner_from_apex(frustum_, i);
        most = std::max(most, size_of(corners[i]));
    }
    exponent_ = std::ilogb(most);
    for (int i = 0; i < 8; ++i) {
        const Vec3 rough = scaled(corners[i], exponent_);
        rough_[0][i] = rough.x;
        rough_[1][i] = rough.y;
        rough_[2][i] = rough.z;
    }
    for (const double x : view.origin) most = std::max<long double>(most, std::fabs(x));
    in_range_ = is_ordinary(least) && is_ordinary(most) && is_ordinary(view.far);

    for (int k = 0; k <= Sides; ++k) {
        bool upright = std::fabs(view.axes.row[Sides][k]) == 1.0;
        for (int i = 0; i < Sides; ++i) upright &= view.axes.row[i][k] == 0.0;
        if (upright) {
            axis_ = k;
            forward_ = view.axes.row[Sides][k];
        }
    }
}

template <int Sides>
Vec3 ExactPointFrustum<Sides>::rough_corner(int index) const {
    return {rough_[0][index], rough_[1][index], rough_[2][index]};
}

template <int Sides>
auto ExactPointFrustum<Sides>::feature_of(int region) -> Feature {
    const auto matches = [](int digit, bool bit) { return digit == 0 || (digit == 1) == bit; };
    Feature feature;
    for (int i = 0; i < 8; ++i) {
        const bool doubled = Sides == 1 && (i & kUp) != 0;
        // Depth counts the other way: 1 is near, 2 far.
        if (!doubled && matches(region % 3, (i & kLeft) != 0) && matches(region / 3 % 3, (i & kUp) != 0) &&
            matches(region / 9, (i & kFar) == 0)) {
            feature.corner[feature.count++] = i;
        }
    }
    return feature;
}

template <int Sides>
Witness ExactPointFrustum<Sides>::part_near(const Feature& feature, Vec3 point) const {
    Witness part;
    if (feature.count == 8) {
        part.count = 4;
        constexpr int kTetrahedron[4] = {0, 3, 5, 6};
        std::copy_n(kTetrahedron, 4, part.a);
        return part;
    }
    part.count = std::min(feature.count, 3);
    std::copy_n(feature.corner, part.count, part.a);
    if (feature.count == 4) {
        const Vec3 start = rough_corner(part.a[0]), diagonal = rough_corner(feature.corner[3]) - start;
        const Vec3 normal = cross(diagonal, rough_corner(part.a[1]) - start);
        if (dot(cross(diagonal, point - start), normal) < 0.0) part.a[1] = part.a[2];
        part.a[2] = feature.corner[3];
    }
    return part;
}

template <int Sides>
ExactPointDistance ExactPointFrustum<Sides>::distance(const double* point, int guess) const {
    const Vec3 x = in_space<Sides>(point);
    const LongVec3 from_apex{static_cast<long double>(x.x) - frustum_.origin.x,
                             static_cast<long double>(x.y) - frustum_.origin.y,
                             static_cast<long double>(x.z) - frustum_.origin.z};
    // In the unit of the frustum; far beyond it, in one in which the frustum is small.
    constexpr int kMuchFarther = 60;
    const long double size = size_of(from_apex);
    int exponent = exponent_;
    double shrunk[3][8];
    const double* corners = rough_[0];
    if (size > 0.0L && std::ilogb(size) > exponent_ + kMuchFarther) {
        exponent = std::ilogb(size);
        for (int k = 0; k < 3; ++k) {
            for (int i = 0; i < 8; ++i) shrunk[k][i] = std::scalbn(rough_[k][i], exponent_ - exponent);
        }
        corners = shrunk[0];
    }
    // No coordinate of a corner is 2 or more, so none is longer than 4.
    Core rough_frustum;
    rough_frustum.points = corners;
    rough_frustum.count = 8;
    rough_frustum.reach = 4.0;
    rough_frustum.error = 4.0 * kRoughError;
    Core rough_point;
    rough_point.center = scaled(from_apex, exponent);
    rough_point.reach = 2.0 * static_cast<double>(std::scalbn(size, -exponent));
    rough_point.error = kRoughError * rough_point.reach;

    const ExactBody frustum = body_of(frustum_);
    ExactBody apart;
    apart.center = x;
    const double most = std::max({std::fabs(x.x), std::fabs(x.y), std::fabs(x.z)});
    const ExactSeparation found =
        exact_separation({frustum, rough_frustum}, {apart, rough_point},
                         part_near(feature_of(guess), rough_point.center), in_range_ && most < kWideLargest);
    ExactPointDistance out{.distance = found.distance, .simplex = found.simplex, .rung = found.rung};
    if (!found.meet) {
        const int height = Sides == 2 ? digit_of(found.simplex, kUp) : 0;
        const int depth = digit_of(found.simplex, kFar);
        out.region = static_cast<std::uint8_t>(digit_of(found.simplex, kLeft) + 3 * height +
                                               (depth == 0 ? 0 : 9 * (3 - depth)));
    }
    return out;
}

template <int Sides>
bool ExactPointFrustum<Sides>::wide_distance(const double* point, int region, Rounding& out) const {
    if (!in_range_ || region == 0) return false;
    const Feature feature = feature_of(region);
    return round_enclosed(
        distance_from({frustum_, in_space<Sides>(point), feature.corner, feature.count}, feature.count), out);
}

template <int Sides>
void ExactPointFrustum<Sides>::nearest(const double* point, int region, double* out) const {
    if (region == 0) {
        std::copy_n(point, Sides + 1, out);
        return;
    }
    const Feature feature = feature_of(region);
    const Vec3 x = in_space<Sides>(point);
    double y[3];
    if (!in_range_ || !foot<Enclosed>({frustum_, x, feature.corner, feature.count}, feature.count, y)) {
        foot<Exact>({frustum_, x, feature.corner, feature.count}, feature.count, y);
    }
    std::copy_n(y, Sides + 1, out);
}

template <int Sides>
Witness ExactPointFrustum<Sides>::simplex(const double* point, int region) const {
    if (region == 0) return distance(point, region).simplex;
    const Feature feature = feature_of(region);
    Witness part;
    part.count = std::min(feature.count, 3);
    std::copy_n(feature.corner, part.count, part.a);
    if (feature.count == 4) {
        part.a[2] = feature.corner[3];
        const Vec3 x = in_space<Sides>(point);
        int side = in_range_ ? side_of_diagonal<Enclosed>({frustum_, x, part.a, 3}) : kUncertain;
        if (side == kUncertain) side = side_of_diagonal<Exact>({frustum_, x, part.a, 3});
        if (side < 0) part.a[1] = feature.corner[2];
    }
    return part;
}

template <int Sides>
bool ExactPointFrustum<Sides>::along_axis(const double* point, int region, Rounding& out) const {
    if (axis_ < 0 || (region != 9 && region != 18)) return false;
    const double origin = axis_ == 0 ? frustum_.origin.x : axis_ == 1 ? frustum_.origin.y : frustum_.origin.z;
    const DoubleDouble height = two_sum(point[axis_], -origin);
    if (height.lo != 0.0) return false;
    // Beyond the far plane, or short of the near one.
    DoubleDouble gap = two_sum(forward_ * height.hi, region == 18 ? -frustum_.far : -frustum_.near);
    if (region == 9) gap = -gap;
    out = {gap.hi, gap.lo < 0.0 ? next_down(gap.hi) : gap.hi, gap.lo > 0.0 ? next_up(gap.hi) : gap.hi};
    return true;
}

template class ExactPointFrustum<1>;
template class ExactPointFrustum<2>;

}  // namespace geomsrv
