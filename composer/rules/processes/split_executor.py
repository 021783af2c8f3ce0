"""An executor with nodes of several processes."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.diagnostics import Diagnostic, Label, info
from composer.model import DEFAULT_EXECUTOR, Node

RULE = info(
    code="RC480",
    name="split-executor",
    summary="Nodes of several processes run on the same executor.",
    why=(
        "Each process has an executor of its own with these settings. The nodes of different "
        "processes do not share its threads, and their callbacks may run at the same time."
    ),
    bad="""\
system: robot
processes: {control: {nodes: [arm]}}
executors: {motion: {kind: events, priority: 50}}
nodes:
  arm: {executor: motion, on_activate: {log: started}}
  base: {executor: motion, on_activate: {log: started}}
""",
    good="""\
system: robot
processes: {control: {nodes: [arm, base]}}
executors: {motion: {kind: events, priority: 50}}
nodes:
  arm: {executor: motion, on_activate: {log: started}}
  base: {executor: motion, on_activate: {log: started}}
""",
)


def check(context: Context) -> Iterator[Diagnostic]:
    """Compare the processes of the nodes on each executor, except for the default one."""
    first: dict[str, Node] = {}
    reported: set[str] = set()
    for node in context.system.nodes:
        if node.executor is None or node.executor.value == DEFAULT_EXECUTOR:
            continue
        name = node.executor.value
        other = first.setdefault(name, node)
        if other.process == node.process or name in reported:
            continue
        reported.add(name)
        at = node.executor.span if other.executor is None else other.executor.span
        yield Diagnostic(
            RULE,
            f"'{name}' is one executor in {_text(node)} and another one in {_text(other)}",
            node.executor.span,
            (Label(at, f"in {_text(other)}"),),
        )


def _text(node: Node) -> str:
    return "the process of the system" if node.process is None else f"process '{node.process}'"
