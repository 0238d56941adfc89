// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
#include "geom/contact_plane.hpp"

#include <algorithm>
#include <cmath>
#include <tuple>
#include <utility>

namespace geomsrv {

void choose_axes(Vec3 normal, int (&axis)[2]) {
    const double size[3] = {std::fabs(normal.x), std::fabs(normal.y), std::fabs(normal.z)};
    const int k = size[0] >= size[1] && size[0] >= size[2] ? 0 : size[1] >= size[2] ? 1 : 2;
    axis[0] = (k + 1) % 3;
    axis[1] = (k + 2) % 3;
    if (component(normal, k) < 0.0) {
        std::swap(axis[0], axis[1]);
    }
}

void ContactPlane::face(Vec3 normal) { choose_axes(normal, axis_); }

Vec2 ContactPlane::flat(Vec3 v) const { return {component(v, axis_[0]), component(v, axis_[1])}; }

bool ContactPlane::vertices_first(const Point& p, const Point& q) {
    return std::make_tuple(p.from != p.to, p.body, p.from, p.to, p.part) <
           std::make_tuple(q.from != q.to, q.body, q.from, q.to, q.part);
}

void ContactPlane::merge(std::vector<Point>& points, double slack) {
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
}

void ContactPlane::hull(std::vector<Point>& points, double slack) {
    merge(points, slack);
    if (points.size() < 3) {
        return;
    }
    std::sort(points.begin(), points.end(),
              [](const Point& p, const Point& q) { return std::tie(p.x, p.y) < std::tie(q.x, q.y); });
    // Andrew's monotone chain: below from left to right, above from right to left.
    const auto bend = [](const Point& r, const Point& q, const Point& p) {
        return geomsrv::cross(Vec2{q.x - r.x, q.y - r.y}, {p.x - r.x, p.y - r.y});
    };
    chain_.clear();
    for (const bool above : {false, true}) {
        const std::size_t base = chain_.size();
        for (std::size_t k = 0; k < points.size(); ++k) {
            const Point& p = points[above ? points.size() - 1 - k : k];
            while (chain_.size() >= base + 2 && !(bend(chain_[chain_.size() - 2], chain_.back(), p) > 0.0)) {
                chain_.pop_back();
            }
            chain_.push_back(p);
        }
        chain_.pop_back();
    }
    // Only now what is near the line between its neighbours: points in one upright line are sorted by what
    // rounds.  At the end of a needle the neighbours lie both on one side.
    std::swap(points, chain_);
    for (std::size_t i = 0, kept = 0; kept < points.size() && points.size() > 2;) {
        const std::size_t count = points.size();
        const Point& q = points[i];
        const Point& r = points[(i + count - 1) % count];
        const Point& p = points[(i + 1) % count];
        const bool between = (r.x - q.x) * (p.x - q.x) + (r.y - q.y) * (p.y - q.y) <= 0.0;
        if (between && !(bend(r, q, p) > slack * norm(Vec2{p.x - r.x, p.y - r.y}))) {
            points.erase(points.begin() + static_cast<std::ptrdiff_t>(i));
            kept = 0;
            i = i == 0 ? points.size() - 1 : i - 1;
        } else {
            ++kept;
            i = (i + 1) % count;
        }
    }
}

/// What bounds a polygon or a segment.
void ContactPlane::sides_of(const std::vector<Point>& ring) {
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
void ContactPlane::clip(const std::vector<Point>& ring, double slack) {
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

void ContactPlane::cross(double slack) {
    for (const int body : {0, 1}) {
        sides_of(face_[1 - body]);
        clip(face_[body], slack);
    }
}

}  // namespace geomsrv
