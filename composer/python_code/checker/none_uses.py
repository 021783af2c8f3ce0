"""Whether a value that may be None is used without any check in its class.

The type checker forgets at each call what another method has checked. So an attribute counts as
checked if any method of its class compares it, tests it or passes it on, and as set if a transition
or the constructor gives it a value.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator

from composer.python_code.source.method_body import dotted, is_none
from composer.python_code.source.spans import span_of
from composer.source import Span

_LONGEST = 60  # characters of an expression in a message
_STARTS = frozenset({"__init__", "on_configure", "on_activate"})


def unguarded_value(tree: ast.Module, span: Span) -> str | None:
    """Return the value at a place that may be None as it is written, None if it is checked.

    The place is that of the value itself, or of an expression that reads an attribute of it.
    """
    value = next((found for node in _expressions(tree, span) if (found := _value(node, span))), None)
    if value is None:
        return None
    name = dotted(value)
    if not name.startswith("self."):
        return ast.unparse(value)[:_LONGEST]
    attribute = name.removeprefix("self.").partition(".")[0]
    class_ = _class_at(tree, span.line)
    if class_ is None or _is_checked(class_, attribute) or _is_set_at_start(class_, attribute):
        return None
    return name


def _value(node: ast.expr, span: Span) -> ast.expr | None:
    """Return what may be None in an expression, None if the expression is not at the place."""
    if span_of(node, span.file) != span:
        return None
    match node:
        case ast.Attribute(value=value) | ast.Subscript(value=value) | ast.BinOp(left=value):
            # An argument may itself be an attribute: the checker then names all of it.
            return value if dotted(value) != "self" else node
        case _:
            return node


def _expressions(tree: ast.Module, span: Span) -> Iterator[ast.expr]:
    for node in ast.walk(tree):
        if isinstance(node, ast.expr) and node.lineno == span.line:
            yield node


def _class_at(tree: ast.Module, line: int) -> ast.ClassDef | None:
    for node in ast.walk(tree):
        if isinstance(node, ast.ClassDef) and node.lineno <= line <= (node.end_lineno or line):
            return node
    return None


def _is_checked(class_: ast.ClassDef, attribute: str) -> bool:
    """Return whether the class reads the attribute other than by its members and as an argument."""
    loads = uses = 0
    for node in ast.walk(class_):
        match node:
            case ast.Attribute(ctx=ast.Load()) if _is_attribute(node, attribute):
                loads += 1
        match node:
            case ast.Attribute(value=value) | ast.Subscript(value=value):
                uses += _is_attribute(value, attribute)
            case ast.BinOp(left=left, right=right):
                uses += _is_attribute(left, attribute) + _is_attribute(right, attribute)
            case ast.Call(args=arguments, keywords=keywords):
                given = (*arguments, *(keyword.value for keyword in keywords))
                uses += sum(_is_attribute(item, attribute) for item in given)
    return loads > uses


def _is_attribute(node: ast.AST, attribute: str) -> bool:
    return isinstance(node, ast.Attribute) and dotted(node) == f"self.{attribute}"


def _is_set_at_start(class_: ast.ClassDef, attribute: str) -> bool:
    """Return whether a constructor or transition gives the attribute a value other than None."""
    for method in class_.body:
        if getattr(method, "name", "") not in _STARTS:
            continue
        for node in ast.walk(method):
            targets = node.targets if isinstance(node, ast.Assign) else []
            if isinstance(node, ast.AnnAssign):
                targets = [node.target]
            value = getattr(node, "value", None)
            is_value = isinstance(value, ast.expr) and not is_none(value)
            if is_value and any(_is_attribute(target, attribute) for target in targets):
                return True
    return False
