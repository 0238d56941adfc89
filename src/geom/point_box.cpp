// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
#include "geom/point_box.hpp"

#include <algorithm>
#include <cmath>

#include "geom/convex_convex.hpp"

namespace geomsrv {

// Book section 10.4.2, in multiples of the half edges: the point is center + sum x_i g_i, the nearest point
// of the box has every x_i clamped to -1..1.  A flat box has no x_i across its plane; what the point lacks
// there remains in `off`.
template <class Body>
CoreSeparation point_box(const Body& a, const Body& b, bool penetration) {
    const Vec3 to_point = widened(a.center) - widened(b.center);
    Vec3 off = to_point;
    Vec3 nearest = widened(b.center);
    Vec3 gap;  // from the point to the box, summed from its parts along the edges: no cancellation where it
               // is short
    bool outside = false;
    bool flat = false;
    for (const auto& edge : b.generator) {
        const Vec3 g = widened(edge);
        const double squared = dot(g, g);
        if (squared == 0.0) {
            flat = true;
            continue;
        }
        const double x = dot(to_point, g) / squared;
        const double clamped = std::clamp(x, -1.0, 1.0);
        nearest = nearest + clamped * g;
        gap = gap + (clamped - x) * g;
        off = off - (dot(off, g) / squared) * g;
        outside = outside || clamped != x;
    }
    if (flat) {
        gap = gap - off;
        outside = outside || off.x != 0.0 || off.y != 0.0 || off.z != 0.0;
    }
    if (outside) {
        CoreSeparation out = certify_apart(a, b, normalized(gap), widened(a.center), nearest);
        if (out.converged) {
            out.stage = Stage::closed_form;
            return out;
        }
    }
    // Inside, on the surface, or on a flat box: the facets decide.
    return convex_convex(a, b, penetration);
}

template CoreSeparation point_box(const Core&, const Core&, bool);
template CoreSeparation point_box(const SingleCore&, const SingleCore&, bool);

}  // namespace geomsrv
