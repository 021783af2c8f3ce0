"""Commands to running systems: ``compose down``, and commands of ``compose lifecycle``."""

from __future__ import annotations

from typing import Annotated, NamedTuple

import typer

from composer.cli.support.completion import complete_node
from composer.cli.support.errors import FAILED, CommandError
from composer.cli.support.options import CHANGE_TIMEOUT_S, AllOrNothing, Timeout, examples
from composer.cli.support.ros import ros_session
from composer.cli.support.system_arguments import RunningSystem, running_system_name
from composer.cli.support.terminal import lines, say, write

EPILOG = examples(
    "compose down pipeline",
    "compose down systems/pipeline.yaml",
    "compose down /robot1/pipeline",
)


def down(system: RunningSystem, timeout: Timeout = CHANGE_TIMEOUT_S) -> None:
    """Shut down a running system and its process.

    The nodes are shut down in the reverse order of the bring-up.
    """
    name = running_system_name(system)
    with ros_session("compose down", timeout) as (session, deadline):
        from composer.client.systems.managers import Systems

        systems = Systems(session, deadline)
        full_name = systems.find(name)
        message = systems.shut_down(full_name)
    write(lines([f"{full_name}: {message}"]))


class _Verb(NamedTuple):
    """A command to a running system: the service of its manager, and what to print."""

    help: str
    failure: str
    brings_up: bool = False


#: As in nav2's lifecycle manager.
_VERBS = {
    "startup": _Verb(
        """Bring up the nodes of a running system.

        Each node is brought up to its autostart state. Nodes that failed before are retried.
        """,
        "did not come up",
        brings_up=True,
    ),
    "pause": _Verb(
        """Deactivate all nodes of a running system.

        The nodes are deactivated in the reverse order of the bring-up.
        """,
        "did not pause",
    ),
    "resume": _Verb(
        """Activate the inactive nodes of a running system.

        The nodes are activated in the order of the bring-up.
        """,
        "did not resume",
        brings_up=True,
    ),
    "reset": _Verb(
        """Return all nodes of a running system to the state unconfigured.

        Failures are cleared. Use 'compose lifecycle startup' to bring the nodes up again.

        Parameters keep their values, and files are not read again. To apply changes of files, use
        'compose down', then 'compose run'.
        """,
        "did not reset",
    ),
}


def add_system_commands(app: typer.Typer) -> None:
    """Add the commands."""
    for name, verb in _VERBS.items():
        _add_verb(app, name, verb)
    epilog = examples(
        "compose lifecycle restart planner",
        "compose lifecycle restart planner motor_controller    several nodes",
        "compose lifecycle restart '/perception/*'             all nodes that match",
    )
    app.command("restart", epilog=epilog)(restart)


def _add_verb(app: typer.Typer, name: str, verb: _Verb) -> None:
    def change(system: RunningSystem, timeout: Timeout = CHANGE_TIMEOUT_S) -> None:
        _change_system(name, system, timeout, verb.failure)

    def bring_up(
        system: RunningSystem,
        *,
        all_or_nothing: AllOrNothing = False,
        timeout: Timeout = CHANGE_TIMEOUT_S,
    ) -> None:
        from composer.runtime.protocol.requests import ALL_OR_NOTHING

        service = f"{name}{ALL_OR_NOTHING}" if all_or_nothing else name
        _change_system(service, system, timeout, verb.failure)

    command = f"compose lifecycle {name}"
    epilog = examples(
        f"{command} pipeline", f"{command} systems/pipeline.yaml", f"{command} /robot1/pipeline"
    )
    register = app.command(name, help=verb.help, epilog=epilog)
    register(bring_up if verb.brings_up else change)


def _change_system(service: str, text: str, timeout_s: float, failure: str) -> None:
    """Call a service of the manager of a system and print its response. Raises CommandError."""
    name = running_system_name(text)
    with ros_session("compose lifecycle", timeout_s) as (session, deadline):
        from composer.client.systems.managers import Systems

        systems = Systems(session, deadline)
        system = systems.find(name)
        success, message = systems.command(system, service)
    if not success:
        hint = "see the log of the system; 'compose ps' shows the state of every node"
        raise CommandError(f"{system} {failure}: {message}", hint=hint)
    write(lines([f"{system}: {message}"]))


def restart(
    nodes: Annotated[
        list[str],
        typer.Argument(
            metavar="NODE...",
            help="Nodes of running systems: full names, last parts of names, or patterns.",
            autocompletion=complete_node,
        ),
    ],
    timeout: Timeout = 2 * CHANGE_TIMEOUT_S,  # down and up again
) -> None:
    """Restart nodes of a running system.

    The nodes are deactivated and cleaned up, and brought up again to the states that they had; a
    node that has failed or was shut down is started. Active nodes that depend on them are
    deactivated first, and activated again afterwards. Parameters keep their values, and YAML files
    are not read again.

    Exit code 1 if a node does not come up again.
    """
    failed = False
    with ros_session("compose lifecycle", timeout) as (session, deadline):
        from composer.client.systems.managers import Systems
        from composer.client.systems.process_list import find_managed_nodes

        systems = Systems(session, deadline)
        for system, names in find_managed_nodes(session, deadline, systems, nodes).items():
            success, message = systems.restart(system, names)
            listed = ", ".join(names)
            if success:
                write(lines([f"{listed}: restarted ({message})"]))
            else:
                failed = True
                hint = f"see 'compose logs --system {system}'; 'compose ps' shows all nodes"
                say(CommandError(f"{listed}: the restart failed: {message}", hint=hint).text())
    if failed:
        raise typer.Exit(FAILED)
