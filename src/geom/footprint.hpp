// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
// When a footprint that drives along an arc first meets points: in closed form.
//
// In the robot's frame a point at rest runs along a circle.  Above the line of an edge with outward normal n,
// n . x = d, its height is f(t) = n . x(t) - d; with r = w / tan(w t / 2), which falls from +inf to -inf
// within one period,
//
//     f(t) (r^2 + w^2) = g r^2 + 2 B r + a,    g = f(0), B = f'(0), a = w^2 f(half a period)
//
// and without turning (w = 0, r = 2 / t) the same with a = 0.  No centre of the circle appears, which would
// be far away for a small w.  The point is in the footprint where all these parabolas are <= 0.
#pragma once

#include <cstddef>
#include <vector>

#include "geom/polygon.hpp"
#include "geom/turning.hpp"
#include "geom/vec.hpp"

namespace geomsrv {

/// A robot's velocity, in its own frame: x and y of its origin, and its yaw rate.
struct Twist2 {
    Vec2 linear;           ///< [m/s]
    double angular = 0.0;  ///< [rad/s]
};

struct PointContact {
    TurningStatus status = TurningStatus::not_converged;
    double lower = 0.0;   ///< [s]; NaN for never
    double upper = 0.0;   ///< [s]; infinite where no contact is proven
    bool closed = false;  ///< decided in closed form
};

/// A convex footprint in motion.  The ring must outlive it.  Holds scratch memory.
class Footprint {
public:
    Footprint(Ring ring, const Twist2& twist);

    /// First contact within [0, t_max] with a point that moves at a constant velocity; point and velocity in
    /// the robot's frame at the start.  In closed form if that finds it to `tolerance` [s], else as turning
    /// bodies.
    PointContact solve(Vec2 point, Vec2 velocity, double t_max, double tolerance);

private:
    struct Edge {
        Vec2 from;
        Vec2 along;
        double size;  ///< |x| + |y|
    };
    struct Gap {
        double end;
        double begin;  ///< in time, so it is the larger one
    };
    struct Course;  // how the point moves

    bool closed_form(Vec2 point, Vec2 velocity, double t_max, PointContact& out);
    double first(const Course& course, double side);
    void turning(Vec2 point, Vec2 velocity, double t_max, double tolerance, PointContact& out);

    Ring ring_;
    Twist2 twist_;
    double reach_ = 0.0;  ///< the largest |coordinate|
    std::vector<Edge> edges_;
    std::vector<Gap> gaps_;
    TurningSolver solver_;
};

/// The point that a twist turns about, rounded, and by how much the velocities of a body that turns about it
/// may be off; REQUIRES: the twist turns.
struct TurningCenter {
    Vec2 point;
    double drift = 0.0;  ///< [m/s]
};
TurningCenter turning_center(const Twist2& twist);

/// Time of one full turn, rounded up: what is at rest and was not met until then never will be.
double period_of(const Twist2& twist);

}  // namespace geomsrv
