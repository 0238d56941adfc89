# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""The node as a process of its own, as users run it: start, serve, stop."""

from __future__ import annotations

import array
import os
import signal
import statistics
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from ros_helpers import DEADLINE, DOMAIN, Client, body
from std_srvs.srv import Trigger

import geomsrv as gs
from geomsrv import msg, srv
from geomsrv.ros.node import INPUTS, STATE

COMMAND = [sys.executable, "-c", "import sys; from geomsrv.cli import main; sys.exit(main())"]
STATES = next(topic for topic in INPUTS if topic.name == "states")


def start(*arguments: str) -> subprocess.Popen:
    environment = {**os.environ, "ROS_DOMAIN_ID": str(DOMAIN), "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}
    return subprocess.Popen(
        [*COMMAND, *arguments], env=environment, cwd="/", stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
    )


@pytest.fixture(scope="module")
def process():
    node = start("node", "--ros-args", "-p", "max_distance:=2.0", "-r", "__node:=remote")
    yield node
    node.kill()
    node.communicate()


@pytest.fixture(scope="module")
def client(process):
    client = Client("process_tester", server="/remote")
    update = msg.SceneUpdate(add=[body("ball", gs.Sphere(0.5), (2, 0, 0)), body("box", gs.Box([1, 1, 1]))])
    assert client.call(srv.ApplyScene, "apply_scene", update=update, seconds=30.0).status == 0
    yield client
    client.close()


def test_it_serves_under_another_name(client) -> None:
    got = client.call(srv.Distance, "distance", select=0, ids_a=["ball"], ids_b=["box"], want=["witness"])
    assert got.status == got.OK and list(got.distance) == [0.5]
    assert client.call(Trigger, "self_check", seconds=60.0).success


def test_a_volatile_publisher_in_another_process_is_named(client) -> None:
    states = client.listen(msg.EngineState, "state", STATE.qos)
    publisher = client.publisher(msg.SceneUpdate, "shapes", 10, connected=False)
    got = states.wait(lambda m: m.qos_mismatches)
    assert "/process_tester" in got.qos_mismatches[0] and "/remote/shapes" in got.qos_mismatches[0]
    client.node.destroy_publisher(publisher)
    states.wait(lambda m: not m.qos_mismatches)


def resident_kib(pid: int) -> int:
    fields = Path(f"/proc/{pid}/statm").read_text().split()
    return int(fields[1]) * os.sysconf("SC_PAGE_SIZE") // 1024


def growth_kib(client, process, warm_up: int, calls: int) -> int:
    """Growth of the node's memory over many calls."""
    request = srv.Distance.Request(select=0, ids_a=["ball"], ids_b=["box"], want=["witness"])
    service = client.service(srv.Distance, "distance")

    def call(count: int) -> None:
        for _ in range(count):
            future = service.call_async(request)
            client.until(future.done, "an answer")

    call(warm_up)
    before = resident_kib(process.pid)
    call(calls)
    return resident_kib(process.pid) - before


def test_memory_stays_flat(client, process) -> None:
    # A leak of one response (about 1 KiB) a call would show as 1 MiB.
    assert growth_kib(client, process, 300, 1000) < 600


@pytest.mark.soak
def test_memory_stays_flat_for_long(client, process) -> None:
    assert growth_kib(client, process, 1000, 30_000) < 1024


def test_a_thousand_states_all_arrive(client, process) -> None:
    """Every one that DDS hands over is applied; how many it can hand over at 100 Hz is for the benchmark."""
    count = 1000
    names = [f"s{i:04}" for i in range(count)]
    rows = np.zeros((count, 7))
    rows[:, 0], rows[:, 1], rows[:, 6] = np.arange(count) % 40 * 3.0, np.arange(count) // 40 * 3.0, 1.0
    update = msg.SceneUpdate(clear=True, add=[body(n, gs.Sphere(0.5), r[:3]) for n, r in zip(names, rows, strict=True)])
    assert client.call(srv.ApplyScene, "apply_scene", update=update).status == 0
    publisher = client.publisher(msg.ShapeStates, "states", STATES.qos)
    message = msg.ShapeStates(ids=names, poses=array.array("d", rows.tobytes()), ids_key=7)
    message.twists = array.array("d", bytes(8 * 6 * count))
    states = client.listen(msg.EngineState, "state", STATE.qos)
    index = list(states.wait().input_topics).index("~/states")
    durations = []
    for i in range(20):
        message.header.stamp.sec = i + 1
        before = client.call(srv.GetScene, "get_scene", ids=["s0000"]).version
        begin = time.perf_counter()
        publisher.publish(message)
        client.until(
            lambda before=before: client.call(srv.GetScene, "get_scene", ids=["s0000"]).version > before, "new states"
        )
        durations.append(time.perf_counter() - begin)
        message.ids = []
    got = states.wait(lambda m: m.input_received[index] >= 20)
    assert got.input_refused[index] == 0 and got.object_count == count
    print(f"median {statistics.median(durations) * 1e3:.1f} ms from publishing 1,000 states to seeing them")


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_it_stops_cleanly(number) -> None:
    node = start("node", "--ros-args", "-r", "__node:=stopping", "-p", "cross_check.mode:=all")
    client = Client("stopper", server="/stopping")
    try:
        client.service(Trigger, "clear")
        node.send_signal(number)
        output, _ = node.communicate(timeout=DEADLINE)
        assert node.returncode == 0, output
        assert "Traceback" not in output
    finally:
        client.close()
        node.kill()
        node.wait()


def test_a_bad_parameter_is_one_sentence_and_exit_status_two() -> None:
    node = start("node", "--ros-args", "-p", "max_rate:=-5.0")
    output, _ = node.communicate(timeout=3 * DEADLINE)
    assert node.returncode == 2, output
    assert "max_rate" in output and "Traceback" not in output


def test_the_command_line() -> None:
    help_ = start("--help")
    output, _ = help_.communicate(timeout=3 * DEADLINE)
    assert help_.returncode == 0 and all(word in output for word in ("node", "demo", "self-check"))
    version = start("--version")
    assert version.communicate(timeout=3 * DEADLINE)[0].split()[0] == "geomsrv" and version.returncode == 0
    nothing = start()
    assert "command" in nothing.communicate(timeout=3 * DEADLINE)[0] and nothing.returncode == 2
    check = start("self-check")
    output, _ = check.communicate(timeout=6 * DEADLINE)
    assert check.returncode == 0 and "passed" in output
