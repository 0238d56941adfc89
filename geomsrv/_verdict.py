# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""Whether an answer to a hard case is right: exact comparisons of what was said with what is true.

Pure functions over one case at a time; nothing here computes geometry.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from enum import IntEnum
from fractions import Fraction
from typing import Any

import numpy as np

from geomsrv.answers import ContactStatus, CullState, DistanceStatus
from geomsrv.errors import GeometryError, NotAvailableError
from geomsrv.hard_cases import DECIDABLE, MOVING, TIME_VERIFIED, Case, Motion, Truth, signed_square
from geomsrv.pairwise import Bodies, listed_first_contacts, world_of
from geomsrv.queries import cull, distance, distance_to_frustum, first_contact, intersects
from geomsrv.shapes import Frustum

__all__ = ["Finding", "Verdict", "judge", "judge_peer", "truth_by_engine"]

# How near a number must be to the exact one to count as right, as a share of the scene; "exact" must round correctly.
# float32 has 24 bits and loses as many of them as `DECIDABLE` grants to double.
NEAR = {"float64": DECIDABLE, "float32": Fraction(1, 2**11)}

# Subnormal numbers are this coarse; a few roundings of that much are always forgiven.
SUBNORMAL = Fraction(1, 2**1071)

# Of first contact of bodies that turn the time is asked for to this share of the window.
TURNING_TOLERANCE = 1e-9

# Distances of peers must be this good, as a share of the scene, beyond what is known of their iterations: it is the
# tolerance that they set themselves.
PEER_NEAR = Fraction(1, 10**6)


class Verdict(IntEnum):
    """From best to worst."""

    RIGHT = 0  #: certain, and right
    UNCERTAIN = 1  #: the answer does not vouch for itself, whatever it is
    WRONG = 2  #: vouched for, and wrong


@dataclass(frozen=True)
class Finding:
    """What became of one answer.

    Attributes
    ----------
    verdict : Verdict
    near : bool
        Whether the values are right, vouched for or not: yes or no as in exact arithmetic, numbers near the exact one.
    detail : str
        What was said, where that is not right.
    """

    verdict: Verdict
    near: bool
    detail: str = ""


def judge(case: Case, accuracy: str, truth: Truth | None = None) -> Finding | None:
    """Answer a case at a tier, and compare with the truth; None if the tier, a shape or a kernel is not available.

    Parameters
    ----------
    case : Case
    accuracy : str
    truth : Truth, optional
        By default the case's own.
    """
    known = truth or case.truth
    assert known is not None, f"nobody knows what {case.name} should be"
    try:
        _ = case.bodies
    except GeometryError:
        return None
    found = [finding for query in _QUERIES[case.kind] if (finding := _asked(query, case, accuracy, known))]
    return _worst(found) if found else None


def _asked(query: _Query, case: Case, accuracy: str, truth: Truth) -> Finding | None:
    try:
        parts = list(query(case, accuracy, truth))
    except NotAvailableError:
        return None
    return _worst(parts) if parts else None


def _worst(found: list[Finding]) -> Finding:
    details = "; ".join(finding.detail for finding in found if finding.detail)
    return Finding(max(f.verdict for f in found), all(f.near for f in found), details)


# ------------------------------------------------------------------------------------------------------- queries

_Query = Callable[[Case, str, Truth], Iterator[Finding]]


def _cull(case: Case, accuracy: str, truth: Truth) -> Iterator[Finding]:
    view, boxes = case.bodies[:2]
    if not isinstance(view, Frustum):
        return
    answer = cull(view, boxes, accuracy=accuracy)
    state, certain = CullState(int(answer.state[0])), bool(answer.certain[0])
    said = f"cull {state.name}{'' if certain else ', uncertain'}"
    missed = accuracy == "bound" and truth.meets is True and state == CullState.OUTSIDE
    if truth.state is not None:
        right = state == truth.state
    else:
        right = truth.meets is None or truth.meets == (state != CullState.OUTSIDE)
    yield _boolean(right, certain, missed, said)


def _distance(case: Case, accuracy: str, truth: Truth) -> Iterator[Finding]:
    deep = distance(*case.bodies, accuracy=accuracy, want=("penetration",))
    if deep.status[0] == DistanceStatus.UNSUPPORTED:
        return
    yield _number("penetration", deep, truth, accuracy)
    flat = replace(truth, low=max(truth.low, Fraction(0)), high=max(truth.high, Fraction(0)))
    yield _number("distance", distance(*case.bodies, accuracy=accuracy), flat, accuracy)


def _intersects(case: Case, accuracy: str, truth: Truth) -> Iterator[Finding]:
    answer = intersects(*case.bodies, accuracy=accuracy)
    if answer.status[0] == DistanceStatus.UNSUPPORTED:
        return
    value, certain = bool(answer.value[0]), bool(answer.certain[0])
    if truth.meets is None:
        return
    missed = accuracy == "bound" and truth.meets and not value
    yield _boolean(value == truth.meets, certain, missed, f"intersects {value}{'' if certain else ', uncertain'}")


def _point(case: Case, accuracy: str, truth: Truth) -> Iterator[Finding]:
    flat = replace(truth, low=max(truth.low, Fraction(0)), high=max(truth.high, Fraction(0)))
    answer = distance_to_frustum(case.bodies[0], [case.given["point"]], accuracy=accuracy)
    yield _number("distance", answer, flat, accuracy)
    low, high = float(answer.lower[0]), float(answer.upper[0])
    # Correctly rounded, a distance below the smallest double has a positive upper bound; 0 has none.
    certain = accuracy == "exact" or low > 0.0 or high == 0.0
    inside = high == 0.0 if accuracy == "exact" else answer.distance[0] == 0.0
    right = inside == truth.meets
    yield _boolean(right or (accuracy == "bound" and not certain), certain, False, f"in [{low!r}, {high!r}]")


def _first_contact(case: Case, accuracy: str, truth: Truth) -> Iterator[Finding]:
    assert truth.motion is not None
    given, motion = case.given, truth.motion
    a, b = case.bodies
    answer = first_contact(a, b, given["velP"], given["velQ"], t_max=given["tmax"], accuracy=accuracy)
    status = ContactStatus(int(answer.status[0]))
    if status == ContactStatus.UNSUPPORTED:
        return
    # An answer without the field vouches for nothing.
    certain = bool(answer.certain[0]) if hasattr(answer, "certain") else False
    missed = accuracy == "bound" and status == ContactStatus.NEVER != motion.status
    yield _boolean(status == motion.status, certain, missed, f"{status.name}{'' if certain else ', uncertain'}")
    if ContactStatus.NEVER in (status, motion.status):
        return
    time, low, high = (float(x[0]) for x in (answer.time, answer.time_lower, answer.time_upper))
    assert motion.time is not None
    yield _bracketed("time", time, low, high, (motion.time, motion.time), motion.time_scale, accuracy)
    if accuracy == "exact":
        last = math.inf if motion.last_time is None else _nearest(motion.last_time)
        right = answer.last_time[0] == last
        yield _boolean(right, True, False, f"last_time {answer.last_time[0]!r}, should be {last!r}")
        yield _contact_set(answer.points, motion, truth.scale)


def _turning_contact(case: Case, accuracy: str, truth: Truth) -> Iterator[Finding]:
    """First contact of bodies that turn, against times that bracket it."""
    assert truth.motion is not None
    given, motion = case.given, truth.motion
    a, b = case.bodies
    flat = case.kind == "polygon2d_turning"
    answer = first_contact(
        a,
        b,
        given["velP"],
        given["velQ"],
        t_max=given["tmax"],
        accuracy=accuracy,
        angular_velocity_a=given["angP"][2] if flat else given["angP"],
        angular_velocity_b=given["angQ"][2] if flat else given["angQ"],
        center_a=given["cenP"],
        center_b=given["cenQ"],
        tolerance=TURNING_TOLERANCE * given["tmax"],
    )
    status, certain = ContactStatus(int(answer.status[0])), bool(answer.certain[0])
    open_ended = motion.status == ContactStatus.GRAZING and status in (ContactStatus.WILL_TOUCH, ContactStatus.NEVER)
    said = f"{status.name}{'' if certain else ', uncertain'}"
    yield _boolean(status == motion.status or open_ended, certain, False, said)
    low, high = float(answer.time_lower[0]), float(answer.time_upper[0])
    if motion.status == ContactStatus.NEVER or status == ContactStatus.NEVER:
        return
    assert motion.time is not None
    yield _enclosed(low, high, motion.time, motion.time_upper)


def _time_of_impact(case: Case, accuracy: str, truth: Truth) -> Iterator[Finding]:
    """A moving field case, as a client of the scene's services asks it."""
    assert truth.motion is not None
    a, b, poses, twists = case.bodies
    world = world_of(Bodies([a, b], poses, twists))
    answer = listed_first_contacts(world, np.array([[0, 1]]), float(case.given["motion"]["tmax"]), accuracy=accuracy)
    status, expected = ContactStatus(int(answer.status[0])), truth.motion
    if status == ContactStatus.UNSUPPORTED:
        return
    certain = status not in (ContactStatus.GRAZING, ContactStatus.NOT_CONVERGED)
    if accuracy == "bound":  # but for NEVER, it only says that they may
        certain = status == ContactStatus.NEVER
    missed = accuracy == "bound" and status == ContactStatus.NEVER != expected.status
    yield _boolean(status == expected.status, certain, missed, f"{status.name}{'' if certain else ', uncertain'}")
    if expected.time is None or status == ContactStatus.NEVER:
        return
    low, high = float(answer.time_lower[0]), float(answer.time_upper[0])
    slack = TIME_VERIFIED * expected.time_scale
    yield _enclosed(low, high, expected.time - slack, expected.time + slack)


def _enclosed(low: float, high: float, begun: Fraction, by: Fraction | None) -> Finding:
    """Apart until `low`, in contact by `high`, against what is between `begun` and `by`, None: or never."""
    holds = low <= high and (by is None or Fraction(low) <= by) and (high == math.inf or begun <= Fraction(high))
    return _boolean(holds, True, False, f"time in [{low!r}, {high!r}], should be {float(begun)!r}")


def _contact_set(points: Any, motion: Motion, scale: Fraction) -> Finding:
    """Whether the corners are those of the exact set, but for the rounding of coordinates."""
    told = [tuple(map(Fraction, point)) for point in points.tolist()]
    slack = DECIDABLE * scale + Fraction(math.ulp(np.abs(points).max(initial=0.0)))

    def one_of(p: tuple[Fraction, ...], others: Iterable[tuple[Fraction, ...]]) -> bool:
        return any(all(abs(x - y) <= slack for x, y in zip(p, q, strict=True)) for q in others)

    right = all(one_of(p, told) for p in motion.contact) and all(one_of(p, motion.contact) for p in told)
    return _boolean(right, True, False, f"contact set {points.tolist()}")


_QUERIES: dict[str, tuple[_Query, ...]] = {
    "frustum_box": (_cull,),
    "frustum_box_distance": (_distance, _intersects),
    "point_frustum": (_point,),
    "box_box_distance": (_distance, _intersects),
    "polytope_distance": (_distance, _intersects),
    "polygon2d_distance": (_distance, _intersects),
    "polygon2d_moving": (_first_contact,),
    "polyhedra_moving": (_first_contact,),
    "polygon2d_turning": (_turning_contact,),
    "polyhedra_turning": (_turning_contact,),
    "signed_distance": (_distance, _intersects),
    "distance": (_distance, _intersects),
    "segment_segment": (_distance, _intersects),
    "collide": (_distance, _intersects),
    "frustum_cull": (_cull, _distance, _intersects),
    "toi": (_time_of_impact,),
    "toi_rotating": (_time_of_impact,),
}


# ------------------------------------------------------------------------------------------------------ comparing


def _boolean(right: bool, certain: bool, missed: bool, said: str) -> Finding:
    """`missed`: a bound that is wrong even if it does not vouch for itself."""
    verdict = Verdict.UNCERTAIN if not certain else Verdict.RIGHT if right else Verdict.WRONG
    if missed:
        verdict = Verdict.WRONG
    return Finding(verdict, right and not missed, "" if right and certain else said)


def _number(name: str, answer: Any, truth: Truth, accuracy: str) -> Finding:
    low, high = float(answer.lower[0]), float(answer.upper[0])
    return _bracketed(
        name, float(answer.distance[0]), low, high, (truth.low, truth.high), truth.scale, accuracy, squared=True
    )


def _bracketed(
    name: str,
    value: float,
    low: float,
    high: float,
    bounds: tuple[Fraction, Fraction],
    scale: Fraction,
    accuracy: str,
    *,
    squared: bool = False,
) -> Finding:
    """A number and its interval against exact bounds of the number, or of its signed square."""
    power = signed_square if squared else Fraction
    known = bounds[0] == bounds[1]
    near = True
    if accuracy == "exact" and known:
        near = _rounds_to(value, bounds[0], power)
    elif (share := NEAR.get(accuracy, DECIDABLE if accuracy == "exact" else None)) is not None:
        slack = share * (scale + abs(Fraction(value)) if math.isfinite(value) else 0) + SUBNORMAL
        near = (
            math.isfinite(value)
            and power(Fraction(value) - slack) <= bounds[1]
            and bounds[0] <= power(Fraction(value) + slack)
        )
    holds = low <= value <= high and _at_most(low, bounds[1], power) and not _below(high, bounds[0], power)
    narrow = accuracy != "exact" or not known or high <= math.nextafter(low, math.inf)
    if not holds or (accuracy == "exact" and not near):
        verdict = Verdict.WRONG
    else:
        verdict = Verdict.RIGHT if narrow and near else Verdict.UNCERTAIN
    said = f"{name} {value!r} in [{low!r}, {high!r}]"
    return Finding(verdict, near, "" if verdict == Verdict.RIGHT else said)


def _at_most(x: float, bound: Fraction, power: Callable[[float], Fraction]) -> bool:
    return x == -math.inf or (math.isfinite(x) and power(x) <= bound)


def _below(x: float, bound: Fraction, power: Callable[[float], Fraction]) -> bool:
    return x != math.inf and (not math.isfinite(x) or power(x) < bound)


def _rounds_to(value: float, exact: Fraction, power: Callable[[Fraction], Fraction]) -> bool:
    """Whether no other double is nearer to the number than `value`."""
    if not math.isfinite(value):
        return False
    here = Fraction(value)
    neighbours = (math.nextafter(value, -math.inf), math.nextafter(value, math.inf))
    below, above = ((here + Fraction(x)) / 2 if math.isfinite(x) else None for x in neighbours)
    return (below is None or power(below) <= exact) and (above is None or exact <= power(above))


def _nearest(x: Fraction) -> float:
    try:
        return float(x)
    except OverflowError:
        return math.inf


# ------------------------------------------------------------------------------------------------- judged otherwise


def truth_by_engine(case: Case) -> Truth | None:
    """What the exact tier says, for a case whose file does not tell; None if it has no kernel for it."""
    if case.kind in MOVING:
        return None
    try:
        answer = distance(*case.bodies, accuracy="exact", want=("penetration",))
    except NotAvailableError:
        return None
    if answer.status[0] != DistanceStatus.OK:
        return None
    low, high = float(answer.lower[0]), float(answer.upper[0])
    scale = Fraction(max(abs(low), abs(high), *_extents(case)))
    return Truth(signed_square(low), signed_square(high), scale, low > 0.0 or high < 0.0)


def _extents(case: Case) -> list[float]:
    """Sizes of what a case is made of, positions aside where they are common."""
    gaps = [np.abs(value).max() for value in _arrays(case.given)]
    return [float(x) for x in gaps]


def _arrays(value: Any) -> Iterator[Any]:
    if isinstance(value, dict):
        for item in value.values():
            yield from _arrays(item)
    elif isinstance(value, list) and value and isinstance(value[0], (dict, list)):
        for item in value:
            yield from _arrays(item)
    elif isinstance(value, (list, float, int)) and not isinstance(value, bool):
        yield np.array(value, dtype=float)


def judge_peer(contact: bool, gap: float, truth: Truth, overstates: float = 0.0) -> Finding:
    """A peer's yes or no, and its distance if it says that they are apart (NaN: not asked).

    `overstates` is forgiven on top of `PEER_NEAR`, both as a share of the scene.
    """
    if truth.meets is None or not truth.decidable:
        return Finding(Verdict.UNCERTAIN, True, "too close to call for a peer")
    said = "contact" if contact else f"apart, {gap!r}"
    if contact != truth.meets:
        return Finding(Verdict.WRONG, False, said)
    if contact or not math.isfinite(gap):
        return Finding(Verdict.RIGHT, True)
    slack = (PEER_NEAR + Fraction(overstates)) * truth.scale
    near = signed_square(Fraction(gap) - slack) <= truth.high and truth.low <= signed_square(Fraction(gap) + slack)
    return Finding(Verdict.RIGHT if near else Verdict.WRONG, near, "" if near else said)
