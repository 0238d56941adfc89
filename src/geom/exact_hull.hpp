// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
// How deep two convex polytopes overlap, for the caller's numbers exactly.
//
// The expanding polytope algorithm of growing_hull.hpp, with every decision proven: P is the convex hull of
// some vertices of the difference K, and a facet of P whose plane no vertex of K lies beyond is a facet of K.
// P lies in K, so K's boundary is nowhere nearer to the origin than P's nearest facet: when that is one of
// K's, its offset is the depth.  Doubles order the facets and rule out what they can.
#pragma once

#include "geom/exact_feature.hpp"

namespace geomsrv {

struct ExactDepth {
    Rounding depth;  ///< correctly rounded; 0 if the origin is on the boundary of K, or K is flat
    Vec3 normal;     ///< unit, from a to b: moving b by depth * normal parts the bodies
    Witness foot;    ///< vertices of K whose plane is the nearest facet, and the weights of the origin's foot
                     ///< on it; count 0 if that lies beside them, or the depth is 0
    Rung rung = Rung::wide;
};

/// `seed`: a simplex of K that holds the origin with positive weights (see ExactSeparation).  `scale`: a
/// length in the rough cores over the same of the exact ones, a power of two.
ExactDepth exact_depth(const ExactAndRough& a, const ExactAndRough& b, const Witness& seed, double scale,
                       bool in_range);

}  // namespace geomsrv
