// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
#include "geom/contact_points.hpp"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "geom/convex_convex.hpp"
#include "geom/line_cast.hpp"

namespace geomsrv {

namespace {

double component(Vec3 v, int k) { return k == 0 ? v.x : k == 1 ? v.y : v.z; }

/// A vertex of a body as given, rounded.
Vec3 given_vertex(const ExactBody& body, int vertex) {
    if (body.kind == ExactBody::Kind::hull) {
        const double* const p = body.points + 3 * static_cast<std::ptrdiff_t>(vertex);
        return {p[0], p[1], p[2]};
    }
    Vec3 v = body.center;
    for (int i = 0; i < body.generators; ++i) {
        v = v + ((vertex >> i & 1) != 0 ? body.half[i] : -body.half[i]) * body.axis[i];
    }
    return v;
}

/// The part of an edge within a bound, by its ends' heights above it; false if nothing is left.
bool clip_part(double from, double to, double slack, double& first, double& last) {
    if (from <= slack && to <= slack) {
        return true;
    }
    if (from > slack && to > slack) {
        return false;
    }
    // One end is outside by more than the slack, the other is inside or near the bound.
    const double crossing = std::clamp(from / (from - to), 0.0, 1.0);
    if (from > to) {
        first = std::max(first, crossing);
    } else {
        last = std::min(last, crossing);
    }
    return true;
}

}  // namespace

/// Vertices of a body within the slack of the outermost, in the plane.
void ContactPoints::collect(const Core& core, int listed, Vec3 normal, double slack, int body, Vec2 shift,
                            bool lowest) {
    const Vec3 n = lowest ? -normal : normal;
    std::vector<Point>& out = face_[body];
    out.clear();
    const double top = dot(n, vertex_of(core, highest(core, n).vertex));
    for (int i = 0; i < listed; ++i) {
        const Vec3 v = vertex_of(core, i);
        if (dot(n, v) >= top - slack) {
            out.push_back(
                {component(v, axis_[0]) + shift.x, component(v, axis_[1]) + shift.y, body, i, i, 0.0});
        }
    }
}

bool ContactPoints::vertices_first(const Point& p, const Point& q) {
    return std::make_tuple(p.from != p.to, p.body, p.from, p.to, p.part) <
           std::make_tuple(q.from != q.to, q.body, q.from, q.to, q.part);
}

/// Leaves the corners of the hull, counter-clockwise; of points within the slack of one another, a vertex.
void ContactPoints::hull(std::vector<Point>& points, double slack) {
    std::sort(points.begin(), points.end(), vertices_first);
    chain_.clear();
    for (const Point& p : points) {
        const bool known = std::any_of(chain_.begin(), chain_.end(), [&](const Point& q) {
            return std::fabs(p.x - q.x) <= slack && std::fabs(p.y - q.y) <= slack;
        });
        if (!known) {
            chain_.push_back(p);
        }
    }
    std::swap(points, chain_);
    if (points.size() < 3) {
        return;
    }
    std::sort(points.begin(), points.end(),
              [](const Point& p, const Point& q) { return std::tie(p.x, p.y) < std::tie(q.x, q.y); });
    // Andrew's monotone chain: below from left to right, above from right to left.
    chain_.clear();
    for (const bool above : {false, true}) {
        const std::size_t base = chain_.size();
        for (std::size_t k = 0; k < points.size(); ++k) {
            const Point& p = points[above ? points.size() - 1 - k : k];
            while (chain_.size() >= base + 2) {
                const Point& q = chain_[chain_.size() - 1];
                const Point& r = chain_[chain_.size() - 2];
                const Vec2 chord = {p.x - r.x, p.y - r.y};
                if (cross(Vec2{q.x - r.x, q.y - r.y}, chord) > slack * norm(chord)) {
                    break;
                }
                chain_.pop_back();
            }
            chain_.push_back(p);
        }
        chain_.pop_back();
    }
    std::swap(points, chain_);
}

/// What bounds a polygon or a segment.
void ContactPoints::sides_of(const std::vector<Point>& ring) {
    sides_.clear();
    const auto add = [&](Vec2 n, const Point& p) {
        const double length = norm(n);
        sides_.push_back({n.x / length, n.y / length, (n.x * p.x + n.y * p.y) / length});
    };
    for (std::size_t i = 0; i < ring.size(); ++i) {
        const Point& p = ring[i];
        const Point& q = ring[i + 1 == ring.size() ? 0 : i + 1];
        const Vec2 along = {q.x - p.x, q.y - p.y};
        add({along.y, -along.x}, p);
        if (ring.size() == 2) {
            add(along, q);
        }
    }
}

/// Adds the ends of what is left of the edges of a polygon or segment between the sides.
void ContactPoints::clip(const std::vector<Point>& ring, double slack) {
    const std::size_t edges = ring.size() == 2 ? 1 : ring.size();
    for (std::size_t i = 0; i < edges; ++i) {
        const Point& p = ring[i];
        const Point& q = ring[i + 1 == ring.size() ? 0 : i + 1];
        double first = 0.0;
        double last = 1.0;
        bool left = true;
        for (const Side& side : sides_) {
            const auto height = [&](const Point& at) {
                return side.nx * at.x + side.ny * at.y - side.offset;
            };
            left = left && clip_part(height(p), height(q), slack, first, last);
        }
        const double length = norm(Vec2{q.x - p.x, q.y - p.y});
        if (!left || (first - last) * length > slack) {
            continue;
        }
        for (const double part : {std::min(first, last), std::max(first, last)}) {
            const int from = part == 1.0 ? q.from : p.from;
            const int to = part == 0.0 ? p.from : q.from;
            found_.push_back({p.x + part * (q.x - p.x), p.y + part * (q.y - p.y), p.body, from, to, part});
        }
    }
}

Vec3 ContactPoints::world(const MovingPair& pair, const Point& point, double moment) const {
    const MovingBody& body = point.body == 0 ? pair.given_a() : pair.given_b();
    const Vec3 from = given_vertex(body.body, point.from);
    const Vec3 moved = moment > 0.0 ? pair.way(body, moment) : Vec3{};
    if (point.from == point.to) {
        return from + moved;
    }
    const Vec3 to = given_vertex(body.body, point.to);
    return ((1.0 - point.part) * from + point.part * to) + moved;
}

std::span<const Vec3> ContactPoints::touching(const MovingPair& pair, Vec3 normal, double moment,
                                              const ContactSlack& slack) {
    // Along the largest component of the normal onto the plane of the other two, the right way round.
    const double size[3] = {std::fabs(normal.x), std::fabs(normal.y), std::fabs(normal.z)};
    const int k = size[0] >= size[1] && size[0] >= size[2] ? 0 : size[1] >= size[2] ? 1 : 2;
    axis_[0] = (k + 1) % 3;
    axis_[1] = (k + 2) % 3;
    if (component(normal, k) < 0.0) {
        std::swap(axis_[0], axis_[1]);
    }
    const Vec3 w = pair.velocity();
    const bool moved = moment > 0.0;
    const Vec2 shift = {moved ? moment * component(w, axis_[0]) : 0.0,
                        moved ? moment * component(w, axis_[1]) : 0.0};
    collect(pair.a(), pair.given_a().body.count(), normal, slack.height, 0, {}, false);
    collect(pair.b(), pair.given_b().body.count(), normal, slack.height, 1, shift, true);
    for (std::vector<Point>& face : face_) {
        hull(face, slack.place);
    }
    found_.clear();
    for (const int lone : {0, 1}) {
        if (face_[lone].size() == 1 && found_.empty()) {
            found_ = face_[lone];
        }
    }
    // What misses by more than the slack, because its place is that much less certain, is sought with more.
    constexpr double kMoreSlack = 16.0;
    constexpr int kMostTries = 8;
    double nearness = slack.place;
    for (int tries = 0; tries < kMostTries && found_.empty(); ++tries, nearness *= kMoreSlack) {
        for (const int body : {0, 1}) {
            sides_of(face_[1 - body]);
            clip(face_[body], nearness);
        }
        hull(found_, nearness);
    }
    points_.clear();
    for (const Point& point : found_) {
        points_.push_back(world(pair, point, moment));
    }
    return points_;
}

/// What bounds a polytope, in float64.  Two planes that meet at a sharp edge say, within a slack, little of
/// how far the body goes there, so a third one stands across it; needles are cut off at both ends.
void ContactPoints::bounds_of(const Core& core, const PolytopeFaces& faces) {
    bounds_.clear();
    for (const FacePlane& plane : faces.planes()) {
        bounds_.push_back({faces.rough_normal(plane), vertex_of(core, plane.i)});
    }
    const int count = faces.exact().count();
    const auto add = [&](Vec3 normal) {
        bounds_.push_back({normal, vertex_of(core, highest(core, normal).vertex)});
    };
    Vec3 middle;
    Vec3 longest;
    for (int i = 0; i < count; ++i) {
        const Vec3 v = vertex_of(core, i);
        middle = middle + (1.0 / count) * v;
        const Vec3 arm = v - vertex_of(core, 0);
        longest = dot(arm, arm) > dot(longest, longest) ? arm : longest;
    }
    if (dot(longest, longest) > 0.0) {
        add(normalized(longest));
        add(-normalized(longest));
    }
    for (const FaceEdge& edge : faces.edges()) {
        if (edge.beside[0] < 0) {
            continue;
        }
        const Vec3 n = bounds_[static_cast<std::size_t>(edge.beside[0])].normal;
        if (!(dot(n, bounds_[static_cast<std::size_t>(edge.beside[1])].normal) < 0.0)) {
            continue;
        }
        const Vec3 from = vertex_of(core, edge.from);
        const Vec3 across = cross(vertex_of(core, edge.to) - from, n);
        const double length = norm(across);
        if (length > 0.0) {
            const Vec3 m = (1.0 / length) * across;
            add(dot(m, middle - from) > 0.0 ? -m : m);
        }
    }
}

std::span<const Vec3> ContactPoints::overlapping(const MovingPair& pair, double slack) {
    const Core* const core[2] = {&pair.a(), &pair.b()};
    const MovingBody* const given[2] = {&pair.given_a(), &pair.given_b()};
    for (const int body : {0, 1}) {
        faces_[body].load({given[body]->body, *core[body]}, pair.ordinary());
    }
    found_.clear();
    for (const int body : {0, 1}) {
        bounds_of(*core[1 - body], faces_[1 - body]);
        for (const FaceEdge& edge : faces_[body].edges()) {
            const Vec3 p = vertex_of(*core[body], edge.from);
            const Vec3 q = vertex_of(*core[body], edge.to);
            double first = 0.0;
            double last = 1.0;
            bool left = true;
            for (std::size_t i = 0; i < bounds_.size() && left; ++i) {
                const Plane& plane = bounds_[i];
                left = clip_part(dot(plane.normal, p - plane.base), dot(plane.normal, q - plane.base), slack,
                                 first, last);
            }
            if (!left || (first - last) * norm(q - p) > slack) {
                continue;
            }
            for (const double part : {std::min(first, last), std::max(first, last)}) {
                const int from = part == 1.0 ? edge.to : edge.from;
                const int to = part == 0.0 ? edge.from : edge.to;
                found_.push_back({0.0, 0.0, body, from, to, part});
            }
        }
    }
    // Points within the slack of the hull of the others go; crossings first.
    std::sort(found_.begin(), found_.end(),
              [](const Point& p, const Point& q) { return vertices_first(q, p); });
    std::vector<Vec3> local;
    for (const Point& point : found_) {
        const Vec3 from = vertex_of(*core[point.body], point.from);
        const Vec3 to = vertex_of(*core[point.body], point.to);
        local.push_back(from + point.part * (to - from));
    }
    for (std::size_t i = 0; i < found_.size() && found_.size() > 1;) {
        const std::size_t others = found_.size() - 1;
        rows_.resize(3 * others);
        for (std::size_t k = 0, row = 0; k < local.size(); ++k) {
            if (k != i) {
                rows_[row] = local[k].x;
                rows_[others + row] = local[k].y;
                rows_[2 * others + row] = local[k].z;
                ++row;
            }
        }
        Core one;
        one.center = local[i];
        one.reach = pair.reach();
        Core hull_of_others;
        hull_of_others.points = rows_.data();
        hull_of_others.count = static_cast<int>(others);
        hull_of_others.reach = pair.reach();
        if (convex_convex(one, hull_of_others, false).value <= slack) {
            found_.erase(found_.begin() + static_cast<std::ptrdiff_t>(i));
            local.erase(local.begin() + static_cast<std::ptrdiff_t>(i));
        } else {
            ++i;
        }
    }
    points_.clear();
    for (const Point& point : found_) {
        points_.push_back(world(pair, point, 0.0));
    }
    return points_;
}

}  // namespace geomsrv
