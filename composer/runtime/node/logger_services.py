"""The standard logger services (rcl_interfaces): levels of all loggers of the process.

They respond as those of rclpy's ``enable_logger_service``, but refuse large requests.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from rcl_interfaces.msg import LoggerLevel, SetLoggerLevelsResult
from rcl_interfaces.srv import GetLoggerLevels, SetLoggerLevels
from rclpy.logging import get_logger_level, set_logger_level
from rclpy.node import Node

from composer.runtime.clock.clock import Clock
from composer.runtime.metrics.repeat_limit import RepeatLimit
from composer.runtime.ros.limited_requests import TooLarge, limited


class LoggerServices:
    """The two services of one node. Create it before the node is added to its loop."""

    def __init__(self, node: Node, clock: Clock, warn: Callable[[str], None]) -> None:
        """``warn`` logs requests that are refused."""
        self._warn = warn
        self._repeats = RepeatLimit(clock)
        self._add(node, GetLoggerLevels, "get_logger_levels", _get)
        self._add(node, SetLoggerLevels, "set_logger_levels", _set)

    def _add(self, node: Node, kind: Any, name: str, answer: Callable[[Any, Any], None]) -> None:
        def respond(request: Any, response: Any) -> Any:
            if not isinstance(request, TooLarge):
                answer(request, response)
            elif (admission := self._repeats.admit(name)) is not None:
                self._warn(f"refused a request of '{name}': {request.reason}{admission.suffix}")
            return response

        node.create_service(limited(kind), f"~/{name}", respond)


def _get(request: Any, response: Any) -> None:
    response.levels = [
        LoggerLevel(name=name, level=int(get_logger_level(name))) for name in request.names
    ]


def _set(request: Any, response: Any) -> None:
    response.results = [_result(item) for item in request.levels]


def _result(item: Any) -> SetLoggerLevelsResult:
    try:
        set_logger_level(item.name, item.level, detailed_error=True)
    except (ValueError, RuntimeError) as error:
        return SetLoggerLevelsResult(successful=False, reason=str(error))
    return SetLoggerLevelsResult(successful=True)
