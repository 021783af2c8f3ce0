"""The sets of files that the type checker reads together, with the stubs that they need.

Modules of one name in different folders, and a class that two node types use, cannot be in one
check: each gets a check of its own.
"""

from __future__ import annotations

import itertools
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import field
from pathlib import Path

from composer.base.fast_dataclass import dataclass
from composer.base.source import SourceFile
from composer.interfaces import Interfaces
from composer.model import Node
from composer.python_code.lookup import BehaviorSource, BrokenModule
from composer.python_code.stubs.behaviors import behavior_class_name, behavior_module, message_stubs
from composer.python_code.stubs.folder import LIBRARIES, api_stub
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
    """A file, and the node and class that it is checked for."""

    content: Module | BrokenModule
    node: Node
    source: BehaviorSource

    @property
    def text(self) -> SourceFile:
        """The file with its text."""
        return self.content.source if isinstance(self.content, Module) else self.content.span.file


@dataclass(slots=True)
class FileSet:
    """The files of one check, by their names below its folder.

    ``behaviors`` are the generated base classes by name, each with its node; ``nodes`` are the
    nodes of classes by file and name, each with the base that the class gets, or "". ``folders``
    are the folders from which modules are imported, by their top-level names. This Python cannot
    parse some files: the checker knows newer syntax.
    """

    files: dict[str, CheckedFile] = field(default_factory=dict)
    behaviors: dict[str, Node] = field(default_factory=dict)
    nodes: dict[tuple[Path | None, str], tuple[Node, str]] = field(default_factory=dict)
    folders: dict[str, Path] = field(default_factory=dict)
    search: dict[Path, None] = field(default_factory=dict)

    def accepts(self, source: BehaviorSource) -> bool:
        """Return whether the files of a class can be in this check."""
        if (source.path, source.reference.class_name) in self.nodes:
            return False
        return all(
            self.folders.get(name, folder) == folder
            for name, folder in map(_import_root, source.own_modules)
        )

    def add(self, node: Node, source: BehaviorSource) -> None:
        """Add the class of a node, with the files that it imports."""
        reference = source.reference
        self.search |= dict.fromkeys((reference.folder, *reference.node_folders))
        files: list[Module | BrokenModule] = [*source.own_modules, *source.broken]
        for file in files:
            checked = CheckedFile(file, node, source)
            self.files.setdefault(f"{_FILES}{file.path.as_posix()}", checked)
        for module in source.own_modules:
            name, folder = _import_root(module)
            self.folders[name] = folder
            self.search[folder] = None
        base = ""
        if node.behavior is not None:
            base = _unused_name(node, self.behaviors)
            self.behaviors[base] = node
        for module, class_ in source.own_classes:
            is_start = class_.name == reference.class_name and module.path == source.path
            self.nodes[module.path, class_.name] = node, base if is_start else ""

    @property
    def modules(self) -> Iterator[Module]:
        """The files that this Python can parse."""
        contents = (file.content for file in self.files.values())
        yield from (item for item in contents if isinstance(item, Module))

    def stubs(self, interfaces: Interfaces) -> dict[str, str]:
        """Return the stubs that the files need, by their names below the folder of the check."""
        texts = [module.source.text for module in self.modules]
        words = {word for text in texts for word in re.findall(r"[^\W_]\w*", text)}
        words |= {word.partition("_")[0] for word in words}  # of Trigger_Request
        uses_rclpy = "rclpy" in words or any("self.node" in text for text in texts)
        names = {port.interface.value for node in self.behaviors.values() for port in node.ports}
        names.update(_API_MESSAGES)
        for name in interfaces.names():
            package, _, short = name.split("/")
            if {package, short} <= words or (uses_rclpy and package in _RCLPY_PACKAGES):
                names.add(name)
        # A class may also be derived from the base of a node type that another one extends.
        typed = {word for word in words if word.endswith(SUFFIX)} - {SUFFIX}
        files = message_stubs(interfaces, sorted(names))
        files["composer/__init__.pyi"] = ""
        files["composer/behavior.pyi"] = api_stub()
        files["composer/typed.pyi"] = behavior_module(
            self.behaviors, interfaces, sorted(typed - self.behaviors.keys())
        )
        return {f"{_STUBS}/{name}": text for name, text in files.items()}

    def search_paths(self) -> list[str]:
        """Return the folders from which the files import, stubs first."""
        parents = {parent for module in self.modules for parent in module.path.parents}
        used = (path for path in self.search if path in parents)  # others are not in the copy
        return [_STUBS, str(LIBRARIES), *(f"{_FILES}{path.as_posix()}" for path in used)]


def file_sets(classes: Sequence[tuple[Node, BehaviorSource]]) -> list[FileSet]:
    """Return the sets of files in which all classes are checked."""
    sets: list[FileSet] = []
    for node, source in classes:
        if not (source.own_modules or source.broken):
            continue  # installed packages are not checked
        fitting = next((item for item in sets if item.accepts(source)), None)
        if fitting is None:
            fitting = FileSet()
            sets.append(fitting)
        fitting.add(node, source)
    return sets


def _unused_name(node: Node, taken: Mapping[str, Node]) -> str:
    """Return the name of the base class for the behavior of a node, not used by another one."""
    type_name = node.own_type_name or node.type_name or node.name
    name = behavior_class_name(type_name.value)
    numbered = (f"{name}{number}" for number in itertools.count(2))
    return next(each for each in itertools.chain([name], numbered) if each not in taken)


def _import_root(module: Module) -> tuple[str, Path]:
    """Return the top-level name of a module, and the folder from which it is imported."""
    path = module.path
    folder, name = path.parent, path.stem
    while (folder / "__init__.py").is_file() and folder != folder.parent:
        folder, name = folder.parent, folder.name
    return name, folder
