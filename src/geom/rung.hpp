// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace geomsrv {

/// How high up the ladder of arithmetics an answer had to climb.
enum class Rung : std::uint8_t {
    bound,   ///< bounding volumes only
    filter,  ///< one precision, with an error bound
    wide,    ///< double-double with error bounds
    exact,
};

}  // namespace geomsrv
