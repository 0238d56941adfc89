// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
#include "bind/point_frustum.hpp"

#include <cmath>
#include <optional>
#include <string_view>

#include "bind/arrays.hpp"
#include "bind/module.hpp"
#include "bind/views.hpp"
#include "geom/point_frustum_bound.hpp"
#include "geom/power_of_two.hpp"

namespace geomsrv::bind {

namespace {

// --------------------------------------------------------------------------------- float64 and float32

/// A frustum for points given in the world, at double precision.
template <class L, int Sides>
struct LocalFrame {
    DistanceFrame<L, Sides> frame;

    explicit LocalFrame(const View<Sides>& view) : frame(distance_frame<L>(view)) {}
    static bool is_ordinary(const View<Sides>& view) { return geomsrv::is_ordinary(view); }

    GEOMSRV_INLINE void load(const double* rows, L (&point)[Sides + 1]) const {
        const FourRows<Sides + 1> found(rows);
        for (int k = 0; k <= Sides; ++k) point[k] = found.at[k];
    }
    GEOMSRV_INLINE void store(const L& length, double* to) const { length.store(to); }
    [[nodiscard]] GEOMSRV_INLINE double world(int, double coordinate) const { return coordinate; }
};

/// The same at single precision: relative to the apex, in a unit in which near is 1 to 2.
template <int Sides>
struct LocalFrame<FloatLanes, Sides> {
    Lanes origin[Sides + 1], first, second, first_back, second_back;  ///< the unit and its inverse
    PowerOfTwo meters;
    DistanceFrame<FloatLanes, Sides> frame;

    explicit LocalFrame(const View<Sides>& view)
        : meters(std::ilogb(view.near)), frame(distance_frame<FloatLanes>(local(view))) {
        const PowerOfTwo unit(-std::ilogb(view.near));
        for (int k = 0; k <= Sides; ++k) origin[k] = view.origin[k];
        first = unit.first;
        second = unit.second;
        first_back = meters.first;
        second_back = meters.second;
    }

    // Slopes, their squares, and lengths times slopes stay far inside of the range of float.
    static constexpr double kLargestFloatDepth = 0x1p40, kLargestFloatWindow = 0x1p20;
    static bool is_ordinary(const View<Sides>& view) {
        const View<Sides> given = local(view);
        bool ordinary = geomsrv::is_ordinary(view) && given.far <= kLargestFloatDepth;
        for (int i = 0; i < Sides; ++i) {
            ordinary &= std::fabs(given.low[i]) <= kLargestFloatWindow;
            ordinary &= std::fabs(given.high[i]) <= kLargestFloatWindow;
        }
        return ordinary;
    }

    GEOMSRV_INLINE void load(const double* rows, FloatLanes (&point)[Sides + 1]) const {
        const FourRows<Sides + 1> low(rows), high(rows + (Sides + 1) * Lanes::kCount);
        for (int k = 0; k <= Sides; ++k) {
            point[k] =
                joined((low.at[k] - origin[k]) * first * second, (high.at[k] - origin[k]) * first * second);
        }
    }
    GEOMSRV_INLINE void store(const FloatLanes& length, double* to) const {
        const auto [low, high] = parted(length);
        (low * first_back * second_back).store(to);
        (high * first_back * second_back).store(to + Lanes::kCount);
    }
    [[nodiscard]] GEOMSRV_INLINE double world(int k, double coordinate) const {
        return origin[k][0] + meters * coordinate;
    }

private:
    static View<Sides> local(View<Sides> view) {
        const PowerOfTwo unit(-std::ilogb(view.near));
        for (double& x : view.origin) x = 0.0;
        for (double& x : view.low) x = unit * x;
        for (double& x : view.high) x = unit * x;
        view.near = unit * view.near;
        view.far = unit * view.far;
        return view;
    }
};

/// Groups of points, as many as there are lanes.  What is out of range is done again, point by point.
template <class L, class Kinds, bool Skewed, int Sides>
GEOMSRV_WIDE_CLONES void measure_points(const LocalFrame<L, Sides>& local, const View<Sides>& view,
                                        const double* points, std::size_t count, PointAnswers out) {
    constexpr std::size_t kDimension = Sides + 1;
    std::optional<DistanceFrame<long double, Sides>> wide;
    for (std::size_t i = 0; i < count; i += L::kCount) {
        L point[kDimension];
        local.load(points + kDimension * i, point);
        const auto found = distance_to_frustum<Kinds, Skewed>(local.frame, point);
        local.store(found.distance, out.distance + i);
        local.store(found.lower, out.lower + i);
        local.store(found.upper, out.upper + i);
        store_bytes(found.region, out.region + i);
        if (out.nearest != nullptr) {
            const auto nearest = nearest_in_world(local.frame, point, found);
            for (std::size_t at = kDimension * i, lane = 0; lane < L::kCount; ++lane) {
                for (std::size_t k = 0; k < kDimension; ++k, ++at) {
                    const bool inside = found.inside.v[lane] != 0;
                    const auto index = static_cast<int>(k);
                    out.nearest[at] =
                        inside ? points[at] : local.world(index, nearest.at[k][static_cast<int>(lane)]);
                }
            }
        }
        if (!all(found.in_range)) [[unlikely]] {
            if (!wide) wide = distance_frame<long double>(view);
            for (std::size_t lane = 0; lane < L::kCount; ++lane) {
                if (found.in_range.v[lane] == 0) {
                    out.put(i + lane, distance_in_long_double(*wide, points + kDimension * (i + lane)));
                }
            }
        }
    }
}

template <class L, int Sides>
PointRungs measure_all(const View<Sides>& view, const double* points, std::size_t count, PointAnswers out) {
    constexpr std::size_t kDimension = Sides + 1;
    if (LocalFrame<L, Sides>::is_ordinary(view)) {
        const LocalFrame<L, Sides> local(view);
        with_windows(local.frame, [&](auto kinds) {
            using Kinds = decltype(kinds);
            const auto measure = local.frame.refinements > 0 ? measure_points<L, Kinds, true, Sides>
                                                             : measure_points<L, Kinds, false, Sides>;
            in_groups<L::kCount, Sides>(points, count, out,
                                        [&](const double* rows, std::size_t size, PointAnswers answers,
                                            std::size_t) { measure(local, view, rows, size, answers); });
        });
    } else {
        const auto frame = distance_frame<long double>(view);
        for (std::size_t i = 0; i < count; ++i) {
            out.put(i, distance_in_long_double(frame, points + kDimension * i));
        }
    }
    return {.filter = static_cast<std::int64_t>(count)};
}

// ------------------------------------------------------------------------------------------------ bound

template <int Sides>
GEOMSRV_WIDE_CLONES void bound_points(const SphereFrame<Sides>& frame, const BoundingSphere<Sides>& sphere,
                                      const double* points, std::size_t count, PointAnswers out) {
    constexpr std::size_t kDimension = Sides + 1;
    for (std::size_t i = 0; i < count; i += Lanes::kCount) {
        const FourRows<kDimension> point(points + kDimension * i);
        const DistanceBounds found = distance_bounds(frame, point.at);
        found.lower.store(out.distance + i);
        found.lower.store(out.lower + i);
        found.upper.store(out.upper + i);
        if (!all(found.in_range)) [[unlikely]] {
            for (std::size_t lane = 0; lane < Lanes::kCount; ++lane) {
                if (found.in_range.v[lane] != 0) continue;
                const PlainBounds plain = distance_bounds(sphere, points + kDimension * (i + lane));
                out.put(i + lane, {plain.lower, plain.lower, plain.upper});
            }
        }
    }
}

template <int Sides>
PointRungs bound_all(const View<Sides>& view, const double* points, std::size_t count, PointAnswers out) {
    const BoundingSphere<Sides> sphere = bounding_sphere(view);
    const SphereFrame<Sides> frame(sphere);
    in_groups<Lanes::kCount, Sides>(
        points, count, out, [&](const double* rows, std::size_t size, PointAnswers answers, std::size_t) {
            bound_points(frame, sphere, rows, size, answers);
        });
    return {.bound = static_cast<std::int64_t>(count)};
}

// ---------------------------------------------------------------------------------------------- binding

/// distance, lower, upper, region, nearest points, simplices (see `find_simplices`), counts of stages.
/// Nearest points and simplices are None if they are not asked for; regions and nearest points at "bound".
template <int Sides, class Packed, class Points>
nb::object distance_to_frustum_batch(const Packed& packed, const Points& points, const char* accuracy,
                                     bool witness, bool evidence) {
    const std::string_view tier = accuracy;
    const std::size_t count = points.shape(0);
    auto distance = empty<double>({count}), lower = empty<double>({count}), upper = empty<double>({count});
    Output<std::uint8_t> region{nb::none()};
    Output<double> nearest{nb::none()};
    Output<std::int32_t> simplex{nb::none()};
    if (tier != "bound") region = empty<std::uint8_t>({count});
    if (tier != "bound" && witness) nearest = empty<double>({count, std::size_t{Sides + 1}});
    if (evidence) simplex = empty<std::int32_t>({count, 4, 2});
    PointRungs rungs;
    {
        const nb::gil_scoped_release unlocked;
        const auto view = unpack_view<Sides>(packed.data());
        const PointAnswers out{distance.data, lower.data, upper.data, region.data, nearest.data};
        const auto measure = tier == "bound"     ? bound_all<Sides>
                             : tier == "float32" ? measure_all<FloatLanes, Sides>
                             : tier == "float64" ? measure_all<Lanes, Sides>
                                                 : measure_exactly<Sides>;
        rungs = measure(view, points.data(), count, out);
        if (evidence) {
            find_simplices(view, points.data(), count, region.data, tier != "exact", simplex.data);
        }
    }
    return nb::make_tuple(distance.array, lower.array, upper.array, region.array, nearest.array,
                          simplex.array, nb::make_tuple(rungs.bound, rungs.filter, rungs.wide, rungs.exact));
}

}  // namespace

void define_point_frustum(nb::module_& m) {
    m.def("distance_to_frustum", distance_to_frustum_batch<2, PackedFrustum, Rows3>,
          nb::arg("frustum").noconvert(), nb::arg("points").noconvert(), nb::arg("accuracy"),
          nb::arg("witness"), nb::arg("evidence"));
    m.def("distance_to_frustum_2d", distance_to_frustum_batch<1, PackedFrustum2D, Rows2>,
          nb::arg("frustum").noconvert(), nb::arg("points").noconvert(), nb::arg("accuracy"),
          nb::arg("witness"), nb::arg("evidence"));
}

}  // namespace geomsrv::bind
