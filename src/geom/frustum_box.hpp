// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
// View frustum against oriented box: outside, across the border, or inside.
//
// Paper 2 (Eberly, "Intersection of Orthogonal View Frustum and Oriented Bounding Box Using Separation Axis Testing",
// 2000), book section 11.12.1, with these changes: side normals use mu for the up direction (the text prints l); windows
// may be off-centre; edge x edge axes are computed without cancellation; every verdict says whether it is proven.
//
// Two stages.  The planes of the frustum decide most boxes in a few nanoseconds, or say that they cannot.  All 26
// separating axes decide the rest.
#pragma once

#include <bit>
#include <cmath>
#include <cstdint>

#include "geom/frustum.hpp"

namespace geomsrv {

/// The solid center +- half_extents[i] * axes.row[i], literal even where the axes are not quite orthonormal.
struct OrientedBox {
    Vec3 center;        ///< [m], world frame
    Mat3 axes;          ///< rows A_0, A_1, A_2, world frame; each entry at most 1.005 in magnitude
    Vec3 half_extents;  ///< [m], >= 0
};

/// Values as the Python layer has them.
enum class CullState : std::uint8_t {
    outside = 0,     ///< no common point
    intersects = 1,  ///< a common point, and a point of the box outside the frustum
    inside = 2,      ///< every point of the box is in the frustum
};

struct CullVerdict {
    CullState state = CullState::outside;
    bool certain = false;  ///< exact arithmetic on the same numbers is proven to give the same state
};

// ------------------------------------------------------------------------------------------------ stage 1: planes

/// The six planes with outward normals; lanes 6 and 7 repeat the first.  A point x is outside plane k if
/// normal_k . (x - origin) > offset_k.
struct CullPlanes {
    static constexpr int kLanes = 8;
    Vec3 origin;
    double normal_x[kLanes], normal_y[kLanes], normal_z[kLanes];
    double offset[kLanes];
    double error_per_length[kLanes];  ///< rounding error of a signed distance per unit of `reach`, see below
    double error[kLanes];             ///< the part that does not depend on the box
};

CullPlanes cull_planes(const Frustum& frustum);

/// What the planes say: a CullState, or kUndecided.  Whatever they decide is certain.
inline constexpr std::uint8_t kUndecided = 3;

/// Beyond this reach products of stage 1 might overflow; such boxes go to stage 2, which scales.
inline constexpr double kMaxReach = 0x1p1000;

/// For each plane s = signed distance of the centre and r = half width of the box along the normal:
///
///     outside     some s - r > 0      (the box lies beyond that plane)
///     inside      all  s + r < 0
///     intersects  all  s < 0 and some s + r > 0:  centre in the frustum, some corner out of it
///
/// with each comparison taken by more than the rounding error `error_per_length * reach + error`.
///
/// The comparisons are sign bits of differences, so the loop over planes has no branch and becomes vector code.
GEOMSRV_INLINE std::uint8_t classify_by_planes(const CullPlanes& planes, const OrientedBox& box) {
    const Vec3 x = box.center - planes.origin;
    const auto [a0, a1, a2] = box.axes.row;
    const Vec3 e = box.half_extents;
    const double reach = (std::fabs(x.x) + std::fabs(x.y) + std::fabs(x.z)) + 2.0 * (e.x + e.y + e.z);
    std::uint64_t any_beyond = 0, all_within = ~std::uint64_t{0}, all_centre = ~std::uint64_t{0}, any_across = 0;
    for (int k = 0; k < CullPlanes::kLanes; ++k) {
        const double nx = planes.normal_x[k], ny = planes.normal_y[k], nz = planes.normal_z[k];
        const double s = (nx * x.x + ny * x.y + nz * x.z) - planes.offset[k];
        const double r = e.x * std::fabs(nx * a0.x + ny * a0.y + nz * a0.z) +
                         e.y * std::fabs(nx * a1.x + ny * a1.y + nz * a1.z) +
                         e.z * std::fabs(nx * a2.x + ny * a2.y + nz * a2.z);
        const double error = planes.error_per_length[k] * reach + planes.error[k];
        any_beyond |= std::bit_cast<std::uint64_t>(error - (s - r));
        all_within &= std::bit_cast<std::uint64_t>((s + r) + error);
        all_centre &= std::bit_cast<std::uint64_t>(s + error);
        any_across |= std::bit_cast<std::uint64_t>(error - (s + r));
    }
    constexpr int kSignBit = 63;
    const bool beyond = (any_beyond >> kSignBit) != 0, within = (all_within >> kSignBit) != 0;
    const bool crossing = ((all_centre & any_across) >> kSignBit) != 0;
    const std::uint8_t found = beyond     ? std::uint8_t{0}
                               : within   ? std::uint8_t{2}
                               : crossing ? std::uint8_t{1}
                                          : kUndecided;
    return reach < kMaxReach ? found : kUndecided;
}

// ----------------------------------------------------------------------------------------- stage 2: separating axes

/// A frustum in units that make its numbers about 1: the window is [-1, 1] or so, the near depth in [1, 2).
struct CullFrame {
    Vec3 origin;
    Mat3 dual;                       ///< world to frustum coordinates, rows scaled by powers of two
    double left[4], up[4], view;     ///< directions v_k = (left_k, up_k, view) of the four slanted edges
    double left_step[4], up_step[4];  ///< v of the neighbour along L, along U, minus v_k
    double near, far;                ///< [m]
};

CullFrame cull_frame(const Frustum& frustum);

/// All 26 axes.
CullVerdict cull_by_axes(const CullFrame& frame, const OrientedBox& box);

}  // namespace geomsrv
