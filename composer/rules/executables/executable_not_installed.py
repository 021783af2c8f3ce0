"""An executable whose package or program is not installed."""

from __future__ import annotations

import os
from collections.abc import Iterator

from composer.analysis.context import Context, is_unresolved
from composer.diagnostics import Diagnostic, info
from composer.executables import find_program, has_package

RULE = info(
    code="RC472",
    name="executable-not-installed",
    summary="The package or the program of an executable is not installed on this computer.",
    why=(
        "The node cannot be started on a computer without it. If it is installed where the "
        "system runs, ignore this."
    ),
    bad="""\
system: lights
nodes:
  lamp:
    executable: {package: lamp_driver_for_mars, name: driver}
""",
    good="""\
system: lights
nodes:
  lamp:
    executable: {command: [sh, -c, "sleep 1"], kind: task}
""",
)


def check(context: Context) -> Iterator[Diagnostic]:
    """Look for the packages, and for programs in PATH."""
    for node in context.system.nodes:
        executable = node.executable
        if executable is None or node.external is not None:
            continue
        package = executable.package
        if executable.command:
            program = executable.command[0]
            is_path = "/" in program.value or is_unresolved(program.value)
            if not is_path and find_program(program.value, executable.folder, os.environ) is None:
                yield Diagnostic(RULE, f"program '{program}' is not in PATH", program.span)
        elif package is not None and not (
            is_unresolved(package.value) or has_package(package.value, os.environ)
        ):
            yield Diagnostic(RULE, f"package '{package}' is not installed", package.span)
