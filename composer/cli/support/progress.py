"""What ``compose run`` prints and keeps in its log: events, and a summary at the end."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Sequence
from typing import TextIO

from composer.base.characters import counted
from composer.cli.support.callback_tables import summary_table
from composer.cli.support.console import OutputQueue
from composer.cli.support.line_format import LineFormat, continued
from composer.cli.support.process import report_ready, take_ready_descriptor
from composer.cli.support.terminal import columns, lines, say, use_color
from composer.client.run_log import RotatingFile, RunFolder
from composer.client.run_log.reading import Record
from composer.model.names import PROGRAM_LOGGER
from composer.runtime.middleware.environment import log_folder
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
            text = event.with_reasons if address is None else f"{address}\n{event.with_reasons}"
            report_ready(self._ready, text, is_complete=event.is_complete)
            self._ready = None
        line = self._line(event)
        code = _code(event)
        if self._color and code:
            line = f"\x1b[{code}m{line}\x1b[0m"
        self._stream.write(f"{line}\n")

    def _line(self, event: Event) -> str:
        record = _record(event)
        if self._format is not None:
            return self._format.render(record)
        severity, text = record.level.upper(), continued(record.message)
        return f"[{event.elapsed_s:.3f}] [{severity}] [{record.logger}] {text}"


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
    noun = "node" if len(failed) == 1 else "nodes"
    return f"{counted(total, 'error')} in {noun} {', '.join(shown + more)}"


class RunLog:
    """Writes events to the log files of a run. A slow or full disk does not delay the run.

    The files are created at the first event: a run that is refused leaves none. Without a writable
    folder, the run has no log, and a warning says so.
    """

    def __init__(self, system: str, *, part: bool = False, forwarded: bool = False) -> None:
        """``system`` is the full name of the system, or of a process of it, a ``part``.

        The lines of a process are ``forwarded`` if the one that coordinates it logs them as well.
        """
        self._system = system
        self._kind = {"part": part, "forwarded": forwarded}
        self._folder: RunFolder | None = None
        self._queue: OutputQueue | None = None
        self._is_started = False

    def show(self, event: Event) -> None:
        """Write an event, except for what the nodes have logged themselves."""
        if isinstance(event, CallbackFailed):
            return
        if not self._is_started:
            self._start()
        if self._queue is not None:
            self._queue.put(_record(event).to_line())

    def close(self) -> None:
        """Write what waits, as far as possible."""
        if self._queue is None or self._folder is None:
            return
        is_complete = self._queue.close() and not self._queue.has_dropped
        if not is_complete:
            why = "the disk was full or too slow"
            say(f"warning: lines are missing in the log '{self._folder.path}': {why}")
        self._folder.close()

    def _start(self) -> None:
        self._is_started = True
        logs = log_folder(os.environ)
        problem = "neither ROS_LOG_DIR nor HOME is set"
        try:
            self._folder = None if logs is None else RunFolder(logs, self._system, **self._kind)
        except OSError as error:
            problem = f"{error.strerror}: '{error.filename}'"
        if self._folder is None:
            say(f"warning: 'compose logs' will not show this run: {problem}")
            return
        self._queue = OutputQueue(RotatingFile(self._folder.path), _note, name="run log")


def _record(event: Event) -> Record:
    if isinstance(event, Logged):
        logger, text = event.logger, event.message
        node = "" if logger == PROGRAM_LOGGER else "/" + logger.replace(".", "/")
    else:
        logger, text, node = PROGRAM_LOGGER, str(event), getattr(event, "node", "")
    return Record(time.time_ns(), severity_of(event).lower(), logger, node, text)


def _note(dropped_lines: int) -> str:
    text = f"{dropped_lines} lines of the log are missing: the disk was full or too slow"
    return Record(time.time_ns(), "warn", PROGRAM_LOGGER, "", text).to_line()
