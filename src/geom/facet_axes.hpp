// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
// How deep two overlapping zonotopes (points, segments, boxes) are: the facet normals of their difference are
// the cross products of their edges, at most 15, so trying them all is exact.  For two boxes these are the
// separating axes of the book's section 11.12.7.
#pragma once

#include "geom/separation.hpp"
#include "geom/single_core.hpp"

namespace geomsrv {

struct FacetAxis {
    bool found = false;  ///< false if no two edges span a plane; then nothing below has a meaning
    Vec3 normal;         ///< unit, from a to b: the largest gap among the facets
    double gap = 0.0;    ///< along it
    double upper = 0.0;  ///< no facet has a larger gap than this, rounding included
};

/// REQUIRES: neither core is a hull.
FacetAxis deepest_facet(const Core& a, const Core& b);
FacetAxis deepest_facet(const SingleCore& a, const SingleCore& b);

}  // namespace geomsrv
