"""``compose node``: the nodes of the ROS graph."""

from __future__ import annotations

from dataclasses import asdict
from typing import Annotated, Any

import typer

from composer.cli.support.completion import complete_node
from composer.cli.support.options import (
    DEFAULT_TIMEOUT_S,
    AllNodes,
    CountNodes,
    Hidden,
    Json,
    Timeout,
    examples,
)
from composer.cli.support.output.results import as_json, say_none_found
from composer.cli.support.output.terminal import columns, lines, write
from composer.cli.support.ros import graph_names, require_ros, ros_session

app = typer.Typer(
    help="List and inspect running nodes.",
    epilog=examples("compose node list", "compose node info planner"),
    no_args_is_help=True,
    rich_markup_mode=None,
)

_SECTIONS = (
    ("Subscribers", "subscriptions"),
    ("Publishers", "publishers"),
    ("Service Servers", "services"),
    ("Service Clients", "clients"),
    ("Action Servers", "action_servers"),
    ("Action Clients", "action_clients"),
)


@app.command("list", epilog=examples("compose node list", "compose node list --json"))
def list_nodes(
    *,
    hidden: AllNodes = False,
    count: CountNodes = False,
    json: Json = False,
    timeout: Timeout = DEFAULT_TIMEOUT_S,
) -> None:
    """List nodes."""
    nodes = [name for name, _ in graph_names("compose node", "node", timeout, hidden=hidden)]
    if count:
        write(str(len(nodes)))
    elif json:
        write(as_json(nodes, indent=2))
    elif nodes:
        write(lines(nodes))
    else:
        say_none_found("node")


@app.command("info", epilog=examples("compose node info planner"))
def info(
    name: Annotated[
        str,
        typer.Argument(
            metavar="NODE",
            help="The full name of a node, or its last part if unambiguous.",
            autocompletion=complete_node,
        ),
    ],
    *,
    hidden: Hidden = False,
    json: Json = False,
    timeout: Timeout = DEFAULT_TIMEOUT_S,
) -> None:
    """Print the topics, services and actions of a node."""
    found = _info(name, timeout, hidden=hidden)
    if json:
        write(as_json(found, indent=2))
        return
    shown = [found["name"]]
    for title, key in _SECTIONS:
        shown.append(f"  {title}:")
        rows = [(f"    {item}:", ", ".join(types)) for item, types in found[key]]
        shown += columns(rows).split("\n") if rows else []
    write(lines(shown))


def _info(name: str, timeout: float, *, hidden: bool) -> dict[str, Any]:
    """Return the endpoints of a node: from a running system, or else from the ROS graph."""
    require_ros("compose node")
    from composer.client.systems.local_queries import local_node

    found = local_node(name, timeout, hidden=hidden)
    if found is not None:
        return found
    with ros_session("compose node", timeout) as (session, deadline):
        from composer.client.graph_names import GraphNames

        return asdict(GraphNames(session, deadline).node(name, hidden=hidden))
