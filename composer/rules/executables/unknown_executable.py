"""An executable that does not exist."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

from composer.analysis.context import Context, is_unresolved
from composer.diagnostics import Diagnostic, error, suggestion
from composer.executables import executable_names, find_executable, find_program, has_package
from composer.model import Executable
from composer.source import Located

RULE = error(
    code="RC471",
    name="unknown-executable",
    summary="The executable of a node does not exist.",
    why="The node cannot be configured: there is no program to start.",
    bad="""\
# file: system.yaml
system: scripts
nodes:
  driver:
    executable: {command: [python3, scripts/drver.py]}
# file: scripts/driver.py
import rclpy
""",
    good="""\
# file: system.yaml
system: scripts
nodes:
  driver:
    executable: {command: [python3, scripts/driver.py]}
# file: scripts/driver.py
import rclpy
""",
)

#: Arguments with these suffixes are files, and are looked for.
_SCRIPTS = (".py", ".sh")


def check(context: Context) -> Iterator[Diagnostic]:
    """Check packages that are installed, and paths."""
    for node in context.system.nodes:
        executable = node.executable
        if executable is None or node.external is not None:
            continue
        if executable.command:
            yield from _command(executable)
        elif executable.package is not None and executable.name is not None:
            yield from _of_package(executable.package, executable.name)
        folder = _folder(executable)
        if folder is not None and not folder.is_dir() and executable.working_directory:
            written = executable.working_directory
            yield Diagnostic(RULE, f"folder '{written}' does not exist", written.span)


def _command(executable: Executable) -> Iterator[Diagnostic]:
    program, *arguments = executable.command
    folder = _folder(executable)
    if is_unresolved(program.value) or folder is None:
        return
    if "/" in program.value and find_program(program.value, executable.folder, os.environ) is None:
        exists = (executable.folder / program.value).is_file()
        what = "is not executable" if exists else "does not exist"
        hint = f"run 'chmod +x {program}', or name its interpreter first" if exists else None
        yield Diagnostic(RULE, f"program '{program}' {what}", program.span, hint=hint)
    for script in arguments[:1]:
        path = folder / script.value
        if script.value.endswith(_SCRIPTS) and folder.is_dir() and not path.is_file():
            hint = suggestion(path.name, _names(path.parent))
            yield Diagnostic(RULE, f"file '{script}' does not exist", script.span, hint=hint)


def _of_package(package: Located[str], name: Located[str]) -> Iterator[Diagnostic]:
    if is_unresolved(package.value) or is_unresolved(name.value):
        return
    if not has_package(package.value, os.environ):
        return  # see executable_not_installed.py
    if find_executable(package.value, name.value, os.environ) is None:
        yield Diagnostic(
            RULE,
            f"package '{package}' has no executable '{name}'",
            name.span,
            hint=suggestion(name.value, executable_names(package.value, os.environ)),
        )


def _folder(executable: Executable) -> Path | None:
    """Return the folder that a command runs in; None if it is not known."""
    written = executable.working_directory
    if written is None:
        return executable.folder
    return None if is_unresolved(written.value) else executable.folder / written.value


def _names(folder: Path) -> list[str]:
    return [path.name for path in folder.iterdir()] if folder.is_dir() else []
