// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
#include "geom/convex_convex.hpp"

#include <algorithm>
#include <cmath>

#include "geom/facet_axes.hpp"
#include "geom/gjk.hpp"
#include "geom/growing_hull.hpp"

namespace geomsrv {

namespace {

template <class Body>
CoreSeparation from_gjk(const Body& a, const Body& b, const Gjk& found, Stage stage) {
    CoreSeparation out = certify_apart(a, b, found.normal, found.point_a, found.point_b);
    out.stage = stage;
    out.iterations = found.iterations;
    out.witness = found.witness;
    out.simplex = found.witness;
    return out;
}

/// Bodies that overlap where nobody asked how deep: a common point.
template <class Body>
CoreSeparation sunk(const Body& a, const Body& b, const Gjk& found, Stage stage) {
    CoreSeparation out = from_gjk(a, b, found, stage);
    out.lower = std::min(out.lower, 0.0);
    out.value = 0.0;
    if (found.state == GjkState::enclosed) {
        const double rounding = Body::kCoarseness * kVertexError * (a.reach + b.reach);
        out.upper = std::min(out.upper, rounding + a.error + b.error);
    }
    out.outcome = Outcome::ok;
    out.normal = nan_vector();
    return out;
}

template <class Body>
Gjk deepest_points(const Body& a, const Body& b, Vec3 normal) {
    const double gap = lowest(b, normal).value - highest(a, normal).value;
    const Body apart = moved(b, normal, -gap);
    Gjk found = gjk(a, apart, normal);
    if (found.state == GjkState::stalled) {
        found = gjk_wide(a, apart, normal);
    }
    found.point_b = found.point_b + gap * normal;
    return found;
}

template <class Body>
CoreSeparation measured_depth(const Body& a, const Body& b, const Gjk& start, Stage stage) {
    // What the points prove from above holds whether the bodies overlap or not.
    const double size = a.reach + b.reach;
    const double apart_at_most = start.length * (1.0 + kGapScale) + Body::kCoarseness * kMemberError * size;

    if (a.points == nullptr && b.points == nullptr) {
        const FacetAxis axis = deepest_facet(a, b);
        if (axis.found) {
            const double upper = axis.upper < 0.0 ? axis.upper : apart_at_most;
            CoreSeparation out = certify_deep(a, b, axis.normal, start.point_a, start.point_b, upper);
            if (out.converged) {
                const Gjk deepest = deepest_points(a, b, out.normal);
                out.point_a = deepest.point_a;
                out.point_b = deepest.point_b;
                out.witness = deepest.witness;
                out.iterations = start.iterations + deepest.iterations;
                out.stage = Stage::facet_axes;
                return out;
            }
        }
    }

    const NearestFacet facet =
        nearest_facet(a, b, start.state == GjkState::enclosed ? start.witness : Witness{});
    if (facet.flat) {
        // The difference has no inside; the common point found is all there is.
        CoreSeparation out = certify_deep(a, b, facet.normal, start.point_a, start.point_b, apart_at_most);
        out.witness = start.witness;
        out.iterations = start.iterations;
        out.stage = stage;
        return out;
    }
    const double upper = facet.upper < 0.0 ? facet.upper : apart_at_most;
    CoreSeparation out = certify_deep(a, b, facet.normal, facet.point_a, facet.point_b, upper);
    out.witness = facet.witness;
    out.iterations = start.iterations + facet.iterations;
    out.stage = Stage::hull;
    if (!facet.foot) {
        const Gjk deepest = deepest_points(a, b, out.normal);
        out.point_a = deepest.point_a;
        out.point_b = deepest.point_b;
        out.witness = deepest.witness;
    }
    return out;
}

template <class Body>
CoreSeparation depth(const Body& a, const Body& b, const Gjk& start, Stage stage) {
    CoreSeparation out = measured_depth(a, b, start, stage);
    out.simplex = start.witness;
    return out;
}

template <class Body>
CoreSeparation separation(const Body& a, const Body& b, bool penetration) {
    Stage stage = Stage::gjk;
    Gjk found = gjk(a, b, first_direction(a, b));
    if (found.state == GjkState::stalled) {
        Gjk wide = gjk_wide(a, b, found.normal);
        wide.iterations += found.iterations;
        if (wide.state != GjkState::stalled || wide.length - wide.gap < found.length - found.gap) {
            found = wide;
            stage = Stage::gjk_wide;
        }
    }
    switch (found.state) {
        case GjkState::apart:
            return from_gjk(a, b, found, stage);
        case GjkState::enclosed:
        case GjkState::contact:
            return penetration ? depth(a, b, found, stage) : sunk(a, b, found, stage);
        case GjkState::stalled:
            break;
    }
    return from_gjk(a, b, found, stage);
}

}  // namespace

Gjk points_along(const Core& a, const Core& b, Vec3 normal) { return deepest_points(a, b, normal); }

CoreSeparation convex_convex(const Core& a, const Core& b, bool penetration) {
    return separation(a, b, penetration);
}

CoreSeparation convex_convex(const SingleCore& a, const SingleCore& b, bool penetration) {
    return separation(a, b, penetration);
}

}  // namespace geomsrv
