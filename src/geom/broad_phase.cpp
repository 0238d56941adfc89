// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
// Overlapping boxes by a bounding volume hierarchy that is built anew for every query.
//
// Everything may have moved, so nothing is kept from one query to the next: building takes about as long as
// walking, and a tree brought up to date would be walked for longer.  A uniform grid is faster for boxes of
// one size, but one large box among small ones fills all its cells; sorting along one axis fails when all
// boxes share that interval.  The tree minds neither: O(n log n) to build wherever the boxes are, then about
// log n nodes for each pair reported.
#include "geom/broad_phase.hpp"

#include <algorithm>
#include <array>
#include <limits>
#include <numeric>

namespace geomsrv {

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Boxes per leaf; measured: 2 to 8 are equally fast.
constexpr std::size_t kLeafSize = 4;

/// A split in the middle of the range makes better trees than the median and takes one pass instead of three,
/// but one far box can leave all others on one side.  Where the smaller side gets no more than 1/8, the
/// median is taken; so the depth stays below log(n) / log(8/7).
constexpr std::size_t kWorstShare = 8;

/// Infinite bounds count as this when centres are compared; half of it plus half of it does not overflow.
constexpr double kFarAway = 1e300;

/// A box as (-lower, upper): a union is six maxima, "reaches as far as" six comparisons of one sort.
struct Extent {
    std::array<double, 6> side = {-kInfinity, -kInfinity, -kInfinity, -kInfinity, -kInfinity, -kInfinity};
};

/// What another extent must reach in order to overlap a box: (-upper, lower) of that box.
struct Probe {
    std::array<double, 6> side;
};

Extent extent_of(const AabbRows& boxes, std::size_t i) {
    const double* lower = boxes.lower + 3 * i;
    const double* upper = boxes.upper + 3 * i;
    return {{-lower[0], -lower[1], -lower[2], upper[0], upper[1], upper[2]}};
}

/// Negation is exact, so touching boxes meet exactly.
Probe probe_of(const Extent& box) {
    const auto& s = box.side;
    return {{-s[3], -s[4], -s[5], -s[0], -s[1], -s[2]}};
}

Extent united(const Extent& a, const Extent& b) {
    Extent both;
    for (std::size_t k = 0; k < 6; ++k) both.side[k] = std::max(a.side[k], b.side[k]);
    return both;
}

bool reaches(const Extent& box, const Probe& probe) {
    // No short cuts: whether the next comparison is needed is a coin toss that the branch predictor loses.
    unsigned apart = 0;
    for (std::size_t k = 0; k < 6; ++k) apart |= static_cast<unsigned>(box.side[k] < probe.side[k]);
    return apart == 0;
}

/// Nodes lie in preorder, so a subtree is one stretch and a walk needs no stack:
///
///     index  0  1  2  3  4  5  6             0
///     skip   7  4  3  4  7  6  7         1       4
///                                      2   3   5   6
///
/// Walking on from behind leaf 2 by "overlaps: next index, else: skip" meets just the leaves after it.
struct Node {
    Extent extent;
    std::uint32_t skip = 0;   ///< index of the first node behind this one's subtree
    std::uint32_t begin = 0;  ///< first box of a leaf, in tree order
    std::uint32_t count = 0;  ///< boxes of a leaf; 0 for an inner node
};

struct Item {
    std::array<double, 3> center;
    std::uint32_t box = 0;
};

class Tree {
public:
    explicit Tree(const AabbRows& boxes) {
        items_.reserve(boxes.count);
        for (std::size_t i = 0; i < boxes.count; ++i) {
            Item item;
            for (std::size_t k = 0; k < 3; ++k) {
                const double lower = std::clamp(boxes.lower[3 * i + k], -kFarAway, kFarAway);
                const double upper = std::clamp(boxes.upper[3 * i + k], -kFarAway, kFarAway);
                item.center[k] = 0.5 * lower + 0.5 * upper;
            }
            item.box = static_cast<std::uint32_t>(i);
            items_.push_back(item);
        }
        nodes_.reserve(4 * (boxes.count / kLeafSize) + 1);
        if (boxes.count > 0) build(0, boxes.count, boxes);
        extents_.reserve(boxes.count);
        for (const Item& item : items_) extents_.push_back(extent_of(boxes, item.box));
    }

    /// visit(j) for every box that overlaps, from node `start` on.
    template <class Visit>
    void walk(const Probe& probe, std::size_t start, const Visit& visit) const {
        for (std::size_t i = start; i < nodes_.size();) {
            const Node& node = nodes_[i];
            if (!reaches(node.extent, probe)) {
                i = node.skip;
                continue;
            }
            for (std::size_t k = node.begin; k < node.begin + node.count; ++k) {
                if (reaches(extents_[k], probe)) visit(items_[k].box);
            }
            ++i;
        }
    }

    const std::vector<Node>& nodes() const { return nodes_; }
    const Extent& extent(std::size_t k) const { return extents_[k]; }  ///< of the k-th box in tree order
    std::uint32_t box(std::size_t k) const { return items_[k].box; }   ///< its index in the input

private:
    /// Appends the subtree of [begin, end) and returns what encloses it.
    Extent build(std::size_t begin, std::size_t end, const AabbRows& boxes) {
        const std::size_t self = nodes_.size();
        nodes_.emplace_back();
        Extent extent;
        if (end - begin <= kLeafSize) {
            for (std::size_t k = begin; k < end; ++k)
                extent = united(extent, extent_of(boxes, items_[k].box));
            nodes_[self].begin = static_cast<std::uint32_t>(begin);
            nodes_[self].count = static_cast<std::uint32_t>(end - begin);
        } else {
            const std::size_t middle = split(begin, end);
            extent = build(begin, middle, boxes);
            extent = united(extent, build(middle, end, boxes));
        }
        nodes_[self].extent = extent;
        nodes_[self].skip = static_cast<std::uint32_t>(nodes_.size());
        return extent;
    }

    /// Parts [begin, end) in two and returns where the second begins.
    std::size_t split(std::size_t begin, std::size_t end) {
        std::array<double, 3> low = items_[begin].center;
        std::array<double, 3> high = low;
        for (std::size_t i = begin; i < end; ++i) {
            for (std::size_t k = 0; k < 3; ++k) {
                low[k] = std::min(low[k], items_[i].center[k]);
                high[k] = std::max(high[k], items_[i].center[k]);
            }
        }
        std::size_t axis = 0;
        for (std::size_t k = 1; k < 3; ++k) {
            if (high[k] - low[k] > high[axis] - low[axis]) axis = k;
        }
        const auto at = [this](std::size_t i) { return items_.begin() + static_cast<std::ptrdiff_t>(i); };
        const double border = 0.5 * low[axis] + 0.5 * high[axis];
        const auto second =
            std::partition(at(begin), at(end), [=](const Item& i) { return i.center[axis] < border; });
        const std::size_t middle = static_cast<std::size_t>(second - items_.begin());
        if (std::min(middle - begin, end - middle) > (end - begin) / kWorstShare) return middle;
        const std::size_t median = begin + (end - begin) / 2;
        std::nth_element(at(begin), at(median), at(end),
                         [axis](const Item& a, const Item& b) { return a.center[axis] < b.center[axis]; });
        return median;
    }

    std::vector<Node> nodes_;
    std::vector<Item> items_;      ///< in tree order
    std::vector<Extent> extents_;  ///< of items_
};

/// Stable counting sort by one member, all of whose values are below `count`.
std::vector<IndexPair> ordered_by(std::uint32_t IndexPair::* key, const std::vector<IndexPair>& pairs,
                                  std::size_t count) {
    std::vector<std::size_t> next(count + 1, 0);
    for (const IndexPair& pair : pairs) ++next[pair.*key + 1];
    std::partial_sum(next.begin(), next.end(), next.begin());
    std::vector<IndexPair> out(pairs.size());
    for (const IndexPair& pair : pairs) out[next[pair.*key]++] = pair;
    return out;
}

std::vector<IndexPair> sorted(const std::vector<IndexPair>& pairs, std::size_t first_count,
                              std::size_t second_count) {
    return ordered_by(&IndexPair::first, ordered_by(&IndexPair::second, pairs, second_count), first_count);
}

}  // namespace

std::vector<IndexPair> overlapping_pairs(const AabbRows& boxes) {
    const Tree tree(boxes);
    std::vector<IndexPair> pairs;
    for (std::size_t n = 0; n < tree.nodes().size(); ++n) {
        const Node& leaf = tree.nodes()[n];
        for (std::size_t k = leaf.begin; k < leaf.begin + leaf.count; ++k) {
            const std::uint32_t i = tree.box(k);
            const Probe probe = probe_of(tree.extent(k));
            const auto found = [&pairs, i](std::uint32_t j) {
                pairs.push_back({std::min(i, j), std::max(i, j)});
            };
            // Every pair is met once: by the box that comes first in tree order.
            for (std::size_t other = k + 1; other < leaf.begin + leaf.count; ++other) {
                if (reaches(tree.extent(other), probe)) found(tree.box(other));
            }
            tree.walk(probe, n + 1, found);
        }
    }
    return sorted(pairs, boxes.count, boxes.count);
}

std::vector<IndexPair> overlapping_pairs_between(const AabbRows& a, const AabbRows& b) {
    const Tree tree(b);
    std::vector<IndexPair> pairs;
    for (std::size_t i = 0; i < a.count; ++i) {
        const auto found = [&pairs, i](std::uint32_t j) {
            pairs.push_back({static_cast<std::uint32_t>(i), j});
        };
        tree.walk(probe_of(extent_of(a, i)), 0, found);
    }
    return sorted(pairs, a.count, b.count);
}

}  // namespace geomsrv
