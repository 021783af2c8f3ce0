"""The example systems with topics: minimal, talker_listener, qos_patterns, executors."""

from __future__ import annotations

import re
from pathlib import Path

from rclpy.qos import DurabilityPolicy, QoSPresetProfiles, QoSProfile
from std_msgs.msg import String

from tests.ros.support.system_process import REPOSITORY, ExternalNode, RunningSystem


def test_the_minimal_node_starts(external: ExternalNode) -> None:
    with RunningSystem("systems/minimal.yaml") as system:
        system.wait_for(r"minimal_node.*started")
        external.wait_for_state("/minimal_node", "active")
        code, _ = system.stop()
    assert code == 0


def test_messages_arrive_in_process_and_externally(external: ExternalNode) -> None:
    received = external.listen(String, "/chatter")
    with RunningSystem("systems/talker_listener.yaml") as system:
        external.spin_until(lambda: len(received) >= 3)
        # In-process, no message is lost after the activation of the listener.
        first = int(system.wait_for(r"listener.*Received: Sensor reading \d+$").rpartition(" ")[2])
        for number in range(first, first + 3):
            system.wait_for(rf"listener.*Received: Sensor reading {number}$")
    assert first <= 5
    numbers = [int(message.data.removeprefix("Sensor reading ")) for message in received]
    assert numbers == list(range(numbers[0], numbers[0] + len(numbers)))


def test_talker_listener_is_short_and_without_python() -> None:
    text = (REPOSITORY / "systems" / "talker_listener.yaml").read_text(encoding="utf-8")
    assert len(text.splitlines()) < 25
    assert "behavior" not in text


def test_a_late_joiner_receives_the_state_but_no_old_scans(external: ExternalNode) -> None:
    with RunningSystem("systems/qos_patterns.yaml") as system:
        external.wait_for_state("/robot", "active")
        system.wait_for(r"early_listener.*mode is ready")
        system.wait_for(r"early_listener.*order 1$")
        latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        received = external.listen(String, "/mode", latched)
        external.spin_until(lambda: len(received) == 1)
        assert received[0].data == "ready"
        assert external.state("/late_joiner") == "unconfigured"
        assert external.change_state("/late_joiner", "configure")
        assert external.change_state("/late_joiner", "activate")
        system.wait_for(r"late_joiner.*mode is ready")
        first = system.wait_for(r"late_joiner.*scan \d+")
        # A best-effort subscription is compatible with a reliable publisher.
        system.wait_for(r"late_joiner.*order \d+")
    assert int(re.findall(r"scan (\d+)", first)[0]) > 5


def test_control_stays_on_one_thread_and_perception_uses_several(external: ExternalNode) -> None:
    cycles = external.listen(String, "/control/cycles")
    frames = external.listen(String, "/perception/processed", QoSPresetProfiles.SENSOR_DATA.value)
    with RunningSystem("systems/executors.yaml"):
        external.spin_until(
            lambda: (
                len(cycles) > 100
                and len({message.data.partition(":")[0] for message in frames}) > 1
            )
        )
    assert len({message.data for message in cycles}) == 1


def test_an_inline_node_uses_a_behavior_from_the_folder_of_node_types(tmp_path: Path) -> None:
    system = tmp_path / "systems" / "greeting.yaml"
    behavior = tmp_path / "nodes" / "greeter.py"
    system.parent.mkdir()
    behavior.parent.mkdir()
    system.write_text("system: greeting\nnodes:\n  hello: {behavior: 'greeter:Greeter'}\n", "utf-8")
    behavior.write_text(
        "class Greeter:\n    def on_activate(self):\n        self.log.info('good day')\n", "utf-8"
    )
    with RunningSystem(str(system)) as running:
        running.wait_for(r"hello.*good day")
