// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
#include "geom/polytope_faces.hpp"

#include <algorithm>
#include <cmath>

#include "geom/core.hpp"
#include "geom/exact_direction.hpp"
#include "geom/rounding.hpp"
#include "geom/separation.hpp"

namespace geomsrv {

namespace {

// Arms between rounded vertices are off by 8 u of the reach (kVertexError, and the core's error, for both
// ends and their difference), which counts once for each of the three, and their determinant by another 10 u
// of itself.
constexpr double kArmError = 20 * kUnitRoundoff;

constexpr int kBoxCorners = 8;

double size_of(Vec3 v) { return std::fabs(v.x) + std::fabs(v.y) + std::fabs(v.z); }

}  // namespace

Vec3 PolytopeFaces::point(int i) const { return vertex_of(*rough_, i); }

Vec3 PolytopeFaces::rough_normal(const FacePlane& plane) const {
    Vec3 n;
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

/// +1 where l lies on the side of i j k to which (j - i) x (k - i) points.
int PolytopeFaces::orientation(int i, int j, int k, int l) const {
    const Vec3 base = point(i);
    const Vec3 e = point(j) - base;
    const Vec3 f = point(k) - base;
    const Vec3 g = point(l) - base;
    const double det = dot(cross(e, f), g);
    const double size_e = size_of(e);
    const double size_f = size_of(f);
    const double size_g = size_of(g);
    const double doubt = (kArmError * rough_->reach + 4.0 * rough_->error) *
                         (size_e * size_f + size_f * size_g + size_e * size_g);
    if (std::fabs(det) > doubt) {
        return det > 0.0 ? 1 : -1;
    }
    return sign([&]<class N>() {
        const VectorOf<N> p = vertex_times_denominator<N>(*exact_, i);
        return dot(
            cross(vertex_times_denominator<N>(*exact_, j) - p, vertex_times_denominator<N>(*exact_, k) - p),
            vertex_times_denominator<N>(*exact_, l) - p);
    });
}

void PolytopeFaces::load(const ExactAndRough& body, bool ordinary) {
    exact_ = &body.exact;
    rough_ = &body.rough;
    ordinary_ = ordinary;
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
    if (orientation(i, j, k, inside) > 0) {
        std::swap(i, j);
    }
    triangles_.push_back({{i, j, k}});
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
    kept_.clear();
    horizon_.clear();
    for (const Triangle& t : triangles_) {
        if (orientation(t.corner[0], t.corner[1], t.corner[2], x) <= 0) {
            kept_.push_back(t);
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
    // Seen triangles were counter-clockwise from outside, so their edges run the right way round for the new
    // ones.
    for (const FaceEdge& e : horizon_) {
        kept_.push_back({{e.from, e.to, x}});
    }
    std::swap(triangles_, kept_);
}

/// Triangles in one plane become one facet; edges between them go.
void PolytopeFaces::merge() {
    const auto across = [&](const Triangle& t, int from, int to) {
        for (int k = 0; k < 3; ++k) {
            if (t.corner[k] == to && t.corner[(k + 1) % 3] == from) {
                return t.corner[(k + 2) % 3];
            }
        }
        return -1;
    };
    // Spread each plane over its triangles.
    std::vector<int> open;
    for (std::size_t seed = 0; seed < triangles_.size(); ++seed) {
        if (triangles_[seed].plane >= 0) {
            continue;
        }
        const auto& c = triangles_[seed].corner;
        const int plane = static_cast<int>(planes_.size());
        planes_.push_back({FacePlane::Kind::facet, c[0], c[1], c[2], 1});
        triangles_[seed].plane = plane;
        open.assign(1, static_cast<int>(seed));
        while (!open.empty()) {
            const Triangle t = triangles_[static_cast<std::size_t>(open.back())];
            open.pop_back();
            for (int k = 0; k < 3; ++k) {
                const int from = t.corner[k];
                const int to = t.corner[(k + 1) % 3];
                for (std::size_t other = 0; other < triangles_.size(); ++other) {
                    const int opposite = across(triangles_[other], from, to);
                    if (opposite < 0) {
                        continue;
                    }
                    if (triangles_[other].plane < 0 &&
                        orientation(t.corner[0], t.corner[1], t.corner[2], opposite) == 0) {
                        triangles_[other].plane = plane;
                        open.push_back(static_cast<int>(other));
                    }
                    break;
                }
            }
        }
    }
    for (const Triangle& t : triangles_) {
        for (int k = 0; k < 3; ++k) {
            const int from = t.corner[k];
            const int to = t.corner[(k + 1) % 3];
            if (from > to) {
                continue;
            }
            for (const Triangle& other : triangles_) {
                if (across(other, from, to) >= 0) {
                    if (other.plane != t.plane) {
                        join({from, to, {std::min(t.plane, other.plane), std::max(t.plane, other.plane)}});
                    }
                    break;
                }
            }
        }
    }
}

/// Two planes have one edge in common, however many vertices are on it.
void PolytopeFaces::join(const FaceEdge& piece) {
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
