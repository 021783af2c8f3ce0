"""A mistake in a node or a system fails its scenario, with what is wrong in plain words."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import pytest

from tests.ros.scenarios.conftest import run


class Mistake(NamedTuple):
    """A text in a file, what replaces it, and what the report of the scenario says."""

    file: str
    right: str
    wrong: str
    seen: str


MISTAKES = {
    "late_timer": Mistake(
        "systems/pipeline.yaml",
        "{rate_hz: 30.0}",
        "{rate_hz: 20.0}",
        "20 Hz, 1200 messages in 60 s",
    ),
    "lost_message": Mistake(
        "systems/talker_listener.yaml",
        'command, log: "Received',
        'command, when: count % 2 == 1, log: "Received',
        "none",
    ),
    "wrong_unit": Mistake(
        "systems/toolbox.yaml",
        "{degrees(message.data):.1f}",
        "{message.data:.1f}",
        "data is -1.0 degrees, not -57.3 degrees",
    ),
    "missed_cancel": Mistake(
        "nodes/navigator.py",
        "if goal.is_cancel_requested:",
        "if False:",
        "message is arrived, not canceled on the way",
    ),
    "restart_loop": Mistake(
        "systems/supervised.yaml",
        "watch: {topic_silence_ms: 1000}",
        "watch: {topic_silence_ms: 50}",
        "/sensor is restarting: silent for 50 ms",
    ),
    "order_of_bring_up": Mistake(
        "systems/fleet.yaml",
        'Odometry}\n  tower:\n    lifecycle: {depends_on: ["*_watchdog"]}\n',
        "Odometry}\n    lifecycle: {depends_on: [tower]}\n  tower:\n",
        "no tower active, only before",
    ),
    "velocity_limit": Mistake(
        "nodes/planner.py",
        "velocity = min(request.max_velocity, self.parameters.max_velocity)",
        "velocity = 3.0",
        "in the first one, message.twist.twist.linear.x is",
    ),
    "late_alarm": Mistake(
        "nodes/watchdog.yaml",
        "timeout_ms: {type: double, default: 1000.0",
        "timeout_ms: {type: double, default: 2500.0",
        "none; the next one at 7.5 s",
    ),
    "wrong_frame": Mistake(
        "nodes/obstacle_finder.py",
        'obstacle = self.transforms.transform(message, "map")',
        "obstacle = message",
        "message.header.frame_id is laser",
    ),
    "exception": Mistake(
        "nodes/motor_controller.py",
        "        command = Twist()\n",
        "        command = Twist()\n        command.linear.x = 1 / len(self.parameters.frames)\n",
        "AttributeError: no parameter 'frames'",
    ),
    "volatile": Mistake(
        "systems/qos_patterns.yaml",
        "mode: {type: std_msgs/msg/String, qos: state}\n    on_activate",
        "mode: {type: std_msgs/msg/String, qos: command}\n    on_activate",
        "none",
    ),
}
#: The systems whose scenarios find the mistakes in node types.
SYSTEMS = {
    "nodes/navigator.py": "navigation",
    "nodes/planner.py": "robot",
    "nodes/watchdog.yaml": "fleet",
    "nodes/obstacle_finder.py": "frames",
    "nodes/motor_controller.py": "robot",
}


@pytest.mark.parametrize("name", MISTAKES)
def test_a_mistake_fails_the_scenario(name: str, project: Path) -> None:
    mistake = MISTAKES[name]
    file = project / mistake.file
    text = file.read_text(encoding="utf-8")
    assert mistake.right in text
    file.write_text(text.replace(mistake.right, mistake.wrong), encoding="utf-8")
    system = SYSTEMS.get(mistake.file, file.stem)
    result = run(project / "scenarios" / f"{system}.yaml")
    assert mistake.seen in "\n".join(failure.seen for failure in result.failures)
    assert result.timeline
