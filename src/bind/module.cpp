// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
// The compiled module: a list of what it holds.
#include "bind/module.hpp"

NB_MODULE(_core, m) {
    m.doc() = "Batch geometry kernels; see geomsrv.queries for the public functions.";
    geomsrv::bind::define_validate(m);
    geomsrv::bind::define_frustum(m);
    geomsrv::bind::define_point_frustum(m);
    geomsrv::bind::define_polygons(m);
    geomsrv::bind::define_polytopes(m);
    geomsrv::bind::define_distance(m);
    geomsrv::bind::define_turning(m);
    geomsrv::bind::define_footprint(m);
    geomsrv::bind::define_broad_phase(m);
}
