"""The classes that a class in the files of a project is derived from."""

from __future__ import annotations

import ast
import builtins
import enum
from functools import lru_cache

from composer.behavior_source import Module, helper_named, links_version
from composer.behavior_types.syntax.names import full_name
from composer.behavior_types.values import OwnClass
from composer.fast_dataclass import dataclass

NAMED_TUPLE = "typing.NamedTuple"
RECORDS = frozenset({"typing.TypedDict", "typing_extensions.TypedDict"})
#: Classes of Python that give no attributes and no constructor.
PLAIN_BASES = frozenset({"abc.ABC", "object", "typing.Generic"})
#: The enumerations of Python.
ENUMS = {
    f"enum.{kind.__name__}": kind
    for kind in (enum.Enum, enum.Flag, enum.IntEnum, enum.IntFlag, enum.StrEnum)
}
#: What an enumeration may be derived from besides.
VALUE_BASES = {"float": float, "int": int, "str": str}
_MOST = 32


@dataclass(frozen=True, slots=True)
class Lineage:
    """A class and the classes that it is derived from, nearest first.

    ``others`` are the full names of those that are not in a file of the project.
    """

    classes: tuple[OwnClass, ...]
    others: frozenset[str]


def lineage(own: OwnClass) -> Lineage:
    """Return the classes that a class is derived from, and the class itself."""
    return _lineage(own, links_version())


@lru_cache(maxsize=256)
def _lineage(own: OwnClass, _version: int) -> Lineage:
    found: list[OwnClass] = []
    others: set[str] = set()
    pending = [own]
    while pending and len(found) < _MOST:
        known = pending.pop()
        if known in found:
            continue
        found.append(known)
        bases = []
        for base in known.definition.bases:
            nearer = class_named(base, known.home)
            if nearer is not None and nearer != known:
                bases.append(nearer)
            else:
                others.add(full_name(base, known.home) or base)
        pending += bases[::-1]
    return Lineage(tuple(found), frozenset(others))


def class_named(name: str, module: Module) -> OwnClass | None:
    """Return the class of the project that a name, also a dotted one, refers to in a module.

    It is the only thing with this name, at the top level of its file.
    """
    first, _, rest = name.rpartition(".")
    found = helper_named(first or rest, module)
    if first and found is not None:
        is_module = not found.name
        found = helper_named(rest, found.module) if is_module else None
    if found is None or not found.name:
        return None
    home, last = found.module, found.name
    known = home.classes.get(last)
    is_only = last not in home.assigned and last not in home.imports and last not in home.repeated
    return OwnClass(known, home) if known is not None and is_only else None


def is_derived(own: OwnClass, base: OwnClass) -> bool:
    """Return whether a class is another one, or derived from it."""
    return base in lineage(own).classes


def exception_base(name: str) -> type[BaseException] | None:
    """Return the built-in exception of that name, None for other names."""
    found = getattr(builtins, name, None)
    return found if isinstance(found, type) and issubclass(found, BaseException) else None


def decorators_of(own: OwnClass) -> set[str]:
    """Return the full names of the decorators of a class."""
    return {decorator_name(item, own.home) for item in own.definition.node.decorator_list}


def decorator_name(node: ast.expr, home: Module) -> str:
    """Return the full name of a decorator, also of one that is called."""
    called = node.func if isinstance(node, ast.Call) else node
    written = ast.unparse(called)
    return full_name(written, home) or written
