"""``compose topic info``: the endpoints of a topic."""

from __future__ import annotations

from typing import Annotated, Any

import typer

from composer.cli.commands.ros.topic.receiving import Topic
from composer.cli.support.options import DEFAULT_TIMEOUT_S, Json, Timeout
from composer.cli.support.output.results import as_json
from composer.cli.support.output.terminal import lines, write
from composer.cli.support.ros import require_ros, ros_session


def info(
    topic: Topic,
    *,
    verbose: Annotated[
        bool,
        typer.Option("--verbose", "-v", help="Print nodes, QoS profiles, GIDs and type hashes."),
    ] = False,
    json: Json = False,
    timeout: Timeout = DEFAULT_TIMEOUT_S,
) -> None:
    """Print the type and the endpoints of a topic.

    Queue depths are not shown because DDS does not announce them to other processes.
    """
    found = _info(topic, timeout)
    write(as_json(found, indent=2) if json else _as_text(found, verbose))


def _info(name: str, timeout: float) -> dict[str, Any]:
    """Return the endpoints of a topic: from a running system, or else from the ROS graph."""
    require_ros("compose topic")
    from composer.client.systems.local_queries import local_topic

    found = local_topic(name, timeout)
    if found is not None:
        return found
    with ros_session("compose topic", timeout) as (session, deadline):
        from composer.client.messages.topics import Topics

        return Topics(session, deadline).info(name).plain()


def _as_text(found: dict[str, Any], verbose: bool) -> str:
    shown = [f"Type: {', '.join(found['types'])}"]
    for title, key in (("Publisher", "publishers"), ("Subscription", "subscriptions")):
        shown.append(f"{title} count: {len(found[key])}")
        if verbose:
            shown += [f"  {line}" for item in found[key] for line in _endpoint_lines(item)]
    return lines(shown)


def _endpoint_lines(endpoint: dict[str, Any]) -> list[str]:
    policies = ", ".join(f"{name}: {value}" for name, value in endpoint["qos"].items())
    return [
        f"{endpoint['node']}  {endpoint['type']}",
        f"  {policies}",
        f"  GID: {endpoint['gid']}",
        f"  type hash: {endpoint['type_hash']}",
    ]
