// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
#include "geom/distance_table.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "geom/bounding_distance.hpp"
#include "geom/convex_convex.hpp"
#include "geom/curved_distance.hpp"
#include "geom/exact_convex.hpp"
#include "geom/half_space_pairs.hpp"
#include "geom/place.hpp"
#include "geom/point_box.hpp"
#include "geom/point_point.hpp"
#include "geom/point_segment.hpp"
#include "geom/segment_segment.hpp"
#include "geom/single_distance.hpp"

namespace geomsrv {

namespace {

/// The other way round.
void swap_bodies(CoreSeparation& s) {
    std::swap(s.point_a, s.point_b);
    s.normal = -s.normal;
    for (int i = 0; i < s.witness.count; ++i) {
        std::swap(s.witness.a[i], s.witness.b[i]);
    }
    for (int i = 0; i < s.simplex.count; ++i) {
        std::swap(s.simplex.a[i], s.simplex.b[i]);
    }
}

CoreSeparation swapped(CoreSeparation s) {
    swap_bodies(s);
    return s;
}

using Kernel = CoreSeparation (*)(const Placed& a, const Placed& b, bool penetration);

CoreSeparation sphere_sphere(const Placed& a, const Placed& b, bool) { return point_point(a.core, b.core); }
CoreSeparation sphere_capsule(const Placed& a, const Placed& b, bool) {
    return point_segment(a.core, b.core);
}
CoreSeparation sphere_box(const Placed& a, const Placed& b, bool deep) {
    return point_box(a.core, b.core, deep);
}
CoreSeparation capsule_capsule(const Placed& a, const Placed& b, bool) {
    return segment_segment(a.core, b.core);
}
CoreSeparation general(const Placed& a, const Placed& b, bool deep) {
    return convex_convex(a.core, b.core, deep);
}
CoreSeparation convex_half(const Placed& a, const Placed& b, bool deep) {
    return convex_half_space(a.core, b.half_space, deep);
}
CoreSeparation half_half(const Placed& a, const Placed& b, bool) {
    return half_space_half_space(a.half_space, b.half_space);
}
CoreSeparation unsupported(const Placed&, const Placed&, bool) {
    CoreSeparation out;
    out.outcome = Outcome::unsupported;
    out.point_a = out.point_b = out.normal = nan_vector();
    return out;
}

MaybeCurved body_of(const Placed& placed) {
    return placed.curved ? MaybeCurved{&*placed.curved, nullptr} : MaybeCurved{nullptr, &placed.core};
}
CoreSeparation with_curved(const Placed& a, const Placed& b, bool deep) {
    return curved_distance(body_of(a), body_of(b), deep);
}
CoreSeparation half_curved(const Placed& a, const Placed& b, bool deep) {
    return b.curved ? swapped(curved_half_space(*b.curved, a.half_space, deep)) : unsupported(a, b, deep);
}

// Upper triangle only: the caller orders the pair.  Rows and columns as in ShapeKind.
// clang-format off
constexpr Kernel kBelow = nullptr;
constexpr Kernel kUnsup = unsupported;
constexpr Kernel kKernels[kShapeKinds][kShapeKinds] = {
    /*              sphere         capsule          box         convex   half_space   cylinder     cone         ellipsoid    mesh    polygon */
    /*sphere    */ {sphere_sphere, sphere_capsule,  sphere_box, general, convex_half, with_curved, with_curved, with_curved, kUnsup, kUnsup},
    /*capsule   */ {kBelow,        capsule_capsule, general,    general, convex_half, with_curved, with_curved, with_curved, kUnsup, kUnsup},
    /*box       */ {kBelow,        kBelow,          general,    general, convex_half, with_curved, with_curved, with_curved, kUnsup, kUnsup},
    /*convex    */ {kBelow,        kBelow,          kBelow,     general, convex_half, with_curved, with_curved, with_curved, kUnsup, kUnsup},
    /*half_space*/ {kBelow,        kBelow,          kBelow,     kBelow,  half_half,   half_curved, half_curved, half_curved, kUnsup, kUnsup},
    /*cylinder  */ {kBelow,        kBelow,          kBelow,     kBelow,  kBelow,      with_curved, with_curved, with_curved, kUnsup, kUnsup},
    /*cone      */ {kBelow,        kBelow,          kBelow,     kBelow,  kBelow,      kBelow,      with_curved, with_curved, kUnsup, kUnsup},
    /*ellipsoid */ {kBelow,        kBelow,          kBelow,     kBelow,  kBelow,      kBelow,      kBelow,      with_curved, kUnsup, kUnsup},
    /*mesh      */ {kBelow,        kBelow,          kBelow,     kBelow,  kBelow,      kBelow,      kBelow,      kBelow,      kUnsup, kUnsup},
    /*polygon   */ {kBelow,        kBelow,          kBelow,     kBelow,  kBelow,      kBelow,      kBelow,      kBelow,      kBelow, kUnsup},
};
// clang-format on

constexpr bool triangle_is_full() {
    for (std::size_t row = 0; row < kShapeKinds; ++row) {
        for (std::size_t column = 0; column < kShapeKinds; ++column) {
            if ((kKernels[row][column] == nullptr) != (column < row)) {
                return false;
            }
        }
    }
    return true;
}
static_assert(triangle_is_full(), "every pair of kinds has an entry above the diagonal, and none below");

constexpr Kernel kernel_of(ShapeKind a, ShapeKind b) {
    return kKernels[static_cast<std::size_t>(a)][static_cast<std::size_t>(b)];
}

/// What the shape is larger than its core by [m].
double radius_of(const ShapeView& shape) {
    return shape.kind == ShapeKind::sphere || shape.kind == ShapeKind::capsule ? shape.params[0] : 0.0;
}

/// x - a - b for the bounds of a correctly rounded x; of the numbers as they are, so that nothing is lost.
Rounding reduced_exactly(const CoreSeparation& core, double a, double b) {
    const auto rounded = [&](double x) {
        return rounded_quotient(Exact(x) - Exact(a) - Exact(b), Exact(1.0));
    };
    return {rounded(core.value).nearest, rounded(core.lower).lower, rounded(core.upper).upper};
}

/// The signed distance of the shapes from that of their cores.
Separation with_radii(const CoreSeparation& core, double radius_a, double radius_b, Vec3 origin,
                      bool penetration) {
    Separation out;
    if (core.outcome == Outcome::unsupported) {
        out.point_a = out.point_b = out.normal = nan_vector();
        return out;
    }
    out.outcome = core.outcome;
    out.stage = core.stage;
    out.iterations = core.iterations;
    out.witness = core.witness;
    out.simplex = core.simplex;
    out.rung = core.rung;
    const double radii = radius_a + radius_b;
    // Each of the sum and the difference rounds by u.
    const auto reduced = [&](double x, double direction) {
        return radii == 0.0 ? x : x - radii + direction * 2 * kUnitRoundoff * (std::abs(x) + radii);
    };
    out.distance = core.value - radii;
    out.lower = reduced(core.lower, -1.0);
    out.upper = reduced(core.upper, 1.0);
    if (core.stage == Stage::exact && radii > 0.0) {
        const Rounding reduced_core = reduced_exactly(core, radius_a, radius_b);
        out.distance = reduced_core.nearest;
        out.lower = reduced_core.lower;
        out.upper = reduced_core.upper;
    }
    if (core.rung == Rung::bound) {
        out.distance = out.lower;
    }
    const bool apart = penetration || out.distance > 0.0;
    out.normal = core.rung == Rung::bound && !apart ? nan_vector() : core.normal;
    out.point_a = core.point_a + origin;
    out.point_b = core.point_b + origin;
    if (apart && radii > 0.0) {
        out.point_a = core.point_a + radius_a * core.normal + origin;
        out.point_b = core.point_b - radius_b * core.normal + origin;
    } else if (!apart) {
        // A common point: of the cores, or on the way from one to the other where the balls about it overlap.
        const double share = radii > 0.0 && core.value > 0.0 ? radius_a / radii : 0.0;
        out.point_a = core.point_a + share * (core.point_b - core.point_a) + origin;
        out.point_b = out.point_a;
    }
    if (!penetration) {
        out.distance = std::max(out.distance, 0.0);
        out.lower = std::max(out.lower, 0.0);
        out.upper = std::max(out.upper, 0.0);
    }
    return out;
}

/// A body in world coordinates, by its own numbers.
ExactBody exact_body(const WorldBody& body) {
    ExactBody out;
    if (body.is_box) {
        out.center = body.box.center;
        out.generators = 3;
        std::copy(std::begin(body.box.axes.row), std::end(body.box.axes.row), out.axis);
        out.half[0] = body.box.half_extents.x;
        out.half[1] = body.box.half_extents.y;
        out.half[2] = body.box.half_extents.z;
        return out;
    }
    static constexpr Transform kUnmoved;
    return exact_body(body.hull, kUnmoved);
}

struct LocalPair {
    Placed a;
    Placed b;

    double size() const { return a.core.reach + b.core.reach; }
};

/// The unit in which a pair comes into the range of the kernels.
template <class Place, class Magnitude>
double better_scale(LocalFrame frame, double size, Place place_both, Magnitude magnitude) {
    // Twice at most: numbers that overflow are first brought down to 1, and what then cancels is brought up
    // again.
    for (int tries = 0; tries < 2 && !in_range(size); ++tries) {
        const bool finite = size <= std::numeric_limits<double>::max();
        frame.scale *= scale_for(finite ? size : frame.scale * magnitude());
        size = place_both(frame).size();
    }
    return frame.scale;
}

/// Places the pair, in a larger or smaller unit of length where its sizes leave the range of the kernels, and
/// solves; solve(pair, scale) answers in the caller's unit.
template <class Place, class Magnitude, class Solve>
CoreSeparation solve_in_range(LocalFrame frame, Place place_both, Magnitude magnitude, Solve solve) {
    const LocalPair pair = place_both(frame);
    if (in_range(pair.size())) {
        return solve(pair, 1.0);
    }
    frame.scale = better_scale(frame, pair.size(), place_both, magnitude);
    return solve(place_both(frame), frame.scale);
}

/// Half spaces multiply lengths by unit vectors only: any unit will do in which nothing overflows.
template <class Place, class Magnitude, class Solve>
CoreSeparation solve_unbounded(LocalFrame frame, Place place_both, Magnitude magnitude, Solve solve) {
    // Products of two parts of a split number (two_product) overflow from 2^996 on; 2^-300 brings 2^1023 far
    // below.
    constexpr double kHuge = 0x1p900;
    constexpr double kMuchSmaller = 0x1p-300;
    if (!(magnitude() > kHuge)) {
        return solve(place_both(frame));
    }
    frame.scale = kMuchSmaller;
    CoreSeparation out = solve(place_both(frame));
    unscale(out, frame.scale);
    return out;
}

}  // namespace

bool supported_pair(ShapeKind a, ShapeKind b) { return kernel_of(std::min(a, b), std::max(a, b)) != kUnsup; }

Separation shape_distance(const ShapeView& a, const ShapeView& b, const Transform& X_ab, const Wanted& wanted,
                          double* scratch) {
    const bool flip = a.kind > b.kind;
    const Kernel kernel = flip ? kernel_of(b.kind, a.kind) : kernel_of(a.kind, b.kind);
    // The origin is a point of a or, if a is unbounded, one of b: the plane's offset is then measured next to
    // b.
    const bool anchored_b = a.kind == ShapeKind::half_space && b.kind != ShapeKind::half_space;
    LocalFrame frame;
    frame.origin = anchored_b ? X_ab * middle_of(b) : middle_of(a);
    const auto place_both = [&](const LocalFrame& f) {
        return LocalPair{place(a, {}, f, scratch), place(b, X_ab, f, scratch + 3 * a.count)};
    };
    const bool unbounded = a.kind == ShapeKind::half_space || b.kind == ShapeKind::half_space;
    const bool curved = is_curved(a.kind) || is_curved(b.kind);
    const ShapeKind first_kind = flip ? b.kind : a.kind;
    const auto solve = [&](const LocalPair& pair) {
        const Placed& first = flip ? pair.b : pair.a;
        const Placed& second = flip ? pair.a : pair.b;
        const bool has_core = kernel != kUnsup && kernel != half_half;
        // Half spaces are their own bounding volumes.
        if (wanted.tier == Tier::bound && has_core) {
            const bool plane_first = first_kind == ShapeKind::half_space;
            return !unbounded    ? bounding_distance(first.core, second.core)
                   : plane_first ? swapped(bounding_distance(second.core, first.half_space))
                                 : bounding_distance(first.core, second.half_space);
        }
        // Two of them have no size that single precision could be relative to; supports of curved bodies are
        // found in double.
        if (wanted.tier == Tier::float32 && has_core && !curved) {
            return unbounded ? single_distance(first.core, second.half_space, wanted.penetration)
                             : single_distance(first.core, second.core, wanted.penetration);
        }
        return kernel(first, second, wanted.penetration);
    };
    const auto magnitude = [&] { return std::max(magnitude_of(a, {}), magnitude_of(b, X_ab)); };
    if (wanted.tier == Tier::exact && kernel != kUnsup && !unbounded && !curved) {
        const Transform X_a;
        const ExactBody exact_a = exact_body(a, X_a);
        const ExactBody exact_b = exact_body(b, X_ab);
        const CoreSeparation core =
            solve_in_range(frame, place_both, magnitude, [&](const LocalPair& pair, double scale) {
                return exact_convex_convex({exact_a, pair.a.core}, {exact_b, pair.b.core}, scale, wanted);
            });
        return with_radii(core, radius_of(a), radius_of(b), frame.origin, wanted.penetration);
    }
    const auto solve_scaled = [&](const LocalPair& pair, double scale) {
        CoreSeparation core = solve(pair);
        unscale(core, scale);
        return core;
    };
    CoreSeparation core = unbounded ? solve_unbounded(frame, place_both, magnitude, solve)
                                    : solve_in_range(frame, place_both, magnitude, solve_scaled);
    if (flip) {
        swap_bodies(core);
    }
    return with_radii(core, radius_of(a), radius_of(b), frame.origin, wanted.penetration);
}

Separation world_distance(const WorldBody& a, const WorldBody& b, const Wanted& wanted, double* scratch) {
    const auto pose = [](const WorldBody& body) { return Transform{{}, body.origin}; };
    const auto placed = [&](const WorldBody& body, const LocalFrame& f, double* memory) {
        return body.is_box
                   ? Placed{place_box(body.box.center, body.box.axes, body.box.half_extents, f), {}, {}}
                   : place(body.hull, pose(body), f, memory);
    };
    const auto magnitude = [&](const WorldBody& body) {
        return body.is_box ? std::max(largest_of(body.box.center), largest_of(body.box.half_extents))
                           : magnitude_of(body.hull, pose(body));
    };
    LocalFrame frame;
    frame.origin = a.is_box ? a.box.center : a.origin + middle_of(a.hull);
    const CoreSeparation core = solve_in_range(
        frame,
        [&](const LocalFrame& f) {
            return LocalPair{placed(a, f, scratch),
                             placed(b, f, scratch + (a.is_box ? 0 : 3 * a.hull.count))};
        },
        [&] { return std::max(magnitude(a), magnitude(b)); },
        [&](const LocalPair& pair, double scale) {
            if (wanted.tier == Tier::exact) {
                return exact_convex_convex({exact_body(a), pair.a.core}, {exact_body(b), pair.b.core}, scale,
                                           wanted);
            }
            CoreSeparation out = wanted.tier == Tier::bound ? bounding_distance(pair.a.core, pair.b.core)
                                 : wanted.tier == Tier::float32
                                     ? single_distance(pair.a.core, pair.b.core, wanted.penetration)
                                     : convex_convex(pair.a.core, pair.b.core, wanted.penetration);
            unscale(out, scale);
            return out;
        });
    return with_radii(core, 0.0, 0.0, frame.origin, wanted.penetration);
}

}  // namespace geomsrv
