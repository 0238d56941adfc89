// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
// Every axis of one polygon projected on every vertex of another, in either precision.
#pragma once

#include <array>
#include <cstddef>
#include <limits>

#include "geom/lanes.hpp"

namespace geomsrv {

/// Vertices and axes of one polygon of a pair, in local units.  Arrays have room for `axes` and `vertices`
/// rounded up to whole lanes.
template <class Real>
struct ProjectedPolygon {
    std::size_t vertices = 0;
    std::size_t edges = 0;  ///< 0 for a point, 2 for a segment
    std::size_t axes = 0;   ///< edges, then tips
    Real* x = nullptr;      ///< vertices, then the tips'
    Real* y = nullptr;
    Real* dx = nullptr;  ///< outward axes; zero beyond `axes`
    Real* dy = nullptr;
    Real* gap = nullptr;  ///< support of the other polygon minus own
};

/// As many as fill a register.
template <class Real>
using WideLanes = LanesOf<Real, 32 / sizeof(Real)>;

/// Blocks of axes of p projected on all vertices of q; several blocks share the loads of the vertices.
template <std::size_t Blocks, class Real>
GEOMSRV_INLINE void project_blocks(const ProjectedPolygon<Real>& p, const ProjectedPolygon<Real>& q,
                                   std::size_t first) {
    using Wide = WideLanes<Real>;
    constexpr std::size_t kLanes = Wide::kCount;
    std::array<Wide, Blocks> dx;
    std::array<Wide, Blocks> dy;
    std::array<Wide, Blocks> low;
    for (std::size_t i = 0; i < Blocks; ++i) {
        dx[i] = Wide::load(p.dx + first + i * kLanes);
        dy[i] = Wide::load(p.dy + first + i * kLanes);
        low[i] = std::numeric_limits<Real>::infinity();
    }
    for (std::size_t j = 0; j < q.vertices; ++j) {
        const Wide x = q.x[j];
        const Wide y = q.y[j];
        for (std::size_t i = 0; i < Blocks; ++i) {
            low[i] = lesser(dx[i] * x + dy[i] * y, low[i]);
        }
    }
    for (std::size_t i = 0; i < Blocks; ++i) {
        const std::size_t k = first + i * kLanes;
        (low[i] - (dx[i] * Wide::load(p.x + k) + dy[i] * Wide::load(p.y + k))).store(p.gap + k);
    }
}

/// Gaps of all axes of p.
template <class Real>
GEOMSRV_INLINE void project_all(const ProjectedPolygon<Real>& p, const ProjectedPolygon<Real>& q) {
    constexpr std::size_t kLanes = WideLanes<Real>::kCount;
    const std::size_t end = (p.axes + kLanes - 1) / kLanes * kLanes;
    std::size_t k = 0;
    for (; k + 4 * kLanes <= end; k += 4 * kLanes) {
        project_blocks<4>(p, q, k);
    }
    switch ((end - k) / kLanes) {
        case 3:
            project_blocks<3>(p, q, k);
            break;
        case 2:
            project_blocks<2>(p, q, k);
            break;
        case 1:
            project_blocks<1>(p, q, k);
            break;
        default:
            break;
    }
}

}  // namespace geomsrv
