"""Calls of functions and classes in other files of a project, and values that may be None."""

from __future__ import annotations

from pathlib import Path

import pytest

from composer.diagnostics import Diagnostic
from tests.unit.support.checking import diagnostics_in, quoted

SYSTEM = "system: a\nnodes:\n  n: {behavior: code:Code, timers: {tick: {period_ms: 100}}}\n"
HELPER = """\
class Floor:
    def __init__(self, height):
        self.height = height


def nearest(floors, height: float) -> float:
    return min(floors)
"""
CODE = """\
from geometry_msgs.msg import Point
from helper import Floor, nearest


class Code:
    def on_tick(self):
        {statement}

    async def move(self) -> Point:
        try:
            {inside}
        finally:
            self.moved = True
        return Point()
"""


@pytest.mark.parametrize(
    ("statement", "inside", "rule", "text"),
    [
        ("nearest([1.0])", "pass", "call-arguments", "nearest"),
        ("nearest([1.0], 'top')", "pass", "call-arguments", "'top'"),
        ("Floor()", "pass", "call-arguments", "Floor"),
        ("Point(x=nearest([1.0], 2.0).height)", "pass", "unknown-field", "height"),
        ("pass", "return", "missing-return", "return"),
        ("pass", "return None", "missing-return", "return None"),
    ],
)
def test_a_mistake_is_reported_once(
    statement: str, inside: str, rule: str, text: str, tmp_path: Path
) -> None:
    [diagnostic] = _found(statement, inside, tmp_path)
    assert (diagnostic.rule.name, quoted(diagnostic)) == (rule, text)


@pytest.mark.parametrize(
    "statement", ["nearest([1.0], 2.0)", "Floor(1.0).height", "nearest = len\n        nearest([])"]
)
def test_right_code_is_not_reported(statement: str, tmp_path: Path) -> None:
    assert _found(statement, "pass", tmp_path) == []


def _found(statement: str, inside: str, folder: Path) -> list[Diagnostic]:
    (folder / "helper.py").write_text(HELPER, encoding="utf-8")
    code = CODE.replace("{statement}", statement).replace("{inside}", inside)
    (folder / "code.py").write_text(code, encoding="utf-8")
    return diagnostics_in(SYSTEM, folder)
