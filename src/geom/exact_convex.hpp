// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
// Signed distance of two convex polytopes, correctly rounded: a float64 search first, and what it leaves open
// decided by the caller's numbers.
#pragma once

#include "geom/exact_feature.hpp"

namespace geomsrv {

/// `scale`: a length in the rough cores over the same of the exact ones, a power of two; results are in the
/// exact ones' unit, points relative to the origin of the rough ones.
CoreSeparation exact_convex_convex(const ExactAndRough& a, const ExactAndRough& b, double scale,
                                   const Wanted& want);

}  // namespace geomsrv
