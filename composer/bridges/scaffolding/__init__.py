"""New files from templates: projects, systems, node types, interface packages."""

from composer.bridges.scaffolding.files import (
    NewFiles,
    new_interfaces,
    new_node,
    new_project,
    new_system,
)

__all__ = ["NewFiles", "new_interfaces", "new_node", "new_project", "new_system"]
