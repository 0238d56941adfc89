// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
// Where the vertices of a body are that turns at a constant rate about a centre: in double and in
// double-double arithmetic, each with a proven error.
//
//     x(t) = c + v t + R(w t) (x0 - c),     R(w t) r = cos r + sin (k x r) + (1 - cos) (k . r) k,   k = w /
//     |w|
//
// Sine and cosine are our own: those of the system's library differ in their last bits between processors.
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "geom/core.hpp"
#include "geom/double_double.hpp"
#include "geom/power_of_two.hpp"
#include "geom/vec.hpp"

namespace geomsrv {

/// A body as the caller lists it, at time 0, and how it moves; all in the world frame.
struct TurningBody {
    const double* rows = nullptr;  ///< vertices, `dimension` numbers each [m]; of a box its centre
    std::size_t count = 0;         ///< of vertices
    int dimension = 3;
    const double* axes = nullptr;  ///< of a box: 3 rows, else nullptr
    const double* half = nullptr;  ///< of a box: 3 half extents [m]
    Vec3 velocity;                 ///< of the centre [m/s]
    Vec3 angular;                  ///< [rad/s]
    Vec3 center;                   ///< the point it turns about [m]
};

// A vertex in doubles, relative to the centre it turns about, is off by less than this times its distance
// from that: an entry of R takes sine and cosine (kTurnError each, at most twice), an axis good to 2 u and 6
// roundings, 20 u in all; three entries in a row make sqrt(3) of it for each of three coordinates, 60 u for
// the vector; products and sums of the rows 6 u more, the arm rounded to double 1 u.
inline constexpr double kPlaceError = 72 * kUnitRoundoff;

// Sine and cosine in doubles: the sum of the series rounds by 2 u, the second order of the angle's low part
// adds less than u.
inline constexpr double kTurnError = 4 * kUnitRoundoff;

// The same in double-double: some 2^10 operations of 2^-102 each.
inline constexpr double kWidePlaceError = 0x1p-92;

// Of the angle itself: |w| is off by 2^-100 of its size, the product with t and the reduction by whole
// quarters add 2^-100 each.
inline constexpr double kWideAngleError = 0x1p-98;

/// One body in motion, relative to the point it turns about; lengths times a power of two.
class TurningVertices {
public:
    /// Reads the body; nothing is scaled yet.
    void read(const TurningBody& body);
    /// Multiplies all lengths.
    void scale(PowerOfTwo by);

    /// Into `placed()`, at time t.
    void place(double t);
    /// A vertex at time t, see wide_error; after `turn_wide(t)`.
    [[nodiscard]] WideVec3 placed_wide(std::size_t i) const;
    void turn_wide(double t);

    /// Whether the angle turned through until then can still be told.
    [[nodiscard]] bool placeable(double t) const;

    /// Hull of the vertices about the centre, at the time of the last `place`.
    [[nodiscard]] Core core() const;
    /// How far `placed_wide` may be off at time t.
    [[nodiscard]] double wide_error(double t) const;
    [[nodiscard]] double error() const { return turns_ ? kPlaceError * reach_ : kUnitRoundoff * reach_; }

    [[nodiscard]] std::size_t size() const { return count_; }
    [[nodiscard]] Vec3 placed(std::size_t i) const {
        return {placed_[i], placed_[count_ + i], placed_[2 * count_ + i]};
    }
    [[nodiscard]] const double* coordinates() const { return placed_.data(); }
    [[nodiscard]] double reach() const { return reach_; }  ///< no vertex is further from the centre
    [[nodiscard]] Vec3 angular() const { return angular_; }
    [[nodiscard]] double speed() const { return speed_.hi; }  ///< |w|, off by u of it
    [[nodiscard]] DoubleDouble wide_speed() const { return speed_; }

private:
    std::vector<WideVec3> arms_;  ///< from the centre to the vertices at time 0
    std::vector<double> placed_;  ///< count x, count y, count z
    std::size_t count_ = 0;
    double reach_ = 0.0;
    bool turns_ = false;
    Vec3 angular_;
    DoubleDouble speed_;
    WideVec3 axis_;
    std::array<WideVec3, 3> wide_rotation_;  ///< rows
};

}  // namespace geomsrv
