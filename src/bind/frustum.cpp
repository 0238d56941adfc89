// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cstring>
#include <optional>
#include <string_view>
#include <type_traits>
#include <utility>

#include "bind/arrays.hpp"
#include "bind/module.hpp"
#include "bind/views.hpp"
#include "geom/cull_evidence.hpp"
#include "geom/frustum_box.hpp"

namespace geomsrv::bind {

namespace {

struct BoxRows {
    const double *center, *axes, *half_extents;

    Vec3 center_of(std::size_t i) const { return {center[3 * i], center[3 * i + 1], center[3 * i + 2]}; }
    Vec3 half_extents_of(std::size_t i) const {
        return {half_extents[3 * i], half_extents[3 * i + 1], half_extents[3 * i + 2]};
    }
    void prefetch_axes(std::size_t i) const {
        __builtin_prefetch(axes + 9 * i);
        __builtin_prefetch(axes + 9 * i + 8);
    }
    OrientedBox operator[](std::size_t i) const {
        const double* const a = axes + 9 * i;
        return {
            center_of(i), {{{a[0], a[1], a[2]}, {a[3], a[4], a[5]}, {a[6], a[7], a[8]}}}, half_extents_of(i)};
    }
};

/// Rows of lengths relative to `origin`, in the unit and the precision of the planes.
template <class L>
GEOMSRV_INLINE std::array<L, 3> local_rows(const CullPlanes<L>& planes, const double* rows, Vec3 origin) {
    const double shift[3] = {origin.x, origin.y, origin.z};
    const auto four = [&](const double* p) __attribute__((always_inline)) {
        FourRows<3> found(p);
        for (int k = 0; k < 3; ++k) found.at[k] = found.at[k] - shift[k];
        if (planes.scaled) {
            stay_a_branch();
            for (Lanes& x : found.at) x = x * planes.unit.first * planes.unit.second;
        }
        return found;
    };
    const FourRows<3> first = four(rows);
    if constexpr (std::is_same_v<L, Lanes>) {
        return {first.at[0], first.at[1], first.at[2]};
    } else {
        const FourRows<3> second = four(rows + 12);
        return {joined(first.at[0], second.at[0]), joined(first.at[1], second.at[1]),
                joined(first.at[2], second.at[2])};
    }
}

// Boxes that are looked at together, so that what one stage leaves is still in cache for the next; and how
// far ahead axes are fetched, which come from far away and are wanted of few.
constexpr std::size_t kBlock = 256, kAhead = 8;

enum class CullTier : std::uint8_t { bound, float32, float64, exact };

struct CullCounts {
    std::int64_t bound = 0, filter = 0, wide = 0, exact = 0, uncertain = 0;
};

struct CullAnswers {
    std::uint8_t* state;
    bool* certain;
};

/// As many boxes as there are lanes.
template <class L>
GEOMSRV_INLINE SphereVerdict<L> classify_rows(const CullPlanes<L>& planes, const double* center,
                                              const double* half_extents) {
    return classify_by_sphere(planes, local_rows(planes, center, planes.origin),
                              local_rows(planes, half_extents, Vec3{}));
}

/// The same for the last few boxes, which fill the lanes by repetition.
template <class L>
GEOMSRV_INLINE void classify_last_rows(const CullPlanes<L>& planes, BoxRows boxes, std::size_t first,
                                       std::size_t count, std::uint8_t* state) {
    constexpr std::size_t kRows = L::kCount;
    double center[3 * kRows], half_extents[3 * kRows];
    std::uint8_t found[kRows];
    for (std::size_t k = 0; k < kRows; ++k) {
        const std::size_t i = 3 * std::min(first + k, count - 1);
        std::copy_n(boxes.center + i, 3, center + 3 * k);
        std::copy_n(boxes.half_extents + i, 3, half_extents + 3 * k);
    }
    store_bytes(classify_rows(planes, center, half_extents).state, found);
    std::copy_n(found, count - first, state + first);
}

template <class L, CullTier Tier>
GEOMSRV_WIDE_CLONES CullCounts cull_all(const Frustum& frustum, BoxRows boxes, std::size_t count,
                                        CullAnswers out) {
    const CullPlanes<L> planes = cull_planes<L>(frustum);
    const auto frame = cull_frame<typename L::Real>(frustum);
    std::optional<ExactCull> exact;  // made when first needed
    std::size_t undecided[kBlock];
    CullCounts counts;
    for (std::size_t begin = 0; begin < count; begin += kBlock) {
        const std::size_t end = std::min(begin + kBlock, count);
        std::size_t first = begin;
        for (; first + L::kCount <= end; first += L::kCount) {
            store_bytes(classify_rows(planes, boxes.center + 3 * first, boxes.half_extents + 3 * first).state,
                        out.state + first);
        }
        if (first < end) classify_last_rows(planes, boxes, first, count, out.state);
        std::size_t left = 0;
        for (std::size_t i = begin; i < end; ++i) {
            undecided[left] = i;
            left += out.state[i] == kUndecided ? 1 : 0;
        }
        std::fill(out.certain + begin, out.certain + end, true);
        if constexpr (Tier == CullTier::bound) {
            for (std::size_t k = 0; k < left; ++k) {
                out.state[undecided[k]] = static_cast<std::uint8_t>(CullState::intersects);
                out.certain[undecided[k]] = false;
            }
            counts.bound += static_cast<std::int64_t>(end - begin - left);
            counts.uncertain += static_cast<std::int64_t>(left);
        } else {
            const std::size_t after_spheres = std::exchange(left, 0);
            for (std::size_t k = 0; k < after_spheres; ++k) {
                boxes.prefetch_axes(undecided[std::min(k + kAhead, after_spheres - 1)]);
                const std::size_t i = undecided[k];
                out.state[i] = classify_by_planes(planes, boxes[i]);
                undecided[left] = i;
                left += out.state[i] == kUndecided ? 1 : 0;
            }
            counts.bound += static_cast<std::int64_t>(end - begin - left);
            for (std::size_t k = 0; k < left; ++k) {
                const std::size_t i = undecided[k];
                CullVerdict verdict = cull_by_axes(frame, boxes[i]);
                if (Tier == CullTier::exact && !verdict.certain) {
                    if (!exact) exact.emplace(frustum);
                    const ExactCull::Verdict better = exact->decide(boxes[i]);
                    verdict = {better.state, true};
                    (better.rung == Rung::wide ? counts.wide : counts.exact) += 1;
                } else {
                    (verdict.certain ? counts.filter : counts.uncertain) += 1;
                }
                out.state[i] = static_cast<std::uint8_t>(verdict.state);
                out.certain[i] = verdict.certain;
            }
        }
    }
    return counts;
}

/// CullEvidence of every certain answer, (n, 4, 2) and (n, 2); -1 throughout for the others.
GEOMSRV_WIDE_CLONES void find_evidence(const Frustum& frustum, BoxRows boxes, std::size_t count,
                                       CullAnswers answers, std::int32_t* simplex, std::int8_t* beyond) {
    const CullPlanes<Lanes> planes = cull_planes<Lanes>(frustum);
    CullWitness witness(frustum);
    std::fill_n(simplex, 8 * count, -1);
    std::fill_n(beyond, 2 * count, std::int8_t{-1});
    std::size_t left[kBlock];
    for (std::size_t begin = 0; begin < count; begin += kBlock) {
        const std::size_t end = std::min(begin + kBlock, count);
        std::size_t after_spheres = 0;
        Lanes plane;  // that spheres lie beyond
        for (std::size_t i = begin; i < end; ++i) {
            const int lane = static_cast<int>(i % Lanes::kCount);
            if (lane == 0) {
                plane = i + Lanes::kCount <= count
                            ? classify_rows(planes, boxes.center + 3 * i, boxes.half_extents + 3 * i).plane
                            : Lanes(planes.kCount);
            }
            const bool outside = answers.state[i] == static_cast<std::uint8_t>(CullState::outside);
            const bool inside = answers.state[i] == static_cast<std::uint8_t>(CullState::inside);
            const bool by_sphere = outside && answers.certain[i] && plane[lane] < planes.kCount;
            beyond[2 * i + 1] = static_cast<std::int8_t>(by_sphere ? plane[lane] : -1.0);
            left[after_spheres] = i;
            after_spheres += answers.certain[i] && !inside && !by_sphere ? 1 : 0;
        }
        for (std::size_t k = 0; k < after_spheres; ++k) {
            boxes.prefetch_axes(left[std::min(k + kAhead, after_spheres - 1)]);
            const std::size_t i = left[k];
            const CullEvidence found = witness.evidence(boxes[i], static_cast<CullState>(answers.state[i]));
            std::memcpy(simplex + 8 * i, found.simplex, sizeof found.simplex);
            std::memcpy(beyond + 2 * i, found.beyond, sizeof found.beyond);
        }
    }
}

}  // namespace

void define_frustum(nb::module_& m) {
    m.def(
        "cull",
        [](const PackedFrustum& packed, const Rows3& center, const Matrices3& axes, const Rows3& half_extents,
           const char* accuracy, bool evidence) {
            const std::size_t count = center.shape(0);
            auto state = empty<std::uint8_t>({count});
            auto certain = empty<bool>({count});
            Output<std::int32_t> simplex{nb::none()};
            Output<std::int8_t> beyond{nb::none()};
            if (evidence) {
                simplex = empty<std::int32_t>({count, 4, 2});
                beyond = empty<std::int8_t>({count, 2});
            }
            const CullAnswers answers{state.data, certain.data};
            const std::string_view tier = accuracy;
            CullCounts counts;
            {
                const nb::gil_scoped_release unlocked;
                const auto cull_tier = tier == "bound"     ? cull_all<Lanes, CullTier::bound>
                                       : tier == "float32" ? cull_all<FloatLanes, CullTier::float32>
                                       : tier == "float64" ? cull_all<Lanes, CullTier::float64>
                                                           : cull_all<Lanes, CullTier::exact>;
                const Frustum frustum = unpacked_frustum(packed.data());
                const BoxRows boxes{center.data(), axes.data(), half_extents.data()};
                counts = cull_tier(frustum, boxes, count, answers);
                if (evidence) find_evidence(frustum, boxes, count, answers, simplex.data, beyond.data);
            }
            return nb::make_tuple(
                state.array, certain.array,
                nb::make_tuple(counts.bound, counts.filter, counts.wide, counts.exact, counts.uncertain),
                simplex.array, beyond.array);
        },
        nb::arg("frustum").noconvert(), nb::arg("center").noconvert(), nb::arg("axes").noconvert(),
        nb::arg("half_extents").noconvert(), nb::arg("accuracy"), nb::arg("evidence"));
}

}  // namespace geomsrv::bind
