// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
#include "geom/placed_contact_points.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "geom/gjk.hpp"

namespace geomsrv {

namespace {

Vec3 vertex_between(const Core& core, const ContactPlane::Point& p) {
    const Vec3 from = vertex_of(core, p.from);
    return p.from == p.to ? from : (1.0 - p.part) * from + p.part * vertex_of(core, p.to);
}

}  // namespace

/// Vertices of a hull within a height of the highest, shifted in the plane.
void PlacedContactPoints::collect(const Core& core, Vec3 normal, double height, int body, Vec2 shift) {
    std::vector<Point>& face = plane_.face_of(body);
    face.clear();
    const double top = highest(core, normal).value;
    const double* const x = core.points;
    const double* const y = x + core.count;
    const double* const z = y + core.count;
    const double least = top - height - dot(normal, core.center);
    for (int i = 0; i < core.count; ++i) {
        if (normal.x * x[i] + normal.y * y[i] + normal.z * z[i] >= least) {
            const Vec2 v = plane_.flat(vertex_of(core, i));
            face.push_back({v.x - shift.x, v.y - shift.y, body, i, i, 0.0});
        }
    }
}

/// Of vertices that lie behind one another the foremost: of a thin body both sides may be within the band.
void PlacedContactPoints::keep_outermost(const Core& core, Vec3 normal, double near, int body) {
    std::vector<Point>& face = plane_.face_of(body);
    if (face.size() < 2) {
        return;
    }
    std::sort(face.begin(), face.end(), [&](const Point& p, const Point& q) {
        const double height_p = dot(normal, vertex_of(core, p.from));
        const double height_q = dot(normal, vertex_of(core, q.from));
        return height_p > height_q || (height_p == height_q && p.from < q.from);
    });
    sorted_.clear();
    for (const Point& p : face) {
        const bool hidden = std::any_of(sorted_.begin(), sorted_.end(), [&](const Point& q) {
            return std::fabs(p.x - q.x) <= near && std::fabs(p.y - q.y) <= near;
        });
        if (!hidden) {
            sorted_.push_back(p);
        }
    }
    std::swap(face, sorted_);
}

/// Whether the vertices collected are those of the last look; they are remembered.
bool PlacedContactPoints::same_faces() {
    bool same = true;
    for (const int body : {0, 1}) {
        const std::vector<Point>& face = plane_.face_of(body);
        std::vector<int>& known = known_[body];
        same = same && std::equal(face.begin(), face.end(), known.begin(), known.end(),
                                  [](const Point& p, int vertex) { return p.from == vertex; });
        known.clear();
        for (const Point& p : face) {
            known.push_back(p.from);
        }
    }
    return same;
}

/// Adds what the faces along a normal share to the candidates.
void PlacedContactPoints::look(const Core& a, const Core& b, Vec3 normal, const ContactBand& band,
                               const double height[2]) {
    const double near = band.near;
    plane_.face(normal);
    collect(a, normal, height[0], 0, {});
    // The plane is looked at along an axis: b has to be where it touches.
    const Vec2 along = plane_.flat(normal);
    collect(b, -normal, height[1], 1, {band.margin * along.x, band.margin * along.y});
    if (same_faces()) {
        return;
    }
    keep_outermost(a, normal, near, 0);
    keep_outermost(b, -normal, near, 1);
    std::vector<Point>& found = plane_.found();
    found.clear();
    for (const int body : {0, 1}) {
        // Of vertices within reach of one another one is left.
        if (plane_.face_of(body).size() == 1 && found.empty()) {
            found.push_back(plane_.face_of(body).front());
        }
    }
    if (found.empty()) {
        plane_.hull(plane_.face_of(0), near);
        plane_.hull(plane_.face_of(1), near);
        plane_.cross(near);
        plane_.merge(found, near);
    }
    for (const Point& p : found) {
        candidates_.push_back({p.body, vertex_between(p.body == 0 ? a : b, p)});
    }
}

std::span<const Vec3> PlacedContactPoints::between(const Core& a, const Core& b,
                                                   std::span<const Vec3> normals, Vec3 point,
                                                   const ContactBand& band) {
    points_.assign(1, point);
    candidates_.clear();
    known_[0].clear();
    known_[1].clear();
    const double tight[2] = {band.near, band.near};
    for (const Vec3 normal : normals) {
        look(a, b, normal, band, tight);
        look(a, b, normal, band, band.wide);
    }

    // In the plane of the first normal; the earlier ones are kept.
    plane_.face(normals[0]);
    rows_.clear();
    const auto add = [&](Vec3 place, std::size_t i) {
        const Vec2 at = plane_.flat(place);
        rows_.push_back({at.x, at.y, 0, static_cast<int>(i), static_cast<int>(i), 0.0});
    };
    for (std::size_t i = 0; i < candidates_.size(); ++i) {
        add(candidates_[i].place, i);
    }
    plane_.merge(rows_, band.near);
    if (rows_.size() < 2) {
        return points_;
    }
    sorted_ = rows_;
    rows_.clear();
    middles_.clear();
    for (const Point& p : sorted_) {
        const Candidate& candidate = candidates_[static_cast<std::size_t>(p.from)];
        Core one;
        one.center = candidate.place;
        one.reach = norm(candidate.place);
        const Gjk found = candidate.body == 0 ? gjk(one, b, normals[0]) : gjk(a, one, normals[0]);
        if (found.length <= band.apart) {
            middles_.push_back(0.5 * (found.point_a + found.point_b));
            add(middles_.back(), middles_.size() - 1);
        }
    }
    add(point, middles_.size());
    middles_.push_back(point);
    plane_.hull(rows_, band.near);
    if (rows_.size() > 1) {
        points_.clear();
        for (const Point& p : rows_) {
            points_.push_back(middles_[static_cast<std::size_t>(p.from)]);
        }
    }
    return points_;
}

}  // namespace geomsrv
