# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""Requests to responses, on plain objects: no ROS is needed to answer."""

from __future__ import annotations

import json
import math
import re

import numpy as np
import pytest
from plain_messages import message, request, response
from test_mesh_motion import box_mesh

import geomsrv as gs
from geomsrv.config import Config
from geomsrv.engine import Engine
from geomsrv.narrow_phase import relative_poses
from geomsrv.queries import TIERS
from geomsrv.ros import convert
from geomsrv.ros.handlers import Handlers
from geomsrv.turning_pairs import TIME_TOLERANCE
from geomsrv.verify import verify_lines

OK, BAD_REQUEST, UNSUPPORTED, NOT_AVAILABLE, NOT_ACTIVE, INTERNAL_ERROR = range(6)
BY_IDS, INLINE, ALL = range(3)
D = convert.doubles
IDENTITY = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)
CAMERA = gs.Frustum([0, 0, -5], np.eye(3), 1.0, 1.0, 1.0, 20.0)


def obj(name, shape, position=(0, 0, 0), velocity=(0, 0, 0), **fields):
    return gs.SceneObject(name, shape, (*position, 0, 0, 0, 1), (*velocity, 0, 0, 0), **fields)


SQUARE = gs.Polygon([[0, 0], [1, 0], [1, 1], [0, 1]])
SHEET = gs.Mesh([(-0.5, -0.5, 0), (0.5, -0.5, 0), (0, 0.5, 0)], [(0, 1, 2)])  # a kind that distance has no kernel for
OBJECTS = [
    obj("ball", gs.Sphere(0.5), (2, 0, 0)),
    obj("box", gs.Box([1, 1, 1])),
    obj("far", gs.Sphere(0.25), (0, 9, 0)),
    obj("left", SQUARE, (0, 0, 0), (1, 0, 0)),
    obj("right", SQUARE, (3, 0.5, 0)),
    obj("sheet", SHEET, (0, 0, 4)),
]


class Desk:
    """Handlers over an engine, with what they log."""

    def __init__(self, **changes) -> None:
        self.engine = Engine(Config().changed({name.replace("__", "."): value for name, value in changes.items()}))
        self.active, self.logged = True, []
        self.handlers = Handlers(self.engine, lambda: self.active, self.logged.append, message("geomsrv/SceneObject"))
        self.engine.apply(gs.SceneUpdate(add=OBJECTS))
        self.engine.camera = CAMERA

    def ask(self, service, **fields):
        name = "".join(f"_{c.lower()}" if c.isupper() else c for c in service).lstrip("_")
        return getattr(self.handlers, name)(request(service, **fields), response(service))


@pytest.fixture
def desk():
    return Desk()


def shapes(*items):
    sent = [message("geomsrv/Shape")() for _ in items]
    for target, shape in zip(sent, items, strict=True):
        convert.set_shape(target, shape)
    return sent


def at(*positions):
    return D([[*p, 0, 0, 0, 1] for p in positions])


def frustum(camera=CAMERA):
    sent = message("geomsrv/Frustum")()
    convert.set_frustum(sent, camera)
    return sent


def is_empty(answer) -> bool:
    """Nothing but status and message is filled."""
    fresh = type(answer)()
    return all(
        value == getattr(fresh, name) for name, value in vars(answer).items() if name not in ("status", "message")
    )


# ------------------------------------------------------------------------------------------------------- distance


def test_distance_by_ids(desk) -> None:
    got = desk.ask("Distance", select=BY_IDS, ids_a=["ball", "box"], ids_b=["box", "ball"], want=["witness"])
    assert (got.status, got.message) == (OK, "")
    assert got.ids_a == ["ball", "box"] and got.ids_b == ["box", "ball"]
    assert got.distance.tolist() == [0.5, 0.5] and got.item_status.tolist() == [0, 0]
    assert got.point_a.tolist() == [1.5, 0, 0, 1, 0, 0] and got.point_b.tolist() == [1, 0, 0, 1.5, 0, 0]
    assert got.normal.tolist() == [-1, 0, 0, 1, 0, 0]
    assert all(low <= 0.5 <= high for low, high in zip(got.lower, got.upper, strict=True))
    assert got.scene_version == desk.engine.scene.version and got.cost.accuracy == "float64"
    assert list(got.cost.stages) == ["narrow box-sphere", "tier float64"] and got.cost.counts.tolist() == [2, 2]
    assert got.cost.error_bound == max(np.subtract(got.upper, got.lower))


def test_distance_of_one_against_many_and_without_witness(desk) -> None:
    got = desk.ask("Distance", select=BY_IDS, ids_a=["box"], ids_b=["ball", "far", "ball"])
    assert got.distance.tolist() == [0.5, 7.75, 0.5]
    assert got.ids_a == ["box"] * 3
    assert len(got.point_a) == len(got.point_b) == len(got.normal) == 0


def test_distance_of_allowed_pairs_is_answered_when_asked_for(desk) -> None:
    desk.engine.apply(gs.SceneUpdate(allow=[("ball", "box")]))
    assert desk.ask("Distance", select=BY_IDS, ids_a=["ball"], ids_b=["box"]).distance.tolist() == [0.5]
    every = desk.ask("Distance", select=ALL, max_distance=math.inf)
    assert ("ball", "box") not in set(zip(every.ids_a, every.ids_b, strict=True))


def test_distance_to_the_nearest_other_object(desk) -> None:
    got = desk.ask("Distance", select=BY_IDS, ids_a=["far", "box", "left"], want=["witness"])
    assert got.status == OK
    assert list(zip(got.ids_a, got.ids_b, strict=True)) == [("far", "box"), ("box", "ball"), ("left", "right")]
    assert got.distance.tolist() == [7.75, 0.5, 2.0]
    assert got.normal.tolist()[:3] == [0, -1, 0], "from the object asked about"
    desk.engine.apply(gs.SceneUpdate(remove=["right"]))
    alone = desk.ask("Distance", select=BY_IDS, ids_a=["left", "far"])
    assert alone.status == UNSUPPORTED and "'left' has no object to be compared with" in alone.message
    assert alone.ids_a == ["far"]


def test_distance_inline(desk) -> None:
    got = desk.ask(
        "Distance",
        select=INLINE,
        shapes_a=shapes(gs.Sphere(1.0)),
        poses_a=at((0, 0, 0)),
        shapes_b=shapes(gs.Sphere(1.0), gs.Box([1, 1, 1]), gs.Sphere(1.0)),
        poses_b=at((3, 0, 0), (0, 5, 0), (1.5, 0, 0)),
        want=["distance", "penetration"],
    )
    assert got.status == OK and got.ids_a == [] and got.scene_version == 0
    assert got.distance.tolist() == [1.0, 3.0, -0.5]


def test_distance_of_two_bodies(desk) -> None:
    fields = {"select": INLINE, "shapes_a": shapes(gs.Sphere(1.0)), "poses_a": at((0, 0, 0)), "poses_b": at((3, 0, 0))}
    got = desk.ask("Distance", **fields, shapes_b=shapes(gs.Box([1, 1, 1])), want=["witness"])
    assert got.status == OK and got.distance.tolist() == [1.0] and got.normal.tolist() == [1, 0, 0]
    assert got.cost.stages == ["narrow box-sphere"] and got.scene_version == 0 and got.ids_a == []
    sheet = desk.ask("Distance", **fields, shapes_b=shapes(SHEET))
    assert sheet.status == UNSUPPORTED and "mesh-sphere" in sheet.message
    cone = desk.ask("Distance", **fields, shapes_b=shapes(gs.Cone(1, 1)))
    assert cone.status == OK and cone.distance[0] == pytest.approx(math.sqrt(4.25) - 1.0, abs=1e-14)
    flat = desk.ask("Distance", **fields, shapes_b=shapes(SQUARE))
    assert flat.status == UNSUPPORTED and "polygons" in flat.message


def test_distance_of_all_pairs_nearest_first(desk) -> None:
    got = desk.ask("Distance", select=ALL, max_distance=8.0, want=["witness"])
    found = list(zip(got.ids_a, got.ids_b, got.distance, strict=True))
    assert found[:3] == [("ball", "box", 0.5), ("left", "right", 2.0), ("box", "far", 7.75)]
    assert got.status == UNSUPPORTED and "mesh" in got.message
    assert all(status == 2 and math.isnan(d) for status, d in zip(got.item_status[3:], got.distance[3:], strict=True))
    assert {b for _, b, _ in found[3:]} | {a for a, _, _ in found[3:]} >= {"sheet"}
    desk.engine.apply(gs.SceneUpdate(remove=["sheet"]))
    rest = desk.ask("Distance", select=ALL, max_distance=0.6)
    assert rest.status == OK and rest.distance.tolist() == [0.5]
    assert "never" in rest.message, "polygons and solids are not compared, and the message says so"


def test_unsupported_pairs_are_named_and_the_others_answered(desk) -> None:
    got = desk.ask("Distance", select=BY_IDS, ids_a=["ball", "ball", "ball"], ids_b=["sheet", "box", "left"])
    assert got.status == UNSUPPORTED
    assert "distance mesh-sphere is unsupported" in got.message and "polygons" in got.message
    assert got.item_status.tolist() == [2, 0, 2] and got.distance[1] == 0.5 and math.isnan(got.distance[0])


# -------------------------------------------------------------------------------------------------- first contact


def test_first_contact_by_ids(desk) -> None:
    got = desk.ask(
        "FirstContact",
        select=BY_IDS,
        ids_a=["left", "right"],
        ids_b=["right", "left"],
        horizon=5.0,
        want=["contact_set"],
    )
    assert got.status == OK and got.item_status.tolist() == [1, 1]
    assert got.time.tolist() == [2.0, 2.0] and got.last_time.tolist() == [4.0, 4.0]
    assert got.normal.tolist() == [1, 0, 0, -1, 0, 0]
    assert got.closing_speed.tolist() == [1.0, 1.0]
    assert got.point_offsets.tolist() == [0, 2, 4]
    assert got.points.tolist()[:6] == [3, 0.5, 0, 3, 1, 0]
    assert all(low <= 2.0 <= high for low, high in zip(got.time_lower, got.time_upper, strict=True))


def test_first_contact_at_a_distance(desk) -> None:
    pair = {"select": BY_IDS, "ids_a": ["left"], "ids_b": ["right"], "horizon": 5.0}
    got = desk.ask("FirstContact", **pair, margin=0.5)
    assert got.status == OK and got.item_status.tolist() == [1]
    assert got.time_lower[0] <= 1.5 <= got.time_upper[0] <= got.time_lower[0] + TIME_TOLERANCE
    near = desk.ask("FirstContact", **pair, margin=2.5)
    assert near.item_status.tolist() == [3] and near.time.tolist() == [0.0]
    for field, value, status in (("margin", -1.0, BAD_REQUEST), ("margin", math.nan, BAD_REQUEST)):
        refused = desk.ask("FirstContact", **pair, **{field: value})
        assert refused.status == status and field in refused.message
    exact = desk.ask("FirstContact", **pair, margin=0.5, accuracy="exact")
    assert exact.status == NOT_AVAILABLE and "margin" in exact.message
    proof = desk.ask("FirstContact", **pair, margin=0.5, certificates=True)
    assert proof.status == NOT_AVAILABLE and "margin" in proof.message


def test_first_contact_earliest(desk) -> None:
    full = desk.ask("FirstContact", select=ALL, horizon=5.0)
    alone = desk.ask("FirstContact", select=ALL, horizon=5.0, earliest=True)
    assert alone.status == full.status and (alone.ids_a[:1], alone.time[:1]) == (full.ids_a[:1], full.time[:1])
    listed = desk.ask("FirstContact", select=BY_IDS, ids_a=["left"], ids_b=["right"], horizon=5.0, earliest=True)
    assert listed.status == BAD_REQUEST and "earliest" in listed.message


def test_first_contact_never_and_without_points(desk) -> None:
    got = desk.ask("FirstContact", select=BY_IDS, ids_a=["left"], ids_b=["right"], horizon=1.0)
    assert got.item_status.tolist() == [0] and math.isnan(got.time[0])
    assert len(got.points) == len(got.point_offsets) == 0


def test_first_contact_inline_with_twists(desk) -> None:
    fields = {
        "select": INLINE,
        "shapes_a": shapes(SQUARE),
        "poses_a": at((0, 0, 0)),
        "shapes_b": shapes(SQUARE),
        "poses_b": at((3, 0, 0)),
        "horizon": math.inf,
    }
    assert desk.ask("FirstContact", **fields).item_status.tolist() == [0], "at rest"
    moving = desk.ask("FirstContact", **fields, twists_a=D([0.5, 0, 0, 0, 0, 0]), twists_b=D([-0.5, 0, 0, 0, 0, 0]))
    assert moving.time.tolist() == [2.0] and moving.status == OK
    turning = desk.ask("FirstContact", **fields, twists_a=D([0.5, 0, 0, 0, 0, 0.1]))
    assert turning.status == OK and turning.item_status.tolist() == [1]
    # It turns about its corner: the one ahead is at 0.5 t + cos(0.1 t).
    t = turning.time[0]
    assert 0.5 * t + math.cos(0.1 * t) == pytest.approx(3.0, abs=1e-5)
    assert 0.0 < turning.time_upper[0] - turning.time_lower[0] <= 1e-6
    fields |= {"shapes_a": shapes(SHEET), "shapes_b": shapes(gs.Sphere(1.0)), "twists_a": D([0.5, 0, 0, 0, 0, 0.1])}
    sheet = desk.ask("FirstContact", **fields)
    assert sheet.status == OK and sheet.item_status.tolist() == [1]
    sheet = desk.ask("FirstContact", **fields, accuracy="exact")
    assert sheet.status == UNSUPPORTED and sheet.item_status.tolist() == [4] and math.isnan(sheet.time[0])


def test_first_contact_of_all_pairs(desk) -> None:
    got = desk.ask("FirstContact", select=ALL, horizon=5.0, want=["contact_set", "first_contact"])
    pairs = dict(zip(zip(got.ids_a, got.ids_b, strict=True), got.item_status, strict=True))
    assert got.status == OK and pairs == {("left", "right"): 1}, "the sheet is too far away to matter"
    desk.engine.apply(gs.SceneUpdate(add=[gs.SceneObject("sheet", SHEET, (0, 0, 1.5, 0, 0, 0, 1), (0, 0, 0, 1, 0, 0))]))
    got = desk.ask("FirstContact", select=ALL, horizon=5.0)
    assert got.status == OK and "mesh" not in got.message and "sheet" in got.ids_b
    lost = gs.SceneObject("sheet", SHEET, (0, 0, 1.5, 0, 0, 0, 1), motion_fault="it jumps")
    desk.engine.apply(gs.SceneUpdate(add=[lost]))
    got = desk.ask("FirstContact", select=ALL, horizon=5.0)
    assert got.status == UNSUPPORTED and "it jumps" in got.message and 4 in got.item_status
    desk.engine.apply(gs.SceneUpdate(remove=["sheet"], add=[obj("deep", gs.Box([1, 1, 1]), (-0.5, 0, 0))]))
    now = desk.ask("FirstContact", select=ALL, horizon=5.0)
    assert now.status == OK and now.time.tolist() == sorted(now.time)
    assert ("box", "deep") == (now.ids_a[0], now.ids_b[0]) and now.item_status[0] == 3 and now.time[0] == 0.0


def test_first_contact_of_meshes(desk) -> None:
    """Two sills on a table: two parts, of two triangles each; sorted by time among others."""
    sills = gs.Mesh(
        [(x, y, 0) for x0 in (0, 2) for x, y in ((x0, 0), (x0 + 1, 0), (x0 + 1, 1), (x0, 1))],
        [(0, 1, 2), (0, 2, 3), (4, 5, 6), (4, 6, 7)],
    )
    table = gs.Box([5, 5, 1])
    fields = {"select": INLINE, "shapes_a": shapes(sills), "shapes_b": shapes(table), "horizon": 9.0}
    fields |= {"poses_a": at((0, 0, 2)), "poses_b": at((0, 0, -1)), "twists_a": D([[0, 0, -1, 0, 0, 0]])}
    got = desk.ask("FirstContact", **fields, want=["contact_set"])
    assert got.status == OK and got.time.tolist() == [2.0] and got.normal.tolist() == [0, 0, -1]
    assert got.point_offsets.tolist() == [0, 8] and got.part_offsets.tolist() == [0, 4, 8]
    # Turning as they come down they are the same two, on a table that is a mesh.
    spun = fields | {"twists_a": D([[0, 0, -1, 0, 0, 0.5]]), "shapes_b": shapes(box_mesh((-5, -5, -1), (5, 5, 1)))}
    turned = desk.ask("FirstContact", **spun, want=["contact_set"])
    assert turned.status == OK and abs(turned.time[0] - 2.0) < TIME_TOLERANCE
    assert turned.point_offsets.tolist() == [0, 8] and turned.part_offsets.tolist() == [0, 4, 8]
    assert desk.ask("FirstContact", **spun).points.tolist() == []
    proof = desk.ask("FirstContact", **fields, certificates=True)
    assert proof.status == OK and '"claim": {}' in proof.certificates[0]
    desk.engine.apply(
        gs.SceneUpdate(
            clear=True,
            add=[
                obj("left", SQUARE, (0, 0, 0), (1, 0, 0)),
                obj("right", SQUARE, (3, 0.5, 0)),
                obj("sills", sills, (50, 0, 1.5), (0, 0, -1)),
                obj("table", table, (50, 0, -1)),
                obj("block", gs.Box([1, 1, 1]), (53, 0, 1)),
            ],
        )
    )
    got = desk.ask("FirstContact", select=ALL, horizon=9.0, want=["contact_set"])
    sets = [got.point_offsets[k + 1] - got.point_offsets[k] for k in range(len(got.ids_a))]
    assert sum(sets) == got.part_offsets[-1] == len(got.points) // 3
    assert set(got.point_offsets) <= set(got.part_offsets)
    k = list(zip(got.ids_a, got.ids_b, strict=True)).index(("sills", "table"))
    parts = [end for end in got.part_offsets if got.point_offsets[k] <= end <= got.point_offsets[k + 1]]
    assert got.time[k] == 1.5 and np.diff(parts).tolist() == [4, 4]
    ((_, answer),) = desk.engine.steps({"contacts"})
    sent = message("geomsrv/ContactArray")()
    convert.set_contacts(sent, answer, message("geomsrv/Contact"), message("geometry_msgs/Point"))
    listed = {(contact.id_a, contact.id_b): contact for contact in sent.contacts}
    contact = listed["sills", "table"]
    assert len(contact.points) == 8 and contact.part_offsets.tolist() == [0, 4, 8]


def test_uncertain_polygons_answer_wider_intervals(desk) -> None:
    desk.engine.apply(gs.SceneUpdate(add=[obj("left", SQUARE, (0, 0, 0), (1, 0, 0), uncertainty=1e-3)]))
    got = desk.ask("FirstContact", select=BY_IDS, ids_a=["right"], ids_b=["left"], horizon=5.0, want=["contact_set"])
    assert got.time_lower[0] <= 1.999 and got.time_upper[0] >= 2.001 and got.time[0] == 2.0
    assert got.normal.tolist() == [-1, 0, 0] and len(got.points) == 6


# ----------------------------------------------------------------------------------------------------------- cull


def test_cull_by_ids_inline_and_all(desk) -> None:
    everything = desk.ask("Cull", select=ALL)
    assert everything.status == OK and everything.ids == sorted(o.id for o in OBJECTS)
    state = dict(zip(everything.ids, everything.states, strict=True))
    assert (state["box"], state["far"]) == (gs.INSIDE, gs.OUTSIDE)
    some = desk.ask("Cull", select=BY_IDS, ids=["far", "box", "far"], view=1, frustum=frustum())
    assert some.states.tolist() == [0, 2, 0] and some.certain.tolist() == [1, 1, 1]
    assert some.ids == ["far", "box", "far"]
    own = desk.ask(
        "Cull", select=INLINE, shapes=shapes(gs.Box([1, 1, 1]), gs.Box([9, 9, 9])), poses=at((0, 0, 0), (0, 0, 0))
    )
    assert own.states.tolist() == [2, 1] and own.ids == [] and own.scene_version == 0


def test_cull_without_a_camera_is_not_available(desk) -> None:
    desk.engine.camera = None
    got = desk.ask("Cull", select=ALL)
    assert got.status == NOT_AVAILABLE and "no ~/camera_info has come yet" in got.message and is_empty(got)


# -------------------------------------------------------------------------------------------------------- batches


def test_cull_batch_is_cull(desk) -> None:
    rng = np.random.default_rng(5)
    boxes = gs.Boxes(rng.uniform(-4, 4, (50, 3)), np.tile(np.eye(3), (50, 1, 1)), rng.uniform(0.1, 1, (50, 3)))
    got = desk.ask(
        "CullBatch",
        frustum=D(CAMERA.packed()),
        centers=D(boxes.center),
        axes=D(boxes.axes),
        half_extents=D(boxes.half_extents),
    )
    want = gs.cull(CAMERA, boxes)
    assert (
        got.status == OK
        and got.states.tolist() == want.state.tolist()
        and got.certain.tolist() == want.certain.tolist()
    )
    assert set(got.states) == {0, 1, 2}


POLYGON, BOXES, POLYGONS, POLYTOPES, FRUSTUM, POINTS = 14, 101, 102, 103, 104, 105


def test_distance_batch_of_batches(desk) -> None:
    boxes = [0, 0, 0, *np.eye(3).ravel(), 1, 1, 1]
    away = [4, 0, 0, *np.eye(3).ravel(), 1, 1, 1]
    got = desk.ask(
        "DistanceBatch", kind_a=BOXES, values_a=D(boxes), kind_b=BOXES, values_b=D(away + boxes), want=["witness"]
    )
    assert got.distance.tolist() == [2.0, 0.0] and got.point_a.tolist()[:1] == [1.0] and len(got.normal) == 6
    rings = {"values_a": D([0, 0, 1, 0, 0, 1]), "offsets_a": convert.uint32s([0, 3])}
    flat = desk.ask(
        "DistanceBatch",
        kind_a=POLYGONS,
        kind_b=POLYGONS,
        values_b=D([3, 0, 4, 0, 3, 1, 1, 1]),
        offsets_b=convert.uint32s([0, 3, 4]),
        want=["witness"],
        **rings,
    )
    assert flat.status == OK and np.allclose(flat.distance, [2.0, math.sqrt(0.5)]) and len(flat.point_a) == 4
    hulls = desk.ask(
        "DistanceBatch",
        kind_a=FRUSTUM,
        values_a=D(CAMERA.packed()),
        kind_b=POLYTOPES,
        values_b=D([0, 0, -7, 0, 0, -8]),
        offsets_b=convert.uint32s([0, 2]),
    )
    assert np.allclose(hulls.distance, [3.0]) and len(hulls.region) == 0


def test_distance_batch_of_points_and_a_frustum(desk) -> None:
    points = np.array([[0, 0, -4.5], [0, 0, 0], [9, 0, 0.0]])
    got = desk.ask("DistanceBatch", kind_a=FRUSTUM, values_a=D(CAMERA.packed()), kind_b=POINTS, values_b=D(points))
    want = gs.distance_to_frustum(CAMERA, points)
    assert got.distance.tolist() == want.distance.tolist() and got.region.tolist() == want.region.tolist()


def test_distance_batch_of_shapes_at_many_poses(desk) -> None:
    poses = at((4, 0, 0), (0, 3, 0), (1.5, 0, 0))
    sphere_box = {"kind_a": 1, "values_a": D([1.0]), "kind_b": 6, "values_b": D([1, 1, 1]), "poses_ab": poses}
    got = desk.ask("DistanceBatch", **sphere_box, want=["penetration"])
    assert got.status == OK and got.distance.tolist() == [2.0, 1.0, -0.5]
    tetrahedron = D([0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1])
    hull = desk.ask(
        "DistanceBatch", kind_a=1, values_a=D([1.0]), kind_b=8, values_b=tetrahedron, poses_ab=at((3, 0, 0))
    )
    assert np.allclose(hull.distance, 2.0)
    cone = desk.ask("DistanceBatch", kind_a=1, values_a=D([1.0]), kind_b=4, values_b=D([1, 1]), poses_ab=poses)
    assert cone.status == OK and list(cone.item_status) == [0, 0, 0] and cone.distance[0] > cone.distance[2] == 0.0
    flat = desk.ask(
        "DistanceBatch", kind_a=1, values_a=D([1.0]), kind_b=14, values_b=D([0, 0, 1, 0, 0, 1]), poses_ab=poses
    )
    assert flat.status == UNSUPPORTED and "sphere-polygon" in flat.message and flat.item_status.tolist() == [2, 2, 2]


def test_first_contact_batch(desk) -> None:
    fields = {
        "vertices_a": D([0, 0, 1, 0, 1, 1, 0, 1]),
        "offsets_a": convert.uint32s([0, 4]),
        "vertices_b": D([3, 0.5, 4, 0.5, 4, 1.5, 3, 1.5, 0, 5]),
        "offsets_b": convert.uint32s([0, 4, 5]),
        "velocities_a": D([1, 0]),
        "velocities_b": D([0, 0]),
        "t_max": 10.0,
    }
    got = desk.ask("FirstContactBatch", **fields, want=["contact_set"])
    assert got.item_status.tolist() == [1, 0] and got.time[0] == 2.0 and got.last_time[0] == 4.0
    assert got.points.tolist() == [3, 0.5, 3, 1] and got.point_offsets.tolist() == [0, 2, 2]
    assert got.normal.tolist()[:2] == [1, 0] and got.closing_speed[0] == 1.0 and math.isnan(got.closing_speed[1])
    solid = desk.ask(
        "FirstContactBatch",
        dimension=3,
        vertices_a=D([0, 0, 0]),
        offsets_a=convert.uint32s([0, 1]),
        vertices_b=D([3, 0, 0]),
        offsets_b=convert.uint32s([0, 1]),
        velocities_a=D([1, 0, 0]),
        velocities_b=D([0, 0, 0]),
        t_max=10.0,
    )
    assert solid.status == OK and solid.item_status.tolist() == [1] and solid.time.tolist() == [3.0]


# --------------------------------------------------------------------------------------------------- certificates


def claims(answer) -> list[dict]:
    """What the certificates of an answer claim; all of it is proven."""
    assert [fault for _, _, fault in verify_lines(answer.certificates)] == [""] * len(answer.certificates)
    return [json.loads(line)["claim"] for line in answer.certificates]


BOX_AND_BALL = {"shapes_a": shapes(gs.Box([1, 1, 1])), "poses_a": at((5, 5, 5)), "shapes_b": shapes(gs.Sphere(0.5))}
BATCH_OF_BOXES = {"kind_a": 101, "values_a": D([0, 0, 0, *np.eye(3).ravel(), 1, 1, 1]), "kind_b": 101}
RINGS = {"vertices_a": D([0, 0, 1, 0, 0, 1]), "offsets_a": convert.uint32s([0, 3])}
CERTIFIED = {
    "distance by ids": (
        "Distance",
        {"ids_a": ["box", "left", "left", "sheet"], "ids_b": ["ball", "right", "ball", "box"]},
        [1, 1, 0, 0],
    ),
    "distance to the nearest": ("Distance", {"ids_a": ["box", "far"]}, [1, 1]),
    "distance inline": ("Distance", {"select": INLINE, "poses_b": at((9, 5, 5)), **BOX_AND_BALL}, [1]),
    "depth inline": (
        "Distance",
        {"select": INLINE, "poses_b": at((5, 5, 5)), "want": ["penetration"], **BOX_AND_BALL},
        [1],
    ),
    "first contact": ("FirstContact", {"ids_a": ["left", "box"], "ids_b": ["right", "ball"], "horizon": 5.0}, [1, 0]),
    "first contact of solids": (
        "FirstContact",
        {"select": INLINE, "horizon": 9.0}
        | {"shapes_a": shapes(gs.Box([1, 1, 1])), "poses_a": at((0, 0, 0)), "twists_a": D([1, 0, 0, 0, 0, 0])}
        | {"shapes_b": shapes(gs.Convex(np.eye(3))), "poses_b": at((5, 0, 0))},
        [1],
    ),
    "cull by ids": ("Cull", {"ids": ["far", "box", "ball"]}, [0, 1, 0]),
    "cull all": ("Cull", {"select": ALL}, [0, 1, 0, 0, 0, 0]),
    "cull inline": ("Cull", {"select": INLINE, "shapes": shapes(gs.Box([1, 1, 1])), "poses": at((0, 0, 0))}, [1]),
    "cull batch": (
        "CullBatch",
        {"frustum": D(CAMERA.packed()), "centers": D([0, 0, 0]), "axes": D(np.eye(3)), "half_extents": D([1, 1, 1])},
        [1],
    ),
    "distance batch": ("DistanceBatch", {"values_b": D([4, 0, 0, *np.eye(3).ravel(), 1, 1, 1]), **BATCH_OF_BOXES}, [1]),
    "points batch": (
        "DistanceBatch",
        {"kind_a": 104, "values_a": D(CAMERA.packed()), "kind_b": 105, "values_b": D([0, 0, 0, 9, 9, 9])},
        [1, 1],
    ),
    "first contact batch": (
        "FirstContactBatch",
        {"vertices_b": D([3, 0, 4, 0, 3, 1]), "offsets_b": convert.uint32s([0, 3]), **RINGS}
        | {"velocities_a": D([1, 0]), "velocities_b": D([0, 0]), "t_max": math.inf},
        [1],
    ),
    "first contact batch of solids": (
        "FirstContactBatch",
        {"dimension": 3, "vertices_a": D(np.eye(3)), "offsets_a": convert.uint32s([0, 3])}
        | {"vertices_b": D(np.eye(3) + 2), "offsets_b": convert.uint32s([0, 3])}
        | {"velocities_a": D([1, 1, 1]), "velocities_b": D([0, 0, 0]), "t_max": math.inf},
        [1],
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", CERTIFIED)
def test_answers_come_with_certificates(desk, name) -> None:
    service, fields, claimed = CERTIFIED[name]
    got, bare = desk.ask(service, **fields, certificates=True), desk.ask(service, **fields)
    assert got.status in (OK, UNSUPPORTED), got.message
    assert [bool(claim) for claim in claims(got)] == [bool(x) for x in claimed]
    # Nothing else changes.
    assert len(bare.certificates) == 0
    for field in vars(got).keys() - {"certificates", "cost"}:
        assert str(getattr(got, field)) == str(getattr(bare, field)), field


def test_certificates_say_what_the_answer_says(desk) -> None:
    got = desk.ask("Distance", ids_a=["ball"], ids_b=["box"], certificates=True)
    (claim,) = claims(got)
    assert got.lower[0] <= float.fromhex(claim["lower"]) <= 0.5 <= float.fromhex(claim["upper"]) <= got.upper[0]
    (state,) = claims(desk.ask("Cull", ids=["box"], certificates=True))
    assert state == {"state": "INSIDE"}
    # Turned bodies: the number is that of the same literal pose, only the interval covers the rounding of it.
    turned = [gs.SceneObject("a", HULL_A, POSE_A), gs.SceneObject("b", HULL_B, POSE_B)]
    desk.engine.apply(gs.SceneUpdate(add=turned))
    for tier in ("float64", "exact"):
        got = desk.ask("Distance", ids_a=["a"], ids_b=["b"], certificates=True, accuracy=tier)
        (claim,) = claims(got)
        assert float.fromhex(claim["distance"]) == got.distance[0] and claim["meets"] is False
        assert got.lower[0] < float.fromhex(claim["lower"]) < float.fromhex(claim["upper"]) < got.upper[0]


def test_objects_that_may_be_elsewhere_are_not_certified(desk) -> None:
    desk.engine.apply(gs.SceneUpdate(add=[obj("left", SQUARE, velocity=(1, 0, 0), uncertainty=1e-3)]))
    assert claims(desk.ask("FirstContact", ids_a=["left"], ids_b=["right"], certificates=True)) == [{}]
    desk.engine.apply(gs.SceneUpdate(add=[obj("box", gs.Box([1, 1, 1]), uncertainty=1e-3)]))
    assert claims(desk.ask("Cull", ids=["box"], certificates=True)) == [{}]


@pytest.mark.parametrize("service", ["Distance", "FirstContact"])
def test_certificates_of_all_pairs_are_not_available(desk, service) -> None:
    got = desk.ask(service, select=ALL, certificates=True)
    assert got.status == NOT_AVAILABLE and "certificates are given for listed pairs" in got.message and is_empty(got)


# ---------------------------------------------------------------------------------------------------------- scene


def test_apply_and_get_scene(desk) -> None:
    got = desk.ask("GetScene")
    assert got.status == OK and [item.id for item in got.scene.add] == sorted(o.id for o in OBJECTS)
    assert got.scene.header.frame_id == "world" and got.version == desk.engine.scene.version
    other = Desk()
    assert other.ask("ApplyScene", update=message("geomsrv/SceneUpdate")(clear=True)).status == OK
    again = other.ask("ApplyScene", update=got.scene)
    assert again.status == OK and again.version == other.engine.scene.version
    assert other.ask("GetScene").scene == got.scene, "the scene rebuilds itself"
    assert [item.id for item in desk.ask("GetScene", ids=["far", "ball"]).scene.add] == ["far", "ball"]


def test_refused_updates_name_every_object_and_change_nothing(desk) -> None:
    before, version = desk.ask("GetScene").scene, desk.engine.scene.version
    update = message("geomsrv/SceneUpdate")(remove=["nobody", "ball"], allow_a=["x"], allow_b=["x"])
    got = desk.ask("ApplyScene", update=update)
    assert got.status == BAD_REQUEST and got.ids == ["nobody", "x"] and all(got.faults)
    assert got.version == version == desk.engine.scene.version and desk.ask("GetScene").scene == before
    assert "nobody" in got.message
    bad = message("geomsrv/SceneObject")(id="bad")
    shape = desk.ask("ApplyScene", update=message("geomsrv/SceneUpdate")(add=[bad]))
    assert shape.ids == ["bad"] and shape.faults == ["shape: type 0 is not set"]
    assert desk.ask("GetScene", ids=["nobody"]).status == BAD_REQUEST


def test_clear_and_self_check(desk) -> None:
    trigger = message("std_srvs/Trigger_Response")
    assert desk.handlers.clear(None, trigger()).success and len(desk.engine.scene) == 0
    report = desk.handlers.self_check(None, trigger())
    assert report.message and isinstance(report.success, bool)


# --------------------------------------------------------------------------------------------------- bad requests

SPHERE_AT = {"shapes_a": shapes(gs.Sphere(1.0)), "poses_a": at((0, 0, 0)), "shapes_b": shapes(gs.Sphere(1.0))}
BOX = [0, 0, 0, *np.eye(3).ravel(), 1, 1, 1]
BAD = [
    ("Distance", {"select": BY_IDS, "ids_a": ["ball"], "ids_b": ["nobody"]}, r"ids_b\[0\] is 'nobody': no such object"),
    ("Distance", {"select": BY_IDS, "ids_a": ["ball", "box"], "ids_b": ["far"] * 3}, "2 and 3 items"),
    ("Distance", {"select": BY_IDS, "ids_a": ["ball"], "ids_b": ["ball"]}, "'ball' with itself"),
    ("Distance", {"select": BY_IDS, "ids_a": ["nobody"]}, "nobody"),
    ("Distance", {"select": 3}, "select must be"),
    ("Distance", {"select": BY_IDS, "ids_a": ["ball"], "poses_a": at((0, 0, 0))}, "poses_a must be empty here"),
    ("Distance", {"select": INLINE, "ids_a": ["ball"]}, "ids_a must be empty here"),
    ("Distance", {"select": ALL, "ids_a": ["ball"]}, "ids_a must be empty here"),
    ("Distance", {"select": ALL, "max_distance": math.nan}, "max_distance"),
    ("Distance", {"select": ALL, "max_distance": -1.0}, "max_distance must be >= 0"),
    ("Distance", {"select": ALL, "want": ["everything"]}, "want must name"),
    ("Distance", {"select": ALL, "accuracy": "best"}, "accuracy must be one of"),
    ("Distance", {"select": INLINE, **SPHERE_AT}, "shapes_b are 1, poses_b are of 0"),
    ("Distance", {"select": INLINE, **SPHERE_AT, "poses_b": at((math.nan, 0, 0))}, r"poses_b\[0, 0\] is nan"),
    ("Distance", {"select": INLINE, **SPHERE_AT, "poses_b": D([0.0] * 7)}, r"poses_b\[0\] quaternion"),
    ("Distance", {"select": INLINE, **SPHERE_AT, "poses_b": D([0.0] * 6)}, "poses_b must hold 7 numbers per item"),
    (
        "Distance",
        {"select": INLINE, **SPHERE_AT, "shapes_b": [message("geomsrv/Shape")()], "poses_b": at((0, 0, 0))},
        r"shapes_b\[0\]: type 0 is not set",
    ),
    ("FirstContact", {"select": BY_IDS, "ids_a": ["left"], "ids_b": ["nobody"]}, "nobody"),
    (
        "FirstContact",
        {"select": BY_IDS, "ids_a": ["left"], "ids_b": ["right"], "horizon": -1.0},
        "horizon must be >= 0",
    ),
    ("FirstContact", {"select": ALL, "horizon": math.nan}, "horizon"),
    ("FirstContact", {"select": ALL, "want": ["distance"]}, "want must name"),
    ("FirstContact", {"select": ALL, "twists_b": D([0.0] * 6)}, "twists_b must be empty here"),
    (
        "FirstContact",
        {"select": INLINE, **SPHERE_AT, "poses_b": at((3, 0, 0)), "twists_a": D([0.0] * 5)},
        "twists_a must hold 6 numbers per item",
    ),
    (
        "FirstContact",
        {"select": INLINE, **SPHERE_AT, "poses_b": at((3, 0, 0)), "twists_a": D([math.nan] * 6)},
        r"twists_a\[0, 0\] is nan",
    ),
    (
        "FirstContact",
        {"select": INLINE, **SPHERE_AT, "shapes_b": shapes(SQUARE), "poses_b": at((3, 0, 1))},
        r"poses_b\[0\]: a polygon lies in the plane",
    ),
    ("Cull", {"select": 5}, "select must be BY_IDS, INLINE or ALL"),
    ("Cull", {"select": ALL, "view": 2}, "view must be CAMERA or FRUSTUM"),
    ("Cull", {"select": ALL, "view": 1}, "bounds"),
    ("Cull", {"select": BY_IDS, "ids": ["nobody"]}, "nobody"),
    ("Cull", {"select": ALL, "ids": ["ball"]}, "ids must be empty here"),
    ("Cull", {"select": INLINE, "shapes": shapes(gs.Sphere(1.0))}, "shapes are 1, poses are of 0"),
    ("CullBatch", {}, "frustum must hold 18 numbers, got 0"),
    ("CullBatch", {"frustum": D(CAMERA.packed()), "centers": D([0, 0])}, "centers must hold 3 numbers"),
    ("CullBatch", {"frustum": D(CAMERA.packed()), "centers": D([0, 0, 0])}, r"axes must have shape \(1, 3, 3\)"),
    ("DistanceBatch", {}, "kind_a 0|type 0"),
    ("DistanceBatch", {"kind_a": BOXES, "values_a": D(BOX), "kind_b": 1, "values_b": D([1.0])}, "must both be"),
    (
        "DistanceBatch",
        {"kind_a": BOXES, "values_a": D(BOX), "kind_b": POINTS, "values_b": D([0, 0, 0])},
        "needs kind_a FRUSTUM",
    ),
    ("DistanceBatch", {"kind_a": POINTS, "values_a": D([0, 0, 0]), "kind_b": BOXES, "values_b": D(BOX)}, "kind_a 105"),
    ("DistanceBatch", {"kind_a": BOXES, "values_a": D(BOX[:-1]), "kind_b": BOXES}, "values_a must hold 15 numbers"),
    (
        "DistanceBatch",
        {"kind_a": BOXES, "values_a": D(BOX), "offsets_a": convert.uint32s([0, 1]), "kind_b": BOXES},
        "offsets_a must be empty here",
    ),
    (
        "DistanceBatch",
        {"kind_a": BOXES, "values_a": D(BOX), "kind_b": BOXES, "values_b": D(BOX), "poses_ab": at((0, 0, 0))},
        "poses_ab must be empty here",
    ),
    (
        "DistanceBatch",
        {
            "kind_a": FRUSTUM,
            "values_a": D(CAMERA.packed()),
            "kind_b": POINTS,
            "values_b": D([0, 0, 0]),
            "want": ["penetration"],
        },
        "want must name",
    ),
    ("FirstContactAlong", {}, "shape must be one, where id is empty; got 0"),
    ("FirstContactAlong", {"id": "nobody"}, "id is 'nobody': no such object"),
    ("FirstContactAlong", {"id": "ball", "shape": shapes(gs.Sphere(1.0))}, "shape must be empty here"),
    ("FirstContactAlong", {"id": "ball"}, "times and poses must be as many, at least two; got 0 and 0"),
    (
        "FirstContactAlong",
        {"id": "ball", "times": D([0, 1]), "poses": at((0, 0, 0))[:-1]},
        "poses must hold 7 numbers",
    ),
    (
        "FirstContactAlong",
        {"id": "ball", "times": D([0, 1, 1]), "poses": at((0, 0, 0), (1, 0, 0), (2, 0, 0))},
        r"times\[2\] must be later than times\[1\] = 1, got 1",
    ),
    (
        "FirstContactAlong",
        {"id": "ball", "times": D([0.5, 1]), "poses": at((0, 0, 0), (1, 0, 0))},
        r"times\[0\] must be 0, where the motion begins: now; got 0.5",
    ),
    (
        "FirstContactAlong",
        {"id": "ball", "times": D([0, math.nan]), "poses": at((0, 0, 0), (1, 0, 0))},
        r"times\[1\] is nan",
    ),
    (
        "FirstContactAlong",
        {"id": "ball", "times": D([0, 1]), "poses": D([0, 0, 0, 0, 0, 0, 1, 1, 0, 0, 0, 0, 0, 2])},
        r"poses\[1\]",
    ),
    (
        "FirstContactAlong",
        {"id": "left", "times": D([0, 1]), "poses": at((0, 0, 0), (1, 0, 0.5))},
        r"poses\[1\]: a polygon lies in the plane",
    ),
    (
        "FirstContactAlong",
        {"id": "ball", "times": D([0, 1]), "poses": at((0, 0, 0), (1, 0, 0)), "ids": ["box", "nobody"]},
        r"ids\[1\] is 'nobody': no such object",
    ),
    (
        "FirstContactAlong",
        {"id": "ball", "times": D([0, 1]), "poses": at((0, 0, 0), (1, 0, 0)), "ids": ["box", "ball"]},
        r"ids\[1\] is 'ball', the body itself",
    ),
    (
        "FirstContactAlong",
        {"id": "ball", "times": D([0, 1]), "poses": at((0, 0, 0), (1, 0, 0)), "tolerance": -1.0},
        "tolerance must be",
    ),
    ("FirstContactBatch", {"dimension": 4}, "dimension must be 2 or 3, got 4"),
    (
        "FirstContactBatch",
        {
            "vertices_a": D([0, 0, 0, 1, 1, 0]),
            "offsets_a": convert.uint32s([0, 3]),
            "vertices_b": D([0, 0]),
            "offsets_b": convert.uint32s([0, 1]),
            "velocities_a": D([0, 0]),
            "velocities_b": D([0, 0]),
        },
        "ring 0 is clockwise",
    ),
    (
        "FirstContactBatch",
        {
            "vertices_a": D([0, 0]),
            "offsets_a": convert.uint32s([0, 2]),
            "vertices_b": D([]),
            "offsets_b": convert.uint32s([0]),
        },
        "offsets",
    ),
]


@pytest.mark.parametrize(("service", "fields", "text"), BAD, ids=[f"{s}-{i}" for i, (s, _, _) in enumerate(BAD)])
def test_bad_requests_are_answered_by_name(desk, service, fields, text) -> None:
    before, version = desk.ask("GetScene").scene, desk.engine.scene.version
    got = desk.ask(service, **fields)
    assert got.status == BAD_REQUEST, got
    assert re.search(text, got.message), got.message
    assert is_empty(got) and not desk.logged
    assert desk.engine.scene.version == version and desk.ask("GetScene").scene == before


QUERIES = ["Cull", "Distance", "FirstContact", "CullBatch", "DistanceBatch", "FirstContactBatch"]


@pytest.mark.parametrize("service", QUERIES)
@pytest.mark.parametrize("field", ["tolerance", "time_budget"])
def test_bad_limits_are_named(desk, service, field) -> None:
    for value in (-1e-3, math.nan):
        got = desk.ask(service, **{field: value})
        assert got.status == BAD_REQUEST and field in got.message and is_empty(got)


def test_a_tolerance_instead_of_a_tier(desk) -> None:
    """Every service: nothing is wider than what was asked for, and the cost says what it took."""
    ball, far = shapes(gs.Sphere(1.0)), D([3, 0, 0, 0, 0, 0, 1])
    pair = {"select": INLINE, "shapes_a": ball, "poses_a": D([0, 0, 0, 0, 0, 0, 1]), "shapes_b": ball, "poses_b": far}
    got = desk.ask("Distance", **pair, tolerance=1e-9)
    assert got.status == OK and got.distance.tolist() == pytest.approx([1.0], abs=1e-9)
    assert got.cost.accuracy == "bound" and got.cost.error_bound <= 1e-9
    assert dict(zip(got.cost.stages, got.cost.counts, strict=True))["tier bound"] == 1
    got = desk.ask("Distance", select=ALL, max_distance=math.inf, tolerance=1e-6)
    assert np.nanmax(np.subtract(got.upper, got.lower)) <= 1e-6 >= got.cost.error_bound
    swing = {"twists_a": D([0, 0, 0, 0, 0, 1]), "want": ["contact_set"]}
    bar, post = shapes(gs.Box([1, 0.1, 0.1])), shapes(gs.Box([0.1, 0.1, 0.1]))
    moving = pair | {"shapes_a": bar, "shapes_b": post, "poses_b": D([0, 0.9, 0, 0, 0, 0, 1])} | swing
    for tolerance in (1e-2, 1e-9):
        got = desk.ask("FirstContact", **moving, horizon=4.0, tolerance=tolerance)
        assert got.item_status.tolist() == [gs.WILL_TOUCH], got
        assert got.time_upper[0] - got.time_lower[0] <= tolerance and got.cost.error_bound <= tolerance
    assert got.time_upper[0] - got.time_lower[0] > 0.0
    got = desk.ask("Cull", select=ALL, view=1, frustum=frustum(VIEW), tolerance=1e-3)
    assert got.status == OK and got.cost.error_bound == 0.0


SCENE_REQUESTS = [
    ("Distance", {"select": ALL, "max_distance": 9.0}),
    ("Distance", {"select": BY_IDS, "ids_a": ["box"], "ids_b": ["ball"]}),
    ("FirstContact", {"select": ALL, "horizon": 1.0}),
    ("FirstContact", {"select": BY_IDS, "ids_a": ["box"], "ids_b": ["ball"]}),
    ("Cull", {"select": ALL, "view": 1, "frustum": frustum()}),
]


@pytest.mark.parametrize(("service", "fields"), SCENE_REQUESTS)
def test_stale_states_are_a_status(desk, monkeypatch, service, fields) -> None:
    got = desk.ask(service, **fields)
    assert not got.stale and math.isnan(got.input_age), "no stream ever began"
    now = 100.0
    monkeypatch.setattr("geomsrv.engine.time.monotonic", lambda: now)
    desk.engine.set_states(["ball"], [(1.5, 0, 0, 0, 0, 0, 1)], None)
    for passed, stale in ((0.5, False), (1.0, False), (1.5, True)):
        now = 100.0 + passed
        got = desk.ask(service, **fields)
        assert (got.stale, got.input_age) == (stale, passed) and got.status in (OK, UNSUPPORTED)


def test_totals_add_up(desk) -> None:
    """What queries cost, by service and tier."""
    for accuracy in ("float64", "exact", "exact"):
        desk.ask("Distance", select=ALL, max_distance=math.inf, accuracy=accuracy)
    desk.ask("Cull", select=ALL, view=1, frustum=frustum(VIEW), accuracy="bound")
    rows = desk.engine.totals.rows
    assert set(rows) == {("~/distance", "float64"), ("~/distance", "exact"), ("~/cull", "bound")}
    once, twice = rows["~/distance", "float64"], rows["~/distance", "exact"]
    assert (once[0], twice[0]) == (1, 2) and twice[1] == 2 * once[1] > 0 and min(once[2], twice[2]) > 0
    assert rows["~/cull", "bound"][1] == len(desk.engine.scene)


# ---------------------------------------------------------------------------------------------------------- tiers

ACCURACIES = ("bound", "float32", "float64", "exact")
POSE_A, POSE_B = gs._validate.poses([[0.5, 0, 0, 0.1, 0.2, 0.3, 0.9274], [1.5, 2, 1, 0.5, 0.5, 0.5, 0.5]])
HULL_A, HULL_B = gs.Convex(np.eye(3)), gs.Convex([[0, 0, 0], [1, 0.3, 0], [0.2, 1, 0], [0.1, 0.2, 1]])
TRIANGLE = gs.Polygon([[0, 0], [1, 0.3], [0.2, 1]])
TRIANGLES = [gs.Polygons.from_list([TRIANGLE.vertices + step]) for step in ([0, 0], [3, 0.1])]
MOVING = [obj("p", TRIANGLE, (0, 0, 0), (1, 0, 0)), obj("q", TRIANGLE, (3, 0.1, 0))]
VIEW = gs.Frustum([0, 0, -5], np.eye(3), 1.0, 1.0, 1.0, 4.5)
SEEN_AT = np.stack([POSE_A, POSE_B, POSE_A + (0, 0, 2, 0, 0, 0, 0)])
SEEN = gs.Boxes.from_poses(SEEN_AT, np.full((3, 3), 0.5))


def by_tier(desk):
    """Requests of every service, and what the query functions say about the same numbers."""
    inline = {"select": INLINE, "shapes_a": shapes(HULL_A), "poses_a": D(POSE_A), "want": ["penetration"]}
    world = gs.Scene()
    world.apply(gs.SceneUpdate(add=[gs.SceneObject("a", HULL_A, POSE_A), gs.SceneObject("b", HULL_B, POSE_B)]))
    between = relative_poses(world.world, np.array([[0, 1]]))

    def apart(tier):
        return gs.distance(HULL_A, HULL_B, between, want=("penetration",), accuracy=tier)

    def contact(tier):
        return gs.first_contact(*TRIANGLES, (1, 0), (0, 0), t_max=5.0, accuracy=tier)

    cells = [obj(f"{i}", gs.Box([0.5] * 3)) for i in range(3)]
    desk.engine.apply(gs.SceneUpdate(clear=True))
    desk.engine.apply(gs.SceneUpdate(add=[gs.SceneObject("a", HULL_A, POSE_A), gs.SceneObject("b", HULL_B, POSE_B)]))
    desk.engine.apply(gs.SceneUpdate(add=[*MOVING, *cells]))
    desk.engine.scene.set_states(["0", "1", "2"], SEEN_AT)
    flat = {
        "shapes_a": shapes(TRIANGLE),
        "poses_a": at((0, 0, 0)),
        "twists_a": D([1, 0, 0, 0, 0, 0]),
        "shapes_b": shapes(TRIANGLE),
        "poses_b": at((3, 0.1, 0)),
    }
    given, want = {"view": 1, "frustum": frustum(VIEW)}, lambda tier: gs.cull(VIEW, SEEN, accuracy=tier)
    batch = {"kind_a": 104, "values_a": D(VIEW.packed())}
    rings = {
        f"{name}_{s}": value
        for s, ring in zip("ab", TRIANGLES, strict=True)
        for name, value in (("vertices", D(ring.vertices)), ("offsets", convert.uint32s(ring.offsets)))
    }
    hulls = gs.Polytopes.from_list([HULL_A.vertices])
    solid = {f"{n}_{s}": v for s in "ab" for n, v in (("vertices", D(HULL_A.vertices)), ("offsets", [0, 3]))}
    return [
        ("Distance", {**inline, "shapes_b": shapes(HULL_B), "poses_b": D(POSE_B)}, apart, 1),
        ("Distance", {**inline, "shapes_b": shapes(HULL_B, HULL_B), "poses_b": D([POSE_B] * 2)}, apart, 2),
        ("Distance", {"select": BY_IDS, "ids_a": ["a"], "ids_b": ["b"], "want": ["penetration"]}, apart, 1),
        ("FirstContact", {"select": BY_IDS, "ids_a": ["p"], "ids_b": ["q"], "horizon": 5.0}, contact, 1),
        ("FirstContact", {"select": INLINE, **flat, "horizon": 5.0}, contact, 1),
        ("Cull", {"select": BY_IDS, "ids": ["0", "1", "2"], **given}, want, 3),
        ("Cull", {"select": INLINE, "shapes": shapes(*[gs.Box([0.5] * 3)] * 3), "poses": D(SEEN_AT), **given}, want, 3),
        (
            "CullBatch",
            {
                "frustum": D(VIEW.packed()),
                "centers": D(SEEN.center),
                "axes": D(SEEN.axes),
                "half_extents": D(SEEN.half_extents),
            },
            want,
            3,
        ),
        (
            "DistanceBatch",
            {**batch, "kind_b": 105, "values_b": D([[1, 2, 3]])},
            lambda tier: gs.distance_to_frustum(VIEW, [[1.0, 2.0, 3.0]], accuracy=tier),
            1,
        ),
        (
            "DistanceBatch",
            {**batch, "kind_b": 103, "values_b": D(HULL_A.vertices), "offsets_b": [0, 3]},
            lambda tier: gs.distance(VIEW, hulls, accuracy=tier),
            1,
        ),
        ("FirstContactBatch", {**rings, "dimension": 2, **still(2), "t_max": 5.0}, contact, 1),
        (
            "FirstContactBatch",
            {**solid, "dimension": 3, **still(3)},
            lambda tier: gs.first_contact(hulls, hulls, (1, 0, 0), (0, 0, 0), t_max=2.0, accuracy=tier),
            1,
        ),
    ]


def still(dimension):
    return {"velocities_a": D([1.0, 0.0, 0.0][:dimension]), "velocities_b": D([0.0] * dimension)}


@pytest.mark.parametrize("tier", ACCURACIES)
def test_services_answer_at_every_tier_that_the_query_answers(desk, tier) -> None:
    for service, fields, ask, count in by_tier(desk):
        got = desk.ask(service, **fields, accuracy=tier)
        try:
            want = ask(tier)
        except gs.NotAvailableError as refusal:
            answered = str(refusal).partition("answers ")[2]
            assert got.status == NOT_AVAILABLE and is_empty(got), (service, got.message)
            assert f"accuracy='{tier}' is not available yet; this query answers {answered}" == got.message
            continue
        assert got.status in (OK, UNSUPPORTED) and got.cost.accuracy == tier, (service, got.message)
        if "Cull" in service:
            assert got.states.tolist() == want.state.tolist() and got.certain.tolist() == want.certain.tolist()
        elif "FirstContact" in service:
            assert got.item_status.tolist() == want.status.tolist()
            for name in ("time", "time_lower", "time_upper", "last_time"):
                assert np.array_equal(getattr(got, name), getattr(want, name), equal_nan=True), (service, name)
        else:
            assert len(got.distance) == count
            if tier == "bound" and service == "Distance":
                assert all(low == d <= want.distance[0] for low, d in zip(got.lower, got.distance, strict=True))
            else:
                assert got.distance.tolist() == want.distance.tolist() * count
            assert all(
                low <= want.lower[0] and want.upper[0] <= high for low, high in zip(got.lower, got.upper, strict=True)
            )
        if tier != "float64" and got.status == OK:
            assert set(got.cost.stages) & {"bound", "filter", "wide", "exact", "uncertain"}


@pytest.mark.parametrize("tier", TIERS)
def test_all_pairs_at_every_tier(desk, tier) -> None:
    for service, fields in (("Distance", {"max_distance": 8.0}), ("FirstContact", {"horizon": 5.0})):
        got = desk.ask(service, select=ALL, accuracy=tier, **fields)
        assert got.cost.accuracy == tier and ("left", "right") in set(zip(got.ids_a, got.ids_b, strict=True))
        if service == "Distance":
            near = desk.engine.scene.distances(8.0, accuracy=tier)
            assert len(got.ids_a) == len(near) + len(near.unsupported)
    near = desk.ask("Distance", select=BY_IDS, ids_a=["box", "left"], accuracy=tier)
    assert near.ids_b == ["ball", "right"]


def test_the_tier_of_the_configuration_is_the_default() -> None:
    for tier in TIERS:
        desk = Desk(accuracy=tier)
        assert desk.ask("Distance", select=ALL, max_distance=1.0).cost.accuracy == tier
        assert desk.ask("Distance", select=ALL, accuracy="float64").cost.accuracy == "float64"
        assert desk.ask("Cull", select=ALL).cost.accuracy == desk.ask("CullBatch", **EMPTY_VIEW).cost.accuracy == tier
        topics = desk.engine.evaluate(frozenset({"contacts", "distances", "visible"}))
        assert topics.contacts.pairs.cost.accuracy == topics.distances.cost.accuracy == tier
        assert topics.visible.cost.accuracy == tier


EMPTY_VIEW = {"frustum": D(VIEW.packed())}


def test_certificates_need_a_tier_that_leaves_something_to_prove(desk) -> None:
    for service, fields in (
        ("Distance", {"ids_a": ["ball"], "ids_b": ["box"]}),
        ("Distance", {"ids_a": ["ball"], "ids_b": ["left"]}),
        ("FirstContact", {"ids_a": ["ball"], "ids_b": ["box"]}),
        ("Cull", {"ids": ["ball"]}),
    ):
        got = desk.ask(service, select=BY_IDS, accuracy="bound", certificates=True, **fields)
        assert got.status == BAD_REQUEST and "certificates need accuracy float64 or exact" in got.message
        assert is_empty(got)
        got = desk.ask(service, select=BY_IDS, accuracy="exact", certificates=True, **fields)
        assert got.status in (OK, UNSUPPORTED) and len(claims(got)) == 1


@pytest.mark.parametrize(
    ("effect", "service", "fields"),
    [
        ("cull", "Cull", {"select": ALL}),
        ("cull", "CullBatch", {}),
        ("distance", "Distance", {"select": ALL}),
        ("witness", "Distance", {"select": ALL, "want": ["witness"]}),
        ("penetration", "Distance", {"select": ALL, "want": ["penetration"]}),
        ("witness", "DistanceBatch", {"want": ["witness"]}),
        ("first_contact", "FirstContact", {"select": ALL}),
        ("contact_set", "FirstContact", {"select": ALL, "want": ["contact_set"]}),
        ("first_contact", "FirstContactBatch", {}),
        ("first_contact", "FirstContactAlong", {}),
    ],
)
def test_effects_that_are_switched_off_are_named(effect, service, fields) -> None:
    got = Desk(**{f"effects__{effect}": False}).ask(service, **fields)
    assert got.status == NOT_AVAILABLE and f"effects.{effect}" in got.message and is_empty(got)


@pytest.mark.parametrize("service", QUERIES)
def test_inactive_nodes_say_so(desk, service) -> None:
    desk.active = False
    got = desk.ask(service)
    assert got.status == NOT_ACTIVE and got.message and is_empty(got)
    assert desk.ask("GetScene").status == OK, "the scene can be read and written"
    assert desk.ask("ApplyScene").status == OK


@pytest.mark.parametrize("service", [*QUERIES, "ApplyScene", "GetScene"])
def test_faults_of_ours_are_answered_and_logged(desk, service, monkeypatch) -> None:
    def broken(*_, **__):
        raise ZeroDivisionError("a bug")

    for name in ("_quality",):
        monkeypatch.setattr(Handlers, name, broken)
    monkeypatch.setattr(desk.engine, "apply", broken)
    monkeypatch.setattr(convert, "set_object", broken)
    got = desk.ask(service)
    assert got.status == INTERNAL_ERROR and "ZeroDivisionError: a bug" in got.message
    assert len(desk.logged) == 1 and "Traceback" in desk.logged[0]
    trigger = message("std_srvs/Trigger_Response")()
    assert not desk.handlers.clear(None, trigger).success and "a bug" in trigger.message


def test_half_filled_answers_are_thrown_away(desk, monkeypatch) -> None:
    def broken(*_):
        raise ZeroDivisionError("a bug at the end")

    monkeypatch.setattr(convert, "set_cost", broken)
    got = desk.ask("Distance", select=ALL)
    assert got.status == INTERNAL_ERROR and is_empty(got)


# ---------------------------------------------------------------------------------------------------- along a path

WAY = gs.Trajectory([0.0, 2.0, 3.0], [[-4, 0, 0, 0, 0, 0, 1], [0, 0, 0, 0, 0, 0, 1], [0, 0, 0, 0, 0, 0.6, 0.8]])


# What the formulas of these tests round, some ulps of a second, and far less than the interval asked for.
EXPECTED_ROUNDED = 1e-9
# By how much an interval that holds for all that bodies may be off by may begin too early.
LATE = 1e-4


def along(**fields):
    return {"times": D(WAY.times), "poses": D(WAY.poses), **fields}


def test_first_contact_along_a_path() -> None:
    """Boxes and hulls as `first_contact_along` has them, balls and capsules as wide as they are; no allowed pairs."""
    desk = Desk()
    bar = gs.Box([1.5, 0.1, 0.1])
    turn = np.array([0.1, 0.2, 0.3, 1.0]) / np.linalg.norm([0.1, 0.2, 0.3, 1.0])
    hull = gs.Convex(np.random.default_rng(1).normal(size=(9, 3)) * 0.2)
    things = {
        "box": gs.SceneObject("box", gs.Box([0.2, 0.3, 0.1]), (1.25, 0.6, 0, *turn)),
        "hull": gs.SceneObject("hull", hull, (-1.0, 1.5, 0, *turn), (0, -1, 0, 0, 0, 0)),
        "ball": obj("ball", gs.Sphere(0.25), (1.6, 0.15, 0)),
        "pill": obj("pill", gs.Capsule(0.2, 1.0), (1.0, 0.9, 0)),
        "away": obj("away", gs.Sphere(0.25), (0, 9, 0)),
        "fine": obj("fine", gs.Sphere(0.25), (-2, 0, 0)),
    }
    add = [gs.SceneObject("bar", bar), *things.values()]
    desk.engine.apply(gs.SceneUpdate(clear=True, add=add, allow=[("bar", "fine")]))
    got = desk.ask("FirstContactAlong", **along(id="bar"))
    assert got.status == OK and got.message == "" and sorted(got.ids) == ["ball", "box", "hull", "pill"]
    assert got.time.tolist() == sorted(got.time) and set(got.item_status) == {1}
    assert got.scene_version == desk.engine.scene.version and not got.stale and math.isnan(got.input_age)
    assert got.cost.accuracy == "float64" and 0 < got.cost.error_bound <= TIME_TOLERANCE
    spans = dict(zip(got.ids, zip(got.time_lower, got.time_upper, strict=True), strict=True))
    world = desk.engine.scene.world
    box = gs.Boxes.from_poses([world.poses[world.index["box"]]], [[0.2, 0.3, 0.1]])
    row = world.index["hull"]
    placed = gs.Polytopes(hull.vertices @ world.rotations[row].T + world.poses[row, :3], [0, 9])
    for name, want in (
        ("box", gs.first_contact_along(bar, WAY, box)),
        ("hull", gs.first_contact_along(bar, WAY, placed, velocities=(0, -1, 0))),
    ):
        assert spans[name][0] <= want.time_upper[0] and want.time_lower[0] <= spans[name][1], name
    # The end of the bar is at 2 t - 2.5, and its side at 0.1: a ball whose middle is 0.05 beside it.
    first = (1.6 - math.sqrt(0.25**2 - 0.05**2) + 2.5) / 2.0
    assert spans["ball"][0] <= first + EXPECTED_ROUNDED and first - EXPECTED_ROUNDED <= spans["ball"][1]
    k = list(got.ids).index("ball")
    point, normal = np.reshape(got.point, (-1, 3))[k], np.reshape(got.normal, (-1, 3))[k]
    np.testing.assert_allclose(point, [1.6 - math.sqrt(0.25**2 - 0.05**2), 0.1, 0.0], atol=1e-5)
    np.testing.assert_allclose(normal, (np.array([1.6, 0.15, 0]) - point) / 0.25, atol=1e-4)
    # Of a pill about z, the bar on the spot sees a disc: its upper side comes to it.
    angle = np.arctan2(0.9, 1.0) - np.arcsin((0.1 + 0.2) / np.hypot(1.0, 0.9))
    when = 2.0 + angle / (2.0 * np.arctan2(0.6, 0.8))
    assert spans["pill"][0] <= when + EXPECTED_ROUNDED and when - EXPECTED_ROUNDED <= spans["pill"][1]
    # Listed ones in the order of the request, allowed or not, and the same from an inline shape.
    listed = desk.ask("FirstContactAlong", **along(shape=shapes(bar), ids=["away", "fine", "ball"]))
    assert list(listed.ids) == ["away", "fine", "ball"] and listed.item_status.tolist() == [0, 1, 1]
    assert math.isnan(listed.time[0]) and listed.time[1] == pytest.approx((-2 - 0.25 + 2.5) / 2.0, abs=1e-5)
    assert listed.time[2] == spans["ball"][0]
    asked = 1e-9
    fine = desk.ask("FirstContactAlong", **along(id="bar", ids=["ball"], tolerance=asked))
    assert fine.time_upper[0] - fine.time_lower[0] <= asked


def test_first_contact_along_a_path_in_the_plane() -> None:
    desk = Desk()
    slow = gs.Trajectory([0.0, 4.0], [[0, 0, 0, 0, 0, 0, 1], [4, 0, 0, 0, 0, math.sqrt(0.5), math.sqrt(0.5)]])
    got = desk.ask("FirstContactAlong", id="left", times=D(slow.times), poses=D(slow.poses))
    ring = gs.Polygons.from_list([SQUARE.vertices + [3, 0.5]])
    want = gs.first_contact_along(SQUARE, gs.Trajectory([0.0, 4.0], [[0, 0, 0], [4, 0, np.pi / 2]]), ring)
    assert got.status == OK and list(got.ids) == ["right"] and got.item_status.tolist() == [1]
    assert got.time_lower[0] <= want.time_upper[0] and want.time_lower[0] <= got.time_upper[0]
    assert got.point[2] == 0.0 and got.normal[2] == 0.0
    assert desk.engine.totals.rows["~/first_contact_along", "float64"][1] == 1


def test_first_contact_along_a_path_of_what_is_uncertain() -> None:
    """0.1 m and 0.1 m/s nearer or farther, head on at 1 m/s; and one that is missed by less than that."""
    desk = Desk()
    cube = gs.Box([0.5, 0.5, 0.5])
    add = [
        obj("cube", cube, (5, 0, 0), uncertainty=0.05),
        obj("there", cube, (3, 0, 0), uncertainty=0.05, velocity_uncertainty=0.1),
        obj("beside", cube, (3, 1.08, 3), uncertainty=0.05),
    ]
    desk.engine.apply(gs.SceneUpdate(clear=True, add=add))
    # In one piece; or in three, where it may touch in the second, and surely does in the third.
    for z, ids, times in ((0, ["there"], [0, 4]), (0, ["there"], [0, 1.5, 1.95, 4]), (3, ["beside"], [0, 1, 4])):
        path = {"times": D(times), "poses": D([[t, 0, z, 0, 0, 0, 1] for t in times])}
        got = desk.ask("FirstContactAlong", id="cube", **path)
        assert got.status == OK and list(got.ids) == ids, z
        if z == 0:
            assert got.item_status[0] == 1 and got.time[0] == pytest.approx(2.0, abs=1e-6)
            assert got.time_lower[0] <= 1.9 / 1.1 <= got.time_lower[0] + LATE
            assert 2.1 / 0.9 <= got.time_upper[0] <= 2.1 / 0.9 + 0.1 * (2.1 / 0.9 - 1.9 / 1.1)
        else:
            assert got.item_status[0] == 0 and math.isnan(got.time[0]) and got.time_upper[0] == math.inf
            assert 1.9 <= got.time_lower[0] <= 2.0 and got.cost.error_bound == math.inf


@pytest.mark.parametrize("flat", [True, False], ids=["plane", "space"])
def test_first_contact_along_a_path_of_whatever_is_in_the_scene(flat) -> None:
    """A path with knots on a constant twist is that twist: bodies and objects of every kind, most of which turn."""
    rng, seen = np.random.default_rng(5), dict.fromkeys(range(7), 0)
    corners = rng.normal(size=(8, 3)) * 0.4
    solids = [
        gs.Box([0.3, 0.2, 0.4]),
        gs.Sphere(0.3),
        gs.Capsule(0.2, 0.5),
        gs.Convex(corners),
        gs.Cylinder(0.3, 0.4),
        gs.Cone(0.3, 0.6),
        gs.Ellipsoid([0.2, 0.3, 0.4]),
        gs.Mesh(corners, [[0, 1, 2], [3, 4, 5], [5, 6, 7], [2, 3, 7]]),
    ]
    bodies = [SQUARE] * 4 if flat else solids
    others = [SQUARE, gs.Polygon([[0, 0], [1, 0]])] * 8 if flat else [*solids, *solids, gs.HalfSpace([0, 0, 1], -3.0)]
    times = np.array([0.0, 0.3, 1.1, 2.0])
    free = [1, 1, 0, 0, 0, 1] if flat else [1] * 6
    for k, body in enumerate(bodies):
        twist = np.array([2.0, 0.3, 0.2, *rng.normal(size=3)]) * free
        add = [gs.SceneObject("body", body, (-2, 0, 0, 0, 0, 0, 1), twist)]
        for i, other in enumerate(others):
            pose = np.concatenate([rng.uniform([-2.2, -1, -1], [2, 1, 1]), rng.normal(size=4)])
            pose[3:] *= [0, 0, 1, 1] if flat else 1
            pose *= [1, 1, 0, 1, 1, 1, 1] if flat else 1
            pose[3:] /= np.linalg.norm(pose[3:])
            motion = rng.normal(size=6) * 0.5 * free * np.repeat([1, i % 3 > 0], 3)
            pose = IDENTITY if other.kind == "half_space" else pose
            add.append(gs.SceneObject(f"other{i:02}", other, pose, motion))
        desk, ids = Desk(), [item.id for item in add[1:]]
        desk.engine.apply(gs.SceneUpdate(clear=True, add=add))
        size = np.linalg.norm(twist[3:])
        half = 0.5 * times * size
        turns = np.column_stack([np.sin(half)[:, None] * twist[3:] / size, np.cos(half)])
        poses = np.column_stack([[-2, 0, 0] + times[:, None] * twist[:3], turns])
        got = desk.ask("FirstContactAlong", id="body", ids=ids, times=D(times), poses=D(poses))
        even = desk.ask("FirstContactAlong", **accelerated(poses[0], twist, duration=2.0, id="body", ids=ids))
        want = desk.ask("FirstContact", select=BY_IDS, ids_a=["body"], ids_b=ids, horizon=2.0)
        for answer in (got, even):
            assert answer.status == want.status == OK, (answer.message, want.message)
            for i, name in enumerate(ids):
                assert answer.item_status[i] == want.item_status[i], (k, name)
                seen[answer.item_status[i]] += 1
                if answer.item_status[i] == 1:
                    assert answer.time_lower[i] <= want.time_upper[i], (k, name)
                    assert want.time_lower[i] <= answer.time_upper[i], (k, name)
                    assert answer.time_upper[i] - answer.time_lower[i] <= TIME_TOLERANCE, (k, name)
    assert min(seen[0], seen[1], seen[3]) >= 5 and seen[4] == 0, seen


def test_first_contact_along_a_path_of_what_turns() -> None:
    """A ball that waits, by a path with knots, for a bar that turns: it comes to it by its side."""
    desk = Desk()
    bar = gs.SceneObject("bar", gs.Box([1.5, 0.1, 0.1]), twist=(0, 0, 0, 0, 0, 0.25))
    desk.engine.apply(gs.SceneUpdate(clear=True, add=[bar]))
    wait = {"times": D([0.0, 1.0, 2.0, 7.0]), "poses": D([[0, 0.8, 0, 0, 0, 0, 1]] * 4)}
    got = desk.ask("FirstContactAlong", shape=shapes(gs.Sphere(0.25)), **wait)
    when = (0.5 * math.pi - math.asin(0.35 / 0.8)) / 0.25
    assert got.status == OK and list(got.ids) == ["bar"] and got.item_status[0] == 1
    assert got.time_lower[0] - EXPECTED_ROUNDED <= when <= got.time_upper[0] + EXPECTED_ROUNDED
    off = Desk(effects__rotation=False)
    off.engine.apply(gs.SceneUpdate(clear=True, add=[bar, obj("wall", gs.Box([1, 1, 1]), (0, 0.8, 2))]))
    got = off.ask("FirstContactAlong", shape=shapes(gs.Sphere(0.25)), **wait, ids=["bar", "wall"])
    assert got.status == UNSUPPORTED and "switched off" in got.message and got.item_status.tolist() == [4, 0]


def test_first_contact_along_a_path_says_what_it_cannot() -> None:
    desk = Desk()
    add = [
        gs.SceneObject("lost", gs.Sphere(1.0), motion_fault="it jumps"),
        obj("floor", gs.HalfSpace([0, 0, 1], -5.0)),
    ]
    desk.engine.apply(gs.SceneUpdate(add=add))
    got = desk.ask("FirstContactAlong", **along(shape=shapes(gs.Sphere(0.5)), ids=["lost", "box", "left", "floor"]))
    assert got.status == UNSUPPORTED and got.item_status.tolist() == [4, 1, 4, 0] and math.isnan(got.time[0])
    assert "it jumps" in got.message and "along a path (polygon-sphere) is unsupported" in got.message
    got = desk.ask("FirstContactAlong", **along(id="floor", ids=["box"]))
    assert got.status == UNSUPPORTED and "box-half_space" in got.message
    nothing = Desk()
    nothing.engine.apply(gs.SceneUpdate(clear=True))
    got = nothing.ask("FirstContactAlong", **along(shape=shapes(gs.Sphere(0.5))))
    assert got.status == OK and len(got.ids) == len(got.time) == 0
    got = Desk(effects__rotation=False).ask("FirstContactAlong", **along(id="box"))
    assert got.status == NOT_AVAILABLE and "effects.rotation" in got.message


# --------------------------------------------------------------------------------------------- under acceleration

STILL = [0.0] * 6


def accelerated(pose, twist=STILL, acceleration=STILL, duration=4.0, **fields):
    """A request of a motion of second order; a pose of three numbers is a place."""
    pose = [*pose, 0, 0, 0, 1] if len(pose) == 3 else pose
    return {
        "times": D([0.0, duration]),
        "poses": D(pose),
        "twist": D(twist),
        "acceleration": D(acceleration),
        **fields,
    }


def test_acceleration_is_that_of_the_function() -> None:
    """Thrown and spinning, past boxes at rest and hulls that move."""
    desk = Desk()
    rng = np.random.default_rng(7)
    hull, found = gs.Convex(rng.normal(size=(9, 3)) * 0.3), []
    turn = np.array([0.1, 0.2, 0.3, 1.0]) / np.linalg.norm([0.1, 0.2, 0.3, 1.0])
    places, velocity = rng.uniform([-1, -1, -1], [3, 1, 3], (30, 3)), (0.1, -0.2, 0.0)
    add = [gs.SceneObject(f"box{i:02}", gs.Box([0.2, 0.3, 0.1]), (*places[i], *turn)) for i in range(15)]
    add += [gs.SceneObject(f"hull{i}", hull, (*places[i], *turn), (*velocity, 0, 0, 0)) for i in range(15, 30)]
    desk.engine.apply(gs.SceneUpdate(clear=True, add=add))
    world, body, axis = desk.engine.scene.world, gs.Box([0.5, 0.2, 0.1]), np.array([0.3, 0.2, 1.0])
    start, twist, gain = [-2, -1, 0, *turn], [2, 1, 3, *2 * axis], [0, 0, -3, *-0.5 * axis]
    got = desk.ask("FirstContactAlong", **accelerated(start, twist, gain, shape=shapes(body), ids=world.ids))
    assert got.status == OK, got.message
    motion = gs.AcceleratedMotion(
        start,
        twist[:3],
        acceleration=gain[:3],
        angular_velocity=twist[3:],
        angular_acceleration=gain[3:],
        duration=4.0,
    )
    for i, name in enumerate(world.ids):
        if name.startswith("box"):
            obstacle, drift = gs.Boxes.from_poses(world.poses[i], [[0.2, 0.3, 0.1]]), (0, 0, 0)
        else:
            obstacle, drift = gs.Polytopes(hull.vertices @ world.rotations[i].T + world.poses[i, :3], [0, 9]), velocity
        want = gs.first_contact_along(body, motion, obstacle, velocities=drift)
        assert got.item_status[i] == want.status[0], name
        if want.status[0] == 1:
            assert abs(got.time[i] - want.time[0]) <= TIME_TOLERANCE, name
            assert got.time_lower[i] <= want.time_upper[0] and want.time_lower[0] <= got.time_upper[i], name
        found.append(int(want.status[0]))
    assert min(found.count(0), found.count(1)) >= 5
    spared = dict(zip(got.cost.stages, got.cost.counts, strict=True))["boxes"]
    assert 0 < spared < 30  # some keep clear of all of its way


def test_acceleration_in_closed_form() -> None:
    """A ball that falls, one that is thrown, and a box that brakes."""
    desk = Desk()
    ball, cube = gs.Sphere(0.25), gs.Box([0.5, 0.5, 0.5])
    add = [
        obj("floor", gs.Box([50, 50, 1]), (0, 0, -1)),
        obj("top", gs.Box([0.1, 0.1, 0.1]), (4, 0, 30.3499)),
        obj("over", gs.Box([0.1, 0.1, 0.1]), (4, 1, 30.3501)),
        obj("near", cube, (-100, 0, 102.9999)),
        obj("far", cube, (-100, 5, 103.0001)),
    ]
    desk.engine.apply(gs.SceneUpdate(clear=True, add=add))
    gravity = [0, 0, -9.81, 0, 0, 0]
    got = desk.ask("FirstContactAlong", **accelerated((0, 0, 10), acceleration=gravity, shape=shapes(ball)))
    when = math.sqrt(2 * 9.75 / 9.81)
    assert got.status == OK and list(got.ids) == ["floor"] and got.item_status[0] == 1
    assert got.time_lower[0] - EXPECTED_ROUNDED <= when <= got.time_upper[0] + EXPECTED_ROUNDED
    assert list(got.normal) == pytest.approx([0, 0, -1]) and list(got.point) == pytest.approx([0, 0, 0], abs=1e-5)
    # Up by v^2 / (2 g) = 20 m in 2 s: there, beyond the boxes of both ends, something is 0.1 mm lower or higher.
    for y, name, status in ((0, "top", 1), (1, "over", 0)):
        up = accelerated((0, y, 10), (2, 0, 20, 0, 0, 0), (0, 0, -10, 0, 0, 0), shape=shapes(ball), ids=[name])
        got = desk.ask("FirstContactAlong", **up)
        assert got.item_status.tolist() == [status], name
        if status:
            when = 2.0 - math.sqrt(2 * 1e-4 / 10)
            assert got.time_lower[0] - EXPECTED_ROUNDED <= when <= got.time_upper[0] + EXPECTED_ROUNDED
    # 2 s and 2 m to stand still, beside one wall and before it.
    for y, name, status in ((0, "near", 1), (5, "far", 0)):
        brake = accelerated((-100, y, 100), (0, 0, 2, 0, 0, 0), (0, 0, -1, 0, 0, 0), shape=shapes(cube), ids=[name])
        got = desk.ask("FirstContactAlong", **brake)
        assert got.item_status.tolist() == [status], name
        if status:
            when = 2.0 - math.sqrt(2 * 1e-4)
            assert got.time_lower[0] - EXPECTED_ROUNDED <= when <= got.time_upper[0] + EXPECTED_ROUNDED


def test_acceleration_towards_whatever_is_in_the_scene() -> None:
    """A ball falls on a half space, that rises at 1 m/s, and on a mesh; and it starts off towards a can."""
    desk = Desk()
    ball = shapes(gs.Sphere(0.25))
    plate = gs.Mesh([[-9, -9, 0], [9, -9, 0], [9, 9, 0], [-9, 9, 0]], [[0, 1, 2], [0, 2, 3]])
    add = [
        gs.SceneObject("ground", gs.HalfSpace([0, 0, 1], 0.0), twist=(0, 0, 1, 0, 0, 0)),
        obj("plate", plate, (0, 0, 2)),
        obj("can", gs.Cylinder(1.0, 2.0), (5, 0, 20)),
    ]
    desk.engine.apply(gs.SceneUpdate(clear=True, add=add))
    fall = accelerated((0, 0, 10), acceleration=(0, 0, -9.81, 0, 0, 0), shape=ball, ids=["ground", "plate"])
    start = accelerated((0, 0, 20), acceleration=(1, 0, 0, 0, 0, 0), shape=ball, ids=["can"])
    got, can = desk.ask("FirstContactAlong", **fall), desk.ask("FirstContactAlong", **start)
    assert got.status == can.status == OK and {*got.item_status, *can.item_status} == {1}
    # 4.905 t^2 + t = 9.75
    ground = (math.sqrt(1 + 4 * 4.905 * 9.75) - 1) / (2 * 4.905)
    for answer, k, when in (
        (got, 0, ground),
        (got, 1, math.sqrt(2 * 7.75 / 9.81)),
        (can, 0, math.sqrt(2 * 3.75)),
    ):
        lower, upper = answer.time_lower[k], answer.time_upper[k]
        assert lower - EXPECTED_ROUNDED <= when <= upper + EXPECTED_ROUNDED, when
    assert list(can.normal) == pytest.approx([1, 0, 0], abs=1e-4)
    assert list(can.point) == pytest.approx([4, 0, 20], abs=1e-4)


def test_acceleration_in_the_plane() -> None:
    """A rod that spins up from rest, turned a quarter to begin with, is at a right angle to that at sqrt(pi / b)."""
    desk = Desk()
    post = gs.Polygon([(-0.9, 0.0), (-0.9, -0.1), (-0.8, 0.0)])
    desk.engine.apply(gs.SceneUpdate(clear=True, add=[obj("post", post), obj("box", gs.Box([1, 1, 1]))]))
    rod = shapes(gs.Polygon([(0, 0), (1, 0)]))
    quarter = (0, 0, 0, 0, 0, math.sqrt(0.5), math.sqrt(0.5))
    spin_up = accelerated(quarter, acceleration=(0, 0, 0, 0, 0, 2.0), shape=rod)
    got = desk.ask("FirstContactAlong", **spin_up)
    when = math.sqrt(math.pi / 2.0)
    assert got.status == OK and list(got.ids) == ["post"] and got.item_status[0] in (1, 6)
    assert got.time_lower[0] - EXPECTED_ROUNDED <= when <= got.time_upper[0] + EXPECTED_ROUNDED
    refused = Desk(effects__rotation=False)
    refused.engine.apply(gs.SceneUpdate(clear=True, add=[obj("post", post)]))
    got = refused.ask("FirstContactAlong", **spin_up)
    assert got.status == NOT_AVAILABLE and "effects.rotation" in got.message and is_empty(got)
    straight = accelerated((-3, 0, 0), acceleration=(2.0, 0, 0, 0, 0, 0), shape=rod)
    got = refused.ask("FirstContactAlong", **straight)
    assert got.status == OK and got.time[0] == pytest.approx(math.sqrt(1.1), abs=2e-6)


def test_acceleration_of_what_is_uncertain() -> None:
    """A cube that starts off 2 m before another, each 0.05 m off at most, at a t^2 / 2."""
    desk = Desk()
    cube = gs.Box([0.5, 0.5, 0.5])
    add = [obj("cube", cube, (9, 9, 9), uncertainty=0.05), obj("there", cube, (3, 0, 0), uncertainty=0.05)]
    desk.engine.apply(gs.SceneUpdate(clear=True, add=add))
    got = desk.ask("FirstContactAlong", **accelerated((0, 0, 0), acceleration=(1, 0, 0, 0, 0, 0), id="cube"))
    assert got.status == OK and list(got.ids) == ["there"] and got.time[0] == pytest.approx(2.0, abs=2e-6)
    assert got.time_lower[0] <= math.sqrt(2 * 1.9) <= got.time_lower[0] + LATE
    first, last = math.sqrt(2 * 1.9), math.sqrt(2 * 2.1)
    assert last - EXPECTED_ROUNDED <= got.time_upper[0] <= last + 0.2 * (last - first)


@pytest.mark.parametrize("off", [0.003, 0.05])
def test_intervals_along_a_way_hold_for_all_that_may_be(off) -> None:
    """A body on a path, and one that gathers speed, among boxes that fly and turn: shifted ones meet in time."""
    rng = np.random.default_rng(31)
    boxes = []
    for k in range(120):
        turn, twist = rng.normal(size=4), rng.normal(size=6) * [1, 1, 1, 0.5, 0.5, 0.5]
        pose = [*rng.uniform(-3, 3, 3), *turn / np.linalg.norm(turn)]
        boxes.append((f"o{k}", gs.Box(rng.uniform(0.1, 0.5, 3)), pose, twist))
    body = shapes(gs.Box([0.4, 0.3, 0.2]))
    times = np.linspace(0.0, 4.0, 9)
    poses = [[-3 + 1.5 * t, math.sin(t), 0, 0, 0, math.sin(t / 4), math.cos(t / 4)] for t in times]
    ways = [
        {"times": D(times), "poses": D(poses), "shape": body},
        accelerated((-3, 0, 0), twist=(1, 0.2, 0, 0, 0, 0.5), acceleration=(0.5, 0, 0.3, 0, 0, 0.2), shape=body),
    ]
    desk, hits, finite, compared = Desk(), 0, 0, 0
    for way in ways:
        desk.engine.apply(gs.SceneUpdate(clear=True, add=[gs.SceneObject(*box, uncertainty=off) for box in boxes]))
        got = desk.ask("FirstContactAlong", **way)
        spans = dict(zip(got.ids, zip(got.time_lower, got.time_upper, strict=True), strict=True))
        later = [k for k, status in enumerate(got.item_status) if status in (1, 6)]
        hits, finite = hits + len(later), finite + sum(got.time_upper[k] < math.inf for k in later)
        for _ in range(4):
            shifts = rng.normal(size=(len(boxes), 3))
            shifts *= off / np.linalg.norm(shifts, axis=1, keepdims=True)
            add = [
                gs.SceneObject(name, box, np.add(pose, [*shift, 0, 0, 0, 0]), twist)
                for (name, box, pose, twist), shift in zip(boxes, shifts, strict=True)
            ]
            desk.engine.apply(gs.SceneUpdate(clear=True, add=add))
            moved = desk.ask("FirstContactAlong", **way)
            assert spans.keys() - set(moved.ids) <= {name for name, span in spans.items() if span[1] == math.inf}
            for name, low, high in zip(moved.ids, moved.time_lower, moved.time_upper, strict=True):
                assert spans[name][0] <= high and low <= spans[name][1], name
                compared += spans[name][1] < math.inf
    assert hits > 10 and finite >= 0.7 * hits and compared >= 4 * finite, (hits, finite, compared)


ONE = [0, 0, 0, 0, 0, 0, 1]


@pytest.mark.parametrize(
    ("fields", "text"),
    [
        ({"twist": STILL}, "twist and acceleration must hold 6 numbers each, or none; acceleration has 0"),
        ({"acceleration": STILL}, "twist and acceleration must hold 6 numbers each, or none; twist has 0"),
        ({"twist": STILL[:5], "acceleration": STILL}, "twist has 5"),
        ({"twist": [0, 0, 0, math.nan, 0, 0], "acceleration": STILL}, "twist[3] is nan, must be finite"),
        ({"twist": STILL, "acceleration": [math.inf, 0, 0, 0, 0, 0]}, "acceleration[0] is inf, must be finite"),
        ({"times": [0, 1, 2]}, "times must be 0 and the duration, where a twist is given; got 3"),
        ({"times": []}, "times must be 0 and the duration, where a twist is given; got 0"),
        ({"times": [1, 2]}, "times[0] must be 0, where the motion begins: now; got 1"),
        ({"times": [0, 0]}, "times[1] must be > 0, the duration; got 0"),
        ({"times": [0, math.inf]}, "times[1] is inf, must be finite"),
        ({"poses": []}, "poses must be the one at the start, where a twist is given; got 0"),
        ({"poses": [*ONE, *ONE]}, "poses must be the one at the start, where a twist is given; got 2"),
        ({"poses": ONE[:6]}, "poses must hold 7 numbers per item, got 6 numbers"),
        ({"poses": [0, 0, 0, 0, 0, 0, 2]}, "poses[0] quaternion x y z w must have norm 1, got 2"),
        (
            {"twist": [0, 0, 0, 1, 0, 0], "acceleration": [0, 0, 0, 0, 1, 0]},
            "twist[3:], acceleration[3:]: angular_acceleration must be about the axis of angular_velocity",
        ),
        ({"flat": True, "twist": [0, 0, 0, 0, 1, 0]}, "twist[2:5] must be 0: a polygon stays in the plane z = 0"),
        ({"flat": True, "acceleration": [0, 0, -9.81, 0, 0, 0]}, "acceleration[2:5] must be 0: a polygon stays"),
        ({"flat": True, "poses": [0, 0, 1, 0, 0, 0, 1]}, "poses[0]: a polygon lies in the plane z = 0"),
        ({"flat": True, "poses": [0, 0, 0, 1, 0, 0, 0]}, "its pose must turn about z only"),
    ],
)
def test_faults_of_accelerations_are_named(fields, text) -> None:
    fields = dict(fields)
    body = SQUARE if fields.pop("flat", False) else gs.Sphere(0.5)
    alone = ("twist" in fields) != ("acceleration" in fields) and "must hold 6 numbers each" in text
    whole = {} if alone else {"twist": STILL, "acceleration": STILL}
    given = {"times": [0.0, 1.0], "poses": ONE, **whole, **fields}
    got = Desk().ask("FirstContactAlong", shape=shapes(body), **{name: D(value) for name, value in given.items()})
    assert got.status == BAD_REQUEST and text in got.message, got.message
    assert is_empty(got)


# ---------------------------------------------------------------------------------------------------- cross-check


def test_distances_are_handed_to_the_cross_check(monkeypatch) -> None:
    desk = Desk()
    taken = []
    monkeypatch.setattr(desk.engine.cross_check, "mode", "all")
    for name in ("submit_pairs", "submit_scene"):
        monkeypatch.setattr(desk.engine.cross_check, name, lambda *arguments: taken.append(arguments))
    desk.ask("Distance", select=BY_IDS, ids_a=["far", "ball"], ids_b=["ball", "sheet"])
    ((world, pairs, answer),) = taken
    assert [[world.ids[k] for k in pair] for pair in pairs] == [["far", "ball"], ["ball", "sheet"]]
    assert answer.status.tolist() == [0, 2] and len(answer.distance) == 2
    monkeypatch.setattr(desk.engine.cross_check, "submit_motion", lambda *given: moving.append(given))
    moving: list[tuple] = []
    desk.ask("FirstContact", select=BY_IDS, ids_a=["far", "ball"], ids_b=["ball", "sheet"], horizon=3.0)
    desk.ask("FirstContact", select=ALL, horizon=5.0)
    desk.ask("FirstContact", select=ALL, horizon=5.0, margin=0.5)
    (world, pairs, answer, horizon), (_, all_pairs, _, _) = moving
    assert [[world.ids[k] for k in pair] for pair in pairs] == [["far", "ball"], ["ball", "sheet"]]
    assert len(answer.status) == 2 and horizon == 3.0
    assert [[world.ids[k] for k in pair] for pair in all_pairs] == [["left", "right"]]
    desk.ask("Distance", select=ALL, max_distance=1.0)
    scene, near = taken[1]
    assert scene is desk.engine.scene and near.ids_a == ["ball"] and near.version == scene.version
