// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
#include "geom/frustum_box.hpp"

#include <algorithm>
#include <limits>

#include "geom/exact_body.hpp"

namespace geomsrv {

namespace {

template <class Real>
constexpr bool kIsDouble = std::is_same_v<Real, double>;

/// Unit roundoff of the precision at hand.
template <class Real>
constexpr Real kRoundoff = std::numeric_limits<Real>::epsilon() / 2;

template <class Real>
using Vector = VectorOf<Real>;

template <class Real>
Vector<Real> round_to(Vec3 v) {
    return {static_cast<Real>(v.x), static_cast<Real>(v.y), static_cast<Real>(v.z)};
}

template <class Real>
Real scaled(const PowerOfTwo& scale, Real value) {
    return static_cast<Real>(scale * static_cast<double>(value));
}
template <class Real>
Vector<Real> scaled(const PowerOfTwo& scale, const Vector<Real>& v) {
    return {scaled(scale, v.x), scaled(scale, v.y), scaled(scale, v.z)};
}

template <class Real>
double largest(const Vector<Real>& v) {
    return std::max({std::fabs(v.x), std::fabs(v.y), std::fabs(v.z)});
}
double largest(Vec3 v) { return std::max({std::fabs(v.x), std::fabs(v.y), std::fabs(v.z)}); }

Vec3 magnitudes(Vec3 v) { return {std::fabs(v.x), std::fabs(v.y), std::fabs(v.z)}; }
template <class Real>
Vector<Real> magnitudes(const Vector<Real>& v) {
    return {std::fabs(v.x), std::fabs(v.y), std::fabs(v.z)};
}

/// Bounds the entries of the cross product of vectors whose entries are at most these.
template <class Number>
GEOMSRV_INLINE Vector<Number> cross_magnitudes(const Vector<Number>& a, const Vector<Number>& b) {
    return {a.y * b.z + a.z * b.y, a.z * b.x + a.x * b.z, a.x * b.y + a.y * b.x};
}

// -------------------------------------------------------------------------------- error bounds of planes

// Rounding errors of stages 1 and 2, in units u of roundoff times the sum of magnitudes of the terms:
//
//   in double precision
//   entries of a normal         9 (dual basis) + 2 (p row + r row)                                  = 11
//   s = normal . (C - E)        11 + 1 (C - E) + 1 (product) + 2 (sums) + 1 (offset)                = 16
//   r = sum e_i |normal . A_i|  11 + 1 (product) + 2 (sums) + 1 (times e_i) + 2 (sums)              = 17
//   s - r, s + r                                                                                      + 1
//
//   in single precision, from doubles that are rounded once
//   s = normal . (C - E)        1 (normal) + 1 (C - E) + 1 (product) + 2 (sums) + 1 (offset)        = 6
//   r = sum e_i |normal . A_i|  1 (normal) + 1 (A_i) + 1 (product) + 2 (sums)
//                               + 1 (e_i) + 1 (times e_i) + 2 (sums)                                = 9
//   s - r, s + r                                                                                      + 1
//
// The entries of A_i sum to at most 1.75 in magnitude, so those magnitudes sum to at most N times
// |C - E|_1 + 1.75 sum e_i, where N is the largest entry of the normal, cancellation not counted.  `reach`
// has 2 for 1.75: 18 <= 20 and 10 <= 12, which also hold what doubles lose before they are rounded, and
// 18 * 1.75 <= 20 * 2.
template <class Real>
constexpr Real kPlaneError = Real(kIsDouble<Real> ? 20 : 12) * kRoundoff<Real>;

// The offset takes part in two of these roundings, those of s and of s +- r; a float has one of its own.
template <class Real>
constexpr Real kOffsetError = 3 * kRoundoff<Real>;

// About 30 products per plane may underflow, each losing at most half the smallest number, 2^-1075 or 2^-150;
// normals are about 1.
template <class Real>
constexpr Real kUnderflow = Real(0x1p14) * std::numeric_limits<Real>::denorm_min();

// Near depths of which the exponent is beyond this are scaled to about 1: far from it squares of lengths
// would leave the range of double.
constexpr int kOrdinaryDepth = 300;

// Products of rows of box axes are off by at most 1e-2, so sum e_i |n . A_i| <= |n| |e| sqrt(1.03).
constexpr double kMaxStretch = 1.02;

// ---------------------------------------------------------------------------------- error bounds of axes

// Culling is affine invariant, so everything is brought to about 1 by powers of two, which round nothing:
// the coordinates (a, b, d), each by its own, which makes an ordinary frustum of a needle or a very wide
// window; then the edges B_i of the box, each against its extent; then all lengths.  Products of what is left
// cannot overflow.  Windows thinner than 2^-1000 near stay thin, lest the map itself overflow.
constexpr int kMinSlopeExponent = -1000;

// Entries of edges below this are set to zero, and tolerances are at least kFloor in each coordinate.  That
// covers the change (4 entries of at most kNegligible) and all underflow: edges that are not zero are >=
// 2^-300, entries of a cross product that are not zero are >= 2^-600 2^-104 (both factors have 53 bits),
// times kFloor >= 2^-994, while an underflow loses 2^-1075.  Of floats: 2^-32, 2^-64 2^-46 (24 bits), 2^-137,
// 2^-150.
template <class Real>
constexpr Real kNegligible = kIsDouble<Real> ? Real(0x1p-300) : Real(0x1p-32);
template <class Real>
constexpr Real kFloor = kIsDouble<Real> ? Real(0x1p-290) : Real(0x1p-27);

// On the way to those units, where lengths are about 1 but the map is not, about 20 products and entries may
// underflow, each losing at most half the smallest number.  What they lose is mapped, scaled and added to
// kFloor.
template <class Real>
constexpr Real kLost = Real(0x1p14) * std::numeric_limits<Real>::denorm_min();

// The tolerance tol of a coordinate is kCullError times Z + W.  Z = |C - E| + sum e_k |A_k|, mapped with the
// magnitudes of the dual basis; W = extent of the frustum as far as it matters.  It has two parts, in units u
// of roundoff:
//
// 1. The bodies in floating point are not the given ones: each point is off by at most 13 u Z, or 2 u W.
//    box      9 (dual basis) + 1 (C - E) + 1 (product) + 2 (sums)
//    as floats   1 (dual basis) + 1 (C - E or A_i) + 1 (product) + 2 (sums) + 1 (e_i)
//    frustum     1 (window) + 1 (depth), if they are rounded to floats
// 2. For those rounded bodies, the gap along an axis M is off by at most 10 u sum |M| (Z + W).
//    box      2 (entry of M, relative) + 1 (product) + 2 (sums) + 1 (times e) + 2 (sums)
//    frustum  2 (entry of M, relative) + 1 (width) + 1 (product) + 2 (sums) + 1 (far end) + 1 (times it)
//    gap      2 (differences)
//
// Together 23 u (Z + W); 32 u leaves room for second-order terms and for the rounding of the bound itself.
//
// Why this proves a verdict.  The gap along M is the distance between the two projections, < 0 if they
// overlap; its bound is sum |M| tol.
//
// - Some gap > bound: the given bodies are disjoint, for M separates them.
// - All gaps <= -bound: let K be the set of differences of points of the rounded frustum and box.  The axes
//   hold all facet normals of K, for flat boxes too, so K contains the brick Q = +-13 u (Z + W).  The
//   differences of the given ones are within Q of K; were they disjoint, then along the direction that
//   separates them K would not contain Q.
template <class Real>
constexpr Real kCullError = 32 * kRoundoff<Real>;

// That proof is about all axes at once: a rounded axis need not be near the exact one, where edges are almost
// parallel.  For a verdict on one exact axis, what rounding does to the axis counts too: a gap is a
// difference of supports, so an axis that is off by dM changes it by at most sum |dM| (Z + W), if Z + W
// bounds all points of K.  An edge is off by 12 u (9 dual basis, 1 product, 2 sums) times its mapped
// magnitudes; the rest is for second-order terms.
constexpr double kEdgeError = 16 * kRoundoff<double>;

/// Frustum coordinates of a box, and the lengths of the frustum in the same unit.
template <class Real>
struct LocalScene {
    Vector<Real> center;
    Vector<Real> edge[3];     ///< A_i times edge_unit; without extents, so that flat boxes keep directions
    PowerOfTwo edge_unit[3];  ///< what makes them about 1
    Real half[3];             ///< extents in units of these edges
    Vector<Real> bound;       ///< Z above
    Vector<Real> floor;       ///< least tolerance
    Real near, far;
};

template <class Real>
Real drop_negligible(Real x) {
    return std::fabs(x) < kNegligible<Real> ? Real(0) : x;
}

template <class Real>
Vector<Real> drop_negligible(const Vector<Real>& v) {
    return {drop_negligible(v.x), drop_negligible(v.y), drop_negligible(v.z)};
}

template <class Real>
GEOMSRV_INLINE Vector<Real> times(const Rows<Real, 3>& m, const Vector<Real>& v) {
    const auto row = [&](int i) __attribute__((always_inline)) {
        return m.row[i][0] * v.x + m.row[i][1] * v.y + m.row[i][2] * v.z;
    };
    return {row(0), row(1), row(2)};
}

template <class Real>
GEOMSRV_INLINE Vector<Real> map_magnitudes(const Rows<Real, 3>& m, const Vector<Real>& v) {
    const auto row = [&](int i) __attribute__((always_inline)) {
        return std::fabs(m.row[i][0]) * std::fabs(v.x) + std::fabs(m.row[i][1]) * std::fabs(v.y) +
               std::fabs(m.row[i][2]) * std::fabs(v.z);
    };
    return {row(0), row(1), row(2)};
}

/// Sum of e_i |M . B_i|: half the width of the box along M.
template <class Real>
GEOMSRV_INLINE Real radius(const LocalScene<Real>& scene, const Vector<Real>& m) {
    return scene.half[0] * std::fabs(dot(m, scene.edge[0])) +
           scene.half[1] * std::fabs(dot(m, scene.edge[1])) +
           scene.half[2] * std::fabs(dot(m, scene.edge[2]));
}

template <class Real>
GEOMSRV_INLINE Real error_bound(const Vector<Real>& m, const Vector<Real>& tolerance) {
    return dot(magnitudes(m), tolerance);
}

// ------------------------------------------------------------------------------------------- who listens
//
// The tests below report every half space of the frustum, `add_plane`, and every axis or four of them, `add`,
// by number (CullAxis), with its gap, the error bound of that, and how to find dM above from the errors of
// edges.

/// What the axes tested so far say.
template <class Real>
class Tally {
    using Four = LanesOf<Real, 4>;
    using Mask = typename Four::Mask;

public:
    /// A null axis has gap 0 and bound 0, and says nothing.
    template <class AxisError>
    GEOMSRV_INLINE void add(int, Real gap, Real bound, AxisError) {
        separated_ |= gap > Real(0);
        proven_apart_ |= gap > bound;
        proven_meet_ &= -gap >= bound;
    }
    template <class AxisError>
    GEOMSRV_INLINE void add(int, const Four& gap, const Four& bound, AxisError) {
        four_separated_ = four_separated_ | (Four(Real(0)) < gap);
        four_proven_apart_ = four_proven_apart_ | (bound < gap);
        four_proven_meet_ = four_proven_meet_ & (bound <= -gap);
    }
    /// s = signed distance of the centre from the plane, r = half width of the box.
    GEOMSRV_INLINE void add_plane(int number, Real s, Real r, Real bound) {
        add(number, s - r, bound, 0);
        inside &= s + r <= Real(0);
        proven_inside &= s + r <= -bound;
        proven_not_inside |= s + r >= bound;
    }

    [[nodiscard]] bool separated() const { return separated_ || any(four_separated_); }
    [[nodiscard]] bool proven_apart() const { return proven_apart_ || any(four_proven_apart_); }
    [[nodiscard]] bool proven_meet() const { return proven_meet_ && all(four_proven_meet_); }

    bool inside = true;              ///< no corner beyond any plane
    bool proven_inside = true;       ///< the same by more than the error bounds
    bool proven_not_inside = false;  ///< some corner beyond a plane by at least its error bound

private:
    bool separated_ = false;     ///< some axis shows a gap
    bool proven_apart_ = false;  ///< some axis shows a gap above its error bound
    bool proven_meet_ = true;    ///< all axes overlap by at least their error bounds
    Mask four_separated_ = Four(Real(1)) < Four(Real(0));
    Mask four_proven_apart_ = four_separated_, four_proven_meet_ = ~four_separated_;
};

/// Which axes doubles cannot speak for.
class DoubtCollector {
    using Four = LanesOf<double, 4>;

public:
    DoubtCollector(const Vector<double> (&edge_error)[3], const Vector<double>& reach)
        : edge_error_{edge_error[0], edge_error[1], edge_error[2]}, reach_(reach) {}

    template <class AxisError>
    void add(int number, double gap, double bound, AxisError axis_error) {
        doubt(number, gap, bound + dot(axis_error(edge_error_), reach_));
    }
    template <class AxisError>
    void add(int number, const Four& gap, const Four& bound, AxisError axis_error) {
        const VectorOf<Four> error = axis_error(edge_error_);
        const Four total = bound + (error.x * reach_.x + error.y * reach_.y + error.z * reach_.z);
        for (int k = 0; k < Four::kCount; ++k) doubt(number + k, gap[k], total[k]);
    }
    /// Normals of planes are not rounded.
    void add_plane(int number, double s, double r, double bound) {
        doubt(number, s - r, bound);
        if (!(s + r < -bound)) found.inside |= 1U << number;
        found.not_inside |= s + r > bound;
    }

    CullDoubts found;

private:
    /// Also where something is NaN.
    void doubt(int number, double gap, double bound) {
        if (!(gap < -bound)) found.apart |= 1U << number;
    }

    Vector<double> edge_error_[3];
    Vector<double> reach_;
};

/// World to frustum coordinates.
Mat3 to_frustum(const Mat3& axes) {
    Rows<double, 3> rows;
    for (int i = 0; i < 3; ++i) {
        rows.row[i][0] = axes.row[i].x;
        rows.row[i][1] = axes.row[i].y;
        rows.row[i][2] = axes.row[i].z;
    }
    const Rows<double, 3> dual = dual_basis<double>(rows);
    Mat3 map;
    for (int i = 0; i < 3; ++i) {
        map.row[i] = {dual.row[i][0], dual.row[i][1], dual.row[i][2]};
    }
    return map;
}

}  // namespace

template <class L>
CullPlanes<L> cull_planes(const Frustum& frustum) {
    using Real = typename L::Real;
    const Mat3 dual = to_frustum(frustum.axes);
    const auto [left, up, view] = dual.row;
    CullPlanes<L> planes;
    planes.origin = frustum.origin;
    // Near depths of about 1 keep floats in range; doubles care only about extremes.
    const int depth = std::ilogb(frustum.near);
    planes.scaled = !kIsDouble<Real> || std::abs(depth) > kOrdinaryDepth;
    if (planes.scaled) planes.unit = PowerOfTwo(std::clamp(-depth, -1000, 1000));
    int count = 0;
    // Normal p * row + r * view, offset.
    const auto add = [&](double p, Vec3 row, double r, double offset) {
        const PowerOfTwo unit(-std::ilogb(std::max(std::fabs(p), std::fabs(r))));
        const double scaled_p = unit * p, scaled_r = unit * r;
        const Vec3 n = scaled_p * row + scaled_r * view;
        const Vec3 terms = std::fabs(scaled_p) * magnitudes(row) + std::fabs(scaled_r) * magnitudes(view);
        const auto rounded_offset = static_cast<Real>(planes.unit * offset);
        planes.each[count++] = {static_cast<Real>(n.x),
                                static_cast<Real>(n.y),
                                static_cast<Real>(n.z),
                                rounded_offset,
                                static_cast<Real>(kMaxStretch * norm(n)),
                                kPlaneError<Real> * static_cast<Real>(largest(terms)),
                                kOffsetError<Real> * std::fabs(rounded_offset) + kUnderflow<Real>};
    };
    add(0.0, view, -1.0, -frustum.near);
    add(0.0, view, 1.0, frustum.far);
    add(frustum.near, left, -frustum.l1, 0.0);
    add(-frustum.near, left, frustum.l0, 0.0);
    add(frustum.near, up, -frustum.u1, 0.0);
    add(-frustum.near, up, frustum.u0, 0.0);
    for (int k = 0; k < CullPlanes<L>::kGroups * L::kCount; ++k) {
        const PlaneLanes<L>& plane = planes.each[k % CullPlanes<L>::kCount];
        PlaneLanes<L>& group = planes.group[k / L::kCount];
        for (L PlaneLanes<L>::* const field :
             {&PlaneLanes<L>::x, &PlaneLanes<L>::y, &PlaneLanes<L>::z, &PlaneLanes<L>::offset,
              &PlaneLanes<L>::length, &PlaneLanes<L>::error_per_length, &PlaneLanes<L>::error}) {
            (group.*field).v[k % L::kCount] = (plane.*field)[0];
        }
    }
    return planes;
}

template CullPlanes<Lanes> cull_planes(const Frustum&);
template CullPlanes<FloatLanes> cull_planes(const Frustum&);

template <class Real>
CullFrame<Real> cull_frame(const Frustum& frustum) {
    using Four = LanesOf<Real, 4>;
    using FourNumbers = typename Four::Vector;
    const Mat3 dual = to_frustum(frustum.axes);
    const int depth = std::ilogb(frustum.near);
    const auto slope_exponent = [&](double low, double high) {
        return std::max(std::ilogb(std::max(std::fabs(low), std::fabs(high))) - depth, kMinSlopeExponent);
    };
    const int left = slope_exponent(frustum.l0, frustum.l1), up = slope_exponent(frustum.u0, frustum.u1);
    CullFrame<Real> frame;
    frame.origin = frustum.origin;
    const Vec3 rows[3] = {PowerOfTwo(-left) * dual.row[0], PowerOfTwo(-up) * dual.row[1], dual.row[2]};
    for (int i = 0; i < 3; ++i) {
        const Vector<Real> row = round_to<Real>(rows[i]);
        frame.dual.row[i][0] = row.x;
        frame.dual.row[i][1] = row.y;
        frame.dual.row[i][2] = row.z;
    }
    const PowerOfTwo left_unit(-depth - left), up_unit(-depth - up);
    const auto entry = [](const PowerOfTwo& unit, double x) {
        return drop_negligible(static_cast<Real>(unit * x));
    };
    frame.l0 = entry(left_unit, frustum.l0);
    frame.l1 = entry(left_unit, frustum.l1);
    frame.u0 = entry(up_unit, frustum.u0);
    frame.u1 = entry(up_unit, frustum.u1);
    frame.left = Four(FourNumbers{frame.l0, frame.l1, frame.l0, frame.l1});
    frame.up = Four(FourNumbers{frame.u0, frame.u0, frame.u1, frame.u1});
    const Real width = frame.l1 - frame.l0, height = frame.u1 - frame.u0;
    frame.left_step = Four(FourNumbers{width, -width, width, -width});
    frame.up_step = Four(FourNumbers{height, height, -height, -height});
    frame.view = static_cast<Real>(PowerOfTwo(-depth) * frustum.near);
    frame.near = frustum.near;
    frame.far = frustum.far;
    return frame;
}

template CullFrame<double> cull_frame(const Frustum&);
template CullFrame<float> cull_frame(const Frustum&);

namespace {

/// A box seen from the apex, in a unit in which nothing overflows.
struct Placement {
    double shrink;  ///< C - E must not overflow; a quarter of it cannot
    Vec3 offset;    ///< C - E times `shrink`
    double length;  ///< the largest length
    Placement(Vec3 origin, const OrientedBox& box)
        : shrink(std::max(largest(box.center), largest(origin)) > 0x1p1020 ? 0.25 : 1.0),
          offset(shrink * box.center - shrink * origin),
          length(std::max(largest(offset), shrink * largest(box.half_extents))) {}
};

template <class Real>
GEOMSRV_INLINE LocalScene<Real> local_scene(const CullFrame<Real>& frame, const OrientedBox& box,
                                            const Placement& place) {
    LocalScene<Real> scene;
    const int exponent = exponent_of(place.length);
    const PowerOfTwo unit(-exponent);
    const Vector<Real> x = round_to<Real>(unit * place.offset);
    const Vector<Real> extents = round_to<Real>(unit * (place.shrink * box.half_extents));
    const Real given_half[3] = {extents.x, extents.y, extents.z};
    scene.bound = map_magnitudes(frame.dual, x);
    for (int i = 0; i < 3; ++i) {
        const Vector<Real> axis = round_to<Real>(box.axes.row[i]);
        const Vector<Real> edge = times(frame.dual, axis);
        const int size = exponent_of(largest(edge));
        scene.edge_unit[i] = PowerOfTwo(-size);
        scene.edge[i] = drop_negligible(scaled(scene.edge_unit[i], edge));
        scene.half[i] = scaled(PowerOfTwo(size), given_half[i]);
        scene.bound = scene.bound + given_half[i] * map_magnitudes(frame.dual, axis);
    }
    const int size = exponent_of(largest(scene.bound));
    const PowerOfTwo rest(-size), total(-exponent - size);
    const Vector<Real> lost = {kLost<Real>, kLost<Real>, kLost<Real>};
    const Vector<Real> floor = {kFloor<Real>, kFloor<Real>, kFloor<Real>};
    scene.center = scaled(rest, times(frame.dual, x));
    scene.bound = scaled(rest, scene.bound);
    scene.floor = scaled(rest, map_magnitudes(frame.dual, lost) + lost) + floor;
    for (Real& half : scene.half) half = scaled(rest, half);
    scene.near = static_cast<Real>(total * (place.shrink * frame.near));
    scene.far = static_cast<Real>(total * (place.shrink * frame.far));
    return scene;
}

template <class Real, class Listener>
GEOMSRV_INLINE void test_planes(const CullFrame<Real>& frame, const LocalScene<Real>& scene,
                                const Vector<Real>& tolerance, Listener& listener) {
    const Vector<Real> c = scene.center;
    const Real depth_radius = radius(scene, {0, 0, 1});
    listener.add_plane(0, scene.near - c.z, depth_radius, tolerance.z);
    listener.add_plane(1, c.z - scene.far, depth_radius, tolerance.z);
    int number = 2;
    for (const Vector<Real>& normal :
         {Vector<Real>{frame.view, 0, -frame.l1}, Vector<Real>{-frame.view, 0, frame.l0},
          Vector<Real>{0, frame.view, -frame.u1}, Vector<Real>{0, -frame.view, frame.u0}}) {
        listener.add_plane(number++, dot(normal, c), radius(scene, normal), error_bound(normal, tolerance));
    }
}

/// Faces of the box, L x B_i and U x B_i.  The slanted edges run from near_end v_k to far_end v_k.
template <class Real, class Listener>
GEOMSRV_INLINE void test_box_axes(const CullFrame<Real>& frame, const LocalScene<Real>& scene, Real near_end,
                                  Real far_end, const Vector<Real>& tolerance, Listener& listener) {
    using V = Vector<Real>;
    // Gap between the box, center +- r, and the frustum: M . v_k is between `low` and `high`.
    const auto add = [&](int number, const V& m, Real r, Real low, Real high, auto axis_error)
                         __attribute__((always_inline)) {
                             const Real center = dot(m, scene.center);
                             const Real least = std::min(near_end * low, far_end * low);
                             const Real most = std::max(near_end * high, far_end * high);
                             listener.add(number, std::max((center - r) - most, least - (center + r)),
                                          error_bound(m, tolerance), axis_error);
                         };
    for (int i = 0; i < 3; ++i) {
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        const V b = scene.edge[i], bj = scene.edge[j], bk = scene.edge[k];
        // The normal of a face is the cross product of its edges: the map need not keep right angles.
        const V normal = {difference_of_products(bj.y, bk.z, bj.z, bk.y),
                          difference_of_products(bj.z, bk.x, bj.x, bk.z),
                          difference_of_products(bj.x, bk.y, bj.y, bk.x)};
        const Real l0 = frame.l0 * normal.x, l1 = frame.l1 * normal.x;
        const Real u0 = frame.u0 * normal.y, u1 = frame.u1 * normal.y;
        const Real d = frame.view * normal.z;
        add(CullAxis::kFaces + i, normal, scene.half[i] * std::fabs(dot(normal, b)),
            std::min(l0, l1) + std::min(u0, u1) + d, std::max(l0, l1) + std::max(u0, u1) + d,
            [&](const V* error) {
                return cross_magnitudes(magnitudes(bj) + error[j], error[k]) +
                       cross_magnitudes(error[j], magnitudes(bk));
            });

        const auto others = [&](const V& m) __attribute__((always_inline)) {
            return scene.half[j] * std::fabs(dot(m, bj)) + scene.half[k] * std::fabs(dot(m, bk));
        };
        const V left_cross = {0, -b.z, b.y}, up_cross = {b.z, 0, -b.x};
        const Real v0 = frame.u0 * left_cross.y, v1 = frame.u1 * left_cross.y;
        const Real v = frame.view * left_cross.z;
        add(CullAxis::kLeft + i, left_cross, others(left_cross), std::min(v0, v1) + v, std::max(v0, v1) + v,
            [&](const V* error) { return V{0, error[i].z, error[i].y}; });
        const Real w0 = frame.l0 * up_cross.x, w1 = frame.l1 * up_cross.x;
        const Real w = frame.view * up_cross.z;
        add(CullAxis::kUp + i, up_cross, others(up_cross), std::min(w0, w1) + w, std::max(w0, w1) + w,
            [&](const V* error) { return V{error[i].z, 0, error[i].x}; });
    }
}

/// Slanted edge x B_i.  Where the two are near parallel, M is tiny; difference_of_products keeps its relative
/// accuracy.  M . v_k and M . B_i are 0 and not computed: their rounding noise, multiplied by far_end or by
/// the extent, would be taken for a gap or hide one.  The other slanted edges are v_k plus steps, so they
/// project to left_step M_a, up_step M_b and the sum of both, free of cancellation.
template <class Real, class Listener>
GEOMSRV_INLINE void test_slanted_edges(const CullFrame<Real>& frame, const LocalScene<Real>& scene,
                                       Real far_end, const Vector<Real>& tolerance, Listener& listener) {
    using Four = LanesOf<Real, 4>;
    const Four view = frame.view, none = Real(0);
    for (int i = 0; i < 3; ++i) {
        const Vector<Real> b = scene.edge[i];
        const Four mx = difference_of_products(frame.up, Four(b.z), view, Four(b.y));
        const Four my = difference_of_products(view, Four(b.x), frame.left, Four(b.z));
        const Four mz = difference_of_products(frame.left, Four(b.y), frame.up, Four(b.x));
        const auto along = [&](const Vector<Real>& v)
                               __attribute__((always_inline)) { return mx * v.x + my * v.y + mz * v.z; };
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        const Four center = along(scene.center);
        const Four r =
            scene.half[j] * magnitude(along(scene.edge[j])) + scene.half[k] * magnitude(along(scene.edge[k]));
        const Four p = frame.left_step * mx, q = frame.up_step * my, pq = p + q;
        const Four most = far_end * greater(greater(none, p), greater(q, pq));
        const Four least = far_end * lesser(lesser(none, p), lesser(q, pq));
        const Four gap = greater((center - r) - most, least - (center + r));
        const Four bound =
            magnitude(mx) * tolerance.x + magnitude(my) * tolerance.y + magnitude(mz) * tolerance.z;
        listener.add(CullAxis::slanted(i, 0), gap, bound, [&](const Vector<Real>* error) {
            // Entries of v_k may have been dropped.
            const VectorOf<Four> v = {magnitude(frame.left), magnitude(frame.up), view};
            const VectorOf<Four> dropped = {kNegligible<Real>, kNegligible<Real>, none};
            const VectorOf<Four> db = {error[i].x, error[i].y, error[i].z};
            const VectorOf<Four> most_b = VectorOf<Four>{std::fabs(b.x), std::fabs(b.y), std::fabs(b.z)} + db;
            return cross_magnitudes(v, db) + cross_magnitudes(dropped, most_b);
        });
    }
}

/// Where the tests are made.
template <class Real>
struct Setting {
    LocalScene<Real> scene;
    bool before_near;  ///< proven to be in front of the near plane; the rest is not set then
    Real near_end = 0, far_end = 0;
    Vector<Real> reach = {};  ///< Z + W
    Vector<Real> tolerance = {};

    GEOMSRV_INLINE Setting(const CullFrame<Real>& frame, const OrientedBox& box, const Placement& place)
        : scene(local_scene(frame, box, place)) {
        // A box in front of the near plane ends here, so below near <= its largest depth.
        const Real deepest = scene.center.z + radius(scene, {0, 0, 1});
        const Real depth_bound = kCullError<Real> * scene.bound.z + scene.floor.z;
        before_near = scene.near - deepest > depth_bound;
        if (before_near) return;

        // Cut the frustum off well beyond the deepest point of the box: that changes nothing for the box, and
        // the far end no longer multiplies rounding noise by far / near.
        const Real cut = std::min(scene.far, 2 * (deepest + depth_bound));
        near_end = scene.near / frame.view;
        far_end = cut / frame.view;
        const Vector<Real> window = {std::fabs(frame.l0) + std::fabs(frame.l1),
                                     std::fabs(frame.u0) + std::fabs(frame.u1), frame.view};
        reach = scene.bound + far_end * window;
        tolerance = kCullError<Real> * reach + scene.floor;
    }
};

template <class Real>
GEOMSRV_INLINE CullVerdict all_axes(const CullFrame<Real>& frame, const OrientedBox& box) {
    const Placement place(frame.origin, box);
    if (place.length == 0.0) return {CullState::outside, true};  // a single point at the apex
    const Setting<Real> at(frame, box, place);
    if (at.before_near) return {CullState::outside, true};

    Tally<Real> tally;
    test_planes(frame, at.scene, at.tolerance, tally);
    if (tally.proven_apart()) return {CullState::outside, true};
    if (tally.proven_inside) return {CullState::inside, true};
    test_box_axes(frame, at.scene, at.near_end, at.far_end, at.tolerance, tally);
    if (tally.proven_apart()) return {CullState::outside, true};
    test_slanted_edges(frame, at.scene, at.far_end, at.tolerance, tally);
    if (tally.proven_apart()) return {CullState::outside, true};

    if (tally.inside) return {CullState::inside, false};
    if (tally.separated()) return {CullState::outside, false};
    return {CullState::intersects, tally.proven_meet() && tally.proven_not_inside};
}

}  // namespace

template <>
GEOMSRV_WIDE_CLONES CullVerdict cull_by_axes(const CullFrame<double>& frame, const OrientedBox& box) {
    return all_axes(frame, box);
}

template <>
GEOMSRV_WIDE_CLONES CullVerdict cull_by_axes(const CullFrame<float>& frame, const OrientedBox& box) {
    return all_axes(frame, box);
}

GEOMSRV_WIDE_CLONES CullDoubts doubts_about(const CullFrame<double>& frame, const OrientedBox& box) {
    const Setting<double> at(frame, box, Placement(frame.origin, box));
    Vector<double> edge_error[3];
    const Vector<double> lost = {kLost<double>, kLost<double>, kLost<double>};
    const Vector<double> dropped = {kNegligible<double>, kNegligible<double>, kNegligible<double>};
    for (int i = 0; i < 3; ++i) {
        const Vector<double> mapped = map_magnitudes(frame.dual, round_to<double>(box.axes.row[i]));
        edge_error[i] = scaled(at.scene.edge_unit[i], kEdgeError * mapped + lost) + dropped;
    }
    DoubtCollector collector(edge_error, at.reach);
    test_planes(frame, at.scene, at.tolerance, collector);
    test_box_axes(frame, at.scene, at.near_end, at.far_end, at.tolerance, collector);
    test_slanted_edges(frame, at.scene, at.far_end, at.tolerance, collector);
    return collector.found;
}

}  // namespace geomsrv
