"""Where the threads of an executor run, and before whom: asked of Linux, which may refuse."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator

from composer.model import Executor

_REMEDY = (
    "it is allowed to root, with CAP_SYS_NICE, or up to the 'rtprio' of the user in"
    " /etc/security/limits.conf"
)


def place(executor: Executor, thread_ids: Iterable[int]) -> tuple[str, ...]:
    """Put threads of this process, by Linux's ids, where the executor is to run.

    Returns what is refused, each with what would help; the threads run all the same.
    """
    ids = tuple(thread_ids)
    return tuple(dict.fromkeys((*_pin(executor, ids), *_prefer(executor, ids))))


def _pin(executor: Executor, thread_ids: Iterable[int]) -> Iterator[str]:
    if not executor.cpus:
        return
    for thread_id in thread_ids:
        try:
            os.sched_setaffinity(thread_id, executor.cpus)
        except OSError as error:
            allowed = ", ".join(map(str, sorted(os.sched_getaffinity(0))))
            wanted = ", ".join(map(str, executor.cpus))
            yield (
                f"executor '{executor.name}' cannot run on CPU {wanted}: {error.strerror};"
                f" this process may use {allowed}"
            )


def _prefer(executor: Executor, thread_ids: Iterable[int]) -> Iterator[str]:
    if executor.priority is None:
        return
    for thread_id in thread_ids:
        try:
            os.sched_setscheduler(thread_id, os.SCHED_FIFO, os.sched_param(executor.priority))
        except OSError as error:
            yield (
                f"executor '{executor.name}' cannot have real-time priority {executor.priority}:"
                f" {error.strerror}; {_REMEDY}"
            )
