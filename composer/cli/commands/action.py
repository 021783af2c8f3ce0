"""``compose action``: the actions of the ROS graph, whoever serves them."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Annotated, Any

import typer

from composer.cli.commands.service import one_type, split_values
from composer.cli.support.failure import FINDINGS
from composer.cli.support.finite import finite
from composer.cli.support.help import examples
from composer.cli.support.listing import Count, Json, ShowTypes, print_names
from composer.cli.support.ros import DEFAULT_TIMEOUT_S, Timeout, ros_session
from composer.cli.support.terminal import say, write
from composer.cli.support.values import as_json, as_yaml

app = typer.Typer(
    help="See the actions, and send goals.",
    epilog=examples(
        "compose action list -t",
        "compose action info /navigate",
        "compose action send-goal /navigate '{target: {x: 2.0}}' --feedback",
    ),
    no_args_is_help=True,
    rich_markup_mode=None,
)

Action = Annotated[str, typer.Argument(metavar="ACTION")]


@app.command("list", epilog=examples("compose action list -t"))
def list_actions(
    *,
    types: ShowTypes = False,
    count: Count = False,
    json: Json = False,
    timeout: Timeout = DEFAULT_TIMEOUT_S,
) -> None:
    """List the actions."""
    with ros_session("compose action", timeout) as (session, deadline):
        from composer.remote.graph_names import Names

        actions = Names(session, deadline).actions()
    print_names("action", actions, types=types, count=count, json=json)


@app.command("info", epilog=examples("compose action info /navigate"))
def info(action: Action, *, json: Json = False, timeout: Timeout = DEFAULT_TIMEOUT_S) -> None:
    """Print who serves an action and who uses it."""
    with ros_session("compose action", timeout) as (session, deadline):
        from dataclasses import asdict

        from composer.remote.graph_names import Names

        found = Names(session, deadline).action(action)
    if json:
        write(as_json(asdict(found), indent=2))
        return
    lines = [f"Action: {found.name}", f"Type: {', '.join(found.types)}"]
    for title, nodes in (("Action clients", found.clients), ("Action servers", found.servers)):
        lines += [f"{title}: {len(nodes)}", *(f"  {node}" for node in nodes)]
    write("\n".join(lines))


def send_goal(
    action: Action,
    values: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="[TYPE] [GOAL]",
            help="The type may be left out; the goal is YAML.",
            show_default=False,
        ),
    ] = None,
    *,
    feedback: Annotated[
        bool, typer.Option("--feedback", "-f", help="Print what is told on the way.")
    ] = False,
    json: Json = False,
    result_timeout: Annotated[
        float | None,
        typer.Option(
            "--result-timeout",
            metavar="SECONDS",
            min=0.0,
            callback=finite,
            help="Cancel the goal unless it has ended by then.",
            show_default="waits for ever",
        ),
    ] = None,
    timeout: Timeout = DEFAULT_TIMEOUT_S,
) -> None:
    """Send a goal and wait for its end; Ctrl-C cancels it.

    The time limit (--timeout) is for the server and its acceptance. Exit code 1 unless the goal
    succeeded.
    """
    type_name, goal = split_values(values or [])
    with ros_session("compose action", timeout) as (session, deadline):
        from composer.remote.calls import Sending, sent_goal
        from composer.remote.graph_names import Names
        from composer.remote.name_matching import full_name
        from composer.remote.session import Deadline
        from composer.remote.values import to_plain

        name = full_name("action", action)
        found = type_name or one_type(Names(session, deadline), "action", name)

        def show(message: Any) -> None:
            if feedback:
                _print("feedback", to_plain(message), json)

        with (
            _interrupts() as interrupted,
            sent_goal(session, deadline, Sending(name, found, goal, show, interrupted)) as sent,
        ):
            say("goal accepted, Ctrl-C cancels it")
            limit = Deadline(float("inf") if result_timeout is None else result_timeout)
            outcome = sent.result(lambda: interrupted() or limit.passed)
            if outcome is None:
                say("canceling")
                outcome = sent.cancel()
        _print("result", to_plain(outcome.result), json, outcome.status)
    if outcome.status != "succeeded":
        raise typer.Exit(FINDINGS)


@contextmanager
def _interrupts() -> Iterator[Callable[[], bool]]:
    """Take the first Ctrl-C as a wish, which what is yielded tells; the second ends all."""
    asked = threading.Event()

    def take(*_: object) -> None:
        if asked.is_set():
            raise KeyboardInterrupt
        asked.set()

    before = signal.signal(signal.SIGINT, take)
    try:
        yield asked.is_set
    finally:
        signal.signal(signal.SIGINT, before)


def _print(kind: str, content: Any, json: bool, status: str | None = None) -> None:
    told = {kind: content} if status is None else {kind: content, "status": status}
    write(as_json(told) if json else f"{as_yaml(told)}\n---")


_EPILOG = examples(
    "compose action send-goal /navigate '{target: {x: 2.0}, max_velocity: 1.0}' --feedback",
    "compose action send-goal /navigate composer_interfaces/action/Navigate '{target: {x: 2.0}}'",
)
app.command("send-goal", epilog=_EPILOG)(send_goal)
app.command("send_goal", epilog=_EPILOG, hidden=True)(send_goal)  # as ros2 spells it
