// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
#include "geom/revolved_distance.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "geom/convex_convex.hpp"
#include "geom/exact_body.hpp"
#include "geom/gjk.hpp"

namespace geomsrv {

namespace {

// Entries of R^T R round by 3 u, which makes 9 u of all nine; an axis made of unit length is off by 4 u; a
// cross product of two axes by 6 u.
constexpr double kAxisError = 20 * kUnitRoundoff;

// Gaps between profiles are off by two dot products and the parts of the distance of the centers, fewer than
// 16 roundings of numbers up to S; closer to touching than this, nearest points decide.
constexpr double kProfileError = 16 * kUnitRoundoff;
constexpr double kTouch = 4 * kProfileError;

/// A solid of revolution: points (distance from the axis, height), and their mirror images, whose hull turns.
struct Profile {
    Vec3 center;
    Vec3 axis;  ///< unit; 0 of a point, which has any
    int count = 0;
    Vec2 point[4];
    int normals = 0;
    Vec2 normal[2];  ///< outward, of the edges that neither are parallel to the axis nor across it
    double spread = 0.0;
    double error = 0.0;  ///< how far the body may be from such a solid
    double rows[12] = {};

    void add(Vec2 p) { point[count++] = p; }
    void face(Vec2 n) { normal[normals++] = n; }

    /// In the half plane, from an origin on the axis.
    Core planar(Vec2 at) {
        Core core;
        for (int i = 0; i < count; ++i) {
            rows[i] = point[i].x + at.x;
            rows[count + i] = point[i].y + at.y;
            rows[2 * count + i] = 0.0;
            core.reach = std::max(core.reach, norm(Vec2{rows[i], rows[count + i]}));
        }
        core.points = rows;
        core.count = count;
        core.reach *= 1.0 + 4 * kUnitRoundoff;
        return core;
    }
};

/// How far R is from the nearest rotation, twice: |R^T R - 1|.
double stretch_of(const Mat3& r) {
    double square = 0.0;
    const Vec3 x{r.row[0].x, r.row[1].x, r.row[2].x};
    const Vec3 y{r.row[0].y, r.row[1].y, r.row[2].y};
    const Vec3 z{r.row[0].z, r.row[1].z, r.row[2].z};
    for (const double d : {dot(x, x) - 1.0, dot(y, y) - 1.0, dot(z, z) - 1.0}) {
        square += d * d;
    }
    for (const double d : {dot(x, y), dot(x, z), dot(y, z)}) {
        square += 2 * d * d;
    }
    return std::sqrt(square);
}

std::optional<Profile> profile_of(const MaybeCurved& body) {
    Profile out;
    if (body.curved == nullptr) {
        const Core& core = *body.polytope;
        if (core.points != nullptr ? core.count > 1 : core.generators > 1) {
            return std::nullopt;
        }
        out.center = core.points != nullptr ? vertex_of(core, 0) : core.center;
        const double half = core.generators == 1 ? norm(core.generator[0]) : 0.0;
        if (half == 0.0) {
            out.add({0.0, 0.0});
            return out;
        }
        out.axis = normalized(core.generator[0]);
        out.add({0.0, half});
        out.add({0.0, -half});
        out.spread = half;
        out.error = kAxisError * half;
        return out;
    }
    const CurvedBody& curved = *body.curved;
    if (curved.kind == ShapeKind::ellipsoid) {
        return std::nullopt;
    }
    const double radius = curved.half[0];
    const double half = curved.half[2];
    out.center = curved.center;
    out.axis = normalized({curved.rotation.row[0].z, curved.rotation.row[1].z, curved.rotation.row[2].z});
    out.add({radius, -half});
    out.add({-radius, -half});
    if (curved.kind == ShapeKind::cylinder) {
        out.add({radius, half});
        out.add({-radius, half});
    } else {
        out.add({0.0, half});
        if (radius > 0.0 || half > 0.0) {
            const Vec3 side = normalized({2 * half, radius, 0.0});
            out.face({side.x, side.y});
            out.face({-side.x, side.y});
        }
    }
    out.spread = curved.spread;
    out.error = (stretch_of(curved.rotation) + kAxisError) * curved.spread;
    return out;
}

double highest(const Profile& p, Vec2 n) {
    double top = dot(n, p.point[0]);
    for (int i = 1; i < p.count; ++i) {
        top = std::max(top, dot(n, p.point[i]));
    }
    return top;
}

void turn_over(Profile& p) {
    p.axis = -p.axis;
    for (Vec2& q : p.point) {
        q.y = -q.y;
    }
    for (Vec2& n : p.normal) {
        n.y = -n.y;
    }
}

SupportedCore supported(const MaybeCurved& body, double off) {
    SupportedCore out;
    out.curved = body.curved;
    out.polytope = body.polytope;
    out.reach = body.curved != nullptr ? body.curved->reach : body.polytope->reach;
    out.error = (body.curved != nullptr ? body.curved->error : body.polytope->error) + off;
    return out;
}

}  // namespace

std::optional<CoreSeparation> revolved_distance(const MaybeCurved& body_a, const MaybeCurved& body_b,
                                                bool penetration, double most_lean) {
    std::optional<Profile> first = profile_of(body_a);
    std::optional<Profile> second = first ? profile_of(body_b) : std::nullopt;
    if (!second) {
        return std::nullopt;
    }
    Profile& a = *first;
    Profile& b = *second;
    double lean = 0.0;
    if (is_zero(a.axis)) {
        a.axis = b.axis;
    } else if (!is_zero(b.axis)) {
        lean = norm(cross(a.axis, b.axis));
        if (lean > most_lean) {
            return std::nullopt;
        }
        if (dot(a.axis, b.axis) < 0.0) {
            turn_over(b);
        }
    }
    b.error += lean * b.spread;

    const Vec3 apart = b.center - a.center;
    const double up = dot(apart, a.axis);
    const Vec3 across = apart - up * a.axis;
    const double out_by = norm(across);
    Vec3 radial = out_by > 0.0 ? normalized(across) : perpendicular(a.axis);
    // What rounding has left along the axis.
    radial = normalized(radial - dot(radial, a.axis) * a.axis);
    const Vec2 shift{out_by, up};

    // The largest gap along a normal of an edge of either.
    double best = -std::numeric_limits<double>::infinity();
    Vec2 along;
    const auto look = [&](Vec2 n) {
        const double gap = dot(n, shift) - highest(b, -n) - highest(a, n);
        if (gap > best) {
            best = gap;
            along = n;
        }
    };
    // With these, profiles that are points or segments have a normal, too: of points that differ, and of
    // segments that the other misses, some gap is not negative.
    for (const Vec2 n : {Vec2{1.0, 0.0}, Vec2{-1.0, 0.0}, Vec2{0.0, 1.0}, Vec2{0.0, -1.0}}) {
        look(n);
    }
    std::for_each(a.normal, a.normal + a.normals, look);
    std::for_each(b.normal, b.normal + b.normals, [&](Vec2 n) { look(-n); });

    const SupportedCore whole_a = supported(body_a, a.error);
    const SupportedCore whole_b = supported(body_b, b.error);
    const double size = whole_a.reach + whole_b.reach;
    const Core planar_a = a.planar({});
    const Core planar_b = b.planar(shift);
    const bool deep = best <= -kTouch * size;
    const Vec3 flat{along.x, along.y, 0.0};
    Gjk points;
    if (deep && penetration) {
        points = points_along(planar_a, planar_b, flat);
        points.normal = flat;
    } else {
        points = gjk(planar_a, planar_b, flat);
        // Where the polygons share a point, the direction found may be that across the plane.
        if (points.state == GjkState::contact || points.state == GjkState::enclosed ||
            points.normal.z != 0.0) {
            points.normal = flat;
        }
    }
    const auto in_space = [&](Vec3 n) { return normalized(n.x * radial + n.y * a.axis); };
    const auto gap_along = [&](Vec3 n) { return lowest(whole_b, n).value - highest(whole_a, n).value; };
    Vec3 normal = in_space(points.normal);
    // Of points that almost coincide the direction may be noise.
    if (gap_along(in_space(flat)) > gap_along(normal)) {
        normal = in_space(flat);
    }
    // Each from the center of its own body, of which it then is a point.
    const Vec3 point_a = a.center + (points.point_a.x * radial + points.point_a.y * a.axis);
    const Vec3 point_b =
        b.center + ((points.point_b.x - shift.x) * radial + (points.point_b.y - shift.y) * a.axis);
    CoreSeparation out = deep ? certify_deep(whole_a, whole_b, normal, point_a, point_b,
                                             best + kCurvedCoarseness * kProfileError * size)
                              : certify_apart(whole_a, whole_b, normal, point_a, point_b);
    if (deep && !penetration) {
        out.value = 0.0;
        out.outcome = Outcome::ok;
        out.normal = nan_vector();
    }
    out.stage = Stage::closed_form;
    out.iterations = points.iterations;
    return out;
}

}  // namespace geomsrv
