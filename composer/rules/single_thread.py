"""A multi_threaded executor with one thread."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.diagnostics import Diagnostic, Rule, Severity, register
from composer.model import ExecutorKind

RULE = register(
    Rule(
        code="RC417",
        name="single-thread",
        severity=Severity.WARNING,
        summary="A multi_threaded executor has one thread.",
        why=(
            "With one thread, callbacks never run at the same time, but each of them costs the "
            "locking of an executor with several threads."
        ),
        bad="""\
system: threads
executors: {perception: {kind: multi_threaded, threads: 1}}
nodes:
  camera: {executor: perception, on_activate: {log: started}}
""",
        good="""\
system: threads
executors: {perception: {kind: multi_threaded, threads: 2}}
nodes:
  camera: {executor: perception, on_activate: {log: started}}
""",
    )
)


def check(context: Context) -> Iterator[Diagnostic]:
    """Check the numbers of threads."""
    for executor in context.system.executors:
        if executor.kind is ExecutorKind.MULTI_THREADED and executor.threads == 1:
            yield Diagnostic(
                RULE,
                f"executor '{executor.name}' is multi_threaded, but has one thread",
                executor.threads_span or executor.name.span,
                hint="use two or more threads, or 'kind: events'",
            )
