"""A node on an executor that is not declared."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context, is_unresolved
from composer.diagnostics import Diagnostic, error, suggestion
from composer.model import DEFAULT_EXECUTOR

RULE = error(
    code="RC207",
    name="unknown-executor",
    summary="A node runs on an executor that is not declared under executors.",
    why="The callbacks of the node would never run.",
    bad="""\
system: threads
executors:
  perception: {kind: multi_threaded, threads: 4}
nodes:
  camera: {executor: percepton, on_activate: {log: started}}
  detector: {executor: perception, on_activate: {log: started}}
""",
    good="""\
system: threads
executors:
  perception: {kind: multi_threaded, threads: 4}
nodes:
  camera: {executor: perception, on_activate: {log: started}}
  detector: {executor: perception, on_activate: {log: started}}
""",
)


def check(context: Context) -> Iterator[Diagnostic]:
    """Check the executor of every node that names one."""
    known = {executor.name.value for executor in context.system.executors} | {DEFAULT_EXECUTOR}
    for node in context.system.nodes if not context.is_partial else ():
        name = node.executor
        if name is None or name.value in known or is_unresolved(name.value):
            continue
        yield Diagnostic(
            RULE,
            f"node '{node.name}' runs on '{name}', which is not an executor of this system",
            name.span,
            hint=suggestion(name.value, known),
        )
