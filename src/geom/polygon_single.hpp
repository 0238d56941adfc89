// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
// First contact and distance of two convex polygons in single precision, relative to a vertex of the first,
// with bounds that hold for the given numbers.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "geom/polygon_distance.hpp"
#include "geom/polygon_first_contact.hpp"
#include "geom/polygon_overlap.hpp"
#include "geom/polygon_pair.hpp"
#include "geom/polygon_projection.hpp"
#include "geom/vec.hpp"

namespace geomsrv {

/// The pair of polygon_pair.hpp with every number rounded to float: lengths times a power of two that makes
/// the reach 1 to 2, every axis by one of its own, so that nothing that matters leaves the range of float.
class SinglePair {
public:
    SinglePair(std::size_t largest_a, std::size_t largest_b);

    /// Takes up two valid rings; they must outlive their use.
    void load(Ring a, Ring b);

    [[nodiscard]] const ProjectedPolygon<float>& side(int i) const {
        return sides_[static_cast<std::size_t>(i)];
    }
    /// The same in double, without gaps.
    [[nodiscard]] const PolygonPair& places() const { return places_; }
    /// Lengths are those of `places` times 2^down.
    [[nodiscard]] int down() const { return down_; }
    /// ... and the given ones times 2^exponent.
    [[nodiscard]] int exponent() const { return places_.scale_exponent() + down_; }
    /// Error of a gap relative to |D|_1; add the underflow.
    [[nodiscard]] float gap_error() const { return gap_error_; }
    [[nodiscard]] float underflow() const { return underflow_; }
    /// The axis that queries count as this one: those of a, then, from the next whole block on, those of b.
    [[nodiscard]] AxisOf axis(float place) const;

private:
    PolygonPair places_;
    std::array<ProjectedPolygon<float>, 2> sides_;
    std::vector<float> storage_;
    int down_ = 0;
    float gap_error_ = 0.0F;
    float underflow_ = 0.0F;
};

class SingleFirstContactSolver {
public:
    SingleFirstContactSolver(std::size_t largest_a, std::size_t largest_b) : pair_(largest_a, largest_b) {}

    /// As `FirstContactSolver`, but without slack for rounding of the input: what is not excluded counts as
    /// contact, `certain` tells what is proven.
    FirstContact solve(const MovingPolygon& a, const MovingPolygon& b, double t_max, bool contact_set);

private:
    SinglePair pair_;
    PolygonOverlap overlap_;
    std::array<Vec2, 2> points_;
};

class SinglePolygonDistanceSolver {
public:
    SinglePolygonDistanceSolver(std::size_t largest_a, std::size_t largest_b) : pair_(largest_a, largest_b) {}

    /// As `PolygonDistanceSolver`; what is not proven to be apart counts as meeting.
    PolygonDistance solve(Ring a, Ring b, bool penetration);

private:
    SinglePair pair_;
    PolygonOverlap overlap_;
};

}  // namespace geomsrv
