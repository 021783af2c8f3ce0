"""A system that sends large messages has a shared memory segment in which they fit."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from sensor_msgs.msg import Image

from composer.runtime.middleware.shared_memory import LARGE_SEGMENT_BYTES
from tests.ros.support.commands import compose, running
from tests.ros.support.in_process import Peer, wait_until

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
