"""Futures and tasks, on a minimal loop."""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Callable, Coroutine, Generator
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import pytest

from composer.runtime.executors.futures import Cancelled, Future
from composer.runtime.executors.tasks import Task, sleep, within


class Call:
    def __init__(self, callback: Callable[[], object]) -> None:
        self.callback = callback
        self.cancelled = False

    def cancel(self) -> None:
        self.cancelled = True


class Loop:
    """A loop that runs until it is idle; the test advances its time."""

    def __init__(self) -> None:
        self.calls: deque[Callable[[], object]] = deque()
        self.later: list[Call] = []
        self.reports: list[tuple[str, BaseException]] = []
        self.ended = 0

    def call_soon(self, callback: Callable[[], object]) -> None:
        self.calls.append(callback)

    def call_later(self, delay_s: float, callback: Callable[[], object]) -> Call:
        self.later.append(Call(callback))
        return self.later[-1]

    def report(self, what: str, error: BaseException) -> None:
        self.reports.append((what, error))

    def task(self, coroutine: Coroutine[Any, Any, Any]) -> Task[Any]:
        task = Task(coroutine, self.call_soon, self.report, self.count_end)
        task.start()
        return task

    def count_end(self, _: object) -> None:
        self.ended += 1

    def start(self, coroutine: Coroutine[Any, Any, Any]) -> Future[Any]:
        futures = [self.task(coroutine).future]
        self.run()
        return futures.pop()  # this frame may live on in a traceback, and must not hold it

    def run(self) -> None:
        while self.calls:
            self.calls.popleft()()

    def pass_time(self) -> None:
        due, self.later = self.later, []
        for call in due:
            if not call.cancelled:
                self.calls.append(call.callback)
        self.run()


@pytest.fixture
def loop() -> Loop:
    return Loop()


async def wait_for(future: Any) -> Any:
    return await future


async def fail() -> None:
    raise ValueError("broken")


class TestFuture:
    def test_the_first_outcome_wins(self) -> None:
        future: Future[int] = Future()
        with pytest.raises(RuntimeError, match="no result yet"):
            future.result()
        assert future.set_result(1)
        assert not future.set_result(2)
        assert not future.set_exception(ValueError())
        assert not future.cancel()
        assert future.result() == 1
        assert future.exception() is None
        failed: Future[int] = Future()
        failed.set_exception(ValueError("broken"))
        with pytest.raises(ValueError, match="broken"):
            failed.result()
        cancelled: Future[int] = Future()
        cancelled.cancel()
        assert cancelled.cancelled()
        with pytest.raises(Cancelled):
            cancelled.result()

    def test_done_callbacks_are_called_once_even_if_one_of_them_fails(self) -> None:
        future: Future[int] = Future()
        seen: list[str] = []
        future.add_done_callback(lambda _: 1 / 0)
        future.add_done_callback(lambda done: seen.append(f"early {done.result()}"))
        with pytest.raises(ZeroDivisionError):
            future.set_result(3)
        future.add_done_callback(lambda done: seen.append(f"late {done.result()}"))
        assert seen == ["early 3", "late 3"]

    def test_many_threads_finish_it_once(self) -> None:
        with ThreadPoolExecutor(4) as pool:
            for _ in range(200):
                future: Future[int] = Future()
                called: list[Future[int]] = []
                future.add_done_callback(called.append)
                won = list(pool.map(future.set_result, range(4)))
                assert won.count(True) == 1
                assert won[future.result()]
                assert called == [future]

    def test_an_unretrieved_exception_is_reported_when_the_future_is_deleted(self) -> None:
        reports: list[BaseException] = []
        noticed: Future[int] = Future(reports.append)
        noticed.set_exception(ValueError("noticed"))
        noticed.exception()
        del noticed
        assert reports == []
        ignored: Future[int] = Future(reports.append)
        ignored.set_exception(ValueError("ignored"))
        del ignored
        assert [str(error) for error in reports] == ["ignored"]


class TestTask:
    def test_runs_to_its_result_once_the_loop_calls(self, loop: Loop) -> None:
        gate: Future[str] = Future()
        begun: list[bool] = []

        async def work() -> str:
            begun.append(True)
            return f"{await gate} {await gate}"  # the second one is done

        outcome = loop.task(work()).future
        assert begun == []
        loop.run()
        assert (begun, outcome.done(), loop.ended) == ([True], False, 0)
        assert not loop.calls, "it polls"
        gate.set_result("open")
        loop.run()
        assert (outcome.result(), loop.ended) == ("open open", 1)

    def test_an_exception_is_reported_unless_something_awaits_it(self, loop: Loop) -> None:
        inner = loop.task(fail()).future
        outer = loop.start(wait_for(inner))
        assert isinstance(outer.exception(), ValueError)

        def call_at_once(callback: Callable[[], object]) -> None:  # as another thread may
            callback()

        outcome = Task(fail(), call_at_once, loop.report, loop.count_end).start()
        assert isinstance(outcome.exception(), ValueError)
        assert loop.reports == []
        loop.start(fail())
        ((what, error),) = loop.reports
        assert (what, str(error)) == ("fail", "broken")

    @pytest.mark.parametrize("error", [SystemExit, KeyboardInterrupt])
    def test_system_exit_ends_the_task_but_not_the_loop(
        self, loop: Loop, error: type[BaseException]
    ) -> None:
        async def leave() -> None:
            raise error

        loop.start(leave())
        assert [type(error) for _, error in loop.reports] == [error]

    def test_sleep_0_lets_others_run_first(self, loop: Loop) -> None:
        seen: list[str] = []

        async def step(name: str) -> None:
            for number in range(2):
                seen.append(f"{name}{number}")
                await asyncio.sleep(0)

        loop.task(step("a"))
        loop.task(step("b"))
        loop.run()
        assert seen == ["a0", "b0", "a1", "b1"]

    def test_a_wrong_await_raises_and_the_coroutine_may_continue(self, loop: Loop) -> None:
        class Wrong:
            def __await__(self) -> Generator[str, None, None]:
                yield "nonsense"

        async def recover() -> str:
            with pytest.raises(TypeError):
                await Wrong()
            with pytest.raises(TypeError, match=r"cannot await _asyncio\.Future here"):
                await foreign
            return "well"

        other = asyncio.new_event_loop()
        foreign = other.create_future()
        other.close()
        assert loop.start(recover()).result() == "well"


class TestCanceling:
    def test_throws_into_the_coroutine_where_it_awaits(self, loop: Loop) -> None:
        seen: list[str] = []
        gate: Future[None] = Future()

        async def work() -> None:
            try:
                await gate
            except Exception:
                seen.append("swallowed")
            except Cancelled:
                seen.append("cancelled")
                raise
            finally:
                seen.append("cleaned up")

        outcome = loop.start(work())
        assert outcome.cancel()
        assert outcome.cancelled()
        loop.run()
        assert seen == ["cancelled", "cleaned up"]
        assert not gate.done()
        assert (loop.reports, loop.ended) == ([], 1)
        with pytest.raises(Cancelled):
            outcome.result()

    def test_before_its_start_a_task_never_runs_and_an_awaited_future_cancels_it(
        self, loop: Loop
    ) -> None:
        seen: list[bool] = []

        async def work() -> None:
            seen.append(True)

        loop.task(work()).future.cancel()
        loop.run()
        assert (seen, loop.ended) == ([], 1)
        gate: Future[None] = Future()
        outcome = loop.start(wait_for(gate))
        gate.cancel()
        loop.run()
        assert outcome.cancelled()
        assert loop.reports == []

    def test_the_awaited_future_does_not_wake_a_canceled_task(self, loop: Loop) -> None:
        gate: Future[str] = Future()
        other: Future[str] = Future()
        seen: list[str] = []

        async def work() -> None:
            try:
                await gate
            except Cancelled:
                seen.append(await other)

        outcome = loop.start(work())
        outcome.cancel()
        loop.run()
        gate.set_result("too late")
        loop.run()
        assert seen == []
        other.set_result("cleaned up")
        loop.run()
        assert seen == ["cleaned up"]

    def test_an_exception_while_cleaning_up_is_reported(self, loop: Loop) -> None:
        gate: Future[None] = Future()

        async def work() -> None:
            try:
                await gate
            finally:
                raise ValueError("while cleaning up")

        loop.start(work()).cancel()
        loop.run()
        assert [str(error) for _, error in loop.reports] == ["while cleaning up"]

    def test_closing_ends_the_coroutine_at_once(self, loop: Loop) -> None:
        seen: list[str] = []

        async def work() -> None:
            try:
                await Future()
            finally:
                seen.append("closed")

        task = loop.task(work())
        loop.run()
        task.close()
        task.close()
        assert seen == ["closed"]
        assert task.future.cancelled()
        assert loop.ended == 1


class TestWaiting:
    def test_a_sleep_is_done_after_its_time_or_canceled(self, loop: Loop) -> None:
        outcome = loop.start(wait_for(sleep(loop, 0.5)))
        assert not outcome.done()
        loop.pass_time()
        assert outcome.done()
        sleep(loop, 0.5).cancel()
        assert [call.cancelled for call in loop.later] == [True], "it leaves its timer"

    def test_a_result_in_time_is_returned(self, loop: Loop) -> None:
        gate: Future[str] = Future()
        outcome = loop.start(within(loop, gate, 1.0))
        gate.set_result("answer")
        loop.run()
        assert outcome.result() == "answer"
        assert [call.cancelled for call in loop.later] == [True]

    def test_the_future_is_canceled_after_the_timeout_or_with_its_task(self, loop: Loop) -> None:
        late, unwanted = Future[str](), Future[str]()
        outcome = loop.start(within(loop, late, 1.5))
        loop.pass_time()
        with pytest.raises(TimeoutError, match=r"no answer within 1\.5 s"):
            outcome.result()
        assert late.cancelled()
        loop.start(within(loop, unwanted, 1.0)).cancel()
        loop.run()
        assert unwanted.cancelled()
