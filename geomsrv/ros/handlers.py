# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""Requests to responses.  No ROS: anything with the fields of a request or response will do.

A handler computes first and fills the response last, so that a refusal never leaves half an answer behind.
"""

from __future__ import annotations

import functools
import math
import time
import traceback
from collections import Counter
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from geomsrv import _validate, queries
from geomsrv.along_pairs import contacts_along, motion_of
from geomsrv.answers import ContactStatus, Cost, DistanceStatus, gather
from geomsrv.effects import OFF, ON
from geomsrv.engine import Engine
from geomsrv.errors import GeometryError, NotAvailableError, SceneError
from geomsrv.ladder import AUTO, Quality
from geomsrv.pairwise import Bodies, ListedContacts, distance_of_two, listed_distances, listed_first_contacts, world_of
from geomsrv.proofs import contact_certificates, cull_certificates, distance_certificates
from geomsrv.ros import convert
from geomsrv.scene import PairContacts, SceneUpdate
from geomsrv.shapes import Boxes, Frustum, Polygon, Polygons, Polytopes
from geomsrv.turning import TIME_TOLERANCE
from geomsrv.visibility import seen
from geomsrv.world import World

__all__ = ["Handlers"]

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

# The constants `status` of every service.
OK, BAD_REQUEST, UNSUPPORTED, NOT_AVAILABLE, NOT_ACTIVE, INTERNAL_ERROR = range(6)

BY_IDS, INLINE, ALL = range(3)  # the constants `select`
CAMERA, FRUSTUM = range(2)  # the constants `view` of Cull.srv
BOXES, POLYGONS, POLYTOPES, FRUSTUM_KIND, POINTS = range(101, 106)  # the first group of DistanceBatch.srv


class _NotActive(Exception):
    """The node is not in lifecycle state "active"."""


Method = Callable[["Handlers", Any, Any], Any]


def _answered(*, inactive: bool = False) -> Callable[[Callable[[Handlers, Any, Any], None]], Method]:
    """Make every request end in an answer with a status and a message; by default, only while the node is active."""

    def decorate(answer: Callable[[Handlers, Any, Any], None]) -> Method:
        @functools.wraps(answer)
        def respond(self: Handlers, request: Any, response: Any) -> Any:
            if not (inactive or self.active()):
                return _refusal(response, NOT_ACTIVE, "the node is not active")
            try:
                answer(self, request, response)
                return response
            except SceneError as fault:
                refusal = _refusal(response, BAD_REQUEST, str(fault))
                if hasattr(refusal, "faults"):
                    refusal.ids, refusal.faults = list(fault.errors), list(fault.errors.values())
                return refusal
            except NotAvailableError as fault:
                return _refusal(response, NOT_AVAILABLE, str(fault))
            except GeometryError as fault:
                return _refusal(response, BAD_REQUEST, str(fault))
            except Exception as error:  # a fault of ours: the caller hears of it, the log has where it was
                self.log(f"{answer.__name__}: {traceback.format_exc()}")
                return _refusal(response, INTERNAL_ERROR, f"{type(error).__name__}: {error}")

        return respond

    return decorate


def _refusal(response: Any, status: int, message: str) -> Any:
    """An empty response of the same type, whatever had been filled in."""
    refusal = type(response)()
    refusal.status, refusal.message = status, message
    return refusal


def _told(answer: Callable[[Handlers, Any], tuple[bool, str]]) -> Method:
    """A handler of std_srvs/Trigger or SetBool: success and message."""

    @functools.wraps(answer)
    def respond(self: Handlers, request: Any, response: Any) -> Any:
        try:
            response.success, response.message = answer(self, request)
        except Exception as error:
            self.log(f"{answer.__name__}: {traceback.format_exc()}")
            response.success, response.message = False, f"{type(error).__name__}: {error}"
        return response

    return respond


class Handlers:
    """Answers requests from an engine.

    Parameters
    ----------
    engine : Engine
    active : callable
        Whether queries are to be answered now.
    log : callable
        Takes the text of an error.
    object_type : callable
        geomsrv/SceneObject.
    """

    def __init__(
        self,
        engine: Engine,
        active: Callable[[], bool],
        log: Callable[[str], None],
        object_type: Callable[[], Any],
    ) -> None:
        self.engine = engine
        self.active = active
        self.log = log
        self.object_type = object_type

    # ------------------------------------------------------------------------------------------------------- scene

    def apply_scene(self, request: Any, response: Any) -> Any:
        """ApplyScene.srv."""
        response = self._apply_scene(request, response)
        response.version = self.engine.scene.version
        return response

    @_answered(inactive=True)
    def _apply_scene(self, request: Any, response: Any) -> None:
        self.engine.apply(convert.update_from(request.update), request.update.header.stamp)

    @_answered(inactive=True)
    def get_scene(self, request: Any, response: Any) -> None:
        """GetScene.srv."""
        scene = self.engine.scene
        ids = request.ids or scene.ids
        unknown = [name for name in ids if name not in scene]
        if unknown:
            raise SceneError({name: "no such object" for name in unknown})
        objects = []
        for name in ids:
            message = self.object_type()
            convert.set_object(message, scene[name])
            objects.append(message)
        response.scene.add = objects
        response.scene.header.frame_id = self.engine.config.fixed_frame
        pairs = sorted(scene.allowed_pairs)
        response.scene.allow_a, response.scene.allow_b = [a for a, _ in pairs], [b for _, b in pairs]
        response.version = scene.version

    @_told
    def clear(self, request: Any) -> tuple[bool, str]:
        """std_srvs/Trigger: remove every object."""
        self.engine.apply(SceneUpdate(clear=True))
        return True, ""

    @_told
    def self_check(self, request: Any) -> tuple[bool, str]:
        """std_srvs/Trigger: answer built-in hard cases."""
        # Loaded on use: it brings its cases along.
        from geomsrv.selfcheck import self_check

        report = self_check()
        return report.ok, report.message

    # ----------------------------------------------------------------------------------------------------- queries

    @_answered()
    def cull(self, request: Any, response: Any) -> None:
        """Cull.srv."""
        quality = self._quality(request)
        self._allowed("cull")
        frustum, scene = self._frustum(request), self.engine.scene
        if request.select == INLINE:
            _unused(request, "ids")
            start, counts = time.perf_counter_ns(), Counter[str]()
            world = world_of(_bodies(request.shapes, request.poses, ()))
            rows = np.arange(len(world))
            (state, certain, boxed), tier = seen(world, rows, frustum, Quality.of(**quality), counts)
            message = f"judged by their bounding box: {', '.join(boxed)}" if boxed else ""
            cost = Cost(time.perf_counter_ns() - start, tier, dict(counts))
        elif request.select in (BY_IDS, ALL):
            _unused(request, "shapes", "poses", *(("ids",) if request.select == ALL else ()))
            answer = scene.cull(frustum, ids=None if request.select == ALL else request.ids, **quality)
            state, certain, message, cost = answer.state, answer.certain, answer.message, answer.cost
            ids, world = answer.ids, scene.world
            if request.select == BY_IDS and ids != request.ids:
                row, ids = {name: i for i, name in enumerate(ids)}, request.ids
                order = np.array([row[name] for name in ids], dtype=np.intp)
                state, certain = state[order], certain[order]
            rows = np.array([world.index[name] for name in ids], dtype=np.int64)
            response.ids, response.scene_version = ids, answer.version
            self._set_age(response)
        else:
            raise GeometryError(f"select must be BY_IDS, INLINE or ALL, got {request.select}")
        if request.certificates:
            response.certificates = list(cull_certificates(world, rows, frustum, accuracy=_proof_tier(quality)))
        response.message = message
        response.states, response.certain = convert.bytes_(state), convert.bytes_(certain)
        convert.set_cost(response.cost, cost, 0.0 if certain.all() else math.inf)
        self.engine.totals.add("~/cull", cost, len(state))

    @_answered()
    def distance(self, request: Any, response: Any) -> None:
        """Distance.srv."""
        quality = self._quality(request)
        self._allowed("distance")
        want = self._want(request, "distance", "witness", "penetration")
        if request.select == ALL:
            _unused(request, *_BY_IDS, *_INLINE)
            _listed_only(request)
            self._all_distances(request, response, want, quality)
            return
        if (
            request.select == INLINE
            and len(request.shapes_a) == 1 == len(request.shapes_b)
            and not request.certificates
        ):
            _unused(request, *_BY_IDS)
            if self._distance_of_two(request, response, want, quality):
                return
        if request.select == BY_IDS and request.ids_a and not request.ids_b:
            _unused(request, *_INLINE)
            world, pairs, lonely = self._nearest(request.ids_a, quality["accuracy"])
        else:
            (world, pairs), lonely = self._listed(request), ""
        answer = listed_distances(world, pairs, want=want, **quality)
        self.engine.check(world, pairs, answer)
        if request.certificates:
            tier = _proof_tier(quality)
            response.certificates = list(distance_certificates(world, pairs, want=want, accuracy=tier))
        if request.select == BY_IDS:
            _set_ids(response, world, pairs)
            self._set_age(response)
        self._set_distances(response, "~/distance", answer, want)
        _set_unsupported(response, answer.status == DistanceStatus.UNSUPPORTED, answer.message, lonely)

    def _distance_of_two(self, request: Any, response: Any, want: tuple[str, ...], quality: dict[str, Any]) -> bool:
        """Two bodies, if there is nothing more to say about them than their distance."""
        if quality["tolerance"] is not None or quality["time_budget"] is not None:
            return False
        accuracy = "float64" if quality["accuracy"] == AUTO else quality["accuracy"]
        flat = request.poses_a + request.poses_b
        if len(flat) != 14 or len(request.poses_a) != 7 or self.engine.cross_check.mode != "off":
            return False
        try:
            a, b = convert.shape_from(request.shapes_a[0]), convert.shape_from(request.shapes_b[0])
            poses = _validate.poses(convert.floats(flat).reshape(2, 7))
        except GeometryError:
            return False  # for the long way to name the field
        answer = distance_of_two(a, b, poses, penetration="penetration" in want, accuracy=accuracy)
        if answer is None or (quality["accuracy"] == AUTO and answer.status[0] != DistanceStatus.OK):
            return False
        self._set_distances(response, "~/distance", answer, want)
        return True

    def _nearest(self, ids: Sequence[str], accuracy: str) -> tuple[World, IntArray, str]:
        """Every id with the object nearest to it, and words about those that have none."""
        scene, pairs, lonely = self.engine.scene, [], []
        world = scene.world
        for name in ids:
            answer = scene.nearest_pair(ids=[name], accuracy=accuracy)
            if len(answer):
                other = answer.ids_b[0] if answer.ids_a[0] == name else answer.ids_a[0]
                pairs.append((world.index[name], world.index[other]))
            else:
                lonely.append(f"{name!r} has no object to be compared with")
        return world, _pairs_array(pairs), "; ".join(lonely)

    def _all_distances(self, request: Any, response: Any, want: tuple[str, ...], quality: dict[str, Any]) -> None:
        """Every pair within max_distance, nearest first, then those that are unsupported."""
        engine = self.engine
        near = engine.scene.distances(request.max_distance, want=want, **quality)
        if engine.cross_check.mode != "off":
            engine.cross_check.submit_scene(engine.scene, near)
        order, missing = np.argsort(near.distance, kind="stable"), near.unsupported
        ids_a, ids_b, rows = near.ids_a, near.ids_b, order.tolist()
        response.ids_a = [ids_a[i] for i in rows] + [a for a, _, _ in missing]
        response.ids_b = [ids_b[i] for i in rows] + [b for _, b, _ in missing]
        response.scene_version = near.version
        self._set_age(response)
        response.item_status = convert.bytes_(_extended(near.status[order], len(missing), DistanceStatus.UNSUPPORTED))
        for name in _distance_columns(want):
            column = _extended(getattr(near, name)[order], len(missing), np.nan)
            setattr(response, name, convert.doubles(column))
        self._set_cost(response, "~/distance", near, len(near))
        response.status, response.message = UNSUPPORTED if missing else OK, near.message

    @_answered()
    def first_contact(self, request: Any, response: Any) -> None:
        """FirstContact.srv."""
        quality = self._quality(request)
        self._allowed("first_contact")
        want = self._want(request, "first_contact", "contact_set")
        contact_set, rotation = "contact_set" in want, self.engine.config.effects_rotation != OFF
        answer: PairContacts | ListedContacts
        order: IntArray | None
        if request.select == ALL:
            _unused(request, *_BY_IDS, *_INLINE, "twists_a", "twists_b")
            _listed_only(request)
            answer = self.engine.scene.first_contacts(
                request.horizon,
                margin=request.margin,
                earliest=request.earliest,
                contact_set=contact_set,
                rotation=rotation,
                **quality,
            )
            if request.margin == 0.0:
                self.engine.check_scene_motion(answer, request.horizon)
            order = np.argsort(answer.time, kind="stable")
            response.ids_a = [answer.ids_a[i] for i in order.tolist()]
            response.ids_b = [answer.ids_b[i] for i in order.tolist()]
            response.scene_version = answer.version
            self._set_age(response)
        else:
            world, pairs = self._listed(request, moving=True)
            if request.earliest:
                raise GeometryError("earliest must be false here: it is for ALL_PAIRS")
            if request.certificates and request.margin != 0.0:
                raise NotAvailableError("certificates are given for contact, not for coming as near as a margin")
            answer = listed_first_contacts(
                world,
                pairs,
                request.horizon,
                margin=request.margin,
                contact_set=contact_set,
                rotation=rotation,
                **quality,
            )
            if request.margin == 0.0:
                self.engine.check_motion(world, pairs, answer, request.horizon)
            order = None  # that of the request
            if request.certificates:
                lines = contact_certificates(world, pairs, request.horizon, accuracy=_proof_tier(quality))
                response.certificates = list(lines)
            if request.select == BY_IDS:
                _set_ids(response, world, pairs)
                self._set_age(response)
        self._set_first_contacts(response, "~/first_contact", answer, order, want)
        if contact_set:
            ends = answer.part_offsets
            if order is not None:
                sizes, _ = gather(np.diff(ends), np.searchsorted(ends, answer.point_offsets), order)
                ends = np.cumsum([0, *sizes.tolist()])
            response.part_offsets = convert.uint32s(ends)
        _set_unsupported(response, answer.status == ContactStatus.UNSUPPORTED, note=answer.message)

    @_answered()
    def cull_batch(self, request: Any, response: Any) -> None:
        """CullBatch.srv."""
        quality = self._quality(request)
        self._allowed("cull")
        frustum = convert.frustum_of(request.frustum)
        boxes = Boxes(
            convert.rows(request.centers, "centers", 3),
            convert.rows(request.axes, "axes", 9).reshape(-1, 3, 3),
            convert.rows(request.half_extents, "half_extents", 3),
        )
        answer = queries.cull(frustum, boxes, certificates=request.certificates, **quality)
        response.states, response.certain = convert.bytes_(answer.state), convert.bytes_(answer.certain)
        _set_certificates(response, answer)
        self._set_cost(response, "~/cull_batch", answer, len(answer.state))

    @_answered()
    def distance_batch(self, request: Any, response: Any) -> None:
        """DistanceBatch.srv."""
        quality = self._quality(request)
        self._allowed("distance")
        want = self._want(request, "distance", "witness", "penetration")
        sides = [
            _side(getattr(request, f"kind_{s}"), getattr(request, f"values_{s}"), getattr(request, f"offsets_{s}"), s)
            for s in "ab"
        ]
        a, b = sides
        options: dict[str, Any] = {"want": want, "certificates": request.certificates, **quality}
        if isinstance(b, np.ndarray):
            if not isinstance(a, Frustum):
                raise GeometryError("kind_b POINTS needs kind_a FRUSTUM")
            _unused(request, "poses_ab")
            answer = queries.distance_to_frustum(a, b, **options)
        elif min(request.kind_a, request.kind_b) >= BOXES:
            _unused(request, "poses_ab")
            answer = queries.distance(a, b, **options)
        elif max(request.kind_a, request.kind_b) < BOXES:
            poses = convert.rows(request.poses_ab, "poses_ab", 7)
            answer = queries.distance(a, b, poses, **options)
        else:
            raise GeometryError("kind_a and kind_b must both be batches, or both be shapes of Shape.msg")
        self._set_distances(response, "~/distance_batch", answer, want)
        _set_certificates(response, answer)
        if answer.region is not None:
            response.region = convert.bytes_(answer.region)
        _set_unsupported(response, answer.status == DistanceStatus.UNSUPPORTED, answer.message)

    @_answered()
    def first_contact_batch(self, request: Any, response: Any) -> None:
        """FirstContactBatch.srv."""
        quality = self._quality(request)
        self._allowed("first_contact")
        want = self._want(request, "contact_set")
        dimension = request.dimension
        if dimension not in (2, 3):
            raise GeometryError(f"dimension must be 2 or 3, got {dimension}")
        batch = Polygons if dimension == 2 else Polytopes
        a, b = (
            batch(
                convert.rows(getattr(request, f"vertices_{s}"), f"vertices_{s}", dimension),
                np.asarray(getattr(request, f"offsets_{s}"), dtype=np.int64),
            )
            for s in "ab"
        )
        velocities = (
            convert.rows(getattr(request, name), name, dimension) for name in ("velocities_a", "velocities_b")
        )
        answer = queries.first_contact(
            a,
            b,
            *velocities,
            t_max=request.t_max,
            contact_set="contact_set" in want,
            certificates=request.certificates,
            **quality,
        )
        self._set_first_contacts(response, "~/first_contact_batch", answer, None, want)
        _set_certificates(response, answer)
        _set_unsupported(response, answer.status == ContactStatus.UNSUPPORTED, answer.message)

    @_answered()
    def first_contact_along(self, request: Any, response: Any) -> None:
        """FirstContactAlong.srv."""
        self._allowed("first_contact")
        world = self.engine.scene.world
        body, off, row = self._body(request, world)
        flat = isinstance(body, Polygon)
        rates = (convert.floats(request.twist), convert.floats(request.acceleration))
        path = motion_of(convert.floats(request.times), convert.rows(request.poses, "poses", 7), *rates, flat)
        if path.turns:
            self._allowed("rotation")
        if request.ids:
            rows = np.array(_rows_of(world, request.ids, "ids"), dtype=np.int64)
            if len(same := np.flatnonzero(rows == row)):
                raise GeometryError(f"ids[{same[0]}] is {request.id!r}, the body itself")
        else:
            rows = _others_of(world, row, flat)
        rotation = self.engine.config.effects_rotation != OFF
        answer = contacts_along(world, body, off, path, rows, request.tolerance or TIME_TOLERANCE, rotation)
        order: IntArray = np.arange(len(rows))
        if not request.ids:
            # What may meet is listed, too, and what is unsupported comes last.
            met = np.flatnonzero((answer.status != ContactStatus.NEVER) | ~np.isnan(answer.time_lower))
            order = met[np.argsort(answer.time[met], kind="stable")]
        response.ids = [world.ids[i] for i in rows[order].tolist()]
        response.scene_version = world.version
        self._set_age(response)
        response.item_status = convert.bytes_(answer.status[order])
        for name in ("time", "time_lower", "time_upper", "normal", "point"):
            setattr(response, name, convert.doubles(getattr(answer, name)[order]))
        self._set_cost(response, "~/first_contact_along", answer, len(rows))
        _set_unsupported(response, answer.status == ContactStatus.UNSUPPORTED, answer.message)

    # ---------------------------------------------------------------------------------------------------- requests

    def _body(self, request: Any, world: World) -> tuple[Any, float, int]:
        """What follows a path: its shape, how far it may be off, and its row in the world, -1 if it is none of it."""
        if request.id:
            _unused(request, "shape")
            if request.id not in world.index:
                raise GeometryError(f"id is {request.id!r}: no such object")
            row = world.index[request.id]
            return world.table.shapes[world.shape[row]], float(world.uncertainty[row]), row
        if len(request.shape) != 1:
            raise GeometryError(f"shape must be one, where id is empty; got {len(request.shape)}")
        try:
            return convert.shape_from(request.shape[0]), 0.0, -1
        except GeometryError as fault:
            raise GeometryError(f"shape[0]: {fault}") from None

    def _quality(self, request: Any) -> dict[str, Any]:
        """How good the answer is asked to be, as queries take it; the tier by default that of the configuration."""
        quality = {
            "accuracy": request.accuracy or self.engine.config.accuracy,
            "tolerance": request.tolerance or None,
            "time_budget": request.time_budget or None,
        }
        Quality.of(**quality)
        return quality

    def _allowed(self, *effects: str) -> None:
        """Refuse what the configuration has switched off."""
        for effect in effects:
            if self.engine.config.modes.get(effect) == OFF:
                raise NotAvailableError(f"{effect} is switched off by the parameter effects.{effect}")

    def _want(self, request: Any, *known: str) -> tuple[str, ...]:
        effects = tuple(_validate.want(request.want, known))
        self._allowed(*effects)
        modes = self.engine.config.modes
        return effects + tuple(effect for effect in known if modes.get(effect) == ON and effect not in effects)

    def _frustum(self, request: Any) -> Frustum:
        if request.view == FRUSTUM:
            return convert.frustum_from(request.frustum)
        if request.view != CAMERA:
            raise GeometryError(f"view must be CAMERA or FRUSTUM, got {request.view}")
        if self.engine.camera is None:
            raise NotAvailableError("no ~/camera_info has come yet")
        return self.engine.camera

    def _listed(self, request: Any, *, moving: bool = False) -> tuple[World, IntArray]:
        """Objects and pairs that a request lists, by id or inline."""
        inline = (*_INLINE, *(("twists_a", "twists_b") if moving else ()))
        if request.select == BY_IDS:
            _unused(request, *inline)
            world = self.engine.scene.world
            a, b = (_rows_of(world, getattr(request, name), name) for name in _BY_IDS)
            names = _BY_IDS
        elif request.select == INLINE:
            _unused(request, *_BY_IDS)
            sides = [
                _bodies(
                    getattr(request, f"shapes_{s}"),
                    getattr(request, f"poses_{s}"),
                    getattr(request, f"twists_{s}") if moving else (),
                    f"_{s}",
                )
                for s in "ab"
            ]
            world = world_of(*sides)
            count = len(sides[0].shapes)
            a, b = range(count), range(count, len(world))
            names = ("shapes_a", "shapes_b")
        else:
            raise GeometryError(f"select must be BY_IDS, INLINE or ALL_PAIRS, got {request.select}")
        if len(a) != len(b) and 1 not in (len(a), len(b)):
            raise GeometryError(
                f"{names[0]} and {names[1]} have {len(a)} and {len(b)} items; they must be as many, or one"
            )
        if len(a) == 1 == len(b):
            return world, np.array([(a[0], b[0])])
        pairs = np.empty((max(len(a), len(b)) if len(a) and len(b) else 0, 2), dtype=np.int64)
        pairs[:, 0], pairs[:, 1] = a, b
        return world, pairs

    # --------------------------------------------------------------------------------------------------- responses

    def _set_age(self, response: Any) -> None:
        """How old the scene's states are."""
        response.stale, response.input_age = self.engine.stale, self.engine.input_age

    def _set_cost(self, response: Any, query: str, answer: Any, items: int) -> None:
        """What the answer cost, also among the totals."""
        convert.set_cost(response.cost, answer.cost, answer.error_bound)
        self.engine.totals.add(query, answer.cost, items)

    def _set_distances(self, response: Any, query: str, answer: Any, want: tuple[str, ...]) -> None:
        response.item_status = convert.bytes_(answer.status)
        for name in _distance_columns(want):
            setattr(response, name, convert.doubles(getattr(answer, name)))
        self._set_cost(response, query, answer, len(answer.status))

    def _set_first_contacts(
        self, response: Any, query: str, answer: Any, order: IntArray | None, want: tuple[str, ...]
    ) -> None:
        """The answer's rows in the given order, or as they are."""
        rows: Any = slice(None) if order is None else order
        response.item_status = convert.bytes_(answer.status[rows])
        for name in _CONTACT_COLUMNS:
            setattr(response, name, convert.doubles(getattr(answer, name)[rows]))
        if "contact_set" in want:
            points, offsets = answer.points, answer.point_offsets
            if order is not None:
                points, offsets = gather(points, offsets, order)
            response.points, response.point_offsets = convert.doubles(points), convert.uint32s(offsets)
        self._set_cost(response, query, answer, len(answer.status))


_AT_REST = np.zeros((0, 6))
_BY_IDS = ("ids_a", "ids_b")
_INLINE = ("shapes_a", "poses_a", "shapes_b", "poses_b")


def _proof_tier(quality: dict[str, Any]) -> str:
    """Tier of certificates: where it is chosen item by item, the one that proves most."""
    tier: str = quality["accuracy"]
    return "exact" if Quality.of(**quality).climbs else tier


def _unused(request: Any, *names: str) -> None:
    """Refuse fields that the request's choice does not use: whoever fills them expects them to count."""
    for name in names:
        if len(getattr(request, name)):
            raise GeometryError(f"{name} must be empty here")


def _listed_only(request: Any) -> None:
    if request.certificates:
        raise NotAvailableError("certificates are given for listed pairs, not for all")


def _rows_of(world: World, ids: Sequence[str], name: str) -> Sequence[int]:
    try:
        return [world.index[item] for item in ids]
    except KeyError:
        unknown = [f"{name}[{i}] is {item!r}" for i, item in enumerate(ids) if item not in world.index]
        raise GeometryError(f"{', '.join(unknown)}: no such object") from None


def _others_of(world: World, row: int, flat: bool) -> IntArray:
    """Objects of the same family, but for the one in a row and what it is allowed to touch."""
    others = np.flatnonzero(world.planar == flat)
    if row >= 0:
        others = others[others != row]
        keys = np.minimum(others, row) * len(world) + np.maximum(others, row)
        others = others[~np.isin(keys, world.allowed)]
    return others


def _bodies(shapes: Sequence[Any], poses: Any, twists: Any, suffix: str = "") -> Bodies:
    """Shapes, poses and twists of an inline list."""
    bodies = []
    for i, item in enumerate(shapes):
        try:
            bodies.append(convert.shape_from(item))
        except GeometryError as fault:
            raise GeometryError(f"shapes{suffix}[{i}]: {fault}") from None
    placed = convert.rows(poses, f"poses{suffix}", 7)
    moving = convert.rows(twists, f"twists{suffix}", 6) if len(twists) else _AT_REST
    if len(placed) != len(bodies):
        raise GeometryError(f"shapes{suffix} are {len(bodies)}, poses{suffix} are of {len(placed)}")
    if len(moving) not in (0, len(bodies)):
        raise GeometryError(f"shapes{suffix} are {len(bodies)}, twists{suffix} are of {len(moving)}")
    return Bodies(bodies, placed, moving, suffix)


def _side(kind: int, values: Any, offsets: Any, side: str) -> Any:
    """One of the two operands of DistanceBatch.srv; an array for points."""
    name = f"values_{side}"
    if kind not in (POLYGONS, POLYTOPES) and len(offsets):
        raise GeometryError(f"offsets_{side} must be empty here")
    if kind < BOXES:
        codec = convert.shape_codec(kind)
        return convert.shape_of(kind, values if codec.dimensions else (), values if codec.width else ())
    if kind == BOXES:
        rows = convert.rows(values, name, 15)
        return Boxes(rows[:, :3], rows[:, 3:12].reshape(-1, 3, 3), rows[:, 12:])
    if kind == POLYGONS:
        return Polygons(convert.rows(values, name, 2), np.asarray(offsets, dtype=np.int64))
    if kind == POLYTOPES:
        return Polytopes(convert.rows(values, name, 3), np.asarray(offsets, dtype=np.int64))
    if kind == FRUSTUM_KIND:
        return convert.frustum_of(values, name)
    if kind == POINTS and side == "b":
        return convert.rows(values, name, 3)
    raise GeometryError(
        f"kind_{side} {kind} is not one of the constants of DistanceBatch.srv and Shape.msg that fit here"
    )


# ---------------------------------------------------------------------------------------------------- responses

_DISTANCE_COLUMNS = ("distance", "lower", "upper", "point_a", "point_b", "normal")
_CONTACT_COLUMNS = ("time", "time_lower", "time_upper", "last_time", "normal", "closing_speed")


def _distance_columns(want: tuple[str, ...]) -> tuple[str, ...]:
    return _DISTANCE_COLUMNS if "witness" in want else _DISTANCE_COLUMNS[:3]


def _pairs_array(pairs: Sequence[tuple[int, int]]) -> IntArray:
    return np.array(pairs, dtype=np.int64).reshape(-1, 2)


def _extended(column: NDArray[Any], count: int, value: float) -> NDArray[Any]:
    """`column` with `count` more rows of `value`."""
    if count == 0:
        return column
    return np.concatenate([column, np.full((count, *column.shape[1:]), value, column.dtype)])


def _set_ids(response: Any, world: World, pairs: IntArray) -> None:
    response.ids_a = [world.ids[i] for i in pairs[:, 0].tolist()]
    response.ids_b = [world.ids[i] for i in pairs[:, 1].tolist()]
    response.scene_version = world.version


def _set_certificates(response: Any, answer: Any) -> None:
    if answer.certificates is not None:
        response.certificates = list(answer.certificates.lines())


def _set_unsupported(response: Any, items: NDArray[np.bool_], *reasons: str, note: str = "") -> None:
    """Status and message: reasons make the answer UNSUPPORTED, and so do items without one; a note does not."""
    text = "; ".join(filter(None, (*reasons, note)))
    if any(reasons) or items.any():
        response.status, response.message = UNSUPPORTED, text or "no kernel for some of the items"
    else:
        response.message = text
