// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
// Signed distance of two points: the cores of two spheres.
#pragma once

#include "geom/separation.hpp"

namespace geomsrv {

template <class Body>
CoreSeparation point_point(const Body& a, const Body& b);

}  // namespace geomsrv
