// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
// Frusta as Python packs them, and rows of arrays four at a time.
#pragma once

#include <algorithm>

#include "bind/arrays.hpp"
#include "geom/lanes.hpp"
#include "geom/point_frustum.hpp"

namespace geomsrv::bind {

using PackedFrustum = Input<double, nb::shape<18>>;
using PackedFrustum2D = Input<double, nb::shape<10>>;

template <int Sides>
View<Sides> unpack_view(const double* p) {
    constexpr int kDimension = Sides + 1;
    View<Sides> view;
    std::copy_n(p, kDimension, view.origin);
    p += kDimension;
    for (auto& row : view.axes.row) {
        std::copy_n(p, kDimension, row);
        p += kDimension;
    }
    for (int i = 0; i < Sides; ++i) {
        view.low[i] = *p++;
        view.high[i] = *p++;
    }
    view.near = p[0];
    view.far = p[1];
    return view;
}

/// Four rows of an array, coordinate by coordinate.
template <std::size_t Dimension>
struct FourRows {
    Lanes at[Dimension];
    GEOMSRV_INLINE explicit FourRows(const double* p) {
        if constexpr (Dimension == 3) {
            // Two halves of six numbers each; what is side by side in one of them stays so.
            const auto both = [&](int i) __attribute__((always_inline)) {
                return Lanes(Lanes::Vector{p[i], p[i + 1], p[i + 6], p[i + 7]});
            };
            const Lanes xy = both(0), zx = both(2), yz = both(4);
            at[0] = Lanes(__builtin_shufflevector(xy.v, zx.v, 0, 5, 2, 7));
            at[1] = Lanes(__builtin_shufflevector(xy.v, yz.v, 1, 4, 3, 6));
            at[2] = Lanes(__builtin_shufflevector(zx.v, yz.v, 0, 5, 2, 7));
        } else {
            for (std::size_t k = 0; k < Dimension; ++k) {
                at[k] =
                    Lanes(Lanes::Vector{p[k], p[k + Dimension], p[k + 2 * Dimension], p[k + 3 * Dimension]});
            }
        }
    }
};

}  // namespace geomsrv::bind
