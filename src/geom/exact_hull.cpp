// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
#include "geom/exact_hull.hpp"

#include <cmath>
#include <limits>
#include <tuple>

#include "geom/hull_surface.hpp"

namespace geomsrv {

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// Vertices of K in doubles: differences of rounded vertices, rounded once more.  The errors of the cores come
// on top.
constexpr double kDifferenceError = 2 * kVertexError + 2 * kUnitRoundoff;

// A determinant of three rounded differences is off by 8 u of its permanent (orientation_3d.cpp), which is at
// most the product of the rows' sums; the difference of two such products takes 6 u of the larger one.
constexpr double kSideError = 16 * kUnitRoundoff;

// Plane of three points in doubles: see growing_hull.cpp.
constexpr double kPlaneError = 6 * kUnitRoundoff;

// A facet is looked at again in more precision if its plane is less certain than this times the size.
constexpr double kPlaneDoubt = 64 * kUnitRoundoff;

// Beyond this the errors of a normal can no longer be added up to first order.
constexpr double kLargestTilt = 0x1p-4;

auto along_axis(Vec3 axis) {
    return [axis](auto number) { return exactly<decltype(number)>(axis); };
}

class ExactHull : private HullSurface<ExactHull> {
    friend class HullSurface<ExactHull>;

public:
    ExactHull(const ExactAndRough& a, const ExactAndRough& b, double scale, bool in_range)
        : k_(a, b, in_range),
          scale_(scale),
          size_(a.rough.reach + b.rough.reach),
          error_(kDifferenceError * size_ + a.rough.error + b.rough.error) {}

    ExactDepth nearest(const Witness& seed) {
        ExactDepth out;
        if (start(seed, out)) {
            search(out);
        }
        out.rung = k_.rung();
        return out;
    }

private:
    // ---- What the surface asks for ----

    int side(const HullFacet& f, const HullVertex& v) {
        const Vec3 e = w(f.vertex[1]) - w(f.vertex[0]);
        const Vec3 g = w(f.vertex[2]) - w(f.vertex[0]);
        const Vec3 h = v.w - w(f.vertex[0]);
        const double determinant = dot(cross(e, g), h);
        // Each of the three vectors is off by the errors of its ends; sums of parts are no less than lengths.
        const auto sum = [](Vec3 x) { return std::abs(x.x) + std::abs(x.y) + std::abs(x.z); };
        const double sums[3] = {sum(e), sum(g), sum(h)};
        const double off = 2.0 * error_;
        const double most = (sums[0] + off) * (sums[1] + off) * (sums[2] + off);
        const double doubt = kSideError * most + (most - sums[0] * sums[1] * sums[2]);
        if (std::abs(determinant) > doubt) {
            return determinant > 0.0 ? 1 : -1;
        }
        const Witness s = corners(f);
        const Level level(k_, s);
        if (level.has(false, v.index_a) && level.has(true, v.index_b)) {
            return 0;
        }
        return k_.sign([&](auto* out) {
            using N = NumberOf<decltype(out)>;
            const auto step = [&](int a, int b) { return k_.step<N>(s.a[0], s.b[0], a, b); };
            out[0] = dot(cross(step(s.a[1], s.b[1]), step(s.a[2], s.b[2])), step(v.index_a, v.index_b));
        });
    }

    [[nodiscard]] HullFacet measured(HullFacet f) const {
        // From the vertex nearest to the origin, about which an error of the normal turns the plane.
        int i = 0;
        for (int k = 1; k < 3; ++k) {
            i = dot(w(f.vertex[k]), w(f.vertex[k])) < dot(w(f.vertex[i]), w(f.vertex[i])) ? k : i;
        }
        const Vec3 p = w(f.vertex[i]);
        const Vec3 e = w(f.vertex[(i + 1) % 3]) - p;
        const Vec3 g = w(f.vertex[(i + 2) % 3]) - p;
        const Vec3 n = cross(e, g);
        const double area = norm(n);
        const double length_e = norm(e);
        const double length_g = norm(g);
        // Both edges are off by the errors of their ends, on top of their own rounding.
        const double tilt =
            (kPlaneError * length_e * length_g + 2.0 * error_ * (length_e + length_g + 2.0 * error_)) / area;
        if (!(tilt < kLargestTilt)) {
            f.error = kInfinity;
            return f;
        }
        f.normal = {n.x / area, n.y / area, n.z / area};
        f.offset = dot(f.normal, p);
        f.error = norm(p) * (2.0 * tilt + kSupportError) + 2.0 * error_;
        return f;
    }

    // ---- The first four vertices ----

    [[nodiscard]] HullVertex difference(int index_a, int index_b) const {
        HullVertex v{
            index_a, index_b, vertex_of(k_.a().rough, index_a), vertex_of(k_.b().rough, index_b), {}};
        v.w = v.b - v.a;
        return v;
    }

    /// False, and `out` set, where the origin is on the boundary of K.
    bool start(Witness s, ExactDepth& out) {
        if (s.count == 1 && !extend(s, out, along_axis({1.0, 0.0, 0.0}), along_axis({0.0, 1.0, 0.0}),
                                    along_axis({0.0, 0.0, 1.0}))) {
            return false;
        }
        const auto edge = [&](auto number, int i) {
            return k_.step<decltype(number)>(s.a[0], s.b[0], s.a[i], s.b[i]);
        };
        if (s.count == 2) {
            const auto aside = [&, axis = axis_off(s)](auto number) {
                return cross(edge(number, 1), exactly<decltype(number)>(axis));
            };
            const auto upright = [&](auto number) { return cross(edge(number, 1), aside(number)); };
            if (!extend(s, out, aside, upright)) {
                return false;
            }
        }
        const auto normal = [&](auto number) { return cross(edge(number, 1), edge(number, 2)); };
        if (s.count == 3 && !extend(s, out, normal)) {
            return false;
        }
        for (int i = 0; i < 4; ++i) {
            vertices_.push_back(difference(s.a[i], s.b[i]));
        }
        HullFacet base;
        for (int i = 0; i < 3; ++i) {
            base.vertex[i] = i;
        }
        enclose(side(base, vertices_[3]));
        return true;
    }

    /// A coordinate axis that is not parallel to the edge s.
    Vec3 axis_off(const Witness& s) {
        const Vec3 d =
            direction([&](auto number) { return k_.step<decltype(number)>(s.a[0], s.b[0], s.a[1], s.b[1]); });
        const double x = std::abs(d.x);
        const double y = std::abs(d.y);
        const double z = std::abs(d.z);
        return x <= y && x <= z ? Vec3{1.0, 0.0, 0.0} : y <= z ? Vec3{0.0, 1.0, 0.0} : Vec3{0.0, 0.0, 1.0};
    }

    template <class Along>
    Vec3 direction(const Along& along) const {
        Vec3 out;
        if (!k_.in_range() || !direction_of(along(Enclosed{}), out)) {
            out = direction_of(along(Exact{}));
        }
        return normalized(out);
    }

    /// Adds a vertex to a simplex whose span holds the origin; `along` are directions that span what is
    /// perpendicular to it.  False if K lies on one side of the simplex along one of them: then the plane
    /// there supports K at the origin.
    template <class... Along>
    bool extend(Witness& s, ExactDepth& out, const Along&... along) {
        Witness longer;
        const bool inside = (goes_both_ways(s, out, along, longer) && ...);
        s = inside ? longer : s;
        return inside;
    }

    template <class Along>
    bool goes_both_ways(const Witness& s, ExactDepth& out, const Along& along, Witness& longer) {
        const Vec3 n = direction(along);
        for (const int way : {-1, 1}) {
            const auto in_a = [&](const auto& step_of) {
                return -way * k_.sign([&](auto* sum) {
                    using N = NumberOf<decltype(sum)>;
                    sum[0] = dot(along(N{}), step_of(N{}));
                });
            };
            const auto in_b = [&](const auto& step_of) { return -in_a(step_of); };
            const Vec3 downwards = way * n;
            const int a = lower_vertex(k_, s, false, -downwards, in_a);
            const int b = lower_vertex(k_, s, true, downwards, in_b);
            if (a < 0 && b < 0) {
                out.normal = downwards;
                return false;
            }
            if (longer.count == 0) {
                longer = s;
                longer.a[s.count] = a < 0 ? s.a[0] : a;
                longer.b[s.count] = b < 0 ? s.b[0] : b;
                ++longer.count;
            }
        }
        return true;
    }

    // ---- The nearest facet ----

    void search(ExactDepth& out) {
        int best = -1;
        while (true) {
            const int f = pop();
            if (f < 0 || (best >= 0 && nearest_possible(f) >= scale_ * out.depth.upper)) {
                break;
            }
            HullFacet& facet = facets_[at(f)];
            if (!facet.refined && (facet.error > kPlaneDoubt * size_ || best >= 0)) {
                refine(facet);
                push(f);
                continue;
            }
            HullVertex next = difference(lowest(k_.a().rough, facet.normal).vertex,
                                         highest(k_.b().rough, facet.normal).vertex);
            if (side(facet, next) > 0) {
                grow(f, next);
                continue;
            }
            Feature feature(k_, corners(facet));
            if (beyond(feature, next)) {
                grow(f, next);
                continue;
            }
            if (feature.side() <= 0) {
                // A plane through the origin, and nothing of K beyond it.
                out = {};
                out.normal = -feature.direction();
                return;
            }
            const Rounding offset = feature.length();
            // Of two numbers, the smaller has the smaller roundings, unless they are the same.
            const auto order = [](const Rounding& x) { return std::tuple(x.lower, x.upper, x.nearest); };
            if (best < 0 || order(offset) < order(out.depth)) {
                best = f;
                out.depth = offset;
                out.normal = -feature.direction();
                out.foot = feature.holds_foot() ? feature.vertices() : Witness{};
            }
        }
    }

    [[nodiscard]] double nearest_possible(int f) const {
        return facets_[at(f)].offset - facets_[at(f)].error;
    }

    [[nodiscard]] Witness corners(const HullFacet& f) const {
        Witness out;
        out.count = 3;
        for (int i = 0; i < 3; ++i) {
            out.a[i] = vertices_[at(f.vertex[i])].index_a;
            out.b[i] = vertices_[at(f.vertex[i])].index_b;
        }
        return out;
    }

    void refine(HullFacet& f) {
        Feature feature(k_, corners(f));
        const Rounding length = feature.length();
        const double unit = feature.side() < 0 ? -scale_ : scale_;
        f.refined = true;
        f.normal = feature.direction();
        f.offset = unit * length.nearest;
        f.error = scale_ * std::max(length.upper - length.nearest, length.nearest - length.lower);
    }

    /// A vertex of K beyond the facet's plane.
    bool beyond(Feature& feature, HullVertex& next) {
        const Witness& s = feature.vertices();
        const Vec3 n = feature.direction();
        const auto up = [&](const auto& step_of) { return feature.sign_along(step_of); };
        const auto down = [&](const auto& step_of) { return -feature.sign_along(step_of); };
        const int a = lower_vertex(k_, s, false, n, up);
        const int b = lower_vertex(k_, s, true, -n, down);
        if (a < 0 && b < 0) {
            return false;
        }
        next = difference(a < 0 ? s.a[0] : a, b < 0 ? s.b[0] : b);
        return true;
    }

    Difference k_;
    double scale_;
    double size_;
    double error_;  ///< of the vertices of K
};

}  // namespace

ExactDepth exact_depth(const ExactAndRough& a, const ExactAndRough& b, const Witness& seed, double scale,
                       bool in_range) {
    return ExactHull(a, b, scale, in_range).nearest(seed);
}

}  // namespace geomsrv
