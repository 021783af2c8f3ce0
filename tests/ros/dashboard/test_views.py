"""What the views show and do, for a system of ours and for a hand-written node."""

from __future__ import annotations

import math
import os
from pathlib import Path
from typing import Any

from composer.client.run_log import find_runs, last_records
from tests.ros.support.commands import expect_state
from tests.ros.support.dashboard import Browser
from tests.ros.support.in_process import wait_until
from tests.ros.support.system_process import RunningSystem

PLANNER, CONTROLLER = "/planning/planner", "/control/motor_controller"
SIMULATOR = "/perception/sensor_simulator"
TALKER = "/lab/talker"


def _nodes(data: Any) -> dict[str, Any]:
    return {node["name"]: node for node in data["nodes"]}


def _state(data: Any, name: str) -> Any:
    return _nodes(data).get(name, {}).get("state")


def test_the_graph_has_both_and_measured_rates(page: Browser) -> None:
    picture = page.until(
        page.subscribe("graph"),
        lambda data: {f"node:{PLANNER}", f"node:{TALKER}"} <= data["things"].keys(),
    )
    assert picture["svg"].startswith("<defs>")
    live = page.subscribe("graph.live")
    publisher = f"publisher:{SIMULATOR}./sensor_data"
    data = page.until(
        live, lambda data: (data["edges"].get(publisher, {}).get("rate_hz") or 0) > 20
    )
    assert data["nodes"][PLANNER]["state"] == "active"
    assert publisher in picture["things"]
    # No system reports the rate of the hand-written node, so it is measured.
    page.until(
        live, lambda data: 30 < (data["topics"].get("/lab/count", {}).get("rate_hz") or 0) < 70
    )


def test_the_declared_graph_needs_no_running_node(page: Browser) -> None:
    picture = page.until(page.subscribe("graph", view="lifecycle"), bool)
    assert any("declared_at" in thing["details"] for thing in picture["things"].values())


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


def test_a_node_is_deactivated_and_activated_again(page: Browser) -> None:
    channel = page.subscribe("nodes")
    done = page.ok("transition", node=CONTROLLER, transition="deactivate")
    assert done["outcomes"] == [{"node": CONTROLLER, "before": "active", "after": "inactive"}]
    expect_state(CONTROLLER, "inactive")
    page.until(channel, lambda data: _state(data, CONTROLLER) == "inactive")
    refused = page.error("transition", node=CONTROLLER, transition="deactivate")
    assert refused["code"] == "rejected"
    assert "activate" in refused["hint"]
    page.ok("transition", node=CONTROLLER, transition="activate")
    page.ok("restart", node=CONTROLLER)
    expect_state(CONTROLLER, "active")
    assert page.error("transition", node="/missing", transition="configure")["code"] == "not_found"


def test_the_system_is_paused_and_resumed(page: Browser) -> None:
    channel = page.subscribe("nodes")
    page.ok("command", system="/pipeline", command="pause")
    page.until(channel, lambda data: _state(data, PLANNER) == "inactive")
    page.ok("command", system="/pipeline", command="resume")
    page.until(channel, lambda data: _state(data, PLANNER) == "active")


def test_plan_source_and_drift(page: Browser) -> None:
    steps = page.ok("plan")["steps"]
    assert [step["number"] for step in steps] == list(range(1, 7))
    assert any(PLANNER in step["cause"] or step["after"] for step in steps)
    names = {"/sensor_data", "/plan_trajectory"}

    def has_endpoints(node: Any) -> bool:  # they are discovered one after the other
        return {end["name"] for end in node["endpoints"]} >= names

    node = page.ok_when(has_endpoints, "node", node=PLANNER)
    assert "planner: {type: planner" in node["source"]["text"]
    page.ok("set_parameter", node=PLANNER, name="max_velocity", value=2.0)
    expected = {("wrong parameter", PLANNER), ("extra node", TALKER)}

    def has_drifted(found: Any) -> bool:
        return expected <= {(item["kind"], item["node"]) for item in found["differences"]}

    page.ok_when(has_drifted, "drift")
    page.ok("set_parameter", node=PLANNER, name="max_velocity", value=1.0)
    assert page.error("node", node="/missing")["code"] == "not_found"


def test_parameters_are_changed_and_refused(page: Browser) -> None:
    channel = page.subscribe("parameters", node=PLANNER)
    data = page.until(channel, bool)
    found = {item["name"]: item for item in data["parameters"]}["max_velocity"]
    assert (found["type"], found["unit"], found["minimum"]) == ("double", "m/s", 0.01)
    assert page.ok("set_parameter", node=PLANNER, name="max_velocity", value=3) == {"value": 3.0}
    page.until(
        channel,
        lambda data: (
            {"max_velocity": 3.0}.items()
            <= {item["name"]: item["value"] for item in data["parameters"]}.items()
        ),
    )
    refused = page.error("set_parameter", node=PLANNER, name="max_velocity", value=99)
    assert refused["code"] == "rejected"
    assert "max_velocity" in refused["message"]
    wrong = page.error("set_parameter", node=PLANNER, name="max_velocity", value="fast")
    assert wrong["code"] == "rejected"
    page.ok("set_parameter", node=PLANNER, name="max_velocity", value=1.0)
    other = page.until(page.subscribe("parameters", node=TALKER), bool)
    assert {"speed", "gains"} <= {item["name"] for item in other["parameters"]}


def test_topics_have_endpoints_and_figures(page: Browser) -> None:
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


def test_a_topic_is_echoed_at_a_limited_rate(page: Browser) -> None:
    channel = page.subscribe("echo", topic="/sensor_data", fields=["pose.pose"], max_hz=5)
    data = page.until(channel, lambda data: data["messages"])
    assert set(data["messages"][0]["value"]["pose.pose"]) == {"position", "orientation"}
    page.wait(lambda: any(update["dropped"] > 5 for update in page.updates))
    latched = page.until(page.subscribe("echo", topic="/lab/text"), lambda data: data["messages"])
    assert latched["messages"][0]["value"] == {"data": "x" * 200}
    assert page.failure(page.subscribe("echo", topic="/nothing"))["code"] == "not_found"
    wrong = page.subscribe("echo", topic="/sensor_data", fields=["pose.poze"])
    assert page.failure(wrong) == {
        "code": "bad_request",
        "message": "'pose.poze': there is no field 'poze'",
        "hint": "did you mean 'pose'?",
    }


def test_plotted_values_are_those_published(page: Browser) -> None:
    channel = page.subscribe("plot", series=[{"topic": "/lab/count", "field": "data"}])

    def values() -> list[int]:
        return [
            value
            for update in page.updates
            if update["sub"] == channel and "data" in update
            for value in update["data"]["series"][0]["values"]
        ]

    def has_all_of_sixty() -> bool:
        """Return whether nothing is missing; a process that does not run misses some."""
        last = values()[-60:]
        return len(last) == 60 and last == list(range(last[0], last[0] + 60))

    page.wait(has_all_of_sixty)
    assert values() == sorted(set(values()))
    text = page.subscribe("plot", series=[{"topic": "/lab/text", "field": "data"}])
    assert "is not a number" in page.failure(text)["message"]


def test_messages_are_published(page: Browser) -> None:
    page.until(
        page.subscribe("topics"),
        lambda data: any(
            item["name"] == "/lab/in" and item["subscriptions"] for item in data.get("topics", ())
        ),
    )
    echo = page.subscribe("echo", topic="/lab/received")
    message = {"topic": "/lab/in", "type": "std_msgs/msg/String", "message": {"data": "hello {x}"}}
    assert page.ok("publish", **message) == {"subscriptions": 1}
    page.until(
        echo,
        lambda data: {"data": "hello {x}"} in [item["value"] for item in data["messages"]],
    )
    repeated = page.subscribe("publishing", **message, rate_hz=50)
    page.until(repeated, lambda data: data["count"] > 20 and data["subscriptions"] == 1)
    page.ok("unsubscribe", sub=repeated)
    wrong = page.error("publish", **(message | {"message": {"data": 5}}))
    assert "data takes a string" in wrong["message"]


def test_a_service_is_called(page: Browser) -> None:
    channel = page.subscribe("services")
    data = page.until(
        channel, lambda data: {"/lab/add"} <= {item["name"] for item in data["services"]}
    )
    hidden = ("get_parameters", "/pipeline/manager/")
    assert not any(part in item["name"] for item in data["services"] for part in hidden)
    everything = page.subscribe("services", hidden=True)
    page.until(everything, lambda data: all(part in str(data["services"]) for part in hidden))
    reply = page.ok("call", service="/lab/add", request={"data": True})
    assert reply["response"] == {"success": True, "message": "switched"}
    plan = {"start": {"x": 0.0}, "goal": {"x": 1.0}, "max_velocity": 0.5}
    planned = page.ok("call", service="/plan_trajectory", request=plan)["response"]
    assert planned["success"]
    assert math.isclose(planned["path"]["poses"][-1]["pose"]["position"]["x"], 1.0)
    missing = page.error(
        "call", service="/missing", type="std_srvs/srv/SetBool", request={}, timeout_s=0.3
    )
    assert missing["code"] == "no_response"
    wrong = page.error("call", service="/lab/add", request={"dat": True})
    assert wrong["hint"] == "did you mean 'data'?"


def test_goals_are_followed_canceled_and_rejected(page: Browser) -> None:
    def send(velocity: float) -> int:
        goal = {"target": {"x": 1.0}, "max_velocity": velocity}
        return page.subscribe("goal", action="/lab/navigate", goal=goal)

    finished = page.until(send(1.0), lambda data: data["status"] == "succeeded")
    assert finished["result"]["distance_traveled"] == 2.5
    endless = send(-1.0)
    page.until(endless, lambda data: data["status"] == "executing" and data["feedback"])
    page.ok("cancel", sub=endless)
    assert page.until(endless, lambda data: data["status"] == "canceled")["result"]["message"]
    assert page.failure(send(0.0))["code"] == "rejected"


def test_the_log_is_filtered(page: Browser) -> None:
    everything = page.subscribe("log", level="debug")
    page.until(everything, lambda data: data["lines"])
    some = page.subscribe("log", text="driving to", node="motor")
    lines = page.until(some, lambda data: data["lines"])["lines"]
    assert all("driving to" in line["text"] and line["node"] == CONTROLLER for line in lines)


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
        wait_until(lambda: last_records(run, 10_000)[-1].message.startswith("1 of 1 nodes active"))
        channel = page.subscribe("log", node="/silent")
        (line,) = page.until(channel, lambda data: data["lines"])["lines"]
        assert (line["level"], line["text"]) == ("info", "before the page")


def test_timings_have_histograms(page: Browser) -> None:
    channel = page.subscribe("timing")

    def control_of(data: Any) -> Any:
        callbacks = data["systems"][0]["callbacks"] if data["systems"] else []
        found = {(item["node"], item["name"]): item for item in callbacks}
        return found.get((CONTROLLER, "control"), {})

    data = page.until(channel, lambda data: (control_of(data).get("calls_hz") or 0) > 20)
    control = control_of(data)
    assert sum(count for _, count in control["histogram"]) == control["count"]
    bounds = [bound for bound, _ in control["histogram"]]
    assert bounds == sorted(bounds)


def test_forms_and_types(page: Browser) -> None:
    form = page.ok("form", type="composer_interfaces/srv/PlanTrajectory")["parts"]["request"]
    assert [field["name"] for field in form] == ["start", "goal", "max_velocity"]
    assert "nav_msgs/msg/Odometry" in page.ok("types", kind="message", prefix="odom")["names"]
    expected = ["nav_msgs/msg/Odometry"]
    page.ok_when(
        lambda found: found["types"] == expected, "type_of", kind="topic", name="/sensor_data"
    )
    assert "angle_min" in page.ok("fields", type="sensor_msgs/msg/LaserScan")["numeric"]
