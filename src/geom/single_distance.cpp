// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
#include "geom/single_distance.hpp"

#include <algorithm>
#include <cmath>

#include "geom/convex_convex.hpp"
#include "geom/place.hpp"
#include "geom/point_box.hpp"
#include "geom/point_point.hpp"
#include "geom/point_segment.hpp"
#include "geom/segment_segment.hpp"

namespace geomsrv {

namespace {

/// By the closed form, where the pair has one.
CoreSeparation solved(const SingleCore& a, const SingleCore& b, bool penetration) {
    if (a.points != nullptr || b.points != nullptr || a.generators > 1) {
        return convex_convex(a, b, penetration);
    }
    if (a.generators == 1) {
        return b.generators == 1 ? segment_segment(a, b) : convex_convex(a, b, penetration);
    }
    switch (b.generators) {
        case 0:
            return point_point(a, b);
        case 1:
            return point_segment(a, b);
        default:
            return point_box(a, b, penetration);
    }
}

}  // namespace

CoreSeparation single_distance(const Core& a, const Core& b, bool penetration) {
    const double size = a.reach + b.reach;
    const double unit = size > 0.0 ? scale_for(size) : 1.0;
    SingleMemory memory_a;
    SingleMemory memory_b;
    CoreSeparation out =
        solved(rounded_to_single(a, unit, memory_a), rounded_to_single(b, unit, memory_b), penetration);
    unscale(out, unit);
    return out;
}

CoreSeparation single_distance(const Core& a, const PlacedHalfSpace& b, bool penetration) {
    const double size = std::max(a.reach, std::abs(b.offset));
    const double unit = size > 0.0 ? scale_for(size) : 1.0;
    SingleMemory memory;
    const PlacedHalfSpace plane = {b.normal, unit * b.offset, b.normal_error, unit * b.offset_error};
    CoreSeparation out = convex_half_space(rounded_to_single(a, unit, memory), plane, penetration);
    unscale(out, unit);
    return out;
}

}  // namespace geomsrv
