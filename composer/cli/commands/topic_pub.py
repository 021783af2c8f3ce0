"""``compose topic pub``: publish from the command line."""

from __future__ import annotations

from typing import Annotated

import typer

from composer.cli.support.finite import finite
from composer.cli.support.listing import Json
from composer.cli.support.qos_options import QosWish, takes_qos_options
from composer.cli.support.ros import DEFAULT_TIMEOUT_S, Timeout, ros_session
from composer.cli.support.terminal import say, write
from composer.cli.support.values import as_json


@takes_qos_options
def pub(
    topic: Annotated[str, typer.Argument(metavar="TOPIC")],
    type_name: Annotated[str, typer.Argument(metavar="TYPE", help="std_msgs/msg/String")],
    content: Annotated[
        str,
        typer.Argument(
            metavar="[VALUES]",
            help="The fields as YAML; {expressions} may use count and now.",
            show_default=False,
        ),
    ] = "{}",
    *,
    rate: Annotated[
        float,
        typer.Option("--rate", "-r", min=0.001, callback=finite, metavar="HZ", help="How often."),
    ] = 1.0,
    once: Annotated[bool, typer.Option("--once", "-1", help="Publish once and end.")] = False,
    times: Annotated[
        int | None,
        typer.Option(
            "--times",
            "-t",
            min=1,
            metavar="N",
            help="Publish N times and end.",
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
            help="Wait for N subscriptions first.",
            show_default="1 with --once or --times",
        ),
    ] = None,
    every: Annotated[
        int, typer.Option("--print", "-p", min=1, metavar="N", help="Tell of every Nth message.")
    ] = 1,
    json: Json = False,
    qos: QosWish,
    timeout: Timeout = DEFAULT_TIMEOUT_S,
) -> None:
    """Publish messages on a topic.

    The time limit is for the subscriptions that are waited for. A warning says at the end if a
    reliable one has not acknowledged within a second what was published. With --json each message
    is printed, as it was published, as one JSON object a line.
    """
    from composer.qos import PRESETS

    limit = 1 if once else times
    with ros_session("compose topic", timeout, carries_messages=True) as (session, deadline):
        from composer.remote.name_matching import full_name
        from composer.remote.publishing import NotAcknowledged, Publishing, publish
        from composer.remote.values import class_of, compile_content, to_plain

        publishing = Publishing(
            topic=full_name("topic", topic),
            type_name=type_name,
            build=compile_content(content, class_of(type_name), "the message"),
            qos=qos.applied_to(PRESETS["command"]),
            rate_hz=rate,
            times=limit,
            wait_for=wait_for if wait_for is not None else int(limit is not None),
        )
        try:
            for number, message in enumerate(publish(session, deadline, publishing), 1):
                if number % every:
                    continue
                if json:
                    write(as_json(to_plain(message)))
                else:
                    say(f"published #{number}: {message}")
        except NotAcknowledged as error:  # it is published, and may have arrived
            say(f"warning: {error}\n  {error.hint}")
