# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""First contact of listed pairs of objects, whatever way they move; pairs that turn, and round ones, are followed here.

Every object turns about the origin of its pose.  A sphere or capsule that only translates has no closed form of its
own: it is followed like one that turns at no speed.  What an object may be off by is told to the engine, which then
proves its bounds for all bodies within; status, time and contact point are those of the bodies as given.
"""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from itertools import product

import numpy as np
from numpy.typing import NDArray

from geomsrv import _core, _validate
from geomsrv.advancement import advance
from geomsrv.answers import BoolArray, ByteArray, ContactStatus, FloatArray, IntArray, gather
from geomsrv.broad_phase import entry_times
from geomsrv.errors import GeometryError, NotAvailableError
from geomsrv.ladder import AUTO, UNKNOWN, Quality, climb, narrow
from geomsrv.mesh_following import follow_meshes, meshes
from geomsrv.mesh_pairs import mesh_contacts, sliding_meshes
from geomsrv.narrow_phase import (
    ContactRows,
    Unsupported,
    at_rest,
    count_kinds,
    first_contact_rows,
    near_at_rest,
    placed_boxes,
    placed_hulls,
    point_sets,
    unpredictable,
)
from geomsrv.queries import MOVING, MOVING_POLYGONS, SOLID_MOTION_TIERS, TIERS
from geomsrv.turning import TIME_TOLERANCE, approach, settled_at_start, velocity_at
from geomsrv.world import ROUNDOFF, World

__all__ = [
    "SWITCHED_OFF",
    "Question",
    "ask_followed",
    "climbed_contact_rows",
    "closing_speeds",
    "contact_rows",
    "first_contact_row",
    "followed_in_pairs",
    "followed_in_turning",
    "nearness",
    "slack_of",
]

# The end of a capsule: the half length times a matrix entry good to 5 u, a sum; in three coordinates.
CAPSULE_ROUNDING = 16.0 * ROUNDOFF

SWITCHED_OFF = "first contact of what turns is switched off"
NO_APPROACH = "first contact at a distance ({}) is unsupported"
NO_MESH = "first contact of a mesh ({}) that turns, is uncertain, or meets round bodies is available at 'float64' only"

FOLLOWED = _core.shape_kinds()[:9]  #: solids that are followed, beside polygons

#: Solids that are followed by looks at their distance, with others and among themselves but for half spaces.
BY_DISTANCE = ("half_space", "cylinder", "cone", "ellipsoid")


@dataclass(frozen=True)
class Question:
    """What is asked of pairs in motion.

    Attributes
    ----------
    horizon : float
        [s]
    tier : str
    margin : float
        With one [m], at tier "float64", bodies are in contact that are no further apart.
    tolerance : float
        Widest time interval [s] of pairs that are followed step by step.
    contact_set : bool
        Whether contact points are wanted.
    rotation : bool
        Whether to follow what turns; without it a pair of which one does is unsupported unless it is in contact now.
    """

    horizon: float
    tier: str = "float64"
    margin: float = 0.0
    tolerance: float = TIME_TOLERANCE
    contact_set: bool = True
    rotation: bool = True


def contact_rows(
    world: World, pairs: IntArray, question: Question, counts: Counter[str]
) -> tuple[ContactRows, Unsupported]:
    """First contact of every pair that has one or may have one, and the pairs whose motion has no kernel."""
    if question.margin > 0.0:
        rows, unsupported = _approaches(world, pairs, question, counts)
    elif (sliding := sliding_meshes(world, pairs, question.horizon)).any():
        others, unsupported = contact_rows(world, pairs[~sliding], question, counts)
        found = mesh_contacts(
            world, pairs[sliding], question.horizon, question.tier, counts, contact_set=question.contact_set
        )
        return ContactRows.joined([found, others]), unsupported
    elif (lost := meshes(world, pairs) & ~_followed(world, pairs, question)).any():
        others, unsupported = contact_rows(world, pairs[~lost], question, counts)
        found, missing = _held_meshes(world, pairs[lost], question, counts)
        return ContactRows.joined([found, others]), Unsupported.joined([missing, unsupported])
    else:
        followed = _followed(world, pairs, question)
        rows, unsupported = first_contact_rows(
            world, pairs[~followed], question.horizon, question.tier, counts, question.contact_set
        )
        if followed.any():
            count_kinds(world, pairs[followed], counts)
            if turning := int(world.turns[pairs[followed]].any(axis=1).sum()):
                counts["rotation"] += turning
            stepwise = _turning_contacts(world, pairs[followed], question)
            resting = (stepwise.time == 0.0) & at_rest(world, stepwise.pairs, question.horizon)
            stepwise.last_time[resting] = question.horizon
            rows = ContactRows.joined([stepwise, rows])
    if not question.contact_set:
        rows.points[:] = None
    if not question.rotation and len(unsupported.pairs):
        spared = (world.turns[unsupported.pairs].any(axis=1)) & followed_in_turning(world)[unsupported.pairs].all(
            axis=1
        )
        unsupported.reason[spared] = SWITCHED_OFF
    return rows, unsupported


def climbed_contact_rows(
    world: World, pairs: IntArray, question: Question, quality: Quality, counts: Counter[str]
) -> tuple[ContactRows, Unsupported, str]:
    """The same at the cheapest tiers that will do, and the highest of them; pairs that are followed have one only."""
    question = replace(question, tier="float64", tolerance=quality.tolerance or question.tolerance)
    stepwise = _followed(world, pairs, question) | (question.margin > 0.0)
    planar = world.planar[pairs[:, 0]]
    parts: list[ContactRows] = []
    missing = [Unsupported.none()]
    tiers: list[str] = []
    began = time.perf_counter()
    for chosen, available, ladder in (
        (stepwise, ("float64",), ("float64",)),
        (~stepwise & ~planar, SOLID_MOTION_TIERS, MOVING),
        (~stepwise & planar, TIERS, MOVING_POLYGONS),
    ):
        if not chosen.any() and (parts or planar.any() or chosen is stepwise):
            continue
        left = max(quality.time_budget - (time.perf_counter() - began), 0.0)
        here = replace(quality, time_budget=left)
        fixed = quality.accuracy not in (AUTO, "float64")
        rungs = here.rungs(available if not fixed else TIERS, ladder)
        found = climb(
            pairs[chosen],
            rungs,
            partial(_solve, world, question, counts, missing),
            partial(_settled, here),
            here,
            tried=(),
        )
        rows = found.rows(ContactRows)
        vague = ~found.settled & ((rows.status != ContactStatus.TOUCHING) | ~rows.certain)
        rows.lower[vague], rows.upper[vague & ~rows.certain] = np.nan_to_num(rows.lower[vague]), np.inf
        rows.time[vague], rows.status[vague] = rows.lower[vague], ContactStatus.NOT_CONVERGED
        parts.append(rows)
        tiers.append(found.count_tiers(counts))
    rows = ContactRows.joined(parts)
    return rows, Unsupported.joined(missing), max(tiers, key=(UNKNOWN, *TIERS).index)


def _solve(
    world: World, question: Question, counts: Counter[str], missing: list[Unsupported], pairs: IntArray, tier: str
) -> tuple[ContactRows, IntArray]:
    """Rows at a tier; what is unsupported is collected."""
    if tier == UNKNOWN:
        rows = ContactRows.silent(pairs)
        rows.status[:] = ContactStatus.NOT_CONVERGED
        return replace(rows, certain=np.zeros(len(pairs), np.bool_)), pairs
    rows, unsupported = contact_rows(world, pairs, replace(question, tier=tier), counts)
    missing.append(unsupported)
    return rows, rows.pairs


def _settled(quality: Quality, rows: ContactRows, tier: str) -> BoolArray:
    """(k,) bool: rows that need no higher tier."""
    if tier == UNKNOWN:
        return np.zeros(len(rows.pairs), np.bool_)
    final = np.isin(rows.status, (ContactStatus.UNSUPPORTED, ContactStatus.NOT_CONVERGED, ContactStatus.GRAZING))
    close = narrow(rows.lower, rows.upper, quality.tolerance) | (rows.status != ContactStatus.WILL_TOUCH)
    sure: BoolArray = final | (rows.certain & close)
    return sure


def _followed(world: World, pairs: IntArray, question: Question) -> BoolArray:
    """(k,) bool: pairs that are followed step by step: what turns, and what is round and moves."""
    nothing = np.zeros(len(pairs), np.bool_)
    if question.tier != "float64":
        return nothing
    if not world.turns.any() and (world.planar | world.polyhedra).all():
        return nothing
    surfaces = meshes(world, pairs) & ~sliding_meshes(world, pairs, question.horizon)
    if question.horizon == 0.0:
        return surfaces
    turns = world.turns[pairs].any(axis=1)
    stepwise = (turns & question.rotation) | (~turns & (_rolling(world, pairs) | surfaces))
    followed: BoolArray = stepwise & followed_in_pairs(world, pairs)
    return followed


def _held_meshes(
    world: World, pairs: IntArray, question: Question, counts: Counter[str]
) -> tuple[ContactRows, Unsupported]:
    """Meshes that are not followed: in contact now, or unsupported."""
    now, text = ContactRows.silent(pairs[:0]), NO_MESH
    if question.tier == "float64":
        count_kinds(world, pairs, counts)
        now, text = _turning_contacts(world, pairs, replace(question, horizon=0.0)), SWITCHED_OFF
        now = now.take(now.status != ContactStatus.NEVER)
    keys = pairs @ [len(world), 1]
    apart = pairs[~np.isin(keys, now.pairs @ [len(world), 1])]
    missing = unpredictable(world, Unsupported.of_kinds(world, apart, text))
    return ContactRows.joined([now, ContactRows.silent(apart)]), missing


def followed_in_pairs(world: World, pairs: IntArray) -> BoolArray:
    """(k,) bool: pairs that can be followed while they turn; two half spaces meet far away whatever they do."""
    unbounded = world.table.unbounded[world.shape[pairs]].all(axis=1)
    followed: BoolArray = followed_in_turning(world)[pairs].all(axis=1) & ~unbounded
    return followed


def _by_distance(world: World, pairs: IntArray) -> BoolArray:
    """(k,) bool: pairs of which one is curved or a half space."""
    codes = [code for code, name in enumerate(_core.shape_kinds()) if name in BY_DISTANCE]
    found: BoolArray = np.isin(world.kinds, codes)[pairs].any(axis=1)
    return found


FEW = 64  # pairs that are looked at before it is asked whether others can be earlier; from then on twice as many


Found = tuple[ContactRows, Unsupported, str]  #: and the highest tier


def first_contact_row(
    world: World, pairs: IntArray, margin: float, counts: Counter[str], find: Callable[[IntArray], Found]
) -> Found:
    """What `find` finds, but only the row with the least time, and what is unsupported of the pairs looked at.

    Pairs are taken in the order in which their boxes meet, until what is left meets later than contact is proven.
    """
    begin = entry_times(world, pairs, margin)
    order = np.argsort(begin, kind="stable")
    found = [find(pairs[:0])]
    first, done, size = np.inf, 0, FEW
    while done < len(order) and begin[order[done]] <= first + TIME_TOLERANCE:
        chosen = np.sort(order[done : done + size])
        found.append(find(pairs[chosen]))
        first = min(first, np.fmin.reduce(found[-1][0].upper, initial=np.inf))
        done, size = done + len(chosen), 2 * size
    counts["later"] += len(order) - done
    rows = ContactRows.joined([part for part, *_ in found])
    silent = rows.status == ContactStatus.UNSUPPORTED
    when = np.where(np.isnan(rows.time), np.inf, rows.time)
    if len(when) and (when < np.inf).any():
        silent[np.argmin(when)] = True
    tier = max((tier for *_, tier in found), key=(UNKNOWN, *TIERS).index)
    return rows.take(silent), Unsupported.joined([part for _, part, _ in found]), tier


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
    if near > 0.0 and accuracy not in (AUTO, "float64"):
        raise NotAvailableError(f"a margin is available at accuracy 'float64' only, not at {accuracy!r}")
    return near


def _approaches(
    world: World, pairs: IntArray, question: Question, counts: Counter[str]
) -> tuple[ContactRows, Unsupported]:
    """When bodies come as near as the margin: a ball that large is added to one of them."""
    horizon = question.horizon
    followed = followed_in_pairs(world, pairs)
    followed &= question.rotation | ~world.turns[pairs].any(axis=1)
    # Distances at rest need no looks, and the pair is near for as long as is asked.
    followed &= ~(_by_distance(world, pairs) & ~meshes(world, pairs) & at_rest(world, pairs, horizon))
    count_kinds(world, pairs[followed], counts)
    rows = [_turning_contacts(world, pairs[followed], question)] if followed.any() else []
    others = pairs[~followed]
    resting = at_rest(world, others, horizon)
    near, missing = near_at_rest(world, others[resting], horizon, counts, question.margin)
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
            speed[k] = approach(at[0], at[1], rows.normal[k]).max()
    return speed


def _rolling(world: World, pairs: IntArray) -> BoolArray:
    """(k,) bool: solids of which one is round, at different velocities."""
    flat = world.planar[pairs[:, 0]] | world.polyhedra[pairs].all(axis=1)
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


def _turning_contacts(world: World, pairs: IntArray, question: Question) -> ContactRows:
    slack = slack_of(world, pairs, question.margin)
    status, lower, upper, normal, points = ask_followed(world, pairs, question, slack)
    doubt = np.column_stack([world.uncertainty[pairs].sum(axis=1), world.velocity_uncertainty[pairs].sum(axis=1)])
    vague = np.flatnonzero(doubt.any(axis=1))
    time = lower.copy()
    if len(vague):
        slack[vague, 1:] += doubt[vague]
        may, first, last, *_ = ask_followed(world, pairs[vague], replace(question, contact_set=False), slack[vague])
        never = status[vague] == ContactStatus.NEVER
        lower[vague] = np.where(never, first, np.fmin(first, lower[vague]))
        upper[vague] = np.where(may == ContactStatus.NEVER, np.nan, np.where(never, np.inf, last))
    certain = (status != ContactStatus.TOUCHING) & (status < ContactStatus.UNSUPPORTED)
    rows = ContactRows(pairs, status, time, lower, upper, np.full(len(pairs), np.nan), normal, points, certain)
    return rows.take((status != ContactStatus.NEVER) | ~np.isnan(lower))


def ask_followed(
    world: World, pairs: IntArray, question: Question, slack: FloatArray
) -> tuple[ByteArray, FloatArray, FloatArray, FloatArray, NDArray[np.object_]]:
    """Status, lower, upper, normal and contact set, or None, from the engine.

    A contact set that is not wanted is one point.
    """
    count = len(pairs)
    status, lower, upper = np.zeros(count, np.uint8), np.zeros(count), np.zeros(count)
    normal, sets = np.zeros((count, 3)), np.empty(count, dtype=object)
    surfaces = meshes(world, pairs)
    by_distance = _by_distance(world, pairs)
    looked = by_distance & ~surfaces
    radius = _radii(world)
    # Nearest points are those of the cores; where these are closer than the radii, the surfaces meet.
    shift = np.where(by_distance, 0.0, 0.5 * (radius[pairs[:, 0]] - radius[pairs[:, 1]]))
    asked = question.horizon, question.tolerance
    if surfaces.any():
        answer = follow_meshes(
            world,
            pairs[surfaces],
            *asked,
            slack[surfaces],
            partial(_core_of, world),
            shift[surfaces] if question.contact_set else None,
        )
        status[surfaces], lower[surfaces], upper[surfaces], normal[surfaces], sets[surfaces] = answer
    if looked.any():
        status[looked], lower[looked], upper[looked], normal[looked], point = advance(
            world, pairs[looked], *asked, slack[looked]
        )
        for k, at in zip(np.flatnonzero(looked).tolist(), point, strict=True):
            sets[k] = None if np.isnan(at[0]) else at[None]
    planar, boxes = world.planar[pairs[:, 0]], world.table.boxes[world.shape[pairs]]
    motion = np.column_stack([world.twists, world.poses[:, :3]])
    motion[world.planar, 8] = 0.0
    for flat, *is_box in product((True, False), repeat=3):
        part = (planar == flat) & (boxes == is_box).all(axis=1) & ~looked & ~surfaces
        if not part.any():
            continue
        side_a, side_b = (_side(world, pairs[part, k], flat, is_box[k]) for k in range(2))
        motion_a, motion_b = (np.ascontiguousarray(motion[pairs[part, k]]) for k in range(2))
        found = _core.first_contact_turning(
            side_a,
            side_b,
            motion_a,
            motion_b,
            question.horizon,
            question.tolerance,
            slack[part],
            question.contact_set,
        )
        status[part], lower[part], upper[part] = found[:3]
        # Cores of round bodies share no surface.
        sharp = ~radius[pairs[part]].any(axis=1)
        normal[part], points, offsets = settled_at_start((side_a, side_b), found, question.contact_set, sharp)
        if not question.contact_set:
            met = ~np.isnan(found[4][:, 0])
            points, offsets = found[4][met], np.concatenate([[0], np.cumsum(met)])
        sets[part] = point_sets(points, offsets)
    for k in np.flatnonzero(shift).tolist():
        if sets[k] is not None and not isinstance(sets[k], list):
            sets[k] = sets[k] + shift[k] * np.nan_to_num(normal[k])
    return status, lower, upper, normal, sets


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


def _core_of(world: World, row: int) -> tuple[FloatArray | IntArray, ...]:
    """One solid, as the engine reads it."""
    return _side(world, np.array([row]), False, bool(world.table.boxes[world.shape[row]]))


def _radii(world: World) -> FloatArray:
    """(n,) rounding radius of spheres and capsules."""
    codes = [code for code, name in enumerate(_core.shape_kinds()) if name in ("sphere", "capsule")]
    radius: FloatArray = np.where(np.isin(world.kinds, codes), world.table.round[world.shape], 0.0)
    return radius


def slack_of(world: World, pairs: IntArray, nearness: float) -> FloatArray:
    """(k, 3) margin, uncertainty, drift of the bodies as given."""
    names, params = _core.shape_kinds(), world.table.packed.params[world.shape]
    corners = np.where(world.kinds == names.index("convex"), params[:, 0], 0.0)  # rounded ones, of a frustum
    size = np.abs(world.poses[:, :3]).sum(axis=1) + world.table.reach[world.shape]
    ends = np.where(world.kinds == names.index("capsule"), CAPSULE_ROUNDING * size, 0.0)
    looked = _by_distance(world, pairs)  # at the bodies as they are, not at cores
    margin = np.where(looked, 0.0, _radii(world)[pairs].sum(axis=1)) + nearness
    off = np.where(np.isfinite(ends), corners + ends, 0.0)[pairs].sum(axis=1) + 2.0 * ROUNDOFF * margin
    off = np.where(looked, 2.0 * ROUNDOFF * nearness, off)
    return np.column_stack([margin, off, np.zeros(len(pairs))])
