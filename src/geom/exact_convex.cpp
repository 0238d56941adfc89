// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
#include "geom/exact_convex.hpp"

#include "geom/convex_convex.hpp"
#include "geom/exact_axes.hpp"
#include "geom/exact_gjk.hpp"
#include "geom/exact_hull.hpp"
#include "geom/place.hpp"

namespace geomsrv {

namespace {

// A determinant of vertices of K, of size S at most and twice that apart, changes by less than this times
// their error times S^2: three vectors between them, each off by twice the error.
constexpr double kDeterminantShare = 16.0;

class Ladder {
public:
    Ladder(const ExactAndRough& a, const ExactAndRough& b, double scale, const Wanted& want)
        : a_(a),
          b_(b),
          scale_(scale),
          size_(a.rough.reach + b.rough.reach),
          error_(a.rough.error + b.rough.error),
          in_range_(scale == 1.0 && geomsrv::in_range(size_)),
          want_(want) {}

    CoreSeparation climb() const {
        const Gjk found = gjk(a_.rough, b_.rough, first_direction(a_.rough, b_.rough));
        if (surely_enclosed(found)) {
            return overlapping(found.witness, Rung::filter);
        }
        const bool zonotopes =
            a_.exact.kind == ExactBody::Kind::zonotope && b_.exact.kind == ExactBody::Kind::zonotope;
        if (zonotopes && !want_.simplex && !surely_apart(found)) {
            const ExactGap gap = largest_facet_gap(a_, b_, in_range_, want_.penetration);
            if (gap.found && gap.meet) {
                return deep(gap.gap, gap.normal, found.witness, gap.rung);
            }
        }
        const ExactSeparation s = exact_separation(a_, b_, found.witness, in_range_);
        if (s.meet) {
            return overlapping(s.simplex, s.rung);
        }
        CoreSeparation out = with_points(s.simplex);
        set(out, s.distance, s.normal, s.rung);
        out.simplex = s.simplex;
        return out;
    }

private:
    bool surely_enclosed(const Gjk& found) const {
        return found.state == GjkState::enclosed && found.margin > kDeterminantShare * error_ * size_ * size_;
    }

    bool surely_apart(const Gjk& found) const {
        return found.gap > kGapError * size_ + kGapScale * std::abs(found.gap) + error_;
    }

    CoreSeparation overlapping(const Witness& simplex, Rung rung) const {
        if (!want_.penetration) {
            return deep({}, nan_vector(), simplex, rung);
        }
        if (a_.exact.kind == ExactBody::Kind::zonotope && b_.exact.kind == ExactBody::Kind::zonotope) {
            const ExactGap gap = largest_facet_gap(a_, b_, in_range_, true);
            if (gap.found) {
                return deep(gap.gap, gap.normal, simplex, std::max(rung, gap.rung));
            }
        }
        const ExactDepth depth = exact_depth(a_, b_, simplex, scale_, in_range_);
        const Rounding gap = {-depth.depth.nearest, -depth.depth.upper, -depth.depth.lower};
        return deep(gap, depth.normal, simplex, std::max(rung, depth.rung), depth.foot);
    }

    /// Bodies that meet; `simplex` holds their common point, `foot` the deepest ones if known.
    CoreSeparation deep(const Rounding& gap, Vec3 normal, const Witness& simplex, Rung rung,
                        const Witness& foot = {}) const {
        CoreSeparation out = with_points(foot.count > 0 ? foot : simplex);
        if (!want_.penetration) {
            set(out, {}, nan_vector(), rung);
        } else {
            if (foot.count == 0 && gap.nearest < 0.0) {
                const Gjk deepest = points_along(a_.rough, b_.rough, normal);
                out = with_points(deepest.witness);
            }
            set(out, gap, normal, rung);
        }
        out.simplex = simplex;
        return out;
    }

    CoreSeparation with_points(const Witness& s) const {
        CoreSeparation out;
        out.witness = s;
        const double unit = 1.0 / scale_;
        for (int i = 0; i < s.count; ++i) {
            out.point_a = out.point_a + (unit * s.weight[i]) * vertex_of(a_.rough, s.a[i]);
            out.point_b = out.point_b + (unit * s.weight[i]) * vertex_of(b_.rough, s.b[i]);
        }
        return out;
    }

    static void set(CoreSeparation& out, const Rounding& gap, Vec3 normal, Rung rung) {
        out.value = gap.nearest + 0.0;  // no negative zero
        out.lower = gap.lower + 0.0;
        out.upper = gap.upper + 0.0;
        out.normal = normal;
        out.converged = true;
        out.stage = Stage::exact;
        out.rung = rung;
    }

    const ExactAndRough& a_;
    const ExactAndRough& b_;
    double scale_;
    double size_;
    double error_;
    bool in_range_;
    Wanted want_;
};

}  // namespace

CoreSeparation exact_convex_convex(const ExactAndRough& a, const ExactAndRough& b, double scale,
                                   const Wanted& want) {
    return Ladder(a, b, scale, want).climb();
}

}  // namespace geomsrv
