// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
#include "geom/growing_hull.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <memory_resource>
#include <span>
#include <vector>

#include "geom/double_double.hpp"
#include "geom/orientation_3d.hpp"

namespace geomsrv {

namespace {

// K of two hulls with m and n vertices has at most m n vertices; only those near the nearest facet are
// visited.  Two concentric hulls of 500 random points on a sphere take about 250.  The bounds hold wherever
// the work ends.
constexpr int kMaxVertices = 2000;

// Facets, their heap and vertices of a few dozen insertions fit here; more spill to the heap.
constexpr std::size_t kStackBytes = std::size_t{48} << 10;

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

struct HullVertex {
    int index_a = 0;
    int index_b = 0;
    Vec3 a;
    Vec3 b;
    Vec3 w;
};

struct Facet {
    int vertex[3] = {};     ///< counter-clockwise from outside
    int neighbour[3] = {};  ///< across the edge from vertex[i] to vertex[i + 1]
    Vec3 normal;            ///< unit, outwards
    double offset = 0.0;    ///< of its plane from the origin
    double error = 0.0;     ///< of the offset
    bool alive = true;
    bool wide = false;  ///< computed in double-double
    int seen = 0;       ///< last vertex that looked at it
};

struct Entry {
    double key = 0.0;  ///< offset - error: the facet's plane is proven to be no nearer
    int facet = 0;
};
constexpr bool operator<(Entry a, Entry b) { return a.key > b.key; }  // heap with the nearest facet on top

class GrowingHull {
public:
    GrowingHull(const Core& a, const Core& b)
        : a_(a), b_(b), size_(a.reach + b.reach), memory_(buffer_.data(), buffer_.size()) {
        vertices_.reserve(64);
        facets_.reserve(160);
        heap_.reserve(192);
    }

    HullFacet nearest(const Witness& seed) {
        HullFacet out;
        if (!start(seed, out)) {
            return out;
        }
        double reach = std::numeric_limits<double>::infinity();  // smallest support seen
        int best = -1;
        double inner = -std::numeric_limits<double>::infinity();
        while (true) {
            const int f = pop();
            inner = facets_[at(f)].offset - facets_[at(f)].error;
            if (facets_[at(f)].error > kPlaneDoubt * size_ && !facets_[at(f)].wide) {
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
            if (reach - inner <= kMeetingGap * size_ || static_cast<int>(vertices_.size()) >= kMaxVertices) {
                break;
            }
            if (side(facets_[at(f)], v.w) <= 0) {
                // Nothing of K lies beyond this facet: what is left between support and plane is its
                // rounding.
                if (facets_[at(f)].wide) {
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
        // Proven only if the surface winds round the origin, which the sign of the nearest facet says for
        // all.
        out.upper = inner > 0.0 ? -(inner - kDifferenceError * size_) : 0.0;
        // The direction may come from a facet of P that is no facet of K: then its plane lies inside.
        if (reach - facets_[at(best)].offset <= kMeetingGap * size_) {
            set_foot(facets_[at(best)], out);
        }
        return out;
    }

private:
    static std::size_t at(int i) { return static_cast<std::size_t>(i); }
    Vec3 w(int i) const { return vertices_[at(i)].w; }

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

    int side(const Facet& f, Vec3 p) const {
        return orientation_3d(w(f.vertex[0]), w(f.vertex[1]), w(f.vertex[2]), p);
    }

    /// A first tetrahedron: the seed if it is one, else spanned by far vertices; false, and `out` set, where
    /// K is flat.
    bool start(const Witness& seed, HullFacet& out) {
        for (int i = 0; i < seed.count; ++i) {
            vertices_.push_back(difference(seed.a[i], seed.b[i]));
        }
        if (seed.count < 4 || orientation_3d(w(0), w(1), w(2), w(3)) == 0) {
            vertices_.clear();
            if (!span(out)) {
                return false;
            }
        }
        if (orientation_3d(w(0), w(1), w(2), w(3)) > 0) {
            std::swap(vertices_[1], vertices_[2]);
        }
        //          3            Vertex 3 lies behind the facet 0 1 2.
        //        / | \          Edge i of a facet runs from its vertex i to the next.
        constexpr int kCorner[4][3] = {{0, 1, 2}, {0, 3, 1}, {1, 3, 2}, {2, 3, 0}};
        constexpr int kAcross[4][3] = {{1, 2, 3}, {3, 2, 0}, {1, 3, 0}, {2, 1, 0}};
        for (int f = 0; f < 4; ++f) {
            Facet facet;
            for (int i = 0; i < 3; ++i) {
                facet.vertex[i] = kCorner[f][i];
                facet.neighbour[i] = kAcross[f][i];
            }
            facets_.push_back(measured(facet));
            push(f);
        }
        return true;
    }

    /// Four vertices of K that span as much as can be found along a few directions.
    bool span(HullFacet& out) {
        constexpr std::array<Vec3, 3> kAxes = {{{1.0, 0.0, 0.0}, {0.0, 1.0, 0.0}, {0.0, 0.0, 1.0}}};
        const double thin = kFlat * size_;
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
    bool flat(std::span<const Vec3> directions, HullFacet& out) {
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

    Facet measured(Facet f) const {
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
    Facet measured_wide(Facet f) const {
        f.wide = true;
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

    void push(int f) {
        heap_.push_back({facets_[at(f)].offset - facets_[at(f)].error, f});
        std::push_heap(heap_.begin(), heap_.end());
    }

    int pop() {
        while (true) {
            const Entry top = heap_.front();
            std::pop_heap(heap_.begin(), heap_.end());
            heap_.pop_back();
            if (facets_[at(top.facet)].alive) {
                return top.facet;
            }
        }
    }

    /// Replaces the facets that v sees, `first` among them, by a cone from their rim to v.
    void grow(int first, const HullVertex& v) {
        vertices_.push_back(v);
        const int apex = static_cast<int>(vertices_.size()) - 1;
        visible_.clear();
        visible_.push_back(first);
        facets_[at(first)].alive = false;
        rim_.assign(vertices_.size(), -1);
        const int new_begin = static_cast<int>(facets_.size());
        for (std::size_t next = 0; next < visible_.size(); ++next) {
            const int f = visible_[next];
            for (int i = 0; i < 3; ++i) {
                const int g = facets_[at(f)].neighbour[i];
                Facet& across = facets_[at(g)];
                if (!across.alive) {
                    continue;  // seen already
                }
                if (across.seen != apex) {
                    across.seen = apex;
                    if (side(across, v.w) > 0) {
                        across.alive = false;
                        visible_.push_back(g);
                        continue;
                    }
                }
                add_rim_facet(f, i, g, apex);
            }
        }
        const int new_end = static_cast<int>(facets_.size());
        for (int f = new_begin; f < new_end; ++f) {
            // The facet whose rim edge starts where this one's ends is its neighbour on that side.
            const int g = rim_[at(facets_[at(f)].vertex[1])];
            facets_[at(f)].neighbour[1] = g;
            facets_[at(g)].neighbour[2] = f;
            push(f);
        }
    }

    /// Facet over edge i of the visible facet f, beyond which the facet g stays.
    void add_rim_facet(int f, int i, int g, int apex) {
        Facet facet;
        facet.vertex[0] = facets_[at(f)].vertex[i];
        facet.vertex[1] = facets_[at(f)].vertex[(i + 1) % 3];
        facet.vertex[2] = apex;
        facet.neighbour[0] = g;
        const int index = static_cast<int>(facets_.size());
        for (int k = 0; k < 3; ++k) {
            if (facets_[at(g)].vertex[k] == facet.vertex[1] &&
                facets_[at(g)].vertex[(k + 1) % 3] == facet.vertex[0]) {
                facets_[at(g)].neighbour[k] = index;
            }
        }
        rim_[at(facet.vertex[0])] = index;
        facets_.push_back(measured(facet));
    }

    /// Witness points where the origin's foot lies on the facet itself.
    void set_foot(const Facet& f, HullFacet& out) const {
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
        out.foot = norm(out.point_b - out.point_a - foot) <= kMeetingGap * size_;
    }

    const Core& a_;
    const Core& b_;
    double size_;
    std::array<std::byte, kStackBytes> buffer_;
    std::pmr::monotonic_buffer_resource memory_;
    std::pmr::vector<HullVertex> vertices_{&memory_};
    std::pmr::vector<Facet> facets_{&memory_};
    std::pmr::vector<Entry> heap_{&memory_};
    std::pmr::vector<int> visible_{&memory_};
    std::pmr::vector<int> rim_{&memory_};
};

}  // namespace

HullFacet nearest_facet(const Core& a, const Core& b, const Witness& seed) {
    return GrowingHull(a, b).nearest(seed);
}

}  // namespace geomsrv
