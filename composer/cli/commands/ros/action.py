"""``compose action``: the actions of the ROS graph."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict
from typing import Annotated, Any

import typer

from composer.cli.commands.ros.service import split_values
from composer.cli.support.completion import complete_action, complete_action_type
from composer.cli.support.errors import FAILED
from composer.cli.support.options import (
    DEFAULT_TIMEOUT_S,
    CountActions,
    Json,
    ShowTypes,
    Stdin,
    Timeout,
    examples,
    finite,
    yaml_or_stdin,
)
from composer.cli.support.output.results import (
    as_json,
    as_yaml,
    print_found,
    print_names,
    print_types,
)
from composer.cli.support.output.terminal import lines, say, write
from composer.cli.support.ros import graph_names, names_of_type, require_ros, ros_session, types_of

app = typer.Typer(
    help="List actions and send goals.",
    epilog=examples(
        "compose action list -t",
        "compose action info /navigate",
        "compose action send-goal /navigate '{target: {x: 2.0}, max_velocity: 1.0}' --feedback",
    ),
    no_args_is_help=True,
    rich_markup_mode=None,
)

Action = Annotated[str, typer.Argument(metavar="ACTION", autocompletion=complete_action)]


@app.command("list", epilog=examples("compose action list -t"))
def list_actions(
    *,
    types: ShowTypes = False,
    count: CountActions = False,
    json: Json = False,
    timeout: Timeout = DEFAULT_TIMEOUT_S,
) -> None:
    """List actions."""
    actions = graph_names("compose action", "action", timeout)
    print_names("action", actions, types=types, count=count, json=json)


@app.command("type", epilog=examples("compose action type /navigate"))
def type_of(action: Action, *, json: Json = False, timeout: Timeout = DEFAULT_TIMEOUT_S) -> None:
    """Print the type of an action."""
    print_types(types_of("compose action", "action", action, timeout), json=json)


@app.command("find", epilog=examples("compose action find composer_interfaces/action/Navigate"))
def find(
    type_name: Annotated[str, typer.Argument(metavar="TYPE", autocompletion=complete_action_type)],
    *,
    count: CountActions = False,
    json: Json = False,
    timeout: Timeout = DEFAULT_TIMEOUT_S,
) -> None:
    """List the actions of a type."""
    names = names_of_type("compose action", "action", type_name, timeout)
    print_found("action", type_name, names, count=count, json=json)


@app.command("info", epilog=examples("compose action info /navigate"))
def info(action: Action, *, json: Json = False, timeout: Timeout = DEFAULT_TIMEOUT_S) -> None:
    """Print the servers and clients of an action."""
    found = _info(action, timeout)
    if json:
        write(as_json(found, indent=2))
        return
    shown = [f"Action: {found['name']}", f"Type: {', '.join(found['types'])}"]
    for title, key in (("Action clients", "clients"), ("Action servers", "servers")):
        shown += [f"{title}: {len(found[key])}", *(f"  {node}" for node in found[key])]
    write(lines(shown))


def _info(name: str, timeout: float) -> dict[str, Any]:
    """Return the nodes of an action: from a running system, or else from the ROS graph."""
    require_ros("compose action")
    from composer.client.systems.local_queries import local_action

    found = local_action(name, timeout)
    if found is not None:
        return found
    with ros_session("compose action", timeout) as (session, deadline):
        from composer.client.graph_names import GraphNames

        return asdict(GraphNames(session, deadline).action(name))


def send_goal(
    action: Action,
    values: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="[TYPE] [GOAL]",
            help="The type is optional if the action is running. The goal is YAML.",
            show_default=False,
        ),
    ] = None,
    *,
    stdin: Stdin = False,
    feedback: Annotated[bool, typer.Option("--feedback", "-f", help="Print feedback.")] = False,
    json: Json = False,
    result_timeout: Annotated[
        float | None,
        typer.Option(
            "--result-timeout",
            metavar="SECONDS",
            min=0.0,
            callback=finite,
            help="Cancel the goal if it has not ended by then.",
            show_default="no limit",
        ),
    ] = None,
    timeout: Timeout = DEFAULT_TIMEOUT_S,
) -> None:
    """Send a goal and wait for the result.

    Ctrl-C cancels the goal; a second Ctrl-C exits at once. --timeout limits the wait for the server
    and for the goal to be accepted.

    Exit code 1 unless the goal succeeds.
    """
    type_name, text = split_values(values or [])
    goal = yaml_or_stdin(text, stdin)
    with ros_session("compose action", timeout) as (session, deadline):
        from composer.client.calls import GoalRequest
        from composer.client.calls import send_goal as send
        from composer.client.graph_names import GraphNames
        from composer.client.messages.values import to_plain
        from composer.client.name_matching import full_name
        from composer.client.session import Deadline

        name = full_name("action", action)
        found = type_name or GraphNames(session, deadline).only_type("action", name)

        def show(message: Any) -> None:
            if feedback:
                _print("feedback", to_plain(message), json)

        with (
            _interrupts() as interrupted,
            send(session, deadline, GoalRequest(name, found, goal, show, interrupted)) as accepted,
        ):
            say("goal accepted; press Ctrl-C to cancel")
            limit = Deadline(float("inf") if result_timeout is None else result_timeout)
            finished = accepted.result(lambda: interrupted() or limit.passed)
            if finished is None:
                say("canceling")
                finished = accepted.cancel()
        _print("result", to_plain(finished.result), json, finished.status)
    if finished.status != "succeeded":
        raise typer.Exit(FAILED)


@contextmanager
def _interrupts() -> Iterator[Callable[[], bool]]:
    """Yield a function that reports the first Ctrl-C; the second one raises KeyboardInterrupt."""
    received = threading.Event()

    def on_signal(*_: object) -> None:
        if received.is_set():
            raise KeyboardInterrupt
        received.set()

    before = signal.signal(signal.SIGINT, on_signal)
    try:
        yield received.is_set
    finally:
        signal.signal(signal.SIGINT, before)


def _print(kind: str, content: Any, json: bool, status: str | None = None) -> None:
    shown = {kind: content} if status is None else {kind: content, "status": status}
    write(as_json(shown) if json else f"{as_yaml(shown)}\n---")


_EPILOG = examples(
    "compose action send-goal /navigate '{target: {x: 2.0}, max_velocity: 1.0}' --feedback",
    "compose action send-goal /navigate composer_interfaces/action/Navigate '{max_velocity: 1.0}'",
)
app.command("send-goal", epilog=_EPILOG)(send_goal)
app.command("send_goal", epilog=_EPILOG, hidden=True)(send_goal)  # as ros2 spells it
