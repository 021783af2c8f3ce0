"""Names that are bound again to a value computed from their old one, once and in no loop."""

from __future__ import annotations

import ast
from functools import lru_cache

from composer.behavior_source import Function
from composer.behavior_types.syntax.bindings import Binding, Bindings, How, nodes_of

_REPEATING = (ast.AsyncFor, ast.AsyncFunctionDef, ast.For, ast.FunctionDef, ast.Lambda, ast.While)
#: What may get elements before the name is bound again.
_FILLED = (ast.Call, ast.Dict, ast.DictComp, ast.List, ast.ListComp, ast.Set, ast.SetComp)
_OF_COLLECTIONS = frozenset({"bytearray", "defaultdict", "deque", "dict", "list", "set", "Counter"})
_TWICE = 2


def old_values(function: Function, bindings: Bindings) -> dict[int, Binding]:
    """Return what ``p`` is bound to in the value of ``p = moved(p)``, by the id of the name."""
    found: dict[int, Binding] = {}
    for name, computed in bindings.computed.items():
        every = bindings.of_name(name)
        first = every[0]
        if len(every) != _TWICE or len(computed) != 1 or first is computed[0]:
            continue
        is_changed = (
            name in bindings.name_changes or name in bindings.asked | bindings.distinguished
        )
        new = computed[0].expression
        if is_changed or new is None or computed[0].how is not How.VALUE:
            continue
        if not _is_plain(first) or id(new) in _repeated(function):
            continue
        for node in ast.walk(new):
            if isinstance(node, ast.Name) and node.id == name:
                found[id(node)] = first
    return found


def _is_plain(first: Binding) -> bool:
    """Return whether the type of a name at first is known from its binding alone."""
    if first.expression is None or first.how not in (How.ANNOTATION, How.VALUE):
        return False
    if first.how is How.ANNOTATION:
        return True
    match first.expression:
        case ast.Constant(value=None):
            return False
        case ast.Call(func=ast.Name(id=name) | ast.Attribute(attr=name)):
            return name not in _OF_COLLECTIONS
        case _:
            return not isinstance(first.expression, _FILLED)


@lru_cache(maxsize=512)
def _repeated(function: Function) -> frozenset[int]:
    """Return the ids of the expressions that run several times, or at another time."""
    return frozenset(
        id(inside)
        for node in nodes_of(function)
        if isinstance(node, _REPEATING)
        for inside in ast.walk(node)
    )
