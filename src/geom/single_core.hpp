// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
// Cores in single precision: placed in double about a local origin, brought to size 1, and rounded once.
//
// The algorithms and the proofs are those of double precision.  A bound that counts k roundings there,
// k * kUnitRoundoff, counts as many here, k * kUnitRoundoff * kCoarseness: vertices, supports and directions
// are found by the same operations in the same order.  What is done once per pair or facet with numbers found
// so (a closed form, the length between two witness points, a facet's plane) is done in double, where it
// costs the same and rounds less than the bound allows.
#pragma once

#include <cmath>
#include <vector>

#include "geom/core.hpp"
#include "geom/lanes.hpp"
#include "geom/vec.hpp"

namespace geomsrv {

struct Float3 {
    float x = 0.0F;
    float y = 0.0F;
    float z = 0.0F;
};

constexpr Float3 operator+(Float3 a, Float3 b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
constexpr Float3 operator-(Float3 a, Float3 b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
constexpr Float3 operator-(Float3 a) { return {-a.x, -a.y, -a.z}; }
constexpr Float3 operator*(float s, Float3 a) { return {s * a.x, s * a.y, s * a.z}; }
constexpr float dot(Float3 a, Float3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
constexpr Float3 cross(Float3 a, Float3 b) {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

/// Each coordinate to nearest.
constexpr Float3 rounded_to_single(Vec3 v) {
    return {static_cast<float>(v.x), static_cast<float>(v.y), static_cast<float>(v.z)};
}
constexpr Vec3 widened(Float3 v) { return {v.x, v.y, v.z}; }

/// A core as in core.hpp, in a unit of length in which neither it nor its pair is longer than 2.
struct SingleCore {
    static constexpr double kCoarseness = 0x1p29;  ///< its roundoff, 2^-24, in terms of kUnitRoundoff

    Float3 center;
    Float3 generator[3];
    int generators = 0;
    const float* points = nullptr;  ///< hull: `stride` x, `stride` y, `stride` z; the last point is repeated
    int count = 0;
    int stride = 0;
    double reach = 0.0;
    double error = 0.0;  ///< of a vertex, that of its rounding to single precision included
};

/// Takes the coordinates of a hull: of most in place.
class SingleMemory {
public:
    float* take(std::size_t count);

private:
    static constexpr std::size_t kFew = 192;  // 64 points
    float few_[kFew];
    std::vector<float> many_;
};

/// unit * core, rounded.  `unit` is a power of two; `memory` must outlive the result.
SingleCore rounded_to_single(const Core& core, double unit, SingleMemory& memory);

/// The same numbers as doubles.  REQUIRES: a zonotope.
Core widened(const SingleCore& core);

/// See vertex_of(Core).
inline Vec3 vertex_of(const SingleCore& core, int vertex) {
    if (core.points != nullptr) {
        const float* p = core.points + vertex;
        return widened(core.center + Float3{p[0], p[core.stride], p[2 * core.stride]});
    }
    Float3 v = core.center;
    for (int i = 0; i < core.generators; ++i) {
        v = (vertex >> i & 1) != 0 ? v + core.generator[i] : v - core.generator[i];
    }
    return widened(v);
}

struct SingleExtreme {
    float value = 0.0F;
    int vertex = 0;
};

/// See highest(Core).
inline SingleExtreme highest(const SingleCore& core, Float3 n) {
    if (core.points == nullptr) {
        SingleExtreme top{dot(n, core.center), 0};
        for (int i = 0; i < core.generators; ++i) {
            const float along = dot(n, core.generator[i]);
            top.value += std::abs(along);
            top.vertex |= (along > 0.0F ? 1 : 0) << i;
        }
        return top;
    }
    using Four = LanesOf<float, 4>;
    using Index = Four::Mask::Vector;
    const float* x = core.points;
    const float* y = x + core.stride;
    const float* z = y + core.stride;
    const auto along = [&](int i) __attribute__((always_inline)) {
        return Four(n.x) * Four::load(x + i) + Four(n.y) * Four::load(y + i) + Four(n.z) * Four::load(z + i);
    };
    Four best = along(0);
    Index block{};
    for (int i = Four::kCount; i < core.stride; i += Four::kCount) {
        const Four value = along(i);
        const auto above = best < value;
        best = select(above, value, best);
        block = above.v ? Index{} + i : block;
    }
    // The best lane, halving twice; branches would be guessed wrongly.
    block += Index{0, 1, 2, 3};
    const auto halve = [&](const Four& value, const Index& index) __attribute__((always_inline)) {
        const auto above = best < value;
        best = select(above, value, best);
        block = above.v ? index : block;
    };
    halve(Four(__builtin_shufflevector(best.v, best.v, 2, 3, 0, 1)),
          __builtin_shufflevector(block, block, 2, 3, 0, 1));
    halve(Four(__builtin_shufflevector(best.v, best.v, 1, 0, 3, 2)),
          __builtin_shufflevector(block, block, 1, 0, 3, 2));
    const int last = core.count - 1;
    return {best[0] + dot(n, core.center), block[0] < last ? block[0] : last};
}

inline SingleExtreme lowest(const SingleCore& core, Float3 n) {
    const SingleExtreme top = highest(core, -n);
    return {-top.value, top.vertex};
}

/// Along a direction in double, which is rounded: another unit vector but for 1 u, as those of double
/// precision are but for 4.
inline Extreme highest(const SingleCore& core, Vec3 n) {
    const SingleExtreme top = highest(core, rounded_to_single(n));
    return {top.value, top.vertex};
}
inline Extreme lowest(const SingleCore& core, Vec3 n) {
    const Extreme top = highest(core, -n);
    return {-top.value, top.vertex};
}

/// The core moved along a unit vector.
inline SingleCore moved(SingleCore core, Vec3 along, double by) {
    core.center = rounded_to_single(widened(core.center) + by * along);
    core.reach += std::abs(by);
    return core;
}

}  // namespace geomsrv
