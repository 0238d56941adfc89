# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""Messages to values and back, on plain objects: no ROS is needed to convert."""

from __future__ import annotations

import array
import math
import re

import numpy as np
import pytest
from plain_messages import MESSAGES, ROOT, SERVICES, message

import geomsrv as gs
from geomsrv.ros import convert

SHAPES = [
    gs.Sphere(0.5),
    gs.Capsule(0.1, 0.4),
    gs.Cylinder(0.2, 0.3),
    gs.Cone(0.25, 0.35),
    gs.Ellipsoid([0.1, 0.2, 0.3]),
    gs.Box([0.4, 0.5, 0.6]),
    gs.HalfSpace([0.0, 0.0, -1.0], -0.25),
    gs.Convex(np.arange(12.0).reshape(4, 3) ** 2),
    gs.Mesh(np.arange(12.0).reshape(4, 3) ** 2, [[0, 1, 2], [1, 2, 3]]),
    gs.Triangle([0, 0, 0], [1, 0, 0], [0, 1, 0]),
    gs.Segment([0, 0, 0], [1, 2, 3]),
    gs.Point([1, 2, 3]),
    gs.Frustum([0, 0, 0], np.eye(3), bounds=[-1, 2, -0.5, 1], near=1, far=4),
    gs.Polygon([[0, 0], [2, 0], [0, 1]]),
]
IDS = [shape.kind for shape in SHAPES]


def written(shape) -> object:
    sent = message("geomsrv/Shape")()
    convert.set_shape(sent, shape)
    return sent


@pytest.mark.parametrize("shape", SHAPES, ids=IDS)
def test_every_shape_survives_the_trip(shape) -> None:
    sent = written(shape)
    assert sent.type == getattr(sent, shape.kind.upper()), "the codes are the constants of Shape.msg"
    back = convert.shape_from(sent)
    assert type(back) is type(shape)
    for name, value in vars(shape).items():
        assert np.array_equal(getattr(back, name), value), name


def test_every_constant_of_shape_has_a_shape() -> None:
    constants = {name: value for name, value in vars(message("geomsrv/Shape")).items() if name.isupper()}
    assert constants.pop("UNSET") == 0
    assert sorted(constants) == sorted(kind.upper() for kind in IDS)


@pytest.mark.parametrize("shape", SHAPES, ids=IDS)
def test_wrong_counts_are_named(shape) -> None:
    for name in ("dimensions", "vertices", "triangles"):
        sent = written(shape)
        field = getattr(sent, name)
        field.append(1)
        if name == "vertices" and shape.kind in ("convex", "mesh", "polygon"):
            match = "vertices must hold"
        elif name == "triangles" and shape.kind == "mesh":
            match = "triangles must hold 3 indices each, got 7"
        else:
            match = rf"{shape.kind}: {name} must"
        with pytest.raises(gs.GeometryError, match=match):
            convert.shape_from(sent)


@pytest.mark.parametrize("shape", SHAPES, ids=IDS)
def test_nan_is_named(shape) -> None:
    sent = written(shape)
    field = sent.dimensions or sent.vertices
    field[-1] = math.nan
    with pytest.raises(gs.GeometryError, match=rf"{shape.kind}: .*nan"):
        convert.shape_from(sent)


@pytest.mark.parametrize(("code", "text"), [(0, "type 0 is not set"), (15, "type 15 is not a constant of Shape.msg")])
def test_unknown_types_are_named(code, text) -> None:
    with pytest.raises(gs.GeometryError, match=text):
        convert.shape_from(message("geomsrv/Shape")(type=code))


def test_the_same_small_shape_is_the_same_object() -> None:
    one, two, other = (convert.shape_from(written(gs.Box([0.4, 0.5, size]))) for size in (0.6, 0.6, 0.7))
    assert one is two and one is not other
    big = gs.Convex(np.random.default_rng(0).normal(size=(100, 3)))
    assert convert.shape_from(written(big)) is not convert.shape_from(written(big)), "large ones are not kept"


def test_a_turned_frustum_is_no_shape_of_a_scene() -> None:
    with pytest.raises(gs.GeometryError, match="apex in the origin"):
        written(gs.Frustum([1, 0, 0], np.eye(3), 1, 1, 1, 2))


@pytest.mark.parametrize(
    ("make", "code", "dtype"),
    [
        (convert.doubles, "d", float),
        (convert.bytes_, "B", np.uint8),
        (convert.uint32s, "I", np.uint32),
        (convert.uint64s, "Q", np.uint64),
    ],
)
def test_arrays_become_fields(make, code, dtype) -> None:
    for values in (np.arange(6, dtype=dtype).reshape(2, 3), np.arange(12, dtype=dtype).reshape(3, 4)[:, ::2], [], [7]):
        field = make(values)
        assert isinstance(field, array.array) and field.typecode == code
        assert field.tolist() == np.ravel(values).tolist()
    assert make(np.array([True, False])).tolist() == [1, 0]


def test_fields_are_read_without_a_copy() -> None:
    field = array.array("d", range(14))
    rows = convert.rows(field, "poses", 7)
    field[0] = 5.0
    assert rows.shape == (2, 7) and rows[0, 0] == 5.0
    with pytest.raises(gs.GeometryError, match="poses must hold 7 numbers per item, got 13 numbers"):
        convert.rows(field[:-1], "poses", 7)


def test_frusta_survive_the_trip() -> None:
    camera = gs.Frustum.look_at([1, 2, 3], [0, 0, 0], [0, 0, 1], 0.7, 1.5, 0.1, 9.0)
    sent = message("geomsrv/Frustum")()
    convert.set_frustum(sent, camera)
    assert np.array_equal(convert.frustum_from(sent).packed(), camera.packed())
    assert np.array_equal(convert.frustum_of(convert.doubles(camera.packed())).packed(), camera.packed())
    with pytest.raises(gs.GeometryError, match="frustum must hold 18 numbers, got 17"):
        convert.frustum_of(camera.packed()[:17])


def test_states_are_moved_from_a_frame() -> None:
    rng = np.random.default_rng(3)
    quaternions = rng.normal(size=(5, 4))
    quaternions /= np.linalg.norm(quaternions, axis=1, keepdims=True)
    frame, poses = (
        np.append([1.0, -2.0, 0.5], quaternions[0]),
        np.column_stack([rng.normal(size=(4, 3)), quaternions[1:]]),
    )
    twists = rng.normal(size=(4, 6))
    moved, turned = convert.states_in(frame, poses, twists)

    def matrix(row):
        x = np.eye(4)
        x[:3, :3] = gs._validate.rotation_matrices(row[None, 3:])[0]
        x[:3, 3] = row[:3]
        return x

    for before, after, twist, turned_twist in zip(poses, moved, twists, turned, strict=True):
        assert np.allclose(matrix(frame) @ matrix(before), matrix(after), atol=1e-14)
        assert np.allclose(matrix(frame)[:3, :3] @ twist.reshape(2, 3).T, turned_twist.reshape(2, 3).T, atol=1e-14)
    assert convert.states_in(frame, poses, None)[1] is None
    same, _ = convert.states_in((0, 0, 0, 0, 0, 0, 1), poses, twists)
    assert np.array_equal(same, poses)


def test_state_counts_that_do_not_fit() -> None:
    states = message("geomsrv/ShapeStates")
    seven, six = array.array("d", [0.0] * 7), array.array("d", [0.0] * 6)
    assert convert.states_from(states(ids=["a"], poses=seven)).twists is None
    assert convert.states_from(states(ids=["a"], poses=seven, twists=six)).twists.shape == (1, 6)
    for fields, text in (
        ({"poses": six}, "poses must hold 7 numbers per item, got 6"),
        ({"poses": seven, "twists": seven}, "twists must hold 6 numbers per item, got 7"),
        ({"poses": seven, "twists": six + six}, "poses are of 1 objects, twists of 2"),
        ({"poses": seven, "ids": ["a", "b"]}, "2 ids, but poses of 1 objects"),
    ):
        with pytest.raises(gs.GeometryError, match=text):
            convert.states_from(states(**fields))


def scene_object(**fields):
    item = message("geomsrv/SceneObject")(**fields)
    convert.set_shape(item.shape, gs.Sphere(1.0))
    return item


def test_updates() -> None:
    update = message("geomsrv/SceneUpdate")
    sent = update(
        clear=True, remove=["x"], add=[scene_object(id="a"), scene_object(id="b", frame="odom", uncertainty=0.1)]
    )
    sent.header.frame_id = "map"
    sent.add[0].pose.position.x, sent.add[0].twist.angular.z = 2.0, 3.0
    sent.allow_a, sent.allow_b, sent.disallow_a, sent.disallow_b = ["a"], ["b"], ["c"], ["d"]
    got = convert.update_from(sent)
    assert (got.clear, got.remove, got.allow, got.disallow) == (True, ["x"], [("a", "b")], [("c", "d")])
    assert [item.frame for item in got.add] == ["map", "odom"]
    assert got.add[0].pose == (2, 0, 0, 0, 0, 0, 1) and got.add[0].twist == (0, 0, 0, 0, 0, 3)
    assert [item.uncertainty for item in got.add] == [0.0, 0.1]


def test_every_faulty_shape_of_an_update_is_named() -> None:
    bad = [scene_object(id="no radius"), scene_object(id="fine"), scene_object(id="no type")]
    bad[0].shape.dimensions, bad[2].shape.type = array.array("d"), 0
    with pytest.raises(gs.SceneError) as caught:
        convert.update_from(message("geomsrv/SceneUpdate")(add=bad))
    assert list(caught.value.errors) == ["no radius", "no type"]
    with pytest.raises(gs.GeometryError, match="disallow_a and disallow_b must have the same length, got 1 and 0"):
        convert.update_from(message("geomsrv/SceneUpdate")(disallow_a=["a"]))


def test_objects_survive_the_trip() -> None:
    scene = gs.Scene()
    scene.apply(
        gs.SceneUpdate(
            add=[
                gs.SceneObject(
                    "a",
                    gs.Box([1, 2, 3]),
                    (1, 2, 3, 0, 0, 0.6, 0.8),
                    (1, 2, 3, 4, 5, 6),
                    uncertainty=0.1,
                    velocity_uncertainty=0.2,
                    motion_fault="unknown",
                )
            ]
        )
    )
    sent = message("geomsrv/SceneObject")()
    convert.set_object(sent, scene["a"])
    again = gs.Scene()
    again.apply(convert.update_from(message("geomsrv/SceneUpdate")(add=[sent])))
    before, after = scene["a"], again["a"]
    assert np.array_equal(before.pose, after.pose) and np.array_equal(before.twist, after.twist)
    assert (after.uncertainty, after.velocity_uncertainty, after.motion_fault) == (0.1, 0.2, "unknown")


class TestCamera:
    """CameraInfo to frustum."""

    K = (500.0, 0.0, 320.0, 0.0, 400.0, 240.0, 0.0, 0.0, 1.0)
    POSE = (1.0, 2.0, 3.0, 0.0, 0.0, 0.0, 1.0)

    def info(self, **fields):
        return message("sensor_msgs/CameraInfo")(**{"width": 640, "height": 480, "k": np.array(self.K), **fields})

    def test_plain(self) -> None:
        got = convert.camera_frustum(self.info(), self.POSE, 0.5, 10.0)
        want = gs.Frustum.from_intrinsics(np.reshape(self.K, (3, 3)), 640, 480, self.POSE, 0.5, 10.0)
        assert np.array_equal(got.packed(), want.packed())

    def test_the_rectified_image_counts(self) -> None:
        p = np.array([600.0, 0, 300, 0, 0, 600, 200, 0, 0, 0, 1, 0])
        got = convert.camera_frustum(self.info(p=p, k=np.zeros(9)), self.POSE, 0.5, 10.0)
        want = gs.Frustum.from_intrinsics(p.reshape(3, 4)[:, :3], 640, 480, self.POSE, 0.5, 10.0)
        assert np.array_equal(got.packed(), want.packed())

    def test_rectification_turns_and_baseline_shifts(self) -> None:
        # Turned by 90 degrees about the optical axis, and the second camera of a stereo pair 0.1 m to the right.
        turn = np.array([[0.0, 1, 0], [-1, 0, 0], [0, 0, 1]])
        p = np.array([600.0, 0, 320, -60.0, 0, 600, 240, 0, 0, 0, 1, 0])
        got = convert.camera_frustum(self.info(p=p, r=turn.ravel()), self.POSE, 0.5, 10.0)
        right, down, forward = turn  # rows: axes of the rectified camera in the frame of the message
        assert np.allclose(got.axes, [-right, -down, forward])
        assert np.allclose(got.origin, np.add(self.POSE[:3], 0.1 * right))

    def test_a_region_of_interest_narrows_the_view(self) -> None:
        info = self.info()
        info.roi.x_offset, info.roi.y_offset, info.roi.width, info.roi.height = 320, 0, 160, 480
        got = convert.camera_frustum(info, self.POSE, 1.0, 10.0)
        # Columns 320 to 480 of 640 with the centre at 320: from straight ahead to 160 / 500 to the right.
        assert np.allclose(got.bounds, (-0.32, 0.0, -0.6, 0.6))

    def test_uncalibrated_is_named(self) -> None:
        with pytest.raises(gs.GeometryError, match="not calibrated"):
            convert.camera_frustum(self.info(k=np.zeros(9)), self.POSE, 0.5, 10.0)
        with pytest.raises(gs.GeometryError, match="width must be > 0"):
            convert.camera_frustum(self.info(width=0), self.POSE, 0.5, 10.0)


@pytest.mark.parametrize("name", MESSAGES + SERVICES)
def test_every_field_and_constant_is_explained(name) -> None:
    """Each field follows a comment, or a field that it shares one with; each constant has one beside it."""
    folder = "msg" if name in MESSAGES else "srv"
    explained = False
    for number, line in enumerate((ROOT / folder / f"{name}.{folder}").read_text().splitlines(), 1):
        where = f"{name}.{folder}:{number}: {line}"
        assert len(line) <= 130, where
        text, mark, comment = line.partition("#")
        if re.match(r"\w+ [A-Z_]+=\d+", text):
            assert comment.strip(), where
        elif text.strip() not in ("", "---"):
            assert explained or mark, where
        elif mark:
            explained = True
        elif not text.strip():
            explained = False


def test_status_means_the_same_everywhere() -> None:
    names = ("OK", "BAD_REQUEST", "UNSUPPORTED", "NOT_AVAILABLE", "NOT_ACTIVE", "INTERNAL_ERROR")
    assert len(SERVICES) == 9
    for service in SERVICES:
        kind = message(f"geomsrv/{service}_Response")
        assert [getattr(kind, name) for name in names] == list(range(6)), service
        assert hasattr(kind(), "status") and hasattr(kind(), "message")


def test_outcomes_are_those_of_python() -> None:
    contact = message("geomsrv/Contact")
    for outcome in gs.ContactStatus:
        assert getattr(contact, outcome.name) == outcome
        for service in ("FirstContact", "FirstContactBatch", "FirstContactAlong"):
            kind = message(f"geomsrv/{service}_Response")
            assert getattr(kind, f"ITEM_{outcome.name}", None) == outcome or getattr(kind, outcome.name) == outcome
    for outcome in gs.answers.DistanceStatus:
        assert getattr(message("geomsrv/PairDistance"), outcome.name) == outcome
        for service in ("Distance", "DistanceBatch"):
            assert getattr(message(f"geomsrv/{service}_Response"), f"ITEM_{outcome.name}") == outcome
    for state in gs.Visibility:
        assert getattr(message("geomsrv/VisibleArray"), state.name) == state
        assert getattr(message("geomsrv/Cull_Response"), state.name) == state
