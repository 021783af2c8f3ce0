"""Which loop an executor of a system file is."""

from __future__ import annotations

from rclpy.logging import get_logger

from composer.model import Executor, ExecutorKind
from composer.runtime.executors.event_loop import EventLoop
from composer.runtime.executors.loop import ExceptionHandler, Loop
from composer.runtime.executors.wait_set_loop import WaitSetLoop


def make_loop(executor: Executor, on_exception: ExceptionHandler | None = None) -> Loop:
    """Return the loop for an executor, not started. rclpy must be initialized.

    ``on_exception`` is told of every exception that leaves a callback; by default it is logged.
    """
    name = executor.name.value
    handler = on_exception or log_exception
    match executor.kind:
        case ExecutorKind.EVENTS:
            return EventLoop(name, handler)
        case ExecutorKind.SINGLE_THREADED:
            return WaitSetLoop(name, handler, threads=None)
        case ExecutorKind.MULTI_THREADED:
            return WaitSetLoop(name, handler, threads=executor.threads)


def log_exception(what: str, error: BaseException) -> None:
    """Log an exception that left a callback."""
    get_logger("composer").error(f"{what}: {type(error).__name__}: {error}")
