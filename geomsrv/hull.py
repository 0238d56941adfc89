# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""Facets of convex hulls, to draw them.  No query uses this: the engine needs vertices only."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = ["hull_triangles"]

# A point closer to a facet than this times the size of the set counts as being in it.  That is far above the
# rounding of the few products of differences in a facet's plane (about 10 * 2^-53) and far below what can be seen.
FLAT = 1e-9


def hull_triangles(points: ArrayLike) -> NDArray[np.int64]:
    """Triangles (k, 3) of point indices, counter-clockwise seen from outside, that cover the hull of (n, 3) `points`.

    Flat sets get both sides, segments and points none.  Incremental, with all facets tested at once per point:
    n * k in time, which is fine for the few hundred vertices of a collision hull.

    Examples
    --------
    >>> from geomsrv.hull import hull_triangles
    >>> len(hull_triangles([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [0.1, 0.1, 0.1]]))
    4
    """
    given = np.asarray(points, dtype=np.float64).reshape(-1, 3)
    nothing = np.zeros((0, 3), dtype=np.int64)
    if len(given) == 0:
        return nothing
    local = given - given.mean(axis=0)
    size = float(np.abs(local).max())
    if size == 0.0:
        return nothing
    local = local / size

    # A first tetrahedron from far-apart points, so that its facets are well shaped.
    a = int(np.argmax(np.linalg.norm(local - local[0], axis=1)))
    b = int(np.argmax(np.linalg.norm(local - local[a], axis=1)))
    off_line = np.linalg.norm(np.cross(local - local[a], local[b] - local[a]), axis=1)
    c = int(np.argmax(off_line))
    if off_line[c] <= FLAT:
        return nothing
    normal = np.cross(local[b] - local[a], local[c] - local[a])
    height = (local - local[a]) @ (normal / np.linalg.norm(normal))
    d = int(np.argmax(np.abs(height)))
    if abs(height[d]) <= FLAT:
        return _both_sides(local, normal)
    if height[d] > 0.0:
        b, c = c, b
    facets = np.array([(a, b, c), (a, d, b), (b, d, c), (c, d, a)], dtype=np.int64)
    normals, offsets = _planes(local, facets)

    # The farther out a point, the more it is likely to be a corner: most others are then inside at once.
    for i in np.argsort(-np.linalg.norm(local, axis=1)).tolist():
        seen = normals @ local[i] > offsets + FLAT
        if not seen.any():
            continue
        # The horizon: edges between a facet that sees the point and one that does not, which lacks the reversed edge.
        edges = facets[seen][:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
        present = {tuple(edge) for edge in edges.tolist()}
        horizon = [(p, q) for p, q in present if (q, p) not in present]
        fresh = np.array([(p, q, i) for p, q in horizon], dtype=np.int64).reshape(-1, 3)
        new_normals, new_offsets = _planes(local, fresh)
        facets = np.concatenate([facets[~seen], fresh])
        normals, offsets = np.concatenate([normals[~seen], new_normals]), np.concatenate([offsets[~seen], new_offsets])
    return facets


def _planes(points: NDArray[np.float64], facets: NDArray[np.int64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Outward unit normals and offsets; a degenerate facet gets a zero normal, and so is seen by no point."""
    p, q, r = points[facets[:, 0]], points[facets[:, 1]], points[facets[:, 2]]
    normals = np.cross(q - p, r - p)
    lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    normals = np.divide(normals, lengths, out=np.zeros_like(normals), where=lengths > 0.0)
    return normals, np.einsum("ij,ij->i", normals, p)


def _both_sides(points: NDArray[np.float64], normal: NDArray[np.float64]) -> NDArray[np.int64]:
    """A flat set: the fan of its outline about its first corner, once per side."""
    axis = int(np.argmax(np.abs(normal)))
    u, v = points[:, (axis + 1) % 3], points[:, (axis + 2) % 3]
    outline: list[int] = []
    order = np.lexsort((v, u)).tolist()
    for half in (order, order[::-1]):
        chain: list[int] = []
        for i in half:
            while len(chain) >= 2:
                j, k = chain[-2:]
                if (u[k] - u[j]) * (v[i] - v[j]) - (v[k] - v[j]) * (u[i] - u[j]) > FLAT:
                    break
                chain.pop()
            chain.append(i)
        outline += chain[:-1]
    fan = np.array([(outline[0], p, q) for p, q in zip(outline[1:], outline[2:], strict=False)], dtype=np.int64)
    return np.concatenate([fan, fan[:, ::-1]])
