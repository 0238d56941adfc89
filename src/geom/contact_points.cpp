// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
#include "geom/contact_points.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <limits>
#include <utility>

#include "geom/convex_convex.hpp"
#include "geom/lanes.hpp"
#include "geom/line_cast.hpp"

namespace geomsrv {

namespace {

constexpr std::size_t kLanes = Lanes::kCount;
constexpr int kWord = 64;

// So many heights of vertices above planes are worth finding beforehand, though most edges of large hulls end
// at the first planes that they are held against: 128 KiB.
constexpr std::size_t kMostHeights = std::size_t{1} << 14;

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

/// What planes leave of an edge, and which of them end it.
struct Span {
    double first = 0.0;
    double last = 1.0;
    int first_plane = -1;
    int last_plane = -1;
    bool any = true;
};

/// Heights of a hull's points along n, and the greatest.
GEOMSRV_WIDE_CLONES double heights(const Core& core, Vec3 n, double* out) {
    const double* const x = core.points;
    const double* const y = x + core.count;
    const double* const z = y + core.count;
    Lanes top = -std::numeric_limits<double>::infinity();
    for (int i = 0; i < core.count; i += Lanes::kCount) {
        const Lanes height = Lanes(n.x) * Lanes::load(x + i) + Lanes(n.y) * Lanes::load(y + i) +
                             Lanes(n.z) * Lanes::load(z + i);
        height.store(out + i);
        top = greater(top, height);
    }
    return greatest(top);
}

using PlaneRows = std::vector<double>[6];

/// Heights of a point above four planes.
GEOMSRV_INLINE Lanes heights_above_four(const PlaneRows& row, std::size_t k, Vec3 p) {
    const auto part = [&](int normal, double v, int base) __attribute__((always_inline)) {
        return Lanes::load(row[normal].data() + k) * (Lanes(v) - Lanes::load(row[base].data() + k));
    };
    return part(0, p.x, 3) + part(1, p.y, 4) + part(2, p.z, 5);
}

/// And above all.
GEOMSRV_WIDE_CLONES void heights_above(const PlaneRows& row, Vec3 p, double* out) {
    for (std::size_t k = 0; k < row[0].size(); k += kLanes) heights_above_four(row, k, p).store(out + k);
}

/// Whether a plane has both points more than the slack above it.
GEOMSRV_WIDE_CLONES bool are_outside(const PlaneRows& row, Vec3 p, Vec3 q, double slack) {
    for (std::size_t k = 0; k < row[0].size(); k += kLanes) {
        const Lanes most = slack;
        if (any((most < heights_above_four(row, k, p)) & (most < heights_above_four(row, k, q)))) return true;
    }
    return false;
}

/// Which of up to 64 numbers, in whole lanes, are not less than one: number i as bit i.
GEOMSRV_WIDE_CLONES std::uint64_t at_least(const double* numbers, std::size_t count, double least) {
    LaneMask found = Lanes(0.0) < Lanes(0.0);
    for (std::size_t i = 0, block = 0; i < count; i += kLanes, ++block) {
        found = found | bits_of_block(Lanes(least) <= Lanes::load(numbers + i), block);
    }
    return joined(found);
}

/// clip_part() by all planes, of which the heights of both ends are given, four at a time.
GEOMSRV_WIDE_CLONES Span clip_edge(const double* from, const double* to, std::size_t planes, double slack) {
    const Lanes most = slack;
    const Lanes none = 0.0;
    const Lanes all_of_it = 1.0;
    LaneMask any_out = none < none;
    for (std::size_t k = 0; k < planes; k += kLanes) {
        const LaneMask starts_out = most < Lanes::load(from + k);
        const LaneMask ends_out = most < Lanes::load(to + k);
        if (any(starts_out & ends_out)) {
            return {.any = false};
        }
        any_out = any_out | starts_out | ends_out;
    }
    Span out;
    if (!any(any_out)) {
        return out;
    }
    Lanes first = none;
    Lanes last = all_of_it;
    Lanes first_plane = -1.0;
    Lanes last_plane = -1.0;
    for (std::size_t k = 0; k < planes; k += kLanes) {
        const Lanes start = Lanes::load(from + k);
        const Lanes end = Lanes::load(to + k);
        const Lanes crossing = greater(none, lesser(all_of_it, start / (start - end)));
        const Lanes plane = static_cast<double>(k);
        const LaneMask later = (most < start) & (first < crossing);
        const LaneMask sooner = (most < end) & (crossing < last);
        first = select(later, crossing, first);
        first_plane = select(later, plane, first_plane);
        last = select(sooner, crossing, last);
        last_plane = select(sooner, plane, last_plane);
    }
    // Of equal ones the plane that is listed first.
    for (int i = 0; i < Lanes::kCount; ++i) {
        const auto in_lane = [&](const Lanes& plane) {
            return plane[i] < 0.0 ? -1 : static_cast<int>(plane[i]) + i;
        };
        const int opening = in_lane(first_plane);
        if (opening >= 0 && (first[i] > out.first || (first[i] == out.first && opening < out.first_plane))) {
            out.first = first[i];
            out.first_plane = opening;
        }
        const int closing = in_lane(last_plane);
        if (closing >= 0 && (last[i] < out.last || (last[i] == out.last && closing < out.last_plane))) {
            out.last = last[i];
            out.last_plane = closing;
        }
    }
    return out;
}

}  // namespace

/// Vertices of a body within the slack of the outermost, in the plane.
void ContactPoints::collect(const Core& core, int listed, Vec3 normal, double slack, int body, Vec2 shift,
                            bool lowest) {
    const Vec3 n = lowest ? -normal : normal;
    std::vector<Point>& out = plane_.face_of(body);
    out.clear();
    const auto add = [&](int i) {
        const Vec2 v = plane_.flat(vertex_of(core, i));
        out.push_back({v.x + shift.x, v.y + shift.y, body, i, i, 0.0});
    };
    if (core.points != nullptr) {
        heights_.resize(static_cast<std::size_t>(core.count));
        const double least = heights(core, n, heights_.data()) - slack;
        for (int first = 0; first < listed; first += kWord) {
            const int many = std::min(kWord, core.count - first);
            for (std::uint64_t bits =
                     at_least(heights_.data() + first, static_cast<std::size_t>(many), least);
                 bits != 0; bits &= bits - 1) {
                // Beyond the listed ones the last is repeated.
                const int i = first + std::countr_zero(bits);
                if (i < listed) {
                    add(i);
                }
            }
        }
        return;
    }
    // A vertex across an edge that descends by twice the slack, which is some ten times what rounds, is not
    // worth a look.
    const int highest_vertex = highest(core, n).vertex;
    const int every = (1 << core.generators) - 1;
    int steep = 0;
    for (int i = 0; i < core.generators; ++i) {
        steep |= (std::fabs(dot(n, core.generator[i])) > slack ? 1 : 0) << i;
    }
    if (steep == every) {
        add(highest_vertex);
        return;
    }
    const double top = dot(n, vertex_of(core, highest_vertex));
    for (int i = 0; i < listed; ++i) {
        if (((i ^ highest_vertex) & steep) == 0 && dot(n, vertex_of(core, i)) >= top - slack) {
            add(i);
        }
    }
}

/// Finds where two edges cross, if that is between their ends and not at a small angle.
bool ContactPoints::cross_edges() {
    const std::vector<Point>& edge = plane_.face_of(0);
    const std::vector<Point>& other = plane_.face_of(1);
    const Point& p = edge[0];
    const Point& q = other[0];
    const Vec2 e = {edge[1].x - p.x, edge[1].y - p.y};
    const Vec2 f = {other[1].x - q.x, other[1].y - q.y};
    const Vec2 between = {q.x - p.x, q.y - p.y};
    const double turn = cross(e, f);
    const double on_e = cross(between, f) / turn;
    const double on_f = cross(between, e) / turn;
    const bool clear = turn * turn > kClearAngle * (dot(e, e) * dot(f, f));
    if (!(clear && on_e > 0.0 && on_e < 1.0 && on_f > 0.0 && on_f < 1.0)) {
        return false;
    }
    plane_.found().assign(1, {p.x + on_e * e.x, p.y + on_e * e.y, 0, p.from, edge[1].from, on_e});
    return true;
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
    plane_.face(normal);
    const Vec3 w = pair.velocity();
    const bool moved = moment > 0.0;
    const Vec2 along = plane_.flat(w);
    const Vec2 shift = {moved ? moment * along.x : 0.0, moved ? moment * along.y : 0.0};
    std::vector<Point>& found = plane_.found();
    found.clear();
    for (const int body : {0, 1}) {
        const MovingBody& given = body == 0 ? pair.given_a() : pair.given_b();
        collect(body == 0 ? pair.a() : pair.b(), given.body.count(), normal, slack.height, body,
                body == 0 ? Vec2{} : shift, body == 1);
        const std::vector<Point>& face = plane_.face_of(body);
        const Point first = face.front();
        const bool lone = std::all_of(face.begin(), face.end(), [&](const Point& p) {
            return std::fabs(p.x - first.x) <= slack.place && std::fabs(p.y - first.y) <= slack.place;
        });
        if (lone) {
            points_.assign(1, world(pair, first, moment));
            return points_;
        }
    }
    if (plane_.face_of(0).size() == 2 && plane_.face_of(1).size() == 2 && cross_edges()) {
        points_.assign(1, world(pair, found.front(), moment));
        return points_;
    }
    for (const int body : {0, 1}) {
        plane_.hull(plane_.face_of(body), slack.place);
    }
    // What misses by more than the slack, because its place is that much less certain, is sought with more.
    constexpr double kMoreSlack = 16.0;
    constexpr int kMostTries = 8;
    double nearness = slack.place;
    for (int tries = 0; tries < kMostTries && found.empty(); ++tries, nearness *= kMoreSlack) {
        plane_.cross(nearness);
        plane_.hull(found, nearness);
    }
    points_.clear();
    for (const Point& point : found) {
        points_.push_back(world(pair, point, moment));
    }
    return points_;
}

/// What bounds a polytope, in float64.  Two planes that meet at a sharp edge say, within a slack, little of
/// how far the body goes there, so a third one stands across it; needles are cut off at both ends.
void ContactPoints::bounds_of(const Core& core, const PolytopeFaces& faces, Planes& out) {
    out.normal.clear();
    for (std::vector<double>& row : out.row) {
        row.clear();
    }
    const auto add_at = [&](Vec3 normal, Vec3 base) {
        out.normal.push_back(normal);
        const double numbers[] = {normal.x, normal.y, normal.z, base.x, base.y, base.z};
        for (std::size_t k = 0; k < std::size(numbers); ++k) {
            out.row[k].push_back(numbers[k]);
        }
    };
    const auto add = [&](Vec3 normal) { add_at(normal, vertex_of(core, highest(core, normal).vertex)); };
    for (const FacePlane& plane : faces.planes()) {
        add_at(faces.rough_normal(plane), vertex_of(core, plane.i));
    }
    const int count = faces.exact().count();
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
        const Vec3 n = out.normal[static_cast<std::size_t>(edge.beside[0])];
        if (!(dot(n, out.normal[static_cast<std::size_t>(edge.beside[1])]) < 0.0)) {
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
    while (out.row[0].size() % Lanes::kCount != 0) {
        for (std::vector<double>& row : out.row) {
            row.push_back(0.0);
        }
    }
}

/// Ends of what is left of the edges of a body between the planes of the other.
void ContactPoints::add_corners(const MovingPair& pair, int body, double slack) {
    const Core& core = body == 0 ? pair.a() : pair.b();
    const std::vector<Vec3>& own = bounds_[body].normal;
    const Planes& other = bounds_[1 - body];
    outward_.assign(static_cast<std::size_t>(faces_[body].exact().count()), {});
    taken_.assign(outward_.size(), false);
    const auto beside = [&](const FaceEdge& edge) {
        const auto normal = [&](int plane) {
            return plane < 0 ? Vec3{} : own[static_cast<std::size_t>(plane)];
        };
        return normal(edge.beside[0]) + normal(edge.beside[1]);
    };
    for (const FaceEdge& edge : faces_[body].edges()) {
        for (const int end : {edge.from, edge.to}) {
            Vec3& outward = outward_[static_cast<std::size_t>(end)];
            outward = outward + beside(edge);
        }
    }
    // Of all vertices beforehand, or of an edge when it is known to be of use.
    const std::size_t planes = other.row[0].size();
    const bool few = outward_.size() * planes <= kMostHeights;
    heights_.resize((few ? outward_.size() : 2) * planes);
    const auto row_of = [&](int i) { return heights_.data() + static_cast<std::size_t>(i) * planes; };
    for (int i = 0; few && i < faces_[body].exact().count(); ++i) {
        heights_above(other.row, vertex_of(core, i), row_of(i));
    }
    for (const FaceEdge& edge : faces_[body].edges()) {
        const Vec3 p = vertex_of(core, edge.from);
        const Vec3 q = vertex_of(core, edge.to);
        if (!few) {
            if (are_outside(other.row, p, q, slack)) {
                continue;
            }
            heights_above(other.row, p, row_of(0));
            heights_above(other.row, q, row_of(1));
        }
        const Span left = clip_edge(row_of(few ? edge.from : 0), row_of(few ? edge.to : 1), planes, slack);
        if (!left.any || (left.first - left.last) * norm(q - p) > slack) {
            continue;
        }
        const auto add = [&](double part, int plane) {
            const int from = part == 1.0 ? edge.to : edge.from;
            const int to = part == 0.0 ? edge.from : edge.to;
            const bool vertex = from == to;
            if (vertex && std::exchange(taken_[static_cast<std::size_t>(from)], true)) {
                return;
            }
            const Vec3 start = vertex_of(core, from);
            Vec3 outward = vertex ? outward_[static_cast<std::size_t>(from)] : beside(edge);
            if (!vertex && plane >= 0) {
                outward = outward + other.normal[static_cast<std::size_t>(plane)];
            }
            corners_.push_back(
                {{0.0, 0.0, body, from, to, part}, start + part * (vertex_of(core, to) - start), outward});
        };
        const bool ordered = left.first <= left.last;
        add(ordered ? left.first : left.last, ordered ? left.first_plane : left.last_plane);
        if (left.first != left.last) {
            add(ordered ? left.last : left.first, ordered ? left.last_plane : left.first_plane);
        }
    }
}

/// Whether a plane certainly has the corner more than the slack away from the hull of the others: a quick
/// test, which most corners pass.
bool ContactPoints::stands_out(std::size_t corner, double slack) const {
    const double length = norm(corners_[corner].outward);
    if (!(length > 0.0)) {
        return false;
    }
    const Vec3 n = (1.0 / length) * corners_[corner].outward;
    // Twice the slack, which is more than what rounds.
    return std::all_of(corners_.begin(), corners_.end(), [&](const Corner& other) {
        return &other == &corners_[corner] || dot(n, corners_[corner].place - other.place) > 2.0 * slack;
    });
}

bool ContactPoints::is_in_hull_of_others(std::size_t corner, double reach, double slack) {
    const std::size_t others = corners_.size() - 1;
    rows_.resize(3 * others);
    for (std::size_t k = 0, row = 0; k < corners_.size(); ++k) {
        if (k != corner) {
            rows_[row] = corners_[k].place.x;
            rows_[others + row] = corners_[k].place.y;
            rows_[2 * others + row] = corners_[k].place.z;
            ++row;
        }
    }
    Core one;
    one.center = corners_[corner].place;
    one.reach = reach;
    Core hull_of_others;
    hull_of_others.points = rows_.data();
    hull_of_others.count = static_cast<int>(others);
    hull_of_others.reach = reach;
    return convex_convex(one, hull_of_others, false).value <= slack;
}

std::span<const Vec3> ContactPoints::overlapping(const MovingPair& pair, double slack) {
    const Core* const core[2] = {&pair.a(), &pair.b()};
    const MovingBody* const given[2] = {&pair.given_a(), &pair.given_b()};
    for (const int body : {0, 1}) {
        faces_[body].load({given[body]->body, *core[body]}, pair.ordinary());
        bounds_of(*core[body], faces_[body], bounds_[body]);
    }
    corners_.clear();
    add_corners(pair, 0, slack);
    add_corners(pair, 1, slack);
    std::sort(corners_.begin(), corners_.end(), [](const Corner& p, const Corner& q) {
        return ContactPlane::vertices_first(q.point, p.point);
    });
    // Points within the slack of the hull of the others go; crossings first.
    for (std::size_t i = 0; i < corners_.size() && corners_.size() > 1;) {
        if (!stands_out(i, slack) && is_in_hull_of_others(i, pair.reach(), slack)) {
            corners_.erase(corners_.begin() + static_cast<std::ptrdiff_t>(i));
        } else {
            ++i;
        }
    }
    points_.clear();
    for (const Corner& corner : corners_) {
        points_.push_back(world(pair, corner.point, 0.0));
    }
    return points_;
}

}  // namespace geomsrv
