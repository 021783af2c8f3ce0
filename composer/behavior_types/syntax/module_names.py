"""The names that a file of a project defines."""

from __future__ import annotations

import ast
from functools import lru_cache

from composer.behavior_source import Module
from composer.behavior_source.traversal import walk


def module_names(module: Module) -> frozenset[str] | None:
    """Return the names that a file defines; None if it may have others.

    A package also has its modules.
    """
    return None if module.dynamic else _defined_names(module)


@lru_cache(maxsize=128)
def hides(module: Module) -> frozenset[str]:
    """Return the names of the functions and classes at the top level of a file."""
    closed = (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef, ast.Lambda)
    top = walk(module.tree.body, closed=closed)
    return frozenset(node.name for node in top if isinstance(node, closed[:3]))


@lru_cache(maxsize=128)  # as many as there are modules in memory; those of rclpy are large
def _defined_names(module: Module) -> frozenset[str]:
    found = {name.partition(".")[0] for name in module.imports} | {*module.imports}
    for item in walk(module.tree.body):
        match item:
            case ast.FunctionDef(name=name) | ast.AsyncFunctionDef(name=name):
                found.add(name)
            case ast.ClassDef(name=name) | ast.Name(id=name, ctx=ast.Store()):
                found.add(name)
    if module.path.name == "__init__.py":
        found.update(path.name.partition(".")[0] for path in module.path.parent.iterdir())
    return frozenset(found)
