"""``compose service``: the services of the ROS graph."""

from __future__ import annotations

from typing import Annotated, Any

import typer

from composer.cli.support.completion import complete_service, complete_service_type
from composer.cli.support.options import (
    DEFAULT_TIMEOUT_S,
    CountServices,
    HiddenServices,
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
from composer.cli.support.output.terminal import write
from composer.cli.support.ros import graph_names, names_of_type, ros_session, types_of

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
    count: CountServices = False,
    hidden: HiddenServices = False,
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
    print_types(types, json=json)


@app.command("find", epilog=examples("compose service find std_srvs/srv/Trigger"))
def find(
    type_name: Annotated[str, typer.Argument(metavar="TYPE", autocompletion=complete_service_type)],
    *,
    count: CountServices = False,
    hidden: HiddenServices = False,
    json: Json = False,
    timeout: Timeout = DEFAULT_TIMEOUT_S,
) -> None:
    """List the services of a type."""
    names = names_of_type("compose service", "service", type_name, timeout, hidden=hidden)
    print_found("service", type_name, names, count=count, json=json)


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
    stdin: Stdin = False,
    rate: Annotated[
        float | None,
        typer.Option(
            "--rate",
            "-r",
            min=0.001,
            callback=finite,
            metavar="HZ",
            help="Repeat the call until Ctrl-C, this often per second.",
            show_default=False,
        ),
    ] = None,
    json: Json = False,
    timeout: Timeout = DEFAULT_TIMEOUT_S,
) -> None:
    """Call a service and print the response.

    --timeout limits the wait for each response.
    """
    type_name, text = split_values(values or [])
    request = yaml_or_stdin(text, stdin)
    with ros_session("compose service", timeout) as (session, deadline):
        from composer.client.calls import ServiceRequest, call_service
        from composer.client.graph_names import GraphNames
        from composer.client.messages.values import to_plain
        from composer.client.name_matching import full_name

        name = full_name("service", service)
        found = type_name or GraphNames(session, deadline).only_type("service", name)
        call_request = ServiceRequest(name, found, request, rate)
        for response in call_service(session, deadline, call_request):
            _print_response(to_plain(response), json=json, repeated=rate is not None)


def _print_response(response: Any, *, json: bool, repeated: bool) -> None:
    """Print one response; repeated ones are JSON lines or YAML documents."""
    if json:
        write(as_json(response, indent=None if repeated else 2))
    else:
        write(f"{as_yaml(response)}\n---" if repeated else as_yaml(response))


def split_values(values: list[str]) -> tuple[str | None, str | None]:
    """Return the type and the YAML, None where not given. Raises UsageError."""
    from composer.cli.support.errors import UsageError

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
