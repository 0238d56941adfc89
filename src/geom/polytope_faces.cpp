// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
#include "geom/polytope_faces.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "geom/core.hpp"
#include "geom/exact_direction.hpp"
#include "geom/place.hpp"
#include "geom/rounding.hpp"
#include "geom/separation.hpp"

namespace geomsrv {

namespace {

// Arms between rounded vertices are off by 8 u of the reach (kVertexError, and the core's error, for both
// ends and their difference), which counts once for each of the three, and their determinant by another 10 u
// of itself.
constexpr double kArmError = 20 * kUnitRoundoff;

// A normal that is at least so large, in terms of its edges, is known to a share of 2^-60: in double-double
// each entry is off by 2^-98 of the edges' product (two products and a difference, 2^-102 each of up to twice
// that).
constexpr double kPlainNormal = 0x1p-38;

constexpr int kBoxCorners = 8;

double size_of(Vec3 v) { return std::fabs(v.x) + std::fabs(v.y) + std::fabs(v.z); }

}  // namespace

Vec3 PolytopeFaces::point(int i) const { return vertex_of(*rough_, i); }

Vec3 PolytopeFaces::rough_normal(const FacePlane& plane) const {
    Vec3 n;
    const bool plain = ordinary_ && exact_->kind == ExactBody::Kind::hull && exact_->is_unmoved() &&
                       plane.kind == FacePlane::Kind::facet;
    if (plain) {
        // Listed points are exact, so double-double does, unless most of it cancels.
        const auto step = [&](int to) {
            return exact_difference(exact_->listed_point(to), exact_->listed_point(plane.i));
        };
        const WideVec3 e = step(plane.j);
        const WideVec3 f = step(plane.k);
        n = narrow(cross(e, f));
        const double size = largest_of(n);
        if (size > kPlainNormal * (largest_of(narrow(e)) * largest_of(narrow(f)))) {
            return normalized((plane.sign / size) * n);
        }
    }
    if (!ordinary_ || !round_direction(normal<Enclosed>(plane), n)) {
        const VectorOf<Exact> exact = normal<Exact>(plane);
        if (sign_of(exact.x) == 0 && sign_of(exact.y) == 0 && sign_of(exact.z) == 0) {
            return {};
        }
        round_direction(exact, n);
    }
    const double size = std::max({std::fabs(n.x), std::fabs(n.y), std::fabs(n.z)});
    return normalized((1.0 / size) * n);
}

template <class F>
int PolytopeFaces::sign(const F& f) const {
    if (ordinary_) {
        const int known = sign_of(f.template operator()<Enclosed>());
        if (known != kUncertain) {
            return known;
        }
    }
    return sign_of(f.template operator()<Exact>());
}

PolytopeFaces::Triangle PolytopeFaces::triangle(int i, int j, int k) const {
    Triangle t{{i, j, k}, -1, point(i), {}};
    const Vec3 e = point(j) - t.base;
    const Vec3 f = point(k) - t.base;
    t.normal = cross(e, f);
    t.product = size_of(e) * size_of(f);
    t.sum = size_of(e) + size_of(f);
    return t;
}

/// +1 where l lies on the side to which the triangle's normal points.
int PolytopeFaces::orientation(const Triangle& t, int l) const {
    const int known = rough_orientation(t, point(l));
    return known != 0 ? known : exact_orientation(t, l);
}

/// The same in float64, of a rounded vertex; 0 where that cannot tell.
int PolytopeFaces::rough_orientation(const Triangle& t, Vec3 l) const {
    const Vec3 g = l - t.base;
    const double det = dot(t.normal, g);
    const double doubt = doubt_ * (t.product + t.sum * size_of(g));
    return det > doubt ? 1 : det < -doubt ? -1 : 0;
}

int PolytopeFaces::exact_orientation(const Triangle& t, int l) const {
    return sign([&]<class N>() {
        const auto step = [&](int to) { return step_times_denominator<N>(*exact_, t.corner[0], to); };
        return dot(cross(step(t.corner[1]), step(t.corner[2])), step(l));
    });
}

void PolytopeFaces::load(const ExactAndRough& body, bool ordinary) {
    exact_ = &body.exact;
    rough_ = &body.rough;
    ordinary_ = ordinary;
    doubt_ = kArmError * rough_->reach + 4.0 * rough_->error;
    planes_.clear();
    edges_.clear();
    const bool box = exact_->kind == ExactBody::Kind::zonotope && exact_->generators == 3 &&
                     exact_->half[0] > 0.0 && exact_->half[1] > 0.0 && exact_->half[2] > 0.0;
    if (box) {
        load_box();
        return;
    }
    // Four independent points; each the first that is not in the span of those before.
    const int count = exact_->count();
    const auto apart = [&](int i, int j) {
        for (int k = 0; k < 3; ++k) {
            const int differs = sign([&]<class N>() {
                const VectorOf<N> d =
                    vertex_times_denominator<N>(*exact_, j) - vertex_times_denominator<N>(*exact_, i);
                return k == 0 ? d.x : k == 1 ? d.y : d.z;
            });
            if (differs != 0) {
                return true;
            }
        }
        return false;
    };
    const auto bent = [&](int i, int j, int l) {
        for (int k = 0; k < 3; ++k) {
            const int differs = sign([&]<class N>() {
                const VectorOf<N> p = vertex_times_denominator<N>(*exact_, i);
                const VectorOf<N> n = cross(vertex_times_denominator<N>(*exact_, j) - p,
                                            vertex_times_denominator<N>(*exact_, l) - p);
                return k == 0 ? n.x : k == 1 ? n.y : n.z;
            });
            if (differs != 0) {
                return true;
            }
        }
        return false;
    };
    int start[4] = {0, 1, 2, 3};
    for (; start[1] < count && !apart(0, start[1]); ++start[1]) {
    }
    if (start[1] == count) {
        load_point(0);
        return;
    }
    for (start[2] = start[1] + 1; start[2] < count && !bent(0, start[1], start[2]); ++start[2]) {
    }
    if (start[2] == count) {
        load_segment(0, start[1]);
        return;
    }
    for (start[3] = start[2] + 1; start[3] < count && orientation(0, start[1], start[2], start[3]) == 0;
         ++start[3]) {
    }
    if (start[3] == count) {
        load_polygon(0, start[1], start[2]);
        return;
    }
    load_solid(start);
}

void PolytopeFaces::load_box() {
    // Corner bits as in Core; a facet is the set of corners that agree in one bit.  Axes may be left-handed.
    const bool left_handed = orientation(0, 1, 2, 4) < 0;
    int plane_of[3][2];
    for (int k = 0; k < 3; ++k) {
        const int u = 1 << (k + 1) % 3;
        const int v = 1 << (k + 2) % 3;
        for (const int side : {0, 1}) {
            const int corner = side << k;
            plane_of[k][side] = static_cast<int>(planes_.size());
            planes_.push_back({FacePlane::Kind::facet, corner, corner | u, corner | v,
                               (side == 1) != left_handed ? 1 : -1});
        }
    }
    for (int k = 0; k < 3; ++k) {
        const int first = (k + 1) % 3;
        const int second = (k + 2) % 3;
        for (int corner = 0; corner < kBoxCorners; ++corner) {
            if ((corner >> k & 1) == 0) {
                edges_.push_back(
                    {corner,
                     corner | 1 << k,
                     {plane_of[first][corner >> first & 1], plane_of[second][corner >> second & 1]}});
            }
        }
    }
}

void PolytopeFaces::load_point(int i) {
    for (int k = 0; k < 3; ++k) {
        for (const int side : {-1, 1}) {
            planes_.push_back({FacePlane::Kind::axis, i, i, k, side});
        }
    }
    edges_.push_back({i, i, {}});
}

void PolytopeFaces::load_segment(int i, int j) {
    // All points are on the line; the ends are furthest along it.
    const auto beyond = [&](int from, int to, int x) {
        return sign([&]<class N>() {
                   const VectorOf<N> end = vertex_times_denominator<N>(*exact_, to);
                   return dot(end - vertex_times_denominator<N>(*exact_, from),
                              vertex_times_denominator<N>(*exact_, x) - end);
               }) > 0;
    };
    for (int x = 0; x < exact_->count(); ++x) {
        if (beyond(i, j, x)) {
            j = x;
        }
        if (beyond(j, i, x)) {
            i = x;
        }
    }
    planes_.push_back({FacePlane::Kind::end, i, j, 0, 1});
    planes_.push_back({FacePlane::Kind::end, j, i, 0, 1});
    for (int k = 0; k < 3; ++k) {
        for (const int side : {-1, 1}) {
            planes_.push_back({FacePlane::Kind::across, i, j, k, side});
        }
    }
    edges_.push_back({i, j, {}});
}

void PolytopeFaces::load_polygon(int i, int j, int k) {
    // Gift wrapping in the plane: the next corner is the one that no point is to the right of; of several in
    // a row the furthest.  Left and right are seen from the tip of (j - i) x (k - i).
    const auto side = [&](int from, int to, int x) {
        return sign([&]<class N>() {
            const VectorOf<N> p = vertex_times_denominator<N>(*exact_, i);
            const VectorOf<N> up = cross(vertex_times_denominator<N>(*exact_, j) - p,
                                         vertex_times_denominator<N>(*exact_, k) - p);
            const VectorOf<N> base = vertex_times_denominator<N>(*exact_, from);
            return dot(up, cross(vertex_times_denominator<N>(*exact_, to) - base,
                                 vertex_times_denominator<N>(*exact_, x) - base));
        });
    };
    const auto further = [&](int from, int to, int x) {
        return sign([&]<class N>() {
                   const VectorOf<N> end = vertex_times_denominator<N>(*exact_, to);
                   return dot(end - vertex_times_denominator<N>(*exact_, from),
                              vertex_times_denominator<N>(*exact_, x) - end);
               }) > 0;
    };
    const auto same = [&](int x, int y) {
        for (int c = 0; c < 3; ++c) {
            const int differs = sign([&]<class N>() {
                const VectorOf<N> d =
                    vertex_times_denominator<N>(*exact_, x) - vertex_times_denominator<N>(*exact_, y);
                return c == 0 ? d.x : c == 1 ? d.y : d.z;
            });
            if (differs != 0) {
                return false;
            }
        }
        return true;
    };
    const int count = exact_->count();
    // A corner to start at: furthest along (j - i), of several the furthest to the left.
    int first = i;
    for (int x = 0; x < count; ++x) {
        const int along = sign([&]<class N>() {
            return dot(vertex_times_denominator<N>(*exact_, j) - vertex_times_denominator<N>(*exact_, i),
                       vertex_times_denominator<N>(*exact_, x) - vertex_times_denominator<N>(*exact_, first));
        });
        const int left = along != 0 ? 0 : sign([&]<class N>() {
            const VectorOf<N> p = vertex_times_denominator<N>(*exact_, i);
            const VectorOf<N> e = vertex_times_denominator<N>(*exact_, j) - p;
            return dot(cross(cross(e, vertex_times_denominator<N>(*exact_, k) - p), e),
                       vertex_times_denominator<N>(*exact_, x) - vertex_times_denominator<N>(*exact_, first));
        });
        if (along > 0 || left > 0) {
            first = x;
        }
    }
    planes_.push_back({FacePlane::Kind::facet, i, j, k, 1});
    planes_.push_back({FacePlane::Kind::facet, i, j, k, -1});
    int corner = first;
    do {
        int next = -1;
        for (int x = 0; x < count; ++x) {
            if (x == corner || same(x, corner)) {
                continue;
            }
            const int turn = next < 0 ? -1 : side(corner, next, x);
            if (turn < 0 || (turn == 0 && further(corner, next, x))) {
                next = x;
            }
        }
        // The outward normal of the edge lies to its right: away from a corner to the left, across the edge.
        const int inner = side(corner, next, i) > 0 ? i : side(corner, next, j) > 0 ? j : k;
        // (b - a) x ((b - a) x (c - a)) points away from c.
        planes_.push_back({FacePlane::Kind::side, corner, next, inner, 1});
        edges_.push_back({corner, next, {}});
        corner = next;
    } while (!same(corner, first));
}

/// A triangle with the vertex `inside` below it.
void PolytopeFaces::add(int i, int j, int k, int inside) {
    const Triangle t = triangle(i, j, k);
    triangles_.push_back(orientation(t, inside) > 0 ? triangle(j, i, k) : t);
}

void PolytopeFaces::load_solid(const int (&start)[4]) {
    triangles_.clear();
    for (int omitted = 0; omitted < 4; ++omitted) {
        add(start[(omitted + 1) & 3], start[(omitted + 2) & 3], start[(omitted + 3) & 3], start[omitted]);
    }
    for (int x = 0; x < exact_->count(); ++x) {
        if (x != start[0] && x != start[1] && x != start[2] && x != start[3]) {
            insert(x);
        }
    }
    merge();
}

/// Replaces what is seen from a point by triangles from it to the horizon.
void PolytopeFaces::insert(int x) {
    horizon_.clear();
    const Vec3 place = point(x);
    std::size_t kept = 0;
    for (std::size_t i = 0; i < triangles_.size(); ++i) {
        const Triangle& t = triangles_[i];
        const int known = rough_orientation(t, place);
        if (known < 0 || (known == 0 && exact_orientation(t, x) <= 0)) {
            if (kept != i) {
                triangles_[kept] = t;
            }
            ++kept;
            continue;
        }
        for (int k = 0; k < 3; ++k) {
            const FaceEdge edge{t.corner[k], t.corner[(k + 1) % 3], {}};
            const auto twin = std::find_if(horizon_.begin(), horizon_.end(), [&](const FaceEdge& e) {
                return e.from == edge.to && e.to == edge.from;
            });
            if (twin == horizon_.end()) {
                horizon_.push_back(edge);
            } else {
                *twin = horizon_.back();
                horizon_.pop_back();
            }
        }
    }
    if (horizon_.empty()) {
        return;
    }
    triangles_.resize(kept);
    // Seen triangles were counter-clockwise from outside, so their edges run the right way round for the new
    // ones.
    for (const FaceEdge& e : horizon_) {
        triangles_.push_back(triangle(e.from, e.to, x));
    }
}

/// Every side of a triangle runs back in exactly one other.
void PolytopeFaces::find_neighbours() {
    const std::size_t sides = 3 * triangles_.size();
    first_side_.assign(static_cast<std::size_t>(exact_->count()), -1);
    next_side_.resize(sides);
    end_.resize(sides);
    twin_.assign(sides, -1);
    for (std::size_t side = 0; side < sides; ++side) {
        const auto& corner = triangles_[side / 3].corner;
        const int from = corner[side % 3];
        const int to = corner[(side + 1) % 3];
        end_[side] = to;
        int& first = first_side_[static_cast<std::size_t>(from)];
        next_side_[side] = std::exchange(first, static_cast<int>(side));
        // The one that runs back starts where this one ends; whichever comes later finds the other.
        int other = first_side_[static_cast<std::size_t>(to)];
        while (other >= 0 && end_[static_cast<std::size_t>(other)] != from) {
            other = next_side_[static_cast<std::size_t>(other)];
        }
        if (other >= 0) {
            twin_[side] = other;
            twin_[static_cast<std::size_t>(other)] = static_cast<int>(side);
        }
    }
}

/// Triangles in one plane become one facet; edges between them go.
void PolytopeFaces::merge() {
    find_neighbours();
    // Spread each plane over its triangles.
    pieces_.clear();
    for (std::size_t seed = 0; seed < triangles_.size(); ++seed) {
        if (triangles_[seed].plane >= 0) {
            continue;
        }
        const auto& c = triangles_[seed].corner;
        const int plane = static_cast<int>(planes_.size());
        planes_.push_back({FacePlane::Kind::facet, c[0], c[1], c[2], 1});
        pieces_.push_back(1);
        triangles_[seed].plane = plane;
        open_.assign(1, static_cast<int>(seed));
        while (!open_.empty()) {
            const auto triangle = static_cast<std::size_t>(open_.back());
            open_.pop_back();
            for (std::size_t k = 0; k < 3; ++k) {
                const int side = twin_[3 * triangle + k];
                if (side < 0) {
                    continue;
                }
                Triangle& other = triangles_[static_cast<std::size_t>(side / 3)];
                const int opposite = other.corner[(side + 2) % 3];
                if (other.plane < 0 && orientation(triangles_[triangle], opposite) == 0) {
                    other.plane = plane;
                    ++pieces_[static_cast<std::size_t>(plane)];
                    open_.push_back(side / 3);
                }
            }
        }
    }
    for (std::size_t side = 0; side < twin_.size(); ++side) {
        const Triangle& t = triangles_[side / 3];
        const int from = t.corner[side % 3];
        const int to = t.corner[(side + 1) % 3];
        if (from > to || twin_[side] < 0) {
            continue;
        }
        const int plane = triangles_[static_cast<std::size_t>(twin_[side] / 3)].plane;
        if (plane != t.plane) {
            join({from, to, {std::min(t.plane, plane), std::max(t.plane, plane)}});
        }
    }
}

/// Two planes have one edge in common, however many vertices are on it.
void PolytopeFaces::join(const FaceEdge& piece) {
    // What a single triangle shares with another plane is one of its sides, in one piece.
    const auto lone = [&](int plane) { return pieces_[static_cast<std::size_t>(plane)] == 1; };
    if (lone(piece.beside[0]) || lone(piece.beside[1])) {
        edges_.push_back(piece);
        return;
    }
    for (FaceEdge& edge : edges_) {
        if (edge.beside[0] != piece.beside[0] || edge.beside[1] != piece.beside[1]) {
            continue;
        }
        for (const int x : {piece.from, piece.to}) {
            const auto beyond = [&](int from, int to) {
                return sign([&]<class N>() {
                           const VectorOf<N> end = vertex_times_denominator<N>(*exact_, to);
                           return dot(end - vertex_times_denominator<N>(*exact_, from),
                                      vertex_times_denominator<N>(*exact_, x) - end);
                       }) > 0;
            };
            if (beyond(edge.from, edge.to)) {
                edge.to = x;
            } else if (beyond(edge.to, edge.from)) {
                edge.from = x;
            }
        }
        return;
    }
    edges_.push_back(piece);
}

}  // namespace geomsrv
