"""``compose lifecycle``: the states of nodes in other processes, and transitions between them."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import contextmanager
from enum import StrEnum
from typing import TYPE_CHECKING, Annotated

import typer

from composer.cli.support.failure import FINDINGS, Failure, UsageFailure
from composer.cli.support.help import examples
from composer.cli.support.listing import say_none_found
from composer.cli.support.ros import DEFAULT_TIMEOUT_S, Timeout, ros_session
from composer.cli.support.terminal import columns, say, write

if TYPE_CHECKING:
    from composer.remote.lifecycle import Control

app = typer.Typer(
    help="""See and change the lifecycle state of running nodes, from another terminal.

    Works for every lifecycle node in the ROS graph, whoever wrote it.
    """,
    epilog=examples(
        "compose lifecycle nodes",
        "compose lifecycle get planner",
        "compose lifecycle list planner",
        "compose lifecycle set planner deactivate",
        "compose lifecycle set --system pipeline --to inactive",
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
_HOW = "for example: compose lifecycle set planner deactivate"
Json = Annotated[bool, typer.Option("--json", help="Print JSON, for programs.")]


@contextmanager
def _control(timeout_s: float) -> Iterator[Control]:
    with ros_session("compose lifecycle", timeout_s) as (session, deadline):
        from composer.remote.lifecycle import Control

        yield Control(session, deadline)


@app.command("nodes", epilog=examples("compose lifecycle nodes", "compose lifecycle nodes --json"))
def nodes(timeout: Timeout = DEFAULT_TIMEOUT_S, as_json: Json = False) -> None:
    """List the lifecycle nodes and their states.

    Exit code 1 when a system runs on this computer and does not answer: its nodes are missing.
    """
    with _control(timeout) as control:
        states = control.states(control.nodes())
        if as_json:
            write(json.dumps(states, indent=2))
        elif states:
            write(columns([(name, state or "(no answer)") for name, state in states.items()]))
        control.check_all_answer()
    if not states and not as_json:
        say_none_found("lifecycle node")


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


class State(StrEnum):
    """The primary states."""

    UNCONFIGURED = "unconfigured"
    INACTIVE = "inactive"
    ACTIVE = "active"
    FINALIZED = "finalized"


@app.command(
    "set",
    epilog=examples(
        "compose lifecycle set planner deactivate",
        "compose lifecycle set planner camera activate      one after the other",
        "compose lifecycle set '/perception/*' deactivate   whatever matches",
        "compose lifecycle set planner --to active          by the legal way, in several steps",
        "compose lifecycle set --system pipeline --to inactive",
    ),
)
def set_state(
    words: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="TARGET... TRANSITION",
            help="Nodes (full names, last parts, patterns), then configure, activate, deactivate, "
            "cleanup or shutdown; with --to no transition.",
            show_default=False,
        ),
    ] = None,
    *,
    to: Annotated[
        State | None,
        typer.Option(
            "--to", metavar="STATE", help="Go there by the legal way.", show_default=False
        ),
    ] = None,
    system: Annotated[
        str | None,
        typer.Option(
            "--system",
            metavar="SYSTEM",
            help="All nodes of a running system, in order.",
            show_default=False,
        ),
    ] = None,
    timeout: Timeout = DEFAULT_TIMEOUT_S,
) -> None:
    """Take nodes through a transition, or to a state.

    What is not possible in a node's state is refused with exit code 1 and never sent; the other
    nodes are dealt with all the same. The nodes of a system go up in the order of its bring-up and
    down in reverse.
    """
    targets, transition = _split(list(words or ()), to, system)
    with ros_session("compose lifecycle set", timeout) as (session, deadline):
        from composer.remote.lifecycle_batch import Request, change_each, nodes_of_system

        wish = Request(transition, None if to is None else to.value)
        nodes = None if system is None else nodes_of_system(session, deadline, system, wish)
        failed = False
        for outcome in change_each(session, deadline, targets if nodes is None else nodes, wish):
            if outcome.error is None:
                write(str(outcome.change))
            else:
                failed = True
                say(Failure(str(outcome.error), hint=outcome.error.hint).text())
    if failed:
        raise typer.Exit(FINDINGS)


def _split(words: list[str], to: State | None, system: str | None) -> tuple[list[str], str | None]:
    """Return targets and transition. Raises UsageFailure."""
    transition = None
    if to is None:
        if not words:
            raise UsageFailure("say which transition, or --to which state", hint=_HOW)
        transition = words.pop()
    if system is None and not words:
        raise UsageFailure("say which nodes, or --system which system", hint=_HOW)
    if system is not None and words:
        raise UsageFailure(
            f"'{words[0]}' and --system: name nodes or a system, not both", hint=_HOW
        )
    return words, transition
