"""What every kind of executor does alike: calls, timers, tasks, start and stop, and its threads."""

from __future__ import annotations

import os
import threading
import time
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path

import pytest
import rclpy

from composer.base.source import Located, SourceFile, Span
from composer.model import Executor, ExecutorKind
from composer.runtime.executors.futures import Future
from composer.runtime.executors.loop import Loop
from composer.runtime.executors.tasks import sleep
from composer.runtime.process.computer import place_threads
from tests.ros.support.in_process import running, wait_until
from tests.ros.support.loops import KINDS, PATIENCE_S, Bench, bench, loop_of, print_error


def test_calls_of_each_thread_all_start_and_keep_their_order(on: Bench) -> None:
    seen: list[tuple[int, int]] = []

    def post(thread: int) -> None:
        for number in range(500):
            on.loop.call_soon(lambda number=number: seen.append((thread, number)))

    threads = [threading.Thread(target=post, args=(thread,)) for thread in range(4)]
    for thread in threads:
        thread.start()
    wait_until(lambda: len(seen) == 2000)
    for thread_number in range(4):
        numbers = [number for thread, number in seen if thread == thread_number]
        if on.loop.is_parallel:  # calls may overlap once they have started
            numbers.sort()
        assert numbers == list(range(500))


def test_a_timer_keeps_its_rate(on: Bench) -> None:
    at: list[float] = []
    timer = on.loop.call_every(0.01, lambda: at.append(time.monotonic()))
    wait_until(lambda: len(at) >= 50)
    timer.cancel()
    assert at[49] - at[0] > 0.4
    # Not the median: the benchmark 'timers' measures how late a busy machine is.
    assert min(later - earlier for earlier, later in pairwise(at)) < 0.02


def test_a_timer_cancels_itself(on: Bench) -> None:
    seen: list[int] = []
    known = threading.Event()

    def once() -> None:
        known.wait()
        seen.append(1)
        timer.cancel()

    timer = on.loop.call_every(0.02, once)
    known.set()
    done: list[int] = []
    on.loop.call_later(0.1, lambda: done.append(1))
    wait_until(lambda: done)
    assert seen == [1]


def test_an_exception_in_a_call_is_reported_and_the_loop_continues(on: Bench) -> None:
    for error in (ValueError, SystemExit, KeyboardInterrupt):

        def fall_over(error: type[BaseException] = error) -> None:
            raise error

        timer = on.loop.call_every(0.01, fall_over)
        on.loop.call_soon(fall_over)
        wait_until(lambda error=error: on.errors().count(error) >= 4)
        timer.cancel()
    assert all("fall_over" in what for what, _ in on.reports)
    assert on.loop.run(lambda: "alive", 60.0) == "alive"


class TestRun:
    def test_on_the_loop_it_calls_at_once_and_a_timeout_shows_the_stack(self, on: Bench) -> None:
        assert on.loop.run(lambda: on.loop.run(lambda: "inner", 5.0), 60.0) == "inner"
        release = threading.Event()

        def take_too_long() -> None:
            release.wait()

        for limit_s in (1.0, 5.0, 20.0):  # time until it starts, which a busy machine may need
            with pytest.raises(TimeoutError) as caught:
                on.loop.run(take_too_long, limit_s)
            if "was not started" not in str(caught.value):
                break
        release.set()
        assert f"take_too_long' is still running after {limit_s:g} s" in str(caught.value)
        assert "release.wait()" in str(caught.value)

    def test_a_function_that_did_not_start_in_time_never_starts(self, on: Bench) -> None:
        release = threading.Event()
        seen: list[str] = []
        for _ in range(3):  # one per thread
            on.loop.call_soon(release.wait)
        wait_until(on.loop.current_stack)
        with pytest.raises(TimeoutError, match="was not started"):
            on.loop.run(lambda: seen.append("begun"), 0.1)
        release.set()
        assert on.loop.run(lambda: "after", 60.0) == "after"
        assert seen == []


def used_s(on: Bench) -> float:
    """Return the time of a processor that the threads of the loop have used, and no others.

    In the process there may be what tests before have left. The clock of a thread is numbered as
    Linux does: see clock_getcpuclockid(3).
    """
    return sum(time.clock_gettime(~thread_id << 3 | 6) for thread_id in on.loop.native_thread_ids())


def test_idle_costs_nothing(on: Bench) -> None:
    on.loop.run(lambda: None, 60.0)
    before_s = used_s(on)
    time.sleep(1.0)  # the time of the measurement
    assert used_s(on) - before_s < 0.3  # a spinning loop would use it all


def test_waiting_for_a_busy_thread_costs_nothing(on: Bench) -> None:
    release = threading.Event()

    def hang_here() -> None:
        release.wait()

    for _ in range(6):  # more than the threads
        on.loop.call_soon(hang_here)
    wait_until(lambda: "hang_here" in on.loop.current_stack())
    before_s = used_s(on)
    time.sleep(0.5)  # the time of the measurement
    meanwhile_s = used_s(on) - before_s
    release.set()
    assert meanwhile_s < 0.2
    assert on.loop.run(lambda: "alive", 60.0) == "alive"
    wait_until(lambda: on.loop.current_stack() == "")


def test_a_busy_loop_does_not_starve_other_threads(
    on: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    # Releasing the interpreter's lock is not enough: no other thread is awake by then.
    rests_s: list[float] = []

    def rest(seconds: float) -> None:
        rests_s.append(seconds)
        time.sleep(seconds)

    monkeypatch.setattr(on.loop.clock, "sleep", rest)
    on.loop.run_task(_never_idle(on))
    wait_until(lambda: len(rests_s) > 10, "pauses of the loop")
    assert min(rests_s) > 0.0


async def _never_idle(on: Bench) -> None:
    while True:
        turn: Future[None] = Future()
        on.loop.call_soon(lambda turn=turn: turn.set_result(None))
        await turn


def test_as_many_callbacks_overlap_as_the_executor_has_threads() -> None:
    release = threading.Event()
    begun: list[int] = []

    def callback() -> None:
        on.loop.overlap()
        begun.append(threading.get_ident())
        release.wait()

    with bench(ExecutorKind.MULTI_THREADED) as on:
        for _ in range(3):
            on.loop.call_soon(callback)
        wait_until(lambda: len(begun) == 3)
        assert on.loop.run(lambda: "served meanwhile", 60.0) == "served meanwhile"
        on.loop.call_soon(callback)
        with pytest.raises(TimeoutError, match="was not started"):
            on.loop.run(lambda: None, 0.05)
        assert len(set(begun)) == len(begun) == 3
        release.set()
        wait_until(lambda: len(begun) == 4)
        wait_until(lambda: not on.loop.busy_threads())
        assert len(on.loop.native_thread_ids()) <= 5


class TestStopping:
    @pytest.mark.parametrize("kind", KINDS)
    def test_stopping_a_busy_loop_does_not_block(self, kind: ExecutorKind) -> None:
        rclpy.init()
        release = threading.Event()
        try:
            assert loop_of(kind).stop(60.0)  # it has not been started
            loop = loop_of(kind)
            loop.start()
            loop.call_soon(release.wait)
            wait_until(loop.current_stack)
            begin = time.monotonic()
            assert not loop.stop(0.2)
            assert time.monotonic() - begin < 10.0  # the callback waits forever
            assert "wait" in loop.current_stack()
            release.set()
            wait_until(lambda: loop.stop(0.2))
        finally:
            release.set()
            rclpy.shutdown()

    @pytest.mark.parametrize("kind", KINDS)
    def test_tasks_are_canceled_and_nothing_runs_afterwards(self, kind: ExecutorKind) -> None:
        seen: list[str] = []
        with bench(kind) as on:
            begun: list[bool] = []

            async def work() -> None:
                begun.append(True)
                try:
                    await Future()
                finally:
                    await sleep(on.loop, 60.0)  # longer than the test
                    seen.append("too late")

            async def clean() -> None:
                begun.append(True)
                try:
                    await Future()
                finally:
                    seen.append("cleaned up")

            async def wait() -> None:
                await Future()

            futures = [on.loop.run_task(task) for task in (work(), clean())]
            wait_until(lambda: len(begun) == 2)
            futures.append(on.loop.run_task(wait()))  # it may not have begun
        assert seen == ["cleaned up"]
        assert all(future.cancelled() for future in futures)
        assert on.reports == []
        with pytest.raises(RuntimeError, match="has stopped"):
            on.loop.run(lambda: None, 60.0)


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
