// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
#include "geom/curved.hpp"

#include <cmath>

#include "geom/place.hpp"

namespace geomsrv {

namespace {

// A direction that is nearer to the axis than this has lost bits of its square there, and what lies across
// the axis adds less than any rounding to a support: the middle will do.
constexpr double kNoLength = 0x1p-400;

/// Of the body about its own axes.
SupportPoint own_highest(const CurvedBody& body, Vec3 e) {
    const double radius = body.half[0];
    const double half = body.half[2];
    if (body.kind == ShapeKind::ellipsoid) {
        // With x = A y, |y| <= 1, the highest is y = A e / |A e|.
        const Vec3 v{body.half[0] * e.x, body.half[1] * e.y, body.half[2] * e.z};
        const double length = safe_norm(v);
        if (length == 0.0) {
            return {};
        }
        return {
            length,
            {body.half[0] * (v.x / length), body.half[1] * (v.y / length), body.half[2] * (v.z / length)}};
    }
    const double across = std::sqrt(e.x * e.x + e.y * e.y);
    Vec3 rim;
    if (across > kNoLength) {
        rim = {radius * (e.x / across), radius * (e.y / across), 0.0};
    }
    const double along = half * e.z;
    if (body.kind == ShapeKind::cylinder) {
        rim.z = std::copysign(half, e.z);
        return {radius * across + std::abs(along), rim};
    }
    const double base = radius * across - along;
    if (along > base) {
        return {along, {0.0, 0.0, half}};
    }
    rim.z = -half;
    return {base, rim};
}

}  // namespace

SupportPoint highest_point(const CurvedBody& body, Vec3 direction) {
    const SupportPoint own = own_highest(body, transposed_times(body.rotation, direction));
    return {dot(direction, body.center) + own.value, body.center + body.rotation * own.point};
}

Extreme highest(const SupportedCore& core, Vec3 n) {
    if (core.curved == nullptr) {
        return highest(*core.polytope, n);
    }
    const SupportPoint top = highest_point(*core.curved, n);
    if (core.found == nullptr) {
        return {top.value, 0};
    }
    core.found->push_back(top.point);
    return {top.value, static_cast<int>(core.found->size()) - 1};
}

}  // namespace geomsrv
