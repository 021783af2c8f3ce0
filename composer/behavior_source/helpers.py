"""Which file of a project a name is imported from, as the reader of behaviors has found it."""

from __future__ import annotations

from collections.abc import Mapping
from weakref import WeakKeyDictionary

from composer.behavior_source.syntax import Module
from composer.fast_dataclass import dataclass

_MOST_IMPORTS = 32


@dataclass(frozen=True, slots=True, eq=False)
class Helper:
    """What an import of a file of the project names: ``name`` of ``module``; "" is the module."""

    module: Module
    name: str


class _Links:
    """The helpers of each module; ``version`` changes when one of them does."""

    def __init__(self) -> None:
        self.version = 0
        self.helpers: WeakKeyDictionary[Module, dict[str, Helper | None]] = WeakKeyDictionary()


_links = _Links()


def link(module: Module, found: Mapping[str, Helper]) -> None:
    """Record what the imports of a module name.

    A module that is used by nodes in several folders may import other files in each of them: such
    names are not known.
    """
    known = _links.helpers.setdefault(module, {})
    for bound, helper in found.items():
        before = known.get(bound, helper)
        if bound in known and before is None:
            continue
        if before is not None and before.module.path != helper.module.path:
            known[bound] = None
        elif bound not in known or before is None or before.module is not helper.module:
            known[bound] = helper
        else:
            continue
        _links.version += 1


def links_version() -> int:
    """Return a number that changes when an import names another file, or a file has changed."""
    return _links.version


def helper_named(name: str, module: Module) -> Helper | None:
    """Return what a name of a module is in the project, None if it comes from elsewhere.

    Imports are followed to the file that defines the name; ``module`` may be that file.
    """
    for _ in range(_MOST_IMPORTS):
        if name not in module.imports:
            return Helper(module, name)
        found = _links.helpers.get(module, {}).get(name)
        is_only = name not in module.assigned and name not in module.classes
        if found is None or not is_only or not found.name:
            return found if is_only else None
        module, name = found.module, found.name
    return None
