"""The logger of a hosted node: rclpy's, with the composer's console and /rosout as its outputs."""

from __future__ import annotations

import sys
from types import FrameType
from typing import Any

from rclpy.impl import rcutils_logger
from rclpy.impl.logging_severity import LoggingSeverity
from rclpy.impl.rcutils_logger import CallerId, RcutilsLogger

from composer.model import SEVERITIES, LogLevel
from composer.runtime.callbacks.log import Log

_LEVELS = {severity: level for level, severity in SEVERITIES.items()}


class HostedLogger(RcutilsLogger):
    """What ``get_logger`` returns."""

    def __init__(self, log: Log, name: str) -> None:
        super().__init__(name)
        self._log = log

    def get_child(self, name: str) -> RcutilsLogger:
        """Return the logger ``<this name>.<name>``, which has the level of this one."""
        if not name:
            raise ValueError("Child logger name must not be empty.")
        child = object.__new__(HostedLogger)
        RcutilsLogger.__init__(child, f"{self.name}.{name}")
        child._log = self._log
        return child

    def log(self, message: str, severity: Any, **options: Any) -> bool:
        """Log a message; return false if its level or one of rclpy's filters suppresses it."""
        if not self.is_enabled_for(severity):
            return False
        severity = LoggingSeverity(severity)
        name = options.pop("name", self.name)
        if options and not self._passes(options):
            return False
        level = _LEVELS.get(int(severity), LogLevel.INFO)
        # Not by rclpy's _find_caller, which reads the source file each time.
        caller: FrameType | None = sys._getframe(1)
        while caller is not None and caller.f_code.co_filename == rcutils_logger.__file__:
            caller = caller.f_back
        self._log.emit(level, str(message), name, caller)
        return True

    def _passes(self, options: dict[str, Any]) -> bool:
        """Apply the filters of a call, each of which has a memory for each place in the code."""
        names = rcutils_logger.get_filters_from_kwargs(**options)
        filters = rcutils_logger.supported_filters
        caller = CallerId(rcutils_logger._find_caller(sys._getframe(2)))
        if caller not in self.contexts:
            memory: dict[str, Any] = {}
            for name in names:
                filters[name].initialize_context(memory, **options)
            self.contexts[caller] = memory
        return all(filters[name].should_log(self.contexts[caller]) for name in names)
