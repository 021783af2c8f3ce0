"""``compose restart``: restart nodes of a running system."""

from __future__ import annotations

from typing import Annotated

import typer

from composer.cli.support.completion import complete_node
from composer.cli.support.errors import FAILED, CommandError
from composer.cli.support.options import Timeout, examples
from composer.cli.support.output.terminal import lines, say, write
from composer.cli.support.ros import ros_session

#: As long as the transitions of a node may take by default, with a margin.
_TIMEOUT_S = 30.0

EPILOGS = {
    "restart": examples(
        "compose restart planner",
        "compose restart planner motor_controller    several nodes",
        "compose restart '/perception/*'             all nodes that match",
    )
}


def restart(
    nodes: Annotated[
        list[str],
        typer.Argument(
            metavar="NODE...",
            help="Nodes of running systems: full names, last parts of names, or patterns.",
            show_default=False,
            autocompletion=complete_node,
        ),
    ],
    timeout: Timeout = _TIMEOUT_S,
) -> None:
    """Restart nodes of a running system.

    The nodes are deactivated and cleaned up, and brought up again to the states that they had; a
    node that has failed or was shut down is started. Active nodes that depend on them are
    deactivated first, and activated again afterwards. Parameters keep their values, and YAML files
    are not read again.

    Exit code 1 if a node does not come up again.
    """
    failed = False
    with ros_session("compose restart", timeout) as (session, deadline):
        from composer.client.systems.managed_nodes import find_managed_nodes
        from composer.client.systems.managers import Systems

        systems = Systems(session, deadline)
        for system, found in find_managed_nodes(session, deadline, systems, nodes).items():
            success, message = systems.restart(system, found)
            names = ", ".join(found)
            if success:
                write(lines([f"{names}: restarted ({message})"]))
            else:
                failed = True
                hint = f"see 'compose logs --system {system}'; 'compose ps' shows all nodes"
                say(CommandError(f"{names}: the restart failed: {message}", hint=hint).text())
    if failed:
        raise typer.Exit(FAILED)
