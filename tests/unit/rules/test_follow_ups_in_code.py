"""A mistake in YAML with consequences in Python, and the other way round: it is reported once."""

from __future__ import annotations

from pathlib import Path

import pytest

from composer.base.diagnostics import Severity
from composer.loading import load_files
from composer.loading.reported import collect_diagnostics, project_diagnostics
from tests.unit.support.checking import diagnostics_in, rules_broken

TWIST = "geometry_msgs/msg/Twist"
SYSTEM = """\
system: demo
nodes:
  joystick:
    publishers: {{cmd_vel: {{type: geometry_msgs/msg/Twist, qos: command}}}}
  drive:
    behavior: drive:Drive
    parameters: {{mode: {{type: string, default: fast, choices: [{choices}]}}}}
    subscriptions: {{cmd_vel: {{type: {type}, qos: command}}}}
    services: {{{services}}}
    publishers: {{odom: {{type: nav_msgs/msg/Odometry, qos: sensor_data, external: true}}}}
    timers: {{update: {{{period}}}, report: {{period_ms: 1000}}}}
    lifecycle: {{watch: {{topic_silence_ms: 500}}}}
connections:
  - {{topic: /cmd_vel, from: joystick.cmd_vel, to: drive.cmd_vel}}
  - {{service: /reset, server: drive.reset}}
"""
CODE = """\
from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry


class Drive:
    def on_configure(self):
        self.speed = 0.0

    def on_cmd_vel(self, message{annotation}):
        if self.parameters.mode == "fast":
            self.speed = message.linear.x

    def on_reset(self, request, response):
        response.success = True
        return response

    def on_update(self):
        self.publishers.odom.publish(Odometry())

    def on_report(self):
        self.log.info(f"{self.speed:.1f}")
"""
RIGHT = {
    "choices": "slow, fast",
    "type": TWIST,
    "services": "reset: {type: std_srvs/srv/Trigger}",
    "period": "rate_hz: 50",
    "annotation": "",
}
MISTAKES = {
    "nothing": ({}, []),
    "the type of a port": ({"type": f"{TWIST}Stamped"}, ["type-mismatch"]),
    "the type of a port that the code annotates": (
        {"type": f"{TWIST}Stamped", "annotation": ": Twist"},
        ["type-mismatch"],
    ),
    "a choice that the code compares with": ({"choices": "slow, quick"}, ["parameter-value"]),
    "a service that is missing": ({"services": ""}, ["unknown-port"]),
    "the rate of the timer that publishes": ({"period": "rate_hz: fast"}, ["wrong-type"]),
}


@pytest.mark.parametrize(("change", "rules"), MISTAKES.values(), ids=MISTAKES.keys())
def test_a_mistake_is_reported_once(
    change: dict[str, str], rules: list[str], tmp_path: Path
) -> None:
    parts = RIGHT | change
    code = CODE.replace("{annotation}", parts.pop("annotation"))
    (tmp_path / "drive.py").write_text(code, encoding="utf-8")
    assert rules_broken(SYSTEM.format(**parts), tmp_path) == rules


def test_a_misspelled_namespace_of_an_include_is_reported_once(tmp_path: Path) -> None:
    (tmp_path / "part.yaml").write_text(
        "system: part\nnodes: {a: {services: {reset: {type: std_srvs/srv/Trigger, "
        "respond: {success: true}}}}}\nconnections: [{service: reset, server: a.reset}]\n",
        encoding="utf-8",
    )
    text = (
        "system: demo\ninclude:\n"
        "  - {file: part.yaml, for_each: {name: [x, y]}, namespaces: '${name}', "
        "prefix: '${name}_'}\n"
    )
    assert rules_broken(text, tmp_path) == ["unknown-key"]


def test_a_package_that_is_missing_is_reported_once_with_all_uses(tmp_path: Path) -> None:
    (tmp_path / "drive.py").write_text(
        "from arm_msgs.msg import Grip\nfrom arm_msgs.srv import Move\n\n\nclass Drive:\n"
        "    def on_grip(self, message):\n        print(Grip, Move)\n",
        encoding="utf-8",
    )
    text = (
        "system: demo\nnodes:\n  drive:\n    behavior: drive:Drive\n    subscriptions:\n"
        "      grip: {type: arm_msgs/msg/Grip, qos: command, external: true}\n"
        "    clients: {move: {type: arm_msgs/srv/Move, external: true}}\n"
    )
    [found] = diagnostics_in(text, tmp_path)
    assert len(found.related) >= len(["the other import", "the port", "the client"])


@pytest.mark.parametrize("module", ["a", "z"], ids=["before the system", "after the system"])
def test_a_missing_package_of_a_port_is_an_error_in_files_of_any_name(
    module: str, tmp_path: Path
) -> None:
    code = (
        "from rclpy.node import Node\nfrom turtlesim.msg import Pose\n\n\nclass Turtle(Node):\n"
        "    def __init__(self):\n        super().__init__('turtle')\n"
        "        self.create_subscription(Pose, 'pose', print, 10)\n"
    )
    (tmp_path / f"{module}.py").write_text(code, encoding="utf-8")
    text = (
        f"system: demo\nnodes:\n  turtle:\n    class: {module}:Turtle\n    subscriptions:\n"
        "      pose: {type: turtlesim/msg/Pose, external: true}\n"
    )
    found = max(diagnostics_in(text, tmp_path), key=lambda item: item.severity is Severity.ERROR)
    assert found.rule.name == "unknown-interface"
    assert found.hint == (
        "install the package 'turtlesim', or put its source into the folder 'interfaces'; "
        "did you mean 'geometry_msgs/msg/Pose'?"
    )


def test_a_missing_folder_of_node_types_is_reported_once(tmp_path: Path) -> None:
    (tmp_path / "composer.yaml").write_text("nodes: [node_types]\n", encoding="utf-8")
    (tmp_path / "nodes").mkdir()
    (tmp_path / "nodes" / "motor.yaml").write_text("node: motor\non_activate: {log: started}\n")
    (tmp_path / "system.yaml").write_text("system: demo\nnodes: {motor: {type: motor}}\n")
    results = load_files([tmp_path / "system.yaml", tmp_path / "nodes" / "motor.yaml"])
    found = [*collect_diagnostics(results), *project_diagnostics(results)]
    assert [item.rule.name for item in found] == ["bad-setting"]
