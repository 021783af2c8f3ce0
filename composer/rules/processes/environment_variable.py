"""The name of an environment variable that not every shell and service manager accepts."""

from __future__ import annotations

import re
from collections.abc import Iterator

from composer.analysis.context import Context, is_unresolved
from composer.diagnostics import Diagnostic, error

RULE = error(
    code="RC494",
    name="environment-variable",
    summary="An environment variable has an invalid name.",
    why=(
        "Shells, systemd and Kubernetes accept names of letters, digits and underscores that "
        "do not begin with a digit. Programs cannot be started with other names, or their "
        "commands and exported files would mean something else."
    ),
    bad="""\
system: robot
processes: {vision: {nodes: [camera], environment: {OMP-NUM-THREADS: 1}}}
nodes:
  camera: {on_activate: {log: started}}
""",
    good="""\
system: robot
processes: {vision: {nodes: [camera], environment: {OMP_NUM_THREADS: 1}}}
nodes:
  camera: {on_activate: {log: started}}
""",
)
_HINT = "use letters, digits and '_', and no digit at the start"
_NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")


def check(context: Context) -> Iterator[Diagnostic]:
    """Check the environment variables of processes, hosts and executables."""
    system = context.system
    executables = [node.executable for node in system.nodes if node.executable is not None]
    environments = [
        *(process.environment for process in system.processes),
        *(host.environment for host in system.hosts),
        *(executable.environment for executable in executables),
    ]
    for environment in environments:
        for name, _ in environment:
            if not is_unresolved(name.value) and not _NAME.fullmatch(name.value):
                text = f"'{name}' is not a name of an environment variable"
                yield Diagnostic(RULE, text, name.span, hint=_HINT)
