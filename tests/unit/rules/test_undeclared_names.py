"""Names that a node does not declare: passed on to what was not written for the composer."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.unit.support.checking import diagnostics_in, write_files

WORDS = "publishers: {words: {type: std_msgs/msg/String, qos: command, external: true}}"
PX4 = "{reliability: best_effort, durability: transient_local, depth: 1}"
WHEEL = "parameters: {wheel_radius: 0.1}"
PROGRAM = "executable: {command: [python3, -V]}"
BASES = "executable: {command: [python3, -V], nodes: [base, %s]}"
CHATTER = "remappings: {chatter: news}"
DECLARED = "only_declared: true"
A, WHEELS = "{ros__parameters: {a: 1}}", "{ros__parameters: {a: 1, b: {c: [x]}}}"
QOS = "parameters: {'qos_overrides./words.publisher.depth': 3, 'a b': 1}"
CLASS = """\
from rclpy.node import Node


class Arm(Node):
    def __init__(self):
        super().__init__("arm")
        self.declare_parameter("rate_hz", 5.0)
"""


@pytest.mark.parametrize(
    ("node", "expected"),
    [
        # Remappings.
        (f"{PROGRAM}, remappings: {{/tf: tf, joint_states: /arm/joint_states}}", ""),
        ("external: true, remappings: {joint_states: /arm/joint_states}", ""),
        (
            "class: 'zzz:Arm', remappings: {chatter: news, 'rosservice://arm/go': go}",
            "info not-installed",
        ),
        (f"{PROGRAM}, {WORDS}, {CHATTER}", ""),
        (f"{PROGRAM}, remappings: {{'lidar:scan': a, 'rostopic://~/b': b}}", ""),
        (f"{PROGRAM}, {WORDS}, remappings: {{wods: news}}", "info unknown-remapping"),
        (f"{PROGRAM}, {WORDS}, {DECLARED}, {CHATTER}", "error unknown-remapping"),
        (f"{WORDS}, {CHATTER}", "error unknown-remapping"),
        # Names and QoS.
        (f"{PROGRAM}, {QOS}", ""),
        (f"{WORDS}, parameters: {{'a/b': 3}}", "error invalid-name"),
        (BASES % "base", ""),
        (BASES % "front-left/wheel", "error invalid-name"),
        (
            f"{PROGRAM}, behavior: 'arm:Arm', timers: {{t: {{rate_hz: 1}}}}, {CHATTER}",
            "error several-implementations",
        ),
        # PX4's QoS: described for a program, chosen for a node of the system.
        (f"{PROGRAM}, {WORDS.replace('command', PX4)}", ""),
        (WORDS.replace("command", PX4), "info unsuited-qos"),
    ],
)
def test_remappings_names_and_qos(node: str, expected: str, tmp_path: Path) -> None:
    assert reported(node, tmp_path) == expected


@pytest.mark.parametrize(
    ("node", "file", "expected"),
    [
        (PROGRAM, "arm: {ros__parameters: {a: 1, b: {c: [x]}, qos_overrides./x.y: 1}}", ""),
        (PROGRAM, f"/**/arm: {WHEELS}", ""),
        ("external: true", f"/**: {A}", ""),
        (f"{PROGRAM}, {WHEEL}", "arm: {ros__parameters: {odom0: a, odom1: b}}", ""),
        (
            f"{PROGRAM}, {WHEEL}",
            "arm: {ros__parameters: {wheel_radus: 0.2}}",
            "info unknown-parameter",
        ),
        (
            f"{PROGRAM}, {WHEEL}",
            "arm: {ros__parameters: {wheel_radius: fast}}",
            "error parameter-value",
        ),
        (f"{PROGRAM}, {WHEEL}, {DECLARED}", f"arm: {A}", "error unknown-parameter"),
        (f"{PROGRAM}, {WHEEL}, {DECLARED}", f"/**: {A}", "warning unmatched-parameters"),
        (WHEEL, f"arm: {A}", "error unknown-parameter"),
        # Nodes in a program, known and unknown; a name that is most likely misspelled.
        (PROGRAM, f"base: {A}", "info unmatched-parameters"),
        (BASES % "drive/wheels", f"base: {A}\ndrive/wheels: {A}", ""),
        (f"{PROGRAM}, name: planner", f"planer: {A}", "warning unmatched-parameters"),
        (f"{PROGRAM}, namespace: left", f"arm: {A}", "warning unmatched-parameters"),
        # Names that are lists.
        (f"{PROGRAM}, namespace: [a, b]", f"/a/b/arm: {A}", "error wrong-type"),
        (f"{WHEEL}, name: [hand]", f"hand: {A}", "error wrong-type"),
        (f"{WHEEL}, namespace: [a, b]", f"/a/b/arm: {A}", "error wrong-type"),
        # A class declares its parameters itself.
        ("class: 'arm:Arm'", "/**: {ros__parameters: {rate_hz: 2.5, of_another_node: 1}}", ""),
        ("class: 'arm:Arm'", "/**: {ros__parameters: {rate_hz: 2}}", "error class-parameter"),
        ("class: 'arm:Arm'", "/**: {ros__parameters: {rat_hz: 2.5}}", "warning class-parameter"),
    ],
)
def test_parameter_files(node: str, file: str, expected: str, tmp_path: Path) -> None:
    write_files(tmp_path, {"robot.yaml": file, "arm.py": CLASS})
    assert reported(node, tmp_path, "parameter_files: [robot.yaml]\n") == expected


def reported(node: str, folder: Path, above: str = "") -> str:
    """Return the severities and the rules of the diagnostics."""
    text = f"system: robot\n{above}nodes:\n  arm: {{{node}}}\n"
    found = diagnostics_in(text, folder)
    return ", ".join(f"{item.severity.value} {item.rule.name}" for item in found)
