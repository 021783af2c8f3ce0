"""A step that arrives twice or too late is not run."""

from __future__ import annotations

import pytest

from composer.runtime.manager.member_service import ReceivedSteps
from composer.runtime.manager.publishing import ReportTimes
from composer.runtime.protocol.requests import Step

FIRST, SECOND = (Step(number, "activate", "/arm") for number in (1, 2))
OF_LEG = Step(1, "activate", "/leg")


def test_a_step_that_arrives_again_is_found() -> None:
    steps = ReceivedSteps[str]()
    assert steps.find("ab", FIRST) is None
    steps.add("ab", FIRST, "configure")
    assert steps.find("ab", FIRST) == "configure"
    assert steps.find("ab", OF_LEG) is None
    assert steps.find("cd", FIRST) is None
    assert steps.of(["/arm", "/leg"]) == ["configure"]


def test_a_step_is_replaced_by_the_next_one_of_its_node_from_the_same_sender() -> None:
    steps = ReceivedSteps[str]()
    assert not steps.is_replaced("ab", FIRST)
    steps.add("ab", SECOND, "activate")
    assert steps.is_replaced("ab", FIRST)
    assert not steps.is_replaced("ab", SECOND)
    assert not steps.is_replaced("ab", OF_LEG)
    assert not steps.is_replaced("cd", FIRST)  # another coordinating process


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
