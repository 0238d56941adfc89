// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
#include "geom/gjk.hpp"

#include <algorithm>
#include <cmath>
#include <type_traits>

#include "geom/double_double.hpp"

namespace geomsrv {

namespace {

// Every step either shortens the vector or ends the loop, so there is no cycle; a few dozen steps are enough
// for hulls of thousands of vertices, and what needs more than this is stuck in rounding.
constexpr int kMaxSteps = 100;

// Below this times the size, the two points are one as far as the rounding of their vertices can tell.
constexpr double kContact = 8 * kUnitRoundoff;

/// What differs between the arithmetics.
template <class T>
struct Arithmetic;

template <>
struct Arithmetic<float> {
    using Vec = Float3;
    using Wider = double;
    // As of doubles, in units of 2^-24.
    static constexpr double kSideError = 128 * kUnitRoundoff * SingleCore::kCoarseness;
    static Vec from(Vec3 v) { return rounded_to_single(v); }
    static Vec3 to_vec3(Vec v) { return widened(v); }
    static double to_double(float x) { return x; }
    static Vec difference(Vec3 b, Vec3 a) { return rounded_to_single(b - a); }
    static float root(float x) { return std::sqrt(x); }
    static double absolute(float x) { return std::abs(x); }
    // Of the smallest squares it would overflow; then any large number will do, since weights are normalised
    // and lengths proven afterwards.
    static float reciprocal(float x) { return std::min(1.0F / x, std::numeric_limits<float>::max()); }
};

template <>
struct Arithmetic<double> {
    using Vec = Vec3;
    using Wider = DoubleDouble;
    // Side of the origin with respect to a face: 3 differences of length <= 2 S multiplied, with at most 16
    // roundings.
    static constexpr double kSideError = 128 * kUnitRoundoff;
    static Vec from(Vec3 v) { return v; }
    static Vec3 to_vec3(Vec v) { return v; }
    static double to_double(double x) { return x; }
    static Vec difference(Vec3 b, Vec3 a) { return b - a; }
    static double root(double x) { return std::sqrt(x); }
    static double absolute(double x) { return std::abs(x); }
    static double reciprocal(double x) { return 1.0 / x; }
};

template <>
struct Arithmetic<DoubleDouble> {
    using Vec = WideVec3;
    // The same with the roundings of double-double.
    static constexpr double kSideError = 128 * kWideRoundoff;
    static Vec from(Vec3 v) { return widen(v); }
    static Vec3 to_vec3(Vec v) { return narrow(v); }
    static double to_double(DoubleDouble x) { return x.hi; }
    static Vec difference(Vec3 b, Vec3 a) { return exact_difference(b, a); }
    static DoubleDouble root(DoubleDouble x) { return sqrt(x); }
    static double absolute(DoubleDouble x) { return std::abs(x.hi); }
    static DoubleDouble reciprocal(DoubleDouble x) { return DoubleDouble{1.0, 0.0} / x; }
};

/// A vertex of K: w = b - a.
template <class T>
struct Vertex {
    int index_a = 0;
    int index_b = 0;
    Vec3 a;
    Vec3 b;
    typename Arithmetic<T>::Vec w;
};

template <class T>
struct Simplex {
    int count = 0;
    Vertex<T> vertex[4];
    T weight[4];  ///< of the point nearest to the origin
};

/// Point nearest to the origin on one vertex, edge or face of a simplex, by its weights there.
template <class T>
struct Nearest {
    int count = 0;
    int keep[3] = {};  ///< vertices that span the feature
    T weight[3] = {};
    typename Arithmetic<T>::Vec direction;  ///< from the origin to K, perpendicular to the feature
    T squared = {};                         ///< squared distance
};

template <class T>
class Solver {
    using Number = Arithmetic<T>;
    using Vec = typename Number::Vec;

public:
    Solver(const Simplex<T>& simplex, double size) : simplex_(simplex), size_(size) {}

    /// Nearest point of the whole simplex; count 4 and weights of all its vertices where it holds the origin.
    struct Answer {
        bool enclosed = false;
        double margin = std::numeric_limits<double>::infinity();
        T inside[4] = {};
        Nearest<T> nearest;
    };
    Answer solve() const {
        switch (simplex_.count) {
            case 1:
                return from(point(0));
            case 2:
                return from(edge(0, 1));
            case 3:
                return from(face(0, 1, 2));
            default:
                return solid();
        }
    }

private:
    Vec w(int i) const { return simplex_.vertex[i].w; }

    static Answer from(const Nearest<T>& nearest) {
        Answer out;
        out.nearest = nearest;
        return out;
    }

    Nearest<T> point(int i) const {
        Nearest<T> out;
        out.count = 1;
        out.keep[0] = i;
        out.weight[0] = T{1.0};
        out.direction = w(i);
        out.squared = dot(w(i), w(i));
        return out;
    }

    Nearest<T> edge(int i, int j) const {
        const Vec e = w(j) - w(i);
        const T squared = dot(e, e);
        const T along = -dot(w(i), e);
        if (!(along > T{0.0})) {
            return point(i);
        }
        if (!(along < squared)) {
            return point(j);
        }
        Nearest<T> out;
        out.count = 2;
        out.keep[0] = i;
        out.keep[1] = j;
        const T inverse = Number::reciprocal(squared);
        out.weight[1] = along * inverse;
        out.weight[0] = (squared - along) * inverse;
        // From the nearer end; then take out what rounding has left along the edge, or a short vector would
        // lean.
        const bool near_i = out.weight[1] < T{0.5};
        out.direction = near_i ? w(i) + out.weight[1] * e : w(j) - out.weight[0] * e;
        out.direction = out.direction - (dot(out.direction, e) * inverse) * e;
        out.squared = dot(out.direction, out.direction);
        return out;
    }

    Nearest<T> face(int i, int j, int k) const {
        const Vec e = w(j) - w(i);
        const Vec f = w(k) - w(i);
        const Vec n = cross(e, f);
        const T squared = dot(n, n);
        // Weights times |n|^2 of the foot of the perpendicular; relative to a vertex, so that a far origin
        // costs little.
        const Vec q = -w(i);
        const T at_j = dot(cross(q, f), n);
        const T at_k = dot(cross(e, q), n);
        const T at_i = squared - at_j - at_k;
        if (squared > T{0.0} && at_i > T{0.0} && at_j > T{0.0} && at_k > T{0.0}) {
            Nearest<T> out;
            out.count = 3;
            out.keep[0] = i;
            out.keep[1] = j;
            out.keep[2] = k;
            const T inverse = Number::reciprocal(squared);
            out.weight[0] = at_i * inverse;
            out.weight[1] = at_j * inverse;
            out.weight[2] = at_k * inverse;
            const T height = dot(n, w(i));
            out.direction = height < T{0.0} ? -n : n;
            out.squared = height * height * inverse;
            return out;
        }
        // The nearest point is on an edge that the foot lies beyond; on a face without area, on any of them.
        Nearest<T> best;
        const bool any = !(squared > T{0.0});
        if (any || !(at_i > T{0.0})) {
            best = nearer(best, edge(j, k));
        }
        if (any || !(at_j > T{0.0})) {
            best = nearer(best, edge(i, k));
        }
        if (any || !(at_k > T{0.0})) {
            best = nearer(best, edge(i, j));
        }
        return best;
    }

    Answer solid() const {
        constexpr int kFaces[4][4] = {
            {0, 1, 2, 3}, {0, 1, 3, 2}, {0, 2, 3, 1}, {1, 2, 3, 0}};  // face, opposite vertex
        const double doubt = Number::kSideError * size_ * size_ * size_;
        Answer out;
        out.enclosed = true;
        for (const auto& f : kFaces) {
            const Vec n = cross(w(f[1]) - w(f[0]), w(f[2]) - w(f[0]));
            const T opposite = dot(n, w(f[3]) - w(f[0]));
            const T origin = -dot(n, w(f[0]));
            const double margin = std::min(Number::absolute(origin), Number::absolute(opposite)) - doubt;
            const bool inside = (origin > T{0.0}) == (opposite > T{0.0}) && margin > 0.0;
            if (inside) {
                out.margin = std::min(out.margin, margin);
                out.inside[f[3]] = origin / opposite;
                continue;
            }
            out.enclosed = false;
            out.nearest = nearer(out.nearest, face(f[0], f[1], f[2]));
        }
        return out;
    }

    static Nearest<T> nearer(const Nearest<T>& best, const Nearest<T>& other) {
        return best.count == 0 || other.squared < best.squared ? other : best;
    }

    const Simplex<T>& simplex_;
    double size_;
};

/// Keeps the vertices of the feature, in order.
template <class T>
void reduce(Simplex<T>& simplex, const Nearest<T>& nearest) {
    simplex.count = nearest.count;
    for (int i = 0; i < nearest.count; ++i) {
        simplex.weight[i] = nearest.weight[i];
        if (nearest.keep[i] != i) {
            simplex.vertex[i] = simplex.vertex[nearest.keep[i]];
        }
    }
}

template <class T>
bool holds(const Simplex<T>& simplex, int index_a, int index_b) {
    for (int i = 0; i < simplex.count; ++i) {
        if (simplex.vertex[i].index_a == index_a && simplex.vertex[i].index_b == index_b) {
            return true;
        }
    }
    return false;
}

/// Sets the witness points to those of the weights, normalised in doubles so that they sum to 1.
template <class T>
void set_points(Gjk& out, const Simplex<T>& simplex) {
    double sum = 0.0;
    for (int i = 0; i < simplex.count; ++i) {
        sum += Arithmetic<T>::to_double(simplex.weight[i]);
    }
    out.witness.count = simplex.count;
    out.point_a = {};
    out.point_b = {};
    for (int i = 0; i < simplex.count; ++i) {
        const Vertex<T>& v = simplex.vertex[i];
        const double weight = simplex.count == 1 ? 1.0 : Arithmetic<T>::to_double(simplex.weight[i]) / sum;
        out.witness.a[i] = v.index_a;
        out.witness.b[i] = v.index_b;
        out.witness.weight[i] = weight;
        out.point_a = out.point_a + weight * v.a;
        out.point_b = out.point_b + weight * v.b;
    }
    out.length = norm(out.point_b - out.point_a);
}

/// What is left of the vector between the witness points besides the gap.
double aside(const Gjk& found) { return norm(found.point_b - found.point_a - found.gap * found.normal); }

/// On needles and slivers, weights and direction are poor even where the length is good: once more, from the
/// same vertices, in about twice the precision.
template <class T>
void polish(Gjk& out, const Simplex<T>& simplex, double size) {
    using Number = Arithmetic<typename Arithmetic<T>::Wider>;
    Simplex<typename Arithmetic<T>::Wider> wide;
    wide.count = simplex.count;
    for (int i = 0; i < simplex.count; ++i) {
        const Vertex<T>& v = simplex.vertex[i];
        wide.vertex[i] = {v.index_a, v.index_b, v.a, v.b, Number::difference(v.b, v.a)};
    }
    const auto nearest = Solver<typename Arithmetic<T>::Wider>(wide, size).solve().nearest;
    reduce(wide, nearest);
    Gjk other = out;
    set_points(other, wide);
    const Vec3 direction = Number::to_vec3(nearest.direction);
    if (norm(direction) > 0.0) {
        other.normal = normalized(direction);
    }
    if (aside(other) < aside(out)) {
        out = other;
    }
}
void polish(Gjk&, const Simplex<DoubleDouble>&, double) {}

template <class T, class Body>
Vertex<T> vertex_at(const Body& a, const Body& b, int index_a, int index_b) {
    const Vec3 p = vertex_of(a, index_a);
    const Vec3 q = vertex_of(b, index_b);
    return {index_a, index_b, p, q, Arithmetic<T>::difference(q, p)};
}

/// The nearest point of the feature that a witness names, which may have moved since; false if it has none.
template <class T, class Body>
bool resume(const Body& a, const Body& b, const Witness& from, double size, Simplex<T>& simplex,
            Nearest<T>& nearest) {
    if (from.count < 1 || from.count > 3) {
        return false;
    }
    simplex.count = from.count;
    for (int i = 0; i < from.count; ++i) {
        simplex.vertex[i] = vertex_at<T>(a, b, from.a[i], from.b[i]);
    }
    nearest = Solver<T>(simplex, size).solve().nearest;
    if (!(dot(nearest.direction, nearest.direction) > T{0.0})) {
        simplex.count = 0;
        return false;
    }
    reduce(simplex, nearest);
    return true;
}

template <class T, class Body>
Gjk run(const Body& a, const Body& b, Vec3 start, const Witness& from) {
    using Number = Arithmetic<T>;
    // Both in units of the body's own roundoff.
    constexpr double kMet = kMeetingGap * Body::kCoarseness;
    constexpr double kOnePoint = kContact * Body::kCoarseness;
    const double size = a.reach + b.reach;
    Gjk out;
    Simplex<T> simplex;  // spans the feature of K that holds the nearest point so far
    T squared{};
    bool first = true;
    double length = std::numeric_limits<double>::infinity();
    typename Number::Vec n = Number::from(start);
    const auto approach = [&](const Nearest<T>& nearest) {
        squared = nearest.squared;
        length = Number::to_double(Number::root(squared));
        const T direction = Number::root(dot(nearest.direction, nearest.direction));
        if (!(direction > T{0.0})) {
            return false;
        }
        n = Number::reciprocal(direction) * nearest.direction;
        first = false;
        return true;
    };
    if (Nearest<T> known; resume(a, b, from, size, simplex, known)) {
        approach(known);
    }
    while (true) {
        // The vertex of K furthest against n, and with it the gap between the supports.
        const auto top = highest(a, n);
        const auto bottom = lowest(b, n);
        const double gap = Number::to_double(bottom.value - top.value);
        const bool met = length - gap <= kMet * size;
        if (gap > out.gap || met) {
            // If met, not an earlier direction that did as well: this one points from one nearest point to
            // the other.
            out.gap = gap;
            out.normal = Number::to_vec3(n);
        }
        if (met || length <= kOnePoint * size) {
            set_points(out, simplex);
            if (aside(out) > kMet * size) {
                polish(out, simplex, size);
            }
            // What counts is the length between the points, which have their own rounding.
            const bool good = out.length <= (met ? out.gap + kMet * size : 2 * kOnePoint * size);
            out.state = !good ? GjkState::stalled : met ? GjkState::apart : GjkState::contact;
            return out;
        }
        if (holds(simplex, top.vertex, bottom.vertex)) {
            break;  // nothing lies beyond, yet the bounds have not met
        }
        simplex.vertex[simplex.count++] = vertex_at<T>(a, b, top.vertex, bottom.vertex);

        const auto answer = Solver<T>(simplex, size).solve();
        if (answer.enclosed) {
            for (int i = 0; i < 4; ++i) {
                simplex.weight[i] = answer.inside[i];
            }
            set_points(out, simplex);
            out.margin = answer.margin;
            out.state = GjkState::enclosed;
            return out;
        }
        if (!(first || answer.nearest.squared < squared) || ++out.iterations > kMaxSteps) {
            --simplex.count;
            break;
        }
        reduce(simplex, answer.nearest);
        if (!approach(answer.nearest)) {
            set_points(out, simplex);
            out.state = GjkState::contact;
            return out;
        }
    }
    set_points(out, simplex);
    out.state = GjkState::stalled;
    return out;
}

}  // namespace

Vec3 first_direction(const Core& a, const Core& b) {
    const Vec3 d = b.center - a.center;
    return d.x == 0.0 && d.y == 0.0 && d.z == 0.0 ? Vec3{1.0, 0.0, 0.0} : normalized(d);
}

Vec3 first_direction(const SingleCore& a, const SingleCore& b) {
    const Float3 d = b.center - a.center;
    return d.x == 0.0F && d.y == 0.0F && d.z == 0.0F ? Vec3{1.0, 0.0, 0.0} : normalized(widened(d));
}

Gjk gjk(const Core& a, const Core& b, Vec3 start) { return run<double>(a, b, start, {}); }

Gjk gjk(const Core& a, const Core& b, Vec3 start, const Witness& from) {
    const Gjk out = run<double>(a, b, start, from);
    return out.state == GjkState::stalled ? gjk(a, b, start) : out;
}

Gjk gjk(const SingleCore& a, const SingleCore& b, Vec3 start) {
    Gjk out = run<float>(a, b, start, {});
    out.normal = normalized(out.normal);  // as doubles have it, to 4 u
    return out;
}

Gjk gjk_wide(const Core& a, const Core& b, Vec3 start) { return run<DoubleDouble>(a, b, start, {}); }

Gjk gjk_wide(const SingleCore& a, const SingleCore& b, Vec3 start) { return run<double>(a, b, start, {}); }

}  // namespace geomsrv
