"""What the views show and do, for a system, a hand-written node, and the usage of processes."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

from composer.client.run_log import find_runs
from composer.client.run_log.reading import last_records
from composer.client.systems.local_queries import of_system, of_whole_systems
from composer.dashboard.channels.nodes import ProcessMonitor, total
from composer.dashboard.protocol.messages import to_json
from composer.runtime.protocol.reports import NodeReport, SystemReport
from tests.ros.support.dashboard import Browser
from tests.ros.support.in_process import wait_until
from tests.ros.support.system_process import RunningSystem

PLANNER, CONTROLLER = "/planning/planner", "/control/motor_controller"
SIMULATOR = "/perception/sensor_simulator"
TALKER = "/lab/talker"


def _nodes(data: Any) -> dict[str, Any]:
    return {node["name"]: node for node in data["nodes"]}


def test_nodes_have_states_figures_and_places(page: Browser, pipeline: RunningSystem) -> None:
    channel = page.subscribe("nodes")
    data = page.until(
        channel,
        lambda data: (
            PLANNER in _nodes(data)
            and TALKER in _nodes(data)
            and data["systems"]
            and data["systems"][0]["process"]
            and data["systems"][0]["process"]["cpu_percent"]
        ),
    )
    system = data["systems"][0]
    assert (system["name"], system["pid"]) == ("/pipeline", str(pipeline.process.pid))
    assert system["file"] == "systems/pipeline.yaml"
    assert system["process"]["memory_mb"] > 10
    node = _nodes(data)[PLANNER]
    assert (node["state"], node["transitions"]) == ("active", ["deactivate", "shutdown"])
    assert node["declared_at"].startswith("systems/pipeline.yaml:")
    assert _nodes(data)[TALKER]["state"] == ""


def test_topics_and_services_have_endpoints_and_figures(page: Browser) -> None:
    channel = page.subscribe("topics", measure=["/lab/count", "/sensor_data"])
    data = page.until(
        channel,
        lambda data: all(
            (data["figures"].get(name, {}).get("rate_hz") or 0) > 20
            for name in ("/lab/count", "/sensor_data")
        ),
    )
    topic = {item["name"]: item for item in data["topics"]}["/sensor_data"]
    assert topic["types"] == ["nav_msgs/msg/Odometry"]
    assert [end["node"] for end in topic["publishers"]] == [SIMULATOR]
    assert topic["publishers"][0]["qos"]["reliability"] == "best_effort"
    assert data["figures"]["/sensor_data"]["mean_bytes"] > 700
    # Services for tools are hidden.
    data = page.until(
        page.subscribe("services"),
        lambda data: "/lab/add" in {item["name"] for item in data["services"]},
    )
    hidden = ("get_parameters", "/pipeline/manager/")
    assert not any(part in item["name"] for item in data["services"] for part in hidden)
    everything = page.subscribe("services", hidden=True)
    page.until(everything, lambda data: all(part in str(data["services"]) for part in hidden))


SILENT = """
system: silent
introspection: {rosout: false}
nodes: {silent: {on_activate: {log: before the page}}}
"""


def test_the_log_begins_with_what_was_logged_before(page: Browser, tmp_path: Path) -> None:
    file = tmp_path / "silent.yaml"
    file.write_text(SILENT)
    with RunningSystem(str(file)) as system:
        system.wait_for("1 of 1 nodes active")
        (run,) = find_runs(Path(os.environ["ROS_LOG_DIR"]), "silent")
        active = "1 of 1 nodes active"
        wait_until(lambda: any(active in item.message for item in last_records(run, 10_000)))
        channel = page.subscribe("log", node="/silent")
        (line,) = page.until(channel, lambda data: data["lines"])["lines"]
        assert (line["level"], line["text"]) == ("info", "before the page")


TEXT = {"topic": "/lab/in", "type": "std_msgs/msg/String"}
ADD = {"service": "/lab/add", "type": "std_srvs/srv/SetBool"}
EMPTY = {"service": "/no", "type": "std_srvs/srv/Empty"}
SPEED = {"node": PLANNER, "name": "max_velocity"}


REQUESTS: list[tuple[str, dict[str, Any], str, str]] = [
    ("transition", {"node": PLANNER, "transition": "activate"}, "rejected", "deactivate"),
    ("transition", {"node": "/no", "transition": "cleanup"}, "not_found", "/no"),
    ("node", {"node": "/missing"}, "not_found", "/missing"),
    ("set_parameter", {**SPEED, "value": 99}, "rejected", "max_velocity"),
    ("set_parameter", {**SPEED, "value": "fast"}, "rejected", "max_velocity"),
    ("publish", {**TEXT, "message": {"data": 5}}, "bad_request", "data takes a string"),
    ("call", {**ADD, "request": {"dat": 1}}, "bad_request", "did you mean 'data'?"),
    ("call", {**EMPTY, "request": {}, "timeout_s": 0.3}, "no_response", "/no"),
]
SUBSCRIPTIONS: list[tuple[str, dict[str, Any], str, str]] = [
    ("echo", {"topic": "/nothing"}, "not_found", "nothing publishes '/nothing'"),
    (
        "plot",
        {"series": [{"topic": "/sensor_data", "field": "pose.poze"}]},
        "bad_request",
        "did you mean 'pose'?",
    ),
    ("plot", {"series": [{"topic": "/lab/text", "field": "data"}]}, "bad_request", "not a number"),
]


def test_requests_and_subscriptions_that_fail_say_why(page: Browser) -> None:
    page.until(page.subscribe("nodes"), lambda data: {PLANNER, TALKER} <= _nodes(data).keys())
    page.until(page.subscribe("topics"), lambda data: "/lab/text" in str(data["topics"]))
    failures = [(page.error(op, **values), *rest) for op, values, *rest in REQUESTS]
    failures += [
        (page.failure(page.subscribe(channel, **values)), *rest)
        for channel, values, *rest in SUBSCRIPTIONS
    ]
    for error, code, reason in failures:
        assert error["code"] == code, error
        assert reason in f"{error['message']} {error['hint']}"


BUSY = "print(flush=True)\nwhile True: pass"


def usage(cpu_percent: float | None, memory_mb: float = 10.0) -> dict[str, float | None]:
    return {"cpu_percent": cpu_percent, "memory_mb": memory_mb, "threads": 2, "up_s": memory_mb}


def test_the_usage_is_that_of_each_process() -> None:
    monitor = ProcessMonitor()
    with subprocess.Popen([sys.executable, "-c", BUSY], stdout=subprocess.PIPE) as busy:
        try:
            assert busy.stdout is not None
            busy.stdout.readline()
            pid = str(busy.pid)
            first = monitor.usage(pid)
            assert first is not None
            assert first["cpu_percent"] is None
            assert first["memory_mb"] > 1
            assert first["threads"] == 1
            while not (monitor.usage(pid) or {})["cpu_percent"]:
                pass
        finally:
            busy.kill()
    assert monitor.usage(pid) is None
    own = monitor.usage(str(os.getpid()))
    assert own is not None
    assert own["cpu_percent"] is None
    for text in ("", "unknown", "-1", "1/../2", "²"):  # only ids of processes are read
        assert monitor.usage(text) is None


def test_the_usage_of_a_system_is_that_of_its_processes() -> None:
    assert total([usage(1.5), None, usage(2.0, 20.0)]) == {
        "cpu_percent": 3.5,
        "memory_mb": 30.0,
        "threads": 4,
        "up_s": 20.0,
        "processes": 2,
    }
    assert (total([usage(1.5), usage(None)]) or {})["cpu_percent"] is None
    assert total([None]) is None
    assert json.loads(to_json(total([usage(0.1), usage(0.2)])))["cpu_percent"] == 0.3


def report(name: str, **nodes: dict[str, str]) -> SystemReport:
    reported = tuple(NodeReport(f"/{node}", "active", **nodes[node]) for node in nodes)
    return of_system(name, SystemReport(name, "running", reported, "robot", "1"))


def test_nodes_have_their_process_and_a_system_is_listed_once() -> None:
    found = report(
        "/robot",
        own={"pid": "1", "host": ""},
        other={"pid": "2", "host": "arm", "process": "acting"},
        ended={"pid": "", "host": ""},
    )
    places = [(node.host, node.pid) for node in found.nodes]
    assert places == [("robot", "1"), ("arm", "2"), ("robot", "")]
    whole = report("/robot", other={"process": "acting"})
    acting, alone = report("/robot/acting", other={}), report("/robot/lab", node={})
    reports = {"/robot": whole, "/robot/acting": acting, "/robot/lab": alone, "/silent": None}
    assert of_whole_systems(reports).keys() == {"/robot", "/robot/lab", "/silent"}
    # Without the report of the system, only they have their nodes.
    assert "/robot/acting" in of_whole_systems({**reports, "/robot": None})
