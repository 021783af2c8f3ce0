"""ROS parameter files: which values a node gets from them."""

from __future__ import annotations

from pathlib import Path

import pytest

from composer.loading import load
from composer.resolve import OverrideOptions
from composer.tree import Plain

SYSTEM = """\
system: demo
parameter_files: [first.yaml, second.yaml]
nodes:
  planner:
    namespace: planning
    parameters: {speed: {type: double, default: 1.0}, gains.p: {type: double, default: 0.0}}
"""


def value(name: str, folder: Path, first: str, second: str = "{}", *settings: str) -> Plain:
    (folder / "first.yaml").write_text(first, encoding="utf-8")
    (folder / "second.yaml").write_text(second, encoding="utf-8")
    (folder / "system.yaml").write_text(SYSTEM, encoding="utf-8")
    loading = load(folder / "system.yaml", overrides=OverrideOptions(tuple(settings)))
    assert [item.message for item in loading.diagnostics if item.rule.code[2] in "01"] == []
    assert loading.system is not None
    parameter = loading.system.nodes[0].parameter(name)
    assert parameter is not None
    return parameter.value.value if parameter.value is not None else None


def section(name: str, speed: float) -> str:
    return f"{name}: {{ros__parameters: {{speed: {speed}}}}}\n"


@pytest.mark.parametrize(
    ("name", "meant"),
    [
        ("/planning/planner", True),
        ("planning/planner", True),
        ("/**", True),
        ("/planning/**", True),
        ("/planning/*", True),
        ("/*/planner", True),
        ("/**/planner", True),
        ("/pl*ing/p*r", True),
        ("/planning/planner/**", True),
        ("/planner", False),
        ("/*", False),
        ("/control/**", False),
        ("/*/*/*", False),
        ("/pl*ing/planners*", False),
        ("/planning", False),
    ],
)
def test_names_may_have_wildcards(name: str, meant: bool, tmp_path: Path) -> None:
    assert value("speed", tmp_path, section(f'"{name}"', 7.0)) == (7.0 if meant else 1.0)


def test_namespaces_and_parameters_may_be_nested(tmp_path: Path) -> None:
    text = "planning:\n  planner:\n    ros__parameters: {gains: {p: 2}, speed: 3}\n"
    assert value("gains.p", tmp_path, text) == pytest.approx(2.0)
    assert value("speed", tmp_path, text) == pytest.approx(3.0)


def test_the_later_value_counts_and_the_command_line_last(tmp_path: Path) -> None:
    first = section("/planning/planner", 2.0) + section("/**", 3.0)
    assert value("speed", tmp_path, first) == pytest.approx(3.0)
    second = section("/planning/*", 4.0)
    assert value("speed", tmp_path, first, second) == pytest.approx(4.0)
    assert value("speed", tmp_path, first, second, "planner.speed=5.0") == pytest.approx(5.0)


def test_many_wildcards_take_no_time(tmp_path: Path) -> None:
    name = "/" + "*a" * 100 + "/" + "**/" * 100 + "x"
    assert value("speed", tmp_path, section(f'"{name}"', 7.0)) == pytest.approx(1.0)
