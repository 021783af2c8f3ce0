"""A step that arrives twice or too late is not run."""

from __future__ import annotations

import pytest

from composer.runtime.manager.received_steps import ReceivedSteps, ReportTimes, StepId

FIRST, SECOND = StepId("ab", 1), StepId("ab", 2)


def test_a_step_that_arrives_again_is_found() -> None:
    steps = ReceivedSteps[str]()
    assert steps.find("/arm", FIRST) is None
    steps.add("/arm", FIRST, "configure")
    assert steps.find("/arm", FIRST) == "configure"
    assert steps.find("/leg", FIRST) is None
    assert steps.last_text == "ab 1"
    assert steps.of(["/arm", "/leg"]) == ["configure"]


def test_a_step_is_replaced_by_the_next_one_of_its_node_from_the_same_sender() -> None:
    steps = ReceivedSteps[str]()
    assert not steps.is_replaced("/arm", FIRST)
    steps.add("/arm", SECOND, "activate")
    assert steps.is_replaced("/arm", FIRST)
    assert not steps.is_replaced("/arm", SECOND)
    assert not steps.is_replaced("/leg", FIRST)
    assert not steps.is_replaced("/arm", StepId("cd", 1))  # another coordinating process


def test_steps_without_a_number_are_always_new() -> None:
    steps = ReceivedSteps[str]()
    steps.add("/arm", None, "configure")
    assert steps.find("/arm", None) is None
    assert not steps.is_replaced("/arm", None)
    assert not steps.is_replaced("/arm", FIRST)
    assert steps.last_text == ""


@pytest.mark.parametrize(
    ("seen", "at_s", "is_outdated"),
    [
        (1, 100.0, False),  # the current one
        (1, 106.0, False),
        (1, 106.5, True),  # the process was stopped since then
        (0, 100.0, True),  # not known, or of another life
    ],
)
def test_a_request_is_as_old_as_the_report_that_its_sender_has_seen(
    seen: int, at_s: float, *, is_outdated: bool
) -> None:
    reports = ReportTimes()
    reports.note(1, 100.0)
    assert reports.is_outdated(seen, at_s) is is_outdated


def test_a_report_that_no_other_has_followed_is_not_old() -> None:
    """Without subscriptions, nothing is published: a new one gets the last report."""
    reports = ReportTimes()
    for second in range(20):
        reports.note(1, 100.0 + second)
    assert not reports.is_outdated(1, 120.0)
    reports.note(2, 120.0)
    assert not reports.is_outdated(1, 121.0)
    reports.note(3, 130.0)
    assert reports.is_outdated(1, 131.0)
    assert reports.is_outdated(2, 131.0)
    assert not reports.is_outdated(3, 131.0)
