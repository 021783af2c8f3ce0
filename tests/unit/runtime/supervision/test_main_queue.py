"""The main queue keeps the order of items, and waits are limited in time."""

from __future__ import annotations

import math
import threading
import time

import pytest

from composer.runtime.clock import COMPUTER
from composer.runtime.supervision import main_queue as module
from composer.runtime.supervision.main_queue import MainQueue


def test_items_are_returned_in_order_and_kept_during_a_wait() -> None:
    main_queue: MainQueue[int] = MainQueue(COMPUTER)
    for number in range(3):
        main_queue.put(number)
    assert [main_queue.get(), main_queue.get()] == [0, 1]
    done = []
    threading.Thread(target=lambda: (done.append(True), main_queue.wakeup.wake())).start()
    assert main_queue.wait(lambda: bool(done), time.monotonic() + 20.0, stoppable=True)
    assert main_queue.get(time.monotonic()) == 2
    began_s = time.monotonic()
    assert main_queue.get(began_s) is None
    assert not main_queue.wait(lambda: False, began_s + 0.05, stoppable=True)
    assert main_queue.get(began_s + 0.1) is None
    assert 0.1 <= time.monotonic() - began_s < 10.0


def test_a_stop_ends_stoppable_waits_and_a_second_one_shortens_the_others(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(module, "SAME_REQUEST_S", 60.0)
    main_queue: MainQueue[str] = MainQueue(COMPUTER)
    main_queue.put("never handled")
    main_queue.request_stop("SIGINT")
    assert main_queue.stopping
    assert main_queue.get() is None
    assert not main_queue.wait(lambda: False, time.monotonic() + 60.0, stoppable=True)
    main_queue.request_stop("SIGINT")  # the same signal, forwarded
    assert (main_queue.stop_reason, main_queue.urgent) == ("SIGINT", False)
    monkeypatch.setattr(module, "SAME_REQUEST_S", 0.1)
    until_s = time.monotonic() + 20.0
    while not main_queue.urgent and time.monotonic() < until_s:
        main_queue.request_stop("SIGTERM")
    assert (main_queue.stop_reason, main_queue.urgent) == ("SIGINT", True)
    began_s = time.monotonic()
    assert not main_queue.wait(lambda: False, began_s + 60.0, stoppable=False)
    assert time.monotonic() - began_s < 10.0


@pytest.mark.parametrize("left_s", [1e9, math.inf])
def test_the_end_of_a_wait_may_be_years_away(left_s: float) -> None:
    main_queue: MainQueue[str] = MainQueue(COMPUTER)
    main_queue.wakeup.wake()
    assert main_queue.wakeup.wait(time.monotonic() + left_s)
    assert not main_queue.wakeup.wait(time.monotonic() + 0.01)
