"""What ``compose run`` prints: events in the format of log lines, and a summary at the end."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from typing import TextIO

from composer.base.characters import escape_lines
from composer.cli.support.callback_tables import summary_table
from composer.cli.support.line_format import Line, LineFormat
from composer.cli.support.process import report_ready, take_ready_descriptor
from composer.cli.support.terminal import columns, lines, use_color
from composer.model.names import PROGRAM_LOGGER
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
_MAX_CALLBACKS = 10
_INDENT = "  "
_MAX_NODES_WITH_ERRORS = 5


class Progress:
    """Print one line per event, except for faults, which the nodes have logged.

    By default, lines begin with the time since the start. ``address`` returns the address of the
    dashboard, for the command that started this process in the background; it may wait briefly.
    """

    def __init__(
        self,
        stream: TextIO,
        line_format: LineFormat | None = None,
        address: Callable[[], str | None] | None = None,
    ) -> None:
        self._stream = stream
        self._color = use_color(stream)
        self._format = line_format
        self._ready = take_ready_descriptor()
        self._address = address

    def show(self, event: Event) -> None:
        """Print the event."""
        if isinstance(event, CallbackFailed):
            return
        if isinstance(event, BroughtUp):
            address = None if self._address is None or self._ready is None else self._address()
            text = str(event) if address is None else f"{address}\n{event}"
            report_ready(self._ready, text, is_complete=event.is_complete)
            self._ready = None
        line = self._line(event)
        code = _code(event)
        if self._color and code:
            line = f"\x1b[{code}m{line}\x1b[0m"
        self._stream.write(f"{line}\n")

    def _line(self, event: Event) -> str:
        name, text = logger_and_text(event)
        text = continued(text)  # not the line: a format may have colors
        severity = severity_of(event)
        if self._format is None:
            return f"[{event.elapsed_s:.3f}] [{severity}] [{name}] {text}"
        return self._format.render(Line(severity, name, text, time.time_ns()))


def logger_and_text(event: Event) -> tuple[str, str]:
    """Return the name of the logger that an event is shown with, and its text."""
    if isinstance(event, Logged):
        return event.logger, event.message
    return PROGRAM_LOGGER, str(event)


def continued(text: str) -> str:
    """Return ``text`` with all lines but the first indented: a message must not look like two."""
    return escape_lines(text).replace("\n", f"\n{_INDENT}")


def severity_of(event: Event) -> str:
    """Return the severity of an event in upper case, as in the format of log lines."""
    match event:
        case Logged():
            return event.level.upper()
        case (
            NodeFailed(is_tolerated=True)
            | NodeFailed(is_finished=True)
            | BroughtUp(is_complete=False)
        ):
            return "WARN"
        case NodeTransitionFailed() | RollingBack() | Stuck() | NodeFailed():
            return "ERROR"
        case _:
            return "INFO"


def _code(event: Event) -> str:
    match "" if isinstance(event, Logged) else severity_of(event), event:
        case "WARN", _:
            return _YELLOW
        case "ERROR", _:
            return _RED
        case _, BroughtUp() | Restarted():
            return _GREEN
        case _, Stopping() | RolledBack():
            return _YELLOW
        case _, StateChanged():
            return _DIM
        case _:
            return ""


def summary(outcome: Outcome) -> str:
    """Return the summary of a run: a table of its nodes and one of its busiest callbacks."""
    head = ("node", "state", "received", "sent", "requests", "dropped", "errors")
    rows = [head, *map(_row, outcome.nodes)]
    parts = [
        lines([f"ran for {outcome.elapsed_s:.1f} s: {outcome.reason}"]),
        columns(rows, numbers_from=2),
    ]
    called = [callback for callback in outcome.callbacks if callback.count or callback.dropped]
    if called:
        parts.append(summary_table(called, _MAX_CALLBACKS))
    parts += [f"chain {chain.chain}: {chain.text}" for chain in outcome.chains]
    if outcome.remarks:
        parts.append(lines([f"not up at the end: {', '.join(outcome.remarks)}"]))
    if any(node.errors for node in outcome.nodes):
        parts.append(_error_line(outcome.nodes))
    return "\n".join(parts)


def _row(node: NodeSummary) -> tuple[str, ...]:
    counts = (node.received, node.sent, node.calls, node.dropped, node.errors)
    return (node.node, node.state, *(str(n) if node.is_counted or n else "-" for n in counts))


def _error_line(nodes: Sequence[NodeSummary]) -> str:
    """Return how many errors there were, and in which nodes, the worst first."""
    failed = sorted((node for node in nodes if node.errors), key=lambda node: -node.errors)
    shown = [f"{node.node} ({node.errors})" for node in failed[:_MAX_NODES_WITH_ERRORS]]
    more = [f"{len(failed) - len(shown)} more"] if len(failed) > len(shown) else []
    total = sum(node.errors for node in failed)
    what = "1 error" if total == 1 else f"{total} errors"
    return f"{what} in {'node' if len(failed) == 1 else 'nodes'} {', '.join(shown + more)}"
