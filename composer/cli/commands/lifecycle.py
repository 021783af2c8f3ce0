"""``compose lifecycle``: lifecycle states of running nodes, and systems as a whole; ``down``."""

from __future__ import annotations

from collections.abc import Mapping
from enum import StrEnum
from typing import TYPE_CHECKING, Annotated, NamedTuple

import typer

from composer.cli.commands.nodes import NodeName
from composer.cli.support.completion import complete_node
from composer.cli.support.errors import FAILED, CommandError, UsageError
from composer.cli.support.options import (
    CHANGE_TIMEOUT_S,
    DEFAULT_TIMEOUT_S,
    AllOrNothing,
    Json,
    Timeout,
    command_group,
    examples,
)
from composer.cli.support.ros import require_ros, ros_session
from composer.cli.support.system_arguments import RunningSystem, running_system_name
from composer.cli.support.terminal import as_json, lines, say, write, write_list
from composer.model.lifecycle import TRANSITIONS

if TYPE_CHECKING:
    from composer.client.lifecycle import LifecycleBatch


lifecycle_app = command_group(
    """Show and change lifecycle states of running nodes.

    'nodes', 'get', 'list' and 'set' work with every lifecycle node in the ROS graph. The others
    send a command to a running system, which moves its nodes in order and applies their
    'on_failure'.
    """
)

_EXAMPLE = "for example: compose lifecycle set planner deactivate"
EPILOG = examples(
    "compose down pipeline",
    "compose down systems/pipeline.yaml",
    "compose down /robot1/pipeline",
)


def _complete_word(incomplete: str) -> list[str]:
    transitions = [name for name in TRANSITIONS if incomplete and name.startswith(incomplete)]
    return [*complete_node(incomplete), *transitions]


@lifecycle_app.command(
    "nodes", epilog=examples("compose lifecycle nodes", "compose lifecycle nodes --json")
)
def nodes(timeout: Timeout = DEFAULT_TIMEOUT_S, json: Json = False) -> None:
    """List lifecycle nodes and their states.

    Exit code 1 if a system on this computer does not respond, because its nodes are missing then.
    """
    require_ros("compose lifecycle")
    from composer.client.systems.local_queries import local_states

    local = local_states(timeout)
    if local is not None:
        write_list("lifecycle node", _rows(local), local, json=json)
        return
    with ros_session("compose lifecycle", timeout) as (session, deadline):
        from composer.client.graph_names import check_all_respond
        from composer.client.lifecycle import LifecycleClient

        client = LifecycleClient(session, deadline)
        states = client.states(client.nodes())
        write_list("lifecycle node", _rows(states), states, json=json)
        check_all_respond(session)


def _rows(states: Mapping[str, str | None]) -> list[tuple[str, str]]:
    return [(name, state or "(no response)") for name, state in states.items()]


@lifecycle_app.command(
    "get",
    epilog=examples(
        "compose lifecycle get planner", "compose lifecycle get /planning/planner --timeout 1"
    ),
)
def get(node: NodeName, timeout: Timeout = DEFAULT_TIMEOUT_S) -> None:
    """Print the lifecycle state of a node."""
    require_ros("compose lifecycle")
    from composer.client.systems.local_queries import local_state

    state = local_state(node, timeout)
    if state is None:
        with ros_session("compose lifecycle", timeout) as (session, deadline):
            from composer.client.lifecycle import LifecycleClient

            client = LifecycleClient(session, deadline)
            state = client.state(client.find(node))
    write(lines([state]))


@lifecycle_app.command("list", epilog=examples("compose lifecycle list planner"))
def list_transitions(
    node: NodeName, timeout: Timeout = DEFAULT_TIMEOUT_S, json: Json = False
) -> None:
    """List the available transitions of a node."""
    with ros_session("compose lifecycle", timeout) as (session, deadline):
        from composer.client.lifecycle import LifecycleClient

        client = LifecycleClient(session, deadline)
        transitions = client.transitions(client.find(node))
    if json:
        data = [{"id": item.id, "label": item.label, "goal": item.goal} for item in transitions]
        write(as_json(data, indent=2))
    elif transitions:
        write(lines(item.label for item in transitions))


class GoalState(StrEnum):
    """The primary states."""

    UNCONFIGURED = "unconfigured"
    INACTIVE = "inactive"
    ACTIVE = "active"
    FINALIZED = "finalized"


@lifecycle_app.command(
    "set",
    epilog=examples(
        "compose lifecycle set planner deactivate",
        "compose lifecycle set planner motor_controller activate   several nodes",
        "compose lifecycle set '/perception/*' deactivate           all nodes that match",
        "compose lifecycle set planner --to active                  as many transitions as needed",
        "compose lifecycle set planner deactivate --dependents",
    ),
)
def set_state(
    words: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="TARGET... TRANSITION",
            help="Nodes (names or patterns), followed by configure, activate, deactivate, cleanup "
            "or shutdown. With --to, no transition is given.",
            autocompletion=_complete_word,
        ),
    ] = None,
    *,
    to: Annotated[
        GoalState | None,
        typer.Option(
            "--to",
            metavar="STATE",
            help="Go to this state: unconfigured, inactive, active or finalized.",
        ),
    ] = None,
    dependents: Annotated[
        bool,
        typer.Option(
            "--dependents",
            help="Move dependents as well: deactivate them before a node goes down, activate them "
            "after a node has come up.",
        ),
    ] = False,
    timeout: Timeout = DEFAULT_TIMEOUT_S,
) -> None:
    """Change the lifecycle state of nodes.

    The command moves only the given nodes. Active nodes that depend on them stay active; a note
    names them. If a transition is not available in the state of a node, the command reports this
    and continues with the other nodes. To move all nodes of a system, use startup, pause, resume
    or reset.

    Exit code 1 if a transition is not available or fails.
    """
    targets, transition = _split(list(words or ()), to)
    with ros_session("compose lifecycle set", timeout) as (session, deadline):
        from composer.client.lifecycle import LifecycleBatch, LifecycleClient, LifecycleRequest
        from composer.client.session import RosError

        request = LifecycleRequest(transition, None if to is None else to.value)
        batch = LifecycleBatch(LifecycleClient(session, deadline), targets, request)
        _check_dependents(batch, dependents=dependents)
        failed = False
        for outcome in batch.run(dependents=dependents):
            if isinstance(outcome, RosError):
                failed = True
                say(CommandError(str(outcome), hint=outcome.hint).text())
            else:
                write(lines([str(outcome)]))
    if failed:
        raise typer.Exit(FAILED)


def _check_dependents(batch: LifecycleBatch, *, dependents: bool) -> None:
    """Name the dependents that stay active. Raises CommandError if unknown ones should move."""
    if dependents and batch.silent_systems:
        silent = ", ".join(batch.silent_systems)
        raise CommandError(
            f"cannot find the dependents: {silent} does not respond",
            hint="without --dependents, only the given nodes are moved",
        )
    if batch.active_dependents and not dependents:
        names = ", ".join(batch.active_dependents)
        say(f"note: active nodes depend on this: {names}; --dependents deactivates them first")


def _split(words: list[str], to: GoalState | None) -> tuple[list[str], str | None]:
    """Return targets and transition. Raises UsageError."""
    transition = None
    if to is None:
        if not words:
            raise UsageError("specify a transition, or a state with --to", hint=_EXAMPLE)
        transition = words.pop()
    if not words:
        if transition is None or transition in TRANSITIONS:
            raise UsageError("specify nodes", hint=_EXAMPLE)
        raise UsageError(f"specify a transition of '{transition}'", hint=_EXAMPLE)
    return words, transition


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


def _add_verb(name: str, verb: _Verb) -> None:
    """Add a command to ``compose lifecycle``, below the commands of ros2."""

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
    register = lifecycle_app.command(name, help=verb.help, epilog=epilog)
    register(bring_up if verb.brings_up else change)


for _name, _verb in _VERBS.items():
    _add_verb(_name, _verb)


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


@lifecycle_app.command(
    "restart",
    epilog=examples(
        "compose lifecycle restart planner",
        "compose lifecycle restart planner motor_controller    several nodes",
        "compose lifecycle restart '/perception/*'             all nodes that match",
    ),
)
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
