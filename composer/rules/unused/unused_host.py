"""A host without processes."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context, is_unresolved
from composer.diagnostics import Diagnostic, warning

RULE = warning(
    code="RC491",
    name="unused-host",
    summary="A host has no process.",
    why="Nothing of the system runs on it.",
    bad="""\
system: robot
hosts: {jetson: {address: 192.168.1.20, workspace: ~/robot}}
nodes:
  camera: {on_activate: {log: started}}
""",
    good="""\
system: robot
hosts: {jetson: {address: 192.168.1.20, workspace: ~/robot}}
processes: {vision: {nodes: [camera], host: jetson}}
nodes:
  camera: {on_activate: {log: started}}
""",
)


def check(context: Context) -> Iterator[Diagnostic]:
    """Check that each host has a process; a misspelled one is reported where it is named."""
    system = context.system
    named = [process.host for process in system.processes if process.host is not None]
    used = {name.value for name in named}
    known = {host.name.value for host in system.hosts}
    if context.is_partial or used - known or any(map(is_unresolved, used)):
        return
    for host in system.hosts:
        if host.name.value not in used:
            yield Diagnostic(
                RULE,
                f"host '{host.name}' has no process",
                host.name.span,
                hint=f"set 'host: {host.name}' of a process",
            )
