# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""Demo: a geomsrv node in one process, this client in another, a Panda swinging over a table between them.

Publishes the world, streams a moving obstacle, polygons and a camera, asks the node the three questions, listens to
its topics, prints what it answered and writes a picture.  Exit status 0 only if every answer arrived, agrees with what
the world was built to give, and the cross-check against FCL found no unexplained difference.
"""

from __future__ import annotations

import argparse
import array
import os
import signal
import statistics
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

# Before rclpy: stay on this machine, and apart from whatever else runs on it.
os.environ.setdefault("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
os.environ.setdefault("ROS_DOMAIN_ID", str(1 + os.getpid() % 100))

import cell  # noqa: E402
import numpy as np  # noqa: E402
import picture  # noqa: E402
import rclpy  # noqa: E402
from geometry_msgs.msg import Point32, PolygonInstanceStamped  # noqa: E402
from rclpy.executors import SingleThreadedExecutor  # noqa: E402
from rclpy.node import Node  # noqa: E402
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy, qos_profile_sensor_data  # noqa: E402
from rich.console import Console  # noqa: E402
from rich.markup import escape  # noqa: E402
from rich.table import Table  # noqa: E402
from sensor_msgs.msg import CameraInfo  # noqa: E402
from std_srvs.srv import Trigger  # noqa: E402

import geomsrv as gs  # noqa: E402
from geomsrv import msg as gm  # noqa: E402
from geomsrv import srv as gv  # noqa: E402
from geomsrv.robot import Robot  # noqa: E402
from geomsrv.ros import convert  # noqa: E402

ANSWER_DEADLINE_S = 20.0
HORIZON_S = 5.0
MAX_DISTANCE_M = 0.5
TIMED_CALLS = 50
TIMED_QUERIES = 15
SURELY_S = 1e-5  # much longer than the time in which a contact is proven, and than what rounding moves it by
LATCHED = QoSProfile(depth=100, reliability=ReliabilityPolicy.RELIABLE, durability=DurabilityPolicy.TRANSIENT_LOCAL)
STATE = QoSProfile(depth=1, reliability=ReliabilityPolicy.RELIABLE, durability=DurabilityPolicy.TRANSIENT_LOCAL)
BEST_EFFORT = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)


TOPICS: dict[str, tuple[type, QoSProfile | int]] = {
    "contacts": (gm.ContactArray, 10),
    "distances": (gm.DistanceArray, 10),
    "visible": (gm.VisibleArray, 10),
    "state": (gm.EngineState, STATE),
}


class DemoFailure(Exception):
    """The demo did not get what it was promised; the message says what."""


class Client:
    """Publishers, subscriptions and service clients of the demo, spinning in a thread of their own."""

    def __init__(self) -> None:
        self._context = rclpy.Context()
        rclpy.init(context=self._context)
        self.node = Node("geomsrv_demo", context=self._context)
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self.node)
        self._news = threading.Condition()
        self.latest: dict[str, Any] = {}
        self.shapes = self.node.create_publisher(gm.SceneUpdate, "/geomsrv/shapes", LATCHED)
        self.states = self.node.create_publisher(gm.ShapeStates, "/geomsrv/states", BEST_EFFORT)
        self.polygons = self.node.create_publisher(PolygonInstanceStamped, "/geomsrv/polygons", 10)
        self.camera = self.node.create_publisher(CameraInfo, "/geomsrv/camera_info", qos_profile_sensor_data)
        self._subscriptions = {topic: self._listen(topic) for topic in TOPICS}
        self._services = {
            name: self.node.create_client(kind, f"/geomsrv/{name}")
            for name, kind in (
                ("cull", gv.Cull),
                ("distance", gv.Distance),
                ("first_contact", gv.FirstContact),
                ("get_scene", gv.GetScene),
                ("self_check", Trigger),
            )
        }
        self._thread = threading.Thread(target=self._executor.spin, daemon=True)
        self._thread.start()

    def _listen(self, topic: str) -> Any:
        kind, qos = TOPICS[topic]
        return self.node.create_subscription(kind, f"/geomsrv/{topic}", self._keep(topic), qos)

    def listen_to(self, *topics: str) -> None:
        """These and ~/state, and nothing else."""
        for topic in [topic for topic in self._subscriptions if topic not in (*topics, "state")]:
            self.node.destroy_subscription(self._subscriptions.pop(topic))
            self.latest.pop(topic, None)
        for topic in topics:
            if topic not in self._subscriptions:
                self._subscriptions[topic] = self._listen(topic)

    def plan_when(self, stage: str, runs: bool) -> dict[str, tuple[bool, str]]:
        """The plan once a stage runs, or does not: whether each does, and why."""

        def plan(state: Any) -> dict[str, tuple[bool, str]]:
            rows = zip(state.plan_stages, state.plan_active, state.plan_reasons, strict=True)
            return {name: (bool(active), reason) for name, active, reason in rows}

        what = f"a plan in which {stage} {'runs' if runs else 'does not run'}"
        return plan(self.wait_for("state", what, lambda state: plan(state)[stage][0] == runs))

    def _keep(self, topic: str) -> Callable[[Any], None]:
        def keep(message: Any) -> None:
            with self._news:
                self.latest[topic] = message
                self._news.notify_all()

        return keep

    def wait_for_node(self) -> None:
        """Until every service is there."""
        for name, client in self._services.items():
            if not client.wait_for_service(ANSWER_DEADLINE_S):
                raise DemoFailure(f"service ~/{name} did not appear within {ANSWER_DEADLINE_S:g} s")

    def wait_for(self, topic: str, what: str, condition: Callable[[Any], bool]) -> Any:
        """The latest message on `topic` that meets `condition`."""
        with self._news:
            if not self._news.wait_for(
                lambda: topic in self.latest and condition(self.latest[topic]), ANSWER_DEADLINE_S
            ):
                raise DemoFailure(f"no message on ~/{topic} within {ANSWER_DEADLINE_S:g} s: {what}")
            return self.latest[topic]

    def call(self, name: str, request: Any) -> Any:
        """The response of a service; a refusal is a failure of the demo, an item without a kernel is not."""
        future = self._services[name].call_async(request)
        done = threading.Event()
        future.add_done_callback(lambda _: done.set())
        if not done.wait(ANSWER_DEADLINE_S):
            raise DemoFailure(f"service ~/{name} did not answer within {ANSWER_DEADLINE_S:g} s")
        response = future.result()
        if getattr(response, "status", 0) not in (gv.Cull.Response.OK, gv.Cull.Response.UNSUPPORTED):
            raise DemoFailure(f"service ~/{name} refused: {response.message}")
        return response

    def time_calls(self, name: str, request: Any) -> float:
        """Median milliseconds of a call."""
        times = []
        for _ in range(TIMED_CALLS):
            start = time.perf_counter()
            self.call(name, request)
            times.append(1e3 * (time.perf_counter() - start))
        return statistics.median(times)

    def close(self) -> None:
        """Stop spinning and leave."""
        self._executor.shutdown()
        self._thread.join(5.0)
        self.node.destroy_node()
        rclpy.shutdown(context=self._context)


class Stream:
    """Publishes the obstacle's state, the polygons and the camera until stopped, as sensors would."""

    PERIOD_S = 0.02

    def __init__(self, client: Client) -> None:
        self._client = client
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._start = client.node.get_clock().now()
        self._thread.start()

    def _run(self) -> None:
        # A polygon's velocity is that from one message to the next.  So the last two must be of one pass: across a
        # restart they would say that everything moves back.
        tick, passes = 0, [-1, -2]
        while not (self._stop.is_set() and passes[-1] == passes[-2]):
            time.sleep(self.PERIOD_S)
            now = self._client.node.get_clock().now()
            elapsed = (now - self._start).nanoseconds * 1e-9
            self._client.states.publish(self._state(now, elapsed))
            if tick % 5 == 0:
                for mover in cell.MOVERS:
                    self._client.polygons.publish(self._polygon(mover, now, elapsed))
                passes.append(int(elapsed))
                self._client.camera.publish(self._camera(now))
            tick += 1

    @staticmethod
    def _state(now: Any, elapsed: float) -> gm.ShapeStates:
        # The obstacle comes in for two seconds, then starts over.
        position = np.add(cell.OBSTACLE_START, np.multiply(cell.OBSTACLE_VELOCITY, elapsed % 2.0))
        message = gm.ShapeStates(ids=[cell.OBSTACLE])
        message.header.stamp, message.header.frame_id = now.to_msg(), "world"
        message.poses = array.array("d", [*position, *cell.LYING])
        message.twists = array.array("d", [*cell.OBSTACLE_VELOCITY, 0.0, 0.0, 0.0])
        return message

    @staticmethod
    def _polygon(mover: cell.Mover, now: Any, elapsed: float) -> PolygonInstanceStamped:
        # They start over every second, so that the scene at any time is much like the picture's.
        ring = mover.ring + np.multiply(mover.velocity, elapsed % 1.0)
        message = PolygonInstanceStamped()
        message.header.stamp, message.header.frame_id = now.to_msg(), "world"
        message.polygon.id = mover.number
        message.polygon.polygon.points = [Point32(x=float(x), y=float(y), z=0.0) for x, y in ring]
        return message

    @staticmethod
    def _camera(now: Any) -> CameraInfo:
        message = CameraInfo(width=cell.WIDTH, height=cell.HEIGHT)
        message.header.stamp, message.header.frame_id = now.to_msg(), cell.CAMERA_FRAME
        message.k = np.ravel(cell.INTRINSICS)
        message.p = np.ravel(np.hstack([cell.INTRINSICS, np.zeros((3, 1))]))
        message.r = np.eye(3).ravel()
        return message

    def stop(self) -> None:
        """Stop publishing."""
        self._stop.set()
        self._thread.join(5.0)


def start_node() -> subprocess.Popen[bytes]:
    """The node as a process of its own."""
    parameters = {
        "cross_check.mode": "all",
        "horizon": HORIZON_S,
        "max_distance": MAX_DISTANCE_M,
        "camera.frame": cell.CAMERA_FRAME,
        "camera.near": cell.NEAR,
        "camera.far": cell.FAR,
        "camera.pose": [float(x) for x in cell.camera_pose()],
    }
    command = [
        sys.executable,
        "-P",  # not the folder we are in: in the source tree it would hide the installed package
        "-c",
        "import sys; from geomsrv.cli import main; sys.exit(main())",
        "node",
        "--ros-args",
    ]
    for name, value in parameters.items():
        command += ["-p", f"{name}:={value}"]
    command += ["--log-level", "warn"]
    return subprocess.Popen(command, stdin=subprocess.DEVNULL)


def scene_message(objects: Sequence[gs.SceneObject], allowed: Sequence[tuple[str, str]]) -> gm.SceneUpdate:
    """The world as one update."""
    message = gm.SceneUpdate(clear=True)
    message.header.frame_id = "world"
    for item in objects:
        message.add.append(gm.SceneObject())
        convert.set_object(message.add[-1], item)
    message.allow_a, message.allow_b = [a for a, _ in allowed], [b for _, b in allowed]
    return message


def show_visible(console: Console, response: Any) -> None:
    """What the camera sees."""
    table = Table(title="Visible", title_justify="left")
    table.add_column("state")
    table.add_column("objects")
    for state in (gs.INSIDE, gs.INTERSECTS):
        seen = [cell.NAMES.get(i, i) for i, s in zip(response.ids, response.states, strict=True) if s == state]
        table.add_row(state.name, ", ".join(seen) or "-")
    unseen = sum(s == gs.OUTSIDE for s in response.states)
    table.add_row(gs.OUTSIDE.name, f"{unseen} of {len(response.ids)}")
    console.print(table)


def show_distances(console: Console, response: Any, ours: set[str]) -> int:
    """Contacts now and the robot's clearances; returns the row of the robot's nearest pair."""
    names = cell.NAMES
    table = Table(title="Distance", title_justify="left")
    for heading in ("pair", "distance [mm]", "proven to within [mm]"):
        table.add_column(escape(heading), justify="left" if heading == "pair" else "right")
    order = np.argsort(np.asarray(response.distance), kind="stable").tolist()
    robot_rows = [i for i in order if len({response.ids_a[i], response.ids_b[i]} & ours) == 1]
    if not robot_rows:
        raise DemoFailure(f"no object within {MAX_DISTANCE_M:g} m of the robot")
    touching = [i for i in order if response.distance[i] <= 0.0]
    for i in [*touching, *robot_rows[:4]]:
        table.add_row(
            f"{names.get(response.ids_a[i], response.ids_a[i])} - {names.get(response.ids_b[i], response.ids_b[i])}",
            f"{1e3 * response.distance[i]:.6f}",
            f"{1e3 * (response.upper[i] - response.lower[i]):.1e}",
        )
    console.print(table)
    return int(robot_rows[0])


def show_contacts(console: Console, response: Any) -> list[picture.PlannedContact]:
    """Who touches whom when and where, in the plane; returns what will be drawn."""
    names = cell.NAMES
    table = Table(title=f"First contact within {HORIZON_S:g} s", title_justify="left")
    for heading in ("pair", "outcome", "time [s]", "proven width [s]", "contact set [m]"):
        table.add_column(escape(heading))
    planned = []
    for i, (a, b) in enumerate(zip(response.ids_a, response.ids_b, strict=True)):
        status = gs.ContactStatus(response.item_status[i])
        begin, end = response.point_offsets[i], response.point_offsets[i + 1]
        points = np.reshape(response.points, (-1, 3))[begin:end]
        where = "  ".join(f"({x:.3f}, {y:.3f}, {z:.3f})" for x, y, z in points[:2])
        width = response.time_upper[i] - response.time_lower[i]
        if status == gs.WILL_TOUCH or cell.IN_THE_PLANE & {a, b}:
            table.add_row(
                f"{names.get(a, a)} - {names.get(b, b)}",
                status.name,
                f"{response.time[i]:.6f}",
                f"{width:.1e}",
                where,
            )
        if status == gs.WILL_TOUCH and {a, b} <= cell.IN_THE_PLANE:
            normal = np.asarray(response.normal[3 * i : 3 * i + 2])
            planned.append(
                picture.PlannedContact(names.get(a, a), names.get(b, b), response.time[i], points[:, :2], normal)
            )
    console.print(table)
    if response.message:
        console.print(f"Named by the node: {response.message}\n")
    return planned


@dataclass(frozen=True)
class Swing:
    """First contact of the swinging arm."""

    link: str
    other: str
    time: tuple[float, float, float]  #: time, lower, upper [s]
    points: np.ndarray  #: (k, 3) [m]
    normal: np.ndarray  #: (3,)


def first_of_the_arm(response: Any, ours: set[str]) -> Swing:
    """The first contact of a link with what is no link, as the node told."""
    for i, (a, b) in enumerate(zip(response.ids_a, response.ids_b, strict=True)):
        if response.item_status[i] == gs.WILL_TOUCH and len({a, b} & ours) == 1:
            begin, end = response.point_offsets[i], response.point_offsets[i + 1]
            link, other = (a, b) if a in ours else (b, a)
            return Swing(
                link,
                other,
                (response.time[i], response.time_lower[i], response.time_upper[i]),
                np.reshape(response.points, (-1, 3))[begin:end],
                np.asarray(response.normal[3 * i : 3 * i + 3]),
            )
    raise DemoFailure("the swinging arm must hit something")


def show_motion(console: Console, swing: Swing) -> picture.PlannedContact:
    """What the arm and the robot on its arc will hit first; returns the robot's collision with the scan."""
    at, lower, upper = swing.time
    x, y, z = swing.points.mean(axis=0)
    console.print(
        f"Arm swinging at {cell.SWING['panda_joint1']:g} rad/s: {swing.link} hits {swing.other} after {at:.6f} s"
        f" (proven to {upper - lower:.1e} s) at ({x:.3f}, {y:.3f}, {z:.3f})"
    )
    scan = cell.scan()
    ahead = gs.time_to_collision(cell.FOOTPRINT_RING, (cell.DRIVE, 0.0, cell.YAW_RATE), scan)
    if ahead.first < 0:
        raise DemoFailure("the robot must hit the wall that it scans")
    point = scan[ahead.first]
    console.print(
        f"Robot on an arc of {cell.DRIVE / cell.YAW_RATE:g} m: hits the scanned wall after {ahead.earliest:.6f} s"
        f" (proven to {ahead.earliest_upper - ahead.earliest:.1e} s) at ({point[0]:.3f}, {point[1]:.3f})\n"
    )
    nowhere = np.full(2, np.nan)
    return picture.PlannedContact(cell.FOOTPRINT, "scan", ahead.earliest, point[None], nowhere)


def show_cross_check(console: Console, state: Any) -> None:
    """The tally of FCL beside the engine."""
    table = Table(title=f"Cross-check against FCL, mode {state.cross_check_mode}", title_justify="left")
    columns = ("kind", "agreed", "explained", "unexplained", "skipped")
    for heading in columns:
        table.add_column(heading, justify="left" if heading == "kind" else "right")
    for row in zip(*(getattr(state, f"cross_check_{'kinds' if c == 'kind' else c}") for c in columns), strict=True):
        table.add_row(*map(str, row))
    console.print(table)


#: Ways to ask, as arguments; and how they are called here.
WAYS: dict[str, dict[str, Any]] = {
    "bound": {"accuracy": "bound"},
    "float64": {"accuracy": "float64"},
    "auto": {"accuracy": "auto"},
    "auto, 1 mm or 1 ms": {"tolerance": 1e-3},
    "exact": {"accuracy": "exact"},
}


def show_prices(console: Console, world: gs.Scene) -> None:
    """What accuracy costs for the demo's own questions, asked in this process about the same world."""
    camera = cell.camera_frustum()
    questions: dict[str, Callable[..., Any]] = {
        "cull": lambda **how: world.cull(camera, **how),
        "distance": lambda **how: world.distances(MAX_DISTANCE_M, **how),
        "first contact": lambda **how: world.first_contacts(HORIZON_S, **how),
    }
    table = Table(title="What accuracy costs here, nothing remembered", title_justify="left")
    for heading in ("query", "asked for", "tier", "proven to within", "unanswered", "CPU time [ms]"):
        table.add_column(escape(heading), justify="right" if heading in ("unanswered", "CPU time [ms]") else "left")
    for query, ask in questions.items():
        for name, how in WAYS.items():
            times = []
            for _ in range(TIMED_QUERIES):
                world.forget()
                begin = time.thread_time()
                answer = ask(**how)
                times.append(1e3 * (time.thread_time() - begin))
            silent = len(getattr(answer, "unsupported", ()))
            proven = _proven(answer, {"cull": "", "distance": "m", "first contact": "s"}[query])
            table.add_row(query, name, answer.cost.accuracy, proven, str(silent), f"{statistics.median(times):.2f}")
    console.print(table)


def _proven(answer: Any, unit: str) -> str:
    """How many numbers or states of an answer are proven, and how well."""
    if unit == "":
        return f"{np.count_nonzero(answer.certain)} of {len(answer.certain)} states"
    lower, upper = (getattr(answer, name if hasattr(answer, name) else f"time_{name}") for name in ("lower", "upper"))
    width = (upper - lower)[~np.isnan(upper - lower)]
    proven = width[np.isfinite(width)]
    return f"{len(proven)} of {len(width)} to {proven.max(initial=0.0):.1e} {unit}"


def show_plans(console: Console, client: Client) -> None:
    """What the node computes while one topic is listened to, and when a second subscriber joins."""
    client.listen_to("visible")
    before = client.plan_when("distance", False)
    client.listen_to("visible", "contacts")
    after = client.plan_when("first_contact", True)
    first = client.wait_for("contacts", "the first message of a new subscriber", lambda message: message.checked > 0)
    table = Table(title="The plan before and after somebody listens to ~/contacts, too", title_justify="left")
    for heading in ("stage", "before", "after"):
        table.add_column(heading)
    for stage, (ran, why) in before.items():
        runs, reason = after[stage]
        table.add_row(stage, f"{'runs' if ran else '-'}: {why}", f"{'runs' if runs else '-'}: {reason}")
    console.print(table)
    console.print(f"Its first message: {first.checked} pairs checked, {len(first.contacts)} contacts\n")


def run(console: Console, path: Path) -> None:
    """The demo; raises DemoFailure where it does not get what it was promised."""
    start = time.perf_counter()
    panda = cell.robot()
    links = panda.objects(cell.JOINTS, velocities=cell.SWING)
    furniture = [*cell.furniture(), cell.footprint()]
    world = [*links, *furniture]
    allowed = cell.allowed_pairs(panda)
    vertices = sum(len(o.shape.vertices) for o in links if isinstance(o.shape, gs.Convex))
    console.print(
        f"Panda: {len(links)} collision geometries, {vertices} hull vertices, {len(panda.allowed_pairs)} allowed pairs"
        f" and {len(furniture)} other objects\n"
    )
    client = Client()
    stream = None
    try:
        client.wait_for_node()
        client.shapes.publish(scene_message(world, allowed))
        client.wait_for("state", "the scene's objects", lambda m: m.object_count >= len(world))
        stream = Stream(client)
        everything = len(world) + len(cell.MOVERS)
        client.wait_for("state", "the polygons' objects", lambda m: m.object_count >= everything)
        visible = client.wait_for("visible", "what the camera sees", lambda m: len(m.ids) > 0)
        contacts = client.wait_for(
            "contacts", "a predicted contact", lambda m: any(c.status == c.WILL_TOUCH for c in m.contacts)
        )
        stream.stop()  # from here on the world stands still, so that all answers are about the same one

        requests = {
            "cull": gv.Cull.Request(select=gv.Cull.Request.ALL, view=gv.Cull.Request.CAMERA),
            "distance": gv.Distance.Request(
                select=gv.Distance.Request.ALL_PAIRS,
                max_distance=MAX_DISTANCE_M,
                want=["distance", "witness"],
            ),
            "first_contact": gv.FirstContact.Request(
                select=gv.FirstContact.Request.ALL_PAIRS,
                horizon=HORIZON_S,
                want=["first_contact", "contact_set"],
            ),
        }
        seen = client.call("cull", requests["cull"])
        near = client.call("distance", requests["distance"])
        meet = client.call("first_contact", requests["first_contact"])
        checks = client.call("self_check", Trigger.Request())
        if not checks.success:
            raise DemoFailure(f"self check: {checks.message}")
        scene = client.call("get_scene", gv.GetScene.Request())

        show_visible(console, seen)
        nearest = show_distances(console, near, set(panda.ids))
        planned = show_contacts(console, meet)
        swing = first_of_the_arm(meet, set(panda.ids))
        collision = show_motion(console, swing)
        tally = client.wait_for(
            "state",
            "the cross-check's tally",
            lambda m: sum(m.cross_check_agreed) > 0 or m.cross_check_mode == "off",
        )
        show_cross_check(console, tally)
        medians = {name: client.time_calls(name, request) for name, request in requests.items()}
        console.print(
            "Calls: "
            + ", ".join(f"~/{name} {ms:.2f} ms" for name, ms in medians.items())
            + f" (median of {TIMED_CALLS}; the node remembers what it found of pairs that rest)"
        )
        console.print(
            f"Topics: {len(visible.ids)} visible, {len(contacts.contacts)} contacts; self check: {checks.message}"
        )
        judge(seen, near, planned, tally)
        judge_motion(swing, panda, {item.id: item for item in world}, collision)
        points = np.reshape(near.point_a, (-1, 3)), np.reshape(near.point_b, (-1, 3))
        now = {item.id: item for item in convert.update_from(scene.scene).add}
        label = f"{near.ids_a[nearest]} - {near.ids_b[nearest]}, {1e3 * near.distance[nearest]:.1f} mm"
        picture.draw(
            picture.Picture(
                objects=[item for item in now.values() if not isinstance(item.shape, gs.Polygon)],
                states=dict(zip(seen.ids, seen.states, strict=True)),
                frustum=cell.camera_frustum(),
                nearest=(points[0][nearest], points[1][nearest], label),
                touching=[points[0][i] for i, d in enumerate(near.distance) if d <= 0.0],
                swung=panda.objects(swung_joints(swing.time[0])),
                swing=(
                    swing.points,
                    swing.normal,
                    f"first contact of the arm: {swing.link} - {swing.other}, {swing.time[0]:.2f} s",
                ),
                footprints={cell.FOOTPRINT: cell.driving}
                | {mover.name: moving(now[mover.id], mover.velocity) for mover in cell.MOVERS},
                planned=planned,
                scan=cell.scan(),
                collision=collision,
            ),
            path,
        )
        show_prices(console, rebuilt(scene.scene))
        show_plans(console, client)
    finally:
        if stream is not None:
            stream.stop()
        client.close()
    console.print(f"Picture: {path}   total {time.perf_counter() - start:.1f} s")


def rebuilt(message: gm.SceneUpdate) -> gs.Scene:
    """A scene of this process with all that the node's has."""
    world = gs.Scene()
    world.apply(convert.update_from(message))
    return world


def swung_joints(t: float) -> dict[str, float]:
    """The arm's joints after `t` seconds."""
    return cell.JOINTS | {name: cell.JOINTS[name] + rate * t for name, rate in cell.SWING.items()}


def moving(item: gs.SceneObject, velocity: tuple[float, float]) -> Callable[[float], np.ndarray]:
    """Ring of a polygon in translation, at a time."""
    ring = item.shape.vertices + item.pose[:2]
    return lambda t: ring + np.multiply(velocity, t)


def judge(seen: Any, near: Any, planned: Sequence[picture.PlannedContact], tally: Any) -> None:
    """Whether the answers are those that this world was built to give."""
    state = dict(zip(seen.ids, seen.states, strict=True))
    if state.get("carton") == gs.OUTSIDE or gs.OUTSIDE not in state.values():
        raise DemoFailure("the camera must see the carton, and not everything")
    touching = {
        frozenset(p) for p, d in zip(zip(near.ids_a, near.ids_b, strict=True), near.distance, strict=True) if d <= 0
    }
    expected = {frozenset((thing, "table")) for thing in ("carton", "ball", "bottle")}
    if touching != expected:
        raise DemoFailure(
            f"what stands on the table must touch it, and nothing else; got {sorted(map(sorted, touching))}"
        )
    meetings = {frozenset((contact.id_a, contact.id_b)): len(contact.points) for contact in planned}
    if meetings.get(frozenset(("pallet", "dock"))) != 2 or meetings.get(frozenset(("cart", cell.FOOTPRINT))) != 1:
        raise DemoFailure(f"the pallet must meet the dock along an edge, the cart the robot in a point; got {meetings}")
    if tally.cross_check_mode != "off" and sum(tally.cross_check_unexplained):
        raise DemoFailure(f"the cross-check found {sum(tally.cross_check_unexplained)} unexplained differences")


def judge_motion(swing: Swing, panda: Robot, world: dict[str, gs.SceneObject], collision: Any) -> None:
    """Times of first contact against another way to find them: the bodies put where they are just before and after."""
    _, lower, upper = swing.time

    def clearance(t: float) -> float:
        link = next(item for item in panda.objects(swung_joints(t)) if item.id == swing.link)
        scene = gs.Scene()
        scene.apply(gs.SceneUpdate(add=[link, replace(world[swing.other], twist=(0.0,) * 6)]))
        return float(scene.distances(np.inf, want=("penetration",)).distance[0])

    if not (clearance(lower - SURELY_S) > 0.0 > clearance(upper + SURELY_S)):
        raise DemoFailure(f"the arm does not touch {swing.other} between {lower} s and {upper} s")
    for t, hits in ((collision.time - SURELY_S, False), (collision.time + SURELY_S, True)):
        robot, points = gs.Polygons.from_list([cell.driving(t)]), [[p] for p in cell.scan()]
        if bool(gs.intersects(robot, gs.Polygons.from_list(points)).value.any()) != hits:
            raise DemoFailure(f"the robot does not reach the scanned wall after {collision.time} s")


def main(argv: Sequence[str] | None = None) -> int:
    """Start the node, run the demo, stop the node."""
    parser = argparse.ArgumentParser(prog="geomsrv demo", description="A Panda on a table, a node and a client.")
    parser.add_argument("--picture", type=Path, default=Path("demo_output/robot_cell.png"), help="where to write it")
    arguments = parser.parse_args(argv)
    console = Console(width=120)
    node = start_node()
    try:
        run(console, arguments.picture)
    except DemoFailure as failure:
        console.print(f"[red]FAILED[/red]: {failure}")
        return 1
    finally:
        node.send_signal(signal.SIGINT)
        try:
            node.wait(10.0)
        except subprocess.TimeoutExpired:
            node.kill()
            node.wait()
    return 0


if __name__ == "__main__":
    sys.exit(main())
