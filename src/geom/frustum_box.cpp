// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
#include "geom/frustum_box.hpp"

#include <algorithm>

namespace geomsrv {

namespace {

// ----------------------------------------------------------------------------------------- powers of two

/// 2^exponent as two factors that are both normal numbers; products by it are exact unless the result itself
/// leaves the range of double.  Exponents beyond +-2044 are cut there, where every product is 0 or infinite
/// anyway.
struct PowerOfTwo {
    double first, second;
    explicit PowerOfTwo(int exponent)
        : first(normal(exponent / 2)), second(normal(exponent - exponent / 2)) {}
    double operator*(double value) const { return value * first * second; }

private:
    static double normal(int exponent) {
        constexpr int kBias = 1023, kMantissaBits = 52;
        const int biased = std::clamp(exponent, -1022, 1022) + kBias;
        return std::bit_cast<double>(static_cast<std::uint64_t>(biased) << kMantissaBits);
    }
};

Vec3 operator*(const PowerOfTwo& scale, Vec3 v) { return {scale * v.x, scale * v.y, scale * v.z}; }

/// Exponent of the leading bit; too large for subnormal numbers, which is as good here.
int exponent_of(double x) { return static_cast<int>(std::bit_cast<std::uint64_t>(x) >> 52 & 0x7ff) - 1023; }

double largest(Vec3 v) { return std::max({std::fabs(v.x), std::fabs(v.y), std::fabs(v.z)}); }

Vec3 magnitudes(Vec3 v) { return {std::fabs(v.x), std::fabs(v.y), std::fabs(v.z)}; }

// -------------------------------------------------------------------------------- error bounds of planes

// Rounding errors of stages 1 and 2, in units u of roundoff times the sum of magnitudes of the terms:
//
//   entries of a normal         9 (dual basis) + 2 (p row + r row)                                  = 11
//   s = normal . (C - E)        11 + 1 (C - E) + 1 (product) + 2 (sums) + 1 (offset)                = 16
//   r = sum e_i |normal . A_i|  11 + 1 (product) + 2 (sums) + 1 (times e_i) + 2 (sums)              = 17
//   s - r, s + r                                                                                      + 1
//
// The entries of A_i sum to at most 1.75 in magnitude, so those magnitudes sum to at most N times
// |C - E|_1 + 1.75 sum e_i, where N is the largest entry of the normal, cancellation not counted.  `reach`
// has 2 for 1.75: 18 <= 20, and 18 * 1.75 <= 20 * 2.
constexpr double kPlaneError = 20.0 * kUnitRoundoff;

// The offset takes part in two of these roundings, those of s and of s +- r.
constexpr double kOffsetError = 2.0 * kUnitRoundoff;

// About 30 products per plane may underflow, each losing at most 2^-1075; normals are about 1.
constexpr double kUnderflow = 0x1p-1060;

// Products of rows of box axes are off by at most 1e-2, so sum e_i |n . A_i| <= |n| |e| sqrt(1.03).
constexpr double kMaxStretch = 1.02;

// ---------------------------------------------------------------------------------- error bounds of axes

// Culling is affine invariant, so everything is brought to about 1 by powers of two, which round nothing:
// the coordinates (a, b, d), each by its own, which makes an ordinary frustum of a needle or a very wide
// window; then the edges B_i of the box, each against its extent; then all lengths.  Products of what is left
// cannot overflow.  Windows thinner than 2^-1000 near stay thin, lest the map itself overflow.
constexpr int kMinSlopeExponent = -1000;

// Entries of edges below this are set to zero, and tolerances are at least kFloor in each coordinate.  That
// covers the change (4 entries of at most 2^-300) and all underflow: edges that are not zero are >= 2^-300,
// entries of a cross product that are not zero are >= 2^-600 2^-104 (both factors have 53 bits), times kFloor
// >= 2^-994, while an underflow loses 2^-1075.
constexpr double kNegligible = 0x1p-300;
constexpr double kFloor = 0x1p-290;

// On the way to those units, where lengths are about 1 but the map is not, about 20 products and entries may
// underflow, each losing at most 2^-1075.  What they lose is mapped, scaled and added to kFloor.
constexpr double kLost = 0x1p-1060;

// The tolerance tol of a coordinate is kCullError times Z + W.  Z = |C - E| + sum e_k |A_k|, mapped with the
// magnitudes of the dual basis; W = extent of the frustum as far as it matters.  It has two parts, in units u
// of roundoff:
//
// 1. The box in floating point is not the given one: each of its points is off by at most 13 u Z.
//    9 (dual basis) + 1 (C - E) + 1 (product) + 2 (sums)
// 2. For that rounded box, the gap along an axis M is off by at most 10 u sum |M| (Z + W).
//    box      2 (entry of M, relative) + 1 (product) + 2 (sums) + 1 (times e) + 2 (sums)
//    frustum  2 (entry of M, relative) + 1 (width) + 1 (product) + 2 (sums) + 1 (far end) + 1 (times it)
//    gap      2 (differences)
//
// Together 23 u; 32 u leaves room for second-order terms and for the rounding of the bound itself.
//
// Why this proves a verdict.  The gap along M is the distance between the two projections, < 0 if they
// overlap; its bound is sum |M| tol.
//
// - Some gap > bound: the given bodies are disjoint, for M separates them.
// - All gaps <= -bound: let K be the set of differences of points of the frustum and of the rounded box.  The
//   axes hold all facet normals of K, for flat boxes too, so K contains the brick Q = +-13 u Z.  The given
//   box is within Q of the rounded one; were it disjoint from the frustum, then along the direction that
//   separates them K would not contain Q.
constexpr double kCullError = 32.0 * kUnitRoundoff;

/// What the axes tested so far say.
struct Tally {
    bool separated = false;     ///< some axis shows a gap
    bool proven_apart = false;  ///< some axis shows a gap above its error bound
    bool proven_meet = true;    ///< all axes overlap by at least their error bounds

    /// A null axis has gap 0 and bound 0, and says nothing.
    void add(double gap, double bound) {
        separated |= gap > 0.0;
        proven_apart |= gap > bound;
        proven_meet &= -gap >= bound;
    }
};

/// Frustum coordinates of a box, and the lengths of the frustum in the same unit.
struct LocalScene {
    Vec3 center;
    Vec3 edge[3];    ///< A_i, scaled to about 1; without extents, so that flat boxes keep their directions
    double half[3];  ///< extents in units of these edges
    Vec3 bound;      ///< Z above
    Vec3 floor;      ///< least tolerance
    double near, far;
};

double drop_negligible(double x) { return std::fabs(x) < kNegligible ? 0.0 : x; }

Vec3 drop_negligible(Vec3 v) { return {drop_negligible(v.x), drop_negligible(v.y), drop_negligible(v.z)}; }

Vec3 map_magnitudes(const Mat3& m, Vec3 v) {
    const Vec3 w = magnitudes(v);
    return {dot(magnitudes(m.row[0]), w), dot(magnitudes(m.row[1]), w), dot(magnitudes(m.row[2]), w)};
}

/// Sum of e_i |M . B_i|: half the width of the box along M.
GEOMSRV_INLINE double radius(const LocalScene& scene, Vec3 m) {
    return scene.half[0] * std::fabs(dot(m, scene.edge[0])) +
           scene.half[1] * std::fabs(dot(m, scene.edge[1])) +
           scene.half[2] * std::fabs(dot(m, scene.edge[2]));
}

GEOMSRV_INLINE double error_bound(Vec3 m, Vec3 tolerance) { return dot(magnitudes(m), tolerance); }

/// The same for the half spaces of the frustum, which also tell whether the box is inside.
struct PlaneTally {
    Tally axes;
    bool inside = true;              ///< no corner beyond any plane
    bool proven_inside = true;       ///< the same by more than the error bounds
    bool proven_not_inside = false;  ///< some corner beyond a plane by at least its error bound

    /// s = signed distance of the centre from the plane, r = half width of the box.
    void add(double s, double r, double bound) {
        axes.add(s - r, bound);
        inside &= s + r <= 0.0;
        proven_inside &= s + r <= -bound;
        proven_not_inside |= s + r >= bound;
    }
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

CullPlanes cull_planes(const Frustum& frustum) {
    const Mat3 dual = to_frustum(frustum.axes);
    const auto [left, up, view] = dual.row;
    CullPlanes planes;
    planes.origin = frustum.origin;
    int count = 0;
    // Normal p * row + r * view, offset.
    const auto add = [&](double p, Vec3 row, double r, double offset) {
        const PowerOfTwo unit(-std::ilogb(std::max(std::fabs(p), std::fabs(r))));
        const double scaled_p = unit * p, scaled_r = unit * r;
        const Vec3 n = scaled_p * row + scaled_r * view;
        const Vec3 terms = std::fabs(scaled_p) * magnitudes(row) + std::fabs(scaled_r) * magnitudes(view);
        planes.each[count++] = {n.x,
                                n.y,
                                n.z,
                                offset,
                                kMaxStretch * norm(n),
                                kPlaneError * largest(terms),
                                kOffsetError * std::fabs(offset) + kUnderflow};
    };
    add(0.0, view, -1.0, -frustum.near);
    add(0.0, view, 1.0, frustum.far);
    add(frustum.near, left, -frustum.l1, 0.0);
    add(-frustum.near, left, frustum.l0, 0.0);
    add(frustum.near, up, -frustum.u1, 0.0);
    add(-frustum.near, up, frustum.u0, 0.0);
    for (int k = 0; k < CullPlanes::kGroups * Lanes::kCount; ++k) {
        const PlaneLanes& plane = planes.each[k % CullPlanes::kCount];
        PlaneLanes& group = planes.group[k / Lanes::kCount];
        for (Lanes PlaneLanes::* const field :
             {&PlaneLanes::x, &PlaneLanes::y, &PlaneLanes::z, &PlaneLanes::offset, &PlaneLanes::length,
              &PlaneLanes::error_per_length, &PlaneLanes::error}) {
            (group.*field).v[k % Lanes::kCount] = (plane.*field)[0];
        }
    }
    return planes;
}

CullFrame cull_frame(const Frustum& frustum) {
    const Mat3 dual = to_frustum(frustum.axes);
    const int depth = std::ilogb(frustum.near);
    const auto slope_exponent = [&](double low, double high) {
        return std::max(std::ilogb(std::max(std::fabs(low), std::fabs(high))) - depth, kMinSlopeExponent);
    };
    const int left = slope_exponent(frustum.l0, frustum.l1), up = slope_exponent(frustum.u0, frustum.u1);
    CullFrame frame;
    frame.origin = frustum.origin;
    frame.dual = {{PowerOfTwo(-left) * dual.row[0], PowerOfTwo(-up) * dual.row[1], dual.row[2]}};
    const PowerOfTwo left_unit(-depth - left), up_unit(-depth - up);
    frame.l0 = drop_negligible(left_unit * frustum.l0);
    frame.l1 = drop_negligible(left_unit * frustum.l1);
    frame.u0 = drop_negligible(up_unit * frustum.u0);
    frame.u1 = drop_negligible(up_unit * frustum.u1);
    frame.left = Lanes(Lanes::Vector{frame.l0, frame.l1, frame.l0, frame.l1});
    frame.up = Lanes(Lanes::Vector{frame.u0, frame.u0, frame.u1, frame.u1});
    const double width = frame.l1 - frame.l0, height = frame.u1 - frame.u0;
    frame.left_step = Lanes(Lanes::Vector{width, -width, width, -width});
    frame.up_step = Lanes(Lanes::Vector{height, height, -height, -height});
    frame.view = PowerOfTwo(-depth) * frustum.near;
    frame.near = frustum.near;
    frame.far = frustum.far;
    return frame;
}

namespace {

/// `offset` is C - E times `shrink`, `length` the largest length of the box, seen from the apex.
GEOMSRV_INLINE LocalScene local_scene(const CullFrame& frame, const OrientedBox& box, Vec3 offset,
                                      double shrink, double length) {
    LocalScene scene;
    const int exponent = exponent_of(length);
    const PowerOfTwo unit(-exponent);
    const Vec3 x = unit * offset, extents = unit * (shrink * box.half_extents);
    const double given_half[3] = {extents.x, extents.y, extents.z};
    scene.bound = map_magnitudes(frame.dual, x);
    for (int i = 0; i < 3; ++i) {
        const Vec3 edge = frame.dual * box.axes.row[i];
        const int size = exponent_of(largest(edge));
        scene.edge[i] = drop_negligible(PowerOfTwo(-size) * edge);
        scene.half[i] = PowerOfTwo(size) * given_half[i];
        scene.bound = scene.bound + given_half[i] * map_magnitudes(frame.dual, box.axes.row[i]);
    }
    const int size = exponent_of(largest(scene.bound));
    const PowerOfTwo rest(-size), total(-exponent - size);
    const Vec3 lost = {kLost, kLost, kLost};
    scene.center = rest * (frame.dual * x);
    scene.bound = rest * scene.bound;
    scene.floor = rest * (map_magnitudes(frame.dual, lost) + lost) + Vec3{kFloor, kFloor, kFloor};
    for (double& half : scene.half) half = rest * half;
    scene.near = total * (shrink * frame.near);
    scene.far = total * (shrink * frame.far);
    return scene;
}

GEOMSRV_INLINE PlaneTally test_planes(const CullFrame& frame, const LocalScene& scene, Vec3 tolerance) {
    const Vec3 c = scene.center;
    const double depth_radius = radius(scene, {0.0, 0.0, 1.0});
    PlaneTally planes;
    planes.add(scene.near - c.z, depth_radius, tolerance.z);
    planes.add(c.z - scene.far, depth_radius, tolerance.z);
    for (const Vec3 normal : {Vec3{frame.view, 0.0, -frame.l1}, Vec3{-frame.view, 0.0, frame.l0},
                              Vec3{0.0, frame.view, -frame.u1}, Vec3{0.0, -frame.view, frame.u0}}) {
        planes.add(dot(normal, c), radius(scene, normal), error_bound(normal, tolerance));
    }
    return planes;
}

/// Faces of the box, L x B_i and U x B_i.  The slanted edges run from near_end v_k to far_end v_k.
GEOMSRV_INLINE Tally test_box_axes(const CullFrame& frame, const LocalScene& scene, double near_end,
                                   double far_end, Vec3 tolerance) {
    Tally axes;
    // Gap between the box, center +- r, and the frustum: M . v_k is between `low` and `high`.
    const auto add = [&](Vec3 m, double r, double low, double high) __attribute__((always_inline)) {
        const double center = dot(m, scene.center);
        const double least = std::min(near_end * low, far_end * low);
        const double most = std::max(near_end * high, far_end * high);
        axes.add(std::max((center - r) - most, least - (center + r)), error_bound(m, tolerance));
    };
    for (int i = 0; i < 3; ++i) {
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        const Vec3 b = scene.edge[i], bj = scene.edge[j], bk = scene.edge[k];
        // The normal of a face is the cross product of its edges: the map need not keep right angles.
        const Vec3 normal = {difference_of_products(bj.y, bk.z, bj.z, bk.y),
                             difference_of_products(bj.z, bk.x, bj.x, bk.z),
                             difference_of_products(bj.x, bk.y, bj.y, bk.x)};
        const double l0 = frame.l0 * normal.x, l1 = frame.l1 * normal.x;
        const double u0 = frame.u0 * normal.y, u1 = frame.u1 * normal.y;
        const double d = frame.view * normal.z;
        add(normal, scene.half[i] * std::fabs(dot(normal, b)), std::min(l0, l1) + std::min(u0, u1) + d,
            std::max(l0, l1) + std::max(u0, u1) + d);

        const auto others = [&](Vec3 m) __attribute__((always_inline)) {
            return scene.half[j] * std::fabs(dot(m, bj)) + scene.half[k] * std::fabs(dot(m, bk));
        };
        const Vec3 left_cross = {0.0, -b.z, b.y}, up_cross = {b.z, 0.0, -b.x};
        const double v0 = frame.u0 * left_cross.y, v1 = frame.u1 * left_cross.y;
        const double v = frame.view * left_cross.z;
        add(left_cross, others(left_cross), std::min(v0, v1) + v, std::max(v0, v1) + v);
        const double w0 = frame.l0 * up_cross.x, w1 = frame.l1 * up_cross.x;
        const double w = frame.view * up_cross.z;
        add(up_cross, others(up_cross), std::min(w0, w1) + w, std::max(w0, w1) + w);
    }
    return axes;
}

/// Slanted edge x B_i.  Where the two are near parallel, M is tiny; difference_of_products keeps its relative
/// accuracy.  M . v_k and M . B_i are 0 and not computed: their rounding noise, multiplied by far_end or by
/// the extent, would be taken for a gap or hide one.  The other slanted edges are v_k plus steps, so they
/// project to left_step M_a, up_step M_b and the sum of both, free of cancellation.
GEOMSRV_INLINE Tally test_slanted_edges(const CullFrame& frame, const LocalScene& scene, double far_end,
                                        Vec3 tolerance) {
    LaneMask separated = Lanes(1.0) < Lanes(0.0), proven_apart = separated, proven_meet = ~separated;
    const Lanes view = frame.view, none = 0.0;
    for (int i = 0; i < 3; ++i) {
        const Vec3 b = scene.edge[i];
        const Lanes mx = difference_of_products(frame.up, Lanes(b.z), view, Lanes(b.y));
        const Lanes my = difference_of_products(view, Lanes(b.x), frame.left, Lanes(b.z));
        const Lanes mz = difference_of_products(frame.left, Lanes(b.y), frame.up, Lanes(b.x));
        const auto along = [&](Vec3 v)
                               __attribute__((always_inline)) { return mx * v.x + my * v.y + mz * v.z; };
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        const Lanes center = along(scene.center);
        const Lanes r =
            scene.half[j] * magnitude(along(scene.edge[j])) + scene.half[k] * magnitude(along(scene.edge[k]));
        const Lanes p = frame.left_step * mx, q = frame.up_step * my, pq = p + q;
        const Lanes most = far_end * greater(greater(none, p), greater(q, pq));
        const Lanes least = far_end * lesser(lesser(none, p), lesser(q, pq));
        const Lanes gap = greater((center - r) - most, least - (center + r));
        const Lanes bound =
            magnitude(mx) * tolerance.x + magnitude(my) * tolerance.y + magnitude(mz) * tolerance.z;
        separated = separated | (none < gap);
        proven_apart = proven_apart | (bound < gap);
        proven_meet = proven_meet & (bound <= -gap);
    }
    return {any(separated), any(proven_apart), all(proven_meet)};
}

}  // namespace

GEOMSRV_WIDE_CLONES CullVerdict cull_by_axes(const CullFrame& frame, const OrientedBox& box) {
    // C - E must not overflow; a quarter of it cannot.
    const double shrink = std::max(largest(box.center), largest(frame.origin)) > 0x1p1020 ? 0.25 : 1.0;
    const Vec3 offset = shrink * box.center - shrink * frame.origin;
    const double length = std::max(largest(offset), shrink * largest(box.half_extents));
    if (length == 0.0) return {CullState::outside, true};  // a single point at the apex
    const LocalScene scene = local_scene(frame, box, offset, shrink, length);

    // A box in front of the near plane ends here, so below near <= its largest depth.
    const double deepest = scene.center.z + radius(scene, {0.0, 0.0, 1.0});
    const double depth_bound = kCullError * scene.bound.z + scene.floor.z;
    if (scene.near - deepest > depth_bound) return {CullState::outside, true};

    // Cut the frustum off well beyond the deepest point of the box: that changes nothing for the box, and the
    // far end no longer multiplies rounding noise by far / near.
    const double cut = std::min(scene.far, 2.0 * (deepest + depth_bound));
    const double near_end = scene.near / frame.view, far_end = cut / frame.view;
    const Vec3 window = {std::fabs(frame.l0) + std::fabs(frame.l1), std::fabs(frame.u0) + std::fabs(frame.u1),
                         frame.view};
    const Vec3 tolerance = kCullError * (scene.bound + far_end * window) + scene.floor;

    const PlaneTally planes = test_planes(frame, scene, tolerance);
    if (planes.axes.proven_apart) return {CullState::outside, true};
    if (planes.proven_inside) return {CullState::inside, true};
    const Tally faces = test_box_axes(frame, scene, near_end, far_end, tolerance);
    if (faces.proven_apart) return {CullState::outside, true};
    const Tally edges = test_slanted_edges(frame, scene, far_end, tolerance);
    if (edges.proven_apart) return {CullState::outside, true};

    if (planes.inside) return {CullState::inside, false};
    if (planes.axes.separated || faces.separated || edges.separated) return {CullState::outside, false};
    const bool meet = planes.axes.proven_meet && faces.proven_meet && edges.proven_meet;
    return {CullState::intersects, meet && planes.proven_not_inside};
}

}  // namespace geomsrv
