"""An executor without nodes."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.analysis.earlier_errors import earlier_errors
from composer.diagnostics import Diagnostic, info
from composer.model import DEFAULT_EXECUTOR

RULE = info(
    code="RC245",
    name="unused-executor",
    summary="No node runs on a declared executor.",
    why="The executor is left over, or a node that was meant for it runs on another one.",
    bad="""\
system: threads
executors:
  perception: {kind: multi_threaded, threads: 4}
nodes:
  camera: {on_activate: {log: started}}
""",
    good="""\
system: threads
executors:
  perception: {kind: multi_threaded, threads: 4}
nodes:
  camera: {executor: perception, on_activate: {log: started}}
""",
)


def check(context: Context) -> Iterator[Diagnostic]:
    """Compare the executors with the nodes. An executor named ``default`` runs all other nodes."""
    used = {
        node.executor.value if node.executor else DEFAULT_EXECUTOR for node in context.system.nodes
    }
    known = {executor.name.value for executor in context.system.executors} | {DEFAULT_EXECUTOR}
    if not used <= known or context.once(earlier_errors).any:
        return  # an unknown name may be a misspelling of the unused one
    for executor in context.system.executors:
        if executor.name.value not in used:
            yield Diagnostic(RULE, f"no node runs on '{executor.name}'", executor.name.span)
