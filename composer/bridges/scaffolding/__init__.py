"""New files from templates: projects, systems, node types, interface packages."""

from __future__ import annotations

from typing import TypeAlias

from composer.base.resources import schemas_folder
from composer.bridges.templates import filled

#: For editors; compose has its own.
_SCHEMAS = tuple(f"{kind}.schema.json" for kind in ("system", "node", "project", "scenario"))

#: The contents of files, by their paths in the project.
NewFiles: TypeAlias = dict[str, str]


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
