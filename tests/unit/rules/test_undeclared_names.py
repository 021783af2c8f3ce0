"""Names that a node does not declare: passed on to what was not written for the composer."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.unit.support.checking import diagnostics_in

PROGRAM = "executable: {command: [python3, -V]}"
WORDS = "publishers: {words: {type: std_msgs/msg/String, qos: command, external: true}}"


PX4 = "{reliability: best_effort, durability: transient_local, depth: 1}"
WHEEL = "parameters: {wheel_radius: 0.1}"


def reported(node: str, folder: Path, above: str = "") -> list[tuple[str, str]]:
    text = f"system: robot\n{above}nodes:\n  arm: {{{node}}}\n"
    return [(item.severity.value, item.rule.name) for item in diagnostics_in(text, folder)]


@pytest.mark.parametrize(
    ("node", "expected"),
    [
        (f"{PROGRAM}, remappings: {{/tf: tf, joint_states: /arm/joint_states}}", []),
        ("external: true, remappings: {joint_states: /arm/joint_states}", []),
        (
            "class: 'zzz:Arm', remappings: {chatter: news, 'rosservice://arm/go': go}",
            [("info", "not-installed")],
        ),
        (f"{PROGRAM}, {WORDS}, remappings: {{chatter: news}}", []),
        (f"{PROGRAM}, remappings: {{'lidar:scan': a, 'rostopic://~/b': b}}", []),
        (f"{PROGRAM}, {WORDS}, remappings: {{wods: news}}", [("info", "unknown-remapping")]),
        (
            f"{PROGRAM}, {WORDS}, only_declared: true, remappings: {{chatter: news}}",
            [("error", "unknown-remapping")],
        ),
        (f"{WORDS}, remappings: {{chatter: news}}", [("error", "unknown-remapping")]),
    ],
)
def test_remappings(node: str, expected: list[tuple[str, str]], tmp_path: Path) -> None:
    assert reported(node, tmp_path) == expected


@pytest.mark.parametrize(
    ("node", "file", "expected"),
    [
        (PROGRAM, "arm: {ros__parameters: {a: 1, b: {c: [x]}, qos_overrides./x.y: 1}}", []),
        (PROGRAM, "/**/arm: {ros__parameters: {a: 1, b: {c: [x]}}}", []),
        ("external: true", "/**: {ros__parameters: {a: 1}}", []),
        (f"{PROGRAM}, {WHEEL}", "arm: {ros__parameters: {odom0: a, odom1: b}}", []),
        (
            f"{PROGRAM}, {WHEEL}",
            "arm: {ros__parameters: {wheel_radus: 0.2}}",
            [("info", "unknown-parameter")],
        ),
        (
            f"{PROGRAM}, {WHEEL}",
            "arm: {ros__parameters: {wheel_radius: fast}}",
            [("error", "parameter-value")],
        ),
        (
            f"{PROGRAM}, {WHEEL}, only_declared: true",
            "arm: {ros__parameters: {a: 1}}",
            [("error", "unknown-parameter")],
        ),
        (
            f"{PROGRAM}, {WHEEL}, only_declared: true",
            "/**: {ros__parameters: {a: 1}}",
            [("warning", "unmatched-parameters")],
        ),
        (WHEEL, "arm: {ros__parameters: {a: 1}}", [("error", "unknown-parameter")]),
        # Nodes in a program, known and unknown; a name that is most likely misspelled.
        (PROGRAM, "base: {ros__parameters: {a: 1}}", [("info", "unmatched-parameters")]),
        (
            "executable: {command: [python3, -V], nodes: [base, drive/wheels]}",
            "base: {ros__parameters: {a: 1}}\ndrive/wheels: {ros__parameters: {a: 1}}",
            [],
        ),
        (
            f"{PROGRAM}, name: planner",
            "planer: {ros__parameters: {a: 1}}",
            [("warning", "unmatched-parameters")],
        ),
        (
            f"{PROGRAM}, namespace: [a, b]",
            "/a/b/arm: {ros__parameters: {a: 1}}",
            [("error", "wrong-type")],
        ),
        (
            f"{PROGRAM}, namespace: left",
            "arm: {ros__parameters: {a: 1}}",
            [("warning", "unmatched-parameters")],
        ),
        (f"{WHEEL}, name: [hand]", "hand: {ros__parameters: {a: 1}}", [("error", "wrong-type")]),
        (
            f"{WHEEL}, namespace: [a, b]",
            "/a/b/arm: {ros__parameters: {a: 1}}",
            [("error", "wrong-type")],
        ),
    ],
)
def test_parameter_files(
    node: str, file: str, expected: list[tuple[str, str]], tmp_path: Path
) -> None:
    (tmp_path / "robot.yaml").write_text(file, encoding="utf-8")
    assert reported(node, tmp_path, "parameter_files: [robot.yaml]\n") == expected


@pytest.mark.parametrize(
    ("node", "expected"),
    [
        (f"{PROGRAM}, parameters: {{'qos_overrides./words.publisher.depth': 3, 'a b': 1}}", []),
        (f"{WORDS}, parameters: {{'a/b': 3}}", [("error", "invalid-name")]),
        ("executable: {command: [python3, -V], nodes: [base, base]}", []),
        (
            "executable: {command: [python3, -V], nodes: [base, front-left/wheel]}",
            [("error", "invalid-name")],
        ),
        (
            f"{PROGRAM}, behavior: 'arm:Arm', timers: {{t: {{rate_hz: 1}}}}, remappings: {{a: b}}",
            [("error", "several-implementations")],
        ),
        # PX4's QoS: described for a program, chosen for a node of the system.
        (f"{PROGRAM}, {WORDS.replace('command', PX4)}", []),
        (WORDS.replace("command", PX4), [("info", "unsuited-qos")]),
    ],
)
def test_names_and_qos(node: str, expected: list[tuple[str, str]], tmp_path: Path) -> None:
    assert reported(node, tmp_path) == expected


CLASS = """\
from rclpy.node import Node


class Arm(Node):
    def __init__(self):
        super().__init__("arm")
        self.declare_parameter("rate_hz", 5.0)
"""


@pytest.mark.parametrize(
    ("values", "expected"),
    [
        ("{rate_hz: 2.5, of_another_node: 1}", []),
        ("{rate_hz: 2}", [("error", "class-parameter")]),
        ("{rat_hz: 2.5}", [("warning", "class-parameter")]),
    ],
)
def test_parameter_files_of_classes(
    values: str, expected: list[tuple[str, str]], tmp_path: Path
) -> None:
    (tmp_path / "arm.py").write_text(CLASS, encoding="utf-8")
    (tmp_path / "robot.yaml").write_text(f"/**: {{ros__parameters: {values}}}", encoding="utf-8")
    above = "parameter_files: [robot.yaml]\n"
    assert reported("class: 'arm:Arm'", tmp_path, above) == expected
