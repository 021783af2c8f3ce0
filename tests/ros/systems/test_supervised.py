"""The supervised system: a sensor falls silent, and its dependents wait until it is restarted."""

from __future__ import annotations

import re

from std_srvs.srv import Trigger

from tests.ros.support.in_process import end_limit_s
from tests.ros.support.system_process import ExternalNode, RunningSystem

#: The planner uses every tenth scan and comes up after the sensor, so it may miss the first scans.
PLANS = r"\[planner\] planning with scan [12]\d$"
FAILS = r"/sensor failed: silent for 1000 ms; restart 1 in 0\.5 s$"
DOWN = r"/sensor unconfigured$"
RESTART = (
    r"/sensor active$",
    r"/planner active$",
    r"/sensor is up again after restart 1$",
    r"\[planner\] planning with scan 1?\d$",
)
IN_ORDER = (
    *(PLANS, FAILS),
    *(r"/planner inactive$", r"/sensor inactive$", DOWN),
    *RESTART,
)
#: If the sensor has a process of its own, that takes it down at once, before the planner waits.
IN_ORDER_OVER_PROCESSES = (
    *(PLANS, DOWN, FAILS, r"/planner inactive$"),
    *RESTART,
)


def test_a_silent_sensor_is_restarted_and_the_planner_waits(external: ExternalNode) -> None:
    with RunningSystem("systems/supervised.yaml") as system:
        up_again = system.lines.index(system.wait_for("/sensor is up again after restart 1$"))
        external.spin_until(
            lambda: any(re.search(RESTART[-1], line) for line in system.lines[up_again:])
        )
        # Four seconds later the sensor is silent once more, and up again after another second.
        answers: list[Trigger.Response] = []
        external.spin_until(lambda: is_active(external, answers))
        assert answers[-1].message == "3 of 3 nodes active"
        code, took_s = system.stop()
    assert code == 0
    assert took_s < end_limit_s()
    is_split = "processes:" in system.path.read_text(encoding="utf-8")
    lines = iter(system.lines)
    for expected in IN_ORDER_OVER_PROCESSES if is_split else IN_ORDER:
        assert any(re.search(expected, line) for line in lines), expected
    camera = [line for line in system.lines if line.endswith("/camera inactive")]
    assert len(camera) == 2, "once during bring-up, once during tear-down"


def is_active(external: ExternalNode, answers: list[Trigger.Response]) -> bool:
    name = "/supervised/manager/is_active"
    answers.append(external.call(Trigger, name, Trigger.Request()))
    return bool(answers[-1].success)
