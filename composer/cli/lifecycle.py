"""``compose lifecycle``: the states of nodes in other processes, and transitions between them."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Annotated

import typer

from composer.cli.help import examples
from composer.cli.ros import DEFAULT_TIMEOUT_S, Timeout, ros_session
from composer.cli.terminal import columns, write

if TYPE_CHECKING:
    from composer.runtime.control import Control

app = typer.Typer(
    help="""See and change the lifecycle state of running nodes, from another terminal.

    Works for every lifecycle node in the ROS graph, whoever wrote it.
    """,
    epilog=examples(
        "compose lifecycle nodes",
        "compose lifecycle get planner",
        "compose lifecycle list planner",
        "compose lifecycle set planner deactivate",
    ),
    no_args_is_help=True,
    rich_markup_mode=None,
)

NodeName = Annotated[
    str,
    typer.Argument(
        metavar="NODE",
        help="A full name (/planning/planner), or the last part of just one (planner).",
        show_default=False,
    ),
]
Json = Annotated[bool, typer.Option("--json", help="Print JSON, for programs.")]


@contextmanager
def _control(timeout_s: float) -> Iterator[Control]:
    with ros_session("compose lifecycle", timeout_s) as (session, deadline):
        from composer.runtime.control import Control

        yield Control(session, deadline)


@app.command("nodes", epilog=examples("compose lifecycle nodes", "compose lifecycle nodes --json"))
def nodes(timeout: Timeout = DEFAULT_TIMEOUT_S, as_json: Json = False) -> None:
    """List the lifecycle nodes and their states."""
    with _control(timeout) as control:
        states = control.states(control.nodes())
    if as_json:
        write(json.dumps(states, indent=2))
    elif states:
        write(columns([(name, state or "(no answer)") for name, state in states.items()]))


@app.command(
    "get",
    epilog=examples(
        "compose lifecycle get planner", "compose lifecycle get /planning/planner --timeout 1"
    ),
)
def get(node: NodeName, timeout: Timeout = DEFAULT_TIMEOUT_S) -> None:
    """Print the state of a node."""
    with _control(timeout) as control:
        write(control.state(control.find(node)))


@app.command("list", epilog=examples("compose lifecycle list planner"))
def list_transitions(
    node: NodeName, timeout: Timeout = DEFAULT_TIMEOUT_S, as_json: Json = False
) -> None:
    """List the transitions that are possible now."""
    with _control(timeout) as control:
        transitions = control.transitions(control.find(node))
    if as_json:
        found = [{"id": item.id, "label": item.label, "goal": item.goal} for item in transitions]
        write(json.dumps(found, indent=2))
    elif transitions:
        write("\n".join(item.label for item in transitions))


@app.command(
    "set",
    epilog=examples(
        "compose lifecycle set planner deactivate", "compose lifecycle set planner activate"
    ),
)
def set_state(
    node: NodeName,
    transition: Annotated[
        str,
        typer.Argument(
            metavar="TRANSITION",
            help="configure, activate, deactivate, cleanup or shutdown.",
            show_default=False,
        ),
    ],
    timeout: Timeout = DEFAULT_TIMEOUT_S,
) -> None:
    """Take a node through a transition.

    What is not possible in the node's state is refused with exit code 1 and never sent.
    """
    with _control(timeout) as control:
        change = control.change(control.find(node), transition)
    write(f"{change.node}: {change.before} -> {change.after}")
