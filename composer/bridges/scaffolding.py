"""New files from templates: projects, systems, node types, interface packages.

An interface package is completed so that pip and colcon can build it. Its source has the
definitions and a ``package.xml`` with at least a name. Dependencies come from the types of the
fields.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TypeAlias

from composer.base.fast_dataclass import dataclass
from composer.base.folders import interfaces_folder, schemas_folder
from composer.bridges.templates import filled
from composer.interfaces import DefinitionError, Message, parse_definition
from composer.interfaces.definitions import parts
from composer.interfaces.sources import FOLDERS, Bundle

#: For editors; compose has its own.
_SCHEMAS = tuple(f"{kind}.schema.json" for kind in ("system", "node", "project", "scenario"))

#: The contents of files, by their paths in the project.
NewFiles: TypeAlias = dict[str, str]
#: What the generated code of each kind of interface uses, in addition to the types of its fields.
_IMPLIED: Mapping[str, tuple[str, ...]] = {
    "msg": (),
    "srv": ("service_msgs",),
    "action": ("action_msgs", "service_msgs"),
}
_CMAKE_MODULE = "cmake/ros_wheels.cmake"
#: What only the interfaces of the composer need.
_OWN_TYPES = ("ros-geometry-msgs", "ros-nav-msgs")
#: In a source, a type is named without its folder: geometry_msgs/Pose.
_FULL_TYPE = re.compile(r"(?m)^([a-z]\w*)/msg/")
_WHEEL = re.compile(r"ros-([a-z0-9-]+)==")


def new_project(name: str) -> NewFiles:
    """Return the files of a project with a system of two nodes, a scenario and tests."""
    return {
        "README.md": _text("project/README.md", name),
        "composer.yaml": _text("project/composer.yaml", name),
        ".gitignore": _text("project/gitignore", name),
        "package.xml": _text("project/package.xml", name),
        "setup.py": _text("project/setup.py", name),
        # Markers of the ament index; colcon does not accept one file for both.
        f"resource/{name}": "",
        f"resource/ros2_composer/{name}": "",
        f"systems/{name}.yaml": _text("project/system.yaml", name),
        f"scenarios/{name}.yaml": _text("project/scenario.yaml", name),
        f"tests/test_{name}.py": _text("project/test_project.py", name),
        "interfaces/.gitkeep": "",
        **new_node("counter"),
        **{f"schemas/{file}": (schemas_folder() / file).read_text("utf-8") for file in _SCHEMAS},
    }


def new_system(name: str) -> NewFiles:
    """Return a system of two nodes, its scenario and its test."""
    return {
        f"systems/{name}.yaml": _text("system/system.yaml", name),
        f"scenarios/{name}.yaml": _text("system/scenario.yaml", name),
        f"tests/test_{name}.py": _text("system/test_system.py", name),
    }


def new_node(name: str) -> NewFiles:
    """Return a node type with a behavior and its test."""
    return {
        f"nodes/{name}.yaml": _text("node/node.yaml", name),
        f"nodes/{name}.py": _text("node/behavior.py", name),
        f"tests/test_{name}_node.py": _text("node/test_node.py", name),
    }


def new_interfaces(name: str) -> NewFiles:
    """Return an interface package with one message."""
    return {
        f"interfaces/{name}/package.xml": _text("interfaces/package.xml", name),
        f"interfaces/{name}/msg/Status.msg": _text("interfaces/Status.msg", name),
    }


def _text(template: str, name: str) -> str:
    class_name = "".join(part.capitalize() for part in name.split("_"))
    return filled(template, **{"name": name, "class": class_name})


class InvalidPackage(Exception):
    """The package cannot be completed; the text says why."""


class NotForPip(InvalidPackage):
    """Pip cannot build the package, but colcon can."""


@dataclass(frozen=True, slots=True)
class InterfacePackage:
    """An interface package: its name, and the definitions by their relative paths."""

    name: str
    definitions: Mapping[str, str]
    dependencies: tuple[str, ...]

    def files(self, versions: Mapping[str, str] | None) -> dict[str, str]:
        """Return all files of the package. Raises NotForPip.

        ``versions`` are those of the ROS wheels that pip builds against, by ROS package; None is
        for colcon alone.
        """
        template = interfaces_folder()
        wheels = (template / _CMAKE_MODULE).read_text(encoding="utf-8")
        files = {
            **self.definitions,
            "CMakeLists.txt": self._cmake(),
            "package.xml": self._manifest(),
            _CMAKE_MODULE: wheels,
        }
        if versions is not None:
            files["pyproject.toml"] = self._pyproject(versions)
        return files

    def _cmake(self) -> str:
        found = "".join(f"find_package({name} REQUIRED)\n" for name in self.dependencies)
        listed = "".join(f'  "{path}"\n' for path in self.definitions)
        depends = f"  DEPENDENCIES {' '.join(self.dependencies)}\n" if self.dependencies else ""
        return filled(
            "interfaces/CMakeLists.txt",
            name=self.name,
            wheels=_CMAKE_MODULE,
            packages=found,
            files=listed,
            depends=depends,
        )

    def _manifest(self) -> str:
        depends = "".join(f"  <depend>{name}</depend>\n" for name in self.dependencies)
        return filled("interfaces/generated_package.xml", name=self.name, depends=depends)

    def _pyproject(self, versions: Mapping[str, str]) -> str:
        requires = "".join(f'  "{item}",\n' for item in self._build_requirements(versions))
        return filled(
            "interfaces/pyproject.toml",
            name=self.name,
            project=self.name.replace("_", "-"),
            requires=requires,
        )

    def _build_requirements(self, versions: Mapping[str, str]) -> list[str]:
        """Return what the composer's own interfaces need, with the packages of our types."""
        text = (interfaces_folder() / "pyproject.toml").read_text(encoding="utf-8")
        own: list[str] = tomllib.loads(text)["build-system"]["requires"]
        tools = [item for item in own if not item.startswith(_OWN_TYPES)]
        known = {match[1].replace("-", "_") for item in tools if (match := _WHEEL.match(item))}
        for name in self.dependencies:
            if name in known:
                continue
            if name not in versions:
                raise NotForPip(
                    f"'{self.name}' uses types of '{name}', which pip has not installed"
                )
            tools.append(f"ros-{name.replace('_', '-')}=={versions[name]}")
        return tools


def read_package(name: str, folder: Path) -> InterfacePackage:
    """Read the definitions of a package. Raises InvalidPackage, OSError."""
    definitions = {
        f"{kind}/{path.name}": path.read_text(encoding="utf-8")
        for kind in FOLDERS
        for path in sorted((folder / kind).glob(f"*.{kind}"))
    }
    if not definitions:
        raise InvalidPackage(f"'{name}' has no .msg, .srv or .action file in {folder}")
    return _package(name, definitions, folder)


def bundled_package(name: str) -> InterfacePackage:
    """Return a package of ROS from the definitions that come with the composer."""
    bundle = Bundle()
    definitions = {
        f"{kind}/{full_name.rpartition('/')[2]}.{kind}": _source_text(found.text)
        for kind in FOLDERS
        for full_name in bundle.names(kind)
        if full_name.startswith(f"{name}/") and (found := bundle.read(full_name)) is not None
    }
    return _package(name, definitions, Path(name))


def _source_text(bundled: str) -> str:
    """Return a definition as sources write it."""
    return _FULL_TYPE.sub(r"\1/", bundled).rstrip("\n") + "\n"


def _package(name: str, definitions: Mapping[str, str], folder: Path) -> InterfacePackage:
    used: dict[str, None] = {}
    for path, text in definitions.items():
        kind, _, file = path.partition("/")
        try:
            interface = parse_definition(f"{name}/{kind}/{Path(file).stem}", text)
        except DefinitionError as error:
            raise InvalidPackage(f"{folder / path}:{error.line}: {error}") from error
        used |= dict.fromkeys(_IMPLIED[kind])
        for part in parts(interface).values():
            used |= dict.fromkeys(_packages_of(part))
    return InterfacePackage(name, definitions, tuple(sorted(item for item in used if item != name)))


def _packages_of(message: Message) -> Iterable[str]:
    for field in message.fields:
        if not field.type.is_primitive:
            yield field.type.name.partition("/")[0]
