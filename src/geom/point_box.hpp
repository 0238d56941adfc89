// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
// Signed distance of a point and a box: the cores of a sphere and a box.
#pragma once

#include "geom/separation.hpp"

namespace geomsrv {

template <class Body>
CoreSeparation point_box(const Body& a, const Body& b, bool penetration);

}  // namespace geomsrv
