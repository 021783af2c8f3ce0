"""Mistakes between the methods of a behavior: what is set when, and what all calls pass."""

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
    subscriptions:
      scan: {type: sensor_msgs/msg/LaserScan, qos: sensor_data, external: true}
      stop: {type: std_msgs/msg/Bool, qos: command, external: true}
    timers: {tick: {period_ms: 100}}
"""
CODE = """\
class Code:
    def on_configure(self):
        {configure}

    def on_activate(self):
        self.report()

    def on_scan(self, message):
        {scan}

    def on_stop(self, message):
        {stop}

    def on_tick(self):
        {tick}

    def report(self):
        {report}
"""
PLACES = ("configure", "scan", "stop", "tick", "report")
#: The statements by place, the rule and the text that is underlined.
UNSET = [
    ({"scan": "range(self.last)\nself.last = len(message.ranges)"}, "unknown-attribute", "last"),
    ({"report": "print(self.width)", "scan": "self.width = 1"}, "unknown-attribute", "width"),
    ({"configure": "print(self.width)", "tick": "self.width = 1"}, "unknown-attribute", "width"),
    ({"configure": "self.count = 0", "stop": "self.state = 1", "tick": "print(self.state)"},
     "unchecked-none", "state"),
    ({"configure": "self.count = 0", "stop": "self.state = 1",
      "tick": "print(self.state)\nself.state = True"}, "unchecked-none", "state"),
]  # fmt: skip
SET = [
    # a class that sets nothing at first may rely on the order of its messages
    {"stop": "self.state = 1", "tick": "print(self.state)"},
    {"configure": "self.last = 0", "scan": "range(self.last)\nself.last = len(message.ranges)"},
    {"report": "self.width = 1\nprint(self.width)", "scan": "self.width = 1"},
    {"tick": "if hasattr(self, 'state'):\n    print(self.state)", "stop": "self.state = 1"},
    {"tick": "print(getattr(self, 'state', 0))", "stop": "self.state = 1"},
    {"tick": "self.state = 0\nprint(self.state)", "stop": "self.state = 1"},
    {"tick": "try:\n    print(self.state)\nexcept AttributeError:\n    pass",
     "stop": "self.state = 1"},
    {"tick": "if self.ready:\n    print(self.state)", "stop": "self.state = 1",
     "configure": "self.ready = False", "scan": "self.ready = True"},
]  # fmt: skip


def _found(folder: Path, statements: dict[str, str]) -> list[Diagnostic]:
    code = CODE
    for place in PLACES:
        text = statements.get(place, "pass").replace("\n", "\n        ")
        code = code.replace(f"{{{place}}}", text)
    (folder / "code.py").write_text(code, encoding="utf-8")
    return diagnostics_in(SYSTEM, folder)


@pytest.mark.parametrize(("statements", "rule", "text"), UNSET)
def test_an_attribute_that_is_read_before_it_is_set(
    statements: dict[str, str], rule: str, text: str, tmp_path: Path
) -> None:
    [diagnostic] = _found(tmp_path, statements)
    assert (diagnostic.rule.name, quoted(diagnostic)) == (rule, text)


@pytest.mark.parametrize("statements", SET)
def test_an_attribute_that_is_set_in_time(statements: dict[str, str], tmp_path: Path) -> None:
    assert _found(tmp_path, statements) == []


CALLS = """\
class Code:
    def on_scan(self, message):
        self.change("scan")

    def on_stop(self, message):
        self.change("stop")

    def on_tick(self):
        {tick}

    def change(self, name: str, is_forced: bool) -> None:
        print(name, {body})
"""


def _calls(folder: Path, tick: str, body: str = "is_forced") -> list[tuple[str, int]]:
    (folder / "code.py").write_text(CALLS.format(tick=tick, body=body), encoding="utf-8")
    return [(item.rule.name, item.primary.line) for item in diagnostics_in(SYSTEM, folder)]


def test_what_all_calls_lack_is_reported_at_the_function(tmp_path: Path) -> None:
    assert _calls(tmp_path, "pass") == [("call-arguments", 11)]


def test_what_some_calls_lack_is_reported_at_these(tmp_path: Path) -> None:
    expected = [("call-arguments", 3), ("call-arguments", 6)]
    assert _calls(tmp_path, 'self.change("tick", True)') == expected
    assert _calls(tmp_path, "print(self.change)") == expected


def test_a_parameter_that_was_removed_is_reported_where_it_is_used(tmp_path: Path) -> None:
    code = CALLS.replace("name: str, is_forced: bool", "name: str").replace("{body}", "is_forced")
    code = code.replace("{tick}", "pass").replace('"scan"', '"scan", True')
    code = code.replace('"stop"', '"stop", False')
    (tmp_path / "code.py").write_text(code, encoding="utf-8")
    [diagnostic] = diagnostics_in(SYSTEM, tmp_path)
    assert (diagnostic.rule.name, quoted(diagnostic)) == ("undefined-name", "is_forced")
