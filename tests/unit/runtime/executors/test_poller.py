"""Waiting for eventfds and for a time."""

from __future__ import annotations

import os
import threading
from collections.abc import Iterator
from math import inf
from time import monotonic

import pytest

from composer.runtime.clock import COMPUTER
from composer.runtime.executors import poller as module
from composer.runtime.executors.poller import Poller

_LONG_S = 30.0


@pytest.fixture(params=["with epoll_pwait2", "without"])
def poller(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> Poller:
    if request.param == "without":  # as on Linux before 5.11
        monkeypatch.setattr(module, "HAS_PWAIT2", False)
    elif not module.HAS_PWAIT2:
        pytest.skip("this Linux has no epoll_pwait2")
    return Poller(COMPUTER)


@pytest.fixture
def written() -> Iterator[int]:
    fd = os.eventfd(1)
    yield fd
    os.close(fd)


@pytest.mark.parametrize("wait_s", [0.0003, 0.02, 1.01])
def test_waits_until_the_time_has_come(poller: Poller, wait_s: float) -> None:
    until_s = monotonic() + wait_s
    poller.wait(until_s)
    assert monotonic() >= until_s


def test_a_wait_is_not_rounded_to_milliseconds(poller: Poller) -> None:
    took_s = 1.0
    while took_s > 0.0009:  # on a busy machine, many waits are longer
        began_s = monotonic()
        poller.wait(began_s + 0.0003)
        took_s = monotonic() - began_s


def test_a_wait_that_was_woken_can_continue_until_the_time_has_come(
    poller: Poller, written: int
) -> None:
    poller.register(written)
    for _ in range(2):  # two times, each waited for more than once
        until_s = monotonic() + 0.05
        for _ in range(3):
            os.eventfd_write(written, 1)
            assert [fd for fd, _ in poller.wait(until_s)] == [written]
            os.eventfd_read(written)
        while monotonic() < until_s:
            assert written not in [fd for fd, _ in poller.wait(until_s)]
        assert monotonic() < until_s + _LONG_S


def test_a_time_may_be_past_or_far_in_the_future(poller: Poller, written: int) -> None:
    poller.wake()
    poller.wait(1e300)  # returns
    poller.register(written)
    assert [fd for fd, _ in poller.wait(monotonic() - 1.0)] == [written]


@pytest.mark.parametrize("until_s", [0.0, _LONG_S, inf])
def test_reports_written_data_until_it_is_read(
    poller: Poller, written: int, until_s: float
) -> None:
    poller.register(written)
    for _ in range(2):
        assert [fd for fd, _ in poller.wait(monotonic() + until_s)] == [written]
    os.eventfd_read(written)
    assert not poller.poll()
    poller.unregister(written)
    os.eventfd_write(written, 1)
    assert not poller.poll(), "it is not registered any more"


@pytest.mark.parametrize("until_s", [_LONG_S, inf])
def test_a_wake_up_before_or_during_the_wait_ends_it(poller: Poller, until_s: float) -> None:
    began_s = monotonic()
    poller.wake()
    poller.wait(began_s + until_s)
    waker = threading.Timer(0.02, poller.wake)
    waker.start()
    poller.wait(began_s + until_s)
    assert monotonic() - began_s < _LONG_S / 2
    waker.join()
