// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "bind/arrays.hpp"
#include "bind/module.hpp"
#include "geom/polygon.hpp"
#include "geom/polygon_bound.hpp"
#include "geom/polygon_distance.hpp"
#include "geom/polygon_distance_exact.hpp"
#include "geom/polygon_first_contact.hpp"
#include "geom/polygon_first_contact_exact.hpp"
#include "geom/polygon_motion.hpp"
#include "geom/polygon_single.hpp"

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

/// Item i of n, or the only one.
constexpr std::size_t item(std::size_t count, std::size_t i) { return count == 1 ? 0 : i; }

std::size_t pair_count(const Rings& a, const Rings& b) { return a.size() == 1 ? b.size() : a.size(); }

std::size_t largest_ring(const Rings& rings) {
    std::size_t largest = 1;
    for (std::size_t i = 0; i < rings.size(); ++i) {
        largest = std::max(largest, rings[i].size());
    }
    return largest;
}

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

/// How many items each rung answered.
using RungCounts = std::array<std::int64_t, 4>;

struct ContactRows {
    std::uint8_t* status;
    double* time;
    double* time_lower;
    double* time_upper;
    double* last_time;
    Vec2* normal;
    std::int64_t* point_offsets;
    bool* certain;
};

struct MovingRings {
    Rings rings;
    const Vec2* velocity;
    std::size_t velocities;

    MovingRings(const Rows2& vertices, const Offsets& offsets, const Rows2& velocity_rows)
        : rings(vertices, offsets),
          velocity(reinterpret_cast<const Vec2*>(velocity_rows.data())),
          velocities(velocity_rows.shape(0)) {}

    [[nodiscard]] MovingPolygon operator[](std::size_t i) const {
        return {rings[item(rings.size(), i)], velocity[item(velocities, i)]};
    }
};

/// Fills the rows and returns the contact points of all pairs, end to end.
template <class Solver>
std::vector<Vec2> first_contacts(const MovingRings& a, const MovingRings& b, double t_max, bool contact_set,
                                 const ContactRows& rows, RungCounts& counts) {
    const std::size_t count = pair_count(a.rings, b.rings);
    std::vector<Vec2> points;
    points.reserve(contact_set ? 2 * count : 0);
    Solver solver(largest_ring(a.rings), largest_ring(b.rings));
    rows.point_offsets[0] = 0;
    constexpr bool kInBlocks =
        std::is_same_v<Solver, FirstContactSolver> || std::is_same_v<Solver, ExactFirstContactSolver>;
    const std::size_t block = kInBlocks ? std::min(count, kPolygonMotionBlock) : 0;
    std::vector<MovingPolygon> block_a(block);
    std::vector<MovingPolygon> block_b(block);
    std::vector<PolygonMotion> known(block);
    for (std::size_t i = 0; i < count; ++i) {
        const std::size_t place = i % kPolygonMotionBlock;
        if (kInBlocks && place == 0) {
            const std::size_t many = std::min(count - i, kPolygonMotionBlock);
            for (std::size_t k = 0; k < many; ++k) {
                block_a[k] = a[i + k];
                block_b[k] = b[i + k];
            }
            decide_polygon_motions(block_a.data(), block_b.data(), many, t_max,
                                   std::is_same_v<Solver, ExactFirstContactSolver>, known.data());
        }
        const FirstContact contact = [&] {
            if constexpr (kInBlocks) {
                return solver.solve(block_a[place], block_b[place], t_max, contact_set, known[place]);
            } else {
                return solver.solve(a[i], b[i], t_max, contact_set);
            }
        }();
        rows.status[i] = static_cast<std::uint8_t>(contact.status);
        rows.time[i] = contact.time;
        rows.time_lower[i] = contact.time_lower;
        rows.time_upper[i] = contact.time_upper;
        rows.last_time[i] = contact.last_time;
        rows.normal[i] = contact.normal;
        points.insert(points.end(), contact.points.begin(), contact.points.end());
        rows.point_offsets[i + 1] = static_cast<std::int64_t>(points.size());
        rows.certain[i] = contact.certain;
        ++counts[static_cast<std::size_t>(contact.rung)];
    }
    return points;
}

struct DistanceRows {
    double* distance;
    double* lower;
    double* upper;
    Vec2* point_a;
    Vec2* point_b;
    Vec2* normal;
    std::uint8_t* status;
    bool* meet;
    bool* certain;
};

template <class Solver>
void distances(const Rings& a, const Rings& b, bool penetration, const DistanceRows& rows,
               RungCounts& counts) {
    constexpr std::uint8_t kOk = 0;
    const std::size_t count = pair_count(a, b);
    Solver solver(largest_ring(a), largest_ring(b));
    for (std::size_t i = 0; i < count; ++i) {
        const PolygonDistance found = solver.solve(a[item(a.size(), i)], b[item(b.size(), i)], penetration);
        rows.distance[i] = found.distance;
        rows.lower[i] = found.lower;
        rows.upper[i] = found.upper;
        rows.point_a[i] = found.point_a;
        rows.point_b[i] = found.point_b;
        rows.normal[i] = found.normal;
        rows.status[i] = kOk;
        rows.meet[i] = found.meet;
        rows.certain[i] = found.certain;
        ++counts[static_cast<std::size_t>(found.rung)];
    }
}

/// Calls `work` with the solver of a tier.
template <class Bound, class Float32, class Float64, class Exact, class Work>
auto at_tier(std::string_view accuracy, const Work& work) {
    if (accuracy == "bound") {
        return work(std::type_identity<Bound>{});
    }
    if (accuracy == "float32") {
        return work(std::type_identity<Float32>{});
    }
    if (accuracy == "exact") {
        return work(std::type_identity<Exact>{});
    }
    return work(std::type_identity<Float64>{});
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
    m.def(
        "first_contact_polygons",
        [](const Rows2& vertices_a, const Offsets& offsets_a, const Rows2& vertices_b,
           const Offsets& offsets_b, const Rows2& velocity_a, const Rows2& velocity_b, double t_max,
           bool contact_set, const char* accuracy) {
            const MovingRings a(vertices_a, offsets_a, velocity_a);
            const MovingRings b(vertices_b, offsets_b, velocity_b);
            const std::size_t count = pair_count(a.rings, b.rings);
            const auto status = empty<std::uint8_t>({count});
            const auto time = empty<double>({count});
            const auto time_lower = empty<double>({count});
            const auto time_upper = empty<double>({count});
            const auto last_time = empty<double>({count});
            const auto normal = empty<double>({count, 2});
            const auto point_offsets = empty<std::int64_t>({count + 1});
            const auto certain = empty<bool>({count});
            const ContactRows rows{status.data,        time.data,      time_lower.data,
                                   time_upper.data,    last_time.data, reinterpret_cast<Vec2*>(normal.data),
                                   point_offsets.data, certain.data};
            RungCounts counts{};
            std::vector<Vec2> found;
            {
                const nb::gil_scoped_release unlocked;
                found = at_tier<BoundFirstContactSolver, SingleFirstContactSolver, FirstContactSolver,
                                ExactFirstContactSolver>(accuracy, [&]<class S>(S /*tier*/) {
                    return first_contacts<typename S::type>(a, b, t_max, contact_set, rows, counts);
                });
            }
            return nb::make_tuple(status.array, time.array, time_lower.array, time_upper.array,
                                  last_time.array, normal.array, rows_of(std::move(found)),
                                  point_offsets.array, certain.array,
                                  nb::make_tuple(counts[0], counts[1], counts[2], counts[3]));
        },
        nb::arg("vertices_a").noconvert(), nb::arg("offsets_a").noconvert(),
        nb::arg("vertices_b").noconvert(), nb::arg("offsets_b").noconvert(),
        nb::arg("velocity_a").noconvert(), nb::arg("velocity_b").noconvert(), nb::arg("t_max"),
        nb::arg("contact_set"), nb::arg("accuracy") = "float64");
    m.def(
        "distance_polygons",
        [](const Rows2& vertices_a, const Offsets& offsets_a, const Rows2& vertices_b,
           const Offsets& offsets_b, bool penetration, const char* accuracy) {
            const Rings a(vertices_a, offsets_a);
            const Rings b(vertices_b, offsets_b);
            const std::size_t count = pair_count(a, b);
            const auto distance = empty<double>({count});
            const auto lower = empty<double>({count});
            const auto upper = empty<double>({count});
            const auto point_a = empty<double>({count, 2});
            const auto point_b = empty<double>({count, 2});
            const auto normal = empty<double>({count, 2});
            const auto status = empty<std::uint8_t>({count});
            const auto meet = empty<bool>({count});
            const auto certain = empty<bool>({count});
            const DistanceRows rows{distance.data,
                                    lower.data,
                                    upper.data,
                                    reinterpret_cast<Vec2*>(point_a.data),
                                    reinterpret_cast<Vec2*>(point_b.data),
                                    reinterpret_cast<Vec2*>(normal.data),
                                    status.data,
                                    meet.data,
                                    certain.data};
            RungCounts counts{};
            {
                const nb::gil_scoped_release unlocked;
                at_tier<BoundPolygonDistanceSolver, SinglePolygonDistanceSolver, PolygonDistanceSolver,
                        ExactPolygonDistanceSolver>(accuracy, [&]<class S>(S /*tier*/) {
                    distances<typename S::type>(a, b, penetration, rows, counts);
                });
            }
            return nb::make_tuple(distance.array, lower.array, upper.array, point_a.array, point_b.array,
                                  normal.array, status.array, meet.array, certain.array,
                                  nb::make_tuple(counts[0], counts[1], counts[2], counts[3]));
        },
        nb::arg("vertices_a").noconvert(), nb::arg("offsets_a").noconvert(),
        nb::arg("vertices_b").noconvert(), nb::arg("offsets_b").noconvert(), nb::arg("penetration"),
        nb::arg("accuracy") = "float64");
}

}  // namespace geomsrv::bind
