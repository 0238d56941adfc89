# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""What the node says about itself: ~/state and /diagnostics, and endpoints whose quality of service does not fit."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from geomsrv.crosscheck import Tally
from geomsrv.effects import Stage
from geomsrv.engine import Engine
from geomsrv.ros import convert
from geomsrv.ros.inputs import InputRecord

__all__ = ["Report", "diagnostics", "policy_mismatches", "set_state"]

OK, WARN, ERROR = 0, 1, 2  # diagnostic_msgs/DiagnosticStatus


@dataclass(frozen=True)
class Report:
    """Everything that ~/state and /diagnostics tell, as of one moment."""

    engine: Engine
    inputs: Sequence[InputRecord]
    now: float  #: clock of the inputs [s]
    enabled: bool
    active: bool
    plan: Sequence[Stage]
    mismatches: Sequence[str] = field(default_factory=list)


def set_state(message: Any, report: Report) -> None:
    """Fill a geomsrv/EngineState."""
    engine, tally = report.engine, report.engine.cross_check.tally()
    message.enabled = report.enabled
    message.scene_version = engine.scene.version
    message.object_count, message.moving_count = len(engine.scene), engine.moving_count
    message.plan_stages = [stage.name for stage in report.plan]
    message.plan_active = convert.bytes_([stage.active for stage in report.plan])
    message.plan_reasons = [stage.reason for stage in report.plan]
    message.scene_plan = engine.scene.plan()
    message.counter_names = list(engine.counters)
    message.counter_values = convert.uint64s(list(engine.counters.values()))
    costs = engine.totals.rows
    message.cost_queries, message.cost_tiers = [query for query, _ in costs], [tier for _, tier in costs]
    for k, name in enumerate(("calls", "items", "ns")):
        setattr(message, f"cost_{name}", convert.uint64s([row[k] for row in costs.values()]))
    message.input_topics = [record.topic for record in report.inputs]
    message.input_ages = convert.doubles([record.age(report.now) for record in report.inputs])
    message.input_received = convert.uint64s([record.received for record in report.inputs])
    message.input_refused = convert.uint64s([record.refused for record in report.inputs])
    message.input_faults = [record.fault for record in report.inputs]
    message.qos_mismatches = list(report.mismatches)
    message.cross_check_mode = str(tally.mode)
    message.cross_check_status = tally.summary()
    message.cross_check_kinds = list(tally.kinds)
    for verdict in ("agreed", "explained", "unexplained", "skipped"):
        numbers = [getattr(kind, verdict) for kind in tally.kinds.values()]
        setattr(message, f"cross_check_{verdict}", convert.uint64s(numbers))


class Diagnosis(NamedTuple):
    """One diagnostic_msgs/DiagnosticStatus."""

    name: str
    level: int
    message: str
    values: dict[str, str]


def diagnose(report: Report) -> list[Diagnosis]:
    """Health of inputs, connections, cross-check and engine."""
    return [
        _diagnose_engine(report),
        _diagnose_inputs(report),
        _diagnose_connections(report.mismatches),
        _diagnose_cross_check(report.engine.cross_check.tally()),
    ]


def _diagnose_engine(report: Report) -> Diagnosis:
    engine = report.engine
    text = "not active" if not report.active else "evaluating" if report.enabled else "disabled by ~/set_enabled"
    values = {"scene version": str(engine.scene.version), "objects": str(len(engine.scene))}
    values |= {name: str(count) for name, count in engine.counters.items()}
    values |= {f"plan: {s.name}": f"{'on' if s.active else 'off'}: {s.reason}" for s in report.plan}
    if engine.failing:
        return Diagnosis("engine", ERROR, "the last evaluation failed; the log has the reason", values)
    return Diagnosis("engine", OK, text, values)


def _diagnose_inputs(report: Report) -> Diagnosis:
    values, complaints = {}, []
    for record in report.inputs:
        age = record.age(report.now)
        values[f"{record.topic} age [s]"] = "never" if np.isnan(age) else f"{age:.3f}"
        values[f"{record.topic} received"] = str(record.received)
        values[f"{record.topic} refused"] = str(record.refused)
        if record.refused:
            values[f"{record.topic} last refused because"] = record.fault
        if record.refused_last:
            complaints.append(f"{record.topic} refused: {record.fault}")
        limit = report.engine.config.states_timeout
        if record.topic == "~/states" and age > limit:
            complaints.append(f"{record.topic} stopped: nothing for {age:.1f} s")
    return Diagnosis("inputs", WARN if complaints else OK, "; ".join(complaints) or "inputs are fine", values)


def _diagnose_connections(mismatches: Sequence[str]) -> Diagnosis:
    values = {f"mismatch {i}": text for i, text in enumerate(mismatches)}
    text = "; ".join(mismatches) or "quality of service fits everywhere"
    return Diagnosis("connections", ERROR if mismatches else OK, text, values)


def _diagnose_cross_check(tally: Tally) -> Diagnosis:
    values = {"mode": str(tally.mode), "restarts of FCL": str(tally.restarts), "pending": str(tally.pending)}
    for kind, counts in tally.kinds.items():
        values[kind] = (
            f"{counts.agreed} agreed, {counts.explained} explained, {counts.unexplained} unexplained, "
            f"{counts.skipped} skipped"
        )
    values |= {f"unexplained {i}": d.reproducer() for i, d in enumerate(tally.recent) if not d.explained}
    wanting = tally.mode != "off" and not tally.available
    level = WARN if wanting or tally.unexplained else OK
    return Diagnosis("cross-check", level, tally.summary(), values)


def diagnostics(
    report: Report, hardware: str, status_type: Callable[[], Any], value_type: Callable[..., Any]
) -> list[Any]:
    """The diagnoses as messages."""
    messages = []
    for diagnosis in diagnose(report):
        status = status_type()
        # The field is of type `byte`, which Python writes as bytes.
        status.level = bytes([diagnosis.level])
        status.name, status.hardware_id = f"{hardware}: {diagnosis.name}", hardware
        status.message = diagnosis.message
        status.values = [value_type(key=key, value=value) for key, value in diagnosis.values.items()]
        messages.append(status)
    return messages


def policy_mismatches(offered: Any, requested: Any) -> list[str]:
    """Policies by which a publisher's profile does not serve a subscription's, in words; as DDS matches them."""
    found = []
    if offered.reliability.name == "BEST_EFFORT" and requested.reliability.name == "RELIABLE":
        found.append("reliability: publisher is best effort, subscription wants reliable")
    if offered.durability.name == "VOLATILE" and requested.durability.name == "TRANSIENT_LOCAL":
        found.append("durability: publisher is volatile, subscription wants transient local")
    if offered.liveliness.name == "AUTOMATIC" and requested.liveliness.name == "MANUAL_BY_TOPIC":
        found.append("liveliness: publisher is automatic, subscription wants manual by topic")
    for name in ("deadline", "liveliness_lease_duration"):
        given, wanted = (_seconds(getattr(profile, name)) for profile in (offered, requested))
        if given > wanted:
            words = f"publisher promises {given:g} s, subscription wants {wanted:g} s"
            found.append(f"{name.replace('_', ' ')}: {words}")
    return found


def _seconds(duration: Any) -> float:
    """A duration of a profile; 0 stands for "not set", which is for ever, as the largest int64 is."""
    nanoseconds = duration.nanoseconds
    return np.inf if nanoseconds == 0 or nanoseconds >= np.iinfo(np.int64).max else nanoseconds * 1e-9


UNKNOWN_NODE = "_NODE_NAME_UNKNOWN_"  # what rmw calls the node of an endpoint that it has not been told about


def endpoint_mismatches(
    topic: str, own_profile: Any, endpoints: Iterable[Any], *, publishing: bool, settled: bool
) -> list[str]:
    """One sentence per endpoint of `topic` that does not get through to ours: its node, the topic, the policy.

    Parameters
    ----------
    topic : str
    own_profile : QoSProfile
    endpoints : iterable of TopicEndpointInfo
        Of the other side.
    publishing : bool
        Whether our side is the one that publishes.
    settled : bool
        Whether to report endpoints whose node is not known, too.
    """
    sentences = []
    side = "subscription" if publishing else "publisher"
    for endpoint in endpoints:
        offered, requested = endpoint.qos_profile, own_profile
        if publishing:
            offered, requested = requested, offered
        known = endpoint.node_name != UNKNOWN_NODE
        who = f"node {endpoint.node_namespace.rstrip('/')}/{endpoint.node_name}" if known else "an unknown node"
        if known or settled:
            faults = policy_mismatches(offered, requested)
            sentences += [f"{side} of {who} on {topic} is not connected: {fault}" for fault in faults]
    return sentences
