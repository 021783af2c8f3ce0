"""Methods that lack ``self``."""

from __future__ import annotations

import ast

from composer.python_code.source.method_body import Function

_CLASS_METHODS = frozenset({"__new__", "__init_subclass__", "__class_getitem__"})
_RECEIVERS = frozenset({"self", "cls", "mcs"})


def lacks_self(function: Function, arguments: int | None = None) -> bool:
    """Return whether a method lacks its first argument, ``self``.

    It does if it has no argument at all, if it uses ``self`` without having it, or if it takes
    exactly the ``arguments`` that a handler gets besides ``self``.
    """
    if function.decorator_list or function.name in _CLASS_METHODS:
        return False
    positional = [item.arg for item in (*function.args.posonlyargs, *function.args.args)]
    if not positional:
        return function.args.vararg is None
    if positional[0] in _RECEIVERS or positional[0].startswith("_"):
        return False
    every = [*positional, *(item.arg for item in function.args.kwonlyargs)]
    if "self" not in every and _uses_self(function):
        return True
    return arguments is not None and len(positional) == arguments


def _uses_self(function: Function) -> bool:
    names = [node for node in ast.walk(function) if isinstance(node, ast.Name)]
    used = [node for node in names if node.id == "self"]
    return bool(used) and all(isinstance(node.ctx, ast.Load) for node in used)
