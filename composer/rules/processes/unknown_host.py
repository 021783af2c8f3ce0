"""A process on a host that does not exist."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context, is_unresolved
from composer.diagnostics import Diagnostic, error, suggestion

RULE = error(
    code="RC490",
    name="unknown-host",
    summary="A process names an unknown host.",
    why="Nothing would start the process, and the system would wait for it.",
    bad="""\
system: robot
hosts: {jetson: {address: 192.168.1.20, workspace: ~/robot}}
processes: {vision: {host: jetsom}}
nodes:
  camera: {process: vision, on_activate: {log: started}}
""",
    good="""\
system: robot
hosts: {jetson: {address: 192.168.1.20, workspace: ~/robot}}
processes: {vision: {host: jetson}}
nodes:
  camera: {process: vision, on_activate: {log: started}}
""",
)


def check(context: Context) -> Iterator[Diagnostic]:
    """Check the hosts of processes."""
    system = context.system
    if context.is_partial:
        return
    hosts = [host.name.value for host in system.hosts]
    for process in system.processes:
        name = process.host
        if name is None or name.value in hosts or is_unresolved(name.value):
            continue
        yield Diagnostic(
            RULE,
            f"process '{process.name}' runs on '{name}', which is not a host of this system",
            name.span,
            hint=suggestion(name.value, hosts) or "declare it under 'hosts:'",
        )
