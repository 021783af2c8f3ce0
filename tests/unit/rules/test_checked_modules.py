"""Which Python is checked with a node, and how often."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from composer.analysis.python import behavior_code
from composer.behavior_checks import CodeProblem, behavior_problems
from composer.model import Node
from tests.unit.support.checking import diagnostics_in, quoted


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


def test_copies_of_a_node_are_checked_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    checked = []

    def counted(node: Node, *rest: Any) -> Iterator[CodeProblem]:
        checked.append(node.name.value)
        return behavior_problems(node, *rest)

    monkeypatch.setattr(behavior_code, "behavior_problems", counted)
    (tmp_path / "robot_code.py").write_text("class Code:\n    def on_tick(self):\n        self.a\n")
    entry = "behavior: robot_code:Code, timers: {tick: {period_ms: 100}}"
    system = f"system: a\nnodes:\n  a${{i}}: {{for_each: {{i: 20}}, {entry}}}\n"
    [diagnostic] = diagnostics_in(system, tmp_path)
    assert diagnostic.rule.name == "unknown-attribute"
    assert checked == ["a0"]


def test_the_modules_that_a_behavior_imports_are_checked_as_well(tmp_path: Path) -> None:
    files = {
        "robot_code.py": "import helper\nfrom tools import units\nclass Code:\n    pass\n",
        "helper.py": "from tools.units import METER\nfrom math import sqroot\n",
        "tools/__init__.py": "",
        "tools/units.py": "METERS = 3\ndef f():\n    return METRES\n",
        "math.py": "def sqroot(): pass\n",  # does not hide the standard library
        "unused.py": "import nothing\n",
    }
    for path, text in files.items():
        file = tmp_path / path
        file.parent.mkdir(exist_ok=True)
        file.write_text(text, encoding="utf-8")
    system = "system: s\nnodes:\n  n: {behavior: robot_code:Code, on_activate: {log: go}}\n"
    found = [
        (Path(item.primary.file.path).name, item.primary.line, item.rule.name, item.message)
        for item in diagnostics_in(system, tmp_path)
    ]
    assert sorted(found) == [
        ("helper.py", 1, "unknown-import", "module 'tools.units' has no 'METER'"),
        ("helper.py", 2, "unknown-import", "module 'math' has no 'sqroot'"),
        ("units.py", 3, "undefined-name", "name 'METRES' is not defined"),
    ]


def test_a_helper_out_of_the_project_is_reported(tmp_path: Path) -> None:
    (tmp_path / "elsewhere.py").write_text("A = 1\n")
    project = tmp_path / "project"
    project.mkdir()
    (project / "composer.yaml").write_text("nodes: [.]\n")
    (project / "helper.py").symlink_to(tmp_path / "elsewhere.py")
    (project / "robot_code.py").write_text("import helper\nclass Code:\n    pass\n")
    system = "system: s\nnodes:\n  n: {behavior: robot_code:Code, on_activate: {log: go}}\n"
    (found,) = diagnostics_in(system, project)
    assert found.message == "module 'helper' is a symbolic link out of the project"


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
    assert [item.rule.name for item in reported] == ["unknown-attribute"] * bool(attribute)
    assert [quoted(item) for item in reported] == [attribute] * bool(attribute)
