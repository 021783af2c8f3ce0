"""The default profile: no extra thread for each message, and memory for large messages."""

from __future__ import annotations

import json
import re
import subprocess
from pathlib import Path

import pytest
from sensor_msgs.msg import Image
from std_msgs.msg import String

from composer.runtime.middleware.shared_memory import LARGE_SEGMENT_BYTES
from tests.ros.support.commands import PYTHON, compose, running
from tests.ros.support.in_process import Peer, wait_until

MESSAGES = 4000
#: Publish to another process, and print how often the timer thread of Fast DDS slept meanwhile.
PUBLISH = f"""
import json, os, sys, time
from pathlib import Path
from composer.runtime.middleware.environment import prepare_environment
prepare_environment()
import rclpy
from std_msgs.msg import String

def sleeps():
    tasks = [task for task in Path("/proc/self/task").iterdir()
             if (task / "comm").read_text().startswith("dds.ev")]
    assert len(tasks) == 1, tasks
    status = dict(line.split(":", 1) for line in (tasks[0] / "status").read_text().splitlines())
    return int(status["voluntary_ctxt_switches"])

rclpy.init()
node = rclpy.create_node("publisher")
publisher = node.create_publisher(String, sys.argv[1], 10)
until_s = time.monotonic() + 30.0
while not publisher.get_subscription_count():
    assert time.monotonic() < until_s, "no subscription"
    time.sleep(0.01)  # poll
before, began_s = sleeps(), time.monotonic()
for number in range({MESSAGES}):
    publisher.publish(String(data=str(number)))
    next_s = time.monotonic() + 0.0002
    while time.monotonic() < next_s:
        pass
print(json.dumps([sleeps() - before, time.monotonic() - began_s]), flush=True)
os._exit(0)
"""


def test_no_thread_wakes_after_each_message(peer: Peer) -> None:
    received: list[String] = []
    peer.node.create_subscription(String, "/texts", received.append, 10)
    done = subprocess.run(
        [*PYTHON, "-c", PUBLISH, "/texts"],
        check=True,
        capture_output=True,
        text=True,
        timeout=60.0,
    )
    assert received
    assert "XML" not in done.stderr + done.stdout  # printed if the profile is invalid
    slept, took_s = json.loads(done.stdout.splitlines()[-1])
    # A few times in 4 ms; by default twice for each of the 5000 messages in a second.
    assert 0 < slept < 2000.0 * took_s


SYSTEM = """
system: camera
nodes:
  sensor:
    timers: {tick: {period_ms: 20, publish: {out: {}}}}
    publishers: {out: {type: %s, external: true}}
"""


def segment_bytes(pid: int) -> list[int]:
    """Return the sizes of the segments of Fast DDS that a process has mapped."""
    maps = Path(f"/proc/{pid}/maps").read_text()
    found = re.findall(r"(?m)^(\w+)-(\w+) .*/dev/shm/fastrtps_[0-9a-f]+$", maps)
    return [int(end, 16) - int(start, 16) for start, end in found]


@pytest.mark.parametrize("discovery_range", ["SUBNET", "LOCALHOST"])
def test_a_system_with_a_camera_has_a_large_segment(
    discovery_range: str, tmp_path: Path, peer: Peer, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", discovery_range)
    path = tmp_path / "camera.yaml"
    path.write_text(SYSTEM % "sensor_msgs/msg/Image", encoding="utf-8")
    with running(tmp_path / "log", str(path)) as system:
        system.wait_for("1 of 1 nodes active")
        assert max(segment_bytes(system.process.pid)) >= LARGE_SEGMENT_BYTES
        received = peer.listen(Image, "/out")
        wait_until(lambda: received, "an image")  # the profile allows discovery and delivery
        assert {"/camera/manager", "/sensor"} <= set(compose("node", "list").stdout.split())
        code, _, log = system.stop()
    assert code == 0
    assert "XMLPARSER" not in log


def test_a_system_with_small_messages_has_a_small_segment(tmp_path: Path) -> None:
    path = tmp_path / "camera.yaml"
    path.write_text(SYSTEM % "sensor_msgs/msg/Range", encoding="utf-8")
    with running(tmp_path / "log", str(path)) as system:
        system.wait_for("1 of 1 nodes active")
        assert 0 < max(segment_bytes(system.process.pid)) < LARGE_SEGMENT_BYTES / 10
