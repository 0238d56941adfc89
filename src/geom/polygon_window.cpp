// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
#include "geom/polygon_window.hpp"

#include <bit>
#include <cstdint>
#include <limits>

#include "geom/double_double.hpp"

namespace geomsrv {

namespace {

constexpr std::size_t kLanes = Lanes::kCount;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

// Velocities are rescaled where they leave [2^-200, 2^200], so that products with edges stay in the range of
// double.
constexpr double kSmallestSpeed = 0x1p-200;
constexpr double kLargestSpeed = 0x1p200;

// Candidates are kept as bits, 64 axes at a time: to branch on every block costs more than all of its
// arithmetic, as nobody can predict which block holds one.
struct CandidateBits {
    std::uint64_t entries = 0;
    std::uint64_t exits = 0;
};

GEOMSRV_WIDE_CLONES CandidateBits candidate_bits(const PairedPolygon& p, std::size_t first, std::size_t end,
                                                 const Window& window) {
    const Lanes zero = 0.0;
    LaneMask entries = zero < zero;
    LaneMask exits = entries;
    for (std::size_t k = first, block = 0; k < end; k += kLanes, ++block) {
        const Lanes most = Lanes::load(p.work[0] + k);
        const Lanes slowest = Lanes::load(p.work[1] + k);
        const Lanes ending = Lanes::load(p.work[2] + k);
        // most / slowest >= enter if it approaches for certain; else it may begin at any time.
        const LaneMask begins = (zero < most) & (Lanes(window.enter) * slowest <= most);
        // most / slowest <= leave, both negative.  Sliding within the slack does not end a contact.
        const LaneMask ends = (ending < zero) & (Lanes(window.leave) * slowest <= most);
        entries = entries | bits_of_block(begins, block);
        exits = exits | bits_of_block(ends, block);
    }
    return {joined(entries), joined(exits)};
}

}  // namespace

Motion relative_motion(Vec2 velocity_a, Vec2 velocity_b) {
    const auto largest = [](Vec2 v) { return std::max(std::fabs(v.x), std::fabs(v.y)); };
    double before = 1.0;
    double scale = 1.0;
    int exponent = 0;
    double speed = largest(velocity_b - velocity_a);
    if (!(speed <= kLargestSpeed) || (speed < kSmallestSpeed && speed > 0.0)) {
        // Components of opposite signs may differ by more than the largest double.
        if (std::isinf(speed)) {
            before = 0.25;
        }
        speed = largest(before * velocity_b - before * velocity_a);
        exponent = std::clamp(-std::ilogb(speed), -1000, 1000);
        scale = std::scalbn(1.0, exponent);
        exponent += std::ilogb(before);
    }
    const auto apart = [=](double to, double from) -> DoubleDouble {
        const DoubleDouble difference = two_sum(before * to, -(before * from));
        return {scale * difference.hi, scale * difference.lo};
    };
    const ExactVec2 exact = {apart(velocity_b.x, velocity_a.x), apart(velocity_b.y, velocity_a.y)};
    const double noise =
        kVelocityNoise * (scale * (before * largest(velocity_a) + before * largest(velocity_b)));
    return {{exact.x.hi, exact.y.hi}, exact, exponent, noise};
}

GEOMSRV_WIDE_CLONES Window window_of(const PolygonPair& pair, const Motion& motion, const Slacks& slacks) {
    const Lanes zero = 0.0;
    const Lanes never = kInfinity;
    const LaneMask none = never < zero;
    Lanes enter = zero;
    Lanes leave = never;
    LaneMask apart = none;
    LaneMask parting = none;
    LaneMask deep = ~none;
    for (const int i : {0, 1}) {
        const PairedPolygon& p = pair.side(i);
        for (std::size_t k = 0; k < p.axes; k += kLanes) {
            const AxisNumbers<Lanes> at = numbers(Lanes::load(p.dx + k), Lanes::load(p.dy + k),
                                                  Lanes::load(p.gap + k), approach_of(i), motion, slacks);
            const Lanes open = at.gap - at.gap_slack;       // > 0: certainly apart
            const Lanes closing = at.rate + at.rate_slack;  // <= 0: certainly not approaching
            const Lanes most = at.gap + at.gap_slack;
            const Lanes time = open / closing;
            const LaneMask is_apart = zero < open;
            const LaneMask may_close = zero < closing;
            apart = apart | is_apart;
            parting = parting | (is_apart & ~may_close);
            deep = deep & (most < zero);
            enter = greater(enter, select(is_apart & may_close, time, zero));
            leave = lesser(leave, select(closing < zero, time, never));
            most.store(p.work[0] + k);
            const Lanes slowest = at.rate - at.rate_slack;
            slowest.store(p.work[1] + k);
            (slacks.is_literal ? slowest : closing).store(p.work[2] + k);
        }
    }
    return {greatest(enter), least(leave), any(apart), any(parting), all(deep)};
}

Candidates candidates_of(const PolygonPair& pair, const Window& window, AxisOf* entries, AxisOf* exits) {
    constexpr std::size_t kRow = 64;
    Candidates found;
    const auto list = [](std::uint64_t bits, int side, std::size_t first, AxisOf* axes, std::size_t count) {
        for (; bits != 0; bits &= bits - 1) {
            axes[count++] = {side, first + static_cast<std::size_t>(std::countr_zero(bits))};
        }
        return count;
    };
    for (const int i : {0, 1}) {
        const PairedPolygon& p = pair.side(i);
        for (std::size_t first = 0; first < p.axes; first += kRow) {
            const CandidateBits bits = candidate_bits(p, first, std::min(first + kRow, p.axes), window);
            found.entries = list(bits.entries, i, first, entries, found.entries);
            found.exits = list(bits.exits, i, first, exits, found.exits);
        }
    }
    return found;
}

}  // namespace geomsrv
