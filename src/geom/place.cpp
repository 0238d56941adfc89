// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
#include "geom/place.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace geomsrv {

namespace {

// A length computed from squares is off by less than this; reaches are rounded up by it.
constexpr double kRoundedUp = 1.0 + 16 * kUnitRoundoff;

// |R| <= 1 + kRotationStretch for a matrix made from a unit quaternion in doubles: the norm of the quaternion
// is off by 2 u, that of its matrix by twice as much, and each entry takes 5 roundings of numbers up to 2.
constexpr double kRotationStretch = 64 * kUnitRoundoff;

// R (v - m): 1 u for the difference, and 3 u for each row of the product, whose lengths add up to sqrt(3).
constexpr double kRotatedPointError = 7 * kUnitRoundoff;

bool is_identity(const Mat3& r) {
    return r.row[0].x == 1.0 && r.row[1].y == 1.0 && r.row[2].z == 1.0 && r.row[0].y == 0.0 &&
           r.row[0].z == 0.0 && r.row[1].x == 0.0 && r.row[1].z == 0.0 && r.row[2].x == 0.0 &&
           r.row[2].y == 0.0;
}

Vec3 column(const Mat3& r, int i) {
    const auto at = [i](Vec3 v) { return i == 0 ? v.x : i == 1 ? v.y : v.z; };
    return {at(r.row[0]), at(r.row[1]), at(r.row[2])};
}

/// A vector with a bound of its rounding.
struct Rounded {
    Vec3 value;
    double error = 0.0;
};

Rounded rounded(WideVec3 v, double size) {
    return {narrow(v), safe_norm({v.x.lo, v.y.lo, v.z.lo}) + 8 * kWideRoundoff * size};
}

/// scale * (R m + t - origin): far from the origin these cancel, so the sum is formed in double-double.
Rounded relative_wide(Vec3 m, const Transform& X_ls, const LocalFrame& frame, bool turned) {
    const Vec3 t = frame.scale * X_ls.translation;
    const Vec3 o = frame.scale * frame.origin;
    const Vec3 p = frame.scale * m;
    if (!turned) {
        // A sum is off relative to its result only.
        const WideVec3 sum = widen(p) + exact_difference(t, o);
        return rounded(sum, safe_norm(narrow(sum)));
    }
    // The products of a rotation are off relative to themselves.
    const auto row = [&](int i) { return dot(widen(p), X_ls.rotation.row[i]); };
    const WideVec3 rotated = {row(0), row(1), row(2)};
    return rounded(rotated + exact_difference(t, o), safe_norm(p) + safe_norm(t) + safe_norm(o));
}

/// The same, at no cost where nothing can round.
Rounded relative(Vec3 m, const Transform& X_ls, const LocalFrame& frame, bool turned) {
    if (is_zero(m) && is_zero(frame.origin)) {
        return {frame.scale * X_ls.translation, 0.0};
    }
    return relative_wide(m, X_ls, frame, turned);
}

/// Whether R n = m and R^T m = n without rounding, where m is R n rounded: every entry that meets a number
/// other than 0 on either way is 0 or +-1, and as the rows and columns are of length 1 and perpendicular but
/// for rounding, such numbers are only moved and negated.
bool only_permutes(const Mat3& r, Vec3 n, Vec3 m) {
    const auto whole = [](double x) { return x == 0.0 || std::abs(x) == 1.0; };
    const auto row_fits = [&](Vec3 row, double out) {
        return (whole(row.x) || (n.x == 0.0 && out == 0.0)) && (whole(row.y) || (n.y == 0.0 && out == 0.0)) &&
               (whole(row.z) || (n.z == 0.0 && out == 0.0));
    };
    return row_fits(r.row[0], m.x) && row_fits(r.row[1], m.y) && row_fits(r.row[2], m.z);
}

// How far the normal of a turned half space may be off before it is rounded to doubles.  With G = R^T R the
// normal is R G^-1 n; `turned_normal` finds R (2 - G) n, which is off by (G - 1)^2.  |G - 1| <= 256 u is
// twice the stretch of a matrix made from a product of two unit quaternions, which are each off by 3 u: their
// product by 14 u, its matrix by 4 * 14 + 11 = 67 u, rounded up.  A second (256 u)^2 pays for the roundings
// of the correction, a few u of at most 256 u.
constexpr double kInverseError = 2 * (256 * kUnitRoundoff) * (256 * kUnitRoundoff);

/// Normal of the half space that R, taken literally, makes of one with normal n: not R n but the solution m
/// of R^T m = n, since m . R x = n . x.  R^-1 is R^T up to rounding only, and what that is to the result is
/// felt at the distance of the origins.
WideVec3 turned_normal(const Mat3& r, Vec3 n) {
    const WideVec3 own = widen(n);
    const WideVec3 first = {dot(own, r.row[0]), dot(own, r.row[1]), dot(own, r.row[2])};
    if (only_permutes(r, n, narrow(first))) return first;
    const WideVec3 back = {dot(first, column(r, 0)), dot(first, column(r, 1)), dot(first, column(r, 2))};
    return first + widen(r * narrow(own - back));
}

PlacedHalfSpace place_half_space(const ShapeView& shape, const Transform& X_ls, const LocalFrame& frame) {
    const Vec3 own = {shape.params[0], shape.params[1], shape.params[2]};
    const WideVec3 turned = turned_normal(X_ls.rotation, own);
    const bool exact = only_permutes(X_ls.rotation, own, narrow(turned));
    const Rounded normal = rounded(turned, 0.0);
    // normal . (x - t) <= offset becomes normal . local <= offset + normal . (t - origin).
    const WideVec3 shift = exact_difference(frame.scale * X_ls.translation, frame.scale * frame.origin);
    const double own_offset = frame.scale * shape.params[3];
    const DoubleDouble offset = DoubleDouble{own_offset, 0.0} + dot(turned, shift);
    const double size = std::abs(own_offset) + safe_norm(narrow(shift));
    const double wide_error = 8 * kWideRoundoff + (exact ? 0.0 : kInverseError);
    return {normal.value, offset.hi, exact ? 0.0 : normal.error + wide_error,
            std::abs(offset.lo) + wide_error * size};
}

/// Supports round as kCurvedCoarseness says, so that only the center and the half sizes have errors of their
/// own; those are scaled by a power of two.
void place_curved(const ShapeView& shape, const Mat3& rotation, const Rounded& center, double scale,
                  Placed& out) {
    CurvedBody& body = out.curved.emplace();
    body.kind = shape.kind;
    body.center = center.value;
    body.rotation = rotation;
    const bool oval = shape.kind == ShapeKind::ellipsoid;
    body.half[0] = scale * shape.params[0];
    body.half[1] = oval ? scale * shape.params[1] : body.half[0];
    body.half[2] = scale * shape.params[oval ? 2 : 1];
    const double spread = oval ? largest_of({body.half[0], body.half[1], body.half[2]})
                               : safe_norm({body.half[0], body.half[2], 0.0});
    body.spread = spread * (1.0 + kRotationStretch) * kRoundedUp;
    body.error = center.error;
    const double middle = safe_norm(body.center);
    body.reach = (middle + body.spread) * kRoundedUp;
    Core& box = out.core;
    box.center = body.center;
    box.generators = 3;
    for (int i = 0; i < 3; ++i) {
        box.generator[i] = body.half[i] * column(rotation, i);
    }
    const double most = (body.half[0] + body.half[1] + body.half[2]) * (1.0 + kRotationStretch);
    box.reach = (middle + most) * kRoundedUp;
    box.error = center.error + kUnitRoundoff * most;
}

void place_hull(const ShapeView& shape, const Transform& X_ls, const LocalFrame& frame, double* scratch,
                Core& core) {
    const HullExtent extent = shape.extent != nullptr ? *shape.extent : extent_of(shape);
    const double scale = frame.scale;
    const Vec3 m = scale * extent.middle;
    const double spread = safe_norm(scale * extent.half) * kRoundedUp;
    const auto n = static_cast<std::size_t>(shape.count);
    double* x = scratch;
    double* y = x + n;
    double* z = y + n;
    const bool turned = !is_identity(X_ls.rotation);
    const Mat3& r = X_ls.rotation;
    for (std::size_t i = 0; i < n; ++i) {
        const double* v = shape.vertices + 3 * i;
        const Vec3 local = {scale * v[0] - m.x, scale * v[1] - m.y, scale * v[2] - m.z};
        const Vec3 p = turned ? r * local : local;
        x[i] = p.x;
        y[i] = p.y;
        z[i] = p.z;
    }
    const Rounded center = relative(extent.middle, X_ls, frame, turned);
    core.center = center.value;
    core.points = scratch;
    core.count = static_cast<int>(shape.count);
    core.error =
        center.error + (turned ? kRotatedPointError : kUnitRoundoff) * spread + scale * shape.params[0];
    core.reach = (safe_norm(core.center) + spread * (1.0 + kRotationStretch)) * kRoundedUp;
}

}  // namespace

double largest_of(Vec3 v) { return std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)}); }

double safe_norm(Vec3 v) {
    // Squares of numbers between these neither overflow nor lose bits.
    constexpr double kSmallest = 0x1p-400;
    constexpr double kLargest = 0x1p400;
    const double largest = largest_of(v);
    if (largest == 0.0 || (largest > kSmallest && largest < kLargest)) {
        return norm(v);
    }
    if (!(largest <= std::numeric_limits<double>::max())) {
        return std::numeric_limits<double>::infinity();
    }
    const double unit = scale_for(largest);
    return norm(unit * v) / unit;
}

double scale_for(double size) {
    // 2^1000 at most: the scale itself must be finite, and the smallest subnormal is then 2^-74.
    return std::ldexp(1.0, std::clamp(-std::ilogb(size), -1000, 1000));
}

HullExtent extent_of(const ShapeView& shape) {
    Vec3 lower{shape.vertices[0], shape.vertices[1], shape.vertices[2]};
    Vec3 upper = lower;
    for (std::ptrdiff_t i = 1; i < shape.count; ++i) {
        const double* v = shape.vertices + 3 * i;
        lower = {std::min(lower.x, v[0]), std::min(lower.y, v[1]), std::min(lower.z, v[2])};
        upper = {std::max(upper.x, v[0]), std::max(upper.y, v[1]), std::max(upper.z, v[2])};
    }
    // Halves first: the sum of two large coordinates must not overflow.
    const Vec3 middle = 0.5 * lower + 0.5 * upper;
    return {
        middle,
        {std::max(upper.x - middle.x, middle.x - lower.x), std::max(upper.y - middle.y, middle.y - lower.y),
         std::max(upper.z - middle.z, middle.z - lower.z)}};
}

Vec3 middle_of(const ShapeView& shape) {
    if (shape.kind != ShapeKind::convex) {
        return {};
    }
    return shape.extent != nullptr ? shape.extent->middle : extent_of(shape).middle;
}

double magnitude_of(const ShapeView& shape, const Transform& X_ls) {
    const double largest = largest_of(X_ls.translation);
    switch (shape.kind) {
        case ShapeKind::capsule:
            return std::max(largest, shape.params[1]);
        case ShapeKind::box:
        case ShapeKind::ellipsoid:
            return std::max(largest, largest_of({shape.params[0], shape.params[1], shape.params[2]}));
        case ShapeKind::cylinder:
        case ShapeKind::cone:
            return std::max(largest, largest_of({shape.params[0], shape.params[1], 0.0}));
        case ShapeKind::half_space:
            return std::max(largest, std::abs(shape.params[3]));
        case ShapeKind::convex: {
            const HullExtent extent = shape.extent != nullptr ? *shape.extent : extent_of(shape);
            return std::max({largest, largest_of(extent.middle), largest_of(extent.half)});
        }
        default:
            return largest;
    }
}

Placed place(const ShapeView& shape, const Transform& X_ls, const LocalFrame& frame, double* scratch) {
    Placed out;
    if (shape.kind == ShapeKind::half_space) {
        out.half_space = place_half_space(shape, X_ls, frame);
        return out;
    }
    Core& core = out.core;
    if (shape.kind == ShapeKind::convex) {
        place_hull(shape, X_ls, frame, scratch, core);
        return out;
    }
    const bool turned = !is_identity(X_ls.rotation);
    const Rounded center = relative({}, X_ls, frame, turned);
    core.center = center.value;
    if (is_curved(shape.kind)) {
        place_curved(shape, X_ls.rotation, center, frame.scale, out);
        return out;
    }
    double spread = 0.0;
    if (shape.kind == ShapeKind::box) {
        core.generators = 3;
        for (int i = 0; i < 3; ++i) {
            const double half = frame.scale * shape.params[i];
            core.generator[i] = half * column(X_ls.rotation, i);
            spread += half;
        }
    } else if (shape.kind == ShapeKind::capsule) {
        core.generators = 1;
        const double half = frame.scale * shape.params[1];
        core.generator[0] = half * column(X_ls.rotation, 2);
        spread = half;
    }
    spread *= 1.0 + kRotationStretch;
    core.reach = (safe_norm(core.center) + spread) * kRoundedUp;
    core.error = center.error + (turned ? kUnitRoundoff * spread : 0.0);
    return out;
}

Core place_box(Vec3 center, const Mat3& axes, Vec3 half_extents, const LocalFrame& frame) {
    Core core;
    const WideVec3 shift = exact_difference(frame.scale * center, frame.scale * frame.origin);
    const Rounded middle = rounded(shift, 0.0);
    core.center = middle.value;
    core.generators = 3;
    const double half[3] = {half_extents.x, half_extents.y, half_extents.z};
    double spread = 0.0;
    for (int i = 0; i < 3; ++i) {
        core.generator[i] = (frame.scale * half[i]) * axes.row[i];
        spread += safe_norm(core.generator[i]);
    }
    spread *= kRoundedUp;
    core.reach = (safe_norm(core.center) + spread) * kRoundedUp;
    core.error = middle.error + kUnitRoundoff * spread;
    return core;
}

RoundedCorners rounded_corners(const Frustum& f, bool from_apex) {
    // In double-double a ray of three products, times the ratio of the planes, is off by 2^-97 of its size at
    // most; the sum with the apex by as much of both; then each coordinate is rounded once, by u.
    constexpr double kRounding = 2 * kUnitRoundoff;
    constexpr double kBeforeRounding = 0x1p-90;
    constexpr double kUnderflow = 4 * std::numeric_limits<double>::denorm_min();
    const double window = std::max({std::abs(f.l0), std::abs(f.l1), std::abs(f.u0), std::abs(f.u1), f.near});
    const double scale = scale_for(window);
    const int up_near = std::ilogb(f.near);
    const int up_far = std::ilogb(f.far);
    const DoubleDouble ratio =
        DoubleDouble{std::ldexp(f.far, -up_far), 0.0} / DoubleDouble{std::ldexp(f.near, -up_near), 0.0};
    const Vec3 from = from_apex ? Vec3{} : f.origin;
    RoundedCorners out;
    double largest = 0.0;
    double longest = 0.0;
    for (int i = 0; i < 8; ++i) {
        const DoubleDouble left{scale * ((i & 1) != 0 ? f.l1 : f.l0), 0.0};
        const DoubleDouble up{scale * ((i & 2) != 0 ? f.u1 : f.u0), 0.0};
        const DoubleDouble near{scale * f.near, 0.0};
        WideVec3 ray = left * widen(f.axes.row[0]) + up * widen(f.axes.row[1]) + near * widen(f.axes.row[2]);
        const int exponent = (i & 4) != 0 ? up_far - up_near : 0;
        if ((i & 4) != 0) {
            ray = ratio * ray;
        }
        const auto placed = [&](DoubleDouble x, double start) {
            const double hi = std::ldexp(x.hi / scale, exponent);
            const DoubleDouble sum = two_sum(start, hi);
            longest = std::max(longest, std::abs(hi));
            return sum.hi + (sum.lo + std::ldexp(x.lo / scale, exponent));
        };
        const Vec3 v = {placed(ray.x, from.x), placed(ray.y, from.y), placed(ray.z, from.z)};
        out.vertices[3 * i] = v.x;
        out.vertices[3 * i + 1] = v.y;
        out.vertices[3 * i + 2] = v.z;
        largest = std::max(largest, safe_norm(v));
    }
    out.error = kRounding * largest + kBeforeRounding * (longest + largest_of(from)) + kUnderflow;
    return out;
}

ExactBody exact_body(const ShapeView& shape, const Transform& X_ls) {
    ExactBody out;
    out.center = X_ls.translation;
    out.rotation = is_identity(X_ls.rotation) ? nullptr : &X_ls.rotation;
    if (shape.kind == ShapeKind::convex) {
        out.kind = shape.frustum != nullptr ? ExactBody::Kind::frustum : ExactBody::Kind::hull;
        out.frustum = shape.frustum;
        out.points = shape.vertices;
        out.listed = static_cast<int>(shape.count);
    } else if (shape.kind == ShapeKind::box) {
        out.generators = 3;
        for (int i = 0; i < 3; ++i) {
            out.axis[i] = column(X_ls.rotation, i);
            out.half[i] = shape.params[i];
        }
    } else if (shape.kind == ShapeKind::capsule) {
        out.generators = 1;
        out.axis[0] = column(X_ls.rotation, 2);
        out.half[0] = shape.params[1];
    }
    return out;
}

}  // namespace geomsrv
