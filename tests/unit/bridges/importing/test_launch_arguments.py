"""Arguments and conditions of launch files: what ``compose import launch`` keeps of them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import pytest
import yaml

from composer.base.diagnostics import Severity
from composer.bridges.importing.found import FoundSystem
from composer.bridges.importing.launch_file import describe_launch_file
from composer.bridges.importing.writing import write_system
from composer.launch.variants import all_visits, mark
from composer.loading import load, load_files
from composer.model.resolve import OverrideOptions
from tests.unit.bridges.importing.test_launch_file import node

Nodes = Callable[[Mapping[str, str]], list[dict[str, Any]]]


def argument(name: str, default: str | None, *choices: str) -> dict[str, Any]:
    value = {
        "default": default,
        "value": default if default is not None else [*choices, mark(name)][0],
    }
    return {"name": name, **value, "description": "", "choices": list(choices)}


def described(nodes: Nodes, *arguments: dict[str, Any], **compared: list[str]) -> FoundSystem:
    """Return the description of a launch file that has ``nodes(values)``."""
    defaults = {item["name"]: item["value"] for item in arguments}

    def visit(values: Mapping[str, str]) -> dict[str, Any]:
        declared = [
            {**item, "value": values.get(item["name"], item["value"])} for item in arguments
        ]
        return {
            "nodes": nodes({**defaults, **values}),
            "left_out": [],
            "arguments": declared,
            "compared": compared,
        }

    return describe_launch_file("s", "f.launch.py", (), all_visits(visit, {}))


def visited(
    nodes: Nodes, *arguments: dict[str, Any], **compared: list[str]
) -> tuple[dict[str, Any], tuple[str, ...]]:
    """Return the system and what is left out of a launch file that has ``nodes(values)``."""
    found = described(nodes, *arguments, **compared)
    return yaml.safe_load(write_system(found)), found.left_out


def conditions(item: Mapping[str, Any]) -> dict[str, str]:
    return {key: item[key] for key in ("if", "unless") if key in item}


def test_a_condition_is_kept() -> None:
    system, _ = visited(
        lambda values: [node("sim" if values["sim"] == "true" else "driver"), node("nav")],
        argument("sim", "false"),
    )
    assert system["arguments"] == {"sim": False}
    assert {name: conditions(item) for name, item in system["nodes"].items()} == {
        "driver": {"unless": "sim"},
        "nav": {},
        "sim": {"if": "sim"},
    }


def test_values_become_references() -> None:
    def nodes(values: Mapping[str, str]) -> list[dict[str, Any]]:
        sim = values["sim"] == "true"
        parameters = {
            "use_sim_time": sim,
            "rate": 5.0 if values["rate"] == "5.0" else values["rate"],
        }
        remappings = {"scan": f"/{values['robot']}/scan"}
        return [
            node(
                "nav", parameters=parameters, remappings=remappings, namespace=f"/{values['robot']}"
            )
        ]

    system, left_out = visited(
        nodes, argument("sim", "false"), argument("rate", "5.0"), argument("robot", "r1")
    )
    assert left_out == ()
    assert system["arguments"] == {"sim": False, "rate": 5.0, "robot": "r1"}
    assert system["nodes"]["nav"] == {
        "namespace": "/${robot}",
        "executable": {"package": "p", "name": "program"},
        "parameters": {
            "use_sim_time": {"type": "bool", "default": "${sim}"},
            "rate": {"type": "double", "default": "${rate}"},
        },
        "remappings": {"scan": "/${robot}/scan"},
    }


def test_a_parameter_of_a_conditional_node_has_the_type_of_the_argument() -> None:
    def nodes(values: Mapping[str, str]) -> list[dict[str, Any]]:
        rate = 5.0 if values["rate"] == "5.0" else values["rate"]
        parameters = {"use_sim_time": values["sim"] == "True", "rate": rate, "key": values["key"]}
        return [node("view", parameters=parameters)] if values["gui"] == "False" else [node()]

    names = {"gui": "True", "sim": "True", "rate": "5.0", "key": ""}
    system, _ = visited(nodes, *[argument(*item) for item in names.items()])
    assert system["arguments"] == {"gui": True, "sim": True, "rate": 5.0, "key": ""}
    assert system["nodes"]["view"]["parameters"] == {
        "use_sim_time": {"type": "bool", "default": "${sim}"},
        "rate": {"type": "double", "default": "${rate}"},
        "key": {"type": "string", "default": "${key}"},
    }


def test_what_differs_in_another_way_has_a_condition_for_each() -> None:
    def nodes(values: Mapping[str, str]) -> list[dict[str, Any]]:
        return [node("nav", arguments=["-x"] if values["fast"] == "True" else ["-y", "-z"])]

    system, _ = visited(nodes, argument("fast", "False"))
    first, second = system["nodes"].values()
    assert (first["executable"]["arguments"], conditions(first)) == (
        ["-y", "-z"],
        {"unless": "fast"},
    )
    assert (second["executable"]["arguments"], conditions(second)) == (["-x"], {"if": "fast"})
    assert {first.get("name", "nav"), second["name"]} == {"nav"}


def test_components_are_in_the_container_that_is_there(tmp_path: Path) -> None:
    component = {"package": "demo", "plugin": "demo::Camera"}

    def nodes(values: Mapping[str, str]) -> list[dict[str, Any]]:
        # A prefix is left out, so it does not make another container.
        prefix = {"left_out": ["prefix: gdb"] * (values["gdb"] == "true")}
        arguments = ["-x"] if values["fast"] == "true" else ["-y", "-z"]
        box = node("box", arguments=arguments, process=prefix)
        camera = node("camera", component=component, container=("/", "box"))
        return [camera] if values["own"] == "false" else [box, camera]

    names = ("fast", "gdb", "own")
    system, left_out = visited(nodes, *(argument(name, "true") for name in names))
    file = tmp_path / "s.yaml"
    file.write_text(yaml.safe_dump(system))
    assert not [item for item in load(file).diagnostics if item.severity is Severity.ERROR]
    containers = {
        item["container"]: (name, conditions(item))
        for name, item in system["nodes"].items()
        if "container" in item
    }
    assert containers == {
        "box": ("camera", {"if": "own and fast"}),
        "box_2": ("camera_2", {"if": "own and not fast"}),
        "box_3": ("camera_3", {"unless": "own"}),
    }
    assert conditions(system["nodes"]["box_3"]) == {"unless": "own"}
    assert left_out == (
        "argument gdb: no node depends on it",
        "prefix: gdb (of /box)",
    )


@pytest.mark.parametrize(
    ("choices", "declared", "is_fast"),
    [
        ((), False, "fast"),
        (("true", "false"), False, "fast"),
        (
            ("true", "false", "auto"),
            {"default": "false", "choices": ["true", "false", "auto"]},
            "fast == 'true'",
        ),
    ],
)
def test_as_few_nodes_as_possible(
    choices: tuple[str, ...], declared: object, is_fast: str, tmp_path: Path
) -> None:
    def nodes(values: Mapping[str, str]) -> list[dict[str, Any]]:
        fast = values["fast"] == "true"
        parameters = {"use_sim_time": values["sim"] == "true", "fast": fast}
        arguments = ["-x"] if fast else ["-y", "-z"]
        return [node("nav", arguments=arguments, parameters=parameters)]

    system, _ = visited(nodes, argument("fast", "false", *choices), argument("sim", "false"))
    assert system["arguments"] == {"fast": declared, "sim": False}
    slow, fast = system["nodes"].values()
    assert (conditions(slow), conditions(fast)) == ({"unless": is_fast}, {"if": is_fast})
    assert slow["parameters"]["use_sim_time"]["default"] == "${sim}"
    (tmp_path / "s.yaml").write_text(yaml.safe_dump(system))
    [result] = load_files([tmp_path / "s.yaml"])
    assert [item.message for item in result.diagnostics if item.severity.value == "error"] == []


def test_what_cannot_be_kept_is_listed() -> None:
    def nodes(values: Mapping[str, str]) -> list[dict[str, Any]]:
        return [node(f"robot_{number}") for number in range(int(values["robots"]))]

    system, left_out = visited(nodes, argument("robots", "2"), argument("unused", "x"))
    assert sorted(system["nodes"]) == ["robot_0", "robot_1"]
    assert left_out == (
        "argument robots: the system has its value, and cannot change it",
        "argument unused: no node depends on it",
    )


def test_values_and_combinations_that_fail_are_left_out() -> None:
    def nodes(values: Mapping[str, str]) -> list[dict[str, Any]]:
        if values["slam"] == "True":
            raise KeyError("package 'slam' not found")
        if values["sim"] == values["gui"] == "true":
            raise OSError
        return [node(values["robot"]), *[node(name) for name in ("sim", "gui") if values[name]]]

    def arguments(robot: str) -> list[dict[str, Any]]:
        switches = [argument(name, "false") for name in ("sim", "gui")]
        return [argument("slam", "False"), *switches, argument("robot", robot, "r1", "r2", "r3")]

    system, left_out = visited(nodes, *arguments("r1"))
    assert set(system["arguments"]) == {"robot"}
    assert left_out == (
        "argument slam: the system has its value, and cannot change it:"
        " with 'True', KeyError: package 'slam' not found",
        "argument gui: the system has its value, and cannot change it",
        "argument sim: no node depends on it",
    )


@pytest.mark.parametrize("robot", ["r1", ""])
def test_parameters_of_inner_nodes_do_not_depend_on_arguments(robot: str) -> None:
    def nodes(values: Mapping[str, str]) -> list[dict[str, Any]]:
        inner = {"sim": values["sim"] == "true", "frame": f"{robot and values['robot']}/odom"}
        sections = {"/costmap": inner} | ({"/map": {}} if values["map"] == "true" else {})
        return [node(f"base_{values['fast']}_{values['robot']}", sections=sections)]

    names = ("sim", "fast", "map")
    system, left_out = visited(
        nodes, argument("robot", "r1"), *[argument(name, "false") for name in names]
    )
    kept = {"fast"} if robot else {"fast", "robot"}
    assert set(system["arguments"]) == kept
    fixed = "argument {}: the system has its value, and cannot change it: {}"
    expected = [
        fixed.format("sim", "with 'true', /costmap inside a program has other parameters"),
        "argument map: no node depends on it",
        "parameters of /costmap: with --output, a file has them",
    ]
    if robot:
        dependent = "nodes inside a program have parameters that depend on it"
        expected.insert(0, fixed.format("robot", dependent))
    assert [text for text in left_out if text in expected] == expected[:-1]


def test_parameters_of_inner_nodes_have_the_values_of_the_defaults() -> None:
    def nodes(values: Mapping[str, str]) -> list[dict[str, Any]]:
        inner = {"enabled": values["slam"] == "true", "rate": 5.0}
        slam = [node("slam")] if values["slam"] == "true" else []
        return [node("nav", sections={"/costmap": inner}), *slam]

    system, left_out = visited(nodes, argument("slam", "false"))
    assert conditions(system["nodes"]["slam"]) == {"if": "slam"}
    assert "parameters of /costmap with other arguments: enabled" in left_out


def test_constants_that_are_compared_and_choices_are_tried(tmp_path: Path) -> None:
    def nodes(values: Mapping[str, str]) -> list[dict[str, Any]]:
        burger = [node("small")] if values["model.name"] == "burger" else [node("large")]
        return [*burger, node(values["lidar"]), node("nav")]

    arguments = (argument("model.name", "waffle"), argument("lidar", "sick", "sick", "ouster"))
    system, left_out = visited(nodes, *arguments, **{"model.name": ["burger"]})
    assert left_out == ()
    assert system["arguments"] == {
        "model_name": "waffle",
        "lidar": {"default": "sick", "choices": ["sick", "ouster"]},
    }
    (tmp_path / "s.yaml").write_text(yaml.safe_dump(system))

    def started(*given: str) -> set[str]:
        result = load(tmp_path / "s.yaml", overrides=OverrideOptions(arguments=given))
        assert result.system is not None
        return {item.name.value for item in result.system.nodes}

    assert started() == {"large", "sick", "nav"}
    assert started("model_name=burger", "lidar=ouster") == {"small", "ouster", "nav"}
    assert started("model_name=other") == {"large", "sick", "nav"}


def test_any_other_value_differs_from_the_constants() -> None:
    def nodes(values: Mapping[str, str]) -> list[dict[str, Any]]:
        parameters = {"yaml_filename": values["map"]} if values["map"] else {}
        return [node("map_server", parameters=parameters)]

    system, left_out = visited(nodes, argument("map", ""), map=[""])
    assert left_out == ()
    assert [(conditions(item), item.get("parameters")) for item in system["nodes"].values()] == [
        ({"if": "map == ''"}, None),
        ({"if": "map != ''"}, {"yaml_filename": {"type": "string", "default": "${map}"}}),
    ]


def test_equal_descriptions_have_one_condition() -> None:
    def nodes(values: Mapping[str, str]) -> list[dict[str, Any]]:
        parameters = {"use_sim_time": values["sim"] == "true", "rate": 5}
        arguments = ["-d"] if values["localization"] == "true" else []
        is_third = values["localization"] == values["third"] == "true"
        third = [node("third", parameters={"sim": values["sim"] == "true"})] if is_third else []
        return [node("slam", parameters=parameters, arguments=arguments), *third]

    bools = [argument(name, "false") for name in ("localization", "third")]
    system, _ = visited(nodes, argument("sim", "false", "true", "false"), *bools)
    assert system["arguments"] == {"sim": False, "localization": False, "third": False}
    assert [conditions(item) for item in system["nodes"].values()] == [
        {"unless": "localization"},
        {"if": "localization"},
        {"if": "localization and third"},
    ]
    types = {
        item["parameters"][key]["type"]
        for item in system["nodes"].values()
        for key in item["parameters"]
        if "sim" in key
    }
    assert types == {"bool"}


def test_arguments_without_a_value_need_one() -> None:
    def nodes(values: Mapping[str, str]) -> list[dict[str, Any]]:
        return [node("driver", parameters={"ip": values["ip"], "type": values["type"]})]

    system, _ = visited(nodes, argument("type", None, "ur3", "ur5"), argument("ip", None))
    assert system["arguments"] == {"type": {"choices": ["ur3", "ur5"]}, "ip": {"type": "string"}}
    values = {
        name: item["default"] for name, item in system["nodes"]["driver"]["parameters"].items()
    }
    assert values == {"ip": "${ip}", "type": "${type}"}


def test_a_container_that_something_else_starts_has_the_condition_of_its_components() -> None:
    def nodes(values: Mapping[str, str]) -> list[dict[str, Any]]:
        component = {"package": "p", "plugin": "p::P"}
        changes = {"component": component, "container": ("/", "box")}
        return [node("map", **changes if values["composed"] == "True" else {})]

    system, _ = visited(nodes, argument("composed", "False"))
    assert conditions(system["nodes"]["box"]) == {"if": "composed"}


@pytest.mark.parametrize("composed", ["True", "False"])
def test_a_program_has_the_parameters_of_a_name_that_other_arguments_give(composed: str) -> None:
    """nav2's controller is a component with a name, or a program that names itself."""

    def nodes(values: Mapping[str, str]) -> list[dict[str, Any]]:
        component = {"package": "p", "plugin": "p::P"}
        if values["composed"] == "True":
            container = ("/", "box")
            return [node("a", component=component, container=container, parameters={"rate": 2})]
        return [node(None, executable="a", sections={"/a": {"rate": 2}})]

    found = described(nodes, argument("composed", composed))
    assert found.sections == {"/a": {"rate": 2}}
    assert not found.left_out
