"""Virtual time: one order of everything, without waiting."""

from __future__ import annotations

import random
import signal
import threading
import time
from collections.abc import Callable

import pytest

from composer.runtime.clock import START_NS, VirtualClock, Wakeup

Happened = list[tuple[float, str]]


def run(clock: VirtualClock, *parts: Callable[[], None]) -> None:
    """Run each part on a thread of its own, until all have ended."""
    threads = [threading.Thread(target=part, daemon=True) for part in parts]
    for thread in threads:
        clock.start(thread)
    for thread in threads:
        clock.join(thread)
        assert not thread.is_alive()


def sleeps_of_threads(seed: int) -> Happened:
    clock = VirtualClock()
    happened: Happened = []

    def part(name: str, delays_s: list[float]) -> Callable[[], None]:
        def sleep() -> None:
            for delay_s in delays_s:
                clock.sleep(delay_s)
                happened.append((clock.monotonic(), name))

        return sleep

    dice = random.Random(seed)
    run(clock, *(part(f"{n}", [dice.randint(0, 3) * 0.5 for _ in range(40)]) for n in range(4)))
    return happened


@pytest.mark.parametrize("seed", range(5))
def test_threads_that_sleep_run_in_one_order(seed: int) -> None:
    happened = sleeps_of_threads(seed)
    assert [at_s for at_s, _ in happened] == sorted(at_s for at_s, _ in happened)
    assert len(happened) == 160
    assert all(sleeps_of_threads(seed) == happened for _ in range(3))


def test_an_hour_takes_no_time() -> None:
    clock = VirtualClock()
    seen: list[int] = []
    clock.follow(seen.append)
    clock.sleep(0.25)
    clock.unfollow(seen.append)
    before_s = time.monotonic()
    for _ in range(3600):
        clock.sleep(1.0)
    assert clock.monotonic() == 3600.25
    assert clock.time_ns() == START_NS + 3_600_250_000_000
    assert time.monotonic() - before_s < 5.0
    assert seen == [START_NS, START_NS + 250_000_000], "what follows sees each jump"


def test_of_calls_at_the_same_time_the_one_that_waits_longest_is_first() -> None:
    clock = VirtualClock()
    order: list[str] = []

    def until_one(name: str) -> Callable[[], None]:
        def part() -> None:
            clock.wait_until(lambda: False, 1.0)
            order.append(name)

        return part

    run(clock, *map(until_one, "abc"))
    assert order == ["a", "b", "c"]


@pytest.mark.parametrize(
    ("set_after_s", "timeout_s", "is_set", "ended_s"),
    [(1.0, 2.0, True, 1.0), (1.0, None, True, 1.0), (3.0, 2.0, False, 2.0), (0.0, 0.0, True, 0.0)],
)
def test_a_wait_ends_with_its_event_or_its_time(
    set_after_s: float, timeout_s: float | None, is_set: bool, ended_s: float
) -> None:
    clock = VirtualClock()
    event = threading.Event()
    results: list[tuple[bool, float]] = []

    def set_it() -> None:
        clock.sleep(set_after_s)
        event.set()

    def wait_for_it() -> None:
        results.append((clock.wait(event, timeout_s), clock.monotonic()))

    run(clock, set_it, wait_for_it)
    assert results == [(is_set, ended_s)]


def test_a_wake_up_before_or_during_a_wait_ends_it() -> None:
    clock = VirtualClock()
    wakeup = Wakeup(clock)
    wakeup.wake()
    assert wakeup.wait(1.0)
    assert not wakeup.wait(1.0)
    assert clock.monotonic() == 1.0
    ended = threading.Event()
    other = threading.Thread(target=lambda: (wakeup.wake(), clock.wait(ended)), daemon=True)
    other.start()
    assert wakeup.wait()
    ended.set()
    other.join(10.0)
    assert not other.is_alive()


def test_the_speed_is_a_limit() -> None:
    clock = VirtualClock(speed=20.0)
    before_s = time.monotonic()
    run(clock, lambda: [clock.sleep(0.5) for _ in range(4)] and None, lambda: clock.sleep(1.0))
    assert clock.monotonic() == 2.0
    assert 0.1 <= time.monotonic() - before_s < 5.0


def test_an_exception_ends_only_its_thread(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(threading, "excepthook", lambda _: None)
    clock = VirtualClock()

    def fail() -> None:
        clock.sleep(1.0)
        raise ValueError

    run(clock, fail, lambda: clock.sleep(2.0))
    assert clock.monotonic() == 2.0


class _Interrupted(Exception):
    """Raised by a signal handler, as KeyboardInterrupt is."""


def _raise(*_: object) -> None:
    raise _Interrupted


def test_a_signal_that_comes_just_before_the_main_thread_waits_is_handled() -> None:
    """Here another thread receives it, which does not end the wait of the main thread either."""
    clock = VirtualClock()
    handled = threading.Event()
    seen: list[bool] = []

    def receive() -> None:
        signal.pthread_sigmask(signal.SIG_UNBLOCK, [signal.SIGUSR1])
        signal.pthread_kill(threading.get_ident(), signal.SIGUSR1)
        seen.append(handled.wait(10.0))

    before = signal.signal(signal.SIGUSR1, lambda *_: handled.set())
    signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGUSR1])
    try:
        run(clock, receive)
    finally:
        signal.pthread_sigmask(signal.SIG_UNBLOCK, [signal.SIGUSR1])
        signal.signal(signal.SIGUSR1, before)
    assert seen == [True]


def test_an_interrupted_thread_keeps_the_order_of_turns() -> None:
    clock = VirtualClock()
    ended = threading.Event()

    def tick() -> None:
        while not ended.is_set():
            clock.sleep(1.0)

    ticking = threading.Thread(target=tick)
    clock.start(ticking)
    before = signal.signal(signal.SIGALRM, _raise)
    signal.setitimer(signal.ITIMER_REAL, 0.05)
    try:
        with pytest.raises(_Interrupted):
            clock.sleep(1e9)
    finally:
        signal.signal(signal.SIGALRM, before)
    ended.set()
    clock.join(ticking, 5.0)
    assert not ticking.is_alive()
