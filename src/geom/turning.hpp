// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
// When and where two convex bodies first touch that translate and turn at constant rates.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "geom/gjk.hpp"
#include "geom/placed_contact_points.hpp"
#include "geom/rung.hpp"
#include "geom/turning_place.hpp"
#include "geom/vec.hpp"

namespace geomsrv {

/// Values of geomsrv.answers.ContactStatus.
enum class TurningStatus : std::uint8_t {
    never = 0,        ///< proven apart until t_max
    will_touch = 1,   ///< proven apart until `lower`, proven in contact at some time until `upper`
    touching = 2,     ///< at t = 0 neither apart nor overlapping as far as can be told; in contact by `upper`
    overlapping = 3,  ///< proven at t = 0
    not_converged = 5,  ///< looks ran out; proven apart until `lower`
    grazing = 6,        ///< proven apart until `lower`; there, neither contact nor its absence can be proven
};

/// What else is to be told about a pair.
struct TurningSlack {
    double margin = 0.0;  ///< bodies no further apart than this are in contact [m]; radii of round bodies
    double uncertainty = 0.0;  ///< by how much the bodies may be off, added up [m]
    double drift = 0.0;        ///< by how much their velocities may be [m/s]
};

struct TurningContact {
    TurningStatus status = TurningStatus::not_converged;
    double lower = 0.0;  ///< [s]; NaN for never
    double upper = 0.0;  ///< [s]; infinite where no contact is proven
    Vec3 normal;         ///< unit, from a to b, at `lower`; NaN where there is none
    Vec3 point;  ///< between the nearest points at `lower`; of overlapping bodies a common one; or NaN
    /// If asked for, and contact is later than at t = 0, what may be shared by `upper`: a point, the ends of
    /// a segment, or a polygon's corners, counter-clockwise about the normal.  Valid until the next call.
    std::span<const Vec3> points;
    Rung rung = Rung::filter;
    int looks = 0;  ///< how often the bodies were looked at
};

/// Holds scratch memory, which grows with the largest body seen.
class TurningSolver {
public:
    /// Contact within [0, t_max], t_max >= 0 or infinite, to `tolerance` > 0 [s]; for all bodies that the
    /// slack allows.
    TurningContact solve(const TurningBody& a, const TurningBody& b, double t_max, double tolerance,
                         const TurningSlack& slack = {}, bool contact_set = false);

    /// What pieces of two larger bodies share that are apart until t, and may touch within the span after it:
    /// as `points` of `solve`, none where they stay apart.  `normal` is that of the larger bodies, or NaN.
    TurningContact share(const TurningBody& a, const TurningBody& b, double t, double span, Vec3 normal,
                         const TurningSlack& slack);

private:
    struct Side {
        TurningVertices body;
        std::vector<double> height;  ///< of the vertices along the direction looked at
        std::vector<double> rate;    ///< how fast it changes
        std::vector<double> bend;    ///< and how fast that does
    };
    struct Look;       // the bodies at one time
    struct Direction;  // along which they are apart, and how it turns

    TurningContact search(const TurningBody& a, const TurningBody& b, double t_max, double tolerance,
                          const TurningSlack& slack, bool contact_set);
    void prepare(const TurningBody& a, const TurningBody& b, const TurningSlack& slack);
    double end_of_period() const;
    Look look(double t, Vec3 start);
    void place(Look& at) const;
    double coarse_step(const Look& at, Vec3 normal) const;
    double fine_step(const Look& at, const Direction& direction, double gap_error, double longest) const;
    void measure(const Look& at, const Direction& direction);
    double wide_step(const Look& at, const Witness& feature, double longest, Direction& direction);
    Direction direction_of(const Witness& feature, Vec3 normal) const;
    bool overlap(const Look& at, Vec3 shift) const;
    bool overlap_at(double t, Vec3 start, Look& at);
    bool crossing(const Look& at, const Witness& feature, double t);
    double proven_contact(const Look& at, const Witness& feature, double step, double expected, double t_max,
                          double tolerance);
    bool unsure(double t, double tolerance) const;
    double certain_depth(const Look& at);
    double certain_contact(const Look& at, const Witness& feature, double lower, double end,
                           double tolerance);
    void find_points(const Look& at, std::span<const Vec3> normals, Vec3 middle, double near, double span,
                     TurningContact& out);
    void add_faces(const TurningBody& body, const Side& side);
    Vec3 normal_of(const Look& at, const Witness& feature, Vec3 normal) const;
    double way(double span) const;
    double vague(double t) const { return slack_.uncertainty + slack_.drift * t; }
    Vec3 in_world(Vec3 point, double t) const;

    Side a_, b_;
    bool planar_ = false;
    int exponent_ = 0;          // lengths are times 2^exponent
    WideVec3 between_, speed_;  // from the centre of a to that of b, and how fast it changes
    Vec3 velocity_;             // the same, in doubles
    TurningSlack slack_;
    int looks_ = 0;  // at this pair
    Witness seen_;   // where it was nearest when last seen apart
    Vec3 center_a_, velocity_a_;
    PlacedContactPoints contact_;
    std::vector<Vec3> points_;
    std::vector<double> prism_;  // on a planar body, with corners above and below it
    std::vector<Vec3> normals_;
};

}  // namespace geomsrv
