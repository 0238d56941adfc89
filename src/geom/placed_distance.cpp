// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
#include "geom/placed_distance.hpp"

#include <cmath>
#include <limits>

namespace geomsrv {

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Products below 2^-1022 are rounded to multiples of 2^-1074, by half a unit each; a pose takes a dozen.
constexpr double kUnderflow = 16 * std::numeric_limits<double>::denorm_min();

bool unrotated(const double* pose) { return pose[3] == 0.0 && pose[4] == 0.0 && pose[5] == 0.0; }

/// What rounding took from the difference a - b; exact (Knuth's two-sum).
double lost(double a, double b) {
    const double difference = a - b;
    const double taken = a - difference;
    return std::fabs((a - (difference + taken)) + (taken - b));
}

/// Pose of b in a: the position turned into the axes of a, and conj(q_a) q_b, normalised as
/// geomsrv._validate.poses does, so that whoever asks about the same pose gets the same answer.
Transform relative_pose(const double* a, const Mat3& rotation_a, const double* b) {
    const Vec3 step{b[0] - a[0], b[1] - a[1], b[2] - a[2]};
    const double ax = a[3], ay = a[4], az = a[5], aw = a[6];
    const double bx = b[3], by = b[4], bz = b[5], bw = b[6];
    const double x = aw * bx - ax * bw - ay * bz + az * by;
    const double y = aw * by + ax * bz - ay * bw - az * bx;
    const double z = aw * bz - ax * by + ay * bx - az * bw;
    const double w = aw * bw + ax * bx + ay * by + az * bz;
    const double norm = std::sqrt(x * x + y * y + z * z + w * w);
    return {rotation_of(x / norm, y / norm, z / norm, w / norm), transposed_times(rotation_a, step)};
}

/// How far from the origins the rounding of a rotation is felt: r_a + r_b + |p_ab|.  Of a half space, what
/// counts is where the other body is and how far off the boundary lies.  One of them at most is unbounded.
double arm(const PlacedShape& a, const PlacedShape& b, double apart) {
    const auto bounded = [apart](const PlacedShape& shape, double other) {
        return std::isinf(shape.reach) ? apart + other + std::fabs(shape.shape.params[3]) : shape.reach;
    };
    return bounded(a, b.reach) + bounded(b, a.reach) + apart;
}

bool is_half_space(const PlacedShape& shape) { return shape.shape.kind == ShapeKind::half_space; }

// Half spaces are known to lean if they do by more than this times the pose rounding: that turns one against
// the other by two of it (both reaches 1), and the normals and their product err by less than one more.
constexpr double kLean = 4.0;

// A gap between planes, in terms of the pose rounding times the distance of the origins and both offsets: the
// lean that is not known costs kLean, the pose one, and the plane's own product less than another.
constexpr double kPlaneGap = kLean + 2.0;

/// Two half spaces whose relative rotation was rounded.  Unless it is certain that they lean, and then share
/// an unbounded part, all that is known is that they are no farther apart than parallel planes would be.
void widen_half_spaces(Separation& s, const PlacedShape& a, const PlacedShape& b, const Transform& X_ab,
                       double pose_rounding) {
    const double* const own = a.shape.params;
    const double* const other = b.shape.params;
    const Vec3 p = X_ab.translation;
    const Vec3 n{own[0], own[1], own[2]};
    const Vec3 m = X_ab.rotation * Vec3{other[0], other[1], other[2]};
    if (dot(n, m) >= 0.0 || norm(cross(n, m)) > kLean * pose_rounding) return;
    const double apart = std::fabs(p.x) + std::fabs(p.y) + std::fabs(p.z);
    const double size = std::fabs(own[3]) + std::fabs(other[3]) + apart;
    const double gap = -own[3] - other[3] - dot(m, p);
    const double most = gap + (kPlaneGap * pose_rounding * size + kUnderflow);
    s.lower = -kInfinity;
    s.upper = std::isnan(most) ? kInfinity : std::fmax(s.upper, most);
}

}  // namespace

Separation placed_distance(const PlacedShape& a, const PlacedShape& b, double pose_rounding,
                           const Wanted& wanted, double* scratch) {
    const Transform X_a = pose_of(a.pose);
    const Transform X_ab = relative_pose(a.pose, X_a.rotation, b.pose);
    Separation s = shape_distance(a.shape, b.shape, X_ab, wanted, scratch);
    if (s.outcome == Outcome::unsupported) {
        return s;
    }
    // Bodies at round numbers of metres lose nothing, and neither do bodies that are not turned; their
    // interval shows it.
    double slack = a.uncertainty + b.uncertainty;
    const bool turned = !(unrotated(a.pose) && unrotated(b.pose));
    if (turned && is_half_space(a) && is_half_space(b)) {
        widen_half_spaces(s, a, b, X_ab, pose_rounding);
    } else if (turned) {
        const Vec3 p = X_ab.translation;
        slack += pose_rounding * arm(a, b, std::fabs(p.x) + std::fabs(p.y) + std::fabs(p.z)) + kUnderflow;
    }
    for (int k = 0; k < 3; ++k) {
        slack += lost(b.pose[k], a.pose[k]);
    }
    if (slack > 0.0) {
        s.lower = std::nextafter(s.lower - slack, -kInfinity);
        s.upper = std::nextafter(s.upper + slack, kInfinity);
    }
    if (!wanted.penetration && s.lower < 0.0) {
        s.lower = 0.0;
    }
    if (s.rung == Rung::bound) {
        s.distance = s.lower;
    }
    s.point_a = X_a * s.point_a;
    s.point_b = X_a * s.point_b;
    s.normal = X_a.rotation * s.normal;
    return s;
}

}  // namespace geomsrv
