// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
#include "geom/exact_cull.hpp"

#include <algorithm>
#include <bit>

namespace geomsrv {

namespace {

// Products of lengths have at most three factors, so nothing overflows in double-double up to here.
constexpr double kMostWide = 0x1p300;

/// Neither is known to be the larger one; but the maximum of two numbers is no further from that of their
/// estimates than either from its own.
Enclosed maximum(const Enclosed& a, const Enclosed& b) {
    return {a.value < b.value ? b.value : a.value, std::max(a.error, b.error)};
}
Exact maximum(const Exact& a, const Exact& b) { return a < b ? b : a; }
template <class N>
N minimum(const N& a, const N& b) {
    return -maximum(-a, -b);
}

bool parallel(Vec3 a, Vec3 b) {
    return (a.x == b.x && a.y == b.y && a.z == b.z) || (a.x == -b.x && a.y == -b.y && a.z == -b.z);
}

/// Axes that others stand for.  Where A_i is L or U, its cross products with edges of the frustum are normals
/// of planes, or null, and faces along A_i have the normals L x A_j or U x A_j.
std::uint32_t repeated_axes(const Frustum& frustum, const OrientedBox& box) {
    std::uint32_t repeated = 0;
    for (int i = 0; i < 3; ++i) {
        const Vec3 axis = box.axes.row[i];
        if (!parallel(axis, frustum.axes.row[0]) && !parallel(axis, frustum.axes.row[1])) continue;
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        for (const int number : {CullAxis::kFaces + j, CullAxis::kFaces + k, CullAxis::kLeft + i,
                                 CullAxis::kUp + i, CullAxis::slanted(i, 0), CullAxis::slanted(i, 1),
                                 CullAxis::slanted(i, 2), CullAxis::slanted(i, 3)}) {
            repeated |= 1U << number;
        }
    }
    return repeated;
}

/// Calls `step` with the number of each bit that is set until it says stop.
template <class Step>
void for_each_bit(std::uint32_t bits, Step step) {
    for (; bits != 0; bits &= bits - 1) {
        if (!step(std::countr_zero(bits))) return;
    }
}

}  // namespace

template <class N>
FrustumTerms<N>::FrustumTerms(const Frustum& f)
    : origin(exactly<N>(f.origin)),
      left(exactly<N>(f.axes.row[0])),
      up(exactly<N>(f.axes.row[1])),
      near(f.near),
      far(f.far) {
    const VectorOf<N> view = exactly<N>(f.axes.row[2]);
    const VectorOf<N> depth = near * view;
    const VectorOf<N> to_left = N(f.l1) * left, to_right = N(f.l0) * left;
    const VectorOf<N> to_up = N(f.u1) * up, to_down = N(f.u0) * up;
    corner[0] = to_right + to_down + depth;
    corner[1] = to_left + to_down + depth;
    corner[2] = to_right + to_up + depth;
    corner[3] = to_left + to_up + depth;
    // Axes are near orthonormal, so doubles see their handedness.
    const bool mirrored = dot(cross(f.axes.row[0], f.axes.row[1]), f.axes.row[2]) < 0.0;
    const auto outward = [&](const VectorOf<N>& n) { return mirrored ? -n : n; };
    normal[1] = outward(cross(left, up));
    normal[0] = -normal[1];
    normal[2] = outward(cross(up, to_left + depth));
    normal[3] = -outward(cross(up, to_right + depth));
    normal[4] = outward(cross(to_up + depth, left));
    normal[5] = -outward(cross(to_down + depth, left));
    const N unit_depth = dot(normal[1], view);
    offset[0] = -(near * unit_depth);
    offset[1] = far * unit_depth;
    for (int plane = 2; plane < 6; ++plane) offset[plane] = N(0.0);
}

template <class N>
CullSigns<N>::CullSigns(const FrustumTerms<N>& frustum, const OrientedBox& box)
    : frustum_(frustum),
      center_(exactly<N>(box.center) - frustum.origin),
      axis_{exactly<N>(box.axes.row[0]), exactly<N>(box.axes.row[1]), exactly<N>(box.axes.row[2])},
      half_{N(box.half_extents.x), N(box.half_extents.y), N(box.half_extents.z)} {}

template <class N>
N CullSigns<N>::half_width(const VectorOf<N>& direction) const {
    return half_[0] * magnitude(dot(direction, axis_[0])) + half_[1] * magnitude(dot(direction, axis_[1])) +
           half_[2] * magnitude(dot(direction, axis_[2]));
}

template <class N>
int CullSigns<N>::separates(int axis) const {
    if (axis < CullAxis::kFaces) return sign_of(height(axis) - half_width(frustum_.normal[axis]));
    // Widths and heights along m that are 0 by its definition are not measured.
    VectorOf<N> m;
    N width;
    const VectorOf<N>* level = nullptr;
    if (axis < CullAxis::kLeft) {
        const int i = axis - CullAxis::kFaces;
        m = cross(axis_[(i + 1) % 3], axis_[(i + 2) % 3]);
        width = half_[i] * magnitude(dot(m, axis_[i]));
    } else {
        const bool slanted = axis >= CullAxis::kSlanted;
        const int i = slanted ? (axis - CullAxis::kSlanted) / 4 : (axis - CullAxis::kLeft) % 3;
        if (slanted) level = &frustum_.corner[(axis - CullAxis::kSlanted) % 4];
        const VectorOf<N>& edge = slanted ? *level : axis < CullAxis::kUp ? frustum_.left : frustum_.up;
        m = cross(edge, axis_[i]);
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        width = half_[j] * magnitude(dot(m, axis_[j])) + half_[k] * magnitude(dot(m, axis_[k]));
    }
    // Corners of the near face, times `near`; those of the far face are far / near as high.
    const auto height_of = [&](const VectorOf<N>& corner) {
        return &corner == level ? N(0.0) : dot(m, corner);
    };
    N high = height_of(frustum_.corner[0]), low = high;
    for (int k = 1; k < 4; ++k) {
        const N height = height_of(frustum_.corner[k]);
        high = maximum(high, height);
        low = minimum(low, height);
    }
    const N top = maximum(frustum_.near * high, frustum_.far * high);
    const N bottom = minimum(frustum_.near * low, frustum_.far * low);
    const N center = dot(m, center_);
    const int above = sign_of(frustum_.near * (center - width) - top);
    const int below = sign_of(bottom - frustum_.near * (center + width));
    if (above == 1 || below == 1) return 1;
    return above == kUncertain || below == kUncertain ? kUncertain : std::max(above, below);
}

template <class N>
int CullSigns<N>::reaches_beyond(int plane) const {
    return sign_of(height(plane) + half_width(frustum_.normal[plane]));
}

template <class N>
int CullSigns<N>::corner(int plane, int number) const {
    const VectorOf<N>& normal = frustum_.normal[plane];
    N sum = height(plane);
    for (int i = 0; i < 3; ++i) {
        const N arm = half_[i] * dot(normal, axis_[i]);
        sum = (number >> i & 1) != 0 ? sum + arm : sum - arm;
    }
    return sign_of(sum);
}

template class CullSigns<Enclosed>;
template class CullSigns<Exact>;

ExactCull::ExactCull(const Frustum& frustum)
    : frustum_(frustum), frame_(cull_frame<double>(frustum)), wide_(frustum) {}

const FrustumTerms<Exact>& ExactCull::exact_terms() {
    if (!exact_) exact_.emplace(frustum_);
    return *exact_;
}

bool ExactCull::in_range(const OrientedBox& box) const {
    const Frustum& f = frustum_;
    double most = std::max({f.far, std::fabs(f.l0), std::fabs(f.l1), std::fabs(f.u0), std::fabs(f.u1)});
    for (const Vec3 v : {f.origin, box.center, box.half_extents}) {
        most = std::max({most, std::fabs(v.x), std::fabs(v.y), std::fabs(v.z)});
    }
    return most < kMostWide;
}

ExactCull::Verdict ExactCull::decide(const OrientedBox& box) {
    CullDoubts doubts = doubts_about(frame_, box);
    doubts.apart &= ~repeated_axes(frustum_, box);
    bool apart = false;
    // One rung of the ladder: what it settles is in doubt no more.
    const auto climb = [&](const auto& signs) {
        for_each_bit(doubts.apart, [&](int axis) {
            const int sign = signs.separates(axis);
            apart = sign == 1;
            if (sign != kUncertain) doubts.apart &= ~(1U << axis);
            return !apart;
        });
        if (apart) return;
        for_each_bit(doubts.not_inside ? 0 : doubts.inside, [&](int plane) {
            const int sign = signs.reaches_beyond(plane);
            doubts.not_inside = sign == 1;
            if (sign != kUncertain) doubts.inside &= ~(1U << plane);
            return !doubts.not_inside;
        });
    };
    const auto done = [&] {
        return apart || (doubts.apart == 0 && (doubts.not_inside || doubts.inside == 0));
    };
    Rung rung = Rung::wide;
    if (in_range(box)) climb(CullSigns<Enclosed>(wide_, box));
    if (!done()) {
        rung = Rung::exact;
        climb(CullSigns<Exact>(exact_terms(), box));
    }
    return {apart ? CullState::outside : doubts.not_inside ? CullState::intersects : CullState::inside, rung};
}

}  // namespace geomsrv
