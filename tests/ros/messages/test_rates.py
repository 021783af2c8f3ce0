from __future__ import annotations

import pytest

from composer.client.messages.topics import RateWindow


def test_rate_statistics() -> None:
    window = RateWindow(100)
    for at_s in (10.0, 10.1, 10.2, 10.5):
        window.add(at_s)
    rate = window.statistics()
    assert rate is not None
    assert rate.average_hz == pytest.approx(3 / 0.5)
    assert (rate.shortest_s, rate.longest_s) == (pytest.approx(0.1), pytest.approx(0.3))
    assert rate.deviation_s == pytest.approx(0.0942809)
    assert rate.window == 3


def test_too_few_messages_have_no_statistics() -> None:
    window = RateWindow(10)
    assert window.statistics() is None
    window.add(1.0)
    assert window.statistics() is None


def test_a_window_keeps_the_last_messages() -> None:
    window = RateWindow(2)
    for at_s in (0.0, 100.0, 100.5, 101.0):
        window.add(at_s)
    rate = window.statistics()
    assert rate is not None
    assert (rate.average_hz, rate.window) == (2.0, 2)


@pytest.mark.parametrize("size", [1, 4, 7, 100])
def test_bursts_have_the_rate_of_their_messages(size: int) -> None:
    window = RateWindow(size)
    for second in range(12):
        for at_s in (second, second + 0.0004):
            window.add(at_s)
            rate = window.statistics()
            assert (rate is None) == (second == 0)
            assert rate is None or rate.average_hz == pytest.approx(2.0)


def test_a_fast_topic_has_its_rate_with_a_small_window() -> None:
    window = RateWindow(3)
    for number in range(1000):
        window.add(number / 1000)
    rate = window.statistics()
    assert rate is not None
    assert (rate.average_hz, rate.window) == (pytest.approx(1000.0, rel=0.02), 3)
