"""The types of expressions, and expressions that can never work."""

from __future__ import annotations

import pytest

from composer.base.source import SourceFile, Span
from composer.interfaces.field_types.inference import infer
from composer.interfaces.field_types.types import described
from composer.language.expressions import FUNCTIONS, compile_expression
from tests.unit.support.field_types import INTERFACES, SCOPE


def inferred(source: str) -> tuple[str, list[str]]:
    span = Span(SourceFile("test.yaml", source), 1, 1, len(source))
    found, problems = infer(compile_expression(source), span, SCOPE, INTERFACES)
    return described(found), [f"{item.primary.text}: {item.message}" for item in problems]


#: By type: expressions of this type, among them one with each function.
TYPES = {
    "int64": (
        *("1", "count + 1", "count // 2", "-message.small", "parameters.camera.fps", "abs(-1)"),
        *("ceil(1.5)", "clamp(count, 0, 10)", "floor(1.5)", "int(1.5)", "len(message.many)"),
        *("len(state.free)", "min(message.few)", "min(1, 2)", "round(1.5)"),
    ),
    "uint8": ("message.small",),
    "float64": (
        *("1.0", "pi", "count + 1.0", "count / 2", "message.single % 2", "now + state.free"),
        *("1 if message.on else 2.0", "atan2(1, 2)", "cos(1)", "degrees(1)", "float('1')"),
        *("hypot(1, 2)", "max(message.three)", "radians(1)", "round(1.5, 1)", "sin(1)"),
        *("sqrt(4)", "tan(1)"),
    ),
    "string": ("'a'", "'a' if message.on else node", "str(1)"),
    "bool": (
        *("true", "not node", "message.on and count > 1", "1 < count <= now", "state.free == 'a'"),
        *("count in (1, -2, 3.5)", "'a' in message.many", "'a' in node", "1 in state.free"),
        "bool(1)",
    ),
    "geometry_msgs/msg/Point": ("point if message.on else message.point",),
    "demo_msgs/msg/Everything": ("message",),
    "a map": ("parameters",),
    "unknown type": (
        *("count + state.free", "message.on or count", "1 if message.on else node", "missing"),
        "max(state.free)",
    ),
}


@pytest.mark.parametrize(
    ("source", "expected"),
    [(source, expected) for expected, sources in TYPES.items() for source in sources],
)
def test_type(source: str, expected: str) -> None:
    found, problems = inferred(source)
    assert found == expected
    assert problems == (
        [] if source != "missing" else ["missing: name 'missing' is not available here"]
    )


def test_every_function_has_a_type() -> None:
    sources = [source for group in TYPES.values() for source in group]
    assert {source.partition("(")[0] for source in sources if "(" in source} >= set(FUNCTIONS)


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
