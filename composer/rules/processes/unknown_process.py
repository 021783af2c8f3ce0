"""A process that does not exist, or that names a node that does not."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context, is_unresolved
from composer.diagnostics import Diagnostic, error, suggestion

RULE = error(
    code="RC478",
    name="unknown-process",
    summary="A node names an unknown process, or a process an unknown node.",
    why="No process would run the node.",
    bad="""\
system: robot
processes: {vision: {nodes: [camra]}}
nodes:
  camera: {on_activate: {log: started}}
  detector: {process: vison, on_activate: {log: started}}
""",
    good="""\
system: robot
processes: {vision: {nodes: [camera]}}
nodes:
  camera: {on_activate: {log: started}}
  detector: {process: vision, on_activate: {log: started}}
""",
)


def check(context: Context) -> Iterator[Diagnostic]:
    """Check the processes of nodes, and the nodes of processes."""
    system = context.system
    if context.is_partial:
        return
    processes = [process.name.value for process in system.processes]
    for node in system.nodes:
        name = node.process
        if name is None or name.value in processes or is_unresolved(name.value):
            continue
        yield Diagnostic(
            RULE,
            f"node '{node.name}' runs in '{name}', which is not a process of this system",
            name.span,
            hint=suggestion(name.value, processes),
        )
    nodes = [node.name.value for node in system.nodes]
    known = frozenset(nodes)
    for process in system.processes:
        for node_name in process.nodes:
            if node_name.value in known or is_unresolved(node_name.value):
                continue
            yield Diagnostic(
                RULE,
                f"process '{process.name}' names '{node_name}', which is not a node of this system",
                node_name.span,
                hint=suggestion(node_name.value, nodes),
            )
