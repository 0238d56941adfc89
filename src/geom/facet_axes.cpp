// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
#include "geom/facet_axes.hpp"

#include <algorithm>
#include <cmath>

namespace geomsrv {

namespace {

// Gap along the normalised cross product of two generators g, h at an angle with sine s, times S / s.  The
// product is off by 2 sqrt(2) u |g| |h|: that tilts the part of every other generator, and changes the length
// divided by, 6 u together; dot products (3 u), sums (4 u), the length (4 u), the middle and the division (2
// u) come without 1 / s.
constexpr double kAxisError = 20 * kUnitRoundoff;

// Generators that enclose less than this count as parallel.  Then the facet they span is as thin as rounding;
// turning the shorter one onto the longer moves no point by more than its length times the sine, which is
// added to `upper`.
constexpr double kParallelSine = 8 * kUnitRoundoff;

}  // namespace

FacetAxis deepest_facet(const Core& a, const Core& b) {
    Vec3 generator[6];
    double length[6] = {};
    int count = 0;
    double size = norm(b.center - a.center);
    for (const Core* core : {&a, &b}) {
        for (int i = 0; i < core->generators; ++i) {
            const double l = norm(core->generator[i]);
            if (l > 0.0) {
                generator[count] = core->generator[i];
                length[count++] = l;
                size += l;
            }
        }
    }
    const Vec3 middle = b.center - a.center;

    FacetAxis best;
    best.gap = -std::numeric_limits<double>::infinity();
    best.upper = best.gap;
    double turned = 0.0;
    for (int i = 0; i < count; ++i) {
        for (int j = i + 1; j < count; ++j) {
            const Vec3 n = cross(generator[i], generator[j]);
            const double area = norm(n);
            const double product = length[i] * length[j];
            if (area <= kParallelSine * product) {
                turned += area / std::max(length[i], length[j]);
                continue;
            }
            // The two generators that span the facet have no part along its normal: leaving them out is
            // exact.
            double gap = std::abs(dot(middle, n));
            for (int k = 0; k < count; ++k) {
                if (k != i && k != j) {
                    gap -= std::abs(dot(generator[k], n));
                }
            }
            gap /= area;
            best.upper = std::max(best.upper, gap + kAxisError * size * (product / area));
            if (gap > best.gap) {
                best.gap = gap;
                best.normal = n;
                best.found = true;
            }
        }
    }
    best.upper += turned;
    if (best.found) {
        best.normal = normalized(dot(middle, best.normal) < 0.0 ? -best.normal : best.normal);
    }
    return best;
}

FacetAxis deepest_facet(const SingleCore& a, const SingleCore& b) {
    return deepest_facet(widened(a), widened(b));
}

}  // namespace geomsrv
