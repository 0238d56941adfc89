// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
#include "geom/cull_evidence.hpp"

#include <algorithm>

#include "geom/gjk.hpp"

namespace geomsrv {

namespace {

constexpr int kPlanes = CullPlanes<Lanes>::kCount;
constexpr int kCorners = 8;

// A rounded corner takes at most 8 roundings (frustum: 3 products, 2 sums, far / near, times it, the unit;
// box: centre, 3 products, 3 sums), each of at most the sum of the magnitudes, of which there are three
// coordinates.
constexpr double kCornerError = 16 * kUnitRoundoff;

double length_of(Vec3 v) { return std::fabs(v.x) + std::fabs(v.y) + std::fabs(v.z); }

}  // namespace

/// Of a box over the planes, in doubles.
struct CullWitness::Heights {
    static constexpr int kLanes = CullPlanes<Lanes>::kGroups * Lanes::kCount;
    double center[kLanes], arm[3][kLanes], error[kLanes];
    int beyond = kPlanes;       ///< a plane that the box is proven to lie beyond
    int across = kPlanes;       ///< a plane that a corner is proven to lie beyond
    bool center_inside = true;  ///< proven

    GEOMSRV_INLINE Heights(const CullPlanes<Lanes>& planes, const OrientedBox& given) {
        const LocalBox<double> box(planes, given);
        Lanes number(Lanes::Vector{0.0, 1.0, 2.0, 3.0}), first_beyond = kLanes, first_across = kLanes;
        for (int g = 0; g < CullPlanes<Lanes>::kGroups; ++g) {
            const PlaneHeights<Lanes> over = heights_over(planes.group[g], box);
            // Out of range nothing is certain.
            const Lanes bound = box.in_range ? over.error : Lanes(std::numeric_limits<double>::infinity());
            const Lanes s = over.center, r = over.half_width();
            first_beyond = lesser(first_beyond, select(bound < s - r, number, Lanes(kLanes)));
            first_across = lesser(first_across, select(bound < s + r, number, Lanes(kLanes)));
            center_inside &= all(s < -bound);
            const int first = g * Lanes::kCount;
            s.store(center + first);
            for (int i = 0; i < 3; ++i) over.arm[i].store(arm[i] + first);
            bound.store(error + first);
            number = number + Lanes(Lanes::kCount);
        }
        // The last lanes repeat the first planes.
        beyond = static_cast<int>(least(first_beyond));
        across = static_cast<int>(least(first_across));
    }

    [[nodiscard]] double corner(int plane, int number) const {
        double height = center[plane];
        for (int i = 0; i < 3; ++i) height += (number >> i & 1) != 0 ? arm[i][plane] : -arm[i][plane];
        return height;
    }
    [[nodiscard]] int highest_corner(int plane) const {
        int number = 0;
        for (int i = 0; i < 3; ++i) number |= (arm[i][plane] > 0.0 ? 1 : 0) << i;
        return number;
    }
    [[nodiscard]] bool below(int plane, int number) const { return corner(plane, number) < -error[plane]; }
    [[nodiscard]] bool above(int plane, int number) const { return corner(plane, number) > error[plane]; }
};

CullWitness::CullWitness(const Frustum& frustum)
    : frustum_(frustum), planes_(cull_planes<Lanes>(frustum)), exact_(frustum) {}

GEOMSRV_WIDE_CLONES CullEvidence CullWitness::evidence(const OrientedBox& box, CullState state) {
    CullEvidence out;
    if (state == CullState::inside) return out;
    const Heights over(planes_, box);
    if (state == CullState::outside) {
        if (over.beyond >= kPlanes) return beyond_filter(box, state, over);
        out.beyond[1] = static_cast<std::int8_t>(over.beyond);
        return out;
    }
    if (over.across >= kPlanes || !over.center_inside) return beyond_filter(box, state, over);
    out.beyond[0] = static_cast<std::int8_t>(over.highest_corner(over.across));
    out.beyond[1] = static_cast<std::int8_t>(over.across);
    return out;
}

CullEvidence CullWitness::beyond_filter(const OrientedBox& box, CullState state, const Heights& over) {
    CullEvidence out;
    if (state == CullState::outside) {
        for (int plane = 0; plane < kPlanes; ++plane) {
            const int lowest = kCorners - 1 - over.highest_corner(plane);
            if (!over.below(plane, lowest) &&
                exact_.sign(box, [&](const auto& signs) { return signs.separates(plane); }) == 1) {
                out.beyond[1] = static_cast<std::int8_t>(plane);
                return out;
            }
        }
        find_separation(box, out);
        return out;
    }

    const auto corner_sign = [&](int plane, int corner) {
        return exact_.sign(box, [&](const auto& signs) { return signs.corner(plane, corner); });
    };
    const auto set_beyond = [&](int corner, int plane) {
        out.beyond[0] = static_cast<std::int8_t>(corner);
        out.beyond[1] = static_cast<std::int8_t>(plane);
        return true;
    };
    const auto find_corner_beyond = [&] {
        if (over.across < kPlanes) return set_beyond(over.highest_corner(over.across), over.across);
        for (int plane = 0; plane < kPlanes; ++plane) {
            for (int corner = 0; corner < kCorners; ++corner) {
                if (!over.below(plane, corner) && corner_sign(plane, corner) == 1)
                    return set_beyond(corner, plane);
            }
        }
        return false;
    };
    find_corner_beyond();
    if (over.center_inside) return out;
    for (int corner = 0; corner < kCorners; ++corner) {
        bool inside = true;
        for (int plane = 0; plane < kPlanes && inside; ++plane) inside = !over.above(plane, corner);
        for (int plane = 0; plane < kPlanes && inside; ++plane) {
            inside = over.below(plane, corner) || corner_sign(plane, corner) <= 0;
        }
        if (inside) {
            out.simplex[0][1] = corner;
            return out;
        }
    }
    find_separation(box, out);
    return out;
}

void CullWitness::find_separation(const OrientedBox& box, CullEvidence& out) const {
    const Frustum& f = frustum_;
    const auto [left, up, view] = f.axes.row;
    // Seen from the apex, in a unit that makes the larger of the two about 1.
    const double shrink =
        std::max(length_of(0.25 * box.center), length_of(0.25 * f.origin)) > 0x1p1018 ? 0.25 : 1.0;
    const Vec3 offset = shrink * box.center - shrink * f.origin;
    const double slope =
        std::max({std::fabs(f.l0), std::fabs(f.l1), std::fabs(f.u0), std::fabs(f.u1)}) / f.near;
    const double most = std::max(
        {length_of(offset), length_of(shrink * box.half_extents), shrink * f.far, shrink * f.far * slope});
    const PowerOfTwo unit(std::clamp(-std::ilogb(std::min(most, 0x1p1020)), -1000, 1000));

    double corners[3 * kCorners];
    Core rough_frustum;
    rough_frustum.points = corners;
    rough_frustum.count = kCorners;
    for (int corner = 0; corner < kCorners; ++corner) {
        const double ratio = (corner & 4) != 0 ? f.far / f.near : 1.0;
        const Vec3 to_left = unit * ((corner & 1) != 0 ? f.l1 : f.l0) * left;
        const Vec3 to_up = unit * ((corner & 2) != 0 ? f.u1 : f.u0) * up, depth = unit * f.near * view;
        const Vec3 p = ratio * (to_left + to_up + depth);
        corners[corner] = p.x;
        corners[kCorners + corner] = p.y;
        corners[2 * kCorners + corner] = p.z;
        rough_frustum.reach =
            std::max(rough_frustum.reach, ratio * (length_of(to_left) + length_of(to_up) + length_of(depth)));
    }
    rough_frustum.error = kCornerError * rough_frustum.reach;

    Core rough_box;
    rough_box.center = (1.0 / shrink) * (unit * offset);
    rough_box.generators = 3;
    rough_box.reach = length_of(rough_box.center);
    const double half[3] = {box.half_extents.x, box.half_extents.y, box.half_extents.z};
    ExactBody exact_box, exact_frustum;
    exact_box.center = box.center;
    exact_box.generators = 3;
    for (int i = 0; i < 3; ++i) {
        rough_box.generator[i] = unit * half[i] * box.axes.row[i];
        rough_box.reach += length_of(rough_box.generator[i]);
        exact_box.axis[i] = box.axes.row[i];
        exact_box.half[i] = half[i];
    }
    rough_box.error = kCornerError * rough_box.reach;
    exact_frustum.kind = ExactBody::Kind::frustum;
    exact_frustum.frustum = &f;

    const Gjk guess = gjk(rough_frustum, rough_box, view);
    const ExactSeparation found = exact_separation({exact_frustum, rough_frustum}, {exact_box, rough_box},
                                                   guess.witness, exact_.in_range(box));
    for (int i = 0; i < found.simplex.count; ++i) {
        out.simplex[i][0] = found.simplex.a[i];
        out.simplex[i][1] = found.simplex.b[i];
    }
}

}  // namespace geomsrv
