"""``compose topic info``: the endpoints of a topic."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

import typer

from composer.cli.commands.topic.receiving import Topic
from composer.cli.support.options import DEFAULT_TIMEOUT_S, Json, Timeout
from composer.cli.support.output import as_json
from composer.cli.support.ros import ros_session
from composer.cli.support.terminal import lines, write

if TYPE_CHECKING:
    from composer.qos import QosProfile
    from composer.runtime.ros.endpoints import EndpointInfo, TopicInfo


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
    with ros_session("compose topic", timeout) as (session, deadline):
        from composer.remote.topics import Topics

        found = Topics(session, deadline).info(topic)
    write(as_json(_as_data(found), indent=2) if json else _as_text(found, verbose))


def _as_text(found: TopicInfo, verbose: bool) -> str:
    shown = [f"Type: {', '.join(found.types)}"]
    for title, endpoints in (
        ("Publisher", found.publishers),
        ("Subscription", found.subscriptions),
    ):
        shown.append(f"{title} count: {len(endpoints)}")
        if verbose:
            shown += [f"  {line}" for item in endpoints for line in _endpoint_lines(item)]
    return lines(shown)


def _endpoint_lines(endpoint: EndpointInfo) -> list[str]:
    policies = ", ".join(f"{name}: {value}" for name, value in _policies(endpoint.qos).items())
    return [
        f"{endpoint.node}  {endpoint.type}",
        f"  {policies}",
        f"  GID: {endpoint.gid}",
        f"  type hash: {endpoint.type_hash}",
    ]


def _policies(profile: QosProfile) -> dict[str, Any]:
    """Return the policies that are announced to other processes, without unset durations."""
    policies: dict[str, Any] = {
        "reliability": profile.reliability.value,
        "durability": profile.durability.value,
        "liveliness": profile.liveliness.value,
    }
    for name in ("deadline_ms", "lifespan_ms", "liveliness_lease_duration_ms"):
        value = getattr(profile, name)
        if value is not None:
            policies[name] = value
    return policies


def _as_data(found: TopicInfo) -> dict[str, Any]:
    return {
        "name": found.name,
        "types": list(found.types),
        **{
            key: [
                {
                    "node": item.node,
                    "type": item.type,
                    "type_hash": item.type_hash,
                    "gid": item.gid,
                    "qos": _policies(item.qos),
                }
                for item in endpoints
            ]
            for key, endpoints in (
                ("publishers", found.publishers),
                ("subscriptions", found.subscriptions),
            )
        },
    }
