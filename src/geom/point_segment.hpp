// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
// Signed distance of a point and a segment: the cores of a sphere and a capsule.
#pragma once

#include "geom/separation.hpp"

namespace geomsrv {

template <class Body>
CoreSeparation point_segment(const Body& a, const Body& b);

}  // namespace geomsrv
