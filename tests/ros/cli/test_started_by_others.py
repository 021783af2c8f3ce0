"""Systems that others start: systemd by the units of two processes, and launch files."""

from __future__ import annotations

import os
import shlex
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path

import pytest

from composer.runtime.process.instance_lock import local_systems
from tests.ros.support.commands import PATIENCE_S, compose, output_of
from tests.ros.support.in_process import wait_until

SYSTEM = """\
system: robot
namespace: fleet
processes: {ears: {nodes: [listener, spare], environment: {MODE: "a b"}}}
nodes:
  talker:
    publishers: {chatter: {type: std_msgs/msg/String, qos: command}}
    timers: {tick: {period_ms: 100, publish: {chatter: {data: hello}}}}
    lifecycle: {depends_on: [listener]}
  listener:
    subscriptions: {chatter: {type: std_msgs/msg/String, qos: command}}
  spare: {on_configure: {log: ready}, lifecycle: {autostart: inactive}}
"""


class Service:
    """A service: its process, and what it reports to its service manager.

    It has the variables of its unit and what systemd sets, not the variables of a shell.
    """

    def __init__(self, unit: Path, folder: Path) -> None:
        lines = unit.read_text().splitlines()
        settings = [line.split("=", 1) for line in lines if "=" in line]
        (command,) = (value for name, value in settings if name == "ExecStart")
        variables = (shlex.split(value)[0] for name, value in settings if name == "Environment")
        self.address = folder / unit.stem
        self.messages = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        self.messages.bind(str(self.address))
        self.messages.settimeout(PATIENCE_S)
        environment = dict(variable.split("=", 1) for variable in variables)
        environment |= {name: os.environ[name] for name in ("PATH", "HOME")}
        environment["NOTIFY_SOCKET"] = str(self.address)
        self.process = subprocess.Popen(
            shlex.split(command), env=environment, stderr=subprocess.PIPE, text=True
        )

    def wait_for(self, message: str) -> None:
        while message not in self.messages.recv(1000).decode().splitlines():
            pass

    def stop(self) -> int:
        self.process.send_signal(signal.SIGTERM)
        self.wait_for("STOPPING=1")
        return self.process.wait(PATIENCE_S)


@contextmanager
def started(unit: Path, folder: Path) -> Iterator[Service]:
    service = Service(unit, folder)
    try:
        yield service
    finally:
        service.process.kill()
        service.process.communicate()
        service.messages.close()
        service.address.unlink()


def is_ready(system: str) -> bool:
    return compose("ps", system, "--ready").returncode == 0


def wait_until_ready(system: str) -> None:
    wait_until(lambda: is_ready(system), f"{system} to be ready")


def test_services_become_ready_obey_commands_and_stop_in_order(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # Commands run as in a shell of a login session.
    monkeypatch.setenv("XDG_RUNTIME_DIR", f"/run/user/{os.geteuid()}")
    file, units = tmp_path / "robot.yaml", tmp_path / "units"
    file.write_text(SYSTEM)
    done = compose("export", "systemd", file, "-o", units)
    assert done.returncode == 0, done.stderr
    with started(units / "robot-ears.service", tmp_path) as ears:
        ears.wait_for("READY=1")
        assert not is_ready("/fleet/robot/ears")  # nothing has brought its nodes up
        with started(units / "robot.service", tmp_path) as robot:
            robot.wait_for("READY=1")
            wait_until_ready("/fleet/robot")
            wait_until_ready("/fleet/robot/ears")  # although one of its nodes is to be inactive
            robot.wait_for("WATCHDOG=1")
            assert compose("ps").stdout.count("/fleet/listener") == 1
            for options, name in (((), ""), (("--process", "ears"), "/ears")):
                second = compose("run", file, *options)
                assert second.returncode == 1
                assert f"system '/fleet/robot{name}' already runs in ROS domain" in second.stderr
                assert "shutting down" not in second.stderr  # it has not started anything
            assert is_ready("/fleet/robot")
            assert robot.stop() == 0
        wait_until(lambda: not is_ready("/fleet/robot/ears"), "the nodes to be brought down")
        with started(units / "robot.service", tmp_path) as robot:
            wait_until_ready("/fleet/robot")
            assert compose("down", "/fleet/robot").returncode == 0
            assert robot.process.wait(PATIENCE_S) == 0
        assert ears.stop() == 0


needs_launch = pytest.mark.skipif(find_spec("launch_ros") is None, reason="needs launch_ros")

LAUNCH = """
import sys
import launch
from launch.actions import GroupAction, IncludeLaunchDescription
from launch.launch_description_sources import AnyLaunchDescriptionSource
from launch_ros.actions import PushRosNamespace

source = AnyLaunchDescriptionSource(sys.argv[1])
include = IncludeLaunchDescription(source, launch_arguments=[("namespace", sys.argv[2])])
service = launch.LaunchService(argv=sys.argv[2:])
service.include_launch_description(
    launch.LaunchDescription([GroupAction([PushRosNamespace("fleet"), include])])
)
sys.exit(service.run())
"""


@contextmanager
def launched(folder: Path) -> Iterator[subprocess.Popen[str]]:
    """Run the exported launch file until the system is up."""
    file = folder / "talker.launch.py"
    output_of("export", "launch", "systems/talker_listener.yaml", "-o", file)
    process = subprocess.Popen(
        [sys.executable, "-c", LAUNCH, file, "robot1"],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        start_new_session=True,
        env={**os.environ, "ROS_LOG_DIR": str(folder / "log")},
    )
    try:
        assert process.stdout is not None
        lines = []
        for line in process.stdout:
            lines.append(line)
            if "2 of 2 nodes active" in line:
                break
        assert "/fleet/robot1/talker active" in "".join(lines)
        yield process
    finally:
        process.kill()
        process.wait()


@needs_launch
def test_ctrl_c_shuts_the_system_down_in_order(tmp_path: Path) -> None:
    with launched(tmp_path) as process:
        os.killpg(process.pid, signal.SIGINT)
        output, _ = process.communicate(timeout=60.0)
    assert process.returncode == 0
    assert "shutting down: SIGINT" in output
    assert "/fleet/robot1/talker finalized" in output
    assert "process has finished cleanly" in output


@needs_launch
def test_the_system_ends_with_a_killed_launch(tmp_path: Path) -> None:
    with launched(tmp_path) as process:
        assert "/fleet/robot1/talker_listener" in local_systems()
        process.kill()
        wait_until(lambda: not local_systems(), "the system has ended")
