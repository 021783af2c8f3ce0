"""Whether a function guards what it reads: it handles what is missing, or asks for it first."""

from __future__ import annotations

import ast
from collections.abc import Callable

from composer.behavior_source import Function
from composer.behavior_source.method_body import catches, dotted
from composer.behavior_types.syntax.bindings import nodes_of

_ALWAYS = frozenset({"BaseException", "Exception"})
#: The exceptions of a key that a dict, or a value that an enumeration, lacks.
OF_KEYS = _ALWAYS | {"KeyError", "LookupError"}
OF_CHOICES = OF_KEYS | {"AttributeError", "ValueError"}
#: Those of an element that a list lacks, and of one that is unpacked into other names.
OF_INDICES = _ALWAYS | {"IndexError", "LookupError"}
OF_LENGTHS = OF_INDICES | {"ValueError"}


def handles(function: Function, errors: frozenset[str]) -> bool:
    """Return whether a function handles any of these exceptions, by ``except`` or ``suppress``."""
    for node in nodes_of(function):
        match node:
            case ast.ExceptHandler() if catches(node, errors):
                return True
            case ast.Call(func=called, args=caught) if dotted(called).endswith("suppress"):
                if any(dotted(item) in errors for item in caught):
                    return True
    return False


def asks_for_length(
    function: Function, is_other: Callable[[ast.expr], bool] = lambda _: False
) -> bool:
    """Return whether a function asks how long something is, other than what ``is_other`` says."""
    for node in nodes_of(function):
        match node:
            case ast.Call(args=[ast.Name(id="len"), *_]):  # map(len, ...)
                return True
            case ast.Call(func=ast.Name(id="len"), args=[measured]) if not is_other(measured):
                return True
    return False


def asks_for_key(function: Function, owner: ast.expr) -> bool:
    """Return whether a function asks whether a dict has a key."""
    written = ast.unparse(owner)
    return any(
        isinstance(node, ast.Compare)
        and any(isinstance(sign, ast.In | ast.NotIn) for sign in node.ops)
        and any(ast.unparse(item) == written for item in node.comparators)
        for node in nodes_of(function)
    )
