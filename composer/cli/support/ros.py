"""Commands that need ROS: what they say where it is missing, and what they share."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from typing import TYPE_CHECKING, Annotated

import typer

from composer.cli.support.failure import Failure
from composer.cli.support.finite import finite
from composer.cli.support.terminal import keep_stdout_for_data

if TYPE_CHECKING:
    from composer.model import Node, System
    from composer.remote.session import Deadline, Session

#: How long a command waits, all in all, for other processes.
Timeout = Annotated[
    float,
    typer.Option(
        "--timeout",
        metavar="SECONDS",
        min=0.0,
        callback=finite,
        help="How long to wait, all in all.",
    ),
]
DEFAULT_TIMEOUT_S = 5.0


def require_ros(command: str) -> None:
    """Raise a Failure where rclpy cannot be imported, or the environment does not let it start.

    To be called before anything imports rclpy, which may end the process.
    """
    if find_spec("rclpy") is None:
        raise Failure(
            f"'{command}' needs ROS 2, and rclpy is not installed in this Python",
            hint='pip install "ros2-composer[ros]"   or: source /opt/ros/jazzy/setup.bash',
        )
    keep_stdout_for_data()
    from composer.runtime.process import StartRefused
    from composer.runtime.process.environment import prepare_environment

    try:
        prepare_environment()
    except StartRefused as refusal:
        raise Failure(str(refusal), hint=refusal.hint) from refusal


def require_interfaces(system: System) -> None:
    """Raise a Failure where Python lacks types that ports have: their nodes would not come up."""
    from composer.doctor.interfaces import how_to_build

    users: dict[str, Node] = {}  # by the package: each is looked for once
    for node in system.nodes:
        for port in node.ports:
            users.setdefault(port.interface.value.partition("/")[0], node)
    for package, node in users.items():
        if find_spec(package) is None:
            raise Failure(
                f"interface package '{package}' of node '{node.name}' is not installed for"
                " this Python",
                hint=how_to_build(package),
            )


@contextmanager
def ros_session(
    command: str, timeout_s: float, *, carries_messages: bool = False
) -> Iterator[tuple[Session, Deadline]]:
    """Join the ROS graph for the length of a ``with`` block; errors of ROS become Failures.

    ``carries_messages`` says that messages of topics come or go, which may be large.
    """
    require_ros(command)
    from composer.remote.session import Deadline, RosError, Session, use_command_profile

    if not carries_messages:
        use_command_profile()
    deadline = Deadline(timeout_s)
    try:
        with Session() as session:
            yield session, deadline
    except RosError as error:
        raise Failure(str(error), hint=error.hint) from error
