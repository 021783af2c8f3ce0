"""The pipeline over three processes: the same graph and behavior, and every process may die."""

from __future__ import annotations

import json
import os
import random
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, suppress
from pathlib import Path
from typing import Any

import pytest
from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry
from rclpy.qos import QoSPresetProfiles

from composer.client.systems.local_queries import local_report
from composer.plan.drift import ObservedEndpoint
from composer.runtime.process.instance_lock import local_systems
from composer.runtime.ros.endpoints import endpoints, node_names
from composer.runtime.ros.graph import RosGraph, participant
from tests.ros.support.commands import (
    COMPOSE,
    code_of_end,
    compose,
    listed,
    output_of,
    repeated,
    repeated_until,
)
from tests.ros.support.dashboard import browser, dashboard
from tests.ros.support.in_process import wait_until
from tests.ros.support.pipeline import (
    NODES,
    Graph,
    check_a_deactivated_planner,
    check_the_drive,
    check_the_navigation,
    check_the_planner,
    graph_of,
    stable_graph,
)
from tests.ros.support.system_process import REPOSITORY, ExternalNode, RunningSystem

PROCESSES = """
processes:
  sensing: {nodes: [sensor_simulator]}
  planning: {nodes: [planner]}
lifecycle: {on_failure: restart, restart: {backoff_ms: 100, max_attempts: 3, window_ms: 1000}}
"""
CONTROLLER = "{type: motor_controller, "
#: The robot waits for goals.
WAITING = "{type: motor_controller, parameters: {waypoints: []}, "
ROUNDS = 50
SOAK_PATIENCE_S = 120.0  # hundreds of starts, one of them while the computer does something else


def split_file(folder: Path) -> Path:
    path = folder / "pipeline.yaml"
    text = (REPOSITORY / "systems" / "pipeline.yaml").read_text(encoding="utf-8")
    assert CONTROLLER in text
    path.write_text(text.replace(CONTROLLER, WAITING) + PROCESSES, encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return split_file(tmp_path_factory.mktemp("split"))


@pytest.fixture(scope="module")
def one_process(external_context: object, shared_domain_id: int) -> Graph:
    """What the pipeline in one process adds to the ROS graph."""
    observer = ExternalNode(external_context)  # type: ignore[arg-type]
    with RunningSystem("systems/pipeline.yaml") as system:
        system.wait_for("3 of 3 nodes active")
        graph = stable_graph(observer)
    observer.spin_until(lambda: not graph_of(observer.node))
    observer.close()
    return graph


@pytest.fixture(scope="module")
def split(path: Path, one_process: Graph, shared_domain_id: int) -> Iterator[RunningSystem]:
    with RunningSystem(str(path)) as system:
        system.wait_for("3 of 3 nodes active")
        yield system
        assert system.stop()[0] == code_of_end(system.output)
    wait_until(lambda: not processes_of(path), "the end of all processes")


def processes_of(path: Path) -> list[int]:
    """Return the processes that run a part of the system in a file."""
    found: list[int] = []
    for process in Path("/proc").glob("[0-9]*"):
        with suppress(OSError):
            words = (process / "cmdline").read_bytes().split(b"\0")
            if str(path).encode() in words and b"--process" in words:
                found.append(int(process.name))
    return found


def is_up(path: Path) -> bool:
    """Return whether every node is active, and each process runs once."""
    report = local_report("/pipeline", 1.0)
    pids = local_systems()
    return (
        report is not None
        and report.activity == "running"
        and all(node.state == node.desired == "active" for node in report.nodes)
        and pids.keys() == {"/pipeline", "/pipeline/sensing", "/pipeline/planning"}
        and str(os.getpid()) not in pids.values()
        and len(processes_of(path)) == 2
    )


def test_the_ros_graph_is_that_of_one_process(
    split: RunningSystem, one_process: Graph, external: ExternalNode
) -> None:
    external.spin_until(lambda: graph_of(external.node) == one_process)
    assert stable_graph(external) == one_process
    external.spin_until(lambda: all(names_of(external).count(name) == 1 for name in NODES))


def names_of(external: ExternalNode) -> list[str]:
    found = external.node.get_node_names_and_namespaces()
    return [f"{namespace}/{name}" for name, namespace in found]


def participants_of(external: ExternalNode) -> str:
    """Return the participants that have endpoints of the nodes, and which of them still announce.

    Fast DDS has the lower half of the process id in the 5th and 6th byte of the prefix.
    """
    announcing = {prefix.hex() for prefix in RosGraph(external.node).participants()}
    lines = [f"announcing: {sorted(announcing)}"]
    for topic, _ in external.node.get_topic_names_and_types():
        for endpoint in external.node.get_publishers_info_by_topic(topic):
            name, prefix = endpoint.node_name, participant(endpoint)
            pid = int.from_bytes(prefix[4:6], "little")
            lines.append(f"{name} publishes {topic}: {prefix.hex()}, process ...{pid}")
    running = sorted(int(path.name) & 0xFFFF for path in Path("/proc").glob("[0-9]*"))
    return "\n".join([*lines, f"running: {running}"])


def test_it_behaves_as_in_one_process(split: RunningSystem, external: ExternalNode) -> None:
    check_the_navigation(external)
    check_the_planner(external)
    check_a_deactivated_planner(external)
    check_a_drive(external)


def check_a_drive(external: ExternalNode) -> None:
    odometry = external.listen(Odometry, "/sensor_data", QoSPresetProfiles.SENSOR_DATA.value)
    external.spin_until(lambda: bool(odometry))
    start = odometry[-1].pose.pose.position
    commands = external.listen(Twist, "/motor_commands")
    external.spin_until(lambda: bool(commands))
    odometry.clear()
    commands.clear()
    set_waypoints(f"[{start.x + 2.0}, {start.y}]")
    external.spin_until(
        lambda: bool(odometry) and odometry[-1].pose.pose.position.x > start.x + 1.9
    )
    set_waypoints("[]")
    check_the_drive(commands, odometry, line_m=start.y)


def set_waypoints(waypoints: str) -> None:
    listed((), "param", "set", "motor_controller", "waypoints", waypoints)


def check_the_measured_processes(path: Path) -> None:
    """Check that the dashboard measures the process of each node."""
    owners = ("/pipeline/sensing", "/pipeline/planning", "/pipeline")
    with dashboard(str(path)) as server, browser(server.address) as page:

        def is_measured(data: Any) -> bool:
            found = {node["name"]: node for node in data["nodes"]}
            counts = [(item.get("process") or {}).get("processes") for item in data["systems"]]
            usages = [found.get(name, {}).get("usage") or {} for name in NODES]
            return counts == [len(owners)] and all(usage.get("threads") for usage in usages)

        data = page.until(page.subscribe("nodes"), is_measured)
    pids = local_systems()
    found = {node["name"]: node for node in data["nodes"]}
    for name, owner in zip(NODES, owners, strict=True):
        place = [found[name][key] for key in ("system", "host", "pid")]
        assert place == ["/pipeline", socket.gethostname(), pids[owner]]
    assert data["systems"][0]["name"] == "/pipeline"


def check_the_drawn_processes() -> None:
    names = ("/pipeline/sensing", "/pipeline/planning", "/pipeline")
    owners = dict(zip(NODES, names, strict=True)) | {f"{name}/manager": name for name in names}
    found: dict[str, Any] = {}

    def is_whole() -> bool:  # a command that has just started may not know all nodes yet
        words = ("graph", "--live", "--view", "deployment", "-f", "json", "--measure", "0")
        found.update(json.loads(listed((), *words)))
        vertices = {each["key"].removeprefix("node:"): each for each in found["vertices"]}
        return owners.keys() <= vertices.keys() and all(
            vertices[node]["label"] == [node, "active"] for node in NODES
        )

    wait_until(is_whole, "all nodes in the picture")
    clusters = {each["key"].removeprefix("node:"): each["cluster"] for each in found["vertices"]}
    assert {node: clusters[node] for node in owners} == {
        node: f"process:{name}" for node, name in owners.items()
    }
    pids = {f"process:{name}": str(pid) for name, pid in local_systems().items()}
    labels = {frame["key"]: frame["label"] for frame in found["clusters"]}
    assert all(labels[key].endswith(f": process {pid}") for key, pid in pids.items())
    assert f"host:{socket.gethostname()}" in labels


def test_commands_for_the_system_include_all_processes(split: RunningSystem, path: Path) -> None:
    for command, state in (("pause", "inactive"), ("resume", "active"), ("reset", "unconfigured")):
        listed((), "lifecycle", command, "pipeline")
        wait_until(lambda expected={state}: states_of_all() == expected, command)
    listed((), "lifecycle", "startup", "pipeline")
    top = ("top", "pipeline", "--json", "--once")
    assert shows_all_callbacks(repeated_until(shows_all_callbacks, *top))
    for words in (("ps", "--json"), ("ps", "pipeline", "--json")):
        assert lists_all_callbacks(repeated_until(lists_all_callbacks, *words))
    repeated_until(lambda text: [text.count(f"{name} ") for name in NODES] == [1, 1, 1], "ps")
    check_the_drawn_processes()
    check_the_measured_processes(path)
    as_declared = "pipeline: runs as declared\n"
    repeated(lambda done: done.stderr == as_declared, "diff", path)
    listed(("/planning/planner active",), "logs", "--system", "pipeline", "planner")
    assert "subgraph" in output_of("graph", path, "--view", "deployment", "--format", "mermaid")
    for command in (("lifecycle", "restart", "planner"), ("lifecycle", "startup", "pipeline")):
        check_that_a_node_comes_back(path, command)


def shows_all_callbacks(text: str) -> bool:
    """Return whether ``top`` shows the callbacks of all processes, and how often they run."""
    callbacks = json.loads(text)["callbacks"]
    rates = {callback["name"]: callback["calls_hz"] for callback in callbacks}
    # The timer 'step' is in another process.
    step_hz = rates.get("step") or 0.0  # None until it is known
    return {callback["node"] for callback in callbacks} == set(NODES) and step_hz > 5.0


def lists_all_callbacks(text: str) -> bool:
    """Return whether ``ps`` shows the nodes of all processes, with their callbacks."""
    nodes = [
        node
        for system in json.loads(text)["systems"]
        if system["name"] == "/pipeline"
        for node in system.get("nodes", ())
    ]
    processes = dict(zip(NODES, ("sensing", "planning", ""), strict=True))
    return {node["node"]: node["process"] for node in nodes} == processes and all(
        node["callbacks"] for node in nodes
    )


def check_that_a_node_comes_back(path: Path, command: Sequence[str]) -> None:
    """Shut a node of another process down by hand, and let a command bring it up again."""
    pids = local_systems()
    shut_down = ("lifecycle", "set", "planner", "--to", "finalized")
    wait_until(lambda: compose(*shut_down).returncode == 0, "a command that discovers the node")
    wait_until(lambda: "finalized" in states_of_all(), "the report of its state")
    listed((), *command)
    wait_until(lambda: is_up(path), "all nodes")
    assert local_systems() == pids


def states_of_all() -> set[str]:
    report = local_report("/pipeline", 5.0)
    return {node.state for node in report.nodes} if report else set()


def test_killed_processes_are_replaced(
    split: RunningSystem, path: Path, one_process: Graph, external: ExternalNode
) -> None:
    external.spin_until(lambda: graph_of(external.node) == one_process)
    before = endpoints_of_nodes(external)
    for process in ("sensing", "planning"):
        killed = int(local_systems()[f"/pipeline/{process}"])
        os.kill(killed, signal.SIGKILL)
        wait_until(lambda pid=killed: pid not in processes_of(path), "the end")
        wait_until(lambda: is_up(path), "all nodes")
    graph = RosGraph(external.node)
    external.spin_until(lambda: [node_names(graph).count(name) for name in NODES] == [1, 1, 1])
    external.spin_until(lambda: endpoints_of_nodes(external) == before)
    # DDS lists the killed processes for 20 s.
    assert len(names_of(external)) > len(set(names_of(external)))


def endpoints_of_nodes(external: ExternalNode) -> dict[str, tuple[ObservedEndpoint, ...]]:
    return {name: ends for name, ends in endpoints(RosGraph(external.node)) if name in NODES}


@pytest.mark.soak
@pytest.mark.timeout(3600)
@pytest.mark.parametrize("is_alone", [False, True])
def test_any_process_is_killed_fifty_times(
    is_alone: bool, tmp_path: Path, external: ExternalNode, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Recovery by policy; no process is left, and none runs twice.

    A service manager runs each process if it ``is_alone``. Otherwise, the coordinating one starts
    the others.
    """
    monkeypatch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")  # as in COMPOSE
    path = split_file(tmp_path)
    options = {name: ("--process", name) for name in ("sensing", "planning")} if is_alone else {}
    options[""] = ("--await-processes",) if is_alone else ()
    chance = random.Random(22)
    with ExitStack() as stack:

        def start(name: str) -> RunningSystem:
            run = RunningSystem(str(path), *options[name], program=COMPOSE)
            return stack.enter_context(run)

        runs = {name: start(name) for name in options}
        for round_ in range(ROUNDS):
            wait_until(lambda: is_up(path), f"all nodes in round {round_}", SOAK_PATIENCE_S)
            until_s = time.monotonic() + chance.uniform(0.0, 1.0)
            external.spin_until(lambda end_s=until_s: time.monotonic() > end_s)
            name = chance.choice(("", "sensing", "planning"))
            if name in runs:
                runs[name].process.kill()
                runs[name].process.wait()
                runs[name] = start(name)
            else:
                pid = local_systems()[f"/pipeline/{name}"]
                os.kill(int(pid), signal.SIGKILL)
                # Until then, the state before may still be reported.
                wait_until(lambda pid=pid: pid not in local_systems().values(), "its end")
        wait_until(lambda: is_up(path), "all nodes", SOAK_PATIENCE_S)
        graph = RosGraph(external.node)
        try:
            external.spin_until(
                lambda: [node_names(graph).count(name) for name in NODES] == [1, 1, 1]
            )
        except AssertionError as error:
            error.add_note(f"listed: {names_of(external)}\n{participants_of(external)}")
            raise
        for name in sorted(runs):  # the coordinating one first
            assert runs[name].stop()[0] == code_of_end(runs[name].output)
    wait_until(lambda: not processes_of(path), "the end of all processes")


@pytest.mark.soak
@pytest.mark.timeout(1800)
def test_every_example_behaves_as_in_one_process() -> None:
    plugin = ("-p", "tests.ros.support.split_examples")
    folder = Path(__file__).parent
    command = (sys.executable, "-m", "pytest", "-q", *plugin, folder, "--ignore", __file__)
    tests = subprocess.run(command, cwd=REPOSITORY, capture_output=True, text=True, check=False)
    assert tests.returncode == 0, tests.stdout
