// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
// Signed distance of two segments: the cores of two capsules.
#pragma once

#include "geom/separation.hpp"

namespace geomsrv {

template <class Body>
CoreSeparation segment_segment(const Body& a, const Body& b);

}  // namespace geomsrv
