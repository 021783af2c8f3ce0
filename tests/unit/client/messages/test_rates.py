from __future__ import annotations

import pytest

from composer.client.messages.rates import BandwidthWindow, DelayWindow, RateWindow


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
    assert BandwidthWindow(10).statistics(5.0) is None


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


def test_bandwidth_is_that_of_a_steady_topic_from_the_second_message_on() -> None:
    window = BandwidthWindow(100)
    for number in range(21):
        window.add(number / 10, 24)
        found = window.statistics(number / 10)
        assert found is None if number == 0 else found is not None
        assert found is None or found.bytes_per_s == pytest.approx(240.0)


def test_bandwidth_decreases_without_new_messages() -> None:
    window = BandwidthWindow(10)
    window.add(0.0, 100)
    window.add(1.0, 300)
    found = window.statistics(2.0)
    assert found is not None
    assert (found.bytes_per_s, found.mean, found.smallest, found.largest) == (
        150.0,
        200.0,
        100,
        300,
    )
    later = window.statistics(4.0)
    assert later is not None
    assert later.bytes_per_s == 75.0


def test_delay_statistics() -> None:
    delays = DelayWindow(2)
    assert delays.statistics() is None
    for delay_s in (9.0, 0.1, 0.3):
        delays.add(delay_s)
    found = delays.statistics()
    assert found is not None
    assert (found.shortest_s, found.longest_s, found.window) == (0.1, 0.3, 2)
    assert found.average_s == pytest.approx(0.2)
    assert found.deviation_s == pytest.approx(0.1)
