"""``compose topic``: list, inspect, print, measure and publish topics."""

from __future__ import annotations

from typing import Annotated, Any

import typer

from composer.cli.commands.nodes import add_list, described
from composer.cli.commands.topic_receive import (
    QosDepth,
    QosDurability,
    QosPreset,
    QosReliability,
    Topic,
    echo,
    hz,
    with_policies,
)
from composer.cli.support.completion import complete_message_type
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
from composer.cli.support.terminal import as_json, lines, say, write
from composer.model.qos import PRESETS

topic_app = command_group("List, inspect, measure and publish topics.")
add_list(topic_app, "topic")

topic_app.command(
    "echo",
    epilog=examples(
        "compose topic echo /sensor_data",
        "compose topic echo /sensor_data --once",
        "compose topic echo /sensor_data --field pose.pose.position --count 3",
        "compose topic echo /sensor_data --filter 'message.twist.twist.linear.x > 0.1'",
        "compose topic echo /chatter --json | jq .data",
    ),
)(echo)
topic_app.command("hz", epilog=examples("compose topic hz /sensor_data --window 100"))(hz)


@topic_app.command("info", epilog=examples("compose topic info -v /sensor_data"))
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
    facts = described("topic", topic, timeout)
    write(as_json(facts, indent=2) if json else info_text(facts, verbose=verbose))


def info_text(facts: dict[str, Any], *, verbose: bool) -> str:
    """Return what ``compose topic info`` prints."""
    shown = [f"Type: {', '.join(facts['types'])}"]
    for title, key in (("Publisher", "publishers"), ("Subscription", "subscriptions")):
        shown.append(f"{title} count: {len(facts[key])}")
        for end in facts[key] if verbose else ():
            policies = ", ".join(f"{name}: {value}" for name, value in end["qos"].items())
            shown += [f"  {end['node']}  {end['type']}", f"    {policies}"]
            shown += [f"    GID: {end['gid']}", f"    type hash: {end['type_hash']}"]
    return lines(shown)


@topic_app.command(
    "pub",
    epilog=examples(
        "compose topic pub /chatter std_msgs/msg/String '{data: hello}'",
        "compose topic pub --once /goal geometry_msgs/msg/Point '{x: 1.0, y: 2.0}'",
        "compose topic pub -r 10 /chatter std_msgs/msg/String '{data: \"number {count}\"}'",
    ),
)
def pub(
    topic: Topic,
    type_name: Annotated[
        str,
        typer.Argument(
            metavar="TYPE",
            help="The message type, such as std_msgs/msg/String.",
            autocompletion=complete_message_type,
        ),
    ],
    content: Annotated[
        str | None,
        typer.Argument(
            metavar="[VALUES]", help="The fields as YAML; {expressions} can use count and now."
        ),
    ] = None,
    *,
    stdin: Stdin = False,
    rate: Annotated[
        float, quantity("HZ", "--rate", "-r", help="Messages per second.", min=0.001)
    ] = 1.0,
    once: Annotated[
        bool, typer.Option("--once", "-1", help="Publish one message and exit.")
    ] = False,
    times: Annotated[
        int | None,
        typer.Option(
            "--times",
            "-t",
            min=1,
            metavar="N",
            help="Publish N messages and exit.",
            show_default="until Ctrl-C",
        ),
    ] = None,
    wait_for: Annotated[
        int | None,
        typer.Option(
            "--wait-matching-subscriptions",
            "-w",
            min=0,
            metavar="N",
            help="Wait for N subscriptions before publishing.",
            show_default="1 with --once or --times, else 0",
        ),
    ] = None,
    json: Json = False,
    preset: QosPreset = None,
    depth: QosDepth = None,
    reliability: QosReliability = None,
    durability: QosDurability = None,
    timeout: Timeout = DEFAULT_TIMEOUT_S,
) -> None:
    """Publish messages to a topic.

    --timeout limits the wait for subscriptions. At the end, a warning is printed if a reliable
    subscription has not acknowledged all messages within one second.
    """
    limit = 1 if once else times
    text = yaml_or_stdin(content, stdin)
    with ros_session("compose topic", timeout, carries_messages=True) as (session, deadline):
        from composer.client.graph_names import full_name
        from composer.client.messages.topics import NotAcknowledgedError, Publication, publish
        from composer.client.messages.values import class_of, compile_content
        from composer.runtime.ros.messages import to_plain

        publication = Publication(
            topic=full_name("topic", topic),
            type_name=type_name,
            build=compile_content(text, class_of(type_name), "the message"),
            qos=with_policies(PRESETS["command"], (preset, depth, reliability, durability)),
            rate_hz=rate,
            times=limit,
            wait_for=wait_for if wait_for is not None else int(limit is not None),
        )
        try:
            for number, message in enumerate(publish(session, deadline, publication), 1):
                if json:
                    write(as_json(to_plain(message)))
                else:
                    say(f"published #{number}: {message}")
        except NotAcknowledgedError as error:  # published, and possibly received
            say(f"warning: {error}\n  {error.hint}")
