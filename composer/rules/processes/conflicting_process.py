"""A node in two processes, and a process without nodes."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.analysis.earlier_errors import earlier_errors
from composer.diagnostics import Diagnostic, Label, error
from composer.names import topic_name_problem
from composer.source import Located

RULE = error(
    code="RC479",
    name="conflicting-process",
    summary="A node is in two processes, or a process has no node or no valid name.",
    why=(
        "Two processes with the same node would publish everything twice. A process is part of "
        "names in ROS, and one without nodes does nothing."
    ),
    bad="""\
system: robot
processes: {vision: {nodes: [camera]}, control: {nodes: ["*"]}}
nodes:
  camera: {on_activate: {log: started}}
  arm: {on_activate: {log: started}}
""",
    good="""\
system: robot
processes: {vision: {nodes: [camera]}, control: {nodes: [arm]}}
nodes:
  camera: {on_activate: {log: started}}
  arm: {on_activate: {log: started}}
""",
)


def check(context: Context) -> Iterator[Diagnostic]:
    """Check that the processes share no node, and that each has one."""
    system = context.system
    named: dict[str, Located[str]] = {}
    first: dict[str, tuple[str, Located[str]]] = {}
    for node in system.nodes:
        if node.process is not None:
            named[node.name.value] = node.process
    for process in system.processes:
        for node_name in process.nodes:
            known = first.setdefault(node_name.value, (process.name.value, node_name))
            other = named.get(node_name.value)
            if known[0] != process.name.value:
                where = known[1].span
                text = known[0]
            elif other is not None and other.value != process.name.value:
                where, text = other.span, other.value
            else:
                continue
            yield Diagnostic(
                RULE,
                f"node '{node_name}' is in the processes '{text}' and '{process.name}'",
                node_name.span,
                related=(Label(where, f"in '{text}'"),),
                hint="name it in one of them",
            )
    used = {process.value for process in named.values()}
    known_names = {process.name.value for process in system.processes}
    has_others = not used <= known_names  # unknown-process reports them
    for process in system.processes:
        problem = topic_name_problem(process.name.value)
        if problem is not None or "/" in process.name.value:
            what = problem or "contains '/'"
            yield Diagnostic(RULE, f"process '{process.name}' {what}", process.name.span)
        elif (
            not (process.nodes or process.name.value in used or has_others)
            and not context.once(earlier_errors).any
        ):
            yield Diagnostic(RULE, f"process '{process.name}' has no nodes", process.name.span)
