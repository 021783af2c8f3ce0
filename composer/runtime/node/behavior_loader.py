"""Loads the behavior class of a node, and what the composer provides to behaviors.

Python files of behaviors, and the modules next to them, are imported under names of their own. A
file imports another one of its folder, or of the project's node types, as a script would: ``import
helper``. But ``sys.path`` stays as it is, and the modules are in ``sys.modules`` below a package
for each folder, ``_composer_behavior_<digest>``: two projects may each have a ``helper.py``, and
neither hides a module of the standard library or of another project.
"""

from __future__ import annotations

import builtins
import functools
import hashlib
import importlib
import sys
import threading
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from importlib.abc import MetaPathFinder
from importlib.machinery import ModuleSpec, PathFinder, SourceFileLoader
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any

from composer.behavior import CallCancelled
from composer.model import BehaviorReference
from composer.runtime.executors.futures import Future
from composer.runtime.executors.tasks import sleep
from composer.runtime.executors.tracebacks import BEHAVIOR_PACKAGE, calls_user_code, interruptible

if TYPE_CHECKING:
    from composer.runtime.callbacks.context import NodeContext

#: Held during imports: another loop must not see a module that is only half executed.
_LOCK = threading.RLock()
#: The folders in which the modules of a package are searched, by its name.
_folders: dict[str, tuple[Path, ...]] = {}
#: The importers of the executed files, by the names of their modules.
_importers: dict[str, _Importer] = {}
#: A method of a behavior.
Method = Callable[..., Any]


def import_module(module: str, base: Path, folders: Sequence[Path]) -> ModuleType:
    """Import the file of ``module``, a dotted name, below ``base``.

    What it imports is searched next to it, then in ``folders``. Raises anything that it raises.
    """
    with _LOCK:
        return importlib.import_module(f"{_package(base, folders)}.{module}")


def plain_name(module: str) -> str:
    """Return the name of a module as files import it, without our package."""
    return module.partition(".")[2] if module.startswith(BEHAVIOR_PACKAGE) else module


def _package(base: Path, folders: Sequence[Path]) -> str:
    """Return the name of the package of a folder, without importing anything from it."""
    digest = hashlib.sha256(str(base.resolve()).encode()).hexdigest()[:12]
    name = f"{BEHAVIOR_PACKAGE}{digest}"
    if name not in sys.modules:
        if not any(isinstance(finder, _Finder) for finder in sys.meta_path):
            sys.meta_path.insert(0, _Finder())  # before the one that would load without _Loader
            _find_helpers_by_name()
        package = ModuleType(name)
        package.__path__ = [str(base)]
        _folders[name] = tuple(folders)
        sys.modules[name] = package
    return name


def _find_helpers_by_name() -> None:
    """Let ``importlib.import_module`` in a file of a behavior find what its imports find."""
    original = importlib.import_module

    @functools.wraps(original)
    def import_module(name: str, package: str | None = None) -> ModuleType:
        importer = _importers.get(sys._getframe(1).f_globals.get("__name__", ""))
        if importer is not None and not name.startswith("."):
            name = importer.own_name(name) or name
        return original(name, package)

    importlib.import_module = import_module


class _Finder(MetaPathFinder):
    """Finds the modules of our packages; :class:`_Loader` loads them."""

    def find_spec(
        self, name: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """Return the spec of a module below one of our packages, else None."""
        if not name.startswith(BEHAVIOR_PACKAGE):
            return None
        spec = PathFinder.find_spec(name, path, target)
        if spec is not None and type(spec.loader) is SourceFileLoader:
            spec.loader = _Loader(spec.loader.name, spec.loader.path)
        return spec


class _Loader(SourceFileLoader):
    """Executes a file with an ``__import__`` that knows the modules next to it."""

    @calls_user_code
    def exec_module(self, module: ModuleType) -> None:
        """Execute the file."""
        importer = _Importer(Path(self.path).parent, module.__name__.partition(".")[0])
        _importers[module.__name__] = importer
        module.__dict__["__builtins__"] = {**vars(builtins), "__import__": importer.import_}
        super().exec_module(module)


class _Importer:
    """The ``__import__`` of one file."""

    def __init__(self, folder: Path, package: str) -> None:
        self._folders = tuple(dict.fromkeys((folder, *_folders[package])))

    def import_(
        self,
        name: str,
        globals: Mapping[str, object] | None = None,  # noqa: A002 - the names are Python's
        locals: Mapping[str, object] | None = None,  # noqa: A002
        fromlist: Sequence[str] | None = (),
        level: int = 0,
    ) -> Any:
        """Import a module as :func:`builtins.__import__` does."""
        own = self.own_name(name) if level == 0 else None
        if own is None:
            return builtins.__import__(name, globals, locals, fromlist or (), level)
        if fromlist:
            return builtins.__import__(own, globals, locals, fromlist, 0)
        importlib.import_module(own)
        rest = name.count(".")
        return sys.modules[own.rsplit(".", rest)[0] if rest else own]

    def own_name(self, name: str) -> str | None:
        """Return the full name of a module of the project; None for all others."""
        parts = name.split(".")
        if parts[0] in sys.stdlib_module_names or parts[0] == "composer":
            return None
        for folder in self._folders:
            if _is_module(folder, parts):
                return f"{self._package_of(folder)}.{name}"
        return None

    def _package_of(self, folder: Path) -> str:
        """Return the package for ``folder``: also one below the folder of a package."""
        for base in self._folders[1:]:
            if folder != base and folder.is_relative_to(base):
                inner = ".".join(folder.relative_to(base).parts)
                return f"{_package(base, self._folders[1:])}.{inner}"
        return _package(folder, self._folders[1:])


def _is_module(folder: Path, parts: Sequence[str]) -> bool:
    """Return whether a folder has the file of a module, or a package of which it may be a part."""
    top = folder / parts[0]
    if top.with_suffix(".py").is_file() or (top / "__init__.py").is_file():
        return True
    path = folder.joinpath(*parts)
    return len(parts) > 1 and (
        path.with_suffix(".py").is_file() or (path / "__init__.py").is_file()
    )


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


class ParameterValues:
    """``self.parameters`` of a behavior: the current values by name, read-only."""

    def __init__(self, values: dict[str, Any]) -> None:
        # The dict itself, which is updated in place: reading a parameter calls no Python code.
        object.__setattr__(self, "__dict__", values)

    def __getattr__(self, name: str) -> Any:
        known = ", ".join(sorted(vars(self))) or "none"
        raise AttributeError(f"no parameter '{name}'; available: {known}")

    def __setattr__(self, name: str, _: object) -> None:
        raise AttributeError(f"parameter '{name}' cannot be assigned: use 'compose param set'")

    def __delattr__(self, name: str) -> None:
        raise AttributeError(f"parameter '{name}' cannot be deleted")

    def __getitem__(self, name: str) -> Any:
        return vars(self)[name]

    def __dir__(self) -> list[str]:
        return sorted(vars(self))


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
        return self._context.stamp()

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
