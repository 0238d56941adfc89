// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
// Signed distance of a point and a box: the cores of a sphere and a box.
#pragma once

#include "geom/separation.hpp"

namespace geomsrv {

CoreSeparation point_box(const Core& a, const Core& b, bool penetration);

}  // namespace geomsrv
