// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
#include "geom/segment_segment.hpp"

#include <algorithm>
#include <cmath>

#include "geom/convex_convex.hpp"

namespace geomsrv {

namespace {

struct Parameters {
    double s = 0.0;  ///< point of a: center + s g, -1 <= s <= 1
    double t = 0.0;
};

/// x clamped so that center + x g is the point of a segment nearest to another point.
double nearest_parameter(double along, double squared) {
    return squared > 0.0 ? std::clamp(along / squared, -1.0, 1.0) : 0.0;
}

}  // namespace

// Book section 10.8.2, from the middles of the segments, with the sign and the parallel branch mended.  The
// determinant |g x h|^2 and the numerators are formed from the cross product: from dot products they cancel
// down to noise near parallel directions.  Clamping s, then t, then s again is exact unless the directions
// are so nearly parallel that s is noise; the certificate then fails and the nearest of the four end points
// is tried, and if that is not it either, the general method.
template <class Body>
CoreSeparation segment_segment(const Body& a, const Body& b) {
    const Vec3 g = widened(a.generator[0]);
    const Vec3 h = widened(b.generator[0]);
    const Vec3 middle = widened(b.center) - widened(a.center);
    const double gg = dot(g, g);
    const double hh = dot(h, h);
    const double gh = dot(g, h);
    const Vec3 across = cross(g, h);
    const double determinant = dot(across, across);

    const auto t_of = [&](double s) { return nearest_parameter(s * gh - dot(middle, h), hh); };
    const auto s_of = [&](double t) { return nearest_parameter(t * gh + dot(middle, g), gg); };
    const auto certified = [&](Parameters p) {
        Vec3 gap = middle + p.t * h - p.s * g;
        const bool inner_s = gg > 0.0 && std::abs(p.s) < 1.0;
        const bool inner_t = hh > 0.0 && std::abs(p.t) < 1.0;
        if (inner_s && inner_t && determinant > 0.0) {
            // Perpendicular to both, exactly where it matters most: where the gap is short.
            gap = dot(gap, across) < 0.0 ? -across : across;
        } else if (inner_s) {
            gap = gap - (dot(gap, g) / gg) * g;
        } else if (inner_t) {
            gap = gap - (dot(gap, h) / hh) * h;
        }
        const bool meet = gap.x == 0.0 && gap.y == 0.0 && gap.z == 0.0;
        const Vec3 normal = !meet               ? normalized(gap)
                            : determinant > 0.0 ? normalized(across)
                                                : perpendicular(gg > hh ? g : h);
        CoreSeparation out =
            certify_apart(a, b, normal, widened(a.center) + p.s * g, widened(b.center) + p.t * h);
        out.stage = Stage::closed_form;
        return out;
    };

    Parameters p;
    p.s = determinant > 0.0 ? std::clamp(dot(cross(middle, h), across) / determinant, -1.0, 1.0) : 0.0;
    p.t = t_of(p.s);
    p.s = s_of(p.t);
    CoreSeparation best = certified(p);
    for (const double end : {-1.0, 1.0}) {
        for (const bool of_a : {true, false}) {
            if (best.converged) {
                return best;
            }
            const Parameters q = of_a ? Parameters{end, t_of(end)} : Parameters{s_of(end), end};
            const CoreSeparation other = certified(q);
            if (other.upper - other.lower < best.upper - best.lower) {
                best = other;
            }
        }
    }
    return best.converged ? best : convex_convex(a, b, true);
}

template CoreSeparation segment_segment(const Core&, const Core&);
template CoreSeparation segment_segment(const SingleCore&, const SingleCore&);

}  // namespace geomsrv
