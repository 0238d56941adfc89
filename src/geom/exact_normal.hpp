// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
// The direction in which two touching polytopes have their plane of contact, for the given numbers exactly.
//
// All directions n from a to b along which no vertex of K = {q - p : p in a, q in b} is lower than its point
// x of contact make a cone.  If x is inside a facet, that is a ray.  Otherwise the one direction is taken
// along which the bodies approach fastest: the point of the cone nearest to -w, which does not depend on how
// the bodies are listed or placed.  It is -w + y, where y is the point nearest to w of the cone of all v - x,
// v in K, sought as in GJK.  If they approach along none, the one along which they part fastest, and if they
// only slide or rest, the one nearest to the way from the mean of the vertices of a to that of b.
#pragma once

#include "geom/exact_ray.hpp"

namespace geomsrv {

/// REQUIRES: the line meets K at that end, on the border of K.  `at_start`: the point of contact is that at
/// time 0.
VectorOf<Exact> contact_normal(ExactRay& ray, RayEnd end, bool at_start);

}  // namespace geomsrv
