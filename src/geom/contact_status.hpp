// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
// What is known of the first contact of two moving bodies.  No algorithm lives here.
#pragma once

#include <cstdint>

namespace geomsrv {

enum class ContactStatus : std::uint8_t {
    never = 0,        ///< not within t_max
    will_touch = 1,   ///< apart now, in contact at `time`
    touching = 2,     ///< in contact now, depth 0: some direction parts them at once
    overlapping = 3,  ///< in contact now, depth > 0
};

}  // namespace geomsrv
