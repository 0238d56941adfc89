// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
// View frustum against oriented box: outside, across the border, or inside.
//
// Paper 2 (Eberly, "Intersection of Orthogonal View Frustum and Oriented Bounding Box Using Separation Axis
// Testing", 2000), book section 11.12.1, with these changes: side normals use mu for the up direction (the
// text prints l); windows may be off-centre; edge x edge axes are computed without cancellation; every
// verdict says whether it is proven.
//
// Three stages, each for what the one before could not decide: the six planes against the sphere around the
// box, the six planes against the box, all 26 separating axes.
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

// -------------------------------------------------------------------------------- stages 1 and 2: planes

/// Planes with outward normals n: a point x is outside if n . (x - origin) > offset.
struct PlaneLanes {
    Lanes x, y, z;           ///< n
    Lanes offset;            ///< [m]
    Lanes length;            ///< |n|, rounded up, times the length that an axis of a box may have
    Lanes error_per_length;  ///< rounding error of a signed distance per unit of reach
    Lanes error;             ///< the part that does not depend on the box
};

struct CullPlanes {
    static constexpr int kCount = 6, kGroups = 2;
    Vec3 origin;
    PlaneLanes each[kCount];    ///< one plane in all lanes, against four boxes
    PlaneLanes group[kGroups];  ///< four planes, against one box; the last two repeat the first
};

CullPlanes cull_planes(const Frustum& frustum);

/// Not decided by this stage; otherwise the value of a CullState, and certain.
inline constexpr std::uint8_t kUndecided = 3;

/// Beyond this reach products might overflow; such boxes go to the last stage, which scales.
inline constexpr double kMaxReach = 0x1p1000;

/// Added to the square of a radius, so that a radius whose square underflows is not taken for 0.
inline constexpr double kMinSquaredRadius = 0x1p-900;

// For each plane let s be the signed distance of the centre and r the half width along the normal, of the box
// or of the sphere around it, grown by the rounding error, `error_per_length * reach + error`.
//
//     outside     some s > r         (all of it lies beyond that plane)
//     inside      all s < -r
//     intersects  all s < 0 and some s > -r, each by more than the error:  centre inside, some corner outside

/// Four boxes against all planes.  A sphere needs no axes, which are most of a box; it can tell `outside`
/// (0.0) and `inside` (2.0), else the answer is kUndecided.
GEOMSRV_INLINE Lanes classify_by_sphere(const CullPlanes& planes, const Lanes (&center)[3],
                                        const Lanes (&half)[3]) {
    const Lanes x = center[0] - planes.origin.x;
    const Lanes y = center[1] - planes.origin.y;
    const Lanes z = center[2] - planes.origin.z;
    const Lanes radius =
        square_root((half[0] * half[0] + half[1] * half[1]) + (half[2] * half[2] + kMinSquaredRadius));
    // As for boxes below, 2 (e_0 + e_1 + e_2) <= 3.5 radius.
    const Lanes reach = (magnitude(x) + magnitude(y) + magnitude(z)) + 4.0 * radius;
    const LaneMask in_range = reach < Lanes(kMaxReach);
    LaneMask within = in_range, beyond = ~in_range;
    for (const PlaneLanes& plane : planes.each) {
        const Lanes s = (plane.x * x + plane.y * y + plane.z * z) - plane.offset;
        const Lanes r = radius * plane.length + (plane.error_per_length * reach + plane.error);
        beyond = beyond | (r < s);
        within = within & (s < -r);
    }
    return select(beyond & in_range, Lanes(0.0), select(within, Lanes(2.0), Lanes(kUndecided)));
}

/// One box against four planes at a time.
GEOMSRV_INLINE std::uint8_t classify_by_planes(const CullPlanes& planes, const OrientedBox& box) {
    const Vec3 x = box.center - planes.origin, e = box.half_extents;
    const auto [a0, a1, a2] = box.axes.row;
    const double reach = (std::fabs(x.x) + std::fabs(x.y) + std::fabs(x.z)) + 2.0 * (e.x + e.y + e.z);
    if (!(reach < kMaxReach)) return kUndecided;
    const LaneMask all_set = Lanes(0.0) <= Lanes(0.0);
    LaneMask beyond = ~all_set, within = all_set, centre = all_set, across = ~all_set;
    for (const PlaneLanes& plane : planes.group) {
        const auto along = [&](Vec3 v) __attribute__((always_inline)) {
            return plane.x * v.x + plane.y * v.y + plane.z * v.z;
        };
        const Lanes s = along(x) - plane.offset;
        const Lanes r = e.x * magnitude(along(a0)) + e.y * magnitude(along(a1)) + e.z * magnitude(along(a2));
        const Lanes error = plane.error_per_length * reach + plane.error;
        beyond = beyond | (error < s - r);
        within = within & (s + r < -error);
        centre = centre & (s < -error);
        across = across | (error < s + r);
    }
    if (any(beyond)) return 0;
    if (all(within)) return 2;
    return all(centre) && any(across) ? 1 : kUndecided;
}

// ------------------------------------------------------------------------------ stage 3: separating axes

/// A frustum in units that make its numbers about 1: the window is [-1, 1] or so, the near depth in [1, 2).
struct CullFrame {
    Vec3 origin;
    Mat3 dual;                 ///< world to frustum coordinates, rows scaled by powers of two
    Lanes left, up;            ///< the four slanted edges have directions v_k = (left_k, up_k, view)
    Lanes left_step, up_step;  ///< v of the neighbour along L, along U, minus v_k
    double l0, l1, u0, u1;     ///< left and up of the edges
    double view;
    double near, far;  ///< [m]
};

CullFrame cull_frame(const Frustum& frustum);

/// All 26 axes.
CullVerdict cull_by_axes(const CullFrame& frame, const OrientedBox& box);

}  // namespace geomsrv
