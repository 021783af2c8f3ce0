"""Walks over syntax trees, compared with those of ``ast``."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

from composer.python_code.trees import walk

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
