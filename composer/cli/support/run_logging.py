"""Keeps the log of a run in files, which ``compose logs`` reads."""

from __future__ import annotations

import os
import time
from collections.abc import Iterator
from contextlib import contextmanager

from composer.cli.support.console import OutputQueue
from composer.cli.support.progress import logger_and_text, severity_of
from composer.cli.support.terminal import say
from composer.client.run_log import Record, RotatingFile, RunFolder
from composer.model.names import PROGRAM_LOGGER
from composer.runtime.middleware.environment import log_folder
from composer.runtime.supervision.events import CallbackFailed, Event, Logged


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


@contextmanager
def run_log(system: str, *, part: bool = False, forwarded: bool = False) -> Iterator[RunLog]:
    """Keep the log of a run within the block."""
    log = RunLog(system, part=part, forwarded=forwarded)
    try:
        yield log
    finally:
        log.close()


def _record(event: Event) -> Record:
    logger, text = logger_and_text(event)
    if isinstance(event, Logged):
        node = "" if logger == PROGRAM_LOGGER else "/" + logger.replace(".", "/")
    else:
        node = getattr(event, "node", "")
    return Record(time.time_ns(), severity_of(event).lower(), logger, node, text)


def _note(dropped_lines: int) -> str:
    text = f"{dropped_lines} lines of the log are missing: the disk was full or too slow"
    return Record(time.time_ns(), "warn", PROGRAM_LOGGER, "", text).to_line()
