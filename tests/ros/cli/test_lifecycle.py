"""The commands of ``compose lifecycle`` to a running system: to all, several and single nodes."""

from __future__ import annotations

from tests.ros.support.background import (
    Robot,
    lifecycle_set,
    moved,
    refused,
    set_fault,
)
from tests.ros.support.commands import (
    compose,
    expect_error,
    listed,
    output_of,
    repeated_until,
)
from tests.ros.support.in_process import wait_until


def test_commands_to_a_whole_system(robot: Robot) -> None:
    def sent(verb: str, system: object) -> str:
        return repeated_until(bool, "lifecycle", verb, system)

    none, two = (f"/fleet/robot: {count} of 3 nodes active\n" for count in (0, 2))
    assert refused("lifecycle", "pause", "zebra").endswith("\n  available: /fleet/robot\n")
    assert sent("pause", "robot") == none
    assert robot.states() == dict.fromkeys(robot.states(), "inactive")
    assert sent("resume", "/fleet/robot") == two
    assert sent("reset", robot.path) == none
    assert robot.states() == dict.fromkeys(robot.states(), "unconfigured")

    set_fault("configure")
    failed = "compose: /fleet/robot did not come up: /fleet/planner"
    cause = "configure failed: ValueError: no map"
    refusal = refused("lifecycle", "startup", "robot", "--all-or-nothing")
    assert refusal.startswith(f"{failed}: {cause}; rolled back")
    assert robot.states() == dict.fromkeys(robot.states(), "unconfigured")
    assert refused("lifecycle", "startup", "robot").startswith(
        f"{failed} failed; 0 of 3 nodes active, /fleet/planner is isolated: {cause}\n"
    )
    set_fault("none")
    assert sent("startup", "robot") == two
    hint = refused("lifecycle", "startup", "rowbot").splitlines()[1]
    assert hint == "  did you mean '/fleet/robot'?"


def test_nodes_are_restarted_in_order_with_their_dependents(robot: Robot) -> None:
    before = len(robot.messages("/fleet/motor active", robot.text.partition(" (")[0]))
    assert repeated_until(bool, "lifecycle", "restart", "planner") == (
        "/fleet/planner: restarted (2 of 3 nodes active)\n"
    )
    requested = "restart of /fleet/planner requested"
    wait_until(lambda: len(robot.messages(requested)) >= before + 8, "the log of the restart")
    assert robot.messages()[before:] == [
        requested,
        "/fleet/motor inactive",
        "/fleet/planner inactive",
        "/fleet/planner unconfigured",
        "/fleet/planner inactive",
        "/fleet/planner active",
        "go",
        "/fleet/motor active",
    ]
    moved("planner", "shutdown")
    assert robot.states()["/fleet/planner"] == "finalized"
    assert repeated_until(bool, "lifecycle", "restart", "*/planner", "camera") == (
        "/fleet/planner, /fleet/camera: restarted (2 of 3 nodes active)\n"
    )
    assert robot.states()["/fleet/motor"] == "active"
    assert robot.states()["/fleet/camera"] == "inactive"
    set_fault("configure")
    refusal = refused("lifecycle", "restart", "planner")
    assert "/fleet/planner: the restart failed: /fleet/planner: configure failed: " in refusal
    listed(("no map",), "logs", "planner", "--level", "error")
    expect_error("did you mean '/fleet/planner'?", "lifecycle", "restart", "planer")
    assert "no line of" not in output_of("logs", "-n", 3, "motor", "--since", "10m")


def test_lifecycle_set_with_dependents_several_nodes_and_patterns(robot: Robot) -> None:
    done = lifecycle_set("planner", "deactivate")
    assert (done.returncode, done.stdout) == (0, "/fleet/planner: active -> inactive\n")
    assert done.stderr == (
        "note: active nodes depend on this: /fleet/motor; --dependents deactivates them first\n"
    )
    assert robot.states()["/fleet/motor"] == "active"
    done = lifecycle_set("planner", "activate")
    assert (done.returncode, done.stderr) == (0, "")
    text = moved("planner", "--to", "unconfigured", "--dependents")
    assert text.splitlines() == [
        "/fleet/motor: active -> inactive",
        "/fleet/planner: active -> unconfigured",
    ]
    text = moved("planner", "--to", "active", "--dependents")
    assert text.splitlines() == [
        "/fleet/planner: unconfigured -> active",
        "/fleet/motor: inactive -> active",
    ]

    text = moved("motor", "planner", "deactivate")
    assert text == "/fleet/motor: active -> inactive\n/fleet/planner: active -> inactive\n"
    text = moved("/fleet/[mp]*", "--to", "active")
    assert text == "/fleet/motor: inactive -> active\n/fleet/planner: inactive -> active\n"
    moved("/fleet/[mp]*", "--to", "inactive")
    done = lifecycle_set("camera", "planner", "cleanup")
    assert done.returncode == 0
    done = lifecycle_set("camera", "motor", "cleanup")
    assert (done.returncode, done.stdout) == (1, "/fleet/motor: inactive -> unconfigured\n")
    assert "'cleanup' is not possible: /fleet/camera is unconfigured" in done.stderr
    assert "available transitions: configure, shutdown" in done.stderr
    unknown = "there is no lifecycle node matching 'x*'"
    expect_error(unknown, "lifecycle", "set", "x*", "cleanup")
    moved("camera", "--to", "finalized")
    final = "'active' cannot be reached: /fleet/camera is finalized"
    expect_error(final, "lifecycle", "set", "camera", "--to", "active")
    for arguments in (["motor"], ["--to", "active"]):
        assert compose("lifecycle", "set", *arguments).returncode in (1, 2)
