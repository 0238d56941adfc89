// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
// When bounding volumes in translation can be in contact, by bounds alone.  What encloses a body lives with
// its kind.
#pragma once

#include <algorithm>
#include <limits>

#include "geom/rounding.hpp"

namespace geomsrv {

/// Bounds of a difference of velocities.
struct Rate {
    double least, most;
};

inline Rate rate_of(double from, double to) {
    // At rest nothing moves.
    return from == to ? Rate{0.0, 0.0} : Rate{next_down(to - from), next_up(to - from)};
}

/// When volumes can be in contact.
struct Span {
    double enter = 0.0;
    double leave = std::numeric_limits<double>::infinity();

    /// A gap of at least so much closes at a rate of at most so much.
    void clip(double gap, double rate) {
        if (gap > 0.0) {
            enter = std::max(enter, rate > 0.0 ? next_down(gap / rate) : 0.0);
            leave = rate > 0.0 ? leave : -1.0;
        } else if (rate < 0.0) {
            leave = std::min(leave, next_up(gap / rate));
        }
    }
};

}  // namespace geomsrv
