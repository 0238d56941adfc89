// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
// The ray of polygon_first_contact.cpp, clipped by the edges of both polygons, in four pairs at once.
//
// No slack of polygon_window.hpp exceeds kLargestSlack of the reach or of the speed: what is clear by that
// much is clear, and asks for no closer look at what the coordinates may be off by.  Tips (polygon_pair.hpp)
// bound the slack of what is close to contact; what is clear without them is so with them.
//
// Rings shorter than the longest of the four go on with their first vertex: edges of no length, whose gap is
// set to -1 so that they neither open nor close anything.
#include "geom/polygon_motion.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>

#include "geom/double_double.hpp"
#include "geom/exact_sign.hpp"
#include "geom/lane_arithmetic.hpp"
#include "geom/lanes.hpp"
#include "geom/polygon_window.hpp"
#include "geom/rounding.hpp"

namespace geomsrv {

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kLargest = std::numeric_limits<double>::max();
constexpr std::size_t kLanes = Lanes::kCount;

// Lengths and speeds between these need no scale; 0 is a speed, too.  Two edges whose product is larger than
// the least turn, as no edge is longer than twice the reach, are long enough for all slacks to be normal
// numbers, next to which no underflow counts.
constexpr double kSmallestPlain = 0x1p-100;
constexpr double kLargestPlain = 0x1p100;
constexpr double kLeastTurn = 0x1p-300;

// Slack for the rounding of the input is no larger than kLargestSlack of |D|_1 times the reach or the speed;
// a sixteenth more covers what rounds here, kGapError and kRateError, which are less than a hundredth of it.
constexpr double kMostSlack = 1.0625 * kLargestSlack;

struct LaneVec2 {
    Lanes x, y;
};

GEOMSRV_INLINE Lanes dot(const LaneVec2& a, const LaneVec2& b) { return a.x * b.x + a.y * b.y; }
GEOMSRV_INLINE Lanes size_of(const LaneVec2& a) { return magnitude(a.x) + magnitude(a.y); }

GEOMSRV_INLINE LaneVec2 joined(const Vec2 (&v)[kLanes]) {
    return {Lanes(Lanes::Vector{v[0].x, v[1].x, v[2].x, v[3].x}),
            Lanes(Lanes::Vector{v[0].y, v[1].y, v[2].y, v[3].y})};
}

/// Four points, their coordinates apart.
GEOMSRV_INLINE LaneVec2 gathered(const Vec2* const (&at)[kLanes]) {
    using Point [[gnu::vector_size(16)]] = double;
    using Stored [[gnu::vector_size(16), gnu::aligned(alignof(double)), gnu::may_alias]] = double;
    const auto point = [&](std::size_t k) __attribute__((always_inline)) {
        return Point(*reinterpret_cast<const Stored*>(at[k]));
    };
    const Lanes::Vector even = __builtin_shufflevector(point(0), point(2), 0, 1, 2, 3);
    const Lanes::Vector odd = __builtin_shufflevector(point(1), point(3), 0, 1, 2, 3);
    return {Lanes(__builtin_shufflevector(even, odd, 0, 4, 2, 6)),
            Lanes(__builtin_shufflevector(even, odd, 1, 5, 3, 7))};
}

/// One polygon of each of four pairs.
struct LanePolygons {
    std::array<Ring, kLanes> ring;
    std::size_t most = 0;         ///< vertices of the largest
    Lanes count;                  ///< of each
    Lanes reach;                  ///< largest |local coordinate|
    LaneMask strict;              ///< every turn is certainly to the left, and large enough
    LaneVec2 vertex[kMostSides];  ///< local
    LaneVec2 normal[kMostSides];  ///< outward, of the edge that starts at a vertex
    Lanes gap[kMostSides];        ///< along it
    Lanes most_gap[kMostSides];   ///< largest gap and least rate: when contact begins at the latest
    Lanes slowest[kMostSides];
    Lanes fastest[kMostSides];  ///< largest rate: < 0 where contact certainly ends
};

/// Vertices and edges.
GEOMSRV_INLINE void place(LanePolygons& p, const Vec2 (&origin)[kLanes]) {
    const LaneVec2 from = joined(origin);
    p.count =
        Lanes(Lanes::Vector{static_cast<double>(p.ring[0].size()), static_cast<double>(p.ring[1].size()),
                            static_cast<double>(p.ring[2].size()), static_cast<double>(p.ring[3].size())});
    const auto given = [&](std::size_t i) __attribute__((always_inline)) {
        const Vec2* at[kLanes];
        for (std::size_t k = 0; k < kLanes; ++k) {
            at[k] = p.ring[k].data() + (i < p.ring[k].size() ? i : 0);
        }
        return gathered(at);
    };
    const Lanes none = 0.0;
    p.reach = none;
    p.strict = none <= none;
    const auto turns_left = [](const LaneVec2& before,
                               const LaneVec2& behind) __attribute__((always_inline)) {
        const Lanes left = before.x * behind.y;
        const Lanes right = before.y * behind.x;
        return Lanes(kCrossError) * (magnitude(left) + magnitude(right)) + Lanes(kLeastTurn) < left - right;
    };
    LaneVec2 here = given(0);
    LaneVec2 before = {none, none};
    for (std::size_t i = 0; i < p.most; ++i) {
        const LaneVec2 next = given(i + 1);
        const LaneVec2 local = {here.x - from.x, here.y - from.y};
        const LaneVec2 normal = {next.y - here.y, here.x - next.x};
        p.reach = greater(p.reach, greater(magnitude(local.x), magnitude(local.y)));
        p.vertex[i] = local;
        p.normal[i] = normal;
        const LaneMask beyond = p.count <= Lanes(static_cast<double>(i));
        if (i > 0) p.strict = p.strict & (beyond | turns_left(before, normal));
        before = {select(beyond, before.x, normal.x), select(beyond, before.y, normal.y)};
        here = next;
    }
    p.strict = p.strict & turns_left(before, p.normal[0]) & (Lanes(2.0) < p.count);
}

/// Gaps along some normals of p, which share the loads of the vertices.
template <std::size_t Count>
GEOMSRV_INLINE void project_some(LanePolygons& p, const LanePolygons& q, std::size_t first) {
    LaneVec2 n[Count];
    Lanes low[Count];
    for (std::size_t i = 0; i < Count; ++i) {
        n[i] = p.normal[first + i];
        low[i] = kInfinity;
    }
    for (std::size_t j = 0; j < q.most; ++j) {
        const LaneVec2 v = q.vertex[j];
        for (std::size_t i = 0; i < Count; ++i) low[i] = lesser(dot(n[i], v), low[i]);
    }
    for (std::size_t i = 0; i < Count; ++i) {
        const LaneMask beyond = p.count <= Lanes(static_cast<double>(first + i));
        p.gap[first + i] = select(beyond, Lanes(-1.0), low[i] - dot(n[i], p.vertex[first + i]));
    }
}

GEOMSRV_INLINE void project(LanePolygons& p, const LanePolygons& q) {
    std::size_t k = 0;
    for (; k + 4 <= p.most; k += 4) project_some<4>(p, q, k);
    switch (p.most - k) {
        case 3:
            project_some<3>(p, q, k);
            break;
        case 2:
            project_some<2>(p, q, k);
            break;
        case 1:
            project_some<1>(p, q, k);
            break;
        default:
            break;
    }
}

/// A lane of an array: its element with the number in that lane.
GEOMSRV_INLINE Lanes picked(const Lanes* of, const std::size_t (&index)[kLanes]) {
    return Lanes(Lanes::Vector{of[index[0]][0], of[index[1]][1], of[index[2]][2], of[index[3]][3]});
}
GEOMSRV_INLINE LaneVec2 picked(const LaneVec2* of, const std::size_t (&index)[kLanes]) {
    return {Lanes(Lanes::Vector{of[index[0]].x[0], of[index[1]].x[1], of[index[2]].x[2], of[index[3]].x[3]}),
            Lanes(Lanes::Vector{of[index[0]].y[0], of[index[1]].y[1], of[index[2]].y[2], of[index[3]].y[3]})};
}

/// Numbers of axes or vertices, one of each pair, kept as doubles.
struct LaneIndex {
    std::size_t at[kLanes];

    GEOMSRV_INLINE explicit LaneIndex(const Lanes& x) {
        for (std::size_t k = 0; k < kLanes; ++k) at[k] = static_cast<std::size_t>(x[static_cast<int>(k)]);
    }
    GEOMSRV_INLINE LaneIndex() = default;
};

/// An edge as it limits contact, with the numbers as they are.
struct LaneAxis {
    LaneMask of_a;
    LaneIndex index;
    LaneVec2 normal;
    Lanes gap, rate, gap_error, rate_error;

    [[nodiscard]] GEOMSRV_INLINE LaneMask is_sharp() const {
        return (gap_error < Lanes(kSharpTime) * magnitude(gap)) &
               (rate_error < Lanes(kSharpTime) * magnitude(rate));
    }

    /// closing_time() of polygon_first_contact.cpp for sharp numbers > 0, bit by bit.
    struct Times {
        Lanes nearest, lower, upper;
    };
    [[nodiscard]] GEOMSRV_INLINE Times closing_time() const {
        const Lanes first = gap / rate;
        const Lanes product = first * rate;
        const Lanes rest = (gap - product) - TwoRoundings::product_error(first, rate, product);
        const Lanes more = rest / rate;
        const Lanes hi = first + more;
        const Lanes lo = more - (hi - first);
        const Lanes relative = gap_error / gap + rate_error / rate;
        const Lanes error = hi * (Lanes(kSecondOrderOfTime) * relative + Lanes(kQuotientError));
        return {hi, neighbour(hi + (lo - error), LaneMask::Vector{-1, -1, -1, -1}),
                neighbour(hi + (lo + error), LaneMask::Vector{1, 1, 1, 1})};
    }
};

GEOMSRV_INLINE LaneVec2 chosen(const LaneMask& first, const LaneVec2& a, const LaneVec2& b) {
    return {select(first, a.x, b.x), select(first, a.y, b.y)};
}

/// The edge with a number; those of b follow the room for those of a.
GEOMSRV_INLINE LaneAxis axis_of(const LanePolygons (&p)[2], const Lanes& number, const LaneVec2& velocity,
                                const Lanes& reach) {
    const Lanes first_of_b = static_cast<double>(kMostSides);
    LaneAxis out;
    out.of_a = number < first_of_b;
    out.index = LaneIndex(number - kept(~out.of_a, first_of_b));
    out.normal = chosen(out.of_a, picked(p[0].normal, out.index.at), picked(p[1].normal, out.index.at));
    out.gap = select(out.of_a, picked(p[0].gap, out.index.at), picked(p[1].gap, out.index.at));
    const Lanes along_x = out.normal.x * velocity.x;
    const Lanes along_y = out.normal.y * velocity.y;
    out.rate = with_sign_of(select(out.of_a, Lanes(-1.0), Lanes(1.0)), along_x + along_y);
    out.gap_error = Lanes(kGapError * kUnitRoundoff) * reach * size_of(out.normal);
    out.rate_error = Lanes(kRateError) * (magnitude(along_x) + magnitude(along_y));
    return out;
}

/// Lowest vertex of the other polygon along the normal of an edge.
GEOMSRV_INLINE LaneIndex lowest(const LanePolygons (&p)[2], const LaneAxis& axis) {
    Lanes best = 0.0;
    Lanes low = kInfinity;
    const std::size_t most = std::max(p[0].most, p[1].most);
    for (std::size_t j = 0; j < most; ++j) {
        const Lanes height = dot(axis.normal, chosen(axis.of_a, p[1].vertex[j], p[0].vertex[j]));
        const LaneMask lower = height < low;
        low = select(lower, height, low);
        best = select(lower, Lanes(static_cast<double>(j)), best);
    }
    return LaneIndex(best);
}

/// The edges before and behind vertices.
GEOMSRV_INLINE void edges_beside(const LanePolygons (&p)[2], const LaneMask& of_a, const LaneIndex& first,
                                 const LaneIndex& last, LaneVec2& before, LaneVec2& behind) {
    Vec2 in[kLanes];
    Vec2 out[kLanes];
    for (std::size_t k = 0; k < kLanes; ++k) {
        const LanePolygons& q = p[of_a.v[static_cast<int>(k)] != 0 ? 0 : 1];
        const int lane = static_cast<int>(k);
        const std::size_t size = q.ring[k].size();
        const LaneVec2& e = q.normal[(first.at[k] > 0 ? first.at[k] : size) - 1];
        const LaneVec2& f = q.normal[last.at[k]];
        in[k] = {e.x[lane], e.y[lane]};
        out[k] = {f.x[lane], f.y[lane]};
    }
    before = joined(in);
    behind = joined(out);
}

/// Whether the second of two edges is certainly turned to the left of the first, one of which is the axis: by
/// more than what makes vertices level, see Slack.
GEOMSRV_INLINE LaneMask turns_clearly(const LaneVec2& first, const LaneVec2& second, const LaneVec2& axis,
                                      const Lanes& reach) {
    const Lanes left = first.x * second.y;
    const Lanes right = first.y * second.x;
    return Lanes(kHeightError) * (magnitude(left) + magnitude(right)) +
               Lanes(kMostSlack) * reach * size_of(axis) <
           left - right;
}

/// Whether the vertex is certainly the only one as low.
GEOMSRV_INLINE LaneMask is_alone(const LanePolygons (&p)[2], const LaneAxis& axis, const LaneIndex& vertex,
                                 const Lanes& reach) {
    LaneVec2 before;
    LaneVec2 behind;
    edges_beside(p, ~axis.of_a, vertex, vertex, before, behind);
    const LaneVec2 down = {-axis.normal.x, -axis.normal.y};
    return turns_clearly(before, down, down, reach) & turns_clearly(down, behind, down, reach);
}

struct Four {
    const MovingPolygon* a[kLanes];
    const MovingPolygon* b[kLanes];
    PolygonMotion* out[kLanes];
};

GEOMSRV_WIDE_CLONES void decide_four(const Four& pairs, double t_max, bool last_vertices,
                                     LanePolygons (&p)[2]) {
    const Lanes none = 0.0;
    Vec2 origin[kLanes];
    Vec2 from[kLanes];
    Vec2 to[kLanes];
    for (LanePolygons& q : p) q.most = 0;
    for (std::size_t k = 0; k < kLanes; ++k) {
        p[0].ring[k] = pairs.a[k]->ring;
        p[1].ring[k] = pairs.b[k]->ring;
        origin[k] = p[0].ring[k][0];
        from[k] = pairs.a[k]->velocity;
        to[k] = pairs.b[k]->velocity;
        for (LanePolygons& q : p) q.most = std::max(q.most, q.ring[k].size());
    }
    const LaneVec2 velocity_a = joined(from);
    const LaneVec2 velocity_b = joined(to);
    place(p[0], origin);
    place(p[1], origin);
    for (LanePolygons& q : p)
        std::fill(q.vertex + q.most, q.vertex + std::max(p[0].most, p[1].most), q.vertex[0]);
    project(p[0], p[1]);
    project(p[1], p[0]);

    const auto largest = [](const LaneVec2& v) __attribute__((always_inline)) {
        return greater(magnitude(v.x), magnitude(v.y));
    };
    const auto plain = [](const Lanes& x) __attribute__((always_inline)) {
        return (Lanes(kSmallestPlain) <= x) & (x <= Lanes(kLargestPlain));
    };
    const LaneVec2 velocity = {velocity_b.x - velocity_a.x, velocity_b.y - velocity_a.y};
    const Lanes speed = largest(velocity);
    const Lanes reach = greater(p[0].reach, p[1].reach);
    const LaneMask ordinary = p[0].strict & p[1].strict & plain(reach) & (plain(speed) | (speed <= none));

    // As window_of().
    const Lanes gap_slack = Lanes(kMostSlack) * reach;
    const Lanes rate_slack = Lanes(kMostSlack) * speed;
    Lanes enter = none;  // > 0 where they are apart and approach along some axis
    Lanes leave = kInfinity;
    Lanes shallowest = -kInfinity;
    for (const int side : {0, 1}) {
        LanePolygons& q = p[side];
        const LaneVec2 toward = side == 0 ? LaneVec2{-velocity.x, -velocity.y} : velocity;
        for (std::size_t k = 0; k < q.most; ++k) {
            const Lanes size = size_of(q.normal[k]);
            const Lanes rate = dot(q.normal[k], toward);
            const Lanes gap_off = gap_slack * size;
            const Lanes rate_off = rate_slack * size;
            const Lanes open = q.gap[k] - gap_off;
            const Lanes closing = rate + rate_off;
            const Lanes most = q.gap[k] + gap_off;
            const Lanes time = open / closing;
            // Apart and parting: the time is < 0, so they leave before they enter.  At rest it is infinite.
            enter = greater(enter, kept(none < open, time));
            leave = lesser(leave, select(closing < none, time, Lanes(kInfinity)));
            shallowest = greater(shallowest, most + gap_off);
            q.most_gap[k] = most;
            q.slowest[k] = rate - rate_off;
            q.fastest[k] = closing;
        }
    }
    const LaneMask never = ordinary & ((leave < enter) | (lesser(Lanes(t_max), Lanes(kLargest)) < enter));
    // Tips are no more than sqrt(2) times as sensitive to slack as the edges beside them, so what is inside
    // of all edges by twice the slack is inside of tips.
    const LaneMask deep = shallowest < none;

    // As candidates_of(): which axes may set the first and the last contact, as a sum that tells the axis if
    // there is one only.
    constexpr double kOne = 2.0 * kMostSides;
    Lanes entries = none;
    Lanes exits = none;
    for (const int side : {0, 1}) {
        const LanePolygons& q = p[side];
        const double first = kOne + (side == 0 ? 0.0 : static_cast<double>(kMostSides));
        for (std::size_t k = 0; k < q.most; ++k) {
            const Lanes number = first + static_cast<double>(k);
            const LaneMask begins = (none < q.most_gap[k]) & (enter * q.slowest[k] <= q.most_gap[k]);
            const LaneMask ends = (q.fastest[k] < none) & (leave * q.slowest[k] <= q.most_gap[k]);
            entries = entries + kept(begins, number);
            exits = exits + kept(ends, number);
        }
    }
    const auto is_one = [](const Lanes& sum) __attribute__((always_inline)) {
        return (Lanes(kOne) <= sum) & (sum < Lanes(2.0 * kOne));
    };
    const LaneMask one_exit = is_one(exits);
    LaneMask clear = ordinary & (none < enter) & ~never & is_one(entries) & one_exit;
    const Lanes entry = kept(is_one(entries), entries - Lanes(kOne));
    const Lanes exit = kept(one_exit, exits - Lanes(kOne));

    const LaneAxis begin = axis_of(p, entry, velocity, reach);
    const LaneAxis end = axis_of(p, exit, velocity, reach);
    clear = clear & begin.is_sharp() & end.is_sharp() & (none < begin.gap) & (none < begin.rate);
    const LaneMask overlap = ordinary & deep & one_exit & end.is_sharp();
    const auto [time, lower, upper] = begin.closing_time();
    const Lanes last_time = end.gap / end.rate;
    clear = clear & (upper <= lesser(leave, Lanes(t_max)));

    // As are_in_contact(): half way, or at the end of the window.
    const Lanes half_way = lesser(Lanes(0.5) * (time + last_time), Lanes(next_down(t_max)));
    for (const LanePolygons& q : p) {
        for (std::size_t k = 0; k < q.most; ++k) clear = clear & (q.most_gap[k] <= half_way * q.slowest[k]);
    }

    // As contact_marks(): a single vertex, strictly between the ends of an edge without a collinear
    // neighbour.
    const LaneMask of_a = begin.of_a;
    const LaneIndex vertex = lowest(p, begin);
    clear = clear & is_alone(p, begin, vertex, reach);
    LaneIndex last_vertex;
    std::fill_n(last_vertex.at, kLanes, 0);
    if (last_vertices) {
        last_vertex = lowest(p, end);
        clear = clear & is_alone(p, end, last_vertex, reach);
    }
    LaneIndex next;
    for (std::size_t k = 0; k < kLanes; ++k) {
        const std::size_t size = (of_a.v[static_cast<int>(k)] != 0 ? p[0] : p[1]).ring[k].size();
        next.at[k] = begin.index.at[k] + 1 < size ? begin.index.at[k] + 1 : 0;
    }
    LaneVec2 before;
    LaneVec2 behind;
    const LaneVec2 normal = begin.normal;
    edges_beside(p, of_a, begin.index, next, before, behind);
    clear =
        clear & turns_clearly(before, normal, normal, reach) & turns_clearly(normal, behind, normal, reach);
    const LaneVec2 along = {-normal.y, normal.x};
    const LaneVec2 low =
        chosen(of_a, picked(p[0].vertex, begin.index.at), picked(p[1].vertex, begin.index.at));
    const LaneVec2 high = chosen(of_a, picked(p[0].vertex, next.at), picked(p[1].vertex, next.at));
    const LaneVec2 at = chosen(of_a, picked(p[1].vertex, vertex.at), picked(p[0].vertex, vertex.at));
    const Lanes sign = select(of_a, Lanes(1.0), Lanes(-1.0));
    const Lanes place_of = dot(along, at) + with_sign_of(sign, time * dot(along, velocity));
    clear = clear & (dot(along, low) < place_of) & (place_of < dot(along, high));

    // As unit().
    const Lanes size = largest(normal);
    const LaneVec2 reduced = {normal.x / size, normal.y / size};
    const Lanes scale = Lanes(1.0) / square_root(dot(reduced, reduced));
    const Lanes unit_x = with_sign_of(sign, scale * reduced.x);
    const Lanes unit_y = with_sign_of(sign, scale * reduced.y);
    const Lanes verdict = select(never, Lanes(1.0), select(clear, Lanes(2.0), kept(overlap, Lanes(3.0))));
    for (std::size_t k = 0; k < kLanes; ++k) {
        const int lane = static_cast<int>(k);
        PolygonMotion& out = *pairs.out[k];
        out.verdict = static_cast<PolygonMotion::Verdict>(static_cast<int>(verdict[lane]));
        out.last_time = last_time[lane];
        if (out.verdict != PolygonMotion::Verdict::will_touch) continue;
        const bool is_a = of_a.v[lane] != 0;
        out.first = {{is_a ? 0 : 1, begin.index.at[k]}, vertex.at[k]};
        out.last = {{end.of_a.v[lane] != 0 ? 0 : 1, end.index.at[k]}, last_vertex.at[k]};
        out.time = time[lane];
        out.time_lower = lower[lane];
        out.time_upper = upper[lane];
        out.normal = {unit_x[lane], unit_y[lane]};
        const MovingPolygon& other = is_a ? *pairs.b[k] : *pairs.a[k];
        out.point = other.ring[vertex.at[k]] + out.time * other.velocity;
    }
}

/// Asks for a ring that is looked at soon, but out of order: sorting would hide from the processor what comes
/// next.
void fetch(Ring ring) {
    constexpr std::size_t kPerLine = 64 / sizeof(Vec2);
    for (std::size_t i = 0; i < ring.size(); i += kPerLine) __builtin_prefetch(&ring[i]);
}

}  // namespace

void decide_polygon_motions(const MovingPolygon* a, const MovingPolygon* b, std::size_t count, double t_max,
                            bool last_vertices, PolygonMotion* out) {
    // By the number of sides of b, then of a: four in a row are about as large.
    std::uint16_t order[kPolygonMotionBlock];
    std::uint16_t sorted[kPolygonMotionBlock];
    std::size_t many = 0;
    for (std::size_t i = 0; i < count; ++i) {
        out[i].verdict = PolygonMotion::Verdict::unclear;
        fetch(a[i].ring);
        fetch(b[i].ring);
        order[many] = static_cast<std::uint16_t>(i);
        many += std::max(a[i].ring.size(), b[i].ring.size()) <= kMostSides ? 1 : 0;
    }
    for (const MovingPolygon* const polygons : {b, a}) {
        std::array<std::size_t, kMostSides + 2> begin{};
        for (std::size_t i = 0; i < many; ++i) ++begin[polygons[order[i]].ring.size() + 1];
        for (std::size_t size = 1; size < begin.size(); ++size) begin[size] += begin[size - 1];
        for (std::size_t i = 0; i < many; ++i) sorted[begin[polygons[order[i]].ring.size()]++] = order[i];
        std::copy_n(sorted, many, order);
    }
    LanePolygons scratch[2];
    for (std::size_t start = 0; start < many; start += kLanes) {
        Four pairs;
        for (std::size_t k = 0; k < kLanes; ++k) {
            const std::size_t i = order[std::min(start + k, many - 1)];
            pairs.a[k] = a + i;
            pairs.b[k] = b + i;
            pairs.out[k] = out + i;
        }
        decide_four(pairs, t_max, last_vertices, scratch);
    }
}

}  // namespace geomsrv
