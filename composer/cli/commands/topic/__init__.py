"""``compose topic``: the topics of the ROS graph."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

import typer

from composer.cli.commands.topic.echo import echo
from composer.cli.commands.topic.pub import pub
from composer.cli.commands.topic.rates import bw, delay, hz
from composer.cli.commands.topic.receiving import Topic
from composer.cli.support.options import (
    DEFAULT_TIMEOUT_S,
    Count,
    Hidden,
    Json,
    ShowTypes,
    Timeout,
    examples,
)
from composer.cli.support.output import as_json, print_names
from composer.cli.support.ros import graph_names, ros_session
from composer.cli.support.terminal import lines, write

if TYPE_CHECKING:
    from composer.qos import QosProfile
    from composer.runtime.ros.endpoints import EndpointInfo, TopicInfo

app = typer.Typer(
    help="List, inspect, measure and publish topics.",
    epilog=examples(
        "compose topic list -t",
        "compose topic echo /sensor_data --once",
        "compose topic hz /sensor_data",
        "compose topic pub --once /chatter std_msgs/msg/String '{data: hello}'",
    ),
    no_args_is_help=True,
    rich_markup_mode=None,
)


@app.command("list", epilog=examples("compose topic list", "compose topic list --show-types"))
def list_topics(
    *,
    types: ShowTypes = False,
    count: Count = False,
    hidden: Hidden = False,
    json: Json = False,
    timeout: Timeout = DEFAULT_TIMEOUT_S,
) -> None:
    """List topics."""
    topics = graph_names("compose topic", "topic", timeout, hidden=hidden)
    print_names("topic", topics, types=types, count=count, json=json)


@app.command("info", epilog=examples("compose topic info -v /sensor_data"))
def info(
    topic: Topic,
    *,
    verbose: Annotated[
        bool,
        typer.Option("--verbose", "-v", help="Print the node and QoS profile of each endpoint."),
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
    return [f"{endpoint.node}  {endpoint.type}", f"  {policies}"]


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
                {"node": item.node, "type": item.type, "qos": _policies(item.qos)}
                for item in endpoints
            ]
            for key, endpoints in (
                ("publishers", found.publishers),
                ("subscriptions", found.subscriptions),
            )
        },
    }


app.command(
    "echo",
    epilog=examples(
        "compose topic echo /sensor_data",
        "compose topic echo /sensor_data --once",
        "compose topic echo /sensor_data --field pose.pose.position --count 3",
        "compose topic echo /sensor_data --filter 'message.twist.twist.linear.x > 0.1'",
        "compose topic echo /chatter --json | jq .data",
    ),
)(echo)
app.command("hz", epilog=examples("compose topic hz /sensor_data --window 100"))(hz)
app.command("delay", epilog=examples("compose topic delay /sensor_data --window 100"))(delay)
app.command("bw", epilog=examples("compose topic bw /camera/image"))(bw)
app.command(
    "pub",
    epilog=examples(
        "compose topic pub /chatter std_msgs/msg/String '{data: hello}'",
        "compose topic pub --once /goal geometry_msgs/msg/Point '{x: 1.0, y: 2.0}'",
        "compose topic pub -r 10 /chatter std_msgs/msg/String '{data: \"number {count}\"}'",
    ),
)(pub)
