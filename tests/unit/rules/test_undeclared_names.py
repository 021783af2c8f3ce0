"""Names that a node does not declare: passed on to what was not written for the composer."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.unit.support.checking import diagnostics_in

PROGRAM = "executable: {command: [python3, -V]}"
WORDS = "publishers: {words: {type: std_msgs/msg/String, qos: command, external: true}}"


def reported(node: str, folder: Path) -> list[tuple[str, str]]:
    found = diagnostics_in(f"system: robot\nnodes:\n  arm: {{{node}}}\n", folder)
    return [(item.severity.value, item.rule.name) for item in found]


@pytest.mark.parametrize(
    ("node", "expected"),
    [
        (f"{PROGRAM}, remappings: {{/tf: tf, joint_states: /arm/joint_states}}", []),
        ("external: true, remappings: {joint_states: /arm/joint_states}", []),
        ("class: 'zzz:Arm', remappings: {chatter: news}", [("info", "class-not-installed")]),
        (f"{PROGRAM}, {WORDS}, remappings: {{chatter: news}}", []),
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
