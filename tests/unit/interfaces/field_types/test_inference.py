"""The types of expressions, and expressions that can never work."""

from __future__ import annotations

import pytest

from composer.interfaces.field_types.inference import infer
from composer.interfaces.field_types.types import described
from composer.language.expressions import FUNCTIONS, compile_expression
from tests.unit.support.field_types import INTERFACES, SCOPE


def inferred(source: str) -> tuple[str, list[str]]:
    found, problems = infer(compile_expression(source), SCOPE, INTERFACES)
    marked = [
        f"{source[item.offset : item.offset + item.length]}: {item.message}" for item in problems
    ]
    return described(found), marked


TYPES = [
    ("1", "int64"),
    ("1.0", "float64"),
    ("'a'", "string"),
    ("true", "bool"),
    ("pi", "float64"),
    ("count + 1", "int64"),
    ("count + 1.0", "float64"),
    ("count / 2", "float64"),
    ("count // 2", "int64"),
    ("message.single % 2", "float64"),
    ("-message.small", "int64"),
    ("message.small", "uint8"),
    ("count + state.free", "unknown type"),
    ("now + state.free", "float64"),
    ("not node", "bool"),
    ("message.on and count > 1", "bool"),
    ("message.on or count", "unknown type"),
    ("1 if message.on else 2.0", "float64"),
    ("'a' if message.on else node", "string"),
    ("1 if message.on else node", "unknown type"),
    ("point if message.on else message.point", "geometry_msgs/msg/Point"),
    ("1 < count <= now", "bool"),
    ("state.free == 'a'", "bool"),
    ("count in (1, -2, 3.5)", "bool"),
    ("'a' in message.many", "bool"),
    ("'a' in node", "bool"),
    ("1 in state.free", "bool"),
    ("missing", "unknown type"),
    ("message", "demo_msgs/msg/Everything"),
    ("parameters", "a map"),
    ("parameters.camera.fps", "int64"),
    ("abs(-1)", "int64"),
    ("atan2(1, 2)", "float64"),
    ("bool(1)", "bool"),
    ("ceil(1.5)", "int64"),
    ("clamp(count, 0, 10)", "int64"),
    ("cos(1)", "float64"),
    ("degrees(1)", "float64"),
    ("float('1')", "float64"),
    ("floor(1.5)", "int64"),
    ("hypot(1, 2)", "float64"),
    ("int(1.5)", "int64"),
    ("len(message.many)", "int64"),
    ("len(state.free)", "int64"),
    ("max(message.three)", "float64"),
    ("max(state.free)", "unknown type"),
    ("min(message.few)", "int64"),
    ("min(1, 2)", "int64"),
    ("radians(1)", "float64"),
    ("round(1.5)", "int64"),
    ("round(1.5, 1)", "float64"),
    ("sin(1)", "float64"),
    ("sqrt(4)", "float64"),
    ("str(1)", "string"),
    ("tan(1)", "float64"),
]


@pytest.mark.parametrize(("source", "expected"), TYPES)
def test_type(source: str, expected: str) -> None:
    found, problems = inferred(source)
    assert found == expected
    assert problems == (
        [] if source != "missing" else ["missing: name 'missing' is not available here"]
    )


def test_every_function_has_a_type() -> None:
    assert {source.partition("(")[0] for source, _ in TYPES if "(" in source} >= set(FUNCTIONS)


@pytest.mark.parametrize(
    ("source", "problem"),
    [
        ("node + 'a'", "node: string where a number is expected"),
        ("1 + message.on", "message.on: bool where a number is expected"),
        ("-point", "point: geometry_msgs/msg/Point where a number is expected"),
        ("1 + message.three", "message.three: float64[3] where a number is expected"),
        ("sqrt(node)", "node: string where a number is expected"),
        ("node == 1", "1: string and int64 are never equal"),
        ("1 < now < node", "node: float64 and string cannot be ordered"),
        ("point == 1", "point: geometry_msgs/msg/Point cannot be compared"),
        ("message.three == 1", "message.three: float64[3] cannot be compared"),
        ("node in (1, 2)", "node: string is never in this list"),
        ("1 in count", "count: int64 is neither a list nor a string"),
        ("len(count)", "count: int64 has no length"),
        ("str(point)", "point: geometry_msgs/msg/Point cannot be compared"),
        ("bool(node)", "node: string where a number is expected"),
        ("max(message.many)", "message.many: string[] where numbers are expected"),
    ],
)
def test_expressions_that_can_never_work(source: str, problem: str) -> None:
    assert problem in inferred(source)[1]


@pytest.mark.parametrize(
    "source", ["1 + (node + 1)", "sqrt(-node)", "mesage.x == 'a'", "abs(point) == 'a'"]
)
def test_one_mistake_is_one_problem(source: str) -> None:
    assert len(inferred(source)[1]) == 1
