// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
// Nearest points of two convex polytopes by the algorithm of Gilbert, Johnson and Keerthi (1988); book
// sections 6.10 and 10.12 sketch it.  It descends on the difference K = {q - p : p in a, q in b}: their
// distance is that of K from the origin, and they meet where K holds the origin.
#pragma once

#include "geom/core.hpp"
#include "geom/separation.hpp"
#include "geom/single_core.hpp"

namespace geomsrv {

enum class GjkState : std::uint8_t {
    apart,     ///< length - gap <= kMeetingGap * size: nearest points found (touching included)
    enclosed,  ///< four vertices of K hold the origin strictly inside, by more than rounding: the bodies
               ///< overlap
    contact,   ///< the points coincide to rounding, but no direction was found that separates there
    stalled,   ///< no progress in this arithmetic; the best direction and points still bound the distance
};

struct Gjk {
    GjkState state = GjkState::stalled;
    Vec3 normal;  ///< unit, direction of the largest gap seen, from a to b
    double gap = -std::numeric_limits<double>::infinity();    ///< along `normal`, see separation.hpp
    double length = std::numeric_limits<double>::infinity();  ///< |point_b - point_a|
    Vec3 point_a;  ///< witness points of the two cores; a common point if enclosed
    Vec3 point_b;
    Witness witness;
    double margin = 0.0;  ///< if enclosed: smallest of the determinants that say so, less their rounding
    int iterations = 0;
};

/// From the middle of a to that of b, where they differ.
Vec3 first_direction(const Core& a, const Core& b);
Vec3 first_direction(const SingleCore& a, const SingleCore& b);

/// In double arithmetic, from the direction `start` (unit).
Gjk gjk(const Core& a, const Core& b, Vec3 start);

/// The same from where the bodies were nearest when last seen, if `from` says so; sooner there if they have
/// moved little.
Gjk gjk(const Core& a, const Core& b, Vec3 start, const Witness& from);

/// In single precision.
Gjk gjk(const SingleCore& a, const SingleCore& b, Vec3 start);

/// In double-double arithmetic, for what doubles cannot finish: needles and slivers.
Gjk gjk_wide(const Core& a, const Core& b, Vec3 start);

/// In double arithmetic on vertices and supports of single precision.
Gjk gjk_wide(const SingleCore& a, const SingleCore& b, Vec3 start);

}  // namespace geomsrv
