// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
#include "geom/exact_gjk.hpp"

#include <stdexcept>

namespace geomsrv {

namespace {

// Steps in doubt-free arithmetic after a float64 guess are few; this many are never seen.
constexpr int kMostSteps = 1000;

Witness chosen(const Witness& simplex, const int* at, int count) {
    Witness out;
    out.count = count;
    for (int i = 0; i < count; ++i) {
        out.a[i] = simplex.a[at[i]];
        out.b[i] = simplex.b[at[i]];
    }
    return out;
}

class Search {
public:
    Search(const ExactAndRough& a, const ExactAndRough& b, bool in_range) : k_(a, b, in_range) {}

    ExactSeparation from(Witness simplex) {
        for (int step = 0; step < kMostSteps; ++step) {
            if (simplex.count == 4 && holds_origin(simplex)) {
                return met(simplex);
            }
            Late<Feature> found;
            find_nearest(simplex, found);
            Feature& nearest = *found;
            const Witness& s = nearest.vertices();
            const int side = nearest.side();
            if (side == 0) {
                return met(s);
            }
            const Vec3 along = nearest.direction();
            const Vec3 n = side < 0 ? -along : along;
            const auto up = [&](const auto& step_of) { return side * nearest.sign_along(step_of); };
            const auto down = [&](const auto& step_of) { return -side * nearest.sign_along(step_of); };
            const int higher_a = lower_vertex(k_, s, false, -n, down);
            const int lower_b = lower_vertex(k_, s, true, n, up);
            if (higher_a < 0 && lower_b < 0) {
                return {false, nearest.length(), n, s, k_.rung()};
            }
            simplex = s;
            simplex.a[simplex.count] = higher_a < 0 ? s.a[0] : higher_a;
            simplex.b[simplex.count] = lower_b < 0 ? s.b[0] : lower_b;
            ++simplex.count;
        }
        throw std::logic_error("exact_separation: every step shortens v, yet there was no last one");
    }

private:
    ExactSeparation met(const Witness& simplex) const { return {true, {}, nan_vector(), simplex, k_.rung()}; }

    /// Whether four vertices span a solid with the origin strictly inside; sets their weights then.
    bool holds_origin(Witness& s) {
        int sign[5];
        k_.signs<5>(
            [&](auto* out) {
                using N = NumberOf<decltype(out)>;
                const VectorOf<N> w = k_.vertex<N>(s.a[0], s.b[0]);
                const auto step = [&](int i) { return k_.step<N>(s.a[0], s.b[0], s.a[i], s.b[i]); };
                const VectorOf<N> e = step(1);
                const VectorOf<N> f = step(2);
                const VectorOf<N> g = step(3);
                const VectorOf<N> ef = cross(e, f);
                // Six times the signed volumes of the whole and of the parts between a face and the origin.
                out[4] = dot(ef, g);
                out[1] = -dot(w, cross(f, g));
                out[2] = -dot(w, cross(g, e));
                out[3] = -dot(w, ef);
                out[0] = out[4] - out[1] - out[2] - out[3];
                for (int i = 0; i < 4; ++i) {
                    s.weight[i] = ratio_of(out[i], out[4]);
                }
            },
            sign);
        return sign[4] != 0 && sign[0] == sign[4] && sign[1] == sign[4] && sign[2] == sign[4] &&
               sign[3] == sign[4];
    }

    /// The vertex, edge or face of the simplex that holds its point nearest to the origin, strictly.
    /// REQUIRES: four vertices do not hold the origin strictly inside.
    void find_nearest(const Witness& simplex, Late<Feature>& found) {
        // Larger features first: a float64 guess keeps only vertices with positive weights.
        for (int size = std::min(simplex.count, 3); size > 0; --size) {
            for (int mask = (1 << simplex.count) - 1; mask > 0; --mask) {
                int at[4];
                int count = 0;
                for (int i = 0; i < simplex.count; ++i) {
                    if ((mask >> i & 1) != 0) {
                        at[count++] = i;
                    }
                }
                if (count != size) {
                    continue;
                }
                found.emplace(k_, chosen(simplex, at, count));
                if (found->holds_foot() && nothing_below(*found, simplex, mask)) {
                    return;
                }
            }
        }
        throw std::logic_error("exact_separation: a simplex without a nearest point");
    }

    /// Whether no vertex of the simplex outside of the feature is lower along v.
    bool nothing_below(Feature& feature, const Witness& simplex, int mask) {
        const int side = feature.side();
        const Witness& s = feature.vertices();
        for (int i = 0; i < simplex.count && side != 0; ++i) {
            if ((mask >> i & 1) != 0) {
                continue;
            }
            const int sign = feature.sign_along([&](auto number) {
                return k_.step<decltype(number)>(s.a[0], s.b[0], simplex.a[i], simplex.b[i]);
            });
            if (side * sign < 0) {
                return false;
            }
        }
        return true;
    }

    Difference k_;
};

}  // namespace

ExactSeparation exact_separation(const ExactAndRough& a, const ExactAndRough& b, const Witness& guess,
                                 bool in_range) {
    Witness simplex = guess;
    if (simplex.count == 0) {
        simplex.count = 1;
    }
    return Search(a, b, in_range).from(simplex);
}

}  // namespace geomsrv
