// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
#include "geom/polygon_marks.hpp"

namespace geomsrv {

std::span<const Vec2> contact_points(const PolygonPair& pair, const Motion& motion, const ContactMarks& marks,
                                     const std::array<Vec2, 2>& velocities, double moment, double time,
                                     std::array<Vec2, 2>& points) {
    const auto moved = [&](const Mark& mark) {
        const Vec2 from = pair.side(mark.side).ring[mark.vertex];
        const Vec2 velocity = velocities[static_cast<std::size_t>(mark.side)];
        if (motion.scale_exponent == 0 && pair.scale_exponent() == 0) {
            return from + time * velocity;
        }
        // The time in seconds may be subnormal, its product with a velocity beyond the doubles.
        const Vec2 way = moment * motion.scaled(velocity);
        return pair.moved(from, {way.x, 0.0}, {way.y, 0.0});
    };
    const bool one_vertex = marks.low.side == marks.high.side && marks.low.vertex == marks.high.vertex;
    const Vec2 low = moved(marks.low);
    const Vec2 high = moved(marks.high);
    points[0] = marks.segment || one_vertex ? low : 0.5 * low + 0.5 * high;
    points[1] = high;
    return {points.data(), marks.segment ? 2U : 1U};
}

}  // namespace geomsrv
