// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
// Axis-aligned boxes around objects, now and on their way: never too small, rounding included.
#pragma once

#include <cmath>

#include "geom/rounding.hpp"
#include "geom/vec.hpp"

namespace geomsrv {

struct Aabb {
    double lower[3], upper[3];  ///< may be infinite
};

/// What a shape lies in, in its own frame: the box center +- half, grown by `round` on all sides.
struct ShapeBounds {
    const double* center;
    const double* half;
    double round;
};

/// Around a shape with the given rotation (nine numbers, by rows) and position, and `grow` more on all sides.
/// `rounding`: of a face, relative to the magnitudes of the terms that it is the sum of.
///
///     face = (R c + p) +- (|R| h + round)
inline Aabb placed_box(const ShapeBounds& shape, const double* rotation, const double* position, double grow,
                       double rounding, double underflow) {
    Aabb box;
    for (int k = 0; k < 3; ++k) {
        const double* const row = rotation + 3 * k;
        double offset = 0.0, half = 0.0, reach = 0.0;
        for (int i = 0; i < 3; ++i) {
            offset += row[i] * shape.center[i];
            half += std::fabs(row[i]) * shape.half[i];
            reach += std::fabs(row[i] * shape.center[i]);
        }
        half += shape.round + grow;
        half += rounding * (std::fabs(position[k]) + reach + half) + underflow;
        const double center = position[k] + offset;
        box.lower[k] = center - half;
        box.upper[k] = center + half;
    }
    return box;
}

/// How an object goes on for a while.
struct Sweep {
    const double* position;
    const double* velocity;
    bool turns;    ///< somehow about its position, from which it reaches as far as `reach`
    double reach;  ///< uncertainty included
    double drift;  ///< by how much its velocity may be off
};

/// Around all that an object in `now` passes through within `horizon` >= 0; at 0 that is however it turns.
inline Aabb swept_box(Aabb now, const Sweep& sweep, double horizon, double rounding) {
    const double drift = sweep.drift > 0.0 ? sweep.drift * horizon : 0.0;
    for (int k = 0; k < 3; ++k) {
        double& low = now.lower[k];
        double& high = now.upper[k];
        if (sweep.turns) {
            const double margin = sweep.reach * (1.0 + rounding) + rounding * std::fabs(sweep.position[k]);
            low = sweep.position[k] - margin;
            high = sweep.position[k] + margin;
        }
        if (drift > 0.0) {
            low = next_down(low - drift);
            high = next_up(high + drift);
        }
        if (sweep.velocity[k] == 0.0) continue;
        const double path = sweep.velocity[k] * horizon;
        // One rounding for the product, one for the sum.
        const double slack = std::isinf(path) ? 0.0 : 4.0 * kUnitRoundoff * std::fabs(path);
        if (path > 0.0) {
            high = next_up(high + slack + path);
        } else {
            low = next_down(low - slack + path);
        }
    }
    return now;
}

}  // namespace geomsrv
