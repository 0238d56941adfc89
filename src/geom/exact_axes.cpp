// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
#include "geom/exact_axes.hpp"

#include <cmath>
#include <limits>
#include <tuple>

namespace geomsrv {

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// Gap along the normalised cross product of two generators g, h at an angle with sine s, times S / s.  Of the
// stored generators 20 u (see kAxisError in facet_axes.cpp); the literal ones are off by another u each,
// which tilts the product by 2 u / s, changes its length by as much and the parts along it by u; rounded up.
constexpr double kLiteralAxisError = 32 * kUnitRoundoff;

// Below this sine doubles know nothing of the direction.
constexpr double kDoubtfulSine = 0x1p-40;

struct Generator {
    const ExactBody* body = nullptr;
    int index = 0;

    Vec3 rough;
    double length = 0.0;
    int line = 0;  ///< first generator that is literally parallel to this one

    [[nodiscard]] Vec3 axis() const { return body->axis[index]; }
};

/// A facet normal: the cross product of two generators.
struct Candidate {
    int i = 0;
    int j = 0;
    double lower = -kInfinity;
    double upper = kInfinity;
};

/// gap^2 = numerator^2 / denominator.
template <class N>
struct Gap {
    VectorOf<N> normal;  ///< not normalised, from a to b as far as that is known
    N numerator;
    N denominator;
};

class Axes {
public:
    Axes(const ExactAndRough& a, const ExactAndRough& b, bool in_range) : a_(a), b_(b), in_range_(in_range) {
        add(a);
        add(b);
    }

    ExactGap largest(bool depth) {
        Candidate candidate[15];
        int count = filtered(candidate);
        ExactGap best;
        if (in_range_) {
            count = filtered_wide(candidate, count);
        }
        int chosen = -1;
        for (int k = 0; k < count; ++k) {
            if (candidate[k].lower > 0.0) {
                chosen = k;  // they are apart
                break;
            }
            if (!depth && candidate[k].upper <= 0.0) {
                chosen = chosen < 0 ? k : chosen;  // not along this one, and more is not asked
                continue;
            }
            ExactGap other;
            if (!measure(candidate[k], other)) {
                continue;
            }
            // Of two numbers, the larger has the larger roundings, unless they are the same.
            const auto order = [](const Rounding& x) { return std::tuple(x.lower, x.upper, x.nearest); };
            if (chosen < 0 || order(best.gap) < order(other.gap)) {
                best = other;
                chosen = k;
            }
        }
        best.found = chosen >= 0 && has_inside(candidate[chosen]);
        best.meet = best.found && candidate[chosen].lower <= 0.0 && best.gap.upper <= 0.0;
        best.rung = rung_;
        return best;
    }

private:
    void add(const ExactAndRough& body) {
        for (int i = 0; i < body.exact.generators; ++i) {
            const double length = norm(body.rough.generator[i]);
            if (body.exact.half[i] == 0.0 || is_zero(body.exact.axis[i])) {
                continue;
            }
            Generator& g = generator_[count_];
            g = {&body.exact, i, body.rough.generator[i], length, count_};
            for (int k = count_ - 1; k >= 0; --k) {
                g.line = same_line(generator_[k].axis(), g.axis()) ? k : g.line;
            }
            ++count_;
        }
    }

    /// The pairs of lines that may span the facet with the largest gap.
    int filtered(Candidate* out) const {
        const Vec3 middle = b_.rough.center - a_.rough.center;
        const double error = a_.rough.error + b_.rough.error;
        double size = norm(middle);
        for (int k = 0; k < count_; ++k) {
            size += generator_[k].length;
        }
        int count = 0;
        double most = -kInfinity;
        for (int i = 0; i < count_; ++i) {
            for (int j = i + 1; j < count_; ++j) {
                if (generator_[i].line != i || generator_[j].line != j) {
                    continue;
                }
                Candidate& c = out[count++];
                c = {i, j};
                const Vec3 n = cross(generator_[i].rough, generator_[j].rough);
                const double area = norm(n);
                const double product = generator_[i].length * generator_[j].length;
                if (!(area > kDoubtfulSine * product)) {
                    continue;
                }
                double gap = std::abs(dot(middle, n));
                for (int k = 0; k < count_; ++k) {
                    if (generator_[k].line != i && generator_[k].line != j) {
                        gap -= std::abs(dot(generator_[k].rough, n));
                    }
                }
                gap /= area;
                const double doubt = kLiteralAxisError * size * (product / area) + error;
                c.lower = gap - doubt;
                c.upper = gap + doubt;
                most = std::max(most, c.lower);
            }
        }
        return keep(out, count, most);
    }

    /// The same in double-double, where more than one is left or the sign is open.
    int filtered_wide(Candidate* c, int count) {
        if (count == 1 && c->upper < 0.0) {
            return count;
        }
        rung_ = std::max(rung_, Rung::wide);
        double most = -kInfinity;
        for (int k = 0; k < count; ++k) {
            const Gap<Enclosed> gap = gap_along<Enclosed>(c[k]);
            const Enclosed quotient = gap.numerator / root_of(gap.denominator);
            const int sign = sign_of(gap.numerator);
            if (!(quotient.error < kInfinity)) {
                continue;
            }
            // Rounded outwards; of a number that is known to be zero nothing is left to round.
            c[k].lower = sign == 0
                             ? 0.0
                             : next_down(quotient.value.hi -
                                         (kUnitRoundoff * std::abs(quotient.value.hi) + quotient.error));
            c[k].upper = sign == 0 ? 0.0
                                   : next_up(quotient.value.hi +
                                             (kUnitRoundoff * std::abs(quotient.value.hi) + quotient.error));
            most = std::max(most, c[k].lower);
        }
        return keep(c, count, most);
    }

    /// Drops what is below `most`.
    static int keep(Candidate* c, int count, double most) {
        int kept = 0;
        for (int k = 0; k < count; ++k) {
            if (c[k].upper >= most) {
                c[kept++] = c[k];
            }
        }
        return kept;
    }

    template <class N>
    [[nodiscard]] VectorOf<N> generator(int k) const {
        return generator_of<N>(*generator_[k].body, generator_[k].index);
    }

    template <class N>
    [[nodiscard]] Gap<N> gap_along(const Candidate& c) const {
        Gap<N> out;
        out.normal = cross(generator<N>(c.i), generator<N>(c.j));
        const VectorOf<N> middle = exactly<N>(b_.exact.center) - exactly<N>(a_.exact.center);
        const N along = dot(middle, out.normal);
        if (sign_of(along) < 0) {
            out.normal = -out.normal;
        }
        out.numerator = magnitude(along);
        for (int k = 0; k < count_; ++k) {
            if (generator_[k].line != c.i && generator_[k].line != c.j) {
                out.numerator = out.numerator - magnitude(dot(generator<N>(k), out.normal));
            }
        }
        out.denominator = dot(out.normal, out.normal);
        return out;
    }

    /// False if the two generators are parallel after all.
    bool measure(const Candidate& c, ExactGap& out) {
        if (in_range_) {
            const Gap<Enclosed> gap = gap_along<Enclosed>(c);
            if (direction_of(gap.normal, out.normal) && round_signed(gap, out.gap)) {
                rung_ = std::max(rung_, Rung::wide);
                out.normal = normalized(out.normal);
                return true;
            }
        }
        rung_ = Rung::exact;
        const Gap<Exact> gap = gap_along<Exact>(c);
        if (gap.denominator.sign() == 0) {
            return false;
        }
        out.gap = signed_rounding(gap.numerator.sign(),
                                  rounded_root(gap.numerator * gap.numerator, gap.denominator));
        out.normal = normalized(direction_of(gap.normal));
        return true;
    }

    static Rounding signed_rounding(int sign, const Rounding& x) {
        return sign < 0 ? Rounding{-x.nearest, -x.upper, -x.lower} : x;
    }

    static bool round_signed(const Gap<Enclosed>& gap, Rounding& out) {
        const int sign = sign_of(gap.numerator);
        if (sign == 0) {
            out = {};
            return true;
        }
        if (sign == kUncertain || !round_root(gap.numerator * gap.numerator, gap.denominator, out)) {
            return false;
        }
        out = signed_rounding(sign, out);
        return true;
    }

    /// Whether a third generator leaves the plane of the facet.
    bool has_inside(const Candidate& c) {
        Difference k(a_, b_, in_range_);
        for (int g = 0; g < count_; ++g) {
            if (generator_[g].line == c.i || generator_[g].line == c.j) {
                continue;
            }
            const int sign = k.sign([&](auto* out) {
                using N = NumberOf<decltype(out)>;
                out[0] = dot(generator<N>(g), cross(generator<N>(c.i), generator<N>(c.j)));
            });
            rung_ = std::max(rung_, k.rung());
            if (sign != 0) {
                return true;
            }
        }
        return false;
    }

    const ExactAndRough& a_;
    const ExactAndRough& b_;
    bool in_range_;
    Rung rung_ = Rung::filter;
    Generator generator_[6];
    int count_ = 0;
};

}  // namespace

ExactGap largest_facet_gap(const ExactAndRough& a, const ExactAndRough& b, bool in_range, bool depth) {
    return Axes(a, b, in_range).largest(depth);
}

}  // namespace geomsrv
