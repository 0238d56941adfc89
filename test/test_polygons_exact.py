# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""Polygons at every tier: what exact arithmetic says at "exact", and nothing that it denies at the others."""

from __future__ import annotations

import math
from collections import Counter
from fractions import Fraction

import numpy as np
import pytest
from conftest import hard_cases, reproducer
from contact_answers import STATUS, points_of
from oracle import polygon as exact
from oracle.vectors import compare_root, dot, nearest_double, root_double, squared_norm, sub
from polygon_scenes import SQUARE, Turn, hull, polygons, random_ring, shifted, slender_pair

import geomsrv as gs

INF = math.inf
NUMBERS = ("status", "time", "time_lower", "time_upper", "last_time")


def floats(ring):
    return [tuple(map(float, v)) for v in ring]


def contacts(scenes, accuracy="exact", **options):
    """One batch of (a, velocity_a, b, velocity_b, t_max); they must agree in t_max."""
    (t_max,) = {scene[4] for scene in scenes}
    a, b = polygons(*(s[0] for s in scenes)), polygons(*(s[2] for s in scenes))
    velocities = (np.array([s[k] for s in scenes], float).reshape(-1, 2) for k in (1, 3))
    return gs.first_contact(a, b, *velocities, t_max=t_max, accuracy=accuracy, **options)


# ------------------------------------------------------------------------------------------ the exact answers


def is_rounded(value, lower, upper, exactly):
    """Whether `value` is nearest to the exact number and the bounds are the doubles around it."""
    below, above = nearest_double(exactly), nearest_double(exactly)
    if math.isfinite(below) and Fraction(below) > exactly:
        below = math.nextafter(below, -INF)
    elif below == INF:
        below = math.nextafter(INF, 0.0)
    if math.isfinite(above) and Fraction(above) < exactly:
        above = math.nextafter(above, INF)
    return (float(lower), float(value), float(upper)) == (below, nearest_double(exactly), above)


def unit(n):
    """A direction, correctly rounded."""
    square = squared_norm(n)
    return [root_double(Fraction(c * c) / square) * (1 if c > 0 else -1) for c in n]


def normals(a, b, velocity, time):
    """Of the constraints a - b that are closed at `time`: outward directions and signed squared closing speeds.

    They are all that hold with equality, in the order of the exact ring.
    """
    found = []
    for n, d in exact.constraints(exact.difference(a, b)):
        if time * dot(n, velocity) == d:
            speed = -dot(n, velocity)
            found.append((n, Fraction(speed * abs(speed)) / squared_norm(n)))
    return found


def check_contact(answer, i, scene):
    """Everything the exact tier promises; returns the exact answer."""
    a, velocity_a, b, velocity_b, t_max = scene
    given = reproducer(a=a, velocity_a=velocity_a, b=b, velocity_b=velocity_b, t_max=t_max)
    truth = exact.first_contact(a, velocity_a, b, velocity_b, t_max)
    assert answer.status[i] == STATUS[truth.status], given
    assert answer.certain[i], given
    points, normal = points_of(answer, i), [float(c) for c in answer.normal[i]]
    if truth.status == "NEVER":
        numbers = (answer.time[i], answer.time_lower[i], answer.time_upper[i], answer.last_time[i], *normal)
        assert np.isnan(numbers).all() and len(points) == 0, given
        return truth
    assert is_rounded(answer.time[i], answer.time_lower[i], answer.time_upper[i], truth.time), given
    last = INF if truth.last_time is None else nearest_double(truth.last_time)
    assert answer.last_time[i] == last, given
    corners = [[nearest_double(c) for c in p] for p in truth.contact]
    assert sorted(points.tolist()) == sorted(corners), given
    if truth.status == "OVERLAPPING":
        assert np.isnan(normal).all(), given
        check_order(points.tolist(), corners, given)
        return truth
    velocity = sub(exact.exact(velocity_b), exact.exact(velocity_a))
    fastest = max(speed for _, speed in normals(a, b, velocity, truth.time))
    expected = [unit(n) for n, speed in normals(a, b, velocity, truth.time) if speed == fastest]
    assert any(all(abs(x - y) <= 2.0**-52 * abs(y) for x, y in zip(normal, n, strict=True)) for n in expected), given
    if len(points) == 2:  # counter-clockwise around a
        way = sub(truth.contact[0], truth.contact[1])
        along = dot(way, (-Fraction(normal[1]), Fraction(normal[0])))
        first = truth.contact[0] if along < 0 else truth.contact[1]
        assert points[0].tolist() == [nearest_double(c) for c in first] or along == 0, given
    return truth


def check_order(points, corners, given):
    """Polygons run counter-clockwise from the lowest corner; the oracle's rings start at the leftmost."""
    if len(points) < 3:
        assert points == sorted(points), given
        return
    start = corners.index(points[0])
    turned = corners[start:] + corners[:start]
    assert points == turned or len({tuple(p) for p in points}) < len(points), given
    assert points[0][1] == min(p[1] for p in points), given


def check_distance(answer, i, a, b, penetration=True):
    """Everything the exact tier promises; returns the exact signed square."""
    given = reproducer(a=a, b=b)
    truth = exact.separation(a, b).signed_square
    if not penetration:
        truth = max(truth, Fraction(0))
    lower, gap, upper = (float(x[i]) for x in (answer.lower, answer.distance, answer.upper))
    assert gap == root_double(abs(truth)) * (1 if truth >= 0 else -1), given
    assert compare_root(lower, truth) <= 0 <= compare_root(upper, truth), given
    assert upper == lower or (upper == math.nextafter(lower, INF) and compare_root(gap, truth) != 0), given
    return truth


def check_witnesses(answer, i, a, b):
    """Points are on the polygons and as far apart as the distance says, up to the rounding of their coordinates."""
    given = reproducer(a=a, b=b)
    size = Fraction(max(abs(c) for ring in (a, b) for v in ring for c in v))
    off = size * Fraction(2.0**-52) + Fraction(5e-324)
    gap, normal = float(answer.distance[i]), answer.normal[i].tolist()
    point_a, point_b = ([Fraction(c) for c in p[i].tolist()] for p in (answer.point_a, answer.point_b))
    for point, ring in ((point_a, a), (point_b, b)):
        assert exact.separation([tuple(point)], ring).signed_square <= off**2, given
    assert abs(math.hypot(*normal) - 1.0) <= 2.0**-52, given
    for p, q, n in zip(point_a, point_b, normal, strict=True):
        assert abs(q - p - Fraction(gap) * Fraction(n)) <= 2 * off, given


def hexes(value):
    return [tuple(float.fromhex(c) for c in v) for v in value]


@pytest.mark.parametrize("case", hard_cases("polygon2d_moving"), ids=lambda case: case["id"])
def test_hard_case_of_moving_polygons(case):
    values, expected = case["input"], case["answer"]
    velocities = [tuple(float.fromhex(c) for c in values[k]) for k in ("velP", "velQ")]
    scene = (hexes(values["P"]), velocities[0], hexes(values["Q"]), velocities[1], float.fromhex(values["tmax"]))
    answer = contacts([scene])
    check_contact(answer, 0, scene)
    assert (answer.status[0] != gs.NEVER) == expected["hits"]
    if expected["hits"]:
        assert answer.time[0] == nearest_double(Fraction(expected["time"]))
        assert answer.last_time[0] == nearest_double(Fraction(expected["last_time"]))
        corners = [[nearest_double(Fraction(c)) for c in p] for p in expected["contact"]]
        assert sorted(answer.points.tolist()) == sorted(corners)
    lean = contacts([scene], contact_set=False)
    for name in (*NUMBERS, "normal"):
        np.testing.assert_array_equal(getattr(lean, name), getattr(answer, name))
    assert len(lean.points) == 0


@pytest.mark.parametrize("case", hard_cases("polygon2d_distance"), ids=lambda case: case["id"])
def test_hard_case_of_distance(case):
    a, b = hexes(case["input"]["P"]), hexes(case["input"]["Q"])
    signed = gs.distance(polygons(a), polygons(b), accuracy="exact", want=("penetration",))
    check_distance(signed, 0, a, b)
    check_witnesses(signed, 0, a, b)
    plain = gs.distance(polygons(a), polygons(b), accuracy="exact")
    check_distance(plain, 0, a, b, penetration=False)
    answer = gs.intersects(polygons(a), polygons(b), accuracy="exact")
    assert answer.certain[0] and answer.value[0] == case["answer"]["intersects"]
    assert float(plain.distance[0]) == float.fromhex(case["answer"]["dist"])


# ------------------------------------------------------------------------------------------------ random scenes


def nudged(rng, ring):
    """Some coordinates a few units in the last place off."""
    steps = rng.integers(-2, 3, (len(ring), 2)) * (rng.random((len(ring), 2)) < 0.3)
    points = np.array(ring, float)
    return hull(points + steps * np.spacing(np.abs(points)))


def integer_scene(rng, size):
    """Mostly on collision course; some touch at a vertex or along a side, now or at a whole time."""
    a, b = random_ring(rng, size), random_ring(rng, size)
    velocity_a, velocity_b = (tuple(int(c) for c in v) for v in rng.integers(-2, 3, (2, 2)))
    offset = rng.integers(-3 * size, 3 * size + 1, 2)
    if rng.random() < 0.5:
        velocity_a = tuple(int(c) for c in np.sign(offset) * rng.integers(1, 3))
    if rng.random() < 0.4:
        # Reflected in a vertex or in the middle of a side, it touches there.
        i, later = int(rng.integers(len(a))), int(rng.integers(-1, 3))
        j = (i + int(rng.integers(2))) % len(a)
        b = [(a[i][0] + a[j][0] - x, a[i][1] + a[j][1] - y) for x, y in a]
        offset = [later * (velocity_a[k] - velocity_b[k]) for k in range(2)]
    return floats(a), velocity_a, floats(shifted(b, *(int(c) for c in offset))), velocity_b


def turned_scene(rng, size, shift):
    """The same, rotated and shifted in float64: what touched misses or overlaps by rounding errors."""
    a, velocity_a, b, velocity_b = integer_scene(rng, size)
    turn = Turn(rng, shift)
    return (
        hull(turn.ring(a)), tuple(turn.vector(velocity_a).tolist()),
        hull(turn.ring(b)), tuple(turn.vector(velocity_b).tolist()),
    )  # fmt: skip


def slender_scene(rng):
    a, b, along = slender_pair(rng)
    apart = np.mean(a, axis=0) - np.mean(b, axis=0)
    velocity = rng.choice([1.0, -1.0]) * along
    if rng.random() < 0.7:
        velocity = apart * rng.uniform(0.1, 2.0) + rng.normal(size=2) * 10.0 ** -rng.integers(0, 16)
    if rng.random() < 0.5:
        b = hull(np.array(b) - rng.uniform(0, 3) * velocity)
    return a, (0.0, 0.0), b, tuple(velocity.tolist())


def scaled(scene, length, speed, t_max):
    """In units of 2**length and 2**(length - speed) seconds."""
    a, velocity_a, b, velocity_b = scene
    rings = ([tuple(math.ldexp(c, length) for c in v) for v in ring] for ring in (a, b))
    velocities = (tuple(math.ldexp(float(c), speed) for c in v) for v in (velocity_a, velocity_b))
    (a, b), (velocity_a, velocity_b) = rings, velocities
    return a, velocity_a, b, velocity_b, math.ldexp(t_max, length - speed) if math.isfinite(t_max) else t_max


SCENES = {
    "small integers": lambda rng: integer_scene(rng, 2),
    "integers": lambda rng: integer_scene(rng, 12),
    "large integers": lambda rng: integer_scene(rng, 2**40),
    "turned": lambda rng: turned_scene(rng, 4, 10.0),
    "turned, far away": lambda rng: turned_scene(rng, 3, 1e6),
    "nudged": lambda rng: (lambda a, v, b, w: (nudged(rng, a), v, nudged(rng, b), w))(*integer_scene(rng, 3)),
    "slender": slender_scene,
}
SCALES = [(0, 0), (-1000, -1000), (-990, 0), (985, 0), (985, 985), (300, -300), (0, -990), (-400, 500)]


@pytest.mark.parametrize("kind", SCENES)
def test_against_the_oracle(rng, kind):
    """Status, times, normals and contact sets; t_max is nothing, in between, or exactly a time of contact."""
    reached = Counter()
    for t_max in (INF, 2.0, 0.0):
        scenes = [(*SCENES[kind](rng), t_max) for _ in range(120)]
        answer = contacts(scenes)
        reached.update(answer.cost.counts)
        assert sum(answer.cost.counts.values()) == len(scenes)
        for i, scene in enumerate(scenes):
            truth = check_contact(answer, i, scene)
            reached[truth.status] += 1
            reached["grazing"] += truth.time is not None and truth.time == truth.last_time and truth.time > 0
            reached["at t_max"] += truth.status == "WILL_TOUCH" and truth.time == Fraction(min(t_max, 1e9))
            reached["segment"] += len(truth.contact) == 2
            reached["near"] += truth.time is not None and 0 < truth.time < 1e-12
    assert min(reached[k] for k in ("NEVER", "WILL_TOUCH", "wide", "filter")) >= 10, reached
    if "integers" in kind:
        assert min(reached[k] for k in ("TOUCHING", "OVERLAPPING", "at t_max", "segment", "exact")) >= 3, reached
    if kind == "small integers":
        assert reached["grazing"] >= 3, reached
    if kind in ("turned", "nudged", "slender"):
        assert reached["near"] >= 1, reached


@pytest.mark.parametrize(("length", "speed"), SCALES)
def test_at_every_scale(rng, length, speed):
    scenes = []
    for kind in ("small integers", "turned", "slender", "nudged"):
        scenes += [scaled(SCENES[kind](rng), length, speed, INF) for _ in range(25)]
    answer = contacts(scenes)
    for i, scene in enumerate(scenes):
        check_contact(answer, i, scene)
    signed = gs.distance(polygons(*(s[0] for s in scenes)), polygons(*(s[2] for s in scenes)), accuracy="exact",
                         want=("penetration",))  # fmt: skip
    for i, (a, _, b, _, _) in enumerate(scenes):
        check_distance(signed, i, a, b)
        check_witnesses(signed, i, a, b)


@pytest.mark.parametrize("kind", SCENES)
def test_distance_against_the_oracle(rng, kind):
    pairs = [(a, b) for a, _, b, _ in (SCENES[kind](rng) for _ in range(250))]
    a, b = polygons(*(a for a, _ in pairs)), polygons(*(b for _, b in pairs))
    signed = gs.distance(a, b, accuracy="exact", want=("penetration",))
    plain = gs.distance(a, b, accuracy="exact")
    meet = gs.intersects(a, b, accuracy="exact")
    assert meet.certain.all()
    reached = Counter()
    for i, pair in enumerate(pairs):
        truth = check_distance(signed, i, *pair)
        check_distance(plain, i, *pair, penetration=False)
        check_witnesses(signed, i, *pair)
        assert meet.value[i] == (truth <= 0), reproducer(a=pair[0], b=pair[1])
        if truth < 0:
            common = tuple(plain.point_a[i].tolist())
            size = Fraction(max(abs(c) for ring in pair for v in ring for c in v))
            assert (plain.point_a[i] == plain.point_b[i]).all()
            assert all(exact.separation([common], ring).signed_square <= (size * Fraction(2.0**-50)) ** 2
                       for ring in pair)  # fmt: skip
        reached[(truth > 0) - (truth < 0)] += 1
        reached["near"] += 0 < abs(truth) < 1e-24
    assert min(reached[1], reached[-1]) >= 20, reached
    assert reached[0] >= (10 if "integers" in kind else 0), reached


def mixed_scene(rng):
    rings = []
    for _ in range(2):
        size = 2.0 ** rng.integers(-1074, 900)
        center = rng.normal(size=2) * 2.0 ** rng.integers(-1074, 900) * rng.integers(0, 2)
        rings.append(hull(center + size * rng.integers(-8, 9, (int(rng.integers(1, 6)), 2))))
    a, b = rings
    velocity = tuple((rng.normal(size=2) * 2.0 ** rng.integers(-1074, 900)).tolist())
    if rng.random() < 0.5:
        velocity = tuple(0.25 * (x - y) for x, y in zip(a[0], b[0], strict=True))
    return a, (0.0, 0.0), b, velocity


def test_mixed_magnitudes(rng):
    """Rings that are far smaller than the pair, and coordinates down to the smallest double."""
    for _ in range(150):
        scene = (*mixed_scene(rng), INF)
        a, _, b, _, _ = scene
        signed = gs.distance(polygons(a), polygons(b), accuracy="exact", want=("penetration",))
        check_distance(signed, 0, a, b)
        check_witnesses(signed, 0, a, b)
        check_contact(contacts([scene]), 0, scene)


def on_a_line(rng, where):
    """Triangles above and below a line through the origin; a corner of the lower one is exactly on it.

    Numbers along the line have 26 bits or so, 2^54 times larger at one end than at the other: their differences have
    about 100 bits, and the products of these no longer fit into double-double.
    """
    step = np.array([3.0, 5.0]) if rng.random() < 0.5 else np.array([7.0, 11.0])
    small, middle, large = (float(rng.integers(2**45, 2**46)) * scale for scale in (2.0**-54, 2.0**-27, 1.0))
    first, corner, last = sorted((small, middle, large)) if where == "inside" else (middle, small, large)
    up = np.array([-step[1], step[0]]) * large
    return (
        [tuple(first * step), tuple(last * step), tuple(last * step + up)],
        (1.0, 0.25),
        [tuple(corner * step), tuple(last * step - 2 * up), tuple(2 * last * step - up)],
        (0.0, 0.0),
        INF,
    )


@pytest.mark.parametrize("where", ["inside", "before"])
def test_products_beyond_double_double(rng, where):
    """Three points on a line, known to be on it by exact sums alone."""
    scenes = [on_a_line(rng, where) for _ in range(100)]
    answer = contacts(scenes)
    found = Counter(check_contact(answer, i, scene).status for i, scene in enumerate(scenes))
    assert found["TOUCHING" if where == "inside" else "WILL_TOUCH"] > 90, found


def test_differences_beyond_the_doubles():
    big = 1.7e308
    a = [(-big, 0.0), (-big / 2, 0.0), (-big / 2, big / 4), (-big, big / 4)]
    b = [(big / 2, 0.0), (big, 0.0), (big, big / 4), (big / 2, big / 4)]
    scene = (a, (big / 4, 0.0), b, (-big / 4, 0.0), INF)
    check_contact(contacts([scene]), 0, scene)
    answer = gs.distance(polygons(a), polygons(b), accuracy="exact")
    assert (answer.lower[0], answer.distance[0]) == (big, big)
    corners = gs.distance(polygons([(-big, -big)]), polygons([(big, big)]), accuracy="exact")
    assert (corners.lower[0], corners.distance[0]) == (math.nextafter(INF, 0.0), INF)


def test_times_beyond_the_doubles_are_times():
    """Contact some time is contact: the time is rounded to infinity, its lower bound is the largest double."""
    scene = (SQUARE, (0.0, 0.0), shifted(SQUARE, 3, 0), (-5e-324, 0.0), INF)
    answer = contacts([scene])
    check_contact(answer, 0, scene)
    assert (answer.status[0], answer.time[0]) == (gs.WILL_TOUCH, INF)
    assert contacts([(*scene[:4], math.nextafter(INF, 0.0))]).status[0] == gs.NEVER


def large_scenes(rng, counts=((40, 33), (90, 12))):
    for count_a, count_b in counts:
        rings = [
            hull(
                np.array([(3 * math.cos(t), 2 * math.sin(t)) for t in 2 * math.pi * (np.arange(n) + rng.random()) / n])
            )
            for n in (count_a, count_b)
        ]
        for offset, velocity in (((9.0, 1.0), (-1.0, 0.1)), ((5.9, 0.0), (-1.0, 0.1)), ((0.5, 0.25), (1.0, 2.0))):
            yield rings[0], (0.0, 0.0), floats(shifted(rings[1], *offset)), velocity, INF


def test_large_polygons(rng):
    """Beyond some size supports are found by walking."""
    for scene in large_scenes(rng):
        check_contact(contacts([scene]), 0, scene)
        signed = gs.distance(polygons(scene[0]), polygons(scene[2]), accuracy="exact", want=("penetration",))
        check_distance(signed, 0, scene[0], scene[2])


@pytest.mark.parametrize("tilt", [2.0**-k for k in (1, 20, 40, 50, 52)])
def test_contact_has_no_slack(tilt):
    """One step of the last place decides: a miss is a miss, and nearly parallel sides meet in one point."""
    b = shifted(SQUARE, 3.0, 1.0)
    assert contacts([(SQUARE, (0, 0), b, (-1.0, 0.0), INF)]).status[0] == gs.WILL_TOUCH
    scene = (SQUARE, (0, 0), b, (-1.0, 2.0**-60), INF)
    assert check_contact(contacts([scene]), 0, scene).status == "NEVER"
    tilted = [(-1.0, 2.0), (2.0, 2.0 + tilt * 3.0), (2.0, 4.0), (-1.0, 4.0)]
    scene = (SQUARE, (0, 0), tilted, (0.0, -1.0), INF)
    answer = contacts([scene])
    check_contact(answer, 0, scene)
    assert len(answer.points) == 1
    level = [(-1.0, 2.0), (2.0, 2.0), (2.0, 4.0), (-1.0, 4.0)]
    assert len(contacts([(SQUARE, (0, 0), level, (0.0, -1.0), INF)]).points) == 2


# --------------------------------------------------------------------------------------------------------- laws


@pytest.fixture(scope="module")
def scenes():
    """Coordinates of 22 bits, so that they can be shifted and scaled without rounding; all kinds of contact."""
    rng = np.random.default_rng(7)
    found = []
    for k in range(400):
        size = (2, 12, 2**20)[k % 3]
        found.append((*integer_scene(rng, size), INF))
    return found


def distances(scenes):
    a, b = polygons(*(s[0] for s in scenes)), polygons(*(s[2] for s in scenes))
    return gs.distance(a, b, accuracy="exact", want=("penetration",))


def same(one, other, names, factor=1.0):
    for name in names:
        left, right = getattr(one, name), getattr(other, name)
        np.testing.assert_array_equal(right, left if name == "status" else left * factor, err_msg=name)


def same_contacts(one, other, factor=1.0):
    same(one, other, ("status", "point_offsets", "certain"))
    same(one, other, NUMBERS[1:], factor)


def test_law_swap_is_bitwise(scenes):
    one = contacts(scenes)
    other = contacts([(b, vb, a, va, t) for a, va, b, vb, t in scenes])
    same_contacts(one, other)
    for i in range(len(scenes)):
        assert sorted(points_of(one, i).tolist()) == sorted(points_of(other, i).tolist())
    moving = one.status == gs.WILL_TOUCH
    np.testing.assert_array_equal(other.normal[moving], -one.normal[moving])
    near, far = distances(scenes), distances([(b, vb, a, va, t) for a, va, b, vb, t in scenes])
    same(near, far, ("distance", "lower", "upper"))


def test_law_relabelled_rings_is_bitwise(scenes, rng):
    def relabelled(ring):
        k = int(rng.integers(len(ring)))
        return ring[k:] + ring[:k]

    rolled = [(relabelled(a), va, relabelled(b), vb, t) for a, va, b, vb, t in scenes]
    one, other = contacts(scenes), contacts(rolled)
    same_contacts(one, other)
    np.testing.assert_array_equal(other.points, one.points)
    np.testing.assert_array_equal(other.normal, one.normal)
    same(distances(scenes), distances(rolled), ("distance", "lower", "upper", "normal", "point_a", "point_b"))


def test_law_repeated_and_collinear_vertices_change_nothing(scenes):
    def refined(ring):
        middle = [
            tuple(0.5 * (x + y) for x, y in zip(p, q, strict=True))
            for p, q in zip(ring, ring[1:] + ring[:1], strict=True)
        ]
        return [v for p, m in zip(ring, middle, strict=True) for v in (p, p, m)]

    finer = [(refined(a), va, refined(b), vb, t) for a, va, b, vb, t in scenes]
    one, other = contacts(scenes), contacts(finer)
    same_contacts(one, other)
    np.testing.assert_array_equal(other.points, one.points)
    same(distances(scenes), distances(finer), ("distance", "lower", "upper", "normal"))


@pytest.mark.parametrize(("length", "speed"), [(7, 0), (-3, 5), (-700, -700), (700, 0), (950, 900), (0, -900), (1, 1)])
def test_law_power_of_two_scale_is_bitwise(scenes, length, speed):
    other = [scaled(s[:4], length, speed, s[4]) for s in scenes]
    one, two = contacts(scenes), contacts(other)
    same_contacts(one, two, 2.0 ** (length - speed))
    np.testing.assert_array_equal(two.points, one.points * 2.0**length)
    np.testing.assert_array_equal(two.normal, one.normal)
    near, far = distances(scenes), distances(other)
    same(near, far, ("distance", "lower", "upper", "point_a", "point_b"), 2.0**length)
    same(near, far, ("normal",))


def test_law_exact_translation_is_bitwise(scenes):
    shift, common = (3.0 * 2**25, -(2.0**27)), (5.0, -3.0)
    moved = [
        (shifted(a, *shift), tuple(x + y for x, y in zip(va, common, strict=True)),
         shifted(b, *shift), tuple(x + y for x, y in zip(vb, common, strict=True)), t)
        for a, va, b, vb, t in scenes
    ]  # fmt: skip
    one, other = contacts(scenes), contacts(moved)
    same_contacts(one, other)
    np.testing.assert_array_equal(other.normal, one.normal)
    same(distances(scenes), distances(moved), ("distance", "lower", "upper", "normal"))


def test_law_time_reversal(scenes):
    """Backwards from the end, first contact is where the last one was."""
    ends = [s for s, t in zip(scenes, contacts(scenes).last_time, strict=True) if math.isfinite(t)]
    reached = 0
    for a, va, b, vb, _ in ends[:150]:
        truth = exact.first_contact(a, va, b, vb, INF)
        late = math.ceil(truth.last_time) + 1
        end = (
            [(float(x + late * va[0]), float(y + late * va[1])) for x, y in a],
            [(float(x + late * vb[0]), float(y + late * vb[1])) for x, y in b],
        )
        back = contacts([(end[0], tuple(-c for c in va), end[1], tuple(-c for c in vb), INF)])
        assert back.status[0] == gs.WILL_TOUCH
        assert back.time[0] == nearest_double(late - truth.last_time)
        reached += 1
    assert reached >= 100


def test_one_against_many(scenes):
    a, b = scenes[0][0], [s[2] for s in scenes]
    one = gs.first_contact(polygons(a), polygons(*b), (1.0, 0.0), (0.0, 0.0), accuracy="exact")
    many = gs.first_contact(polygons(*[a] * len(b)), polygons(*b), (1.0, 0.0), (0.0, 0.0), accuracy="exact")
    same_contacts(one, many)
    nothing = gs.Polygons(np.zeros((0, 2)), [0])
    assert gs.first_contact(nothing, nothing, (0, 0), (0, 0), accuracy="exact").point_offsets.tolist() == [0]
    assert len(gs.distance(nothing, nothing, accuracy="exact").distance) == 0


# -------------------------------------------------------------------------------------------- the other tiers


@pytest.mark.parametrize("kind", SCENES)
def test_what_is_certain_at_float64_is_so(rng, kind):
    reached = Counter()
    for t_max in (INF, 2.0):
        scenes = [(*SCENES[kind](rng), t_max) for _ in range(250)]
        for scale in ((0, 0), (-900, -600), (0, -950)):
            batch = [scaled(scene[:4], *scale, t_max) for scene in scenes]
            truth, answer = contacts(batch), contacts(batch, "float64")
            sure = answer.certain
            wrong = np.flatnonzero(sure & (answer.status != truth.status))
            assert len(wrong) == 0, reproducer(scene=batch[wrong[0]])
            reached.update(answer.status[sure].tolist())
            reached["certain"] += sure.sum()
            reached["all"] += len(batch)
    assert min(reached[k] for k in (gs.NEVER, gs.WILL_TOUCH, gs.OVERLAPPING)) >= 20, reached
    assert reached["certain"] >= 0.4 * reached["all"], reached


def tight(lower, upper):
    """How wide intervals are, relatively."""
    return (upper - lower) / np.maximum(np.abs(lower), np.abs(upper))


@pytest.mark.parametrize("tier", ["bound", "float32"])
@pytest.mark.parametrize("kind", SCENES)
def test_what_lower_tiers_prove_of_contacts(rng, kind, tier):
    """Nothing is missed, what is certain is so, and times are within their bounds."""
    reached = Counter()
    for t_max in (INF, 2.0, 0.0):
        scenes = [(*SCENES[kind](rng), t_max) for _ in range(200)]
        for scale in ((0, 0), (-900, -600), (0, -950), (900, 900)):
            batch = [scaled(scene[:4], *scale, t_max) for scene in scenes]
            truth, answer = contacts(batch), contacts(batch, tier)
            assert answer.cost.counts == {("bound" if tier == "bound" else "filter"): len(batch)}
            for i, scene in enumerate(batch):
                given = reproducer(scene=scene)
                status, expected = answer.status[i], truth.status[i]
                reached[int(status)] += 1
                reached["certain"] += answer.certain[i]
                if answer.certain[i]:
                    assert status == expected, given
                if status == gs.NEVER:
                    assert answer.certain[i] and np.isnan(answer.time[i]), given
                    continue
                lower, time, upper, last = (
                    float(x[i]) for x in (answer.time_lower, answer.time, answer.time_upper, answer.last_time)
                )
                assert 0.0 <= lower <= time <= upper <= scene[4] and time <= last <= scene[4], given
                if expected != gs.NEVER:
                    assert lower <= truth.time_upper[i] and truth.time_lower[i] <= upper, given
                if tier == "bound":
                    assert status in (gs.WILL_TOUCH, gs.TOUCHING) and time == lower, given
                    assert upper == last >= (truth.last_time[i] if expected != gs.NEVER else 0.0), given
    assert min(reached[gs.NEVER], reached["certain"], reached[gs.WILL_TOUCH]) >= 50, reached


@pytest.mark.parametrize("tier", ["bound", "float32"])
@pytest.mark.parametrize("kind", SCENES)
def test_what_lower_tiers_prove_of_distances(rng, kind, tier):
    scenes = [SCENES[kind](rng) for _ in range(200)]
    for length in (0, -1000, 900):
        batch = [scaled(scene, length, 0, INF) for scene in scenes]
        a, b = polygons(*(s[0] for s in batch)), polygons(*(s[2] for s in batch))
        for want in ((), ("penetration",)):
            truth, answer = (gs.distance(a, b, accuracy=t, want=want) for t in ("exact", tier))
            assert (answer.lower <= answer.distance).all() and (answer.distance <= answer.upper).all()
            assert (answer.lower <= truth.upper).all() and (truth.lower <= answer.upper).all()
            assert tier != "bound" or (answer.distance == answer.lower).all()
        truth, answer = (gs.intersects(a, b, accuracy=t) for t in ("exact", tier))
        sure = answer.certain
        np.testing.assert_array_equal(answer.value[sure], truth.value[sure])
        assert (answer.value | ~truth.value).all()  # never a miss
        assert sure.sum() >= 10


# What float32 knows of a distance, in terms of the size of the pair: an interval has two errors of a gap and two of a
# width, 2 * (15 + 6) * 2**-24 of numbers up to three times as large.
SINGLE = 2.0**-17


def size_of(*rings):
    """Of the pair, wherever it is."""
    return float(np.ptp(np.concatenate(rings), axis=0).max())


def check_single(scene, contact, signed, plain, meet):
    """Answers of float32, one item each, against the oracle: nothing is claimed that is not so."""
    a, velocity_a, b, velocity_b, t_max = scene
    given = reproducer(scene=scene)
    truth = exact.first_contact(a, velocity_a, b, velocity_b, t_max)
    assert not contact.certain[0] or contact.status[0] == STATUS[truth.status], given
    assert contact.certain[0] == (contact.status[0] in (gs.NEVER, gs.OVERLAPPING)) or contact.status[0] == gs.WILL_TOUCH
    low, time, high = (float(x[0]) for x in (contact.time_lower, contact.time, contact.time_upper))
    if contact.status[0] == gs.NEVER:
        assert np.isnan([low, time, high, contact.last_time[0]]).all() and len(contact.points) == 0, given
    else:
        assert 0.0 <= low <= time <= high <= t_max and time <= contact.last_time[0] <= t_max, given
        assert np.isfinite(contact.points).all() and len(contact.points) >= 1, given
    if "NEVER" != truth.status:
        assert contact.status[0] != gs.NEVER and low <= truth.time, given
        assert not math.isfinite(high) or truth.time <= Fraction(high), given
    square = exact.separation(a, b).signed_square
    for answer, expected in ((signed, square), (plain, max(square, Fraction(0)))):
        assert answer.lower[0] <= answer.distance[0] <= answer.upper[0], given
        assert compare_root(float(answer.lower[0]), expected) <= 0 <= compare_root(float(answer.upper[0]), expected)
        assert np.isfinite([*answer.point_a[0], *answer.point_b[0]]).all(), given
        assert abs(math.hypot(*answer.normal[0]) - 1.0) <= 2.0**-50, given
    assert meet.value[0] or square > 0, given
    assert not meet.certain[0] or meet.value[0] == (square <= 0), given


def single_answers(scene):
    a, b = polygons(scene[0]), polygons(scene[2])
    distances = (gs.distance(a, b, accuracy="float32", want=want) for want in (("penetration",), ()))
    return contacts([scene], "float32"), *distances, gs.intersects(a, b, accuracy="float32")


def test_float32_of_mixed_magnitudes(rng):
    """What float cannot hold beside the rest of the pair is uncertain."""
    reached = Counter()
    for k in range(300):
        scene = (*mixed_scene(rng), (INF, 1.0)[k % 2])
        answers = single_answers(scene)
        check_single(scene, *answers)
        reached[int(answers[0].status[0])] += 1
        reached["certain"] += answers[0].certain[0]
    assert min(reached[s] for s in (gs.NEVER, gs.WILL_TOUCH, gs.OVERLAPPING)) >= 20, reached
    assert reached["certain"] >= 200, reached


def test_float32_of_large_polygons(rng):
    for scene in large_scenes(rng, ((40, 33), (100, 90))):
        answers = single_answers(scene)
        check_single(scene, *answers)
        assert answers[0].certain[0] and answers[3].certain[0]


@pytest.mark.parametrize("kind", SCENES)
def test_float32_knows_seven_digits(rng, kind):
    """Intervals are as narrow as promised; points are on the polygons, and as far apart as the distance says."""
    scenes = [(*SCENES[kind](rng), INF) for _ in range(200)]
    a, b = polygons(*(s[0] for s in scenes)), polygons(*(s[2] for s in scenes))
    reached = Counter()
    for want in ((), ("penetration",)):
        answer, truth = (gs.distance(a, b, accuracy=t, want=want) for t in ("float32", "exact"))
        certain = gs.intersects(a, b, accuracy="float32").certain
        for i, (p, _, q, _, _) in enumerate(scenes):
            given = reproducer(a=p, b=q)
            size = size_of(p, q)
            assert answer.upper[i] - answer.lower[i] <= SINGLE * size, given
            assert abs(answer.distance[i] - truth.distance[i]) <= SINGLE * size, given
            points = answer.point_a[i], answer.point_b[i]
            far = 2.0**-50 * np.abs(np.concatenate([p, q])).max()
            apart = points[1] - points[0] - answer.distance[i] * answer.normal[i]
            if want or truth.distance[i] > 0:
                assert np.abs(apart).max() <= SINGLE * size + far, given
                for point, ring in zip(points, (p, q), strict=True):
                    off = exact.separation([tuple(point.tolist())], ring).signed_square
                    assert off <= Fraction(far) ** 2, given
            reached["certain"] += certain[i]
    assert reached["certain"] >= (0.6 if "large" in kind else 0.75) * 2 * len(scenes), reached


def test_float32_contact_sets_are_near_those_of_float64(rng):
    """Where nothing is in doubt; across edges and corners, at every scale."""
    reached = Counter()
    for length, speed in ((0, 0), (-900, -600), (300, 500)):
        scenes = [scaled(integer_scene(rng, 12), length, speed, INF) for _ in range(300)]
        single, double = contacts(scenes, "float32"), contacts(scenes, "float64")
        for i, (a, _, b, _, _) in enumerate(scenes):
            points, expected = points_of(single, i), points_of(double, i)
            if not (single.certain[i] and double.certain[i]) or single.status[i] == gs.NEVER:
                continue
            given = reproducer(scene=scenes[i])
            assert np.isclose(single.time[i], double.time[i], rtol=1e-4, atol=0.0), given
            assert single.last_time[i] == pytest.approx(double.last_time[i], rel=1e-4), given
            if len(points) != len(expected):
                reached["other"] += 1  # nearly parallel
                continue
            near = 1e-4 * size_of(a, b)
            assert all(np.abs(expected - p).max(axis=1).min() <= near for p in points), given
            if len(points) == 2 and single.status[i] != gs.OVERLAPPING:
                assert np.abs(single.normal[i] - double.normal[i]).max() <= 1e-12, given
            reached[len(points)] += 1
    assert reached["other"] <= 3 and min(reached[1], reached[2], reached[4]) >= 20, reached


@pytest.mark.parametrize(("length", "speed"), [(7, 0), (-3, 5), (-700, -700), (700, 0), (950, 900), (0, -900), (1, 1)])
def test_law_float32_power_of_two_scale_is_bitwise(scenes, length, speed):
    """The frame is scaled itself, so nothing leaves the range of float."""
    one = contacts(scenes, "float32")
    other = contacts([scaled(s[:4], length, speed, s[4]) for s in scenes], "float32")
    np.testing.assert_array_equal(other.status, one.status)
    np.testing.assert_array_equal(other.certain, one.certain)
    for name in NUMBERS[1:]:
        np.testing.assert_allclose(getattr(other, name), getattr(one, name) * 2.0 ** (length - speed), rtol=2.0**-52)
    np.testing.assert_array_equal(other.normal, one.normal)


@pytest.mark.parametrize("t_max", [INF, 0.0])
def test_float32_at_rest(t_max):
    """Nothing approaches; what touches is not known to, unless it is one point."""
    for shift, status, certain in ((2.0, gs.NEVER, True), (1.0, gs.TOUCHING, False), (0.5, gs.OVERLAPPING, True)):
        answer = contacts([(SQUARE, (1, 2), shifted(SQUARE, shift, 0), (1, 2), t_max)], "float32")
        assert (answer.status[0], answer.certain[0]) == (status, certain)
        if status != gs.NEVER:
            assert (answer.time_lower[0], answer.time_upper[0], answer.last_time[0]) == (0.0, 0.0, t_max)
    meet = gs.intersects(polygons([(1e9, 1.0)]), polygons([(1e9, 1.0)]), accuracy="float32")
    assert meet.value[0] and meet.certain[0]
    near = gs.intersects(polygons([(1e9, 1.0)]), polygons([(1e9, math.nextafter(1.0, 2.0))]), accuracy="float32")
    assert not near.value[0] and near.certain[0]
