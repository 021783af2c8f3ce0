from __future__ import annotations

import pytest

from composer.model.resolve import OverrideOptions, read_overrides
from tests.unit.support.resolving import quoted, resolve_text, system_of

SYSTEM = """\
    system: robot
    nodes:
      planner:
        parameters:
          max_velocity: {type: double, default: 1.0}
          limits.upper: {type: integer_array, default: [1]}
    """


def test_a_setting_is_the_parameters_value() -> None:
    system = system_of(SYSTEM, settings=["planner.max_velocity=2", "planner.limits.upper=[3, 4]"])
    velocity, upper = system.nodes[0].parameters
    assert velocity.value is not None
    assert upper.value is not None
    assert (velocity.value.value, upper.value.value) == (2.0, [3, 4])
    assert isinstance(velocity.value.value, float)
    assert (velocity.value.span.file.path, quoted(velocity.value.span)) == ("--set", "2")
    assert upper.value.span.line == 2
    assert velocity.default is not None
    assert velocity.default.value == 1.0


def test_of_two_settings_the_last_counts() -> None:
    settings = ["planner.max_velocity=2.0", "planner.max_velocity=3.0"]
    value = system_of(SYSTEM, settings=settings).nodes[0].parameters[0].value
    assert value is not None
    assert value.value == 3.0


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


@pytest.mark.parametrize("text", ["", "=", "planner", "planner=1", "planner.=1", ".x=1", "a.b"])
def test_what_has_no_such_form_is_refused(text: str) -> None:
    _, diagnostics = resolve_text(SYSTEM, settings=["planner.max_velocity=2.0", text])
    assert [diagnostic.rule.name for diagnostic in diagnostics] == ["invalid-override"]
    assert diagnostics[0].primary.line == 2


def test_a_value_that_is_not_yaml_is_a_diagnostic_at_its_place() -> None:
    _, diagnostics = resolve_text(SYSTEM, settings=["planner.max_velocity=[1, 2"])
    assert diagnostics
    assert all(diagnostic.primary.file.path == "--set" for diagnostic in diagnostics)
    assert diagnostics[0].primary.file.line(1) == "planner.max_velocity=[1, 2"


def test_a_setting_of_a_node_type_alone() -> None:
    system = system_of("node: planner\nparameters: {a: 1}\n", settings=["planner.a=2", "other.a=2"])
    value = system.nodes[0].parameters[0].value
    assert value is not None
    assert value.value == 2
    assert [item.name.value for item in system.unknown] == ["other"]
