"""Which files a check reads: the copies of a project's modules, and the stubs that they need.

Modules of one name in different folders, and a class that two node types use, cannot be in one
check: each gets a check of its own.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import field
from pathlib import Path

from composer.fast_dataclass import dataclass
from composer.interfaces import Interfaces
from composer.interfaces.sources import FOLDERS
from composer.model import Node, PortKind
from composer.python_code.checker.copies import ClassEdit, Copy, edited_copy
from composer.python_code.lookup import BehaviorSource, BrokenModule
from composer.python_code.stubs.behaviors import (
    behavior_class_name,
    behavior_module,
    port_type,
    signatures,
)
from composer.python_code.stubs.folder import LIBRARIES, api_stub
from composer.python_code.stubs.messages import message_stubs
from composer.python_code.syntax import Module
from composer.typed import SUFFIX

_FILES = "files"
_STUBS = "stubs"
#: What the API of behaviors uses, and the packages that the stubs of rclpy use.
_API_MESSAGES = ("builtin_interfaces/msg/Time", "geometry_msgs/msg/TransformStamped")
_RCLPY_PACKAGES = frozenset(
    {"action_msgs", "builtin_interfaces", "lifecycle_msgs", "rcl_interfaces", "rosgraph_msgs"}
    | {"unique_identifier_msgs"}
)


@dataclass(frozen=True, slots=True)
class CheckedFile:
    """A copy, and the node and class because of which it is checked."""

    copy: Copy
    node: Node
    source: BehaviorSource


@dataclass(slots=True)
class FileSet:
    """The files of one check.

    ``behaviors`` are the generated base classes by name, each with its node. ``folders`` are the
    folders from which modules are imported, by their top-level names. ``broken`` are the files that
    this Python cannot parse: the checker knows newer syntax.
    """

    behaviors: dict[str, Node] = field(default_factory=dict)
    edits: dict[Path, dict[str, ClassEdit]] = field(default_factory=dict)
    modules: dict[Path, tuple[Module, Node, BehaviorSource]] = field(default_factory=dict)
    folders: dict[str, Path] = field(default_factory=dict)
    search: dict[Path, None] = field(default_factory=dict)
    broken: dict[str, tuple[BrokenModule, Node, BehaviorSource]] = field(default_factory=dict)

    def accepts(self, source: BehaviorSource) -> bool:
        """Return whether the files of a class can be in this check."""
        if source.path in self.edits and source.reference.class_name in self.edits[source.path]:
            return False
        return all(
            self.folders.get(name, folder) == folder
            for name, folder in map(_import_root, source.own_modules)
        )

    def add(self, node: Node, source: BehaviorSource, interfaces: Interfaces) -> None:
        """Add the class of a node, with the files that it imports."""
        reference = source.reference
        self.search |= dict.fromkeys((reference.folder, *reference.node_folders))
        for broken in source.broken:
            self.broken[f"{_FILES}{broken.path.as_posix()}"] = (broken, node, source)
        for module in source.own_modules:
            self.modules.setdefault(module.path, (module, node, source))
            name, folder = _import_root(module)
            self.folders[name] = folder
            self.search[folder] = None
        base = ""
        handlers = {}
        types = {
            f"self.action_clients.{port.name.value}": port_type(port, interfaces) or ""
            for port in node.ports_of(PortKind.ACTION_CLIENT)
        }
        if node.behavior is not None:
            base = _unused_name(node, self.behaviors)
            self.behaviors[base] = node
            handlers = signatures(node, interfaces)
        for module, class_ in source.own_classes:
            is_start = class_.name == reference.class_name and module.path == source.path
            start = f"composer.typed.{base}" if base and is_start else ""
            edit = ClassEdit(start, handlers, types)
            self.edits.setdefault(module.path, {})[class_.name] = edit

    def copies(self) -> dict[str, CheckedFile]:
        """Return the copies, by their names below the folder of the check."""
        found = {}
        for path, (module, node, source) in self.modules.items():
            is_behavior = node.behavior is not None
            copy = edited_copy(module, self.edits.get(path, {}), is_behavior=is_behavior)
            found[f"{_FILES}{path.as_posix()}"] = CheckedFile(copy, node, source)
        return found

    def stubs(self, interfaces: Interfaces) -> dict[str, str]:
        """Return the stubs that the files need, by their names below the folder of the check."""
        names = {port.interface.value for node in self.behaviors.values() for port in node.ports}
        names.update(_API_MESSAGES)
        packages: set[str] = set()
        typed: set[str] = set()  # also the class of a base type, of which a node type inherits
        for module, _, _ in self.modules.values():
            for imported, name in _imports(module.tree):
                package, _, folder = imported.partition(".")
                if package == "rclpy" or "self.node" in module.source.text:
                    packages |= _RCLPY_PACKAGES
                if imported == "composer.typed" and name.endswith(SUFFIX):
                    typed.add(name)
                if folder in FOLDERS and name not in ("", "*"):
                    names |= {f"{package}/{folder}/{name}", f"{package}/{folder}/{_whole(name)}"}
                else:
                    packages.add(package)
        packages &= interfaces.packages()
        every = (name for folder in FOLDERS for name in interfaces.names(folder) if packages)
        names.update(name for name in every if name.partition("/")[0] in packages)
        files = message_stubs(interfaces, sorted(names))
        files["composer/__init__.pyi"] = ""
        files["composer/behavior.pyi"] = api_stub()
        files["composer/typed.pyi"] = behavior_module(
            self.behaviors, interfaces, sorted(typed - self.behaviors.keys())
        )
        return {f"{_STUBS}/{name}": text for name, text in files.items()}

    def search_paths(self) -> list[str]:
        """Return the folders from which the files import, stubs first."""
        parents = {parent for path in self.modules for parent in path.parents}
        used = (path for path in self.search if path in parents)  # others are not in the copy
        return [_STUBS, str(LIBRARIES), *(f"{_FILES}{path.as_posix()}" for path in used)]


def file_sets(
    classes: Sequence[tuple[Node, BehaviorSource]], interfaces: Interfaces
) -> list[FileSet]:
    """Return the sets of files in which all classes are checked."""
    sets: list[FileSet] = []
    for node, source in classes:
        if not (source.own_modules or source.broken):
            continue  # installed packages are not checked
        fitting = next((item for item in sets if item.accepts(source)), None)
        if fitting is None:
            fitting = FileSet()
            sets.append(fitting)
        fitting.add(node, source, interfaces)
    return sets


def _unused_name(node: Node, taken: Mapping[str, Node]) -> str:
    """Return the name of the base class for the behavior of a node, not used by another one."""
    type_name = node.own_type_name or node.type_name or node.name
    name = behavior_class_name(type_name.value)
    while name in taken:
        name = f"Another{name}"
    return name


def _imports(tree: ast.Module) -> Iterator[tuple[str, str]]:
    """Yield the modules that a file imports anywhere, with the name that it takes from each."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from ((item.name, "") for item in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            yield from ((node.module, item.name) for item in node.names)


def _whole(name: str) -> str:
    """Return the service or action of a part such as ``Trigger_Request``."""
    return name.partition("_")[0]


def _import_root(module: Module) -> tuple[str, Path]:
    """Return the top-level name of a module, and the folder from which it is imported."""
    path = module.path
    folder, name = path.parent, path.stem
    while (folder / "__init__.py").is_file() and folder != folder.parent:
        folder, name = folder.parent, folder.name
    return name, folder
