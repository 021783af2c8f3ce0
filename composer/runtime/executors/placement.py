"""The CPUs, the priority and the memory limit of threads and processes."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterable, Iterator

from composer.model import Executor, ExecutorKind, Process
from composer.runtime.process.computer import process_usage

_PRIORITY_HINT = (
    "it is allowed to root, with CAP_SYS_NICE, or up to the 'rtprio' of the user in"
    " /etc/security/limits.conf"
)
#: Python's default is 5 ms.
_SWITCH_INTERVAL_S = 0.001


def switch_threads_sooner() -> None:
    """Let a thread wait less for the interpreter while another one computes.

    A shorter interval that is set already is kept.
    See docs/decisions/0007-event-driven-executor.md.
    """
    sys.setswitchinterval(min(sys.getswitchinterval(), _SWITCH_INTERVAL_S))


def place_process(process: Process) -> tuple[str, ...]:
    """Apply the CPUs and the priority to this thread, and so to all that it starts.

    Returns a message for each request that Linux refuses.
    """
    settings = Executor(
        process.name,
        ExecutorKind.EVENTS,
        process.span,
        cpus=process.cpus,
        priority=process.priority,
    )
    return place_threads(settings, (0,))


def memory_excess(process: Process) -> str | None:
    """Return why this process uses too much memory, or None."""
    limit = process.memory_mb
    if limit is None:
        return None
    usage = process_usage("self")
    if usage is None or usage.memory_mb <= limit.value:
        return None
    used = f"process '{process.name}' uses {usage.memory_mb:.0f} MB of memory"
    return f"{used}, more than {limit.value:g} MB"


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
