"""The modules of the standard library and their names, read from their source."""

from __future__ import annotations

import ast
import importlib
import sys
import warnings
from collections.abc import Iterator
from functools import lru_cache
from pathlib import Path

from composer.behavior_source.modules import Unreadable, module_below, read_text
from composer.behavior_source.traversal import walk

_FOLDER = Path(ast.__file__).parent  # sysconfig knows it as well, but takes 2 ms to import
#: Text of modules that add names to themselves when they are imported.
_DYNAMIC = ("globals()", "_convert_", "sys.modules[", "def __getattr__", "vars()", "exec(")
_MAXIMUM_STARS = 4
#: Compiled modules, which have no source; importing one of these imports nothing else.
_COMPILED = frozenset({"array", "binascii", "cmath", "math", "mmap", "select", "time", "zlib"})


def is_standard(module: str) -> bool:
    """Return whether a module, by its first part, belongs to the standard library."""
    return module.partition(".")[0] in sys.stdlib_module_names


@lru_cache(maxsize=256)
def standard_names(module: str) -> frozenset[str] | None:
    """Return the names of a module of the standard library; None if they are not known.

    Raises LookupError if there is no such module.
    """
    loaded = sys.modules.get(module)
    if loaded is not None and _is_own(getattr(loaded, "__file__", None)):
        return frozenset(dir(loaded)) | _submodules(module)
    path = _file(module)
    if path is None:
        if "." in module and _file(module.partition(".")[0]) is not None:
            raise LookupError(module)
        return frozenset(dir(importlib.import_module(module))) if module in _COMPILED else None
    return _names(path, _MAXIMUM_STARS)


def _is_own(file: str | None) -> bool:
    """Return whether a file, None for a built-in module, belongs to the standard library."""
    return file is None or Path(file).is_relative_to(_FOLDER)


def _file(module: str) -> Path | None:
    return module_below(_FOLDER, module.split("."))


def _submodules(module: str) -> frozenset[str]:
    path = _file(module)
    if path is None or path.name != "__init__.py":
        return frozenset()
    return frozenset(item.name.partition(".")[0] for item in path.parent.iterdir())


def _names(path: Path, stars: int) -> frozenset[str] | None:
    try:
        text = read_text(path)
    except Unreadable:
        return None
    if any(part in text for part in _DYNAMIC):
        return None
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        tree = ast.parse(text)
    found = {name for name in dir(ast) if name.startswith("__")}  # those of every module
    for node in _statements(tree):
        match node:
            case ast.ImportFrom(names=[ast.alias(name="*")]):
                starred = _starred(node, path, stars)
                if starred is None:
                    return None
                found |= starred
            case ast.alias(name=name, asname=other):
                found.add(other or name.partition(".")[0])
            case ast.FunctionDef(name=name) | ast.AsyncFunctionDef(name=name):
                found.add(name)
            case ast.ClassDef(name=name):
                found.add(name)
            case ast.Name(id=name, ctx=ast.Store()):
                found.add(name)
    if path.name == "__init__.py":
        found |= {item.name.partition(".")[0] for item in path.parent.iterdir()}
    return frozenset(found)


def _starred(node: ast.ImportFrom, path: Path, stars: int) -> frozenset[str] | None:
    """Return the names of ``from module import *`` in a file; None if they are not known."""
    if stars == 0:
        return None
    if not node.level:
        loaded = sys.modules.get(node.module or "")
        if loaded is not None and _is_own(getattr(loaded, "__file__", None)):
            return frozenset(dir(loaded))
        found = _file(node.module or "")
    else:
        found = module_below(path.parent, (node.module or "").split("."))
    return _names(found, stars - 1) if found is not None else None


def _statements(tree: ast.Module) -> Iterator[ast.AST]:
    """Yield the nodes outside functions and classes."""
    return walk([tree], closed=(ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef, ast.Lambda))
