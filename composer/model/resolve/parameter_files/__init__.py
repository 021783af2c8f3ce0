"""ROS parameter files: parameter values by the full names of nodes.

The format is that of ``rcl_yaml_param_parser``: a map of node names, each with ``ros__parameters``.
``*`` is one part of a name, ``**`` any number of parts. Namespaces and parameters with dots in
their names may be nested maps.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from composer.base.diagnostics import Diagnostic, Severity, Subject, shown
from composer.language.tree import Tree
from composer.model.resolve.parameter_files.reader import PARAMETER_FILE, read_parameter_file
from composer.model.resolve.parameter_files.sections import ParameterFiles
from composer.model.resolve.tree_values import is_opaque, texts
from composer.project import OUTSIDE_HINT, Project

__all__ = ["PARAMETER_FILES", "ParameterFiles", "read_parameter_file", "read_parameter_files"]

#: The values of all parameter files, of which some may be missing.
PARAMETER_FILES: Subject = ("parameter files", "")


def read_parameter_files(
    tree: Tree | None, folder: Path, project: Project, diagnostics: list[Diagnostic]
) -> ParameterFiles:
    """Read the files that ``parameter_files`` names, relative to the system's folder."""
    files = ParameterFiles()
    for name in texts(tree):
        if is_opaque(name.value):
            continue
        path = folder / name.value
        if not project.holds(path):
            message = f"parameter file '{shown(name.value)}' is outside the project"
            found = [Diagnostic(PARAMETER_FILE, message, name.span, hint=OUTSIDE_HINT)]
        elif not path.exists():
            message = f"there is no parameter file '{shown(name.value)}'"
            found = [Diagnostic(PARAMETER_FILE, message, name.span)]
        else:
            found = read_parameter_file(path, files, name.span.file)
        # What is not read may be what a node needs.
        diagnostics += (
            replace(item, subjects=(PARAMETER_FILES,)) if item.severity is Severity.ERROR else item
            for item in found
        )
    return files
