"""A first delay of restarts that is longer than the longest."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.analysis.formatting import number
from composer.diagnostics import Diagnostic, warning
from composer.source import Span

RULE = warning(
    code="RC530",
    name="restart-delay",
    summary="The first delay of restarts, 'backoff_ms', is longer than 'backoff_max_ms'.",
    why=(
        "The delay starts at 'backoff_ms' and doubles up to 'backoff_max_ms'. If that is "
        "shorter, every restart waits for it, and 'backoff_ms' has no effect."
    ),
    bad="""\
system: restarting
nodes:
  lidar:
    on_activate: {log: started}
    lifecycle: {on_failure: restart, restart: {backoff_ms: 5000, backoff_max_ms: 1000}}
""",
    good="""\
system: restarting
nodes:
  lidar:
    on_activate: {log: started}
    lifecycle: {on_failure: restart, restart: {backoff_ms: 1000, backoff_max_ms: 5000}}
""",
)


def check(context: Context) -> Iterator[Diagnostic]:
    """Compare the delays of the system and of every node; shared settings are reported once."""
    system = context.system
    seen: set[Span] = set()
    for supervision in (system.supervision, *(node.supervision for node in system.nodes)):
        restart = supervision.restart
        span = restart.backoff_span
        if span is None or span in seen or restart.backoff_ms <= restart.backoff_max_ms:
            continue
        seen.add(span)
        yield Diagnostic(
            RULE,
            f"restarts start with a delay of {number(restart.backoff_ms)} ms, longer than the "
            f"maximum of {number(restart.backoff_max_ms)} ms",
            span,
            hint="make 'backoff_max_ms' at least as long as 'backoff_ms'",
        )
