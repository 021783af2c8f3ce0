"""``compose service``: the services of the ROS graph."""

from __future__ import annotations

from typing import Annotated

import typer

from composer.cli.support.completion import complete_service
from composer.cli.support.options import (
    DEFAULT_TIMEOUT_S,
    Count,
    Hidden,
    Json,
    ShowTypes,
    Timeout,
    examples,
)
from composer.cli.support.output import as_json, as_yaml, print_names
from composer.cli.support.ros import graph_names, ros_session, types_of
from composer.cli.support.terminal import lines, write

app = typer.Typer(
    help="List and call services.",
    epilog=examples(
        "compose service list -t",
        "compose service type /plan_trajectory",
        "compose service call /plan_trajectory '{goal: {x: 1.0}, max_velocity: 0.5}'",
    ),
    no_args_is_help=True,
    rich_markup_mode=None,
)

Service = Annotated[str, typer.Argument(metavar="SERVICE", autocompletion=complete_service)]


@app.command("list", epilog=examples("compose service list", "compose service list -t"))
def list_services(
    *,
    types: ShowTypes = False,
    count: Count = False,
    hidden: Hidden = False,
    json: Json = False,
    timeout: Timeout = DEFAULT_TIMEOUT_S,
) -> None:
    """List services."""
    services = graph_names("compose service", "service", timeout, hidden=hidden)
    print_names("service", services, types=types, count=count, json=json)


@app.command("type", epilog=examples("compose service type /plan_trajectory"))
def type_of(service: Service, *, json: Json = False, timeout: Timeout = DEFAULT_TIMEOUT_S) -> None:
    """Print the type of a service."""
    types = types_of("compose service", "service", service, timeout)
    write(as_json(list(types), indent=2) if json else lines(types))


@app.command(
    "call",
    epilog=examples(
        "compose service call /plan_trajectory '{goal: {x: 1.0}, max_velocity: 0.5}'",
        "compose service call /reset std_srvs/srv/Trigger",
        "compose service call /switch std_srvs/srv/SetBool '{data: true}' --json",
    ),
)
def call(
    service: Service,
    values: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="[TYPE] [REQUEST]",
            help="The type is optional if the service is running. The request is YAML.",
            show_default=False,
        ),
    ] = None,
    *,
    json: Json = False,
    timeout: Timeout = DEFAULT_TIMEOUT_S,
) -> None:
    """Call a service and print the response."""
    type_name, request = split_values(values or [])
    with ros_session("compose service", timeout) as (session, deadline):
        from composer.remote.calls import call_service
        from composer.remote.graph_names import GraphNames
        from composer.remote.name_matching import full_name
        from composer.remote.values import to_plain

        name = full_name("service", service)
        found = type_name or GraphNames(session, deadline).only_type("service", name)
        response = to_plain(call_service(session, deadline, name, found, request))
    write(as_json(response, indent=2) if json else as_yaml(response))


def split_values(values: list[str]) -> tuple[str | None, str]:
    """Return the type, if given, and the YAML. Raises UsageError."""
    from composer.cli.support.errors import UsageError

    match values:
        case []:
            return None, "{}"
        case [text] if "/" in text and not text.lstrip().startswith("{"):
            return text, "{}"
        case [text]:
            return None, text
        case [type_name, text]:
            return type_name, text
        case _:
            raise UsageError("too many arguments", hint="quote the YAML, such as '{data: true}'")
