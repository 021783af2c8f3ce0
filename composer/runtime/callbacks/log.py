"""A node's logger, and the log of its errors and repeated events."""

from __future__ import annotations

import sys
import threading
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from types import FrameType
from typing import TypeAlias

from rcl_interfaces.msg import Log as LogMessage
from rclpy.exceptions import InvalidHandle
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.logging import set_logger_level
from rclpy.node import Node

from composer.model import SEVERITIES, LogLevel
from composer.model.qos import Durability, QosProfile
from composer.runtime.clock import Clock
from composer.runtime.executors.futures import Cancelled
from composer.runtime.executors.tracebacks import describe, is_internal, printable, report_of
from composer.runtime.host_options import Recorder
from composer.runtime.metrics.repeat_limit import RepeatLimit
from composer.runtime.metrics.statistics import Statistics
from composer.runtime.ros.conversions import rclpy_profile

#: As rcl_qos_profile_rosout_default: a late joiner gets the last ten seconds.
_ROSOUT_QOS = QosProfile(depth=1000, durability=Durability.TRANSIENT_LOCAL, lifespan_ms=10_000.0)
#: The levels of all loggers of the process are kept by rcutils, as for any ROS node.
_is_enabled = rclpy_implementation.rclpy_logging_logger_is_enabled_for
#: Raised if the node or its rclpy context has been destroyed.
_DESTROYED = (InvalidHandle, rclpy_implementation.RCLError)
#: Minimum time between two log lines about errors of the same callback.
_ERROR_PERIOD_S = 1.0

#: Called with (level, name of the logger, message).
Write: TypeAlias = Callable[[LogLevel, str, str], None]


def logger_name(node: str) -> str:
    """Return the name of the logger of a node with the full name ``node``."""
    return node.strip("/").replace("/", ".")


def set_level(node: str, level: LogLevel) -> None:
    """Set the level of the logger of a node of this process, by its full name."""
    set_logger_level(logger_name(node), SEVERITIES[level])


class Log:
    """A behavior's ``log``: to the console of the process, and to /rosout.

    Not by rcl, whose console has no timestamps relative to the start of the system. rclpy's logger
    also searches the stack for its caller at every call, which takes longer than the rest.
    """

    def __init__(
        self, node: Node, write: Write, *, rosout: bool = True, recorder: Recorder | None = None
    ) -> None:
        """Log messages at the level of the node's logger. ``node`` must not have rcl's publisher.

        Without ``rosout``, to the console and to the ``recorder`` only.
        """
        self._name = logger_name(node.get_fully_qualified_name())
        self._write = write
        self._clock = node.get_clock()
        #: What receives the lines as messages.
        self._receivers: list[Callable[[LogMessage], None]] = []
        if rosout:
            profile = rclpy_profile(_ROSOUT_QOS)
            self._receivers.append(node.create_publisher(LogMessage, "/rosout", profile).publish)
        if recorder is not None:
            tap = recorder.tap("/rosout", "rcl_interfaces/msg/Log", _ROSOUT_QOS)
            self._receivers += [] if tap is None else [tap.put]

    def is_enabled_for(self, level: LogLevel) -> bool:
        """Return whether messages at ``level`` are logged."""
        return bool(_is_enabled(self._name, SEVERITIES[level]))

    def write(self, level: LogLevel, message: str, caller: FrameType | None = None) -> None:
        """Log ``message`` at ``level``; see :meth:`emit`."""
        if self.is_enabled_for(level):
            self.emit(level, message, caller=caller)

    def emit(
        self,
        level: LogLevel,
        message: str,
        name: str | None = None,
        caller: FrameType | None = None,
    ) -> None:
        """Log ``message`` whatever the level of this log is, by default as the node's.

        ``caller`` is the frame that logs; /rosout has its place, if it is in code of the user.
        """
        name = name or self._name
        text = printable(message)
        self._write(level, name, text)
        if not self._receivers:
            return
        with suppress(*_DESTROYED):
            line = LogMessage(
                stamp=self._clock.now().to_msg(), level=SEVERITIES[level], name=name, msg=text
            )
            if caller is not None and not is_internal(caller.f_code.co_filename):
                line.file, line.line = caller.f_code.co_filename, caller.f_lineno
                line.function = caller.f_code.co_name
            for receive in self._receivers:
                receive(line)

    def debug(self, message: str) -> None:
        """Log details for debugging."""
        self.write(LogLevel.DEBUG, message, sys._getframe(1))

    def info(self, message: str) -> None:
        """Log information for the operator of the system."""
        self.write(LogLevel.INFO, message, sys._getframe(1))

    def warn(self, message: str) -> None:
        """Log a possible problem."""
        self.write(LogLevel.WARN, message, sys._getframe(1))

    def error(self, message: str) -> None:
        """Log an error."""
        self.write(LogLevel.ERROR, message, sys._getframe(1))

    def fatal(self, message: str) -> None:
        """Log an unrecoverable error of the node."""
        self.write(LogLevel.FATAL, message, sys._getframe(1))


class ErrorLimit:
    """Reports once when more than ``max_errors`` errors happen within ``window_s``. Thread-safe.

    It counts only while it is not ``paused``, as it is until :meth:`start`.
    """

    def __init__(
        self,
        max_errors: int,
        window_s: float,
        report: Callable[[str], None],
        counts: Callable[[], bool],
    ) -> None:
        """Count errors only while ``counts()``."""
        self._max_errors = max_errors
        self._window_s = window_s
        self._report = report
        self._counts = counts
        self._lock = threading.Lock()
        self._times_s: deque[float] = deque(maxlen=max_errors + 1)
        self._has_reported = False
        self.paused = True

    def start(self) -> None:
        """Start to count from zero."""
        with self._lock:
            self._times_s.clear()
            self._has_reported = False
            self.paused = False

    def count(self, now_s: float) -> None:
        """Count an error; report it if it is one too many."""
        with self._lock:
            if self.paused or self._has_reported or not self._counts():
                return
            self._times_s.append(now_s)
            is_full = len(self._times_s) > self._max_errors
            self._has_reported = is_full and now_s - self._times_s[0] <= self._window_s
            if not self._has_reported:
                return
        self._report(f"more than {self._max_errors} errors within {self._window_s:g} s")


class ErrorLog:
    """Counts and logs the errors of user code, which then continues.

    The first error of a callback is logged with its traceback, later ones as one line a second.
    """

    def __init__(
        self,
        log: Log,
        clock: Clock,
        statistics: Statistics,
        report: Callable[[str, str], None],
        limit: ErrorLimit | None = None,
    ) -> None:
        """Call ``report(callback, text)`` for each error that is logged."""
        self._log = log
        self._statistics = statistics
        self._report = report
        self._limit = limit
        self._monotonic = clock.monotonic
        self._repeats = RepeatLimit(clock, _ERROR_PERIOD_S)

    def exception(self, callback: str, error: BaseException) -> None:
        """Log an exception of ``callback``, unless it was canceled."""
        if issubclass(type(error), Cancelled):
            return
        self._add(callback, partial(describe, error), partial(report_of, error))

    def error(self, callback: str, text: str) -> None:
        """Log an error of ``callback``."""
        self._add(callback, lambda: text, lambda: text)

    def _add(self, callback: str, line: Callable[[], str], details: Callable[[], str]) -> None:
        """Count an error, and log it unless there was one just before; details the first time."""
        self._statistics.errors += 1
        if self._limit is not None:
            self._limit.count(self._monotonic())
        admission = self._repeats.admit(callback)
        if admission is None:
            return
        text = details() if admission.is_first else line()
        self._log.error(f"{callback}: {text}{admission.suffix}")
        self._report(callback, text.partition("\n")[0])
