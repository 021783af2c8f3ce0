"""Walks over syntax trees, compared with those of ``ast``."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

from composer.python_code.source.traversal import children, walk

MARKS = (ast.expr_context, ast.operator, ast.boolop, ast.unaryop, ast.cmpop)
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
def test_children_are_those_of_ast_without_marks(text: str) -> None:
    for node in ast.walk(ast.parse(text)):
        expected = [item for item in ast.iter_child_nodes(node) if not isinstance(item, MARKS)]
        assert children(node) == expected


def test_a_walk_visits_all_nodes_in_source_order() -> None:
    tree = ast.parse(TEXTS[1])
    visited = list(walk(tree.body))
    expected = {node for node in ast.walk(tree) if not isinstance(node, MARKS)}
    assert {*visited, tree} == expected
    lines = [node.lineno for node in visited if isinstance(node, ast.stmt)]
    assert lines == sorted(lines)


def test_a_walk_does_not_enter_closed_nodes() -> None:
    tree = ast.parse("class A:\n  b = 1\nc = lambda: d")
    names = [
        node.id for node in walk(tree.body, closed=(ast.ClassDef,)) if isinstance(node, ast.Name)
    ]
    assert names == ["c", "d"]
