// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
#include "geom/broad_phase.hpp"

#include <stdexcept>
#include <string>
#include <vector>

#include "bind/arrays.hpp"
#include "bind/module.hpp"

namespace geomsrv::bind {

namespace {

AabbRows rows_of(const Rows3& lower, const Rows3& upper, const char* name) {
    const std::size_t count = lower.shape(0);
    if (upper.shape(0) != count || count > kMaxBoxes) {
        throw std::invalid_argument(std::string(name) +
                                    ": lower and upper must have the same length, below 2**31");
    }
    return {lower.data(), upper.data(), count};
}

/// (k, 2) int64.
nb::object to_array(const std::vector<IndexPair>& pairs) {
    const Output<std::int64_t> out = empty<std::int64_t>({pairs.size(), 2});
    const nb::gil_scoped_release unlocked;
    std::int64_t* next = out.data;
    for (const IndexPair& pair : pairs) {
        *next++ = pair.first;
        *next++ = pair.second;
    }
    return out.array;
}

/// `search` without the GIL.
template <class Search>
nb::object answer(const Search& search) {
    std::vector<IndexPair> pairs;
    {
        const nb::gil_scoped_release unlocked;
        pairs = search();
    }
    return to_array(pairs);
}

}  // namespace

void define_broad_phase(nb::module_& m) {
    m.def(
        "overlapping_pairs",
        [](const Rows3& lower, const Rows3& upper) {
            const AabbRows boxes = rows_of(lower, upper, "boxes");
            return answer([&boxes] { return overlapping_pairs(boxes); });
        },
        nb::arg("lower").noconvert(), nb::arg("upper").noconvert());
    m.def(
        "overlapping_pairs_between",
        [](const Rows3& lower_a, const Rows3& upper_a, const Rows3& lower_b, const Rows3& upper_b) {
            const AabbRows a = rows_of(lower_a, upper_a, "a");
            const AabbRows b = rows_of(lower_b, upper_b, "b");
            return answer([&a, &b] { return overlapping_pairs_between(a, b); });
        },
        nb::arg("lower_a").noconvert(), nb::arg("upper_a").noconvert(), nb::arg("lower_b").noconvert(),
        nb::arg("upper_b").noconvert());
}

}  // namespace geomsrv::bind
