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
// box, the six planes against the box, all 26 separating axes.  Each in double or in single precision, for
// numbers relative to the apex.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <type_traits>

#include "geom/frustum.hpp"
#include "geom/power_of_two.hpp"

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
template <class L>
struct PlaneLanes {
    L x, y, z;           ///< n
    L offset;            ///< [m]
    L length;            ///< |n|, rounded up, times the length that an axis of a box may have
    L error_per_length;  ///< rounding error of a signed distance per unit of reach
    L error;             ///< the part that does not depend on the box
};

/// In the order near, far, left (+L), right, up (+U), down.
template <class L>
struct CullPlanes {
    using Real = typename L::Real;
    static constexpr int kCount = 6, kGroups = (kCount + L::kCount - 1) / L::kCount;
    Vec3 origin;
    PowerOfTwo unit;               ///< what lengths are multiplied by
    bool scaled = false;           ///< unit is not 1
    PlaneLanes<L> each[kCount];    ///< one plane in all lanes, against as many boxes
    PlaneLanes<L> group[kGroups];  ///< as many planes, against one box; the last ones repeat the first

    /// A length that was not rounded yet.
    GEOMSRV_INLINE Vec3 in_units(Vec3 length) const { return scaled ? unit * length : length; }
};

template <class L>
CullPlanes<L> cull_planes(const Frustum& frustum);

/// Not decided by this stage; otherwise the value of a CullState, and certain.
inline constexpr std::uint8_t kUndecided = 3;

/// Beyond this reach products might overflow; such boxes go to the last stage, which scales.
template <class Real>
inline constexpr Real kMaxReach = std::is_same_v<Real, double> ? Real(0x1p1000) : Real(0x1p100);

/// Added to the square of a radius, so that a radius whose square underflows is not taken for 0.
template <class Real>
inline constexpr Real kMinSquaredRadius = std::is_same_v<Real, double> ? Real(0x1p-900) : Real(0x1p-110);

// For each plane let s be the signed distance of the centre and r the half width along the normal, of the box
// or of the sphere around it, grown by the rounding error, `error_per_length * reach + error`.
//
//     outside     some s > r         (all of it lies beyond that plane)
//     inside      all s < -r
//     intersects  all s < 0 and some s > -r, each by more than the error:  centre inside, some corner outside

/// What the spheres around as many boxes as lanes tell.
template <class L>
struct SphereVerdict {
    L state;  ///< outside (0) or inside (2), else kUndecided
    L plane;  ///< that an outside sphere lies beyond, else kCount
};

/// As many boxes as lanes against all planes; x, y, z is the centre from the apex.  A sphere needs no axes,
/// which are most of a box.
template <class L>
GEOMSRV_INLINE SphereVerdict<L> classify_by_sphere(const CullPlanes<L>& planes,
                                                   const std::array<L, 3>& center,
                                                   const std::array<L, 3>& half) {
    using Real = typename L::Real;
    const auto& [x, y, z] = center;
    const L radius =
        square_root((half[0] * half[0] + half[1] * half[1]) + (half[2] * half[2] + kMinSquaredRadius<Real>));
    // As for boxes below, 2 (e_0 + e_1 + e_2) <= 3.5 radius.
    const L reach = (magnitude(x) + magnitude(y) + magnitude(z)) + Real(4.0) * radius;
    const auto in_range = reach < L(kMaxReach<Real>);
    auto within = in_range, beyond = ~in_range;
    const L none = Real(planes.kCount);
    L which = none;
    for (int number = 0; number < planes.kCount; ++number) {
        const PlaneLanes<L>& plane = planes.each[number];
        const L s = (plane.x * x + plane.y * y + plane.z * z) - plane.offset;
        const L r = radius * plane.length + (plane.error_per_length * reach + plane.error);
        beyond = beyond | (r < s);
        within = within & (s < -r);
        which = select(r < s, L(Real(number)), which);
    }
    return {select(beyond & in_range, L(Real(0)), select(within, L(Real(2)), L(Real(kUndecided)))),
            select(in_range, which, none)};
}

/// A box seen from the apex, in the unit and the precision of the planes.
template <class Real>
struct LocalBox {
    Real center[3], half_extents[3], axes[3][3];
    Real reach;
    bool in_range;

    template <class L>
    GEOMSRV_INLINE LocalBox(const CullPlanes<L>& planes, const OrientedBox& box) {
        const Vec3 x = planes.in_units(box.center - planes.origin), e = planes.in_units(box.half_extents);
        const auto [a0, a1, a2] = box.axes.row;
        const double length = (std::fabs(x.x) + std::fabs(x.y) + std::fabs(x.z)) + 2.0 * (e.x + e.y + e.z);
        in_range = length < kMaxReach<Real>;
        // In one go, so that vectors convert them.
        const double given[] = {x.x,  x.y,  x.z,  e.x,  e.y,  e.z,  a0.x, a0.y,
                                a0.z, a1.x, a1.y, a1.z, a2.x, a2.y, a2.z, length};
        Real* const to[] = {center,           center + 1,       center + 2,  half_extents,
                            half_extents + 1, half_extents + 2, axes[0],     axes[0] + 1,
                            axes[0] + 2,      axes[1],          axes[1] + 1, axes[1] + 2,
                            axes[2],          axes[2] + 1,      axes[2] + 2, &reach};
        unrolled<16>([&](auto k) __attribute__((always_inline)) { *to[k] = static_cast<Real>(given[k]); });
    }
};

/// Heights over each of a group of planes, as above.
template <class L>
struct PlaneHeights {
    L center;  ///< s
    L arm[3];  ///< e_i normal . A_i
    L error;
    GEOMSRV_INLINE L half_width() const { return magnitude(arm[0]) + magnitude(arm[1]) + magnitude(arm[2]); }
};

template <class L>
GEOMSRV_INLINE PlaneHeights<L> heights_over(const PlaneLanes<L>& plane,
                                            const LocalBox<typename L::Real>& box) {
    using Real = typename L::Real;
    const auto along = [&](const Real(&v)[3]) __attribute__((always_inline)) {
        return plane.x * v[0] + plane.y * v[1] + plane.z * v[2];
    };
    return {along(box.center) - plane.offset,
            {box.half_extents[0] * along(box.axes[0]), box.half_extents[1] * along(box.axes[1]),
             box.half_extents[2] * along(box.axes[2])},
            plane.error_per_length * box.reach + plane.error};
}

/// One box against as many planes as lanes at a time.
template <class L>
GEOMSRV_INLINE std::uint8_t classify_by_planes(const CullPlanes<L>& planes, const OrientedBox& given) {
    const LocalBox<typename L::Real> box(planes, given);
    if (!box.in_range) return kUndecided;
    const typename L::Mask all_set = L(0.0F) <= L(0.0F);
    auto beyond = ~all_set, within = all_set, centre = all_set, across = ~all_set;
    for (const PlaneLanes<L>& plane : planes.group) {
        const PlaneHeights<L> over = heights_over(plane, box);
        const L s = over.center, r = over.half_width(), error = over.error;
        beyond = beyond | (error < s - r);
        within = within & (s + r < -error);
        centre = centre & (s < -error);
        across = across | (error < s + r);
    }
    // Without branches, which nobody could predict.
    const int intersects = static_cast<int>(all(centre)) & static_cast<int>(any(across));
    const int undecided = kUndecided - 2 * intersects;
    const int within_or_not = all(within) ? 2 : undecided;
    return static_cast<std::uint8_t>(any(beyond) ? 0 : within_or_not);
}

// ------------------------------------------------------------------------------ stage 3: separating axes

/// A frustum in units that make its numbers about 1: the window is [-1, 1] or so, the near depth in [1, 2).
template <class Real>
struct CullFrame {
    using Four = LanesOf<Real, 4>;
    Vec3 origin;
    Rows<Real, 3> dual;       ///< world to frustum coordinates, rows scaled by powers of two
    Four left, up;            ///< the four slanted edges have directions v_k = (left_k, up_k, view)
    Four left_step, up_step;  ///< v of the neighbour along L, along U, minus v_k
    Real l0, l1, u0, u1;      ///< left and up of the edges
    Real view;
    double near, far;  ///< [m]
};

template <class Real>
CullFrame<Real> cull_frame(const Frustum& frustum);

/// All 26 axes.
template <class Real>
CullVerdict cull_by_axes(const CullFrame<Real>& frame, const OrientedBox& box);

/// Half spaces and axes, in the order of their numbers: the six planes, the faces of the box (across axis i),
/// L x A_i, U x A_i, and v_k x A_i for each k in turn, where bit 0 of k is set on the +L side, bit 1 on +U.
struct CullAxis {
    static constexpr int kPlanes = 0, kFaces = 6, kLeft = 9, kUp = 12, kSlanted = 15, kCount = 27;
    static constexpr int slanted(int i, int k) { return kSlanted + 4 * i + k; }
};

/// What doubles cannot tell about the given bodies, bit by bit.
struct CullDoubts {
    std::uint32_t apart = 0;   ///< by CullAxis: whether the axis separates
    std::uint32_t inside = 0;  ///< by plane: whether the box has a point beyond it
    bool not_inside = false;   ///< it is proven to have one beyond some plane
};

/// Where no bit is set, the axis does not separate, the box has no point beyond the plane.
/// REQUIRES: cull_by_axes left the box uncertain.
CullDoubts doubts_about(const CullFrame<double>& frame, const OrientedBox& box);

}  // namespace geomsrv
