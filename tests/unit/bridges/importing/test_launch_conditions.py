"""Conditions of launch files: short, and true when the launch file starts a node."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Mapping
from importlib.util import find_spec
from itertools import product
from pathlib import Path
from typing import Any

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from composer.bridges.importing.conditions import condition
from composer.language.tree import plain
from composer.loading import load_models
from composer.model.resolve import OverrideOptions
from tests.examples import examples
from tests.unit.bridges.importing.test_launch_arguments import (
    Described,
    Values,
    argument,
    conditions,
    errors,
    switches,
    visited,
)
from tests.unit.bridges.importing.test_launch_file import node
from tests.unit.support.checking import load_project

A, B = ({"a": a, "b": b} for a, b in (("false", "x"), ("false", "y")))
C, D = ({"a": a, "b": b} for a, b in (("true", "x"), ("true", "y")))


@pytest.mark.parametrize(
    ("visits", "present", "expected"),
    [
        ([A, B, C, D], [0, 1, 2, 3], {}),
        ([A, B, C, D], [0, 1], {"unless": "a"}),
        ([A, B, C, D], [2, 3], {"if": "a"}),
        ([A, B, C, D], [0, 2], {"unless": "b == 'y'"}),
        ([A, B, C, D], [1, 3], {"if": "b == 'y'"}),
        ([A, B, C, D], [1], {"if": "not a and b == 'y'"}),
        ([A, B, C, D], [0, 1, 2], {"unless": "a and b == 'y'"}),
        ([A, B, C, D], [0, 3], {"unless": "not a and b == 'y' or a and b == 'x'"}),
        # No double negation.
        ([{"viewer": "true"}, {"viewer": "false"}], [0], {"if": "viewer"}),
        ([{"viewer": "true"}, {"viewer": "false"}], [1], {"unless": "viewer"}),
    ],
)
def test_conditions(
    visits: list[dict[str, str]], present: list[int], expected: dict[str, str]
) -> None:
    assert condition(visits, present) == expected


def test_a_condition_that_would_be_too_long_is_divided(tmp_path: Path) -> None:
    def nodes(values: Values) -> Described:
        is_odd = [*values.values()].count("true") % 2 == 1
        return [node("odd"), node("nav")] if is_odd else [node("nav")]

    names = "abcdef"
    system, _ = visited(nodes, *switches(*names))
    for number, expected in ((0, 1), (1, 2), (2, 1), (5, 2)):
        overrides = OverrideOptions(arguments=tuple(f"{name}=true" for name in names[:number]))
        files = {"s.yaml": yaml.safe_dump(system)}
        assert len(load_project(tmp_path, files, overrides=overrides).system.nodes) == expected


VALUES = {"a": ["true", "false"], "b": ["True", "False"], "c": ["x", "y", "z"], "d": ["one", "any"]}
ARGUMENTS = [
    argument("a", "false"),
    argument("b", "True"),
    argument("c", "x", *VALUES["c"]),
    argument("d", "any"),
]
TESTS = st.dictionaries(
    st.sampled_from(sorted(VALUES)), st.integers(min_value=0, max_value=1), max_size=3
)
NODES = st.lists(
    st.tuples(
        TESTS,  # the values with which there is a node
        TESTS,  # those that give it an argument
        st.sampled_from([None, *VALUES]),  # the argument that is its parameter
    ),
    min_size=1,
    max_size=3,
)


def holds(tests: Mapping[str, int], values: Mapping[str, str]) -> bool:
    """Return whether each value is the one with that index; of "d", only "one" is compared."""
    return all(
        (values[name] == "one") == (index == 0)
        if name == "d"
        else values[name] == VALUES[name][index]
        for name, index in tests.items()
    )


@given(NODES, st.lists(st.sampled_from(list(product(*VALUES.values()))), min_size=4, max_size=4))
@examples(40)
def test_a_system_starts_what_the_launch_file_starts(
    tmp_path_factory: pytest.TempPathFactory,
    described: list[Any],
    combinations: list[tuple[str, ...]],
) -> None:
    def nodes(values: Mapping[str, str]) -> list[dict[str, Any]]:
        return [
            node(
                f"n{number}",
                arguments=["-v"] if holds(verbose, values) else [],
                parameters={} if name is None else {"p": values[name]},
            )
            for number, (present, verbose, name) in enumerate(described)
            if holds(present, values)
        ]

    # What a condition compares: of "d", one constant.
    used = {name for present, verbose, _ in described for name in (*present, *verbose)}
    compared = {"d": ["one"]} if "d" in used else {}
    system, _ = visited(nodes, *ARGUMENTS, **compared)
    path = tmp_path_factory.mktemp("system") / "s.yaml"
    path.write_text(yaml.safe_dump(system))
    for chosen in combinations:
        values = dict(zip(VALUES, chosen, strict=True))
        expected = {item["name"]: (item["arguments"], item["parameters"]) for item in nodes(values)}
        words = tuple(f"{k}={v}" for k, v in values.items() if k in system.get("arguments", {}))
        [result] = load_models([path], OverrideOptions(arguments=words))
        tree = plain(result.tree) if result.tree is not None else {}
        assert isinstance(tree, dict)
        found = {
            item.get("name", key): (
                item["executable"].get("arguments", []),
                {name: str(each["default"]) for name, each in item.get("parameters", {}).items()},
            )
            for key, item in tree.get("nodes", {}).items()
        }
        assert {k: (a, {n: t.lower() for n, t in p.items()}) for k, (a, p) in found.items()} == {
            k: (a, {n: t.lower() for n, t in p.items()}) for k, (a, p) in expected.items()
        }


LAUNCH = """\
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.conditions import IfCondition, LaunchConfigurationEquals, UnlessCondition
from launch.substitutions import LaunchConfiguration, PythonExpression
from launch_ros.actions import Node

def generate_launch_description():
    sim, model = LaunchConfiguration("sim"), LaunchConfiguration("model")
    is_burger = PythonExpression(["'", model, "' == 'burger'"])
    return LaunchDescription([
        DeclareLaunchArgument("sim", default_value="false", description="Simulate."),
        DeclareLaunchArgument("lidar", default_value="sick", choices=["sick", "ouster"]),
        DeclareLaunchArgument("model", default_value="waffle"),
        DeclareLaunchArgument("map", default_value="/a.yaml"),
        DeclareLaunchArgument("ip", description="Where it is."),
        Node(package="p", executable="sim", name="sim", condition=IfCondition(sim)),
        Node(package="p", executable="base", name="base", condition=UnlessCondition(sim)),
        Node(package="p", executable="o", name="lidar",
             condition=LaunchConfigurationEquals("lidar", "ouster")),
        Node(package="p", executable="b", name="arm", condition=IfCondition(is_burger)),
        Node(package="p", executable="m", name="map", parameters=[
            {"use_sim_time": sim, "yaml": LaunchConfiguration("map"),
             "ip": LaunchConfiguration("ip")}]),
    ])
"""


@pytest.mark.skipif(find_spec("launch_ros") is None, reason="needs launch_ros")
def test_a_launch_file_keeps_its_arguments(tmp_path: Path) -> None:
    (tmp_path / "robot.launch.py").write_text(LAUNCH)
    command = [sys.executable, "-m", "composer", "import", "launch", "robot.launch.py"]
    subprocess.run([*command, "-o", "robot.yaml"], cwd=tmp_path, check=True, timeout=60)
    system = yaml.safe_load((tmp_path / "robot.yaml").read_text())
    assert system["arguments"] == {
        "sim": {"default": False, "description": "Simulate."},
        "lidar": {"default": "sick", "choices": ["sick", "ouster"]},
        "model": "waffle",
        "map": "/a.yaml",
        "ip": {"type": "string", "description": "Where it is."},
    }
    assert {name: conditions(item) for name, item in system["nodes"].items()} == {
        "sim": {"if": "sim"},
        "base": {"unless": "sim"},
        "lidar": {"if": "lidar == 'ouster'"},
        "arm": {"if": "model == 'burger'"},
        "map": {},
    }
    values = {name: item["default"] for name, item in system["nodes"]["map"]["parameters"].items()}
    assert values == {"use_sim_time": "${sim}", "yaml": "${map}", "ip": "${ip}"}
    assert errors(system, tmp_path) == []
