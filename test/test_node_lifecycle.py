# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""Lifecycle, parameters, plan, quality of service, restart: the node as a citizen of a ROS graph."""

from __future__ import annotations

import array
import time

import pytest
from diagnostic_msgs.msg import DiagnosticArray
from lifecycle_msgs.msg import State, Transition
from lifecycle_msgs.srv import ChangeState, GetState
from rcl_interfaces.msg import Log, Parameter, ParameterType, ParameterValue
from rcl_interfaces.srv import DescribeParameters, GetParameters, SetParameters
from rclpy.exceptions import ParameterException
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy, qos_profile_sensor_data
from ros_helpers import Client, NodeUnderTest, body, running_node
from std_srvs.srv import Trigger
from visualization_msgs.msg import MarkerArray

import geomsrv as gs
from geomsrv import msg, srv
from geomsrv.config import Config, settings
from geomsrv.ros.node import DIAGNOSTICS, INPUTS, OUTPUTS, SERVICES, STATE

LATCHED = QoSProfile(depth=100, reliability=ReliabilityPolicy.RELIABLE, durability=DurabilityPolicy.TRANSIENT_LOCAL)


@pytest.fixture
def client():
    client = Client()
    yield client
    client.close()


def change(client, transition: int) -> bool:
    request = ChangeState.Request(transition=Transition(id=transition))
    return client.call(ChangeState, "change_state", request).success


def state(client) -> int:
    return client.call(GetState, "get_state").current_state.id


# ---------------------------------------------------------------------------------------------- quality of service

TABLE = {
    # name: (reliability, durability, depth)
    "shapes": ("RELIABLE", "TRANSIENT_LOCAL", 100),
    "states": ("BEST_EFFORT", "VOLATILE", 1),
    "polygons": ("RELIABLE", "VOLATILE", 10),
    "camera_info": ("BEST_EFFORT", "VOLATILE", qos_profile_sensor_data.depth),
    "contacts": ("RELIABLE", "VOLATILE", 10),
    "distances": ("RELIABLE", "VOLATILE", 10),
    "visible": ("RELIABLE", "VOLATILE", 10),
    "markers": ("RELIABLE", "TRANSIENT_LOCAL", 1),
    "state": ("RELIABLE", "TRANSIENT_LOCAL", 1),
    "/diagnostics": ("RELIABLE", "VOLATILE", 10),
}


def test_quality_of_service_is_that_of_the_table(client) -> None:
    topics = {topic.name: topic for topic in (*INPUTS, *OUTPUTS, STATE, DIAGNOSTICS)}
    assert topics.keys() == TABLE.keys()
    with running_node():
        for name, (reliability, durability, depth) in TABLE.items():
            full = name if name.startswith("/") else f"/geomsrv/{name}"
            ask = (
                client.node.get_subscriptions_info_by_topic
                if topics[name] in INPUTS
                else client.node.get_publishers_info_by_topic
            )
            client.until(
                lambda ask=ask, full=full: [e.node_name for e in ask(full)] == ["geomsrv"], f"endpoint of {full}"
            )
            (endpoint,) = ask(full)
            profile = endpoint.qos_profile
            assert (profile.reliability.name, profile.durability.name) == (reliability, durability), name
            assert topics[name].qos.depth == depth, "depth is no part of discovery"


def test_a_volatile_publisher_is_named_within_a_second(client) -> None:
    with running_node():
        log = client.listen(Log, "/rosout", LATCHED)
        diagnostics = client.listen(DiagnosticArray, "/diagnostics")
        client.until(lambda: diagnostics.messages, "diagnostics")
        diagnostics.messages.clear()
        start = time.monotonic()
        client.publisher(msg.SceneUpdate, "shapes", QoSProfile(depth=10), connected=False)

        def names_it(text: str) -> bool:
            return all(word in text for word in ("/tester", "/geomsrv/shapes", "durability", "volatile"))

        logged = log.wait(lambda message: names_it(message.msg), "a line of the log")
        array = diagnostics.wait(lambda m: any(names_it(status.message) for status in m.status), "a diagnosis")
        assert time.monotonic() - start < 1.0
        assert logged.level == 40 and logged.name == "geomsrv"
        status = next(s for s in array.status if s.name.endswith("connections"))
        assert status.level == b"\x02"
        current = client.listen(msg.EngineState, "state", STATE.qos).wait(lambda m: m.qos_mismatches)
        assert names_it(current.qos_mismatches[0])


def test_a_demanding_subscriber_is_named_and_forgotten_when_it_leaves(client) -> None:
    with running_node():
        other = Client("demanding")
        qos = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        other.node.create_subscription(msg.ContactArray, "/geomsrv/contacts", lambda _: None, qos)
        states = client.listen(msg.EngineState, "state", STATE.qos)
        text = states.wait(lambda m: m.qos_mismatches).qos_mismatches[0]
        assert "subscription of node /demanding on /geomsrv/contacts" in text and "durability" in text
        other.close()
        states.wait(lambda m: not m.qos_mismatches, "the mismatch being gone")


# ------------------------------------------------------------------------------------------------------ lifecycle


def test_without_autostart_the_node_waits(client) -> None:
    with running_node(autostart=False):
        assert state(client) == State.PRIMARY_STATE_UNCONFIGURED
        client.until(lambda: client.services_of("geomsrv"), "the node in the graph")
        assert "/geomsrv/distance" not in client.services_of("geomsrv")
        assert change(client, Transition.TRANSITION_CONFIGURE)
        assert state(client) == State.PRIMARY_STATE_INACTIVE
        refused = client.call(srv.Distance, "distance", select=2)
        assert refused.status == refused.NOT_ACTIVE and "not active" in refused.message
        update = msg.SceneUpdate(add=[body("a", gs.Sphere(1.0)), body("b", gs.Sphere(1.0), (3, 0, 0))])
        assert client.call(srv.ApplyScene, "apply_scene", update=update).status == 0, "the scene can be prepared"
        assert change(client, Transition.TRANSITION_ACTIVATE)
        assert state(client) == State.PRIMARY_STATE_ACTIVE
        assert list(client.call(srv.Distance, "distance", select=2).distance) == [1.0]


def test_every_transition_there_and_back(client) -> None:
    with running_node() as node:
        assert state(client) == State.PRIMARY_STATE_ACTIVE
        publisher = client.publisher(msg.SceneUpdate, "shapes", LATCHED)
        publisher.publish(msg.SceneUpdate(add=[body("kept", gs.Sphere(1.0))]))
        for _ in range(2):
            contacts = client.listen(msg.ContactArray, "contacts")
            client.call(srv.ApplyScene, "apply_scene", update=msg.SceneUpdate(add=[body("x", gs.Sphere(1.0))]))
            contacts.wait()
            assert change(client, Transition.TRANSITION_DEACTIVATE)
            assert client.call(srv.Cull, "cull").status == srv.Cull.Response.NOT_ACTIVE
            assert change(client, Transition.TRANSITION_ACTIVATE)
            assert client.call(srv.Distance, "distance", select=2).status == 0
            assert change(client, Transition.TRANSITION_DEACTIVATE)
            assert change(client, Transition.TRANSITION_CLEANUP)
            client.until(lambda: "/geomsrv/cull" not in client.services_of("geomsrv"), "services going away")
            assert change(client, Transition.TRANSITION_CONFIGURE)
            assert change(client, Transition.TRANSITION_ACTIVATE)
            assert not change(client, Transition.TRANSITION_CLEANUP), "not from here, and the node survives it"
            assert not change(client, 200)
        got = client.call(srv.GetScene, "get_scene")
        client.until(
            lambda: [o.id for o in client.call(srv.GetScene, "get_scene").scene.add] == ["kept"],
            "the scene on ~/shapes, which the publisher has kept",
        )
        assert got.status == 0
        assert change(client, Transition.TRANSITION_ACTIVE_SHUTDOWN)
        assert state(client) == State.PRIMARY_STATE_FINALIZED
        assert not node.errors


def test_a_transition_that_fails_is_logged_and_leaves_the_node_unconfigured(client, monkeypatch) -> None:
    from geomsrv.ros import node as module

    def broken(*_):
        raise ZeroDivisionError("no engine today")

    with running_node(autostart=False):
        log = client.listen(Log, "/rosout", LATCHED)
        monkeypatch.setattr(module, "Markers", broken)
        assert not change(client, Transition.TRANSITION_CONFIGURE)
        assert "no engine today" in log.wait(lambda m: "cannot configure" in m.msg).msg
        assert state(client) == State.PRIMARY_STATE_UNCONFIGURED
        monkeypatch.undo()
        assert change(client, Transition.TRANSITION_CONFIGURE), "and it can be tried again"


def test_a_restarted_node_gets_the_latched_shapes_again(client) -> None:
    publisher = client.publisher(msg.SceneUpdate, "shapes", LATCHED, connected=False)
    publisher.publish(msg.SceneUpdate(add=[body("a", gs.Sphere(1.0))]))
    publisher.publish(msg.SceneUpdate(add=[body("b", gs.Sphere(1.0), (5, 0, 0))]))
    for _ in range(2):
        with running_node():
            client.until(
                lambda: [o.id for o in client.call(srv.GetScene, "get_scene").scene.add] == ["a", "b"], "both updates"
            )
            assert list(client.call(srv.Distance, "distance", select=2, max_distance=10.0).distance) == [3.0]


# ----------------------------------------------------------------------------------------------------- parameters


def value(data) -> ParameterValue:
    if isinstance(data, bool):
        return ParameterValue(type=ParameterType.PARAMETER_BOOL, bool_value=data)
    if isinstance(data, int):
        return ParameterValue(type=ParameterType.PARAMETER_INTEGER, integer_value=data)
    if isinstance(data, float):
        return ParameterValue(type=ParameterType.PARAMETER_DOUBLE, double_value=data)
    if isinstance(data, str):
        return ParameterValue(type=ParameterType.PARAMETER_STRING, string_value=data)
    return ParameterValue(type=ParameterType.PARAMETER_DOUBLE_ARRAY, double_array_value=data)


def set_parameter(client, name: str, data):
    request = SetParameters.Request(parameters=[Parameter(name=name, value=value(data))])
    (result,) = client.call(SetParameters, "set_parameters", request).results
    return result


def test_parameters_are_declared_with_description_and_range(client) -> None:
    with running_node():
        names = [setting.name for setting in settings()]
        described = client.call(DescribeParameters, "describe_parameters", names=names).descriptors
        values = client.call(GetParameters, "get_parameters", names=names).values
        for setting, descriptor, given in zip(settings(), described, values, strict=True):
            assert descriptor.description.startswith(setting.description)
            assert descriptor.read_only == setting.read_only
            if setting.minimum is not None:
                (limits,) = descriptor.floating_point_range
                assert limits.from_value == setting.minimum
            default = Config().by_name()[setting.name]
            assert given == value(list(default) if isinstance(default, tuple) else default), setting.name


def test_changes_are_validated_and_take_effect(client) -> None:
    with running_node(max_rate=1000.0):
        update = msg.SceneUpdate(add=[body("a", gs.Sphere(1.0)), body("b", gs.Sphere(1.0), (3, 0, 0))])
        client.call(srv.ApplyScene, "apply_scene", update=update)
        distances = client.listen(msg.DistanceArray, "distances")
        assert set_parameter(client, "max_distance", 2.0).successful
        got = distances.wait(lambda m: m.max_distance == 2.0)
        assert [pair.distance for pair in got.distances] == [1.0]
        for name, bad, text in (
            ("max_distance", -1.0, "max_distance"),
            ("max_rate", 0.0, "max_rate"),
            ("max_rate", 5, "type"),
            ("max_rate", float("nan"), "max_rate"),
            ("cross_check.mode", "sometimes", "one of off, sample, all"),
            ("accuracy", "great", "one of auto, bound, float32, float64, exact"),
            ("camera.far", 0.05, "camera.far must be > camera.near"),
            ("camera.pose", [0.0] * 6, "7 numbers"),
            ("camera.pose", [0.0] * 7, "norm 1"),
            ("fixed_frame", "map", "read-only"),
            ("autostart", False, "read-only"),
        ):
            result = set_parameter(client, name, bad)
            assert not result.successful and text in result.reason, (name, bad, result.reason)
        # Volumes may be nearer than what they hold.
        for tier in ("bound", "exact"):
            assert set_parameter(client, "accuracy", tier).successful
            got = distances.wait(lambda m, tier=tier: m.cost.accuracy == tier)
            assert all(pair.lower <= 1.0 <= pair.upper for pair in got.distances)
            assert client.call(srv.Distance, "distance", select=2, max_distance=2.0).cost.accuracy == tier
        assert set_parameter(client, "effects.distance", False).successful
        got = client.call(srv.Distance, "distance", select=2)
        assert got.status == got.NOT_AVAILABLE and "effects.distance" in got.message


@pytest.mark.parametrize(("name", "bad"), [("max_rate", -1.0), ("cross_check__mode", "maybe"), ("accuracy", "great")])
def test_a_bad_value_at_start_is_refused(name, bad) -> None:
    with pytest.raises((ParameterException, gs.GeometryError), match=name.replace("__", ".")):
        NodeUnderTest(**{name: bad})


def test_the_camera_follows_its_parameters(client) -> None:
    import numpy as np
    from sensor_msgs.msg import CameraInfo

    with running_node(camera__frame="optical", max_rate=1000.0):
        publisher = client.publisher(CameraInfo, "camera_info", qos_profile_sensor_data)
        visible = client.listen(msg.VisibleArray, "visible")
        info = CameraInfo(width=640, height=480, k=np.array([320.0, 0, 320, 0, 240, 240, 0, 0, 1]))
        info.header.frame_id = "optical"
        client.until(lambda: publisher.publish(info) or visible.messages, "what the camera sees")
        assert visible.wait().frustum.far == 10.0
        assert set_parameter(client, "camera.far", 3.0).successful
        assert visible.wait(lambda m: m.frustum.far == 3.0).frustum.origin.tolist() == [0, 0, 0]
        assert set_parameter(client, "camera.pose", [1.0, 2.0, 3.0, 0.0, 0.0, 0.0, 1.0]).successful
        visible.wait(lambda m: m.frustum.origin.tolist() == [1, 2, 3])


# ----------------------------------------------------------------------------------------------------------- plan


def test_what_nobody_listens_to_is_not_computed(client) -> None:
    with running_node(max_rate=1000.0):
        states = client.listen(msg.EngineState, "state", STATE.qos)

        def counters(after: int) -> dict:
            state = states.wait(lambda m: m.scene_version >= after)
            return dict(zip(state.counter_names, state.counter_values, strict=True))

        def touch() -> int:
            update = msg.SceneUpdate(add=[body("a", gs.Sphere(1.0)), body("b", gs.Sphere(1.0), (1, 0, 0))])
            return client.call(srv.ApplyScene, "apply_scene", update=update).version

        counted = counters(touch())
        assert counted["evaluations"] > 0
        for stage in (
            "cull",
            "distance",
            "contact",
            "first_contact",
            "penetration",
            "witness",
            "contact_set",
            "drawings",
        ):
            assert counted.get(stage, 0) == 0, f"{stage} ran although nobody listens"
        contacts = client.listen(msg.ContactArray, "contacts")
        version = touch()
        contacts.wait(lambda m: m.scene_version >= version)
        counted = counters(version)
        assert counted["contact"] > 0 and counted["penetration"] > 0 and counted.get("distance", 0) == 0
        assert counted.get("first_contact", 0) == 0, "nothing moves"


def test_states_that_say_the_same_wake_nobody_up(client) -> None:
    """They are not looked at while nobody listens, yet requests and new subscribers get the newest."""

    def gap() -> float:
        return client.call(srv.Distance, "distance", select=2, max_distance=20.0).distance[0]

    def at(seconds: int, place: float) -> msg.ShapeStates:
        said = msg.ShapeStates(ids=["a", "b"], ids_key=3)
        said.poses = array.array("d", [0.0, 0, 0, 0, 0, 0, 1, place, 0, 0, 0, 0, 0, 1])
        said.header.stamp.sec = seconds
        return said

    with running_node(max_rate=1000.0, idle_rate=1.0) as running:
        group, record = running.node._states_group, running.node._inputs.records["states"]
        moved = client.publisher(msg.ShapeStates, "states", dict((topic.name, topic.qos) for topic in INPUTS)["states"])
        update = msg.SceneUpdate(add=[body("a", gs.Sphere(0.5)), body("b", gs.Sphere(0.5), (9, 0, 0))])
        client.call(srv.ApplyScene, "apply_scene", update=update)
        for seconds, place in ((1, 6.0), (2, 5.0)):
            said = at(seconds, place)

            def dozes(said: msg.ShapeStates = said) -> bool:
                moved.publish(said)
                return group.asleep

            client.until(dozes, "it dozes off")
        before = record.received
        for _ in range(50):
            moved.publish(said)
        assert gap() == 4.0 and record.received <= before + 5, "most were not looked at"
        moved.publish(at(3, 4.0))
        client.until(lambda: gap() == 3.0, "a request looks")
        client.until(lambda: not group.asleep, "what is new wakes it up")
        inbox = client.listen(msg.DistanceArray, "distances", 10)
        inbox.wait(lambda m: m.header.stamp.sec == 3)
        moved.publish(at(4, 3.0))
        inbox.wait(lambda m: m.header.stamp.sec == 4)


def test_answers_about_a_stream_that_stopped_say_so(client) -> None:
    with running_node(max_rate=1000.0, states_timeout=0.2):
        update = msg.SceneUpdate(add=[body("a", gs.Sphere(0.5)), body("b", gs.Sphere(0.5), (9, 0, 0))])
        client.call(srv.ApplyScene, "apply_scene", update=update)
        moved = client.publisher(msg.ShapeStates, "states", dict((topic.name, topic.qos) for topic in INPUTS)["states"])
        said = msg.ShapeStates(ids=["b"], poses=array.array("d", [4.0, 0, 0, 0, 0, 0, 1]))

        def ask() -> srv.Distance.Response:
            return client.call(srv.Distance, "distance", select=2, max_distance=20.0)

        moved.publish(said)
        client.until(lambda: ask().distance[0] == 3.0, "the new state")
        client.until(lambda: ask().stale, "it is stale")
        got = client.listen(msg.DistanceArray, "distances").wait()
        assert got.stale and got.input_age > 0.2 and got.distances == []
        moved.publish(said)
        client.until(lambda: not ask().stale, "it goes on")


def test_evaluations_are_paced(client) -> None:
    with running_node(max_rate=5.0):
        contacts = client.listen(msg.ContactArray, "contacts")
        states = client.listen(msg.EngineState, "state", STATE.qos)
        for i in range(50):
            update = msg.SceneUpdate(add=[body("a", gs.Sphere(1.0), (float(i), 0, 0))])
            version = client.call(srv.ApplyScene, "apply_scene", update=update).version
        last = contacts.wait(lambda m: m.scene_version == version, "the last version, evaluated in the end")
        assert last.scene_version == version
        state = states.wait(lambda m: m.scene_version >= version)
        counted = dict(zip(state.counter_names, state.counter_values, strict=True))
        assert counted["updates"] == 50 and counted["evaluations"] < 40


def test_drawing_can_be_switched_off(client) -> None:
    with running_node(effects__markers=False, max_rate=1000.0):
        markers = client.listen(MarkerArray, "markers", LATCHED)
        contacts = client.listen(msg.ContactArray, "contacts")
        client.call(srv.ApplyScene, "apply_scene", update=msg.SceneUpdate(add=[body("a", gs.Sphere(1.0))]))
        contacts.wait()
        client.call(Trigger, "clear")
        contacts.wait(lambda m: m.checked == 0)
        assert not markers.messages


def test_the_cross_check_tallies(client) -> None:
    pytest.importorskip("fcl")
    with running_node(cross_check__mode="all", max_rate=1000.0):
        update = msg.SceneUpdate(add=[body("a", gs.Sphere(1.0)), body("b", gs.Box([1, 1, 1]), (3, 0, 0))])
        client.call(srv.ApplyScene, "apply_scene", update=update)
        assert client.call(srv.Distance, "distance", select=0, ids_a=["a"], ids_b=["b"]).status == 0
        states = client.listen(msg.EngineState, "state", STATE.qos)
        got = states.wait(lambda m: sum(m.cross_check_agreed) >= 1)
        assert list(got.cross_check_kinds) == ["box-sphere"] and sum(got.cross_check_unexplained) == 0
        assert got.cross_check_mode == "all"


def test_first_contacts_are_tallied(client) -> None:
    """Those on the stream, and those that a service answers."""
    pytest.importorskip("fcl")
    with running_node(cross_check__mode="all", max_rate=1000.0):
        contacts = client.listen(msg.ContactArray, "contacts", OUTPUTS[0].qos)
        update = msg.SceneUpdate(
            add=[
                body("a", gs.Sphere(1.0), velocity=(1, 0, 0)),
                body("b", gs.Box([1, 1, 1]), (3.5, 0.25, 0.125)),
                body("c", gs.Cone(1.0, 1.0), (4, 9, 0), velocity=(0, -2, 0)),
            ]
        )
        client.call(srv.ApplyScene, "apply_scene", update=update)
        contacts.wait(lambda m: len(m.contacts) == 1)
        states = client.listen(msg.EngineState, "state", STATE.qos)
        got = states.wait(lambda m: sum(m.cross_check_agreed) >= 1)
        kinds = dict(zip(got.cross_check_kinds, got.cross_check_agreed, strict=True))
        assert kinds["motion box-sphere"] >= 1 and sum(got.cross_check_unexplained) == 0
        plan = dict(zip(got.plan_stages, got.plan_active, strict=True))
        assert plan["motion_check"] == 1 and plan["cross_check"] == 0
        client.call(srv.FirstContact, "first_contact", select=0, ids_a=["c"], ids_b=["b"], horizon=9.0)
        got = states.wait(lambda m: "motion box-cone" in m.cross_check_kinds)
        assert list(got.cross_check_skipped)[list(got.cross_check_kinds).index("motion box-cone")] == 1
        told = client.listen(DiagnosticArray, "/diagnostics", DIAGNOSTICS.qos)
        told.wait(lambda m: any(value.key == "motion box-sphere" for status in m.status for value in status.values))


def test_every_service_of_the_table_is_named_in_its_answer() -> None:
    assert sorted(SERVICES) == sorted(
        "cull distance first_contact cull_batch distance_batch first_contact_batch "
        "first_contact_along apply_scene get_scene clear self_check set_enabled".split()
    )
