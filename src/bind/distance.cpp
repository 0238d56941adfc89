// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
#include "bind/arrays.hpp"
#include "bind/module.hpp"

namespace geomsrv::bind {

void define_distance(nb::module_& m) {
    m.def("shape_kinds", [] {
        return nb::make_tuple("sphere", "capsule", "box", "convex", "half_space", "cylinder", "cone", "ellipsoid",
                              "mesh", "polygon");
    });
}

}  // namespace geomsrv::bind
