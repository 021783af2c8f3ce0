"""Parameters: their types, their values, settings of the command line, and use_sim_time."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import pytest

from composer.language.tree import Plain
from composer.model import USE_SIM_TIME, Parameter, System
from composer.model.resolve import OverrideOptions, read_overrides
from tests.unit.support.checking import valid_system
from tests.unit.support.resolving import quoted, resolve_text, system_of


def start_value(parameter: Parameter) -> Plain:
    return parameter.value.value if parameter.value is not None else None


def test_a_system_gives_values_to_what_its_type_declares(tmp_path: Path) -> None:
    (tmp_path / "planner.yaml").write_text("""\
node: planner
parameters:
  speed: {type: double, default: 1.0}
  points: {type: double_array}
  name: {type: string, default: bob}
""")
    parameters = "{speed: 3, points: [1, 2.5], name: null}"
    text = f"system: robot\nnodes: {{planner: {{type: planner, parameters: {parameters}}}}}\n"
    found = {item.name.value: item for item in system_of(text, tmp_path).nodes[0].parameters}
    assert {name: start_value(item) for name, item in found.items()} == {
        "speed": 3.0,
        "points": [1.0, 2.5],
        "name": "bob",
    }
    speed = found["speed"]
    assert isinstance(start_value(speed), float)
    assert speed.value.span.file.path == "robot.yaml"
    assert speed.default.value == 1.0


@pytest.mark.parametrize(
    ("written", "kind", "value"),
    [
        # A bare value declares a parameter of its type, or of none.
        ("true", "bool", True),
        ("3", "integer", 3),
        ("3.0", "double", 3.0),
        ("abc", "string", "abc"),
        ("[true]", "bool_array", [True]),
        ("[1, 2]", "integer_array", [1, 2]),
        ("[1, 2.5]", "double_array", [1.0, 2.5]),
        ("[a]", "string_array", ["a"]),
        ("null", "${}", None),
        ("'${x}'", "${}", "${x}"),
        ("['${x}']", "${}", ["${x}"]),
        ("[]", "", []),
        ("[1, a]", "", [1, "a"]),
        # A value of another type stays as it is written.
        ("{type: integer, default: 2.0}", "integer", 2.0),
        ("{type: double, default: true}", "double", True),
        ("{type: double, default: fast}", "double", "fast"),
        ("{type: double_array, default: [1, true, a]}", "double_array", [1.0, True, "a"]),
    ],
)
def test_types_and_values(written: str, kind: str, value: object) -> None:
    system = system_of(f"system: robot\nnodes: {{robot: {{parameters: {{p: {written}}}}}}}\n")
    (parameter,) = system.nodes[0].parameters
    assert (parameter.type.value, repr(start_value(parameter))) == (kind, repr(value))
    assert parameter.value is parameter.default


SYSTEM = """\
    system: robot
    nodes:
      planner:
        parameters:
          max_velocity: {type: double, default: 1.0}
          limits.upper: {type: integer_array, default: [1]}
    """


def test_the_last_setting_is_the_parameters_value() -> None:
    settings = ["planner.max_velocity=9", "planner.max_velocity=2", "planner.limits.upper=[3, 4]"]
    velocity, upper = system_of(SYSTEM, settings=settings).nodes[0].parameters
    assert (velocity.value.value, upper.value.value) == (2.0, [3, 4])
    assert isinstance(velocity.value.value, float)
    assert (velocity.value.span.file.path, quoted(velocity.value.span)) == ("--set", "2")
    assert upper.value.span.line == 3
    assert velocity.default.value == 1.0


@pytest.mark.parametrize(
    ("text", "value"), [("true", True), ("'2'", "2"), ("NO", "NO"), ("a=b", "a=b"), ("0x10", 16)]
)
def test_values_are_yaml(text: str, value: object) -> None:
    overrides, diagnostics = read_overrides(OverrideOptions((f"planner.flag={text}",)))
    assert diagnostics == []
    scalar = overrides.by_node["planner"]["flag"].value
    assert scalar.value == value
    assert quoted(scalar.span).strip("'") == str(text).strip("'")


def test_what_is_not_there_is_unknown() -> None:
    system = system_of(SYSTEM, settings=["planer.max_velocity=2.0", "planner.max_speed=2.0"])
    assert [(item.section, item.name.value) for item in system.unknown] == [("nodes", "planer")]
    assert system.unknown[0].known == ("planner",)
    (unknown,) = system.nodes[0].unknown
    assert (unknown.section, unknown.name.value) == ("parameters", "max_speed")
    assert quoted(unknown.name.span) == "max_speed"
    alone = system_of("node: planner\nparameters: {a: 1}\n", settings=["planner.a=2", "other.a=2"])
    assert alone.nodes[0].parameters[0].value.value == 2
    assert [item.name.value for item in alone.unknown] == ["other"]


@pytest.mark.parametrize("text", ["", "=", "planner", "planner=1", "planner.=1", ".x=1", "a.b"])
def test_what_has_no_such_form_is_refused(text: str) -> None:
    _, diagnostics = resolve_text(SYSTEM, settings=["planner.max_velocity=2.0", text])
    assert [diagnostic.rule.name for diagnostic in diagnostics] == ["invalid-override"]
    assert diagnostics[0].primary.line == 2


def test_a_value_that_is_not_yaml_is_a_diagnostic_at_its_place() -> None:
    _, diagnostics = resolve_text(SYSTEM, settings=["planner.max_velocity=[1, 2"])
    assert {diagnostic.primary.file.path for diagnostic in diagnostics} == {"--set"}
    assert diagnostics[0].primary.file.line(1) == "planner.max_velocity=[1, 2"


FILES = {
    "composer.yaml": "{}\n",
    "nodes/typed.yaml": "node: typed\nparameters: {use_sim_time: {type: bool, default: false}}\n",
    "nodes/plain.yaml": "node: plain\n",
}


def loaded(
    folder: Path,
    text: str,
    *settings: str,
    option: bool = False,
    files: Mapping[str, str] | None = None,
) -> System:
    overrides = OverrideOptions(settings, use_sim_time=option)
    all_files = {"system.yaml": text, **FILES, **(files or {})}
    return valid_system(folder, all_files, overrides=overrides)


def values(system: System) -> dict[str, Plain]:
    """Return the value of the parameter for each node; None where it has no value."""
    found = {node.name.value: node.parameter(USE_SIM_TIME) for node in system.nodes}
    assert {item.type.value for item in found.values() if item} == {"bool"}
    return {name: item and item.value.value for name, item in found.items()}


NODES = """\
nodes:
  silent: {}
  of_type: {type: typed}
  own: {parameters: {use_sim_time: false}}
  given: {type: plain, parameters: {use_sim_time: false}}
"""
OF_ALL = {"silent": True, "of_type": True, "own": False, "given": False}


@pytest.mark.parametrize(
    ("text", "option", "expected"),
    [
        # Any node may set it, though its type does not declare it.
        (
            "nodes:\n  a: {parameters: {use_sim_time: true}}\n"
            "  b: {type: plain, parameters: {use_sim_time: true}}\n",
            False,
            {"a": True, "b": True},
        ),
        (f"use_sim_time: true\n{NODES}", False, OF_ALL),
        (f"use_sim_time: false\n{NODES}", True, OF_ALL),
    ],
    ids=["nodes", "the system", "the command line"],
)
def test_node_and_system(
    text: str, option: bool, expected: dict[str, bool], tmp_path: Path
) -> None:
    system = loaded(tmp_path, f"system: s\n{text}", option=option)
    assert values(system) == expected
    assert system.use_sim_time is (expected is OF_ALL)


def test_a_setting_overrides_everything(tmp_path: Path) -> None:
    settings = ("silent.use_sim_time=false", "given.use_sim_time=true")
    system = loaded(tmp_path, f"system: s\nuse_sim_time: true\n{NODES}", *settings)
    assert values(system) == OF_ALL | {"silent": False, "given": True}


@pytest.mark.parametrize(("section", "others"), [("/silent", None), ("/**", True), ("/*", True)])
def test_parameter_files_set_sim_time(section: str, others: bool | None, tmp_path: Path) -> None:
    content = f"{section}: {{ros__parameters: {{use_sim_time: true}}}}\n"
    text = "system: s\nparameter_files: [all.yaml]\nnodes: {silent: {}, other: {type: plain}}\n"
    system = loaded(tmp_path, text, files={"all.yaml": content})
    assert values(system) == {"silent": True, "other": others}


def test_an_included_file_sets_it_for_its_own_nodes(tmp_path: Path) -> None:
    robot = f"system: robot\nuse_sim_time: true\n{NODES}"
    text = "system: s\ninclude: [robot.yaml]\nnodes: {outside: {}}\n"
    system = loaded(tmp_path, text, files={"robot.yaml": robot})
    assert values(system) == OF_ALL | {"outside": None}
    assert not system.use_sim_time
