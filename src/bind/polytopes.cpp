// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
#include <nanobind/stl/string_view.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string_view>
#include <type_traits>
#include <typeinfo>
#include <utility>
#include <vector>

#include "bind/arrays.hpp"
#include "bind/module.hpp"
#include "geom/box_motion.hpp"
#include "geom/polytope_bound.hpp"
#include "geom/polytope_first_contact.hpp"

namespace geomsrv::bind {

namespace {

static_assert(sizeof(Vec3) == 3 * sizeof(double), "rows of three doubles are read as Vec3");

Vec3 vec3_at(const double* row) { return {row[0], row[1], row[2]}; }

/// Boxes or hulls of a batch, and their velocities; one of either serves every pair.
class MovingBodies {
public:
    /// `side`: (center, axes, half_extents) or (vertices, offsets).  The arrays must outlive this.
    MovingBodies(const nb::tuple& side, const Rows3& velocity)
        : velocity_(velocity.data()), velocities_(velocity.shape(0)) {
        constexpr const char* kFault =
            "first_contact: a side must be (center, axes, half_extents) or (vertices, offsets)";
        try {
            if (side.size() == 3) {
                set_boxes(nb::cast<Rows3>(side[0], false), nb::cast<Matrices3>(side[1], false),
                          nb::cast<Rows3>(side[2], false));
                return;
            }
            if (side.size() == 2) {
                set_hulls(nb::cast<Rows3>(side[0], false), nb::cast<Offsets>(side[1], false));
                return;
            }
        } catch (const std::bad_cast&) {
            throw nb::type_error(kFault);
        }
        throw nb::type_error(kFault);
    }

    [[nodiscard]] std::size_t size() const { return count_; }
    [[nodiscard]] std::size_t velocities() const { return velocities_; }
    [[nodiscard]] std::size_t largest() const {
        std::int64_t most = 8;
        for (std::size_t i = 0; vertices_ != nullptr && i < count_; ++i) {
            most = std::max(most, offsets_[i + 1] - offsets_[i]);
        }
        return static_cast<std::size_t>(most);
    }

    [[nodiscard]] MovingBody operator[](std::size_t i) const {
        const std::size_t row = count_ == 1 ? 0 : i;
        MovingBody out;
        out.velocity = vec3_at(velocity_ + 3 * (velocities_ == 1 ? 0 : i));
        ExactBody& body = out.body;
        if (vertices_ != nullptr) {
            body.kind = ExactBody::Kind::hull;
            body.points = vertices_ + 3 * offsets_[row];
            body.listed = static_cast<int>(offsets_[row + 1] - offsets_[row]);
            return out;
        }
        body.center = vec3_at(center_ + 3 * row);
        body.generators = 3;
        for (std::size_t k = 0; k < 3; ++k) {
            body.axis[k] = vec3_at(axes_ + 9 * row + 3 * k);
            body.half[k] = half_[3 * row + k];
        }
        return out;
    }

    [[nodiscard]] bool boxes() const { return vertices_ == nullptr; }
    [[nodiscard]] MovingBoxes rows() const {
        return {center_, axes_, half_, velocity_, count_ == 1 ? 0U : 1U, velocities_ == 1 ? 0U : 1U};
    }

private:
    void set_boxes(const Rows3& center, const Matrices3& axes, const Rows3& half_extents) {
        count_ = center.shape(0);
        if (axes.shape(0) != count_ || half_extents.shape(0) != count_) {
            throw nb::value_error("first_contact: arrays of different length");
        }
        center_ = center.data();
        axes_ = axes.data();
        half_ = half_extents.data();
    }
    void set_hulls(const Rows3& vertices, const Offsets& offsets) {
        count_ = offsets.size() - 1;
        vertices_ = vertices.data();
        offsets_ = offsets.data();
    }

    std::size_t count_ = 0;
    const double* center_ = nullptr;
    const double* axes_ = nullptr;
    const double* half_ = nullptr;
    const double* vertices_ = nullptr;
    const std::int64_t* offsets_ = nullptr;
    const double* velocity_;
    std::size_t velocities_;
};

/// How many items each rung answered.
using RungCounts = std::array<std::int64_t, 4>;

struct ContactRows {
    Output<std::uint8_t> status;
    Output<double> time, time_lower, time_upper, last_time, normal, closing_speed;
    Output<std::int64_t> point_offsets;
    Output<bool> certain;

    explicit ContactRows(std::size_t n)
        : status(empty<std::uint8_t>({n})),
          time(empty<double>({n})),
          time_lower(empty<double>({n})),
          time_upper(empty<double>({n})),
          last_time(empty<double>({n})),
          normal(empty<double>({n, 3})),
          closing_speed(empty<double>({n})),
          point_offsets(empty<std::int64_t>({n + 1})),
          certain(empty<bool>({n})) {}

    void set(std::size_t i, const PolytopeContact& contact) const {
        status.data[i] = static_cast<std::uint8_t>(contact.status);
        time.data[i] = contact.time;
        time_lower.data[i] = contact.time_lower;
        time_upper.data[i] = contact.time_upper;
        last_time.data[i] = contact.last_time;
        std::memcpy(normal.data + 3 * i, &contact.normal, sizeof contact.normal);
        closing_speed.data[i] = contact.closing_speed;
        certain.data[i] = contact.certain;
    }
};

template <class Solver>
std::vector<Vec3> first_contacts(const MovingBodies& a, const MovingBodies& b, std::size_t count,
                                 double t_max, bool contact_set, const ContactRows& rows,
                                 RungCounts& counts) {
    std::vector<Vec3> points;
    Solver solver(a.largest(), b.largest());
    rows.point_offsets.data[0] = 0;
    const bool by_axes = std::is_same_v<Solver, PolytopeContactSolver> && a.boxes() && b.boxes();
    std::array<BoxMotion, kBoxMotionBlock> known;
    for (std::size_t i = 0; i < count; ++i) {
        const std::size_t place = i % kBoxMotionBlock;
        if (by_axes && place == 0) {
            decide_box_motions(a.rows(), b.rows(), i, std::min(count - i, kBoxMotionBlock), t_max,
                               contact_set, known.data());
        }
        const PolytopeContact contact = [&] {
            if constexpr (std::is_same_v<Solver, PolytopeContactSolver>) {
                if (by_axes && known[place].verdict != BoxMotion::Verdict::unclear) {
                    const bool meet = known[place].verdict != BoxMotion::Verdict::never;
                    return contact_set && meet ? solver.solve(a[i], b[i], t_max, known[place])
                                               : contact_of(known[place], t_max);
                }
            }
            return solver.solve(a[i], b[i], t_max, contact_set);
        }();
        rows.set(i, contact);
        points.insert(points.end(), contact.points.begin(), contact.points.end());
        rows.point_offsets.data[i + 1] = static_cast<std::int64_t>(points.size());
        ++counts[static_cast<std::size_t>(contact.rung)];
    }
    return points;
}

nb::tuple first_contact(const nb::tuple& side_a, const nb::tuple& side_b, const Rows3& velocity_a,
                        const Rows3& velocity_b, double t_max, bool contact_set, std::string_view accuracy) {
    const MovingBodies a(side_a, velocity_a);
    const MovingBodies b(side_b, velocity_b);
    if (accuracy != "bound" && accuracy != "float64" && accuracy != "exact") {
        throw nb::value_error("first_contact: no such accuracy");
    }
    const std::size_t count = a.size() == 1 ? b.size() : a.size();
    const auto fits = [&](std::size_t n) { return n == 1 || n == count; };
    if (!fits(b.size()) || !fits(a.velocities()) || !fits(b.velocities())) {
        throw nb::value_error("first_contact: arrays of different length");
    }
    const ContactRows rows(count);
    RungCounts counts{};
    std::vector<Vec3> found;
    {
        const nb::gil_scoped_release unlocked;
        const auto with = [&]<class Solver>(std::type_identity<Solver> /*tier*/) {
            return first_contacts<Solver>(a, b, count, t_max, contact_set, rows, counts);
        };
        found = accuracy == "bound"   ? with(std::type_identity<BoundPolytopeContactSolver>{})
                : accuracy == "exact" ? with(std::type_identity<ExactPolytopeContactSolver>{})
                                      : with(std::type_identity<PolytopeContactSolver>{});
    }
    return nb::make_tuple(rows.status.array, rows.time.array, rows.time_lower.array, rows.time_upper.array,
                          rows.last_time.array, rows.normal.array, rows_of(std::move(found)),
                          rows.point_offsets.array, rows.certain.array, rows.closing_speed.array,
                          nb::make_tuple(counts[0], counts[1], counts[2], counts[3]));
}

/// What the axes alone say of every pair: BoxMotion::Verdict.
nb::object box_motion_verdicts_world(const nb::tuple& side_a, const nb::tuple& side_b,
                                     const Rows3& velocity_a, const Rows3& velocity_b, double t_max) {
    const MovingBodies a(side_a, velocity_a);
    const MovingBodies b(side_b, velocity_b);
    const std::size_t count = std::max(a.size(), b.size());
    const auto fits = [&](std::size_t n) { return n == 1 || n == count; };
    if (!a.boxes() || !b.boxes() || !fits(a.size()) || !fits(b.size()) || !fits(a.velocities()) ||
        !fits(b.velocities())) {
        throw nb::value_error("box_motion_verdicts_world: not pairs of boxes");
    }
    std::vector<BoxMotion> known(count);
    decide_box_motions(a.rows(), b.rows(), 0, count, t_max, false, known.data());
    const auto out = empty<std::uint8_t>({count});
    for (std::size_t i = 0; i < count; ++i) out.data[i] = static_cast<std::uint8_t>(known[i].verdict);
    return out.array;
}

}  // namespace

void define_polytopes(nb::module_& m) {
    m.def("first_contact_world", first_contact, nb::arg("a"), nb::arg("b"), nb::arg("velocity_a").noconvert(),
          nb::arg("velocity_b").noconvert(), nb::arg("t_max"), nb::arg("contact_set"),
          nb::arg("accuracy") = "float64");
    m.def("box_motion_verdicts_world", box_motion_verdicts_world, nb::arg("a"), nb::arg("b"),
          nb::arg("velocity_a").noconvert(), nb::arg("velocity_b").noconvert(), nb::arg("t_max"));
}

}  // namespace geomsrv::bind
