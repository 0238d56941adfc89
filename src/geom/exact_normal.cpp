// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
#include "geom/exact_normal.hpp"

#include <optional>

namespace geomsrv {

namespace {

using Vector = VectorOf<Exact>;

bool is_zero(const Vector& v) { return v.x.sign() == 0 && v.y.sign() == 0 && v.z.sign() == 0; }

/// Point of contact and the vertices of K as seen from it, all times a number > 0.
class Origin {
public:
    Origin(const ExactRay& ray, RayEnd end, bool at_start) : ray_(ray), at_start_(at_start) {
        if (!at_start) {
            Exact numerator;
            ray.time(end, numerator, denominator_);
            point_ = numerator * ray.ray<Exact>();
        }
    }

    [[nodiscard]] Vector arm(VertexPair pair) const {
        const Vector v = ray_.corner<Exact>(pair);
        return at_start_ ? v : denominator_ * v - point_;
    }

private:
    const ExactRay& ray_;
    bool at_start_;
    Exact denominator_;
    Vector point_;
};

/// d less what it loses on arms that bound it: perpendicular to them, in their span with d; nothing unless
/// all of them hold it back.
std::optional<Vector> without(const Vector& d, const Vector& g) {
    const Exact along = dot(d, g);
    if (along.sign() >= 0) {
        return {};
    }
    return dot(g, g) * d - along * g;
}

std::optional<Vector> without(const Vector& d, const Vector& g, const Vector& h) {
    const Exact dg = dot(d, g);
    const Exact dh = dot(d, h);
    const Exact gh = dot(g, h);
    if ((dh * gh - dg * dot(h, h)).sign() <= 0 || (dg * gh - dh * dot(g, g)).sign() <= 0) {
        return {};
    }
    const Vector n = cross(g, h);
    const int side = dot(n, d).sign();
    if (side == 0) {
        return {};  // d is in their span: nothing is left of it
    }
    return side < 0 ? -n : n;
}

/// The direction nearest to d along which no arm is below 0; nothing if that is 0.
std::optional<Vector> nearest_direction(ExactRay& ray, const Origin& origin, VertexPair start,
                                        const Vector& d) {
    if (is_zero(d)) {
        return {};
    }
    Vector n = d;
    Vector active[3];
    int count = 0;
    while (true) {
        const VertexPair low = ray.lowest_along(n, start);
        const Vector arm = origin.arm(low);
        if (dot(n, arm).sign() >= 0) {
            return n;
        }
        active[count++] = arm;
        const auto fits = [&](const std::optional<Vector>& candidate) {
            bool good = candidate && !is_zero(*candidate);
            for (int i = 0; good && i < count; ++i) {
                good = dot(*candidate, active[i]).sign() >= 0;
            }
            return good;
        };
        std::optional<Vector> next;
        Vector kept[3];
        int kept_count = 0;
        // The newest arm holds d back for certain.
        const int last = count - 1;
        if (const auto one = without(d, active[last]); fits(one)) {
            next = one;
            kept[kept_count++] = active[last];
        }
        for (int i = 0; i < last && !next; ++i) {
            if (const auto two = without(d, active[i], active[last]); fits(two)) {
                next = two;
                kept[kept_count++] = active[i];
                kept[kept_count++] = active[last];
            }
        }
        if (!next) {
            return {};
        }
        n = *next;
        count = kept_count;
        for (int i = 0; i < count; ++i) {
            active[i] = kept[i];
        }
    }
}

/// Mean of the vertices times their number.
Vector sum_of(const ExactBody& body) {
    Vector sum = exactly<Exact>({});
    for (int i = 0; i < body.count(); ++i) {
        sum = sum + vertex_times_denominator<Exact>(body, i);
    }
    return sum;
}

}  // namespace

VectorOf<Exact> contact_normal(ExactRay& ray, RayEnd end, bool at_start) {
    if (ray.inside() && ray.pierces(end)) {
        return ray.direction<Exact>(end);
    }
    const Origin origin(ray, end, at_start);
    const VertexPair start = ray.feature(end).corner[0];
    const Vector approach = ray.ray<Exact>();
    for (const Vector& d :
         {ray.at_rest() ? exactly<Exact>({}) : approach, ray.at_rest() ? exactly<Exact>({}) : -approach,
          Exact(ray.a().exact.count()) * sum_of(ray.b().exact) -
              Exact(ray.b().exact.count()) * sum_of(ray.a().exact)}) {
        if (const std::optional<Vector> n = nearest_direction(ray, origin, start, d)) {
            return *n;
        }
    }
    return ray.support<Exact>(end);
}

}  // namespace geomsrv
