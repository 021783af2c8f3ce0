"""Which values and expressions fit which fields."""

from __future__ import annotations

from typing import Any

import pytest

from composer.base.source import Span
from composer.interfaces import FieldType, Message
from composer.interfaces.field_types.types import (
    ANYTHING,
    INTEGER,
    PathProblem,
    parameter_type,
    resolve_path,
    type_of,
)
from composer.language.expressions import compile_expression
from tests.unit.support.field_types import (
    CHECKER,
    EVERYTHING,
    FILE,
    INTERFACES,
    definition,
    problems_of,
    template,
)

FITTING: list[tuple[str, Any]] = [
    ("on", True),
    ("small", 255),
    ("raw", 0),
    ("big", -(2**63)),
    ("single", 1),
    ("double", 1e300),
    *(("text", value) for value in ("", "x {count}", "${open} {")),
    ("small", "${open}"),
    ("short_text", "abc"),
    ("three", [1, 2.5, "{now}"]),
    ("three", "{message.three}"),
    ("few", []),
    ("few", ["{count}", 3]),
    ("many", ["a", "b {count}"]),
    ("many", "{parameters.names}"),
    *(("stamp", value) for value in (1.5, "{now}", "{count}", {"sec": 1}, "{message.stamp}")),
    *(("point", value) for value in ({}, {"x": "{message.point.x * 2}", "y": 3}, "{point}")),
    ("points", [{"x": 1}, "{point}"]),
    ("foreign", {"whatever": 1}),
    ("foreign", "{message.foreign}"),
    ("on", "{count > 3 and not message.on}"),
    ("on", "{state.seen}"),
    *(("small", text) for text in ("{round(now)}", "{count % 256}", "{state.seen_count + 1}")),
    ("double", "{state.last_s + parameters.rate_hz}"),
    ("double", "{max(message.three) / len(message.many)}"),
    *(("double", text) for text in ("{state.free}", "{state.seen_count}")),
    *(("double", text) for text in ("{parameters.odd.deeper}", "{message.foreign.data}")),
    ("text", "{str(count)}"),
    ("text", "{'a' if message.on else node}"),
    ("text", "{message.many[-1]}"),
]
POINTS = "geometry_msgs/msg/Point[]"


@pytest.mark.parametrize(("field", "value"), FITTING)
def test_fits(field: str, value: object) -> None:
    assert problems_of({field: value}) == []


NOT_FITTING: list[tuple[str, Any, str, str | None]] = [
    ("on", 1, "the number 1 where bool is expected", "write true or false"),
    ("on", "true", "the string 'true' where bool is expected", "write true or false"),
    ("on", None, "null where bool is expected", "write true or false"),
    ("small", 256, "256 is outside the range of uint8", "allowed: 0 to 255"),
    ("small", -1, "-1 is outside the range of uint8", "allowed: 0 to 255"),
    ("small", 2.0, "uint8 must be an integer, not 2.0", "write 2"),
    ("small", 2.5, "uint8 must be an integer, not 2.5", None),
    ("small", True, "true where uint8 is expected", None),
    ("double", "1", "the string '1' where float64 is expected", None),
    ("single", 1e39, "1e+39 is outside the range of float32", None),
    ("text", 5, "the number 5 where string is expected", 'write it in quotes: "5"'),
    ("text", None, "null where string is expected", None),
    ("short_text", "abcd", "a string of 4 characters does not fit string<=3", None),
    ("short_text", "abcd{count}", "a string of at least 4 characters does not fit", None),
    ("three", 1.0, "the number 1.0 where float64[3] is expected", "write a list: [...]"),
    ("three", [1, 2], "a list of 2 elements does not fit float64[3]", None),
    ("few", [1, 2, 3], "a list of 3 elements does not fit int8[<=2]", None),
    ("few", [128], "128 is outside the range of int8", "allowed: -128 to 127"),
    ("few", ["a", "b"], "the string 'a' where int8 is expected, as in all 2 elements", None),
    ("double", [1.0], "a list where float64 is expected", None),
    ("double", {"x": 1}, "a map of fields where float64 is expected", None),
    ("stamp", 1e12, "1000000000000.0 seconds do not fit builtin_interfaces/msg/Time", None),
    (
        "point",
        3,
        "the number 3 where geometry_msgs/msg/Point is expected",
        "write a map of its fields: x, y, z",
    ),
    ("point", {"xx": 1}, "geometry_msgs/msg/Point has no field 'xx'", "did you mean 'x'?"),
    ("poin", 1, "demo_msgs/msg/Everything has no field 'poin'", "did you mean 'point'?"),
    ("double", "{now} s", "a string where float64 is expected", None),
    ("small", "{now}", "float64 where uint8 is expected", "use {round(now)}"),
    ("small", "{count / 2}", "float64 where uint8 is expected", "use {round(count / 2)}"),
    ("text", "{count}", "int64 where string is expected", "use {str(count)}"),
    ("double", "{node}", "string where float64 is expected", "use {float(node)}"),
    ("on", "{count}", "int64 where bool is expected", None),
    ("double", "{message.on}", "bool where float64 is expected", None),
    ("double", "{message.three}", "float64[3] where float64 is expected", None),
    ("three", "{message.few}", "int8[<=2] where float64[3] is expected", None),
    ("many", "{message.three}", "float64[3] where string[] is expected", None),
    ("point", "{message.stamp}", "builtin_interfaces/msg/Time where geometry_msgs/msg/Point", None),
    ("points", "{point}", "geometry_msgs/msg/Point where geometry_msgs/msg/Point[]", None),
    ("foreign", "{count}", "int64 where unknown_msgs/msg/Thing is expected", None),
]


@pytest.mark.parametrize(("field", "value", "message", "hint"), NOT_FITTING)
def test_does_not_fit(field: str, value: object, message: str, hint: str | None) -> None:
    (problem,) = problems_of({field: value})
    assert problem.message.startswith(message)
    assert hint in (None, problem.hint)


@pytest.mark.parametrize("value", ["text", "a {count}", 3, None, ["{count}"]])
def test_a_message_needs_a_map(value: object) -> None:
    (problem,) = problems_of(value, definition("geometry_msgs/msg/Point"))
    assert problem.message == "geometry_msgs/msg/Point must be a map of its fields"
    assert problem.hint == "fields: x, y, z"


def test_a_whole_message_can_be_republished() -> None:
    point = definition("geometry_msgs/msg/Point")
    assert problems_of("{message}") == problems_of("{point}", point) == problems_of("${open}") == []
    (problem,) = problems_of("{message}", point)
    assert problem.message == "demo_msgs/msg/Everything where geometry_msgs/msg/Point is expected"


def test_every_problem_is_reported_once() -> None:
    value = {
        "small": 300,
        "poin": {"x": "{mesage.on}"},
        "point": {"x": "{message.doubl}", "y": "{count + node}", "q": 1},
    }
    assert [problem.message for problem in problems_of(value)] == [
        "300 is outside the range of uint8",
        "demo_msgs/msg/Everything has no field 'poin'",
        "name 'mesage' is not available here",
        "demo_msgs/msg/Everything has no field 'doubl'",
        "string where a number is expected",
        "geometry_msgs/msg/Point has no field 'q'",
    ]


@pytest.mark.parametrize(
    ("text", "marked"),
    [
        ("{message.doubl}", "doubl"),
        ("{1 + message.points[0].w}", "w"),
        ("{message.three[3]}", "[3]"),
        ("{message.stamp . secs}", "message.stamp . secs"),
        ("{mesage.double}", "mesage"),
        ("{now + node}", "node"),
        ("{sqrt(1 + len(count))}", "count"),
        ("{parameters.rate}", "rate"),
    ],
)
def test_the_exact_part_is_marked(text: str, marked: str) -> None:
    (problem,) = CHECKER.text(template(text))
    start = problem.primary.column - 1
    assert text[start : start + problem.primary.length] == marked


@pytest.mark.parametrize(
    ("text", "messages"),
    [
        *((text, []) for text in ("{now:.2f} s", "{count:03d}", "{count:.1f}", "{node:>9}")),
        *((text, []) for text in ("{message.on:>5}", "{state.free:d}", "{state.seen_count:d}")),
        ("{node:.2f} s", ["string cannot be formatted as '.2f'"]),
        ("{now:d}", ["float64 cannot be formatted as 'd'"]),
        ("{point:.2f}", ["geometry_msgs/msg/Point cannot be formatted as '.2f'"]),
        ("{message.three:.2f}", ["float64[3] cannot be formatted as '.2f'"]),
    ],
)
def test_values_and_formats(text: str, messages: list[str]) -> None:
    problems = CHECKER.text(template(["", {"a": text}]))
    assert [problem.message for problem in problems] == messages


def test_the_whole_value_is_marked_if_the_file_does_not_contain_it_literally() -> None:
    span = Span(FILE, 4, 7, 40)
    (problem,) = CHECKER.expression(compile_expression("message.doubl"), span)
    assert problem.primary == span


NO_BOOL = "a condition must be a bool, not"


@pytest.mark.parametrize(
    ("source", "problems"),
    [
        *((source, []) for source in ("message.on", "count > 1", "state.free", "true")),
        ("'a' in node", []),
        ("count", [f"{NO_BOOL} int64 (compare it, as in '... > 0')"]),
        ("node", [f"{NO_BOOL} string (None)"]),
        ("point", [f"{NO_BOOL} geometry_msgs/msg/Point (None)"]),
        ("message.ok", ["demo_msgs/msg/Everything has no field 'ok' (valid here: "]),
    ],
)
def test_a_condition_is_a_bool(source: str, problems: list[str]) -> None:
    found = list(CHECKER.condition(compile_expression(source), Span(FILE, 1, 1)))
    assert len(found) == len(problems)
    for item, problem in zip(found, problems, strict=True):
        assert f"{item.message} ({item.hint})".startswith(problem)


@pytest.mark.parametrize(
    ("parts", "expected"),
    [
        (("point", "x"), "float64"),
        (("points", -1, "y"), "float64"),
        (("three", 2), "float64"),
        (("few", -2), "int8"),
        (("stamp",), "builtin_interfaces/msg/Time"),
        ((), EVERYTHING),
        # Paths that lead nowhere.
        (
            ("point", "w"),
            PathProblem("geometry_msgs/msg/Point has no field 'w'", 1, "valid here: x, y, z"),
        ),
        (
            ("double", "x"),
            PathProblem("float64 has no field 'x'", 1, "it is a value, not a message"),
        ),
        (("double", 0), PathProblem("float64 has no elements", 1)),
        (("three", -4), PathProblem("float64[3] has no element -4", 1)),
        (("few", 2), PathProblem("int8[<=2] has no element 2", 1)),
        (
            ("points", "x"),
            PathProblem(f"{POINTS} has no field 'x'", 1, "it is a list: use an index, as in [0]"),
        ),
    ],
)
def test_a_path_leads_to_a_type(parts: tuple[str | int, ...], expected: object) -> None:
    found = resolve_path(EVERYTHING, parts, INTERFACES)
    assert (str(found) if isinstance(expected, str) else found) == expected


def test_unknown_types_fit_everywhere() -> None:
    assert resolve_path(EVERYTHING, ("foreign", "a", 0), INTERFACES) is ANYTHING
    assert type_of(None) is type_of("${open}") is type_of([1]) is ANYTHING
    assert parameter_type("oddity") is ANYTHING
    assert parameter_type("integer") == INTEGER
    assert type_of({"a": 1, "b": 1.0}) == {"a": INTEGER, "b": FieldType("float64")}
    assert problems_of({"foreign": 3})[0].hint == "write a map of its fields"
    assert problems_of({}, Message("demo_msgs/msg/Empty")) == []
