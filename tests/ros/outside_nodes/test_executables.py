"""Executables as nodes of a system: Python programs as users have them, unmodified."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from lifecycle_msgs.msg import State, TransitionEvent
from lifecycle_msgs.srv import GetState
from std_msgs.msg import String

from composer.runtime.host_options import HostOptions
from composer.runtime.supervision.events import (
    BroughtUp,
    NodeFailed,
    Restarted,
    RollingBack,
    StateChanged,
)
from tests.ros.members.split_robot import alive, pid_of
from tests.ros.support.in_process import Peer, running, wait_until

PROGRAMS = Path(__file__).parents[1] / "programs"
DRIVER = f"[{sys.executable}, {PROGRAMS / 'driver.py'}]"
MANAGED = f"[{sys.executable}, {PROGRAMS / 'managed_driver.py'}]"
ROBOT = f"""
system: robot
namespace: robot
lifecycle: {{on_failure: restart, restart: {{backoff_ms: 100}}}}
nodes:
  driver:
    namespace: left
    executable: {{command: {DRIVER}, arguments: [--fast, 3], ready_timeout_ms: 30000}}
    parameters:
      rate: {{type: double, default: 50}}
      gains: {{type: double_array, default: [1, 2.5]}}
      label: {{type: string, default: "007"}}
    remappings: {{~/echo: /echo}}
    publishers:
      words: {{type: std_msgs/msg/String}}
      echo: {{type: std_msgs/msg/String, topic: ~/echo, external: true}}
    subscriptions: {{orders: {{type: std_msgs/msg/String, external: true}}}}
    services: {{reset: {{type: std_srvs/srv/Trigger}}}}
    action_servers: {{navigate: {{type: composer_interfaces/action/Navigate}}}}
  camera:
    executable: {{command: {MANAGED}, lifecycle: managed, ready_timeout_ms: 30000}}
    publishers: {{words: {{type: std_msgs/msg/String}}}}
  listener:
    lifecycle: {{depends_on: [driver, camera]}}
    subscriptions:
      words: {{type: std_msgs/msg/String, log: "{{message.data}}"}}
connections:
  - {{topic: /words, from: [driver.words, camera.words], to: listener.words}}
  - {{service: /reset_driver, server: driver.reset}}
  - {{action: /drive, server: driver.navigate}}
"""


def printed_by(*words: str) -> str:
    """Return what the driver prints about itself, started with ``words`` as ``ros2 run`` would.

    Not forked: it leaves the ROS graph at its end, which the tests look at.
    """
    process = subprocess.Popen(
        [sys.executable, PROGRAMS / "driver.py", *words],
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
    )
    try:
        assert process.stdout is not None
        return process.stdout.readline().strip()
    finally:
        process.send_signal(signal.SIGINT)
        process.wait(60)


def test_up_and_down_in_order_with_names_and_parameters(tmp_path: Path, peer: Peer) -> None:
    with running(ROBOT, tmp_path) as system:
        states = [text for text in system.states() if text.endswith(" active")]
        assert states[-1] == "/robot/listener active"
        assert len(states) == 3
        pids = [pid_of(system, name) for name in ("driver", "camera")]

        by_hand = printed_by(
            *("--fast", "3", "--ros-args", "-r", "__node:=driver", "-r", "__ns:=/robot/left"),
            *("-r", "words:=/words", "-r", "~/echo:=/echo", "-r", "reset:=/reset_driver"),
            *("-p", "rate:=50.0", "-p", "gains:=[1.0,2.5]", "-p", "label:='007'"),
            *("--log-level", "info"),
        )
        assert "/words /echo /reset_driver" in by_hand
        wait_until(lambda: by_hand in system.log(), "a line of stdout")
        wait_until(lambda: "ready" in system.log(), "a line of its logger, without level and name")
        system.wait_for_log("tick")
        system.wait_for_log("managed")
        known = [str(pid) for pid in (*pids, os.getpid())]
        wait_until(lambda: [node.pid for node in system.report().nodes] == known, "the processes")
        rates = [(node.sent_hz, node.received_hz) for node in system.report().nodes[:2]]
        assert rates == [(None, None), (None, None)]  # not 0: they are not known

        # As other ROS nodes see it.
        echoed = peer.listen(String, "/echo")
        orders = peer.publisher(String, "/robot/left/orders")
        orders.publish(String(data="go"))
        wait_until(lambda: [message.data for message in echoed] == ["go"], "the echo")
        wait_until(lambda: "/drive/_action/send_goal" in services(peer), "the action")
        assert "/robot/left/navigate/_action/send_goal" not in services(peer)
        outcome = system.stop()
    assert outcome.exit_code == 0
    wait_until(lambda: not any(map(alive, pids)), "the end of the processes")
    downs = [text for text in system.states() if not text.endswith(" active")]
    assert downs.index("/robot/listener unconfigured") < downs.index("/robot/camera finalized")


def services(peer: Peer) -> set[str]:
    return {name for name, _ in peer.node.get_service_names_and_types()}


def test_external_transitions_and_the_restart_of_killed_processes(
    tmp_path: Path, peer: Peer
) -> None:
    with running(ROBOT, tmp_path) as system:
        pid = pid_of(system, "camera")
        changes = len(system.states("/robot/camera"))
        forged = peer.publisher(TransitionEvent, "/robot/camera/transition_event")
        active = State(label="active")
        for label in ("finalized", "unconfigured", "inactive", "no state"):
            forged.publish(TransitionEvent(start_state=active, goal_state=State(label=label)))
        assert peer.change("/robot/camera", "deactivate")
        wait_until(lambda: system.states("/robot/camera")[changes:], "the report of the state")
        # Events that the node does not confirm move nothing.
        assert system.states("/robot/camera")[changes:] == ["/robot/camera inactive"]
        assert peer.change("/robot/camera", "activate")
        wait_until(lambda: system.node("camera").state == "active", "the state")
        system.change("camera", "deactivate", "cleanup")
        wait_until(lambda: not alive(pid), "the end of the process")
        system.change("camera", "configure", "activate")
        response = peer.call(GetState, "/robot/camera/get_state")
        assert response.current_state.label == "active"
        assert pid_of(system, "camera") != pid
        assert not system.reported(NodeFailed)

        # Dependents pause until a killed process is restarted.
        for number, name in enumerate(("driver", "camera"), 1):
            full_name = system.node(name).full_name
            os.kill(pid_of(system, name), signal.SIGKILL)
            failed = system.wait_for_failure(full_name)
            # Noticed by the end of the process: it is in the ROS graph for another 20 s.
            assert failed.reason == "its process was ended by SIGKILL"
            assert failed.consequence == "restart 1 in 0.1 s"
            wait_until(lambda n=number: len(system.reported(Restarted)) == n, "the restart")
            for node in ("driver", "camera", "listener"):
                wait_until(lambda node=node: system.node(node).state == "active", node)
            changes = system.states("/robot/listener")
            assert changes[-2:] == ["/robot/listener inactive", "/robot/listener active"]


def test_a_process_that_ignores_signals_is_killed_in_time(tmp_path: Path) -> None:
    text = f"""
system: robot
nodes:
  driver:
    executable: {{command: {DRIVER}, arguments: [--stubborn], sigterm_timeout_ms: 60000}}
    publishers: {{words: {{type: std_msgs/msg/String, external: true}}}}
"""
    with running(text, tmp_path, options=HostOptions(stop_within_s=10.0)) as system:
        pid = pid_of(system, "driver")
        began_s = time.monotonic()
        outcome = system.stop()
        assert time.monotonic() - began_s < 30.0
    wait_until(lambda: not alive(pid), "the end of the process")
    assert outcome.exit_code == 0


FAILING = """
system: robot
nodes:
  first: {on_activate: {log: first is active}}
  second:
    executable: EXECUTABLE
    PORTS
    lifecycle: {depends_on: [first]}
"""


@pytest.mark.parametrize(
    ("executable", "ports", "reason"),
    [
        ("{command: [sh, -c, exit 3]}", "", "activate failed: its process exited with status 3"),
        ("{command: [/nowhere/x]}", "", "configure failed: there is no program '/nowhere/x'"),
        (
            f"{{command: {MANAGED}, lifecycle: managed}}",
            "parameters: {refuse: {type: string, default: activate}}",
            "activate failed: its service reports a failure; it is inactive",
        ),
        (
            f"{{command: {MANAGED}, lifecycle: managed}}",
            "parameters: {refuse: {type: string, default: exit}}",
            "activate failed: its process exited with status 4",
        ),
        ("{command: [sh, -c, exit 5], kind: task}", "", "its process exited with status 5"),
        (
            "{command: [sh, -c, sleep 60], kind: task, ready_timeout_ms: 300}",
            "",
            "activate failed: still running after 0.3 s",
        ),
    ],
)
def test_failed_starts_are_rolled_back(
    executable: str, ports: str, reason: str, tmp_path: Path
) -> None:
    text = FAILING.replace("EXECUTABLE", executable).replace("PORTS", ports)
    with running(text, tmp_path, options=HostOptions(all_or_nothing=True)) as system:
        outcome = system.end()
    assert outcome.exit_code == 1
    assert reason in str(system.reported(RollingBack)[0])
    assert system.states("/first")[-2:] == ["/first unconfigured", "/first finalized"]
    assert not system.reported(BroughtUp)


#: It names its node itself, as a launch file would.
NAMED = (
    f"[sh, -c, '{sys.executable} {PROGRAMS / 'driver.py'} --ros-args"
    " -r __node:=c -r __ns:=/a/b $@; true', sh]"
)


def test_nodes_and_endpoints_that_do_not_appear_are_named(tmp_path: Path) -> None:
    text = f"""
system: robot
nodes:
  lacking:
    executable: {{command: {DRIVER}, ready_timeout_ms: 8000}}
    publishers: {{other: {{type: std_msgs/msg/String, external: true}}}}
  named: {{executable: {{command: {NAMED}, ready_timeout_ms: 8000}}}}
"""
    with running(text, tmp_path) as system:
        lacking, named = (system.wait_for_failure(node).reason for node in ("/lacking", "/named"))
        assert lacking == "activate failed: it has no publisher /other after 8 s"
        hint = "graph after 8 s; there is /a/b/c instead: write 'name: c' and 'namespace: /a/b'"
        assert hint in named


#: It exits with status 0 on SIGTERM, always.
ENDS_PROPERLY = (
    f'[sh, -c, "{sys.executable} {PROGRAMS / "driver.py"} $@ &'
    " trap 'kill -9 $!; exit 0' TERM; wait\", sh]"
)


@pytest.mark.parametrize(
    ("signal_number", "policy"),
    [
        (signal.SIGTERM, "shutdown"),
        (signal.SIGKILL, "shutdown"),
        (signal.SIGKILL, "isolate"),
        (None, "isolate"),
    ],
)
def test_the_end_of_a_program_and_the_exit_code(
    signal_number: signal.Signals | None, policy: str, tmp_path: Path
) -> None:
    """The run has not failed if the program has ended by itself with exit status 0."""
    command = "[sh, -c, exit 0]" if signal_number is None else ENDS_PROPERLY
    text = f"""
system: robot
nodes:
  base: {{}}
  viewer: {{executable: {{command: {command}}}, lifecycle: {{on_failure: {policy}}}}}
"""
    with running(text, tmp_path) as system:
        if signal_number is not None:
            os.kill(pid_of(system, "viewer"), signal_number)
        failed = system.wait_for_failure("/viewer")
        outcome = system.stop() if policy == "isolate" else system.end()
    is_finished = signal_number is not signal.SIGKILL
    assert failed.is_finished == is_finished
    assert outcome.exit_code == (0 if is_finished else 1)
    assert not system.reported(RollingBack)
    condition = "finished" if is_finished else "isolated"
    remark = f"/viewer is {condition}: {failed.reason}"
    assert outcome.remarks == ((remark,) if policy == "isolate" else ())


def test_a_program_that_hangs_in_its_configuration_holds_up_only_its_dependents(
    tmp_path: Path,
) -> None:
    text = f"""
system: robot
nodes:
  driver:
    executable: {{command: {MANAGED}, lifecycle: managed, sigterm_timeout_ms: 100}}
    parameters: {{refuse: hang in configure}}
    required: false
    lifecycle: {{timeout_ms: 1500}}
  base: {{}}
  user: {{lifecycle: {{depends_on: [driver]}}}}
  viewer: {{class: "viewer:Viewer", lifecycle: {{depends_on: [driver]}}}}
"""
    with running(text, tmp_path, viewer="") as system:
        assert [str(event) for event in system.reported(StateChanged)] == [
            "/base inactive",
            "/base active",
        ]
        failed = system.wait_for_failure("/driver")
        assert "within 1.5 s; its process was ended" in failed.reason
        wait_until(lambda: system.node("user").state == "inactive", "the configuration")
        assert system.node("viewer").state == "unconfigured"
        assert system.stop().exit_code == 0


def test_a_task_is_done_before_its_dependents_start(tmp_path: Path) -> None:
    text = """
system: robot
nodes:
  calibrate:
    executable: {command: [sh, -c, "echo calibrated > result"], kind: task}
  arm: {lifecycle: {depends_on: [calibrate]}, on_configure: {log: arm}}
"""
    with running(text, tmp_path) as system:
        assert tmp_path.joinpath("result").read_text(encoding="utf-8") == "calibrated\n"
        changes = [event.node for event in system.reported(StateChanged)][-2:]
        assert changes == ["/calibrate", "/arm"]
        assert system.node("calibrate").state == "active"
        assert not system.reported(NodeFailed)


TWO_NODES = f"""
system: robot
use_sim_time: true
parameter_files: [robot.yaml]
nodes:
  robot:
    executable: {{command: [{sys.executable}, {PROGRAMS / "two_nodes.py"}]}}
    parameters: {{port: /dev/ttyACM0}}
"""
PARAMETERS = """
base: {ros__parameters: {opencr: {id: 200}}}
/drive/wheels: {ros__parameters: {radius: 0.5, port: other}}
robot: {ros__parameters: {renamed: true}}
"""


@pytest.mark.parametrize(("nodes", "name"), [("[base, drive/wheels]", "base"), ("[]", "robot")])
def test_a_program_keeps_the_names_of_its_nodes(
    nodes: str, name: str, tmp_path: Path, peer: Peer
) -> None:
    (tmp_path / "robot.yaml").write_text(PARAMETERS, encoding="utf-8")
    with running(TWO_NODES.replace(".py]", f".py], nodes: {nodes}"), tmp_path) as system:
        port = '"port": "/dev/ttyACM0", '
        system.wait_for_log(f'/base {{"opencr.id": 200, {port}"use_sim_time": true}}')
        wheels = '{"port": "other", "radius": 0.5, "use_sim_time": true}'
        system.wait_for_log(f"/drive/wheels {wheels}")
        names = {("base", "/"), ("wheels", "/drive")}
        wait_until(lambda: names <= set(peer.node.get_node_names_and_namespaces()), "both nodes")
        assert system.states()[-1] == f"/{name} active"


def test_several_nodes_with_the_name_of_the_entry_are_reported(tmp_path: Path) -> None:
    (tmp_path / "robot.yaml").write_text(PARAMETERS, encoding="utf-8")
    with running(TWO_NODES, tmp_path) as system:
        system.wait_for_log('"port": "/dev/ttyACM0", "renamed": true, "use_sim_time": true}')
        system.wait_for_log("its program creates 2 nodes, and all of them are named 'robot'")
