"""When steps are requested again, and which of them have certainly not arrived."""

from __future__ import annotations

import pytest

from composer.plan import SystemGoals
from composer.runtime.members.requested_steps import MemberRequest, RequestedStep
from composer.runtime.protocol.requests import Step, StepResult

RESULT = StepResult(success=True)


def request(count: int = 3) -> MemberRequest:
    steps = (Step(number + 1, "activate", f"/node{number}") for number in range(count))
    return MemberRequest(list(map(RequestedStep, steps)), seen=10)


def test_only_steps_without_a_result_are_requested_again_later_each_time() -> None:
    first = request()
    assert first.is_awaited
    first.steps[0].result.set_result(RESULT)
    first.steps[1].result.cancel()  # nothing waits for it
    second = first.again(13)
    assert [str(item.step) for item in second.steps] == ["activate /node2"]
    assert second.steps[0] is first.steps[2]  # with the same number
    assert second.again_after_s == 2.0 * first.again_after_s
    assert second.seen == 13
    first.steps[2].result.set_result(RESULT)
    assert not first.is_awaited
    assert not second.is_awaited


@pytest.mark.parametrize(
    ("received", "seen", "is_lost"),
    [
        (0, 11, False),  # that report may be older than the arrival of the request
        (0, 12, True),
        (2, 12, True),  # the third one
        (3, 12, False),  # it takes time, or its response was lost
    ],
)
def test_a_request_is_lost_if_reports_do_not_know_its_steps(
    received: int, seen: int, *, is_lost: bool
) -> None:
    assert request().is_lost(received, seen) is is_lost


def test_a_request_whose_last_steps_have_results_is_not_lost() -> None:
    sent = request()
    sent.steps[2].result.set_result(RESULT)
    assert not sent.is_lost(2, 20)


def test_goals_are_not_awaited() -> None:
    assert not MemberRequest(goals=SystemGoals(1, "running")).is_awaited
