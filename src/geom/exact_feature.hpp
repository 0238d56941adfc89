// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
// Vertices, edges and faces of the difference K = {q - p : p in a, q in b} of two polytopes, by the caller's
// numbers, and what is decided about them: each sign in Enclosed arithmetic and, where that leaves it open,
// in Exact.
#pragma once

#include <algorithm>
#include <new>
#include <type_traits>
#include <utility>

#include "geom/core.hpp"
#include "geom/enclosed.hpp"
#include "geom/exact_body.hpp"
#include "geom/separation.hpp"

namespace geomsrv {

/// A body twice: by the caller's numbers, and rounded, for filters.
struct ExactAndRough {
    const ExactBody& exact;
    const Core& rough;  ///< the same vertices in the same order, relative to any origin, in any unit
};

/// K, and how high its questions had to climb so far.  Its vertices come times both denominators.
class Difference {
public:
    /// `in_range`: the numbers are of ordinary size (Core's range), so Enclosed is worth trying.
    Difference(const ExactAndRough& a, const ExactAndRough& b, bool in_range)
        : a_(a), b_(b), in_range_(in_range) {}

    [[nodiscard]] const ExactAndRough& a() const { return a_; }
    [[nodiscard]] const ExactAndRough& b() const { return b_; }
    [[nodiscard]] double denominator_a() const { return a_.exact.denominator(); }
    [[nodiscard]] double denominator_b() const { return b_.exact.denominator(); }
    [[nodiscard]] bool in_range() const { return in_range_; }
    /// Whether every vertex of K is a short sum of products of the caller's numbers.
    [[nodiscard]] bool is_plain() const { return a_.exact.is_plain() && b_.exact.is_plain(); }
    [[nodiscard]] Rung rung() const { return rung_; }
    void climb(Rung to) { rung_ = std::max(rung_, to); }

    /// q - p.
    template <class N>
    [[nodiscard]] VectorOf<N> vertex(int p, int q) const {
        const VectorOf<N> apart = exactly<N>(b_.exact.anchor()) - exactly<N>(a_.exact.anchor());
        return scaled(denominator_a(), scaled(denominator_b(), apart)) +
               (scaled(denominator_a(), arm_times_denominator<N>(b_.exact, q)) -
                scaled(denominator_b(), arm_times_denominator<N>(a_.exact, p)));
    }

    /// From the vertex q0 - p0 to q1 - p1.
    template <class N>
    [[nodiscard]] VectorOf<N> step(int p0, int q0, int p1, int q1) const {
        if (p0 == p1) {
            return scaled(denominator_a(), step_times_denominator<N>(b_.exact, q0, q1));
        }
        const VectorOf<N> back = scaled(denominator_b(), step_times_denominator<N>(a_.exact, p1, p0));
        if (q0 == q1) {
            return back;
        }
        return scaled(denominator_a(), step_times_denominator<N>(b_.exact, q0, q1)) + back;
    }

    /// Signs of `Count` numbers; numbers(N*) computes them in the arithmetic N.
    template <int Count, class Numbers>
    void signs(const Numbers& numbers, int* out) {
        if (in_range_) {
            Enclosed wide[Count];
            numbers(wide);
            bool known = true;
            for (int i = 0; i < Count; ++i) {
                out[i] = sign_of(wide[i]);
                known = known && out[i] != kUncertain;
            }
            if (known) {
                climb(Rung::wide);
                return;
            }
        }
        climb(Rung::exact);
        Exact exact[Count];
        numbers(exact);
        for (int i = 0; i < Count; ++i) {
            out[i] = sign_of(exact[i]);
        }
    }
    template <class Numbers>
    int sign(const Numbers& numbers) {
        int out = 0;
        signs<1>(numbers, &out);
        return out;
    }

private:
    const ExactAndRough& a_;
    const ExactAndRough& b_;
    bool in_range_;
    Rung rung_ = Rung::filter;
};

/// The arithmetic in which numbers(N*) is asked to compute.
template <class Pointer>
using NumberOf = std::remove_pointer_t<Pointer>;

/// From the first vertex of a feature of K to another; nothing if it has none.
template <class N>
VectorOf<N> step_to(const Difference& k, const Witness& s, int i) {
    return i < s.count ? k.template step<N>(s.a[0], s.b[0], s.a[i], s.b[i]) : VectorOf<N>{};
}

/// One to three vertices of K, and v, the foot of the origin on the point, line or plane through them.
template <class N>
struct FeatureOf {
    int count = 0;
    VectorOf<N> w;        ///< the first vertex
    VectorOf<N> e, f;     ///< from it to the others
    VectorOf<N> along;    ///< a multiple of v; negative where a face is seen from behind
    VectorOf<N> residue;  ///< zero iff v is; of a face only x is used
    N square;             ///< of the residue
    N divisor;            ///< |v|^2 = square / divisor

    FeatureOf() {}  // NOLINT: a defaulted one would be zeroed byte by byte before it is filled
    GEOMSRV_INLINE FeatureOf(int vertices, const VectorOf<N>& first, const VectorOf<N>& second,
                             const VectorOf<N>& third)
        : count(vertices), w(first), e(second), f(third) {
        if (count == 1) {
            along = residue = w;
            square = dot(w, w);
            divisor = N(1.0);
        } else if (count == 2) {
            residue = cross(w, e);
            along = cross(e, residue);
            square = dot(residue, residue);
            divisor = dot(e, e);
        } else {
            along = cross(e, f);
            residue = {dot(along, w), N(), N()};
            square = residue.x * residue.x;
            divisor = dot(along, along);
        }
    }
    FeatureOf(const Difference& k, const Witness& s)
        : FeatureOf(s.count, k.template vertex<N>(s.a[0], s.b[0]), step_to<N>(k, s, 1), step_to<N>(k, s, 2)) {
    }

    /// Barycentric coordinates of v, times `divisor`.
    void weights(N* out) const {
        if (count == 1) {
            out[0] = divisor;
        } else if (count == 2) {
            out[1] = -dot(w, e);
            out[0] = divisor - out[1];
        } else {
            out[1] = dot(cross(f, w), along);
            out[2] = dot(cross(w, e), along);
            out[0] = divisor - out[1] - out[2];
        }
    }
};

/// In pair arithmetic.  REQUIRES: k.is_plain() and k.in_range().
void evaluate_quickly(const Difference& k, const Witness& s, FeatureOf<Enclosed>& out);

/// A std::optional that is not zeroed as a whole before it is filled, as GCC does with large ones.
template <class T>
class Late {
public:
    Late() {}  // NOLINT: leaves the value alone
    Late(const Late&) = delete;
    Late& operator=(const Late&) = delete;
    ~Late() { reset(); }

    explicit operator bool() const { return set_; }
    T& operator*() { return value_; }
    T* operator->() { return &value_; }
    template <class... Args>
    T& emplace(Args&&... args) {
        reset();
        ::new (static_cast<void*>(&value_)) T(std::forward<Args>(args)...);
        set_ = true;
        return value_;
    }

private:
    void reset() {
        if (set_) {
            value_.~T();
            set_ = false;
        }
    }

    bool set_ = false;
    union {
        T value_;  // NOLINT(readability-identifier-naming): private, though the union does not say so
    };
};

/// The same, in the arithmetic that each question needs.
class Feature {
public:
    /// `vertices`: one to three of K.
    Feature(Difference& k, const Witness& vertices) : k_(k), vertices_(vertices) {}

    [[nodiscard]] const Witness& vertices() const { return vertices_; }

    /// Whether v lies strictly within; sets the weights of `vertices` then, rounded.
    bool holds_foot();

    /// -1, 0, +1: sign of along . v, 0 where v is zero.
    int side();

    /// Sign of along . step; step(N{}) makes a step of K (times any positive number) in the arithmetic N.
    template <class Step>
    int sign_along(const Step& step) {
        return k_.sign([&](auto* out) {
            using N = NumberOf<decltype(out)>;
            out[0] = dot(in<N>().along, step(N{}));
        });
    }

    /// Unit vector along `along`; each of its parts is off by at most 2 u of the largest, and their common
    /// factor by 4 u.  REQUIRES: `along` is not zero.
    Vec3 direction();

    /// |v|.
    Rounding length();

    template <class N>
    const FeatureOf<N>& in() {
        if constexpr (std::is_same_v<N, Exact>) {
            return exact_ ? *exact_ : exact_.emplace(k_, vertices_);
        } else {
            return wide_ ? *wide_ : wide_.emplace(k_, vertices_);
        }
    }

private:
    /// Whether double-double arithmetic has the answer; the cheaper kind is asked first.
    template <class Answers>
    bool in_doubles(const Answers& answers) {
        if (!k_.in_range()) {
            return false;
        }
        if (!quick_ && k_.is_plain()) {
            evaluate_quickly(k_, vertices_, quick_.emplace());
        }
        return (quick_ && answers(*quick_)) || answers(in<Enclosed>());
    }

    Difference& k_;
    Witness vertices_;
    Late<FeatureOf<Enclosed>> quick_;
    Late<FeatureOf<Enclosed>> wide_;
    Late<FeatureOf<Exact>> exact_;
};

/// a / b, rounded; a weight of a point.
inline double ratio_of(const Enclosed& a, const Enclosed& b) { return a.value.hi / b.value.hi; }
inline double ratio_of(const Exact& a, const Exact& b) {
    return b.sign() == 0 ? 0.0 : rounded_quotient(a, b).nearest;
}

/// sqrt(numerator / denominator) in double-double, if that leaves no doubt about its rounding.
bool round_root(const Enclosed& numerator, const Enclosed& denominator, Rounding& out);

/// A vector in doubles, each part off by at most 2 u of the largest; false if its error does not allow that.
bool direction_of(const VectorOf<Enclosed>& v, Vec3& out);
Vec3 direction_of(const VectorOf<Exact>& v);

/// What is as high as the vertices of a feature along its `along`, because they are.
class Level {
public:
    Level(const Difference& k, const Witness& vertices);

    /// Whether this vertex of a body is as high as the feature's first one of that body.
    [[nodiscard]] bool has(bool of_b, int vertex) const {
        const std::int64_t* const list = of_b ? vertex_b_ : vertex_a_;
        for (int i = 0; i < count_; ++i) {
            if (list[i] == vertex) {
                return true;
            }
        }
        return false;
    }
    /// Whether edges along this axis are level.
    [[nodiscard]] bool has_axis(Vec3 axis) const;

private:
    void add_axis_between(const Difference& k, const Witness& s, int i, int j);

    int count_ = 0;
    std::int64_t vertex_a_[3] = {};
    std::int64_t vertex_b_[3] = {};
    int axes_ = 0;
    Vec3 axis_[3];
};

/// Whether one is the other or its opposite, bit for bit.
constexpr bool same_line(Vec3 a, Vec3 b) {
    return (a.x == b.x && a.y == b.y && a.z == b.z) || (a.x == -b.x && a.y == -b.y && a.z == -b.z);
}

/// Whether two vertices of a difference of zonotopes differ by this edge of one body, and nothing else.
inline bool is_edge_of(const Witness& s, bool of_b, int edge) {
    for (int i = 0; i < s.count; ++i) {
        for (int j = 0; j < i; ++j) {
            if ((s.a[i] ^ s.a[j]) == (of_b ? 0 : edge) && (s.b[i] ^ s.b[j]) == (of_b ? edge : 0)) {
                return true;
            }
        }
    }
    return false;
}

// A vertex is lower than another along a unit direction by n . (difference); in doubles that is off by the
// error of both vertices (2 kVertexError reach, 2 core.error), by the dot product (3 u of twice the reach)
// and by the direction (6 u of twice the reach): 6 + 6 + 12 = 24, and something to spare.
inline constexpr double kLevelError = 32 * kUnitRoundoff;

/// A vertex of the body that is lower than `start` along a direction, the lowest as far as doubles can tell;
/// -1 if there is none.  The direction is perpendicular to the feature s of K; `start` is a vertex of s, `n`
/// the direction in doubles (see Feature::direction), sign_along(step) the exact sign of its product with a
/// step of the body.
template <class SignAlong>
int lower_vertex(const Difference& k, const Witness& s, bool of_b, Vec3 n, const SignAlong& sign_along) {
    const ExactAndRough& body = of_b ? k.b() : k.a();
    const int start = of_b ? s.b[0] : s.a[0];
    const Core& core = body.rough;
    const double doubt = kLevelError * core.reach + 2.0 * core.error;
    if (body.exact.kind == ExactBody::Kind::zonotope) {
        // Every edge goes its own way: down.
        int lowest = start;
        int open[3];
        int count = 0;
        for (int i = 0; i < body.exact.generators; ++i) {
            const double height = 2.0 * dot(n, core.generator[i]);
            if (std::abs(height) > doubt) {
                lowest = height > 0.0 ? lowest & ~(1 << i) : lowest | 1 << i;
            } else if (body.exact.half[i] != 0.0) {
                open[count++] = i;
            }
        }
        if (lowest != start) {
            return lowest;
        }
        // What is level to rounding matters only where nothing else is lower.
        for (int j = 0; j < count && lowest == start; ++j) {
            const int flipped = start ^ 1 << open[j];
            if (is_edge_of(s, of_b, start ^ flipped) || Level(k, s).has_axis(body.exact.axis[open[j]])) {
                continue;
            }
            const int sign = sign_along([&](auto number) {
                return step_times_denominator<decltype(number)>(body.exact, start, flipped);
            });
            lowest = sign < 0 ? flipped : lowest;
        }
        return lowest == start ? -1 : lowest;
    }
    const double* const x = core.points;
    const double* const y = x + core.count;
    const double* const z = y + core.count;
    const auto height = [=](int i) { return n.x * x[i] + n.y * y[i] + n.z * z[i]; };
    const double base = height(start);
    const double level = base + doubt;
    double least = base - doubt;
    int lowest = -1;
    // Those that doubts leave open; all from `rest` on if there are more.
    constexpr int kFew = 8;
    int open[kFew];
    int opened = 0;
    const int count = body.exact.count();
    int rest = count;
    for (int i = 0; i < count; ++i) {
        const double value = height(i);
        if (!(value > level)) [[unlikely]] {
            if (value < least) {
                lowest = i;
                least = value;
            } else if (opened < kFew) {
                open[opened++] = i;
            } else {
                rest = std::min(rest, i);
            }
        }
    }
    if (lowest >= 0 || (opened == 1 && open[0] == start)) {
        return lowest;
    }
    const Level same(k, s);
    const auto is_lower = [&](int i) {
        return i != start && !same.has(of_b, i) &&
               sign_along([&](auto number) {
                   return step_times_denominator<decltype(number)>(body.exact, start, i);
               }) < 0;
    };
    for (int j = 0; j < opened; ++j) {
        if (is_lower(open[j])) {
            return open[j];
        }
    }
    for (int i = rest; i < count; ++i) {
        if (!(height(i) > level) && is_lower(i)) {
            return i;
        }
    }
    return -1;
}

}  // namespace geomsrv
