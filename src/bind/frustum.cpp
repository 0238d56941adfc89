// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "bind/arrays.hpp"
#include "bind/module.hpp"
#include "geom/frustum_box.hpp"

namespace geomsrv::bind {

namespace {

using PackedFrustum = Input<double, nb::shape<18>>;

Frustum unpack(const double* p) {
    return {.origin = {p[0], p[1], p[2]},
            .axes = {{{p[3], p[4], p[5]}, {p[6], p[7], p[8]}, {p[9], p[10], p[11]}}},
            .l0 = p[12],
            .l1 = p[13],
            .u0 = p[14],
            .u1 = p[15],
            .near = p[16],
            .far = p[17]};
}

struct BoxRows {
    const double *center, *axes, *half_extents;

    OrientedBox operator[](std::size_t i) const {
        const double *c = center + 3 * i, *a = axes + 9 * i, *e = half_extents + 3 * i;
        return {{c[0], c[1], c[2]},
                {{{a[0], a[1], a[2]}, {a[3], a[4], a[5]}, {a[6], a[7], a[8]}}},
                {e[0], e[1], e[2]}};
    }
};

struct CullCounts {
    std::int64_t bound = 0, filter = 0, uncertain = 0;
};

/// Boxes are classified by planes, and the undecided ones of each block go on to the axes while still in cache.
GEOMSRV_WIDE_CLONES CullCounts cull_all(const CullPlanes& planes, const CullFrame& frame, BoxRows boxes,
                                        std::size_t count, std::uint8_t* state, bool* certain) {
    constexpr std::size_t kBlock = 256;
    std::size_t undecided[kBlock];
    CullCounts counts;
    for (std::size_t begin = 0; begin < count; begin += kBlock) {
        const std::size_t end = std::min(begin + kBlock, count);
        std::size_t left = 0;
        for (std::size_t i = begin; i < end; ++i) {
            state[i] = classify_by_planes(planes, boxes[i]);
            certain[i] = true;
            undecided[left] = i;
            left += state[i] == kUndecided ? 1 : 0;
        }
        counts.bound += static_cast<std::int64_t>(end - begin - left);
        for (std::size_t k = 0; k < left; ++k) {
            const std::size_t i = undecided[k];
            const CullVerdict verdict = cull_by_axes(frame, boxes[i]);
            state[i] = static_cast<std::uint8_t>(verdict.state);
            certain[i] = verdict.certain;
            (verdict.certain ? counts.filter : counts.uncertain) += 1;
        }
    }
    return counts;
}

}  // namespace

void define_frustum(nb::module_& m) {
    m.def(
        "cull",
        [](const PackedFrustum& packed, const Rows3& center, const Matrices3& axes, const Rows3& half_extents) {
            const std::size_t count = center.shape(0);
            auto state = empty<std::uint8_t>({count});
            auto certain = empty<bool>({count});
            CullCounts counts;
            {
                const nb::gil_scoped_release unlocked;
                const Frustum frustum = unpack(packed.data());
                counts = cull_all(cull_planes(frustum), cull_frame(frustum),
                                  {center.data(), axes.data(), half_extents.data()}, count, state.data, certain.data);
            }
            return nb::make_tuple(state.array, certain.array,
                                  nb::make_tuple(counts.bound, counts.filter, counts.uncertain));
        },
        nb::arg("frustum").noconvert(), nb::arg("center").noconvert(), nb::arg("axes").noconvert(),
        nb::arg("half_extents").noconvert());
}

}  // namespace geomsrv::bind
