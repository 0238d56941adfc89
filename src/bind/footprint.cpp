// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
// When a robot's footprint on a twist first meets points.
#include "geom/footprint.hpp"

#include <utility>

#include "bind/arrays.hpp"
#include "bind/module.hpp"

namespace geomsrv::bind {

namespace {

Twist2 twist_of(const Values& numbers) {
    const double* t = numbers.data();
    return {{t[0], t[1]}, t[2]};
}

nb::tuple points_on_twist(const Rows2& ring, const Values& twist, const Rows2& points,
                          const Rows2& velocities, double t_max, double tolerance) {
    const std::size_t count = points.shape(0);
    const auto status = empty<std::uint8_t>({count});
    const auto lower = empty<double>({count});
    const auto upper = empty<double>({count});
    std::int64_t closed = 0;
    {
        const nb::gil_scoped_release unlocked;
        static_assert(sizeof(Vec2) == 2 * sizeof(double));
        Footprint footprint({reinterpret_cast<const Vec2*>(ring.data()), ring.shape(0)}, twist_of(twist));
        for (std::size_t i = 0; i < count; ++i) {
            const double* p = points.data() + 2 * i;
            const double* v = velocities.data() + (velocities.shape(0) == 1 ? 0 : 2 * i);
            const PointContact found = footprint.solve({p[0], p[1]}, {v[0], v[1]}, t_max, tolerance);
            status.data[i] = static_cast<std::uint8_t>(found.status);
            lower.data[i] = found.lower;
            upper.data[i] = found.upper;
            closed += found.closed ? 1 : 0;
        }
    }
    return nb::make_tuple(status.array, lower.array, upper.array, closed);
}

/// (x, y) of the point that a twist turns about, the drift of bodies that turn about it, the period.
nb::tuple turn_of_twist(const Values& twist) {
    const TurningCenter center = turning_center(twist_of(twist));
    return nb::make_tuple(center.point.x, center.point.y, center.drift, period_of(twist_of(twist)));
}

}  // namespace

void define_footprint(nb::module_& m) {
    m.def("points_on_twist", points_on_twist, nb::arg("ring").noconvert(), nb::arg("twist").noconvert(),
          nb::arg("points").noconvert(), nb::arg("velocities").noconvert(), nb::arg("t_max"),
          nb::arg("tolerance"));
    m.def("turn_of_twist", turn_of_twist, nb::arg("twist").noconvert());
}

}  // namespace geomsrv::bind
