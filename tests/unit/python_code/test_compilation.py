"""What Python refuses to compile, and texts that would cost the compiler too much."""

from __future__ import annotations

import time

import pytest

from composer.python_code.source.compilation import NotPython, parse
from composer.source import SourceFile

REFUSED = {
    "class A\n    pass\n": (1, 8, "expected ':'"),
    "x = 1\nreturn x\n": (2, 1, "'return' outside function"),
    "def f():\n    ä = 'ö'; await x\n": (2, 14, "'await' outside async function"),
    "for x in y:\n    pass\nelse:\n    break\n": (4, 5, "'break' outside loop"),
    "def f():\n    x = 1\n    global x\n": (3, 5, "before global declaration"),
    "def f(a, a):\n    pass\n": (1, 1, "duplicate argument"),
    "x = (\n": (1, 5, "was never closed"),
    "f(a=1, 2)\n": (1, 9, "positional argument follows"),
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
}


@pytest.mark.parametrize(("text", "expected"), REFUSED.items())
def test_the_place_of_an_error(text: str, expected: tuple[int, int, str]) -> None:
    line, column, message = expected
    with pytest.raises(NotPython, match=message) as caught:
        parse(SourceFile("code.py", text))
    assert caught.value.span is not None
    assert caught.value.span.line == line
    assert message.startswith("duplicate") or caught.value.span.column == column


@pytest.mark.parametrize("name", DEEP)
def test_deep_nesting_is_refused(name: str) -> None:
    with pytest.raises(NotPython):
        parse(SourceFile("code.py", DEEP[name]))


def test_code_that_the_compiler_would_copy_too_often_is_only_parsed() -> None:
    # Each 'finally' in a 'finally' doubles the code: the compiler would need gigabytes.
    depth = 19
    text = "def f():\n"
    for level in range(1, depth):
        text += f"{' ' * level}try: f()\n{' ' * level}finally:\n"
    text += f"{' ' * depth}f(1, 2, 3)\n" * 50
    started = time.process_time()
    parse(SourceFile("code.py", text))
    assert time.process_time() - started < 20.0
