// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
// Frustum against box for the given numbers exactly, where doubles cannot tell.
//
// Doubles have named the axes that they cannot speak for (doubts_about); only these are measured again, in
// world coordinates, where every term is a polynomial in the caller's numbers: first with double-double and a
// running error bound, then, where the sign is still open, without rounding.  The bodies are apart iff some
// axis separates them; the box is inside iff no plane has a point of it beyond.
#pragma once

#include <optional>

#include "geom/exact_gjk.hpp"
#include "geom/frustum_box.hpp"

namespace geomsrv {

/// A frustum relative to its apex, and what the axes need of it.
template <class N>
struct FrustumTerms {
    explicit FrustumTerms(const Frustum& frustum);

    VectorOf<N> origin, left, up;
    VectorOf<N> corner[4];  ///< of the near face: l L + u U + n D, numbered 2 up + left
    VectorOf<N> normal[6];  ///< of the planes, outward
    N offset[6];            ///< normal . x <= offset inside
    N near, far;
};

/// Signs of one box against one frustum; kUncertain where N cannot tell.
template <class N>
class CullSigns {
public:
    CullSigns(const FrustumTerms<N>& frustum, const OrientedBox& box);

    /// +1 where the axis (CullAxis) or the plane separates the two, else 0 or -1.
    [[nodiscard]] int separates(int axis) const;
    /// Of the height of the highest corner over a plane.
    [[nodiscard]] int reaches_beyond(int plane) const;
    /// Of the height of a corner, numbered by the bits of the axes added.
    [[nodiscard]] int corner(int plane, int number) const;

private:
    [[nodiscard]] N height(int plane) const {
        return dot(frustum_.normal[plane], center_) - frustum_.offset[plane];
    }
    [[nodiscard]] N half_width(const VectorOf<N>& direction) const;

    const FrustumTerms<N>& frustum_;
    VectorOf<N> center_, axis_[3];
    N half_[3];
};

/// One frustum against many boxes.
class ExactCull {
public:
    explicit ExactCull(const Frustum& frustum);

    struct Verdict {
        CullState state;
        Rung rung;
    };
    /// REQUIRES: cull_by_axes left the box uncertain.
    Verdict decide(const OrientedBox& box);

    /// What `ask` finds out from CullSigns, in the first arithmetic that can tell.
    template <class Ask>
    int sign(const OrientedBox& box, Ask ask) {
        const int found = in_range(box) ? ask(CullSigns<Enclosed>(wide_, box)) : kUncertain;
        return found != kUncertain ? found : ask(CullSigns<Exact>(exact_terms(), box));
    }

    /// Lengths are such that nothing overflows in double-double.
    [[nodiscard]] bool in_range(const OrientedBox& box) const;

private:
    const FrustumTerms<Exact>& exact_terms();

    Frustum frustum_;
    CullFrame<double> frame_;
    FrustumTerms<Enclosed> wide_;
    std::optional<FrustumTerms<Exact>> exact_;  ///< made when first needed
};

}  // namespace geomsrv
