# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""The ROS 2 node: topics, services, parameters, timers, lifecycle.  All content is elsewhere.

A callback converts, calls and converts back; what it calls is in `handlers` (services), `inputs` (topics), `reports`
(state and diagnostics) and `markers`.  This is the only module that imports rclpy and the generated messages.
"""

from __future__ import annotations

import functools
import gc
import importlib.util
import math
import signal
import sys
import threading
import time
import traceback
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Any, NamedTuple

import rclpy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from geometry_msgs.msg import Point, PolygonInstanceStamped
from numpy.typing import ArrayLike
from rcl_interfaces.msg import FloatingPointRange, ParameterDescriptor, SetParametersResult
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup
from rclpy.clock import Clock, ClockType
from rclpy.event_handler import PublisherEventCallbacks, SubscriptionEventCallbacks
from rclpy.exceptions import ParameterException
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.lifecycle import LifecycleNode, LifecycleState, TransitionCallbackReturn
from rclpy.parameter import Parameter
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy, qos_profile_sensor_data
from rclpy.signals import SignalHandlerOptions
from sensor_msgs.msg import CameraInfo
from std_msgs.msg import Header
from std_srvs.srv import SetBool, Trigger
from visualization_msgs.msg import Marker, MarkerArray

import geomsrv.msg as msg
import geomsrv.srv as srv
from geomsrv.config import Config, Setting, settings
from geomsrv.effects import CONTACTS, DISTANCES, MARKERS, OFF, ON, VISIBLE
from geomsrv.engine import Engine
from geomsrv.errors import GeometryError
from geomsrv.ros import convert, reports
from geomsrv.ros.handlers import Handlers
from geomsrv.ros.inputs import Inputs
from geomsrv.ros.markers import Markers

__all__ = ["DIAGNOSTICS", "INPUTS", "OUTPUTS", "SERVICES", "STATE", "GeomsrvNode", "main"]


class Topic(NamedTuple):
    """Name, type and quality of service of a topic."""

    name: str
    type: type
    qos: QoSProfile


def _reliable(depth: int) -> QoSProfile:
    return QoSProfile(depth=depth, reliability=ReliabilityPolicy.RELIABLE)


def _latched(depth: int) -> QoSProfile:
    return QoSProfile(depth=depth, reliability=ReliabilityPolicy.RELIABLE, durability=DurabilityPolicy.TRANSIENT_LOCAL)


STATES = "states"
NAP_SHARE = 0.8  # of the time after which states are stale, for which they are not looked at
QUIET = 20  # messages of ~/states in a row that say the same before they are looked at now and then only
INPUTS = (
    Topic("shapes", msg.SceneUpdate, _latched(100)),
    Topic(STATES, msg.ShapeStates, QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)),
    Topic("polygons", PolygonInstanceStamped, _reliable(10)),
    Topic("camera_info", CameraInfo, qos_profile_sensor_data),
)
OUTPUTS = (
    Topic(CONTACTS, msg.ContactArray, _reliable(10)),
    Topic(DISTANCES, msg.DistanceArray, _reliable(10)),
    Topic(VISIBLE, msg.VisibleArray, _reliable(10)),
    Topic(MARKERS, MarkerArray, _latched(1)),
)
STATE = Topic("state", msg.EngineState, _latched(1))
DIAGNOSTICS = Topic("/diagnostics", DiagnosticArray, _reliable(10))
SERVICES = {
    "cull": srv.Cull,
    "distance": srv.Distance,
    "first_contact": srv.FirstContact,
    "cull_batch": srv.CullBatch,
    "distance_batch": srv.DistanceBatch,
    "first_contact_batch": srv.FirstContactBatch,
    "first_contact_along": srv.FirstContactAlong,
    "apply_scene": srv.ApplyScene,
    "get_scene": srv.GetScene,
    "clear": Trigger,
    "self_check": Trigger,
    "set_enabled": SetBool,
}

REPORT_PERIOD = 1.0  # [s], of ~/state and /diagnostics

# An endpoint is discovered before the name of its node.  It is looked at again until the name is known or this many
# periods have passed; together they stay below the second within which a mismatch is to be reported.
RECHECK_PERIOD = 0.1  # [s]
MAX_RECHECKS = 8

# Drawing takes at most this share of the node's time, evaluating at most that one; the rest is for inputs and services.
MARKER_SHARE = 0.1
EVALUATION_SHARE = 0.3

LOG_FAILURE_AFTER = 5.0  # [s]


class _Dozing(MutuallyExclusiveCallbackGroup):
    """The group of the ~/states subscription, whose messages wake nobody up while it is asleep.

    Being woken costs an executor of rclpy some milliseconds, whatever the message: a stream of 100 Hz costs a third of
    a core though it says the same again and again, and nobody wants to know.  The newest message stays where it is.
    """

    asleep = False

    def can_execute(self, entity: Any) -> bool:
        """Whether the executor is to wait for it: the subscription, or its events, which its messages set off, too."""
        ready: bool = super().can_execute(entity)
        return ready and not self.asleep


def _guarded(callback: Callable[..., None]) -> Callable[..., None]:
    """Log what a callback raises; an exception that left it would end the executor."""

    @functools.wraps(callback)
    def call(self: GeomsrvNode, *arguments: Any) -> None:
        try:
            callback(self, *arguments)
        except Exception:
            self.log_failure(callback.__name__)

    return call


class GeomsrvNode(LifecycleNode):
    """Hosts an engine behind topics and services.

    Inactive, it applies inputs and answers scene services, so that it starts with a full picture; active, it
    evaluates, publishes and answers queries as well.
    """

    def __init__(self, **arguments: Any) -> None:
        super().__init__("geomsrv", **arguments)
        self._steady = Clock(clock_type=ClockType.STEADY_TIME)
        self._config = self._declare_parameters()
        self.add_on_set_parameters_callback(self._validate_parameters)
        self.add_post_set_parameters_callback(self._apply_parameters)
        self._engine: Engine | None = None
        self._active = False
        self._enabled = True
        self._failures: dict[str, float] = {}
        # rclpy lets the exception of a transition that does not exist leave the executor.
        change = self._service_change_state
        change.callback = functools.partial(self._change_state, change.callback)
        if self._config.autostart:
            self.trigger_configure()
            self.trigger_activate()

    def log_failure(self, where: str) -> None:
        """Log the exception being handled, in full; again after a while only, since what fails tends to fail on."""
        now = time.monotonic()
        if now - self._failures.get(where, -math.inf) > LOG_FAILURE_AFTER:
            self._failures[where] = now
            self.get_logger().error(f"{where}: {traceback.format_exc()}")

    # -------------------------------------------------------------------------------------------------- parameters

    def _declare_parameters(self) -> Config:
        values = {}
        for setting, default in zip(settings(), Config().by_name().values(), strict=True):
            value = list(default) if isinstance(default, tuple) else default
            values[setting.name] = self.declare_parameter(setting.name, value, _descriptor(setting)).value
        return Config().changed(values)

    def _changed(self, parameters: Iterable[Parameter]) -> Config:
        names = self._config.by_name()
        return self._config.changed({p.name: p.value for p in parameters if p.name in names})

    def _validate_parameters(self, parameters: list[Parameter]) -> SetParametersResult:
        try:
            self._changed(parameters)
        except (GeometryError, TypeError) as fault:
            return SetParametersResult(successful=False, reason=str(fault))
        return SetParametersResult(successful=True)

    @_guarded
    def _apply_parameters(self, parameters: list[Parameter]) -> None:
        self._config = self._changed(parameters)
        if self._engine is not None:
            self._engine.configure(self._config)
            self._doze_timer.timer_period_ns = int(1e9 * self._nap())
            self._doze()
            self._inputs.refresh_camera()
            self._input_arrived()

    # --------------------------------------------------------------------------------------------------- lifecycle

    def on_configure(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Create everything."""
        try:
            self._create()
        except Exception:
            self.get_logger().error(f"cannot configure: {traceback.format_exc()}")
            return TransitionCallbackReturn.ERROR
        return super().on_configure(state)

    def on_activate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Begin to evaluate, and to answer queries."""
        result = super().on_activate(state)
        self._active = True
        self._input_arrived()
        self._report()
        return result

    def on_deactivate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Stop evaluating and answering; inputs are still applied."""
        self._active = False
        self._report()
        return super().on_deactivate(state)

    def on_cleanup(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Forget everything."""
        result = super().on_cleanup(state)
        self._release()
        return result

    def on_shutdown(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Let everything go."""
        result = super().on_shutdown(state)
        self._active = False
        self._release()
        return result

    def on_error(self, state: LifecycleState) -> TransitionCallbackReturn:
        """A transition failed: back to the start; the log has the reason."""
        self._active = False
        self._release()
        return TransitionCallbackReturn.SUCCESS

    def _change_state(self, callback: Callable[..., Any], request: Any, response: Any) -> Any:
        try:
            return callback(request, response)
        except Exception as fault:
            wanted = request.transition.label or request.transition.id
            self.get_logger().error(f"no transition {wanted!r} from here: {fault}")
            response.success = False
            return response

    def _create(self) -> None:
        """Everything that lives from configure to cleanup."""
        config, log = self._config, self.get_logger()
        self._transforms = _Transforms(self, config.fixed_frame)
        self._engine = engine = Engine(config, self._transforms)
        self._inputs = Inputs(engine, self._transforms, time.monotonic, log.warning)
        self._handlers = Handlers(engine, lambda: self._active, log.error, msg.SceneObject)
        self._markers = Markers(Marker, Point)
        self._last_contacts: Any = None
        self._mismatches: list[str] = []
        self._rechecks = 0
        self._timers_made = [
            report := self.create_timer(REPORT_PERIOD, self._report, clock=self._steady),
            recheck := self.create_timer(RECHECK_PERIOD, self._recheck, clock=self._steady),
        ]
        recheck.cancel()
        self._report_timer, self._recheck_timer = report, recheck
        self._evaluation = _Paced(self, self._evaluate, EVALUATION_SHARE)
        self._drawing = _Paced(self, self._draw, MARKER_SHARE)

        self._outputs: dict[str, Any] = {}
        for topic in OUTPUTS:
            events = PublisherEventCallbacks(incompatible_qos=self._incompatible, matched=self._subscriber_came)
            self._outputs[topic.name] = self.create_lifecycle_publisher(
                topic.type, f"~/{topic.name}", topic.qos, event_callbacks=events
            )
        self._state = self.create_publisher(
            STATE.type,
            f"~/{STATE.name}",
            STATE.qos,
            event_callbacks=PublisherEventCallbacks(incompatible_qos=self._incompatible),
        )
        self._diagnostics = self.create_publisher(DIAGNOSTICS.type, DIAGNOSTICS.name, DIAGNOSTICS.qos)
        self._services_made = [
            self.create_service(SERVICES[name], f"~/{name}", callback)
            for name, callback in self._service_callbacks().items()
        ]
        self._states_group, self._repeats = _Dozing(), 0
        self._timers_made.append(self.create_timer(self._nap(), self._doze, clock=self._steady))
        self._doze_timer = self._timers_made[-1]
        self._subscriptions_made = [
            self.create_subscription(
                topic.type,
                f"~/{topic.name}",
                self._receive_states
                if topic.name == STATES
                else functools.partial(self._receive, getattr(self._inputs, topic.name)),
                topic.qos,
                callback_group=self._states_group if topic.name == STATES else None,
                event_callbacks=SubscriptionEventCallbacks(incompatible_qos=self._incompatible),
            )
            for topic in INPUTS
        ]

    def _release(self) -> None:
        """Undo `_create`, as far as it got."""
        engine, self._engine = self._engine, None
        if engine is None:
            return
        engine.close()
        for name, destroy in (
            ("_subscriptions_made", self.destroy_subscription),
            ("_services_made", self.destroy_service),
            ("_timers_made", self.destroy_timer),
        ):
            for entity in self.__dict__.pop(name, ()):
                destroy(entity)
        for publisher in self.__dict__.pop("_outputs", {}).values():
            self.destroy_lifecycle_publisher(publisher)
        for name in ("_state", "_diagnostics"):
            if name in self.__dict__:
                self.destroy_publisher(self.__dict__.pop(name))

    def destroy_node(self) -> None:
        """Stop the worker of the cross-check, then let ROS clean up."""
        if self._engine is not None:
            self._engine.close()
        super().destroy_node()
        # rclpy forgets the lifecycle's state machine, whose services would keep the node in the graph.
        for name in [name for name in vars(self) if name == "_state_machine" or name.startswith("_service_")]:
            delattr(self, name)

    # ---------------------------------------------------------------------------------------------------- services

    def _service_callbacks(self) -> dict[str, Callable[[Any, Any], Any]]:
        handlers = self._handlers
        special = {
            "apply_scene": self._changing(handlers.apply_scene),
            "clear": self._changing(handlers.clear),
            "set_enabled": self._set_enabled,
        }
        callbacks = {name: special.get(name) or getattr(handlers, name) for name in SERVICES}
        return {name: self._looking_first(callback) for name, callback in callbacks.items()}

    def _looking_first(self, handler: Callable[[Any, Any], Any]) -> Callable[[Any, Any], Any]:
        """A handler that answers about the newest states."""

        def respond(request: Any, response: Any) -> Any:
            try:
                self._take_states()
            except Exception:
                self.log_failure("_take_states")
            return handler(request, response)

        return respond

    def _changing(self, handler: Callable[[Any, Any], Any]) -> Callable[[Any, Any], Any]:
        """A handler that changes the scene, which is then evaluated."""

        def respond(request: Any, response: Any) -> Any:
            response = handler(request, response)
            self._input_arrived()
            return response

        return respond

    def _set_enabled(self, request: Any, response: Any) -> Any:
        self._enabled = request.data
        response.success, response.message = True, "evaluating" if request.data else "not evaluating; services answer"
        self._input_arrived()
        return response

    # ------------------------------------------------------------------------------------------------------ topics

    def _receive(self, apply: Callable[[Any], bool], message: Any) -> None:
        if apply(message):
            self._input_arrived()

    @_guarded
    def _subscriber_came(self, _: Any) -> None:
        """Somebody listens who did not before, and wants what may not have been computed yet."""
        self._doze()
        self._input_arrived()

    @_guarded
    def _doze(self) -> None:
        """Look at ~/states now and then while they say the same and no answer is asked for; else be woken by each."""
        engine = self._engine
        if engine is None:
            return
        self._take_states()
        wanted = self._active and self._enabled and any(stage.active for stage in engine.plan(self._asked()))
        self._states_group.asleep = self._repeats >= QUIET and not wanted

    def _nap(self) -> float:
        """How long not to look at ~/states [s]: no longer than would make them look stale."""
        return min(1.0 / self._config.idle_rate, NAP_SHARE * self._config.states_timeout)

    def _take_states(self) -> None:
        """The newest message of ~/states, if it is still there."""
        if not self._states_group.asleep:
            return  # the executor takes it
        subscription = self._subscriptions_made[[topic.name for topic in INPUTS].index(STATES)]
        with subscription.handle:
            taken = subscription.handle.take_message(subscription.msg_type, subscription.raw)
        if taken is not None:
            self._receive_states(taken[0])

    def _receive_states(self, message: Any) -> None:
        """Apply them, and count how often they said nothing new."""
        scene = self._inputs.engine.scene
        before = scene.world
        self._receive(self._inputs.states, message)
        same = scene.world.poses is before.poses and scene.world.twists is before.twists
        self._repeats = self._repeats + 1 if same else 0

    @_guarded
    def _input_arrived(self) -> None:
        """Evaluate as soon as `max_rate` allows, all that came in until then together."""
        if self._active and self._enabled:
            self._evaluation.request(1.0 / self._config.max_rate)

    def _asked(self) -> frozenset[str]:
        """Topics that somebody listens to."""
        return frozenset(name for name, publisher in self._outputs.items() if publisher.get_subscription_count())

    def _header(self) -> Header:
        """Time of the newest input, or now if that had none."""
        header, engine = Header(frame_id=self._config.fixed_frame), self._engine
        stamp = engine.stamp if engine is not None else None
        header.stamp = stamp if stamp is not None and (stamp.sec or stamp.nanosec) else self.get_clock().now().to_msg()
        return header

    def _evaluate(self) -> Iterator[None]:
        """Compute and publish topic by topic, so that inputs and requests get their turn in between."""
        engine = self._engine
        if engine is None or not (self._active and self._enabled):
            return
        for topic, answer in engine.steps(self._asked()):
            header = self._header()
            message: Any
            if topic == CONTACTS:
                self._last_contacts = answer
                message = msg.ContactArray(header=header)
                convert.set_contacts(message, answer, msg.Contact, Point)
            elif topic == DISTANCES:
                message = msg.DistanceArray(header=header, max_distance=self._config.max_distance)
                convert.set_distances(message, answer, msg.PairDistance)
            elif engine.camera is not None:
                message = msg.VisibleArray(header=header)
                convert.set_visible(message, answer, engine.camera)
            message.stale, message.input_age = engine.stale, engine.input_age
            self._outputs[topic].publish(message)
            yield
        # The drawing shows the contacts just found.
        if self._draws():
            self._drawing.request(1.0 / self._config.markers_rate)

    def _draws(self) -> bool:
        """Whether a drawing is asked for."""
        mode = self._config.effects_markers
        return mode == ON or (mode != OFF and self._outputs[MARKERS].get_subscription_count() > 0)

    def _draw(self) -> Iterator[None]:
        engine = self._engine
        if engine is None or not (self._active and self._draws()):
            return
        engine.counters["drawings"] += 1
        markers: list[Any] = []
        for part in self._markers.build(engine.scene, engine.camera, self._last_contacts, self._header()):
            markers += part
            yield
        self._outputs[MARKERS].publish(MarkerArray(markers=markers))

    # ----------------------------------------------------------------------------------------------------- reports

    @_guarded
    def _report(self) -> None:
        """Tell ~/state and /diagnostics how things are."""
        if self._engine is None:
            return
        for difference in self._engine.cross_check.poll():
            if not difference.explained:
                self.get_logger().warning(f"cross-check: {difference.reason}: {difference.reproducer()}")
        self._find_mismatches()
        report = reports.Report(
            engine=self._engine,
            inputs=list(self._inputs.records.values()),
            now=time.monotonic(),
            enabled=self._enabled,
            active=self._active,
            plan=self._engine.plan(self._asked()),
            mismatches=self._mismatches,
        )
        header = Header(stamp=self.get_clock().now().to_msg(), frame_id=self._config.fixed_frame)
        state = msg.EngineState(header=header)
        reports.set_state(state, report)
        self._state.publish(state)
        name = self.get_fully_qualified_name().lstrip("/")
        statuses = reports.diagnostics(report, name, DiagnosticStatus, KeyValue)
        self._diagnostics.publish(DiagnosticArray(header=header, status=statuses))

    @_guarded
    def _incompatible(self, _: Any) -> None:
        """An endpoint does not get through to us; who it is may take a moment to be known."""
        self._rechecks = MAX_RECHECKS
        self._recheck_timer.reset()
        self._recheck()

    @_guarded
    def _recheck(self) -> None:
        self._rechecks -= 1
        if self._find_mismatches():
            self._report()
        if self._rechecks <= 0:
            self._recheck_timer.cancel()

    def _find_mismatches(self) -> bool:
        """Compare the profiles of all endpoints on our topics with ours; log what is new; True if anything is."""
        found: list[str] = []
        settled = self._rechecks <= 0
        for topic, subscription in zip(INPUTS, self._subscriptions_made, strict=True):
            name = subscription.topic_name
            others = self.get_publishers_info_by_topic(name)
            found += reports.endpoint_mismatches(name, topic.qos, others, publishing=False, settled=settled)
        for topic, publisher in zip((*OUTPUTS, STATE), (*self._outputs.values(), self._state), strict=True):
            name = publisher.topic_name
            others = self.get_subscriptions_info_by_topic(name)
            found += reports.endpoint_mismatches(name, topic.qos, others, publishing=True, settled=settled)
        new = [text for text in found if text not in self._mismatches]
        for text in new:
            self.get_logger().error(text)
        self._mismatches = found
        return bool(new)


class _Paced:
    """Does work on request, but not too often, for no more than a share of the time, and step by step.

    Parameters
    ----------
    node : GeomsrvNode
    work : callable
        Gives an iterator; the executor serves others between its steps.
    share : float
        Largest part of the time that the work may take, in (0, 1].
    """

    def __init__(self, node: GeomsrvNode, work: Callable[[], Iterator[None]], share: float) -> None:
        self._node = node
        self._work = work
        self._pause_per_second = 1.0 / share - 1.0
        self._started = self._earliest = -math.inf
        self._spent = 0.0
        self._steps: Iterator[None] | None = None
        self._again: float | None = None  # a request that came while the work was under way: its period
        self._waiting = False
        self._timer = node.create_timer(1.0, self._run, clock=node._steady)
        self._timer.cancel()
        node._timers_made.append(self._timer)

    def request(self, period: float) -> None:
        """Begin now if the last time began `period` seconds ago, else as soon as that is so."""
        if self._steps is not None:
            self._again = period
        elif not self._waiting:
            wait = max(self._started + period, self._earliest) - time.monotonic()
            if wait <= 0.0:
                self._run()
            else:
                self._wake_after(wait)

    def _wake_after(self, seconds: float) -> None:
        self._waiting = True
        self._timer.timer_period_ns = max(int(seconds * 1e9), 1)
        self._timer.reset()

    def _run(self) -> None:
        """One step."""
        self._timer.cancel()
        self._waiting = False
        begin = time.monotonic()
        if self._steps is None:
            self._started, self._spent, self._steps = begin, 0.0, self._work()
        try:
            next(self._steps)
        except StopIteration:
            self._steps = None
        except Exception:
            self._steps = None
            self._node.log_failure(self._work.__name__)
        end = time.monotonic()
        self._spent += end - begin
        if self._steps is not None:
            self._wake_after(0.0)
            return
        self._earliest = end + self._pause_per_second * self._spent
        period, self._again = self._again, None
        if period is not None:
            self.request(period)


class _Transforms:
    """Poses of frames in the fixed frame, by tf2 where that is installed; it is loaded on first use."""

    def __init__(self, node: GeomsrvNode, fixed_frame: str) -> None:
        self._node = node
        self._fixed_frame = fixed_frame
        self._buffer: Any = None

    def __call__(self, frame: str, stamp: Any = None) -> ArrayLike:
        """Pose (7,) of `frame` at `stamp` (None: the newest known); raises `GeometryError` that says why not."""
        if frame == self._fixed_frame:
            return (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)
        fault = f"frame {frame!r} is not the fixed frame {self._fixed_frame!r}"
        if self._buffer is None:
            if importlib.util.find_spec("tf2_ros") is None:
                raise GeometryError(f"{fault}, and tf2_ros, which could transform it, is not installed")
            import tf2_ros

            self._buffer = tf2_ros.Buffer(node=self._node)
            self._listener = tf2_ros.TransformListener(self._buffer, self._node)
        when = rclpy.time.Time() if stamp is None else rclpy.time.Time.from_msg(stamp)
        try:
            transform = self._buffer.lookup_transform(self._fixed_frame, frame, when).transform
        except Exception as error:  # tf2 has many kinds, none of which this process can import without it
            raise GeometryError(f"{fault}, and tf2 has no transform: {error}") from None
        t, q = transform.translation, transform.rotation
        return t.x, t.y, t.z, q.x, q.y, q.z, q.w


def _descriptor(setting: Setting) -> ParameterDescriptor:
    text = f"{setting.description} [{setting.unit}]" if setting.unit else setting.description
    descriptor = ParameterDescriptor(description=text, read_only=setting.read_only)
    if setting.choices:
        # YAML reads `off` and `on` as booleans.
        descriptor.dynamic_typing = OFF in setting.choices
        descriptor.additional_constraints = f"one of {', '.join(setting.choices)}"
    if setting.length:
        descriptor.additional_constraints = f"{setting.length} numbers"
    if setting.minimum is not None:
        top = math.inf if setting.maximum is None else setting.maximum
        descriptor.floating_point_range = [FloatingPointRange(from_value=setting.minimum, to_value=top)]
    return descriptor


def main(argv: Sequence[str] | None = None) -> int:
    """Run the node until it is told to stop; returns the exit status."""
    # rclpy's own handlers shut the context down before the node can be destroyed, and then its endpoints linger in the
    # graph of the others until their leases run out.
    rclpy.init(
        args=["geomsrv", *(sys.argv[1:] if argv is None else argv)], signal_handler_options=SignalHandlerOptions.NO
    )
    stop = threading.Event()
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: stop.set())
    try:
        node = GeomsrvNode()
    except (ParameterException, GeometryError) as fault:
        print(f"geomsrv node: {fault}", file=sys.stderr)
        rclpy.try_shutdown()
        return 2
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    # What has been loaded stays; looking through it again and again would make some callbacks late.
    gc.freeze()
    # The main thread waits for a signal; waiting for messages it would not hear one.
    spinning = threading.Thread(target=_spin, args=(executor, node, stop), name="executor")
    spinning.start()
    stop.wait()
    executor.shutdown()
    spinning.join()
    node.destroy_node()
    rclpy.try_shutdown()
    return 0


def _spin(executor: SingleThreadedExecutor, node: GeomsrvNode, stop: threading.Event) -> None:
    """Serve until told to stop."""
    while not stop.is_set():
        try:
            executor.spin_once()
        except ExternalShutdownException:
            stop.set()
        except Exception:
            # Callbacks guard themselves; this is for what rclpy does around them.
            if not stop.is_set():
                node.get_logger().error(traceback.format_exc())
