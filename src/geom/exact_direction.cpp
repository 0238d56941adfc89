// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
#include "geom/exact_direction.hpp"

#include <algorithm>
#include <cmath>

namespace geomsrv {

namespace {

// Far from both ends of the range of double, so that no square of what is rounded leaves it.
constexpr double kShortDirection = 0x1p-400;
constexpr double kLongDirection = 0x1p400;

}  // namespace

bool round_direction(const VectorOf<Enclosed>& v, Vec3& out) {
    out = {v.x.value.hi, v.y.value.hi, v.z.value.hi};
    const double size = std::max({std::fabs(out.x), std::fabs(out.y), std::fabs(out.z)});
    const double error = std::max({v.x.error, v.y.error, v.z.error});
    return error <= kUnitRoundoff * size && size > kShortDirection && size < kLongDirection;
}

bool round_direction(const VectorOf<Exact>& v, Vec3& out) {
    Exact size = v.x.magnitude();
    for (const Exact* other : {&v.y, &v.z}) {
        if (size < other->magnitude()) {
            size = other->magnitude();
        }
    }
    out = {rounded_quotient(v.x, size).nearest, rounded_quotient(v.y, size).nearest,
           rounded_quotient(v.z, size).nearest};
    return true;
}

bool round_unit(const VectorOf<Enclosed>& v, Vec3& out) {
    const Enclosed length = root_of(dot(v, v));
    Rounding x;
    Rounding y;
    Rounding z;
    const bool known =
        round_enclosed(v.x / length, x) && round_enclosed(v.y / length, y) && round_enclosed(v.z / length, z);
    out = {x.nearest, y.nearest, z.nearest};
    return known;
}

bool round_unit(const VectorOf<Exact>& v, Vec3& out) {
    const Exact squared = dot(v, v);
    const auto entry = [&](const Exact& x) {
        const double size = rounded_root(x * x, squared).nearest;
        return x.sign() < 0 ? -size : size;
    };
    out = {entry(v.x), entry(v.y), entry(v.z)};
    return true;
}

bool round_component(const VectorOf<Enclosed>& v, const VectorOf<Enclosed>& along, double& out) {
    Rounding found;
    const bool known = round_enclosed(dot(v, along) / root_of(dot(v, v)), found);
    out = found.nearest;
    return known;
}

bool round_component(const VectorOf<Exact>& v, const VectorOf<Exact>& along, double& out) {
    const Exact product = dot(v, along);
    const double size = rounded_root(product * product, dot(v, v)).nearest;
    out = product.sign() < 0 ? -size : size;
    return true;
}

}  // namespace geomsrv
