"""Arguments: their types and choices; and conditions, which use them."""

from __future__ import annotations

import pytest

from composer.language.expand import expand
from composer.language.tree import plain
from tests.unit.support.resolving import quoted, tree_of

DECLARED = """\
system: robot
arguments:
  simulation: false
  lidar: {choices: [velodyne, ouster], default: velodyne}
  rate: {type: double, default: 1}
  robots: 2
  map: {type: string}
  waypoints: {type: double_array, default: [1.5]}
  anything: {}
x: ["${simulation}", "${lidar}", "${rate}", "${robots}", "${map}", "${waypoints}", "${anything}"]
"""
POSITIONS = ("simulation", "lidar", "rate", "robots", "map", "waypoints", "anything")


@pytest.mark.parametrize(
    ("name", "written", "value"),
    [
        # as in launch files
        *(("simulation", text, True) for text in ("true", "True", "'TRUE'", "1", "'1'")),
        *(("simulation", text, False) for text in ("false", "False", "0", "'0'")),
        ("lidar", "ouster", "ouster"),
        ("rate", "2", 2.0),
        ("rate", "2.5", 2.5),
        # a default of 2 does not say that 2.5 is wrong
        ("robots", "2.5", 2.5),
        # as it is written
        ("map", "1.10", "1.10"),
        ("map", "true", "true"),
        ("waypoints", "[1, 2.5]", [1.0, 2.5]),
        ("anything", "{a: [1]}", {"a": [1]}),
    ],
)
def test_a_value_gets_the_declared_type(name: str, written: str, value: object) -> None:
    given = {entry.name: entry for entry in tree_of(f"{name}: {written}")}
    expanded, diagnostics, *_ = expand(tree_of(DECLARED), given)
    assert diagnostics == []
    result = plain(expanded.entries[-1].value)
    assert repr(result[POSITIONS.index(name)]) == repr(value)


@pytest.mark.parametrize(
    ("name", "written", "rule", "message", "hint"),
    [
        ("simulation", "maybe", "wrong-type", "argument 'simulation' is of type bool, not 'ma", ""),
        ("simulation", "2", "wrong-type", "argument 'simulation' is of type bool, not '2'", ""),
        ("rate", "fast", "wrong-type", "argument 'rate' is of type double, not 'fast'", ""),
        ("robots", "two", "wrong-type", "argument 'robots' is a number, not 'two'", ""),
        ("robots", "true", "wrong-type", "argument 'robots' is a number, not 'true'", ""),
        ("map", "[a]", "wrong-type", "argument 'map' is of type string, not a list", ""),
        ("waypoints", "1.5", "wrong-type", "argument 'waypoints' is of type double_array", "list"),
        ("waypoints", "[a]", "wrong-type", "argument 'waypoints' is of type double_array", ""),
        ("lidar", "velodine", "unknown-word", "'velodine' is not a choice of", "'velodyne'?"),
        ("lidar", "sick", "unknown-word", "'sick' is not a choice", "one of 'velodyne', 'ouster'"),
        ("lidra", "sick", "unknown-variable", "'robot' has no argument 'lidra'", "'lidar'?"),
    ],
)
def test_wrong_values_are_reported(
    name: str, written: str, rule: str, message: str, hint: str
) -> None:
    tree = tree_of(f"{name}: {written}", "given")
    _, [diagnostic], *_ = expand(tree_of(DECLARED), {entry.name: entry for entry in tree})
    assert (diagnostic.rule.name, diagnostic.primary.file.path) == (rule, "given")
    assert diagnostic.message.startswith(message)
    assert hint in (diagnostic.hint or "")


def test_a_default_has_to_be_a_choice_of_the_type() -> None:
    text = "system: s\narguments: {a: {type: integer, default: x}, b: {choices: [1], default: 2}}\n"
    _, diagnostics, *_ = expand(tree_of(f'{text}x: "${{a}} ${{b}}"'), {})
    assert [(item.rule.name, quoted(item.primary)) for item in diagnostics] == [
        ("wrong-type", "x"),
        ("unknown-word", "2"),
    ]


CONDITIONAL = """\
system: robot
arguments: {simulation: false, lidar: ouster, robots: 2, word: "true", late: {type: bool}}
nodes:
  n_${i}: {for_each: {i: [1, 2]}, %s}
x: "${simulation} ${lidar} ${robots} ${word} ${late}"
"""


@pytest.mark.parametrize(
    ("conditions", "names"),
    [
        ("if: true", ["n_1", "n_2"]),
        ("if: false", []),
        ("if: simulation", []),
        ("unless: simulation", ["n_1", "n_2"]),
        ("if: '${simulation}'", []),
        ("if: '${not simulation}'", ["n_1", "n_2"]),
        ("if: lidar == 'ouster'", ["n_1", "n_2"]),
        ("if: \"lidar in ('ouster', 'velodyne') and robots > 1\"", ["n_1", "n_2"]),
        ("if: i == 2", ["n_2"]),
        ("if: robots >= i, unless: i == 1", ["n_2"]),
        # a text is true or false as in launch files
        ("if: word", ["n_1", "n_2"]),
        # without a value, nothing is left out
        ("if: late", ["n_1", "n_2"]),
        ("unless: late", ["n_1", "n_2"]),
    ],
)
def test_a_condition_decides_what_is_there(conditions: str, names: list[str]) -> None:
    expanded, diagnostics, left_out, _ = expand(tree_of(CONDITIONAL % conditions), {})
    assert diagnostics == []
    assert plain(expanded.get("nodes")) == {name: {} for name in names}
    assert {item.name for item in left_out} == {"n_1", "n_2"} - {*names}


@pytest.mark.parametrize(
    ("condition", "rule", "place", "hint"),
    [
        ("lidar", "malformed-variable", "lidar", "compare it: lidar == 'ouster'"),
        ("robots", "malformed-variable", "robots", ""),
        ("[simulation]", "malformed-variable", "[", ""),
        ("lidra == 'ouster'", "unknown-variable", "lidra", "did you mean 'lidar'?"),
        ("not simulation &&", "malformed-variable", "&&", "write 'and'"),
        ("\"'${lidar}' == 'ouster'\"", "malformed-variable", None, "write the names alone"),
        ("lidar > 1", "malformed-variable", "lidar > 1", ""),
    ],
)
def test_wrong_conditions_are_reported(
    condition: str, rule: str, place: str | None, hint: str
) -> None:
    _, diagnostics, *_ = expand(tree_of(CONDITIONAL % f"if: {condition}"), {})
    [diagnostic] = {(item.rule.name, str(item.primary)): item for item in diagnostics}.values()
    assert diagnostic.rule.name == rule
    assert place is None or quoted(diagnostic.primary) == place
    assert hint in (diagnostic.hint or "")


def test_what_is_left_out_uses_its_arguments() -> None:
    text = 'system: s\narguments: {a: 1}\nnodes: {n: {if: false, namespace: "${a}"}}'
    assert expand(tree_of(text), {}).diagnostics == []
