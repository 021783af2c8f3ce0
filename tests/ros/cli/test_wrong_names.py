"""Error messages for unknown types, names and fields."""

from __future__ import annotations

import pytest

from tests.ros.support.commands import error, expect_error, expect_errors

pytestmark = pytest.mark.usefixtures("talker")

AT_ONCE = ("--once", "-w", "0")


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (("topic", "pub", "/lab/in", "String", *AT_ONCE), "did you mean 'std_msgs/msg/String'?"),
        (("topic", "pub", "/lab/in", "std_msgs/msg/Strin"), "did you mean 'std_msgs/msg/String'?"),
        (("topic", "pub", "/lab/in", "nowhere/msg/Text"), "install the package that defines it"),
        (("topic", "pub", "/lab/in", "std_srvs/srv/SetBool"), "is not a message type"),
        (("topic", "echo", "/lab/in", "std_srvs/srv/SetBool"), "is not a message type"),
        (("service", "call", "/lab/add", "std_msgs/msg/String"), "is not a service type"),
        (("action", "send-goal", "/lab/navigate", "std_srvs/srv/SetBool"), "is not an action type"),
    ],
)
def test_unknown_types(arguments: tuple[str, ...], text: str) -> None:
    expect_error(text, *arguments)


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
def test_invalid_names(arguments: tuple[str, ...]) -> None:
    assert f"{arguments[0]} name '/{arguments[2]}' contains a space" in error(*arguments)


def test_types_that_other_nodes_do_not_use() -> None:
    number, text, truth = (f"std_msgs/msg/{name}" for name in ("Int32", "String", "Bool"))
    switch, trigger = "std_srvs/srv/SetBool", "std_srvs/srv/Trigger"
    echo, publish = ("topic", "echo", "/lab/count"), ("topic", "pub", "/lab/count")
    call = ("service", "call", "/lab/add")
    expect_errors(
        (f"other nodes use type {number}, not {text}\n", *echo, text, "--timeout", "5"),
        (f"other nodes use type {number}, not {truth}\n", *publish, truth, "--once"),
        (f"other nodes use type {switch}, not {trigger}\n", *call, trigger),
    )
