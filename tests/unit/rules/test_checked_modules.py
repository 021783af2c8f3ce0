"""Which Python is checked with a node, and how often."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.unit.support.checking import diagnostics_in, quoted, write_files


def test_two_nodes_with_one_class_report_it_once(tmp_path: Path) -> None:
    system = "system: demo\nnodes:\n"
    for name in ("left", "right"):
        system += f"  {name}: {{behavior: robot_code:Code, timers: {{tick: {{period_ms: 100}}}}}}\n"
    code = "class Code:\n    def on_tick(self):\n        self.publishers.text.publish(0)\n"
    (tmp_path / "robot_code.py").write_text(code, encoding="utf-8")
    [diagnostic] = diagnostics_in(system, tmp_path)
    assert diagnostic.rule.name == "unknown-attribute"


def test_installed_classes_are_not_checked(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    packages = tmp_path / "site-packages"
    packages.mkdir()
    (packages / "of_others.py").write_text(
        "class Code:\n    def on_tick(self):\n        self.zebra\n", encoding="utf-8"
    )
    monkeypatch.syspath_prepend(packages)
    system = (
        "system: demo\nnodes:\n"
        "  robot: {behavior: of_others:Code, timers: {tick: {period_ms: 100}}}\n"
    )
    assert diagnostics_in(system, tmp_path) == []


def test_the_modules_that_a_behavior_imports_are_checked_as_well(tmp_path: Path) -> None:
    files = {
        "robot_code.py": "import helper\nfrom tools import units\nclass Code:\n    pass\n",
        "helper.py": "from tools.units import METER\nfrom math import sqroot\n",
        "tools/__init__.py": "",
        "tools/units.py": "METERS = 3\ndef f():\n    return METRES\n",
        "math.py": "def sqroot(): pass\n",  # does not hide the standard library
        "unused.py": "import nothing\n",
    }
    write_files(tmp_path, files)
    system = "system: s\nnodes:\n  n: {behavior: robot_code:Code, on_activate: {log: go}}\n"
    found = [
        (Path(item.primary.file.path).name, item.primary.line, item.rule.name, item.message)
        for item in diagnostics_in(system, tmp_path)
    ]
    assert sorted(found) == [
        ("helper.py", 1, "unknown-import", "module 'tools.units' has no 'METER'"),
        ("helper.py", 2, "unknown-import", "could not import 'sqroot' from 'math'"),
        ("units.py", 3, "undefined-name", "could not find name 'METRES'"),
    ]


def test_a_changed_helper_is_read_again(tmp_path: Path) -> None:
    system = "system: s\nnodes:\n  n: {behavior: robot_code:Code, on_activate: {log: go}}\n"
    code = "import helper\n\n\nclass Code:\n    def on_configure(self):\n        helper.go()\n"
    (tmp_path / "robot_code.py").write_text(code, encoding="utf-8")
    (tmp_path / "helper.py").write_text("def go(speed: float) -> None: ...\n", encoding="utf-8")
    [found] = diagnostics_in(system, tmp_path)
    assert (found.rule.name, quoted(found)) == ("call-arguments", "()")
    (tmp_path / "helper.py").write_text("def go() -> None: ...\n", encoding="utf-8")
    assert diagnostics_in(system, tmp_path) == []


@pytest.mark.parametrize(
    ("line", "use", "attribute"),
    [
        ("from datetime import datetime", "datetime.datetime.now()", "datetime"),
        ("from time import time", "time.sleep(1.0)", "sleep"),
        ("from random import random", "random.uniform(0.0, 1.0)", "uniform"),
        ("from datetime import datetime", "datetime.now(), datetime.max.year", ""),
        ("from itertools import chain", "chain.from_iterable([[1]])", ""),
        ("from datetime import datetime", "for datetime in (): print(datetime.text)", ""),
    ],
)
def test_what_is_imported_by_name_is_not_its_module(
    line: str, use: str, attribute: str, tmp_path: Path
) -> None:
    code = f"{line}\n\n\nclass Code:\n    def go(self):\n        {use}\n"
    (tmp_path / "robot_code.py").write_text(code, encoding="utf-8")
    system = "system: s\nnodes:\n  n: {behavior: robot_code:Code, on_activate: {log: go}}\n"
    reported = [item for item in diagnostics_in(system, tmp_path) if item.rule.code != "RC434"]
    assert [item.rule.name for item in reported] == ["missing-attribute"] * bool(attribute)
    assert [quoted(item) for item in reported] == [attribute] * bool(attribute)
