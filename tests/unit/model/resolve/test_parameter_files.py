"""ROS parameter files: which values a node gets from them."""

from __future__ import annotations

from pathlib import Path

import pytest

from composer.language.tree import Plain, plain
from composer.model.resolve import OverrideOptions
from composer.model.resolve.parameter_files import ParameterFiles, read_parameter_file
from tests.unit.support.checking import load_project

SYSTEM = """\
system: demo
parameter_files: [first.yaml, second.yaml]
nodes:
  planner:
    namespace: planning
    parameters: {speed: {type: double, default: 1.0}, gains.p: {type: double, default: 0.0}}
"""


def read(text: str, folder: Path) -> tuple[ParameterFiles, list[str]]:
    """Return the sections of a parameter file, and its diagnostics as ``line:column message``."""
    file = folder / "robot.yaml"
    file.write_text(text, encoding="utf-8")
    files = ParameterFiles()
    found = read_parameter_file(file, files)
    return files, [f"{item.primary.line}:{item.primary.column} {item.message}" for item in found]


def value(name: str, folder: Path, first: str, second: str = "{}", *settings: str) -> Plain:
    files = {"system.yaml": SYSTEM, "first.yaml": first, "second.yaml": second}
    loading = load_project(folder, files, overrides=OverrideOptions(settings))
    assert [item.message for item in loading.diagnostics if item.rule.code[2] in "01"] == []
    return loading.system.nodes[0].parameter(name).value.value


def section(name: str, speed: float) -> str:
    return f"{name}: {{ros__parameters: {{speed: {speed}}}}}\n"


PLANNER = ("/planning/planner", "planning/planner", "/**", "/planning/**", "/planning/*")
PLANNER += ("/*/planner", "/**/planner", "/planning/planner/**")
OTHERS = ("/planner", "/*", "/control/**", "/*/*/*", "/planning")
OTHERS += ("/" + "**/*/" * 100 + "x",)  # takes no time


@pytest.mark.parametrize(
    ("name", "expected"), [*((name, 7.0) for name in PLANNER), *((name, 1.0) for name in OTHERS)]
)
def test_names_may_have_wildcards(name: str, expected: float, tmp_path: Path) -> None:
    assert value("speed", tmp_path, section(f'"{name}"', 7.0)) == expected


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


def test_a_misspelled_ros__parameters_is_reported_once(tmp_path: Path) -> None:
    for key in ("ros_parameters", "ros__parametrs", "ros__params", "parameters", "Ros__Parameters"):
        text = f"lab:\n  motor:\n    {key}:\n      speed: 1.0\n      gains: {{p: 1, d: 2}}\n"
        assert read(text, tmp_path)[1] == [f"3:5 '{key}' is not 'ros__parameters'"]
    assert read("motor: {speed: 1, gains: {p: 1}}", tmp_path)[1] == [
        "1:1 'motor' has no 'ros__parameters'"
    ]
    assert read("parameters: {motor: {ros__parameters: {p: 1}}}", tmp_path)[1] == []


def test_the_same_name_in_two_namespaces_is_two_nodes(tmp_path: Path) -> None:
    text = "left: {arm: {ros__parameters: {p: 1}}}\nright: {arm: {ros__parameters: {p: 2}}}\n"
    files, messages = read(text, tmp_path)
    assert messages == []
    for name, number in (("/left/arm", 1), ("/right/arm", 2)):
        given = files.given(name, frozenset("p"))
        assert [plain(entry.value) for entry in given.values()] == [number]


UNMATCHED = {
    "system.yaml": """\
system: demo
parameter_files: [robot.yaml]
include: [{file: arm.yaml, prefix: left_}]
nodes:
  motor: {namespace: base, parameters: {speed: {type: double, default: 1.0}}}
""",
    "arm.yaml": """\
system: arm
parameter_files: [arm_parameters.yaml]
nodes:
  motor: {namespace: arm, parameters: {torque: {type: double, default: 1.0}}}
""",
}


def unmatched(names: str, folder: Path, of_arm: str = "") -> list[str]:
    """Return the warnings about parameter files as ``message (hint)``."""
    files = UNMATCHED | {"robot.yaml": names, "arm_parameters.yaml": of_arm}
    diagnostics = load_project(folder, files).diagnostics
    found = [item for item in diagnostics if item.rule.name == "unmatched-parameters"]
    return [f"{item.message} ({item.hint})" for item in found]


@pytest.mark.parametrize("name", ["/*", "/*/*/motor", "/base/*/*", "/**/moter", "/*/left_motor/*"])
def test_wildcards_that_match_no_node_are_reported(name: str, tmp_path: Path) -> None:
    (warning,) = unmatched(section(f'"{name}"', 2.0), tmp_path)
    assert warning.startswith(f"no node of this system matches '{name}' ('*' stands for one part")


def test_wildcards_that_match_no_parameter_are_reported(tmp_path: Path) -> None:
    text = '"/**": {ros__parameters: {speed: 1.0, torqe: 1.0, use_sim_time: off}}\n'
    assert unmatched(text, tmp_path) == [
        "no node that '/**' matches has a parameter 'torqe' (did you mean 'torque'?)"
    ]
    text = "/**: {ros__parameters: {qos_overrides./clock.subscription.depth: 1}}\n"
    assert unmatched(text, tmp_path) == []


@pytest.mark.parametrize("name", ["/**/motor", "/arm/motor"])
def test_parameters_that_the_prefix_of_an_include_misses(name: str, tmp_path: Path) -> None:
    text = f'"{name}": {{ros__parameters: {{}}}}\n'
    assert unmatched("", tmp_path, text) == [
        f"'{name}' does not match '/arm/left_motor', named with the prefix of an include "
        f"(write '{name.replace('motor', 'left_motor')}')"
    ]
    assert unmatched("", tmp_path, text.replace("motor", "left_motor")) == []


def test_a_variable_is_text_and_must_be_of_the_type(tmp_path: Path) -> None:
    first = section("/**", 0).replace("0", "'${speed}'")
    files = {"system.yaml": SYSTEM, "first.yaml": first, "second.yaml": ""}
    found = {item.rule.name: item.message for item in load_project(tmp_path, files).diagnostics}
    assert found["parameter-value"].endswith("must be of type double, not the string '${speed}'")
    assert found["parameter-substitution"] == "'${speed}' is not replaced in parameter files"


def test_a_value_that_the_system_replaces_must_be_valid_too(tmp_path: Path) -> None:
    files = {
        "system.yaml": "system: demo\nparameter_files: [robot.yaml]\n"
        "nodes: {motor: {type: motor, parameters: {speed: 2.0}}}\n",
        "nodes/motor.yaml": "node: motor\n"
        "parameters: {speed: {type: double, default: 1.0, maximum: 5.0}}\n",
        # A value for any node may be meant for others.
        "robot.yaml": section("/motor", 9.0) + section("/**", 7.0),
    }
    [found] = load_project(tmp_path, files).diagnostics
    assert (found.rule.name, found.primary.line) == ("parameter-value", 1)
