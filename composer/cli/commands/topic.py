"""``compose topic``: what goes over topics of the ROS graph, whoever publishes it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

import typer

from composer.cli.commands.topic_echo import echo
from composer.cli.commands.topic_pub import pub
from composer.cli.commands.topic_rates import bw, delay, hz
from composer.cli.support.help import examples
from composer.cli.support.listing import Count, Hidden, Json, ShowTypes, print_names
from composer.cli.support.ros import DEFAULT_TIMEOUT_S, Timeout, ros_session
from composer.cli.support.terminal import write
from composer.cli.support.values import as_json

if TYPE_CHECKING:
    from composer.qos import QosProfile
    from composer.runtime.ros.endpoints import End, TopicInfo

app = typer.Typer(
    help="See what goes over topics, measure it, and publish.",
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
    """List the topics."""
    with ros_session("compose topic", timeout) as (session, deadline):
        from composer.remote.graph_names import Names

        topics = Names(session, deadline).topics(hidden=hidden)
    print_names("topic", topics, types=types, count=count, json=json)


@app.command("info", epilog=examples("compose topic info -v /sensor_data"))
def info(
    topic: Annotated[str, typer.Argument(metavar="TOPIC")],
    *,
    verbose: Annotated[
        bool, typer.Option("--verbose", "-v", help="Each end with its node and QoS.")
    ] = False,
    json: Json = False,
    timeout: Timeout = DEFAULT_TIMEOUT_S,
) -> None:
    """Print the type of a topic and who is at its ends.

    The depth of a queue is not told to other processes, so it is not shown.
    """
    with ros_session("compose topic", timeout) as (session, deadline):
        from composer.remote.topics import Topics

        found = Topics(session, deadline).info(topic)
    write(as_json(_as_data(found), indent=2) if json else _as_text(found, verbose))


def _as_text(found: TopicInfo, verbose: bool) -> str:
    lines = [f"Type: {', '.join(found.types)}"]
    for title, ends in (("Publisher", found.publishers), ("Subscription", found.subscriptions)):
        lines.append(f"{title} count: {len(ends)}")
        if verbose:
            lines += [f"  {line}" for end in ends for line in _end_lines(end)]
    return "\n".join(lines)


def _end_lines(end: End) -> list[str]:
    policies = ", ".join(f"{name}: {value}" for name, value in _policies(end.qos).items())
    return [f"{end.node}  {end.type}", f"  {policies}"]


def _policies(profile: QosProfile) -> dict[str, Any]:
    """Return the policies that other processes are told of, where they say something."""
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
            key: [{"node": end.node, "type": end.type, "qos": _policies(end.qos)} for end in ends]
            for key, ends in (
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
