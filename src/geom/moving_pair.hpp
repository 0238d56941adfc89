// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
// Two translating convex polytopes, by the caller's numbers and rounded in a frame of their own.
//
// With w the velocity of b relative to a, they have a common point at time t iff -t w is in the difference
// K = {q - p : p in a, q in b}: a line through the origin is clipped against K.
#pragma once

#include <cstddef>
#include <vector>

#include "geom/core.hpp"
#include "geom/exact_body.hpp"
#include "geom/vec.hpp"

namespace geomsrv {

/// A box (zonotope) or a hull without rotation, and its constant velocity [m/s]; world frame.
struct MovingBody {
    ExactBody body;
    Vec3 velocity;
};

/// Times in seconds from times in the units of a pair: a power of two, so only subnormal results are rounded.
struct Seconds {
    int exponent = 0;

    [[nodiscard]] double nearest(double t) const;
    [[nodiscard]] double inverse(double t) const;
    [[nodiscard]] double inverse_up(double t) const;  ///< t >= 0
    [[nodiscard]] double down(double t) const;        ///< t >= 0
    [[nodiscard]] double up(double t) const;
};

/// Holds the rounded vertices of polytopes of at most so many.
class MovingPair {
public:
    MovingPair(std::size_t most_a, std::size_t most_b);

    void load(const MovingBody& a, const MovingBody& b);

    [[nodiscard]] const MovingBody& given_a() const { return *given_a_; }
    [[nodiscard]] const MovingBody& given_b() const { return *given_b_; }

    /// Vertices of hulls are padded to whole lanes: those beyond the listed ones repeat the last.
    [[nodiscard]] const Core& a() const { return a_; }
    [[nodiscard]] const Core& b() const { return b_; }
    [[nodiscard]] double reach() const { return a_.reach + b_.reach; }

    /// w, each component off by kUnitRoundoff of itself; (-1, 0, 0) for bodies at rest to each other.
    [[nodiscard]] Vec3 velocity() const { return velocity_; }
    [[nodiscard]] bool at_rest() const { return at_rest_; }
    [[nodiscard]] double speed() const { return speed_; }  ///< |w|, off by 4 u

    /// How far rounding of the input may have moved the bodies against each other; what it may have done to
    /// w.
    [[nodiscard]] double noise() const { return noise_; }
    [[nodiscard]] double velocity_noise() const { return velocity_noise_; }

    [[nodiscard]] Seconds seconds() const { return {speed_exponent_ - length_exponent_}; }
    /// Where a body is at a time in the units of the pair, from where it starts; world frame.
    [[nodiscard]] Vec3 way(const MovingBody& body, double moment) const;
    /// Lengths are multiplied by this power of two.
    [[nodiscard]] double scale() const { return scale_; }
    /// What the vertices are relative to, world frame.
    [[nodiscard]] Vec3 origin() const { return origin_; }
    /// Double-double is worth trying on the given numbers: neither they nor products of some overflow.
    [[nodiscard]] bool ordinary() const { return ordinary_; }

private:
    void place(double scale);
    void set_motion();

    const MovingBody* given_a_ = nullptr;
    const MovingBody* given_b_ = nullptr;
    Core a_;
    Core b_;
    Vec3 origin_;
    double scale_ = 1.0;
    int length_exponent_ = 0;
    double largest_ = 0.0;
    Vec3 velocity_;
    double speed_ = 0.0;
    int speed_exponent_ = 0;
    bool at_rest_ = false;
    double noise_ = 0.0;
    double velocity_noise_ = 0.0;
    bool ordinary_ = true;
    std::vector<double> points_a_;
    std::vector<double> points_b_;
};

// No slack exceeds this part of the reach (or of the speed), so separations, angles and overlaps that are
// larger are always told apart, however far from the origin.
inline constexpr double kLargestSlack = 0x1p-42;

}  // namespace geomsrv
