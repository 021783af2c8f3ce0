"""Arguments and conditions of launch files: what ``compose import launch`` keeps of them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import pytest
import yaml

from composer.base.diagnostics import Severity
from composer.bridges.importing import FoundSystem
from composer.bridges.importing.launch_file import describe_launch_file
from composer.bridges.importing.writing import write_system
from composer.launch.variants import all_visits, mark
from composer.loading import load_files
from composer.model.resolve import OverrideOptions
from tests.unit.bridges.importing.test_launch_file import node
from tests.unit.support.checking import load_project, write_files

Values = Mapping[str, str]
Described = list[dict[str, Any]]
Nodes = Callable[[Values], Described]
COMPONENT = {"package": "demo", "plugin": "demo::Camera"}


def argument(name: str, default: str | None, *choices: str) -> dict[str, Any]:
    value = default if default is not None else [*choices, mark(name)][0]
    item = {"name": name, "default": default, "value": value, "description": ""}
    return {**item, "choices": list(choices)}


def switches(*names: str, default: str = "false") -> Described:
    return [argument(name, default) for name in names]


def described(nodes: Nodes, *arguments: dict[str, Any], **compared: list[str]) -> FoundSystem:
    """Return the description of a launch file that has ``nodes(values)``."""
    defaults = {item["name"]: item["value"] for item in arguments}

    def visit(values: Values) -> dict[str, Any]:
        declared = [
            {**item, "value": values.get(item["name"], item["value"])} for item in arguments
        ]
        found = {"nodes": nodes({**defaults, **values}), "arguments": declared}
        return {**found, "left_out": [], "compared": compared}

    return describe_launch_file("s", "f.launch.py", (), all_visits(visit, {}))


def visited(
    nodes: Nodes, *arguments: dict[str, Any], **compared: list[str]
) -> tuple[dict[str, Any], tuple[str, ...]]:
    """Return the system and what is left out of a launch file that has ``nodes(values)``."""
    found = described(nodes, *arguments, **compared)
    return yaml.safe_load(write_system(found)), found.left_out


def errors(system: dict[str, Any], folder: Path) -> list[str]:
    """Return the messages about errors in a system, with any combination of its arguments."""
    write_files(folder, {"s.yaml": yaml.safe_dump(system)})
    [result] = load_files([folder / "s.yaml"])
    return [item.message for item in result.diagnostics if item.severity is Severity.ERROR]


def conditions(item: Mapping[str, Any]) -> dict[str, str]:
    return {key: item[key] for key in ("if", "unless") if key in item}


def test_conditions_are_kept_and_values_become_references() -> None:
    def nodes(values: Values) -> Described:
        rate = 5.0 if values["rate"] == "5.0" else values["rate"]
        nav = node(
            "nav",
            parameters={"use_sim_time": values["sim"] == "true", "rate": rate},
            remappings={"scan": f"/{values['robot']}/scan"},
            namespace=f"/{values['robot']}",
        )
        return [node("sim" if values["sim"] == "true" else "driver"), nav]

    arguments = (argument("sim", "false"), argument("rate", "5.0"), argument("robot", "r1"))
    system, left_out = visited(nodes, *arguments)
    assert left_out == ()
    assert system["arguments"] == {"sim": False, "rate": 5.0, "robot": "r1"}
    found = system["nodes"]
    assert {name: conditions(item) for name, item in found.items()} == {
        "driver": {"unless": "sim"},
        "nav": {},
        "sim": {"if": "sim"},
    }
    assert found["nav"] == {
        "namespace": "/${robot}",
        "executable": {"package": "p", "name": "program"},
        "parameters": {
            "use_sim_time": {"type": "bool", "default": "${sim}"},
            "rate": {"type": "double", "default": "${rate}"},
        },
        "remappings": {"scan": "/${robot}/scan"},
    }


def test_a_parameter_of_a_conditional_node_has_the_type_of_the_argument() -> None:
    def nodes(values: Values) -> Described:
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


def test_components_are_in_the_container_that_is_there(tmp_path: Path) -> None:
    def nodes(values: Values) -> Described:
        # A prefix is left out, so it does not make another container.
        prefix = {"left_out": ["prefix: gdb"] * (values["gdb"] == "true")}
        arguments = ["-x"] if values["fast"] == "true" else ["-y", "-z"]
        box = node("box", arguments=arguments, process=prefix)
        camera = node("camera", component=COMPONENT, container=("/", "box"))
        return [camera] if values["own"] == "false" else [box, camera]

    system, left_out = visited(nodes, *switches("fast", "gdb", "own", default="true"))
    assert errors(system, tmp_path) == []
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
    assert left_out == ("argument gdb: no node depends on it", "prefix: gdb (of /box)")


THREE = ["true", "false", "auto"]


@pytest.mark.parametrize(
    ("choices", "declared", "is_fast"),
    [
        ([], False, "fast"),
        (["true", "false"], False, "fast"),
        (THREE, {"default": "false", "choices": THREE}, "fast == 'true'"),
    ],
)
def test_few_conditions(choices: list[str], declared: object, is_fast: str, tmp_path: Path) -> None:
    """What differs in a way that no argument gives has a condition for each."""

    def nodes(values: Values) -> Described:
        fast = values["fast"] == "true"
        parameters = {"use_sim_time": values["sim"] == "true", "fast": fast}
        arguments = ["-x"] if fast else ["-y", "-z"]
        return [node("nav", arguments=arguments, parameters=parameters)]

    system, _ = visited(nodes, argument("fast", "false", *choices), argument("sim", "false"))
    assert system["arguments"] == {"fast": declared, "sim": False}
    slow, fast = system["nodes"].values()
    assert (conditions(slow), conditions(fast)) == ({"unless": is_fast}, {"if": is_fast})
    assert [item["executable"]["arguments"] for item in (slow, fast)] == [["-y", "-z"], ["-x"]]
    assert {slow.get("name", "nav"), fast["name"]} == {"nav"}
    assert slow["parameters"]["use_sim_time"]["default"] == "${sim}"
    assert errors(system, tmp_path) == []


FIXED = "the system has its value, and cannot change it"


def test_what_cannot_be_kept_is_listed() -> None:
    def nodes(values: Values) -> Described:
        return [node(f"robot_{number}") for number in range(int(values["robots"]))]

    system, left_out = visited(nodes, argument("robots", "2"), argument("unused", "x"))
    assert sorted(system["nodes"]) == ["robot_0", "robot_1"]
    assert left_out == (f"argument robots: {FIXED}", "argument unused: no node depends on it")


def test_values_and_combinations_that_fail_are_left_out() -> None:
    def nodes(values: Values) -> Described:
        if values["slam"] == "True":
            raise KeyError("package 'slam' not found")
        if values["sim"] == values["gui"] == "true":
            raise OSError
        return [node(values["robot"]), *[node(name) for name in ("sim", "gui") if values[name]]]

    robot = argument("robot", "r1", "r1", "r2", "r3")
    system, left_out = visited(nodes, argument("slam", "False"), *switches("sim", "gui"), robot)
    assert set(system["arguments"]) == {"robot"}
    assert left_out == (
        f"argument slam: {FIXED}: with 'True', KeyError: package 'slam' not found",
        f"argument gui: {FIXED}",
        "argument sim: no node depends on it",
    )


@pytest.mark.parametrize("robot", ["r1", ""])
def test_parameters_of_inner_nodes_do_not_depend_on_arguments(robot: str) -> None:
    def nodes(values: Values) -> Described:
        inner = {"sim": values["sim"] == "true", "frame": f"{robot and values['robot']}/odom"}
        sections = {"/costmap": inner} | ({"/map": {}} if values["map"] == "true" else {})
        return [node(f"base_{values['fast']}_{values['robot']}", sections=sections)]

    system, left_out = visited(nodes, argument("robot", "r1"), *switches("sim", "fast", "map"))
    assert set(system["arguments"]) == ({"fast"} if robot else {"fast", "robot"})
    expected = [
        f"argument sim: {FIXED}: with 'true', /costmap inside a program has other parameters",
        "argument map: no node depends on it",
    ]
    if robot:
        dependent = "nodes inside a program have parameters that depend on it"
        expected.insert(0, f"argument robot: {FIXED}: {dependent}")
    assert [text for text in left_out if text in expected] == expected
    assert "parameters of /costmap: with --output, a file has them" not in left_out


def test_parameters_of_inner_nodes_have_the_values_of_the_defaults() -> None:
    def nodes(values: Values) -> Described:
        inner = {"enabled": values["slam"] == "true", "rate": 5.0}
        slam = [node("slam")] if values["slam"] == "true" else []
        return [node("nav", sections={"/costmap": inner}), *slam]

    system, left_out = visited(nodes, argument("slam", "false"))
    assert conditions(system["nodes"]["slam"]) == {"if": "slam"}
    assert "parameters of /costmap with other arguments: enabled" in left_out


def test_constants_that_are_compared_and_choices_are_tried(tmp_path: Path) -> None:
    def nodes(values: Values) -> Described:
        size = "small" if values["model.name"] == "burger" else "large"
        return [node(size), node(values["lidar"]), node("nav")]

    arguments = (argument("model.name", "waffle"), argument("lidar", "sick", "sick", "ouster"))
    system, left_out = visited(nodes, *arguments, **{"model.name": ["burger"]})
    assert left_out == ()
    assert system["arguments"] == {
        "model_name": "waffle",
        "lidar": {"default": "sick", "choices": ["sick", "ouster"]},
    }
    for given, names in (
        ((), {"large", "sick", "nav"}),
        (("model_name=burger", "lidar=ouster"), {"small", "ouster", "nav"}),
        (("model_name=other",), {"large", "sick", "nav"}),
    ):
        files = {"s.yaml": yaml.safe_dump(system)}
        result = load_project(tmp_path, files, overrides=OverrideOptions(arguments=given))
        assert {item.name.value for item in result.system.nodes} == names


def test_any_other_value_differs_from_the_constants() -> None:
    def nodes(values: Values) -> Described:
        parameters = {"yaml_filename": values["map"]} if values["map"] else {}
        return [node("map_server", parameters=parameters)]

    system, left_out = visited(nodes, argument("map", ""), map=[""])
    assert left_out == ()
    assert [(conditions(item), item.get("parameters")) for item in system["nodes"].values()] == [
        ({"if": "map == ''"}, None),
        ({"if": "map != ''"}, {"yaml_filename": {"type": "string", "default": "${map}"}}),
    ]


def test_equal_descriptions_have_one_condition() -> None:
    def nodes(values: Values) -> Described:
        sim, is_local = values["sim"] == "true", values["localization"] == "true"
        arguments = ["-d"] if is_local else []
        slam = node("slam", parameters={"use_sim_time": sim, "rate": 5}, arguments=arguments)
        is_third = is_local and values["third"] == "true"
        return [slam, node("third", parameters={"sim": sim})] if is_third else [slam]

    sim = argument("sim", "false", "true", "false")
    system, _ = visited(nodes, sim, *switches("localization", "third"))
    assert system["arguments"] == {"sim": False, "localization": False, "third": False}
    assert [conditions(item) for item in system["nodes"].values()] == [
        {"unless": "localization"},
        {"if": "localization"},
        {"if": "localization and third"},
    ]
    for item in system["nodes"].values():
        types = {it["type"] for key, it in item["parameters"].items() if "sim" in key}
        assert types == {"bool"}


def test_arguments_without_a_value_need_one() -> None:
    def nodes(values: Values) -> Described:
        return [node("driver", parameters={"ip": values["ip"], "type": values["type"]})]

    system, _ = visited(nodes, argument("type", None, "ur3", "ur5"), argument("ip", None))
    assert system["arguments"] == {"type": {"choices": ["ur3", "ur5"]}, "ip": {"type": "string"}}
    parameters = system["nodes"]["driver"]["parameters"]
    values = {name: item["default"] for name, item in parameters.items()}
    assert values == {"ip": "${ip}", "type": "${type}"}


def test_a_container_that_something_else_starts_has_the_condition_of_its_components() -> None:
    def nodes(values: Values) -> Described:
        changes = {"component": COMPONENT, "container": ("/", "box")}
        return [node("map", **changes if values["composed"] == "True" else {})]

    system, _ = visited(nodes, argument("composed", "False"))
    assert conditions(system["nodes"]["box"]) == {"if": "composed"}


@pytest.mark.parametrize("composed", ["True", "False"])
def test_a_program_has_the_parameters_of_a_name_that_other_arguments_give(composed: str) -> None:
    """nav2's controller is a component with a name, or a program that names itself."""

    def nodes(values: Values) -> Described:
        if values["composed"] == "True":
            changes = {"component": COMPONENT, "container": ("/", "box")}
            return [node("a", **changes, parameters={"rate": 2})]
        return [node(None, executable="a", sections={"/a": {"rate": 2}})]

    found = described(nodes, argument("composed", composed))
    assert found.sections == {"/a": {"rate": 2}}
    assert not found.left_out
