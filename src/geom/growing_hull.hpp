// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
// How deep two convex polytopes overlap, with a proof from both sides.
//
// The depth is the distance from the origin to the boundary of the difference K = {q - p : p in a, q in b}.
// A polytope P spanned by some vertices of K grows until its facet nearest to the origin is known to be a
// facet of K:
//
//   - any direction m bounds the depth from above by the support of K along m;
//   - P is a closed surface.  Where all its facets turn outwards about the origin and none comes nearer than
//   d, it winds
//     round the ball of radius d, so the hull of its vertices, and K, holds that ball: the depth is at least
//     d.
//
// This is the expanding polytope algorithm (van den Bergen 2001) with two changes that remove its failures on
// flat, touching and coplanar input: which facets a new vertex sees is decided exactly (orientation_3d), so P
// is a convex polytope whatever the rounding; and a facet is allowed behind the origin, so touching needs no
// case of its own.
#pragma once

#include "geom/curved.hpp"
#include "geom/separation.hpp"
#include "geom/single_core.hpp"

namespace geomsrv {

struct NearestFacet {
    bool flat = false;   ///< K is thinner than rounding along `normal`
    Vec3 normal;         ///< unit, from a to b: largest gap found
    double upper = 0.0;  ///< >= signed distance if < 0; otherwise nothing is proven from above
    bool foot = false;   ///< the points below are set: the origin's foot lies on the facet found
    Vec3 point_a;
    Vec3 point_b;
    Witness witness;
    int iterations = 0;  ///< vertices added
};

/// Facet of K nearest to the origin; `seed` are vertices of K to start from, best if they hold the origin.
NearestFacet nearest_facet(const Core& a, const Core& b, const Witness& seed);
NearestFacet nearest_facet(const SingleCore& a, const SingleCore& b, const Witness& seed);
NearestFacet nearest_facet(const SupportedCore& a, const SupportedCore& b, const Witness& seed);

}  // namespace geomsrv
