# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""Where a literal box lies with respect to a literal view frustum, exactly.

A box point is C + sum s_i e_i A_i with s in the cube [-1, 1]^3, and the frustum is six half spaces; so box
and frustum meet iff twelve linear inequalities in s have a solution.  The solutions are bounded; if there
are any, then there is a corner, where three of the twelve hold with equality.  All such corners are tried.
Boxes of zero extent need no care, and no separating axis is named.
"""

from __future__ import annotations

from itertools import combinations
from typing import Any

from oracle.vectors import Vector, add, cross, dot, exact, scale, to_integers

OUTSIDE, INTERSECTS, INSIDE = "OUTSIDE", "INTERSECTS", "INSIDE"
FACES = ("left-", "left+", "up-", "up+", "near", "far")


def frustum_planes(origin: Any, axes: Any, bounds: Any, near: Any, far: Any) -> list[tuple[Vector, Any]]:
    """(n, d) with n . x <= d for the points of the frustum, in the order of `FACES`.

    Axes may be far off orthonormal, of either handedness, but not linearly dependent.
    """
    origin, (left, up, view), (l0, l1, u0, u1) = exact(origin), exact(axes), exact(bounds)
    near, far = exact(near), exact(far)
    spans = [(up, add(scale(x, left), scale(near, view))) for x in (l0, l1)]
    spans += [(left, add(scale(y, up), scale(near, view))) for y in (u0, u1)]
    # Side planes pass through the origin; near and far are parallel to L and U.
    found = [(cross(*span), origin) for span in spans]
    found += [(cross(left, up), add(origin, scale(depth, view))) for depth in (near, far)]
    middle = add(scale((l0 + l1) / 2, left), scale((u0 + u1) / 2, up))
    inside = add(origin, scale((1 + far / near) / 2, add(middle, scale(near, view))))
    planes = [(n, dot(n, on)) for n, on in found]
    return [(n, d) if dot(n, inside) < d else (scale(-1, n), -d) for n, d in planes]


def state(frustum: tuple[Any, ...], box: tuple[Any, ...]) -> str:
    """OUTSIDE, INTERSECTS or INSIDE, closed sets; arguments as for the corners in `polytope`."""
    planes = frustum_planes(*frustum)
    center, axes, half_extents = (exact(part) for part in box)
    arms = [scale(half, axis) for half, axis in zip(half_extents, axes, strict=True)]
    # g . s <= h in the cube's coordinates; h is the room left at the centre.
    rooms = [(tuple(dot(n, arm) for arm in arms), d - dot(n, center)) for n, d in planes]
    _, (rows,) = to_integers([(*gradient, room) for gradient, room in rooms])
    if all(sum(map(abs, row[:3])) <= row[3] for row in rows):
        return INSIDE
    walls = [tuple(sign * (i == k) for i in range(3)) + (1,) for k in range(3) for sign in (1, -1)]
    for triple in combinations([*walls, *rows], 3):
        corner, weight = _meet(triple)
        if weight and all(dot(row[:3], corner) <= row[3] * weight for row in (*walls, *rows)):
            return INTERSECTS
    return OUTSIDE


def _meet(triple: tuple[Vector, ...]) -> tuple[Vector, int]:
    """The common point of three planes g_i . s = h_i as (numerator, denominator); 0 if they are dependent."""
    (a, b, c), (p, q, r) = [row[:3] for row in triple], [row[3] for row in triple]
    bc, ca, ab = cross(b, c), cross(c, a), cross(a, b)
    weight = dot(a, bc)
    point = add(add(scale(p, bc), scale(q, ca)), scale(r, ab))
    return (point, weight) if weight >= 0 else (scale(-1, point), -weight)


def contains(frustum: tuple[Any, ...], point: Any) -> bool:
    """Whether the closed frustum contains a point."""
    return all(dot(n, exact(point)) <= d for n, d in frustum_planes(*frustum))


def touching_faces(frustum: tuple[Any, ...], point: Any) -> frozenset[str]:
    """Names of the faces whose planes contain `point`."""
    planes = zip(FACES, frustum_planes(*frustum), strict=True)
    return frozenset(name for name, (n, d) in planes if dot(n, exact(point)) == d)
