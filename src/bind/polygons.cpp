// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
#include <string_view>

#include "bind/arrays.hpp"
#include "bind/module.hpp"
#include "geom/polygon.hpp"

namespace geomsrv::bind {

namespace {

static_assert(sizeof(Vec2) == 2 * sizeof(double), "rows of two doubles are read as Vec2");

/// Rings of a ragged array.
class Rings {
public:
    Rings(const Rows2& vertices, const Offsets& offsets)
        : vertices_(reinterpret_cast<const Vec2*>(vertices.data())),
          offsets_(offsets.data()),
          count_(offsets.size() - 1) {}

    [[nodiscard]] std::size_t size() const { return count_; }
    [[nodiscard]] Ring operator[](std::size_t i) const {
        return {vertices_ + offsets_[i], static_cast<std::size_t>(offsets_[i + 1] - offsets_[i])};
    }

private:
    const Vec2* vertices_;
    const std::int64_t* offsets_;
    std::size_t count_;
};

constexpr std::string_view fault_text(RingFault fault) {
    switch (fault) {
        case RingFault::none:
            return "";
        case RingFault::clockwise:
            return "clockwise";
        case RingFault::not_convex:
            return "not convex";
        case RingFault::wound_more_than_once:
            return "wound more than once";
    }
    return "";
}

struct BatchReport {
    std::int64_t ring = -1;
    RingReport report;
};

BatchReport check_rings(const Rings& rings) {
    RingChecker checker;
    for (std::size_t i = 0; i < rings.size(); ++i) {
        const RingReport report = checker.check(rings[i]);
        if (report.fault != RingFault::none) {
            return {static_cast<std::int64_t>(i), report};
        }
    }
    return {};
}

}  // namespace

void define_polygons(nb::module_& m) {
    m.def(
        "check_rings",
        [](const Rows2& vertices, const Offsets& offsets) {
            BatchReport first;
            {
                const nb::gil_scoped_release unlocked;
                first = check_rings({vertices, offsets});
            }
            const std::string_view text = fault_text(first.report.fault);
            return nb::make_tuple(first.ring, first.report.vertex, nb::str(text.data(), text.size()));
        },
        nb::arg("vertices").noconvert(), nb::arg("offsets").noconvert());
}

}  // namespace geomsrv::bind
