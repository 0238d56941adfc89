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
#include "geom/vec.hpp"

namespace geomsrv {

/// One polygon of a pair, in lengths of up to about 2.  Arrays are padded to whole lanes.
struct SinglePolygon {
    std::size_t vertices = 0;
    std::size_t edges = 0;  ///< as in `PairedPolygon`
    std::size_t axes = 0;
    float* x = nullptr;  ///< vertices, then the tips'
    float* y = nullptr;
    float* dx = nullptr;  ///< outward axes; zero beyond `axes`
    float* dy = nullptr;
    float* gap = nullptr;  ///< support of the other polygon minus own; -1 beyond `axes`
};

class SinglePair {
public:
    SinglePair(std::size_t largest_a, std::size_t largest_b);

    void load(Ring a, Ring b);

    [[nodiscard]] const SinglePolygon& side(int i) const { return sides_[static_cast<std::size_t>(i)]; }
    [[nodiscard]] const PolygonPair& places() const { return places_; }
    /// The same pair in double, gaps and all.
    const PolygonPair& in_double(Ring a, Ring b) {
        places_.load(a, b);
        return places_;
    }
    /// Lengths are the given ones times 2^exponent.
    [[nodiscard]] int exponent() const { return exponent_; }
    /// Error of `gap` relative to |D|_1; add kSingleUnderflow.
    [[nodiscard]] float gap_error() const { return gap_error_; }
    /// Largest |local coordinate|.
    [[nodiscard]] float reach() const { return reach_; }
    /// A local place, in given coordinates.
    [[nodiscard]] Vec2 given(float x, float y) const;

private:
    PolygonPair places_;
    std::array<SinglePolygon, 2> sides_;
    std::vector<float> storage_;
    int exponent_ = 0;
    float gap_error_ = 0.0F;
    float reach_ = 0.0F;
};

class SingleFirstContactSolver {
public:
    SingleFirstContactSolver(std::size_t largest_a, std::size_t largest_b) : pair_(largest_a, largest_b) {}

    /// As `FirstContactSolver`, without slack for rounding of the input: what is not excluded counts as
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
};

}  // namespace geomsrv
