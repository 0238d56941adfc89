# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""100,000 mixed queries whose answers must be the same bits everywhere; hashes them.

Inputs come from SHAKE-128 by integer arithmetic and single correctly rounded divisions, so they are the same on every
machine.  Run as a script it prints a line per query and tier, of all queries or of those named; ``--write`` keeps them
in data/golden.sha256, ``--check`` compares with what is kept.
"""

from __future__ import annotations

import dataclasses
import hashlib
import sys
from collections.abc import Callable, Iterator
from itertools import combinations_with_replacement
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import geomsrv as gs
from geomsrv.errors import NotAvailableError

FILE = Path(__file__).resolve().parent / "data" / "golden.sha256"

# Of the items of a query each tier answers one in so many.
TIERS = {"bound": 2, "float32": 2, "float64": 1, "exact": 10}

FloatArray = NDArray[np.float64]
Answers = Iterator[Any]


class Stream:
    """Numbers of a name."""

    def __init__(self, name: str) -> None:
        self._name, self._drawn = name, 0

    def ints(self, low: int, high: int, *shape: int) -> NDArray[np.int64]:
        """Whole numbers from low to high."""
        count = int(np.prod(shape, dtype=int))
        data = hashlib.shake_128(f"{self._name}/{self._drawn}".encode()).digest(8 * count)
        self._drawn += 1
        drawn = np.frombuffer(data, "<u8").reshape(shape) % np.uint64(high - low + 1)
        return drawn.astype(np.int64) + low

    def reals(self, low: int, high: int, *shape: int, bits: int = 20) -> FloatArray:
        """Multiples of 2**-bits."""
        return np.ldexp(self.ints(low << bits, high << bits, *shape).astype(float), -bits)

    def quaternions(self, count: int) -> FloatArray:
        """Of norm 1, rounded; a third of them turn by multiples of 90 degrees."""
        whole = self.ints(-99, 99, count, 4)
        whole[whole[:, 3] == 0, 3] = 1
        whole[::3] = np.eye(4, dtype=np.int64)[self.ints(0, 3, len(whole[::3]))]
        x, y, z, w = whole.T.astype(float)
        norm = np.sqrt(x * x + y * y + z * z + w * w)  # of a whole number: rounded once
        return np.column_stack([x / norm, y / norm, z / norm, w / norm])

    def frames(self, count: int) -> FloatArray:
        """Rotation matrices, every entry the rounded ratio of whole numbers."""
        whole = self.ints(-99, 99, count, 4)
        whole[whole[:, 3] == 0, 3] = 1
        whole[::3] = np.eye(4, dtype=np.int64)[self.ints(0, 3, len(whole[::3]))]
        x, y, z, w = whole.T
        rows = [
            [w * w + x * x - y * y - z * z, 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), w * w - x * x + y * y - z * z, 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z],
        ]
        norm = w * w + x * x + y * y + z * z
        return np.array([[entry / norm for entry in row] for row in rows]).transpose(2, 0, 1)

    def boxes(self, count: int, spread: int = 4) -> gs.Boxes:
        """Of few bits every other time, so that many touch."""
        center, half = self.reals(-spread, spread, count, 3), self.reals(0, 2, count, 3)
        center[::2] = self.reals(-spread, spread, len(center[::2]), 3, bits=1)
        half[::2] = self.reals(0, 2, len(half[::2]), 3, bits=1)
        return gs.Boxes(center, self.frames(count), half)

    def hulls(self, count: int, spread: int = 3) -> gs.Polytopes:
        """Of 1 to 9 points."""
        ends = np.cumsum(np.concatenate([[0], self.ints(1, 9, count)]))
        place = np.repeat(self.reals(-spread, spread, count, 3, bits=2), np.diff(ends), axis=0)
        return gs.Polytopes(place + self.reals(-1, 1, int(ends[-1]), 3, bits=int(self.ints(1, 20, 1)[0])), ends)

    def rings(self, count: int, spread: int = 3) -> gs.Polygons:
        """Triangles, quadrangles and hexagons: affine images, in whole numbers, of three convex rings."""
        shapes = [[(0, 0), (3, 0), (0, 2)], [(0, 0), (2, 0), (3, 2), (0, 3)]]
        shapes.append([(1, 0), (3, 0), (4, 2), (3, 4), (1, 4), (0, 2)])
        items = []
        for kind, a, b, c, d, x, y in self.ints(-40, 40, count, 7).tolist():
            ring = shapes[kind % 3]
            points = [((a * p + b * q + 9 * spread * x) / 64, (c * p + d * q + 9 * spread * y) / 64) for p, q in ring]
            items.append(points if a * d - b * c >= 0 else points[::-1])
        return gs.Polygons.from_list(items)

    def poses(self, count: int, spread: int = 3) -> FloatArray:
        return np.hstack([self.reals(-spread, spread, count, 3, bits=4), self.quaternions(count)])

    def frustum(self) -> gs.Frustum:
        near, far = (float(x) for x in self.ints(1, 8, 2))
        low = self.reals(-3, 1, 2, bits=3)
        high = low + 1.0 / 8 + self.reals(0, 3, 2, bits=3)
        bounds = [low[0], high[0], low[1], high[1]]
        origin = self.reals(-2, 2, 3, bits=3)
        return gs.Frustum(origin, self.frames(3)[2], bounds=bounds, near=near / 4, far=(near + far) / 4)


# ------------------------------------------------------------------------------------------------------- queries


def cull(s: Stream, tier: str, share: int) -> Answers:
    for _ in range(40 // share):
        yield gs.cull(s.frustum(), s.boxes(500), accuracy=tier)


def to_frustum(s: Stream, tier: str, share: int) -> Answers:
    for _ in range(20 // share):
        points = s.reals(-6, 6, 500, 3, bits=int(s.ints(1, 20, 1)[0]))
        yield gs.distance_to_frustum(s.frustum(), points, accuracy=tier, want=("witness",))


def to_frustum_2d(s: Stream, tier: str, share: int) -> Answers:
    for _ in range(10 // share):
        frame = s.frames(1)[0]  # every third turns by multiples of 90 degrees only
        near = float(s.ints(1, 8, 1)[0])
        view = gs.Frustum2D(s.reals(-2, 2, 2, bits=3), np.sign(frame[:2, :2]), 1.0, near, near + 2.0)
        points = s.reals(-6, 6, 500, 2, bits=int(s.ints(1, 20, 1)[0]))
        yield gs.distance_to_frustum(view, points, accuracy=tier, want=("witness",))


def polygons(s: Stream, tier: str, share: int) -> Answers:
    a, b = s.rings(10000 // share), s.rings(10000 // share)
    yield gs.distance(a, b, accuracy=tier, want=("penetration",))
    yield gs.intersects(a, b, accuracy=tier)


def first_contact(s: Stream, tier: str, share: int) -> Answers:
    count = 10000 // share
    velocities = s.reals(-2, 2, 2, count, 2, bits=3)
    yield gs.first_contact(s.rings(count), s.rings(count), *velocities, t_max=32.0, accuracy=tier)


def solid_motions(s: Stream, tier: str, share: int) -> Answers:
    count = 2500 // share
    for side_a, side_b in ((s.boxes, s.boxes), (s.boxes, s.hulls), (s.hulls, s.hulls)):
        velocities = s.reals(-2, 2, 2, count, 3, bits=3)
        yield gs.first_contact(side_a(count), side_b(count), *velocities, t_max=32.0, accuracy=tier)


def turning(s: Stream, tier: str, share: int) -> Answers:
    count = 1000 // share
    for d, side_a, side_b in ((2, s.rings, s.rings), (3, s.boxes, s.boxes), (3, s.boxes, s.hulls)):
        linear, (spin_a, spin_b) = s.reals(-2, 2, 2, count, d, bits=3), s.reals(-3, 3, 2, count, 2 * d - 3, bits=3)
        spins = {"angular_velocity_a": spin_a.reshape(count, -1), "angular_velocity_b": spin_b.reshape(count, -1)}
        if d == 2:
            spins = {name: spin[:, 0] for name, spin in spins.items()}
        yield gs.first_contact(side_a(count), side_b(count), *linear, t_max=8.0, accuracy=tier, **spins)


def boxes(s: Stream, tier: str, share: int) -> Answers:
    a, b = s.boxes(10000 // share), s.boxes(10000 // share)
    yield gs.distance(a, b, accuracy=tier, want=("penetration",))
    yield gs.intersects(a, b, accuracy=tier)


def hulls(s: Stream, tier: str, share: int) -> Answers:
    a, b = s.hulls(5000 // share), s.hulls(5000 // share)
    yield gs.distance(a, b, accuracy=tier, want=("penetration",))
    yield gs.intersects(a, b, accuracy=tier)


def mixed(s: Stream, tier: str, share: int) -> Answers:
    count = 2500 // share
    yield gs.distance(s.boxes(count), s.hulls(count), accuracy=tier, want=("penetration",))
    yield gs.distance(s.frustum(), s.boxes(count), accuracy=tier, want=("penetration",))
    yield gs.distance(s.frustum(), s.hulls(count), accuracy=tier, want=("penetration",))


def shapes(s: Stream, tier: str, share: int) -> Answers:
    count = 700 // share
    solids = [
        gs.Sphere(0.75),
        gs.Capsule(0.5, 1.25),
        gs.Box([0.5, 1.0, 0.25]),
        gs.Convex(s.reals(-1, 1, 8, 3)),
        gs.HalfSpace([0.0, 0.0, 1.0], 0.125),
        gs.Triangle([0, 0, 0], [1, 0, 0.5], [0, 1.5, 0]),
    ]
    for a, b in combinations_with_replacement(solids, 2):
        poses = s.poses(count)
        try:
            yield gs.distance(a, b, poses, accuracy=tier, want=("penetration",))
            yield gs.intersects(a, b, poses, accuracy=tier)
        except NotAvailableError:
            continue  # this pair, at this tier


def curved(s: Stream, tier: str, share: int) -> Answers:
    count = 100 // share
    solids = [
        gs.Cylinder(0.5, 1.5),
        gs.Cone(0.75, 1.25),
        gs.Ellipsoid([0.5, 0.75, 1.25]),
        gs.Sphere(0.75),
        gs.Capsule(0.5, 1.25),
        gs.Box([0.5, 1.0, 0.25]),
        gs.Convex(s.reals(-1, 1, 8, 3)),
        gs.HalfSpace([0.0, 0.0, 1.0], 0.125),
    ]
    for a, b in combinations_with_replacement(solids, 2):
        if a.kind in ("cylinder", "cone", "ellipsoid"):
            yield gs.distance(a, b, s.poses(count), accuracy=tier, want=("penetration",))
    if tier == "float64":
        for k in range(8):
            shapes = [solids[i] for i in s.ints(0, 7, 12)]
            twists = np.column_stack([s.reals(-2, 2, 12, 3, bits=3), s.reals(-3, 3, 12, 3, bits=3)])
            twists[k % 2 :: 3, 3:] = 0.0
            scene = gs.Scene()
            bodies = zip(shapes, s.poses(12, 4), twists, strict=True)
            scene.apply(gs.SceneUpdate(add=[gs.SceneObject(f"{i:02}", *body) for i, body in enumerate(bodies)]))
            yield scene.first_contacts(4.0)


QUERIES: dict[str, Callable[[Stream, str, int], Answers]] = {
    query.__name__: query
    for query in (
        cull,
        to_frustum,
        to_frustum_2d,
        polygons,
        first_contact,
        solid_motions,
        turning,
        boxes,
        hulls,
        mixed,
        shapes,
        curved,
    )
}


# -------------------------------------------------------------------------------------------------------- hashing

LAZY = {"_point_a": "point_a", "_normal": "normal", "_closing_speed": "closing_speed"}  #: found on first use


def content(answer: Any) -> Iterator[tuple[str, NDArray[Any]]]:
    """Name and values of every array that an answer has; costs are left out."""
    for field in dataclasses.fields(answer):
        name = LAZY.get(field.name, field.name)
        value = getattr(answer, name)
        if isinstance(value, np.ndarray):
            # Every NaN is the same NaN.
            yield name, np.where(np.isnan(value), np.nan, value) if value.dtype.kind == "f" else value


def hashes(queries: tuple[str, ...] = tuple(QUERIES)) -> dict[str, str]:
    """SHA-256 of the answers by query and tier, in the order of `QUERIES`; tiers that are missing are left out."""
    found = {}
    for name in queries:
        for tier, share in TIERS.items():
            digest, items = hashlib.sha256(), 0
            try:
                for answer in QUERIES[name](Stream(name), tier, share):
                    for field, value in content(answer):
                        little = value.astype(value.dtype.newbyteorder("<"))
                        digest.update(f"{field} {little.dtype.str} {little.shape}\n".encode() + little.tobytes())
                        items += 1
            except NotAvailableError:
                continue
            if items:
                found[f"{name}.{tier}"] = digest.hexdigest()
    return found


def kept() -> dict[str, str]:
    """What is in the file."""
    return {name: digest for digest, name in (line.split() for line in FILE.read_text().splitlines())}


def main() -> int:
    """Print, write or check."""
    names = tuple(name for name in QUERIES if name in sys.argv[1:]) or tuple(QUERIES)
    found = hashes(names)
    text = "".join(f"{digest}  {name}\n" for name, digest in found.items())
    if "--write" in sys.argv[1:]:
        FILE.write_text(text)
    elif "--check" in sys.argv[1:]:
        expected = {name: digest for name, digest in kept().items() if name.partition(".")[0] in names}
        wrong = [name for name in {**found, **expected} if found.get(name) != expected.get(name)]
        print("\n".join(wrong) if wrong else "all as kept")
        return int(bool(wrong))
    else:
        print(text, end="")
    return 0


if __name__ == "__main__":
    sys.exit(main())
