"""Mistakes in the classes that the file of a behavior defines, and in calls of their methods."""

from __future__ import annotations

from pathlib import Path

import pytest

from composer.diagnostics import Diagnostic
from tests.unit.support.checking import diagnostics_in, quoted

SYSTEM = """\
system: a
nodes:
  n:
    behavior: code:Code
    publishers: {text: {type: std_msgs/msg/String, qos: state, external: true}}
    timers: {tick: {period_ms: 100}}
"""
CODE = """\
import enum
from dataclasses import dataclass, field

from std_msgs.msg import String


class Mode(enum.Enum):
    IDLE = "idle"
    DRIVE = "drive"


class Level(enum.Enum):
    LOW = enum.auto()

    @property
    def value(self):
        return String()


@dataclass
class Sample:
    frame: str = "map"
    {field}


class Code:
    mode: Mode = Mode.IDLE

    @classmethod
    def between(cls, start, end, *, share):
        return share * (end - start)

    def on_tick(self):
        {statement}
"""


@pytest.mark.parametrize(
    ("field", "statement", "rule", "text"),
    [
        ("ticks: list[int] = [0] * 4", "pass", "invalid-value", "[0] * 4"),
        ("ticks: list[int] = []", "pass", "invalid-value", "[]"),
        ("names: dict = dict(a=1)", "pass", "invalid-value", "dict(a=1)"),
        ("", "self.between(0.0, 1.0, 0.5)", "call-arguments", "0.5"),
        ("", "self.between(0.0, 1.0)", "call-arguments", "self.between"),
        ("", "self.publishers.text.publish(self.mode.value)", "invalid-value", "self.mode.value"),
    ],
)
def test_a_mistake_is_reported_once(
    field: str, statement: str, rule: str, text: str, tmp_path: Path
) -> None:
    [diagnostic] = _found(field, statement, tmp_path)
    assert (diagnostic.rule.name, quoted(diagnostic)) == (rule, text)


@pytest.mark.parametrize(
    ("field", "statement"),
    [
        ("ticks: list[int] = field(default_factory=list)", "Sample().ticks"),
        ("place: tuple[int, int] = (0, 0)", "pass"),
        ("known: ClassVar[list[int]] = []", "pass"),
        ("", "self.between(0.0, 1.0, share=0.5)"),
        ("", "Code.between(0.0, 1.0, share=0.5)"),
        ("", "self.publishers.text.publish(String(data=self.mode.value))"),
        ("", "self.publishers.text.publish(Level.LOW.value)"),
    ],
)
def test_right_code_is_not_reported(field: str, statement: str, tmp_path: Path) -> None:
    assert [item.message for item in _found(field, statement, tmp_path)] == []


def _found(field: str, statement: str, folder: Path) -> list[Diagnostic]:
    code = CODE.replace("{field}", field).replace("{statement}", statement)
    if "ClassVar" in field:
        code = "from typing import ClassVar\n" + code
    (folder / "code.py").write_text(code, encoding="utf-8")
    return diagnostics_in(SYSTEM, folder)
