"""A namespace with too many levels."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context, is_unresolved
from composer.diagnostics import Diagnostic, warning
from composer.names import namespace_problem

RULE = warning(
    code="RC231",
    name="deep-namespace",
    summary="A namespace has more than three levels.",
    why=(
        "Two or three levels (robot, subsystem, device) are enough to locate a node. Deeper "
        "names are easily mistyped or remapped wrongly, and tools truncate them."
    ),
    bad="""\
system: deep
nodes:
  driver: {namespace: /robot/front/left/camera, on_activate: {log: started}}
""",
    good="""\
system: deep
nodes:
  driver: {namespace: /robot/camera_front_left, on_activate: {log: started}}
""",
)

DEEPEST = 3


def check(context: Context) -> Iterator[Diagnostic]:
    """Count the levels of every node's namespace."""
    for node in context.system.nodes:
        namespace = node.namespace
        levels = namespace.value.strip("/").count("/") + 1
        if (
            levels <= DEEPEST
            or is_unresolved(namespace.value)
            or namespace_problem(namespace.value)
        ):
            continue
        yield Diagnostic(
            RULE,
            f"namespace '{namespace}' has {levels} levels, more than {DEEPEST}",
            namespace.span,
            hint="merge or drop levels that do not distinguish nodes",
        )
