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


WITHOUT_ANNOTATIONS = """\
from collections import deque

from geometry_msgs.msg import Point, PoseStamped, Vector3
from helper import Floor


def gap(first, second, offset=0.0):
    return first.x - second.x + offset


class Code:
    def on_configure(self):
        self.points = []
        self.floors = {}
        self.recent = deque(maxlen=5)
        self.raw = {}

    def on_tick(self):
        self.add("a", Floor(1.0))
        self.points.append(Point())
        lines = []
        for point in self.points:
            lines.append(self.line(point))
            self.recent.append(gap(point, Point()))
        self.show(lines[-1].upper(), Point())

    def add(self, name, floor):
        known = self.floors.get(name)
        if known is None:
            self.floors[name] = floor
        self.raw[name] = [floor.height, name.title()]

    def line(self, point):
        return "at %.1f" % point.x

    def show(self, text, item):
        print(text.upper(), max(self.recent).real, self.floors["a"].height)
        if hasattr(item, "header"):
            print(item.header)
        try:
            print(item.pose)
        except AttributeError:
            self.recent.clear()
"""


@pytest.mark.parametrize(
    ("old", "new", "rule", "text"),
    [
        ("first.x", "first.w", "unknown-field", "w"),
        ("point.x", "point.z.x", "unknown-field", "x"),
        ("floor.height", "floor.heigth", "unknown-attribute", "heigth"),
        ("name.title", "name.titel", "unknown-field", "titel"),
        ("gap(point, Point())", "gap(point, PoseStamped())", "call-arguments", "PoseStamped()"),
        ("self.show(lines[-1].upper()", "self.show(5", "call-arguments", "5"),
        ("gap(point, Point())", "gap(point, Point(), 'a')", "call-arguments", "'a'"),
        ("self.line(point))", "self.line(point)); lines.append(self.line(1.0))", "call-arguments",
         "1.0"),
        ("append(self.line(point))", "append(gap(point, point))", "unknown-field", "upper"),
        ('floors["a"].height', 'floors["a"].tall', "unknown-attribute", "tall"),
        ("max(self.recent).real", "max(self.recent).value", "unknown-field", "value"),
    ],
)  # fmt: skip
def test_what_calls_pass_is_the_type_of_an_argument(
    old: str, new: str, rule: str, text: str, tmp_path: Path
) -> None:
    (tmp_path / "helper.py").write_text(HELPER, encoding="utf-8")
    (tmp_path / "code.py").write_text(WITHOUT_ANNOTATIONS.replace(old, new, 1), encoding="utf-8")
    [diagnostic] = diagnostics_in(SYSTEM, tmp_path)
    assert (diagnostic.rule.name, quoted(diagnostic)) == (rule, text)


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("None", "None"),
        # passed on: it may be called with anything, or be filled with anything
        ("lines = []", "lines = sorted([], key=self.line)"),
        ("lines = []", "lines = []\n        self.lines = lines"),
        ("self.points.append(Point())", "self.points.append(Point()); getattr(self, 'line')(5)"),
        # called with several types
        ("def on_tick(self):", "def on_tick(self):\n        gap(Vector3(), Vector3())"),
        ("self.points.append(Point())", "self.points += [Point(), 5, 'a']"),
    ],
)
def test_arguments_and_elements_that_may_be_others_are_not_reported(
    old: str, new: str, tmp_path: Path
) -> None:
    (tmp_path / "helper.py").write_text(HELPER, encoding="utf-8")
    (tmp_path / "code.py").write_text(WITHOUT_ANNOTATIONS.replace(old, new, 1), encoding="utf-8")
    assert diagnostics_in(SYSTEM, tmp_path) == []
