"""Compiling and evaluating any expression ends quickly, with a value or a documented error."""

from __future__ import annotations

import time
from types import CodeType
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from composer.language.expressions import EvaluationError, ExpressionError, compile_expression
from composer.language.expressions.builder import OPERATIONS, SCOPE

ESCAPES = (
    "().__class__",
    "().__class__.__bases__[0].__subclasses__()",
    "message.__class__",
    "message.__init__.__globals__",
    "message._fields_and_field_types",
    "message.get_fields_and_field_types()",
    "message.get_fields_and_field_types",
    "message.data.format",
    "message.data.format('{0.__class__}')",
    "'{0.__class__}'.format(message)",
    "f'{message.__class__}'",
    "'%1000000000d' % 1",
    "'a' * 10 ** 9",
    "'a' * 1000000000",
    "10 ** 10 ** 10",
    "9999999999 * 9999999999 * 9999999999 * 9999999999",
    "1 << 1000000000",
    "round(1, -1000000000)",
    "int('9' * 100000)",
    "__import__('os').system('true')",
    "eval('1')",
    "open('/etc/passwd')",
    "getattr(message, 'data')",
    "scope",
    "scope.message",
    "read_fields(message, ('__class__',))",
    "call_sqrt(4)",
    "__builtins__",
    "lambda: 1",
    "(lambda: 1)()",
    "[x for x in message.items]",
    "{x: 1 for x in message.items}",
    "(x for x in message.items)",
    "(a := 1)",
    "await message",
    "(yield)",
    "*message",
    "min(*message.items)",
    "min(**parameters)",
    "max(message.items, key=len)",
    "message.items[0:1]",
    "message.items[...]",
    "message.\ufb01eld",
    "message._\uff3fclass\uff3f_",
    "1 if",
    "a\x00b",
    "\ufeffa",
    "\ud800",
    "'\ud800' == message.data",
    "(" * 400 + ")" * 400,
    "(" * 200 + "1" + ")" * 200,
    "[" * 100,
    "-" * 499 + "1",
    "not " * 120 + "on",
    "~" * 100 + "1",
    "a" + ".b" * 240,
    "a" + "[0]" * 160,
    "1" + "+1" * 240,
    "1" + "<1" * 240,
    "1 if 1 else " * 40 + "1",
    "'" + "x" * 10_000 + "'",
    "9" * 490,
    "1e400",
    "-1e400",
    "1_000",
    "0b1",
    "0o17",
    "1j",
    "b'x'",
    "...",
    "#",
    "a;b",
    "a\\\nb",
    "print('x')",
    "import os",
    "exec('1')",
)


class Message:
    """A message whose other attributes must not be accessed."""

    _fields_and_field_types = {"data": "string", "items": "sequence<double>"}  # noqa: RUF012
    data = "text"
    items = (1.0, 2.0)

    def __getattribute__(self, name: str) -> Any:
        assert name in ("data", "items"), name
        return object.__getattribute__(self, name)


def scope() -> dict[str, Any]:
    return {
        "message": Message(),
        "parameters": {"rate": 10.0, "name": "x"},
        "count": 2**63,
        "on": True,
        "a": {"b": {"b": 1}},
    }


def evaluate(source: str) -> object:
    """Return the value or one of the two documented errors."""
    started = time.process_time()
    try:
        return compile_expression(source).evaluate(scope())
    except (ExpressionError, EvaluationError) as error:
        return error
    finally:
        assert time.process_time() - started < 5.0


@pytest.mark.parametrize("source", ESCAPES)
def test_known_escapes_are_rejected(source: str) -> None:
    assert isinstance(evaluate(source), ExpressionError | EvaluationError)


@given(st.text(max_size=600))
def test_any_text_gives_a_value_or_an_error(source: str) -> None:
    evaluate(source)


WORDS = (
    *("message", "message.data", "message.items", "items[0]", "parameters", "count", "on", "a.b"),
    *("1", "0", "2.5", "1e308", "18446744073709551615", "'x'", '""', "true", "pi", "None"),
    *("+", "-", "*", "/", "//", "%", "**", "<", "<=", "==", "!=", "=", ".", ",", ":", "@", "~"),
    *("and", "or", "not", "in", "not in", "is", "if", "else", "for", "lambda", "await", "yield"),
    *("(", ")", "[", "]", "{", "}", "min(", "len(", "int(", "round(", "str(", "sqrt(", "print("),
    *("__class__", ".__class__", "_", "\n", "\t", "#", "\\", "\x00", "é", "f", "b", "r", "'"),
)


@given(st.lists(st.sampled_from(WORDS), max_size=60), st.sampled_from(["", " "]))
def test_any_sequence_of_words_gives_a_value_or_an_error(words: list[str], between: str) -> None:
    evaluate(between.join(words))


def expressions() -> st.SearchStrategy[str]:
    """Mostly valid expressions, so that evaluation is reached."""
    atoms = st.sampled_from(
        (
            *("message.data", "message.items", "message.items[0]", "parameters.rate", "count"),
            *("1", "-3", "2.5", "1e308", "9223372036854775807", "'x'", "true", "pi", "missing"),
        )
    )
    functions = ["abs", "min", "max", "round", "sqrt", "floor", "len", "float", "int", "str"]
    operators = ["+", "-", "*", "/", "//", "%", "<", "==", "and", "or", "in"]
    return st.recursive(
        atoms,
        lambda inner: st.one_of(
            st.builds("({} {} {})".format, inner, st.sampled_from(operators), inner),
            st.builds("{}({})".format, st.sampled_from(functions), inner),
            st.builds("({} if {} else {})".format, inner, inner, inner),
            st.builds("(not {})".format, inner),
        ),
        max_leaves=12,
    )


@given(expressions())
def test_values_are_bounded_and_the_same_each_time(source: str) -> None:
    value = evaluate(source)
    if isinstance(value, int):
        assert -(2**63) <= value < 2**64
    if isinstance(value, str):
        assert len(value) < 400
    assert repr(evaluate(source)) == repr(value)


@given(expressions())
def test_compiled_code_accesses_only_its_operations(source: str) -> None:
    try:
        code: CodeType = compile_expression(source).compile().__code__
    except ExpressionError:
        return
    assert set(code.co_names) <= set(OPERATIONS)
    assert code.co_varnames == (SCOPE,)
    assert not code.co_freevars
    assert not any(isinstance(constant, CodeType) for constant in code.co_consts)


def test_a_deep_stack_gives_an_error() -> None:
    def deeper(depth: int) -> object:
        return evaluate("((((((((((a.b.b + 1))))))))))") if depth == 0 else deeper(depth - 1)

    for depth in range(0, 2000, 50):
        try:
            deeper(depth)
        except RecursionError:
            break
