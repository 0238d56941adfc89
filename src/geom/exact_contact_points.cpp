// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
#include "geom/exact_contact_points.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>

#include "geom/contact_plane.hpp"
#include "geom/exact_direction.hpp"
#include "geom/rounding.hpp"

namespace geomsrv {

namespace {

// A height over a plane through a vertex, along a unit normal that is off by 6 u, is off by 12 u of the reach
// for the normal, 6 u for both vertices (kVertexError), 2 u for the cores' own error and 4 u for difference
// and product.
constexpr double kHeightError = 32 * kUnitRoundoff;

// Points further apart than this part of the reach are not the same, however much rounding has moved them:
// that is some 2^-50 divided by the sine of the angle at which an edge meets a plane, and needles are looked
// at exactly.
constexpr double kNearby = 0x1p-20;

template <class N>
N entry(const VectorOf<N>& v, int k) {
    return k == 0 ? v.x : k == 1 ? v.y : v.z;
}

bool round_ratio(const Enclosed& numerator, const Enclosed& denominator, double& out) {
    Rounding found;
    const bool known = round_enclosed(numerator / denominator, found);
    out = found.nearest;
    return known;
}

bool round_ratio(const Exact& numerator, const Exact& denominator, double& out) {
    out = rounded_quotient(numerator, denominator).nearest;
    return true;
}

}  // namespace

// ---- Touching ----

template <class N>
void ExactContactPoints::time(N& numerator, N& denominator) const {
    if (at_start_) {
        numerator = N(0.0);
        denominator = N(1.0);
    } else {
        ray_->time<N>(end_, numerator, denominator);
    }
}

template <class N>
ExactContactPoints::Flat<N> ExactContactPoints::flat_of(int body, int vertex) const {
    const ExactAndRough& of = body == 0 ? ray_->a() : ray_->b();
    VectorOf<N> v = vertex_times_denominator<N>(of.exact, vertex);
    if (!at_start_) {
        N numerator;
        N denominator;
        time(numerator, denominator);
        v = denominator * v;
        if (body == 1) {
            v = v - numerator * ray_->ray<N>();
        }
    }
    return {entry(v, axis_[0]), entry(v, axis_[1])};
}

template <class N>
const ExactContactPoints::Flat<N>& ExactContactPoints::flat(int body, int corner) {
    Corner& of = corner_[body][static_cast<std::size_t>(corner)];
    if constexpr (std::is_same_v<N, Enclosed>) {
        return of.wide;
    } else {
        if (!of.exact) {
            of.exact = flat_of<Exact>(body, of.vertex);
        }
        return *of.exact;
    }
}

/// Twice the area of a triangle of corners, > 0 if counter-clockwise about the normal.
template <class N>
N ExactContactPoints::area(int body_p, int p, int body_q, int q, int body_r, int r) {
    const Flat<N>& from = flat<N>(body_p, p);
    const Flat<N>& to = flat<N>(body_q, q);
    const Flat<N>& at = flat<N>(body_r, r);
    return (to.x - from.x) * (at.y - from.y) - (to.y - from.y) * (at.x - from.x);
}

int ExactContactPoints::side(int body_p, int p, int body_q, int q, int body_r, int r) {
    return ray_->sign([&]<class N>() { return area<N>(body_p, p, body_q, q, body_r, r); });
}

/// Corners of a face in order, counter-clockwise; the ends of a flat one.
void ExactContactPoints::ring_of(int body) {
    std::vector<int>& ring = ring_[body];
    ring.resize(corner_[body].size());
    for (std::size_t i = 0; i < ring.size(); ++i) {
        ring[i] = static_cast<int>(i);
    }
    const auto compare_corners = [&](int p, int q) {
        const int x = ray_->sign([&]<class N>() { return flat<N>(body, p).x - flat<N>(body, q).x; });
        return x != 0 ? x : ray_->sign([&]<class N>() { return flat<N>(body, p).y - flat<N>(body, q).y; });
    };
    std::sort(ring.begin(), ring.end(), [&](int p, int q) { return p != q && compare_corners(p, q) < 0; });
    const auto same = [&](int p, int q) { return compare_corners(p, q) == 0; };
    ring.erase(std::unique(ring.begin(), ring.end(), same), ring.end());
    if (ring.size() < 3) {
        return;
    }
    chain_.clear();
    for (const bool above : {false, true}) {
        const std::size_t base = chain_.size();
        for (std::size_t k = 0; k < ring.size(); ++k) {
            const int p = ring[above ? ring.size() - 1 - k : k];
            while (chain_.size() >= base + 2 &&
                   side(body, chain_[chain_.size() - 2], body, chain_.back(), body, p) <= 0) {
                chain_.pop_back();
            }
            chain_.push_back(p);
        }
        chain_.pop_back();
    }
    ring = chain_;
}

/// Whether a corner of the other body is in a face.
bool ExactContactPoints::contains(int body, int corner) {
    const std::vector<int>& ring = ring_[body];
    const int other = 1 - body;
    const auto between = [&](int p, int q, int axis) {
        const auto order = [&](int end) {
            return ray_->sign([&]<class N>() {
                const Flat<N>& e = flat<N>(body, end);
                const Flat<N>& c = flat<N>(other, corner);
                return axis == 0 ? c.x - e.x : c.y - e.y;
            });
        };
        return order(p) * order(q) <= 0;
    };
    if (ring.size() < 3) {
        const int p = ring.front();
        const int q = ring.back();
        return (p == q || side(body, p, body, q, other, corner) == 0) && between(p, q, 0) && between(p, q, 1);
    }
    for (std::size_t i = 0; i < ring.size(); ++i) {
        if (side(body, ring[i], body, ring[i + 1 == ring.size() ? 0 : i + 1], other, corner) < 0) {
            return false;
        }
    }
    return true;
}

/// With a denominator > 0; one whose sign is in doubt leaves all in doubt.
template <class N>
ExactContactPoints::Homogeneous<N> ExactContactPoints::oriented(const Homogeneous<N>& h) {
    Homogeneous<N> out = sign_of(h.w) < 0 ? Homogeneous<N>{-h.at, -h.w} : h;
    if constexpr (std::is_same_v<N, Enclosed>) {
        if (sign_of(out.w) != 1) {
            out.w.error = std::numeric_limits<double>::infinity();
        }
    }
    return out;
}

template <class N>
ExactContactPoints::Homogeneous<N> ExactContactPoints::place_of(const Point& point) {
    const ExactAndRough& of = point.body == 0 ? ray_->a() : ray_->b();
    const auto vertex = [&](int corner) {
        return vertex_times_denominator<N>(of.exact,
                                           corner_[point.body][static_cast<std::size_t>(corner)].vertex);
    };
    Homogeneous<N> out{vertex(point.from), N(1.0)};
    if (point.from != point.to) {
        const int other = 1 - point.body;
        const N from = area<N>(other, point.other_from, other, point.other_to, point.body, point.from);
        const N to = area<N>(other, point.other_from, other, point.other_to, point.body, point.to);
        out.w = from - to;
        out.at = from * vertex(point.to) - to * out.at;
    }
    if (!at_start_) {
        N numerator;
        N denominator;
        time(numerator, denominator);
        out.at = denominator * out.at + (numerator * out.w) * ray_->velocity<N>(point.body);
        out.w = denominator * out.w;
    }
    return oriented(out);
}

template <class N>
const ExactContactPoints::Homogeneous<N>& ExactContactPoints::place(Point& point) {
    if constexpr (std::is_same_v<N, Enclosed>) {
        return point.wide;
    } else {
        if (!point.exact) {
            point.exact = place_of<Exact>(point);
        }
        return *point.exact;
    }
}

void ExactContactPoints::add(int body, int from, int to, int other_from, int other_to) {
    found_.push_back({body, from, to, other_from, other_to, {}, {}});
    if (ray_->ordinary()) {
        found_.back().wide = place_of<Enclosed>(found_.back());
    }
}

int ExactContactPoints::turn(Point& p, Point& q, Point& r) {
    return ray_->sign([&]<class N>() {
        const auto row = [&](Point& at) {
            const Homogeneous<N>& h = place<N>(at);
            return VectorOf<N>{entry(h.at, axis_[0]), entry(h.at, axis_[1]), h.w};
        };
        return dot(cross(row(p), row(q)), row(r));
    });
}

int ExactContactPoints::compare(Point& p, Point& q) {
    for (const int axis : axis_) {
        const int differs = ray_->sign([&]<class N>() {
            const Homogeneous<N>& h = place<N>(p);
            const Homogeneous<N>& g = place<N>(q);
            return entry(h.at, axis) * g.w - entry(g.at, axis) * h.w;
        });
        if (differs != 0) {
            return differs;
        }
    }
    return 0;
}

/// Leaves the corners of the hull, counter-clockwise from the least.
void ExactContactPoints::order() {
    std::vector<int> index(found_.size());
    for (std::size_t i = 0; i < index.size(); ++i) {
        index[i] = static_cast<int>(i);
    }
    const auto at = [&](int i) -> Point& { return found_[static_cast<std::size_t>(i)]; };
    std::sort(index.begin(), index.end(), [&](int p, int q) { return p != q && compare(at(p), at(q)) < 0; });
    index.erase(
        std::unique(index.begin(), index.end(), [&](int p, int q) { return compare(at(p), at(q)) == 0; }),
        index.end());
    if (index.size() > 2) {
        chain_.clear();
        for (const bool above : {false, true}) {
            const std::size_t base = chain_.size();
            for (std::size_t k = 0; k < index.size(); ++k) {
                const int p = index[above ? index.size() - 1 - k : k];
                while (chain_.size() >= base + 2 &&
                       turn(at(chain_[chain_.size() - 2]), at(chain_.back()), at(p)) <= 0) {
                    chain_.pop_back();
                }
                chain_.push_back(p);
            }
            chain_.pop_back();
        }
        index = chain_;
    }
    points_.clear();
    for (const int i : index) {
        points_.push_back(rounded([&]<class N>() -> const Homogeneous<N>& { return place<N>(at(i)); }));
    }
}

template <class Place>
Vec3 ExactContactPoints::rounded(const Place& place) const {
    double out[3];
    for (int k = 0; k < 3; ++k) {
        bool known = false;
        if (ray_->ordinary()) {
            const auto& wide = place.template operator()<Enclosed>();
            known = round_ratio(entry(wide.at, k), wide.w, out[k]);
        }
        if (!known) {
            const auto& exact = place.template operator()<Exact>();
            round_ratio(entry(exact.at, k), exact.w, out[k]);
        }
    }
    return {out[0], out[1], out[2]};
}

std::span<const Vec3> ExactContactPoints::touching(ExactRay& ray, RayEnd end, bool at_start) {
    ray_ = &ray;
    end_ = end;
    at_start_ = at_start;
    Vec3 n;
    if (!ray.ordinary() || !round_direction(ray.support<Enclosed>(end), n)) {
        round_direction(ray.support<Exact>(end), n);
    }
    choose_axes(n, axis_);
    ray.faces(end, face_[0], face_[1]);
    for (const int body : {0, 1}) {
        corner_[body].clear();
        for (const int vertex : face_[body]) {
            corner_[body].push_back({vertex, {}, {}});
            if (ray.ordinary()) {
                corner_[body].back().wide = flat_of<Enclosed>(body, vertex);
            }
        }
        ring_of(body);
    }
    found_.clear();
    for (const int body : {0, 1}) {
        for (const int corner : ring_[body]) {
            if (contains(1 - body, corner)) {
                add(body, corner, corner, 0, 0);
            }
        }
    }
    const auto edges = [](const std::vector<int>& ring) {
        return ring.size() == 2 ? 1 : ring.size() < 2 ? 0 : ring.size();
    };
    const auto next = [](const std::vector<int>& ring, std::size_t i) {
        return ring[i + 1 == ring.size() ? 0 : i + 1];
    };
    for (std::size_t i = 0; i < edges(ring_[0]); ++i) {
        const int p = ring_[0][i];
        const int q = next(ring_[0], i);
        for (std::size_t j = 0; j < edges(ring_[1]); ++j) {
            const int r = ring_[1][j];
            const int s = next(ring_[1], j);
            if (side(0, p, 0, q, 1, r) * side(0, p, 0, q, 1, s) < 0 &&
                side(1, r, 1, s, 0, p) * side(1, r, 1, s, 0, q) < 0) {
                add(0, p, q, r, s);
            }
        }
    }
    order();
    return points_;
}

// ---- Overlapping ----

/// Of a vertex of one body over a plane of the other.
template <class N>
N ExactContactPoints::height(int body, std::size_t plane, int vertex) const {
    const PolytopeFaces& other = faces_[1 - body];
    const FacePlane& of = other.planes()[plane];
    return dot(other.normal<N>(of), vertex_times_denominator<N>(faces_[body].exact(), vertex) -
                                        vertex_times_denominator<N>(other.exact(), of.i));
}

double ExactContactPoints::rough_height(int body, std::size_t plane, int vertex) const {
    const PolytopeFaces& other = faces_[1 - body];
    return dot(normals_[1 - body][plane],
               vertex_of(faces_[body].rough(), vertex) - vertex_of(other.rough(), other.planes()[plane].i));
}

int ExactContactPoints::side_of(int body, std::size_t plane, int vertex) {
    const double reach = faces_[0].rough().reach + faces_[1].rough().reach;
    const double rough = rough_height(body, plane, vertex);
    if (std::fabs(rough) > kHeightError * reach) {
        return rough > 0.0 ? 1 : -1;
    }
    return ray_->sign([&]<class N>() { return height<N>(body, plane, vertex); });
}

/// Whether an edge reaches one plane later than another; it passes both the same way.
bool ExactContactPoints::later(int body, const FaceEdge& edge, std::size_t plane, std::size_t other) {
    const double from = rough_height(body, plane, edge.from);
    const double to = rough_height(body, plane, edge.to);
    const double other_from = rough_height(body, other, edge.from);
    const double other_to = rough_height(body, other, edge.to);
    const double reach = faces_[0].rough().reach + faces_[1].rough().reach;
    const double doubt = 4.0 * kHeightError * reach;
    // from / (from - to) > other_from / (other_from - other_to)
    const double rough = from * (other_from - other_to) - other_from * (from - to);
    if (std::fabs(rough) >
        doubt * (std::fabs(from) + std::fabs(to) + std::fabs(other_from) + std::fabs(other_to) + doubt)) {
        return rough > 0.0;
    }
    return ray_->sign([&]<class N>() {
        const N h = height<N>(body, plane, edge.from);
        const N g = height<N>(body, other, edge.from);
        return h * (g - height<N>(body, other, edge.to)) - g * (h - height<N>(body, plane, edge.to));
    }) > 0;
}

template <class N>
ExactContactPoints::Homogeneous<N> ExactContactPoints::place(const Cut& cut) const {
    const ExactBody& body = faces_[cut.body].exact();
    if (cut.vertex >= 0) {
        return {vertex_times_denominator<N>(body, cut.vertex), N(1.0)};
    }
    const FaceEdge& edge = faces_[cut.body].edges()[cut.edge];
    const N from = height<N>(cut.body, cut.plane, edge.from);
    const N to = height<N>(cut.body, cut.plane, edge.to);
    return oriented(Homogeneous<N>{
        from * vertex_times_denominator<N>(body, edge.to) - to * vertex_times_denominator<N>(body, edge.from),
        from - to});
}

void ExactContactPoints::add(const Cut& cut) {
    const double reach = faces_[0].rough().reach + faces_[1].rough().reach;
    for (const Cut& known : cuts_) {
        if (cut.body == known.body && cut.vertex == known.vertex && cut.vertex >= 0) {
            return;
        }
        const Vec3 gap = cut.rough - known.rough;
        if (std::fabs(gap.x) + std::fabs(gap.y) + std::fabs(gap.z) > kNearby * reach) {
            continue;
        }
        bool same = true;
        for (int k = 0; k < 3 && same; ++k) {
            same = ray_->sign([&]<class N>() {
                const Homogeneous<N> p = place<N>(cut);
                const Homogeneous<N> q = place<N>(known);
                return entry(p.at, k) * q.w - entry(q.at, k) * p.w;
            }) == 0;
        }
        if (same) {
            return;
        }
    }
    cuts_.push_back(cut);
}

/// Adds the ends of what is left of an edge between the planes of the other body.
void ExactContactPoints::clip(int body, std::size_t index) {
    const FaceEdge& edge = faces_[body].edges()[index];
    const std::size_t planes = faces_[1 - body].planes().size();
    constexpr std::size_t kNone = static_cast<std::size_t>(-1);
    std::size_t entry_plane = kNone;
    std::size_t exit_plane = kNone;
    bool begins_at_end = false;
    bool ends_at_start = false;
    for (std::size_t plane = 0; plane < planes; ++plane) {
        const int from = side_of(body, plane, edge.from);
        const int to = edge.from == edge.to ? from : side_of(body, plane, edge.to);
        if (from > 0 && to > 0) {
            return;
        }
        if (from > 0) {
            begins_at_end = begins_at_end || to == 0;
            if (to < 0 && (entry_plane == kNone || later(body, edge, plane, entry_plane))) {
                entry_plane = plane;
            }
        } else if (to > 0) {
            ends_at_start = ends_at_start || from == 0;
            if (from < 0 && (exit_plane == kNone || later(body, edge, exit_plane, plane))) {
                exit_plane = plane;
            }
        }
    }
    const Vec3 p = vertex_of(faces_[body].rough(), edge.from);
    const Vec3 q = vertex_of(faces_[body].rough(), edge.to);
    const auto at_vertex = [&](int vertex, Vec3 rough) { add(Cut{body, index, vertex, 0, rough}); };
    const auto in_plane = [&](std::size_t plane) {
        const double from = rough_height(body, plane, edge.from);
        const double to = rough_height(body, plane, edge.to);
        const double part = from == to ? 0.0 : std::clamp(from / (from - to), 0.0, 1.0);
        add(Cut{body, index, -1, plane, p + part * (q - p)});
    };
    // An end that is only just inside of one plane is all that may be left.
    if (begins_at_end || ends_at_start) {
        if (begins_at_end && !ends_at_start && exit_plane == kNone) {
            at_vertex(edge.to, q);
        }
        if (ends_at_start && !begins_at_end && entry_plane == kNone) {
            at_vertex(edge.from, p);
        }
        return;
    }
    if (entry_plane != kNone && exit_plane != kNone && enters_after(body, edge, entry_plane, exit_plane)) {
        return;
    }
    entry_plane == kNone ? at_vertex(edge.from, p) : in_plane(entry_plane);
    exit_plane == kNone ? at_vertex(edge.to, q) : in_plane(exit_plane);
}

/// Whether an edge comes through one plane only after it has left through another.
bool ExactContactPoints::enters_after(int body, const FaceEdge& edge, std::size_t entry_plane,
                                      std::size_t exit_plane) {
    return ray_->sign([&]<class N>() {
        const N h0 = height<N>(body, entry_plane, edge.from);
        const N h1 = height<N>(body, entry_plane, edge.to);
        const N g0 = height<N>(body, exit_plane, edge.from);
        const N g1 = height<N>(body, exit_plane, edge.to);
        // h0 / (h0 - h1) > -g0 / (g1 - g0), both denominators > 0
        return h0 * (g1 - g0) + g0 * (h0 - h1);
    }) > 0;
}

std::span<const Vec3> ExactContactPoints::overlapping(ExactRay& ray) {
    ray_ = &ray;
    cuts_.clear();
    for (const int body : {0, 1}) {
        faces_[body].load(body == 0 ? ray.a() : ray.b(), ray.ordinary());
        normals_[body].clear();
        for (const FacePlane& plane : faces_[body].planes()) {
            normals_[body].push_back(faces_[body].rough_normal(plane));
        }
    }
    for (const int body : {0, 1}) {
        for (std::size_t edge = 0; edge < faces_[body].edges().size(); ++edge) {
            clip(body, edge);
        }
    }
    points_.clear();
    for (const Cut& cut : cuts_) {
        points_.push_back(rounded([&]<class N>() { return place<N>(cut); }));
    }
    std::sort(points_.begin(), points_.end(),
              [](Vec3 p, Vec3 q) { return std::tie(p.x, p.y, p.z) < std::tie(q.x, q.y, q.z); });
    return points_;
}

}  // namespace geomsrv
