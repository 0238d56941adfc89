# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""First contact of bodies that translate and turn: known answers, an oracle of 150 bits, laws, and hard cases."""

from __future__ import annotations

import math
from collections import Counter
from fractions import Fraction
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from conftest import field_cases, reproducer
from numpy.typing import NDArray
from oracle import polygon
from oracle.turning import Turning, apart_until, meet_at
from scipy.spatial.transform import Rotation

import geomsrv as gs
from geomsrv import _core
from geomsrv.answers import ContactStatus

Pair = dict[str, Any]

SQUARE = [(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)]
ROD = [(-3.0, -4.0), (3.0, 4.0)]  # its ends are exactly 5 from the origin


def bodies(*vertices: Any) -> gs.Polygons | gs.Polytopes:
    """By their dimension."""
    kind = gs.Polygons if np.shape(vertices[0])[1] == 2 else gs.Polytopes
    return kind.from_list([np.asarray(v, dtype=float) for v in vertices])


def ask(pair: Pair, **options: Any) -> gs.FirstContacts:
    """`pair` holds vertices a, b, velocities va, vb, angular velocities wa, wb, and centres ca, cb."""
    return gs.first_contact(
        bodies(pair["a"]),
        bodies(pair["b"]),
        pair["va"],
        pair["vb"],
        angular_velocity_a=pair["wa"],
        angular_velocity_b=pair["wb"],
        center_a=pair["ca"],
        center_b=pair["cb"],
        **options,
    )


def still(a: Any, b: Any, wa: Any = 0.0, wb: Any = 0.0) -> Pair:
    """Bodies that only turn, about the origin."""
    zero = np.zeros(np.shape(a)[1])
    return {"a": a, "b": b, "va": zero, "vb": zero, "wa": wa, "wb": wb, "ca": zero, "cb": zero}


def judge(pair: Pair, answer: gs.FirstContacts, t_max: float, tolerance: float, most_steps: int = 3000) -> str:
    """Checks one answer against the oracle; "" if the oracle runs out of steps."""
    a, b = (Turning.of(pair[x], pair[f"v{x}"], pair[f"w{x}"], pair[f"c{x}"]) for x in "ab")
    status = ContactStatus(int(answer.status[0]))
    text = reproducer(**pair, t_max=t_max, tolerance=tolerance) + f"\n{answer}"
    if status == ContactStatus.OVERLAPPING:
        assert meet_at(a, b, Fraction(0)), text
        return status.name
    lower, upper = float(answer.time_lower[0]), float(answer.time_upper[0])
    end = Fraction(t_max if status == ContactStatus.NEVER else lower)
    apart = apart_until(a, b, end, most_steps)
    if apart < end:
        # Either it needs more steps, or the bodies meet where the engine says they are apart.
        assert not meet_at(a, b, apart + Fraction(1, 1 << 60)), text
        return ""
    if status == ContactStatus.WILL_TOUCH:
        assert lower < upper <= t_max, text
        assert upper - lower <= tolerance or upper == np.nextafter(lower, np.inf), text
        if not meet_at(a, b, Fraction(upper)):
            # Thin bodies may have passed each other until then.
            contact = apart_until(a, b, Fraction(upper), most_steps)
            assert contact < upper and any(meet_at(a, b, contact + Fraction(1, 1 << k)) for k in range(20, 120, 2)), (
                text
            )
        assert answer.time == lower and answer.certain[0], text
    return status.name


# ------------------------------------------------------------------------------------------------ known answers


@pytest.mark.parametrize("rate", [1e-3, 1.0, -2.0, 1e3])
@pytest.mark.parametrize("size", [1e-6, 1.0, 1e6])
def test_a_rod_swings_against_a_wall(rate: float, size: float) -> None:
    """The end of a rod of length 1 reaches height 1/2 after 30 degrees."""
    side = math.copysign(0.5, rate)
    pair = still(size * np.array([(-1.0, 0.0), (1.0, 0.0)]), size * np.array([(0.0, side), (2.0, side)]), wa=rate)
    tolerance = 1e-9 / abs(rate)
    answer = ask(pair, tolerance=tolerance)
    expected = math.pi / 6 / abs(rate)
    assert answer.status == gs.WILL_TOUCH and answer.certain
    assert answer.time_upper - answer.time_lower <= tolerance
    assert answer.time_lower[0] <= expected * (1 + 1e-14) and expected * (1 - 1e-14) <= answer.time_upper[0]
    assert np.allclose(answer.points, [[size * math.sqrt(0.75), size * side]], rtol=1e-8, atol=0)
    assert np.allclose(answer.normal, [[0.0, math.copysign(1.0, rate)]], atol=1e-8)
    assert np.isnan(answer.last_time).all()


def test_a_box_swings_against_a_box() -> None:
    """Edge on: a corner of a unit cube, at sqrt(1/2) from its axis, reaches a face 0.6 away."""
    cube = gs.Boxes([[0, 0, 0]], [np.eye(3)], [[0.5, 0.5, 0.5]])
    other = gs.Boxes([[1.6, 0, 0]], [np.eye(3)], [[1, 1, 1]])
    expected = math.pi / 4 - math.acos(0.6 / math.sqrt(0.5))
    for a, b in ((cube, other), (cube, corners(other)), (corners(cube), other)):
        for sign in (1, -1):
            answer = gs.first_contact(a, b, (0, 0, 0), (0, 0, 0), angular_velocity_a=(0, 0, sign), tolerance=1e-12)
            assert answer.status == gs.WILL_TOUCH
            assert abs(answer.time[0] - expected) <= 2e-12
            assert np.allclose(answer.normal, [[1, 0, 0]])
            assert np.allclose(answer.points[:, :2], [[0.6, -sign * math.sqrt(0.14)]])


def corners(boxes: gs.Boxes) -> gs.Polytopes:
    """The eight corners of every box."""
    signs = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
    arms = np.einsum("ck,nk,nkj->ncj", signs, boxes.half_extents, boxes.axes)
    return gs.Polytopes.from_list(list(boxes.center[:, None] + arms))


def test_the_default_centre() -> None:
    """That of a box; of other bodies the middle of the bounding box."""
    rng = np.random.default_rng(5)
    points = rng.normal(size=(6, 3))
    other = points + [4.0, 0.0, 0.0]
    a, b = bodies(points), bodies(other)
    middle = 0.5 * points.min(axis=0) + 0.5 * points.max(axis=0)
    motion = {"angular_velocity_a": (0, 1, 1), "t_max": 5.0}
    answers = [gs.first_contact(a, b, (1, 0, 0), (0, 0, 0), center_a=c, **motion) for c in (None, middle, points[0])]
    assert answers[0].time == answers[1].time != answers[2].time
    boxes = gs.Boxes([[1, 2, 3]], [np.eye(3)], [[0.5, 1, 2]])
    answers = [gs.first_contact(boxes, b, (1, 0, 0), (0, 0, 0), center_a=c, **motion) for c in (None, (1, 2, 3))]
    assert answers[0].status == answers[1].status


def test_in_contact_at_the_start() -> None:
    shifted = np.array(SQUARE)
    for shift, status in ((0.5, gs.OVERLAPPING), (1.0, gs.TOUCHING), (np.nextafter(1.0, 2.0), None)):
        answer = ask(still(SQUARE, shifted + [shift, 0.0], wb=1.0))
        if status is None:
            assert answer.status == gs.WILL_TOUCH and answer.time[0] < 1e-15  # its centre is the origin: it sinks in
            continue
        assert answer.status == status and answer.time == 0.0 == answer.time_lower
        assert answer.certain == (status == gs.OVERLAPPING)
        assert status == gs.TOUCHING or answer.time_upper == 0.0
    cube = gs.Boxes(np.zeros((1, 3)), [np.eye(3)], [[1, 1, 1]])
    for shift, status in ((1.0, gs.OVERLAPPING), (2.0, gs.TOUCHING)):
        other = gs.Boxes([[shift, 0, 0]], [np.eye(3)], [[1, 1, 1]])
        answer = gs.first_contact(cube, other, (0, 0, 0), (0, 0, 0), angular_velocity_b=(1, 0, 0))
        assert answer.status == status


def test_pure_rotation_ends_after_a_turn() -> None:
    """Without an end in time: what has not met after one period never will."""
    far = np.array(SQUARE) + [1.3, 0.0]
    for pair in (
        still(SQUARE, far, wa=1.0),
        still(SQUARE, far, wb=-3.0),  # about the centre of the other
        still(SQUARE, far, wa=2.0, wb=2.0),  # as one body
        {**still(SQUARE, np.array(SQUARE) * 0.4 + [1.1, 0], wa=2.0, wb=0.5)},  # about one centre
    ):
        answer = ask(pair)
        assert answer.status == gs.NEVER and answer.certain and np.isnan(answer.time[0])
    answer = ask(still(SQUARE, np.array(SQUARE) + [1.2, 0.0], wa=1.0))
    assert answer.status == gs.WILL_TOUCH
    assert answer.time[0] == pytest.approx(math.pi / 4 - math.acos(0.7 / math.sqrt(0.5)), abs=1e-6)


def test_bodies_that_fly_apart() -> None:
    away = still(SQUARE, np.array(SQUARE) + [1.45, 0.0], wa=1.0, wb=-2.0) | {"vb": [1e-3, 0.0], "cb": [1.45, 0.0]}
    away = ask(away)
    assert away.status == gs.NEVER and away.certain
    beside = ask({**still(SQUARE, np.array(SQUARE) + [9.0, 3.0], wa=1.0, wb=0.1), "va": [1.0, 0.0], "cb": [9.0, 3.0]})
    assert beside.status == gs.NEVER and beside.certain


def test_the_budget() -> None:
    """A rod and a square beside each other, a corner always coming by when the rod has gone: no end to it."""
    rod, square = [(-1.0, 0.0), (1.0, 0.0)], np.array(SQUARE) + [1.55, 0.0]
    pair = still(rod, square, wa=1.0, wb=-2.0) | {"cb": [1.55, 0.0]}
    answer = ask(pair)
    assert answer.status == ContactStatus.NOT_CONVERGED and not answer.certain
    assert answer.time_lower[0] > 100.0 and answer.time_upper == np.inf
    assert ask(pair, t_max=100.0).status == gs.NEVER
    # At equal speeds all is as it was after one turn.
    assert ask(pair | {"wb": -1.0, "b": [(1.55, -1.0), (1.55, 1.0)]}).status == gs.NEVER


# ------------------------------------------------------------------------------------------------ the hard ones


@pytest.mark.parametrize("rate", [-1.0, -1e3])
@pytest.mark.parametrize("size", [2.0**-20, 1.0, 2.0**20])
def test_grazing_is_decided_to_the_ulp(rate: float, size: float) -> None:
    """The end of the rod moves on a circle of radius 5 exactly; the wall is there, or an ulp nearer or farther."""
    expected = math.atan2(4.0, 3.0) / abs(rate)
    for wall, status in (
        (np.nextafter(5.0, 0.0), gs.WILL_TOUCH),
        (5.0, ContactStatus.GRAZING),
        (np.nextafter(5.0, 6.0), gs.NEVER),
    ):
        corner = np.array([(wall, -9.0), (wall + 1.0, -9.0), (wall + 1.0, 9.0), (wall, 9.0)])
        answer = ask(still(np.array(ROD) * size, corner * size, wa=rate), t_max=2.0, tolerance=1e-6 / abs(rate))
        assert answer.status == status, wall
        assert answer.certain == (status != ContactStatus.GRAZING)
        if status != gs.NEVER:
            # In contact for 4e-8 rad about the expected angle.
            assert abs(answer.time_lower[0] - expected) <= 1.1e-6 / abs(rate)
            assert answer.time_lower[0] <= expected * (1 + 1e-14)
            assert np.allclose(answer.points, [[5.0 * size, 0.0]], atol=6e-6 * size)


def test_points_that_meet_graze() -> None:
    """One point on another can be proven by no arithmetic that rounds."""
    answer = ask(still([(0.0, 1.0)], [(1.0, 0.0)], wb=1.0))
    assert answer.status == ContactStatus.GRAZING and not answer.certain
    assert answer.time_lower[0] <= math.pi / 2 and answer.time_lower[0] == pytest.approx(math.pi / 2, abs=1e-12)
    assert answer.time_upper == np.inf


def random_hull(rng: np.random.Generator, d: int, thinness: float = 1.0) -> np.ndarray:
    """A few points about the origin, in 2D in convex order; all but one of the sides `thinness` times as long."""
    points = rng.normal(size=(int(rng.integers(d + 1, 9)), d))
    if rng.random() < 0.5:
        points = np.array(np.meshgrid(*[[-1.0, 1.0]] * d)).reshape(d, -1).T
    points[:, 1:] *= thinness
    turn, _ = np.linalg.qr(rng.normal(size=(d, d)))
    return in_order(points @ turn.T)


def in_order(points: np.ndarray) -> np.ndarray:
    if points.shape[1] == 3:
        return points
    return np.array([[float(x) for x in p] for p in polygon.hull(points.tolist())])


def random_pair(rng: np.random.Generator, d: int, *, size: float, rate: float, thinness: float) -> Pair:
    """Two bodies on their way towards each other, that turn by about `rate` in the time they need to meet."""
    a = random_hull(rng, d) * size
    b = random_hull(rng, d, thinness) * size * 10.0 ** rng.uniform(-1, 1)
    reach = float(np.abs(a).max() + np.abs(b).max())
    way = rng.normal(size=d)
    way *= rng.uniform(1.0, 3.0) * reach / np.linalg.norm(way)
    far = rng.normal(size=d) * reach * 10.0 ** rng.integers(0, 4)
    turning = 3 if d == 3 else None
    pair = {"a": a + far, "b": b + way + far, "va": rng.normal(size=d) * reach * 0.2}
    pair["vb"] = pair["va"] - way * rng.uniform(0.3, 1.0) + rng.normal(size=d) * reach * 0.5
    pair["wa"], pair["wb"] = rng.normal(size=turning) * rate, rng.normal(size=turning) * rate * rng.integers(0, 2)
    pair["ca"] = pair["a"].mean(axis=0)
    pair["cb"] = pair["b"].mean(axis=0) + (rng.normal(size=d) * reach if rng.random() < 0.3 else 0.0)
    return pair


FAMILIES = {
    "ordinary": {"size": 1.0, "rate": 1.0, "thinness": 1.0},
    "tiny": {"size": 1e-6, "rate": 3.0, "thinness": 1.0},
    "huge": {"size": 1e6, "rate": 3.0, "thinness": 1.0},
    "slow": {"size": 1.0, "rate": 1e-6, "thinness": 1.0},
    "thin": {"size": 1.0, "rate": 5.0, "thinness": 1e-5},
    "spinning": {"size": 1.0, "rate": 100.0, "thinness": 1e-3},
}


@pytest.mark.parametrize("d", [2, 3])
@pytest.mark.parametrize("family", FAMILIES)
def test_against_the_oracle(rng: np.random.Generator, family: str, d: int) -> None:
    seen: Counter[str] = Counter()
    for _ in range(8 if family == "spinning" else 20):
        pair = random_pair(rng, d, **FAMILIES[family])
        tolerance = 10.0 ** rng.integers(-9, -2)
        seen[judge(pair, ask(pair, t_max=3.0, tolerance=tolerance), 3.0, tolerance)] += 1
    assert seen["WILL_TOUCH"] >= 2 and seen["NEVER"] >= 1, seen
    assert seen[""] <= 6 and not seen["NOT_CONVERGED"] + seen["GRAZING"] + seen["TOUCHING"], seen


@pytest.mark.parametrize("d", [2, 3])
def test_the_last_ulp_of_t_max(rng: np.random.Generator, d: int) -> None:
    """First contact lies between two neighbouring doubles: proven at the later one, excluded at the earlier one."""
    hits = 0
    for _ in range(40):
        pair = random_pair(rng, d, size=1.0, rate=2.0, thinness=1.0)
        answer = ask(pair, tolerance=1e-300)
        if answer.status != gs.WILL_TOUCH:
            continue
        hits += 1
        lower, upper = answer.time_lower[0], answer.time_upper[0]
        assert upper == np.nextafter(lower, np.inf), reproducer(**pair)
        assert ask(pair, t_max=lower).status == gs.NEVER, reproducer(**pair)
        inside = ask(pair, t_max=upper)
        assert inside.status == gs.WILL_TOUCH and inside.time_upper == upper, reproducer(**pair)
        if hits <= 5:
            assert judge(pair, answer, np.inf, 1e-6) == "WILL_TOUCH"
    assert hits >= 10


@pytest.mark.parametrize("rate", [1.0, 30.0, 1e3])
@pytest.mark.parametrize("thickness", [1e-2, 1e-6, 0.0])
def test_no_tunnelling(rate: float, thickness: float) -> None:
    """A long thin bar sweeps past a thin post once per turn, moving several times its thickness per tolerance."""
    bar = np.array([(0.0, -thickness), (10.0, -thickness), (10.0, thickness), (0.0, thickness)])
    if thickness == 0.0:
        bar = bar[[0, 1]]
    post = np.array([(8.0, 0.0), (8.0 + 1e-6, 0.0), (8.0, 1e-6)])
    for degrees in (10.0, 90.0, 359.0):
        angle = math.radians(degrees)
        turn = np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])
        pair = still(bar, post @ turn.T, wa=rate)
        for tolerance in (1e-3 / rate, 1e-7 / rate):
            answer = ask(pair, tolerance=tolerance)
            assert answer.status == gs.WILL_TOUCH
            assert answer.time_upper - answer.time_lower <= tolerance
            assert abs(answer.time[0] * rate - angle) <= thickness + 1e-6 + tolerance * rate
            assert judge(pair, answer, np.inf, tolerance) == "WILL_TOUCH"
        # As seen by the bar, the post turns.
        other = ask({**still(bar, post @ turn.T, wb=-rate)}, tolerance=1e-7 / rate)
        assert abs(other.time - answer.time) <= 2e-7 / rate


@pytest.mark.parametrize("d", [2, 3])
def test_a_spinning_box_passes_a_gap(d: int) -> None:
    """A square of diagonal 2 passes between walls as far apart, whatever it does; a hair less, and it depends."""
    half = math.sqrt(0.5)
    square = np.array([(-half, -half), (half, -half), (half, half), (-half, half)])
    if d == 3:
        square = np.array([(*p, z) for p in square for z in (-0.3, 0.3)])
    outcomes: Counter[int] = Counter()
    judged: Counter[str] = Counter()
    for rate in (0.5, 7.0, 100.0):
        for gap in (1.0 + 1e-9, 0.99, 0.9, 0.75):
            for side in (1, -1):
                wall = np.array([(-0.1, 0.0), (0.1, 0.0), (0.1, 3.0), (-0.1, 3.0)]) + [0.0, gap]
                wall = in_order(wall * [1.0, side])
                if d == 3:
                    wall = np.array([(*p, z) for p in wall for z in (-1.0, 1.0)])
                zero = np.zeros(d)
                start = np.eye(d)[0] * -3.0
                spin = rate if d == 2 else (0.0, 0.0, rate)
                pair = {"a": square + start, "b": wall, "va": np.eye(d)[0], "vb": zero}
                pair |= {"wa": spin, "wb": 0.0 if d == 2 else np.zeros(3), "ca": start, "cb": zero}
                answer = ask(pair, tolerance=1e-6)
                outcomes[int(answer.status[0])] += 1
                assert gap < 1.0 or answer.status == gs.NEVER
                assert answer.certain
                if rate < 50.0:
                    judged[judge(pair, answer, 6.0, 1e-6)] += 1
    assert outcomes[gs.NEVER] >= 8 and outcomes[gs.WILL_TOUCH] >= 8, outcomes
    assert judged["WILL_TOUCH"] >= 4 and judged["NEVER"] >= 2, judged


FLAT = {"ipc-rigid2d-point-edge", "ipc-nonlinear-point-point", "box2d-115-toi-normalised"}


@pytest.mark.parametrize("case", field_cases("toi_rotating"), ids=lambda case: case["id"])
@pytest.mark.parametrize("planar", [False, True])
def test_field_cases(case: dict[str, Any], planar: bool) -> None:
    """Where other engines missed a contact, reported one that is none, or did not end."""
    if planar and case["id"] not in FLAT:
        return
    shapes, motion = [], []
    for shape, sweep in zip(case["shapes"], case["motion"]["sweeps"], strict=True):
        points = np.array(shape["vertices"], dtype=float)
        angle = float(sweep["a0"])
        turn = np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])
        points[:, :2] = points[:, :2] @ turn.T
        start, stop = np.array(sweep["p0"], dtype=float), np.array(sweep["p1"], dtype=float)
        rate = float(sweep["a1"]) - angle
        kept = 2 if planar else 3
        shapes.append(in_order((points + start)[:, :kept]))
        motion.append(((stop - start)[:kept], rate if planar else (0.0, 0.0, rate), start[:kept]))
    (va, wa, ca), (vb, wb, cb) = motion
    pair = {"a": shapes[0], "b": shapes[1], "va": va, "vb": vb, "wa": wa, "wb": wb, "ca": ca, "cb": cb}
    answer = ask(pair, t_max=float(case["motion"]["tmax"]), tolerance=1e-9)
    expected = case["verified_value"]
    if expected is None:
        assert answer.status == gs.NEVER and answer.certain
        return
    # Points, edges and triangles in one plane can be proven to meet only where they cross.
    provable = len(shapes[0]) + len(shapes[1]) > 3 if not planar else len(shapes[0]) + len(shapes[1]) > 2
    assert answer.status == (gs.WILL_TOUCH if provable else ContactStatus.GRAZING)
    assert abs(answer.time[0] - expected) <= 1e-9 and answer.time_lower[0] <= expected + 1e-15
    assert not provable or answer.time_upper[0] >= expected


def test_any_finite_numbers(rng: np.random.Generator) -> None:
    """Whatever the magnitudes, the work is bounded and the outcome keeps its promises."""

    def numbers(*shape: int) -> np.ndarray:
        with np.errstate(over="ignore", under="ignore"):
            some = rng.normal(size=shape) * 10.0 ** rng.choice(
                [0, 0, 0, 1, -1, 5, -20, 100, -100, 290, -310], size=shape
            )
        return np.where(rng.random(shape) < 0.2, 0.0, some)

    outcomes: Counter[int] = Counter()
    for _ in range(120):
        pair: Pair = {x: numbers(int(rng.integers(1, 6)), 3) for x in "ab"}
        pair |= {f"{name}{x}": numbers(3) for x in "ab" for name in "vwc"}
        if rng.random() < 0.3:
            pair |= {"a": rng.normal(size=(4, 3)), "b": rng.normal(size=(4, 3)) + 3.0}
        pair["wa"][0] = 1.0
        t_max = float(rng.choice([0.0, 1.0, 1e-300, 1e300, np.inf]))
        tolerance = float(rng.choice([1e-6, 1e-300, 1e300, 1e-12]))
        answer = ask(pair, t_max=t_max, tolerance=tolerance)
        status, lower, upper = (x[0] for x in (answer.status, answer.time_lower, answer.time_upper))
        outcomes[int(status)] += 1
        text = reproducer(**pair, t_max=t_max, tolerance=tolerance) + f"\n{answer}"
        assert answer.cost.counts["looks"] <= 1.01 * 2**16, text
        assert np.isnan(lower) if status == gs.NEVER else 0.0 <= lower <= upper and lower <= t_max, text
        if status == gs.WILL_TOUCH:
            assert upper <= t_max and (upper - lower <= tolerance or upper == np.nextafter(lower, np.inf)), text
    assert outcomes[gs.NEVER] >= 10 and outcomes[gs.TOUCHING] + outcomes[gs.OVERLAPPING] >= 5, outcomes


# ------------------------------------------------------------------------------------------------------- laws


def dyadic(rng: np.random.Generator, d: int, rate: float = 2.0) -> Pair:
    """A pair whose numbers have few bits, so that it can be shifted without rounding."""
    pair = random_pair(rng, d, size=1.0, rate=rate, thinness=1.0)
    coarse = {key: np.round(np.asarray(value) * 2.0**20) / 2.0**20 for key, value in pair.items()}
    return coarse | {"a": in_order(coarse["a"]), "b": in_order(coarse["b"])}


def same_bits(one: gs.FirstContacts, other: gs.FirstContacts, factor: float = 1.0) -> bool:
    names = ("time", "time_lower", "time_upper")
    times = all(np.array_equal(getattr(one, n) * factor, getattr(other, n), equal_nan=True) for n in names)
    return times and np.array_equal(one.status, other.status) and np.array_equal(one.normal, other.normal, True)


@pytest.mark.parametrize("d", [2, 3])
def test_laws(rng: np.random.Generator, d: int) -> None:
    hits = 0
    for _ in range(60):
        pair = dyadic(rng, d)
        answer = ask(pair, t_max=4.0)
        text = reproducer(**pair)
        if answer.status == gs.WILL_TOUCH:
            hits += 1
        # Lengths and times by powers of two, and a common shift: the same bits.
        for k in (-20, 20):
            scaled = {x: v if x[0] == "w" else np.ldexp(v, k) for x, v in pair.items()}
            assert same_bits(answer, ask(scaled, t_max=4.0)), text
            timed = {x: np.ldexp(v, -k) if x[0] in "vw" else v for x, v in pair.items()}
            assert same_bits(answer, ask(timed, t_max=4.0 * 2.0**k, tolerance=1e-6 * 2.0**k), 2.0**k), text
        shift = np.round(rng.normal(size=d) * 2.0**10) * 2.0**-3
        moved = {x: v + shift if x in ("a", "b", "ca", "cb") else v for x, v in pair.items()}
        assert same_bits(answer, ask(moved, t_max=4.0)), text
        # Swapped: the same instant and outcome.
        swapped = ask({x[:-1] + "ba"["ab".index(x[-1])]: v for x, v in pair.items()}, t_max=4.0)
        assert swapped.status == answer.status, text
        if answer.status == gs.WILL_TOUCH:
            assert max(answer.time_lower, swapped.time_lower) <= min(answer.time_upper, swapped.time_upper), text
            assert np.allclose(swapped.normal, -answer.normal, atol=1e-4), text
        # A later end of time changes nothing before it.
        for early, late in pairwise((0.5, 1.0, 2.0, 4.0)):
            first, second = ask(pair, t_max=early), ask(pair, t_max=late)
            if first.status != gs.NEVER:
                assert first.status == second.status, text
    assert hits >= 15


@pytest.mark.parametrize("d", [2, 3])
def test_started_later(rng: np.random.Generator, d: int) -> None:
    """The bodies placed by the oracle where they are at half the time touch after the other half."""
    hits = 0
    for _ in range(40):
        pair = random_pair(rng, d, size=1.0, rate=2.0, thinness=1.0)
        answer = ask(pair, t_max=4.0)
        if answer.status != gs.WILL_TOUCH:
            continue
        hits += 1
        half = float(answer.time[0]) / 2
        later = dict(pair)
        for x in "ab":
            body = Turning.of(pair[x], pair[f"v{x}"], pair[f"w{x}"], pair[f"c{x}"])
            placed = np.array([[float(Fraction(v, 1 << 240)) for v in p] for p in body.at(Fraction(half))])
            later[x] = in_order(placed[:, :d])
            later[f"c{x}"] = pair[f"c{x}"] + half * np.asarray(pair[f"v{x}"])
        assert abs(ask(later, t_max=4.0).time[0] + half - answer.time[0]) <= 3e-6, reproducer(**pair)
    assert hits >= 4


def test_without_rotation_as_the_closed_form(rng: np.random.Generator) -> None:
    """The limit of no rotation, also at a rate so small that nothing moves."""
    outcomes: Counter[int] = Counter()
    for _ in range(200):
        pair = random_pair(rng, 2, size=1.0, rate=0.0, thinness=1.0)
        a, b = bodies(pair["a"]), bodies(pair["b"])
        expected = gs.first_contact(a, b, pair["va"], pair["vb"], t_max=3.0)
        outcomes[int(expected.status[0])] += 1
        text = reproducer(**pair)
        motion_a, motion_b = (np.array([[*pair[f"v{x}"], 0, 0, 0, 0, *pair[f"c{x}"], 0]], dtype=float) for x in "ab")
        status, lower, upper, normal, *_ = _core.first_contact_turning(
            (a.vertices, a.offsets), (b.vertices, b.offsets), motion_a, motion_b, 3.0, 1e-9, np.zeros((1, 3))
        )
        slow = ask({**pair, "wa": 1e-20}, t_max=3.0, tolerance=1e-9)
        for got, low, high in ((status, lower, upper), (slow.status, slow.time_lower, slow.time_upper)):
            assert got == expected.status, text
            if got == gs.WILL_TOUCH:
                assert low[0] <= expected.time_upper[0] + 1e-15 and expected.time_lower[0] <= high[0] + 1e-15, text
        if status == gs.WILL_TOUCH:
            assert np.allclose(normal[:, :2], expected.normal, atol=1e-6), text
    assert outcomes[gs.WILL_TOUCH] >= 50 and outcomes[gs.NEVER] >= 20


def test_planar_bodies_in_space(rng: np.random.Generator) -> None:
    """Polygons and the prisms over them, turning about the third axis, touch at the same time."""
    hits = 0
    for _ in range(50):
        flat = random_pair(rng, 2, size=1.0, rate=3.0, thinness=1.0)
        solid = {x: np.append(flat[x], 0.0) for x in ("va", "vb", "ca", "cb")}
        solid |= {x: np.array([(*p, z) for p in flat[x] for z in (-1.0, 1.0)]) for x in "ab"}
        solid |= {x: (0.0, 0.0, flat[x]) for x in ("wa", "wb")}
        one, other = ask(flat, t_max=3.0), ask(solid, t_max=3.0)
        assert one.status == other.status
        if one.status == gs.WILL_TOUCH:
            hits += 1
            assert max(one.time_lower, other.time_lower) <= min(one.time_upper, other.time_upper)
    assert hits >= 10


def test_batches(rng: np.random.Generator) -> None:
    """n against n, one against n, and one row of a motion for all give what single calls give."""
    pairs = [random_pair(rng, 3, size=1.0, rate=2.0, thinness=1.0) for _ in range(30)]
    columns = {x: [pair[x] for pair in pairs] for x in pairs[0]}
    answer = gs.first_contact(
        gs.Polytopes.from_list(columns["a"]),
        gs.Polytopes.from_list(columns["b"]),
        np.array(columns["va"]),
        np.array(columns["vb"]),
        angular_velocity_a=np.array(columns["wa"]),
        angular_velocity_b=np.array(columns["wb"]),
        center_a=np.array(columns["ca"]),
        center_b=np.array(columns["cb"]),
        t_max=3.0,
    )
    singles = [ask(pair, t_max=3.0) for pair in pairs]
    for name in ("status", "time", "time_upper", "normal"):
        assert np.array_equal(getattr(answer, name), np.concatenate([getattr(s, name) for s in singles]), True)
    assert np.array_equal(answer.points, np.concatenate([s.points for s in singles]), True)
    assert answer.cost.counts["filter"] + answer.cost.counts["wide"] == 30
    assert gs.first_contact(
        gs.Polytopes.from_list(columns["a"][:1]),
        gs.Polytopes.from_list(columns["b"]),
        (1, 0, 0),
        (0, 0, 0),
        angular_velocity_b=(0, 0, 1),
        t_max=3.0,
        contact_set=False,
    ).points.shape == (0, 3)


def with_slack(pair: Pair, slack: tuple[float, float, float], t_max: float) -> tuple[int, float, float]:
    """Status, lower and upper of a pair; slack is margin, uncertainty, drift."""
    sides = [(b.vertices, b.offsets) for b in (bodies(pair["a"]), bodies(pair["b"]))]
    d = np.shape(pair["a"])[1]
    motions = np.zeros((2, 1, 9))
    for motion, x in zip(motions, "ab", strict=True):
        motion[0, :d], motion[0, 5 if d == 2 else slice(3, 6)], motion[0, 6 : 6 + d] = (pair[k + x] for k in "vwc")
    status, lower, upper, *_ = _core.first_contact_turning(*sides, *motions, t_max, 1e-6, np.array([slack]))
    return int(status[0]), float(lower[0]), float(upper[0])


def test_margins() -> None:
    """A ball of radius 1/2 on a circle of radius 1 comes to one of radius 1 that is 2 from the middle."""
    pair = still([(1.0, 0.0, 0.0)], [(0.0, 2.0, 0.0)], wa=np.array([0.0, 0.0, 1.0]), wb=np.zeros(3))
    expected = math.asin((5.0 - 1.5**2) / 4.0)
    status, lower, upper = with_slack(pair, (1.5, 0.0, 0.0), 9.0)
    assert status == gs.WILL_TOUCH and lower <= expected <= upper <= lower + 1e-6
    assert with_slack(pair, (0.999999, 0.0, 0.0), np.inf)[0] == gs.NEVER
    assert with_slack(pair, (1.0, 0.0, 0.0), 9.0)[0] == ContactStatus.GRAZING
    for margin, status in ((2.0, gs.WILL_TOUCH), (2.3, gs.OVERLAPPING), (50.0, gs.OVERLAPPING)):
        assert with_slack(pair, (margin, 0.0, 0.0), 9.0)[0] == status
    # Far apart, and no faster than the sum of what is known and what is not.
    apart = pair | {"b": [(0.0, 100.0, 0.0)], "cb": np.array([0.0, 100.0, 0.0])}
    assert with_slack(apart, (1.5, 0.0, 0.0), 1e6)[0] == gs.NEVER
    status, lower, upper = with_slack(apart, (1.5, 0.0, 1.0), 1e6)
    assert status == ContactStatus.GRAZING and 97.5 <= lower <= 99.5 and upper == np.inf


def test_bodies_within_their_uncertainty(rng: np.random.Generator) -> None:
    """Shifted and given other velocities by no more than was said, they touch when was said."""
    outcomes: Counter[int] = Counter()
    inside = 0
    for _ in range(60):
        pair = random_pair(rng, 3, size=1.0, rate=2.0, thinness=1.0)
        off, drift = 10.0 ** rng.uniform(-4, -1), 10.0 ** rng.uniform(-4, -1)
        status, lower, upper = with_slack(pair, (0.0, off, drift), 3.0)
        outcomes[status] += 1
        for _ in range(8):
            shift, push = rng.normal(size=(2, 3))
            shift *= off * rng.uniform(0, 1) / np.linalg.norm(shift)
            push *= drift * rng.uniform(0, 1) / np.linalg.norm(push)
            real = pair | {"a": pair["a"] + shift, "ca": pair["ca"] + shift, "va": pair["va"] + push}
            answer = ask(real, t_max=3.0)
            text = reproducer(**real, off=off, drift=drift) + f"{status} {lower} {upper} {answer}"
            if answer.status == gs.NEVER:
                assert status in (gs.NEVER, ContactStatus.GRAZING, gs.TOUCHING) and not upper <= 3.0, text
            elif answer.status == gs.WILL_TOUCH:
                assert status != gs.NEVER and lower <= answer.time_upper <= 3.0 and answer.time_lower <= upper, text
                inside += upper < np.inf
            else:
                assert lower == 0.0, text
    assert outcomes[gs.NEVER] >= 5 and outcomes[ContactStatus.GRAZING] >= 5 and inside >= 50, (outcomes, inside)


LATE = 0.1  #: of the time in which contact is uncertain


@pytest.mark.parametrize("spin", [0.0, 1e-3])
@pytest.mark.parametrize("off", [1e-4, 0.05, 0.4])
@pytest.mark.parametrize("dimension", [2, 3])
def test_contact_of_faces_that_meet_squarely_is_proven_once_they_are_deep_enough(
    dimension: int, off: float, spin: float
) -> None:
    """A cube of 1 m, 1 m before a wall that is 1 m thick: between (1 - off) / 2 and (1 + off) / 2 seconds at 2 m/s."""
    cube = np.array(SQUARE) if dimension == 2 else np.array([(*p, z) for p in SQUARE for z in (-0.5, 0.5)])
    wall = cube * [1.0, 6.0, 6.0][:dimension] + [2.0, 0.0, 0.0][:dimension]
    zero, push = np.zeros(dimension), np.array([2.0, 0.0, 0.0][:dimension])
    turn: Any = spin if dimension == 2 else np.array([0.0, 0.0, spin])
    pair = {"a": cube, "va": push, "wa": turn, "ca": zero, "b": wall, "vb": zero, "wb": 0.0 * turn, "cb": zero}
    status, lower, upper = with_slack(pair, (0.0, off, 0.0), 9.0)
    corner = 0.5 * spin  # a face that has turned leans by so much where it meets the wall
    assert status == ContactStatus.GRAZING
    assert 0.5 * (1.0 - off - corner) - 1e-6 <= lower <= 0.5 * (1.0 - off) + 1e-12
    assert 0.5 * (1.0 + off - corner) <= upper <= 0.5 * (1.0 + off + corner) + LATE * off
    # The longer way round: the cube is a whole metre inside at most.
    assert with_slack(pair, (0.0, 1.1, 0.0), 9.0)[2] == np.inf
    # It is over before it can be proven, or just not.
    assert not with_slack(pair, (0.0, off, 0.0), 0.5 * (1.0 + off - 2.0 * corner) - 1e-9)[2] < np.inf
    assert with_slack(pair, (0.0, off, 0.0), 0.5 * (1.0 + off + 2.0 * corner) + 1e-9)[2] < np.inf


def test_contact_of_balls_is_proven_once_they_are_deep_enough() -> None:
    """1/4 and 1/2 in radius, 4 apart, at 0.5 m/s; the drift of 0.05 m/s counts from the start."""
    zero = np.zeros(3)
    pair = {"a": [(0, 0, 0)], "va": np.array([0.5, 0, 0]), "wa": np.array([0, 0, 0.1]), "ca": zero}
    pair |= {"b": [(4, 0, 0)], "vb": zero, "wb": zero, "cb": zero}
    for off, drift in ((0.1, 0.0), (0.1, 0.05), (0.7, 0.0)):
        status, lower, upper = with_slack(pair, (0.75, off, drift), 20.0)
        first, last = (3.25 - off) / (0.5 + drift), (3.25 + off) / (0.5 - drift)
        assert status == ContactStatus.GRAZING and first - 1e-6 <= lower <= first
        assert last - 1e-12 <= upper <= last + LATE * (last - first)
    assert with_slack(pair, (0.75, 0.8, 0.0), 20.0)[2] == np.inf
    # Deeper than that at the start, or not; at no speed, too.
    near = pair | {"b": [(0.6, 0, 0)]}
    for moving in (near, near | {"va": zero}):
        assert with_slack(moving, (0.75, 0.14, 0.0), 20.0) == (gs.OVERLAPPING, 0.0, 0.0)
    status, lower, upper = with_slack(near, (0.75, 0.16, 0.0), 20.0)
    assert status == gs.TOUCHING and lower == 0.0 and 0.02 - 1e-12 <= upper <= 0.02 * (1.0 + LATE)
    assert with_slack(near | {"va": zero}, (0.75, 0.16, 0.0), 20.0) == (gs.TOUCHING, 0.0, np.inf)


def depth_at(pair: Pair, when: NDArray[np.float64]) -> NDArray[np.float64]:
    """How deep the bodies overlap at some times, in the kernel for bodies at rest."""
    placed = []
    for x in "ab":
        arms, turn = pair[x] - pair[f"c{x}"], Rotation.from_rotvec(np.outer(when, pair[f"w{x}"]))
        middle = pair[f"c{x}"] + np.outer(when, pair[f"v{x}"])
        rows = middle[:, None] + np.einsum("tij,kj->tki", turn.as_matrix(), arms)
        placed.append(gs.Polytopes.from_list(list(rows)))
    return -gs.distance(*placed, want=("penetration",)).distance


def test_contact_is_proven_wherever_bodies_overlap_by_more_than_their_uncertainty(rng: np.random.Generator) -> None:
    """Overlapping so deep then, soon after they do for the first time."""
    outcomes: Counter[str] = Counter()
    for _ in range(120):
        pair = random_pair(rng, 3, size=1.0, rate=2.0, thinness=1.0)
        off = 10.0 ** rng.uniform(-3, 1)
        status, lower, upper = with_slack(pair, (0.0, off, 0.0), 3.0)
        if status not in (ContactStatus.GRAZING, gs.TOUCHING):
            continue
        when = np.linspace(lower, 3.0, 2001)
        depth = depth_at(pair, when)
        text = reproducer(**pair, off=off) + f"{status} {lower} {upper} {depth.max()}"
        deep = when[depth > off + 1e-9]
        outcomes["deep" if len(deep) else "never deep"] += 1
        if upper < np.inf:
            assert depth_at(pair, np.array([upper]))[0] > off - 1e-9, text
        outcomes["late"] += int(len(deep) > 0 and upper > deep[0] + LATE * (deep[0] - lower))
    assert min(outcomes["deep"], outcomes["never deep"]) >= 10, outcomes
    # Bodies may be deep enough just for a moment between two looks.
    assert 10 * outcomes["late"] <= outcomes["deep"], outcomes


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"angular_velocity_a": (1, 2)}, "angular_velocity_a must have shape"),
        ({"angular_velocity_b": np.ones((2, 3))}, r"angular_velocity_b must have shape \(3,\) or \(1, 3\)"),
        ({"angular_velocity_a": (1, 2, np.nan)}, r"angular_velocity_a\[2\] is nan"),
        ({"center_a": (1, 2)}, "center_a must have shape"),
        ({"center_b": (1, 2, np.inf)}, r"center_b\[2\] is inf"),
        ({"tolerance": 0.0}, "tolerance must be > 0"),
        ({"tolerance": np.nan}, "tolerance is nan"),
        ({"t_max": -1.0}, "t_max must be >= 0"),
        ({"accuracy": "exact"}, "accuracy='exact' is not available for bodies that turn"),
        ({"certificates": True}, "certificates are not available for bodies that turn"),
        ({"b": gs.Polygons.from_list([SQUARE])}, "b must be Boxes or Polytopes, got Polygons"),
        ({"a": gs.Sphere(1.0)}, "a must be Boxes or Polygons or Polytopes, got Sphere"),
        ({"angular_velocity_a": "fast"}, "angular_velocity_a must hold real numbers"),
    ],
)
def test_refused_by_name(changes: dict[str, Any], message: str) -> None:
    tetrahedron = bodies([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)])
    call: dict[str, Any] = {"a": tetrahedron, "b": tetrahedron, "velocity_a": (1, 0, 0), "velocity_b": (0, 0, 0)}
    with pytest.raises(gs.GeometryError, match=message):
        gs.first_contact(**(call | {"angular_velocity_a": (0, 0, 1)} | changes))


def test_the_engine_copies_nothing() -> None:
    boxes = (np.zeros((2, 3)), np.array([np.eye(3)] * 2), np.ones((2, 3)))
    hulls = (np.zeros((2, 3)), np.array([0, 1, 2]))
    motion = np.zeros((1, 9))
    for side in (boxes, hulls):
        assert _core.first_contact_turning(side, boxes, motion, motion, 1.0, 1e-6, np.zeros((1, 3)))[0].tolist() == [
            3,
            3,
        ]
        for i, array in enumerate(side):
            for other in (array.astype(np.float32), np.repeat(array, 2, axis=0)[::2], None):
                with pytest.raises(TypeError, match="turning: bodies must be"):
                    _core.first_contact_turning(
                        (*side[:i], other, *side[i + 1 :]), boxes, motion, motion, 1.0, 1e-6, np.zeros((1, 3))
                    )
    for other in (motion.astype(np.float32), np.zeros((1, 8)), np.zeros((2, 18))[:, ::2]):
        with pytest.raises(TypeError, match="incompatible function arguments"):
            _core.first_contact_turning(boxes, boxes, other, motion, 1.0, 1e-6, np.zeros((1, 3)))


def test_no_rotation_is_not_asked_for() -> None:
    """Angular velocities that are zero leave the closed form to answer, at every tier."""
    a, b = bodies(SQUARE), bodies(np.array(SQUARE) + [3.0, 0.0])
    answer = gs.first_contact(a, b, (1, 0), (0, 0), angular_velocity_a=0.0, accuracy="exact")
    assert answer.time == 2.0 and answer.last_time == 4.0
