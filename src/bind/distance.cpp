// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
// Distances of shape pairs, boxes and polytopes: one batch loop per signature.
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string_view.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <optional>
#include <string_view>
#include <typeinfo>
#include <utility>
#include <variant>
#include <vector>

#include "bind/arrays.hpp"
#include "bind/module.hpp"
#include "geom/distance_table.hpp"
#include "geom/place.hpp"
#include "geom/placed_distance.hpp"

namespace geomsrv::bind {

namespace {

Tier tier_of(std::string_view accuracy) {
    constexpr std::string_view kNames[] = {"bound", "float32", "float64", "exact"};
    const auto* const found = std::find(std::begin(kNames), std::end(kNames), accuracy);
    if (found == std::end(kNames)) {
        throw nb::value_error("distance: unknown accuracy");
    }
    return static_cast<Tier>(found - std::begin(kNames));
}

/// Where a batch of answers goes: distance, lower, upper, point_a, point_b, normal, status; and with
/// `everything` the rung of the ladder and, if wanted, the proving simplex.
class Answers {
public:
    Answers(std::size_t n, bool simplex)
        : distance_(empty<double>({n})),
          lower_(empty<double>({n})),
          upper_(empty<double>({n})),
          point_a_(empty<double>({n, 3})),
          point_b_(empty<double>({n, 3})),
          normal_(empty<double>({n, 3})),
          status_(empty<std::uint8_t>({n})),
          rung_(empty<std::uint8_t>({n})) {
        if (simplex) {
            simplex_ = empty<std::int32_t>({n, 4, 2});
        }
    }

    void set(std::size_t i, const Separation& s) const {
        distance_.data[i] = s.distance;
        lower_.data[i] = s.lower;
        upper_.data[i] = s.upper;
        set(point_a_.data + 3 * i, s.point_a);
        set(point_b_.data + 3 * i, s.point_b);
        set(normal_.data + 3 * i, s.normal);
        status_.data[i] = static_cast<std::uint8_t>(s.outcome);
        rung_.data[i] = static_cast<std::uint8_t>(s.rung);
        if (simplex_.data != nullptr) {
            std::int32_t* row = simplex_.data + 8 * i;
            for (int k = 0; k < 4; ++k) {
                *row++ = k < s.simplex.count ? s.simplex.a[k] : -1;
                *row++ = k < s.simplex.count ? s.simplex.b[k] : -1;
            }
        }
    }

    nb::tuple tuple() const {
        return nb::make_tuple(distance_.array, lower_.array, upper_.array, point_a_.array, point_b_.array,
                              normal_.array, status_.array, rung_.array);
    }
    nb::tuple everything() const {
        return nb::make_tuple(distance_.array, lower_.array, upper_.array, point_a_.array, point_b_.array,
                              normal_.array, status_.array, rung_.array, simplex_.array);
    }

private:
    static void set(double* out, Vec3 v) {
        out[0] = v.x;
        out[1] = v.y;
        out[2] = v.z;
    }

    Output<double> distance_;
    Output<double> lower_;
    Output<double> upper_;
    Output<double> point_a_;
    Output<double> point_b_;
    Output<double> normal_;
    Output<std::uint8_t> status_;
    Output<std::uint8_t> rung_;
    Output<std::int32_t> simplex_{nb::none()};
};

/// How the answers came about: stage and iterations, for tests that must know that they reached a branch.
class Stages {
public:
    Stages(std::size_t n, bool) : stage_(empty<std::uint8_t>({n})), iterations_(empty<std::int64_t>({n})) {}

    void set(std::size_t i, const Separation& s) const {
        stage_.data[i] = static_cast<std::uint8_t>(s.stage);
        iterations_.data[i] = s.iterations;
    }

    nb::tuple everything() const { return nb::make_tuple(stage_.array, iterations_.array); }

private:
    Output<std::uint8_t> stage_;
    Output<std::int64_t> iterations_;
};

/// The shapes of a batch, each looked through once.
class ShapeTable {
public:
    /// `frusta`: 18 numbers per shape, all 0 for one that is none; nullptr where there are none.
    ShapeTable(std::size_t count, const std::uint8_t* kinds, const double* params, const double* vertices,
               const std::int64_t* offsets, const double* frusta = nullptr)
        : extents_(count), frusta_(frusta == nullptr ? 0 : count) {
        shapes_.reserve(count);
        for (std::size_t i = 0; i < count; ++i) {
            ShapeView shape{static_cast<ShapeKind>(kinds[i]), params + 4 * i, vertices + 3 * offsets[i],
                            static_cast<std::ptrdiff_t>(offsets[i + 1] - offsets[i])};
            if (frusta != nullptr && frusta[18 * i + 17] > 0.0) {
                PlacedFrustum& own = frusta_[i];
                own.frustum = unpacked_frustum(frusta + 18 * i);
                own.corners = rounded_corners(own.frustum, false);
                own.params[0] = own.corners.error;
                shape = {ShapeKind::convex, own.params, own.corners.vertices, 8, nullptr, &own.frustum};
            }
            if (shape.kind == ShapeKind::convex) {
                extents_[i] = extent_of(shape);
                shape.extent = &extents_[i];
            }
            shapes_.push_back(shape);
        }
    }

    const ShapeView& shape(std::int64_t i) const { return shapes_[static_cast<std::size_t>(i)]; }

private:
    struct PlacedFrustum {
        Frustum frustum;
        RoundedCorners corners;
        double params[4] = {};
    };

    std::vector<HullExtent> extents_;
    std::vector<PlacedFrustum> frusta_;
    std::vector<ShapeView> shapes_;
};

/// The longest hull of a table, so that one scratch buffer serves the whole batch.
std::size_t longest(const std::int64_t* offsets, std::size_t count) {
    std::int64_t most = 0;
    for (std::size_t i = 0; i < count; ++i) {
        most = std::max(most, offsets[i + 1] - offsets[i]);
    }
    return static_cast<std::size_t>(most);
}

template <class Sink>
nb::tuple distance_pairs(const Codes& kinds, const Rows4& params, const Rows3& vertices,
                         const Offsets& offsets, const Pairs& pairs, const Rows7& poses_ab, bool penetration,
                         std::string_view accuracy, bool evidence, const std::optional<Rows18>& frusta) {
    const std::size_t shapes = kinds.size();
    const std::size_t n = pairs.shape(0);
    if (params.shape(0) != shapes || offsets.size() != shapes + 1 || poses_ab.shape(0) != n ||
        (frusta && frusta->shape(0) != shapes)) {
        throw nb::value_error("distance_pairs: arrays of different length");
    }
    const Sink out(n, evidence);
    const Wanted wanted{penetration, tier_of(accuracy), evidence};
    {
        const nb::gil_scoped_release unlocked;
        const ShapeTable table(shapes, kinds.data(), params.data(), vertices.data(), offsets.data(),
                               frusta ? frusta->data() : nullptr);
        std::vector<double> scratch(6 * longest(offsets.data(), shapes));
        for (std::size_t i = 0; i < n; ++i) {
            const ShapeView& a = table.shape(pairs.data()[2 * i]);
            const ShapeView& b = table.shape(pairs.data()[2 * i + 1]);
            const Transform X_ab = pose_of(poses_ab.data() + 7 * i);
            out.set(i, shape_distance(a, b, X_ab, wanted, scratch.data()));
        }
    }
    return out.everything();
}

nb::tuple distance_placed(const Codes& kinds, const Rows4& params, const Rows3& vertices,
                          const Offsets& offsets, const Values& reach, const Offsets& shape,
                          const Rows7& poses, const Values& uncertainty, const Pairs& pairs,
                          double pose_rounding, bool penetration, std::string_view accuracy,
                          const std::optional<Rows18>& frusta) {
    const std::size_t shapes = kinds.size();
    const std::size_t objects = shape.size();
    const std::size_t n = pairs.shape(0);
    if (params.shape(0) != shapes || offsets.size() != shapes + 1 || reach.size() != shapes ||
        poses.shape(0) != objects || uncertainty.size() != objects ||
        (frusta && frusta->shape(0) != shapes)) {
        throw nb::value_error("distance_placed: arrays of different length");
    }
    const Answers out(n, false);
    const Wanted wanted{penetration, tier_of(accuracy)};
    {
        const nb::gil_scoped_release unlocked;
        const ShapeTable table(shapes, kinds.data(), params.data(), vertices.data(), offsets.data(),
                               frusta ? frusta->data() : nullptr);
        std::vector<double> scratch(6 * longest(offsets.data(), shapes));
        const auto placed = [&](std::int64_t row) {
            const std::int64_t k = shape.data()[row];
            return PlacedShape{table.shape(k), poses.data() + 7 * row, reach.data()[k],
                               uncertainty.data()[row]};
        };
        for (std::size_t i = 0; i < n; ++i) {
            const std::int64_t* pair = pairs.data() + 2 * i;
            out.set(i,
                    placed_distance(placed(pair[0]), placed(pair[1]), pose_rounding, wanted, scratch.data()));
        }
    }
    return out.tuple();
}

Vec3 vec3_at(const double* row) { return {row[0], row[1], row[2]}; }

/// Boxes of a batch: center (n, 3), axes (n, 3, 3), half extents (n, 3).
struct BoxRows {
    Rows3 center;
    Matrices3 axes;
    Rows3 half_extents;

    std::size_t count() const { return center.shape(0); }
    bool consistent() const { return axes.shape(0) == count() && half_extents.shape(0) == count(); }
    std::size_t scratch_size() const { return 0; }
    WorldBody body(std::size_t row, HullExtent&) const {
        const double* m = axes.data() + 9 * row;
        WorldBody out;
        out.is_box = true;
        out.box = {vec3_at(center.data() + 3 * row),
                   {{vec3_at(m), vec3_at(m + 3), vec3_at(m + 6)}},
                   vec3_at(half_extents.data() + 3 * row)};
        return out;
    }
};

constexpr double kGivenExactly[4] = {};  // how far listed vertices may be from the ones meant

/// `extent` must outlive the body.
WorldBody hull_body(const double* vertices, std::ptrdiff_t count, HullExtent& extent) {
    WorldBody out;
    out.hull = {ShapeKind::convex, kGivenExactly, vertices, count};
    extent = extent_of(out.hull);
    out.hull.extent = &extent;
    return out;
}

/// Hulls of a batch: vertices (m, 3), offsets (n + 1,).
struct HullRows {
    Rows3 vertices;
    Offsets offsets;

    std::size_t count() const { return offsets.size() - 1; }
    bool consistent() const { return true; }
    std::size_t scratch_size() const { return 3 * longest(offsets.data(), count()); }
    WorldBody body(std::size_t row, HullExtent& extent) const {
        const std::int64_t begin = offsets.data()[row];
        return hull_body(vertices.data() + 3 * begin, offsets.data()[row + 1] - begin, extent);
    }
};

/// A frustum, packed (18,).
class OneFrustum {
public:
    explicit OneFrustum(const Input<double, nb::shape<18>>& packed)
        : frustum_(unpacked_frustum(packed.data())),
          corners_(rounded_corners(frustum_, true)),
          params_{corners_.error} {}

    std::size_t count() const { return 1; }
    bool consistent() const { return true; }
    std::size_t scratch_size() const { return 24; }
    WorldBody body(std::size_t, HullExtent& extent) const {
        WorldBody out = hull_body(corners_.vertices, 8, extent);
        out.hull.params = params_;
        out.hull.frustum = &frustum_;
        out.origin = frustum_.origin;
        return out;
    }

private:
    Frustum frustum_;
    RoundedCorners corners_;
    double params_[4];
};

/// One side of a batch; a single body serves every pair.
class WorldSide {
public:
    explicit WorldSide(const nb::tuple& arrays) : rows_(rows_of(arrays)) {
        if (!std::visit([](const auto& rows) { return rows.consistent(); }, rows_)) {
            throw nb::value_error("distance: arrays of different length");
        }
    }

    std::size_t count() const {
        return std::visit([](const auto& rows) { return rows.count(); }, rows_);
    }
    std::size_t scratch_size() const {
        return std::visit([](const auto& rows) { return rows.scratch_size(); }, rows_);
    }
    WorldBody body(std::size_t i, HullExtent& extent) const {
        const std::size_t row = count() == 1 ? 0 : i;
        return std::visit([&](const auto& rows) { return rows.body(row, extent); }, rows_);
    }

private:
    using Rows = std::variant<BoxRows, HullRows, OneFrustum>;

    template <class Array>
    static Array as(const nb::handle& array) {
        return nb::cast<Array>(array, false);
    }

    static Rows rows_of(const nb::tuple& arrays) {
        constexpr const char* kFault =
            "distance: a side must be (center, axes, half_extents), (vertices, offsets) or (packed frustum,)";
        try {
            switch (arrays.size()) {
                case 1:
                    return OneFrustum(as<Input<double, nb::shape<18>>>(arrays[0]));
                case 2:
                    return HullRows{as<Rows3>(arrays[0]), as<Offsets>(arrays[1])};
                case 3:
                    return BoxRows{as<Rows3>(arrays[0]), as<Matrices3>(arrays[1]), as<Rows3>(arrays[2])};
                default:
                    break;
            }
        } catch (const std::bad_cast&) {
            throw nb::type_error(kFault);
        }
        throw nb::type_error(kFault);
    }

    Rows rows_;
};

/// Pairs of two batches of which one may have a single item.
std::size_t common_count(std::size_t a, std::size_t b) {
    const std::size_t n = a == 1 ? b : a;
    if (b != n && b != 1) {
        throw nb::value_error("distance: batches of different length");
    }
    return n;
}

template <class Sink>
nb::tuple distance_world(const nb::tuple& side_a, const nb::tuple& side_b, bool penetration,
                         std::string_view accuracy, bool evidence) {
    const WorldSide a(side_a);
    const WorldSide b(side_b);
    const std::size_t n = common_count(a.count(), b.count());
    const Sink out(n, evidence);
    const Wanted wanted{penetration, tier_of(accuracy), evidence};
    {
        const nb::gil_scoped_release unlocked;
        std::vector<double> scratch(a.scratch_size() + b.scratch_size());
        HullExtent extent_a;
        HullExtent extent_b;
        for (std::size_t i = 0; i < n; ++i) {
            out.set(i, world_distance(a.body(i, extent_a), b.body(i, extent_b), wanted, scratch.data()));
        }
    }
    return out.everything();
}

/// Every query twice: its answers under its own name, and as `*_stages` which branch gave them.
template <class Loop, class Trace, class... Args>
void define(nb::module_& m, const char* name, const char* trace_name, Loop loop, Trace trace,
            const Args&... args) {
    m.def(name, loop, args...);
    m.def(trace_name, trace, args...);
}

}  // namespace

void define_distance(nb::module_& m) {
    m.def("shape_kinds", [] {
        nb::list names;
        for (const char* name : kShapeNames) {
            names.append(name);
        }
        return nb::tuple(names);
    });
    m.def("supported_pairs", [] {
        const Output<bool> out = empty<bool>({kShapeKinds, kShapeKinds});
        for (std::size_t i = 0; i < kShapeKinds; ++i) {
            for (std::size_t j = 0; j < kShapeKinds; ++j) {
                out.data[i * kShapeKinds + j] =
                    supported_pair(static_cast<ShapeKind>(i), static_cast<ShapeKind>(j));
            }
        }
        return out.array;
    });
    define(m, "distance_pairs", "distance_pairs_stages", distance_pairs<Answers>, distance_pairs<Stages>,
           nb::arg("kinds").noconvert(), nb::arg("params").noconvert(), nb::arg("vertices").noconvert(),
           nb::arg("offsets").noconvert(), nb::arg("pairs").noconvert(), nb::arg("poses_ab").noconvert(),
           nb::arg("penetration"), nb::arg("accuracy") = "float64", nb::arg("evidence") = false,
           nb::arg("frusta").noconvert() = nb::none());
    m.def("distance_placed", distance_placed, nb::arg("kinds").noconvert(), nb::arg("params").noconvert(),
          nb::arg("vertices").noconvert(), nb::arg("offsets").noconvert(), nb::arg("reach").noconvert(),
          nb::arg("shape").noconvert(), nb::arg("poses").noconvert(), nb::arg("uncertainty").noconvert(),
          nb::arg("pairs").noconvert(), nb::arg("pose_rounding"), nb::arg("penetration"),
          nb::arg("accuracy") = "float64", nb::arg("frusta").noconvert() = nb::none());
    define(m, "distance_world", "distance_world_stages", distance_world<Answers>, distance_world<Stages>,
           nb::arg("a"), nb::arg("b"), nb::arg("penetration"), nb::arg("accuracy") = "float64",
           nb::arg("evidence") = false);
}

}  // namespace geomsrv::bind
