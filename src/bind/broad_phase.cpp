// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
#include "geom/broad_phase.hpp"

#include <algorithm>
#include <stdexcept>
#include <string>
#include <vector>

#include "bind/arrays.hpp"
#include "bind/module.hpp"
#include "geom/bounding_box.hpp"

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

/// Where boxes are written, row by row.
struct BoxRows {
    Output<double> lower, upper;

    explicit BoxRows(std::size_t count)
        : lower(empty<double>({count, 3})), upper(empty<double>({count, 3})) {}
    void put(std::size_t i, const Aabb& box) const {
        std::copy_n(box.lower, 3, lower.data + 3 * i);
        std::copy_n(box.upper, 3, upper.data + 3 * i);
    }
    [[nodiscard]] nb::tuple pair() const { return nb::make_tuple(lower.array, upper.array); }
};

/// Of objects that have row `shape` of a table of bounds.
nb::tuple bounding_boxes(const Rows7& poses, const Matrices3& rotations, const Values& uncertainty,
                         const Offsets& shape, const Rows3& center, const Rows3& half, const Values& round,
                         double rounding, double underflow) {
    const std::size_t count = poses.shape(0);
    if (rotations.shape(0) != count || uncertainty.shape(0) != count || shape.shape(0) != count) {
        throw std::invalid_argument("bounding_boxes: one row of each for an object");
    }
    const BoxRows out(count);
    {
        const nb::gil_scoped_release unlocked;
        for (std::size_t i = 0; i < count; ++i) {
            const auto row = static_cast<std::size_t>(shape.data()[i]);
            const ShapeBounds bounds{center.data() + 3 * row, half.data() + 3 * row, round.data()[row]};
            out.put(i, placed_box(bounds, rotations.data() + 9 * i, poses.data() + 7 * i,
                                  uncertainty.data()[i], rounding, underflow));
        }
    }
    return out.pair();
}

nb::tuple swept_boxes(const Rows3& lower, const Rows3& upper, const Rows7& poses, const Rows6& twists,
                      const Flags& turns, const Values& reach, const Values& drift, double horizon,
                      double rounding) {
    const std::size_t count = poses.shape(0);
    for (const std::size_t size :
         {lower.shape(0), upper.shape(0), twists.shape(0), turns.shape(0), reach.shape(0), drift.shape(0)}) {
        if (size != count) throw std::invalid_argument("swept_boxes: one row of each for an object");
    }
    const BoxRows out(count);
    {
        const nb::gil_scoped_release unlocked;
        for (std::size_t i = 0; i < count; ++i) {
            Aabb box;
            std::copy_n(lower.data() + 3 * i, 3, box.lower);
            std::copy_n(upper.data() + 3 * i, 3, box.upper);
            const Sweep sweep{poses.data() + 7 * i, twists.data() + 6 * i, turns.data()[i], reach.data()[i],
                              drift.data()[i]};
            out.put(i, swept_box(box, sweep, horizon, rounding));
        }
    }
    return out.pair();
}

}  // namespace

void define_broad_phase(nb::module_& m) {
    m.def("bounding_boxes", bounding_boxes, nb::arg("poses").noconvert(), nb::arg("rotations").noconvert(),
          nb::arg("uncertainty").noconvert(), nb::arg("shape").noconvert(), nb::arg("center").noconvert(),
          nb::arg("half").noconvert(), nb::arg("round").noconvert(), nb::arg("rounding"),
          nb::arg("underflow"));
    m.def("swept_boxes", swept_boxes, nb::arg("lower").noconvert(), nb::arg("upper").noconvert(),
          nb::arg("poses").noconvert(), nb::arg("twists").noconvert(), nb::arg("turns").noconvert(),
          nb::arg("reach").noconvert(), nb::arg("drift").noconvert(), nb::arg("horizon"),
          nb::arg("rounding"));
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
