// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
#include "geom/point_point.hpp"

namespace geomsrv {

CoreSeparation point_point(const Core& a, const Core& b) {
    const Vec3 gap = b.center - a.center;
    const bool same = gap.x == 0.0 && gap.y == 0.0 && gap.z == 0.0;
    // Concentric spheres are parted by any direction alike.
    const Vec3 normal = same ? perpendicular(gap) : normalized(gap);
    CoreSeparation out = certify_apart(a, b, normal, a.center, b.center);
    out.stage = Stage::closed_form;
    return out;
}

}  // namespace geomsrv
