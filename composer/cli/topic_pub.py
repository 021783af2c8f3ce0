"""``compose topic pub``: publish from the command line."""

from __future__ import annotations

from typing import Annotated

import typer

from composer.cli.qos_options import (
    QosDepth,
    QosDurability,
    QosPreset,
    QosReliability,
    QosWish,
)
from composer.cli.ros import DEFAULT_TIMEOUT_S, Timeout, ros_session
from composer.cli.terminal import say


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
        float, typer.Option("--rate", "-r", min=0.001, metavar="HZ", help="How often.")
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
    qos_profile: QosPreset = None,
    qos_reliability: QosReliability = None,
    qos_durability: QosDurability = None,
    qos_depth: QosDepth = None,
    timeout: Timeout = DEFAULT_TIMEOUT_S,
) -> None:
    """Publish messages on a topic."""
    from composer.qos import PRESETS

    wish = QosWish(qos_profile, qos_reliability, qos_durability, qos_depth)
    limit = 1 if once else times
    with ros_session("compose topic", timeout) as (session, deadline):
        from composer.runtime.inspect_publish import Publishing, publish
        from composer.runtime.inspect_values import class_of, compile_content

        publishing = Publishing(
            topic=topic if topic.startswith("/") else f"/{topic}",
            type_name=type_name,
            build=compile_content(content, class_of(type_name), "the message"),
            qos=wish.applied_to(PRESETS["command"]),
            rate_hz=rate,
            times=limit,
            wait_for=wait_for if wait_for is not None else int(limit is not None),
        )
        for number, message in enumerate(publish(session, deadline, publishing), 1):
            say(f"published #{number}: {message}")
