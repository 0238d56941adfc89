// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
// One function per binding file; module.cpp calls them all.
#pragma once

#include <nanobind/nanobind.h>

namespace geomsrv::bind {

void define_validate(nanobind::module_& m);
void define_frustum(nanobind::module_& m);
void define_point_frustum(nanobind::module_& m);
void define_polygons(nanobind::module_& m);
void define_polytopes(nanobind::module_& m);
void define_distance(nanobind::module_& m);
void define_turning(nanobind::module_& m);
void define_broad_phase(nanobind::module_& m);
void define_footprint(nanobind::module_& m);

}  // namespace geomsrv::bind
