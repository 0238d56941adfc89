# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""Every service of a running node: good requests, bad ones, large ones."""

from __future__ import annotations

import array
import math

import numpy as np
import pytest
from ros_helpers import IDENTITY, Client, body, inline, running_node, vectors
from std_srvs.srv import SetBool, Trigger

import geomsrv as gs
from geomsrv import msg, srv
from geomsrv.ros import convert
from geomsrv.ros.node import SERVICES
from geomsrv.turning_pairs import TIME_TOLERANCE

MILLION = 1_000_000
SQUARE = gs.Polygon([[0, 0], [1, 0], [1, 1], [0, 1]])


@pytest.fixture(scope="module")
def node():
    with running_node() as running:
        yield running


@pytest.fixture(scope="module")
def shared_client(node):
    client = Client()
    yield client
    client.close()


@pytest.fixture
def client(shared_client):
    update = msg.SceneUpdate(
        clear=True,
        add=[
            body("ball", gs.Sphere(0.5), (2, 0, 0)),
            body("box", gs.Box([1, 1, 1])),
            body("left", SQUARE, (0, 0, 0), (1, 0, 0)),
            body("right", SQUARE, (3, 0.5, 0)),
        ],
    )
    assert shared_client.call(srv.ApplyScene, "apply_scene", update=update).status == 0
    return shared_client


def test_every_service_of_the_table_is_there(node, client) -> None:
    client.until(lambda: len(client.services_of("geomsrv")) > len(SERVICES), "the node in the graph")
    offered = client.services_of("geomsrv")
    for name, kind in SERVICES.items():
        package = "std_srvs" if kind in (Trigger, SetBool) else "geomsrv"
        assert offered[f"/geomsrv/{name}"] == [f"{package}/srv/{kind.__name__}"]


def test_distance(client) -> None:
    request = srv.Distance.Request(select=srv.Distance.Request.BY_IDS, ids_a=["ball"], ids_b=["box"], want=["witness"])
    got = client.call(srv.Distance, "distance", request)
    assert got.status == got.OK and list(got.distance) == [0.5]
    assert got.lower[0] <= 0.5 <= got.upper[0]
    assert vectors(got.point_a).tolist() == [[1.5, 0, 0]] and vectors(got.normal).tolist() == [[-1, 0, 0]]
    request = srv.Distance.Request(
        select=srv.Distance.Request.INLINE,
        shapes_a=inline(gs.Capsule(0.5, 1.0)),
        poses_a=convert.doubles(IDENTITY),
        shapes_b=inline(gs.Convex(np.eye(3)), gs.HalfSpace([0, 0, 1], -3.0)),
        poses_b=convert.doubles([[3, 0, 0, 0, 0, 0, 1], IDENTITY]),
    )
    got = client.call(srv.Distance, "distance", request)
    want = gs.distance(gs.Capsule(0.5, 1.0), gs.Convex(np.eye(3)), [3, 0, 0, 0, 0, 0, 1]).distance[0]
    assert got.status == got.OK and list(got.distance) == [want, 2.0] and 2.5 < want < 3.0
    got = client.call(srv.Distance, "distance", select=srv.Distance.Request.ALL_PAIRS, max_distance=math.inf)
    assert list(zip(got.ids_a, got.ids_b, strict=True)) == [("ball", "box"), ("left", "right")]


def test_first_contact(client) -> None:
    request = srv.FirstContact.Request(select=srv.FirstContact.Request.ALL_PAIRS, horizon=5.0, want=["contact_set"])
    got = client.call(srv.FirstContact, "first_contact", request)
    assert got.status == got.OK and (got.ids_a, got.ids_b) == (["left"], ["right"])
    assert list(got.item_status) == [got.WILL_TOUCH] and list(got.time) == [2.0] and list(got.last_time) == [4.0]
    assert vectors(got.points).tolist() == [[3, 0.5, 0], [3, 1, 0]] and list(got.point_offsets) == [0, 2]
    assert list(got.closing_speed) == [1.0]
    request = srv.FirstContact.Request(select=request.select, horizon=5.0, margin=0.25, earliest=True)
    got = client.call(srv.FirstContact, "first_contact", request)
    assert (
        got.status == got.OK and list(got.item_status) == [got.WILL_TOUCH] and abs(got.time[0] - 1.75) <= TIME_TOLERANCE
    )


def test_cull(client) -> None:
    camera = gs.Frustum([0, 0, -5], np.eye(3), 1.0, 1.0, 1.0, 20.0)
    request = srv.Cull.Request(select=srv.Cull.Request.ALL, view=srv.Cull.Request.FRUSTUM)
    convert.set_frustum(request.frustum, camera)
    got = client.call(srv.Cull, "cull", request)
    assert got.status == got.OK and dict(zip(got.ids, got.states, strict=True))["box"] == got.INSIDE
    got = client.call(srv.Cull, "cull", select=srv.Cull.Request.ALL, view=srv.Cull.Request.CAMERA)
    assert got.status == got.NOT_AVAILABLE and "camera_info" in got.message


def test_scene(client) -> None:
    got = client.call(srv.GetScene, "get_scene")
    assert got.status == got.OK and [item.id for item in got.scene.add] == ["ball", "box", "left", "right"]
    before = got.version
    bad = msg.SceneUpdate(
        add=[body("ok", gs.Sphere(1.0)), body("bad", gs.Sphere(1.0), (math.nan, 0, 0))], remove=["nobody"]
    )
    refused = client.call(srv.ApplyScene, "apply_scene", update=bad)
    assert refused.status == refused.BAD_REQUEST and set(refused.ids) == {"bad", "nobody"}
    assert refused.version == before and client.call(srv.GetScene, "get_scene").scene == got.scene
    assert client.call(Trigger, "clear").success
    assert client.call(srv.GetScene, "get_scene").scene.add == []
    again = client.call(srv.ApplyScene, "apply_scene", update=got.scene)
    assert again.status == again.OK and again.version > before
    assert client.call(srv.GetScene, "get_scene").scene == got.scene


def test_frames_without_tf2_are_refused_by_name(client) -> None:
    update = msg.SceneUpdate(add=[body("a", gs.Sphere(1.0), frame="base_link")])
    got = client.call(srv.ApplyScene, "apply_scene", update=update)
    assert got.status == got.BAD_REQUEST and got.ids == ["a"]
    assert "'base_link'" in got.faults[0] and "tf2_ros" in got.faults[0] and "not installed" in got.faults[0]
    update.add[0].frame = "world"
    assert client.call(srv.ApplyScene, "apply_scene", update=update).status == 0


def test_self_check_reports(client) -> None:
    got = client.call(Trigger, "self_check", seconds=30.0)
    assert got.success, got.message
    assert "passed" in got.message


def test_set_enabled(client) -> None:
    contacts = client.listen(msg.ContactArray, "contacts")
    assert client.call(SetBool, "set_enabled", data=False).success
    contacts.messages.clear()
    update = msg.SceneUpdate(add=[body("new", gs.Sphere(1.0))])
    version = client.call(srv.ApplyScene, "apply_scene", update=update).version
    assert client.call(srv.Distance, "distance", select=2).status == 0, "services keep answering"
    assert client.call(SetBool, "set_enabled", data=True).success
    first = contacts.wait()
    assert first.scene_version >= version, "nothing was evaluated while it was disabled"


@pytest.mark.parametrize("tier", ["bound", "float32", "float64", "exact"])
def test_tiers(client, tier) -> None:
    """What each service answers at each tier; whoever does not says which it answers."""
    camera = gs.Frustum([0, 0, -5], np.eye(3), 1.0, 1.0, 1.0, 20.0)
    view = srv.Cull.Request(select=srv.Cull.Request.ALL, view=srv.Cull.Request.FRUSTUM, accuracy=tier)
    convert.set_frustum(view.frustum, camera)
    box = convert.doubles([0, 0, 0, *np.eye(3).ravel(), 1, 1, 1])
    ring = {f"vertices_{s}": convert.doubles(SQUARE.vertices) for s in "ab"}
    ring |= {f"offsets_{s}": convert.uint32s([0, 4]) for s in "ab"}
    ring |= {f"velocities_{s}": convert.doubles([0.0, 0.0]) for s in "ab"}
    pair = {"shapes_a": inline(gs.Sphere(1.0)), "poses_a": convert.doubles(IDENTITY)}
    pair |= {"shapes_b": inline(gs.Sphere(1.0)), "poses_b": convert.doubles([3, 0, 0, 0, 0, 0, 1])}
    by_ids = {"select": srv.Distance.Request.BY_IDS, "ids_a": ["ball"], "ids_b": ["box"]}
    moving = {"select": srv.FirstContact.Request.ALL_PAIRS, "horizon": 5.0}
    batch = {
        "frustum": convert.doubles(camera.packed()),
        "centers": box[:3],
        "axes": box[3:12],
        "half_extents": box[12:],
    }
    for kind, name, fields in (
        (srv.Cull, "cull", view),
        (srv.CullBatch, "cull_batch", batch),
        (srv.Distance, "distance", by_ids),
        (srv.Distance, "distance", {"select": srv.Distance.Request.INLINE, **pair}),
        (srv.Distance, "distance", {"select": srv.Distance.Request.ALL_PAIRS, "max_distance": 9.0}),
        (srv.DistanceBatch, "distance_batch", {"kind_a": 101, "values_a": box, "kind_b": 101, "values_b": box}),
        (srv.FirstContact, "first_contact", moving),
        (srv.FirstContactBatch, "first_contact_batch", ring),
    ):
        request = fields if kind is srv.Cull else kind.Request(accuracy=tier, **fields)
        got = client.call(kind, name, request)
        assert got.status == got.OK and got.cost.accuracy == tier, (name, got.message)
    got = client.call(srv.Distance, "distance", srv.Distance.Request(accuracy=tier, **by_ids))
    assert list(got.lower) == list(got.distance) if tier == "bound" else list(got.distance) == [0.5]


BAD = [
    (srv.Distance, "distance", {"select": 0, "ids_a": ["nobody"], "ids_b": ["box"]}, "nobody"),
    (srv.Distance, "distance", {"select": 2, "accuracy": "great"}, "accuracy must be one of"),
    (srv.FirstContact, "first_contact", {"select": 9}, "select"),
    (srv.FirstContact, "first_contact", {"select": 2, "horizon": math.nan}, "horizon"),
    (srv.Cull, "cull", {"select": 2, "view": 1}, "bounds"),
    (srv.CullBatch, "cull_batch", {"frustum": array.array("d", [1.0])}, "frustum must hold 18 numbers"),
    (srv.DistanceBatch, "distance_batch", {"kind_a": 200}, "kind_a 200"),
    (srv.FirstContactBatch, "first_contact_batch", {"offsets_a": array.array("I", [0, 4])}, "offsets"),
    (srv.FirstContactAlong, "first_contact_along", {"id": "nobody"}, "nobody"),
    (srv.GetScene, "get_scene", {"ids": ["nobody"]}, "nobody"),
]


@pytest.mark.parametrize(("kind", "name", "fields", "text"), BAD)
def test_bad_requests_are_answered(client, kind, name, fields, text) -> None:
    before = client.call(srv.GetScene, "get_scene")
    got = client.call(kind, name, **fields)
    assert got.status == got.BAD_REQUEST and text in got.message
    assert client.call(srv.GetScene, "get_scene") == before


def test_first_contact_along_a_path(client) -> None:
    """The body turns on the spot, and then goes straight on."""
    bar, wall = gs.Box([1.0, 0.1, 0.1]), gs.Box([0.1, 5.0, 5.0])
    client.call(
        srv.ApplyScene, "apply_scene", update=msg.SceneUpdate(add=[body("bar", bar), body("wall", wall, (3, 0, 0))])
    )
    poses = [[0, 0, 0, 0, 0, 0, 1], [0, 0, 0, 0, 0, 0.6, 0.8], [4, 0, 0, 0, 0, 0.6, 0.8]]
    got = client.call(
        srv.FirstContactAlong,
        "first_contact_along",
        id="bar",
        ids=["wall"],
        times=convert.doubles([0.0, 1.0, 3.0]),
        poses=convert.doubles(poses),
    )
    # Turned, cosine 0.28 and sine 0.96, it reaches 0.28 + 0.096 along x.
    assert got.status == got.OK and list(got.ids) == ["wall"] and list(got.item_status) == [got.WILL_TOUCH]
    rounded = 1e-9  # what the cosine and the sine are off by, as placed, is far less [s]
    assert got.time_lower[0] - rounded <= 1.0 + (2.9 - 0.376) / 2.0 <= got.time_upper[0] + rounded
    assert list(got.normal) == pytest.approx([1, 0, 0], abs=1e-6) and got.point[0] == pytest.approx(2.9, abs=1e-5)
    assert got.cost.accuracy == "float64" and got.scene_version > 0


def test_first_contact_under_acceleration(client) -> None:
    """A ball that is thrown, and meets a shelf only on top of its way: after 1 s it is 5 m higher."""
    shelf = body("shelf", gs.Box([5.0, 5.0, 0.1]), (101, 0, 4.6))
    client.call(srv.ApplyScene, "apply_scene", update=msg.SceneUpdate(add=[shelf]))
    motion = {
        "shape": inline(gs.Sphere(0.25)),
        "times": convert.doubles([0.0, 2.0]),
        "poses": convert.doubles([100, 0, 0, 0, 0, 0, 1]),
        "twist": convert.doubles([1, 0, 10, 0, 0, 0]),
    }
    gravity = convert.doubles([0, 0, -10, 0, 0, 0])
    got = client.call(srv.FirstContactAlong, "first_contact_along", **motion, acceleration=gravity)
    assert got.status == got.OK and list(got.ids) == ["shelf"] and list(got.item_status) == [got.WILL_TOUCH]
    rounded = 1e-9  # the root below, far less [s]
    # The ball's top is at the lower side of the shelf, 4.5 m up, when its middle is 0.75 m below the top of its way.
    when = 1.0 - math.sqrt(2 * 0.75 / 10)
    assert got.time_lower[0] - rounded <= when <= got.time_upper[0] + rounded
    assert list(got.normal) == pytest.approx([0, 0, 1], abs=1e-6)
    got = client.call(srv.FirstContactAlong, "first_contact_along", **motion)
    assert got.status == got.BAD_REQUEST and "acceleration has 0" in got.message and len(got.ids) == 0


def test_a_million_boxes(client) -> None:
    rng = np.random.default_rng(1)
    camera = gs.Frustum([0, 0, 0], np.eye(3), 0.5, 0.5, 1.0, 50.0)
    centers = rng.uniform(-30, 30, (MILLION, 3))
    axes, half = np.tile(np.eye(3), (MILLION, 1, 1)), np.full((MILLION, 3), 0.3)
    got = client.call(
        srv.CullBatch,
        "cull_batch",
        seconds=60.0,
        frustum=convert.doubles(camera.packed()),
        centers=convert.doubles(centers),
        axes=convert.doubles(axes),
        half_extents=convert.doubles(half),
    )
    assert got.status == got.OK, got.message
    state = np.asarray(got.states)
    assert len(state) == len(got.certain) == MILLION
    assert np.array_equal(state, gs.cull(camera, gs.Boxes(centers, axes, half)).state)
    assert set(np.unique(state)) == {0, 1, 2}


def test_a_million_points(client) -> None:
    points = np.random.default_rng(2).uniform(-30, 30, (MILLION, 3))
    camera = gs.Frustum([0, 0, 0], np.eye(3), 0.5, 0.5, 1.0, 20.0)
    got = client.call(
        srv.DistanceBatch,
        "distance_batch",
        seconds=60.0,
        kind_a=srv.DistanceBatch.Request.FRUSTUM,
        values_a=convert.doubles(camera.packed()),
        kind_b=srv.DistanceBatch.Request.POINTS,
        values_b=convert.doubles(points),
    )
    assert got.status == got.OK, got.message
    assert np.array_equal(np.asarray(got.distance), gs.distance_to_frustum(camera, points).distance)


def test_a_million_first_contacts(client) -> None:
    rng = np.random.default_rng(3)
    triangle = np.array([[0, 0], [1, 0], [0, 1.0]])
    places, velocities = rng.uniform(-30, 30, (MILLION, 1, 2)), rng.normal(size=(MILLION, 2))
    got = client.call(
        srv.FirstContactBatch,
        "first_contact_batch",
        seconds=60.0,
        vertices_a=convert.doubles(triangle),
        offsets_a=convert.uint32s([0, 3]),
        vertices_b=convert.doubles(triangle + places),
        offsets_b=convert.uint32s(np.arange(MILLION + 1) * 3),
        velocities_a=convert.doubles([0.0, 0.0]),
        velocities_b=convert.doubles(velocities),
        t_max=math.inf,
    )
    assert got.status == got.OK, got.message
    assert len(got.time) == MILLION and len(got.normal) == 2 * MILLION
    some = slice(0, 1000)
    moved = gs.Polygons(np.reshape(triangle + places[some], (-1, 2)), np.arange(1001) * 3)
    want = gs.first_contact(gs.Polygons(triangle, [0, 3]), moved, (0, 0), velocities[some], accuracy="auto")
    assert np.array_equal(np.asarray(got.time)[some], want.time, equal_nan=True)
    assert {0, 1} <= set(got.item_status)
