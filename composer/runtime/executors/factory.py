"""Creates the loop of an executor and places its threads on CPUs."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator

from rclpy.logging import get_logger

from composer.model import Executor, ExecutorKind
from composer.names import PROGRAM_LOGGER
from composer.runtime.executors.event_loop import EventLoop
from composer.runtime.executors.exceptions import describe, internal_report_of
from composer.runtime.executors.loop import ExceptionHandler, Loop
from composer.runtime.executors.wait_set.loop import WaitSetLoop
from composer.runtime.metrics.repeat_limit import RepeatLimit

_EXCEPTIONS = RepeatLimit()
_PRIORITY_HINT = (
    "it is allowed to root, with CAP_SYS_NICE, or up to the 'rtprio' of the user in"
    " /etc/security/limits.conf"
)


def make_loop(executor: Executor, on_exception: ExceptionHandler | None = None) -> Loop:
    """Return the loop for an executor, not started. rclpy must be initialized.

    ``on_exception`` is called with every exception that leaves a callback; by default it is
    logged.
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
    """Log an exception that left a callback, at most once a second for each ``what``."""
    admission = _EXCEPTIONS.admit(what)
    if admission is not None:
        text = internal_report_of(error) if admission.is_first else describe(error)
        get_logger(PROGRAM_LOGGER).error(f"{what}: {text}{admission.suffix}")


def place_threads(executor: Executor, native_thread_ids: Iterable[int]) -> tuple[str, ...]:
    """Apply the executor's CPUs and priority to threads of this process, by their Linux ids.

    Returns a message for each request that Linux refuses; the threads run nevertheless.
    """
    ids = tuple(native_thread_ids)
    return tuple(dict.fromkeys((*_set_cpus(executor, ids), *_set_priority(executor, ids))))


def _set_cpus(executor: Executor, native_thread_ids: Iterable[int]) -> Iterator[str]:
    if not executor.cpus:
        return
    for thread_id in native_thread_ids:
        try:
            os.sched_setaffinity(thread_id, executor.cpus)
        except OSError as error:
            allowed = ", ".join(map(str, sorted(os.sched_getaffinity(0))))
            desired = ", ".join(map(str, executor.cpus))
            yield (
                f"executor '{executor.name}' cannot run on CPU {desired}: {error.strerror};"
                f" this process may use {allowed}"
            )


def _set_priority(executor: Executor, native_thread_ids: Iterable[int]) -> Iterator[str]:
    if executor.priority is None:
        return
    for thread_id in native_thread_ids:
        try:
            os.sched_setscheduler(thread_id, os.SCHED_FIFO, os.sched_param(executor.priority))
        except OSError as error:
            yield (
                f"executor '{executor.name}' cannot have real-time priority {executor.priority}:"
                f" {error.strerror}; {_PRIORITY_HINT}"
            )
