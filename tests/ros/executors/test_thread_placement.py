"""Executors with their own CPUs and priorities, on the real Linux."""

from __future__ import annotations

import os
import threading
from collections.abc import Iterator
from pathlib import Path

import pytest
import rclpy

from composer.base.source import Located, SourceFile, Span
from composer.model import Executor, ExecutorKind
from composer.runtime.executors.loop import Loop
from composer.runtime.executors.placement import place_threads
from tests.ros.support.in_process import running
from tests.ros.support.loops import PATIENCE_S, print_error

NOWHERE = Span(SourceFile("nowhere.yaml", ""), 1, 1, 1)
CPU = min(os.sched_getaffinity(0))


def executor(kind: ExecutorKind, **said: object) -> Executor:
    return Executor(Located("control", NOWHERE), kind, NOWHERE, **said)  # type: ignore[arg-type]


def real_time_is_allowed() -> bool:
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(1))
    except OSError:
        return False
    os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))
    return True


@pytest.fixture
def ros() -> Iterator[None]:
    rclpy.init(args=[])
    yield
    rclpy.shutdown()


@pytest.mark.usefixtures("ros")
@pytest.mark.parametrize("kind", list(ExecutorKind))
def test_every_thread_of_an_executor_is_placed(kind: ExecutorKind) -> None:
    wanted = executor(kind, cpus=(CPU,), priority=7, threads=3)
    loop = Loop(wanted.name.value, print_error, kind, wanted.threads)
    loop.start()
    try:
        refused = place_threads(wanted, loop.native_thread_ids())
        overlapping = threading.Barrier(wanted.threads + 1 if loop.is_parallel else 2)
        for _ in range(overlapping.parties - 1):  # the other threads start when they are needed
            loop.call_soon(lambda: (loop.overlap(), overlapping.wait(PATIENCE_S)))
        overlapping.wait(PATIENCE_S)
        ids = loop.native_thread_ids()
        assert len(set(ids)) == (4 if loop.is_parallel else 1)
        assert [os.sched_getaffinity(thread_id) for thread_id in ids] == [{CPU}] * len(ids)
        if real_time_is_allowed():
            assert refused == ()
            assert {os.sched_getscheduler(thread_id) for thread_id in ids} == {os.SCHED_FIFO}
            assert {os.sched_getparam(thread_id).sched_priority for thread_id in ids} == {7}
        else:
            assert len(refused) == 1
            assert "executor 'control' cannot have real-time priority 7" in refused[0]
            assert "/etc/security/limits.conf" in refused[0]
    finally:
        loop.stop(1.0)


def test_a_missing_cpu_is_a_warning_and_the_system_runs(tmp_path: Path) -> None:
    text = """
    system: pinned
    executors: {control: {cpus: [1023]}}
    nodes: {one: {executor: control}}
    """
    with running(text, tmp_path) as system:
        assert system.states() == ["/one inactive", "/one active"]
        warning = system.wait_for_log("executor 'control' cannot run on CPU 1023")
    assert f"this process may use {CPU}" in warning
