"""What the names in a Python file mean: interfaces, classes of the API, and functions."""

from __future__ import annotations

import ast
import re
from collections import Counter
from functools import lru_cache

from composer.behavior_source import Module
from composer.behavior_source.method_body import Function, dotted
from composer.behavior_source.traversal import walk
from composer.behavior_types.api import API_CLASSES

_API_MODULE = "composer.behavior"
_INTERFACE = re.compile(r"(?P<package>\w+)\.(?P<folder>msg|srv|action)\.(?P<name>[A-Za-z]\w*)")


def full_name(name: str, module: Module) -> str:
    """Return the full name of a dotted name, as in ``std_msgs.msg.String``; "" if unknown."""
    head, _, rest = name.partition(".")
    imported = module.imports.get(head)
    if imported is None:
        # 'import std_msgs.msg' binds 'std_msgs'.
        return name if any(other.startswith(f"{head}.") for other in module.imports) else ""
    if imported.level or head in module.assigned:
        return ""
    parts = (imported.module, imported.name, rest)
    return ".".join(part for part in parts if part)


def interface_name(full: str) -> tuple[str, str]:
    """Return the interface that a full name begins with, and the rest; "" if there is none."""
    found = _INTERFACE.match(full)
    if found is None:
        return "", ""
    name = f"{found['package']}/{found['folder']}/{found['name']}"
    return name, full[found.end() :].removeprefix(".")


def api_class(full: str) -> str | None:
    """Return the class of the API with that full name, or None."""
    package, _, name = full.rpartition(".")
    return name if package == _API_MODULE and name in API_CLASSES else None


def function_named(name: str, module: Module) -> Function | None:
    """Return the function at the top level of a module, if nothing else has its name."""
    found = _functions(module).get(name)
    is_plain = name not in module.assigned and name not in module.imports
    return found if is_plain else None


@lru_cache(maxsize=128)
def _functions(module: Module) -> dict[str, Function | None]:
    """Return the functions at the top level of a module; None for one defined several times."""
    found: dict[str, Function | None] = {}
    for item in module.tree.body:
        if isinstance(item, Function):
            found[item.name] = None if item.name in found else item
    return found


def constant_named(name: str, module: Module) -> ast.expr | ast.AnnAssign | None:
    """Return what a module assigns to a name once, and that nothing replaces: a value or a call.

    With an annotation, it is the statement.
    """
    return _constants(module).get(name)


def value_named(name: str, module: Module) -> ast.expr | None:
    """Return the value of such a constant, with an annotation or without."""
    constant = constant_named(name, module)
    return constant.value if isinstance(constant, ast.AnnAssign) else constant


def alias_named(name: str, module: Module) -> ast.expr | None:
    """Return the type that a module names at its top level, as in ``Box = tuple[int, int]``."""
    found = [
        statement.value
        for statement in module.tree.body
        if isinstance(statement, ast.Assign)
        and any(isinstance(target, ast.Name) and target.id == name for target in statement.targets)
    ]
    is_type = len(found) == 1 and isinstance(found[0], ast.Subscript | ast.Name | ast.Attribute)
    # 'Box = Box' would never end
    is_other = is_type and not any(
        isinstance(node, ast.Name) and node.id in module.assigned for node in ast.walk(found[0])
    )
    return found[0] if is_other else None


_SINGLE = (ast.BinOp, ast.Call, ast.Constant, ast.Dict, ast.List, ast.Tuple, ast.UnaryOp)


@lru_cache(maxsize=128)
def _constants(module: Module) -> dict[str, ast.expr | ast.AnnAssign]:
    values: dict[str, ast.expr | ast.AnnAssign] = {}
    for statement in module.tree.body:
        if isinstance(statement, ast.AnnAssign) and isinstance(statement.target, ast.Name):
            is_final = ast.unparse(statement.annotation).endswith("Final")
            value = statement.value if is_final else statement
            if value is not None:
                values[statement.target.id] = value
        is_single = isinstance(statement, ast.Assign) and isinstance(statement.value, _SINGLE)
        if isinstance(statement, ast.Assign) and is_single:
            for target in statement.targets:
                if isinstance(target, ast.Name):
                    values[target.id] = statement.value
    if not values:
        return values
    nodes = list(walk(module.tree.body))
    changed = {name for node in nodes if isinstance(node, ast.Global) for name in node.names}
    stored = Counter(
        node.id
        for node in nodes
        if isinstance(node, ast.Name) and not isinstance(node.ctx, ast.Load)
    )
    return {
        name: value for name, value in values.items() if stored[name] == 1 and name not in changed
    }


def own_name(node: ast.expr, module: Module) -> str:
    """Return the full name of an expression; "" for other expressions than imported names."""
    name = dotted(node)
    return full_name(name, module) if name else ""
