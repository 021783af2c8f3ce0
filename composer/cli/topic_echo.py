"""``compose topic echo``: the messages of a topic as they come."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Annotated, Any

import typer

from composer.cli.qos_options import (
    QosDepth,
    QosDurability,
    QosPreset,
    QosReliability,
    QosWish,
)
from composer.cli.ros import DEFAULT_TIMEOUT_S, Timeout, ros_session
from composer.cli.terminal import write
from composer.cli.values import as_json, as_yaml, cut
from composer.cli.wanted_messages import Filter, Silence, compiled_filter, is_wanted

if TYPE_CHECKING:
    from composer.runtime.inspect_topics import Listener
    from composer.runtime.session import Deadline


def echo(
    topic: Annotated[str, typer.Argument(metavar="TOPIC")],
    type_name: Annotated[
        str | None,
        typer.Argument(
            metavar="[TYPE]", help="Its type, if nobody publishes yet.", show_default=False
        ),
    ] = None,
    *,
    once: Annotated[bool, typer.Option("--once", help="Stop after one message.")] = False,
    count: Annotated[
        int | None,
        typer.Option(min=1, metavar="N", help="Stop after N messages.", show_default=False),
    ] = None,
    field: Annotated[
        str | None,
        typer.Option(metavar="PATH", help="Only that part: pose.position.x", show_default=False),
    ] = None,
    condition: Filter = None,
    full_length: Annotated[
        bool, typer.Option("--full-length", "-f", help="Do not cut long lists and texts.")
    ] = False,
    json: Annotated[bool, typer.Option("--json", help="One JSON object a line.")] = False,
    silence: Silence = None,
    qos_profile: QosPreset = None,
    qos_reliability: QosReliability = None,
    qos_durability: QosDurability = None,
    qos_depth: QosDepth = None,
    timeout: Timeout = DEFAULT_TIMEOUT_S,
) -> None:
    """Print messages as they come, until Ctrl-C.

    The subscription asks for no more than what every publisher offers, so that it gets something
    from all of them; --qos-... asks for more.
    """
    wanted = compiled_filter(condition)
    with ros_session("compose topic", timeout) as (session, deadline):
        from composer.runtime.inspect_topics import Listener, Topics
        from composer.runtime.inspect_values import part, to_plain

        topics = Topics(session, deadline)
        name = topic if topic.startswith("/") else f"/{topic}"
        found = type_name or topics.type_of(name)
        wish = QosWish(qos_profile, qos_reliability, qos_durability, qos_depth)
        profile = wish.applied_to(topics.matching(name))
        with Listener(session, name, found, profile) as listener:
            left = 1 if once else count
            for message in _messages(listener, name, silence):
                if not is_wanted(wanted, message):
                    continue
                plain = to_plain(message if field is None else part(message, field))
                _print(plain if full_length or json else cut(plain), json)
                left = None if left is None else left - 1
                if left == 0:
                    return


def _messages(listener: Listener, topic: str, silence: float | None) -> Iterator[Any]:
    from composer.runtime.session import Deadline, NoAnswer

    while True:
        patience: Deadline = Deadline(float("inf") if silence is None else silence)
        received = listener.take(patience)
        if not received:
            raise NoAnswer(f"nothing came over '{topic}' for {silence:g} s")
        for item in received:
            yield item.content


def _print(plain: Any, json: bool) -> None:
    write(as_json(plain) if json else f"{as_yaml(plain)}\n---")
