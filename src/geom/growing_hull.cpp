// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
#include "geom/growing_hull.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <type_traits>

#include "geom/double_double.hpp"
#include "geom/hull_surface.hpp"
#include "geom/orientation_3d.hpp"

namespace geomsrv {

namespace {

// K of two hulls with m and n vertices has at most m n vertices; only those near the nearest facet are
// visited.  Two concentric hulls of 500 random points on a sphere take about 250.  The bounds hold wherever
// the work ends.
constexpr int kMaxVertices = 2000;

// Of curved bodies a few hundred bring the bounds together, unless the boundary of K is equally near all
// around: then no number would do.
template <class Body>
constexpr int kMostVertices = std::is_same_v<Body, SupportedCore> ? 600 : kMaxVertices;

// Vertices of K are differences of rounded vertices, rounded once more.
constexpr double kDifferenceError = 2 * kVertexError + 2 * kUnitRoundoff;

// Plane of three points in doubles: each edge rounds by u, a product of two by u, a sum by u, which makes 4
// sqrt(2) u of the product of their lengths; the offset of the plane turns with it about the vertex it is
// measured at.
constexpr double kPlaneError = 6 * kUnitRoundoff;

// In double-double next to nothing remains but the rounding of the result.
constexpr double kWidePlaneError = 2 * kUnitRoundoff;

// A facet is looked at again in double-double if its plane is less certain than this times S.
constexpr double kPlaneDoubt = 8 * kUnitRoundoff;

// K is flat where its thickness is below the rounding of its vertices times this.
constexpr double kFlat = 16 * kUnitRoundoff;

// Coordinates below this times S are set to 0, far below the rounding of the vertex: orientation_3d
// multiplies three.
constexpr double kNegligible = 0x1p-190;

template <class Body>
class GrowingHull : private HullSurface<GrowingHull<Body>> {
    friend class HullSurface<GrowingHull>;
    using Surface = HullSurface<GrowingHull>;
    using Surface::at, Surface::enclose, Surface::grow, Surface::pop, Surface::push, Surface::w;
    using Surface::facets_, Surface::vertices_;

public:
    GrowingHull(const Body& a, const Body& b) : a_(a), b_(b), size_(a.reach + b.reach) {}

    NearestFacet nearest(const Witness& seed) {
        NearestFacet out;
        if (!start(seed, out)) {
            return out;
        }
        double reach = std::numeric_limits<double>::infinity();  // smallest support seen
        int best = -1;
        double inner = -std::numeric_limits<double>::infinity();
        while (true) {
            const int f = pop();
            inner = facets_[at(f)].offset - facets_[at(f)].error;
            if (facets_[at(f)].error > kDoubt * size_ && !facets_[at(f)].refined) {
                facets_[at(f)] = measured_wide(facets_[at(f)]);
                push(f);
                continue;
            }
            const HullVertex v = furthest(facets_[at(f)].normal);
            const double support = dot(facets_[at(f)].normal, v.b) - dot(facets_[at(f)].normal, v.a);
            if (support < reach) {
                reach = support;
                best = f;
            }
            if (reach - inner <= kMet * size_ || static_cast<int>(vertices_.size()) >= kMostVertices<Body>) {
                break;
            }
            if (side(facets_[at(f)], v) <= 0) {
                // Nothing of K lies beyond this facet: what is left between support and plane is its
                // rounding.
                if (facets_[at(f)].refined) {
                    break;
                }
                facets_[at(f)] = measured_wide(facets_[at(f)]);
                push(f);
                continue;
            }
            grow(f, v);
        }
        out.iterations = static_cast<int>(vertices_.size());
        out.normal = -facets_[at(best)].normal;
        if constexpr (std::is_same_v<Body, SupportedCore>) {
            if (inner <= kMet * size_ && reach - inner > kMet * size_) {
                between_facets(reach, out.normal);
            }
        }
        // Proven only if the surface winds round the origin, which the sign of the nearest facet says for
        // all.
        out.upper = inner > 0.0 ? -(inner - kOff * size_) : 0.0;
        // The direction may come from a facet of P that is no facet of K: then its plane lies inside.
        if (reach - facets_[at(best)].offset <= kMet * size_) {
            set_foot(facets_[at(best)], out);
        }
        return out;
    }

private:
    /// Where a tip of K is the origin, or all but, the normals of the facets around it are the outermost of
    /// those that part the bodies, and the curved boundary bulges beyond them; one between them all does
    /// better.
    void between_facets(double reach, Vec3& normal) {
        Vec3 sum;
        for (const HullFacet& f : facets_) {
            if (f.alive && f.offset - f.error <= kMet * size_) {
                sum = sum + f.normal;
            }
        }
        if (!(norm(sum) > kThin)) {
            return;
        }
        const Vec3 mean = normalized(sum);
        if (highest(b_, mean).value - lowest(a_, mean).value < reach) {
            normal = -mean;
        }
    }

    /// Vertex of K from one of each core.
    HullVertex difference(int index_a, int index_b) const {
        HullVertex v{index_a, index_b, vertex_of(a_, index_a), vertex_of(b_, index_b), {}};
        v.w = v.b - v.a;
        for (double* x : {&v.w.x, &v.w.y, &v.w.z}) {
            *x = std::abs(*x) < kNegligible * size_ ? 0.0 : *x;
        }
        return v;
    }

    /// Vertex of K furthest along m.
    HullVertex furthest(Vec3 m) const { return difference(lowest(a_, m).vertex, highest(b_, m).vertex); }

    int side(const HullFacet& f, const HullVertex& v) const {
        return orientation_3d(w(f.vertex[0]), w(f.vertex[1]), w(f.vertex[2]), v.w);
    }

    /// A first tetrahedron: the seed if it is one, else spanned by far vertices; false, and `out` set, where
    /// K is flat.
    bool start(const Witness& seed, NearestFacet& out) {
        for (int i = 0; i < seed.count; ++i) {
            vertices_.push_back(difference(seed.a[i], seed.b[i]));
        }
        if (seed.count < 4 || orientation_3d(w(0), w(1), w(2), w(3)) == 0) {
            vertices_.clear();
            if (!span(out)) {
                return false;
            }
        }
        enclose(orientation_3d(w(0), w(1), w(2), w(3)));
        return true;
    }

    /// Four vertices of K that span as much as can be found along a few directions.
    bool span(NearestFacet& out) {
        constexpr std::array<Vec3, 3> kAxes = {{{1.0, 0.0, 0.0}, {0.0, 1.0, 0.0}, {0.0, 0.0, 1.0}}};
        const double thin = kThin * size_;
        vertices_.push_back(furthest(kAxes[0]));
        const Vec3 first = w(0);
        // The vertex that is furthest by `measure`, of those furthest along the directions.
        const auto add = [&](std::span<const Vec3> directions, auto measure) {
            HullVertex best;
            double most = -1.0;
            for (const Vec3 d : directions) {
                for (const Vec3 m : {d, -d}) {
                    const HullVertex v = furthest(m);
                    const double far = measure(v.w - first);
                    if (far > most) {
                        most = far;
                        best = v;
                    }
                }
            }
            vertices_.push_back(best);
            return most > thin;
        };
        if (!add(kAxes, [](Vec3 e) { return norm(e); })) {
            return flat(kAxes, out);
        }
        const Vec3 along = normalized(w(1) - first);
        const Vec3 aside = perpendicular(along);
        const std::array<Vec3, 2> around = {aside, cross(along, aside)};
        if (!add(around, [&](Vec3 e) { return norm(e - dot(e, along) * along); })) {
            return flat(around, out);
        }
        // Of a sliver, doubles would know no normal.
        const std::array<Vec3, 1> across = {narrow(unit(triangle_normal(first, w(1), w(2))))};
        if (!add(across, [&](Vec3 e) { return std::abs(dot(e, across[0])); })) {
            return flat(across, out);
        }
        return orientation_3d(w(0), w(1), w(2), w(3)) != 0 || flat(across, out);
    }

    /// K has no thickness along these directions: the one along which it lies least behind the origin
    /// separates.
    bool flat(std::span<const Vec3> directions, NearestFacet& out) {
        double best = -std::numeric_limits<double>::infinity();
        for (const Vec3 d : directions) {
            for (const Vec3 n : {d, -d}) {
                const double gap = lowest(b_, n).value - highest(a_, n).value;
                if (gap > best) {
                    best = gap;
                    out.normal = n;
                }
            }
        }
        out.flat = true;
        return false;
    }

    HullFacet measured(HullFacet f) const {
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
        if (!(area > 0.0)) {
            return measured_wide(f);
        }
        f.normal = {n.x / area, n.y / area, n.z / area};
        f.offset = dot(f.normal, p);
        f.error = norm(p) * (kPlaneError * (norm(e) * norm(g) / area) + kSupportError);
        return f;
    }

    /// The same from exact products: good for any triangle that is not a line, and those do not occur.
    HullFacet measured_wide(HullFacet f) const {
        f.refined = true;
        const Vec3 p = w(f.vertex[0]);
        const WideVec3 n = unit(triangle_normal(p, w(f.vertex[1]), w(f.vertex[2])));
        f.normal = narrow(n);
        f.offset = dot(n, p).hi;
        f.error = kWidePlaneError * norm(p);
        return f;
    }

    /// a / |a|, brought to size 1 first: the products that a sliver's normal is made of may be tiny.
    static WideVec3 unit(WideVec3 a) {
        const double largest = std::max({std::abs(a.x.hi), std::abs(a.y.hi), std::abs(a.z.hi)});
        const DoubleDouble scale{std::ldexp(1.0, -std::ilogb(largest)), 0.0};
        a = scale * a;
        const DoubleDouble length = sqrt(dot(a, a));
        return {a.x / length, a.y / length, a.z / length};
    }

    /// Witness points where the origin's foot lies on the facet itself.
    void set_foot(const HullFacet& f, NearestFacet& out) const {
        const Vec3 n = cross(w(f.vertex[1]) - w(f.vertex[0]), w(f.vertex[2]) - w(f.vertex[0]));
        const Vec3 foot = f.offset * f.normal;
        double area[3];
        double sum = 0.0;
        for (int k = 0; k < 3; ++k) {
            // Twice the area of the triangle opposite vertex k, signed.
            area[k] = dot(cross(w(f.vertex[(k + 1) % 3]) - foot, w(f.vertex[(k + 2) % 3]) - foot), n);
            sum += area[k];
        }
        if (!(area[0] >= 0.0 && area[1] >= 0.0 && area[2] >= 0.0 && sum > 0.0)) {
            return;
        }
        for (int k = 0; k < 3; ++k) {
            const HullVertex& v = vertices_[at(f.vertex[k])];
            const double weight = area[k] / sum;
            out.witness.a[k] = v.index_a;
            out.witness.b[k] = v.index_b;
            out.witness.weight[k] = weight;
            out.point_a = out.point_a + weight * v.a;
            out.point_b = out.point_b + weight * v.b;
        }
        out.witness.count = 3;
        // On a sliver the weights may be noise.
        out.foot = norm(out.point_b - out.point_a - foot) <= kMet * size_;
    }

    // The same in units of the body's own roundoff.
    static constexpr double kMet = kMeetingGap * Body::kCoarseness;
    static constexpr double kDoubt = kPlaneDoubt * Body::kCoarseness;
    static constexpr double kThin = kFlat * Body::kCoarseness;
    static constexpr double kOff = kDifferenceError * Body::kCoarseness;

    const Body& a_;
    const Body& b_;
    double size_;
};

}  // namespace

NearestFacet nearest_facet(const Core& a, const Core& b, const Witness& seed) {
    return GrowingHull<Core>(a, b).nearest(seed);
}

NearestFacet nearest_facet(const SingleCore& a, const SingleCore& b, const Witness& seed) {
    return GrowingHull<SingleCore>(a, b).nearest(seed);
}

NearestFacet nearest_facet(const SupportedCore& a, const SupportedCore& b, const Witness& seed) {
    return GrowingHull<SupportedCore>(a, b).nearest(seed);
}

}  // namespace geomsrv
