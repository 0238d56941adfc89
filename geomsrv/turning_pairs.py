# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""First contact of listed pairs of objects, whatever way they move; pairs that turn, and round ones, are followed here.

Every object turns about the origin of its pose.  A sphere or capsule that only translates has no closed form of its
own: it is followed like one that turns at no speed.  What an object may be off by is told to the engine, which then
proves its bounds for all bodies within; status, time and contact point are those of the bodies as given.
"""

from __future__ import annotations

from collections import Counter
from itertools import product

import numpy as np

from geomsrv import _core, _validate
from geomsrv.answers import BoolArray, ByteArray, ContactStatus, FloatArray, IntArray
from geomsrv.broad_phase import entry_times
from geomsrv.errors import GeometryError, NotAvailableError
from geomsrv.mesh_pairs import mesh_contacts, sliding_meshes
from geomsrv.narrow_phase import (
    ContactRows,
    Unsupported,
    at_rest,
    count_kinds,
    first_contact_rows,
    followed_solids,
    near_at_rest,
    placed_boxes,
    placed_hulls,
)
from geomsrv.turning import approach, velocity_at
from geomsrv.world import ROUNDOFF, World, gather

__all__ = ["closing_speeds", "contact_rows", "first_contact_row", "followed_in_turning", "nearness"]

# Widest time interval of a contact while nothing is uncertain [s].
TIME_TOLERANCE = 1e-6

# The end of a capsule: the half length times a matrix entry good to 5 u, a sum; in three coordinates.
CAPSULE_ROUNDING = 16.0 * ROUNDOFF

NO_APPROACH = "first contact at a distance ({}) is unsupported"

FOLLOWED = ("sphere", "capsule", "box", "convex")  #: solids with a kernel, beside polygons


def contact_rows(
    world: World, pairs: IntArray, horizon: float, tier: str, counts: Counter[str], margin: float = 0.0
) -> tuple[ContactRows, Unsupported]:
    """First contact of every pair that has one or may have one, and the pairs whose motion has no kernel.

    With a `margin` [m], at tier "float64", bodies are in contact that are no further apart.
    """
    if margin > 0.0:
        return _approaches(world, pairs, horizon, counts, margin)
    if (meshes := sliding_meshes(world, pairs, horizon)).any():
        rows, unsupported = contact_rows(world, pairs[~meshes], horizon, tier, counts)
        return ContactRows.joined([mesh_contacts(world, pairs[meshes], horizon, tier, counts), rows]), unsupported
    straight = not world.turns.any() and bool((world.planar | followed_solids(world)).all())
    if tier != "float64" or horizon == 0.0 or straight:
        return first_contact_rows(world, pairs, horizon, tier, counts)
    turns = world.turns[pairs].any(axis=1)
    followed = (turns | _rolling(world, pairs)) & followed_in_turning(world)[pairs].all(axis=1)
    if not followed.any():
        return first_contact_rows(world, pairs, horizon, tier, counts)
    count_kinds(world, pairs[followed], counts)
    if (rotating := followed & turns).any():
        counts["rotation"] += int(rotating.sum())
    rows, unsupported = first_contact_rows(world, pairs[~followed], horizon, tier, counts)
    return ContactRows.joined([_turning_contacts(world, pairs[followed], horizon), rows]), unsupported


FEW = 64  # pairs that are looked at before it is asked whether others can be earlier; from then on twice as many


def first_contact_row(
    world: World, pairs: IntArray, horizon: float, tier: str, counts: Counter[str], margin: float = 0.0
) -> tuple[ContactRows, Unsupported]:
    """As `contact_rows`, but only the row with the least time, and what is unsupported of the pairs looked at.

    Pairs are taken in the order in which their boxes meet, until what is left meets later than contact is proven.
    """
    begin = entry_times(world, pairs, margin)
    order = np.argsort(begin, kind="stable")
    found = [(ContactRows.silent(pairs[:0]), Unsupported.none())]
    first, done, size = np.inf, 0, FEW
    while done < len(order) and begin[order[done]] <= first + TIME_TOLERANCE:
        chosen = np.sort(order[done : done + size])
        found.append(contact_rows(world, pairs[chosen], horizon, tier, counts, margin))
        first = min(first, np.fmin.reduce(found[-1][0].upper, initial=np.inf))
        done, size = done + len(chosen), 2 * size
    counts["later"] += len(order) - done
    rows = ContactRows.joined([part for part, _ in found])
    silent = rows.status == ContactStatus.UNSUPPORTED
    when = np.where(np.isnan(rows.time), np.inf, rows.time)
    if len(when) and (when < np.inf).any():
        silent[np.argmin(when)] = True
    return rows.take(silent), Unsupported.joined([part for _, part in found])


def nearness(margin: float, accuracy: str) -> float:
    """A margin, checked.

    Raises
    ------
    GeometryError
        Names the argument and the fault; `NotAvailableError` for a margin at a tier that does not know any.
    """
    near = _validate.scalar(margin, "margin")
    if near < 0.0:
        raise GeometryError(f"margin must be >= 0, got {margin}")
    if near > 0.0 and accuracy != "float64":
        raise NotAvailableError(f"a margin is available at accuracy 'float64' only, not at {accuracy!r}")
    return near


def _approaches(
    world: World, pairs: IntArray, horizon: float, counts: Counter[str], margin: float
) -> tuple[ContactRows, Unsupported]:
    """When bodies come as near as the margin: a ball that large is added to one of them."""
    followed = followed_in_turning(world)[pairs].all(axis=1)
    count_kinds(world, pairs[followed], counts)
    rows = [_turning_contacts(world, pairs[followed], horizon, margin)] if followed.any() else []
    others = pairs[~followed]
    resting = at_rest(world, others, horizon)
    near, missing = near_at_rest(world, others[resting], horizon, counts, margin)
    moving = Unsupported.of_kinds(world, others[~resting], NO_APPROACH)
    return (
        ContactRows.joined([*rows, near, ContactRows.silent(missing.pairs), ContactRows.silent(moving.pairs)]),
        Unsupported.joined([missing, moving]),
    )


def closing_speeds(world: World, rows: ContactRows) -> FloatArray:
    """(k,) [m/s]: how fast the bodies approach along the normal at first contact, > 0, or part.

    Of bodies that turn, at the contact point where that is fastest.  NaN without a normal, or without a point where it
    matters, and where it is not known how an object moves.
    """
    a, b = rows.pairs.T
    speed = approach(world.twists[a, :3], world.twists[b, :3], rows.normal)
    for k in np.flatnonzero(world.turns[rows.pairs].any(axis=1)).tolist():
        known = rows.points[k] is not None and not world.motion_faults.keys() & {int(a[k]), int(b[k])}
        speed[k] = np.nan
        if known:
            points = np.vstack(rows.points[k])  # of all parts
            at = [
                velocity_at(world.twists[row, :3], world.twists[row, 3:], world.poses[row, :3], rows.time[k], points)
                for row in (a[k], b[k])
            ]
            speed[k] = ((at[0] - at[1]) @ rows.normal[k]).max()
    return speed


def _rolling(world: World, pairs: IntArray) -> BoolArray:
    """(k,) bool: solids of which one is round, at different velocities."""
    flat = world.planar[pairs[:, 0]] | followed_solids(world)[pairs].all(axis=1)
    velocity = world.twists[pairs, :3]
    apart = (velocity[:, 0] != velocity[:, 1]).any(axis=1) | world.velocity_uncertainty[pairs].any(axis=1)
    rolling: BoolArray = ~flat & apart
    return rolling


def followed_in_turning(world: World) -> BoolArray:
    """(n,) bool: objects that can be followed while they turn."""
    codes = [code for code, name in enumerate(_core.shape_kinds()) if name in FOLLOWED]
    followed: BoolArray = world.planar | np.isin(world.kinds, codes)
    followed[list(world.motion_faults)] = False
    return followed


def _turning_contacts(world: World, pairs: IntArray, horizon: float, margin: float = 0.0) -> ContactRows:
    slack = _slack(world, pairs, margin)
    status, lower, upper, normal, point = _ask(world, pairs, horizon, slack)
    doubt = np.column_stack([world.uncertainty[pairs].sum(axis=1), world.velocity_uncertainty[pairs].sum(axis=1)])
    vague = np.flatnonzero(doubt.any(axis=1))
    time = lower.copy()
    if len(vague):
        slack[vague, 1:] += doubt[vague]
        may, first, last, *_ = _ask(world, pairs[vague], horizon, slack[vague])
        never = status[vague] == ContactStatus.NEVER
        lower[vague] = np.where(never, first, np.fmin(first, lower[vague]))
        upper[vague] = np.where(may == ContactStatus.NEVER, np.nan, np.where(never, np.inf, last))
    # Nearest points are those of the cores; where these are closer than the radii, the surfaces meet.
    radius = _radius(world)[pairs]
    uneven = np.flatnonzero(radius[:, 0] != radius[:, 1])
    point[uneven] += 0.5 * (radius[uneven, :1] - radius[uneven, 1:]) * np.nan_to_num(normal[uneven])
    points = np.empty(len(pairs), dtype=object)
    for k in np.flatnonzero(~np.isnan(point[:, 0])).tolist():
        points[k] = point[k : k + 1]
    rows = ContactRows(pairs, status, time, lower, upper, np.full(len(pairs), np.nan), normal, points)
    return rows.take((status != ContactStatus.NEVER) | ~np.isnan(lower))


def _ask(
    world: World, pairs: IntArray, horizon: float, slack: FloatArray
) -> tuple[ByteArray, FloatArray, FloatArray, FloatArray, FloatArray]:
    """Status, lower, upper, normal and point from the engine."""
    count = len(pairs)
    status, lower, upper = np.zeros(count, np.uint8), np.zeros(count), np.zeros(count)
    normal, point = np.zeros((count, 3)), np.zeros((count, 3))
    planar, boxes = world.planar[pairs[:, 0]], world.table.boxes[world.shape[pairs]]
    motion = np.column_stack([world.twists, world.poses[:, :3]])
    motion[world.planar, 8] = 0.0
    for flat, *is_box in product((True, False), repeat=3):
        part = (planar == flat) & (boxes == is_box).all(axis=1)
        if not part.any():
            continue
        side_a, side_b = (_side(world, pairs[part, k], flat, is_box[k]) for k in range(2))
        motion_a, motion_b = (np.ascontiguousarray(motion[pairs[part, k]]) for k in range(2))
        found = _core.first_contact_turning(side_a, side_b, motion_a, motion_b, horizon, TIME_TOLERANCE, slack[part])
        status[part], lower[part], upper[part], normal[part], point[part] = found[:5]
    return status, lower, upper, normal, point


def _side(world: World, rows: IntArray, flat: bool, boxes: bool) -> tuple[FloatArray | IntArray, ...]:
    """Objects of one sort as the engine reads them: what is placed here is from then on taken literally."""
    if flat:
        return gather(*world.rings, rows)
    if boxes:
        return placed_boxes(world, rows)
    kinds = world.kinds[rows]
    hull, capsule = map(_core.shape_kinds().index, ("convex", "capsule"))
    if (kinds == hull).all():
        return placed_hulls(world, rows)
    half = np.where(kinds == capsule, world.table.packed.params[world.shape[rows], 1], 0.0)
    items = []
    for row, along in zip(rows.tolist(), half.tolist(), strict=True):
        if world.kinds[row] == hull:
            items.append(placed_hulls(world, np.array([row]))[0])
        else:
            place, axis = world.poses[row, :3], along * world.rotations[row][:, 2]
            items.append(np.array([place - axis, place + axis])[: 2 if along else 1])
    return np.concatenate(items), np.cumsum([0, *map(len, items)], dtype=np.int64)


def _radius(world: World) -> FloatArray:
    """(n,) rounding radius of spheres and capsules."""
    codes = [code for code, name in enumerate(_core.shape_kinds()) if name in ("sphere", "capsule")]
    radius: FloatArray = np.where(np.isin(world.kinds, codes), world.table.round[world.shape], 0.0)
    return radius


def _slack(world: World, pairs: IntArray, nearness: float) -> FloatArray:
    """(k, 3) margin, uncertainty, drift of the bodies as given."""
    names, params = _core.shape_kinds(), world.table.packed.params[world.shape]
    corners = np.where(world.kinds == names.index("convex"), params[:, 0], 0.0)  # rounded ones, of a frustum
    size = np.abs(world.poses[:, :3]).sum(axis=1) + world.table.reach[world.shape]
    ends = np.where(world.kinds == names.index("capsule"), CAPSULE_ROUNDING * size, 0.0)
    margin = _radius(world)[pairs].sum(axis=1) + nearness
    off = np.where(np.isfinite(ends), corners + ends, 0.0)[pairs].sum(axis=1) + 2.0 * ROUNDOFF * margin
    return np.column_stack([margin, off, np.zeros(len(pairs))])
