"""What commands say to types, names and fields that nothing in the ROS graph has."""

from __future__ import annotations

import pytest

from tests.ros.support.commands import PATIENCE_S, error, start

pytestmark = pytest.mark.usefixtures("talker")

AT_ONCE = ("--once", "-w", "0")


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (("topic", "pub", "/lab/in", "String", *AT_ONCE), "did you mean 'std_msgs/msg/String'?"),
        (("topic", "pub", "/lab/in", "std_msgs/msg/Strin"), "did you mean 'std_msgs/msg/String'?"),
        (("topic", "pub", "/lab/in", "nowhere/msg/Text"), "must be installed here"),
        (("topic", "pub", "/lab/in", "std_srvs/srv/SetBool"), "is no message type"),
        (("topic", "echo", "/lab/in", "std_srvs/srv/SetBool"), "is no message type"),
        (("service", "call", "/lab/add", "std_msgs/msg/String"), "is no service type"),
        (("action", "send-goal", "/lab/navigate", "std_srvs/srv/SetBool"), "is no action type"),
    ],
)
def test_a_type_that_cannot_be_meant(arguments: tuple[str, ...], told: str) -> None:
    assert told in error(*arguments)


@pytest.mark.parametrize(
    "arguments",
    [
        ("topic", "echo", "a topic", "std_msgs/msg/String"),
        ("topic", "hz", "a topic"),
        ("topic", "info", "a topic"),
        ("topic", "pub", "a topic", "std_msgs/msg/String"),
        ("service", "call", "a service", "std_srvs/srv/SetBool"),
        ("action", "send-goal", "an action", "composer_interfaces/action/Navigate"),
    ],
)
def test_a_name_that_ros_does_not_take(arguments: tuple[str, ...]) -> None:
    assert f"{arguments[0]} name '/{arguments[2]}' contains a space" in error(*arguments)


def test_a_type_that_others_do_not_use() -> None:
    number, text, truth = (f"std_msgs/msg/{name}" for name in ("Int32", "String", "Bool"))
    switch, trigger = "std_srvs/srv/SetBool", "std_srvs/srv/Trigger"
    begun = {  # side by side, for each waits as long as it may
        start("topic", "echo", "/lab/count", text, "--timeout", "5"): (number, text),
        start("topic", "pub", "/lab/count", truth, "--once"): (number, truth),
        start("service", "call", "/lab/add", trigger): (switch, trigger),
    }
    for process, (there, given) in begun.items():
        output, told = process.communicate(timeout=PATIENCE_S)
        assert (process.returncode, output) == (1, "")
        assert "here it is of type" in told
        assert there in told
        assert f", not {given}\n" in told


def test_a_field_that_is_almost_right() -> None:
    wrong = ("topic", "pub", "/lab/in", "std_msgs/msg/String", "{dta: hello}", *AT_ONCE)
    assert "did you mean 'data'?" in error(*wrong)
