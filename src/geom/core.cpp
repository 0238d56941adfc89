// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
#include "geom/core.hpp"

#include <algorithm>

namespace geomsrv {

WideExtreme highest(const Core& core, WideVec3 n) {
    WideExtreme top{dot(n, core.center), 0};
    if (core.points == nullptr) {
        for (int i = 0; i < core.generators; ++i) {
            const DoubleDouble along = dot(n, core.generator[i]);
            const bool up = along > DoubleDouble{};
            top.value = top.value + (up ? along : -along);
            top.vertex |= (up ? 1 : 0) << i;
        }
        return top;
    }
    // Doubles rule out all vertices but those within their own error of the highest; only these are looked at
    // again.
    const Vec3 rough = narrow(n);
    const auto point = [&](int i) {
        const double* p = core.points + i;
        return Vec3{p[0], p[core.count], p[2 * core.count]};
    };
    double bound = dot(rough, point(0));
    for (int i = 1; i < core.count; ++i) {
        bound = std::max(bound, dot(rough, point(i)));
    }
    bound -= 2 * kSupportError * core.reach;
    bool found = false;
    DoubleDouble best;
    for (int i = 0; i < core.count; ++i) {
        if (dot(rough, point(i)) < bound) {
            continue;
        }
        const DoubleDouble along = dot(n, point(i));
        if (!found || along > best) {
            best = along;
            top.vertex = i;
            found = true;
        }
    }
    top.value = top.value + best;
    return top;
}

}  // namespace geomsrv
