"""``compose topic echo``: the messages of a topic as they come."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Annotated, Any

import typer

from composer.cli.support.message_format import MessageFormat, takes_format_options
from composer.cli.support.qos_options import QosWish, takes_qos_options
from composer.cli.support.ros import ros_session
from composer.cli.support.terminal import write
from composer.cli.support.wanted_messages import (
    Filter,
    Patience,
    compiled_filter,
    is_wanted,
    message_timeout_s,
    topic_timeout_s,
)

if TYPE_CHECKING:
    from composer.remote.topics import Listener


@takes_format_options
@takes_qos_options
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
    message_format: MessageFormat,
    qos: QosWish,
    timeout: Patience = None,
) -> None:
    """Print messages as they come, until Ctrl-C.

    The subscription asks for no more than what every publisher offers, so that it gets something
    from all of them; --qos-... asks for more.
    """
    wanted = compiled_filter(condition)
    with ros_session("compose topic", topic_timeout_s(timeout), carries_messages=True) as (
        session,
        deadline,
    ):
        from composer.remote.name_matching import full_name
        from composer.remote.topics import Listener, Topics
        from composer.remote.values import part, to_plain

        topics = Topics(session, deadline)
        name = full_name("topic", topic)
        found = type_name or topics.type_of(name)
        profile = qos.applied_to(topics.matching(name))
        with Listener(session, name, found, profile) as listener:
            left = 1 if once else count
            for message in _messages(listener, message_timeout_s(timeout)):
                if not is_wanted(wanted, message):
                    continue
                plain = to_plain(message if field is None else part(message, field))
                write(message_format.text(plain))
                left = None if left is None else left - 1
                if left == 0:
                    return


def _messages(listener: Listener, timeout_s: float) -> Iterator[Any]:
    from composer.remote.session import Deadline

    while True:
        received = listener.take(Deadline(timeout_s))
        if not received:
            raise listener.silence(timeout_s)
        for item in received:
            yield item.content
