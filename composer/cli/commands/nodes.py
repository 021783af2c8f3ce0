"""``compose node``, ``compose log-level``, and what ``list`` and ``info`` of all names share."""

from __future__ import annotations

from typing import Annotated, Any

import typer

from composer.cli.support.completion import complete_node
from composer.cli.support.options import (
    DEFAULT_TIMEOUT_S,
    Hidden,
    Json,
    ShowTypes,
    Timeout,
    command_group,
    examples,
)
from composer.cli.support.ros import graph_names, require_ros, ros_session
from composer.cli.support.terminal import as_json, columns, lines, write, write_list
from composer.model import LogLevel

NodeName = Annotated[
    str,
    typer.Argument(
        metavar="NODE",
        help="The full name (/planning/planner), or its last part (planner) if unambiguous.",
        autocompletion=complete_node,
    ),
]

AnyNode = Annotated[
    str | None,
    typer.Argument(
        metavar="[NODE]",
        help="The full name of a node, or its last part. Default: all nodes.",
        autocompletion=complete_node,
    ),
]

_NODE_SECTIONS = (
    ("Subscribers", "subscriptions"),
    ("Publishers", "publishers"),
    ("Service Servers", "services"),
    ("Service Clients", "clients"),
    ("Action Servers", "action_servers"),
    ("Action Clients", "action_clients"),
)
node_app = command_group("List and inspect running nodes.")
EPILOG = examples(
    "compose log-level                 the levels of all nodes",
    "compose log-level planner         the level of a node",
    "compose log-level planner debug   set it",
)


def add_list(app: typer.Typer, kind: str) -> None:
    """Add a command that lists the topics, services or actions in the ROS graph."""

    def list_names(
        *,
        types: ShowTypes = False,
        hidden: Hidden = False,
        json: Json = False,
        timeout: Timeout = DEFAULT_TIMEOUT_S,
    ) -> None:
        named = graph_names(f"compose {kind}", kind, timeout, hidden=hidden)
        rows = [(name, ", ".join(each)) if types else (name,) for name, each in named]
        data = [{"name": name, "types": each} for name, each in named]
        write_list(kind, rows, data, json=json)

    epilog = examples(f"compose {kind} list", f"compose {kind} list --show-types")
    app.command("list", help=f"List {kind}s.", epilog=epilog)(list_names)


def described(kind: str, name: str, timeout: float) -> dict[str, Any]:
    """Return the endpoints of a node, topic or action, for JSON.

    A running system on this computer answers at once; without one, join the ROS graph.
    """
    require_ros(f"compose {kind}")
    from composer.client.systems.local_queries import local_details

    local = local_details(kind, name, timeout)
    if local is not None:
        return local
    with ros_session(f"compose {kind}", timeout) as (session, deadline):
        from composer.client.graph_names import GraphNames

        return GraphNames(session, deadline).details(kind, name)


@node_app.command("list", epilog=examples("compose node list", "compose node list --json"))
def list_nodes(
    *, hidden: Hidden = False, json: Json = False, timeout: Timeout = DEFAULT_TIMEOUT_S
) -> None:
    """List nodes."""
    nodes = [name for name, _ in graph_names("compose node", "node", timeout, hidden=hidden)]
    write_list("node", [(name,) for name in nodes], nodes, json=json)


@node_app.command("info", epilog=examples("compose node info planner"))
def node_info(
    name: NodeName,
    *,
    hidden: Hidden = False,
    json: Json = False,
    timeout: Timeout = DEFAULT_TIMEOUT_S,
) -> None:
    """Print the topics, services and actions of a node."""
    from composer.model.names import is_hidden

    node = described("node", name, timeout)
    for _, key in _NODE_SECTIONS if not hidden else ():
        node[key] = [item for item in node[key] if not is_hidden(item[0])]
    if json:
        write(as_json(node, indent=2))
        return
    shown = [node["name"]]
    for title, key in _NODE_SECTIONS:
        shown.append(f"  {title}:")
        rows = [(f"    {item}:", ", ".join(types)) for item, types in node[key]]
        shown += columns(rows).split("\n") if rows else []
    write(lines(shown))


def log_level(
    node: AnyNode = None,
    level: Annotated[
        LogLevel | None,
        typer.Argument(
            metavar="[LEVEL]", help="debug, info, warn, error or fatal. Default: print it."
        ),
    ] = None,
    *,
    json: Json = False,
    timeout: Timeout = DEFAULT_TIMEOUT_S,
) -> None:
    """Print or set the log levels of running nodes.

    It works in every lifecycle state. The level stays until the process of the node ends, also if
    the node is restarted. Programs need the logger services of rclpy or rclcpp.
    """
    with ros_session("compose log-level", timeout) as (session, deadline):
        from composer.client.parameters import LoggerLevels

        levels = LoggerLevels(session, deadline)
        found: dict[str, str | None]
        if node is None:
            found = levels.all()
        elif level is None:
            found = dict([levels.get(node)])
        else:
            found = {levels.set(node, level): level.value}
    rows = [(name, text or "(no response)") for name, text in found.items()]
    write_list("node", rows, found, json=json)
