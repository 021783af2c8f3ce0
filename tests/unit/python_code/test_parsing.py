"""Texts that Python's parser refuses, and those at which it gives up."""

from __future__ import annotations

import pytest

from composer.base.source import SourceFile
from composer.python_code.modules import Unreadable
from composer.python_code.syntax import parse

REFUSED = {
    "class A\n    pass\n": (1, 8, "expected ':'"),
    "x = (\n": (1, 5, "was never closed"),
    "f(a=1, 2)\n": (1, 9, "positional argument follows"),
    "ä = 'ö'; b b\n": (1, 12, "invalid syntax"),
}
#: Texts at which Python gives up or that it refuses; none may crash it.
DEEP = {
    "parentheses": "(" * 100_000,
    "signs": "-" * 200_000 + "1",
    "attributes": "x" + ".a" * 120_000,
    "sums": "1" + "+1" * 120_000,
    "calls": "x" + "()" * 100_000,
    "functions": "lambda:" * 40_000 + "1",
    "branches": "if a: pass\n" + "elif a: pass\n" * 18_000,
    "number": "a = " + "9" * 100_000,
    "null": "a = '\0'",
    "short sums": "1" + "+1" * 300,
    "short attributes": "x" + ".a" * 300,
}


@pytest.mark.parametrize(("text", "expected"), REFUSED.items())
def test_the_place_of_an_error(text: str, expected: tuple[int, int, str]) -> None:
    line, column, message = expected
    with pytest.raises(Unreadable, match=message) as caught:
        parse(SourceFile("code.py", text))
    assert caught.value.span is not None
    assert (caught.value.span.line, caught.value.span.column) == (line, column)


@pytest.mark.parametrize("name", DEEP)
def test_deep_nesting_is_refused(name: str) -> None:
    with pytest.raises(Unreadable):
        parse(SourceFile("code.py", DEEP[name]))
