// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
// Whether two convex polytopes have a common point, and their distance, for the given numbers exactly.
//
// A float64 search (gjk.hpp) guesses the features that are nearest: a simplex of K = {q - p : p in a, q in
// b}. Here the guess is checked, and mended where it is wrong, by the same steps without rounding: v, the
// point of the simplex nearest to the origin, is nearest in all of K iff no vertex of K lies below it along
// v.  Each sign is found in Enclosed arithmetic and, where that leaves it open, in Exact.  Every step
// shortens v, so the search ends.
#pragma once

#include "geom/exact_feature.hpp"

namespace geomsrv {

struct ExactSeparation {
    bool meet = false;  ///< the closed bodies have a common point
    Rounding distance;  ///< correctly rounded; 0 if they meet
    Vec3 normal;        ///< unit, from a to b; NaN if they meet
    Witness simplex;    ///< of K: holds v, with weights (rounded) > 0
    Rung rung = Rung::wide;
};

/// `guess` is a simplex of K to start from (1 to 4 pairs of vertices).  `in_range`: the scene's numbers are
/// of ordinary size (Core's range), so double-double is worth trying.
ExactSeparation exact_separation(const ExactAndRough& a, const ExactAndRough& b, const Witness& guess,
                                 bool in_range);

}  // namespace geomsrv
