// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
// Distance of points from the bounding sphere of a frustum: a lower bound of that from the frustum, never
// above it.  The centre of the sphere is a point of the frustum, so its distance is an upper one.
#pragma once

#include "geom/point_frustum.hpp"

namespace geomsrv {

template <int Sides>
struct BoundingSphere {
    long double center[Sides + 1];  ///< world frame [m]
    long double radius;             ///< no corner is farther from the centre [m]
    long double off;                ///< nor is the frustum [m]
};

template <int Sides>
BoundingSphere<Sides> bounding_sphere(const View<Sides>& view);

/// The same in doubles.
template <int Sides>
struct SphereFrame {
    Lanes center[Sides + 1], radius, off;
    explicit SphereFrame(const BoundingSphere<Sides>& sphere);
};

struct DistanceBounds {
    Lanes lower, upper;
    LaneMask in_range;
};

// The distance from the centre, 1 u for differences, 3 u for squares and sums, halved by the root with its
// own 1 u: 4 u, and 1 u for the last operation.
inline constexpr double kCenterError = 6.0 * kUnitRoundoff;

template <int Sides>
GEOMSRV_INLINE DistanceBounds distance_bounds(const SphereFrame<Sides>& sphere,
                                              const Lanes (&point)[Sides + 1]) {
    Lanes square = 0.0;
    for (int k = 0; k <= Sides; ++k) {
        const Lanes x = point[k] - sphere.center[k];
        square = square + x * x;
    }
    const Lanes distance = square_root(square);
    return {greater(distance * Lanes(1.0 - kCenterError) - sphere.radius, Lanes(0.0)),
            (distance + sphere.off) * Lanes(1.0 + kCenterError),
            (Lanes(kMinSquare) < square) & (square < Lanes(kMaxSquare))};
}

struct PlainBounds {
    double lower, upper;
};

/// The same for numbers of any size.
template <int Sides>
PlainBounds distance_bounds(const BoundingSphere<Sides>& sphere, const double* point);

}  // namespace geomsrv
