"""``compose service`` and ``compose action``: list, inspect and call them."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Annotated, Any

import typer

from composer.cli.commands.nodes import add_list, described
from composer.cli.support.completion import complete_action, complete_service
from composer.cli.support.errors import FAILED, UsageError
from composer.cli.support.options import (
    DEFAULT_TIMEOUT_S,
    Json,
    Stdin,
    Timeout,
    command_group,
    examples,
    quantity,
    yaml_or_stdin,
)
from composer.cli.support.ros import ros_session
from composer.cli.support.terminal import as_json, as_yaml, lines, say, write

service_app = command_group("List and call services.")
action_app = command_group("List actions and send goals.")
add_list(service_app, "service")
add_list(action_app, "action")

Action = Annotated[str, typer.Argument(metavar="ACTION", autocompletion=complete_action)]


@service_app.command(
    "call",
    epilog=examples(
        "compose service call /plan_trajectory '{goal: {x: 1.0}, max_velocity: 0.5}'",
        "compose service call /reset std_srvs/srv/Trigger",
        "compose service call /switch std_srvs/srv/SetBool '{data: true}' --json",
    ),
)
def call(
    service: Annotated[str, typer.Argument(metavar="SERVICE", autocompletion=complete_service)],
    values: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="[TYPE] [REQUEST]",
            help="The type is optional if the service is running. The request is YAML.",
        ),
    ] = None,
    *,
    stdin: Stdin = False,
    rate: Annotated[
        float | None,
        quantity(
            "HZ",
            "--rate",
            "-r",
            help="Repeat the call until Ctrl-C, this often per second.",
            min=0.001,
        ),
    ] = None,
    json: Json = False,
    timeout: Timeout = DEFAULT_TIMEOUT_S,
) -> None:
    """Call a service and print the response.

    --timeout limits the wait for each response.
    """
    type_name, text = _split(values or [])
    request = yaml_or_stdin(text, stdin)
    with ros_session("compose service", timeout) as (session, deadline):
        from composer.client.calls import ServiceRequest, call_service
        from composer.client.graph_names import GraphNames, full_name
        from composer.runtime.ros.messages import to_plain

        name = full_name("service", service)
        service_type = type_name or GraphNames(session, deadline).only_type("service", name)
        call_request = ServiceRequest(name, service_type, request, rate)
        for response in call_service(session, deadline, call_request):
            plain = to_plain(response)
            if rate is None:
                write(as_json(plain, indent=2) if json else as_yaml(plain))
            else:  # JSON lines, or YAML documents
                write(as_json(plain) if json else f"{as_yaml(plain)}\n---")


@action_app.command("info", epilog=examples("compose action info /navigate"))
def action_info(
    action: Action, *, json: Json = False, timeout: Timeout = DEFAULT_TIMEOUT_S
) -> None:
    """Print the servers and clients of an action."""
    info = described("action", action, timeout)
    if json:
        write(as_json(info, indent=2))
        return
    shown = [f"Action: {info['name']}", f"Type: {', '.join(info['types'])}"]
    for title, key in (("Action clients", "clients"), ("Action servers", "servers")):
        shown += [f"{title}: {len(info[key])}", *(f"  {node}" for node in info[key])]
    write(lines(shown))


@action_app.command(
    "send-goal",
    epilog=examples(
        "compose action send-goal /navigate '{target: {x: 2.0}, max_velocity: 1.0}' --feedback",
        "compose action send-goal /navigate composer_interfaces/action/Navigate"
        " '{max_velocity: 1.0}'",
    ),
)
def send_goal(
    action: Action,
    values: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="[TYPE] [GOAL]",
            help="The type is optional if the action is running. The goal is YAML.",
        ),
    ] = None,
    *,
    stdin: Stdin = False,
    feedback: Annotated[bool, typer.Option("--feedback", "-f", help="Print feedback.")] = False,
    json: Json = False,
    result_timeout: Annotated[
        float | None,
        quantity(
            "SECONDS",
            "--result-timeout",
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
    type_name, text = _split(values or [])
    goal = yaml_or_stdin(text, stdin)
    with ros_session("compose action", timeout) as (session, deadline):
        from composer.client.calls import GoalRequest
        from composer.client.calls import send_goal as send
        from composer.client.graph_names import GraphNames, full_name
        from composer.client.session import Deadline
        from composer.runtime.ros.messages import to_plain

        name = full_name("action", action)
        action_type = type_name or GraphNames(session, deadline).only_type("action", name)

        def show(message: Any) -> None:
            if feedback:
                _print({"feedback": to_plain(message)}, json=json)

        with _interrupts() as interrupted:
            request = GoalRequest(name, action_type, goal, show, interrupted)
            with send(session, deadline, request) as accepted:
                say("goal accepted; press Ctrl-C to cancel")
                limit = Deadline(float("inf") if result_timeout is None else result_timeout)
                finished = accepted.result(lambda: interrupted() or limit.passed)
                if finished is None:
                    say("canceling")
                    finished = accepted.cancel()
        _print({"result": to_plain(finished.result), "status": finished.status}, json=json)
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


def _print(content: dict[str, Any], *, json: bool) -> None:
    write(as_json(content) if json else f"{as_yaml(content)}\n---")


def _split(values: list[str]) -> tuple[str | None, str | None]:
    """Return the type and the YAML, None where not given. Raises UsageError."""
    match values:
        case []:
            return None, None
        case [text] if "/" in text and not text.lstrip().startswith("{"):
            return text, None
        case [text]:
            return None, text
        case [type_name, text]:
            return type_name, text
        case _:
            raise UsageError("too many arguments", hint="quote the YAML, such as '{data: true}'")
