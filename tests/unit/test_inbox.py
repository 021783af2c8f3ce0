"""The main thread's inbox: nothing is lost, nothing waits longer than it may."""

from __future__ import annotations

import math
import threading
import time

import pytest

from composer.runtime import inbox as module
from composer.runtime.inbox import Inbox


def test_items_come_in_the_order_they_were_put() -> None:
    inbox: Inbox[int] = Inbox()
    for number in range(3):
        inbox.put(number)
    assert [inbox.take(), inbox.take(), inbox.take()] == [0, 1, 2]
    assert inbox.take(time.monotonic()) is None


def test_what_comes_while_something_else_is_waited_for_is_kept() -> None:
    inbox: Inbox[str] = Inbox()
    inbox.put("later")
    done = []
    threading.Thread(target=lambda: (done.append(True), inbox.wake())).start()
    assert inbox.wait(lambda: bool(done), time.monotonic() + 20.0, stoppable=True)
    assert inbox.take(time.monotonic()) == "later"


def test_a_wait_ends_in_time() -> None:
    inbox: Inbox[str] = Inbox()
    began_s = time.monotonic()
    assert not inbox.wait(lambda: False, began_s + 0.05, stoppable=True)
    assert inbox.take(began_s + 0.1) is None
    assert 0.1 <= time.monotonic() - began_s < 10.0


def test_a_request_to_stop_ends_what_may_be_stopped_and_a_second_one_hurries(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(module, "_TOGETHER_S", 60.0)
    inbox: Inbox[str] = Inbox()
    inbox.put("never dealt with")
    inbox.ask("SIGINT")
    assert inbox.closing
    assert inbox.take() is None
    assert not inbox.wait(lambda: False, time.monotonic() + 60.0, stoppable=True)
    inbox.ask("SIGINT")  # forwarded by somebody who got the same one
    assert (inbox.reason, inbox.hurry) == ("SIGINT", False)
    monkeypatch.setattr(module, "_TOGETHER_S", 0.1)
    until_s = time.monotonic() + 20.0
    while not inbox.hurry and time.monotonic() < until_s:
        inbox.ask("SIGTERM")
    assert (inbox.reason, inbox.hurry) == ("SIGINT", True)
    began_s = time.monotonic()
    assert not inbox.wait(lambda: False, began_s + 60.0, stoppable=False)
    assert time.monotonic() - began_s < 10.0


@pytest.mark.parametrize("left_s", [1e9, math.inf])
def test_an_end_may_be_years_away(left_s: float) -> None:
    inbox: Inbox[str] = Inbox()
    inbox.wake()
    assert inbox.bell.wait(time.monotonic() + left_s)
    assert not inbox.bell.wait(time.monotonic() + 0.01)
