"""Syntax trees: texts that cannot be parsed, and walks, compared with ``ast``."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

from composer.base.source import SourceFile
from composer.python_code.modules import Unreadable
from composer.python_code.syntax import parse
from composer.python_code.trees import walk

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
    assert (caught.value.span.line, caught.value.span.column) == (line, column)


@pytest.mark.parametrize("name", DEEP)
def test_deep_nesting_is_refused(name: str) -> None:
    with pytest.raises(Unreadable):
        parse(SourceFile("code.py", DEEP[name]))


PATTERNS = """
match value:
    case {"key": [1, *rest], **others} | Point(x=0, y=-1) as found if found:
        global name
        print(f"{value!r:>{width}}", *rest, end="", **others)
    case _:
        a, b[1:2], c.d = (yield), lambda x, /, y=1, *z, k: x if not y else z < k > 1
        async def inner(): return [await item async for item in x if item]
"""
TEXTS = [PATTERNS, *(Path(file).read_text() for file in (ast.__file__, __file__))]


@pytest.mark.parametrize("text", TEXTS, ids=["patterns", "ast", "this file"])
def test_a_walk_visits_all_nodes_in_source_order(text: str) -> None:
    tree = ast.parse(text)
    visited = list(walk(tree.body))
    every = {node for node in ast.walk(tree) if not isinstance(node, ast.expr_context)}
    assert {*visited, tree} == every
    lines = [node.lineno for node in visited if isinstance(node, ast.stmt)]
    assert lines == sorted(lines)


def test_a_walk_does_not_enter_closed_nodes() -> None:
    tree = ast.parse("class A:\n  b = 1\nc = lambda: d")
    names = [
        node.id for node in walk(tree.body, closed=(ast.ClassDef,)) if isinstance(node, ast.Name)
    ]
    assert names == ["c", "d"]
