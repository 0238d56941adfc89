// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
// What proves a verdict of culling to somebody who can only add and multiply, without rounding.
#pragma once

#include <cstdint>

#include "geom/exact_cull.hpp"

namespace geomsrv {

/// Numbers are -1 where there is nothing.  Corners of the box are numbered by the bits of the axes added,
/// those of the frustum 4 far + 2 up + left (bits set on the far, the +U and the +L side), planes 0 near, 1
/// far, 2 left (+L), 3 right, 4 up (+U), 5 down.
///
///     inside      nothing: all eight corners of the box are in the frustum
///     outside     beyond = {-1, plane}: all corners of the box lie strictly beyond that plane; or
///                 simplex = pairs {corner a of the frustum, corner b of the box}, one to four: the point of
///                 conv {b - a} nearest to the origin is not 0, and the two are separated along it
///     intersects  beyond = {corner of the box, plane} that it lies strictly beyond, and
///                 simplex = nothing: the centre of the box is in the frustum; or
///                 {-1, corner}, ...: that corner of the box is in the frustum; or
///                 pairs as above: conv {b - a} holds the origin
struct CullEvidence {
    std::int32_t simplex[4][2] = {{-1, -1}, {-1, -1}, {-1, -1}, {-1, -1}};
    std::int8_t beyond[2] = {-1, -1};
};

class CullWitness {
public:
    explicit CullWitness(const Frustum& frustum);

    /// REQUIRES: the state is right.
    CullEvidence evidence(const OrientedBox& box, CullState state);

private:
    struct Heights;
    CullEvidence beyond_filter(const OrientedBox& box, CullState state, const Heights& over);
    void find_separation(const OrientedBox& box, CullEvidence& out) const;

    Frustum frustum_;
    CullPlanes<Lanes> planes_;
    ExactCull exact_;
};

}  // namespace geomsrv
