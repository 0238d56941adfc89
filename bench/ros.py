# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""The node measured from another process: small service calls against an empty one, a state stream, memory.

``python bench/ros.py`` is the server process: the node as it is, plus one empty std_srvs/Trigger service on the same
executor.  `measure` starts it and is its client.
"""

from __future__ import annotations

import array
import os
import signal
import statistics
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

os.environ.setdefault("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
os.environ.setdefault("ROS_DOMAIN_ID", str(1 + os.getpid() % 100))

READY_DEADLINE_S = 20.0
SHAPES = 1000
RATE_HZ = 100.0
IDLE_SHARE = 0.03  # of a core that an idle node may take


def serve() -> None:
    """The server process."""
    from rclpy.node import Node
    from std_srvs.srv import Trigger

    from geomsrv.ros import node

    # The executor that main() makes is the only one; the empty service joins it with the node.
    executor_type = node.SingleThreadedExecutor

    class Executor(executor_type):  # type: ignore[misc, valid-type]
        def __init__(self) -> None:
            super().__init__()
            self._empty = Node("bench_empty")
            self._empty.create_service(Trigger, "/bench/empty", lambda _, response: response)
            self.add_node(self._empty)

    node.SingleThreadedExecutor = Executor
    sys.exit(node.main([]))


class Client:
    """Calls that wait on an executor of their own; no spin_until_future_complete, which slows down with every call."""

    def __init__(self) -> None:
        import rclpy
        from rclpy.executors import SingleThreadedExecutor

        rclpy.init()
        self.node = rclpy.create_node("geomsrv_bench")
        self._executor = SingleThreadedExecutor()
        self._executor.add_node(self.node)

    def service(self, kind: Any, name: str) -> Any:
        """A client whose service is there."""
        client = self.node.create_client(kind, name)
        if not client.wait_for_service(READY_DEADLINE_S):
            raise RuntimeError(f"service {name} did not appear")
        return client

    def call(self, client: Any, request: Any) -> Any:
        """The response."""
        future = client.call_async(request)
        while not future.done():
            self._executor.spin_once(timeout_sec=1.0)
        return future.result()

    def until(self, condition: Callable[[], bool]) -> None:
        """Spin until `condition`."""
        deadline = time.monotonic() + READY_DEADLINE_S
        while not condition():
            if time.monotonic() > deadline:
                raise RuntimeError("the node did not get there in time")
            self._executor.spin_once(timeout_sec=0.1)

    def close(self) -> None:
        """Leave."""
        import rclpy

        self._executor.shutdown()
        self.node.destroy_node()
        rclpy.shutdown()


def _requests() -> dict[str, tuple[Any, str, Any]]:
    """Small requests of the three questions, with their shapes inline, and the empty service."""
    from std_srvs.srv import Trigger

    from geomsrv import msg, srv

    box = msg.Shape(type=msg.Shape.BOX, dimensions=array.array("d", [0.1, 0.2, 0.3]))
    ball = msg.Shape(type=msg.Shape.SPHERE, dimensions=array.array("d", [0.1]))
    pose = array.array("d", [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0])
    away = array.array("d", [1.0, 0.2, 0.1, 0.0, 0.0, 0.0, 1.0])
    triangle = array.array("d", [0.0, 0.0, 1.0, 0.0, 0.0, 1.0])
    return {
        "empty Trigger": (Trigger, "/bench/empty", Trigger.Request()),
        "distance": (
            srv.Distance,
            "/geomsrv/distance",
            srv.Distance.Request(
                select=srv.Distance.Request.INLINE, shapes_a=[box], poses_a=pose, shapes_b=[ball], poses_b=away
            ),
        ),
        "cull_batch": (
            srv.CullBatch,
            "/geomsrv/cull_batch",
            srv.CullBatch.Request(
                frustum=array.array("d", [0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, -1, 1, -1, 1, 1, 10]),
                centers=array.array("d", [0.0, 0.0, 5.0]),
                axes=array.array("d", [1, 0, 0, 0, 1, 0, 0, 0, 1]),
                half_extents=array.array("d", [0.5, 0.5, 0.5]),
            ),
        ),
        "first_contact_batch": (
            srv.FirstContactBatch,
            "/geomsrv/first_contact_batch",
            srv.FirstContactBatch.Request(
                vertices_a=triangle,
                offsets_a=array.array("I", [0, 3]),
                vertices_b=array.array("d", [3.0, 0.0, 4.0, 0.0, 3.0, 1.0]),
                offsets_b=array.array("I", [0, 3]),
                velocities_a=array.array("d", [1.0, 0.0]),
                velocities_b=array.array("d", [0.0, 0.0]),
                t_max=10.0,
            ),
        ),
    }


def _latency(client: Client, calls: int) -> list[str]:
    """Medians of each call, taking turns, and their ratio to the empty one."""
    services = {name: (client.service(kind, path), request) for name, (kind, path, request) in _requests().items()}
    times: dict[str, list[float]] = {name: [] for name in services}
    for turn in range(calls + 20):
        for name, (service, request) in services.items():
            start = time.perf_counter()
            response = client.call(service, request)
            if turn >= 20:
                times[name].append(1e3 * (time.perf_counter() - start))
            if name != "empty Trigger" and response.status != 0:
                raise RuntimeError(f"{name}: {response.message}")
    medians = {name: statistics.median(values) for name, values in times.items()}
    empty = medians["empty Trigger"]
    return [
        f"service {name}: median {ms:.3f} ms, {ms / empty:.2f} x empty Trigger (at most 1.5 wanted)"
        for name, ms in medians.items()
    ]


def _usage(pid: int) -> tuple[float, float]:
    """CPU seconds used and resident MiB of a process."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    ticks = os.sysconf("SC_CLK_TCK")
    return (int(fields[11]) + int(fields[12])) / ticks, int(fields[21]) * os.sysconf("SC_PAGE_SIZE") / 2**20


def _memory(client: Client, pid: int, calls: int) -> str:
    """Growth of the node over many calls, after it has warmed up."""
    kind, path, request = _requests()["distance"]
    service = client.service(kind, path)
    for _ in range(calls // 10):
        client.call(service, request)
    before = _usage(pid)[1]
    for _ in range(calls):
        client.call(service, request)
    after = _usage(pid)[1]
    return f"memory over {calls:,} calls: {before:.1f} MiB before, {after:.1f} MiB after ({after - before:+.2f})"


def _stream(client: Client, pid: int, seconds: float) -> list[str]:
    """States of 1,000 shapes at 100 Hz, that change and that do not: what arrived, and what it cost the node."""
    from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy

    from geomsrv import msg

    latched = QoSProfile(depth=100, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    shapes = client.node.create_publisher(msg.SceneUpdate, "/geomsrv/shapes", latched)
    update = msg.SceneUpdate(clear=True)
    for i in range(SHAPES):
        item = msg.SceneObject(id=f"box/{i}")
        item.shape.type, item.shape.dimensions = msg.Shape.BOX, array.array("d", [0.1, 0.1, 0.1])
        item.pose.position.x, item.pose.position.y = float(i % 32), float(i // 32)
        update.add.append(item)
    latest: dict[str, Any] = {}
    state_qos = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    client.node.create_subscription(
        msg.EngineState, "/geomsrv/state", lambda message: latest.update(state=message), state_qos
    )
    shapes.publish(update)
    client.until(lambda: "state" in latest and latest["state"].object_count == SHAPES)
    best_effort = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
    states = client.node.create_publisher(msg.ShapeStates, "/geomsrv/states", best_effort)
    client.until(lambda: states.get_subscription_count() > 0)
    message = msg.ShapeStates(ids=[item.id for item in update.add])
    poses = array.array("d", [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0] * SHAPES)
    for i in range(SHAPES):
        poses[7 * i], poses[7 * i + 1] = float(i % 32), float(i // 32)
    message.poses, message.twists = poses, array.array("d", bytes(8 * 6 * SHAPES))

    def received() -> int:
        state = latest["state"]
        topic = next(i for i, name in enumerate(state.input_topics) if name.endswith("states"))
        return int(state.input_received[topic])

    def run(changing: bool) -> str:
        message.poses[2] = 0.0
        settle = time.monotonic() + (0.0 if changing else 2.0)  # it takes a while to see that nothing changes
        while time.monotonic() < settle:
            states.publish(message)
            client._executor.spin_once(timeout_sec=1.0 / RATE_HZ)
        begin_received, (begin_cpu, _), begin = received(), _usage(pid), time.monotonic()
        count = int(seconds * RATE_HZ)
        for k in range(count):
            message.poses[2] = 1e-3 * k * changing
            message.header.stamp = client.node.get_clock().now().to_msg()
            states.publish(message)
            while (wait := begin + (k + 1) / RATE_HZ - time.monotonic()) > 0.0:
                client._executor.spin_once(timeout_sec=wait)
        cpu = (_usage(pid)[0] - begin_cpu) / (time.monotonic() - begin)
        client.until(lambda: received() > begin_received)
        what = "changing" if changing else f"unchanged, wanted under {IDLE_SHARE:.0%}"
        return f"states, {SHAPES:,} shapes at {RATE_HZ:g} Hz, nobody listens, {what}: {cpu:.1%} of a core"

    return [run(True), run(False)]


def measure(quick: bool) -> list[str]:
    """Start the node, be its client, return lines to print."""
    server = subprocess.Popen([sys.executable, __file__], stdin=subprocess.DEVNULL)
    try:
        client = Client()
        try:
            lines = _latency(client, 100 if quick else 1000)
            lines.append(_memory(client, server.pid, 1_000 if quick else 10_000))
            lines += _stream(client, server.pid, 3.0 if quick else 10.0)
            return lines
        finally:
            client.close()
    finally:
        server.send_signal(signal.SIGINT)
        try:
            server.wait(10.0)
        except subprocess.TimeoutExpired:
            server.kill()


if __name__ == "__main__":
    serve()
