// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
// First contact of bodies that translate and turn, pair by pair.
#include "geom/turning.hpp"

#include <stdexcept>

#include "bind/arrays.hpp"
#include "bind/module.hpp"

namespace geomsrv::bind {

namespace {

/// Bodies as the Python layer hands them over: (vertices, offsets), or (centers, axes, half extents), and
/// their motions as rows velocity, angular velocity, centre; one row counts for all.
class TurningSide {
public:
    TurningSide(const nb::tuple& bodies, const Numbers& motion)
        : motion_(motion.data()), motions_(motion.shape(0)) {
        if (motion.ndim() != 2 || motion.shape(1) != 9) {
            throw std::invalid_argument("a motion is a row of nine numbers");
        }
        rows_ = nb::cast<Numbers>(bodies[0]);
        dimension_ = static_cast<int>(rows_.shape(1));
        if (bodies.size() == 3) {
            axes_ = nb::cast<Numbers>(bodies[1]);
            half_ = nb::cast<Numbers>(bodies[2]);
            bodies_ = rows_.shape(0);
        } else {
            offsets_ = nb::cast<Offsets>(bodies[1]);
            bodies_ = offsets_.shape(0) - 1;
        }
    }

    [[nodiscard]] std::size_t size() const { return bodies_; }

    [[nodiscard]] TurningBody operator[](std::size_t i) const {
        TurningBody out;
        out.dimension = dimension_;
        const std::size_t k = bodies_ == 1 ? 0 : i;
        if (half_.is_valid()) {
            out.rows = rows_.data() + 3 * k;
            out.count = 8;
            out.axes = axes_.data() + 9 * k;
            out.half = half_.data() + 3 * k;
        } else {
            const auto first = static_cast<std::size_t>(offsets_.data()[k]);
            out.rows = rows_.data() + static_cast<std::size_t>(dimension_) * first;
            out.count = static_cast<std::size_t>(offsets_.data()[k + 1]) - first;
        }
        const double* m = motion_ + 9 * (motions_ == 1 ? 0 : i);
        out.velocity = {m[0], m[1], m[2]};
        out.angular = {m[3], m[4], m[5]};
        out.center = {m[6], m[7], m[8]};
        return out;
    }

private:
    Numbers rows_, axes_, half_;
    Offsets offsets_;
    const double* motion_;
    std::size_t motions_;
    std::size_t bodies_ = 0;
    int dimension_ = 3;
};

nb::tuple first_contact_turning(const nb::tuple& bodies_a, const nb::tuple& bodies_b, const Numbers& motion_a,
                                const Numbers& motion_b, double t_max, double tolerance) {
    const TurningSide a(bodies_a, motion_a);
    const TurningSide b(bodies_b, motion_b);
    const std::size_t count = a.size() == 1 ? b.size() : a.size();
    const auto status = empty<std::uint8_t>({count});
    const auto lower = empty<double>({count});
    const auto upper = empty<double>({count});
    const auto normal = empty<double>({count, 3});
    const auto point = empty<double>({count, 3});
    const auto wide = empty<bool>({count});
    const auto looks = empty<std::int64_t>({count});
    {
        const nb::gil_scoped_release unlocked;
        TurningSolver solver;
        for (std::size_t i = 0; i < count; ++i) {
            const TurningContact found = solver.solve(a[i], b[i], t_max, tolerance);
            status.data[i] = static_cast<std::uint8_t>(found.status);
            lower.data[i] = found.lower;
            upper.data[i] = found.upper;
            for (const auto& [row, v] : {std::pair{normal.data, found.normal}, {point.data, found.point}}) {
                row[3 * i] = v.x;
                row[3 * i + 1] = v.y;
                row[3 * i + 2] = v.z;
            }
            wide.data[i] = found.rung == Rung::wide;
            looks.data[i] = found.looks;
        }
    }
    return nb::make_tuple(status.array, lower.array, upper.array, normal.array, point.array, wide.array,
                          looks.array);
}

}  // namespace

void define_turning(nb::module_& m) {
    m.def("first_contact_turning", first_contact_turning, nb::arg("a"), nb::arg("b"),
          nb::arg("motion_a").noconvert(), nb::arg("motion_b").noconvert(), nb::arg("t_max"),
          nb::arg("tolerance"));
}

}  // namespace geomsrv::bind
