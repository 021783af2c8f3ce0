"""Programs in C++, built against the ROS wheels: a plain node and a lifecycle node."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from lifecycle_msgs.srv import GetState

from composer.runtime.supervision.events import NodeFailed, Restarted
from tests.ros.support.in_process import Peer, running, wait_until

SOURCES = Path(__file__).parents[1] / "programs" / "native"
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(
        shutil.which("cmake") is None and not os.environ.get("CI"), reason="CMake is not installed"
    ),
]
ROBOT = """
system: robot
namespace: robot
lifecycle: {on_failure: restart, restart: {backoff_ms: 50}}
nodes:
  camera:
    executable: {package: native_nodes, name: lifecycle_node, lifecycle: managed}
    publishers: {words: {type: std_msgs/msg/String}}
  driver:
    executable: {package: native_nodes, name: plain_node}
    publishers: {words: {type: std_msgs/msg/String}}
    lifecycle: {depends_on: [camera]}
  listener:
    lifecycle: {depends_on: [driver]}
    subscriptions: {words: {type: std_msgs/msg/String, log: "{message.data}"}}
connections:
  - {topic: /words, from: [driver.words, camera.words], to: listener.words}
"""


@pytest.fixture(scope="module")
def prefix(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """The package ``native_nodes``, built and installed in a prefix of its own."""
    folder = tmp_path_factory.mktemp("native")
    prefix = folder / "prefix"
    settings = (f"-DROS_PREFIX={sys.prefix}", f"-DCMAKE_INSTALL_PREFIX={prefix}")
    for command in (
        ("cmake", "-S", str(SOURCES), "-B", str(folder), *settings),
        ("cmake", "--build", str(folder)),
        ("cmake", "--install", str(folder)),
    ):
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stdout + done.stderr
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("AMENT_PREFIX_PATH", f"{prefix}{os.pathsep}{sys.prefix}")
        yield prefix


def test_native_nodes_with_our_own(prefix: Path, tmp_path: Path, peer: Peer) -> None:
    with running(ROBOT, tmp_path) as system:
        active = [text for text in system.states() if text.endswith(" active")]
        assert active == [
            "/robot/camera active",
            "/robot/driver active",
            "/robot/listener active",
        ]
        for text in ("I am /robot/camera", "I am /robot/driver", "plain", "managed"):
            system.wait_for_log(text)
        assert peer.change("/robot/camera", "deactivate")
        wait_until(lambda: system.node("camera").state == "inactive", "the state")
        assert peer.change("/robot/camera", "activate")
        wait_until(lambda: system.node("camera").state == "active", "the state")

        for round_, name in enumerate(("driver", "camera"), 1):
            node = system.node(name)
            os.kill(node.pid, signal.SIGKILL)
            wait_until(lambda n=round_: len(system.reported(NodeFailed)) == n, "the fault")
            failed = system.reported(NodeFailed)[-1]
            assert failed.nodes == (node.full_name,)
            assert failed.reason == "its process was ended by SIGKILL"  # and not its DDS lease
            wait_until(lambda: system.node("listener").state == "inactive", "the pause")
            wait_until(lambda n=round_: len(system.reported(Restarted)) == n, "the restart")
            wait_until(lambda: system.node("listener").state == "active", "the end of the pause")
        response = peer.call(GetState, "/robot/camera/get_state")
        assert response.current_state.label == "active"
        pids = [system.node(name).pid for name in ("driver", "camera")]
        assert system.stop().exit_code == 0
    wait_until(lambda: not any(Path("/proc", str(pid)).exists() for pid in pids), "their end")
