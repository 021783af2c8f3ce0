from __future__ import annotations

from pathlib import Path

import pytest

from composer.language.tree import Plain
from composer.model import Parameter, System
from tests.unit.support.resolving import system_of


def parameters(system: System) -> dict[str, Parameter]:
    return {parameter.name.value: parameter for parameter in system.nodes[0].parameters}


def start_value(parameter: Parameter) -> Plain:
    return parameter.value.value if parameter.value is not None else None


def test_a_system_gives_values_to_what_its_type_declares(tmp_path: Path) -> None:
    (tmp_path / "planner.yaml").write_text(
        "node: planner\n"
        "parameters:\n"
        "  speed: {type: double, default: 1.0}\n"
        "  points: {type: double_array}\n"
        "  name: {type: string, default: bob}\n"
    )
    system = system_of(
        """\
        system: robot
        nodes: {planner: {type: planner, parameters: {speed: 3, points: [1, 2.5], name: null}}}
        """,
        tmp_path,
    )
    found = parameters(system)
    assert {name: start_value(item) for name, item in found.items()} == {
        "speed": 3.0,
        "points": [1.0, 2.5],
        "name": "bob",
    }
    speed = found["speed"]
    assert isinstance(start_value(speed), float)
    assert speed.value is not None
    assert speed.value.span.file.path == "robot.yaml"
    assert speed.default is not None
    assert speed.default.value == 1.0


@pytest.mark.parametrize(
    ("written", "kind", "value"),
    [
        ("true", "bool", True),
        ("3", "integer", 3),
        ("3.0", "double", 3.0),
        ("abc", "string", "abc"),
        ("[true]", "bool_array", [True]),
        ("[1, 2]", "integer_array", [1, 2]),
        ("[1, 2.5]", "double_array", [1.0, 2.5]),
        ("[a]", "string_array", ["a"]),
    ],
)
def test_a_bare_value_declares_a_parameter_of_its_type(
    written: str, kind: str, value: object
) -> None:
    system = system_of(f"system: robot\nnodes: {{robot: {{parameters: {{p: {written}}}}}}}\n")
    parameter = parameters(system)["p"]
    assert (parameter.type.value, start_value(parameter)) == (kind, value)
    assert parameter.value is parameter.default
    assert [type(item) for item in [start_value(parameter)]] == [type(value)]


@pytest.mark.parametrize(
    ("written", "kind"),
    [("null", "${}"), ("'${x}'", "${}"), ("['${x}']", "${}"), ("[]", ""), ("[1, a]", "")],
)
def test_a_bare_value_may_have_no_type(written: str, kind: str) -> None:
    system = system_of(f"system: robot\nnodes: {{robot: {{parameters: {{p: {written}}}}}}}\n")
    assert parameters(system)["p"].type.value == kind


@pytest.mark.parametrize(
    ("kind", "written", "value"),
    [
        ("integer", "2.0", 2.0),
        ("double", "true", True),
        ("double", "fast", "fast"),
        ("double_array", "[1, true, a]", [1.0, True, "a"]),
    ],
)
def test_a_value_of_another_type_stays_as_it_is_written(
    kind: str, written: str, value: object
) -> None:
    system = system_of(
        "system: robot\nnodes:\n"
        f"  robot: {{parameters: {{p: {{type: {kind}, default: {written}}}}}}}\n"
    )
    found = start_value(parameters(system)["p"])
    assert (found, type(found)) == (value, type(value))
