"""Finds the Python class that a node names, and gives it what the composer promised."""

from __future__ import annotations

import hashlib
import importlib
import importlib.util
import sys
import threading
from collections.abc import Callable, Mapping
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import Any

from composer.behavior import CallCancelled
from composer.model import BehaviorReference
from composer.runtime.callbacks.context import NodeContext
from composer.runtime.executors.tasks import Future, sleep
from composer.runtime.executors.user_code import calls_user_code, may_be_interrupted

#: A behaviour's method, or None where it has none of that name.
Method = Callable[..., Any]

#: Nodes of several loops may want the same file at once; nobody is to get a half of it.
_IMPORTING = threading.RLock()


class BehaviorLoadError(Exception):
    """A behaviour that cannot be loaded; the text says which and why."""


def behavior_class(reference: BehaviorReference) -> type[Any]:
    """Return the class that ``module:Class`` names.

    Looks for the module next to the YAML file, then among the project's node types, then among
    installed modules. Raises BehaviorLoadError if there is no such module or class, and anything
    that importing the module raises.
    """
    module = _module(reference)
    found = getattr(module, reference.class_name, None)
    if not isinstance(found, type):
        raise BehaviorLoadError(
            f"behavior '{reference.text}': {module.__file__} has no class '{reference.class_name}'"
        )
    return found


def method(behavior: object | None, name: str) -> Method | None:
    """Return the method ``name`` of ``behavior``, or None."""
    found = getattr(behavior, name, None) if behavior is not None else None
    return found if callable(found) else None


def _module(reference: BehaviorReference) -> ModuleType:
    parts = reference.module.split(".")
    for folder in (reference.folder, *reference.node_folders):
        path = folder.joinpath(*parts).with_suffix(".py")
        if path.is_file():
            return _module_of_file(path)
    try:
        return importlib.import_module(reference.module)
    except ModuleNotFoundError as error:
        raise BehaviorLoadError(
            f"behavior '{reference.text}': there is no '{parts[-1]}.py' in {reference.folder} "
            "or among the project's node types, and no such installed module"
        ) from error


def _module_of_file(path: Path) -> ModuleType:
    """Import a file under a name of its own, so that ``planner.py`` of two folders are two."""
    mark = hashlib.sha256(str(path.resolve()).encode()).hexdigest()[:12]
    name = f"_composer_behavior_{mark}_{path.stem}"
    with _IMPORTING:
        return sys.modules.get(name) or _imported(name, path)


@calls_user_code
def _imported(name: str, path: Path) -> ModuleType:
    spec = importlib.util.spec_from_file_location(name, path)
    if spec is None or spec.loader is None:
        raise BehaviorLoadError(f"{path} is not a Python file")
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module  # dataclasses and pickles look their module up there
    try:
        spec.loader.exec_module(module)
    except BaseException:
        del sys.modules[name]
        raise
    return module


class Named:
    """``self.publishers``, ``self.clients``: things of one kind, by name."""

    __slots__ = ("__entries", "__kind")

    def __init__(self, kind: str, entries: Mapping[str, Any]) -> None:
        self.__kind = kind
        self.__entries = entries

    @may_be_interrupted
    def __getattr__(self, name: str) -> Any:
        try:
            return self.__entries[name]
        except KeyError:
            known = ", ".join(sorted(self.__entries)) or "none"
            raise AttributeError(f"no {self.__kind} '{name}'; there is: {known}") from None

    def __getitem__(self, name: str) -> Any:
        return self.__entries[name]

    def __dir__(self) -> list[str]:
        return sorted(self.__entries)


def named_ports(kind: str, entries: Mapping[str, Any]) -> Named:
    """Return ports by name: there are never others, so that most are attributes, found at once."""
    # A slot with a leading underscore might be of another name, or one of ours; and a port that has
    # a topic of its own may be called as it likes, but attributes are identifiers.
    plain = tuple(name for name in entries if name.isidentifier() and not name.startswith("_"))
    ports = _ports_type(plain)(kind, entries)
    for name in plain:
        setattr(ports, name, entries[name])
    return ports


@cache
def _ports_type(names: tuple[str, ...]) -> type[Named]:
    """Return the type of ports with these names: slots are in the object, a dict is far away."""
    return type("Ports", (Named,), {"__slots__": names})


class NodeClock:
    """A behaviour's ``clock``; see :class:`composer.behavior.Clock`."""

    def __init__(self, core: NodeContext, standby: NodeContext) -> None:
        self._core = core
        self._standby = standby

    def now(self) -> float:
        """Return the time in seconds."""
        return self._core.now_s()

    def stamp(self) -> Any:
        """Return the time as a builtin_interfaces/msg/Time."""
        return self._core.node.get_clock().now().to_msg()

    def sleep(self, seconds: float) -> Future[None]:
        """Let other callbacks run for so long. Raises CallCancelled when the node leaves active.

        While the node is inactive it is for handlers of ports that are always on.
        """
        for gate in (self._core.gate, self._standby.gate):
            if gate.waiting:
                return gate.pending.hold(sleep(self._core.clock, max(0.0, seconds)))
        ended: Future[None] = Future()
        ended.set_exception(CallCancelled(self._core.gate.refusal))
        return ended
