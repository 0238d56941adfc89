// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
#include "geom/point_point.hpp"

#include "geom/single_core.hpp"

namespace geomsrv {

template <class Body>
CoreSeparation point_point(const Body& a, const Body& b) {
    const Vec3 gap = widened(b.center) - widened(a.center);
    const bool same = gap.x == 0.0 && gap.y == 0.0 && gap.z == 0.0;
    // Concentric spheres are parted by any direction alike.
    const Vec3 normal = same ? perpendicular(gap) : normalized(gap);
    CoreSeparation out = certify_apart(a, b, normal, widened(a.center), widened(b.center));
    out.stage = Stage::closed_form;
    return out;
}

template CoreSeparation point_point(const Core&, const Core&);
template CoreSeparation point_point(const SingleCore&, const SingleCore&);

}  // namespace geomsrv
