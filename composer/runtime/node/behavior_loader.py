"""Loads the behavior class of a node, and what the composer provides to behaviors."""

from __future__ import annotations

import importlib
from collections.abc import Callable, Mapping
from functools import cache
from types import ModuleType
from typing import Any

from composer.behavior import CallCancelled
from composer.model import BehaviorReference
from composer.runtime.callbacks.context import NodeContext
from composer.runtime.executors.futures import Future
from composer.runtime.executors.stacks import interruptible
from composer.runtime.executors.tasks import sleep
from composer.runtime.node.behavior_modules import import_module

#: A method of a behavior.
Method = Callable[..., Any]


class BehaviorLoadError(Exception):
    """A behavior cannot be loaded; the text says which one and why."""


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
            f"cannot load '{reference.text}': "
            f"{module.__file__} has no class '{reference.class_name}'"
        )
    return found


def method(behavior: object | None, name: str) -> Method | None:
    """Return the method ``name`` of ``behavior``, or None."""
    found = getattr(behavior, name, None) if behavior is not None else None
    return found if callable(found) else None


def _module(reference: BehaviorReference) -> ModuleType:
    parts = reference.module.split(".")
    folders = (reference.folder, *reference.node_folders)
    for folder in folders:
        if folder.joinpath(*parts).with_suffix(".py").is_file():
            return import_module(reference.module, folder, folders)
    try:
        return importlib.import_module(reference.module)
    except ModuleNotFoundError as error:
        if not f"{reference.module}.".startswith(f"{error.name}."):
            raise  # the module exists, and imports one that does not
        raise BehaviorLoadError(
            f"cannot load '{reference.text}': there is no '{parts[-1]}.py' in {reference.folder} "
            "or among the project's node types, and no such installed module"
        ) from error


class Named:
    """``self.publishers``, ``self.clients`` ...: items of one kind, by name."""

    __slots__ = ("__entries", "__kind")

    def __init__(self, kind: str, entries: Mapping[str, Any]) -> None:
        self.__kind = kind
        self.__entries = entries

    @interruptible
    def __getattr__(self, name: str) -> Any:
        try:
            return self.__entries[name]
        except KeyError:
            known = ", ".join(sorted(self.__entries)) or "none"
            raise AttributeError(f"no {self.__kind} '{name}'; available: {known}") from None

    def __getitem__(self, name: str) -> Any:
        return self.__entries[name]

    def __dir__(self) -> list[str]:
        return sorted(self.__entries)


def named_ports(kind: str, entries: Mapping[str, Any]) -> Named:
    """Return ports by name, most of them in slots: the set of ports never changes."""
    # A name with a leading underscore may clash with an attribute of Named; a port with an explicit
    # topic may have a name that is not an identifier.
    plain = tuple(name for name in entries if name.isidentifier() and not name.startswith("_"))
    ports = _ports_type(plain)(kind, entries)
    for name in plain:
        setattr(ports, name, entries[name])
    return ports


@cache
def _ports_type(names: tuple[str, ...]) -> type[Named]:
    """Return a type with a slot for each name: slots are read faster than a dict."""
    return type("Ports", (Named,), {"__slots__": names})


class NodeClock:
    """A behavior's ``clock``; see :class:`composer.behavior.Clock`."""

    def __init__(self, context: NodeContext, always_on_context: NodeContext) -> None:
        self._context = context
        self._always_on_context = always_on_context

    def now(self) -> float:
        """Return the time in seconds."""
        return self._context.now_s()

    def stamp(self) -> Any:
        """Return the time as a builtin_interfaces/msg/Time."""
        return self._context.node.get_clock().now().to_msg()

    def sleep(self, seconds: float) -> Future[None]:
        """Let other callbacks run for ``seconds``.

        Raises CallCancelled when the node leaves *active*. While the node is inactive, only
        handlers of ports that are always on can sleep.
        """
        for gate in (self._context.gate, self._always_on_context.gate):
            if gate.waiting:
                return gate.pending.add(sleep(self._context.clock, max(0.0, seconds)))
        canceled: Future[None] = Future()
        canceled.set_exception(CallCancelled(self._context.gate.refusal))
        return canceled
