"""An executor with one thread that is declared as if it had several."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.diagnostics import Diagnostic, warning
from composer.model import Executor, ExecutorKind

RULE = warning(
    code="RC417",
    name="single-thread",
    summary="An executor has one thread, but is declared as if it had several.",
    why=(
        "With one thread, callbacks never run at the same time. A multi_threaded executor with "
        "one thread still costs the locking of several; the other kinds ignore 'threads'."
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
        elif executor.kind is not ExecutorKind.MULTI_THREADED and _several(executor):
            yield Diagnostic(
                RULE,
                f"executor '{executor.name}' has one thread, as its kind is {executor.kind}",
                executor.threads_span or executor.name.span,
                hint="add 'kind: multi_threaded', or remove 'threads'",
            )


def _several(executor: Executor) -> bool:
    """Return whether several threads are written; the default does not count."""
    return executor.threads_span is not None and executor.threads > 1
