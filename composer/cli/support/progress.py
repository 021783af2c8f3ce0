"""What ``compose run`` shows of the host's events, in the manner of the nodes' log lines."""

from __future__ import annotations

from typing import TextIO

from composer.cli.support.background import tell_ready
from composer.cli.support.callback_table import callback_table
from composer.cli.support.terminal import columns, use_color
from composer.runtime.supervision.events import (
    BroughtUp,
    CallbackFailed,
    Event,
    Logged,
    NodeFailed,
    NodeSummary,
    NodeTransitionFailed,
    Outcome,
    Restarted,
    RolledBack,
    RollingBack,
    StateChanged,
    Stopping,
    Stuck,
)

_GREEN, _YELLOW, _RED, _DIM = "32", "33", "31", "2"
_CALLBACKS = 10  # of the busiest callbacks, in the summary


class Progress:
    """Prints one line an event. Exceptions of callbacks are in the nodes' logs already."""

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream
        self._color = use_color(stream)

    def show(self, event: Event) -> None:
        """Print the event."""
        if isinstance(event, CallbackFailed):
            return
        if isinstance(event, BroughtUp):
            tell_ready(str(event))
        line = f"[{event.elapsed_s:.3f}] [{_severity(event)}] [compose] {event}"
        if isinstance(event, Logged):
            line = str(event)
        code = _code(event)
        if self._color and code:
            line = f"\x1b[{code}m{line}\x1b[0m"
        print(line, file=self._stream, flush=True)


def _severity(event: Event) -> str:
    match event:
        case NodeTransitionFailed() | RollingBack() | Stuck() | NodeFailed():
            return "ERROR"
        case _:
            return "INFO"


def _code(event: Event) -> str:
    match event:
        case NodeTransitionFailed() | RollingBack() | Stuck() | NodeFailed():
            return _RED
        case BroughtUp() | Restarted():
            return _GREEN
        case Stopping() | RolledBack():
            return _YELLOW
        case StateChanged():
            return _DIM
        case _:
            return ""


def summary(outcome: Outcome) -> str:
    """Return what ends a run: a table of what each node did, and one of what its callbacks took."""
    head = ("node", "state", "received", "sent", "calls", "dropped", "errors")
    rows = [head, *map(_row, outcome.nodes)]
    parts = [
        f"ran for {outcome.elapsed_s:.1f} s: {outcome.reason}\n{columns(rows, numbers_from=2)}"
    ]
    called = [callback for callback in outcome.callbacks if callback.count or callback.dropped]
    if called:
        parts.append(callback_table(called, _CALLBACKS))
    parts += [f"chain {chain.chain}: {chain.text}" for chain in outcome.chains]
    return "\n".join(parts)


def _row(node: NodeSummary) -> tuple[str, ...]:
    counts = (node.received, node.sent, node.calls, node.dropped, node.errors)
    return (node.node, node.state, *map(str, counts))
