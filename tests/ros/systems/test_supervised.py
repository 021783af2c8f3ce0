"""The supervised system: a sensor falls silent, and what needs it waits until it is back."""

from __future__ import annotations

from std_srvs.srv import Trigger

from tests.ros.systems.running import Outsider, RunningSystem

IN_ORDER = (
    "[planner] plans by scan 20",
    "/sensor failed: silent for 1000 ms; restart 1 in 0.5 s",
    "/planner inactive",
    "/sensor inactive",
    "/sensor unconfigured",
    "/sensor active",
    "/planner active",
    "/sensor is up again, restart 1",
    "[planner] plans by scan 0",
)


def test_a_silent_sensor_is_restarted_and_the_planner_waits(outsider: Outsider) -> None:
    with RunningSystem("systems/supervised.yaml") as system:
        system.wait_for("/sensor is up again, restart 1$")
        seen = len(system.lines)
        outsider.spin_until(lambda: "plans by scan 0" in "\n".join(system.lines[seen:]))
        active = outsider.call(Trigger, "/supervised/manager/is_active", Trigger.Request())
        assert (active.success, active.message) == (True, "3 of 3 nodes active")
        code, took_s = system.stop()
    assert (code, took_s < 2.0) == (0, True)
    lines = iter(system.lines)
    for expected in IN_ORDER:
        assert any(line.endswith(expected) for line in lines), expected
    camera = [line for line in system.lines if line.endswith("/camera inactive")]
    assert len(camera) == 2, "once on its way up, once on its way down: it did not notice"
