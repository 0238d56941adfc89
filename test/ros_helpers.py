# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""Nodes and clients for tests: own contexts, an own domain, waiting on conditions with deadlines, no sleeping."""

from __future__ import annotations

import os
import socket
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"
os.environ.pop("ROS_LOCALHOST_ONLY", None)

import numpy as np  # noqa: E402
import rclpy  # noqa: E402
from rclpy._rclpy_pybind11 import NodeNameNonExistentError  # noqa: E402
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor  # noqa: E402
from rclpy.parameter import Parameter  # noqa: E402
from rclpy.qos import QoSProfile  # noqa: E402

from geomsrv import msg  # noqa: E402
from geomsrv.ros import convert  # noqa: E402
from geomsrv.ros.node import GeomsrvNode  # noqa: E402

DEADLINE = 10.0  # [s]; generous, because a shared machine may be busy
IDENTITY = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)


def _claim_domain() -> tuple[int, socket.socket]:
    """A domain that no other test session on this machine has: whoever holds the port has the domain."""
    for domain in range(1, 101):
        claim = socket.socket()
        try:
            claim.bind(("127.0.0.1", 22000 + domain))
        except OSError:
            claim.close()
        else:
            return domain, claim
    raise RuntimeError("all ROS domains are in use")


DOMAIN, _CLAIM = _claim_domain()


def make_context() -> rclpy.Context:
    """A context of its own: own participant, on the domain of this session."""
    context = rclpy.Context()
    rclpy.init(context=context, domain_id=DOMAIN)
    return context


class NodeUnderTest:
    """The node in this process, spinning in a thread, with its log kept."""

    def __init__(self, namespace: str = "", **parameters: Any) -> None:
        self.context = make_context()
        overrides = [Parameter(name.replace("__", "."), value=value) for name, value in parameters.items()]
        self.node = GeomsrvNode(context=self.context, namespace=namespace, parameter_overrides=overrides)
        self.errors: list[BaseException] = []
        self._executor = SingleThreadedExecutor(context=self.context)
        self._executor.add_node(self.node)
        self._thread = threading.Thread(target=self._spin, daemon=True)
        self._thread.start()

    def _spin(self) -> None:
        try:
            self._executor.spin()
        except ExternalShutdownException:
            pass
        except BaseException as error:  # a callback raised out of the executor: the tests that follow must fail
            self.errors.append(error)
            raise

    def stop(self) -> None:
        """Destroy the node as main() does; fails if a callback had raised."""
        self._executor.shutdown()
        self._thread.join(DEADLINE)
        self.node.destroy_node()
        rclpy.shutdown(context=self.context)
        assert not self._thread.is_alive()
        assert not self.errors, self.errors


@contextmanager
def running_node(namespace: str = "", **parameters: Any) -> Iterator[NodeUnderTest]:
    """A node for the length of a block; parameters by name with "__" for ".".

    Beside another node it needs a namespace of its own: of two services with one name either may answer.
    """
    node = NodeUnderTest(namespace, **parameters)
    try:
        yield node
    finally:
        node.stop()


class Inbox:
    """What has come in on a topic."""

    def __init__(self, client: Client, messages: list[Any]) -> None:
        self._client = client
        self.messages = messages

    def wait(self, condition: Callable[[Any], Any] = lambda _: True, what: str = "a message") -> Any:
        """First message not yet looked at that meets `condition`; those before it are dropped."""

        def found() -> bool:
            while self.messages and not condition(self.messages[0]):
                self.messages.pop(0)
            return bool(self.messages)

        self._client.until(found, what)
        return self.messages.pop(0)


class Client:
    """Another participant: calls, publishes, listens.  It spins in the test's own thread, while the test waits."""

    def __init__(self, name: str = "tester", server: str = "/geomsrv") -> None:
        self.context = make_context()
        self.node = rclpy.create_node(name, context=self.context)
        self.server = server
        self._executor = SingleThreadedExecutor(context=self.context)
        self._executor.add_node(self.node)
        self._services: dict[str, Any] = {}

    def until(self, condition: Callable[[], Any], what: str, seconds: float = DEADLINE) -> None:
        """Spin until `condition` holds; fail naming `what` after the deadline."""
        clock = self.node.get_clock()
        end = clock.now().nanoseconds + int(seconds * 1e9)
        while not condition():
            assert clock.now().nanoseconds < end, f"not within {seconds:g} s: {what}"
            self._executor.spin_once(timeout_sec=0.02)

    def _full(self, name: str) -> str:
        return name if name.startswith("/") else f"{self.server}/{name}"

    def service(self, kind: Any, name: str) -> Any:
        """A client whose service is there."""
        full = self._full(name)
        if full not in self._services:
            self._services[full] = self.node.create_client(kind, full)
        self.until(self._services[full].service_is_ready, f"service {full}")
        return self._services[full]

    def call(self, kind: Any, name: str, request: Any = None, seconds: float = DEADLINE, **fields: Any) -> Any:
        """The response to a request, given whole or by its fields."""
        future = self.service(kind, name).call_async(kind.Request(**fields) if request is None else request)
        self.until(future.done, f"answer of {name}", seconds)
        return future.result()

    def services_of(self, node: str) -> dict[str, list[str]]:
        """Names and types of a node's services; empty as long as the node is unknown."""
        try:
            return dict(self.node.get_service_names_and_types_by_node(node, "/"))
        except NodeNameNonExistentError:
            return {}

    def listen(self, kind: Any, topic: str, qos: QoSProfile | int = 10) -> Inbox:
        """An inbox for a topic that is connected to the node."""
        messages: list[Any] = []
        subscription = self.node.create_subscription(kind, self._full(topic), messages.append, qos)
        self.until(lambda: self.node.count_publishers(subscription.topic_name) > 0, f"publisher of {topic}")
        return Inbox(self, messages)

    def publisher(self, kind: Any, topic: str, qos: QoSProfile | int = 10, connected: bool = True) -> Any:
        """A publisher that is connected to the node."""
        publisher = self.node.create_publisher(kind, self._full(topic), qos)
        if connected:
            self.until(publisher.get_subscription_count, f"subscription of {topic}")
        return publisher

    def close(self) -> None:
        """Leave."""
        self._executor.shutdown()
        self.node.destroy_node()
        rclpy.shutdown(context=self.context)


def body(name: str, shape: Any, position: Any = (0.0, 0.0, 0.0), velocity: Any = (0.0, 0.0, 0.0), **fields: Any) -> Any:
    """A SceneObject message without rotation."""
    message = msg.SceneObject(id=name, **fields)
    convert.set_shape(message.shape, shape)
    convert.set_pose(message.pose, [*position, 0.0, 0.0, 0.0, 1.0])
    convert.set_twist(message.twist, [*velocity, 0.0, 0.0, 0.0])
    return message


def inline(*shapes: Any) -> list[Any]:
    """Shape messages."""
    messages = [msg.Shape() for _ in shapes]
    for message, shape in zip(messages, shapes, strict=True):
        convert.set_shape(message, shape)
    return messages


def vectors(flat: Any, width: int = 3) -> np.ndarray:
    """A flat field as rows."""
    return np.asarray(flat, dtype=float).reshape(-1, width)
