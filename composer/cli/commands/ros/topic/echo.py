"""``compose topic echo``: print the messages of a topic."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Annotated, Any

import typer

from composer.cli.commands.ros.topic.message_format import MessageFormat, format_options
from composer.cli.commands.ros.topic.qos_options import QosOptions, qos_options
from composer.cli.commands.ros.topic.receiving import (
    Filter,
    MessageFilter,
    ReceiveTimeout,
    Topic,
    message_timeout_s,
    topic_timeout_s,
)
from composer.cli.support.errors import UsageError
from composer.cli.support.output.terminal import write
from composer.cli.support.ros import ros_session

if TYPE_CHECKING:
    from composer.client.messages.topics import TopicSubscription


def _path(path: str | None) -> str | None:
    """Check ``--field`` before ROS starts."""
    from composer.client.messages.field_paths import path_steps

    if path is not None:
        try:
            path_steps(path)
        except ValueError as error:
            raise typer.BadParameter(str(error)) from error
    return path


@format_options
@qos_options
def echo(
    topic: Topic,
    type_name: Annotated[
        str | None,
        typer.Argument(
            metavar="[TYPE]",
            help="The message type, needed if the topic has no publisher yet.",
            show_default=False,
        ),
    ] = None,
    *,
    once: Annotated[bool, typer.Option("--once", help="Exit after the first message.")] = False,
    count: Annotated[
        int | None,
        typer.Option(min=1, metavar="N", help="Exit after N messages.", show_default=False),
    ] = None,
    field: Annotated[
        str | None,
        typer.Option(
            metavar="PATH",
            help="Print only this field, such as pose.position.x or transforms[0].header.",
            show_default=False,
            callback=_path,
        ),
    ] = None,
    raw: Annotated[
        bool, typer.Option("--raw", help="Print the serialized messages, as Python bytes.")
    ] = False,
    condition: Filter = None,
    message_format: MessageFormat,
    qos: QosOptions,
    timeout: ReceiveTimeout = None,
) -> None:
    """Print messages from a topic.

    By default, the QoS profile of the subscription is compatible with all current publishers.
    Use the --qos-... options to override it.
    """
    message_filter = MessageFilter(condition)
    if raw and (field is not None or condition is not None or message_format.is_one_line):
        raise UsageError(
            "--raw cannot be used with --field, --filter, --json, --csv or --flow-style"
        )
    with ros_session("compose topic", topic_timeout_s(timeout), carries_messages=True) as (
        session,
        deadline,
    ):
        from composer.client.messages.topics import Topics, TopicSubscription
        from composer.client.messages.values import part, to_plain
        from composer.client.name_matching import full_name

        topics = Topics(session, deadline)
        name = full_name("topic", topic)
        found = type_name or topics.type_of(name)
        profile = qos.applied_to(topics.compatible_qos(name))
        with TopicSubscription(session, name, found, profile, raw=raw) as subscription:
            left = 1 if once else count
            for message in _messages(subscription, message_timeout_s(timeout)):
                if not message_filter.matches(message):
                    continue
                if raw:
                    write(f"{message!r}\n---")
                else:
                    plain = to_plain(message if field is None else part(message, field))
                    write(message_format.text(plain))
                left = None if left is None else left - 1
                if left == 0:
                    return


def _messages(subscription: TopicSubscription, timeout_s: float) -> Iterator[Any]:
    from composer.client.session import Deadline

    while True:
        received = subscription.take(Deadline(timeout_s))
        if not received:
            raise subscription.no_message_error(timeout_s)
        for item in received:
            yield item.content
