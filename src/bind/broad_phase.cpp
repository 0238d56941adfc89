// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
#include "bind/arrays.hpp"
#include "bind/module.hpp"

namespace geomsrv::bind {

void define_broad_phase(nb::module_&) {}

}  // namespace geomsrv::bind
