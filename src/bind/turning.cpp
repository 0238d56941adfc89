// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
// First contact of bodies that translate and turn, pair by pair.
#include "geom/turning.hpp"

#include <type_traits>
#include <utility>
#include <vector>

#include "bind/arrays.hpp"
#include "bind/module.hpp"

namespace geomsrv::bind {

namespace {

using Motions = Input<double, nb::shape<-1, 9>>;

/// Bodies as the Python layer hands them over: (vertices, offsets), or (centers, axes, half extents), and
/// their motions as rows velocity, angular velocity, centre; one row counts for all.
class TurningSide {
public:
    TurningSide(const nb::tuple& bodies, const Motions& motion)
        : motion_(motion.data()), motions_(motion.shape(0)) {
        const auto as = [&]<class Array>(std::size_t i, std::type_identity<Array> /*kind*/) {
            return nb::cast<Array>(bodies[i], false);
        };
        try {
            if (bodies.size() == 3) {
                const auto centers = as(0, std::type_identity<Rows3>{});
                const auto axes = as(1, std::type_identity<Matrices3>{});
                const auto half = as(2, std::type_identity<Rows3>{});
                rows_ = centers.data();
                axes_ = axes.data();
                half_ = half.data();
                bodies_ = centers.shape(0);
                return;
            }
            const auto vertices = as(0, std::type_identity<Input<double, nb::shape<-1, -1>>>{});
            const auto offsets = as(1, std::type_identity<Offsets>{});
            rows_ = vertices.data();
            dimension_ = static_cast<int>(vertices.shape(1));
            offsets_ = offsets.data();
            bodies_ = offsets.shape(0) - 1;
        } catch (const std::bad_cast&) {
            throw nb::type_error(
                "turning: bodies must be (center, axes, half_extents) or (vertices, offsets)");
        }
    }

    [[nodiscard]] std::size_t size() const { return bodies_; }

    [[nodiscard]] TurningBody operator[](std::size_t i) const {
        TurningBody out;
        out.dimension = dimension_;
        const std::size_t k = bodies_ == 1 ? 0 : i;
        if (half_ != nullptr) {
            out.rows = rows_ + 3 * k;
            out.count = 8;
            out.axes = axes_ + 9 * k;
            out.half = half_ + 3 * k;
        } else {
            const auto first = static_cast<std::size_t>(offsets_[k]);
            out.rows = rows_ + static_cast<std::size_t>(dimension_) * first;
            out.count = static_cast<std::size_t>(offsets_[k + 1]) - first;
        }
        const double* m = motion_ + 9 * (motions_ == 1 ? 0 : i);
        out.velocity = {m[0], m[1], m[2]};
        out.angular = {m[3], m[4], m[5]};
        out.center = {m[6], m[7], m[8]};
        return out;
    }

private:
    // The caller's tuple keeps the arrays alive.
    const double* rows_ = nullptr;
    const double* axes_ = nullptr;
    const double* half_ = nullptr;
    const std::int64_t* offsets_ = nullptr;
    const double* motion_;
    std::size_t motions_;
    std::size_t bodies_ = 0;
    int dimension_ = 3;
};

nb::tuple first_contact_turning(const nb::tuple& bodies_a, const nb::tuple& bodies_b, const Motions& motion_a,
                                const Motions& motion_b, double t_max, double tolerance, const Rows3& slack,
                                bool contact_set) {
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
    const auto offsets = empty<std::int64_t>({count + 1});
    offsets.data[0] = 0;
    std::vector<Vec3> shared;
    {
        const nb::gil_scoped_release unlocked;
        TurningSolver solver;
        for (std::size_t i = 0; i < count; ++i) {
            const double* row = slack.data() + 3 * (slack.shape(0) == 1 ? 0 : i);
            const TurningContact found =
                solver.solve(a[i], b[i], t_max, tolerance, {row[0], row[1], row[2]}, contact_set);
            status.data[i] = static_cast<std::uint8_t>(found.status);
            lower.data[i] = found.lower;
            upper.data[i] = found.upper;
            for (const auto& [to, v] : {std::pair{normal.data, found.normal}, {point.data, found.point}}) {
                to[3 * i] = v.x;
                to[3 * i + 1] = v.y;
                to[3 * i + 2] = v.z;
            }
            wide.data[i] = found.rung == Rung::wide;
            looks.data[i] = found.looks;
            shared.insert(shared.end(), found.points.begin(), found.points.end());
            offsets.data[i + 1] = static_cast<std::int64_t>(shared.size());
        }
    }
    return nb::make_tuple(status.array, lower.array, upper.array, normal.array, point.array, wide.array,
                          looks.array, rows_of(std::move(shared)), offsets.array);
}

nb::tuple shared_turning(const nb::tuple& bodies_a, const nb::tuple& bodies_b, const Motions& motion_a,
                         const Motions& motion_b, double time, double span, const Rows3& normal,
                         const Rows3& slack) {
    const TurningSide a(bodies_a, motion_a);
    const TurningSide b(bodies_b, motion_b);
    const std::size_t count = a.size() == 1 ? b.size() : a.size();
    const Vec3 across{normal.data()[0], normal.data()[1], normal.data()[2]};
    const double* row = slack.data();
    const auto offsets = empty<std::int64_t>({count + 1});
    offsets.data[0] = 0;
    std::vector<Vec3> normals;
    std::vector<Vec3> shared;
    {
        const nb::gil_scoped_release unlocked;
        TurningSolver solver;
        for (std::size_t i = 0; i < count; ++i) {
            const TurningContact found =
                solver.share(a[i], b[i], time, span, across, {row[0], row[1], row[2]});
            normals.push_back(found.normal);
            shared.insert(shared.end(), found.points.begin(), found.points.end());
            offsets.data[i + 1] = static_cast<std::int64_t>(shared.size());
        }
    }
    return nb::make_tuple(rows_of(std::move(normals)), rows_of(std::move(shared)), offsets.array);
}

}  // namespace

void define_turning(nb::module_& m) {
    m.def("first_contact_turning", first_contact_turning, nb::arg("a"), nb::arg("b"),
          nb::arg("motion_a").noconvert(), nb::arg("motion_b").noconvert(), nb::arg("t_max"),
          nb::arg("tolerance"), nb::arg("slack").noconvert(), nb::arg("contact_set") = false);
    m.def("shared_turning", shared_turning, nb::arg("a"), nb::arg("b"), nb::arg("motion_a").noconvert(),
          nb::arg("motion_b").noconvert(), nb::arg("time"), nb::arg("span"), nb::arg("normal").noconvert(),
          nb::arg("slack").noconvert());
}

}  // namespace geomsrv::bind
