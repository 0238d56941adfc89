// Copyright 2026 The geomsrv authors
// SPDX-License-Identifier: Apache-2.0
// A closed surface of triangles about some vertices of a difference K, which grows vertex by vertex: what the
// expanding polytope algorithm keeps, whatever decides which facets a new vertex sees.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <memory_resource>
#include <utility>
#include <vector>

#include "geom/vec.hpp"

namespace geomsrv {

/// A vertex of K, of one of each body.
struct HullVertex {
    int index_a = 0;
    int index_b = 0;
    Vec3 a;
    Vec3 b;
    Vec3 w;  ///< b - a, rounded
};

struct HullFacet {
    int vertex[3] = {};     ///< counter-clockwise from outside
    int neighbour[3] = {};  ///< across the edge from vertex[i] to vertex[i + 1]
    Vec3 normal;            ///< unit, outwards
    double offset = 0.0;    ///< of its plane from the origin
    double error = 0.0;     ///< of the offset
    bool alive = true;
    bool refined = false;  ///< measured in more than double precision
    int seen = 0;          ///< last vertex that looked at it
};

/// `Owner` decides: side(facet, vertex) is > 0 where the vertex lies strictly beyond the facet's plane, 0 on
/// it; measured(facet) sets normal, offset and error.
template <class Owner>
class HullSurface {
    friend Owner;
    HullSurface() : memory_(buffer_.data(), buffer_.size()) {
        vertices_.reserve(64);
        facets_.reserve(160);
        heap_.reserve(192);
    }

protected:
    static std::size_t at(int i) { return static_cast<std::size_t>(i); }
    [[nodiscard]] Vec3 w(int i) const { return vertices_[at(i)].w; }

    /// Facets of the first four vertices; `behind`: side of the fourth with respect to the first three.
    void enclose(int behind) {
        if (behind > 0) {
            std::swap(vertices_[1], vertices_[2]);
        }
        //          3            Vertex 3 lies behind the facet 0 1 2.
        //        / | \          Edge i of a facet runs from its vertex i to the next.
        constexpr int kCorner[4][3] = {{0, 1, 2}, {0, 3, 1}, {1, 3, 2}, {2, 3, 0}};
        constexpr int kAcross[4][3] = {{1, 2, 3}, {3, 2, 0}, {1, 3, 0}, {2, 1, 0}};
        for (int f = 0; f < 4; ++f) {
            HullFacet facet;
            for (int i = 0; i < 3; ++i) {
                facet.vertex[i] = kCorner[f][i];
                facet.neighbour[i] = kAcross[f][i];
            }
            facets_.push_back(owner().measured(facet));
            push(f);
        }
    }

    void push(int f) {
        heap_.push_back({facets_[at(f)].offset - facets_[at(f)].error, f});
        std::push_heap(heap_.begin(), heap_.end());
    }

    /// The facet that may be nearest to the origin; -1 if none is left.
    int pop() {
        while (!heap_.empty()) {
            const Entry top = heap_.front();
            std::pop_heap(heap_.begin(), heap_.end());
            heap_.pop_back();
            if (facets_[at(top.facet)].alive) {
                return top.facet;
            }
        }
        return -1;
    }

    /// Replaces the facets that v sees, `first` among them, by a cone from their rim to v.
    void grow(int first, const HullVertex& v) {
        vertices_.push_back(v);
        const int apex = static_cast<int>(vertices_.size()) - 1;
        visible_.clear();
        visible_.push_back(first);
        facets_[at(first)].alive = false;
        rim_.assign(vertices_.size(), -1);
        const int new_begin = static_cast<int>(facets_.size());
        for (std::size_t next = 0; next < visible_.size(); ++next) {
            const int f = visible_[next];
            for (int i = 0; i < 3; ++i) {
                const int g = facets_[at(f)].neighbour[i];
                HullFacet& across = facets_[at(g)];
                if (!across.alive) {
                    continue;  // seen already
                }
                if (across.seen != apex) {
                    across.seen = apex;
                    if (owner().side(across, vertices_[at(apex)]) > 0) {
                        across.alive = false;
                        visible_.push_back(g);
                        continue;
                    }
                }
                add_rim_facet(f, i, g, apex);
            }
        }
        const int new_end = static_cast<int>(facets_.size());
        for (int f = new_begin; f < new_end; ++f) {
            // The facet whose rim edge starts where this one's ends is its neighbour on that side.
            const int g = rim_[at(facets_[at(f)].vertex[1])];
            facets_[at(f)].neighbour[1] = g;
            facets_[at(g)].neighbour[2] = f;
            push(f);
        }
    }

private:
    // Facets, their heap and vertices of a few dozen insertions fit here; more spill to the heap.
    static constexpr std::size_t kStackBytes = std::size_t{48} << 10;

    struct Entry {
        double key = 0.0;  ///< offset - error: the facet's plane is proven to be no nearer
        int facet = 0;

        // The heap has the nearest facet on top.
        friend constexpr bool operator<(Entry a, Entry b) { return a.key > b.key; }
    };

    Owner& owner() { return static_cast<Owner&>(*this); }

    /// Facet over edge i of the visible facet f, beyond which the facet g stays.
    void add_rim_facet(int f, int i, int g, int apex) {
        HullFacet facet;
        facet.vertex[0] = facets_[at(f)].vertex[i];
        facet.vertex[1] = facets_[at(f)].vertex[(i + 1) % 3];
        facet.vertex[2] = apex;
        facet.neighbour[0] = g;
        const int index = static_cast<int>(facets_.size());
        for (int k = 0; k < 3; ++k) {
            if (facets_[at(g)].vertex[k] == facet.vertex[1] &&
                facets_[at(g)].vertex[(k + 1) % 3] == facet.vertex[0]) {
                facets_[at(g)].neighbour[k] = index;
            }
        }
        rim_[at(facet.vertex[0])] = index;
        facets_.push_back(owner().measured(facet));
    }

    std::array<std::byte, kStackBytes> buffer_;
    std::pmr::monotonic_buffer_resource memory_;

protected:
    std::pmr::vector<HullVertex> vertices_{&memory_};
    std::pmr::vector<HullFacet> facets_{&memory_};

private:
    std::pmr::vector<Entry> heap_{&memory_};
    std::pmr::vector<int> visible_{&memory_};
    std::pmr::vector<int> rim_{&memory_};
};

}  // namespace geomsrv
