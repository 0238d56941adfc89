// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
// Distance from a point to a view frustum, its nearest point and its region; in space and in the plane.
//
// Paper 1 (Eberly, "Distance from Point to Orthogonal Frustum", 2000) walks a decision tree of Voronoi
// regions; book sections 6.3.3 and 10.4.3 repeat it.  Here the same regions come out of one closed form
// without branches.
//
//      far  +-----------------------------+     At depth t the frustum is the window low t <= x <= high t,
//            \        .                  /      so the squared distance to that slice is
//             \      . t                /
//        -----------x------- P         /          (t - z)^2 + sum over sides (excess of x over it)^2,
//               \                     /
//         near   +-------------------+          convex in t.  Half its derivative consists of increasing
//                         .                     straight pieces:
//                         E
//     psi(t) = t - z + sum over sides of  low max(low t - x, 0) - high max(x - high t, 0).
//
// For a slope k, the piece k (k t - x) is cut off at 0 from above where the window widens away from the axis,
// min(0, .); and from below, max(0, .), at the inner slope of a window that lies beyond the axis.  So
//
//     psi = min over S max over T of (t - z + sum of k (k t - x) over the slopes k in S and T),
//     t*  = max over S min over T of (z + sum k x) / (1 + sum k^2), clamped to [near, far],
//
// where S and T run over subsets of the slopes of the first and of the second kind.  A point cannot be near
// both slopes of a side, so S and T need at most one slope of a side each.
#pragma once

#include <cmath>
#include <cstdint>

#include "geom/frustum.hpp"

namespace geomsrv {

/// A frustum as its numbers.  `Sides` is 2 in space (L, U), 1 in the plane (L); coordinate number `Sides` is
/// the depth along D.
template <int Sides>
struct View {
    static constexpr int kDimension = Sides + 1;
    double origin[kDimension];       ///< apex E [m]
    Rows<double, kDimension> axes;   ///< rows L, (U,) D
    double low[Sides], high[Sides];  ///< window on the near plane [m]
    double near, far;                ///< [m]
};

/// Where the window of a side lies with respect to the axis, which is at x = 0.
enum class Window : std::uint8_t {
    centred,  ///< low = -high: |x| serves for x, with one slope
    around,   ///< low <= 0 <= high
    beyond,   ///< 0 < low; mirrored if need be
};

/// How many choices S has for a side (no slope, or one of them), and T.
constexpr int min_choices(Window window) { return window == Window::around ? 3 : 2; }
constexpr int max_choices(Window window) { return window == Window::beyond ? 2 : 1; }

/// Which slopes of a side are in S and T, by choices s and t.
struct SlopeChoice {
    bool low, high;
};
constexpr SlopeChoice slope_choice(Window window, int s, int t) {
    // S: no slope, the low one if it is of the first kind, the high one.  T: no slope, the low one.
    const int last = min_choices(window) - 1;
    return {(last == 2 && s % 3 == 1) || t % max_choices(window) == 1, s % (last + 1) == last};
}

/// The windows of all sides, known at compile time.
template <Window... Kind>
struct Windows {
    static constexpr Window kKind[] = {Kind...};
    static constexpr int kMin = (min_choices(Kind) * ...), kMax = (max_choices(Kind) * ...);

    /// Of side `index`.  Choices of all sides count them like digits, the first side fastest.
    static constexpr SlopeChoice choice(int s, int t, int index) {
        for (int i = 0; i < index; ++i) {
            s /= min_choices(kKind[i]);
            t /= max_choices(kKind[i]);
        }
        return slope_choice(kKind[index], s, t);
    }
};

/// One side of a frustum: low_slope t <= x <= high_slope t at depth t.
template <class Number>
struct FrustumSide {
    Number low_slope, high_slope;
    Number low, high;            ///< the slopes times `view`
    Number low_room, high_room;  ///< 1 / (|low| + view), 1 / (|high| + view)
    Number low_code, high_code;  ///< what being beyond low, high adds to the region
    Window window;
    double mirror;  ///< -1 if x is minus the coordinate along the given axis
};

/// Candidate for the depth of the nearest point, one choice of S and T: depth z + sum side[i] x[i].
template <class Number, int Sides>
struct DepthRoot {
    Number depth, side[Sides];
    Number code;  ///< region of the sides whose slopes are in S and T
};

/// A frustum prepared for distances.  `Number` is Lanes or FloatLanes, with every lane the same, or long
/// double where a product might leave the range of double.
template <class Number, int Sides>
struct DistanceFrame {
    static constexpr int kDimension = Sides + 1;
    static constexpr int kMaxRoots = Sides == 2 ? 16 : 4;
    Number origin[kDimension];
    Rows<Number, kDimension> axes;    ///< literal, but negated where the window was mirrored
    Rows<Number, kDimension> dual;    ///< world to frustum coordinates
    Rows<Number, kDimension> defect;  ///< Gram matrix of the axes minus the identity
    FrustumSide<Number> side[Sides];
    Number view;                                ///< near, scaled to [1, 2)
    Number near, far;                           ///< [m]
    DepthRoot<Number, Sides> roots[kMaxRoots];  ///< T fastest, then S
    Number relative_error;                      ///< of a distance; see kLowerError for the rest
    int refinements = 0;  ///< projections needed after the first, see `distance_to_frustum`
};

template <class Number, int Sides>
DistanceFrame<Number, Sides> distance_frame(const View<Sides>& view);

/// Whether products and ratios of these numbers are in the range of double.
template <int Sides>
bool is_ordinary(const View<Sides>& view);

/// call(Windows<...>{}) for the windows of a frame.  Two centred windows are worth a kernel, one is not.
template <class Number, class Call>
auto with_windows(const DistanceFrame<Number, 1>& frame, Call call) {
    const Window window = frame.side[0].window;
    if (window == Window::centred) return call(Windows<Window::centred>{});
    if (window == Window::around) return call(Windows<Window::around>{});
    return call(Windows<Window::beyond>{});
}
template <class Number, class Call>
auto with_windows(const DistanceFrame<Number, 2>& frame, Call call) {
    const Window left = frame.side[0].window, up = frame.side[1].window;
    if (left == Window::beyond && up == Window::beyond)
        return call(Windows<Window::beyond, Window::beyond>{});
    if (left == Window::beyond) return call(Windows<Window::beyond, Window::around>{});
    if (up == Window::beyond) return call(Windows<Window::around, Window::beyond>{});
    if (left == Window::around) return call(Windows<Window::around, Window::around>{});
    return call(Windows<Window::centred, Window::centred>{});
}

/// Frustum coordinates of a point, or of four: `Number` is long double or Lanes.
template <class Number, int Sides>
struct Coordinates {
    Number at[Sides + 1];  ///< along L, (U,) D
};

template <class Number, int Sides>
GEOMSRV_INLINE Coordinates<Number, Sides> to_frustum(const DistanceFrame<Number, Sides>& frame,
                                                     const Number (&point)[Sides + 1]) {
    Number x[Sides + 1];
    for (int k = 0; k <= Sides; ++k) x[k] = point[k] - frame.origin[k];
    Coordinates<Number, Sides> found;
    for (int i = 0; i <= Sides; ++i) {
        Number sum = frame.dual.row[i][0] * x[0];
        for (int k = 1; k <= Sides; ++k) sum = sum + frame.dual.row[i][k] * x[k];
        found.at[i] = sum;
    }
    return found;
}

template <class Number, int Sides>
struct Projection {
    Coordinates<Number, Sides> nearest;
    Number region;  ///< FrustumRegion, a small whole number
};

/// Nearest point of the frustum in the metric in which L, U, D are orthonormal.  On the border of regions the
/// feature of least dimension is named: the smallest one that holds the nearest point.
template <class Kinds, class Number, int Sides>
GEOMSRV_INLINE Projection<Number, Sides> project(const DistanceFrame<Number, Sides>& frame,
                                                 const Coordinates<Number, Sides>& p) {
    const Number z = p.at[Sides], near = frame.near, far = frame.far, none = 0.0;
    Number x[Sides];
    for (int i = 0; i < Sides; ++i) x[i] = Kinds::kKind[i] == Window::centred ? magnitude(p.at[i]) : p.at[i];
    Number root = z;
    unrolled<Kinds::kMin>([&](auto s) __attribute__((always_inline)) {
        Number lowest = z;  // S and T empty
        unrolled<Kinds::kMax>([&](auto t) __attribute__((always_inline)) {
            if constexpr (s + t > 0) {
                const auto& candidate = frame.roots[s * Kinds::kMax + t];
                Number r = candidate.depth * z;
                for (int i = 0; i < Sides; ++i) r = r + candidate.side[i] * x[i];
                lowest = t == 0 ? r : lesser(lowest, r);
            }
        });
        root = s == 0 ? lowest : greater(root, lowest);
    });
    Projection<Number, Sides> found;
    const Number depth = lesser(greater(root, near), far);
    found.nearest.at[Sides] = depth;
    found.region = select(root <= near, Number(9.0), select(far <= root, Number(18.0), none));
    for (int i = 0; i < Sides; ++i) {
        const FrustumSide<Number>& side = frame.side[i];
        const Number high = side.high_slope * depth;
        const Number low = Kinds::kKind[i] == Window::centred ? -high : side.low_slope * depth;
        const Number beyond_high = select(high <= p.at[i], side.high_code, none);
        found.nearest.at[i] = lesser(greater(p.at[i], low), high);
        found.region = found.region + select(p.at[i] <= low, side.low_code, beyond_high);
    }
    return found;
}

/// bool for a number, LaneMask for Lanes.
template <class Number>
using Mask = decltype(Number() < Number());

/// What is found for one point or four.
template <class Number, int Sides>
struct NearestPoint {
    Number distance, lower, upper, region;
    Coordinates<Number, Sides> offset;  ///< point minus its nearest point, in frustum coordinates
    Mask<Number> inside;                ///< in the closed frustum
    Mask<Number> in_range;  ///< nothing overflowed, underflowed, or was lost to rounding altogether
};

// Errors of a distance, in units u of roundoff.  c is the point in frustum coordinates, |c| its length, at
// most the reach |c_0| + |c_1| + |c_2|; d is the distance.
//
// 1. Coordinates: 13 u sum |dual| |P - E| each (9 dual basis, 1 difference, 1 product, 2 sums), as a vector
//    at most 13 sqrt(3) 1.04 u |c| <= 23.4 u |c|.
// 2. Depth.  A root (z + sum k x) / (1 + sum k^2) is off by at most 11 u times the magnitudes of its terms
//    (8 coefficients, 1 product, 2 sums), and moving c by 11 u |c| along the gradient undoes that.  The depth
//    found is the max over S of the min over T of such roots, hence the exact one for some c' near c: where
//    the slopes active at that depth are those of S and T, that move does it; where one becomes inactive on
//    the way, its coordinate stays at the border and the others go on.  Each side coordinate moves by at most
//    11 u |c|, and so do the others together: |c' - c| <= 11 sqrt(3) u |c| <= 19.1 u |c|.  Projection does
//    not expand, so the point found at that depth is within 2 * 19.1 u |c| of the nearest one.
// 3. Its side coordinates are rounded by 2 u each (slope, product), at most 2 u (|c| + d).
// 4. Differences, squares, sum, root: 4 u d.
//
// The point found is a point of the frustum but for 3, so above only 1, 3 and 4 count: 26 u |c| + 6 u d;
// below all of them: 64 u |c| + 6 u d.  Axes off orthonormal enlarge 2 and 3 by 1.05 and 4 by 1 u.  Rounded
// up for second-order terms and the rounding of the bounds.
inline constexpr double kUpperError = 32.0 * kUnitRoundoff;
inline constexpr double kLowerError = 72.0 * kUnitRoundoff;
inline constexpr double kDistanceError = 8.0 * kUnitRoundoff;

// A point is proven inside if its room exceeds the error of the room times the reach: 14 u in each coordinate
// and 2 u in the products, so 16 u (|k| + 1) before scaling by 1 / (|k| + 1), which adds 3 u.
inline constexpr double kRoomError = 20.0 * kUnitRoundoff;

// Squares of lengths in this range are accurate: no term overflowed, and one that underflowed does not count.
inline constexpr double kMinSquare = 0x1p-900;
inline constexpr double kMaxSquare = 0x1p1000;
inline constexpr float kMinFloatSquare = 0x1p-90F;
inline constexpr float kMaxFloatSquare = 0x1p120F;

/// An error that is counted in units of roundoff, and the range of squares, for a kind of number.
///
/// In single precision every count above is met with much to spare: the numbers of a frame and the point
/// relative to the apex are rounded once each from double, so coordinates are off by 5 u (not 13) and roots
/// by 4 u (not 11) of their terms; near and far, which are not exact there, by 1 u (|c| + d).
template <class Number>
struct Precision {
    static constexpr auto error(double counted) { return counted; }
    static constexpr auto kMin = kMinSquare, kMax = kMaxSquare;
};
template <>
struct Precision<FloatLanes> {
    static constexpr float error(double counted) { return static_cast<float>(counted * 0x1p29); }
    static constexpr auto kMin = kMinFloatSquare, kMax = kMaxFloatSquare;
};

/// Distance of p from its nearest point, and the interval that is proven to hold the exact value.
template <class Kinds, bool Skewed, class Number, int Sides>
GEOMSRV_INLINE NearestPoint<Number, Sides> measure(const DistanceFrame<Number, Sides>& frame,
                                                   const Coordinates<Number, Sides>& p,
                                                   const Coordinates<Number, Sides>& offset,
                                                   const Number& region) {
    using P = Precision<Number>;
    const Number z = p.at[Sides], none = 0.0;
    Number square = none;
    for (int i = 0; i <= Sides; ++i) {
        Number image = offset.at[i];
        if constexpr (Skewed) {
            for (int k = 0; k <= Sides; ++k) image = image + frame.defect.row[i][k] * offset.at[k];
        }
        square = i == 0 ? offset.at[i] * image : square + offset.at[i] * image;
    }
    // How far inside: the least scaled distance from the planes.  Sides compare rounded products; rounding is
    // monotonic, so a point of the closed frustum is never taken for outside.
    Number room = lesser(z - frame.near, frame.far - z);
    Number reach = magnitude(z);
    for (int i = 0; i < Sides; ++i) {
        const FrustumSide<Number>& side = frame.side[i];
        const Number size = magnitude(p.at[i]);
        reach = reach + size;
        if (Kinds::kKind[i] == Window::centred) {
            room = lesser(room, (side.high * z - frame.view * size) * side.high_room);
        } else {
            const Number x = frame.view * p.at[i];
            room = lesser(room, (x - side.low * z) * side.low_room);
            room = lesser(room, (side.high * z - x) * side.high_room);
        }
    }
    const Mask<Number> inside = none <= room;
    const Number distance = select(inside, none, square_root(square));
    const Number slack = distance * frame.relative_error;
    const Number lower = greater(distance - (reach * Number(P::error(kLowerError)) + slack), none);
    const Number upper = select(reach * Number(P::error(kRoomError)) < room, none,
                                distance + (reach * Number(P::error(kUpperError)) + slack));
    const Number square_if_outside = select(inside, Number(1.0), square);
    const Mask<Number> in_range = (Number(P::kMin) < square_if_outside) &
                                  (square_if_outside < Number(P::kMax)) & ((none < region) | inside);
    return {distance, lower, upper, select(distance <= none, none, region), offset, inside, in_range};
}

/// The whole query.  `Skewed` is for axes that are off orthonormal by more than rounding: the literal frustum
/// is then an orthogonal one in frustum coordinates c, but lengths are those of the Gram matrix I + defect.
/// Its nearest point y is the fixed point of
///
///     y  ->  orthogonal projection of  c + defect (c - y),
///
/// since the gradient of the squared distance, (I + defect) (c - y), has to be normal to the frustum at y.
/// Projections do not expand, so each step brings y nearer by a factor of at most |defect| <= 0.03.
template <class Kinds, bool Skewed, class Number, int Sides>
GEOMSRV_INLINE NearestPoint<Number, Sides> distance_to_frustum(const DistanceFrame<Number, Sides>& frame,
                                                               const Number (&point)[Sides + 1]) {
    const auto p = to_frustum(frame, point);
    auto projection = project<Kinds>(frame, p);
    Coordinates<Number, Sides> offset;
    for (int i = 0; i <= Sides; ++i) offset.at[i] = p.at[i] - projection.nearest.at[i];
    if constexpr (Skewed) {
        for (int step = 0; step < frame.refinements; ++step) {
            auto shifted = p;
            for (int i = 0; i <= Sides; ++i) {
                for (int k = 0; k <= Sides; ++k) {
                    shifted.at[i] = shifted.at[i] + frame.defect.row[i][k] * offset.at[k];
                }
            }
            projection = project<Kinds>(frame, shifted);
            for (int i = 0; i <= Sides; ++i) offset.at[i] = p.at[i] - projection.nearest.at[i];
        }
    }
    return measure<Kinds, Skewed>(frame, p, offset, projection.region);
}

/// Nearest point in the world frame.
template <class Number, int Sides>
GEOMSRV_INLINE Coordinates<Number, Sides> nearest_in_world(const DistanceFrame<Number, Sides>& frame,
                                                           const Number (&point)[Sides + 1],
                                                           const NearestPoint<Number, Sides>& found) {
    Coordinates<Number, Sides> nearest;
    for (int k = 0; k <= Sides; ++k) {
        Number shift = found.offset.at[0] * frame.axes.row[0][k];
        for (int i = 1; i <= Sides; ++i) shift = shift + found.offset.at[i] * frame.axes.row[i][k];
        nearest.at[k] = select(found.inside, point[k], point[k] - shift);
    }
    return nearest;
}

/// What is asked for one point.
template <int Sides>
struct PointDistance {
    double distance, lower, upper;  ///< [m]; 0 in the closed frustum
    std::uint8_t region;            ///< FrustumRegion
    double nearest[Sides + 1];      ///< world frame [m]
};

/// The same in long double, for numbers that are out of range.
template <int Sides>
PointDistance<Sides> distance_in_long_double(const DistanceFrame<long double, Sides>& frame,
                                             const double* point);

}  // namespace geomsrv
