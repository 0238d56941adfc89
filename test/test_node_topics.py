# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""Every topic of a running node: what goes in, what comes out, what is refused and where it says so."""

from __future__ import annotations

import array
import math
import sys
from importlib.machinery import ModuleSpec
from types import ModuleType, SimpleNamespace

import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import Point32, PolygonInstanceStamped
from ros_helpers import Client, body, running_node
from sensor_msgs.msg import CameraInfo
from visualization_msgs.msg import Marker, MarkerArray

import geomsrv as gs
from geomsrv import msg, srv
from geomsrv.ros.node import DIAGNOSTICS, INPUTS, OUTPUTS, STATE

QOS = {topic.name: topic.qos for topic in (*INPUTS, *OUTPUTS, STATE, DIAGNOSTICS)}


@pytest.fixture(scope="module")
def node():
    with running_node(max_rate=1000.0, markers__rate=100.0, max_distance=1.0, horizon=5.0) as running:
        yield running


@pytest.fixture(scope="module")
def shared(node):
    client = Client()
    yield client
    client.close()


@pytest.fixture
def client(shared):
    assert shared.call(srv.ApplyScene, "apply_scene", update=msg.SceneUpdate(clear=True)).status == 0
    return shared


@pytest.fixture(scope="module")
def ports(shared):
    """Publishers to every input."""
    return {topic.name: shared.publisher(topic.type, topic.name, topic.qos) for topic in INPUTS}


@pytest.fixture(scope="module")
def inboxes(shared):
    """Subscriptions to every output."""
    return {topic.name: shared.listen(topic.type, topic.name, topic.qos) for topic in (*OUTPUTS, STATE, DIAGNOSTICS)}


def stamped(message, seconds: int, frame: str = "world"):
    message.header.stamp.sec, message.header.frame_id = seconds, frame
    return message


def polygon(number: int, points, seconds: int, frame: str = "world", z=0.0) -> PolygonInstanceStamped:
    message = stamped(PolygonInstanceStamped(), seconds, frame)
    message.polygon.id = number
    heights = np.broadcast_to(z, len(points))
    message.polygon.polygon.points = [
        Point32(x=float(x), y=float(y), z=float(h)) for (x, y), h in zip(points, heights, strict=True)
    ]
    return message


SQUARE = np.array([[0.0, 0], [1, 0], [1, 1], [0, 1]])


def of_time(seconds: int):
    return lambda message: message.header.stamp.sec == seconds


def diagnosis(inboxes, name: str, condition):
    """The first status of that name that meets the condition."""

    def matches(message: DiagnosticArray) -> bool:
        return any(status.name.endswith(f": {name}") and condition(status) for status in message.status)

    message = inboxes["/diagnostics"].wait(matches, f"diagnosis of {name}")
    return next(status for status in message.status if status.name.endswith(f": {name}"))


def refused(node, client, topic: str, text: str, publish) -> None:
    """Publish what must be refused; its record, which state and diagnostics repeat once a second, names the fault."""
    record = node.node._inputs.records[topic]
    count = record.refused
    publish()
    client.until(lambda: record.refused > count, f"refusal on {topic}")
    assert record.refused_last and text in record.fault, record.fault


def test_shapes_are_evaluated_and_results_carry_their_time(client, ports, inboxes) -> None:
    update = stamped(msg.SceneUpdate(), 1001)
    update.add = [body("ball", gs.Sphere(0.5), (2, 0, 0)), body("box", gs.Box([1, 1, 1])), body("in", gs.Sphere(0.5))]
    ports["shapes"].publish(update)
    got = inboxes["contacts"].wait(of_time(1001))
    assert got.header.frame_id == "world" and got.horizon == 5.0 and got.cost.accuracy == "float64"
    (contact,) = got.contacts
    assert (contact.id_a, contact.id_b, contact.status) == ("box", "in", contact.OVERLAPPING)
    assert contact.time == 0.0 and contact.depth == pytest.approx(1.5) and len(contact.points) == 1
    near = inboxes["distances"].wait(of_time(1001))
    assert near.max_distance == 1.0 and near.scene_version == got.scene_version
    found = {(pair.id_a, pair.id_b): pair for pair in near.distances}
    assert found["ball", "box"].distance == 0.5 and found["ball", "box"].point_a.x == 1.5
    assert found["box", "in"].distance == pytest.approx(-1.5), "penetration depth"
    assert [pair.distance for pair in near.distances] == sorted(pair.distance for pair in near.distances)
    assert found["ball", "in"].normal.x == -1.0


def test_empty_means_checked_none_found(client, ports, inboxes) -> None:
    ports["shapes"].publish(stamped(msg.SceneUpdate(clear=True), 1002))
    assert inboxes["contacts"].wait(of_time(1002)).contacts == []
    assert inboxes["distances"].wait(of_time(1002)).distances == []
    ports["shapes"].publish(stamped(msg.SceneUpdate(add=[body("alone", gs.Sphere(1.0))]), 1003))
    got = inboxes["contacts"].wait(of_time(1003))
    assert got.contacts == [] and got.checked == 0
    assert inboxes["distances"].wait(of_time(1003)).distances == []


def states(seconds: int, ids, positions, twists=None, **fields):
    message = stamped(msg.ShapeStates(ids=ids, **fields), seconds)
    message.poses = array.array("d", [x for p in positions for x in (*p, 0.0, 0.0, 0.0, 1.0)])
    if twists is not None:
        message.twists = array.array("d", np.ravel(twists).astype(float))
    return message


def test_states_move_objects(client, ports, inboxes) -> None:
    update = stamped(msg.SceneUpdate(), 1010)
    update.add = [body("a", gs.Sphere(0.5)), body("b", gs.Sphere(0.5), (9, 0, 0))]
    ports["shapes"].publish(update)
    inboxes["distances"].wait(of_time(1010))
    ports["states"].publish(states(1011, ["b", "a"], [(2, 0, 0), (0.5, 0, 0)], ids_key=5))
    (pair,) = inboxes["distances"].wait(of_time(1011)).distances
    assert pair.distance == 0.5
    # Without ids: the same objects as in the last message that named them.
    ports["states"].publish(states(1012, [], [(1.75, 0, 0), (0.5, 0, 0)], ids_key=5))
    (pair,) = inboxes["distances"].wait(of_time(1012)).distances
    assert pair.distance == 0.25
    ports["states"].publish(states(1013, ["a"], [(1, 0, 0)], [[0, 0, 1, 0, 0, 0]]))
    inboxes["distances"].wait(of_time(1013))
    got = {item.id: item for item in client.call(srv.GetScene, "get_scene").scene.add}
    assert got["a"].twist.linear.z == 1.0 and got["a"].pose.position.x == 1.0 and got["b"].pose.position.x == 1.75


@pytest.mark.parametrize(
    ("message", "text"),
    [
        (states(1, ["nobody"], [(0, 0, 0)]), "nobody"),
        (states(1, ["a"], [(0, 0, 0), (1, 0, 0)]), "1 ids, but poses of 2 objects"),
        (states(1, [], [(0, 0, 0)], ids_key=99), "no ids, and none were sent before with ids_key 99"),
        (states(1, ["a"], [(math.nan, 0, 0)]), "nan"),
        (states(1, ["a"], [(0, 0, 0)], [[0, 0, 0]]), "twists must hold 6 numbers"),
        (stamped(states(1, ["a"], [(0, 0, 0)]), 1, "odom"), "frame 'odom' is not the fixed frame 'world'"),
        (msg.ShapeStates(ids=["a"], poses=array.array("d", [0.0] * 6)), "poses must hold 7 numbers"),
        (msg.ShapeStates(ids=["a"], poses=array.array("d", [0.0] * 7)), "norm 1"),
        (states(1, ["a", "a"], [(0, 0, 0), (1, 0, 0)]), "a"),
    ],
)
def test_states_that_do_not_fit_are_reported_not_applied(client, ports, node, message, text) -> None:
    client.call(srv.ApplyScene, "apply_scene", update=msg.SceneUpdate(add=[body("a", gs.Sphere(0.5))]))
    before = client.call(srv.GetScene, "get_scene")
    refused(node, client, "states", text, lambda: ports["states"].publish(message))
    assert client.call(srv.GetScene, "get_scene") == before


def test_faulty_shapes_are_reported_not_applied(client, ports, inboxes) -> None:
    before = client.call(srv.GetScene, "get_scene")
    ports["shapes"].publish(msg.SceneUpdate(add=[body("x", gs.Sphere(1.0), (0, math.inf, 0))]))
    status = diagnosis(inboxes, "inputs", lambda s: "~/shapes refused" in s.message)
    assert "'x'" in status.message and "inf" in status.message and status.level == b"\x01"
    state = inboxes["state"].wait(lambda m: "'x'" in m.input_faults[0])
    assert state.input_refused[0] == 1 and list(state.input_topics)[0] == "~/shapes"
    assert client.call(srv.GetScene, "get_scene") == before


def test_polygons_move_by_their_last_two_instances(client, ports, inboxes) -> None:
    ports["polygons"].publish(polygon(1, SQUARE, 2000))
    ports["polygons"].publish(polygon(2, SQUARE + (3.0, 0.25), 2000))
    ports["polygons"].publish(polygon(1, SQUARE + (0.5, 0), 2001))
    got = inboxes["contacts"].wait(of_time(2001))
    (contact,) = got.contacts
    assert {contact.id_a, contact.id_b} == {"polygon/1", "polygon/2"} and contact.status == contact.WILL_TOUCH
    assert contact.time == 3.0
    assert contact.time_lower < contact.time < contact.time_upper, "float32 has a floor"
    assert contact.time_upper - contact.time_lower < 1e-4
    assert sorted(point.y for point in contact.points) == [0.25, 1.0] and contact.normal.x == 1.0
    scene = {item.id: item for item in client.call(srv.GetScene, "get_scene").scene.add}
    moving = scene["polygon/1"]
    assert moving.twist.linear.x == pytest.approx(0.5, abs=1e-6) and moving.uncertainty > 0
    assert 0 < moving.velocity_uncertainty < 1e-6 and moving.motion_fault == ""


def test_other_motions_are_unsupported_by_name(client, ports, inboxes) -> None:
    ports["polygons"].publish(polygon(3, SQUARE + (4.0, 0), 2010))
    ports["polygons"].publish(polygon(4, SQUARE, 2010))
    ports["polygons"].publish(polygon(4, SQUARE[[0, 1, 2]] @ [[0.8, 0.6], [-0.6, 0.8]], 2011))
    got = inboxes["contacts"].wait(lambda m: m.header.stamp.sec == 2011)
    (contact,) = got.contacts
    assert contact.status == contact.UNSUPPORTED and "not a translation" in contact.note
    assert math.isnan(contact.time)
    request = srv.FirstContact.Request(select=0, ids_a=["polygon/4"], ids_b=["polygon/3"], horizon=9.0)
    answer = client.call(srv.FirstContact, "first_contact", request)
    assert answer.status == answer.UNSUPPORTED and "not a translation" in answer.message


@pytest.mark.parametrize(
    ("message", "text"),
    [
        (polygon(7, SQUARE[::-1], 2020), "polygon/7: polygon is clockwise"),
        (polygon(7, [(0, 0), (2, 0), (1, 0.5), (1, 2)], 2020), "polygon/7: polygon is not convex"),
        (polygon(7, [(0, 0), (math.nan, 0), (0, 1)], 2020), "polygon/7: point 1 is"),
        (polygon(7, SQUARE, 2020, z=[0, 0, 0.1, 0]), "polygon/7: z is not the same"),
        (polygon(7, SQUARE, 2020, z=0.5), "polygon/7: z is 0.5"),
        (polygon(7, [], 2020), "polygon/7: polygon has no points"),
        (polygon(7, SQUARE, 2020, frame="odom"), "polygon/7: frame 'odom'"),
    ],
)
def test_bad_polygons_are_refused_by_name(client, ports, node, message, text) -> None:
    before = client.call(srv.GetScene, "get_scene")
    refused(node, client, "polygons", text, lambda: ports["polygons"].publish(message))
    assert client.call(srv.GetScene, "get_scene") == before, "the node keeps serving"


def test_refused_polygons_are_diagnosed(client, ports, inboxes) -> None:
    ports["polygons"].publish(polygon(7, SQUARE[::-1], 2021))
    status = diagnosis(inboxes, "inputs", lambda s: "polygon/7: polygon is clockwise" in s.message)
    assert status.level == b"\x01"
    ports["polygons"].publish(polygon(7, SQUARE, 2022))
    diagnosis(inboxes, "inputs", lambda s: "polygon/7" not in s.message)


def camera_info(seconds: int, frame: str) -> CameraInfo:
    info = stamped(CameraInfo(width=640, height=480), seconds, frame)
    info.k = np.array([320.0, 0, 320, 0, 240, 240, 0, 0, 1])
    return info


def test_camera_info_shows_what_is_visible(client, ports, inboxes) -> None:
    update = msg.SceneUpdate(add=[body("seen", gs.Sphere(0.5), (0, 0, 5)), body("behind", gs.Sphere(0.5), (0, 0, -5))])
    client.call(srv.ApplyScene, "apply_scene", update=update)
    ports["camera_info"].publish(camera_info(3000, "world"))
    got = inboxes["visible"].wait(of_time(3000))
    assert list(got.ids) == ["seen"] and list(got.states) == [got.INSIDE] and list(got.certain) == [1]
    assert got.checked == 2 and (got.frustum.near, got.frustum.far) == (0.1, 10.0)
    answer = client.call(srv.Cull, "cull", select=2, view=0)
    assert dict(zip(answer.ids, answer.states, strict=True)) == {"behind": 0, "seen": 2}
    client.call(srv.ApplyScene, "apply_scene", update=msg.SceneUpdate(remove=["seen"]))
    assert inboxes["visible"].wait(lambda m: m.checked == 1).ids == []


def test_camera_frames_that_nobody_knows_are_refused(client, ports, inboxes) -> None:
    ports["camera_info"].publish(camera_info(3001, "optical"))
    status = diagnosis(inboxes, "inputs", lambda s: "~/camera_info refused" in s.message)
    assert "'optical'" in status.message and "tf2_ros" in status.message and "camera.frame" in status.message


def test_markers(client, ports, inboxes) -> None:
    box = inboxes["markers"]
    shapes = [
        ("sphere", gs.Sphere(0.1), [Marker.SPHERE]),
        ("box", gs.Box([0.1, 0.2, 0.3]), [Marker.CUBE]),
        ("capsule", gs.Capsule(0.1, 0.4), [Marker.CYLINDER, Marker.SPHERE, Marker.SPHERE]),
        ("hull", gs.Convex(np.eye(3)), [Marker.TRIANGLE_LIST]),
        ("polygon", gs.Polygon(SQUARE), [Marker.LINE_STRIP]),
    ]
    update = stamped(msg.SceneUpdate(), 4000)
    update.add = [body(name, shape, (3.0 * i, 3.0 * i, 0)) for i, (name, shape, _) in enumerate(shapes)]
    ports["shapes"].publish(update)

    def drawn(message: MarkerArray) -> dict:
        found: dict = {}
        for marker in message.markers:
            if marker.action == Marker.ADD:
                found.setdefault(marker.ns, []).append(marker.type)
        return found

    got = box.wait(lambda m: "shapes/polygon" in drawn(m))
    assert {name: types for name, types in drawn(got).items() if name.startswith("shapes/")} == {
        f"shapes/{name}": types for name, _, types in shapes
    }
    cube = next(marker for marker in got.markers if marker.ns == "shapes/box")
    assert (cube.scale.x, cube.scale.y, cube.scale.z) == (0.2, 0.4, 0.6) and cube.pose.position.x == 3.0
    assert cube.header.frame_id == "world"
    ports["shapes"].publish(stamped(msg.SceneUpdate(remove=["capsule"]), 4001))
    gone = box.wait(lambda m: any(marker.action == Marker.DELETE for marker in m.markers))
    deleted = [(marker.ns, marker.id) for marker in gone.markers if marker.action == Marker.DELETE]
    assert deleted == [("shapes/capsule", k) for k in range(3)]


def test_contact_markers(client, ports, inboxes) -> None:
    ports["shapes"].publish(
        msg.SceneUpdate(
            add=[body("a", gs.Polygon(SQUARE), velocity=(1, 0, 0)), body("b", gs.Polygon(SQUARE), (3, 0, 0))]
        )
    )
    got = inboxes["markers"].wait(lambda m: any(marker.ns == "contacts" and marker.action == 0 for marker in m.markers))
    types = [marker.type for marker in got.markers if marker.ns == "contacts"]
    assert types == [Marker.SPHERE_LIST, Marker.ARROW]
    arrow = next(marker for marker in got.markers if marker.type == Marker.ARROW)
    assert arrow.points[1].x > arrow.points[0].x == 3.0


def test_state(client, ports, inboxes) -> None:
    update = msg.SceneUpdate(add=[body("a", gs.Sphere(1.0), velocity=(1, 0, 0)), body("b", gs.Sphere(1.0), (9, 0, 0))])
    version = client.call(srv.ApplyScene, "apply_scene", update=update).version
    state = inboxes["state"].wait(lambda m: m.scene_version >= version)
    assert (state.object_count, state.moving_count, state.enabled) == (2, 1, True)
    plan = dict(zip(state.plan_stages, zip(state.plan_active, state.plan_reasons, strict=True), strict=True))
    assert plan["distance"] == (1, "asked for by ~/distances") and plan["cross_check"][0] == 0
    assert plan["rotation"] == (0, "no shape has angular velocity")
    assert "2 solids" in state.scene_plan
    counters = dict(zip(state.counter_names, state.counter_values, strict=True))
    assert counters["evaluations"] > 0 and counters["distance"] > 0 and "cross_check" not in counters
    client.call(srv.Distance, "distance", select=2, max_distance=20.0, accuracy="exact")
    state = inboxes["state"].wait(lambda m: "~/distance" in m.cost_queries)
    columns = (state.cost_tiers, state.cost_calls, state.cost_items, state.cost_ns)
    costs = {(query, tier): rest for query, tier, *rest in zip(state.cost_queries, *columns, strict=True)}
    assert costs["~/distance", "exact"][:2] == [1, 1] and costs["~/distance", "exact"][2] > 0
    assert costs["~/distances", "float64"][0] >= 1
    assert list(state.input_topics) == ["~/shapes", "~/states", "~/polygons", "~/camera_info"]
    assert len(state.input_ages) == len(state.input_received) == len(state.input_refused) == 4
    assert state.cross_check_mode == "off" and state.qos_mismatches == []


def test_late_joiners_get_state_and_markers(node, client, ports) -> None:
    client.call(srv.ApplyScene, "apply_scene", update=msg.SceneUpdate(add=[body("here", gs.Sphere(1.0))]))
    late = Client("late")
    try:
        got = late.listen(MarkerArray, "markers", QOS["markers"]).wait(
            lambda m: any(marker.ns == "shapes/here" for marker in m.markers)
        )
        assert got.markers
        # The kept state is there at once, before the next one of the second.
        late.listen(msg.EngineState, "state", QOS["state"]).wait()
    finally:
        late.close()


def test_stalled_states_are_noticed(client, ports, inboxes) -> None:
    client.call(srv.ApplyScene, "apply_scene", update=msg.SceneUpdate(add=[body("a", gs.Sphere(0.5))]))
    ports["states"].publish(states(5000, ["a"], [(0, 0, 0)]))
    status = diagnosis(inboxes, "inputs", lambda s: "~/states stopped" in s.message)
    assert status.level == b"\x01"


def test_with_tf2_other_frames_are_transformed(monkeypatch) -> None:
    """A stand-in for tf2_ros, which the wheels lack: "arm" is 10 m along x, turned by 90 degrees about z."""
    tf2 = ModuleType("tf2_ros")
    tf2.__spec__ = ModuleSpec("tf2_ros", None)

    class Buffer:
        def __init__(self, node) -> None:
            assert node.get_name() == "geomsrv"

        def lookup_transform(self, target, source, time):
            if (target, source) != ("world", "arm"):
                raise LookupError(f"no {source}")
            translation = SimpleNamespace(x=10.0, y=0.0, z=0.0)
            return SimpleNamespace(
                transform=SimpleNamespace(
                    translation=translation, rotation=SimpleNamespace(x=0.0, y=0.0, z=math.sqrt(0.5), w=math.sqrt(0.5))
                )
            )

    tf2.Buffer, tf2.TransformListener = Buffer, lambda buffer, node: None
    monkeypatch.setitem(sys.modules, "tf2_ros", tf2)
    client = Client("framed", "/framed/geomsrv")
    try:
        with running_node("/framed", max_rate=1000.0) as node:
            add = [body("a", gs.Sphere(0.5), (1, 0, 0), (1, 0, 0), frame="arm"), body("b", gs.Sphere(0.5), frame="leg")]
            got = client.call(srv.ApplyScene, "apply_scene", update=msg.SceneUpdate(add=add))
            assert got.ids == ["b"] and "'leg'" in got.faults[0] and "no leg" in got.faults[0]
            assert client.call(srv.ApplyScene, "apply_scene", update=msg.SceneUpdate(add=add[:1])).status == 0

            def placed() -> list[float]:
                (item,) = client.call(srv.GetScene, "get_scene", ids=["a"]).scene.add
                position, velocity = item.pose.position, item.twist.linear
                return [round(x, 9) for x in (position.x, position.y, velocity.x, velocity.y)]

            assert placed() == [10.0, 1.0, 0.0, 1.0]
            port = client.publisher(msg.ShapeStates, "states", QOS["states"])
            message = stamped(states(1, ["a"], [(2, 0, 0)], [[0, 1, 0, 0, 0, 0]]), 1, "arm")
            client.until(lambda: port.publish(message) or placed() == [10.0, 2.0, -1.0, 0.0], "the new state")
            polygons = client.publisher(PolygonInstanceStamped, "polygons", QOS["polygons"])
            polygons.publish(polygon(1, SQUARE, 1, "arm"))
            client.until(lambda: "polygon/1" in node.node._engine.scene, "the polygon")
            ring = node.node._engine.scene["polygon/1"]
            corners = {tuple(np.round(p + ring.pose[:2], 6)) for p in ring.shape.vertices}
            assert corners == {(10, 0), (10, 1), (9, 1), (9, 0)}
            refused(node, client, "polygons", "'leg'", lambda: polygons.publish(polygon(1, SQUARE, 2, "leg")))
            camera = client.publisher(CameraInfo, "camera_info", QOS["camera_info"])
            client.until(lambda: camera.publish(camera_info(1, "arm")) or node.node._engine.camera, "the camera")
            assert node.node._engine.camera.origin.tolist() == [10, 0, 0]
    finally:
        client.close()


def test_a_failing_evaluation_is_diagnosed_and_survived(client, ports, inboxes, node, monkeypatch) -> None:
    def broken(*_, **__):
        raise ZeroDivisionError("a bug in a query")

    monkeypatch.setattr(node.node._engine.scene, "first_contacts", broken)
    ports["shapes"].publish(stamped(msg.SceneUpdate(add=[body("a", gs.Sphere(1.0))]), 6000))
    status = diagnosis(inboxes, "engine", lambda s: s.level == b"\x02")
    assert "failed" in status.message
    assert client.call(srv.Distance, "distance", select=2).status == 0, "services go on"
    monkeypatch.undo()
    ports["shapes"].publish(stamped(msg.SceneUpdate(add=[body("b", gs.Sphere(1.0))]), 6001))
    assert inboxes["contacts"].wait(of_time(6001)).contacts
    diagnosis(inboxes, "engine", lambda s: s.level == b"\x00")
