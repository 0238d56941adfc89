// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
#include "geom/single_core.hpp"

namespace geomsrv {

namespace {

// A vertex is a sum of vectors that are rounded once each, by u of their length, and together no longer than
// the reach.  A second u pays for the difference of two vertices where that is rounded too, and for the terms
// of second order.
constexpr double kSingleRounding = 2 * kUnitRoundoff * SingleCore::kCoarseness;

// Below 2^-126 a float is rounded to a multiple of 2^-149, by half of it.  Of a vertex or a support fewer
// than 64 numbers and products may be.
constexpr double kSingleUnderflow = 0x1p-144;

// The sum of the rounded vectors is longer by u at most.
constexpr double kRoundedUp = 1.0 + 2 * kUnitRoundoff * SingleCore::kCoarseness;

}  // namespace

float* SingleMemory::take(std::size_t count) {
    if (count <= kFew) {
        return few_;
    }
    many_.resize(count);
    return many_.data();
}

SingleCore rounded_to_single(const Core& core, double unit, SingleMemory& memory) {
    SingleCore out;
    out.center = rounded_to_single(unit * core.center);
    out.generators = core.generators;
    for (int i = 0; i < core.generators; ++i) {
        out.generator[i] = rounded_to_single(unit * core.generator[i]);
    }
    if (core.points != nullptr) {
        constexpr int kLanes = LanesOf<float, 4>::kCount;
        out.count = core.count;
        out.stride = (core.count + kLanes - 1) / kLanes * kLanes;
        float* to = memory.take(3 * static_cast<std::size_t>(out.stride));
        out.points = to;
        for (int k = 0; k < 3; ++k) {
            const double* from = core.points + static_cast<std::ptrdiff_t>(k) * core.count;
            for (int i = 0; i < core.count; ++i) {
                *to++ = static_cast<float>(unit * from[i]);
            }
            for (int i = core.count; i < out.stride; ++i) {
                *to = to[-1];
                ++to;
            }
        }
    }
    out.reach = unit * core.reach * kRoundedUp;
    out.error = unit * core.error + kSingleRounding * out.reach + (out.reach > 0.0 ? kSingleUnderflow : 0.0);
    return out;
}

Core widened(const SingleCore& core) {
    Core out;
    out.center = widened(core.center);
    out.generators = core.generators;
    for (int i = 0; i < core.generators; ++i) {
        out.generator[i] = widened(core.generator[i]);
    }
    out.reach = core.reach;
    out.error = core.error;
    return out;
}

}  // namespace geomsrv
