// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
#include "geom/point_segment.hpp"

#include <algorithm>
#include <cmath>

#include "geom/convex_convex.hpp"

namespace geomsrv {

// Book section 10.2.1, from the middle of the segment: the nearest point is center + x g, -1 <= x <= 1.
template <class Body>
CoreSeparation point_segment(const Body& a, const Body& b) {
    const Vec3 g = widened(b.generator[0]);
    const Vec3 to_center = widened(b.center) - widened(a.center);
    const double squared = dot(g, g);
    const double x = squared > 0.0 ? std::clamp(-dot(to_center, g) / squared, -1.0, 1.0) : 0.0;
    Vec3 gap = to_center + x * g;
    if (squared > 0.0 && std::abs(x) < 1.0) {
        // Rounding leaves a part along g, which matters where the gap is short.
        gap = gap - (dot(gap, g) / squared) * g;
    }
    const bool on = gap.x == 0.0 && gap.y == 0.0 && gap.z == 0.0;
    const Vec3 normal = on ? perpendicular(g) : normalized(gap);
    CoreSeparation out = certify_apart(a, b, normal, widened(a.center), widened(b.center) + x * g);
    out.stage = Stage::closed_form;
    // At an end of the segment a gap that is all rounding may point back along it.
    return out.converged ? out : convex_convex(a, b, true);
}

template CoreSeparation point_segment(const Core&, const Core&);
template CoreSeparation point_segment(const SingleCore&, const SingleCore&);

}  // namespace geomsrv
