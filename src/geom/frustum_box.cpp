// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
#include "geom/frustum_box.hpp"

#include <algorithm>

namespace geomsrv {

namespace {

// ---------------------------------------------------------------------------------------------- powers of
// two

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

// ------------------------------------------------------------------------------------------------- plane
// bounds

// u = unit roundoff.  Rounding errors of the planes, as multiples of u times the sum of the magnitudes of the
// terms:
//   entries of a normal        9 (dual basis) + 2 (p * row + r * row)                                   11
//   s = normal . (C - E)       11 + 1 (C - E) + 1 (product) + 2 (sums) + 1 (minus offset)               16
//   r = sum e_i |normal . A_i| 11 + 1 (product) + 2 (sums) + 1 (times e) + 2 (sums)                     17
//   s +- r                                                                                              +1
// Entries of A_i sum to at most 1.75 in magnitude, so the magnitudes sum to at most N (|X|_1 + 1.75 sum e_i)
// with N the largest entry of the normal, cancellation not counted; `reach` has 2 for 1.75.  18 <= 20; 18
// * 1.75 <= 20 * 2.
constexpr double kPlaneError = 20.0 * kUnitRoundoff;

// A unit axis of a box may be off by 1e-2 in each product of rows, so sum e_i |n . A_i| <= |n| |e|
// sqrt(1.03).
constexpr double kMaxStretch = 1.02;

// The subtraction of the offset and the final s +- r round once each, relative to the offset too.
constexpr double kOffsetError = 2.0 * kUnitRoundoff;

// About 30 products per plane may underflow, each losing at most 2^-1075; normals are about 1.
constexpr double kUnderflow = 0x1p-1060;

// ------------------------------------------------------------------------------------------------- axes
// bounds

// Culling is affine invariant, so everything is brought to about 1 by powers of two, which round nothing:
// coordinates (a, b, d) each by its own, which makes an ordinary frustum of a needle or of a very wide
// window; then the edges B_i of the box, each by its own against its extent; then all lengths.  Products of
// what is left cannot overflow.  Windows thinner than 2^-1000 near stay thin, so that the map itself does not
// overflow.
constexpr int kMinSlopeExponent = -1000;

// Entries of edges below this are set to zero, and the tolerances below are at least kFloor in each
// coordinate, which covers that change (4 entries of at most 2^-300) and all underflow: edges that are not
// zero are then >= 2^-300, entries of a cross product that are not zero are >= 2^-600 2^-104 (both factors
// have 53 bits), times kFloor >= 2^-994, while an underflow loses 2^-1075.
constexpr double kNegligible = 0x1p-300;
constexpr double kFloor = 0x1p-290;

// On the way to those units, where lengths are about 1 but the map is not, about 20 products and entries may
// underflow, each losing at most 2^-1075.  What they lose is mapped, scaled and added to kFloor.
constexpr double kLost = 0x1p-1060;

// Tolerance per coordinate is kCullError times the magnitudes Z + W, where Z = |C - E| + sum e_k |A_k|,
// mapped with the magnitudes of the dual basis, and W = extent of the (truncated) frustum.  Two parts, u =
// unit roundoff:
//
// 1. The box in floating point is not the given box.  Each of its points is off by at most 13 u Z in each
// coordinate:
//    9 (dual basis) + 1 (C - E) + 1 (product) + 2 (sums).
// 2. For that rounded box a projection on an axis M is off by at most 10 u sum_i |M_i| (Z_i + W_i):
//    2 (entry of M, relative, thanks to difference_of_products) + 1 (product) + 2 (sums) + 1 (times e) + 2
//    (sums) for the box, 2 + 1 + 1 (width) + 2 + 1 (far end) for the frustum, and 2 for the final
//    differences.
//
// Together 23 u; 32 u leaves room for second-order terms and for the rounding of the bound itself.
//
// Why this proves the verdict.  Let the gap along M be the distance between the two projections, < 0 if they
// overlap.
// - A gap above tol = sum |M_i| tol_i on any axis: the given bodies are disjoint along that axis.
// - An overlap of at least tol on all axes: let K be the set of differences of points of frustum and rounded
// box.  The
//   axes contain all facet normals of K (also for flat boxes), so K contains the brick Q = +-13 u Z.  The
//   given box is within Q of the rounded one, coordinate by coordinate; were it disjoint from the frustum,
//   some direction would separate them, and K would lack a point of Q in that direction.
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

/// The box in scaled frustum coordinates.
struct LocalBox {
    Vec3 center;
    Vec3 edge[3];  ///< A_i mapped and scaled to about 1, without extents: boxes of zero extent keep their
                   ///< directions
    Vec3 half;     ///< extents in units of these edges
    Vec3 bound;    ///< Z above
};

double drop_negligible(double x) { return std::fabs(x) < kNegligible ? 0.0 : x; }

Vec3 drop_negligible(Vec3 v) { return {drop_negligible(v.x), drop_negligible(v.y), drop_negligible(v.z)}; }

Vec3 map_magnitudes(const Mat3& m, Vec3 v) {
    const Vec3 w = magnitudes(v);
    return {dot(magnitudes(m.row[0]), w), dot(magnitudes(m.row[1]), w), dot(magnitudes(m.row[2]), w)};
}

/// Sum of e_i |M . B_i|: half the width of the box along M.
double radius(const LocalBox& box, Vec3 m) {
    return box.half.x * std::fabs(dot(m, box.edge[0])) + box.half.y * std::fabs(dot(m, box.edge[1])) +
           box.half.z * std::fabs(dot(m, box.edge[2]));
}

/// Half spaces of the frustum.
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
    CullFrame frame{};
    frame.origin = frustum.origin;
    frame.dual = {{PowerOfTwo(-left) * dual.row[0], PowerOfTwo(-up) * dual.row[1], dual.row[2]}};
    const PowerOfTwo left_unit(-depth - left), up_unit(-depth - up);
    const double l[2] = {drop_negligible(left_unit * frustum.l0), drop_negligible(left_unit * frustum.l1)};
    const double u[2] = {drop_negligible(up_unit * frustum.u0), drop_negligible(up_unit * frustum.u1)};
    for (int k = 0; k < 4; ++k) {
        frame.left[k] = l[k & 1];
        frame.up[k] = u[k >> 1];
        frame.left_step[k] = l[~k & 1] - l[k & 1];
        frame.up_step[k] = u[~k >> 1 & 1] - u[k >> 1];
    }
    frame.view = PowerOfTwo(-depth) * frustum.near;
    frame.near = frustum.near;
    frame.far = frustum.far;
    return frame;
}

GEOMSRV_WIDE_CLONES CullVerdict cull_by_axes(const CullFrame& frame, const OrientedBox& given) {
    // C - E must not overflow; a quarter of it cannot.
    const double shrink = std::max(largest(given.center), largest(frame.origin)) > 0x1p1020 ? 0.25 : 1.0;
    const Vec3 offset = shrink * given.center - shrink * frame.origin;
    const double length = std::max(largest(offset), shrink * largest(given.half_extents));
    if (length == 0.0) {
        return {CullState::outside, true};  // a single point at the apex
    }
    const int exponent = exponent_of(length);
    const PowerOfTwo unit(-exponent);
    const Vec3 x = unit * offset;
    const Vec3 extents = unit * (shrink * given.half_extents);

    LocalBox box;
    box.center = frame.dual * x;
    box.bound = map_magnitudes(frame.dual, x);
    double half[3] = {extents.x, extents.y, extents.z};
    for (int i = 0; i < 3; ++i) {
        const Vec3 edge = frame.dual * given.axes.row[i];
        box.bound = box.bound + half[i] * map_magnitudes(frame.dual, given.axes.row[i]);
        const int size = exponent_of(largest(edge));
        box.edge[i] = drop_negligible(PowerOfTwo(-size) * edge);
        half[i] = PowerOfTwo(size) * half[i];
    }
    const int size = exponent_of(largest(box.bound));
    const PowerOfTwo rest(-size);
    box.center = rest * box.center;
    box.bound = rest * box.bound;
    for (double& e : half) e = rest * e;
    box.half = {half[0], half[1], half[2]};
    const PowerOfTwo total(-exponent - size);
    const double near = total * (shrink * frame.near), far = total * (shrink * frame.far);
    const Vec3 c = box.center, lost = {kLost, kLost, kLost};
    const Vec3 floor = rest * (map_magnitudes(frame.dual, lost) + lost) + Vec3{kFloor, kFloor, kFloor};

    // Near and far.  A box in front of the near plane ends here, so below near <= largest depth of the box.
    const double depth_radius = radius(box, {0.0, 0.0, 1.0});
    const double depth_bound = kCullError * box.bound.z + floor.z;
    if (near - (c.z + depth_radius) > depth_bound) {
        return {CullState::outside, true};
    }
    // Cut the frustum off well beyond the deepest point of the box: that changes nothing for the box, and the
    // far end no longer multiplies rounding noise by far / near.
    const double cut = std::min(far, 2.0 * (c.z + depth_radius + depth_bound));
    const double far_end = cut / frame.view,
                 near_end = near / frame.view;  // slanted edges: near_end v to far_end v
    const Vec3 window = {std::fabs(frame.left[0]) + std::fabs(frame.left[1]),
                         std::fabs(frame.up[0]) + std::fabs(frame.up[2]), frame.view};
    const Vec3 tolerance = kCullError * (box.bound + far_end * window) + floor;
    const auto error_bound = [&](Vec3 m) { return dot(magnitudes(m), tolerance); };

    PlaneTally planes;
    planes.add(near - c.z, depth_radius, tolerance.z);
    planes.add(c.z - far, depth_radius, tolerance.z);
    for (const int k : {0, 3}) {
        const double sign = k == 0 ? -1.0 : 1.0;  // outward: -L and -U side, then +L and +U side
        const Vec3 across = {sign * frame.view, 0.0, -sign * frame.left[k]};
        const Vec3 upward = {0.0, sign * frame.view, -sign * frame.up[k]};
        planes.add(dot(across, c), radius(box, across), error_bound(across));
        planes.add(dot(upward, c), radius(box, upward), error_bound(upward));
    }
    if (planes.axes.proven_apart || planes.proven_inside) {
        return {planes.axes.proven_apart ? CullState::outside : CullState::inside, true};
    }

    Tally axes = planes.axes;
    // Gap between the projections of the box, center +- r, and of the frustum, whose slanted edges project
    // from near_end q to far_end q with q in [low, high].
    const auto add = [&](Vec3 m, double r, double low, double high) {
        const double center = dot(m, c);
        const double least = std::min(near_end * low, far_end * low);
        const double most = std::max(near_end * high, far_end * high);
        axes.add(std::max((center - r) - most, least - (center + r)), error_bound(m));
    };
    for (int i = 0; i < 3; ++i) {
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        const Vec3 b = box.edge[i], bj = box.edge[j], bk = box.edge[k];
        // Face of the box.  Its normal is a cross product of edges: the map need not keep right angles.
        const Vec3 normal = {difference_of_products(bj.y, bk.z, bj.z, bk.y),
                             difference_of_products(bj.z, bk.x, bj.x, bk.z),
                             difference_of_products(bj.x, bk.y, bj.y, bk.x)};
        const double l0 = frame.left[0] * normal.x, l1 = frame.left[1] * normal.x;
        const double u0 = frame.up[0] * normal.y, u1 = frame.up[2] * normal.y;
        const double d = frame.view * normal.z;
        add(normal, half[i] * std::fabs(dot(normal, b)), std::min(l0, l1) + std::min(u0, u1) + d,
            std::max(l0, l1) + std::max(u0, u1) + d);
        // L x B_i and U x B_i.
        const Vec3 left_cross = {0.0, -b.z, b.y}, up_cross = {b.z, 0.0, -b.x};
        const double v0 = frame.up[0] * left_cross.y, v1 = frame.up[2] * left_cross.y,
                     v = frame.view * left_cross.z;
        add(left_cross, half[j] * std::fabs(dot(left_cross, bj)) + half[k] * std::fabs(dot(left_cross, bk)),
            std::min(v0, v1) + v, std::max(v0, v1) + v);
        const double w0 = frame.left[0] * up_cross.x, w1 = frame.left[1] * up_cross.x,
                     w = frame.view * up_cross.z;
        add(up_cross, half[j] * std::fabs(dot(up_cross, bj)) + half[k] * std::fabs(dot(up_cross, bk)),
            std::min(w0, w1) + w, std::max(w0, w1) + w);
    }
    if (axes.proven_apart) {
        return {CullState::outside, true};
    }

    // Slanted edge x B_i.  Near-parallel edges make M tiny; it keeps its relative accuracy by
    // difference_of_products. Exactly, M . v_k = 0 and M . B_i = 0: neither is computed, for their rounding
    // noise, multiplied by far_end or by the extent, would be taken for a gap or would hide one.  The other
    // edges of the frustum are v_k plus a step, so they project to left_step M_a, up_step M_b and their sum,
    // free of cancellation.
    for (int i = 0; i < 3; ++i) {
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        const Vec3 b = box.edge[i], bj = box.edge[j], bk = box.edge[k];
        double gap[4], bound[4];
        for (int v = 0; v < 4; ++v) {
            const double mx = difference_of_products(frame.up[v], b.z, frame.view, b.y);
            const double my = difference_of_products(frame.view, b.x, frame.left[v], b.z);
            const double mz = difference_of_products(frame.left[v], b.y, frame.up[v], b.x);
            const double center = mx * c.x + my * c.y + mz * c.z;
            const double r = half[j] * std::fabs(mx * bj.x + my * bj.y + mz * bj.z) +
                             half[k] * std::fabs(mx * bk.x + my * bk.y + mz * bk.z);
            const double p = frame.left_step[v] * mx, q = frame.up_step[v] * my, pq = p + q;
            const double most = far_end * std::max(std::max(0.0, p), std::max(q, pq));
            const double least = far_end * std::min(std::min(0.0, p), std::min(q, pq));
            gap[v] = std::max((center - r) - most, least - (center + r));
            bound[v] =
                std::fabs(mx) * tolerance.x + std::fabs(my) * tolerance.y + std::fabs(mz) * tolerance.z;
        }
        for (int v = 0; v < 4; ++v) {
            axes.add(gap[v], bound[v]);
        }
    }
    if (axes.proven_apart) {
        return {CullState::outside, true};
    }
    if (planes.inside) {
        return {CullState::inside, false};
    }
    if (axes.separated) {
        return {CullState::outside, false};
    }
    return {CullState::intersects, axes.proven_meet && planes.proven_not_inside};
}

}  // namespace geomsrv
