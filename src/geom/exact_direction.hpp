// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
// Directions that are known exactly, or enclosed, and their doubles.
#pragma once

#include "geom/exact_body.hpp"
#include "geom/vec.hpp"

namespace geomsrv {

/// Some multiple of v, each entry off by at most 2 u of the largest; false if that is not known.  REQUIRES: v
/// != 0.
bool round_direction(const VectorOf<Enclosed>& v, Vec3& out);
bool round_direction(const VectorOf<Exact>& v, Vec3& out);

/// v / |v|, each entry correctly rounded; false if that is not known.  REQUIRES: v != 0.
bool round_unit(const VectorOf<Enclosed>& v, Vec3& out);
bool round_unit(const VectorOf<Exact>& v, Vec3& out);

/// along . v / |v|, correctly rounded; false if that is not known.  REQUIRES: v != 0.
bool round_component(const VectorOf<Enclosed>& v, const VectorOf<Enclosed>& along, double& out);
bool round_component(const VectorOf<Exact>& v, const VectorOf<Exact>& along, double& out);

}  // namespace geomsrv
