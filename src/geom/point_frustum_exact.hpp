// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
// Distance of a point from a frustum's literal hull without doubt, point by point: for the points that the
// vector code of point_frustum_wide.hpp leaves, and for nearest points and proofs.
#pragma once

#include <cstdint>

#include "geom/exact_gjk.hpp"
#include "geom/exact_number.hpp"
#include "geom/point_frustum.hpp"

namespace geomsrv {

struct ExactPointDistance {
    Rounding distance;        ///< [m]; 0 in the closed frustum
    std::uint8_t region = 0;  ///< FrustumRegion: the faces that hold the nearest point; INSIDE in the frustum
    Witness simplex;          ///< corners (`a`) whose hull holds the nearest point
    Rung rung = Rung::exact;
};

/// A frustum prepared for exact distances; one in the plane is a flat one in space.
template <int Sides>
class ExactPointFrustum {
public:
    explicit ExactPointFrustum(const View<Sides>& view);

    /// `guess` is the region that is likely; the answer is right whatever it is.
    [[nodiscard]] ExactPointDistance distance(const double* point, int guess) const;

    // REQUIRES, from here on: the region is the right one.

    /// The distance, in double-double; false if that cannot tell.
    bool wide_distance(const double* point, int region, Rounding& out) const;

    /// Distance from the near or far plane where it is perpendicular to an axis of the world and takes one
    /// rounding; false elsewhere.  Such distances are often doubles, which no wide arithmetic can prove.
    bool along_axis(const double* point, int region, Rounding& out) const;

    /// The nearest point, each coordinate correctly rounded.
    void nearest(const double* point, int region, double* out) const;

    /// Corners whose hull holds the nearest point.
    [[nodiscard]] Witness simplex(const double* point, int region) const;

private:
    /// All corners of the feature that a region names: 1, 2, 4 or 8; of four, 0 and 3 are opposite.
    struct Feature {
        int count = 0;
        int corner[8];
    };
    static Feature feature_of(int region);
    /// A part of a feature that is likely to be the nearest to the point, which is given as the corners are.
    [[nodiscard]] Witness part_near(const Feature& feature, Vec3 rough_point) const;
    [[nodiscard]] Vec3 rough_corner(int index) const;

    Frustum frustum_;
    bool in_range_;         ///< of ordinary size, see `exact_separation`
    int exponent_;          ///< of the unit of the rough corners
    double rough_[3][8];    ///< corners - origin, rounded: x of all, y of all, z of all
    int axis_ = -1;         ///< of the world, perpendicular to the near plane; -1 for none
    double forward_ = 1.0;  ///< -1 if the view is against that axis
};

}  // namespace geomsrv
