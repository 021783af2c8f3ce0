"""Components in a container: a real process, which serves composition_interfaces."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path

import pytest
from std_msgs.msg import String

from composer.runtime.host_options import HostOptions
from composer.runtime.supervision.events import NodeFailed
from tests.ros.support.commands import output_of
from tests.ros.support.in_process import PATIENCE_S, Peer, RunningSystem, running, wait_until

pytest.importorskip("composition_interfaces", reason="make test builds it")
from composition_interfaces.srv import ListNodes, LoadNode, UnloadNode

PROGRAM = Path(__file__).parents[1] / "programs" / "container.py"
DRIVER = PROGRAM.with_name("driver.py")
CONTAINER = f"container: {{executable: {{command: [{sys.executable}, {PROGRAM}]}}}}"
EXTERNAL = "container: {external: true}"
TALKER = """
  talker:
    namespace: left
    component:
      package: demo
      plugin: demo::Talker
      extra_arguments: {use_intra_process_comms: true}
    container: container
    log_level: warn
    parameters: {text: good morning}
    remappings: {words: /said}
    publishers: {words: {type: std_msgs/msg/String, external: true}}
"""
CAMERA = """
  camera:
    component: {package: demo, plugin: "demo::Camera", lifecycle: managed}
    container: container
    publishers: {words: {type: std_msgs/msg/String, external: true}}
"""
#: In characters; a container may send more.
LONG = 2000
LIST = "/robot/container/_container/list_nodes"


def robot(*nodes: str, container: str = CONTAINER, settings: str = "") -> str:
    return f"system: robot\nnamespace: robot\n{settings}\nnodes:\n  {container}\n{''.join(nodes)}"


def loaded(peer: Peer) -> list[str]:
    return list(peer.call(ListNodes, LIST).full_node_names)


def failures(system: RunningSystem, name: str) -> list[NodeFailed]:
    return [event for event in system.reported(NodeFailed) if name in event.nodes]


def test_up_and_down_in_order_with_names_and_parameters(tmp_path: Path, peer: Peer) -> None:
    with running(robot(TALKER, CAMERA), tmp_path) as system:
        assert sorted(loaded(peer)) == ["/robot/camera", "/robot/left/talker"]
        said = peer.listen(String, "/said")
        wait_until(lambda: said, "a message of the component")
        assert said[0].data == "good morning"
        wait_until(lambda: "talker 30 use_intra_process_comms=True" in system.log(), "its request")
        assert system.node("camera").figures == system.node("container").figures
        assert "# Loaded by /robot/container" in output_of("import", "live", "--node", "camera")

        peer.change("/robot/camera", "deactivate")
        wait_until(lambda: system.node("camera").state == "inactive", "the state of the node")
        system.change("camera", "cleanup")
        assert loaded(peer) == ["/robot/left/talker"]
        system.change("camera", "configure", "activate")
        system.change("talker", "deactivate")
        assert loaded(peer) == ["/robot/camera"]
        outcome = system.stop()
    assert outcome.exit_code == 0
    states = [text for text in system.states() if text.endswith(" active")][:3]
    assert states[0] == "/robot/container active"
    wait_until(lambda: "unloads /robot/camera" in system.log(), "its end before its container's")


@pytest.mark.parametrize(
    "rounds", [2, pytest.param(50, marks=[pytest.mark.soak, pytest.mark.timeout(600)])]
)
def test_load_unload_crash_and_reload(rounds: int, tmp_path: Path, peer: Peer) -> None:
    restart = f"restart: {{max_attempts: {rounds}, backoff_ms: 1}}"
    settings = f"lifecycle: {{on_failure: restart, {restart}}}"
    with running(robot(TALKER, CAMERA, settings=settings), tmp_path) as system:
        for number in range(1, rounds + 1):
            system.change("camera", "deactivate", "cleanup")
            system.change("talker", "deactivate")
            assert not loaded(peer)
            system.change("talker", "activate")
            system.change("camera", "configure", "activate")
            os.kill(int(system.node("container").figures["pid"]), signal.SIGKILL)
            failed = partial(failures, system, "/robot/camera")
            wait_until(lambda: len(failed()) == number, "the fault")  # noqa: B023
            wait_until(lambda: is_active(system, "talker", "camera"), "the same again")
            assert sorted(loaded(peer)) == ["/robot/camera", "/robot/left/talker"]
        assert "has ended" in failures(system, "/robot/left/talker")[0].reason


#: Components, what else their nodes have, and why they fail; ODD is the name of the node.
ODD = (
    ('plugin: "demo::Broken"', "", "cannot load it: Component constructor threw an exception"),
    ('plugin: "demo::Verbose"', "", "threw an exception: no camera"),
    ('plugin: "demo::Talkr"', "", "Failed to find class with the requested plugin name"),
    ('plugin: "demo::Stubborn"', "", "has given it the name /talker"),
    (
        'plugin: "demo::Camera", lifecycle: managed',
        "parameters: {refuse: configure}",
        "its service reports a failure",
    ),
    ('plugin: "demo::Talker", lifecycle: managed', "", "no service /robot/ODD/change_state"),
    (
        'plugin: "demo::Talker"',
        "services: {reset: {type: std_srvs/srv/Trigger, external: true}}",
        "it has no service /robot/reset after 5 s",
    ),
)


def test_failed_loads_say_why_and_leave_nothing(tmp_path: Path, peer: Peer) -> None:
    nodes = [
        f"""
  driver: {{executable: {{command: [{sys.executable}, {DRIVER}]}}}}
  elsewhere:
    required: false
    component: {{package: demo, plugin: "demo::Talker", ready_timeout_ms: 500}}
    container: driver
"""
    ]
    nodes += [
        f"""
  odd_{number}:
    required: false
    component: {{package: demo, {component}, ready_timeout_ms: 5000}}
    container: container
    {more}
"""
        for number, (component, more, _) in enumerate(ODD)
    ]
    with running(robot(*nodes), tmp_path) as system:
        for number, (_, _, reason) in enumerate(ODD):
            name = f"odd_{number}"
            failed = system.wait_for_failure(f"/robot/{name}")
            assert reason.replace("ODD", name) in failed.reason
            assert len(failed.reason) < LONG
            wait_until(lambda name=name: system.node(name).state == "unconfigured", name)
        failed = system.wait_for_failure("/robot/elsewhere")
        assert "/robot/driver has no service /robot/driver/_container/load_node" in failed.reason
        assert loaded(peer) == ["/robot/odd_4"]  # for the next attempt, as a process is


def test_a_container_may_be_slow_with_more_components_than_its_services_queue(
    tmp_path: Path, peer: Peer
) -> None:
    """Next to the request that it answers, a service keeps ten, and drops the others silently."""
    names = [f"talker_{number:02}" for number in range(12)]
    slow = TALKER.replace("demo::Talker", "demo::Slow\n      ready_timeout_ms: 60000")
    nodes = [slow.replace("  talker:", f"  {name}:") for name in names]
    options = HostOptions(stop_within_s=PATIENCE_S)
    with running(robot(*nodes), tmp_path, options=options) as system:
        assert not system.reported(NodeFailed)
        assert sorted(loaded(peer)) == [f"/robot/left/{name}" for name in names]
        assert system.stop().exit_code == 0
    unloaded = {f"unloads /robot/left/{name}" for name in names}
    wait_until(lambda: unloaded <= {*system.log()}, "the end of all before their container's")


def test_external_container(tmp_path: Path, peer: Peer) -> None:
    """It is awaited; what an earlier run has left in it is unloaded; its end and return count."""
    with external_container() as process:
        request = LoadNode.Request(package_name="demo", plugin_name="demo::Talker")
        request.node_name, request.node_namespace = "talker", "/robot/left"
        assert peer.call(LoadNode, "/robot/container/_container/load_node", request).success
        with running(robot(TALKER, CAMERA, container=EXTERNAL), tmp_path) as system:
            assert sorted(loaded(peer)) == ["/robot/camera", "/robot/left/talker"]
            assert "it was loaded already, and is loaded again" in system.log()

            found = peer.call(ListNodes, LIST)
            unload = UnloadNode.Request()
            unload.unique_id = found.unique_ids[found.full_node_names.index("/robot/left/talker")]
            assert peer.call(UnloadNode, LIST.replace("list_nodes", "unload_node"), unload).success
            failed = wait_until(lambda: failures(system, "/robot/left/talker"), "its fault")[0]
            assert "something has unloaded it" in failed.reason

            process.send_signal(signal.SIGINT)
            wait_until(lambda: failures(system, "/robot/camera"), "the fault of the other one")
            process.wait(60)
            with external_container():
                wait_until(lambda: is_active(system, "talker", "camera"), "its return")
                assert sorted(loaded(peer)) == ["/robot/camera", "/robot/left/talker"]
                assert system.stop().exit_code == 0
                wait_until(lambda: not loaded(peer), "nothing is left")


def is_active(system: RunningSystem, *names: str) -> bool:
    return all(system.node(name).state == "active" for name in names)


@contextmanager
def external_container() -> Iterator[subprocess.Popen[bytes]]:
    words = ("--ros-args", "-r", "__ns:=/robot")
    process = subprocess.Popen([sys.executable, PROGRAM, *words], stdout=subprocess.DEVNULL)
    try:
        yield process
    finally:
        process.kill()
        process.wait(60)
