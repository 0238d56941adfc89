// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
#include "geom/exact_gjk.hpp"

#include <cmath>
#include <optional>
#include <stdexcept>

namespace geomsrv {

namespace {

// A vertex is lower than another along a unit direction by v . (difference); in doubles that is off by the
// error of both vertices (2 kVertexError reach, 2 core.error), by the dot product (3 u of twice the reach)
// and by the direction (6 u of twice the reach): 6 + 6 + 12 = 24, and something to spare.
constexpr double kLevelError = 32 * kUnitRoundoff;

// Directions whose largest entry is within these keep all their bits when they are normalised.
constexpr double kShortestDirection = 0x1p-400;
constexpr double kLongestDirection = 0x1p400;

// Steps in doubt-free arithmetic after a float64 guess are few; this many are never seen.
constexpr int kMostSteps = 1000;

/// Whether x > 0; `certain` is cleared if that is not known.
template <class N>
bool positive(const N& x, bool& certain) {
    const int sign = sign_of(x);
    certain = certain && sign != kUncertain;
    return sign == 1;
}

/// The point of conv(w) nearest to the origin: a subset of w with positive weights.
template <class N>
struct NearestOf {
    int count = 0;
    int keep[4] = {};
    N weight[4];  ///< times `divisor`
    N divisor;
    VectorOf<N> along;         ///< a positive multiple of v
    bool zero = false;         ///< v = 0
    N numerator, denominator;  ///< |v|^2
};

/// Weights of the foot of the origin on the affine hull of a subset; false unless all are positive.
template <class N>
class Feature {
public:
    Feature(const VectorOf<N>* w, bool& certain) : w_(w), certain_(certain) {}

    bool point(int i, NearestOf<N>& out) const {
        out.count = 1;
        out.keep[0] = i;
        out.weight[0] = N(1.0);
        out.divisor = N(1.0);
        out.along = w_[i];
        out.numerator = dot(w_[i], w_[i]);
        out.denominator = N(1.0);
        out.zero = is_zero(w_[i]);
        return true;
    }

    bool edge(int i, int j, NearestOf<N>& out) const {
        const VectorOf<N> e = w_[j] - w_[i];
        const N at_j = -dot(w_[i], e);
        const N at_i = dot(w_[j], e);
        if (!positive(at_i, certain_) || !positive(at_j, certain_)) {
            return false;
        }
        const VectorOf<N> area = cross(w_[i], e);
        out.count = 2;
        out.keep[0] = i;
        out.keep[1] = j;
        out.weight[0] = at_i;
        out.weight[1] = at_j;
        out.divisor = dot(e, e);
        out.along = at_i * w_[i] + at_j * w_[j];
        out.numerator = dot(area, area);
        out.denominator = out.divisor;
        out.zero = is_zero(area);
        return true;
    }

    bool face(int i, int j, int k, NearestOf<N>& out) const {
        const VectorOf<N> e = w_[j] - w_[i];
        const VectorOf<N> f = w_[k] - w_[i];
        const VectorOf<N> n = cross(e, f);
        const VectorOf<N> q = -w_[i];
        const N at_j = dot(cross(q, f), n);
        const N at_k = dot(cross(e, q), n);
        const N squared = dot(n, n);
        const N at_i = squared - at_j - at_k;
        if (!positive(at_i, certain_) || !positive(at_j, certain_) || !positive(at_k, certain_)) {
            return false;
        }
        const N height = dot(n, w_[i]);
        const int side = sign_of(height);
        certain_ = certain_ && side != kUncertain;
        out.count = 3;
        out.keep[0] = i;
        out.keep[1] = j;
        out.keep[2] = k;
        out.weight[0] = at_i;
        out.weight[1] = at_j;
        out.weight[2] = at_k;
        out.divisor = squared;
        out.along = side < 0 ? -n : n;
        out.numerator = height * height;
        out.denominator = squared;
        out.zero = side == 0;
        return true;
    }

    /// Only if the origin is strictly inside.
    bool solid(NearestOf<N>& out) const {
        constexpr int kFaces[4][4] = {{1, 2, 3, 0}, {0, 2, 3, 1}, {0, 1, 3, 2}, {0, 1, 2, 3}};
        for (const auto& f : kFaces) {
            const VectorOf<N> n = cross(w_[f[1]] - w_[f[0]], w_[f[2]] - w_[f[0]]);
            const N opposite = dot(n, w_[f[3]] - w_[f[0]]);
            const N origin = -dot(n, w_[f[0]]);
            const int side = sign_of(opposite);
            certain_ = certain_ && side != kUncertain;
            if (side == 0 || !positive(side < 0 ? -origin : origin, certain_)) {
                return false;
            }
            // All four determinants are the same up to their sign.
            out.weight[f[3]] = side < 0 ? -origin : origin;
            out.divisor = side < 0 ? -opposite : opposite;
        }
        out.count = 4;
        for (int i = 0; i < 4; ++i) {
            out.keep[i] = i;
        }
        out.zero = true;
        return true;
    }

private:
    bool is_zero(const VectorOf<N>& v) const {
        // A number of which the error is known to be larger than its size may be zero: that is in doubt.
        bool zero = true;
        for (const N* x : {&v.x, &v.y, &v.z}) {
            const int sign = sign_of(*x);
            if (sign == 1 || sign == -1) {
                return false;
            }
            zero = zero && sign == 0;
        }
        certain_ = certain_ && zero;
        return zero;
    }

    const VectorOf<N>* w_;
    bool& certain_;
};

/// Whether the other vertices of the simplex are not below the feature.
template <class N>
bool is_nearest(const NearestOf<N>& feature, const VectorOf<N>* w, int count, bool& certain) {
    for (int i = 0; i < count; ++i) {
        bool kept = false;
        for (int k = 0; k < feature.count; ++k) {
            kept = kept || feature.keep[k] == i;
        }
        if (kept) {
            continue;
        }
        const int sign = sign_of(dot(feature.along, w[i] - w[feature.keep[0]]));
        certain = certain && sign != kUncertain;
        if (sign < 0) {
            return false;
        }
    }
    return true;
}

/// REQUIRES for a result: all signs were certain.
template <class N>
NearestOf<N> nearest_of(const VectorOf<N>* w, int count, bool& certain) {
    NearestOf<N> out;
    const Feature<N> feature(w, certain);
    const auto good = [&](bool found) {
        return !certain || (found && (out.zero || is_nearest(out, w, count, certain)));
    };
    // Larger features first: a float64 guess keeps only vertices with positive weights.
    if (count == 4 && good(feature.solid(out))) {
        return out;
    }
    for (int i = 0; i < count; ++i) {
        for (int j = i + 1; j < count; ++j) {
            for (int k = j + 1; k < count; ++k) {
                if (good(feature.face(i, j, k, out))) {
                    return out;
                }
            }
        }
    }
    for (int i = 0; i < count; ++i) {
        for (int j = i + 1; j < count; ++j) {
            if (good(feature.edge(i, j, out))) {
                return out;
            }
        }
    }
    for (int i = 0; i < count; ++i) {
        if (good(feature.point(i, out))) {
            return out;
        }
    }
    certain = false;  // not reached in exact arithmetic
    return out;
}

/// A direction in doubles: each entry is off by at most 2 u of the largest.
Vec3 direction_of(const VectorOf<Enclosed>& v, bool& certain) {
    const Vec3 rough = {v.x.value.hi, v.y.value.hi, v.z.value.hi};
    const double size = std::max({std::fabs(rough.x), std::fabs(rough.y), std::fabs(rough.z)});
    const double error = std::max({v.x.error, v.y.error, v.z.error});
    certain =
        certain && error <= kUnitRoundoff * size && size > kShortestDirection && size < kLongestDirection;
    return rough;
}
Vec3 direction_of(const VectorOf<Exact>& v, bool&) {
    Exact size = v.x.magnitude();
    for (const Exact* other : {&v.y, &v.z}) {
        if (size < other->magnitude()) {
            size = other->magnitude();
        }
    }
    return {rounded_quotient(v.x, size).nearest, rounded_quotient(v.y, size).nearest,
            rounded_quotient(v.z, size).nearest};
}

double ratio(const Enclosed& a, const Enclosed& b) { return a.value.hi / b.value.hi; }
double ratio(const Exact& a, const Exact& b) { return rounded_quotient(a, b).nearest; }

/// |v| / weight.
bool round_length(const NearestOf<Enclosed>& found, double weight, Rounding& out) {
    return round_enclosed(root_of(found.numerator) / (root_of(found.denominator) * Enclosed(weight)), out);
}
bool round_length(const NearestOf<Exact>& found, double weight, Rounding& out) {
    out = rounded_root(found.numerator, found.denominator * Exact(weight) * Exact(weight));
    return true;
}

/// Vertices that are level with the first pair's because the simplex says so: those reached from it over
/// pairs with a vertex in common.
struct Level {
    std::uint8_t pairs;

    Level(const Witness& s) : pairs(1) {
        for (int round = 0; round < s.count; ++round) {
            for (int i = 0; i < s.count; ++i) {
                for (int k = 0; k < s.count; ++k) {
                    if ((pairs >> k & 1) != 0 && (s.a[i] == s.a[k] || s.b[i] == s.b[k])) {
                        pairs = static_cast<std::uint8_t>(pairs | 1 << i);
                    }
                }
            }
        }
    }
    [[nodiscard]] bool holds(const Witness& s, bool of_b, int vertex) const {
        for (int k = 0; k < s.count; ++k) {
            if ((pairs >> k & 1) != 0 && (of_b ? s.b[k] : s.a[k]) == vertex) {
                return true;
            }
        }
        return false;
    }
};

template <class N>
class Search {
public:
    Search(const ExactAndRough& a, const ExactAndRough& b) : a_(a), b_(b) {}

    /// Nothing if this arithmetic cannot tell.
    std::optional<ExactSeparation> from(Witness& simplex) const {
        for (int step = 0; step < kMostSteps; ++step) {
            VectorOf<N> w[4];
            for (int i = 0; i < simplex.count; ++i) {
                w[i] = difference(simplex.a[i], simplex.b[i]);
            }
            bool certain = true;
            const NearestOf<N> found = nearest_of(w, simplex.count, certain);
            if (!certain) {
                return {};
            }
            reduce(simplex, found);
            ExactSeparation out;
            out.meet = found.zero;
            out.simplex = simplex;
            if (found.zero) {
                out.normal = nan_vector();
                return out;
            }
            const Vec3 n = direction_of(found.along, certain);
            if (!certain) {
                return {};
            }
            out.normal = normalized(n);
            const Level level(simplex);
            const int below_a =
                beyond(a_, simplex.a[0], -out.normal, -found.along, level, simplex, false, certain);
            const int below_b =
                beyond(b_, simplex.b[0], out.normal, found.along, level, simplex, true, certain);
            if (!certain) {
                return {};
            }
            if (below_a < 0 && below_b < 0) {
                const double weight = a_.exact.denominator() * b_.exact.denominator();
                const bool rounds = round_length(found, weight, out.distance);
                return rounds ? std::optional(out) : std::nullopt;
            }
            simplex.a[simplex.count] = below_a < 0 ? simplex.a[0] : below_a;
            simplex.b[simplex.count] = below_b < 0 ? simplex.b[0] : below_b;
            ++simplex.count;
        }
        return {};
    }

private:
    /// (q - p) times both denominators.
    VectorOf<N> difference(int p, int q) const {
        VectorOf<N> from = vertex_times_denominator<N>(a_.exact, p);
        VectorOf<N> to = vertex_times_denominator<N>(b_.exact, q);
        if (b_.exact.denominator() != 1.0) {
            from = N(b_.exact.denominator()) * from;
        }
        if (a_.exact.denominator() != 1.0) {
            to = N(a_.exact.denominator()) * to;
        }
        return to - from;
    }

    static void reduce(Witness& simplex, const NearestOf<N>& found) {
        Witness kept;
        kept.count = found.count;
        for (int i = 0; i < found.count; ++i) {
            kept.a[i] = simplex.a[found.keep[i]];
            kept.b[i] = simplex.b[found.keep[i]];
            kept.weight[i] = ratio(found.weight[i], found.divisor);
        }
        simplex = kept;
    }

    /// The vertex lowest along n among those that are truly lower than `start`; -1 if there is none.
    int beyond(const ExactAndRough& body, int start, Vec3 n, const VectorOf<N>& along, const Level& level,
               const Witness& simplex, bool of_b, bool& certain) const {
        const Core& core = body.rough;
        const double doubt = kLevelError * core.reach + 2.0 * core.error;
        const double base = dot(n, vertex_of(core, start) - core.center);
        std::optional<VectorOf<N>> from;
        int lowest = -1;
        double depth = 0.0;
        const int count = body.exact.count();
        for (int i = 0; i < count; ++i) {
            const double height = dot(n, vertex_of(core, i) - core.center) - base;
            if (height > doubt || i == start || level.holds(simplex, of_b, i)) {
                continue;
            }
            bool below = height < -doubt;
            if (!below) {
                if (lowest >= 0) {
                    continue;  // a step is taken anyway
                }
                if (!from) {
                    from = vertex_times_denominator<N>(body.exact, start);
                }
                const int sign = sign_of(dot(along, vertex_times_denominator<N>(body.exact, i) - *from));
                if (sign == kUncertain) {
                    certain = false;
                    return -1;
                }
                below = sign < 0;
            }
            if (below && (lowest < 0 || height < depth)) {
                lowest = i;
                depth = height;
            }
        }
        return lowest;
    }

    const ExactAndRough& a_;
    const ExactAndRough& b_;
};

}  // namespace

ExactSeparation exact_separation(const ExactAndRough& a, const ExactAndRough& b, const Witness& guess,
                                 bool in_range) {
    Witness simplex = guess;
    if (simplex.count == 0) {
        simplex.count = 1;
    }
    if (in_range) {
        if (std::optional<ExactSeparation> found = Search<Enclosed>(a, b).from(simplex)) {
            found->rung = Rung::wide;
            return *found;
        }
    }
    std::optional<ExactSeparation> found = Search<Exact>(a, b).from(simplex);
    if (!found) {
        throw std::logic_error("exact_separation: every step shortens v, yet there was no last one");
    }
    found->rung = Rung::exact;
    return *found;
}

}  // namespace geomsrv
