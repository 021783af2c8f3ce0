"""Which loop an executor of a system file is."""

from __future__ import annotations

from rclpy.logging import get_logger

from composer.model import Executor
from composer.runtime.event_loop import EventLoop
from composer.runtime.loop import ExceptionHandler, Loop


def make_loop(executor: Executor, on_exception: ExceptionHandler | None = None) -> Loop:
    """Return the loop for an executor, not started.

    ``on_exception`` is told of every exception that leaves a callback; by default it is logged.
    """
    return EventLoop(executor.name.value, on_exception or log_exception)


def log_exception(what: str, error: BaseException) -> None:
    """Log an exception that left a callback."""
    get_logger("composer").error(f"{what}: {type(error).__name__}: {error}")
