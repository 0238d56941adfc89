// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
#include "geom/polygon.hpp"

#include <algorithm>
#include <cmath>

#include "geom/exact_sign.hpp"

namespace geomsrv {

namespace {

constexpr bool same(Vec2 a, Vec2 b) { return a.x == b.x && a.y == b.y; }
constexpr bool before(Vec2 a, Vec2 b) { return a.x < b.x || (a.x == b.x && a.y < b.y); }

/// Largest |coordinate|.
double magnitude(Ring ring) {
    double largest = 0.0;
    for (const Vec2 v : ring) {
        largest = std::max({largest, std::fabs(v.x), std::fabs(v.y)});
    }
    return largest;
}

/// Direction in [0, 180) degrees.  A counter-clockwise turn of directions enters this half once per
/// revolution.
constexpr bool points_up(Vec2 edge) { return edge.y > 0.0 || (edge.y == 0.0 && edge.x > 0.0); }

struct Turning {
    bool left_only = true;  ///< every turn is in [0, 180) degrees, exactly
    int revolutions = 0;    ///< meaningful if left_only
};

/// Turns of a ring, exact; zero edges are skipped.
Turning turning(Ring ring) {
    Turning result;
    const std::size_t n = ring.size();
    // Start with the last edge that is not zero; a ring without one is a point, for which the loop below
    // finds nothing.
    std::size_t last = n - 1;
    while (last > 0 && same(ring[last], ring[0])) {
        --last;
    }
    Vec2 from = ring[last];
    Vec2 at = ring[0];
    Vec2 edge = at - from;
    bool up = points_up(edge);
    for (std::size_t i = 1; i <= n; ++i) {
        const Vec2 to = ring[i < n ? i : 0];
        if (same(to, at)) {
            continue;
        }
        const Vec2 next = to - at;
        const int turn = sign_of_cross(from, at, at, to);
        // Of two collinear edges the second goes on forward or folds back; their signs tell, and cannot
        // underflow.
        const bool forward = turn > 0 || (turn == 0 && ((edge.x > 0.0) == (next.x > 0.0)) &&
                                          ((edge.y > 0.0) == (next.y > 0.0)));
        result.left_only = result.left_only && forward;
        const bool next_up = points_up(next);
        result.revolutions += next_up && !up ? 1 : 0;
        up = next_up;
        edge = next;
        from = at;
        at = to;
    }
    return result;
}

struct OnEdge {
    bool found = false;
    double parameter = 0.0;
};

/// Least parameter in [start, 1] of a point of the segment p + t (q - p) within `tolerance` of v.
OnEdge first_near(Vec2 p, Vec2 q, double start, Vec2 v, double tolerance) {
    const Vec2 edge = q - p;
    const double squared_length = dot(edge, edge);
    const double nearest = std::clamp(dot(v - p, edge) / squared_length, start, 1.0);
    const Vec2 off = v - (p + nearest * edge);
    const double slack = tolerance * tolerance - dot(off, off);
    if (!(slack >= 0.0)) {
        return {};
    }
    return {true, std::max(start, nearest - std::sqrt(slack / squared_length))};
}

/// Index of the first vertex that cannot be placed, within `tolerance`, on one counter-clockwise walk around
/// the hull; ring.size() if there is none.  `step` is +1, or -1 to read the ring backwards.
std::size_t first_misplaced(Ring ring, Ring hull, double tolerance, std::ptrdiff_t step) {
    const auto n = static_cast<std::ptrdiff_t>(ring.size());
    std::ptrdiff_t anchor = 0;
    while (!same(ring[static_cast<std::size_t>(anchor)], hull[0])) {
        ++anchor;
    }
    std::size_t edge = 0;
    double parameter = 0.0;
    for (std::ptrdiff_t k = 0; k < n; ++k) {
        const std::ptrdiff_t i = ((anchor + step * k) % n + n) % n;
        // Taking the earliest place for every vertex leaves most room for the later ones.
        OnEdge place;
        while (edge < hull.size()) {
            const Vec2 p = hull[edge];
            const Vec2 q = hull[edge + 1 < hull.size() ? edge + 1 : 0];
            place = first_near(p, q, parameter, ring[static_cast<std::size_t>(i)], tolerance);
            if (place.found) {
                break;
            }
            ++edge;
            parameter = 0.0;
        }
        if (!place.found) {
            return static_cast<std::size_t>(i);
        }
        parameter = place.parameter;
    }
    return ring.size();
}

/// Extent across the longest chord from the first vertex.
double thickness(Ring hull) {
    Vec2 chord;
    for (const Vec2 v : hull) {
        if (dot(v - hull[0], v - hull[0]) > dot(chord, chord)) {
            chord = v - hull[0];
        }
    }
    double low = 0.0;
    double high = 0.0;
    for (const Vec2 v : hull) {
        const double height = cross(chord, v - hull[0]) / norm(chord);
        low = std::min(low, height);
        high = std::max(high, height);
    }
    return high - low;
}

double doubled_area(Ring ring) {
    double sum = 0.0;
    for (std::size_t i = 2; i < ring.size(); ++i) {
        sum += cross(ring[i - 1] - ring[0], ring[i] - ring[0]);
    }
    return sum;
}

}  // namespace

Ring StrictHull::of(Ring ring) {
    // Monotone chain (book section 13.7.1 builds hulls from sorted points too, but keeps collinear vertices).
    sorted_.assign(ring.begin(), ring.end());
    std::sort(sorted_.begin(), sorted_.end(), before);
    sorted_.erase(std::unique(sorted_.begin(), sorted_.end(), same), sorted_.end());
    if (sorted_.size() < 3) {
        return sorted_;
    }
    hull_.clear();
    const auto append = [this](Vec2 v, std::size_t floor) {
        while (hull_.size() > floor && orientation(hull_[hull_.size() - 2], hull_.back(), v) <= 0) {
            hull_.pop_back();
        }
        hull_.push_back(v);
    };
    for (const Vec2 v : sorted_) {
        append(v, 1);
    }
    const std::size_t lower = hull_.size();
    for (auto v = sorted_.rbegin() + 1; v != sorted_.rend(); ++v) {
        append(*v, lower);
    }
    hull_.pop_back();  // the first vertex, reached again
    return hull_;
}

RingReport RingChecker::check(Ring ring) {
    if (ring.size() <= 2) {
        return {};
    }
    const Turning turns = turning(ring);
    if (turns.left_only && turns.revolutions == 1) {
        return {};
    }
    return check_with_tolerance(ring, turns.left_only);
}

RingReport RingChecker::check_with_tolerance(Ring ring, bool turns_left_only) {
    const double largest = magnitude(ring);
    if (largest == 0.0) {
        return {};
    }
    // Coordinates in [-2, 2], so that no square overflows; what underflows is far below the tolerance.
    const int exponent = std::ilogb(largest);
    scaled_.resize(ring.size());
    std::transform(ring.begin(), ring.end(), scaled_.begin(), [exponent](Vec2 v) {
        return Vec2{std::scalbn(v.x, -exponent), std::scalbn(v.y, -exponent)};
    });
    const double tolerance = kRingTolerance * std::scalbn(largest, -exponent);
    const Ring hull = hull_.of(scaled_);
    // Without area there is nothing to be concave: the set is the segment (or point) its vertices span.
    if (hull.size() <= 2 || thickness(hull) <= tolerance) {
        return {};
    }

    const std::size_t misplaced = first_misplaced(scaled_, hull, tolerance, 1);
    if (misplaced == ring.size()) {
        return {};
    }
    if (turns_left_only) {
        return {RingFault::wound_more_than_once, -1};
    }
    const std::size_t reverse = first_misplaced(scaled_, hull, tolerance, -1);
    if (reverse == ring.size()) {
        return {RingFault::clockwise, -1};
    }
    return {RingFault::not_convex,
            static_cast<std::int64_t>(doubled_area(scaled_) < 0.0 ? reverse : misplaced)};
}

}  // namespace geomsrv
