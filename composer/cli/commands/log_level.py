"""``compose log-level``: the log levels of running nodes."""

from __future__ import annotations

from typing import Annotated

import typer

from composer.cli.commands.nodes import AnyNode
from composer.cli.support.options import DEFAULT_TIMEOUT_S, Json, Timeout, examples
from composer.cli.support.ros import ros_session
from composer.cli.support.terminal import write_list
from composer.model import LogLevel

EPILOG = examples(
    "compose log-level                 the levels of all nodes",
    "compose log-level planner         the level of a node",
    "compose log-level planner debug   set it",
)


def log_level(
    node: AnyNode = None,
    level: Annotated[
        LogLevel | None,
        typer.Argument(
            metavar="[LEVEL]", help="debug, info, warn, error or fatal. Default: print it."
        ),
    ] = None,
    *,
    json: Json = False,
    timeout: Timeout = DEFAULT_TIMEOUT_S,
) -> None:
    """Print or set the log levels of running nodes.

    It works in every lifecycle state. The level stays until the process of the node ends, also if
    the node is restarted. Programs need the logger services of rclpy or rclcpp.
    """
    with ros_session("compose log-level", timeout) as (session, deadline):
        from composer.client.logger_levels import LoggerLevels

        levels = LoggerLevels(session, deadline)
        found: dict[str, str | None]
        if node is None:
            found = levels.all()
        elif level is None:
            found = dict([levels.get(node)])
        else:
            found = {levels.set(node, level): level.value}
    rows = [(name, text or "(no response)") for name, text in found.items()]
    write_list("node", rows, found, json=json)
