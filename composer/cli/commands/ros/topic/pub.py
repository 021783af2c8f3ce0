"""``compose topic pub``: publish messages."""

from __future__ import annotations

from typing import Annotated

import typer

from composer.cli.commands.ros.topic.qos_options import QosOptions, qos_options
from composer.cli.commands.ros.topic.receiving import Topic
from composer.cli.support.completion import complete_message_type
from composer.cli.support.options import (
    DEFAULT_TIMEOUT_S,
    Json,
    Stdin,
    Timeout,
    finite,
    yaml_or_stdin,
)
from composer.cli.support.output.results import as_json
from composer.cli.support.output.terminal import say, write
from composer.cli.support.ros import ros_session


@qos_options
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
            metavar="[VALUES]",
            help="The fields as YAML; {expressions} can use count and now.",
            show_default=False,
        ),
    ] = None,
    *,
    stdin: Stdin = False,
    rate: Annotated[
        float,
        typer.Option(
            "--rate", "-r", min=0.001, callback=finite, metavar="HZ", help="Messages per second."
        ),
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
    every: Annotated[
        int, typer.Option("--print", "-p", min=1, metavar="N", help="Print every Nth message.")
    ] = 1,
    json: Json = False,
    qos: QosOptions,
    timeout: Timeout = DEFAULT_TIMEOUT_S,
) -> None:
    """Publish messages to a topic.

    --timeout limits the wait for subscriptions. At the end, a warning is printed if a reliable
    subscription has not acknowledged all messages within one second.
    """
    from composer.model.qos import PRESETS

    limit = 1 if once else times
    text = yaml_or_stdin(content, stdin)
    with ros_session("compose topic", timeout, carries_messages=True) as (session, deadline):
        from composer.client.messages.topics import NotAcknowledgedError, Publication, publish
        from composer.client.messages.values import class_of, compile_content, to_plain
        from composer.client.name_matching import full_name

        publication = Publication(
            topic=full_name("topic", topic),
            type_name=type_name,
            build=compile_content(text, class_of(type_name), "the message"),
            qos=qos.applied_to(PRESETS["command"]),
            rate_hz=rate,
            times=limit,
            wait_for=wait_for if wait_for is not None else int(limit is not None),
        )
        try:
            for number, message in enumerate(publish(session, deadline, publication), 1):
                if number % every:
                    continue
                if json:
                    write(as_json(to_plain(message)))
                else:
                    say(f"published #{number}: {message}")
        except NotAcknowledgedError as error:  # published, and possibly received
            say(f"warning: {error}\n  {error.hint}")
