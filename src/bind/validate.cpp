// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
// Checks that are too slow in numpy; the Python layer words the errors.
#include <algorithm>
#include <bit>

#include "bind/arrays.hpp"
#include "bind/module.hpp"

namespace geomsrv::bind {

namespace {

/// Index of the first NaN or infinity, or -1.
std::int64_t first_nonfinite(const double* values, std::size_t count) {
    // All exponent bits set means infinity or NaN.  Whole blocks are tested without a branch, so the loop
    // vectorises.
    constexpr std::uint64_t kExponent = 0x7ff0'0000'0000'0000;
    constexpr std::size_t kBlock = 1024;
    for (std::size_t begin = 0; begin < count; begin += kBlock) {
        const std::size_t end = std::min(begin + kBlock, count);
        std::uint64_t bad = 0;
        for (std::size_t i = begin; i < end; ++i) {
            // x - x is 0 for finite x and NaN otherwise; OR-ing bit patterns keeps it exact and branch-free.
            bad |= std::bit_cast<std::uint64_t>(values[i] - values[i]);
        }
        if ((bad & kExponent) == 0) {
            continue;
        }
        for (std::size_t i = begin; i < end; ++i) {
            if ((std::bit_cast<std::uint64_t>(values[i]) & kExponent) == kExponent) {
                return static_cast<std::int64_t>(i);
            }
        }
    }
    return -1;
}

}  // namespace

void define_validate(nb::module_& m) {
    m.def(
        "first_nonfinite",
        [](const Values& values) {
            const nb::gil_scoped_release unlocked;
            return first_nonfinite(values.data(), values.size());
        },
        nb::arg("values").noconvert());
}

}  // namespace geomsrv::bind
