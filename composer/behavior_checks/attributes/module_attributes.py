"""Checks the attributes of modules of the standard library, and of numpy."""

from __future__ import annotations

import ast
import importlib
from collections.abc import Collection, Iterator
from types import BuiltinFunctionType, FunctionType

from composer.behavior_checks.problems import CodeProblem, Kind
from composer.behavior_source import Module
from composer.behavior_source.library import is_standard, standard_names
from composer.behavior_source.method_body import asks_for_system
from composer.behavior_source.spans import attribute_span
from composer.behavior_source.traversal import walk
from composer.behavior_types.libraries.numpy_names import NUMPY_NAMES
from composer.diagnostics import nearest, suggestion


def module_attributes(module: Module) -> Iterator[CodeProblem]:
    """Check the attributes of the modules of the standard library and of numpy in a file."""
    aliases = {
        bound: imported.module
        for bound, imported in module.imports.items()
        if not imported.name and "." not in bound and _is_known(imported.module)
    }
    yield from _attributes_of_names(module)
    for written, node in _uses(module, aliases):
        first, dot, part = written.partition(".")
        full = aliases[first] + dot + part
        names = _known_names(full) if not dot or full in NUMPY_NAMES else None
        if names is None or node.attr in names or node.attr.startswith("__"):
            continue
        close = nearest(node.attr, names)
        if close is None and full in NUMPY_NAMES:
            continue  # it may be new
        if _may_be_elsewhere(full, node, module):
            continue
        message = f"module '{full}' has no '{node.attr}'"
        hint = suggestion(node.attr, names) if close else None
        yield CodeProblem(Kind.IMPORT, message, attribute_span(node, module.source), hint)


def _may_be_elsewhere(full: str, node: ast.Attribute, module: Module) -> bool:
    """Return whether a name may exist in other systems, for which the file has code as well."""
    if full == "sys" and (node.attr.startswith("last_") or node.attr in {"ps1", "ps2"}):
        return True  # in an interactive interpreter
    for item in walk(module.tree.body):
        match item:
            case ast.Constant(value=str() as asked) if asked == node.attr:
                return True  # of 'hasattr'
            case ast.If(test=test) if asks_for_system([test]) and node in walk([item]):
                return True
    return False


def _uses(module: Module, names: Collection[str]) -> list[tuple[str, ast.Attribute]]:
    """Return the attributes of what begins with one of the names, and what that is.

    Names that mean something else somewhere in the file are left out.
    """
    if not names:
        return []
    found: list[tuple[str, ast.Attribute]] = []
    others: set[str] = set()
    for node in walk(module.tree.body):
        match node:
            case ast.Attribute(value=ast.Name(id=name)) if name in names:
                found.append((name, node))
            case ast.Attribute(value=ast.Attribute(value=ast.Name(id=name), attr=part)):
                found += [(f"{name}.{part}", node)] if name in names else []
            case ast.Name(id=name, ctx=ast.Store() | ast.Del()) | ast.arg(arg=name):
                others.add(name)
    return [(written, node) for written, node in found if written.partition(".")[0] not in others]


#: Modules whose functions and classes are looked at: they import little, and change nothing.
_LOOKED_AT = frozenset(
    {"collections", "copy", "datetime", "itertools", "json", "math", "random", "re", "time"}
)


def _attributes_of_names(module: Module) -> Iterator[CodeProblem]:
    """Check the attributes of functions and classes that are imported by name.

    After ``from datetime import datetime``, for example, there is no ``datetime.datetime``.
    """
    names = {
        bound: imported
        for bound, imported in module.imports.items()
        if imported.name and imported.module in _LOOKED_AT and not imported.level
    }
    for bound, node in _uses(module, names):
        if "." in bound:
            continue
        imported = names[bound]
        home = importlib.import_module(imported.module)
        found = getattr(home, imported.name or "", None)
        if not isinstance(found, FunctionType | BuiltinFunctionType | type):
            continue
        if hasattr(found, node.attr) or node.attr.startswith("__"):
            continue
        message = f"'{imported.module}.{imported.name}' has no attribute '{node.attr}'"
        hint = suggestion(node.attr, dir(found))
        if hasattr(home, node.attr):
            hint = f"'{bound}' is '{imported.module}.{imported.name}' here, not the module"
        yield CodeProblem(Kind.ATTRIBUTE, message, attribute_span(node, module.source), hint)


def _is_known(module: str) -> bool:
    return is_standard(module) or module in NUMPY_NAMES


def _known_names(module: str) -> frozenset[str] | None:
    if module in NUMPY_NAMES:
        return NUMPY_NAMES[module]
    try:
        return standard_names(module)
    except LookupError:
        return None
