// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
// Distances of shape pairs, boxes and polytopes: one batch loop per signature.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "bind/arrays.hpp"
#include "bind/module.hpp"
#include "geom/distance_table.hpp"
#include "geom/place.hpp"
#include "geom/placed_distance.hpp"

namespace geomsrv::bind {

namespace {

/// Where a batch of answers goes: distance, lower, upper, point_a, point_b, normal, status.
class Answers {
public:
    explicit Answers(std::size_t n)
        : distance_(empty<double>({n})),
          lower_(empty<double>({n})),
          upper_(empty<double>({n})),
          point_a_(empty<double>({n, 3})),
          point_b_(empty<double>({n, 3})),
          normal_(empty<double>({n, 3})),
          status_(empty<std::uint8_t>({n})) {}

    void set(std::size_t i, const Separation& s) const {
        distance_.data[i] = s.distance;
        lower_.data[i] = s.lower;
        upper_.data[i] = s.upper;
        set(point_a_.data + 3 * i, s.point_a);
        set(point_b_.data + 3 * i, s.point_b);
        set(normal_.data + 3 * i, s.normal);
        status_.data[i] = static_cast<std::uint8_t>(s.outcome);
    }

    nb::tuple tuple() const {
        return nb::make_tuple(distance_.array, lower_.array, upper_.array, point_a_.array, point_b_.array,
                              normal_.array, status_.array);
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
};

/// How the answers came about: stage and iterations, for tests that must know that they reached a branch.
class Stages {
public:
    explicit Stages(std::size_t n)
        : stage_(empty<std::uint8_t>({n})), iterations_(empty<std::int64_t>({n})) {}

    void set(std::size_t i, const Separation& s) const {
        stage_.data[i] = static_cast<std::uint8_t>(s.stage);
        iterations_.data[i] = s.iterations;
    }

    nb::tuple tuple() const { return nb::make_tuple(stage_.array, iterations_.array); }

private:
    Output<std::uint8_t> stage_;
    Output<std::int64_t> iterations_;
};

/// The shapes of a batch, each looked through once.
class ShapeTable {
public:
    ShapeTable(std::size_t count, const std::uint8_t* kinds, const double* params, const double* vertices,
               const std::int64_t* offsets)
        : extents_(count) {
        shapes_.reserve(count);
        for (std::size_t i = 0; i < count; ++i) {
            ShapeView shape{static_cast<ShapeKind>(kinds[i]), params + 4 * i, vertices + 3 * offsets[i],
                            static_cast<std::ptrdiff_t>(offsets[i + 1] - offsets[i])};
            if (shape.kind == ShapeKind::convex) {
                extents_[i] = extent_of(shape);
                shape.extent = &extents_[i];
            }
            shapes_.push_back(shape);
        }
    }

    const ShapeView& shape(std::int64_t i) const { return shapes_[static_cast<std::size_t>(i)]; }

private:
    std::vector<HullExtent> extents_;
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
                         const Offsets& offsets, const Pairs& pairs, const Rows7& poses_ab,
                         bool penetration) {
    const std::size_t shapes = kinds.size();
    const std::size_t n = pairs.shape(0);
    if (params.shape(0) != shapes || offsets.size() != shapes + 1 || poses_ab.shape(0) != n) {
        throw nb::value_error("distance_pairs: arrays of different length");
    }
    const Sink out(n);
    {
        const nb::gil_scoped_release unlocked;
        const ShapeTable table(shapes, kinds.data(), params.data(), vertices.data(), offsets.data());
        std::vector<double> scratch(6 * longest(offsets.data(), shapes));
        for (std::size_t i = 0; i < n; ++i) {
            const ShapeView& a = table.shape(pairs.data()[2 * i]);
            const ShapeView& b = table.shape(pairs.data()[2 * i + 1]);
            const Transform X_ab = pose_of(poses_ab.data() + 7 * i);
            out.set(i, shape_distance(a, b, X_ab, penetration, scratch.data()));
        }
    }
    return out.tuple();
}

template <class Sink>
nb::tuple distance_placed(const Codes& kinds, const Rows4& params, const Rows3& vertices,
                          const Offsets& offsets, const Values& reach, const Offsets& shape,
                          const Rows7& poses, const Values& uncertainty, const Pairs& pairs,
                          double pose_rounding, bool penetration) {
    const std::size_t shapes = kinds.size();
    const std::size_t objects = shape.size();
    const std::size_t n = pairs.shape(0);
    if (params.shape(0) != shapes || offsets.size() != shapes + 1 || reach.size() != shapes ||
        poses.shape(0) != objects || uncertainty.size() != objects) {
        throw nb::value_error("distance_placed: arrays of different length");
    }
    const Sink out(n);
    {
        const nb::gil_scoped_release unlocked;
        const ShapeTable table(shapes, kinds.data(), params.data(), vertices.data(), offsets.data());
        std::vector<double> scratch(6 * longest(offsets.data(), shapes));
        const auto placed = [&](std::int64_t row) {
            const std::int64_t k = shape.data()[row];
            return PlacedShape{table.shape(k), poses.data() + 7 * row, reach.data()[k],
                               uncertainty.data()[row]};
        };
        for (std::size_t i = 0; i < n; ++i) {
            const std::int64_t* pair = pairs.data() + 2 * i;
            out.set(i, placed_distance(placed(pair[0]), placed(pair[1]), pose_rounding, penetration,
                                       scratch.data()));
        }
    }
    return out.tuple();
}

Vec3 vec3_at(const double* row) { return {row[0], row[1], row[2]}; }

/// Boxes of a batch; one serves every pair.
struct BoxRows {
    const Rows3& center;
    const Matrices3& axes;
    const Rows3& half_extents;

    std::size_t count() const { return center.shape(0); }
    bool consistent() const { return axes.shape(0) == count() && half_extents.shape(0) == count(); }
    WorldBody body(std::size_t i) const {
        const std::size_t row = count() == 1 ? 0 : i;
        const double* m = axes.data() + 9 * row;
        WorldBody out;
        out.is_box = true;
        out.box = {vec3_at(center.data() + 3 * row),
                   {{vec3_at(m), vec3_at(m + 3), vec3_at(m + 6)}},
                   vec3_at(half_extents.data() + 3 * row)};
        return out;
    }
};

/// Hulls of a batch; one serves every pair.
struct HullRows {
    const Rows3& vertices;
    const Offsets& offsets;
    const Rows3& origin;
    const Values& error;

    std::size_t count() const { return offsets.size() - 1; }
    bool consistent() const { return origin.shape(0) == count() && error.size() == count(); }
    std::size_t scratch_size() const { return 3 * longest(offsets.data(), count()); }
    /// `extent` must outlive the body.
    WorldBody body(std::size_t i, HullExtent& extent) const {
        const std::size_t row = count() == 1 ? 0 : i;
        WorldBody out;
        out.hull = {ShapeKind::convex, error.data() + row, vertices.data() + 3 * offsets.data()[row],
                    static_cast<std::ptrdiff_t>(offsets.data()[row + 1] - offsets.data()[row])};
        extent = extent_of(out.hull);
        out.hull.extent = &extent;
        out.origin = vec3_at(origin.data() + 3 * row);
        return out;
    }
};

/// Pairs of two batches of which one may have a single item.
template <class A, class B>
std::size_t common_count(const A& a, const B& b) {
    const std::size_t n = a.count() == 1 ? b.count() : a.count();
    if ((b.count() != n && b.count() != 1) || !a.consistent() || !b.consistent()) {
        throw nb::value_error("distance: arrays of different length");
    }
    return n;
}

template <class Sink>
nb::tuple distance_boxes(const Rows3& center_a, const Matrices3& axes_a, const Rows3& half_extents_a,
                         const Rows3& center_b, const Matrices3& axes_b, const Rows3& half_extents_b,
                         bool penetration) {
    const BoxRows a{center_a, axes_a, half_extents_a};
    const BoxRows b{center_b, axes_b, half_extents_b};
    const std::size_t n = common_count(a, b);
    const Sink out(n);
    {
        const nb::gil_scoped_release unlocked;
        for (std::size_t i = 0; i < n; ++i) {
            out.set(i, world_distance(a.body(i), b.body(i), penetration, nullptr));
        }
    }
    return out.tuple();
}

template <class Sink>
nb::tuple distance_boxes_polytopes(const Rows3& center_a, const Matrices3& axes_a,
                                   const Rows3& half_extents_a, const Rows3& vertices_b,
                                   const Offsets& offsets_b, const Rows3& origin_b, const Values& error_b,
                                   bool penetration) {
    const BoxRows a{center_a, axes_a, half_extents_a};
    const HullRows b{vertices_b, offsets_b, origin_b, error_b};
    const std::size_t n = common_count(a, b);
    const Sink out(n);
    {
        const nb::gil_scoped_release unlocked;
        std::vector<double> scratch(b.scratch_size());
        HullExtent extent;
        for (std::size_t i = 0; i < n; ++i) {
            out.set(i, world_distance(a.body(i), b.body(i, extent), penetration, scratch.data()));
        }
    }
    return out.tuple();
}

template <class Sink>
nb::tuple distance_polytopes(const Rows3& vertices_a, const Offsets& offsets_a, const Rows3& origin_a,
                             const Values& error_a, const Rows3& vertices_b, const Offsets& offsets_b,
                             const Rows3& origin_b, const Values& error_b, bool penetration) {
    const HullRows a{vertices_a, offsets_a, origin_a, error_a};
    const HullRows b{vertices_b, offsets_b, origin_b, error_b};
    const std::size_t n = common_count(a, b);
    const Sink out(n);
    {
        const nb::gil_scoped_release unlocked;
        std::vector<double> scratch(a.scratch_size() + b.scratch_size());
        HullExtent extent_a;
        HullExtent extent_b;
        for (std::size_t i = 0; i < n; ++i) {
            out.set(i, world_distance(a.body(i, extent_a), b.body(i, extent_b), penetration, scratch.data()));
        }
    }
    return out.tuple();
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
           nb::arg("penetration"));
    m.def("distance_placed", distance_placed<Answers>, nb::arg("kinds").noconvert(),
          nb::arg("params").noconvert(), nb::arg("vertices").noconvert(), nb::arg("offsets").noconvert(),
          nb::arg("reach").noconvert(), nb::arg("shape").noconvert(), nb::arg("poses").noconvert(),
          nb::arg("uncertainty").noconvert(), nb::arg("pairs").noconvert(), nb::arg("pose_rounding"),
          nb::arg("penetration"));
    define(m, "distance_boxes", "distance_boxes_stages", distance_boxes<Answers>, distance_boxes<Stages>,
           nb::arg("center_a").noconvert(), nb::arg("axes_a").noconvert(),
           nb::arg("half_extents_a").noconvert(), nb::arg("center_b").noconvert(),
           nb::arg("axes_b").noconvert(), nb::arg("half_extents_b").noconvert(), nb::arg("penetration"));
    define(m, "distance_boxes_polytopes", "distance_boxes_polytopes_stages",
           distance_boxes_polytopes<Answers>, distance_boxes_polytopes<Stages>,
           nb::arg("center_a").noconvert(), nb::arg("axes_a").noconvert(),
           nb::arg("half_extents_a").noconvert(), nb::arg("vertices_b").noconvert(),
           nb::arg("offsets_b").noconvert(), nb::arg("origin_b").noconvert(), nb::arg("error_b").noconvert(),
           nb::arg("penetration"));
    define(m, "distance_polytopes", "distance_polytopes_stages", distance_polytopes<Answers>,
           distance_polytopes<Stages>, nb::arg("vertices_a").noconvert(), nb::arg("offsets_a").noconvert(),
           nb::arg("origin_a").noconvert(), nb::arg("error_a").noconvert(), nb::arg("vertices_b").noconvert(),
           nb::arg("offsets_b").noconvert(), nb::arg("origin_b").noconvert(), nb::arg("error_b").noconvert(),
           nb::arg("penetration"));
}

}  // namespace geomsrv::bind
