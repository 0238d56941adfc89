// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
// Signed distance of any two cores: the general path, and the last resort of the closed forms.
#pragma once

#include "geom/separation.hpp"

namespace geomsrv {

/// With `penetration` overlapping cores get their depth; without it only a common point.
CoreSeparation convex_convex(const Core& a, const Core& b, bool penetration);

}  // namespace geomsrv
