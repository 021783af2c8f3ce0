"""A task with lifecycle services."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.diagnostics import Diagnostic, error
from composer.model import ExecutableKind, LifecycleKind

RULE = error(
    code="RC475",
    name="managed-task",
    summary="A task is managed by lifecycle services.",
    why=(
        "A task is done once its process has exited; a managed node runs until it is shut "
        "down, and is driven by the services that it has while it runs."
    ),
    bad="""\
# file: system.yaml
system: calibration
nodes:
  calibrate:
    executable: {command: [sh, driver.sh], kind: task, lifecycle: managed}
# file: driver.sh
exec driver
""",
    good="""\
# file: system.yaml
system: calibration
nodes:
  calibrate:
    executable: {command: [sh, driver.sh], kind: task}
# file: driver.sh
exec driver
""",
)


def check(context: Context) -> Iterator[Diagnostic]:
    """Check the tasks."""
    for node in context.system.nodes:
        executable = node.executable
        if executable is None or executable.kind is not ExecutableKind.TASK:
            continue
        if executable.lifecycle is LifecycleKind.MANAGED:
            spans = {key.value: key.span for key in executable.given}
            yield Diagnostic(
                RULE,
                f"task '{node.name}' cannot be managed: it exits when it is done",
                spans.get("lifecycle", executable.span),
                hint="remove 'lifecycle: managed', or 'kind: task'",
            )
