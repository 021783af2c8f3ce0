"""Which files a check reads: the copies of a project's modules, and the stubs that they need.

Modules of one name in different folders, and a class that two node types use, cannot be in one
check: each gets a check of its own.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import field
from pathlib import Path

from composer import behavior
from composer.fast_dataclass import dataclass
from composer.interfaces import Interfaces
from composer.model import Node
from composer.python_code.checker.copies import ClassEdit, Copy, edited_copy, modules_named
from composer.python_code.source import BehaviorSource, Module
from composer.python_code.stubs.behaviors import (
    behavior_class_name,
    behavior_module,
    signatures,
)
from composer.python_code.stubs.messages import message_stubs

_FILES = "files"
_STUBS = "stubs"
#: The stubs of libraries that come with the composer.
LIBRARIES = Path(__file__).parent.parent / "stubs" / "libraries"
#: What the stubs of rclpy and of the API of behaviors use.
_ALWAYS_NEEDED = (
    "action_msgs",
    "builtin_interfaces",
    "geometry_msgs",
    "lifecycle_msgs",
    "rcl_interfaces",
    "type_description_interfaces",
    "unique_identifier_msgs",
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
    folders from which modules are imported, by their top-level names.
    """

    behaviors: dict[str, Node] = field(default_factory=dict)
    edits: dict[Path, dict[str, ClassEdit]] = field(default_factory=dict)
    modules: dict[Path, tuple[Module, Node, BehaviorSource]] = field(default_factory=dict)
    folders: dict[str, Path] = field(default_factory=dict)
    search: dict[Path, None] = field(default_factory=dict)

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
        for module in source.own_modules:
            self.modules.setdefault(module.path, (module, node, source))
            name, folder = _import_root(module)
            self.folders[name] = folder
            self.search[folder] = None
        base = ""
        handlers = {}
        if node.behavior is not None:
            base = _unused_name(node, self.behaviors)
            self.behaviors[base] = node
            handlers = signatures(node, interfaces)
        for module, class_ in source.own_classes:
            is_start = class_.name == reference.class_name and module.path == source.path
            edit = ClassEdit(f"composer.typed.{base}" if base and is_start else "", handlers)
            self.edits.setdefault(module.path, {})[class_.name] = edit

    def copies(self) -> dict[str, CheckedFile]:
        """Return the copies, by their names below the folder of the check."""
        found = {}
        for path, (module, node, source) in self.modules.items():
            is_behavior = node.behavior is not None
            copy = edited_copy(module, self.edits.get(path, {}), is_behavior=is_behavior)
            found[f"{_FILES}{path.as_posix()}"] = CheckedFile(copy, node, source)
        return found

    def stubs(self, copies: Iterable[Copy], interfaces: Interfaces) -> dict[str, str]:
        """Return the stubs that the files need, by their names below the folder of the check."""
        ports = (port for node in self.behaviors.values() for port in node.ports)
        packages = {port.interface.value.partition("/")[0] for port in ports}
        packages |= modules_named(copies) & interfaces.packages()
        files = message_stubs(interfaces, (*sorted(packages), *_ALWAYS_NEEDED))
        files["composer/__init__.pyi"] = ""
        files["composer/behavior.pyi"] = Path(behavior.__file__).read_text(encoding="utf-8")
        files["composer/typed.pyi"] = behavior_module(self.behaviors, interfaces)
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
        if not source.own_modules:
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


def _import_root(module: Module) -> tuple[str, Path]:
    """Return the top-level name of a module, and the folder from which it is imported."""
    path = module.path
    folder, name = path.parent, path.stem
    while (folder / "__init__.py").is_file() and folder != folder.parent:
        folder, name = folder.parent, folder.name
    return name, folder
