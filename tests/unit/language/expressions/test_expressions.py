"""What the expression language says, and what it refuses."""

from __future__ import annotations

import math
from array import array
from typing import Any

import pytest

from composer.language.expressions import (
    FUNCTIONS,
    EvaluationError,
    ExpressionError,
    FieldPath,
    compile_expression,
)


class Vector:
    """Stands where a generated message class stands: it declares its fields."""

    _fields_and_field_types = {"x": "double", "points": "sequence<double>", "level": "octet"}  # noqa: RUF012

    def __init__(self) -> None:
        self.x = 4.0
        self.points = array("d", [1.0, 2.5, -3.0])
        self.level = b"\x02"
        self.undeclared = "reached"


SCOPE: dict[str, Any] = {
    "message": Vector(),
    "parameters": {"rate": 10.0, "name": "lidar", "lens.fps": 30, "lens.sizes": [2, 5], "lens": 1},
    "state": {"pose": {"x": 1.5}, "last": None},
    "names": ["left", "right"],
    "count": 7,
    "on": True,
    "nothing": None,
}


@pytest.mark.parametrize(
    ("source", "expected"),
    [
        ("message.x * 0.5", 2.0),
        ("message.x", 4.0),
        ("message.points[0]", 1.0),
        ("message.points[-1] + 1", -2.0),
        ("message.level", 2),
        ("parameters.rate", 10.0),
        ("parameters.lens.fps", 30),
        ("parameters.lens.sizes[1] + parameters.lens", 6),
        ("state.pose.x", 1.5),
        ("names", ["left", "right"]),
        ("1 + 2 * 3 - 4 / 2", 5.0),
        ("7 // 2 + 7 % 4", 6),
        ("-7 // 2", -4),
        ("+count - -1", 8),
        ("(1 + 2) * 3", 9),
        ("1.5e3 + .5 + 2.", 1502.5),
        ("count > 5", True),
        ("0 <= count < 7", False),
        ("count == 7 and message.x != 4", False),
        ("on or missing", True),
        ("false and missing", False),
        ("not on", False),
        ("true and True", True),
        ("nothing == 0", False),
        ("'a' if count > 100 else 'b'", "b"),
        ("parameters.name in ('lidar', 'radar')", True),
        ("count not in [1, -2, 7.0]", False),
        ("true in (true,)", True),
        ("count in ()", False),
        ("'left' in names", True),
        ("'id' in parameters.name", True),
        ("2.5 in message.points", True),
        ("'é' == 'é' and parameters.name == 'lidar'", True),
        ('"it\'s" == "it\'s"', True),
        ("\n  count\n  + 1\n", 8),
    ],
)
def test_value(source: str, expected: object) -> None:
    value = compile_expression(source).evaluate(SCOPE)
    assert value == expected
    assert type(value) is type(expected)


FUNCTION_EXAMPLES = [
    ("abs(-3)", 3),
    ("atan2(1, 1)", math.pi / 4),
    ("bool(0)", False),
    ("ceil(1.2)", 2),
    ("clamp(count, 0, 5)", 5),
    ("cos(pi)", -1.0),
    ("degrees(pi)", 180.0),
    ("float('2.5')", 2.5),
    ("floor(-1.2)", -2),
    ("hypot(3, 4)", 5.0),
    ("int('12')", 12),
    ("len(names)", 2),
    ("max(1, 2.5, count)", 7),
    ("min(message.points)", -3.0),
    ("radians(180)", math.pi),
    ("round(2.567, 1)", 2.6),
    ("round(2.567)", 3),
    ("sin(0)", 0.0),
    ("sqrt(16)", 4.0),
    ("str(count)", "7"),
    ("tan(0)", 0.0),
]


@pytest.mark.parametrize(("source", "expected"), FUNCTION_EXAMPLES)
def test_function(source: str, expected: object) -> None:
    assert compile_expression(source).evaluate(SCOPE) == pytest.approx(expected)


def test_every_function_has_an_example() -> None:
    assert {source.partition("(")[0] for source, _ in FUNCTION_EXAMPLES} == set(FUNCTIONS)


@pytest.mark.parametrize(
    ("source", "text"),
    [
        ("missing + 1", "'missing': there is no such name here"),
        ("message.y", "'message.y': Vector has no field 'y'"),
        ("message.undeclared", "'message.undeclared': Vector has no field 'undeclared'"),
        ("parameters.rat", "'parameters.rat': there is no 'rat'"),
        ("parameters.lens.gain", "'parameters.lens.gain': a number has no field 'gain'"),
        ("state.pose.y", "'state.pose.y': there is no 'y'"),
        ("count.real", "'count.real': a number has no field 'real'"),
        ("parameters.name.upper", "'parameters.name.upper': a string has no field 'upper'"),
        ("1 + names[2]", "'names[2]': there is no element 2 in a list of 2"),
        ("parameters.name[0]", "'parameters.name[0]': a string has no elements"),
        ("1 + 2 / (count - 7)", "'2 / (count - 7)': division by zero"),
        ("count % 0", "'count % 0': division by zero"),
        ("'a' + 'b'", "''a' + 'b'': a string where a number is expected"),
        ("parameters.name * 9", "'parameters.name * 9': a string where a number is expected"),
        ("parameters.name % 9", "'parameters.name % 9': a string where a number is expected"),
        ("on + 1", "'on + 1': true or false where a number is expected"),
        ("-names", "'-names': a list where a number is expected"),
        ("18446744073709551615 * 2", "'18446744073709551615 * 2': the number is too large"),
        ("int(1e300)", "'int(1e300)': the number is too large"),
        ("floor(1e300)", "'floor(1e300)': the number is too large"),
        ("round(1.5, 400)", "'round(1.5, 400)': rounding takes 0 to 15 digits"),
        ("sqrt(-1)", "'sqrt(-1)': not defined for this value"),
        ("int('x')", "'int('x')': not defined for this value"),
        ("float(names)", "'float(names)': a list cannot become a number"),
        ("str(message)", "'str(message)': Vector cannot be compared"),
        ("clamp(1, 3, 2)", "'clamp(1, 3, 2)': the lower bound is above the upper bound"),
        ("min(names)", "'min(names)': a string where a number is expected"),
        ("len(count)", "'len(count)': a number has no length"),
        ("count < 'a'", "'count < 'a'': a string and a number have no order"),
        ("message == 1", "'message': Vector cannot be compared"),
        ("1 in count", "'1 in count': a number is neither a list nor a string"),
        ("1 in parameters.name", "'1 in parameters.name': a number cannot be part of a string"),
        ("'é' == names[5]", "'names[5]': there is no element 5 in a list of 2"),
    ],
)
def test_failure_names_the_part(source: str, text: str) -> None:
    expression = compile_expression(source)
    with pytest.raises(EvaluationError) as caught:
        expression.evaluate(SCOPE)
    assert str(caught.value).startswith(text)


#: What Python has and the expression language has not.
OTHER = "this is not part of the expression language"


@pytest.mark.parametrize(
    ("source", "marked", "message"),
    [
        ("", "", "the expression is empty"),
        ("a.b +", "+", "something is missing at the end"),
        ("(a", "(", "'(' was never closed"),
        ("a)", ")", "')' closes nothing"),
        ("(a]", "]", "']' closes nothing"),
        ("a b", "b", "invalid syntax"),
        ("x + a.__class__", "a.__class__", "'__class__' begins with an underscore"),
        ("_a", "_a", "'_a' begins with an underscore"),
        ("1 + sqr(2)", "sqr", "unknown function 'sqr' (did you mean 'sqrt'?)"),
        ("1 + sqrt", "sqrt", "'sqrt' is a function (call it: sqrt(...))"),
        ("pi.real", "pi", "'pi' has no fields"),
        ("atan2(1)", "atan2(1)", "'atan2' takes 2 arguments, not 1"),
        ("min()", "min()", "'min' takes at least 1 argument, not 0"),
        ("round(1, 2, 3)", "round(1, 2, 3)", "'round' takes 1 or 2 arguments, not 3"),
        ("a.b()", "a.b", "only the functions of the language can be called"),
        *(
            (f"a[{index}]", index, "an index is an integer")
            for index in ("b", "'b'", "1.5", "true")
        ),
        ("(a + b).c", "a + b", "only a name has fields"),
        ("a is b", "a is b", "this comparison is not part"),
        ("a in (b, 1)", "b", "a list after 'in' may contain only numbers"),
        ("(1, 2)", "(1, 2)", OTHER),
        ("None", "None", OTHER),
        ("1e999", "1e999", "the number is too large"),
        ("2 in (18446744073709551616,)", "18446744073709551616", "the number is too large"),
        ("a ** 2", "**", "unexpected '**'"),
        ("a && b", "&&", "unexpected '&&' (write 'and')"),
        ("a || b", "||", "unexpected '||' (write 'or')"),
        ("!a", "!", "unexpected '!' (write 'not')"),
        ("a = b", "=", "unexpected '=' (write '==' to compare)"),
        ("a # b", "#", "unexpected '#'"),
        ("a\x00b", "\x00", "unexpected '\\u0000'"),
        ("'é' == ä", "ä", "unexpected 'ä'"),
        ("'abc", "'abc", "unterminated string"),
        (r"'a\'b'", r"'a\'b'", "unterminated string"),
        ("0x10", "0x10", "'0' and 'x10' have nothing between them"),
        ("f'{a}'", "f'{a}'", "'f' and ''{a}'' have nothing between them"),
        ("1if a else 2", "1if", "'1' and 'if' have nothing between them"),
        ("'''a'''", "'''a'", "'''' and ''a'' have nothing between them"),
    ],
)
def test_refusal_is_located(source: str, marked: str, message: str) -> None:
    with pytest.raises(ExpressionError) as caught:
        compile_expression(source)
    error = caught.value
    assert f"{error.message} ({error.hint})".startswith(message)
    assert source[error.offset : error.offset + error.length] == marked


def test_paths_are_listed_with_their_places() -> None:
    source = " message.poses[-1].x > parameters.limit and 'é' != node"
    found = compile_expression(source).paths
    assert found == (
        FieldPath(("message", "poses", -1, "x"), 0, 0),
        FieldPath(("parameters", "limit"), 0, 0),
        FieldPath(("node",), 0, 0),
    )
    written = [source[path.offset : path.offset + path.length] for path in found]
    assert written == ["message.poses[-1].x", "parameters.limit", "node"]
    assert str(found[0]) == "message.poses[-1].x"


def test_a_path_names_a_key_of_its_root() -> None:
    keys = {"p.a": "a", "p.a.b": "a.b", "p.a.b.x": "a.b", "p.c[0]": "c", "p.z.b": "z", "p": ""}
    for source, key in keys.items():
        (path,) = compile_expression(source).paths
        assert path.key({"a", "a.b", "c"}) == key, source


def test_expressions_are_equal_when_their_sources_are() -> None:
    assert compile_expression("a + 1") == compile_expression("a + 1")
    assert compile_expression("a + 1") != compile_expression("a + 2")
    assert len({compile_expression("a"), compile_expression("a")}) == 1


def test_a_condition_holds_or_not_and_must_be_boolean() -> None:
    assert compile_expression("count > 5").holds(SCOPE) is True
    assert compile_expression("not on").holds(SCOPE) is False
    for source in ("count", "parameters.name", "nothing", "message"):
        with pytest.raises(EvaluationError, match="where true or false is expected"):
            compile_expression(source).holds(SCOPE)
