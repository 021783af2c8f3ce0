"""Texts with expressions in them: how they are read, placed and worked out."""

from __future__ import annotations

from typing import Any

import pytest

from composer.base.source import SourceFile, Span
from composer.language.expressions import EvaluationError
from composer.language.templates import (
    Computed,
    Constant,
    Items,
    Record,
    Template,
    Text,
    compile_template,
    evaluate,
    expressions_in,
)
from composer.language.tree import Entry, Mapping, Scalar, Sequence, Tree

FILE = SourceFile("system.yaml")
SCOPE: dict[str, Any] = {"count": 7, "message": {"data": "hello", "x": 2.5}}
COLUMN = 11


def scalar(value: Any, *, quoted: bool = False, verbatim: bool = True) -> Scalar:
    offset = 1 if quoted else 0
    span = Span(FILE, 3, COLUMN, len(str(value)) + 2 * offset)
    return Scalar(value, span, verbatim=verbatim, content_offset=offset)


def compiled(tree: Tree) -> Template:
    template, problems = compile_template(tree)
    assert problems == []
    assert template is not None
    return template


@pytest.mark.parametrize(
    ("text", "kind", "value"),
    [
        ("", Constant, ""),
        ("plain", Constant, "plain"),
        ("{{literal}} }}{{", Constant, "{literal} }{"),
        ("{count}", Computed, 7),
        ("{ count + 1 }", Computed, 8),
        ("{message}", Computed, {"data": "hello", "x": 2.5}),
        (" {count}", Text, " 7"),
        ("{count}{count}", Text, "77"),
        ("{{{count}}}", Text, "{7}"),
        ("Sensor reading {count}: {message.data}", Text, "Sensor reading 7: hello"),
        ("{message.x:.2f} m", Text, "2.50 m"),
        ("{message.x:.2f}", Text, "2.50"),
        ("[{message.data:>8}]", Text, "[   hello]"),
        ("{count:03d} {count:+} {count:x} {count:,}", Text, "007 +7 7 7"),
        ("{message.x:8.1e}", Text, " 2.5e+00"),
        ("{message.x:.0%}", Text, "250%"),
        ("{'}' in message.data}", Computed, False),
        ("{':' in message.data}", Computed, False),
        ("{'{' in message.data}", Computed, False),
        ("{'a' if count > 3 else 'b':>3}", Text, "  a"),
    ],
)
def test_text(text: str, kind: type, value: object) -> None:
    template = compiled(scalar(text))
    assert type(template) is kind
    assert evaluate(template, SCOPE) == value


def test_other_scalars_and_texts_with_open_variables_are_constants() -> None:
    for value in (None, True, 3, 2.5):
        assert evaluate(compiled(scalar(value)), SCOPE) is value
    for text in ("${name}", "a ${name} {", "{${name}}"):
        assert compiled(scalar(text)) == Constant(text, Span(FILE, 1, 1))


def test_maps_and_lists_are_worked_out_in_depth() -> None:
    items = Sequence((scalar("{count}"), scalar(1.5), scalar("n={count}")), Span(FILE, 1, 1))
    tree = Mapping((Entry(scalar("a"), items), Entry(scalar("b"), scalar(True))), Span(FILE, 1, 1))
    template = compiled(tree)
    assert isinstance(template, Record)
    assert isinstance(template.fields[0][1], Items)
    assert evaluate(template, SCOPE) == {"a": [7, 1.5, "n=7"], "b": True}


@pytest.mark.parametrize(
    ("text", "marked", "message"),
    [
        ("a {count", "{", "'{' is not closed (write '{{' for a brace)"),
        ("a } b", "}", "'}' closes nothing (write '}}' for a brace)"),
        ("{count}}", "}", "'}' closes nothing (write '}}' for a brace)"),
        ("{}", "}", "the expression is empty ("),
        ("x { count + }", "+", "something is missing at the end ("),
        ("x {sqr(2)}", "sqr", "unknown function 'sqr' (did you mean 'sqrt'?)"),
        ("{count:99999d}", "99999d",
         "'99999d' is not a format (a format is like .2f, 5d, >10 or x)"),
        ("{count:{count}}", "{count", "'{count' is not a format ("),
        ("{count!r}", "!", "unexpected '!' (write 'not')"),
        ("{count:}", "}", "'' is not a format ("),
        ("{count:*^5}", "*^5", "'*^5' is not a format ("),
    ],
)  # fmt: skip
def test_problem_is_located(text: str, marked: str, message: str) -> None:
    template, problems = compile_template(scalar(text, quoted=True))
    assert template is None
    problem = problems[0]
    start = problem.primary.column - COLUMN - 1
    assert f"{problem.message} ({problem.hint})".startswith(message)
    assert text[start : start + problem.primary.length] == marked


def test_a_problem_in_an_escaped_text_is_placed_at_the_whole() -> None:
    escaped = scalar("{count +}", verbatim=False)
    _, problems = compile_template(escaped)
    assert [problem.primary for problem in problems] == [escaped.span]


def test_every_problem_of_a_tree_is_found() -> None:
    tree = Sequence((scalar("{a +}"), scalar("{b"), scalar("{c.__d}")), Span(FILE, 1, 1))
    template, problems = compile_template(tree)
    assert (template, len(problems)) == (None, 3)


def test_expressions_are_listed_with_their_places() -> None:
    tree = Sequence((scalar("x={ count } y={message.x:.1f}"), scalar("{count}")), Span(FILE, 1, 1))
    found = [
        (expression.source, span.column - COLUMN, span.length)
        for expression, span in expressions_in(compiled(tree))
    ]
    assert found == [("count", 4, 5), ("message.x", 15, 9), ("count", 1, 5)]


@pytest.mark.parametrize("text", ["{message.data:.2f}!", "{message.data:d}!", "{message:d}!"])
def test_a_value_that_has_no_such_format_is_an_error(text: str) -> None:
    with pytest.raises(EvaluationError, match="cannot be written as"):
        evaluate(compiled(scalar(text)), SCOPE)
