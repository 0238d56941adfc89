// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
#include "geom/curved_distance.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "geom/convex_convex.hpp"
#include "geom/exact_body.hpp"
#include "geom/gjk.hpp"
#include "geom/growing_hull.hpp"
#include "geom/revolved_distance.hpp"

namespace geomsrv {

namespace {

// Each round adds a point where the bodies are nearest; the gap then shrinks by more than half, and mostly by
// far more.  What needs more than this is stuck in rounding.
constexpr int kMaxRounds = 60;
constexpr int kSeeds = 8;

// Points nearer to each other than this times S leave few digits to a direction from one to the other;
// whether bodies of which nothing else is known overlap is then better asked of the hull of the difference.
constexpr double kDoubtful = 0x1p-32;

// Where nothing better is known, axes may lean by any angle up to this [rad]: what it costs is in the
// interval.
constexpr double kAnyLean = 1.0;

/// The hull of points of a body, and the body itself.
class Side {
public:
    explicit Side(const MaybeCurved& body) : body_(body) {
        whole_.curved = body.curved;
        whole_.polytope = body.polytope;
        whole_.reach = body.curved != nullptr ? body.curved->reach : body.polytope->reach;
        whole_.error = body.curved != nullptr ? body.curved->error : body.polytope->error;
        if (body.curved == nullptr) {
            inner_ = *body.polytope;
            return;
        }
        found_.reserve(kMaxRounds + kSeeds);
        whole_.found = &found_;
        const CurvedBody& c = *body.curved;
        const auto add = [&](double x, double y, double z) {
            const Vec3 own{x * c.half[0], y * c.half[1], z * c.half[2]};
            found_.push_back(c.center + c.rotation * own);
        };
        if (c.kind == ShapeKind::ellipsoid) {
            for (const double s : {1.0, -1.0}) {
                add(s, 0.0, 0.0);
                add(0.0, s, 0.0);
                add(0.0, 0.0, s);
            }
        } else {
            for (const double s : {1.0, -1.0}) {
                add(s, 0.0, -1.0);
                add(0.0, s, -1.0);
                if (c.kind == ShapeKind::cylinder) {
                    add(s, 0.0, 1.0);
                    add(0.0, s, 1.0);
                }
            }
            if (c.kind == ShapeKind::cone) {
                add(0.0, 0.0, 1.0);
            }
        }
        lay_out();
    }
    Side(const Side&) = delete;
    Side& operator=(const Side&) = delete;

    const MaybeCurved& body() const { return body_; }
    const SupportedCore& whole() const { return whole_; }
    /// The same, to look at supports that are not kept.
    SupportedCore glance() const {
        SupportedCore out = whole_;
        out.found = nullptr;
        return out;
    }
    const Core& inner() const { return inner_; }

    /// The hull of all points found.
    void lay_out() {
        if (body_.curved == nullptr) {
            return;
        }
        const std::size_t n = found_.size();
        rows_.resize(3 * n);
        for (std::size_t i = 0; i < n; ++i) {
            rows_[i] = found_[i].x;
            rows_[n + i] = found_[i].y;
            rows_[2 * n + i] = found_[i].z;
        }
        inner_.points = rows_.data();
        inner_.count = static_cast<int>(n);
        inner_.reach = whole_.reach;
    }

private:
    MaybeCurved body_;
    SupportedCore whole_;
    std::vector<Vec3> found_;
    std::vector<double> rows_;
    Core inner_;
};

Gjk solved(const Core& a, const Core& b, Vec3 start) {
    Gjk found = gjk(a, b, start);
    if (found.state == GjkState::stalled) {
        Gjk wide = gjk_wide(a, b, found.normal);
        wide.iterations += found.iterations;
        if (wide.state != GjkState::stalled || wide.length - wide.gap < found.length - found.gap) {
            return wide;
        }
    }
    return found;
}

Vec3 middle_of(const MaybeCurved& body) {
    return body.curved != nullptr ? body.curved->center : body.polytope->center;
}

// A rotation matrix of a unit quaternion shrinks no length by more than this, see place.cpp; and the radius
// of a ball is made of a few roundings.
constexpr double kShrunk = 1.0 - 256 * kUnitRoundoff;

/// Upper bound of the signed distance that four differences of points prove which hold the origin.
double enclosed_by(const Side& a, const Side& b, const Gjk& found) {
    if (found.state != GjkState::enclosed) {
        return std::numeric_limits<double>::infinity();
    }
    Vec3 w[4];
    for (int i = 0; i < 4; ++i) {
        w[i] = vertex_of(b.inner(), found.witness.b[i]) - vertex_of(a.inner(), found.witness.a[i]);
    }
    // The origin is behind each face by more than the margin over twice the area of the face.
    double area = 0.0;
    for (int i = 0; i < 4; ++i) {
        const Vec3 p = w[(i + 1) & 3];
        area = std::max(area, norm(cross(w[(i + 2) & 3] - p, w[(i + 3) & 3] - p)));
    }
    const double size = a.whole().reach + b.whole().reach;
    const double rounding = kCurvedCoarseness * kVertexError * size + a.whole().error + b.whole().error;
    return rounding - kShrunk * (found.margin / area);
}

/// What a distance of points proves from above.
double length_at_most(double length, double size) {
    return length * (1.0 + kGapScale) + kCurvedCoarseness * kMemberError * size;
}

// The bounds of curved bodies have met as those of polytopes have, with as much more rounding in them.
constexpr double kMet = kCurvedCoarseness * kMeetingGap;

/// Radius of a ball about the center of a body that is known to be in it.
double ball_in(const MaybeCurved& body) {
    if (body.curved == nullptr) {
        return 0.0;
    }
    const double* half = body.curved->half;
    if (body.curved->kind != ShapeKind::cone) {
        return kShrunk * std::min({half[0], half[1], half[2]});
    }
    // The side passes the center at half the radius of the base.
    const double side = std::sqrt(4 * half[2] * half[2] + half[0] * half[0]);
    return side > 0.0 ? kShrunk * std::min(half[2], half[0] * (half[2] / side)) : 0.0;
}

/// Depth that the balls in both bodies prove, along the line of the centers or an axis of a body: so it is
/// for balls, and for concentric bodies that are thinnest along the same axis.  Not converged for others.
CoreSeparation depth_by_balls(const Side& a, const Side& b, const Gjk& start) {
    const double size = a.whole().reach + b.whole().reach;
    const Vec3 apart = middle_of(b.body()) - middle_of(a.body());
    const double balls = ball_in(a.body()) + ball_in(b.body());
    const double upper = norm(apart) - balls + kCurvedCoarseness * kGapError * size;
    CoreSeparation out;
    if (upper >= 0.0) {
        return out;
    }
    double best = -std::numeric_limits<double>::infinity();
    Vec3 normal;
    const auto look = [&](Vec3 n) {
        const double gap = lowest(b.glance(), n).value - highest(a.glance(), n).value;
        if (gap > best) {
            best = gap;
            normal = n;
        }
    };
    if (!is_zero(apart)) {
        look(normalized(apart));
    }
    for (const CurvedBody* curved : {a.body().curved, b.body().curved}) {
        for (int k = 0; curved != nullptr && k < 3; ++k) {
            const Mat3& r = curved->rotation;
            const Vec3 axis = normalized(k == 0   ? Vec3{r.row[0].x, r.row[1].x, r.row[2].x}
                                         : k == 1 ? Vec3{r.row[0].y, r.row[1].y, r.row[2].y}
                                                  : Vec3{r.row[0].z, r.row[1].z, r.row[2].z});
            look(axis);
            look(-axis);
        }
    }
    out = certify_deep(a.glance(), b.glance(), normal, start.point_a, start.point_b, upper);
    if (out.converged) {
        const Vec3 touch = middle_of(a.body()) + (ball_in(a.body()) / kShrunk) * normal;
        out.point_a = a.body().curved != nullptr ? touch : middle_of(a.body());
        out.point_b = out.point_a + best * normal;
    }
    out.stage = Stage::closed_form;
    return out;
}

CoreSeparation depth(Side& a, Side& b, const Gjk& start) {
    CoreSeparation out = depth_by_balls(a, b, start);
    if (out.converged) {
        return out;
    }
    const double size = a.whole().reach + b.whole().reach;
    double apart_at_most = length_at_most(start.length, size);
    const NearestFacet facet =
        nearest_facet(a.whole(), b.whole(), start.state == GjkState::enclosed ? start.witness : Witness{});
    if (facet.flat) {
        out = certify_deep(a.whole(), b.whole(), facet.normal, start.point_a, start.point_b, apart_at_most);
    } else {
        a.lay_out();
        b.lay_out();
        if (facet.upper < 0.0) {
            out = certify_deep(a.whole(), b.whole(), facet.normal, facet.point_a, facet.point_b, facet.upper);
            if (!facet.foot) {
                const Gjk deepest = points_along(a.inner(), b.inner(), out.normal);
                out.point_a = deepest.point_a;
                out.point_b = deepest.point_b;
            }
        } else {
            // No overlap is proven, but there are more points now.
            const Gjk near = solved(a.inner(), b.inner(), facet.normal);
            apart_at_most = std::min(apart_at_most, length_at_most(near.length, size));
            out = certify_deep(a.whole(), b.whole(), facet.normal, near.point_a, near.point_b, apart_at_most);
        }
    }
    out.iterations = start.iterations + facet.iterations;
    out.stage = Stage::hull;
    if (out.outcome == Outcome::ok) {
        return out;
    }
    // Of axes that almost are parallel the lean may leave less open than the hull.
    std::optional<CoreSeparation> revolved = revolved_distance(a.body(), b.body(), true, kAnyLean);
    if (!revolved || revolved->upper - revolved->lower >= out.upper - out.lower) {
        return out;
    }
    revolved->outcome = Outcome::not_converged;
    return *revolved;
}

}  // namespace

CoreSeparation curved_distance(const MaybeCurved& body_a, const MaybeCurved& body_b, bool penetration) {
    if (const auto revolved = revolved_distance(body_a, body_b, penetration)) {
        return *revolved;
    }
    Side a(body_a);
    Side b(body_b);
    const double size = a.whole().reach + b.whole().reach;
    const Vec3 apart = middle_of(body_b) - middle_of(body_a);
    Vec3 normal = is_zero(apart) ? Vec3{1.0, 0.0, 0.0} : normalized(apart);
    Vec3 best_normal = normal;
    double best_gap = -std::numeric_limits<double>::infinity();
    Gjk found;
    int iterations = 0;
    bool meet = false;
    bool met = false;
    bool asked = false;
    CoreSeparation doubt;
    for (int round = 0; round < kMaxRounds; ++round) {
        const Gjk last = found;
        found = solved(a.inner(), b.inner(), normal);
        iterations += found.iterations + 1;
        found.iterations = iterations;
        meet = found.state == GjkState::enclosed || found.state == GjkState::contact;
        if (meet) {
            break;
        }
        normal = found.normal;
        const double gap = lowest(b.whole(), normal).value - highest(a.whole(), normal).value;
        if (gap > best_gap) {
            best_gap = gap;
            best_normal = normal;
        }
        if (!asked && best_gap < 0.0 && found.length <= kDoubtful * size) {
            asked = true;
            doubt = depth(a, b, found);
            meet = doubt.outcome == Outcome::ok;
            if (meet) {
                break;
            }
        }
        if (found.length - best_gap <= kMet * size) {
            // Where the bounds have met, points and normal are good to half the digits; one more round makes
            // more of them.
            if (met || found.length == 0.0) {
                break;
            }
            met = true;
        } else if (met) {
            found = last;
            break;
        }
        a.lay_out();
        b.lay_out();
    }
    if (meet && !asked) {
        doubt = penetration ? depth(a, b, found) : doubt;
    }
    if (meet && penetration) {
        return doubt;
    }
    if (!meet && found.length > 0.0) {
        // If they do as well, the last normal, or the direction from one nearest point to the other.
        for (const Vec3 n : {found.normal, normalized(found.point_b - found.point_a)}) {
            const double gap = lowest(b.glance(), n).value - highest(a.glance(), n).value;
            best_normal = found.length - gap <= kMet * size ? n : best_normal;
        }
    }
    CoreSeparation out = certify_apart(a.whole(), b.whole(), best_normal, found.point_a, found.point_b);
    out.stage = Stage::gjk;
    out.iterations = iterations;
    if (meet) {
        const double enclosed = enclosed_by(a, b, found);
        // Points that coincide where nothing is enclosed yet: that the bodies share one is proven by their
        // depth.
        const double other = enclosed < 0.0 ? enclosed : asked ? doubt.upper : depth(a, b, found).upper;
        out.upper = std::min(out.upper, other);
        out.lower = std::min(out.lower, 0.0);
        out.value = 0.0;
        out.outcome = Outcome::ok;
        out.normal = nan_vector();
    } else if (asked && out.outcome != Outcome::ok) {
        out.lower = std::max(out.lower, doubt.lower);
        out.upper = std::min(out.upper, doubt.upper);
        out.value = std::clamp(out.value, out.lower, out.upper);
    }
    return out;
}

CoreSeparation curved_half_space(const CurvedBody& a, const PlacedHalfSpace& b, bool penetration) {
    std::vector<Vec3> found;
    SupportedCore whole;
    whole.curved = &a;
    whole.found = &found;
    whole.reach = a.reach;
    whole.error = a.error;
    return convex_half_space(whole, b, penetration);
}

}  // namespace geomsrv
