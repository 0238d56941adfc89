# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""The process in which FCL runs: reads pairs from stdin, writes what FCL says of each to stdout.

Started as a script by `geomsrv._fcl_process`, so it loads neither the package nor the engine.  It is built to
be lost: FCL can abort, hang or segfault, and whatever it does ends this process and nothing else.  Coal, which came
from FCL, runs in the same way: the arguments are the time limit and the peer's name.

Of FCL only ``collide()``, the unsigned ``distance()``, and, for bodies that translate, ``continuousCollide()`` by
conservative advancement are called; its other ways to follow a motion ignore rotation, or turn about a point that
nobody has set.  Signed distance aborts (uncaught
``std::logic_error``), hangs (concentric spheres, coaxial capsules) and segfaults (half spaces); the unsigned
distance of a half space segfaults, too, so half spaces get ``collide()`` only.

Messages, both ways: a tag byte and the payload's size (`HEADER`), then the payload.

==== ========= ===============================================================================================
tag  direction payload
==== ========= ===============================================================================================
H    out       once, first: the peer is loaded; its version
E    out       once, first and last: it cannot be loaded; why
D    in        one shape: `DEFINITION`, then the vertices, float64
F    in        forget all shapes; empty
P    in        pairs: `REQUEST` rows; answered by one `REPLY` row each, bare, as soon as it is known
==== ========= ===============================================================================================
"""

from __future__ import annotations

import os
import signal
import struct
import sys
from enum import IntEnum
from typing import Any

import numpy as np
from numpy.typing import NDArray

HEADER = struct.Struct("<cq")
DEFINITION = struct.Struct("<q16s4d")  # id, kind, the four parameters of `geomsrv.shapes.pack`
# `step`: how far b moves as seen from a, in its frame; NaN: neither moves.
REQUEST = np.dtype([("a", "<i8"), ("b", "<i8"), ("pose", "<f8", 7), ("step", "<f8", 3)])
REPLY = np.dtype([("outcome", "u1"), ("distance", "<f8")])

# Yields the processor to the process whose answers are checked; the check is never urgent.
NICENESS = 10


class Outcome(IntEnum):
    """What became of one pair."""

    APART = 0  #: the reply holds the distance, or NaN for half spaces and for bodies that move
    CONTACT = 1  #: of bodies that move, the reply holds the share of the way at which it begins
    FAILED = 2  #: python-fcl raised, or answered NaN


class Peer:
    """Shapes by id, and what another engine says of two of them."""

    module: Any

    def __init__(self) -> None:
        self._pending: dict[int, bytes] = {}
        self._shapes: dict[int, tuple[str, Any]] = {}
        self.version = "unknown"

    def define(self, payload: bytes) -> None:
        """Keep a shape; the peer's geometry is made on first use, under the clock of the pair that needs it."""
        self._pending[DEFINITION.unpack_from(payload)[0]] = payload

    def forget(self) -> None:
        """Drop every shape."""
        self._pending.clear()
        self._shapes.clear()

    def _shape(self, number: int) -> tuple[str, Any]:
        """Kind, and what `_made` made of it."""
        found = self._shapes.get(number)
        if found is None:
            payload = self._pending.pop(number)
            _, name, *params = DEFINITION.unpack_from(payload)
            kind = name.rstrip(b"\0").decode()
            vertices = np.frombuffer(payload, "<f8", offset=DEFINITION.size).reshape(-1, 3)
            found = self._shapes[number] = (kind, self._made(kind, params, vertices))
        return found

    def _made(self, kind: str, params: list[float], vertices: NDArray[np.float64]) -> Any:
        """The peers name shapes alike, but for hulls."""
        if kind == "sphere":
            return self.module.Sphere(params[0])
        if kind == "capsule":
            return self.module.Capsule(params[0], 2.0 * params[1])
        if kind == "box":
            return self.module.Box(*(2.0 * half for half in params[:3]))
        if kind == "cylinder":
            return self.module.Cylinder(params[0], 2.0 * params[1])
        if kind == "cone":
            return self.module.Cone(params[0], 2.0 * params[1])
        if kind == "ellipsoid":
            return self.module.Ellipsoid(*params[:3])
        if kind == "half_space":
            return self.module.Halfspace(np.array(params[:3]), params[3])
        return self._hull(vertices)

    def _hull(self, vertices: NDArray[np.float64]) -> Any:
        raise NotImplementedError

    def measure(self, a: int, b: int, pose: NDArray[np.float64]) -> tuple[int, float]:
        """Outcome and distance of one pair, b placed by `pose` in the frame of a."""
        raise NotImplementedError

    def follow(self, a: int, b: int, pose: NDArray[np.float64], step: NDArray[np.float64]) -> tuple[int, float]:
        """Outcome and share of the way at first contact of one pair, b moving by `step` in the frame of a.

        Of FCL only: Coal has no continuous collision.
        """
        raise NotImplementedError


class Fcl(Peer):
    """FCL."""

    def __init__(self) -> None:
        import fcl

        super().__init__()
        self.module = fcl
        self.version = str(getattr(fcl, "__version__", "unknown"))
        self._unsigned = fcl.DistanceRequest(enable_nearest_points=False, enable_signed_distance=False)
        self._continuous = fcl.ContinuousCollisionRequest(
            num_max_iterations=1000,
            toc_err=1e-6,
            ccd_motion_type=fcl.CCDMotionType.CCDM_TRANS,
            ccd_solver_type=fcl.CCDSolverType.CCDC_CONSERVATIVE_ADVANCEMENT,
        )

    def _made(self, kind: str, params: list[float], vertices: NDArray[np.float64]) -> Any:
        """An object that stays at the origin, and one that gets moved."""
        geometry = super()._made(kind, params, vertices)
        return tuple(self.module.CollisionObject(geometry) for _ in range(2))

    def _hull(self, vertices: NDArray[np.float64]) -> Any:
        # Without faces FCL finds support points by looking at every vertex instead of walking along edges:
        # the same answers, also for flat hulls, and nobody has to compute a hull.
        return self.module.Convex(vertices, 0, np.zeros(0, np.int64))

    def measure(self, a: int, b: int, pose: NDArray[np.float64]) -> tuple[int, float]:
        """Outcome and distance of one pair, b placed by `pose` in the frame of a."""
        kind_a, (first, _) = self._shape(a)
        kind_b, (_, second) = self._shape(b)
        # ROS order x y z w -> FCL's w x y z.
        second.setTransform(self.module.Transform(pose[[6, 3, 4, 5]], pose[:3]))
        if self.module.collide(first, second):
            return Outcome.CONTACT, np.nan
        if "half_space" in (kind_a, kind_b):
            return Outcome.APART, np.nan
        gap = float(self.module.distance(first, second, self._unsigned))
        if not gap < np.inf:
            return Outcome.FAILED, gap
        # -1 is FCL's word for a contact; collide() misses some between flat hulls.
        return (Outcome.APART, gap) if gap > 0.0 else (Outcome.CONTACT, np.nan)

    def follow(self, a: int, b: int, pose: NDArray[np.float64], step: NDArray[np.float64]) -> tuple[int, float]:
        """Outcome and share of the way at first contact of one pair, b moving by `step` in the frame of a."""
        fcl = self.module
        _, (first, _) = self._shape(a)
        _, (_, second) = self._shape(b)
        turn = pose[[6, 3, 4, 5]]
        second.setTransform(fcl.Transform(turn, pose[:3]))
        result = fcl.ContinuousCollisionResult()
        fcl.continuousCollide(
            first, fcl.Transform(), second, fcl.Transform(turn, pose[:3] + step), self._continuous, result
        )
        return (Outcome.CONTACT, float(result.time_of_contact)) if result.is_collide else (Outcome.APART, np.nan)


class Coal(Peer):
    """Coal, formerly hpp-fcl."""

    # Hulls of up to so many points are searched point by point; larger ones along edges, which take a hull.
    SMALL = 32

    def __init__(self) -> None:
        import coal

        super().__init__()
        self.module = coal
        self.version = str(coal.__version__)

    def _hull(self, vertices: NDArray[np.float64]) -> Any:
        points = self.module.StdVec_Vec3s()
        points.extend(list(vertices))
        if len(vertices) > self.SMALL:
            return self.module.Convex.convexHull(points, False, None)
        return self.module.Convex(points, self.module.StdVec_Triangle())

    def measure(self, a: int, b: int, pose: NDArray[np.float64]) -> tuple[int, float]:
        """Outcome and distance of one pair, b placed by `pose` in the frame of a."""
        _, first = self._shape(a)
        _, second = self._shape(b)
        x, y, z, w = pose[3:].tolist()
        here = self.module.Transform3s()
        there = self.module.Transform3s(self.module.Quaternion(w, x, y, z).matrix(), pose[:3])
        found = self.module.CollisionResult()
        self.module.collide(first, here, second, there, self.module.CollisionRequest(), found)
        if found.isCollision():
            return Outcome.CONTACT, np.nan
        request, result = self.module.DistanceRequest(), self.module.DistanceResult()
        request.enable_signed_distance = False
        gap = float(self.module.distance(first, here, second, there, request, result))
        if not gap < np.inf:
            return Outcome.FAILED, gap
        return (Outcome.APART, gap) if gap > 0.0 else (Outcome.CONTACT, np.nan)


PEERS = {"fcl": Fcl, "coal": Coal}


def read_exactly(source: int, size: int) -> bytes:
    """`size` bytes; b"" at the end of the stream."""
    parts: list[bytes] = []
    while size > 0:
        part = os.read(source, size)
        if not part:
            return b""
        parts.append(part)
        size -= len(part)
    return b"".join(parts)


def answer(engine: Peer, rows: NDArray[np.void], timeout_s: float, sink: int) -> None:
    """Write one reply per row, each at once: what was written before a crash tells which pair did it."""
    reply = struct.Struct("<Bd")  # one `REPLY`
    columns = rows["a"].tolist(), rows["b"].tolist(), rows["pose"], rows["step"]
    for a, b, pose, step in zip(*columns, strict=True):
        # A hang inside a peer never returns to Python.  The default action of SIGALRM ends it, even if the
        # parent is gone.
        signal.setitimer(signal.ITIMER_REAL, timeout_s)
        try:
            moves = not np.isnan(step[0])
            outcome, gap = engine.follow(a, b, pose, step) if moves else engine.measure(a, b, pose)
        except Exception as error:
            print(f"{type(error).__name__}: {error}", file=sys.stderr, flush=True)
            outcome, gap = Outcome.FAILED, np.nan
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        os.write(sink, reply.pack(outcome, gap))


def main() -> None:
    """Serve until stdin ends."""
    timeout_s, name = float(sys.argv[1]), sys.argv[2]
    signal.signal(signal.SIGALRM, signal.SIG_DFL)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGALRM})
    # FCL and libccd print to stdout; that must not end up between our rows.
    sink = os.dup(sys.stdout.fileno())
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())
    os.nice(NICENESS)
    try:
        engine = PEERS[name]()
    except Exception as error:
        text = f"{type(error).__name__}: {error}".encode()
        os.write(sink, HEADER.pack(b"E", len(text)) + text)
        return
    version = engine.version.encode()
    os.write(sink, HEADER.pack(b"H", len(version)) + version)
    source = sys.stdin.fileno()
    while header := read_exactly(source, HEADER.size):
        tag, size = HEADER.unpack(header)
        payload = read_exactly(source, size)
        if len(payload) < size:
            return
        if tag == b"D":
            engine.define(payload)
        elif tag == b"F":
            engine.forget()
        else:
            answer(engine, np.frombuffer(payload, REQUEST), timeout_s, sink)


if __name__ == "__main__":
    main()
