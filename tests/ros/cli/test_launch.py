"""Systems in launch files, where launch and launch_ros are installed."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path

import pytest

from composer.runtime.process.instance_lock import local_systems
from tests.ros.support.commands import output_of
from tests.ros.support.in_process import wait_until

pytestmark = pytest.mark.skipif(find_spec("launch_ros") is None, reason="needs launch_ros")

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


def test_ctrl_c_shuts_the_system_down_in_order(tmp_path: Path) -> None:
    with launched(tmp_path) as process:
        os.killpg(process.pid, signal.SIGINT)
        output, _ = process.communicate(timeout=60.0)
    assert process.returncode == 0
    assert "shutting down: SIGINT" in output
    assert "/fleet/robot1/talker finalized" in output
    assert "process has finished cleanly" in output


def test_the_system_ends_with_a_killed_launch(tmp_path: Path) -> None:
    with launched(tmp_path) as process:
        assert "/fleet/robot1/talker_listener" in local_systems()
        process.kill()
        wait_until(lambda: not local_systems(), "the system has ended")
